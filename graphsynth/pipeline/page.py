"""``report.html``: one file, no external resources, readable on a phone, light or dark with the system."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

from graphsynth.drawing.pages import template, whole_page
from graphsynth.drawing.palette import LIGHT, STYLE
from graphsynth.pipeline.products import Picture
from graphsynth.pipeline.summary import facts, sentences, summary_tables

if TYPE_CHECKING:
    from graphsynth.pipeline.stages import Report

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
.scroll{overflow-x:auto}tbody:first-child{border-top:1px solid var(--rule)}
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
.facts b{font-size:1.05rem}.verdict b{font-size:1rem}table{font-size:.8rem}td.text{min-width:6.5rem}
td.long{min-width:13rem}figure{grid-column:1/-1}
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


#: Headings of the galleries, in the order of the page; other products that are pictures follow under their names.
_HEADINGS = {
    "animations": "In motion",
    "mechanism_pictures": "The mechanism",
    "plots": "Curves",
    "binding_curves": "What binding costs",
}

_PAGE = """
{%- macro grid(columns, rows) -%}
<div class="scroll"><table>{% if columns | join %}<thead><tr>
{%- for column in columns %}<th scope="col">{{ column }}</th>{% endfor -%}
</tr></thead>{% endif %}<tbody>{% for row in rows -%}
<tr>{% for cell in row %}<td{% if cell | length < 10 or cell | length < 40 and cell[0] in "0123456789-+" %} class="num"
{%- elif cell | length > 60 %} class="long"
{%- elif cell | length > 14 %} class="text"{% endif %}>{{ cell }}</td>{% endfor %}</tr>
{%- endfor -%}
</tbody></table></div>
{%- endmacro -%}

{%- macro gallery(pictures, kind="") -%}
<div class="pictures{{ kind }}">
{%- for picture in pictures -%}
<figure class="{{ picture.size }}">{{ picture.svg | drawing }}<figcaption><b>{{ picture.title }}</b>
{%- if picture.caption %}. {{ picture.caption | unbroken }}{% endif %}</figcaption></figure>
{%- endfor -%}
</div>
{%- endmacro -%}

{%- macro finding(item) -%}
<p class="verdict {{ item.good | tone }}">{% if item.good is none -%}
{{ item.text | unbroken }}{% else %}<b>{{ item.text | unbroken }}</b>
{%- endif %}</p>
{%- endmacro -%}

<h1>{{ scene.scene.title }}</h1>
{% for text in notes %}<p class="verdict"><b>{{ text }}</b></p>{% endfor %}
{% for item in first %}{{ finding(item) }}{% endfor -%}
<ul class="facts">
{%- for fact in facts %}<li><b class="{{ fact.good | tone }}">{{ fact.value | unbroken }}</b>
{#- -#}<span>{{ fact.text }}</span></li>
{%- endfor -%}
</ul>
{%- for item in then %}{{ finding(item) }}{% endfor %}
{% for text in description if text %}<p>{{ text }}</p>{% endfor %}
{% for heading, pictures in galleries %}<h2>{{ heading }}</h2>{{ gallery(pictures) }}
{% endfor %}
{%- for table in tables -%}
<h2>{{ table.title }}</h2>{{ grid(table.columns, table.rows) }}
{%- if table.note %}<p class="soft">{{ table.note }}</p>{% endif %}
{% endfor %}
{%- if graphs -%}
<h2>Candidate graphs</h2><p class="soft">By adjacency levels: the frame on top, below it the links jointed to it, and
so on. A line is a joint of mobility 1, a dashed line one of mobility 2.</p>{{ gallery(graphs, " sheet") }}
{%- endif %}
{% if candidates -%}
<h2>Every candidate</h2><details><summary>{{ candidates | length }} row{{ "s" if candidates | length != 1 }}, as in
results.csv</summary>{{ grid(("no.", "assortment", "status", "verdict or reason", "key"), candidates) }}</details>
{%- endif %}
<h2>How this was made</h2><p class="soft">Scene <code>{{ scene.source }}{% if scene.digest %}, SHA-256
{{- " " + scene.digest }}
{%- endif %}</code>, seed {{ scene.scene.seed }}. {{ versions }}. The scene as read and the times are in
<code>scene.json</code>.</p>"""


#: Blanks before and within a unit of a number.
_IN_QUANTITY = re.compile(r"(?<=\d) (?=(?:[kmµ]?N|mm|m|rad|kg|s|J|W)\b)|(?:(?<=\d N)|(?<=\d [kmµ]N)) (?=m{1,2}\b)")


def unbroken(text: str) -> str:
    r"""Keep a number and its unit on one line: blanks between them do not break.

    >>> unbroken("binds with at most 2.348 N m, at 12 mm").split(" ")
    ['binds', 'with', 'at', 'most', '2.348\xa0N\xa0m,', 'at', '12\xa0mm']
    """
    return _IN_QUANTITY.sub("\N{NO-BREAK SPACE}", text)


def report_html(report: Report) -> str:
    """Return the page of a run, all in one string: styles, tables, pictures as inline SVG; values are escaped."""
    scene, products = report.scene, report.products
    found = sentences(report)
    first = next((k for k, item in enumerate(found) if item.good is None), 0) or len(found)
    galleries = {name: own for name, own in products.items() if isinstance(own, tuple) and own}
    names = [name for name, own in galleries.items() if all(isinstance(item, Picture) for item in own)]
    order = [*_HEADINGS, *sorted(set(names) - {*_HEADINGS, "graph_pictures"})]
    records = products.get("records", ())
    candidates = [(str(r.number), r.solution, r.status, r.verdict or r.reason, r.key) for r in records]
    body = template(_PAGE, tone={None: "", True: "good", False: "bad"}.get, unbroken=unbroken).render(
        scene=scene,
        notes=report.notes,
        first=found[:first],
        then=found[first:],
        facts=facts(report),
        description=scene.scene.description.strip().split("\n\n"),
        galleries=[(_HEADINGS.get(n, n.replace("_", " ").capitalize()), galleries[n]) for n in order if n in names],
        tables=summary_tables(report),
        graphs=products.get("graph_pictures", ()),
        candidates=candidates if any(r.key for r in records) else (),
        versions=", ".join(f"{name} {version}" for name, version in report.versions.items()),
    )
    return whole_page(scene.scene.title, _CSS + _PICTURES, body)
