"""A catalogue file that is open: its connection, questions in tables and in SQL, damage told in one sentence."""

from __future__ import annotations

import sqlite3
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from threading import RLock
from typing import TYPE_CHECKING, Any, Self

from graphsynth.atlas.asking import SECONDS, Answer, ask, columns
from graphsynth.atlas.schema import GARBAGE, connect, readable, screen
from graphsynth.core.errors import SpecError

if TYPE_CHECKING:
    import pandas as pd

TABLES = (
    "chains", "inversions", "mechanisms", "groups", "structures", "contracted", "dyads", "relatives", "evaluations",
    "families",
)  # fmt: skip


class OpenCatalogue:
    """What an open file answers whatever its tables mean; base of :class:`graphsynth.Catalogue`.

    One may be used from several threads: they take turns.

    Parameters
    ----------
    path : str or Path
        A file made by :meth:`graphsynth.Catalogue.build`; opened read-only.

    Raises
    ------
    FormatError
        If the file is missing or is no catalogue.
    """

    def __init__(self, path: str | Path) -> None:
        self.path = Path(path)
        self.connection: sqlite3.Connection = connect(self.path, readonly=True)
        self._turn = RLock()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *error: object) -> None:
        self.close()

    def close(self) -> None:
        """Close the file."""
        with self._turn:
            self.connection.close()

    def __len__(self) -> int:
        """Return the number of chains."""
        return int(self._ask("SELECT COUNT(*) FROM chains", (), seconds=None).rows[0][0])

    def _ask(
        self, text: str, parameters: Sequence[Any], limit: int | None = None, seconds: float | None = SECONDS
    ) -> Answer:
        with self._turn:
            return ask(self.connection, self.path, text, parameters, limit, seconds)

    @contextmanager
    def reading(self, *, screened: bool = False) -> Iterator[None]:
        """Tell of what a damaged file holds, whatever that is, in one sentence; other threads wait.

        Parameters
        ----------
        screened : bool
            Hold every value of the file against what its column may hold, before anything is done with them.

        Yields
        ------
        None
            Errors of SQLite, and those that values cause which nobody wrote, leave the block as `FormatError`.
        """
        with self._turn, readable(self.path, *GARBAGE):
            if screened:
                screen(self.connection, self.path)
            yield

    def query(
        self,
        table: str = "chains",
        where: str = "1",
        parameters: Sequence[Any] = (),
        *,
        limit: int | None = None,
        seconds: float | None = SECONDS,
    ) -> pd.DataFrame:
        """Return the rows of a table that fulfil an SQL condition.

        Parameters
        ----------
        table : str
            One of the tables of the reference page.
        where : str
            SQL condition; values as ``?``.
        parameters : sequence
            The values.
        limit : int, optional
        seconds : float, optional
            As for :meth:`sql`.

        Raises
        ------
        SpecError
            For an unknown table or column, with those there are, or a condition that SQLite refuses.
        FormatError
            If the file is damaged.
        """
        if table not in TABLES:
            raise SpecError(f"there is no table {table!r}; choose one of {', '.join(TABLES)}")
        try:
            return self.sql(f"SELECT * FROM {table} WHERE {where}", parameters, limit=limit, seconds=seconds)
        except SpecError as error:
            if "no such column" not in str(error):
                raise
            with self.reading():
                known = ", ".join(columns(self.connection, table))
            raise SpecError(f"{error}; {table} has {known}") from None

    def sql(
        self,
        text: str,
        parameters: Sequence[Any] = (),
        *,
        limit: int | None = None,
        seconds: float | None = SECONDS,
    ) -> pd.DataFrame:
        """Return the result of any SQL question that only reads.

        Parameters
        ----------
        text : str
        parameters : sequence
            Values for ``?``.
        limit : int, optional
            Read so many rows at most; ``attrs["more"]`` of the table says whether there are more.
        seconds : float, optional
            Longest time, 60 s by default; None: no bound.

        Raises
        ------
        SpecError
            If SQLite refuses it, it would write or attach a file, it takes longer, or its rows take more than 400 MB.
        FormatError
            If the file is damaged.
        """
        import pandas as pd

        if limit is not None and limit < 0:
            raise SpecError(f"limit = {limit} must be 0 or more")
        answer = self._ask(text, parameters, limit, seconds)
        frame = pd.DataFrame(answer.rows, columns=answer.columns)
        frame.attrs["more"] = answer.more
        return frame
