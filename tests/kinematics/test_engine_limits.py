"""Where the engine must stop, refuse or speak up: pins on pivots, change points at samples, laws, sizes."""

from __future__ import annotations

import math
from types import SimpleNamespace

import numpy as np
import pytest

from graphsynth.core.errors import GeometryError, UnitWarning
from graphsynth.kinematics import simulate, simulate_batch
from graphsynth.kinematics.engine import codes
from graphsynth.kinematics.engine.escapes import between
from graphsynth.kinematics.engine.events import _touch
from graphsynth.kinematics.engine.program import Step
from graphsynth.mechanism.joints import Cam, Gear, PinSlot, Prismatic, Revolute
from graphsynth.mechanism.laws import Driver, Harmonic, Linear, Table
from graphsynth.mechanism.model import Mechanism
from graphsynth.structure.graph import MechanismGraph

TURN = np.linspace(0.0, math.tau, 73)
CYCLE = MechanismGraph(4, [(0, 1), (1, 2), (2, 3), (0, 3)], frame=0)
FIVE = MechanismGraph(5, [(0, 1), (1, 2), (2, 3), (3, 4), (0, 4)], frame=0)


def four_bar(crank: float, coupler: float, rocker: float, frame: float, law: object = None) -> Mechanism:
    joints = [
        Revolute(0, 1), Revolute(1, 2, (crank, 0.0)), Revolute(2, 3, (coupler, 0.0), (rocker, 0.0)),
        Revolute(0, 3, (frame, 0.0)),
    ]  # fmt: skip
    return Mechanism(CYCLE, joints, [Driver(0, 1) if law is None else Driver(0, 1, law)])  # type: ignore[arg-type]


def slotted(crank: float, apart: float, with_block: bool) -> Mechanism:
    """Crank whose pin turns a slotted arm on a pivot below its own: Whitworth's quick return if crank > apart."""
    if not with_block:
        graph = MechanismGraph(3, [(0, 1), (1, 2, 2), (0, 2)], frame=0)
        joints = [Revolute(0, 1), PinSlot(2, 1, at_b=(crank, 0.0)), Revolute(0, 2, (0.0, -apart))]
    else:
        graph = MechanismGraph(4, [(0, 1), (1, 3), (2, 3), (0, 2)], frame=0)
        joints = [Revolute(0, 1), Revolute(1, 3, (crank, 0.0)), Prismatic(2, 3), Revolute(0, 2, (0.0, -apart))]
    return Mechanism(graph, joints, [Driver(0, 1)])


# --- a pin that passes the pivot of its slotted link


@pytest.mark.parametrize("with_block", [True, False])
@pytest.mark.parametrize("mode", [1, -1])
@pytest.mark.parametrize("inputs", [TURN, TURN + 0.01, -TURN, TURN[::-1]])
def test_pin_on_the_pivot_ends_the_motion(with_block: bool, mode: int, inputs: np.ndarray) -> None:
    motion = simulate(slotted(2.0, 2.0, with_block), inputs, modes={0: mode})
    assert not motion.completed
    assert math.remainder(motion.stopped_at - 1.5 * math.pi, math.tau) == pytest.approx(0.0, abs=1e-9)
    assert motion.events[-1].kind == "change point"
    # up to there the arm turns at half the speed of the crank
    turned = np.diff(motion.poses[motion.assembled, 2, 2]) / np.diff(inputs[motion.assembled])
    assert turned == pytest.approx(0.5, abs=1e-9)
    assert motion.errors[motion.assembled].max() < 1e-12


@pytest.mark.parametrize("gap", [1e-3, 1e-7, -1e-7])
def test_pin_close_to_the_pivot_goes_on(gap: float) -> None:
    motion = simulate(slotted(2.0, 2.0 - gap, with_block=True), TURN + 0.01)
    assert motion.completed
    # longer crank: the arm turns fully; shorter: it comes back
    turns = (motion.poses[-1, 2, 2] - motion.poses[0, 2, 2]) / math.tau
    assert turns == pytest.approx(1.0 if gap > 0.0 else 0.0, abs=1e-9)


def test_kite_at_its_coincidence_is_not_called_impossible() -> None:
    motion = simulate(four_bar(1.0, 2.0, 2.0, 1.0), TURN)
    assert "coincide" in motion.reason


# --- inputs in degrees


@pytest.mark.parametrize(
    "inputs", [np.linspace(0, 360), np.arange(0, 360, 5), np.linspace(-180.0, 180.0, 721), np.arange(90.0, -1.0, -1.0)]
)
def test_inputs_that_look_like_degrees_are_told(inputs: np.ndarray) -> None:
    mechanism = four_bar(1.0, 2.5, 2.5, 2.0)
    with pytest.warns(UnitWarning, match="as radians.*gs.degrees"):
        motion = simulate(mechanism, inputs, events=False)
    assert motion.poses[-1, 1, 2] == pytest.approx(inputs[-1] - math.tau * round(inputs[0] / math.tau))
    with pytest.warns(UnitWarning, match="as radians"):
        simulate_batch(mechanism, inputs, mechanism.dimensions[None])


@pytest.mark.parametrize("inputs", [TURN, 50.0 * TURN, np.linspace(0.0, 100.0, 11), np.radians(np.arange(0, 720, 5))])
def test_inputs_of_many_turns_are_not_taken_for_degrees(inputs: np.ndarray) -> None:
    assert simulate(four_bar(1.0, 2.5, 2.5, 2.0), inputs, events=False).completed


def test_only_angles_can_be_degrees() -> None:
    """The piston of a slider-crank in millimetres, and a crank whose input is the time."""
    slider = [Prismatic(0, 1), Revolute(1, 2), Revolute(2, 3, (250.0, 0.0), (200.0, 0.0)), Revolute(0, 3, (500.0, 0.0))]
    simulate(Mechanism(CYCLE, slider, [Driver(0, 1)]), np.linspace(100.0, 190.0, 5), events=False)
    simulate(four_bar(1.0, 2.5, 2.5, 2.0, Linear(0.1)), np.linspace(0.0, 90.0, 5), events=False)


# --- change points and folds on samples


@pytest.mark.parametrize("mode", [1, -1])
@pytest.mark.parametrize("samples", [13, 37, 73, 361])
def test_change_point_on_the_last_sample_is_an_event(mode: int, samples: int) -> None:
    motion = simulate(four_bar(1.0, 3.0, 2.0, 2.0), np.linspace(0.0, math.tau, samples), modes={0: mode})
    ends = [event.input for event in motion.events if event.kind in ("change point", "fold")]
    assert ends[0] == pytest.approx(0.0, abs=1e-9)
    assert ends[-1] == pytest.approx(math.tau, abs=1e-6)
    assert not motion.closure.closed


def test_fold_on_a_sample_is_no_change_point() -> None:
    joints = [Revolute(0, 1), Revolute(1, 2, (1.0, 0.0)), Revolute(2, 3, (3.0, 0.0)), Prismatic(0, 3, (0.0, 2.5))]
    motion = simulate(Mechanism(CYCLE, joints, [Driver(0, 1)]), TURN)
    assert motion.stopped_at == pytest.approx(math.pi + math.asin(0.5), abs=1e-12)
    assert [event.kind for event in motion.events if event.group == 0 and event.kind != "dead centre"] == ["fold"]


# --- laws


def broken(value: object) -> Mechanism:
    return four_bar(1.0, 3.0, 3.5, 4.0, law=lambda u: value(u))  # type: ignore[operator]


@pytest.mark.parametrize(
    ("law", "words"),
    [
        (lambda u: (np.where(u > 3.0, 1.0, 0.0), 0.0 * u, 0.0 * u), "it jumps"),
        (lambda u: (u, 0.0 * u, 0.0 * u), "derivative"),
        (lambda u: u, "three arrays"),
        (lambda u: (u, 0.0 * u), "three arrays"),
        (lambda u: (u, np.ones(1), 0.0 * u), "shape"),
    ],
)
def test_laws_that_are_none_are_refused(law: object, words: str) -> None:
    with pytest.raises(GeometryError, match=words):
        simulate(broken(law), TURN)


@pytest.mark.parametrize("beyond", [np.inf, -np.inf, np.nan])
def test_law_without_a_value_ends_the_motion_where_it_does(beyond: float) -> None:
    law = lambda u: (np.where(u > 3.0, beyond, u), np.ones_like(u), np.zeros_like(u))  # noqa: E731
    motion = simulate(broken(law), TURN)
    assert motion.events[-1].kind == "input"
    assert motion.stopped_at == pytest.approx(3.0, abs=1e-12)


def test_table_ends_at_its_last_input() -> None:
    motion = simulate(four_bar(1.0, 3.0, 3.5, 4.0, law=Table((0.0, 1.0, 2.0, 3.0), (0.0, 1.0, 0.5, 1.0))), TURN)
    assert motion.stopped_at == pytest.approx(3.0, abs=1e-12)


def test_own_law_that_is_smooth_is_taken() -> None:
    law = lambda u: (np.sin(u), np.cos(u), -np.sin(u))  # noqa: E731
    own = simulate(broken(law), TURN)
    same = simulate(four_bar(1.0, 3.0, 3.5, 4.0, law=Harmonic()), TURN)
    np.testing.assert_array_equal(own.poses, same.poses)


def test_oscillation_between_samples_is_seen() -> None:
    """72 periods between 73 samples: the coordinate is 0 at every sample, and the crank swings by 3 rad between."""
    law = Harmonic(amplitude=3.0, order=72.0)
    motion = simulate(four_bar(3.0, 3.0, 3.5, 4.0, law=law), TURN)  # a rocker: its crank cannot turn that far
    assert not motion.completed
    assert motion.stopped_at < 0.1


# --- sizes, units, numbers


@pytest.mark.parametrize("scale", [1e-9, 1.0, 1e9])
def test_error_estimates_do_not_depend_on_the_unit(scale: float) -> None:
    motion = simulate(four_bar(scale, 3.0 * scale, 3.5 * scale, 4.0 * scale), TURN)
    unit = simulate(four_bar(1.0, 3.0, 3.5, 4.0), TURN)
    assert motion.singularity_distance == pytest.approx(unit.singularity_distance, rel=1e-9)
    assert motion.errors.max() < 1e-14


@pytest.mark.parametrize("scale", [1e-150, 1e150])
def test_lengths_whose_products_are_no_numbers_are_refused(scale: float) -> None:
    with pytest.raises(GeometryError, match="change the unit"):
        simulate(four_bar(scale, 3.0 * scale, 3.5 * scale, 4.0 * scale), TURN)


def test_a_range_beyond_memory_is_refused() -> None:
    with pytest.raises(GeometryError, match="shorter range"):
        simulate(four_bar(1.0, 3.0, 3.5, 4.0), [0.0, 1e9])


@pytest.mark.parametrize("rate", [1e-9, 1e9])
def test_dead_centres_are_as_sharp_in_any_unit_of_the_input(rate: float) -> None:
    """Crank and coupler in line: cos(angle) from the triangle (c -+ a, d, rocker)."""
    motion = simulate(four_bar(1.0, 3.0, 3.5, 4.0, law=Linear(rate=rate)), TURN / rate)
    stretched = math.acos((4.0**2 + 4.0**2 - 3.5**2) / (2.0 * 4.0 * 4.0))
    folded = math.pi + math.acos((2.0**2 + 4.0**2 - 3.5**2) / (2.0 * 2.0 * 4.0))
    found = [event.input * rate for event in motion.events if event.kind == "dead centre"]
    assert found == pytest.approx([stretched, folded], abs=1e-12)


def test_numpy_integers_are_integers() -> None:
    i = np.int64
    graph = MechanismGraph(4, [(0, 1), (1, 2), (2, 3), (0, 3)], frame=0)
    joints = [
        Revolute(i(0), i(1)), Revolute(i(1), i(2), (1.0, 0.0)), Revolute(i(2), i(3), (3.0, 0.0), (3.5, 0.0)),
        Revolute(i(0), i(3), (4.0, 0.0)),
    ]  # fmt: skip
    mechanism = Mechanism(graph, joints, [Driver(i(0), i(1))], points={"M": (i(2), (5.0, 0.0))})
    motion = simulate(mechanism, TURN, modes={i(0): i(-1)})
    assert motion.completed
    assert Mechanism.from_json(mechanism.to_json()) == mechanism


def test_modes_must_be_a_mapping() -> None:
    with pytest.raises(GeometryError, match="mapping"):
        simulate(four_bar(1.0, 3.0, 3.5, 4.0), TURN, modes=[1])  # type: ignore[arg-type]


@pytest.mark.parametrize("link", [1.5, True, -1, 9, None])
def test_unknown_links_of_points_are_refused(link: object) -> None:
    motion = simulate(four_bar(1.0, 3.0, 3.5, 4.0), TURN[:2])
    with pytest.raises(GeometryError):
        motion.point(link)  # type: ignore[arg-type]


@pytest.mark.parametrize("local", ["a", (1.0,), (1.0, math.nan), 3.0, "ab"])
def test_points_that_are_none_are_refused(local: object) -> None:
    motion = simulate(four_bar(1.0, 3.0, 3.5, 4.0), TURN[:2])
    with pytest.raises(GeometryError):
        motion.point(1, local)  # type: ignore[arg-type]


# --- gears and cams


def test_gears_without_a_line_of_centres_are_not_moved() -> None:
    graph = MechanismGraph(3, [(0, 1), (0, 2), (1, 2, 2)], frame=0)
    mechanism = Mechanism(graph, [Revolute(0, 1), Revolute(0, 2), Gear(1, 2)], [Driver(0, 1)])
    motion = simulate(mechanism, TURN)
    assert not motion.assembled.any() and "coincide" in motion.reason
    with pytest.raises(GeometryError, match="line of centres"):
        mechanism.mobility(np.zeros((3, 3)))


@pytest.mark.parametrize("radii", [(-1.0, 2.0), (0.0, 2.0), (1.0, 0.0)])
def test_batch_refuses_radii_that_a_gear_refuses(radii: tuple[float, float]) -> None:
    graph = MechanismGraph(3, [(0, 1), (0, 2), (1, 2, 2)], frame=0)
    joints = [Revolute(0, 1), Revolute(0, 2, (3.0, 0.0)), Gear(1, 2, radius_a=1.0, radius_b=2.0)]
    mechanism = Mechanism(graph, joints, [Driver(0, 1)])
    sets = np.repeat(mechanism.dimensions[None], 2, axis=0)
    sets[1, 2, 6:8] = radii
    with pytest.raises(GeometryError, match="set 1"):
        simulate_batch(mechanism, TURN, sets)


@pytest.mark.parametrize("keep", ["a", [9], [-1], [0.5]])
def test_batch_refuses_links_that_do_not_exist(keep: object) -> None:
    mechanism = four_bar(1.0, 3.0, 3.5, 4.0)
    with pytest.raises(GeometryError, match="keep"):
        simulate_batch(mechanism, TURN, mechanism.dimensions[None], keep=keep)  # type: ignore[arg-type]


@pytest.mark.parametrize("harmonics", [5, "ab", ((1.0,),), (0.1,), (None,)])
def test_harmonics_that_are_none_are_refused(harmonics: object) -> None:
    with pytest.raises(GeometryError, match="harmonic"):
        Cam(0, 1, harmonics=harmonics)  # type: ignore[arg-type]


def test_pose_that_is_none_is_refused() -> None:
    with pytest.raises(GeometryError, match="pose"):
        four_bar(1.0, 3.0, 3.5, 4.0).mobility("x")  # type: ignore[arg-type]


def test_a_limit_at_the_input_zero_is_told_as_zero() -> None:
    graph = MechanismGraph(3, [(0, 1), (1, 2, 2), (0, 2)], frame=0)
    mechanism = Mechanism(graph, [Prismatic(0, 1), PinSlot(2, 1), Revolute(0, 2)], [Driver(0, 1)])
    motion = simulate(mechanism, np.linspace(-2.0, 2.0, 41))
    assert abs(motion.stopped_at) < 1e-15 and motion.events[-1].kind == "change point"


def test_a_search_that_found_nothing_does_not_claim_impossibility() -> None:
    """A five-bar too short to close, driven at its middle joint: a group that is solved by search."""
    joints = [
        Revolute(0, 1), Revolute(1, 2, (1.0, 0.0)), Revolute(2, 3, (3.0, 0.0)), Revolute(3, 4, (3.0, 0.0), (1.0, 0.0)),
        Revolute(0, 4, (2.5, 0.0)),
    ]  # fmt: skip
    motion = simulate(Mechanism(FIVE, joints, [Driver(0, 1), Driver(2, 3, Linear(0.0, 0.5))]), [0.0])
    assert not motion.assembled.any()
    assert motion.steps[-1].code == codes.NEWTON
    assert "no pose" in motion.reason


@pytest.mark.parametrize(("bar", "words"), [(1.0, "move by itself"), (9.0, "cannot be assembled")])
def test_parallelogram_with_three_bars(bar: float, words: str) -> None:
    """By count a structure: with three equal bars it moves by itself, with a longer third bar it does not close."""
    graph = MechanismGraph(5, [(0, 1), (0, 3), (0, 4), (1, 2), (2, 3), (2, 4)], frame=0)
    bars = [Revolute(0, k, (x, 0.0)) for k, x in ((1, 0.0), (3, 2.0), (4, 1.0))]
    tops = [Revolute(2, k, (x, 0.0), (0.0, bar if k == 4 else 1.0)) for k, x in ((1, 0.0), (3, 2.0), (4, 1.0))]
    motion = simulate(Mechanism(graph, bars + tops), [0.0])
    assert not motion.assembled.any() and words in motion.reason


@pytest.mark.parametrize("scale", [1e-3, 1.0, 1e3])
def test_parallel_guides_have_no_place(scale: float) -> None:
    """Two guides that are parallel but for rounding: no pose far away, but a sentence."""
    graph = MechanismGraph(4, [(0, 1), (0, 3), (1, 2), (2, 3)], frame=0)

    def guides(angle: float) -> Mechanism:
        return Mechanism(graph, [
            Prismatic(0, 1, (0.0, 0.0), (-scale, scale), 0.5 * math.pi, 0.25 * math.pi),
            Prismatic(0, 3, (-scale, -2.0 * scale), (-scale, 0.0), 0.5 * math.pi, 0.0),
            Prismatic(1, 2, (2.0 * scale, 2.0 * scale), (0.0, scale), angle, 0.0),
            Revolute(2, 3, (0.0, 2.0 * scale), (-2.0 * scale, scale)),
        ], [Driver(0, 3)])  # fmt: skip

    motion = simulate(guides(0.25 * math.pi), np.array([0.1, 0.2]) * scale)  # pi/4 on link 1, itself turned by pi/4
    assert not motion.assembled.any() and np.isnan(motion.poses).all()
    assert "parallel" in motion.reason and motion.events[0].kind == "not assembled"
    motion = simulate(guides(0.25 * math.pi + 1e-6), np.array([0.1, 0.2]) * scale)
    assert motion.completed and motion.residual < 1e-8


def test_a_rate_that_is_zero_beside_a_reversal() -> None:
    """A link driven against another one turns on the frame with a rate that may be zero to the bit."""
    graph = MechanismGraph.from_text("EiM_ f0")
    joints = [
        Revolute(0, 1, (-1.0, 2.0), (1.0, -1.0)), Revolute(0, 5, (-1.0, 1.0), (-2.0, -1.0)),
        Revolute(1, 2, (1.0, -1.0), (0.0, 1.0)), Revolute(1, 3, (2.0, 1.0), (-2.0, 0.0)),
        Revolute(2, 4, (-1.0, -2.0), (2.0, 1.0)), Revolute(2, 5, (-2.0, -2.0), (2.0, -1.0)),
        Revolute(3, 4, (2.0, 1.0), (0.0, -1.0)),
    ]  # fmt: skip
    motion = simulate(Mechanism(graph, joints, [Driver(4, 3)]), np.linspace(3.0, 0.0, 29))
    assert motion.completed == (motion.reason == "")
    assert motion.residual < 1e-12


def test_a_fold_behind_a_group_that_is_lost() -> None:
    """Where the margin cannot be followed to its zero, the branch ends at the last sample before."""

    def reach(trace: object, k: int, u: float) -> tuple[SimpleNamespace, None]:
        margin = np.nan if 0.1 < u < 0.75 else (u - 1.2) ** 2 - 0.09
        return SimpleNamespace(M=np.array([[0.0], [margin]])), None

    step = Step(codes.R_DIST, 0, (1, 2), "RRR")
    tracker = SimpleNamespace(reach=reach, program=SimpleNamespace(steps=[step]))
    trace = SimpleNamespace(u=np.array([0.0, 1.6, 2.0]), M=np.array([[1.35], [0.07], [0.55]]))
    event = _touch(tracker, trace, (0, 1, 2), 0)
    assert event.kind == "fold" and event.ends_motion
    assert event.input == 0.0 and event.uncertainty == pytest.approx(1.2, abs=0.31)


@pytest.mark.parametrize("span", [(0.0, 1.0), (-2.0, 0.0, 1.0)])
def test_a_bisection_ends_where_no_double_lies_between_or_none_that_matters(span: tuple[float, ...]) -> None:
    trace = SimpleNamespace(u=np.array(span))
    assert between(trace, 0.25, 0.5) == 0.375 and between(trace, 1.0, math.nextafter(1.0, 2.0)) is None
    width = 1e-18 * (span[-1] - span[0])
    assert between(trace, 0.0, 0.9 * width) is None and between(trace, 0.0, 1.1 * width) is not None
