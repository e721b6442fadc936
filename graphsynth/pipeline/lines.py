"""On which line of a TOML text a key stands.

``tomllib`` tells values, not places, so a message about a value would have no line.  This reader walks over a text
that ``tomllib`` has accepted and notes where each key and each item of a list begins; it reads no values.
"""

from __future__ import annotations

import contextlib
from collections.abc import Mapping

__all__ = ["key_lines", "line_of"]

_CLOSING = {'"""': '"""', "'''": "'''", '"': '"', "'": "'"}


def key_lines(text: str) -> dict[tuple[str, ...], int]:
    r"""Return the line, from 1, of every key, table and list item of a valid TOML text.

    Items of lists are keyed by their index as a string.  On a text that is not TOML, what was found up to the error.

    Examples
    --------
    >>> key_lines('[a]\nb = [\n  1, {c = 2}]\n')
    {('a',): 1, ('a', 'b'): 2, ('a', 'b', '0'): 3, ('a', 'b', '1'): 3, ('a', 'b', '1', 'c'): 3}
    """
    reader = _Reader(text.replace("\r\n", "\n"))
    with contextlib.suppress(IndexError, ValueError, RecursionError):
        reader.document()
    return reader.lines


def line_of(lines: Mapping[tuple[str, ...], int], keys: tuple[str, ...]) -> int | None:
    """Return the line of a key, else of the nearest table or list around it; None if there is none."""
    for end in range(len(keys), 0, -1):
        if keys[:end] in lines:
            return lines[keys[:end]]
    return None


class _Reader:
    """Position in a text, and the lines noted so far."""

    def __init__(self, text: str) -> None:
        self.text = text
        self.at = 0
        self.lines: dict[tuple[str, ...], int] = {}
        self._counted = (0, 1)

    def note(self, path: tuple[str, ...]) -> None:
        start, line = self._counted
        line += self.text.count("\n", start, self.at)
        self._counted = (self.at, line)
        for end in range(1, len(path) + 1):
            self.lines.setdefault(path[:end], line)

    def skip(self, also: str = "") -> None:
        """Skip blanks and comments, and the characters of `also`."""
        while self.at < len(self.text):
            char = self.text[self.at]
            if char == "#":
                end = self.text.find("\n", self.at)
                self.at = len(self.text) if end < 0 else end
            elif char in " \t" or char in also:
                self.at += 1
            else:
                return

    def document(self) -> None:
        table: tuple[str, ...] = ()
        arrays: dict[tuple[str, ...], int] = {}
        self.skip("\n")
        while self.at < len(self.text):
            if self.text[self.at] == "[":
                table = self.header(arrays)
            else:
                self.pair(table)
            self.skip("\n")

    def header(self, arrays: dict[tuple[str, ...], int]) -> tuple[str, ...]:
        """Read ``[a.b]`` or ``[[a.b]]``; return the path, with the index of each array of tables it passes."""
        double = self.text.startswith("[[", self.at)
        start = self.at
        self.at += 2 if double else 1
        written = self.key()
        path: tuple[str, ...] = ()
        for place, part in enumerate(written):
            path = (*path, part)
            if double and place == len(written) - 1:
                arrays[path] = arrays.get(path, -1) + 1
            if path in arrays:
                path = (*path, str(arrays[path]))
        self.at = self.text.index("]", self.at) + (2 if double else 1)
        end, self.at = self.at, start
        self.note(path)
        self.at = end
        return path

    def key(self) -> tuple[str, ...]:
        """Read a dotted key."""
        parts: list[str] = []
        while True:
            self.skip()
            if self.text[self.at] in "\"'":
                parts.append(self.string())
            else:
                start = self.at
                while self.text[self.at].isalnum() or self.text[self.at] in "_-":
                    self.at += 1
                if start == self.at:
                    raise ValueError
                parts.append(self.text[start : self.at])
            self.skip()
            if self.text[self.at] != ".":
                return tuple(parts)
            self.at += 1

    def string(self) -> str:
        """Skip a string; return what stands in it, escapes of a key in double quotes read."""
        opening = next(quote for quote in _CLOSING if self.text.startswith(quote, self.at))
        start = self.at = self.at + len(opening)
        while not self.text.startswith(opening, self.at):
            self.at += 2 if self.text[self.at] == "\\" and opening[0] == '"' else 1
        if len(opening) == 3:  # up to two more quotes belong to the string
            while self.text.startswith(opening[0], self.at + 3):
                self.at += 1
        inside = self.text[start : self.at]
        self.at += len(opening)
        if opening == '"' and "\\" in inside:
            import tomllib

            return str(tomllib.loads(f'k = "{inside}"')["k"])
        return inside

    def pair(self, table: tuple[str, ...]) -> None:
        self.skip()
        start = self.at
        path = (*table, *self.key())
        end, self.at = self.at, start
        self.note(path)
        self.at = self.text.index("=", end) + 1
        self.value(path)

    def value(self, path: tuple[str, ...]) -> None:
        self.skip()
        char = self.text[self.at]
        if char in "\"'":
            self.string()
        elif char == "[":
            self.items(path)
        elif char == "{":
            self.at += 1
            self.skip("\n,")
            while self.text[self.at] != "}":
                self.pair(path)
                self.skip("\n,")
            self.at += 1
        else:
            while self.at < len(self.text) and self.text[self.at] not in ",]}#\n":
                self.at += 1

    def items(self, path: tuple[str, ...]) -> None:
        self.at += 1
        self.skip("\n,")
        index = 0
        while self.text[self.at] != "]":
            self.note((*path, str(index)))
            self.value((*path, str(index)))
            index += 1
            self.skip("\n,")
        self.at += 1
