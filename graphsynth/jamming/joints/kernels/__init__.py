"""Compiled kernels: how joints share misaligned axes at a pose."""
