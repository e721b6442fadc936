"""``stress.html`` and ``stress.csv`` of a run: self-contained, readable on a phone."""

from __future__ import annotations

import math
from pathlib import Path

import graphsynth
from graphsynth.drawing.pages import template, whole_page
from graphsynth.evidence.stress.checks import SEVERITY, CaseStatus
from graphsynth.evidence.stress.running import CaseOutcome, StressReport

_CSS = """
:root{color-scheme:light dark;--ink:#1b2733;--soft:#5b6875;--paper:#fff;--card:#f5f7f9;--rule:#d5dbe1;
--good:#00735a;--told:#0b66b0;--bad:#b3261e;--none:#8a6100}
@media (prefers-color-scheme:dark){:root{--ink:#e6edf3;--soft:#9aa7b4;--paper:#12181f;--card:#1a222b;--rule:#323d48;
--good:#3ecf9f;--told:#69b3ff;--bad:#ff8a80;--none:#e0b050}}
*{box-sizing:border-box}
body{margin:0;background:var(--paper);color:var(--ink)}
body{font:16px/1.5 system-ui,-apple-system,"Segoe UI",Roboto,sans-serif}
main{max-width:66rem;margin:0 auto;padding:1.25rem 1rem 3rem}
h1{font-size:1.65rem;margin:.4rem 0}h2{font-size:1.2rem;margin:2rem 0 .5rem}
p{margin:.4rem 0 .8rem;max-width:46rem}.soft{color:var(--soft);font-size:.875rem}
.facts{display:flex;flex-wrap:wrap;gap:.6rem;margin:1rem 0;padding:0;list-style:none}
.facts li{background:var(--card);border-radius:.5rem;padding:.5rem .9rem}.facts b{display:block;font-size:1.3rem}
details{border-bottom:1px solid var(--rule);padding:.3rem 0}
summary,.head{display:grid;grid-template-columns:10.5rem 1fr 5rem 10rem 4rem;gap:.2rem .8rem;align-items:baseline}
summary{cursor:pointer;list-style:none}summary::-webkit-details-marker{display:none}
summary code::before{content:"\\25B8";display:inline-block;width:1.1em;color:var(--soft)}
details[open] summary code::before{content:"\\25BE"}
summary span:nth-child(n+4),.head span:nth-child(n+4){text-align:right;font-variant-numeric:tabular-nums}
summary span:nth-child(n+4),.head{color:var(--soft);font-size:.875rem}
.ok{color:var(--good)}.flagged{color:var(--told)}.WRONG{color:var(--bad);font-weight:700}.not-run{color:var(--none)}
.scroll{overflow-x:auto;margin:.4rem 0 .8rem}
table{border-collapse:collapse;font-size:.8rem;font-variant-numeric:tabular-nums}
th,td{text-align:left;vertical-align:top;padding:.2rem .9rem .2rem 0;border-bottom:1px solid var(--rule)}
th{color:var(--soft);font-weight:600}td{overflow-wrap:anywhere}td.num{text-align:right}
td.num,td.ok,td.flagged,td.WRONG,td.not-run{white-space:nowrap}th,td{min-width:4.5em}
code{font-size:.9em}
@media (max-width:46rem){.head{display:none}summary{grid-template-columns:1fr auto}
summary span:nth-child(2){grid-row:2;grid-column:1/-1}summary span:nth-child(4){grid-row:3;text-align:left}
summary span:nth-child(4):not(:empty)::before{content:"error "}summary span:nth-child(5){grid-row:3}
table,tbody,tr,td{display:block}thead{display:none}tr{border-bottom:1px solid var(--rule);padding:.35rem 0}
td,td.num{border:0;padding:0;text-align:left;white-space:normal}td:empty{display:none}
td[data-name]::before{content:attr(data-name) ": ";color:var(--soft)}td:first-child{font-weight:600}}
"""

_PAGE = """<h1>Stress cases</h1><p>{{ report.statement }}</p>
<p>Each case compares results of the library with the right values, which come from printed tables, closed forms or
computations with many digits. <b>ok</b>: all numbers are within the error allowed. <b>flagged</b>: the situation is
extreme, and the library reports it as required. <b>WRONG</b>: anything else. Open a case to see its comparisons.</p>
{%- if left %}<p>Left out because they are slow: {{ left }}.</p>{% endif %}
{%- if lost %}<p class="not-run">Interrupted, not reached: {{ lost }}.</p>{% endif %}<ul class="facts">
{%- for status, number in facts %}<li><b class="{{ status | css if number else "ok" }}">{{ number }}</b>
{{- status.value }}</li>{% endfor %}<li><b>{{ "%.0f" | format(report.seconds) }} s</b>run time</li></ul>
{%- for title, outcomes in pages.items() %}<h2>{{ title }}</h2><div class="head"><span>case</span><span>what</span>
<span>status</span><span>error of allowed</span><span>time</span></div>
{%- for outcome in outcomes -%}
<details{% if outcome.status.value == "WRONG" %} open{% endif %} id="{{ outcome.case.name }}"><summary>
<span><code>{{ outcome.case.name }}</code></span><span>{{ outcome.case.title }}</span>
<span class="{{ outcome.status | css }}">{{ outcome.status.value }}</span><span>{{ outcome | worst }}</span>
<span>{{ "%.2f" | format(outcome.seconds) }} s</span></summary>
{%- if outcome.reason %}<p class="{{ outcome.status | css }}">{{ outcome.reason }}</p>{% endif -%}
<div class="scroll"><table><thead><tr><th>what</th><th>right</th><th>given</th><th>error</th><th>allowed</th>
<th>status</th><th>source of the right value</th></tr></thead><tbody>
{%- for check in outcome.checks %}<tr><td>{{ check.what }}</td><td data-name="right">{{ check.right }}</td>
<td data-name="given">{{ check.given }}</td>
{%- for name, value in (("error", check.error), ("allowed", check.bound)) %}
{%- if check.error == check.error %}<td class="num" data-name="{{ name }}">{{ "%.2e" | format(value) }}</td>
{%- else %}<td></td>{% endif %}{% endfor -%}
<td class="{{ check.status | css }}">{{ check.status.value }}</td>
<td data-name="source of the right value">{{ check.source }}</td></tr>
{%- endfor %}</tbody></table></div></details>
{%- endfor %}{% endfor %}<p class="soft">graphsynth {{ version }}</p>"""


def stress_html(report: StressReport) -> str:
    """Return the page of a run as one string; values are escaped, nothing is loaded from elsewhere."""
    pages: dict[str, list[CaseOutcome]] = {}
    for outcome in report.outcomes:
        pages.setdefault(outcome.case.page_title, []).append(outcome)
    facts = [(status, report.count(status)) for status in SEVERITY]
    left, lost = (", ".join(case.name for case in cases) for cases in (report.left_out, report.not_reached))
    body = template(_PAGE, css=_class, worst=_worst).render(
        report=report,
        pages=pages,
        facts=[(status, number) for status, number in facts if number or status is CaseStatus.WRONG],
        left=left,
        lost=lost,
        version=graphsynth.__version__,
    )
    return whole_page("Stress cases", _CSS, body)


def write_report(report: StressReport, folder: Path) -> tuple[Path, Path]:
    """Write ``stress.html`` and ``stress.csv`` (a row per check) into a folder; return both paths."""
    folder.mkdir(parents=True, exist_ok=True)
    html, csv = folder / "stress.html", folder / "stress.csv"
    html.write_text(stress_html(report), encoding="utf-8")
    report.to_pandas().to_csv(csv, index=False)
    return html, csv


def _class(status: CaseStatus) -> str:
    return status.value.replace(" ", "-")


def _worst(outcome: CaseOutcome) -> str:
    worst = outcome.worst
    if not worst or math.isnan(worst.error):
        return ""
    return f"{worst.error:.1e} of {worst.bound:.1e}" if worst.error or worst.bound else "none: exact"
