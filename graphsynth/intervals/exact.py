"""Exact numbers: what is given as a rational number, and rational numbers as balls of python-flint."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from decimal import Decimal
from fractions import Fraction
from typing import Any

import flint
import numpy as np

from graphsynth.core.errors import FormatError, GeometryError
from graphsynth.intervals.reading import fraction


@contextmanager
def precision(bits: int) -> Iterator[None]:
    """Work with python-flint's balls of ``bits`` binary digits inside the block, whatever the caller has set."""
    before = flint.ctx.prec
    flint.ctx.prec = bits
    try:
        yield
    finally:
        flint.ctx.prec = before


@dataclass(frozen=True)
class Gaussian:
    """A complex number with rational parts; exact arithmetic."""

    real: Fraction
    imag: Fraction

    def __add__(self, other: Gaussian) -> Gaussian:
        return Gaussian(self.real + other.real, self.imag + other.imag)

    def __sub__(self, other: Gaussian) -> Gaussian:
        return Gaussian(self.real - other.real, self.imag - other.imag)

    def __neg__(self) -> Gaussian:
        return Gaussian(-self.real, -self.imag)

    def __mul__(self, other: Gaussian | Fraction | int) -> Gaussian:
        if isinstance(other, Gaussian):
            a, b, c, d = self.real, self.imag, other.real, other.imag
            return Gaussian(a * c - b * d, a * d + b * c)
        return Gaussian(self.real * other, self.imag * other)

    __rmul__ = __mul__

    @property
    def conj(self) -> Gaussian:
        """Complex conjugate."""
        return Gaussian(self.real, -self.imag)


def rational(name: str, value: Any) -> Fraction:
    """Return the exact value of an int, float, Fraction, Decimal, or text such as "0.1" or "1/3".

    Raises
    ------
    GeometryError
        For anything that is not a finite rational number.

    Examples
    --------
    >>> rational("l", "0.1"), rational("l", 0.5)
    (Fraction(1, 10), Fraction(1, 2))
    """
    try:
        if isinstance(value, str):
            return fraction(value)
        if isinstance(value, float | int | Fraction | Decimal):
            return Fraction(value)
        if isinstance(value, np.floating | np.integer):
            return Fraction(value.item())
    except (FormatError, ValueError, OverflowError):
        pass
    raise GeometryError(f"{name} = {value!r} is not a finite number; give an int, float, Fraction or decimal text")


def gaussian(name: str, value: Any) -> Gaussian:
    """Return the exact value of a complex number, or of a pair (x, y) of anything that `rational` takes."""
    if isinstance(value, complex | np.complexfloating):
        return Gaussian(rational(f"x of {name}", float(value.real)), rational(f"y of {name}", float(value.imag)))
    if isinstance(value, tuple | list | np.ndarray):
        if len(value) != 2:
            raise GeometryError(f"{name} = {value!r} is not a point; give a complex number or a pair (x, y)")
        return Gaussian(rational(f"x of {name}", value[0]), rational(f"y of {name}", value[1]))
    return Gaussian(rational(name, value), Fraction(0))


def ball(value: Any) -> Any:
    """Enclose a rational number in an ``arb`` at the precision set; an ``arb`` stays as it is."""
    if not isinstance(value, Fraction):
        return flint.arb(value)
    return flint.arb(flint.fmpq(value.numerator, value.denominator))


def complex_ball(value: Any) -> Any:
    """Enclose a complex number in an ``acb`` at the precision set; an ``acb`` stays as it is."""
    if not isinstance(value, Gaussian):
        return flint.acb(value)
    return flint.acb(ball(value.real), ball(value.imag))
