"""Real calls of kernels: runs examples of the documentation with numba, keeps copies of arguments (``FILE [slow]``)."""

from __future__ import annotations

import copy
import pickle
import sys
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from graphsynth.core.compilation import Kernel
from graphsynth.core.native.signatures import Signature, text_of

MOST = 12  # calls of each kind that are kept
LARGE, HUGE = 1_000_000, 30_000_000  # bytes of arguments from which on only two or none are


def size_of(value: Any) -> int:
    return sum(map(size_of, value)) if isinstance(value, tuple) else getattr(value, "nbytes", 8)


def duplicate(value: Any) -> Any:
    """Copy arguments; arrays that may only be read stay so."""
    if isinstance(value, tuple):
        parts = [duplicate(part) for part in value]
        return type(value)(*parts) if hasattr(value, "_fields") else tuple(parts)
    found = copy.deepcopy(value)
    if isinstance(value, np.ndarray):
        found.flags.writeable = value.flags.writeable
    return found


class Calls:
    """Copies of arguments by kernel and types."""

    def __init__(self) -> None:
        self.kept: dict[Signature, list[tuple[Any, ...]]] = {}
        self.seen: dict[Signature, int] = {}

    def around(self, kernel: Kernel) -> Any:
        """What is called instead of a kernel."""
        from numba import typeof

        name = f"{kernel.__module__}.{kernel.__qualname__}"

        def call(*args: Any) -> Any:
            try:
                kind = Signature(name, ", ".join(text_of(typeof(value)) for value in args))
            except (TypeError, ValueError):
                return kernel.dispatcher(*args)
            count = self.seen[kind] = self.seen.get(kind, 0) + 1
            kept, size = self.kept.setdefault(kind, []), size_of(args)
            # of many calls the first ones, and then ever rarer ones
            if size < HUGE and len(kept) < (2 if size > LARGE else MOST) and count & (count - 1) == 0:
                kept.append(duplicate(args))
            return kernel.dispatcher(*args)

        return call


def main(path: Path, *slow: str) -> None:
    calls = Calls()
    fallback: Any = cached_property(calls.around)
    fallback.__set_name__(Kernel, "fallback")
    Kernel.fallback = fallback
    here = Path(__file__).parent
    options = ["-q", "-n", "0", "-p", "no:cacheprovider", *(["-m", ""] if slow else [])]
    pages = [f"{here / 'test_docs.py'}::test_examples_run", str(here / "test_doc_commands.py")]
    assert pytest.main([*options, *pages]) in (pytest.ExitCode.OK, pytest.ExitCode.TESTS_FAILED)  # that is for others
    calls.kept = {kind: kept for kind, kept in calls.kept.items() if kept}
    path.write_bytes(pickle.dumps(calls.kept, protocol=5))  # the first that tells what may be written


if __name__ == "__main__":
    main(Path(sys.argv[1]), *sys.argv[2:])
