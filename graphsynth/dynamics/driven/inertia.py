"""Effective inertia of a mechanism of one freedom as a sum of squares of trigonometric polynomials."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from graphsynth.core.checks import finite_array, not_negative
from graphsynth.core.errors import SpecError

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class EffectiveInertia:
    """Effective inertia ``J(q) = sum_i v_i(q)^2`` at the crank, each ``v_i`` a trigonometric polynomial.

    ``v_i`` is a velocity per crank speed times the square root of a mass; the constant inertia of rotor and wheels is
    not part of it (theory/motor-drive 2).

    Parameters
    ----------
    rows : array_like, shape (k, 2 H + 1)
        Coefficients ``a0, a1, b1, ..., aH, bH`` of ``a0 + sum a_n cos(n q) + b_n sin(n q)``; sqrt(kg) m.
    dead_centres : tuple of float
        Angles in (-pi, pi] at which all v_i vanish.
    truncation : float
        Largest neglected part relative to the largest value; 0 if exact.

    Raises
    ------
    SpecError
        Rows with an even number of columns, or not finite.

    Examples
    --------
    >>> inertia = EffectiveInertia.of_slider(mass=2.0, amplitude=0.05)
    >>> round(float(inertia.value(0.0)), 15), [round(q, 6) for q in inertia.dead_centres]
    (0.005, [-1.570796, 1.570796])
    """

    rows: Array
    dead_centres: tuple[float, ...] = ()
    truncation: float = 0.0

    def __post_init__(self) -> None:
        rows = np.array(finite_array("rows", self.rows, SpecError), ndmin=2)
        if rows.ndim != 2 or rows.shape[1] % 2 == 0:
            raise SpecError(f"rows of shape {rows.shape} must have an odd number of columns; give a0, a1, b1, ...")
        rows.setflags(write=False)
        object.__setattr__(self, "rows", rows)

    @classmethod
    def of_slider(cls, mass: float, amplitude: float) -> EffectiveInertia:
        """Platform moving as ``y = amplitude * sin q``, the model of the source: ``m L^2 cos(q)^2``.

        Raises
        ------
        SpecError
            Negative mass or amplitude.
        """
        reach = math.sqrt(not_negative("mass", mass, SpecError)) * not_negative("amplitude", amplitude, SpecError)
        dead = (-math.pi / 2, math.pi / 2) if reach else ()
        return cls(np.array([[0.0, reach, 0.0]]), dead)

    @classmethod
    def of_samples(cls, velocities: ArrayLike, *, tolerance: float = 1e-13) -> EffectiveInertia:
        """Series of velocities (k, N) sampled at ``2 pi j / N``, each times the square root of its mass.

        Raises
        ------
        SpecError
            If N samples do not resolve the velocities to ``tolerance`` (relative to the largest).
        """
        values = np.atleast_2d(finite_array("velocities", velocities, SpecError))
        rows, tail = _series(values)
        if not tail <= tolerance:
            raise SpecError(
                f"{values.shape[1]} samples leave a relative error of {tail:.1e} above {tolerance:g}; give more samples"
            )
        return cls(rows, _common_zeros(rows), tail)

    def components(self, q: ArrayLike) -> tuple[Array, Array]:
        """Return the ``v_i`` and their derivatives at angles q (...), each of shape (k, ...)."""
        angle = finite_array("q", q, nan=True)
        order = np.arange(1, self.rows.shape[1] // 2 + 1)
        phase = np.multiply.outer(order, angle)
        c, s = np.cos(phase), np.sin(phase)
        a, b = self.rows[:, 1::2], self.rows[:, 2::2]
        constant = self.rows[:, 0].reshape(-1, *[1] * angle.ndim)
        value = constant + np.tensordot(a, c, 1) + np.tensordot(b, s, 1)
        slope = np.tensordot(b * order, c, 1) - np.tensordot(a * order, s, 1)
        return np.asarray(value), np.asarray(slope)

    def value(self, q: ArrayLike) -> Array:
        """J at angles q (radians, any shape), kg m^2."""
        return np.asarray((self.components(q)[0] ** 2).sum(axis=0))

    def derivative(self, q: ArrayLike) -> Array:
        """dJ/dq at angles q, kg m^2/rad."""
        value, slope = self.components(q)
        return np.asarray(2.0 * (value * slope).sum(axis=0))

    def range(self) -> tuple[float, float, float]:
        """Least, largest and mean value over a turn; the extremes from 2048 samples by bisection of the derivative."""
        q = np.linspace(0.0, math.tau, 2048, endpoint=False)
        values = self.value(q)
        mean = float((self.rows[:, 0] ** 2).sum() + 0.5 * (self.rows[:, 1:] ** 2).sum())
        step = math.tau / q.size
        found = []
        for sign in (1.0, -1.0):
            at = float(q[np.argmin(sign * values)])
            low, high = at - step, at + step
            for _ in range(50):
                middle = 0.5 * (low + high)
                low, high = (middle, high) if sign * self.derivative(middle) < 0.0 else (low, middle)
            found.append(sign * float(min(sign * self.value(at), sign * self.value(low))))
        return 0.0 if self.dead_centres else found[0], found[1], mean


def _series(values: Array) -> tuple[Array, float]:
    """Trigonometric coefficients of sampled periodic rows, cut where they vanish, and the relative tail."""
    count = values.shape[1]
    spectrum = np.fft.rfft(values, axis=1) / count
    size = np.abs(spectrum)
    largest = max(float(size.max()), 1e-300)
    half = spectrum.shape[1] // 2
    tail = float(size[:, half:].max()) / largest if spectrum.shape[1] > 2 else 1.0
    needed = np.nonzero((size > 1e-17 * largest).any(axis=0))[0]
    significant = np.nonzero((size > 3e-16 * largest).any(axis=0))[0]
    top = int(min(needed[-1], significant[-1], half)) if needed.size else 0
    rows = np.zeros((values.shape[0], 2 * top + 1))
    rows[:, 0] = spectrum[:, 0].real
    rows[:, 1::2] = 2.0 * spectrum[:, 1 : top + 1].real
    rows[:, 2::2] = -2.0 * spectrum[:, 1 : top + 1].imag
    return rows, tail


def _common_zeros(rows: Array) -> tuple[float, ...]:
    """Angles in (-pi, pi] where all rows vanish: minima of the sum of squares, polished by Gauss and Newton."""
    inertia = EffectiveInertia(rows)
    q = np.linspace(-math.pi, math.pi, 4096, endpoint=False)
    values = inertia.value(q)
    scale = float(values.max())
    if scale == 0.0:
        return ()
    zeros = []
    for i in np.nonzero((values <= np.roll(values, 1)) & (values < np.roll(values, -1)))[0]:
        at = float(q[i])
        for _ in range(40):
            value, slope = inertia.components(at)
            square = float(slope @ slope)
            if square == 0.0:
                break
            step = float(value @ slope) / square
            at -= step
            if abs(step) < 1e-16:
                break
        if float(inertia.value(at)) <= 1e-22 * scale:
            zeros.append(math.remainder(at, math.tau))
    return tuple(sorted(zeros))
