"""Tilted axis: no tilt, tiny, steep, out of reach; bad input; printed extremes (lambda page, 12.1 to 12.5, 14.4)."""

from __future__ import annotations

import math
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from graphsynth.evidence.stress.checks import Checks

__all__ = ["bad_input", "no_tilt", "not_assembled", "printed_extremes", "steep_tilt", "tiny_tilt"]

#: pi (Rh^2 - R^2) of the standard bearing, section 14.2.
ANNULUS = "3.30149971965751371430039193148842958"


def no_tilt(check: Checks) -> None:
    """Without a tilt: theta = 0 exactly, the gap is the clearance, nothing crosses, nothing jams."""
    from graphsynth.intervals import Status
    from graphsynth.jamming import Bearing, assess_jamming, jam_arcs
    from graphsynth.jamming.intersection import exact_hull, surrogate_problem
    from graphsynth.mechanism.four_bar import TiltedFourBar

    f = np.linspace(0.0, 6.0, 7)
    for name, linkage in (
        ("alpha = 0", TiltedFourBar()),
        ("axis along z", TiltedFourBar(alpha=0.5, axis=(0, 0, 1))),
    ):
        report = assess_jamming(linkage, Bearing(), samples=f)
        check.value(f"{name}: largest |theta|", np.abs(report.table.theta).max(), 0)
        for condition in "ab":
            gaps = getattr(report.table, f"gap_{condition}")
            check.value(f"{name}: gap {condition.upper()} + c", np.abs(gaps + 0.03).max(), 0, absolute=4e-18)
        check.values(f"{name}: free area", report.table.surrogate_gap_area, [ANNULUS] * 7, relative=4e-16)
        check.value(f"{name}: interference", np.abs(report.table.lid_area).max(), 0)
        check.equals(f"{name}: verdict", report.verdict.name, "CERTIFIED_FREE")
        check.equals(f"{name}: jam arcs", len(jam_arcs(linkage, Bearing()).arcs), 0)
    check.equals("E4, a = b unequal to R1", exact_hull(surrogate_problem(Bearing(), "0")).status, Status.EMPTY)


def tiny_tilt(check: Checks) -> None:
    """Tilt of 1e-8: the printed digits, and no division by ``a^2 - b^2``."""
    from graphsynth.intervals import Status
    from graphsynth.jamming import Bearing, assess_jamming
    from graphsynth.jamming.intersection import exact_hull, surrogate_problem
    from graphsynth.mechanism.four_bar import TiltedFourBar

    table = assess_jamming(TiltedFourBar(alpha=1e-8), samples=[math.pi / 2, 0.0]).table
    check.value("theta at 90 degrees", table.theta[0], "3.999999999999999944e-9", relative=1e-15)
    check.value("gap A", table.gap_a[0], "-0.02999998000000014000000033333", relative=1e-15)
    check.value("gap B", table.gap_b[0], "-0.02999997999999985976000033333", relative=1e-15)
    check.value("free area", table.surrogate_gap_area[0], "3.301498618215121642404901832", relative=1e-14)
    check.value("interference", table.lid_area[0], 0)
    for sine in ("4e-9", "4e-300"):
        found = exact_hull(surrogate_problem(Bearing(), sine, eps="1e-9"))
        check.equals(f"crossing at sin t = {sine}", found.status, Status.EMPTY)
        check.equals("its reason", [r.name for r in found.reasons], ["CIRCLE_INSIDE"])


def steep_tilt(check: Checks) -> None:
    """Second branch of the farthest point, existence first, areas while ``b > 0``, the rim by quadrature, said so."""
    import mpmath as mp

    from graphsynth.jamming import Bearing
    from graphsynth.jamming.bearing.areas import rim_area, surrogate_areas
    from graphsynth.mechanism.four_bar import AssemblyStatus, TiltedFourBar

    bearing, t = Bearing(1.0, 1.6, 0.1), 1.2
    with mp.workdps(40):
        far = mp.hypot(1, mp.mpf("0.8")) - mp.mpf(bearing.Rh)
    gap = float(bearing.gap(math.sin(t), math.cos(t), "A"))
    check.value("gap A on the second branch", gap, far, absolute=4e-16, source="closed form of 4.2")
    check.value("gap A at pi/2", float(bearing.gap(1.0, 0.0, "A")), far, absolute=4e-16, source="closed form of 4.2")
    area, by_quadrature = rim_area(bearing, math.sin(t), math.cos(t))
    check.says("rim by quadrature, and said", bool(by_quadrature), True)
    # an independent count: strips of the rim's ellipse outside of the circle
    y = (np.arange(200_000) + 0.5) / 200_000
    wide, shift = math.cos(t) * np.sqrt(1.0 - y * y), 0.8 * math.sin(t)
    inner = np.sqrt(np.maximum(1.1**2 - y * y, 0.0))
    outside = 2 * wide - np.maximum(0.0, np.minimum(shift + wide, inner) - np.maximum(shift - wide, -inner))
    check.value("area of the rim", float(area), 2 * outside.mean(), relative=1e-6, source="strips of a quadrature")
    open_lid = surrogate_areas(Bearing(), math.sin(1.0), math.cos(1.0))
    check.agrees("E4 is still defined at 1 rad", np.isfinite(open_lid.circle_only), float(open_lid.circle_only))
    upright = TiltedFourBar(alpha=math.pi / 2).positions(math.pi / 2)
    # A = (0, 0, 1): D = l1 = 2, plan length s3 = sqrt(5.25), xB = (4 + 6.25 - 5.25)/4 = 1.25
    check.value("alpha = pi/2: B_x", upright.B[0], "0.75", absolute=1e-15, source="closed form of 3.3")
    with mp.workdps(40):
        tilt = mp.asin(mp.mpf("0.4"))
    check.value("alpha = pi/2: theta", abs(float(upright.theta)), tilt, relative=1e-15, source="closed form of 3.3")
    beyond = TiltedFourBar(2, 3, 2, 4, alpha=math.pi / 2).positions(math.pi / 2)
    check.says("pin above the rod", AssemblyStatus(int(beyond.status)).name, "TILT_EXCEEDS_ROD")


def not_assembled(check: Checks) -> None:
    """Each violated inequality has its own status and sentence; NaN never without one."""
    from graphsynth.jamming import Bearing, assess_jamming
    from graphsynth.mechanism.four_bar import AssemblyStatus, TiltedFourBar

    for name, linkage, f, status in (
        ("D above l3 + l4", TiltedFourBar(2, 1, 1, 1), math.pi, "TOO_FAR"),
        ("rocker too long", TiltedFourBar(2, 1, 1, 5), 0.0, "ROCKER_TOO_LONG"),
        ("coupler too long", TiltedFourBar(2, 1, 5, 1), 0.0, "COUPLER_TOO_LONG"),
        ("|A_z| above l3", TiltedFourBar(2, 3, 2, 4, alpha=math.pi / 2), math.pi / 2, "TILT_EXCEEDS_ROD"),
    ):
        found = linkage.positions(f)
        check.says(name, AssemblyStatus(int(found.status)).name, status)
        check.mentions(f"{name}: sentence", " ".join(found.reasons()), AssemblyStatus[status].message)
        check.agrees(f"{name}: no number is shown", np.isnan(found.B).all() and np.isnan(found.theta))
    turn = TiltedFourBar(2, 1, 1, 1).positions(np.linspace(-4, 4, 801))
    agree = np.array_equal(np.isnan(turn.B).any(axis=-1), ~turn.assembled)
    check.agrees("NaN exactly where the status says so", agree)
    # D^2 = 5 - 4 cos f exceeds (l3 + l4)^2 = 4 from arccos(1/4)
    right = np.cos(np.linspace(-4, 4, 801)) > 0.25
    check.agrees("assembled exactly where cos f > 1/4", np.array_equal(right, turn.assembled), source="closed form")
    out = assess_jamming(TiltedFourBar(2, 3, 1, 2.5, alpha=1.2), Bearing())
    check.says("jamming of what is never assembled", out.verdict.name, "CANNOT_ASSEMBLE")


def bad_input(check: Checks) -> None:
    """One sentence that names the parameter."""
    from graphsynth.jamming import Bearing, ToleranceBox
    from graphsynth.mechanism.four_bar import TiltedFourBar

    arguments: dict[str, Any]
    for arguments in (
        {"axis": (0, 0, 0)}, {"axis": (math.nan, 0, 1)}, {"alpha": math.nan}, {"alpha": math.inf}, {"l1": 0},
        {"l2": -1}, {"l3": math.nan}, {"l4": math.inf},
    ):  # fmt: skip
        name, value = next(iter(arguments.items()))
        check.refused(f"{name} = {value}", partial(TiltedFourBar, **arguments), name)
    for arguments in ({"Rb": 0}, {"Rb": math.nan}, {"Hb": -1}, {"clearance": math.nan}, {"clearance": math.inf}):
        name, value = next(iter(arguments.items()))
        check.refused(f"{name} = {value}", partial(Bearing, **arguments), name)
    check.refused("box with Rb = NaN", lambda: ToleranceBox(alpha="1/30", Rb=math.nan), "Rb")
    check.refused("f = NaN", lambda: TiltedFourBar().positions([math.nan]), "f holds nan")


def printed_extremes(check: Checks) -> None:
    """Change-point linkage, pins in holes and crescents with all printed digits."""
    from graphsynth.jamming.bearing.areas import ellipse_circle, ellipse_circle_stable
    from graphsynth.jamming.bearing.bearing import Bearing
    from graphsynth.mechanism.four_bar import TiltedFourBar

    for alpha, degrees, x, y in (
        (0.0, 1e-6, "-0.9999999999999978786133348643", "1.128198563676370905924991809e-7"),
        (0.0, 1e-3, "-0.9999999978786133363105300899", "0.0001128198563092354682133015520"),
        (0.0, 1.0, "-0.9978800586591051030698926315", "0.1127614911841828487933249357"),
        (0.0, 90.0, "0.8944271909999158785636694675", "2.788854381999831757127338935"),
        (1 / 30, 30.0, "0.1635393708613023042000500113", "2.372216760252633120165984711"),
        (1 / 30, 90.0, "0.8934610987931061261585619328", "2.788471204820992939813570057"),
    ):
        B = TiltedFourBar(2, 1, 2, 3, alpha=alpha).positions([math.radians(degrees)]).B[0]
        check.value(f"B_x at {degrees:g} degrees, alpha = {alpha:.3g}", B[0], x, absolute=1e-15)
        check.value(f"B_y at {degrees:g} degrees, alpha = {alpha:.3g}", B[1], y, relative=2e-15)
    for R, hp, hh, t, D in (
        (1, 2, 2, 0.1, "1.194670998571682070709190"),
        (1, 2, 1, 0.1, "1.105355590485905973523194"),
        (1, 2, 1, 1.2, "2.236067977499789696409174"),
        (1, 0.5, 3, 0.2, "1.079401243238772238853903"),
    ):
        pin = Bearing(R, 2 * hp, 0.05, hole_length=2 * hh)
        reach = float(pin.gap(math.sin(t), math.cos(t), "general")) + pin.Rh
        check.value(f"pin of half length {hp} in a hole of {hh}, t = {t}", reach, D, relative=1e-15)
    for R1, pa, qb, ellipse, circle in (
        (5.0, 1.0, 1.0, "8.345778368199523218975473074", "11.48737102178931645743811646"),
        (1.0, 9.0, 0.9, "2.742918043625145128948858904", "2.742918043625145128948858904"),
        (1.0, 1e-9, 1e-9, "1.999999998429203672788436714e-9", "2.000000001570796326378229953e-9"),
        (1.0, 1e-12, 0.5, "2.177324215805273540088654111e-18", "1.570796326793325825081851011"),
    ):
        found = ellipse_circle_stable(R1, pa, qb)
        check.value(f"ellipse outside of the circle, a - R1 = {pa:g}", found.ellipse_only, ellipse, relative=3e-15)
        check.value(f"circle outside of the ellipse, R1 - b = {qb:g}", found.circle_only, circle, relative=3e-15)
    thick = ellipse_circle(17.53, 17.5 / math.cos(0.06), 17.5)
    check.value(
        "thin crescent by the direct form", thick.ellipse_only, "0.01607824197607069187615058061", relative=1e-11
    )
    check.value("thick crescent by the direct form", thick.circle_only, "1.583173498318460594385361309", relative=1e-12)
