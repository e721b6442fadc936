"""What an object shows of itself, and the methods whose work is done in a room above its own.

A mechanism can be drawn, although drawing lies above mechanisms and imports run one way: its method asks `work` for the
function.  The table of these functions is filled by ``graphsynth/__init__.py``, which lies above all rooms.
"""

from __future__ import annotations

from collections.abc import Callable
from importlib import import_module
from typing import Any

#: Function of every such method, as "module:name"; loaded on first use.
WORK: dict[str, str] = {}
#: Lines of a plain representation, and letters of a line.
_LINES, _LETTERS = 10, 120


def work(name: str) -> Any:
    """Return the function that does the work of a method."""
    module, _, function = WORK[name].partition(":")
    return getattr(import_module(module), function)


class Shown:
    """Shows itself in at most ten lines, and in a notebook as a picture with a table."""

    __slots__ = ()
    _told: Callable[[], tuple[str, list[tuple[str, str]]]]  #: a title, and rows of a name and a value

    def _picture(self) -> str:
        """Return an SVG for a notebook; empty for none."""
        return ""

    def __repr__(self) -> str:
        title, rows = self._told()
        wide = max((len(name) for name, _ in rows), default=0)
        lines = [title, *(f"  {name:<{wide}}  {value}" for name, value in rows)]
        if len(lines) > _LINES:
            lines[_LINES - 1 :] = [f"  and {len(lines) - _LINES + 1} more"]
        return "\n".join(line if len(line) <= _LETTERS else f"{line[: _LETTERS - 3]}..." for line in lines)

    def _repr_html_(self) -> str:
        from html import escape  # not before a notebook asks: every import of graphsynth loads this module

        title, rows = self._told()
        return f"<figure>{self._picture()}<figcaption>{escape(title)}{table(rows)}</figcaption></figure>"


def table(rows: list[tuple[str, str]]) -> str:
    """Write rows of a name and a value as a small HTML table."""
    from html import escape

    cells = (f"<tr><th scope='row'>{escape(name)}</th><td>{escape(value)}</td></tr>" for name, value in rows)
    return f"<table>{''.join(cells)}</table>" if rows else ""
