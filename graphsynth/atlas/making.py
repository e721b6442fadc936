"""Making a catalogue file: families one after the other, work shared out, the file settled at the end."""

from __future__ import annotations

import sqlite3
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import Executor
from contextlib import AbstractContextManager
from pathlib import Path
from typing import TYPE_CHECKING

from graphsynth.atlas.building import BuildStep, build_family, finish_family, open_family
from graphsynth.atlas.schema import connect, settle
from graphsynth.core.errors import SpecError, TooLargeError

if TYPE_CHECKING:
    from graphsynth.atlas.facts import Rows
    from graphsynth.synthesis.problem import Problem

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
    from graphsynth.atlas.pieces import fingerprint, problem_of, rows_of_task, share_of, tasks_of
    from graphsynth.core.ordered import in_order

    problem, whole = problem_of(links, mobility, fractionated), tasks_of(links, mobility, fractionated)
    # a shard is not counted: for 18 links that would take a fifth of its time; the merge counts once for all
    expected = None if shard else expected_of(problem, executor)
    if expected == 0 or not whole:
        return
    tasks = share_of(whole, shard)
    part = f"{shard[0]}/{shard[1]}" if shard else "1/1"
    question = mobility, links, int(fractionated)
    family_id, complete = open_family(connection, question, (len(whole), fingerprint(problem, whole), part, expected))
    if complete:
        return

    def told(chains: int, done: float) -> None:
        if watch:
            watch(BuildStep(mobility, links, chains, done))

    def results(places: list[int]) -> Iterator[Rows]:
        return in_order(executor, rows_of_task, [tasks[at] for at in places])

    build_family(connection, family_id, mobility, [(task.number, task.weight) for task in tasks], results, told)
    if not shard:
        finish_family(connection, family_id)


def expected_of(problem: Problem, executor: Executor | None) -> int:
    """Count the chains of a family without listing them."""
    from graphsynth.synthesis.problem import counts

    return sum(counts(problem.work_items(listing=False), executor))


def processes(workers: int) -> AbstractContextManager[Executor | None]:
    """Give a pool of worker processes, or None for one; the kernels are compiled here first, once for all."""
    from graphsynth.core import ordered

    return ordered.processes(workers, _compile_kernels)


def _compile_kernels() -> None:
    from graphsynth.atlas.pieces import problem_of, rows_of_task, tasks_of

    for task in tasks_of(6, 1, False):
        rows_of_task(task)
    for piece in problem_of(6, 1, False).work_items(listing=False):
        piece.count()
