"""The data of the page: families of chains as scripts, since a page opened from a file may not fetch its data."""

from __future__ import annotations

import json
import sqlite3
from collections import Counter
from collections.abc import Iterator, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass
from itertools import groupby
from typing import Any

from graphsynth.structure.canonical import decode_key


@dataclass(frozen=True, slots=True)
class Family:
    """All chains of one mobility and number of links, in the order of the page: by assortment, then by rank."""

    name: str  # part of file names: "1-12"
    mobility: int
    links: int
    joints: int
    expected: int | None  # number of chains by counting without listing
    rows: tuple[sqlite3.Row, ...]  # the chains


_CHAINS = """
SELECT c.*, k.low, k.high FROM chains c LEFT JOIN (
  SELECT chain_id, MIN(class) AS low, MAX(class) AS high FROM mechanisms GROUP BY chain_id) k USING (chain_id)
WHERE family_id = ? AND label IS NOT NULL
"""


def _rank(row: sqlite3.Row) -> int:
    return int(row["label"].rsplit(".", 1)[1])


def _order(row: sqlite3.Row) -> tuple[list[int], int]:
    return [-int(count) for count in row["assortment"].split("-")], _rank(row)


def families(connection: sqlite3.Connection) -> list[Family]:
    """Return the finished families of a catalogue that hold a chain, by mobility and links."""
    found = []
    for family in _rows(connection, "SELECT * FROM families ORDER BY mobility, links"):
        rows = sorted(_rows(connection, _CHAINS, (family["family_id"],)), key=_order)
        for row in rows:
            _check_key(row, family)
        if rows:
            mobility, links = family["mobility"], family["links"]
            expected = family["expected"] if family["complete"] else None
            found.append(Family(f"{mobility}-{links}", mobility, links, rows[0]["joints"], expected, tuple(rows)))
    return found


def _check_key(row: sqlite3.Row, family: sqlite3.Row) -> None:
    """Compare a key, which is the chain itself, with its row: links, joints, assortment, so that label and sketch fit.

    Raises `ValueError` if they are not.
    """
    links, joints, frame, space = decode_key(row["key"])
    degrees = Counter(Counter(link for a, b, _ in joints for link in (a, b)).values())
    assortment = "-".join(str(degrees[n]) for n in range(2, max(degrees, default=1) + 1))
    own = links, len(joints), assortment, row["links"], row["mobility"]
    wanted = row["links"], row["joints"], row["assortment"], family["links"], family["mobility"]
    if own != wanted or sum(degrees.values()) != links or degrees[1] or frame is not None or space != 3:
        raise ValueError(f"the key {row['key']} is not of a chain as its row says")


def _rows(connection: sqlite3.Connection, query: str, parameters: tuple[Any, ...] = ()) -> list[sqlite3.Row]:
    """Return rows with names, without changing the connection for others."""
    cursor = connection.cursor()
    cursor.row_factory = sqlite3.Row
    return cursor.execute(query, parameters).fetchall()


def script(call: str, *arguments: Any) -> str:
    """Write a script that hands data to the page."""
    texts = (json.dumps(value, separators=(",", ":"), ensure_ascii=False, allow_nan=False) for value in arguments)
    return f"Atlas.{call}({','.join(texts)});\n"


def family_script(family: Family) -> str:
    """Write what browsing needs: columns over the chains of a family.

    Keys of one family have one length and are joined without a separator; the label follows from the place: the k-th
    chain of an assortment has rank k.
    """
    rows = family.rows
    runs = [[kind, len(list(own))] for kind, own in groupby(row["assortment"] for row in rows)]
    ranks = [_rank(row) for row in rows]
    data = {
        "keys": "".join(row["key"] for row in rows),
        "assortments": runs,
        "ranks": None if ranks == [rank for _, count in runs for rank in range(1, count + 1)] else ranks,
        "symmetry": [row["automorphisms"] for row in rows],
        "inversions": [row["inversions"] for row in rows],
        "girth": "".join(_digit(row["girth"]) for row in rows),
        "planar": "".join(str(row["planar"]) for row in rows),
        "fractionated": "".join(str(row["fractionated"]) for row in rows),
        "low": "".join(_digit(row["low"] or 0) for row in rows),
        "high": "".join(_digit(row["high"] or 0) for row in rows),
        "contracted": [row["contracted_id"] for row in rows],
    }
    return script("take", family.name, data)


def _digit(value: int) -> str:
    """Write a small number as one character, base 36."""
    return "0123456789abcdefghijklmnopqrstuvwxyz"[min(value, 35)]


def relatives_script(
    connection: sqlite3.Connection,
    family: Family,
    places: dict[str, tuple[str, int]],
    stored: dict[int, tuple[int, list[int], str]],
) -> str:
    """Write parents and children of each chain, what was evaluated, and mechanisms that the catalogue holds.

    Relatives are places in the families of two links fewer and more, or keys.
    """
    smaller, larger = (f"{family.mobility}-{family.links + step}" for step in (-2, 2))

    def short(key: str, name: str) -> int | str:
        held, place = places.get(key, ("", 0))
        return place if held == name else key

    def listed(query: str, value: Any, name: str) -> list[int | str]:
        found = [short(row[0], name) for row in connection.execute(query, (value,))]
        return sorted(found, key=lambda one: (isinstance(one, str), one))

    upwards = "SELECT parent_key FROM dyads WHERE chain_id = ?"
    downwards = "SELECT key FROM dyads JOIN chains USING (chain_id) WHERE parent_key = ?"
    parents = [listed(upwards, row["chain_id"], smaller) for row in family.rows]
    children = [listed(downwards, row["key"], larger) for row in family.rows]
    query = """SELECT frame, driver, kind, status, value, unit, guarantee FROM evaluations WHERE chain_id = ?
               ORDER BY frame, driver, kind"""
    evaluations: dict[int, list[list[Any]]] = {}  # by place
    for k, row in enumerate(family.rows):
        for frame, driver, *rest in connection.execute(query, (row["chain_id"],)):
            evaluations.setdefault(k, []).append([frame, str(driver), *rest])
    held = {k: stored[row["chain_id"]] for k, row in enumerate(family.rows) if row["chain_id"] in stored}
    more = {"evaluations": evaluations, "mechanisms": held}
    return script("takeRelatives", family.name, {"parents": parents, "children": children, **more})


def groups_script(connection: sqlite3.Connection) -> str:
    """Write the class and the assembly modes of every structural group by its key."""
    rows = connection.execute('SELECT key, class, modes FROM groups ORDER BY links, "order", key')
    return script("takeGroups", {key: facts for key, *facts in rows})


def contents(connection: sqlite3.Connection, found: list[Family], **more: Any) -> str:
    """Write the table of contents: the families with their counts, contracted graphs, and what else is given."""
    shown = ("name", "mobility", "links", "joints", "expected")
    listed = [{name: getattr(own, name) for name in shown} | {"chains": len(own.rows)} for own in found]
    contracted = dict(connection.execute("SELECT contracted_id, edges FROM contracted").fetchall())
    return script("open", {"families": listed, "contracted": contracted, **more})


#: Chains in one file of sketches: about 70 kB for twelve links.
PER_FILE = 1024

_CHUNK = 64

_DIGITS = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789-_"

_MOST = 4095


def places_of(keys: Sequence[str]) -> list[str]:
    """Return the places of the joints of chains: for each joint x and y, two digits of base 64 each.

    The larger side of the drawing is 4095 units; y is upwards.

    >>> [len(places) for places in places_of(["1BAN4", "1BgMw8g"])]  # four digits a joint
    [16, 28]
    """
    import numpy as np

    from graphsynth.kinematics.dimensional.sketch import layout
    from graphsynth.structure.graph import MechanismGraph

    found = []
    for key in keys:
        positions = layout(MechanismGraph.from_key(key)).positions
        moved = positions - positions.min(axis=0)
        units = np.rint(moved * (_MOST / max(float(moved.max()), 1e-9))).astype(int)
        found.append("".join(_DIGITS[value >> 6] + _DIGITS[value & 63] for value in units.ravel().tolist()))
    return found


def sketch_scripts(family: Family, executor: Executor | None) -> Iterator[tuple[str, str, int]]:
    """Yield the files of sketches of a family as (name, script, chains in it)."""
    from graphsynth.core.ordered import in_order

    keys = [row["key"] for row in family.rows]
    chunks = [keys[k : k + _CHUNK] for k in range(0, len(keys), _CHUNK)]
    held: list[str] = []
    done = 0
    for places in in_order(executor, places_of, chunks):
        held += places
        done += len(places)
        if len(held) == PER_FILE or done == len(keys):
            number = (done - 1) // PER_FILE
            text = script("takeSketches", family.name, number, "".join(held))
            yield f"sketches-{family.name}-{number}.js", text, len(held)
            held = []
