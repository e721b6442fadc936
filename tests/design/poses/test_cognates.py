"""Cognates: the same curve exactly, the published proportions, the same motion of six-bars."""

from __future__ import annotations

from fractions import Fraction

import numpy as np
import pytest

import graphsynth as gs
from graphsynth.core.errors import GeometryError
from graphsynth.design import cognates, stretched
from graphsynth.design.poses.cognates import roberts

TURN = np.linspace(0.0, 2 * np.pi, 60)


class Rational:
    """Complex numbers with rational parts."""

    def __init__(self, x, y=0):
        self.x, self.y = Fraction(x), Fraction(y)

    def __add__(self, other):
        return Rational(self.x + other.x, self.y + other.y)

    def __sub__(self, other):
        return Rational(self.x - (other.x if isinstance(other, Rational) else other), self.y - getattr(other, "y", 0))

    def __mul__(self, other):
        return Rational(self.x * other.x - self.y * other.y, self.x * other.y + self.y * other.x)

    def __truediv__(self, other):
        size = other.square
        return self * Rational(other.x / size, -other.y / size)

    @property
    def square(self):
        return self.x**2 + self.y**2


def sextic(quad, P):
    """Roberts' equation of the coupler curve up to a factor, as a function of a rational point."""
    O, A, B, Q = quad
    a, b, r, s = P - A, P - B, (A - O).square, (B - Q).square

    def value(z):
        rows = []
        for pivot, arm, radius in ((O, a, r), (Q, b, s)):
            d = z - pivot
            along, across = d.x * arm.x + d.y * arm.y, d.y * arm.x - d.x * arm.y
            rows.append((2 * along, 2 * across, d.square + arm.square - radius))
        (a1, b1, c1), (a2, b2, c2) = rows
        return (c1 * b2 - c2 * b1) ** 2 + (a1 * c2 - a2 * c1) ** 2 - (a1 * b2 - a2 * b1) ** 2

    return value


def test_the_three_curves_are_one_in_rational_numbers():
    O, A, B, Q = Rational(0), Rational(1, 2), Rational(4, 3), Rational(5, -1)
    P = Rational("7/2", "11/3")
    left, right = roberts(O, A, B, Q, P)
    curves = [sextic(quad, P) for quad in ((O, A, B, Q), left, right)]
    spots = [Rational(x, y) for x in range(-3, 4) for y in range(-3, 4)]
    spots = [Rational(z.x + Fraction(1, 7), z.y - Fraction(2, 9)) for z in spots]
    first = [[curve(z) for z in spots] for curve in curves]
    for other in first[1:]:
        ratio = other[0] / first[0][0]
        assert ratio != 0 and all(b == ratio * a for a, b in zip(first[0], other))
    assert all(curve(P) == 0 for curve in curves)
    # the fourth curve of a wrong third pivot is another one
    wrong = sextic((left[0], left[1], left[2], left[3] + Rational(1)), P)
    assert wrong(spots[1]) * first[0][0] != wrong(spots[0]) * first[0][1]


def test_equal_sextics_by_elimination():
    linkage = gs.Mechanism.four_bar(2, 1, 2.5, 2.5, coupler_point=(1.5, 0.0))
    curves = [one.coupler_curve("P").equation.monic() for one in cognates(linkage)]
    for other in curves[1:]:
        for exponents, value in curves[0].terms():
            assert float(other.coeff_monomial(exponents)) == pytest.approx(float(value), abs=1e-9)


def test_lambda_linkage_and_chebyshevs_linkage_are_cognates():
    """Published: frame 2, crank 1, coupler 2.5, rocker 2.5 with BM = 2.5; frame 4, arms 5, coupler 2, its middle."""
    _, same, other = cognates(gs.Mechanism.four_bar(2, 1, 2.5, 2.5, coupler_point=(5, 0)))

    def sides(one):
        pose = {k: np.array(p) for k, p in enumerate(one.pose)}

        def at(pair):
            joint = one.joint(*pair)
            x, y, t = pose[joint.a]
            return complex(x, y) + np.exp(1j * t) * complex(*joint.at_a)

        O, A, B, Q = (at(pair) for pair in ((0, 1), (1, 2), (2, 3), (0, 3)))
        x, y, _ = pose[2]
        return [abs(Q - O), abs(A - O), abs(B - A), abs(Q - B), abs(complex(x, y) - (A + B) / 2)]

    assert sides(other) == pytest.approx([4, 5, 2, 5, 0], abs=1e-12)
    assert sides(same)[:4] == pytest.approx([2, 1, 2.5, 2.5], abs=1e-12)  # the lambda linkage again, mirrored


@pytest.mark.parametrize("seed", range(6))
def test_random_four_bars_draw_the_same_curve(seed):
    rng = np.random.default_rng(seed)
    sides = (2.0, rng.uniform(0.3, 0.9), rng.uniform(2.0, 3.0), rng.uniform(2.0, 3.0))
    linkage = gs.Mechanism.four_bar(*sides, coupler_point=tuple(rng.normal(size=2)))
    motion = linkage.simulate(TURN)
    path = motion.point("P").position
    first, same, turned = cognates(linkage)
    assert first is linkage
    moved = same.simulate(TURN)
    assert moved.completed and np.abs(moved.point("P").position - path).max() < 1e-12
    coupler = motion.poses[:, 2, 2]
    steady = np.abs(np.diff(np.sign(np.diff(coupler)))).nonzero()[0]
    stop = int(steady[0]) + 1 if len(steady) else len(TURN)
    if stop > 3:
        again = turned.simulate(coupler[:stop])
        assert np.abs(again.point("P").position - path[:stop]).max() < 1e-10
    # angles are shared: the driver by the first, that of the other link by the second
    assert np.allclose(moved.poses[:, 1, 2], motion.poses[:, 1, 2])
    assert np.allclose(np.diff(moved.poses[:, 3, 2]), np.diff(coupler), atol=1e-9)
    assert np.allclose(np.diff(moved.poses[:, 2, 2]), np.diff(motion.poses[:, 3, 2]), atol=1e-9)


def test_a_stephenson_six_bar_keeps_its_output():
    six = gs.Mechanism.six_bar("stephenson", (4, 1, 4, 3), joint=(2, 1), link=3, output=4.5, pivot=(7, 0))
    _, same, turned = cognates(six)
    motion, moved = six.simulate(TURN), same.simulate(TURN)
    assert motion.completed and moved.completed
    assert np.abs(motion.poses[:, 4:] - moved.poses[:, 4:]).max() < 1e-11
    assert np.abs(motion.poses[:, 3, 2] - moved.poses[:, 3, 2]).max() > 1e-3
    at = turned.simulate([motion.poses[5, 2, 2]], start=None)
    assert turned.graph == six.graph and at.residual < 1e-9


def test_a_watt_six_bar_is_stretched():
    watt = gs.Mechanism.six_bar("watt", (4, 1, 4, 3), joint=(2, 1), link=3, output=3, pivot=(7, 0))
    other = stretched(watt, [0, 1, 2, 3], (0, 3), 0.7 - 0.9j)
    motion, moved = watt.simulate(TURN[:20]), other.simulate(TURN[:20])
    assert motion.completed and np.abs(motion.poses[:, :, 2] - moved.poses[:, :, 2]).max() < 1e-11
    assert np.abs(motion.poses[:, 4:] - moved.poses[:, 4:]).max() < 1e-11
    assert np.abs(motion.poses[:, 1, :2] - moved.poses[:, 1, :2]).max() > 1.0
    second = stretched(watt, [0, 3, 4, 5], (0, 3), 2.0)
    moved = second.simulate(TURN[:20])
    assert np.abs(motion.poses[:, 5, 2] - moved.poses[:, 5, 2]).max() < 1e-11


def test_what_has_no_cognate_is_told():
    with pytest.raises(GeometryError, match="a named one"):
        cognates(gs.Mechanism.four_bar(2, 1, 2.5, 2.5))
    with pytest.raises(GeometryError, match="no four-bar"):
        cognates(gs.Mechanism.slider_crank(1.0, 3.0))
    with pytest.raises(GeometryError, match="lies on a joint"):
        cognates(gs.Mechanism.four_bar(2, 1, 2.5, 2.5, coupler_point=(0, 0)))
    watt = gs.Mechanism.six_bar("watt", (4, 1, 4, 3), joint=(2, 1), link=3, output=3, pivot=(7, 0))
    for loop, about, factor in (
        ([0, 1, 2], (0, 1), 2), ([0, 1, 2, 3], (1, 3), 2), ([0, 1, 2, 3], (0, 1), 2), ([0, 1, 2, 3], (0, 3), 0)
    ):  # fmt: skip
        with pytest.raises(GeometryError):
            stretched(watt, loop, about, factor)


def test_a_mechanism_without_a_pose_is_assembled_first():
    linkage = gs.Mechanism.four_bar(2, 1, 2.5, 2.5, coupler_point=(1, 1))
    bare = gs.Mechanism(linkage.graph, linkage.joints, linkage.drivers, linkage.points)
    same = cognates(bare)[1]
    path = bare.simulate([0.5]).point("P").position
    assert np.abs(same.simulate([0.5]).point("P").position - path).max() < 1e-9
