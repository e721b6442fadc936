"""Measure the problems of a scene; the report as data and as lines for a terminal."""

from __future__ import annotations

import json
import math
import os
import platform
import sys
from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from time import perf_counter
from typing import TYPE_CHECKING, Any

from graphsynth.core.errors import GraphsynthError, SceneError
from graphsynth.evidence.choice import Knee, advice, knees, seconds_text
from graphsynth.evidence.rows import Effort, Plan, Problem, frame_of

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
        return frame_of(self.problems)

    def document(self) -> dict[str, Any]:
        """Return everything as plain data for JSON; numbers that do not exist are null."""
        problems = [
            {
                **{key: getattr(problem, key) for key in ("name", "question", "unit", "per", "note")},
                "rows": [{k: _plain(v) for k, v in row.items()} for row in problem.to_pandas().to_dict("records")],
                "advice": self.advice[problem.name],
                "knees": [
                    {"method": k.method, "knee": k.knee.setting, "verdict": k.verdict, "sentence": k.sentence}
                    for k in self.knees[problem.name]
                ],
            }
            for problem in self.problems
        ]
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
    from importlib.metadata import PackageNotFoundError, version

    versions = []
    for name in ("numpy", "scipy", "numba", "mpmath", "python-flint"):
        with suppress(PackageNotFoundError):
            versions.append(f"{name} {version(name)}")
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
        names = (line.partition(":")[2].strip() for line in lines if line.startswith("model name"))
        processor = next(names, sys.platform)
    except OSError:
        processor = platform.processor() or platform.machine()
    python = f"Python {platform.python_version()}"
    return f"{processor}, {os.cpu_count()} threads (one used), {python}, {', '.join(versions)}"


def summary(report: AccuracyReport) -> Iterable[str]:
    """Return the lines for a terminal: each problem, a sentence for each method, the defaults."""
    for problem in report.problems:
        yield f"{problem.name}: {problem.question} (measured in {report.times.get(problem.name, 0.0):.1f} s)"
        yield from (f"  {sentence}" for sentence in report.advice[problem.name].values())
        yield from (f"  default: {k.sentence}" for k in report.knees[problem.name] if k.default)
        if problem.note:
            yield f"  {problem.note}"
    yield from (f"left out: {name}: {reason}" for name, reason in report.left_out)


_CSS = """
:root{color-scheme:light dark;--ink:#1b2733;--soft:#5b6875;--paper:#fff;--rule:#d5dbe1;--bad:#b34700}
@media (prefers-color-scheme:dark){:root{--ink:#e6edf3;--soft:#9aa7b4;--paper:#12181f;--rule:#323d48;--bad:#f0883e}}
body{margin:0;background:var(--paper);color:var(--ink);
font:16px/1.5 system-ui,-apple-system,"Segoe UI",Roboto,sans-serif}
main{max-width:62rem;margin:0 auto;padding:1.2rem 1rem 3rem}
h1{font-size:1.6rem;line-height:1.2}
h2{font-size:1.2rem;margin:2.4rem 0 .5rem;border-top:1px solid var(--rule);padding-top:.9rem}
p,li{max-width:48rem}.soft{color:var(--soft);font-size:.875rem}
figure{margin:.8rem 0}
figure svg{display:block;width:100%;height:auto;max-width:56rem;margin:0 auto}
.scroll{overflow-x:auto}table{border-collapse:collapse;font-size:.85rem;font-variant-numeric:tabular-nums}
th,td{text-align:left;vertical-align:top;padding:.25rem .9rem .25rem 0;border-bottom:1px solid var(--rule)}
th{color:var(--soft)}td.num{white-space:nowrap}.bad{color:var(--bad)}
details{margin:.6rem 0}summary{cursor:pointer;font-weight:600}
"""
_PAGE = """<h1>{{ title }}</h1>
<p class="soft">{{ report.machine }}. Measured in {{ "%.0f" | format(report.seconds) }} s. Times are wall times,
the best of the rounds, with everything compiled. Every sentence is computed from the rows below it.</p>
{%- for problem in report.problems -%}
{%- set defaults = report.knees[problem.name] | selectattr("default") | map(attribute="sentence") | list -%}
{%- set extra = more(problem) -%}
<h2>{{ problem.name }}</h2><p>{{ problem.question }}</p>
<figure>{{ pictures[problem.name] | drawing }}</figure><ul>
{%- for text in report.advice[problem.name].values() %}<li>{{ text }}</li>{% endfor %}</ul>
{%- if defaults %}<p class="soft">Defaults:</p><ul>
{%- for text in defaults %}<li>{{ text }}</li>{% endfor %}</ul>{% endif %}
{%- if problem.note %}<p class="soft">{{ problem.note }}</p>{% endif -%}
<details><summary>{{ problem.rows | length }} rows</summary><div class="scroll"><table><thead><tr>
{%- for name in ["method", "setting", "error, " + problem.unit, "time of one " + problem.per, "status"] + extra
+ ["error is", "against"] %}<th scope="col">{{ name }}</th>{% endfor %}</tr></thead><tbody>
{%- for row in problem.rows -%}
<tr{% if row.reason %} class="bad"{% endif %}><td>{{ row.method }}</td>
<td>{{ row.setting }}{% if row.default %} (default){% endif %}</td><td class="num">{{ row.error | number }}</td>
<td class="num">{% if row.rounds %}{{ row.seconds | seconds }}, best of {{ row.rounds }}{% endif %}</td>
<td>{{ row.status.value }}{% if row.reason %}: {{ row.reason }}{% endif %}</td>
{%- for name in extra %}<td class="num">{{ row.more.get(name, nan) | number }}</td>{% endfor -%}
<td>{{ row.kind }}</td><td>{{ row.reference }}</td></tr>
{%- endfor %}</tbody></table></div></details>
{%- endfor %}
{%- if report.left_out %}<h2>Left out</h2><ul>
{%- for name, reason in report.left_out %}<li><b>{{ name }}</b>: {{ reason }}</li>{% endfor %}</ul>{% endif %}"""


def page(report: AccuracyReport, pictures: Mapping[str, str]) -> str:
    """Return ``accuracy.html``: for each problem the picture (SVG by name), a sentence for each method, and all rows.

    One file without outside resources, readable on a phone; values are escaped.
    """
    from graphsynth.drawing.pages import template, whole_page
    from graphsynth.drawing.palette import STYLE

    title = f"Error against run time: {report.scene}"

    def number(value: float) -> str:
        if math.isnan(value):
            return ""
        return f"{value:.0f}" if value == round(value) and abs(value) < 1e6 else f"{value:.2e}"

    def more(problem: Problem) -> list[str]:
        return list(dict.fromkeys(name for row in problem.rows for name in row.more))

    body = template(_PAGE, number=number, seconds=seconds_text).render(
        report=report, title=title, pictures=pictures, more=more, nan=math.nan
    )
    return whole_page(title, _CSS + STYLE, body)


def write_report(report: AccuracyReport, folder: Path) -> tuple[Path, ...]:
    """Write ``accuracy.csv``, ``.json``, ``.html`` and a PNG and SVG for each problem; return the files.

    Parameters
    ----------
    report : AccuracyReport
    folder : Path
        Made if it is missing; files of an earlier run are replaced.

    Returns
    -------
    tuple of Path
    """
    from graphsynth.drawing.plots import themed_svg
    from graphsynth.evidence.pictures import work_precision_picture

    folder.mkdir(parents=True, exist_ok=True)
    files = [folder / "accuracy.csv", folder / "accuracy.json", folder / "accuracy.html"]
    report.to_pandas().to_csv(files[0], index=False)
    files[1].write_text(json.dumps(report.document(), indent=1, ensure_ascii=False) + "\n", encoding="utf-8")
    pictures = {}
    for problem in report.problems:
        figure = work_precision_picture(problem)
        pictures[problem.name] = themed_svg(figure)
        files += [folder / f"{problem.name}.{suffix}" for suffix in ("png", "svg")]
        figure.savefig(files[-2], dpi=150)
        files[-1].write_text(pictures[problem.name], encoding="utf-8")
    files[2].write_text(page(report, pictures), encoding="utf-8")
    return tuple(files)
