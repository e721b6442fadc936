"""Making a catalogue file: families cut into pieces that depend on the question alone, shared out, the file settled."""

from __future__ import annotations

import sqlite3
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import Executor
from contextlib import AbstractContextManager
from dataclasses import dataclass, replace
from functools import lru_cache
from hashlib import sha256
from math import ceil
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from graphsynth.atlas.building import BuildStep, build_family, finish_family, open_family
from graphsynth.atlas.facts import Rows, analyse_block, rows_of
from graphsynth.atlas.schema import connect, settle
from graphsynth.core.errors import SpecError, TooLargeError
from graphsynth.synthesis.chunks import Chunk, estimates

if TYPE_CHECKING:
    from graphsynth.atlas.kernels.facts import Block
    from graphsynth.synthesis.problem import EnumerationProblem, WorkItem

Watch = Callable[[BuildStep], None]

#: What the kernels are laid out for, see :mod:`graphsynth.atlas.kernels.facts`.
MOST_LINKS = 18


def make(
    path: Path,
    links: Iterable[int],
    mobility: int,
    fractionated: bool,
    executor: Executor | None,
    shard: tuple[int, int] | None,
    watch: Watch | None,
) -> None:
    """Build or continue a catalogue; see :meth:`graphsynth.atlas.catalogue.Catalogue.build`."""
    wanted = sorted(set(links))
    if not wanted:
        raise SpecError("no number of links given; name at least one, for example links=range(4, 11)")
    if wanted[-1] > MOST_LINKS:
        raise TooLargeError(
            f"a catalogue holds chains of at most {MOST_LINKS} links, not {wanted[-1]}: count or list them instead"
        )
    connection = connect(path, create=True)
    try:
        for count in wanted:
            _family(connection, mobility, count, fractionated and mobility > 1, executor, shard, watch)
    finally:
        settle(connection)
        connection.close()


def _family(
    connection: sqlite3.Connection,
    mobility: int,
    links: int,
    fractionated: bool,
    executor: Executor | None,
    shard: tuple[int, int] | None,
    watch: Watch | None,
) -> None:
    """Make or continue one family; nothing happens for numbers without any chain."""
    from graphsynth.core.ordered import in_order

    problem, whole = problem_of(links, mobility, fractionated), tasks_of(links, mobility, fractionated)
    # a shard is not counted: for 18 links that would take a fifth of its time; the merge counts once for all
    expected = None if shard else expected_of(problem, executor)
    if expected == 0 or not whole:
        return
    tasks = share_of(whole, shard)
    row = len(whole), fingerprint(problem, whole), f"{shard[0]}/{shard[1]}" if shard else "1/1", expected
    family_id, complete = open_family(connection, (mobility, links, int(fractionated)), row)
    if complete:
        return

    def told(chains: int, done: float) -> None:
        if watch:
            watch(BuildStep(mobility, links, chains, done))

    def results(places: list[int]) -> Iterator[Rows]:
        return in_order(executor, rows_of_task, [tasks[at] for at in places])

    pieces = [(task.number, task.piece.weight) for task in tasks]
    build_family(connection, family_id, mobility, pieces, results, told)
    if not shard:
        finish_family(connection, family_id)


def expected_of(problem: EnumerationProblem, executor: Executor | None) -> int:
    """Count the chains of a family without listing them."""
    from graphsynth.synthesis.problem import counted

    return counted(problem, executor)


def processes(workers: int) -> AbstractContextManager[Executor | None]:
    """Give a pool of worker processes, or None for one; the kernels are compiled here first, once for all."""
    from graphsynth.core import ordered

    return ordered.processes(workers, _compile_kernels)


def _compile_kernels() -> None:
    for task in tasks_of(6, 1, False):
        rows_of_task(task)
    for piece in problem_of(6, 1, False).work_items(listing=False):
        piece.count()


#: Bound on the labellings of a piece; about a quarter of them are chains.  A piece takes a second at most.
PIECE = 8000.0

#: A family of very many chains is cut into so many pieces, of more work each.
MOST_PIECES = 100_000

_CHAINS_AT_ONCE = 1024
_bounds = lru_cache(maxsize=2)(estimates)  # once for all pieces of a family


@dataclass(frozen=True, slots=True)
class Task:
    """One piece of a family: its number, and what to list."""

    number: int
    links: int
    mobility: int
    piece: WorkItem  # its weight bounds the work


def problem_of(links: int, mobility: int, fractionated: bool) -> EnumerationProblem:
    """State the enumeration of a family.

    Raises `SpecError, TooLargeError` for numbers out of their bounds.
    """
    from graphsynth.synthesis.problem import EnumerationProblem

    return EnumerationProblem.chains(links, mobility, 3, None, fractionated, None)


def tasks_of(links: int, mobility: int, fractionated: bool) -> list[Task]:
    """Cut a family; the cut depends on the family alone."""
    whole = problem_of(links, mobility, fractionated).work_items(listing=True)
    size = max(PIECE, sum(piece.weight for piece in whole) / MOST_PIECES)
    pieces = [part for piece in whole for part in _finer(piece, size)]
    return [Task(number, links, mobility, piece) for number, piece in enumerate(pieces)]


def _finer(piece: WorkItem, size: float) -> Iterator[WorkItem]:
    """Cut a piece of many contracted graphs at their bounds, and that of a single one by its search prefixes."""
    if not isinstance(piece, Chunk) or piece.weight <= size:
        yield piece
        return
    if piece.stop - piece.start == 1:
        yield from _parts(piece, size)
        return
    bounds = _bounds(piece.family)[piece.start : piece.stop]  # on the chains of each contracted graph
    at = 0
    while at < len(bounds):
        sums = np.cumsum(bounds[at:])
        count = min(int(np.searchsorted(sums, size)) + 1, len(sums))
        count -= count > 1 and bool(bounds[at + count - 1] > size)  # a big one alone
        part = replace(piece, start=piece.start + at, stop=piece.start + at + count, weight=float(sums[count - 1]))
        yield from _parts(part, size) if count == 1 else (part,)
        at += count


def _parts(piece: Chunk, size: float) -> Iterator[Chunk]:
    """Cut a single contracted graph that is far too big: part p of P becomes p, p + P, ... of a multiple of P."""
    times = ceil(piece.weight / size / 2) if piece.weight > 4 * size else 1
    for k in range(times):
        part = piece.part + piece.parts * k
        yield replace(piece, part=part, parts=piece.parts * times, weight=piece.weight / times)


def fingerprint(problem: EnumerationProblem, tasks: list[Task]) -> str:
    """Short text that differs when the question or its cut differ: pieces of two cuts are never mixed."""
    return sha256(f"{problem.signature} {len(tasks)} {[task.piece.weight for task in tasks]}".encode()).hexdigest()[:16]


def share_of(tasks: list[Task], shard: tuple[int, int] | None) -> list[Task]:
    """Return the tasks of shard i of m, a run of consecutive ones.

    Raises `SpecError` for i out of 1..m.
    """
    from graphsynth.synthesis import shards

    own = shards.share_of([task.piece for task in tasks], shard)
    return tasks[own.start : own.stop]


def blocks_of(task: Task) -> Iterator[Block]:
    """Yield the facts of all chains of a piece (computed in the worker)."""
    if isinstance(task.piece, Chunk):
        blocks = task.piece.packed()
    else:
        graphs = [graph.packed for graph in task.piece.graphs()]
        blocks = iter([np.frombuffer(b"".join(graphs), np.uint8).reshape(len(graphs), -1)] if graphs else [])
    for packed in blocks:
        for at in range(0, len(packed), _CHAINS_AT_ONCE):
            yield analyse_block(task.links, task.mobility, packed[at : at + _CHAINS_AT_ONCE])


def rows_of_task(task: Task) -> Rows:
    """Return the rows of all chains of a piece (computed in the worker)."""
    rows = Rows()
    for block in blocks_of(task):
        rows_of(block, rows)
    return rows
