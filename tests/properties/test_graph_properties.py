import networkx as nx
import pytest
from hypothesis import given, settings, strategies as st

from graphsynth.core.errors import FormatError
from graphsynth.structure.graph import MechanismGraph
from graphsynth.testing import graphs


@st.composite
def graphs_and_permutations(draw):
    graph = draw(graphs())
    return graph, draw(st.permutations(range(graph.links)))


@given(graphs_and_permutations())
@settings(deadline=None)
def test_relabelling_changes_nothing_that_matters(case):
    graph, permutation = case
    other = graph.relabelled(permutation)
    assert other.key == graph.key
    assert other.canonical() == graph.canonical()
    assert other.automorphism_order == graph.automorphism_order
    assert other.mobility == graph.mobility
    assert other.loops == graph.loops
    assert other.assortment == graph.assortment
    assert other.girth == graph.girth
    mapped = sorted(tuple(sorted(permutation[link] for link in orbit)) for orbit in graph.orbits)
    assert mapped == sorted(other.orbits)
    assert [g.key for g in other.inversions()] == [g.key for g in graph.inversions()]
    assert (other.rigid_subchain() is None) == (graph.rigid_subchain() is None)


@given(graphs())
@settings(deadline=None)
def test_generators_are_automorphisms_and_orbits_divide_the_order(graph):
    for generator in graph.labelling.generators:
        assert graph.relabelled(generator) == graph
    for orbit in (*graph.orbits, *graph.joint_orbits):
        assert graph.automorphism_order % len(orbit) == 0
    assert sorted(link for orbit in graph.orbits for link in orbit) == list(range(graph.links))


@given(graphs())
def test_handshake_and_mobility_formula(graph):
    assert sum(graph.degrees) == 2 * len(graph.joints)
    moving = sum(a * count for a, count in graph.assortment.items())
    frame = 0 if graph.frame is None else graph.degrees[graph.frame]
    assert moving + frame == 2 * len(graph.joints)
    parts = len(graph.components)
    # W = G - v Pi for a connected graph; each further part adds Pi.
    assert graph.mobility == graph.sub_edges - graph.space * graph.loops + graph.space * (parts - 1)


@given(graphs())
def test_joints_run_inside_a_level_or_to_the_next(graph):
    if graph.frame is None or not graph.is_connected:
        return
    level_of = {link: number for number, level in enumerate(graph.levels) for link in level}
    assert all(abs(level_of[a] - level_of[b]) <= 1 for a, b, _ in graph.joints)
    for number, level in enumerate(graph.levels[1:]):
        assert all(any(level_of[b] == number for b in graph.to_networkx()[a]) for a in level)


@given(graphs())
@settings(deadline=None)
def test_round_trips(graph):
    assert MechanismGraph.from_text(graph.to_text()) == graph
    assert MechanismGraph.from_text(graph.to_text().encode()) == graph
    assert MechanismGraph.from_networkx(graph.to_networkx()) == graph
    assert MechanismGraph.from_key(graph.key) == graph.canonical()
    assert MechanismGraph(graph.links, graph.joints, frame=graph.frame, space=graph.space) == graph


def accepted_or_format_error(read, text):
    try:
        graph = read(text)
    except FormatError as error:
        assert str(error)
    else:
        assert MechanismGraph.from_text(graph.to_text()) == graph


READERS = [MechanismGraph.from_graph6, MechanismGraph.from_text, MechanismGraph.from_key]


@pytest.mark.parametrize("read", READERS)
@given(st.binary(max_size=200) | st.text(max_size=200))
@settings(deadline=None)
def test_any_bytes_or_text_give_a_graph_or_a_format_error(read, text):
    accepted_or_format_error(read, text)


GRAPH_LIKE = st.text(alphabet="?@ABCDEF_wl~ f0123456789:,-pi1", max_size=40)


@pytest.mark.parametrize("read", READERS)
@given(GRAPH_LIKE | GRAPH_LIKE.map(lambda s: "1B" + s) | GRAPH_LIKE.map(lambda s: "Cl " + s))
@settings(deadline=None)
def test_text_that_looks_like_a_graph(read, text):
    accepted_or_format_error(read, text)


@given(graphs(), st.integers(0, 10**6), st.integers(0, 255))
@settings(deadline=None)
def test_one_wrong_byte(graph, place, byte):
    for read, text in ((MechanismGraph.from_text, graph.to_text()), (MechanismGraph.from_key, graph.key)):
        data = bytearray(text.encode())
        data[place % len(data)] = byte
        accepted_or_format_error(read, bytes(data))
        accepted_or_format_error(read, data.decode("latin-1"))


ANYTHING = st.none() | st.integers() | st.text(max_size=3) | st.floats() | st.lists(st.integers(), max_size=3)


@given(
    st.lists(st.tuples(st.integers(-3, 9) | st.text(max_size=2), st.integers(-3, 9))),
    st.dictionaries(st.sampled_from(["frame", "space"]), ANYTHING),
    ANYTHING,
)
def test_any_networkx_graph_gives_a_graph_or_a_format_error(edges, attributes, mobility):
    graph = nx.Graph(edges, **attributes)
    for _, _, data in graph.edges(data=True):
        data["mobility"] = mobility
        break
    accepted_or_format_error(MechanismGraph.from_networkx, graph)


@given(st.lists(st.lists(ANYTHING, max_size=4) | ANYTHING, max_size=4), ANYTHING, ANYTHING, ANYTHING)
def test_any_arguments_give_a_graph_or_a_format_error(joints, links, frame, space):
    def make(_):
        return MechanismGraph(links, joints, frame=frame, space=space)

    accepted_or_format_error(make, None)
