"""Where the machine code of every kernel comes from here, and why."""

from __future__ import annotations

import sys
from importlib import import_module
from pkgutil import walk_packages
from typing import Any, NamedTuple

import graphsynth
from graphsynth.core.native import library

#: Places that machine code comes from.
LIBRARY, INSIDE = "in the library", "in the library as parts of others"
KEPT, MEMORY, COMPILED = "compiled here and kept on disk", "compiled in memory", "compiled when first used"


class Finding(NamedTuple):
    """A kernel, where its machine code comes from, why not from the library, and how often it was called there."""

    kernel: str
    place: str
    why: str
    calls: int


def kernels() -> dict[str, Any]:
    """Return all kernels of the package by their names."""
    for place in walk_packages(graphsynth.__path__, "graphsynth."):
        if "kernels" in place.name.split("."):
            import_module(place.name)
    found = {}
    for name, module in sorted(sys.modules.items()):
        for value in vars(module).values() if name.startswith("graphsynth.") else ():
            if isinstance(value, library.Native) and value.__module__ == name:
                found[f"{name}.{value.__qualname__}"] = value
    return found


def examine() -> list[Finding]:
    """Look at all kernels of the package; in a session also at what it has compiled so far."""
    from graphsynth.core.compilation import kept

    found = []
    for name, kernel in kernels().items():
        entry = kernel.entry()
        if entry is None:
            why = "not in the library" if library.contents() else f"no library: {library.reason}"
        elif entry[1] != kernel.digest:
            why = "their sources have changed since the library was made"
        elif kernel.compiled:
            why = "called with types that are not in the library"
        else:
            found.append(Finding(name, LIBRARY if entry[2] else INSIDE, "", sum(calls for _, calls in entry[2])))
            continue
        found.append(Finding(name, KEPT if kept(kernel) else MEMORY if kernel.compiled else COMPILED, why, 0))
    return found
