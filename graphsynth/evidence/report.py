"""Measure the problems of a scene; the report as data and as lines for a terminal."""

from __future__ import annotations

import math
import os
import platform
import sys
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from time import perf_counter
from typing import TYPE_CHECKING, Any

from graphsynth.core.errors import GraphsynthError, SceneError
from graphsynth.evidence.choice import Knee, advice, knees
from graphsynth.evidence.rows import Effort, Plan, Problem, table

if TYPE_CHECKING:
    import pandas as pd

#: Told before each problem (``done`` of ``total``), and once more at the end.
Progress = Callable[[str, int, int], None]


@dataclass(frozen=True)
class AccuracyReport:
    """Everything measured about one scene.

    Attributes
    ----------
    scene : str
    problems : tuple of Problem
    left_out : tuple of (str, str)
        Problems that do not exist for this scene, with the reason.
    seconds : float
        Wall time of the whole.
    machine : str
        Processor, threads and versions, in one line.
    times : mapping of str to float
        Wall time of each measurement, reference, loading and compiling included.
    interrupted : bool
        Whether Ctrl-C ended the measurement; what was not finished is left out.
    """

    scene: str
    problems: tuple[Problem, ...]
    left_out: tuple[tuple[str, str], ...]
    seconds: float
    machine: str
    times: Mapping[str, float] = field(default_factory=dict)
    interrupted: bool = False

    @cached_property
    def advice(self) -> dict[str, dict[str, str]]:
        """One sentence by problem and method."""
        return {problem.name: advice(problem) for problem in self.problems}

    @cached_property
    def knees(self) -> dict[str, tuple[Knee, ...]]:
        """Where the defaults stand, by problem."""
        return {problem.name: knees(problem) for problem in self.problems}

    def to_pandas(self) -> pd.DataFrame:
        """Return all rows as one table."""
        return table(self.problems)

    def document(self) -> dict[str, Any]:
        """Return everything as plain data for JSON; numbers that do not exist are null."""
        problems = []
        for problem in self.problems:
            rows = table([problem]).to_dict("records")
            problems.append(
                {
                    "name": problem.name,
                    "question": problem.question,
                    "unit": problem.unit,
                    "per": problem.per,
                    "note": problem.note,
                    "rows": [{key: _plain(v) for key, v in row.items()} for row in rows],
                    "advice": self.advice[problem.name],
                    "knees": [
                        {"method": k.method, "knee": k.knee.setting, "verdict": k.verdict, "sentence": k.sentence}
                        for k in self.knees[problem.name]
                    ],
                }
            )
        return {
            "scene": self.scene,
            "machine": self.machine,
            "seconds": round(self.seconds, 3),
            "measured in": {name: round(value, 3) for name, value in self.times.items()},
            "problems": problems,
            "left_out": [list(pair) for pair in self.left_out],
            "interrupted": self.interrupted,
        }


def _plain(value: Any) -> Any:
    return None if isinstance(value, float) and not math.isfinite(value) else value


def measure(
    context: Any, plans: Sequence[Plan], effort: Effort | None = None, progress: Progress | None = None
) -> AccuracyReport:
    """Measure the problems of a scene one after the other.

    Parameters
    ----------
    context : object
        With the scene as ``context.scene``.
    plans : sequence of Plan
        As `graphsynth.pipeline.system.plans_of` gives them.
    effort : Effort, optional
    progress : callable, optional
        Called as ``progress(name, done, total)``.

    Returns
    -------
    AccuracyReport
        A problem that a scene's numbers do not pose (no jam, no crossing) is left out with its reason, and so is one
        whose measurement fails.  Ctrl-C ends the measurement; what is finished is kept.

    Raises
    ------
    SceneError
        If the scene cannot be built.
    KeyboardInterrupt
        Ctrl-C before the first problem is finished.
    """
    begin, interrupted, times = perf_counter(), False, {}
    found: list[Problem] = []
    left_out: list[tuple[str, str]] = []
    effort = effort or Effort()
    for done, plan in enumerate(plans):
        if progress:
            progress(plan.name, done, len(plans))
        start = perf_counter()
        try:
            found.append(replace(plan.load()(context, effort), name=plan.name))
        except SceneError:
            raise
        except (KeyboardInterrupt, Exception) as error:
            interrupted = _by_hand(error)
            if interrupted and not found:
                raise
            left_out.append((plan.name, "interrupted" if interrupted else _why(error)))
        times[plan.name] = perf_counter() - start
        if interrupted:
            left_out += [(rest.name, "not begun: interrupted") for rest in plans[done + 1 :]]
            break
    if progress:
        progress("done", len(plans), len(plans))
    return AccuracyReport(
        context.scene.name, tuple(found), tuple(left_out), perf_counter() - begin, _machine(), times, interrupted
    )


def _by_hand(error: BaseException | None) -> bool:
    """Whether Ctrl-C is behind an exception: the compiler of the kernels turns it into one of its own."""
    while error is not None and not isinstance(error, KeyboardInterrupt):
        error = error.__cause__ or error.__context__
    return error is not None


def _why(error: BaseException) -> str:
    """Reason in one line; anything but an error of the library is named as a failure."""
    text = " ".join(str(error).split())
    return text if isinstance(error, GraphsynthError) else f"failed: {type(error).__name__}: {text}"


def _machine() -> str:
    from importlib.metadata import version

    packages = ("numpy", "scipy", "numba", "mpmath", "python-flint")
    versions = ", ".join(f"{name} {version(name)}" for name in packages if _installed(name))
    return f"{_processor()}, {os.cpu_count()} threads (one used), Python {platform.python_version()}, {versions}"


def _installed(name: str) -> bool:
    from importlib.metadata import PackageNotFoundError, distribution

    try:
        distribution(name)
    except PackageNotFoundError:
        return False
    return True


def _processor() -> str:
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
    except OSError:
        return platform.processor() or platform.machine()
    return next((line.partition(":")[2].strip() for line in lines if line.startswith("model name")), sys.platform)


def summary(report: AccuracyReport) -> Iterable[str]:
    """Return the lines for a terminal: each problem, a sentence for each method, the defaults."""
    for problem in report.problems:
        yield f"{problem.name}: {problem.question} (measured in {report.times.get(problem.name, 0.0):.1f} s)"
        yield from (f"  {sentence}" for sentence in report.advice[problem.name].values())
        yield from (f"  default: {k.sentence}" for k in report.knees[problem.name] if k.default)
        if problem.note:
            yield f"  {problem.note}"
    yield from (f"left out: {name}: {reason}" for name, reason in report.left_out)
