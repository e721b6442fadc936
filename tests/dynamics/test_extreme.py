"""Extreme cases of theory/extreme-cases 3 that concern planar dynamics: right, or flagged, never silently wrong."""

import math

import numpy as np
import pytest
from dynamic_models import bar, four_bar, g1, seven_body, seven_pose

from graphsynth.core.errors import GeometryError
from graphsynth.dynamics import (
    Body,
    DynamicModel,
    JointFriction,
    Spring,
    Torque,
    TorqueSource,
    consistent_start,
    effective_inertia,
    simulate_dynamics,
)
from graphsynth.dynamics.checks import warnings_of
from graphsynth.dynamics.forms.one_coordinate import OneCoordinateForm
from graphsynth.dynamics.integrate import make_form
from graphsynth.dynamics.result import RunChecks
from graphsynth.dynamics.stepping import CvodeStepper
from graphsynth.dynamics.tables import compile_model
from graphsynth.mechanism.joints import Prismatic, Revolute
from graphsynth.mechanism.laws import Driver, Linear
from graphsynth.mechanism.model import Mechanism
from graphsynth.structure.graph import MechanismGraph


def parallelogram():
    bodies = {1: bar(1.0, 0.2), 2: bar(2.0, 0.5), 3: bar(1.0, 0.2)}
    return DynamicModel(four_bar(0.2, 0.5, 0.2, 0.5), bodies, gravity=(0.0, 0.0))


def test_case_19_parallelogram_through_the_flat_pose():
    """It passes flat poses at theta = 0, pi: the motion stays that of a parallelogram, each passage is an event."""
    model = parallelogram()
    start = consistent_start(model, keep={(0, 1): 1.0}, keep_rates={(0, 1): 3.0}, modes={0: -1})
    if abs(start.poses[2, 2]) > 1e-9:
        start = consistent_start(model, keep={(0, 1): 1.0}, keep_rates={(0, 1): 3.0}, modes={0: 1})
    motion = simulate_dynamics(model, np.linspace(0.0, 3.0, 31), start=start)
    assert motion.completed and motion.form == "augmented"
    assert motion.events[0].kind == "fold" and "meet" in motion.events[0].statement
    passed = [event for event in motion.events if event.kind == "singular pose"]
    exact = [(k * math.pi - 1.0) / 3.0 for k in (1, 2, 3)]
    assert [event.time for event in passed] == pytest.approx(exact, abs=1e-6)
    assert all("two branches meet" in event.statement for event in passed)
    # no force in the plane and constant speed: the coupler does not turn, k3 = 1
    assert np.abs(motion.poses[:, 2, 2]).max() < 1e-7
    assert np.abs(motion.poses[:, 1, 2] - (1.0 + 3.0 * motion.times)).max() < 1e-7
    assert np.abs(motion.poses[:, 3, 2] - motion.poses[:, 1, 2]).max() < 1e-7


def test_case_19_sensitivity_to_the_start():
    model = parallelogram()
    ends = []
    for delta in (0.0, 1e-9):
        start = consistent_start(model, keep={(0, 1): 1.0 + delta}, keep_rates={(0, 1): 3.0}, modes={0: 1})
        ends.append(simulate_dynamics(model, [0.0, 1.0], start=start, form="augmented").poses[-1, 1:, 2])
    assert np.abs(ends[0] - ends[1]).max() < 1e-6


def flat_start():
    """Four-bar of theory/braider 8 in its flat pose: two branches cross, the velocity chooses one."""
    bodies = {1: bar(1.0, 0.02), 2: bar(1.0, 0.05), 3: bar(1.0, 0.03)}
    model = DynamicModel(four_bar(0.02, 0.05, 0.03, 0.06), bodies, gravity=(0.0, 0.0))
    pose = [(0.0, 0.0, 0.0), (0.0, 0.0, np.pi), (-0.02, 0.0, 0.0), (0.06, 0.0, np.pi)]
    return model, pose, consistent_start(model, pose=pose).tangents.motions


@pytest.mark.parametrize("branch", [0, 1])
@pytest.mark.parametrize("speed", [5.0, -5.0])
def test_start_at_a_change_point_follows_the_branch_of_its_velocity(branch, speed):
    """Time against the quadrature of the effective inertia along the branch (no forces in the plane)."""
    model, pose, motions = flat_start()
    start = consistent_start(model, pose=pose, rates=speed * motions[branch])
    motion = simulate_dynamics(model, np.linspace(0.0, 0.05, 6), start=start)
    assert motion.form == "augmented" and motion.completed and motion.checks.energy < 1e-10
    theta, kinetic = motion.poses[:, 1, 2], motion.kinetic[0]
    assert np.abs(motion.kinetic / kinetic - 1.0).max() < 1e-11
    middle = 0.5 * (theta[0] + theta[2])
    x, weights = np.polynomial.legendre.leggauss(24)
    nodes = middle + 0.5 * (theta[2] - theta[0]) * x
    order = np.argsort(nodes)
    times = []
    for mode in (1, -1):
        inertia = np.empty(24)
        inertia[order] = effective_inertia(model, nodes[order], modes={0: mode}).inertia
        times.append(0.5 * abs(theta[2] - theta[0]) * float(weights @ np.sqrt(inertia / (2.0 * kinetic))))
    assert min(abs(t - motion.times[2]) for t in times) < 1e-11
    assert max(abs(t - motion.times[2]) for t in times) > 1e-3  # the other branch is another motion


def test_start_at_rest_at_a_change_point_is_a_failure_with_a_reason():
    """With a load and no velocity nothing tells which branch: said quickly, not after a million steps."""
    model, pose, _ = flat_start()
    model = DynamicModel(model.mechanism, model.bodies, [Torque(0, 1, 0.1)], (0.0, 0.0))
    motion = simulate_dynamics(model, np.linspace(0.0, 0.05, 6), start=consistent_start(model, pose=pose))
    assert motion.form == "augmented" and motion.status == "failed"
    assert motion.steps < 2000 and np.isnan(motion.poses[-1]).all()


@pytest.mark.parametrize("seed", range(6))
def test_random_parallelograms_pass_their_flat_poses(seed):
    """Masses, inertias and speeds at random, with and without gravity: the coupler never turns, energy is kept."""
    rng = np.random.default_rng(seed)
    a, b = rng.uniform(0.1, 0.4), rng.uniform(0.3, 0.8)
    bodies = {
        k: Body(m, m * length**2 / 12.0 * rng.uniform(0.3, 2.0), (length * rng.uniform(0.2, 0.8), 0.0))
        for k, length, m in zip((1, 2, 3), (a, b, a), rng.uniform(0.2, 3.0, 3))
    }
    fast = seed % 2 == 0
    theta, speed = (
        rng.uniform(0.3, 2.8),
        rng.choice([-1.0, 1.0]) * rng.uniform(*((20.0, 40.0) if fast else (1.0, 20.0))),
    )
    model = DynamicModel(four_bar(a, b, a, b), bodies, gravity=(0.0, -9.81 if fast else 0.0))
    pose = [(0, 0, 0), (0, 0, theta), (a * math.cos(theta), a * math.sin(theta), 0), (b, 0, theta)]
    along = (-a * speed * math.sin(theta), a * speed * math.cos(theta), 0)
    start = consistent_start(model, pose=pose, rates=[(0, 0, 0), (0, 0, speed), along, (0, 0, speed)])
    motion = simulate_dynamics(model, np.linspace(0.0, 6.0 / abs(speed), 21), start=start, form="augmented")
    assert motion.completed and motion.steps < 100 and motion.warnings == ()
    assert np.abs(motion.poses[:, 2, 2]).max() < 1e-9
    passed = sum(event.kind == "singular pose" for event in motion.events)
    low, high = sorted((theta, float(motion.poses[-1, 1, 2])))
    assert passed == math.floor(high / math.pi) - math.floor(low / math.pi) >= 1


def test_fold_of_the_input_is_left_by_the_constrained_form():
    """A crank that cannot turn fully: the one-coordinate form ends at the fold, the whole motion goes on."""
    bodies = {1: bar(0.4, 0.4), 2: bar(0.35, 0.35), 3: bar(0.5, 0.5)}
    model = DynamicModel(four_bar(0.4, 0.35, 0.5, 0.7), bodies, gravity=(0.0, 0.0))
    start = consistent_start(model, keep={(0, 1): 0.5}, keep_rates={(0, 1): 4.0}, modes={0: 1})
    failed = simulate_dynamics(model, [0.0, 1.0, 2.0], start=start, form="one-coordinate")
    assert failed.status == "failed" and "fold" in failed.message
    assert np.isnan(failed.poses[-1]).all() and 0.0 < failed.reached < 1.0
    motion = simulate_dynamics(model, [0.0, 1.0, 2.0], start=start)
    assert motion.completed and motion.form == "augmented" and motion.checks.energy < 1e-9
    assert motion.events[0].kind == "fold" and abs(motion.events[0].time - failed.reached) < 1e-3
    reduced = simulate_dynamics(model, [0.0, 1.0, 2.0], start=start, form="partitioned", rtol=1e-9)
    assert reduced.completed
    assert any(event.kind == "change of coordinates" for event in reduced.events)
    assert np.abs(reduced.poses - motion.poses).max() < 1e-5


@pytest.mark.long
@pytest.mark.parametrize("method", ["DOP853", "RK45", "Radau", "BDF", "LSODA"])
def test_every_solver_reports_the_fold_as_a_failure(method):
    """Rates have no value beyond the fold: implicit solvers of scipy raise there, which is no way to fail."""
    bodies = {1: bar(0.4, 0.4), 2: bar(0.35, 0.35), 3: bar(0.5, 0.5)}
    model = DynamicModel(four_bar(0.4, 0.35, 0.5, 0.7), bodies, gravity=(0.0, 0.0))
    start = consistent_start(model, keep={(0, 1): 0.5}, keep_rates={(0, 1): 4.0}, modes={0: 1})
    times = np.linspace(0.0, 2.0, 201)
    motion = simulate_dynamics(model, times, start=start, form="one-coordinate", method=method, rtol=1e-8)
    assert motion.status == "failed" and 0.3 < motion.reached < 0.5
    known = np.isfinite(motion.poses).all(axis=(1, 2))
    assert known[times < motion.reached - 0.02].all() and not known[times > motion.reached].any()


def test_wrong_equations_fail_the_checks(monkeypatch):
    """A slope of the transmission that is off by a thousandth: energy and second formulation say so."""
    right = OneCoordinateForm.transmission

    def wrong(self, theta):
        q, q1, q2 = right(self, theta)
        return q, q1, 1.001 * q2

    def run():
        torque = Torque(0, 1, lambda t, angle, speed: 0.5)  # given as a function: the uncompiled rates
        return simulate_dynamics(
            g1(elements=[torque]), [0.0, 0.5, 1.0], keep={(0, 1): 0.3}, form="one-coordinate", rtol=1e-9
        )

    assert run().warnings == ()
    monkeypatch.setattr(OneCoordinateForm, "transmission", wrong)
    motion = run()
    assert motion.checks.energy > 1e-5 and motion.checks.second_form > 1e-5
    assert "energy balance" in motion.warnings[0] and "formulations" in motion.warnings[-1]


def test_an_output_without_a_pose_is_a_failure(monkeypatch):
    """Interpolated states that cannot be placed are no gaps in a motion that is called completed."""
    right = OneCoordinateForm.state

    def lost(self, t, y):
        q, v = right(self, t, y)
        return (q * np.nan if 0.5 < t < 0.6 else q), v

    monkeypatch.setattr(OneCoordinateForm, "state", lost)
    motion = simulate_dynamics(g1(), np.linspace(0.0, 1.0, 21), keep={(0, 1): 0.3}, form="one-coordinate")
    assert motion.status == "failed" and "no pose" in motion.message and motion.reached <= 0.55
    assert np.isnan(motion.poses[11:]).all() and np.isfinite(motion.poses[:11]).all()
    assert motion.warnings == ()


def test_a_check_without_a_value_is_a_warning():
    good = RunChecks(*[0.0] * 10)
    assert warnings_of(good, 1e-9) == ()
    assert "no value of energy" in warnings_of(good._replace(energy=math.nan), 1e-9)[0]


def test_case_20_nearly_massless_link():
    """Coupler times 1e-9: the augmented form against the massless limit in the one-coordinate form."""
    light = {1: bar(0.2, 0.2), 2: Body(0.6e-9, 0.018e-9, (0.3, 0.0)), 3: bar(0.4, 0.4)}
    none = {**light, 2: Body(0.0, 0.0, (0.3, 0.0))}
    keep = {"keep": {(0, 1): 0.0}, "keep_rates": {(0, 1): 10.0}, "modes": {0: 1}}
    limit = simulate_dynamics(g1(bodies=none), [0.0, 1.0], form="one-coordinate", **keep)
    near = simulate_dynamics(g1(bodies=light), [0.0, 1.0], form="augmented", **keep)
    assert near.completed and near.start.condition < 1e3
    assert np.abs(near.poses[-1] - limit.poses[-1]).max() < 1e-7
    assert near.checks.dalembert < 1e-9
    with pytest.raises(GeometryError, match=r"links \[2\] have no mass"):
        simulate_dynamics(g1(bodies=none), [0.0, 1.0], form="augmented", **keep)


def test_case_21_large_train_ratio():
    G, Jm = 1e3, 8.2e-6
    model = g1(elements=[TorqueSource(0, 1, 1e-3, G, rotor_inertia=Jm)])
    motion = simulate_dynamics(model, np.linspace(0.0, 1.0, 5), keep={(0, 1): 0.0}, modes={0: 1}, form="augmented")
    other = simulate_dynamics(model, np.linspace(0.0, 1.0, 5), keep={(0, 1): 0.0}, modes={0: 1}, form="one-coordinate")
    assert motion.checks.second_form < 1e-9 and motion.checks.energy < 1e-9
    assert np.abs(motion.poses - other.poses).max() < 1e-8


def test_case_18_contradicting_start_is_refused():
    keep = {"keep": {(0, 1): 0.0}, "keep_rates": {(0, 1): 10.0, (0, 3): 4.0}, "modes": {0: 1}}
    with pytest.raises(GeometryError, match="contradict the joints"):
        simulate_dynamics(g1(), [0.0, 1.0], **keep)


def test_spring_of_length_zero_is_a_failure():
    slider = Mechanism(MechanismGraph(2, [(0, 1)], frame=0), [Prismatic(0, 1)], [Driver(0, 1)])
    model = DynamicModel(slider, {1: Body(1.0, 1.0)}, [Spring(0, 1, (0, 0), (0, 0), 10.0, 0.1)], gravity=(0.0, 0.0))
    for form in ("one-coordinate", "augmented", "partitioned"):
        motion = simulate_dynamics(model, [0.0, 1.0], keep={(0, 1): 0.0}, form=form)
        assert motion.status == "failed" and "length 0" in motion.message and np.isnan(motion.poses[1]).all()


@pytest.mark.parametrize("form", ["one-coordinate", "augmented", "partitioned"])
@pytest.mark.parametrize("damping", [0.0, 2.0])
def test_a_spring_without_free_length_is_smooth_at_length_zero(form, damping):
    """From length 0 at 1 m/s: exp(-d t / 2) sin(w t) / w with w^2 = 100 - d^2 / 4; and at rest it stays at rest."""
    slider = Mechanism(MechanismGraph(2, [(0, 1)], frame=0), [Prismatic(0, 1)], [Driver(0, 1)])
    spring = Spring(0, 1, (0.0, 0.0), (0.0, 0.0), 100.0, 0.0, damping)
    model = DynamicModel(slider, {1: Body(1.0, 1.0)}, [spring], gravity=(0.0, 0.0))
    times, w = np.linspace(0.0, 1.0, 5), np.sqrt(100.0 - damping**2 / 4.0)
    motion = simulate_dynamics(model, times, keep={(0, 1): 0.0}, keep_rates={(0, 1): 1.0}, form=form)
    assert motion.completed and not motion.warnings
    assert motion.coordinate(0, 1)[0] == pytest.approx(
        np.exp(-damping / 2.0 * times) * np.sin(w * times) / w, abs=1e-10
    )
    assert motion.start.accelerations[1, 0] == pytest.approx(-damping)
    still = simulate_dynamics(model, [0.0, 1.0], keep={(0, 1): 0.0}, form=form)
    assert still.completed and still.coordinate(0, 1)[0][-1] == 0.0


def test_a_damper_alone_needs_no_length():
    slider = Mechanism(MechanismGraph(2, [(0, 1)], frame=0), [Prismatic(0, 1)], [Driver(0, 1)])
    damper = Spring(0, 1, (0.0, 0.0), (0.0, 0.0), 0.0, 0.3, 2.0)
    model = DynamicModel(slider, {1: Body(1.0, 1.0)}, [damper], gravity=(0.0, 0.0))
    motion = simulate_dynamics(model, [0.0, 1.0], keep={(0, 1): 0.0}, keep_rates={(0, 1): 1.0})
    assert motion.coordinate(0, 1)[1][-1] == pytest.approx(np.exp(-2.0), rel=1e-10)


@pytest.mark.parametrize("form", ["one-coordinate", "augmented", "partitioned"])
def test_a_state_that_is_none_blames_nothing(form):
    """Solvers that lose their way ask for NaN states: that is no word on springs or the mechanism."""
    model = g1(elements=[Spring(0, 2, (0.0, 1.0), (0.1, 0.0), 10.0, 0.1)])
    own = make_form(compile_model(model), consistent_start(model, keep={(0, 1): 0.0}, modes={0: 1}), form, True)
    assert np.isnan(own.rates(0.0, np.full_like(own.begin(), np.nan))).all() and own.why == ""


def driven_rocker(*elements):
    """G1's bars with the rocker prescribed towards its dead centre at acos(-3/4), where crank and coupler fold."""
    free = g1(elements=elements)
    begin = consistent_start(free, keep={(0, 1): 0.7}, modes={0: 1})
    law = Linear(2.0, float(begin.poses[3, 2]))
    mechanism = Mechanism(free.mechanism.graph, free.mechanism.joints, [])
    return DynamicModel(mechanism, free.bodies, free.elements, prescribed=[Driver(0, 3, law)]), begin.poses


@pytest.mark.parametrize(
    ("form", "method"),
    [("augmented", "DOP853"), pytest.param("augmented", "BDF", marks=pytest.mark.long), ("partitioned", "DOP853")],
)
def test_a_lock_under_prescribed_motion_is_called_one(form, method):
    model, pose = driven_rocker(Spring(0, 2, (0.0, 1.0), (0.1, 0.0), 1.0, 0.1))
    motion = simulate_dynamics(model, np.linspace(0.0, 2.0, 5), pose=pose, form=form, method=method, rtol=1e-8)
    assert motion.status == "failed"
    dead_centre = float(np.arccos(-0.75))
    assert motion.reached == pytest.approx((dead_centre - pose[3, 2]) / 2.0, abs=1e-6)
    assert "the prescribed motion of joint 0-3 locks the mechanism: near 2.41886 rad" in motion.message
    assert "branches" not in motion.message and "spring" not in motion.message


def test_masses_too_far_apart_are_named_not_branches():
    pendulum = Mechanism(MechanismGraph(2, [(0, 1)], frame=0), [Revolute(0, 1)], [Driver(0, 1)])
    expected = None
    for mass in (1e10, 1e24, 1e60):  # the acceleration hardly depends on the mass
        model = DynamicModel(pendulum, {1: Body(mass, 1.0, (0.1, 0.0))})
        start = consistent_start(model, keep={(0, 1): 0.3})
        motion = simulate_dynamics(model, [0.0, 0.2], start=start)
        expected = expected or motion.poses[-1, 1, 2]
        assert motion.form == "one-coordinate" and motion.poses[-1, 1, 2] == pytest.approx(expected, abs=1e-6)
        if mass > 1e20:
            assert "accelerations are not known: masses and inertias differ by a factor of 1e" in start.message
            with pytest.raises(GeometryError, match=r"differ by a factor of 1e.*too much for double precision"):
                simulate_dynamics(model, [0.0, 0.2], start=start, form="augmented")


def test_step_limit_is_a_failure():
    motion = simulate_dynamics(g1(), [0.0, 2.0], keep={(0, 1): 0.0}, modes={0: 1}, max_steps=10)
    assert motion.status == "failed" and "more than 10 steps" in motion.message and motion.reached < 2.0


@pytest.mark.parametrize("method", ["RK45", "Radau", "LSODA", "BDF"])
def test_other_methods(method):
    """Augmented form: Radau restarts after every projection, multistep methods are projected where they land."""
    reference = simulate_dynamics(g1(), [0.0, 0.1, 0.2], keep={(0, 1): 0.0}, modes={0: 1}, rtol=1e-12)
    motion = simulate_dynamics(
        g1(), [0.0, 0.1, 0.2], keep={(0, 1): 0.0}, modes={0: 1}, form="augmented", method=method, rtol=1e-7
    )
    assert motion.completed and motion.method == method
    assert np.abs(motion.poses - reference.poses).max() < 1e-4
    assert motion.checks.position_drift < 1e-13


def test_case_24_cyclic_coordinate_with_implicit_solver():
    rotor = Mechanism(MechanismGraph(2, [(0, 1)], frame=0), [Revolute(0, 1)], [Driver(0, 1)])
    model = DynamicModel(rotor, {1: Body(1.0, 0.1)}, [Torque(0, 1, lambda t, a, w: 1.0 - 0.01 * w)], (0.0, 0.0))
    for method in ("Radau", "BDF"):
        motion = simulate_dynamics(model, [0.0, 50.0], keep={(0, 1): 0.0}, method=method, rtol=1e-6)
        exact = 100.0 * (1.0 - math.exp(-0.1 * 50.0))
        assert motion.completed and motion.velocities[-1, 1, 2] == pytest.approx(exact, rel=1e-4)


def test_cvode():
    pytest.importorskip("sksundae")
    motion = simulate_dynamics(g1(), [0.0, 0.2], keep={(0, 1): 0.0}, modes={0: 1}, method="CVODE", rtol=1e-8)
    reference = simulate_dynamics(g1(), [0.0, 0.2], keep={(0, 1): 0.0}, modes={0: 1}, rtol=1e-12)
    assert motion.completed and np.abs(motion.poses - reference.poses).max() < 1e-5 and "sundae" in motion.backend


def test_cvode_keeps_its_words_for_the_reason(capfd):
    """y' = y^2 ends at t = 1: the words of the solver are the reason, not noise on the terminal."""
    pytest.importorskip("sksundae")
    stepper = CvodeStepper(lambda t, y: y * y, 0.0, np.array([1.0]), 2.0, 1e-8, 1e-10)
    message = None
    for _ in range(50_000):
        before = stepper.t, float(stepper.y[0])
        message = stepper.step()
        if stepper.status == "failed":
            break
    assert stepper.status == "failed" and before[0] == pytest.approx(1.0, rel=1e-5) and before[1] > 1e5
    assert "onvergence" in message and "corrector" in message
    assert capfd.readouterr() == ("", "")


def test_cvode_keeps_the_limit_of_steps():
    pytest.importorskip("sksundae")
    motion = simulate_dynamics(
        g1(), [0.0, 0.2], keep={(0, 1): 0.0}, modes={0: 1}, method="CVODE", rtol=1e-8, max_steps=5
    )
    assert not motion.completed and "more than 5 steps" in motion.message


@pytest.mark.long
def test_stiff_friction_is_reported_not_quiet():
    """Block braking to rest with a law regularised at 1e-8 m/s: right, or a failure with its time."""
    slider = Mechanism(MechanismGraph(2, [(0, 1)], frame=0), [Prismatic(0, 1)], [Driver(0, 1)])
    model = DynamicModel(slider, {1: Body(1.0, 1.0)}, [JointFriction(0, 1, 0.3, smoothing_velocity=1e-8)])
    motion = simulate_dynamics(
        model,
        [0.0, 0.2, 0.5],
        keep={(0, 1): 0.0},
        keep_rates={(0, 1): 1.0},
        form="augmented",
        rtol=1e-8,
        max_steps=3000,
    )
    stop = 1.0 / (0.3 * 9.81)
    assert motion.velocities[1, 1, 0] == pytest.approx(1.0 - 0.3 * 9.81 * 0.2, rel=1e-7)
    if motion.completed:
        assert motion.poses[-1, 1, 0] == pytest.approx(0.5 * stop, rel=1e-5)
    else:
        assert "stopped at t" in motion.message and motion.reached == pytest.approx(stop, rel=1e-2)


@pytest.mark.slow
def test_case_22_long_run():
    """G1 for 1000 s without damping: energy drift, closure; the phase error is what the error estimate says."""
    motion = simulate_dynamics(
        g1(), np.linspace(0.0, 1000.0, 101), keep={(0, 1): 0.0}, keep_rates={(0, 1): 10.0}, modes={0: 1},
        form="augmented", rtol=1e-12, estimate_error=True,
    )  # fmt: skip
    assert motion.completed
    # the crank's angle is some 9000 rad at the end: the joints close to its last digit
    turned = float(np.spacing(np.abs(motion.poses[:, 1, 2]).max()))
    assert motion.checks.energy < 1e-9 and motion.checks.position_drift < turned < 2e-12
    assert motion.error_estimate[-1] < 1e-3


def test_seven_bodies_all_forms_agree():
    model = seven_body()
    start = consistent_start(model, pose=seven_pose())
    ends = [
        simulate_dynamics(model, [0.0, 0.003], start=start, form=form, rtol=rtol).poses[-1]
        for form, rtol in (("one-coordinate", 1e-12), ("augmented", 1e-12), ("partitioned", 1e-11))
    ]
    assert np.abs(ends[0] - ends[1]).max() < 1e-10 and np.abs(ends[2] - ends[1]).max() < 1e-9
