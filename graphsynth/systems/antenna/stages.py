"""The antenna of a scene: a sweep, a second model, the twelve equations, singular poses, tolerances, and the tables."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from graphsynth.core.errors import GeometryError
from graphsynth.pipeline.display import quantity_table, table, unit_in
from graphsynth.pipeline.products import Quantity, Record, Table
from graphsynth.pipeline.stages import Context
from graphsynth.systems.antenna import (
    ChartReport,
    Convention,
    DeadPoint,
    Fold,
    ModelComparison,
    PassiveAngles,
    PointingMechanism,
    PointingSweep,
    Rates,
    RootSurvey,
    Tolerance,
)
from graphsynth.systems.antenna.scene import LENGTH_NAMES, antenna_of, other_model, table_of, widths_of
from graphsynth.systems.antenna.tolerance import outward_text

Bounds = tuple[tuple[float, Tolerance], ...]
_CHECKED_POSES = 9
_STARTS = 60
_ROWS = 8
_ROUNDING = 4.0 * 2.0**-52


@dataclass(frozen=True, eq=False)
class AntennaMotion:
    """Equal crank angles, radians, from 0 on: where the sweep stopped, passive angles, velocities."""

    phi: NDArray[np.float64]
    path: PointingSweep
    passive: PassiveAngles
    rates: Rates


@dataclass(frozen=True, eq=False)
class CrossCheck:
    """The twelve equations solved by Newton's method: largest differences from the closed form, radians."""

    phi: NDArray[np.float64]
    angles: NDArray[np.float64]
    residual: float
    difference: float
    rates_difference: float
    charts: tuple[ChartReport, ChartReport]
    survey: RootSurvey
    modes: int


@dataclass(frozen=True, eq=False)
class SingularPoses:
    """Folds and dead points of both legs with the other crank at rest, and the first fold of equal cranks."""

    folds: tuple[Fold, ...]
    dead_points: tuple[DeadPoint, ...]
    sweep_fold: Fold | None
    sweep_message: str


def sweep(context: Context) -> AntennaMotion:
    """Turn both cranks together on the assembly mode of the rest pose; beyond a fold everything is NaN."""
    antenna, table = antenna_of(context), table_of(context).sweep
    phi = np.linspace(0.0, table.largest, table.samples)
    path = antenna.sweep(phi)
    found = antenna.rates(phi, phi, 1.0, 1.0)
    away = ~path.reached
    found = replace(found, jacobian=np.where(away[:, None, None], np.nan, found.jacobian))
    return AntennaMotion(phi, path, antenna.passive_angles(path.poses), found)


def compare(context: Context) -> ModelComparison:
    """Compare the outputs of the two models over the sweep."""
    (other, reading), table = other_model(context), table_of(context).sweep
    phi = np.linspace(0.0, table.largest, table.samples)
    return antenna_of(context).compare(other, phi, other_reading=reading)


def cross_check(context: Context, motion: AntennaMotion) -> CrossCheck | None:
    """Solve the twelve equations at some poses of the sweep; None if it cannot start."""
    antenna, reached = antenna_of(context), np.flatnonzero(motion.path.reached)
    if reached.size == 0:
        return None
    chosen = np.unique(reached[np.linspace(0, reached.size - 1, _CHECKED_POSES).round().astype(int)])
    phi = motion.phi[chosen]
    found = antenna.solve_loops(phi, phi)
    turned = np.remainder(found.x - motion.passive.x[chosen] + math.pi, math.tau) - math.pi
    poses = antenna.poses(phi, phi)
    rates = antenna.passive_rates(poses, 1.0, 1.0)
    slow = antenna.rates(phi, phi, 1.0, 1.0)
    rates_gap = max(np.abs(rates[:, 5] - slow.da).max(), np.abs(rates[:, 11] - slow.db).max())
    last = float(phi[-1])
    charts = antenna.check_chart(0.0, 0.0, "printed"), antenna.check_chart(0.0, 0.0, "corrected")
    survey = antenna.survey_roots(last, last, starts=_STARTS, seed=context.scene.scene.seed)
    return CrossCheck(
        phi,
        found.x,
        float(found.residual.max()),
        float(np.abs(turned).max()),
        float(rates_gap),
        charts,
        survey,
        int(antenna.solve(last, last).count),
    )


def singular_poses(context: Context) -> SingularPoses:
    """Find folds and dead points over a turn of each crank, and the first fold of equal cranks up to half a turn."""
    antenna = antenna_of(context)
    path = antenna.sweep(np.linspace(0.0, math.pi, 181))
    folds, dead = antenna.folds("Y") + antenna.folds("X"), antenna.dead_points("Y") + antenna.dead_points("X")
    return SingularPoses(folds, dead, path.fold, path.message)


def tolerances(context: Context) -> Bounds:
    """Prove bounds of both outputs at the equal crank angles asked for, radians."""
    antenna, widths = antenna_of(context), widths_of(context)
    found = []
    for phi in table_of(context).tolerances.at:
        try:
            found.append((phi, antenna.tolerance(phi, phi, widths, converted=True)))
        except GeometryError as error:
            raise (context.scene.place / "mechanism" / "tolerances").error(f"cannot be used: {error}") from error
    return tuple(found)


def solvers(context: Context) -> tuple[Table, ...]:
    """Error against run time of the closed form and of the twelve equations; not part of the shipped outputs."""
    from graphsynth.systems.antenna.evidence import pointing_errors

    found = pointing_errors(antenna_of(context), table_of(context).sweep.largest)
    rows = ((row.method, row.setting, row.error, row.seconds) for row in found)
    columns = ("method", "setting", "error [rad] | .1e", "time per pose [µs] | .3g")
    return (table("Error against run time", columns, rows, "Largest error of both angles, against 50 digits."),)


def assess(
    context: Context,
    motion: AntennaMotion,
    comparison: ModelComparison,
    check: CrossCheck | None,
    singular: SingularPoses,
    bounds: Bounds,
) -> tuple[tuple[Record, ...], tuple[Table, ...]]:
    """Give the verdict and the tables."""
    margins = _margins(context, motion, comparison, bounds)
    words, good = _verdict(context, motion, comparison, bounds)
    record = Record(recognised_as="pointing mechanism", verdict=words, good=good, margins=tuple(margins))
    note = "Angles are of the closed form, bounds are proved by intervals."
    ratios = ("∂elevation/∂φx", "∂elevation/∂φy", "∂azimuth/∂φx", "∂azimuth/∂φy")
    slopes = motion.rates.jacobian.reshape(-1, 4).T
    columns = {"cranks [°] | .6g": motion.phi} | {f"{name} | 14 .12g": s for name, s in zip(ratios, slopes)}
    tables = [
        quantity_table("Results", margins, note),
        _structure_table(context),
        _sweep_table(motion, comparison),
        _conventions_table(context),
        _tolerance_table(context, bounds),
        _over_sweep("Velocities of the reflector over those of the cranks", columns, "Closed form; no unit."),
        _modes_table(context),
        _singular_table(singular),
    ]
    if check is not None:
        tables += [_check_table(check), _unknowns_table(check)]
    return (record,), tuple(tables)


def _degrees(angle: float) -> str:
    return f"{math.degrees(angle):.10g}°"


def _margins(context: Context, motion: AntennaMotion, comparison: ModelComparison, bounds: Bounds) -> list[Quantity]:
    limits = table_of(context).sweep
    poses, last, ends = motion.path.poses, motion.phi.size - 1, f"at {_degrees(limits.largest)}"
    found = []
    if motion.path.reached[last]:
        error = _ROUNDING / float(poses.margin_y[last] * poses.margin_x[last])  # of both angles, radians, estimated
        separation = float(poses.a[last] - poses.b[last])
        found += [
            Quantity.of_si(f"elevation {ends}", poses.a[last], "°", "estimated", error),
            Quantity.of_si(f"azimuth {ends}", poses.b[last], "°", "estimated", error),
            Quantity.of_si(f"separation of the two {ends}", separation, "′", "estimated", 2.0 * error),
        ]
        for at in (limits.largest, limits.working):
            value = float(np.interp(at, motion.phi, comparison.arcminutes))
            computed = at == limits.largest or np.isclose(motion.phi, at, rtol=0, atol=1e-12).any()
            if computed and math.isfinite(value):
                name = f"difference of the two models at {_degrees(at)}"
                found.append(Quantity(name, value, "′", "estimated", unit_in("[′]").from_si(4.0 * error)))
    for at, tolerance in reversed(bounds):  # the widest rotation first
        for name, side in (("elevation", tolerance.a), ("azimuth", tolerance.b)):
            worst = max(map(abs, side.deviation))
            if math.isfinite(worst):
                found.append(Quantity(f"largest deviation of the {name} at {_degrees(at)}", worst, "″", "certified"))
    return found


def _verdict(context: Context, motion: AntennaMotion, comparison: ModelComparison, bounds: Bounds) -> tuple[str, bool]:
    """Return the verdict, and whether it is good news."""
    if not motion.path.reached.all():
        return motion.path.message, False
    undecided = [at for at, found in bounds if found.status]
    difference = float(comparison.arcminutes[-1])
    words = "the second model cannot be assembled throughout"
    if math.isfinite(difference):
        words = f"the two models differ by {difference:.2f}′ at {_degrees(table_of(context).sweep.largest)}"
    if undecided:
        words += f"; tolerances undecided at {', '.join(map(_degrees, undecided))}"
    elif bounds:
        from graphsynth.systems.antenna.tolerance import outward_text

        worst = max(max(map(abs, side.deviation)) for _, found in bounds for side in (found.a, found.b))
        words += f"; tolerances move the beam by at most {outward_text(worst, 1, 2)[1:]}″ about either axis (certified)"
    return words, not undecided


def _structure_table(context: Context) -> Table:
    graph = antenna_of(context).graph()
    counts = {
        "links with the ground": graph.links,
        "joints": len(graph.joints),
        "mobility in space": graph.mobility,
        "independent loops": graph.loops,
        "loop equations": 6 * graph.loops,
        "passive coordinates": 6 * graph.loops,
    }
    rows = [(name, count, "exact") for name, count in counts.items()]
    note = "A universal joint counts as 2, a ball joint as 3, a crank pivot as 1. No link can spin about its own axis."
    return table("Structure", ("quantity", "value", "guarantee"), rows, note)


def _over_sweep(title: str, columns: dict[str, NDArray[Any]], note: str) -> Table:
    """Lay out some poses of the sweep; each column has all values of the sweep."""
    last = len(next(iter(columns.values()))) - 1
    picked = sorted({round(i * last / _ROWS) for i in range(_ROWS + 1)})
    return table(title, tuple(columns), zip(*(values[picked].tolist() for values in columns.values())), note)


def _sweep_table(motion: AntennaMotion, comparison: ModelComparison) -> Table:
    poses, ended = motion.path.poses, motion.path.message
    columns = {
        "cranks [°] | .6g": motion.phi,
        "elevation [°] | 12 .12g": poses.a,
        "azimuth [°] | 12 .12g": poses.b,
        "elevation − azimuth [′] | 10 .9g": poses.a - poses.b,
        "elevation, second model [°] | 12 .12g": comparison.a[1],
        "azimuth, second model [°] | 12 .12g": comparison.b[1],
        "difference of means [′]": np.array([f"{minutes:.9g}" for minutes in comparison.arcminutes]),
    }
    note = f"Closed form; rounding error about 1e-16 rad over the sines to the folds. {ended[:1].upper()}{ended[1:]}."
    return _over_sweep("Both cranks together, two models", columns, note)


def _conventions_table(context: Context) -> Table:
    """Compare other conventions and length errors: which of them could explain a difference that was seen."""
    antenna, largest = antenna_of(context), table_of(context).sweep.largest
    phi = largest * np.array([0.125, 0.25, 0.375, 0.5, 0.75, 1.0])
    swapped = antenna.other_order()
    cases: list[tuple[str, PointingMechanism, Convention]] = [
        (f"gimbal order {swapped.order}", swapped, Convention()),
        ("both cranks reversed", antenna, Convention(-1, -1)),
        ("crank of leg Y reversed", antenna, Convention(sense_y=-1)),
        ("crank of leg X reversed", antenna, Convention(sense_x=-1)),
        ("leg Y on the other side", antenna, Convention(side_y=-1)),
        ("tilt of the normal as output", antenna, Convention(output="normal")),
        ("rod of leg Y longer by 1 mm", replace(antenna, l2=antenna.l2 + 1e-3), Convention()),
        ("universal joints farther out by 0.5 mm", replace(antenna, l1=antenna.l1 + 5e-4), Convention()),
        ("crank of leg Y longer by 0.5 mm", replace(antenna, l3=antenna.l3 + 5e-4), Convention()),
    ]
    rows, here = [], antenna.poses(phi, phi)
    for name, other, reading in cases:
        minutes = antenna.compare(other, phi, other_reading=reading).arcminutes
        if name.endswith("reversed"):  # their outputs are counted positive in the direction in which the cranks turn
            there = antenna.poses(reading.sense_y * phi, reading.sense_x * phi)
            gap = reading.sense_y * there.a - here.a + reading.sense_x * there.b - here.b
            minutes = 0.5 * np.asarray(unit_in("[′]").from_si(gap))
        rows.append((name, *minutes))
    columns = ("change", *(f"{math.degrees(x):g}° | 3 .3f" for x in phi))
    note = (
        "Difference of the means of both angles, minutes of arc, closed form. Where a crank is reversed, its output is "
        "reversed back. Conventions differ as the third power of the angle or a higher one; lengths may show at once."
    )
    return table("What makes two models disagree", columns, rows, note)


def _tolerance_table(context: Context, bounds: Bounds) -> Table:
    rows: list[tuple[object, ...]] = []
    for phi, found in bounds:
        for name, side in (("elevation", found.a), ("azimuth", found.b)):
            if found.status:
                rows.append((phi, name, side.nominal, found.reason, "", "", ""))
                continue
            certified = " .. ".join(outward_text(value, end) for value, end in zip(side.deviation, (-1, 1)))
            corners = " .. ".join(f"{round(value, 4) + 0.0:+.4f}" for value in side.corner_deviation)
            first = f"±{unit_in('[″]').from_si(side.first_order):.4f}"
            # rounding of the corner values hides a smaller overestimation
            wide = f"{100 * side.excess:.1e} %" if side.excess > 1e-9 else "< 1e-7 %"
            rows.append(
                (phi, name, side.nominal, certified, corners, first, wide if math.isfinite(side.excess) else "")
            )
    columns = (
        "cranks [°] | g",
        "angle",
        "nominal [°] | 9 .9f",
        "certified [″]",
        "corners [″]",
        "first order [″]",
        "too wide by",
    )
    widths = ", ".join(
        f"{name.replace('_', ' ').replace('cardan', 'universal joints')} ±{unit_in('[mm]').from_si(w):g} mm"
        for name, w in zip(LENGTH_NAMES, widths_of(context))
    )
    note = (
        f"{widths}. Certified: mean-value form with outward rounding, for all lengths at once; corners: the extremes "
        "of the 32 corners (estimated, from inside); first order: sum of the derivatives."
    )
    return table("Effect of the tolerances", columns, rows, note)


def _modes_table(context: Context) -> Table:
    shown = table_of(context).shown
    found = antenna_of(context).solve(*shown)
    rows = [
        (
            f"({'+' if sy > 0 else '−'}, {'+' if sx > 0 else '−'})",
            found.a[k],
            found.b[k],
            "contains the rest pose" if (sy, sx) == (1, -1) else "",
        )
        for k, (sy, sx) in enumerate(found.signs)
        if found.distinct[k]
    ]
    angles = "φx = {}, φy = {}".format(*map(_degrees, shown))
    note = f"All {int(found.count)} at cranks {angles} (closed form: no other exists)."
    columns = ("signs (leg Y, leg X)", "elevation [°] | 9 .9f", "azimuth [°] | 9 .9f", "")
    return table("Assembly modes", columns, rows, note)


def _singular_table(singular: SingularPoses) -> Table:
    rows = []
    for fold in singular.folds + ((singular.sweep_fold,) if singular.sweep_fold else ()):
        words = f"C = {fold.coefficient:.9g} rad^½" if fold.order == 2 else "branches cross"
        rows.append((f"fold of leg {fold.leg}", fold.phi_x, fold.phi_y, fold.a, fold.b, words))
    for point in singular.dead_points:
        name = f"dead centre of leg {point.leg}"
        rows.append((name, point.phi_x, point.phi_y, point.a, point.b, f"crank {point.kind}"))
    note = (
        "Over a full rotation of one crank with the other at rest. At a fold two assembly modes meet and the angle "
        "moves like C times the square root of the distance; at a dead centre the reflector cannot drive the crank. "
        f"Cranks turned together up to 180°: {singular.sweep_message}."
    )
    angles = (f"{name} [°] | 9 .9f" for name in ("φx", "φy", "elevation", "azimuth"))
    return table("Folds and dead centres", ("what", *angles, ""), rows, note)


def _check_table(check: CrossCheck) -> Table:
    printed, corrected = check.charts
    survey = check.survey
    rows = (
        ("largest difference of an angle from the closed form", f"{check.difference:.1e} rad"),
        ("largest residual of the twelve equations", f"{check.residual:.1e}"),
        ("largest difference of a velocity, from the 12 × 12 Jacobian", f"{check.rates_difference:.1e}"),
        ("poses compared", str(check.phi.size)),
        ("rank at rest, equations as printed in the article", f"{printed.rank} of 12: {printed.verdict}"),
        (
            "rank at rest, corrected equations",
            f"{corrected.rank} of 12: {corrected.verdict}, condition {corrected.condition:.2f}",
        ),
        (
            f"random starts at {math.degrees(check.phi[-1]):g}°",
            f"{survey.starts}: {survey.genuine} genuine roots on {len(survey.modes)} of {check.modes} modes, "
            f"{survey.false} false orientations rejected, {survey.failed} without root",
        ),
    )
    note = "Newton's method from the rest pose with an analytic Jacobian; the closed form is not used."
    return table("The twelve loop equations, solved independently", ("", ""), rows, note)


def _unknowns_table(check: CrossCheck) -> Table:
    ends = (0, check.phi.size // 2, check.phi.size - 1)
    named = {1: "universal joint of leg Y", 3: "ball joint of leg Y", 6: "elevation"}
    named |= {7: "universal joint of leg X", 9: "ball joint of leg X", 12: "azimuth"}
    rows = ((f"x{i + 1} {named.get(i + 1, '')}".rstrip(), *(check.angles[k, i] for k in ends)) for i in range(12))
    columns = ("angle", *(f"at cranks {math.degrees(check.phi[k]):g}° [°] | 12 .12g" for k in ends))
    return table("The twelve unknowns", columns, rows, "Of the equations; the closed form gives the same.")
