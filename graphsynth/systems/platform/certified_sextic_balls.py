"""Real roots of the sextic of the direct problem in balls of any precision: isolation on the circle, refinement.

``G(alpha) = g0 + 2 Re(g1 z + g2 z^2 + g3 z^3)`` with ``z = exp(i alpha)``; theory/platform-direct 1, 2, 5.
"""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction
from functools import lru_cache
from itertools import pairwise
from typing import Any, NamedTuple

import flint

from graphsynth.intervals.exact import Gaussian

__all__ = ["Isolation", "SexticBalls", "isolate", "mirror_count", "refine", "sextic_balls"]

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
