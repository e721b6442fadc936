"""Angles as users write them: radians as numbers, anything else with its unit."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Sequence
from typing import Any, Generic, Self, TypeVar, overload

import numpy as np
from numpy.typing import ArrayLike, NDArray

from graphsynth.core.checks import finite, finite_array
from graphsynth.core.errors import GeometryError

G = TypeVar("G")  # as it may be given
K = TypeVar("K")  # as it is kept
#: Radians of a unit.
_UNITS = {"rad": 1.0, "deg": math.pi / 180.0, "°": math.pi / 180.0, "turn": math.tau, "turns": math.tau}
_NUMBER = r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?"
_WRITTEN = re.compile(rf"\s*({_NUMBER})(?:\s*\.\.\s*({_NUMBER}))?\s*([a-z°]+)\s*")
#: Samples of a range written with two dots.
_SAMPLES = 361


@overload
def degrees(values: float) -> float: ...
@overload
def degrees(values: ArrayLike) -> NDArray[np.float64]: ...
def degrees(values: ArrayLike) -> float | NDArray[np.float64]:
    """Return angles given in degrees as the radians that every function takes.

    Parameters
    ----------
    values : float or array_like
        Degrees.

    Returns
    -------
    float or ndarray
        Radians, of the same shape.

    Raises
    ------
    GeometryError
        Something that is no finite number.

    Examples
    --------
    >>> degrees(180.0), degrees([0, 90]).round(4).tolist()
    (3.141592653589793, [0.0, 1.5708])
    """
    found = np.radians(finite_array("degrees", values))
    return float(found) if found.ndim == 0 else np.asarray(found)


def angle(name: str, value: Any) -> float:
    """Return an angle in radians: a number is radians, a text has its unit; `GeometryError` for anything else.

    >>> angle("tilt", "30 deg") == degrees(30.0), angle("tilt", 0.1)
    (True, 0.1)
    """
    return float(_read(name, value)[0]) if isinstance(value, str) else finite(name, value)


def angles(name: str, values: Any) -> NDArray[np.float64]:
    """Return angles or lengths: numbers as they are, texts like "30 deg" in radians, "0..360 deg" as 361 samples.

    >>> angles("inputs", ["0 deg", "180 deg"]).tolist(), len(angles("inputs", "0..90 deg"))
    ([0.0, 3.141592653589793], 361)
    """
    if isinstance(values, str):
        return _read(name, values)
    if isinstance(values, list | tuple) and any(isinstance(value, str) for value in values):
        return np.array([angle(f"{name}[{k}]", value) for k, value in enumerate(values)])
    return finite_array(name, values)


class Kept(Generic[G, K]):
    """A field of a dataclass that may be given in other words than it is kept: type checkers see both types.

    >>> from dataclasses import dataclass
    >>> @dataclass(frozen=True)
    ... class Arm:
    ...     direction: Kept[float | str, float] = Kept(angle, "90 deg")
    >>> Arm().direction, Arm("180 deg").direction, Arm(0.5)
    (1.5707963267948966, 3.141592653589793, Arm(direction=0.5))
    """

    def __init__(self, read: Callable[[str, G], K], *default: G) -> None:
        self.read, self.default = read, default

    def __set_name__(self, owner: type, name: str) -> None:
        self.name = name

    @overload
    def __get__(self, instance: None, owner: type) -> Self: ...
    @overload
    def __get__(self, instance: object, owner: type) -> K: ...
    def __get__(self, instance: object | None, owner: type) -> Any:
        """Return the value; of the class the default, which is what a dataclass asks for."""
        if instance is not None:
            return instance.__dict__[self.name]
        if not self.default:
            raise AttributeError(self.name)
        return self.default[0]

    def __set__(self, instance: object, value: G) -> None:
        instance.__dict__[self.name] = self.read(self.name, value)


def optional(read: Callable[[str, G], K]) -> Callable[[str, G | None], K | None]:
    """Return what reads a value or keeps None."""
    return lambda name, value: None if value is None else read(name, value)


def listed(name: str, values: Sequence[float | str]) -> tuple[float, ...]:
    """Return angles or lengths as a tuple, read as `angles` does.

    >>> listed("inputs", [0, "180 deg"])
    (0.0, 3.141592653589793)
    """
    return tuple(angles(name, values if isinstance(values, str) else list(values)).tolist())


def _read(name: str, text: str) -> NDArray[np.float64]:
    found = _WRITTEN.fullmatch(text)
    if found is None or found[3] not in _UNITS:
        raise GeometryError(f'{name} = {text!r} is no angle; write a number with its unit, as in "30 deg" or "0.5 rad"')
    ends = [float(part) * _UNITS[found[3]] for part in (found[1], found[2]) if part]
    return np.linspace(ends[0], ends[1], _SAMPLES) if len(ends) == 2 else np.array(ends)
