"""The 26 capital letters as closed curves: the outer outlines of DejaVu Sans, the open font of matplotlib."""

from __future__ import annotations

import string

import numpy as np
from numpy.typing import NDArray

LETTERS = string.ascii_uppercase


def outline(letter: str, count: int = 64) -> NDArray[np.complex128]:
    """Return points of equal distance along the outer outline of a letter, its size (of its box, the longer side) 1."""
    from matplotlib.font_manager import FontProperties
    from matplotlib.textpath import TextPath

    polygons = TextPath((0, 0), letter, 100.0, prop=FontProperties(family="DejaVu Sans")).to_polygons(closed_only=True)
    outer = max((p[:, 0] + 1j * p[:, 1] for p in polygons), key=lambda z: abs(area(z)))
    along = np.concatenate([[0.0], np.cumsum(np.abs(np.diff(outer)))])
    at = np.linspace(0.0, along[-1], count, endpoint=False)
    z = np.interp(at, along, outer.real) + 1j * np.interp(at, along, outer.imag)
    centre = complex(0.5 * (z.real.min() + z.real.max()), 0.5 * (z.imag.min() + z.imag.max()))
    return np.asarray((z - centre) / max(np.ptp(z.real), np.ptp(z.imag)))


def area(z: NDArray[np.complex128]) -> float:
    """Signed area of a polygon."""
    return 0.5 * float((np.conj(z) * np.roll(z, -1)).imag.sum())
