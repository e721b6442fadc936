"""The check that an embodiment must pass: the whole range by `simulate`, step control, events and all."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from graphsynth.kinematics.dimensional.goals import FunctionGoal, Goals, LineGoal, PosesGoal
from graphsynth.kinematics.dimensional.transmission import group_forms, transmission_sines
from graphsynth.kinematics.simulation import simulate
from graphsynth.mechanism.joints import Revolute

if TYPE_CHECKING:
    from graphsynth.kinematics.engine.result import Motion
    from graphsynth.mechanism.model import Mechanism

Array = NDArray[np.float64]

_SAMPLES = 720
_RESIDUAL = 1e-9
#: Slack on stated bounds: they are met on a grid, and a smallest value lies between samples.
_SLACK = 1e-6


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
    inputs, at = _inputs(goals)
    motion = simulate(mechanism, inputs)
    reasons = []
    if not motion.completed:
        reasons.append("the range is not completed")
    elif goals.full_turn and not (motion.closure.tested and motion.closure.closed):
        reasons.append("not closed after the turn")
    if any(event.kind in ("change point", "near fold", "fold", "escape", "singular") for event in motion.events):
        reasons.append("two assembly modes meet or nearly meet")
    if motion.completed and (motion.modes != motion.modes[0]).any():
        reasons.append("an assembly mode changes")
    if motion.completed and not motion.residual <= _RESIDUAL:
        reasons.append("a joint opens")
    angle = smallest_transmission(motion)
    ratio = length_ratio(mechanism)
    error = _goal_error(motion, goals, inputs, at) if motion.completed else math.nan
    if not angle >= goals.min_transmission_angle - _SLACK:
        reasons.append("the transmission angle is too small")
    if not ratio <= goals.max_length_ratio * (1.0 + _SLACK):
        reasons.append("the length ratio is too large")
    if goals.target is not None and not error <= goals.target.tolerance:
        reasons.append("the target is missed")
    apart = motion.singularity_distance
    figures = Figures(
        transmission_angle=angle,
        singularity_distance=float(apart.min()) if motion.completed else math.nan,
        length_ratio=ratio,
        goal_error=error,
        residual=motion.residual,
        closure=motion.closure.error,
    )
    return motion, figures, tuple(reasons)


def _inputs(goals: Goals) -> tuple[Array, NDArray[np.intp]]:
    """Return a fine grid that contains the inputs of the target, and where they are."""
    inputs = np.linspace(0.0, goals.span, _SAMPLES + 1)
    target = goals.target
    own = np.zeros(0)
    if isinstance(target, LineGoal):
        own = np.array([target.span])
    elif target is not None and target.inputs is not None:
        own = np.array(target.inputs)
    own = np.minimum(own, goals.span)
    new = [value for value in own if np.abs(inputs - value).min() > 1e-9]
    inputs = np.sort(np.concatenate([inputs, new]))
    return inputs, np.abs(inputs[None] - own[:, None]).argmin(axis=1)


def smallest_transmission(motion: Motion) -> float:
    """Smallest transmission angle of a motion over all groups, radians; NaN if it is not complete.

    See :mod:`graphsynth.kinematics.dimensional.transmission` for groups larger than dyads.  pi/2 without groups.
    """
    if not motion.completed:
        return math.nan
    mechanism = motion.mechanism
    frames = np.stack(
        [motion.poses[..., 0], motion.poses[..., 1], np.cos(motion.poses[..., 2]), np.sin(motion.poses[..., 2])],
        axis=-1,
    )
    ends = [(joint.a, joint.b) for joint in mechanism.joints]
    forms = group_forms(mechanism, motion.steps)
    sines = transmission_sines(forms, mechanism.dimensions[None], ends, frames[None], motion.margins[None])
    return float(np.arcsin(min(1.0, sines.min(initial=1.0))))


def length_ratio(mechanism: Mechanism) -> float:
    """Longest over shortest distance of two turning joints on one link; named points count among the long ones."""
    lengths, arms = [], []
    for link in range(mechanism.graph.links):
        at = [
            complex(*(joint.at_a if joint.a == link else joint.at_b))
            for joint in mechanism.joints
            if isinstance(joint, Revolute) and link in (joint.a, joint.b)
        ]
        lengths += [abs(p - q) for i, p in enumerate(at) for q in at[i + 1 :]]
        every = [complex(*(j.at_a if j.a == link else j.at_b)) for j in mechanism.joints if link in (j.a, j.b)]
        arms += [abs(complex(*p.at) - z) for p in mechanism.points.values() if p.link == link for z in every]
    if not lengths:
        return 1.0
    return max([*lengths, *arms]) / min(lengths) if min(lengths) > 0.0 else math.inf


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
    if isinstance(target, PosesGoal):
        rows = np.array(target.poses)
        goal = rows[:, 0] + 1j * rows[:, 1]
        size = np.abs(goal - goal.mean()).max() or 1.0
        turned = angle[at] - angle[at[0]] - (rows[:, 2] - rows[0, 2])
        return float(max((np.abs(z[at] - goal) / size).max(), np.abs(turned - turned.mean()).max()))
    points = np.array(target.points)
    goal = points[:, 0] + 1j * points[:, 1]
    size = np.abs(goal - goal.mean()).max()
    if target.inputs is not None:
        return float(np.abs(z[at] - goal).max() / size)
    return in_order(z, goal) / float(size)


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


def in_order(z: NDArray[np.complex128], goal: NDArray[np.complex128]) -> float:
    """Smallest bound e such that the curve passes the goals in order, each within e.

    The curve is the polyline through the samples; like the discrete Frechet distance [Eiter & Mannila 1994].

    >>> in_order(np.array([0j, 1, 2, 3]), np.array([0j, 2.25 + 0.25j, 3]))
    0.25
    """
    sides = np.diff(z)
    size = np.maximum(np.abs(sides) ** 2, 1e-300)
    part = np.clip(((goal[:, None] - z[None, :-1]) * np.conj(sides)).real / size, 0.0, 1.0)
    apart = np.abs(z[None, :-1] + part * sides - goal[:, None])
    best = np.minimum.accumulate(apart[0])
    for row in apart[1:]:
        best = np.minimum.accumulate(np.maximum(best, row))
    return float(best[-1])
