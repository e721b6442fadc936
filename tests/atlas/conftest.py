"""What the tests of catalogues share: a way to put anything into a file."""

from __future__ import annotations

import shutil
import sqlite3
from contextlib import contextmanager
from time import monotonic

import pytest

from graphsynth.atlas.catalogue import Catalogue
from graphsynth.atlas.sealing import seal


@contextmanager
def loosened(path, *, sealed=True, anything=False):
    """Give a connection that writes whatever it is told, past the checks of the columns; the tables are as before.

    ``sealed``: put a new seal on the file, as somebody who wants to deceive would; ``anything``: past the types, too.
    """
    text = "UPDATE sqlite_master SET sql = "
    plain = "replace(replace(sql, ') STRICT, WITHOUT', ') WITHOUT'), ') STRICT', ')')"
    loose = f"{text} replace(replace({plain}, 'INTEGER NOT NULL', 'INTEGER'), 'TEXT NOT NULL', 'TEXT')"
    kept = []
    for step in ("before", "after"):
        raw = sqlite3.connect(path, isolation_level=None)
        if anything:
            raw.execute("PRAGMA writable_schema = ON")
        if step == "before" and anything:
            kept = raw.execute("SELECT sql, name FROM sqlite_master").fetchall()
            raw.execute(loose)
        elif step == "after":
            if anything:
                raw.executemany(f"{text} ? WHERE name = ?", kept)
            if sealed and raw.execute("SELECT COUNT(*) FROM sqlite_master WHERE name = 'meta'").fetchone()[0]:
                raw.execute("DELETE FROM meta")
                seal(raw)
        raw.close()
        if step == "before":
            raw = sqlite3.connect(path, isolation_level=None)
            raw.execute("PRAGMA ignore_check_constraints = ON")
            end = monotonic() + 5.0  # a view put in before may have no end
            raw.set_progress_handler(lambda end=end: monotonic() > end, 100_000)
            try:
                yield raw
            finally:
                raw.close()


@pytest.fixture(scope="session")
def altered():
    """:func:`loosened`, for tests."""
    return loosened


@pytest.fixture(scope="session")
def built(tmp_path_factory):
    """Give a folder its copy ``x.sqlite`` of a catalogue that is built once for all tests.

    It holds chains of mobility 1 with these numbers of links, and those of mobility 2 ``with_two``, the fractionated
    ones among them.
    """
    made = {}

    def copy(folder, links, *, with_two=()):
        asked = tuple(links), tuple(with_two)
        if asked not in made:
            made[asked] = tmp_path_factory.mktemp("built") / "x.sqlite"
            Catalogue.build(made[asked], asked[0]).close()
            if with_two:
                Catalogue.build(made[asked], asked[1], 2, fractionated=True).close()
        return shutil.copy(made[asked], folder / "x.sqlite")

    return copy
