"""Dimensions stored in a catalogue: the one place that reads them, and what ties other results to them.

A transmission angle or a verdict on jamming belongs to one set of dimensions.  Such a row names them by `fingerprint`
in its data, and goes when they are replaced.
"""

from __future__ import annotations

import json
import sqlite3
from collections.abc import Iterator
from dataclasses import dataclass
from hashlib import sha256
from typing import Any

#: Kinds that every entry lists, computed or not; others may be stored too.
KINDS = ("dimensions", "transmission", "jamming")
NOT_COMPUTED = "not computed"
#: Kinds of evaluations that hold for one set of dimensions only.
TIED = ("transmission", "jamming")

_DEEPEST = 100


@dataclass(frozen=True, slots=True)
class StoredMechanism:
    """A mechanism with its dimensions, as a catalogue holds it."""

    chain_id: int  # number of the chain in the file
    frame: int
    driver: int | str  # as in the table of mechanisms
    text: str  # What :meth:`graphsynth.Mechanism.from_json` reads


def data_of(text: str) -> Any:
    """Return the data of an evaluation, as :func:`json.loads` does.

    Raises `ValueError` if the text is not JSON, or lists and objects lie more than a hundred deep in one another:
    whoever writes such data out again would run out of stack.
    """
    try:
        data = json.loads(text)
    except RecursionError:
        raise ValueError("its data are too deep") from None
    level, depth = [data] if isinstance(data, dict | list) else [], 0
    while level:
        depth += 1
        if depth > _DEEPEST:
            raise ValueError(f"its data are more than {_DEEPEST} lists and objects deep")
        inside = (own for one in level for own in (one.values() if isinstance(one, dict) else one))
        level = [own for own in inside if isinstance(own, dict | list)]
    return data


def mechanism_in(data: Any) -> dict[str, Any] | None:
    """Return the mechanism in the data of an evaluation of kind ``'dimensions'``; None where there is none."""
    mechanism = data.get("mechanism") if isinstance(data, dict) else None
    return mechanism if isinstance(mechanism, dict) else None


def fingerprint(mechanism: dict[str, Any]) -> str:
    """Return what names a set of dimensions: 128 bits of SHA-256 over every key and digit.

    ``mechanism`` is as :meth:`graphsynth.Mechanism.to_json` writes it.

    >>> fingerprint({"a": 1.0, "b": 2}) == fingerprint({"b": 2, "a": 1.0}) != fingerprint({"a": 1.5, "b": 2})
    True
    """
    text = json.dumps(mechanism, sort_keys=True, separators=(",", ":"), allow_nan=False)
    return sha256(text.encode()).hexdigest()[:32]


def fingerprint_at(connection: sqlite3.Connection, place: tuple[int, int, int | str]) -> str | None:
    """Return the name of the dimensions stored for (chain, frame, driver); None where there are none to be read."""
    row = connection.execute(
        "SELECT data FROM evaluations WHERE (chain_id, frame, driver, kind) = (?, ?, ?, 'dimensions')", place
    ).fetchone()
    try:
        mechanism = mechanism_in(data_of(row[0])) if row and row[0] else None
    except ValueError:
        return None
    return None if mechanism is None else fingerprint(mechanism)


_SELECT = """
SELECT d.chain_id, d.frame, d.driver, d.data FROM evaluations d LEFT JOIN evaluations t
  ON (t.chain_id, t.frame, t.driver, t.kind) = (d.chain_id, d.frame, d.driver, 'transmission')
WHERE d.kind = 'dimensions' AND d.status = 'found' AND d.data IS NOT NULL AND (? IS NULL OR d.chain_id = ?)
ORDER BY d.chain_id, t.value DESC, d.frame, CAST(d.driver AS TEXT)
"""


def stored_mechanisms(connection: sqlite3.Connection, chain_id: int | None = None) -> Iterator[StoredMechanism]:
    """Yield the mechanisms with stored dimensions, chain by chain, those of the best transmission first.

    ``chain_id``: only those of this chain. Raises `ValueError` if a row is not JSON: the file is damaged.
    """
    for number, frame, driver, data in connection.execute(_SELECT, (chain_id, chain_id)):
        mechanism = mechanism_in(data_of(data))
        if mechanism is not None:
            yield StoredMechanism(number, frame, driver, json.dumps(mechanism))


def entry(connection: sqlite3.Connection, chain: dict[str, Any]) -> dict[str, Any]:
    """Return everything known of a chain, ready for JSON; see :meth:`graphsynth.atlas.catalogue.Catalogue.entry`."""

    def rows(select: str, value: Any = chain["chain_id"]) -> list[dict[str, Any]]:
        cursor = connection.execute(select, (value,))
        names = [column[0] for column in cursor.description]
        return [dict(zip(names, row)) for row in cursor]

    hidden = ("chain_id", "family_id", "contracted_id")
    found: dict[str, Any] = {name: value for name, value in chain.items() if name not in hidden}
    found |= {"planar": bool(chain["planar"]), "fractionated": bool(chain["fractionated"])}
    shape = "SELECT vertices, edges FROM contracted WHERE contracted_id = ?"
    found["contracted"] = rows(shape, chain["contracted_id"])[0]
    parents = rows("SELECT parent_key AS key FROM dyads WHERE chain_id = ? ORDER BY parent_key")
    children = rows(
        "SELECT c.key FROM dyads d JOIN chains c USING (chain_id) WHERE d.parent_key = ? ORDER BY c.links, c.key",
        chain["key"],
    )
    found["parents"], found["children"] = ([row["key"] for row in own] for own in (parents, children))
    found["inversions"] = rows(
        "SELECT frame, frame_joints, levels, degrees, genera FROM inversions WHERE chain_id = ? ORDER BY frame"
    )
    evaluated: dict[tuple[int, int | str], dict[str, Any]] = {}
    for row in rows(
        "SELECT frame, driver, kind, status, value, unit, guarantee, data FROM evaluations WHERE chain_id = ?"
    ):
        place = row.pop("frame"), row.pop("driver")
        row["data"] = None if row["data"] is None else data_of(row["data"])
        evaluated.setdefault(place, {})[row.pop("kind")] = row
    found["mechanisms"] = rows(
        'SELECT frame, driver, class, "order", modes, levels, groups FROM mechanisms WHERE chain_id = ? '
        "ORDER BY frame, driver"
    )
    group = 'SELECT key, links, "order", class, modes FROM groups WHERE group_id = ?'
    for row in found["mechanisms"]:
        row["groups"] = [rows(group, int(own))[0] for own in row["groups"].split()]
        row["evaluations"] = dict.fromkeys(KINDS, NOT_COMPUTED) | evaluated.get((row["frame"], row["driver"]), {})
    return found
