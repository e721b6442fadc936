"""The braider: inductance to zero, reactions at high speed (instruments page, 9.16 and 9.17)."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from graphsynth.evidence.stress.checks import Checks

__all__ = ["fast_reactions", "inductance"]

#: Section 4.7 at 180.3 rad/s: theta, forces on F01, F12, F23, F03 (N), torque (N m).
FAST = {
    45: ("-48.39456837046956", "-23.93107550719340", "-44.94656473810618", "-20.48307187483002", "-15.87080396653594",
         "-12.88624539887025", "9.144111795725163", "10.13573543564782", "0.3459660339026256"),
    135: ("20.24364675765324", "-8.553838129811615", "16.79564312528985", "-5.105834497448226", "-0.6792441418579340",
          "8.535545735178835", "3.671681564110434", "-8.256345064883025", "-0.1653188590303964"),
    270: ("13.38911135500051", "31.60774210507176", "13.38911135500051", "26.73152860507176", "3.721566695955627",
          "6.719076386618246", "-1.575307172379855", "-3.082513364685191", "0.2677822271000102"),
}  # fmt: skip


def inductance(check: Checks) -> None:
    """``L`` from 1e-3 to 1e-10 H: printed speeds, cost, distance to the limit model and its order."""
    from graphsynth.systems.braider.model import Braider

    sizes = (1e-3, 1e-4, 1e-5, 1e-6, 1e-8, 1e-10)
    study = Braider().inductance_study([0.0, 0.01, 0.11], sizes)
    for k, right in ((0, ("0.537673535377", "1.769031243700")), (1, ("0.552156857164", "1.771280769465"))):
        check.values(
            f"L = {sizes[k]:g}: w(0.01), w(0.11)", study.runs[k].speed[1:], right, absolute=6e-13, source="section 4.7"
        )
    gaps = [float(run.speed[2] - study.limit.speed[2]) for run in study.runs]
    for size, gap, one in zip(sizes, gaps, ("-2e-3", "1e-4", "2e-5", "2e-6", "2e-8", "2e-10")):
        digit = 10.0 ** math.floor(math.log10(abs(float(one))))
        check.value(
            f"L = {size:g}: distance to the limit", gap, one, absolute=0.5 * digit, source="section 4.7, one digit"
        )
    slopes = [gap / size for gap, size in zip(gaps[2:], sizes[2:])]
    check.values("distance over L, from 1e-5 on", slopes, [slopes[-1]] * 4, relative=0.05, source="first order")
    steps = study.steps.tolist()
    check.agrees("steps do not grow", max(steps) < 1.2 * min(steps), str(steps))


def fast_reactions(check: Checks) -> None:
    """Hundred times the speed: printed forces, the power check, the multipliers of the second formulation."""
    from graphsynth.systems.braider.model import Braider
    from graphsynth.systems.braider.multipliers import solve_with_multipliers
    from graphsynth.systems.braider.reactions import reactions

    angles = np.radians(list(FAST))
    found = reactions(Braider(), angles, 180.3, 0.0)
    table = np.column_stack([found.F01, found.F12, found.F23, found.F03, found.torque])
    for row, (degrees, right) in zip(table, FAST.items()):
        check.values(f"{degrees} degrees: forces, torque", row, right, relative=1e-13, absolute=5e-14)
    check.below("power", found.power_error, 1e-14)
    for k, theta in enumerate(angles):
        second = solve_with_multipliers(Braider(), float(theta), 180.3, acceleration=0.0)
        size = float(np.abs(second.forces).max())
        gap = float(np.abs(np.asarray(found.forces()[k]) - second.forces).max())
        check.below(f"{list(FAST)[k]} degrees: multipliers", gap, 1e-13 * size, source="second formulation")
