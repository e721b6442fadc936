"""Motors and trains: limits, direction of the power flow, refusals."""

from __future__ import annotations

import math

import numpy as np
import pytest

from graphsynth.core.errors import SpecError
from graphsynth.dynamics.driven.inertia import EffectiveInertia
from graphsynth.dynamics.driven.run import run
from graphsynth.dynamics.driven.setup import DriveOptions, Plant
from graphsynth.dynamics.motors import DCMotor, IdealSpeed, IdealTorque, LinearCharacteristic, SynchronousMotor, Train
from graphsynth.systems.platform.motor_model import MotorDrivenPlatform
from tests.dynamics.motors.linear_response import linear_response

DC = {"torque_constant": 0.1, "emf_constant": 0.1, "gain": 20.0, "speed": 20.0}


def test_reduced_dc_motor_is_the_algebraic_current():
    line = DCMotor(2.0, 0.1, **DC).reduced()
    for w in (-3.0, 0.0, 17.0):
        assert line.torque(w) == pytest.approx(0.1 * (20.0 * (20.0 - w) - 0.1 * w) / 2.0, rel=1e-15)


def test_reduced_synchronous_motor_is_the_algebraic_current():
    motor = SynchronousMotor(4, 2.0, 1e-3, 5e-3, 0.3, 2.1)
    for w in (-30.0, 0.0, 100.0):
        current = (2.1 - 4 * w * 5e-3) / 2.0
        assert motor.reduced().torque(w) == pytest.approx(1.5 * 4 * 5e-3 * current, rel=1e-15)


def test_train_of_teeth_and_direction_of_power():
    train = Train.of_teeth([(10, 44), (10, 33), (20, 80)], (0.95, 0.9, 0.98), inertia=1e-5)
    assert train.ratio == pytest.approx(58.08, rel=1e-15)
    eta = 0.95 * 0.9 * 0.98
    assert train.output_torque(2.0, 3.0) == pytest.approx(58.08 * eta * 2.0)
    assert train.output_torque(-2.0, 3.0) == pytest.approx(-58.08 / eta * 2.0)
    assert train.reflected(8.2e-6) == pytest.approx(58.08**2 * 8.2e-6 + 1e-5, rel=1e-15)


def test_synchronous_motor_at_speed_obeys_its_equations():
    """A motor held at constant speed (huge inertia) settles at the solution of two linear equations."""
    motor = SynchronousMotor(3, 1.5, 2e-3, 4e-3, -0.4, 1.7)
    speed = 50.0
    found = run(Plant(np.zeros((1, 1)), 1e9), motor, Train(), [0.0, 1.0], DriveOptions(speed=speed, rtol=1e-12))
    reactance = 3 * speed * 2e-3
    steady = np.linalg.solve([[1.5, -reactance], [reactance, 1.5]], [-0.4, 1.7 - 3 * speed * 4e-3])
    assert found.currents[-1] == pytest.approx(steady, rel=1e-10)
    assert found.electric_error < 1e-12


@pytest.mark.parametrize("resistance", [0.0, 1.0, 4.0, "critical", 100.0, 1e5])
def test_constant_inertia_agrees_with_the_closed_form(resistance):
    if resistance == "critical":
        resistance = 2.0 * 0.2 * math.sqrt(0.1 * 20.1 / (0.2 * 0.002))
    motor = DCMotor(resistance, 0.2, **DC)
    times = [0.0, 0.003, 0.02, 0.1, 0.4]
    found = MotorDrivenPlatform.source(motor, mass=0.0).simulate(times, rtol=1e-12, reduce=False)
    w, current = linear_response(motor, 0.002, times)
    assert np.abs(found.speed - w).max() < 1e-11 * 20.0
    assert np.abs(found.currents[:, 0] - current).max() < 1e-10 * np.abs(current).max()
    assert found.energy_error < 1e-12


@pytest.mark.parametrize("resistance", [3.0, "critical", 500.0])
def test_closed_form_solves_its_equations(resistance):
    """Against mpmath: the matrix exponential of the linear system with 50 digits."""
    import mpmath

    motor = DCMotor(100.0 if resistance == "critical" else resistance, 0.2, **DC)
    gear = Train(2.5)
    J = 0.002
    if resistance == "critical":
        J = 2.5**2 * 0.1 * 20.1 / 0.2 / (100.0 / 0.4) ** 2
    with mpmath.workdps(50):
        A = mpmath.matrix(3, 3)
        A[0, 1], A[1, 0], A[1, 1] = (mpmath.mpf(x) for x in (0, 0, 0))
        N, L = mpmath.mpf(2.5), mpmath.mpf(motor.inductance)
        A[0, 1] = N * mpmath.mpf(0.1) / mpmath.mpf(J)
        A[1, 0] = -(mpmath.mpf(20) + mpmath.mpf(0.1)) * N / L
        A[1, 1] = -mpmath.mpf(motor.resistance) / L
        A[1, 2] = mpmath.mpf(400) / L
        for t in (0.001, 0.05, 0.3):
            state = mpmath.expm(A * mpmath.mpf(t)) * mpmath.matrix([0, 0, 1])
            w, current = linear_response(motor, J, [t], gear)
            assert w[0] == pytest.approx(float(state[0]), rel=1e-12)
            assert current[0] == pytest.approx(float(state[1]), rel=1e-9, abs=1e-12)


def plain(motor, train, J0, amplitude, load, end):
    """The same drive with scipy, piece by piece between the zeros of the current, the speed and the voltage margin."""
    from scipy.integrate import solve_ivp

    def asked(y):
        return motor.gain * (motor.speed - train.ratio * y[1])

    def mode(y):
        held = 0 if abs(asked(y)) <= motor.voltage_limit else math.copysign(1.0, asked(y))
        return held, train.efficiency if y[1] * y[2] >= 0.0 else 1.0 / train.efficiency

    def rhs(_t, y, held, eta):
        q, w, i = y
        volt = held * motor.voltage_limit if held else asked(y)
        torque = train.ratio * eta * motor.torque_constant * i
        rate = (torque - load + 0.5 * amplitude * math.sin(2 * q) * w * w) / (J0 + amplitude * math.cos(q) ** 2)
        return [w, rate, (volt - motor.resistance * i - motor.emf_constant * train.ratio * w) / motor.inductance]

    margins = [lambda _t, y, *_: y[1], lambda _t, y, *_: y[2], lambda _t, y, *_: abs(asked(y)) - motor.voltage_limit]
    if motor.voltage_limit == math.inf:
        margins.pop()
    for margin in margins:
        margin.terminal = True
    t, y = 0.0, np.zeros(3)
    while t < end:
        for _ in range(2):  # a short step beyond the event, in the mode found there
            ahead = mode(y + 1e-8 * np.array(rhs(t, y, *mode(y))))
            y = y + 1e-8 * np.array(rhs(t, y, *ahead))
            t += 1e-8
        done = solve_ivp(rhs, (t, end), y, method="DOP853", rtol=1e-10, atol=1e-12, events=margins, args=mode(y))
        t, y = done.t[-1], done.y[:, -1]
    return y


def test_voltage_limit_is_an_event():
    motor = DCMotor(1.0, 0.05, **DC, voltage_limit=24.0)
    drive = MotorDrivenPlatform.source(motor)
    found = drive.simulate([0.0, 0.6], rtol=1e-11)
    assert np.array([found.angle[-1], found.speed[-1], found.currents[-1, 0]]) == pytest.approx(
        plain(motor, Train(), 0.002, 0.005, 0.0, 0.6), rel=1e-6
    )
    switches = [event for event in found.events if event.kind == "voltage limit"]
    assert switches
    for event in switches:
        assert abs(20.0 * (20.0 - event.motion)) == pytest.approx(24.0, rel=1e-9)
    assert found.energy_error < 1e-12 and found.electric_error < 1e-12


def test_efficiency_follows_the_direction_of_the_power():
    motor, train = DCMotor(1.0, 0.05, **DC), Train(1.0, 0.7)
    drive = MotorDrivenPlatform(EffectiveInertia.of_slider(2.0, 0.05), motor, train, base_inertia=0.002, load=0.05)
    found = drive.simulate([0.0, 0.5], rtol=1e-11)
    assert np.array([found.angle[-1], found.speed[-1], found.currents[-1, 0]]) == pytest.approx(
        plain(motor, train, 0.002, 0.005, 0.05, 0.5), rel=1e-6
    )
    flows = [event for event in found.events if event.kind == "direction of power flow"]
    assert len(flows) >= 4
    assert all(min(abs(event.currents[0]) / 20.0, abs(event.motion) / 20.0) < 1e-9 for event in flows)
    assert found.energy_error < 1e-12


def test_train_that_holds_the_mechanism_says_so():
    """A load between eta M and M / eta keeps a driven mechanism at rest: reported, not simulated as a chatter."""
    inertia = EffectiveInertia.of_slider(2.0, 0.05)
    drive = MotorDrivenPlatform(inertia, IdealTorque(0.5), Train(1.0, 0.7), base_inertia=0.002, load=0.5)
    found = drive.simulate([0.0, 0.5], speed=3.0, estimate=False)
    assert not found.complete and "holds the mechanism at rest" in found.reason


def test_loose_tolerance_that_spoils_the_energy_is_noted():
    found = MotorDrivenPlatform.source(DCMotor(1.0, 0.2, **DC)).simulate([0.0, 2.0], rtol=1e-3)
    assert found.energy_error > 1e-9 and any("energy balance" in note for note in found.notes)
    good = MotorDrivenPlatform.source(DCMotor(1.0, 0.2, **DC)).simulate([0.0, 2.0])
    assert good.energy_error < 1e-12 and not good.notes


@pytest.mark.parametrize("inductance", [1e-3, 1e-7, 1e-12])
def test_voltage_limit_with_any_inductance(inductance):
    """The current follows the limited voltage algebraically as L falls: speed from the first-order limit equation."""
    motor = DCMotor(1.0, inductance, **DC, voltage_limit=24.0)
    drive = MotorDrivenPlatform.source(motor, mass=0.0)
    found = drive.simulate([0.0, 0.01, 1.0], reduce=False)
    # 24 V until the controller asks for less:  J w' = K_m (24 - c_e w) / r, delayed by L / r
    limited = -240.0 * math.expm1(-0.1 * 0.1 * 0.01 / 0.002)
    assert found.speed[1] == pytest.approx(limited, abs=1.2 * 1200.0 * inductance + 1e-9)
    assert found.complete and found.speed[2] == pytest.approx(400.0 / 20.1, rel=1e-9)
    assert found.currents[2, 0] == pytest.approx(0.0, abs=1e-7)


def test_large_ratio_reports_the_reflected_inertia():
    motor = DCMotor(1.0, 0.01, 0.1, 0.1, 20.0, 2000.0, rotor_inertia=1e-6)
    drive = MotorDrivenPlatform(EffectiveInertia.of_slider(2.0, 0.05), motor, Train(1e3))
    assert drive.constant_inertia == pytest.approx(1.0, rel=1e-15)
    found = drive.simulate(np.linspace(0.0, 1.0, 11), rtol=1e-11)
    assert found.complete and found.energy_error < 1e-12
    assert found.speed[-1] == pytest.approx(2000.0 * 20.0 / 20.1 / 1e3, rel=1e-2)


def test_ideal_torque_and_speed():
    drive = MotorDrivenPlatform.source(IdealTorque(0.5), mass=0.0)
    found = drive.simulate([0.0, 0.2], rtol=1e-12)
    assert (found.speed[-1], found.angle[-1]) == pytest.approx((50.0, 5.0), rel=1e-12)
    held = MotorDrivenPlatform.source(IdealTorque(0.0)).torque_at_speed([0.3], 10.0)
    assert held[0] == pytest.approx(-0.5 * 0.005 * math.sin(0.6) * 100.0, rel=1e-12)


def test_ideal_speed_gives_the_torque():
    """Against the equation of motion by hand, with train, efficiency by direction, friction and a load series."""
    source = IdealSpeed(30.0, rotor_inertia=1e-4, friction=2e-3)
    drive = MotorDrivenPlatform(
        EffectiveInertia.of_slider(2.0, 0.05), source, Train(3.0, 0.8), friction=0.01, load_series=[-0.1, 0.2, -0.3]
    )
    found = drive.simulate(np.linspace(1.0, 3.0, 41), angle=0.3)
    q, w = 0.3 + 10.0 * (found.time - 1.0), 10.0
    load = -0.1 + 0.2 * np.cos(q) - 0.3 * np.sin(q)
    needed = -0.5 * 0.005 * np.sin(2 * q) * w * w + (0.01 + 9 * 2e-3) * w + load
    np.testing.assert_allclose(found.motor_torque, needed / 3.0 * np.where(needed > 0, 1 / 0.8, 0.8), rtol=1e-12)
    assert (needed > 0).any() and (needed < 0).any()
    np.testing.assert_allclose(found.kinetic_energy, 0.5 * (0.005 * np.cos(q) ** 2 + 9e-4) * w * w, rtol=1e-12)
    assert found.complete and found.energy_error < 1e-13 and found.currents.shape == (41, 0)
    np.testing.assert_allclose(found.reduced_angle + found.turns * math.tau, q, rtol=1e-14)
    with pytest.raises(SpecError, match="speed = 3 contradicts the ideal source, which turns the crank at 10"):
        drive.simulate([0.0, 1.0], speed=3.0)
    with pytest.raises(SpecError, match="no inductance"):
        drive.inductance_study([0.0, 1.0], [1e-3])


REFUSED = {
    "resistance and inductance are both zero": lambda: DCMotor(0.0, 0.0, **DC),
    "inductance = -0.1": lambda: DCMotor(1.0, -0.1, **DC),
    "resistance = nan": lambda: DCMotor(math.nan, 0.1, **DC),
    "voltage_limit = 0.0 must be positive": lambda: DCMotor(1.0, 0.1, **DC, voltage_limit=0.0),
    "rotor_inertia = -1": lambda: IdealTorque(1.0, rotor_inertia=-1.0),
    "slope = -2": lambda: LinearCharacteristic(1.0, -2.0),
    "pole_pairs = 1.5": lambda: SynchronousMotor(1.5, 1.0, 0.0, 0.1, 0.0, 1.0),
    "resistance = 0.0 must be positive": lambda: SynchronousMotor(1, 0.0, 0.1, 0.1, 0.0, 1.0),
    "no limit for L -> 0": lambda: DCMotor(0.0, 0.1, **DC).reduced(),
    "nonlinear": lambda: DCMotor(1.0, 0.1, **DC, voltage_limit=10.0).reduced(),
    "ratio = 0.0 must be positive": lambda: Train(0.0),
    "at most 1": lambda: Train(2.0, 90.0),
    "teeth = 0": lambda: Train.of_teeth([(0, 30)]),
    "2 efficiencies for 1 stages": lambda: Train.of_teeth([(10, 30)], (0.9, 0.9)),
    "resistance = 'one' is not a real number": lambda: DCMotor("one", 0.1, **DC),
    "pole_pairs = 'two' must be a whole number": lambda: SynchronousMotor("two", 1.0, 0.1, 0.1, 0.0, 1.0),
    "stage 10 of the train must be a pair": lambda: Train.of_teeth([10]),
    "teeth = 'x'": lambda: Train.of_teeth([(10, "x")]),
    "'motor' is no motor": lambda: MotorDrivenPlatform.source("motor"),
    "is no EffectiveInertia": lambda: MotorDrivenPlatform(5, DCMotor(1.0, 0.1, **DC)),
    "times holds text; give real numbers": lambda: MotorDrivenPlatform.source(DCMotor(1.0, 0.1, **DC)).simulate(
        ["a", "b"]
    ),
    "at least two strictly increasing": lambda: MotorDrivenPlatform.source(DCMotor(1.0, 0.1, **DC)).simulate(5),
    "max_steps = -5": lambda: MotorDrivenPlatform.source(DCMotor(1.0, 0.1, **DC)).simulate([0, 1], max_steps=-5),
    "2 currents given": lambda: MotorDrivenPlatform.source(DCMotor(1.0, 0.1, **DC)).simulate([0, 1], currents=(1, 2)),
    "must be positive: give a motor that turns": lambda: linear_response(
        DCMotor(1.0, 0.1, 0.0, 0.1, 20.0, 20.0), 0.1, [0, 1]
    ),
    "no inductance to try": lambda: MotorDrivenPlatform.source(DCMotor(1.0, 0.1, **DC)).inductance_study([0, 1], []),
    "rows holds text": lambda: EffectiveInertia("abc"),
    "odd number of columns": lambda: EffectiveInertia([[1.0, 2.0]]),
    "load_series of shape": lambda: MotorDrivenPlatform(
        EffectiveInertia([[1.0]]), DCMotor(1.0, 0.1, **DC), load_series=[1, 2]
    ),
}


@pytest.mark.parametrize("said", REFUSED)
def test_refusals_name_value_and_remedy(said):
    with pytest.raises(SpecError, match=said) as caught:
        REFUSED[said]()
    assert "\n" not in str(caught.value)


def test_names_are_found_in_the_room_without_loading_it():
    import subprocess
    import sys

    names = "DCMotor SynchronousMotor LinearCharacteristic IdealTorque IdealSpeed Train "
    names += "EffectiveInertia DriveRun"
    probe = (
        "import sys, graphsynth.dynamics as d; assert 'numpy' not in sys.modules; "
        f"assert all(getattr(d, n).__name__ == n and n in d.__all__ for n in {names.split()!r})"
    )
    subprocess.run([sys.executable, "-c", probe], check=True, timeout=60)
