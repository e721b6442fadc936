"""Mobility by count and by rank of the constraint matrix at a pose."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from graphsynth.core.checks import checked
from graphsynth.core.errors import GeometryError
from graphsynth.mechanism.constraints import jacobian, residual
from graphsynth.mechanism.joints import Cam, Gear

if TYPE_CHECKING:
    from graphsynth.mechanism.model import Mechanism

Array = NDArray[np.float64]

#: Singular values below this fraction of the largest count as zero.
TOLERANCE = 1e-9
#: A pose counts as assembled if no joint is violated by more than this fraction of the characteristic length.
_ASSEMBLED = 1e-7


@dataclass(frozen=True, eq=False)
class MobilityReport:
    """Mobility by the structural count and by rank at one pose (estimated: floating point).

    Attributes
    ----------
    count : int
        ``3 (N - 1) - sum over joints of (3 - f)``.
    by_rank : int
        ``3 (N - 1) - rank``: infinitesimal freedoms at the pose.
    rank, rows : int
        Rank and number of constraint rows; ``rows - rank`` constraints are redundant at the pose.
    singular_values : ndarray
        Descending, of the matrix with rotations scaled by ``Lc``.
    tolerance : float
        Singular values below ``tolerance * largest`` were taken as zero.
    gap : float
        Smallest singular value kept over the largest: how clear the decision is; NaN for rank 0.
    freedoms : ndarray, shape (by_rank, links, 3)
        Basis of the instantaneous motions ``(dx, dy, dtheta)`` of the links.
    violation : float
        Largest constraint violation at the pose, in lengths.
    Lc : float
        Characteristic length.
    statement : str
        The result in one sentence.
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
    """Mobility by count and by rank of the constraint matrix (numpy SVD).

    Parameters
    ----------
    mechanism : Mechanism
    pose : array_like, shape (links, 3), optional
        An assembled pose; the mechanism's own by default.

    Returns
    -------
    MobilityReport
        Rank is a statement on this pose: at a singular pose it counts freedoms that exist only there.

    Raises
    ------
    GeometryError
        If there is no pose, or the joints are not closed at it.

    Examples
    --------
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
    try:
        pose_array = np.asarray(given, dtype=np.float64)
    except (TypeError, ValueError, OverflowError) as error:
        raise GeometryError(f"pose = {given!r} is no array of numbers; give (x, y, theta) of every link") from error
    links = mechanism.graph.links
    if pose_array.shape != (links, 3) or not np.isfinite(pose_array).all():
        raise GeometryError(f"pose must hold finite (x, y, theta) for {links} links; its shape is {pose_array.shape}")
    _check_centres(mechanism, pose_array)
    Lc = characteristic_length(mechanism)
    violation = float(np.abs(residual(mechanism.joints, pose_array)).max(initial=0.0))
    if violation > _ASSEMBLED * Lc:
        raise GeometryError(
            f"the joints are open by {violation:.3g} at this pose, more than {_ASSEMBLED:g} of the length {Lc:.6g}; "
            "give an assembled pose"
        )
    return _report(mechanism, pose_array, Lc, violation)


def _check_centres(mechanism: Mechanism, pose: Array) -> None:
    """Refuse gears and cams without a line of centres."""
    for joint in mechanism.joints:
        if not isinstance(joint, Gear | Cam):
            continue
        P, Q = (
            complex(*pose[link, :2]) + np.exp(1j * pose[link, 2]) * complex(*at)
            for link, at in ((joint.a, joint.at_a), (joint.b, joint.at_b))
        )
        if P == Q:
            raise GeometryError(
                f"the centres of {joint.kind} {joint.a}-{joint.b} coincide at this pose; they have no line of centres"
            )


def _report(mechanism: Mechanism, pose: Array, Lc: float, violation: float) -> MobilityReport:
    links, frame = mechanism.graph.links, mechanism.frame
    moving = [3 * k + c for k in range(links) if k != frame for c in range(3)]
    scale = np.tile([1.0, 1.0, 1.0 / Lc], links)[moving]
    matrix = jacobian(mechanism.joints, pose)[:, moving] * scale
    size = np.linalg.norm(matrix, axis=1, keepdims=True)
    matrix = matrix / np.where(size > 0.0, size, 1.0)
    _, values, rows = np.linalg.svd(matrix, full_matrices=True)
    largest = float(values[0]) if values.size else 0.0
    rank = int(np.sum(values > TOLERANCE * largest))
    by_rank = len(moving) - rank
    freedoms = np.zeros((by_rank, 3 * links))
    freedoms[:, moving] = rows[rank:] * scale
    count = mechanism.graph.mobility
    return MobilityReport(
        count=count, by_rank=by_rank, rank=rank, rows=len(matrix), singular_values=values, tolerance=TOLERANCE,
        gap=float(values[rank - 1]) / largest if rank else float("nan"), freedoms=freedoms.reshape(by_rank, links, 3),
        violation=violation, Lc=Lc, statement=_statement(count, by_rank, len(matrix) - rank),
    )  # fmt: skip


def _statement(count: int, by_rank: int, redundant: int) -> str:
    if count == by_rank:
        return f"mobility {count} by count and by rank"
    return (
        f"mobility {count} by count but {by_rank} by rank at this pose: {redundant} constraints are redundant there "
        "(special dimensions, or a singular pose)"
    )
