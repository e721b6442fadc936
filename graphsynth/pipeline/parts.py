"""Columns of single candidates as files: made where the candidate is evaluated, written before its outcome is noted."""

from __future__ import annotations

import hashlib
import os
import tempfile
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import replace
from pathlib import Path

from graphsynth.core.errors import SceneError
from graphsynth.core.journal import writing
from graphsynth.pipeline.products import Columns, Outcome, Part

__all__ = ["REMEDY", "PartFolder", "check_folder", "split_parts", "write_whole"]

#: What to do where a report folder cannot be written.
REMEDY = "choose another folder with --out"


def write_whole(path: Path, data: bytes) -> None:
    """Write a file so that nobody ever sees half of it."""
    handle, name = tempfile.mkstemp(prefix=f".{path.name}.", dir=path.parent)
    try:
        with os.fdopen(handle, "wb") as stream:
            stream.write(data)
        Path(name).chmod(0o644)
        Path(name).replace(path)
    except BaseException:
        Path(name).unlink(missing_ok=True)
        raise


def check_folder(folder: Path) -> None:
    """Try whether files can be written into a folder; what is made for that is removed.

    Raises
    ------
    SceneError
        If not.
    """
    made: list[Path] = []
    try:
        with writing(f"the report into {folder}", REMEDY, SceneError):
            for part in (*reversed(folder.parents), folder):
                if not part.exists():
                    part.mkdir()
                    made.append(part)
            with tempfile.TemporaryFile(dir=folder) as stream:
                stream.write(b"x")
    finally:
        for part in reversed(made):
            with suppress(OSError):  # somebody else began to use it
                part.rmdir()


def split_parts(outcome: Outcome, kinds: Sequence[str]) -> tuple[Outcome, dict[str, bytes]]:
    """Take the columns out of an outcome: each becomes a `Part`, and the files to be written come besides.

    Parameters
    ----------
    kinds : sequence of str
        "csv", "parquet".
    """
    from graphsynth.pipeline.datafiles import column_files

    products = dict(outcome.products)
    files: dict[str, bytes] = {}
    for product, value in outcome.products.items():
        if not isinstance(value, Columns):
            continue
        made = column_files(f"{value.name}/part-{outcome.number:05}", value.columns, kinds)
        rows = len(next(iter(value.columns.values()), ()))
        digests = tuple((path, hashlib.sha256(data).hexdigest()) for path, data in made.items())
        products[product] = Part(value.name, rows, digests)
        files |= made
    return (replace(outcome, products=products), files) if files else (outcome, {})


class PartFolder:
    """The files of one run below its report folder; without a folder nothing is written.

    Parameters
    ----------
    folder : Path or None
        The report folder.
    done : sequence of Outcome
        Taken over from an interrupted run; their files must be there and unchanged.
    kinds : sequence of str
        "csv", "parquet", as asked for now.

    Raises
    ------
    SceneError
        If one is not.
    """

    def __init__(self, folder: Path | None, done: Sequence[Outcome], kinds: Sequence[str] = ()) -> None:
        self._folder = folder
        self._kinds = tuple(kinds)
        self._kept: set[str] = set()
        self._begun: set[Path] = set()
        for outcome in done if folder is not None else ():
            for part in outcome.products.values():
                if isinstance(part, Part):
                    self._check_kinds(part)
                    for path, digest in part.files:
                        self._check(path, digest)

    def _check_kinds(self, part: Part) -> None:
        had = {path.rpartition(".")[2] for path, _ in part.files}
        if self._kinds and had != set(self._kinds):
            raise SceneError(
                f"the interrupted run in {self._folder} wrote {part.name} as {', '.join(sorted(had))}, and now files = "
                f"{list(self._kinds)} are asked for; add --fresh to start anew"
            )

    def _check(self, path: str, digest: str) -> None:
        assert self._folder is not None
        try:
            data = (self._folder / path).read_bytes()
        except OSError:
            data = b""
        if hashlib.sha256(data).hexdigest() != digest:
            raise SceneError(
                f"{self._folder / path} of the interrupted run is missing or changed; add --fresh to start anew"
            )
        self._kept.add(path)

    def write(self, files: Mapping[str, bytes]) -> None:
        """Write files; the first time in a folder, parts of older runs are removed.

        Raises
        ------
        SceneError
            If the folder cannot be written.
        """
        if self._folder is None:
            return
        with writing(f"into {self._folder}", REMEDY, SceneError):
            for path, data in files.items():
                place = self._folder / path
                if place.parent not in self._begun:
                    self._begin(place.parent)
                write_whole(place, data)

    def _begin(self, folder: Path) -> None:
        assert self._folder is not None
        folder.mkdir(parents=True, exist_ok=True)
        for old in folder.glob("part-*.*"):
            if str(old.relative_to(self._folder).as_posix()) not in self._kept:
                old.unlink()
        self._begun.add(folder)
