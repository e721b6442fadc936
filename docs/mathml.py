"""Formulas as MathML, which browsers draw themselves: the site needs no script and no network.

docutils writes the markup; what browsers without a mathematical typeface draw badly is put differently: accents become
combining characters of their letter, and names of functions get the thin spaces of TeX.
"""

from __future__ import annotations

import re

from docutils.utils.math import MathError, latex2mathml

COMBINING = {"˙": "\u0307", "¨": "\u0308", "ˉ": "\u0304", "ˆ": "\u0302", "_": "\u0304"}
ACCENT = r"<mo(?: \w+=\"\w+\")*>([˙¨ˉˆ_])</mo>\s*"
OVER = re.compile(rf"<mover[^>]*>\s*<mi>(\w)</mi>\s*{ACCENT}</mover>")
OVER_INDEXED = re.compile(
    rf"<munderover>\s*<mi>(\w)</mi>\s*((?:(?!<munderover|</munderover).)*?){ACCENT}</munderover>", re.DOTALL
)
NAMES = (
    "cos|sin|tan|cosh|sinh|tanh|arccos|arcsin|arctan|atanh|atan2|exp|ln|log|det|max|min|sup|hypot|cross|dot|seg|dseg|xms"
    "|sign|sgn|arg|diag|rank|trace|Re|Im"
)
AFTER = re.compile(r"<mo>&ApplyFunction;</mo>\s*(?=(<mo stretchy=\"false\">[(\[])?)")
BEFORE = re.compile(
    rf"(</m(?:i|n|sub|sup|subsup|sqrt|frac)>\s*)(?=(?:<msup>\s*)?<mi(?: mathvariant=\"normal\")?>(?:{NAMES})</mi>)"
)
SPACE = '<mspace width="0.17em"/>'


def _italic(letter: str) -> str:
    """Return a letter as mathematical italic, which browsers choose by themselves for a single letter only."""
    if letter == "h":
        return "\u210e"
    for first, last, start in (("a", "z", 0x1D44E), ("A", "Z", 0x1D434), ("α", "ω", 0x1D6FC)):
        if first <= letter <= last:
            return chr(start + ord(letter) - ord(first))
    return letter


def _accented(letter: str, accent: str) -> str:
    """Return a letter with its accent; mathematical capitals have it inside of them, those of a text face above."""
    if "A" <= letter <= "Z":
        return f'<mi class="accented">{letter}{COMBINING[accent]}</mi>'
    return f"<mi>{_italic(letter)}{COMBINING[accent]}</mi>"


def mathml(tex: str, block: bool) -> str:
    """Markup of a formula; a ValueError names one that docutils cannot read, or would misread."""
    tex = re.sub(r"\\vert(?![a-zA-Z])\s*", "|", tex)  # inside a table of Markdown a bar has to be written in letters
    if re.search(r"frac\s*[0-9]", tex):
        raise ValueError(f"formula {tex!r}: numerator and denominator want braces")
    try:
        markup = latex2mathml.tex2mathml(tex, as_block=block)
    except MathError as error:
        raise ValueError(f"formula {tex!r}: {error}") from error
    markup = markup.replace("\N{REVERSE SOLIDUS OPERATOR}", "\\")  # many typefaces lack it
    markup = OVER.sub(lambda m: _accented(m[1], m[2]), markup)
    markup = OVER_INDEXED.sub(lambda m: f"<msub>{_accented(m[1], m[3])}{m[2]}</msub>", markup)
    markup = markup.replace('<mo stretchy="false">|</mo>', '<mo stretchy="false" lspace="0" rspace="0">|</mo>')
    markup = AFTER.sub(lambda m: "" if m[1] else SPACE, markup)
    return BEFORE.sub(rf"\1{SPACE}", markup)
