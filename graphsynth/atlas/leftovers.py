"""What lies beside a catalogue when a process was killed while it changed it: the journals of SQLite.

SQLite takes an unfinished change back when it next opens the file for writing, and refuses to read it until then.  It
believes what a journal says, also the name of a file that it deletes thereafter: a forged one could name any.
"""

from __future__ import annotations

import sqlite3
import stat
from contextlib import closing
from pathlib import Path

from graphsynth.core.errors import FormatError

_NAMES = bytes.fromhex("d9d505f920a163d7")  # the end of a journal that names another file


def unfinished(path: Path) -> list[str]:
    """Names of the journals with content beside a file.

    Raises `FormatError` if one is no plain file, or names another file, as those of a catalogue never do.
    """
    real, found = path.resolve(), []
    for journal in (real.with_name(real.name + end) for end in ("-journal", "-wal")):
        try:
            about = journal.lstat()
            plain = stat.S_ISREG(about.st_mode)
            end = _end(journal, about.st_size) if plain else b""
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


def take_back(path: Path) -> None:
    """Take a change back that was not finished; one that another process is making is let be."""
    with closing(sqlite3.connect(f"{path.absolute().as_uri()}?mode=rw", uri=True)) as connection:
        connection.execute("PRAGMA trusted_schema = OFF")
        connection.execute("PRAGMA cell_size_check = ON")
        connection.execute("SELECT COUNT(*) FROM sqlite_master")


def _end(journal: Path, size: int) -> bytes:
    with journal.open("rb") as file:
        file.seek(max(size - len(_NAMES), 0))
        return file.read(len(_NAMES))
