"""Compiled kernels of the enumerator: flat arrays in, flat arrays out."""
