"""Tables and charts from SI values: each column and each axis names its unit, and the conversion is done here alone.

A label ends with its unit in brackets, ``"crank [°]"``; behind a stroke a column says how its numbers are written, as a
format of Python, ``"crank [°] | .6g"``.  A ``z`` in it drops the sign of a zero; a number before it rounds to so
many decimals first, so that rounding noise at rest is written as zero: ``"tilt [°] | 9 .9f"``.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Sequence
from dataclasses import replace
from functools import lru_cache, partial
from typing import TYPE_CHECKING, Any, Literal

from graphsynth.pipeline.products import Finding, Picture, Quantity, Table
from graphsynth.pipeline.units import Unit, behind

if TYPE_CHECKING:
    from graphsynth.drawing.plots import Line
    from graphsynth.dynamics.driven.reduction import ReductionStudy
    from graphsynth.dynamics.driven.run import DriveRun
    from graphsynth.evidence.rows import Problem
    from graphsynth.kinematics.engine.result import Motion

_COLUMN = re.compile(r"(.*?)(?: \| (?:(\d+) )?(\S+))?")
_UNIT = re.compile(r".*\[([^\]]*)\]")

#: Ticks of an axis over one rotation, in the degrees of its label.
TURN = tuple(range(0, 361, 45))


@lru_cache
def unit_in(label: str) -> Unit:
    """Return the unit in the brackets of a label; a plain number if there are none.

    >>> unit_in("inertia [kg mm²]").from_si(2e-6)
    2.0
    """
    match = _UNIT.fullmatch(label)
    return Unit.parse(match[1] if match else "")


def shown(value: object, column: str) -> str:
    """Return a cell as text: an SI number in the unit of its column, anything else as it is; nothing for None.

    >>> shown(0.25, "height [mm]"), shown(-1e-17, "tilt [°] | 9 .3f"), shown(True, "agree"), shown(3, "sets")
    ('250', '0.000', 'yes', '3')
    """
    if value is None or isinstance(value, str):
        return value or ""
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, Quantity):
        return value.text
    match = _COLUMN.fullmatch(column)
    assert match is not None  # every text matches
    if isinstance(value, int) and not match[3]:
        return str(value)
    number = unit_in(match[1]).from_si(float(value))  # type: ignore[arg-type]
    if match[2]:
        number = round(number, int(match[2])) + 0.0
    return format(number, match[3] or ".6g")


def table(
    title: str, columns: Sequence[str], rows: Iterable[Iterable[object]], note: str = "", *findings: Finding
) -> Table:
    """Lay out SI values under the columns.

    >>> table("Poses", ("crank [°] | .4g", "pose"), [(0.5, "open")]).rows
    (('28.65', 'open'),)
    """
    cells = tuple(tuple(shown(value, column) for value, column in zip(row, columns, strict=True)) for row in rows)
    return Table(title, tuple(column.partition(" | ")[0] for column in columns), cells, note, findings)


def quantity_table(title: str, quantities: Iterable[Quantity], note: str = "", *findings: Finding) -> Table:
    """Lay out quantities, each with its guarantee and how far it may be off.

    >>> quantity_table("Motion", [Quantity("speed", 2.0, "rad/s", "estimated", 1e-9)]).rows
    (('speed', '2 rad/s', 'estimated', '1e-09 rad/s'),)
    """
    rows = [(q.name, q, q.guarantee, "" if q.error is None else f"{q.error:.1g}{behind(q.unit)}") for q in quantities]
    return table(title, ("quantity", "value", "guarantee", "error"), rows, note, *findings)


def chart(
    title: str,
    lines: Sequence[Line],
    x: str,
    y: str,
    caption: str = "",
    *,
    levels: Sequence[Line] = (),
    bands: Sequence[Any] = (),
    place: Literal["small", "normal", "wide"] = "normal",
    **options: Any,
) -> Picture:
    """Draw curves of SI values over one axis; what `graphsynth.drawing.plots.line_plot` takes more is passed on.

    Lines, levels and bands are in SI; the labels `x`, `y` of the axes name their units in brackets.
    """
    import numpy as np

    from graphsynth.drawing.plots import line_plot

    across, up = unit_in(x), unit_in(y)
    drawn = [replace(n, x=across.from_si(np.asarray(n.x)), y=up.from_si(np.asarray(n.y))) for n in lines]
    bands = [replace(band, start=across.from_si(band.start), stop=across.from_si(band.stop)) for band in bands]
    levels = [replace(level, y=up.from_si(level.y)) for level in levels]
    return Picture(title, line_plot(drawn, x, y, levels=levels, bands=bands, **options), caption, place)


def balance_rows(run: DriveRun) -> tuple[tuple[str, str], ...]:
    """Return model, method, errors, balances and cost of a run."""
    units = ("angle", "rad"), ("speed", "rad/s"), ("current", "A"), ("second current", "A")
    errors = ", ".join(f"{name} {value:.1e} {unit}" for (name, unit), value in zip(units, run.error))
    balanced = run.energy_error <= 1e-9 and run.electric_error <= 1e-9
    warning = "" if balanced or not run.complete else " (WARNING)"
    return (
        ("status", run.reason or "reached the last output time"),
        ("model", run.model),
        ("estimated error", f"{errors} (second run at a hundred times the tolerance)"),
        ("energy balance, mechanical", f"{run.energy_error:.1e} of the energy moved{warning}"),
        ("energy balance, electrical", f"{run.electric_error:.1e} of the energy moved{warning}"),
        ("steps", f"{run.steps}, {run.rejected} more rejected, at tolerance {run.rtol:g}"),
        ("time of the run", f"{run.seconds * 1e3:.1f} ms, measured once"),
        *(("note", note) for note in run.notes),
    )


def work_table(found: Problem) -> Table:
    """Error against run time where the settings are tolerances."""
    columns = ("method", "tolerance | .0e", "error | .1e", "time [ms] | .2f", "steps or calls | .0f", "status")
    costs = ((None if math.isnan(r.error) else r.error, r.seconds, r.more["steps or calls"]) for r in found.rows)
    rows = ((row.method, row.value, *cost, row.reason or "done") for row, cost in zip(found.rows, costs))
    return table("Error against run time", columns, rows, found.note)


def limit_table(study: ReductionStudy) -> Table:
    """Distance from the limit L -> 0 for each inductance."""
    rows = zip(study.inductance, study.angle, study.speed, (None, *study.order), map(str, study.steps))
    columns = ("inductance [H] | .0e", "angle [rad] | .3e", "speed [rad/s] | .3e", "order | .3f", "steps")
    note = "Largest differences from the motor with L = 0 after the electrical transient; the order is 1 in the limit."
    return table("The limit L → 0", columns, rows, note)


def shown_motion(mechanism: Any, inputs: Any, poses: Any, *, closed: bool) -> Motion:
    """Poses (n, links, 3) from a closed form as a motion to be animated; what a picture does not show is NaN.

    `inputs` (n,) are driver coordinates; `closed` says that the last pose is the first again.
    """
    import numpy as np

    from graphsynth.kinematics.engine.result import Closure, Motion

    missing, none = np.full_like(poses, np.nan), np.zeros((len(inputs), 0))
    closure = Closure(closed, closed, 0.0 if closed else math.nan, int(closed), (), "closed form")
    known = np.isfinite(poses).all(axis=(1, 2))
    motion = partial(Motion, mechanism, inputs, poses, missing, missing, none.astype(np.int8), none, known)
    return motion((), (), True, "", math.nan, closure, math.nan, 0.0)
