"""The library of kernels that were compiled ahead of time: whether it can be used here, and what it holds."""

from __future__ import annotations

import os
import pickle
import platform
import sys
import sysconfig
from collections.abc import Callable
from functools import cache
from importlib.machinery import ExtensionFileLoader
from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path
from typing import Any

FOLDER = Path(__file__).parent
#: Versions of the code in a library, the plainest first.
LEVELS = {"x86_64": ("x86-64-v2", "x86-64-v3")}


def target() -> str:
    """Name of this machine's kind, as in the name of its library."""
    machine = {"amd64": "x86_64", "arm64": "aarch64"}.get(platform.machine().lower(), platform.machine().lower())
    system = {"linux": "linux-gnu", "darwin": "macos", "win32": "windows-gnu"}.get(sys.platform, sys.platform)
    return f"{machine}-{system}"


def path() -> Path:
    """Where the library of this machine is, if there is one."""
    return FOLDER / f"{target()}.so"


def _load() -> tuple[Any, str]:
    """Return the library and the version of its code, or None and why there is none."""
    if os.environ.get("GRAPHSYNTH_NATIVE") == "0":
        return None, "it is switched off by GRAPHSYNTH_NATIVE=0"
    if os.environ.get("NUMBA_DISABLE_JIT", "0") != "0":
        return None, "kernels are interpreted, by NUMBA_DISABLE_JIT"
    if sysconfig.get_config_var("Py_GIL_DISABLED") or sys.implementation.name != "cpython":
        return None, "this Python has another interface for extensions"
    if not path().is_file():
        return None, f"there is none for {target()}"
    try:
        loader = ExtensionFileLoader("graphsynth.core.native._library", str(path()))
        spec = spec_from_file_location("graphsynth.core.native._library", path(), loader=loader)
        assert spec is not None
        library = module_from_spec(spec)
        loader.exec_module(library)
        level = library.set_hooks(_bound, _raise)
    except Exception as error:  # another C library, an older processor, a damaged file: kernels are compiled
        return None, f"{path().name} cannot be loaded: {' '.join(str(error).split())}"
    return library, LEVELS.get(target().split("-")[0], ("",))[level]


def _bound(kernel: Any) -> bool:
    """Whether a kernel of the library was compiled from the sources that are here; asked at its first call."""
    return _knows_arrays() and bool(kernel.digest == kernel.entry()[1])


@cache
def _knows_arrays() -> bool:
    """Hand over what the library needs of numpy, and see that arrays are laid out as it thinks."""
    global _library, reason
    import numpy as np

    names = "bool int8 uint8 int16 uint16 int32 uint32 int64 uint64 - - float32 float64 - - complex128"
    scalars = tuple(None if name == "-" else getattr(np, name) for name in names.split())
    arrays = (np.arange(6.0)[::2], np.zeros((3, 4), dtype=np.uint8), np.frombuffer(bytes(8), dtype=np.int64))
    try:
        from numpy._core import _multiarray_umath as functions  # type: ignore[attr-defined]

        _library.set_numpy(np.ndarray, scalars, functions._ARRAY_API)
        alike = all(_library.peek(array) == _seen(array) for array in arrays)
        alike &= all(scalar is None or scalar(7).dtype.num == number for number, scalar in enumerate(scalars))
    except Exception:  # whatever another numpy does
        alike = False
    if not alike:
        _library, reason = None, "arrays of this numpy are laid out in another way"
    return alike


def _seen(array: Any) -> tuple[int, ...]:
    """Return what the library must read of an array."""
    flags = array.flags
    bits = 1 * flags.c_contiguous + 2 * flags.f_contiguous + 0x100 * flags.aligned + 0x400 * flags.writeable
    order = ord("|" if array.itemsize == 1 else "=")
    return array.ctypes.data, array.ndim, array.shape[0], array.strides[0], array.dtype.num, order, bits


def _raise(data: bytes) -> None:
    """Raise what a compiled kernel tells: an exception, its arguments (without numbers) and a place in the source."""
    kind, arguments, _ = pickle.loads(data)
    raise kind(*(part for part in arguments if isinstance(part, str | int | float)))


class _Plain:
    """Stands for the library where there is none: every kernel is compiled."""

    fallback: Callable[..., Any]

    def __init__(self, name: str) -> None:
        pass

    def __call__(self, *args: Any, **keywords: Any) -> Any:
        return self.fallback(*args, **keywords)

    def set_fallback(self, function: Any) -> None:
        """Take note of what is called."""

    def entry(self) -> None:
        """Return what the library holds of this kernel: nothing."""


_library, reason = _load()
#: What a kernel derives from: calls code of the library for the types that it holds, and ``fallback`` for others.
Native: Any = _Plain if _library is None else _library.Native


def contents() -> tuple[tuple[str, str, tuple[tuple[str, int], ...]], ...]:
    """Return ``(name, digest, ((types, calls), ...))`` of every kernel in the library; no types: others call it."""
    return () if _library is None else _library.contents()
