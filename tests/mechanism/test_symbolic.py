"""Closure equations and coupler curves as formulas."""

import numpy as np
import pytest
import sympy

import graphsynth as gs
from graphsynth.core.errors import GeometryError
from graphsynth.mechanism.constraints import residual


def value_on(curve, path):
    """Value of the polynomial on points, over the sum of the sizes of its terms."""
    x, y = path.T
    terms = [float(c) * x**i * y**j for (i, j), c in curve.equation.terms()]
    return np.abs(sum(terms)) / sum(map(np.abs, terms))


@pytest.mark.parametrize("branch", [1, -1])
def test_the_four_bar_draws_a_tricircular_sextic(branch):
    linkage = gs.Mechanism.four_bar(4, 1, 3.5, 3, coupler_point=(1.5, 1.25), branch=branch)
    curve = linkage.coupler_curve("P")
    assert (curve.degree, curve.circularity) == (6, 3)  # Roberts 1875
    assert value_on(curve, linkage.simulate().point("P").position).max() < 1e-13


def test_the_sextic_is_roberts_form():
    """Roberts' equation, with the joints of the coupler at distances m and n from P, seen under the angle gamma."""
    linkage = gs.Mechanism.four_bar(4, 2, 3, 3)
    x, y = sympy.symbols("x y", real=True)
    (p, q), r, s, k = (sympy.Rational(3, 2), 2), 2, 3, 4
    m = sympy.sqrt(p**2 + q**2)
    n = sympy.sqrt((p - 3) ** 2 + q**2)
    gamma = sympy.acos((m**2 + n**2 - 9) / (2 * m * n))
    c, d = sympy.cos(gamma), sympy.sin(gamma)
    U = m * ((x - k) * c + y * d) * (x**2 + y**2 + m**2 - r**2) - n * x * ((x - k) ** 2 + y**2 + n**2 - s**2)
    V = m * ((x - k) * d - y * c) * (x**2 + y**2 + m**2 - r**2) + n * y * ((x - k) ** 2 + y**2 + n**2 - s**2)
    W = 2 * m * n * d * (x * (x - k) + y**2 - k * y * c / d)
    known = sympy.Poly(sympy.expand(U**2 + V**2 - W**2), x, y)
    ours = linkage.coupler_curve(2, (p, q)).equation
    ratio = sympy.nsimplify(sympy.simplify(known.LC() / ours.LC()))
    assert sympy.simplify((known - ours * ratio).as_expr()) == 0


def test_the_slider_crank_draws_a_quartic():
    linkage = gs.Mechanism.slider_crank(1, 3, 0.25, rod_point=(1.5, 0.5))
    curve = linkage.coupler_curve("P")
    assert (curve.degree, curve.circularity) == (4, 1)
    assert value_on(curve, linkage.simulate().point("P").position).max() < 1e-13


def test_the_trammel_draws_an_ellipse():
    places = {"A": (1.5, 0), "B": (0, 1.5), "P": (1, 0.5), "U": (-5, 0), "V": (5, 0), "S": (0, -5), "T": (0, 5)}
    trammel = gs.Mechanism.from_points(places, ["ABP"], "UVST", driver=(0, 2), slides={"A": "UV", "B": "ST"})
    curve = trammel.coupler_curve("P")
    x, y = sympy.symbols("x y", real=True)
    assert curve.degree == 2
    # P divides AB in parts sqrt(1/2) from A and sqrt(2) from B, which are the half axes
    assert sympy.expand(curve.equation.as_expr() / curve.equation.eval({x: 0, y: 0}) - (1 - x**2 / 2 - y**2 * 2)) == 0


@pytest.mark.parametrize(
    "linkage",
    [gs.Mechanism.four_bar(4, 1, 3.5, 3), gs.Mechanism.slider_crank(1, 3, 0.2)],
    ids=["four-bar", "slider-crank"],
)
def test_closure_equations_vanish_where_the_joints_close(linkage):
    equations = linkage.closure_equations()
    motion = linkage.simulate(np.linspace(0.1, 1.1, 3))
    symbols = [sympy.Symbol(f"{name}_{k}", real=True) for k in range(1, 4) for name in ("x", "y", "theta")]
    call = sympy.lambdify(symbols, equations)
    for pose in motion.poses:
        assert np.abs(call(*pose[1:].ravel())).max() < 1e-14
    wrong = motion.poses[0] + np.random.default_rng(1).normal(0, 0.1, (4, 3))
    wrong[0] = 0.0
    plain = [k for k in range(8) if (k, linkage.joints[1].kind) != (3, "P")]  # without the equation of angles
    ours, known = np.abs(call(*wrong[1:].ravel()))[plain], np.abs(residual(linkage.joints, wrong))[plain]
    assert np.allclose(ours, known, atol=1e-12)


def test_mechanisms_without_a_coupler_curve():
    six = gs.Mechanism.six_bar("watt", (4, 1, 4, 3), joint=(2, 1), link=3, output=3, pivot=(7, 0))
    with pytest.raises(GeometryError, match="not held by two joints"):
        six.coupler_curve(3, (1, 1))
    with pytest.raises(GeometryError, match="point 'P' is not defined"):
        six.coupler_curve("P")
