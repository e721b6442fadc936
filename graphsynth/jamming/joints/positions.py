"""Joint equations of a mechanism in intervals, in link angles and displacements along a tree of joints.

Written once for `Interval` and `Dual` operands.  Links hang on a tree that starts at the frame and takes driven joints
first; a driven coordinate is the enclosed value of its law.  The unknowns are the other coordinates of the tree, the
equations those of the joints outside it, so a mechanism with L loops of turning joints has 2 L of each.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray

from graphsynth.intervals import Interval, atan2, cos, pi, sin
from graphsynth.mechanism.constraints import characteristic_length
from graphsynth.mechanism.joints import Cam, Gear, JointGeometry, PinSlot, Prismatic, Revolute
from graphsynth.mechanism.laws import Harmonic, Law, Linear, Polynomial

if TYPE_CHECKING:
    from graphsynth.mechanism.model import Mechanism


Array = NDArray[np.float64]
Pair = tuple[Any, Any]
#: Disturbances of every joint: offset of its point in the plane (x, y), and twist that it prescribes amiss.
Moved: TypeAlias = list[tuple[Any, Any, Any]]


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


def law_enclosed(law: Law, u: Any) -> Any:
    """Enclose the coordinate of a driver over the inputs u.

    Raises
    ------
    Unsupported
        A law of another kind.

    Examples
    --------
    >>> law_enclosed(Linear(rate=2.0), Interval(0.25)).contains(0.5)
    True
    """
    if isinstance(law, Linear):
        return u * law.rate + law.offset
    if isinstance(law, Harmonic):
        return sin(u * law.order + law.phase) * law.amplitude + law.mean
    if isinstance(law, Polynomial):
        total: Any = Interval(0)
        for c in reversed(law.coefficients):
            total = total * u + c
        return total
    raise Unsupported(f"the law {type(law).__name__} of a driver is not enclosed; use Linear, Harmonic or Polynomial")


class Positions:
    """Equations and joint positions of a mechanism, dimensions within a relative tolerance.

    Parameters
    ----------
    mechanism : Mechanism
    tolerance : float
        Relative half width of every coordinate of a joint on its links.

    Raises
    ------
    Unsupported
        A cam, a driver that closes a loop of drivers, or as many equations as unknowns missing.
    """

    def __init__(self, mechanism: Mechanism, tolerance: float = 0.0) -> None:
        self.mechanism, self.tolerance = mechanism, tolerance
        if any(isinstance(joint, Cam) for joint in mechanism.joints):
            raise Unsupported("the positions of a cam mechanism are not enclosed between samples")
        self.local = [(_box(j.at_a, tolerance), _box(j.at_b, tolerance)) for j in mechanism.joints]
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
        part = list(range(links))

        def root(link: int) -> int:
            while part[link] != link:
                link = part[link]
            return link

        chosen = []
        order = sorted(range(len(joints)), key=lambda k: (joints[k].pair not in driver_of, joints[k].mobility, k))
        for k in order:
            joint = joints[k]
            a, b = root(joint.a), root(joint.b)
            if isinstance(joint, Gear):
                continue
            if a != b:
                part[a] = b
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
                other = joint.b if joint.a == link else joint.a if joint.b == link else -1
                if other < 0 or other in reached:
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
        for edge in self.edges:
            if edge.slide >= 0:
                values[edge.slide] = characteristic_length(self.mechanism)
        return values

    def coordinates(self, poses: Array, rates: Array) -> tuple[Array, Array]:
        """Unknowns and their rates by the input, (N, size), from poses and velocities (N, links, 3)."""
        x, v = np.zeros((len(poses), self.size)), np.zeros((len(poses), self.size))
        for edge in self.edges:
            joint = self.mechanism.joints[edge.joint]
            if edge.angle >= 0:
                x[:, edge.angle], v[:, edge.angle] = poses[:, edge.child, 2], rates[:, edge.child, 2]
            if edge.slide >= 0:
                x[:, edge.slide], v[:, edge.slide] = _slide(joint, poses, rates)
        return x, v

    def place(self, x: list[Any], q: list[Any], moved: Moved | None = None) -> Placement:
        """Place every link for unknowns x and driven coordinates q; ``moved`` disturbs the joints."""
        links = self.mechanism.graph.links
        angle: list[Any] = [Interval(0)] * links
        turn: list[Pair] = [(Interval(1), Interval(0))] * links
        origin: list[Pair] = [(Interval(0), Interval(0))] * links
        for edge in self.edges:
            joint, (at_a, at_b) = self.mechanism.joints[edge.joint], self.local[edge.joint]
            forward = edge.parent == joint.a
            if isinstance(joint, Prismatic):
                difference = Interval(joint.angle_a) - joint.angle_b
                angle[edge.child] = angle[edge.parent] + (difference if forward else -difference)
            elif edge.driver >= 0:
                driver = self.mechanism.drivers[edge.driver]
                value = q[edge.driver]
                angle[edge.child] = angle[edge.parent] + (value if driver.link == edge.child else -value)
            else:
                angle[edge.child] = x[edge.angle]
            if moved is not None and (edge.driver >= 0 or isinstance(joint, Prismatic)):
                angle[edge.child] = angle[edge.child] + moved[edge.joint][2]
            turn[edge.child] = (cos(angle[edge.child]), sin(angle[edge.child]))
            here, there = (at_a, at_b) if forward else (at_b, at_a)
            P = _plus(origin[edge.parent], _turned(turn[edge.parent], here))
            if isinstance(joint, Prismatic | PinSlot):
                if edge.driver >= 0:
                    driver = self.mechanism.drivers[edge.driver]
                    s = q[edge.driver] if driver.base == joint.a else -q[edge.driver]
                else:
                    s = x[edge.slide]
                t = self._guide(joint, turn)
                P = (P[0] + t[0] * s, P[1] + t[1] * s) if forward else (P[0] - t[0] * s, P[1] - t[1] * s)
            P = P if moved is None else _plus(P, moved[edge.joint][:2])
            arm = _turned(turn[edge.child], there)
            origin[edge.child] = (P[0] - arm[0], P[1] - arm[1])
        return Placement(angle, turn, origin)

    def _guide(self, joint: Prismatic | PinSlot, turn: list[Pair]) -> Pair:
        own = Interval(joint.angle_a)
        return _turned(turn[joint.a], (cos(own), sin(own)))

    def ends(self, k: int, at: Placement) -> tuple[Pair, Pair]:
        """Points of joint k on its links a and b."""
        joint, (at_a, at_b) = self.mechanism.joints[k], self.local[k]
        A = _plus(at.origin[joint.a], _turned(at.turn[joint.a], at_a))
        return A, _plus(at.origin[joint.b], _turned(at.turn[joint.b], at_b))

    def equations(self, x: list[Any], q: list[Any], counted: Array, moved: Moved | None = None) -> list[Any]:
        """Return the closing equations; ``counted`` (N, closing) from `count`."""
        at = self.place(x, q, moved)
        rows: list[Any] = []
        for column, k in enumerate(self.closing):
            joint = self.mechanism.joints[k]
            A, B = self.ends(k, at)
            d = (B[0] - A[0], B[1] - A[1])
            twist: Any = 0
            if moved is not None:
                d, twist = _plus(d, moved[k][:2]), moved[k][2]
            if isinstance(joint, Revolute):
                rows += [d[0], d[1]]
            elif isinstance(joint, Gear):
                rows.append(_gear(joint, at, d, counted[:, column]) + twist * (joint.radius_a + joint.radius_b))
            elif isinstance(joint, Prismatic | PinSlot):
                t = self._guide(joint, at.turn)
                rows.append(t[0] * d[1] - t[1] * d[0])
                if isinstance(joint, Prismatic):
                    lean = at.angle[joint.b] + joint.angle_b - at.angle[joint.a] - joint.angle_a
                    rows.append(lean - pi() * (2.0 * counted[:, column]) + twist)
        return rows

    def count(self, poses: Array) -> Array:
        """Whole turns of sliding pairs and directions of the lines of centres of gears, (N, closing), in floats."""
        found = np.zeros((len(poses), len(self.closing)))
        for column, k in enumerate(self.closing):
            joint = self.mechanism.joints[k]
            lean_a, lean_b = poses[:, joint.a, 2], poses[:, joint.b, 2]
            if isinstance(joint, Prismatic):
                found[:, column] = np.round((lean_b + joint.angle_b - lean_a - joint.angle_a) / (2.0 * np.pi))
            elif isinstance(joint, Gear):
                phi = np.angle(_world(poses, joint.b, joint.at_b) - _world(poses, joint.a, joint.at_a))
                sense = -1.0 if joint.internal else 1.0
                off = joint.radius_a * (lean_a - phi) + sense * joint.radius_b * (lean_b - phi - joint.offset)
                period = 2.0 * np.pi * (joint.radius_a + sense * joint.radius_b)
                found[:, column] = phi + 2.0 * np.pi * np.round(off / period)
        return found

    def driven(self, u: Any) -> list[Any]:
        """Enclose the coordinates of the drivers over the inputs (N,)."""
        return [law_enclosed(driver.law, u) for driver in self.mechanism.drivers]


def _box(at: tuple[float, float], tolerance: float) -> Pair:
    if tolerance == 0.0:
        return (Interval(at[0]), Interval(at[1]))
    around = Interval.midrad(1, tolerance)
    return (around * at[0], around * at[1])


def _turned(turn: Pair, p: Pair) -> Pair:
    return (turn[0] * p[0] - turn[1] * p[1], turn[1] * p[0] + turn[0] * p[1])


def _plus(a: Pair, b: Pair) -> Pair:
    return (a[0] + b[0], a[1] + b[1])


def _world(poses: Array, link: int, at: tuple[float, float]) -> NDArray[np.complex128]:
    z: NDArray[np.complex128] = (
        poses[:, link, 0] + 1j * poses[:, link, 1] + np.exp(1j * poses[:, link, 2]) * complex(*at)
    )
    return z


def _slide(joint: JointGeometry, poses: Array, rates: Array) -> Pair:
    """Displacement of the point on b along the guide of a, and its rate."""
    assert isinstance(joint, Prismatic | PinSlot)

    def rate(link: int, at: tuple[float, float]) -> NDArray[np.complex128]:
        arm = np.exp(1j * poses[:, link, 2]) * complex(*at)
        v: NDArray[np.complex128] = rates[:, link, 0] + 1j * rates[:, link, 1] + 1j * rates[:, link, 2] * arm
        return v

    t = np.exp(1j * (poses[:, joint.a, 2] + joint.angle_a))
    d = _world(poses, joint.b, joint.at_b) - _world(poses, joint.a, joint.at_a)
    w = rate(joint.b, joint.at_b) - rate(joint.a, joint.at_a)
    turning = (np.conj(1j * t * rates[:, joint.a, 2]) * d).real
    return (np.conj(t) * d).real, (np.conj(t) * w).real + turning


def _gear(joint: Gear, at: Placement, d: Pair, phi: Array) -> Any:
    """Gear equation with the direction of the line of centres counted from the float ``phi``: no cut is near."""
    centre = Interval.from_bounds(phi, phi)
    c, s = cos(centre), sin(centre)
    rest = atan2(d[1] * c - d[0] * s, d[0] * c + d[1] * s)
    direction = rest + centre
    sense = -1.0 if joint.internal else 1.0
    first = (at.angle[joint.a] - direction) * joint.radius_a
    return first + (at.angle[joint.b] - direction - joint.offset) * (sense * joint.radius_b)
