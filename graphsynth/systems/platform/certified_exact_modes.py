"""Roots of the sextic of the direct problem, proved: in balls of any precision, or exactly for rational data.

``G(alpha) = g0 + 2 Re(g1 z + g2 z^2 + g3 z^3)`` with ``z = exp(i alpha)``; theory/platform-direct 1, 2, 5.
"""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction
from functools import lru_cache
from itertools import pairwise
from typing import Any, NamedTuple

import flint

from graphsynth.intervals.reading import Gaussian, ball, complex_ball
from graphsynth.kinematics.triad.assembly_modes import Sextic, coefficients

_NODES = 32
#: Nodes are shifted by 1/997 of a turn over the number of nodes: no simple fraction of a turn is a node.
_SHIFT = 997
_HALVINGS = 4000


def value(g: Sequence[Any], z: Any) -> Any:
    """Return G at a point z of the circle, in the arithmetic of both."""
    g0, g1, g2, g3 = g
    return g0 + 2 * (z * (g1 + z * (g2 + z * g3))).real


def slope(g: Sequence[Any], z: Any) -> Any:
    """Return the derivative of G by alpha at a point z of the circle."""
    _, g1, g2, g3 = g
    return -2 * (z * (g1 + z * (2 * g2 + z * (3 * g3)))).imag


def sextic_balls(A: Sequence[Any], b: Sequence[Any], lengths: Sequence[Any]) -> Sextic:
    """Coefficients for anchors, vertices (acb, or exact `Gaussian`) and leg lengths (arb, or Fraction)."""
    if isinstance(b[0], Gaussian):
        return coefficients(A, b, lengths, lambda z: z.conj, lambda x: Gaussian(Fraction(0), x))
    return coefficients(A, b, lengths, lambda z: flint.acb(z.real, -z.imag), lambda x: flint.acb(0, x))


def direction(alpha: Any) -> Any:
    """``exp(i alpha)`` as a ball."""
    sine, cosine = alpha.sin_cos()
    return flint.acb(cosine, sine)


def _point(t: Any) -> Any:
    """``exp(2 pi i t)`` for a rational t."""
    s, c = flint.arb.sin_cos_pi_fmpq(2 * t)
    return flint.acb(c, s)


@lru_cache(maxsize=16)
def _nodes(bits: int) -> tuple[tuple[Any, Any], ...]:
    turns = [flint.fmpq(k * _SHIFT + 1, _NODES * _SHIFT) for k in range(_NODES)]
    return tuple((t, _point(t)) for t in turns)


def isolate(s: Sextic, bits: int) -> tuple[list[tuple[Any, Any]], str]:
    """Find turns ``(t0, t1)``, alpha = 2 pi t, with one simple root each; or say why their number is not proved.

    Arcs of the circle are halved; every node must have a proved sign.
    """
    signed = [(t, value(s.g, z)) for t, z in _nodes(bits)]
    if any(at.contains(0) for _, at in signed):
        return [], "the sign of G at a node is not decided"
    stack = list(pairwise([*signed, (signed[0][0] + 1, signed[0][1])]))
    bend, two_pi = 2 * (abs(s.g[1]) + 4 * abs(s.g[2]) + 9 * abs(s.g[3])), 2 * flint.arb.pi()  # |G''| <= bend
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
        if abs(slope(s.g, z)) > bend * h / 2:
            if not same:
                roots.append((low[0], high[0]))
            continue
        at = value(s.g, z)
        used += 1
        if turns < narrow or used > _HALVINGS or at.contains(0):
            return [], f"two roots nearly meet at alpha = {float(two_pi * flint.arb(t)):.15g}"
        stack += [(low, (t, at)), ((t, at), high)]
    return sorted(roots), ""


def refine(s: Sextic, low: Any, high: Any, bits: int) -> Any:
    """Enclose the only root between two turns: interval Newton steps in alpha, within the known bracket."""
    arb = flint.arb
    start = box = arb(low).union(arb(high)) * (2 * arb.pi())
    for _ in range(bits):
        middle, rate = arb(box.mid()), slope(s.g, direction(box))
        if rate.contains(0):
            box = _halved(s, box)
            continue
        step = middle - value(s.g, direction(middle)) / rate
        if not step.overlaps(box):  # cannot happen for a proved root; keep the bracket
            return start
        new = step.intersection(box)
        if not float(new.rad()) < 0.75 * float(box.rad()):
            return new
        box = new
    return box


def _halved(s: Sextic, box: Any) -> Any:
    """Half of the box that has the root, by the signs at the ends; the box itself if they do not decide."""
    low, high = flint.arb(box.lower()), flint.arb(box.upper())
    for middle in (flint.arb(box.mid()), low + (high - low) * flint.arb("0.381")):
        signs = [value(s.g, direction(alpha)) for alpha in (low, middle, high)]
        if not any(at.contains(0) for at in signs):
            left = bool(signs[0] > 0) != bool(signs[1] > 0)
            return low.union(middle) if left else middle.union(high)
    return box


def mirror_count(s: Sextic) -> int | None:
    """Count the roots on the unit circle by isolating all six and mirroring them; None if this does not decide.

    A root whose mirror image ``1/conj(R)`` meets only its own ball R is its own mirror image.
    """
    upper = list(s.g[1:])
    if upper[-1].contains(0):
        return None
    try:
        roots = flint.acb_poly([*(g.conjugate() for g in upper[::-1]), flint.acb(s.g[0]), *upper]).roots()
    except (ValueError, ArithmeticError):
        return None
    if any(r.contains(0) for r in roots):
        return None
    on = 0
    for k, root in enumerate(roots):
        mirror = 1 / root.conjugate()
        met = [j for j, other in enumerate(roots) if mirror.overlaps(other)]
        if len(met) != 1:
            return None
        on += met[0] == k
    return on


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
    g0, *rest = sextic_balls(A, b, lengths).g
    even, odd, size = (flint.fmpq_poly(c) for c in ([1, 0, -1], [0, 2], [1, 0, 1]))  # z = (even + i odd) / size
    total, x, y = _rational(g0) * size**3, flint.fmpq_poly([1]), flint.fmpq_poly([0])
    for k, g in enumerate(rest, 1):
        x, y = x * even - y * odd, x * odd + y * even
        total += 2 * (_rational(g.real) * x - _rational(g.imag) * y) * size ** (3 - k)
    if total == 0:
        return None
    poly = total.numer()
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


def _rational(value: Fraction) -> Any:
    return flint.fmpq(value.numerator, value.denominator)


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
