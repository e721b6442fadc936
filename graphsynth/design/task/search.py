"""The search: waves of small pieces over chains and assembly modes; good chains get more, the best are judged.

A piece depends on the task, its plan and its number only, so that any executor gives the same answers.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass, replace
from time import perf_counter
from typing import NamedTuple

import numpy as np

from graphsynth.core.checks import positive, whole
from graphsynth.core.errors import GeometryError, GraphsynthError
from graphsynth.core.ordered import in_order
from graphsynth.core.shown import Shown
from graphsynth.design.task.answers import Candidate, DesignedMechanism, built, judged, proved, signature
from graphsynth.design.task.descend import best, descend
from graphsynth.design.task.impossible import proof
from graphsynth.design.task.model import Model
from graphsynth.design.task.plans import Plan, plans
from graphsynth.design.task.problem import TaskProblem
from graphsynth.design.task.starts import Starts, own_starts, placed_starts, random_starts
from graphsynth.design.task.task import DesignTask

#: First candidates of a piece; kept at each stage, and iterations there: with bounds weak, then strict.
_FIRST = 600
_STAGES = ((80, 0.2, 8), (25, 0.2, 15), (6, 3.0, 40))
#: Pieces of a wave, of which so many go to the best plans so far; waves by the number of links.
_WAVE, _AGAIN, _WAVES = 8, 4, {4: 4, 6: 8, 8: 16, 10: 16}
#: Candidates of a piece that are kept; lengths that differ by less, over the size, are near copies.
_KEPT, _ALIKE = 2, 0.02
#: Candidates judged after each wave, for each answer asked.
_JUDGED = 3


class Piece(NamedTuple):
    """A part of the search."""

    task: DesignTask
    plan: Plan
    number: int
    seed: int
    starts: Starts | None


class Progress(NamedTuple):
    """How far a search is: pieces done, the best error in tolerances, mechanisms accepted, seconds."""

    pieces: int
    error: float
    accepted: int
    seconds: float


@dataclass(frozen=True, eq=False, repr=False)
class Designs(Shown):
    """What was found for a task, the best first.

    Attributes
    ----------
    task : DesignTask
    answers : tuple of DesignedMechanism
        Accepted ones, no near copies, ranked; if there are none the nearest that were found.
    rejected : dict of str to int
        Why others were rejected, counted.
    impossible : str
        Why no mechanism can do the task (a proof); empty if there is no such proof.
    statement : str
    pieces : int
        Parts of the search that were done.
    seconds : float
    seed : int
    """

    task: DesignTask
    answers: tuple[DesignedMechanism, ...]
    rejected: Mapping[str, int]
    impossible: str
    statement: str
    pieces: int
    seconds: float
    seed: int

    @property
    def accepted(self) -> bool:
        """Whether at least one mechanism does the task."""
        return any(answer.accepted for answer in self.answers)

    def __len__(self) -> int:
        return len(self.answers)

    def __getitem__(self, index: int) -> DesignedMechanism:
        return self.answers[index]

    def _told(self) -> tuple[str, list[tuple[str, str]]]:
        rows = []
        for k, a in enumerate(self.answers, 1):
            errors = ", ".join(f"{error:.3g}" for error in a.errors)
            word = "" if a.accepted else f"; {'; '.join(a.reasons)}"
            rows.append(
                (f"{k}", f"{a.links} links, errors {errors}, transmission {math.degrees(a.transmission):.0f} deg{word}")
            )
        return self.statement, rows

    def _picture(self) -> str:
        return self.answers[0]._picture() if self.answers else ""


def design(
    task: DesignTask,
    *,
    seconds: float = 60.0,
    seed: int = 0,
    count: int = 5,
    executor: Executor | None = None,
    starts: Starts | None = None,
    progress: Callable[[Progress], None] | None = None,
) -> Designs:
    """Find mechanisms that do a task: chains, dimensions and places, ranked and without near copies.

    Parameters
    ----------
    task : DesignTask
    seconds : float
        Time limit of the search; it ends before where enough answers were found or all waves are done.  The answers are
        then judged and certified.
    seed : int
        Same task and seed, same answers, for any executor, unless the time limit cuts the search short.
    count : int
        Answers wanted.
    executor : concurrent.futures.Executor, optional
        Who does the pieces; this process by default.
    starts : callable, optional
        Mechanisms to begin with besides random ones: see `graphsynth.design.task.starts.Starts`.
    progress : callable, optional
        Told a `Progress` after each piece.

    Returns
    -------
    Designs
        Every answer is simulated anew, and its motion certified where that succeeds.  Ctrl-C gives the best so far.

    Raises
    ------
    GeometryError
        A task that no chain fits: more pivots than links on the frame can hold, names without a link.

    Notes
    -----
    See docs/explanation/embodiment.md, "Many targets at once".

    Examples
    --------
    >>> from graphsynth.design import PathTarget
    >>> task = DesignTask(targets=[PathTarget.segment((0, 0), (4, 0), count=12)], links=[4])
    >>> found = design(task, count=1)
    >>> found.accepted, found[0].links, found[0].errors[0] < 0.01
    (True, 4, True)
    """
    if not isinstance(task, DesignTask):
        raise GeometryError(f"{type(task).__name__} is not a DesignTask; give one")
    positive("seconds", seconds)
    whole("count", count, 1, 1000)
    run = _Run(task, seed, count, perf_counter(), seconds, starts)
    impossible = proof(task)
    if not impossible:
        try:
            run.search(executor, progress)
        except KeyboardInterrupt:
            run.stopped = "interrupted"
    return run.result(impossible)


class _Run:
    """One call: candidates found, those judged, reasons counted."""

    def __init__(
        self, task: DesignTask, seed: int, count: int, begin: float, seconds: float, starts: Starts | None
    ) -> None:
        self.task, self.seed, self.count, self.begin, self.starts = (
            task,
            whole("seed", seed, 0, 2**63),
            count,
            begin,
            starts,
        )
        self.deadline = begin + seconds
        self.found: list[Candidate] = []
        self.judged: dict[int, DesignedMechanism] = {}
        self.reasons: Counter[str] = Counter()
        self.pieces, self.stopped = 0, ""

    def search(self, executor: Executor | None, progress: Callable[[Progress], None] | None) -> None:
        """Go through the numbers of links, the smallest first, until there are enough answers."""
        fits = False
        for links in self.task.links:
            every = list(plans(self.task, links))
            random = np.random.default_rng([self.seed, links])
            random.shuffle(every)
            for wave in range(_WAVES[links] if every else 0):
                fits = True
                self._wave(self._chosen(every, wave), executor, progress)
                if self.stopped or self._enough():
                    return
        if not fits:
            raise GeometryError(
                f"no chain of {' or '.join(map(str, self.task.links))} links fits the task: too many pivots are given, "
                "or no link is free to carry a named point; allow more links"
            )

    def _chosen(self, every: Sequence[Plan], wave: int) -> list[Plan]:
        """Return the plans of a wave: new ones in turn, and those that came nearest so far."""
        fresh = _WAVE if wave == 0 else _WAVE - _AGAIN
        begun = 0 if wave == 0 else _WAVE + (wave - 1) * fresh
        new = [every[k % len(every)] for k in range(begun, begun + fresh)]
        if wave == 0:
            return new
        order: dict[int, None] = {}
        of_chain = {id(plan) for plan in every}
        for candidate in sorted(self.found, key=lambda c: c.error):
            if id(candidate.plan) in of_chain:
                order.setdefault(id(candidate.plan))
        by_id = {id(plan): plan for plan in every}
        good = [by_id[k] for k in order][: _AGAIN // 2] or list(every)
        return [*new, *(good[k % len(good)] for k in range(_AGAIN))]

    def _wave(
        self, chosen: Sequence[Plan], executor: Executor | None, progress: Callable[[Progress], None] | None
    ) -> None:
        """Do a piece for every plan, and judge what came of them."""
        begun = [Piece(self.task, plan, self.pieces + k, self.seed, self.starts) for k, plan in enumerate(chosen)]
        results = in_order(executor, worked, begun)
        try:
            for piece, (found, reasons) in zip(begun, results):
                self.found += [candidate._replace(plan=piece.plan) for candidate in found]
                self.reasons.update(reasons)
                self.pieces += 1
                if progress is not None:
                    least = min((c.error for c in self.found), default=math.inf)
                    good = sum(answer.accepted for answer in self.judged.values())
                    progress(Progress(self.pieces, least, good, perf_counter() - self.begin))
                if perf_counter() > self.deadline:
                    self.stopped = "the time limit was reached"
                    break
        finally:
            results.close()
        self._judge()

    def _judge(self) -> None:
        """Judge the best candidates that were not judged yet."""
        self.found.sort(key=lambda candidate: candidate.error)
        for candidate in self.found[: _JUDGED * self.count]:
            if id(candidate) not in self.judged:
                self.judged[id(candidate)] = judged(self.task, candidate)

    def _ranked(self) -> list[DesignedMechanism]:
        """Return what was judged, accepted ones first, without near copies."""
        kept: list[DesignedMechanism] = []
        marks: list[np.ndarray] = []
        for answer in sorted(self.judged.values(), key=lambda a: (not a.accepted, a.score)):
            mark = signature(answer)
            same = any(
                other.key == answer.key and len(own) == len(mark) and np.abs(own - mark).max() < _ALIKE * self.task.size
                for other, own in zip(kept, marks)
            )
            if not same:
                kept.append(answer)
                marks.append(mark)
        return kept

    def _enough(self) -> bool:
        return sum(answer.accepted for answer in self._ranked()) >= self.count

    def result(self, impossible: str) -> Designs:
        """Rank, certify, and say what was found."""
        if not self.judged:
            self._judge()
        every = self._ranked()
        good = [answer for answer in every if answer.accepted]
        chosen = (good or every)[: self.count]
        chosen = [replace(a, certificate=proved(a, self.task.span)) if a.accepted else a for a in chosen]
        for answer in self.judged.values():
            self.reasons.update(answer.reasons)
        if good:
            proofs = sum(answer.certified for answer in chosen)
            text = f"{len(chosen)} mechanisms do the task, {proofs} with a motion that is certified over its range"
            text = text.replace("1 mechanisms do", "1 mechanism does")
        elif impossible:
            text = f"impossible: {impossible}"
        else:
            text = "no mechanism was found that does the task, which does not prove that there is none"
        if self.stopped:
            text += f" ({self.stopped})"
        return Designs(
            self.task,
            tuple(chosen),
            {reason: count for reason, count in self.reasons.most_common() if count},
            impossible,
            text,
            self.pieces,
            perf_counter() - self.begin,
            self.seed,
        )


def worked(piece: Piece) -> tuple[list[Candidate], dict[str, int]]:
    """Do one piece: begin with many candidates, keep the best, improve them; return the best and what failed."""
    random = np.random.default_rng([piece.seed, piece.number])
    sense = int(random.choice([-1, 1]))
    try:
        model = Model(piece.task, piece.plan, sense, random)
        if not model.regular:
            return [], {"the chain cannot be assembled": 1}
        problem = TaskProblem(model)
        first = random_starts(model, _FIRST, random)
        X, times = placed_starts(problem, first, _STAGES[0][0], random)
        if piece.starts is not None:
            for own in own_starts(model, piece.starts(piece.task, piece.plan, random)):
                more, later = placed_starts(problem, own, 1, random)
                if len(more):
                    X = np.concatenate([more, X])
                    times = [np.concatenate([a, b]) for a, b in zip(later, times)]
    except GraphsynthError:
        return [], {"the chain cannot be moved": 1}
    reasons = {"first candidates: the range is not completed": _FIRST - len(X)} if len(X) < _STAGES[0][0] else {}
    if not len(X):
        return [], reasons
    found = None
    for keep, strict, iterations in _STAGES:
        if found is not None:
            found = best(found, keep)
            X, times = found.X, found.times
        if not len(X):
            return [], reasons
        found = descend(problem, X, strict, iterations, times)
    assert found is not None
    candidates = []
    for x, error in zip(found.X[:_KEPT], found.error):
        try:
            mechanism, starts = built(problem, x)
        except GraphsynthError:
            continue
        candidates.append(Candidate(float(error), piece.plan, mechanism, starts))
    return candidates, reasons
