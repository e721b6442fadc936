"""The files of a report; ``accuracy.html`` is one file without outside resources, readable on a phone."""

from __future__ import annotations

import json
import math
from collections.abc import Iterable, Mapping
from html import escape
from pathlib import Path
from typing import TYPE_CHECKING

from graphsynth.drawing.pages import whole_page
from graphsynth.drawing.palette import STYLE
from graphsynth.drawing.svg import bare
from graphsynth.evidence.choice import seconds_text
from graphsynth.evidence.rows import Problem, Row

if TYPE_CHECKING:
    from graphsynth.evidence.report import AccuracyReport

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


def page(report: AccuracyReport, pictures: Mapping[str, str]) -> str:
    """Return the page: for each problem the picture, a sentence for each method, and all rows.

    Parameters
    ----------
    report : AccuracyReport
    pictures : mapping of str to str
        SVG by name of the problem.
    """
    title = f"Error against run time: {report.scene}"
    parts = [
        f"<h1>{escape(title)}</h1>",
        f'<p class="soft">{escape(report.machine)}. Measured in {report.seconds:.0f} s. Times are wall times, '
        "the best of the rounds, with everything compiled. Every sentence is computed from the rows below it.</p>",
        *(_problem(report, problem, pictures[problem.name]) for problem in report.problems),
    ]
    if report.left_out:
        items = "".join(f"<li><b>{escape(name)}</b>: {escape(reason)}</li>" for name, reason in report.left_out)
        parts.append(f"<h2>Left out</h2><ul>{items}</ul>")
    return whole_page(title, _CSS + STYLE, "\n".join(parts))


def _problem(report: AccuracyReport, problem: Problem, svg: str) -> str:
    sentences = "".join(f"<li>{escape(text)}</li>" for text in report.advice[problem.name].values())
    defaults = "".join(f"<li>{escape(k.sentence)}</li>" for k in report.knees[problem.name] if k.default)
    note = f'<p class="soft">{escape(problem.note)}</p>' if problem.note else ""
    kept = f'<p class="soft">Defaults:</p><ul>{defaults}</ul>' if defaults else ""
    return (
        f"<h2>{escape(problem.name)}</h2><p>{escape(problem.question)}</p>"
        f"<figure>{bare(svg)}</figure><ul>{sentences}</ul>{kept}{note}{_rows(problem)}"
    )


def _rows(problem: Problem) -> str:
    extra = list(dict.fromkeys(name for row in problem.rows for name in row.more))
    head = [
        "method",
        "setting",
        f"error, {problem.unit}",
        f"time of one {problem.per}",
        "status",
        *extra,
        "error is",
        "against",
    ]
    cells = "".join(_row(row, extra) for row in problem.rows)
    names = "".join(f'<th scope="col">{escape(name)}</th>' for name in head)
    return (
        f"<details><summary>{len(problem.rows)} rows</summary>"
        f'<div class="scroll"><table><thead><tr>{names}</tr></thead><tbody>{cells}</tbody></table></div></details>'
    )


def _row(row: Row, extra: Iterable[str]) -> str:
    bad = ' class="bad"' if row.reason else ""
    status = f"{row.status.value}: {row.reason}" if row.reason else row.status.value
    setting = f"{row.setting} (default)" if row.default else row.setting
    numbers = [_number(row.error), f"{seconds_text(row.seconds)}, best of {row.rounds}" if row.rounds else ""]
    own = "".join(f'<td class="num">{escape(_number(row.more.get(name, math.nan)))}</td>' for name in extra)
    return (
        f"<tr{bad}><td>{escape(row.method)}</td><td>{escape(setting)}</td>"
        + "".join(f'<td class="num">{escape(text)}</td>' for text in numbers)
        + f"<td>{escape(status)}</td>{own}<td>{escape(row.kind)}</td><td>{escape(row.reference)}</td></tr>"
    )


def _number(value: float) -> str:
    if math.isnan(value):
        return ""
    return f"{value:.0f}" if value == round(value) and abs(value) < 1e6 else f"{value:.2e}"


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
    from graphsynth.drawing.figures import themed_svg
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
