"""Reading a TOML table into a frozen dataclass, with an answer for every mistake.

The dataclass *is* the schema: its field names are the keys, its annotations the types, its defaults the defaults.
An unknown key, a value of a wrong type or unit and a missing key give one `~graphsynth.core.errors.SceneError` that
names the file, the line, the key, what was expected and, for a misspelt key, the nearest valid one.

The ending of a key says its unit: ``radius_mm = 17.5``.  Instead, a unit may be written: ``radius_mm = "1.75 cm"``, or
``radius = "1.75 cm"``.  A field whose name does not say its unit carries it: ``Annotated[float, Unit.parse("N/m")]``.
"""

from __future__ import annotations

import dataclasses
import datetime
import math
import re
import types
import typing
from collections.abc import Iterable, Mapping
from fractions import Fraction
from functools import lru_cache
from typing import Annotated, Any, Literal, TypeVar, Union

from graphsynth.core.errors import SceneError
from graphsynth.core.wording import nearest
from graphsynth.pipeline.lines import key_lines, line_of
from graphsynth.pipeline.units import Unit, convert, split_suffix, split_value

__all__ = [
    "ANY_LENGTH",
    "Place",
    "aliases",
    "check_positions",
    "read_table",
    "require",
    "require_positive",
    "shortened",
    "suggest",
    "unit_of",
    "unknown",
    "written",
]

T = TypeVar("T")

_WORDS: dict[type, str] = {str: "a string", int: "an integer", float: "a number", bool: "true or false"}
_NAMED = re.compile(r"(?:has|gives) (\w+)")
_lines = lru_cache(maxsize=4)(key_lines)

#: Sizes of numbers that are not zero, in the unit of their key: beyond, products of a few of them overflow or vanish.
SMALLEST, LARGEST = 1e-30, 1e18

#: Annotation of lengths that may be in any one unit: all of them with a written unit, or none.
ANY_LENGTH = Unit("mm", Fraction(1, 1000), 0, (1, 0, 0, 0, 0, 0))


@dataclasses.dataclass(frozen=True, slots=True)
class Place:
    r"""Where a value stands: the file, the dotted key and, if the text is there, the line.

    Examples
    --------
    >>> str(Place("lambda.toml") / "mechanism" / "tilt")
    'lambda.toml: [mechanism.tilt]'
    >>> str(Place("lambda.toml", text="[mechanism]\ntilt = 1") / "mechanism" / "tilt")
    'lambda.toml, line 2: [mechanism.tilt]'
    """

    file: str
    keys: tuple[str, ...] = ()
    text: str = dataclasses.field(default="", repr=False, compare=False)

    def __truediv__(self, key: str) -> Place:
        return Place(self.file, (*self.keys, key), self.text)

    def __str__(self) -> str:
        return self._said()

    def _said(self, key: str = "") -> str:
        line = line_of(_lines(self.text), (*self.keys, key) if key else self.keys) if self.text else None
        file = self.file if line is None else f"{self.file}, line {line}"
        return f"{file}: [{shortened('.'.join(self.keys))}]" if self.keys else file

    def error(self, sentence: str, key: str = "") -> SceneError:
        """Return the exception for this place, or with the line of a key of the table at this place."""
        return SceneError(f"{self._said(key)} {shortened(sentence)}")


_LONG = re.compile(r"\S{81,}")


def shortened(sentence: str) -> str:
    """Return a sentence in which no word is longer than a line: some files hold keys of megabytes.

    Examples
    --------
    >>> len(shortened("has an unknown key " + 5000 * "k"))
    99
    """
    return _LONG.sub(lambda word: word[0][:77] + "...", sentence)


def require(condition: bool, sentence: str) -> None:
    """Raise a `SceneError` unless the condition holds: for ``__post_init__`` of a schema; the reader adds the place.

    Examples
    --------
    >>> require(1 > 0, "has length 0; a length must be positive")
    """
    if not condition:
        raise SceneError(sentence)


def require_positive(table: object, names: Iterable[str], why: str = "it must be positive") -> None:
    """Raise a `SceneError` unless these keys of a table are positive; `why` ends the sentence."""
    for name in names:
        value = getattr(table, name)
        require(value > 0, f"has {name} = {value}; {why}")


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
    return place.error(f"has an unknown key {key!r}{suggest(key, choices)}", key)


def read_table(schema: type[T], table: object, place: Place) -> T:
    """Read a mapping into the frozen dataclass `schema`.

    Parameters
    ----------
    schema : type
        A dataclass whose fields are ``str``, ``bool``, ``int``, ``float``, ``Literal``, tuples of these,
        ``X | None``, nested dataclasses or ``Mapping[str, object]`` (kept as it is). A ``float`` field also takes a
        fraction, ``"1/30"``, because TOML has no exact way to write it, and a number with a unit, ``"2 deg"``.
    table : object
        The value found in the file.
    place : Place
        Where it was found.

    Raises
    ------
    SceneError
        On an unknown or missing key and on a value of a wrong type or unit; the message names the place.

    Examples
    --------
    >>> @dataclasses.dataclass(frozen=True)
    ... class Tilt:
    ...     alpha_rad: float
    ...     axis: tuple[float, float, float] = (1.0, 0.0, 0.0)
    >>> read_table(Tilt, {"alpha_rad": "1/4"}, Place("x.toml"))
    Tilt(alpha_rad=0.25, axis=(1.0, 0.0, 0.0))
    >>> read_table(Tilt, {"alpha": "250 mrad"}, Place("x.toml")).alpha_rad
    0.25
    """
    if not isinstance(table, Mapping):
        raise place.error(f"must be a table, not {_shown(table)}")
    hints = typing.get_type_hints(schema, include_extras=True)
    fields = {f.name: f for f in dataclasses.fields(typing.cast(Any, schema))}
    keys = _keys(table, hints, place)
    _check_together(hints, table, place)
    values: dict[str, Any] = {}
    for name, field in fields.items():
        if name in keys:
            unit, key = unit_of(name, hints[name]), keys[name]
            values[name] = _read(hints[name], table[key], place / key, unit, key != name)
        elif field.default is dataclasses.MISSING and field.default_factory is dataclasses.MISSING:
            raise place.error(f"lacks the key {name!r} ({_expected(hints[name], unit_of(name, hints[name]))})")
    try:
        return schema(**values)
    except SceneError as error:
        named = _NAMED.match(str(error))
        raise place.error(str(error), keys.get(named[1], "") if named else "") from None


def aliases(hints: Mapping[str, Any]) -> dict[str, str]:
    """Return the keys that may stand for a field when their value says its unit: name without unit -> field.

    Examples
    --------
    >>> aliases({"radius_mm": float, "teeth": int})
    {'radius': 'radius_mm'}
    """
    short: dict[str, list[str]] = {}
    for name, kind in hints.items():
        bare, unit = split_suffix(name)
        if unit and _is_number(kind):
            short.setdefault(bare, []).append(name)
    return {bare: names[0] for bare, names in short.items() if len(names) == 1 and bare not in hints}


def _is_number(kind: Any) -> bool:
    return kind is float or any(_is_number(inner) for inner in typing.get_args(kind))


def _keys(table: Mapping[str, object], hints: Mapping[str, Any], place: Place) -> dict[str, str]:
    """Map each field that is given to the key that gives it."""
    short = aliases(hints)
    keys: dict[str, str] = {}
    for key in table:
        name = key if key in hints else short.get(key)
        if name is None:
            raise unknown(place, str(key), hints)
        if name in keys:
            raise place.error(f"gives both {keys[name]!r} and {key!r}; remove one", key)
        keys[name] = key
    return keys


def unit_of(name: str, kind: Any) -> Unit:
    """Return the unit of a bare number: as annotated, else as the ending of the key says."""
    if typing.get_origin(kind) is Annotated:
        for note in typing.get_args(kind)[1:]:
            if isinstance(note, Unit):
                return note
    return Unit.parse(split_suffix(name)[1])


def _check_together(hints: Mapping[str, Any], table: Mapping[str, object], place: Place) -> None:
    """Refuse lengths "in any one unit" of which some have a written unit and some have none."""
    names = [name for name, kind in hints.items() if unit_of(name, kind) is ANY_LENGTH and name in table]
    bare = [name for name in names if not (isinstance(table[name], str) and _has_unit(str(table[name])))]
    if bare and len(bare) < len(names):
        raise place.error(
            f"gives {bare[0]} without a unit and others with one; write all with a unit, or none", bare[0]
        )


def _has_unit(text: str) -> bool:
    try:
        return bool(split_value(text)[1])
    except ValueError:
        return False


def written(table: object, field: str) -> Fraction | None:
    """Return the number that a raw table gives for a field, exactly as written and in the field's unit.

    None if the field is not given, is no number, or needs pi to be converted.

    Examples
    --------
    >>> written({"radius": "1.75 cm"}, "radius_mm"), written({"radius_mm": 17.5}, "radius_mm")
    (Fraction(35, 2), Fraction(35, 2))
    """
    if not isinstance(table, Mapping):
        return None
    bare, unit = split_suffix(field)
    return exact_number(table.get(field, table.get(bare)), Unit.parse(unit))


def exact_number(value: object, unit: Unit) -> Fraction | None:
    """Return a written value exactly, in `unit`; None if it is no number or needs pi to be converted."""
    try:
        number, text = split_value(value if isinstance(value, str) else repr(value))
        converted, exact = convert(number, Unit.parse(text), unit) if text else (number, True)
    except ValueError:
        return None
    return converted if exact and not isinstance(value, bool) else None


def _read(kind: Any, value: object, place: Place, unit: Unit, unit_needed: bool = False) -> Any:
    """Read one value of the annotated `kind`."""
    origin = typing.get_origin(kind)
    if dataclasses.is_dataclass(kind):
        return read_table(typing.cast(type, kind), value, place)
    if origin is Annotated:
        return _read(typing.get_args(kind)[0], value, place, unit, unit_needed)
    if origin is Literal:
        return _read_choice(typing.get_args(kind), value, place)
    if origin in (Union, types.UnionType):
        (inner,) = (a for a in typing.get_args(kind) if a is not type(None))
        return _read(inner, value, place, unit, unit_needed)
    if origin is tuple:
        return _read_tuple(typing.get_args(kind), value, place, unit, unit_needed)
    if origin is not None and issubclass(origin, Mapping):
        if not isinstance(value, Mapping):
            raise place.error(f"must be a table, not {_shown(value)}")
        return dict(value)
    if kind is float:
        return _read_float(value, place, unit, unit_needed)
    # bool is a subclass of int: `positions = true` must not pass for 1.
    if isinstance(value, kind) and not (kind is int and isinstance(value, bool)):
        return value
    raise place.error(f"must be {_WORDS[kind]}, not {_shown(value)}")


def _read_float(value: object, place: Place, unit: Unit, unit_needed: bool) -> float:
    number = math.nan
    if isinstance(value, int | float) and not isinstance(value, bool) and not unit_needed:
        try:
            number = float(value)
        except OverflowError:
            number = math.inf
    elif isinstance(value, str):
        number = _read_written(value, place, unit, unit_needed)
    if not math.isfinite(number):
        raise place.error(f"must be {_wanted(unit, unit_needed)}, not {_shown(value)}")
    if number and not SMALLEST <= abs(number) <= LARGEST:
        raise place.error(
            f"is {_shown(value)}, which no mechanism has; use 0 or a size from {SMALLEST:g} to {LARGEST:g}"
            f"{' ' + unit.text if unit.text else ''}"
        )
    return number


def _read_written(value: str, place: Place, unit: Unit, unit_needed: bool) -> float:
    """Read a number with a unit; NaN if it is no number."""
    try:
        number, text = split_value(value)
    except ValueError:
        return math.nan
    if not text and unit_needed:
        return math.nan
    if text:
        try:
            given = Unit.parse(text)
        except ValueError as error:
            raise place.error(
                f"must be {_wanted(unit, unit_needed)}, not {_shown(value)}: nobody knows the unit {str(error)!r}"
            ) from None
        if not given.agrees(unit):
            raise place.error(f"must be {_wanted(unit, unit_needed)}, not {_shown(value)}, which is {given.quantity}")
        number, _ = convert(number, given, unit)
    try:
        return float(number)
    except OverflowError:
        return math.inf


def _wanted(unit: Unit, unit_needed: bool = False) -> str:
    """Say what a number must be."""
    if not unit.text:
        return 'a finite number (or a fraction such as "1/30")'
    if unit_needed:
        return f'{unit.quantity} with its unit, such as "17.5 {unit.text}"'
    return f'a finite number in {unit.text}, or {unit.quantity} such as "17.5 {unit.text}"'


def _read_choice(choices: tuple[Any, ...], value: object, place: Place) -> Any:
    for choice in choices:
        if type(choice) is type(value) and choice == value:
            return choice
    hint = nearest(value, [c for c in choices if isinstance(c, str)]) if isinstance(value, str) else ""
    raise place.error(f"must be one of {', '.join(map(repr, choices))}, not {_shown(value)}{hint}")


def _read_tuple(kinds: tuple[Any, ...], value: object, place: Place, unit: Unit, unit_needed: bool) -> tuple[Any, ...]:
    if not isinstance(value, list | tuple):
        raise place.error(f"must be a list, not {_shown(value)}")
    if kinds[-1] is Ellipsis:
        kinds = (kinds[0],) * len(value)
    if len(kinds) != len(value):
        raise place.error(f"must be a list of {len(kinds)} values, not {len(value)}")
    pairs = enumerate(zip(kinds, value, strict=True))
    return tuple(_read(kind, item, place / str(i), unit, unit_needed) for i, (kind, item) in pairs)


def _expected(kind: Any, unit: Unit) -> str:
    """Say in words what a field takes."""
    origin = typing.get_origin(kind)
    if origin is Annotated:
        return _expected(typing.get_args(kind)[0], unit)
    if kind is float and unit.text:
        return _wanted(unit)
    if kind in _WORDS:
        return _WORDS[kind]
    if origin is Literal:
        return "one of " + ", ".join(map(repr, typing.get_args(kind)))
    return "a list" if origin is tuple else "a table"


def _shown(value: object) -> str:
    if isinstance(value, datetime.date | datetime.time):
        return f"the {'time' if isinstance(value, datetime.time) else 'date'} {value}"
    try:
        text = repr(value)
    except ValueError:  # an integer of thousands of digits
        return "a number of thousands of digits"
    return text if len(text) <= 60 else text[:57] + "..."
