"""All real roots of the self-inversive sextic of the direct problem (3-RPR): coefficients, isolation, refinement.

``G(alpha) = g0 + 2 Re(g1 z + g2 z^2 + g3 z^3)``, ``z = exp(i alpha)``: a trigonometric polynomial of degree three, so
nothing special happens at alpha = pi.  Roots are isolated by sampling with a bound on the second derivative; the count
is then guaranteed for the polynomial with the computed coefficients, except where ``near_double`` is set.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

__all__ = ["RealRoots", "Sextic", "real_roots", "sextic"]

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]

_NODES = 32
_NARROW = 1e-6  # below this width and the rounding level, bisection proves nothing more
_NARROWEST = 1e-10


class Sextic(NamedTuple):
    """Coefficients of G, of ``N(z)`` and of ``Delta(z)`` (section 5.1); arrays of one shape.

    ``n = (n2, n1, n0, nm)``, ``d = (d0, de)``, ``g = (g0, g1, g2, g3)``.
    """

    g: tuple[Array, Complex, Complex, Complex]
    n: tuple[Complex, Complex, Complex, Complex]
    d: tuple[Complex, Complex]


class RealRoots(NamedTuple):
    """Roots of many problems in one list: ``alpha[i]`` belongs to ``problem[i]``; ``near_double`` is per problem."""

    problem: NDArray[np.intp]
    alpha: Array
    near_double: NDArray[np.bool_]


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


class _Polynomial:
    """G of a list of problems, evaluated at angles of chosen problems."""

    def __init__(self, s: Sextic) -> None:
        g0, g1, g2, g3 = (np.atleast_1d(c) for c in s.g)
        self.g0, self.g1, self.g2, self.g3 = g0, g1, g2, g3
        size = [np.abs(c) for c in (g0, g1, g2, g3)]
        self.eta = 4e-15 * (size[0] + 2.0 * (size[1] + size[2] + size[3]))
        self.bend = 2.0 * (size[1] + 4.0 * size[2] + 9.0 * size[3])  # bound of |G''|

    def value(self, i: NDArray[np.intp], alpha: Array) -> Array:
        z = np.exp(1j * alpha)
        return np.asarray(self.g0[i] + 2.0 * (z * (self.g1[i] + z * (self.g2[i] + z * self.g3[i]))).real)

    def slope(self, i: NDArray[np.intp], alpha: Array) -> Array:
        z = np.exp(1j * alpha)
        return np.asarray(-2.0 * (z * (self.g1[i] + z * (2.0 * self.g2[i] + 3.0 * z * self.g3[i]))).imag)


def real_roots(s: Sextic) -> RealRoots:
    """All real roots alpha in [-pi, pi] of G for every problem of ``s`` (arrays of shape (N,)), sorted.

    The count is guaranteed for the computed coefficients wherever ``near_double`` is False (section 5.2).
    """
    poly = _Polynomial(s)
    count = poly.g0.size
    nodes = np.linspace(-math.pi, math.pi, _NODES + 1)
    problem = np.repeat(np.arange(count), _NODES)
    low, high = np.tile(nodes[:-1], count), np.tile(nodes[1:], count)
    # both ends of a shared node must be judged by the same number, or a root on a node is lost or doubled
    grid = poly.value(np.repeat(np.arange(count), _NODES + 1), np.tile(nodes, count)).reshape(count, _NODES + 1)
    grid[:, -1] = grid[:, 0]
    at_low, at_high = grid[:, :-1].ravel(), grid[:, 1:].ravel()
    found: list[tuple[NDArray[np.intp], Array, Array, Array]] = []
    flagged = np.zeros(count, dtype=bool)
    while problem.size:
        width, middle = high - low, 0.5 * (low + high)
        same = (at_low >= 0.0) == (at_high >= 0.0)
        least = np.minimum(np.abs(at_low), np.abs(at_high))
        bend, eta = poly.bend[problem], poly.eta[problem]
        empty = same & (least > bend * width * width / 8.0 + eta)
        monotone = np.abs(poly.slope(problem, middle)) > 0.5 * bend * width + 3.0 * eta
        single = monotone & ~same
        found.append((problem[single], low[single], high[single], at_low[single]))
        rest = ~(empty | monotone)
        stuck = rest & (((width < _NARROW) & (least <= eta)) | (width < _NARROWEST))
        flagged[problem[stuck]] = True
        rest &= ~stuck
        problem, low, middle, high = problem[rest], low[rest], middle[rest], high[rest]
        at_low, at_high, at_middle = at_low[rest], at_high[rest], poly.value(problem, middle)
        problem, low, high = np.tile(problem, 2), np.r_[low, middle], np.r_[middle, high]
        at_low, at_high = np.r_[at_low, at_middle], np.r_[at_middle, at_high]
    owner, left, right, start = (np.concatenate(parts) for parts in zip(*found))
    alpha = _refine(poly, owner, left, right, start)
    order = np.lexsort((alpha, owner))
    return RealRoots(owner[order], alpha[order], flagged)


def _refine(poly: _Polynomial, i: NDArray[np.intp], low: Array, high: Array, at_low: Array) -> Array:
    """Newton iteration kept inside its bracket; at most as many steps as bisection to the last bit would need."""
    alpha = 0.5 * (low + high)
    positive = at_low >= 0.0
    for _ in range(60):
        value = poly.value(i, alpha)
        left = (value >= 0.0) == positive
        low, high = np.where(left, alpha, low), np.where(left, high, alpha)
        slope = poly.slope(i, alpha)
        step = alpha - value / np.where(slope == 0.0, np.inf, slope)
        inside = (step > low) & (step < high) & (slope != 0.0)
        new = np.where(inside, step, 0.5 * (low + high))
        done = bool(np.all(np.abs(new - alpha) <= 2e-16 * (1.0 + np.abs(alpha))))
        alpha = new
        if done:
            break
    return alpha
