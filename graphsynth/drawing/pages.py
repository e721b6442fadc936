"""HTML pages in one file: the frame around a report, and the policy that keeps everything from elsewhere out."""

from __future__ import annotations

from base64 import b64encode
from collections.abc import Iterable
from hashlib import sha256
from html import escape

__all__ = ["policy", "whole_page"]


def policy(styles: Iterable[str], scripts: Iterable[str] = ()) -> str:
    """Return the Content-Security-Policy of a page that applies these style sheets, runs these scripts and no others.

    Nothing is loaded; pictures may be in the page itself.

    Examples
    --------
    >>> policy(["p{margin:0}"]).count("'sha256-")
    1
    """
    rules = ["default-src 'none'", "img-src data:", "base-uri 'none'", "form-action 'none'"]
    for kind, texts in (("style-src", styles), ("script-src", scripts)):
        marks = [f"'sha256-{b64encode(sha256(text.encode()).digest()).decode()}'" for text in texts]
        if marks:
            rules.append(" ".join([kind, *marks]))
    return f'<meta http-equiv="Content-Security-Policy" content="{"; ".join(rules)}">'


def whole_page(title: str, css: str, body: str) -> str:
    """Return a page that needs no other file: no scripts, one style sheet, readable on a phone.

    Parameters
    ----------
    title : str
        Escaped here.
    css, body : str
        The style sheet, and the inside of ``<main>``.
    """
    return (
        f'<!doctype html>\n<html lang="en"><head><meta charset="utf-8">{policy([css])}'
        '<meta name="viewport" content="width=device-width,initial-scale=1">'
        f"<title>{escape(title)}</title><style>{css}</style></head><body><main>{body}</main></body></html>\n"
    )
