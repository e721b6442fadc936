"""Gradients of poses by dimensions against those of poses of 50 digits, each dimension moved by 1e-20."""

from __future__ import annotations

import copy
from functools import cache

import mpmath
import numpy as np
import pytest

from graphsynth.core.errors import GeometryError
from graphsynth.kinematics.dimensional import embody
from graphsynth.kinematics.engine.batch import simulate_batch
from graphsynth.kinematics.engine.gradients import pose_gradients, rate_gradients
from graphsynth.mechanism.equations import Plane, seen
from graphsynth.mechanism.joints import COLUMNS
from graphsynth.mechanism.model import Mechanism
from graphsynth.structure.graph import MechanismGraph
from graphsynth.synthesis import enumerate_chains

STEP = mpmath.mpf("1e-20")
PRECISE = Plane(mpmath.sin, mpmath.cos, mpmath.hypot, mpmath.atan2)
FIVE = [(0, 1), (1, 2), (2, 3), (3, 4), (0, 4)]
#: The dimensions of every kind, and the column of each.
OWN = {
    "R": ("at_a", "at_b"),
    "P": ("at_a", "at_b", "angle_a", "angle_b"),
    "pin-slot": ("at_a", "at_b", "angle_a"),
    "gear": ("at_a", "at_b", "offset"),
    "cam": ("at_a", "at_b", "angle_a", "radius"),
}
PLACE = {"angle_a": "a_angle", "angle_b": "b_angle", "offset": "offset", "radius": "radius_a"}


@cache
def mechanism(name: str) -> Mechanism:
    four = MechanismGraph(4, [(0, 1), (1, 2), (2, 3), (0, 3)], frame=0)
    found = {
        "four-bar": lambda: embody(four),
        "slider-crank": lambda: embody(four, driver=1, joints={(0, 3): "P"}),
        "slider driven": lambda: embody(four, driver=1, joints={(0, 1): "P"}),
        "floating driver": lambda: embody(MechanismGraph(5, FIVE, frame=0).with_frame(0), driver=[(0, 1), (0, 4)]),
        "class III": lambda: embody(list(enumerate_chains(8))[9]),
        "one group of six": lambda: embody(list(enumerate_chains(8))[15]),
        "planet": lambda: embody(MechanismGraph(5, [*FIVE, (0, 2, 2)], frame=0), driver=1),
        "slot": lambda: embody(MechanismGraph(5, [*FIVE, (0, 2, 2)], frame=0), driver=1, joints={(0, 2): "pin-slot"}),
        "cam": lambda: embody(MechanismGraph(5, [*FIVE, (1, 3, 2)], frame=0), joints={(1, 3): "cam"}),
    }[name]().mechanism
    assert found is not None
    return found


def equations(joints: list, drivers: list, q: list, coordinates: list) -> list:
    """All joints, and the driven coordinates, in 50 digits."""
    links = [(mpmath.mpf(0),) * 3, *(tuple(q[3 * k : 3 * k + 3]) for k in range(len(q) // 3))]
    rows = []
    for joint in joints:
        rows += joint.values(seen(PRECISE, joint, links[joint.a], links[joint.b]))
    for (pair, base), value in zip(drivers, coordinates):
        joint = next(j for j in joints if j.pair == pair)
        own, _ = joint.coordinate(seen(PRECISE, joint, links[joint.a], links[joint.b]))
        rows.append(own * (1 if base == joint.a else -1) - value)
    return rows


def rows_of(joints: list, drivers: list, q: list, coordinates: list) -> mpmath.matrix:
    """Errors of the equations; a whole turn of an angle is none."""
    rows = equations(joints, drivers, q, coordinates)
    return mpmath.matrix([r - 2 * mpmath.pi * mpmath.nint(r / (2 * mpmath.pi)) if abs(r) > 3 else r for r in rows])


def inverse(joints: list, drivers: list, q: list, coordinates: list) -> mpmath.matrix:
    """Of the slopes of the equations, each link moved by a step."""
    rows = rows_of(joints, drivers, q, coordinates)
    J = mpmath.matrix(len(rows), len(q))
    for c in range(len(q)):
        J[:, c] = (rows_of(joints, drivers, [a + STEP * (c == k) for k, a in enumerate(q)], coordinates) - rows) / STEP
    return J**-1


def solved(joints: list, drivers: list, q: list, coordinates: list, held: mpmath.matrix = None) -> list:
    """Poses of 50 digits; with slopes that are held Newton's steps still gain their digits, as the change is small."""
    for _ in range(8):
        slopes = inverse(joints, drivers, q, coordinates) if held is None else held
        step = slopes * rows_of(joints, drivers, q, coordinates)
        q = [a - b for a, b in zip(q, step)]
        if max(abs(s) for s in step) < mpmath.mpf("1e-46"):
            return q
    raise AssertionError("no pose of 50 digits")


def precise(own: Mechanism, pose: np.ndarray, coordinates: list) -> dict[tuple[int, int], list]:
    """Derivative of all poses by every dimension: joint, column."""
    joints = [copy.copy(joint) for joint in own.joints]
    for joint in joints:
        for name, value in list(vars(joint).items()):
            if isinstance(value, tuple) and name.startswith("at_"):
                object.__setattr__(joint, name, tuple(map(mpmath.mpf, value)))
            elif isinstance(value, float):
                object.__setattr__(joint, name, mpmath.mpf(value))
    drivers = [(driver.pair, driver.base) for driver in own.drivers]
    start = [mpmath.mpf(float(value)) for value in pose[1:].ravel()]
    rest = solved(joints, drivers, start, coordinates)
    held = inverse(joints, drivers, rest, coordinates)
    found = {}
    for k, joint in enumerate(joints):
        for name in OWN[joint.kind]:
            before = getattr(joint, name)
            for axis in range(2 if name.startswith("at_") else 1):
                sides = []
                for sign in (1, -1):
                    if name.startswith("at_"):
                        value = tuple(v + (sign * STEP if a == axis else 0) for a, v in enumerate(before))
                    else:
                        value = before + sign * STEP
                    object.__setattr__(joint, name, value)
                    sides.append(solved(joints, drivers, rest, coordinates, held))
                object.__setattr__(joint, name, before)
                column = {"at_a": "ab"[0], "at_b": "b"}.get(name)
                place = f"{column}{'xy'[axis]}" if column else PLACE[name]
                found[k, COLUMNS.index(place)] = [(a - b) / (2 * STEP) for a, b in zip(*sides)]
    return found


@pytest.mark.long
@pytest.mark.parametrize(
    "name",
    ["four-bar", "slider-crank", "slider driven", "floating driver", "planet", "slot", "cam", "class III",
     "one group of six"],
)  # fmt: skip
def test_every_dimension_to_the_last_digits(name: str) -> None:
    own = mechanism(name)
    u, links = np.array([0.2, 0.7]), own.graph.links
    sets = own.dimensions[None]
    frames = simulate_batch(own, u, sets).frames
    poses = own.simulate(u).poses
    loads = np.zeros((1, 3 * (links - 1), links, 3, 2))
    for k in range(3 * (links - 1)):
        loads[0, k, 1 + k // 3, k % 3] = 1.0
    found = pose_gradients(own, sets, frames, loads).dimensions[0, :, :, :, 1]
    with mpmath.workdps(50):
        coordinates = [mpmath.mpf(float(driver.law(u)[0][1])) for driver in own.drivers]
        expected = precise(own, poses[1], coordinates)
        rest = np.zeros_like(found)
        for (k, column), values in expected.items():
            rest[:, k, column] = [float(value) for value in values]
    assert np.abs(found - rest).max() < 1e-11 * max(1.0, np.abs(rest).max())


@pytest.mark.parametrize(
    "name", ["four-bar", "slider-crank", "planet", "slot", "cam", pytest.param("class III", marks=pytest.mark.long)]
)
def test_rates_of_the_derivatives_to_ten_digits(name: str) -> None:
    """The derivative of a velocity by a dimension is the rate of the pose's, here from poses at two inputs nearby."""
    own = mechanism(name)
    u, links, near = np.array([0.2, 0.7]), own.graph.links, mpmath.mpf("1e-10")
    sets = own.dimensions[None]
    motion = simulate_batch(own, u, sets)
    loads = np.zeros((1, 3 * (links - 1), links, 3, 2))
    for k in range(3 * (links - 1)):
        loads[0, k, 1 + k // 3, k % 3] = 1.0
    found = rate_gradients(own, sets, motion.frames, motion.velocities, loads).dimensions[0, :, :, :, 1]
    with mpmath.workdps(50):
        at = [mpmath.mpf(float(driver.law(u)[0][1])) for driver in own.drivers]
        sides = [precise(own, own.simulate(u).poses[1], [value + sign * near for value in at]) for sign in (1, -1)]
        rest = np.zeros_like(found)
        for (k, column), values in sides[0].items():
            rest[:, k, column] = [float((a - b) / (2 * near)) for a, b in zip(values, sides[1][k, column])]
    assert np.abs(found - rest).max() < 1e-10 * max(1.0, np.abs(rest).max())


def test_loads_add_up_and_results_are_of_each_sample() -> None:
    own = mechanism("class III")
    sets = np.repeat(own.dimensions[None], 2, axis=0)
    sets[1, :, :2] *= 1.0 + 1e-3
    frames = simulate_batch(own, np.linspace(0.0, 0.5, 5), sets).frames
    random = np.random.default_rng(3)
    one, two = random.normal(size=(2, 2, 1, own.graph.links, 3, 5))
    both = pose_gradients(own, sets, frames, np.concatenate([one, two, one + 2.0 * two], axis=1))
    for part in both:
        assert part[:, 2] == pytest.approx(part[:, 0] + 2.0 * part[:, 1], rel=1e-9, abs=1e-9)
    alone = pose_gradients(own, sets[1:], frames[1:, 3:4], one[1:, ..., 3:4])
    assert alone.dimensions[0, 0, ..., 0] == pytest.approx(both.dimensions[1, 0, ..., 3], rel=1e-12, abs=1e-12)


def test_the_driver_takes_what_the_velocity_says() -> None:
    """By the driver coordinate the derivative of a pose is its velocity over that of the driver."""
    for name in ("four-bar", "slider-crank", "slider driven", "class III"):
        own = mechanism(name)
        motion = simulate_batch(own, np.array([0.2, 0.7]), own.dimensions[None])
        links = own.graph.links
        loads = np.zeros((1, links, links, 3, 2))
        for link in range(links):
            loads[0, link, link, 2] = 1.0
        by_driver = pose_gradients(own, own.dimensions[None], motion.frames, loads).drivers[0, :, 0]
        # laws of mechanisms that are found are the input plus a constant
        assert pytest.approx(motion.velocities[0, :, :, 2], rel=1e-9, abs=1e-9) == by_driver.T


def test_shapes_are_named() -> None:
    own = mechanism("four-bar")
    frames = np.zeros((1, 2, 4, 4))
    with pytest.raises(GeometryError, match=r"give \(1, directions, 4, 3, 2\)"):
        pose_gradients(own, own.dimensions[None], frames, np.zeros((1, 4, 3, 2)))
    with pytest.raises(GeometryError, match=r"give \(sets, 4, 10\) and"):
        pose_gradients(own, own.dimensions, frames, np.zeros((1, 1, 4, 3, 2)))
