"""How many processes to use."""

from __future__ import annotations

import os


def workers_for(asked: int | None, big: bool) -> int:
    """Return the number of worker processes: as asked, else all cores for big work and one for small."""
    if asked is not None:
        return asked
    return (os.cpu_count() or 1) if big else 1
