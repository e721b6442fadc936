"""Motion laws of drivers in balls: the coordinate at an input and its rate over an interval of inputs."""

from __future__ import annotations

from fractions import Fraction

import numpy as np
from numpy.typing import NDArray

from graphsynth.intervals.balls import Balls, exact, unit
from graphsynth.mechanism.laws import Harmonic, Law, Linear, Polynomial

__all__ = ["enclosed", "law_rate", "law_value", "whole_periods"]

Array = NDArray[np.float64]


def enclosed(law: Law) -> bool:
    """Whether the law can be followed between inputs: its rate over an interval is enclosed."""
    return isinstance(law, Linear | Harmonic | Polynomial)


def law_value(law: Law, u: Balls) -> Balls:
    """Coordinate over the inputs; of any other law the number that the law returns at the midpoint, taken as exact."""
    if isinstance(law, Linear):
        return exact(law.offset) + exact(law.rate) * u
    if isinstance(law, Harmonic):
        wave = unit(exact(law.order) * u + exact(law.phase)).imag
        return exact(law.mean) + exact(law.amplitude) * wave
    if isinstance(law, Polynomial):
        return _horner(law.coefficients, u)
    value = np.asarray(law(u.mid)[0], dtype=np.float64)
    return Balls(value, np.where(u.rad > 0.0, np.inf, 0.0))


def law_rate(law: Law, u: Balls) -> Balls:
    """Return the derivative of the coordinate over the inputs; of infinite radius if the law is not `enclosed`."""
    if isinstance(law, Linear):
        return exact(np.full(u.mid.shape, law.rate))
    if isinstance(law, Harmonic):
        wave = unit(exact(law.order) * u + exact(law.phase)).real
        return exact(law.order) * exact(law.amplitude) * wave
    if isinstance(law, Polynomial):
        slopes = [exact(float(k)) * exact(c) for k, c in enumerate(law.coefficients)][1:]
        total = exact(np.zeros(u.mid.shape))
        for slope in reversed(slopes):
            total = total * u + slope
        return total
    value = np.asarray(law(u.mid)[1], dtype=np.float64)
    return Balls(value, np.where(u.rad > 0.0, np.inf, 0.0))


def _horner(coefficients: tuple[float, ...], u: Balls) -> Balls:
    total = exact(np.zeros(u.mid.shape))
    for c in reversed(coefficients):
        total = total * u + exact(c)
    return total


def whole_periods(law: Law, turns: Fraction, slides: bool) -> int | None:
    """Return the turns of the coordinate while the input grows by ``2 pi turns``; None if it does not return."""
    if isinstance(law, Linear):
        made = Fraction(law.rate) * turns
    elif isinstance(law, Harmonic):
        return 0 if (Fraction(law.order) * turns).denominator == 1 else None
    elif isinstance(law, Polynomial) and not any(law.coefficients[2:]):
        made = Fraction(law.coefficients[1] if len(law.coefficients) > 1 else 0.0) * turns
    else:
        return None
    if slides and made != 0:
        return None
    return int(made) if made.denominator == 1 else None
