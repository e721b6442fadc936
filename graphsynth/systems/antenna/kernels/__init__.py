"""Compiled kernels of the pointing mechanism: poses in bulk."""
