"""``candidates.jsonl``: one line per candidate, written as it comes; an interrupted run goes on from it.

Behind the candidates one line says that no more come, and the last one that the report of them is written.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from graphsynth.core.errors import FormatError, GraphsynthError, SceneError
from graphsynth.core.journal import Journal, Work, digest_of, writing
from graphsynth.pipeline.codec import decode
from graphsynth.pipeline.parts import REMEDY
from graphsynth.pipeline.products import Outcome

if TYPE_CHECKING:
    from graphsynth.pipeline.scene import Scene
    from graphsynth.pipeline.stages import Stage

__all__ = ["JOURNAL", "Candidates", "mark_reported", "signature"]

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
    """The journal of one run; without a path nothing is kept on disk.

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
        If the file belongs to another unfinished run, or another process writes it.
    FormatError
        If it is not a file of results.
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
