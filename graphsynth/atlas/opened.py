"""A catalogue file that is open: its connection, questions in tables and in SQL, damage told in one sentence."""

from __future__ import annotations

import sqlite3
from collections.abc import Sequence
from contextlib import AbstractContextManager
from pathlib import Path
from typing import TYPE_CHECKING, Any, Self

from graphsynth.atlas.schema import connect, readable
from graphsynth.errors import SpecError

if TYPE_CHECKING:
    import pandas as pd

__all__ = ["OpenCatalogue"]

_TABLES = (
    "chains", "inversions", "mechanisms", "groups", "structures", "contracted", "dyads", "relatives", "evaluations",
    "families",
)  # fmt: skip


class OpenCatalogue:
    """What an open file answers whatever its tables mean; base of :class:`graphsynth.Catalogue`.

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

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *error: object) -> None:
        self.close()

    def close(self) -> None:
        """Close the file."""
        self.connection.close()

    def __len__(self) -> int:
        """Return the number of chains."""
        return int(self._rows("SELECT COUNT(*) FROM chains", ())[1][0][0])

    def _rows(self, text: str, parameters: Sequence[Any]) -> tuple[list[str], list[tuple[Any, ...]]]:
        from graphsynth.atlas.asking import ask

        return ask(self.connection, self.path, text, parameters)

    def reading(self) -> AbstractContextManager[None]:
        """Tell of what a damaged file holds, whatever that is, in one sentence.

        Returns
        -------
        context manager
            Errors of SQLite, and those that values cause which nobody wrote, leave it as `FormatError`.
        """
        return readable(self.path, ValueError, TypeError, LookupError, ArithmeticError)

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
            For an unknown table or column, with those there are, or a condition that SQLite refuses.
        FormatError
            If the file is damaged.
        """
        from graphsynth.atlas.asking import columns

        if table not in _TABLES:
            raise SpecError(f"there is no table {table!r}; choose one of {', '.join(_TABLES)}")
        try:
            return self.sql(f"SELECT * FROM {table} WHERE {where}", parameters)
        except SpecError as error:
            if "no such column" not in str(error):
                raise
            raise SpecError(f"{error}; {table} has {', '.join(columns(self.connection, table))}") from None

    def sql(self, text: str, parameters: Sequence[Any] = ()) -> pd.DataFrame:
        """Return the result of any SQL question that only reads.

        Raises
        ------
        SpecError
            If SQLite refuses it, or it would write or attach a file.
        FormatError
            If the file is damaged.
        """
        import pandas as pd

        columns, rows = self._rows(text, parameters)
        return pd.DataFrame(rows, columns=columns)
