"""Checks of numbers that describe a mechanism."""

from __future__ import annotations

import math
import operator
from typing import Any

from graphsynth.errors import GeometryError

__all__ = ["finite", "link_number", "nonzero", "point"]

Point = tuple[float, float]


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
