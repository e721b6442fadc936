"""Work in pieces on any executor, with the results in the order of the pieces; imports nothing heavy."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Generator, Iterable, Iterator
from concurrent.futures import Executor, Future, InvalidStateError
from contextlib import contextmanager
from typing import Any, TypeVar

__all__ = ["AHEAD", "in_order", "processes"]

P = TypeVar("P")
T = TypeVar("T")
AHEAD = 16  # pieces under way or waiting to be read: bounds memory whatever the number of pieces


def in_order(executor: Executor | None, function: Callable[[P], T], pieces: Iterable[P]) -> Generator[T, None, None]:
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


@contextmanager
def processes(workers: int, prepare: Callable[[], None] | None = None) -> Iterator[Executor | None]:
    """Give a pool of worker processes, or None for one worker (then everything is done in this process).

    `prepare` is called here first, to put into caches on disk what all workers need.  When the block is left by an
    exception (Ctrl-C), the workers are stopped at once; what was already written stays.
    """
    if workers <= 1:
        yield None
        return
    from concurrent.futures import ProcessPoolExecutor
    from multiprocessing import active_children, get_context

    if prepare:
        prepare()
    pool = ProcessPoolExecutor(workers, mp_context=get_context("spawn"), initializer=_begin_worker)
    with _quiet_cancelling():  # all along: a worker stopped while it starts breaks the pool before this process knows
        try:
            yield pool
        except BaseException:
            pool.shutdown(wait=False, cancel_futures=True)
            for child in active_children():
                child.terminate()
            raise
        finally:
            pool.shutdown(wait=True, cancel_futures=True)


@contextmanager
def _quiet_cancelling() -> Iterator[None]:
    """Keep the thread of a pool from complaining that work it lost with its processes was cancelled before."""
    import threading

    usual = threading.excepthook

    def hook(arguments: threading.ExceptHookArgs) -> None:
        if not issubclass(arguments.exc_type, InvalidStateError):
            usual(arguments)

    threading.excepthook = hook
    try:
        yield
    finally:
        threading.excepthook = usual


def _begin_worker(*_: Any) -> None:
    """Leave Ctrl-C to the parent process, which stops the workers; end with it if it is killed."""
    import signal
    from threading import Thread

    signal.signal(signal.SIGINT, signal.SIG_IGN)
    Thread(target=_end_with_parent, daemon=True).start()


def _end_with_parent() -> None:
    """Wait for the end of the parent process: a killed one cannot tell its workers, and they would wait for ever."""
    import os
    from multiprocessing import parent_process
    from multiprocessing.connection import wait

    parent = parent_process()
    if parent is not None:
        wait([parent.sentinel])
        os._exit(1)
