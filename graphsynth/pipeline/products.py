"""What stages hand to one another and to the report: plain frozen data in which a number names its guarantee."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field, replace
from typing import Any, Literal

from graphsynth.core.errors import GraphsynthError
from graphsynth.core.shown import Shown
from graphsynth.pipeline.units import Unit, behind

Guarantee = Literal["exact", "certified", "estimated"]


@dataclass(frozen=True, slots=True)
class Candidate:
    """A mechanism graph that answers the structural question."""

    number: int  # from 1, in the order of generation
    graph: Any  # `MechanismGraph` with its frame
    solution: str = ""  # the integer solution it belongs to, for example ``n2=6 n3=7 n4=1``

    @property
    def key(self) -> str:
        """Canonical key of the graph."""
        return str(self.graph.key)


class Rejected(Exception):  # noqa: N818  # not an error: a candidate that does not meet a goal
    """Raised by a stage for each candidate: this one does not meet a goal, and later stages need not look at it.

    ``cause`` is the reason in words that can be counted; ``detail`` holds for this candidate only.
    """

    def __init__(self, cause: str, detail: str = "") -> None:
        super().__init__(f"{cause}: {detail}" if detail else cause)
        self.cause = cause


@dataclass(frozen=True, slots=True)
class Outcome:
    """What became of one candidate in the stages for each candidate: through all, stopped by a goal, or failed.

    ``products``, for later stages and the report: plain values, tuples, dictionaries, dataclasses of this module.
    """

    number: int  # from 1, in the order of the stream
    key: str = ""
    solution: str = ""
    status: Literal["assessed", "rejected", "failed"] = "assessed"
    stage: str = ""  # where it was stopped
    cause: str = ""  # why, in countable words
    reason: str = ""  # why, in full
    products: Mapping[str, Any] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class Recognised:
    """A candidate with the kinematic module that knows it, or the reason why none does."""

    candidate: Candidate
    module: str | None
    reason: str = ""


@dataclass(frozen=True, slots=True)
class Quantity:
    """A number with its unit, its guarantee and how far it may be off.

    ``exact``: no rounding, or a closed form evaluated in floating point with the rounding error in ``error``.
    """

    name: str
    value: float
    unit: str = ""
    guarantee: Guarantee = "estimated"
    error: float | None = None  # in ``unit``: bound (exact, certified) or estimate of the absolute error; None: unknown

    @classmethod
    def of_si(
        cls, name: str, value: float, unit: str = "", guarantee: Guarantee = "estimated", error: float | None = None
    ) -> Quantity:
        """Return the quantity of an SI value and its SI error, shown in `unit`.

        >>> Quantity.of_si("tilt", 0.5, "mrad").text
        '500 mrad'
        """
        shown = Unit.parse(unit)
        return cls(name, shown.from_si(float(value)), unit, guarantee, None if error is None else shown.from_si(error))

    @property
    def text(self) -> str:
        """The value with its unit, to a readable number of digits."""
        return f"{self.value:.10g}{behind(self.unit)}"


@dataclass(frozen=True, slots=True)
class Record:
    """One row of ``results.csv``: a candidate and what became of it.

    A scene without candidates has one record, without key and solution. A candidate that no module recognises or that
    a goal rejects is not a failure; every status but the first carries a reason.
    """

    number: int = 1
    key: str = ""
    solution: str = ""
    status: Literal["assessed", "not recognised", "rejected", "failed"] = "assessed"
    recognised_as: str = ""
    verdict: str = ""
    good: bool | None = None  # whether the verdict is favourable; None if there is none
    margins: tuple[Quantity, ...] = field(default=(), repr=False)
    reason: str = ""
    cause: str = ""  # the reason in words that can be counted; empty if the reason is that already


class Records(Shown, tuple[Record, ...]):
    """Records in the order of their candidates."""

    def _told(self) -> tuple[str, list[tuple[str, str]]]:
        return "Records", [(f"no. {r.number}", r.verdict or r.reason or r.status) for r in self]


@dataclass(frozen=True, slots=True)
class Finding:
    """Something the first screen of the page and of the terminal says: a sentence, or a number and what it counts."""

    text: str  # the sentence; with a value its caption
    good: bool | None = None  # whether it is favourable; None if it is neither
    value: str = ""  # printed large, over the caption; empty for a sentence


@dataclass(frozen=True, slots=True, repr=False)
class Table(Shown):
    """A table of the report: strings, ready to print."""

    title: str
    columns: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    note: str = ""
    findings: tuple[Finding, ...] = ()  # what the first screen says about it

    def _told(self) -> tuple[str, list[tuple[str, str]]]:
        return self.title, [(line[0], " | ".join(line[1:])) for line in (self.columns, *self.rows) if any(line)]


@dataclass(frozen=True, slots=True, eq=False)
class Columns:
    """Numbers by the column, for files rather than for the page: curves, a survey of many dimension sets.

    Those of one candidate are written at once, as ``<name>/part-<number>.csv``; from then on a `Part` stands for them.
    """

    name: str  # of the files: ``<name>.csv``, ``<name>.parquet``
    columns: Mapping[str, Any]  # header with its unit, as in ``"crank [deg]"``, to a sequence; all of one length


@dataclass(frozen=True, slots=True)
class Part:
    """Columns of one candidate that are in files."""

    name: str  # of the columns, and of the folder beside the report
    rows: int
    files: tuple[tuple[str, str], ...]  # path below the report folder, and SHA-256 of the content


@dataclass(frozen=True, slots=True)
class Picture:
    """An inline SVG with a title and a caption, and the place it takes on the page: small ones stand in rows."""

    title: str
    svg: str = field(repr=False)
    caption: str = ""
    size: Literal["small", "normal", "wide"] = "normal"

    def _repr_svg_(self) -> str:
        return self.svg


@dataclass(frozen=True, slots=True)
class Attempt:
    """The outcome of one step for one candidate: a value, or the reason why there is none."""

    candidate: Candidate
    value: Any = None
    reason: str = ""

    @property
    def failed(self) -> bool:
        """Whether the step gave a reason instead of a value."""
        return bool(self.reason)


def each(attempts: Iterable[Attempt], step: Callable[[Any], Any]) -> tuple[Attempt, ...]:
    """Apply `step` to every value; a candidate that fails keeps its reason and does not stop the others.

    Any exception counts: whatever goes wrong with one candidate is recorded under its name and shown in the report.

    >>> ok, bad = each([Attempt(None, 2.0), Attempt(None, 0.0)], lambda x: 1 / x)
    >>> ok.value, bad.reason
    (0.5, 'ZeroDivisionError: float division by zero')
    """
    done = []
    for attempt in attempts:
        if not attempt.failed:
            try:
                attempt = replace(attempt, value=step(attempt.value))
            except Exception as error:
                words = "" if isinstance(error, GraphsynthError) else f"{type(error).__name__}: "
                attempt = replace(attempt, value=None, reason=f"{words}{error}")
        done.append(attempt)
    return tuple(done)


def exact(name: str, value: float, unit: str = "") -> Quantity:
    """Return a quantity that carries no rounding (a count, an order)."""
    return Quantity(name, value, unit, "exact", 0.0)


@dataclass(frozen=True, slots=True)
class Objective:
    """One thing to rank by: a margin of the records, whether less, more or a value is wanted, and its weight."""

    quantity: str
    goal: Literal["min", "max"] | float
    weight: float = 1.0


@dataclass(frozen=True, slots=True)
class Ranking:
    """Records in the order of preference; all but `objectives` and `unranked` in that order, the best first."""

    objectives: tuple[Objective, ...]
    numbers: tuple[int, ...]  # candidates with all objectives
    scores: tuple[float, ...]  # weighted mean of the objectives, each scaled to 0 (worst of all) .. 1 (best of all)
    front: tuple[int, ...]  # candidates that no other one beats in every objective (Pareto front)
    values: tuple[tuple[float, ...], ...]  # of each objective
    unranked: tuple[tuple[int, str], ...] = ()  # assessed candidates without some objective, and which
    places: tuple[tuple[int, ...], ...] = ()  # by objective, how many of all ranked ones are better
    ranked: int = 0  # how many were ranked: `numbers` may be the first of them only
    front_size: int = 0
