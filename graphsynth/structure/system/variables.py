"""The variables of the structural system: symbols, names, ranges, and how a value is read.

Twelve quantities and two families describe the structure of a mechanism.  Each has a symbol (the one of the
equations) and a descriptive name; both are accepted wherever a variable is named.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping
from typing import Any, TypeAlias

from graphsynth.core.errors import SpecError
from graphsynth.core.wording import index_of, shown

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
    least, most = _natural(symbol)
    for side in (lo, hi):
        if side is not None and not least <= side <= most:
            raise SpecError(f"{symbol} = {shown(side)} is out of range: {symbol} must be between {least} and {most}")
    if lo is not None and hi is not None and lo > hi:
        raise SpecError(f"{symbol}: the lowest value {lo} is above the highest value {hi}; swap them")
    return lo, hi


def _natural(symbol: str) -> tuple[int, int]:
    if symbol == "Pi":
        return SPACES[0], SPACES[-1]
    if symbol == "N":
        return 2, LARGEST + 1
    return _LEAST.get(symbol, 0), LARGEST


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

    Examples
    --------
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
