"""The scripts of the page against the package: keys, groups, readers, files; in a real Chromium."""

import json
import random
from itertools import combinations, product

import networkx as nx
import pytest

from graphsynth import MechanismGraph, enumerate_chains
from graphsynth.formats.registry import read_text
from graphsynth.structure.assur import decompose, find_fault

FAMOUS = [
    nx.petersen_graph(), nx.complete_graph(9), nx.hypercube_graph(4), nx.dodecahedral_graph(),
    nx.circulant_graph(20, [1, 4]), nx.empty_graph(20), nx.complete_bipartite_graph(6, 6), nx.empty_graph(1),
]  # fmt: skip


def plain(graph):
    return [graph.links, [list(joint) for joint in graph.joints], graph.frame, graph.space]


def keys_in_browser(window, graphs):
    """Key, canonical graph from the key, order of the group and orbits, by the scripts of the page."""
    return window.execute_script(
        """return arguments[0].map(([n, joints, frame, space]) => {
             const found = Atlas.label(Atlas.graph(n, joints, frame, space)), again = Atlas.decodeKey(found.key);
             const back = JSON.stringify(again) === JSON.stringify(found.canonical);
             return [found.key, back, String(found.order), found.orbits];
           })""",
        [plain(graph) for graph in graphs],
    )


def same_keys(window, graphs):
    for graph, (key, back, order, orbits) in zip(graphs, keys_in_browser(window, graphs), strict=True):
        assert key == graph.key
        assert back
        assert int(order) == graph.labelling.order
        assert orbits == list(graph.labelling.orbits)


def shuffled(graph, lots):
    to = list(range(graph.links))
    lots.shuffle(to)
    return graph.relabelled(to)


def test_keys_of_all_chains_up_to_ten_links_in_any_numbering(page):
    lots = random.Random(7)
    chains = [chain for links in (4, 6, 8, 10) for chain in enumerate_chains(links)]
    assert len(chains) == 1 + 2 + 16 + 230
    window = page()
    same_keys(window, chains)
    same_keys(window, [shuffled(chain, lots) for chain in chains for _ in range(3)])
    same_keys(window, [MechanismGraph(c.links, c.joints, frame=lots.randrange(c.links)) for c in chains])


def test_keys_of_random_and_symmetric_graphs(page):
    lots = random.Random(11)
    graphs = []
    for _ in range(600):
        links, density = lots.randint(1, 15), lots.random()
        pairs = [pair for pair in combinations(range(links), 2) if lots.random() < density]
        joints = [(a, b, lots.choice((1, 1, 2)) if links % 2 else 1) for a, b in pairs]
        graphs.append(MechanismGraph(links, joints, frame=lots.choice((None, lots.randrange(links)))))
    for famous in map(nx.convert_node_labels_to_integers, FAMOUS):
        graphs.append(shuffled(MechanismGraph(len(famous), list(famous.edges)), lots))
        graphs.append(MechanismGraph(len(famous), list(famous.edges), frame=lots.randrange(len(famous))))
    same_keys(page(), graphs)


def test_different_graphs_get_different_keys(page):
    # regular graphs that refinement alone cannot tell apart: Shrikhande and the rook's graph
    rook = nx.convert_node_labels_to_integers(nx.line_graph(nx.complete_bipartite_graph(4, 4)))
    steps = [(0, 1), (1, 0), (1, 1)]
    shrikhande = nx.Graph(
        (4 * x + y, 4 * ((x + u) % 4) + (y + v) % 4) for x in range(4) for y in range(4) for u, v in steps
    )
    first, second = (MechanismGraph(16, list(graph.edges)) for graph in (rook, shrikhande))
    found = [row[0] for row in keys_in_browser(page(), [first, second])]
    assert found == [first.key, second.key] and found[0] != found[1]


def hard_graphs():
    """Symmetric graphs of 24 to 64 links, where searches of this kind are slowest."""
    latin = [((x, y), (u, v)) for x, y, u, v in product(range(8), repeat=4)]
    same = [(p, q) for p, q in latin if p < q and (p[0] == q[0] or p[1] == q[1] or p[0] ^ p[1] == q[0] ^ q[1])]
    return [
        nx.complete_graph(30), nx.complete_graph(64), nx.complete_bipartite_graph(12, 12),
        nx.complete_bipartite_graph(32, 32), nx.star_graph(63), nx.empty_graph(64), nx.hypercube_graph(6),
        nx.complete_multipartite_graph(*[4] * 16), nx.disjoint_union_all([nx.petersen_graph()] * 6), nx.Graph(same),
        nx.kneser_graph(8, 2), nx.random_regular_graph(3, 64, 1),
        nx.disjoint_union_all([nx.random_regular_graph(4, 9, 126 + k) for k in range(7)]),
    ]  # fmt: skip


def test_a_hard_graph_gets_its_key_in_time(page):
    lots = random.Random(3)
    window = page()
    for graph in map(nx.convert_node_labels_to_integers, hard_graphs()):
        to = list(graph)
        lots.shuffle(to)
        again = nx.relabel_nodes(graph, dict(enumerate(to)))
        *found, took = window.execute_script(
            """const [n, ...all] = arguments, begin = performance.now();
               return [...all.map(joints => Atlas.label(Atlas.graph(n, joints)).key), performance.now() - begin];""",
            len(graph),
            *([sorted(edge) for edge in one.edges] for one in (graph, again)),
        )
        assert found == 2 * [MechanismGraph(len(graph), [tuple(sorted(edge)) for edge in graph.edges]).key]
        assert took < 10_000


def mechanisms(chain):
    for frame in range(chain.links):
        for driver in (b if a == frame else a for a, b, _ in chain.joints if frame in (a, b)):
            yield MechanismGraph(chain.links, chain.joints, frame=frame), driver


def same_groups(window, chains):
    cases = [(graph, driver) for chain in chains for graph, driver in mechanisms(chain)]
    found = window.execute_script(
        """return arguments[0].map(([n, joints, frame, space, driver]) =>
             Atlas.groups(Atlas.graph(n, joints, frame, space), [driver]))""",
        [[*plain(graph), driver] for graph, driver in cases],
    )
    for (graph, driver), groups in zip(cases, found, strict=True):
        if find_fault(graph, [driver]) is not None:
            assert groups is None
            continue
        expected = decompose(graph, [driver]).groups
        assert [(g["links"], g["order"], g["stage"]) for g in groups] == [
            (list(e.links), e.order, e.stage) for e in expected
        ]


def test_structural_groups_of_all_mechanisms_up_to_eight_links(page):
    same_groups(page(), [chain for links in (4, 6, 8) for chain in enumerate_chains(links)])


@pytest.mark.slow
def test_structural_groups_of_all_mechanisms_of_ten_links(page):
    same_groups(page(), list(enumerate_chains(10)))


def test_groups_of_two_drivers_and_of_gears(page):
    window = page()
    five_bar = MechanismGraph(5, [(0, 1), (1, 2), (2, 3), (3, 4), (0, 4)], frame=0)
    geared = MechanismGraph(4, [(0, 1), (1, 2), (0, 2), (2, 3, 2), (0, 3)], frame=0)
    run = "return Atlas.groups(Atlas.graph(...arguments[0]), arguments[1])"
    assert [g["links"] for g in window.execute_script(run, plain(five_bar), [1, 4])] == [[2, 3]]
    assert window.execute_script(run, plain(five_bar), [1]) is None  # mobility 2 needs two drivers
    assert window.execute_script(run, plain(geared), [3]) is None or find_fault(geared, [3]) is None


def test_classes_and_symmetry_on_the_page_are_those_of_the_catalogue(page, catalogue):
    stored = dict(catalogue.connection.execute("SELECT key, class FROM groups").fetchall())
    window = page()
    shown = window.execute_async_script(
        "const done = arguments[arguments.length - 1];"
        "Atlas.loadClasses().then(() => done(arguments[0].map(key => Atlas.classOf(key))))",
        list(stored),
    )
    assert shown == list(stored.values())
    rows = window.execute_script(
        """return Atlas.rows.map(r =>
             [r.key, r.label, r.assortment, r.symmetry, r.inversions, r.girth, r.planar, r.low, r.high])"""
    )
    query = """SELECT c.key, label, assortment, automorphisms, inversions, girth, planar, MIN(class), MAX(class)
               FROM chains c JOIN mechanisms USING (chain_id) GROUP BY chain_id"""
    expected = {row[0]: [*row[:6], bool(row[6]), *row[7:]] for row in catalogue.connection.execute(query)}
    assert {row[0]: row for row in rows} == expected


WATT = MechanismGraph(6, [(0, 1), (1, 2), (2, 3), (0, 3), (2, 4), (4, 5), (3, 5)])

PASTED = {
    "matrix": "0 1 0 1 0 0\n1 0 1 0 0 0\n0 1 0 1 1 0\n1 0 1 0 0 1\n0 0 1 0 0 1\n0 0 0 1 1 0",
    "numpy": "[[0, 1, 0, 1, 0, 0],\n [1, 0, 1, 0, 0, 0],\n [0, 1, 0, 1, 1, 0],\n [1, 0, 1, 0, 0, 1],\n"
    " [0, 0, 1, 0, 0, 1],\n [0, 0, 0, 1, 1, 0]]",
    "matlab": "[0 1 0 1 0 0; 1 0 1 0 0 0; 0 1 0 1 1 0; 1 0 1 0 0 1; 0 0 1 0 0 1; 0 0 0 1 1 0]",
    "digits": "010100\n101000\n010110\n101001\n001001\n000110",
    "joints": "0-1, 1-2, 2-3, 0-3, 2-4, 4-5, 3-5",
    "pairs": "[(0, 1), (1, 2), (2, 3), (0, 3), (2, 4), (4, 5), (3, 5)]",
    "lines": "1 2\n2 3\n3 4\n1 4\n3 5\n5 6\n4 6",
    "gaps": "10-20; 20-30; 30-40; 10-40; 30-70; 70-71; 40-71",
    "graph6": WATT.graph6(),
    "header": ">>graph6<<" + WATT.graph6(),
    "key": WATT.key,
    "json": json.dumps({"links": 6, "joints": [list(joint) for joint in WATT.joints]}),
}


def test_what_people_paste_is_read(page):
    run = "return arguments[0].map(text => Atlas.label(Atlas.read(text).graph).key)"
    found = dict(zip(PASTED, page().execute_script(run, list(PASTED.values())), strict=True))
    assert found == dict.fromkeys(PASTED, WATT.key)


def test_one_line_forms_with_frames_and_mobilities_are_read(page):
    graphs = [
        MechanismGraph(4, [(0, 1), (1, 2), (2, 3), (0, 3)], frame=2),
        MechanismGraph(3, [(0, 1), (1, 2, 2), (0, 2)], frame=0),
        MechanismGraph(5, [(0, 1, 2), (1, 2, 5), (2, 3), (3, 4, 4), (0, 4)], frame=1, space=6),
    ]
    window = page()
    for graph in graphs:
        found = window.execute_script("return Atlas.read(arguments[0]).graph", graph.to_text())
        assert MechanismGraph(found["links"], found["joints"], frame=found["frame"], space=found["space"]) == graph


UNREADABLE = [
    ("", "Nothing is pasted yet."),
    ("0 1 0\n1 0 1\n1 1 0", "not symmetric: row 1, column 3"),
    ("1 1\n1 0", "joins link 0 to itself"),
    ("0-1, 1-2, 2", "5 numbers make no pairs"),
    ("7-9, 9-7", "Links 7 and 9 are joined twice"),
    ("( - )", "no number in this"),
    ("5-5", "Link 5 cannot be jointed to itself"),
    ("G@Q?~", "graph6 of 8 links has 5 characters"),
    ("C] f9", "Frame 9 does not exist"),
    ("C] 2:0-1", "0-1 is given a mobility, but is no joint"),
    ("{", "begins like JSON"),
    ('{"links": 4}', "JSON of a graph has"),
    ("drop table chains", "graph6 of 37 links has 111 characters"),
    ("1BAN", "not a whole key"),
    ("<script>alert(1)</script>", "not graph6"),
    ("0-1," * 6000, "at most 20000 are read"),
]


def test_what_cannot_be_read_is_told_in_one_sentence(page):
    found = page().execute_script(
        """return arguments[0].map(text => {
             try { Atlas.read(text); return "was read"; }
             catch (fault) { return fault instanceof Atlas.Fault ? fault.message : "crash: " + fault.stack; }
           })""",
        [text for text, _ in UNREADABLE],
    )
    for (_, sentence), told in zip(UNREADABLE, found, strict=True):
        assert sentence in told and "\n" not in told


def test_reading_any_text_throws_nothing_but_faults(page):
    lots = random.Random(3)
    letters = '01 \n,;-[]{}()#"fms:~?@ABC_\x00é\t.|12'
    whole = [*PASTED.values(), WATT.to_text(), "# frame 2\n0 1\n"]
    texts = ["".join(lots.choices(letters, k=lots.randint(0, 40))) for _ in range(1500)]
    for _ in range(1500):
        text = list(lots.choice(whole))
        for _ in range(lots.randint(1, 4)):
            text[lots.randrange(len(text))] = lots.choice(letters)
        texts.append("".join(text))
    crashes = page().execute_script(
        """return arguments[0].flatMap(text => {
             try { Atlas.read(text); return []; }
             catch (fault) { return fault instanceof Atlas.Fault ? [] : [[text, fault.stack]]; }
           })""",
        texts,
    )
    assert crashes == []


def test_saved_files_are_read_by_the_package(page):
    window = page()
    suffixes = {
        "graphml": "graphml",
        "json": "json",
        "dot": "dot",
        "edges": "edges",
        "adj": "adjacency",
        "inc": "incidence",
    }
    for chain in enumerate_chains(8):
        for frame in (None, 3):
            graph = MechanismGraph(8, MechanismGraph.from_key(chain.key).joints, frame=frame)
            files = window.execute_script(
                "return Atlas.filesOf(Atlas.graph(...arguments[0]), {label: 'x'}, {})", plain(graph)
            )
            texts = {name.rsplit(".", 1)[1]: text for name, _, _, text in files}
            assert MechanismGraph.from_graph6(texts.pop("g6").strip()) == graph.without_frame()
            for suffix, text in texts.items():
                assert read_text(text, suffixes[suffix]) == [graph], suffix


def test_links_that_hold_a_chain_together(page):
    lots = random.Random(5)
    graphs = [nx.gnm_random_graph(lots.randint(3, 9), lots.randint(3, 14), seed=k) for k in range(300)]
    graphs = [graph for graph in graphs if nx.is_connected(graph)]
    cuts = page().execute_script(
        "return arguments[0].map(([n, joints]) => Atlas.cutLink(Atlas.graph(n, joints)))",
        [[len(graph), [sorted(edge) for edge in graph.edges]] for graph in graphs],
    )
    assert len(graphs) > 100 and None in cuts
    for graph, cut in zip(graphs, cuts, strict=True):
        assert cut == min(nx.articulation_points(graph), default=None)
