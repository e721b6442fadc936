"""Whole turns of the lambda linkage: touching, crank intervals, change points, units (lambda page, 12.17 to 12.22)."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from graphsynth.evidence.stress.checks import Checks

__all__ = ["change_points", "crank_intervals", "long_crank", "reversed_axis", "touching", "units"]

#: Ends of the jam zone of condition A, degrees, section 14.7.
ZONE_A = ("27.0592203251509475645179736478", "152.940779674849052435482026352")


def touching(check: Checks) -> None:
    """Largest tilt is the critical tilt: zone of length zero, "touching", no certificate of either."""
    from graphsynth.jamming import Bearing, assess_jamming
    from graphsynth.mechanism.four_bar import TiltedFourBar

    bearing = Bearing()
    linkage = TiltedFourBar(alpha=math.asin(2.5 * bearing.critical_tilt("A").sine))
    report = assess_jamming(linkage, bearing)
    check.says("certified", report.verdict.name, "UNDECIDED")
    check.says("estimated", assess_jamming(linkage, bearing, certify=False).verdict.name, "TOUCHING_ESTIMATED")
    check.says("jam arcs", len(report.arcs.arcs), 0)
    check.values("touching at", report.arcs.touching, [math.pi / 2, 3 * math.pi / 2], absolute=1e-15)
    for factor, verdict in ((1 - 1e-12, "CERTIFIED_FREE"), (1 + 1e-12, "CERTIFIED_JAMMED")):
        near = assess_jamming(TiltedFourBar(alpha=linkage.alpha * factor), bearing)
        check.equals(f"alpha times 1 {factor - 1:+.0e}", near.verdict.name, verdict, source="kappa = 1 is the border")


def crank_intervals(check: Checks) -> None:
    """Intervals of the crank angle across zero, longer than a turn, reversed; against the zone of section 14.7."""
    from graphsynth.jamming import ToleranceBox, certify_jamming

    proof = certify_jamming(ToleranceBox(alpha="1/30"))
    low, high = (math.radians(float(x)) for x in ZONE_A)
    free, jam = "CERTIFIED_FREE", "CERTIFIED_JAMMED"
    e = 1e-9
    for what, start, stop, right in (
        ("before the zone", high - math.pi + e, low - e, free),
        ("across zero", -0.4, 0.4, free),
        ("across 360 degrees", math.tau - 0.4, math.tau + 0.4, free),
        ("reversed, across 360 degrees", 6.0, 0.4, free),
        ("inside the zone", low + e, high - e, jam),
        ("inside, five turns on", low + e + 10 * math.pi, high - e + 10 * math.pi, jam),
        ("inside, a thousand turns back", 1.0 - 2000 * math.pi, 1.1 - 2000 * math.pi, jam),
        ("a whole turn", 0.0, math.tau, jam),
        ("three turns", -1.0, -1.0 + 6 * math.pi, jam),
        ("an end of the zone", low - e, low - e / 2, free),
    ):
        check.equals(what, proof.over(start, stop).name, right)
    check.refused("NaN", lambda: proof.over(math.nan, 1.0), "start = nan")


def change_points(check: Checks) -> None:
    """Both branches and a flag at a change point; dead points located; ``D = 0`` never divided by."""
    import mpmath as mp

    from graphsynth.mechanism.four_bar import AssemblyStatus, TiltedFourBar

    change = TiltedFourBar(2, 1, 2, 3)
    check.says("change point: kind", change.full_turn().kind, "change point")
    check.values("change point: angles", change.full_turn().change_angles, [0])
    at = change.positions([0.0])
    check.says("status at the point", AssemblyStatus(int(at.status[0])).name, "LIMIT")
    check.values("B at the point", at.B[0], [-1, 0, 0], source="section 2.3")
    check.agrees("no derivative is shown there", np.isnan(at.dB[0]).all())
    with mp.workdps(30):
        root = mp.sqrt(12)
        for sgn in (1, -1):
            right, left = TiltedFourBar(2, 1, 2, 3, sgn).positions([1e-9, -1e-9]).dB[:, 1]
            check.value(f"branch {sgn:+d}: slope to the right", right, 3 + sgn * root, absolute=1e-7)
            check.value(f"branch {sgn:+d}: slope to the left", left, 3 - sgn * root, absolute=1e-7)
        limit = mp.acos(mp.mpf(1) / 4)
        dead = TiltedFourBar(2, 1, 1, 1).full_turn()
        check.says("dead point: kind", dead.kind, "limited")
        check.values("dead points", dead.limit_angles, [limit, 2 * mp.pi - limit], relative=1e-15)
    met = TiltedFourBar(2, 2, 1, 1).positions(0.0)
    check.says("D = 0, l3 = l4", AssemblyStatus(int(met.status)).name, "INDETERMINATE")
    apart = TiltedFourBar(2, 2, 1, 2).positions(0.0)
    check.says("D = 0, l3 unequal to l4", AssemblyStatus(int(apart.status)).name, "ROCKER_TOO_LONG")
    _through_a_change_point(check)


def _through_a_change_point(check: Checks) -> None:
    """Crank driven across the change point: no branch is chosen silently."""
    from graphsynth.evidence.stress.cases.linkages import four_bar
    from graphsynth.kinematics.certify import certify_four_bar
    from graphsynth.kinematics.simulation import simulate

    check.says("exact class", certify_four_bar("2", "1", "2", "3").kind, "change point")
    motion = simulate(four_bar(1.0, 2.0, 3.0, 2.0), np.linspace(-0.5, 0.5, 11), modes={0: 1})
    check.says("simulate across f = 0 is completed", motion.completed, False)
    check.value("it stops at f", motion.stopped_at, 0, absolute=1e-6, source="closed form")
    check.mentions("its reason", motion.reason, "branch")
    check.agrees("nothing is shown beyond", np.isnan(motion.poses[6:]).any(axis=(1, 2)).all())


def long_crank(check: Checks) -> None:
    """``l2 >= l1``: no jump of a quadrant, and the closed form at every angle."""
    from graphsynth.mechanism.four_bar import TiltedFourBar

    f = np.linspace(0.0, math.tau, 721)
    for lengths in ((1.0, 3.0, 3.0, 2.0), (2.0, 2.6, 3.0, 3.5)):
        linkage = TiltedFourBar(*lengths)
        found = linkage.positions(f[1:-1])
        A, B = found.A[:, :2], found.B[:, :2]
        check.agrees(f"{lengths}: assembled", found.assembled.all())
        rod = np.abs(np.hypot(*(A - B).T) - lengths[2]).max()
        rocker = np.abs(np.hypot(*(B - [lengths[0], 0.0]).T) - lengths[3]).max()
        check.below(f"{lengths}: rod", rod, 4e-15, source="rigid links")
        check.below(f"{lengths}: rocker", rocker, 4e-15, source="rigid links")
        # one side of the line C to A throughout: no branch is left
        d = A - [lengths[0], 0.0]
        side = d[:, 0] * (B[:, 1]) - d[:, 1] * (B[:, 0] - lengths[0])
        check.agrees(f"{lengths}: one branch", (side < 0).all() or (side > 0).all())


def reversed_axis(check: Checks) -> None:
    """Zones stay the same for ``n3 = 0``; the sign of the tilt changes."""
    from graphsynth.jamming import Bearing, assess_jamming, jam_arcs
    from graphsynth.mechanism.four_bar import TiltedFourBar

    f = np.radians([13.0, 64.2, 193.0])
    tilt = ["0.002998796481990437225089870257", "0.01200231556422492917626611296", "-0.002998796481990437225089870257"]
    gap = ["-0.01508472683198013806918781056", "0.02874966581393647831345638987", "-0.01508472683198013806918781056"]
    reversed_tilt = [text.removeprefix("-") if text.startswith("-") else f"-{text}" for text in tilt]
    for name, other in (
        ("axis reversed", TiltedFourBar(alpha=1 / 30, axis=(-1, 0, 0))),
        ("alpha negative", TiltedFourBar(alpha=-1 / 30)),
    ):
        table = assess_jamming(other, samples=f).table
        # an angle in degrees is rounded to a double: a unit in the last place of f
        check.values(f"{name}: theta", table.theta, reversed_tilt, relative=2e-14, source="section 14.2")
        check.values(f"{name}: gap", table.gap_a, gap, relative=1e-13, source="section 14.2")
        starts = [math.degrees(arc.start) for arc in jam_arcs(other, Bearing()).arcs]
        check.value(f"{name}: zone", starts[0], ZONE_A[0], relative=1e-14, source="section 14.7")
        check.value(f"{name}: second zone", starts[1] - 180.0, ZONE_A[0], relative=1e-14, source="section 14.7")


def units(check: Checks) -> None:
    """Lengths of 1e-9 and 1e9 give the same verdicts and zones."""
    from fractions import Fraction

    from graphsynth.jamming import Bearing, ToleranceBox, certify_jamming, jam_arcs
    from graphsynth.jamming.intersection import circle_ellipse, exact_hull
    from graphsynth.mechanism.four_bar import TiltedFourBar

    for power in (-9, 9):
        unit = 10.0**power
        linkage = TiltedFourBar(2 * unit, unit, 2.5 * unit, 2.5 * unit, alpha=1 / 30)
        arcs = jam_arcs(linkage, Bearing(17.5 * unit, 10 * unit, 0.03 * unit)).arcs
        check.value(f"1e{power}: start of the zone", math.degrees(arcs[0].start), ZONE_A[0], relative=1e-13)
        check.value(f"1e{power}: end of the zone", math.degrees(arcs[0].stop), ZONE_A[1], relative=1e-13)
        exact = Fraction(10) ** power
        lengths = [Fraction(x) * exact for x in ("2", "1", "5/2", "5/2")]
        own = [Fraction(x) * exact for x in ("17.5", "10", "0.03")]
        for alpha, verdict in (("0.0151614", "CERTIFIED_FREE"), ("0.0151615", "CERTIFIED_JAMMED")):
            box = ToleranceBox(*lengths, alpha, Rb=own[0], Hb=own[1], clearance=own[2])
            found = certify_jamming(box).verdict.name
            check.equals(f"1e{power}: alpha = {alpha}", found, verdict, source="alpha_max of section 14.7")
        values = [Fraction(v) * exact for v in ("17.5", "17.53", "17.46")]
        status = exact_hull(circle_ellipse(*values)).status.name
        check.equals(f"1e{power}: crossing", status, "UNIQUE")
