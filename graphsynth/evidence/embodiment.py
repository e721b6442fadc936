"""The search for dimensions: error against run time, where the best dimensions are known.

A search is random: rows of one setting are several seeds, of which the median counts.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import cache
from inspect import signature
from statistics import median
from time import perf_counter
from typing import Any

import mpmath
import numpy as np

from graphsynth.evidence.rows import Effort, Problem, Row
from graphsynth.kinematics.dimensional.api import embody
from graphsynth.kinematics.dimensional.goals import Goals, LineGoal, PathGoal
from graphsynth.mechanism.four_bar import TiltedFourBar
from graphsynth.structure.graph import MechanismGraph


@cache
def precise_strip() -> float:
    """Width of the strip of Chebyshev's lambda linkage over the length of its segment, from the closed form.

    With frame 2, crank 1 and all other bars 5/2 the traced point is ``M = C + sqrt(4 b^2 / D^2 - 1) (A - C) turned by a
    right angle``; its height over the working half turn is maximised with 50 digits.  The segment is four cranks long.

    Examples
    --------
    >>> round(precise_strip() * 4, 7)
    0.0097537
    """
    with mpmath.workdps(50):
        b = mpmath.mpf(5) / 2

        def height(f: Any) -> Any:
            away = mpmath.expj(f) - 2
            return (2 - 1j * mpmath.sqrt(4 * b * b / abs(away) ** 2 - 1) * away).imag

        at = mpmath.findroot(lambda f: mpmath.diff(height, f), mpmath.radians(128.7))
        return float((height(at) - height(mpmath.pi / 2)) / 4)


def _rows(
    goals: Goals, settings: tuple[tuple[float, int], ...], seeds: int, error: Any, kind: str, reference: str
) -> tuple[Row, ...]:
    """One row for each effort and number of tries; a seed without an acceptable result is infinitely wrong."""
    graph = MechanismGraph(4, [(0, 1), (1, 2), (2, 3), (0, 3)], frame=0)
    embody(graph)  # compiled and loaded
    given = signature(embody).parameters
    default = given["effort"].default, given["tries"].default
    rows = []
    for effort, tries in settings:

        def once(seed: int, effort: float = effort, tries: int = tries) -> tuple[float, str]:
            found = embody(graph, goals, seed, driver=1, tries=tries, effort=effort)
            return (error(found), "") if found.accepted else (math.inf, found.statement)

        setting = f"effort {effort:g}, {tries} tr{'y' if tries == 1 else 'ies'}"
        more = {"kind": kind, "reference": reference, "default": (effort, tries) == default}
        rows.append(median_row("search", setting, once, seeds, **more))
    return tuple(rows)


def median_row(method: str, setting: str, once: Callable[[int], tuple[float, str]], seeds: int, **more: Any) -> Row:
    """Return the row of a random search: medians over seeds of its error, infinite with a reason, and of its time."""
    errors, times, why = [], [], ""
    for seed in range(seeds):
        begin = perf_counter()
        error, lost = once(seed)
        times.append(perf_counter() - begin)
        errors.append(error)
        why = lost or why
    middle = median(errors)
    found = {"seeds accepted": float(sum(map(math.isfinite, errors)))}
    wrong, why = (middle, "") if math.isfinite(middle) else (math.nan, why)
    return Row.of(method, setting, wrong, (median(times), seeds), why, more=found, **more)


def line_problem(effort: Effort | None = None) -> Problem:
    """Find a four-bar linkage that draws a straight line, the requirement that leads to the lambda linkage.

    The error is how much wider the strip is than that of Chebyshev's proportions, which solve this exactly
    (``docs/explanation/embodiment.md``).
    """
    effort = effort or Effort()
    goals = Goals(
        target=LineGoal(length=4.0, on_bar=True), max_length_ratio=5.0, min_transmission_angle=math.radians(20)
    )
    settings = ((0.15, 1), (0.15, 3), (0.3, 3))
    seeds = 1 if effort.quick else 3

    kind = f"width of the strip over its length against the best, median of {seeds} seeds"
    reference, best = "closed form with 50 digits", precise_strip()
    rows = _rows(goals, settings, seeds, lambda found: abs(found.figures.goal_error - best), kind, reference)
    question = "Dimensions of a four-bar linkage for a straight line of four crank lengths (Chebyshev's lambda)"
    return Problem("dimensions", question, "relative", rows, "search", _NOTE)


_NOTE = (
    "A search is random and proves nothing; times and errors are medians over seeds. By default the effort is 1, with "
    "up to 12 tries, fewer when the target is met exactly."
)


def path_problem(effort: Effort | None = None) -> Problem:
    """Find a four-bar linkage through eight points at given inputs, taken from a linkage: no error is possible."""
    effort = effort or Effort()
    inputs = np.arange(8) * math.tau / 8
    M = TiltedFourBar(2.2, 1.0, 2.4, 2.3, k=0.7).positions(inputs).M
    points = tuple((float(x), float(y)) for x, y, _ in M)
    goals = Goals(target=PathGoal(points, tuple(inputs.tolist())), min_transmission_angle=math.radians(15))
    own = signature(embody).parameters
    efforts, seeds = ((0.02, 0.05, 0.1), 1) if effort.quick else ((0.02, 0.1, 0.3, own["effort"].default), 3)
    settings = tuple((share, own["tries"].default) for share in efforts)  # a target that is met ends the tries
    kind = f"largest distance from a point over the size of the set, median of {seeds} seeds"
    reference = "exact: the points are those of a linkage"
    rows = _rows(goals, settings, seeds, lambda found: found.figures.goal_error, kind, reference)
    question = "Dimensions of a four-bar linkage that passes eight points of another one at given inputs"
    return Problem("path-dimensions", question, "relative", rows, "search", _NOTE)
