"""Laws of dry friction: two coefficients, Stribeck curve."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import overload

import numpy as np
from numpy.typing import ArrayLike, NDArray

from graphsynth.core.checks import check_fields
from graphsynth.core.errors import SpecError


def finite(name: str, value: float) -> float:
    """Return a number as float, or refuse it.

    Raises
    ------
    SpecError
        If it is not a finite number.

    Examples
    --------
    >>> finite("mass", 2)
    2.0
    """
    try:
        number = float(value)
    except OverflowError:
        raise SpecError(f"The {name} must be at most 1.8e308, the largest float.") from None
    except (TypeError, ValueError):
        raise SpecError(f"The {name} must be a number, not {value!r}.") from None
    if not math.isfinite(number):
        raise SpecError(f"The {name} must be finite, not {number}.")
    return number


def positive(name: str, value: float, *, or_zero: bool = False) -> float:
    """Return a number above zero as float, or refuse it.

    Raises
    ------
    SpecError
        If it is not a finite number above zero (``or_zero``: at least zero).

    Examples
    --------
    >>> positive("mass", 2)
    2.0
    """
    number = finite(name, value)
    if number < 0.0 or (number == 0.0 and not or_zero):
        raise SpecError(f"The {name} is {number:g}; it must be {'at least' if or_zero else 'greater than'} zero.")
    return number


def _coefficients(static: float, kinetic: float, viscous: float) -> tuple[float, float, float]:
    static = positive("static friction coefficient", static)
    kinetic = positive("kinetic friction coefficient", kinetic, or_zero=True)
    if kinetic > static:
        raise SpecError(
            f"The kinetic friction coefficient {kinetic:g} is above the static one, {static:g}; "
            "swap them, or give the static one at least the same value."
        )
    return static, kinetic, positive("viscous friction coefficient", viscous, or_zero=True)


class FrictionLaw(ABC):
    """Base of the laws: ``coefficient`` and ``slope`` over the sliding speed ``v >= 0``, ``static`` at rest."""

    static: float
    kinetic: float
    viscous: float

    @abstractmethod
    def _weakening(self, v: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return the part above the kinetic coefficient, and its slope."""

    @overload
    def coefficient(self, v: float) -> float: ...
    @overload
    def coefficient(self, v: NDArray[np.float64]) -> NDArray[np.float64]: ...
    def coefficient(self, v: ArrayLike) -> float | NDArray[np.float64]:
        """Friction coefficient while slipping at the speed ``v >= 0``, m/s."""
        v = np.asarray(v, float)
        found: NDArray[np.float64] = self.kinetic + self._weakening(v)[0] + self.viscous * v
        return found if found.ndim else float(found)

    @overload
    def slope(self, v: float) -> float: ...
    @overload
    def slope(self, v: NDArray[np.float64]) -> NDArray[np.float64]: ...
    def slope(self, v: ArrayLike) -> float | NDArray[np.float64]:
        """Return the derivative of the coefficient by the sliding speed, s/m; negative where friction weakens."""
        v = np.asarray(v, float)
        found: NDArray[np.float64] = self._weakening(v)[1] + self.viscous
        return found if found.ndim else float(found)

    @abstractmethod
    def _packed(self) -> tuple[float, float, float, float, float, float]:
        """Return static, kinetic, Stribeck velocity, exponent, viscous, kind: entries 4 to 9 of the kernels' data."""


@dataclass(frozen=True)
class TwoCoefficientLaw(FrictionLaw):
    """One coefficient at rest, another while slipping (Coulomb's law if they are equal).

    Parameters
    ----------
    static, kinetic : float
        Coefficients with ``0 <= kinetic <= static``, ``static > 0``.
    viscous : float
        Coefficient of a part that grows with the sliding speed, s/m.

    Raises
    ------
    SpecError
        If a coefficient is out of its bounds.

    Examples
    --------
    >>> TwoCoefficientLaw(0.4, 0.25).coefficient(0.1)
    0.25
    """

    static: float
    kinetic: float
    viscous: float = 0.0

    def __post_init__(self) -> None:
        for name, value in zip(
            ("static", "kinetic", "viscous"), _coefficients(self.static, self.kinetic, self.viscous)
        ):
            object.__setattr__(self, name, value)
        check_fields(self, ("static",), SpecError, small=("kinetic", "viscous"))

    def _weakening(self, v: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        return np.zeros_like(v), np.zeros_like(v)

    def _packed(self) -> tuple[float, float, float, float, float, float]:
        return self.static, self.kinetic, 1.0, 1.0, self.viscous, 0.0


@dataclass(frozen=True)
class StribeckLaw(FrictionLaw):
    """Friction that falls from the static to the kinetic coefficient as the sliding speed grows.

    ``mu(v) = kinetic + (static - kinetic) exp(-(v/velocity)^exponent) + viscous v``.

    Parameters
    ----------
    static, kinetic : float
        Coefficients with ``0 <= kinetic <= static``, ``static > 0``.
    velocity : float
        Stribeck velocity, m/s.
    exponent : float
        At least 1.
    viscous : float
        s/m.

    Raises
    ------
    SpecError
        If a coefficient is out of its bounds.

    Examples
    --------
    >>> StribeckLaw(0.4, 0.25, velocity=0.02).coefficient(0.0)
    0.4
    """

    static: float
    kinetic: float
    velocity: float
    exponent: float = 2.0
    viscous: float = 0.0

    def __post_init__(self) -> None:
        found = _coefficients(self.static, self.kinetic, self.viscous)
        velocity = positive("Stribeck velocity", self.velocity)
        exponent = finite("Stribeck exponent", self.exponent)
        if exponent < 1.0:
            raise SpecError(f"The Stribeck exponent is {exponent:g}; it must be at least 1.")
        for name, value in zip(("static", "kinetic", "viscous", "velocity", "exponent"), (*found, velocity, exponent)):
            object.__setattr__(self, name, value)
        check_fields(self, ("static", "velocity", "exponent"), SpecError, small=("kinetic", "viscous"))

    def _weakening(self, v: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        z, d = v / self.velocity, self.exponent
        part = (self.static - self.kinetic) * np.exp(-(z**d))
        return part, -part * d * z ** (d - 1.0) / self.velocity

    def _packed(self) -> tuple[float, float, float, float, float, float]:
        return self.static, self.kinetic, self.velocity, self.exponent, self.viscous, 1.0
