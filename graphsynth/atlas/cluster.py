"""Workers on other machines: a dask cluster as an executor."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from concurrent.futures import CancelledError, Executor, Future
from contextlib import contextmanager
from typing import Any, TypeVar

from graphsynth.errors import GraphsynthError, SpecError

__all__ = ["RETRIES", "dask_executor"]

T = TypeVar("T")

#: How often a piece is computed anew when it fails; pieces of a lost worker go to another one by themselves.
RETRIES = 3


@contextmanager
def dask_executor(address: str, timeout: float = 20.0) -> Iterator[Executor]:
    """Connect to a dask scheduler and give its workers as an executor.

    Parameters
    ----------
    address : str
        For example ``tcp://node1:8786``; workers need the same version of graphsynth.
    timeout : float
        Seconds to wait for the scheduler.

    Raises
    ------
    SpecError
        If the extra ``cluster`` is not installed.
    GraphsynthError
        If the scheduler does not answer, or has a different graphsynth.
    """
    try:
        from distributed import Client, KilledWorker
        from distributed.comm import CommClosedError
    except ImportError:
        raise SpecError("dask needs the extra: pip install 'graphsynth[cluster]'") from None
    try:
        client = Client(address, timeout=timeout)
    except (OSError, TimeoutError, ValueError) as error:
        raise GraphsynthError(f"the scheduler {address} does not answer ({error}): check address and network") from None
    with client:
        _check_versions(client.run(_version))
        try:
            with client.get_executor(retries=RETRIES) as executor:
                yield _Again(executor)
        except KilledWorker as error:
            raise GraphsynthError(
                f"several workers died over one piece ({error}): give them more memory, then the same command to go on"
            ) from None
        except (CommClosedError, CancelledError) as error:
            raise GraphsynthError(
                f"the scheduler {address} was lost ({type(error).__name__}): start it again, then give the same "
                "command to go on"
            ) from None


def _version() -> str:
    import graphsynth

    return graphsynth.__version__


def _check_versions(found: dict[str, str]) -> None:
    """Refuse workers with another graphsynth: their pieces could be cut or numbered in another way."""
    others = sorted({version for version in found.values() if version != _version()})
    if others:
        raise GraphsynthError(
            f"workers have graphsynth {', '.join(others)}, this is {_version()}: install the same version everywhere"
        )


class _Again(Executor):
    """An executor of dask whose pieces are submitted again if their state is lost with a worker.

    When a worker dies just after it gave a result, dask's own executor can meet a result without a state, and raises
    a TypeError of its own.
    """

    def __init__(self, executor: Executor) -> None:
        self._executor = executor

    def submit(self, function: Callable[..., T], /, *arguments: Any, **named: Any) -> Future[T]:
        """Submit a piece; its future holds what the last attempt gave."""
        outer: Future[T] = Future()

        def attempt(left: int) -> None:
            def done(inner: Future[T]) -> None:
                if outer.cancelled():
                    return
                error = CancelledError() if inner.cancelled() else inner.exception()
                if isinstance(error, TypeError) and left and "cannot unpack non-iterable" in str(error):
                    attempt(left - 1)
                elif error is not None:
                    outer.set_exception(error)
                else:
                    outer.set_result(inner.result())

            self._executor.submit(function, *arguments, **named).add_done_callback(done)

        attempt(RETRIES)
        return outer
