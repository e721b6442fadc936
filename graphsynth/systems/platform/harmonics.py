"""Harmonic analysis of a periodic motion sampled over one turn."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from graphsynth.core.checks import checked, finite_array, positive
from graphsynth.core.errors import GeometryError

__all__ = ["Harmonics", "harmonics"]

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Harmonics:
    """Harmonics ``X(psi) = mean + Re sum_m amplitudes[m - 1] exp(i m psi)`` of every coordinate.

    Attributes
    ----------
    mean : ndarray, shape (d,)
    amplitudes : ndarray of complex, shape (M, d)
        ``c_m = (2/N) sum X exp(-i m psi)`` for m = 1 to M, M below N/2.
    tail : ndarray, shape (d,)
        Largest magnitude among the last quarter of the harmonics: an estimate of the truncation error.
    """

    mean: Array
    amplitudes: NDArray[np.complex128]
    tail: Array

    def order(self, m: int) -> NDArray[np.complex128]:
        """Amplitudes of harmonic m (from 1), shape (d,).

        Raises
        ------
        GeometryError
            A harmonic that the samples do not resolve.
        """
        if not 1 <= m <= len(self.amplitudes):
            raise GeometryError(f"harmonic {m} is not resolved; choose 1 to {len(self.amplitudes)} or more samples")
        return np.asarray(self.amplitudes[m - 1])

    def distortion(self) -> Array:
        """Root of the summed squares of all harmonics above the first over the first, for every coordinate.

        Infinite where the first harmonic vanishes but others do not, NaN where all vanish.
        """
        size = np.abs(self.amplitudes)
        with np.errstate(divide="ignore", invalid="ignore"):
            return np.asarray(np.sqrt((size[1:] ** 2).sum(axis=0)) / size[0])

    def total_distortion(self, Lc: float) -> float:
        """Return the distortion of the whole pose (x, y, alpha), angles multiplied by ``Lc``.

        Raises
        ------
        GeometryError
            Harmonics of something that is no pose.
        """
        weight = np.array([1.0, 1.0, positive("Lc", Lc)])
        if self.mean.shape != (3,):
            raise GeometryError(f"a pose has three coordinates, not {self.mean.size}; use distortion()")
        size = np.abs(self.amplitudes * weight) ** 2
        with np.errstate(divide="ignore", invalid="ignore"):
            return float(np.sqrt(size[1:].sum() / size[0].sum()))


@checked
def harmonics(samples: ArrayLike) -> Harmonics:
    """Analyse samples at ``psi = 2 pi j / N``, j = 0 to N - 1 (the end of the turn left out).

    Parameters
    ----------
    samples : array_like, shape (N,) or (N, d)
        N at least 4.

    Returns
    -------
    Harmonics
        Exact for trigonometric polynomials of degree below N/2; for analytic motions the error falls faster than any
        power of N.

    Raises
    ------
    GeometryError
        Fewer than 4 samples, or samples that are not finite.

    Examples
    --------
    >>> import numpy as np
    >>> psi = 2.0 * np.pi * np.arange(16) / 16
    >>> found = harmonics(1.0 + 2.0 * np.cos(psi) + 0.1 * np.sin(2 * psi))
    >>> round(float(found.mean[0]), 12), round(float(found.distortion()[0]), 12)
    (1.0, 0.05)
    """
    values = finite_array("samples", samples)
    values = values[:, None] if values.ndim == 1 else values
    if values.ndim != 2 or len(values) < 4:
        raise GeometryError(f"samples have shape {values.shape}; give (N,) or (N, d) with N of 4 or more")
    count = len(values)
    spectrum = np.fft.rfft(values, axis=0) / count
    top = (count - 1) // 2
    amplitudes = 2.0 * spectrum[1 : top + 1]
    tail = np.abs(amplitudes[-max(1, top // 4) :]).max(axis=0)
    return Harmonics(spectrum[0].real.copy(), amplitudes, tail)
