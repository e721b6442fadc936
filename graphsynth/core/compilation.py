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
from functools import cache, cached_property, update_wrapper
from hashlib import sha1, sha256
from importlib import import_module
from pathlib import Path
from typing import Any, ClassVar

from graphsynth.core.native.library import Native, contents
from graphsynth.core.native.sources import source_digest

_VERSIONS = 8  # of one function for one machine that are kept beside each other
_UNKEPT = (
    "kernels are compiled in memory, anew in every process, as no folder can be written to keep them: name one with "
    "the environment variable NUMBA_CACHE_DIR, or free some space"
)


class Kernel(Native):  # type: ignore[misc]  # of the library, where there is one
    """A function that runs as machine code: from the library, or through numba, which is loaded for that alone."""

    building: ClassVar[dict[str, Any]] = {}  #: more options while the library is built

    def __init__(
        self, function: Callable[..., Any], signature: Callable[[], Any] | None, options: dict[str, Any]
    ) -> None:
        super().__init__(f"{function.__module__}.{function.__qualname__}")
        update_wrapper(self, function)
        self.py_func = function
        self.targetoptions = {"error_model": "numpy", **options}
        self._signature = signature

    @property
    def digest(self) -> str:
        """Digest of the sources."""
        return source_digest(Path(self.py_func.__code__.co_filename))

    @cached_property
    def dispatcher(self) -> Any:
        """The function as numba compiles it."""
        prepare_numba()
        from numba import njit

        compiled = njit(**(self.targetoptions | self.building))(self.py_func)
        if not self.building:
            compiled._cache = _cache_class()(self.py_func, self.digest)
        if self._signature is not None:
            compiled.compile(self._signature())
            compiled.disable_compile()
        return compiled

    @property
    def compiled(self) -> int:
        """For how many types numba has the function in this process."""
        return len(self.dispatcher.overloads) if "dispatcher" in vars(self) else 0

    @cached_property
    def fallback(self) -> Callable[..., Any]:
        """What is called for types that the library does not have."""
        function: Callable[..., Any] = self.dispatcher
        if (record := os.environ.get("GRAPHSYNTH_RECORD")) is not None:
            from graphsynth.core.native.record import noting

            function = noting(self, Path(record))
        self.set_fallback(function)
        return function

    def __getattr__(self, name: str) -> Any:
        if name.startswith("_"):
            raise AttributeError(name)
        return getattr(self.dispatcher, name)


def kernel(
    function: Callable[..., Any] | None = None, *, signature: Callable[[], Any] | None = None, **options: Any
) -> Any:
    """Make a function a `Kernel`: called from the library, or compiled with numba on first use and kept on disk.

    Division by zero gives infinity or NaN, as in C (``error_model="numpy"``).  ``signature`` returns the numba
    signature, if it is to be compiled for these types and for no others; further options are those of ``numba.njit``.
    """
    if function is None:
        return lambda target: Kernel(target, signature, options)
    return Kernel(function, signature, options)


class Deferred(Native):  # type: ignore[misc]  # of the library
    """A kernel of the library, called without its module, which is imported where the library does not fit."""

    def __init__(self, module: str, name: str) -> None:
        super().__init__(f"{module}.{name}")
        self._place = module, name

    @property
    def digest(self) -> str:
        """Digest of the sources."""
        return source_digest(Path(__file__).parents[2].joinpath(*self._place[0].split(".")).with_suffix(".py"))

    @cached_property
    def fallback(self) -> Callable[..., Any]:
        """The kernel itself."""
        function: Callable[..., Any] = getattr(import_module(self._place[0]), self._place[1])
        self.set_fallback(function)
        return function


@cache
def named(module: str, *names: str) -> Any:
    """Return kernels of a module: from the library, if there is one, and the module is not imported for them."""
    return tuple(Deferred(module, name) if contents() else getattr(import_module(module), name) for name in names)


class Intrinsic:
    """One operation of the processor, written in LLVM code: a ``numba.extending.intrinsic`` that is made when used."""

    def __init__(self, function: Callable[..., Any]) -> None:
        self.__doc__ = function.__doc__
        self._function = function

    @cached_property
    def made(self) -> Any:
        """The intrinsic as numba knows it."""
        from numba.extending import intrinsic

        return intrinsic(self._function)


@cache
def prepare_numba() -> None:
    """Teach numba what a kernel is that another one calls."""
    from numba import types
    from numba.core.registry import cpu_target
    from numba.extending import typeof_impl

    @typeof_impl.register(Kernel)  # type: ignore[untyped-decorator]
    def of_kernel(value: Kernel, context: Any) -> Any:
        return types.Dispatcher(value.dispatcher)

    @typeof_impl.register(Intrinsic)  # type: ignore[untyped-decorator]
    def of_intrinsic(value: Intrinsic, context: Any) -> Any:
        made = value.made
        cpu_target.typing_context.refresh()  # a new one becomes known
        return cpu_target.typing_context.resolve_value_type(made)


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
            self._name = _name_of(function)
            self._digest = digest

        def _place(self, sig: Any, codegen: Any) -> tuple[tuple[Any, ...], str, str]:
            """Return what a file must be of, how its name begins and its whole name."""
            machine = (sig, codegen.magic_tuple(), numba.__version__, sys.version)
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


def _name_of(function: Callable[..., Any]) -> str:
    """How the names of files of a function begin."""
    return f"{Path(function.__code__.co_filename).stem}.{re.sub(r'[^0-9A-Za-z_.]', '', function.__qualname__)}"


def kept(kernel: Kernel) -> list[Path]:
    """Files on disk that hold a kernel as its sources are now, for any types and machine."""
    pattern = f"{_name_of(kernel.py_func)}-*.{kernel.digest[:16]}.nbc"
    return [path for folder in _folders(Path(kernel.py_func.__code__.co_filename)) for path in folder.glob(pattern)]


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
