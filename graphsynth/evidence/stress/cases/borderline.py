"""Beyond the specification: verdicts on the border, decided where they can be and left open where they cannot."""

from __future__ import annotations

import math
from fractions import Fraction
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from graphsynth.evidence.stress.checks import Checks

__all__ = ["gap_zero", "grashof", "near_fold"]


def gap_zero(check: Checks) -> None:
    """Bearing 24, 7, 64/65: the parts touch at the sine 16/65 exactly; tilts beside it by 1e-3 to 1e-30.

    With ``tan(t/2) = 1/8`` the sine is 16/65 and the cosine 63/65, so ``R cos t + h sin t = 1624/65 = R + 64/65``.
    """
    import mpmath as mp

    from graphsynth.jamming import Bearing, ToleranceBox, assess_jamming, certify_jamming
    from graphsynth.mechanism.four_bar import TiltedFourBar

    touching = Fraction(24) * Fraction(63, 65) + 7 * Fraction(16, 65) - (24 + Fraction(64, 65))
    check.value("the gap by exact fractions", touching, 0)
    bearing = Bearing(24.0, 14.0, 64 / 65)
    check.value("critical sine", bearing.critical_tilt("A").sine, Fraction(16, 65), relative=3e-16)
    check.value("gap there", float(bearing.gap(16 / 65, 63 / 65, "A")), 0, absolute=4e-15)
    undecided = 0
    for power in (3, 8, 12, 14, 16, 20, 30):
        for sign, right in ((-1, "CERTIFIED_FREE"), (1, "CERTIFIED_JAMMED")):
            with mp.workdps(60):
                # l3 = 5/2 and l2 = 1: the largest tilt of the rod has the sine of alpha over 5/2
                alpha = mp.asin(mp.mpf(5) / 2 * 16 / 65) * (1 + sign * mp.mpf(10) ** -power)
                text = mp.nstr(alpha, 50)
            box = ToleranceBox("2", "1", "5/2", "5/2", text, Rb="24", Hb="14", clearance="64/65")
            proof = certify_jamming(box)
            what = f"alpha {'-+'[sign > 0]} 1e-{power}"
            given = proof.verdict.name
            undecided += given == "UNDECIDED"
            if power <= 14:
                check.equals(f"{what}: proved", given, right, source="exact fractions")
            else:
                check.agrees(f"{what}: never the wrong proof", given in (right, "UNDECIDED"), given, f"{right} or open")
                gap = proof.largest_gap
                check.agrees(
                    f"{what}: the enclosure of the gap holds 0", gap.lo < 0.0 < gap.hi, f"[{gap.lo:.2g}, {gap.hi:.2g}]"
                )
            found = assess_jamming(TiltedFourBar(alpha=float(alpha)), bearing).verdict.name
            allowed = (right, "UNDECIDED") if power > 12 else (right,)
            check.agrees(f"{what}: in doubles", found in allowed, found, " or ".join(allowed))
    check.says("some are left open", undecided > 0, True)


def grashof(check: Checks) -> None:
    """Four-bars a part in 1e-40 and in 1e-400 beside a change point, and on it: exact, whatever a double can hold."""
    from graphsynth.kinematics.certify import certify_four_bar

    for power in (0, 1, 15, 40, 400):
        step = Fraction(1, 10**power) if power else Fraction(0)
        # ground 2, crank 1, coupler 2.5, rocker 2.5 has slack 1: take the crank to the border 2 and beside it
        for sign, right in ((-1, "full turn"), (1, "full turn")):
            kind = certify_four_bar(2, 2 + sign * step, Fraction(5, 2), Fraction(5, 2)).kind
            wanted = right if power else "change point"
            # shortest + longest = 2 -+ step + 5/2 against 2 + 5/2: below it turns; above the ground is the shortest
            tell = check.says if wanted == "change point" else check.equals
            tell(f"crank 2 {'-+'[sign > 0]} 1e-{power}", kind, wanted, source="Grashof's rule")
    for power in (15, 40, 400):
        step = Fraction(1, 10**power)
        for sign, right in ((-1, "full turn"), (1, "limited")):
            kind = certify_four_bar(75, 30 + sign * step, 45, 60).kind
            check.equals(f"75, 30 {'-+'[sign > 0]} 1e-{power}, 45, 60", kind, right, source="Grashof's rule")
            kind = certify_four_bar(10, 4, 3, 3 + sign * step).kind
            right = "never assembled" if sign < 0 else "limited"
            check.equals(f"10, 4, 3, 3 {'-+'[sign > 0]} 1e-{power}", kind, right, source="longest against the others")
    check.equals("10, 4, 3, 3", certify_four_bar(10, 4, 3, 3).kind, "immovable", source="longest against the others")


def near_fold(check: Checks) -> None:
    """Four-bar 1e-2 to 1e-14 before its fold: what is proved holds the exact pose, what is not is left open."""
    import mpmath as mp
    import numpy as np

    from graphsynth.evidence.stress.cases.linkages import exact_four_bar, four_bar
    from graphsynth.kinematics.certify.poses import certify
    from graphsynth.kinematics.simulation import simulate

    a, b, c, g = 3.0, 3.0, 4.0, 6.0  # exact in binary: the fold is at arccos((9 + 36 - 49) / 36) = arccos(-1/9)
    with mp.workdps(40):
        fold = mp.acos(mp.mpf(-1) / 9)
    proved = 0
    for power in range(2, 15, 2):
        u = np.array([float(fold) - 2 * 10.0**-power, float(fold) - 10.0**-power])
        motion = simulate(four_bar(a, b, c, g), u, modes={0: 1})
        what = f"1e-{power} before the fold"
        right = exact_four_bar(a, b, c, g, float(u[1]), 1)
        error = max(abs(math.remainder(motion.poses[1, k, 2] - float(x), math.tau)) for k, x in zip((2, 3), right))
        check.below(
            f"{what}: error over the motion's estimate", error / float(motion.errors[1]), 1.0, source="60 digits"
        )
        check.below(f"{what}: angles, rad", error, 2e-16 * 10 ** (power / 2) + 2e-15, source="60 digits")
        proof = certify(motion, between=False)
        if bool(proof.poses[1]):
            proved += 1
            check.below(f"{what}: error, within the proved radius", error, float(proof.angle_radius[1]))
    check.agrees("some are proved", proved >= 3, str(proved))
    beyond = simulate(four_bar(a, b, c, g), np.array([1.0, float(fold) + 1e-12]), modes={0: 1})
    check.says("1e-12 beyond the fold: completed", beyond.completed, False)
    check.value("it stops at", beyond.stopped_at, fold, absolute=1e-9, source="arccos(-1/9)")
    check.agrees("nothing is shown beyond", bool(np.isnan(beyond.poses[1]).any()))
