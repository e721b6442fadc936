"""The frames of an animation: samples of a motion over all it reaches, whether it goes round, what to say about it."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from graphsynth.core.errors import GeometryError
from graphsynth.drawing.bodies import bodies, world
from graphsynth.kinematics.simulation import simulate
from graphsynth.mechanism.constraints import characteristic_length
from graphsynth.mechanism.joints import Prismatic
from graphsynth.mechanism.laws import Linear
from graphsynth.mechanism.model import Mechanism, TracePoint

if TYPE_CHECKING:
    from graphsynth.kinematics.engine.result import Motion

Array = NDArray[np.float64]

#: Most frames an animation may have.
FRAMES_MAX = 2000


@dataclass(frozen=True, eq=False)
class Frames:
    """Poses to be shown one after the other.

    * `poses` (shape (n, links, 3)): assembled; angles without jumps.  If ``loops``, the last is the first again.
    * `coordinates` (shape (n, drivers)): driver coordinates: radians or lengths.
    * `loops`: the motion closes, so it goes round; otherwise it goes to and fro.
    * `note`: why it does not go round; empty if it does.
    """

    mechanism: Mechanism
    poses: Array
    coordinates: Array
    loops: bool
    note: str

    @property
    def order(self) -> list[int]:
        """Frames of one period: round, or to and fro; no frame twice in a row."""
        n = len(self.poses)
        if n == 1:
            return [0]
        return list(range(n - 1)) if self.loops else [*range(n), *range(n - 2, 0, -1)]


def check_frames(count: int) -> None:
    """Raise `GeometryError` unless so many frames can be shown."""
    if not 2 <= count <= FRAMES_MAX:
        raise GeometryError(f"frames = {count} must be from 2 to {FRAMES_MAX}; choose another number")


def frames_of(motion: Motion, count: int = 120) -> Frames:
    """Choose about ``count`` frames of the part of a motion that is reached.

    `count`: frames of the whole range; a motion with fewer samples gives all it has. Raises `GeometryError` if
    ``count`` is out of 2..2000, or nothing of the motion is assembled.
    """
    check_frames(count)
    reached = np.flatnonzero(~np.isfinite(motion.poses).all(axis=(1, 2)))
    last = int(reached[0]) if reached.size else len(motion.inputs)
    if last == 0:
        raise GeometryError(f"nothing of the motion is assembled, so nothing can be shown: {motion.reason}")
    pick = np.unique(np.linspace(0, last - 1, min(count + 1, last)).round().astype(np.intp))
    poses = np.array(motion.poses[pick])
    poses[:, :, 2] = np.unwrap(poses[:, :, 2], axis=0)
    coordinates = np.column_stack([d.law(motion.inputs[pick])[0] for d in motion.mechanism.drivers])
    loops = motion.completed and motion.closure.closed and len(pick) > 2
    note = ""
    if not motion.completed:
        reason = motion.reason[:1].upper() + motion.reason[1:]
        note = f"Shown to and fro over the part that is reached. {reason}."
    elif not loops and motion.closure.tested:
        note = f"Shown to and fro: {motion.closure.statement}."
    return Frames(motion.mechanism, poses, coordinates, loops, note)


def with_trace_points(motion: Motion, most: int = 1) -> Motion:
    """Name a point to be traced if the mechanism has none: the middle of a link that is not jointed to the frame.

    `most`: largest number of points; links with the most joints first. The same motion, if it has points already or no
    such link.
    """
    mechanism = motion.mechanism
    if mechanism.points:
        return motion
    graph = mechanism.graph
    near = {mechanism.frame, *(a + b - mechanism.frame for a, b, _ in graph.joints if mechanism.frame in (a, b))}
    floating = sorted((link for link in range(graph.links) if link not in near), key=lambda k: (-graph.degrees[k], k))
    reached = motion.poses[np.isfinite(motion.poses).all(axis=(1, 2))]
    if not floating or not len(reached):
        return motion
    shown = bodies(mechanism, reached, 0.0)
    points = {}
    for name, link in zip("PQST", floating[:most]):
        corners = shown[link].vertices()
        middle = sum(corners) / len(corners)
        points[name] = TracePoint(link, (middle.real, middle.imag))
    return replace(motion, mechanism=replace(mechanism, points=points))


_STARTS = 24  # inputs tried where the first pose is not known


def motion_over_reach(mechanism: Mechanism, samples: int = 361) -> Motion:
    """Simulate the mechanism's range of inputs, if it has one; else one turn, or what lies between the branch's ends.

    `mechanism`: its pose, if it has one, gives the input at which the motion begins (for a linear law); otherwise the
    first of 24 inputs around the turn at which it can be assembled. `samples`: of the turn, 2 or more. Over the turn if
    it is completed.  Otherwise not `completed`, its samples run from one end of the branch to the other, and `reason`
    tells both. Raises `GeometryError`: no driver, a sliding driver without a pose, or nothing that can be assembled.
    """
    if not mechanism.drivers:
        raise GeometryError("the mechanism has no driver, so it cannot be moved; add one")
    if mechanism.input_range is not None:
        return simulate(mechanism, np.linspace(*mechanism.input_range, samples))
    driver = mechanism.drivers[0]
    sliding = isinstance(mechanism.joint(*driver.pair), Prismatic)
    if sliding and mechanism.pose is None:
        raise GeometryError("a sliding driver has no turn: give a range of inputs, or the mechanism a pose to begin at")
    rate = driver.law.rate if isinstance(driver.law, Linear) and driver.law.rate else 1.0
    span = (characteristic_length(mechanism) if sliding else math.tau) / abs(rate)
    steps = np.linspace(0.0, span, samples)
    begin = _begin(mechanism)
    starts = [begin] if mechanism.pose is not None else [begin + span * k / _STARTS for k in range(_STARTS)]
    for start in starts:
        forward = simulate(mechanism, start + steps)
        if forward.assembled[0]:
            break
    else:
        raise GeometryError(f"the mechanism cannot be assembled at any of {len(starts)} inputs: {forward.reason}")
    if forward.completed and not sliding:
        return forward
    backward = simulate(mechanism, float(forward.inputs[0]) - steps, start=forward.poses[0])
    return _joined(backward, forward)


def _begin(mechanism: Mechanism) -> float:
    """Input that belongs to the mechanism's pose; 0 where it is not known."""
    driver = mechanism.drivers[0]
    law = driver.law
    if mechanism.pose is None or not isinstance(law, Linear) or law.rate == 0.0:
        return 0.0
    joint = mechanism.joint(*driver.pair)
    pose = np.array(mechanism.pose)
    if isinstance(joint, Prismatic):
        P, Q = (world(pose[None], k, complex(*at))[0] for k, at in ((joint.a, joint.at_a), (joint.b, joint.at_b)))
        sign = 1.0 if driver.base == joint.a else -1.0
        q = sign * float(((Q - P) * np.exp(-1j * (pose[joint.a, 2] + joint.angle_a))).real)
    else:
        q = float(pose[driver.link, 2] - pose[driver.base, 2])
    return (q - law.offset) / law.rate


def _joined(backward: Motion, forward: Motion) -> Motion:
    """Put the part before the start in front of the part after it."""
    before = np.flatnonzero(backward.assembled)[:0:-1]
    after = np.flatnonzero(forward.assembled)
    parts: dict[str, Any] = {
        name: np.concatenate([getattr(backward, name)[before], getattr(forward, name)[after]])
        for name in ("inputs", "poses", "velocities", "accelerations", "modes", "margins", "assembled")
    }
    # angles of the two parts are continuous each for itself
    parts["poses"][:, :, 2] = np.unwrap(parts["poses"][:, :, 2], axis=0)
    reasons = dict.fromkeys(motion.reason for motion in (forward, backward) if motion.reason)
    return replace(
        forward,
        **parts,
        completed=not reasons,
        reason="; at the other end ".join(reasons),
        events=tuple(reversed(backward.events)) + forward.events,
        seconds=forward.seconds + backward.seconds,
    )
