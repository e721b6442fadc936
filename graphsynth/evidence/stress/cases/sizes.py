"""Beyond the specification: sizes that double precision holds or does not, tilts that underflow, many turns."""

from __future__ import annotations

import math
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from graphsynth.evidence.stress.cases.linkages import four_bar, planet, wheel

if TYPE_CHECKING:
    from graphsynth.evidence.stress.checks import Checks

__all__ = ["huge_angles", "linkages", "many_turns", "refused", "tiny_tilts"]

_OUTSIDE = (1e-300, 1e-160, 1e-100, 1e100, 1e120, 1e155, 1e300)


def refused(check: Checks) -> None:
    """Linkages, bearings, platforms, drives, pistons, tribometers beyond 1e-60 and 1e60: one sentence each."""
    from graphsynth.jamming import Bearing
    from graphsynth.kinematics.triad.assembly_modes import assembly_modes
    from graphsynth.mechanism.four_bar import TiltedFourBar
    from graphsynth.systems.braider import FourBar
    from graphsynth.systems.piston.drives import CrankSlider, ScotchYoke
    from graphsynth.systems.platform.drive import FourBarDrive
    from graphsynth.systems.platform.parallel_platform import ParallelPlatform
    from graphsynth.systems.tribometer.model import Tribometer

    corner = np.exp(2j * np.pi * np.arange(3) / 3)
    for unit in _OUTSIDE:
        points, legs = tuple((unit * corner).tolist()), (unit, unit, unit)
        for name, call in (
            ("lambda linkage", partial(TiltedFourBar, 2 * unit, unit, 2.5 * unit, 2.5 * unit)),
            ("bearing", partial(Bearing, 17.5 * unit, 10 * unit, 0.03 * unit)),
            ("four-bar of the braider", partial(FourBar, 2 * unit, 6 * unit, 4 * unit, 6 * unit)),
            ("drive", partial(FourBarDrive, 45 * unit, (105 + 45j) * unit, 62 * unit, 45 * unit, 60 * unit)),
            ("platform", partial(ParallelPlatform, points, points, legs, legs)),
            ("assembly modes", partial(assembly_modes, points, points, legs)),
            ("crank-slider", partial(CrankSlider, unit, 4 * unit)),
            ("Scotch yoke", partial(ScotchYoke, unit)),
            ("tribometer", partial(Tribometer, stiffness=unit)),
        ):
            check.refused(f"{name} of {unit:g}", call, "change the unit")


def linkages(check: Checks) -> None:
    """Lambda linkages, four-bars and drives of 1e-57 and 1e57 give the angles of those of 1, and its sentences."""
    from graphsynth.mechanism.four_bar import TiltedFourBar
    from graphsynth.systems.braider import FourBar
    from graphsynth.systems.platform.drive import FourBarDrive

    source = "closed form by hand"
    for exponent in (-190, 190):
        unit, what = 2.0**exponent, f"unit 2^{exponent}"
        own = TiltedFourBar(2 * unit, unit, 2.5 * unit, 2.5 * unit)
        B = own.positions([0.5 * math.pi]).B[0] / unit
        check.values(f"{what}: B of the lambda linkage", B, (2.0, 2.5, 0.0), absolute=1e-15, source=source)
        check.equals(f"{what}: its turn", own.full_turn().kind, "full turn", source="Grashof")
        state = FourBar(0.02 * unit, 0.06 * unit, 0.04 * unit, 0.06 * unit).motion(math.pi / 3)
        ratios = (float(state.k2), float(state.k3))
        check.values(f"{what}: k2, k3 of the four-bar", ratios, ("-1/7", "5/14"), absolute=1e-14, source="section 4.2")
        # distance and crank of 4 and 3, coupler and rocker together 5: they lock at right angles
        locks = FourBarDrive(4 * unit, 0, 3 * unit, 2.5 * unit, 2.5 * unit).turn()
        edges = [edge for interval in locks.admissible or () for edge in interval]
        right = [0.5 * math.pi, 1.5 * math.pi]
        check.values(f"{what}: locks of the drive", edges, right, absolute=1e-15, source="3-4-5 triangle")


def tiny_tilts(check: Checks) -> None:
    """Tilts of 1e-100 to 5e-324 rad: without clearance the bearing jams at every angle, with any it is free."""
    from graphsynth.jamming import Bearing, Verdict, assess_jamming
    from graphsynth.mechanism.four_bar import TiltedFourBar

    source = "section 7.1: arcs of kappa = 0"
    for alpha in (1e-100, 1e-160, 1e-200, -1e-308, 5e-324):
        own = TiltedFourBar(alpha=alpha)
        report = assess_jamming(own, Bearing(clearance=0.0), samples=3, certify=False)
        what = f"alpha = {alpha:g}, no clearance"
        check.values(
            f"{what}: length of the arcs", [arc.length for arc in report.arcs.arcs], [math.pi] * 2, source=source
        )
        check.equals(f"{what}: estimated verdict", report.verdict.name, "JAMMED_ESTIMATED", source=source)
        check.mentions(f"{what}: sentence", report.arcs.reason, "jams at every angle with a tilt")
        free = assess_jamming(own, Bearing(clearance=1e-9), samples=3, certify=False)
        check.equals(f"alpha = {alpha:g}, clearance 1e-9 mm", free.verdict.name, "FREE_ESTIMATED", source="section 7.1")
    proved = assess_jamming(TiltedFourBar(alpha=1e-200), Bearing(clearance=0.0), samples=3).verdict
    allowed = (Verdict.CERTIFIED_JAMMED, Verdict.UNDECIDED)
    check.agrees("alpha = 1e-200, no clearance: proof", proved in allowed, proved.name, "jammed, or not decided")


def huge_angles(check: Checks) -> None:
    """One wheel under 1e20 to 1e150 N m: angles that 64-bit integers do not count in turns; beyond, it says so."""
    from graphsynth.dynamics import Body, DynamicModel, Torque, simulate_dynamics

    for torque in (1e20, 1e21, 1e60, 1e150, 1e200):
        model = DynamicModel(wheel(), {1: Body(1.0, 1.0)}, [Torque(0, 1, torque)], (0.0, 0.0))
        for form in ("one-coordinate", "augmented"):
            motion = simulate_dynamics(model, [0.0, 1.0], keep={(0, 1): 0.0}, form=form)
            what = f"M = {torque:g}, {form}"
            if torque > 1e150:
                check.says(f"{what}: status", motion.status, "failed")
                check.agrees(f"{what}: no angle", bool(np.isnan(motion.poses[-1, 1, 2])))
                continue
            angle = motion.poses[-1, 1, 2]
            check.value(f"{what}: angle", angle, 0.5 * torque, relative=1e-10, source="M t^2 / 2 J")


def many_turns(check: Checks) -> None:
    """Drag link and planet wheel, 50 turns forward and back: no turn is lost or gained, at any sampling."""
    from graphsynth.kinematics.simulation import simulate

    for turns in (50, -50):
        for samples in (24, 7):
            crank = np.linspace(0.0, turns, abs(turns) * samples + 1) * math.tau
            what = f"{turns} turns, {samples} samples a turn"
            wheel = simulate(planet(2.0, 1.0), crank).poses[:, 2, 2]
            gap = np.abs(wheel - wheel[0] - 3.0 * crank).max()
            check.below(f"{what}: planet wheel, rad", gap, 1e-12 * abs(turns), source="Willis: 1 + 2/1 turns a turn")
            drag = simulate(four_bar(3.0, 2.5, 3.5, 1.0), crank, modes={0: 1}).poses[:, 2:, 2]
            gap = np.abs(drag[::samples] - drag[0] - crank[::samples, None]).max()
            check.below(f"{what}: coupler and rocker, rad", gap, 1e-12 * abs(turns), source="one turn a turn")
