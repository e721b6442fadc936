"""Pulling points of links: the branch is that of a continuation in tiny steps, made with the library's constraints."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from numba import njit

from graphsynth.kinematics.engine import outlines
from graphsynth.kinematics.engine.codes import SINGULAR
from graphsynth.kinematics.engine.kernels.dragging import LONGEST, TRIALS, drag
from graphsynth.kinematics.engine.program import compile_program, equations
from graphsynth.kinematics.simulation import simulate
from graphsynth.mechanism.constraints import characteristic_length, residual
from graphsynth.mechanism.joints import Gear, PinSlot, Prismatic, Revolute
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


@njit(error_model="numpy")
def equations_at(kinds: Any, pairs: Any, numbers: Any, frame: int, Lc: float, pose: Any, f: Any, J: Any) -> None:
    """Write violations of joints and their derivatives by places and turned lengths of the moving links, from scratch.

    ``numbers`` of a joint: points of both links, directions or 0, pitch radii (negative of an internal pair), offset.
    """
    row = 0
    J[:] = 0.0
    for k in range(len(kinds)):
        a, b = pairs[k]
        pa, pb = numbers[k, 0] + 1j * numbers[k, 1], numbers[k, 2] + 1j * numbers[k, 3]
        arm_a, arm_b = pa * np.exp(1j * pose[a, 2]), pb * np.exp(1j * pose[b, 2])
        gap = (pose[b, 0] + 1j * pose[b, 1] + arm_b) - (pose[a, 0] + 1j * pose[a, 1] + arm_a)
        ways = np.zeros(2, np.complex128)  # a row is Re(conj(way) d gap) + turns
        turns = np.zeros((2, 2))
        if kinds[k] == 0:
            ways[0], ways[1] = 1.0, 1j
            f[row], f[row + 1], count = gap.real, gap.imag, 2
        elif kinds[k] < 3:  # the pin of b stays on the line through a
            ways[0] = 1j * np.exp(1j * (pose[a, 2] + numbers[k, 4]))
            f[row], turns[0, 0], count = (gap * ways[0].conjugate()).real, (gap * (1j * ways[0]).conjugate()).real, 1
            if kinds[k] == 1:
                off = pose[a, 2] + numbers[k, 4] - pose[b, 2] - numbers[k, 5]
                f[row + 1] = Lc * (off - math.tau * round(off / math.tau))
                turns[1, 0], turns[1, 1], count = Lc, -Lc, 2
        else:
            ra, rb, phi = numbers[k, 6], numbers[k, 7], np.angle(gap)
            value = ra * (pose[a, 2] - phi) + rb * (pose[b, 2] - phi - numbers[k, 8])
            period = math.tau * abs(ra + rb)  # of the direction of the line of centres
            f[row], count = value - period * round(value / period), 1
            ways[0] = -(ra + rb) * 1j * gap / abs(gap) ** 2
            turns[0, 0], turns[0, 1] = ra, rb
        for r in range(count):
            for link, sign, arm, side in ((a, -1.0, arm_a, 0), (b, 1.0, arm_b, 1)):
                if link != frame:
                    at, way = 3 * (link - (link > frame)), sign * ways[r]
                    J[row + r, at] += way.real
                    J[row + r, at + 1] += way.imag
                    J[row + r, at + 2] += ((1j * arm * way.conjugate()).real + turns[r, side]) / Lc
        row += count


@njit(error_model="numpy")
def moved(pose: Any, frame: int, Lc: float, by: Any) -> None:
    for link in range(len(pose)):
        if link != frame:
            at = 3 * (link - (link > frame))
            pose[link, 0] += by[at]
            pose[link, 1] += by[at + 1]
            pose[link, 2] += by[at + 2] / Lc


@njit(error_model="numpy")
def slope_of(pose: Any, frame: int, Lc: float, tangent: Any, link: int, at: complex, target: complex) -> float:
    """Return how fast the point nears its target along the tangent, times their distance."""
    k, arm = 3 * (link - (link > frame)), at * np.exp(1j * pose[link, 2])
    speed = tangent[k] + 1j * tangent[k + 1] + tangent[k + 2] / Lc * 1j * arm
    return float((speed * (target - pose[link, 0] - 1j * pose[link, 1] - arm).conjugate()).real)


@njit(error_model="numpy")
def apart(a: Any, b: Any, Lc: float) -> float:
    """Largest difference of two poses, angles modulo a turn."""
    turn = np.abs(np.exp(1j * a[:, 2]) - np.exp(1j * b[:, 2])).max()
    return float(max(np.abs(a[:, :2] - b[:, :2]).max() / Lc, turn))


@njit(error_model="numpy")
def walk(
    kinds: Any, pairs: Any, numbers: Any, frame: int, Lc: float, start: Any, end: Any, link: int, at: complex,
    target: complex, h: float, sign: float,
) -> tuple[float, float, bool]:  # fmt: skip
    """Walk from a pose along its branch of one freedom in tiny steps, down the slope of the distance from the target.

    Returns how near the way came to ``end``, how near it was where the slope first changed its sign (it goes on behind
    that place as far as pulls go), and whether the point rests at the beginning.  A sign of -1 walks up the slope.
    """
    n = 3 * (len(start) - 1)
    pose, f, J, tangent = start.copy(), np.empty(n - 1), np.empty((n - 1, n)), np.sin(1.0 + np.arange(n))
    right = np.zeros((n, 2))
    right[-1, 1] = 1.0
    held = np.empty((n, n))
    sense, slope, close, first, over, rest = 0.0, 0.0, math.inf, math.inf, False, False
    for step in range(round(TRIALS * LONGEST / h) + 1):
        moved(pose, frame, Lc, sense * h * Lc * tangent)
        for _ in range(8):  # back to the joints, at right angles to the tangent
            equations_at(kinds, pairs, numbers, frame, Lc, pose, f, J)
            if not np.abs(f).max() < Lc:
                return close, first, rest  # the way has met a singular pose, and is lost
            held[:-1], right[:-1, 0] = J, -f
            held[-1] = tangent
            found = np.linalg.solve(held, right)
            if np.abs(f).max() < 1e-11 * Lc:
                break
            moved(pose, frame, Lc, found[:, 0])
        tangent = found[:, 1] / np.linalg.norm(found[:, 1])
        here = apart(pose, end, Lc)
        slope = slope_of(pose, frame, Lc, tangent, link, at, target)
        close = min(close, here)
        if step == 0:
            sense = sign if slope > 0.0 else -sign
            left = abs(target - pose[link, 0] - 1j * pose[link, 1] - at * np.exp(1j * pose[link, 2]))
            # a link that the motion leaves where it is cannot be pulled: the end is the beginning
            over = abs(slope) <= 1e-11 * left
            rest = abs(slope) <= 1e-8 * left  # a pull that ends in a dead centre leaves it to rounding
            first = here if over else first
        elif not over and sense * slope < 0.0:
            over, first = True, here
        if over and close < 2.0 * h:
            break
    return close, first, rest


def tables(mechanism: Mechanism) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Kinds, links and numbers of joints, for the walk."""
    kinds = {Revolute: 0, Prismatic: 1, PinSlot: 2, Gear: 3}
    numbers = [
        (*own.at_a, *own.at_b, getattr(own, "angle_a", 0.0), getattr(own, "angle_b", 0.0),
         *((own.radius_a, own.sign * own.radius_b, own.offset) if isinstance(own, Gear) else (0.0, 0.0, 0.0)))
        for own in mechanism.joints
    ]  # fmt: skip
    return (
        np.array([kinds[type(own)] for own in mechanism.joints]),
        np.array([(own.a, own.b) for own in mechanism.joints]),
        np.array(numbers),
    )


def condition(mechanism: Mechanism, pose: Any) -> float:
    """Condition number of the constraints at a pose."""
    n = 3 * (mechanism.graph.links - 1)
    f, J = np.empty(n - 1), np.empty((n - 1, n))
    equations_at(*tables(mechanism), mechanism.frame, characteristic_length(mechanism), np.array(pose), f, J)
    return float(np.linalg.cond(J))


def regular_mechanism(random: np.random.Generator) -> Mechanism:
    """A random mechanism whose constraints are independent: loops of nothing but sliders have a dependent one."""
    while condition(found := random_mechanism(random, 0.2), found.pose) > 1e8:
        pass
    return found


def agree(mechanism: Mechanism, pulls: int, sets: int, random: np.random.Generator, h: float) -> Any:
    """Pull at random ``sets`` times side by side; how many ends are those of tiny steps, only lie on them, or stop.

    An end that is not on the way of tiny steps is a jump, and fails; so does a stop where the constraints are regular.
    With it a sequence of pulls ends: of gears whose centres meet, the line of centres has no direction.
    """
    Lc, links, frame = characteristic_length(mechanism), mechanism.graph.links, mechanism.frame
    given, counts, n = tables(mechanism), np.zeros(3, dtype=int), 3 * (links - 1)
    poses, ways = np.repeat(np.array(mechanism.pose)[None], sets, axis=0), np.zeros((sets, n))
    for _ in range(pulls):
        link = int(random.choice([k for k in range(links) if k != frame]))
        at = random.normal(size=2) * 0.5 * Lc
        targets = points_of(poses, link, at) + random.normal(size=(len(poses), 2)) * 0.25 * Lc
        results = [pulled(mechanism, *own[:1], link, at, *own[1:]) for own in zip(poses, targets, ways, strict=True)]
        ends, codes = np.array([pose for pose, _ in results]), np.array([found[1] for _, found in results])
        assert set(codes) <= {outlines.REACHED, outlines.NEAREST, SINGULAR}
        goals = targets[:, 0] + 1j * targets[:, 1]
        asked = [(*given, frame, Lc, *own, link, complex(*at)) for own in zip(poses, ends, strict=True)]
        close, first, rest = np.array([walk(*own, goal, h, 1.0) for own, goal in zip(asked, goals, strict=True)]).T
        for k in np.flatnonzero((rest > 0.0) & (close >= 2.0 * h)):  # from its dead centre a point goes both ways
            close[k] = walk(*asked[k], goals[k], h, -1.0)[0]
        for k in np.flatnonzero(close >= 4.0 * h):  # near gears whose centres nearly meet the way turns fast
            close[k], first[k], _ = walk(*asked[k], goals[k], h / 8.0, 1.0)
        assert (close < 4.0 * h).all(), (np.flatnonzero(close >= 4.0 * h), close.max(), mechanism)
        closed = residual([own for own in mechanism.joints if not isinstance(own, Gear)], ends)
        assert np.abs(closed).max() < 1e-12 * Lc
        stopped = codes == SINGULAR
        assert all(condition(mechanism, pose) > 1e6 for pose in ends[stopped]), mechanism
        near = (first < 4.0 * h) & ~stopped
        counts += [near.sum(), (~near & ~stopped).sum(), stopped.sum()]
        poses, ways = ends[~stopped], ways[~stopped]
        if not len(poses):
            break
    return counts


def test_pulls_end_where_tiny_steps_end() -> None:
    random = np.random.default_rng(11)
    same, on, _ = np.sum([agree(regular_mechanism(random), 2, 4, random, 2e-3) for _ in range(4)], axis=0)
    assert same >= 24 and on <= 8


@pytest.mark.slow
@pytest.mark.parametrize("part", range(10))
def test_ten_thousand_sequences_of_pulls_stay_on_their_branches(part: int) -> None:
    """A tenth of them: 100 sequences of up to three pulls on each of ten mechanisms."""
    random = np.random.default_rng([12, part])
    same, on, stopped = np.sum([agree(regular_mechanism(random), 3, 100, random, 4e-3) for _ in range(10)], axis=0)
    print(same, "ends of tiny steps,", on, "farther on them,", stopped, "singular")
    assert same + on + stopped >= 2000 and on <= 0.1 * same


def test_gear_pairs_have_lines_of_centres_of_their_own() -> None:
    """Two meshes on one frame, their lines of centres more than half a turn apart: it closes, and pulls move it."""
    graph, lines = MechanismGraph(4, [(0, 1), (0, 2), (0, 3), (1, 2, 2), (1, 3, 2)], frame=0), (-2.5, 2.5)
    at = [(far * math.cos(phi), far * math.sin(phi)) for far, phi in zip((3.0, 4.0), lines, strict=True)]
    pose = ((0.0, 0.0, 0.0), (0.0, 0.0, 0.3), (*at[0], -0.2), (*at[1], 0.1))
    joints: list[Any] = [Revolute(0, k, pose[k][:2]) for k in (1, 2, 3)]
    for link, radius, phi in zip((2, 3), (2.0, 3.0), lines, strict=True):
        offset = (pose[1][2] - phi) / radius + pose[link][2] - phi
        joints.append(Gear(1, link, radius_a=1.0, radius_b=radius, offset=offset))
    train = Mechanism(graph, joints, [], pose=pose)
    turned, (left, code, _) = pulled(train, pose, 1, (1.0, 0.0), (math.cos(1.3), math.sin(1.3)), np.zeros(9))
    assert code == outlines.REACHED and left < 1e-9
    assert np.abs(turned[:, 2] - (0.0, 1.3, -0.7, 0.1 - 1.0 / 3.0)).max() < 1e-9


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
