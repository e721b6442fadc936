"""Merging the shards of a catalogue: every piece once, written in order as the builder would."""

from __future__ import annotations

import sqlite3
from collections import OrderedDict
from collections.abc import Iterator
from contextlib import closing
from dataclasses import dataclass, field
from pathlib import Path

from graphsynth.atlas.building import build_family, finish_family, open_family, transaction
from graphsynth.atlas.facts import GroupRow, Rows
from graphsynth.atlas.making import expected_of, problem_of
from graphsynth.atlas.schema import GARBAGE, connect, readable, screen, settle
from graphsynth.atlas.sealing import broken_seal
from graphsynth.atlas.statement import PUBLISHED
from graphsynth.core.errors import FormatError, GraphsynthError, SpecError

#: Shards open at a time: a process may open some hundred files, a build may have thousands of shards.
_OPEN = 64


def merge(path: Path, parts: list[Path]) -> None:
    """Make one catalogue of shards; see :meth:`graphsynth.atlas.catalogue.Catalogue.merge`."""
    if not parts:
        raise SpecError("no shards given; name the files built with --shard i/m")
    if path.resolve() in {part.resolve() for part in parts}:
        raise SpecError(f"{path} is one of the shards; name a new file")
    # everything is checked before the file is made
    plans = _plans(parts)
    with closing(_Shards()) as shards, closing(connect(path, create=True)) as target:
        try:
            for plan in plans:
                _merge_family(target, plan, shards)
            for part in parts:
                with readable(part), transaction(target):
                    select = (
                        "SELECT frame, driver, kind, status, value, unit, guarantee, data, key FROM evaluations "
                        "JOIN chains USING (chain_id)"
                    )
                    insert = "SELECT chain_id, ?, ?, ?, ?, ?, ?, ?, ? FROM chains WHERE key = ?"
                    found = shards.open(part).execute(select)
                    target.executemany(f"INSERT OR REPLACE INTO evaluations {insert}", found)
        finally:
            settle(target)


class _Shards:
    """Connections to shards, those used last kept open."""

    def __init__(self) -> None:
        self._open: OrderedDict[Path, sqlite3.Connection] = OrderedDict()

    def open(self, part: Path) -> sqlite3.Connection:
        """Return the connection to a shard; it may be closed when others are opened."""
        if part not in self._open:
            if len(self._open) >= _OPEN:
                self._open.popitem(last=False)[1].close()
            self._open[part] = connect(part, readonly=True)
        self._open.move_to_end(part)
        return self._open[part]

    def close(self) -> None:
        """Close all of them."""
        while self._open:
            self._open.popitem()[1].close()


@dataclass(slots=True)
class _Plan:
    """A family: the shards given, the cuts they were made by, and where each piece is: shard, first chain, chains."""

    question: tuple[int, int, int]
    given: set[str] = field(default_factory=set)
    cuts: dict[tuple[int, str], Path] = field(default_factory=dict)
    where: dict[int, tuple[Path, int, int]] = field(default_factory=dict)


def _plans(parts: list[Path]) -> list[_Plan]:
    """Find every piece of every family, one shard after the other.

    Raises `GraphsynthError` if a piece is missing or twice there, or the shards are of different cuts.
    """
    plans: dict[tuple[int, int, int], _Plan] = {}
    for part in parts:
        with closing(connect(part, readonly=True)) as shard, readable(part, *GARBAGE):
            _trust(shard, part)
            for number, mobility, links, fractionated, pieces, cut, name in shard.execute(
                "SELECT family_id, mobility, links, fractionated, pieces, cut, shard FROM families"
            ).fetchall():
                key = mobility, links, fractionated
                plan = plans.setdefault(key, _Plan(key))
                plan.given.add(name)
                plan.cuts.setdefault((pieces, cut), part)
                select = "SELECT piece, first_chain, chains FROM pieces WHERE family_id = ?"
                for piece, first, chains in shard.execute(select, (number,)):
                    if piece in plan.where:
                        raise GraphsynthError(
                            f"{part} and {plan.where[piece][0]} both hold piece {piece} of mobility {mobility}, "
                            f"{links} links: give every shard once"
                        )
                    plan.where[piece] = part, first, chains
    for (mobility, links, _), plan in plans.items():
        if len(plan.cuts) > 1:
            raise GraphsynthError(
                f"{' and '.join(map(str, plan.cuts.values()))} were built by different versions: build all shards with "
                "one"
            )
        ((pieces, _),) = plan.cuts
        missing = [piece for piece in range(pieces) if piece not in plan.where]
        if missing:
            raise GraphsynthError(
                f"{len(missing)} of {pieces} pieces of mobility {mobility}, {links} links are in none of the files "
                f"(given: {', '.join(sorted(plan.given))}; first missing piece {missing[0]}): finish or add the shard "
                "that holds them"
            )
    return [plans[key] for key in sorted(plans)]


def _trust(shard: sqlite3.Connection, part: Path) -> None:
    """Refuse a shard that was not copied whole, or changed: what is merged gets a new seal."""
    found = broken_seal(shard)
    if found:
        raise FormatError(f"{found}: copy the shard again, or give the command that built it again", str(part))
    screen(shard, part)
    loose = shard.execute("PRAGMA foreign_key_check").fetchone()
    if loose:
        raise FormatError(
            f"a row of its table {loose[0]} names one of {loose[2]} that is not there: build it anew", str(part)
        )


def _merge_family(target: sqlite3.Connection, plan: _Plan, shards: _Shards) -> None:
    """Write the pieces of a family in their order; count it, once for all shards."""
    mobility, links, fractionated = plan.question
    held = sum(chains for _, _, chains in plan.where.values())
    published = PUBLISHED.get((mobility, links))
    if published and held != published[fractionated]:  # counting may take a minute
        raise GraphsynthError(
            f"the shards hold {held} chains of mobility {mobility} with {links} links, there are "
            f"{published[fractionated]}: build them anew"
        )
    expected = expected_of(problem_of(links, mobility, bool(fractionated)), None)
    if not expected:
        return
    ((pieces, cut),) = plan.cuts
    family_id, complete = open_family(target, plan.question, (pieces, cut, "1/1", expected))
    if complete:
        return

    def results(places: list[int]) -> Iterator[Rows]:
        for piece in places:
            part, first, chains = plan.where[piece]
            with readable(part, *GARBAGE):
                rows = _read(shards.open(part), first, chains)
            yield rows

    build_family(target, family_id, mobility, [(piece, 1.0) for piece in range(pieces)], results)
    finish_family(target, family_id)


def _read(shard: sqlite3.Connection, first: int, count: int) -> Rows:
    """Read a piece back as it was before it was numbered."""
    rows, last = Rows(), first + count - 1
    contracted: dict[int, int] = {}
    for *chain, number in shard.execute(
        "SELECT key, graph6, links, joints, loops, assortment, automorphisms, link_orbits, inversions, girth, "
        "fractionated, mobility_type, contracted_id FROM chains WHERE chain_id BETWEEN ? AND ? ORDER BY chain_id",
        (first, last),
    ):
        if number not in contracted:
            select = "SELECT vertices, edges FROM contracted WHERE contracted_id = ?"
            shape = shard.execute(select, (number,)).fetchone()
            contracted[number] = rows.contracted.setdefault(shape, len(rows.contracted))
        rows.chains.append((*chain, contracted[number]))
    span = first, first, last
    rows.dyads = shard.execute(
        "SELECT chain_id - ?, parent_key FROM dyads WHERE chain_id BETWEEN ? AND ?", span
    ).fetchall()
    rows.inversions = shard.execute(
        "SELECT chain_id - ?, frame, frame_joints, levels, degree, genus, degrees, genera FROM inversions "
        "WHERE chain_id BETWEEN ? AND ?",
        span,
    ).fetchall()
    structures: dict[str, int] = {}
    groups: dict[str, int] = {}
    for chain, frame, driver, text in shard.execute(
        "SELECT chain_id - ?, frame, driver, groups FROM driven JOIN structures USING (structure_id) "
        "WHERE chain_id BETWEEN ? AND ? ORDER BY chain_id, frame, driver",
        span,
    ):
        if text not in structures:
            for group in text.split():
                if group not in groups:
                    select = 'SELECT key, links, "order", class, modes FROM groups WHERE group_id = ?'
                    row = GroupRow(*shard.execute(select, (int(group),)).fetchone())
                    groups[group] = rows.groups.setdefault(row, len(rows.groups))
            structure = tuple(groups[group] for group in text.split())
            structures[text] = rows.structures.setdefault(structure, len(rows.structures))
        rows.mechanisms.append((chain, frame, driver, structures[text]))
    return rows
