"""Curves as Fourier coefficients, and the distance of two curves whatever their place, size, direction and beginning.

Theory, with proofs of the invariances: docs/theory/curve-index.md.  The coefficients of a polygon over its arc length
are a finite sum [Kuhl & Giardina 1982]; an open curve is run through there and back.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]

#: Steps of Newton's method for the shift between two curves.
_STEPS = 6


def orders(harmonics: int) -> NDArray[np.int64]:
    """Return -harmonics .. -1, 1 .. harmonics: the order of coefficients."""
    k = np.arange(1, harmonics + 1)
    return np.concatenate([-k[::-1], k])


def coefficients(points: Complex, closed: NDArray[np.bool_], harmonics: int) -> Complex:
    """Fourier coefficients over the arc length of polygons (sets, n), in the order of `orders`; the mean is left out.

    A closed polygon ends where it begins; points may repeat, so that polygons of fewer points fit in.  A polygon of
    length 0 has coefficients 0.
    """
    sides = np.diff(points, axis=1)
    lengths = np.abs(sides)
    at = np.concatenate([np.zeros((len(points), 1)), np.cumsum(lengths, axis=1)], axis=1)
    total = at[:, -1:].copy()
    total[total == 0.0] = 1.0
    period = np.where(closed[:, None], total, 2.0 * total)
    turn = np.exp(-2j * math.pi * at / period)
    ways = np.where(lengths > 0.0, sides / np.where(lengths > 0.0, lengths, 1.0), 0.0)
    found = np.empty((len(points), 2 * harmonics), dtype=np.complex128)
    power = np.ones_like(turn)
    for k in range(1, harmonics + 1):
        power = power * turn if k > 1 else turn
        size = period[:, 0] / (2.0 * math.pi * k) ** 2
        step = np.diff(power, axis=1)
        forth, back = (ways * step).sum(axis=1), (ways * np.conj(step)).sum(axis=1)
        both = forth + back
        found[:, harmonics + k - 1] = size * np.where(closed, forth, both)
        found[:, harmonics - k] = size * np.where(closed, back, both)
    return found


def uniform(values: Complex, closed: NDArray[np.bool_], count: NDArray[np.int64], harmonics: int) -> Complex:
    """Fourier coefficients -harmonics .. harmonics of uniform samples (sets, n), of which ``count`` (sets,) count.

    The last sample of a closed row is its first; an open row is run through there and back.
    """
    steps = np.maximum(count - 1, 1)[:, None]
    j = np.arange(values.shape[1])
    weight = np.where((j == 0) | (j == steps), 0.5, 1.0) * (j <= steps) / steps
    turn = np.exp(-2j * math.pi * np.minimum(j, steps) / np.where(closed[:, None], steps, 2 * steps))
    found = np.empty((len(values), 2 * harmonics + 1), dtype=np.complex128)
    power, own = np.ones_like(turn), values * weight
    for k in range(harmonics + 1):
        forth, back = (own * power).sum(axis=1), (own * np.conj(power)).sum(axis=1)
        even = 0.5 * (forth + back)
        found[:, harmonics + k] = np.where(closed, forth, even)
        found[:, harmonics - k] = np.where(closed, back, even)
        power = power * turn
    return found


def unit(found: Complex) -> Complex:
    """Coefficients over their norm; 0 stays."""
    norm = np.linalg.norm(found, axis=-1, keepdims=True)
    return np.asarray(found / np.where(norm > 0.0, norm, 1.0))


def magnitudes(found: Complex, harmonics: int) -> Array:
    """Sizes of the coefficients of the first harmonics, of unit curves: no motion of a curve changes them.

    Running the curve backwards, or reflecting it, exchanges the sizes of k and -k.  The Euclidean distance of two
    curves' sizes is never larger than that of the curves (docs/theory/curve-index.md).
    """
    half = found.shape[-1] // 2
    return np.abs(found[..., half - harmonics : half + harmonics])


class Aligned(NamedTuple):
    """How curves fit on a wanted one: distance (sets,) of unit curves, and the motion that takes them there.

    ``factor`` (sets,) multiplies the unit curve, after reflection (conjugate) where ``reflected`` and reversal where
    ``backwards``; ``shift`` is the beginning, as part of the period.
    """

    error: Array
    factor: Complex
    shift: Array
    reflected: NDArray[np.bool_]
    backwards: NDArray[np.bool_]


def variant(found: Complex, reflected: bool, backwards: bool) -> Complex:
    """Coefficients of the curve reflected in the x axis, and run backwards."""
    if reflected != backwards:
        found = found[..., ::-1]
    return np.conj(found) if reflected else found


def aligned(wanted: Complex, found: Complex, closed: bool, fine: bool = False) -> Aligned:
    """Fit unit curves (sets, 2 harmonics) on a wanted unit curve by rotation, size, beginning, sense and reflection.

    The distance is ``sqrt(1 - rho^2)`` with rho the largest size of the correlation; ``fine`` improves the shift by
    Newton's method.
    """
    half = wanted.shape[-1] // 2
    k = orders(half)
    grid = 4 * 2 ** math.ceil(math.log2(half + 1)) if closed else 2
    best: Aligned | None = None
    for reflected in (False, True):
        for backwards in (False, True):
            if backwards and not closed:  # an open curve backwards begins at its other end: a shift by half a period
                continue
            products = np.conj(variant(found, reflected, backwards)) * wanted
            if closed:
                spread = np.zeros((len(products), grid), dtype=products.dtype)
                spread[:, k % grid] = products
                rho = np.abs(np.fft.fft(spread, axis=1)) ** 2
            else:
                rho = np.abs(np.stack([products.sum(axis=1), products @ (-1.0) ** k], axis=1)) ** 2
            peak = rho.argmax(axis=1)
            row = np.arange(len(rho))
            tau = peak / grid
            if closed:
                before, at, after = rho[row, peak - 1], rho[row, peak], rho[row, (peak + 1) % grid]
                bend = np.minimum(before - 2.0 * at + after, -1e-300)
                tau = tau + 0.5 * (before - after) / bend / grid
                if fine:
                    tau = _summit(products, k, tau)
            total = (products * np.exp(-2j * math.pi * k * tau[:, None])).sum(axis=1)
            error = np.sqrt(np.maximum(1.0 - np.abs(total) ** 2, 0.0))
            own = Aligned(error, total, tau, np.full(len(rho), reflected), np.full(len(rho), backwards))
            if best is None:
                best = own
            else:
                better = own.error < best.error
                best = Aligned(*(np.where(better, new, old) for new, old in zip(own, best)))
    assert best is not None
    return best


def _summit(products: Complex, k: NDArray[np.int64], tau: Array) -> Array:
    """Improve the shifts at which the sum of products has its largest size, by Newton's method."""
    w = -2j * math.pi * k
    for _ in range(_STEPS):
        terms = products * np.exp(w * tau[:, None])
        f, f1, f2 = terms.sum(axis=1), (w * terms).sum(axis=1), (w * w * terms).sum(axis=1)
        slope = (np.conj(f) * f1).real
        bend = np.abs(f1) ** 2 + (np.conj(f) * f2).real
        safe = bend < 0.0
        tau = tau - np.where(safe, slope / np.where(safe, bend, 1.0), 0.0)
    return tau
