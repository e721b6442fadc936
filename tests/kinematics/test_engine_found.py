"""Mechanisms on which the engine once was wrong: a start replaced or refused, an escape called a fold, events lost."""

from __future__ import annotations

import math
import sys
from pathlib import Path

import numpy as np
import pytest
from scipy.optimize import brentq

from graphsynth.kinematics import simulate, simulate_batch
from graphsynth.kinematics.engine.codes import E_PP
from graphsynth.kinematics.engine.program import compile_program
from graphsynth.mechanism.constraints import residual
from graphsynth.mechanism.joints import Gear, PinSlot, Prismatic, Revolute
from graphsynth.mechanism.laws import Driver, Linear, Polynomial
from graphsynth.mechanism.model import Mechanism
from graphsynth.structure.graph import MechanismGraph

sys.path.insert(0, str(Path(__file__).parent))
from random_mechanisms import random_mechanism
from test_engine_campaign import one

TURN = np.linspace(0.0, -6.28, 73)


def found(name: str) -> Mechanism:
    return Mechanism.from_json((Path(__file__).parent / "found" / f"{name}.json").read_text(encoding="utf-8"))


def planet() -> Mechanism:
    """Carrier 1 with a planet 2 on a fixed wheel, and a bar 3-4 from the planet to the frame."""
    graph = MechanismGraph(5, [(0, 1), (1, 2), (0, 2, 2), (2, 3), (3, 4), (0, 4)], frame=0)
    joints = [
        Revolute(0, 1), Revolute(1, 2, (3.0, 0.0)), Gear(0, 2, radius_a=1.7, radius_b=1.3),
        Revolute(2, 3, (0.5, 0.0)), Revolute(3, 4, (6.0, 0.0), (6.0, 0.0)), Revolute(0, 4, (6.0, 1.0)),
    ]  # fmt: skip
    return Mechanism(graph, joints, [Driver(0, 1)])


# --- starts


def test_an_exact_start_after_a_gear_is_kept() -> None:
    mechanism = found("start_ignored")
    moved = simulate(mechanism, TURN).poses[0] - np.array(mechanism.pose)
    assert np.abs(moved).max() < 1e-13


@pytest.mark.parametrize("stop", [1.0, 9.0, 40.0, -30.0])
def test_a_motion_goes_on_from_its_last_pose_after_turns_of_a_planet(stop: float) -> None:
    """The line of centres has turned with the carrier; a pose tells it modulo a turn only."""
    mechanism = planet()
    whole = simulate(mechanism, np.linspace(0.0, 2.0 * stop, 41))
    rest = simulate(mechanism, np.linspace(stop, 2.0 * stop, 21), start=whole.poses[20])
    np.testing.assert_allclose(rest.poses, whole.poses[20:], atol=1e-12)
    inputs = np.linspace(stop, 2.0 * stop, 401)
    batch = simulate_batch(mechanism, inputs, mechanism.dimensions[None], start=whole.poses[20])
    assert batch.completed.all()
    np.testing.assert_allclose(batch.poses[0, ::20, :, :2], whole.poses[20:, :, :2], atol=1e-11)


@pytest.mark.parametrize("turns", [-3, 1, 20])
def test_the_law_may_count_other_turns_than_the_start_pose(turns: int) -> None:
    """The second wheel of a pair follows the pose; turns of the first that only the law counts do not move it."""
    graph = MechanismGraph(3, [(0, 1), (1, 2, 2), (0, 2)], frame=0)
    joints = [Revolute(0, 1), Gear(1, 2, radius_a=1.7, radius_b=1.3, offset=0.3), Revolute(0, 2, (3.0, 0.0))]
    pose = simulate(Mechanism(graph, joints, [Driver(0, 1)]), [1.0]).poses[0]
    other = Mechanism(graph, joints, [Driver(0, 1, Linear(1.0, math.tau * turns))], pose=pose)
    np.testing.assert_allclose(simulate(other, [1.0, 1.5]).poses[0], pose, atol=1e-12)
    batch = simulate_batch(other, [1.0, 1.5], other.dimensions[None])
    np.testing.assert_allclose(np.exp(1j * batch.poses[0, 0, :, 2]), np.exp(1j * pose[:, 2]), atol=1e-12)


@pytest.mark.parametrize("mode", [1, -1])
def test_a_batch_takes_the_modes_of_the_start_pose(mode: int) -> None:
    mechanism = planet()
    pose = simulate(mechanism, [0.5], modes={1: mode}).poses[0]
    batch = simulate_batch(mechanism, [0.5, 0.51], mechanism.dimensions[None], start=pose)
    np.testing.assert_allclose(np.exp(1j * batch.poses[0, 0, :, 2]), np.exp(1j * pose[:, 2]), atol=1e-12)


def test_an_ill_conditioned_start_is_judged_by_its_rounding() -> None:
    mechanism = found("start_refused")
    motion = simulate(mechanism, np.linspace(0.0, -1e-5, 5))  # its branch folds at -1.05e-5 and at 4.03e-5
    assert motion.completed
    np.testing.assert_allclose(motion.poses[0], mechanism.pose, atol=1e-11)


@pytest.mark.parametrize("seed", [4, 1152])
def test_angles_of_wheels_do_not_drift_from_their_directions(seed: int) -> None:
    """Gears count angles, other joints use cosines and sines: after thousands of steps both tell the same pose."""
    random = np.random.default_rng(seed)
    mechanism, way = random_mechanism(random), float(random.choice([-6.28, 6.28]))
    end = 0.9 * simulate(mechanism, np.linspace(0.0, way, 73)).stopped_at
    assert simulate(mechanism, np.linspace(0.0, end, 5000), events=False).residual < 1e-14


# --- ends


def test_an_escape_to_infinity_is_told_and_located() -> None:
    """A wheel on a guide: its line of centres has a given direction, and no place where that is the guide's own."""
    mechanism = found("infinity_as_fold")
    slide, gear, _ = mechanism.joints
    assert isinstance(slide, Prismatic) and isinstance(gear, Gear)
    event = simulate(mechanism, TURN).events[-1]
    turned = slide.angle_b - slide.angle_a
    rate = gear.radius_b / (gear.radius_a + gear.radius_b)
    centres = turned + (mechanism.drivers[0].law(np.array([0.0]))[0][0] - gear.offset - turned) * rate
    exact = max(((slide.angle_b + k * math.pi - centres) / -rate for k in range(-9, 10)), key=lambda u: (u < 0.0, u))
    assert event.kind == "escape" and event.ends_motion and event.links == (0,)
    assert abs(event.input - exact) <= event.uncertainty < 1e-10
    assert "infinity" in event.statement


@pytest.mark.long
@pytest.mark.parametrize("seed", [202, pytest.param(1141, marks=pytest.mark.long), 1292, 1478])
def test_escapes_are_located_whatever_hangs_on_the_link(seed: int) -> None:
    """Larger groups, parallel guides, and groups that are lost before: against the poses on the way."""
    random = np.random.default_rng(seed)
    mechanism = random_mechanism(random)
    way = float(random.choice([-6.28, 6.28]))
    event = simulate(mechanism, np.linspace(0.0, way, 73)).events[-1]
    near = event.input * (1.0 - np.geomspace(1e-2, 1e-3, 7))
    size = np.abs(simulate(mechanism, [0.0, *near], events=False).poses[1:, event.links[0], :2]).max(axis=1)
    exact = sum(u * math.prod(y / (y - x) for j, y in enumerate(1.0 / size) if j != k)
                for k, (u, x) in enumerate(zip(near, 1.0 / size)))  # fmt: skip
    assert event.kind == "escape" and abs(event.input - exact) < 1e-8


@pytest.mark.long
@pytest.mark.parametrize("seed", [3, 4])
def test_centres_of_gears_that_coincide_end_the_motion(seed: int) -> None:
    random = np.random.default_rng(seed)
    mechanism = random_mechanism(random)
    way = float(random.choice([-6.28, 6.28]))
    motion = simulate(mechanism, np.linspace(0.0, way, 73))
    assert motion.events[-1].kind == "singular" and "centres of the gear pair" in motion.reason
    close = simulate(mechanism, [0.0, motion.stopped_at * (1.0 - 1e-9)], events=False).poses[-1]
    apart = []
    for joint in mechanism.joints:
        if isinstance(joint, Gear):
            P, Q = (complex(*close[k, :2]) + np.exp(1j * close[k, 2]) * complex(*at)
                    for k, at in ((joint.a, joint.at_a), (joint.b, joint.at_b)))  # fmt: skip
            apart.append(abs(Q - P))
    assert min(apart) < 1e-6


# --- dead centres


def test_a_dead_centre_in_the_last_step_is_found() -> None:
    mechanism = found("dead_centre_lost")
    for stop in (-6.28, -2.2235):
        events = simulate(mechanism, np.linspace(0.0, stop, 73)).events
        late = [event for event in events if event.kind == "dead centre" and event.input < -2.2]
        assert len(late) == 1 and abs(late[0].input + 2.2176893325975655) < 1e-9


@pytest.mark.parametrize("apart", [1e-4, 1e-3, 1e-2])
def test_two_dead_centres_between_samples_are_found(apart: float) -> None:
    """A law with the rate 3 u^2 - 3 apart^2 turns the whole mechanism back for a moment."""
    graph = MechanismGraph(4, [(0, 1), (1, 2), (2, 3), (0, 3)], frame=0)
    joints = [
        Revolute(0, 1), Revolute(1, 2, (1.0, 0.0)), Revolute(2, 3, (2.5, 0.0), (2.5, 0.0)), Revolute(0, 3, (2.0, 0.0)),
    ]  # fmt: skip
    law = Polynomial((1.0, -3.0 * apart**2, 0.0, 1.0))
    events = simulate(Mechanism(graph, joints, [Driver(0, 1, law)]), np.linspace(-0.5, 0.61, 6)).events
    at = [event.input for event in events if event.kind == "dead centre"]
    np.testing.assert_allclose(at, [-apart, apart], atol=1e-9)


def test_a_link_that_does_not_turn_has_no_dead_centres() -> None:
    """Its angle is constant, and the sign of its speed is that of rounding."""
    random = np.random.default_rng(1227)
    motion = simulate(random_mechanism(random), np.linspace(0.0, float(random.choice([-6.28, 6.28])), 73))
    assert np.ptp(motion.poses[motion.assembled, 1, 2]) < 1e-12
    assert not [event for event in motion.events if event.kind == "dead centre" and event.links == (1,)]
    assert np.abs(residual(motion.mechanism.joints, motion.poses[motion.assembled])).max() < 1e-11


# --- between samples

BETWEEN = [
    (10606, "singular"),  # centres of gears meet between two samples
    (18016, "singular"),
    (12096, "singular"),
    (11457, "fold"),  # a group folds right after the start, and another pose of it fits by chance
    (16724, "fold"),  # a dyad cannot be assembled on a stretch after the first sample
    (18978, "fold"),
    (17409, "escape"),  # a dyad hangs on the link that is lost
    (9373, "escape"),
    (17837, "escape"),
]


@pytest.mark.long
@pytest.mark.parametrize(("seed", "kind"), BETWEEN)
def test_what_happens_between_samples_is_told(seed: int, kind: str) -> None:
    ended, faults = one(seed)
    assert (ended, faults) == (kind, [])


def rocker_with_slide(short: float) -> tuple[Mechanism, float]:
    """Crank-rocker whose rocker guides the pin of a slide; at the outer dead centre it has passed the slide's line.

    Returned is also the crank angle before the dead centre at which slot and slide are parallel, from triangles:
    there the rocker's angle is ``short`` away from its extreme.
    """
    a, b, c, d = 1.0, 3.0, 2.0, 3.0

    def rocker(crank: float) -> float:
        x, y = a * math.cos(crank) - d, a * math.sin(crank)
        r = math.hypot(x, y)
        return math.atan2(y, x) - math.acos((c * c + r * r - b * b) / (2.0 * c * r))

    dead = math.acos((d * d + (a + b) ** 2 - c * c) / (2.0 * d * (a + b)))
    direction = rocker(dead) + math.copysign(short, rocker(dead - 0.1) - rocker(dead))
    parallel = float(brentq(lambda u: rocker(u) - direction, dead - 0.3, dead, xtol=1e-15))
    graph = MechanismGraph(5, [(0, 1), (1, 2), (2, 3), (0, 3), (0, 4), (3, 4, 2)], frame=0)
    joints = [
        Revolute(0, 1), Revolute(1, 2, (a, 0.0)), Revolute(2, 3, (b, 0.0), (c, 0.0)), Revolute(0, 3, (d, 0.0)),
        Prismatic(0, 4, (1.0, 5.0), (0.0, 0.0), direction, 0.0), PinSlot(3, 4, (0.0, 0.5), (0.0, 0.0), 0.0),
    ]  # fmt: skip
    return Mechanism(graph, joints, [Driver(0, 1)]), parallel


@pytest.mark.parametrize("short", [1e-3, 3e-5, 1e-6])
@pytest.mark.parametrize("shift", [0.0, 0.3, 0.7])
def test_guides_that_are_parallel_twice_between_samples(short: float, shift: float) -> None:
    mechanism, parallel = rocker_with_slide(short)
    start = parallel - 0.2 - math.radians(shift)
    for last in (parallel + 0.3, parallel + 1e-3):
        motion = simulate(mechanism, [start, last], modes={0: 1})
        end = motion.events[-1]
        assert end.kind == "escape" and 4 in end.links
        assert end.input == pytest.approx(parallel, abs=1e-12 / math.sqrt(short) + end.uncertainty)


def test_a_dyad_that_cannot_be_assembled_on_a_stretch_in_the_first_step() -> None:
    """It opens where the distance of its ends exceeds its two lengths, and could be closed again soon after."""
    a, d = 1.0, 3.0
    for reach in (4.0 - 1e-6, 4.0 - 3e-8):  # the distance is largest, 4, at a crank angle of pi
        graph = MechanismGraph(4, [(0, 1), (1, 2), (2, 3), (0, 3)], frame=0)
        joints = [Revolute(0, 1), Revolute(1, 2, (a, 0.0)), Revolute(2, 3, (reach - 1.8, 0.0), (1.8, 0.0)),
                  Revolute(0, 3, (d, 0.0))]  # fmt: skip
        mechanism = Mechanism(graph, joints, [Driver(0, 1)])
        fold = math.acos((a * a + d * d - reach * reach) / (2.0 * a * d))
        for start, last in (
            (fold - 1e-5, fold + 0.02),
            (2.0 * math.pi - fold + 1e-5, fold - 1e-4),
            (fold - 0.01, 2.0 * math.pi - fold + 1e-5),
        ):
            motion = simulate(mechanism, [start, last], modes={0: 1})
            first = fold if last > start else 2.0 * math.pi - fold
            assert not motion.completed and motion.events[-1].kind == "fold"
            assert motion.stopped_at == pytest.approx(first, abs=1e-9)


@pytest.mark.parametrize(("seed", "link"), [(13, 7), (19, 7), (21, 1), (66, 9), (81, 3)])
def test_rates_of_a_link_that_slides_on_two_others_that_move(seed: int, link: int) -> None:
    """Velocities and accelerations are the differences of the poses, to the second order of their step."""
    mechanism = random_mechanism(np.random.default_rng(seed))
    eliminated = compile_program(mechanism).tables.eliminated
    assert (E_PP, link) in {(int(kind), int(e)) for kind, e in eliminated[:, :2]}
    h = 1e-4
    motion = simulate(mechanism, h * np.arange(5.0), events=False)
    x, v, a = (part[:, link] for part in (motion.poses, motion.velocities, motion.accelerations))
    first = (x[:-4] - 8.0 * x[1:-3] + 8.0 * x[3:-1] - x[4:]) / (12.0 * h)
    second = (v[:-4] - 8.0 * v[1:-3] + 8.0 * v[3:-1] - v[4:]) / (12.0 * h)
    np.testing.assert_allclose(v[2:-2], first, rtol=1e-8, atol=1e-8)
    np.testing.assert_allclose(a[2:-2], second, rtol=1e-8, atol=1e-8)
