"""The box of parameters of a mechanism: joint points of every link as functions of independent parameters.

A point of a link lies ``(at - datum + sum of p_k v_k) (1 + growth dT)`` from the datum of the link: affine in lengths
and offsets, and one thermal growth for all, so that lengths that grow together are one parameter.
See theory/drawing-tolerances 2.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from functools import cached_property
from typing import Any, NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray

from graphsynth.intervals import Interval
from graphsynth.mechanism.equations import Pair
from graphsynth.mechanism.model import Mechanism

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]
#: Relative step back from the rim of the box, so that rounding leaves a member inside.
_INSIDE = 1e-9
#: Parameter, and how far one unit of it moves the point: intervals, for a unit vector is no pair of floats.
Term: TypeAlias = tuple[int, Interval | float, Interval | float]


class LinkPoint(NamedTuple):
    """Point of a joint on one of its links: nominal place, terms, and growth per unit of the parameter ``heat``.

    Places are counted from the ``datum`` of the link, one of its joints, not from its origin, unless it is ``fixed``.
    """

    at: tuple[float, float]
    terms: tuple[Term, ...] = ()
    datum: tuple[float, float] = (0.0, 0.0)
    growth: float = 0.0
    heat: int = -1
    fixed: bool = False

    def place(self, values: Sequence[Any], *, whole: bool = False) -> Pair:
        """Return the point for values of the parameters; ``whole`` counts it from the origin of the link's frame."""
        if (self.fixed or whole) and not self.terms and not self.growth:
            return Pair(Interval(self.at[0]), Interval(self.at[1]))
        x: Any = Interval(self.at[0]) - self.datum[0]
        y: Any = Interval(self.at[1]) - self.datum[1]
        for k, along, across in self.terms:
            x, y = x + values[k] * along, y + values[k] * across
        if self.growth:
            scale = values[self.heat] * self.growth + 1.0
            x, y = x * scale, y * scale
        if self.fixed or whole:
            x, y = x + self.datum[0], y + self.datum[1]
        return Pair(x, y)


@dataclass(frozen=True, eq=False)
class ParameterBox:
    """Parameters of a mechanism within their tolerances; all zero is the nominal mechanism.

    Attributes
    ----------
    names : tuple of str
        What each parameter is, for reports.
    low, high : ndarray, shape (m,)
        Bounds of the parameters, ``low <= 0 <= high``.
    points : tuple of (LinkPoint, LinkPoint)
        Of every joint of the mechanism, on its links a and b.
    discs : tuple of (int, int)
        Pairs of parameters of which only those in a disc are meant: holes within a circle.  The box encloses it.
        The radius is the upper bound of either.
    """

    names: tuple[str, ...]
    low: Array
    high: Array
    points: tuple[tuple[LinkPoint, LinkPoint], ...]
    discs: tuple[tuple[int, int], ...] = ()

    @property
    def size(self) -> int:
        """Number of parameters."""
        return len(self.names)

    @property
    def whole(self) -> Interval:
        """The box, shape (m,)."""
        return Interval.from_bounds(self.low, self.high)

    def holds(self, values: Array) -> bool:
        """Whether these parameters are those of a member: inside the box and all its discs (exact)."""
        exact = [Fraction(value) for value in values.tolist()]
        inside = bool(((self.low <= values) & (values <= self.high)).all())
        return inside and all(exact[i] ** 2 + exact[j] ** 2 <= Fraction(self.high[i]) ** 2 for i, j in self.discs)

    def furthest(self, rises: Array) -> Array:
        """Return the member (m,) furthest in a direction, by so little inside that rounding leaves it a member."""
        p = np.where(rises < 0.0, self.low, self.high)
        for pair in map(list, self.discs):
            rise = math.hypot(*rises[pair])
            p[pair] = self.high[pair] * (rises[pair] / rise if rise > 0.0 else (1.0, 0.0))
        return np.asarray(p * (1.0 - _INSIDE))

    def in_discs(self, p: Interval) -> tuple[Interval, Mask]:
        """Narrow boxes (N, m) to what encloses their part of all discs; tell which hold a member at all (certified)."""
        low, high = p.lo.copy(), p.hi.copy()
        for pair in self.discs:
            for k, other in (pair, pair[::-1]):
                least = Interval(p[:, other].mig)
                left = (Interval(self.high[k]).sqr() - least.sqr()).hi
                reach = np.where(left < 0.0, -1.0, Interval(np.maximum(left, 0.0)).sqrt().hi)
                low[:, k], high[:, k] = np.maximum(low[:, k], -reach), np.minimum(high[:, k], reach)
        held: Mask = np.asarray((low <= high).all(axis=1))
        return Interval.from_bounds(np.minimum(low, high), np.maximum(low, high)), held

    @cached_property
    def _still(self) -> list[tuple[Pair | None, ...]]:
        """Points that no parameter moves."""
        return [tuple(None if p.terms or p.growth else p.place(()) for p in both) for both in self.points]

    def places(self, values: Sequence[Any]) -> list[tuple[Pair, Pair]]:
        """Points of every joint on its links, for values of the parameters in any arithmetic."""
        both = zip(self.points, self._still)
        return [(still_a or a.place(values), still_b or b.place(values)) for (a, b), (still_a, still_b) in both]

    def member(self, mechanism: Mechanism, values: Array) -> Mechanism:
        """Return the mechanism with given values of the parameters, its coordinates rounded to doubles."""
        exact = [Interval(float(value)) for value in values]
        joints = []
        for joint, ends in zip(mechanism.joints, self.points):
            places = (own.place(exact, whole=True) for own in ends)
            at_a, at_b = ((float(p.x.mid), float(p.y.mid)) for p in places)
            joints.append(replace(joint, at_a=at_a, at_b=at_b))
        return replace(mechanism, joints=tuple(joints))


def relative_box(mechanism: Mechanism, tolerance: float) -> ParameterBox:
    """Return the box with one relative number on every coordinate of a joint, each by itself; zeros stay zero."""
    names: list[str] = []
    datum: dict[int, tuple[float, float]] = {}
    points = []
    for joint in mechanism.joints:
        ends = []
        for link, at in ((joint.a, joint.at_a), (joint.b, joint.at_b)):
            start = datum.setdefault(link, at)
            terms: list[Term] = []
            for axis, value in zip("xy", at):
                if value and tolerance:
                    terms.append((len(names), *((value, 0.0) if axis == "x" else (0.0, value))))
                    names.append(f"{axis} of joint {joint.a}-{joint.b} on link {link}")
            ends.append(LinkPoint(at, tuple(terms), start, fixed=link == mechanism.frame))
        points.append((ends[0], ends[1]))
    bound = np.full(len(names), tolerance)
    return ParameterBox(tuple(names), -bound, bound, tuple(points))
