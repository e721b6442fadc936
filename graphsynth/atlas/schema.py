"""Opening a catalogue file, which may come from anywhere, and leaving it whole."""

from __future__ import annotations

import os
import sqlite3
import time
from collections.abc import Iterator
from contextlib import closing, contextmanager, suppress
from functools import lru_cache
from pathlib import Path

from graphsynth.atlas.sealing import DISTRUST, broken_seal, seal, take_back, unfinished
from graphsynth.atlas.tables import APPLICATION_ID, EDGES, INDEXES, SCHEMA, SCHEMA_VERSION, wrong_rows
from graphsynth.core.errors import FormatError, GraphsynthError
from graphsynth.core.wording import plain

#: Longest text or row that is read, in bytes; the longest that a catalogue may hold is a fifth of it.
_LONGEST = 5_000_000
#: How long another writer is waited for, in seconds.
_PATIENCE = 10.0
#: What values that nobody wrote may cause in a reader, beside the errors of SQLite.
GARBAGE = (ValueError, TypeError, LookupError, ArithmeticError, AttributeError, RecursionError, MemoryError)


def connect(path: Path, *, create: bool = False, readonly: bool = False) -> sqlite3.Connection:
    """Open a catalogue file; it holds the tables of this version and nothing else, no triggers or other views.

    Raises `FormatError` if the file is missing, is no catalogue, or was written by another version; when it is opened
    for writing, also if it was changed by another program.
    """
    if not create and not path.is_file():
        raise FormatError("there is no such catalogue: build one with 'graphsynth catalog build'", str(path))
    if create and not path.absolute().parent.is_dir():
        raise FormatError("the folder of the catalogue does not exist: make it, or name another file", str(path))
    mode = "ro" if readonly else "rwc" if create else "rw"
    left = unfinished(path)
    if readonly and _is_still(path):
        mode = "ro&immutable=1"
        if left:
            raise FormatError(
                f"a change that was stopped half way lies beside it ({left[0]}): copy both to a folder that may be "
                "written, and open it there",
                str(path),
            )
    last = time.monotonic() + _PATIENCE
    while True:
        try:
            if readonly and any(name.endswith("-journal") for name in left):
                take_back(path)
            return _opened(path, mode, create, readonly)
        except (sqlite3.Error, MemoryError, UnicodeError) as error:
            code = getattr(error, "sqlite_errorcode", 0) & 0xFF
            if code != sqlite3.SQLITE_BUSY or time.monotonic() > last:
                full = code in (sqlite3.SQLITE_FULL, sqlite3.SQLITE_IOERR)
                remedy = ": make room, or name another file" if create or full else ""
                why = plain(str(error))[:300]
                raise FormatError(f"cannot be opened as a catalogue ({why}){remedy}", str(path)) from None
        time.sleep(0.02)  # SQLite refuses some locks at once, without waiting for their owner


def _opened(path: Path, mode: str, create: bool, readonly: bool) -> sqlite3.Connection:
    connection = sqlite3.connect(
        f"{path.absolute().as_uri()}?mode={mode}", uri=True, isolation_level=None, check_same_thread=False
    )
    try:
        # nothing in the file decides what is called or how much memory is taken
        connection.setlimit(sqlite3.SQLITE_LIMIT_LENGTH, _LONGEST)
        for pragma in (*DISTRUST, "PRAGMA mmap_size = 0"):
            connection.execute(pragma)
        _check(connection, path, create)
        if not readonly:
            _check_seal(connection, path)
            connection.execute("PRAGMA journal_mode = WAL")
            connection.execute("PRAGMA synchronous = NORMAL")
    except BaseException:
        connection.close()
        raise
    return connection


def _is_still(path: Path) -> bool:
    """Whether nobody can write the file, as on a read-only medium: SQLite then needs no files beside it."""
    return not os.access(path, os.W_OK) and not os.access(path.resolve().parent, os.W_OK)


@contextmanager
def readable(path: Path, *garbage: type[Exception]) -> Iterator[None]:
    """Turn what a damaged file does to a reader into one sentence, a `FormatError`.

    ``*garbage``: what values that nobody wrote may cause, beside the errors of SQLite.
    """
    damage: tuple[type[Exception], ...] = (sqlite3.Error, *garbage)
    try:
        yield
    except GraphsynthError:
        raise
    except damage as error:
        if "closed database" in str(error):
            raise GraphsynthError(f"the catalogue {path} is closed: open it again") from None
        raise FormatError(
            f"the file is damaged or cannot be read ({plain(str(error))[:300]}): 'graphsynth catalog verify' says "
            "where; build it anew",
            str(path),
        ) from None


def screen(connection: sqlite3.Connection, path: Path) -> None:
    """Read the whole file and hold every value against what its column may hold: labels, keys, edges, numbers.

    Raises `FormatError` if a value is of another form; the sentence names the table.
    """
    with readable(path, *GARBAGE):
        found = [str(row[0]) for row in connection.execute("PRAGMA quick_check(1)")]
        if found == ["ok"]:
            for table, question in wrong_rows():
                found += [f"{row[0]} in {table}" for row in connection.execute(question)]
            for (edges,) in connection.execute("SELECT edges FROM contracted"):
                found += [] if EDGES.fullmatch(edges) else ["edges in contracted"]
    if found != ["ok"]:
        said = plain(" ".join(found[-1].split()))[:200]
        raise FormatError(
            f"is damaged or holds values that no catalogue holds ({said}): 'graphsynth catalog verify' "
            "says more; build it anew, or take it from its source again",
            str(path),
        )


def _check(connection: sqlite3.Connection, path: Path, create: bool) -> None:
    """Make the tables of an empty file; refuse one that is no catalogue, or of another version."""
    if create:
        # in one transaction, so that a file is never half a catalogue
        connection.execute("BEGIN IMMEDIATE")
        if not connection.execute("SELECT COUNT(*) FROM sqlite_master").fetchone()[0]:
            made = f"PRAGMA application_id = {APPLICATION_ID};\nPRAGMA user_version = {SCHEMA_VERSION};\n{SCHEMA}"
            for statement in made.split(";\n"):
                connection.execute(statement)
        connection.execute("COMMIT")
    if connection.execute("PRAGMA application_id").fetchone()[0] != APPLICATION_ID:
        raise FormatError("is a database, but not a catalogue of graphsynth; name another file", str(path))
    version = connection.execute("PRAGMA user_version").fetchone()[0]
    if version != SCHEMA_VERSION:
        raise FormatError(
            f"has schema version {version}, this graphsynth reads {SCHEMA_VERSION}: build it anew", str(path)
        )
    always, sometimes = _wanted()
    held = set(connection.execute("SELECT type, name, tbl_name, sql FROM sqlite_master LIMIT ?", (len(always) + 100,)))
    others = sorted({str(row[1]) for row in (held - always - sometimes) | (always - held)})
    if others:
        raise FormatError(
            f"its tables are not those of a catalogue ({plain(', '.join(others))[:200]} differs): build it anew, or "
            "take it from its source again",
            str(path),
        )


@lru_cache(maxsize=1)
def _wanted() -> tuple[frozenset[tuple[str, ...]], frozenset[tuple[str, ...]]]:
    """Everything that the schema of a file must name, and what it may name beside that."""
    rows = "SELECT type, name, tbl_name, sql FROM sqlite_master"
    with closing(sqlite3.connect(":memory:")) as own:
        always = frozenset(own.executescript(SCHEMA).execute(rows))
        return always, frozenset(own.executescript(INDEXES).execute(rows)) - always


def _check_seal(connection: sqlite3.Connection, path: Path) -> None:
    """Take no changes of others over into a file that will have a new seal."""
    connection.execute("PRAGMA wal_checkpoint(TRUNCATE)")  # what a killed process left is taken in, or dropped
    connection.execute("BEGIN IMMEDIATE")  # nobody is in the middle of writing
    found = broken_seal(connection) if connection.execute("SELECT COUNT(*) FROM meta").fetchone()[0] else ""
    connection.execute("ROLLBACK")
    if found:
        raise FormatError(f"{found}: nothing is written; take it from its source again, or build it anew", str(path))


def settle(connection: sqlite3.Connection) -> None:
    """Leave one plain file that can be read from anywhere: no write-ahead log beside it (unless others read it now).

    It carries a seal, see :mod:`graphsynth.atlas.sealing`.
    """
    with suppress(sqlite3.Error, OSError):  # it stays as it is: whole, with a log beside it or without a seal
        connection.execute("PRAGMA busy_timeout = 200")
        connection.execute("PRAGMA journal_mode = DELETE")
        connection.execute("PRAGMA busy_timeout = 5000")
        seal(connection)
