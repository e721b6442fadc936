"""Building a catalogue: pieces computed anywhere, written in order by one writer, each in one transaction."""

from __future__ import annotations

import sqlite3
from collections.abc import Callable, Iterable
from concurrent.futures import Executor
from typing import TYPE_CHECKING, Any

import numpy as np

from graphsynth.atlas.schema import INDEXES
from graphsynth.errors import GraphsynthError

if TYPE_CHECKING:
    from graphsynth.atlas.facts import ChainFacts, GroupForm
    from graphsynth.synthesis.problem import Piece

__all__ = ["build_family", "facts_of_piece", "finish_family"]

#: Told ``(chains written, share of the family done)`` after every piece.
Watch = Callable[[int, float], None]


def facts_of_piece(piece: Piece, mobility: int) -> list[tuple[ChainFacts, bool]]:
    """Return the facts of all chains of a piece, and whether each is planar (computed in the worker)."""
    from graphsynth.atlas.facts import analyse_block, chain_facts
    from graphsynth.structure.graph import MechanismGraph
    from graphsynth.synthesis.problem import graphs_of_piece

    graphs = list(graphs_of_piece(piece))
    if not graphs:
        return []
    links = graphs[0].links
    packed = np.frombuffer(b"".join(graph.packed for graph in graphs), np.uint8).reshape(len(graphs), -1)
    found = chain_facts(analyse_block(links, packed), mobility)
    return [(facts, MechanismGraph.is_planar.fget(graph)) for facts, graph in zip(found, graphs)]  # type: ignore[attr-defined]


class _Ids:
    """Numbers of contracted graphs and groups in the file: given in the order of first appearance."""

    def __init__(self, connection: sqlite3.Connection) -> None:
        self.connection = connection
        self.contracted: dict[tuple[int, bytes], int] = {}
        self.groups: dict[GroupForm, tuple[int, int]] = {}

    def of_contracted(self, shape: tuple[int, bytes]) -> int:
        if shape not in self.contracted:
            self.contracted[shape] = self._insert(
                "contracted", "contracted_id", {"edges": _edges(*shape), "vertices": shape[0]}
            )
        return self.contracted[shape]

    def of_group(self, form: GroupForm, order: int) -> tuple[int, int]:
        """Return (number, class) of a group."""
        if form not in self.groups:
            from graphsynth.atlas.facts import group_graph
            from graphsynth.structure.contours import contour_class

            graph = group_graph(form)
            own = contour_class((a, b, f) if a else (b, -1, f) for a, b, f in graph.joints)
            number = self._insert(
                "groups", "group_id", {"key": graph.key, "links": form[0], '"order"': order, "class": own}
            )
            self.groups[form] = number, own
        return self.groups[form]

    def _insert(self, table: str, column: str, values: dict[str, Any]) -> int:
        name, known = next(iter(values.items()))
        row = self.connection.execute(f"SELECT {column} FROM {table} WHERE {name} = ?", (known,)).fetchone()
        if row:
            return int(row[0])
        marks = ", ".join("?" * len(values))
        cursor = self.connection.execute(
            f"INSERT INTO {table} ({', '.join(values)}) VALUES ({marks})", tuple(values.values())
        )
        return int(cursor.lastrowid or 0)


def _edges(vertices: int, rows: bytes) -> str:
    """Write a contracted graph as text: '0-1x2 0-2'."""
    found = []
    for p in range(vertices):
        for q in range(p + 1, vertices):
            times = rows[p * vertices + q]
            if times:
                found.append(f"{p}-{q}" + (f"x{times}" if times > 1 else ""))
    return " ".join(found)


def _assortment(counts: dict[int, int]) -> str:
    return "-".join(str(counts.get(a, 0)) for a in range(2, max(counts) + 1))


def build_family(
    connection: sqlite3.Connection,
    family_id: int,
    mobility: int,
    pieces: list[tuple[int, Piece]],
    executor: Executor | None = None,
    watch: Watch | None = None,
) -> None:
    """Write the pieces of a family that are not there yet."""
    from functools import partial

    from graphsynth.synthesis.parallel import in_order

    ids = _Ids(connection)
    done = {row[0] for row in connection.execute("SELECT piece FROM pieces WHERE family_id = ?", (family_id,))}
    rest = [(number, piece) for number, piece in pieces if number not in done]
    total = sum(piece.weight for _, piece in pieces) or 1.0
    share = sum(piece.weight for number, piece in pieces if number in done)
    written = connection.execute("SELECT COUNT(*) FROM chains WHERE family_id = ?", (family_id,)).fetchone()[0]
    results = in_order(executor, partial(facts_of_piece, mobility=mobility), [piece for _, piece in rest])
    for (number, piece), facts in zip(rest, results):
        connection.execute("BEGIN IMMEDIATE")
        try:
            _write(connection, ids, family_id, mobility, facts)
            connection.execute("INSERT INTO pieces VALUES (?, ?, ?)", (family_id, number, len(facts)))
            connection.execute("COMMIT")
        except BaseException:
            connection.execute("ROLLBACK")
            raise
        written += len(facts)
        share += piece.weight
        if watch:
            watch(written, share / total)


def _write(
    connection: sqlite3.Connection,
    ids: _Ids,
    family_id: int,
    mobility: int,
    chains: Iterable[tuple[ChainFacts, bool]],
) -> None:
    start = connection.execute("SELECT COALESCE(MAX(chain_id), 0) FROM chains").fetchone()[0]
    rows: dict[str, list[tuple[Any, ...]]] = {"chains": [], "dyads": [], "inversions": [], "mechanisms": []}
    for chain_id, (facts, planar) in enumerate(chains, start + 1):
        rows["chains"].append(
            (
                chain_id, family_id, facts.key, None, facts.graph6, mobility, facts.links, facts.joints,
                facts.joints - facts.links + 1, _assortment(facts.assortment), facts.automorphisms,
                " ".join(",".join(map(str, orbit)) for orbit in facts.orbits), len(facts.orbits), int(planar),
                facts.girth, int(bool(facts.cut_links)), ids.of_contracted(facts.contracted),
            )
        )  # fmt: skip
        rows["dyads"] += [(chain_id, parent) for parent in facts.parents]
        rows["inversions"] += [
            (chain_id, frame, sizes[1], "-".join(map(str, sizes))) for frame, sizes in facts.levels.items()
        ]
        rows["mechanisms"] += [
            (chain_id, frame, driver, *_described(ids, groups)) for frame, driver, groups in facts.mechanisms
        ]
    for table, values in rows.items():
        if values:
            connection.executemany(f"INSERT INTO {table} VALUES ({', '.join('?' * len(values[0]))})", values)


def _described(ids: _Ids, groups: Any) -> tuple[int | None, int | None, str | None]:
    """Class, order and groups of a mechanism, or three times NULL."""
    if groups is None:
        return None, None, None
    found = [ids.of_group(form, order) for form, order in groups]
    return max(own for _, own in found), max(order for _, order in groups), " ".join(str(number) for number, _ in found)


def finish_family(connection: sqlite3.Connection, family_id: int) -> None:
    """Give the chains of a family their labels: rank by key within an assortment."""
    held, expected = connection.execute(
        "SELECT (SELECT COUNT(*) FROM chains c WHERE c.family_id = f.family_id), expected FROM families f "
        "WHERE family_id = ?",
        (family_id,),
    ).fetchone()
    if held != expected:
        raise GraphsynthError(f"the family holds {held} chains, but counting gives {expected}: build it anew")
    connection.execute("BEGIN IMMEDIATE")
    connection.execute(
        "UPDATE chains SET label = ranked.label FROM (SELECT chain_id, mobility || '.' || links || '.' || assortment "
        "|| '.' || ROW_NUMBER() OVER (PARTITION BY assortment ORDER BY key) AS label FROM chains WHERE family_id = ?) "
        "AS ranked WHERE chains.chain_id = ranked.chain_id",
        (family_id,),
    )
    connection.execute("UPDATE families SET complete = 1 WHERE family_id = ?", (family_id,))
    connection.execute("COMMIT")
    connection.executescript(INDEXES)
