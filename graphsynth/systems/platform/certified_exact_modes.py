"""Rational direct problems at an exact singularity: multiplicities by exact polynomial arithmetic, and self-motions."""

from __future__ import annotations

from fractions import Fraction
from math import lcm
from typing import Any, NamedTuple

import flint

from graphsynth.intervals.exact import Gaussian, ball, complex_ball
from graphsynth.systems.platform.certified_sextic_balls import sextic_balls

__all__ = ["ExactRoot", "exact_roots", "parallel_positions", "self_motion"]

_ZERO = Gaussian(Fraction(0), Fraction(0))


class ExactRoot(NamedTuple):
    """A real root alpha of G as a ball, its multiplicity, and ``exp(i alpha)`` where tan(alpha / 2) is rational."""

    alpha: Any
    multiplicity: int
    z: Gaussian | None


def exact_roots(A: list[Gaussian], b: list[Gaussian], lengths: list[Fraction]) -> list[ExactRoot] | None:
    """All real roots of G with their multiplicities; None if G vanishes identically.

    With ``t = tan(alpha / 2)``, ``R(t) = (1 + t^2)^3 G`` is a real polynomial of degree at most six; its real roots are
    the modes, and the drop of its degree is the multiplicity of alpha = pi.  Multiplicities come from the factors over
    the rationals, and flint proves which roots are real.
    """
    coefficients = _half_angle(A, b, lengths)
    if not any(coefficients):
        return None
    common = lcm(*(c.denominator for c in coefficients))
    poly = flint.fmpz_poly([int(c * common) for c in coefficients])
    found = []
    for factor, multiplicity in poly.factor()[1]:
        if factor.degree() == 1:
            t = Fraction(-int(factor[0]), int(factor[1]))
            z = Gaussian((1 - t * t) / (1 + t * t), 2 * t / (1 + t * t))
            found.append(ExactRoot(2 * ball(t).atan(), int(multiplicity), z))
            continue
        for root, _ in factor.complex_roots():
            if root.imag.is_zero():
                found.append(ExactRoot(2 * root.real.atan(), int(multiplicity), None))
    missing = 6 - poly.degree()
    if missing:
        found.append(ExactRoot(flint.arb.pi(), missing, Gaussian(Fraction(-1), Fraction(0))))
    return sorted(found, key=lambda root: float(root.alpha))


def parallel_positions(A: list[Gaussian], b: list[Gaussian], lengths: list[Fraction], z: Gaussian) -> list[Any] | None:
    """Positions p of the platform at an orientation z where Delta vanishes, as balls; None if it does not vanish.

    The two linear equations ``dot(e_k, Q) = w_k / 2`` then describe one line, which meets the circle ``|Q| = l2_1`` at
    most twice, or contradict each other; both are decided exactly (theory/platform-direct 3).
    """
    e = [z * (b[k] - b[0]) - (A[k] - A[0]) for k in (1, 2)]
    if (e[0].conj * e[1]).imag != 0:
        return None
    L = lengths[0] ** 2
    sizes = [(v * v.conj).real for v in e]
    w = [lengths[k] ** 2 - L - sizes[k - 1] for k in (1, 2)]
    k = 0 if sizes[0] > 0 else 1
    if sizes[k] == 0:
        return []  # equal legs would be a self-motion, which is recognised before
    factor = (e[k].conj * e[1 - k]).real / sizes[k]
    rest = (L - w[k] ** 2 / (4 * sizes[k])) / sizes[k]
    if w[1 - k] != factor * w[k] or rest < 0:
        return []
    across = ball(rest).sqrt()
    origin = complex_ball(A[0]) - complex_ball(z) * complex_ball(b[0])
    sides = (across, -across) if rest > 0 else (flint.arb(0),)
    return [origin + complex_ball(e[k]) * flint.acb(ball(w[k] / (2 * sizes[k])), side) for side in sides]


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
