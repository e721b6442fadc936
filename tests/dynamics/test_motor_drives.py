"""Motors as elements of a dynamic model: against a hand-written equation, the solver of drives, and their limits."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from dynamic_models import bar, braider, four_bar

from graphsynth.core.errors import GeometryError
from graphsynth.dynamics import (
    Body,
    DCMotor,
    DynamicModel,
    IdealSpeed,
    IdealTorque,
    JointFriction,
    LinearCharacteristic,
    MotorDrive,
    SynchronousMotor,
    Torque,
    TorqueSource,
    Train,
    consistent_start,
    inverse_dynamics,
    simulate_dynamics,
)
from graphsynth.dynamics.driven.inertia import EffectiveInertia
from graphsynth.kinematics import simulate
from graphsynth.mechanism.joints import PinSlot, Prismatic, Revolute
from graphsynth.mechanism.laws import Driver, Linear
from graphsynth.mechanism.model import Mechanism
from graphsynth.structure.graph import MechanismGraph
from graphsynth.systems.braider.model import Braider
from graphsynth.systems.platform.motor_model import MotorDrivenPlatform

FORMS = ("one-coordinate", "partitioned", "augmented")
DC = DCMotor(1.0, 0.05, 0.1, 0.1, gain=20.0, speed=20.0)
LENGTHS = (0.2, 0.6, 0.4, 0.6)


def driven_four_bar(*elements, gravity=(0.0, 0.0)):
    a, b, c, g = LENGTHS
    return DynamicModel(four_bar(a, b, c, g), {1: bar(0.2, a), 2: bar(0.6, b), 3: bar(0.4, c)}, elements, gravity)


def yoke(*elements, mass=2.0, reach=0.05):
    """Scotch yoke: the slider moves as ``reach sin q``, the source's model of a platform; the crank weighs nothing."""
    graph = MechanismGraph(3, [(0, 1), (1, 2, 2), (0, 2)], frame=0)
    up = math.pi / 2
    joints = [Revolute(0, 1), PinSlot(2, 1, (0.0, 0.0), (reach, 0.0)), Prismatic(0, 2, angle_a=up, angle_b=up)]
    mechanism = Mechanism(graph, joints, [Driver(0, 1)], pose=np.zeros((3, 3)))
    return DynamicModel(mechanism, {1: Body(0.0, 0.0), 2: Body(mass, 0.0)}, elements, (0.0, 0.0))


def by_hand(motor, train, times, angle, speed):
    """The four-bar by its closed loop in complex numbers, the motor's equation beside it; nothing shared."""
    from scipy.integrate import solve_ivp

    a, b, c, g = LENGTHS
    masses = (0.2, 0.6, 0.4)

    def links(q):
        A = a * np.exp(1j * q)
        line = g - A
        d = abs(line)
        along = (b * b - c * c + d * d) / (2.0 * d)
        u = line / d * (along + 1j * math.sqrt(b * b - along * along))
        v = A + u - g
        sine = (np.conj(u) * v).imag
        k2, k3 = -(np.conj(A) * v).imag / sine, -(np.conj(A) * u).imag / sine
        rest = A + u * k2 * k2 - v * k3 * k3
        f2, f3 = (rest * np.conj(v)).real / sine, (rest * np.conj(u)).real / sine
        return A, u, k2, k3, f2, f3

    def rates(_t, y):
        q, w, i = y
        A, u, k2, k3, f2, f3 = links(q)
        m1, m2, m3 = masses
        centre, bend = 1j * A + 0.5j * k2 * u, -A + (0.5j * f2 - 0.5 * k2 * k2) * u
        J = m1 * a * a / 3 + m2 * abs(centre) ** 2 + m2 * b * b / 12 * k2 * k2 + m3 * c * c / 3 * k3 * k3
        half = m2 * (np.conj(centre) * bend).real + m2 * b * b / 12 * k2 * f2 + m3 * c * c / 3 * k3 * f3
        N = train.ratio
        J += N * N * motor.rotor_inertia + train.inertia
        torque = N * motor.torque_constant * i - N * N * motor.friction * w
        volt = motor.gain * (motor.speed - N * w)
        didt = (volt - motor.resistance * i - motor.emf_constant * N * w) / motor.inductance
        return [w, (torque - half * w * w) / J, didt]

    return solve_ivp(rates, (times[0], times[-1]), [angle, speed, 0.0], "DOP853", times, rtol=1e-13, atol=1e-14).y


@pytest.mark.long
@pytest.mark.parametrize("form", FORMS)
def test_four_bar_with_a_dc_motor_by_hand(form):
    motor = replace(DC, inductance=0.2, speed=60.0, rotor_inertia=1e-3, friction=2e-3)
    train, times = Train(3.0, inertia=2e-3), np.linspace(0.0, 1.0, 21)
    model = driven_four_bar(MotorDrive(0, 1, motor, train))
    motion = simulate_dynamics(
        model, times, keep={(0, 1): 0.4}, keep_rates={(0, 1): 2.0}, modes={0: 1}, form=form, rtol=1e-12
    )
    q, w, i = by_hand(motor, train, times, 0.4, 2.0)
    (history,) = motion.motors
    assert np.abs(motion.coordinate(0, 1)[0] - q).max() < 1e-9 * np.abs(q).max()
    assert np.abs(history.speed / 3.0 - w).max() < 1e-9 * np.abs(w).max()
    assert np.abs(history.currents[:, 0] - i).max() < 1e-9 * np.abs(i).max()
    np.testing.assert_allclose(history.torque, 0.1 * history.currents[:, 0], rtol=1e-15)
    checks = motion.checks
    assert max(checks.energy, checks.electric, checks.power, checks.second_form, checks.newton_euler) < 1e-11
    assert motion.warnings == () and history.name == "motor 0-1"


@pytest.mark.parametrize(
    "method", ["DOP853", *(pytest.param(m, marks=pytest.mark.long) for m in ("RK45", "Radau", "BDF")), "LSODA", "CVODE"]
)
@pytest.mark.parametrize("form", FORMS)
def test_synchronous_motor_of_the_braider(form, method):
    if method == "CVODE":
        pytest.importorskip("sksundae")
    machine = Braider()
    model = braider()
    model = replace(model, elements=(*model.elements, MotorDrive(0, 1, machine.motor, machine.train)))
    times = [0.0, 0.001, 0.01, 0.05]
    tight = method == "DOP853"
    motion = simulate_dynamics(
        model, times, keep={(0, 1): 0.0}, modes={0: 1}, form=form, method=method, rtol=1e-12 if tight else 1e-8
    )
    expected = machine.simulate(times, rtol=1e-12, estimate=False)
    (history,) = motion.motors
    assert motion.completed
    np.testing.assert_allclose(motion.coordinate(0, 1)[0], expected.angle, atol=1e-14 if tight else 1e-8)
    np.testing.assert_allclose(history.speed / machine.train.ratio, expected.speed, atol=1e-12 if tight else 1e-6)
    np.testing.assert_allclose(history.currents, expected.currents, atol=1e-11 if tight else 1e-6)
    assert motion.checks.electric < (1e-12 if tight else 1e-6) and motion.checks.energy < (1e-12 if tight else 1e-6)


@pytest.mark.parametrize("method", ["DOP853", pytest.param("Radau", marks=pytest.mark.long), "LSODA"])
def test_voltage_limit_is_a_located_event(method):
    motor = replace(DC, voltage_limit=24.0)
    expected = MotorDrivenPlatform.source(motor).simulate([0.0, 0.6], rtol=1e-11)
    model = yoke(MotorDrive(0, 1, motor, Train(inertia=0.002)))
    tight = method == "DOP853"
    motion = simulate_dynamics(model, [0.0, 0.6], keep={(0, 1): 0.0}, method=method, rtol=1e-12 if tight else 1e-9)
    assert motion.completed and motion.form == "one-coordinate"
    assert motion.motors[0].speed[-1] == pytest.approx(expected.speed[-1], rel=1e-9 if tight else 1e-5)
    assert motion.motors[0].currents[-1, 0] == pytest.approx(expected.currents[-1, 0], rel=1e-8 if tight else 1e-4)
    found = [event.time for event in motion.events if event.kind == "voltage limit"]
    times = [event.time for event in expected.events if event.kind == "voltage limit"]
    assert len(found) == len(times) and found == pytest.approx(times, abs=1e-9 if tight else 1e-5)
    assert motion.checks.energy < 1e-6 and (not tight or motion.checks.electric < 1e-11)


@pytest.mark.long
def test_losses_follow_the_direction_of_the_power():
    train = Train(1.0, 0.7, 0.002)
    expected = MotorDrivenPlatform(EffectiveInertia.of_slider(2.0, 0.05), DC, train, load=0.05).simulate(
        [0.0, 0.5], rtol=1e-11
    )
    model = yoke(MotorDrive(0, 1, DC, train), Torque(0, 1, -0.05))
    motion = simulate_dynamics(model, np.linspace(0.0, 0.5, 51), keep={(0, 1): 0.0}, rtol=1e-12)
    (history,) = motion.motors
    assert motion.coordinate(0, 1)[0][-1] == pytest.approx(expected.angle[-1], rel=1e-9)
    assert history.speed[-1] == pytest.approx(expected.speed[-1], rel=1e-9)
    flows = [event.time for event in motion.events if event.kind == "direction of power flow"]
    times = [event.time for event in expected.events if event.kind == "direction of power flow"]
    assert len(flows) >= 4 and flows == pytest.approx(times, abs=1e-9)
    drives = history.torque * history.speed > 0.0
    np.testing.assert_allclose(history.output, history.torque * np.where(drives, 0.7, 1 / 0.7), rtol=1e-12)
    assert motion.checks.energy < 1e-11 and motion.checks.electric < 1e-11 and motion.warnings == ()


def test_a_train_that_holds_the_mechanism_says_so():
    model = yoke(MotorDrive(0, 1, IdealTorque(0.5), Train(1.0, 0.7, 0.002)), Torque(0, 1, -0.5))
    motion = simulate_dynamics(model, [0.0, 0.5], keep={(0, 1): 0.0}, keep_rates={(0, 1): 3.0})
    assert not motion.completed and "holds the mechanism at rest" in motion.message


@pytest.mark.slow  # the smaller the inductance, the stiffer
def test_limit_without_inductance_is_of_first_order():
    keep = {"keep": {(0, 1): 0.4}, "modes": {0: 1}, "method": "Radau", "rtol": 1e-10}
    limit = simulate_dynamics(driven_four_bar(MotorDrive(0, 1, replace(DC, inductance=0.0))), [0.0, 0.5], **keep)
    assert limit.motors[0].currents.shape == (2, 0)
    gaps = []
    for inductance in (1e-4, 1e-5, 1e-6):
        full = simulate_dynamics(
            driven_four_bar(MotorDrive(0, 1, replace(DC, inductance=inductance))), [0.0, 0.5], **keep
        )
        gaps.append(abs(full.motors[0].speed[-1] - limit.motors[0].speed[-1]))
    order = np.diff(np.log(gaps)) / np.diff(np.log([1e-4, 1e-5, 1e-6]))
    assert order == pytest.approx([1.0, 1.0], abs=0.02)


@pytest.mark.long
@pytest.mark.parametrize("form", FORMS)
def test_motors_without_currents_are_torque_sources(form):
    keep = {"keep": {(0, 1): 0.4}, "modes": {0: 1}, "form": form}
    line = LinearCharacteristic(2.0, 0.3, 1e-3, 2e-3)
    motor = MotorDrive(0, 1, line, Train(2.0, 0.9, 1e-3))
    source = TorqueSource(0, 1, lambda t, angle, speed: 2.0 - 0.3 * speed, 2.0, 0.9, 1e-3 + 1e-3 / 4.0, 2e-3)
    one, two = (
        simulate_dynamics(driven_four_bar(e, gravity=(0, -9.81)), [0.0, 0.5, 1.0], **keep) for e in (motor, source)
    )
    np.testing.assert_allclose(one.poses, two.poses, atol=1e-9)
    np.testing.assert_allclose(one.work, two.work, atol=1e-9)


def test_start_currents_count():
    motor = MotorDrive(0, 1, DC, currents=[3.0])
    start = consistent_start(driven_four_bar(motor), keep={(0, 1): 0.4}, modes={0: 1})
    pushed = consistent_start(driven_four_bar(Torque(0, 1, 0.3)), keep={(0, 1): 0.4}, modes={0: 1})
    np.testing.assert_allclose(start.accelerations, pushed.accelerations, rtol=1e-12, atol=1e-12)
    motion = simulate_dynamics(driven_four_bar(motor), [0.0, 0.01], start=start)
    assert motion.motors[0].currents[0, 0] == 3.0


def test_inverse_dynamics_tells_what_the_motor_must_give():
    """Along a motion that was simulated: the torque and current that made it."""
    train = Train(3.0, 0.8, 1e-3)
    motor = replace(DC, rotor_inertia=1e-3, friction=1e-3)
    model = driven_four_bar(MotorDrive(0, 1, motor, train), gravity=(0.0, -9.81))
    motion = simulate_dynamics(
        model, np.linspace(0.0, 0.5, 11), keep={(0, 1): 0.4}, keep_rates={(0, 1): 5.0}, modes={0: 1}, rtol=1e-12
    )
    q, w = motion.coordinate(0, 1)
    order = np.argsort(q)
    given = simulate(replace(model.mechanism, drivers=(Driver(0, 1, Linear()),)), q[order], modes={0: 1})
    demand = inverse_dynamics(model, given, w[order], motion.accelerations[order, 1, 2], times=motion.times[order])
    (found,), (made,) = demand.motors, motion.motors
    size = np.abs(made.torque).max()
    np.testing.assert_allclose(found.speed, made.speed[order], rtol=1e-12)
    # a switch of the power flow at an instant itself leaves both losses
    np.testing.assert_allclose(found.torque, made.torque[order], atol=1e-10 * size)
    np.testing.assert_allclose(found.currents, made.currents[order], atol=1e-10 * size / 0.1)
    np.testing.assert_allclose(found.output, made.output[order], atol=1e-9 * size)
    away = driven_four_bar(MotorDrive(0, 3, motor, train))
    with pytest.raises(GeometryError, match="motor 0-3 is not at the joint of a driver"):
        inverse_dynamics(away, given, w[order])


def test_dry_friction_with_a_motor_without_states():
    keep = {"keep": {(0, 1): 0.4}, "modes": {0: 1}}
    rub = JointFriction(0, 3, 0.2, radius=0.02)
    motor = MotorDrive(0, 1, LinearCharacteristic(1.0, 0.05))
    source = TorqueSource(0, 1, lambda t, angle, speed: 1.0 - 0.05 * speed)
    one, two = (simulate_dynamics(driven_four_bar(rub, e), [0.0, 0.5], **keep) for e in (motor, source))
    assert one.completed and np.abs(one.poses - two.poses).max() < 1e-9


REFUSED = {
    "dry friction beside motor drive 0-1": lambda: driven_four_bar(
        MotorDrive(0, 1, DC), JointFriction(0, 3, 0.2, radius=0.02)
    ),
    "has no torque of its own": lambda: MotorDrive(0, 1, IdealSpeed(20.0)),
    "is not a Train": lambda: MotorDrive(0, 1, DC, 3.0),
    "2 currents of motor drive 0-1 given for a motor with 1": lambda: MotorDrive(0, 1, DC, currents=(1.0, 2.0)),
    "are not a list": lambda: MotorDrive(0, 1, DC, currents=3.0),
    "needs a revolute joint, and joint 0-2 is none": lambda: yoke(MotorDrive(0, 2, DC)),
    "itself does nothing": lambda: MotorDrive(1, 1, DC),
    "names link 9": lambda: driven_four_bar(MotorDrive(0, 9, DC)),
}


@pytest.mark.parametrize("said", REFUSED)
def test_refusals(said):
    with pytest.raises(GeometryError, match=said) as caught:
        REFUSED[said]()
    assert "\n" not in str(caught.value)


def test_two_motors_share_a_mechanism():
    one = MotorDrive(0, 1, DC)
    two = MotorDrive(0, 3, SynchronousMotor(2, 1.0, 1e-2, 5e-2, 0.1, 1.0), Train(2.0))
    runs = [
        simulate_dynamics(
            driven_four_bar(one, two), [0.0, 0.2], keep={(0, 1): 0.4}, modes={0: 1}, form=form, rtol=1e-12
        )
        for form in FORMS
    ]
    for run in runs[1:]:
        for mine, first in zip(run.motors, runs[0].motors):
            np.testing.assert_allclose(mine.currents, first.currents, atol=1e-9)
    assert [motor.name for motor in runs[0].motors] == ["motor 0-1", "motor 0-3"]
