"""Compiled kernels of the parallel platform: the two-link leg, the assembly modes, the turn of the single motor."""

from pathlib import Path

from graphsynth.compilation import drop_stale_kernels

drop_stale_kernels(Path(__file__).parent)
