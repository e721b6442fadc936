"""The search: differential evolution over batches of motions, then a local polish of a target.

Why there is always something to begin with: docs/explanation/embodiment.md, "Why a full turn is always within reach".
Sources: [Storn & Price 1997], J. Global Optim. 11, 341-359 (differential evolution); [Deb 2000], Comput. Methods Appl.
Mech. Eng. 186, 311-338 (complete motions before bounds, bounds before aims).
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from time import perf_counter
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from graphsynth.core.checks import positive, whole
from graphsynth.core.errors import GeometryError, GraphError
from graphsynth.core.shown import Shown
from graphsynth.kinematics.dimensional.design import Design, Drivers, choices, joint_kinds
from graphsynth.kinematics.dimensional.goals import Goals, Target
from graphsynth.kinematics.dimensional.mirror import mirrors
from graphsynth.kinematics.dimensional.problem import INCOMPLETE, OUTSIDE, DimensionProblem, dimensioned
from graphsynth.kinematics.dimensional.refine import refine
from graphsynth.kinematics.dimensional.verify import Figures, verify
from graphsynth.structure.graph import MechanismGraph

if TYPE_CHECKING:
    from graphsynth.kinematics.engine.result import Motion
    from graphsynth.mechanism.model import Mechanism

Array = NDArray[np.float64]

#: Merit at which a search without a target is content: all bounds kept with this to spare.
_ENOUGH = 1.5
#: Error of a target below which nothing is gained.
EXACT = 1e-9
_DIFFERENCE = 1e-6
#: Spread of the second population about the best of the first, where least squares do not help.
_AROUND = 0.01
#: First candidates of a search for a target with derivatives.
_STARTS = 200
#: Penalty of a motion that is not complete, in the least squares of a target.
_WALL = 1e3


class HistoryRow(NamedTuple):
    """Best of one generation of one search."""

    attempt: int
    generation: int
    evaluations: int
    cost: float


@dataclass(frozen=True)
class SearchResult:
    """The best vector of a search, its cost, and the way to it."""

    best: Array
    cost: float
    history: tuple[HistoryRow, ...]
    start: tuple[int, int, int]  # candidates of the first population: all, complete, within bounds
    population: Array = field(repr=False)


def search(
    problem: DimensionProblem,
    attempt: int,
    random: np.random.Generator,
    deadline: float,
    before: SearchResult | None = None,
    effort: float = 1.0,
) -> SearchResult:
    """Run one search, or go on with one; it ends early only when ``perf_counter`` passes the deadline.

    With a target the first search is short: it tells the promising starts, which are then continued.  `effort` is the
    share of the usual number of first candidates and of generations.
    """
    begun, aimed = before, problem.fit is not None
    if begun is None and problem.fit is not None and problem.fit.smooth:
        return _refined(problem, attempt, random, effort)
    if begun is None:  # many candidates, of which the best are the first population
        width = min(120, 15 * problem.size) if aimed else min(60, 6 * problem.size)
        first = problem.population(max(width, round(effort * (20 if aimed else 4) * width), 1), random)
        outcome = problem.evaluate(first)
        order = np.argsort(outcome.cost, kind="stable")[: max(width, 8)]
        counts = len(first), int((outcome.cost < 0.5 * INCOMPLETE).sum()), int((outcome.merit >= 1.0).sum())
        begun = SearchResult(first[order[0]], float(outcome.cost[order[0]]), (), counts, first[order])
    fit, count = problem.fit, 60  # generations at most: fewer where a motion costs more
    if fit is not None:
        count = 120 if before is None else 400 if fit.warped else 600
    generations = max(2, round(effort * (count // 3 if problem.iterative else count)))
    history = [HistoryRow(attempt, 0, problem.evaluations, begun.cost)]
    start = begun.start if before is None else (0, 0, 0)
    if problem.size == 0:
        return replace(begun, history=tuple(history), start=start)
    best, value, population = _evolve(problem, begun.population, generations, history, deadline, random)
    smooth = fit is None or fit.smooth
    if not smooth and before is not None:
        box = problem.bounds()
        around = np.clip(best + random.normal(0.0, _AROUND, population.shape), box[:, 0], box[:, 1])
        around[0] = best
        best, value, population = _evolve(problem, around, generations // 2, history, deadline, random)
    if fit is not None and smooth and EXACT < value < OUTSIDE:
        polished = _polish(problem, best)
        better = float(problem.evaluate(polished[None]).cost[0])
        if better < value:
            best, value, population[0] = polished, better, polished
            history.append(HistoryRow(attempt, len(history), problem.evaluations, value))
    return SearchResult(best, value, tuple(history), start, population)


def _refined(problem: DimensionProblem, attempt: int, random: np.random.Generator, effort: float) -> SearchResult:
    """Take many first candidates to their optima at once; the best of these are the population to go on with."""
    first = problem.population(max(round(effort * _STARTS), 1), random)
    outcome = problem.evaluate(first)
    every = len(first), int((outcome.cost < 0.5 * INCOMPLETE).sum()), int((outcome.merit >= 1.0).sum())
    history = [HistoryRow(attempt, 0, problem.evaluations, float(outcome.cost.min()))]
    found = refine(problem, first[outcome.cost < 0.5 * INCOMPLETE])
    problem.evaluations += found.evaluations
    X = np.concatenate([found.X, first])
    outcome = problem.evaluate(X)
    order = np.argsort(outcome.cost, kind="stable")[: max(min(120, 15 * problem.size), 8)]
    history.append(HistoryRow(attempt, 1, problem.evaluations, float(outcome.cost[order[0]])))
    return SearchResult(X[order[0]], float(outcome.cost[order[0]]), tuple(history), every, X[order])


def _evolve(
    problem: DimensionProblem,
    population: Array,
    generations: int,
    history: list[HistoryRow],
    deadline: float,
    random: np.random.Generator,
) -> tuple[Array, float, Array]:
    """Differential evolution; returns the best, its cost and the last population."""
    from scipy.optimize import differential_evolution

    enough = -_ENOUGH if problem.fit is None else EXACT
    attempt = history[0].attempt

    def cost(X: Array) -> Array:
        found = problem.evaluate(np.atleast_2d(X.T)).cost
        least = min(history[-1].cost, float(found.min()))
        history.append(HistoryRow(attempt, len(history), problem.evaluations, least))
        return found

    def content(x: Array, convergence: float) -> bool:
        return perf_counter() > deadline or history[-1].cost <= enough

    found = differential_evolution(
        cost,
        problem.bounds(),
        init=population,
        vectorized=True,
        updating="deferred",
        polish=False,
        maxiter=generations,
        tol=1e-7,
        atol=1e-12,
        seed=random,
        callback=content,
    )
    return found.x, float(found.fun), np.asarray(found.population)


def _polish(problem: DimensionProblem, x: Array) -> Array:
    """Least squares of the errors from x, bounds as penalties; derivatives by differences, all in one batch."""
    from scipy.optimize import least_squares

    def residuals(X: Array) -> Array:
        found = problem.evaluate(X)
        broken = np.maximum(0.0, 1.0 - found.merit) * np.where(found.cost < 0.5 * INCOMPLETE, 1.0, _WALL)
        return np.concatenate([found.errors.real, found.errors.imag, broken[:, None]], axis=1)

    def derivatives(x: Array) -> Array:
        step = _DIFFERENCE * np.eye(len(x))
        both = residuals(np.concatenate([x + step, x - step]))
        return np.asarray((both[: len(x)] - both[len(x) :]).T / (2.0 * _DIFFERENCE))

    found = least_squares(
        lambda x: residuals(x[None])[0],
        x,
        jac=derivatives,
        x_scale=1.0,
        xtol=1e-14,
        ftol=1e-15,
        gtol=1e-15,
        max_nfev=80,
    )
    return np.asarray(found.x)


# --- `embody`


#: Searches for a target that are continued to their end.
_CONTINUED = 2


@dataclass(frozen=True, eq=False, repr=False)
class Embodiment(Shown):
    """Dimensions found for a mechanism graph, and how they were assessed.

    Attributes
    ----------
    graph : MechanismGraph
        With the frame that was chosen; link numbers are those of this graph.
    drivers : tuple of (base, link)
    accepted : bool
        Every bound and the target are kept over the whole range, on one branch, verified by `simulate`.
    mechanism : Mechanism or None
        The accepted mechanism, else the best found; None if nothing could be assembled.
    motion : Motion or None
        Its motion over the range.
    figures : Figures or None
    reasons : dict of str to int
        Why candidates were rejected, counted: of each first population, and of every result verified; that of the
        best result first.
    statement : str
    goals : Goals
    seed : int
    evaluations : int
        Candidate motions computed.
    seconds : float
    history : tuple of HistoryRow
        Best cost by generation; see `to_pandas`.
    """

    graph: MechanismGraph
    drivers: tuple[tuple[int, int], ...]
    accepted: bool
    mechanism: Mechanism | None
    motion: Motion | None
    figures: Figures | None
    reasons: Mapping[str, int]
    statement: str
    goals: Goals
    seed: int
    evaluations: int
    seconds: float
    history: tuple[HistoryRow, ...] = field(default=(), repr=False)

    def _told(self) -> tuple[str, list[tuple[str, str]]]:
        rows = [
            ("graph", self.graph.to_text()),
            ("searched", f"{self.evaluations} candidate motions, {self.seconds:.2g} s"),
        ]
        if self.figures is not None and self.goals.target is not None:
            rows.append(("error of the goal", f"{self.figures.goal_error:.2g}"))
        return f"Dimensions {self.statement}", rows

    def _picture(self) -> str:
        return "" if self.motion is None else self.motion._picture()

    def to_pandas(self) -> Any:
        """Return the search history as a table: attempt, generation, evaluations, cost."""
        import pandas as pd

        return pd.DataFrame(self.history, columns=list(HistoryRow._fields))


def embody(
    graph: MechanismGraph,
    goals: Goals | Target | None = None,
    seed: int = 0,
    *,
    driver: Drivers | None = None,
    joints: Mapping[tuple[int, int], str] | str | None = None,
    tries: int = 12,
    seconds: float = math.inf,
    effort: float = 1.0,
) -> Embodiment:
    """Find dimensions with which a mechanism moves as wanted.

    Parameters
    ----------
    graph : MechanismGraph
        A chain (frame and driver are chosen) or a mechanism (driver chosen unless given).
        Space 3, joint mobilities 1 and 2.
    goals : Goals, or its target alone, optional
        A full turn with the default bounds unless given.
    seed : int
        Same labelled graph, goals and seed, same result (unless ``seconds`` cuts the search short).
    driver : int or (base, link), or one of these for each driver, optional
        A link on the frame, or two jointed links.
    joints : mapping of (a, b) to str, or str, optional
        Kind by pair of links of the graph given: "R" (default) or "P"; "gear", "pin-slot" or "cam" for mobility 2, by
        default a gear where a third link carries both wheels, else a pin in a slot.  Teeth as in "gear 2:1"; a profile
        as in "cam 0.2:0 0:0.05", cosines and sines of 1, 2, ... times the polar angle over the mean radius.  A text
        alone is the kind of all joints of mobility 2, of gears where they can be.
    tries : int
        Searches at most; each takes the next frame and driver of the order of
        :func:`graphsynth.kinematics.dimensional.design.choices`, and starts anew from another sketch.
    seconds : float
        Time limit; not exceeded by more than one generation and a verification.
    effort : float
        Share of the usual work of each search, for a quick look at many graphs: unlike a time limit it does not change
        the result from run to run.

    Returns
    -------
    Embodiment
        Accepted only after `simulate` completed the range in steps of at most half a degree (estimated).

    Raises
    ------
    GraphError
        A graph that cannot move, or drivers that do not move it.
    GeometryError
        Joint kinds or goals that do not fit the graph.

    Examples
    --------
    >>> from graphsynth.structure.graph import MechanismGraph
    >>> found = embody(MechanismGraph(4, [(0, 1), (1, 2), (2, 3), (0, 3)]))
    >>> found.accepted, found.motion.completed, found.motion.closure.closed
    (True, True, True)
    """
    begin = perf_counter()
    wanted = Goals() if goals is None else Goals(target=goals) if isinstance(goals, Target) else goals
    _check(graph, wanted)
    if wanted.rates and len(wanted.rates) != graph.mobility:
        raise GeometryError(f"{len(wanted.rates)} rates are given, but the mobility is {graph.mobility}; give one each")
    whole("seed", seed, 0, 2**128)
    whole("tries", tries, 1)
    if seconds != math.inf:
        positive("seconds", seconds)
    positive("effort", effort)
    order = _order(graph, driver, joints, wanted)
    run = _Run(wanted, seed, begin, seconds, effort)
    for attempt in range(tries):
        inversion, drivers, image = order[attempt % len(order)]
        kinds = _kinds(graph, inversion, joints)
        run.start(Design(inversion, drivers, kinds, image, wanted.mirrored), attempt, attempt // len(order))
        if run.ended:
            break
    return run.result()


def _order(
    graph: MechanismGraph, driver: Drivers | None, joints: Mapping[tuple[int, int], str] | str | None, goals: Goals
) -> list[tuple[MechanismGraph, tuple[tuple[int, int], ...], tuple[int, ...]]]:
    """Return frames, drivers and, of a symmetry, images of all links, in the order in which they are tried."""
    order = [(*own, goals.symmetry) for own in choices(graph, driver)]
    if goals.mirrored:
        order = [
            (own, drivers, image)
            for own, drivers, _ in order
            for image in mirrors(Design(own, drivers, _kinds(graph, own, joints)))
        ]
    if not order:
        raise GraphError(
            "no frame and driver make this graph its own mirror image: all other links have to exchange places in "
            "pairs; take another graph, such as two four-bars on one crank"
        )
    return order


def _check(graph: MechanismGraph, goals: Goals) -> None:
    """Refuse what is no planar mechanism, and a symmetry that is no automorphism of it."""
    if not isinstance(graph, MechanismGraph):
        raise GraphError(f"{graph!r} is not a MechanismGraph")
    if not isinstance(goals, Goals):
        raise GeometryError(f"goals = {goals!r} are not Goals")
    if graph.space != 3 or not graph.is_connected:
        raise GraphError("embodiment needs a connected graph of space 3 (planar mechanisms)")
    image = goals.symmetry
    if not image:
        return
    if sorted(image) != list(range(graph.links)) or graph.frame is None or image[graph.frame] != graph.frame:
        raise GeometryError(f"symmetry = {image} must be the image of every link, the frame its own")
    own = {(joint.a, joint.b): joint.mobility for joint in graph.joints}
    if {tuple(sorted((image[a], image[b]))): mobility for (a, b), mobility in own.items()} != own:
        raise GeometryError(f"symmetry = {image} does not carry joints into joints of the same mobility")


class _Run:
    """Searches of one call, and what they came to."""

    def __init__(self, goals: Goals, seed: int, begin: float, seconds: float, effort: float) -> None:
        self.goals, self.seed, self.begin, self.deadline = goals, seed, begin, begin + seconds
        self.effort = effort
        self.reasons: Counter[str] = Counter()
        self.history: list[HistoryRow] = []
        self.found: list[tuple[SearchResult, DimensionProblem, int]] = []
        self.best: tuple[tuple[bool, float], Embodiment] | None = None
        self.ended = False

    def start(self, design: Design, attempt: int, round_: int) -> None:
        """Search once; without a target an accepted result ends the run."""
        random = np.random.default_rng([self.seed, attempt])
        problem = DimensionProblem(design, self.goals, random, round_ if self.goals.target is not None else 0)
        found = search(problem, attempt, random, self.deadline, effort=self.effort)
        every, complete, inside = found.start
        self.reasons["first population: the range is not completed"] += every - complete
        self.reasons["first population: a bound is not kept"] += complete - inside
        self.found.append((found, problem, attempt))
        self.history += found.history
        late = perf_counter() > self.deadline
        if self.goals.target is None:
            self.judge(problem, found)
            self.ended = late or (self.best is not None and self.best[1].accepted)
        else:
            self.ended = late or found.cost <= EXACT

    def judge(self, problem: DimensionProblem, found: SearchResult) -> None:
        """Verify the best of a search and keep it if it is better than those before."""
        mechanism, motion, figures = dimensioned(problem, found.best), None, None
        why: tuple[str, ...] = ("cannot be assembled",)
        if mechanism is not None:
            motion, figures, why = verify(mechanism, self.goals)
            if why and found.cost >= 0.5 * INCOMPLETE:
                why = tuple(dict.fromkeys((*why, "the range is not completed")))
            elif why and found.cost > 0.5 * OUTSIDE:
                why = tuple(dict.fromkeys((*why, "a bound is not kept")))
        self.reasons.update(f"result: {reason}" for reason in why)
        rank, design = (bool(why), found.cost), problem.design
        if self.best is None or rank < self.best[0]:
            self.best = (
                rank,
                Embodiment(
                    design.graph,
                    design.drivers,
                    not why,
                    mechanism,
                    motion,
                    figures,
                    {f"result: {reason}": 1 for reason in why},
                    "",
                    self.goals,
                    self.seed,
                    0,
                    0.0,
                ),
            )

    def result(self) -> Embodiment:
        """Continue the most promising searches for a target to their end; return the best with the run's totals."""
        aimed = self.goals.target is not None
        for found, problem, attempt in sorted(self.found, key=lambda item: item[0].cost)[: _CONTINUED if aimed else 0]:
            random = np.random.default_rng([self.seed, attempt, 1])
            final = found
            if perf_counter() < self.deadline and problem.fit is not None and not problem.fit.smooth:
                final = search(problem, attempt, random, self.deadline, found, self.effort)
                self.history += final.history
            self.judge(problem, final)
            if final.cost <= EXACT and self.best is not None and self.best[1].accepted:
                break
        assert self.best is not None
        best, tries = self.best[1], len(self.found)
        frame = "" if best.graph.frame is None else f"frame {best.graph.frame}, "
        choice = f"{frame}drivers {', '.join(f'{a}-{b}' for a, b in best.drivers)}"
        ordered = *best.reasons, *self.reasons  # why the best is not accepted comes first
        reasons = {reason: self.reasons[reason] for reason in ordered if self.reasons[reason]}
        if best.accepted and best.figures is not None:
            text = (
                f"accepted after {tries} search{'es' * (tries > 1)}: {choice}; smallest transmission angle "
                f"{math.degrees(best.figures.transmission_angle):.1f} degrees, "
                f"length ratio {best.figures.length_ratio:.2f}"
            )
        else:
            listed = "; ".join(f"{reason}: {count}" for reason, count in reasons.items()) or "no candidate"
            text = f"nothing was accepted in {tries} search{'es' * (tries > 1)}; the best has {choice}; {listed}"
        return replace(
            best,
            reasons=reasons,
            statement=text,
            evaluations=sum(problem.evaluations for _, problem, _ in self.found),
            seconds=perf_counter() - self.begin,
            history=tuple(self.history),
        )


def _kinds(
    graph: MechanismGraph, inversion: MechanismGraph, joints: Mapping[tuple[int, int], str] | str | None
) -> tuple[str, ...]:
    """Kinds of the joints of an inversion, from those of the graph given."""
    rule, joints = (joints, None) if isinstance(joints, str) else ("", joints)
    if joints is not None and not isinstance(joints, Mapping):
        raise GeometryError(f"joints = {joints!r} is not a mapping of (a, b) to a kind, as in {{(0, 1): 'P'}}")
    given = {pair: str(kind) for pair, kind in (joints or {}).items()}
    kinds = joint_kinds(graph, given, rule)
    if inversion.frame == graph.frame:
        return kinds
    link = next(link for link in range(graph.links) if graph.with_frame(link) == inversion)
    new = {old: k for k, old in enumerate([link, *(k for k in range(graph.links) if k != link)])}
    return joint_kinds(inversion, {(new[a], new[b]): kind for (a, b), kind in given.items()}, rule)
