"""Beyond the specification: sizes at the ends of double precision, ratios, subnormal numbers, traps of its sections."""

from __future__ import annotations

import math
from fractions import Fraction
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from graphsynth.evidence.stress.checks import Checks

__all__ = ["crossings", "interval_ends", "jamming", "planar", "ratios", "rest_trap", "subnormal_platform"]


def planar(check: Checks) -> None:
    """Four-bars from 1e-60 to 1e60 give the angles of 50 digits; larger and smaller ones are refused."""
    from graphsynth.evidence.stress.cases.linkages import exact_four_bar, four_bar
    from graphsynth.kinematics.simulation import simulate

    u = np.linspace(0.1, 6.1, 13)
    right = [exact_four_bar(1.0, 2.5, 2.5, 2.0, float(t), 1)[1] for t in u]
    for power in (-59, -30, 30, 59):
        unit = 2.0 ** round(power * math.log2(10.0))  # a power of two: the ratios of the lengths stay what they are
        motion = simulate(four_bar(unit, 2.5 * unit, 2.5 * unit, 2 * unit), u, modes={0: 1})
        check.equals(f"unit 1e{power}: completed", motion.completed, True)
        check.values(f"unit 1e{power}: rocker", motion.poses[:, 3, 2], right, absolute=2e-15, source="50 digits")
    for power in (-300, -150, 150, 300):
        unit = 10.0**power
        lengths = (unit, 2.5 * unit, 2.5 * unit, 2 * unit)
        check.refused(f"unit 1e{power}", partial(simulate, four_bar(*lengths), u, modes={0: 1}), "change the unit")


def ratios(check: Checks) -> None:
    """Crank of 1 beside a coupler and a frame of up to 1e16: what is lost is told by the motion's own estimate."""
    from graphsynth.evidence.stress.cases.linkages import exact_four_bar, four_bar
    from graphsynth.kinematics.simulation import simulate

    u = np.linspace(0.3, 6.0, 15)
    for power in (2, 4, 8, 12, 16):
        size = 10.0**power
        motion = simulate(four_bar(1.0, size, 2.0, size), u, modes={0: 1})
        errors = []
        for k, t in enumerate(u):
            right = exact_four_bar(1.0, size, 2.0, size, float(t), 1)
            gaps = [motion.poses[k, link, 2] - float(angle) for link, angle in zip((2, 3), right)]
            errors.append(max(abs(math.remainder(gap, math.tau)) for gap in gaps))
        worst = max(found / told for found, told in zip(errors, motion.errors))
        what = f"frame and coupler of 1e{power}"
        check.agrees(f"{what}: completed", motion.completed)
        check.below(f"{what}: error over the motion's own estimate", worst, 1.0, source="60 digits")
        if power < 16:
            # the joint B has the rounding of the long links: 1e-16 times their length, over the rocker's length of 2
            check.below(f"{what}: angles, rad", max(errors), 4e-16 * size, source="60 digits")
        else:
            check.agrees(f"{what}: it tells that nothing is left", motion.errors.min() > 1.0, motion.errors.min())


def subnormal_platform(check: Checks) -> None:
    """Platforms of 1e-59 to 1e59 have the modes of those of 1, others are refused; legs may be subnormal."""
    from graphsynth.kinematics.triad.leg import LegStatus, solve_leg
    from graphsynth.systems.platform.parallel_platform import ParallelPlatform

    g1 = ParallelPlatform.g1()
    parts: list[Any]
    right = ["-0.1676478906740002300845393288613099", "0.4780458846922180136167385177734372"]
    for exponent in (-1000, -300, 250, 490):
        parts = [np.array(part) * 2.0**exponent for part in (g1.D, g1.b, g1.l1, g1.l2)]
        check.refused(f"unit 2^{exponent}", partial(ParallelPlatform, *parts), "change the unit")
    for exponent in (-196, -100, 100, 195):
        unit = 2.0**exponent
        parts = [np.array(part) * unit for part in (g1.D, g1.b, g1.l1, g1.l2)]
        own = ParallelPlatform(*parts)
        modes = own.direct((0.0, 0.0, 0.0))
        what = f"unit 2^{exponent}"
        check.values(f"{what}: alpha", modes.poses[:, 2], right, absolute=5e-15, source="platform page, section 14.3")
        for k, pose in enumerate(modes.poses):
            theta = own.inverse(pose).theta
            gap = np.abs(np.angle(np.exp(1j * theta))).min(axis=0).max()
            check.below(f"{what}: mode {k + 1} and back, rad", float(gap), 5e-15, source="the angles it came from")
    tiny = 5e-324
    # l1 = 3, l2 = 4, rho = 5 units of the smallest subnormal number: a right angle at the vertex
    leg = solve_leg(5 * tiny, 0.0, 3 * tiny, 4 * tiny)
    check.equals("3-4-5 in the smallest numbers: status", LegStatus(int(leg.status)).name, "REACHABLE")
    check.value("its angle", float(leg.angle(1)), math.acos(0.6), absolute=4.5e-16, source="3-4-5 triangle")
    check.says("(1, 1, 2) of them", LegStatus(int(solve_leg(2 * tiny, 0.0, tiny, tiny).status)).name, "BOUNDARY")
    check.says("(1, 1, 3) of them", LegStatus(int(solve_leg(3 * tiny, 0.0, tiny, tiny).status)).name, "TOO_FAR")


def jamming(check: Checks) -> None:
    """Bearings of 1e-57 to 1e57 have the same zones; boxes of 1e-300 and 1e300 the same certificates."""
    from graphsynth.evidence.stress.cases.turns import ZONE_A
    from graphsynth.jamming import Bearing, ToleranceBox, certify_jamming, jam_arcs
    from graphsynth.mechanism.four_bar import TiltedFourBar

    for exponent in (-190, 190):
        unit = 2.0**exponent
        linkage = TiltedFourBar(2 * unit, unit, 2.5 * unit, 2.5 * unit, alpha=1 / 30)
        arcs = jam_arcs(linkage, Bearing(17.5 * unit, 10 * unit, 0.03 * unit)).arcs
        source = "lambda page, section 14.7"
        check.value(f"unit 2^{exponent}: zone", math.degrees(arcs[0].start), ZONE_A[0], relative=1e-13, source=source)
    for power in (-300, 300):
        unit_ = Fraction(10) ** power
        lengths = [Fraction(x) * unit_ for x in ("2", "1", "5/2", "5/2")]
        own = [Fraction(x) * unit_ for x in ("17.5", "10", "0.03")]
        for alpha, verdict in (("0.0151614", "CERTIFIED_FREE"), ("0.0151615", "CERTIFIED_JAMMED")):
            found = certify_jamming(ToleranceBox(*lengths, alpha, Rb=own[0], Hb=own[1], clearance=own[2]))
            what = f"box of 1e{power}, alpha = {alpha}"
            check.equals(what, found.verdict.name, verdict, source="lambda page, alpha_max of section 14.7")


def crossings(check: Checks) -> None:
    """Circle and ellipse with sizes of 1e-300 to 1e300 and differences of 1e-60: decided by exact fractions."""
    from graphsynth.jamming.intersection import circle_ellipse, exact_hull

    small = Fraction(1, 10**60)
    for power in (-300, 0, 300):
        unit = Fraction(10) ** power
        for what, circle, status in (
            ("inside both", 1 - small, "EMPTY"), ("through", 1 + small, "UNIQUE"), ("outside", 2 + small, "EMPTY"),
            ("touches", Fraction(1), "UNDECIDED"),
        ):  # fmt: skip
            # semi-axes 2 and 1: a circle crosses the ellipse exactly if its radius lies between them
            found = exact_hull(circle_ellipse(circle * unit, 2 * unit, unit)).status.name
            tell = check.says if status == "UNDECIDED" else check.equals
            tell(f"unit 1e{power}: circle {what}", found, status, source="radius between the semi-axes")


def interval_ends(check: Checks) -> None:
    """Interval arithmetic at its ends, against exact fractions: overflow, subnormal numbers, division by zero."""
    from graphsynth.intervals import Interval

    tiny, huge = 5e-324, 1.7976931348623157e308
    points = (0.0, tiny, -tiny, 2.0**-1022, 1e-200, 0.1, 1.0, 3.0, 1e200, huge, -huge)
    lost = loose = 0
    for x in points:
        for y in points:
            a, b = Interval(x, x), Interval(y, y)
            exact = {"+": Fraction(x) + Fraction(y), "-": Fraction(x) - Fraction(y), "*": Fraction(x) * Fraction(y)}
            found = {"+": a + b, "-": a - b, "*": a * b}
            if y:
                exact["/"], found["/"] = Fraction(x) / Fraction(y), a / b
            for sign, value in exact.items():
                low, high = float(found[sign].lo), float(found[sign].hi)
                lost += not (_below(low, value) and _above(high, value))
                loose += low > high or math.isnan(low + high) or low == math.inf or high == -math.inf
    check.equals("results of + - * / that lose the exact value", lost, 0, source="exact fractions")
    check.equals("bounds that are reversed, NaN, or infinite on the wrong side", loose, 0, source="section 11.1, 2")
    line = Interval(-math.inf, math.inf)
    for what, result in (
        ("0 times the line", Interval(0.0, 0.0) * line), ("the line less itself", line - line),
        ("1 over [-1, 1]", Interval(1.0, 1.0) / Interval(-1.0, 1.0)),
    ):  # fmt: skip
        low, high = float(result.lo), float(result.hi)
        bounds = (0.0, 0.0) if what.startswith("0") else (-math.inf, math.inf)
        check.equals(what, (low, high), bounds, source="section 11.1, 2 and 4")
    half = Interval(1.0, 1.0) / Interval(0.0, 2.0)
    check.equals(
        "1 over [0, 2]", (float(half.lo) <= 0.5, float(half.lo) > 0.49, float(half.hi)), (True, True, math.inf)
    )
    check.says("1 over [0, 0]: empty", bool((Interval(1.0, 1.0) / Interval(0.0, 0.0)).is_empty), True)
    root = Interval(-1.0, 4.0).sqrt()
    clipped = (float(root.lo), float(root.hi), bool(root.guaranteed))
    check.says("root of [-1, 4]: clipped, and no longer guaranteed", clipped, (0.0, 2.0, False))


def _below(low: float, value: Fraction) -> bool:
    return low == -math.inf or (math.isfinite(low) and Fraction(low) <= value)


def _above(high: float, value: Fraction) -> bool:
    return high == math.inf or (math.isfinite(high) and Fraction(high) >= value)


def rest_trap(check: Checks) -> None:
    """Sweep through rest with a crank of 1e-41: the start that makes a difference quotient vanish is no trap here."""
    from graphsynth.systems.antenna import PointingMechanism

    art = PointingMechanism()
    t = np.radians([40.0])
    for start in (1e-41, 1e-300, 5e-324):
        found = art.sweep(np.concatenate([[start], t])).poses
        for name, right in (("a", "23.7120800164849915647"), ("b", "22.44785725383752382049")):
            given = math.degrees(float(getattr(found, name)[-1]))
            check.value(f"sweep from {start:g}: {name}, degrees", given, right, absolute=1e-13, source="section 2.9")
        solved = art.solve_loops(t, t, start=np.full((1, 12), start))
        check.equals(f"twelve equations from {start:g}: solved", bool(solved.genuine[0]), True)
        for k, right in ((5, "23.7120800164849915647"), (11, "22.44785725383752382049")):
            given = math.degrees(float(solved.x[0, k]))
            check.value(f"twelve equations from {start:g} [{k}]", given, right, absolute=1e-12, source="section 2.9")
