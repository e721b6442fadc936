"""Records with which types kernels are called from Python, while programs run."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

from graphsynth.core.native.signatures import text_of

__all__ = ["noting"]


@cache
def _note(path: Path, line: str) -> None:
    with path.open("a", encoding="utf-8") as file:
        file.write(f"{line}\n")


def noting(kernel: Any, path: Path) -> Callable[..., Any]:
    """Return the dispatcher of a kernel; types of arguments that are new in this process are appended to a file."""
    from numba import types
    from numba.core.typing.typeof import Purpose, typeof
    from numba.core.utils import pysignature

    dispatcher = kernel.dispatcher
    name = f"{kernel.py_func.__module__}.{kernel.py_func.__qualname__}"
    signature = pysignature(kernel.py_func)

    def call(*args: Any, **keywords: Any) -> Any:
        try:
            given = signature.bind(*args, **keywords).arguments
            kinds = [
                typeof(given[part], Purpose.argument) if part in given else types.Omitted(value.default)
                for part, value in signature.parameters.items()
            ]
            _note(path, f"{name}({', '.join(map(text_of, kinds))}){' # by keywords' if keywords else ''}")
        except (TypeError, ValueError) as error:
            _note(path, f"# {name}: {error}")
        return dispatcher(*args, **keywords)

    return call
