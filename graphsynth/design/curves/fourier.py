"""Curves as Fourier coefficients, and the distance of two curves whatever their place, size, direction and beginning.

Theory, with proofs of the invariances: docs/theory/curve-index.md.  The coefficients of a polygon over its arc length
are a finite sum [Kuhl & Giardina 1982]; an open curve is run through there and back.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]
#: Of single or double precision.
AnyComplex = NDArray[np.complexfloating[Any, Any]]

#: Steps of Newton's method for the shift between two curves.
_STEPS = 6
#: Peaks of the correlation on the grid that may be the highest, over the highest there.
_RIVAL = 0.9


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
    # the coefficient is a sum over the corners: the change of direction there, times a power of the corner's phase
    none = np.zeros((len(points), 1))
    bends = -np.diff(ways, axis=1, prepend=none, append=none)
    found = np.empty((len(points), 2 * harmonics), dtype=np.complex128)
    power = np.ones_like(turn)
    for k in range(1, harmonics + 1):
        power = power * turn
        size = period[:, 0] / (2.0 * math.pi * k) ** 2
        forth, back = np.einsum("sn,sn->s", bends, power), np.einsum("sn,sn->s", bends, power.conj())
        both = forth + back
        found[:, harmonics + k - 1] = size * np.where(closed, forth, both)
        found[:, harmonics - k] = size * np.where(closed, back, both)
    return found


def halved(values: Complex, closed: NDArray[np.bool_], count: NDArray[np.int64]) -> Complex:
    """Return samples of curves (sets, n) with those half way between, by cubics; what is behind ``count`` repeats.

    Closed rows are periodic, open ones go on by the cubic through their last four samples.
    """
    row = np.arange(len(values))
    z = np.concatenate([values[:, :1], values, values[:, -1:]], axis=1)
    ends = (values[:, :4], np.stack([values[row, count - 1 - k] for k in range(4)], axis=1))
    beyond = [part @ [4.0, -6.0, 4.0, -1.0] for part in ends]
    z[:, 0] = np.where(closed, values[row, count - 2], beyond[0])
    z[row, count + 1] = np.where(closed, values[:, 1], beyond[1])
    found = np.repeat(values, 2, axis=1)[:, :-1]
    middle = (9.0 * (z[:, 1:-2] + z[:, 2:-1]) - z[:, :-3] - z[:, 3:]) / 16.0
    inside = np.arange(values.shape[1] - 1) < (count - 1)[:, None]
    found[:, 1::2] = np.where(inside, middle, values[row, count - 1][:, None])
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


def magnitudes(found: AnyComplex, harmonics: int) -> Array:
    """Sizes of the coefficients of the first harmonics, of unit curves: no motion of a curve changes them.

    Running the curve backwards, or reflecting it, exchanges the sizes of k and -k.  The Euclidean distance of two
    curves' sizes is never larger than that of the curves (docs/theory/curve-index.md).
    """
    half, odd = divmod(found.shape[-1], 2)
    return np.abs(found[..., half - harmonics : half + harmonics + odd])


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


def variant(found: AnyComplex, reflected: bool, backwards: bool) -> AnyComplex:
    """Coefficients of the curve reflected in the x axis, and run backwards."""
    if reflected != backwards:
        found = found[..., ::-1]
    return np.conj(found) if reflected else found


def aligned(wanted: AnyComplex, found: AnyComplex, closed: bool, fine: bool = False) -> Aligned:
    """Fit unit curves (sets, 2 harmonics) on a wanted unit curve by rotation, size, beginning, sense and reflection.

    The distance is ``sqrt(1 - rho^2)`` with rho the largest size of the correlation.  ``fine``: every peak of the
    correlation that may be the highest is climbed by Newton's method, and the distance is that of the curves.
    """
    half = wanted.shape[-1] // 2
    k = orders(half)
    best: Aligned | None = None
    for reflected in (False, True):
        for backwards in (False, True):
            if backwards and not closed:  # an open curve backwards begins at its other end: a shift by half a period
                continue
            own = variant(found, reflected, backwards)
            products = np.conj(own) * wanted
            shift = _shifts(products, k, fine) if closed else _ends(products, k)
            turned = np.exp(-2j * math.pi * k * shift[:, None])
            total = (products * turned).sum(axis=1)
            error = np.sqrt(np.maximum(1.0 - np.abs(total) ** 2, 0.0))
            if fine:  # without the loss of digits where the curves are nearly the same
                error = np.linalg.norm(wanted - total[:, None] * own * np.conj(turned), axis=1)
            fit = Aligned(error, total, shift, np.full(len(error), reflected), np.full(len(error), backwards))
            if best is not None:
                better = fit.error < best.error
                fit = Aligned(*(np.where(better, new, old) for new, old in zip(fit, best)))
            best = fit
    assert best is not None
    return best


def _ends(products: AnyComplex, k: NDArray[np.int64]) -> Array:
    """Shift of an open curve: 0, or 1/2, which begins at its other end."""
    return np.where(np.abs(products @ (-1.0) ** k) > np.abs(products.sum(axis=1)), 0.5, 0.0)


def _shifts(products: AnyComplex, k: NDArray[np.int64], fine: bool) -> Array:
    """Shifts at which the sums of products are largest, from a grid and the parabola through its highest peak."""
    grid = 4 * 2 ** math.ceil(math.log2(len(k) // 2 + 1))
    spread = np.zeros((len(products), grid), dtype=products.dtype)
    spread[:, k % grid] = products
    rho = np.abs(np.fft.fft(spread, axis=1)) ** 2
    high = rho.max(axis=1, keepdims=True)
    if fine:
        peak = (rho >= np.roll(rho, 1, axis=1)) & (rho >= np.roll(rho, -1, axis=1)) & (rho >= _RIVAL * high)
        row, at = np.nonzero(peak)
    else:
        row, at = np.arange(len(rho)), rho.argmax(axis=1)
    before, here, after = rho[row, at - 1], rho[row, at], rho[row, (at + 1) % grid]
    shift = (at + 0.5 * (before - after) / np.minimum(before - 2.0 * here + after, -1e-300)) / grid
    if not fine:
        return np.asarray(shift)
    shift = _summit(products[row], k, shift)
    height = np.abs((products[row] * np.exp(-2j * math.pi * k * shift[:, None])).sum(axis=1))
    order = np.lexsort((-height, row))
    return np.asarray(shift[order][np.searchsorted(row, np.arange(len(rho)))])


def _summit(products: AnyComplex, k: NDArray[np.int64], tau: Array) -> Array:
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
