"""One entry of a catalogue: a chain with its relatives, inversions, mechanisms and their evaluations."""

from __future__ import annotations

import sqlite3
from typing import Any

from graphsynth.atlas.evaluations import KINDS, NOT_COMPUTED
from graphsynth.atlas.stored import data_of


def entry(connection: sqlite3.Connection, chain: dict[str, Any]) -> dict[str, Any]:
    """Return everything known of a chain, ready for JSON; see :meth:`graphsynth.atlas.catalogue.Catalogue.entry`."""
    number, key = chain["chain_id"], chain["key"]
    shape = connection.execute(
        "SELECT vertices, edges FROM contracted WHERE contracted_id = ?", (chain["contracted_id"],)
    ).fetchone()
    inside = {"chain_id", "family_id", "contracted_id"}
    found: dict[str, Any] = {name: value for name, value in chain.items() if name not in inside}
    found |= {"planar": bool(chain["planar"]), "fractionated": bool(chain["fractionated"])}
    found["contracted"] = {"vertices": shape[0], "edges": shape[1]}
    found["parents"] = _column(
        connection, "SELECT parent_key FROM dyads WHERE chain_id = ? ORDER BY parent_key", number
    )
    found["children"] = _column(
        connection,
        "SELECT c.key FROM dyads d JOIN chains c USING (chain_id) WHERE d.parent_key = ? ORDER BY c.links, c.key",
        key,
    )
    found["inversions"] = [
        {"frame": frame, "frame_joints": joints, "levels": levels}
        for frame, joints, levels in connection.execute(
            "SELECT frame, frame_joints, levels FROM inversions WHERE chain_id = ? ORDER BY frame", (number,)
        )
    ]
    found["mechanisms"] = _mechanisms(connection, number)
    return found


def _column(connection: sqlite3.Connection, select: str, value: Any) -> list[Any]:
    return [row[0] for row in connection.execute(select, (value,))]


def _mechanisms(connection: sqlite3.Connection, number: int) -> list[dict[str, Any]]:
    evaluated: dict[tuple[int, int | str], dict[str, Any]] = {}
    for frame, driver, kind, status, value, unit, guarantee, data in connection.execute(
        "SELECT frame, driver, kind, status, value, unit, guarantee, data FROM evaluations WHERE chain_id = ?",
        (number,),
    ):
        evaluated.setdefault((frame, driver), {})[kind] = {
            "status": status, "value": value, "unit": unit, "guarantee": guarantee,
            "data": None if data is None else data_of(data),
        }  # fmt: skip
    found = []
    for frame, driver, own_class, order, groups, levels in connection.execute(
        'SELECT frame, driver, class, "order", groups, levels FROM mechanisms WHERE chain_id = ? '
        "ORDER BY frame, driver",
        (number,),
    ).fetchall():
        found.append(
            {
                "frame": frame, "driver": driver, "class": own_class, "order": order, "levels": levels,
                "groups": [_group(connection, int(group)) for group in groups.split()],
                "evaluations": dict.fromkeys(KINDS, NOT_COMPUTED) | evaluated.get((frame, driver), {}),
            }
        )  # fmt: skip
    return found


def _group(connection: sqlite3.Connection, number: int) -> dict[str, Any]:
    cursor = connection.execute('SELECT key, links, "order", class FROM groups WHERE group_id = ?', (number,))
    return dict(zip(("key", "links", "order", "class"), cursor.fetchone()))
