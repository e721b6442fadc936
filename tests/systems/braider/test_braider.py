"""The braider against theory/braider, its general model, and laws that need no numbers."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from graphsynth.core.errors import GeometryError, SpecError
from graphsynth.dynamics import effective_inertia, simulate_dynamics
from graphsynth.dynamics.driven.run import RunStatus
from graphsynth.dynamics.motors import IdealSpeed
from graphsynth.systems.braider.linkage import FourBar
from graphsynth.systems.braider.model import Braider, Thread
from graphsynth.systems.braider.reactions import reactions, run_reactions
from tests.systems.braider import closed_form

KINEMATICS = """
0 41.409622109270859338 82.819244218541718677 -0.5 -0.5 0.0944911182523068068 0.850420064270761261
30 28.610702417341099226 75.531185275470164697 -0.325677935295536113 0.0165972244271127753 0.418626949337120825 0.901914276673342154
60 21.786789298261811211 81.786789298261811211 -0.142857142857142857 0.357142857142857143 0.2710011467624774 0.415338714059883841
90 19.326295084113027412 94.848782898183103533 -0.0290994448735805628 0.487298334620741689 0.179753592392329071 0.110900555126419437
120 19.792181277965802197 109.7921812779658022 0.0590730148023940543 0.492085716694613378 0.166624909413174719 -0.0833750905868252809
180 28.955024371859847758 133.43253655778977164 0.25 0.25 0.177511736701173274 -0.338886042793148977
240 47.58795377399377163 137.58795377399377163 0.325542369812990561 -0.107470332079228762 -0.0793468029042989794 -0.329346802904298979
300 60.0 120.0 0 -0.5 -0.577350269189625765 -0.433012701892219323
"""  # noqa: E501
TRANSIENT = """
0.001 1.4251973266925226e-5 0.037346355221177177 0.001692394747757962 0.89809829429454007
0.005 0.00065041789366033121 0.27824977883268930 0.026640583802669723 0.90513812438276420
0.01 0.0027106734793825274 0.53767353537679946 0.045549391389854260 0.74967941391333739
0.02 0.010171944431618781 0.92985762829565593 0.055586984028325668 0.51423847641680804
0.11 0.14938600435197080 1.7690312437001589 0.0047083855504307044 0.022571913229512477
0.2 0.31072844213065383 1.8013851261961088 0.00088864597313680979 0.0042331083436000827
0.3 0.49096324256263541 1.8026587923350449 0.00073547620918885182 0.0035120585050494811
0.5 0.85149709671523497 1.8026624512378647 0.00073492931415580758 0.0035097465359681474
"""
#: theta (deg), F01, F12, F23, F03 (N), T (N m) at 1.803 rad/s
INVERSE = """
0 -0.006639487131696429 -0.003951007279825856 -0.006151865781696429 -0.003951007279825856 -0.002128989644196429 -0.003536324300019061 -0.01051207169116947 -0.01275680216780750 -7.902014559651712e-5
45 -0.004839456837046956 -0.002393107550719340 -0.004494656473810618 -0.002048307187483002 -0.001587080396653594 -0.001288624539887025 -0.01239058303943027 -0.01344872162838316 3.459660339026256e-5
90 -0.0005514568354000508 -0.001865229344192824 -0.0005514568354000508 -0.001377607994192824 -0.0002868771134955627 0.0008049379669618246 -0.008013352241867771 -0.01888388358044328 1.102913670800102e-5
135 0.002024364675765324 -0.0008553838129811615 0.001679564312528985 -0.0005105834497448226 -6.792441418579340e-5 0.0008535545735178835 -0.0006768885670919429 -0.02044936499705392 -1.653188590303964e-5
180 0.003263592129140625 0.001023292114048604 0.002775970779140625 0.001023292114048604 0.0004673884502343750 0.0004744324540302244 0.004270375435137041 -0.01924474259681187 -2.046584228097209e-5
225 0.002576117515813210 0.002497701397439530 0.002231317152576871 0.002152901034203191 0.0005501129941523806 0.0003880104752049412 0.005774479117342780 -0.01865336006789631 1.108971381127123e-6
270 0.001338911135500051 0.003160774210507176 0.001338911135500051 0.002673152860507176 0.0003721566695955627 0.0006719076386618246 0.003833814502027482 -0.01955013316099112 2.677822271000102e-5
315 0.0002801236992097207 0.002217365042609442 0.0006249240624460596 0.001872564679373104 0.0002291109512454725 0.001437686171428572 -0.002489658695930614 -0.02080322630388797 3.531982450554778e-5
"""  # noqa: E501
#: the same at 180.3 rad/s
FAST = """
45 -48.39456837046956 -23.93107550719340 -44.94656473810618 -20.48307187483002 -15.87080396653594 -12.88624539887025 9.144111795725163 10.13573543564782 0.3459660339026256
135 20.24364675765324 -8.553838129811615 16.79564312528985 -5.105834497448226 -0.6792441418579340 8.535545735178835 3.671681564110434 -8.256345064883025 -0.1653188590303964
270 13.38911135500051 31.60774210507176 13.38911135500051 26.73152860507176 3.721566695955627 6.719076386618246 -1.575307172379855 -3.082513364685191 0.2677822271000102
"""  # noqa: E501
#: time, acceleration, forces, torque along the start-up
ALONG = """
0.001 56.52843157448855 0.04579847547336771 0.05734980377900977 0.04579880553215928 0.04887053904667933 0.02056324953401762 0.02661274978050670 -0.02349721984902365 -0.03841312695000235 0.001090454589516257
0.005 56.94234314917608 0.04591187876834870 0.05761856874784279 0.04592904765424724 0.04907722663573690 0.02064769412007128 0.02667072538035937 -0.02354757415238231 -0.03846097530896319 0.001094831549948575
0.01 47.12534621339537 0.03735586085688494 0.04725321368931075 0.03741838581263088 0.04018455527247918 0.01689538303796604 0.02168128858809627 -0.02143623415994849 -0.03418827502988756 0.0008959102671802139
0.02 32.25799948951381 0.02373587412055114 0.03113511003410117 0.02391478083023687 0.02629797966535948 0.01100194013459903 0.01373942192411894 -0.01814148929036549 -0.02736689918573058 0.0005855832698725996
0.11 1.207605156151242 -0.006819839561175650 -0.003071402246542849 -0.006328687571865978 -0.003180661232686337 -0.002373922619893308 -0.003614844719670468 -0.01132685798388961 -0.01169316359002154 -4.165143292815129e-5
0.2 0.04783878049186229 -0.007817648086528653 -0.003772849988392029 -0.007352015646910593 -0.003630857776707946 -0.002992176994028780 -0.003801376593047602 -0.01161178868520518 -0.01085112373988766 -2.408601200226536e-5
0.3 0.001025654101088332 -0.006995868298660140 -0.003164311690339350 -0.006565935418327481 -0.002934632818644986 -0.002641383070000149 -0.002925083277353997 -0.01212833139654024 -0.01138763504829149 1.015578592547958e-5
0.5 -3.402634671635842e-5 -0.004361906414561858 -0.002291816582923000 -0.004040757471983281 -0.001925128803272454 -0.001369747506989066 -0.0009768256715299284 -0.01229814362047875 -0.01397824415491854 3.542683474303163e-5
"""  # noqa: E501


def read(text):
    return np.array([[float(x) for x in line.split()] for line in text.strip().splitlines()])


def columns(found):
    return np.column_stack([found.F01, found.F12, found.F23, found.F03, found.torque])


@pytest.fixture(scope="module")
def start_up():
    return Braider().simulate([0.0, *read(TRANSIENT)[:, 0]], rtol=1e-12)


def test_kinematics_of_the_specification():
    expected = read(KINEMATICS)
    s = FourBar().motion(np.radians(expected[:, 0]))
    found = np.column_stack([np.degrees(s.phi2), np.degrees(s.phi3), s.k2, s.k3, s.f2, s.f3])
    np.testing.assert_allclose(found, expected[:, 1:], rtol=2e-15, atol=1e-15)
    assert np.degrees(FourBar().rocker_range()) == pytest.approx((75.52248781407006, 138.59037789072914), rel=1e-15)


@pytest.mark.parametrize("text,speed", [(INVERSE, 1.803), (FAST, 180.3)], ids=["1.803 rad/s", "180.3 rad/s"])
def test_inverse_dynamics_of_the_specification(text, speed):
    expected = read(text)
    found = reactions(Braider(), np.radians(expected[:, 0]), speed, 0.0)
    scale = np.abs(expected[:, 1:9]).max()
    np.testing.assert_allclose(columns(found)[:, :8], expected[:, 1:9], rtol=1e-13, atol=1e-15 * scale)
    np.testing.assert_allclose(found.torque, expected[:, 9], rtol=1e-13, atol=1e-15 * np.abs(found.torque).max())
    assert found.power_error < 1e-14


@pytest.mark.parametrize("speed", [1.803, 180.3])
@pytest.mark.parametrize("branch", [1, -1])
@pytest.mark.parametrize("guide", [0.06, 0.03 + 0.07j])
def test_multipliers_agree_with_newton_and_euler(speed, branch, guide):
    braider = Braider(linkage=FourBar(branch=branch), thread=Thread(guide=guide))
    theta = np.sort(np.random.default_rng(5).uniform(-math.pi, math.pi, 20))
    alpha = np.random.default_rng(6).normal(0.0, 50.0, 20)
    found = reactions(braider, theta, speed, alpha)
    exact, torque = closed_form.reactions(braider, theta, speed, alpha)
    forces = np.stack([exact.real, exact.imag], axis=-1)
    for k in range(20):
        size = np.abs(forces[k]).max()
        np.testing.assert_allclose(found.forces()[k], forces[k], rtol=1e-12, atol=1e-13 * size)
        assert found.torque[k] == pytest.approx(torque[k], rel=1e-12, abs=1e-13 * size * 0.02)
    assert found.second_way < 1e-12


def test_start_up_of_the_specification(start_up):
    expected = read(TRANSIENT)
    found = np.column_stack([start_up.angle, start_up.speed, start_up.currents])[1:]
    np.testing.assert_allclose(found, expected[:, 1:], rtol=2e-13)
    assert start_up.complete and start_up.energy_error < 1e-13 and start_up.electric_error < 1e-13
    assert (np.abs(found - expected[:, 1:]).max(axis=0) <= start_up.error + 1e-15).all()


def test_reactions_along_the_start_up(start_up):
    expected = read(ALONG)
    found = run_reactions(Braider(), start_up)
    rows = np.column_stack([found.acceleration, columns(found)])[1:]
    # the late accelerations are differences of torques three hundred times larger
    np.testing.assert_allclose(rows[:, 0], expected[:, 1], rtol=1e-12, atol=2e-13)
    np.testing.assert_allclose(rows[:, 1:], expected[:, 2:], rtol=1e-11, atol=1e-16)
    for k in range(1, len(start_up.time)):
        accelerations, forces = general_state(Braider(), start_up, k)
        assert accelerations[1] == pytest.approx(found.acceleration[k], rel=1e-12, abs=2e-14)
        np.testing.assert_allclose(found.forces()[k], forces, rtol=1e-12, atol=1e-16)


def general_state(braider, run, k):
    """Accelerations of the angles and the joint forces of the general model at a state of a run."""
    model = braider.model()
    drive = replace(model.elements[-1], currents=tuple(run.currents[k]))
    model = replace(model, elements=(*model.elements[:-1], drive))
    state = {"keep": {(0, 1): run.angle[k]}, "keep_rates": {(0, 1): run.speed[k]}, "modes": {0: 1}}
    motion = simulate_dynamics(model, [0.0], form="augmented", **state)
    joints = (motion.reactions.between(*pair).on(pair[1])[0][0] for pair in ((0, 1), (1, 2), (2, 3), (0, 3)))
    return motion.accelerations[0, :, 2], np.array(list(joints))


@pytest.mark.long
def test_start_up_of_the_general_model(start_up):
    """The specification's start-up a second time: the planar model with its motor, integrated in every form."""
    expected = read(TRANSIENT)
    for form in ("one-coordinate", "partitioned", "augmented"):
        motion = simulate_dynamics(
            Braider().model(), start_up.time, keep={(0, 1): 0.0}, modes={0: 1}, form=form, rtol=1e-12
        )
        (motor,) = motion.motors
        found = np.column_stack([motion.coordinate(0, 1)[0], motor.speed / Braider().train.ratio, motor.currents])[1:]
        size = np.abs(expected[:, 1:]).max(axis=0)
        np.testing.assert_allclose(found, expected[:, 1:], rtol=2e-12, atol=2e-12 * size.max())
        assert motion.checks.energy < 1e-12 and motion.checks.electric < 1e-12 and motion.warnings == ()


def test_start_up_under_load_of_the_thread():
    """With a guide away from O2 the thread drives and brakes: against the general model in absolute coordinates."""
    braider = Braider(thread=Thread(weight=0.5, guide=0.02 + 0.08j))
    found = braider.simulate([0.0, 0.02, 0.05], angle=1.0, speed=1.0, rtol=1e-12)
    start = {"keep": {(0, 1): 1.0}, "keep_rates": {(0, 1): 1.0}, "modes": {0: 1}}
    second = simulate_dynamics(braider.model(), found.time, form="augmented", rtol=1e-12, **start)
    expected = np.column_stack([*second.coordinate(0, 1), second.motors[0].currents])
    without = replace(braider, thread=Thread(weight=0.0)).simulate([0.0, 0.05], angle=1.0, speed=1.0)
    assert abs(without.speed[-1] - found.speed[-1]) > 1e-3
    np.testing.assert_allclose(np.column_stack([found.angle, found.speed, found.currents]), expected, atol=1e-10)


def test_settling_and_steady_speed():
    braider = Braider()
    assert braider.settling(1.803, 0.02).time == pytest.approx(0.1083, abs=5e-5)
    assert braider.settling(1.803, 0.01).time == pytest.approx(0.1279, abs=5e-5)
    assert braider.settling(1.803, 0.05).time == pytest.approx(0.0827, abs=1e-4)
    assert braider.steady_range() == pytest.approx((1.802654502, 1.802779267), abs=1e-9)
    first = braider.simulate(np.linspace(0.0, 0.004, 401), estimate=False)
    peak = int(first.currents[:, 1].argmax())
    assert (first.time[peak], first.currents[peak, 1]) == pytest.approx((0.00206, 0.9915), abs=1e-5)


def test_sweep_of_the_inductance():
    sizes = (1e-3, 1e-4, 1e-5, 1e-6, 1e-8, 1e-10)
    study = Braider().inductance_study([0.0, 0.01, 0.11], sizes)
    assert [run.speed[1] for run in study.runs[:2]] == pytest.approx([0.537673535377, 0.552156857164], abs=5e-13)
    assert [run.speed[2] for run in study.runs[:2]] == pytest.approx([1.769031243700, 1.771280769465], abs=5e-13)
    gaps = [run.speed[2] - study.limit.speed[2] for run in study.runs]
    for gap, printed in zip(gaps, (-2e-3, 1e-4, 2e-5, 2e-6, 2e-8, 2e-10)):
        assert float(f"{gap:.0e}") == printed
    ratios = np.array(gaps[2:]) / np.array(sizes[2:])
    np.testing.assert_allclose(ratios, ratios[-1], rtol=0.05)
    assert study.steps.max() < 1.2 * study.steps.min()


@pytest.mark.parametrize("inductance", [10.0**-k for k in range(3, 13)])
def test_reduction_error_bounds_the_difference(inductance):
    braider = replace(Braider(), motor=replace(Braider().motor, inductance=inductance))
    times = np.linspace(0.0, 0.5, 11)
    full, reduced = (braider.simulate(times, reduce=r, rtol=1e-12, estimate=False) for r in (False, True))
    said = float(reduced.notes[0].split("angle ")[1].split(" rad")[0])
    assert np.abs(full.angle - reduced.angle)[1:].max() <= 1.3 * said + 1e-13


CHANGE = FourBar(0.02, 0.05, 0.03, 0.06)


@pytest.mark.parametrize(
    "distance,k2,k3",
    [
        (1e-2, -0.0854119493071495, 0.809013005595906),
        (1e-3, -0.0854102141515784, 0.809016954487655),
        (1e-4, -0.0854101968002345, 0.809016993976075),
        (1e-6, -0.085410196624986, 0.809016994374908),
        (1e-9, -0.0854101966249685, 0.809016994374947),
        (1e-12, (5 - 3 * math.sqrt(5)) / 20, (1 + math.sqrt(5)) / 4),
    ],
)
def test_velocity_ratios_near_the_change_point(distance, k2, k3):
    state = CHANGE.motion(math.pi - distance)
    assert float(state.k2) == pytest.approx(k2, rel=5e-15)
    assert float(state.k3) == pytest.approx(k3, rel=2e-15)


def test_change_point_is_reported_with_both_modes():
    (point,) = CHANGE.change_points()
    assert point.theta == math.pi and 0.0 < point.tolerance < 1e-15
    root = math.sqrt(5.0)
    assert point.ratios[1] == pytest.approx(((5 - 3 * root) / 20, (1 + root) / 4), rel=1e-14)
    assert point.ratios[-1] == pytest.approx(((5 + 3 * root) / 20, (1 - root) / 4), rel=1e-14)
    assert not FourBar().change_points() and CHANGE.turns_fully


def test_no_motion_through_a_change_point():
    braider = Braider(linkage=CHANGE)
    found = braider.simulate(np.linspace(0.0, 0.6, 61), angle=2.5)
    assert found.status is RunStatus.CHANGE_POINT and not found.complete
    assert np.isnan(found.speed[found.reached :]).all() and np.isfinite(found.speed[: found.reached]).all()
    assert (found.angle[: found.reached] < math.pi).all() and "choose the branch" in found.reason
    stopped = braider.simulate(np.linspace(0.0, 0.1, 3), angle=2.5)
    assert stopped.complete


def test_crank_that_cannot_turn_fails_loudly():
    limited = FourBar(0.03, 0.03, 0.04, 0.06)
    ((low, high),) = limited.reach()
    assert low == -high and 0.0 < high < math.pi
    assert np.isfinite(limited.motion(high - 1e-9).k3) and np.isnan(limited.motion(high + 1e-9).k3)
    assert np.isnan(limited.motion(math.pi).phi3)
    found = Braider(linkage=limited).simulate([0.0, 0.2, 2.0], angle=1.0)
    assert found.status in (RunStatus.NOT_FINITE, RunStatus.STEP_TOO_SMALL) and found.reason
    assert np.isnan(found.angle[-1])
    with pytest.raises(SpecError, match="cannot be assembled at angle"):
        Braider(linkage=limited).simulate([0.0, 1.0], angle=math.pi)
    with pytest.raises(GeometryError, match="does not turn fully"):
        limited.rocker_range()


LENGTH = st.floats(0.01, 1.0)


@settings(max_examples=60, deadline=None)
@given(LENGTH, LENGTH, LENGTH, LENGTH, st.sampled_from([1, -1]), st.floats(-3.1, 3.1))
def test_linkage_closes_and_derivatives_are_derivatives(a, b, c, g, branch, theta):
    bar = FourBar(a, b, c, g, branch)
    h = 1e-5
    s = bar.motion(theta + h * np.arange(-1, 2))
    cross = np.abs((np.conj(s.coupler) * s.rocker).imag) / (b * c)
    if not np.isfinite(s.k3).all() or cross.min() < 0.05:
        return
    loop = s.crank + s.coupler - g - s.rocker
    assert np.abs(loop).max() < 1e-14 * (a + b + c + g)
    assert np.allclose(np.abs(s.coupler), b, rtol=1e-13) and np.allclose(np.abs(s.rocker), c, rtol=1e-13)
    for angle, first, second in ((s.phi2, s.k2, s.f2), (s.phi3, s.k3, s.f3)):
        steps = np.array([math.remainder(x, math.tau) for x in np.diff(angle)])
        size = 1.0 + abs(first[1]) ** 3 + abs(second[1]) ** 2
        assert steps.sum() / (2 * h) == pytest.approx(first[1], abs=1e-5 * size)
        assert (first[2] - first[0]) / (2 * h) == pytest.approx(second[1], abs=1e-4 * size**2)


def test_effective_inertia_is_the_kinetic_energy():
    braider = Braider()
    theta = np.linspace(0.0, math.tau, 3001)
    J, slope = braider.effective_inertia(theta)
    linkage = J - braider.reflected_inertia
    assert 7.6e-6 < linkage.min() < 7.8e-6 and 3.5e-5 < linkage.max() < 3.7e-5  # theory/braider 4
    assert braider.reflected_inertia == pytest.approx(0.02766, abs=5e-6)
    general = effective_inertia(braider.model(motor=False), theta, modes={0: 1})
    np.testing.assert_allclose(general.inertia, linkage, rtol=1e-12)
    np.testing.assert_allclose(general.slope, slope, rtol=1e-11, atol=1e-12 * np.abs(slope).max())
    for k in (180, 1200, 2460):
        h = 1e-5
        ends = braider.effective_inertia(theta[k] + np.array([-h, h]))[0]
        assert slope[k] == pytest.approx((ends[1] - ends[0]) / (2 * h), abs=1e-9)


def test_link_motion_and_energy(start_up):
    braider = Braider()
    motion = braider.link_motion(start_up)
    s = braider.linkage.motion(start_up.angle)
    np.testing.assert_allclose(motion.speed[:, 2], s.k3 * start_up.speed)
    np.testing.assert_allclose(motion.acceleration[5], general_state(braider, start_up, 5)[0][1:], rtol=1e-11)


def test_ideal_speed_needs_the_torque_of_the_inverse_dynamics():
    braider = Braider(motor=IdealSpeed(58.08 * 1.803, rotor_inertia=8.2e-6, friction=1e-6))
    found = braider.simulate(np.linspace(0.0, 4.0, 81))
    assert found.complete and found.energy_error < 1e-14
    shaft = reactions(braider, found.angle, 1.803, 0.0).torque
    np.testing.assert_allclose(58.08 * found.motor_torque - 58.08**2 * 1e-6 * 1.803, shaft, atol=1e-15)
    blocked = Braider(linkage=FourBar(0.03, 0.03, 0.04, 0.06), motor=IdealSpeed(58.08)).simulate([0, 1, 2, 3])
    assert blocked.status is RunStatus.NOT_FINITE and np.isnan(blocked.motor_torque[blocked.reached :]).all()
    met = Braider(linkage=CHANGE, motor=IdealSpeed(58.08)).simulate([0, 1, 2, 3, 4])
    assert met.status is RunStatus.CHANGE_POINT and met.reached == 4


def test_gravity_of_the_thread_does_the_work_of_its_weight():
    """The thread is conservative: its work is the weight times the shortening between guide and tip."""
    braider = Braider(thread=Thread(guide=0.03 + 0.07j))  # that of theory/braider 3 lies over O2: no moment
    assert np.abs(Braider().load_moment(np.linspace(0.0, 6.0, 50))).max() < 1e-18
    theta = np.linspace(0.3, 1.9, 20001)
    power = braider.load_moment(theta) * braider.linkage.motion(theta).k3
    work = float(np.trapezoid(power, theta))
    length = np.sqrt(np.abs(braider.thread.guide - braider.tip(theta[[0, -1]])) ** 2 + braider.thread.height**2)
    assert abs(work) > 1e-5 and work == pytest.approx(0.005 * 9.80665 * (length[0] - length[1]), rel=1e-8)


REFUSED = {
    "mass of the coupler = -1": lambda: Braider(masses=(1, -1, 1, 1)),
    "3 masses given": lambda: Braider(masses=(1, 1, 1)),
    "weight = -1": lambda: Thread(weight=-1.0),
    "inertia = -1": lambda: Braider(inertia=-1.0),
    "crank = 0.0 must be positive": lambda: FourBar(crank=0.0),
    r"branch = 2 must be": lambda: FourBar(branch=2),
    "inductance = 0 with the unreduced": lambda: replace(
        Braider(), motor=replace(Braider().motor, inductance=0.0)
    ).simulate([0, 1], reduce=False),
    "guide = 'x' is no point": lambda: Thread(guide="x"),
    "1 masses given": lambda: Braider(masses=3.0),
    "is no motor": lambda: Braider(motor=3.0),
    "train = 3.0 is not a Train": lambda: Braider(train=3.0),
    "inertia is beyond the largest float": lambda: Braider(inertia=10**400),
    "crank is beyond the largest float": lambda: FourBar(crank=10**400),
    "FourBar and a Thread": lambda: Braider(linkage="x"),
    "target = 0 has no relative band": lambda: Braider().settling(0.0),
    "theta holds text": lambda: reactions(Braider(), "x", 1.0, 0.0),
    "do not fit": lambda: reactions(Braider(), [0.0, 1.0], [1.0, 2.0, 3.0], 0.0),
    "no inductance to take to zero": lambda: Braider(motor=IdealSpeed(1.0)).inductance_study([0, 1], (1e-3,)),
}


@pytest.mark.parametrize("said", REFUSED)
def test_refusals(said):
    with pytest.raises((SpecError, GeometryError), match=said) as caught:
        REFUSED[said]()
    assert "\n" not in str(caught.value)
