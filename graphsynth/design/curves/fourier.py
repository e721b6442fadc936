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
#: No peak is flatter.
_LEAST = 1e-30


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
    """How a curve fits on a wanted one: distance of the unit curves, and the motion that takes it there.

    ``factor`` multiplies the unit curve, after reflection (conjugate) and reversal; ``shift`` is the beginning, as part
    of the period.
    """

    error: float
    factor: complex
    shift: float
    reflected: bool
    backwards: bool


def variant(found: AnyComplex, reflected: bool, backwards: bool) -> AnyComplex:
    """Coefficients of the curve reflected in the x axis, and run backwards."""
    if reflected != backwards:
        found = found[..., ::-1]
    return np.conj(found) if reflected else found


def distances(wanted: AnyComplex, found: AnyComplex, closed: bool) -> Array:
    """Distances (sets,) of unit curves from a wanted one, from a grid and the parabola through its highest peak."""
    k = orders(wanted.shape[-1] // 2)
    best = np.zeros(len(found))
    for reflected, backwards in _ways(closed):
        rho, at = _correlation(np.conj(variant(found, reflected, backwards)) * wanted, k, closed)
        row, peak = np.arange(len(rho)), rho.argmax(axis=1)
        here = rho[row, peak]
        if closed:
            before, after = rho[row, peak - 1], rho[row, (peak + 1) % len(at)]
            here = here + 0.125 * (before - after) ** 2 / np.maximum(2.0 * here - before - after, _LEAST)
        best = np.maximum(best, here)
    return np.asarray(np.sqrt(np.maximum(1.0 - best, 0.0)))


def aligned(wanted: Complex, found: Complex, closed: bool) -> Aligned:
    """Fit a unit curve on a wanted one by rotation, size, beginning, sense and reflection.

    Every peak of the correlation that may be the highest is climbed by Newton's method.
    """
    k = orders(wanted.shape[-1] // 2)
    best: Aligned | None = None
    for reflected, backwards in _ways(closed):
        own = variant(found, reflected, backwards)
        products = np.conj(own) * wanted
        (rho,), at = _correlation(products[None], k, closed)
        if closed:
            peak = (rho >= np.roll(rho, 1)) & (rho >= np.roll(rho, -1)) & (rho >= _RIVAL * rho.max())
            at = _summit(products, k, at[peak])
        turned = np.exp(-2j * math.pi * k * at[:, None])
        heights = turned @ products
        high = int(np.abs(heights).argmax())
        total = complex(heights[high])
        # the distance itself: 1 - rho^2 loses digits where the curves are nearly the same
        error = float(np.linalg.norm(wanted - total * own * np.conj(turned[high])))
        if best is None or error < best.error:
            best = Aligned(error, total, float(at[high]), reflected, backwards)
    assert best is not None
    return best


def _ways(closed: bool) -> list[tuple[bool, bool]]:
    """Reflected or not, backwards or not; an open curve backwards begins at its other end, half a period later."""
    return [(reflected, back) for reflected in (False, True) for back in (False, True) if closed or not back]


def _correlation(products: AnyComplex, k: NDArray[np.int64], closed: bool) -> tuple[NDArray[Any], Array]:
    """Squared sums of products (sets, shifts) at some shifts, and these: a grid, or both ends of an open curve."""
    if not closed:
        even, odd = (products[:, k % 2 == part].sum(axis=1) for part in (0, 1))
        sums = np.stack([even + odd, even - odd], axis=1)
        return sums.real**2 + sums.imag**2, np.array([0.0, 0.5])
    grid = 4 * 2 ** math.ceil(math.log2(len(k) // 2 + 1))
    spread = np.zeros((len(products), grid), dtype=products.dtype)
    spread[:, k % grid] = products
    sums = np.fft.fft(spread, axis=1)
    return sums.real**2 + sums.imag**2, np.arange(grid) / grid


def _summit(products: Complex, k: NDArray[np.int64], shift: Array) -> Array:
    """Improve shifts at which the sum of products has a peak, by Newton's method."""
    w = -2j * math.pi * k
    for _ in range(_STEPS):
        terms = products * np.exp(w * shift[:, None])
        f, f1, f2 = terms.sum(axis=1), terms @ w, terms @ w**2
        slope = (np.conj(f) * f1).real
        bend = np.abs(f1) ** 2 + (np.conj(f) * f2).real
        safe = bend < 0.0
        shift = shift - np.where(safe, slope / np.where(safe, bend, 1.0), 0.0)
    return shift
