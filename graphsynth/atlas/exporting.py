"""Tables of a catalogue in files, and a digest of its content; neither shows numbers internal to the file."""

from __future__ import annotations

import csv
import json
import re
import sqlite3
from collections.abc import Iterator
from hashlib import sha256
from itertools import islice
from pathlib import Path
from typing import Any

from graphsynth.atlas.tables import SCHEMA
from graphsynth.core.errors import GraphsynthError, SpecError
from graphsynth.core.extras import need
from graphsynth.core.wholefiles import replacing

_CHAIN = "c.mobility, c.links, c.key"

#: Rows of each table in an order that depends on the content alone.  A number of a group is its rank by size and key.
TABLES = {
    "families": "SELECT mobility, links, fractionated, expected, complete FROM families ORDER BY mobility, links",
    "groups": 'SELECT rank AS "group", key, links, "order", class, modes FROM temp.ranked_groups ORDER BY rank',
    "chains": (
        "SELECT c.key, c.label, c.graph6, c.mobility, c.links, c.joints, c.loops, c.assortment, c.automorphisms, "
        "c.link_orbits, c.inversions, c.planar, c.girth, c.fractionated, c.mobility_type, "
        "h.vertices AS contracted_vertices, "
        f"h.edges AS contracted FROM chains c JOIN contracted h USING (contracted_id) ORDER BY {_CHAIN}"
    ),
    "dyads": f"SELECT c.key, d.parent_key FROM chains c JOIN dyads d USING (chain_id) ORDER BY {_CHAIN}, d.parent_key",
    "inversions": (
        "SELECT c.key, i.frame, i.frame_joints, i.levels, i.degree, i.genus, i.degrees, i.genera "
        f"FROM chains c JOIN inversions i USING (chain_id) ORDER BY {_CHAIN}, i.frame"
    ),
    "mechanisms": (
        'SELECT c.key, d.frame, CAST(d.driver AS TEXT) AS driver, s.class, s."order", s.modes, s.ranks AS groups '
        "FROM chains c JOIN driven d USING (chain_id) JOIN temp.ranked_structures s USING (structure_id) "
        f"ORDER BY {_CHAIN}, d.frame, CAST(d.driver AS TEXT)"
    ),
    "evaluations": (
        "SELECT c.key, e.frame, CAST(e.driver AS TEXT) AS driver, e.kind, e.status, e.value, e.unit, e.guarantee, "
        f"e.data FROM chains c JOIN evaluations e USING (chain_id) ORDER BY {_CHAIN}, e.frame, e.driver, e.kind"
    ),
}
FORMS = ("csv", "jsonl", "parquet")
_ROWS = 100_000

_RANKS = """
CREATE TEMP TABLE IF NOT EXISTS ranked_groups AS
  SELECT group_id, ROW_NUMBER() OVER (ORDER BY links, key) AS rank, key, links, "order", class, modes FROM main.groups;
CREATE TEMP TABLE IF NOT EXISTS ranked_structures (
  structure_id INTEGER PRIMARY KEY, ranks TEXT, class INTEGER, "order" INTEGER, modes INTEGER);
DELETE FROM temp.ranked_structures;
"""


def _prepare(connection: sqlite3.Connection) -> None:
    """Give groups numbers that follow from their content."""
    connection.executescript(_RANKS)
    rank = dict(connection.execute("SELECT group_id, rank FROM temp.ranked_groups"))
    rows = []
    for number, groups, *rest in connection.execute(
        'SELECT structure_id, groups, class, "order", modes FROM structures'
    ):
        rows.append((number, " ".join(str(rank[int(group)]) for group in groups.split()), *rest))
    connection.execute("BEGIN")
    connection.executemany("INSERT INTO temp.ranked_structures VALUES (?, ?, ?, ?, ?)", rows)
    connection.execute("COMMIT")


def _blocks(cursor: sqlite3.Cursor) -> Iterator[list[tuple[Any, ...]]]:
    while block := list(islice(cursor, _ROWS)):
        yield block


def digest(connection: sqlite3.Connection) -> str:
    """Return a SHA-256 of the structural content; see :meth:`graphsynth.atlas.catalogue.Catalogue.digest`."""
    _prepare(connection)
    sha = sha256()
    for table, select in TABLES.items():
        if table == "evaluations":
            continue
        sha.update(f"{table}\n".encode())
        for block in _blocks(connection.execute(select)):
            sha.update("".join(json.dumps(row, separators=(",", ":")) + "\n" for row in block).encode())
    return sha.hexdigest()


def export(connection: sqlite3.Connection, folder: Path, form: str) -> list[Path]:
    """Write every table to a file; see :meth:`graphsynth.atlas.catalogue.Catalogue.export`."""
    if form not in FORMS:
        raise SpecError(f"there is no form {form!r}; choose one of {', '.join(FORMS)}")
    _prepare(connection)
    written: list[Path] = []
    try:
        folder.mkdir(parents=True, exist_ok=True)
        for table, select in TABLES.items():
            written.append(folder / f"{table}.{form}")
            cursor = connection.execute(select)
            with replacing(written[-1]) as fresh:
                _write(fresh, form, [column[0] for column in cursor.description], _blocks(cursor))
    except OSError as error:
        place = error.filename or (written or [folder])[-1]
        raise GraphsynthError(
            f"{place} cannot be written ({error.strerror or error}): make room or take another"
        ) from None
    return written


_INTEGERS = {*re.findall(r'(\w+)"? INTEGER', SCHEMA), "group", "contracted_vertices"}


def _write(path: Path, form: str, columns: list[str], blocks: Iterator[list[tuple[Any, ...]]]) -> None:
    if form != "parquet":
        with path.open("w", newline="", encoding="utf-8") as file:
            writer = csv.writer(file, lineterminator="\n")
            writer.writerows([columns] if form == "csv" else [])
            for block in blocks:
                if form == "csv":
                    writer.writerows(block)
                else:
                    file.writelines(json.dumps(dict(zip(columns, row))) + "\n" for row in block)
        return
    parquet = need("pyarrow.parquet", "parquet", "Parquet (csv and jsonl need nothing)")
    import pyarrow

    kinds = {"value": pyarrow.float64()} | dict.fromkeys(_INTEGERS, pyarrow.int64())
    schema = pyarrow.schema([(name, kinds.get(name, pyarrow.string())) for name in columns])
    with parquet.ParquetWriter(path, schema, compression="zstd") as writer:
        for block in blocks:
            writer.write_table(pyarrow.table([list(column) for column in zip(*block)], schema=schema))
