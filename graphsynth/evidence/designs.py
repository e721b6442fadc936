"""From a task to mechanisms: error against run time, where a mechanism that does the task exactly is known."""

from __future__ import annotations

import math
from statistics import median
from tempfile import TemporaryDirectory
from time import perf_counter
from typing import Any

import numpy as np

from graphsynth.evidence.embodiment import median_row
from graphsynth.evidence.rows import Effort, Problem, Row
from graphsynth.mechanism.four_bar import TiltedFourBar

#: Frame, crank, coupler and follower of wanted curves, at least; by how much they are longer at most: all turn fully.
_MIDDLE, _WIDE = np.array([2.2, 1.0, 2.4, 2.3]), np.array([0.2, 0.05, 0.2, 0.3])


def hidden_task(context: Any, effort: Effort) -> Problem:
    """Find four- and six-bars with a given pivot through twelve points of a four-bar: none need be missed."""
    from graphsynth.design import DesignTask, PathTarget, design

    inputs = np.linspace(0.0, 4.0, 12)
    M = TiltedFourBar(2.2, 1.0, 2.4, 2.3, k=0.7).positions(inputs).M
    target = PathTarget(points=[(float(x), float(y)) for x, y, _ in M], tolerance=0.002)
    task = DesignTask(targets=[target], pivots=[(0.0, 0.0)], transmission=math.radians(15))
    seeds = 1 if effort.quick else 3
    design(task, seconds=0.1)  # compiled and loaded
    rows = []
    for limit in (1.0, 3.0, 30.0) if effort.quick else (1.0, 2.0, 4.0, 8.0):

        def once(seed: int, limit: float = limit) -> tuple[float, str]:
            found = design(task, seconds=limit, count=1, seed=seed)
            return (found[0].errors[0], "") if found.accepted else (math.inf, "no answer within the time")

        kind = f"largest distance from a point over the size of the set, median of {seeds} seeds"
        rows.append(median_row("design", f"{limit:g} s at most", once, seeds, kind=kind, reference="exact"))
    note = "A search is random; it ends where answers were found and long no better one. The task is a fixed one."
    question = "Mechanisms with a given pivot through twelve points of a four-bar"
    return Problem("hidden-task", question, "relative", tuple(rows), "design", note)


def nine_points(context: Any, effort: Effort) -> Problem:
    """Find every four-bar through points of a coupler curve, with two, one and no given pivots; proved."""
    from graphsynth.design import four_bars_through

    inputs = np.linspace(0.2, 5.6, 9)
    M = TiltedFourBar(2.2, 1.0, 2.4, 2.3, k=0.7).positions(inputs).M
    points, pivots = [complex(x, y) for x, y, _ in M], [0j, 2.2 + 0j]
    size, rows = max(abs(p - points[0]) for p in points), []
    for held in (2, 1, 0):
        count = 9 - 2 * held
        given = points[:count], pivots[:held]
        four_bars_through(*given)  # compiled and loaded
        begin = perf_counter()
        found = four_bars_through(*given)
        timed = perf_counter() - begin, 1
        radius = median(linkage.radius for linkage in found.linkages) / size
        setting = f"{count} points, {held} pivots: {found.certified} of {found.expected}"
        why = "" if found.complete else f"{found.expected - found.certified} solutions are not certified"
        more = {"kind": "proved radius, median", "reference": "a proof", "proved": True}
        rows.append(Row.of("homotopy", setting, radius, timed, why, **more))
    note = (
        "Radius in which an exact linkage is proved, over the size of the points: of half of the real ones it is less."
    )
    question = "Every four-bar whose coupler passes given points"
    return Problem("nine-points", question, "relative", tuple(rows), "homotopy", note)


def nearest_curves(context: Any, effort: Effort) -> Problem:
    """Look for coupler curves of four-bars in indexes of more and more curves, and among more and more candidates."""
    from graphsynth.design import CurveIndex
    from graphsynth.design.curves.index import CANDIDATES

    turn, random = np.linspace(0.0, math.tau, 129), np.random.default_rng(3)
    wanted, rows = [], []
    for _ in range(9):
        frame, crank, coupler, follower = (_MIDDLE + _WIDE * random.random(4)).tolist()
        bar = TiltedFourBar(frame, crank, coupler, follower, k=random.uniform(-1.0, 1.0))
        wanted.append(bar.positions(turn).M[:, :2])
    sizes = (1000, 2000) if effort.quick else (1000, 4000, 16_000)
    with TemporaryDirectory() as folder:
        for curves in sizes:
            index = CurveIndex.build(f"{folder}/{curves}", curves, links=[4, 6], sliders=0)
            index.find(wanted[0], 1, closed=True)  # loaded
            for candidates in (CANDIDATES,) if curves != sizes[-1] else (10, CANDIDATES, curves):
                begin = perf_counter()
                found = [index.find(curve, 1, closed=True, candidates=candidates)[0].error for curve in wanted]
                timed = (perf_counter() - begin) / len(wanted), 1
                setting, usual = f"{curves} curves, {candidates} candidates", candidates == CANDIDATES
                more = {"kind": "distance of curves, median of 9", "reference": "closed form of the wanted curve"}
                rows.append(
                    Row.of("index", setting, median(found), timed, default=usual and curves == sizes[-1], **more)
                )
    note = (
        "Wanted are curves of four-bars that no index holds; what is found is refined by a search, which comes nearer."
    )
    question = "Curves of an index that are nearest to a coupler curve"
    return Problem("nearest-curves", question, "relative", tuple(rows), "index", note)
