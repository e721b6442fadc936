"""Joint positions over intervals of the input, proved: one solution for every input, inside a known box; their rates.

`Positions` are the equations of a mechanism in intervals or duals, in link angles and displacements along a tree of
joints.  The tree starts at the frame and takes driven joints first; a driven coordinate is the value of its law.  The
unknowns are the other coordinates of the tree, the equations those of the joints outside it
(`graphsynth.mechanism.joints`), so a mechanism with L loops of revolute joints has 2 L of each.

The dimensions are functions of the parameters of a box (`graphsynth.tolerances.box`).  Where the assemblies lie is
proved in `graphsynth.jamming.assembly.tubes`, and which belong together in `graphsynth.jamming.joints.branch`.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from copy import copy
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING, Any, NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray

from graphsynth.intervals import Interval, atan2, cos, hypot, pi, sin
from graphsynth.jamming.assembly.dyads import Dyad, Near, find_dyads, place_dyad
from graphsynth.mechanism.constraints import characteristic_length
from graphsynth.mechanism.equations import FLOATS, Gradient, Pair, Plane, Seen, derivatives, seen
from graphsynth.mechanism.joints import Cam, Gear, JointGeometry, PinSlot, Prismatic, Revolute
from graphsynth.tolerances.box import ParameterBox, relative_box

if TYPE_CHECKING:
    from graphsynth.mechanism.model import Mechanism


Array = NDArray[np.float64]
Mask = NDArray[np.bool_]
#: Disturbances of every joint: offset of its point in the plane, and twist that it prescribes amiss.
Moved: TypeAlias = list[tuple[Pair, Any]]
PLANE = Plane(sin, cos, hypot, atan2)


class Unsupported(Exception):  # noqa: N818 - never leaves the package: it becomes an UNDECIDED with this reason
    """A mechanism or law whose positions are not enclosed here; the text says why."""


class Placement(NamedTuple):
    """Angle, direction (cos, sin) and origin of every link; what `place_dyad` finds of every dyad."""

    angle: list[Any]
    turn: list[Pair]
    origin: list[Pair]
    dyads: list[list[Any]]

    @property
    def rooms(self) -> list[Any]:
        """Room of every dyad, positive where it closes."""
        return [own[0] for own in self.dyads]


class _Edge(NamedTuple):
    """A joint of the tree: from ``parent`` to ``child``; columns of the unknown angle and displacement, or -1.

    ``dyad`` is the number of the dyad that the child belongs to, or -1.
    """

    joint: int
    parent: int
    child: int
    angle: int
    slide: int
    driver: int
    dyad: int = -1


class Positions:
    """Equations and joint positions of a mechanism whose dimensions lie in a box of parameters.

    ``tolerance`` is the box, or one relative half width of every coordinate of a joint; with a ``pose`` (links, 3)
    dyads have closed forms, in its assembly mode, and no unknowns.  Raises
    `Unsupported` for a cam, a law that is not enclosed, a driver that closes a loop of drivers, or as many equations as
    unknowns missing.
    """

    def __init__(self, mechanism: Mechanism, tolerance: float | ParameterBox = 0.0, pose: Array | None = None) -> None:
        self.mechanism = mechanism
        self.box = tolerance if isinstance(tolerance, ParameterBox) else relative_box(mechanism, tolerance)
        if any(isinstance(joint, Cam) for joint in mechanism.joints):
            raise Unsupported("the positions of a cam mechanism are not enclosed between samples")
        whole = self.box.whole
        self.local = self.box.places([whole[k] for k in range(self.box.size)])
        for driver in mechanism.drivers:
            if not hasattr(driver.law, "at"):
                law = type(driver.law).__name__
                raise Unsupported(f"the law {law} of a driver is not enclosed; use Linear, Harmonic or Polynomial")
        self.near: Near | None = None
        self.dyads: list[Dyad] = []
        self.edges, self.size = self._tree(pose)
        tree = {edge.joint for edge in self.edges} | {dyad.joints[2] for dyad in self.dyads}
        self.closing = [k for k in range(len(mechanism.joints)) if k not in tree]
        rows = sum(3 - mechanism.joints[k].mobility for k in self.closing)
        if rows != self.size:
            raise Unsupported(
                f"{rows} closing equations for {self.size} unknowns: as many drivers as freedoms are needed"
            )

    def _tree(self, pose: Array | None) -> tuple[list[_Edge], int]:
        """Joints from the frame outward: driven ones, then dyads if their sides are known, then the others."""
        joints, links = self.mechanism.joints, self.mechanism.graph.links
        driver_of = {driver.pair: k for k, driver in enumerate(self.mechanism.drivers)}
        edges: list[_Edge] = []
        reached, size = [self.mechanism.frame], 0

        def grow(chosen: list[int]) -> None:
            nonlocal size
            for link in reached:
                for k in chosen:
                    joint = joints[k]
                    other = joint.a + joint.b - link
                    if link not in joint.pair or other in reached:
                        continue
                    driver = driver_of.get(joint.pair, -1)
                    angle = slide = -1
                    if not isinstance(joint, Prismatic) and driver < 0:
                        angle, size = size, size + 1
                    if not isinstance(joint, Revolute) and driver < 0:
                        slide, size = size, size + 1
                    edges.append(_Edge(k, link, other, angle, slide, driver))
                    reached.append(other)

        driven = [k for k, joint in enumerate(joints) if joint.pair in driver_of]
        part = list(range(links))  # of the forest grown so far, for every link
        if len(_forest(joints, driven, part)) < len(driven):
            raise Unsupported("the driven joints form a loop")
        grow(driven)
        if pose is not None:
            for own in find_dyads(self.mechanism, set(reached)):
                sine = float(own.seen_side(self.mechanism, pose[None])[0])
                self.dyads.append(own._replace(side=math.copysign(1.0, sine)))
        outer = [k for dyad in self.dyads for k in dyad.joints[:2]]
        rest = [k for k in sorted(range(len(joints)), key=lambda k: (joints[k].mobility, k)) if k not in driven]
        chosen = driven + _forest(joints, outer + rest, part)
        if len(chosen) != links - 1:
            raise Unsupported("a link hangs on gears alone")
        for number, own in enumerate(self.dyads):
            ends = zip(own.joints, own.bases, own.links)
            edges += [_Edge(k, base, link, -1, -1, -1, number) for k, base, link in ends]
            reached += own.links
        grow(chosen)
        return edges, size

    def about(self, known: Interval, steps: Interval | None = None) -> Positions:
        """Return the same equations with known enclosures of the dyads."""
        other = copy(self)
        other.near = Near(known, steps) if self.dyads else None
        return other

    def follows(self, poses: Array) -> Mask:
        """Whether the dyads have their sides at poses (N, links, 3), clearly, in floats."""
        sides = [dyad.seen_side(self.mechanism, poses) * dyad.side > 1e-9 for dyad in self.dyads]
        return np.asarray(np.all(sides, axis=0)) if sides else np.ones(len(poses), dtype=np.bool_)

    def within(self, values: Sequence[Any]) -> Positions:
        """Return the same equations for other values of the parameters: intervals, or duals."""
        other = copy(self)
        other.local = self.box.places(values)
        return other

    def of(self, rows: NDArray[np.intp]) -> Positions:
        """Return the same equations for some of the pieces that the values of `within` are for."""
        other = copy(self)
        other.local = [(_taken(a, rows), _taken(b, rows)) for a, b in self.local]
        return other

    @property
    def weights(self) -> Array:
        """Size of one unit of every unknown: 1 for angles, the characteristic length for displacements."""
        values = np.ones(self.size)
        values[[edge.slide for edge in self.edges if edge.slide >= 0]] = characteristic_length(self.mechanism)
        return values

    def coordinates(self, poses: Array, rates: Array) -> tuple[Array, Array]:
        """Unknowns and their rates by the input, (N, size), from poses and velocities (N, links, 3)."""
        x, v = np.zeros((len(poses), self.size)), np.zeros((len(poses), self.size))
        for edge in self.edges:
            joint = self.mechanism.joints[edge.joint]
            if edge.angle >= 0:
                x[:, edge.angle], v[:, edge.angle] = poses[:, edge.child, 2], rates[:, edge.child, 2]
            if edge.slide >= 0:
                assert isinstance(joint, Prismatic | PinSlot)
                at = self._floats(edge.joint, poses)
                t = at.line(joint.angle_a)
                x[:, edge.slide] = at.plane.dot(t, at.d)
                for link, entries in zip((joint.a, joint.b), *derivatives(at, [Gradient(t, at.plane.cross(t, at.d))])):
                    v[:, edge.slide] += sum(entry * rates[:, link, k] for k, entry in enumerate(entries))
        return x, v

    def _floats(self, k: int, poses: Array) -> Seen:
        """Joint k at poses (N, links, 3), in floats."""
        joint = self.mechanism.joints[k]
        a, b = (tuple(poses[:, link].T) for link in (joint.a, joint.b))
        return seen(FLOATS, joint, a, b)

    def place(self, x: list[Any], q: list[Any], moved: Moved | None = None) -> Placement:
        """Place every link for unknowns x and driven coordinates q; ``moved`` disturbs the joints."""
        links, zero = self.mechanism.graph.links, Interval(0)
        at = Placement([zero] * links, [Pair(Interval(1), zero)] * links, [Pair(zero, zero)] * links, [])
        for edge in self.edges:
            if edge.dyad >= 0:
                if edge.dyad == len(at.dyads):
                    self._place_dyad(self.dyads[edge.dyad], at, moved)
                continue
            joint, (at_a, at_b) = self.mechanism.joints[edge.joint], self.local[edge.joint]
            forward, child = edge.parent == joint.a, edge.child
            driver = self.mechanism.drivers[edge.driver] if edge.driver >= 0 else None
            if isinstance(joint, Prismatic):
                difference = Interval(joint.angle_a) - joint.angle_b
                at.angle[child] = at.angle[edge.parent] + (difference if forward else -difference)
            elif driver is not None:
                value = q[edge.driver]
                at.angle[child] = at.angle[edge.parent] + (value if driver.link == child else -value)
            else:
                at.angle[child] = x[edge.angle]
            if moved is not None and (driver is not None or isinstance(joint, Prismatic)):
                at.angle[child] = at.angle[child] + moved[edge.joint][1]
            at.turn[child] = PLANE.unit(at.angle[child])
            here, there = (at_a, at_b) if forward else (at_b, at_a)
            P = at.origin[edge.parent] + PLANE.turned(here, at.turn[edge.parent])
            if isinstance(joint, Prismatic | PinSlot):
                s = x[edge.slide] if driver is None else q[edge.driver] if driver.base == joint.a else -q[edge.driver]
                way = guide(joint, at) * s
                P = P + way if forward else P - way
            P = P if moved is None else P + moved[edge.joint][0]
            at.origin[child] = P - PLANE.turned(there, at.turn[child])
        return at

    def _place_dyad(self, dyad: Dyad, at: Placement, moved: Moved | None) -> None:
        """Place both links of a dyad, and note what was found."""
        joints, (a, b), number = self.mechanism.joints, dyad.links, len(at.dyads)

        def local(k: int, link: int) -> Pair:
            return self.local[k][link != joints[k].a]

        ends = [
            at.origin[base] + PLANE.turned(local(k, base), at.turn[base]) for k, base in zip(dyad.joints, dyad.bases)
        ]
        if moved is not None:
            first, second, inner = (moved[k][0] for k in dyad.joints)
            ends = [ends[0] + first, ends[1] + second + inner]
        outer = [local(k, link) for k, link in zip(dyad.joints, dyad.links)]
        arms = local(dyad.joints[2], a) - outer[0], local(dyad.joints[2], b) - outer[1]
        near = None if self.near is None else partial(self.near.narrowed, number)
        wide = self.box.size > 0
        found, angles = place_dyad(PLANE, (ends[0], ends[1]), arms, dyad.side, near, wide)
        at.dyads.append(found)
        turns = Pair(*found[3:5]), Pair(*found[5:])
        for link, turn, angle, end, own in zip((a, b), turns, angles, ends, outer):
            at.turn[link], at.angle[link] = turn, angle
            at.origin[link] = end - PLANE.turned(own, turn)

    def seen(self, k: int, at: Placement) -> Seen:
        """Joint k with its two links."""
        joint = self.mechanism.joints[k]
        arms = [PLANE.turned(p, at.turn[link]) for p, link in zip(self.local[k], (joint.a, joint.b))]
        d = at.origin[joint.b] + arms[1] - (at.origin[joint.a] + arms[0])
        return Seen(PLANE, at.angle[joint.a], at.angle[joint.b], at.turn[joint.a], arms[0], arms[1], d)

    def ends(self, k: int, at: Placement) -> tuple[Pair, Pair]:
        """Points of joint k on its links a and b."""
        joint, both = self.mechanism.joints[k], self.seen(k, at)
        return at.origin[joint.a] + both.arm_a, at.origin[joint.b] + both.arm_b

    def equations(self, x: list[Any], q: list[Any], counted: Array, moved: Moved | None = None) -> list[Any]:
        """Return the closing equations; ``counted`` (N, closing) from `count`."""
        placed = self.place(x, q, moved)
        rows: list[Any] = []
        for column, k in enumerate(self.closing):
            joint, at = self.mechanism.joints[k], self.seen(k, placed)
            twist: Any = 0
            if moved is not None:
                at, twist = replace(at, d=at.d + moved[k][0]), moved[k][1]
            if isinstance(joint, Gear):
                rows.append(
                    joint.mesh(at, _direction(at.d, counted[:, column])) + twist * (joint.radius_a + joint.radius_b)
                )
                continue
            values = joint.values(at)
            if isinstance(joint, Prismatic):
                values[1] = values[1] - pi() * (2.0 * counted[:, column]) + twist
            rows += values
        return rows

    def count(self, poses: Array) -> Array:
        """Whole turns of prismatic joints and directions of the lines of centres of gears, (N, closing), in floats."""
        found = np.zeros((len(poses), len(self.closing)))
        for column, k in enumerate(self.closing):
            joint, at = self.mechanism.joints[k], self._floats(k, poses)
            if isinstance(joint, Prismatic):
                found[:, column] = np.round(joint.values(at)[1] / (2.0 * np.pi))
            elif isinstance(joint, Gear):
                phi, period = at.plane.argument(at.d), 2.0 * np.pi * sum(joint.turns()[0])
                found[:, column] = phi + 2.0 * np.pi * np.round(joint.mesh(at, phi) / period)
        return found

    def driven(self, u: Any) -> list[Any]:
        """Enclose the coordinates of the drivers over the inputs (N,)."""
        laws: list[Any] = [driver.law for driver in self.mechanism.drivers]
        return [law.at(u, sin, cos)[0] for law in laws]


def _forest(joints: Sequence[JointGeometry], order: list[int], part: list[int]) -> list[int]:
    """Choose joints in order that join links of different parts; gears join nothing."""
    chosen = []
    for k in order:
        a, b = part[joints[k].a], part[joints[k].b]
        if a != b and not isinstance(joints[k], Gear):
            part[:] = [b if own == a else own for own in part]
            chosen.append(k)
    return chosen


def _taken(p: Pair, rows: NDArray[np.intp]) -> Pair:
    x, y = (value[rows] if value.ndim else value for value in (p.x, p.y))
    return Pair(x, y)


def guide(joint: Prismatic | PinSlot, at: Placement) -> Pair:
    """Direction of a straight guide."""
    along: Pair = PLANE.turned(PLANE.unit(Interval(joint.angle_a)), at.turn[joint.a])
    return along


def _direction(d: Pair, phi: Array) -> Any:
    """Direction of a line of centres, counted from the float ``phi``: no cut is near."""
    centre = points(phi)
    c, s = cos(centre), sin(centre)
    return atan2(d.y * c - d.x * s, d.x * c + d.y * s) + centre


def points(values: Array) -> Interval:
    """Floats as intervals of no width."""
    return Interval.from_bounds(values, values)


def enclosed_solve(matrix: Interval, right: Interval) -> tuple[Interval, Mask]:
    """Enclose the solutions of N systems (N, k, k) for all members; False where a matrix may be singular.

    ``right`` is (N, k), or (N, k, c) for c right sides each.  With C near the inverse of the midpoint, ``x - x0 =
    C (b - A x0) + (1 - C A)(x - x0)``; a weighted norm of the last matrix below 1 bounds ``x - x0`` and proves every A
    regular [Rump 1980].
    """
    if right.ndim == 2:
        solution, fine = enclosed_solve(matrix, right.reshape(*right.shape, 1))
        return solution.reshape(*right.shape), fine
    k = matrix.shape[-1]
    middle = np.where(np.isfinite(matrix.mid), matrix.mid, 0.0)
    inverse = np.linalg.pinv(middle, rcond=1e-14)
    C = points(inverse)
    start = inverse @ right.mid
    start = np.where(np.isfinite(start), start, 0.0)
    residual = right - matrix.times(points(start))
    first = C.times(residual).mag
    rest = points(np.eye(k)) - C.times(matrix)
    size = np.where(np.isfinite(rest.mag), rest.mag, 1.0)
    first = np.where(np.isfinite(first), first, np.inf)
    # positive weights near the fixed point of w = largest first + size w; any positive numbers give valid bounds
    guess = np.where(np.isfinite(first), first, 1.0).max(axis=2, initial=0.0)
    guess = weight = guess + 1e-3 * guess.max(axis=1, keepdims=True) + 1e-300
    for _ in range(6):
        weight = guess + (size @ weight[:, :, None])[..., 0]
    weight = np.where(np.isfinite(weight), weight, 1.0)
    with np.errstate(all="ignore"):
        norm = (_nonnegative(size, weight[..., None])[..., 0] / points(weight)).hi.max(axis=1)
        largest = (points(first) / points(weight[..., None])).hi.max(axis=1)
        fine = np.isfinite(rest.mag).all(axis=(1, 2)) & (norm < 1.0) & np.isfinite(largest).all(axis=1)
    norm, largest = np.where(fine, norm, 0.0), np.where(fine[:, None], largest, 0.0)
    bound = points(largest) / (1 - points(norm)).reshape(-1, 1)
    spread = (points(weight[..., None]) * bound.reshape(len(bound), 1, -1)).hi
    first = np.where(fine[:, None, None], first, 0.0)
    for _ in range(3):  # any solution obeys |x - x0| <= first + |rest| |x - x0|
        spread = np.minimum(spread, (points(first) + _nonnegative(size, spread)).hi)
    return Interval.from_bounds(-spread, spread) + points(start), np.asarray(fine)


def _nonnegative(matrix: Array, columns: Array) -> Interval:
    """Product of nonnegative numbers, enclosed."""
    return points(matrix).times(points(columns))
