"""Files of graphs and mechanisms: exact round trips, what other programs write, what a format cannot hold."""

from __future__ import annotations

import csv
from pathlib import Path

import networkx as nx
import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from graphsynth import formats
from graphsynth.core.errors import FormatError, GraphError, SpecError
from graphsynth.mechanism.joints import Cam, Gear, PinSlot, Prismatic, Revolute
from graphsynth.mechanism.laws import Driver, Linear, Table
from graphsynth.mechanism.model import Mechanism
from graphsynth.structure.graph import MechanismGraph
from graphsynth.synthesis import enumerate_chains
from graphsynth.testing import graphs

EVERY = sorted(set(formats.FORMATS) - {"toml", "graph6"})
MANY = [name for name in EVERY if formats.FORMATS[name].many]
OF_MECHANISMS = [name for name in formats.FORMATS if formats.FORMATS[name].mechanisms]


number = st.floats(-1e9, 1e9) | st.sampled_from([-0.0, 5e-324, 0.1, 1 / 3])
place = st.tuples(number, number)
positive = st.floats(1e-6, 1e6)


def joint_of(draw: st.DrawFn, a: int, b: int, mobility: int) -> object:
    if mobility == 1:
        kind = draw(st.sampled_from([Revolute, Prismatic]))
        more = (draw(number), draw(number)) if kind is Prismatic else ()
        return kind(a, b, draw(place), draw(place), *more)
    kind = draw(st.sampled_from([PinSlot, Gear, Cam]))
    if kind is PinSlot:
        return PinSlot(a, b, draw(place), draw(place), draw(number))
    if kind is Cam:
        return Cam(a, b, draw(place), draw(place), draw(number), 4.0, ((draw(st.floats(-1, 1)), 0.5),))
    return Gear(a, b, draw(place), draw(place), draw(positive), 2e6, draw(st.booleans()), draw(number))


@st.composite
def mechanisms(draw: st.DrawFn) -> Mechanism:
    links = draw(st.integers(2, 6))
    pairs = {(k, (k + 1) % links) if k + 1 < links else (0, k) for k in range(links)} if links > 2 else {(0, 1)}
    joints = [
        joint_of(draw, *(pair if draw(st.booleans()) else pair[::-1]), draw(st.integers(1, 2)))
        for pair in sorted(pairs)
    ]
    frame = draw(st.integers(0, links - 1))
    graph = MechanismGraph(links, [(*joint.pair, joint.mobility) for joint in joints], frame=frame)
    drivable = [joint for joint in joints if isinstance(joint, Revolute | Prismatic)]
    law = draw(st.sampled_from([Linear(), Linear(2.5, -1.0), Table((0.0, 1.0, 2.0), (0.0, 0.5, 2.0))]))
    drivers = [Driver(drivable[0].b, drivable[0].a, law)] if drivable else []
    names = st.text(st.characters(exclude_categories=["Cs", "Cc"]), min_size=1, max_size=6)
    points = draw(st.dictionaries(names, st.tuples(st.integers(0, links - 1), place), max_size=2))
    pose = [(0.0, 0.0, 0.0) if k == frame else (draw(number), draw(number), draw(number)) for k in range(links)]
    try:
        return Mechanism(graph, joints, drivers, points, draw(st.sampled_from([None, pose])))
    except ValueError:  # a link of length 0
        return draw(st.nothing())


@pytest.mark.long
@pytest.mark.parametrize("name", EVERY)
@given(graph=graphs())
def test_every_format_gives_back_the_labelled_graph(name: str, graph: MechanismGraph) -> None:
    assert formats.read_text(formats.write_text(graph, name), name) == [graph]


@pytest.mark.parametrize("name", EVERY)
@pytest.mark.parametrize("links", [4, 6, 8])
def test_chains_and_mechanisms_of_the_enumerator(name: str, links: int) -> None:
    found = [g for chain in enumerate_chains(links) for g in (chain, *chain.inversions())]
    for graph in found:
        assert formats.read_text(formats.write_text(graph, name).encode(), name) == [graph]
    if name in MANY:
        assert formats.read_text(formats.write_text(found, name), name) == found


@pytest.mark.long
@pytest.mark.parametrize("name", OF_MECHANISMS)
@settings(max_examples=40)
@given(mechanism=mechanisms())
def test_mechanisms_come_back_to_the_last_bit(name: str, mechanism: Mechanism) -> None:
    (back,) = formats.read_text(formats.write_text(mechanism, name), name)
    assert back == mechanism and repr(back) == repr(mechanism)  # repr: the sign of zero too


@pytest.mark.slow
@pytest.mark.parametrize("name", EVERY)
def test_the_largest_graph(name: str) -> None:
    pairs = [(a, b) for b in range(255) for a in range(b)]
    graph = MechanismGraph(255, pairs if name != "incidence" else pairs[:5000], frame=254)
    assert formats.read_text(formats.write_text(graph, name), name) == [graph]


def test_graph6_alone_holds_chains_only() -> None:
    chain = MechanismGraph.from_graph6("Cl")
    assert formats.read_text(formats.write_text([chain, chain], "graph6"), "graph6") == [chain, chain]
    with pytest.raises(GraphError, match="graph6 has no place for a frame"):
        formats.write_text(chain.with_frame(0), "graph6")
    assert nx.utils.graphs_equal(
        nx.from_graph6_bytes(formats.write_text(chain, "graph6").strip().encode()),
        nx.Graph([*chain.to_networkx().edges]),
    )


# --- other programs


@given(graph=graphs())
def test_networkx_reads_and_writes_the_same_graphml(graph: MechanismGraph) -> None:
    theirs = nx.parse_graphml(formats.write_text(graph, "graphml"), node_type=int)
    assert MechanismGraph.from_networkx(nx.Graph(theirs)) == graph
    text = "\n".join(nx.generate_graphml(graph.to_networkx()))
    assert formats.read_text(text, "graphml") == [graph]


@given(graph=graphs())
def test_networkx_reads_and_writes_the_same_edge_list(graph: MechanismGraph) -> None:
    view = graph.to_networkx()
    (back,) = formats.read_text(
        "\n".join([f"# links {graph.links}", f"# space {graph.space}", *nx.generate_edgelist(view)]), "edges"
    )
    assert back == MechanismGraph(graph.links, graph.joints, space=graph.space)
    lines = formats.write_text(back, "edges").splitlines()
    edges = nx.parse_edgelist([f"{line} 1" if line.count(" ") == 1 else line for line in lines], nodetype=int,
                              data=[("mobility", int)])  # fmt: skip
    assert {(*sorted((a, b)), m) for a, b, m in edges.edges(data="mobility")} == set(graph.joints)


@given(graph=graphs())
def test_matrices_agree_with_networkx(graph: MechanismGraph) -> None:
    view = graph.to_networkx()
    A = formats.adjacency_matrix(graph)
    assert np.array_equal(A, nx.to_numpy_array(view, weight="mobility", nodelist=range(graph.links)))
    B = formats.incidence_matrix(graph)
    theirs = nx.incidence_matrix(
        view, nodelist=range(graph.links), edgelist=[j[:2] for j in graph.joints], weight="mobility"
    )
    assert np.array_equal(B, theirs.toarray())
    unit = (B > 0).astype(int)
    assert np.array_equal(unit @ unit.T, (A > 0) + np.diag(graph.degrees))  # B B' = A + D
    assert formats.graph_from_adjacency(A, frame=graph.frame, space=graph.space) == graph
    if graph.joints:
        assert formats.graph_from_incidence(B, frame=graph.frame, space=graph.space) == graph


def test_matrices_pasted_from_other_programs() -> None:
    square = MechanismGraph(4, [(0, 1), (1, 2), (2, 3), (0, 3)])
    for text in (
        "[[0, 1, 0, 1],\n [1, 0, 1, 0],\n [0, 1, 0, 1],\n [1, 0, 1, 0]]",
        "[[0,1,0,1],[1,0,1,0],[0,1,0,1],[1,0,1,0]]",
        "0;1;0;1\n1;0;1;0\n0;1;0;1\n1;0;1;0\n",
        "0 1 0 1\r\n1 0 1 0\r\n0 1 0 1\r\n1 0 1 0\r\n",
    ):
        assert formats.read_text(text, "adjacency") == [square]


def test_dot_by_hand() -> None:
    text = """
    /* a comment */ strict graph "my linkage" {
      rankdir=LR; frame = ground  // the fixed link
      node [shape=box]; edge [mobility=2]
      ground -- crank [mobility=1];
    # a line of the preprocessor
      crank -- "con" + "rod" -- ground [label="a -- b; }", mobility="1"]
      ground -- crank2; edge [mobility=1] crank2 -- conrod
    }"""
    (graph,) = formats.read_text(text, "dot")
    assert graph == MechanismGraph(4, [(0, 1), (1, 2), (0, 2), (0, 3, 2), (2, 3)], frame=0)


def test_graphml_of_named_vertices_and_foreign_elements() -> None:
    text = """<graphml xmlns="http://graphml.graphdrawing.org/xmlns" xmlns:y="http://www.yworks.com/xml/graphml">
    <key id="d0" for="edge" attr.name="mobility" attr.type="int"><default>2</default></key>
    <key id="d1" for="graph" attr.name="frame" attr.type="string"/>
    <graph edgedefault="undirected"><data key="d1">b</data>
    <node id="a"><data key="g"><y:ShapeNode><y:Geometry x="1"/></y:ShapeNode></data></node><node id="b"/><node id="c"/>
    <edge source="a" target="b"/><edge source="b" target="c"><data key="d0"> 1 </data></edge></graph></graphml>"""
    assert formats.read_text(text, "graphml") == [MechanismGraph(3, [(0, 1, 2), (1, 2)], frame=1)]


def test_csv_is_a_plain_table(tmp_path: Path) -> None:
    file = tmp_path / "six.csv"
    assert formats.write(enumerate_chains(6), file) == 2
    with file.open(newline="") as lines:
        rows = list(csv.DictReader(lines))
    assert [(row["links"], row["joints"], row["mobility"], row["assortment"]) for row in rows] == [
        ("6", "7", "1", "n2=4 n3=2")
    ] * 2
    assert formats.read_text("key\r\n" + "\r\n".join(g.key for g in enumerate_chains(6)), "csv") == [
        g.canonical() for g in enumerate_chains(6)
    ]


# --- files


@pytest.mark.parametrize("name", EVERY)
def test_files_by_suffix(name: str, tmp_path: Path) -> None:
    graph = MechanismGraph.from_text("Cl f0 2:0-3")
    for suffix in formats.FORMATS[name].suffixes:
        file = tmp_path / f"four{suffix.upper()}"
        assert formats.write(graph, file) == 1
        assert formats.read(file) == graph
        with pytest.raises(FormatError, match="graph 2 does not exist, the file has 1"):
            formats.read(file, number=2)
    formats.write(graph, tmp_path / "four.dat", name)
    assert list(formats.read_all(tmp_path / "four.dat", name)) == [graph]


def test_a_refusal_leaves_the_file_that_was_there(tmp_path: Path) -> None:
    file = tmp_path / "x.adj"
    graph = MechanismGraph.from_text("Cl f0")
    formats.write(graph, file)
    with pytest.raises(GraphError, match="holds one graph in a file"):
        formats.write([graph, graph], file)
    assert formats.read(file) == graph and [p.name for p in tmp_path.iterdir()] == ["x.adj"]


def test_what_a_format_cannot_hold_is_said() -> None:
    crank = Mechanism(MechanismGraph(2, [(0, 1)], frame=0), [Revolute(0, 1)])
    with pytest.raises(GraphError, match=r"csv holds graphs, no dimensions; write mechanism\.graph, or use json"):
        formats.write_text(crank, "csv")
    with pytest.raises(GraphError, match="TOML holds dimensioned mechanisms"):
        formats.write_text(crank.graph, "toml")
    with pytest.raises(GraphError, match="one JSON document holds one mechanism"):
        formats.write_text([crank, crank], "json")
    with pytest.raises(GraphError, match="str is neither"):
        formats.write_text(["Cl"], "text")
    with pytest.raises(SpecError, match=r"the suffix '\.dat' names no format; use one of \.g6"):
        formats.read("x.dat")
    with pytest.raises(SpecError, match="format 'xyz' is unknown"):
        formats.read_text("", "xyz")


WRONG = [
    ("graphml", '<!DOCTYPE lolz [<!ENTITY lol "lol">]><graphml/>', "document type declaration", "line 1"),
    ("graphml", "<graphml><graph edgedefault='directed'/></graphml>", "directed", "line 1"),
    ("graphml", "<graphml>\n<graph><node id='a'/>\n<edge source='a' target='b'/></graph></graphml>", "not a vertex",
     "line 3"),
    ("graphml", "<graphml><graph><node id='a'/><node id='a'/></graph></graphml>", "twice", "line 1"),
    ("graphml", "<graphml>", "not XML", "line 1, column 10"),
    ("graphml", "<a>" * 40, "expected <graphml>", "line 1"),
    ("graphml", "<graphml>" + "<a>" * 40, "deeper than 32", "line 1"),
    ("dot", "digraph { a -> b }", "directed", "line 1"),
    ("dot", "graph {\n a -- b\n a -- b }", "a second time", "line 3"),
    ("dot", "graph { a -- ", "ends within a graph", "line 1"),
    ("dot", "graph { subgraph x { a } }", "subgraph", "line 1"),
    ("dot", "graph { a -- <b> }", "begins nothing", "line 1"),
    ("dot", "graph { a -- b [mobility=high] }", "mobility = 'high' is not a whole number", "line 1"),
    ("json", '{"links": 2, "joints": [[0, 1.5]]}', "whole numbers", "record, joint 1"),
    ("json", '{"links": 2, "joints": [[0, true]]}', "whole numbers", "record, joint 1"),
    ("json", '{"links": 2, "joints": [], "size": 3}', "unknown key 'size'", "record"),
    ("json", "[" * 100_000, "not JSON", ""),
    ("json", '{"links": ' + "9" * 5000 + ', "joints": []}', "not JSON that can be read", "text"),
    ("jsonl", '{"links": 1, "joints": []}\n{"links": NaN}', "NaN is not a number of JSON", "line 2"),
    ("csv", "a,b\n1,2\n", "none of the columns text, key, graph6", "line 1"),
    ("csv", 'text\n"Cl', "not CSV", "line 2"),
    ("csv", "text\nCl\nBx\n", "the last byte has bits", "line 3"),
    ("edges", "0 1\n1 x\n", "'x' is not a whole number", "line 2"),
    ("edges", "0 1\n1\n", "a joint is 'a b'", "line 2"),
    ("edges", "", "no joint", "end"),
    ("adjacency", "0 1\n0 0\n", r"entry \(0, 1\) is 1, entry \(1, 0\) is 0", "row 1"),
    ("adjacency", "1", "jointed to itself", "row 1"),
    ("adjacency", "0 1 1\n1 0\n", "2 numbers; the first row has 3", "line 2"),
    ("adjacency", "# links 3\n0 1\n1 0", "2 rows, but the head says 3 links", "head"),
    ("incidence", "1 1\n1 0\n0 0", "two equal entries", "column 2"),
    ("incidence", "1 1\n1 1", "jointed twice", "joint 2"),
    ("text", "Cl\nCl f9\n", "frame must be within 0 to 3", "line 2"),
    ("toml", "format = ", "not TOML", "text"),
]  # fmt: skip


@pytest.mark.parametrize(("name", "text", "message", "where"), WRONG, ids=range(len(WRONG)))
def test_unreadable_input_says_what_and_where(name: str, text: str, message: str, where: str) -> None:
    with pytest.raises(FormatError, match=message) as caught:
        formats.read_text(text, name)
    assert caught.value.place and where in caught.value.place


def test_arrays_that_are_no_matrices() -> None:
    for bad in ([[0, 1], [1]], [[0.5]], [["a"]], [], [[[0]]], [[0, -1], [-1, 0]], [[0, 9], [9, 0]], [[np.nan]]):
        with pytest.raises(FormatError):
            formats.graph_from_adjacency(bad)
        with pytest.raises(FormatError):
            formats.graph_from_incidence(bad)
