"""Drivers and their motion laws: joint coordinate q as a function of the input u, with two derivatives.

A law is called with an array of inputs and returns ``(q, dq/du, d2q/du2)`` of the same shape; any callable that does
so is a law, but only the classes here can be written to a file.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from graphsynth.core.checks import finite, link_number
from graphsynth.core.errors import GeometryError

__all__ = ["LAWS", "Driver", "Harmonic", "Law", "Linear", "Polynomial", "Table"]

Array = NDArray[np.float64]
Law = Callable[[Array], tuple[Array, Array, Array]]  #: Input u to coordinate q and its two derivatives by u.
#: Sine or cosine of an arithmetic.
Function = Callable[[Any], Any]


@dataclass(frozen=True)
class Linear:
    """``q = offset + rate u``: the input itself by default.

    >>> import numpy as np
    >>> [float(v[0]) for v in Linear(rate=2.0)(np.array([0.5]))]
    [1.0, 2.0, 0.0]
    """

    rate: float = 1.0
    offset: float = 0.0
    kind: ClassVar[str] = "linear"

    def __post_init__(self) -> None:
        for name in ("rate", "offset"):
            object.__setattr__(self, name, finite(name, getattr(self, name)))

    def __call__(self, u: ArrayLike) -> tuple[Array, Array, Array]:
        """Coordinate and derivatives."""
        u = _inputs(u)
        return self.offset + self.rate * u, np.full_like(u, self.rate), np.zeros_like(u)

    def at(self, u: Any, sin: Function, cos: Function) -> tuple[Any, Any]:
        """Coordinate and rate in any arithmetic with its sine and cosine."""
        return u * self.rate + self.offset, u * 0.0 + self.rate

    def times(self, factor: float) -> Linear:
        """Return the law with all coordinates multiplied, inputs as they are.

        >>> Linear(2.0, 1.0).times(3.0)
        Linear(rate=6.0, offset=3.0)
        """
        return Linear(self.rate * factor, self.offset * factor)


@dataclass(frozen=True)
class Harmonic:
    """``q = mean + amplitude sin(order u + phase)``."""

    mean: float = 0.0
    amplitude: float = 1.0
    order: float = 1.0
    phase: float = 0.0
    kind: ClassVar[str] = "harmonic"

    def __post_init__(self) -> None:
        for name in ("mean", "amplitude", "order", "phase"):
            object.__setattr__(self, name, finite(name, getattr(self, name)))

    def __call__(self, u: ArrayLike) -> tuple[Array, Array, Array]:
        """Coordinate and derivatives."""
        u = _inputs(u)
        angle = self.order * u + self.phase
        wave = self.amplitude * np.sin(angle)
        return self.mean + wave, self.order * self.amplitude * np.cos(angle), -(self.order**2) * wave

    def at(self, u: Any, sin: Function, cos: Function) -> tuple[Any, Any]:
        """Coordinate and rate in any arithmetic with its sine and cosine."""
        angle = u * self.order + self.phase
        return sin(angle) * self.amplitude + self.mean, cos(angle) * self.amplitude * self.order

    def times(self, factor: float) -> Harmonic:
        """Return the law with all coordinates multiplied."""
        return Harmonic(self.mean * factor, self.amplitude * factor, self.order, self.phase)


@dataclass(frozen=True)
class Polynomial:
    """``q = c0 + c1 u + c2 u^2 + ...``, coefficients ascending."""

    coefficients: tuple[float, ...] = (0.0, 1.0)
    kind: ClassVar[str] = "polynomial"

    def __post_init__(self) -> None:
        object.__setattr__(self, "coefficients", _numbers("coefficients", self.coefficients, 1))

    def __call__(self, u: ArrayLike) -> tuple[Array, Array, Array]:
        """Coordinate and derivatives."""
        u, p = _inputs(u), np.polynomial.Polynomial(self.coefficients)
        first, second = p.deriv(1), p.deriv(2)
        return np.asarray(p(u)), np.asarray(first(u)) + 0.0 * u, np.asarray(second(u)) + 0.0 * u

    def at(self, u: Any, sin: Function, cos: Function) -> tuple[Any, Any]:
        """Coordinate and rate in any arithmetic, by Horner's scheme."""
        value, rate = u * 0.0, u * 0.0
        for c in reversed(self.coefficients):
            value, rate = value * u + c, rate * u + value
        return value, rate

    def times(self, factor: float) -> Polynomial:
        """Return the law with all coordinates multiplied."""
        return Polynomial(tuple(c * factor for c in self.coefficients))


@dataclass(frozen=True)
class Table:
    """Values at increasing inputs, joined by a cubic spline (natural ends); NaN outside the table.

    `GeometryError` for fewer than two inputs, inputs that do not increase, lists of different lengths.
    """

    inputs: tuple[float, ...]
    values: tuple[float, ...]
    kind: ClassVar[str] = "table"

    def __post_init__(self) -> None:
        object.__setattr__(self, "inputs", _numbers("inputs", self.inputs, 2))
        object.__setattr__(self, "values", _numbers("values", self.values, 2))
        if len(self.inputs) != len(self.values):
            raise GeometryError(f"the table has {len(self.inputs)} inputs and {len(self.values)} values; give as many")
        if any(b <= a for a, b in zip(self.inputs, self.inputs[1:])):
            raise GeometryError("the inputs of a table must increase; sort them and remove duplicates")

    @cached_property
    def _spline(self) -> Any:
        from scipy.interpolate import CubicSpline

        return CubicSpline(self.inputs, self.values, bc_type="natural", extrapolate=False)

    def __call__(self, u: ArrayLike) -> tuple[Array, Array, Array]:
        """Coordinate and derivatives."""
        u = _inputs(u)
        return (np.asarray(self._spline(u)), np.asarray(self._spline(u, 1)), np.asarray(self._spline(u, 2)))

    def times(self, factor: float) -> Table:
        """Return the law with all coordinates multiplied."""
        return Table(self.inputs, tuple(value * factor for value in self.values))


def _inputs(u: ArrayLike) -> Array:
    """Return inputs as floats, NaN among them."""
    try:
        return np.asarray(u, dtype=np.float64)
    except (TypeError, ValueError, OverflowError) as error:
        raise GeometryError(f"the input {str(u)[:60]} of a law is no number ({error}); give numbers") from error


def _numbers(name: str, values: Any, least: int) -> tuple[float, ...]:
    try:
        found = tuple(finite(f"{name}[{index}]", value) for index, value in enumerate(values))
    except TypeError as error:
        raise GeometryError(f"{name} = {values!r} is not a list of numbers; give one") from error
    if len(found) < least:
        raise GeometryError(f"{name} has {len(found)} entries; give {least} or more")
    return found


#: Classes of laws by the kind that files name.
LAWS: dict[str, Any] = {law.kind: law for law in (Linear, Harmonic, Polynomial, Table)}


@dataclass(frozen=True)
class Driver:
    """A joint whose relative coordinate is prescribed.

    Parameters
    ----------
    base, link : int
        The two links of the joint; the coordinate is that of ``link`` relative to ``base``: the angle
        ``theta_link - theta_base`` of a revolute joint, the displacement along the line of a prismatic joint.
    law : Law
        Coordinate as a function of the input; the input itself by default.
    """

    base: int
    link: int
    law: Law = field(default_factory=Linear)

    def __post_init__(self) -> None:
        object.__setattr__(self, "base", link_number("base of a driver", self.base))
        object.__setattr__(self, "link", link_number("link of a driver", self.link))
        if not callable(self.law):
            raise GeometryError(f"law = {self.law!r} of driver {self.base}-{self.link} is not callable; give a law")

    @property
    def pair(self) -> tuple[int, int]:
        """The two links, ascending."""
        return min(self.base, self.link), max(self.base, self.link)
