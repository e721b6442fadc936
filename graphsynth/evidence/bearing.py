"""Error against run time: crossings, areas and arc ends by every method, at every subdivision.

Each function returns rows ``(method, setting, error, seconds)``; `error_table` makes a table of them,
`graphsynth.drawing.jamming_pictures.error_time_picture` a log-log picture.  For a certified method the error is the
width of the enclosure; for one in double precision it is the distance from the exact value.  Seconds are the shortest
of a few runs, warm.  Measured figures: ``docs/explanation/bearing-jamming.md`` and ``circle-and-ellipse.md``.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from time import perf_counter
from typing import TYPE_CHECKING, NamedTuple, TypeVar

import numpy as np

from graphsynth.core.arguments import Count, Positive
from graphsynth.core.checks import checked
from graphsynth.core.errors import GeometryError
from graphsynth.jamming.bearing.bearing import Bearing, Condition
from graphsynth.jamming.bearing.parameters import Range, ToleranceBox

if TYPE_CHECKING:
    import pandas as pd

    from graphsynth.intervals import Interval
    from graphsynth.jamming.intersection import CircleEllipse

__all__ = ["WORST_SINE", "ErrorRow", "arc_errors", "area_errors", "crossing_errors", "error_table"]

#: ``0.4 sin(1/30)``: sine of the largest tilt of the source's linkage.
WORST_SINE = "0.01333086433470144655443037460446955080344"
_Result = TypeVar("_Result")


class ErrorRow(NamedTuple):
    """One run: method, its setting ("" if it has none), error in the unit of the question, seconds."""

    method: str
    setting: str
    error: float
    seconds: float


def _timed(run: Callable[[], _Result], repeats: int) -> tuple[_Result, float]:
    """Return the result of the last run and the shortest time."""
    run()  # compiled and loaded
    times = []
    for _ in range(repeats):
        begin = perf_counter()
        result = run()
        times.append(perf_counter() - begin)
    return result, min(times)


@checked
def crossing_errors(
    problem: CircleEllipse | None = None,
    boxes: Sequence[Count] = (30, 100, 200, 300, 400, 500, 2000, 20_000),
    *,
    general: bool = True,
    repeats: Count = 5,
) -> list[ErrorRow]:
    """Enclose the crossing of a circle and an ellipse: how much wider than the exact solution set, and how fast.

    Parameters
    ----------
    problem : CircleEllipse, optional
        By default the bearing of the source at its worst pose, without tolerances (its solution set is one point).
    boxes : sequence of int
        Limits on the boxes of Krawczyk's method; those beyond the end of the search are left out.
    general : bool
        With the general solver of `graphsynth.intervals` on the same equations (for a problem without tolerances).
    repeats : int
        Runs of each, the shortest counts.

    Returns
    -------
    list of ErrorRow
        Error: width of the enclosure minus that of the exact hull, the larger one of x and y, in the unit of the radii.

    Examples
    --------
    >>> rows = crossing_errors(boxes=(100, 500), general=False, repeats=1)
    >>> [row.method for row in rows], rows[0].error < 1e-14 < rows[1].error
    (['exact hull', 'Krawczyk boxes', 'Krawczyk boxes'], True)
    """
    from graphsynth.jamming.intersection import exact_hull, krawczyk_boxes, surrogate_problem

    given = surrogate_problem(Bearing(), WORST_SINE) if problem is None else problem
    hull, seconds = _timed(lambda: exact_hull(given), repeats)
    # two roundings outward for each coordinate: more than the hull can be too wide
    rounding = float((np.spacing(np.abs(hull.hull.lo)) + np.spacing(np.abs(hull.hull.hi))).max(initial=0.0))
    rows = [ErrorRow("exact hull", "", rounding, seconds)]
    for limit in boxes:
        found, seconds = _timed(lambda limit=limit: krawczyk_boxes(given, max_boxes=limit), repeats)  # type: ignore[misc]
        excess = _excess(found.outer, hull.hull, rounding)
        rows.append(ErrorRow("Krawczyk boxes", f"{found.tested} boxes", excess, seconds))
        if found.finished:
            break
    if general and given.e1.hi == 0 == given.e2.hi:
        paved, seconds = _timed(lambda: _paved(given), 1)
        rows.append(ErrorRow("general solver", "", _excess(paved, hull.hull, rounding), seconds))
    return rows


def _excess(found: Interval, hull: Interval, rounding: float) -> float:
    """Width beyond that of the exact hull, not below the rounding of the hull itself."""
    return max(float((found.width - hull.width).max()), rounding)


def _paved(problem: CircleEllipse) -> Interval:
    """Hull of what the general solver finds, from the equations alone."""
    from graphsynth.intervals import Interval, pave

    Q, a, b = (r.outward() for r in (problem.circle_bounds, problem.a, problem.b))
    alpha, beta, side = 1 / a.sqr(), 1 / b.sqr(), float(Q.sqrt().hi)
    found = pave(
        lambda z: [z[0] ** 2 + z[1] ** 2 - Q, z[0] ** 2 * alpha + z[1] ** 2 * beta - 1],
        Interval.from_bounds([0.0, 0.0], [side, side]),
    )
    return Interval.from_bounds(found.boxes.lo.min(axis=0), found.boxes.hi.max(axis=0))


@checked
def area_errors(
    bearing: Bearing | None = None,
    sine: str = WORST_SINE,
    counts: Sequence[Count] = (16, 64, 250, 1000, 4000),
    *,
    repeats: Count = 5,
) -> list[ErrorRow]:
    """Compute the free gap of the surrogate ellipse, which the source plots: how exactly, and how fast.

    Parameters
    ----------
    bearing : Bearing, optional
        That of the source by default; its dimensions are read as the decimals they print as.
    sine : str
        Sine of the tilt, a decimal; the curves must cross.
    counts : sequence of int
        Corners of the polygons and boxes of the interval shoelace sums.
    repeats : int
        Runs of each, the shortest counts.

    Returns
    -------
    list of ErrorRow
        Error in mm^2: width of an enclosure, else distance from the value to 50 digits.

    Raises
    ------
    GeometryError
        If circle and ellipse do not cross.

    Examples
    --------
    >>> rows = {row.method: row.error for row in area_errors(counts=(250,), repeats=1)}
    >>> rows["closed form, enclosed"] < 1e-12, rows["interval shoelace sum"] > 800
    (True, True)
    """
    from graphsynth.jamming.bearing.area_curve import crescent_boxes, interval_shoelace
    from graphsynth.jamming.bearing.areas import ellipse_circle, surrogate_areas
    from graphsynth.jamming.bearing.areas_enclosed import enclose_surrogate_areas

    bearing, S = bearing or Bearing(), Range.read("sine", sine).middle
    R, c, h = repr(bearing.Rb), repr(bearing.clearance), repr(bearing.h)
    C = math.sqrt((1.0 - S) * (1.0 + S))
    a, b = bearing.Rh, bearing.Rh * C - bearing.h * S
    if not 0.0 < b < bearing.Rb < a:
        raise GeometryError(f"sine = {sine}: circle and ellipse do not cross; give a tilt beyond the critical one")
    true = _exact_gap_area(R, c, h, sine)
    enclosed, seconds = _timed(lambda: enclose_surrogate_areas(R, c, h, sine).ellipse_only, repeats)
    rows = [ErrorRow("closed form, enclosed", "", float(enclosed.width), seconds)]
    formulas: list[tuple[str, str, Callable[[], float]]] = [
        ("closed form, doubles", "", lambda: float(surrogate_areas(bearing, S, C).ellipse_only)),
        ("direct formula, doubles", "", lambda: float(ellipse_circle(bearing.Rb, a, b).ellipse_only)),
    ]
    for count in counts:
        polygon = partial(_polygon, bearing.Rb, a, b, count)
        formulas.append(("polygon, doubles", f"{count} corners", polygon))
    for method, setting, run in formulas:
        value, seconds = _timed(run, repeats)
        rows.append(ErrorRow(method, setting, max(abs(value - true), math.ulp(true)), seconds))
    for count in counts:
        total, seconds = _timed(
            lambda count=count: interval_shoelace(crescent_boxes(bearing.Rb, a, b, count)) * 2,  # type: ignore[misc]
            repeats,
        )
        rows.append(ErrorRow("interval shoelace sum", f"{count} boxes", float(total.width), seconds))
    return rows


def _polygon(R: float, a: float, b: float, count: int) -> float:
    """Shoelace sum of points on both crescents of the ellipse outside the circle."""
    from graphsynth.jamming.bearing.area_curve import crescent_points

    x, y = crescent_points(R, a, b, count).T
    return float(np.sum(x * np.roll(y, -1) - np.roll(x, -1) * y))


def _exact_gap_area(R: str, c: str, h: str, sine: str) -> float:
    """Ellipse minus circle of the surrogate by the direct formula in 50 digits, rounded once.

    See theory/circle-and-ellipse 2.
    """
    import mpmath

    with mpmath.workdps(50):
        r, S = mpmath.mpf(R), mpmath.mpf(sine)
        a = r + mpmath.mpf(c)
        b = a * mpmath.sqrt((1 - S) * (1 + S)) - mpmath.mpf(h) * S
        x = a * mpmath.sqrt((r * r - b * b) / (a * a - b * b))
        y = b * mpmath.sqrt((a * a - r * r) / (a * a - b * b))
        return float(2 * (a * b * mpmath.atan2(a * y, b * x) - r * r * mpmath.atan2(y, x)))


@checked
def arc_errors(
    box: ToleranceBox | None = None,
    condition: Condition = "A",
    resolutions: Sequence[Positive] = (1e-1, 1e-2, 1e-4, 1e-6, 1e-9, 1e-12),
    samples: Sequence[Count] = (100, 1000, 10_000, 100_000),
    *,
    repeats: Count = 3,
) -> list[ErrorRow]:
    """Find where the bearing begins and ceases to jam: total length of what stays open in a turn, and how fast.

    Parameters
    ----------
    box : ToleranceBox, optional
        By default the linkage and bearing of the source without tolerances.  With tolerances the open length does not
        go to zero: part of the turn jams for some parameters and not for others.
    condition : {"A", "B", "general"}
        Contact condition.
    resolutions : sequence of float
        Of the sweep by interval kinematics, radians.
    samples : sequence of int
        Numbers of crank angles looked at in double precision; only without tolerances, as samples prove nothing.
    repeats : int
        Runs of each, the shortest counts.

    Returns
    -------
    list of ErrorRow
        Error in radians: total length of the undecided angles; for samples that of the steps with a change of sign.

    Examples
    --------
    >>> rows = arc_errors(resolutions=(1e-2,), samples=(100,), repeats=1)
    >>> [row.method for row in rows], rows[0].error < 1e-13
    (['closed form, enclosed', 'interval sweep', 'samples, doubles'], True)
    """
    from graphsynth.jamming.bearing.arcs import total_length
    from graphsynth.jamming.bearing.certify import certify_jamming
    from graphsynth.jamming.bearing.sweep import sweep_linkage

    given = ToleranceBox(alpha="1/30") if box is None else box
    found, seconds = _timed(lambda: certify_jamming(given, condition), repeats)
    open_ = total_length(found.arcs.undecided)
    rows = [ErrorRow("closed form, enclosed", "", open_, seconds)]
    for resolution in resolutions:
        swept, seconds = _timed(
            lambda resolution=resolution: sweep_linkage(given, condition, resolution=resolution),  # type: ignore[misc]
            repeats,
        )
        rows.append(ErrorRow("interval sweep", f"{resolution:g} rad", math.tau * swept.undecided_part, seconds))
    for count in samples if given.is_point else ():
        changes, seconds = _timed(lambda count=count: _sign_changes(given, condition, count), repeats)  # type: ignore[misc]
        rows.append(ErrorRow("samples, doubles", f"{count} angles", changes * math.tau / count, seconds))
    return rows


def _sign_changes(box: ToleranceBox, condition: Condition, count: int) -> int:
    linkage, bearing = box.nominal()
    path = linkage.positions(np.linspace(0.0, math.tau, count + 1))
    jams = bearing.gap(path.sin_theta, path.cos_theta, condition) > 0.0
    return int((jams[1:] != jams[:-1]).sum())


@checked
def error_table(groups: Mapping[str, Sequence[ErrorRow]]) -> pd.DataFrame:
    """Return rows of several questions as one table: question, method, setting, error, seconds.

    Parameters
    ----------
    groups : mapping of str to sequence of ErrorRow
        Question to its rows.

    Returns
    -------
    pandas.DataFrame

    Examples
    --------
    >>> error_table({"arc ends [rad]": [ErrorRow("sweep", "0.1 rad", 0.02, 0.003)]}).columns.tolist()
    ['question', 'method', 'setting', 'error', 'seconds']
    """
    import pandas as pd

    rows = [(question, *row) for question, part in groups.items() for row in part]
    return pd.DataFrame(rows, columns=["question", *ErrorRow._fields])
