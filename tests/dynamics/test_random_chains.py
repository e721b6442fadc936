"""Mechanisms of the enumerator with random dimensions, masses and loads: formulations agree, or the result says why."""

from functools import cache
from itertools import islice

import mpmath
import numpy as np
import pytest

import graphsynth
from graphsynth.dynamics import Body, DynamicModel, Spring, Torque, TorsionSpring, consistent_start, simulate_dynamics
from graphsynth.mechanism.joints import Revolute
from graphsynth.mechanism.laws import Driver
from graphsynth.mechanism.model import Mechanism
from graphsynth.structure.graph import MechanismGraph


@cache
def chains(links):
    return tuple(islice(graphsynth.enumerate_chains(links), 20))


def random_model(links, seed):
    """All link frames coincide at the start, so any points make a mechanism that is assembled there."""
    rng = np.random.default_rng(1000 * links + seed)
    chain = chains(links)[seed % len(chains(links))]
    edges = [tuple(edge[:2]) for edge in chain.joints]
    points = {edge: tuple(rng.uniform(-1.0, 1.0, 2)) for edge in edges}
    base = edges[0][0]
    driver = next(edge for edge in edges if base in edge)
    other = driver[0] if driver[1] == base else driver[1]
    mechanism = Mechanism(
        MechanismGraph(links, edges, frame=base), [Revolute(*edge, points[edge], points[edge]) for edge in edges],
        [Driver(base, other)], pose=((0.0, 0.0, 0.0),) * links,
    )  # fmt: skip
    moving = [link for link in range(links) if link != base]
    bodies = {k: Body(rng.uniform(0.2, 3.0), rng.uniform(0.01, 0.3), tuple(rng.uniform(-1.0, 1.0, 2))) for k in moving}
    elements = [
        Spring(base, moving[-1], tuple(rng.uniform(-1.0, 1.0, 2)), tuple(rng.uniform(1.5, 2.0, 2)), 20.0, 0.3, 0.4),
        TorsionSpring(moving[0], moving[-1], 2.0, 0.1, 0.05), Torque(base, other, 0.7),
    ]  # fmt: skip
    model = DynamicModel(mechanism, bodies, elements)
    return model, consistent_start(model, keep_rates={(base, other): rng.uniform(-2.0, 2.0)}), points, (base, other)


def exact_reactions(model, start, points):
    """Force on link b in every joint: the KKT system written anew from Newton's law, with 50 digits."""
    frame, moving = model.mechanism.frame, list(model.bodies)
    n, m = 3 * len(moving), 2 * len(model.mechanism.joints)
    with mpmath.workdps(50):
        K, right = mpmath.zeros(n + m), mpmath.zeros(n + m, 1)
        centre = {k: mpmath.matrix(body.centre) for k, body in model.bodies.items()}
        spin = {k: mpmath.mpf(float(start.velocities[k, 2])) for k in moving}
        at = {k: 3 * i for i, k in enumerate(moving)}
        for k, body in model.bodies.items():
            K[at[k], at[k]] = K[at[k] + 1, at[k] + 1] = body.mass
            K[at[k] + 2, at[k] + 2] = body.inertia
            right[at[k] + 1] += body.mass * mpmath.mpf(model.gravity[1])

        def velocity(k, p):
            if k == frame:
                return mpmath.matrix([0, 0])
            vx, vy = (mpmath.mpf(float(v)) for v in start.velocities[k, :2])
            return mpmath.matrix([vx - spin[k] * p[1], vy + spin[k] * p[0]])

        def push(k, p, force):
            if k != frame:
                arm = p - centre[k]
                right[at[k]] += force[0]
                right[at[k] + 1] += force[1]
                right[at[k] + 2] += arm[0] * force[1] - arm[1] * force[0]

        spring, torsion, torque = model.elements
        pa, pb = mpmath.matrix(spring.at_a), mpmath.matrix(spring.at_b)
        apart = pb - pa
        length = mpmath.sqrt(apart[0] ** 2 + apart[1] ** 2)
        unit = apart / length
        drift = velocity(spring.b, pb) - velocity(spring.a, pa)
        pull = spring.stiffness * (length - mpmath.mpf(spring.free_length))
        pull += mpmath.mpf(spring.damping) * (unit[0] * drift[0] + unit[1] * drift[1])
        push(spring.a, pa, unit * pull)
        push(spring.b, pb, -unit * pull)
        twist = mpmath.mpf(torsion.stiffness) * (0 - mpmath.mpf(torsion.free_angle))
        twist += mpmath.mpf(torsion.damping) * (spin[torsion.b] - spin[torsion.a])
        right[at[torsion.a] + 2] += twist
        right[at[torsion.b] + 2] -= twist
        right[at[torque.b] + 2] += mpmath.mpf(torque.torque)
        for j, joint in enumerate(model.mechanism.joints):
            p = mpmath.matrix(points[(joint.a, joint.b)])
            for k, sign in ((joint.a, -1), (joint.b, 1)):
                if k == frame:
                    continue
                arm, row = p - centre[k], n + 2 * j
                for axis, lever in ((0, -arm[1]), (1, arm[0])):
                    # the unknown is the force on b: the balance of the bodies and, transposed, the pin's acceleration
                    K[at[k] + axis, row + axis] -= sign
                    K[at[k] + 2, row + axis] -= sign * lever
                    K[row + axis, at[k] + axis] += sign
                    K[row + axis, at[k] + 2] += sign * lever
                    right[row + axis] += sign * spin[k] ** 2 * arm[axis]
        found = mpmath.lu_solve(K, right)
        return np.array([[float(found[n + 2 * j + axis]) for axis in (0, 1)] for j in range(m // 2)])


@pytest.mark.slow
def test_automatic_form_goes_on_where_the_engine_does_not_start():
    model, start, _, _ = random_model(8, 8)
    motion = simulate_dynamics(model, [0.0, 0.01], start=start)
    assert motion.completed
    assert motion.form == "one-coordinate" or "augmented form used" in motion.events[0].statement


CASES = [*((6, seed) for seed in range(4)), *((8, seed) for seed in range(8))]


@pytest.mark.long
@pytest.mark.parametrize(("links", "seed"), CASES)
def test_reactions_against_fifty_digits(links, seed):
    model, start, points, _ = random_model(links, seed)
    assert start.consistent and start.pose_class == "regular" and start.freedom == 1
    motion = simulate_dynamics(model, [0.0], start=start, form="augmented")
    exact = exact_reactions(model, start, points)
    found = np.array([motion.reactions.between(j.a, j.b).force[0] for j in model.mechanism.joints])
    assert np.abs(found - exact).max() < 1e-12 * np.abs(exact).max() * max(1.0, 0.1 * start.condition)
    assert motion.checks.newton_euler < 1e-12 * max(1.0, 0.1 * start.condition)


@pytest.mark.long
@pytest.mark.parametrize(("links", "seed"), CASES)
def test_forms_agree_or_say_why(links, seed):
    """Random mechanisms soon meet folds and near-singular poses: what is returned agrees, or is a failure."""
    model, start, _, _ = random_model(links, seed)
    times = np.linspace(0.0, 0.3, 7)
    runs = [
        simulate_dynamics(model, times, start=start, form=form)
        for form in ("augmented", "partitioned", "one-coordinate")
    ]
    for run in runs:
        reached = np.isfinite(run.q).all(axis=1)
        assert run.completed == reached.all() and (run.completed or (run.message and run.reached < times[-1]))
        if run.completed:
            assert run.checks.energy <= 1e-9 or run.warnings
    first = runs[0]
    for other in runs[1:]:
        both = np.isfinite(first.q).all(axis=1) & np.isfinite(other.q).all(axis=1)
        assert both[0]
        if not (first.warnings or other.warnings):
            assert np.abs(first.q - other.q)[both].max() < 1e-7
