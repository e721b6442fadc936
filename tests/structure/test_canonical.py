import itertools
import random
import shutil
import subprocess
from base64 import urlsafe_b64encode
from math import factorial, prod
from pathlib import Path

import networkx as nx
import numpy as np
import pytest

from graphsynth.core.errors import FormatError
from graphsynth.structure import canonical, kernels
from graphsynth.structure.graph import MechanismGraph
from graphsynth.structure.search import CanonicalSearch

GOLDEN = Path(__file__).parents[1] / "golden" / "canonical_keys.tsv"


def compiled(n, layers, colours):
    """Run the kernel on the arguments of CanonicalSearch; return the same results as CanonicalSearch."""
    workspace = kernels.canon_workspace(n, len(layers))
    count = kernels.canon(
        n, len(layers), np.array(layers, dtype=np.uint64), np.array(colours, dtype=np.int64), *workspace
    )
    lab, form, generators, index, orbits = (array.tolist() for array in workspace[:5])
    return lab, form, generators[:count], prod(index), orbits


def layers_of(graph, colours=1):
    layers = [[0] * len(graph) for _ in range(colours)]
    for a, b, data in graph.edges(data=True):
        layers[data.get("colour", 0)][a] |= 1 << b
        layers[data.get("colour", 0)][b] |= 1 << a
    return layers


def random_coloured(rng, largest, colours=3):
    n = rng.randint(1, largest)
    graph = nx.gnp_random_graph(n, rng.uniform(0.1, 0.9), seed=rng.randrange(10**6))
    for a, b in graph.edges:
        graph.edges[a, b]["colour"] = rng.randrange(colours)
    for v in graph:
        graph.nodes[v]["colour"] = rng.choice((0, 0, 0, 1))
    return graph, layers_of(graph, colours), [graph.nodes[v]["colour"] for v in range(n)]


def equal_paths(count, links):
    """Return two vertices joined by ``count`` paths of ``links`` vertices each."""
    graph = nx.Graph()
    for path in range(count):
        nx.add_path(graph, ["a", *((path, i) for i in range(links)), "b"])
    return graph


def shrikhande():
    steps = ((0, 1), (1, 0), (1, 1))
    cells = itertools.product(range(4), range(4))
    return nx.Graph([((i, j), ((i + di) % 4, (j + dj) % 4)) for i, j in cells for di, dj in steps])


def rook(size):
    return nx.line_graph(nx.complete_bipartite_graph(size, size))


def cfi(base, twisted):
    """Return the Cai-Fuerer-Immerman graph of a base graph: twisted and plain look alike to refinement."""
    graph = nx.Graph()
    edges = [tuple(sorted(edge)) for edge in base.edges]
    for v in base:
        around = [edge for edge in edges if v in edge]
        for size in range(0, len(around) + 1, 2):
            for chosen in itertools.combinations(around, size):
                graph.add_edges_from((("middle", v, chosen), ("end", v, edge, edge in chosen)) for edge in around)
    for place, (a, b) in enumerate(edges):
        for side in (False, True):
            graph.add_edge(("end", a, (a, b), side), ("end", b, (a, b), side ^ (twisted and place == 0)))
    return graph


def projective_plane(q):
    """Return the incidence graph of the projective plane over the integers modulo a prime q."""
    points = [p for p in itertools.product(range(q), repeat=3) if any(p) and next(x for x in p if x) == 1]
    graph = nx.Graph()
    for point, line in itertools.product(points, points):
        if sum(x * y for x, y in zip(point, line, strict=True)) % q == 0:
            graph.add_edge(("point", point), ("line", line))
    return graph


# Group orders from the literature or elementary counting.
SYMMETRIC = {
    "Petersen": (nx.petersen_graph(), 120),
    "cube": (nx.hypercube_graph(3), 48),
    "6-cube": (nx.hypercube_graph(6), 2**6 * factorial(6)),
    "K7,7": (nx.complete_bipartite_graph(7, 7), 2 * factorial(7) ** 2),
    "K32,32": (nx.complete_bipartite_graph(32, 32), 2 * factorial(32) ** 2),
    "K40": (nx.complete_graph(40), factorial(40)),
    "no joints": (nx.empty_graph(64), factorial(64)),
    "12 equal paths": (equal_paths(12, 1), 2 * factorial(12)),
    "12 equal paths of 5": (equal_paths(12, 5), 2 * factorial(12)),
    "60-cycle": (nx.cycle_graph(60), 120),
    "Shrikhande": (shrikhande(), 192),
    "rook 4x4": (rook(4), 1152),
    "rook 8x8": (rook(8), 2 * factorial(8) ** 2),
    "10 pentagons": (nx.disjoint_union_all([nx.cycle_graph(5)] * 10), 10**10 * factorial(10)),
    "two pairs of strongly regular graphs": (
        nx.disjoint_union_all([rook(4), shrikhande(), rook(4), shrikhande()]),
        (2 * 1152**2) * (2 * 192**2),
    ),
    "PG(2,5)": (projective_plane(5), 2 * 372000),
}


@pytest.mark.parametrize(
    "name", [pytest.param(name, marks=pytest.mark.long if name == "PG(2,5)" else ()) for name in SYMMETRIC]
)
def test_symmetric_graphs(name):
    graph, order = SYMMETRIC[name]
    graph = nx.convert_node_labels_to_integers(graph)
    layers, n = layers_of(graph), len(graph)
    lab, form, generators, found, orbits = compiled(n, layers, [0] * n)
    assert found == order
    shuffled = random.Random(1).sample(range(n), n)
    other = CanonicalSearch(n, layers_of(nx.relabel_nodes(graph, dict(enumerate(shuffled)))), [0] * n).run()
    assert other.form == form
    assert prod(other.index) == order
    assert sorted(lab) == list(range(n))
    for chosen in (generators, other.generators):  # each joins orbits that those before it have left apart
        joined = nx.empty_graph(n)
        for generator in chosen:
            apart = nx.number_connected_components(joined)
            joined.add_edges_from(enumerate(generator))
            assert nx.number_connected_components(joined) < apart
    for generator in generators:
        assert all(graph.has_edge(generator[a], generator[b]) for a, b in graph.edges)
        assert all(orbits[v] == orbits[generator[v]] for v in range(n))


@pytest.mark.parametrize(
    ("one", "other"),
    [
        (rook(4), shrikhande()),
        (cfi(nx.complete_graph(4), False), cfi(nx.complete_graph(4), True)),
        (cfi(nx.complete_bipartite_graph(3, 3), False), cfi(nx.complete_bipartite_graph(3, 3), True)),
        (cfi(nx.petersen_graph(), False), cfi(nx.petersen_graph(), True)),
        (nx.cycle_graph(6), nx.disjoint_union(nx.cycle_graph(3), nx.cycle_graph(3))),
    ],
)
def test_pairs_that_refinement_cannot_tell_apart(one, other):
    keys = [MechanismGraph.from_networkx(nx.convert_node_labels_to_integers(graph)).key for graph in (one, other)]
    assert keys[0] != keys[1]


def test_kernel_and_plain_search_are_the_same():
    rng = random.Random(3)
    for _ in range(600):
        graph, layers, colours = random_coloured(rng, 12, rng.randint(1, 12))
        n = len(graph)
        plain = CanonicalSearch(n, layers, colours).run()
        lab, form, generators, order, orbits = compiled(n, layers, colours)
        assert (lab, form, generators, order, orbits) == (
            plain.order_of_vertices,
            plain.form,
            plain.generators,
            prod(plain.index),
            plain.orbits,
        )


def relabelled(graph, seed):
    places = random.Random(seed).sample(range(len(graph)), len(graph))
    return nx.relabel_nodes(nx.convert_node_labels_to_integers(graph), dict(enumerate(places)))


@pytest.mark.parametrize(
    "graph",
    [
        nx.petersen_graph(), nx.hypercube_graph(4), nx.paley_graph(13).to_undirected(), nx.icosahedral_graph(),
        nx.line_graph(nx.complete_bipartite_graph(4, 4)), nx.circulant_graph(12, [1, 5]), nx.desargues_graph(),
        nx.disjoint_union_all([nx.cycle_graph(4)] * 4), nx.disjoint_union_all([nx.petersen_graph()] * 3),
    ],
)  # fmt: skip
def test_every_generator_joins_orbits(graph):
    """There are at most as many as vertices less orbits: an automorphism that joins nothing new is no generator."""
    for seed in range(6):
        own, n = relabelled(graph, seed), len(graph)
        plain = CanonicalSearch(n, layers_of(own), [0] * n).run()
        for generators, orbits in ((plain.generators, plain.orbits), compiled(n, layers_of(own), [0] * n)[2::2]):
            joined = nx.Graph()
            joined.add_nodes_from(range(n))
            for generator in generators:
                before = nx.number_connected_components(joined)
                joined.add_edges_from(enumerate(generator))
                assert nx.number_connected_components(joined) < before
            assert nx.number_connected_components(joined) == len(set(orbits))


@pytest.mark.parametrize("seed", range(4))
def test_kernel_and_plain_search_on_larger_graphs(seed):
    graph = nx.random_regular_graph(3, 64, seed=seed) if seed % 2 else nx.gnp_random_graph(64, 0.1, seed=seed)
    plain = CanonicalSearch(64, layers_of(graph), [0] * 64).run()
    assert compiled(64, layers_of(graph), [0] * 64)[:3] == (plain.order_of_vertices, plain.form, plain.generators)


def test_key_equality_is_isomorphism_by_networkx():
    rng = random.Random(4)
    seen = {True: 0, False: 0}
    for _ in range(400):
        n = rng.randint(2, 7)
        joints = rng.sample(list(itertools.combinations(range(n), 2)), rng.randint(1, n * (n - 1) // 2))
        pair = []
        for _ in range(2):
            coloured = [(a, b, rng.choice((1, 1, 1, 2))) for a, b in joints]
            pair.append(MechanismGraph(n, coloured, frame=rng.randrange(n)).relabelled(rng.sample(range(n), n)))
        views = [graph.to_networkx() for graph in pair]
        for graph, view in zip(pair, views, strict=True):
            nx.set_node_attributes(view, {v: v == graph.frame for v in view}, "frame")
        isomorphic = nx.is_isomorphic(
            *views, node_match=lambda x, y: x["frame"] == y["frame"], edge_match=lambda x, y: x == y
        )
        seen[isomorphic] += 1
        assert (pair[0].key == pair[1].key) == isomorphic
    assert min(seen.values()) > 20


def test_against_pynauty():
    pynauty = pytest.importorskip("pynauty")
    rng = random.Random(5)
    by_certificate, by_form = {}, {}
    for place in range(1500):
        n = rng.randint(2, 6) if place % 2 else rng.randint(7, 40)
        graph = nx.gnp_random_graph(n, rng.choice((0.1, 0.3, 0.5)), seed=place)
        theirs = pynauty.Graph(n, adjacency_dict={v: list(graph[v]) for v in graph})
        _, mantissa, exponent, their_orbits, _ = pynauty.autgrp(theirs)
        _, form, _, order, orbits = compiled(n, layers_of(graph), [0] * n)
        assert order == pytest.approx(mantissa * 10**exponent, rel=1e-9)
        assert orbits == list(their_orbits)
        by_certificate.setdefault((n, pynauty.certificate(theirs)), []).append(place)
        by_form.setdefault((n, str(form)), []).append(place)
    assert sorted(by_certificate.values()) == sorted(by_form.values())
    assert len(by_form) < 1400  # isomorphic pairs occurred


def test_group_order_by_brute_force():
    rng = random.Random(6)
    for _ in range(150):
        graph, layers, colours = random_coloured(rng, 6, 2)
        n = len(graph)
        matrix = [[tuple(layer[a] >> b & 1 for layer in layers) for b in range(n)] for a in range(n)]
        group = [
            p
            for p in itertools.permutations(range(n))
            if all(colours[p[a]] == colours[a] for a in range(n))
            and all(matrix[p[a]][p[b]] == matrix[a][b] for a in range(n) for b in range(a))
        ]
        _, _, generators, order, orbits = compiled(n, layers, colours)
        assert order == len(group)
        assert orbits == [min(p[v] for p in group) for v in range(n)]
        assert {tuple(g) for g in generators} <= set(group)


def planar_one_freedom_chains(links):
    """Return graph6 lines of the chains among the output of geng, by counting over all subsets of links."""
    joints = (3 * links - 4) // 2
    command = ["nauty-geng", "-Ctq", "-d2", str(links), f"{joints}:{joints}"]
    lines = subprocess.run(command, capture_output=True, text=True, check=True).stdout.split()
    subsets = np.arange(1 << links)
    sizes = sum(subsets >> link & 1 for link in range(links))
    for line in lines:
        edges = nx.from_graph6_bytes(line.encode()).edges
        inside = sum((subsets >> a) & (subsets >> b) & 1 for a, b in edges)
        if np.all((2 * inside <= 3 * sizes - 4) | (sizes < 2)):
            yield line


@pytest.mark.skipif(shutil.which("nauty-geng") is None, reason="nauty is not installed")
@pytest.mark.parametrize(("links", "chains", "asymmetric", "inversions"), [(8, 16, 2, 71), (10, 230, 87, 1834)])
def test_published_chains_and_inversions(links, chains, asymmetric, inversions):
    # theory/enumeration 2: chains, those with a trivial group, mechanisms with a frame.
    graphs = [MechanismGraph.from_graph6(line) for line in planar_one_freedom_chains(links)]
    assert len({graph.key for graph in graphs}) == len(graphs) == chains
    assert sum(graph.automorphism_order == 1 for graph in graphs) == asymmetric
    mechanisms = [mechanism for graph in graphs for mechanism in graph.inversions()]
    assert len({mechanism.key for mechanism in mechanisms}) == len(mechanisms) == inversions


def test_canonical_mechanism_is_listed_level_by_level():
    rng = random.Random(7)
    for _ in range(50):
        tree = nx.random_labeled_tree(9, seed=rng.randrange(10**6))
        graph = MechanismGraph(9, [*tree.edges], frame=rng.randrange(9))
        levels = graph.canonical().levels
        assert [link for level in levels for link in level] == list(range(9))
        assert graph.canonical().key == graph.key


def test_keys_tell_frame_mobility_and_space_apart():
    joints = [(0, 1), (1, 2), (2, 3), (3, 0)]
    variants = [
        MechanismGraph(4, joints),
        MechanismGraph(4, joints, frame=0),
        MechanismGraph(4, joints, space=4),
        MechanismGraph(4, [(0, 1, 2), *joints[1:]]),
        MechanismGraph(4, [(0, 1, 2), *joints[1:]], frame=0),
        MechanismGraph(4, [(0, 1, 2), *joints[1:]], frame=2),
        MechanismGraph(4, joints[:3]),
        MechanismGraph(5, joints),
        MechanismGraph(1, []),
    ]
    variants += [variants[4].with_frame(1)]  # the same as variants[4]: a mirror image
    assert len({graph.key for graph in variants}) == len(variants) - 1
    for graph in variants:
        assert MechanismGraph.from_key(graph.key) == graph.canonical()


@pytest.mark.long
def test_more_links_than_the_kernel_takes():
    for graph, order in (
        (nx.cycle_graph(255), 510),
        (nx.grid_2d_graph(9, 9), 8),
        (equal_paths(20, 4), 2 * factorial(20)),
    ):
        ours = MechanismGraph.from_networkx(nx.convert_node_labels_to_integers(graph))
        assert ours.automorphism_order == order
        shuffled = ours.relabelled(random.Random(8).sample(range(ours.links), ours.links))
        assert shuffled.key == ours.key
        assert MechanismGraph.from_key(ours.key).links == ours.links


def test_plain_and_compiled_labels_of_a_mechanism_agree():
    rng = random.Random(9)
    for _ in range(100):
        n = rng.randint(1, 14)
        graph = MechanismGraph(
            n,
            [(a, b, rng.randint(1, 5)) for a, b in itertools.combinations(range(n), 2) if rng.random() < 0.4],
            frame=rng.choice((None, rng.randrange(n))),
            space=6,
        )
        colours = canonical.link_colours(graph)
        python, compiled = (canonical._label(graph, colours, compiled=way) for way in (False, True))
        assert python == compiled


def test_keys_never_change():
    # The stability promise of docs/explanation/mechanism-graph.md: a failure here needs a new key version.
    lines = GOLDEN.read_text(encoding="ascii").splitlines()
    assert len(lines) >= 40
    for line in lines:
        text, key, order = line.split("\t")
        graph = MechanismGraph.from_text(text)
        assert graph.key == key
        assert graph.automorphism_order == int(order)
        assert MechanismGraph.from_key(key) == graph.canonical()


@pytest.mark.parametrize(
    "key",
    [
        "",
        "1",
        "0BAN4",
        "1BAN",
        "1BAN4A",
        "1BAN4=",
        "1B/N4",
        "1BAN5",
        "1AAM",
        "1BAd4",
        "1BAN4" * 9999,
        None,
        b"1BAN4",
        "1é",
    ],
)
def test_malformed_keys(key):
    with pytest.raises(FormatError):
        MechanismGraph.from_key(key)


def test_key_of_another_labelling_is_refused():
    canonical_key = MechanismGraph(4, [(0, 1), (1, 2), (2, 3)]).key
    accepted = 0
    for bits in itertools.product("01", repeat=6):
        value = int("".join(bits) + "00", 2)
        key = "1" + urlsafe_b64encode(bytes((4, 3, value))).decode().rstrip("=")
        try:
            accepted += MechanismGraph.from_key(key).key == key
        except FormatError:
            assert key != canonical_key
    assert accepted == 11  # graphs on four vertices, OEIS A000088
