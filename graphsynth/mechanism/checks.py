"""Checks of numbers that describe a mechanism."""

from __future__ import annotations

import math
import operator
from collections.abc import Callable, Iterable, Mapping
from typing import Any

from graphsynth.arguments import checker
from graphsynth.errors import GeometryError, GraphsynthError

__all__ = [
    "LARGEST",
    "SMALLEST",
    "Size",
    "called",
    "check_fields",
    "check_largest",
    "check_sizes",
    "checked",
    "finite",
    "link_number",
    "nonzero",
    "point",
]

_CLASSES = [
    "Bearing",
    "Braider",
    "CircleEllipse",
    "DynamicModel",
    "DynamicMotion",
    "EngineSettings",
    "ErrorRow",
    "ExudynSettings",
    "Fraction",
    "Interval",
    "LambdaLinkage",
    "Mechanism",
    "MechanismGraph",
    "MotorDrivenPlatform",
    "MujocoSettings",
    "ParallelPlatform",
    "PistonMachine",
    "Range",
    "Reading",
    "SingleMotorPlatform",
    "StartReport",
    "Sweep",
    "ToleranceBox",
    "Tribometer",
]
#: Lets a function keep what its annotations say; a `GeometryError` names the argument that is something else.
checked = checker(GeometryError, _CLASSES, {"Condition": "str"})

Point = tuple[float, float]
Size = float | complex | None

#: Sizes from SMALLEST to LARGEST are taken, in whatever unit: products of four lengths are then numbers.
SMALLEST, LARGEST = 1e-60, 1e60


def finite(name: str, value: Any) -> float:
    """Return ``value`` as a float; raise `GeometryError` if it is not a finite real number."""
    if isinstance(value, bool | str | bytes):
        raise GeometryError(f"{name} = {value!r} is not a real number; give a finite one")
    try:
        number = float(value)
    except OverflowError as error:  # an integer of any length: its digits help nobody
        raise GeometryError(f"{name} is beyond the largest float, 1.8e308; give a finite number") from error
    except (TypeError, ValueError) as error:
        raise GeometryError(f"{name} = {value!r} is not a real number; give a finite one") from error
    if not math.isfinite(number):
        raise GeometryError(f"{name} = {number} is not finite; give a finite number")
    return number


def called(name: str, function: Callable[..., Any], *arguments: Any) -> Any:
    """Call a function that a user gave; raise `GeometryError` where it raises, with its own words."""
    try:
        return function(*arguments)
    except GraphsynthError:
        raise
    except Exception as error:
        at = ", ".join(str(argument) for argument in arguments)
        words = f"{type(error).__name__}: {error}"
        raise GeometryError(f"{name} raised {words} when called with ({at}); it must have a value there") from error


def nonzero(name: str, value: Any) -> float:
    """Return ``value`` as a positive float; raise `GeometryError` otherwise."""
    number = finite(name, value)
    if number <= 0.0:
        raise GeometryError(f"{name} = {number} must be positive; correct the value")
    return number


def point(name: str, value: Any) -> Point:
    """Return a point of the plane as two finite floats; a complex number is read as x + i y."""
    if isinstance(value, complex):
        value = (value.real, value.imag)
    try:
        parts = tuple(value)
    except TypeError as error:
        raise GeometryError(f"{name} = {value!r} is not a point; give two numbers") from error
    if len(parts) != 2:
        raise GeometryError(f"{name} has {len(parts)} coordinates; give two")
    return finite(f"{name}.x", parts[0]), finite(f"{name}.y", parts[1])


def link_number(name: str, value: Any) -> int:
    """Return a link number as an int; raise `GeometryError` for anything else."""
    try:
        number = -1 if isinstance(value, bool) else operator.index(value)
    except TypeError:
        number = -1
    if number < 0:
        raise GeometryError(f"{name} = {value!r} is not a link; give its number, 0 or more")
    return number


def check_sizes(owner: str, sizes: Mapping[str, Size], error: type[GraphsynthError] = GeometryError) -> None:
    """Refuse sizes whose products leave the range of double precision; zero and None are left to other checks.

    Parameters
    ----------
    owner : str
        What has these sizes, for the sentence.
    sizes : mapping of str to float, complex or None
        Checked values by name: lengths, masses, stiffnesses, ...; the magnitude of a complex one.
    error : type
        Exception of the caller's room.

    Raises
    ------
    GeometryError or ``error``
        A size beyond 1e60 or between 0 and 1e-60.

    Examples
    --------
    >>> check_sizes("the lever", {"length": 1e-70})
    Traceback (most recent call last):
        ...
    graphsynth.errors.GeometryError: length = 1e-70 of the lever is not between 1e-60 and 1e+60; change the unit
    """
    for name, value in sizes.items():
        size = 0.0 if value is None else math.hypot(value.real, value.imag)
        if size != 0.0 and not SMALLEST <= size <= LARGEST:
            raise error(f"{name} = {size:g} of {owner} is not between {SMALLEST:g} and {LARGEST:g}; change the unit")


def check_fields(
    owner: object,
    names: Iterable[str],
    error: type[GraphsynthError] = GeometryError,
    *,
    small: Iterable[str] = (),
) -> None:
    """Apply `check_sizes` to attributes of a dataclass.

    Parameters
    ----------
    owner : dataclass
    names : iterable of str
        Attributes that set a scale: from 1e-60 to 1e60, or zero.
    error : type
        Exception of the caller's room.
    small : iterable of str
        Attributes that may be as near to zero as they like: offsets, speeds, loads.

    Raises
    ------
    GeometryError or ``error``
        A size out of its bounds.
    """
    sizes = {name: getattr(owner, name) for name in names}
    for name in small:
        value = getattr(owner, name)
        sizes[name] = None if value is None or abs(value) < 1.0 else value
    check_sizes(type(owner).__name__, sizes, error)


def check_largest(largest: float, what: str = "dimension") -> None:
    """Refuse a mechanism whose largest dimension is beyond 1e60, or below 1e-60 but not zero.

    Smaller dimensions of the same mechanism may be as small as they like.

    Raises
    ------
    GeometryError
        Which dimension it is, and its bounds.

    Examples
    --------
    >>> check_largest(2.5), check_largest(0.0)
    (None, None)
    """
    if largest != 0.0 and not SMALLEST <= largest <= LARGEST:
        raise GeometryError(
            f"the largest {what} is {largest:.3g}, not between {SMALLEST:g} and {LARGEST:g}; change the unit"
        )
