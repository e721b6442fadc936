"""Margins of all joints whose probability of binding is known: the lambda linkage with three equal bearings."""

from __future__ import annotations

from typing import Any


def equal_bearings(tilt: tuple[float, float], limit: float = 0.006, span: str = "60..120 deg") -> Any:
    """Return the margin of the lambda linkage with three equal bearings and a tilt of its motor axis within a range.

    They bind if and only if the tilt is above twice the limit, where the crank stands at a right angle in the range.
    """
    from graphsynth.jamming import joints_margin
    from graphsynth.jamming.joints import JointLimits, Misalignment
    from graphsynth.kinematics.simulation import simulate
    from graphsynth.mechanism.model import Mechanism

    misaligned = Misalignment(0, 1, 0.5 * sum(tilt), alpha_range=tilt)
    return joints_margin(simulate(Mechanism.four_bar(2, 1, 2.5, 2.5), span), JointLimits(limit), misaligned)
