"""Reading a TOML table into a frozen dataclass, with an answer for every mistake.

The dataclass *is* the schema: its field names are the keys, its annotations the types, its defaults the defaults.
A key nobody knows, a value of a wrong type and a missing key give one :class:`~graphsynth.errors.SceneError` that
names the file, the key, what was expected and, for a misspelt key, the nearest valid one.
"""

from __future__ import annotations

import contextlib
import dataclasses
import math
import re
import types
import typing
from collections.abc import Iterable, Mapping
from fractions import Fraction
from typing import Any, Literal, TypeVar, Union

from graphsynth.errors import SceneError
from graphsynth.structure.variables import nearest

__all__ = ["Place", "check_positions", "read_table", "require", "suggest", "unknown"]

T = TypeVar("T")

_FRACTION = re.compile(r"[+-]?[0-9]{1,18}/[0-9]{1,18}", re.ASCII)
_WORDS: dict[type, str] = {str: "a string", int: "an integer", float: "a number", bool: "true or false"}


@dataclasses.dataclass(frozen=True, slots=True)
class Place:
    """Where a value stands: the file and the dotted key.

    Examples
    --------
    >>> str(Place("lambda.toml") / "mechanism" / "tilt")
    'lambda.toml: [mechanism.tilt]'
    """

    file: str
    keys: tuple[str, ...] = ()

    def __truediv__(self, key: str) -> Place:
        return Place(self.file, (*self.keys, key))

    def __str__(self) -> str:
        return f"{self.file}: [{'.'.join(self.keys)}]" if self.keys else self.file

    def error(self, sentence: str) -> SceneError:
        """Return the exception for this place."""
        return SceneError(f"{self} {sentence}")


def require(condition: bool, sentence: str) -> None:
    """Raise a `SceneError` unless the condition holds: for ``__post_init__`` of a schema; the reader adds the place.

    Examples
    --------
    >>> require(1 > 0, "has length 0; a length must be positive")
    """
    if not condition:
        raise SceneError(sentence)


def check_positions(positions: int) -> None:
    """Refuse a number of positions per turn that nobody can mean."""
    require(8 <= positions <= 1_000_000, f"has positions = {positions}; use 8 to 1000000 crank positions per turn")


def suggest(word: str, choices: Iterable[str]) -> str:
    """Return ``"; did you mean 'x'?"`` for the nearest choice, or the list of choices if none is near.

    Examples
    --------
    >>> suggest("lenghts", ["lengths", "tilt"])
    "; did you mean 'lengths'?"
    >>> suggest("colour", ["lengths", "tilt"])
    "; known are 'lengths', 'tilt'"
    """
    names = sorted(choices)
    return nearest(word, names) or ("; known are " + ", ".join(map(repr, names)) if names else "")


def unknown(place: Place, key: str, choices: Iterable[str]) -> SceneError:
    """Return the error for a key that the table at `place` does not have."""
    return place.error(f"has an unknown key {key!r}{suggest(key, choices)}")


def read_table(schema: type[T], table: object, place: Place) -> T:
    """Read a mapping into the frozen dataclass `schema`.

    Parameters
    ----------
    schema : type
        A dataclass whose fields are ``str``, ``bool``, ``int``, ``float``, ``Literal``, tuples of these,
        ``X | None``, nested dataclasses or ``Mapping[str, object]`` (kept as it is). A ``float`` field also takes a
        fraction as a string, ``"1/30"``, because TOML has no exact way to write it.
    table : object
        The value found in the file.
    place : Place
        Where it was found.

    Raises
    ------
    SceneError
        On an unknown or missing key and on a value of a wrong type; the message names the place.

    Examples
    --------
    >>> @dataclasses.dataclass(frozen=True)
    ... class Tilt:
    ...     alpha: float
    ...     axis: tuple[float, float, float] = (1.0, 0.0, 0.0)
    >>> read_table(Tilt, {"alpha": "1/4"}, Place("x.toml"))
    Tilt(alpha=0.25, axis=(1.0, 0.0, 0.0))
    """
    if not isinstance(table, Mapping):
        raise place.error(f"must be a table, not {_shown(table)}")
    hints = typing.get_type_hints(schema)
    fields = {f.name: f for f in dataclasses.fields(typing.cast(Any, schema))}
    for key in table:
        if key not in fields:
            raise unknown(place, str(key), fields)
    values: dict[str, Any] = {}
    for name, field in fields.items():
        if name in table:
            values[name] = _read(hints[name], table[name], place / name)
        elif field.default is dataclasses.MISSING and field.default_factory is dataclasses.MISSING:
            raise place.error(f"lacks the key {name!r} ({_expected(hints[name])})")
    try:
        return schema(**values)
    except SceneError as error:
        raise place.error(str(error)) from None


def _read(kind: Any, value: object, place: Place) -> Any:
    """Read one value of the annotated `kind`."""
    origin = typing.get_origin(kind)
    if dataclasses.is_dataclass(kind):
        return read_table(typing.cast(type, kind), value, place)
    if origin is Literal:
        return _read_choice(typing.get_args(kind), value, place)
    if origin in (Union, types.UnionType):
        (inner,) = (a for a in typing.get_args(kind) if a is not type(None))
        return _read(inner, value, place)
    if origin is tuple:
        return _read_tuple(typing.get_args(kind), value, place)
    if origin is not None and issubclass(origin, Mapping):
        if not isinstance(value, Mapping):
            raise place.error(f"must be a table, not {_shown(value)}")
        return types.MappingProxyType(dict(value))
    return _read_scalar(kind, value, place)


def _read_scalar(kind: type, value: object, place: Place) -> Any:
    if kind is float:
        return _read_float(value, place)
    # bool is a subclass of int: `positions = true` must not pass for 1.
    if isinstance(value, kind) and not (kind is int and isinstance(value, bool)):
        return value
    raise place.error(f"must be {_WORDS[kind]}, not {_shown(value)}")


def _read_float(value: object, place: Place) -> float:
    number = math.nan
    if isinstance(value, int | float) and not isinstance(value, bool):
        try:
            number = float(value)
        except OverflowError:
            number = math.inf
    elif isinstance(value, str) and _FRACTION.fullmatch(value):
        with contextlib.suppress(ZeroDivisionError):
            number = float(Fraction(value))
    if not math.isfinite(number):
        raise place.error(f'must be a finite number (or a fraction such as "1/30"), not {_shown(value)}')
    return number


def _read_choice(choices: tuple[Any, ...], value: object, place: Place) -> Any:
    for choice in choices:
        if type(choice) is type(value) and choice == value:
            return choice
    hint = nearest(value, [c for c in choices if isinstance(c, str)]) if isinstance(value, str) else ""
    raise place.error(f"must be one of {', '.join(map(repr, choices))}, not {_shown(value)}{hint}")


def _read_tuple(kinds: tuple[Any, ...], value: object, place: Place) -> tuple[Any, ...]:
    if not isinstance(value, list | tuple):
        raise place.error(f"must be a list, not {_shown(value)}")
    if kinds[-1] is Ellipsis:
        kinds = (kinds[0],) * len(value)
    if len(kinds) != len(value):
        raise place.error(f"must be a list of {len(kinds)} values, not {len(value)}")
    return tuple(_read(kind, item, place / str(i)) for i, (kind, item) in enumerate(zip(kinds, value, strict=True)))


def _expected(kind: Any) -> str:
    """Say in words what a field takes."""
    origin = typing.get_origin(kind)
    if kind in _WORDS:
        return _WORDS[kind]
    if origin is Literal:
        return "one of " + ", ".join(map(repr, typing.get_args(kind)))
    return "a list" if origin is tuple else "a table"


def _shown(value: object) -> str:
    text = repr(value)
    return text if len(text) <= 60 else text[:57] + "..."
