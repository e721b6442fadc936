"""Compiled kernels of the enumerator: flat arrays in, flat arrays out."""

from graphsynth.compilation import drop_stale_kernels

drop_stale_kernels()
