"""Vectors of the plane as complex numbers: cross product, directions."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray


def cross(a: Any, b: Any) -> Any:
    """Cross product ``x_a y_b - y_a x_b`` of complex numbers or arrays of them.

    >>> cross(1 + 2j, 3 - 1j)
    -7.0
    """
    return a.real * b.imag - a.imag * b.real


def directions(angles: Sequence[float]) -> NDArray[np.complex128]:
    """``exp(i beta)`` for angles in radians, with multiples of 30 degrees rounded correctly.

    >>> directions([math.pi / 6, -math.pi / 2]).tolist()
    [(0.8660254037844386+0.5j), -1j]
    """
    twelfths = [round(angle * 6.0 / math.pi) for angle in angles]
    table = [0.0, 0.5, 0.5 * math.sqrt(3.0), 1.0, 0.5 * math.sqrt(3.0), 0.5]

    def sine(k: int) -> float:
        k %= 12
        return table[k] if k < 6 else 0.0 - table[k - 6]  # 0.0, not -0.0

    return np.array(
        [
            complex(sine(k + 3), sine(k)) if abs(angle - k * math.pi / 6.0) < 1e-15 else np.exp(1j * angle)
            for k, angle in zip(twelfths, angles)
        ]
    )
