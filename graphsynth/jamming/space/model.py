"""Mechanisms in space: seats on links, joints that turn about their axes and give way within limits, loops.

A joint has a seat on each of its links: a point and a rotation, whose z axis is the axis of the joint.  From the seat
on link a to that on link b the motion is

    translation (shift_x, shift_y, slide) along the axes of seat a,  then  T(x),  then  Rz(turn)

with T(x) the least rotation that takes one axis to the other: about ``x / |x|`` by the angle ``2 atan(|x| / 2)``, x in
the plane across the axis.  The angle between both axes is the tilt.  See theory/closure-in-space 1.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from graphsynth.core.errors import GeometryError
from graphsynth.intervals import Interval, cos, sin, tan
from graphsynth.jamming.joints.limits import Limits, bounds

Array = NDArray[np.float64]
Ints = NDArray[np.intp]
#: What estimates and proofs of this model are about.
MODEL = "exact closure in space: every loop closes in three dimensions, with joints that turn, tilt and slide"
#: Coordinates of a joint, in this order.
TURN, TILT_X, TILT_Y, SHIFT_X, SHIFT_Y, SLIDE = range(6)
#: Tilts from here on are as good as none: the chart of T ends at pi.
_FREE = 3.0


class Unsupported(Exception):  # noqa: N818 - never leaves the package: it becomes an UNDECIDED with this reason
    """A mechanism that this model does not describe; the text says why."""


@dataclass(frozen=True)
class Seat:
    """Where a joint sits on a link: a point, and the rotation vector (radians) that turns the z axis to its axis.

    Before that it is turned about z by ``spin``.
    ``turn_box`` and ``point_box`` (3,) enclose the rotation vector and the point where floats do not say them exactly.
    ``moves`` tells the vectors (3,) by which one unit of a parameter of the model moves the point.
    """

    point: tuple[float, float, float] = (0.0, 0.0, 0.0)
    turn: tuple[float, float, float] = (0.0, 0.0, 0.0)
    turn_box: Interval | None = None
    point_box: Interval | None = None
    moves: tuple[tuple[int, Interval], ...] = ()
    spin: float = 0.0

    def __post_init__(self) -> None:
        for name in ("point", "turn"):
            value = tuple(float(v) for v in getattr(self, name))
            if len(value) != 3 or not all(map(math.isfinite, value)):
                raise GeometryError(f"{name} = {value} of a seat is no vector in space; give three finite numbers")
            object.__setattr__(self, name, value)


@dataclass(frozen=True)
class SpaceJoint:
    """A joint between links a and b with its seats.

    ``limits``: largest tilt, slide and shift (of a guide roll and pitch, by components of x).  ``driven``: the turn
    (of a guide the travel along the x axis of seat a) is given.  A guide (``guide``) travels along x and does not turn,
    a slot (``guide`` and ``turns``) does both.
    ``parameter``: its turn is this parameter of the model, at most ``lean``; no limits, and no joint of the mechanism.
    """

    a: int
    b: int
    seat_a: Seat
    seat_b: Seat
    limits: Limits
    driven: bool = False
    guide: bool = False
    turns: bool = True
    parameter: int = -1
    lean: float = 0.0


class Bound(NamedTuple):
    """A limit: the norm of some unknowns is at most the limit (of tilts: in the chart ``2 tan(limit / 2)``)."""

    joint: int
    kind: str
    columns: tuple[int, ...]
    limit: float
    angular: bool
    box: tuple[float, float]

    def chart(self, scale: float) -> float:
        """Return the limit in the chart at a common factor on all limits, in floats."""
        return 2.0 * math.tan(0.5 * min(scale * self.limit, _FREE)) if self.angular else scale * self.limit

    def slope(self, scale: float) -> float:
        """Return the derivative of `chart` by the factor."""
        if not self.angular:
            return self.limit
        return self.limit / math.cos(0.5 * min(scale * self.limit, _FREE)) ** 2

    @property
    def enclosed(self) -> Interval:
        """The limit in the chart, enclosed over its tolerance box."""
        limit = Interval.from_bounds(*self.box)
        return 2 * tan(limit / 2) if self.angular else limit


class Step(NamedTuple):
    """A joint in a loop: forward from a to b or back; the motion from it to the next joint of the loop.

    ``moves``: vectors by which one unit of a parameter moves its place.
    """

    joint: int
    forward: bool
    rotation: Interval
    place: Interval
    moves: tuple[tuple[int, Interval], ...] = ()


@dataclass(frozen=True, eq=False)
class SpaceModel:
    """A mechanism in space with limits: loops, unknowns, limits.

    Parameters
    ----------
    joints : sequence of SpaceJoint
    links : int
    frame : int
    parameters : int
        Parameters that move points of links or turn axes: dimensions within tolerances.

    Attributes
    ----------
    column : ndarray, shape (joints, 6)
        Number of the unknown for each coordinate of a joint (turn, tilt x, tilt y, shift x, shift y, slide), or -1;
        given coordinates of driven joints are numbered after the ``size`` unknowns, then come the parameters; ``width``
        is the number of all.
    unit : float
        Power of two that lengths are measured in.
    """

    joints: tuple[SpaceJoint, ...]
    links: int
    frame: int = 0
    parameters: int = 0

    @cached_property
    def unit(self) -> float:
        """Length unit of unknowns and equations."""
        largest = max((abs(v) for j in self.joints for s in (j.seat_a, j.seat_b) for v in s.point), default=1.0)
        return 2.0 ** round(math.log2(largest)) if largest > 0.0 else 1.0

    @cached_property
    def column(self) -> Ints:
        """Numbers of the unknowns."""
        found, count = np.full((len(self.joints), 6), -1), 0
        for k, joint in enumerate(self.joints):
            tilts = [bounds(joint.limits, name)[1] > 0.0 for name in joint.limits.tilts]
            shifts = bounds(joint.limits, "radial_clearance")[1] > 0.0
            sizes = {
                TURN: joint.turns and joint.parameter < 0 and not (joint.driven and not joint.guide),
                TILT_X: tilts[0],
                TILT_Y: tilts[-1],
                SHIFT_X: not joint.driven if joint.guide else shifts,
                SHIFT_Y: shifts,
                SLIDE: bounds(joint.limits, "axial_clearance")[1] > 0.0,
            }
            for place, wanted in sizes.items():
                if wanted:
                    found[k, place], count = count, count + 1
        for k, joint in enumerate(self.joints):
            if joint.driven:
                found[k, SHIFT_X if joint.guide else TURN], count = count, count + 1
        for k, joint in enumerate(self.joints):
            if joint.parameter >= 0:
                found[k, TURN] = count + joint.parameter
        return found

    @property
    def width(self) -> int:
        """Number of unknowns and given coordinates."""
        return self.size + sum(joint.driven for joint in self.joints) + self.parameters

    @cached_property
    def size(self) -> int:
        """Number of unknowns."""
        given = sum(joint.driven + (joint.parameter >= 0) for joint in self.joints)
        return int((self.column >= 0).sum()) - given

    @cached_property
    def bounds(self) -> tuple[Bound, ...]:
        """All finite limits above zero."""
        found = []
        for k, joint in enumerate(self.joints):
            columns = [int(c) for c in self.column[k]]
            for place, name in enumerate(joint.limits.tilts):
                own = columns[TILT_X:SHIFT_X] if len(joint.limits.tilts) == 1 else [columns[TILT_X + place]]
                box = bounds(joint.limits, name)
                if 0.0 < box[1] < _FREE:
                    found.append(Bound(k, name, tuple(own), getattr(joint.limits, name), True, box))
            across = columns[SHIFT_Y:SLIDE] if joint.guide else columns[SHIFT_X:SLIDE]
            for kind, name, own in (("shift", "radial", across), ("play", "axial", columns[SLIDE:])):
                low, high = (end / self.unit for end in bounds(joint.limits, f"{name}_clearance"))
                if 0.0 < high < math.inf:
                    size = getattr(joint.limits, f"{name}_clearance") / self.unit
                    found.append(Bound(k, kind, tuple(own), size, False, (low, high)))
        return tuple(found)

    @cached_property
    def limit_bounds(self) -> Array:
        """Lower and upper ends of all limits in the chart, (2, bounds)."""
        both = [bound.enclosed for bound in self.bounds]
        return np.array([[float(b.lo) for b in both], [float(b.hi) for b in both]])

    @cached_property
    def _steps(self) -> tuple[Array, Array]:
        """Upper bounds of the tilt of every joint and of the misalignment of its seats, (joints,) each, in radians."""
        tilt, seat = np.full(len(self.joints), math.inf), np.zeros(len(self.joints))
        for k, joint in enumerate(self.joints):
            if joint.parameter >= 0:
                tilt[k] = joint.lean
                continue
            tilt[k] = math.hypot(*(bounds(joint.limits, name)[1] for name in joint.limits.tilts))
            for own in (joint.seat_a, joint.seat_b):
                turn = own.turn[:2] if own.turn_box is None else own.turn_box.mag[:2].tolist()
                seat[k] += math.hypot(*own.turn) if own.turn[2] != 0.0 and any(own.turn[:2]) else math.hypot(*turn)
        return tilt, seat

    @cached_property
    def link_leans(self) -> Array:
        """Upper bounds of the angle between the z axis of every link and that of the frame, (links,), in radians.

        Tilts and misalignments on any way from the frame add up.
        """
        tilt, seat = self._steps
        return self.least_sums(tilt + seat)

    @cached_property
    def leans(self) -> Array:
        """Upper bounds of the tilt of every joint in the chart, (joints,): its limit, or what the links' axes leave."""
        (tilt, seat), link = self._steps, self.link_leans
        between = np.array([link[j.a] + link[j.b] for j in self.joints]) + seat
        return np.asarray(2.0 * np.tan(0.5 * np.minimum(np.minimum(tilt, between) * (1.0 + 1e-12), _FREE)))

    def least_sums(self, steps: Array) -> Array:
        """Least sum of steps (joints,) on any way from the frame to every link, (links,); rounded up a little."""
        link = np.full(self.links, math.inf)
        link[self.frame] = 0.0
        for _ in range(self.links):
            for joint, step in zip(self.joints, steps):
                for here, there in ((joint.a, joint.b), (joint.b, joint.a)):
                    link[there] = min(link[there], (link[here] + step) * (1.0 + 1e-15))
        return link

    @cached_property
    def seats(self) -> list[tuple[tuple[Interval, Interval], tuple[Interval, Interval]]]:
        """Enclosed rotation (3, 3) and place (3,) of both seats of every joint, lengths in units."""
        return [(self._seat(joint.seat_a), self._seat(joint.seat_b)) for joint in self.joints]

    def _seat(self, seat: Seat) -> tuple[Interval, Interval]:
        turn = Interval(list(seat.turn)) if seat.turn_box is None else seat.turn_box
        point = Interval(list(seat.point)) if seat.point_box is None else seat.point_box
        R = rotation(turn)
        if seat.spin != 0.0:
            R = product(R, rotation(Interval([0.0, 0.0, seat.spin])))
        return R, point / self.unit

    def moves(self, passed: tuple[int, bool], after: tuple[int, bool]) -> tuple[tuple[int, Interval], ...]:
        """Vectors by which one unit of a parameter moves the next joint of a loop from the one passed before, in units.

        Both with the way they are passed, as in `paths`.  What moves both alike is left out.
        """
        first, second = (self.joints[k] for k, _ in (passed, after))
        back = dict((first.seat_b if passed[1] else first.seat_a).moves)
        found = dict((second.seat_a if after[1] else second.seat_b).moves)
        for k, vector in back.items():
            if k not in found:
                found[k] = -vector
            elif found[k] is vector:
                del found[k]
            else:
                found[k] = found[k] - vector
        return tuple((k, vector / self.unit) for k, vector in sorted(found.items()))

    @cached_property
    def loops(self) -> tuple[tuple[Step, ...], ...]:
        """Loops of the joint graph, each a round of steps; those within flat parts of the mechanism first."""
        return tuple(self._round(path) for path in self.paths)

    @cached_property
    def rows(self) -> tuple[tuple[int, ...], ...]:
        """Equations of every loop, of rotations x, y, z and places x, y, z: three in a flat part, else six."""
        flat = [_is_flat(joint) for joint in self.joints]
        return tuple((2, 3, 4) if all(flat[k] for k, _ in path) else (0, 1, 2, 3, 4, 5) for path in self.paths)

    @cached_property
    def paths(self) -> list[list[tuple[int, bool]]]:
        """Joints passed once round every loop, and whether from a to b."""
        flat = [_is_flat(joint) for joint in self.joints]
        part = list(range(self.links))
        tree: list[list[tuple[int, int]]] = [[] for _ in range(self.links)]
        closing = []
        for k in sorted(range(len(self.joints)), key=lambda k: not flat[k]):
            a, b = self.joints[k].a, self.joints[k].b
            if part[a] != part[b]:
                part = [part[b] if own == part[a] else own for own in part]
                tree[a].append((k, b))
                tree[b].append((k, a))
            else:
                closing.append(k)
        return [[(k, True), *self._way(tree, self.joints[k].b, self.joints[k].a)] for k in closing]

    def _way(self, tree: list[list[tuple[int, int]]], start: int, end: int) -> list[tuple[int, bool]]:
        """Joints passed on the way through the tree."""
        came: dict[int, tuple[int, int]] = {start: (-1, -1)}
        queue = [start]
        for link in queue:
            for k, other in tree[link]:
                if other not in came:
                    came[other] = (k, link)
                    queue.append(other)
        way = []
        while end != start:
            k, end = came[end]
            way.append((k, self.joints[k].a == end))
        return way[::-1]

    def _round(self, path: list[tuple[int, bool]]) -> tuple[Step, ...]:
        """Join the seats on the link between two joints of a loop to one constant motion."""
        steps = []
        for (k, forward), (after, onward) in zip(path, path[1:] + path[:1]):
            R, p = self.seats[k][1 if forward else 0]
            S, q = self.seats[after][0 if onward else 1]
            back, way = _transposed(R), self.moves((k, forward), (after, onward))
            moves = tuple((number, _turned(back, vector)) for number, vector in way)
            steps.append(Step(k, forward, product(back, S), _turned(back, q - p), moves))
        return tuple(steps)


def _is_flat(joint: SpaceJoint) -> bool:
    """Whether both links always move in one plane: no tilt, no slide, seats in the plane."""
    rigid = all(bounds(joint.limits, name)[1] == 0.0 for name in (*joint.limits.tilts, "axial_clearance"))
    level = all(s.point[2] == s.turn[0] == s.turn[1] == 0.0 for s in (joint.seat_a, joint.seat_b))
    return rigid and level


def product(A: Any, B: Any) -> Any:
    """Product of 3 by 3 matrices (..., 3, 3) of floats or intervals."""
    if not isinstance(A, Interval) and not isinstance(B, Interval):
        return A @ B
    return A[..., :, 0:1] * B[..., 0:1, :] + A[..., :, 1:2] * B[..., 1:2, :] + A[..., :, 2:3] * B[..., 2:3, :]


def _transposed(A: Interval) -> Interval:
    return Interval.from_bounds(A.lo.T.copy(), A.hi.T.copy())


def _turned(A: Interval, vector: Interval) -> Interval:
    return (A * vector.reshape(1, 3)).sum(-1)


def rotation(vector: Interval) -> Interval:
    """Enclose the rotation about a vector (3,) by its length (radians), shape (3, 3)."""
    v = list(vector)
    if all(bool((part.mag == 0.0).all()) for part in v):
        return Interval(np.eye(3).astype(int).tolist())
    angle = (v[0].sqr() + v[1].sqr() + v[2].sqr()).sqrt()
    n = [part / angle for part in v]
    c, s = cos(angle), sin(angle)
    k = 2 * sin(angle / 2).sqr()
    rows = [
        Interval.stack([c + n[0].sqr() * k, n[0] * n[1] * k - n[2] * s, n[0] * n[2] * k + n[1] * s]),
        Interval.stack([n[0] * n[1] * k + n[2] * s, c + n[1].sqr() * k, n[1] * n[2] * k - n[0] * s]),
        Interval.stack([n[0] * n[2] * k - n[1] * s, n[1] * n[2] * k + n[0] * s, c + n[2].sqr() * k]),
    ]
    return Interval.stack(rows)
