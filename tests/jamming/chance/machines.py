"""Three machines of different size with grades to buy.

Costs follow the reciprocal law ``a + b / T`` of Chase and Greenwood (Design issues in mechanical tolerance analysis,
Manufacturing Review 1, 1988): half a unit to set a machine up, and a unit for a hole of grade IT7 or a shaft of IT6 of
the size.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import product
from typing import Any, NamedTuple

import numpy as np

import graphsynth as gs
from graphsynth.jamming import Bearing, Distribution, Grade, ToleranceBox, joints_margin
from graphsynth.jamming.chance.probability import ChanceProblem
from graphsynth.jamming.joints import JointLimits, Misalignment, bearing_limits
from graphsynth.tolerances import FitClearance
from graphsynth.tolerances.iso286 import standard_tolerance


class Machine(NamedTuple):
    """What is asked of `allocate_tolerances`."""

    subject: Any
    grades: dict[str, list[Grade]]
    distributions: dict[str, Distribution]

    def choices(self) -> Iterator[tuple[float, dict[str, Distribution]]]:
        """Cost and distributions of every choice."""
        for picked in product(*self.grades.values()):
            chosen = {name: grade.distribution for name, grade in zip(self.grades, picked)}
            yield sum(grade.cost for grade in picked), {**self.distributions, **chosen}

    def question(self, given: dict[str, Distribution]) -> ChanceProblem:
        return ChanceProblem(self.subject, given)


def normal(ends: Any) -> Distribution:
    """Normal distribution, cut off at three sigma."""
    return Distribution.normal(ends)


def zone(size: int, grade: int, middle: float, unit: int = 7) -> Grade:
    """Tolerance zone of an ISO grade about a deviation (mm), with what it costs; ``unit``: the grade that costs one."""
    width = standard_tolerance(grade, size)
    cost = round(float(0.5 + standard_tolerance(unit, size) / width), 2)
    return Grade(f"IT{grade}", normal(f"{middle} +- {float(width / 2):.9f}"), cost)


def squared(middle: float, *halves: float) -> list[Grade]:
    """How well an axis is put square: tilts about a middle value; nothing, or work that grows with their inverse."""
    worst = max(halves)
    return [
        Grade(f"+- {half:g}", normal(f"{middle} +- {half}"), round(2.0 * (worst / half - 1.0), 2)) for half in halves
    ]


def small() -> Machine:
    """One bearing of the lambda linkage, 35 mm: 36 choices of clearance, crank and squareness."""
    fits = []
    for hole, shaft in ((9, 8), (8, 7), (7, 6), (6, 5)):
        parts = zone(35, hole, 0.0), zone(35, shaft, 0.0, 6)
        about = sum(float(part.distribution.support.upper) for part in parts) / 2  # of the radius
        cost = sum(part.cost for part in parts)
        fits.append(Grade(f"IT{hole} and IT{shaft}", normal(f"0.036 +- {about:.9f}"), cost))
    lengths = []
    for grade in (14, 11, 8):  # of a crank of 100 mm, which is the unit of length
        own = zone(100, grade, 0.0)
        lengths.append(Grade(own.name, normal(f"1 +- {float(own.distribution.support.upper) / 100:.9f}"), own.cost))
    grades = {"clearance": fits, "l2": lengths, "alpha": squared(0.0145, 0.0015, 0.001, 0.0004)}
    return Machine(ToleranceBox(alpha=0.0145, Rb="17.5", Hb="10 +- 0.1", clearance="0.036"), grades, {})


def middle() -> Machine:
    """All joints of a crank press, with a fit at the crank pin: 48 choices of hole, shaft and squareness."""
    motion = gs.Mechanism.slider_crank(0.04, 0.08).simulate("0..360 deg")
    shaft = Misalignment(0, 1, 0.0022, 0.5, alpha_range=(0.0016, 0.0028))
    pin = FitClearance((1, 2), "30 F9/h8", 25.0)
    grades = {
        "hole 1-2": [zone(30, grade, 0.034) for grade in (9, 8, 7, 6)],
        "shaft 1-2": [zone(30, grade, -0.014, 6) for grade in (8, 7, 6, 5)],
        "alpha 0-1": squared(0.0022, 0.0006, 0.0004, 0.00015),
    }
    margin = joints_margin(motion, bearing_limits(Bearing(15, 40, 0.06)), shaft, [pin])
    return Machine(margin, grades, {})


def large() -> Machine:
    """All joints of a six-bar with six bearings, 7 quantities: 243 choices of four clearances and the squareness.

    Bearings of 30 mm, 25 mm high, with a middle clearance of 0.07 mm: they tilt by clearance over height.
    """
    from graphsynth.kinematics.dimensional import embody

    mechanism = embody(next(iter(gs.enumerate_chains(6))), seed=0).mechanism
    motion = gs.simulate(mechanism, np.linspace(0.0, 1.5, 25))
    base, crank = mechanism.drivers[0].pair
    pairs = [joint.pair for joint in mechanism.joints if joint.pair != (base, crank)]
    fits = []
    for hole, shaft in ((8, 7), (7, 6), (6, 5)):
        parts = zone(30, hole, 0.0), zone(30, shaft, 0.0, 6)
        about = sum(float(part.distribution.support.upper) for part in parts) / 25
        cost = sum(part.cost for part in parts)
        fits.append(Grade(f"IT{hole} and IT{shaft}", normal(f"0.0028 +- {about:.9f}"), cost))
    limits = {pair: JointLimits(0.0028, tilt_range=(0.0017, 0.0039)) for pair in pairs}
    tilt = Misalignment(base, crank, 0.0066, 0.5, alpha_range=(0.0054, 0.0078))
    margin = joints_margin(motion, limits, tilt)
    tilts = [f"tilt {a}-{b}" for a, b in pairs]
    grades = dict.fromkeys(tilts[:4], fits) | {f"alpha {base}-{crank}": squared(0.0066, 0.0012, 0.0008, 0.0003)}
    return Machine(margin, grades, dict.fromkeys(tilts[4:], fits[1].distribution))
