"""Targets of embodiment: the lambda linkage found again; paths, functions and poses of known mechanisms recovered."""

from __future__ import annotations

import math

import numpy as np
import pytest

from graphsynth.core.errors import GeometryError
from graphsynth.kinematics import simulate
from graphsynth.kinematics.dimensional import FunctionGoal, Goals, LineGoal, PathGoal, PosesGoal, embody
from graphsynth.kinematics.dimensional.verify import strip_width, verify
from graphsynth.mechanism.four_bar import TiltedFourBar
from graphsynth.mechanism.joints import Revolute
from graphsynth.mechanism.laws import Driver
from graphsynth.mechanism.model import Mechanism, TracePoint
from graphsynth.structure.graph import MechanismGraph

CYCLE = MechanismGraph(4, [(0, 1), (1, 2), (2, 3), (0, 3)], frame=0)
LEAST = math.radians(20.0)


def four_bar(frame: float, crank: float, coupler: float, rocker: float, point: tuple[float, float]) -> Mechanism:
    joints = (
        Revolute(0, 1), Revolute(1, 2, (crank, 0.0)), Revolute(2, 3, (coupler, 0.0), (rocker, 0.0)),
        Revolute(0, 3, (frame, 0.0)),
    )  # fmt: skip
    return Mechanism(CYCLE, joints, (Driver(0, 1),), {"P": TracePoint(2, point)})


def distances(mechanism: Mechanism) -> tuple[float, float, float, float]:
    """Frame, crank, coupler, rocker."""
    found = []
    for link in range(4):
        at = [complex(*(j.at_a if j.a == link else j.at_b)) for j in mechanism.joints if link in j.pair]
        found.append(abs(at[0] - at[1]))
    return found[0], found[1], found[2], found[3]


def arms(mechanism: Mechanism) -> tuple[float, float]:
    """Distances of the tracing point from the crank pin and from the rocker's pin."""
    point = complex(*mechanism.points["P"].at)
    pins = [mechanism.joint(1, 2).at_b, mechanism.joint(2, 3).at_a]
    return abs(point - complex(*pins[0])), abs(point - complex(*pins[1]))


# --- the straight segment


@pytest.mark.slow
def test_the_lambda_linkage_is_found_again() -> None:
    """A segment of 4 cranks in half a turn, drawn by a point of the coupler's line, no length over 5 cranks.

    Nothing in the goal or the search names the proportions.
    """
    goals = Goals(min_transmission_angle=LEAST, max_length_ratio=5.0, target=LineGoal(length=4.0, on_bar=True))
    found = embody(CYCLE, goals, driver=1, tries=1)
    assert found.accepted and found.mechanism is not None and found.figures is not None
    frame, crank, coupler, rocker = distances(found.mechanism)
    assert np.array([frame, coupler, rocker]) / crank == pytest.approx([2.0, 2.5, 2.5], abs=5e-5)
    AM, BM = arms(found.mechanism)
    assert (AM / crank, BM / crank) == pytest.approx((5.0, 2.5), abs=5e-5)
    # as straight as the closed form of the lambda linkage over its stroke, 90 to 270 degrees
    M = TiltedFourBar().positions(np.linspace(0.5 * math.pi, 1.5 * math.pi, 2001)).M
    width = float(np.ptp(M[:, 1]))
    assert width == pytest.approx(0.00976, abs=1e-5)  # the value of the specification
    assert found.figures.goal_error == pytest.approx(width / 4.0, rel=1e-4)


@pytest.mark.slow
def test_without_the_bound_a_straighter_linkage_exists() -> None:
    """The honest other side: with lengths up to 6 cranks the least strip is 2.7 times narrower."""
    goals = Goals(min_transmission_angle=LEAST, max_length_ratio=6.0, target=LineGoal(length=4.0, on_bar=True))
    found = embody(CYCLE, goals, driver=1, tries=4)
    assert found.accepted and found.mechanism is not None and found.figures is not None
    assert found.figures.goal_error == pytest.approx(0.003564 / 4.0, rel=2e-3)
    frame, crank, coupler, rocker = distances(found.mechanism)
    assert np.array([frame, coupler, rocker]) / crank == pytest.approx([2.2236, 2.7595, 2.8955], rel=2e-3)


def test_line_goal_measures_what_it_says() -> None:
    linkage = four_bar(2.0, 1.0, 2.5, 2.5, (5.0, 0.0))
    start = simulate(linkage, [0.5 * math.pi], modes={0: -1}).poses[0]
    B = start[3, 1] + 2.5 * math.sin(start[3, 2])
    modes = {0: -1} if B > 0 else {0: 1}
    motion = simulate(linkage, np.linspace(0.5 * math.pi, 1.5 * math.pi, 721), modes=modes)
    z = motion.point("P").position @ np.array([1.0, 1j])
    assert abs(z[-1] - z[0]) == pytest.approx(4.0, abs=1e-12)
    assert strip_width(z) == pytest.approx(float(np.ptp(z.imag)), abs=1e-9)


# --- path, poses, function: targets from a known linkage, another scale, place and direction


@pytest.fixture(scope="module")
def known() -> dict[str, np.ndarray]:
    inputs = np.linspace(0.0, math.tau, 9)[:-1]
    motion = simulate(four_bar(3.0, 1.0, 2.6, 2.4, (1.5, 1.2)), inputs + 0.7, modes={0: 1})
    assert motion.completed
    z = motion.point("P").position @ np.array([1.0, 1j])
    z = 1.7 * np.exp(0.6j) * z + (3.0 - 1.0j)
    return {"inputs": inputs, "z": z, "theta": motion.poses[:, 2, 2] + 0.3, "output": motion.poses[:, 3, 2]}


def test_timed_path_is_recovered(known: dict[str, np.ndarray]) -> None:
    target = PathGoal(tuple((p.real, p.imag) for p in known["z"]), tuple(known["inputs"]), tolerance=1e-6)
    found = embody(CYCLE, Goals(min_transmission_angle=LEAST, target=target), driver=1, tries=4)
    assert found.accepted and found.mechanism is not None
    # independent of the search: between the targets the curves agree too (the same linkage or a Roberts cognate)
    motion = simulate(found.mechanism, np.linspace(0.0, math.tau, 361))
    own = motion.point("P").position @ np.array([1.0, 1j])
    assert np.abs(own[::45][:8] - known["z"]).max() < 1e-5
    fine = simulate(four_bar(3.0, 1.0, 2.6, 2.4, (1.5, 1.2)), np.linspace(0.7, 0.7 + math.tau, 361), modes={0: 1})
    curve = 1.7 * np.exp(0.6j) * (fine.point("P").position @ np.array([1.0, 1j])) + (3.0 - 1.0j)
    assert np.abs(own - curve).max() < 1e-4


@pytest.mark.long
def test_poses_are_recovered(known: dict[str, np.ndarray]) -> None:
    poses = tuple((p.real, p.imag, t) for p, t in zip(known["z"], known["theta"]))
    target = PosesGoal(poses, tuple(known["inputs"]), tolerance=1e-6)
    found = embody(CYCLE, Goals(min_transmission_angle=LEAST, target=target), driver=1, tries=4)
    assert found.accepted and found.mechanism is not None
    assert np.array(distances(found.mechanism)) / 1.7 == pytest.approx([3.0, 1.0, 2.6, 2.4], abs=1e-4)
    motion = simulate(found.mechanism, known["inputs"])
    assert np.abs(motion.point("P").position @ np.array([1.0, 1j]) - known["z"]).max() < 1e-5
    turned = motion.poses[:, 2, 2] - motion.poses[0, 2, 2]
    assert np.abs(turned - (known["theta"] - known["theta"][0])).max() < 1e-5


@pytest.mark.long
def test_function_is_recovered(known: dict[str, np.ndarray]) -> None:
    target = FunctionGoal(tuple(known["inputs"]), tuple(known["output"]), tolerance=1e-6)
    found = embody(CYCLE, Goals(min_transmission_angle=LEAST, target=target), driver=1, tries=4)
    assert found.accepted and found.mechanism is not None
    ratios = np.array(distances(found.mechanism))
    assert ratios / ratios[1] == pytest.approx([3.0, 1.0, 2.6, 2.4], abs=1e-3)


def in_order(z: np.ndarray, goal: np.ndarray) -> float:
    """Smallest e such that the closed polyline passes the goals in order, each within e; from its best sample on."""
    found = []
    for start in range(0, len(z), max(1, len(z) // 60)):
        own = np.concatenate([z[start:-1], z[: start + 1]])
        sides = np.diff(own)
        part = np.clip(
            ((goal[:, None] - own[None, :-1]) * np.conj(sides)).real / np.maximum(np.abs(sides) ** 2, 1e-300), 0, 1
        )
        apart = np.abs(own[None, :-1] + part * sides - goal[:, None])
        best = np.minimum.accumulate(apart[0])
        for row in apart[1:]:
            best = np.minimum.accumulate(np.maximum(best, row))
        found.append(float(best[-1]))
    return min(found)


@pytest.mark.long
def test_path_without_times_is_passed_in_order(known: dict[str, np.ndarray]) -> None:
    target = PathGoal(tuple((p.real, p.imag) for p in known["z"][:6]), tolerance=1e-3)
    found = embody(CYCLE, Goals(min_transmission_angle=LEAST, target=target), driver=1, tries=2)
    assert found.accepted and found.mechanism is not None and found.figures is not None
    motion = simulate(found.mechanism, np.linspace(0.0, math.tau, 3601))
    z = motion.point("P").position @ np.array([1.0, 1j])
    size = np.abs(known["z"][:6] - known["z"][:6].mean()).max()
    assert in_order(z, known["z"][:6]) / size <= 1e-3
    assert found.figures.goal_error <= 1e-3


@pytest.mark.slow
def test_function_of_a_six_bar_is_recovered() -> None:
    graph = MechanismGraph(6, [(0, 1), (1, 2), (2, 3), (0, 3), (3, 4), (4, 5), (0, 5)], frame=0)
    joints = (
        Revolute(0, 1), Revolute(1, 2, (1.0, 0.0)), Revolute(2, 3, (2.8, 0.0), (2.2, 0.0)), Revolute(0, 3, (3.0, 0.0)),
        Revolute(3, 4, (1.5, 1.0)), Revolute(4, 5, (2.6, 0.0), (2.0, 0.0)), Revolute(0, 5, (5.5, 0.4)),
    )  # fmt: skip
    inputs = np.linspace(0.0, math.tau, 13)[:-1]
    motion = simulate(Mechanism(graph, joints, (Driver(0, 1),)), inputs + 0.4)
    assert motion.completed
    target = FunctionGoal(tuple(inputs), tuple(motion.poses[:, 5, 2]), link=5, tolerance=0.01)
    found = embody(graph, Goals(min_transmission_angle=LEAST, target=target), driver=1, tries=16)
    assert found.accepted and found.figures is not None and found.figures.goal_error <= 0.01


# --- the verification of targets does not rely on the search


def test_order_defect_is_refused(known: dict[str, np.ndarray]) -> None:
    """A curve through all points but in another order is no solution."""
    z = known["z"]
    timed = PathGoal(tuple((p.real, p.imag) for p in z), tuple(known["inputs"]), tolerance=1e-6)
    right = embody(CYCLE, Goals(min_transmission_angle=LEAST, target=timed), driver=1, tries=4).mechanism
    assert right is not None
    points = [PathGoal(tuple((p.real, p.imag) for p in own)) for own in (z, z[[0, 4, 2, 6, 1, 5, 3, 7]])]
    told = [verify(right, Goals(min_transmission_angle=LEAST, target=goal)) for goal in points]
    assert told[0][1].goal_error < 1e-6 and "the target is missed" not in told[0][2]
    assert told[1][1].goal_error > 0.3 and "the target is missed" in told[1][2]


def test_target_that_is_missed_is_refused(known: dict[str, np.ndarray]) -> None:
    points = tuple((p.real, p.imag) for p in known["z"])
    target = PathGoal(points, tuple(known["inputs"]))
    wrong = four_bar(2.0, 1.0, 2.5, 2.5, (5.0, 0.0))
    _, figures, reasons = verify(wrong, Goals(min_transmission_angle=0.1, target=target))
    assert reasons == ("the target is missed",) and figures.goal_error > 0.1


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: LineGoal(length=-1.0), "length"),
        (lambda: LineGoal(length=1.0, span=7.0), "span = 7.0"),
        (lambda: PathGoal(((0, 0), (1, 1))), "three or more"),
        (lambda: PathGoal(((0, 0), (1, 1), (2, 0)), (0.0, 1.0)), "3 targets but 2 inputs"),
        (lambda: PathGoal(((0, 0), (1, 1), (2, 0)), (0.0, 1.0, 0.5)), "increase"),
        (lambda: PathGoal(((0, 0), (1, 1), (2, math.nan))), "not finite"),
        (lambda: PosesGoal(((0, 0, 0), (1, 1, 1))), "three or more"),
        (lambda: PosesGoal(((0, 0), (1, 1), (2, 0)), (0.0, 1.0, 2.0)), "entries"),
        (lambda: FunctionGoal((0.0, 3.0, 9.0), (0.0, 1.0, 2.0)), "more than one turn"),
        (lambda: FunctionGoal((0.0, 1.0), (0.0, 1.0)), "outputs has 2 entries"),
        (lambda: Goals(span=1.0, target=LineGoal(4.0)), "needs a range of 3.14159"),
        (lambda: Goals(span=1.0, target=FunctionGoal((0, 1, 2), (0, 1, 2))), "needs a range of 2"),
    ],
)
def test_bad_targets(make: object, message: str) -> None:
    with pytest.raises(GeometryError, match=message):
        make()  # type: ignore[operator]


def test_target_link_must_move() -> None:
    with pytest.raises(GeometryError, match="target link 9"):
        embody(CYCLE, Goals(target=LineGoal(4.0, link=9)), driver=1)
    with pytest.raises(GeometryError, match="target link 0"):
        embody(CYCLE, Goals(target=LineGoal(4.0, link=0)), driver=1)
