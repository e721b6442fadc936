"""A survey of all four-bar linkages on a lattice of lengths."""
