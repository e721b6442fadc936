"""Plain text with a head of ``# name value`` lines and rows of small whole numbers: edge lists and matrices."""

from __future__ import annotations

import re
from typing import NamedTuple

from graphsynth.core.errors import FormatError, GraphError
from graphsynth.structure.graph import MechanismGraph
from graphsynth.structure.text import LINKS_MAX

#: Characters of a text; larger graphs need a sparse format.
LENGTH_MAX = 4_000_000
#: Lines of a text, comments and empty ones too.
LINES_MAX = 100_000
#: Numbers on a line: an incidence matrix has a column for every joint.
WORDS_MAX = LINKS_MAX * (LINKS_MAX - 1) // 2
_HEAD = re.compile(r"#\s*+(links|frame|space)\s*+[=:]?\s*+([0-9]{1,4})\s*+", re.ASCII)
_NUMBERS = re.compile(r"(?:[0-9]{1,4}+(?:\s++|\Z))*+", re.ASCII)
_NUMBER = re.compile(r"[0-9]{1,4}", re.ASCII)


class Row(NamedTuple):
    """The numbers of a line, and which line it is."""

    numbers: list[int]
    place: str


def head_of(graph: MechanismGraph) -> str:
    """Lines that say what rows of numbers cannot."""
    frame = "" if graph.frame is None else f"# frame {graph.frame}\n"
    return f"# links {graph.links}\n{frame}# space {graph.space}\n"


def read_rows(text: str, most: int, opening: str = "") -> tuple[dict[str, int], list[Row]]:
    """Return the head and the rows.

    Parameters
    ----------
    text : str
    most : int
        Rows that a graph can have.
    opening : str
        Characters that are read as spaces, besides commas and semicolons.

    Raises
    ------
    FormatError
        A text too long, too many rows, a word that is not a whole number, something said twice.
    """
    if len(text) > LENGTH_MAX:
        raise FormatError(f"{len(text)} characters; at most {LENGTH_MAX} are read", "length")
    spaces = str.maketrans(dict.fromkeys(",;" + opening, " "))
    head: dict[str, int] = {}
    rows: list[Row] = []
    lines = text.split("\n", LINES_MAX)
    if len(lines) > LINES_MAX:
        raise FormatError(f"more than {LINES_MAX} lines; no mechanism graph needs so many", f"line {LINES_MAX + 1}")
    for number, line in enumerate(lines, 1):
        if not line:
            continue
        place = f"line {number}"
        if line.lstrip().startswith("#"):
            match = _HEAD.fullmatch(line.strip())
            if match and match[1] in head:
                raise FormatError(f"{match[1]} is given twice", place)
            if match:
                head[match[1]] = int(match[2])
            continue
        numbers = _numbers(line.translate(spaces), place)
        if numbers and len(rows) >= most:
            raise FormatError(f"more than {most} rows; no mechanism graph needs so many", place)
        if numbers:
            rows.append(Row(numbers, place))
    return head, rows


def _numbers(line: str, place: str) -> list[int]:
    words = line.split(None, WORDS_MAX)
    if len(words) > WORDS_MAX:
        raise FormatError(f"more than {WORDS_MAX} numbers; no mechanism graph needs so many", place)
    if not _NUMBERS.fullmatch(line.lstrip()):
        for word in words:
            if not _NUMBER.fullmatch(word):
                raise FormatError(f"{word[:24]!r} is not a whole number", place)
    return [int(word) for word in words]


def within(text: str, what: str) -> str:
    """Return a text if a reader will take it."""
    if len(text) > LENGTH_MAX:
        raise GraphError(f"the {what} of this graph has {len(text)} characters, at most {LENGTH_MAX}; use graphml")
    return text
