"""Distances of curve and outline against brute force; hidden curves come back; directions tell strokes apart."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np
import pytest

import graphsynth as gs
from graphsynth.design import DesignTask, PathTarget
from graphsynth.design.task.contours import ContourAim, Polygon, _Cubics, _nearest
from graphsynth.design.task.descend import descend
from graphsynth.design.task.model import Model
from graphsynth.design.task.plans import fitting
from graphsynth.design.task.problem import TaskProblem
from graphsynth.design.task.starts import from_mechanism, shaken
from graphsynth.kinematics.dimensional.design import Design

HIDDEN = gs.Mechanism.four_bar(4.0, 1.5, 3.5, 3.0, coupler_point=(1.6, 1.9))


def drawn(count: int) -> np.ndarray:
    """Points of the hidden curve."""
    return gs.simulate(HIDDEN, np.linspace(0.0, math.tau, count + 1)).point("P").position[:-1] @ [1.0, 1.0j]


def modelled(goal: np.ndarray, turned: float) -> tuple[TaskProblem, np.ndarray]:
    """Return the problem of drawing a closed path by four-bars, and the hidden one as a vector."""
    motion = gs.simulate(HIDDEN, np.linspace(0.0, math.tau, 9))
    task = DesignTask(targets=[PathTarget(points=[(p.real, p.imag) for p in goal], closed=True)], links=[4])
    pose = tuple((float(x), float(y), float(a)) for x, y, a in motion.poses[0])
    hidden = gs.Mechanism(HIDDEN.graph, HIDDEN.joints, HIDDEN.drivers, HIDDEN.points, pose)
    design = Design(hidden.graph, (hidden.drivers[0].pair,), ("R",) * 4)
    plan = next(own for own in fitting(task, design) if own.carriers == (hidden.points["P"].link,))
    given, sense = from_mechanism(task, plan, hidden)
    model = Model(task, plan, np.random.default_rng(0), given, sense)
    return TaskProblem(model, 0, turned), model.write(shaken(given, 12, np.random.default_rng(1)))


@pytest.mark.parametrize("count", [20, 64])
def test_a_hidden_curve_comes_back_to_rounding_though_its_points_are_a_polygon(count: int) -> None:
    problem, X = modelled(drawn(count), 0.05)
    found = descend(problem, X[1:6], 0.2, 60)
    assert found.error[0] < 1e-4  # in hundredths of the size: cubics between sixty samples
    assert problem.linearise(X[:1], None, 0.2)[0].error[0] < 1e-3


def test_distances_are_those_of_brute_force() -> None:
    """Far from the polygon, nearest points by a fine drawing of both."""
    goal = 1.3 * drawn(40) + 0.4 - 0.2j
    problem, X = modelled(goal, 1e-9)
    aim = problem.aims[0]
    assert isinstance(aim, ContourAim)
    u = problem.model.read(X[:1])
    moved = problem.model.move(u)
    values = aim.rows(aim.times(moved, u, None), *aim.looked(moved, np.zeros((1, 0))), u).values[0, 0]
    curve, sides = drawn(20_000), np.append(goal, goal[0])
    outline = np.concatenate([np.linspace(a, b, 500, endpoint=False) for a, b in pairwise(sides)])
    length = np.concatenate([[0.0], np.cumsum(np.abs(np.diff(np.append(curve, curve[0]))))])
    count = len(values) - len(goal)
    at = np.interp((np.arange(count) + 0.5) / count * length[-1], length, np.arange(20_001)).astype(int)
    far = np.abs(curve[at][:, None] - outline).min(axis=1) / aim.size
    assert np.abs(values[:count] - far).max() < 0.01 * far.max()
    back = np.abs(goal[:, None] - curve).min(axis=1) / aim.size * math.sqrt(count / len(goal))
    assert np.abs(values[count:] - back).max() < 1e-3 * back.max()


def test_slopes_are_those_of_differences() -> None:
    problem, X = modelled(1.3 * drawn(40) + 0.4 - 0.2j, 0.05)
    (_, r, J), _ = problem.linearise(X[:3], None, 0.2)
    random = np.random.default_rng(2)
    for way in random.normal(0.0, 1.0, (4, X.shape[1])):
        plus, minus = (problem.linearise(X[:3] + 1e-5 * sign * way, None, 0.2)[0].error ** 2 for sign in (1.0, -1.0))
        slope = 2.0 * np.einsum("sm,smi,i->s", r, J, way)
        assert (plus - minus) / 2e-5 == pytest.approx(slope, rel=0.05, abs=0.05 * np.abs(slope).max())


def test_directions_tell_the_sides_of_a_stroke_apart() -> None:
    """A point between two sides, nearer to the one that runs back, belongs to the one that runs its way."""
    bar = Polygon.of(np.array([[0.0, 1.0, 1.0 + 0.2j, 0.2j]]))
    curve = Polygon.of(np.array([[0.3 + 0.12j, 0.5 + 0.12j, 0.7 + 0.12j, 0.5 + 0.6j]]))
    fine = Polygon.of(
        np.concatenate([np.linspace(a, b, 20, endpoint=False) for a, b in zip(bar.z[0], np.roll(bar.z[0], -1))])[None]
    )
    near, _ = _nearest(curve, fine, fine, 1e-9)
    same, _ = _nearest(curve, fine, fine, 0.3)
    assert fine.z[0, near[0, 1]].imag == pytest.approx(0.2) and fine.z[0, same[0, 1]].imag == pytest.approx(0.0)
    assert fine.foot(curve.z, same)[0, 1] == pytest.approx(0.5)


def test_points_of_equal_distance_lie_on_the_curve() -> None:
    """Of an ellipse in cubics."""
    t = np.arange(60) * math.tau / 60
    z, v = (3.0 * np.cos(t) + 1j * np.sin(t))[None], (-3.0 * np.sin(t) + 1j * np.cos(t))[None] * t[1]
    curve = _Cubics(z, np.roll(z, -1, axis=1), v, np.roll(v, -1, axis=1))
    at, points = curve.equal()
    steps = np.abs(np.diff(points[0]))
    assert steps.max() < 1.01 * steps.min()
    assert np.abs((points.real / 3.0) ** 2 + points.imag**2 - 1.0).max() < 1e-3
    own, speed = curve.at(at)
    assert np.abs(own - points).max() < 1e-3 and np.abs(own.real**2 / 9.0 + own.imag**2 - 1.0).max() < 1e-5
    goal = 1.2 * own
    near = curve.at(curve.nearest(at[:, np.abs(goal[0][:, None] - points[0]).argmin(axis=1)], goal))
    assert np.abs((np.conj(near[1]) * (goal - near[0])).real).max() < 1e-3 * np.abs(speed).max()
