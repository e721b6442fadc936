"""The variables of the structural system: symbols, names, ranges, and how a question about them is read.

Twelve quantities and two families describe the structure of a mechanism.  Each has a symbol (the one of the
equations) and a descriptive name; both are accepted wherever a variable is named.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Iterator, Mapping
from typing import Any, TypeAlias

from graphsynth.core.errors import FormatError, SpecError
from graphsynth.core.wording import index_of, nearest, shown, whole

Range: TypeAlias = "tuple[int | None, int | None]"

#: The largest number a question may contain; far above any mechanism, small enough to search without care.
LARGEST = 9999

#: Mobilities of the space a mechanism can live in.
SPACES = range(2, 7)

#: Descriptive name -> symbol.
ALIASES: dict[str, str] = {
    "mobility": "W",
    "space": "Pi",
    "moving_links": "n",
    "links": "N",
    "joints": "p",
    "joints_by_mobility": "p_i",
    "frame_joints": "t0",
    "frame_loops": "v_ct",
    "moving_loops": "v_P",
    "loops": "v",
    "sub_edges": "G",
    "links_by_joints": "n_a",
}

#: The documented order: solutions are listed lexicographically in it.  p and n stand for their families as well.
_ORDER = ("W", "Pi", "n", "p", "p_", "t0", "v_ct", "n_", "v", "v_P", "G", "c")

#: Least value of each variable that is a count.  W alone may be negative (see docs/explanation/structural-system.md).
_LEAST = {"W": -LARGEST, "Pi": 2, "n": 1, "p": 1, "v": 0, "v_ct": 0, "v_P": 0, "t0": 1, "G": 0}

_FAMILY = re.compile(r"([np])([0-9]{1,4})")


def order_key(symbol: str) -> tuple[int, int]:
    """Place of a symbol in the documented order."""
    family = _FAMILY.fullmatch(symbol)
    if family:
        return _ORDER.index(family[1] + "_"), int(family[2])
    return _ORDER.index(symbol), 0


def is_variable(symbol: str) -> bool:
    """Whether ``symbol`` names a single variable (``N`` and the families by mapping excluded)."""
    family = _FAMILY.fullmatch(symbol)
    if not family:
        return symbol in _LEAST
    kind = int(family[2])
    return str(kind) == family[2] and (kind >= 2 if family[1] == "n" else 1 <= kind <= 5)


def read_range(symbol: str, value: Any) -> Range:
    """Read a fixed value or a pair of bounds.

    ``symbol``: the variable, for the message and the natural bounds; ``value``: an integer, or ``(lo, hi)`` where
    either side may be None. Raises `SpecError` if the value is not an integer or a pair, is out of its natural range,
    or the pair is empty.
    """
    if isinstance(value, (tuple, list)):
        if len(value) != 2:
            raise SpecError(f"{symbol} = {shown(value)}: bounds are a pair (lowest, highest), either may be None")
        lo, hi = (None if side is None else _integer(symbol, side) for side in value)
    else:
        lo = hi = _integer(symbol, value)
    least, most = _LEAST.get(symbol, 0), LARGEST
    if symbol == "Pi":
        least, most = SPACES[0], SPACES[-1]
    elif symbol == "N":
        least, most = 2, LARGEST + 1
    for side in (lo, hi):
        if side is not None and not least <= side <= most:
            raise SpecError(f"{symbol} = {shown(side)} is out of range: {symbol} must be between {least} and {most}")
    if lo is not None and hi is not None and lo > hi:
        raise SpecError(f"{symbol}: the lowest value {lo} is above the highest value {hi}; swap them")
    return lo, hi


def _integer(symbol: str, value: Any) -> int:
    number = None if isinstance(value, bool) else index_of(value)
    if number is not None:
        return number
    raise SpecError(f"{symbol} = {shown(value)} is not an integer: give an integer or a pair (lowest, highest)")


def show_range(value: Range) -> str:
    """Write a range the way :meth:`StructuralSpec.from_assignments` reads it.

    >>> show_range((3, 3)), show_range((0, 2)), show_range((None, 2))
    ('3', '0..2', '..2')
    """
    lo, hi = value
    if lo is not None and lo == hi:
        return str(lo)
    return f"{'' if lo is None else lo}..{'' if hi is None else hi}"


class Counts(Mapping[int, int]):
    """How many there are of each kind: a frozen, hashable mapping with zero for every kind not listed.

    Only the non-zero counts are iterated over; two are equal when their non-zero counts are.

    >>> kinds = Counts({2: 6, 3: 7, 4: 1})
    >>> kinds[3], kinds[9], dict(kinds)
    (7, 0, {2: 6, 3: 7, 4: 1})
    >>> 3 in kinds, 9 in kinds
    (True, False)
    """

    __slots__ = ("_items",)
    _items: tuple[tuple[int, int], ...]

    def __init__(self, counts: Mapping[int, int] | Iterable[tuple[int, int]] = ()) -> None:
        pairs = counts.items() if isinstance(counts, Mapping) else counts
        object.__setattr__(self, "_items", tuple(sorted((kind, number) for kind, number in pairs if number)))

    def __setattr__(self, name: str, value: object) -> None:
        raise AttributeError("Counts is frozen")

    def __getitem__(self, kind: int) -> int:
        for candidate, number in self._items:
            if candidate == kind:
                return number
        if index_of(kind) is not None:
            return 0
        raise KeyError(kind)

    def __contains__(self, kind: object) -> bool:
        return any(candidate == kind for candidate, _ in self._items)

    def __iter__(self) -> Iterator[int]:
        return (kind for kind, _ in self._items)

    def __len__(self) -> int:
        return len(self._items)

    def __eq__(self, other: object) -> bool:
        if isinstance(other, Counts):
            return self._items == other._items
        if isinstance(other, Mapping):
            return dict(self._items) == {kind: number for kind, number in other.items() if number}
        return NotImplemented

    def __hash__(self) -> int:
        return hash(self._items)

    def __reduce__(self) -> tuple[type[Counts], tuple[tuple[tuple[int, int], ...]]]:
        return Counts, (self._items,)

    def __repr__(self) -> str:
        return f"Counts({dict(self._items)})"


OPTIONS = ("fractionated", "simple_joints", "max_joint_mobility", "max_link_joints", "levels")
_SYMBOLS = ("W", "Pi", "n", "N", "p", "p1", "p2", "p3", "p4", "p5", "t0", "n2", "n3", "n4", "n5", "n6")
_KNOWN = (*_SYMBOLS, "v", "v_ct", "v_P", "G", *ALIASES, *OPTIONS)
FAMILIES = {"p_i": "p", "n_a": "n"}
_SPAN = re.compile(r"\s*(-?[0-9]{1,12})?\s*\.\.\s*(-?[0-9]{1,12})?\s*")
_NUMBER = re.compile(r"\s*-?[0-9]{1,12}\s*")


def symbol_of(name: str) -> str:
    """Return the symbol of a variable given by symbol or by name; SpecError with the nearest name if unknown."""
    if not isinstance(name, str):
        raise SpecError(f"{shown(name)} is not the name of a variable: give a text such as 'W' or 'links'")
    if is_single(name):
        return ALIASES.get(name, name)
    raise SpecError(f"unknown variable {shown(name)}{nearest(name, _KNOWN)}")


def is_single(name: str) -> bool:
    """Whether ``name`` is the symbol or the name of one variable."""
    symbol = ALIASES.get(name, name)
    return symbol == "N" or is_variable(symbol)


def read_question(question: Mapping[str, Any]) -> tuple[dict[str, Range], dict[str, Any], dict[int, Range]]:
    """Split keywords into ranges by symbol, options and levels; validates everything."""
    ranges: dict[str, Range] = {}
    options: dict[str, Any] = {}
    levels: dict[int, Range] = {}
    for name, value in question.items():
        if value is None:
            if name not in OPTIONS and ALIASES.get(name, name) not in FAMILIES:
                symbol_of(name)
        elif name == "levels":
            levels = _levels(value)
        elif name in OPTIONS:
            _add_option(options, name, value)
        elif letter := FAMILIES.get(ALIASES.get(name, name)):
            if not isinstance(value, Mapping):
                raise SpecError(f"{name} = {shown(value)}: give a mapping such as {{2: 3}}")
            for kind, number in value.items():
                symbol = f"{letter}{kind if isinstance(kind, str) else whole(kind, f'{name}: a kind', 1, LARGEST)}"
                if not is_variable(symbol):
                    least, most = (2, LARGEST) if letter == "n" else (1, 5)
                    raise SpecError(f"{name}: unknown kind {shown(kind)}; give an integer between {least} and {most}")
                if number is not None:
                    _add(ranges, name, symbol, number)
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
        if not isinstance(key, str) or not (is_single(key) or key in _KNOWN or key in FAMILIES):
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
        read: dict[int, Any] = {}
        for inner, own in value.items():
            digits = isinstance(inner, str) and _NUMBER.fullmatch(inner)
            number = int(inner) if digits else whole(inner, f"a key of {key}", -LARGEST, LARGEST)
            read[number] = _plain_value(key, own)
        return read
    if isinstance(value, str) and not (key == "max_link_joints" and value == "all"):
        if _NUMBER.fullmatch(value):
            raise SpecError(f'{key} = "{value}" is text; write the number without quotes: {int(value)}')
        return _parse_value(key, value)
    return value


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
