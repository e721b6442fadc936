"""Rank of the loop equations at a pose: singular coordinates or a singular mechanism (section 2.4)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from graphsynth.core.errors import GeometryError
from graphsynth.systems.antenna.closed_form import poses
from graphsynth.systems.antenna.loop_equations import CHARTS, loop_equations
from graphsynth.systems.antenna.passive import passive_angles, printed_ball_joint

if TYPE_CHECKING:
    from graphsynth.systems.antenna.mechanism import PointingMechanism

__all__ = ["ChartReport", "check_chart"]

#: A singular value below this part of the largest counts as zero, and so does a smaller sine of the angle to a fold:
#: beside a fold both fall with the square root of the distance, 1e-8 at one unit of rounding.
RANK_TOLERANCE = 1e-7


@dataclass(frozen=True, eq=False)
class ChartReport:
    """Rank of the 12 x 12 Jacobian in one set of coordinates (estimated: floating-point singular values).

    Attributes
    ----------
    chart : str
        Coordinates asked for.
    rank : int
        Number of singular values above 1e-7 of the largest.
    singular_values : ndarray, shape (12,)
        Position rows divided by ``l1`` (unless asked otherwise), falling.
    other_rank : int
        Rank at the same pose in the other coordinates.
    fold_margin : float
        Sine of the angle to the nearest fold of the mechanism, from the closed form: independent of coordinates.
    verdict : str
        "regular", "coordinates singular, mechanism regular" or "mechanism singular".
    use : str
        Coordinates to use at this pose; empty if none is regular.
    """

    chart: str
    rank: int
    singular_values: NDArray[np.float64]
    other_rank: int
    fold_margin: float
    verdict: str
    use: str

    @property
    def condition(self) -> float:
        """Ratio of the largest to the smallest singular value."""
        smallest = float(self.singular_values[-1])
        return float(self.singular_values[0]) / smallest if smallest > 0.0 else float("inf")


def _singular_values(
    mechanism: PointingMechanism, x: NDArray[np.float64], phi: NDArray[np.float64], chart: str, scaled: bool
) -> tuple[NDArray[np.float64], int]:
    values = np.linalg.svd(loop_equations(mechanism, x[None], phi[None], chart, scaled=scaled).jacobian[0])[1]
    return values, int((values > RANK_TOLERANCE * values[0]).sum())


def check_chart(
    mechanism: PointingMechanism, phi_x: float, phi_y: float, chart: str, s_y: int, s_x: int, scaled: bool
) -> ChartReport:
    """Judge the coordinates at a pose; see `PointingMechanism.check_chart`."""
    if chart not in CHARTS:
        raise GeometryError(f"chart = {chart!r} is unknown; use one of {', '.join(map(repr, CHARTS))}")
    pose = poses(mechanism, phi_x, phi_y, s_y, s_x)
    if not pose.assembled:
        raise GeometryError(f"no rank at phi_x = {phi_x}, phi_y = {phi_y}: {pose.reasons()[0]}; choose another pose")
    corrected = passive_angles(mechanism, pose).x
    printed = corrected.copy()
    printed[2:5] = printed_ball_joint(mechanism, pose)
    unknowns = {"corrected": corrected, "printed": printed}
    phi = np.array([float(phi_x), float(phi_y)])
    found = {name: _singular_values(mechanism, unknowns[name], phi, name, scaled) for name in CHARTS}
    values, rank = found[chart]
    other_rank = found[CHARTS[1 - CHARTS.index(chart)]][1]
    margin = float(min(pose.margin_x, pose.margin_y))
    regular = [name for name in CHARTS if found[name][1] == 12]
    if margin < RANK_TOLERANCE:
        verdict = "mechanism singular"
    else:
        verdict = "regular" if rank == 12 else "coordinates singular, mechanism regular"
    return ChartReport(chart, rank, values, other_rank, margin, verdict, regular[0] if regular else "")
