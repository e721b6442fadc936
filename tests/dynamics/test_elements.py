"""Exact small tests of theory/planar-dynamics 9 and closed forms of every element."""

import math

import numpy as np
import pytest
from dynamic_models import bar, four_bar
from hypothesis import given, settings, strategies as st
from scipy.integrate import solve_ivp

from graphsynth.core.errors import GeometryError
from graphsynth.dynamics import (
    Body,
    DynamicModel,
    Force,
    JointFriction,
    Pulse,
    Rack,
    Rigid,
    Spring,
    Torque,
    TorqueSource,
    TorsionSpring,
    consistent_start,
    effective_inertia,
    simulate_dynamics,
)  # fmt: skip
from graphsynth.mechanism.joints import Cam, Gear, PinSlot, Prismatic, Revolute
from graphsynth.mechanism.laws import Driver, Harmonic, Polynomial
from graphsynth.mechanism.model import Mechanism
from graphsynth.structure.graph import MechanismGraph

NO_GRAVITY = (0.0, 0.0)


def wheel(inertia=1.0, gravity=NO_GRAVITY, elements=(), **more):
    single = Mechanism(MechanismGraph(2, [(0, 1)], frame=0), [Revolute(0, 1)], [Driver(0, 1)])
    return DynamicModel(single, {1: Body(1.0, inertia)}, elements, gravity, **more)


def slider(mass=2.0, elements=(), gravity=NO_GRAVITY, **more):
    single = Mechanism(MechanismGraph(2, [(0, 1)], frame=0), [Prismatic(0, 1)], [Driver(0, 1)])
    return DynamicModel(single, {1: Body(mass, 1.0)}, elements, gravity, **more)


def gear_pair(internal=False, elements=(), r1=0.03, r2=0.05):
    graph = MechanismGraph(3, [(0, 1), (0, 2), (1, 2, 2)], frame=0)
    distance = abs(r1 - r2) if internal else r1 + r2
    joints = [Revolute(0, 1), Revolute(0, 2, (distance, 0.0)), Gear(1, 2, radius_a=r1, radius_b=r2, internal=internal)]
    return DynamicModel(
        Mechanism(graph, joints, [Driver(0, 1)]), {1: Body(1.0, 2e-3), 2: Body(2.0, 7e-3)}, elements, NO_GRAVITY
    )


@pytest.mark.parametrize("internal", [False, True])
def test_gear_pair(internal):
    T, J1, J2, ratio = 0.7, 2e-3, 7e-3, 0.03 / 0.05
    model = gear_pair(internal, [Torque(0, 1, T)])
    start = consistent_start(model, pose=[(0, 0, 0), (0, 0, 0), (0.02 if internal else 0.08, 0, 0)])
    alpha = T / (J1 + J2 * ratio**2)
    assert start.accelerations[1, 2] == pytest.approx(alpha, rel=1e-13)
    assert start.accelerations[2, 2] == pytest.approx((1 if internal else -1) * alpha * ratio, rel=1e-13)
    motion = simulate_dynamics(model, [0.0, 0.1], start=start, form="augmented")
    tooth = motion.reactions.between(1, 2)
    # tangential force from the moment balance of wheel 2, at the pitch point
    force = J2 * alpha * ratio / 0.05
    assert abs(tooth.size[0] - force) < 1e-12 and abs(tooth.couple[0]) < 1e-14
    assert np.allclose(tooth.point[0], (-0.03 if internal else 0.03, 0.0), atol=1e-15)
    # the bearings carry the tooth force
    assert abs(motion.reactions.between(0, 2).size[0] - force) < 1e-12
    assert motion.checks.newton_euler < 1e-12
    apart = motion.reactions.separating(1, 2, math.radians(20.0))
    assert np.linalg.norm(apart[0]) == pytest.approx(force * math.tan(math.radians(20.0)), rel=1e-12)
    # wheel 2 is pushed away from wheel 1, a ring is pulled towards the mesh, whatever the sense of the torque
    sense = -1.0 if internal else 1.0
    assert sense * apart[0, 0] > 0.0 and abs(apart[0, 1]) < 1e-14
    other = simulate_dynamics(gear_pair(internal, [Torque(0, 1, -T)]), [0.0], pose=start.poses, form="augmented")
    assert sense * other.reactions.separating(1, 2, 0.35)[0, 0] > 0.0
    assert sense * other.reactions.separating(2, 1, 0.35)[0, 0] < 0.0


def test_epicyclic_train():
    """Ring fixed: carrier speed / sun speed = zs / (zs + zr) (theory/planar-dynamics 9)."""
    zs, zp, zr = 0.02, 0.015, 0.05
    graph = MechanismGraph(4, [(0, 1), (0, 2), (2, 3), (1, 3, 2), (0, 3, 2)], frame=0)
    joints = [
        Revolute(0, 1), Revolute(0, 2), Revolute(2, 3, (zs + zp, 0.0)), Gear(1, 3, radius_a=zs, radius_b=zp),
        Gear(0, 3, radius_a=zr, radius_b=zp, internal=True),
    ]  # fmt: skip
    pose = ((0, 0, 0), (0, 0, 0), (0, 0, 0), (zs + zp, 0, 0))
    mechanism = Mechanism(graph, joints, [Driver(0, 1)], pose=pose)
    model = DynamicModel(mechanism, {1: Body(1.0, 1e-3), 2: Body(0.5, 1e-3), 3: Body(0.2, 1e-4)}, [Torque(0, 1, 0.1)],
                         NO_GRAVITY)  # fmt: skip
    motion = simulate_dynamics(model, np.linspace(0.0, 2.0, 9), keep_rates={(0, 1): 30.0}, form="augmented")
    assert motion.completed and motion.warnings == ()
    assert np.allclose(motion.velocities[:, 2, 2] / motion.velocities[:, 1, 2], zs / (zs + zr), rtol=1e-12)
    assert motion.poses[-1, 2, 2] > 2.0 * math.pi  # the carrier turned: the line of centres was followed
    assert motion.checks.position_drift < 1e-12 and motion.checks.newton_euler < 1e-12


@pytest.mark.parametrize("form", ["one-coordinate", "augmented", "partitioned"])
def test_harmonic_motion(form):
    k, m, x0 = 50.0, 2.0, 0.1
    model = slider(m, [Spring(0, 1, (-1.0, 0.0), stiffness=k, free_length=1.0)])
    times = np.linspace(0.0, 3.0, 31)
    motion = simulate_dynamics(model, times, keep={(0, 1): x0}, form=form)
    assert np.abs(motion.poses[:, 1, 0] - x0 * np.cos(np.sqrt(k / m) * times)).max() < 1e-9


def test_damped_torsional_oscillator():
    k, c, J = 8.0, 0.4, 0.5
    times = np.linspace(0.0, 4.0, 17)
    motion = simulate_dynamics(wheel(J, elements=[TorsionSpring(0, 1, k, 0.3, c)]), times, keep={(0, 1): 1.3})
    delta, omega = c / (2 * J), np.sqrt(k / J - (c / (2 * J)) ** 2)
    exact = 0.3 + np.exp(-delta * times) * (np.cos(omega * times) + delta / omega * np.sin(omega * times))
    assert np.abs(motion.poses[:, 1, 2] - exact).max() < 1e-9
    assert motion.checks.energy < 1e-9


def test_reflected_inertia_and_efficiency():
    J, G, Jm, T = 0.02, 1e3, 3e-6, 1e-3
    for efficiency in (1.0, 0.8):
        source = TorqueSource(0, 1, T, G, efficiency, Jm, 1e-9)
        start = consistent_start(wheel(J, elements=[source]), keep={(0, 1): 0.0})
        assert start.accelerations[1, 2] == pytest.approx(efficiency * G * T / (J + G * G * Jm), rel=1e-14)
        back = consistent_start(wheel(J, elements=[source]), keep={(0, 1): 0.0}, keep_rates={(0, 1): -2.0})
        exact = (G * T / efficiency + 2.0 * G * G * 1e-9) / (J + G * G * Jm)
        assert back.accelerations[1, 2] == pytest.approx(exact, rel=1e-13)
    inertia = effective_inertia(wheel(J, elements=[TorqueSource(0, 1, 0.0, G, 1.0, Jm)]), [0.0, 1.0])
    assert np.allclose(inertia.inertia, J + G * G * Jm, rtol=1e-15)


def test_rack_and_pinion():
    m, J, rho, T = 2.0, 0.01, 0.05, 0.3
    graph = MechanismGraph(3, [(0, 1), (0, 2)], frame=0)
    mechanism = Mechanism(graph, [Prismatic(0, 1), Revolute(0, 2, (0.0, rho))], [Driver(0, 1), Driver(0, 2)],
                          pose=((0, 0, 0), (0, 0, 0), (0, rho, 0)))  # fmt: skip
    model = DynamicModel(mechanism, {1: Body(m, 1.0), 2: Body(1.0, J)}, [Torque(0, 2, T)], NO_GRAVITY,
                         additional=[Rack(1, 2, rho)])  # fmt: skip
    motion = simulate_dynamics(model, [0.0, 1.0])
    assert motion.accelerations[0, 2, 2] == pytest.approx(T / (J + m * rho**2), rel=1e-13)
    assert motion.poses[1, 1, 0] == pytest.approx(rho * 0.5 * T / (J + m * rho**2), rel=1e-10)
    assert motion.checks.position_drift < 1e-14 and motion.checks.newton_euler < 1e-12


def test_rigid_joint_and_prescribed_motion():
    """Two slabs welded together, driven to and fro: the driver's force is mass times acceleration."""
    graph = MechanismGraph(3, [(0, 1), (1, 2)], frame=0)
    mechanism = Mechanism(
        graph, [Prismatic(0, 1), Prismatic(1, 2)], [Driver(0, 1), Driver(1, 2)], pose=((0, 0, 0),) * 3
    )
    law = Harmonic(0.0, 0.2, 3.0)
    model = DynamicModel(mechanism, {1: Body(2.0, 1.0), 2: Body(3.0, 1.0)}, (), NO_GRAVITY,
                         prescribed=[Driver(0, 1, law)], additional=[Rigid(1, 2)])  # fmt: skip
    times = np.linspace(0.0, 2.0, 9)
    start = consistent_start(model)
    assert start.pose_class == "redundant"  # the weld and the guide hold the same angle and normal
    motion = simulate_dynamics(model, times, start=start)
    assert motion.completed
    assert np.abs(motion.poses[:, 2, 0] - 0.2 * np.sin(3.0 * times)).max() < 1e-12
    driver = motion.reactions.joints[-1]
    assert np.abs(driver.force[:, 0] + 5.0 * 0.2 * 9.0 * np.sin(3.0 * times)).max() < 1e-10
    # kinetic energy comes from the driver alone
    assert np.abs(motion.kinetic - motion.kinetic[0] - motion.work).max() < 1e-10


def test_sliding_friction_against_closed_form():
    """Block on a level guide slowing down: v0 - mu g t, while the speed is far above the regularising one."""
    mu, v0 = 0.3, 5.0
    model = slider(2.0, [JointFriction(0, 1, mu, smoothing_velocity=1e-3)], (0.0, -9.81))
    motion = simulate_dynamics(model, np.linspace(0.0, 1.0, 5), keep={(0, 1): 0.0}, keep_rates={(0, 1): v0},
                               form="augmented")  # fmt: skip
    assert np.abs(motion.velocities[:, 1, 0] - (v0 - mu * 9.81 * motion.times)).max() < 1e-9
    assert motion.checks.contraction == 0.0 and motion.checks.energy < 1e-9


@pytest.mark.parametrize("form", ["one-coordinate", "augmented", "partitioned"])
def test_pin_friction_against_closed_form(form):
    """A balanced wheel of weight W on a pin: torque mu r W (implicit, as friction adds no force)."""
    mu, r, J = 0.2, 0.01, 0.05
    model = wheel(J, (0.0, -9.81), [JointFriction(0, 1, mu, radius=r, smoothing_velocity=1e-5)])
    motion = simulate_dynamics(model, [0.0, 1.0], keep={(0, 1): 0.0}, keep_rates={(0, 1): 20.0}, form=form)
    assert motion.velocities[1, 1, 2] == pytest.approx(20.0 - mu * r * 9.81 / J, rel=1e-9)


def test_friction_that_leaves_no_motion_is_a_failure():
    """A rod pushed along a guide: with a large coefficient the normal force grows with the friction (Painleve)."""
    graph = MechanismGraph(3, [(0, 1), (1, 2)], frame=0)
    mechanism = Mechanism(graph, [Prismatic(0, 1), Revolute(1, 2)], [Driver(0, 1), Driver(1, 2)])
    bodies = {1: Body(1e-3, 1e-3), 2: Body.bar(1.0, (0.0, 0.0), (1.0, 0.0))}
    start = {"keep": {(0, 1): 0.0, (1, 2): 2.0}, "keep_rates": {(0, 1): 1.0, (1, 2): 0.0}}
    friction = [JointFriction(0, 1, mu, smoothing_velocity=1e-4) for mu in (0.1, 3.0)]
    good, bad = (simulate_dynamics(DynamicModel(mechanism, bodies, [f]), [0.0, 0.01], **start) for f in friction)
    assert good.completed and 0.0 < good.checks.contraction < 1.0
    assert (
        bad.status == "failed"
        and "no motion fits the dry friction in P 0-1" in bad.message
        and np.isnan(bad.poses[-1]).all()
    )


def test_pulse_conserves_impulse():
    """Case 23 of theory/extreme-cases 3: a torque of a microsecond; its edges are breaks."""
    pulse = Pulse(0.1, 1e-6, 5e4)
    model = wheel(0.2, elements=[Torque(0, 1, pulse)])
    motion = simulate_dynamics(model, [0.0, 0.05, 0.2], keep={(0, 1): 0.0})
    assert motion.velocities[:, 1, 2] == pytest.approx([0.0, 0.0, 5e4 * 1e-6 / 0.2], rel=1e-9)
    assert [event.kind for event in motion.events] == ["break", "break"]
    assert motion.checks.energy < 1e-9


def test_functions_and_constants_agree():
    make = lambda force: wheel(0.2, (0.0, -9.81), [Force(1, force, (0.5, 0.0)), TorsionSpring(0, 1, damping=0.1)])  # noqa: E731
    runs = [
        simulate_dynamics(make(force), [0.0, 1.0], keep={(0, 1): 0.0}, form=form)
        for force in ((0.3, 0.2), lambda t, place, speed: (0.3, 0.2))
        for form in ("one-coordinate", "augmented", "partitioned")
    ]  # fmt: skip
    for run in runs[1:]:
        assert abs(run.poses[-1, 1, 2] - runs[0].poses[-1, 1, 2]) < 1e-9
        assert abs(run.work[-1] - runs[0].work[-1]) < 1e-9
    turning = simulate_dynamics(
        wheel(0.2, elements=[Force(1, (0.0, 0.2), (0.5, 0.0), "body")]), [0.0, 1.0], keep={(0, 1): 0.0}
    )
    assert turning.poses[-1, 1, 2] == pytest.approx(0.5 * 0.1 / 0.2, rel=1e-9)


def test_cam_and_slot_reactions_two_ways():
    """Eccentric cam with a sliding follower; Scotch yoke: the second formulation knows nothing of the Jacobian."""
    cam = Mechanism(
        MechanismGraph(3, [(0, 1), (0, 2), (1, 2, 2)], frame=0),
        [Revolute(0, 1), Prismatic(0, 2, (0.0, 0.0), angle_a=0.5 * math.pi, angle_b=0.5 * math.pi),
         Cam(1, 2, radius=0.05, harmonics=((0.01, 0.004), (0.002, 0.001)))],
        [Driver(0, 1)], pose=((0, 0, 0), (0, 0, 0), (0, 0.05, 0)),
    )  # fmt: skip
    yoke = Mechanism(
        MechanismGraph(3, [(0, 1), (0, 2), (1, 2, 2)], frame=0),
        [Revolute(0, 1), Prismatic(0, 2), PinSlot(2, 1, (0.0, 0.0), (0.1, 0.0), 0.5 * math.pi)],
        [Driver(0, 1)], pose=((0, 0, 0), (0, 0, 0.3), (0.095, 0, 0)),
    )  # fmt: skip
    for mechanism in (cam, yoke):
        model = DynamicModel(mechanism, {1: Body(1.0, 0.01), 2: Body(0.5, 0.01)})
        motion = simulate_dynamics(model, np.linspace(0.0, 0.5, 6), keep_rates={(0, 1): 12.0}, form="augmented")
        assert motion.completed and motion.warnings == ()
        assert motion.checks.newton_euler < 1e-12 and motion.checks.second_form < 1e-12


@settings(max_examples=15, deadline=None)
@given(
    st.floats(0.05, 5.0), st.floats(0.05, 5.0), st.floats(-3.0, 3.0), st.floats(-3.0, 3.0),
    st.floats(-5.0, 5.0), st.floats(-5.0, 5.0),
)  # fmt: skip
def test_double_pendulum_against_lagrange(m1, m2, t1, t2, w1, w2):
    """Mobility 2: accelerations of all forms against the textbook equations of the double pendulum of point masses."""
    graph = MechanismGraph(3, [(0, 1), (1, 2)], frame=0)
    mechanism = Mechanism(graph, [Revolute(0, 1), Revolute(1, 2, (1.0, 0.0), (0.0, 0.0))], [Driver(0, 1), Driver(1, 2)])
    tiny = 1e-12
    model = DynamicModel(mechanism, {1: Body(m1, tiny, (1.0, 0.0)), 2: Body(m2, tiny, (1.0, 0.0))})
    start = consistent_start(model, keep={(0, 1): t1, (1, 2): t2 - t1}, keep_rates={(0, 1): w1, (1, 2): w2 - w1})
    c, s, g = math.cos(t1 - t2), math.sin(t1 - t2), 9.81
    A = [[m1 + m2, m2 * c], [m2 * c, m2]]
    right = [-m2 * w2**2 * s - (m1 + m2) * g * math.cos(t1), m2 * w1**2 * s - m2 * g * math.cos(t2)]
    exact = np.linalg.solve(A, right)
    size = np.abs(exact).max() * np.linalg.cond(A) + 1.0
    assert np.abs(start.accelerations[1:, 2] - exact).max() < 1e-9 * size
    reduced = simulate_dynamics(model, [0.0], start=start, form="partitioned")
    assert reduced.checks.second_form < 1e-7


@settings(max_examples=10, deadline=None)
@given(st.floats(0.0, 2.0 * math.pi), st.floats(-20.0, 20.0), st.floats(0.1, 3.0), st.floats(0.1, 3.0))
def test_effective_inertia_is_twice_the_kinetic_energy(theta, omega, m2, m3):
    model = DynamicModel(four_bar(0.2, 0.6, 0.4, 0.6), {1: bar(1.0, 0.2), 2: bar(m2, 0.6), 3: bar(m3, 0.4)})
    J = effective_inertia(model, [theta, theta + 1e-6], modes={0: 1})
    start = consistent_start(model, keep={(0, 1): theta}, keep_rates={(0, 1): omega}, modes={0: 1})
    motion = simulate_dynamics(model, [0.0], start=start, form="augmented")
    assert motion.kinetic[0] == pytest.approx(0.5 * J.inertia[0] * omega**2, rel=1e-11, abs=1e-14)
    assert (J.inertia[1] - J.inertia[0]) / 1e-6 == pytest.approx(J.slope[0], rel=1e-3, abs=1e-4)


@pytest.mark.parametrize(
    ("make", "text"),
    [
        (lambda: JointFriction(0, 1, 0.3, 0.2), "kinetic .* is above static"),
        (lambda: JointFriction(0, 1, 0.2, 0.3), "needs stribeck_speed"),
        (lambda: wheel(elements=[JointFriction(0, 1, 0.2)]), "radius of the pin"),
        (lambda: TorqueSource(0, 1, 1.0, ratio=0.0), "transmits nothing"),
        (lambda: TorqueSource(0, 1, 1.0, efficiency=1.2), "makes power from nothing"),
        (lambda: Spring(0, 1, stiffness=-1.0), "must be zero or more"),
        (lambda: Spring(1, 1), "between link 1 and itself"),
        (lambda: Pulse(0.0, 0.0, 1.0), "must be positive"),
        (lambda: wheel(elements=[Torque(0, 4, 1.0)]), "names link 4"),
        (lambda: simulate_dynamics(wheel(elements=[Torque(0, 1, lambda t, a, w: float("nan"))]), [0.0, 1.0],
                                   keep={(0, 1): 0.0}), "gave nan"),
    ],
)  # fmt: skip
def test_bad_input_is_one_sentence(make, text):
    with pytest.raises(GeometryError, match=text):
        make()


def test_prescribed_law_of_time():
    """A wheel spun up by a polynomial law: torque J alpha, work its kinetic energy."""
    law = Polynomial((0.0, 0.0, 1.5))
    motion = simulate_dynamics(wheel(0.4, prescribed=[Driver(0, 1, law)]), [0.0, 1.0, 2.0])
    assert motion.poses[:, 1, 2] == pytest.approx([0.0, 1.5, 6.0], abs=1e-12)
    assert motion.reactions.joints[-1].couple == pytest.approx([1.2] * 3, rel=1e-12)
    assert motion.work == pytest.approx(motion.kinetic, rel=1e-10)


@pytest.mark.parametrize("form", ["one-coordinate", "augmented", "partitioned"])
def test_constant_forces_of_the_world_and_of_the_body_at_points_off_the_origin(form):
    """A pendulum with both, and weight at a slanted centre of mass: its angle against one equation, integrated."""
    mass, inertia, centre = 2.0, 0.3, 0.4 + 0.1j
    world, at, body, there = 3.0 - 2.0j, 0.5 - 0.3j, 1.0 + 2.0j, -0.2 + 0.6j

    def point(z):
        return z.real, z.imag

    forces = [Force(1, point(world), point(at)), Force(1, point(body), point(there), frame="body")]
    pendulum = Mechanism(MechanismGraph(2, [(0, 1)], frame=0), [Revolute(0, 1)], [Driver(0, 1)])
    model = DynamicModel(pendulum, {1: Body(mass, inertia, point(centre))}, forces, (0.0, -9.81))
    times = np.linspace(0.0, 1.0, 6)
    motion = simulate_dynamics(model, times, keep={(0, 1): 0.7}, form=form, rtol=1e-11)

    def moment(angle):
        turn = np.exp(1j * angle)
        loads = (at, world), (there, body * turn), (centre, -9.81j * mass)
        return sum((np.conj(turn * arm) * load).imag for arm, load in loads)

    own = solve_ivp(lambda t, y: (y[1], moment(y[0]) / (inertia + mass * abs(centre) ** 2)), (0.0, 1.0), (0.7, 0.0),
                    t_eval=times, rtol=1e-12, atol=1e-13)  # fmt: skip
    np.testing.assert_allclose(motion.poses[:, 1, 2], own.y[0], atol=1e-8)
