"""Crossings and areas of circle and ellipse: every method beside closed forms and quadrature in 50 digits.

Whatever proves an enclosure is asked whether it holds the 50-digit value: one that does not is a failure, however
narrow.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from functools import partial
from inspect import signature
from typing import Any

import mpmath
import numpy as np

from graphsynth.core.errors import GeometryError
from graphsynth.evidence.rows import Effort, Problem, Row, best_of
from graphsynth.intervals import Interval, pave
from graphsynth.jamming.bearing.areas import ellipse_circle, surrogate_areas
from graphsynth.jamming.bearing.areas_enclosed import enclose_surrogate_areas
from graphsynth.jamming.bearing.bearing import Bearing
from graphsynth.jamming.intersection.boxes import krawczyk_boxes
from graphsynth.jamming.intersection.hull import CircleEllipse, exact_hull, surrogate_problem
from graphsynth.jamming.intersection.readings import crescent_boxes, crescent_points, interval_shoelace

_DIGITS = 50
#: Parts of the search by boxes after which it is stopped.
_PARTS = (0.3, 0.6, 0.75, 0.85, 0.92, 0.97)


def precise_crossing(problem: CircleEllipse) -> tuple[Any, Any]:
    """Crossing in the first quadrant with 50 digits, from the radii as they are; `GeometryError` if there is none."""
    with mpmath.workdps(_DIGITS):
        R, a, b = (mpmath.mpf(r.lo.numerator) / r.lo.denominator for r in (problem.R1, problem.a, problem.b))
        if not b < R < a:
            raise GeometryError("circle and ellipse do not cross at this tilt; give one beyond the critical tilt")
        x = a * mpmath.sqrt((R * R - b * b) / (a * a - b * b))
        y = b * mpmath.sqrt((a * a - R * R) / (a * a - b * b))
        return x, y


def crossing_problem(bearing: Bearing, sine: str, effort: Effort | None = None) -> Problem:
    """Enclose the crossing of the circle and the ellipse of a tilted bearing.

    Parameters
    ----------
    bearing : Bearing
    sine : str
        Sine of the tilt, a decimal; the curves must cross.
    effort : Effort, optional

    Returns
    -------
    Problem
        Error and time of every method.

    Raises
    ------
    GeometryError
        If the curves do not cross.

    Examples
    --------
    >>> from graphsynth.jamming import Bearing
    >>> problem = crossing_problem(Bearing(), "0.0133308643347", Effort(rounds=1, quick=True))
    >>> problem.methods, problem.rows[0].status.value
    (('exact hull', 'Krawczyk boxes'), 'ok')
    """
    effort = effort or Effort()
    given = surrogate_problem(bearing, sine)
    truth = precise_crossing(given)
    hull, row = _hull_row(given, truth, effort)
    rows = [row]
    limit = signature(krawczyk_boxes).parameters["max_boxes"].default
    whole = krawczyk_boxes(given).tested
    for boxes in effort.some((*(max(1, round(part * whole)) for part in _PARTS), limit)):
        found, *timed = best_of(partial(krawczyk_boxes, given, max_boxes=boxes), effort)
        # a search that ends by itself is what the default limit gives
        ended = bool(found.finished) or boxes == limit
        setting = f"{found.tested} boxes"
        rows.append(_enclosed("Krawczyk boxes", setting, found.outer, hull, truth, timed, default=ended))
        if found.finished:
            break
    for boxes in () if effort.quick else (100, 300, 3000):
        paved, *timed = best_of(partial(_paved, given, boxes), Effort(1), warm=False)
        rows.append(_enclosed("general solver", f"up to {boxes} boxes", paved, hull, truth, timed))
    question = f"Where circle and ellipse of the bearing cross at the tilt asin({float(sine):.6g})"
    note = "A limit on the number of boxes stops the search early; the enclosure is then valid, but wider."
    return Problem("crossing", question, "mm", tuple(rows), note=note)


def _hull_row(problem: CircleEllipse, truth: tuple[Any, Any], effort: Effort) -> tuple[Interval, Row]:
    """Exact hull against 50 digits: its width, and whether it holds the crossing."""
    found, *timed = best_of(lambda: exact_hull(problem), effort)
    why = "" if _holds(found.hull, *truth) else "the hull does not hold the crossing"
    more = {"kind": "width of the enclosure", "reference": f"closed form with {_DIGITS} digits", "proved": True}
    return found.hull, Row.of("exact hull", "", float(found.hull.width.max()), timed, why, **more)


def _holds(found: Interval, *truth: Any) -> bool:
    """Whether an enclosure holds the numbers, of any precision: compared exactly; of one number, every enclosure."""
    low, high = np.atleast_1d(found.lo), np.atleast_1d(found.hi)
    values = truth if len(truth) > 1 else truth * len(low)
    return all(float(a) <= value <= float(b) for a, b, value in zip(low, high, values, strict=True))


def _enclosed(
    method: str,
    setting: str,
    found: Interval,
    hull: Interval,
    truth: tuple[Any, Any],
    timed: Sequence[float],
    **more: Any,
) -> Row:
    """Row of an enclosure of the crossing: how much wider than the exact hull, and whether it holds the crossing."""
    # two roundings outward for each coordinate: more than the hull can be too wide
    rounding = float((np.spacing(np.abs(hull.lo)) + np.spacing(np.abs(hull.hi))).max(initial=0.0))
    excess = max(float((found.width - hull.width).max()), rounding)
    # the search begins with a square over the quarter circle: an enclosure of its size is no result
    radius = float(np.hypot(*hull.hi))
    why = f"{setting} leave the whole start box" if float(found.width.max()) > 0.99 * radius else ""
    why = why if _holds(found, *truth) else "the enclosure does not hold the crossing"
    more["kind"] = "width of the enclosure beyond the exact hull"
    more["reference"] = f"exact hull, rational arithmetic; checked to hold the crossing with {_DIGITS} digits"
    return Row.of(method, setting, excess, timed, why, proved=True, **more)


def _paved(problem: CircleEllipse, boxes: int) -> Interval:
    """Hull of what the general solver leaves, from the equations alone."""
    Q, a, b = (r.outward() for r in (problem.circle_bounds, problem.a, problem.b))
    alpha, beta, side = 1 / a.sqr(), 1 / b.sqr(), float(Q.sqrt().hi)
    found = pave(
        lambda z: [z[0] ** 2 + z[1] ** 2 - Q, z[0] ** 2 * alpha + z[1] ** 2 * beta - 1],
        Interval.from_bounds([0.0, 0.0], [side, side]),
        max_boxes=boxes,
    )
    return Interval.from_bounds(found.boxes.lo.min(axis=0), found.boxes.hi.max(axis=0))


def precise_area(bearing: Bearing, sine: str) -> Any:
    """Part of the ellipse outside the circle, mm², with 50 digits: quadrature in polar coordinates, no area formula.

    Between the crossings the radius of the ellipse is ``r(t)^2 = a^2 b^2 / (b^2 cos^2 t + a^2 sin^2 t)``, and the area
    is ``2 int (r^2 - R^2) dt`` up to the crossing; without one a `GeometryError` is raised.

    Examples
    --------
    >>> from graphsynth.jamming import Bearing
    >>> worst = "0.01333086433470144655443037446460955080344"  # 0.4 sin(1/30)
    >>> round(float(precise_area(Bearing(), worst)), 16)  # docs/explanation/errata.md
    0.9749683652811658
    """
    with mpmath.workdps(_DIGITS):
        R, S = mpmath.mpf(repr(bearing.Rb)), mpmath.mpf(sine)
        a = R + mpmath.mpf(repr(bearing.clearance))
        b = a * mpmath.sqrt((1 - S) * (1 + S)) - mpmath.mpf(repr(bearing.h)) * S
        if not 0 < b < R < a:
            raise GeometryError(f"sine = {sine}: circle and ellipse do not cross; give a tilt beyond the critical one")
        x, y = precise_crossing(surrogate_problem(bearing, sine))

        def beyond(t: Any) -> Any:
            return (a * b) ** 2 / ((b * mpmath.cos(t)) ** 2 + (a * mpmath.sin(t)) ** 2) - R * R

        return 2 * mpmath.quad(beyond, [0, mpmath.atan2(y, x)])


def area_problem(bearing: Bearing, sine: str, effort: Effort | None = None) -> Problem:
    """Compute the free gap of the surrogate ellipse.

    Parameters
    ----------
    bearing : Bearing
    sine : str
        Sine of the tilt, exact text.
    effort : Effort, optional

    Returns
    -------
    Problem
        Error and time of every method; errors as for `crossing_problem`.

    Examples
    --------
    >>> from graphsynth.jamming import Bearing
    >>> len(area_problem(Bearing(), "0.0133308643347", Effort(rounds=1, quick=True)).methods)
    5
    """
    effort = effort or Effort()
    truth = precise_area(bearing, sine)
    S, R, one = float(sine), bearing.Rb, Interval(sine)
    C, a = math.sqrt((1.0 - S) * (1.0 + S)), bearing.Rh
    b = a * C - bearing.h * S

    def enclosed(n: int) -> Callable[[], Interval]:
        low, high = (np.full(n, float(end)) for end in (one.lo, one.hi))
        given: Any = sine if n == 1 else Interval.from_bounds(low, high)
        sizes = repr(R), repr(bearing.clearance), repr(bearing.h)
        return lambda: enclose_surrogate_areas(*sizes, given).ellipse_only

    def stable(n: int) -> Callable[[], Any]:
        sines, cosines = np.full(n, S), np.full(n, C)
        return lambda: surrogate_areas(bearing, sines, cosines).ellipse_only

    def direct(n: int) -> Callable[[], Any]:
        radii = [np.full(n, radius) for radius in (R, a, b)]
        return lambda: ellipse_circle(*radii).ellipse_only

    def polygon(n: int) -> Callable[[], float]:
        def run() -> float:
            """Shoelace sum of points on both crescents of the ellipse outside the circle."""
            x, y = crescent_points(R, a, b, n).T
            return float(np.sum(x * np.roll(y, -1) - np.roll(x, -1) * y))

        return run

    def shoelace(n: int) -> Callable[[], Interval]:
        return lambda: interval_shoelace(crescent_boxes(R, a, b, n)) * 2

    many = (1, 10, 100) if effort.quick else (1, 100, 10_000)
    corners = effort.some((16, 64, 250, 1000, 4000))
    rows = []
    for method, unit, made, sizes in (
        ("closed form, enclosed", "at once", enclosed, (1, 10, 100)),
        ("closed form, double precision", "at once", stable, many),
        ("direct formula, double precision", "at once", direct, many),
        ("polygon, double precision", "corners", polygon, corners),
        ("interval shoelace sum", "boxes", shoelace, corners),
    ):
        for n in sizes:
            found, *timed = best_of(made(n), effort)
            share = n if unit == "at once" else 1
            rows.append(_area_row(method, f"{n} {unit}", found, truth, timed, many=share))
    question = f"Area between bearing and hole of the source's figure at the tilt asin({S:.6g})"
    return Problem("areas", question, "mm²", tuple(rows), "area")


def _area_row(method: str, setting: str, found: Any, truth: Any, timed: Sequence[float], **more: Any) -> Row:
    """Row of areas: an enclosure must hold the reference, and say more than that there is an area."""
    reference = f"quadrature in polar coordinates with {_DIGITS} digits"
    if not isinstance(found, Interval):
        error = max(float(abs(truth - value)) for value in {float(v) for v in np.atleast_1d(found)})
        error = max(error, math.ulp(float(truth)) / 2)
        return Row.of(method, setting, error, timed, reference=reference, **more)
    width = float(np.max(found.width))
    why = "" if width < float(truth) else f"the enclosure is wider than the area itself, {float(truth):.3g} mm²"
    why = why if _holds(found, truth) else "the enclosure does not hold the area"
    more |= {"kind": "width of the enclosure", "reference": f"none needed; checked to hold the {reference}"}
    return Row.of(method, setting, width, timed, why, proved=True, **more)
