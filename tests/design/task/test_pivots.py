"""Pivots that belong to the drive or to an output, regions of pivots, and chains in which no link does nothing."""

from __future__ import annotations

import math
from typing import Any

import pytest

import graphsynth as gs
from graphsynth.core.errors import GeometryError
from graphsynth.design import DesignTask, FunctionTarget, PathTarget, SwingTarget, design
from graphsynth.design.task.impossible import proof
from graphsynth.design.task.plans import Plan, plans

SEGMENT = PathTarget.segment((0, 0), (4, 0), count=12)
SWEEP = SwingTarget(least="50 deg", most="55 deg", link="blade", pivot=(4, 1))


def pivot_of(mechanism: gs.Mechanism, link: int) -> tuple[float, float]:
    """Where a link is jointed to the frame."""
    frame = mechanism.frame
    (own,) = (j for j in mechanism.joints if {*j.pair} == {frame, link})
    return own.at_a if own.a == frame else own.at_b


def test_every_plan_puts_the_drive_and_the_output_where_they_are_asked_for() -> None:
    task = DesignTask(targets=[SWEEP], drive_pivot=(0, 0), pivots=[(0, 0), (2, 2)], links=[4, 6])
    found = list(plans(task, 6))
    assert found and not list(plans(task, 4))  # (2, 2) is a third one
    for plan in found:
        frame, joints = plan.design.graph.frame, plan.design.graph.joints
        at = dict(plan.given)
        assert at[plan.design.driver_joints[0]] == (0.0, 0.0) and (2.0, 2.0) in at.values()
        (output,) = (k for k, joint in enumerate(joints) if {*joint[:2]} == {frame, plan.carriers[0]})
        assert at[output] == (4.0, 1.0)


@pytest.mark.long
def test_an_answer_has_the_motor_and_the_blade_at_their_places_and_a_pivot_in_its_region() -> None:
    found = design(DesignTask(targets=[SWEEP], drive_pivot=(-0.5, -0.5, 0.5, 0.25), links=[4]), count=2, seconds=30)
    assert found.accepted
    for answer in found.answers:
        mechanism = answer.mechanism
        assert pivot_of(mechanism, answer.carriers["blade"]) == pytest.approx((4, 1), abs=1e-12)
        x, y = pivot_of(mechanism, mechanism.drivers[0].link)
        assert -0.5 <= x <= 0.5 and -0.5 <= y <= 0.25


def test_the_foot_of_a_cylinder_is_a_pivot_of_the_drive() -> None:
    turn = FunctionTarget(inputs=[0, 0.5, 1], outputs=[0, 0.4, 0.9], pivot=(0, 0))
    for plan in plans(DesignTask(targets=[turn], drive="cylinder", drive_pivot=(3, 0), links=[4]), 4):
        (foot,) = (k for k, p in plan.given if p == (3.0, 0.0))
        assert {*plan.design.graph.joints[foot][:2]} & {*plan.design.drivers[0]}


@pytest.mark.parametrize(
    ("words", "told"),
    [
        ({"drive_pivot": (1, 2, 3)}, "drive_pivot has three numbers; give two"),
        ({"drive_pivot": (1, 2, 0, 3)}, "x0 < x1"),
        ({"pivots": [(0, 0), (0, 0)]}, "pivots = .* repeat"),
        ({"drive": "slide", "sliders": 1, "drive_pivot": (0, 0)}, "a slide on the frame has no pivot"),
        ({"pivots": [(0, "a")]}, "pivots"),
    ],
)
def test_pivots_that_make_no_sense_are_refused(words: dict[str, Any], told: str) -> None:
    with pytest.raises(GeometryError, match=told):
        DesignTask(targets=[SEGMENT], **words)


def test_a_link_that_slides_has_no_pivot() -> None:
    with pytest.raises(GeometryError, match="slides and has no pivot"):
        SwingTarget(least=1.0, slides=True, pivot=(0, 0))


def test_pivots_and_regions_outside_the_box_are_impossible() -> None:
    outside = DesignTask(targets=[SWEEP], box=(-1, -1, 3, 3))
    assert "pivot (4, 1) lies outside the box" in proof(outside)
    region = DesignTask(targets=[SEGMENT], pivots=[(5, 5, 6, 6)], box=(-1, -1, 4.5, 3))
    assert "region (5.0, 5.0, 6.0, 6.0) of a pivot lies outside the box" in proof(region)
    assert proof(DesignTask(targets=[SEGMENT], pivots=[(4, 2, 6, 6)], box=(-1, -1, 4.5, 3))) == ""


# --- links that do nothing


def moved_without(plan: Plan, gone: set[int]) -> bool:
    """Whether the rest of a chain is a mechanism of one freedom that carries all that is named (Gruebler)."""
    graph = plan.design.graph
    left = {*range(graph.links)} - gone
    joints = [joint for joint in graph.joints if {*joint[:2]} <= left]
    kept = {graph.frame, *plan.design.drivers[0], *plan.carriers} <= left
    return kept and 3 * (len(left) - 1) - 2 * len(joints) == 1


@pytest.mark.parametrize("links", [4, 6, 8])
def test_no_part_of_a_chain_can_be_left_out(links: int) -> None:
    """By brute force over all sets of two or four links: what is left has one freedom, and carries the point."""
    from itertools import combinations

    task = DesignTask(targets=[SEGMENT], links=[links])
    found = list(plans(task, links))
    sets = [{*some} for n in (2, 4, 6) for some in combinations(range(links), n)]
    assert found and not any(moved_without(plan, gone) for plan in found for gone in sets)


@pytest.mark.long
def test_an_arc_is_not_drawn_by_the_crank_pin_with_two_idle_links() -> None:
    arc = PathTarget.arc((0, 0), 2.0, "0 deg", "90 deg", count=12)
    found = design(DesignTask(targets=[arc], links=[4]), count=2, seconds=40)
    for answer in found.answers:
        mechanism, point = answer.mechanism, answer.mechanism.points["P"]
        crank = mechanism.drivers[0].link
        (pin,) = (j for j in mechanism.joints if {*j.pair} == {crank, point.link})
        at = pin.at_a if pin.a == point.link else pin.at_b
        assert not answer.accepted or math.dist(at, point.at) > 0.09 * arc.size
