"""Words of a task: dyads alone, limits of time, the direction of the crank, symmetry."""

from __future__ import annotations

import math
from dataclasses import replace
from itertools import combinations
from typing import Any

import numpy as np
import pytest

import graphsynth as gs
from graphsynth.core.errors import GeometryError
from graphsynth.core.limits import Clock, here, told
from graphsynth.design import DesignedMechanism, DesignTask, PathTarget, SwingTarget, design
from graphsynth.design.task.model import Model
from graphsynth.design.task.plans import Plan, plans
from graphsynth.design.task.problem import TaskProblem
from graphsynth.design.task.starts import placed_starts, random_starts
from graphsynth.design.task.wishes import plates_of


@pytest.mark.long
def test_a_limit_of_processor_time_ends_the_search() -> None:
    task = DesignTask(targets=[PathTarget.segment((0, 0), (4, 0), count=12, tolerance=1e-7)], links=[4])
    found = design(task, processor_seconds=1e-3)
    assert found.pieces == 1 and "the limit of processor time was reached" in found.statement


def test_processor_time_of_other_processes_counts() -> None:
    clock = Clock(1e6, 1e5)
    result, more = told(lambda n: sum(range(n)), "another process", 200_000)
    assert result == 199_999 * 100_000 and more > 0.0
    assert told(abs, here(), -1) == (1, 0.0)
    assert clock.over == ""
    clock.elsewhere += 1e5
    assert clock.over == "the limit of processor time"


def test_dyads_alone_leave_out_what_cannot_be_assembled_two_links_at_a_time() -> None:
    """By brute force: place two links at a time that are joined to each other and to what is placed."""

    def two_by_two(plan: Plan) -> bool:
        graph = plan.design.graph
        placed = {graph.frame, plan.design.drivers[0][1]}
        while len(placed) < graph.links:
            pair = next(
                (
                    (a, b)
                    for a, b, _ in graph.joints
                    if not {a, b} & placed
                    and all(any({n, k} in ({*j[:2]} for j in graph.joints) for n in placed) for k in (a, b))
                ),
                None,
            )
            if pair is None:
                return False
            placed |= {*pair}
        return True

    free = DesignTask(targets=[PathTarget.segment((0, 0), (4, 0))], links=[6])
    every = list(plans(free, 6))
    kept = list(plans(replace(free, dyads_only=True), 6))
    assert kept == [plan for plan in every if two_by_two(plan)] and 0 < len(kept) < len(every)


POINTS = [(3, 3), (2.759, 3.363), (2.372, 3.663), (1.89, 3.862), (1.355, 3.943)]


def crank_angles(found: DesignedMechanism, from_frame: bool) -> Any:
    """Directions of the crank over the motion, from the x axis or from the line of the pivots."""
    mechanism, motion = found.mechanism, found.motion
    crank = mechanism.drivers[0].link
    at = {k: motion.point(j.a, j.at_a).position @ [1.0, 1.0j] for k, j in enumerate(mechanism.joints)}
    pivots = [k for k, j in enumerate(mechanism.joints) if mechanism.frame in j.pair]
    pivot = next(k for k in pivots if crank in mechanism.joints[k].pair)
    pin = next(k for k, j in enumerate(mechanism.joints) if crank in j.pair and k != pivot)
    other = next(k for k in pivots if k != pivot)
    return np.unwrap(np.angle((at[pin] - at[pivot]) / (at[other] - at[pivot] if from_frame else 1.0)))


@pytest.mark.long
@pytest.mark.parametrize(
    ("start", "words", "turning", "between"),
    [
        ("30 deg", "frame", "counter-clockwise", (30.0, 30.0)),
        (("-200 deg", "-170 deg"), "frame", "counter-clockwise", (-200.0, -170.0)),
        ("-100 deg", "x", "clockwise", (-100.0, -100.0)),
    ],
)
def test_the_crank_begins_where_it_shall(start: Any, words: Any, turning: Any, between: Any) -> None:
    path = PathTarget(points=POINTS, inputs=np.radians([0, 15, 30, 45, 60]).tolist(), tolerance=0.05)
    task = DesignTask(
        targets=[path], links=[4], crank_start=start, crank_from=words, turning=turning, transmission="10 deg"
    )
    found = design(task, count=1, seconds=300, processor_seconds=60)
    assert found.accepted, found
    angles = crank_angles(found[0], words == "frame")
    low, high = (math.radians(value) for value in between)
    off = math.remainder(angles[0] - 0.5 * (low + high), math.tau)
    assert abs(off) <= 0.5 * (high - low) + 1e-9
    assert np.all(np.diff(angles) * (1 if turning == "counter-clockwise" else -1) > 0.0)
    at = np.interp(path.inputs, found[0].motion.inputs, np.arange(len(found[0].motion.inputs)))
    z = found[0].motion.point("P").position[at.round().astype(int)] @ [1.0, 1.0j]
    assert np.abs(z - path.goal).max() < 0.06 * path.size + 0.02


@pytest.mark.long
def test_a_symmetric_curve_is_its_own_mirror_image() -> None:
    """By brute force: a fine drawing, reflected about the line that its own second moments give or the normal of it."""
    task = DesignTask(targets=[PathTarget.segment((0, 0), (4, 0), count=12)], links=[4], symmetric=True)
    found = design(task, count=1, seconds=300, processor_seconds=60)
    assert found.accepted, found
    z = gs.simulate(found[0].mechanism, np.linspace(0.0, math.tau, 4001)).point("P").position[:-1] @ [1.0, 1.0j]

    def mirrored(axis: complex) -> float:
        middle = z.mean()
        image = middle + axis**2 * np.conj(z[::40] - middle)
        return max(float(np.abs(z - p).min()) for p in image)

    spread = z - z.mean()
    # equal inputs are equally frequent on both sides of the axis, so that moments know it
    axis = np.exp(0.5j * np.angle((spread**2).mean()))
    step = np.abs(np.diff(z)).max()
    assert min(mirrored(axis), mirrored(1j * axis)) < step


def test_words_that_do_not_fit_are_refused() -> None:
    path = PathTarget.segment((0, 0), (4, 0))
    for more, words in (
        ({"crank_start": 1.0, "drive": "slide"}, "no crank"),
        ({"turning": "clockwise", "drive": "cylinder"}, "no crank"),
        ({"turning": "left"}, "turning"),
        ({"crank_start": (1.0, 0.5)}, "second limit"),
        ({"crank_start": (1.0, 2.0, 3.0)}, "one angle, or two"),
        ({"crank_start": 1.0, "crank_from": "frame", "links": [4, 6]}, "four links"),
        ({"symmetric": True}, "links = .4, 6."),
    ):
        with pytest.raises(GeometryError, match=words):
            DesignTask(targets=[path], **more)
    with pytest.raises(GeometryError, match="symmetric curve"):
        DesignTask(targets=[SwingTarget(least=1.0)], links=[4], symmetric=True)


@pytest.mark.slow
def test_a_given_plate_is_used() -> None:
    """A lever with its third hole on the line of the others, found among the joints and points of a moving link."""
    path = PathTarget.segment((0, 0), (4, 0), count=8)
    found = design(DesignTask(targets=[path], links=[6], plates=[(2.0, 1.0, 3.0)]), count=1)
    assert found.accepted
    mechanism, sides = found[0].mechanism, []
    for link in {*range(6)} - {mechanism.frame}:
        own = [joint.at_a if joint.a == link else joint.at_b for joint in mechanism.joints if link in joint.pair]
        own += [point.at for point in mechanism.points.values() if point.link == link]
        sides += [sorted(math.dist(three[k], three[k - 1]) for k in range(3)) for three in combinations(own, 3)]
    assert min(np.abs(np.array(own) - [1.0, 2.0, 3.0]).max() for own in sides) < 3e-3


@pytest.mark.slow
def test_a_plate_with_the_drawing_point_in_its_third_hole() -> None:
    """A four-bar draws a straight line with a plate that is there: one hole is that of the point, whichever suits."""
    holes = (2.0, 1.5, 1.2)
    path = PathTarget.segment((0, 0), (1, 0), count=8, tolerance=0.02)
    task = DesignTask(targets=[path], links=[4], plates=[holes], transmission="10 deg")
    found = design(task, count=1, seconds=30.0)
    assert found.accepted
    mechanism = found[0].mechanism
    point = next(iter(mechanism.points.values()))
    own = [j.at_a if j.a == point.link else j.at_b for j in mechanism.joints if point.link in j.pair]
    corners = [*own, point.at]
    sides = sorted(math.dist(corners[k], corners[k - 1]) for k in range(3))
    assert sides == pytest.approx(sorted(holes), rel=2e-3)


@pytest.mark.parametrize("links, plan", [(6, 5), (4, 0)])
def test_derivatives_of_what_plates_differ(links: int, plan: int) -> None:
    """By differences, where plates lie on links of their own, and where a named point is the third place."""
    path = PathTarget.segment((0, 0), (4, 0), count=8)
    plates = [(2.0, 1.5, 1.0), (1.0, 2.0, 3.0)][: 1 + (links > 4)]
    task, random = DesignTask(targets=[path], links=[links], plates=plates), np.random.default_rng(1)
    model = Model(task, list(plans(task, links))[plan], random)
    X = model.write(random_starts(model, 5, random))
    values, slopes = zip(*plates_of(model, model.read(X)))
    assert len(values) == 3 * len(plates) and len({value.tobytes() for value in values}) == len(values)
    for column in range(model.size):
        ends = []
        for step in (1e-6, -1e-6):
            moved = X.copy()
            moved[:, column] += step
            ends.append(np.stack([value for value, _ in plates_of(model, model.read(moved))]))
        assert (ends[0] - ends[1]) / 2e-6 == pytest.approx(np.stack(slopes)[:, :, column], abs=1e-6)


@pytest.mark.slow
def test_a_soft_bound_is_a_wish() -> None:
    """A transmission angle that no four-bar with this path was found to keep rejects none, and costs what it lacks."""
    path = PathTarget.segment((0, 0), (4, 0), count=8)
    task = DesignTask(targets=[path], links=[4], transmission="80 deg", soft={"transmission": 0.01})
    found = design(task, count=1)
    assert found.accepted
    answer, angle = found[0], found[0].transmission
    assert angle < task.transmission and answer.wishes["transmission"] == pytest.approx(task.transmission - angle)
    free = design(replace(task, transmission=0.0, soft={}), count=1)[0]
    assert angle > free.transmission + math.radians(3.0)  # the wish was heard


@pytest.mark.long
def test_a_wish_counts_by_its_weight_alone() -> None:
    """Squares of the error grow with the square of its weight, whatever the weight of bounds; it is no bound."""
    path, squares, bounds = PathTarget.segment((0, 0), (4, 0), count=8), [], []
    for soft in ({"transmission": 0.1}, {"transmission": 0.2}, {"transmission": 0.4}, {}):
        task = DesignTask(targets=[path], links=[4], transmission="85 deg", soft=soft)
        random = np.random.default_rng(3)
        problem = TaskProblem(Model(task, next(plans(task, 4)), random, sense=1))
        X, times = placed_starts(problem, random_starts(problem.model, 300, random), 6, random)
        squares.append(problem.linearise(X, times, 1e-12)[0].error[0] ** 2)
        bounds.append({k: problem.exactly(x, None).bounds for k, x in enumerate(X)})
    assert 0.0 < squares[1] - squares[0] == pytest.approx((squares[2] - squares[1]) / 4.0, rel=1e-6)
    assert squares[3] == pytest.approx(squares[0] - (squares[1] - squares[0]) / 3.0, rel=1e-6)
    moving = [k for k, own in bounds[3].items() if len(own)]
    assert moving and all(len(bounds[0][k]) == len(bounds[3][k]) - 1 for k in moving)


@pytest.mark.parametrize(
    "more, words",
    [
        ({"plates": [(1, 1, 3)], "links": [6]}, "no side of a triangle is longer"),
        ({"plates": [(1, 1)], "links": [6]}, "three distances of its holes"),
        ({"soft": {"crank": 1.0}}, "soft = 'crank'"),
        ({"soft": {"box": 0.0}}, "must be positive"),
    ],
)
def test_plates_and_wishes_that_cannot_be(more: dict[str, Any], words: str) -> None:
    with pytest.raises(GeometryError, match=words):
        DesignTask(targets=[PathTarget.segment((0, 0), (4, 0))], **more)


def test_a_four_bar_without_a_point_has_no_plates() -> None:
    with pytest.raises(GeometryError, match="or name a point"):
        DesignTask(targets=[SwingTarget(least=1.0)], plates=[(1, 1, 1)], links=[4])
