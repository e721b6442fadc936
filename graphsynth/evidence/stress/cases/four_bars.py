"""Four-bars at a change point and with a limited input (instruments page, 9.8 and 9.9)."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from graphsynth.evidence.stress.checks import Checks

__all__ = ["change_point", "limited"]


def change_point(check: Checks) -> None:
    """Distances 1e-2 to 1e-12 from the flat pose: ratios to 15 digits, both modes, nothing chosen silently."""
    import mpmath as mp

    from graphsynth.evidence.stress.cases.linkages import four_bar
    from graphsynth.kinematics.simulation import simulate
    from graphsynth.systems.braider.linkage import FourBar
    from graphsynth.systems.braider.model import Braider

    bar = FourBar(0.02, 0.05, 0.03, 0.06)
    for power in (2, 3, 4, 6, 9, 12):
        for branch in (1, -1):
            theta = math.pi - 10.0**-power
            state = FourBar(0.02, 0.05, 0.03, 0.06, branch).motion(theta)
            k2, k3 = _ratios(theta, branch)
            what = f"1e-{power} before, branch {branch:+d}"
            check.value(f"{what}: k2", float(state.k2), k2, relative=5e-15, source="50 digits")
            check.value(f"{what}: k3", float(state.k3), k3, relative=5e-15, source="50 digits")
    printed = (
        ("1e-2", "-0.0854119493071495", "0.809013005595906"),
        ("1e-9", "-0.0854101966249685", "0.809016994374947"),
    )
    for distance, k2_text, k3_text in printed:
        state = bar.motion(math.pi - float(distance))
        check.value(
            f"{distance}: k2 printed", float(state.k2), k2_text, absolute=6e-17, relative=1e-15, source="section 4.8"
        )
        check.value(f"{distance}: k3 printed", float(state.k3), k3_text, relative=1e-15, source="section 4.8")
    points = bar.change_points()
    check.says("change points", len(points), 1)
    check.value("location", points[0].theta, math.pi, absolute=0)
    with mp.workdps(30):
        root = mp.sqrt(5)
        for branch in (1, -1):
            right = ((5 - branch * 3 * root) / 20, (1 + branch * root) / 4)
            check.values(
                f"ratios of mode {branch:+d}", points[0].ratios[branch], right, relative=1e-14, source="section 4.8"
            )
    check.agrees(
        "the tolerance of equality is stated", 0.0 < points[0].tolerance < 1e-15, f"{points[0].tolerance:.1e} m"
    )
    driven = Braider(linkage=bar).simulate(np.linspace(0.0, 0.6, 61), angle=2.5)
    check.says("driven through: status", driven.status.name, "CHANGE_POINT")
    check.mentions("driven through: reason", driven.reason, "choose the branch")
    check.agrees("nothing beyond", bool(np.isnan(driven.speed[driven.reached :]).all()))
    motion = simulate(four_bar(0.02, 0.05, 0.03, 0.06), np.linspace(2.9, 3.4, 11), modes={0: 1})
    check.says("simulate through it: completed", motion.completed, False)
    check.value("it stops at", motion.stopped_at, math.pi, absolute=1e-6)


def _ratios(theta: float, branch: int) -> tuple[Any, Any]:
    """Velocity ratios by the textbook formulas with 50 digits, for the decimal lengths."""
    import mpmath as mp

    from graphsynth.evidence.stress.cases.linkages import exact_four_bar

    phi2, phi3 = exact_four_bar("0.02", "0.05", "0.03", "0.06", theta, branch)
    with mp.workdps(60):
        a, b, c, t = mp.mpf("0.02"), mp.mpf("0.05"), mp.mpf("0.03"), mp.mpf(theta)
        k2 = -a * mp.sin(t - phi3) / (b * mp.sin(phi2 - phi3))
        return k2, a * mp.sin(t - phi2) / (c * mp.sin(phi3 - phi2))


def limited(check: Checks) -> None:
    """Full turn asked of a crank that cannot: the arc with its ends, by every way in; no clipping."""
    import mpmath as mp

    from graphsynth.evidence.stress.cases.linkages import four_bar
    from graphsynth.kinematics.certify import certify_four_bar
    from graphsynth.kinematics.simulation import simulate
    from graphsynth.systems.braider.linkage import FourBar

    a, b, c, g = 0.03, 0.03, 0.04, 0.06
    with mp.workdps(30):
        A, B, C, G = (mp.mpf(x) for x in (a, b, c, g))
        end = mp.acos((A**2 + G**2 - (B + C) ** 2) / (2 * A * G))
    bar = FourBar(a, b, c, g)
    reach = bar.reach()
    check.says("arcs", len(reach), 1)
    check.values("its ends", reach[0], [-end, end], absolute=4e-16, source="closed form")
    # beside the end the rocker's ratio grows like a square root
    inside, outside = bar.motion(float(end) - 1e-9), bar.motion(float(end) + 1e-9)
    check.agrees("1e-9 inside", bool(np.isfinite(inside.k3)), f"{float(inside.k3):.4g}")
    check.agrees("1e-9 outside: NaN", bool(np.isnan(outside.k3) and np.isnan(outside.phi3)))
    check.says("turns fully", bar.turns_fully, False)
    turn = np.linspace(0.0, 2 * math.pi, 73)
    motion = simulate(four_bar(a, b, c, g), turn, modes={0: 1})
    check.says("simulate: completed", motion.completed, False)
    check.value("simulate: it stops at", motion.stopped_at, end, absolute=1e-9, source="closed form")
    beyond = turn > float(end)
    assembled = bool(np.isnan(motion.poses[beyond]).any(axis=(1, 2)).all() and motion.assembled[~beyond].all())
    check.agrees("simulate: shown up to there, NaN beyond", assembled)
    check.agrees("simulate: reason", bool(motion.reason), motion.reason)
    proof = certify_four_bar("0.06", "0.03", "0.03", "0.04")
    check.says("exact class", proof.kind, "limited")
    held = any(
        float(limit.low) <= float(end) + 1e-15 and float(limit.high) >= float(end) - 1e-15 for limit in proof.limits
    )
    check.agrees("its end is enclosed", held, str(proof.limits[0]))
