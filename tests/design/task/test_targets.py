"""Targets and tasks: shapes against closed forms, formulas, what is refused and how."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from graphsynth.core.errors import GeometryError
from graphsynth.design import DesignTask, DwellTarget, FunctionTarget, PathTarget, PosesTarget, SwingTarget, design
from graphsynth.design.task.formulas import formula
from graphsynth.design.task.impossible import proof


def test_an_arc_has_its_length_and_centre() -> None:
    z = PathTarget.arc((1, 2), 3.0, 0.0, "90 deg", count=91).goal
    assert np.abs(np.abs(z - (1 + 2j)) - 3.0).max() < 1e-12
    assert abs(z[0] - (4 + 2j)) < 1e-12 and abs(z[-1] - (1 + 5j)) < 1e-12
    assert abs(np.abs(np.diff(z)).sum() - 1.5 * math.pi) < 2e-4


def test_svg_curves_are_those_of_their_formulas() -> None:
    """A cubic, a quadratic, an arc and a line, each against points of the same curve in closed form; y turned up."""
    t = np.linspace(0.0, 1.0, 2001)
    cubic = (1 - t) ** 3 * 0 + 3 * (1 - t) ** 2 * t * 2j + 3 * (1 - t) * t**2 * (4 + 2j) + t**3 * 4
    quadratic = (1 - t) ** 2 * 0 + 2 * (1 - t) * t * (1 + 3j) + t**2 * 2
    circle = -1 + np.exp(1j * math.pi * (t - 1)) + 1
    for data, curve in (
        ("M0 0 C0 2 4 2 4 0", cubic),
        ("M0 0 Q1 3 2 0", quadratic),
        ("M-1 0 A1 1 0 0 0 1 0", np.conj(circle)),
        ("M0 0 L3 4", 3 * t + 4j * t),
    ):
        found = PathTarget.svg(data, count=60)
        assert not found.closed
        away = np.abs(found.goal[:, None] - np.conj(curve)[None]).min(axis=1)
        assert away.max() < 2e-3 * np.abs(curve).max(), data
        steps = np.abs(np.diff(found.goal))
        assert np.ptp(steps) < 2e-2 * steps.mean(), data


def test_a_closed_drawing_does_not_repeat_its_first_point() -> None:
    square = PathTarget.svg("M0 0 H1 V1 H0 Z", count=40)
    assert square.closed and len(square.points) == 40
    corners = PathTarget.polyline([(0, 0), (1, 0), (1, -1), (0, -1)], closed=True, count=40)
    assert np.allclose(square.goal, corners.goal)
    steps = np.abs(np.diff(np.append(square.goal, square.goal[0])))
    assert np.allclose(steps, 0.1)


def test_formulas_are_arithmetic_and_nothing_else() -> None:
    x = np.linspace(1.0, 2.0, 5)
    assert np.allclose(formula("-x**2 + 3*sin(pi*x)/2")(x), -(x**2) + 1.5 * np.sin(np.pi * x))
    assert formula("2")(x).tolist() == [2.0] * 5
    for bad in ("__import__('os')", "x.real", "[x]", "y", "x if x else 1", "log(x, 2)", "", "x" * 300, "'a'"):
        with pytest.raises(GeometryError, match="formula ="):
            formula(bad)


def test_a_function_is_drawn_out_over_its_ranges() -> None:
    found = FunctionTarget.of(np.square, (1, 3), input_range="60 deg", output_range="-90 deg", count=3)
    assert found.inputs is not None
    assert np.allclose(found.inputs, [0.0, math.pi / 6, math.pi / 3])
    assert np.allclose(found.outputs, [0.0, -math.pi / 2 * 3 / 8, -math.pi / 2])


def test_a_tolerance_is_an_angle_with_its_unit_or_a_part_of_the_size() -> None:
    angle = math.radians(4.0)
    wanted = FunctionTarget(inputs=[0, 1], outputs=["0 deg", "30 deg"], tolerance="4 deg")
    assert math.isclose(wanted.tolerance, angle) and FunctionTarget(inputs=[0, 1], outputs=[0, 1]).tolerance == 0.01
    assert all(
        math.isclose(t.tolerance, angle)
        for t in (DwellTarget(span=1, tolerance="4 deg"), SwingTarget(least=1, tolerance="4 deg"))
    )
    assert PathTarget.segment((0, 0), (4, 0), tolerance=0.02).tolerance == 0.02


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: PathTarget(points=[(0, 0)]), "2 to 400 points"),
        (lambda: PathTarget(points=[(0, 0), (0, 0)]), "do not all coincide"),
        (lambda: PathTarget(points=[(0, 0), (1, 0)], inputs=[1, 0]), "must increase"),
        (lambda: PathTarget(points=[(0, 0), (1, 0)], closed=True, mean=True), "a closed path is a whole curve"),
        (lambda: PathTarget(points=[(0, 0), (1, 0)], inputs=[0]), "2 values but 1 inputs"),
        (lambda: PathTarget(points=[(0, 0), (1, 0)], inputs=[0, 7]), "at most one turn"),
        (lambda: PathTarget(points=[(0, 0), (1, 0)], tolerance=0), "tolerance"),
        (lambda: PathTarget(points=[(0, 0), (1, 0)], tolerance="4 deg"), "a part of their size"),
        (lambda: PosesTarget(poses=[(0, 0, 0), (1, 0, 0)], tolerance="4 deg"), "a part of their size"),
        (lambda: SwingTarget(least=1, tolerance="-4 deg"), "tolerance"),
        (lambda: PathTarget.svg("nonsense"), "SVG path data"),
        (lambda: PathTarget.svg("M0 0"), "draws nothing"),
        (lambda: FunctionTarget(outputs=[0, 1]), "needs inputs"),
        (lambda: DwellTarget(span=7), "longer than a turn"),
        (lambda: SwingTarget(least=2, most=1), "least <= most"),
        (lambda: SwingTarget(time_ratio=0.5), "time_ratio"),
        (lambda: PosesTarget(poses=[(0, 0, 0)]), "2 to 400 poses"),
        (lambda: PosesTarget(poses=[(0, 0, 1), (0, 0, 1)]), "not all the same"),
        (lambda: SwingTarget(link=""), "empty name"),
        (lambda: PathTarget(points=[(0, 0), (1, 0)], point=""), "empty name"),
        (lambda: DesignTask(targets=[]), "one or more targets"),
        (lambda: task(links=[5]), "even numbers"),
        (lambda: DesignTask(targets=[SwingTarget(least=1, slides=True)]), "sliders = 0"),
        (
            lambda: DesignTask(targets=[SwingTarget(least=1, slides=True), DwellTarget(span=1)], sliders=1),
            "slides for one target and turns for another",
        ),
        (lambda: task(span=1.0), "rocking"),
        (lambda: task(pivots=[(0, 0), (0, 0)]), "pivots = .* repeat"),
        (lambda: task(box=(0, 0, 0, 1)), "x0 < x1"),
        (lambda: task(lengths=(2, 1)), "must not be larger"),
        (lambda: task(rank={"beauty": 1}), "rank"),
        (lambda: DesignTask(targets=[SwingTarget(time_ratio=2)], drive="rocking", span=1), "turns fully"),
        (
            lambda: DesignTask(
                targets=[DwellTarget(span=1), FunctionTarget(inputs=[0, 2], outputs=[0, 1])], drive="slide"
            ),
            "drive goes from 0 to 1",
        ),
        (
            lambda: DesignTask(targets=[DwellTarget(span="60 deg")], drive="rocking", span="50 deg"),
            "input of 1.0472, but the drive goes from 0 to 0.872665",
        ),
        (
            lambda: DesignTask(targets=[FunctionTarget(inputs=[-0.5, 0.5], outputs=[0, 1])], drive="slide"),
            "input of -0.5",
        ),
        (lambda: DesignTask(targets=[SwingTarget(least=1)], drive="rocking", span=1e-12), "0.001 to 2 pi"),
        (lambda: task(misalignment="100 deg"), "no small tilt"),
    ],
)
def test_what_cannot_be_is_refused_with_a_sentence(make: Any, words: str) -> None:
    with pytest.raises(GeometryError, match=words):
        make()


def task(**more: Any) -> DesignTask:
    return DesignTask(targets=[PathTarget.segment((0, 0), (4, 0))], **more)


@pytest.mark.parametrize(
    ("more", "words"),
    [
        ({"box": (-1, -1, 3, 1)}, "lies outside the box"),
        ({"box": (-1, -1, 5, 1), "pivots": [(0, 9)]}, "given pivot .* outside the box"),
        ({"pivots": [(0, 0), (9, 0)], "lengths": (0.5, 4)}, "9 apart"),
        ({"pivots": [(0, 0), (9, 0)], "lengths": (0.1, 20), "crank": 1.0}, "larger ratio"),
        ({"pivots": [(0, 0), (2, 0), (4, 0)], "links": [4]}, "more than 2 joints"),
        ({"box": (-1, -1, 5, 5), "pivot_region": (6, 6, 7, 7)}, "do not meet"),
        ({"crank": 9.0, "lengths": (0.5, 4)}, "the crank is 9"),
        ({"bars": [9.0], "lengths": (0.5, 4)}, "a given link has the length 9, but"),
        ({"bars": [1.0, 9.0]}, "length 9, and another 1: a larger ratio than 8"),
    ],
)
def test_impossible_tasks_say_why_without_a_search(more: dict[str, Any], words: str) -> None:
    import re

    found = design(task(**more))
    assert re.search(words, found.impossible) and found.pieces == 0 and len(found) == 0
    assert found.statement == f"impossible: {found.impossible}"


def test_what_is_given_widens_the_bounds_of_lengths_that_nobody_gave() -> None:
    assert task(crank=0.05, bars=[30.0]).lengths == (0.05, 30.0)
    assert not proof(task(crank=0.05))


def test_a_plate_is_within_bounds_if_its_sides_go_to_joints() -> None:
    """A side to a point that draws has no bound."""
    plate: dict[str, Any] = {"plates": [(1, 1, 1)], "lengths": (2, 3), "links": [6]}
    assert "length 1, but" in proof(DesignTask(targets=[SwingTarget(least=1)], **plate))
    assert not proof(task(**plate))
