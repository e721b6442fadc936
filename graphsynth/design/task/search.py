"""The search: waves of small pieces over chains and assembly modes; good chains get more, the best are judged.

A piece depends on the task, its plan and its number only, so that any executor gives the same answers.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import Executor
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import partial
from itertools import cycle, islice
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from graphsynth.core.checks import positive, whole
from graphsynth.core.errors import GeometryError, GraphsynthError
from graphsynth.core.limits import Clock, here, told
from graphsynth.core.ordered import in_order
from graphsynth.core.shown import Shown
from graphsynth.design.task.answers import Candidate, Chain, DesignedMechanism, Origin, built, judged, proved, signature
from graphsynth.design.task.descend import Descended, best, descend
from graphsynth.design.task.growth import grown, promised
from graphsynth.design.task.impossible import proof
from graphsynth.design.task.model import Model, Unknowns
from graphsynth.design.task.plans import Plan, plans
from graphsynth.design.task.problem import TaskProblem
from graphsynth.design.task.settle import levelled, settled
from graphsynth.design.task.starts import Starts, from_mechanism, placed_starts, planned, random_starts, shaken
from graphsynth.design.task.targets import PathTarget
from graphsynth.design.task.task import DesignTask

Array = NDArray[np.float64]

#: First candidates of a piece; kept at each stage, and iterations there: with bounds weak, then strict.
_FIRST = 1200
Stages = tuple[tuple[int, float, int], ...]
_STAGES: Stages = ((80, 0.2, 8), (25, 0.2, 15), (6, 3.0, 40))
#: Of more mechanisms to begin with than these, so many in each wave get a glance; the other pieces go on from the best.
_MANY, _GLANCES = 16, 6
_GLANCE: Stages = ((4, 0.2, 12), (1, 1.0, 6))
_ONWARD: Stages = ((24, 0.2, 10), (6, 1.0, 15), (2, 3.0, 20))
#: Larger mechanisms that are looked at, and what becomes of them.
_DYADS, _GROWING = 96, ((8, 0.2, 12), (3, 1.0, 15), (2, 3.0, 20))
#: How much directions count beside distances where outlines are drawn: at first, in the last stage.
_TURNED = 0.5, 0.05
#: Points at most of a path without times before the last stage; errors, in tolerances, of answers that miss the task
#: below which the largest error is made small in the end.
_FEW, _EVEN = 24, 10.0
#: Copies of a mechanism to begin with, and by how much they are shaken, over the size: powers of ten.
_COPIES, _SHAKEN = 80, (-2.5, -0.4)
#: Pieces of a wave, of which so many go on from the best; waves in each round by the number of links.
_WAVE, _AGAIN, _WAVES = 8, 4, {4: 2, 6: 4, 8: 6, 10: 6}
#: By how much a candidate's error counts more for each time that the search went on from it in vain.
_TIRED = 1.1
#: Waves without another answer after which a search rests that has some.
_IDLE = 6
#: Candidates of a piece that are kept; mechanisms whose lengths differ by less, all of them, are near copies.
_KEPT, _ALIKE = 2, 0.1
#: Candidates judged after each wave, for each answer asked; at once if their error is less, in tolerances.
_JUDGED, _NEAR = 3, 2.0
#: The same of outlines, which few mechanisms draw exactly.
_OUTLINED = 0.3


class Begun(NamedTuple):
    """What a piece begins with: a plan and random candidates, a mechanism, or the best so far of another piece.

    ``grows``: with a dyad more.
    """

    origin: Origin
    parent: Array | None = None
    stages: Stages = _STAGES
    grows: bool = False


class Piece(NamedTuple):
    """A part of the search."""

    task: DesignTask
    seed: int
    number: int
    begun: Begun


class Progress(NamedTuple):
    """How far a search is: pieces done, the best error in tolerances, mechanisms accepted, seconds, the best so far."""

    pieces: int
    error: float
    accepted: int
    seconds: float
    answers: tuple[DesignedMechanism, ...] = ()


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
    processor_seconds: float | None = None,
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
        Time limit of the search; it ends before where enough answers were found, or some and long no other.  They
        are then certified.
    processor_seconds : float, optional
        Limit of the processor time of the search, that of all workers together; a busy machine does not change what it
        allows.
    seed : int
        Same task and seed, same answers, for any executor, unless a time limit cuts the search short.
    count : int
        Answers wanted.
    executor : concurrent.futures.Executor, optional
        Who does the pieces; this process by default.
    starts : callable, optional
        Mechanisms to begin with, for example from a `CurveIndex`: see `graphsynth.design.task.starts.Starts`.
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
    whole("count", count, 1, 1000)
    limits = positive("seconds", seconds), math.inf
    if processor_seconds is not None:
        limits = limits[0], positive("processor_seconds", processor_seconds)
    run = _Run(task, whole("seed", seed, 0, 2**63), count, starts, Clock(*limits))
    impossible = proof(task)
    if not impossible:
        try:
            run.search(executor, progress)
        except KeyboardInterrupt:
            run.stopped = "interrupted"
    return run.result(impossible)


class _Run:
    """One call: candidates found, those judged, reasons counted."""

    def __init__(self, task: DesignTask, seed: int, count: int, starts: Starts | None, clock: Clock) -> None:
        self.task, self.seed, self.count, self.starts, self.clock = task, seed, count, starts, clock
        self.found: list[Candidate] = []
        self.judged: dict[int, tuple[Candidate, DesignedMechanism]] = {}
        self.reasons: Counter[str] = Counter()
        self.pieces, self.stopped = 0, ""
        self.tries: Counter[tuple[Chain, float]] = Counter()
        self.outlines = any(isinstance(target, PathTarget) and target.outline for target in task.targets)
        self.turned = _TURNED[1] if self.outlines else 0.0  # in the last stage; open paths there at exact points
        self.near, self.even = (_OUTLINED, _OUTLINED) if self.outlines else (_NEAR, _EVEN)
        self.grows = not task.mirrored and any(isinstance(target, PathTarget) for target in task.targets)
        self.levels = any(not (isinstance(target, PathTarget) and target.mean) for target in task.targets)
        self.before, self.idle = 0, 0  # accepted before the last wave, waves without another one

    def search(self, executor: Executor | None, progress: Callable[[Progress], None] | None) -> None:
        """Go round by the numbers of links, the smallest first, until there are enough answers or no time is left."""
        begun = planned(self.task, self.starts, min(self.clock.seconds, self.clock.processor))
        given = [Origin(plan, k, mechanism) for k, (plan, mechanism) in enumerate(begun)]
        many = len(given) > _MANY
        for k in range(0, len(given), _GLANCES if many else _WAVE):
            some = [Begun(origin) for origin in given[k : k + (_GLANCES if many else _WAVE)]]
            if many:
                some = [own._replace(stages=_GLANCE) for own in some]
                some += [*self._again(1, _ONWARD), *self._again(1, _GROWING, True)]
            if self._wave(some, executor, progress):
                return
        fresh: dict[int, Iterator[Plan]] = {}
        for links in cycle([n for n in self.task.links for _ in range(_WAVES[n])]):
            again = self._again((_WAVE if many else _AGAIN) // 2, _GROWING, True) if self.grows else []
            more = _WAVE - 1 if many else _AGAIN
            again += self._again(more - len(again), _ONWARD if many else _STAGES)
            if links not in fresh:
                fresh[links] = self._plans(links)
            new = [Begun(Origin(plan, -1, None)) for plan in islice(fresh[links], _WAVE - len(again))]
            if not (new or again) and len(fresh) == len(self.task.links):
                raise GeometryError(
                    f"no chain of {' or '.join(map(str, self.task.links))} links fits the task: too many pivots are "
                    "given, or no link is free to carry a named point; allow more links"
                )
            if self._wave([*new, *again], executor, progress):
                return

    def _plans(self, links: int) -> Iterator[Plan]:
        """Yield all plans with so many links for ever, in an order of chance."""
        found = list(plans(self.task, links))
        np.random.default_rng([self.seed, links]).shuffle(found)
        return cycle(found)

    def _again(self, count: int, stages: Stages, grows: bool = False) -> list[Begun]:
        """Go on from the best candidates so far, of different chains; those that do not come on have to wait.

        ``grows``: from those that may have a dyad more.
        """
        found: dict[Chain, Candidate] = {}
        most = max(self.task.links) - 2 if grows else math.inf
        for candidate in self.found:  # sorted
            if candidate.plan.design.graph.links <= most:
                found.setdefault(candidate.chain, candidate)
        turn = sorted(found.values(), key=lambda own: own.error * _TIRED ** self.tries[own.chain, own.error])[:count]
        for own in turn:
            self.tries[own.chain, own.error] += 1
        return [Begun(own.origin, own.x, stages, grows) for own in turn]

    def _wave(
        self,
        chosen: Sequence[Begun],
        executor: Executor | None,
        progress: Callable[[Progress], None] | None,
    ) -> bool:
        """Do a piece for each, judge what came of them, and tell whether that is enough."""
        begun = []
        for number, piece in enumerate(chosen, self.pieces):
            own = piece if piece.parent is not None else piece._replace(origin=piece.origin._replace(number=number))
            begun.append(Piece(self.task, self.seed, number, own))
        results = in_order(executor, partial(told, worked, here()), begun)
        try:
            for (found, reasons), spent in results:
                self.clock.elsewhere += spent
                self.found += found
                self.reasons.update(reasons)
                self.pieces += 1
                if found and found[0].error < self.near:
                    self._judge()
                if progress is not None:
                    least = min((c.error for c in self.found), default=math.inf)
                    good = sum(answer.accepted for _, answer in self.judged.values())
                    best = tuple(self._ranked()[: self.count])
                    progress(Progress(self.pieces, least, good, self.clock.passed, best))
                if limit := self.clock.over:
                    self.stopped = f"{limit} was reached"
                if self.stopped or self._enough():
                    return True
        finally:
            results.close()
        self._judge()
        good = self._accepted()
        self.idle = self.idle + 1 if good == self.before else 0
        self.before = good
        if good and self.idle >= _IDLE:
            self.stopped = f"no other was found in the last {_IDLE * _WAVE} pieces"
        return self._enough() or bool(self.stopped)

    def _accepted(self) -> int:
        return sum(answer.accepted for answer in self._ranked())

    def _enough(self) -> bool:
        return self._accepted() >= self.count

    def _judge(self) -> None:
        """Judge the best candidates that were not judged yet; those nearly good enough go to their optimum first."""
        self.found.sort(key=lambda candidate: candidate.error)
        for k, candidate in enumerate(self.found[: _JUDGED * self.count]):
            if id(candidate) not in self.judged:
                near = candidate.error < self.near and (k < self.count or not self.outlines)
                own = self.found[k] = self._settled(candidate) if near else candidate
                self.judged[id(own)] = own, judged(self.task, own)
                if near and own.error < 1.0:  # then the largest error may be small enough, too
                    self._level(own)

    def _last(self, candidate: Candidate) -> TaskProblem:
        """Return the problem of the last stage."""
        return TaskProblem(_modelled(self.task, self.seed, candidate.origin)[0], 0, self.turned)

    def _settled(self, candidate: Candidate) -> Candidate:
        """Return a candidate at its least sum of squares, its motion and bounds taken exactly."""
        with suppress(GraphsynthError):
            problem = self._last(candidate)
            x, error = settled(problem, candidate.x)
            error += float(problem.model.untransmitted(x[None])[0])
            if error < candidate.error:
                mechanism, starts = built(problem, x)
                return Candidate(error, candidate.origin, x, mechanism, starts)
        return candidate

    def _level(self, candidate: Candidate) -> None:
        """Make the largest error of a candidate small that was judged and missed a target; keep what is better."""
        _, answer = self.judged[id(candidate)]
        if answer.accepted or not self.levels:
            return
        with suppress(GraphsynthError):
            problem = self._last(candidate)
            x, error = levelled(problem, candidate.x)
            if not error < math.inf:
                return
            mechanism, starts = built(problem, x)
            other = judged(self.task, candidate._replace(x=x, mechanism=mechanism, starts=starts))
            if (len(other.reasons), other.score) < (len(answer.reasons), answer.score):
                self.judged[id(candidate)] = candidate, other

    def _ranked(self) -> list[DesignedMechanism]:
        """Return what was judged, accepted ones first, without near copies."""
        kept: list[DesignedMechanism] = []
        marks: list[np.ndarray] = []
        order = sorted((own for _, own in self.judged.values()), key=lambda a: (not a.accepted, not a.kept, a.score))
        for answer in order:
            mark = signature(self.task, answer)
            same = any(
                other.key == answer.key and len(own) == len(mark) and np.abs(own - mark).max() < _ALIKE
                for other, own in zip(kept, marks)
            )
            if not same:
                kept.append(answer)
                marks.append(mark)
        return kept

    def result(self, impossible: str) -> Designs:
        """Rank, certify, and say what was found."""
        if not self.judged:
            self._judge()
        nearest = self._ranked()[: self.count]
        if not any(answer.accepted for answer in nearest):
            for candidate in [
                own for own, answer in self.judged.values() if answer in nearest and own.error < self.even
            ]:
                own = candidate if candidate.error < self.near else self._settled(candidate)
                if own is not candidate:
                    self.judged[id(own)] = own, judged(self.task, own)
                    self.found.append(own)  # keeps its place among those judged
                self._level(own)
        every = self._ranked()
        good = [answer for answer in every if answer.accepted]
        chosen = (good or every)[: self.count]
        chosen = [replace(a, certificate=proved(a, self.task.span)) if a.accepted else a for a in chosen]
        for _, answer in self.judged.values():
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
            self.clock.passed,
            self.seed,
        )


def worked(piece: Piece) -> tuple[list[Candidate], dict[str, int]]:
    """Do one piece: begin with many candidates, keep the best, improve them; return the best and what failed."""
    (origin, parent, stages, grows), random = piece.begun, np.random.default_rng([piece.seed, piece.number, 1])
    try:
        model, given = _modelled(piece.task, piece.seed, origin)
        if not model.regular:
            return [], {"the chain cannot be assembled": 1}
        larger = grown(model, parent, _DYADS, random) if grows and parent is not None else None
        if larger is not None:
            origin = Origin(larger.plan, piece.number, larger.mechanism)
            model, _ = _modelled(piece.task, piece.seed, origin)
        elif grows:
            return [], {"no dyad can be added": 1}
        problem, coarse = TaskProblem(model, 0, _TURNED[1]), TaskProblem(model, _FEW, _TURNED[0])
        if larger is not None:
            found = promised(problem, model.write(larger.every))
        elif parent is not None:
            X, times = _children(coarse, parent, stages[0][0], random)
            found = Descended(X, np.zeros(len(X)), times)
        else:
            copies = _COPIES if stages is _STAGES else 2 * stages[0][0]
            first = random_starts(model, _FIRST, random) if given is None else shaken(given, copies, random)
            X, times = placed_starts(coarse, first, stages[0][0], random)
            found = Descended(X, np.zeros(len(X)), times)
    except GraphsynthError:
        return [], {"the chain cannot be moved": 1}
    reasons = {"no candidate completes the range": 1} if not len(found.X) else {}
    for stage, (keep, strict, iterations) in enumerate(stages):
        found = best(found, keep)
        if len(found.X):
            last = stage == len(stages) - 1  # at all points
            own = problem if last or grows else coarse
            found = descend(own, found.X, strict, iterations, None if last else found.times)
    candidates = []
    error = found.error + model.untransmitted(found.X)
    for k in np.argsort(error, kind="stable")[:_KEPT]:
        with suppress(GraphsynthError):
            mechanism, starts = built(problem, found.X[k])
            candidates.append(Candidate(float(error[k]), origin, found.X[k], mechanism, starts))
    return candidates, reasons


def _modelled(task: DesignTask, seed: int, origin: Origin) -> tuple[Model, Unknowns | None]:
    """Return the model of candidates of an origin, and the mechanism it began with, if any, as one of them."""
    random = np.random.default_rng([seed, origin.number])
    if origin.given is None:
        return Model(task, origin.plan, random), None
    given, sense = from_mechanism(task, origin.plan, origin.given)
    return Model(task, origin.plan, random, given, sense), given


def _children(
    problem: TaskProblem, parent: Array, count: int, random: np.random.Generator
) -> tuple[Array, list[Array]]:
    """Return copies of a candidate, shaken by little and by much, with the times of the candidate."""
    model = problem.model
    scale = np.where(np.arange(model.size) < model.own_at, model.task.size, 0.3)
    amount = 10.0 ** random.uniform(*_SHAKEN, (count, 1))
    X = parent + amount * scale * random.normal(0.0, 1.0, (count, model.size))
    X[0] = parent
    if model.task.linear:
        X[:, model.stroke_at] = parent[model.stroke_at] * np.exp(amount[:, 0] * random.normal(0.0, 1.0, count))
    _, times = problem.linearise(parent[None], None, 1.0)
    return X, [np.repeat(own, count, axis=0) for own in times]
