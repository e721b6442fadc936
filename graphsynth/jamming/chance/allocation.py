"""Which tolerance grades to pay for: the cheapest choice whose probability of binding is proved small enough.

Choices are proposed in the order of their cost by an integer program (scipy's) that knows the mechanism by a linear
estimate only; each proposal is then proved or rejected by the enclosure of its probability.  A poor estimate makes the
search longer, never its result wrong (theory/probability-of-jamming 6).
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import reduce
from time import process_time
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from graphsynth.core.checks import finite
from graphsynth.core.errors import GeometryError
from graphsynth.core.shown import Shown, work
from graphsynth.intervals.reading import shortened
from graphsynth.jamming.bearing.bearing import Condition
from graphsynth.jamming.bearing.parameters import Given, Range, ToleranceBox
from graphsynth.jamming.chance.distributions import Distribution
from graphsynth.jamming.chance.paving import Bounds, Paver
from graphsynth.jamming.chance.probability import ChanceProblem, CommonFactor

if TYPE_CHECKING:
    import pandas as pd

Array = NDArray[np.float64]
#: A choice is tried all the same if the estimate of its safety index is so much too low, or at least the second value:
#: below the square root of 3, that of one uniform quantity at its worst.
_SLACK, _SAFE = 0.5, 1.6
#: Random numbers of the estimate; so many choices are listed, of more an integer program is asked; cheaper by less than
#: this factor counts as no cheaper.
_DRAWN, _LISTED, _LESS = 2000, 200_000, 1.0 - 1e-9


@dataclass(frozen=True)
class Grade:
    """One tolerance that can be bought for a quantity: a name, a range or `Distribution`, and what it costs."""

    name: str
    tolerance: Given | Distribution
    cost: float

    @property
    def distribution(self) -> Distribution:
        """Its distribution; uniform for a range."""
        return self.tolerance if isinstance(self.tolerance, Distribution) else Distribution.uniform(self.tolerance)


@dataclass(frozen=True, eq=False, repr=False)
class Allocation(Shown):
    """Result of `allocate_tolerances`.

    Attributes
    ----------
    choice : dict of str to Grade
        The cheapest choice found that is proved good enough; empty if there is none.
    cost, lower, upper : float
        Its cost, and proved bounds of its probability of binding.
    cheapest : bool
        True if every cheaper choice is proved to bind with more than the probability allowed.
    tried, rejected, undecided : int
        Choices whose probability was enclosed; of them proved too likely to bind; neither.
    """

    allowed: float
    choice: dict[str, Grade]
    cost: float
    lower: float
    upper: float
    cheapest: bool
    tried: int
    rejected: int
    undecided: int
    reason: str
    seconds: float = field(default=0.0, compare=False)

    def _told(self) -> tuple[str, list[tuple[str, str]]]:
        rows = [(name, f"{grade.name}, cost {grade.cost:g}") for name, grade in self.choice.items()]
        if len(rows) > 6:
            rows = [("grades", ", ".join(f"{name} {grade.name}" for name, grade in self.choice.items()))]
        only = "proved the cheapest of all choices" if self.cheapest else self.reason
        rows += [("order", only), ("work", f"{self.tried} choices enclosed, {self.seconds:.2f} s")]
        if not self.choice:
            return f"No choice is proved to bind with a probability of at most {self.allowed:g}.", rows
        risk = (
            "none binds" if self.upper == 0.0 else f"binds with a probability of at most {shortened(self.upper, 1, 4)}"
        )
        return f"Proved: {risk}; cost {self.cost:g} (allowed: {self.allowed:g})", rows

    def to_pandas(self) -> pd.DataFrame:
        """Return the choice as a table."""
        import pandas as pd

        rows = [(name, grade.name, grade.cost) for name, grade in self.choice.items()]
        return pd.DataFrame(rows, columns=["quantity", "grade", "cost"])


def _hull(ranges: Sequence[Range]) -> Range:
    return Range(min(own.lower for own in ranges), max(own.upper for own in ranges), all(own.exact for own in ranges))


class _Search:
    """Choices as rows of option numbers; estimates and enclosures of their probabilities."""

    def __init__(self, problem: ChanceProblem, grades: Mapping[str, Sequence[Grade]]) -> None:
        self.problem, self.allowed = problem, 0.0
        self.grades = {name: sorted(offered, key=lambda grade: grade.cost) for name, offered in grades.items()}
        self.sizes = tuple(len(offered) for offered in self.grades.values())
        self.group = np.repeat(np.arange(len(self.sizes)), self.sizes)
        self.starts = np.cumsum([0, *self.sizes[:-1]])
        self.costs = np.concatenate([[grade.cost for grade in offered] for offered in self.grades.values()])
        self.every = self._sums(self.costs) if math.prod(self.sizes) <= _LISTED else None
        self.known: dict[tuple[int, ...], Bounds] = {}
        if hasattr(problem.subject, "covering"):  # positions are proved once, for the widest of all grades
            widest = {name: _hull([grade.distribution.support for grade in own]) for name, own in grades.items()}
            self.problem = replace(problem, subject=problem.subject.covering(widest))
        self._estimate()

    def _sums(self, values: Array) -> Array:
        """Add up one value a grade for every choice, in the order of their numbers."""
        return np.asarray(reduce(np.add.outer, np.split(values, self.starts[1:]))).ravel()

    def ask(self, allowed: float, trials: int, seconds: float) -> None:
        """Ask for another probability, with limits of the work; enclosures that decide about it too are kept."""
        if not 0.0 <= finite("allowed", allowed) < 1.0:
            raise GeometryError(f"allowed = {allowed} is no probability to ask for; give 0 or more, below 1")
        self.allowed, self.fresh, self.trials, self.end = allowed, 0, trials, process_time() + seconds
        self.known = {k: own for k, own in self.known.items() if own.upper <= allowed or own.lower > allowed}
        if self.every is None:
            return
        if allowed > 0.0:
            variance = self.base_variance + self._sums(self.variance)
            self.safety = (self.base + self._sums(self.mean)) / np.sqrt(np.maximum(variance, 1e-300))
        else:  # the share of the margin that the worst member leaves
            self.safety = (self.base - self.base_reach - self._sums(self.worst)) / max(self.base, 1e-300)

    def chosen(self, choice: Sequence[int]) -> dict[str, Grade]:
        return {name: offered[k] for (name, offered), k in zip(self.grades.items(), choice)}

    def question(self, choice: Sequence[int]) -> ChanceProblem:
        picked = {name: grade.distribution for name, grade in self.chosen(choice).items()}
        toleranced = {**self.problem.toleranced, **picked}
        return ChanceProblem(self.problem.subject, toleranced, self.problem.common, self.problem.condition)

    @property
    def stopped(self) -> bool:
        """Whether a limit of the work is reached."""
        return self.fresh >= self.trials or process_time() > self.end

    def good(self, choice: tuple[int, ...]) -> bool:
        """Enclose the probability of a choice, no further than it takes to tell whether it is allowed."""
        if choice not in self.known:
            self.fresh += 1
            left = max(self.end - process_time(), 0.1)
            self.known[choice] = Paver(
                *self.question(choice).model(), 1e-3, 1.01, allowed=self.allowed, seconds=left
            ).run()
        return self.known[choice].upper <= self.allowed

    @property
    def best(self) -> tuple[int, ...] | None:
        """The cheapest choice that is proved good."""
        good = (choice for choice, found in self.known.items() if found.upper <= self.allowed)
        return min(good, key=self.cost, default=None)

    def improved(self, index: float) -> bool:
        """Enclose all cheaper choices with an estimated safety, in the order of cost; tell whether it was all."""
        while (choice := self.cheapest(index, self.cost(self.best), list(self.known))) is not None:
            if self.stopped:
                return False
            self.good(choice)
        return True

    def cheaper(self) -> tuple[list[Bounds], float]:
        """Return what is known of choices cheaper than the best, and how many others there are (infinite: unknown)."""
        below = self.cost(self.best) * _LESS
        known = [found for choice, found in self.known.items() if self.cost(choice) < below]
        return known, math.inf if self.every is None else int((self.every < below).sum()) - len(known)

    def _estimate(self) -> None:
        """Estimate what every grade adds to mean, variance and range of the margin, by slopes at the dearest choice."""
        tight = tuple(size - 1 for size in self.sizes)
        margin, sources = self.question(tight).model()
        random = np.random.default_rng(0)
        every = sources.every
        middle = np.array([[float(of.sample(random, _DRAWN).mean()) for of in every]])
        step = 1e-4
        points = np.concatenate([middle, middle + step * np.eye(len(every)), middle - step * np.eye(len(every))])
        values = margin.sampled(sources.sampled(list(points.T)))
        slopes = (values[1 : len(every) + 1] - values[len(every) + 1 :]) / (2.0 * step)
        names = [name for name, own in zip(margin.names, sources.own) if not own.is_point]
        names += [factor.name for factor in self.problem.common]
        self.base, self.base_variance, self.base_reach = float(values[0]), 0.0, 0.0
        rows: list[tuple[float, float, float]] = []
        per_unit = {}
        for name, of, slope, at in zip(names, every, slopes.tolist(), middle[0].tolist()):
            width = float(of.support.upper - of.support.lower)
            per_unit[name] = slope / width, float(of.support.lower) + width * at
            if name not in self.grades:
                drawn = of.sample(random, _DRAWN)
                self.base_variance += slope**2 * float(drawn.var())
                self.base_reach += 0.5 * abs(slope)
        for name, offered in self.grades.items():
            slope, at = per_unit.get(name, (0.0, 0.0))
            for grade in offered:
                of = grade.distribution
                low, width = float(of.support.lower), float(of.support.upper - of.support.lower)
                drawn = low + width * of.sample(random, _DRAWN)
                worst = max(slope * (at - low), slope * (at - low - width))
                rows.append((slope * (float(drawn.mean()) - at), slope**2 * float(drawn.var()), worst))
        self.mean, self.variance, self.worst = np.array(rows).T

    def cheapest(self, index: float, below: float, without: list[tuple[int, ...]]) -> tuple[int, ...] | None:
        """Propose the cheapest choice with an estimated safety index, a cost below, and none of those known."""
        if self.every is not None:
            fits = (self.every < below * _LESS) & (self.safety >= index)
            if without:
                fits[np.ravel_multi_index(tuple(np.array(without).T), self.sizes)] = False
            rows = np.flatnonzero(fits)
            at = np.unravel_index(rows[self.every[rows].argmin()], self.sizes) if rows.size else ()
            return tuple(int(k) for k in at) or None
        if self.allowed == 0.0:  # no member may bind: the estimate is a sum
            return self._solved((self.worst, self.base * (1.0 - index) - self.base_reach), below, without)
        # mean >= index * deviation is at least as strict for the tangent (v / s + s) / 2 of the root of the variance
        # at any s, and the same at the right one
        most, least = (
            math.sqrt(self.base_variance + extreme.reduceat(self.variance, self.starts).sum())
            for extreme in (np.maximum, np.minimum)
        )
        found = []
        for s in np.geomspace(max(least, 1e-6 * most), max(most, 1e-300), 8):
            row = -self.mean + 0.5 * index / s * self.variance
            room = self.base - 0.5 * index * (s + self.base_variance / s)
            choice = self._solved((row, room), below, without)
            if choice is not None:
                found.append((self.cost(choice), choice))
        return min(found)[1] if found else None

    def cost(self, choice: tuple[int, ...] | None) -> float:
        return math.inf if choice is None else math.fsum(self.costs[self.starts + np.array(choice)].tolist())

    def _solved(
        self, bound: tuple[Array, float] | None, below: float, without: list[tuple[int, ...]]
    ) -> tuple[int, ...] | None:
        """Solve the integer program: one grade each, a row below its bound, a cost below, no choice known."""
        from scipy.optimize import Bounds as Limits, LinearConstraint, milp

        group = self.group
        one = (group[None, :] == np.arange(len(self.sizes))[:, None]).astype(float)
        rows = [LinearConstraint(one, 1.0, 1.0)]
        if bound is not None:
            scale = max(float(np.abs(bound[0]).max()), 1e-300)
            rows.append(LinearConstraint(bound[0][None] / scale, -np.inf, bound[1] / scale))
        if math.isfinite(below):
            rows.append(LinearConstraint(self.costs[None], -np.inf, below * _LESS))
        if without:
            cuts = np.zeros((len(without), len(group)))
            for cut, choice in zip(cuts, without):
                cut[self.starts + np.array(choice)] = 1.0
            rows.append(LinearConstraint(cuts, -np.inf, len(self.sizes) - 1.0))
        found = milp(self.costs, constraints=rows, integrality=np.ones(len(group)), bounds=Limits(0.0, 1.0))
        if found.x is None:
            return None
        return tuple(int(found.x[group == k].argmax()) for k in range(len(self.sizes)))


def allocate_tolerances(
    subject: Any,
    grades: Mapping[str, Sequence[Grade]],
    allowed: float,
    distributions: Mapping[str, Distribution] | None = None,
    common: Iterable[CommonFactor] = (),
    *,
    condition: Condition = "A",
    trials: int = 300,
    seconds: float = 60.0,
) -> Allocation:
    """Find the cheapest choice of grades whose probability of binding is proved to be at most the one allowed.

    Parameters
    ----------
    subject, distributions, common, condition
        As for `probability_of_jamming`; for quantities without grades.
    grades : mapping of str to sequence of Grade
        What can be bought for each quantity.
    allowed : float
        Largest probability of binding; 0 asks for a proof that no member binds.
    trials, seconds : optional
        Limits of the work: choices to enclose, and time.

    Returns
    -------
    Allocation
        The bounds of the probability are certified.  That no other choice is cheaper is proved where ``cheapest`` is
        True; otherwise ``reason`` says how far it was searched.

    Raises
    ------
    GeometryError
        No grades, negative costs, a probability that is none.
    """
    given: dict[str, Any] = {"condition": condition, "trials": trials, "seconds": seconds}
    return pareto_curve(subject, grades, [allowed], distributions, common, **given).points[0]


def _allocated(search: _Search, allowed: float, trials: int, seconds: float) -> Allocation:
    begin = process_time()
    search.ask(allowed, trials, seconds)
    _find_one(search)
    done = search.improved(min(_index(allowed) - _SLACK, _SAFE) if allowed > 0.0 else -0.1)
    if done and search.cheaper()[1] <= trials - search.fresh:  # also those that the estimate rules out
        search.improved(-math.inf)
    best = search.best
    known, left = search.cheaper()
    rejected = sum(found.lower > allowed for found in known)
    reason = "" if best is not None else "every choice is proved to bind more often"
    if not done:
        reason = "cheaper choices may exist: the limit of work was reached"
    elif rejected < len(known):
        reason = f"{len(known) - rejected} cheaper choices are neither proved nor rejected"
    elif left:
        reason = f"{f'{left} ' if left < math.inf else ''}cheaper choices are ruled out by an estimate only"
    found = search.known[best] if best is not None else Bounds(0.0, 1.0, 0, "")
    return Allocation(
        allowed=allowed,
        choice=search.chosen(best) if best is not None else {},
        cost=search.cost(best),
        lower=found.lower,
        upper=found.upper,
        cheapest=best is not None and not reason,
        tried=len(search.known),
        rejected=rejected,
        undecided=len(known) - rejected,
        reason=reason,
        seconds=process_time() - begin,
    )


def _index(allowed: float) -> float:
    """Safety index: mean over deviation of a normal margin that is negative with the probability allowed."""
    from scipy.special import ndtri

    return -float(ndtri(allowed)) if allowed > 0.0 else 0.0


def _find_one(search: _Search) -> None:
    """Ask the estimate for more and more safety, from less than wanted on, until a choice is proved good enough."""
    index = _index(search.allowed)
    for step in range(-8, 25):
        asked = index + max(abs(index), 0.3) * step / 16.0 if search.allowed > 0.0 else 0.02 * step
        choice = search.cheapest(asked, math.inf, [])
        if choice is None or search.stopped or search.good(choice):
            return


def curve(points: Iterable[tuple[float, float]]) -> Any:
    """Return the picture of costs over proved probabilities (upper bound, cost); None without one above zero."""
    line = work("chart line")
    good: list[tuple[float, float]] = []
    for upper, cost in sorted(points):
        if not good or cost < good[-1][1]:  # what binds more often is cheaper, or not worth having
            good.append((upper, cost))
    free = next((cost for upper, cost in good if upper == 0.0), math.nan)
    good = [point for point in good if point[0] > 0.0]
    if not good:
        return None
    x, y = np.array(good).T
    ticks = 10.0 ** np.arange(math.floor(math.log10(0.999 * x[0])), math.ceil(math.log10(x[-1])) + 1)
    steps = [ticks[0], *np.repeat(x, 2), ticks[-1]], [free, free, *np.repeat(y, 2)]
    return work("chart")(
        [line(*steps, "least found", "a", "-"), line(x, y, "proved choices", "a", "o")],
        "probability of binding, proved upper bound",
        "cost of the grades",
        levels=[] if math.isnan(free) else [line([], free, f"none binds: {free:g}", "soft", "--")],
        xticks=ticks[:: 1 + len(ticks) // 9],
        decades=True,
    )


@dataclass(frozen=True, eq=False, repr=False)
class ParetoCurve(Shown):
    """Allocations for several probabilities allowed: what less risk costs, each point proved."""

    points: tuple[Allocation, ...]

    def to_pandas(self) -> pd.DataFrame:
        """Return the points as a table."""
        import pandas as pd

        columns = ["allowed", "cost", "lower", "upper", "cheapest"]
        return pd.DataFrame([vars(point) for point in self.points if point.choice], columns=columns)

    def chart(self) -> Any:
        """Return the picture, a `graphsynth.Chart`: cost over the logarithm of the proved probability, in steps."""
        return curve([(point.upper, point.cost) for point in self.points if point.choice])

    def _picture(self) -> str:
        chart = self.chart()
        return "" if chart is None else str(chart.svg())

    def _told(self) -> tuple[str, list[tuple[str, str]]]:
        rows = [
            (f"at most {point.allowed:g}", f"cost {point.cost:g}" if point.choice else "no choice proved")
            for point in self.points
        ]
        return "Cost of the tolerances over the probability of binding allowed (each point proved)", rows


def pareto_curve(
    subject: ToleranceBox | Any,
    grades: Mapping[str, Sequence[Grade]],
    allowed: Sequence[float],
    distributions: Mapping[str, Distribution] | None = None,
    common: Iterable[CommonFactor] = (),
    *,
    condition: Condition = "A",
    trials: int = 300,
    seconds: float = 60.0,
) -> ParetoCurve:
    """Allocate tolerances for several probabilities of binding.

    Parameters
    ----------
    allowed : sequence of float
        Probabilities of binding that are allowed.
    subject, grades, distributions, common, condition, trials, seconds
        As for `allocate_tolerances`; the limits are for each point.

    Returns
    -------
    ParetoCurve
        Every point certified.

    Raises
    ------
    GeometryError
        As `allocate_tolerances`.
    """
    if not grades or not all(grades.values()):
        raise GeometryError("there is a quantity without grades, or none at all; give at least one Grade each")
    if not all(isinstance(grade, Grade) for offered in grades.values() for grade in offered):
        raise GeometryError("grades hold something else than Grade(name, tolerance, cost); correct them")
    if any(finite("cost", grade.cost) < 0.0 for offered in grades.values() for grade in offered):
        raise GeometryError("a grade costs less than nothing; give costs of zero or more")
    search = _Search(ChanceProblem(subject, dict(distributions or {}), tuple(common), condition), grades)
    return ParetoCurve(tuple(_allocated(search, own, trials, seconds) for own in allowed))
