"""Distances of curve and outline against brute force; hidden curves come back; directions tell strokes apart."""

from __future__ import annotations

import math
from collections.abc import Callable
from itertools import pairwise
from typing import Any

import numpy as np
import pytest

import graphsynth as gs
from graphsynth.design import DesignTask, PathTarget
from graphsynth.design.task.aims import bands, beside
from graphsynth.design.task.answers import _passed
from graphsynth.design.task.contours import ContourAim, Polygon, _Cubics, _nearest
from graphsynth.design.task.descend import descend
from graphsynth.design.task.growth import grown, promised
from graphsynth.design.task.model import Model, Unknowns
from graphsynth.design.task.plans import fitting
from graphsynth.design.task.problem import TaskProblem
from graphsynth.design.task.starts import from_mechanism, shaken
from graphsynth.design.task.targets import evenly
from graphsynth.kinematics.dimensional.design import Design

HIDDEN = gs.Mechanism.four_bar(4.0, 1.5, 3.5, 3.0, coupler_point=(1.6, 1.9))


def drawn(count: int) -> Any:
    """Points of the hidden curve."""
    return gs.simulate(HIDDEN, np.linspace(0.0, math.tau, count + 1)).point("P").position[:-1] @ [1.0, 1.0j]


def modelled(goal: np.ndarray, turned: float, **more: Any) -> tuple[TaskProblem, np.ndarray]:
    """Return the problem of drawing a path by four-bars, closed if nothing else is said, and the hidden one."""
    motion = gs.simulate(HIDDEN, np.linspace(0.0, math.tau, 9))
    path = PathTarget(points=[(p.real, p.imag) for p in goal], closed=not more)
    task = DesignTask(targets=[path], links=[4], **more)
    pose = tuple((float(x), float(y), float(a)) for x, y, a in motion.poses[0])
    hidden = gs.Mechanism(HIDDEN.graph, HIDDEN.joints, HIDDEN.drivers, HIDDEN.points, pose)
    design = Design(hidden.graph, (hidden.drivers[0].pair,), ("R",) * 4)
    plan = next(own for own in fitting(task, design) if own.carriers == (hidden.points["P"].link,))
    given, sense = from_mechanism(task, plan, hidden)
    model = Model(task, plan, np.random.default_rng(0), given, sense)
    return TaskProblem(model, 0, turned), model.write(shaken(given, 12, np.random.default_rng(1)))


@pytest.mark.long
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
    own = aim.seen(moved, u)
    z: Any = own.frames[..., :2] @ [1.0, 1.0j]
    v: Any = own.rates[..., :2] @ [1.0, 1.0j]
    h = np.diff(own.u)
    cubics = _Cubics(z[:, :-1], z[:, 1:], v[:, :-1] * h, v[:, 1:] * h)
    at = cubics.at(cubics.spread())[0][0]
    curve, sides = drawn(20_000), np.append(goal, goal[0])
    outline = np.concatenate([np.linspace(a, b, 500, endpoint=False) for a, b in pairwise(sides)])
    apart = np.abs(at[:, None] - outline)
    far = np.maximum(apart.min(axis=1) - bands(goal)[apart.argmin(axis=1) // 500], 0.0) / aim.size
    count = len(values) - len(goal)
    assert count == len(at) and np.abs(values[:count] - far).max() < 0.01 * far.max()
    back = np.abs(goal[:, None] - curve).min(axis=1) / aim.size * math.sqrt(count / len(goal))
    assert np.abs(values[count:] - back).max() < 1e-3 * back.max()


def test_an_open_path_is_looked_for_along_the_curve_which_may_go_on() -> None:
    """A third of the curve, in a range that is longer: exact on the hidden one, elsewhere the distances of brute force.

    Beyond the ends of the range there is no curve.
    """
    every = drawn(2000)
    part = every[100:600:6]
    problem, X = modelled(part, 0.05, drive="rocking", span=2.2)
    assert isinstance(problem.aims[0], ContourAim) and problem.linearise(X[:1], None, 0.2)[0].error[0] < 1e-3
    goal = 1.02 * part + 0.03 - 0.02j
    problem, X = modelled(goal, 1e-9, drive="rocking", span=2.2)
    aim, u = problem.aims[0], problem.model.read(X[:1])
    moved = problem.model.move(u)
    assert isinstance(aim, ContourAim)
    values = aim.rows(aim.times(moved, u, None), *aim.looked(moved, np.zeros((1, 0))), u).values[0, 0]
    reached = every[: round(2.2 / math.tau * 2000) + 1]
    far = np.abs(goal[:, None] - reached).min(axis=1) / aim.size
    assert len(values) == len(goal) and np.abs(values - far).max() < 0.02 * far.max()
    (_, r, J), _ = problem.linearise(X[1:3], None, 0.2)
    for way in np.random.default_rng(2).normal(0.0, 1.0, (4, X.shape[1])):
        plus, minus = (problem.linearise(X[1:3] + 1e-5 * sign * way, None, 0.2)[0].error ** 2 for sign in (1.0, -1.0))
        slope = 2.0 * np.einsum("sm,smi,i->s", r, J, way)
        assert (plus - minus) / 2e-5 == pytest.approx(slope, rel=0.05, abs=0.05 * np.abs(slope).max())


@pytest.mark.parametrize("curve", [lambda t: np.exp(1j * t), lambda t: 3.0 * np.cos(t) + 1j * np.sin(t)])
@pytest.mark.parametrize("count", [24, 60])
def test_a_smooth_curve_lies_in_the_bands_of_its_polygon(curve: Callable[[Any], Any], count: int) -> None:
    corners = evenly(curve(np.linspace(0.0, math.tau, 10_001)), count, True)
    fine = curve(np.linspace(0.0, math.tau, 2000))
    assert np.abs(beside(fine, corners) - fine).max() < 1e-12
    assert np.abs(beside(1.2 * fine, corners) - 1.2 * fine).max() > 0.1


def test_nothing_beyond_a_sharp_corner_lies_in_a_band() -> None:
    """A curve that runs there and back on a line may not go on at its ends."""
    corners: Any = np.concatenate([np.linspace(0.0, 1.0, 11), np.linspace(0.9, 0.1, 9)]) + 0j
    assert bands(corners).max() == 0.0
    assert beside(np.array([1.001 + 0j, 0.5 + 0.001j]), corners).tolist() == [1.0, 0.5]


def test_a_corner_is_passed_by_a_curve_that_runs_its_way() -> None:
    square: Any = np.array([0.0, 1.0, 1.0 + 1.0j, 1.0j])
    there: Any = np.append(square, 0.0)
    assert _passed(there, square) == 0.0 and _passed(there + 0.01, square) == pytest.approx(0.01)
    assert _passed(there[::-1], square) > 0.9
    line: Any = np.array([0.0, 0.5, 1.0, 0.5]) + 0j  # there and back
    assert _passed(np.append(line, line[:1]), line) == 0.0


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


def test_points_along_the_curve_are_spread_over_it_and_over_its_samples() -> None:
    """Of an ellipse in cubics."""
    t = np.arange(60) * math.tau / 60
    z, v = (3.0 * np.cos(t) + 1j * np.sin(t))[None], (-3.0 * np.sin(t) + 1j * np.cos(t))[None] * t[1]
    curve = _Cubics(z, np.roll(z, -1, axis=1), v, np.roll(v, -1, axis=1))
    at = curve.spread()
    assert (np.diff(at[0]) >= 0.0).all() and set(range(60)) <= set(at[0].tolist())
    equal = np.setdiff1d(at[0], np.arange(60))[None]
    own, speed = curve.at(equal)
    steps = np.abs(np.diff(own[0]))
    assert len(steps) > 90 and steps.max() < 1.02 * steps.min()
    assert np.abs(own.real**2 / 9.0 + own.imag**2 - 1.0).max() < 1e-5
    goal = 1.2 * own
    near = curve.at(curve.nearest(equal[:, np.abs(goal[0][:, None] - own[0]).argmin(axis=1)], goal))
    assert np.abs((np.conj(near[1]) * (goal - near[0])).real).max() < 1e-3 * np.abs(speed).max()


def test_a_mechanism_with_a_dyad_more_draws_the_same_but_for_the_distance_of_its_point() -> None:
    problem, X = modelled(drawn(40), 0.05)
    model, random, links = problem.model, np.random.default_rng(3), set()

    def traced(of: TaskProblem, u: Unknowns) -> Any:
        aim, moved = of.aims[0], of.model.move(u)
        assert isinstance(aim, ContourAim) and moved.complete.all()
        return aim.seen(moved, u).frames[..., :2] @ [1.0, 1.0j]

    before = traced(problem, model.read(X[:1]))
    for _ in range(12):
        more = grown(model, X[0], 40, random)
        assert more is not None and len(more.plan.design.kinds) == 7
        given, sense = from_mechanism(model.task, more.plan, more.mechanism)
        larger = Model(model.task, more.plan, random, given, sense)
        found = TaskProblem(larger, 0, 0.05)
        after = traced(found, larger.read(larger.write(more.every)))
        assert np.abs(after - before) == pytest.approx(3e-3 * model.task.size, rel=1e-6)
        links |= {joint.a for joint in more.plan.design.graph.joints if joint.b == 5}
    assert links == {0, 1, 3, 4}  # of the four-bar all but the coupler, and its own


def test_promised_errors_are_those_of_damped_least_squares() -> None:
    problem, X = modelled(1.1 * drawn(40), 0.05)
    error = promised(problem, X).error
    (before, r, J), _ = problem.linearise(X, None, 0.2)
    good = np.flatnonzero(np.isfinite(before))
    assert len(good) > 5 and np.isinf(error[np.isinf(before)]).all()
    for k in good:
        damped = np.concatenate([J[k], np.diag(math.sqrt(1e-3) * np.linalg.norm(J[k], axis=0))])
        step = np.linalg.lstsq(damped, -np.append(r[k], np.zeros(X.shape[1])), rcond=None)[0]
        assert error[k] == pytest.approx(np.linalg.norm(damped @ step + np.append(r[k], np.zeros(len(step)))), rel=1e-3)
        assert error[k] < before[k]
