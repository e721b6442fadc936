"""Sketches of kinematic diagrams and graphs as plain SVG, and plots through matplotlib."""
