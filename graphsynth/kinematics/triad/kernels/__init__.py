"""Compiled kernels of the parallel platform: the two-link leg, the assembly modes, the turn of the single motor."""
