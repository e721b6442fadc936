"""Tasks that are a classical problem of four-bars: the search begins with every solution that algebra gives."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

from graphsynth.core.errors import GeometryError
from graphsynth.design.nine_points.solutions import four_bars_through
from graphsynth.design.poses.functions import function_generators, timed_paths
from graphsynth.design.poses.linkages import four_bars_for_poses
from graphsynth.design.task.targets import FunctionTarget, PathTarget, PosesTarget

if TYPE_CHECKING:
    from graphsynth.design.task.task import DesignTask
    from graphsynth.mechanism.model import Mechanism

#: Points of a path that determine four-bars, by the number of given pivots; positions that determine others.
_THROUGH, _POSITIONS = {0: 9, 1: 7, 2: 5}, 5
#: Four-bars of the infinitely many through one position fewer.
_OF_MANY = 16
#: Time limit of a search from which on it begins with all four-bars through nine points, which take some 20 s.
_PATIENT = 60.0


def solutions(task: DesignTask, seconds: float) -> Iterator[Mechanism]:
    """Yield the four-bars that solve a task of one target by a closed form or a complete system; often there are none.

    Which of them turn, keep their order and the bounds, the search finds out.

    >>> from graphsynth.design.task.task import DesignTask
    >>> poses = [(0, 0, 0), (1, 0.5, 0.4), (2, 0.4, 0.7), (3, 0, 0.8), (3.5, -0.5, 0.7)]
    >>> len(list(solutions(DesignTask(targets=[PosesTarget(poses=poses)], links=[4]), 9.0)))
    6
    """
    target = task.targets[0]
    if len(task.targets) > 1 or 4 not in task.links or task.drive != "rotation" or getattr(target, "base", False):
        return  # not of a four-bar whose output is on the frame
    try:
        found = _found(task, target, seconds)
    except GeometryError:  # special points: the search has to do without
        return
    name = next(iter(task.names))
    for mechanism in found:
        points = {name: mechanism.points["P"]} if "P" in mechanism.points and task.names[name] else {}
        yield type(mechanism)(mechanism.graph, mechanism.joints, mechanism.drivers, points, mechanism.pose)


def _found(task: DesignTask, target: object, seconds: float) -> Sequence[Mechanism]:
    """Return the solutions of the target, if it is one of the problems."""
    if isinstance(target, PosesTarget) and target.inputs is None and len(target.poses) == _POSITIONS:
        return [linkage.mechanism for linkage in four_bars_for_poses(target.poses)]
    if isinstance(target, PosesTarget) and target.inputs is None and len(target.poses) == _POSITIONS - 1:
        box = task.pivot_region or task.box
        pivots = None if box is None else (box[::2], box[1::2])
        every = four_bars_for_poses(target.poses, pivots=pivots, count=_OF_MANY)
        return [linkage.mechanism for linkage in every if not linkage.defects]
    if isinstance(target, FunctionTarget) and target.inputs is not None and len(target.outputs) == _POSITIONS:
        inputs = [u - target.inputs[0] for u in target.inputs]
        outputs = [v - target.outputs[0] for v in target.outputs]
        return [linkage.mechanism for linkage in function_generators(inputs, outputs)]
    if not isinstance(target, PathTarget):
        return []
    if target.inputs is not None:
        exact = len(target.points) == _POSITIONS
        return [linkage.mechanism for linkage in timed_paths(target.points, target.inputs)] if exact else []
    given = task.given_pivots
    if len(target.points) == _THROUGH.get(len(given)) and (given or seconds >= _PATIENT):
        return [linkage.mechanism for linkage in four_bars_through(target.points, given).linkages if linkage.in_order]
    return []
