"""Bearings at the end of their range: no clearance, press fit, disc, steep tilt (lambda page, 12.6 to 12.10)."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from graphsynth.evidence.stress.checks import Checks

__all__ = ["disc", "never_critical", "no_clearance", "press_fit", "steep_lid"]


def no_clearance(check: Checks) -> None:
    """Critical tilt 0, jam wherever there is a tilt, touching elsewhere; "free" cannot be proved."""
    from graphsynth.jamming import Bearing, assess_jamming
    from graphsynth.jamming.bearing.areas import surrogate_areas
    from graphsynth.mechanism.four_bar import TiltedFourBar

    bearing = Bearing(clearance=0.0)
    for condition in ("A", "B"):
        check.value(f"critical tilt {condition}", bearing.critical_tilt(condition).angle, 0)
    S = 0.4 * math.sin(1 / 30) * np.array([0.0, math.sin(math.radians(1)), 1.0])
    C = np.sqrt(1 - S * S)
    gaps = {
        "A": ["0", "0.001162804686889637822783608439", "0.06509927307354575852847158852"],
        "B": ["0", "0.001163751938405329369742144091", "0.06820937027346870701583215753"],
    }
    for condition, right in gaps.items():
        check.values(f"gap {condition}", bearing.gap(S, C, condition), right, relative=1e-14, source="section 14.4")
    areas = ["0", "0.06398060445516362539956021991", "3.750005989749518033035104254"]
    found = surrogate_areas(bearing, S, C).circle_only
    check.values("interference of E4", found, areas, relative=1e-14, source="section 14.4")
    moving = assess_jamming(TiltedFourBar(alpha=1 / 30), bearing)
    check.equals("verdict with a tilt", moving.verdict.name, "CERTIFIED_JAMMED")
    check.values("touching where A_z = 0", moving.arcs.touching, [0, math.pi], absolute=1e-15)
    still = assess_jamming(TiltedFourBar(), bearing)
    check.says("verdict without a tilt", still.verdict.name, "UNDECIDED")
    check.mentions("its reason", still.certificate.reason if still.certificate else "", "touch")


def press_fit(check: Checks) -> None:
    """Interference at rest already: it cannot be put together, which is no jam zone of the motion."""
    from graphsynth.jamming import Bearing, assess_jamming, certify_jamming
    from graphsynth.jamming.bearing.areas import lid_area
    from graphsynth.jamming.bearing.parameters import ToleranceBox
    from graphsynth.mechanism.four_bar import TiltedFourBar

    press = Bearing(17.5, 10, -0.01)
    check.value("gap at t = 0", float(press.gap(0.0, 1.0, "A")), -press.clearance, absolute=4e-18, source="4.2")
    report = assess_jamming(TiltedFourBar(alpha=1 / 30), press)
    check.says("verdict", report.verdict.name, "CANNOT_ASSEMBLE")
    check.agrees("gap is positive at every angle", (report.table.gap > 0).all())
    check.mentions("critical tilt", press.critical_tilt("A").reason, "interference")
    proof = certify_jamming(ToleranceBox(alpha="1/30", clearance="-0.01"))
    check.says("certificate", proof.verdict.name, "CANNOT_ASSEMBLE")
    check.refused("areas", lambda: lid_area(press, 0.01, 1.0), "interference fit")


def never_critical(check: Checks) -> None:
    """``h^2 < c (2R + c)``: no critical tilt in condition A, one in B; equality touches and never overlaps."""
    import mpmath as mp

    from graphsynth.jamming import Bearing, assess_jamming
    from graphsynth.mechanism.four_bar import TiltedFourBar

    low = Bearing(17.5, 1.0, 0.03)
    check.says("critical tilt A", low.critical_tilt("A").angle, None)
    check.mentions("why", low.critical_tilt("A").reason, "h^2 < c")
    with mp.workdps(40):
        R, c, h = mp.mpf(low.Rb), mp.mpf(low.clearance), mp.mpf(low.h)
        right = mp.acos(R / mp.hypot(R + c, h)) - mp.atan(h / (R + c))
    check.value("critical tilt B", low.critical_tilt("B").angle, right, relative=2e-15, source="closed form of 4.7")
    verdict = assess_jamming(TiltedFourBar(alpha=1.0), low).verdict.name
    check.equals("whole turn, alpha = 1", verdict, "CERTIFIED_FREE")
    equal = Bearing(4.0, 6.0, 1.0)  # h^2 = 9 = c (2R + c)
    touch = equal.critical_tilt("A")
    check.mentions("equality", touch.reason, "never overlap")
    with mp.workdps(40):
        check.value("tilt of contact", touch.angle, 2 * mp.atan(mp.mpf(1) / 3), relative=1e-15, source="closed form")
    check.value("gap at the steepest tilt", float(equal.gap(1.0, 0.0, "A")), 0)


def disc(check: Checks) -> None:
    """Plate without height: A never jams, B at ``arccos(R/Rh)``."""
    import mpmath as mp

    from graphsynth.jamming import Bearing, assess_jamming
    from graphsynth.mechanism.four_bar import TiltedFourBar

    thin = Bearing(17.5, 0.0, 0.03)
    check.says("critical tilt A", thin.critical_tilt("A").angle, None)
    report = assess_jamming(TiltedFourBar(alpha=1 / 30), thin)
    check.equals("verdict A", report.verdict.name, "CERTIFIED_FREE")
    check.mentions("reason", report.arcs.reason, "disc")
    with mp.workdps(40):
        right = mp.acos(mp.mpf(17.5) / (mp.mpf(17.5) + mp.mpf(0.03)))
    check.value("critical tilt B", thin.critical_tilt("B").angle, right, relative=1e-14, source="arccos(R/Rh)")


def steep_lid(check: Checks) -> None:
    """Ellipse E4 vanishes: it is a jam, E4 is refused, the areas stay right up to the whole disc."""
    import mpmath as mp

    from graphsynth.jamming import Bearing
    from graphsynth.jamming.bearing.areas import lid_area
    from graphsynth.jamming.bearing.areas_enclosed import enclose_lid_area
    from graphsynth.jamming.intersection import surrogate_problem

    bearing = Bearing()
    check.agrees("gap B at b <= 0 is a jam", float(bearing.gap(1.0, 0.0, "B")) >= 17.5)
    check.refused("E4", lambda: surrogate_problem(bearing, "0.999"), "lid_area")
    with mp.workdps(30):
        disc_area = mp.pi * mp.mpf("17.5") ** 2
    upright = float(lid_area(bearing, np.array([1.0]), np.array([0.0]))[0])
    check.value("whole disc at 90 degrees", upright, disc_area, relative=1e-15, source="pi R^2")
    # d - p >= R: the lid lies beside the circle
    tall = Bearing(1.0, 6.0, 0.02)
    t = 1.2
    check.agrees("d - p >= R", tall.h * math.sin(t) - tall.Rh * math.cos(t) >= 1.0, source="5.4")
    beside = float(lid_area(tall, np.array([math.sin(t)]), np.array([math.cos(t)]))[0])
    with mp.workdps(30):
        check.value("lid beside the circle", beside, +mp.pi, relative=1e-15, source="pi R^2")
    enclosed = enclose_lid_area("1", "0.02", "3", "[0.93, 0.94]")
    inside = float(enclosed.lo) <= math.pi <= float(enclosed.hi)
    check.agrees("certified area holds pi R^2", inside, str(enclosed))
