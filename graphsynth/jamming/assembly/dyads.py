"""Dyads: two links and three revolute joints, placed by a closed form wherever their outer joints are.

The inner joint lies over the line of the outer ones at the share ``t`` of their distance, at ``sqrt(room)`` distances
beside it, ``room = a^2/d^2 - t^2``; on which side is the assembly mode.  So as long as room is positive there is one
assembly of that mode, exactly one, and no system has to be solved.  See theory/drawing-tolerances 3.
"""

from __future__ import annotations

from collections.abc import Callable
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

    def narrowed(self, value: Any, dyad: int, place: int) -> Any:
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
    plane: Plane, ends: tuple[Pair, Pair], arms: tuple[Pair, Pair], side: float, near: Callable[[Any, int], Any]
) -> list[Any]:
    """Return the room, the way between the outer joints (x, y), and cos and sin of both links' angles.

    ``arms`` lead from the outer joint of each link to the inner one, in its frame; ``near`` narrows each of the seven.
    """
    d = ends[1] - ends[0]
    d = Pair(near(d.x, 1), near(d.y, 2))
    a, b = (arm.x.sqr() + arm.y.sqr() for arm in arms)
    size = d.x.sqr() + d.y.sqr()
    share = (a - b) / size * 0.5 + 0.5
    found = [near(a / size - share.sqr(), 0), d.x, d.y]
    way = d * share + plane.left(d) * (found[0].sqrt() * side)
    for arm, reached, square in zip(arms, (way, way - d), (a, b)):
        found.append(near(plane.dot(arm, reached) / square, len(found)))
        found.append(near(plane.cross(arm, reached) / square, len(found)))
    return found
