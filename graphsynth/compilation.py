"""Keeping the cache of compiled kernels honest.

numba keeps a compiled function as long as its own source file is unchanged, but the function also contains constants
and functions of other kernel modules.  After an update of one of those, a kept function would be silently wrong.  So
every kernel package calls ``drop_stale_kernels`` before its functions are loaded: when any of its kernel sources, or
of those it builds on, has changed since the last time, all of them are given a new modification time.  numba then
compiles them anew on first use, wherever it keeps its cache.
"""

from __future__ import annotations

from functools import cache
from hashlib import sha256
from pathlib import Path

__all__ = ["drop_stale_kernels"]

_STAMP = "kernels.sha256"


@cache
def drop_stale_kernels(*places: Path) -> bool:
    """Make numba forget the compiled kernels of ``places`` if any source there has changed; return whether it had.

    Parameters
    ----------
    places : Path
        Kernel modules, or folders of them; the first is the caller's own, the others those it builds on.

    Notes
    -----
    Sources that cannot be touched are left alone: an installation that is never edited needs no such care.
    """
    sources = [source for place in places for source in ([place] if place.is_file() else sorted(place.glob("*.py")))]
    digest = sha256()
    for source in sources:
        digest.update(source.name.encode() + b"\0" + source.read_bytes())
    own = places[0].parent if places[0].is_file() else places[0]
    stamp = own / "__pycache__" / _STAMP
    try:
        if stamp.is_file() and stamp.read_text() == digest.hexdigest():
            return False
        for source in sources:
            if source.parent == own or source == places[0]:
                source.touch()
        stamp.parent.mkdir(exist_ok=True)
        stamp.write_text(digest.hexdigest())
    except OSError:
        return False
    return True
