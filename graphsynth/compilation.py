"""Compiling kernels, and keeping the compiled ones honest.

Machine code also contains functions and constants of other modules.  Each compiled function is therefore kept in a file
of its own under a digest of every graphsynth module that its module imports, directly or through others, with a
checksum: a change of one of them, another numba, another processor or a damaged file only means that it is compiled
again.  The first folder that can be written is used: ``NUMBA_CACHE_DIR``, ``__pycache__`` beside the module, the user's
cache; without any, or on a full disk, functions are compiled in memory, and this is told once.
"""

from __future__ import annotations

import os
import pickle
import re
import sys
import warnings
from collections.abc import Callable, Iterator
from contextlib import suppress
from functools import cache
from hashlib import sha1, sha256
from pathlib import Path
from typing import Any

__all__ = ["announce", "kernel", "source_digest"]

_IMPORT = re.compile(r"^\s*(?:from|import)\s+(graphsynth[\w.]*)(?:\s+import\s+(\([^)]*\)|[^#\n]+))?", re.MULTILINE)
_ROOT = Path(__file__).parent.parent
_VERSIONS = 8  # of one function for one machine that are kept beside each other
_UNKEPT = (
    "kernels are compiled in memory, anew in every process, as no folder can be written to keep them: name one with "
    "the environment variable NUMBA_CACHE_DIR, or free some space"
)


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

    compiled = njit(**{"error_model": "numpy", **options})(function)
    compiled._cache = _cache_class()(function, source_digest(Path(function.__code__.co_filename)))
    if signature is not None:
        compiled.compile(signature)
        compiled.disable_compile()
    return compiled


def _warn(text: str) -> None:
    warnings.warn(text, RuntimeWarning, stacklevel=3)


#: At most one function each: called before the first kernel that has to be compiled; told that none can be kept.
_listeners: list[Callable[[], None]] = []
_warners: list[Callable[[str], None]] = [_warn]


def announce(listener: Callable[[], None], unkept: Callable[[str], None] | None = None) -> None:
    """Call ``listener`` once, before the first kernel of this process that is not kept on disk is compiled.

    ``unkept`` is told once if compiled kernels cannot be kept; a warning is given without it.
    """
    _listeners[:] = [listener]
    if unkept is not None:
        _warners[:] = [unkept] if _warners else []


@cache
def _cache_class() -> Any:
    import numba
    from numba.core.caching import NullCache
    from numba.core.compiler import CompileResult
    from numba.core.serialize import dumps

    class SourceCache(NullCache):  # type: ignore[misc]  # numba has no types
        """Functions kept under a key that tells all sources that went into them."""

        def __init__(self, function: Callable[..., Any], digest: str) -> None:
            self._file = Path(function.__code__.co_filename)
            self._name = f"{self._file.stem}.{re.sub(r'[^0-9A-Za-z_.]', '', function.__qualname__)}"
            self._digest = digest

        @property
        def cache_path(self) -> str:
            return str(next(_folders(self._file)))

        def _place(self, sig: Any, codegen: Any) -> tuple[tuple[Any, ...], str, str]:
            """Return what a file must be of, how its name begins and its whole name."""
            machine = (sig, codegen.magic_tuple(), numba.__version__)
            begin = f"{self._name}-{sha256(repr(machine).encode()).hexdigest()[:16]}"
            return (*machine, self._digest), begin, f"{begin}.{self._digest[:16]}.nbc"

        def load_overload(self, sig: Any, target_context: Any) -> Any:
            target_context.refresh()
            key, _, name = self._place(sig, target_context.codegen())
            for folder in _folders(self._file):
                with suppress(Exception):  # whatever is wrong with the file: the function is compiled
                    found, parts = _read(folder / name)
                    if found == key:
                        return CompileResult._rebuild(target_context, *parts)
            if _listeners:
                _listeners.pop()()
            return None

        def save_overload(self, sig: Any, data: Any) -> None:
            if data.library.has_dynamic_globals or not all(part.can_cache for part in data.lifted):
                return
            key, begin, name = self._place(sig, data.codegen)
            content = dumps((key, data._reduce()))
            for folder in _folders(self._file):
                if _write(folder, name, content):
                    _drop_old(folder, begin)
                    return
            if _warners:
                _warners.pop()(_UNKEPT)

    return SourceCache


def _folders(source: Path) -> Iterator[Path]:
    """Yield the folders where functions of a source file may be kept, the first choice first."""
    from numba import config
    from numba.misc.appdirs import AppDirs

    own = f"{source.parent.name}_{sha1(str(source.parent).encode()).hexdigest()}"
    if config.CACHE_DIR:
        yield Path(config.CACHE_DIR) / own
    yield source.parent / "__pycache__"
    users = Path(AppDirs(appname="numba", appauthor=False).user_cache_dir)
    if users.is_absolute():  # not so for a user without a home
        yield users / own


def _read(path: Path) -> Any:
    """Return what is kept in a file."""
    data = path.read_bytes()
    if sha256(data[32:]).digest() != data[:32]:
        raise ValueError("damaged")
    return pickle.loads(data[32:])


def _write(folder: Path, name: str, content: bytes) -> bool:
    """Write a file that is whole or not there, whoever else writes it; False if that cannot be."""
    fresh = folder / f"{name}.{os.getpid()}"
    try:
        folder.mkdir(parents=True, exist_ok=True)
        fresh.write_bytes(sha256(content).digest() + content)
        fresh.replace(folder / name)
    except OSError:
        with suppress(OSError):
            fresh.unlink()
        return False
    return True


def _drop_old(folder: Path, begin: str) -> None:
    """Delete what was kept of many older versions of a function."""
    with suppress(OSError):  # another process does the same
        kept = [path for path in folder.iterdir() if path.name.startswith(begin)]
        for path in sorted(kept, key=lambda path: path.stat().st_mtime)[:-_VERSIONS]:
            path.unlink()


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
