"""Writing files so that nobody ever sees half of one."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path


@contextmanager
def replacing(path: Path) -> Iterator[Path]:
    """Give a place to write a file to, beside its own; it comes to its own when the block ends.

    If the block fails, as on a full disk, nothing of it is left, and what was there before stays.

    >>> import tempfile
    >>> folder = tempfile.TemporaryDirectory()
    >>> path = Path(folder.name) / "a.txt"
    >>> with replacing(path) as fresh:
    ...     _ = fresh.write_text("all of it")
    >>> path.read_text(), [own.name for own in path.parent.iterdir()]
    ('all of it', ['a.txt'])
    >>> folder.cleanup()
    """
    real = path.resolve()  # of a link, the file is replaced
    fresh = real.with_name(f".{real.name}.{os.getpid()}.new{real.suffix}")
    try:
        yield fresh
        fresh.replace(real)
    except OSError as error:
        if error.filename in (None, str(fresh)):
            error.filename = str(path)
        raise
    finally:
        fresh.unlink(missing_ok=True)
