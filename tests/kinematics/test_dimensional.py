"""Embodiment without targets: what is accepted moves, and what does not move is not accepted."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from graphsynth.core.errors import GeometryError, GraphError
from graphsynth.kinematics import simulate
from graphsynth.kinematics.dimensional import Embodiment, Goals, embody
from graphsynth.kinematics.dimensional.design import Design, choices
from graphsynth.kinematics.dimensional.problem import DimensionProblem
from graphsynth.kinematics.dimensional.sketch import layout
from graphsynth.kinematics.dimensional.transmission import GroupForm, Tie, group_forms, transmission_sines
from graphsynth.kinematics.dimensional.verify import length_ratio, smallest_transmission, verify
from graphsynth.mechanism.joints import Cam, Gear, PinSlot, Prismatic, Revolute
from graphsynth.mechanism.laws import Driver, Linear
from graphsynth.mechanism.model import Mechanism
from graphsynth.structure.graph import MechanismGraph
from graphsynth.synthesis import enumerate_chains

CYCLE = MechanismGraph(4, [(0, 1), (1, 2), (2, 3), (0, 3)], frame=0)
FIVE = MechanismGraph(5, [(0, 1), (1, 2), (2, 3), (3, 4), (0, 4)], frame=0)
TRIAD = MechanismGraph(6, [(0, 1), (1, 3), (2, 3), (2, 4), (0, 4), (2, 5), (0, 5)], frame=0)


@cache
def chains(links: int) -> tuple[MechanismGraph, ...]:
    return tuple(enumerate_chains(links))


def four_bar(frame: float, crank: float, coupler: float, rocker: float, offset: float = 0.0) -> Mechanism:
    joints = (
        Revolute(0, 1), Revolute(1, 2, (crank, 0.0)), Revolute(2, 3, (coupler, 0.0), (rocker, 0.0)),
        Revolute(0, 3, (frame, 0.0)),
    )  # fmt: skip
    return Mechanism(CYCLE, joints, (Driver(0, 1, Linear(offset=offset)),))


def recheck(found: Embodiment, span: float = math.tau) -> None:
    """Independent of the engine's own checks: joints hold, bars keep their lengths, nothing jumps, the turn closes."""
    assert found.accepted and found.mechanism is not None
    mechanism = found.mechanism
    driver = mechanism.drivers[0]
    u = np.linspace(0.0, span, 401)
    motion = simulate(mechanism, u)
    assert motion.completed
    pose = motion.poses
    size = max(np.hypot(*joint.at_a) for joint in mechanism.joints) + max(np.hypot(*j.at_b) for j in mechanism.joints)

    def world(link: int, at: tuple[float, float]) -> np.ndarray:
        return np.asarray(pose[:, link, 0] + 1j * pose[:, link, 1] + np.exp(1j * pose[:, link, 2]) * complex(*at))

    pins = {}
    for joint in mechanism.joints:
        if isinstance(joint, Revolute):
            on_a, on_b = world(joint.a, joint.at_a), world(joint.b, joint.at_b)
            assert np.abs(on_a - on_b).max() < 1e-9 * size
            pins[joint.pair] = on_a
    for link in range(mechanism.graph.links):
        own = [z for pair, z in pins.items() if link in pair]
        for i, p in enumerate(own):
            for q in own[i + 1 :]:
                length = np.abs(p - q)
                assert np.ptp(length) < 1e-9 * size and length.min() > 0.0
    for z in pins.values():
        assert np.abs(np.diff(z)).max() < 0.2 * size  # no jump to another branch between samples
        if found.goals.full_turn:
            assert abs(z[-1] - z[0]) < 1e-9 * size
    if found.goals.full_turn and isinstance(mechanism.joint(*driver.pair), Revolute):
        turned = pose[:, driver.link, 2] - pose[:, driver.base, 2]
        assert abs(abs(turned[-1] - turned[0]) - math.tau) < 1e-9


# --- every small chain moves


@pytest.mark.parametrize("links", [4, 6])
def test_every_four_and_six_link_inversion_moves(links: int) -> None:
    for chain in chains(links):
        for mechanism in chain.inversions():
            recheck(embody(mechanism))


@pytest.mark.long
@pytest.mark.parametrize("index", [0, 5, 9, 15])  # dyads; triads; a triad with a dyad; one group of six links
def test_eight_link_chains_move(index: int) -> None:
    recheck(embody(chains(8)[index]))


@pytest.mark.slow
def test_every_eight_link_chain_and_inversion_moves() -> None:
    inversions = [mechanism for chain in chains(8) for mechanism in chain.inversions()]
    assert (len(chains(8)), len(inversions)) == (16, 71)
    for graph in (*chains(8), *inversions):
        found = embody(graph)
        recheck(found)
        assert found.seconds < 10.0  # typically 0.2 s; the bound allows for a busy computer


@pytest.mark.slow
@settings(max_examples=12, deadline=None)
@given(st.integers(0, 17), st.integers(0, 7), st.integers(0, 999))
def test_accepted_bars_keep_their_lengths(index: int, inversion: int, seed: int) -> None:
    chain = (*chains(6), *chains(8))[index]
    frames = chain.inversions()
    found = embody(frames[inversion % len(frames)], seed=seed, tries=2)
    if found.accepted:
        recheck(found)
    else:
        assert "nothing was accepted" in found.statement


def test_bounds_are_kept_as_recomputed() -> None:
    goals = Goals(min_transmission_angle=math.radians(30.0), max_length_ratio=4.5)
    found = embody(chains(8)[2], goals)
    assert found.accepted and found.mechanism is not None and found.motion is not None and found.figures is not None
    lengths = []
    for link in range(8):
        at = [
            complex(*(joint.at_a if joint.a == link else joint.at_b))
            for joint in found.mechanism.joints
            if link in joint.pair
        ]
        lengths += [abs(p - q) for k, p in enumerate(at) for q in at[k + 1 :]]
    assert max(lengths) / min(lengths) == pytest.approx(found.figures.length_ratio)
    assert max(lengths) / min(lengths) <= 4.5 * (1 + 1e-6)
    angles = [angle.min() for angle in found.motion.transmission_angle().values()]
    assert found.figures.transmission_angle == pytest.approx(min(angles))
    assert min(angles) >= math.radians(30.0) - 1e-6


def test_same_seed_same_result() -> None:
    first, second, other = embody(chains(6)[0]), embody(chains(6)[0]), embody(chains(6)[0], seed=1)
    assert first.mechanism is not None and second.mechanism is not None and other.mechanism is not None
    assert first.mechanism.to_json() == second.mechanism.to_json()
    assert first.history == second.history and first.evaluations == second.evaluations
    assert first.mechanism.to_json() != other.mechanism.to_json()


def test_pose_belongs_to_the_first_input_and_files_keep_it() -> None:
    found = embody(chains(8)[0])
    assert found.mechanism is not None and found.motion is not None
    again = simulate(Mechanism.from_toml(found.mechanism.to_toml()), found.motion.inputs)
    assert np.array_equal(again.poses, found.motion.poses)
    np.testing.assert_allclose(found.motion.poses[0], found.mechanism.pose, atol=1e-9)


# --- other joints, other mobilities


@pytest.mark.parametrize("kinds", [{(0, 3): "P"}, {(2, 3): "P"}, {(2, 3): "P", (0, 3): "P"}])
def test_sliders(kinds: dict[tuple[int, int], str]) -> None:
    found = embody(CYCLE, driver=1, joints=kinds)
    recheck(found)
    assert found.mechanism is not None and found.motion is not None
    assert {joint.pair for joint in found.mechanism.joints if isinstance(joint, Prismatic)} == set(kinds)
    assert found.motion.residual < 1e-12


def test_slider_of_a_chain_stays_on_its_joint() -> None:
    """Kinds are given by pair of the chain; the frame that is chosen renumbers the links."""
    chain = MechanismGraph(4, [(0, 1), (1, 2), (2, 3), (0, 3)])
    found = embody(chain, joints={(1, 2): "P"})
    assert found.accepted and found.mechanism is not None
    assert sum(isinstance(joint, Prismatic) for joint in found.mechanism.joints) == 1


def test_driven_slider_over_its_stroke() -> None:
    found = embody(CYCLE, Goals(span=0.5), driver=3, joints={(0, 3): "P"})
    recheck(found, 0.5)


def test_pin_in_slot() -> None:
    found = embody(MechanismGraph(3, [(0, 1), (1, 2, 2), (0, 2)], frame=0))
    recheck(found)
    assert found.motion is not None and found.motion.residual < 1e-12


def test_five_bar_has_two_drivers() -> None:
    found = embody(FIVE)
    recheck(found)
    assert found.drivers == ((0, 1), (0, 4))


def test_rocking_driver_over_a_range() -> None:
    found = embody(CYCLE, Goals(span=1.0), driver=1)
    recheck(found, 1.0)
    assert found.motion is not None and found.motion.inputs[-1] == 1.0


# --- the choice of frame and driver


def test_order_of_choices_prefers_dyads() -> None:
    for chain in chains(8):
        order = choices(chain, None)
        sizes = []
        from graphsynth.structure.assur import decompose

        for graph, drivers in order:
            sizes.append(max((len(group.links) for group in decompose(graph, drivers).groups), default=0))
        assert sizes == sorted(sizes)
        assert order == choices(chain, None)


def test_given_driver_is_used() -> None:
    assert embody(CYCLE, driver=3).drivers == ((0, 3),)
    assert embody(CYCLE, driver=(0, 3)).drivers == ((0, 3),)


# --- what is not accepted


def test_verification_refuses_what_does_not_turn() -> None:
    motion, _, reasons = verify(four_bar(3.0, 2.0, 1.6, 2.0), Goals(min_transmission_angle=0.0))
    assert not motion.completed and "the range is not completed" in reasons


def test_verification_refuses_a_change_point() -> None:
    _, _, reasons = verify(four_bar(2.0, 1.0, 2.0, 1.0), Goals(min_transmission_angle=0.0))
    assert "two assembly modes meet or nearly meet" in reasons


def test_verification_refuses_bounds_not_kept() -> None:
    lambda_linkage = four_bar(2.0, 1.0, 2.5, 2.5)
    least = math.acos((2 * 2.5**2 - 1.0) / (2 * 2.5**2))  # law of cosines with the pin nearest to the rocker's pivot
    _, figures, reasons = verify(lambda_linkage, Goals(min_transmission_angle=least + 1e-3))
    assert figures.transmission_angle == pytest.approx(least, abs=1e-12)
    assert reasons == ("the transmission angle is too small",)
    assert verify(lambda_linkage, Goals(min_transmission_angle=least - 1e-3))[2] == ()
    assert verify(lambda_linkage, Goals(min_transmission_angle=0.0, max_length_ratio=2.4))[2] == (
        "the length ratio is too large",
    )
    assert length_ratio(lambda_linkage) == 2.5


def test_verification_refuses_a_narrow_gap_between_samples() -> None:
    """Crank and frame a hair longer than coupler and rocker: a gap of 0.2 degrees about pi, between samples."""
    samples = 0.004 + np.linspace(0.0, math.tau, 721)
    assert np.abs(samples - math.pi).min() > 2.0 * math.sqrt(3e-6)
    mechanism = four_bar(2.0, 1.0, 1.6, 1.4 - 1e-6, offset=0.004)
    motion, _, reasons = verify(mechanism, Goals(min_transmission_angle=0.0))
    assert "the range is not completed" in reasons
    assert motion.stopped_at + 0.004 == pytest.approx(math.pi - math.sqrt(3e-6), abs=1e-6)


def test_nothing_accepted_is_said_with_reasons() -> None:
    found = embody(CYCLE, Goals(min_transmission_angle=math.radians(85.0), max_length_ratio=2.0), tries=2)
    assert not found.accepted and found.mechanism is not None and found.figures is not None
    assert found.reasons["result: the transmission angle is too small"] == 2
    assert found.statement.startswith("nothing was accepted in 2 searches")


def test_history_is_a_table() -> None:
    table = embody(CYCLE).to_pandas()
    assert list(table.columns) == ["attempt", "generation", "evaluations", "cost"]
    assert (table.cost.diff().dropna() <= 0.0).all() and (table.evaluations.diff().dropna() > 0).all()


@pytest.mark.parametrize(
    ("goals", "message"),
    [
        ({"min_transmission_angle": 1.6}, "min_transmission_angle = 1.6"),
        ({"max_length_ratio": 0.5}, "max_length_ratio = 0.5"),
        ({"span": -1.0}, "span = -1.0"),
        ({"span": math.nan}, "span"),
        ({"target": 3}, "target = 3"),
    ],
)
def test_bad_goals(goals: dict[str, object], message: str) -> None:
    with pytest.raises(GeometryError, match=message):
        Goals(**goals)  # type: ignore[arg-type]


def test_bad_questions() -> None:
    with pytest.raises(GraphError, match="frame"):
        embody(CYCLE.without_frame(), driver=1)
    with pytest.raises(GraphError, match="mobility 0"):
        embody(MechanismGraph(3, [(0, 1), (1, 2), (0, 2)], frame=0))
    with pytest.raises(GraphError, match="joint"):
        embody(CYCLE, driver=2)
    with pytest.raises(GeometryError, match="no such joint"):
        embody(CYCLE, joints={(0, 2): "P"})
    with pytest.raises(GeometryError, match="cannot be 'gear'"):
        embody(CYCLE, joints={(0, 1): "gear"})
    with pytest.raises(GeometryError, match="seed"):
        embody(CYCLE, seed=-1)
    with pytest.raises(GeometryError, match="tries"):
        embody(CYCLE, tries=0)


@pytest.mark.parametrize(("angle", "ratio", "why"), [(1.4, 50.0, "transmission angle"), (0.1, 1.2, "length ratio")])
def test_the_reason_named_first_is_that_of_the_best_result(angle: float, ratio: float, why: str) -> None:
    found = embody(chains(6)[0], Goals(min_transmission_angle=angle, max_length_ratio=ratio), tries=1, effort=0.05)
    assert not found.accepted and found.figures is not None and all(count > 0 for count in found.reasons.values())
    assert next(iter(found.reasons)).startswith(f"result: the {why} is")
    assert (found.figures.transmission_angle < angle) == (why == "transmission angle")


# --- transmission of larger groups


def test_bar_formula_is_the_classical_angle_of_a_four_bar() -> None:
    mechanism = four_bar(3.0, 1.0, 2.6, 2.4)
    motion = simulate(mechanism, np.linspace(0.0, math.tau, 50), modes={0: 1})
    frames = np.concatenate(
        [motion.poses[..., :2], np.cos(motion.poses[..., 2:]), np.sin(motion.poses[..., 2:])], axis=-1
    )
    ends = [(joint.a, joint.b) for joint in mechanism.joints]
    # link 3 turns about its pivot on the frame (joint 1), the coupler is the bar from joint 2 to joint 3
    form = GroupForm(0, False, (3,), (Tie("bar", 2, 1, 3, 3),), (Tie("R", 1, 0, 1, 3),))
    sines = transmission_sines([form], mechanism.dimensions[None], ends, frames[None], motion.margins[None])
    diagonal = 9.0 + 1.0 - 6.0 * np.cos(motion.inputs)
    cosine = (2.6**2 + 2.4**2 - diagonal) / (2 * 2.6 * 2.4)
    np.testing.assert_allclose(sines[0, :, 0], np.sqrt(1.0 - cosine**2), atol=1e-12)


def test_bar_formula_of_a_triad_against_lengthened_bars() -> None:
    """Lengthen one bar a little at a fixed input: its end moves by 1 / sin(mu) for each unit of length."""
    vertices = [(0.0, 0.0), (1.0, 0.2), (0.4, 1.0)]
    anchors = [complex(math.cos(0.6), math.sin(0.6)), 4.0 - 1.0j, 1.0 + 5.0j]
    places = [1.5 + 1.2j + np.exp(0.2j) * complex(*at) for at in vertices]
    base = [abs(p - q) for p, q in zip(places, anchors)]
    angles = [float(np.angle(p - q)) for p, q in zip(anchors, places)]
    guess = np.array(
        [(0, 0, 0), (0, 0, 0.6), (1.5, 1.2, 0.2)] + [(p.real, p.imag, angle) for p, angle in zip(places, angles)]
    )

    def held(lengths: list[float], start: np.ndarray) -> tuple[Mechanism, np.ndarray]:
        bars = [Revolute(2, 3 + k, vertices[k], (0.0, 0.0)) for k in range(3)]
        ends = [Revolute(1, 3, (1.0, 0.0), (lengths[0], 0.0))]
        ends += [Revolute(0, 3 + k, (anchors[k].real, anchors[k].imag), (lengths[k], 0.0)) for k in (1, 2)]
        mechanism = Mechanism(TRIAD, (Revolute(0, 1), *bars, *ends), (Driver(0, 1),))
        motion = simulate(mechanism, [0.6], start=start)
        assert motion.assembled[0] and np.abs(motion.poses[0] - start).max() < 1e-3
        return mechanism, motion.poses[0]

    mechanism, pose = held(base, guess)

    def end(at: tuple[float, float], where: np.ndarray) -> complex:
        return complex(where[2, 0], where[2, 1]) + np.exp(1j * where[2, 2]) * complex(*at)

    h, sines = 1e-5, []
    for k, at in enumerate(vertices):
        moved = []
        for sign in (1.0, -1.0):
            lengths = [*base]
            lengths[k] += sign * h
            moved.append(end(at, held(lengths, pose)[1]))
        sines.append(1.0 / (abs(moved[0] - moved[1]) / (2 * h)))
    motion = simulate(mechanism, [0.6], start=pose)
    assert any(form.lines for form in group_forms(mechanism, motion.steps))
    angle = smallest_transmission(motion)
    assert math.sin(angle) == pytest.approx(min(sines), rel=1e-7)


def loosened(joint: Any, link: int, way: complex, h: float) -> Any:
    """Return a joint whose point on a link is moved by h along a unit vector of the link's frame."""
    name = "at_a" if joint.a == link else "at_b"
    moved = complex(*getattr(joint, name)) + h * way
    return replace(joint, **{name: (moved.real, moved.imag)})


def far_line(mechanism: Mechanism, pose: np.ndarray, line: Tie, h: float) -> list[Any]:
    """Return joints that keep a line of force h longer, along the force."""
    joints, p, q = [*mechanism.joints], mechanism.joints[line.p], mechanism.joints[line.q]
    turn = np.exp(1j * pose[:, 2])

    if line.kind == "bar":
        (bar,) = {p.a, p.b} & {q.a, q.b}
        ends = [complex(*(j.at_a if j.a == bar else j.at_b)) for j in (p, q)]
        joints[line.q] = loosened(q, bar, (ends[1] - ends[0]) / abs(ends[1] - ends[0]), h)
        return joints
    guide = turn[q.a] * np.exp(1j * getattr(q, "angle_a", 0.0))
    if line.kind == "pin-slot" and isinstance(q, PinSlot):
        joints[line.q] = loosened(q, q.a, 1j * guide / turn[q.a], h)
    elif line.kind == "pin-slot":
        (leg,) = {p.a, p.b} & {q.a, q.b}
        joints[line.p] = loosened(p, leg, 1j * guide / turn[leg], h)
    elif isinstance(q, Cam):
        points = [complex(*pose[k, :2]) + turn[k] * complex(*at) for k, at in ((q.a, q.at_a), (q.b, q.at_b))]
        rho, first, _ = q.pitch_radius(float(np.angle((points[1] - points[0]) / guide)))
        joints[line.q] = replace(q, radius=q.radius + h * math.hypot(1.0, first / rho))
    else:
        assert isinstance(q, Gear)
        joints[line.q] = replace(q, offset=q.offset + h / q.radius_b)
    return joints


def pinned(a: int, b: int, x: float, y: float) -> Revolute:
    """A pin of links whose frames stand at the origin, unturned."""
    return Revolute(a, b, (x, y), (x, y))


def slide(a: int, b: int, x: float, y: float, x2: float, y2: float) -> Prismatic:
    """A slide of such links, from a point of the first to one of the second."""
    return Prismatic(a, b, (x, y), (x2, y2), *2 * [math.atan2(y2 - y, x2 - x)])


BARS = [pinned(0, 1, 0.0, 0.0), pinned(1, 3, 1.0, 0.2), pinned(2, 3, 1.5, 1.2)]
LEGS = [*BARS, pinned(2, 4, 2.3, 1.1), pinned(0, 4, 4.0, -1.0)]
THIRD = [pinned(2, 5, 1.9, 2.2), pinned(0, 5, 1.0, 5.0)]
WAVES, CENTRE, TIP = ((0.2, 0.1), (0.05, -0.03)), 3.2 + 2.6j, 1.9 + 2.2j
_RHO = Cam(0, 2, radius=1.0, harmonics=WAVES).pitch_radius(float(np.angle(TIP - CENTRE)) - 0.4)[0]
LINES: dict[str, list[Any]] = {
    "guide of a leg": [*BARS, pinned(2, 4, 2.3, 1.1), slide(0, 4, 4.0, -1.0, 2.9, 0.4), *THIRD],
    "guide on a leg": [*BARS, pinned(2, 4, 2.3, 1.1), slide(4, 0, 2.9, 0.4, 4.0, -1.0), *THIRD],
    "slot": [*LEGS, PinSlot(0, 2, (1.0, 1.3), (1.9, 2.2), 0.25 * math.pi)],
    "cam": [*LEGS, Cam(0, 2, (3.2, 2.6), (1.9, 2.2), 0.4, abs(TIP - CENTRE) - _RHO + 1.0, WAVES)],
    "gear": [*LEGS, Gear(0, 2, (4.0, -1.0), (2.3, 1.1), 1.1, abs(1.7 - 2.1j) - 1.1)],
    "internal gear": [*LEGS, Gear(0, 2, (4.0, -1.0), (2.3, 1.1), 1.1 + abs(1.7 - 2.1j), 1.1, internal=True)],
    "slide on the frame": [*BARS[:2], slide(0, 2, 4.0, 1.0, 3.0, 1.5), pinned(3, 4, 1.8, 0.6),
                           pinned(2, 4, 3.2, 2.4), pinned(3, 5, 1.1, 1.2), pinned(2, 5, 2.6, 2.0)],
}  # fmt: skip
COUNTS = {"slide on the frame": 2}


@pytest.mark.parametrize("case", LINES)
def test_any_line_of_force_against_one_that_is_longer(case: str) -> None:
    """Let a line of force grow a little at a fixed input: what it holds moves apart by 1 / sin(mu) of that."""
    joints = LINES[case]
    if isinstance(gear := joints[-1], Gear):
        phi = float(np.angle(complex(*gear.at_b) - complex(*gear.at_a)))
        joints = [*joints[:-1], replace(gear, offset=-(gear.sign * gear.radius_a / gear.radius_b + 1.0) * phi)]
    links = 1 + max(max(joint.pair) for joint in joints)
    graph = MechanismGraph(links, [(*joint.pair, joint.mobility) for joint in joints], frame=0)
    mechanism, pose = Mechanism(graph, tuple(joints), (Driver(0, 1),)), np.zeros((links, 3))
    motion = simulate(mechanism, [0.0], start=pose)
    assert motion.assembled[0] and np.abs(motion.poses[0]).max() < 1e-6
    pose, h, sines = motion.poses[0], 1e-5, []
    lines = [line for form in group_forms(mechanism, motion.steps) for line in form.lines]
    assert len(lines) == COUNTS.get(case, 3)
    for line in lines:
        p, q = mechanism.joints[line.p], mechanism.joints[line.q]
        at = [complex(*(p.at_a if line.a == p.a else p.at_b)), complex(*(q.at_a if line.b == q.a else q.at_b))]
        if isinstance(p, Gear):
            at = 2 * [at[1] + (at[0] - at[1]) * p.radius_a / (p.radius_a + p.sign * p.radius_b)]
        elif line.kind != "bar":
            at = 2 * at[:1]
        ends = []
        for sign in (1.0, -1.0):
            made = Mechanism(graph, tuple(far_line(mechanism, pose, line, sign * h)), mechanism.drivers)
            other = simulate(made, [0.0], start=pose)
            assert other.assembled[0] and np.abs(other.poses[0] - pose).max() < 1e-3
            x, y, angle = other.poses[0, [line.a, line.b]].T
            ends.append(x + 1j * y + np.exp(1j * angle) * at)
        (a, b) = (ends[0] - ends[1]) / (2.0 * h)
        sines.append(1.0 / abs(b - a))
    assert min(sines) < 0.999 and math.sin(smallest_transmission(motion)) == pytest.approx(min(sines), rel=1e-6)


def test_a_group_that_slides_on_the_frame_is_no_worse_for_its_units() -> None:
    """An angle must not depend on how a matrix is scaled: a slide in a larger group, at three sizes."""
    angles = []
    for size in (1e-2, 1.0, 1e3):
        joints = [
            replace(own, **{name: tuple(size * z for z in getattr(own, name)) for name in ("at_a", "at_b")})
            for own in LINES["slide on the frame"]
        ]
        graph = MechanismGraph(6, [joint.pair for joint in joints], frame=0)
        motion = simulate(Mechanism(graph, tuple(joints), (Driver(0, 1),)), [0.0], start=np.zeros((6, 3)))
        angles.append(smallest_transmission(motion))
    assert angles == pytest.approx([angles[0]] * 3, rel=1e-9) and angles[0] > 0.1


@pytest.mark.parametrize("driver", [1.5, "x", True, (1, 1), (0, 2, 3), [(0, 1, 2)], [None], 9, -1, (0, 9)])
def test_drivers_that_are_none_are_refused(driver: object) -> None:
    with pytest.raises(GraphError):
        embody(MechanismGraph(4, [(0, 1), (1, 2), (2, 3), (0, 3)], frame=0), driver=driver)  # type: ignore[arg-type]


class Still:
    """Random numbers that are all 0."""

    def normal(self, mean: float, deviation: float, shape: tuple[int, ...]) -> np.ndarray:
        return np.zeros(shape)


def test_driven_links_of_a_sketch_are_shrunk_toward_their_bearing() -> None:
    """Joints of a crank stand at three tenths of their distance, in the same direction; all others stay."""
    for graph in (chain for links in (4, 6) for chain in enumerate_chains(links)):
        for inversion, drivers in choices(graph, None)[:2]:
            design = Design(inversion, drivers, ("R",) * len(inversion.joints))
            problem = object.__new__(DimensionProblem)
            problem.design = design
            before, after = layout(design.graph).positions, problem._sketch(Still())
            own = np.zeros(len(before), dtype=bool)
            for (base, link), joint in zip(design.drivers, design.driver_joints):
                for k in design.joints_of(link) if base == design.graph.frame else ():
                    np.testing.assert_allclose(after[k] - before[joint], 0.3 * (before[k] - before[joint]), atol=1e-12)
                    own[k] = True
            np.testing.assert_array_equal(after[~own], before[~own])
            assert own.any() and not own.all()
