import copy
import pickle
import subprocess
import sys

import networkx as nx
import pytest

from graphsynth.core.errors import FormatError, GraphError
from graphsynth.structure.graph import Joint, MechanismGraph
from graphsynth.structure.text import integer

FOUR_BAR = MechanismGraph(4, [(0, 1), (1, 2), (2, 3), (3, 0)], frame=0)
WATT = MechanismGraph(6, [(0, 1), (1, 2), (2, 3), (3, 0), (3, 4), (4, 5), (5, 2)])
STEPHENSON = MechanismGraph(6, [(0, 1), (0, 2), (0, 3), (1, 4), (2, 4), (3, 5), (4, 5)])

# The source's Figure 3, theory/structural-system 2.
FIGURE_3_LOWER = "0-1 0-2 0-3 0-4 2-5 3-6 4-7 5-8 6-9 7-10 0-8 0-9 0-10 8-11 9-12 10-13 11-14 12-14 13-14"
FIGURE_3_HIGHER = "1-2 1-3 1-4"
FIGURE_3 = MechanismGraph(
    15,
    [(*map(int, pair.split("-")), 1) for pair in FIGURE_3_LOWER.split()]
    + [(*map(int, pair.split("-")), 2) for pair in FIGURE_3_HIGHER.split()],
    frame=0,
)


def test_counts_of_the_four_bar():
    assert FOUR_BAR.mobility == 1
    assert FOUR_BAR.loops == 1
    assert FOUR_BAR.degrees == (2, 2, 2, 2)
    assert FOUR_BAR.assortment == {2: 3}
    assert FOUR_BAR.without_frame().assortment == {2: 4}
    assert FOUR_BAR.levels == ((0,), (1, 3), (2,))
    assert FOUR_BAR.girth == 4
    assert FOUR_BAR.is_planar
    assert not FOUR_BAR.is_fractionated
    assert FOUR_BAR.automorphism_order == 2
    assert FOUR_BAR.without_frame().automorphism_order == 8


def test_figure_3_of_the_source():
    assert FIGURE_3.levels == ((0,), (1, 2, 3, 4, 8, 9, 10), (5, 6, 7, 11, 12, 13), (14,))
    assert FIGURE_3.mobility == 1
    assert FIGURE_3.sub_edges == 25
    assert FIGURE_3.loops == 8
    assert FIGURE_3.degrees[0] == 7
    assert FIGURE_3.assortment == {2: 6, 3: 7, 4: 1}
    assert FIGURE_3.automorphism_order == 6
    assert {2, 3, 4} in [set(orbit) for orbit in FIGURE_3.orbits]
    assert FIGURE_3.rigid_subchain() is None
    assert FIGURE_3.generic_mobility().mobility == 1


def test_inversions_of_the_six_link_chains():
    # Published: Watt has 2 inversions, Stephenson 3.
    for chain, count in ((WATT, 2), (STEPHENSON, 3)):
        inversions = chain.inversions()
        assert len(inversions) == count
        assert len({mechanism.key for mechanism in inversions}) == count
        assert all(mechanism.frame == 0 for mechanism in inversions)
        assert {chain.with_frame(link).key for link in range(6)} == {mechanism.key for mechanism in inversions}


def test_joint_orbits():
    assert sorted(map(len, WATT.joint_orbits)) == [1, 2, 4]
    assert sorted(joint for orbit in STEPHENSON.joint_orbits for joint in orbit) == list(STEPHENSON.joints)


def test_immutable_hashable_copyable():
    for name in ("links", "packed", "frame", "space", "_cache", "other"):
        with pytest.raises(AttributeError):
            setattr(FOUR_BAR, name, 1)
    with pytest.raises(AttributeError):
        del FOUR_BAR.links
    twin = MechanismGraph(4, [(3, 2), (3, 0), (2, 1), (1, 0)], frame=0)
    assert twin == FOUR_BAR
    assert hash(twin) == hash(FOUR_BAR)
    assert FOUR_BAR.without_frame() != FOUR_BAR
    assert FOUR_BAR != "Cl f0"
    assert copy.deepcopy(FOUR_BAR) is FOUR_BAR
    assert pickle.loads(pickle.dumps(FIGURE_3)) == FIGURE_3  # executors move graphs between processes
    assert eval(repr(FIGURE_3)) == FIGURE_3


def test_unchecked_equals_checked():
    made = MechanismGraph._unchecked(4, FOUR_BAR.packed, 0, 3)
    assert made == FOUR_BAR
    assert made.joints == (Joint(0, 1), Joint(0, 3), Joint(1, 2), Joint(2, 3))


@pytest.mark.parametrize(
    ("arguments", "place"),
    [
        ((0, []), "links"),
        ((256, []), "links"),
        (("4", []), "links"),
        ((3, 5), "joints"),
        ((3, [(0, 1), (1, 1)]), "joint 2"),
        ((3, [(0, 3)]), "joint 1"),
        ((3, [(0, -1)]), "joint 1"),
        ((3, [(0, 1), (1, 0)]), "joint 2"),
        ((3, [(0, 1, 3)]), "joint 1"),
        ((3, [(0, 1, 0)]), "joint 1"),
        ((3, [(0, 1.5)]), "joint 1"),
        ((3, [(0,)]), "joint 1"),
        ((3, [(0, 1, 1, 1)]), "joint 1"),
        ((3, [7]), "joint 1"),
    ],
)
def test_malformed_graphs_name_the_place(arguments, place):
    with pytest.raises(FormatError) as caught:
        MechanismGraph(*arguments)
    assert caught.value.place == place


def test_frame_and_space_bounds():
    with pytest.raises(FormatError, match="frame"):
        MechanismGraph(3, [(0, 1)], frame=3)
    for space in (1, 7):
        with pytest.raises(FormatError, match="free link"):
            MechanismGraph(3, [(0, 1)], space=space)
    assert MechanismGraph(2, [(0, 1, 5)], space=6).mobility == 5


def test_operations_that_need_more_say_so():
    with pytest.raises(GraphError, match="frame"):
        _ = WATT.levels
    with pytest.raises(GraphError, match="link 2"):
        _ = MechanismGraph(3, [(0, 1)], frame=0).levels
    with pytest.raises(GraphError, match="several parts"):
        _ = MechanismGraph(3, [(0, 1)]).is_fractionated
    with pytest.raises(GraphError, match="permutation"):
        WATT.relabelled([0, 0, 1, 2, 3, 4])
    with pytest.raises(GraphError, match="graph6"):
        FOUR_BAR.graph6()


def test_fractionated_chain():
    two_four_bars = MechanismGraph(7, [(0, 1), (1, 2), (2, 3), (3, 0), (0, 4), (4, 5), (5, 6), (6, 0)])
    assert two_four_bars.cut_links == (0,)
    assert two_four_bars.cut_joints == ()
    assert two_four_bars.is_fractionated
    assert two_four_bars.mobility == 2


def test_networkx_both_ways():
    view = FIGURE_3.to_networkx()
    assert MechanismGraph.from_networkx(view) == FIGURE_3
    named = nx.Graph(frame="base")
    named.add_edge("base", "crank")
    named.add_edge("crank", "cam", mobility=2)
    graph = MechanismGraph.from_networkx(named)
    assert graph == MechanismGraph(3, [(0, 1), (1, 2, 2)], frame=0)


@pytest.mark.parametrize(
    "graph",
    [None, 3, nx.DiGraph([(0, 1)]), nx.MultiGraph([(0, 1)]), nx.Graph(), nx.empty_graph(256), nx.Graph([(0, 0)])],
)
def test_networkx_graphs_that_are_no_mechanism(graph):
    with pytest.raises(FormatError):
        MechanismGraph.from_networkx(graph)


def test_networkx_bad_attributes():
    bad = nx.path_graph(3)
    bad.graph["frame"] = "nobody"
    with pytest.raises(FormatError, match="frame"):
        MechanismGraph.from_networkx(bad)
    bad.graph["frame"] = [0]
    with pytest.raises(FormatError, match="frame"):
        MechanismGraph.from_networkx(bad)
    worse = nx.Graph()
    worse.add_edge(0, 1, mobility="many")
    with pytest.raises(FormatError, match="mobility"):
        MechanismGraph.from_networkx(worse)


def test_planarity():
    assert not MechanismGraph(6, [(a, b) for a in (0, 1, 2) for b in (3, 4, 5)]).is_planar
    assert WATT.is_planar


def test_importing_and_counting_loads_no_third_party_package():
    code = (
        "import sys; from graphsynth import MechanismGraph as M;"
        "g = M.from_text('Cl f0'); g.levels; g.key; g.rigid_subchain(); g.is_fractionated; g.girth; g.inversions();"
        "print([m for m in ('numpy', 'numba', 'networkx', 'scipy') if m in sys.modules])"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


def test_a_number_out_of_bounds_is_told_unless_it_is_endless():
    assert integer(7, "here", 0, 9, "count") == 7
    with pytest.raises(FormatError, match="count must be within 0 to 9, not 12"):
        integer(12, "here", 0, 9, "count")
    for huge in (10**18, -(10**5000)):
        with pytest.raises(FormatError, match="not a number of many digits"):
            integer(huge, "here", 0, 9, "count")
