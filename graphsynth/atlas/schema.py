"""Tables of a catalogue file, and opening one."""

from __future__ import annotations

import os
import sqlite3
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from graphsynth.errors import FormatError, GraphsynthError

__all__ = ["APPLICATION_ID", "INDEXES", "SCHEMA", "SCHEMA_VERSION", "connect", "readable", "settle"]

#: In the header of every catalogue file ("GSyn"), so that another SQLite file is not taken for one.
APPLICATION_ID = 0x4753796E
SCHEMA_VERSION = 3

SCHEMA = """
CREATE TABLE meta (name TEXT PRIMARY KEY, value TEXT NOT NULL) WITHOUT ROWID;
-- a family: all chains of one mobility and number of links
CREATE TABLE families (
  family_id INTEGER PRIMARY KEY,
  mobility INTEGER NOT NULL, links INTEGER NOT NULL, fractionated INTEGER NOT NULL,
  pieces INTEGER NOT NULL,      -- units of work
  cut TEXT NOT NULL,            -- fingerprint of the question and of its cut into pieces
  shard TEXT NOT NULL,          -- 'i/m': the part of the family this file holds
  expected INTEGER,             -- chains of the whole family by counting without listing; a shard is not counted
  complete INTEGER NOT NULL,    -- 1 when every piece is there and labels are given
  UNIQUE (mobility, links));
-- a piece that is written stands here, in the same transaction as its chains, which have consecutive numbers
CREATE TABLE pieces (
  family_id INTEGER NOT NULL REFERENCES families, piece INTEGER NOT NULL, first_chain INTEGER NOT NULL,
  chains INTEGER NOT NULL, PRIMARY KEY (family_id, piece)) WITHOUT ROWID;
CREATE TABLE contracted (
  contracted_id INTEGER PRIMARY KEY, vertices INTEGER NOT NULL,
  edges TEXT NOT NULL UNIQUE,   -- 'a-b', or 'a-bxm' for m parallel paths
  planar INTEGER NOT NULL);
CREATE TABLE groups (
  group_id INTEGER PRIMARY KEY, key TEXT NOT NULL UNIQUE, -- canonical key, the base as frame
  links INTEGER NOT NULL, "order" INTEGER NOT NULL, class INTEGER NOT NULL);
-- how a mechanism is assembled: the groups, and the highest class and order among them
CREATE TABLE structures (
  structure_id INTEGER PRIMARY KEY, groups TEXT NOT NULL UNIQUE, -- group_id of each group in the order of assembly
  class INTEGER NOT NULL, "order" INTEGER NOT NULL);
CREATE TABLE chains (
  chain_id INTEGER PRIMARY KEY, family_id INTEGER NOT NULL REFERENCES families,
  key TEXT NOT NULL UNIQUE, label TEXT UNIQUE, -- F.links.assortment.rank, given when the family is complete
  graph6 TEXT NOT NULL, mobility INTEGER NOT NULL, links INTEGER NOT NULL, joints INTEGER NOT NULL,
  loops INTEGER NOT NULL, assortment TEXT NOT NULL, -- numbers of links with 2, 3, ... joints: '4-4'
  automorphisms INTEGER NOT NULL, link_orbits TEXT NOT NULL, inversions INTEGER NOT NULL,
  planar INTEGER NOT NULL, girth INTEGER NOT NULL, fractionated INTEGER NOT NULL,
  contracted_id INTEGER NOT NULL REFERENCES contracted);
-- removing a dyad of two binary links from the chain leaves the parent
CREATE TABLE dyads (chain_id INTEGER NOT NULL REFERENCES chains, parent_key TEXT NOT NULL,
  PRIMARY KEY (chain_id, parent_key)) WITHOUT ROWID;
-- one row for each orbit of links: the chain with that link as frame
CREATE TABLE inversions (
  chain_id INTEGER NOT NULL REFERENCES chains, frame INTEGER NOT NULL,
  frame_joints INTEGER NOT NULL, levels TEXT NOT NULL, -- links on each adjacency level: '1-2-3'
  PRIMARY KEY (chain_id, frame)) WITHOUT ROWID;
-- one row for each orbit of (frame, as many driven links jointed to it as the mobility) that can be moved so
CREATE TABLE driven (
  chain_id INTEGER NOT NULL, frame INTEGER NOT NULL,
  driver NOT NULL,              -- driven link; text such as '1,3' for several
  structure_id INTEGER NOT NULL REFERENCES structures,
  PRIMARY KEY (chain_id, frame, driver)) WITHOUT ROWID;
CREATE VIEW mechanisms AS
  SELECT d.chain_id, d.frame, d.driver, s.class, s."order", s.groups, i.levels
  FROM driven d JOIN structures s USING (structure_id) JOIN inversions i USING (chain_id, frame);
CREATE VIEW relatives AS
  SELECT p.chain_id AS parent_id, d.chain_id AS child_id, d.parent_key, c.key AS child_key
  FROM dyads d JOIN chains c USING (chain_id) LEFT JOIN chains p ON p.key = d.parent_key;
-- what somebody evaluated: 'dimensions', 'transmission', 'jamming', ...; a row that is absent was not computed
CREATE TABLE evaluations (
  chain_id INTEGER NOT NULL REFERENCES chains, frame INTEGER NOT NULL, driver NOT NULL,
  kind TEXT NOT NULL, status TEXT NOT NULL, value REAL, unit TEXT, guarantee TEXT, data TEXT,
  PRIMARY KEY (chain_id, frame, driver, kind)) WITHOUT ROWID;
"""

#: Made when a family is complete: building them row by row would slow the writing.
INDEXES = """
CREATE INDEX IF NOT EXISTS chains_by_family ON chains (family_id, assortment);
CREATE INDEX IF NOT EXISTS dyads_by_parent ON dyads (parent_key);
"""


def connect(path: Path, *, create: bool = False, readonly: bool = False) -> sqlite3.Connection:
    """Open a catalogue file.

    Raises
    ------
    FormatError
        If the file is missing, is no catalogue, or was written by another version.
    """
    if not create and not path.is_file():
        raise FormatError("there is no such catalogue: build one with 'graphsynth catalog build'", str(path))
    if create and not path.absolute().parent.is_dir():
        raise FormatError("the folder of the catalogue does not exist: make it, or name another file", str(path))
    mode = "ro" if readonly else "rwc" if create else "rw"
    connection = None
    if readonly and _is_still(path):
        mode = "ro&immutable=1"
    try:
        connection = sqlite3.connect(f"{path.absolute().as_uri()}?mode={mode}", uri=True, isolation_level=None)
        _check(connection, path, create)
        if not readonly:
            connection.execute("PRAGMA journal_mode = WAL")
            connection.execute("PRAGMA synchronous = NORMAL")
    except sqlite3.Error as error:
        if connection:
            connection.close()
        raise FormatError(f"cannot be opened as a catalogue ({error})", str(path)) from None
    except FormatError:
        if connection:
            connection.close()
        raise
    return connection


def _is_still(path: Path) -> bool:
    """Whether nobody can write the file, as on a read-only medium: SQLite then needs no files beside it."""
    return not os.access(path, os.W_OK) and not os.access(path.resolve().parent, os.W_OK)


@contextmanager
def readable(path: Path, *garbage: type[Exception]) -> Iterator[None]:
    """Turn what a damaged file does to a reader into one sentence.

    Parameters
    ----------
    path : Path
    *garbage : exception types
        What values that nobody wrote may cause, beside the errors of SQLite.

    Raises
    ------
    FormatError
        If the file is damaged.
    """
    damage: tuple[type[Exception], ...] = (sqlite3.Error, *garbage)
    try:
        yield
    except GraphsynthError:
        raise
    except damage as error:
        raise FormatError(
            f"the file is damaged or cannot be read ({error}): 'graphsynth catalog verify' says where; build it anew",
            str(path),
        ) from None


def _check(connection: sqlite3.Connection, path: Path, create: bool) -> None:
    """Make the tables of an empty file; refuse one that is no catalogue, or of another version."""
    if create:
        # in one transaction, so that a file is never half a catalogue
        connection.execute("BEGIN IMMEDIATE")
        if not connection.execute("SELECT COUNT(*) FROM sqlite_master").fetchone()[0]:
            for statement in (f"PRAGMA application_id = {APPLICATION_ID}", f"PRAGMA user_version = {SCHEMA_VERSION}"):
                connection.execute(statement)
            for statement in SCHEMA.split(";\n"):
                if statement.strip():
                    connection.execute(statement)
        connection.execute("COMMIT")
    owner = connection.execute("PRAGMA application_id").fetchone()[0]
    version = connection.execute("PRAGMA user_version").fetchone()[0]
    if owner != APPLICATION_ID:
        raise FormatError("is a database, but not a catalogue of graphsynth; name another file", str(path))
    if version != SCHEMA_VERSION:
        raise FormatError(
            f"has schema version {version}, this graphsynth reads {SCHEMA_VERSION}: build it anew", str(path)
        )


def settle(connection: sqlite3.Connection) -> None:
    """Leave one plain file that can be read from anywhere: no write-ahead log beside it (unless others read it now)."""
    try:
        connection.execute("PRAGMA busy_timeout = 200")
        connection.execute("PRAGMA journal_mode = DELETE")
        connection.execute("PRAGMA busy_timeout = 5000")
    except sqlite3.Error:
        pass  # it stays as it is: whole, with a log beside it
