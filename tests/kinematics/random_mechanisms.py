"""Random planar mechanisms given at an exact pose: 4 to 10 links with R, P, slotted and geared joints."""

from __future__ import annotations

import cmath
import math

import numpy as np

from graphsynth.mechanism.constraints import jacobian
from graphsynth.mechanism.joints import Gear, JointGeometry, PinSlot, Prismatic, Revolute
from graphsynth.mechanism.laws import Driver, Linear
from graphsynth.mechanism.model import Mechanism
from graphsynth.structure.assur import find_fault
from graphsynth.structure.graph import MechanismGraph


def random_graph(random: np.random.Generator) -> tuple[MechanismGraph, tuple[int, int]]:
    """A mechanism of mobility 1 that one joint on the frame drives, and that joint."""
    while True:
        links = int(random.integers(4, 11))
        higher = int(random.choice([0, 0, 2] if links % 2 == 0 else [1, 1, 3]))
        joints = (3 * links - 4 - higher) // 2 + higher
        pairs = [(a, b) for a in range(links) for b in range(a + 1, links)]
        if joints > len(pairs):
            continue
        frame = int(random.integers(links))
        for _ in range(200):
            chosen = [pairs[k] for k in random.choice(len(pairs), joints, replace=False)]
            if min(sum(link in pair for pair in chosen) for link in range(links)) < 2:
                continue
            lower = [pair for pair in chosen[higher:] if frame in pair]
            if not lower:
                continue
            graph = MechanismGraph(
                links, [(*pair, 2 if k < higher else 1) for k, pair in enumerate(chosen)], frame=frame
            )
            if find_fault(graph, [lower[0]]) is None:
                return graph, lower[0]


def random_mechanism(random: np.random.Generator, sliding: float = 0.2) -> Mechanism:
    """A mechanism whose pose closes to rounding; ``sliding`` is the share of prismatic among the lower pairs."""
    graph, driven = random_graph(random)
    poses = np.column_stack([random.normal(size=(graph.links, 2)), random.uniform(-math.pi, math.pi, graph.links)])
    poses[graph.frame] = 0.0

    def seen(link: int, point: complex) -> tuple[float, float]:
        local = (point - complex(*poses[link, :2])) * cmath.exp(-1j * poses[link, 2])
        return local.real, local.imag

    joints: list[JointGeometry] = []
    for joint in graph.joints:
        a, b = (joint.a, joint.b) if random.random() < 0.5 else (joint.b, joint.a)
        place, angle = complex(*random.normal(size=2)) * 1.5, random.uniform(-math.pi, math.pi)
        along = place + random.normal() * cmath.exp(1j * angle)
        angles = angle - poses[a, 2], angle - poses[b, 2]
        if joint.mobility == 1 and random.random() >= sliding:
            joints.append(Revolute(a, b, seen(a, place), seen(b, place)))
        elif joint.mobility == 1:
            joints.append(Prismatic(a, b, seen(a, place), seen(b, along), *angles))
        elif random.random() < 0.5:
            joints.append(PinSlot(a, b, seen(a, place), seen(b, along), angles[0]))
        else:
            ra, rb = random.uniform(0.3, 2.0, 2)
            internal = bool(random.random() < 0.3)
            phi, s = cmath.phase(along - place), -1.0 if internal else 1.0
            turn = s * ra / rb * (poses[a, 2] - phi) + poses[b, 2] - phi
            joints.append(Gear(a, b, seen(a, place), seen(b, along), float(ra), float(rb), internal, float(turn)))
    base = graph.frame
    joint = next(one for one in joints if one.pair == driven)
    link = driven[0] if driven[1] == base else driven[1]
    assert base is not None
    offset = poses[link, 2]
    if isinstance(joint, Prismatic):
        direction = cmath.exp(1j * (poses[joint.a, 2] + joint.angle_a))
        P, Q = (complex(*poses[k, :2]) + cmath.exp(1j * poses[k, 2]) * complex(*at)
                for k, at in ((joint.a, joint.at_a), (joint.b, joint.at_b)))  # fmt: skip
        offset = ((Q - P) * direction.conjugate()).real * (1.0 if base == joint.a else -1.0)
    driver = Driver(base, link, Linear(float(random.choice([-1.0, 1.0])), float(offset)))
    return Mechanism(graph, joints, [driver], pose=tuple(map(tuple, poses.tolist())))


def held_jacobian(mechanism: Mechanism, poses: np.ndarray) -> np.ndarray:
    """Constraint matrix with the row of the driver last, columns of the moving links only, (n, rows, columns)."""
    links, driver = mechanism.graph.links, mechanism.drivers[0]
    joint = mechanism.joint(*driver.pair)
    held = np.zeros((len(poses), 1, 3 * links))
    if isinstance(joint, Prismatic):
        turn = poses[:, joint.a, 2] + joint.angle_a
        sign = 1.0 if driver.base == joint.a else -1.0
        for link, way in ((joint.a, -sign), (joint.b, sign)):
            held[:, 0, 3 * link], held[:, 0, 3 * link + 1] = way * np.cos(turn), way * np.sin(turn)
    else:
        held[:, 0, 3 * driver.link + 2], held[:, 0, 3 * driver.base + 2] = 1.0, -1.0
    moving = [3 * k + c for k in range(links) if k != mechanism.frame for c in range(3)]
    return np.concatenate([jacobian(mechanism.joints, poses), held], axis=1)[:, :, moving]
