"""HTML pages in one file: the frame around a report, and the policy that keeps everything from elsewhere out."""

from __future__ import annotations

from base64 import b64encode
from collections.abc import Callable, Iterable
from functools import cache
from hashlib import sha256
from html import escape
from typing import TYPE_CHECKING, Any

from graphsynth.drawing.svg import bare

if TYPE_CHECKING:
    from jinja2 import Template


def policy(scripts: Iterable[str] = ()) -> str:
    r"""Return the Content-Security-Policy of a page that runs these scripts and no others, and loads nothing.

    Pictures may be in the page itself, and style sheets: those of pictures from elsewhere too.

    >>> policy()[:74]
    '<meta http-equiv="Content-Security-Policy" content="default-src \'none\'; st'
    """
    rules = [
        "default-src 'none'",
        "style-src 'unsafe-inline'",
        "img-src data:",
        "base-uri 'none'",
        "form-action 'none'",
    ]
    marks = [f"'sha256-{b64encode(sha256(text.encode()).digest()).decode()}'" for text in scripts]
    if marks:
        rules.append(" ".join(["script-src", *marks]))
    return f'<meta http-equiv="Content-Security-Policy" content="{"; ".join(rules)}">'


def whole_page(title: str, css: str, body: str) -> str:
    """Return a page that needs no other file: no scripts, one style sheet, readable on a phone.

    `title`: escaped here. `css`, `body`: the style sheet, and the inside of ``<main>``.
    """
    return (
        f'<!doctype html>\n<html lang="en"><head><meta charset="utf-8">{policy()}'
        '<meta name="viewport" content="width=device-width,initial-scale=1">'
        f"<title>{escape(title)}</title><style>{css}</style></head><body><main>{body}</main></body></html>\n"
    )


@cache
def template(text: str, **filters: Callable[..., Any]) -> Template:
    """Return a template of HTML that escapes every value; ``| drawing`` puts in an SVG of our own making as it is."""
    from jinja2 import Environment, StrictUndefined
    from markupsafe import Markup

    own = Environment(autoescape=True, undefined=StrictUndefined)
    own.filters |= {"drawing": lambda svg: Markup(bare(svg)), **filters}
    return own.from_string(text)
