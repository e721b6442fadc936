"""Chebyshev's lambda linkage with a tilted motor axis."""
