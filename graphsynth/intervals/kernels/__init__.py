"""Compiled interval arithmetic: scalar functions of bounds, callable from other kernels, and loops over arrays."""

from pathlib import Path

from graphsynth.compilation import drop_stale_kernels

drop_stale_kernels(Path(__file__).parent)
