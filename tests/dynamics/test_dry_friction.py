"""Dry friction in motion: sticking is a state, with events, for every form; closed forms and independent solutions."""

from __future__ import annotations

import math
import sys

import numpy as np
import pytest
from dynamic_models import slider_crank
from hypothesis import assume, given, settings, strategies as st

from graphsynth.core.errors import GeometryError, MissingExtraError, SpecError
from graphsynth.dynamics import Body, DynamicModel, Force, JointFriction, Pulse, Spring, Torque, simulate_dynamics
from graphsynth.mechanism.joints import Prismatic, Revolute
from graphsynth.mechanism.laws import Driver, Linear, Polynomial
from graphsynth.mechanism.model import Mechanism
from graphsynth.structure.graph import MechanismGraph
from graphsynth.systems.tribometer.model import Tribometer, general_model
from graphsynth.systems.tribometer.platforms import BeltDrive, HarmonicDrive, TwoCoefficientLaw

FORMS = ("augmented", "partitioned", "one-coordinate")
G = 9.81
SLIDER = Mechanism(MechanismGraph(2, [(0, 1)], frame=0), [Prismatic(0, 1)], [Driver(0, 1)])


def block(elements, angle=0.0, mass=1.0):
    """A block on an incline: gravity is turned instead."""
    gravity = (-G * math.sin(angle), -G * math.cos(angle))
    return DynamicModel(SLIDER, {1: Body(mass, 0.01)}, elements, gravity)


def run(model, times, place=0.0, rate=0.0, **options):
    return simulate_dynamics(model, times, keep={(0, 1): place}, keep_rates={(0, 1): rate}, **options)


def kinds(motion):
    return [event.kind for event in motion.events if event.kind != "break"]


def assert_complementary(motion):
    """Every state returned is one of friction: forces within their cones, at the limit against the sliding."""
    friction, elements = motion.friction, [e for e in motion.model.elements if isinstance(e, JointFriction)]
    assert motion.checks.dalembert < 1e-9 and motion.checks.power < 1e-9
    scale = max(float(np.abs(friction.load).max()), 1e-300)
    for f, e in enumerate(elements):
        joint = motion.model.mechanism.joint(e.a, e.b)
        pin = isinstance(joint, Revolute)
        lever = e.radius if pin else 1.0
        state, rate, force, load = (part[:, f] for part in friction[1:5])
        between = motion.reactions.between(joint.a, joint.b)
        normal = between.force @ [0.0, 0.0]  # of the right shape
        if pin:
            normal = between.size
        else:
            turn = motion.poses[:, joint.a, 2] + joint.angle_a
            across = -np.sin(turn) * between.force[:, 0] + np.cos(turn) * between.force[:, 1]
            normal = np.abs(across)
            if e.length > 0.0:
                normal = np.abs(across / 2 + between.couple / e.length) + np.abs(across / 2 - between.couple / e.length)
        assert np.abs(load - normal).max() < 1e-9 * scale
        stuck = state == 0
        assert (rate[stuck] == 0.0).all()
        assert (np.abs(force[stuck]) <= e.static * lever * load[stuck] + 1e-9 * scale * lever).all()
        assert (state * rate >= 0.0).all()
        v = lever * np.abs(rate)
        fall = np.exp(-((v / e.stribeck_speed) ** 2)) if e.stribeck_speed > 0.0 else 0.0
        mu = e.kinetic + (e.static - e.kinetic) * fall
        assert np.abs(force + state * mu * lever * load)[~stuck].max(initial=0.0) < 1e-9 * scale * lever


@pytest.mark.parametrize("form", FORMS)
def test_a_block_below_its_friction_angle_does_not_move_at_all(form):
    motion = run(block([JointFriction(0, 1, 0.3)], 0.2, 2.0), [0.0, 50.0, 100.0], form=form)
    assert motion.completed and motion.events == () and motion.warnings == ()
    assert (motion.poses[:, 1] == 0.0).all() and (motion.velocities == 0.0).all()
    assert motion.friction.state.tolist() == [[0]] * 3
    assert motion.friction.force[:, 0] == pytest.approx([2.0 * G * math.sin(0.2)] * 3, rel=1e-14)
    assert_complementary(motion)


@pytest.mark.parametrize("form", FORMS)
def test_a_block_that_slides_stops_and_stays(form):
    motion = run(block([JointFriction(0, 1, 0.3)], 0.2), [0.0, 0.1, 0.5, 9.0], rate=1.0, form=form)
    slow = G * (math.sin(0.2) + 0.3 * math.cos(0.2))
    assert kinds(motion) == ["stick"] and motion.events[0].time == pytest.approx(1.0 / slow, rel=1e-14)
    assert motion.poses[1:, 1, 0] == pytest.approx([0.1 - 0.005 * slow, 0.5 / slow, 0.5 / slow], rel=1e-13)
    assert motion.checks.energy < 1e-13
    assert_complementary(motion)


@pytest.mark.parametrize("form", FORMS)
def test_a_block_above_its_friction_angle_turns_back(form):
    motion = run(block([JointFriction(0, 1, 0.1)], 0.2), [0.0, 1.0], rate=1.0, form=form)
    up, down = (G * (math.sin(0.2) + s * 0.1 * math.cos(0.2)) for s in (1.0, -1.0))
    assert kinds(motion) == ["reversal"] and motion.events[0].time == pytest.approx(1.0 / up, rel=1e-14)
    assert motion.poses[1, 1, 0] == pytest.approx(0.5 / up - 0.5 * down * (1.0 - 1.0 / up) ** 2, rel=1e-12)
    assert_complementary(motion)


@pytest.mark.long
@pytest.mark.parametrize(
    ("form", "method"), [*((form, "DOP853") for form in FORMS), ("augmented", "Radau"), ("augmented", "LSODA")]
)
def test_an_oscillator_loses_the_same_at_every_half_swing(form, method):
    """Amplitude falls by 2 mu m g/k a half period, and the mass stops inside the dead band mu m g/k."""
    m, k, mu, x0 = 1.0, 400.0, 0.25, 0.055
    band = mu * m * G / k
    model = block([JointFriction(0, 1, mu), Spring(0, 1, (-1.0, 0.0), (0.0, 0.0), k, 1.0)])
    exact = method == "DOP853"
    motion = run(model, np.linspace(0.0, 5.0, 11), x0, form=form, method=method, rtol=1e-11 if exact else 1e-9)
    half = math.pi / math.sqrt(k / m)
    turns = math.ceil((x0 / band - 1.0) / 2.0)
    # at rest beyond the band at t = 0: it slides at once, and the start is no event
    assert kinds(motion) == [*["reversal"] * (turns - 1), "stick"]
    wanted = half * np.arange(1, turns + 1)
    assert np.abs([e.time for e in motion.events] - wanted).max() < (1e-10 if exact else 1e-7)
    end = (x0 - 2.0 * band * turns) * (-1.0) ** turns
    assert abs(end) < band and motion.poses[-1, 1, 0] == pytest.approx(end, abs=1e-11 if exact else 1e-8)
    assert (np.diff(motion.poses[-3:, 1, 0]) == 0.0).all()
    assert_complementary(motion)


@pytest.mark.parametrize("form", FORMS)
def test_cvode_meets_the_events_of_friction(form):
    pytest.importorskip("sksundae")
    m, k, mu, x0 = 1.0, 400.0, 0.25, 0.055
    model = block([JointFriction(0, 1, mu), Spring(0, 1, (-1.0, 0.0), (0.0, 0.0), k, 1.0)])
    motion = run(model, np.linspace(0.0, 5.0, 11), x0, form=form, method="CVODE", rtol=1e-11)
    assert motion.completed and kinds(motion) == ["reversal"] * 3 + ["stick"] and "sundae" in motion.backend
    assert [e.time for e in motion.events] == pytest.approx(math.pi / 20.0 * np.arange(1, 5), abs=1e-9)
    assert motion.poses[-1, 1, 0] == pytest.approx(x0 - 8.0 * mu * m * G / k, abs=1e-8)
    resting = run(block([JointFriction(0, 1, 0.3)], 0.2), [0.0, 100.0], form=form, method="CVODE")
    assert resting.completed and resting.events == () and (resting.poses[:, 1] == 0.0).all()


def test_cvode_and_the_tribometer_as_a_general_model():
    pytest.importorskip("sksundae")
    known = CASES["B"].event_driven(4.0, estimate=False)
    model, start = general_model(CASES["B"])
    motion = simulate_dynamics(model, [0.0, 4.0], start=start, method="CVODE", rtol=1e-10)
    assert motion.completed and len(motion.events) == len(known.events) > 8
    assert max(abs(a.time - b.time) for a, b in zip(motion.events, known.events)) < 1e-7
    assert motion.poses[-1, 2, 0] == pytest.approx(known.x2[-1], abs=1e-8)


def test_cvode_without_its_package_is_told_before_anything_is_done(monkeypatch):
    monkeypatch.setitem(sys.modules, "sksundae.cvode", None)
    with pytest.raises(MissingExtraError, match=r"method 'CVODE' needs sksundae.*graphsynth\[stiff\]"):
        run(block([JointFriction(0, 1, 0.3)], 0.2), [0.0, 1.0], method="CVODE")  # at rest: no solver would be made


@pytest.mark.parametrize("form", FORMS)
def test_release_by_a_rising_force(form):
    """Rest until the force reaches mu_s N; then mu_k at once: the closed form of the motion after it."""
    static, kinetic, rise = 0.5, 0.3, 10.0
    model = block([JointFriction(0, 1, kinetic, static, stribeck_speed=0.0), Force(1, lambda t, p, v: (rise * t, 0.0))])
    motion = run(model, [0.0, 0.4, 1.0], form=form)
    release = static * G / rise
    assert kinds(motion) == ["slip"] and motion.events[0].time == pytest.approx(release, rel=1e-12)
    tau = 1.0 - release
    assert motion.poses[1, 1, 0] == 0.0
    exact = 0.5 * (static - kinetic) * G * tau**2 + rise * tau**3 / 6.0
    assert motion.poses[2, 1, 0] == pytest.approx(exact, rel=1e-11)
    assert_complementary(motion)


def test_a_pulse_moves_it_and_friction_stops_it():
    force = Torque(0, 1, Pulse(0.1, 0.2, 3.0))
    wheel = Mechanism(MechanismGraph(2, [(0, 1)], frame=0), [Revolute(0, 1)], [Driver(0, 1)])
    mu, r, J = 0.3, 0.1, 0.05
    model = DynamicModel(wheel, {1: Body(1.0, J)}, [JointFriction(0, 1, mu, radius=r), force])
    brake = mu * r * G
    for form in FORMS:
        motion = run(model, [0.0, 0.1, 0.3, 5.0], form=form)
        speed = 0.2 * (3.0 - brake) / J
        assert [e.kind for e in motion.events] == ["break", "slip", "break", "stick"]
        assert [e.time for e in motion.events] == pytest.approx([0.1, 0.1, 0.3, 0.3 + speed * J / brake], rel=1e-12)
        assert motion.poses[:, 1, 2] == pytest.approx([0.0, 0.0, 0.1 * speed, 0.1 * speed + 0.5 * speed**2 * J / brake])
        assert_complementary(motion)


@pytest.mark.parametrize("form", ["augmented", "partitioned"])
def test_two_blocks(form):
    """A block on a block on the ground, pulled at the lower one: at rest, together, apart."""
    mechanism = Mechanism(
        MechanismGraph(3, [(0, 1), (1, 2)], frame=0), [Prismatic(0, 1), Prismatic(1, 2)], pose=((0, 0, 0),) * 3
    )
    m1, m2, ground, between = 2.0, 1.0, 0.2, 0.3
    friction = [JointFriction(0, 1, ground), JointFriction(1, 2, between)]
    for pull, wanted in (
        (5.0, (0.0, 0.0)),
        (10.0, ((10.0 - ground * 3.0 * G) / 3.0,) * 2),
        (30.0, ((30.0 - ground * 3.0 * G - between * G) / m1, between * G)),
    ):
        model = DynamicModel(mechanism, {1: Body(m1, 1.0), 2: Body(m2, 1.0)}, [*friction, Force(1, (pull, 0.0))])
        motion = simulate_dynamics(model, [0.0, 1.0], form=form)
        assert motion.completed and motion.accelerations[0, 1:, 0] == pytest.approx(wanted, rel=1e-13)
        assert motion.poses[1, 1:, 0] == pytest.approx([0.5 * a for a in wanted], rel=1e-11)
        assert_complementary(motion)
    # a force that grows: first both, then the lower one away from under the upper one
    model = DynamicModel(
        mechanism, {1: Body(m1, 1.0), 2: Body(m2, 1.0)}, [*friction, Force(1, lambda t, p, v: (10.0 * t, 0.0))]
    )
    motion = simulate_dynamics(model, [0.0, 1.0, 3.0], form=form)
    first, second = ground * 3.0 * G / 10.0, (ground + between) * 3.0 * G / 10.0
    assert kinds(motion) == ["slip", "slip"]
    assert [e.time for e in motion.events] == pytest.approx([first, second], rel=1e-11)
    assert [e.statement.split(":")[0] for e in motion.events] == ["P 0-1", "P 1-2"]
    assert_complementary(motion)


@pytest.mark.long
def test_a_pendulum_with_a_rough_pin_against_an_own_integration():
    """The pin's load has the weight, the centrifugal force and the friction's own share in it."""
    from scipy.integrate import solve_ivp

    m, J, far, mu, r = 1.0, 0.02, 0.3, 0.4, 0.05
    pendulum = Mechanism(MechanismGraph(2, [(0, 1)], frame=0), [Revolute(0, 1)], [Driver(0, 1)])
    model = DynamicModel(pendulum, {1: Body(m, J, (far, 0.0))}, [JointFriction(0, 1, mu, radius=r)])

    def acceleration(a, w, s):
        """Root of J0 e = -m g l cos a - s mu r |F(e)|."""

        def rest(e):
            fx = m * far * (-e * math.sin(a) - w * w * math.cos(a))
            fy = m * far * (e * math.cos(a) - w * w * math.sin(a)) + m * G
            return (J + m * far**2) * e + m * G * far * math.cos(a) + s * mu * r * math.hypot(fx, fy)

        from scipy.optimize import brentq

        return brentq(rest, -500.0, 500.0, xtol=1e-13)

    state, t, turns, s = [0.0, 0.0], 0.0, [], -1.0
    while True:
        crossing = lambda t, y, s=s: y[1] if t > 0.0 else -s  # noqa: E731
        crossing.terminal, crossing.direction = True, -s
        found = solve_ivp(lambda t, y, s=s: [y[1], acceleration(y[0], y[1], s)], (0.0, 9.0), state, method="DOP853",
                          rtol=1e-11, atol=1e-12, events=crossing, first_step=1e-3)  # fmt: skip
        t += float(found.t[-1])
        turns.append(t)
        state = [float(found.y[0, -1]), 0.0]
        down = acceleration(state[0], 0.0, -s)
        if down * -s <= 0.0:
            break
        s = -s
    for form in FORMS:
        motion = run(model, [0.0, 60.0], form=form)
        assert kinds(motion) == [*["reversal"] * (len(turns) - 1), "stick"]
        assert np.abs(np.array([e.time for e in motion.events]) - turns).max() < 1e-7
        assert motion.poses[-1, 1, 2] == pytest.approx(state[0], abs=1e-8)
        assert_complementary(motion)


@pytest.mark.long
def test_every_joint_of_a_slider_crank_rough():
    """All joints stop together; how they share the friction is said to be open; all forms agree."""
    friction = [JointFriction(a, b, 0.2, radius=0.01) for a, b in ((0, 1), (1, 2), (2, 3))] + [
        JointFriction(0, 3, 0.15)
    ]
    bodies = {1: Body.bar(0.2, (0, 0), (0.1, 0)), 2: Body.bar(0.5, (0, 0), (0.3, 0)), 3: Body(0.8, 1e-3)}
    model = DynamicModel(slider_crank(), bodies, friction)
    runs = [
        simulate_dynamics(model, np.linspace(0.0, 2.0, 21), keep={(0, 1): 0.3}, modes={0: 1}, form=form)
        for form in FORMS
    ]
    for motion in runs:
        assert motion.completed and kinds(motion) == ["reversal", "reversal", "reversal", "stick"]
        assert len(motion.warnings) == 1 and "stick together in a loop" in motion.warnings[0]
        assert np.abs(motion.poses[-1] - runs[0].poses[-1]).max() < 1e-9
        assert np.abs([a.time - b.time for a, b in zip(motion.events, runs[0].events)]).max() < 1e-9
        assert motion.checks.energy < 1e-9 and (motion.velocities[-1] == 0.0).all()
        crank = motion.reactions.between(0, 1)
        assert crank.determined[0, :2].all() and not crank.determined[-1, :2].any()  # sliding; held in a loop
        assert_complementary(motion)


def test_a_rate_that_others_prescribe_changes_sign():
    """The slide is driven there and back; its friction turns with it, and only the driver feels it."""
    law = Polynomial((0.0, 1.0, -0.5))
    model = DynamicModel(SLIDER, {1: Body(1.0, 0.1)}, [JointFriction(0, 1, 0.2)], prescribed=[Driver(0, 1, law)])
    motion = simulate_dynamics(model, [0.0, 0.5, 1.5, 2.0])
    assert kinds(motion) == ["reversal"] and motion.events[0].time == pytest.approx(1.0, rel=1e-13)
    along = motion.reactions.joints[-1].force[:, 0]
    assert along == pytest.approx([-1.0 + 0.2 * G, -1.0 + 0.2 * G, -1.0 - 0.2 * G, -1.0 - 0.2 * G], rel=1e-12)
    assert motion.checks.energy < 1e-12 and motion.checks.power < 1e-12


def test_a_motion_that_starts_after_a_rest():
    """A prescribed rest, then a run: friction begins with the rate."""

    def law(u):
        t = np.maximum(np.asarray(u, dtype=float) - 1.0, 0.0)
        return t**4, 4 * t**3, 12 * t**2

    model = DynamicModel(SLIDER, {1: Body(1.0, 0.1)}, [JointFriction(0, 1, 0.2)], prescribed=[Driver(0, 1, law)])
    motion = simulate_dynamics(model, [0.0, 0.5, 1.5, 2.0], rtol=1e-9)
    assert motion.completed and kinds(motion) == ["slip"]
    assert motion.friction.force[:, 0] == pytest.approx([0.0, 0.0, -0.2 * G, -0.2 * G], rel=1e-12)


CASES = {
    "B": Tribometer(law=TwoCoefficientLaw(0.40, 0.25), drive=HarmonicDrive(0.03, 2.0)),
    "C": Tribometer(),
}


@pytest.mark.long
@pytest.mark.parametrize(("case", "form"), [("B", "augmented"), ("C", "augmented"), ("B", "partitioned")])
def test_the_tribometer_as_a_general_model(case, form):
    """Final state to 1e-10, the same events, their times to 1e-9 s, with a bounded number of right-hand sides."""
    tribometer = CASES[case]
    known = tribometer.event_driven(10.0, estimate=False)
    model, start = general_model(tribometer)
    motion = simulate_dynamics(model, [0.0, 10.0], start=start, form=form)
    assert motion.completed and motion.warnings == ()
    assert (
        abs(motion.poses[-1, 2, 0] - known.x2[-1]) < 1e-10 and abs(motion.velocities[-1, 2, 0] - known.v2[-1]) < 1e-10
    )
    assert len(motion.events) == len(known.events) == 37
    assert max(abs(a.time - b.time) for a, b in zip(motion.events, known.events)) < 1e-9
    assert [e.kind for e in motion.events] == ["stick" if e.state == 0 else "slip" for e in known.events]
    assert motion.evaluations < 20_000


@pytest.mark.long
def test_an_event_storm_is_said():
    """A hard spring on a belt: it is released and caught 3000 times a second."""
    belt = Tribometer(law=TwoCoefficientLaw(0.40, 0.25), damping=0.0, stiffness=1e8, drive=BeltDrive(0.02))
    model, start = general_model(belt)
    motion = simulate_dynamics(model, [0.0, 0.2], start=start, rtol=1e-8)
    assert not motion.completed and "Zeno behaviour" in motion.message and "smoothing_velocity" in motion.message
    assert len(motion.events) >= 64 and {event.kind for event in motion.events} == {"stick", "slip"}


def test_laws_that_no_joint_has_are_refused():
    with pytest.raises(SpecError, match="no general element"):
        general_model(Tribometer(law=TwoCoefficientLaw(0.4, 0.25, viscous=0.1)))


def test_laws_of_friction_are_checked():
    with pytest.raises(GeometryError, match="falls at once"):
        JointFriction(0, 1, 0.2, 0.3, stribeck_speed=0.0, smoothing_velocity=1e-3)
    with pytest.raises(GeometryError, match="must be zero or more"):
        JointFriction(0, 1, 0.2, smoothing_velocity=-1.0)
    assert JointFriction(0, 1, 0.2).smoothing_velocity == 0.0


@pytest.mark.long
@pytest.mark.parametrize("form", ["augmented", "partitioned"])
@settings(max_examples=6, deadline=None)
@given(st.data())
def test_states_of_random_chains_satisfy_the_conditions_of_friction(form, data):
    """Two sliding or turning joints in a row, rough, pulled by constant loads, from rest or in motion."""
    draw = lambda low, high: data.draw(st.floats(low, high).map(lambda x: round(x, 3)))  # noqa: E731
    types = data.draw(st.tuples(*[st.sampled_from("PR")] * 2))
    joints = [
        Prismatic(k, k + 1, (draw(-0.3, 0.3), 0.1), (0.0, 0.05), draw(-1.0, 1.0)) if kind == "P"
        else Revolute(k, k + 1, (draw(0.1, 0.5), 0.0), (draw(-0.2, 0.2), 0.0))
        for k, kind in enumerate(types)
    ]  # fmt: skip
    assume(joints[0].at_b != joints[1].at_a)  # a link between two turning joints has a length
    mechanism = Mechanism(
        MechanismGraph(3, [(0, 1), (1, 2)], frame=0), joints, pose=((0, 0, 0), (0.1, 0.2, 0.3), (0.2, 0.1, -0.2))
    )
    friction = [
        JointFriction(k, k + 1, draw(0.05, 0.3), draw(0.3, 0.4), length=data.draw(st.sampled_from([0.0, 0.5])),
                      stribeck_speed=data.draw(st.sampled_from([0.0, 0.1])))
        if kind == "P"
        else JointFriction(k, k + 1, draw(0.05, 0.4), radius=draw(0.005, 0.05))
        for k, kind in enumerate(types)
    ]  # fmt: skip
    model = DynamicModel(
        mechanism, {1: Body(draw(0.5, 2.0), 0.2, (0.1, 0.0)), 2: Body(draw(0.5, 2.0), 0.1, (0.2, 0.0))},
        [*friction, Force(2, (draw(-9.0, 9.0), draw(-9.0, 9.0)), (0.3, 0.0))],
    )  # fmt: skip
    rates = {(0, 1): data.draw(st.sampled_from([0.0, 1.0])), (1, 2): data.draw(st.sampled_from([0.0, -1.0]))}
    motion = simulate_dynamics(model, np.linspace(0.0, 0.6, 13), keep_rates=rates, form=form, rtol=1e-9)
    if not motion.completed:
        assert motion.start.status != "consistent" or ("jams" in motion.message and motion.checks.contraction > 0.9)
        return
    assert_complementary(motion)
    assert motion.checks.energy < 1e-6


def test_a_pulley_law_is_linear():
    """A slide driven at constant rate needs the same force all the time."""
    model = DynamicModel(
        SLIDER, {1: Body(1.0, 0.1)}, [JointFriction(0, 1, 0.1, 0.3, stribeck_speed=0.5)],
        prescribed=[Driver(0, 1, Linear(0.25))],
    )  # fmt: skip
    motion = simulate_dynamics(model, [0.0, 1.0])
    mu = 0.1 + 0.2 * math.exp(-0.25)
    assert motion.reactions.joints[-1].force[:, 0] == pytest.approx([mu * G] * 2, rel=1e-13)


@pytest.mark.long
def test_links_without_mass():
    """The rod and the turning of the slide weigh nothing: the limit of light ones, through dead centres and to rest."""
    friction = [JointFriction(0, 3, 0.2), JointFriction(0, 1, 0.2, radius=0.01)]
    none, light = (
        simulate_dynamics(
            DynamicModel(slider_crank(), {1: Body(0.2, 1e-3), 2: Body(m, 0.01 * m), 3: Body(0.8, m)}, friction),
            np.linspace(0.0, 1.0, 6), keep={(0, 1): 0.5}, keep_rates={(0, 1): 20.0}, modes={0: 1},
            form="one-coordinate",
        )
        for m in (0.0, 1e-8)
    )  # fmt: skip
    assert none.completed and kinds(none) == kinds(light) == ["reversal", "reversal", "stick"]
    assert np.abs(none.poses - light.poses).max() < 1e-6
    assert_complementary(none)


@pytest.mark.parametrize("form", ["augmented", "partitioned"])
def test_a_block_stays_once_the_one_on_it_slides(form):
    """Under its static friction the upper block would take the lower one along; sliding, it no longer does."""
    mechanism = Mechanism(
        MechanismGraph(3, [(0, 1), (1, 2)], frame=0), [Prismatic(0, 1), Prismatic(1, 2)], pose=((0, 0, 0),) * 3
    )
    friction = [JointFriction(0, 1, 0.2), JointFriction(1, 2, 0.1, 0.6, stribeck_speed=0.0)]
    model = DynamicModel(mechanism, {1: Body(1.0, 1.0), 2: Body(1.0, 1.0)}, [*friction, Force(2, (20.0, 0.0))])
    motion = simulate_dynamics(model, [0.0, 1.0], form=form)
    assert motion.completed and motion.friction.state.tolist() == [[0, 1]] * 2
    assert motion.poses[1, 1:, 0] == pytest.approx([0.0, 0.5 * (20.0 - 0.1 * G)], rel=1e-12)
    assert_complementary(motion)
