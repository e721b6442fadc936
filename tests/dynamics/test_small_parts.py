"""Parts of the dynamics on their own, against their formulas."""

import math
from types import SimpleNamespace

import numpy as np
import pytest
from dynamic_models import bar, g1

import graphsynth.dynamics.checks as second_form
from graphsynth.dynamics import DynamicModel, JointFriction, kernels
from graphsynth.dynamics.checks import warnings_of
from graphsynth.dynamics.driven.kernels import radau, systems
from graphsynth.dynamics.friction.loads import _real_roots
from graphsynth.dynamics.integrate import scales
from graphsynth.dynamics.kernels.rubbing import friction_unit
from graphsynth.dynamics.kernels.systems import pull
from graphsynth.dynamics.result import RunChecks
from graphsynth.dynamics.start import consistent_start
from graphsynth.dynamics.tables import compile_model
from graphsynth.mechanism.joints import Prismatic, Revolute
from graphsynth.mechanism.laws import Driver
from graphsynth.mechanism.model import Mechanism
from graphsynth.structure.graph import MechanismGraph
from graphsynth.systems.tribometer.kernels import plant


def test_a_force_at_a_point_has_the_power_of_that_point():
    x = np.zeros((1, 11))
    x[0, 5:8] = 0.3, -0.7, 2.0
    (ux, uy), (fx, fy) = (0.5, 0.25), (3.0, 5.0)
    Q = np.zeros(3)
    power = pull.py_func(SimpleNamespace(column=[0]), Q, x, 0, ux, uy, fx, fy)
    assert power == pytest.approx(fx * (0.3 - 2.0 * uy) + fy * (-0.7 + 2.0 * ux), rel=1e-14)
    np.testing.assert_allclose(Q, [fx, fy, ux * fy - uy * fx])


@pytest.mark.parametrize("exponent", [0.5, 1.0, 1.5, 2.0])
@pytest.mark.parametrize("speed", [0.02, 0.3])
def test_stribeck_curve(exponent, speed):
    p = np.zeros(plant.SPEED + 1)
    p[[plant.STATIC, plant.KINETIC, plant.STRIBECK, plant.EXPONENT, plant.VISCOUS]] = 0.4, 0.25, 0.1, exponent, 0.05
    p[plant.LAW] = plant.STRIBECK_LAW
    expected = 0.25 + 0.05 * speed + 0.15 * math.exp(-((speed / 0.1) ** exponent))
    assert plant.coefficient.py_func(p, speed) == pytest.approx(expected, rel=1e-14)


def test_torque_of_a_synchronous_motor():
    """3/2 p psi i, with pole pairs p, flux linkage psi, current i in quadrature."""
    setup, P = np.zeros(16, np.int64), np.zeros(systems.ELECTRIC + 8)
    setup[systems.MOTOR] = systems.SYNCHRONOUS
    P[systems.ELECTRIC + 2], P[systems.ELECTRIC + 3] = 4.0, 0.05
    assert radau.motor_torque.py_func(setup, P, np.array([0.0, 10.0, 1.0, 7.0])) == pytest.approx(
        1.5 * 4.0 * 0.05 * 7.0
    )


@pytest.mark.parametrize("roots", [[2.0, 3.0], [-1.0, 0.5, 4.0], [1.0, 1.0, 2.0], [5.0]])
def test_real_roots(roots):
    found = sorted(_real_roots(np.polynomial.polynomial.polyfromroots(roots)))
    np.testing.assert_allclose(found, roots, rtol=1e-6)


def test_complex_roots_are_none():
    assert _real_roots(np.array([1.0, 0.0, 1.0])) == []


def test_warnings_begin_at_their_bounds():
    good = RunChecks(*[0.0] * 10)
    for name, bound in (("energy", 1e-7), ("position_drift", 1e-9), ("power", 1e-9), ("dalembert", 1e-9),
                        ("second_form", 1e-7), ("electric", 1e-7)):  # fmt: skip
        assert warnings_of(good._replace(**{name: 0.9 * bound}), 1e-9) == ()
        assert len(warnings_of(good._replace(**{name: 1.5 * bound}), 1e-9)) == 1


def test_the_second_form_is_that_of_the_planar_engine_where_there_is_one(monkeypatch):
    compiled = compile_model(g1())
    report = consistent_start(g1(), keep={(0, 1): 0.3})
    q, v = report.q, report.v
    own = second_form.second_accelerations(compiled, report, np.zeros(1), q[None], v[None], np.zeros((1, 0)))[0]
    monkeypatch.setattr(second_form, "_null_space", lambda compiled, t, q, v, currents: np.zeros_like(q))
    other = second_form.second_accelerations(compiled, report, np.zeros(1), q[None], v[None], np.zeros((1, 0)))[0]
    assert np.abs(own).max() > 1e-3
    np.testing.assert_allclose(other, own, rtol=1e-9, atol=1e-12)


def test_rates_are_measured_by_the_fastest():
    compiled = compile_model(g1())
    report = consistent_start(g1(), keep={(0, 1): 0.3})
    sizes = scales(compiled, report, SimpleNamespace(unit=compiled.unit))
    n = compiled.n
    rate = sizes[n] / sizes[0]
    speed = np.abs(report.v / sizes[:n]).max()
    assert rate >= speed and abs(rate - 1.0) > 1e-6
    np.testing.assert_allclose(sizes[n : 2 * n], rate * sizes[:n])


def test_friction_of_a_guide_that_turns_acts_and_counteracts():
    """The forces and moments on both links are in balance; their power is the friction times the rate of sliding."""
    graph = MechanismGraph(4, [(0, 1), (1, 2), (2, 3), (0, 3)], frame=0)
    joints = [Revolute(0, 1), Revolute(1, 2, (0.3, 0.0)), Prismatic(2, 3, (0.1, 0.05), (0.2, -0.1), 0.4, 0.7),
              Revolute(0, 3, (0.8, 0.2), (0.5, 0.1))]  # fmt: skip
    bodies = {k: bar(0.2, 0.2) for k in (1, 2, 3)}
    model = DynamicModel(Mechanism(graph, joints, [Driver(0, 1)]), bodies, [JointFriction(2, 3, 0.25)])
    compiled = compile_model(model)
    report = consistent_start(model, keep={(0, 1): 0.9}, keep_rates={(0, 1): 3.0})
    T = compiled.tables
    x = kernels.state_rows(T, report.q, report.v)
    J = kernels.constraint_system(T, x, np.zeros(7), compiled.driven(0.0))[1]
    Q = np.zeros(compiled.n)
    power = friction_unit(T, x, J, 0, Q)
    loads = {k: Q[T.column[k] : T.column[k] + 3] for k in (2, 3)}
    np.testing.assert_allclose(loads[2][:2], -loads[3][:2], rtol=1e-12)
    assert np.hypot(*loads[2][:2]) == pytest.approx(0.25)
    moments = [x[k, 0] * f[1] - x[k, 1] * f[0] + f[2] for k, f in loads.items()]
    assert sum(moments) == pytest.approx(0.0, abs=1e-14)
    guide = report.poses[2, 2] + 0.4
    t = np.array([math.cos(guide), math.sin(guide)])
    arms = [np.array([[math.cos(a), -math.sin(a)], [math.sin(a), math.cos(a)]]) @ p
            for a, p in ((report.poses[2, 2], (0.1, 0.05)), (report.poses[3, 2], (0.2, -0.1)))]  # fmt: skip
    P, V = [report.poses[k, :2] + arm for k, arm in zip((2, 3), arms)], report.velocities
    # of the link's point that lies at the pin of the other
    here, there = P[1] - report.poses[2, :2], arms[1]
    rate = t @ (
        V[3, :2] + V[3, 2] * np.array([-there[1], there[0]]) - V[2, :2] - V[2, 2] * np.array([-here[1], here[0]])
    )
    assert power == pytest.approx(-0.25 * abs(rate), rel=1e-12)
