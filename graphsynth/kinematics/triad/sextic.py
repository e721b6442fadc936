"""The self-inversive sextic of the direct problem (3-RPR): explicit coefficients.

``G(alpha) = g0 + 2 Re(g1 z + g2 z^2 + g3 z^3)``, ``z = exp(i alpha)``: a trigonometric polynomial of degree three, so
nothing special happens at alpha = pi.  Its real roots are found in ``kernels.modes``.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

__all__ = ["Sextic", "sextic"]

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]


class Sextic(NamedTuple):
    """Coefficients of G, of ``N(z)`` and of ``Delta(z)`` (theory/platform-direct 1); arrays of one shape.

    ``n = (n2, n1, n0, nm)``, ``d = (d0, de)``, ``g = (g0, g1, g2, g3)``.
    """

    g: tuple[Array, Complex, Complex, Complex]
    n: tuple[Complex, Complex, Complex, Complex]
    d: tuple[Complex, Complex]


def sextic(anchors: Complex, vertices: Complex, lengths: Array) -> Sextic:
    """Coefficients for anchors A_k, platform vertices b_k and leg lengths, each of shape (..., 3).

    Unit of g: length^6.  Scale the lengths to about one before use.

    Examples
    --------
    >>> s = sextic(np.array([0, 2, 1 + 1j]), np.array([0, 1, 0.5 + 1j]), np.array([1.0, 1.5, 1.25]))
    >>> b2, b3, a2, a3 = 1, 0.5 + 1j, 2, 1 + 1j  # the leading coefficient has a closed form
    >>> bool(abs(s.g[3] - b2 * b3 * (b3 - b2) * np.conj(a2 * a3 * (a2 - a3))) < 1e-14)
    True
    """
    A, b = np.asarray(anchors, dtype=np.complex128), np.asarray(vertices, dtype=np.complex128)
    l2 = np.asarray(lengths, dtype=np.float64)
    conj = np.conj
    a2, a3 = A[..., 1] - A[..., 0], A[..., 2] - A[..., 0]
    b2, b3 = b[..., 1] - b[..., 0], b[..., 2] - b[..., 0]
    L: Array = np.asarray(l2[..., 0] ** 2)

    def offset(k: int, a: Complex, c: Complex) -> Array:
        legs = (l2[..., k] - l2[..., 0]) * (l2[..., k] + l2[..., 0])
        return np.asarray(legs - _square(a) - _square(c))

    w20, w30, w21, w31 = offset(1, a2, b2), offset(2, a3, b3), b2 * conj(a2), b3 * conj(a3)
    n2 = w21 * b3 - w31 * b2
    n1 = w20 * b3 - w21 * a3 - w30 * b2 + w31 * a2
    n0 = -w20 * a3 + conj(w21) * b3 + w30 * a2 - conj(w31) * b2
    nm = -conj(w21) * a3 + conj(w31) * a2
    d0: Complex = np.asarray(2j * (conj(b2) * b3 + conj(a2) * a3).imag, dtype=np.complex128)
    de = b2 * conj(a3) - conj(a2) * b3
    g3 = n2 * conj(nm)
    g2 = n2 * conj(n0) + n1 * conj(nm) + L * de * de
    g1 = n2 * conj(n1) + n1 * conj(n0) + n0 * conj(nm) + 2.0 * L * d0 * de
    squares: Array = _square(n2) + _square(n1) + _square(n0) + _square(nm)
    g0 = squares - L * (_square(d0) + 2.0 * _square(de))
    return Sextic((g0, g1, g2, g3), (n2, n1, n0, nm), (d0, de))


def _square(z: Complex) -> Array:
    return np.asarray(z.real * z.real + z.imag * z.imag)
