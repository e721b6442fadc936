"""Building a catalogue: pieces computed anywhere, written in order by one writer, each in one transaction."""

from __future__ import annotations

import sqlite3
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import astuple, dataclass
from typing import TYPE_CHECKING, Any

from graphsynth.atlas.facts import modes_of_all
from graphsynth.atlas.tables import INDEXES
from graphsynth.core.errors import GraphsynthError

if TYPE_CHECKING:
    from graphsynth.atlas.facts import Rows


@dataclass(frozen=True, slots=True)
class BuildStep:
    """How far a build is: the family, the chains written of it and the share of its work done."""

    mobility: int
    links: int
    chains: int
    done: float


@contextmanager
def transaction(connection: sqlite3.Connection) -> Iterator[None]:
    """All or nothing; what the disk or another process prevents becomes one sentence.

    Raises `GraphsynthError` if SQLite cannot write: a full disk, a read-only file, another writer.
    """
    try:
        connection.execute("BEGIN IMMEDIATE")
        connection.execute("DELETE FROM meta")  # the seal
        yield
        connection.execute("COMMIT")
    except BaseException as error:
        if connection.in_transaction:
            connection.execute("ROLLBACK")
        if isinstance(error, sqlite3.OperationalError):
            path = connection.execute("PRAGMA database_list").fetchone()[2]
            raise GraphsynthError(
                f"the catalogue cannot be written ({error}): {path}; what is there stays: make room or wait for the "
                "other writer, then give the same command to go on"
            ) from None
        raise


def is_planar(edges: str) -> bool:
    """Whether a contracted graph, as text, and so each chain that it makes, can be drawn without crossings."""
    import networkx

    pairs = [edge.partition("x")[0].split("-") for edge in edges.split()]
    return bool(networkx.check_planarity(networkx.Graph(pairs))[0])


class Writer:
    """Writes rows and numbers what they refer to, in the order of first appearance in the file."""

    def __init__(self, connection: sqlite3.Connection) -> None:
        self.connection = connection
        self._known: dict[tuple[str, str], int] = {}  # numbers by table and name
        self._planar: dict[str, int] = {}  # by edges

    def write(self, family_id: int, mobility: int, piece: int, rows: Rows) -> None:
        """Write a piece, inside a transaction.

        Raises `GraphsynthError` if the piece is there already: somebody else is writing the file.
        """
        execute = self.connection.execute
        if execute("SELECT 1 FROM pieces WHERE (family_id, piece) = (?, ?)", (family_id, piece)).fetchone():
            raise GraphsynthError("another process writes this catalogue: wait for it, or name another file")
        start = execute("SELECT COALESCE(MAX(chain_id), 0) + 1 FROM chains").fetchone()[0]
        shapes = [self._of_contracted(*shape) for shape in rows.contracted]
        structures = self._of_structures(rows)
        many = self.connection.executemany
        many(
            "INSERT INTO chains VALUES (?, ?, ?, NULL, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?)",
            (
                (at, family_id, *own[:2], mobility, *own[2:9], shapes[own[12]][1], *own[9:12], shapes[own[12]][0])
                for at, own in enumerate(rows.chains, start)
            ),
        )
        many("INSERT INTO dyads VALUES (?, ?)", ((start + at, parent) for at, parent in rows.dyads))
        inversions = ((start + at, *rest) for at, *rest in rows.inversions)
        many("INSERT INTO inversions VALUES (?, ?, ?, ?, ?, ?, ?, ?)", inversions)
        many(
            "INSERT INTO driven VALUES (?, ?, ?, ?)",
            ((start + at, frame, driver, structures[own]) for at, frame, driver, own in rows.mechanisms),
        )
        execute("INSERT INTO pieces VALUES (?, ?, ?, ?)", (family_id, piece, start, len(rows.chains)))

    def _of_contracted(self, vertices: int, edges: str) -> tuple[int, int]:
        """Return (number, whether it is planar) of a contracted graph, of which the chain is a subdivision."""
        if edges not in self._planar:
            self._planar[edges] = int(is_planar(edges))
        values = {"edges": edges, "vertices": vertices, "planar": self._planar[edges]}
        return self._number("contracted", "contracted_id", values), self._planar[edges]

    def _of_structures(self, rows: Rows) -> list[int]:
        numbers, groups = [], list(rows.groups)
        for own in rows.structures:
            members = [groups[at] for at in own]
            names = []
            for group in members:
                values = dict(zip(("key", "links", '"order"', "class", "modes"), astuple(group)))
                names.append(str(self._number("groups", "group_id", values)))
            highest = max((group.group_class for group in members), default=1)
            order = max((group.order for group in members), default=0)
            modes = modes_of_all(group.modes for group in members)
            structure = {"groups": " ".join(names), "class": highest, '"order"': order, "modes": modes}
            numbers.append(self._number("structures", "structure_id", structure))
        return numbers

    def _number(self, table: str, column: str, values: dict[str, Any]) -> int:
        """Return the number of a row, which is written if it is new; its first value names it."""
        unique, name = next(iter(values.items()))
        if (table, name) not in self._known:
            row = self.connection.execute(f"SELECT {column} FROM {table} WHERE {unique} = ?", (name,)).fetchone()
            if row is None:
                marks = ", ".join("?" * len(values))
                text = f"INSERT INTO {table} ({', '.join(values)}) VALUES ({marks}) RETURNING {column}"
                row = self.connection.execute(text, tuple(values.values())).fetchone()
            self._known[table, name] = int(row[0])
        return self._known[table, name]


def open_family(
    connection: sqlite3.Connection, question: tuple[int, int, int], row: tuple[Any, ...]
) -> tuple[int, bool]:
    """Return (number, whether it is complete) of a family, begun if it is not there.

    ``question`` is (mobility, links, fractionated), ``row`` (pieces, cut, shard, expected).  Raises `GraphsynthError`
    if the file holds the family in another way: with or without fractionated chains, another part, another cut.
    """
    mobility, links, fractionated = question
    select = "SELECT family_id, complete, fractionated, cut, shard FROM families WHERE (mobility, links) = (?, ?)"
    found = connection.execute(select, (mobility, links)).fetchone()
    if found is None:
        with transaction(connection):
            connection.execute(
                "INSERT INTO families (mobility, links, fractionated, pieces, cut, shard, expected, complete) "
                "VALUES (?, ?, ?, ?, ?, ?, ?, 0)",
                (*question, *row),
            )
        return open_family(connection, question, row)
    name = f"the chains of mobility {mobility} with {links} links"
    if found[2] != fractionated:
        ways = ("without", "with")
        raise GraphsynthError(
            f"the file holds {name} {ways[found[2]]} fractionated ones, not {ways[fractionated]}: name another file"
        )
    if found[4] != row[2]:
        raise GraphsynthError(f"the file holds part {found[4]} of {name}, not {row[2]}: name another file")
    if not found[1] and found[3] != row[1]:
        raise GraphsynthError(f"{name} were begun by another version of graphsynth: delete the file and build it anew")
    return found[0], bool(found[1])


def build_family(
    connection: sqlite3.Connection,
    family_id: int,
    mobility: int,
    pieces: list[tuple[int, float]],
    results: Callable[[list[int]], Iterator[Rows]],
    watch: Callable[[int, float], None] | None = None,
) -> None:
    """Write the pieces of a family that are not there yet.

    ``pieces`` are (number, weight); ``results`` gives the rows of the pieces at some places of ``pieces``, in
    their order; ``watch`` is told ``(chains written, share of the work done)`` after every piece.
    """
    writer = Writer(connection)
    done = {row[0] for row in connection.execute("SELECT piece FROM pieces WHERE family_id = ?", (family_id,))}
    rest = [at for at, (number, _) in enumerate(pieces) if number not in done]
    total = sum(weight for _, weight in pieces) or 1.0
    share = sum(weight for number, weight in pieces if number in done)
    written = connection.execute("SELECT COUNT(*) FROM chains WHERE family_id = ?", (family_id,)).fetchone()[0]
    for at, rows in zip(rest, results(rest)):
        number, weight = pieces[at]
        with transaction(connection):
            writer.write(family_id, mobility, number, rows)
        written += len(rows.chains)
        share += weight
        if watch:
            watch(written, share / total)


def finish_family(connection: sqlite3.Connection, family_id: int) -> None:
    """Give the chains of a family their labels, rank by key within an assortment, and mark it complete.

    Raises `GraphsynthError` if the number of chains is not what counting without listing gives.
    """
    held, expected = connection.execute(
        "SELECT (SELECT COUNT(*) FROM chains c WHERE c.family_id = f.family_id), expected FROM families f "
        "WHERE family_id = ?",
        (family_id,),
    ).fetchone()
    if held != expected:
        raise GraphsynthError(f"the family holds {held} chains, but counting gives {expected}: build it anew")
    with transaction(connection):
        connection.execute(
            "UPDATE chains SET label = ranked.label FROM (SELECT chain_id, mobility || '.' || links || '.' || "
            "assortment || '.' || ROW_NUMBER() OVER (PARTITION BY assortment ORDER BY key) AS label FROM chains "
            "WHERE family_id = ?) AS ranked WHERE chains.chain_id = ranked.chain_id",
            (family_id,),
        )
        connection.execute("UPDATE families SET complete = 1 WHERE family_id = ?", (family_id,))
        for statement in INDEXES.split(";"):
            connection.execute(statement)
