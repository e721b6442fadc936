"""Compiled kernels of the enumerator: flat arrays in, flat arrays out."""

from pathlib import Path

from graphsynth.compilation import drop_stale_kernels
from graphsynth.structure import kernels as _structure

drop_stale_kernels(Path(__file__).parent, Path(_structure.__file__))
