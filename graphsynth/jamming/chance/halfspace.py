"""Probability that a weighted sum of independent quantities stays below a threshold: a Fourier series with proof.

The sum Z lies within H of the threshold t, so that its sign beside t is a square wave of period 2 H:
``P(Z < t) = 1/2 - (2 / pi) sum over odd k of Im(phi(pi k / H) exp(-i pi k t / H)) / k``, with the product phi of the
characteristic functions of the quantities.  The rest of the series is bounded by the variations of the densities, every
rounding error is bounded beforehand (theory/probability-of-jamming 3, 4).
"""

from __future__ import annotations

import math
from functools import cache
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from graphsynth.intervals.balls import _table
from graphsynth.jamming.chance.distributions import Bracket

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]
U = 2.0**-53
#: Bounds of the absolute errors: of `turned`, of `waves` (theory/probability-of-jamming 4).
TURNED, WAVES = 1e-15, 2e-14
#: Frequencies of a series, at most.
MOST = 1 << 15
#: Pieces from which a common step of the phases pays.
_MANY = 16
#: Terms of all series summed up at a time, about.
_TOGETHER = 20_000


class Sums(NamedTuple):
    """N sums of n quantities, ``sum of weight (v - centre)`` with v of the densities bracketed.

    ``weights``, ``centres`` (N, n); ``brackets``: N rows of n; ``thresholds`` (N, T).
    """

    weights: Array
    centres: Array
    brackets: list[list[Bracket]]
    thresholds: Array

    def take(self, rows: NDArray[np.intp]) -> Sums:
        """Keep some of the sums."""
        brackets = [self.brackets[row] for row in rows.tolist()]
        return Sums(self.weights[rows], self.centres[rows], brackets, self.thresholds[rows])


class Measures(NamedTuple):
    """Measures below thresholds: ``lower`` and ``upper`` (2, N, T) enclose those of the densities below and above.

    ``mass`` (2, N): a lower bound of all of the first, an upper bound of all of the second.  ``rest`` (N,): what the
    end of the series adds to the widths, relative to the mass.
    """

    lower: Array
    upper: Array
    mass: Array
    rest: Array


@cache
def _parts() -> tuple[Complex, float, float]:
    """Directions of 1024 parts of a turn, and a part in two doubles, the first with 27 digits."""
    part = 2.0 * math.pi / 1024.0
    scale = 2.0**34
    first = math.floor(part * scale) / scale
    # 2 pi - float(2 pi) = 2.4492935982947064e-16, to 2^-106
    return np.asarray(_table().mid), first, (part - first) + 2.4492935982947064e-16 / 1024.0


def turned(angle: Array) -> Complex:
    """``exp(i angle)`` for exact angles up to 2^18 in size; absolute error below `TURNED`."""
    table, first, second = _parts()
    index = np.rint(angle * (1.0 / (first + second)))
    rest = (angle - index * first) - index * second  # |rest| < 0.0031
    square = rest * rest
    sine = rest * (1.0 - square * (1.0 / 6.0 - square * (1.0 / 120.0 - square * (1.0 / 5040.0))))
    cosine = 1.0 - square * (0.5 - square * (1.0 / 24.0 - square * (1.0 / 720.0)))
    found: Complex = table[index.astype(np.int64) % 1024] * (cosine + 1j * sine)
    return found


def waves(angle: Array) -> tuple[Array, Array]:
    """Spherical Bessel functions j0 and j1 of angles (relative error 8 U at most); absolute error below `WAVES`."""
    small = np.abs(angle) < 0.5
    x = np.where(small, 1.0, angle)
    circle = turned(x)
    j0 = circle.imag / x
    j1 = (j0 - circle.real) / x
    s = np.where(small, angle, 0.0)
    q = s * s
    first = 1.0 - q / 6.0 * (
        1.0 - q / 20.0 * (1.0 - q / 42.0 * (1.0 - q / 72.0 * (1.0 - q / 110.0 * (1.0 - q / 156.0))))
    )
    second = 1.0 - q / 10.0 * (
        1.0 - q / 28.0 * (1.0 - q / 54.0 * (1.0 - q / 88.0 * (1.0 - q / 130.0 * (1.0 - q / 180.0))))
    )
    return np.where(small, first, j0), np.where(small, s / 3.0 * second, j1)


def _transforms(bracket: Bracket, weight: float, centre: float, omega: Array) -> tuple[Complex, Array]:
    """Return transforms of both functions at frequencies (K,) over their masses, (2, K), and bounds of the errors."""
    below, above = bracket.below, bracket.above
    sides: tuple[Any, ...] = (below,) if below is above else (below, above)
    alike = len(sides) == 2 and len(below.p) == len(above.p)
    alike = alike and bool((below.left == above.left).all() and (below.right == above.right).all())
    found = []
    for places in ((0, 1),) if alike else ((k,) for k in range(len(sides))):
        own = [sides[k] for k in places]
        half, middle = 0.5 * (own[0].right - own[0].left), 0.5 * (own[0].right + own[0].left) - centre
        levels = [(half * (s.p + s.q), half * (s.q - s.p)) for s in own]
        found += _summed(half, middle, levels, weight * omega)
    reach = abs(weight) * max(above.right[-1] - centre, centre - above.left[0])
    # |slope| <= level: each piece is wrong by its level times the errors of two waves and two directions, at most
    plain = 2.0 * WAVES + 3.0 * TURNED + 4.0 * (len(above.p) + len(below.p) + 8) * U
    # angles are wrong by a few roundings, and their middles by some of v itself
    wrong = plain + (32.0 * reach + 4.0 * abs(weight)) * U * omega
    scale = [1.0 / mass if mass > 0.0 else 0.0 for mass in bracket.masses]
    return np.stack([found[0] * scale[0], found[-1] * scale[1]]), wrong


def _summed(half: Array, middle: Array, levels: list[tuple[Array, Array]], speed: Array) -> list[Complex]:
    """Sum up the transforms of pieces of half widths around middles, for several densities on them."""
    count = len(half)
    block = 1 << (count.bit_length() // 2)
    if count > _MANY and count % block == 0 and (half == half[0]).all() and (np.diff(middle) == 2.0 * half[0]).all():
        j0, j1 = waves(speed * half[0])
        fine = turned(np.multiply.outer(middle[:block], speed))
        coarse = turned(np.multiply.outer(middle[::block] - middle[0], speed))
        sums = [(coarse * (values.reshape(-1, block) @ fine)).sum(axis=0) for pair in levels for values in pair]
        return [j0 * level + 1j * (j1 * slope) for level, slope in zip(sums[::2], sums[1::2])]
    j0, j1 = waves(np.multiply.outer(half, speed))
    phase = turned(np.multiply.outer(middle, speed))
    return [(phase * (level[:, None] * j0 + 1j * (slope[:, None] * j1))).sum(axis=0) for level, slope in levels]


def measures_below(sums: Sums, tolerance: Array) -> Measures:
    """Enclose the measures of ``sum < threshold``; a weight of zero counts by its mass.

    ``tolerance`` (N,) is what the end of each series may leave, relative to the mass.
    """
    count = len(sums.weights)
    masses = np.array([[b.masses for b in row] for row in sums.brackets]).transpose(2, 0, 1)
    slack = np.array([sum(len(b.below.p) + len(b.above.p) + 6.0 for b in row) for row in sums.brackets]) * 2.0 * U
    total = masses.prod(axis=2)
    moving = (sums.weights != 0.0).sum(axis=1)
    shape = (2, count, sums.thresholds.shape[1])
    lower, upper, rest = np.zeros(shape), np.zeros(shape), np.zeros(count)
    several = np.flatnonzero(moving > 1)
    if several.size:
        share, width, rest[several] = _shares(sums.take(several), masses[:, several], tolerance[several])
        width = width + slack[several, None]
        lower[:, several] = total[:, several, None] * np.maximum(share - width, 0.0)
        upper[:, several] = total[:, several, None] * np.minimum(share + width, 1.0)
    for row in np.flatnonzero(moving == 1).tolist():
        for side in (0, 1):
            lower[side, row], upper[side, row] = _one(sums, row, side, masses[side, row])
    none = moving == 0
    lower[:, none] = np.where(sums.thresholds[none] > 0.0, total[:, none, None], 0.0)
    upper[:, none] = np.where(sums.thresholds[none] >= 0.0, total[:, none, None], 0.0)
    bounds = np.stack([total[0] * (1.0 - slack), total[1] * (1.0 + slack)])
    return Measures(lower * (1.0 - slack)[:, None], upper * (1.0 + slack)[:, None], bounds, rest)


def _shares(sums: Sums, masses: Array, tolerance: Array) -> tuple[Array, Array, Array]:
    """Shares of the mass below the thresholds (2, N, T), half widths of their enclosures, what the ends leave (N,)."""
    ends = np.array([[(b.above.left[0], b.above.right[-1]) for b in row] for row in sums.brackets])
    sizes = np.abs(sums.weights)
    reach = (sizes * np.maximum(ends[:, :, 1] - sums.centres, sums.centres - ends[:, :, 0])).sum(axis=1)
    reach = reach * (1.0 + 1e-13) + 4.0 * U * sizes.sum(axis=1)
    inside = np.clip(sums.thresholds, -reach[:, None], reach[:, None])
    half = (reach + np.abs(inside).max(axis=1)) * (1.0 + 1e-9)
    variations = np.array([[b.variations for b in row] for row in sums.brackets]).transpose(2, 0, 1)
    with np.errstate(all="ignore"):  # the rest after K is at most the mass times tails[m - 1] / (K + 1)^m, for every m
        speeds = np.sort((variations / masses * half[:, None] / (np.pi * sizes)).max(axis=0), axis=1)
        powers = np.arange(1.0, speeds.shape[1] + 1.0)
        tails = np.cumprod(speeds, axis=1) / (np.pi * powers) * (1.0 + 1e-12)
        tails = np.where(np.isnan(tails), np.inf, tails)
        needed = ((tails / tolerance[:, None]) ** (1.0 / powers)).min(axis=1) + 2.0
        last = np.clip(needed, 8.0, MOST) // 2.0 * 2.0 - 1.0
    share, width, left = np.empty((2, *inside.shape)), np.empty((2, *inside.shape)), np.empty(len(half))
    order = np.argsort(last, kind="stable")
    while order.size:  # sums of about as many terms together
        most = max(1, _TOGETHER // int(last[order[0]]))
        group = order[:most][last[order[:most]] <= 1.3 * last[order[0]] + 8.0]
        terms = float(last[group[-1]])
        share[:, group], width[:, group] = _series(sums.take(group), inside[group], half[group], terms)
        with np.errstate(over="ignore"):
            left[group] = (tails[group] / (terms + 1.0) ** powers).min(axis=1)
        order = order[len(group) :]
    width = (width + left[:, None]) * (1.0 + 1e-12) + 8.0 * U
    certain = np.abs(sums.thresholds) >= reach[:, None] * (1.0 + 1e-12)
    share = np.where(certain, np.where(sums.thresholds > 0.0, 1.0, 0.0), share)
    return share, np.where(certain, 0.0, width), left


def _series(sums: Sums, inside: Array, half: Array, last: float) -> tuple[Array, Array]:
    """Sum up the series to the term ``last``: shares of the mass (2, N, T), and bounds of the rounding errors."""
    k = np.arange(1.0, last + 1.0, 2.0)
    omega = np.multiply.outer(np.pi / half, k)
    value: Any = np.ones((1, *omega.shape))
    error = np.zeros((1, *omega.shape))
    for j in range(sums.weights.shape[1]):
        raw, wrong = _column(sums, j, omega)
        error = (error * (np.abs(raw) + wrong) + np.abs(value) * wrong) * (1.0 + 1e-14)
        value = value * raw
    error = error + 8.0 * U * sums.weights.shape[1] * np.abs(value)
    angles = inside[:, :, None] * omega[:, None, :]
    terms = (value[:, :, None, :] * turned(-angles)).imag / k
    wrong = ((error + np.abs(value) * 2.0 * TURNED) / k).sum(axis=-1)[:, :, None]
    wrong = wrong + 16.0 * U * (np.abs(value)[:, :, None, :] * np.abs(angles) / k).sum(axis=-1)
    wrong = wrong + 2.0 * (len(k) + 8) * U * np.abs(terms).sum(axis=-1)
    share = 0.5 - (2.0 / np.pi) * terms.sum(axis=-1)
    shape = (2, *inside.shape)
    return np.broadcast_to(share, shape), np.broadcast_to((2.0 / np.pi) * wrong, shape)


def _column(sums: Sums, j: int, omega: Array) -> tuple[Any, Array]:
    """Return transforms of quantity j of all sums over the masses, (1 or 2, N, K), and bounds of their errors."""
    brackets = [row[j] for row in sums.brackets]
    weights, centres = sums.weights[:, j], sums.centres[:, j]
    level = np.array([b.level for b in brackets])
    if level.all() and len(level):
        left, right = (np.array([getattr(b.below, name)[0] for b in brackets]) for name in ("left", "right"))
        if (0.5 * (left + right) == centres).all():
            reach = np.abs(weights) * (0.5 * (right - left))
            raw = waves(reach[:, None] * omega)[0]
            return raw[None], (WAVES + 16.0 * U + 32.0 * U * reach[:, None] * omega)[None]
    rows = [_transforms(b, w, c, o) for b, w, c, o in zip(brackets, weights.tolist(), centres.tolist(), omega)]
    return np.stack([value for value, _ in rows], axis=1), np.stack([wrong for _, wrong in rows])[None]


def _one(sums: Sums, row: int, side: int, masses: Array) -> tuple[Array, Array]:
    """Enclose the measures of one moving quantity: the integral of its density up to an end, with the end enclosed."""
    j = int(np.flatnonzero(sums.weights[row])[0])
    bracket, weight, centre = sums.brackets[row][j], float(sums.weights[row, j]), float(sums.centres[row, j])
    own = (bracket.below, bracket.above)[side]
    thresholds, others = sums.thresholds[row], float(np.delete(masses, j).prod())
    bounds = []
    spread = 4.0 * U * (abs(centre) + np.abs(thresholds / weight)) + 1e-300
    for sign in (-1.0, 1.0):
        end = centre + thresholds / weight + sign * spread
        end = np.clip(end[:, None], own.left, own.right)
        at_end = own.p + (own.q - own.p) * ((end - own.left) / (own.right - own.left))
        value = (0.5 * (end - own.left) * (own.p + at_end)).sum(axis=1)
        bounds.append(value if weight > 0.0 else masses[j] - value)
    error = (len(own.p) + 16.0) * 2.0 * U * masses[j]
    lower, upper = np.minimum(*bounds) - error, np.maximum(*bounds) + error
    return others * np.maximum(lower, 0.0), others * np.maximum(upper, 0.0)
