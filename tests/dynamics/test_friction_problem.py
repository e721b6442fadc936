"""The friction problem at one state: exact solutions, none and several said, redundant reactions refused."""

from __future__ import annotations

from itertools import product

import mpmath as mp
import numpy as np
import pytest
from dynamic_models import slider_crank

from graphsynth.core.errors import GeometryError
from graphsynth.dynamics import Body, DynamicModel, Force, JointFriction, Torque, consistent_start, simulate_dynamics
from graphsynth.dynamics.friction.loads import FrictionRows
from graphsynth.dynamics.friction.problem import FrictionProblem
from graphsynth.dynamics.tables import compile_model
from graphsynth.mechanism.joints import Prismatic, Revolute
from graphsynth.mechanism.laws import Driver
from graphsynth.mechanism.model import Mechanism
from graphsynth.structure.graph import MechanismGraph

G = 9.81
SLIDER = Mechanism(MechanismGraph(2, [(0, 1)], frame=0), [Prismatic(0, 1)], [Driver(0, 1)])


def some(few, many):
    """Return seeds: a few always, the others with the slow tests."""
    return [*range(few), *(pytest.param(seed, marks=pytest.mark.slow) for seed in range(few, many))]


def shoe(r, push, **law):
    """A shoe whose centre of mass lies so far from the guide that loads return with the factor r."""
    elements = [JointFriction(0, 1, 0.3, length=0.1, **law), Force(1, (push, 0.0))]
    return DynamicModel(SLIDER, {1: Body(1.0, 0.01, (0.0, r * 0.1 / 0.6))}, elements, gravity=(0.0, 0.0))


def problem_of(model, q, v):
    rows = FrictionRows(compile_model(model))
    return FrictionProblem(rows, 0.0, np.asarray(q, float), np.asarray(v, float), np.zeros(1))


@pytest.mark.parametrize("law", [{}, {"smoothing_velocity": 1e-6}])
@pytest.mark.parametrize("r", [0.5, 0.87, 0.999, 1.01, 2.0, 1e6])
@pytest.mark.parametrize("push", [1.0, -1.0])
def test_a_shoe_with_a_lever(r, push, law):
    """``a + r |a| = F/m``: the only motion is found for every r < 1; beyond there are two, or none."""
    start = consistent_start(shoe(r, push, **law), keep={(0, 1): 0.0}, keep_rates={(0, 1): 1.0})
    motion = simulate_dynamics(start.model, [0.0, 1e-4], start=start)
    if r < 1.0:
        assert start.consistent and motion.completed
        assert start.accelerations[1, 0] == pytest.approx(push / (1.0 + push * r), rel=1e-9)
        assert motion.checks.contraction == pytest.approx(r, rel=1e-9)
    elif push > 0.0:
        assert start.status == "friction: several" and np.isnan(start.a).all()
        for text in ("2 motions", "P 0-1", f"{1 / (1 + r):.4g}", f"{1 / (1 - r):.4g}", "reduce the friction"):
            assert text in start.message
    else:
        assert start.status == "friction: none" and "no motion" in start.message and "P 0-1" in start.message
    if r > 1.0:
        assert not start.consistent and motion.status == "failed" and start.message in motion.message
        assert np.isnan(motion.accelerations[:, 1]).all()


@pytest.mark.parametrize("at", [0.02, 0.2, 2.0])
def test_a_second_guide_is_refused_with_the_joints_named(at):
    model = DynamicModel(
        SLIDER, {1: Body(1.0, 0.01)}, [JointFriction(0, 1, 0.3)], additional=[Prismatic(0, 1, (0, 0), (at, 0.0))]
    )
    start = consistent_start(model, keep={(0, 1): 0.0}, keep_rates={(0, 1): 1.0})
    assert start.status == "friction: undetermined"
    assert "joint P 0-1" in start.message and "additional 1: P 0-1" in start.message
    for form in ("augmented", "partitioned"):
        motion = simulate_dynamics(model, [0.0, 0.1], start=start, form=form)
        assert motion.status == "failed" and start.message in motion.message


def test_friction_that_needs_no_open_reaction_goes_on():
    """The guides share their force in open proportions; the pin of the crank does not care."""
    bodies = {1: Body.bar(0.2, (0, 0), (0.1, 0)), 2: Body.bar(0.5, (0, 0), (0.3, 0)), 3: Body(0.8, 1e-3)}
    friction = [JointFriction(1, 2, 0.3, radius=0.01)]
    twice = DynamicModel(slider_crank(), bodies, friction, additional=[Prismatic(0, 3, (0.0, 0.02))])
    once = DynamicModel(slider_crank(), bodies, friction)
    state = {"keep": {(0, 1): 0.5}, "keep_rates": {(0, 1): 5.0}, "modes": {0: 1}}
    one, two = (simulate_dynamics(model, [0.0, 0.2], form="augmented", **state) for model in (once, twice))
    assert two.completed and two.start.pose_class == "redundant"
    assert np.abs(one.poses - two.poses).max() < 1e-9 and np.abs(one.friction.load - two.friction.load).max() < 1e-9
    with_guide = DynamicModel(
        slider_crank(), bodies, [*friction, JointFriction(0, 3, 0.1)], additional=[Prismatic(0, 3, (0.0, 0.02))]
    )
    refused = consistent_start(with_guide, **state)
    assert refused.status == "friction: undetermined" and "joint P 0-3" in refused.message
    assert "R 1-2" not in refused.message


def rod_angle(theta):
    return float(mp.asin((mp.mpf("0.02") - mp.mpf("0.1") * mp.sin(mp.mpf(theta))) / mp.mpf("0.3")))


def slider_crank_exact(theta, omega, mu, torque):
    """Accelerations of an offset slider-crank with a rough guide, from Newton and Euler in 50 digits, for both signs
    of the normal force; those that fit.

    Unknown: accelerations of crank, rod and slider, forces in three pins, the guide's force.
    """
    mp.mp.dps = 50
    r, rod, e, m1, m2, m3 = map(mp.mpf, ("0.1", "0.3", "0.02", "0.2", "0.5", "0.8"))
    g, th, w = mp.mpf("9.81"), mp.mpf(theta), mp.mpf(omega)
    s = (e - r * mp.sin(th)) / rod
    ps = mp.asin(s)
    ps1 = -r * mp.cos(th) * w / (rod * mp.cos(ps))
    x1 = -r * mp.sin(th) * w - rod * mp.sin(ps) * ps1
    found = []
    for sign in (1, -1):
        # unknowns: al, ps2, x2, A(2), B(2), C(2), N ; A on the crank from the frame, B on the rod, C on the slider
        M, b = mp.zeros(10, 10), mp.zeros(10, 1)
        # crank: centre r/2
        c, sn = mp.cos(th), mp.sin(th)
        M[0, 0], M[0, 3], M[0, 5] = -m1 * r / 2 * sn, -1, 1
        b[0] = m1 * r / 2 * c * w**2
        M[1, 0], M[1, 4], M[1, 6] = m1 * r / 2 * c, -1, 1
        b[1] = m1 * r / 2 * sn * w**2 - m1 * g
        M[2, 0] = m1 * r**2 / 3
        M[2, 5], M[2, 6] = -r * sn, r * c
        b[2] = mp.mpf(torque) - m1 * g * r / 2 * c
        # rod
        cp, sp = mp.cos(ps), mp.sin(ps)
        M[3, 0], M[3, 1], M[3, 5], M[3, 7] = -m2 * r * sn, -m2 * rod / 2 * sp, -1, 1
        b[3] = m2 * (r * c * w**2 + rod / 2 * cp * ps1**2)
        M[4, 0], M[4, 1], M[4, 6], M[4, 8] = m2 * r * c, m2 * rod / 2 * cp, -1, 1
        b[4] = m2 * (r * sn * w**2 + rod / 2 * sp * ps1**2) - m2 * g
        M[5, 1] = m2 * rod**2 / 12
        M[5, 5], M[5, 6] = -rod / 2 * sp, rod / 2 * cp
        M[5, 7], M[5, 8] = -rod / 2 * sp, rod / 2 * cp
        # slider
        way = 1 if x1 > 0 else -1
        M[6, 2], M[6, 7], M[6, 9] = m3, -1, way * mp.mpf(mu) * sign
        M[7, 8], M[7, 9] = -1, -1
        b[7] = -m3 * g
        # kinematics
        M[8, 0], M[8, 1] = r * c, rod * cp
        b[8] = r * sn * w**2 + rod * sp * ps1**2
        M[9, 0], M[9, 1], M[9, 2] = -r * sn, -rod * sp, -1
        b[9] = r * c * w**2 + rod * cp * ps1**2
        x = mp.lu_solve(M, b)
        if sign * x[9] >= 0:
            found.append((x[0], x[1], x[2], abs(x[9])))
    return found


@pytest.mark.long
@pytest.mark.parametrize("mu", [0.1, 0.5, 2.0, 5.0])
def test_a_slider_crank_against_fifty_digits(mu):
    bodies = {1: Body.bar(0.2, (0, 0), (0.1, 0)), 2: Body.bar(0.5, (0, 0), (0.3, 0)), 3: Body(0.8, 1e-3)}
    counts = set()
    for theta, omega, torque in product((0.4, 2.7, 4.2), (3.0, -8.0), (0.0, -4.0)):
        model = DynamicModel(slider_crank(), bodies, [JointFriction(0, 3, mu), Torque(0, 1, torque)])
        start = consistent_start(model, keep={(0, 1): theta}, keep_rates={(0, 1): omega}, modes={0: 1})
        exact = slider_crank_exact(theta, omega, mu, torque)
        if abs(start.poses[2, 2] - rod_angle(theta)) > 1e-9:
            start = consistent_start(model, keep={(0, 1): theta}, keep_rates={(0, 1): omega}, modes={0: -1})
        counts.add(len(exact))
        if len(exact) == 1:
            assert start.consistent
            own = start.accelerations[[1, 2, 3], [2, 2, 0]]
            wanted = np.array([float(part) for part in exact[0][:3]])
            assert np.abs(own - wanted).max() < 1e-11 * np.abs(wanted).max()
        else:
            assert start.status == ("friction: several" if exact else "friction: none")
    assert counts == {1} if mu < 1.0 else counts >= {1}


def exact_count(problem):
    """Solutions of a problem with guides only, by brute force in 40 digits: every state, every sign at every end.

    A guide with a shoe has two normal forces, each with a sign of its own.
    """
    mp.mp.dps = 40
    k = len(problem.elements)
    resting = set(problem.resting)
    A, b = mp.matrix(problem.A.tolist()), mp.matrix(problem.b.tolist())
    B, lam0 = mp.matrix(problem._part.B.tolist()), mp.matrix(problem._part.lam0.tolist())
    found = []
    for states in product(*[(0, 1, -1) if f in resting else (int(np.sign(problem.rates[f])),) for f in range(k)]):
        for signs in product((1, -1), repeat=2 * k):
            M, right = mp.eye(k), mp.zeros(k, 1)
            rows = []
            for e in problem.elements:
                for end in range(2):  # N_end as a row over lam
                    row = mp.zeros(1, len(lam0))
                    row[e.row] = mp.mpf(1) / 2
                    if e.length > 0.0:
                        row[e.row + 1] = (1 - 2 * end) / mp.mpf(e.length)
                    rows.append(row)
            for f, e in enumerate(problem.elements):
                if states[f] == 0:
                    for g in range(k):
                        M[f, g] = A[f, g]
                    right[f] = -b[f]
                else:
                    mu = mp.mpf(e.static if f in resting else e.coefficient(problem.speeds[f]))
                    load = signs[2 * f] * rows[2 * f] + signs[2 * f + 1] * rows[2 * f + 1]
                    for g in range(k):
                        M[f, g] += states[f] * mu * (load * B)[g]
                    right[f] = -states[f] * mu * (load * lam0)[0]
            phi = mp.lu_solve(M, right)
            lam, udot = lam0 + B * phi, b + A * phi
            normal = [(row * lam)[0] for row in rows]
            loads = [abs(normal[2 * f]) + abs(normal[2 * f + 1]) for f in range(k)]
            tiny = mp.mpf(10) ** -12
            fits = all(
                (states[f] == 0 and abs(phi[f]) <= e.static * loads[f])
                or (states[f] != 0 and all(signs[j] * normal[j] >= -tiny for j in (2 * f, 2 * f + 1))
                    and (f not in resting or states[f] * udot[f] > 0))
                for f, e in enumerate(problem.elements)
            )  # fmt: skip
            if fits and not any(
                max(abs(phi[f] - other[f]) for f in range(k)) < 1e-9 * (1 + max(map(abs, phi))) for other in found
            ):
                found.append(phi)
    return found


@pytest.mark.parametrize("seed", some(10, 60))
def test_guides_against_brute_force(seed):
    """Two guides in a row, random data, friction up to far beyond the factor 1: the same solutions, all of them."""
    rng = np.random.default_rng(seed)
    mechanism = Mechanism(
        MechanismGraph(3, [(0, 1), (1, 2)], frame=0),
        [Prismatic(0, 1, (0.0, 0.0), tuple(rng.uniform(-0.2, 0.2, 2))),
         Prismatic(1, 2, tuple(rng.uniform(-0.2, 0.2, 2)), tuple(rng.uniform(-0.2, 0.2, 2)), rng.uniform(-1.5, 1.5))],
        pose=((0, 0, 0),) * 3,
    )  # fmt: skip
    top = rng.choice([0.3, 1.0, 4.0])
    friction = [JointFriction(k, k + 1, rng.uniform(0.1, top), length=rng.choice([0.0, 0.1, 0.4])) for k in (0, 1)]
    bodies = {k: Body(rng.uniform(0.3, 2.0), 0.05, tuple(rng.uniform(-0.3, 0.3, 2))) for k in (1, 2)}
    model = DynamicModel(mechanism, bodies, [*friction, Force(2, tuple(rng.uniform(-20.0, 20.0, 2)), (0.1, 0.2))])
    rates = {(0, 1): float(rng.choice([0.0, 1.0, -1.0])), (1, 2): float(rng.choice([0.0, 1.0, -1.0]))}
    start = consistent_start(model, keep_rates=rates)
    problem = problem_of(model, start.q, start.v)
    wanted = exact_count(problem)
    own, known = problem.solutions(problem.moving(), problem.resting)
    assert known and len(own) == len(wanted)
    for fit in own:
        assert min(max(abs(float(a) - b) for a, b in zip(other, fit.forces)) for other in wanted) < 1e-9 * (
            1.0 + np.abs(fit.forces).max()
        )
    assert start.status == {0: "friction: none", 1: "consistent"}.get(len(wanted), "friction: several")


@pytest.mark.parametrize("seed", some(6, 40))
def test_pins_against_many_starts(seed):
    """Two rough pins: every solution of the loads that Newton's method finds from 150 starts is among those found."""
    from scipy.optimize import fsolve

    rng = np.random.default_rng(100 + seed)
    mechanism = Mechanism(
        MechanismGraph(3, [(0, 1), (1, 2)], frame=0),
        [Revolute(0, 1), Revolute(1, 2, (0.3, 0.0), tuple(rng.uniform(-0.1, 0.1, 2)))],
        pose=((0, 0, 0), (0, 0, 0.3), (0, 0, 0)),
    )  # fmt: skip
    mu = rng.choice([0.3, 3.0, 20.0])
    friction = [JointFriction(k, k + 1, rng.uniform(0.1, mu), radius=rng.uniform(0.02, 0.15)) for k in (0, 1)]
    bodies = {k: Body(rng.uniform(0.3, 2.0), 0.01, tuple(rng.uniform(-0.3, 0.3, 2))) for k in (1, 2)}
    model = DynamicModel(mechanism, bodies, [*friction, Force(2, tuple(rng.uniform(-20.0, 20.0, 2)), (0.1, 0.2))])
    start = consistent_start(model, keep_rates={(0, 1): 2.0, (1, 2): float(rng.choice([-3.0, 3.0]))})
    problem = problem_of(model, start.q, start.v)
    own, known = problem.solutions(problem.moving(), problem.resting)
    ratio = np.array([-np.sign(u) * e.static * e.lever for u, e in zip(problem.rates, problem.elements)])

    def rest(x):
        lam = problem._part.lam0 + problem._part.B @ (ratio * x)
        return x - [e.load(lam) for e in problem.elements]

    found = []
    for _ in range(150):
        x, _, flag, _ = fsolve(rest, rng.exponential(50.0, 2) * rng.choice([1.0, 10.0]), full_output=True, xtol=1e-13)
        good = flag == 1 and x.min() >= 0.0 and np.abs(rest(x)).max() < 1e-8 * x.max()
        if good and not any(np.abs(x - y).max() < 1e-6 * x.max() for y in found):
            found.append(x)
    assert known and len(own) == len(found)
    for x in found:
        assert min(np.abs(x - fit.loads).max() for fit in own) < 1e-7 * x.max()


def test_too_many_joints_at_rest_are_refused():
    """Nine slides in a row: 3^9 states are not tried."""
    n = 9
    graph = MechanismGraph(n + 1, [(k, k + 1) for k in range(n)], frame=0)
    joints = [Prismatic(k, k + 1, angle_a=0.3 * (k % 3), angle_b=0.3 * (k % 3)) for k in range(n)]
    model = DynamicModel(
        Mechanism(graph, joints, pose=((0, 0, 0),) * (n + 1)), {k: Body(1.0, 0.1) for k in range(1, n + 1)},
        [JointFriction(k, k + 1, 0.5) for k in range(n)],
    )  # fmt: skip
    start = consistent_start(model)
    assert start.status == "friction: not decided" and "at most 7" in start.message


def test_a_refused_start_is_no_start_of_another_model():
    start = consistent_start(shoe(2.0, 1.0), keep={(0, 1): 0.0}, keep_rates={(0, 1): 1.0})
    with pytest.raises(GeometryError, match="another bodies"):
        simulate_dynamics(shoe(1.5, 1.0), [0.0, 1.0], start=start)


def pushed_slider(mu, **changes):
    """A slide driven at constant speed, with a centre of mass beside it and a shoe."""
    return DynamicModel(
        SLIDER, {1: Body(1.0, 0.01)}, [JointFriction(0, 1, mu), Force(1, (0.0, -5.0))], gravity=(0.0, 0.0), **changes
    )


def test_inverse_dynamics_solves_the_friction_problem():
    """A slider-crank at constant speed: under the torque found it keeps it; factors above 1 are said."""
    from graphsynth.dynamics import inverse_dynamics
    from graphsynth.kinematics import simulate

    slide = simulate(SLIDER, [0.0, 1.0])
    assert inverse_dynamics(pushed_slider(0.3), slide, speed=2.0).efforts.ravel() == pytest.approx(
        [1.5, 1.5], rel=1e-13
    )
    bodies = {1: Body.bar(0.2, (0, 0), (0.1, 0)), 2: Body.bar(0.5, (0, 0), (0.3, 0)), 3: Body(0.8, 1e-3)}
    turn = simulate(slider_crank(), np.linspace(0.1, 6.2, 9), modes={0: 1})
    for mu in (0.3, 0.9, 1.5):
        model = DynamicModel(slider_crank(), bodies, [JointFriction(0, 3, mu)])
        found = inverse_dynamics(model, turn, speed=5.0)
        for k, (theta, torque) in enumerate(zip(found.inputs, found.efforts[:, 0])):
            exact = slider_crank_exact(theta, 5.0, mu, torque)  # this torque leaves the crank without acceleration
            assert min(abs(float(one[0])) for one in exact) < 1e-9 * (1.0 + abs(torque)), k
        assert found.power_error < 1e-12
    with pytest.raises(GeometryError, match="loads fit the friction in P 0-3"):
        inverse_dynamics(DynamicModel(slider_crank(), bodies, [JointFriction(0, 3, 20.0)]), turn, speed=5.0)
    twice = pushed_slider(0.3, additional=[Prismatic(0, 1, (0, 0), (0.2, 0.0))])
    with pytest.raises(GeometryError, match="not determined: P 0-1, additional 1: P 0-1"):
        inverse_dynamics(twice, slide, speed=2.0)


@pytest.mark.parametrize("push", [0.0, 2.0, 3.5, 5.0, -9.0])
def test_sticking_found_by_following_the_friction(push):
    """Following the friction from limit to limit finds the sticking that the equations give, or none."""
    mechanism = Mechanism(
        MechanismGraph(3, [(0, 1), (1, 2)], frame=0),
        [Prismatic(0, 1), Prismatic(1, 2, angle_a=0.3, angle_b=0.3)], pose=((0, 0, 0), (0, 0, 0), (0, 0, 0)),
    )  # fmt: skip
    friction = [JointFriction(0, 1, 0.2), JointFriction(1, 2, 0.4)]
    model = DynamicModel(mechanism, {1: Body(2.0, 1.0), 2: Body(1.0, 1.0)}, [*friction, Force(2, (push, 0.0))])
    start = consistent_start(model, keep_rates={(0, 1): 1.0, (1, 2): 0.0})
    problem = problem_of(model, start.q, start.v)
    assert problem.resting == [1] and problem.factor() < 1.0
    one, two = problem._of({0: 1}, [1], set())[0], problem._followed({0: 1}, 1, set())
    assert len(one) == len(two)
    for a, b in zip(one, two):
        assert np.abs(a.forces - b.forces).max() < 1e-11 and a.senses == b.senses
