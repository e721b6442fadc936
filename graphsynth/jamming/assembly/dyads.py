"""Dyads: two links and three revolute joints, placed by a closed form wherever their outer joints are.

The inner joint lies over the line of the outer ones at the share ``t`` of their distance, at ``sqrt(room)`` distances
beside it, ``room = a^2/d^2 - t^2``; on which side is the assembly mode.  So as long as room is positive there is one
assembly of that mode, exactly one, and no system has to be solved.  See theory/drawing-tolerances 3.
"""

from __future__ import annotations

from collections.abc import Callable
from itertools import chain, zip_longest
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from graphsynth.intervals import Dual, Interval
from graphsynth.mechanism.equations import Pair, Plane
from graphsynth.mechanism.joints import Revolute

if TYPE_CHECKING:
    from graphsynth.mechanism.model import Mechanism

Array = NDArray[np.float64]


class Dyad(NamedTuple):
    """Links a and b, placed together; joints: of a with a placed link, of b with a placed link, and of a with b.

    ``bases`` are the placed links, ``side`` +1 or -1: whether the inner joint lies to the left of the outer ones.
    """

    links: tuple[int, int]
    joints: tuple[int, int, int]
    bases: tuple[int, int]
    side: float = 1.0

    def seen_side(self, mechanism: Mechanism, poses: Array) -> Array:
        """Sine of the angle at the first joint from the second to the inner one, at poses (N, links, 3), in floats."""
        first, second, inner = (
            _at(mechanism, k, link, poses) for k, link in zip(self.joints, (*self.links, self.links[0]))
        )
        d, arm = second - first, inner - first
        with np.errstate(all="ignore"):
            return np.asarray((np.conj(d) * arm).imag / (abs(d) * abs(arm)))


class Near(NamedTuple):
    """Known enclosures of what `place_dyad` finds, (N, dyads, 7), and how far variables of duals lead on, (K, N)."""

    known: Interval
    steps: Interval | None = None

    def narrowed(self, dyad: int, value: Any, place: int) -> Any:
        """Narrow one number of a dyad, by the mean value theorem if it is a dual."""
        known = self.known[:, dyad, place]
        if not isinstance(value, Dual):
            return _within(value, known)
        if self.steps is not None:
            known = known + (value.grad * self.steps).sum(0)
        return Dual(_within(value.value, known), value.grad)


def _within(value: Interval, known: Interval) -> Interval:
    """Intersection, or the first where rounding or an undefined number leaves nothing."""
    both = value.intersect(known)
    use = ~(both.is_empty | np.isnan(known.lo) | np.isnan(known.hi))
    return Interval.from_bounds(np.where(use, both.lo, value.lo), np.where(use, both.hi, value.hi))


def _at(mechanism: Mechanism, k: int, link: int, poses: Array) -> NDArray[np.complex128]:
    joint = mechanism.joints[k]
    at = joint.at_a if joint.a == link else joint.at_b
    return np.asarray(poses[:, link, 0] + 1j * poses[:, link, 1] + np.exp(1j * poses[:, link, 2]) * complex(*at))


def find_dyads(mechanism: Mechanism, placed: set[int]) -> list[Dyad]:
    """Return dyads that can be placed one after the other from links that are placed; those are added to the set.

    Only links that have nothing but revolute joints without a motor: the angles of the others are needed.
    """
    joints, driven = mechanism.joints, {driver.pair for driver in mechanism.drivers}
    plain = {
        link
        for link in range(mechanism.graph.links)
        if all(isinstance(j, Revolute) and j.pair not in driven for j in joints if link in j.pair)
    }
    found: list[Dyad] = []
    while True:
        outer: dict[int, int] = {}
        for k, joint in enumerate(joints):
            for link, base in ((joint.a, joint.b), (joint.b, joint.a)):
                if link in plain and link not in placed and base in placed:
                    outer.setdefault(link, k)
        inner = [k for k, j in enumerate(joints) if j.a in outer and j.b in outer]
        if not inner:
            return found
        a, b = joints[inner[0]].a, joints[inner[0]].b
        numbers = outer[a], outer[b], inner[0]
        bases = tuple(joints[k].a + joints[k].b - link for k, link in zip(numbers, (a, b)))
        found.append(Dyad((a, b), numbers, (bases[0], bases[1])))
        placed |= {a, b}


def place_dyad(
    plane: Plane,
    ends: tuple[Pair, Pair],
    arms: tuple[Pair, Pair],
    side: float,
    near: Callable[[Any, int], Any] | None,
    wide: bool = True,
) -> tuple[list[Any], list[Any]]:
    """Return the room, the way between the outer joints (x, y), cos and sin of both links' angles; and those angles.

    ``arms`` lead from the outer joint of each link to the inner one, in its frame; ``near`` narrows each of the seven.
    For a ``wide`` box directions are narrowed by all that is known of them, which pays there alone.
    """
    d = ends[1] - ends[0]
    d = d if near is None else Pair(near(d.x, 1), near(d.y, 2))
    squares = [arm.x.sqr() + arm.y.sqr() for arm in arms]
    size = d.x.sqr() + d.y.sqr()
    share = (squares[0] - squares[1]) / size * 0.5 + 0.5
    room = squares[0] / size - share.sqr()
    room = room if near is None else near(room, 0)
    beside, along = _value(room).sqrt() * side, _values(d)
    way = along * _value(share) + plane.left(along) * beside
    inner, own = [way, way - along], [_values(arm) for arm in arms]
    turns = [
        _turn(plane.dot(arm, to) / _value(square), plane.cross(arm, to) / _value(square), wide)
        for arm, to, square in zip(own, inner, squares)
    ]
    rates: list[Any] = []
    moves = any(isinstance(part, Dual) for pair in (d, *arms) for part in (pair.x, pair.y))
    for _ in range(2 if wide and near is not None else 1):
        if moves:
            if wide:
                inner = [_both(to, plane.turned(arm, turn)) for to, arm, turn in zip(inner, own, turns)]
            rates = _turning(plane, (_rates(d), _rates(arms[0]), _rates(arms[1])), turns, inner, beside * _value(size))
        if near is not None:
            c, s = zip(*(_directed(turn, rate) for turn, rate in zip_longest(turns, rates)))
            turns = [_turn(_value(near(c[k], 3 + 2 * k)), _value(near(s[k], 4 + 2 * k)), wide) for k in (0, 1)]
    both = list(zip_longest(turns, rates))
    angles = [_dual(plane.argument(turn), rate) for turn, rate in both]
    return [room, d.x, d.y, *chain.from_iterable(_directed(*own) for own in both)], angles


def _turning(
    plane: Plane, moved: tuple[Pair, Pair, Pair], turns: list[Pair], inner: list[Pair], area: Interval
) -> list[Interval]:
    """Return how fast both links turn, from the rates of d and of the arms; ``inner``: the arms as they are turned.

    The inner joint is ``A + R_a arm_a = B + R_b arm_b``, and ``R' = angle' J R``, so
    ``d' - R_a arm_a' + R_b arm_b' = angle_a' J r_a - angle_b' J r_b``.  ``area`` is ``r_a x r_b``.
    """
    d, arm_a, arm_b = moved
    gap = d - plane.turned(arm_a, turns[0]) + plane.turned(arm_b, turns[1])
    return [plane.dot(gap, inner[1]) / area, plane.dot(gap, inner[0]) / area]


def _dual(value: Interval, rate: Interval | None) -> Any:
    return value if rate is None else Dual(value, rate)


def _directed(turn: Pair, rate: Interval | None) -> tuple[Any, Any]:
    """Cosine and sine of an angle that turns at a rate."""
    return (turn.x, turn.y) if rate is None else (Dual(turn.x, -turn.y * rate), Dual(turn.y, turn.x * rate))


def _value(number: Any) -> Any:
    return number.value if isinstance(number, Dual) else number


def _values(pair: Pair) -> Pair:
    return Pair(_value(pair.x), _value(pair.y))


def _rates(pair: Pair) -> Pair:
    return Pair(*(part.grad if isinstance(part, Dual) else Interval(0) for part in (pair.x, pair.y)))


def _both(one: Pair, other: Pair) -> Pair:
    return Pair(_within(one.x, other.x), _within(one.y, other.y))


def _turn(c: Interval, s: Interval, wide: bool) -> Pair:
    """Direction of an angle; of a wide one cosine and sine narrow each other."""
    if not wide:
        return Pair(c, s)
    c = _across(c, s)
    s = _across(s, c)
    return Pair(_across(c, s), s)


def _across(c: Interval, s: Interval) -> Interval:
    """Narrow a cosine by the sine: it is ``+-sqrt(1 - s^2)``."""
    way, above = (1.0 - s.sqr()).sqrt(), c.lo > 0.0
    low, high = np.where(above, way.lo, -way.hi), np.where(~above & (c.hi < 0.0), -way.lo, way.hi)
    return _within(c, Interval.from_bounds(low, high))
