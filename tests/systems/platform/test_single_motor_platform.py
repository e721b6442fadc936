# ruff: noqa: E501  (published reference values are kept on one line with all their digits)
"""Single-motor platform against published values, events, and limits."""

from __future__ import annotations

import math

import mpmath as mp
import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from graphsynth.core.errors import GeometryError
from graphsynth.systems.platform.drive import FourBarDrive, GearTrain
from graphsynth.systems.platform.single_motor_platform import SingleMotorPlatform

REFERENCE = SingleMotorPlatform(crank=(10, 5, 0), phase=(0, 0.5, 1))
LEG_PHASES = SingleMotorPlatform().frame_angle

# theory/values-of-the-platform 5: x, y, alpha, det JX at psi = 0, pi/4, ...
TURN = [
    (0.6726309905203590802261211284909424, -5.007798833182029853049940135266481, 0.053384781411007717626804032933934, -188253854.0504867671045701),
    (2.003085941471040017307306726396674, -3.391552232148333278478002649010856, 0.06987910600284579180954095572691073, -187287228.0329033806575134),
    (2.172211419183971642040827297868537, -0.04768323414449883643629104241738908, 0.04895151525417892957151688809459961, -189868098.6267280692276949),
    (1.025495890139645259449279590110875, 3.64982806507084339814498784211189, 0.001873470169666165700157281989050218, -192939712.3128997799288063),
    (-0.6731441741127175688582979915376574, 5.303765688545813046002269110116014, -0.04341784898817701215996265355849387, -194870779.2935353852359861),
    (-1.831077174898203679729986777715387, 3.292345659924351297674528922707028, -0.05942221705704159821598014725173909, -196581108.8681434511971227),
    (-1.889700145248385379255604030099463, -1.051522105833263727665162607136399, -0.03476377299536746967580243856706337, -195831019.5659246261507579),
    (-0.9249528917879663743484622655216793, -4.329827171934922428383187821068037, 0.011553008906429611914736007842189, -192012144.5301085069646718),
]  # fmt: skip


def test_one_drive():
    got = FourBarDrive(45, 105 + 45j, 12.0, 45.0, 60.0).motion(0.7)
    assert float(got.phi) == pytest.approx(-1.76142803486685312590827270489243, rel=4e-16)
    assert float(got.phi1) == pytest.approx(-0.195942787559483230746514830441457, rel=2e-15)
    assert float(got.phi2) == pytest.approx(-0.08788600380819209084549323322808202, rel=1e-14)


def test_full_turn():
    motion = REFERENCE.full_turn(samples=9)
    expected = np.array(TURN)
    # positions come from numbers near 100 mm: absolute accuracy of some ulps of that
    np.testing.assert_allclose(motion.pose[:8, :2], expected[:, :2], rtol=0, atol=1e-12)
    np.testing.assert_allclose(motion.pose[:8, 2], expected[:, 2], rtol=0, atol=3e-15)
    np.testing.assert_allclose(motion.determinant[:8], expected[:, 3], rtol=1e-12)
    assert motion.complete
    assert motion.closed
    assert motion.period == 1
    assert motion.closure_error < 1e-14
    assert motion.label.sigma == (-1, -1, -1)
    assert motion.label.sign == -1
    assert motion.working_mode_constant
    assert motion.gap.min() > 0.5
    assert motion.residual < 1e-14


def test_derivatives_of_the_turn():
    motion = REFERENCE.full_turn(samples=[0.0, math.pi / 2])
    first = (
        -0.6966882513339280531955914216488243,
        4.925128885971393005983731698127162,
        -0.04836645382744467309666231876077368,
    )
    second = (
        -2.2750341968152088346720469953563,
        0.7611675745761551636526273716091713,
        -0.04480427527460655058634081494291135,
    )
    np.testing.assert_allclose(motion.velocity[1], first, rtol=1e-13)
    np.testing.assert_allclose(motion.acceleration[1], second, rtol=1e-12)
    inertia = motion.velocity[1] @ (np.array([1, 1, 400]) * motion.velocity[1])
    assert inertia == pytest.approx(25.677994605313476221661305879, rel=1e-13)
    slope = motion.velocity[1] @ (np.array([1, 1, 400]) * motion.acceleration[1])
    assert slope == pytest.approx(6.20064756945043313273315014519, rel=1e-12)
    theta = (
        0.0767234870485613048997313604663916,
        -3.931599296804069632610373816787392,
        -1.854590436003224464857024925844858,
    )
    assert np.abs(np.angle(np.exp(1j * (motion.theta[0] - theta)))).max() < 1e-15


def test_pure_rotation_between_dead_points():
    motion = SingleMotorPlatform(crank=(10,) * 3, phase=LEG_PHASES).full_turn()
    assert np.abs(motion.pose[:, :2]).max() < 1e-12
    dead = [event.psi for event in motion.events if event.kind == "rocker dead centre" and event.leg == 1]
    assert len(dead) == 2
    extremes = (
        SingleMotorPlatform(crank=(10,) * 3, phase=LEG_PHASES).full_turn(samples=[0.0, *sorted(dead)]).pose[1:, 2]
    )
    expected = (-0.169965206289128785062383428269, 0.182159242549307891849635352630)
    np.testing.assert_allclose(sorted(extremes), expected, rtol=0, atol=1e-14)


def test_circular_translation_harmonics():
    """theory/small-crank 3: mean of alpha and first harmonic for equal global phases, by trapezoidal sums."""
    motion = SingleMotorPlatform(crank=(5,) * 3).full_turn(samples=np.arange(65) * math.tau / 64)
    pose = motion.pose[:64]
    assert pose[:, 2].mean() == pytest.approx(0.00378954, abs=5e-9)
    first = 2 * np.mean(pose[:, 0] * np.exp(-1j * motion.psi[:64]))
    assert abs(first) == pytest.approx(3.7551412, abs=5e-8)


@pytest.mark.parametrize(("crank", "ends"), [(26.31, False), (26.32, True)])
def test_singular_limit_of_pure_rotation(crank, ends):
    """The limit is 45 (1 - sqrt(5/29)) = 26.31476703..., at alpha = 2 atan(3/7)."""
    motion = SingleMotorPlatform(crank=(crank,) * 3, phase=LEG_PHASES).full_turn(samples=73)
    assert motion.complete != ends
    if ends:
        event = motion.events[-1]
        assert event.kind == "platform singular"
        assert event.ends_motion
        # alpha behaves like a square root of the remaining angle of about 1e-10
        assert event.pose[2] == pytest.approx(2 * math.atan(3 / 7), abs=5e-5)
        assert motion.psi[-1] < event.psi
        assert not motion.closed
        assert "merge" in motion.stop_reason()


def test_drive_turn_statements():
    def drive(crank):
        return FourBarDrive(45, 105 + 45j, crank, 45.0, 60.0)

    assert drive(29.999999999999996).turn().kind == "full turn"
    assert drive(30.0).turn().kind == "change point"
    limited = drive(30.000000000000004).turn()
    assert limited.kind == "limited"
    assert drive(0.0).turn().kind == "full turn"
    assert drive(200.0).turn().kind == "never assembled"
    kind, _, angles = drive(30.0).barriers()
    assert kind == "change point" and len(angles) == 1
    drag = FourBarDrive(0, 1, 3.0, 3.2, 3.1)  # drag link: the frame is shortest
    assert drag.turn().kind == "full turn"


@settings(max_examples=150, deadline=None)
@given(st.floats(0.1, 5), st.floats(0.1, 5), st.floats(0.1, 5), st.floats(0.2, 5))
def test_admissible_intervals_are_where_the_drive_assembles(crank, coupler, rocker, distance):
    drive = FourBarDrive(0, distance * (0.6 + 0.8j), crank, coupler, rocker)
    psi = np.linspace(-math.pi, math.pi, 181)
    assembled = drive.motion(psi).status <= 1
    turn = drive.turn()
    if turn.admissible is None:
        assert assembled.all()
        return
    inside = np.zeros(psi.size, dtype=bool)
    border = np.zeros(psi.size, dtype=bool)
    for start, stop in turn.admissible:
        offset = (psi - start) % math.tau
        inside |= offset < stop - start
        for end in (start, stop):
            border |= np.abs(np.angle(np.exp(1j * (psi - end)))) < 1e-6
    assert np.all((inside == assembled) | border)


@settings(max_examples=80, deadline=None)
@given(st.floats(-4, 4), st.floats(1, 25), st.sampled_from((1, -1)))
def test_drive_derivatives_against_fifty_digits(psi, crank, tau):
    drive = FourBarDrive(45, 105 + 45j, crank, 45.0, 60.0, phase=0.3, tau=tau)
    got = drive.motion(psi)

    def phi(x):
        w = mp.mpc(45) - mp.mpc(105, 45) + mp.mpf(crank) * mp.expj(x + mp.mpf(drive.phase))
        r2 = abs(w) ** 2
        S = mp.sqrt((mp.mpf(105) ** 2 - r2) * (r2 - mp.mpf(15) ** 2))
        return mp.arg(w * mp.mpc(r2 + 60**2 - 45**2, tau * S))

    with mp.workdps(50):
        exact = [phi(mp.mpf(psi)), mp.diff(phi, mp.mpf(psi)), mp.diff(phi, mp.mpf(psi), 2)]
        assert abs(mp.arg(mp.expj(mp.mpf(float(got.phi)) - exact[0]))) < 1e-15
        assert float(got.phi1) == pytest.approx(float(exact[1]), rel=1e-12, abs=1e-14)
        assert float(got.phi2) == pytest.approx(float(exact[2]), rel=1e-11, abs=1e-13)


def test_dead_points_are_zeros_of_the_rate():
    drive = FourBarDrive(45, 105 + 45j, 12.0, 45.0, 60.0, phase=0.3)
    dead = drive.dead_points()
    assert len(dead) == 2
    assert np.abs(drive.motion(dead).phi1).max() < 1e-14


def test_lock_and_change_point_are_events():
    locked = SingleMotorPlatform(crank=(31,) * 3).full_turn(samples=73)
    event = locked.events[-1]
    assert (event.kind, event.ends_motion) == ("drive lock", True)
    assert not locked.complete
    drive = locked_drive = SingleMotorPlatform(crank=(31,) * 3).drives[event.leg - 1]
    assert locked_drive.motion(event.psi - 1e-7).status <= 1
    assert drive.motion(event.psi + 1e-7).status > 1
    change = SingleMotorPlatform(crank=(30,) * 3).full_turn(samples=73)
    assert [event.kind for event in change.events if event.ends_motion] == ["change point"]
    assert "choose" in change.stop_reason()
    assert not change.complete


def test_zero_cranks_make_a_structure():
    motion = SingleMotorPlatform(crank=(0, 0, 0)).full_turn(samples=9)
    assert motion.closed
    assert np.abs(motion.velocity).max() == 0.0
    assert np.abs(motion.pose).max() < 1e-12


def test_gears():
    assert GearTrain(30, 60).same_in_fixed_frame
    assert not GearTrain(20, 60).same_in_leg_frame
    assert GearTrain(10, 64).wheels_clear()
    assert not GearTrain(10, 65).wheels_clear()  # 6.464... is the limit
    with pytest.raises(GeometryError, match="z1"):
        GearTrain(0, 60)
    train = GearTrain(17, 40)
    for beta in (0.3, 2.0):
        chi = train.wheel_angle(beta, 0.1)
        turns = 17 * (beta - 0.1) / math.tau + 40 * (beta + math.pi - chi) / math.tau
        assert turns % 1.0 == pytest.approx(0.5, abs=1e-12)


@pytest.mark.parametrize(
    "change", [{"crank": (1, -1, 1)}, {"tau": (1, 0, 1)}, {"coupler": (1, 2)}, {"phase": (0, math.nan, 0)}]
)
def test_bad_input(change):
    with pytest.raises(GeometryError, match=next(iter(change))):
        SingleMotorPlatform(**change)


def test_home_must_be_close():
    with pytest.raises(GeometryError, match="home"):
        SingleMotorPlatform(home=(500.0, 0.0, 0.0)).full_turn(samples=3)


def test_other_assembly_mode_can_be_followed():
    machine = SingleMotorPlatform(crank=(2, 2, 2))
    poses = machine.all_poses(0.0)
    assert len(poses) == 2
    signs = [machine.full_turn(samples=5, start=pose).label.sign for pose in poses]
    assert sorted(signs) == [-1, 1]


def test_graph_is_figure_three():
    graph = REFERENCE.graph()
    assert graph.links == 15
    assert len(graph.joints) == 22
    assert graph.mobility == 1
    assert [len(level) for level in graph.levels] == [1, 7, 6, 1]


@pytest.mark.parametrize("wrong", [10, None, "abc", (1.0, 2.0), (1.0, 2.0, "x")])
@pytest.mark.parametrize(
    "name", ["crank", "phase", "coupler", "rocker", "pivot", "axis", "vertex", "l1", "delta", "home"]
)
def test_parameters_that_are_none_are_refused(wrong: object, name: str) -> None:
    if name == "l1" and wrong == 10:
        pytest.skip("one length for all legs is allowed")
    with pytest.raises(GeometryError, match=name):
        SingleMotorPlatform(**{name: wrong})  # type: ignore[arg-type]


def test_starts_that_are_none_are_refused() -> None:
    for start in ([0.0, 0.0], "x", [0.0, 0.0, math.nan]):
        with pytest.raises(GeometryError, match="start"):
            SingleMotorPlatform().full_turn(start=start)  # type: ignore[arg-type]
    for psi in ("x", [0.0, math.nan], [[0.0, "y"]]):
        with pytest.raises(GeometryError, match="psi"):
            SingleMotorPlatform().sweep(psi)  # type: ignore[arg-type]


def test_dead_points_of_every_turn_are_events() -> None:
    """Crank and coupler are in line twice a turn, drive by drive: 3 x 2 x 3 in three turns."""
    motion = SingleMotorPlatform().full_turn(np.linspace(0.1, 0.1 + 3.0 * math.tau, 361))
    at = [event.psi for event in motion.events if event.kind == "rocker dead centre"]
    assert len(at) == 18
    assert np.allclose(np.array(at[6:]) - np.array(at[:-6]), math.tau)
