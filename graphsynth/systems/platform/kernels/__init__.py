"""Compiled kernels of the single-motor platform."""
