"""Links as bodies: derivatives, enclosures, and a Lagrangian that is below zero wherever the mechanism closes."""

import math
from dataclasses import replace

import numpy as np
import pytest
from coupled_oracles import four_bar
from space_oracles import case, joint_limits

from graphsynth import simulate
from graphsynth.intervals.balls import Balls, exact
from graphsynth.jamming.joints import RIGID, JointLimits, Misalignment
from graphsynth.jamming.joints.program import problem
from graphsynth.jamming.space.binding import (
    Multipliers,
    at,
    binds,
    body_box,
    contract,
    coordinates,
    hessian,
    limits_of,
    lower_bounds,
    multipliers,
    pair_slopes,
    weighed_pairs,
)
from graphsynth.jamming.space.bodies import Bodies, stands_apart
from graphsynth.jamming.space.closure import Closure
from graphsynth.jamming.space.model import SpaceModel
from graphsynth.jamming.space.optimum import least_scale
from graphsynth.jamming.space.plane import in_space, start
from graphsynth.jamming.space.proof import Box


def posed(limits, tilt, u=0.7):
    mechanism = four_bar(2.0, 1.0, 2.5, 2.5)
    model = in_space(problem(mechanism, limits, tilt))
    return model, start(model, mechanism, simulate(mechanism, [u, u + 0.01]).poses[0])


def models():
    """A tilted motor that is rigid, or tilts and shifts; a misaligned joint between moving links; a rigid rocker."""
    loose, shifting = JointLimits(0.1, 0.05), JointLimits(0.1, 0.05, radial_clearance=0.01)
    model, q = posed(loose, Misalignment(0, 1, 0.1, 0.3))
    yield model, q
    joints = [replace(j, limits=shifting) for j in model.joints]
    model = SpaceModel(tuple(joints), 4)
    mechanism = four_bar(2.0, 1.0, 2.5, 2.5)
    yield model, start(model, mechanism, simulate(mechanism, [0.7, 0.71]).poses[0])
    yield posed(loose, [Misalignment(0, 1, 0.05, 0.3), Misalignment(2, 3, 0.08, 1.3)])
    yield posed({(0, 1): RIGID, (1, 2): loose, (2, 3): loose, (0, 3): RIGID}, Misalignment(0, 1, 0.1, 0.3))


def whole(bodies, u, by, pairs):
    """Value, gradient and second derivatives of by . V + pairs, middles."""
    here = at(bodies, exact(u[None]))
    own = [(weight, pair_slopes(here, pair)) for pair, weight in pairs]
    value = by @ here.V.mid[0] + sum(w * v.mid[0] for w, (v, _) in own)
    return value, by @ here.J.mid[0] + sum(w * s.mid[0] for w, (_, s) in own), here


@pytest.mark.long
@pytest.mark.parametrize("number", range(4))
def test_derivatives_are_those_of_differences(number):
    rng = np.random.default_rng(number)
    model, q = list(models())[number]
    bodies = Bodies(model, q)
    u = coordinates(bodies, q) + 0.2 * rng.standard_normal(bodies.width)
    _, equations, limits, count = bodies.conditions
    assert bool(equations) == (number == 1)
    by, pairs = rng.standard_normal(3 * count), [(pair, rng.standard_normal()) for pair in [*equations, *limits]]
    _, slope, here = whole(bodies, u, by, pairs)
    steps = 1e-6 * np.eye(bodies.width)
    ends = [[whole(bodies, u + sign * e, by, pairs) for e in steps] for sign in (1, -1)]
    assert np.allclose(slope, [(a[0] - b[0]) / 2e-6 for a, b in zip(*ends)], atol=1e-8)
    H = hessian(here, exact(by[None]), pairs).mid[0]
    assert np.allclose(H, [(a[1] - b[1]) / 2e-6 for a, b in zip(*ends)], atol=1e-8)
    rows = hessian(here, exact(np.stack([by, 2.0 * by])[None]), [])
    assert np.allclose(2.0 * rows.mid[0, 0], rows.mid[0, 1], atol=1e-14)


@pytest.mark.parametrize("number", [1, pytest.param(2, marks=pytest.mark.slow)])
def test_balls_hold_values_and_derivatives_over_a_box(number):
    rng = np.random.default_rng(number)
    model, q = list(models())[number]
    bodies = Bodies(model, q)
    u, radius = coordinates(bodies, q), rng.uniform(0.0, 0.3, bodies.width)
    by = rng.standard_normal(3 * bodies.conditions[3])
    pairs = [(pair, 1.3) for pair in bodies.conditions[2]]
    held = at(bodies, Balls(u[None], radius[None]))
    enclosures = held.V, held.J, hessian(held, exact(by[None]), pairs)
    own = at(bodies, exact(u + radius * np.clip(rng.uniform(-2.0, 2.0, (60, len(u))), -1.0, 1.0)))
    found = own.V, own.J, hessian(own, exact(np.tile(by, (60, 1))), pairs)
    for value, enclosure in zip(found, enclosures):
        assert (np.abs(value.mid - enclosure.mid) <= enclosure.rad + 1e-13).all()
    assert (np.abs(own.V.mid - held.V.mid) / held.V.rad).max() > 0.3  # not much wider than needed: the test can fail


def closures(model, q, rng, count):
    """Closures within all limits: the mechanism closed from random tilts and slides, in coordinates of the joints."""
    closure, n = Closure(model, False), model.size
    while count:
        x = q.copy()
        for bound in model.bounds:
            x[list(bound.columns)] = rng.uniform(-0.7, 0.7, len(bound.columns)) * bound.limit
        for _ in range(8):
            loops = closure.loops(x[None])
            x[:n] -= np.linalg.pinv(closure.jacobian(loops)[0][:, :n]) @ closure.values(loops)[0]
        if all(np.linalg.norm(x[list(b.columns)]) < b.chart(1.0) for b in model.bounds):
            count -= 1
            yield x


@pytest.mark.parametrize("number", [0, 1, *(pytest.param(k, marks=pytest.mark.slow) for k in (2, 3))])
def test_every_closure_obeys_the_equations_and_is_kept(number):
    """V and E vanish, limits hold, L <= 0 for any multipliers, and no contraction loses a closure."""
    rng = np.random.default_rng(number)
    model, q = list(models())[number]
    bodies = Bodies(model, q)
    box = body_box(bodies, 0.3, np.zeros(1))
    small, empty = contract(bodies, box)
    assert not empty.any() and ((small.high - small.low) < 0.7 * (box.high - box.low)).any()
    rows, width = 3 * bodies.conditions[3], bodies.width
    for x in closures(model, q, rng, 2):
        u = coordinates(bodies, x)
        here = at(bodies, exact(u[None]))
        assert np.abs(here.V.mid).max() < 1e-13
        y = np.linalg.solve(box.shear, u - box.origin)
        assert (small.low[0] <= y + 1e-12).all() and (y <= small.high[0] + 1e-12).all()
        proof = Multipliers(
            u + 0.1, rng.standard_normal(rows), rng.standard_normal((rows, width)), rng.standard_normal(1),
            rng.uniform(0.0, 1.0, len(model.bounds)),
        )  # fmt: skip
        tiny = Box((y - 1e-12)[None], (y + 1e-12)[None], box.origin, box.shear)
        assert lower_bounds(bodies, proof, tiny, (1.0,))[0] < 1e-9
        assert not binds(bodies, proof, tiny, 1)


def test_bounds_are_below_all_values():
    rng = np.random.default_rng(1)
    for model, q in models():
        bodies = Bodies(model, q)
        box = body_box(bodies, 0.1, np.zeros(1))
        rows = 3 * bodies.conditions[3]
        K, weight = rng.standard_normal((rows, bodies.width)), rng.uniform(0.0, 9.0, len(model.bounds))
        proof = Multipliers(np.zeros(bodies.width), rng.standard_normal(rows), K, rng.standard_normal(1), weight)
        bound = lower_bounds(bodies, proof, box, (0.3,))[0][0]
        u = box.origin + rng.uniform(box.low[0], box.high[0], (60, bodies.width)) @ box.shear.T
        here = at(bodies, exact(u))
        values = ((proof.by + 0.3 * u @ K.T) * here.V.mid).sum(1) + limits_of(bodies, here.u, weight)[0].mid
        values += sum(mu * pair_slopes(here, pair)[0].mid for pair, mu in weighed_pairs(bodies, proof))
        assert -300.0 < bound < values.min()


def test_multipliers_of_an_optimum_make_the_lagrangian_stationary():
    rng = np.random.default_rng([3, 6])
    mechanism, motion, tilt, limits, _ = case(rng, 6)
    model = in_space(problem(mechanism, joint_limits(limits, 1.0, tilt), tilt))
    q = start(model, mechanism, motion.poses[0])
    found = least_scale(Closure(model, False), q)
    bodies = Bodies(model, q)
    proof = multipliers(bodies, found)
    assert stands_apart(model) and bodies.away(proof.at) < 0.1
    _, slope, here = whole(bodies, proof.at, proof.by, weighed_pairs(bodies, proof))
    slope = slope + limits_of(bodies, here.u, proof.weight)[1].mid[0]
    assert np.abs(slope[: bodies.size]).max() < 1e-9 * proof.weight.max()
    assert np.abs(here.V.mid).max() < 1e-12


def test_axes_that_are_too_far_apart_are_cut_away():
    """A coupler whose crank leans by 0.1 and whose joint gives 0.02 leans by 0.08 to 0.12."""
    tight = JointLimits(0.02)
    limits = {(0, 1): RIGID, (1, 2): tight, (2, 3): JointLimits(0.2), (0, 3): JointLimits(0.2)}
    model, q = posed(limits, Misalignment(0, 1, 0.1, 0.0))
    bodies = Bodies(model, q)
    assert model.link_leans[2] == pytest.approx(0.12) and len(bodies.close) == 3
    box, _ = contract(bodies, body_box(bodies, 0.1, np.zeros(1)))
    x, y, _ = bodies.bodies[bodies.of_link[2]].columns
    lean = 2.0 * math.tan(0.05)
    assert abs(box.low[0, x] - lean) < 0.021 and abs(box.high[0, x] - lean) < 0.021
    assert abs(box.low[0, y]) < 0.021 and abs(box.high[0, y]) < 0.021
