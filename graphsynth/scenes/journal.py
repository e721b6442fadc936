"""``candidates.jsonl``: one line per candidate, written as it comes; an interrupted run goes on from it.

The first line says which run it is; behind the candidates one line says that no more come, and the last one that the
report of them is written.  Lines are only appended, in the order of the candidates, so whatever stops a run, all whole
lines are valid; a torn last line is cut off.
"""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from types import TracebackType
from typing import TYPE_CHECKING, Any

import graphsynth
from graphsynth.errors import FormatError, SceneError
from graphsynth.scenes.codec import decode
from graphsynth.scenes.parts import unwritable
from graphsynth.scenes.products import Outcome

if TYPE_CHECKING:
    from graphsynth.scenes.scene import Scene
    from graphsynth.scenes.stages import Stage

__all__ = ["JOURNAL", "Journal", "mark_reported", "signature"]

#: Name of the file in the report folder.
JOURNAL = "candidates.jsonl"

_COMPLETE = {"complete": True}
_REPORTED = {"reported": True}


def signature(scene: Scene, stages: Sequence[Stage], kept: Sequence[str]) -> str:
    """Digest of all that the lines of a journal depend on: the question, the stages, the version of graphsynth.

    Titles, budgets, outputs and the limit on the number of candidates may change between runs.
    """
    structure = scene.structure
    if structure is not None:
        least = structure.generate.sample or 1  # any limit that is allowed
        structure = replace(structure, generate=replace(structure.generate, limit=least))
    content = {
        "version": graphsynth.__version__,
        "seed": scene.scene.seed,
        "mechanism": repr(scene.mechanism),
        "structure": repr(structure),
        "boxes": scene.budget.boxes,
        "stages": [(stage.name, stage.function) for stage in stages],
        "kept": list(kept),
    }
    return hashlib.sha256(json.dumps(content, sort_keys=True).encode()).hexdigest()


class Journal:
    """The file of results of one run; without a path nothing is kept on disk.

    Parameters
    ----------
    path : Path or None
        The file.
    scene : str
        Name of the scene, for people.
    signature : str
        Of this run; a file of another unfinished run is refused.
    fresh : bool
        Replace whatever is there.

    Attributes
    ----------
    done : tuple of Outcome
        What an interrupted run had written.

    Raises
    ------
    SceneError
        If the file belongs to another unfinished run.
    FormatError
        If it is not a file of results.
    """

    def __init__(self, path: Path | None, scene: str, signature: str, fresh: bool = False) -> None:
        self.path = path
        self.done: tuple[Outcome, ...] = ()
        self._stream: Any = None
        if path is None:
            return
        kept = 0
        if path.exists() and not fresh:
            kept, self.done = _read(path, signature)
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            self._stream = path.open("r+b" if kept else "wb")
        except OSError as error:
            raise unwritable(str(path), error) from error
        self._stream.seek(kept)
        self._stream.truncate()
        if not kept:
            self._write({"results of": scene, "signature": signature})

    def append(self, line: str) -> None:
        """Write one encoded outcome; it is in the file when this returns.

        Raises
        ------
        SceneError
            If it cannot be written, such as on a full disk; what is there stays, and the same command goes on from it.
        """
        if self._stream is not None:
            try:
                self._stream.write(line.encode() + b"\n")
                self._stream.flush()
            except OSError as error:
                raise unwritable(str(self.path), error) from error

    def complete(self) -> None:
        """Say that no more candidates come."""
        if self._stream is not None:
            self._write(_COMPLETE)

    def _write(self, content: dict[str, Any]) -> None:
        self.append(json.dumps(content, sort_keys=True))

    def __enter__(self) -> Journal:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        if self._stream is not None:
            with suppress(OSError):  # of a full disk: told when the line was appended
                self._stream.close()


def mark_reported(path: Path) -> None:
    """Say in a journal that all its candidates are reported: the next run starts anew; an unfinished one stays.

    A run that is stopped between its last candidate and its report goes on from there, too.
    """
    if not path.is_file():
        return
    with path.open("r+b") as stream:
        size = stream.seek(0, os.SEEK_END)
        end = _line(_COMPLETE)
        stream.seek(max(0, size - len(end)))
        if stream.read() == end:
            stream.write(_line(_REPORTED))


def _line(content: dict[str, Any]) -> bytes:
    return json.dumps(content, sort_keys=True).encode() + b"\n"


def _read(path: Path, signature: str) -> tuple[int, tuple[Outcome, ...]]:
    """Return how many bytes of a journal to keep, and the outcomes in them; nothing of a reported one."""
    remedy = "; add --fresh to start anew, or choose another folder with --out"
    data = path.read_bytes()
    lines = data[: data.rfind(b"\n") + 1].splitlines()
    if not lines:
        return 0, ()
    head = _json(lines[0])
    if not isinstance(head, dict) or "signature" not in head:
        raise FormatError(f"not a file of results{remedy}", str(path))
    if _json(lines[-1]) == _REPORTED:
        return 0, ()
    if _json(lines[-1]) == _COMPLETE:
        lines.pop()
    if head["signature"] != signature:
        raise SceneError(f"{path} holds an interrupted run of another question or version{remedy}")
    outcomes = []
    for number, line in enumerate(lines[1:], 1):
        outcome = _outcome(line)
        if outcome is None or outcome.number != number:
            raise FormatError(f"not the result of candidate {number}{remedy}", f"{path}, line {number + 1}")
        outcomes.append(outcome)
    return sum(len(line) + 1 for line in lines), tuple(outcomes)


def _json(line: bytes) -> Any:
    try:
        return json.loads(line)
    except (ValueError, RecursionError):
        return None


def _outcome(line: bytes) -> Outcome | None:
    try:
        value = decode(line.decode())
    except (FormatError, UnicodeDecodeError):
        return None
    return value if isinstance(value, Outcome) else None
