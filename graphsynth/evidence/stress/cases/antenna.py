"""The antenna: charts, false roots, modes, folds, dead points, tolerances (instruments page, 9.1 to 9.7)."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from graphsynth.evidence.stress.checks import Checks

__all__ = ["all_modes", "approach", "dead_points", "false_roots", "fold", "singular_chart", "tolerance_at_fold"]

#: Section 2.9, degrees, order YX, both cranks at 40 degrees.
A_40, B_40 = "23.7120800164849915647", "22.44785725383752382049"


def _antenna(**lengths: Any) -> Any:
    from graphsynth.systems.antenna import PointingMechanism

    return PointingMechanism(**lengths)


def singular_chart(check: Checks) -> None:
    """Equations as printed, at rest: rank 11 of 12, the coordinates are named, the regular ones are used."""
    art = _antenna()
    report = art.check_chart(0.0, 0.0, "printed")
    check.says(
        "rank of the printed chart, and of the other", (report.rank, report.other_rank), (11, 12), source="section 2.4"
    )
    check.says("verdict", report.verdict, "coordinates singular, mechanism regular")
    check.says("chart to use", report.use, "corrected")
    for chart, scaled, largest, smallest in (
        ("printed", False, "2.15", "0"), ("printed", True, "2.73", "0"), ("corrected", False, "2.00", "0.0544"),
        ("corrected", True, "2.45", "0.415"),
    ):  # fmt: skip
        values = art.check_chart(0.0, 0.0, chart, scaled=scaled).singular_values
        what = f"{chart}, {'scaled' if scaled else 'unscaled'}"
        check.value(f"{what}: largest singular value", values[0], largest, absolute=0.0051, source="section 2.4")
        check.value(f"{what}: smallest", values[-1], smallest, absolute=5.1e-4, source="section 2.4")
    solved = art.solve_loops(math.radians(40), math.radians(40), chart="printed")
    check.says("chart used by the solver", solved.chart, "corrected")
    check.mentions("its sentence", solved.message, "coordinates singular, mechanism regular")
    check.value("a at 40 degrees", math.degrees(float(solved.x[5])), A_40, absolute=1e-13, source="section 2.9")
    check.value("b at 40 degrees", math.degrees(float(solved.x[11])), B_40, absolute=1e-13, source="section 2.9")


def false_roots(check: Checks) -> None:
    """Random starts of the twelve scalar equations: false orientations counted, none accepted."""
    art = _antenna()
    survey = art.survey_roots(0.3, -0.2, starts=80, seed=1)
    total = survey.failed + survey.false + survey.genuine
    check.equals("failed, false and genuine ones together", total, 80)
    check.agrees(
        "false roots are met and rejected",
        survey.false > 4 * survey.genuine > 0,
        f"{survey.false} false, {survey.genuine} genuine",
    )
    for a, b in survey.modes:
        gap = min(_gap(art, float(a), float(b), 0.3, -0.2))
        check.below("a genuine root closes both legs", gap, 1e-10, source="distances of the rods")


def _gap(mechanism: Any, a: float, b: float, phi_x: float, phi_y: float) -> list[float]:
    """Errors of both rod lengths, from rotation matrices and points alone (section 2.5, order YX)."""
    l1, l2, l3, l4, l5 = mechanism.lengths
    ca, sa, cb, sb = math.cos(a), math.sin(a), math.cos(b), math.sin(b)
    R = np.array([[cb, sb * sa, sb * ca], [0.0, ca, -sa], [-sb, cb * sa, cb * ca]])
    S_y = np.array([0.0, l1 - l3 + l3 * math.cos(phi_x), -l2 + l3 * math.sin(phi_x)])
    S_x = np.array([l1 - l5 + l5 * math.cos(phi_y), 0.0, -l4 - l5 * math.sin(phi_y)])
    errors = [np.linalg.norm(R @ [0.0, l1, 0.0] - S_y) - l2, np.linalg.norm(R @ [l1, 0.0, 0.0] - S_x) - l4]
    return [float(max(abs(errors[0]), abs(errors[1])))]


def all_modes(check: Checks) -> None:
    """Every real mode with its signs, none twice: counted by sign changes on a fine grid."""
    random = np.random.default_rng(11)
    grid = np.linspace(-np.pi, np.pi, 20001)
    for k in range(12):
        lengths, (phi_x, phi_y) = random.uniform(0.3, 1.5, 5), random.uniform(-np.pi, np.pi, 2)
        mechanism = _antenna(**dict(zip(("l1", "l2", "l3", "l4", "l5"), lengths.tolist())))
        modes = mechanism.solve(phi_x, phi_y)
        check.says(
            f"random pose {k}: modes",
            int(modes.count),
            _count(lengths, phi_x, phi_y, grid),
            source="grid of both loops",
        )
        for a, b in zip(modes.a, modes.b):
            if math.isfinite(a):
                check.below(f"random pose {k}: rods", _gap(mechanism, float(a), float(b), phi_x, phi_y)[0], 2e-14)
        check.agrees(f"random pose {k}: none twice", len(set(map(tuple, modes.signs))) == len(modes.signs))
    home = _antenna().solve(0.0, 0.0)
    check.agrees("the rest pose is a mode", bool(np.any((np.abs(home.a) < 1e-15) & (np.abs(home.b) < 1e-15))))


def _count(lengths: np.ndarray, phi_x: float, phi_y: float, grid: np.ndarray) -> int:
    l1, l2, l3, l4, l5 = lengths
    y1, y2 = l1 - l3 + l3 * math.cos(phi_x), -l2 + l3 * math.sin(phi_x)
    x1, x2 = l1 - l5 + l5 * math.cos(phi_y), -l4 - l5 * math.sin(phi_y)
    # order YX: R e_x = (cos b, 0, -sin b) holds leg X alone
    first = np.hypot(l1 * np.cos(grid) - x1, -l1 * np.sin(grid) - x2) - l4
    count = 0
    for i in np.flatnonzero(first[:-1] * first[1:] < 0):
        b = grid[i] - first[i] * (grid[1] - grid[0]) / (first[i + 1] - first[i])
        point = l1 * np.stack([math.sin(b) * np.sin(grid), np.cos(grid), math.cos(b) * np.sin(grid)])
        second = np.sqrt(point[0] ** 2 + (point[1] - y1) ** 2 + (point[2] - y2) ** 2) - l2
        count += int((second[:-1] * second[1:] < 0).sum())
    return count


def fold(check: Checks) -> None:
    """Parallelogram legs, equal cranks to 75 degrees: the sweep stops at the printed fold."""
    from graphsynth.systems.antenna.precise import precise_angles, precise_fold

    sweep = _antenna(l3=0.1, l5=0.1).sweep(np.radians(np.arange(0.0, 76.0)))
    met = sweep.fold
    if met is None:
        check.says("fold", None, "one")
        return
    source = "section 2.9"
    check.value(
        "fold, degrees", math.degrees(met.parameter), "69.3946276048996534091046747766", absolute=3e-14, source=source
    )
    check.value("output there, degrees", math.degrees(met.a), "150.57815542480929740846", absolute=2e-13, source=source)
    check.value("square-root coefficient", met.coefficient, "2.8694330080943580814", relative=1e-14, source=source)
    check.says("leg and modes that merge", (met.leg, met.merging), ("Y", ((1, -1), (-1, -1))))
    stopped = bool(np.isnan(sweep.poses.a[70:]).all() and np.isfinite(sweep.poses.a[:70]).all())
    check.agrees("poses end at 69 degrees", stopped)
    check.mentions("sentence", sweep.message, "69.394628", "leg Y")
    import mpmath as mp

    with mp.workdps(60):
        mechanism = _antenna(l3=0.1, l5=0.1)
        sharp = precise_fold(mechanism, met)
        for distance, right in (
            ("1e-3", "145.368182186659022207"), ("1e-6", "150.4137338628014220995"),
            ("1e-9", "150.5729564226259876224"), ("1e-12", "150.5779910183930399864"),
        ):  # fmt: skip
            phi = sharp.parameter - mp.mpf(distance)
            given = mp.degrees(precise_angles(mechanism, phi, phi)[0])
            check.value(f"a at {distance} rad, degrees", given, right, absolute=1e-18, source=source)


def approach(check: Checks) -> None:
    """All four folds of the stretched leg X, from 1e-3 to 1e-20 rad: the loss is the square root, and compensated."""
    stretched = _antenna(l3=0.12, l5=0.12)
    folds = stretched.folds("X")
    check.equals("folds of leg X", len(folds), 4)
    # rod of leg X on a line through the centre: |S_X| = l1 + l4 or l4 - l1, so A cos + B sin = C of section 2.7
    import mpmath as mp

    with mp.workdps(40):
        l1, l4, l5 = mp.mpf(0.1), mp.mpf(0.15), mp.mpf(0.12)
        A, B = 2 * (l1 - l5) * l5, 2 * l4 * l5
        right = []
        for sign in (1, -1):
            C = (l1 + sign * l4) ** 2 - (l1 - l5) ** 2 - l5**2 - l4**2
            for side in (1, -1):
                angle = mp.atan2(B, A) + side * mp.acos(C / mp.hypot(A, B))
                right.append(angle - 2 * mp.pi * mp.nint(angle / (2 * mp.pi)))
        right.sort()
    check.values(
        "their crank angles", sorted(f.phi_y for f in folds), right, absolute=2e-15, source="closed form of 2.7"
    )
    distances = 10.0 ** -np.arange(3.0, 21.0)
    for k, one in enumerate(folds):
        inside = one.phi_y + 0.001 * one.side
        other = next((p for p in np.linspace(-3, 3, 61).tolist() if stretched.solve(p, inside).count == 4), None)
        if other is None:
            check.says(f"fold {k}", "leg Y reaches nowhere", "leg Y reaches")
            continue
        own = stretched.folds("X", other)[k]
        found = stretched.approach(own, distances)
        check.below(
            f"fold {k}: error of the compensated form", float(found.compensated_error.max()), 4e-15, source="60 digits"
        )
        seen = np.isfinite(found.plain_error)
        explained = bool((found.plain_error[seen] <= found.predicted_error[seen]).all())
        check.agrees(
            f"fold {k}: plain error within the square-root law", explained, f"{found.plain_error[seen].max():.1e}"
        )
        near = np.abs(found.series / found.exact - 1.0)
        check.agrees(f"fold {k}: series of first order", bool((near < 5.0 * np.sqrt(distances) + 1e-14).all()))


def dead_points(check: Checks) -> None:
    """Crank and rod in line: which input loses control, and that its transmission is zero there."""
    art = _antenna()
    for leg, own in (("Y", (0, 0)), ("X", (1, 1))):
        points = [p for p in art.dead_points(leg, 0.3) if p.s_y != 0]
        check.agrees(f"leg {leg}: dead points", len(points) >= 2, str(len(points)))
        check.equals(f"leg {leg}: kinds", {p.kind for p in points}, {"stretched", "folded"})
        for p in points:
            rates = art.rates(p.phi_x, p.phi_y, s_y=p.s_y, s_x=p.s_x)
            check.below(f"leg {leg}, {p.kind}: transmission", abs(p.transmission), 1e-14)
            check.below(f"leg {leg}, {p.kind}: Jacobian", abs(float(rates.jacobian[own])), 1e-14)
            check.below(f"leg {leg}, {p.kind}: crank and rod in line", _bend(art, leg, p), 1e-14, source="geometry")


def _bend(mechanism: Any, leg: str, p: Any) -> float:
    """Sine of the angle between the crank and the projection of the rod on the crank's plane."""
    l1, l2, l3, l4, l5 = mechanism.lengths
    ca, sa, cb, sb = math.cos(p.a), math.sin(p.a), math.cos(p.b), math.sin(p.b)
    R = np.array([[cb, sb * sa, sb * ca], [0.0, ca, -sa], [-sb, cb * sa, cb * ca]])
    if leg == "Y":
        crank = l3 * np.array([math.cos(p.phi_x), math.sin(p.phi_x)])
        rod = (R @ [0.0, l1, 0.0])[1:] - [l1 - l3, -l2] - crank
    else:
        crank = l5 * np.array([math.cos(p.phi_y), -math.sin(p.phi_y)])
        rod = (R @ [l1, 0.0, 0.0])[[0, 2]] - [l1 - l5, -l4] - crank
    return float(abs(crank[0] * rod[1] - crank[1] * rod[0]) / np.hypot(*crank) / np.hypot(*rod))


def tolerance_at_fold(check: Checks) -> None:
    """Box of lengths that touches a fold: undecided, with the length; never certified when a corner fails."""
    parallelogram = _antenna(l3=0.1, l5=0.1)
    near = parallelogram.tolerance(math.radians(69.3), math.radians(69.3))
    check.says("status", near.status.name, "UNDECIDED")
    check.says("the length that does it", near.lengths, ("l1",))
    check.mentions("reason", near.reason, "leg Y", "l1")
    check.agrees("no bounds are shown", math.isnan(near.a.lower) and math.isnan(near.b.upper))
    wrong = 0
    for degrees in np.linspace(68.5, 69.39, 8):
        found = parallelogram.tolerance(math.radians(degrees), math.radians(degrees), method="mean_value")
        wrong += math.isnan(found.a.corner_lower) and found.status.name != "UNDECIDED"
    check.equals("certified although a corner fails", int(wrong), 0)
    art = _antenna().tolerance(math.radians(15), math.radians(15))
    check.equals("far from folds", art.status.name, "CERTIFIED")
    ends = ("8.803040986781996547718", "8.826927759715010619827")
    given = (math.degrees(art.b.lower), math.degrees(art.b.upper))
    check.values("bounds of b, degrees", given, ends, absolute=1e-8, source="section 2.10")
    check.agrees("they lie outside", given[0] <= float(ends[0]) + 1e-14 and given[1] >= float(ends[1]) - 1e-14)
