"""Consistent start: the table of theory/planar-dynamics 6, nearest states, kept coordinates, bad input."""

import numpy as np
import pytest
from dynamic_models import bar, four_bar, g1, g3

from graphsynth.core.errors import GeometryError
from graphsynth.dynamics import Body, DynamicModel, consistent_start, simulate_dynamics
from graphsynth.mechanism.joints import Prismatic, Revolute
from graphsynth.mechanism.laws import Driver
from graphsynth.mechanism.model import Mechanism
from graphsynth.structure.graph import MechanismGraph

G3_START = {"keep": {(0, 1): 0.5}, "keep_rates": {(0, 1): 15.0}, "modes": {0: 1}}


def second_guide(shift):
    return g3(additional=[Prismatic(0, 3, (0.0, 0.02 + shift))])


def test_collinear_second_guide_is_redundant():
    start = consistent_start(second_guide(0.0), **G3_START)
    assert start.consistent and start.pose_class == "redundant"
    assert len(start.rows) - start.rank == 2 and start.rank == 8 and start.freedom == 1
    assert "; 2 redundant rows, their reactions are not determined" in start.message
    assert consistent_start(g3(), **G3_START).message.startswith("consistent: rank 8 of 8 rows, freedom 1")
    assert "redundant" not in consistent_start(g3(), **G3_START).message
    assert {frozenset(found) for found in start.redundant} == {
        frozenset({"P 0-3 normal", "additional 1: P 0-3 normal"}),
        frozenset({"P 0-3 angle", "additional 1: P 0-3 angle"}),
    }  # fmt: skip
    assert start.determined.tolist() == [True] * 2 + [False] * 2 + [True] * 4 + [False] * 2
    # the motion is that of G3, the pin forces too, and the guides share their force
    plain, double = (
        simulate_dynamics(model, [0.0, 0.25], start=consistent_start(model, **G3_START), form="augmented", rtol=1e-12)
        for model in (g3(), second_guide(0.0))
    )
    assert np.abs(plain.q - double.q).max() < 1e-11
    one, two = (double.reactions.between(0, 3, k) for k in (0, 1))
    assert not one.determined[0, 1] and not two.determined[0, 1] and not one.determined[0, 2]
    assert one.determined[0, 0]  # across the guide there is no force at all
    assert np.abs(one.force + two.force - plain.reactions.between(0, 3).force).max() < 1e-9
    assert np.abs(one.force - two.force).max() < 1e-12
    for pair in ((0, 1), (1, 2), (2, 3)):
        assert double.reactions.between(*pair).determined.all()
        assert np.abs(double.reactions.between(*pair).force - plain.reactions.between(*pair).force).max() < 1e-8


def test_shifted_second_guide_is_violated():
    start = consistent_start(second_guide(1e-4), **G3_START)
    assert start.status == "violated" and not start.consistent
    found = sorted(abs(value) for name, value in start.violated.items() if "normal" in name)
    assert found == pytest.approx([5.0e-5] * 2, rel=1e-9)
    assert "is open by 5e-05 m" in start.message
    with pytest.raises(GeometryError, match="do not close"):
        simulate_dynamics(second_guide(1e-4), [0.0, 1.0], **G3_START)


def change_point_bar():
    lengths = (0.02, 0.05, 0.03)
    bodies = {k: bar(1.0, length) for k, length in enumerate(lengths, 1)}
    return DynamicModel(four_bar(*lengths, 0.06), bodies, gravity=(0.0, 0.0))


FLAT = [(0.0, 0.0, 0.0), (0.0, 0.0, np.pi), (-0.02, 0.0, 0.0), (0.06, 0.0, np.pi)]


def test_change_point():
    start = consistent_start(change_point_bar(), pose=FLAT)
    assert start.consistent and start.pose_class == "singular"
    assert (start.rank, start.nearby_rank, start.freedom) == (7, 8, 2)
    assert start.tangents.kind == "change point"
    ratios = sorted((m[2, 2] / m[1, 2], m[3, 2] / m[1, 2]) for m in start.tangents.motions)
    root = np.sqrt(5.0)
    exact = sorted([((5 - 3 * root) / 20, (1 + root) / 4), ((5 + 3 * root) / 20, (1 - root) / 4)])
    assert np.abs(np.array(ratios) - exact).max() < 1e-9
    # unscaled, in metres: two smallest singular values 2e-18 and 0.031
    from graphsynth.dynamics.tables import compile_model
    from graphsynth.dynamics.values import Values

    J = Values(compile_model(change_point_bar()), 0.0, np.zeros(1)).system(start.q, 0.0 * start.q)[1]
    values = np.linalg.svd(J, compute_uv=False)
    assert values[-1] < 1e-16 and round(float(values[-2]), 3) == 0.031


def test_contradicting_rates():
    k3 = -0.5  # at theta = 0 for the proportions of G1 (theory/braider 7)
    model, keep = g1(), {(0, 1): 0.0}
    good = consistent_start(model, keep=keep, keep_rates={(0, 1): 10.0, (0, 3): 10.0 * k3}, modes={0: 1})
    assert good.consistent and abs(good.velocities[3, 2] + 5.0) < 1e-12
    bad = consistent_start(model, keep=keep, keep_rates={(0, 1): 10.0, (0, 3): 5.0}, modes={0: 1})
    assert bad.status == "contradicting rates" and bad.rank == 8
    assert {"kept (0, 1)", "kept (0, 3)"} <= set(bad.violated)
    assert "m/s" in bad.message or "rad/s" in bad.message


def test_nearest_pose_to_a_guess():
    """A point mass on a circle, guessed outside: the foot of the perpendicular, the tangential part of the speed."""
    arm = Mechanism(MechanismGraph(2, [(0, 1)], frame=0), [Prismatic(0, 1, (0.0, 0.1), (0.0, 0.0))], [Driver(0, 1)])
    model = DynamicModel(arm, {1: Body(2.0, 1.0)}, gravity=(0.0, 0.0))
    start = consistent_start(model, pose=[(0, 0, 0), (0.3, 0.5, 0.2)], rates=[(0, 0, 0), (3.0, 4.0, 1.0)])
    assert np.allclose(start.poses[1], (0.3, 0.1, 0.0), atol=1e-14)
    assert np.allclose(start.velocities[1], (3.0, 0.0, 0.0), atol=1e-14)
    assert np.allclose(start.accelerations[1], 0.0)


def test_kept_link_coordinates():
    start = consistent_start(g3(), pose=consistent_start(g3(), **G3_START).poses, keep={(3, "x"): 0.36},
                             keep_rates={(3, "x"): 0.5})  # fmt: skip
    assert start.consistent
    assert abs(start.poses[3, 0] - 0.36) < 1e-14 and abs(start.velocities[3, 0] - 0.5) < 1e-13
    crank, rod = start.poses[1, 2], 0.3
    assert abs((0.36 - 0.1 * np.cos(crank)) ** 2 + (0.02 - 0.1 * np.sin(crank)) ** 2 - rod**2) < 1e-14


@pytest.mark.parametrize(
    ("make", "text"),
    [
        (lambda: Body(-1.0, 1.0), "mass = -1.0 must be zero or more"),
        (lambda: Body(1.0, float("nan")), "not finite"),
        (lambda: g1(bodies={1: bar(1.0, 0.2)}), r"links \[2, 3\] have no body"),
        (lambda: g1(bodies={k: bar(1.0, 0.2) for k in (0, 1, 2, 3)}), "frame"),
        (lambda: consistent_start(g1()), "no pose to start from"),
        (lambda: consistent_start(g1(), keep={(0, 1): 0.0, (0, 9): 1.0}), "no joint"),
        (lambda: consistent_start(g1(), keep={(0, 1): 0.0, (1, "z"): 1.0}), "names no coordinate"),
        (lambda: simulate_dynamics(g1(), [0.0, 0.0], keep={(0, 1): 0.0}), "increase"),
        (lambda: simulate_dynamics(g1(), [0.0, 1.0], keep={(0, 1): 0.0}, method="Euler"), "method = 'Euler'"),
        (lambda: simulate_dynamics(g1(), "abc", keep={(0, 1): 0.0}), "times = 'abc' are not numbers"),
        (lambda: simulate_dynamics(g1(), [0.0, 1.0], keep={(0, 1): 0.0}, rtol="x"), "rtol = 'x'"),
        (lambda: simulate_dynamics(g1(), [0.0, 1.0], keep={(0, 1): 0.0}, max_steps=0), "max_steps = 0"),
        (lambda: simulate_dynamics(g1(), [0.0, 1.0], keep={(0, 1): float("nan")}), "not finite"),
        (
            lambda: simulate_dynamics(g1(), [0.0, 1.0], keep={(0, 1): 0.0}, keep_rates={(0, 1): float("nan")}),
            "not finite",
        ),
        (lambda: simulate_dynamics(None, [0.0, 1.0]), "not a DynamicModel"),
        (
            lambda: simulate_dynamics(g3(), [0.0, 1.0], start=consistent_start(g1(), keep={(0, 1): 0.0})),
            "the start belongs to a model with another mechanism",
        ),
        (lambda: g1(elements=None), "not a list"),
        (lambda: g1(bodies=[1, 2]), "not a mapping"),
        (lambda: simulate_dynamics(g1(), [0.0, 1.0], keep={(0, 1): 0.0}, form="best"), "form = 'best'"),
        (lambda: simulate_dynamics(g1(), [0.0, 1.0], keep={(0, 1): 0.0}, rtol=1e-20), "rtol = 1e-20"),
        (lambda: g1(additional=[Revolute(0, 7)]), "names link 7"),
    ],
)
def test_bad_input_is_one_sentence(make, text):
    with pytest.raises(GeometryError, match=text) as caught:
        make()
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("power", [0, 4, 8])
def test_rates_are_judged_by_geometry_however_much_the_masses_differ(power):
    """Mass ratios up to 1e16: the rates are those of the crank, and the bar with the mass decides what is free."""
    scale = 10.0**power
    joints = [
        Revolute(0, 1),
        Revolute(1, 2, (0.2, 0.0)),
        Revolute(2, 3, (0.6, 0.0), (0.4, 0.0)),
        Revolute(0, 3, (0.6, 0.0)),
    ]
    mechanism = Mechanism(MechanismGraph(4, [(0, 1), (1, 2), (2, 3), (0, 3)], frame=0), joints, [Driver(0, 1)])
    bodies = {1: bar(1.0 / scale, 0.2), 2: bar(1.0, 0.6), 3: bar(scale, 0.4)}
    model = DynamicModel(mechanism, bodies)
    start = consistent_start(model, keep={(0, 1): 0.7}, keep_rates={(0, 1): 10.0}, modes={0: 1})
    assert start.consistent and start.velocities[1, 2] == pytest.approx(10.0, rel=1e-14)
    equal = DynamicModel(mechanism, dict.fromkeys((1, 2, 3), bar(1.0, 0.4)))
    other = consistent_start(equal, keep={(0, 1): 0.7}, keep_rates={(0, 1): 10.0}, modes={0: 1})
    assert np.abs(start.velocities - other.velocities).max() < 1e-12
    # a guess that does not fit: the nearest rates in the metric of the masses keep those of the heavy bar
    guess = 3.0 * other.velocities
    guess[3, 2] += 1.0
    near = consistent_start(model, pose=start.poses, rates=guess)
    wanted = other.velocities / 10.0
    heavy = [
        bodies[k].mass * abs(complex(*w)) ** 2 + bodies[k].inertia * t**2 for k, w, t in centre_rates(start, wanted)
    ]
    against = [
        bodies[k].mass * (np.conj(complex(*w)) * complex(*u)).real + bodies[k].inertia * t * s
        for (k, w, t), (_, u, s) in zip(centre_rates(start, wanted), centre_rates(start, guess))
    ]
    assert near.velocities[1, 2] == pytest.approx(sum(against) / sum(heavy), rel=1e-9)


def centre_rates(start, rates):
    """(link, velocity of the centre of mass, angular speed) of the moving links."""
    for k, body in start.model.bodies.items():
        arm = np.exp(1j * start.poses[k, 2]) * complex(*body.centre)
        v = complex(*rates[k, :2]) + 1j * rates[k, 2] * arm
        yield k, (v.real, v.imag), rates[k, 2]


def test_rates_that_contradict_are_refused_at_any_mass_ratio():
    joints = [
        Revolute(0, 1),
        Revolute(1, 2, (0.2, 0.0)),
        Revolute(2, 3, (0.6, 0.0), (0.4, 0.0)),
        Revolute(0, 3, (0.6, 0.0)),
    ]
    mechanism = Mechanism(MechanismGraph(4, [(0, 1), (1, 2), (2, 3), (0, 3)], frame=0), joints, [Driver(0, 1)])
    model = DynamicModel(mechanism, {1: bar(1e-8, 0.2), 2: bar(1.0, 0.6), 3: bar(1e8, 0.4)})
    found = consistent_start(model, keep={(0, 1): 0.7}, keep_rates={(0, 1): 10.0, (0, 3): 40.0}, modes={0: 1})
    assert found.status == "contradicting rates" and max(map(abs, found.violated.values())) > 0.1
