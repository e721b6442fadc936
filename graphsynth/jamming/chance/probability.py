"""`probability_of_jamming`: proved bounds of the probability that a mechanism of the tolerances binds."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from fractions import Fraction
from time import perf_counter
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from graphsynth.core.checks import checked, finite, whole
from graphsynth.core.errors import GeometryError
from graphsynth.core.shown import Shown
from graphsynth.intervals.reading import shortened
from graphsynth.jamming.bearing.bearing import Condition
from graphsynth.jamming.bearing.parameters import Given, Range, ToleranceBox
from graphsynth.jamming.chance.distributions import Distribution
from graphsynth.jamming.chance.margin import BearingMargin, Margin, widened
from graphsynth.jamming.chance.paving import Bounds, Paver, Sources

if TYPE_CHECKING:
    import pandas as pd


@dataclass(frozen=True)
class CommonFactor:
    """Something that several quantities depend on together, as temperature: each grows with it at its own rate.

    Attributes
    ----------
    name : str
    distribution : Distribution
        Of the factor, measured from where the effects vanish: for a temperature the difference to 20 degrees.
    effects : mapping of str to Given
        What one unit of the factor adds to each quantity, in the unit of the quantity.

    Examples
    --------
    >>> warm = CommonFactor("temperature", Distribution.uniform("[-10, 40]"), {"l2": "1.2e-5", "l3": "3e-5"})
    >>> warm.effects["l3"]
    '3e-5'
    """

    name: str
    distribution: Distribution
    effects: Mapping[str, Given]


@dataclass(frozen=True)
class ChanceProblem:
    """A question of probability: a box or another margin, distributions and common factors, a contact condition."""

    subject: ToleranceBox | Margin
    distributions: Mapping[str, Distribution]
    common: tuple[CommonFactor, ...] = ()
    condition: Condition = "A"

    @property
    def toleranced(self) -> dict[str, Distribution]:
        """Distribution of everything that varies by itself, uniform where only a range is given."""
        given = dict(self.distributions)
        for name, value in getattr(self.subject, "ranges", {}).items():
            if name not in given and not (value.is_point and isinstance(self.subject, ToleranceBox)):
                given[name] = Distribution("uniform", value)
        return given

    @property
    def exact_input(self) -> bool:
        """Whether no plain float came in."""
        found = [d.support.exact for d in (*self.toleranced.values(), *(f.distribution for f in self.common))]
        found += [Range.read(name, rate).exact for f in self.common for name, rate in f.effects.items()]
        return all(found) and (not isinstance(self.subject, ToleranceBox) or self.subject.exact_input)

    def each(self, factor: Fraction) -> Iterator[tuple[str, ChanceProblem]]:
        """Make one tolerance of the question so many times as wide, one after the other."""
        for name, own in self.toleranced.items():
            if not own.is_point:
                yield name, replace(self, distributions={**self.toleranced, name: own.scaled(factor)})
        for k, common in enumerate(self.common):
            other = replace(common, distribution=common.distribution.scaled(factor))
            yield common.name, replace(self, common=(*self.common[:k], other, *self.common[k + 1 :]))

    def model(self) -> tuple[Margin, Sources]:
        """Return the margin over all that can occur, and what varies independently."""
        if not isinstance(self.subject, ToleranceBox) and not hasattr(self.subject, "sampled"):
            raise GeometryError(f"subject = {self.subject!r} is no ToleranceBox and no Margin; give one")
        for factor in self.common:
            if not isinstance(factor, CommonFactor):
                raise GeometryError(f"common = {factor!r} is no CommonFactor; give CommonFactor(name, ...), or several")
        given = self.toleranced
        effects: dict[str, list[Fraction]] = {}
        for k, factor in enumerate(self.common):
            for name, effect in factor.effects.items():
                rate = Range.read(f"effect on {name}", effect)
                if not rate.is_point:
                    raise GeometryError(f"the effect of {factor.name} on {name} is a range, {rate}; give one number")
                effects.setdefault(name, [Fraction(0)] * len(self.common))[k] = rate.lower
        if isinstance(self.subject, ToleranceBox):
            box = self.subject
            names = [name for name in box.ranges if name in given or name in effects]
            self._check(given, effects, list(box.ranges))
            own = {name: given.get(name, Distribution("uniform", box[name])) for name in names}
            reach = {name: self._reach(own[name], effects.get(name, [])) for name in names}
            margin: Margin = BearingMargin(widened(box, reach), self.condition)
        else:
            margin = self.subject
            self._check(given, effects, list(margin.names))
            if missing := set(margin.names) - set(given):
                raise GeometryError(f"{min(missing)!r} has no distribution; give one for {', '.join(margin.names)}")
            own = given
            if hasattr(margin, "covering"):
                margin = margin.covering({name: self._reach(own[name], effects.get(name, [])) for name in margin.names})
        none = [Fraction(0)] * len(self.common)
        rows = tuple(tuple(effects.get(name, none)) for name in margin.names)
        common = tuple(factor.distribution for factor in self.common)
        return margin, Sources(tuple(own[name] for name in margin.names), common, rows)

    def _check(self, given: Mapping[str, Distribution], effects: Mapping[str, Any], names: list[str]) -> None:
        for name in (*given, *effects):
            if name not in names:
                raise GeometryError(f"{name!r} is no quantity of this mechanism; use {', '.join(names)}")
        for name, value in (*given.items(), *((factor.name, factor.distribution) for factor in self.common)):
            if not isinstance(value, Distribution):
                raise GeometryError(
                    f"{name} = {value!r} is no Distribution; give Distribution.uniform(range) or another"
                )

    def _reach(self, own: Distribution, effects: list[Fraction]) -> Range:
        """All values of a quantity, with those of the common factors."""
        low, high = own.support.lower, own.support.upper
        for effect, factor in zip(effects, self.common):
            ends = effect * factor.distribution.support.lower, effect * factor.distribution.support.upper
            low, high = low + min(ends), high + max(ends)
        return Range(low, high, own.support.exact)


@dataclass(frozen=True)
class SampledProbability:
    """Share of random members that bind (estimated), with its exact interval of Clopper and Pearson.

    ``lower`` to ``upper`` holds the probability with the ``confidence``, if the random numbers are good ones.
    """

    binding: int
    count: int
    lower: float
    upper: float
    confidence: float

    @property
    def share(self) -> float:
        """Share of the members that bind."""
        return self.binding / self.count


#: Members drawn at a time.
_CHUNK = 250_000


def sample_probability(
    problem: ChanceProblem, count: int, seed: int = 0, confidence: float = 0.999
) -> SampledProbability:
    """Draw members of the tolerances and count those that bind; see `SampledProbability`."""
    from scipy.special import betaincinv

    whole("count", count, 1, 10**10)
    margin, sources = problem.model()
    random = np.random.default_rng(seed)
    binding = 0
    for start in range(0, count, _CHUNK):
        size = min(_CHUNK, count - start)
        v = [of.sample(random, size) for of in sources.every] or [np.zeros(size)]
        binding += int((margin.sampled(sources.sampled(v)) < 0.0).sum())
    half = 0.5 * (1.0 - confidence)
    low = float(betaincinv(binding, count - binding + 1, half)) if binding else 0.0
    high = float(betaincinv(binding + 1, count - binding, 1.0 - half)) if binding < count else 1.0
    return SampledProbability(binding, count, low, high, confidence)


class ToleranceEffect(NamedTuple):
    """One tolerance changed by itself: proved bounds of the probability then, and of its change."""

    name: str
    lower: float
    upper: float
    least_change: float
    most_change: float


@dataclass(frozen=True, eq=False, repr=False)
class SensitivityOfProbability(Shown):
    """Result of `JammingProbability.sensitivities`: rows from the most useful change to the least.

    ``by`` is the factor on the deviations from the middle of each range; ``base`` the probability as it is; every row
    is certified.
    """

    base: JammingProbability
    by: Range
    rows: tuple[ToleranceEffect, ...]

    def to_pandas(self) -> pd.DataFrame:
        """Return the rows as a table."""
        import pandas as pd

        return pd.DataFrame(self.rows, columns=ToleranceEffect._fields)

    def _told(self) -> tuple[str, list[tuple[str, str]]]:
        low, high = (shortened(value, side, 4) for value, side in ((self.base.lower, -1), (self.base.upper, 1)))
        title = f"Proved: probability of binding {low} to {high}; with one tolerance {self.by} times as wide:"
        told = []
        for row in self.rows:
            ends = ((row.lower, -1), (row.upper, 1), (row.least_change, -1), (row.most_change, 1))
            a, b, c, d = (shortened(value, side, 4) for value, side in ends)
            told.append((row.name, f"{a} to {b}, a change of {c} to {d}"))
        return title, told


@dataclass(frozen=True, eq=False, repr=False)
class JammingProbability(Shown):
    """Result of `probability_of_jamming`: the probability lies between ``lower`` and ``upper``, proved.

    Attributes
    ----------
    lower, upper : float
        Proved bounds: rounding, curvature of the margin and the ends of all series are included.
    reason : str
        Why the bounds are no closer; empty if they are as close as was asked.
    problem : ChanceProblem
        Distributions and model that the statement is about.
    samples : SampledProbability or None
        Independent check by random members (estimated).
    boxes : int
        Boxes of the tolerances that were looked at.
    """

    lower: float
    upper: float
    reason: str
    problem: ChanceProblem
    boxes: int
    model: str
    samples: SampledProbability | None = None
    seconds: float = field(default=0.0, compare=False)

    @property
    def statement(self) -> str:
        """The sentence that is proved."""
        low, high = shortened(self.lower, -1, 6), shortened(self.upper, 1, 6)
        given = "" if self.problem.exact_input else " (for the floating-point numbers given)"
        if self.upper == 0.0:
            return f"Proved: no mechanism of the tolerances binds{given}."
        return f"Proved: a mechanism of these tolerances binds with a probability between {low} and {high}{given}."

    def sampled(self, count: int = 1_000_000, seed: int = 0, confidence: float = 0.999) -> SampledProbability:
        """Count binding members among random ones, as an independent check (estimated)."""
        return sample_probability(self.problem, count, seed, confidence)

    def sensitivities(self, by: Given = "1/2", width: float = 2e-4, seconds: float = 20.0) -> SensitivityOfProbability:
        """Enclose the probability with every tolerance in turn so many times as wide, common factors included.

        Parameters
        ----------
        by : Given
            Factor on all deviations from the middle of a range, positive: 1/2 halves a tolerance.
        width, seconds : float
            Wanted width of each enclosure, and the limit of the work for it.

        Returns
        -------
        SensitivityOfProbability
            Certified; sorted by the middle of the change.

        Raises
        ------
        GeometryError
            A factor that is not positive, or no single number.
        """
        factor = Range.read("by", by)
        if not factor.is_point or factor.lower <= 0:
            raise GeometryError(f"by = {factor} must be one positive number; 1/2 halves every tolerance in turn")

        def enclosed(problem: ChanceProblem) -> Bounds:
            return Paver(*problem.model(), width, seconds=seconds).run()

        base = self
        if self.upper - self.lower > width:
            now = enclosed(self.problem)
            base = replace(self, lower=max(self.lower, now.lower), upper=min(self.upper, now.upper))
        rows = []
        for name, problem in self.problem.each(factor.lower):
            found = enclosed(problem)
            least = math.nextafter(found.lower - base.upper, -math.inf)
            most = math.nextafter(found.upper - base.lower, math.inf)
            rows.append(ToleranceEffect(name, found.lower, found.upper, least, most))
        rows.sort(key=lambda row: (row.least_change + row.most_change, row.name))
        return SensitivityOfProbability(base, factor, tuple(rows))

    def summary(self) -> dict[str, Any]:
        """Plain values for a report or a JSON file."""
        drawn = self.samples
        return {
            "lower": self.lower,
            "upper": self.upper,
            "statement": self.statement,
            "model": self.model,
            "reason": self.reason,
            "distributions": {name: repr(value) for name, value in self.problem.toleranced.items()},
            "common": {factor.name: repr(factor.distribution) for factor in self.problem.common},
            "samples": None if drawn is None else [drawn.binding, drawn.count, drawn.lower, drawn.upper],
            "boxes": self.boxes,
            "seconds": self.seconds,
        }

    def to_pandas(self) -> pd.DataFrame:
        """Return the quantities and their distributions as a table."""
        import pandas as pd

        rows = [
            (name, d.kind, float(d.support.lower), float(d.support.upper))
            for name, d in (*self.problem.toleranced.items(), *((f.name, f.distribution) for f in self.problem.common))
        ]
        return pd.DataFrame(rows, columns=["quantity", "distribution", "lower", "upper"])

    def _told(self) -> tuple[str, list[tuple[str, str]]]:
        kinds = [d.kind for d in (*self.problem.toleranced.values(), *(f.distribution for f in self.problem.common))]
        counts = ", ".join(f"{kinds.count(kind)} {kind}" for kind in dict.fromkeys(kinds))
        rows = [
            ("guarantee", "certified: every rounding error, the curvature and the ends of all series included"),
            ("model", self.model),
            ("quantities", f"{len(kinds)} independent: {counts}"),
        ]
        if self.reason:
            rows.append(("not closer", self.reason))
        if self.samples is not None:
            drawn = self.samples
            between = f"{shortened(drawn.lower, -1, 4)} to {shortened(drawn.upper, 1, 4)}"
            rows.append(("random members", f"{drawn.binding} of {drawn.count} bind: {between} at {drawn.confidence:g}"))
        rows.append(("work", f"{self.boxes} boxes, {self.seconds:.2f} s"))
        return self.statement, rows


@checked
def probability_of_jamming(
    subject: Any,
    distributions: Mapping[str, Distribution] | None = None,
    common: Iterable[CommonFactor] = (),
    *,
    condition: Condition = "A",
    width: float = 1e-3,
    ratio: float = 1.5,
    seconds: float = 60.0,
    samples: int = 0,
) -> JammingProbability:
    """Enclose the probability that a mechanism of the tolerances binds somewhere in the full rotation of its crank.

    Parameters
    ----------
    subject : ToleranceBox or Margin
        The linkage and its bearing; or any other margin (see `graphsynth.jamming.chance.margin.Margin`).
    distributions : mapping of str to Distribution, optional
        Of quantities by name, instead of their ranges in the box; all others are uniform over their ranges.
    common : iterable of CommonFactor, optional
        What moves several quantities together.
    condition : {"A", "B", "general"}
        Contact condition, see `Bearing.interference`.
    width, ratio : float
        Wanted ``upper - lower`` and ``upper / lower``; an upper end below 1e-12 is always close enough.
    seconds, samples : optional
        Limit of the work; number of random members to draw beside it (0: none).

    Returns
    -------
    JammingProbability
        Certified for the distributions given: ``lower`` and ``upper`` hold whatever the limits of the work.

    Raises
    ------
    GeometryError
        Unknown quantities, a box some members of which are not proved to be assembled over the full rotation.

    Examples
    --------
    >>> box = ToleranceBox(alpha="0.0145", l2="1 +- 0.01", l3="2.5 +- 0.025")
    >>> found = probability_of_jamming(box, {"clearance": Distribution.normal("0.03 +- 0.003")})
    >>> found.upper - found.lower < 1e-3, round(found.lower, 2)
    (True, 0.1)
    """
    begin = perf_counter()
    if finite("width", width) <= 0.0 or finite("ratio", ratio) <= 1.0 or finite("seconds", seconds) <= 0.0:
        raise GeometryError(
            f"width = {width}, ratio = {ratio}, seconds = {seconds}: give width > 0, ratio > 1, seconds > 0"
        )
    problem = ChanceProblem(subject, dict(distributions or {}), tuple(common), condition)
    margin, sources = problem.model()
    found = Paver(margin, sources, width, ratio, seconds=seconds).run()
    drawn = sample_probability(problem, samples) if whole("samples", samples, 0) else None
    return JammingProbability(
        lower=found.lower,
        upper=found.upper,
        reason=found.reason,
        problem=problem,
        boxes=found.boxes,
        model=margin.model,
        samples=drawn,
        seconds=perf_counter() - begin,
    )
