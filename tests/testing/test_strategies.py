"""Every strategy draws what it promises, and reaches the corners."""

from __future__ import annotations

import math
import subprocess
import sys
import tomllib
from fractions import Fraction

import numpy as np
import pytest
from hypothesis import HealthCheck, Phase, find, given, settings, strategies as st
from hypothesis.errors import NoSuchExample

import graphsynth.testing as testing
from graphsynth.core.errors import InfeasibleSpecError, SpecError
from graphsynth.intervals import Interval
from graphsynth.kinematics.triad.leg import LegStatus
from graphsynth.mechanism.rotatability import type_of
from graphsynth.pipeline.scene import Scene
from graphsynth.structure.graph import MechanismGraph
from graphsynth.testing.files import toml_text
from graphsynth.testing.linkages import CLASSES
from graphsynth.testing.structures import _values

MANY = settings(max_examples=25, deadline=None, suppress_health_check=[HealthCheck.too_slow])
#: find() may look long for a corner that is drawn seldom
LOOK = settings(
    derandomize=False,
    max_examples=20_000,
    deadline=None,
    phases=(Phase.generate,),
    suppress_health_check=list(HealthCheck),
    database=None,
)


def reaches(strategy, corner):
    return find(strategy, corner, settings=LOOK)


# --- graphs -----------------------------------------------------------------------------------------------------------


@MANY
@given(testing.graphs(2, 7, space=4))
def test_graphs_are_within_what_was_asked(graph):
    assert 2 <= graph.links <= 7 and graph.space == 4
    assert MechanismGraph(graph.links, graph.joints, frame=graph.frame, space=4) == graph


@MANY
@given(testing.graphs(connected=True))
def test_connected_graphs_are_connected(graph):
    assert graph.is_connected and 1 <= graph.links <= 12


@pytest.mark.parametrize(
    "corner",
    [
        lambda g: g.links == 1,
        lambda g: g.links == 12,
        lambda g: not g.joints and g.links > 1,
        lambda g: not g.is_connected and g.joints,
        lambda g: g.frame is None and g.space == 6,
        lambda g: any(joint.mobility == 5 for joint in g.joints),
        lambda g: g.space == 2,
        lambda g: g.mobility < 0,
        lambda g: g.links > 3 and len(g.joints) == g.links * (g.links - 1) // 2,
    ],
)
def test_graphs_reach(corner):
    assert corner(reaches(testing.graphs(), corner))


@MANY
@given(testing.chains(4, 10))
def test_chains_are_admissible(chain):
    assert chain.mobility == 1 and chain.frame is None and chain.is_connected and min(chain.degrees) >= 2
    assert chain.rigid_subchain() is None and not chain.is_fractionated and chain.links % 2 == 0


@MANY
@given(testing.chains(5, 9, mobility=2, fractionated=True))
def test_chains_of_more_freedoms(chain):
    assert chain.mobility == 2 and chain.links in (5, 7, 9) and chain.rigid_subchain() is None


@pytest.mark.long
def test_chains_reach_every_chain_and_other_labels():
    seen = set()

    @settings(max_examples=400, deadline=None, derandomize=True, database=None)
    @given(testing.chains(4, 8))
    def draw(chain):
        seen.add(chain.key)

    draw()
    assert len(seen) == 1 + 2 + 16
    assert reaches(testing.chains(mobility=2, max_links=9, fractionated=True), lambda c: c.is_fractionated)
    assert reaches(testing.chains(), lambda c: c != MechanismGraph.from_key(c.key) and c.automorphism_order > 1)
    assert reaches(testing.chains(10, 10), lambda c: not c.is_planar)


@MANY
@given(testing.mechanism_graphs())
def test_mechanism_graphs_have_a_frame(graph):
    assert graph.frame is not None and graph.mobility == 1 and graph.rigid_subchain() is None


def test_mechanism_graphs_reach_any_frame():
    assert reaches(testing.mechanism_graphs(), lambda g: g.frame == g.links - 1)
    assert reaches(testing.mechanism_graphs(), lambda g: g.links == 8 and g.degrees[g.frame] == 4)


# --- questions --------------------------------------------------------------------------------------------------------


@MANY
@given(testing.specs())
def test_feasible_specs_have_answers(spec):
    solutions = spec.solve()
    assert solutions
    for solution in solutions:
        solution.check()


@pytest.mark.parametrize(
    "corner",
    [
        lambda s: len(s.solve()) > 1,
        lambda s: isinstance(s.ranges.get("t0"), tuple) and s.bounds("t0")[0] != s.bounds("t0")[1],
        lambda s: s.fixed("v_P") is not None,
        lambda s: s.solve()[0].n > 6,
    ],
)
def test_specs_reach(corner):
    assert reaches(testing.specs(), corner)


def test_other_specs_reach_questions_without_answer():
    def contradictory(spec):
        try:
            return not spec.solve()
        except InfeasibleSpecError:
            return True

    assert reaches(testing.specs(feasible=False), contradictory)


def test_values_of_the_worked_example():
    """Figure 3 of the source: frame of degree 7, nineteen turning pairs and three gear pairs (structural page, 2)."""
    turning = "0-1 0-2 0-3 0-4 2-5 3-6 4-7 5-8 6-9 7-10 0-8 0-9 0-10 8-11 9-12 10-13 11-14 12-14 13-14"
    pairs = [(*map(int, pair.split("-")),) for pair in turning.split()]
    graph = MechanismGraph(15, [*pairs, (1, 2, 2), (1, 3, 2), (1, 4, 2)], frame=0)
    want = {"W": 1, "Pi": 3, "n": 14, "p": 22, "v": 8, "t0": 7, "v_ct": 6, "v_P": 2, "G": 25, "p1": 19, "p2": 3}
    assert _values(graph) == {**want, "n2": 6, "n3": 7, "n4": 1}


# --- four-bars and mechanisms -----------------------------------------------------------------------------------------


@MANY
@given(testing.four_bars(*CLASSES))
def test_four_bars_have_their_class(bar):
    """The class against another exact decision: where the crank's distance stays inside of coupler and rocker."""
    from graphsynth.kinematics.certify import certify_four_bar

    found = certify_four_bar(bar.ground, bar.crank, bar.coupler, bar.rocker)
    assert found.type == bar.type or (bar.type == "never assembled" and found.kind == "never assembled")
    assert min(bar.floats) > 0


@pytest.mark.parametrize("kind", CLASSES)
def test_every_class_is_reached_also_one_unit_from_its_border(kind):
    assert reaches(testing.four_bars(kind), lambda bar: bar.type == kind)
    if kind not in ("change point", "immovable", "never assembled"):

        def near(bar):
            lengths = sorted((bar.ground, bar.crank, bar.coupler, bar.rocker))
            return abs(lengths[0] + lengths[3] - lengths[1] - lengths[2]) == Fraction(1, 20)

        assert reaches(testing.four_bars(kind), near)


@pytest.mark.long
def test_all_classes_are_drawn_by_default():
    for kind in CLASSES[:-1]:
        assert reaches(testing.four_bars(), lambda bar, kind=kind: bar.type == kind)
    with pytest.raises(NoSuchExample):
        find(testing.four_bars(), lambda bar: bar.type == "never assembled", settings=settings(LOOK, max_examples=200))


@given(st.tuples(*[st.integers(1, 6)] * 4))
def test_class_by_the_definition(lengths):
    """Grashof's classes by what turns: a link turns fully unless the diagonal leaves its reach."""
    g, a, b, c = lengths
    turns_a = abs(g - a) > abs(b - c) and g + a < b + c  # crank against the frame
    turns_c = abs(g - c) > abs(b - a) and g + c < b + a  # rocker against the frame
    assembled = max(g + a, b + c) > 0 and g + a >= abs(b - c) and abs(g - a) <= b + c
    kind = type_of(*map(Fraction, lengths))
    if kind == "never assembled":
        assert not assembled
    elif kind == "immovable":
        assert g + a == abs(b - c) or abs(g - a) == b + c
    elif kind != "change point":
        assert assembled
        assert turns_a == (kind in ("crank-rocker", "double crank"))
        assert turns_c == (kind in ("rocker-crank", "double crank"))


@MANY
@given(testing.mechanisms(4, 8, prismatic=True))
def test_mechanisms_are_assembled_at_their_pose(mechanism):
    report = mechanism.mobility()
    assert report.count == 1 and report.violation < 1e-12
    assert len(mechanism.drivers) == 1 and mechanism.drivers[0].base == mechanism.frame
    places = [joint.at_a for joint in mechanism.joints]
    assert np.isfinite(places).all()


@pytest.mark.parametrize(
    "corner",
    [
        lambda m: m.graph.links == 8,
        lambda m: any(type(joint).__name__ == "Prismatic" for joint in m.joints),
        lambda m: m.frame != 0 and m.drivers[0].link != 0,
        lambda m: m.mobility().by_rank == 1 and m.graph.links == 6,
    ],
)
def test_mechanisms_reach(corner):
    assert reaches(testing.mechanisms(prismatic=True), corner)


def test_mechanisms_can_be_simulated():
    from graphsynth.kinematics.simulation import simulate

    @settings(max_examples=15, deadline=None)
    @given(testing.mechanisms(4, 6))
    def moves(mechanism):
        driver = mechanism.drivers[0]
        (joint,) = [j for j in mechanism.joints if set(j.pair) == {driver.base, driver.link}]
        now = mechanism.pose[driver.link][2] - mechanism.pose[driver.base][2]
        motion = simulate(mechanism, [now], start=mechanism.pose)
        assert joint is not None
        assert not motion.assembled[0] or np.abs(motion.poses[0] - mechanism.pose).max() < 1e-6

    moves()


@MANY
@given(testing.four_bar_mechanisms())
def test_four_bar_mechanisms_turn_as_their_class_says(found):
    from graphsynth.kinematics.simulation import simulate

    mechanism, kind = found
    # start where D is in the middle of its reach, which every assembled four-bar has
    g, a, b, c = _lengths(mechanism)
    low, high = max(abs(b - c), abs(g - a)), min(b + c, g + a)
    middle = (0.5 * (low + high)) ** 2
    start = math.acos(max(-1.0, min(1.0, (g * g + a * a - middle) / (2 * g * a))))
    motion = simulate(mechanism, np.linspace(start, start + math.tau, 37), modes={0: 1}, events=False)
    assert motion.assembled[0]
    if kind in ("crank-rocker", "double crank"):
        assert motion.completed
    else:
        assert not motion.assembled.all()


def _lengths(mechanism):
    by_pair = {joint.pair: joint for joint in mechanism.joints}
    crank = math.hypot(*by_pair[1, 2].at_a)
    return math.hypot(*by_pair[0, 3].at_a), crank, math.hypot(*by_pair[2, 3].at_a), math.hypot(*by_pair[2, 3].at_b)


# --- numbers ----------------------------------------------------------------------------------------------------------


@pytest.mark.long
@given(testing.intervals((2, 3)))
def test_intervals_are_intervals(x):
    assert isinstance(x, Interval) and x.shape == (2, 3)
    assert ((x.lo <= x.hi) | x.is_empty).all() and not np.isnan(x.lo).any()


@given(testing.intervals(empty=False, unbounded=False))
def test_bounded_intervals_are_bounded(x):
    assert bool(x.is_bounded) and not bool(x.is_empty)


@pytest.mark.slow
@pytest.mark.parametrize(
    "corner",
    [
        lambda x: bool(x.is_empty),
        lambda x: x.lo == -np.inf and x.hi == np.inf,
        lambda x: x.lo == -np.inf and x.hi < 0,
        lambda x: x.hi == np.inf and x.lo > 0,
        lambda x: x.lo == x.hi,
        lambda x: 0 < x.lo <= x.hi < 2.0**-1022,
        lambda x: x.lo == 0 and np.signbit(x.lo),
        lambda x: x.hi == 1.7976931348623157e308,
        lambda x: x.lo < 0 < x.hi and np.isfinite(x.width),
        lambda x: 0 < x.width < 1e-15 and x.lo > 0.5,
    ],
)
def test_intervals_reach(corner):
    assert corner(reaches(testing.intervals(), lambda x: bool(corner(x))))


@given(testing.intervals_and_members())
def test_members_are_members(pair):
    interval, member = pair
    low, high = float(interval.lo), float(interval.hi)
    assert low == -math.inf or Fraction(low) <= member
    assert high == math.inf or member <= Fraction(high)


@pytest.mark.long
@pytest.mark.parametrize(
    "corner",
    [
        lambda x, m: math.isfinite(x.lo) and Fraction(float(x.lo)) == m and x.lo < x.hi,
        lambda x, m: math.isfinite(x.hi) and Fraction(float(x.hi)) == m and x.lo < x.hi,
        lambda x, m: x.hi == np.inf and m > 10**300,
        lambda x, m: m.denominator > 3 and Fraction(float(m)) != m,
        lambda x, m: x.lo == -np.inf and x.hi == np.inf,
    ],
)
def test_members_reach(corner):
    assert reaches(testing.intervals_and_members(), lambda pair: bool(corner(*pair)))


@pytest.mark.parametrize("corner", [lambda x: 0 < abs(x) < 1e-310, lambda x: x > 1e300, lambda x: x == int(x) != 0])
def test_finite_numbers_reach(corner):
    assert reaches(testing.finite_numbers(), corner)


# --- platforms --------------------------------------------------------------------------------------------------------


@MANY
@given(testing.platforms(degenerate=False))
def test_platforms_are_general_or_symmetric(platform):
    assert min(*platform.l1, *platform.l2) >= 0.05


@pytest.mark.long
@pytest.mark.parametrize(
    "corner",
    [
        lambda p: p.b[0] == p.b[1] and p.D[0] != p.D[1],
        lambda p: all(d.imag == 0 for d in p.D) and all(b.imag == 0 for b in p.b) and len(set(p.D)) == 3,
        lambda p: p.b == p.D and len(set(p.l1)) == len(set(p.l2)) == 1 and len(set(p.D)) == 3,
        lambda p: p.l1[0] > 10 * p.l2[0],
        lambda p: abs(p.D[0] + p.D[1] + p.D[2]) < 1e-12 and abs(abs(p.D[0]) - abs(p.D[1])) < 1e-12 < abs(p.D[0]),
    ],
)
def test_platforms_reach(corner):
    assert reaches(testing.platforms(), corner)


@MANY
@given(testing.platform_poses(reached=True))
def test_reached_poses_are_reached(found):
    platform, pose, sigma = found
    solution = platform.inverse(pose, sigma)
    assert solution.reachable and (solution.deficit < 0).all()
    assert np.abs(platform.closure(pose, solution.theta)).max() < 1e-11


@MANY
@given(testing.platform_poses())
def test_one_leg_at_least_reaches_its_vertex(found):
    platform, pose, sigma = found
    solution = platform.inverse(pose, sigma)
    assert (solution.deficit < 1e-12).any()


@pytest.mark.long
@pytest.mark.parametrize(
    "corner",
    [
        lambda status, pose: (status == LegStatus.REACHABLE).all(),
        lambda status, pose: (status == LegStatus.REACHABLE).any() and (status == LegStatus.TOO_FAR).any(),
        lambda status, pose: (status == LegStatus.TOO_NEAR).any(),
        lambda status, pose: (status == LegStatus.REACHABLE).all() and pose[2] == math.pi,
    ],
)
def test_platform_poses_reach(corner):
    strategy = testing.platform_poses()
    assert reaches(strategy, lambda found: bool(corner(found[0].inverse(found[1], found[2]).status, found[1])))


# --- scenes -----------------------------------------------------------------------------------------------------------


@MANY
@given(testing.scenes())
def test_scenes_are_read(text):
    tables = tomllib.loads(text)
    scene = Scene.from_mapping(tables, "drawn.toml")
    assert scene.name == tables["scene"]["name"]


@pytest.mark.slow
@pytest.mark.parametrize(
    "words",
    [("lambda_linkage", "clearance_mm = 0\n"), ('kind = "belt"',), ("stribeck",), ('\\"',), ("planar = true",)],
)
def test_scenes_reach(words):
    assert reaches(testing.scenes(), lambda text: all(word in text for word in words))


plain = st.booleans() | st.integers() | st.floats(allow_nan=False, allow_infinity=False) | st.text(
    st.characters(min_codepoint=32, exclude_categories=("Cs", "Cc"))
)  # fmt: skip
names = st.from_regex("[a-z]{1,4}", fullmatch=True)


@pytest.mark.slow
@settings(max_examples=30, deadline=None)
@given(
    st.dictionaries(names, st.dictionaries(names, plain | st.lists(plain, max_size=3) | st.dictionaries(names, plain)))
)
def test_toml_text_is_read_back(tables):
    assert tomllib.loads(toml_text(tables)) == tables


# --- the room ---------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (lambda: testing.graphs(0, 3), "smallest number of links is 0"),
        (lambda: testing.graphs(5, 3), "exchange them"),
        (lambda: testing.graphs(space=7), "space = 7"),
        (lambda: testing.chains(4, 12), "largest number of links is 12"),
        (lambda: testing.chains(5, 5), "no chain of mobility 1 has 5 to 5 links"),
        (lambda: testing.chains(mobility=9), "mobility = 9"),
        (lambda: testing.specs(3, 3), "smallest number of links is 3"),
        (lambda: testing.four_bars("rocker"), "'rocker' is no class"),
        (lambda: testing.four_bar_mechanisms("rocker"), "'rocker' is no class"),
        (lambda: testing.four_bars(scale=0), "scale = 0"),
        (lambda: testing.mechanisms(4.5, 6), "smallest number of links is 4.5"),
        (lambda: testing.intervals(-1), "shape = -1"),
    ],
)
def test_bad_arguments_get_one_sentence(call, words):
    with pytest.raises(SpecError, match=words) as caught:
        call()
    assert "\n" not in str(caught.value)


def test_all_names_are_strategies_and_documented():
    for name in testing.__all__:
        assert getattr(testing, name).__doc__
    assert set(testing.__all__) <= set(dir(testing))
    with pytest.raises(AttributeError, match="nothing"):
        _ = testing.nothing


def test_hypothesis_is_imported_only_when_asked_for():
    code = "import sys, graphsynth.testing as t; print('hypothesis' in sys.modules, 'numpy' in sys.modules); t.chains()"
    found = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert found.stdout.split() == ["False", "False"]


def test_missing_hypothesis_is_one_sentence():
    code = "import sys; sys.modules['hypothesis'] = None\nfrom graphsynth.testing import chains"
    found = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert found.returncode == 1
    assert "MissingExtraError: graphsynth.testing draws its examples with hypothesis" in found.stderr
    assert found.stderr.strip().endswith("pip install hypothesis")


def test_nothing_else_imports_hypothesis():
    from pathlib import Path

    import graphsynth

    root = Path(graphsynth.__file__).parent
    users = {
        p.relative_to(root).parts[0]
        for p in root.rglob("*.py")
        if "import hypothesis" in (t := p.read_text(encoding="utf-8")) or "from hypothesis" in t
    }
    assert users == {"testing"}
