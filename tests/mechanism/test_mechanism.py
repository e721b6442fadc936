"""The dimensioned mechanism: checks, mobility by count and rank, constraint equations, files."""

from __future__ import annotations

import json
import math
from typing import Any

import mpmath as mp
import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from graphsynth.core.errors import FormatError, GeometryError
from graphsynth.mechanism.constraints import jacobian, residual
from graphsynth.mechanism.joints import Gear, PinSlot, Prismatic, Revolute
from graphsynth.mechanism.laws import Driver, Harmonic, Linear, Polynomial, Table
from graphsynth.mechanism.model import Mechanism
from graphsynth.structure.graph import MechanismGraph

CYCLE = MechanismGraph(4, [(0, 1), (1, 2), (2, 3), (0, 3)], frame=0)
BARS = (
    Revolute(0, 1), Revolute(1, 2, (1.0, 0.0)), Revolute(2, 3, (2.5, 0.0), (2.5, 0.0)), Revolute(0, 3, (2.0, 0.0)),
)  # fmt: skip
MIXED = MechanismGraph(4, [(0, 1), (1, 2, 2), (0, 2), (2, 3, 2), (0, 3)], frame=0)
finite = st.floats(-1e6, 1e6, allow_nan=False)
points = st.tuples(finite, finite)


def mixed() -> Mechanism:
    return Mechanism(
        MIXED,
        [
            Revolute(0, 1), Gear(1, 2, radius_a=0.3, radius_b=0.7, internal=True, offset=0.1),
            Revolute(0, 2, (0.4, 0.0)),
            PinSlot(2, 3, (0.1, 0.2), (0.3, 0.4), 0.5), Prismatic(0, 3, (1.0, 2.0), (0.0, 0.1), 0.6, 0.7),
        ],
        [Driver(0, 1, Harmonic(1.0, 0.1, 2.0, 0.3))],
        {"M": (2, (1.0, -1.0)), "é \"q\" \\ \x7f": (3, (0.1, 0.2))},
        tuple((0.1 * k, 0.2 * k, 0.3 * k) for k in range(4)),
    )  # fmt: skip


# --- construction


def test_joints_are_kept_in_the_order_of_the_graph() -> None:
    mechanism = Mechanism(CYCLE, BARS[::-1])
    assert [joint.pair for joint in mechanism.joints] == [(0, 1), (0, 3), (1, 2), (2, 3)]
    assert mechanism.dimensions.shape == (4, 10) and not mechanism.dimensions.flags.writeable


BAD: dict[str, tuple[Any, str]] = {
    "no frame": (lambda: Mechanism(CYCLE.without_frame(), BARS), "needs a frame"),
    "missing": (lambda: Mechanism(CYCLE, BARS[:3]), "0-3 of the graph has no geometry"),
    "twice": (lambda: Mechanism(CYCLE, [*BARS, BARS[0]]), "two geometries"),
    "extra": (lambda: Mechanism(CYCLE, [*BARS, Revolute(0, 2)]), "not in the graph"),
    "mobility": (lambda: Mechanism(CYCLE, [*BARS[:3], PinSlot(0, 3)]), "has mobility 1"),
    "zero length": (lambda: Mechanism(CYCLE, [*BARS[:1], Revolute(1, 2), *BARS[2:]]), "link 1 has length 0"),
    "not finite": (lambda: Revolute(0, 1, (math.inf, 0.0)), "not finite"),
    "no point": (lambda: Revolute(0, 1, 3.0), "not a point"),  # type: ignore[arg-type]
    "three": (lambda: Revolute(0, 1, (1.0, 2.0, 3.0)), "3 coordinates"),  # type: ignore[arg-type]
    "self": (lambda: Revolute(1, 1), "itself"),
    "link": (lambda: Revolute(-1, 1), "not a link"),
    "radius": (lambda: Gear(0, 1, radius_a=0.0), "must be positive"),
    "equal radii": (lambda: Gear(0, 1, internal=True), "equal radii"),
    "driver": (lambda: Mechanism(CYCLE, BARS, [Driver(0, 2)]), "drives no joint"),
    "driver twice": (lambda: Mechanism(CYCLE, BARS, [Driver(0, 1), Driver(1, 0)]), "driven twice"),
    "law": (lambda: Driver(0, 1, 3.0), "not callable"),  # type: ignore[arg-type]
    "gear driver": (lambda: Mechanism(MIXED, mixed().joints, [Driver(1, 2)]), "only R and P"),
    "point link": (lambda: Mechanism(CYCLE, BARS, points={"M": (9, (0, 0))}), "links are 0..3"),  # type: ignore
    "pose": (lambda: Mechanism(CYCLE, BARS, pose=((0.0, 0.0, 0.0),)), "each of the 4 links"),
    "frame pose": (lambda: Mechanism(CYCLE, BARS, pose=((1.0, 0.0, 0.0),) * 4), "stays at"),
    "table": (lambda: Table((0.0, 0.0), (1.0, 2.0)), "must increase"),
    "table length": (lambda: Table((0.0, 1.0), (1.0,)), "entries"),
    "polynomial": (lambda: Polynomial(()), "0 entries"),
}


@pytest.mark.parametrize("name", BAD)
def test_impossible_geometry_is_refused_in_one_sentence(name: str) -> None:
    make, words = BAD[name]
    with pytest.raises(GeometryError, match=words) as caught:
        make()
    assert "\n" not in str(caught.value)


# --- mobility


def test_mobility_by_count_and_by_rank_agree_in_general() -> None:
    B = complex(2.1, 2.4)
    # assemble: crank pin at (1, 0), rocker pivot at (2, 0), lengths 2.5
    middle, half = 1.5, math.sqrt(2.5**2 - 0.25)
    B = complex(middle, half)
    pose = ((0.0, 0.0, 0.0), (0.0, 0.0, 0.0), (1.0, 0.0, float(np.angle(B - 1))), (2.0, 0.0, float(np.angle(B - 2))))
    report = Mechanism(CYCLE, BARS, pose=pose).mobility()
    assert (report.count, report.by_rank, report.rank, report.redundant) == (1, 1, 8, 0) and report.agrees
    # the freedom satisfies the linear constraints
    motion = report.freedoms[0].ravel()
    assert np.abs(jacobian(Mechanism(CYCLE, BARS).joints, pose) @ motion).max() < 1e-12


def test_parallelogram_with_a_third_bar_moves_against_the_count() -> None:
    graph = MechanismGraph(5, [(0, 1), (0, 3), (0, 4), (1, 2), (2, 3), (2, 4)], frame=0)

    def bars(shift: float) -> Mechanism:
        places = ((1, 0.0), (3, 2.0), (4, 1.0))
        tops = [Revolute(2, k, (x + (shift if k == 4 else 0.0), 0.0), (0.0, 1.0)) for k, x in places]
        turn = 0.3
        shift_pose = (-math.sin(turn), math.cos(turn), 0.0)
        pose = ((0.0, 0.0, 0.0), (0.0, 0.0, turn), shift_pose, (2.0, 0.0, turn), (1.0, 0.0, turn))
        return Mechanism(graph, [*(Revolute(0, k, (x, 0.0)) for k, x in places), *tops], pose=pose)

    report = bars(0.0).mobility()
    assert (report.count, report.by_rank, report.redundant) == (0, 1, 1) and not report.agrees
    assert "1 constraints are redundant" in report.statement
    with pytest.raises(GeometryError, match="open by"):
        bars(0.01).mobility()


def test_rank_needs_a_pose() -> None:
    with pytest.raises(GeometryError, match="none"):
        Mechanism(CYCLE, BARS).mobility()
    with pytest.raises(GeometryError, match="shape"):
        Mechanism(CYCLE, BARS).mobility([[0.0, 0.0, 0.0]])


@settings(max_examples=50, deadline=None)
@given(st.lists(st.floats(-3.0, 3.0), min_size=12, max_size=12))
def test_jacobian_is_the_derivative_of_the_constraints(numbers: list[float]) -> None:
    """Against complex-free differences of the residual at 1e-6, at any pose, for every joint kind."""
    joints = mixed().joints
    pose = np.array(numbers).reshape(4, 3)
    centres = pose[2, :2] - pose[1, :2]
    if np.hypot(*centres) < 0.3:
        return
    J, h = jacobian(joints, pose), 1e-6
    for column in range(12):
        step = np.zeros(12)
        step[column] = h
        forward, back = (residual(joints, pose + sign * step.reshape(4, 3)) for sign in (1.0, -1.0))
        difference = (forward - back) / (2.0 * h)
        for row in range(len(difference)):
            if row == _angular_row(joints):  # sine of the angle times an arm: not the plain angle of the matrix
                continue
            if abs(difference[row]) > 1e4:  # the gear residual wraps by a full turn inside the step
                continue
            assert difference[row] == pytest.approx(J[row, column], abs=1e-6)


def _angular_row(joints: tuple[Any, ...]) -> int:
    row = 0
    for joint in joints:
        if isinstance(joint, Prismatic):
            return row + 1
        row += 3 - joint.mobility
    raise AssertionError


def test_gear_residual_against_fifty_digits() -> None:
    joint = Gear(1, 2, (0.1, 0.2), (-0.3, 0.4), 0.3, 0.7, False, 0.25)
    pose = np.array([[0.0, 0.0, 0.0], [0.4, 0.1, 0.9], [1.9, -0.7, 1.7]])
    with mp.workdps(50):
        P, Q = (
            mp.mpc(*pose[k, :2]) + mp.expj(mp.mpf(pose[k, 2])) * mp.mpc(*at)
            for k, at in ((1, joint.at_a), (2, joint.at_b))
        )
        phi = mp.arg(Q - P)
        value = mp.mpf(0.3) * (mp.mpf(0.9) - phi) + mp.mpf(0.7) * (mp.mpf(1.7) - phi - mp.mpf(0.25))
        period = 2 * mp.pi * (mp.mpf(0.3) + mp.mpf(0.7))
        value -= period * mp.nint(value / period)
        assert abs(float(residual([joint], pose)[0]) - float(value)) < 1e-15


# --- laws


@pytest.mark.parametrize(
    "law",
    [Linear(2.0, 0.3), Harmonic(0.2, 1.5, 3.0, 0.4), Polynomial((1.0, -2.0, 0.5, 0.25)),
     Table(tuple(np.linspace(-1.0, 2.0, 20)), tuple(np.sin(np.linspace(-1.0, 2.0, 20))))],
)  # fmt: skip
def test_laws_give_their_own_derivatives(law: Any) -> None:
    u, h = np.linspace(0.11, 0.73, 7), 1e-4
    q, q1, q2 = law(u)
    forward, back = law(u + h), law(u - h)
    np.testing.assert_allclose((forward[0] - back[0]) / (2 * h), q1, atol=1e-6)
    np.testing.assert_allclose((forward[1] - back[1]) / (2 * h), q2, atol=1e-5)
    assert q.shape == q1.shape == q2.shape == u.shape


# --- files


@pytest.mark.parametrize(
    "make", [mixed, lambda: Mechanism(CYCLE, BARS, [Driver(0, 1)]), lambda: Mechanism(CYCLE, BARS)]
)
def test_round_trip_is_exact(make: Any) -> None:
    mechanism = make()
    for write, read in ((Mechanism.to_json, Mechanism.from_json), (Mechanism.to_toml, Mechanism.from_toml)):
        text = write(mechanism)
        again = read(text)
        assert again == mechanism and write(again) == text
        assert read(text.encode()) == mechanism


@settings(max_examples=60, deadline=None)
@given(st.tuples(points, points, points, points), finite, st.floats(1e-300, 1e300), st.text(min_size=1, max_size=5))
def test_round_trip_keeps_every_bit(at: tuple[Any, ...], angle: float, rate: float, name: str) -> None:
    try:
        name.encode()
    except UnicodeEncodeError:
        return
    graph = MechanismGraph(3, [(0, 1), (1, 2)], frame=0)
    joints = [Prismatic(0, 1, at[0], at[1], angle, -angle), Revolute(1, 2, at[2], at[3])]
    mechanism = Mechanism(graph, joints, [Driver(0, 1, Polynomial((angle, rate)))], {name: (2, at[0])})
    for again in (Mechanism.from_json(mechanism.to_json()), Mechanism.from_toml(mechanism.to_toml())):
        assert again == mechanism
        assert again.dimensions.tobytes() == mechanism.dimensions.tobytes()


def test_smallest_mechanism() -> None:
    """A frame alone: every operation has an answer."""
    alone = Mechanism(MechanismGraph(1, [], frame=0), [], pose=((0.0, 0.0, 0.0),))
    assert Mechanism.from_toml(alone.to_toml()) == alone == Mechanism.from_json(alone.to_json())
    report = alone.mobility()
    assert (report.count, report.by_rank, report.rank) == (0, 0, 0)
    assert residual(alone.joints, alone.pose).shape == (0,)


def test_callable_law_cannot_be_written() -> None:
    mechanism = Mechanism(CYCLE, BARS, [Driver(0, 1, lambda u: (u, 1.0 + 0.0 * u, 0.0 * u))])
    with pytest.raises(GeometryError, match="Table"):
        mechanism.to_json()


def damaged() -> list[tuple[str, str]]:
    good = json.loads(mixed().to_json())

    def changed(**parts: Any) -> str:
        return json.dumps({**good, **parts})

    joint = good["joints"][0]
    return [
        ("", "line 1"), ("[]", "top level"), ("{", "line 1"), (changed(format="x"), "format"),
        (changed(version=2), "version"),
        (changed(graph="??"), "graph"), (changed(graph=3), "graph"), (changed(extra=1), "top level"),
        (changed(joints={}), "joints"), (changed(joints=[1]), r"joints\[0\]"),
        (changed(joints=[{**joint, "kind": "Q"}]), r"joints\[0\]"),
        (changed(joints=[{**joint, "c": 1}]), r"joints\[0\]"),
        (changed(joints=[{**joint, "at_a": [1, "2"]}]), r"joints\[0\]"),
        (changed(joints=[{"kind": "R", "a": 0}]), r"joints\[0\]"),
        (changed(joints=good["joints"][1:]), "mechanism"), (changed(drivers=[{"base": 0}]), r"drivers\[0\]"),
        (changed(drivers=[{"base": 0, "link": 1, "law": {"kind": "table"}}]), r"drivers\[0\].law"),
        (changed(drivers=[{"base": 0, "link": "1"}]), r"drivers\[0\]"), (changed(points=[]), "points"),
        (changed(points={"M": {"link": 1}}), "points.M"),
        (changed(points={"M": {"link": "a", "at": [0, 0]}}), "mechanism"),
        (changed(pose=[[1]]), "mechanism"), (changed(pose=3), "pose"), ("[" * 100_000, "text|line"),
        ('{"format": 1e999}', "top level"),
        ('{"format": 1, "format": 1}', "^text"),
    ]  # fmt: skip


@pytest.mark.parametrize(("text", "place"), damaged())
def test_damaged_files_say_where(text: str, place: str) -> None:
    with pytest.raises(FormatError, match=place):
        Mechanism.from_json(text)


@settings(max_examples=150, deadline=None)
@given(st.one_of(st.binary(max_size=200), st.text(max_size=200)), st.integers(0, 400), st.integers(0, 400))
def test_readers_raise_nothing_but_format_errors(noise: str | bytes, start: int, stop: int) -> None:
    for read, text in ((Mechanism.from_json, mixed().to_json()), (Mechanism.from_toml, mixed().to_toml())):
        middle = noise if isinstance(noise, str) else noise.decode("latin-1")
        for given_text in (noise, text[:start] + middle + text[stop:]):
            try:
                read(given_text)
            except FormatError as error:
                assert error.place
