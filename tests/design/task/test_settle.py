"""The last stage of one candidate, against closed forms, brute force, and optima known otherwise."""

from __future__ import annotations

import itertools
import math
from typing import Any

import numpy as np
import pytest

import graphsynth as gs
from graphsynth.design import DesignTask, FunctionTarget, PathTarget, SwingTarget
from graphsynth.design.task.answers import built
from graphsynth.design.task.descend import descend
from graphsynth.design.task.model import Model
from graphsynth.design.task.plans import plans
from graphsynth.design.task.problem import Exact, TaskProblem
from graphsynth.design.task.settle import least_squares, levelled, settled
from graphsynth.design.task.starts import from_mechanism, placed_starts, random_starts, shaken


def begun(task: DesignTask, seed: int, count: int = 1) -> tuple[TaskProblem, Any]:
    random = np.random.default_rng(seed)
    model = Model(task, next(plans(task, 4)), random)
    problem = TaskProblem(model)
    X, times = placed_starts(problem, random_starts(model, 300, random), 20, random)
    return problem, descend(problem, X, 3.0, 40, times).X[:count]


def test_bounded_least_squares_are_those_of_all_sets_of_active_bounds() -> None:
    random = np.random.default_rng(3)
    for _ in range(12):
        J, r, A = random.normal(size=(6, 3)), random.normal(size=6), random.normal(size=(4, 3))
        b = A @ random.normal(size=3) + random.uniform(0.0, 1.0, 4)  # something keeps them
        H, g = J.T @ J, J.T @ r
        least = math.inf
        for chosen in itertools.chain.from_iterable(itertools.combinations(range(4), k) for k in range(4)):
            own = A[[*chosen]]
            n = len(own)
            system = np.block([[H, own.T], [own, np.zeros((n, n))]])
            d = np.linalg.solve(system, np.concatenate([-g, b[[*chosen]]]))[:3]
            if (A @ d <= b + 1e-9).all():
                least = min(least, 0.5 * d @ H @ d + g @ d)
        step, pull = least_squares(H, g, A, b)
        assert step is not None and (A @ step <= b + 1e-9).all() and (pull >= 0.0).all()
        assert H @ step + g + A.T @ pull == pytest.approx(np.zeros(3), abs=1e-9)
        assert (pull * (A @ step - b)) == pytest.approx(np.zeros(4), abs=1e-9)
        assert 0.5 * step @ H @ step + g @ step == pytest.approx(least, abs=1e-9)
    assert least_squares(np.eye(1), np.zeros(1), np.array([[1.0], [-1.0]]), np.array([-1.0, -1.0]))[0] is None


class Flat:
    """Two errors whose sum of squares is 10 - 0.02 x + 0.01 x^2, though each of them is a hundred times as steep."""

    def exactly(self, x: Any, before: Any) -> Exact:
        (own,) = x
        rest = math.sqrt(10.0 - 0.02 * own - 0.99 * own**2)
        slopes = np.array([[[1.0], [-(0.01 + 0.99 * own) / rest]]])
        return Exact([(np.array([[own, rest]]), slopes)], np.zeros(0), np.zeros((0, 1)), [])


def test_steps_grow_where_errors_bend_away_from_their_model() -> None:
    """Steps of Gauss and Newton are a hundredth of the way each: forty of them come to 0.33."""
    found = settled(Flat(), np.zeros(1))  # type: ignore[arg-type]
    assert found.x == pytest.approx([1.0], abs=1e-3) and found.error == pytest.approx(math.sqrt(9.99))


@pytest.mark.long
def test_a_path_that_can_be_passed_is_passed_to_rounding() -> None:
    """Twelve points of a hidden four-bar without times; cubics between sixty samples stop at 1e-7 of the size."""
    own = gs.Mechanism.four_bar(2.0, 0.7, 2.5, 1.8, coupler_point=(1.2, 0.9))
    motion = gs.simulate(own, np.linspace(0.0, 2.0 * math.pi, 145))
    z = motion.point("P").position[3:-1:12]
    task = DesignTask(targets=[PathTarget(points=[tuple(p) for p in z.tolist()], tolerance=1e-3)], links=[4])
    plan = next(plan for plan in plans(task, 4) if plan.carriers == (own.points["P"].link,))
    placed = gs.Mechanism(own.graph, own.joints, own.drivers, own.points, tuple(map(tuple, motion.poses[0].tolist())))
    given, sense = from_mechanism(task, plan, placed)
    random = np.random.default_rng(1)
    problem = TaskProblem(Model(task, plan, random, given, sense))
    X, times = placed_starts(problem, shaken(given, 8, random), 8, random)
    x = descend(problem, X[1:], 3.0, 40, [own[1:] for own in times]).X[0]
    found = settled(problem, x)
    assert 1e-3 * found.error < 1e-13
    at = problem.exactly(found.x, None).times
    assert at is not None
    mechanism, _ = built(problem, found.x)
    there = [gs.simulate(mechanism, [0.0, u % (2.0 * math.pi)]).point("P").position[-1] for u in at[0][0]]
    assert np.abs(np.array(there) - z).max() < 1e-11


@pytest.mark.long
def test_a_length_may_lie_on_its_bound() -> None:
    """The semicircle is drawn better the longer the frame: a bound on lengths is reached, and not passed."""
    points = [(math.cos(a), math.sin(a)) for a in np.linspace(0.0, math.pi, 9)]
    inputs = np.linspace(0.0, 2.0, 9).tolist()
    task = DesignTask(targets=[PathTarget(points=points, inputs=inputs)], links=[4], lengths=(0.3, 2.0), transmission=0)
    problem, X = begun(task, 1)
    found = settled(problem, X[0])
    last = problem.exactly(found.x, None)
    assert found.error < problem.linearise(X, None, 0.0)[0].error[0]
    assert last.bounds.max() < 1e-8 and last.bounds.max() > -1e-5


@pytest.mark.long
def test_the_largest_error_of_the_sine_is_not_above_that_of_evolution() -> None:
    """0.1934 degrees was the best that scipy's differential evolution found; several errors are the largest."""
    sine = FunctionTarget.of(np.sin, (0, 0.5 * math.pi), input_range="90 deg", output_range="90 deg", tolerance=1e-3)
    task = DesignTask(targets=[sine], links=[4], drive="rocking", span="90 deg", transmission=0.0, length_ratio=300)
    found = []
    for seed in range(6):
        problem, X = begun(task, seed)
        own = levelled(problem, X[0])
        values = np.degrees(1e-3 * 5.0 * problem.exactly(own.x, None).errors[0][0][0])  # of 25 samples
        found.append(np.sort(np.abs(values))[::-1])
    best = min(found, key=lambda own: own[0])
    assert best[0] < 0.1935 and best[5] > 0.99 * best[0]  # six numbers of a four-bar, less one that is a size


@pytest.mark.long
def test_strokes_and_dead_centres_are_met_to_rounding() -> None:
    """The stroke and its two times of a four-bar by the two triangles in which crank and coupler are in line."""
    swing = SwingTarget(least="60 deg", most="60 deg", time_ratio=1.4, tolerance=1e-3)
    task = DesignTask(targets=[swing], links=[4])
    problem, X = begun(task, 0)
    x = settled(problem, X[0]).x
    u, joints = problem.model.read(x[None]), problem.model.plan.design.graph.joints
    place = {frozenset(joint[:2]): complex(*u.places[0, k]) for k, joint in enumerate(joints)}
    crank, output = problem.model.plan.design.drivers[0][1], problem.model.plan.carriers[0]
    (rod,) = {1, 2, 3} - {crank, output}
    A, B, C, D = (place[frozenset(pair)] for pair in ((0, crank), (crank, rod), (rod, output), (0, output)))
    a, b, c, d = abs(B - A), abs(C - B), abs(C - D), abs(D - A)

    def angle(p: float, q: float, opposite: float) -> float:
        return math.acos((p * p + q * q - opposite * opposite) / (2.0 * p * q))

    assert abs(angle(c, d, b + a) - angle(c, d, b - a)) == pytest.approx(math.radians(60.0), abs=1e-9)
    slow = math.pi + abs(angle(d, b + a, c) - angle(d, b - a, c))
    assert slow == pytest.approx(2.0 * math.pi * 1.4 / 2.4, abs=1e-9)


class Bay:
    """The square of the distance from (1, 40), within a parabola beyond whose shore there is no motion."""

    def exactly(self, x: Any, before: Any) -> Exact:
        u, v = x
        over = 50.0 * u * u - v
        seen = [(np.array([[u - 1.0, 1e-3 * (v - 40.0)]]), np.array([[[1.0, 0.0], [0.0, 1e-3]]]))]
        return Exact(seen, np.array([over]), np.array([[100.0 * u, -1.0]]), [] if over < 1e-4 else None)


def test_steps_bend_along_a_bound_beyond_which_there_is_no_motion() -> None:
    """The nearest point of the shore is the real root of a cubic; without bending, steps come to u = 0.8."""
    found = settled(Bay(), np.array([0.0, 1e-3]))  # type: ignore[arg-type]
    (u,) = (z.real for z in np.roots([0.005, 0.0, 0.996, -1.0]) if abs(z.imag) < 1e-12)
    assert found.x == pytest.approx([u, 50.0 * u * u], rel=1e-6)
