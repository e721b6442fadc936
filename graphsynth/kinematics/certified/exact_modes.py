"""Rational direct problems at an exact singularity: multiplicities by exact polynomial arithmetic, and self-motions."""

from __future__ import annotations

from fractions import Fraction
from math import lcm
from typing import Any

from graphsynth.kinematics.certified.extra import need_flint
from graphsynth.kinematics.certified.numbers import Gaussian
from graphsynth.kinematics.certified.sextic_balls import sextic_balls

__all__ = ["exact_roots", "self_motion"]

_ZERO = Gaussian(Fraction(0), Fraction(0))


def exact_roots(A: list[Gaussian], b: list[Gaussian], lengths: list[Fraction]) -> list[tuple[Any, int]] | None:
    """All real roots alpha of G as balls with their multiplicities; None if G vanishes identically.

    With ``t = tan(alpha / 2)``, ``R(t) = (1 + t^2)^3 G`` is a real polynomial of degree at most six; its real roots are
    the modes; the drop of its degree is the multiplicity of alpha = pi.  Multiplicities come from greatest common
    divisors over the rationals, and flint proves which roots are real.
    """
    flint = need_flint()
    coefficients = _half_angle(A, b, lengths)
    if not any(coefficients):
        return None
    common = lcm(*(c.denominator for c in coefficients))
    poly = flint.fmpz_poly([int(c * common) for c in coefficients])
    found = [(2 * root.real.atan(), int(m)) for root, m in poly.complex_roots() if root.imag.is_zero()]
    missing = 6 - poly.degree()
    if missing:
        found.append((flint.arb.pi(), missing))
    return sorted(found, key=lambda pair: float(pair[0]))


def _half_angle(A: list[Gaussian], b: list[Gaussian], lengths: list[Fraction]) -> list[Fraction]:
    """Coefficients of R(t), ascending: ``z = w^2 / (1 + t^2)`` with ``w = 1 + i t``."""
    g0, g1, g2, g3 = sextic_balls(A, b, lengths).g
    one = Gaussian(Fraction(1), Fraction(0))
    w2 = _times([one, Gaussian(Fraction(0), Fraction(1))], [one, Gaussian(Fraction(0), Fraction(1))])
    q = [one, _ZERO, one]
    w4, q2 = _times(w2, w2), _times(q, q)
    total = [c * g0 for c in _times(q2, q)]
    for g, term in ((g1, _times(w2, q2)), (g2, _times(w4, q)), (g3, _times(w4, w2))):
        total = [have + 2 * (g * c) for have, c in zip(total, term)]
    return [c.real for c in total]


def _times(p: list[Gaussian], q: list[Gaussian]) -> list[Gaussian]:
    product = [_ZERO] * (len(p) + len(q) - 1)
    for i, a in enumerate(p):
        for j, c in enumerate(q):
            product[i + j] = product[i + j] + a * c
    return product


def self_motion(A: list[Gaussian], b: list[Gaussian], lengths: list[Fraction]) -> bool:
    """Whether the platform translates on a circle: its triangle is the anchors' turned, and the legs are equal.

    Exact.  ``a_k = zeta b_k`` for k = 2, 3 with ``|zeta| = 1`` means ``a_2 b_3 = a_3 b_2`` and ``|a_k| = |b_k|``
    (a platform that is not a point).
    """
    if len(set(lengths)) != 1 or lengths[0] == 0:
        return False
    a2, a3, b2, b3 = A[1] - A[0], A[2] - A[0], b[1] - b[0], b[2] - b[0]
    same = [(a * a.conj).real == (c * c.conj).real for a, c in ((a2, b2), (a3, b3))]
    return all(same) and a2 * b3 == a3 * b2
