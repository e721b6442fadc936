"""Tables of a catalogue file, and opening one."""

from __future__ import annotations

import sqlite3
from pathlib import Path

from graphsynth.errors import FormatError

__all__ = ["APPLICATION_ID", "SCHEMA", "SCHEMA_VERSION", "connect"]

#: In the header of every catalogue file ("GSyn"), so that another SQLite file is not taken for one.
APPLICATION_ID = 0x4753796E
SCHEMA_VERSION = 1

SCHEMA = """
CREATE TABLE meta (name TEXT PRIMARY KEY, value TEXT NOT NULL) WITHOUT ROWID;
-- a family: all chains of one mobility and number of links
CREATE TABLE families (
  family_id INTEGER PRIMARY KEY,
  mobility INTEGER NOT NULL, links INTEGER NOT NULL, fractionated INTEGER NOT NULL,
  pieces INTEGER NOT NULL,      -- units of work
  shard TEXT NOT NULL,          -- 'i/m': the part of the family this file holds
  expected INTEGER,             -- chains by counting without listing; NULL for a part
  complete INTEGER NOT NULL,    -- 1 when every piece is there and labels are given
  UNIQUE (mobility, links, fractionated));
-- a piece that is written stands here, in the same transaction as its chains
CREATE TABLE pieces (
  family_id INTEGER NOT NULL REFERENCES families, piece INTEGER NOT NULL, chains INTEGER NOT NULL,
  PRIMARY KEY (family_id, piece)) WITHOUT ROWID;
CREATE TABLE contracted (
  contracted_id INTEGER PRIMARY KEY, vertices INTEGER NOT NULL,
  edges TEXT NOT NULL UNIQUE);  -- 'a-b' or 'a-bxm' for m parallel paths
CREATE TABLE groups (
  group_id INTEGER PRIMARY KEY, key TEXT NOT NULL UNIQUE, -- canonical key, the base as frame
  links INTEGER NOT NULL, "order" INTEGER NOT NULL, class INTEGER NOT NULL);
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
-- one row for each orbit of (frame, driven link jointed to it)
CREATE TABLE mechanisms (
  chain_id INTEGER NOT NULL, frame INTEGER NOT NULL, driver INTEGER NOT NULL,
  class INTEGER, -- highest class of a group; NULL: not computed
  "order" INTEGER, groups TEXT, -- group_id of the groups in the order of assembly: '1 1 3'
  PRIMARY KEY (chain_id, frame, driver)) WITHOUT ROWID;
-- what somebody evaluated: dimensions, transmission, jamming; absent means not computed
CREATE TABLE evaluations (
  chain_id INTEGER NOT NULL REFERENCES chains, frame INTEGER NOT NULL, driver INTEGER NOT NULL,
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
        If the file is missing, is no catalogue, or was written by a later version.
    """
    if not create and not path.is_file():
        raise FormatError("there is no such catalogue: build one with 'graphsynth catalog build'", str(path))
    fresh = create and (not path.exists() or path.stat().st_size == 0)
    mode = "ro" if readonly else "rwc" if create else "rw"
    try:
        connection = sqlite3.connect(f"{path.absolute().as_uri()}?mode={mode}", uri=True, isolation_level=None)
        if not readonly:
            connection.execute("PRAGMA journal_mode = WAL")
            connection.execute("PRAGMA synchronous = NORMAL")
        if fresh:
            connection.executescript(
                f"PRAGMA application_id = {APPLICATION_ID}; PRAGMA user_version = {SCHEMA_VERSION}; "
                f"BEGIN; {SCHEMA} COMMIT;"
            )
        owner = connection.execute("PRAGMA application_id").fetchone()[0]
        version = connection.execute("PRAGMA user_version").fetchone()[0]
    except sqlite3.DatabaseError as error:
        raise FormatError(f"cannot be opened as a catalogue ({error})", str(path)) from None
    if owner != APPLICATION_ID:
        connection.close()
        raise FormatError("is a database, but not a catalogue of graphsynth; name another file", str(path))
    if version != SCHEMA_VERSION:
        connection.close()
        raise FormatError(
            f"has schema version {version}, this graphsynth reads {SCHEMA_VERSION}: build it anew", str(path)
        )
    return connection
