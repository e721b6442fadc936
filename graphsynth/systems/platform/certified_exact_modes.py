"""Rational direct problems at an exact singularity: multiplicities by exact polynomial arithmetic, and self-motions.

Real roots of the sextic of the direct problem in balls of any precision: isolation on the circle, refinement.

``G(alpha) = g0 + 2 Re(g1 z + g2 z^2 + g3 z^3)`` with ``z = exp(i alpha)``; theory/platform-direct 1, 2, 5.
"""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction
from functools import lru_cache
from itertools import pairwise
from math import lcm
from typing import Any, NamedTuple

import flint

from graphsynth.intervals.reading import Gaussian, ball, complex_ball

_NODES = 32
#: Nodes are shifted by 1/997 of a turn over the number of nodes: no simple fraction of a turn is a node.
_SHIFT = 997


@dataclass(frozen=True, eq=False)
class SexticBalls:
    """Coefficients of G, of ``N(z)`` and ``Delta(z)``, as balls."""

    g: tuple[Any, Any, Any, Any]
    n: tuple[Any, Any, Any, Any]
    d: tuple[Any, Any]

    def value(self, z: Any) -> Any:
        """Return G at a point of the circle."""
        g0, g1, g2, g3 = self.g
        return g0 + 2 * (z * (g1 + z * (g2 + z * g3))).real

    def slope(self, z: Any) -> Any:
        """Return the derivative of G by alpha."""
        _, g1, g2, g3 = self.g
        return -2 * (z * (g1 + z * (2 * g2 + z * (3 * g3)))).imag

    def bend(self) -> Any:
        """Bound of ``|G''|`` over the circle."""
        _, g1, g2, g3 = self.g
        return 2 * (abs(g1) + 4 * abs(g2) + 9 * abs(g3))


class Isolation(NamedTuple):
    """Intervals of turns ``(t0, t1)``, alpha = 2 pi t, with one simple root each; or a reason for none."""

    roots: list[tuple[Any, Any]]
    reason: str
    halvings: int


def sextic_balls(A: list[Any], b: list[Any], lengths: list[Any]) -> SexticBalls:
    """Coefficients for anchors, vertices (acb, or exact `Gaussian`) and leg lengths (arb, or Fraction)."""
    conj = _conjugate
    a2, a3, b2, b3 = A[1] - A[0], A[2] - A[0], b[1] - b[0], b[2] - b[0]
    squares = [x * x for x in lengths]
    L = squares[0]

    def offset(k: int, a: Any, c: Any) -> Any:
        return squares[k] - L - _square(a) - _square(c)

    w20, w30, w21, w31 = offset(1, a2, b2), offset(2, a3, b3), b2 * conj(a2), b3 * conj(a3)
    n2 = w21 * b3 - w31 * b2
    n1 = w20 * b3 - w21 * a3 - w30 * b2 + w31 * a2
    n0 = -w20 * a3 + conj(w21) * b3 + w30 * a2 - conj(w31) * b2
    nm = conj(w31) * a2 - conj(w21) * a3
    twice = 2 * (conj(b2) * b3 + conj(a2) * a3).imag
    d0 = Gaussian(Fraction(0), twice) if isinstance(b2, Gaussian) else flint.acb(0, twice)
    de = b2 * conj(a3) - conj(a2) * b3
    g3 = n2 * conj(nm)
    g2 = n2 * conj(n0) + n1 * conj(nm) + L * de * de
    g1 = n2 * conj(n1) + n1 * conj(n0) + n0 * conj(nm) + 2 * L * d0 * de
    g0 = _square(n2) + _square(n1) + _square(n0) + _square(nm) - L * (_square(d0) + 2 * _square(de))
    return SexticBalls((g0, g1, g2, g3), (n2, n1, n0, nm), (d0, de))


def _conjugate(z: Any) -> Any:
    if isinstance(z, Gaussian):
        return z.conj
    return flint.acb(z.real, -z.imag)


def _square(z: Any) -> Any:
    return z.real * z.real + z.imag * z.imag


def _point(t: Any) -> Any:
    """``exp(2 pi i t)`` for a rational t."""
    s, c = flint.arb.sin_cos_pi_fmpq(2 * t)
    return flint.acb(c, s)


@lru_cache(maxsize=16)
def _nodes(bits: int) -> tuple[tuple[Any, Any], ...]:
    fmpq = flint.fmpq
    turns = [fmpq(k, _NODES) + fmpq(1, _NODES * _SHIFT) for k in range(_NODES)]
    return tuple((t, _point(t)) for t in turns)


def isolate(s: SexticBalls, bits: int, *, halvings: int = 4000) -> Isolation:
    """Prove the number of real roots by halving arcs of the circle; every node must have a proved sign."""
    signed = [(t, s.value(z)) for t, z in _nodes(bits)]
    if any(value.contains(0) for _, value in signed):
        return Isolation([], "the sign of G at a node is not decided", 0)
    first = signed[0]
    ends = [*signed, (first[0] + 1, first[1])]
    stack = list(pairwise(ends))
    bend, two_pi = s.bend(), 2 * flint.arb.pi()
    narrow = flint.fmpq(1, 2 ** max(8, bits // 2 - 10))
    roots: list[tuple[Any, Any]] = []
    used = 0
    while stack:
        low, high = stack.pop()
        turns = high[0] - low[0]
        h = two_pi * flint.arb(turns)
        same = bool(low[1] > 0) == bool(high[1] > 0)
        limit = bend * h * h / 8
        if same and abs(low[1]) > limit and abs(high[1]) > limit:
            continue
        t = (low[0] + high[0]) / 2
        z = _point(t)
        if abs(s.slope(z)) > bend * h / 2:
            if not same:
                roots.append((low[0], high[0]))
            continue
        value = s.value(z)
        used += 1
        if turns < narrow or used > halvings or value.contains(0):
            return Isolation([], f"two roots nearly meet at alpha = {float(two_pi * flint.arb(t)):.15g}", used)
        stack += [(low, (t, value)), ((t, value), high)]
    return Isolation(sorted(roots), "", used)


def refine(s: SexticBalls, low: Any, high: Any, bits: int) -> Any:
    """Enclose the only root between two turns: interval Newton steps in alpha, within the known bracket."""
    arb = flint.arb
    two_pi = 2 * arb.pi()
    start = arb(low).union(arb(high)) * two_pi
    box = start
    for _ in range(bits):
        middle = arb(box.mid())
        s_box, c_box = box.sin_cos()
        slope = s.slope(flint.acb(c_box, s_box))
        sm, cm = middle.sin_cos()
        if slope.contains(0):
            box = _halved(s, box)
            continue
        step = middle - s.value(flint.acb(cm, sm)) / slope
        if not step.overlaps(box):  # cannot happen for a proved root; keep the bracket
            return start
        new = step.intersection(box)
        if not float(new.rad()) < 0.75 * float(box.rad()):
            return new
        box = new
    return box


def _halved(s: SexticBalls, box: Any) -> Any:
    """Half of the box that has the root, by the signs at the ends; the box itself if they do not decide."""
    low, high = flint.arb(box.lower()), flint.arb(box.upper())
    middle = flint.arb(box.mid())
    signs = []
    for alpha in (low, middle, high):
        sine, cosine = alpha.sin_cos()
        signs.append(s.value(flint.acb(cosine, sine)))
    if any(v.contains(0) for v in signs):
        third = low + (high - low) * flint.arb("0.381")
        sine, cosine = third.sin_cos()
        signs[1], middle = s.value(flint.acb(cosine, sine)), third
        if any(v.contains(0) for v in signs):
            return box
    left = bool(signs[0] > 0) != bool(signs[1] > 0)
    return low.union(middle) if left else middle.union(high)


def mirror_count(s: SexticBalls) -> int | None:
    """Count the roots on the unit circle by isolating all six and mirroring them; None if this does not decide.

    A root whose mirror image ``1/conj(R)`` meets only its own ball R is its own mirror image.
    """
    g0, g1, g2, g3 = s.g
    conj = _conjugate
    coefficients = [conj(g3), conj(g2), conj(g1), flint.acb(g0), g1, g2, g3]
    if coefficients[-1].contains(0):
        return None
    try:
        roots = flint.acb_poly(coefficients).roots()
    except (ValueError, ArithmeticError):
        return None
    if any(r.contains(0) for r in roots):
        return None
    on = 0
    for k, root in enumerate(roots):
        mirror = 1 / conj(root)
        met = [j for j, other in enumerate(roots) if mirror.overlaps(other)]
        if len(met) != 1:
            return None
        on += met[0] == k
    return on


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
