"""Work in pieces on any executor, with the results in the order of the pieces; imports nothing heavy."""

from __future__ import annotations

import os
import sys
import threading
from collections import deque
from collections.abc import Callable, Generator, Iterable, Iterator
from concurrent.futures import BrokenExecutor, CancelledError, Executor, Future, InvalidStateError
from contextlib import contextmanager
from functools import partial
from itertools import islice
from typing import Any, TypeVar

from graphsynth.core.errors import GraphsynthError, SpecError

P = TypeVar("P")
T = TypeVar("T")
AHEAD = 16  # pieces under way or waiting to be read: bounds memory whatever the number of pieces
RETRIES = 3  # how often lost work is done anew before the loss is told
_LOST = (
    "worker processes were killed while they worked, again and again (is the memory full?): use fewer workers or free "
    "some memory, then give the same command; what is stored stays. In a script of your own, work on several processes "
    "has to stand below 'if __name__ == \"__main__\":'"
)
_GUARD = (
    "a worker process reads your script first, and came to the line that starts workers: put what the script does "
    "below 'if __name__ == \"__main__\":'"
)


def check_executor(executor: object) -> None:
    """Refuse, by a `SpecError`, what is neither None nor has the method ``submit`` of an executor."""
    if executor is not None and not callable(getattr(executor, "submit", None)):
        raise SpecError(
            f"executor = {executor!r} must be a concurrent.futures.Executor, such as ProcessPoolExecutor(4), or None"
        )


def in_order(executor: Executor | None, function: Callable[[P], T], pieces: Iterable[P]) -> Generator[T, None, None]:
    """Yield ``function(piece)`` for each piece, in order, whoever computes it.

    At most ``AHEAD`` pieces are submitted before their results are read, so memory stays bounded.  Without an executor
    the pieces are done here, one by one; with a :class:`Crew` this process does its share of them.  `SpecError` at
    once if `executor` is none, `GraphsynthError` if the workers died and could not be replaced.
    """
    check_executor(executor)
    return _in_order(executor, function, pieces)


def _in_order(executor: Executor | None, function: Callable[[P], T], pieces: Iterable[P]) -> Generator[T, None, None]:
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
    except BrokenExecutor:
        raise GraphsynthError(_LOST) from None
    finally:
        for future in waiting:
            future.cancel()


class Again(Executor):
    """An executor that submits work again that was lost with a worker; its futures hold what the last attempt gave.

    ``lost`` says whether an exception tells of work that was lost, not of work that failed.
    """

    def __init__(self, executor: Executor, lost: Callable[[BaseException], bool]) -> None:
        self._executor = executor
        self._lost = lost

    def submit(self, function: Callable[..., T], /, *arguments: Any, **named: Any) -> Future[T]:
        """Have a worker call the function."""
        outer: Future[T] = Future()
        self._attempt(outer, partial(function, *arguments, **named), RETRIES)
        return outer

    def shutdown(self, wait: bool = True, *, cancel_futures: bool = False) -> None:
        """Let the workers end."""
        self._executor.shutdown(wait, cancel_futures=cancel_futures)

    def _attempt(self, outer: Future[T], work: Callable[[], T], left: int) -> None:
        executor = self._executor
        try:
            inner: Future[T] = executor.submit(work)
        except Exception as error:  # told where the result is asked for
            inner = Future()
            inner.set_exception(error)
        outer.add_done_callback(lambda outer: inner.cancel() if outer.cancelled() else None)
        inner.add_done_callback(lambda inner: self._settle(outer, work, left, executor, inner))

    def _settle(self, outer: Future[T], work: Callable[[], T], left: int, executor: Executor, inner: Future[T]) -> None:
        """Pass a result on, or try again."""
        error = CancelledError() if inner.cancelled() else inner.exception()
        if error is not None and self._lost(error) and left and not outer.cancelled() and self._ready(executor):
            self._attempt(outer, work, left - 1)
        elif not outer.set_running_or_notify_cancel():
            return
        elif error is None:
            outer.set_result(inner.result())
        else:
            outer.set_exception(GraphsynthError(_LOST) if isinstance(error, BrokenExecutor) else error)

    def _ready(self, executor: Executor) -> bool:
        """Whether there is an executor to submit to again."""
        return True


class Crew(Again):
    """Other processes and this one: what is submitted runs in the others, and :func:`in_order` works here as well.

    ``hands`` is how many they are; ``renew`` gives other ones in the place of those lost, of which one was killed.
    """

    def __init__(self, others: Executor, hands: int, renew: Callable[[], Executor] | None = None) -> None:
        super().__init__(others, lambda error: isinstance(error, BrokenExecutor))
        self.most = 2 * hands + 1  # pieces handed out at once: nobody runs dry, and few are left when this process is
        self._renew = renew
        self._lock = threading.RLock()

    def shutdown(self, wait: bool = True, *, cancel_futures: bool = False) -> None:
        """Let the others end; they are not replaced any more."""
        with self._lock:
            self._renew = None
        super().shutdown(wait, cancel_futures=cancel_futures)

    def _ready(self, executor: Executor) -> bool:
        with self._lock:
            if self._renew is None:
                return False
            try:
                if executor is self._executor:  # the first to tell of the loss
                    self._executor = self._renew()
            except OSError:  # no memory, no more processes
                return False
            return True


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
                future: Future[T] = Future()
                try:
                    future.set_result(function(piece))
                except Exception as error:  # raised in its turn, when the result is asked for
                    future.set_exception(error)
                waiting.append(future)
                more = True
        else:
            yield waiting.popleft().result()


@contextmanager
def processes(workers: int, prepare: Callable[[], None] | None = None) -> Iterator[Executor | None]:
    """Give a crew of so many processes, this one among them; None for one worker (then everything is done here).

    `prepare` is called here first, to put into caches on disk what all workers need.  A worker that is killed is
    replaced and its piece done again.  When the block is left by an exception (Ctrl-C), the workers are stopped at
    once; what was already written stays.
    """
    if workers <= 1:
        yield None
        return
    from concurrent.futures import ProcessPoolExecutor
    from multiprocessing import active_children, current_process, get_context

    if getattr(current_process(), "_inheriting", False):  # as multiprocessing asks itself
        raise GraphsynthError(_GUARD)
    if prepare:
        prepare()

    def start() -> Executor:
        pool = ProcessPoolExecutor(workers - 1, mp_context=get_context("spawn"), initializer=_begin_worker)
        for _ in range(workers - 1):
            pool.submit(int)  # a worker starts now, while this process gets ready
        return pool

    try:
        crew = Crew(start(), workers - 1, start)
    except (ImportError, NotImplementedError, OSError):  # no semaphores, no more processes: everything is done here
        yield None
        return
    usual = threading.excepthook

    def hook(arguments: threading.ExceptHookArgs) -> None:
        """Keep the thread of a pool from complaining that work it lost with its processes was cancelled before."""
        if not issubclass(arguments.exc_type, InvalidStateError):
            usual(arguments)

    threading.excepthook = hook  # all along: a worker stopped while it starts breaks the pool before this process knows
    try:
        yield crew
    except BaseException:
        crew.shutdown(wait=False, cancel_futures=True)
        for child in active_children():
            child.kill()
        raise
    finally:
        crew.shutdown(wait=True, cancel_futures=True)
        threading.excepthook = usual


def _begin_worker(*_: Any) -> None:
    """Leave Ctrl-C to the parent process, which stops the workers; end with it if it is killed."""
    import signal
    from multiprocessing import parent_process
    from multiprocessing.util import Finalize

    from graphsynth.core.compilation import announce

    announce(lambda: None, lambda text: None)  # this process tells nothing
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    parent = parent_process()
    if parent is not None and sys.platform == "linux":
        import fcntl

        # have the system kill this process with its parent, also in the middle of compiled code that lets no thread run
        fcntl.fcntl(parent.sentinel, fcntl.F_SETOWN, os.getpid())
        fcntl.fcntl(parent.sentinel, fcntl.F_SETSIG, signal.SIGKILL)
        fcntl.fcntl(parent.sentinel, fcntl.F_SETFL, fcntl.fcntl(parent.sentinel, fcntl.F_GETFL) | os.O_ASYNC)
    if parent is not None:
        threading.Thread(target=_end_with, args=(parent.sentinel,), daemon=True).start()
    Finalize(None, _leave, exitpriority=-1000)


def _leave() -> None:
    """End at once: the system takes back what an interpreter would take a quarter of a second to take apart."""
    sys.stdout.flush()
    sys.stderr.flush()
    os._exit(0)


def _end_with(sentinel: int) -> None:
    """Wait for the end of the parent process: a killed one cannot tell its workers, and they would wait for ever."""
    from multiprocessing.connection import wait

    wait([sentinel])
    os._exit(1)
