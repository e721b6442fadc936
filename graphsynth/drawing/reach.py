"""How far a mechanism can be shown: its motion over a whole turn, or to both ends of what it reaches."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from graphsynth.core.errors import GeometryError
from graphsynth.kinematics.simulation import simulate
from graphsynth.mechanism.constraints import characteristic_length
from graphsynth.mechanism.joints import Prismatic
from graphsynth.mechanism.laws import Linear
from graphsynth.mechanism.model import Mechanism

if TYPE_CHECKING:
    from graphsynth.kinematics.engine.result import Motion

Array = NDArray[np.float64]

_STARTS = 24  # inputs tried where the first pose is not known


def motion_over_reach(mechanism: Mechanism, samples: int = 361) -> Motion:
    """Simulate one turn of the first driver; if the branch ends, everything between its two ends.

    Parameters
    ----------
    mechanism : Mechanism
        Its pose, if it has one, gives the input at which the motion begins (for a linear law); otherwise the
        first of 24 inputs around the turn at which it can be assembled.
    samples : int
        Of the turn, 2 or more.

    Returns
    -------
    Motion
        Over the turn if it is completed.  Otherwise not `completed`, its samples run from one end of the branch to the
        other, and `reason` tells both.

    Raises
    ------
    GeometryError
        No driver, a sliding driver without a pose, or nothing that can be assembled.
    """
    if not mechanism.drivers:
        raise GeometryError("the mechanism has no driver, so it cannot be moved; add one")
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
        P, Q = (
            complex(*pose[k, :2]) + np.exp(1j * pose[k, 2]) * complex(*at)
            for k, at in ((joint.a, joint.at_a), (joint.b, joint.at_b))
        )
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
