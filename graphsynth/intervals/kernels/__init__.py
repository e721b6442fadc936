"""Compiled interval arithmetic: scalar functions of bounds, callable from other kernels, and loops over arrays."""
