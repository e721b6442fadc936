"""``report.html``: one file, no external resources, readable on a phone, light or dark with the system."""

from __future__ import annotations

from collections.abc import Iterable
from html import escape
from typing import TYPE_CHECKING, Any

from graphsynth.drawing.pages import whole_page
from graphsynth.drawing.palette import LIGHT, STYLE
from graphsynth.drawing.svg import bare
from graphsynth.pipeline.headline import facts, sentences
from graphsynth.pipeline.products import Finding, Picture, Record, Table
from graphsynth.pipeline.summary import summary_tables

if TYPE_CHECKING:
    from graphsynth.pipeline.runner import Report

__all__ = ["report_html"]

_CSS = """
:root{color-scheme:light dark;--ink:#1b2733;--soft:#5b6875;--paper:#fff;--card:#f5f7f9;--rule:#d5dbe1;
--good:#00735a;--bad:#b34700}
@media (prefers-color-scheme:dark){:root{--ink:#e6edf3;--soft:#9aa7b4;--paper:#12181f;--card:#1a222b;--rule:#323d48;
--good:#3ecf9f;--bad:#f0883e}}
*{box-sizing:border-box}
body{margin:0;background:var(--paper);color:var(--ink);
font:16px/1.5 system-ui,-apple-system,"Segoe UI",Roboto,sans-serif}
main{max-width:66rem;margin:0 auto;padding:1.25rem 1rem 3rem}
h1{font-size:1.65rem;line-height:1.2;margin:.4rem 0 .5rem;text-wrap:balance}
h2{font-size:1.2rem;margin:2.2rem 0 .6rem;border-bottom:1px solid var(--rule);padding-bottom:.25rem}
h3{font-size:1rem;margin:1.4rem 0 .4rem}
p{margin:.4rem 0 .8rem;max-width:46rem}
.soft,figcaption,caption{color:var(--soft);font-size:.875rem}
.scroll{overflow-x:auto}
table{border-collapse:collapse;font-size:.9rem;font-variant-numeric:tabular-nums}
th,td{text-align:left;vertical-align:top;padding:.3rem .9rem .3rem 0;border-bottom:1px solid var(--rule)}
th{font-weight:600;color:var(--soft)}
td.num{white-space:nowrap}
.facts{display:flex;flex-wrap:wrap;gap:.6rem;margin:1rem 0;padding:0;list-style:none}
.facts li{background:var(--card);border-radius:.5rem;padding:.55rem .9rem;min-width:7.5rem}
.facts b{display:block;font-size:1.3rem;line-height:1.25}
.bad b,b.bad{color:var(--bad)}.good b,b.good{color:var(--good)}
.verdict{max-width:52rem;margin:.3rem 0 .6rem}.verdict b{font-size:1.1rem}
.facts span{color:var(--soft);font-size:.85rem}
.pictures{display:grid;grid-template-columns:repeat(12,1fr);gap:.9rem;align-items:stretch;margin-top:.9rem}
figure{margin:0;background:var(--card);border-radius:.5rem;padding:.7rem}
figure{grid-column:span 6;min-width:0;display:flex;flex-direction:column}
figure.wide{grid-column:1/-1}
figure.small{grid-column:span 4}
.sheet figure.small{grid-column:span 3}
@media (max-width:50rem){.facts{gap:.4rem}.facts li{padding:.35rem .6rem;min-width:0;flex:1 1 40%}
.facts b{font-size:1.05rem}.verdict b{font-size:1rem}table{font-size:.8rem}td:not(.num){min-width:6.5rem}
figure{grid-column:1/-1}
figure.small{grid-column:span 6}.sheet figure.small{grid-column:span 6}}
figure svg{display:block;max-width:100%;height:auto;margin:0 auto}
figure.wide svg{max-width:min(100%,44rem);max-height:32rem}
.pictures:not(.sheet) figure.wide svg{width:100%}
figcaption{margin-top:auto;padding-top:.4rem}figcaption b{color:var(--ink)}
details{margin:.6rem 0}summary{cursor:pointer;font-weight:600}
code{font-size:.85em;overflow-wrap:anywhere}
"""
#: The rules of the pictures, once, and the colour of the cards for what is paper in them.
_PICTURES = STYLE + "".join(
    f'figure .gs [{what}="{LIGHT["paper"]}"]{{{what}:var(--card)}}' for what in ("fill", "stroke")
)


def report_html(report: Report) -> str:
    """Return the page of a run.

    Everything is in the one string: styles, tables, pictures as inline SVG. Values are escaped.
    """
    scene = report.scene.scene
    products = report.products
    parts = [
        f"<h1>{escape(scene.title)}</h1>",
        *(f'<p class="verdict"><b>{escape(text)}</b></p>' for text in report.notes),
        _answer(report),
        *(f"<p>{escape(text)}</p>" for text in scene.description.strip().split("\n\n") if text),
    ]
    galleries = {name: value for name, value in products.items() if name != "graph_pictures" and _are_pictures(value)}
    parts += [_gallery(_heading(name), galleries[name]) for name in sorted(galleries, key=_place_of)]
    parts += [_table(table) for table in summary_tables(report)]
    parts.append(_sheet(products.get("graph_pictures", ())))
    if any(r.key for r in products.get("records", ())):
        parts.append(_records(products["records"]))
    parts.append(_provenance(report))
    return whole_page(scene.title, _CSS + _PICTURES, "\n".join(part for part in parts if part))


#: Headings of the galleries, in the order of the page; other products that are pictures follow under their names.
_HEADINGS = {"animations": "In motion", "mechanism_pictures": "The mechanism", "plots": "Curves"}


def _place_of(name: str) -> tuple[int, str]:
    order = list(_HEADINGS)
    return (order.index(name) if name in order else len(order), name)


def _heading(name: str) -> str:
    return _HEADINGS.get(name, name.replace("_", " ").capitalize())


def _are_pictures(value: object) -> bool:
    return isinstance(value, tuple) and bool(value) and all(isinstance(item, Picture) for item in value)


_TONES = {True: "good", False: "bad", None: ""}


def _answer(report: Report) -> str:
    """Give the run in a few sentences and, behind what is good or bad, a row of numbers."""
    found = sentences(report)
    told = [f'<p class="verdict {_TONES[finding.good]}">{_strong(finding)}</p>' for finding in found]
    items = "".join(
        f'<li><b class="{_TONES[fact.good]}">{escape(fact.value)}</b><span>{escape(fact.text)}</span></li>'
        for fact in facts(report)
    )
    first = next((k for k, finding in enumerate(found) if finding.good is None), len(told)) or len(told)
    return f'{"".join(told[:first])}<ul class="facts">{items}</ul>{"".join(told[first:])}'


def _strong(finding: Finding) -> str:
    """Print what is good or bad in bold and colour, the rest plain."""
    text = escape(finding.text)
    return text if finding.good is None else f"<b>{text}</b>"


def _figure(picture: Picture) -> str:
    return (
        f'<figure class="{picture.size}">{bare(picture.svg)}<figcaption><b>{escape(picture.title)}</b>'
        f"{'. ' if picture.caption else ''}{escape(picture.caption)}</figcaption></figure>"
    )


def _gallery(heading: str, pictures: Iterable[Picture]) -> str:
    figures = "".join(map(_figure, pictures))
    return f'<h2>{escape(heading)}</h2><div class="pictures">{figures}</div>' if figures else ""


def _sheet(pictures: Iterable[Picture]) -> str:
    figures = "".join(map(_figure, pictures))
    if not figures:
        return ""
    note = (
        "By adjacency levels: the frame on top, below it the links jointed to it, and so on. "
        "A line is a joint of mobility 1, a dashed line one of mobility 2."
    )
    return f'<h2>Candidate graphs</h2><p class="soft">{note}</p><div class="pictures sheet">{figures}</div>'


def _table(table: Table) -> str:
    return f"<h2>{escape(table.title)}</h2>{_grid(table.columns, table.rows)}" + (
        f'<p class="soft">{escape(table.note)}</p>' if table.note else ""
    )


def _grid(columns: Iterable[str], rows: Iterable[Iterable[str]]) -> str:
    head = "".join(f'<th scope="col">{escape(column)}</th>' for column in columns)
    body = "".join("<tr>" + "".join(_cell(cell) for cell in row) + "</tr>" for row in rows)
    return f'<div class="scroll"><table><thead><tr>{head}</tr></thead><tbody>{body}</tbody></table></div>'


def _cell(text: str) -> str:
    numeric = text[:1].isdigit() or text[:1] in "-+"
    return f'<td class="num">{escape(text)}</td>' if numeric and len(text) < 40 else f"<td>{escape(text)}</td>"


def _records(records: tuple[Record, ...]) -> str:
    rows = [(str(r.number), r.solution, r.status, r.verdict or r.reason, r.key) for r in records]
    grid = _grid(("no.", "assortment", "status", "verdict or reason", "key"), rows)
    summary = f"{len(rows)} row{'s' if len(rows) != 1 else ''}, as in results.csv"
    return f"<h2>Every candidate</h2><details><summary>{summary}</summary>{grid}</details>"


def _provenance(report: Report) -> str:
    versions = ", ".join(f"{name} {version}" for name, version in report.versions.items())
    scene: Any = report.scene
    source = f"{scene.source}{', SHA-256 ' + scene.digest if scene.digest else ''}"
    return (
        f'<h2>How this was made</h2><p class="soft">Scene <code>{escape(source)}</code>, seed {scene.scene.seed}. '
        f"{escape(versions)}. The scene as read and the times are in <code>scene.json</code>.</p>"
    )
