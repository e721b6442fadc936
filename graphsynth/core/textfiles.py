"""Reading files and texts that a user hands in, within bounds: whatever comes, a `FormatError` or plain values."""

from __future__ import annotations

import json
import re
import tomllib
from pathlib import Path
from typing import Any

from graphsynth.core.errors import FormatError

#: Most bytes of a file that a person writes: a question, a scene.
FILE_MAX = 1 << 20
_BITS = 10_000  # of a whole number that Python can still show
_STRING = re.compile(r'"(?:[^"\\\n]|\\.)*+"' "|'[^'\n]*+'")
#: A dotted key of a hundred parts: the time and the memory of the parser grow with the square of their number.
_DEEP = re.compile(r"""(?<![\w"'-])(?:[\w"'-]++[ \t]*+\.[ \t]*+){100}""")


def read_bytes(path: Path, most: int = FILE_MAX, what: str = "a file of its kind", place: str = "") -> bytes:
    """Read a whole file: no folder, no device, no pipe, and no more than ``most`` bytes; else a `FormatError`.

    For the message: ``what`` the file should be, and what its ``place`` is called, its path by default.
    """
    place = place or str(path)
    try:
        regular = path.is_file() or not path.exists()
        data = b""
        if regular:  # to open a pipe may wait for ever
            with path.open("rb") as stream:
                data = stream.read(most + 1)
    except OSError as error:
        raise FormatError(f"cannot be read: {error.strerror}", place) from None
    except ValueError:  # a name with a NUL, or with half of a character that takes two
        raise FormatError("cannot be read: no file can have this name", repr(place)) from None
    if not regular:
        raise FormatError("cannot be read: it is a folder, a device or a pipe; name a file", place)
    if len(data) > most:
        raise FormatError(f"has more than {most} bytes; {what} is a short text", place)
    return data


def text_of(data: str | bytes, place: str = "", what: str = "it") -> str:
    """Decode UTF-8, without the mark that some editors put before the first letter; `FormatError` for other bytes."""
    if isinstance(data, str):
        return data.removeprefix("\ufeff")
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        at = f"byte {error.start}"
        where = f"{place}, {at}" if place else at
        raise FormatError(f"not UTF-8 text; save {what} as UTF-8", where) from None


def toml_tables(text: str, place: str = "text") -> dict[str, Any]:
    """Read TOML as plain values.

    `FormatError` for anything else; also for keys of more than 100 parts and whole numbers of thousands of digits.

    >>> toml_tables("a.b = 1")
    {'a': {'b': 1}}
    """
    for plain in (text, _STRING.sub('""', text)):  # quoted parts of a key may hold anything
        if found := _DEEP.search(plain):
            line = plain.count("\n", 0, found.start()) + 1
            raise FormatError("a key of more than 100 parts; no key has more than ten", f"{place}, line {line}")
    try:
        tables = tomllib.loads(text)
    except (ValueError, RecursionError) as error:  # ValueError: TOMLDecodeError, and integers of thousands of digits
        raise FormatError(f"not TOML: {_brief(error)}", place) from None
    waiting: list[Any] = [tables]
    while waiting:  # whole numbers of thousands of hexadecimal digits, which no message could show, are refused
        value = waiting.pop()
        if isinstance(value, dict):
            waiting += value.values()
        elif isinstance(value, list):
            waiting += value
        elif isinstance(value, int) and value.bit_length() > _BITS:
            raise FormatError(f"a whole number of {value.bit_length()} bits; TOML has at most 64", place)
    return tables


def _brief(error: Exception) -> str:
    """Return the message of a parser, which may quote what it read."""
    said = str(error)
    return said if len(said) <= 300 else f"{said[:200]} ... {said[-80:]}"


def json_value(text: str, place: str = "") -> Any:
    """Read JSON as plain values; `FormatError` for anything else, NaN and keys given twice too, whatever the depth."""
    try:
        return json.loads(text, parse_constant=_no_constant, object_pairs_hook=_pairs)
    except json.JSONDecodeError as error:
        where = f"line {error.lineno}, column {error.colno}"
        raise FormatError(f"not JSON ({error.msg})", f"{place}, {where}" if place else where) from None
    except FormatError as error:
        raise FormatError(str(error), place or "text") from None
    except (RecursionError, ValueError) as error:
        raise FormatError(f"not JSON that can be read ({_brief(error)})", place or "text") from None


def _pairs(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    found: dict[str, Any] = {}
    for name, value in pairs:
        if name in found:
            raise FormatError(f"the key {name[:24]!r} is there twice")
        found[name] = value
    return found


def _no_constant(name: str) -> Any:
    raise FormatError(f"{name} is not a number of JSON")
