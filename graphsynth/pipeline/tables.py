"""Reading a TOML table into a frozen dataclass of SI values, with an answer for every mistake.

The dataclass *is* the schema: its annotations are the types, its defaults the defaults.  ``radius: Annotated[float,
In("mm", above=0)]`` is the key ``radius_mm``, whose bare numbers are millimetres; the file may also write
``radius_mm = "1.75 cm"`` or ``radius = "1.75 cm"``, and the field holds metres whichever it is.  A field without
`In` whose own name ends in a unit, ``radius_mm: float``, holds millimetres, as its name says.

An unknown key, a value of a wrong type or unit, one out of bounds and a missing key give one
`~graphsynth.core.errors.SceneError` that names the file, the line, the key, what was expected and, for a misspelt key,
the nearest valid one.
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
from graphsynth.pipeline.units import SUFFIXES, Unit, convert, split_suffix, split_value

T = TypeVar("T")

_WORDS: dict[type, str] = {str: "a string", int: "an integer", float: "a number", bool: "true or false"}
_NAMED = re.compile(r"(?:has|gives|lacks) (\w+)")
_lines = lru_cache(maxsize=4)(key_lines)

#: Sizes of numbers that are not zero, in the unit of their key: beyond, products of a few of them overflow or vanish.
SMALLEST, LARGEST = 1e-30, 1e18

#: Annotation of lengths that may be in any one unit: all of them with a written unit, or none.
ANY_LENGTH = Unit("mm", Fraction(1, 1000), 0, (1, 0, 0, 0, 0, 0))


@dataclasses.dataclass(frozen=True, slots=True)
class In:
    """Annotation of a number: the unit of a bare number in the file, and its bounds in that unit."""

    unit: str = ""  # as `SUFFIXES` lists them, or any other unit; empty for a plain number
    above: float = -math.inf  # bound that is excluded
    least: float = -math.inf
    below: float = math.inf  # bound that is excluded
    most: float = math.inf
    why: str = ""  # ends the message; without it the bounds do

    def refusal(self, number: float) -> str:
        """Return what to do if a number is out of bounds, and nothing if it is within.

        >>> In("mm", above=0).refusal(-1.0), In(least=2, most=9).refusal(1), In(above=0).refusal(3.0)
        ('it must be positive', 'use 2 to 9', '')
        """
        if self.above < number < self.below and self.least <= number <= self.most:
            return ""
        if self.why or self.below == self.most == math.inf:
            return self.why or ("it must be positive" if self.above == 0 else f"it must be at least {self.least:g}")
        if self.least > -math.inf and self.most < math.inf:
            return f"use {self.least:.15g} to {self.most:.15g}"
        start = f"more than {self.above:g}" if self.above > -math.inf else f"{self.least:g} or more"
        return f"use {start} and {f'at most {self.most:g}' if self.most < math.inf else f'less than {self.below:g}'}"


#: A number of crank positions of a full rotation.
Positions = Annotated[int, In(least=8, most=1_000_000, why="use 8 to 1000000 crank positions per turn")]


@dataclasses.dataclass(frozen=True, slots=True)
class Place:
    r"""Where a value stands: the file, the dotted key and, if the text is there, the line.

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

    >>> len(shortened("has an unknown key " + 5000 * "k"))
    99
    """
    return _LONG.sub(lambda word: word[0][:77] + "...", sentence)


def require(condition: bool, sentence: str) -> None:
    """Raise a `SceneError` unless the condition holds: for ``__post_init__`` of a schema; the reader adds the place.

    >>> require(1 > 0, "has length 0; a length must be positive")
    """
    if not condition:
        raise SceneError(sentence)


def suggest(word: str, choices: Iterable[str]) -> str:
    """Return ``"; did you mean 'x'?"`` for the nearest choice, or the list of choices if none is near.

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

    Its fields are ``str``, ``bool``, ``int``, ``float``, ``Literal``, tuples of these, ``X | None``, nested dataclasses
    or ``Mapping[str, object]`` (kept as it is); numbers may be annotated with `In`. A ``float`` field also takes a
    fraction, ``"1/30"``, because TOML has no exact way to write it, and a number with a unit, ``"2 deg"``.

    A `SceneError` with the place says what is wrong: an unknown or missing key, a value of a wrong type or unit.

    >>> @dataclasses.dataclass(frozen=True)
    ... class Bearing:
    ...     tilt: Annotated[float, In("rad")]
    ...     radius: Annotated[float, In("mm", above=0)] = 0.01
    >>> read_table(Bearing, {"tilt_rad": "1/4", "radius_mm": 17.5}, Place("x.toml"))
    Bearing(tilt=0.25, radius=0.0175)
    >>> read_table(Bearing, {"tilt": "250 mrad"}, Place("x.toml")).tilt
    0.25
    """
    if not isinstance(table, Mapping):
        raise place.error(f"must be a table, not {_shown(table)}")
    fields = fields_of(typing.cast(type, schema))
    keys = _keys(table, fields, place)
    _check_together(fields, table, place)
    values: dict[str, Any] = {}
    for field in fields:
        if field.name in keys:
            key = keys[field.name]
            values[field.name] = _read(field.kind, table[key], place / key, field, key != field.key)
        elif field.required:
            raise place.error(f"lacks the key {field.key!r} ({_expected(field.kind, field.unit)})")
    try:
        return schema(**values)
    except SceneError as error:
        named = _NAMED.match(str(error))
        by_key = {field.key: keys.get(field.name, "") for field in fields}
        raise place.error(str(error), by_key.get(named[1], "") if named else "") from None


@dataclasses.dataclass(frozen=True, slots=True)
class Field:
    """One key of a table."""

    name: str  # of the field of the dataclass
    key: str  # in the file
    alias: str  # the key for a value with a written unit; empty if there is none
    kind: Any  # the annotation without `In` and unit
    unit: Unit  # of a bare number
    bounds: In | None
    si: bool  # the field holds SI; otherwise a number in `unit`
    default: Any  # `dataclasses.MISSING` if the key must be given, or if each table has its own
    required: bool


_SUFFIX_OF = {unit: suffix for suffix, unit in reversed(SUFFIXES.items())}


@lru_cache
def fields_of(schema: type) -> tuple[Field, ...]:
    """Return the keys of a table from its frozen dataclass.

    >>> @dataclasses.dataclass(frozen=True)
    ... class Gear:
    ...     radius: Annotated[float, In("mm")]
    ...     teeth: int = 20
    >>> [(field.key, field.alias, field.required) for field in fields_of(Gear)]
    [('radius_mm', 'radius', True), ('teeth', '', False)]
    """
    hints = typing.get_type_hints(schema, include_extras=True)
    found: list[Field] = []
    for field in dataclasses.fields(typing.cast(Any, schema)):
        kind = hints[field.name]
        notes = typing.get_args(kind)[1:] if typing.get_origin(kind) is Annotated else ()
        kind = typing.get_args(kind)[0] if notes else kind
        bounds = next((note for note in notes if isinstance(note, In)), None)
        si = bounds is not None and bool(bounds.unit)
        bare, suffix = split_suffix(field.name)
        known = bounds.unit if bounds and si else suffix
        unit = next((note for note in notes if isinstance(note, Unit)), Unit.parse(known))
        key = f"{field.name}_{_SUFFIX_OF[known]}" if si and known in _SUFFIX_OF else field.name
        alias = field.name if key != field.name else bare if suffix and _is_number(kind) else ""
        missing = field.default is dataclasses.MISSING
        required = missing and field.default_factory is dataclasses.MISSING
        found.append(Field(field.name, key, alias, kind, unit, bounds, si, field.default, required))
    taken = [key for field in found for key in {field.key, field.alias}]
    return tuple(dataclasses.replace(f, alias=f.alias if taken.count(f.alias) == 1 else "") for f in found)


def _is_number(kind: Any) -> bool:
    return kind is float or any(_is_number(inner) for inner in typing.get_args(kind))


def _keys(table: Mapping[str, object], fields: Iterable[Field], place: Place) -> dict[str, str]:
    """Map each field that is given to the key that gives it."""
    known = {key: field.name for field in fields for key in (field.key, field.alias) if key}
    keys: dict[str, str] = {}
    for key in table:
        name = known.get(key)
        if name is None:
            raise unknown(place, str(key), [field.key for field in fields])
        if name in keys:
            raise place.error(f"gives both {keys[name]!r} and {key!r}; remove one", key)
        keys[name] = key
    return keys


def _check_together(fields: Iterable[Field], table: Mapping[str, object], place: Place) -> None:
    """Refuse lengths "in any one unit" of which some have a written unit and some have none."""
    names = [field.key for field in fields if field.unit is ANY_LENGTH and field.key in table]
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


def _read(kind: Any, value: object, place: Place, field: Field, unit_needed: bool) -> Any:
    """Read one value of the annotated `kind`."""
    origin = typing.get_origin(kind)
    if dataclasses.is_dataclass(kind):
        return read_table(typing.cast(type, kind), value, place)
    if origin is Literal:
        choices = typing.get_args(kind)
        if any(type(choice) is type(value) and choice == value for choice in choices):
            return value
        hint = nearest(value, [c for c in choices if isinstance(c, str)]) if isinstance(value, str) else ""
        raise place.error(f"must be one of {', '.join(map(repr, choices))}, not {_shown(value)}{hint}")
    if origin in (Union, types.UnionType):
        (inner,) = (a for a in typing.get_args(kind) if a is not type(None))
        return _read(inner, value, place, field, unit_needed)
    if origin is tuple:
        return _read_tuple(typing.get_args(kind), value, place, field, unit_needed)
    if origin is not None and issubclass(origin, Mapping):
        if not isinstance(value, Mapping):
            raise place.error(f"must be a table, not {_shown(value)}")
        return dict(value)
    if kind is float:
        number = _read_float(value, place, field.unit, unit_needed)
        _check_bounds(number, place, field)
        return field.unit.to_si(number) if field.si else number
    # bool is a subclass of int: `positions = true` must not pass for 1.
    if isinstance(value, kind) and not (kind is int and isinstance(value, bool)):
        if kind is int:
            _check_bounds(value, place, field)
        return value
    raise place.error(f"must be {_WORDS[kind]}, not {_shown(value)}")


def _check_bounds(number: float, place: Place, field: Field) -> None:
    why = field.bounds.refusal(number) if field.bounds else ""
    if why and place.keys[-1].isdigit():
        raise place.error(f"is {number}; {why}")
    if why:
        raise dataclasses.replace(place, keys=place.keys[:-1]).error(
            f"has {place.keys[-1]} = {number}; {why}", place.keys[-1]
        )


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
            f"is {_shown(value)}, out of range; use 0 or a size from {SMALLEST:g} to {LARGEST:g}"
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
                f"must be {_wanted(unit, unit_needed)}, not {_shown(value)}: unknown unit {str(error)!r}"
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


def _read_tuple(
    kinds: tuple[Any, ...], value: object, place: Place, field: Field, unit_needed: bool
) -> tuple[Any, ...]:
    if not isinstance(value, list | tuple):
        raise place.error(f"must be a list, not {_shown(value)}")
    if kinds[-1] is Ellipsis:
        kinds = (kinds[0],) * len(value)
    if len(kinds) != len(value):
        raise place.error(f"must be a list of {len(kinds)} values, not {len(value)}")
    pairs = enumerate(zip(kinds, value, strict=True))
    return tuple(_read(kind, item, place / str(i), field, unit_needed) for i, (kind, item) in pairs)


def _expected(kind: Any, unit: Unit) -> str:
    """Say in words what a field takes."""
    origin = typing.get_origin(kind)
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
