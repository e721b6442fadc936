"""Workers on other machines: a dask cluster as an executor."""

from __future__ import annotations

from collections.abc import Iterator
from concurrent.futures import CancelledError, Executor
from contextlib import contextmanager

from graphsynth.core.errors import GraphsynthError
from graphsynth.core.extras import need
from graphsynth.core.ordered import RETRIES, Again


@contextmanager
def dask_executor(address: str, timeout: float = 20.0) -> Iterator[Executor]:
    """Connect to a dask scheduler and give its workers as an executor.

    ``address``: for example ``tcp://node1:8786``; workers need the same version of graphsynth; ``timeout``: seconds
    to wait for the scheduler. Raises `MissingExtraError` if the extra ``cluster`` is not installed. Raises
    `GraphsynthError` if the scheduler does not answer, or has a different graphsynth.
    """
    need("distributed", "cluster", "a dask cluster")
    from distributed import Client, KilledWorker
    from distributed.comm import CommClosedError

    try:
        client = Client(address, timeout=timeout)
    except (OSError, TimeoutError, ValueError) as error:
        raise GraphsynthError(f"the scheduler {address} does not answer ({error}): check address and network") from None
    with client:
        _check_versions(client.run(_version))
        try:
            with client.get_executor(retries=RETRIES) as executor:
                yield Again(executor, _lost)
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


def _lost(error: BaseException) -> bool:
    """Whether dask lost a piece.

    When a worker dies just after it gave a result, dask's executor can meet a result without a state, and raises a
    TypeError of its own.
    """
    return isinstance(error, TypeError) and "cannot unpack non-iterable" in str(error)
