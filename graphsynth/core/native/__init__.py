"""Kernels compiled ahead of time: the library of their machine code, and how it is made."""
