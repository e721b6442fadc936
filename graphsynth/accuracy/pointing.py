"""Poses of the antenna: rows of its own room, against fifty digits."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from graphsynth.accuracy.rows import Effort, Problem, Row, RowStatus

if TYPE_CHECKING:
    from graphsynth.kinematics.pointing import PointingMechanism

__all__ = ["pose_problem"]


def pose_problem(mechanism: PointingMechanism, largest: float, effort: Effort | None = None) -> Problem:
    """Compare the closed form with the twelve equations, over equal crank angles up to ``largest`` (radians).

    Examples
    --------
    >>> from graphsynth.kinematics.pointing import PointingMechanism
    >>> pose_problem(PointingMechanism(), 0.5, Effort(rounds=1, quick=True)).rows[0].error < 1e-15
    True
    """
    from graphsynth.kinematics.pointing.accuracy import pointing_errors

    effort = effort or Effort()
    found = pointing_errors(mechanism, largest, poses=3 if effort.quick else 9, rounds=effort.rounds)
    rows = []
    for r in found:
        reference = "closed form with 50 digits" + (" (the same formula)" if r.method == "closed form" else "")
        wrong = not math.isfinite(r.error) or r.error > 0.01
        why = "it converges to another assembly, or to none" if wrong else ""
        status = RowStatus.UNRELIABLE if wrong else RowStatus.OK
        rows.append(
            Row(
                r.method, r.setting, r.error, r.seconds, effort.rounds, "largest distance from the reference",
                reference, status, why,
            )
        )  # fmt: skip
    question = f"Elevation and azimuth of the reflector, both cranks from 0 to {math.degrees(largest):g} degrees"
    return Problem("poses", question, "rad", tuple(rows), "pose")
