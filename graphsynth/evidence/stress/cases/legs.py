"""Legs of the platform: reach, boundary, lengths of zero, ratios, units (platform page, 12.1 to 12.7, 12.31, 14.2)."""

from __future__ import annotations

import math
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from graphsynth.evidence.stress.checks import Checks

__all__ = [
    "bad_lengths", "boundary", "free", "half_turn", "length_ratios", "out_of_reach", "printed_legs", "units",
    "zero_lengths",
]  # fmt: skip

#: Section 14.2: l1, l2, u, v.  The fifteenth, out of reach, is checked by its status.
LEGS = (
    (1, 1e6, 1000000.3, 0), (1e6, 1, 1000000.3, 0.2), (1, 1e-6, 0.8, 0.6), (1e-6, 1, 0.6, 0.8), (1, 1, 1e-9, 0),
    (1, 1, 2, 0), (1, 0.5, 0.5, 0), (1, 1, 1.999999999999, 0), (1, 0.5, 0.500000000001, 0), (3, 4, -3, 4),
    (1, 1, -1, 1), (1, 1, -1, 1.0000000001), (3, 4, -5, 0), (45, 60, 75, 0),
)  # fmt: skip


def _angle(l1: float, l2: float, u: float, v: float, sigma: int) -> Any:
    """Rocker angle to 60 digits for the given doubles, by the law of cosines and not by the formulas of section 3."""
    import mpmath as mp

    with mp.workdps(60):
        a, b, x, y = (mp.mpf(value) for value in (l1, l2, u, v))
        rho = mp.hypot(x, y)
        cosine = (rho**2 + a**2 - b**2) / (2 * a * rho)
        return mp.arg(mp.mpc(x, y)) + sigma * mp.acos(min(max(cosine, mp.mpf(-1)), mp.mpf(1)))


def _compare(check: Checks, what: str, found: float, right: Any, absolute: float = 4.5e-16) -> None:
    import mpmath as mp

    with mp.workdps(60):
        turns = mp.nint((mp.mpf(found) - right) / (2 * mp.pi))
        right = right + 2 * mp.pi * turns
        check.value(what, found, right, absolute=absolute, source="60 digits")


def _status(leg: Any) -> str:
    from graphsynth.kinematics.triad.leg import LegStatus

    return LegStatus(int(leg.status)).name


def printed_legs(check: Checks) -> None:
    """Fifteen legs, both branches, against 60 digits for the very doubles."""
    from graphsynth.kinematics.triad.leg import solve_leg

    for l1, l2, u, v in LEGS:
        leg = solve_leg(u, v, l1, l2)
        check.agrees(f"({l1:g}, {l2:g}, {u:.13g}, {v:.11g}): reached", _status(leg) in ("REACHABLE", "BOUNDARY"))
        for sigma in (1, -1):
            what = f"({l1:g}, {l2:g}, {u:.13g}, {v:.11g}), branch {sigma:+d}"
            _compare(check, what, float(leg.angle(sigma)), _angle(l1, l2, u, v, sigma))
    out = solve_leg(2.0000001, 0.0, 1.0, 1.0)
    check.says("(1, 1, 2.0000001, 0)", _status(out), "TOO_FAR")
    check.value("its deficit", float(out.deficit), 2.0000001 - 2.0, relative=1e-12)
    check.agrees("no angle is shown", np.isnan(out.angle(1)))


def out_of_reach(check: Checks) -> None:
    """Pose that some legs do not reach: NaN, status and deficit there, the others solved."""
    from graphsynth.kinematics.triad.leg import LegStatus
    from graphsynth.systems.platform.parallel_platform import ParallelPlatform

    g1 = ParallelPlatform.g1()
    pose = [1.2, 2.9, 0.0]
    found = g1.inverse(pose)
    check.says("reachable", found.reachable, False)
    seen = 0
    for k in range(3):
        vertex = complex(*pose[:2]) + g1.b[k] - g1.D[k]
        rho, l1, l2 = abs(vertex), g1.l1[k], g1.l2[k]
        deficit = max(rho - (l1 + l2), abs(l1 - l2) - rho)
        out = deficit > 0
        seen += out
        check.value(f"leg {k + 1}: deficit", found.deficit[k], deficit, absolute=4e-15, source="section 3.2")
        status = LegStatus(int(found.status[k])).name
        check.says(f"leg {k + 1}: status", status, "TOO_FAR" if out else "REACHABLE")
        if out:
            check.agrees(f"leg {k + 1}: NaN in every mode", np.isnan(found.theta[:, k]).all())
        else:
            right = _angle(l1, l2, vertex.real, vertex.imag, 1)
            _compare(check, f"leg {k + 1}: angle", float(found.theta[0, k]), right, 4e-15)
    check.agrees("some legs reach and some do not", 0 < seen < 3, str(seen))


def boundary(check: Checks) -> None:
    """``S = 0``: one angle, status boundary, type I, unbounded sensitivity."""
    from graphsynth.kinematics.triad.leg import solve_leg
    from graphsynth.systems.platform.parallel_platform import ParallelPlatform
    from graphsynth.systems.platform.singularity import singularity

    for name, args in (("stretched", (2.0, 0.0, 1.0, 1.0)), ("folded", (0.5, 0.0, 1.0, 0.5))):
        leg = solve_leg(*args)
        check.says(f"{name}: status", _status(leg), "BOUNDARY")
        check.value(f"{name}: S", float(leg.S), 0)
        check.values(f"{name}: one angle", [float(leg.angle(1)), float(leg.angle(-1))], [0, 0])
    # legs 2 and 3 as usual, leg 1 stretched exactly
    platform = ParallelPlatform((0, 2 + 1j, 1j), (0, 0.25, 0.25j), (1, 1.25, 1.25), (1, 1.5, 1.5))
    pose = [2.0, 0.0, 0.0]
    solved = platform.inverse(pose, (1, 1, 1))
    check.value("stretched leg of a platform: S", solved.S[0], 0)
    found = singularity(platform, pose, solved.theta)
    check.says("its type", found.kind, "I")
    check.agrees("its sensitivity is infinite", solved.sensitivity[0] == math.inf, str(solved.sensitivity[0]))
    check.says("legs of type I", found.legs, (1,))


def free(check: Checks) -> None:
    """Vertex on the pivot with equal lengths: free, no single value."""
    from graphsynth.kinematics.triad.leg import solve_leg

    leg = solve_leg(0.0, 0.0, 1.0, 1.0)
    check.says("status", _status(leg), "FREE")
    check.agrees("no single angle is shown", np.isnan(leg.angle(1)) and np.isnan(leg.angle(-1)))
    near = solve_leg(1e-300, 0.0, 1.0, 1.0)
    check.equals("1e-300 beside it", _status(near), "REACHABLE")
    _compare(check, "angle there", float(near.angle(1)), _angle(1.0, 1.0, 1e-300, 0.0, 1))
    check.says("unequal lengths", _status(solve_leg(0.0, 0.0, 1.0, 0.5)), "TOO_NEAR")


def zero_lengths(check: Checks) -> None:
    """Legs without one of their links: the rules of section 3.2, no division by zero."""
    from graphsynth.kinematics.triad.leg import solve_leg

    with np.errstate(all="raise"):
        for (l1, l2, u, v), status in (
            ((0, 1, 1, 0), "FREE"), ((0, 1, 2, 0), "TOO_FAR"), ((0, 1, 0.5, 0), "TOO_NEAR"),
            ((1, 0, 1, 0), "BOUNDARY"), ((1, 0, 0.5, 0), "TOO_NEAR"), ((1, 0, 1.5, 0), "TOO_FAR"),
            ((0, 0, 0, 0), "FREE"), ((0, 0, 1, 0), "TOO_FAR"),
        ):  # fmt: skip
            check.says(f"(l1, l2, u, v) = ({l1}, {l2}, {u}, {v})", _status(solve_leg(u, v, l1, l2)), status)
    check.value("l2 = 0, rho = l1: the angle of the vertex", float(solve_leg(0.0, 1.0, 1.0, 0.0).angle(1)), math.pi / 2)


def length_ratios(check: Checks) -> None:
    """Ratios of 1e6, 1e12 and 1e15: compensated evaluation, angles to a few units in the last place."""
    from graphsynth.kinematics.triad.leg import solve_leg

    for power in (6, 9, 12, 15):
        small = 10.0**-power
        for l1, l2, u, v in ((1.0, small, math.cos(0.7), math.sin(0.7)), (small, 1.0, 0.6, 0.8)):
            rho = math.hypot(u, v)
            for t in (0.25, -0.6):
                # a target between folded and stretched
                scale = (1.0 + t * small) / rho
                x, y = u * scale, v * scale
                leg = solve_leg(x, y, l1, l2)
                what = f"l1 = {l1:g}, l2 = {l2:g}, rho = 1 {t:+g} l"
                if _status(leg) != "REACHABLE":
                    # the doubles may lie outside of the ring, decided exactly
                    check.equals(f"{what}: status", _status(leg), _exact_status(l1, l2, x, y))
                    continue
                for sigma in (1, -1):
                    right = _angle(l1, l2, x, y, sigma)
                    _compare(check, f"{what}, branch {sigma:+d}", float(leg.angle(sigma)), right, 9e-16)


def _exact_status(l1: float, l2: float, u: float, v: float) -> str:
    from fractions import Fraction

    square = Fraction(u) ** 2 + Fraction(v) ** 2
    far, near = (Fraction(l1) + Fraction(l2)) ** 2, (Fraction(l1) - Fraction(l2)) ** 2
    if square > far:
        return "TOO_FAR"
    return "TOO_NEAR" if square < near else "BOUNDARY" if square in (far, near) else "REACHABLE"


def half_turn(check: Checks) -> None:
    """``theta = pi`` in a leg and ``alpha = pi`` of the platform: nothing special."""
    from graphsynth.kinematics.triad.leg import solve_leg
    from graphsynth.systems.platform.parallel_platform import ParallelPlatform

    for l1, l2, u, v in ((3, 4, -3, 4), (1, 1, -1, 1), (1, 1, -1, 1.0000000001), (3, 4, -5, 0)):
        for sigma in (1, -1):
            found = float(solve_leg(u, v, l1, l2).angle(sigma))
            _compare(check, f"({l1}, {l2}, {u}, {v:.11g}), branch {sigma:+d}", found, _angle(l1, l2, u, v, sigma))
    g1 = ParallelPlatform.g1()
    # the same mechanism with the platform's frame turned by pi and back: vertices -b, orientation alpha + pi
    one, two, three = g1.b
    turned = ParallelPlatform(g1.D, (-one, -two, -three), g1.l1, g1.l2)
    alpha = 0.15
    theta = g1.inverse([1.2, 0.9, alpha], (1, 1, 1)).theta
    modes = turned.direct(theta)
    right = math.remainder(alpha + math.pi, math.tau)
    check.equals("modes", len(modes), 2)
    near = float(modes.poses[np.abs(modes.poses[:, 2] - right).argmin(), 2])
    check.value("alpha + pi", near, right, absolute=6e-15, source="frame turned by pi")
    # alpha = pi itself
    home = [1.2, 0.9, math.pi]
    legs = turned.inverse(home, (1, 1, 1))
    check.equals("alpha = pi is reached", legs.reachable, g1.inverse([1.2, 0.9, 0.0], (1, 1, 1)).reachable)
    back = turned.direct(legs.theta).poses
    gap = np.abs(back - home)
    gap[:, 2] = np.abs(np.angle(np.exp(1j * gap[:, 2])))
    check.below("alpha = pi found again", float(gap.max(axis=1).min()), 2e-14)


def bad_lengths(check: Checks) -> None:
    """Input errors that name the leg."""
    from graphsynth.systems.platform.parallel_platform import ParallelPlatform

    g1 = ParallelPlatform.g1()
    change: dict[str, Any]
    good: dict[str, Any] = {"D": g1.D, "b": g1.b, "l1": g1.l1, "l2": g1.l2}
    for change, words in (
        ({"l1": (1, -1, 1)}, ("l1", "leg 2")), ({"l2": (1, 1, math.nan)}, ("l2", "leg 3")),
        ({"l1": (math.inf, 1, 1)}, ("l1", "leg 1")), ({"D": (0, math.inf, 1)}, ("leg 2",)), ({"b": (0, 1)}, ("three",)),
    ):  # fmt: skip
        check.refused(f"{change}", partial(ParallelPlatform, **{**good, **change}), *words)
    check.refused("pose with NaN", lambda: g1.inverse([math.nan, 0, 0]), "nan")


def units(check: Checks) -> None:
    """Lengths times a constant change no angle and no number of modes."""
    from graphsynth.kinematics.triad.assembly_modes import AssemblyModes, assembly_modes
    from graphsynth.kinematics.triad.leg import solve_leg
    from graphsynth.systems.platform.parallel_platform import ParallelPlatform

    g1 = ParallelPlatform.g1()
    theta = (0.0, 0.0, 0.0)
    right = ["-0.1676478906740002300845393288613099", "0.4780458846922180136167385177734372"]

    def modes_of(unit: float) -> AssemblyModes:
        return assembly_modes(g1.elbows(theta) * unit, np.array(g1.b) * unit, np.array(g1.l2) * unit)

    for unit in (1e-57, 1e-9, 1e9, 1e57):
        modes = modes_of(unit)
        check.equals(f"unit {unit:g}: modes", len(modes), 2)
        check.values(f"unit {unit:g}: alpha", modes.poses[:, 2], right, absolute=5e-15, source="section 14.3")
    for unit in (1e-150, 1e150):
        check.refused(f"unit {unit:g}", partial(modes_of, unit), "1e-60", "1e+60")
    for unit in (2.0**-500, 2.0**500):
        for l1, l2, u, v in LEGS[:4]:
            found = float(solve_leg(u * unit, v * unit, l1 * unit, l2 * unit).angle(1))
            _compare(check, f"unit 2^{math.log2(unit):+.0f}: leg ({l1:g}, {l2:g})", found, _angle(l1, l2, u, v, 1))
