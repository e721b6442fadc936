"""Full turns of the single-motor platform and of single cranks: proved, disproved, or left open, never wrong."""

from __future__ import annotations

import math
from fractions import Fraction

import mpmath as mp
import numpy as np
import pytest
from hypothesis import given, strategies as st

from graphsynth.core.errors import GeometryError
from graphsynth.intervals.balls import Balls, exact
from graphsynth.kinematics.certify import certify_four_bar, certify_inverted_slider_crank, certify_slider_crank
from graphsynth.mechanism.four_bar import TiltedFourBar
from graphsynth.mechanism.rotatability import type_of
from graphsynth.systems.platform import TurnVerdict, certify_full_turn
from graphsynth.systems.platform.certified_full_turn import PlatformSystem
from graphsynth.systems.platform.drive import FourBarDrive
from graphsynth.systems.platform.single_motor_platform import SingleMotorPlatform

LEG = (-5 * math.pi / 6, -math.pi / 6, math.pi / 2)

#: psi / pi -> pose on the home branch for l_B = (10, 5, 0), psi0 = (0, 0.5, 1): theory/values-of-the-platform 5
TABLE = {
    0.0: (0.6726309905203590, -5.007798833182030, 0.05338478141100772),
    0.25: (2.003085941471040, -3.391552232148333, 0.06987910600284579),
    0.5: (2.172211419183972, -0.04768323414449884, 0.04895151525417893),
    0.75: (1.025495890139645, 3.649828065070843, 0.001873470169666166),
    1.0: (-0.6731441741127176, 5.303765688545813, -0.04341784898817702),
    1.25: (-1.831077174898204, 3.292345659924351, -0.05942221705704160),
    1.5: (-1.889700145248385, -1.051522105833028, -0.03476377299536747),
    1.75: (-0.9249528917879664, -4.329827171934922, 0.01155300890642943),
}


def test_reference_turn_is_certified_and_holds_the_reference_poses() -> None:
    proof = certify_full_turn(SingleMotorPlatform(crank=(10, 5, 0), phase=(0, 0.5, 1)))
    assert proof.verdict is TurnVerdict.CERTIFIED_FULL_TURN and proof.certified
    assert proof.drives == ("full turn",) * 3
    assert proof.sigma == (-1, -1, -1) and proof.working_mode_constant is True and not proof.mode_arcs
    assert proof.covered >= math.tau * (1 - 1e-15)
    for part, pose in TABLE.items():
        mid, radius = proof.enclosure(part * math.pi)
        assert (np.abs(mid - pose) <= radius + 1e-15 * np.maximum(1.0, np.abs(pose))).all()
        assert radius.max() < 1e-11
    with pytest.raises(GeometryError, match="outside"):
        proof.enclosure(7.0)


@pytest.mark.parametrize(
    ("crank", "phase", "verdict"),
    [
        (26.31, LEG, TurnVerdict.CERTIFIED_FULL_TURN),
        (26.314, LEG, TurnVerdict.CERTIFIED_FULL_TURN),
        (26.315, LEG, TurnVerdict.UNDECIDED),
        (26.32, LEG, TurnVerdict.UNDECIDED),
        (29.9, (0.0, 0.0, 0.0), TurnVerdict.CERTIFIED_FULL_TURN),
        (30.0, (0.0, 0.0, 0.0), TurnVerdict.CHANGE_POINT),
        (math.nextafter(30.0, 31.0), (0.0, 0.0, 0.0), TurnVerdict.NOT_FULL_TURN),
    ],
)
def test_limits_of_the_mock_up(crank: float, phase: tuple[float, float, float], verdict: TurnVerdict) -> None:
    """Pure rotation up to 45 (1 - sqrt(5/29)) = 26.31476...; otherwise 30, exclusive, exactly.

    See theory/platform-drive 9.
    """
    proof = certify_full_turn(SingleMotorPlatform(crank=(crank,) * 3, phase=phase))
    assert proof.verdict is verdict, proof.statement
    assert proof.certified == (not proof.reason)
    if verdict is TurnVerdict.UNDECIDED:
        assert 1.0 < proof.covered < 5.0 and "det JX" in proof.reason


def test_one_crank_alone_and_none() -> None:
    assert certify_full_turn(SingleMotorPlatform(crank=(0, 29.99, 0))).certified
    assert certify_full_turn(SingleMotorPlatform(crank=(0, 30, 0))).verdict is TurnVerdict.CHANGE_POINT
    assert certify_full_turn(SingleMotorPlatform(crank=(0, 0, 0))).certified


def test_budget_is_kept() -> None:
    proof = certify_full_turn(SingleMotorPlatform(crank=(26.31,) * 3, phase=LEG), max_boxes=80)
    assert proof.verdict is TurnVerdict.UNDECIDED and "limit of work" in proof.reason
    assert proof.boxes <= 80 and proof.covered < math.tau


def test_a_start_pose_far_from_any_branch_proves_nothing() -> None:
    proof = certify_full_turn(SingleMotorPlatform(crank=(10, 5, 0)), start=(40.0, 40.0, 1.0))
    assert proof.verdict is TurnVerdict.UNDECIDED and "start" in proof.reason


def test_the_other_assembly_mode_is_another_certified_branch_or_open() -> None:
    mechanism = SingleMotorPlatform(crank=(3, 3, 3))
    poses = mechanism.all_poses(0.0)
    home = certify_full_turn(mechanism)
    other = max(poses.tolist(), key=lambda pose: abs(pose[2] - mechanism.home_pose(0.0)[2]))
    proof = certify_full_turn(mechanism, start=other)
    assert home.certified and proof.certified
    (a, ra), (b, rb) = home.enclosure(1.0), proof.enclosure(1.0)
    assert abs(a[2] - b[2]) > ra[2] + rb[2] + 0.5


def test_change_of_the_working_mode_is_located() -> None:
    """At home leg 1 is exactly stretched, so it passes its boundary twice a turn, regularly."""
    mechanism = SingleMotorPlatform(crank=(5, 5, 5), phase=(0, 0.5, 1), vertex=(4.2 + 74.4j, 45, 45))
    crossings = [event.psi for event in mechanism.full_turn(721).events if event.kind == "leg boundary"]
    proof = certify_full_turn(mechanism)
    assert proof.certified and proof.working_mode_constant is False and "change" in proof.statement
    assert len(proof.mode_arcs) == len(crossings) == 2
    for (leg, start, stop, changes), psi in zip(proof.mode_arcs, crossings):
        assert leg == 1 and changes and start < psi < stop and stop - start < 0.3


def test_platform_equations_agree_with_the_platform() -> None:
    mechanism = SingleMotorPlatform(crank=(10, 5, 1), phase=(0.3, 0.5, 1))
    system, motion = PlatformSystem(mechanism), mechanism.full_turn(13)
    x = np.column_stack([motion.theta - np.array(mechanism.delta), motion.pose])
    units = system.units(x, motion.psi)
    assert np.abs(system.residual(exact(x), exact(motion.psi), units).mid).max() < 1e-9
    J, rate = system.derivatives(exact(x), exact(motion.psi), units)
    np.testing.assert_allclose(
        J.mid[:, 3:, 3:], mechanism.platform.jacobians(motion.pose, motion.theta)[0], rtol=1e-10, atol=1e-9
    )
    P1, P2, JT, h_phi = system.bounds(exact(x), exact(motion.psi))
    np.testing.assert_allclose(JT.mid, motion.leg, rtol=1e-10)
    np.testing.assert_allclose(h_phi.mid, motion.drive, rtol=1e-10)
    np.testing.assert_allclose(P1.mid * P2.mid, motion.leg**2, rtol=1e-9)
    velocity = -np.linalg.solve(J.mid, rate.mid[..., None])[..., 0]
    np.testing.assert_allclose(velocity[:, 3:], motion.velocity, rtol=1e-9, atol=1e-10)


@given(st.integers(0, 2**32 - 1), st.floats(1e-8, 0.2))
def test_platform_jacobian_over_a_box_contains_that_of_its_members(seed: int, radius: float) -> None:
    system = PlatformSystem(SingleMotorPlatform(crank=(10, 5, 1), phase=(0.3, 0.5, 1)))
    random = np.random.default_rng(seed)
    x, u = random.normal(size=(1, 6)), random.normal(size=1)
    box = system.derivatives(Balls(x, np.full_like(x, radius)), Balls(u, np.full(1, radius)), system.units(x, u))
    x1, u1 = x + radius * random.uniform(-1, 1, x.shape), u + radius * random.uniform(-1, 1)
    member = system.derivatives(exact(x1), exact(u1), system.units(x1, u1))
    for whole, part in zip(box, member):
        assert (np.abs(part.mid - whole.mid) <= whole.rad + part.rad + 1e-13).all()


# --- single cranks, exactly


@given(st.lists(st.fractions(Fraction(1, 50), 50, max_denominator=60), min_size=4, max_size=4))
def test_four_bars_agree_with_grashof_and_with_the_extreme_positions(lengths: list[Fraction]) -> None:
    g, a, b, c = lengths
    proof = certify_four_bar(*lengths)
    s, p, q, longest = sorted(lengths)
    passes = all(abs(b - c) <= reach <= b + c for reach in (abs(g - a), g + a))
    assert (proof.kind in ("full turn", "change point")) == passes
    if proof.kind == "full turn":
        assert s + longest < p + q and proof.type in ("crank-rocker", "double crank")
    if proof.type in ("crank-rocker", "double crank"):
        assert proof.kind == "full turn"
    assert (proof.kind == "never assembled") == (proof.type == "never assembled") == (longest > s + p + q)
    assert (proof.kind == "immovable") == (proof.type == "immovable") == (longest == s + p + q)
    for limit in proof.limits:
        with mp.workdps(40):
            reach = b + c if limit.place == "stretched" else abs(b - c)
            cosine = (g * g + a * a - reach * reach) / (2 * g * a)
            angle = mp.acos(mp.mpf(cosine.numerator) / cosine.denominator)
            assert limit.low <= angle <= limit.high and limit.high - limit.low < 1e-14


@pytest.mark.parametrize("excess", [0, Fraction(1, 10**40), Fraction(-1, 10**40), 2.0**-52, -(2.0**-52)])
def test_change_points_are_decided_exactly(excess: float | Fraction) -> None:
    coupler = Fraction(2) + Fraction(excess)
    expected = "change point" if excess == 0 else "full turn" if excess > 0 else "limited"
    proof = certify_four_bar(3, 1, coupler, 2)
    assert proof.kind == expected
    assert certify_four_bar("0.3", "0.1", "0.2", "0.2").kind == "change point"
    assert certify_four_bar(0.3, 0.1, 0.2, 0.2).kind != "change point"  # the doubles do not add up
    assert certify_four_bar(2, 1, 2, 1).change_angles == ("0", "pi")


@given(st.permutations(range(4)), st.lists(st.fractions(Fraction(1, 50), 50), min_size=3, max_size=3))
def test_four_bars_that_can_only_lie_stretched_are_immovable(order: list[int], short: list[Fraction]) -> None:
    """The longest link is as long as the others together: a class of its own, wherever four-bars are classified."""
    lengths = [[*short, sum(short, Fraction(0))][k] for k in order]
    proof = certify_four_bar(*lengths)
    assert (proof.kind, proof.type, proof.full_turn, proof.change_angles) == ("immovable", "immovable", False, ())
    (limit,) = proof.limits
    assert limit.low in (0.0, math.pi - 2.0**-51, math.pi) and limit.high - limit.low < 1e-14
    assert type_of(*lengths) == "immovable"
    below = math.lcm(*(length.denominator for length in lengths))
    whole = [int(length * below) for length in lengths]
    if max(whole) < 2**50:
        turn = TiltedFourBar(*map(float, whole)).full_turn()
        assert (turn.kind, turn.possible, turn.method) == ("immovable", False, "exact")
        assert turn.limit_angles == pytest.approx((round(limit.low / math.pi) * math.pi,))
        g, a, b, c = map(float, whole)
        drive = FourBarDrive(0.0, complex(g), a, c, b)
        assert drive.turn().kind == "immovable" and len(drive.turn().admissible) == 1


@pytest.mark.parametrize("more", [0, 1, -1])
def test_the_class_changes_exactly_at_the_stretched_length(more: int) -> None:
    kind = {0: "immovable", 1: "never assembled", -1: "limited"}[more]
    part = Fraction(more, 10**60)
    for k in range(4):
        lengths = [Fraction(n) for n in (1, 2, 4)]
        lengths.insert(k, 7 + part)
        assert certify_four_bar(*lengths).kind == kind
        assert certify_four_bar(*lengths).type == {"limited": "triple rocker"}.get(kind, kind)
    assert certify_slider_crank(1, 2, 3 + part).kind == kind == certify_slider_crank(1, 2, -3 - part).kind
    assert certify_inverted_slider_crank(1, 2, 3 + part).kind == kind
    found = [n * 2**40 for n in (7, 1, 2, 4)]
    found[0] += more
    g, a, b, c = map(float, found)
    assert FourBarDrive(0.0, complex(g), a, c, b).turn().kind == kind == TiltedFourBar(g, a, b, c).full_turn().kind


def test_sliders() -> None:
    assert [round(limit.low, 12) for limit in certify_slider_crank(1, 2, 3).limits] == [-round(math.pi / 2, 12)]
    assert certify_inverted_slider_crank(1, 2, 3).limits[0].low == pytest.approx(math.pi, abs=1e-15)
    assert certify_slider_crank("0.1", "0.3", "0.2").change_angles == ("pi/2",)
    assert certify_slider_crank(1, 3, -1).kind == "full turn"
    assert certify_slider_crank(1, 1, 0).change_angles == ("pi/2", "-pi/2")
    assert certify_slider_crank(1, 1, 3).kind == "never assembled"
    both = certify_slider_crank(2, 1, "0.5")
    assert both.kind == "limited"
    for limit, sine in zip(both.limits, (-0.75, 0.25)):
        assert limit.low <= math.asin(sine) <= limit.high
    inverted = certify_inverted_slider_crank(1, 2, "1.5")
    assert inverted.kind == "limited" and inverted.limits[0].low <= math.acos(2.75 / 4) <= inverted.limits[0].high
    assert certify_inverted_slider_crank("0.1", "0.3", "0.2").kind == "change point"
    assert certify_inverted_slider_crank(1, 1, 3).kind == "never assembled"
    with pytest.raises(GeometryError, match="positive"):
        certify_slider_crank(0, 1)
