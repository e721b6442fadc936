"""Joint positions over intervals of the input, proved: one solution for every input, inside a known box; their rates.

`Positions` are the equations of a mechanism in intervals or duals, in link angles and displacements along a tree of
joints.  The tree starts at the frame and takes driven joints first; a driven coordinate is the value of its law.  The
unknowns are the other coordinates of the tree, the equations those of the joints outside it
(`graphsynth.mechanism.joints`), so a mechanism with L loops of revolute joints has 2 L of each.

Krawczyk's test (`graphsynth.intervals.image`), with the input and the dimensions as interval parameters, says UNIQUE:
for every input of a piece, and every choice of dimensions, exactly one assembly lies in the box.  The branch is proved
where, at the input shared by two pieces, the one assembly of a point box lies in the boxes of both, or the hull of both
holds exactly one.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import TYPE_CHECKING, Any, NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray

from graphsynth.intervals import Dual, Interval, Status, atan2, cos, hypot, image, pi, sin, variables
from graphsynth.intervals.dual import jacobian_of
from graphsynth.mechanism.constraints import characteristic_length
from graphsynth.mechanism.equations import FLOATS, Gradient, Pair, Plane, Seen, derivatives, seen
from graphsynth.mechanism.joints import Cam, Gear, PinSlot, Prismatic, Revolute

if TYPE_CHECKING:
    from graphsynth.mechanism.model import Mechanism


Array = NDArray[np.float64]
Mask = NDArray[np.bool_]
#: Disturbances of every joint: offset of its point in the plane, and twist that it prescribes amiss.
Moved: TypeAlias = list[tuple[Pair, Any]]
PLANE = Plane(sin, cos, hypot, atan2)
_CHUNK = 256
_ROUNDS = 6


class Unsupported(Exception):  # noqa: N818 - never leaves the package: it becomes an UNDECIDED with this reason
    """A mechanism or law whose positions are not enclosed here; the text says why."""


class Placement(NamedTuple):
    """Angle, direction (cos, sin) and origin of every link."""

    angle: list[Any]
    turn: list[Pair]
    origin: list[Pair]


class _Edge(NamedTuple):
    """A joint of the tree: from ``parent`` to ``child``; columns of the unknown angle and displacement, or -1."""

    joint: int
    parent: int
    child: int
    angle: int
    slide: int
    driver: int


class Positions:
    """Equations and joint positions of a mechanism; every coordinate of a joint has the relative half width given.

    Raises `Unsupported` for a cam, a law that is not enclosed, a driver that closes a loop of drivers, or as many
    equations as unknowns missing.
    """

    def __init__(self, mechanism: Mechanism, tolerance: float = 0.0) -> None:
        self.mechanism, self.tolerance = mechanism, tolerance
        if any(isinstance(joint, Cam) for joint in mechanism.joints):
            raise Unsupported("the positions of a cam mechanism are not enclosed between samples")
        self.local = [(_box(j.at_a, tolerance), _box(j.at_b, tolerance)) for j in mechanism.joints]
        for driver in mechanism.drivers:
            if not hasattr(driver.law, "at"):
                law = type(driver.law).__name__
                raise Unsupported(f"the law {law} of a driver is not enclosed; use Linear, Harmonic or Polynomial")
        self.edges, self.size = self._tree()
        tree = {edge.joint for edge in self.edges}
        self.closing = [k for k in range(len(mechanism.joints)) if k not in tree]
        rows = sum(3 - mechanism.joints[k].mobility for k in self.closing)
        if rows != self.size:
            raise Unsupported(
                f"{rows} closing equations for {self.size} unknowns: as many drivers as freedoms are needed"
            )

    def _tree(self) -> tuple[list[_Edge], int]:
        joints, links = self.mechanism.joints, self.mechanism.graph.links
        driver_of = {driver.pair: k for k, driver in enumerate(self.mechanism.drivers)}
        part = list(range(links))  # of the forest grown so far, for every link

        chosen = []
        order = sorted(range(len(joints)), key=lambda k: (joints[k].pair not in driver_of, joints[k].mobility, k))
        for k in order:
            joint = joints[k]
            if isinstance(joint, Gear):
                continue
            if part[joint.a] != part[joint.b]:
                part = [part[joint.b] if own == part[joint.a] else own for own in part]
                chosen.append(k)
            elif joint.pair in driver_of:
                raise Unsupported("the driven joints form a loop")
        if len(chosen) != links - 1:
            raise Unsupported("a link hangs on gears alone")
        edges: list[_Edge] = []
        reached, size = [self.mechanism.frame], 0
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
        return edges, size

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
        at = Placement([zero] * links, [Pair(Interval(1), zero)] * links, [Pair(zero, zero)] * links)
        for edge in self.edges:
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


def guide(joint: Prismatic | PinSlot, at: Placement) -> Pair:
    """Direction of a straight guide."""
    along: Pair = PLANE.turned(PLANE.unit(Interval(joint.angle_a)), at.turn[joint.a])
    return along


def _box(at: tuple[float, float], tolerance: float) -> Pair:
    around = Interval.midrad(1, tolerance) if tolerance else Interval(1)
    return Pair(around * at[0], around * at[1])


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

    With C near the inverse of the midpoint, ``x - x0 = C (b - A x0) + (1 - C A)(x - x0)``; a weighted norm of the last
    matrix below 1 bounds ``x - x0`` and proves every A regular [Rump 1980].
    """
    k = matrix.shape[-1]
    middle = np.where(np.isfinite(matrix.mid), matrix.mid, 0.0)
    inverse = np.linalg.pinv(middle, rcond=1e-14)
    C = points(inverse)
    start = (inverse @ right.mid[:, :, None])[..., 0]
    start = np.where(np.isfinite(start), start, 0.0)
    residual = right - (matrix * points(start[:, None])).sum(-1)
    first = (C * residual.reshape(len(residual), 1, k)).sum(-1).mag
    product = (C.reshape(-1, k, k, 1) * matrix.reshape(-1, 1, k, k)).sum(2)
    rest = points(np.eye(k)) - product
    size = np.where(np.isfinite(rest.mag), rest.mag, 1.0)
    first = np.where(np.isfinite(first), first, np.inf)
    # positive weights near the fixed point of w = first + size w; any positive numbers give valid bounds
    guess = np.where(np.isfinite(first), first, 1.0)
    guess = weight = guess + 1e-3 * guess.max(axis=1, keepdims=True) + 1e-300
    for _ in range(6):
        weight = guess + (size @ weight[:, :, None])[..., 0]
    weight = np.where(np.isfinite(weight), weight, 1.0)
    with np.errstate(all="ignore"):
        norm = (_nonnegative(size, weight) / points(weight)).hi.max(axis=1)
        largest = (points(first) / points(weight)).hi.max(axis=1)
        fine = np.isfinite(rest.mag).all(axis=(1, 2)) & (norm < 1.0) & np.isfinite(largest)
    norm, largest = np.where(fine, norm, 0.0), np.where(fine, largest, 0.0)
    bound = points(largest) / (1 - points(norm))
    spread = (points(weight) * bound.reshape(-1, 1)).hi
    first = np.where(fine[:, None], first, 0.0)
    for _ in range(3):  # any solution obeys |x - x0| <= first + |rest| |x - x0|
        spread = np.minimum(spread, (points(first) + _nonnegative(size, spread)).hi)
    around = Interval.from_bounds(-spread, spread)
    return around + points(start), np.asarray(fine)


def _nonnegative(matrix: Array, vector: Array) -> Interval:
    """Product of nonnegative numbers, enclosed."""
    return (points(matrix) * points(vector[:, None])).sum(-1)


class Tubes(NamedTuple):
    """Pieces of the input and what is proved about them.

    ``proved`` (N,); ``domain`` and ``tight`` (N, size): the box with exactly one assembly, and where that lies;
    ``r``, ``e``, ``base`` (N, joints, 2), (N, joints, 2), (N, joints, 2, 2): positions, guide directions, directions of
    links a and b of the joints asked for.  Certified where proved.
    """

    proved: Mask
    domain: Interval
    tight: Interval
    r: Interval
    e: Interval
    base: Interval

    def take(self, rows: NDArray[np.intp]) -> Tubes:
        """Return some of the pieces."""
        return Tubes._make(part[rows] for part in self)


def prove_tubes(
    system: Positions, joints: tuple[int, ...], u: Interval, x: Array, rate: Array, counted: Array
) -> Tubes:
    """Prove pieces u (N,) of the input around float solutions, with the positions of the joints named.

    ``x`` and ``rate`` (N, size) are the unknowns at the midpoints and their rates by the input, ``counted``
    (N, closing) is from ``system.count`` there.
    """
    parts = []
    for k in range(0, max(len(x), 1), _CHUNK):
        part = slice(k, k + _CHUNK)
        parts.append(_prove(system, joints, u[part], x[part], rate[part], counted[part]))
    proved, *boxes = zip(*parts)
    joined = (
        Interval.from_bounds(np.concatenate([b.lo for b in own]), np.concatenate([b.hi for b in own])) for own in boxes
    )
    return Tubes._make([np.concatenate(proved), *joined])


def _prove(system: Positions, joints: tuple[int, ...], u: Interval, x: Array, rate: Array, counted: Array) -> Tubes:
    count, size = x.shape
    q = system.driven(u)
    # room in every unknown, also in one that stands still for the moment
    reach = np.abs(rate) * u.rad[:, None]
    largest = (reach / system.weights).max(axis=1, initial=0.0, keepdims=True)
    radius = 1.2 * reach + (0.05 * largest + 1e-10) * system.weights
    low, high = x - radius, x + radius
    proved: Mask = np.zeros(count, dtype=bool)
    domain_lo, domain_hi, tight_lo, tight_hi = low.copy(), high.copy(), low.copy(), high.copy()
    left = np.arange(count)
    for _ in range(_ROUNDS):
        if left.size == 0 or size == 0:
            break
        box = Interval.from_bounds(low[left], high[left])
        own, turns = [_at(value, left, count) for value in q], counted[left]
        result = image(lambda unknowns, own=own, turns=turns: system.equations(unknowns, own, turns), box)
        good = result.status == Status.UNIQUE
        rows = left[good]
        proved[rows] = True
        domain_lo[rows], domain_hi[rows] = box.lo[good], box.hi[good]
        tight_lo[rows], tight_hi[rows] = result.box.lo[good], result.box.hi[good]
        bad = ~good & result.image.is_bounded.all(axis=1)
        wider = result.image[bad].hull(box[bad]).inflate(0.2, 1e-12)
        low[left[bad]], high[left[bad]] = wider.lo, wider.hi
        # a box of half the size of the mechanism says that the piece is too long: give up, it will be cut
        fits = (wider.rad < np.maximum(radius[left[bad]], 0.5 * system.weights)).all(axis=1)
        left = left[bad][fits]
    if size == 0:
        proved[:] = True
    else:  # more room around the solution, so that neighbours can be linked
        rows = np.flatnonzero(proved)
        box = Interval.from_bounds(domain_lo[rows], domain_hi[rows]).inflate(0.5)
        own, turns = [_at(value, rows, count) for value in q], counted[rows]
        good = image(lambda unknowns: system.equations(unknowns, own, turns), box).status == Status.UNIQUE
        domain_lo[rows[good]], domain_hi[rows[good]] = box.lo[good], box.hi[good]
    tight = Interval.from_bounds(tight_lo, tight_hi)
    domain = Interval.from_bounds(domain_lo, domain_hi)
    if not joints:
        return Tubes(proved, domain, tight, *(Interval.zeros((count, 0, *rest)) for rest in ((2,), (2,), (2, 2))))
    at, zero = system.place([tight[:, k] for k in range(size)], q), Interval.zeros((count,))
    return Tubes(proved, domain, tight, *places(system, joints, at, lambda value: value + zero))


def _at(value: Interval, rows: NDArray[np.intp], count: int) -> Interval:
    return value[rows] if value.shape == (count,) else value


def places(
    system: Positions, joints: tuple[int, ...], at: Placement, read: Callable[[Any], Interval]
) -> tuple[Interval, Interval, Interval]:
    """Stack positions, guide directions and link directions of joints; ``read`` takes what is wanted of each number."""

    def full(pair: Pair) -> Interval:
        return Interval.stack([read(pair.x), read(pair.y)], axis=-1)

    r, e, base = [], [], []
    for k in joints:
        joint = system.mechanism.joints[k]
        A, B = system.ends(k, at)
        # both ends of a revolute joint are the same point: each encloses it
        r.append(full(A).intersect(full(B)) if isinstance(joint, Revolute) else full(B))
        along = guide(joint, at) if isinstance(joint, Prismatic | PinSlot) else Pair(Interval(1), Interval(0))
        e.append(full(along))
        base.append(Interval.stack([full(at.turn[joint.a]), full(at.turn[joint.b])], axis=1))
    return Interval.stack(r, axis=1), Interval.stack(e, axis=1), Interval.stack(base, axis=1)


def linked(system: Positions, points: Tubes, u: Interval, before: Interval, after: Interval, counted: Array) -> Mask:
    """Whether neighbouring pieces have the same assembly at the input they share.

    Each box holds exactly one.  It is the same if the one of a point box (``points``, proved at u) lies in both, or if
    the common hull holds exactly one, for every choice of dimensions.
    """
    inside = points.tight.subset(before).all(axis=1) & points.tight.subset(after).all(axis=1)
    found: Mask = np.asarray(points.proved & inside)
    q, count = system.driven(u), len(before)
    left = np.flatnonzero(~found)
    for k in range(0, left.size, _CHUNK):
        rows = left[k : k + _CHUNK]
        own, turns = [_at(value, rows, count) for value in q], counted[rows]
        box = before[rows].hull(after[rows]).inflate(0.05, 1e-13)
        result = image(lambda unknowns, own=own, turns=turns: system.equations(unknowns, own, turns), box)
        found[rows] = result.status == Status.UNIQUE
    return found


def slopes(
    system: Positions, joints: tuple[int, ...], u: Interval, tubes: Tubes, counted: Array
) -> tuple[Interval, Interval, Interval, Mask]:
    """Enclose the derivatives by the input of ``r``, ``e``, ``base`` of `Tubes`, and tell where that is proved.

    On the branch ``F(x(u), u) = 0``, so ``F_x x' = -F_u``; with both enclosed over the tight boxes the solution set of
    the linear system holds ``x'`` for every input and every choice of dimensions.
    """
    count, n = len(u), system.size
    box = Interval.from_bounds(np.column_stack([tubes.tight.lo, u.lo]), np.column_stack([tubes.tight.hi, u.hi]))
    unknowns = variables(box)
    q: list[Any] = system.driven(unknowns[n])
    if n:
        table = jacobian_of(system.equations(unknowns[:n], q, counted), n + 1, (count,))
        rate, fine = enclosed_solve(table[:, :, :n], -table[:, :, n])
    else:
        rate, fine = Interval.zeros((count, 0)), np.ones(count, dtype=bool)

    def along(value: Any) -> Interval:
        """Return the derivative along the motion."""
        if not isinstance(value, Dual):
            return Interval.zeros((count,))
        total = value.grad[n]
        for i in range(n):
            total = total + value.grad[i] * rate[:, i]
        return total

    moved = places(system, joints, system.place(unknowns[:n], q), along)
    return (*moved, fine)
