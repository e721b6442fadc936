"""Tables of a catalogue file in SQL: what each column may hold is part of the file, so that SQLite itself can say."""

from __future__ import annotations

import re
from collections.abc import Iterator

#: In the header of every catalogue file ("GSyn"), so that another SQLite file is not taken for one.
APPLICATION_ID = 0x4753796E
SCHEMA_VERSION = 6
#: Edges of a contracted graph; none for a ring.
EDGES = re.compile(r"(\d{1,2}-\d{1,2}(x\d{1,2})?( (?!$)|$))*", re.ASCII)

_KEY = "{0} GLOB '1[A-Za-z0-9]*' AND {0} NOT GLOB '*[^A-Za-z0-9_-]*' AND length({0}) < 60"
_LINK = "frame BETWEEN 0 AND 17"
_DRIVER = (
    "typeof(driver) = 'integer' AND driver BETWEEN 0 AND 17 OR typeof(driver) = 'text' AND driver GLOB '[0-9]*' AND "
    "driver NOT GLOB '*[^0-9,]*' AND length(driver) < 60"
)
_FLAG = "{0} IN (0, 1)"
_MOST = 9007199254740991
_COUNT = f"{{0}} BETWEEN 1 AND {_MOST}"
_LIST = "{0} NOT GLOB '*[^0-9 ]*' AND length({0}) < 100"
# words of people: not empty, not long, no control characters, and nothing that a spreadsheet takes for a formula
_WORD = (
    "length({0}) BETWEEN 1 AND 200 AND {0} NOT GLOB '[=+@-]*' AND "
    "{0} NOT GLOB '*[' || char(1) || '-' || char(31) || char(127) || '-' || char(159) || ']*' AND "
    "instr({0}, char(0)) = 0"
)
_STEM = "mobility || '.' || links || '.' || assortment || '.'"
_RANK = f"CAST(substr(label, length({_STEM}) + 1) AS INTEGER)"

SCHEMA = f"""
CREATE TABLE meta (name TEXT PRIMARY KEY, value TEXT NOT NULL) STRICT, WITHOUT ROWID;
-- a family: all chains of one mobility and number of links
CREATE TABLE families (
  family_id INTEGER PRIMARY KEY,
  mobility INTEGER NOT NULL CHECK (mobility BETWEEN 1 AND 15),
  links INTEGER NOT NULL CHECK (links BETWEEN 2 AND 18),
  fractionated INTEGER NOT NULL CHECK ({_FLAG.format("fractionated")}),
  pieces INTEGER NOT NULL CHECK (pieces BETWEEN 1 AND 1000000), -- units of work
  cut TEXT NOT NULL CHECK (length(cut) = 16 AND cut NOT GLOB '*[^0-9a-f]*'), -- names the question and its pieces
  shard TEXT NOT NULL CHECK (shard GLOB '[1-9]*/[1-9]*' AND shard NOT GLOB '*[^0-9/]*' AND length(shard) < 20), -- 'i/m'
  expected INTEGER CHECK (expected >= 0), -- chains of the whole family by counting; a shard is not counted
  complete INTEGER NOT NULL CHECK ({_FLAG.format("complete")}), -- 1 when every piece is there and labels are given
  UNIQUE (mobility, links), CHECK (NOT complete OR shard = '1/1' AND expected IS NOT NULL)) STRICT;
-- a piece that is written stands here, in the same transaction as its chains, which have consecutive numbers
CREATE TABLE pieces (
  family_id INTEGER NOT NULL REFERENCES families,
  piece INTEGER NOT NULL CHECK (piece BETWEEN 0 AND 999999),
  first_chain INTEGER NOT NULL CHECK (first_chain >= 1), chains INTEGER NOT NULL CHECK (chains >= 0),
  PRIMARY KEY (family_id, piece)) STRICT, WITHOUT ROWID;
CREATE TABLE contracted (
  contracted_id INTEGER PRIMARY KEY, vertices INTEGER NOT NULL CHECK (vertices BETWEEN 0 AND 18),
  edges TEXT NOT NULL UNIQUE CHECK (edges NOT GLOB '*[^0-9x -]*' AND length(edges) < 1000), -- 'a-b', 'a-bxm': m paths
  planar INTEGER NOT NULL CHECK ({_FLAG.format("planar")})) STRICT;
CREATE TABLE groups (
  group_id INTEGER PRIMARY KEY, key TEXT NOT NULL UNIQUE CHECK ({_KEY.format("key")}), -- the base as frame
  links INTEGER NOT NULL CHECK (links BETWEEN 1 AND 17), "order" INTEGER NOT NULL CHECK ("order" BETWEEN 1 AND 17),
  class INTEGER NOT NULL CHECK (class BETWEEN 1 AND 99),
  modes INTEGER CHECK ({_COUNT.format("modes")}) -- assembly modes, complex ones too; NULL: more than ten links
  ) STRICT;
-- how a mechanism is assembled: the groups, the highest class and order among them, and the product of their modes
CREATE TABLE structures (
  structure_id INTEGER PRIMARY KEY,
  groups TEXT NOT NULL UNIQUE CHECK (groups NOT GLOB '*[^0-9 ]*' AND length(groups) < 200), -- in the order of assembly
  class INTEGER NOT NULL CHECK (class BETWEEN 1 AND 99), "order" INTEGER NOT NULL CHECK ("order" BETWEEN 0 AND 17),
  modes INTEGER CHECK ({_COUNT.format("modes")})) STRICT;
CREATE TABLE chains (
  chain_id INTEGER PRIMARY KEY, family_id INTEGER NOT NULL REFERENCES families,
  key TEXT NOT NULL UNIQUE CHECK ({_KEY.format("key")}),
  label TEXT UNIQUE CHECK ({_RANK} > 0 AND label = {_STEM} || {_RANK}), -- given when the family is complete
  graph6 TEXT NOT NULL CHECK (graph6 NOT GLOB '*[^?-~]*' AND unicode(graph6) = links + 63
    AND length(graph6) = 1 + (links * (links - 1) / 2 + 5) / 6),
  mobility INTEGER NOT NULL CHECK (mobility BETWEEN 1 AND 15), links INTEGER NOT NULL CHECK (links BETWEEN 2 AND 18),
  joints INTEGER NOT NULL CHECK (3 * (links - 1) - 2 * joints = mobility),
  loops INTEGER NOT NULL CHECK (loops = joints - links + 1),
  assortment TEXT NOT NULL CHECK (assortment GLOB '[0-9]*' AND assortment NOT GLOB '*[^0-9-]*'
    AND assortment NOT GLOB '*--*' AND assortment NOT GLOB '*-' AND length(assortment) < 60), -- '4-4': links by joints
  automorphisms INTEGER NOT NULL CHECK ({_COUNT.format("automorphisms")}),
  link_orbits TEXT NOT NULL CHECK (link_orbits NOT GLOB '*[^0-9, ]*' AND length(link_orbits) < 100),
  inversions INTEGER NOT NULL CHECK (inversions BETWEEN 1 AND links),
  planar INTEGER NOT NULL CHECK ({_FLAG.format("planar")}),
  girth INTEGER NOT NULL CHECK (girth BETWEEN 0 AND links),
  fractionated INTEGER NOT NULL CHECK ({_FLAG.format("fractionated")}),
  mobility_type TEXT NOT NULL CHECK (mobility_type IN ('total', 'partial', 'fractionated')),
  contracted_id INTEGER NOT NULL REFERENCES contracted) STRICT;
-- removing a dyad of two binary links from the chain leaves the parent
CREATE TABLE dyads (
  chain_id INTEGER NOT NULL REFERENCES chains, parent_key TEXT NOT NULL CHECK ({_KEY.format("parent_key")}),
  PRIMARY KEY (chain_id, parent_key)) STRICT, WITHOUT ROWID;
-- one row for each orbit of links: the chain with that link as frame, and the curves that points of its links draw
CREATE TABLE inversions (
  chain_id INTEGER NOT NULL REFERENCES chains, frame INTEGER NOT NULL CHECK ({_LINK}),
  frame_joints INTEGER NOT NULL CHECK (frame_joints BETWEEN 1 AND 17),
  levels TEXT NOT NULL CHECK (levels NOT GLOB '*[^0-9-]*' AND length(levels) < 60), -- links on each level: '1-2-3'
  degree INTEGER CHECK ({_COUNT.format("degree")}), genus INTEGER CHECK (genus BETWEEN 0 AND {_MOST}), -- largest
  degrees TEXT CHECK ({_LIST.format("degrees")}), genera TEXT CHECK ({_LIST.format("genera")}), -- by link: '0 2 6 2'
  PRIMARY KEY (chain_id, frame)) STRICT, WITHOUT ROWID;
-- one row for each orbit of (frame, as many driven links jointed to it as the mobility) that can be moved so
CREATE TABLE driven (
  chain_id INTEGER NOT NULL, frame INTEGER NOT NULL CHECK ({_LINK}),
  driver ANY NOT NULL CHECK ({_DRIVER}), -- driven link; text such as '1,3' for several
  structure_id INTEGER NOT NULL REFERENCES structures,
  PRIMARY KEY (chain_id, frame, driver)) STRICT, WITHOUT ROWID;
CREATE VIEW mechanisms AS
  SELECT d.chain_id, d.frame, d.driver, s.class, s."order", s.modes, s.groups, i.levels, i.degree, i.genus
  FROM driven d JOIN structures s USING (structure_id) JOIN inversions i USING (chain_id, frame);
CREATE VIEW relatives AS
  SELECT p.chain_id AS parent_id, d.chain_id AS child_id, d.parent_key, c.key AS child_key
  FROM dyads d JOIN chains c USING (chain_id) LEFT JOIN chains p ON p.key = d.parent_key;
-- what somebody evaluated: 'dimensions', 'transmission', 'jamming', ...; a row that is absent was not computed
CREATE TABLE evaluations (
  chain_id INTEGER NOT NULL REFERENCES chains, frame INTEGER NOT NULL CHECK ({_LINK}),
  driver ANY NOT NULL CHECK ({_DRIVER}),
  kind TEXT NOT NULL CHECK ({_WORD.format("kind")}), status TEXT NOT NULL CHECK ({_WORD.format("status")}),
  value REAL CHECK (abs(value) < 9e999), unit TEXT CHECK ({_WORD.format("unit")}),
  guarantee TEXT CHECK (guarantee IN ('exact', 'certified', 'estimated')),
  data TEXT CHECK (length(data) <= 1000000), -- JSON
  PRIMARY KEY (chain_id, frame, driver, kind)) STRICT, WITHOUT ROWID;
"""

#: Made when a family is complete: building them row by row would slow the writing.
INDEXES = """
CREATE INDEX IF NOT EXISTS chains_by_family ON chains (family_id, assortment);
CREATE INDEX IF NOT EXISTS dyads_by_parent ON dyads (parent_key);
"""


def wrong_rows() -> Iterator[tuple[str, str]]:
    """Yield (table, question) for every table: the column of a value that its CHECK refuses.

    SQLite itself forgets the checks of a file that it opens for reading only.
    """
    for table, body in re.findall(r"^CREATE TABLE (\w+) \((.*?)^(?=--|CREATE|$)", SCHEMA, re.DOTALL | re.MULTILINE):
        cases = []
        for found in re.finditer(r"CHECK \(", body):
            column = re.findall(r"(\w+)\"? (?:INTEGER|TEXT|REAL|ANY)\b", body[: found.start()])[-1]
            cases.append((column, body[found.end() : _end(body, found.end())]))
        if cases:
            column = " ".join(f"WHEN NOT ({check}) THEN '{name}'" for name, check in cases)
            wrong = " OR ".join(f"NOT ({check})" for _, check in cases)
            yield table, f"SELECT CASE {column} END FROM {table} WHERE {wrong} LIMIT 1"


def _end(text: str, start: int) -> int:
    """Where the bracket closes that was opened before ``start``."""
    depth = 1
    for at in range(start, len(text)):
        depth += (text[at] == "(") - (text[at] == ")")
        if not depth:
            return at
    raise AssertionError(text)
