"""Mechanisms with guides whose rails may lean, and their first order from finite rotations and linear programs.

`least_factor` uses nothing of graphsynth but the plane poses.  Every link is turned by a small finite rotation and
lifted, every seat is turned by the misalignment as a finite rotation about its own point; what axes and centres of a
joint then lack is read off vectors in space and made linear by differences.
"""

import math

import numpy as np
from scipy.optimize import linprog
from scipy.spatial.transform import Rotation

from graphsynth import Driver, Mechanism, MechanismGraph, PinSlot, Prismatic, Revolute, simulate
from graphsynth.jamming.joints import JointLimits, Misalignment, SlideLimits

FOUR = MechanismGraph(4, [(0, 1), (1, 2), (2, 3), (0, 3)], frame=0)
STEP, SIDES = 1e-5, 180


def turned(rng, guide):
    """The same guide, or the one whose rail is on the other link."""
    if rng.random() < 0.5:
        return guide
    return Prismatic(guide.b, guide.a, guide.at_b, guide.at_a, guide.angle_b, guide.angle_a)


def slider_crank(rng):
    angle = rng.uniform(-3.0, 3.0)
    guide = Prismatic(
        0, 3, tuple(rng.uniform(-2, 2, 2)), tuple(rng.uniform(-0.3, 0.3, 2)), angle, angle + rng.uniform()
    )
    joints = [Revolute(0, 1), Revolute(1, 2, (1.0, 0.0)), Revolute(2, 3, (rng.uniform(4.5, 6.0), 0.0))]
    return Mechanism(FOUR, [*joints, turned(rng, guide)], [Driver(0, 1)])


def swinging_block(rng):
    """The rail is carried by the coupler, or by the block."""
    place, side = (rng.uniform(-1, 1), rng.uniform(-0.3, 0.3)), tuple(rng.uniform(-0.2, 0.2, 2))
    guide = turned(rng, Prismatic(2, 3, place, side, rng.uniform(-0.3, 0.3)))
    joints = [Revolute(0, 1), Revolute(1, 2, (1.0, 0.0)), guide, Revolute(0, 3, (rng.uniform(1.6, 3.0), 0.0))]
    return Mechanism(FOUR, joints, [Driver(0, 1)])


def two_loops(rng):
    """A four-bar whose rocker drives a slider."""
    graph = MechanismGraph(6, [(0, 1), (1, 2), (2, 3), (0, 3), (3, 4), (4, 5), (0, 5)], frame=0)
    angle = rng.uniform(-3.0, 3.0)
    guide = turned(rng, Prismatic(0, 5, tuple(rng.uniform(-1, 1, 2)), (0.0, 0.0), angle, angle))
    arm = (rng.uniform(1.0, 2.0), rng.uniform(-1.0, 1.0))
    joints = [Revolute(0, 1), Revolute(1, 2, (1.0, 0.0)), Revolute(2, 3, (2.5, 0.0), (2.5, 0.0)),
              Revolute(0, 3, (2.0, 0.0)), Revolute(3, 4, arm), Revolute(4, 5, (8.0, 0.0)), guide]  # fmt: skip
    return Mechanism(graph, joints, [Driver(0, 1)])


def slotted(rng):
    """The crank's pin in the slot of a rocker."""
    graph = MechanismGraph(3, [(0, 1), (0, 2), (1, 2, 2)], frame=0)
    slot = PinSlot(2, 1, (rng.uniform(-1, 1), rng.uniform(-0.2, 0.2)), (1.0, 0.0), rng.uniform(-0.2, 0.2))
    return Mechanism(graph, [Revolute(0, 1), Revolute(0, 2, (rng.uniform(1.5, 3.0), 0.0)), slot], [Driver(0, 1)])


MAKES = {make.__name__: make for make in (slider_crank, swinging_block, two_loops, slotted)}


def case(rng, name):
    """A mechanism with its motion, and the guide as (base, link): either seat of it leans."""
    while True:
        mechanism = MAKES[name](rng)
        u = rng.uniform(0.0, 6.28)
        motion = simulate(mechanism, np.linspace(u, u + 0.05, 3))
        if motion.assembled.all():
            guide = next(joint for joint in mechanism.joints if joint.kind != "R")
            return mechanism, motion, guide.pair[:: rng.choice([-1, 1])]


def question(rng, mechanism, pair, alpha):
    """Limits of the size of alpha, without clearances along the axis or with, a rail that leans by it, a motor too."""
    limits = {}
    for joint in mechanism.joints:
        roll, pitch = alpha * rng.uniform(0.3, 1.5, 2)
        play = alpha * rng.choice([0.0, 0.3])
        limits[joint.pair] = JointLimits(roll, play) if joint.kind == "R" else SlideLimits(roll, pitch, play)
    tilts = [Misalignment(*pair, alpha, rng.uniform(0.0, 6.28), rigid=bool(rng.random() < 0.3))]
    if rng.random() < 0.5:
        tilts.append(Misalignment(0, 1, rng.uniform(0.1, 0.5) * alpha, rng.uniform(0.0, 6.28)))
    return {own: value for own, value in limits.items() if not any(t.rigid and t.pair == own for t in tilts)}, tilts


def lacks(mechanism, pose, tilts, x, part):
    """What axes and centres of every joint lack: (joints, 3), components across and along, for leans of links x.

    Tilt about and across the direction of a guide (of other joints: about x and y), and the slip along the axis.
    """
    place = {}
    for link, (px, py, angle) in enumerate(pose):
        turn = Rotation.from_rotvec([*x[link, :2], 0.0])
        place[link] = (
            turn * Rotation.from_rotvec([0.0, 0.0, angle]),
            turn.apply([px, py, 0.0]) + np.array([0.0, 0.0, x[link, 2]]),
        )
    found = []
    for joint in mechanism.joints:
        axes, centres, way = [], [], None
        for link, at, angle in ((joint.a, joint.at_a, "angle_a"), (joint.b, joint.at_b, "angle_b")):
            seat = Rotation.identity()
            for own in tilts:
                if own.pair == joint.pair and own.base == link:
                    seat = Rotation.from_rotvec([part * own.alpha * math.cos(own.direction),
                                                 part * own.alpha * math.sin(own.direction), 0.0])  # fmt: skip
            turn = place[link][0] * seat * Rotation.from_rotvec([0.0, 0.0, getattr(joint, angle, 0.0)])
            axes.append(turn.apply([0.0, 0.0, 1.0]))
            centres.append(place[link][0].apply([*at, 0.0]) + place[link][1])
            way = turn if way is None else way
        lean = np.cross(axes[0], axes[1])
        frame = way.as_matrix() if joint.kind != "R" else np.eye(3)
        found.append([lean @ frame[:, 0], lean @ frame[:, 1], axes[0] @ (centres[1] - centres[0])])
    return np.array(found)


def least_factor(mechanism, pose, limits, tilts):
    """Bounds of the least factor on all limits: circles of round joints are cut by polygons."""
    count = len(pose)
    free = [link for link in range(count) if link != mechanism.frame]
    rigid = {own.pair for own in tilts if own.rigid}

    def slope(x, part):
        return (lacks(mechanism, pose, tilts, x, part) - lacks(mechanism, pose, tilts, -x, -part)) / (2.0 * STEP)

    given = slope(np.zeros((count, 3)), STEP)
    by = []
    for link in free:
        for k in range(3):
            x = np.zeros((count, 3))
            x[link, k] = STEP
            by.append(slope(x, 0.0))
    by = np.moveaxis(np.array(by), 0, -1)  # (joints, 3, unknowns)
    equal, equal_right, rows, right = [], [], [], []

    def bound(row, value, limit):
        if limit == 0.0:
            equal.append([*row, 0.0])
            equal_right.append(-value)
        else:
            rows.extend([[*row, -limit], [*-row, -limit]])
            right.extend([-value, value])

    for joint, own, rates in zip(mechanism.joints, given, by):
        held = joint.pair in rigid
        limit = limits.get(joint.pair)
        bound(rates[2], own[2], 0.0 if held else limit.axial_clearance)
        if held or isinstance(limit, SlideLimits):
            for k in (0, 1):
                bound(rates[k], own[k], 0.0 if held else (limit.roll, limit.pitch)[k])
        else:
            for angle in math.pi * np.arange(SIDES) / SIDES:
                n = np.array([math.cos(angle), math.sin(angle)])
                bound(n @ rates[:2], n @ own[:2], limit.tilt)
    size = by.shape[-1]
    found = linprog([0.0] * size + [1.0], rows, right, equal or None, equal_right or None,
                    [(None, None)] * size + [(0.0, None)], method="highs")  # fmt: skip
    if found.status == 2:
        return math.inf, math.inf
    assert found.status == 0, found.message
    return found.fun, found.fun / math.cos(0.5 * math.pi / SIDES)
