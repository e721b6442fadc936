"""Elementary functions of intervals: width of the enclosures and time of one value, against 50 digits."""

from __future__ import annotations

from functools import partial
from operator import methodcaller
from typing import Any

import flint
import mpmath
import numpy as np

from graphsynth.evidence.rows import Effort, Problem, Row, best_of
from graphsynth.intervals import Interval, atan, cos, exp, log, sin

FUNCTIONS: dict[str, Any] = {"sin": sin, "cos": cos, "exp": exp, "log": log, "atan": atan}


def _applied(name: str, x: Any) -> Any:
    """Apply a function to an array of intervals, or to one interval or ball after the other."""
    if isinstance(x, Interval):
        return FUNCTIONS[name](x)
    function = FUNCTIONS[name] if isinstance(x[0], Interval) else methodcaller(name)
    return [function(own) for own in x]


def _width(name: str, x: list[float], found: Any) -> float:
    """Return the largest relative width; NaN if a value in 50 digits lies outside."""
    worst = 0.0
    with mpmath.workdps(50):
        for at, own in zip(x, found):
            ends = (float(own.lo), float(own.hi)) if isinstance(own, Interval) else (own.lower(), own.upper())
            low, high = (mpmath.ldexp(*map(int, flint.arb(end).man_exp())) for end in ends)
            exact = getattr(mpmath, name)(mpmath.mpf(at))
            worst = max(worst, float((high - low) / abs(exact))) if low <= exact <= high else float("nan")
    return worst


def interval_functions(context: Any, effort: Effort) -> Problem:
    """Enclose sin, cos, exp, log and atan of points: the largest relative width, and the mean time of one value."""
    x, rows = np.random.default_rng(0).uniform(0.1, 10.0, 10_000), []
    few = x[:100].tolist()
    ways: Any = [("single intervals", [*map(Interval, few)]), ("python-flint, 53 bits", [*map(flint.arb, few)])]
    ways += [("arrays", Interval.from_bounds(x[:count], x[:count])) for count in (10, 100, 1000, 10_000)]
    for method, points in ways:
        found = {name: best_of(partial(_applied, name, points), effort) for name in FUNCTIONS}
        widths = [_width(name, few, ends) for name, (ends, *_) in found.items()]
        each = {f"{name}, ns": 1e9 * seconds / len(points) for name, (_, seconds, _) in found.items()}
        more: dict[str, Any] = {"kind": "largest relative width", "reference": "none needed; checked to hold 50 digits"}
        more |= {"more": each, "proved": True, "value": len(points)}
        setting = f"{len(points)} at once" if method == "arrays" else "one by one"
        why = "a value in 50 digits lies outside" if np.isnan(widths).any() else ""
        timed = 1e-9 * sum(each.values()) / len(each), found["sin"][2]
        rows.append(Row.of(method, setting, float(np.max(widths)), timed, why, **more))
    return Problem("interval-functions", "sin, cos, exp, log, atan of 0.1 to 10", "relative", tuple(rows), per="value")
