"""Which bounds of a task a motion breaks, and which wishes it misses: from the mechanism as it is, not the search."""

from __future__ import annotations

import math
from itertools import permutations
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from graphsynth.design.task.plans import Plan
from graphsynth.design.task.task import DesignTask
from graphsynth.kinematics.dimensional.mirror import is_mirrored
from graphsynth.kinematics.dimensional.verify import SLACK, side_lengths
from graphsynth.mechanism.laws import Linear
from graphsynth.mechanism.model import Mechanism

if TYPE_CHECKING:
    from graphsynth.kinematics.engine.result import Motion

Array = NDArray[np.float64]
#: Relative difference of a length from that which is given.
FIT = 1e-3


def places_of(motion: Motion) -> Array:
    """Places of all joints and points over the motion (samples, places, 2)."""
    own = [motion.point(joint.a, joint.at_a).position for joint in motion.mechanism.joints]
    return np.stack([*own, *(motion.point(name).position for name in motion.mechanism.points)], axis=1)


def broken_bounds(task: DesignTask, motion: Motion, places: Array, plan: Plan) -> dict[str, bool]:
    """Tell which bounds of the task are broken."""
    slack, mechanism = SLACK * task.size, motion.mechanism
    broken: dict[str, bool] = {}

    def outside(box: tuple[float, ...], points: Array) -> bool:
        low, high = np.nanmin(points.reshape(-1, 2), axis=0), np.nanmax(points.reshape(-1, 2), axis=0)
        return bool((low < np.array(box[:2]) - slack).any() or (high > np.array(box[2:]) + slack).any())

    if task.box is not None and "box" not in task.soft:
        broken["it leaves the box"] = outside(task.box, places)
    frame = [k for k, joint in enumerate(mechanism.joints) if mechanism.frame in joint.pair]
    if task.pivot_region is not None:
        broken["a pivot leaves its region"] = outside(task.pivot_region, places[:1, frame])
    for joint, region in plan.regions:
        leaves = outside(region, places[:1, [joint]])
        broken["a pivot leaves its region"] = broken.get("a pivot leaves its region", False) or leaves
    lengths = side_lengths(mechanism) or [1.0]
    if task.lengths is not None:
        broken["a length is out of its bounds"] = "lengths" not in task.soft and bool(
            min(lengths) < task.lengths[0] * (1 - SLACK) or max(lengths) > task.lengths[1] * (1 + SLACK)
        )
        names = [*mechanism.points]
        arms = [places[0, joint] - places[0, len(mechanism.joints) + names.index(name)] for name, joint in plan.idling]
        short = any(math.hypot(*arm) < task.lengths[0] * (1 - SLACK) for arm in arms)
        broken["a point lies at a joint, so that links do nothing"] = short
    if task.bars:
        lengths = side_lengths(mechanism, {*range(mechanism.graph.links)} - {mechanism.frame}) or [1.0]
        for bar in task.bars:
            k = min(range(len(lengths)), key=lambda k: abs(math.log(lengths[k] / bar)), default=-1)
            fits = k >= 0 and abs(math.log(lengths.pop(k) / bar)) <= FIT
            broken["a given bar is not used"] = broken.get("a given bar is not used", False) or not fits
    if task.plates:
        broken["a given plate is not used"] = not _has_plates(task, mechanism)
    if task.crank is not None or task.crank_start is not None:
        broken |= _crank_bounds(task, motion.mechanism, places)
    if plan.mirror:
        broken["it is not its own mirror image"] = not is_mirrored(motion, places, plan.design, plan.mirror)
    elif task.symmetric:
        broken["its curve is not symmetric"] = not _symmetric(motion, task.symmetric_point)
    if task.linear and task.stroke is not None:
        law = mechanism.drivers[0].law
        stroke = abs(law.rate) if isinstance(law, Linear) else math.nan
        broken["the stroke is out of its bounds"] = not (
            task.stroke[0] * (1 - SLACK) <= stroke <= task.stroke[1] * (1 + SLACK)
        )
    return broken


def _has_plates(task: DesignTask, mechanism: Mechanism) -> bool:
    """Whether every given plate is a moving link of its own, from the distances of its joints and named points."""
    left = {*range(mechanism.graph.links)} - {mechanism.frame}
    for plate in task.plates:
        for link in left:
            own = [j.at_a if j.a == link else j.at_b for j in mechanism.joints if link in j.pair and j.kind == "R"]
            own += [point.at for point in mechanism.points.values() if point.link == link]
            sides = ([math.dist(p, q), math.dist(q, r), math.dist(r, p)] for p, q, r in permutations(own, 3))
            if any(np.abs(np.log(np.array(own_sides) / plate)).max() <= FIT for own_sides in sides):
                left.remove(link)
                break
        else:
            return False
    return True


def _crank_bounds(task: DesignTask, mechanism: Mechanism, places: Array) -> dict[str, bool]:
    """Tell whether the driven link has not its length or begins elsewhere."""
    driven = mechanism.drivers[0].link
    own = [k for k, joint in enumerate(mechanism.joints) if driven in joint.pair and joint.kind == "R"]
    fixed = [k for k, joint in enumerate(mechanism.joints) if mechanism.frame in joint.pair]
    at = places[0] @ [1.0, 1.0j]
    pivot = next((k for k in own if k in fixed), -1)
    ways = [at[k] - at[pivot] for k in own if k != pivot] if pivot >= 0 else []
    broken: dict[str, bool] = {}
    if task.crank is not None and ways:
        broken["the crank has not its length"] = abs(math.log(abs(ways[0]) / task.crank)) > FIT
    if task.crank_start is not None:
        base = at[next(k for k in fixed if k != pivot)] - at[pivot] if task.crank_from == "frame" else 1.0
        low, high = task.crank_start
        off = math.remainder(float(np.angle(ways[0] / base)) - 0.5 * (low + high), math.tau)
        broken["the crank begins elsewhere"] = abs(off) > 0.5 * (high - low) + SLACK
    return broken


def _symmetric(motion: Motion, point: str) -> bool:
    """Whether a point of a four-bar, its crank pin and the pivot of its follower are equally far from a joint."""
    mechanism = motion.mechanism
    tracing = mechanism.points[point].link
    far = [link for link in range(4) if link not in (mechanism.frame, mechanism.drivers[0].link, tracing)]
    middle = next(j for j in mechanism.joints if {*j.pair} == {tracing, far[0]})
    at = middle.at_a if middle.a == tracing else middle.at_b
    lengths = [math.dist(at, mechanism.points[point].at), *side_lengths(mechanism, [tracing, far[0]])]
    return max(lengths) - min(lengths) <= SLACK * max(lengths)


def missed_wishes(
    task: DesignTask, places: Array, mechanism: Mechanism, figures: tuple[float, float]
) -> dict[str, float]:
    """By how much wishes are missed: radians, parts of a length, parts of the size of the task."""
    angle, ratio = figures
    lengths, found = side_lengths(mechanism) or [1.0], {}
    found["transmission"] = task.transmission - angle
    found["length_ratio"] = math.log(ratio / task.length_ratio)
    if task.lengths is not None:
        found["lengths"] = max(math.log(task.lengths[0] / min(lengths)), math.log(max(lengths) / task.lengths[1]))
    if task.box is not None:
        low, high = np.nanmin(places, axis=(0, 1)), np.nanmax(places, axis=(0, 1))
        found["box"] = float(max(*(task.box[:2] - low), *(high - task.box[2:]))) / task.size
    return {name: by for name, by in found.items() if name in task.soft and by > SLACK}
