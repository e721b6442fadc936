"""Checking a catalogue: every stored field recomputed by another route and compared; families counted and cut anew."""

from __future__ import annotations

import random
import sqlite3
import time
from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

from graphsynth.atlas.evaluations import GUARANTEES
from graphsynth.atlas.facts import curves_of, modes_of, modes_of_all
from graphsynth.atlas.rechecking import Same, recheck
from graphsynth.atlas.references import Reference
from graphsynth.atlas.sealing import broken_seal
from graphsynth.atlas.stored import data_of, mechanism_in
from graphsynth.atlas.tables import wrong_rows
from graphsynth.structure.assur import contour_class, is_assur_group

_SHOWN = 1000

#: Of contracted graphs of eight loops, those of 18 links.
_VERTICES, _PATHS = 14, 21

#: Kinds of evaluations that the package knows: their statuses and their unit.
_KNOWN = {
    "dimensions": ({"found", "not found"}, None),
    "transmission": ({"found"}, "rad"),
    "jamming": ({"free", "jammed", "jammed for some", "undecided"}, "rad"),
}


@dataclass(frozen=True, slots=True)
class Verification:
    """Result of checking a catalogue."""

    compared: dict[str, int]  # how many values of each field were recomputed and compared
    differences: tuple[str, ...]  # one sentence for each difference (the first thousand)
    seconds: float

    @property
    def passed(self) -> bool:
        """Whether something was compared and nothing differs."""
        return bool(self.compared) and not self.differences

    @property
    def statement(self) -> str:
        """One sentence."""
        total = sum(self.compared.values())
        what = f"{total} values of {len(self.compared)} fields recomputed in {self.seconds:.1f} s"
        return f"{what}: all agree" if self.passed else f"{what}: {len(self.differences)} differences"


class _Checks:
    """Counts comparisons and keeps differences."""

    def __init__(self) -> None:
        self.compared: Counter[str] = Counter()
        self.differences: list[str] = []

    @contextmanager
    def whatever(self, where: str) -> Iterator[None]:
        """Take anything that cannot be read or recomputed for a difference: the rows may hold whatever."""
        try:
            yield
        except Exception as error:
            self.differences.append(f"{where}: cannot be checked ({type(error).__name__}: {error})")

    def same(self, field: str, where: str, stored: Any, wanted: Any) -> None:
        self.compared[field] += 1
        if (stored != wanted or type(stored) is not type(wanted)) and len(self.differences) < _SHOWN:
            self.differences.append(f"{where}: {field} is {stored!r}, recomputed {wanted!r}")

    def same_rows(self, field: str, where: str, stored: list[Any], wanted: list[Any]) -> None:
        self.same(f"{field}: number", where, len(stored), len(wanted))
        for own, right in zip(stored, wanted):
            self.same(field, where, own, right)


def verify(connection: sqlite3.Connection, chains: int | None, seed: int, quick: bool) -> Verification:
    """Check a catalogue; see :meth:`graphsynth.atlas.catalogue.Catalogue.verify`."""
    begin = time.perf_counter()
    checks = _Checks()
    if not quick:
        _check_values(connection, checks, chains, seed)
    with checks.whatever("file"):
        # what was recomputed says more; the seal also covers what cannot be recomputed
        broken = broken_seal(connection)
        checks.compared["file"] += 1
        if broken and (quick or not checks.differences):
            checks.differences.append(f"file: {broken}")
    return Verification(dict(checks.compared), tuple(checks.differences), time.perf_counter() - begin)


def _check_values(connection: sqlite3.Connection, checks: _Checks, chains: int | None, seed: int) -> None:
    """Recompute what can be recomputed."""
    groups: dict[int, str] = {}
    shapes: dict[int, Any] = {}
    with checks.whatever("file"):
        _check_file(connection, checks)
    if checks.differences:
        return  # whatever values of another form would have computed
    with checks.whatever("families"):
        select = "SELECT family_id, mobility, links, fractionated, pieces, cut, shard, expected, complete FROM families"
        for row in connection.execute(select).fetchall():
            _check_family(connection, checks.same, chains is None, row)
    with checks.whatever("labels"):
        _check_labels(connection, checks)
    with checks.whatever("groups"):
        _check_groups(connection, checks, groups)
    with checks.whatever("contracted graphs"):
        _check_contracted(connection, checks, shapes)
    with checks.whatever("evaluations"):
        _check_evaluations(connection, checks)
    with checks.whatever("chains"):
        for (family,) in connection.execute("SELECT family_id FROM families ORDER BY mobility, links").fetchall():
            select = "SELECT chain_id FROM chains WHERE family_id = ? ORDER BY key"
            numbers = [row[0] for row in connection.execute(select, (family,))]
            if chains is not None and chains < len(numbers):
                numbers = random.Random(seed).sample(numbers, chains)
            for number in numbers:
                with checks.whatever(f"chain {number}"):
                    _check_chain(connection, checks, number, groups, shapes)


def _check_file(connection: sqlite3.Connection, checks: _Checks) -> None:
    for (found,) in connection.execute("PRAGMA integrity_check"):
        checks.same("file", "integrity", found, "ok")
    for table, question in wrong_rows():
        checks.same("file", f"values of another form in {table}", connection.execute(question).fetchall(), [])
    checks.same("file", "references", connection.execute("PRAGMA foreign_key_check").fetchmany(10), [])
    for table in ("inversions", "driven", "dyads"):
        loose = f"SELECT COUNT(*) FROM {table} WHERE chain_id NOT IN (SELECT chain_id FROM chains)"
        checks.same("file", f"rows of {table} without a chain", connection.execute(loose).fetchone()[0], 0)


def _check_labels(connection: sqlite3.Connection, checks: _Checks) -> None:
    rank: Counter[str] = Counter()
    early = "SELECT COUNT(label) FROM chains JOIN families USING (family_id) WHERE complete = 0"
    checks.same("labels", "of families that are not complete", connection.execute(early).fetchone()[0], 0)
    held = set()
    for key, label, mobility, links, assortment in connection.execute(
        "SELECT key, label, mobility, links, assortment FROM chains JOIN families USING (family_id, mobility, links) "
        "WHERE complete = 1 ORDER BY CAST(key AS BLOB)"
    ):
        stem = f"{mobility}.{links}.{assortment}"
        held.add(label)
        rank[stem] += 1
        checks.same("chains.label", key, label, f"{stem}.{rank[stem]}")
    checks.same("distinct labels", "chains", len(held), sum(rank.values()))


def _check_groups(connection: sqlite3.Connection, checks: _Checks, found: dict[int, str]) -> None:
    """Check groups and structures; write the keys of the groups of each structure, as text."""
    from graphsynth.structure.graph import MechanismGraph

    keys, facts = {}, {}
    select = 'SELECT group_id, key, links, "order", class, modes FROM groups'
    for number, key, links, order, own, modes in connection.execute(select):
        graph = MechanismGraph.from_key(key)
        pairs = [(a, b) for a, b, _ in graph.joints]
        checks.same("groups.links", key, links, graph.links - 1)
        if graph.links - 1 != links:
            continue
        checks.same("groups.key", key, is_assur_group(graph), True)
        checks.same("groups.order", key, order, sum(1 for a, _ in pairs if a == 0))
        bases = ((a, b, 1) if a else (b, -1, 1) for a, b in pairs)
        checks.same("groups.class", key, own, contour_class(bases))  # by the minimum cycle basis of networkx
        checks.same("groups.modes", key, modes, modes_of(key, links))
        keys[number], facts[number] = key, (own, order, modes)
    select = 'SELECT structure_id, groups, class, "order", modes FROM structures'
    for number, groups, own, order, modes in connection.execute(select):
        members = [int(group) for group in groups.split()]
        checks.same("structures.class", groups, own, max((facts[group][0] for group in members), default=1))
        checks.same("structures.order", groups, order, max((facts[group][1] for group in members), default=0))
        checks.same("structures.modes", groups, modes, modes_of_all(facts[group][2] for group in members))
        found[number] = " ".join(keys[group] for group in members)


def _check_contracted(connection: sqlite3.Connection, checks: _Checks, shapes: dict[int, Any]) -> None:
    """Check that no two contracted graphs are the same; write them with their multiplicities."""
    import networkx

    alike: dict[tuple[Any, ...], list[int]] = {}
    for number, vertices, edges, planar in connection.execute(
        "SELECT contracted_id, vertices, edges, planar FROM contracted"
    ):
        shape = networkx.Graph()
        shape.add_nodes_from(range(vertices))
        for edge in edges.split():
            pair, _, times = edge.partition("x")
            a, b = map(int, pair.split("-"))
            shape.add_edge(a, b, times=int(times or 1))
        if len(shape) > _VERTICES or shape.size(weight="times") > _PATHS:
            checks.same("contracted.edges", f"contracted graph {number}", edges, "one of at most eight loops")
            continue
        checks.same("contracted.vertices", edges, vertices, len(shape))
        checks.same("contracted.planar", edges, planar, int(networkx.check_planarity(shape)[0]))
        alike.setdefault(_invariant(shape), []).append(number)
        shapes[number] = shape
    for numbers in alike.values():
        for at, one in enumerate(numbers):
            twins = [other for other in numbers[:at] if _same_shape(shapes[one], shapes[other])]
            checks.same("contracted.edges", f"contracted graph {one}", twins, [])


def _invariant(shape: Any) -> tuple[Any, ...]:
    return tuple(sorted(tuple(sorted(data["times"] for _, _, data in shape.edges(v, data=True))) for v in shape))


def _same_shape(one: Any, other: Any) -> bool:
    import networkx

    if _invariant(one) != _invariant(other):
        return False
    match = networkx.isomorphism.numerical_edge_match("times", 0)
    return bool(networkx.is_isomorphic(one, other, edge_match=match))


def _check_evaluations(connection: sqlite3.Connection, checks: _Checks) -> None:
    for number, frame, driver, kind, status, unit, guarantee, text, known in connection.execute(
        "SELECT e.chain_id, e.frame, e.driver, kind, status, unit, guarantee, data, d.structure_id FROM evaluations e "
        "LEFT JOIN driven d USING (chain_id, frame, driver)"
    ):
        where = f"evaluation {kind} of chain {number}, frame {frame}, driver {driver}"
        checks.same("evaluations: mechanism", where, known is not None, True)
        statuses, own = _KNOWN.get(kind, ({status}, unit))
        checks.same("evaluations.status", where, status in statuses, True)
        checks.same("evaluations.unit", where, unit in (None, own), True)
        checks.same("evaluations.guarantee", where, guarantee is None or guarantee in GUARANTEES, True)
        right = True
        try:
            data = None if text is None else data_of(text)
        except ValueError:
            right = False
        checks.same("evaluations.data", where, right, True)
        if kind == "dimensions" and text is not None and right:
            has = mechanism_in(data) is not None
            checks.same("evaluations: dimensions found", where, status == "found", has)


def _check_chain(
    connection: sqlite3.Connection, checks: _Checks, number: int, structures: dict[int, str], shapes: dict[int, Any]
) -> None:
    import networkx

    cursor = connection.execute("SELECT * FROM chains WHERE chain_id = ?", (number,))
    row = dict(zip((column[0] for column in cursor.description), cursor.fetchone()))
    where = f"chain {row['label'] or row['key']}"
    reference = Reference(row["graph6"], row["mobility"])
    checks.same("no rigid sub-chain", where, reference.no_rigid_subchain(), True)
    if not reference.is_chain():
        checks.same("chains.graph6", where, "connected, with two joints on each link", row["graph6"])
        return
    for field, wanted in reference.facts().items():
        checks.same(f"chains.{field}", where, row[field], wanted)
    shape, whole = networkx.Graph(), reference.contracted()
    shape.add_nodes_from(whole.nodes)
    shape.add_edges_from((a, b, {"times": whole.number_of_edges(a, b)}) for a, b in set(whole.edges()))
    held = shapes.get(row["contracted_id"])
    checks.same("chains.contracted_id", where, held is not None and _same_shape(held, shape), True)

    def rows(select: str) -> list[tuple[Any, ...]]:
        return connection.execute(select, (number,)).fetchall()

    parents = [parent for (parent,) in rows("SELECT parent_key FROM dyads WHERE chain_id = ? ORDER BY parent_key")]
    checks.same("dyads", where, parents, reference.parents())
    inversions = rows("SELECT frame, frame_joints, levels FROM inversions WHERE chain_id = ? ORDER BY frame")
    checks.same_rows("inversions", where, inversions, reference.inversions())
    curves = rows("SELECT frame, degree, genus, degrees, genera FROM inversions WHERE chain_id = ?")
    joints = [(a, b) for a, b in reference.graph.edges]
    wanted = [(frame, *curves_of(joints, reference.links, frame)) for frame, *_ in inversions]
    checks.same_rows("inversions: coupler curves", where, sorted(curves), wanted)
    stored = [
        (frame, tuple(int(link) for link in str(driver).split(",")), structures.get(structure, ""))
        for frame, driver, structure in rows("SELECT frame, driver, structure_id FROM driven WHERE chain_id = ?")
    ]
    wanted_rows = [(frame, drivers, " ".join(groups)) for frame, drivers, groups in reference.mechanisms()]
    checks.same_rows("mechanisms", where, sorted(stored), sorted(wanted_rows))
    recheck(connection, checks.same, number, reference)


def _check_family(connection: sqlite3.Connection, same: Same, remade: bool, row: tuple[Any, ...]) -> None:
    """Compare a family with its cut, its count and what is published; if ``remade``, the keys of each piece too."""
    from graphsynth.atlas.making import fingerprint, problem_of, rows_of_task, share_of, tasks_of
    from graphsynth.atlas.statement import PUBLISHED
    from graphsynth.synthesis import count_chains

    number, mobility, links, fractionated, pieces, cut, shard, expected, complete = row
    where = f"family {mobility}.{links}"
    listed, keys = connection.execute(
        "SELECT COUNT(*), COUNT(DISTINCT key) FROM chains WHERE (family_id, mobility, links) = (?, ?, ?)",
        (number, mobility, links),
    ).fetchone()
    same("distinct keys", where, keys, listed)
    of_family = connection.execute("SELECT COUNT(*) FROM chains WHERE family_id = ?", (number,)).fetchone()[0]
    same("chains.family_id", where, of_family, listed)
    if shard == "1/1":
        same("families.complete", where, complete, 1)
        same("chains listed", where, listed, expected)
        known = PUBLISHED.get((mobility, links))
        if known:
            same("published count", where, listed, known[fractionated])
        if listed != (known[fractionated] if known else expected):
            return  # counting and cutting a family that is not there may take minutes
        same("families.expected", where, expected, count_chains(links, mobility, fractionated=bool(fractionated)))
    problem, whole = problem_of(links, mobility, bool(fractionated)), tasks_of(links, mobility, bool(fractionated))
    same("families.cut", where, cut, fingerprint(problem, whole))
    same("families.pieces", where, pieces, len(whole))
    i, m = map(int, shard.split("/"))
    own = {task.number: task for task in (whole if shard == "1/1" else share_of(whole, (i, m)))}
    same("families.shard", where, i <= m, True)
    held = connection.execute(
        "SELECT piece, first_chain, chains FROM pieces WHERE family_id = ? ORDER BY piece", (number,)
    ).fetchall()
    same("pieces.piece", where, [piece for piece, _, _ in held if piece not in own], [])
    if shard == "1/1":
        same("pieces", where, len(held), pieces)
    same("pieces.chains", where, sum(chains for _, _, chains in held), listed)
    end = 1
    for piece, first, chains in held:
        # pieces lie one behind the other, and in each there are as many chains of the family as it says
        place = f"{where}, piece {piece}"
        same("pieces.first_chain", place, first >= end, True)
        end = first + chains
        select = "SELECT key, family_id FROM chains WHERE chain_id BETWEEN ? AND ? ORDER BY chain_id"
        stored = connection.execute(select, (first, end - 1)).fetchall()
        same("pieces.first_chain", place, sum(family == number for _, family in stored), chains)
        if remade and piece in own:
            keys = [chain[0] for chain in rows_of_task(own[piece]).chains]
            same("pieces.piece", place, [key for key, _ in stored], keys)
