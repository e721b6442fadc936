"""What is said about the antenna of a scene: the verdict, and a table for every question."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from graphsynth.pipeline.motor_tables import quantity_table
from graphsynth.pipeline.products import Quantity, Record, Table, exact
from graphsynth.pipeline.stages import Context
from graphsynth.systems.antenna.stages import (
    LENGTH_NAMES,
    AntennaMotion,
    SecondWay,
    SingularPoses,
    antenna_of,
    table_of,
    widths_of,
)

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from graphsynth.systems.antenna import ModelComparison, PointingMechanism, Reading, Tolerance

__all__ = ["judge"]

_ROWS = 8
_ROUNDING = 4.0 * 2.0**-52
_DEGREE, _MINUTE = math.degrees(1.0), 60.0 * math.degrees(1.0)


def judge(
    context: Context,
    motion: AntennaMotion,
    comparison: ModelComparison,
    second: SecondWay | None,
    singular: SingularPoses,
    bounds: tuple[tuple[float, Tolerance], ...],
) -> tuple[tuple[Record, ...], tuple[Table, ...]]:
    """Give the verdict and the tables."""
    margins = _margins(context, motion, comparison, bounds)
    record = _verdict(context, motion, comparison, bounds, margins)
    tables = [
        quantity_table("What the scene asks", margins, "Angles are of the closed form, bounds proved by intervals."),
        _structure_table(context),
        _sweep_table(motion, comparison),
        _conventions_table(context),
        _tolerance_table(context, bounds),
        _rates_table(motion),
        _modes_table(context),
        _singular_table(singular),
    ]
    if second is not None:
        tables += [_second_way_table(second), _unknowns_table(second)]
    return (record,), tuple(tables)


def _deg(value: float, digits: int = 12) -> str:
    """Degrees with so many significant digits, and no more than twelve decimals: rounding noise at rest is zero."""
    return f"{round(math.degrees(value), 12) + 0.0:.{digits}g}"


def _fixed(value: float) -> str:
    """Degrees with nine decimals, without the sign of a zero."""
    return f"{round(math.degrees(value), 9) + 0.0:.9f}"


def _seconds(pair: tuple[float, float]) -> str:
    low, high = (round(value, 4) + 0.0 for value in pair)
    return f"{low:+.4f} .. {high:+.4f}"


def _every(count: int, rows: int = _ROWS) -> list[int]:
    return sorted({round(i * (count - 1) / rows) for i in range(rows + 1)})


def _pose_error(motion: AntennaMotion, k: int) -> float:
    """Estimate the rounding error of both angles, radians."""
    poses = motion.path.poses
    return _ROUNDING / float(poses.margin_y[k] * poses.margin_x[k])


def _margins(
    context: Context,
    motion: AntennaMotion,
    comparison: ModelComparison,
    bounds: tuple[tuple[float, Tolerance], ...],
) -> tuple[Quantity, ...]:
    import numpy as np

    table = table_of(context)
    poses, last, ends = motion.path.poses, motion.phi.size - 1, f"at {table.sweep.largest_deg:g}°"
    found = []
    if motion.path.reached[last]:
        error = _pose_error(motion, last)
        found += [
            Quantity(f"elevation {ends}", float(poses.a[last]) * _DEGREE, "°", "estimated", error * _DEGREE),
            Quantity(f"azimuth {ends}", float(poses.b[last]) * _DEGREE, "°", "estimated", error * _DEGREE),
            Quantity(
                f"separation of the two {ends}", float(poses.a[last] - poses.b[last]) * _MINUTE, "′", "estimated",
                2.0 * error * _MINUTE,
            ),
        ]  # fmt: skip
        for name, degrees in ((ends, table.sweep.largest_deg), (f"at {table.sweep.working_deg:g}°", None)):
            at = math.radians(table.sweep.working_deg if degrees is None else degrees)
            value = float(np.interp(at, motion.phi, comparison.arcminutes))
            if degrees is None and not np.isclose(motion.phi, at, rtol=0, atol=1e-12).any():
                continue  # only what was computed is said
            if math.isfinite(value):
                found.append(
                    Quantity(f"difference of the two models {name}", value, "′", "estimated", 4.0 * error * _MINUTE)
                )
    for degrees, tolerance in reversed(bounds):  # the widest turn first
        for name, side in (("elevation", tolerance.a), ("azimuth", tolerance.b)):
            worst = max(map(abs, side.deviation))
            if math.isfinite(worst):
                found.append(Quantity(f"largest deviation of the {name} at {degrees:g}°", worst, "″", "certified"))
    return tuple(found)


def _verdict(
    context: Context,
    motion: AntennaMotion,
    comparison: ModelComparison,
    bounds: tuple[tuple[float, Tolerance], ...],
    margins: tuple[Quantity, ...],
) -> Record:
    if not motion.path.reached.all():
        return Record(
            recognised_as="pointing mechanism", verdict=motion.path.message, good=False, margins=margins
        )  # fmt: skip
    undecided = [degrees for degrees, found in bounds if found.status]
    difference = float(comparison.arcminutes[-1])
    words = "the second model cannot be assembled throughout"
    if math.isfinite(difference):
        words = f"the two models differ by {difference:.2f}′ at {table_of(context).sweep.largest_deg:g}°"
    if undecided:
        words += f"; tolerances undecided at {', '.join(f'{x:g}°' for x in undecided)}"
    elif bounds:
        from graphsynth.systems.antenna.tolerance import outward_text

        worst = max(max(map(abs, side.deviation)) for _, found in bounds for side in (found.a, found.b))
        words += f"; tolerances move the beam by at most {outward_text(worst, 1, 2)[1:]}″ about either axis (certified)"
    return Record(recognised_as="pointing mechanism", verdict=words, good=not undecided, margins=margins)


def _structure_table(context: Context) -> Table:
    graph = antenna_of(context).graph()
    quantities = (
        exact("links with the ground", graph.links), exact("joints", len(graph.joints)),
        exact("mobility in space", graph.mobility), exact("independent loops", graph.loops),
        exact("loop equations", 6 * graph.loops), exact("passive coordinates", 6 * graph.loops),
    )  # fmt: skip
    note = "A universal joint counts as 2, a ball joint as 3, a crank pivot as 1. No link can spin about its own axis."
    return Table(
        "Structure", ("quantity", "value", "how had"), tuple((q.name, q.text, q.guarantee) for q in quantities), note
    )


def _sweep_table(motion: AntennaMotion, comparison: ModelComparison) -> Table:
    poses = motion.path.poses
    rows = tuple(
        (
            f"{math.degrees(motion.phi[k]):.6g}",
            *(_deg(x[k]) for x in (poses.a, poses.b)),
            f"{round(_MINUTE * float(poses.a[k] - poses.b[k]), 10) + 0.0:.9g}",
            *(_deg(x[1, k]) for x in (comparison.a, comparison.b)),
            f"{comparison.arcminutes[k]:.9g}",
        )
        for k in _every(motion.phi.size)
    )  # fmt: skip
    columns = (
        "cranks [°]", "elevation [°]", "azimuth [°]", "elevation − azimuth [′]", "elevation, second model [°]",
        "azimuth, second model [°]", "difference of means [′]",
    )  # fmt: skip
    ended = motion.path.message
    note = f"Closed form; rounding error about 1e-16 rad over the sines to the folds. {ended[:1].upper()}{ended[1:]}."
    return Table("Both cranks together, two models", columns, rows, note)


def _conventions_table(context: Context) -> Table:
    """Say what other conventions and length errors would do: which of them could explain a difference that was seen."""
    from dataclasses import replace

    import numpy as np

    from graphsynth.systems.antenna import Reading

    antenna, largest = antenna_of(context), math.radians(table_of(context).sweep.largest_deg)
    phi = largest * np.array([0.125, 0.25, 0.375, 0.5, 0.75, 1.0])
    swapped = replace(antenna, order="XY" if antenna.order == "YX" else "YX")
    cases: list[tuple[str, PointingMechanism, Reading]] = [
        (f"gimbal order {swapped.order}", swapped, Reading()),
        ("both cranks reversed", antenna, Reading(-1, -1)),
        ("crank of leg Y reversed", antenna, Reading(sense_y=-1)),
        ("crank of leg X reversed", antenna, Reading(sense_x=-1)),
        ("leg Y on the other side", antenna, Reading(side_y=-1)),
        ("tilt of the normal read", antenna, Reading(output="normal")),
        ("rod of leg Y longer by 1 mm", replace(antenna, l2=antenna.l2 + 1e-3), Reading()),
        ("cardans farther by 0.5 mm", replace(antenna, l1=antenna.l1 + 5e-4), Reading()),
        ("crank of leg Y longer by 0.5 mm", replace(antenna, l3=antenna.l3 + 5e-4), Reading()),
    ]
    rows = []
    for name, other, reading in cases:
        minutes = antenna.compare(other, phi, other_reading=reading).arcminutes
        if name == "both cranks reversed" or name.endswith("reversed"):
            minutes = _sizes(antenna, phi, reading)
        rows.append((name, *(f"{round(float(x), 3) + 0.0:.3f}" for x in minutes)))
    columns = ("change", *(f"{math.degrees(x):g}°" for x in phi))
    note = (
        "Difference of the means of both angles, minutes of arc, closed form. Of reversed cranks the outputs are "
        "reversed back. Conventions grow with the third power of the angle or faster; length errors show at once."
    )
    return Table("What makes two models disagree", columns, tuple(rows), note)


def _sizes(antenna: PointingMechanism, phi: NDArray[np.float64], reading: Reading) -> NDArray[np.float64]:
    """Difference of means if reversed cranks are counted positive in the direction they turn."""
    import numpy as np

    here, there = antenna.poses(phi, phi), antenna.poses(reading.sense_y * phi, reading.sense_x * phi)
    gap = reading.sense_y * there.a - here.a + reading.sense_x * there.b - here.b
    return np.asarray(0.5 * gap * _MINUTE)


def _tolerance_table(context: Context, bounds: tuple[tuple[float, Tolerance], ...]) -> Table:
    from graphsynth.systems.antenna.tolerance import outward_text

    rows = []
    for degrees, found in bounds:
        for name, side in (("elevation", found.a), ("azimuth", found.b)):
            if found.status:
                rows.append((f"{degrees:g}", name, _fixed(side.nominal), found.reason, "", "", ""))
                continue
            certified, corners = side.deviation, side.corner_deviation
            first = side.first_order * 3600.0 * _DEGREE
            excess = _excess(side.excess)
            rows.append(
                (
                    f"{degrees:g}", name, _fixed(side.nominal),
                    " .. ".join(outward_text(value, end) for value, end in zip(certified, (-1, 1))), _seconds(corners),
                    f"±{first:.4f}", excess,
                )
            )  # fmt: skip
    columns = (
        "cranks [°]", "angle", "nominal [°]", "certified [″]", "corners [″]", "first order [″]", "too wide by",
    )  # fmt: skip
    widths = ", ".join(
        f"{name.removesuffix('_mm').replace('_', ' ')} ±{1e3 * w:g} mm"
        for name, w in zip(LENGTH_NAMES, widths_of(context))
    )
    note = (
        f"{widths}. Certified: mean-value form with outward rounding, for all lengths at once; corners: the extremes "
        "of the 32 corners (estimated, from inside); first order: sum of the derivatives."
    )
    return Table("What tolerances cost", columns, tuple(rows), note)


def _excess(excess: float) -> str:
    """Overestimation in per cent; below the rounding of the corner values it cannot be told."""
    if not math.isfinite(excess):
        return ""
    return f"{100 * excess:.1e} %" if excess > 1e-9 else "< 1e-7 %"


def _rates_table(motion: AntennaMotion) -> Table:
    jacobian = motion.rates.jacobian
    rows = tuple(
        (f"{math.degrees(motion.phi[k]):.6g}", *(f"{round(float(x), 14) + 0.0:.12g}" for x in jacobian[k].ravel()))
        for k in _every(motion.phi.size)
    )
    columns = ("cranks [°]", "∂elevation/∂φx", "∂elevation/∂φy", "∂azimuth/∂φx", "∂azimuth/∂φy")
    return Table("Velocities of the reflector by those of the cranks", columns, rows, "Closed form; no unit.")


def _modes_table(context: Context) -> Table:
    shown = table_of(context).shown_deg
    found = antenna_of(context).solve(*(math.radians(x) for x in shown))
    rows = tuple(
        (
            f"({'+' if sy > 0 else '−'}, {'+' if sx > 0 else '−'})",
            _fixed(found.a[k]), _fixed(found.b[k]),
            "the rest pose lies on it" if (sy, sx) == (1, -1) else "",
        )
        for k, (sy, sx) in enumerate(found.signs)
        if found.distinct[k]
    )  # fmt: skip
    note = f"All {int(found.count)} at cranks φx = {shown[0]:g}°, φy = {shown[1]:g}° (closed form: no other exists)."
    return Table("Assembly modes", ("signs (leg Y, leg X)", "elevation [°]", "azimuth [°]", ""), rows, note)


def _singular_table(singular: SingularPoses) -> Table:
    rows = [
        (
            f"fold of leg {fold.leg}", _fixed(fold.phi_x), _fixed(fold.phi_y),
            _fixed(fold.a), _fixed(fold.b),
            f"C = {fold.coefficient:.9g} rad^½" if fold.order == 2 else "branches cross",
        )
        for fold in singular.folds + ((singular.sweep_fold,) if singular.sweep_fold else ())
    ]  # fmt: skip
    rows += [
        (
            f"dead point of leg {point.leg}", _fixed(point.phi_x), _fixed(point.phi_y),
            _fixed(point.a), _fixed(point.b), f"crank {point.kind}",
        )
        for point in singular.dead_points
    ]  # fmt: skip
    note = (
        "Over a full turn of one crank with the other at rest. At a fold two assembly modes meet and the angle moves "
        "like C times the square root of the distance; at a dead point the reflector cannot drive the crank. Cranks "
        f"turned together up to 180°: {singular.sweep_message}."
    )
    return Table(
        "Folds and dead points", ("what", "φx [°]", "φy [°]", "elevation [°]", "azimuth [°]", ""), tuple(rows), note
    )


def _second_way_table(second: SecondWay) -> Table:
    printed, corrected = second.charts
    survey = second.survey
    rows = (
        ("largest difference of an angle from the closed form", f"{second.difference:.1e} rad"),
        ("largest residual of the twelve equations", f"{second.residual:.1e}"),
        ("largest difference of a velocity, from the 12 × 12 Jacobian", f"{second.rates_difference:.1e}"),
        ("poses compared", str(second.phi.size)),
        ("rank at rest, equations as printed in the article", f"{printed.rank} of 12: {printed.verdict}"),
        (
            "rank at rest, corrected equations",
            f"{corrected.rank} of 12: {corrected.verdict}, condition {corrected.condition:.2f}",
        ),
        (
            f"random starts at {math.degrees(second.phi[-1]):g}°",
            f"{survey.starts}: {survey.genuine} genuine roots on {len(survey.modes)} of {second.modes} modes, "
            f"{survey.false} false orientations rejected, {survey.failed} without root",
        ),
    )  # fmt: skip
    note = "Newton's method from the rest pose with an analytic Jacobian; the closed form is not used."
    return Table("The twelve loop equations, solved independently", ("", ""), rows, note)


def _unknowns_table(second: SecondWay) -> Table:
    ends = (0, second.phi.size // 2, second.phi.size - 1)
    names = (
        "x1 cardan of leg Y", "x2", "x3 ball joint of leg Y", "x4", "x5", "x6 elevation", "x7 cardan of leg X", "x8",
        "x9 ball joint of leg X", "x10", "x11", "x12 azimuth",
    )  # fmt: skip
    rows = tuple((name, *(_deg(second.angles[k, i]) for k in ends)) for i, name in enumerate(names))
    columns = ("angle [°]", *(f"cranks {math.degrees(second.phi[k]):g}°" for k in ends))
    return Table("The twelve unknowns", columns, rows, "Of the equations; equal to the closed form as said above.")
