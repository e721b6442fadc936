"""The whole single-motor mechanism as a `graphsynth.Mechanism`, and the rank of its loop-closure matrix.

The loop-closure matrix has one column for every freedom of a joint and three rows for every independent loop: the
unit twists of the joints around a loop, weighted by their speeds, sum to zero.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import networkx as nx
import numpy as np
from numpy.typing import ArrayLike, NDArray

from graphsynth.core.checks import checked, finite, finite_array, triple
from graphsynth.core.errors import GeometryError
from graphsynth.mechanism.equations import FLOATS, Gradient, derivatives, seen
from graphsynth.mechanism.joints import Cam, Gear, JointGeometry, PinSlot, Prismatic, Revolute

if TYPE_CHECKING:
    from graphsynth.mechanism.model import Mechanism
    from graphsynth.systems.platform.single_motor_platform import SingleMotorPlatform

Array = NDArray[np.float64]

TOLERANCE = 1e-9


@dataclass(frozen=True, eq=False)
class LoopClosure:
    """Loop-closure matrix at one configuration (estimated: floating point, rank by singular values).

    * `matrix` (shape (3 loops, freedoms)): rows in rad/s, length/s over ``Lc``; sliding columns are scaled with ``Lc``.
    * `columns`: ``"R 0-1"``; a gear pair has ``"roll 1-2"`` and ``"slide 1-2"``, a pin in a slot ``"turn"`` and
      ``"slide"``.
    * `singular_values`: descending.
    * `rank`: singular values above ``tolerance`` times the largest.
    * `motions` (shape (freedoms - rank, freedoms)): orthonormal null vectors: joint speeds of the instantaneous motions
      (sliding speeds over ``Lc``).
    """

    matrix: Array
    columns: tuple[str, ...]
    singular_values: Array
    rank: int
    motions: Array
    tolerance: float
    Lc: float

    @property
    def mobility(self) -> int:
        """Freedoms minus rank."""
        return len(self.columns) - self.rank

    def component(self, column: str) -> Array:
        """Speeds of one joint freedom in every instantaneous motion.

        Raises `GeometryError`: a column that does not exist.
        """
        if column not in self.columns:
            raise GeometryError(f"column {column!r} is unknown; use one of {', '.join(self.columns)}")
        return np.asarray(self.motions[:, self.columns.index(column)])


@checked
def link_poses(platform: SingleMotorPlatform, psi: float, pose: ArrayLike) -> Array:
    """Pose ``(x, y, angle)`` of all 15 links, in the frames used by `as_mechanism`; shape (15, 3).

    Links: 0 frame, 1 pinion, 2-4 wheels, 5-7 couplers, 8-10 rockers (bell-cranks), 11-13 intermediate links, 14
    platform.
    """
    X = triple("pose", pose)
    state = platform.drive(finite("psi", psi))
    turn = np.exp(1j * np.array(platform.frame_angle))
    O, D = np.array(platform.axis) * turn, np.array(platform.platform.D)
    phi = state.theta - np.array(platform.delta)
    B = O + np.array(platform.crank) * np.exp(1j * (psi + np.array(platform.phase)))
    C = D + np.array(platform.rocker) * np.exp(1j * phi)
    A, F = platform.platform.elbows(state.theta), platform.platform.vertices(X)
    poses = np.zeros((15, 3))
    poses[1, 2] = psi / platform.gears.ratio
    for first, at, angle in ((2, O, np.full(3, psi)), (5, B, np.angle(C - B)), (8, D, phi), (11, A, np.angle(F - A))):
        poses[first : first + 3] = np.column_stack([at.real, at.imag, angle])
    poses[14] = X
    return poses


@checked
def as_mechanism(platform: SingleMotorPlatform, psi: float = 0.0, pose: ArrayLike | None = None) -> Mechanism:
    """Build the 15-link mechanism with 19 revolute joints and 3 gear pairs.

    `psi`: wheel angle at which the links' poses are given, radians. `pose` (shape (3,)): platform pose there; the home
    branch by default. Driven at the pinion with the common wheel angle psi as input; the named point "P" is the
    platform's reference point. Raises `GeometryError`: a wheel on the axis of the pinion, or a drive that is not
    assembled at ``psi``.

    >>> from graphsynth.systems.platform.single_motor_platform import SingleMotorPlatform
    >>> mechanism = as_mechanism(SingleMotorPlatform())
    >>> mechanism.graph.links, mechanism.mobility().count, mechanism.mobility().by_rank
    (15, 1, 1)
    """
    from graphsynth.mechanism.laws import Driver, Linear
    from graphsynth.mechanism.model import Mechanism, TracePoint

    start = platform.home_pose(psi) if pose is None else triple("pose", pose)
    poses = link_poses(platform, psi, start)
    if not np.isfinite(poses).all():
        raise GeometryError(f"a drive is not assembled at psi = {psi}; choose an angle inside its reach")
    joints: list[JointGeometry] = [Revolute(0, 1)]
    for k in range(3):
        joints += _leg(platform, k)
    driver = Driver(0, 1, Linear(1.0 / platform.gears.ratio))
    at: tuple[tuple[float, float, float], ...] = tuple(map(tuple, poses.tolist()))
    return Mechanism(platform.graph(), tuple(joints), (driver,), {"P": TracePoint(14, (0.0, 0.0))}, at)


def _leg(platform: SingleMotorPlatform, k: int) -> list[JointGeometry]:
    """Joints of wheel, coupler, rocker and intermediate link k (from 0)."""
    turn, gears = complex(np.exp(1j * platform.frame_angle[k])), platform.gears
    wheel, coupler, rocker, link = 2 + k, 5 + k, 8 + k, 11 + k
    O, D, b = complex(platform.axis[k] * turn), platform.platform.D[k], platform.platform.b[k]
    if O == 0:
        raise GeometryError(f"wheel {k + 1} lies on the axis of the pinion; give an axis that is not 0")
    small, large = (abs(O) * teeth / (gears.z1 + gears.z2) for teeth in (gears.z1, gears.z2))
    toothed = -(1.0 + small / large) * math.atan2(O.imag, O.real)
    crank = platform.crank[k] * complex(np.exp(1j * platform.phase[k]))
    arm = platform.l1[k] * complex(np.exp(1j * platform.delta[k]))
    return [
        Revolute(0, wheel, (O.real, O.imag)),
        Revolute(wheel, coupler, (crank.real, crank.imag)),
        Revolute(coupler, rocker, (platform.coupler[k], 0.0), (platform.rocker[k], 0.0)),
        Revolute(0, rocker, (D.real, D.imag)),
        Revolute(rocker, link, (arm.real, arm.imag)),
        Revolute(link, 14, (platform.l2[k], 0.0), (b.real, b.imag)),
        Gear(1, wheel, radius_a=small, radius_b=large, offset=toothed),
    ]


@checked
def loop_closure(mechanism: Mechanism, pose: ArrayLike | None = None, *, tolerance: float = TOLERANCE) -> LoopClosure:
    """Loop-closure matrix of any planar mechanism at a configuration, with rank and instantaneous motions.

    `pose` (shape (links, 3)): link poses; the mechanism's own by default. Raises `GeometryError`: no configuration, or
    one of another shape. Loops are the fundamental cycles of a breadth-first spanning tree from the frame.  A gear pair
    has two freedoms: rolling about the pitch point and sliding along the line of centres (theory/platform-drive 7).
    """
    from graphsynth.mechanism.constraints import characteristic_length

    given = mechanism.pose if pose is None else pose
    if given is None:
        raise GeometryError("the rank belongs to a configuration, and this mechanism has none; give link poses")
    X = finite_array("pose", given)
    if X.shape != (mechanism.graph.links, 3):
        raise GeometryError(f"pose has shape {X.shape}; give (x, y, theta) for {mechanism.graph.links} links")
    Lc = characteristic_length(mechanism)
    names: list[str] = []
    twists: list[Array] = []
    own: list[int] = []
    for number, joint in enumerate(mechanism.joints):
        for name, twist in _twists(joint, X, Lc):
            names.append(f"{name} {joint.a}-{joint.b}")
            twists.append(twist)
            own.append(number)
    matrix = (_cycles(mechanism)[:, own][:, None, :] * np.array(twists).T[None]).reshape(-1, len(names))
    _, values, rows = np.linalg.svd(matrix, full_matrices=True)
    rank = int((values > tolerance * values[0]).sum()) if values.size else 0
    return LoopClosure(matrix, tuple(names), values, rank, rows[rank:], tolerance, Lc)


@checked
def platform_loop_closure(platform: SingleMotorPlatform, psi: float, pose: ArrayLike) -> LoopClosure:
    """Loop-closure matrix (24 x 25) of the single-motor mechanism at one configuration.

    >>> from graphsynth.systems.platform.single_motor_platform import SingleMotorPlatform
    >>> mechanism = SingleMotorPlatform(crank=(10, 5, 1), phase=(0, 0.5, 1))
    >>> found = platform_loop_closure(mechanism, 0.3, mechanism.home_pose(0.3))
    >>> found.matrix.shape, found.rank, found.mobility
    ((24, 25), 24, 1)
    """
    return loop_closure(as_mechanism(platform, psi, pose))


#: Names of the freedoms of a joint, the turning one first.
_FREEDOMS = {
    Revolute: ("R",),
    Prismatic: ("P",),
    Gear: ("roll", "slide"),
    Cam: ("turn", "slide"),
    PinSlot: ("turn", "slide"),
}


def _twists(joint: JointGeometry, X: Array, Lc: float) -> list[tuple[str, Array]]:
    """List the unit twists ``(turn, v_x / Lc, v_y / Lc)`` of link b against link a, velocities taken at the origin.

    They are what the equations of the joint leave free.  A joint with one freedom has its coordinate as speed; one with
    two turns about the point at which the pin, the roller or the other wheel's centre does not slide, and slides.
    """
    at = seen(FLOATS, joint, X[joint.a], X[joint.b])
    x, y, _ = X[joint.b]

    def row(gradient: Gradient) -> Array:
        by_x, by_y, by_angle = (0.0 if v is None else float(v) for v in derivatives(at, [gradient])[0][1])
        return np.array([by_angle - by_x * y + by_y * x, Lc * by_x, Lc * by_y])

    names, held = _FREEDOMS[type(joint)], [row(gradient) for gradient in joint.gradients(at)]
    if isinstance(joint, Revolute | Prismatic):
        free = np.linalg.solve(np.array([*held, row(joint.coordinate(at)[1])]), [0.0, 0.0, 1.0])
        return [(names[0], free / (1.0 if names == ("R",) else np.hypot(free[1], free[2])))]
    across, along = held[0][1:] / np.hypot(*held[0][1:])
    slide = np.array([0.0, along, -across]) * (1.0 if isinstance(joint, PinSlot) else -1.0)  # along the guide, outward
    px, py = x + float(at.arm_b.x), y + float(at.arm_b.y)
    still = np.array([(slide[2] * px - slide[1] * py) / Lc, slide[1], slide[2]])  # speed of that point along the slide
    turn = np.linalg.solve(np.array([held[0] / np.linalg.norm(held[0]), still, [1.0, 0.0, 0.0]]), [0.0, 0.0, 1.0])
    return [(names[0], turn), (names[1], slide)]


def _cycles(mechanism: Mechanism) -> Array:
    """Fundamental cycles, shape (loops, joints): +1 where a loop passes a joint from a to b, -1 the other way."""
    joints = mechanism.joints
    number = {frozenset((joint.a, joint.b)): k for k, joint in enumerate(joints)}
    graph = nx.Graph((joint.a, joint.b) for joint in joints)
    tree = [number[frozenset(edge)] for edge in nx.bfs_edges(graph, mechanism.frame)]
    rest = sorted(set(range(len(joints))) - set(tree))
    incidence = np.zeros((mechanism.graph.links, len(joints)))
    for k, joint in enumerate(joints):
        incidence[joint.a, k], incidence[joint.b, k] = -1.0, 1.0
    moving = np.delete(incidence, mechanism.frame, axis=0)
    cycles = np.zeros((len(rest), len(joints)))
    cycles[range(len(rest)), rest] = 1.0
    cycles[:, tree] = -np.rint(np.linalg.solve(moving[:, tree], moving[:, rest])).T
    return cycles
