"""Contracted graphs: published counts, the shipped files made anew, and nauty's geng | multig."""

from __future__ import annotations

import lzma
import tomllib
from importlib.resources import files
from pathlib import Path

import nauty
import networkx as nx
import numpy as np
import pytest
from networkx.algorithms.isomorphism import GraphMatcher, numerical_edge_match

from graphsynth import MechanismGraph
from graphsynth.core.errors import FormatError, TooLargeError
from graphsynth.synthesis.chunks import count_each
from graphsynth.synthesis.contracted import (
    FOLDER_VARIABLE,
    SHIPPED_LOOPS,
    _layers,
    contracted_graphs,
    decode,
    encode,
    generate,
)
from graphsynth.synthesis.families import chain_families

PUBLISHED = tomllib.loads((Path(__file__).parents[2] / "catalog/counts/published.toml").read_text(encoding="utf-8"))
CONTRACTED = PUBLISHED["contracted"]


def numbers(name):
    return [(int(key), value) for key, value in CONTRACTED[name].items()]


def layers(loops):
    return [(k, contracted_graphs(loops, k)) for k in range(2, 2 * (loops - 1) + 1)]


def subdivided(mult):
    """Return a simple graph that stands for the multigraph: a new vertex in the middle of each edge."""
    k = len(mult)
    ends = [(a, b) for a in range(k) for b in range(a) for _ in range(mult[a, b])]
    joints = [(v, k + i) for i, pair in enumerate(ends) for v in pair]
    return MechanismGraph(k + len(ends), joints).graph6()


def multigraphs_of_nauty(loops, vertices):
    """Yield (multiplicity matrix, order of the vertex group) of all 2-connected ones with minimum degree 3."""
    edges, widest = loops + vertices - 1, 2 * loops + 1 - vertices
    simple = nauty.run("geng", "-C", f"-D{widest}", str(vertices), f"{vertices}:{edges}")
    for line in nauty.run("multig", f"-e{edges}", f"-D{widest}", "-G", data=simple):
        n, _, order, *triples = map(int, line.split())
        mult = np.zeros((n, n), np.uint8)
        a, b, m = triples[0::3], triples[1::3], triples[2::3]
        mult[a, b] = m
        mult[b, a] = m
        if mult.sum(axis=0).min() >= 3:
            yield mult, order


@pytest.mark.parametrize(("loops", "count"), numbers("counts"))
def test_counts(loops, count):
    assert sum(len(mults) for _, mults in layers(loops)) == count


def test_six_loops_by_vertices():
    assert {k: len(mults) for k, mults in layers(6) if len(mults)} == dict(numbers("six_loops_by_vertices"))


@pytest.mark.slow
@pytest.mark.parametrize(("loops", "count"), numbers("with_chain"))
def test_those_that_carry_a_chain(loops, count):
    families = chain_families(2 * loops + 2, 1, 3, {}, False)
    assert {family.loops for family in families} == {loops}
    assert sum(int((count_each(f, 0, len(f.graphs)) > 0).sum()) for f in families if len(f.graphs)) == count


@pytest.mark.long
@pytest.mark.parametrize("loops", range(2, SHIPPED_LOOPS + 1))
def test_every_graph_is_what_it_should_be(loops):
    for k, mults in layers(loops):
        mults = mults.astype(np.int64)
        assert (mults == mults.transpose(0, 2, 1)).all()
        assert not mults[:, range(k), range(k)].any()
        assert (mults.sum(axis=2) >= 3).all()
        assert (mults.sum(axis=(1, 2)) == 2 * (loops + k - 1)).all()
    for k, mults in layers(min(loops, 6)):
        assert all(k == 2 or nx.is_biconnected(nx.from_numpy_array(mult > 0)) for mult in mults)


@pytest.mark.long
@pytest.mark.parametrize("loops", [2, 3, 4, 5, 6, 7, pytest.param(8, marks=pytest.mark.slow)])
def test_the_generator_reproduces_the_shipped_file(loops):
    shipped = files("graphsynth.synthesis").joinpath("data", f"contracted-{loops}.xz").read_bytes()
    made = generate(loops)[loops]
    assert encode(made) == shipped
    again = decode(shipped)
    assert {k: mults.tolist() for k, mults in again.items() if loops < 7} == {
        k: mults.tolist() for k, mults in made.items() if loops < 7
    }


@pytest.mark.parametrize("loops", [3, 4, 5, 6, pytest.param(7, marks=pytest.mark.slow)])
def test_same_as_geng_and_multig(loops):
    trivial = 0
    for k, mults in layers(loops)[1:]:
        theirs, orders = [], []
        for mult, order in multigraphs_of_nauty(loops, k):
            theirs.append(subdivided(mult))
            orders.append(order)
        ours = nauty.canonical(map(subdivided, mults))
        assert len(set(ours)) == len(ours)
        assert sorted(ours) == sorted(nauty.canonical(theirs))
        trivial += orders.count(1)
    if loops in dict(numbers("trivial_group")):
        assert trivial == dict(numbers("trivial_group"))[loops]


@pytest.mark.long
@pytest.mark.parametrize(("loops", "count"), numbers("trivial_group"))
def test_trivial_groups(loops, count):
    assert sum(_is_asymmetric(mult) for _, mults in layers(loops) for mult in mults) == count


def _is_asymmetric(mult):
    """Tell whether only the identity keeps the multiplicities; a joint mobility stands for a multiplicity."""
    k = len(mult)
    edges = [(a, b, int(mult[a, b])) for a in range(k) for b in range(a + 1, k) if mult[a, b]]
    if max(m for *_, m in edges) <= 5:
        return MechanismGraph(k, edges, space=6).automorphism_order == 1
    g = nx.Graph()
    g.add_weighted_edges_from(edges)
    return sum(1 for _ in GraphMatcher(g, g, edge_match=numerical_edge_match("weight", 1)).isomorphisms_iter()) == 1


def test_bad_data_are_named():
    with pytest.raises(FormatError, match="contracted graphs"):
        decode(b"not compressed")
    good = files("graphsynth.synthesis").joinpath("data", "contracted-4.xz").read_bytes()
    with pytest.raises(FormatError, match="contracted graphs"):
        decode(good[:-20])
    for raw in (b"gsH1", b"gsH1\x05\x02", b"gsH1\x01\x09\xff\xff\xff\xff"):  # less than it says
        with pytest.raises(FormatError, match="make it anew"):
            decode(lzma.compress(raw))


def test_a_list_of_other_loops_is_not_taken(monkeypatch, tmp_path):
    data = files("graphsynth.synthesis").joinpath("data", "contracted-4.xz").read_bytes()
    (tmp_path / "contracted-9.xz").write_bytes(data)
    monkeypatch.setenv("GRAPHSYNTH_CONTRACTED", str(tmp_path))
    with pytest.raises(FormatError, match=r"contracted-9.xz: .*other numbers of loops than 9"):
        contracted_graphs(9, 4)


def test_a_list_of_the_user_with_the_right_numbers_is_taken(tmp_path, monkeypatch):
    """Two vertices with ten edges between them have nine loops; nine edges or eleven have not."""
    monkeypatch.setenv(FOLDER_VARIABLE, str(tmp_path))
    for edges in (9, 10, 11):
        _layers.cache_clear()
        graph = np.array([[[0, edges], [edges, 0]]], np.uint8)
        (tmp_path / "contracted-9.xz").write_bytes(encode({2: graph}))
        if edges == 10:
            np.testing.assert_array_equal(contracted_graphs(9, 2), graph)
        else:
            with pytest.raises(FormatError, match="other numbers of loops than 9"):
                contracted_graphs(9, 2)
    _layers.cache_clear()


def test_more_loops_than_shipped_is_refused(monkeypatch):
    monkeypatch.delenv("GRAPHSYNTH_CONTRACTED", raising=False)
    with pytest.raises(TooLargeError):
        contracted_graphs(SHIPPED_LOOPS + 5, 4)
