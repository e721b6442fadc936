"""Work in pieces on any executor, with the results in the order of the pieces; imports nothing heavy."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Generator, Iterable, Iterator
from concurrent.futures import Executor, Future, InvalidStateError
from contextlib import contextmanager
from itertools import islice
from typing import Any, TypeVar

__all__ = ["AHEAD", "Crew", "in_order", "processes"]

P = TypeVar("P")
T = TypeVar("T")
AHEAD = 16  # pieces under way or waiting to be read: bounds memory whatever the number of pieces


def in_order(executor: Executor | None, function: Callable[[P], T], pieces: Iterable[P]) -> Generator[T, None, None]:
    """Yield ``function(piece)`` for each piece, in order, whoever computes it.

    At most ``AHEAD`` pieces are submitted before their results are read, so memory stays bounded.  Without an executor
    the pieces are done here, one by one; with a :class:`Crew` this process does its share of them.
    """
    if executor is None:
        yield from map(function, pieces)
        return
    waiting: deque[Future[T]] = deque()
    try:
        if isinstance(executor, Crew):
            yield from _shared(executor, function, iter(pieces), waiting)
            return
        for piece in pieces:
            waiting.append(executor.submit(function, piece))
            if len(waiting) == AHEAD:
                yield waiting.popleft().result()
        while waiting:
            yield waiting.popleft().result()
    finally:
        for future in waiting:
            future.cancel()


class Crew(Executor):
    """Other processes and this one: what is submitted runs in the others, and :func:`in_order` works here as well.

    Parameters
    ----------
    others : Executor
    hands : int
        How many processes they are.
    """

    def __init__(self, others: Executor, hands: int) -> None:
        self._others = others
        self.most = 2 * hands + 1  # pieces handed out at once: nobody runs dry, and few are left when this process is

    def submit(self, function: Callable[..., T], /, *arguments: Any, **named: Any) -> Future[T]:
        """Have another process call the function."""
        return self._others.submit(function, *arguments, **named)

    def shutdown(self, wait: bool = True, *, cancel_futures: bool = False) -> None:
        """Let the others end."""
        self._others.shutdown(wait, cancel_futures=cancel_futures)


def _shared(
    crew: Crew, function: Callable[[P], T], pieces: Iterator[P], waiting: deque[Future[T]]
) -> Generator[T, None, None]:
    """Hand out pieces, and while the next result is not there, do one here."""
    more = True
    while True:
        under_way = sum(not future.done() for future in waiting)
        for piece in islice(pieces, max(0, min(crew.most - under_way, AHEAD - len(waiting)))) if more else ():
            waiting.append(crew.submit(function, piece))
        if not waiting:
            return
        if not waiting[0].done() and len(waiting) < AHEAD and more:
            more = False
            for piece in islice(pieces, 1):
                waiting.append(_done_here(function, piece))
                more = True
        else:
            yield waiting.popleft().result()


def _done_here(function: Callable[[P], T], piece: P) -> Future[T]:
    future: Future[T] = Future()
    try:
        future.set_result(function(piece))
    except Exception as error:  # raised in its turn, when the result is asked for
        future.set_exception(error)
    return future


@contextmanager
def processes(workers: int, prepare: Callable[[], None] | None = None) -> Iterator[Executor | None]:
    """Give a crew of so many processes, this one among them; None for one worker (then everything is done here).

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
    pool = ProcessPoolExecutor(workers - 1, mp_context=get_context("spawn"), initializer=_begin_worker)
    with _quiet_cancelling():  # all along: a worker stopped while it starts breaks the pool before this process knows
        try:
            for _ in range(workers - 1):
                pool.submit(int)  # a worker starts now, while this process gets ready
            yield Crew(pool, workers - 1)
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
    from multiprocessing.util import Finalize
    from threading import Thread

    signal.signal(signal.SIGINT, signal.SIG_IGN)
    Thread(target=_end_with_parent, daemon=True).start()
    Finalize(None, _leave, exitpriority=-1000)


def _leave() -> None:
    """End at once: the system takes back what an interpreter would take a quarter of a second to take apart."""
    import os
    import sys

    sys.stdout.flush()
    sys.stderr.flush()
    os._exit(0)


def _end_with_parent() -> None:
    """Wait for the end of the parent process: a killed one cannot tell its workers, and they would wait for ever."""
    import os
    from multiprocessing import parent_process
    from multiprocessing.connection import wait

    parent = parent_process()
    if parent is not None:
        wait([parent.sentinel])
        os._exit(1)
