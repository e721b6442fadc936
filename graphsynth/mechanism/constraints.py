"""Constraint equations of the joints of a mechanism in link poses, their Jacobian, and the mobility by its rank.

The unknowns are the poses ``(x, y, theta)`` of all links, three columns per link in link order; every joint gives
``3 - mobility`` rows.  These are the equations as stated by the joints, without any elimination: the reference against
which solved poses are substituted, and the matrix whose rank is the mobility.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from graphsynth.core.checks import checked, finite_array
from graphsynth.core.errors import GeometryError
from graphsynth.mechanism.equations import FLOATS, Seen, derivatives, seen
from graphsynth.mechanism.joints import Cam, Gear, JointGeometry

if TYPE_CHECKING:
    from graphsynth.mechanism.model import Mechanism

Array = NDArray[np.float64]

#: Singular values below this fraction of the largest count as zero.
TOLERANCE = 1e-9
#: A pose counts as assembled if no joint is violated by more than this fraction of the characteristic length.
_ASSEMBLED = 1e-7


def _seen(joint: JointGeometry, pose: Array) -> Seen:
    a, b = ((pose[..., link, 0], pose[..., link, 1], pose[..., link, 2]) for link in (joint.a, joint.b))
    return seen(FLOATS, joint, a, b)


def _read(joints: Iterable[JointGeometry], poses: ArrayLike) -> tuple[list[JointGeometry], Array]:
    """Return joints and poses that fit each other."""
    try:
        found = list(joints)
        most = max((max(joint.a, joint.b) for joint in found), default=0)
    except (TypeError, AttributeError) as error:
        raise GeometryError(f"joints = {str(joints)[:60]} is no list of joints ({error}); give one") from error
    try:
        pose = np.asarray(poses, dtype=np.float64)
    except (TypeError, ValueError, OverflowError) as error:
        raise GeometryError(
            f"poses hold something that is no number ({error}); give x, y and angle of each link"
        ) from error
    if pose.ndim < 2 or pose.shape[-1] != 3 or pose.shape[-2] <= most:
        raise GeometryError(f"poses of shape {pose.shape} do not fit joints of links 0 to {most}; give (..., links, 3)")
    return found, pose


def residual(joints: Sequence[JointGeometry], poses: ArrayLike) -> Array:
    """Constraint violations at ``poses`` (..., links, 3), shape (..., rows), in lengths.

    Angular equations are the sine of the angle error times the longest arm of the two links at that joint (at least the
    distance of the joint's points from the origins; 1 if both vanish).  A gear pair counts modulo a tooth-independent
    full turn of wheel b.

    >>> from graphsynth.mechanism.joints import Revolute
    >>> residual([Revolute(0, 1, at_a=(1.0, 0.0))], [[0, 0, 0], [1, 2, 0.3]]).tolist()
    [0.0, 2.0]
    """
    joints, pose = _read(joints, poses)
    rows: list[Array] = []
    for joint in joints:
        for value, turns in zip(joint.values(_seen(joint, pose)), joint.turns()):
            if len(turns) == 1:
                size = max(abs(complex(*joint.at_a)), abs(complex(*joint.at_b))) or 1.0
                rows.append(2.0 * size * np.sin(0.5 * value) * np.sign(np.cos(0.5 * value)))
            elif turns:
                period = 2.0 * np.pi * abs(sum(turns))
                rows.append(np.asarray(value - period * np.round(value / period)))
            else:
                rows.append(value)
    return np.stack(rows, axis=-1) if rows else np.zeros((*pose.shape[:-2], 0))


def jacobian(joints: Sequence[JointGeometry], poses: ArrayLike) -> Array:
    """Return the derivatives of the constraints by the poses, shape (..., rows, 3 links).

    Angular rows (prismatic joints) are those of the plain angle equation, in radians.
    """
    joints, pose = _read(joints, poses)
    count = sum(3 - joint.mobility for joint in joints)
    J = np.zeros((*pose.shape[:-2], count, 3 * pose.shape[-2]))
    row = 0
    for joint in joints:
        at = _seen(joint, pose)
        for by_a, by_b in derivatives(at, joint.gradients(at)):
            for link, entries in ((joint.a, by_a), (joint.b, by_b)):
                for axis, entry in enumerate(entries):
                    if entry is not None:
                        J[..., row, 3 * link + axis] = entry
            row += 1
    return J


@dataclass(frozen=True, eq=False)
class MobilityReport:
    """Mobility by the structural count and by rank at one pose (estimated: floating point).

    ``count`` is ``3 (N - 1) - sum over joints of (3 - f)``, ``by_rank`` is ``3 (N - 1) - rank``: infinitesimal freedoms
    at the pose, with ``freedoms`` (by_rank, links, 3) as a basis of motions ``(dx, dy, dtheta)`` of the links.  The
    ``singular_values`` descend, of the matrix with rotations scaled by the characteristic length ``Lc``; those below
    ``tolerance * largest`` were taken as zero, and ``gap`` is the smallest one kept over the largest: how clear the
    decision is; NaN for rank 0.  ``violation`` is the largest constraint violation at the pose, in lengths.
    """

    count: int
    by_rank: int
    rank: int
    rows: int
    singular_values: Array
    tolerance: float
    gap: float
    freedoms: Array
    violation: float
    Lc: float
    statement: str

    @property
    def redundant(self) -> int:
        """Redundant constraints at the pose."""
        return self.rows - self.rank

    @property
    def agrees(self) -> bool:
        """Whether count and rank give the same mobility."""
        return self.count == self.by_rank


def characteristic_length(mechanism: Mechanism) -> float:
    """Largest distance between two joint points of one link; 1 if there is none."""
    spread = 0.0
    ends: dict[int, list[complex]] = {}
    for joint in mechanism.joints:
        ends.setdefault(joint.a, []).append(complex(*joint.at_a))
        ends.setdefault(joint.b, []).append(complex(*joint.at_b))
    for found in ends.values():
        spread = max(spread, *(abs(p - found[0]) for p in found))
    return spread or 1.0


@checked
def mobility_report(mechanism: Mechanism, pose: ArrayLike | None = None) -> MobilityReport:
    """Mobility by count and by rank of the constraint matrix (numpy SVD) at a pose, the mechanism's own by default.

    Rank is a statement on this pose: at a singular pose it counts freedoms that exist only there.  `GeometryError` if
    there is no pose, or the joints are not closed at it.

    A parallelogram with a third parallel bar turns, although the count says it is a structure.

    >>> from graphsynth.mechanism.model import Mechanism, MechanismGraph, Revolute
    >>> graph = MechanismGraph(5, [(0, 1), (0, 3), (0, 4), (1, 2), (2, 3), (2, 4)], frame=0)
    >>> bars = [Revolute(0, k, (x, 0.0)) for k, x in ((1, 0.0), (3, 2.0), (4, 1.0))]
    >>> tops = [Revolute(2, k, (x, 0.0), (0.0, 1.0)) for k, x in ((1, 0.0), (3, 2.0), (4, 1.0))]
    >>> pose = [(0, 0, 0), (0, 0, 0), (0, 1, 0), (2, 0, 0), (1, 0, 0)]
    >>> report = Mechanism(graph, bars + tops, pose=pose).mobility()
    >>> report.count, report.by_rank, report.redundant
    (0, 1, 1)
    """
    given = mechanism.pose if pose is None else pose
    if given is None:
        raise GeometryError("the rank belongs to a pose, and this mechanism has none; give an assembled pose")
    pose_array = finite_array("pose", given)
    links = mechanism.graph.links
    if pose_array.shape != (links, 3):
        raise GeometryError(f"pose must hold (x, y, theta) for {links} links; its shape is {pose_array.shape}")
    for joint in mechanism.joints:
        d = _seen(joint, pose_array).d
        if isinstance(joint, Gear | Cam) and d.x == d.y == 0.0:
            raise GeometryError(
                f"the centres of {joint.kind} {joint.a}-{joint.b} coincide at this pose; they have no line of centres"
            )
    Lc = characteristic_length(mechanism)
    violation = float(np.abs(residual(mechanism.joints, pose_array)).max(initial=0.0))
    if violation > _ASSEMBLED * Lc:
        raise GeometryError(
            f"the joints are open by {violation:.3g} at this pose, more than {_ASSEMBLED:g} of the length {Lc:.6g}; "
            "give an assembled pose"
        )
    return _report(mechanism, pose_array, Lc, violation)


def _report(mechanism: Mechanism, pose: Array, Lc: float, violation: float) -> MobilityReport:
    links, frame = mechanism.graph.links, mechanism.frame
    moving = [3 * k + c for k in range(links) if k != frame for c in range(3)]
    scale = np.tile([1.0, 1.0, 1.0 / Lc], links)[moving]
    matrix = jacobian(mechanism.joints, pose)[:, moving] * scale
    size = np.linalg.norm(matrix, axis=1, keepdims=True)
    matrix = matrix / np.where(size > 0.0, size, 1.0)
    _, values, directions = np.linalg.svd(matrix, full_matrices=True)
    largest = float(values[0]) if values.size else 0.0
    rank, rows = int(np.sum(values > TOLERANCE * largest)), len(matrix)
    by_rank, count = len(moving) - rank, mechanism.graph.mobility
    found = np.zeros((by_rank, 3 * links))
    found[:, moving] = directions[rank:] * scale
    freedoms = found.reshape(by_rank, links, 3)
    gap = float(values[rank - 1]) / largest if rank else float("nan")
    text = f"mobility {count} by count and by rank"
    if count != by_rank:
        text = (
            f"mobility {count} by count but {by_rank} by rank at this pose: {rows - rank} constraints are redundant "
            "there (special dimensions, or a singular pose)"
        )
    return MobilityReport(count, by_rank, rank, rows, values, TOLERANCE, gap, freedoms, violation, Lc, text)
