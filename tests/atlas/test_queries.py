"""Questions to a catalogue: every column as a filter against brute force, and questions that do more than ask."""

from __future__ import annotations

import subprocess
import sys
import tomllib
from collections import Counter
from itertools import combinations
from pathlib import Path

import networkx as nx
import pytest

from graphsynth import MechanismGraph
from graphsynth.atlas.catalogue import Catalogue
from graphsynth.core.errors import SpecError
from graphsynth.structure.assur import decompose

CATALOG = Path(__file__).parents[2] / "catalog"


@pytest.fixture(scope="module")
def shipped():
    with Catalogue(CATALOG / "up-to-10-links.sqlite") as catalogue:
        yield catalogue


def facts(text):
    """All that the table of chains says of a chain, from its graph6 alone."""
    graph = nx.from_graph6_bytes(text.encode())
    degrees = Counter(degree for _, degree in graph.degree())
    maps = list(nx.isomorphism.GraphMatcher(graph, graph).isomorphisms_iter())
    orbits = {frozenset(image[link] for image in maps) for link in graph}
    return {
        "links": len(graph),
        "joints": graph.size(),
        "mobility": 3 * (len(graph) - 1) - 2 * graph.size(),
        "loops": graph.size() - len(graph) + 1,
        "assortment": "-".join(str(degrees[k]) for k in range(2, max(degrees) + 1)),
        "automorphisms": len(maps),
        "inversions": len(orbits),
        "planar": int(nx.check_planarity(graph)[0]),
        "girth": nx.girth(graph),
        "fractionated": int(bool(list(nx.articulation_points(graph)))),
        "mobility_type": type_of_mobility(graph),
        "link_orbits": " ".join(",".join(map(str, orbit)) for orbit in sorted(map(sorted, orbits))),
    }


def type_of_mobility(graph):
    """Tell it by the mobility of every induced sub-chain whose links have two joints in it."""
    if list(nx.articulation_points(graph)):
        return "fractionated"
    free = 3 * (len(graph) - 1) - 2 * graph.size()
    sets = (chosen for size in range(3, len(graph)) for chosen in combinations(graph, size))
    parts = (part for part in map(graph.subgraph, sets) if min(degree for _, degree in part.degree()) > 1)
    smaller = any(3 * (len(part) - 1) - 2 * part.size() < free for part in parts) if free > 1 else False
    return "partial" if smaller else "total"


@pytest.fixture(scope="module")
def known(shipped):
    return {row["key"]: facts(row["graph6"]) for row in shipped.query().to_dict("records")}


FILTERS = ["links", "joints", "mobility", "loops", "assortment", "automorphisms", "inversions", "planar", "girth",
           "fractionated", "mobility_type", "link_orbits"]  # fmt: skip


@pytest.mark.long
@pytest.mark.parametrize("column", FILTERS)
def test_every_column_of_chains_as_a_filter(shipped, known, column):
    """Equal to every value that occurs, and for numbers above the middle one."""
    values = sorted({own[column] for own in known.values()})
    for value in values:
        found = set(shipped.query("chains", f"{column} = ?", [value])["key"])
        assert found == {key for key, own in known.items() if own[column] == value}
    middle = values[len(values) // 2]
    found = set(shipped.query("chains", f"{column} > ?", [middle])["key"])
    assert found == {key for key, own in known.items() if own[column] > middle}


def test_filters_together(shipped, known):
    found = shipped.query("chains", "links = 10 AND mobility = 1 AND NOT planar AND automorphisms BETWEEN 2 AND 8")
    wanted = {
        key for key, own in known.items()
        if own["links"] == 10 and own["mobility"] == 1 and not own["planar"] and 2 <= own["automorphisms"] <= 8
    }  # fmt: skip
    assert wanted and set(found["key"]) == wanted


@pytest.mark.long
def test_keys_and_labels_as_filters(shipped):
    for key, label in shipped.sql("SELECT key, label FROM chains").itertuples(index=False):
        assert shipped.query("chains", "key = ?", [key])["label"].tolist() == [label]
        assert shipped.query("chains", "label = ?", [label])["key"].tolist() == [key]


@pytest.mark.parametrize("joints", [2, 3, 4, 5])
def test_inversions_by_the_joints_of_the_frame_and_by_levels(shipped, known, joints):
    rows = shipped.sql(
        "SELECT graph6, frame, levels, frame_joints FROM inversions JOIN chains USING (chain_id) "
        "WHERE frame_joints = ?",
        [joints],
    )
    for text, frame, levels, own in rows.itertuples(index=False):
        graph = nx.from_graph6_bytes(text.encode())
        distance = Counter(nx.single_source_shortest_path_length(graph, frame).values())
        assert own == graph.degree(frame) == joints
        assert levels == "-".join(str(distance[k]) for k in range(max(distance) + 1))
    total = 0
    for row in shipped.query().to_dict("records"):
        graph = nx.from_graph6_bytes(row["graph6"].encode())
        firsts = [int(orbit.split(",")[0]) for orbit in known[row["key"]]["link_orbits"].split()]
        total += sum(graph.degree(link) == joints for link in firsts)
    assert len(rows) == total


def test_mechanisms_by_class_and_order(shipped):
    """Chains of up to eight links: class and order by the decomposition of the graph class."""
    rows = shipped.sql(
        'SELECT key, frame, driver, class, "order" FROM mechanisms JOIN chains USING (chain_id) WHERE links <= 8'
    )
    wanted = {}
    for key, frame, driver, _, _ in rows.itertuples(index=False):
        chain = MechanismGraph.from_key(key)
        graph = MechanismGraph(chain.links, chain.joints, frame=frame)
        groups = decompose(graph, [(frame, int(link)) for link in str(driver).split(",")]).groups
        wanted[key, frame, driver] = (
            max((group.group_class for group in groups), default=1), max((group.order for group in groups), default=0),
        )  # fmt: skip
    for own in sorted(set(wanted.values())):
        found = shipped.sql(
            "SELECT key, frame, driver FROM mechanisms JOIN chains USING (chain_id) "
            'WHERE links <= 8 AND class = ? AND "order" = ?',
            own,
        )
        assert set(found.itertuples(index=False, name=None)) == {
            place for place, facts in wanted.items() if facts == own
        }


def test_the_shipped_catalogue_row_by_row_as_published(shipped, known):
    published = tomllib.loads((CATALOG / "counts" / "published.toml").read_text())
    one = [own for own in known.values() if own["mobility"] == 1]
    rows = Counter(own["assortment"] for own in one if own["links"] == 10)
    wanted = {}
    for *numbers, count in published["by_assortment"]["rows"]:
        while numbers[-1] == 0:
            numbers.pop()
        wanted["-".join(map(str, numbers))] = count
    assert rows == wanted
    for links, *_ in {(own["links"],) for own in one}:
        held = shipped.query("chains", "mobility = 1 AND links = ?", [links])
        assert held["inversions"].sum() == published["mechanisms"]["counts"][str(links)]
        assert len(held) == next(
            row["count"] for row in published["chains"] if (row["mobility"], row["links"]) == (1, links)
        )
    for row in published["chains"]:
        if row["links"] <= 10:
            held = shipped.query("chains", "(mobility, links) = (?, ?)", [row["mobility"], row["links"]])
            assert len(held) == row.get("with_fractionated", row["count"])
            assert len(held.query("fractionated == 0")) == row["count"]
    for name, where in (("non_planar", "NOT planar"), ("asymmetric", "automorphisms = 1")):
        for row in published[name]:
            if row["links"] <= 10:
                assert (
                    len(shipped.query("chains", f"mobility = 1 AND links = {row['links']} AND {where}")) == row["count"]
                )
    for loops, count in published["contracted"]["with_chain"].items():
        if 2 <= int(loops) <= 4:
            select = "SELECT COUNT(DISTINCT contracted_id) AS n FROM chains WHERE mobility = 1 AND loops = ?"
            assert shipped.sql(select, [int(loops)])["n"][0] == count
    for size, count in published["assur_groups"]["counts"].items():
        if int(size) <= 8:
            assert len(shipped.query("groups", "links = ?", [int(size)])) == count


# --- questions that do more than ask


def test_unknown_names_are_answered_with_those_there_are(shipped):
    with pytest.raises(SpecError, match=r"no such column: symmetry; chains has chain_id, .*automorphisms"):
        shipped.query("chains", "symmetry = 2")
    with pytest.raises(SpecError, match=r"no table 'chain'; choose one of chains, inversions"):
        shipped.query("chain")
    with pytest.raises(SpecError, match="give a key or a label such as"):
        shipped.entry("Watt")


@pytest.mark.parametrize(
    "text",
    [
        "ATTACH DATABASE '{folder}/new.sqlite' AS other",
        "ATTACH DATABASE 'file:{folder}/new.sqlite?mode=rwc' AS other",
        "VACUUM INTO '{folder}/new.sqlite'",
        "CREATE TEMP TABLE t (a)",
        "DELETE FROM chains",
        "DROP TABLE chains",
        "UPDATE chains SET girth = 3",
        "PRAGMA writable_schema = 1",
        "PRAGMA journal_mode = WAL",
        "PRAGMA user_version = 99",
        "SELECT load_extension('x')",
        "BEGIN",
        "SELECT 1; DROP TABLE chains",
        "SELECT 1\0; DROP TABLE chains",
        "EXPLAIN DELETE FROM chains",
    ],
)
def test_nothing_but_reading(shipped, tmp_path, text):
    before = shipped.path.read_bytes()
    with pytest.raises(SpecError, match="SQLite refuses"):
        shipped.sql(text.format(folder=tmp_path))
    assert shipped.path.read_bytes() == before and not list(tmp_path.iterdir())
    assert len(shipped) == 411


@pytest.mark.parametrize(
    "where",
    [
        "1; DROP TABLE chains",
        "1) OR (1",
        "1 UNION SELECT * FROM groups",
        "'",
        "((((",
        "1 LIMIT ?",
    ],
)
def test_conditions_cannot_break_out(shipped, where):
    with pytest.raises(SpecError, match="SQLite refuses"):
        shipped.query("chains", where)
    assert len(shipped) == 411


@pytest.mark.parametrize("name", ["' OR '1'='1", "x'; DROP TABLE chains; --", "", "\0", "é" * 10_000, "%"])
def test_names_are_values(shipped, name):
    for ask in (shipped.entry, shipped.chain, shipped.mechanism):
        with pytest.raises(SpecError, match="no chain"):
            ask(name)


@pytest.mark.parametrize("values", [[1, 2], [], [object()], [1 << 70], "7", [float("nan")]])
def test_values_that_do_not_fit(shipped, values):
    if values == [1, 2] or values == [] or not isinstance(values[0], float):
        with pytest.raises(SpecError):
            shipped.query("chains", "links = ?", values)
    else:
        assert shipped.query("chains", "links = ?", values).empty


def test_reading_pragmas_are_answered(shipped):
    assert "graph6" in set(shipped.sql("PRAGMA table_info(chains)")["name"])


@pytest.mark.long
def test_ctrl_c_ends_an_endless_question():
    endless = "WITH RECURSIVE x(n) AS (SELECT 1 UNION ALL SELECT n + 1 FROM x) SELECT COUNT(*) FROM x"
    script = (
        "import sys, threading, os, signal\nfrom graphsynth.cli import main\n"
        "threading.Timer(1.5, lambda: os.kill(os.getpid(), signal.SIGINT)).start()\n"
        f"sys.exit(main(['catalog', 'query', {str(CATALOG / 'up-to-10-links.sqlite')!r}, '--sql', {endless!r}]))"
    )
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, timeout=60, check=False)
    assert (done.returncode, done.stderr.strip()) == (130, "graphsynth: interrupted")
