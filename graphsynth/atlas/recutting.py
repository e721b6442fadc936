"""Checking the families of a catalogue: counted anew, cut anew, their pieces made anew."""

from __future__ import annotations

import sqlite3
from collections.abc import Callable
from typing import Any

#: ``same(field, where, stored, recomputed)``
Same = Callable[[str, str, Any, Any], None]


def check_families(connection: sqlite3.Connection, same: Same, remade: bool) -> None:
    """Compare every family with its cut, its count and what is published; if ``remade``, the keys of each piece too."""
    for row in connection.execute(
        "SELECT family_id, mobility, links, fractionated, pieces, cut, shard, expected, complete FROM families"
    ).fetchall():
        _check_family(connection, same, remade, *row)


def _check_family(
    connection: sqlite3.Connection,
    same: Same,
    remade: bool,
    number: int,
    mobility: int,
    links: int,
    fractionated: int,
    pieces: int,
    cut: str,
    shard: str,
    expected: int | None,
    complete: int,
) -> None:
    from graphsynth.atlas.pieces import fingerprint, problem_of, share_of, tasks_of
    from graphsynth.atlas.statement import PUBLISHED
    from graphsynth.synthesis import count_chains

    where = f"family {mobility}.{links}"
    listed, keys = connection.execute(
        "SELECT COUNT(*), COUNT(DISTINCT key) FROM chains WHERE (family_id, mobility, links) = (?, ?, ?)",
        (number, mobility, links),
    ).fetchone()
    same("distinct keys", where, keys, listed)
    of_family = connection.execute("SELECT COUNT(*) FROM chains WHERE family_id = ?", (number,)).fetchone()[0]
    same("chains.family_id", where, of_family, listed)
    if shard == "1/1":
        same("families.complete", where, complete, 1)
        same("chains listed", where, listed, expected)
        known = PUBLISHED.get((mobility, links))
        if known:
            same("published count", where, listed, known[fractionated])
        if listed != (known[fractionated] if known else expected):
            return  # counting and cutting a family that is not there may take minutes
        same("families.expected", where, expected, count_chains(links, mobility, fractionated=bool(fractionated)))
    problem, whole = problem_of(links, mobility, bool(fractionated)), tasks_of(links, mobility, bool(fractionated))
    same("families.cut", where, cut, fingerprint(problem, whole))
    same("families.pieces", where, pieces, len(whole))
    i, m = map(int, shard.split("/"))
    own = {task.number: task for task in (whole if shard == "1/1" else share_of(whole, (i, m)))}
    same("families.shard", where, i <= m, True)
    held = connection.execute(
        "SELECT piece, first_chain, chains FROM pieces WHERE family_id = ? ORDER BY piece", (number,)
    ).fetchall()
    same("pieces.piece", where, [piece for piece, _, _ in held if piece not in own], [])
    if shard == "1/1":
        same("pieces", where, len(held), pieces)
    same("pieces.chains", where, sum(chains for _, _, chains in held), listed)
    _check_places(connection, same, number, where, held)
    if remade:
        for piece, first, chains in held:
            if piece in own:
                _remake(connection, same, f"{where}, piece {piece}", own[piece], first, chains)


def _check_places(
    connection: sqlite3.Connection, same: Same, number: int, where: str, held: list[tuple[int, int, int]]
) -> None:
    """Pieces lie one behind the other, and in each there are as many chains of the family as it says."""
    end = 1
    for piece, first, chains in held:
        place = f"{where}, piece {piece}"
        same("pieces.first_chain", place, first >= end, True)
        end = first + chains
        select = "SELECT COUNT(*) FROM chains WHERE family_id = ? AND chain_id BETWEEN ? AND ?"
        found = connection.execute(select, (number, first, end - 1)).fetchone()[0]
        same("pieces.first_chain", place, found, chains)


def _remake(connection: sqlite3.Connection, same: Same, where: str, task: Any, first: int, chains: int) -> None:
    """Compare the keys of a piece with those made now."""
    from graphsynth.atlas.pieces import rows_of_task

    select = "SELECT key FROM chains WHERE chain_id BETWEEN ? AND ? ORDER BY chain_id"
    stored = [row[0] for row in connection.execute(select, (first, first + chains - 1))]
    same("pieces.piece", where, stored, [chain[0] for chain in rows_of_task(task).chains])
