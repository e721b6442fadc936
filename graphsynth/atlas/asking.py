"""Questions to a catalogue in SQL: nothing but reading, within bounds of time and memory, Ctrl-C obeyed."""

from __future__ import annotations

import sqlite3
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from graphsynth.core.errors import FormatError, GraphsynthError, SpecError

#: Longest time of a question, unless another is given.
SECONDS = 60.0
_STEPS = 100_000
#: Bytes that the rows of an answer may take, and columns of a question; one value is bounded where the file is opened.
_MOST_BYTES = 400_000_000
_MOST_COLUMNS = 100
_ALLOWED = {
    sqlite3.SQLITE_SELECT, sqlite3.SQLITE_READ, sqlite3.SQLITE_FUNCTION, sqlite3.SQLITE_RECURSIVE,
}  # fmt: skip
_PRAGMAS = {
    "table_info", "table_xinfo", "table_list", "index_list", "index_info", "integrity_check", "quick_check",
    "foreign_key_check", "data_version",
}  # fmt: skip
#: Errors that are of the file, though SQLite calls them errors of the question.
_OF_THE_FILE = ("disk I/O", "malformed", "decode to UTF-8", "not a database", "locked")


@dataclass(frozen=True, slots=True)
class Answer:
    """Rows of a question.

    Parameters
    ----------
    columns : list of str
    rows : list of tuple
    more : bool
        There are more rows than were asked for.
    """

    columns: list[str]
    rows: list[tuple[Any, ...]]
    more: bool


def ask(
    connection: sqlite3.Connection,
    path: Path,
    text: str,
    parameters: Sequence[Any],
    limit: int | None = None,
    seconds: float | None = SECONDS,
) -> Answer:
    """Answer a question that only reads.

    ``limit``: read so many rows at most, and whether there are more; ``seconds``: give up after this time; None:
    never. Raises `SpecError` if SQLite refuses the question, it would do more than read (attach or write files), or
    it takes too much. Raises `FormatError` if the file is damaged. Raises `GraphsynthError` if the catalogue is
    closed.
    """
    if isinstance(parameters, str | bytes):
        raise SpecError(f"parameters = {parameters!r} must be a list of values, one for each '?'")
    try:
        with _reading_only(connection, seconds):
            cursor = connection.execute(text, tuple(parameters))
            try:
                return _read(cursor, limit)
            finally:
                cursor.close()
    except GraphsynthError:
        raise
    except MemoryError:
        raise SpecError(f"SQLite has too little memory for {text!r}: ask for less at a time") from None
    except sqlite3.Error as error:
        raise _told(error, path, text, seconds) from None
    except (sqlite3.Warning, ValueError, OverflowError) as error:
        raise SpecError(f"SQLite refuses {text!r}: {error}") from None


def _read(cursor: sqlite3.Cursor, limit: int | None) -> Answer:
    rows: list[tuple[Any, ...]] = []
    size = 0
    for row in cursor:
        if len(rows) == limit:
            return Answer(_names(cursor), rows, True)
        size += 64 + sum(56 if value is None or isinstance(value, int | float) else 80 + len(value) for value in row)
        if size > _MOST_BYTES:
            raise SpecError(
                f"the answer takes more than {_MOST_BYTES // 1_000_000} MB after {len(rows)} rows: ask for fewer "
                "rows or columns, or export the tables"
            )
        rows.append(row)
    return Answer(_names(cursor), rows, False)


def _names(cursor: sqlite3.Cursor) -> list[str]:
    return [column[0] for column in cursor.description or ()]


def _told(error: sqlite3.Error, path: Path, text: str, seconds: float | None) -> BaseException:
    """Say whether the question, the file or the caller is at fault."""
    words = str(error)
    if words == "interrupted":
        return KeyboardInterrupt()
    if words == _LATE:
        return SpecError(f"{text!r} takes more than {seconds:g} s: ask for less, or allow more seconds")
    if "closed database" in words:
        return GraphsynthError(f"the catalogue {path} is closed: open it again")
    of_question = isinstance(
        error, sqlite3.OperationalError | sqlite3.ProgrammingError | sqlite3.InterfaceError | sqlite3.DataError
    )
    denied = any(word in words for word in ("prohibited", "not authorized", "authorization denied"))
    if (of_question or denied) and not any(own in words for own in _OF_THE_FILE):
        return SpecError(f"SQLite refuses {text!r}: {error}")
    return FormatError(f"the file is damaged or cannot be read ({error}): build it anew", str(path))


_LATE = "late"


class _Late(sqlite3.OperationalError):
    """The time of a question is over."""


@contextmanager
def _reading_only(connection: sqlite3.Connection, seconds: float | None) -> Iterator[None]:
    """Refuse everything but reading, end what takes too long, and let Python see Ctrl-C during a long question."""
    end = None if seconds is None else time.monotonic() + seconds
    late = False

    def allowed(action: int, first: str | None, *_: str | None) -> int:
        good = action in _ALLOWED or (action == sqlite3.SQLITE_PRAGMA and first in _PRAGMAS)
        return sqlite3.SQLITE_OK if good else sqlite3.SQLITE_DENY

    def over() -> int:
        nonlocal late
        late = end is not None and time.monotonic() > end
        return int(late)

    usual = connection.setlimit(sqlite3.SQLITE_LIMIT_COLUMN, _MOST_COLUMNS)
    connection.set_authorizer(allowed)
    connection.set_progress_handler(over, _STEPS)
    try:
        yield
    except sqlite3.OperationalError as error:
        if late and str(error) == "interrupted":
            raise _Late(_LATE) from None
        raise
    finally:
        connection.set_progress_handler(None, 0)
        connection.set_authorizer(None)
        connection.setlimit(sqlite3.SQLITE_LIMIT_COLUMN, usual)


def columns(connection: sqlite3.Connection, table: str) -> list[str]:
    """Names of the columns of a table."""
    return [row[1] for row in connection.execute(f"PRAGMA table_info({table})")]
