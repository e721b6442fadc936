"""The two-link leg (RRR dyad with a fixed pivot): angle of the arm for a given end point.

Shared by the legs of the parallel platform and by the four-bar drives.  The three discriminants are differences of
squares, evaluated as error-free sums of products: unequal lengths and poses on the boundary of the reach keep digits.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from enum import IntEnum

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]

_SPLITTER = 134217729.0  # 2^27 + 1, Dekker's constant for binary64


class LegStatus(IntEnum):
    """Reach of one leg."""

    REACHABLE = 0
    BOUNDARY = 1  #: stretched or folded: S = 0, both branches coincide
    TOO_FAR = 2
    TOO_NEAR = 3
    FREE = 4  #: every angle solves the leg


@dataclass(frozen=True, eq=False)
class LegSolution:
    """Reach of a leg and the ingredients of its two angles; every array has the broadcast shape of the input.

    ``u``, ``v``: the end point relative to the pivot.  ``S``, ``C``: ``2 l1 rho sin(gamma)`` and
    ``2 l1 rho cos(gamma)`` with gamma the angle between end point and arm; S is NaN out of reach.  They overflow for
    lengths above 1e154 and underflow below 1e-154; the angles do not, for which S and C are kept ``scaled``, divided by
    ``4^exponent``, with the exponent of the largest given number.  ``status``: `LegStatus`.  ``deficit``: the signed
    distance missing, positive out of reach; negative is the margin left.
    """

    u: Array
    v: Array
    status: NDArray[np.int8]
    deficit: Array
    scaled: tuple[Array, Array]
    exponent: NDArray[np.int32]

    @property
    def S(self) -> Array:
        """``2 l1 rho sin(gamma)``, squared length."""
        with np.errstate(over="ignore", under="ignore"):
            return np.asarray(np.ldexp(self.scaled[0], 2 * self.exponent))

    @property
    def C(self) -> Array:
        """``2 l1 rho cos(gamma)``, squared length."""
        with np.errstate(over="ignore", under="ignore"):
            return np.asarray(np.ldexp(self.scaled[1], 2 * self.exponent))

    def angle(self, sigma: ArrayLike) -> Array:
        """Angle of the arm (radians, in (-pi, pi]) on branch ``sigma`` = +1 or -1; NaN if out of reach or free."""
        sigma = np.asarray(sigma, dtype=np.float64)
        (u, v), (C, S) = _normalised(self.u, self.v), _normalised(self.scaled[1], self.scaled[0])
        y, x = _dot2(v, C, sigma * u, S), _dot2(u, C, -sigma * v, S)
        return np.where(self.status == LegStatus.FREE, np.nan, np.arctan2(y, x))


def _normalised(a: Array, b: Array) -> tuple[Array, Array]:
    """Both numbers divided by one power of two, so that products neither overflow nor underflow."""
    shift = -np.frexp(np.fmax(np.abs(a), np.abs(b)))[1]
    return np.asarray(np.ldexp(a, shift)), np.asarray(np.ldexp(b, shift))


def _two_sum(a: Array, b: Array) -> tuple[Array, Array]:
    total = a + b
    part = total - a
    return total, (a - (total - part)) + (b - part)


def _two_product(a: Array, b: Array) -> tuple[Array, Array]:
    product = a * b
    high_a, high_b = _SPLITTER * a, _SPLITTER * b
    high_a, high_b = high_a - (high_a - a), high_b - (high_b - b)
    low_a, low_b = a - high_a, b - high_b
    return product, ((high_a * high_b - product) + high_a * low_b + low_a * high_b) + low_a * low_b


def _dot2(a: Array, b: Array, c: Array, d: Array) -> Array:
    """Return ``a b + c d`` without cancellation error from the products."""
    p, e = _two_product(a, b)
    q, f = _two_product(c, d)
    total, rest = _two_sum(p, q)
    return np.asarray(total + (rest + e + f))


def _discriminants(u: Array, v: Array, l1: Array, l2: Array) -> tuple[Array, Array, Array]:
    """``C``, ``P1 = (l1 + l2)^2 - rho^2`` and ``P2 = rho^2 - (l1 - l2)^2``, each correctly rounded but for an ulp."""
    uu, vv, aa, bb, ab = (_two_product(x, y) for x, y in ((u, u), (v, v), (l1, l1), (l2, l2), (l1, l2)))

    def combine(*parts: tuple[int, tuple[Array, Array]]) -> Array:
        """Sum as if computed in three-fold working precision ([Ogita et al. 2005], algorithm SumK with K = 3)."""
        terms = [factor * term for factor, pair in parts for term in pair]
        for _ in range(2):
            for index in range(1, len(terms)):
                terms[index], terms[index - 1] = _two_sum(terms[index], terms[index - 1])
        return np.asarray(sum(terms[:-1]) + terms[-1])

    C = combine((1, uu), (1, vv), (1, aa), (-1, bb))
    P1 = combine((1, aa), (2, ab), (1, bb), (-1, uu), (-1, vv))
    P2 = combine((1, uu), (1, vv), (-1, aa), (2, ab), (-1, bb))
    return C, P1, P2


def solve_leg(u: ArrayLike, v: ArrayLike, l1: ArrayLike, l2: ArrayLike) -> LegSolution:
    """Reach and angles of a leg with arm ``l1`` and link ``l2`` that ends at (u, v) from its pivot.

    Absolute error of the angle at most about 4e-16 rad for the given double-precision numbers; the status is decided by
    the sign of compensated sums, not by a tolerance (theory/platform-inverse 5 to 7).  Nothing is checked here.

    Examples
    --------
    >>> leg = solve_leg(45.0, 60.0, 45.0, 60.0)
    >>> LegStatus(int(leg.status)).name, round(float(leg.angle(-1)), 12)
    ('REACHABLE', -0.0)
    """
    given = np.broadcast_arrays(*(np.asarray(x, dtype=np.float64) for x in (u, v, l1, l2)))
    exponent = np.frexp(np.max(np.abs(np.stack(given)), axis=0))[1]
    u, v, l1, l2 = (np.asarray(np.ldexp(x, -exponent)) for x in given)  # exact: no overflow in the squares
    C, P1, P2 = _discriminants(u, v, l1, l2)
    rho = np.hypot(u, v)
    far, near = _quotient(-P1, rho + (l1 + l2)), _quotient(-P2, rho + np.abs(l1 - l2))
    root = np.where(l1 == l2, rho, np.sqrt(np.maximum(P2, 0.0)))  # P2 is rho^2 there, which may underflow
    status = np.zeros(u.shape, dtype=np.int8)
    status[(P1 == 0.0) | (root == 0.0)] = LegStatus.BOUNDARY
    status[((rho == 0.0) & (l1 == l2)) | ((l1 == 0.0) & (P1 == 0.0))] = LegStatus.FREE
    status[P2 < 0.0] = LegStatus.TOO_NEAR
    status[P1 < 0.0] = LegStatus.TOO_FAR
    inside = (P1 >= 0.0) & (P2 >= 0.0)
    S = np.where(inside, np.sqrt(np.where(inside, P1, 0.0)) * root, np.nan)
    deficit = np.ldexp(np.maximum(far, near), exponent)
    return LegSolution(np.ldexp(u, exponent), np.ldexp(v, exponent), status, deficit, (S, C), exponent)


def _quotient(a: Array, b: Array) -> Array:
    return np.where(b > 0.0, a / np.where(b > 0.0, b, 1.0), 0.0)


def sensitivity(S: ArrayLike, l2: ArrayLike) -> Array:
    """Bound of ``|d theta| / |dF|``, ``2 l2 / S``; infinite on the boundary of the reach."""
    S = np.asarray(S, dtype=np.float64)
    with np.errstate(divide="ignore"):
        return np.where(S > 0.0, 2.0 * np.asarray(l2) / S, math.inf)


def length_constants(l1: Array, l2: Array) -> Array:
    """Constants of a leg for the kernels, shape (..., 8).

    The pairs ``l1^2 - l2^2``, ``(l1 + l2)^2``, ``(l1 - l2)^2`` (value, rounding error), ``l1 + l2``, ``|l1 - l2|``.
    """
    with np.errstate(over="ignore", invalid="ignore"):
        (s, sl), (d, dl) = _two_sum(l1, l2), _two_sum(l1, -l2)
        (p, e), (q, f), (r, g) = _two_product(s, d), _two_product(s, s), _two_product(d, d)
        parts = p, e + (s * dl + sl * d), q, f + 2.0 * s * sl, r, g + 2.0 * d * dl, s, np.abs(d)
    return np.ascontiguousarray(np.stack(parts, axis=-1))


class PlatformLegs:
    """Three legs of a platform, solved in bulk by compiled code.

    The compiled evaluation keeps every sum as a pair of numbers; the few legs within about 1e-15 of their boundary,
    free legs and extreme magnitudes are solved again by `solve_leg`, so that both give the same status.

    D are the pivots in the fixed frame, b the vertices in the platform frame, l1 and l2 the arms and links.
    """

    def __init__(self, D: Sequence[complex], b: Sequence[complex], l1: Sequence[float], l2: Sequence[float]) -> None:
        self._D, self._b = np.array(D, dtype=np.complex128), np.array(b, dtype=np.complex128)
        self._l1, self._l2 = np.array(l1, dtype=np.float64), np.array(l2, dtype=np.float64)
        self._flat = self._D.view(np.float64).reshape(3, 2), self._b.view(np.float64).reshape(3, 2)
        self._constants = length_constants(self._l1, self._l2)

    def solve(self, pose: Array, sigma: Array, modes: int) -> tuple[Array, NDArray[np.int8]]:
        """Angles (n, modes, 3) and status (n, 3) of poses (n, 3).

        ``modes`` is 1 with sigma of shape (1, 3) or (n, 3), or 8 with sigma the table of the working modes.
        """
        from graphsynth.kinematics.triad.kernels.leg import inverse

        theta, status, none = np.empty((len(pose), modes, 3)), np.empty((len(pose), 3), dtype=np.int8), np.empty((0, 3))
        if inverse(pose, *self._flat, self._constants, sigma, theta, status, none, none):
            rows, legs, exact = self._exact(pose, status)
            status[rows, legs] = exact.status
            for mode in range(modes):
                side = sigma[mode, legs] if modes > 1 else np.broadcast_to(sigma, pose.shape)[rows, legs]
                theta[rows, mode, legs] = exact.angle(side)
        return theta, status

    def reach(self, pose: Array) -> tuple[Array, Array]:
        """S and the signed deficit, each (n, 3); S is NaN out of reach."""
        from graphsynth.kinematics.triad.kernels.leg import inverse

        S, deficit, status = np.empty(pose.shape), np.empty(pose.shape), np.empty(pose.shape, dtype=np.int8)
        theta = np.empty((len(pose), 1, 3))
        if inverse(pose, *self._flat, self._constants, np.ones((1, 3)), theta, status, S, deficit):
            rows, legs, exact = self._exact(pose, status)
            S[rows, legs], deficit[rows, legs] = exact.S, exact.deficit
        return S, deficit

    def _exact(self, pose: Array, status: NDArray[np.int8]) -> tuple[NDArray[np.intp], NDArray[np.intp], LegSolution]:
        from graphsynth.kinematics.triad.kernels.leg import HARD

        rows, legs = np.nonzero(status == HARD)
        x, y, alpha = pose[rows].T
        w = (x + 1j * y) + np.exp(1j * alpha) * self._b[legs] - self._D[legs]
        return rows, legs, solve_leg(w.real, w.imag, self._l1[legs], self._l2[legs])
