"""Dimensions of the lambda linkage with the tolerances of ``[mechanism.tolerances]``, exactly as they are written."""

from __future__ import annotations

from collections.abc import Mapping
from fractions import Fraction
from typing import TYPE_CHECKING, Any

from graphsynth.pipeline.stages import Context
from graphsynth.systems.lambda_linkage.system import LambdaTable

if TYPE_CHECKING:
    from graphsynth.core.errors import SceneError
    from graphsynth.jamming.bearing.parameters import ToleranceBox

__all__ = ["tolerance_box"]

#: Key of ``[mechanism.tolerances]``: parameter of the box, and where its nominal value stands in the scene.
_TOLERANCES: dict[str, tuple[str, tuple[str, str] | None]] = {
    "frame": ("l1", ("lengths", "frame")),
    "crank": ("l2", ("lengths", "crank")),
    "coupler": ("l3", ("lengths", "coupler")),
    "rocker": ("l4", ("lengths", "rocker")),
    "alpha_rad": ("alpha", ("tilt", "alpha_rad")),
    "azimuth_rad": ("azimuth", None),
    "radius_mm": ("Rb", ("bearing", "radius_mm")),
    "height_mm": ("Hb", ("bearing", "height_mm")),
    "clearance_mm": ("clearance", ("bearing", "clearance_mm")),
}


def _table(context: Context) -> LambdaTable:
    table = context.scene.mechanism
    assert isinstance(table, LambdaTable)
    return table


def tolerance_box(context: Context, tolerances: bool = True) -> ToleranceBox:
    """Return the exact dimensions of the scene, with the tolerances of ``[mechanism.tolerances]`` if there are any.

    Numbers of the file are taken as the decimals that stand there, not as the doubles nearest to them; a dimension that
    was changed after reading is taken as the double it is.

    Raises
    ------
    SceneError
        For a tolerance with an unknown name, one that is no number, or one so large that a dimension may vanish.
    """
    from graphsynth.core.errors import GeometryError
    from graphsynth.jamming.bearing.parameters import Range, ToleranceBox, spread

    table = _table(context)
    raw = context.scene.raw.get("mechanism", {})
    raw = raw if isinstance(raw, Mapping) else {}
    given: dict[str, Any] = {"azimuth": 0}
    for name, place in _TOLERANCES.values():
        if place:
            part = getattr(table, place[0])
            given[name] = _exact(_inside(raw, *place), getattr(part, place[1].removesuffix("_rad")))
    axis = [_exact(number, value) for number, value in zip(_axis(raw), table.tilt.axis)]
    for key, size in table.tolerances.items() if tolerances else ():
        name = _tolerance_name(context, key)
        absolute, relative = _tolerance(context, key, size)
        given[name] = spread(Range.read(key, given[name]), absolute, relative)
    try:
        return ToleranceBox(**given, axis=axis, sgn=table.branch)
    except GeometryError as error:
        raise _refused(context, str(error)) from None


def _refused(context: Context, sentence: str) -> SceneError:
    """Return a sentence about a parameter of the box with the place and the key of its tolerance in the scene."""
    place = context.scene.place / "mechanism"
    for key, (name, _) in _TOLERANCES.items():
        if sentence.startswith(f"{name} = ") and key in _table(context).tolerances:
            size = _table(context).tolerances[key]
            return (place / "tolerances").error(f"has {key} = {size!r}, so that {sentence}", key)
    return place.error(f"gives what no bearing has: {sentence}")


def _axis(raw: Mapping[str, Any]) -> list[Fraction | None]:
    from graphsynth.pipeline.tables import exact_number
    from graphsynth.pipeline.units import Unit

    tilt = raw.get("tilt", {})
    numbers = tilt.get("axis") if isinstance(tilt, Mapping) else None
    return [exact_number(number, Unit.parse("")) for number in numbers or [None] * 3]


def _inside(raw: Mapping[str, Any], table: str, key: str) -> Fraction | None:
    from graphsynth.pipeline.tables import written

    return written(raw.get(table, {}), key)


def _exact(number: Fraction | None, value: float) -> Any:
    """Return the number that stands in the file, if it is the one that was read; else the double."""
    return number if number is not None and float(number) == value else value


def _tolerance_name(context: Context, key: str) -> str:
    from graphsynth.pipeline.tables import suggest

    if key not in _TOLERANCES:
        raise (context.scene.place / "mechanism" / "tolerances").error(
            f"has an unknown key {key!r}{suggest(key, _TOLERANCES)}", key
        )
    return _TOLERANCES[key][0]


def _tolerance(context: Context, key: str, size: Any) -> tuple[Fraction, Fraction]:
    """Read an absolute tolerance, or a relative one such as ``"1 %"``."""
    from graphsynth.pipeline.tables import ANY_LENGTH
    from graphsynth.pipeline.units import Unit, convert, split_suffix, split_value

    expected = Unit.parse(split_suffix(key)[1]) if split_suffix(key)[1] else ANY_LENGTH
    try:
        number, text = split_value(size if isinstance(size, str) else repr(size))
        unit = Unit.parse(text)
        if text and text != "%":
            number, exact = convert(number, unit, expected) if unit.agrees(expected) else (Fraction(-1), True)
            number *= 1 if exact else 1 + Fraction(1, 10**40)  # outward: more than the error of pi
    except ValueError:
        number, text = Fraction(-1), ""
    if number < 0 or isinstance(size, bool):
        raise (context.scene.place / "mechanism" / "tolerances").error(
            f'has {key} = {size!r}; give a tolerance of zero or more, as in 0.005 or "0.005 {expected.text}", '
            'or relative, as in "1 %"',
            key,
        )
    return (Fraction(0), number / 100) if text == "%" else (number, Fraction(0))
