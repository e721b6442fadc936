"""How many processes to use, and a word to the user when kernels have to be compiled first."""

from __future__ import annotations

import os
from pathlib import Path

from graphsynth.cli import console

__all__ = ["announce_compilation", "workers_for"]


def workers_for(asked: int | None, big: bool) -> int:
    """Return the number of worker processes: as asked, else all cores for big work and one for small."""
    if asked is not None:
        return asked
    return (os.cpu_count() or 1) if big else 1


def announce_compilation(kernel: str) -> None:
    """Say so when a kernel (``module.function``) is not compiled yet: the first use takes some seconds more."""
    import graphsynth
    import graphsynth.synthesis.kernels  # forgets kernels that are out of date

    package = Path(graphsynth.__file__).parent / "synthesis" / "kernels"
    compiled = [package / "__pycache__"]
    if folder := os.environ.get("NUMBA_CACHE_DIR"):
        compiled = [Path(folder)]
    elif not os.access(package, os.W_OK):
        return  # numba keeps its cache elsewhere
    if not any(next(place.rglob(f"{kernel}-*.nbi"), None) for place in compiled if place.is_dir()):
        console.note("compiling kernels (first use only, some seconds) ...")
