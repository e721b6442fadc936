"""Tasks that no mechanism can do, with the reason; each is a proof from what is given, none from a search."""

from __future__ import annotations

import math
from itertools import combinations

from graphsynth.design.task.bounds import FIT
from graphsynth.design.task.places import meet, outside
from graphsynth.design.task.targets import PathTarget, PosesTarget
from graphsynth.design.task.task import DesignTask
from graphsynth.kinematics.dimensional.verify import SLACK

#: How far a length may be beyond its bounds: two that are given, each as exactly as answers take it.
_SPARE = 2.0 * FIT + 2.0 * SLACK


def proof(task: DesignTask) -> str:
    """Return why no mechanism can do the task; empty if nothing here proves it.

    >>> from graphsynth.design.task.targets import PathTarget
    >>> proof(DesignTask(targets=[PathTarget.segment((0, 0), (4, 0))], box=(0, 0, 1, 1)))
    'point (1.02128, 0) of a path lies outside the box'
    """
    for box, name in ((task.box, "box"), (task.pivot_region, "region of the pivots")):
        for p in task.every_pivot if box is not None else ():
            assert box is not None
            if len(p) == 2 and any(outside(p, box)):
                return f"the given pivot ({p[0]:g}, {p[1]:g}) lies outside the {name}"
            if len(p) == 4 and not meet(p, box):
                return f"the region {p} of a pivot lies outside the {name}"
    if task.box is not None:
        if task.pivot_region is not None and not meet(task.box, task.pivot_region):
            return "the box and the region of the pivots do not meet"
        for target in task.targets:
            if isinstance(target, PathTarget | PosesTarget):
                for z in target.goal.tolist():
                    if math.hypot(*outside((z.real, z.imag), task.box)) > target.tolerance * target.size:
                        what = "a path" if isinstance(target, PathTarget) else "a motion"
                        return f"point ({z.real:g}, {z.imag:g}) of {what} lies outside the box"
    apart = [(math.dist(p, q), p, q) for p, q in combinations(task.given_pivots, 2)]
    for distance, p, q in apart:
        between = f"the given pivots ({p[0]:g}, {p[1]:g}) and ({q[0]:g}, {q[1]:g}) are {distance:.4g} apart"
        if task.lengths is not None and not task.lengths[0] <= distance <= task.lengths[1]:
            return f"{between}, but lengths must be {task.lengths[0]:g} to {task.lengths[1]:g}"
        if task.crank is not None and max(distance / task.crank, task.crank / distance) > task.length_ratio:
            return f"{between} and the crank is {task.crank:g}: a larger ratio than {task.length_ratio:g}"
    if len(task.every_pivot) > max(task.links) // 2:
        return (
            f"{len(task.every_pivot)} pivots are given, but no link of a chain of {max(task.links)} links and one "
            f"freedom has more than {max(task.links) // 2} joints"
        )
    points = any(task.names.values())  # a side of a plate may go to a point, which no bound of lengths speaks of
    given = task.given[: 1 + len(task.bars) - (task.crank is None)] if points else task.given
    for length in given:
        what = "the crank is" if length == task.crank else "a given link has the length"
        low, high = task.lengths or (0.0, math.inf)
        if "lengths" not in task.soft and not low * (1.0 - _SPARE) <= length <= high * (1.0 + _SPARE):
            return f"{what} {length:g}, but lengths must be {low:g} to {high:g}"
        if "length_ratio" not in task.soft and length > min(given) * task.length_ratio * (1.0 + _SPARE):
            return f"{what} {length:g}, and another {min(given):g}: a larger ratio than {task.length_ratio:g}"
    return ""
