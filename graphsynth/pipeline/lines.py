"""On which line of a TOML text a key stands.

``tomllib`` gives values, not places, so a message about a value would have no line.  A text that it has accepted is
read here again statement by statement: as many lines as it takes to parse are one statement; its keys begin there.
"""

from __future__ import annotations

import tomllib
from collections.abc import Iterator, Mapping, Sequence
from itertools import product
from typing import Any

_Path = tuple[str, ...]

#: Lines of one statement that are tried; keys behind a longer one get the line of the table around them.
_LONGEST = 2000
#: What may close a list that is cut at the end of a line.
_CLOSINGS = ["".join(ends) for count in range(5) for ends in product("]}", repeat=count)]


def key_lines(text: str) -> dict[_Path, int]:
    r"""Return the line, from 1, of every key, table and list item of a valid TOML text.

    Items of lists are keyed by their index as a string.  On a text that is not TOML, what was found up to the error.

    >>> key_lines('[a]\nb = [\n  1, {c = 2}]\n')
    {('a',): 1, ('a', 'b'): 2, ('a', 'b', '0'): 3, ('a', 'b', '1'): 3, ('a', 'b', '1', 'c'): 3}
    """
    rows = text.replace("\r\n", "\n").split("\n")
    lines: dict[_Path, int] = {}
    table: _Path = ()
    items: dict[_Path, int] = {}  # of each array of tables, the index of the last one
    first = 0
    while first < len(rows):
        if rows[first].strip(" \t")[:1] in ("", "#"):
            first += 1
            continue
        tried = range(first + 1, min(len(rows), first + _LONGEST) + 1)
        end = next((end for end in tried if _parsed(rows[first:end]) is not None), None)
        if end is None:
            break
        value = _parsed(rows[first:end]) or {}
        if rows[first].lstrip(" \t").startswith("["):
            table = _header(value, items)
            found: Mapping[_Path, int] = {table: first}
        else:
            found = {(*table, *path): line for path, line in _pair(value, rows, first, end)}
        for path, line in found.items():
            for length in range(1, len(path) + 1):
                lines.setdefault(path[:length], line + 1)
        first = end
    return lines


def line_of(lines: Mapping[_Path, int], keys: _Path) -> int | None:
    """Return the line of a key, else of the nearest table or list around it; None if there is none."""
    return next((lines[keys[:end]] for end in range(len(keys), 0, -1) if keys[:end] in lines), None)


def _parsed(rows: Sequence[str], closing: str = "") -> dict[str, Any] | None:
    try:
        return tomllib.loads("\n".join([*rows, closing]) if closing else "\n".join(rows))
    except (ValueError, RecursionError):
        return None


def _header(value: Any, items: dict[_Path, int]) -> _Path:
    """Return the path of ``[a.b]`` or ``[[a.b]]``, with the index of each array of tables it passes."""
    path: _Path = ()
    while value:
        ((key, value),) = value.items()
        path = (*path, key)
        if isinstance(value, list):
            items[path] = items.get(path, -1) + 1
            value = None
        if path in items:
            path = (*path, str(items[path]))
    return path


def _pair(value: Any, rows: Sequence[str], first: int, end: int) -> Iterator[tuple[_Path, int]]:
    """Yield the paths of one statement with the index of their line."""
    known: set[_Path] = set()
    for line in range(first, end):
        cut = (_parsed(rows[first : line + 1], closing) for closing in _CLOSINGS) if line + 1 < end else iter([value])
        for path in _paths(next((found for found in cut if found is not None), {})):
            if path not in known:
                known.add(path)
                yield path, first if not any(key.isdigit() for key in path) else line


def _paths(value: Any, path: _Path = ()) -> Iterator[_Path]:
    inside = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ()
    if path:
        yield path
    for key, inner in inside:
        yield from _paths(inner, (*path, str(key)))
