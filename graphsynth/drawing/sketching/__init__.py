"""Sketches for other programs: TikZ and DXF, and pictures of graphs by suffix."""
