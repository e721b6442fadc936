"""Reading and writing structural questions: keywords, plain mappings, TOML, command-line assignments."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from typing import Any

from graphsynth.core.errors import FormatError, SpecError
from graphsynth.core.wording import nearest, shown, whole
from graphsynth.structure.system.variables import ALIASES, LARGEST, Range, is_variable, read_range, show_range

OPTIONS = ("fractionated", "simple_joints", "max_joint_mobility", "max_link_joints", "levels")
_SYMBOLS = ("W", "Pi", "n", "N", "p", "p1", "p2", "p3", "p4", "p5", "t0", "n2", "n3", "n4", "n5", "n6")
_KNOWN = (*_SYMBOLS, "v", "v_ct", "v_P", "G", *ALIASES, *OPTIONS)
_FAMILIES = {"p_i": "p", "n_a": "n"}
_SPAN = re.compile(r"\s*(-?[0-9]{1,12})?\s*\.\.\s*(-?[0-9]{1,12})?\s*")
_NUMBER = re.compile(r"\s*-?[0-9]{1,12}\s*")

_Read = tuple[dict[str, Range], dict[str, Any], dict[int, Range]]


def symbol_of(name: str) -> str:
    """Return the symbol of a variable given by symbol or by name; SpecError with the nearest name if unknown."""
    if not isinstance(name, str):
        raise SpecError(f"{shown(name)} is not the name of a variable: give a text such as 'W' or 'links'")
    symbol = ALIASES.get(name, name)
    if symbol == "N" or is_variable(symbol):
        return symbol
    raise SpecError(f"unknown variable {shown(name)}{nearest(name, _KNOWN)}")


def is_single(name: str) -> bool:
    """Whether ``name`` is the symbol or the name of one variable."""
    symbol = ALIASES.get(name, name)
    return symbol == "N" or is_variable(symbol)


def read_question(question: Mapping[str, Any]) -> _Read:
    """Split keywords into ranges by symbol, options and levels; validates everything."""
    ranges: dict[str, Range] = {}
    options: dict[str, Any] = {}
    levels: dict[int, Range] = {}
    for name, value in question.items():
        if value is None:
            if name not in OPTIONS and ALIASES.get(name, name) not in _FAMILIES:
                symbol_of(name)
        elif name == "levels":
            levels = _levels(value)
        elif name in OPTIONS:
            _add_option(options, name, value)
        elif ALIASES.get(name, name) in _FAMILIES:
            _add_family(ranges, name, value)
        else:
            _add(ranges, name, symbol_of(name), value)
    return ranges, options, levels


def _add(ranges: dict[str, Range], name: str, symbol: str, value: Any) -> None:
    own = read_range(symbol, value)
    if symbol == "N":
        symbol = "n"
        own = None if own[0] is None else own[0] - 1, None if own[1] is None else own[1] - 1
    if ranges.get(symbol, own) != own:
        raise SpecError(
            f"{symbol} is given twice: {show_range(ranges[symbol])} and {show_range(own)} (from {shown(name)}); "
            "keep one"
        )
    # An unbounded p_i (i >= 2) still says that joints of this mobility may occur.
    if own != (None, None) or (symbol[0] == "p" and symbol not in ("p", "p1")):
        ranges[symbol] = own


def _add_family(ranges: dict[str, Range], name: str, value: Any) -> None:
    letter = _FAMILIES[ALIASES.get(name, name)]
    if not isinstance(value, Mapping):
        raise SpecError(f"{name} = {shown(value)}: give a mapping such as {{2: 3}}")
    for kind, number in value.items():
        symbol = f"{letter}{kind if isinstance(kind, str) else whole(kind, f'{name}: a kind', 1, LARGEST)}"
        if not is_variable(symbol):
            least, most = (2, LARGEST) if letter == "n" else (1, 5)
            raise SpecError(f"{name}: unknown kind {shown(kind)}; give an integer between {least} and {most}")
        if number is not None:
            _add(ranges, name, symbol, number)


def _add_option(options: dict[str, Any], name: str, value: Any) -> None:
    if name == "simple_joints":
        if value is not True:
            raise SpecError(
                f"simple_joints = {shown(value)}: only true is possible; "
                "a pin that joins k links is k - 1 simple joints"
            )
        return  # always so
    if name == "fractionated":
        if not isinstance(value, bool):
            raise SpecError(f"fractionated = {shown(value)}: give true or false")
        if value:
            options[name] = True
        return
    if name == "max_link_joints" and isinstance(value, str) and value == "all":
        options[name] = value
        return
    least, most = (1, 5) if name == "max_joint_mobility" else (2, LARGEST)
    lo, hi = read_range(name, value)
    if lo is None or lo != hi or not least <= lo <= most:
        raise SpecError(f"{name} = {shown(value)}: give one integer between {least} and {most}")
    options[name] = lo


def _levels(value: Any) -> dict[int, Range]:
    if not isinstance(value, Mapping):
        raise SpecError(f"levels = {shown(value)}: give a mapping level -> size such as {{-1: 3}}")
    read: dict[int, Range] = {}
    for level, size in value.items():
        level = whole(level, "levels: a level, -1 for the last,", -LARGEST, LARGEST)
        own = read_range(f"levels[{level}]", size)
        if level == 0 and own != (1, 1):
            raise SpecError(f"levels: level 0 is the frame alone, its size is 1 and not {show_range(own)}")
        read[level] = own
    return read


def plain_question(mapping: Mapping[str, Any], place: str, check: Callable[..., object]) -> dict[str, Any]:
    """Turn plain data (string keys, strings for ranges) into keywords; FormatError with the key otherwise.

    ``check`` is called with the keywords read so far, so that an error is laid at the key that causes it.
    """
    if not isinstance(mapping, Mapping):
        raise FormatError(f"a structural question is a table of variables, not {type(mapping).__name__}", place)
    question: dict[str, Any] = {}
    for key, value in mapping.items():
        here = f"{place}: key {shown(key)}" if place else f"key {shown(key)}"
        if not isinstance(key, str) or not (is_single(key) or key in _KNOWN or key in _FAMILIES):
            raise FormatError(f"unknown key {shown(key)}{nearest(key if isinstance(key, str) else '', _KNOWN)}", here)
        try:
            question[key] = _plain_value(key, value)
            check(**question)
        except FormatError:
            raise
        except SpecError as error:
            raise FormatError(str(error), here) from error
    return question


def _plain_value(key: str, value: Any) -> Any:
    if isinstance(value, Mapping):
        return {_level_or_kind(key, inner): _plain_value(key, own) for inner, own in value.items()}
    if isinstance(value, str) and not (key == "max_link_joints" and value == "all"):
        if _NUMBER.fullmatch(value):
            raise SpecError(f'{key} = "{value}" is text; write the number without quotes: {int(value)}')
        return _parse_value(key, value)
    return value


def _level_or_kind(key: str, inner: Any) -> int:
    if isinstance(inner, str) and _NUMBER.fullmatch(inner):
        return int(inner)
    return whole(inner, f"a key of {key}", -LARGEST, LARGEST)


def _parse_value(name: str, text: str) -> int | Range:
    span = _SPAN.fullmatch(text)
    if span:
        return (int(span[1]) if span[1] else None, int(span[2]) if span[2] else None)
    if _NUMBER.fullmatch(text):
        return int(text)
    raise SpecError(f"{name} = {text[:40]!r}: write an integer or a range such as 0..2, 2.. or ..5")


def assigned_question(assignments: Iterable[str]) -> dict[str, Any]:
    """Turn ``name=value`` texts into keywords; SpecError for anything else."""
    question: dict[str, Any] = {}
    try:
        texts = None if isinstance(assignments, str | bytes) else list(assignments)
    except TypeError:
        texts = None
    if texts is None:
        raise SpecError(f"{shown(assignments)} is not a list of assignments: give a list such as ['W=1', 'links=8']")
    for text in texts:
        if not isinstance(text, str):
            raise SpecError(f"{shown(text)} is not an assignment: write name=value, for example W=1 or n4=0..2")
        name, equals, value = text.partition("=")
        name, value = name.strip(), value.strip()
        if not equals or not name or not value:
            raise SpecError(f"{shown(text)} is not an assignment: write name=value, for example W=1 or n4=0..2")
        if name.startswith("levels.") and _NUMBER.fullmatch(name[7:]):
            question.setdefault("levels", {})[int(name[7:])] = _parse_value(name, value)
            continue
        if name in ("fractionated", "simple_joints"):
            if value not in ("true", "false"):
                raise SpecError(f"{name} = {shown(value)}: write true or false")
            own: Any = value == "true"
        elif name == "max_link_joints" and value == "all":
            own = value
        else:
            if name not in OPTIONS:
                symbol_of(name)
            own = _parse_value(name, value)
        if question.get(name, own) != own:
            raise SpecError(f"{name} is given twice: {shown(question[name])} and {shown(own)}; keep one")
        question[name] = own
    return question


def changed_question(question: Mapping[str, Any], changes: Mapping[str, Any]) -> dict[str, Any]:
    """Return the keywords of a question with some replaced, whichever alias names them."""
    kept = dict(question)
    for name in changes:
        symbol = ALIASES.get(name, name)
        if symbol in _FAMILIES:
            letter = _FAMILIES[symbol]
            kept = {key: own for key, own in kept.items() if not (key[0] == letter and key[1:].isdigit())}
        else:
            kept.pop("n" if symbol == "N" else symbol, None)
    return {**kept, **changes}


def load_toml(path: Path) -> dict[str, Any]:
    """Parse a TOML file; FormatError with the file name if it cannot be read."""
    from graphsynth.core.textfiles import read_bytes, text_of, toml_tables

    place = str(path)
    return toml_tables(text_of(read_bytes(path, what="a structural question"), place), place)


def toml_of(
    ranges: Iterable[tuple[str, Range]], options: Iterable[tuple[str, Any]], levels: Iterable[tuple[int, Range]]
) -> str:
    """Write a question as TOML."""
    lines = [f"{symbol} = {_toml_range(own)}" for symbol, own in ranges]
    for name, value in options:
        text = {True: "true", "all": '"all"'}.get(value) if isinstance(value, (bool, str)) else str(value)
        lines.append(f"{name} = {text}")
    sizes = [f'"{level}" = {_toml_range(own)}' for level, own in levels]
    if sizes:
        lines += ["", "[levels]", *sizes]
    return "\n".join(lines) + "\n" if lines else ""


def _toml_range(own: Range) -> str:
    lo, hi = own
    if lo is None or hi is None:
        return f'"{show_range(own)}"'
    return str(lo) if lo == hi else f"[{lo}, {hi}]"
