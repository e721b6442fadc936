"""Checks of the numbers that a mechanism is described by: whatever comes in, only `GeometryError` goes out."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from graphsynth.core.arguments import checker
from graphsynth.core.errors import GeometryError, GraphsynthError
from graphsynth.core.wording import index_of, shown

#: Lets a function keep what its annotations say; a `GeometryError` names the argument that is something else.
checked = checker(GeometryError, {"Condition": "str"})

Point = tuple[float, float]
Size = float | complex | None

#: Sizes from SMALLEST to LARGEST are taken, in whatever unit: products of four lengths are then numbers.
SMALLEST, LARGEST = 1e-60, 1e60


def finite(name: str, value: Any, error: type[GraphsynthError] = GeometryError) -> float:
    """Return ``value`` as a float; raise the error if it is not a finite real number."""
    if isinstance(value, bool | str | bytes):
        raise error(f"{name} = {value!r} is not a real number; give a finite one")
    try:
        number = float(value)
    except OverflowError as cause:  # an integer of any length: its digits help nobody
        raise error(f"{name} is beyond the largest float, 1.8e308; give a finite number") from cause
    except (TypeError, ValueError) as cause:
        raise error(f"{name} = {value!r} is not a real number; give a finite one") from cause
    if not math.isfinite(number):
        raise error(f"{name} = {number} is not finite; give a finite number")
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
    number = None if isinstance(value, bool) else index_of(value)
    if number is None or number < 0:
        raise GeometryError(f"{name} = {value!r} is not a link; give its number, 0 or more")
    return number


def positive(name: str, value: Any, error: type[GraphsynthError] = GeometryError) -> float:
    """Return ``value`` as a float; raise the error unless it is positive."""
    if (number := finite(name, value, error)) <= 0.0:
        raise error(f"{name} = {number} must be positive; correct the value")
    return number


def not_negative(name: str, value: Any, error: type[GraphsynthError] = GeometryError) -> float:
    """Return ``value`` as a float; raise the error unless it is positive or zero."""
    if (number := finite(name, value, error)) < 0.0:
        raise error(f"{name} = {number} must be zero or more; correct the value")
    return number


def sign(name: str, value: Any) -> int:
    """Return +1 or -1; raise `GeometryError` for anything else."""
    if not isinstance(value, int | float | np.number) or value not in (1, -1):
        raise GeometryError(f"{name} = {value!r} must be +1 or -1 (the assembly branch)")
    return int(value)


def choice(name: str, value: Any, allowed: tuple[str, ...]) -> str:
    """Return ``value`` if it is one of ``allowed``; raise `GeometryError` otherwise."""
    if not isinstance(value, str) or value not in allowed:
        raise GeometryError(f"{name} = {value!r} is unknown; use one of {', '.join(map(repr, allowed))}")
    return str(value)


def unit_vector(name: str, value: Any) -> tuple[float, float, float]:
    """Return the normalised 3-vector; raise `GeometryError` for a zero, infinite or misshapen one."""
    try:
        parts = [finite(f"{name}[{index}]", part) for index, part in enumerate(value)]
    except TypeError as error:
        raise GeometryError(f"{name} = {value!r} is not a vector; give three numbers") from error
    if len(parts) != 3:
        raise GeometryError(f"{name} has {len(parts)} components; give three")
    largest = max(map(abs, parts))
    if largest == 0.0:
        raise GeometryError(f"{name} = {tuple(parts)} has no direction; give a vector that is not zero")
    parts = [part / largest for part in parts]  # no overflow or underflow in the norm
    norm = math.hypot(*parts)
    return (parts[0] / norm, parts[1] / norm, parts[2] / norm)


def finite_array(
    name: str, values: ArrayLike, error: type[GraphsynthError] = GeometryError, *, nan: bool = False
) -> NDArray[np.float64]:
    """Return ``values`` as a float array; raise the error if an entry is NaN or infinite (unless ``nan``)."""
    try:
        given = np.asarray(values)
        if given.dtype.kind in "cSU":
            kind = "complex numbers" if given.dtype.kind == "c" else "text"
            raise error(f"{name} holds {kind}; give real numbers")
        if given.dtype.kind == "O" and any(part is None for part in given.flat):
            raise error(f"{name} holds None; give real numbers")
        array = given.astype(np.float64, copy=False)
    except GraphsynthError:
        raise
    except (TypeError, ValueError, OverflowError) as cause:
        raise error(f"{name} is not an array of real numbers: {cause}") from cause
    bad = np.flatnonzero(~np.isfinite(array)) if not nan else np.empty(0)
    if bad.size:
        raise error(f"{name} holds {array.flat[bad[0]]} at flat position {bad[0]}; give finite numbers only")
    return array


def three(name: str, values: Any) -> tuple[Any, Any, Any]:
    """Return three entries, one per leg; raise `GeometryError` for another number of them or none."""
    try:
        found = tuple(values)
    except TypeError as error:
        raise GeometryError(f"{name} = {values!r} is not a sequence; give three entries, one per leg") from error
    if len(found) != 3:
        raise GeometryError(f"{name} has {len(found)} entries; give three, one per leg")
    return found


def three_points(name: str, values: Any) -> tuple[complex, complex, complex]:
    """Return three points as complex numbers; raise `GeometryError` for anything else, naming the leg."""
    first, second, third = (plane_point(f"{name} of leg {k}", v) for k, v in enumerate(three(name, values), start=1))
    return first, second, third


def plane_point(name: str, value: Any) -> complex:
    """Return a point of the plane as a complex number; raise `GeometryError` unless it is a finite one."""
    try:
        found = complex(value) if not isinstance(value, str | bytes) else complex(math.nan)
    except (TypeError, ValueError, OverflowError):
        found = complex(math.nan)
    if not (math.isfinite(found.real) and math.isfinite(found.imag)):
        raise GeometryError(f"{name} is {value!r}; give a finite point x + 1j * y")
    return found


def whole(
    name: str, value: Any, least: int, most: int = 10_000_000, error: type[GraphsynthError] = GeometryError
) -> int:
    """Return a whole number between the bounds; raise the error for anything else."""
    number = None if isinstance(value, bool) else index_of(value)
    if number is None or not least <= number <= most:
        raise error(f"{name} = {shown(value)} must be a whole number from {least} to {most}")
    return number


def triple(name: str, values: ArrayLike) -> NDArray[np.float64]:
    """Return three finite numbers, shape (3,); raise `GeometryError` for anything else."""
    array = finite_array(name, values)
    if array.shape != (3,):
        raise GeometryError(f"{name} has shape {array.shape}; give three numbers")
    return array


def triples(name: str, values: ArrayLike, *, nan: bool = False) -> NDArray[np.float64]:
    """Return finite numbers (or any, if ``nan``) of shape (..., 3); raise `GeometryError` for anything else."""
    array = finite_array(name, values, nan=nan)
    if array.shape[-1:] != (3,):
        raise GeometryError(f"{name} has shape {array.shape}; its last axis must hold three numbers")
    return array


def together(**given: ArrayLike) -> list[NDArray[np.float64]]:
    """Return arrays whose last axis holds three numbers (NaN stays NaN) and whose others broadcast.

    >>> [array.shape for array in together(pose=[0, 0, 0], theta=np.zeros((5, 3)))]
    [(3,), (5, 3)]
    """
    arrays = [triples(name, values, nan=True) for name, values in given.items()]
    try:
        np.broadcast_shapes(*(array.shape for array in arrays))
    except ValueError as error:
        shapes = ", ".join(f"{name} {array.shape}" for name, array in zip(given, arrays))
        raise GeometryError(f"the shapes do not fit each other: {shapes}; give as many of each, or one") from error
    return arrays


def check_sizes(owner: str, sizes: Mapping[str, Size], error: type[GraphsynthError] = GeometryError) -> None:
    """Refuse sizes (of complex ones the magnitude) beyond 1e60 or between 0 and 1e-60: of what, by their names.

    Their products would leave the range of double precision; zero and None are left to other checks.

    >>> check_sizes("the lever", {"length": 1e-70})
    Traceback (most recent call last):
        ...
    graphsynth.core.errors.GeometryError: length = 1e-70 of the lever is not between 1e-60 and 1e+60; change the unit
    """
    for name, value in sizes.items():
        size = 0.0 if value is None else math.hypot(value.real, value.imag)
        if size != 0.0 and not SMALLEST <= size <= LARGEST:
            raise error(f"{name} = {size:g} of {owner} is not between {SMALLEST:g} and {LARGEST:g}; change the unit")


def check_fields(
    owner: object, names: Iterable[str], error: type[GraphsynthError] = GeometryError, *, small: Iterable[str] = ()
) -> None:
    """Apply `check_sizes` to attributes of a dataclass that set a scale.

    Those in ``small``, such as offsets, speeds and loads, may be as near to zero as they like.
    """
    sizes = {name: getattr(owner, name) for name in names}
    for name in small:
        value = getattr(owner, name)
        sizes[name] = None if value is None or abs(value) < 1.0 else value
    check_sizes(type(owner).__name__, sizes, error)


def check_largest(largest: float, what: str = "dimension") -> None:
    """Refuse a mechanism whose largest dimension is beyond 1e60, or below 1e-60 but not zero.

    Smaller dimensions of the same mechanism may be as small as they like.
    """
    if largest != 0.0 and not SMALLEST <= largest <= LARGEST:
        raise GeometryError(
            f"the largest {what} is {largest:.3g}, not between {SMALLEST:g} and {LARGEST:g}; change the unit"
        )
