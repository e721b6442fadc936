"""Pulling points of links: the branch is that of a continuation in tiny steps, made with the library's constraints."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from graphsynth.kinematics.engine import outlines
from graphsynth.kinematics.engine.kernels.dragging import LONGEST, TRIALS, drag
from graphsynth.kinematics.engine.program import compile_program, equations
from graphsynth.kinematics.simulation import simulate
from graphsynth.mechanism.constraints import characteristic_length, jacobian, residual
from graphsynth.mechanism.joints import Prismatic, Revolute
from graphsynth.mechanism.laws import Driver
from graphsynth.mechanism.model import Mechanism
from graphsynth.structure.graph import MechanismGraph

from .random_mechanisms import random_mechanism

pytestmark = pytest.mark.long  # kernels that the native library does not hold are compiled

FIVE_BAR = Mechanism(
    MechanismGraph(5, [(0, 1), (1, 2), (2, 3), (3, 4), (0, 4)], frame=0),
    [Revolute(0, 1), Revolute(1, 2, (1.0, 0.0)), Revolute(2, 3, (1.0, 0.0)), Revolute(3, 4, (1.0, 0.0), (1.0, 0.0)),
     Revolute(0, 4, (1.0, 0.0))],
    [Driver(0, 1), Driver(0, 4)],
)  # fmt: skip


def pulled(
    mechanism: Mechanism, pose: Any, link: int, at: Any, target: Any, way: Any
) -> tuple[np.ndarray, list[float]]:
    """Pose and what was found after one pull."""
    rows, table = equations(mechanism.joints, mechanism.dimensions[None])
    poses, found = np.array(pose, dtype=np.float64), np.zeros(3)
    points = np.asarray(at, dtype=np.float64), np.asarray(target, dtype=np.float64)
    drag(rows, table[0], mechanism.frame, poses, link, *points, way, characteristic_length(mechanism), found)
    return poses, found.tolist()


def points_of(poses: np.ndarray, link: int, at: Any) -> np.ndarray:
    z = np.exp(1j * poses[..., link, 2]) * complex(*at)
    return poses[..., link, :2] + np.stack([z.real, z.imag], axis=-1)


class Curve:
    """Poses (sets, links, 3) of a mechanism of mobility 1 that walk along their branch in tiny steps."""

    def __init__(self, mechanism: Mechanism, poses: np.ndarray) -> None:
        self.mechanism, self.poses = mechanism, poses.copy()
        self.Lc, links = characteristic_length(mechanism), mechanism.graph.links
        self.moving = [3 * k + c for k in range(links) if k != mechanism.frame for c in range(3)]
        self.unit = np.tile([1.0, 1.0, 1.0 / self.Lc], links)[self.moving]
        # residuals of angles are lengths, their gradients are not
        size: list[float] = []
        for joint in mechanism.joints:
            own = max(abs(complex(*joint.at_a)), abs(complex(*joint.at_b))) or 1.0
            size += [1.0, own] if isinstance(joint, Prismatic) else [1.0] * (3 - joint.mobility)
        self.size = np.array(size)
        self.tangent = np.linalg.svd(self.matrix())[2][:, -1]
        self.step(np.zeros(len(poses)))

    def keep(self, which: np.ndarray) -> None:
        """Go on with these sets only."""
        self.poses, self.tangent = self.poses[which], self.tangent[which]

    def matrix(self) -> np.ndarray:
        return jacobian(self.mechanism.joints, self.poses)[:, :, self.moving] * self.unit

    def moved(self, by: np.ndarray) -> None:
        flat = self.poses.reshape(len(self.poses), -1)
        flat[:, self.moving] += by * self.unit

    def step(self, h: np.ndarray) -> None:
        """Step along the tangents by lengths (sets,), and back to the joints at right angles to them."""
        self.moved(h[:, None] * self.tangent)
        for _ in range(6):
            f = residual(self.mechanism.joints, self.poses) / self.size
            if np.abs(f).max() < 1e-13 * self.Lc:
                break
            held = np.concatenate([self.matrix(), self.tangent[:, None, :]], axis=1)
            self.moved(np.linalg.solve(held, np.concatenate([-f, np.zeros((len(f), 1))], axis=1)[..., None])[..., 0])
        held = np.concatenate([self.matrix(), self.tangent[:, None, :]], axis=1)
        one = np.zeros((*held.shape[:2], 1))
        one[:, -1] = 1.0
        new = np.linalg.solve(held, one)[..., 0]
        self.tangent = new / np.linalg.norm(new, axis=1, keepdims=True)

    def slope(self, link: int, at: Any, target: np.ndarray) -> np.ndarray:
        """How fast the point nears its target along the tangent."""
        whole = np.zeros((len(self.poses), 3 * self.mechanism.graph.links))
        whole[:, self.moving] = self.tangent * self.unit
        v = whole.reshape(len(whole), -1, 3)[:, link]
        arm = points_of(self.poses, link, at) - self.poses[:, link, :2]
        speed = v[:, :2] + v[:, 2:] * np.stack([-arm[:, 1], arm[:, 0]], axis=1)
        return np.sum(speed * (target - points_of(self.poses, link, at)), axis=1)


def distance(a: np.ndarray, b: np.ndarray, Lc: float) -> np.ndarray:
    """Largest difference of poses (..., links, 3), angles modulo a turn."""
    turn = np.abs(np.exp(1j * a[..., 2]) - np.exp(1j * b[..., 2])).max(axis=-1)
    return np.asarray(np.maximum(np.abs(a[..., :2] - b[..., :2]).max(axis=(-1, -2)) / Lc, turn))


def agree(mechanism: Mechanism, pulls: int, sets: int, random: np.random.Generator, h: float) -> tuple[int, int]:
    """Pull at random ``sets`` times side by side; how many ends are those of tiny steps, and how many only lie on them.

    An end that is not on the way of tiny steps is a jump, and fails.
    """
    Lc, links = characteristic_length(mechanism), mechanism.graph.links
    poses = np.repeat(np.array(mechanism.pose)[None], sets, axis=0)
    ways = np.zeros((sets, 3 * (links - 1)))
    same, on = 0, 0
    for _ in range(pulls):
        link = int(random.choice([k for k in range(links) if k != mechanism.frame]))
        at = random.normal(size=2) * 0.5 * Lc
        targets = points_of(poses, link, at) + random.normal(size=(sets, 2)) * 0.25 * Lc
        curve = Curve(mechanism, poses)
        results = [pulled(mechanism, poses[k], link, at, targets[k], ways[k]) for k in range(sets)]
        ends = np.array([pose for pose, _ in results])
        # tiny steps down the slope, until it changes its sign; then on to ends that lie farther, as far as pulls go
        slope, close = curve.slope(link, at, targets), distance(curve.poses, ends, Lc)
        sense = np.sign(slope)
        # a link that the motion leaves where it is cannot be pulled: the end is the beginning
        over = np.abs(slope) <= 1e-11 * np.hypot(*(targets - points_of(poses, link, at)).T)
        first = np.where(over, close, math.inf)
        live = np.arange(sets)
        for _ in range(round(TRIALS * LONGEST / h)):
            here = distance(curve.poses, ends[live], Lc)
            passed = ~over[live] & (sense[live] * curve.slope(link, at, targets[live]) < 0.0)
            close[live], first[live[passed]] = np.minimum(close[live], here), here[passed]
            over[live] |= passed
            left = ~over[live] | (close[live] >= 2.0 * h)
            live = live[left]
            if not len(live):
                break
            curve.keep(left)
            curve.step(sense[live] * h * Lc)
        assert (close < 4.0 * h).all(), (np.flatnonzero(close >= 4.0 * h), close.max(), mechanism)
        near = first < 4.0 * h
        same, on = same + int(near.sum()), on + int((~near).sum())
        poses = ends
    return same, on


def test_pulls_end_where_tiny_steps_end() -> None:
    random = np.random.default_rng(11)
    same, on = np.sum([agree(random_mechanism(random, 0.2), 2, 4, random, 2e-3) for _ in range(4)], axis=0)
    assert same >= 24 and on <= 8


@pytest.mark.slow
def test_ten_thousand_sequences_of_pulls_stay_on_their_branches() -> None:
    random = np.random.default_rng(12)
    same, on = np.sum([agree(random_mechanism(random, 0.2), 3, 100, random, 4e-3) for _ in range(100)], axis=0)
    assert same + on == 30_000 and on <= 3000


def test_a_point_reaches_a_target_on_its_curve_through_a_dead_centre_of_the_driver() -> None:
    rocker = Mechanism.four_bar(4.0, 3.0, 2.0, 2.5)  # the driver turns within limits, the other rocker too
    motion = simulate(rocker, [0.9])
    limit = math.acos((4.0**2 + 3.0**2 - 4.5**2) / 24.0)  # coupler and rocker in line
    for sense in (0.05, -0.05):
        reached, way = [motion.poses[0]], np.zeros(9)
        for _ in range(30):  # turn the rocker by its end: the driver goes to its limit and back
            turn = complex(*points_of(reached[-1], 3, (2.5, 0.0))) - 4.0
            tip = 4.0 + turn * np.exp(1j * sense)
            new, _ = pulled(rocker, reached[-1], 3, (2.5, 0.0), (tip.real, tip.imag), way)
            reached.append(new)
        angles = np.array(reached)[:, 1, 2]
        if angles[1] > angles[0]:
            break
    assert limit - 5e-3 < angles.max() <= limit + 1e-12 and angles[-1] < limit - 0.1
    assert np.abs(residual(rocker.joints, np.array(reached))).max() < 1e-12


def test_the_nearest_point_is_that_of_the_curve() -> None:
    crank = Mechanism.four_bar(2.0, 1.0, 2.5, 2.5)
    motion = simulate(crank, np.linspace(0.0, math.tau, 20001))
    path = motion.point(2, (1.2, 0.8)).position
    start, target = motion.poses[2000], np.array([1.4, 2.6])
    pose, (left, code, _) = pulled(crank, start, 2, (1.2, 0.8), target, np.zeros(9))
    far = np.hypot(*(path - target).T)
    assert code == outlines.NEAREST and abs(left - far.min()) < 1e-7 and left <= far.min()
    assert np.abs(residual(crank.joints, pose)).max() < 1e-13


def test_several_freedoms_reach_what_they_can() -> None:
    base = simulate(FIVE_BAR, [1.6]).poses[0]
    way = np.zeros(12)
    tip = points_of(base, 2, (1.0, 0.0))
    pose, (left, code, _) = pulled(FIVE_BAR, base, 2, (1.0, 0.0), tip - [0.2, 0.3], way)
    assert code == outlines.REACHED and left < 1e-10 and np.abs(residual(FIVE_BAR.joints, pose)).max() < 1e-13
    # beyond the reach of a leg, and back
    far, (left, code, _) = pulled(FIVE_BAR, pose, 2, (1.0, 0.0), (0.2, 4.0), way)
    for _ in range(20):
        far, (left, code, _) = pulled(FIVE_BAR, far, 2, (1.0, 0.0), (0.2, 4.0), way)
    assert abs(left - math.hypot(0.3, 4.0 - math.sqrt(3.75))) < 1e-6  # both legs are stretched
    _, (_, code, _) = pulled(FIVE_BAR, far, 2, (1.0, 0.0), tip - [0.1, 0.4], way)
    assert code == outlines.REACHED


def test_a_link_that_stands_still_moves_nothing() -> None:
    """A crank-rocker with links 4 and 5 as a triangle on its frame: pulls of those leave the crank alone."""
    crank, random = Mechanism.four_bar(2.0, 1.0, 2.5, 2.5), np.random.default_rng(5)
    graph = MechanismGraph(6, [*((j.a, j.b) for j in crank.graph.joints), (0, 4), (4, 5), (0, 5)], frame=0)
    for _ in range(20):
        corners = [tuple(corner) for corner in random.normal(size=(3, 2)).tolist()]
        fixed = [Revolute(*pair, at, at) for pair, at in zip(((0, 4), (4, 5), (0, 5)), corners, strict=True)]
        whole = Mechanism(graph, [*crank.joints, *fixed], [])
        base = np.vstack([simulate(crank, [random.uniform(0.0, math.tau)]).poses[0], np.zeros((2, 3))])
        tip, target = random.normal(size=(2, 2))
        pose, (_, code, _) = pulled(whole, base, 4, tip, target, np.zeros(15))
        assert code == outlines.NEAREST and np.abs(pose - base).max() < 1e-9


def test_poses_that_do_not_close_are_told() -> None:
    crank = Mechanism.four_bar(2.0, 1.0, 2.5, 2.5)
    _, (left, code, _) = pulled(crank, np.zeros((4, 3)), 2, (0.0, 0.0), (1.0, 1.0), np.zeros(9))
    assert code == outlines.NOT_CLOSED and math.isnan(left)


def test_a_pull_needs_no_driver() -> None:
    crank = Mechanism.four_bar(2.0, 1.0, 2.5, 2.5)
    assert len(compile_program(crank).steps) == 2
    free = Mechanism(crank.graph, crank.joints, [], pose=tuple(map(tuple, simulate(crank, [0.5]).poses[0])))
    pose, (_, code, _) = pulled(free, free.pose, 1, (1.0, 0.0), (0.0, 1.0), np.zeros(9))
    assert code == outlines.REACHED and abs(pose[1, 2] - math.pi / 2.0) < 1e-9
