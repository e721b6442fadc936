"""Dimensions with gear pairs, circular cams and pins in slots: what is accepted obeys the joints, by own formulas."""

from __future__ import annotations

import math

import numpy as np
import pytest

from graphsynth.core.errors import GeometryError
from graphsynth.kinematics import simulate
from graphsynth.kinematics.dimensional import Embodiment, Goals, embody
from graphsynth.kinematics.dimensional.design import Design, joint_kinds, teeth
from graphsynth.kinematics.dimensional.verify import side_lengths
from graphsynth.mechanism.constraints import residual
from graphsynth.mechanism.joints import Cam, Gear, PinSlot, Revolute
from graphsynth.mechanism.model import Mechanism
from graphsynth.structure.graph import MechanismGraph

#: Geared five-bars: wheels 1 and 4 on the frame; the wheel 2 rolls on the frame, carried by the crank 1.
FIXED_AXES = MechanismGraph(5, [(0, 1), (1, 2), (2, 3), (3, 4), (0, 4), (1, 4, 2)], frame=0)
PLANETARY = MechanismGraph(5, [(0, 1), (1, 2), (2, 3), (3, 4), (0, 4), (0, 2, 2)], frame=0)
CAM_AND_FOLLOWER = MechanismGraph(3, [(0, 1), (0, 2), (1, 2, 2)], frame=0)
APART = MechanismGraph(5, [(0, 1), (1, 2), (2, 3), (3, 4), (0, 4), (1, 3, 2)], frame=0)
#: A higher pair between links that no third link joins.
LONG = MechanismGraph.from_text("DrW f0 2:2-4")


def world(mechanism: Mechanism, poses: np.ndarray, k: int, side: str) -> np.ndarray:
    joint = mechanism.joints[k]
    link, at = (joint.a, joint.at_a) if side == "a" else (joint.b, joint.at_b)
    return np.asarray(poses[:, link, 0] + 1j * poses[:, link, 1] + np.exp(1j * poses[:, link, 2]) * complex(*at))


def by_pair(graph: MechanismGraph, given: dict[tuple[int, int], str]) -> dict[tuple[int, int], str]:
    return {(j.a, j.b): kind for j, kind in zip(graph.joints, joint_kinds(graph, given))}


def wheels(found: Embodiment, carrier: int, first: int, second: int) -> None:
    """Teeth that pass relative to the carrier are equal in number, and the centres stay the sum of the radii apart."""
    assert found.accepted and found.mechanism is not None
    motion = simulate(found.mechanism, np.linspace(0.0, math.tau, 721))
    assert motion.completed and motion.closure.closed
    theta = np.unwrap(motion.poses[..., 2], axis=0)
    k = next(i for i, joint in enumerate(found.mechanism.joints) if isinstance(joint, Gear))
    joint = found.mechanism.joints[k]
    assert isinstance(joint, Gear) and joint.radius_a / joint.radius_b == pytest.approx(first / abs(second), rel=1e-12)
    a, b = theta[:, joint.a] - theta[:, carrier], theta[:, joint.b] - theta[:, carrier]
    rolled = first * (a - a[0]) + second * (b - b[0])
    assert np.abs(rolled).max() < 1e-8 and np.ptp(a) > 0.1
    apart = np.abs(world(found.mechanism, motion.poses, k, "a") - world(found.mechanism, motion.poses, k, "b"))
    assert apart == pytest.approx(np.full(len(apart), abs(joint.radius_a + joint.sign * joint.radius_b)), rel=1e-9)


def test_wheels_on_the_frame_roll_on_each_other() -> None:
    wheels(embody(FIXED_AXES), 0, 1, 1)


def test_a_planet_rolls_on_the_frame() -> None:
    wheels(embody(PLANETARY, driver=1), 1, 1, 1)


@pytest.mark.parametrize("kind, numbers", [("gear 2:1", (2, 1)), ("gear 3:-1", (3, -1))])
def test_teeth_are_kept(kind: str, numbers: tuple[int, int]) -> None:
    wheels(embody(PLANETARY, driver=1, joints={(0, 2): kind}), 1, *numbers)


def test_teeth_belong_to_the_links_as_they_are_named() -> None:
    forward = by_pair(PLANETARY, {(0, 2): "gear 3:-1"})
    assert forward == by_pair(PLANETARY, {(2, 0): "gear 1:-3"}) and forward[0, 2] == "gear 3:-1"


def test_a_frame_that_is_chosen_keeps_the_kinds() -> None:
    """Links are renumbered by the frame; the wheel with 3 teeth stays the same one."""
    chain = PLANETARY.without_frame()
    found = embody(chain, Goals(span=0.6), joints={(0, 2): "gear 3:1"})
    assert found.mechanism is not None
    gear = next(joint for joint in found.mechanism.joints if isinstance(joint, Gear))
    ratio = gear.radius_a / gear.radius_b
    assert ratio == pytest.approx(3.0) or ratio == pytest.approx(1.0 / 3.0)


def test_a_circular_cam_keeps_its_distance() -> None:
    found = embody(APART, joints={(1, 3): "cam"})
    assert found.accepted and found.mechanism is not None
    motion = simulate(found.mechanism, np.linspace(0.0, math.tau, 361))
    k = next(i for i, joint in enumerate(found.mechanism.joints) if isinstance(joint, Cam))
    radius = found.mechanism.joints[k].radius_a  # type: ignore[union-attr]
    apart = np.abs(world(found.mechanism, motion.poses, k, "a") - world(found.mechanism, motion.poses, k, "b"))
    assert motion.completed and apart == pytest.approx(np.full(len(apart), radius), rel=1e-9)


def test_rule_of_kinds() -> None:
    """Gears where a third link carries both, pins in slots elsewhere; a prismatic joint carries no wheel."""
    assert by_pair(APART, {})[1, 3] == by_pair(FIXED_AXES, {})[1, 4] == "gear"
    assert by_pair(LONG, {})[2, 4] == "pin-slot" and set(by_pair(LONG, {}).values()) == {"R", "pin-slot"}
    assert by_pair(FIXED_AXES, {(0, 1): "P"})[1, 4] == "pin-slot"


@pytest.mark.long
def test_a_pin_in_a_slot_by_choice() -> None:
    found = embody(APART, joints={(1, 3): "pin-slot"})
    assert found.accepted and found.mechanism is not None
    assert any(isinstance(joint, PinSlot) for joint in found.mechanism.joints)


def test_teeth_as_text() -> None:
    assert teeth("gear 12:-36") == (12, -36)
    assert [teeth(text) for text in ("gear 2:-2", "gear 0:1", "gear 2", "gear 1:0", "R")] == [None] * 5


@pytest.mark.parametrize(
    "graph, kinds, message",
    [
        (LONG, {(2, 4): "gear"}, "joint 2-4 cannot be a gear pair: no third link"),
        (PLANETARY, {(0, 2): "gear 2:-2"}, "cannot be 'gear 2:-2'; use one of"),
        (PLANETARY, {(0, 2): "R"}, "joint 0-2 has mobility 2 and cannot be 'R'"),
        (PLANETARY, {(0, 1): 7}, "joint 0-1 has mobility 1 and cannot be '7'"),
        (PLANETARY, {(0, 3): "gear"}, r"joints names \(0, 3\), but the graph has no such joint"),
    ],
)
def test_kinds_that_cannot_be(graph: MechanismGraph, kinds: dict, message: str) -> None:
    with pytest.raises(GeometryError, match=message):
        embody(graph, joints=kinds)


def test_a_set_of_dimensions_is_assembled_where_it_is_drawn() -> None:
    """Whatever the numbers, every joint closes at the first input: gears by their offset, cams by their centre."""
    random = np.random.default_rng(5)
    for graph, given in ((FIXED_AXES, {}), (PLANETARY, {(0, 2): "gear 5:-2"}), (APART, {(1, 3): "cam"})):
        design = Design(graph, ((0, 1),), joint_kinds(graph, given))
        mechanism = design.mechanism(
            random.normal(0.0, 1.0, (len(graph.joints), 2)), random.normal(0.0, 1.0, len(design.numbers))
        )
        assert np.abs(residual(mechanism.joints, mechanism.pose)).max() < 1e-12


@pytest.mark.parametrize(
    "graph, kind",
    [
        pytest.param(APART, "cam 0.2:0 0:0.1", marks=pytest.mark.long),
        (CAM_AND_FOLLOWER, "cam 0.3:0 0.05:0"),
    ],
)
def test_a_roller_keeps_to_a_given_profile(graph: MechanismGraph, kind: str) -> None:
    """By the polar form: the distance from the cam's centre to the roller, over the direction as the cam sees it."""
    found = embody(graph, joints=kind, driver=1, seed=1)  # other seeds find followers that turn with the cam
    assert found.accepted and found.mechanism is not None
    motion = simulate(found.mechanism, np.linspace(0.0, math.tau, 361))
    k = next(i for i, joint in enumerate(found.mechanism.joints) if isinstance(joint, Cam))
    joint = found.mechanism.joints[k]
    way = world(found.mechanism, motion.poses, k, "b") - world(found.mechanism, motion.poses, k, "a")
    psi = np.angle(way) - motion.poses[:, joint.a, 2] - joint.angle_a
    rho = np.ones(len(psi))
    for order, pair in enumerate(kind.split()[1:], 1):
        cosine, sine = map(float, pair.split(":"))
        rho += cosine * np.cos(order * psi) + sine * np.sin(order * psi)
    assert np.ptp(np.abs(way)) > 0.1 * np.abs(way).mean()  # it is not used where it is round
    assert np.abs(way) == pytest.approx(joint.radius_a * rho, rel=1e-9)


def test_the_size_beside_a_profile_is_searched() -> None:
    """Two searches do not end with the same ratio of the frame to the cam."""
    sizes = set()
    for seed in (0, 1):
        mechanism = embody(CAM_AND_FOLLOWER, seed=seed, driver=1, joints="cam 0.2:0").mechanism
        assert mechanism is not None
        radius = next(joint.radius for joint in mechanism.joints if isinstance(joint, Cam))
        frame = [joint.at_a for joint in mechanism.joints if joint.a == 0]
        assert len(frame) == 2
        sizes.add(round(math.dist(*frame) / radius, 6))
    assert len(sizes) == 2


def test_derivatives_through_a_profile() -> None:
    """Gradients by places and numbers against differences of the dimensions, every column."""
    random = np.random.default_rng(3)
    design = Design(APART, ((0, 1),), joint_kinds(APART, {(1, 3): "cam 0.2:-0.1 0:0.05"}))
    places, numbers = random.normal(0.0, 1.0, (1, 6, 2)), random.normal(0.0, 1.0, (1, len(design.numbers)))
    by = random.normal(0.0, 1.0, (1, 1, 6, 10, 1))
    found = design.pulled(by, places, numbers)[0, 0, 0]
    x = np.concatenate([places.ravel(), numbers.ravel()])
    for k, value in enumerate(found):
        ends = []
        for step in (1e-6, -1e-6):
            moved = x.copy()
            moved[k] += step
            ends.append(design.dimensions(moved[:12].reshape(1, 6, 2), moved[None, 12:]))
        assert value == pytest.approx(float((by[0, 0, :, :, 0] * (ends[0] - ends[1])[0]).sum()) / 2e-6, abs=1e-8)


def test_a_rule_holds_where_it_can() -> None:
    """A gear needs a carrier; what is named goes before the rule."""
    assert "pin-slot" in joint_kinds(LONG, {}, "gear 2:1") and "cam" in joint_kinds(LONG, {}, "cam")
    assert "gear 2:1" in joint_kinds(APART, {}, "gear 2:1")
    assert "pin-slot" in joint_kinds(APART, {(1, 3): "pin-slot"}, "cam 0.1:0")
    for pairs in ("R", "cam 0.1", "cam 2:0", "wheel"):
        with pytest.raises(GeometryError):
            joint_kinds(APART, {}, pairs)


@pytest.mark.parametrize("rates", [(1.0, 2.0), (2.0, -3.0)])
def test_drivers_turn_at_rates_of_their_own(rates: tuple[float, float]) -> None:
    """Both cranks of a five-bar; the two rods keep their lengths between them, from poses of the cranks alone."""
    five = MechanismGraph(5, [(0, 1), (1, 2), (2, 3), (3, 4), (0, 4)], frame=0)
    found = embody(five, Goals(rates=rates), driver=[1, 4])
    assert found.accepted and found.mechanism is not None
    inputs = np.linspace(0.0, math.tau, 73)
    motion = simulate(found.mechanism, inputs)
    assert motion.completed and motion.closure.closed
    theta = np.unwrap(motion.poses[..., 2], axis=0)
    for link, rate in zip((1, 4), rates):
        assert theta[:, link] - theta[0, link] == pytest.approx(rate * inputs, abs=1e-9)


@pytest.mark.parametrize("rates, message", [((1.0, 0.5), "whole numbers"), ((1.0, 0.0), "must not be 0")])
def test_rates_that_make_no_turn(rates: tuple[float, float], message: str) -> None:
    with pytest.raises(GeometryError, match=message):
        Goals(rates=rates)
    with pytest.raises(GeometryError, match="3 rates are given, but the mobility is 1; give one"):
        embody(APART, Goals(rates=(1.0, 1.0, 1.0)))


def test_a_pin_in_a_slot_is_a_place_on_its_link() -> None:
    """The bar of 2 with a pin near its joint counts as short: 0.2."""
    joints = (Revolute(0, 1), Revolute(1, 2, (1.0, 0.0)), PinSlot(0, 2, (0.0, 0.5), (0.2, 0.0)))
    graph = MechanismGraph(3, [(0, 1), (1, 2), (0, 2, 2)], frame=0)
    assert sorted(side_lengths(Mechanism(graph, joints))) == pytest.approx([0.2, 1.0])
    design = Design(graph, ((0, 1),), ("R", "pin-slot", "R"))
    assert {(0, 2), (1, 2)} == {tuple(sorted(pair)) for pair in design.sides.tolist()}
