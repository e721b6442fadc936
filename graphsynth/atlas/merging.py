"""Merging the shards of a catalogue: every piece once, written in order as the builder would."""

from __future__ import annotations

import sqlite3
from collections.abc import Iterator
from contextlib import ExitStack, closing
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from graphsynth.atlas.building import build_family, finish_family, open_family, transaction
from graphsynth.atlas.facts import GroupRow, Rows
from graphsynth.atlas.making import expected_of
from graphsynth.atlas.pieces import problem_of
from graphsynth.atlas.schema import connect, readable, settle
from graphsynth.errors import GraphsynthError, SpecError

__all__ = ["merge"]


def merge(path: Path, parts: list[Path]) -> None:
    """Make one catalogue of shards; see :meth:`graphsynth.atlas.catalogue.Catalogue.merge`."""
    if not parts:
        raise SpecError("no shards given; name the files built with --shard i/m")
    if path.resolve() in {part.resolve() for part in parts}:
        raise SpecError(f"{path} is one of the shards; name a new file")
    with ExitStack() as stack:
        shards = [stack.enter_context(closing(connect(part, readonly=True))) for part in parts]
        names = dict(zip(shards, parts))
        # everything is checked before the file is made
        plans = [_plan(question, names) for question in _families(shards)]
        target = stack.enter_context(closing(connect(path, create=True)))
        for plan in plans:
            _merge_family(target, plan, names)
        for shard in shards:
            _copy_evaluations(shard, target)
        settle(target)


@dataclass(frozen=True, slots=True)
class _Plan:
    """A family: its pieces and the fingerprint of their cut; where each piece is: shard, first chain, chains."""

    question: tuple[int, int, int]
    pieces: int
    cut: str
    where: dict[int, tuple[sqlite3.Connection, int, int]]


def _families(shards: list[sqlite3.Connection]) -> list[tuple[int, int, int]]:
    select = "SELECT mobility, links, fractionated FROM families"
    return sorted({row for shard in shards for row in shard.execute(select)})


def _plan(question: tuple[int, int, int], names: dict[sqlite3.Connection, Path]) -> _Plan:
    """Find every piece of a family.

    Raises
    ------
    GraphsynthError
        If a piece is missing or twice there, or the shards are of different cuts.
    """
    mobility, links, _ = question
    where: dict[int, tuple[sqlite3.Connection, int, int]] = {}
    cuts: dict[tuple[int, str], Path] = {}
    for shard, name in names.items():
        row = shard.execute(
            "SELECT family_id, pieces, cut FROM families WHERE (mobility, links, fractionated) = (?, ?, ?)", question
        ).fetchone()
        if row is None:
            continue
        cuts.setdefault(row[1:], name)
        for piece, first, chains in shard.execute(
            "SELECT piece, first_chain, chains FROM pieces WHERE family_id = ?", row[:1]
        ):
            if piece in where:
                raise GraphsynthError(
                    f"{name} and {names[where[piece][0]]} both hold piece {piece} of mobility {mobility}, {links} "
                    "links: give every shard once"
                )
            where[piece] = shard, first, chains
    if len(cuts) > 1:
        raise GraphsynthError(
            f"{' and '.join(map(str, cuts.values()))} were built by different versions: build all shards with one"
        )
    pieces, cut = next(iter(cuts))
    _check_all_there(question, pieces, where, names)
    return _Plan(question, pieces, cut, where)


def _merge_family(target: sqlite3.Connection, plan: _Plan, names: dict[sqlite3.Connection, Path]) -> None:
    """Write the pieces of a family in their order; count it, once for all shards."""
    mobility, links, fractionated = plan.question
    expected = expected_of(problem_of(links, mobility, bool(fractionated)), None)
    if not expected:
        return
    family_id, complete = open_family(target, plan.question, (plan.pieces, plan.cut, "1/1", expected))
    if complete:
        return

    def results(places: list[int]) -> Iterator[Rows]:
        for piece in places:
            with readable(names[plan.where[piece][0]], TypeError, ValueError, LookupError):
                rows = _read(*plan.where[piece])
            yield rows

    build_family(target, family_id, mobility, [(piece, 1.0) for piece in range(plan.pieces)], results)
    finish_family(target, family_id)


def _copy_evaluations(shard: sqlite3.Connection, target: sqlite3.Connection) -> None:
    """Take over what was evaluated of the mechanisms of a shard."""
    with transaction(target):
        target.executemany(
            "INSERT OR REPLACE INTO evaluations SELECT chain_id, ?, ?, ?, ?, ?, ?, ?, ? FROM chains WHERE key = ?",
            shard.execute(
                "SELECT frame, driver, kind, status, value, unit, guarantee, data, key FROM evaluations "
                "JOIN chains USING (chain_id)"
            ),
        )


def _check_all_there(
    question: tuple[int, int, int],
    pieces: int,
    where: dict[int, tuple[sqlite3.Connection, int, int]],
    names: dict[sqlite3.Connection, Path],
) -> None:
    missing = [piece for piece in range(pieces) if piece not in where]
    if not missing:
        return
    select = "SELECT shard FROM families WHERE (mobility, links, fractionated) = (?, ?, ?)"
    given = ", ".join(sorted({row[0] for shard in names for row in shard.execute(select, question)}))
    raise GraphsynthError(
        f"{len(missing)} of {pieces} pieces of mobility {question[0]}, {question[1]} links are in none of the files "
        f"(given: {given}; first missing piece {missing[0]}): finish or add the shard that holds them"
    )


def _read(shard: sqlite3.Connection, first: int, count: int) -> Rows:
    """Read a piece back as it was before it was numbered."""
    rows, last = Rows(), first + count - 1
    contracted: dict[int, int] = {}
    for *chain, number in shard.execute(
        "SELECT key, graph6, links, joints, loops, assortment, automorphisms, link_orbits, inversions, girth, "
        "fractionated, contracted_id FROM chains WHERE chain_id BETWEEN ? AND ? ORDER BY chain_id",
        (first, last),
    ):
        if number not in contracted:
            contracted[number] = len(contracted)
            select = "SELECT vertices, edges FROM contracted WHERE contracted_id = ?"
            rows.contracted.append(shard.execute(select, (number,)).fetchone())
        rows.chains.append((*chain, contracted[number]))
    span = first, first, last
    rows.dyads = shard.execute(
        "SELECT chain_id - ?, parent_key FROM dyads WHERE chain_id BETWEEN ? AND ?", span
    ).fetchall()
    rows.inversions = shard.execute(
        "SELECT chain_id - ?, frame, frame_joints, levels FROM inversions WHERE chain_id BETWEEN ? AND ?", span
    ).fetchall()
    structures: dict[int, int] = {}
    groups: dict[int, int] = {}
    for chain, frame, driver, number in shard.execute(
        "SELECT chain_id - ?, frame, driver, structure_id FROM driven WHERE chain_id BETWEEN ? AND ?", span
    ):
        if number not in structures:
            structures[number] = len(structures)
            rows.structures.append(_structure(shard, number, groups, rows))
        rows.mechanisms.append((chain, frame, driver, structures[number]))
    return rows


def _structure(shard: sqlite3.Connection, number: int, known: dict[int, int], rows: Rows) -> tuple[int, ...]:
    text: str = shard.execute("SELECT groups FROM structures WHERE structure_id = ?", (number,)).fetchone()[0]
    found = []
    for group in map(int, text.split()):
        if group not in known:
            known[group] = len(known)
            values: tuple[Any, ...] = shard.execute(
                'SELECT key, links, "order", class FROM groups WHERE group_id = ?', (group,)
            ).fetchone()
            rows.groups.append(GroupRow(*values))
        found.append(known[group])
    return tuple(found)
