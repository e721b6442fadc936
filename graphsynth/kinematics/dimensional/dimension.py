"""From the best candidate to a mechanism a designer can read: own frame of every link, pose at the first input."""

from __future__ import annotations

import cmath

import numpy as np
from numpy.typing import NDArray

from graphsynth.kinematics.dimensional.goals import LineGoal
from graphsynth.kinematics.dimensional.problem import Problem
from graphsynth.mechanism.joints import JointGeometry, PinSlot, Prismatic, Revolute
from graphsynth.mechanism.laws import Driver, Linear
from graphsynth.mechanism.model import Mechanism, TracePoint

Array = NDArray[np.float64]


def dimensioned(problem: Problem, x: Array) -> Mechanism | None:
    """Return the mechanism of a vector, or None if it has no pose at the first input.

    Every moving link's frame has its origin in the link's first joint and its x axis towards the second.  The fixed
    frame is that of the target's coordinates; without such, its origin is the driven joint and another joint of the
    frame lies on its x axis.  The law of a turning driver begins at the angle of the crank, so that inputs begin at 0.
    """
    outcome = problem.evaluate(x[None])
    frames = outcome.frames0[0]
    if not np.isfinite(frames).all():
        return None
    s, q, t = 1.0 + 0j, 0j, 0j
    if outcome.placed is not None:
        s, q, t = (complex(part[0]) for part in outcome.placed)
    design, table = problem.design, outcome.dimensions[0]
    point_at = frames[problem.link, 0] + 1j * frames[problem.link, 1]
    point_at += q / s * (frames[problem.link, 2] + 1j * frames[problem.link, 3])
    if problem.fit is None or not problem.fit.placed:
        s, t = _placement(problem, frames, table)
    world = [s * _world(frames, joint.a, table[k, 0:2]) + t for k, joint in enumerate(design.graph.joints)]
    own = {link: _frame(problem, link, world) for link in range(design.graph.links)}
    turned = cmath.phase(s)
    joints = [_joint(problem, k, world[k], own, turned, frames, table) for k in range(len(design.graph.joints))]
    points: dict[str, TracePoint] = {}
    if problem.fit is not None:
        points["P"] = TracePoint(problem.link, _local(own[problem.link], s * point_at + t))
    pose = [(z.real, z.imag, angle) for z, angle in (own[link] for link in range(design.graph.links))]
    drivers = tuple(
        Driver(b, k, Linear(float(problem.sense), own[k][1] - own[b][1] if design.kinds[j] == "R" else 0.0))
        for (b, k), j in zip(design.drivers, design.driver_joints)
    )
    return Mechanism(design.graph, tuple(joints), drivers, points, tuple(pose))


def _world(frames: Array, link: int, local: Array) -> complex:
    x, y, c, s = frames[link]
    return complex(x, y) + complex(c, s) * complex(local[0], local[1])


def _placement(problem: Problem, frames: Array, table: Array) -> tuple[complex, complex]:
    """Origin in the driven joint, the other fixed joint on the x axis, upright; a line goal has a crank of length 1."""
    graph = problem.design.graph
    z = [_world(frames, graph.joints[k].a, table[k, 0:2]) for k in problem.design.fixed]
    if len(z) < 2 or z[1] == z[0]:
        return 1.0 + 0j, 0j
    s = abs(z[1] - z[0]) / (z[1] - z[0])
    upright = problem.sketch[list(problem.design.fixed)]
    if problem.fit is None and upright[1, 0] < upright[0, 0]:
        s = -s  # as in the sketch, with the frame below
    if problem.fit is not None and isinstance(problem.goals.target, LineGoal):
        s = s / float(problem.crank(table[None, :, 0:2])[0])
    return s, -s * z[0]


def _frame(problem: Problem, link: int, world: list[complex]) -> tuple[complex, float]:
    """Origin and angle of a link's own frame at the first input."""
    if link == problem.design.graph.frame:
        return 0j, 0.0
    joints = problem.design.joints_of(link)
    driven = [k for k in joints if k in problem.design.driver_joints]
    joints = sorted(joints, key=lambda k: (k not in driven, problem.design.kinds[k] != "R", k))
    z = [world[k] for k in joints]
    far = [p for p in z[1:] if abs(p - z[0]) > 0.0]
    return z[0], cmath.phase(far[0] - z[0]) if far else 0.0


def _local(frame: tuple[complex, float], at: complex) -> tuple[float, float]:
    p = (at - frame[0]) * cmath.exp(-1j * frame[1])
    return p.real, p.imag


def _joint(
    problem: Problem,
    k: int,
    at: complex,
    own: dict[int, tuple[complex, float]],
    turned: float,
    frames: Array,
    table: Array,
) -> JointGeometry:
    joint, kind = problem.design.graph.joints[k], problem.design.kinds[k]
    on_a, on_b = _local(own[joint.a], at), _local(own[joint.b], at)
    if kind == "R":
        return Revolute(joint.a, joint.b, on_a, on_b)
    direction = float(table[k, 2]) + float(np.arctan2(frames[joint.a, 3], frames[joint.a, 2])) + turned
    if kind == "P":
        return Prismatic(joint.a, joint.b, on_a, on_b, direction - own[joint.a][1], direction - own[joint.b][1])
    return PinSlot(joint.a, joint.b, on_a, on_b, direction - own[joint.a][1])
