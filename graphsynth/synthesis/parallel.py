"""Doing pieces anywhere, and giving their results in the order of the pieces."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import Executor, Future
from contextlib import contextmanager
from typing import Any, TypeVar

from graphsynth.structure.graph import MechanismGraph
from graphsynth.synthesis.problem import Piece, Problem, count_piece, graphs_of_piece, text_of_piece

__all__ = ["counts", "graphs", "in_order", "processes", "texts"]

T = TypeVar("T")
AHEAD = 16  # pieces under way or waiting to be read: bounds memory whatever the number of pieces


def in_order(executor: Executor | None, function: Callable[[Piece], T], pieces: Iterable[Piece]) -> Iterator[T]:
    """Yield ``function(piece)`` for each piece, in order, whoever computes it.

    At most ``AHEAD`` pieces are submitted before their results are read, so memory stays bounded.  Without an executor
    the pieces are done here, one by one.
    """
    if executor is None:
        yield from map(function, pieces)
        return
    waiting: deque[Future[T]] = deque()
    try:
        for piece in pieces:
            waiting.append(executor.submit(function, piece))
            if len(waiting) == AHEAD:
                yield waiting.popleft().result()
        while waiting:
            yield waiting.popleft().result()
    finally:
        for future in waiting:
            future.cancel()


def _text(piece: Piece) -> tuple[bytes, int]:
    blocks = list(text_of_piece(piece))
    return b"".join(block for block, _ in blocks), sum(lines for _, lines in blocks)


def _packed(piece: Piece) -> list[MechanismGraph]:
    return list(graphs_of_piece(piece))


def counts(pieces: Iterable[Piece], executor: Executor | None) -> Iterator[int]:
    """Yield the number of graphs of each piece."""
    return in_order(executor, count_piece, pieces)


def texts(pieces: Iterable[Piece], executor: Executor | None) -> Iterator[tuple[bytes, int]]:
    """Yield each piece as (lines of the text form, number of lines)."""
    return in_order(executor, _text, pieces)


def graphs(pieces: Iterable[Piece], executor: Executor | None) -> Iterator[MechanismGraph]:
    """Yield the graphs of all pieces, in order."""
    if executor is None:
        for piece in pieces:
            yield from graphs_of_piece(piece)
        return
    for block in in_order(executor, _packed, pieces):
        yield from block


@contextmanager
def processes(workers: int, prepare: Callable[[], None] | None = None) -> Iterator[Executor | None]:
    """Give a pool of worker processes, or None for one worker (then everything is done in this process).

    The kernels of the enumerator are compiled here first (or `prepare` is called), so that the workers find them in
    the cache.  When the block is left by an
    exception (Ctrl-C), the workers are stopped at once; what was already written stays.
    """
    if workers <= 1:
        yield None
        return
    from concurrent.futures import ProcessPoolExecutor
    from multiprocessing import active_children, get_context

    (prepare or _compile_kernels)()
    pool = ProcessPoolExecutor(workers, mp_context=get_context("spawn"), initializer=_ignore_interrupts)
    try:
        yield pool
    except BaseException:
        pool.shutdown(wait=False, cancel_futures=True)
        for child in active_children():
            child.terminate()
        raise
    finally:
        pool.shutdown(wait=True, cancel_futures=True)


def _compile_kernels() -> None:
    smallest = Problem.chains(6, 1, 3, None, False, None)
    for piece in smallest.pieces(listing=False):
        count_piece(piece)
    for piece in smallest.pieces(listing=True):
        _text(piece)


def _ignore_interrupts(*_: Any) -> None:
    """Leave Ctrl-C to the parent process, which stops the workers."""
    import signal

    signal.signal(signal.SIGINT, signal.SIG_IGN)
