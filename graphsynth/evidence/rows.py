"""What a measurement of error against run time is made of: rows, the problems they belong to, and plans of problems.

A plan is a string, imported when the problem is measured.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass, field
from enum import StrEnum
from importlib import import_module
from time import perf_counter
from typing import TYPE_CHECKING, Any, TypeVar

from graphsynth.core.errors import SceneError, SpecError

if TYPE_CHECKING:
    import pandas as pd

T = TypeVar("T")

#: Errors below this are drawn and compared as this: the rounding of a number of size one.
FLOOR = 2.0**-53


class RowStatus(StrEnum):
    """What became of a run: an error can be trusted for what it is only where the run is ``OK``."""

    OK = "ok"
    UNRELIABLE = "unreliable"  #: it says success, but the result is wrong or worse than it claims
    FAILED = "failed"  #: it stopped, refused, or left the question undecided


@dataclass(frozen=True)
class Row:
    """One run of one method at one setting.

    Attributes
    ----------
    method, setting : str
        The setting in words, with its unit; "" if the method has none.
    error : float
        In the unit of the problem; NaN if there is no result.
    seconds : float
        Wall time, best of ``rounds``; NaN if nothing was timed.
    rounds : int
        Runs timed.
    kind : str
        What the error is: "distance from the reference", "proved width", ...
    reference : str
        What it was measured against; "" if the error needs none because it is proved.
    status : RowStatus
    reason : str
        Why it is not ok.
    default : bool
        Whether this is the setting that the library takes when none is given.
    proved : bool
        Whether the method proves its result.
    more : mapping of str to float
        Further columns: events, drift, energy, calls, ...
    value : float
        The setting as a number: a tolerance, a step; NaN if it is none.
    """

    method: str
    setting: str
    error: float
    seconds: float
    rounds: int = 1
    kind: str = "distance from the reference"
    reference: str = ""
    status: RowStatus = RowStatus.OK
    reason: str = ""
    default: bool = False
    proved: bool = False
    more: Mapping[str, float] = field(default_factory=dict)
    value: float = math.nan

    @classmethod
    def of(cls, method: str, setting: str, error: float, timed: Sequence[float], why: str = "", **more: Any) -> Row:
        """Return the row of a run that `best_of` has timed.

        Parameters
        ----------
        method, setting, error
            As above.
        timed : sequence of float
            Seconds and rounds.
        why : str
            Why it failed, or is what ``status`` says; empty if it is ok.
        more
            Other attributes, and ``many``: results of one run, which share its seconds.
        """
        seconds, status = timed[0] / more.pop("many", 1), more.pop("status", RowStatus.FAILED)
        more["status"] = status if why else RowStatus.OK
        return cls(method, setting, error, seconds, int(timed[1]), reason=why, **more)

    @property
    def good(self) -> bool:
        """Whether error and time may be compared with others."""
        return self.status is RowStatus.OK and math.isfinite(self.error) and math.isfinite(self.seconds)

    @property
    def label(self) -> str:
        """Method and setting.

        >>> Row("sweep", "0.1 rad", 0.1, 0.002, 3, "proved width", "").label
        'sweep (0.1 rad)'
        """
        return f"{self.method} ({self.setting})" if self.setting else self.method


@dataclass(frozen=True)
class Problem:
    """One question, and every run of every method that answers it.

    Attributes
    ----------
    name : str
        Short; names the files.
    question : str
        What is computed, for which data.
    unit : str
        Of the error: "mm", "rad", "relative", ...
    rows : tuple of Row
    per : str
        What the seconds are for: "run", "pose", ...
    note : str
        What else a reader must know.
    count : str
        Name of a column of ``more`` that the plot takes as abscissa, against the time; "" for error against time.
    over : str
        Name of a column of ``more`` that the plot takes as abscissa of the error: how hard the problem is.
    sentences : mapping of str to str
        What the rows say by method, where it is no choice of a setting; made from the rows by who made them.
    """

    name: str
    question: str
    unit: str
    rows: tuple[Row, ...]
    per: str = "run"
    note: str = ""
    count: str = ""
    over: str = ""
    sentences: Mapping[str, str] = field(default_factory=dict)

    @property
    def floor(self) -> float:
        """Errors below it count as equal: rounding, where the error is relative or an angle."""
        return 1e-15 if self.unit in ("relative", "rad") else FLOOR

    @property
    def methods(self) -> tuple[str, ...]:
        """Methods in the order of their first row."""
        return tuple(dict.fromkeys(row.method for row in self.rows))

    def of(self, method: str) -> tuple[Row, ...]:
        """Rows of one method."""
        return tuple(row for row in self.rows if row.method == method)

    def order(self, method: str) -> float:
        """Observed order of a method: slope of the error over the setting between first and last good row."""
        good = [row for row in self.of(method) if row.good]
        if len(good) < 2:
            return math.nan
        return math.log(good[0].error / good[-1].error) / math.log(good[0].value / good[-1].value)

    def to_pandas(self) -> pd.DataFrame:
        """Return the rows as a table: errors in the unit of the column ``unit``, times in seconds.

        Examples
        --------
        >>> row = Row("sweep", "0.1 rad", 0.1, 0.002, 3, "proved width", "", more={"pieces": 12.0})
        >>> frame = Problem("arcs", "where it jams", "rad", (row,)).to_pandas()
        >>> frame[["problem", "method", "error", "unit", "pieces"]].values.tolist()
        [['arcs', 'sweep', 0.1, 'rad', 12.0]]
        """
        return frame_of([self])


@dataclass(frozen=True)
class Effort:
    """How much is spent on a measurement.

    Attributes
    ----------
    rounds : int
        Timed runs of each row, at least 1; the shortest counts.
    patience : float
        Seconds after which no further round of a row is begun.
    quick : bool
        Fewer and easier settings: a test of the measurement, not a measurement.
    """

    rounds: int = 3
    patience: float = 2.0
    quick: bool = False

    def __post_init__(self) -> None:
        if isinstance(self.rounds, bool) or not isinstance(self.rounds, int) or not 1 <= self.rounds <= 1000:
            raise SpecError(f"rounds = {self.rounds!r} must be a whole number from 1 to 1000")
        if not self.patience > 0.0:
            raise SpecError(f"patience = {self.patience!r} must be a positive number of seconds")

    def some(self, settings: Iterable[T], count: int = 3) -> tuple[T, ...]:
        """Return all settings, or ``count`` of them spread from first to last if this is quick.

        >>> Effort(quick=True).some([1, 2, 3, 4, 5]), Effort().some([1, 2])
        ((1, 3, 5), (1, 2))
        """
        every = tuple(settings)
        if not self.quick or len(every) <= count:
            return every
        return tuple(every[round(k * (len(every) - 1) / (count - 1))] for k in range(count))


def best_of(run: Callable[[], T], effort: Effort, *, warm: bool = True) -> tuple[T, float, int]:
    """Run a few times; return the last result, the shortest wall time in seconds and the number of timed runs.

    Parameters
    ----------
    run : callable
    effort : Effort
    warm : bool
        Run once before, without counting: kernels are compiled and modules loaded then.

    Examples
    --------
    >>> best_of(lambda: 7, Effort(rounds=2))[::2]
    (7, 2)
    """
    begin = perf_counter()
    if warm:
        run()
    times: list[float] = []
    while True:
        start = perf_counter()
        result = run()
        stop = perf_counter()
        times.append(stop - start)
        if len(times) >= effort.rounds or stop - begin > effort.patience:
            return result, min(times), len(times)


def frame_of(problems: Iterable[Problem]) -> pd.DataFrame:
    """Return all rows as one table; what only some problems have (events, drift, ...) is NaN elsewhere.

    Errors are in the unit of the column ``unit``, times in seconds.
    """
    import pandas as pd

    records: list[dict[str, Any]] = []
    for problem in problems:
        for row in problem.rows:
            record = asdict(row)
            more = record.pop("more")
            del record["value"]
            record["status"] = row.status.value
            records.append({"problem": problem.name, **record, "unit": problem.unit, "per": problem.per, **more})
    first = ["problem", "method", "setting", "error", "unit", "kind", "reference", "seconds", "per", "rounds", "status"]
    frame = pd.DataFrame(records, columns=None if records else [*first, "reason", "default", "proved"])
    return frame[[*first, *(name for name in frame.columns if name not in first)]]


@dataclass(frozen=True)
class Plan:
    """A problem that can be measured.

    Attributes
    ----------
    name : str
        Short; that of the problem.
    function : str
        ``"package.module:function"``, called as ``function(context, effort)``; ``context.scene`` is the scene as read.
    structure : bool
        Only for scenes with a table ``[structure]``.
    """

    name: str
    function: str
    structure: bool = False

    def load(self) -> Callable[[Any, Effort], Problem]:
        """Import the function; `imported` says what is raised."""
        return imported(self.function, f"problem {self.name!r}")


def plans(module: str, *names: str) -> tuple[Plan, ...]:
    """Return plans whose functions are in one module, each under its own name with ``_`` for ``-``."""
    return tuple(Plan(name, f"{module}:{name.replace('-', '_')}") for name in names)


def imported(text: str, who: str) -> Callable[..., Any]:
    """Import a function named as ``"package.module:function"``; a `SceneError` that begins with `who` if it is none."""
    module, _, name = text.partition(":")
    try:
        function = getattr(import_module(module), name)
    except (ImportError, AttributeError, ValueError) as error:
        raise SceneError(f"{who} names {text!r}, which cannot be imported: {error}") from error
    if not callable(function):
        raise SceneError(f"{who} names {text!r}, which is not a function")
    return function  # type: ignore[no-any-return]
