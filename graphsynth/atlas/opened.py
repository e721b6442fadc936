"""A catalogue file that is open: questions in tables and in SQL that only read, within bounds of time and memory."""

from __future__ import annotations

import re
import sqlite3
import time
from collections.abc import Iterator, Sequence
from contextlib import closing, contextmanager
from dataclasses import dataclass
from pathlib import Path
from threading import RLock
from typing import TYPE_CHECKING, Any, Self

from graphsynth.atlas.schema import GARBAGE, connect, readable, screen
from graphsynth.core.errors import FormatError, GraphsynthError, SpecError

if TYPE_CHECKING:
    import pandas as pd

#: Longest time of a question, unless another is given.
SECONDS = 60.0
_STEPS = 100_000
#: Bytes that the rows of an answer may take, and columns of a question; one value is bounded where the file is opened.
_MOST_BYTES = 400_000_000
_MOST_COLUMNS = 100
_ALLOWED = {sqlite3.SQLITE_SELECT, sqlite3.SQLITE_READ, sqlite3.SQLITE_FUNCTION, sqlite3.SQLITE_RECURSIVE}
_PRAGMAS = re.compile(r"table_x?info|(table|index)_list|index_info|(integrity|quick|foreign_key)_check|data_version")
#: Tables and views that a user may ask for.
_STRUCTURE = ("chains", "inversions", "mechanisms", "groups", "structures", "contracted", "dyads", "relatives")
TABLES = (*_STRUCTURE, "evaluations", "families")
_OF_THE_QUESTION = sqlite3.OperationalError, sqlite3.ProgrammingError, sqlite3.InterfaceError, sqlite3.DataError
#: Errors that are of the file, though SQLite calls them errors of the question.
_OF_THE_FILE = ("disk I/O", "malformed", "decode to UTF-8", "not a database", "locked")


@dataclass(frozen=True, slots=True)
class Answer:
    """Rows of a question."""

    columns: list[str]
    rows: list[tuple[Any, ...]]
    more: bool  # there are more rows than were asked for


def _read(cursor: sqlite3.Cursor, limit: int | None) -> Answer:
    rows: list[tuple[Any, ...]] = []
    size, more = 0, False
    for row in cursor:
        if len(rows) == limit:
            more = True
            break
        size += 64 + sum(56 if value is None or isinstance(value, int | float) else 80 + len(value) for value in row)
        if size > _MOST_BYTES:
            raise SpecError(
                f"the answer takes more than {_MOST_BYTES // 1_000_000} MB after {len(rows)} rows: ask for fewer "
                "rows or columns, or export the tables"
            )
        rows.append(row)
    return Answer([column[0] for column in cursor.description or ()], rows, more)


@contextmanager
def _reading_only(connection: sqlite3.Connection, seconds: float | None, late: list[bool]) -> Iterator[None]:
    """Refuse everything but reading, end what takes too long, and let Python see Ctrl-C during a long question.

    What ends it because of the time says so in ``late``.
    """
    end = None if seconds is None else time.monotonic() + seconds

    def allowed(action: int, first: str | None, *_: str | None) -> int:
        good = action in _ALLOWED or (action == sqlite3.SQLITE_PRAGMA and bool(_PRAGMAS.fullmatch(first or "")))
        return sqlite3.SQLITE_OK if good else sqlite3.SQLITE_DENY

    def over() -> int:
        if end is not None and time.monotonic() > end:
            late.append(True)
        return len(late)

    usual = connection.setlimit(sqlite3.SQLITE_LIMIT_COLUMN, _MOST_COLUMNS)
    connection.set_authorizer(allowed)
    connection.set_progress_handler(over, _STEPS)
    try:
        yield
    finally:
        connection.set_progress_handler(None, 0)
        connection.set_authorizer(None)
        connection.setlimit(sqlite3.SQLITE_LIMIT_COLUMN, usual)


class OpenCatalogue:
    """What an open file answers whatever its tables mean, to one thread at a time; base of `graphsynth.Catalogue`."""

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

    def __repr__(self) -> str:
        return f"{type(self).__name__}({str(self.path)!r})"

    def __len__(self) -> int:
        """Return the number of chains."""
        return int(self._ask("SELECT COUNT(*) FROM chains", (), seconds=None).rows[0][0])

    def _ask(
        self, text: str, parameters: Sequence[Any], limit: int | None = None, seconds: float | None = SECONDS
    ) -> Answer:
        """Answer a question that only reads; see :meth:`sql`."""
        if isinstance(parameters, str | bytes):
            raise SpecError(f"parameters = {parameters!r} must be a list of values, one for each '?'")
        late: list[bool] = []
        try:
            with (
                self._turn,
                _reading_only(self.connection, seconds, late),
                closing(self.connection.execute(text, tuple(parameters))) as cursor,
            ):
                return _read(cursor, limit)
        except MemoryError:
            raise SpecError(f"SQLite has too little memory for {text!r}: ask for less at a time") from None
        except sqlite3.Error as error:
            words = str(error)
            if words == "interrupted" and late:
                raise SpecError(
                    f"{text!r} takes more than {seconds:g} s: ask for less, or allow more seconds"
                ) from None
            if words == "interrupted":
                raise KeyboardInterrupt from None
            if "closed database" in words:
                raise GraphsynthError(f"the catalogue {self.path} is closed: open it again") from None
            denied = any(word in words for word in ("prohibited", "not authorized", "authorization denied"))
            if (isinstance(error, _OF_THE_QUESTION) or denied) and not any(own in words for own in _OF_THE_FILE):
                raise SpecError(f"SQLite refuses {text!r}: {error}") from None
            raise FormatError(
                f"the file is damaged or cannot be read ({error}): build it anew", str(self.path)
            ) from None
        except (sqlite3.Warning, ValueError, OverflowError) as error:
            if isinstance(error, GraphsynthError):
                raise
            raise SpecError(f"SQLite refuses {text!r}: {error}") from None

    @contextmanager
    def reading(self, *, screened: bool = False) -> Iterator[None]:
        """Tell of what a damaged file holds, whatever that is, in one sentence; other threads wait.

        With ``screened``, every value of the file is first held against what its column may hold.  Errors of SQLite,
        and those caused by damaged values, leave the block as `FormatError`.
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
                known = ", ".join(row[1] for row in self.connection.execute(f"PRAGMA table_info({table})"))
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
