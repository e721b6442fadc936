"""Compiling kernels, and keeping the compiled ones honest.

numba keeps the machine code of a function as long as the function's own source file is unchanged, but that code also
contains functions and constants of other modules.  After a change of one of those, a kept function would be silently
wrong.  `kernel` therefore adds to the key under which numba keeps a function a digest of every graphsynth module that
the function's module imports, directly or through others.  It works wherever numba keeps its files, and for sources
that cannot be written.
"""

from __future__ import annotations

import re
import sys
from collections.abc import Callable
from functools import cache
from hashlib import sha256
from pathlib import Path
from typing import Any

__all__ = ["announce", "kernel", "source_digest"]

_IMPORT = re.compile(r"^\s*(?:from|import)\s+(graphsynth[\w.]*)(?:\s+import\s+(\([^)]*\)|[^#\n]+))?", re.MULTILINE)
_ROOT = Path(__file__).parent.parent


def kernel(function: Callable[..., Any] | None = None, *, signature: Any = None, **options: Any) -> Any:
    """Compile a function with numba on first use and keep the machine code on disk.

    Parameters
    ----------
    function : callable
        A function of a kernel module.  Division by zero gives infinity or NaN, as in C (``error_model="numpy"``).
    signature : numba signature, optional
        Compile at once for these types and for no others.
    **options
        Further options of ``numba.njit``, for example ``inline="always"``.

    Returns
    -------
    numba dispatcher
    """
    if function is None:
        return lambda target: kernel(target, signature=signature, **options)
    from numba import njit

    compiled = njit(cache=True, **{"error_model": "numpy", **options})(function)
    compiled._cache = _cache_class()(function, source_digest(Path(function.__code__.co_filename)))
    if signature is not None:
        compiled.compile(signature)
        compiled.disable_compile()
    return compiled


#: At most one function, called before the first kernel that has to be compiled.
_listeners: list[Callable[[], None]] = []


def announce(listener: Callable[[], None], unkept: Callable[[str], None] | None = None) -> None:
    """Call ``listener`` once, before the first kernel of this process that is not kept on disk is compiled."""
    _listeners[:] = [listener]


@cache
def _cache_class() -> Any:
    from numba.core.caching import FunctionCache

    class SourceCache(FunctionCache):  # type: ignore[misc]  # numba has no types
        """Functions kept under a key that tells all sources that went into them."""

        def __init__(self, function: Callable[..., Any], digest: str) -> None:
            super().__init__(function)
            self._digest = digest

        def _index_key(self, sig: Any, codegen: Any) -> tuple[Any, ...]:
            return (*super()._index_key(sig, codegen), self._digest)

        def load_overload(self, sig: Any, target_context: Any) -> Any:
            found = super().load_overload(sig, target_context)
            if found is None and _listeners:
                _listeners.pop()()
            return found

    return SourceCache


@cache
def source_digest(module: Path, root: Path = _ROOT) -> str:
    """Digest of a source file and of all modules of the package that it imports, directly or through others.

    Parameters
    ----------
    module : Path
        The source file.
    root : Path, optional
        Folder that holds the package.
    """
    found: dict[Path, bytes] = {}
    waiting = [module]
    while waiting:
        path = waiting.pop()
        if path in found:
            continue
        found[path] = path.read_bytes()
        waiting += _imported(found[path].decode(), root)
    digest = sha256(sys.version.encode())
    for path in sorted(found, key=str):
        digest.update(path.name.encode() + b"\0" + found[path] + b"\0")
    return digest.hexdigest()


def _imported(source: str, root: Path) -> list[Path]:
    """Source files of the package that a module names in its import lines."""
    paths = []
    for name, parts in _IMPORT.findall(source):
        base = root.joinpath(*name.split("."))
        names = re.findall(r"\w+", parts)
        candidates = [base.with_suffix(".py"), base / "__init__.py", *(base / f"{part}.py" for part in names)]
        paths += [path for path in candidates if path.is_file() and path != Path(__file__)]
    return paths
