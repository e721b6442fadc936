"""Writing folders so that nobody ever sees half of one, and nobody's files are lost."""

from __future__ import annotations

import shutil
import tempfile
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from graphsynth.core.errors import GraphsynthError


@dataclass(frozen=True, slots=True)
class PageFolder:
    """A kind of folder that is written as a whole.

    Parameters
    ----------
    mark : str
        Name of a file that is in every folder of the kind.
    own : mapping of str to tuple of str
        Suffixes of its files by folder, "." for the top; a folder with anything else is somebody's.
    """

    mark: str
    own: Mapping[str, tuple[str, ...]]

    @contextmanager
    def replaced(self, folder: Path) -> Iterator[tuple[Path, Path]]:
        """Give (the folder, an empty one beside it); when the block ends well, the second takes the place of the first.

        Whatever happens, the older page stays until the new one is whole, and no other file is touched.

        Raises `GraphsynthError` at once, if the folder cannot be made or replaced, or holds other files; later, if the
        disk is full.
        """
        target = folder.resolve()
        self._check(folder, target)
        try:
            # a name that nobody has, beside the folder: moving it is then one step
            beside = Path(tempfile.mkdtemp(prefix=f".{target.name}-", dir=target.parent))
        except OSError as error:
            raise unwritten(error, target.parent) from None
        try:
            new = beside / "new"
            new.mkdir()
            yield target, new
            self._check(folder, target)  # it may have changed meanwhile
            old = beside / "old"
            try:
                if target.exists():
                    target.rename(old)
                new.rename(target)
            except OSError as error:
                if old.exists() and not target.exists():
                    old.rename(target)
                raise unwritten(error, target) from None
        finally:
            shutil.rmtree(beside, ignore_errors=True)

    def _check(self, folder: Path, target: Path) -> None:
        """Refuse before anything is computed what could not be replaced at the end."""
        parent = target.parent
        if not parent.is_dir():
            raise GraphsynthError(f"{folder}: the folder {parent} does not exist; make it first")
        if target.exists() and not target.is_dir():
            raise GraphsynthError(f"{folder} is a file; name a folder")
        if target.is_mount() or target == parent:
            raise GraphsynthError(
                f"{folder} is the root of a file system, which cannot be replaced; name a folder in it"
            )
        others = (own.name for own in target.iterdir()) if target.is_dir() else iter(())
        if (target / self.mark).is_file():
            others = (
                str(own.relative_to(target)) for own in sorted(target.rglob("*")) if not self._is_own(own, target)
            )
        other = min(others, default="")
        if other:
            raise GraphsynthError(f"{folder} holds other files ({other}); name an empty or a new folder")

    def _is_own(self, path: Path, target: Path) -> bool:
        inside = path.relative_to(target)
        if path.is_symlink():
            return False
        if path.is_dir():
            return str(inside) in self.own
        return path.is_file() and (str(inside) == self.mark or path.suffix in self.own.get(str(inside.parent), ()))


def put(path: Path, text: str) -> None:
    """Write a text as UTF-8 with plain line ends; a `GraphsynthError` names the file and the remedy."""
    try:
        path.write_text(text, "utf-8", newline="\n")
    except OSError as error:
        raise unwritten(error, path) from None


def unwritten(error: OSError, place: Path) -> GraphsynthError:
    """Return the error of a file that cannot be written: its name and the remedy."""
    return GraphsynthError(
        f"{error.filename or place} cannot be written ({error.strerror or error}): make room or name another folder; "
        "an older page stays as it was"
    )
