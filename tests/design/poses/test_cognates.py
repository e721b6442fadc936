"""Cognates: the same curve exactly, the published proportions, the same motion of six-bars."""

from __future__ import annotations

import csv
import importlib.util
from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest

import graphsynth as gs
from graphsynth.core.errors import GeometryError
from graphsynth.design import cognates
from graphsynth.design.poses.cognates import roberts
from graphsynth.mechanism.model import TracePoint

TURN = np.linspace(0.0, 2 * np.pi, 60)


def mechanisms(given, *names, **kinds):
    return [one.mechanism for one in cognates(given, *names, **kinds)]


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


@pytest.mark.long
def test_equal_sextics_by_elimination():
    linkage = gs.Mechanism.four_bar(2, 1, 2.5, 2.5, coupler_point=(1.5, 0.0))
    curves = [one.coupler_curve("P").equation.monic() for one in mechanisms(linkage)]
    for other in curves[1:]:
        for exponents, value in curves[0].terms():
            assert float(other.coeff_monomial(exponents)) == pytest.approx(float(value), abs=1e-9)


def test_lambda_linkage_and_chebyshevs_linkage_are_cognates():
    """Published: frame 2, crank 1, coupler 2.5, rocker 2.5 with BM = 2.5; frame 4, arms 5, coupler 2, its middle."""
    _, same, other = mechanisms(gs.Mechanism.four_bar(2, 1, 2.5, 2.5, coupler_point=(5, 0)))

    def sides(one):
        pose = {k: np.array(p) for k, p in enumerate(one.pose)}

        def at(pair):
            joint = one.joint(*pair)
            x, y, t = pose[joint.a]
            return complex(x, y) + np.exp(1j * t) * complex(*joint.at_a)

        O, A, B, Q = (at(pair) for pair in ((0, 1), (1, 2), (2, 3), (0, 3)))
        x, y, t = pose[2]
        P = complex(x, y) + np.exp(1j * t) * complex(*one.points["P"].at)
        return [abs(Q - O), abs(A - O), abs(B - A), abs(Q - B), abs(P - (A + B) / 2)]

    assert sides(other) == pytest.approx([4, 5, 2, 5, 0], abs=1e-12)
    assert sides(same)[:4] == pytest.approx([2, 1, 2.5, 2.5], abs=1e-12)  # the lambda linkage again, mirrored


WATT = [(0, 1), (0, 2), (2, 3), (1, 3), (0, 4), (4, 5), (1, 5)]
STEPHENSON = [(0, 2), (1, 2), (0, 3), (1, 3), (0, 4), (4, 5), (1, 5)]
#: Joints, frame, driven link, link of the point: links 0 and 1 are ternary; how many cognates, and their free joints.
SIX_BARS = {
    "Watt I, inner link": (WATT, 2, 0, 4, [0, 1]),
    "Watt I, outer link": (WATT, 2, 0, 5, [0, 0, 0, 0]),
    "Stephenson I": (STEPHENSON, 2, 0, 4, [0, 0]),
    "Stephenson II, ternary link": (STEPHENSON, 4, 0, 1, [0, 0, 0]),
    "Stephenson II, binary link": (STEPHENSON, 4, 0, 2, [0, 0, 0, 0]),
    "Stephenson III": (STEPHENSON, 0, 2, 5, [0, 0, 0, 0, 0, 0]),
}


def chain(joints, frame, driven, tracer, rng, places=None):
    """Mechanism that stands in a pose where all angles are zero, its joints at random places."""
    n = max(map(max, joints)) + 1
    places = rng.normal(size=(len(joints) + 1, 2)) if places is None else places
    revolute = [gs.Revolute(a, b, tuple(z), tuple(z)) for (a, b), z in zip(joints, places)]
    graph = gs.MechanismGraph(n, joints, frame=frame)
    points = {"P": TracePoint(tracer, tuple(places[-1]))}
    return gs.Mechanism(graph, tuple(revolute), [gs.Driver(frame, driven)], points, [(0.0, 0.0, 0.0)] * n)


def moving(make):
    """Random mechanisms, with a short motion in which every link turns steadily."""
    for seed in range(1000):
        given = make(np.random.default_rng(seed))
        motion = given.simulate(np.linspace(0.0, 0.05, 12), events=False)
        steps = np.diff(np.delete(motion.poses[:, :, 2], given.frame, axis=1), axis=0)
        if motion.completed and (np.abs(steps) > 1e-4).all() and (np.abs(steps) < 0.05).all():
            yield given, motion


def worst(cognate, motion):
    """Largest distance of the cognate's point from the given one's, over the size of both."""
    again = cognate.mechanism.simulate(cognate.inputs(motion), events=False)
    assert again.completed
    size = max(np.abs(one.poses[0, :, :2]).max() for one in (motion, again))
    return np.abs(motion.point("P").position - again.point("P").position).max() / size


@pytest.mark.long
@pytest.mark.parametrize("kind", SIX_BARS)
def test_six_bars(kind):
    joints, frame, driven, tracer, free = SIX_BARS[kind]
    for (given, motion), _ in zip(moving(lambda rng: chain(joints, frame, driven, tracer, rng)), range(5)):
        found = cognates(given)
        assert sorted(one.freedom for one in found) == sorted(free)
        assert found[0].turns == (0, 1, 2, 3, 4, 5) and found[0].timed
        assert all(worst(one, motion) < 1e-12 for one in found)


def test_members_of_a_family():
    joints, frame, driven, tracer, _ = SIX_BARS["Watt I, inner link"]
    given, motion = next(moving(lambda rng: chain(joints, frame, driven, tracer, rng)))
    own, single = cognates(given)
    assert own.freedom == 1 and single.freedom == 0
    for at in ((0.3, 0.4), (-2.0, 1.0)):
        other = own.placed({(0, 1): at})
        x, y, angle = other.mechanism.pose[0]
        place = complex(x, y) + np.exp(1j * angle) * complex(*other.mechanism.joint(0, 1).at_a)
        assert abs(place - complex(*at)) < 1e-12 and worst(other, motion) < 1e-12
    with pytest.raises(GeometryError, match="1 joints of this cognate are free"):
        own.placed({(0, 1): (0.0, 0.0), (1, 5): (0.0, 1.0)})
    with pytest.raises(GeometryError, match="no joint"):
        own.placed({(2, 5): (0.0, 0.0)})


def test_a_watt_six_bar_draws_what_a_stephenson_six_bar_draws():
    joints, frame, driven, tracer, _ = SIX_BARS["Watt I, inner link"]
    given, motion = next(moving(lambda rng: chain(joints, frame, driven, tracer, rng)))
    (other,) = cognates(given, graph=gs.MechanismGraph(6, STEPHENSON, frame=4))
    assert other.freedom == 0 and worst(other, motion) < 1e-12


def test_the_whole_motion_of_a_link_is_kept():
    """A four-bar's coupler has no other; a Stephenson III six-bar's last dyad may hang on any of Roberts' four-bars."""
    assert len(cognates(chain([(0, 1), (1, 2), (2, 3), (0, 3)], 0, 1, 2, np.random.default_rng(1)), links=(2,))) == 1
    joints, frame, driven, tracer, _ = SIX_BARS["Stephenson III"]
    given, motion = next(moving(lambda rng: chain(joints, frame, driven, tracer, rng)))
    found = cognates(given, links=(tracer,))
    assert len(found) == 3
    for one in found:
        again = one.mechanism.simulate(one.inputs(motion), events=False)
        turned = again.poses[:, tracer, 2] - motion.poses[:, tracer, 2]
        assert np.abs(turned).max() < 1e-12 and worst(one, motion) < 1e-12


@pytest.mark.parametrize("seed", range(6))
def test_random_four_bars_draw_the_same_curve(seed):
    rng = np.random.default_rng(seed)
    sides = (2.0, rng.uniform(0.3, 0.9), rng.uniform(2.0, 3.0), rng.uniform(2.0, 3.0))
    linkage = gs.Mechanism.four_bar(*sides, coupler_point=tuple(rng.normal(size=2)))
    motion = linkage.simulate(TURN)
    path = motion.point("P").position
    first, same, turned = cognates(linkage)
    assert (first.turns, same.turns, turned.turns) == ((0, 1, 2, 3), (0, 1, 3, 2), (0, 2, 1, 3))
    moved = same.mechanism.simulate(TURN)
    assert moved.completed and np.abs(moved.point("P").position - path).max() < 1e-12
    # until its driver, the coupler of the given one, turns back
    steady = np.abs(np.diff(np.sign(np.diff(motion.poses[:, 2, 2])))).nonzero()[0]
    stop = int(steady[0]) + 1 if len(steady) else len(TURN)
    if stop > 3:
        again = turned.mechanism.simulate(turned.inputs(motion)[:stop])
        assert np.abs(again.point("P").position - path[:stop]).max() < 1e-10
    for k, link in enumerate(same.turns):
        assert np.allclose(np.exp(1j * moved.poses[:, k, 2]), np.exp(1j * motion.poses[:, link, 2]), atol=1e-9)


def test_those_of_four_bars_are_roberts():
    linkage = gs.Mechanism.four_bar(2, 0.8, 2.4, 2.2, coupler_point=(0.7, 1.1))
    O, A, B, Q, P = (complex(x, y) for x, y in placed(linkage))
    left, right = roberts(O, A, B, Q, P)
    _, same, turned = cognates(linkage)
    found = [[complex(x, y) for x, y in placed(one.mechanism)[:4]] for one in (same, turned)]
    assert np.abs(np.array(found[0]) - right[::-1]).max() < 1e-12 or np.abs(np.array(found[0]) - right).max() < 1e-12
    assert np.abs(np.array(found[1]) - left).max() < 1e-12


def placed(linkage):
    """Joints and point of a four-bar in its pose."""
    places = []
    for a, at in [(j.a, j.at_a) for j in map(linkage.joint, (0, 1, 2, 0), (1, 2, 3, 3))] + [linkage.points["P"]]:
        x, y, angle = linkage.pose[a]
        z = complex(x, y) + np.exp(1j * angle) * complex(*at)
        places.append((z.real, z.imag))
    return places


def test_a_function_is_kept():
    six = gs.Mechanism.six_bar("stephenson", (4, 1, 4, 3), joint=(2, 1), link=3, output=4.5, pivot=(7, 0))
    motion = six.simulate(TURN)
    own, same, turned = cognates(six, None, links=(5,))
    moved = same.mechanism.simulate(TURN)
    assert own.timed and same.timed and not turned.timed and moved.completed
    assert np.abs(motion.poses[:, 5, 2] - moved.poses[:, 5, 2]).max() < 1e-11
    assert np.abs(motion.poses[:, 3, 2] - moved.poses[:, 3, 2]).max() > 1e-3
    # a loop of Watt's six-bar may be stretched and turned about the joint that it shares with the other
    watt = gs.Mechanism.six_bar("watt", (4, 1, 4, 3), joint=(2, 1), link=3, output=3, pivot=(7, 0))
    motion = watt.simulate(TURN[:20])
    own = cognates(watt, None, links=(5,))[0].placed({(0, 1): (-3.0, 1.0)})
    moved = own.mechanism.simulate(TURN[:20])
    assert motion.completed and np.abs(motion.poses[:, :, 2] - moved.poses[:, :, 2]).max() < 1e-11
    assert np.abs(moved.poses[0, 1, :2] - (-3.0, 1.0)).max() < 1e-12


@pytest.mark.long
def test_eight_links():
    """One dyad more on a Stephenson III six-bar: its links may be exchanged too."""
    joints = [*STEPHENSON, (0, 6), (6, 7), (5, 7)]
    given, motion = next(moving(lambda rng: chain(joints, 0, 2, 7, rng)))
    found = cognates(given)
    assert len(found) == 12 and all(worst(one, motion) < 1e-11 for one in found)


COUNTS = Path(__file__).parents[3] / "catalog" / "counts"


@pytest.mark.long
def test_every_curve_of_an_eight_bar_has_its_number_of_cognates():
    with (COUNTS / "cognates-8.csv").open(encoding="utf-8") as stream:
        rows = list(csv.DictReader(stream))
    curves = [(graph.key, str(link)) for graph, link in script().questions(8)]
    assert [(row["key"], row["link"]) for row in rows] == curves and len(curves) == 266
    assert all(float(row["apart"]) < 1e-12 and int(row["cognates"]) >= max(1, int(row["families"])) for row in rows)


@pytest.mark.slow
def test_numbers_of_cognates_do_not_depend_on_the_dimensions():
    with (COUNTS / "cognates-8.csv").open(encoding="utf-8") as stream:
        rows = list(csv.DictReader(stream))[::24]
    for row in rows:
        graph, link = gs.MechanismGraph.from_key(row["key"]), int(row["link"])
        again = script().row(graph, link, 12_345)
        assert [str(value) for value in again[:-1]] == list(row.values())[:-1] and float(again[-1]) < 1e-11


def script():
    spec = importlib.util.spec_from_file_location("cognates_of_all", COUNTS / "cognates.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_what_has_no_cognate_is_told():
    with pytest.raises(GeometryError, match="on no moving link"):
        cognates(gs.Mechanism.four_bar(2, 1, 2.5, 2.5))
    with pytest.raises(GeometryError, match="not revolute"):
        cognates(gs.Mechanism.slider_crank(1.0, 3.0), None, links=(2,))
    with pytest.raises(GeometryError, match="keep nothing"):
        cognates(gs.Mechanism.four_bar(2, 1, 2.5, 2.5), None)
    with pytest.raises(GeometryError, match="give one with 4 links"):
        cognates(gs.Mechanism.four_bar(2, 1, 2.5, 2.5, coupler_point=(1, 1)), graph=gs.MechanismGraph(6, WATT, frame=0))
    with pytest.raises(GeometryError, match="lies on a joint"):
        cognates(gs.Mechanism.four_bar(2, 1, 2.5, 2.5, coupler_point=(0, 0)))


def test_a_mechanism_without_a_pose_is_assembled_first():
    linkage = gs.Mechanism.four_bar(2, 1, 2.5, 2.5, coupler_point=(1, 1))
    bare = gs.Mechanism(linkage.graph, linkage.joints, linkage.drivers, linkage.points)
    same = cognates(bare)[1].mechanism
    path = bare.simulate([0.5]).point("P").position
    assert np.abs(same.simulate([0.5]).point("P").position - path).max() < 1e-9
