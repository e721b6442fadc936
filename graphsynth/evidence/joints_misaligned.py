"""Error against run time of the coupled model, on a linkage whose largest misalignment is known exactly.

The lambda linkage with three equal bearings and a motor tilted about the x axis is free over the whole turn up to twice
the critical tilt of a bearing, and not beyond (theory/joints-that-share-a-tilt 6).
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from time import perf_counter
from typing import TYPE_CHECKING, NamedTuple, TypeVar

import numpy as np

from graphsynth.jamming.bearing.bearing import Bearing
from graphsynth.jamming.joints.limits import Misalignment
from graphsynth.mechanism.joints import Revolute
from graphsynth.mechanism.model import Driver, Mechanism
from graphsynth.structure.graph import MechanismGraph

if TYPE_CHECKING:
    from graphsynth.kinematics.simulation import Motion

__all__ = ["ErrorAndTime", "error_against_time"]

T = TypeVar("T")
_ALPHA = 0.01


class ErrorAndTime(NamedTuple):
    """One row: ``error`` is relative, ``seconds`` the least of the repetitions."""

    method: str
    setting: str
    error: float
    seconds: float


def error_against_time(
    samples: Iterable[int] = (8, 26, 74, 362, 1802),
    gaps: Iterable[float] = (1e-1, 1e-2, 1e-3, 1e-4, 1e-5),
    repeats: int = 3,
) -> list[ErrorAndTime]:
    """Measure the largest misalignment of the lambda linkage by samples and by proof.

    Parameters
    ----------
    samples : iterable of int
        Numbers of positions of the turn for the estimate, whose error is that against the exact value.  The worst input
        is 90 degrees: numbers that put a sample there flatter.
    gaps : iterable of float
        Gaps asked of `graphsynth.jamming.joints.largest_scale`; the error is the certified gap between its bounds.
    repeats : int
        Runs of each, of which the fastest counts.

    Returns
    -------
    list of ErrorAndTime
        Methods "samples" (estimated, never too small) and "certified gap" (proved on both sides).

    Raises
    ------
    GeometryError
        Of `largest_scale` for a gap that is no number of zero or more.

    Examples
    --------
    >>> row = error_against_time(samples=(8,), gaps=(), repeats=1)[0]
    >>> row.method, row.setting, round(row.error, 4)
    ('samples', '8 positions', 0.0044)
    """
    from graphsynth.jamming.joints.assess import assess_coupled
    from graphsynth.jamming.joints.scale import largest_scale
    from graphsynth.kinematics.simulation import simulate

    mechanism, tilt, bearing = _linkage(), Misalignment(0, 1, _ALPHA), Bearing()
    critical = bearing.critical_tilt("A").angle
    assert critical is not None
    exact = 2.0 * critical / _ALPHA

    def turn(count: int) -> Motion:
        return simulate(mechanism, np.linspace(0.0, 2.0 * np.pi, count), events=False)

    rows = []
    for count in samples:
        report, seconds = _timed(lambda n=count: assess_coupled(turn(n), bearing, tilt), repeats)  # type: ignore[misc]
        error = abs(report.smallest_scale / exact - 1.0)
        rows.append(ErrorAndTime("samples", f"{count} positions", error, seconds))
    motion = turn(37)
    for gap in gaps:
        found, seconds = _timed(
            lambda wanted=gap: largest_scale(motion, bearing, tilt, relative_gap=wanted),  # type: ignore[misc]
            repeats,
        )
        setting = f"gap {gap:g}, {found.evaluated} pieces"
        rows.append(ErrorAndTime("certified gap", setting, found.relative_gap, seconds))
    return rows


def _linkage() -> Mechanism:
    graph = MechanismGraph(4, [(0, 1), (1, 2), (2, 3), (0, 3)], frame=0)
    joints = (
        Revolute(0, 1),
        Revolute(1, 2, (1.0, 0.0)),
        Revolute(2, 3, (2.5, 0.0), (2.5, 0.0)),
        Revolute(0, 3, (2.0, 0.0)),
    )
    return Mechanism(graph, joints, (Driver(0, 1),))


def _timed(run: Callable[[], T], repeats: int) -> tuple[T, float]:
    least, result = np.inf, None
    for _ in range(max(1, repeats)):
        begin = perf_counter()
        result = run()
        least = min(least, perf_counter() - begin)
    assert result is not None
    return result, float(least)
