"""The search against hidden mechanisms, differences, brute force; the same for any executor."""

from __future__ import annotations

import math
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import graphsynth as gs
from graphsynth.design import (
    DesignedMechanism,
    DesignTask,
    DwellTarget,
    FunctionTarget,
    PathTarget,
    PosesTarget,
    SwingTarget,
    design,
)
from graphsynth.design.task.aims import PointAim
from graphsynth.design.task.answers import Candidate, Origin, _swing_error, judged, signature
from graphsynth.design.task.classical import solutions
from graphsynth.design.task.descend import descend
from graphsynth.design.task.model import Model
from graphsynth.design.task.plans import plans
from graphsynth.design.task.problem import TaskProblem
from graphsynth.design.task.settle import levelled
from graphsynth.design.task.starts import _moved, _posed, _some, placed_starts, random_starts

POINTS = [(0.0, 0.0), (1.0, 0.5), (2.0, 0.2), (3.0, -0.5)]
POSES = [(x, y, 0.2 * k) for k, (x, y) in enumerate(POINTS)]


def even(count: int, end: float) -> list[float]:
    return [float(u) for u in np.linspace(0.0, end, count)]


TASKS = {
    "path": (DesignTask(targets=[PathTarget(points=POINTS, inputs=even(4, 1.5))]), 6),
    "poses, own start, all bounds": (
        DesignTask(
            targets=[PosesTarget(poses=POSES, inputs=even(4, 1.5), own_start=True)],
            box=(-1, -1, 2, 2),
            pivot_region=(0, 0, 1, 1),
            lengths=(0.9, 1.1),
            crank=1.0,
            transmission="60 deg",
            length_ratio=1.5,
        ),
        4,
    ),
    "symmetric curve, direction of the crank from the frame": (
        DesignTask(
            targets=[PathTarget(points=POINTS, inputs=even(4, 1.5))],
            links=[4],
            symmetric=True,
            crank_start="30 deg",
            crank_from="frame",
        ),
        4,
    ),
    "its own mirror image, a given pivot": (
        DesignTask(
            targets=[PathTarget(points=POINTS, inputs=even(4, 1.5))],
            links=[8],
            symmetric=True,
            pivots=[(0, 0)],
        ),
        8,
    ),
    "direction of the crank, a given pivot": (
        DesignTask(
            targets=[PathTarget(points=POINTS, inputs=even(4, 1.5))],
            crank_start="40 deg",
            turning="clockwise",
            pivots=[(0, 0)],
        ),
        6,
    ),
    "a region of a pivot, the pivot of the drive, arms of some length": (
        DesignTask(
            targets=[PathTarget(points=POINTS, inputs=even(4, 1.5))],
            pivots=[(2, 2, 2.1, 2.1)],
            drive_pivot=(0, 0),
            lengths=(2.0, 9.0),
        ),
        6,
    ),
    "transmission angles of rods": (
        DesignTask(
            targets=[FunctionTarget(inputs=even(5, 2.0), outputs=[0, 0.1, 0.3, 0.4, 0.5], slides=True)],
            sliders=1,
            transmission="75 deg",
        ),
        6,
    ),
    "function of a slider": (
        DesignTask(
            targets=[FunctionTarget(inputs=even(5, 2.0), outputs=[0, 0.1, 0.3, 0.4, 0.5], slides=True)], sliders=1
        ),
        4,
    ),
    "stroke": (DesignTask(targets=[SwingTarget(least=3.0, most=3.1)]), 6),
    "dwell": (DesignTask(targets=[DwellTarget(span=1.0)], pivots=[(0, 0)]), 6),
    "cylinder": (
        DesignTask(
            targets=[PosesTarget(poses=POSES, inputs=even(4, 1.0))],
            drive="cylinder",
            stroke=(0.2, 0.21),
            pivots=[(0, 1)],
        ),
        6,
    ),
}


@pytest.mark.long
@pytest.mark.parametrize("name", TASKS)
def test_derivatives_are_those_of_differences(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """At fine samples: derivatives are those of the motion, differences those of cubics between its samples."""
    monkeypatch.setattr("graphsynth.design.task.model._SAMPLES", 180)
    task, links = TASKS[name]
    random = np.random.default_rng(4)
    every = list(plans(task, links))
    checked = 0
    for plan in (every[k] for k in random.permutation(len(every))[:3]):
        model = Model(task, plan, random)
        problem = TaskProblem(model)
        X, times = placed_starts(problem, random_starts(model, 300, random), 15, random)
        if not len(X):
            continue
        here, times = problem.linearise(X, times, 2.0)
        for k in range(model.size):
            step = 1e-6 * (np.arange(model.size) == k)
            ahead, back = (problem.linearise(X + sign * step, times, 2.0)[0] for sign in (1, -1))
            whole = np.isfinite(here.error) & np.isfinite(ahead.error) & np.isfinite(back.error)
            away = np.abs((ahead.values - back.values) / 2e-6 - here.slopes[:, :, k]).max(axis=1)
            scale = 1.0 + np.abs(here.slopes).max(axis=(1, 2))
            # the worst sample of a bound may change within a step: then the difference is that of a corner
            assert np.median((away / scale)[whole]) < 1e-5, (plan.text, k)
            checked += int(whole.sum())
    assert checked > 200


@pytest.mark.parametrize("drive", ["cylinder", "rotation"])
def test_a_task_far_from_the_origin_is_the_same_task(drive: str) -> None:
    """Groups that Newton follows, in steps that a frame far away would make long: errors and derivatives."""
    found: list[Any] = []
    for away in (0.0, 2000.0):
        poses = [(away, away, 0.0), (away + 1.0, away + 1.0, 0.3), (away + 1.5, away + 2.0, 0.9)]
        target = PosesTarget(poses=poses, inputs=[0.0, 0.5, 1.0])
        task = DesignTask(targets=[target], links=[6], drive=drive)  # type: ignore[arg-type]
        plan = next(plan for plan in plans(task, 6) if not plan.design.dyadic)
        random = np.random.default_rng(1)
        model = Model(task, plan, random)
        problem = TaskProblem(model)
        if not found:
            X, _ = placed_starts(problem, random_starts(model, 400, random), 6, random)
            u = model.read(X)
        X = model.write(u._replace(places=u.places + away, points=u.points + away))
        found.append(problem.linearise(X, None, 1.0)[0])
    here, far = found
    both = np.isfinite(here.error) & np.isfinite(far.error)
    assert both.sum() >= 4  # of six: a step of a frame that is elsewhere may be at its limit
    assert far.error[both] == pytest.approx(here.error[both], rel=1e-6)
    assert np.abs(far.slopes - here.slopes)[both].max() < 1e-5 * np.abs(here.slopes[both]).max()


def hidden() -> Any:
    """Return the motion of a crank-rocker with a point off its coupler."""
    own = gs.Mechanism.four_bar(4.0, 1.5, 3.5, 3.0, coupler_point=(1.6, 1.9))
    motion = gs.simulate(own, np.linspace(0.0, math.tau, 361))
    assert motion.completed
    return motion


def brute(found: DesignedMechanism, goal: Any) -> float:
    """Largest distance of goal points from a fine drawing of the point, simulated here."""
    motion = gs.simulate(found.mechanism, np.linspace(0.0, math.tau, 20001))
    z = motion.point("P").position @ [1.0, 1.0j]
    return max(float(np.abs(z - p).min()) for p in goal)


@pytest.mark.long
def test_a_hidden_four_bar_is_found_from_its_curve_and_pivots() -> None:
    """Twenty points without times, both pivots given: curve, lengths and place come back."""
    motion = hidden()
    z = motion.point("P").position[:-1:18] @ [1.0, 1.0j]
    path = PathTarget(points=[(p.real, p.imag) for p in z], closed=True, tolerance=1e-4)
    task = DesignTask(
        targets=[path],
        pivots=[(0, 0), (4, 0)],
        links=[4],
        transmission="10 deg",
    )
    found = design(task, count=1)
    assert found.accepted, found
    best = found[0]
    assert best.errors[0] < 1e-5 and brute(best, z) < 1e-5 * path.size + 1e-3  # of a fine drawing
    at = best.mechanism
    crank = next(j for j in at.joints if set(j.pair) == {0, at.drivers[0].link})
    assert min(np.hypot(*crank.at_a), np.hypot(crank.at_a[0] - 4, crank.at_a[1])) < 1e-12
    assert best.certified


def test_a_curve_that_also_goes_elsewhere_does_not_draw_a_closed_path() -> None:
    """Half of the hidden curve, closed by a chord: every point is passed, yet the other half is elsewhere."""
    motion = hidden()
    z = motion.point("P").position @ [1.0, 1.0j]
    plan = next(plan for plan in plans(DesignTask(targets=[PathTarget.segment((0, 0), (1, 0))], links=[4]), 4))
    whole, half = z[:-1:12], z[:180:6]
    errors = []
    for goal in (whole, half):
        path = PathTarget(points=[(p.real, p.imag) for p in goal], closed=True)
        task = DesignTask(targets=[path], links=[4], transmission="5 deg")
        errors.append(judged(task, Candidate(0.0, Origin(plan, 0, None), z.real, motion.mechanism, ())).errors[0])
    size = float(np.abs(half - half.mean()).max())
    assert errors[0] < 1e-6
    # the curve leaves the chord by up to this, of which a fifth of the chord is allowed
    far = np.abs((np.conj(half[-1] - half[0]) * (z[180:] - half[0])).imag).max() / abs(half[-1] - half[0])
    assert errors[1] > 0.5 * (far - 0.2 * abs(half[-1] - half[0])) / size > 0.05


def test_errors_of_points_are_their_largest_or_their_mean() -> None:
    """Points beside those that the hidden curve passes at given inputs, each by a distance of its own."""
    motion = hidden()
    z = motion.point("P").position @ [1.0, 1.0j]
    at = np.arange(0, 300, 30)
    away = 0.01 * (1.0 + np.arange(10)) * np.exp(1j * np.arange(10))
    goal = z[at] + away
    size = float(np.abs(goal - goal.mean()).max())
    points = [(p.real, p.imag) for p in goal]
    errors = []
    for mean in (False, True):
        path = PathTarget(points=points, inputs=motion.inputs[at].tolist(), mean=mean)
        task = DesignTask(targets=[path], links=[4], transmission="5 deg")
        plan = next(iter(plans(task, 4)))
        errors.append(judged(task, Candidate(0.0, Origin(plan, 0, None), z.real, motion.mechanism, ())).errors[0])
    assert np.allclose(errors, [0.1 / size, math.sqrt(3.85e-3) / size], rtol=1e-4)


def test_errors_of_angles_are_those_of_a_fine_motion() -> None:
    """Stroke, time ratio, dwell and function of the hidden rocker, each against its angle at 36 000 inputs."""
    motion = hidden()
    fine = gs.simulate(motion.mechanism, np.linspace(0.0, math.tau, 36001))
    theta = np.unwrap(fine.poses[:, 3, 2])
    swing = float(np.ptp(theta))
    apart = abs(float(fine.inputs[theta.argmax()] - fine.inputs[theta.argmin()]))
    slow = max(apart, math.tau - apart)
    targets = [
        SwingTarget(least=swing + 0.2),
        SwingTarget(most=swing - 0.3),
        SwingTarget(time_ratio=3.0),
        DwellTarget(span=1.0, start=0.5),
        FunctionTarget(inputs=[0.0, 1.0, 2.0], outputs=[0.0, 0.0, 0.0]),
    ]
    task = DesignTask(targets=targets, links=[4], transmission="5 deg")
    plan = next(plan for plan in plans(task, 4) if plan.carriers == (3,))
    found = judged(task, Candidate(0.0, Origin(plan, 0, None), theta, motion.mechanism, ()))
    window = theta[(fine.inputs >= 0.5) & (fine.inputs <= 1.5)]
    at = np.interp([0.0, 1.0, 2.0], fine.inputs, theta)
    wanted = [0.2, 0.3, abs(slow - 0.75 * math.tau), 0.5 * np.ptp(window), 0.5 * np.ptp(at)]
    assert found.errors == pytest.approx(wanted, abs=1e-4) and not found.accepted
    assert {"the swing is missed", "the dwell is missed", "the function is missed"} <= {*found.reasons}
    other = replace(found, mechanism=found.mechanism.scaled(3.0))
    assert np.allclose(signature(task, found), signature(task, other))  # no target has a length
    sized = DesignTask(targets=targets, links=[4], crank=1.0)
    assert np.abs(signature(sized, found) - signature(sized, other)).min() > 1.0


@pytest.mark.long
def test_some_candidates_nearly_fold_and_turn_against_their_cranks() -> None:
    """Kites with a coupler a little longer than the crank turn fully if the frame is longer; their sides tell."""
    task = DesignTask(targets=[PathTarget(points=POINTS)], links=[4])
    random = np.random.default_rng(4)
    for plan in plans(task, 4):
        model = Model(task, plan, random)
        u = random_starts(model, 600, random)
        joints = {frozenset(joint[:2]): k for k, joint in enumerate(plan.design.graph.joints)}
        driven, coupler = plan.design.drivers[0][1], plan.carriers[0]
        (output,) = {1, 2, 3} - {driven, coupler}
        z = u.places[500:] @ [1.0, 1.0j]
        pairs = ((0, driven), (driven, coupler), (coupler, output), (0, output))
        A, B, C, D = (z[:, joints[frozenset(pair)]] for pair in pairs)
        crank, rod, follower, ground = abs(B - A), abs(C - B), abs(D - C), abs(D - A)
        assert (rod >= (1.0 + 0.99e-3) * crank).all() and (rod <= 1.101 * crank).all()
        assert (abs(follower - ground) <= rod - crank + 1e-12).all()
        turns = model.move(u).complete[500:]
        assert (ground > rod).sum() > 20 and turns[ground > 1.001 * rod].all()


def test_a_candidate_may_begin_anywhere_on_its_turn() -> None:
    """Its motion from a later sample is the same motion, of every joint and point."""
    task = DesignTask(targets=[PathTarget(points=POINTS)])
    plan = next(plan for plan in plans(task, 6))
    random = np.random.default_rng(2)
    model = Model(task, plan, random)
    u = random_starts(model, 200, random)
    moved = model.move(u)
    whole = np.flatnonzero(moved.complete)
    assert len(whole) > 5
    u, moved = _some(u, whole), _moved(moved, whole)
    at = random.integers(0, len(moved.inputs) - 1, len(whole))
    later = _posed(model, u, moved, at)
    again = model.move(later)
    assert again.complete.all()
    frame = plan.design.graph.frame
    for k, joint in enumerate(plan.design.graph.joints):
        link = joint.a if joint.a != frame else joint.b

        def way(places: Any, motion: Any, link: int = link, k: int = k) -> Any:
            own = motion.frames[:, :-1, link].copy().view(np.complex128)
            return own[..., 0] + own[..., 1] * (places[:, k] @ [1.0, 1.0j])[:, None]

        before, after = way(u.places, moved), way(later.places, again)
        for one, two, start in zip(before, after, at):
            assert np.abs(np.roll(one, -start) - two).max() < 1e-7 * (1.0 + np.abs(one).max())


@pytest.mark.long
def test_the_largest_error_is_made_small_in_the_end() -> None:
    """A parabola by a four-bar: least squares leave uneven errors, afterwards seven or more are the largest."""
    parabola = FunctionTarget.of(np.square, (0, 1), input_range="90 deg", output_range="60 deg", count=33)
    task = DesignTask(targets=[parabola], links=[4], transmission=0.0, lengths=(0.02, 20), length_ratio=20)
    random = np.random.default_rng(5)
    model = Model(task, next(plans(task, 4)), random)
    problem = TaskProblem(model)
    X, times = placed_starts(problem, random_starts(model, 300, random), 20, random)
    x = descend(problem, X, 3.0, 100, times).X[0]

    def sizes(x: Any) -> Any:
        return 0.01 * math.sqrt(33) * np.abs(problem.exactly(x, None).errors[0][0][0])

    found = levelled(problem, x)
    before, after = sizes(x), sizes(found.x)
    assert 0.01 * found.error == pytest.approx(after.max()) and after.max() < 0.8 * before.max()
    assert (after > 0.9 * after.max()).sum() >= 7 > (before > 0.9 * before.max()).sum()  # six numbers of a four-bar
    assert (after**2).sum() > (before**2).sum()  # which least squares had made small


@pytest.mark.long
def test_two_targets_at_once_share_one_mechanism() -> None:
    """A timed path and the rocker's angle of the same hidden four-bar; each alone leaves more freedom."""
    motion = hidden()
    at = np.arange(0, 360, 30)
    z = motion.point("P").position[at]
    theta = np.unwrap(motion.poses[:, 3, 2])[at]
    inputs = np.radians(at).tolist()
    path = PathTarget(points=[tuple(p) for p in z.tolist()], inputs=inputs, tolerance=1e-5)
    function = FunctionTarget(inputs=inputs, outputs=theta.tolist(), tolerance=1e-5)
    found = design(DesignTask(targets=[path, function], links=[4], transmission="10 deg"), count=1, seed=1)
    assert found.accepted, found
    lengths = sorted(found[0].mechanism.dimensions[:, :6].max(axis=1))
    assert lengths and max(found[0].errors) < 1e-6


def test_a_short_search_does_not_begin_with_all_four_bars_through_nine_points() -> None:
    """They take some 20 s."""
    points = [(math.cos(u), 0.3 * math.sin(u) + 0.1 * u * u) for u in even(9, 5.0)]
    assert list(solutions(DesignTask(targets=[PathTarget(points=points)]), 59.0)) == []


@pytest.mark.parametrize("kind", ["poses", "function", "timed path"])
def test_classical_problems_begin_with_every_solution_of_algebra(kind: str) -> None:
    """Five positions of a hidden four-bar: it is among the solutions, and the first pieces find it exactly."""
    motion, at = hidden(), [0, 60, 130, 200, 290]
    z = motion.point("P").position[at]
    inputs = np.radians(at).tolist()
    theta = np.unwrap(motion.poses[:, 3, 2])
    targets: dict[str, Any] = {
        "poses": PosesTarget(poses=[(*p, a) for p, a in zip(z.tolist(), motion.poses[at, 2, 2])], tolerance=1e-5),
        "function": FunctionTarget(inputs=inputs, outputs=theta[at].tolist(), tolerance=1e-8),
        "timed path": PathTarget(points=z.tolist(), inputs=inputs, tolerance=1e-8),
    }
    task = DesignTask(targets=[targets[kind]], links=[4], transmission="5 deg", lengths=(0.1, 100), length_ratio=40)
    lengths = [
        sorted(
            math.dist(*((j.at_a if j.a == link else j.at_b) for j in own.joints if link in j.pair)) for link in range(4)
        )
        for own in solutions(task, 1.0)
    ]
    scale = [4.0 / 1.5, 3.5 / 1.5, 3.0 / 1.5]
    assert any(np.allclose(np.array(own[1:]) / own[0], sorted(scale), rtol=1e-6) for own in lengths)
    found = design(task, count=1)
    assert found.accepted and found.pieces <= len(lengths)


@pytest.mark.long
def test_a_hidden_cylinder_is_found_from_the_angle_it_gives() -> None:
    """The law of cosines: a lever of 1 at a foot at distance 2, a cylinder from 1.3 to 2.3."""
    length = 1.3 + np.linspace(0.0, 1.0, 9)
    theta = np.arccos((1.0 + 4.0 - length**2) / 4.0)
    function = FunctionTarget(inputs=even(9, 1.0), outputs=(theta - theta[0]).tolist(), tolerance=1e-4)
    task = DesignTask(
        targets=[function],
        drive="cylinder",
        links=[4],
        pivots=[(0, 0), (2, 0)],
        stroke=(0.99, 1.01),
        transmission="10 deg",
    )
    found = design(task, count=1)
    assert found.accepted, found
    law: Any = found[0].mechanism.drivers[0].law
    assert 0.98 < abs(law.rate) < 1.02 and found[0].errors[0] < 1e-4
    # the transmission angle at the lever's pin, between lever and cylinder, by the law of cosines
    cosine = (1.0 + length**2 - 4.0) / (2.0 * length)
    assert found[0].transmission == pytest.approx(np.arcsin(np.sqrt(1.0 - cosine**2)).min(), abs=0.01)


@pytest.mark.long
def test_strokes_and_time_ratios_are_those_of_the_closed_form() -> None:
    """An offset slider-crank has both in closed form: dead centres where crank and rod are in line."""
    ratio, least = 1.25, "60 deg"
    found = design(DesignTask(targets=[SwingTarget(least=least, most=least, time_ratio=ratio)], links=[4]), count=1)
    assert found.accepted, found
    mechanism = found[0].mechanism
    table = {frozenset(j.pair): j for j in mechanism.joints}
    driven = mechanism.drivers[0].link
    rocker = next(link for link in range(1, 4) if frozenset((0, link)) in table and link != driven)
    rod = 6 - driven - rocker

    def length(link: int, a: int, b: int) -> float:
        ends = [j.at_a if j.a == link else j.at_b for j in (table[frozenset((link, a))], table[frozenset((link, b))])]
        return math.dist(*ends)

    crank, coupler = length(driven, 0, rod), length(rod, driven, rocker)
    swing, ground = length(rocker, rod, 0), length(0, driven, rocker)

    def corner(p: float, q: float, opposite: float) -> float:
        return math.acos((p * p + q * q - opposite * opposite) / (2 * p * q))

    far, near = coupler + crank, coupler - crank
    stroke = abs(corner(ground, swing, far) - corner(ground, swing, near))
    apart = abs(corner(ground, far, swing) - corner(ground, near, swing))
    assert abs(stroke - math.radians(60)) < 0.02
    assert abs((math.pi + apart) / (math.pi - apart) - ratio) < 0.02


@pytest.mark.parametrize("size", [1.0, 1000.0])
def test_a_slow_stroke_of_a_slider_that_is_late_counts_as_an_arc(size: float) -> None:
    """A centred slider-crank: stroke 2, both ways half a turn; whatever the unit of length, the same share is late."""
    mechanism = gs.Mechanism.slider_crank(1.0, 3.0).scaled(size)
    wanted = SwingTarget(least=2.0 * size, most=2.0 * size, time_ratio=1.2, link="ram", slides=True)
    task = DesignTask(targets=[wanted], links=[4], sliders=1)
    motion = gs.simulate(mechanism, np.linspace(0.0, math.tau, 721))
    late = math.tau * 1.2 / 2.2 - math.pi
    assert _swing_error(task, wanted, motion, 3, 0) == pytest.approx(2.0 * size * late, rel=1e-6)


def test_a_link_that_goes_round_does_not_swing() -> None:
    task = DesignTask(targets=[SwingTarget(least="60 deg")], links=[4])
    drag_link = gs.simulate(gs.Mechanism.four_bar(1.0, 2.5, 2.4, 2.6), np.linspace(0.0, math.tau, 721))
    assert drag_link.completed and _swing_error(task, task.targets[0], drag_link, 3, 0) == math.inf  # type: ignore[arg-type]


@pytest.mark.long
def test_an_offset_slider_crank_has_its_stroke_and_time_ratio() -> None:
    """Dead centres where crank and rod are in line: both in closed form, from the lengths of the answer."""
    wanted = SwingTarget(least=2.0, most=2.0, time_ratio=1.3, link="ram", slides=True)
    found = design(DesignTask(targets=[wanted], links=[4], sliders=1), count=1)
    assert found.accepted, found
    own = found[0].mechanism
    assert own.joint(0, found[0].carriers["ram"]).kind == "P"
    driven = own.drivers[0].link
    (joint,) = [j for j in own.joints if driven in j.pair and 0 not in j.pair]
    rod = next(link for link in joint.pair if link != driven)
    if own.joint(0, driven).kind == "R" and own.joint(driven, rod).kind == "R":
        motion = gs.simulate(own, np.linspace(0.0, math.tau, 3601))
        pin = next(j for j in own.joints if rod in j.pair and driven not in j.pair)
        z = motion.point(pin.a, pin.at_a).position @ [1.0, 1.0j]
        A = complex(*own.joint(0, driven).at_a)
        r = math.dist(*(j.at_a if j.a == driven else j.at_b for j in own.joints if driven in j.pair))
        b = math.dist(*(j.at_a if j.a == rod else j.at_b for j in own.joints if rod in j.pair))
        way = (z[np.abs(z - z[0]).argmax()] - z[0]) / np.abs(z - z[0]).max()
        e = abs((np.conj(way) * (A - z[0])).imag)
        stroke = math.sqrt((b + r) ** 2 - e**2) - math.sqrt((b - r) ** 2 - e**2)
        apart = math.asin(e / (b - r)) - math.asin(e / (b + r))
        assert abs(stroke - 2.0) < 0.02
        assert abs((math.pi + apart) / (math.pi - apart) - 1.3) < 0.02


@pytest.mark.long
def test_a_dwell_stands_still_while_the_crank_turns() -> None:
    still = math.radians(0.5)
    task = DesignTask(targets=[DwellTarget(span="50 deg", tolerance=still), SwingTarget(least="25 deg")], links=[6])
    found = design(task, count=1)
    assert found.accepted, found
    link = found[0].carriers["output"]
    motion = gs.simulate(found[0].mechanism, np.linspace(0.0, 2 * math.tau, 1441))
    theta = np.unwrap(motion.poses[:, link, 2])
    window = np.lib.stride_tricks.sliding_window_view(theta, 101)  # 50 degrees of half-degree steps
    assert np.ptp(window, axis=1).min() < 2 * still * 1.05 and np.ptp(theta) > math.radians(24.9)


@pytest.mark.slow
def test_the_same_answers_for_any_executor_and_none_twice() -> None:
    task = DesignTask(targets=[PathTarget.segment((0, 0), (4, 0), count=12)], pivots=[(1, -3)], links=[4])
    one = design(task, count=4, seed=3)
    with ThreadPoolExecutor(2) as threads:
        two = design(task, count=4, seed=3, executor=threads)
    assert [a.mechanism for a in one.answers] == [a.mechanism for a in two.answers]
    assert one.rejected == two.rejected and len(one) == 4
    for k, a in enumerate(one.answers):
        assert a.accepted and a.mechanism.points["P"].link
        assert min(abs(complex(*j.at_a) - (1 - 3j)) for j in a.mechanism.joints if j.a == 0) < 1e-12
        for b in one.answers[:k]:
            assert a.mechanism.dimensions.shape != b.mechanism.dimensions.shape or not np.allclose(
                np.sort(np.abs(a.mechanism.dimensions), axis=None),
                np.sort(np.abs(b.mechanism.dimensions), axis=None),
                0.01,
            )


@pytest.mark.long
def test_a_task_without_lengths_has_no_copies_of_another_size() -> None:
    task = DesignTask(targets=[SwingTarget(least="60 deg", most="60 deg", time_ratio=1.5)], links=[4])
    found = design(task, count=2)
    shapes = []
    for answer in found.answers:
        own = answer.mechanism
        sides = [math.dist(*((j.at_a if j.a == k else j.at_b) for j in own.joints if k in j.pair)) for k in range(4)]
        shapes.append(np.sort(sides) / np.exp(np.log(sides).mean()))
    assert len(shapes) == 2
    for k, one in enumerate(shapes):
        assert all(np.abs(np.log(one / other)).max() > 0.05 for other in shapes[:k])


@pytest.mark.parametrize("unit", [1e-3, 1.0, 1e4])
def test_a_task_is_measured_by_the_lengths_it_names(unit: float) -> None:
    """Strokes of sliders, given links, the stroke of a drive or the box: a task in other units is the same task."""
    turns = SwingTarget(least="40 deg", most="50 deg")
    ram = [SwingTarget(least=60 * unit, most=90 * unit, slides=True), DwellTarget(span="50 deg", slides=True)]
    rises = FunctionTarget(inputs=(0.0, 0.5, 1.0), outputs=(-7 * unit, 2 * unit, 3 * unit), slides=True)
    tasks = [
        (DesignTask(targets=ram, sliders=1), 60.0),
        (DesignTask(targets=[SwingTarget(most=90 * unit, slides=True)], sliders=1, crank=5 * unit), 90.0),
        (DesignTask(targets=[rises], sliders=1, pivots=[(0, 0), (4 * unit, 0)]), 10.0),
        (DesignTask(targets=[turns], bars=[2 * unit, 3 * unit]), 3.0),
        (DesignTask(targets=[turns], links=[6], plates=[(2 * unit, 3 * unit, 4 * unit)]), 4.0),
        (DesignTask(targets=[turns], drive="cylinder", stroke=(2 * unit, 3 * unit)), 3.0),
        (DesignTask(targets=[turns], box=(0, 0, 8 * unit, 6 * unit)), 3.0),
    ]
    for task, size in tasks:
        assert task.size == pytest.approx(size * unit, rel=1e-12)
        least = min([0.1 * min(size, 4.0 if task.pivots else size) * unit, *task.given])  # a given crank is allowed
        assert task.lengths == pytest.approx((least, 6.0 * size * unit))
    assert DesignTask(targets=[turns]).size == 1.0


@pytest.mark.long
@pytest.mark.parametrize("unit", [0.05, 20.0])
def test_a_ram_rests_at_any_size(unit: float) -> None:
    """A press of 60 to 90 units whose ram stands still for 50 degrees: in metres or inches as in millimetres."""
    stroke = SwingTarget(least=60 * unit, most=90 * unit, slides=True, link="ram", tolerance=0.5 * unit)
    rest = DwellTarget(span="50 deg", slides=True, link="ram", tolerance=0.5 * unit)
    found = design(DesignTask(targets=[stroke, rest], links=[6], sliders=1), count=1, seconds=100)
    assert found.accepted and found[0].errors[1] <= 0.5 * unit
    moved = gs.simulate(found[0].mechanism, np.linspace(0.0, 2.0 * np.pi, 1441))
    ram = moved.poses[:, found[0].carriers["ram"], :2] @ [1.0, 1.0j]
    assert 59.5 * unit <= np.abs(ram[:, None] - ram[None, ::8]).max() <= 90.5 * unit


@pytest.mark.slow
def test_a_search_rests_when_it_finds_no_other_answer() -> None:
    """The best four-bar for a logarithm is one; within twice its error there is no other shape."""
    log = FunctionTarget.of(np.log10, (1, 2), input_range="60 deg", output_range="90 deg", tolerance=0.0025)
    found = design(DesignTask(targets=[log], links=[4]), count=9, seconds=300)
    assert 1 <= len(found) < 9 and found.accepted and "no other was found" in found.statement


@pytest.mark.long
def test_an_interruption_gives_the_best_so_far() -> None:
    def stop(progress: Any) -> None:
        if progress.pieces == 3:
            raise KeyboardInterrupt

    task = DesignTask(targets=[PathTarget.segment((0, 0), (4, 0), count=12)], links=[4])
    found = design(task, progress=stop)
    assert found.pieces == 3 and len(found) and "interrupted" in found.statement


@pytest.mark.long
def test_a_search_that_finds_nothing_says_only_that() -> None:
    """A time ratio of ten with a stroke of two thirds of a turn: nothing is near; no claim is made."""
    task = DesignTask(targets=[SwingTarget(least="250 deg", time_ratio=10)], links=[4], transmission="60 deg")
    found = design(task, seconds=1, count=1)
    assert not found.accepted and not found.impossible
    assert found.statement.startswith("no mechanism was found that does the task, which does not prove")
    assert found.rejected


@pytest.mark.slow
def test_given_bars_are_used_and_a_misalignment_is_forgiven() -> None:
    """A stroke of 4 by a crank, a bar of 2 and one of 5; the margin of binding is that of the jamming room."""
    path = PathTarget.segment((0, 0), (4, 0), count=12)
    task = DesignTask(targets=[path], links=[4], bars=[2.0, 5.0], misalignment="0.1 deg")
    found = design(task, count=1)
    assert found.accepted, found
    own = found[0].mechanism
    lengths = [
        math.dist(*((j.at_a if j.a == link else j.at_b) for j in own.joints if link in j.pair)) for link in (1, 2, 3)
    ]
    for bar in (2.0, 5.0):
        assert min(abs(length / bar - 1.0) for length in lengths) < 1e-3
    report = gs.assess_jamming(found[0].motion, tilt="0.1 deg", joints="0.3 deg", certify=False)
    assert found[0].jam_margin == pytest.approx(report.smallest_scale, rel=0.05) and found[0].jam_margin >= 1.0
    too_much = design(DesignTask(targets=[path], links=[4], bars=[2.0, 5.0], misalignment="20 deg"), count=1, seconds=4)
    assert not too_much.accepted and too_much.rejected["its joints bind at the misalignment"]


def test_candidates_that_all_fit_at_no_fair_size_are_no_starts() -> None:
    """A huge mechanism whose point hardly moves, as an index may give: nothing is left to begin with."""
    task = DesignTask(targets=[PathTarget(points=POINTS[:3], closed=True)], links=[4])
    problem = TaskProblem(Model(task, next(iter(plans(task, 4))), np.random.default_rng(0)), 24, 0.5)
    u = random_starts(problem.model, 40, np.random.default_rng(1))
    (aim,) = problem.aims
    assert isinstance(aim, PointAim) and aim.wanted is not None
    aim.wanted = aim.wanted._replace(size=1e9 * aim.wanted.size)  # then every mechanism is tiny
    X, times = placed_starts(problem, u, 10, np.random.default_rng(2))
    assert X.shape == (0, problem.model.size) and times == []


@pytest.mark.long
def test_a_cylinder_drives_a_point_along_a_line_at_any_speed() -> None:
    """Times of the points are free, but end with the stroke: what lies beyond its ends is made up by dimensions."""
    line = PathTarget.segment((0, 0), (2, 0), count=8, tolerance=0.03)
    found = design(DesignTask(targets=[line], drive="cylinder", links=[6]), count=1, processor_seconds=20, seconds=300)
    assert found.accepted
    motion = gs.simulate(found[0].mechanism, np.linspace(0.0, 1.0, 20001))
    z = motion.point("P").position @ [1.0, 1.0j]
    assert max(float(np.abs(z - p).min()) for p in line.goal) < 0.03 * line.size


@pytest.mark.slow
def test_a_slider_moves_evenly_for_a_quarter_of_a_turn_and_its_rod_keeps_the_transmission_angle() -> None:
    even_way = FunctionTarget(
        inputs=[0, math.pi / 6, math.pi / 3, math.pi / 2], outputs=[0, 1, 2, 3], slides=True, tolerance=0.05
    )
    stroke = SwingTarget(least=3, most=8, slides=True, tolerance=0.05)
    task = DesignTask(targets=[even_way, stroke], links=[4, 6], sliders=1, transmission="25 deg")
    found = design(task, count=1, seconds=600, processor_seconds=40)
    assert found.accepted
    mechanism = found[0].mechanism
    motion = gs.simulate(mechanism, np.linspace(0.0, math.tau, 2001))
    slide = next(j for j in mechanism.joints if j.kind == "P")
    block = slide.a if slide.b == mechanism.frame else slide.b
    (rod,) = (j.a if j.b == block else j.b for j in mechanism.joints if block in j.pair and j is not slide)
    ends = [motion.point(j.a, j.at_a).position @ [1.0, 1.0j] for j in mechanism.joints if rod in j.pair]
    guide = motion.poses[-1, block, :2] - motion.poses[500, block, :2]
    if (
        len(ends) == 2 and np.hypot(*guide) > 0.0
    ):  # a rod of two joints: the angle between it and the normal of its guide
        along = (ends[1] - ends[0]) / np.abs(ends[1] - ends[0]) * np.conj(complex(*guide) / np.hypot(*guide))
        assert np.degrees(np.arccos(np.abs(along.imag).max())) > 25 - 0.01
