"""The check that dimensions found must pass: the whole range by `simulate`, step control, events and all."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from itertools import combinations
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from graphsynth.kinematics.dimensional.goals import FunctionGoal, Goals, LineGoal, PathGoal, PosesGoal
from graphsynth.kinematics.dimensional.matching import MovingLink, Wanted, at_times, passed
from graphsynth.kinematics.dimensional.transmission import group_forms, transmission_sines
from graphsynth.kinematics.simulation import simulate
from graphsynth.mechanism.joints import Cam, PinSlot

if TYPE_CHECKING:
    from graphsynth.kinematics.engine.result import Motion
    from graphsynth.mechanism.model import Mechanism

Array = NDArray[np.float64]

#: Samples of a motion that is judged.
SAMPLES = 720
_RESIDUAL = 1e-9
#: Slack on stated bounds: they are met on a grid, and a smallest value lies between samples.
SLACK = 1e-6
#: Events at which two assembly modes meet or nearly meet.
_MEETINGS = ("change point", "near fold", "fold", "escape", "singular")


@dataclass(frozen=True)
class Figures:
    """What a verified motion achieves (estimated: floating point, on a grid of half a degree).

    Attributes
    ----------
    transmission_angle : float
        Smallest over the range and all bars, radians.
    singularity_distance : float
        Smallest singular value of the scaled constraint matrix over the range.
    length_ratio : float
        Longest over shortest length.
    goal_error : float
        Error of the target in the unit of its tolerance; NaN without a target.
    residual, closure : float
        Largest violation of a joint, and gap after the turn, over the characteristic length.
    """

    transmission_angle: float
    singularity_distance: float
    length_ratio: float
    goal_error: float
    residual: float
    closure: float


def verify(mechanism: Mechanism, goals: Goals) -> tuple[Motion, Figures, tuple[str, ...]]:
    """Simulate the range anew and return the motion, its figures, and every reason to reject it (none: accepted)."""
    # a fine grid that contains the inputs of the target, and where they are
    inputs, target, own = np.linspace(0.0, goals.span, SAMPLES + 1), goals.target, np.zeros(0)
    if isinstance(target, LineGoal):
        own = np.array([target.span])
    elif target is not None and target.inputs is not None:
        own = np.array(target.inputs)
    own = np.minimum(own, goals.span)
    inputs = np.sort(np.concatenate([inputs, [u for u in own if np.abs(inputs - u).min() > 1e-9]]))
    at = np.abs(inputs[None] - own[:, None]).argmin(axis=1)
    motion = simulate(mechanism, inputs)
    done = motion.completed
    angle, ratio = smallest_transmission(motion), length_ratio(mechanism)
    error = _goal_error(motion, goals, inputs, at) if done else math.nan
    missed = {
        **faults(motion, goals.full_turn),
        "the transmission angle is too small": not angle >= goals.min_transmission_angle - SLACK,
        "the length ratio is too large": not ratio <= goals.max_length_ratio * (1.0 + SLACK),
        "the target is missed": target is not None and not error <= target.tolerance,
    }
    figures = Figures(
        transmission_angle=angle,
        singularity_distance=float(motion.singularity_distance.min()) if done else math.nan,
        length_ratio=ratio,
        goal_error=error,
        residual=motion.residual,
        closure=motion.closure.error,
    )
    return motion, figures, tuple(reason for reason, wrong in missed.items() if wrong)


def faults(motion: Motion, full_turn: bool) -> dict[str, bool]:
    """Tell what is wrong with a motion, whatever it is for: it ends early, changes its branch, or opens."""
    done, closed = motion.completed, motion.closure.tested and motion.closure.closed
    return {
        "the range is not completed": not done,
        "not closed after the turn": done and full_turn and not closed,
        "two assembly modes meet or nearly meet": any(event.kind in _MEETINGS for event in motion.events),
        "an assembly mode changes": done and bool((motion.modes != motion.modes[0]).any()),
        "a joint opens": done and not motion.residual <= _RESIDUAL,
    }


def smallest_transmission(motion: Motion) -> float:
    """Smallest transmission angle of a motion over all groups, radians; NaN if it is not complete.

    For groups larger than dyads see `graphsynth.kinematics.dimensional.transmission`.  pi/2 without groups.
    """
    if not motion.completed:
        return math.nan
    mechanism = motion.mechanism
    x, y, angle = np.moveaxis(motion.poses, -1, 0)
    frames = np.stack([x, y, np.cos(angle), np.sin(angle)], axis=-1)
    ends = [(joint.a, joint.b) for joint in mechanism.joints]
    forms = group_forms(mechanism, motion.steps)
    sines = transmission_sines(forms, mechanism.dimensions[None], ends, frames[None], motion.margins[None])
    return float(np.arcsin(min(1.0, sines.min(initial=1.0))))


def side_lengths(mechanism: Mechanism, links: Iterable[int] | None = None) -> list[float]:
    """Distances of revolute joints, pins in slots and rollers on one link, of all links or some."""
    found = []
    for link in range(mechanism.graph.links) if links is None else links:
        own = [j.at_a if j.a == link else j.at_b for j in mechanism.joints if link in j.pair and j.kind == "R"]
        own += [j.at_b for j in mechanism.joints if j.b == link and isinstance(j, PinSlot | Cam)]
        found += [math.dist(p, q) for p, q in combinations(own, 2)]
    return found


def arm_lengths(mechanism: Mechanism) -> list[float]:
    """Distances of named points from the joints of their links."""
    found = []
    for point in mechanism.points.values():
        own = [j.at_a if j.a == point.link else j.at_b for j in mechanism.joints if point.link in j.pair]
        found += [math.dist(point.at, p) for p in own]
    return found


def length_ratio(mechanism: Mechanism) -> float:
    """Longest over shortest of `side_lengths`; distances of named points count among the long ones."""
    lengths = side_lengths(mechanism)
    if not lengths:
        return 1.0
    return max([*lengths, *arm_lengths(mechanism)]) / min(lengths) if min(lengths) > 0.0 else math.inf


def _goal_error(motion: Motion, goals: Goals, inputs: Array, at: NDArray[np.intp]) -> float:
    """Error of the target, recomputed from the verified motion."""
    target = goals.target
    if target is None:
        return math.nan
    link = motion.mechanism.points["P"].link
    position = motion.point("P").position
    z = position[:, 0] + 1j * position[:, 1]
    if isinstance(target, LineGoal):
        inside = inputs <= target.span + 1e-9
        return strip_width(z[inside]) / float(np.abs(z[inside][-1] - z[0]))
    angle = motion.poses[:, link, 2]
    if isinstance(target, FunctionGoal):
        e = angle[at] - np.array(target.outputs)
        return float(0.5 * np.ptp(e))
    rows = np.array(target.poses if isinstance(target, PosesGoal) else target.points)
    goal = rows[:, 0] + 1j * rows[:, 1]
    size = float(np.abs(goal - goal.mean()).max()) or 1.0
    turn = rows[:, 2] - rows[0, 2] if isinstance(target, PosesGoal) else None
    if target.inputs is None:
        rates = motion.velocities[:, link]
        frames = np.stack([z.real, z.imag, np.cos(angle), np.sin(angle)], axis=-1)
        arm = z - (motion.poses[:, link, 0] + 1j * motion.poses[:, link, 1])
        moved = rates[:, 0] + 1j * rates[:, 1] + 1j * rates[:, 2] * arm
        own = MovingLink(
            inputs,
            frames[None],
            np.stack([moved.real, moved.imag, rates[:, 2]], axis=-1)[None],
            goals.span if goals.full_turn else 0.0,
        )
        closed = isinstance(target, PathGoal) and target.closed
        found, _ = at_times(own, passed(own, Wanted(goal, turn, size, closed, free=False)))
        z, w = found[0, :, 0] + 1j * found[0, :, 1], found[0, :, 2] + 1j * found[0, :, 3]
        rest = w if turn is None else w * np.exp(-1j * turn)
        turned = 0.0 * goal.real if turn is None else np.angle(rest * np.conj(rest.sum()))
        return float(max((np.abs(z - goal) / size).max(), np.abs(turned).max()))
    worst = (np.abs(z[at] - goal) / size).max()
    if turn is None:
        return float(worst)
    turned = angle[at] - angle[at[0]] - turn
    return float(max(worst, np.abs(turned - turned.mean()).max()))


def strip_width(z: NDArray[np.complex128]) -> float:
    """Width of the narrowest strip between parallel lines that holds the points (straightness of ISO 1101).

    >>> strip_width(np.array([0j, 1 + 0.1j, 2 + 0j]))
    0.1
    """
    from scipy.spatial import ConvexHull, QhullError

    points = np.column_stack([z.real, z.imag])
    try:
        corners = z[ConvexHull(points).vertices]
    except QhullError:
        return 0.0
    sides = np.roll(corners, -1) - corners
    across = (np.conj(sides / np.abs(sides))[:, None] * (corners[None] - corners[:, None])).imag
    return float(np.ptp(across, axis=1).min())
