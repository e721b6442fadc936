"""The folder of a page: what may be replaced, and replacing it at once when the new page is whole."""

from __future__ import annotations

import shutil
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from graphsynth.core.errors import GraphsynthError

#: In every folder that was written as a page.
MARK = "atlas-page.txt"
#: What pages consist of; a folder with anything else is somebody's.
_OWN = {".": (".html", ".css", ".js"), "data": (".js",), "motions": (".html", ".toml")}


@contextmanager
def replaced(folder: Path) -> Iterator[tuple[Path, Path]]:
    """Give (the folder, an empty one beside it); when the block ends well, the second takes the place of the first.

    Whatever happens, the older page stays until the new one is whole, and no other file is touched.

    Raises `GraphsynthError` at once, if the folder cannot be made or replaced, or holds other files; later, if the
    disk is full.
    """
    target = folder.resolve()
    _check(folder, target)
    try:
        # a name that nobody has, beside the folder: moving it is then one step
        beside = Path(tempfile.mkdtemp(prefix=f".{target.name}-", dir=target.parent))
    except OSError as error:
        raise unwritten(error, target.parent) from None
    try:
        new = beside / "new"
        new.mkdir()
        yield target, new
        _check(folder, target)  # it may have changed meanwhile
        _exchange(target, new, beside / "old")
    finally:
        shutil.rmtree(beside, ignore_errors=True)


def _exchange(target: Path, new: Path, old: Path) -> None:
    try:
        if target.exists():
            target.rename(old)
        new.rename(target)
    except OSError as error:
        if old.exists() and not target.exists():
            old.rename(target)
        raise unwritten(error, target) from None


def unwritten(error: OSError, place: Path) -> GraphsynthError:
    """Return the error of a file that cannot be written: its name and the remedy."""
    return GraphsynthError(
        f"{error.filename or place} cannot be written ({error.strerror or error}): make room or name another folder; "
        "an older page stays as it was"
    )


def _check(folder: Path, target: Path) -> None:
    """Refuse before anything is computed what could not be replaced at the end."""
    parent = target.parent
    if not parent.is_dir():
        raise GraphsynthError(f"{folder}: the folder {parent} does not exist; make it first")
    if target.exists() and not target.is_dir():
        raise GraphsynthError(f"{folder} is a file; name a folder")
    if target.is_mount() or target == parent:
        raise GraphsynthError(f"{folder} is the root of a file system, which cannot be replaced; name a folder in it")
    if target.is_dir() and any(target.iterdir()):
        other = _other(target)
        if other:
            raise GraphsynthError(f"{folder} holds other files ({other}); name an empty or a new folder")


def _other(target: Path) -> str:
    """First thing in a folder that is not of a page; empty if there is none."""
    if not (target / MARK).is_file():
        return min(own.name for own in target.iterdir())
    for own in sorted(target.rglob("*")):
        inside = own.relative_to(target)
        plain = not own.is_symlink()
        if own.is_dir() and plain and str(inside) in _OWN:
            continue
        if not (own.is_file() and plain and (str(inside) == MARK or own.suffix in _OWN.get(str(inside.parent), ()))):
            return str(inside)
    return ""
