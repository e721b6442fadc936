"""A catalogue of kinematic chains in one file: build, open, ask."""

from __future__ import annotations

import sqlite3
from collections.abc import Callable, Iterable, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from graphsynth.atlas.building import build_family, finish_family
from graphsynth.atlas.schema import connect
from graphsynth.errors import GraphsynthError, SpecError

if TYPE_CHECKING:
    import pandas as pd

    from graphsynth.structure.graph import MechanismGraph

__all__ = ["BuildStep", "Catalogue"]

_TABLES = ("chains", "inversions", "mechanisms", "groups", "contracted", "dyads", "evaluations", "families")


@dataclass(frozen=True, slots=True)
class BuildStep:
    """How far a build is: the family, the chains written of it and the share of its work done."""

    mobility: int
    links: int
    chains: int
    done: float


class Catalogue:
    """A catalogue file, open for questions.

    Parameters
    ----------
    path : str or Path
        A file made by :meth:`build`; opened read-only.

    Raises
    ------
    FormatError
        If the file is missing or is no catalogue.

    Examples
    --------
    >>> import tempfile, pathlib
    >>> folder = tempfile.TemporaryDirectory()
    >>> with Catalogue.build(pathlib.Path(folder.name) / "small.sqlite", links=range(4, 9, 2)) as small:
    ...     print(len(small), small.query("chains", "links = 6")["key"].tolist())
    19 ['1BgMw8g', '1BgOB7A']
    >>> folder.cleanup()
    """

    def __init__(self, path: str | Path) -> None:
        self.path = Path(path)
        self.connection: sqlite3.Connection = connect(self.path, readonly=True)

    @classmethod
    def build(
        cls,
        path: str | Path,
        links: Iterable[int],
        mobility: int = 1,
        *,
        fractionated: bool = False,
        executor: Executor | None = None,
        shard: tuple[int, int] | None = None,
        watch: Callable[[BuildStep], None] | None = None,
    ) -> Catalogue:
        """Make a catalogue, or go on with one: all chains of a mobility with these numbers of links, once each.

        Parameters
        ----------
        path : str or Path
            Made if it does not exist; a family that is there is not made again, an interrupted one is continued.
        links : iterable of int
            Numbers of links; those without a chain of this mobility are passed over.
        mobility : int
        fractionated : bool
            For mobility >= 2: include chains that fall apart at a link or a joint.
        executor : concurrent.futures.Executor, optional
            Who computes the facts; one process writes.  The file holds the same rows for any.
        shard : (int, int), optional
            Part i of m of every family; labels are given when the parts are merged.
        watch : callable, optional
            Told a :class:`BuildStep` after every piece.

        Raises
        ------
        SpecError, TooLargeError
            For numbers out of their bounds.
        FormatError
            If the file is no catalogue.
        """
        from graphsynth.synthesis.problem import Problem

        problems = [
            (count, Problem.chains(count, mobility, 3, None, fractionated, None)) for count in sorted(set(links))
        ]
        if not problems:
            raise SpecError("no number of links given; name at least one, for example links=range(4, 11)")
        connection = connect(Path(path), create=True)
        try:
            for count, problem in problems:
                _build(connection, problem, mobility, count, fractionated, executor, shard, watch)
        finally:
            connection.close()
        return cls(path)

    def __enter__(self) -> Catalogue:
        return self

    def __exit__(self, *error: object) -> None:
        self.close()

    def close(self) -> None:
        """Close the file."""
        self.connection.close()

    def __len__(self) -> int:
        """Return the number of chains."""
        return int(self.connection.execute("SELECT COUNT(*) FROM chains").fetchone()[0])

    def query(self, table: str = "chains", where: str = "1", parameters: Sequence[Any] = ()) -> pd.DataFrame:
        """Return the rows of a table that fulfil an SQL condition.

        Parameters
        ----------
        table : str
            One of the tables of the reference page.
        where : str
            SQL condition; values as ``?``.
        parameters : sequence
            The values.

        Raises
        ------
        SpecError
            For an unknown table or a condition that SQLite refuses; the message says why.
        """
        if table not in _TABLES:
            raise SpecError(f"there is no table {table!r}; choose one of {', '.join(_TABLES)}")
        return self.sql(f"SELECT * FROM {table} WHERE {where}", parameters)

    def sql(self, text: str, parameters: Sequence[Any] = ()) -> pd.DataFrame:
        """Return the result of any SQL question; the file is open read-only.

        Raises
        ------
        SpecError
            If SQLite refuses it.
        """
        import pandas as pd

        try:
            cursor = self.connection.execute(text, tuple(parameters))
        except sqlite3.Error as error:
            raise SpecError(f"SQLite refuses {text!r}: {error}") from None
        return pd.DataFrame(cursor.fetchall(), columns=[column[0] for column in cursor.description or ()])

    def chain(self, name: str) -> MechanismGraph:
        """Return a chain by its key or its label.

        Raises
        ------
        SpecError
            If the catalogue does not hold it.
        """
        from graphsynth.structure.graph import MechanismGraph

        row = self.connection.execute("SELECT key FROM chains WHERE key = ? OR label = ?", (name, name)).fetchone()
        if row is None:
            raise SpecError(f"no chain {name!r} in {self.path.name}; give a key or a label such as 1.8.4-4.1")
        return MechanismGraph.from_key(row[0])


def _build(
    connection: sqlite3.Connection,
    problem: Any,
    mobility: int,
    links: int,
    fractionated: bool,
    executor: Executor | None,
    shard: tuple[int, int] | None,
    watch: Callable[[BuildStep], None] | None,
) -> None:
    """Make or continue one family."""
    from graphsynth.synthesis.parallel import counts
    from graphsynth.synthesis.writing import shard_of

    whole = list(problem.pieces(listing=True))
    number = {id(piece): k for k, piece in enumerate(whole)}
    pieces = [(number[id(piece)], piece) for piece in shard_of(whole, shard)]
    part = f"{shard[0]}/{shard[1]}" if shard else "1/1"
    question = (mobility, links, int(fractionated))
    select = "SELECT family_id, complete, shard FROM families WHERE (mobility, links, fractionated) = (?, ?, ?)"
    row = connection.execute(select, question).fetchone()
    if row is None:
        expected = None if shard else sum(counts(problem.pieces(listing=False), None))
        connection.execute(
            "INSERT INTO families (mobility, links, fractionated, pieces, shard, expected, complete) "
            "VALUES (?, ?, ?, ?, ?, ?, 0)",
            (*question, len(whole), part, expected),
        )
        row = connection.execute(select, question).fetchone()
    if row[2] != part:
        raise GraphsynthError(f"the file holds part {row[2]} of this family, not {part}: name another file")
    if row[1]:
        return

    def told(chains: int, done: float) -> None:
        if watch:
            watch(BuildStep(mobility, links, chains, done))

    build_family(connection, row[0], mobility, pieces, executor, told)
    if not shard:
        finish_family(connection, row[0])
