"""Compiled kernels of the nine-point problem: equations with their slopes, paths of roots."""
