"""Whether a catalogue file is whole: the seal in it, and the journals that lie beside it when a process was killed.

The seal is a digest of the bytes of the file, kept in the file, that shows every change made by others.  It is over all
pages but the one that holds it, whose content is the digest alone; bytes of the header that say when and how the file
was written last count as zero.  The first transaction takes the seal off; it is put on again when the file is left
whole.  A seal is no signature: who wants to deceive can make a new one.

SQLite takes an unfinished change back when it next opens the file for writing, and refuses to read it until then.  It
believes what a journal says, also the name of a file that it deletes thereafter: a forged one could name any.
"""

from __future__ import annotations

import sqlite3
import stat
from contextlib import closing
from hashlib import blake2b
from io import FileIO
from pathlib import Path

from graphsynth.core.errors import FormatError

_BLOCK = 1 << 20

#: Bytes of the header: journal mode, change counter, its copy, and the version of SQLite that wrote.
_PASSING = ((18, 20), (24, 28), (92, 100))


def seal(connection: sqlite3.Connection) -> None:
    """Seal a file that has none; nothing happens while it has a log beside it.

    Raises `sqlite3.Error, OSError` if it cannot be read or written.
    """
    if connection.execute("SELECT COUNT(*) FROM meta").fetchone()[0] or _log(connection):
        return
    # the file is closed last: that would take the locks of this process away
    with _path(connection).open("rb", buffering=0) as file:
        connection.execute("BEGIN IMMEDIATE")
        try:
            value = _digest(file, *_place(connection))
            connection.execute("INSERT INTO meta VALUES ('seal', ?)", (value,))
            connection.execute("COMMIT")
        finally:
            if connection.in_transaction:
                connection.execute("ROLLBACK")


def broken_seal(connection: sqlite3.Connection) -> str:
    """Say what is wrong with the seal; empty if it is right and nothing was changed."""
    rows = connection.execute("SELECT name, value FROM meta LIMIT 2").fetchall()
    if not rows:
        return "it has no seal, as after a command that was killed (the same command goes on and seals it)"
    if _log(connection):
        return "a log lies beside it: another program writes to it, or was stopped while it did"
    with _path(connection).open("rb", buffering=0) as file:
        if rows != [("seal", _digest(file, *_place(connection)))]:
            return "it was changed after graphsynth wrote it: its bytes are not those of its seal"
    return ""


def _path(connection: sqlite3.Connection) -> Path:
    return Path(connection.execute("PRAGMA database_list").fetchone()[2])


def _log(connection: sqlite3.Connection) -> bool:
    """Whether a write-ahead log with content lies beside the file."""
    path = _path(connection)
    log = path.with_name(path.name + "-wal")
    return log.exists() and log.stat().st_size > 0


def _place(connection: sqlite3.Connection) -> tuple[int, int]:
    """First byte and size of the page that holds the seal."""
    size = connection.execute("PRAGMA page_size").fetchone()[0]
    root = connection.execute("SELECT rootpage FROM sqlite_master WHERE name = 'meta'").fetchone()[0]
    return (root - 1) * size, size


def _digest(file: FileIO, start: int, size: int) -> str:
    """Digest of a file without the page of the seal."""
    found = blake2b(digest_size=32)
    head = bytearray(file.read(start))
    for first, last in _PASSING:
        head[first:last] = bytes(last - first)
    found.update(head)
    file.seek(start + size)
    block = bytearray(_BLOCK)
    view = memoryview(block)
    while length := file.readinto(block):
        found.update(view[:length])
    return found.hexdigest()


_NAMES = bytes.fromhex("d9d505f920a163d7")  # the end of a journal that names another file


def unfinished(path: Path) -> list[str]:
    """Names of the journals with content beside a file.

    Raises `FormatError` if one is no plain file, or names another file, as those of a catalogue never do.
    """
    real, found = path.resolve(), []
    for journal in (real.with_name(real.name + end) for end in ("-journal", "-wal")):
        try:
            about = journal.lstat()
            plain, end = stat.S_ISREG(about.st_mode), b""
            if plain:
                with journal.open("rb") as file:
                    file.seek(max(about.st_size - len(_NAMES), 0))
                    end = file.read(len(_NAMES))
        except OSError:
            continue
        if not plain or end == _NAMES:
            raise FormatError(
                f"beside it lies {journal.name}, which names another file or is none, and is not of graphsynth: delete "
                "it, and take the catalogue from its source again",
                str(path),
            )
        found += [journal.name] if about.st_size else []
    return found


#: Nothing in a file decides what is called.
DISTRUST = ("PRAGMA trusted_schema = OFF", "PRAGMA cell_size_check = ON")


def take_back(path: Path) -> None:
    """Take a change back that was not finished; one that another process is making is let be."""
    with closing(sqlite3.connect(f"{path.absolute().as_uri()}?mode=rw", uri=True)) as connection:
        for statement in (*DISTRUST, "SELECT COUNT(*) FROM sqlite_master"):
            connection.execute(statement)
