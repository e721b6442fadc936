"""Chains counted together: identities by rigid blocks, other automorphisms graph by graph, graphs grown as a stream."""

from __future__ import annotations

import tomllib
from fractions import Fraction
from math import factorial
from pathlib import Path

import numpy as np
import pytest
import rigid_clusters

from graphsynth import count_chains, enumerate_chains
from graphsynth.core.errors import GraphsynthError
from graphsynth.structure.kernels import canon, canon_workspace
from graphsynth.synthesis import totals
from graphsynth.synthesis.chunks import count_each, workspace
from graphsynth.synthesis.contracted import contracted_graphs, generate
from graphsynth.synthesis.families import chain_families
from graphsynth.synthesis.kernels.counting import count_block
from graphsynth.synthesis.kernels.growing import grow, make_growth
from graphsynth.synthesis.kernels.layout import MAX_VERTICES
from graphsynth.synthesis.kernels.moving import sum_moved
from graphsynth.synthesis.problem import EnumerationProblem, whole_sum
from graphsynth.synthesis.rigid_blocks import identity_sum, identity_sums
from graphsynth.synthesis.shards import run_of
from graphsynth.synthesis.writing import count_with_checkpoint

COUNTS = Path(__file__).parents[2] / "catalog/counts"
PUBLISHED = tomllib.loads((COUNTS / "published.toml").read_text(encoding="utf-8"))
CHAINS = {row["links"]: row["count"] for row in PUBLISHED["chains"] if row["mobility"] == 1}
LAMAN = {3: 1, 4: 1, 5: 3, 6: 13, 7: 70, 8: 608, 9: 7222}  # OEIS A227117


@pytest.fixture
def every_size_together(monkeypatch):
    monkeypatch.setattr(totals, "_LEAST_LOOPS", 2)


# --- the second method: no contracted graphs --------------------------------------------------------------------------


@pytest.mark.parametrize(
    "links", [4, 6, 8, 10, pytest.param(12, marks=pytest.mark.slow), pytest.param(14, marks=pytest.mark.slow)]
)
def test_permutations_of_links_give_the_published_counts(links):
    assert rigid_clusters.chains(links) == CHAINS[links]


def test_permutations_of_links_give_laman_graphs():
    assert {n: rigid_clusters.chains(n, 2) for n in LAMAN} == LAMAN


@pytest.mark.parametrize("links", [6, 8])
def test_chains_with_links_told_apart_are_orbits_of_chains(links):
    orbits = sum(factorial(links) // chain.automorphism_order for chain in enumerate_chains(links))
    assert rigid_clusters.labelled_chains(links) == orbits


# --- identities -------------------------------------------------------------------------------------------------------


def identities_graph_by_graph(links, space):
    """Return what the dynamic program finds for the identities, by vertices."""
    found = {}
    for family in chain_families(links, 1, space, {}, False):
        tables, work = family.edge_labels.tables, workspace(family.edge_labels)
        found[family.vertices] = Fraction(0)
        for h in range(len(family.graphs)):
            pairs = np.zeros((1000, 5), np.int64)
            one = np.zeros(1, np.int64)
            assert count_block(family.vertices, family.graphs, h, h + 1, 1, 0, tables, work, one, pairs) > 0
            _, _, automorphism, order, fixed = pairs[0].tolist()
            assert automorphism == 0
            found[family.vertices] += Fraction(fixed, order)
    return found


@pytest.mark.parametrize(
    ("links", "space"), [(6, 3), (8, 3), (10, 3), (6, 2), (8, 2), (8, 4), (11, 4), (10, 5), (12, 6)]
)
def test_identities_are_those_of_the_dynamic_program(links, space):
    sums = identity_sums(links, space)
    assert sums == identities_graph_by_graph(links, space)
    assert sum(sums.values()) == sum(identity_sum(links, space, points) for points in sums)


# --- whole counts -----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("links", [6, 8, 10, 12])
def test_parts_add_up_to_the_published_counts(links, every_size_together):
    assert count_chains(links) == CHAINS[links]


def test_parts_add_up_in_other_spaces(every_size_together):
    assert {n: count_chains(n, space=2) for n in range(4, 9)} == {n: LAMAN[n] for n in range(4, 9)}


@pytest.mark.slow
@pytest.mark.parametrize("links", [14, 16])
def test_parts_add_up_to_larger_published_counts(links, every_size_together):
    assert count_chains(links) == CHAINS[links]


def test_parts_are_whole_for_each_number_of_vertices():
    sums = identity_sums(10)
    for family in chain_families(10, 1, 3, {}, False):
        graphs = family.graphs
        others = totals.moved(family, graphs, 0, len(graphs))
        assert sums[family.vertices] + others == sum(count_each(family, 0, len(graphs)).tolist())


def test_what_is_not_all_chains_of_a_size_is_counted_graph_by_graph(every_size_together):
    for problem in (
        EnumerationProblem.chains(10, 1, 3, None, False, 2),
        EnumerationProblem.chains(9, 2, 3, None, False, None),
        EnumerationProblem.chains(8, 1, 3, None, False, None, framed=True),
        EnumerationProblem.trusses(9, 3, False),
        EnumerationProblem.chains(7, 1, 3, {2: 1}, False, None),
    ):
        assert not any(isinstance(part, totals.Identities) for part in problem.parts())
    assert totals.totals_of(chain_families(8, 1, 3, {}, False)[1:]) is None


def test_a_missing_part_is_noticed():
    with pytest.raises(GraphsynthError, match=r"35/4, no whole number"):
        whole_sum(sum(identity_sums(8).values()))


def test_shares_of_parts_survive_an_interruption(every_size_together, tmp_path):
    class Stopped(Exception):
        pass

    def stop(step):
        nonlocal left
        left -= 1
        if left == 0:
            raise Stopped

    problem = EnumerationProblem.chains(10, 1, 3, None, False, None)
    left = 5
    with pytest.raises(Stopped):
        count_with_checkpoint(problem, checkpoint=tmp_path / "counted.txt", watch=stop)
    text = (tmp_path / "counted.txt").read_text(encoding="utf-8")
    assert "/" in text.split("\n", 1)[1]  # fractions
    assert count_with_checkpoint(problem, checkpoint=tmp_path / "counted.txt") == 230


def test_shards_of_twenty_links_are_runs_of_the_parts():
    problem = EnumerationProblem.chains(20, 1, 3, None, False, None, counted=True)
    parts = list(problem.parts())
    for many in (1, 3, 50):
        runs = [run_of(parts, (i, many)) for i in range(1, many + 1)]
        assert [part for run in runs for part in run] == parts
        heaviest = max(sum(part.weight for part in run) for run in runs)
        assert heaviest <= sum(part.weight for part in parts) / many + max(part.weight for part in parts)
    few = [k for k, part in enumerate(parts) if isinstance(part, totals.Identities) and part.points < 5]
    found = [count_with_checkpoint(problem, shard=(k + 1, len(parts))) for k in few]
    assert found == [parts[k].count() for k in few]
    assert any(number.denominator > 1 for number in found)


# --- graphs as a stream -----------------------------------------------------------------------------------------------


def grown(known, wanted, *, symmetric=False):
    """Return the graphs that grow from the lists up to so many loops, by vertices, and all there are."""
    found = {k: [] for k in range(2, 2 * wanted - 1)}
    sums = np.zeros(MAX_VERTICES + 1, np.int64)
    out, sizes = np.zeros((64, MAX_VERTICES, MAX_VERTICES), np.uint8), np.zeros(64, np.int64)
    roots = [(loops, k, contracted_graphs(loops, k)) for loops in range(2, known + 1) for k in range(2, 2 * loops - 1)]
    roots += [(v, 2, np.array([[[0, v + 1], [v + 1, 0]]], np.uint8)) for v in range(known + 1, wanted + 1)]
    for loops, k, graphs in roots:
        growth, count = make_growth(2000), 64
        while count == 64:
            most = 2 * (wanted - 1)
            count = grow(k, graphs, len(graphs), loops, known, wanted, most, symmetric, growth, out, sizes, sums)
            assert count >= 0
            for mult, size in zip(out[:count], sizes[:count].tolist()):
                found[size].append(mult[:size, :size].copy())
    found[2].append(roots[-1][2][0])
    return found, sums


def keys(mults):
    """Return the canonical form of each multigraph."""
    codes = []
    for mult in mults:
        n, layers = len(mult), int(np.max(mult))
        masks = np.array(
            [[sum(1 << b for b in range(n) if row[b] == c) for row in mult] for c in range(1, layers + 1)], np.uint64
        )
        lab, *rest = canon_workspace(n, layers)
        canon(n, layers, masks, np.zeros(n, np.int64), lab, *rest)
        codes.append(mult[np.ix_(lab, lab)].tobytes())
    return codes


@pytest.mark.parametrize(
    ("known", "wanted"),
    [(1, 3), (1, 5), (3, 5), pytest.param(5, 6, marks=pytest.mark.long), pytest.param(2, 7, marks=pytest.mark.slow)],
)
def test_the_stream_has_every_graph_once(known, wanted):
    made, sums = grown(known, wanted)
    for k, mults in made.items():
        codes = keys(mults)
        assert len(set(codes)) == len(codes)
        assert sorted(codes) == sorted(keys(contracted_graphs(wanted, k)))
        assert k == 2 or sums[k] == len(codes)


@pytest.mark.long
def test_the_symmetric_ones_of_the_stream():
    everything, sums = grown(5, 6)
    symmetric, again = grown(5, 6, symmetric=True)
    np.testing.assert_array_equal(again, sums)
    for k, mults in everything.items():
        family = next(f for f in chain_families(14, 1, 3, {}, False) if f.vertices == k)
        out = np.zeros((2, len(mults)), np.int64)
        stack = np.ascontiguousarray(mults)
        stack.setflags(write=False)
        assert sum_moved(k, stack, 0, len(mults), family.edge_labels.tables, workspace(family.edge_labels), out) == 0
        moving = [mult for mult, order in zip(mults, out[0]) if order > 1]
        assert sorted(keys(moving)) == sorted(keys(symmetric[k]))


@pytest.mark.slow
def test_the_stream_of_eight_loops():
    _, sums = grown(7, 8, symmetric=True)
    assert sums[3:15].tolist() == [len(contracted_graphs(8, k)) for k in range(3, 15)]


@pytest.mark.slow
def test_nine_loops_with_few_vertices():
    """Grown as a stream, made and compared: the same graphs; counted together and graph by graph: the same chains."""
    families = chain_families(20, 1, 3, {}, False)[:5]
    lists = generate(9, 6)[9]
    sums = identity_sums(20, vertices=6)
    found = {family.vertices: [0, Fraction(0)] for family in families}
    for part in totals.totals_of(chain_families(20, 1, 3, {}, False)):
        if isinstance(part, totals.Grown) and part.vertices < 6:
            small = totals.Grown(tuple(families), part.loops, part.vertices, part.start, part.stop)
            for k, (graphs, share) in small.by_vertices().items():
                found[k][0] += graphs
                found[k][1] += share
    for family in families:
        k = family.vertices
        assert found[k][0] == len(lists[k])
        assert found[k][1] + sums[k] == sum(count_each(family, 0, len(lists[k])).tolist())


# --- the certificate of 20 links --------------------------------------------------------------------------------------


def test_the_certificate_of_twenty_links_adds_up():
    certificate = tomllib.loads((COUNTS / "twenty-links.toml").read_text(encoding="utf-8"))
    rows = {row["vertices"]: row for row in certificate["by_vertices"]}
    assert list(rows) == list(range(2, 17))
    assert all(Fraction(row["identities"]) + Fraction(row["others"]) == row["chains"] for row in rows.values())
    assert sum(row["chains"] for row in rows.values()) == certificate["chains"]
    assert sum(row["contracted"] for row in rows.values()) == certificate["contracted"]
    assert {k: Fraction(rows[k]["identities"]) for k in range(2, 6)} == identity_sums(20, vertices=5)


def second_count(links):
    return rigid_clusters.read(COUNTS / f"second-count-{links}.txt")


@pytest.mark.parametrize("links", [18, 20])
def test_the_second_count_is_the_first(links):
    """For each kind of permutation how many labelled chains it keeps."""
    kept = second_count(links)
    assert list(kept) == [*rigid_clusters.partitions(links, links)][::-1]
    certificate = tomllib.loads((COUNTS / "twenty-links.toml").read_text(encoding="utf-8"))
    assert rigid_clusters.mean(kept) == (certificate["chains"] if links == 20 else CHAINS[18])


def test_what_there_is_of_22_links_bounds_their_number():
    """The identity and up to four exchanges; the same pieces of smaller numbers of links leave out less and less."""
    kinds = list(second_count(22))
    shares = []
    for links, whole in ((18, CHAINS[18]), (20, 141_954_670_341)):
        kept = second_count(links)
        few = {cycles[: links - 22] for cycles in kinds}
        own = {cycles: kept[cycles] for cycles in few}
        shares.append(sum(Fraction(count, rigid_clusters.centraliser(cycles)) for cycles, count in own.items()) / whole)
    assert 0.9993 < shares[0] < shares[1] < 1
    least = sum(Fraction(kept, rigid_clusters.centraliser(cycles)) for cycles, kept in second_count(22).items())
    assert 15_245_455_172_180 < least < 15_245_455_172_181


@pytest.mark.slow
@pytest.mark.parametrize("links", [18, 20])
def test_parts_of_the_second_count_made_anew(links):
    clusters = rigid_clusters.Clusters(links, rigid_clusters.joints_of(links, 3))
    few = {cycles: count for cycles, count in second_count(links).items() if len(cycles) <= 6}
    assert any(few.values())
    assert {cycles: rigid_clusters.kept_by(clusters, cycles) for cycles in few} == few


def test_the_second_count_goes_on_where_it_was_stopped(tmp_path, capsys):
    path = tmp_path / "kept.txt"
    rigid_clusters.main(8, path)
    lines = path.read_text(encoding="utf-8").splitlines(keepends=True)
    path.write_text("".join(lines[:2])[:-2], encoding="utf-8")  # in the middle of a number
    rigid_clusters.main(8, path)
    assert capsys.readouterr().out == "16\n16\n"
    assert path.read_text(encoding="utf-8") == "".join(lines)


def test_the_second_count_in_shards(tmp_path, capsys):
    rigid_clusters.main(8, tmp_path / "whole")
    for shard in ("1/2", "2/2"):
        rigid_clusters.main(8, tmp_path / shard[0], shard)
    joined = tmp_path / "joined"
    joined.write_bytes(b"".join((tmp_path / name).read_bytes() for name in "12"))
    assert capsys.readouterr().out == "16\n"
    rigid_clusters.main(8, joined)
    assert capsys.readouterr().out == "16\n"
    assert rigid_clusters.read(joined) == rigid_clusters.read(tmp_path / "whole")


@pytest.mark.long
def test_twenty_links_told_apart_are_fewer_than_twenty_factorial_for_each_chain():
    count = tomllib.loads((COUNTS / "twenty-links.toml").read_text(encoding="utf-8"))["chains"]
    assert 0.8 < Fraction(rigid_clusters.labelled_chains(20), factorial(20)) / count < 1
