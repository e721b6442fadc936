"""What a run keeps: outcomes of candidates as lines of a journal, columns as CSV and Parquet, whole or not at all."""

from __future__ import annotations

import csv
import dataclasses
import hashlib
import io
import json
import math
import os
import tempfile
import typing
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import replace
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Any

from graphsynth.core.errors import FormatError, GraphsynthError, SceneError
from graphsynth.core.journal import Journal, Work, digest_of, writing
from graphsynth.pipeline import products
from graphsynth.pipeline.products import Columns, Outcome, Part, Quantity, Record

if TYPE_CHECKING:
    from graphsynth.pipeline.scene import Scene
    from graphsynth.pipeline.stages import Report
    from graphsynth.pipeline.system import Stage

_TAG = "~"  # names the dataclass, or "number" for one that JSON has no sign for
_CLASSES: dict[str, type] = {
    name: getattr(products, name)
    for name in ("Finding", "Objective", "Outcome", "Part", "Picture", "Quantity", "Ranking", "Record", "Table")
}


def encode(value: object) -> str:
    """Return a value as one line of JSON, the same for equal values.

    Text, numbers, booleans, None, lists, tuples, dictionaries with text keys, numpy scalars, and the frozen dataclasses
    of `graphsynth.pipeline.products`, nested; a `SceneError` names the type of anything else.

    >>> encode({"b": (1, 2.5), "a": float("inf")})
    '{"a": {"is": "inf", "~": "number"}, "b": [1, 2.5]}'
    """
    return json.dumps(_plain(value), ensure_ascii=False, sort_keys=True, allow_nan=False)


def _plain(value: Any) -> Any:
    if value is None or isinstance(value, str | bool | int):
        return value
    if isinstance(value, float):
        return float(value) if math.isfinite(value) else {_TAG: "number", "is": repr(float(value))}
    if type(value).__name__ in _CLASSES and type(value) is _CLASSES[type(value).__name__]:
        fields = {f.name: _plain(getattr(value, f.name)) for f in dataclasses.fields(typing.cast(Any, value))}
        return {_TAG: type(value).__name__, **fields}
    if isinstance(value, Mapping) and all(isinstance(key, str) and key != _TAG for key in value):
        return {key: _plain(inner) for key, inner in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(inner) for inner in value]
    if getattr(value, "shape", None) == () and hasattr(value, "item"):
        return _plain(value.item())
    raise SceneError(
        f"a stage for each candidate gave a {type(value).__name__}, which cannot be kept as text; give text, numbers, "
        "tuples, dictionaries with text keys, or the dataclasses of graphsynth.pipeline.products"
    )


def decode(line: str) -> Any:
    """Return the value of a line; lists come back as tuples. A `FormatError` refuses what `encode` does not write.

    >>> decode(encode({"b": [1, float("-inf")]}))
    {'b': (1, -inf)}
    """
    try:
        return _value(json.loads(line))
    except (ValueError, TypeError, KeyError, RecursionError) as error:
        raise FormatError(f"not a line of results: {type(error).__name__}: {error}") from None


def _value(plain: Any) -> Any:
    if isinstance(plain, list):
        return tuple(map(_value, plain))
    if not isinstance(plain, dict):
        return plain
    tag = plain.get(_TAG)
    inner = {key: _value(value) for key, value in plain.items() if key != _TAG}
    if tag is None:
        return inner
    return float(inner["is"]) if tag == "number" else _CLASSES[tag](**inner)


#: Name of the file in the report folder.
JOURNAL = "candidates.jsonl"

_COMPLETE = '{"complete": true}'
_REPORTED = '{"reported": true}'


def signature(scene: Scene, stages: Sequence[Stage], kept: Sequence[str]) -> str:
    """Digest of all that the lines of a journal depend on: the question, the stages, the version of graphsynth.

    Titles, budgets, outputs and the limit on the number of candidates may change between runs.
    """
    structure = scene.structure
    if structure is not None:
        least = structure.generate.sample or 1  # any limit that is allowed
        structure = replace(structure, generate=replace(structure.generate, limit=least))
    return digest_of(
        scene.scene.seed,
        repr(scene.mechanism),
        repr(structure),
        scene.budget.boxes,
        [(stage.name, stage.function) for stage in stages],
        list(kept),
    )


def _work(scene: str, digest: str) -> Work:
    foreign = "holds an interrupted run of another question or version"
    remedy = f"add --fresh to start anew, or {REMEDY}"
    return Work("run", scene, digest, "candidate", foreign, remedy, REMEDY, error=SceneError)


class Candidates(Journal):
    """The journal of one run: outcomes of candidates; without a path nothing is kept on disk.

    `scene` is its name, for people; `signature` that of this run: a file of another unfinished run is refused unless
    `fresh` replaces whatever is there. `done` holds what an interrupted run had written. A `SceneError` says that the
    file belongs to another unfinished run or another process writes it, a `FormatError` that it is no file of results.
    """

    def __init__(self, path: Path | None, scene: str, signature: str, fresh: bool = False) -> None:
        if path is not None:
            with writing(path, REMEDY, SceneError):
                path.parent.mkdir(parents=True, exist_ok=True)
        super().__init__(path, _work(scene, signature), lambda entries: entries[-1:] == [_REPORTED], fresh)
        if self.entries[-1:] == (_COMPLETE,):
            self.keep(len(self.entries) - 1)  # there may be more candidates now
        self.done = tuple(self._outcome(number, entry) for number, entry in enumerate(self.entries, 1))

    def complete(self) -> None:
        """Say that no more candidates come."""
        self.append(_COMPLETE)

    def _outcome(self, number: int, entry: str) -> Outcome:
        try:
            outcome = decode(entry)
        except FormatError:
            outcome = None
        if not isinstance(outcome, Outcome) or outcome.number != number:
            self.close()
            raise FormatError(f"not the result of candidate {number}; {self.work.remedy}", str(self.path))
        return outcome


def mark_reported(path: Path) -> None:
    """Say in a journal that all its candidates are reported: the next run starts anew; an unfinished one stays.

    A run that is stopped between its last candidate and its report goes on from there, too.
    """
    try:
        with path.open("rb") as stream:
            head = json.loads(stream.readline())
        with Journal(path, _work(head["title"], head["question"])) as journal:
            if journal.entries[-1:] == (_COMPLETE,):
                journal.append(_REPORTED)
    except (FileNotFoundError, ValueError, LookupError, TypeError, GraphsynthError):
        return  # a scene without candidates; or another process has begun to go on with it, and will report


#: What to do where a report folder cannot be written.
REMEDY = "choose another folder with -o"


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
    """Make sure that a report can be written into a folder, and leave everything as it was; a `SceneError` if not."""
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
    """Take the columns out of an outcome: each becomes a `Part`, and the files to be written come besides."""
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

    Files of the outcomes `done`, taken over from an interrupted run, must be there, unchanged, and of the kinds ("csv",
    "parquet") that are asked for now: a `SceneError` if not.
    """

    def __init__(self, folder: Path | None, done: Sequence[Outcome], kinds: Sequence[str] = ()) -> None:
        self._folder = folder
        self._kept: set[str] = set()
        self._begun: set[Path] = set()
        for outcome in done if folder is not None else ():
            for part in outcome.products.values():
                if not isinstance(part, Part):
                    continue
                had = {path.rpartition(".")[2] for path, _ in part.files}
                if kinds and had != set(kinds):
                    raise SceneError(
                        f"the interrupted run in {folder} wrote {part.name} as {', '.join(sorted(had))}, and now files "
                        f"= {list(kinds)} are asked for; add --fresh to start anew"
                    )
                for path, digest in part.files:
                    self._check(path, digest)

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
        """Write files; the first time in a folder, parts of older runs are removed."""
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


def check_files(scene: Scene) -> None:
    """Refuse, before anything runs, Parquet where this installation lacks pyarrow: a `SceneError`."""
    if "parquet" in scene.outputs.files and find_spec("pyarrow") is None:
        raise (scene.place / "outputs" / "files").error(
            "asks for Parquet, which needs pyarrow: install graphsynth[parquet], or take it out"
        )


def data_files(report: Report) -> dict[str, bytes]:
    """Return the data files of a report by name: ``results`` of its records, one for each `Columns`."""
    found: dict[str, Mapping[str, Any]] = {}
    if report.products.get("records"):
        found["results"] = results_table(report.products["records"])
    for value in report.products.values():
        for item in value if isinstance(value, tuple) else (value,):
            if isinstance(item, Columns):
                found[item.name] = item.columns
    kinds = report.scene.outputs.files
    return {file: data for name, columns in found.items() for file, data in column_files(name, columns, kinds).items()}


def column_files(name: str, columns: Mapping[str, Any], kinds: Sequence[str]) -> dict[str, bytes]:
    """Return columns as files of the kinds asked for: name with its ending, to the content."""
    made = {}
    for kind in kinds:
        if kind == "csv":
            text = io.StringIO()
            writer = csv.writer(text)
            writer.writerow(columns)
            lists = [values.tolist() if hasattr(values, "tolist") else values for values in columns.values()]
            writer.writerows(zip(*lists, strict=True))
            made[f"{name}.csv"] = text.getvalue().encode()
            continue
        import pyarrow
        from pyarrow import parquet

        stream, arrays = io.BytesIO(), {header: pyarrow.array(values) for header, values in columns.items()}
        parquet.write_table(pyarrow.table(arrays), stream)
        made[f"{name}.{kind}"] = stream.getvalue()
    return made


def results_table(records: Sequence[Record]) -> dict[str, list[Any]]:
    """Return the records by the column: one row per candidate, three columns per margin.

    For a margin ``m`` the columns are ``m [unit]``, ``m guarantee`` and ``m error [unit]``; None means not computed.
    """
    first = ("number", "key", "solution", "status", "recognised_as", "verdict")
    columns = {name.replace("_", " "): [getattr(record, name) for record in records] for name in first}
    units: dict[str, str] = {}
    for record in records:
        for margin in record.margins:
            units.setdefault(margin.name, f" [{margin.unit}]" if margin.unit else "")
    found: list[dict[str, Quantity]] = [{m.name: m for m in record.margins} for record in records]
    for name, unit in units.items():
        margins = [have.get(name) for have in found]
        columns[f"{name}{unit}"] = [None if m is None else float(m.value) for m in margins]
        columns[f"{name} guarantee"] = [None if m is None else m.guarantee for m in margins]
        columns[f"{name} error{unit}"] = [None if m is None or m.error is None else float(m.error) for m in margins]
    columns["reason"] = [r.reason for r in records]
    return columns
