"""Running stress cases: each one by itself, whatever the others do."""

from __future__ import annotations

import math
import signal
import threading
import warnings
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from time import perf_counter
from types import FrameType
from typing import TYPE_CHECKING, Any

from graphsynth.core.errors import MissingExtraError
from graphsynth.evidence.stress.cases import Case, stress_cases
from graphsynth.evidence.stress.checks import SEVERITY, CaseStatus, Check, Checks

if TYPE_CHECKING:
    import pandas as pd


@dataclass(frozen=True)
class CaseOutcome:
    """What a case gave.

    Attributes
    ----------
    case : Case
    checks : tuple of Check
    seconds : float
        Wall time, with imports and compilation if they came first here.
    reason : str
        Why the case did not end, or did not run; empty if it ended.
    missing : bool
        It did not end because an extra of the package is not installed.
    """

    case: Case
    checks: tuple[Check, ...]
    seconds: float
    reason: str = ""
    missing: bool = False

    @property
    def status(self) -> CaseStatus:
        """The worst status of the checks; WRONG if there are none, or if the case did not end for want of no extra."""
        worst = max((check.status for check in self.checks), key=SEVERITY.index, default=CaseStatus.OK)
        if self.missing and worst is not CaseStatus.WRONG:
            return CaseStatus.NOT_RUN
        return CaseStatus.WRONG if self.reason or not self.checks else worst

    @property
    def worst(self) -> Check | None:
        """The wrong check, or the number nearest to its bound; None without numbers."""
        wrong = [check for check in self.checks if check.status is CaseStatus.WRONG]
        numbers = [check for check in self.checks if not math.isnan(check.error)]
        if wrong or not numbers:
            return wrong[0] if wrong else None
        return max(numbers, key=lambda c: c.error and (c.error / c.bound if c.bound else math.inf))

    def summary(self) -> dict[str, Any]:
        """Plain data of the outcome with all its checks; numbers that are none are None."""
        return {
            "name": self.case.name,
            "title": self.case.title,
            "status": self.status.value,
            "seconds": round(self.seconds, 4),
            "reason": self.reason,
            "checks": [
                {name: None if value != value else value for name, value in vars(check).items()}
                | {"status": check.status.value}
                for check in self.checks
            ],
        }


@dataclass(frozen=True)
class StressReport:
    """Outcomes of a run.

    Attributes
    ----------
    outcomes : tuple of Outcome
        One for every case that was asked for.
    left_out : tuple of Case
        Slow cases that were not asked for.
    seconds : float
        Wall time of all.
    not_reached : tuple of Case
        Cases that were asked for but not ended when the run was interrupted.
    """

    outcomes: tuple[CaseOutcome, ...]
    left_out: tuple[Case, ...]
    seconds: float
    not_reached: tuple[Case, ...] = ()

    def count(self, status: CaseStatus) -> int:
        """Return the number of cases with a status."""
        return sum(outcome.status is status for outcome in self.outcomes)

    @property
    def wrong(self) -> tuple[CaseOutcome, ...]:
        """The cases that are wrong."""
        return tuple(outcome for outcome in self.outcomes if outcome.status is CaseStatus.WRONG)

    @property
    def statement(self) -> str:
        """The result in one sentence."""
        parts = [
            f"{self.count(status)} {status.value}" for status in (CaseStatus.OK, CaseStatus.FLAGGED, CaseStatus.WRONG)
        ]
        if self.count(CaseStatus.NOT_RUN):
            parts.append(f"{self.count(CaseStatus.NOT_RUN)} not run")
        if self.left_out:
            parts.append(f"{len(self.left_out)} slow ones left out")
        if self.not_reached:
            parts.append(f"interrupted before {len(self.not_reached)} more")
        numbers = sum(len(outcome.checks) for outcome in self.outcomes)
        cases = "1 stress case" if len(self.outcomes) == 1 else f"{len(self.outcomes)} stress cases"
        return f"{cases} with {numbers} checks: {', '.join(parts)}."

    def to_pandas(self) -> pd.DataFrame:
        """Return one row per check (pandas is imported here)."""
        import pandas as pd

        columns = ["case", "title", "case_status", "case_seconds", *Check.__dataclass_fields__]
        rows: list[list[Any]] = []
        for o in self.outcomes:
            head = [o.case.name, o.case.title, o.status.value, o.seconds]
            if o.reason:
                rows.append([*head, "the case itself", "it ends", o.reason, "", math.nan, math.nan, o.status.value])
            rows += [[*head, c.what, c.right, c.given, c.source, c.error, c.bound, c.status.value] for c in o.checks]
        return pd.DataFrame(rows, columns=columns)

    def summary(self) -> dict[str, Any]:
        """Plain data for a JSON file."""
        return {
            "statement": self.statement,
            "counts": {status.value: self.count(status) for status in SEVERITY},
            "left_out": [case.name for case in self.left_out],
            "not_reached": [case.name for case in self.not_reached],
            "seconds": round(self.seconds, 3),
            "cases": [outcome.summary() for outcome in self.outcomes],
        }


def run_case(case: Case) -> CaseOutcome:
    """Run one case; whatever it raises becomes its reason.

    Warnings are not shown: what a case returns counts, whatever a library warns about.

    Parameters
    ----------
    case : Case
        One of `stress_cases`.

    Returns
    -------
    Outcome
        Its comparisons, or the reason why it was not run or failed; time and status.
    """
    section = case.name.partition("-")[2].partition(".")[0]
    checks = Checks(f"{case.page_title}, section {section}")
    start, reason, missing = perf_counter(), "", False
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            case.load()(checks)
    except MissingExtraError as error:
        missing, reason = True, str(error)
    except Exception as error:  # a defect of the library is a result of a stress run, not its end
        reason = f"{type(error).__name__}: {error}"
    return CaseOutcome(case, tuple(checks.rows), perf_counter() - start, reason, missing)


def run_stress(
    names: Iterable[str] = (),
    *,
    slow: bool = True,
    files: Iterable[Path] = (),
    progress: Callable[[Case, int, int], None] | None = None,
) -> StressReport:
    """Run stress cases one after the other.

    Parameters
    ----------
    names : iterable of str
        See `stress_cases`; none: all.
    slow : bool
        With False, slow cases are left out, and listed in ``left_out``.
    files : iterable of Path
        Files of own cases, run instead of the shipped ones; they are programs, so name only files that you trust.
    progress : callable, optional
        Called before each case with the case, its number from 0, and how many there are.

    Returns
    -------
    StressReport
        Never raises for what happens inside of a case: it is then WRONG, with the reason.  After Ctrl-C it holds what
        was run until then, and the rest in ``not_reached``.

    Raises
    ------
    SpecError
        A name that fits no case.

    Examples
    --------
    >>> report = run_stress(["structure-2.1"])
    >>> report.statement
    '1 stress case with 7 checks: 1 ok, 0 flagged, 0 WRONG.'
    """
    names, files = list(names), list(files)
    chosen = stress_cases(names, slow=slow, files=files)
    left_out = tuple(case for case in stress_cases(names, files=files) if case not in chosen)
    start = perf_counter()
    outcomes: list[CaseOutcome] = []
    with _interrupts() as received, suppress(KeyboardInterrupt):
        for k, case in enumerate(chosen):
            if progress is not None:
                progress(case, k, len(chosen))
            outcome = run_case(case)
            if received:
                break
            outcomes.append(outcome)
    return StressReport(tuple(outcomes), left_out, perf_counter() - start, chosen[len(outcomes) :])


@contextmanager
def _interrupts() -> Iterator[list[int]]:
    """Note Ctrl-C, which raises KeyboardInterrupt as always: compilers turn it into exceptions of their own."""
    received: list[int] = []

    def handler(number: int, frame: FrameType | None) -> None:
        received.append(number)
        raise KeyboardInterrupt

    if threading.current_thread() is not threading.main_thread():
        yield received
        return
    before = signal.signal(signal.SIGINT, handler)
    try:
        yield received
    finally:
        signal.signal(signal.SIGINT, before)
