"""Questions to a catalogue in SQL: nothing but reading, damage told apart from mistakes, Ctrl-C obeyed."""

from __future__ import annotations

import sqlite3
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from graphsynth.errors import FormatError, SpecError

__all__ = ["ask", "columns"]

_STEPS = 1_000_000
_ALLOWED = {
    sqlite3.SQLITE_SELECT, sqlite3.SQLITE_READ, sqlite3.SQLITE_FUNCTION, sqlite3.SQLITE_RECURSIVE,
}  # fmt: skip
_PRAGMAS = {
    "table_info", "table_xinfo", "table_list", "index_list", "index_info", "integrity_check", "quick_check",
    "foreign_key_check", "data_version",
}  # fmt: skip
#: Errors that are of the file, though SQLite calls them errors of the question.
_OF_THE_FILE = ("disk I/O", "malformed", "decode to UTF-8", "not a database", "locked")


def ask(
    connection: sqlite3.Connection, path: Path, text: str, parameters: Sequence[Any]
) -> tuple[list[str], list[tuple[Any, ...]]]:
    """Return columns and rows of a question that only reads.

    Raises
    ------
    SpecError
        If SQLite refuses the question, or it would do more than read (attach or write files).
    FormatError
        If the file is damaged.
    """
    if isinstance(parameters, str | bytes):
        raise SpecError(f"parameters = {parameters!r} must be a list of values, one for each '?'")
    try:
        with _reading_only(connection):
            cursor = connection.execute(text, tuple(parameters))
            return [column[0] for column in cursor.description or ()], cursor.fetchall()
    except sqlite3.Error as error:
        if str(error) == "interrupted":
            raise KeyboardInterrupt from None
        of_question = isinstance(error, sqlite3.OperationalError | sqlite3.ProgrammingError | sqlite3.InterfaceError)
        denied = any(word in str(error) for word in ("prohibited", "not authorized", "authorization denied"))
        if (of_question or denied) and not any(words in str(error) for words in _OF_THE_FILE):
            raise SpecError(f"SQLite refuses {text!r}: {error}") from None
        raise FormatError(f"the file is damaged or cannot be read ({error}): build it anew", str(path)) from None
    except (sqlite3.Warning, ValueError, OverflowError) as error:
        raise SpecError(f"SQLite refuses {text!r}: {error}") from None


@contextmanager
def _reading_only(connection: sqlite3.Connection) -> Iterator[None]:
    """Refuse everything but reading, and let Python see Ctrl-C during a long question."""

    def allowed(action: int, first: str | None, *_: str | None) -> int:
        good = action in _ALLOWED or (action == sqlite3.SQLITE_PRAGMA and first in _PRAGMAS)
        return sqlite3.SQLITE_OK if good else sqlite3.SQLITE_DENY

    connection.set_authorizer(allowed)
    connection.set_progress_handler(lambda: 0, _STEPS)
    try:
        yield
    finally:
        connection.set_progress_handler(None, 0)
        connection.set_authorizer(None)


def columns(connection: sqlite3.Connection, table: str) -> list[str]:
    """Names of the columns of a table."""
    return [row[1] for row in connection.execute(f"PRAGMA table_info({table})")]
