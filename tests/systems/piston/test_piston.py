"""Floating piston: closed forms against the planar engine, 50-digit references and geometry; bad input."""

import math

import mpmath
import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from graphsynth.core.errors import GeometryError
from graphsynth.kinematics import simulate
from graphsynth.systems.piston import CrankSlider, FloatingGroup, FloatingPiston, ScotchYoke

MACHINES = {
    "centric": FloatingPiston.crank_slider(0.05, 0.2),
    "offset, askew": FloatingPiston.crank_slider(
        0.05, 0.2, 0.013, cylinder_angle=0.1, slot_angle=1.4, cylinder_offset=0.01, lead=0.1
    ),
    "other side": FloatingPiston(CrankSlider(0.05, 0.18, 0.02, branch=-1), FloatingGroup(-0.05, 1.7)),
    "plain": FloatingPiston(CrankSlider(0.05, 0.2, 0.01), None),
    "yoke": FloatingPiston.scotch_yoke(0.05, 0.01, cylinder_angle=-0.2),
    "oblique yoke": FloatingPiston(ScotchYoke(0.04, -0.01, 1.2), FloatingGroup(0.05, 1.5, 0.004, 0.03)),
    "plain yoke": FloatingPiston(ScotchYoke(0.05), None),
}


@pytest.mark.parametrize("machine", MACHINES.values(), ids=MACHINES)
def test_closed_form_is_the_engine(machine):
    phi = np.linspace(0.0, 2.0 * math.pi, 181)
    run = simulate(machine.mechanism("crowned"), phi, events=False)
    assert run.completed
    assert run.closure.closed
    own = machine.motion(phi)
    own_poses = machine.poses(phi)
    assert np.abs(run.poses - own_poses)[:, :, :2].max() < 1e-12
    turns = np.exp(1j * run.poses[:, :, 2]) - np.exp(1j * own_poses[:, :, 2])
    assert np.abs(turns).max() < 1e-12
    assert np.abs(np.diff(own_poses[:, 2, 2])).max() < 0.1
    turn = 0.0 if machine.group is None else machine.group.cylinder_angle
    along = np.array([math.cos(turn), math.sin(turn)])
    path = run.point("piston")
    for exact, engine in ((own.piston.first, path.velocity @ along), (own.piston.second, path.acceleration @ along)):
        assert np.abs(exact - engine).max() < 1e-12
    assert np.abs(own.crosshead.first - run.velocities[:, 3, 0]).max() < 1e-12
    assert np.abs(own.crosshead.second - run.accelerations[:, 3, 0]).max() < 1e-12
    if isinstance(machine.drive, CrankSlider):
        assert np.abs(own.follower.first - run.velocities[:, 2, 2]).max() < 1e-12
        assert np.abs(own.follower.second - run.accelerations[:, 2, 2]).max() < 1e-12


@pytest.mark.parametrize("machine", MACHINES.values(), ids=MACHINES)
def test_slot_and_follower_keep_the_loops_closed(machine):
    """The piston is the same point through the cylinder and through the slot; the crank pin the same through both."""
    phi = np.linspace(-7.0, 7.0, 97)
    motion, pose = machine.motion(phi), machine.poses(phi)
    crosshead = pose[:, 3, 0] + 1j * pose[:, 3, 1]
    if machine.group is not None:
        slot = crosshead + machine.group.lead + motion.slot.value * np.exp(1j * machine.group.slot_angle)
        assert np.abs(slot - (pose[:, 4, 0] + 1j * pose[:, 4, 1])).max() < 1e-15
    pin = machine.drive.crank * np.exp(1j * phi)
    if isinstance(machine.drive, CrankSlider):
        back = crosshead - machine.drive.rod * np.exp(1j * motion.follower.value)
    else:
        back = crosshead + motion.follower.value * np.exp(1j * machine.drive.yoke_angle)
    assert np.abs(back - pin).max() < 2e-16


def test_derivatives_against_fifty_digits():
    machine = MACHINES["offset, askew"]
    drive, group = machine.drive, machine.group
    with mpmath.workdps(50):
        r, rod, e = (mpmath.mpf(v) for v in (drive.crank, drive.rod, drive.offset))
        turn, slot = mpmath.mpf(group.cylinder_angle), mpmath.mpf(group.slot_angle)

        def piston(phi):
            s = r * mpmath.cos(phi) + mpmath.sqrt(rod**2 - (r * mpmath.sin(phi) - e) ** 2)
            x, y = s + mpmath.mpf(group.lead), -mpmath.mpf(group.cylinder_offset)
            return (x * mpmath.sin(slot) - y * mpmath.cos(slot)) / mpmath.sin(slot - turn)

        for phi in (0.0, 0.3, 1.7, 3.2, 5.9):
            own = machine.motion(phi).piston
            for order, value in enumerate(own):
                exact = mpmath.diff(piston, mpmath.mpf(phi), order)
                assert abs(mpmath.mpf(float(value)) - exact) < 3e-16


@pytest.mark.parametrize("machine", MACHINES.values(), ids=MACHINES)
def test_dead_centres_are_the_extremes(machine):
    outer, inner = machine.dead_centres()
    phi = np.linspace(0.0, 2.0 * math.pi, 20001)
    places = machine.motion(phi).piston.value
    for dead, best in ((outer, places.max()), (inner, places.min())):
        at = machine.motion(dead.angle)
        assert abs(at.piston.first) < 1e-16
        assert abs(float(at.piston.value) - dead.piston) < 2e-16
        assert abs(float(at.crosshead.value) - dead.crosshead) < 2e-16
        assert 0.0 <= abs(dead.piston - best) < 1e-8
    assert machine.stroke == pytest.approx(outer.piston - inner.piston, rel=1e-14)


def test_known_strokes_and_time_ratios():
    assert FloatingPiston.crank_slider(0.05, 0.2).stroke == pytest.approx(0.1, rel=1e-15)
    assert FloatingPiston.crank_slider(0.05, 0.2).time_ratio == pytest.approx(1.0, rel=1e-15)
    assert FloatingPiston.scotch_yoke(0.05).stroke == pytest.approx(0.1, rel=1e-15)
    # textbook: psi = asin(e/(l - r)) - asin(e/(l + r)), time ratio (pi + psi)/(pi - psi)
    drive = FloatingPiston(CrankSlider(0.03, 0.1, 0.02), None)
    psi = math.asin(0.02 / 0.07) - math.asin(0.02 / 0.13)
    assert drive.time_ratio == pytest.approx((math.pi + psi) / (math.pi - psi), rel=1e-14)
    assert drive.stroke == pytest.approx(math.sqrt(0.13**2 - 0.02**2) - math.sqrt(0.07**2 - 0.02**2), rel=1e-14)


def test_a_parallel_piston_moves_as_the_crosshead_and_its_slot_stands_still():
    motion = FloatingPiston.crank_slider(0.05, 0.2, lead=0.07, cylinder_offset=0.01).motion(np.linspace(0, 6, 50))
    assert (motion.slot.first == 0.0).all()
    assert motion.slot.value == pytest.approx(0.01, rel=1e-15)
    assert (motion.piston.first == motion.crosshead.first).all()
    assert motion.piston.value == pytest.approx(motion.crosshead.value + 0.07, rel=1e-14)


@settings(max_examples=60, deadline=None)
@given(
    ratio=st.floats(0.05, 0.9), offset=st.floats(-0.09, 0.09), turn=st.floats(-0.6, 0.6), skew=st.floats(-0.5, 0.5),
    where=st.floats(0.01, 0.99), closing=st.booleans(),
)  # fmt: skip
def test_angle_at_is_the_inverse(ratio, offset, turn, skew, where, closing):
    machine = FloatingPiston.crank_slider(ratio, 1.0, offset, cylinder_angle=turn, slot_angle=turn + 1.5708 + skew)
    outer, inner = machine.dead_centres()
    place = inner.piston + where * (outer.piston - inner.piston)
    phi = machine.angle_at(place, closing)
    found = machine.motion(phi).piston
    assert abs(float(found.value) - place) < 1e-14
    assert (found.first > 0.0) == closing


@pytest.mark.parametrize("ends", [(0, True), (0, False), (1, True), (1, False)])
def test_angle_at_a_dead_centre(ends):
    machine = MACHINES["offset, askew"]
    dead = machine.dead_centres()[ends[0]]
    apart = (machine.angle_at(dead.piston, ends[1]) - dead.angle + math.pi) % (2.0 * math.pi) - math.pi
    assert abs(apart) < 1e-6


@pytest.mark.parametrize(
    ("make", "sentence"),
    [
        (lambda: CrankSlider(0.1, 0.12, 0.03), r"rod of 0\.12 m is too short.*longer than.*0\.13 m; lengthen"),
        (lambda: CrankSlider(0.1, 0.1), "too short for a full turn"),
        (lambda: CrankSlider(-0.1, 0.2), "crank of the slider-crank"),
        (lambda: CrankSlider(0.1, math.nan), "rod of the slider-crank"),
        (lambda: CrankSlider(0.1, 0.2, branch=0), "branch = 0"),
        (lambda: ScotchYoke(0.1, yoke_angle=0.0), "does not drive the yoke"),
        (lambda: ScotchYoke(0.0), "crank of the Scotch yoke"),
        (lambda: FloatingGroup(0.2, 0.2), "parallel to the cylinder.*turn the slot"),
        (lambda: FloatingGroup(0.2, math.pi), "the piston stands still"),
        (lambda: FloatingGroup(0.5, 0.2), "against the crosshead"),
        (lambda: FloatingGroup(2.0), "keep it between"),
        (lambda: FloatingGroup(lead=math.inf), "lead of the floating group"),
        (lambda: FloatingPiston("crank"), "give a CrankSlider or a ScotchYoke"),
        (lambda: FloatingPiston(ScotchYoke(1.0), 3), "give a FloatingGroup"),
        (lambda: MACHINES["centric"].motion([0.0, math.nan]), "angle"),
        (lambda: MACHINES["centric"].angle_at(1.0, True), r"outside its stroke, 0\.15 to 0\.25 m"),
        (lambda: MACHINES["centric"].mechanism("glued"), "give 'sliding' or 'crowned'"),
    ],
)
def test_bad_input_gets_a_sentence(make, sentence):
    with pytest.raises(GeometryError, match=sentence):
        make()
