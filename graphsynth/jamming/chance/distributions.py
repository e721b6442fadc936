"""Distributions of toleranced quantities, with proved bounds of their densities and of their probabilities.

Every quantity is written ``lower + (upper - lower) v``, v between 0 and 1; densities and pieces are in v.  A density is
used through two step-wise linear functions, one below and one above it, so that the probability of any event lies
between two measures that are summed up exactly (theory/probability-of-jamming 2).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from graphsynth.core.errors import GeometryError
from graphsynth.intervals import Interval, exp, log
from graphsynth.intervals.reading import enclose, precision
from graphsynth.jamming.bearing.parameters import Given, Range, exact_text

Array = NDArray[np.float64]
#: Binary digits of the special functions.
_DIGITS = 128


class Trapezoids(NamedTuple):
    """A density made of linear pieces: from ``p`` at ``left`` to ``q`` at ``right``, each (pieces,), none negative."""

    left: Array
    right: Array
    p: Array
    q: Array


class Bracket(NamedTuple):
    """Two functions made of linear pieces, the density between them.

    ``masses`` and ``variations`` are of both: integrals within a relative error of (pieces + 4) 2^-53, and upper bounds
    of the total variations over the line.  ``level``: they are one, a single piece and constant.
    """

    below: Trapezoids
    above: Trapezoids
    masses: tuple[float, float]
    variations: tuple[float, float]
    level: bool

    @classmethod
    def of(cls, below: Trapezoids, above: Trapezoids) -> Bracket:
        """Measure both functions."""
        sides = below, above
        level = below is above and len(below.p) == 1 and bool((below.p == below.q).all())
        masses, variations = (tuple(map(measure, sides)) for measure in (_mass_of, _variation_of))
        return cls(below, above, masses, variations, level)  # type: ignore[arg-type]


def _mass_of(pieces: Trapezoids) -> float:
    return float((0.5 * (pieces.right - pieces.left) * (pieces.p + pieces.q)).sum())


def _variation_of(pieces: Trapezoids) -> float:
    if (pieces.left[1:] == pieces.right[:-1]).all():
        jumps = float(np.abs(pieces.p[1:] - pieces.q[:-1]).sum())
    else:  # pieces that overlap or leave gaps
        jumps = float((pieces.p[1:] + pieces.q[:-1]).sum())
    total = pieces.p[0] + np.abs(pieces.q - pieces.p).sum() + jumps + pieces.q[-1]
    return float(total) * (1.0 + (len(pieces.p) + 4) * 2.0**-51)


@dataclass(frozen=True)
class Distribution:
    """Distribution of one toleranced quantity over a bounded range.

    Made by `uniform`, `normal` (cut off at the ends), `triangular`, `beta` and `histogram`.  Numbers are read as those
    of a `ToleranceBox`: text and fractions are exact.

    Attributes
    ----------
    kind : str
        Name of the constructor.
    support : Range
        All values that occur.
    parameters : tuple of Fraction
        What the kind takes besides: mean and standard deviation before the cut; mode; both exponents; edges, then
        weights.

    Examples
    --------
    >>> Distribution.normal("0.03 +- 0.003")
    Distribution.normal([0.027, 0.033], 0.03, 0.001)
    """

    kind: str
    support: Range
    parameters: tuple[Fraction, ...] = ()

    def __repr__(self) -> str:
        shown = [*map(exact_text, self.parameters[:6]), *(["..."] if len(self.parameters) > 6 else [])]
        return f"Distribution.{self.kind}({', '.join([str(self.support), *shown])})"

    @classmethod
    def _made(cls, kind: str, support: Range, points: Sequence[Range]) -> Distribution:
        exact = support.exact and all(point.exact for point in points)
        return cls(kind, Range(support.lower, support.upper, exact), tuple(point.lower for point in points))

    @classmethod
    def uniform(cls, support: Given) -> Distribution:
        """Take all values of the range as equally likely; `GeometryError` for one number."""
        return cls("uniform", _range(support))

    @classmethod
    def normal(cls, support: Given, mean: Given = None, sigma: Given = None) -> Distribution:
        """Cut a bell curve off at the ends of the range; by default around its middle, three sigma to either end.

        `GeometryError` for a mean outside, or a standard deviation below a thousandth of the range.
        """
        found = _range(support)
        middle, third = (found.lower + found.upper) / 2, (found.upper - found.lower) / 6
        points = _point("mean", mean, middle), _point("sigma", sigma, third)
        m, s = (point.lower for point in points)
        if not found.lower <= m <= found.upper:
            raise GeometryError(f"mean = {float(m):.6g} lies outside of {found}; give one inside")
        if s <= 0 or s < (found.upper - found.lower) / 1000:
            raise GeometryError(f"sigma = {float(s):.6g} must be positive, and a thousandth of the range at least")
        return cls._made("normal", found, points)

    @classmethod
    def triangular(cls, support: Given, mode: Given = None) -> Distribution:
        """Let the density rise to the mode (by default the middle) and fall from there; `GeometryError` if outside."""
        found = _range(support)
        m = _point("mode", mode, (found.lower + found.upper) / 2)
        if not found.lower <= m.lower <= found.upper:
            raise GeometryError(f"mode = {m} lies outside of {found}; give one inside")
        return cls._made("triangular", found, [m])

    @classmethod
    def beta(cls, support: Given, a: Given, b: Given) -> Distribution:
        """Take the density ``v^(a - 1) (1 - v)^(b - 1)`` over the range; `GeometryError` unless both are 1 to 100."""
        exponents = tuple(_point(name, value, Fraction(1)) for name, value in (("a", a), ("b", b)))
        if not all(1 <= value.lower <= 100 for value in exponents):
            raise GeometryError(f"a = {a}, b = {b} must lie between 1 and 100; correct the exponents")
        return cls._made("beta", _range(support), exponents)

    @classmethod
    def histogram(cls, edges: Sequence[Given], weights: Sequence[Given]) -> Distribution:
        """Take a density that is constant between neighbouring edges; weights are counts or shares of the classes.

        `GeometryError` for edges that do not ascend, for negative weights, for numbers of both that do not fit.
        """
        points = [_point("edge", value, Fraction(0)) for value in edges]
        points += [_point("weight", value, Fraction(0)) for value in weights]
        values = [point.lower for point in points]
        e, w = values[: len(edges)], values[len(edges) :]
        if not w or len(e) != len(w) + 1 or len(w) > 1000 or sorted(set(e)) != e:
            raise GeometryError(
                f"{len(e)} edges and {len(w)} weights are no histogram; give ascending edges, one more than weights, "
                "and at most 1000 weights"
            )
        if min(w) < 0 or sum(w) == 0:
            raise GeometryError("weights must be zero or more, and not all zero; correct the weights")
        return cls._made("histogram", Range(e[0], e[-1]), points)

    @property
    def is_point(self) -> bool:
        """Whether there is one value only."""
        return self.support.is_point

    def scaled(self, factor: Fraction) -> Distribution:
        """Return the distribution with all deviations from the middle of the range that many times as large."""
        centre = (self.support.lower + self.support.upper) / 2

        def moved(value: Fraction) -> Fraction:
            return centre + (value - centre) * factor

        p = self.parameters
        if self.kind == "normal":
            p = (moved(p[0]), p[1] * factor)
        elif self.kind == "triangular":
            p = (moved(p[0]),)
        elif self.kind == "histogram":
            edges = len(p) // 2 + 1
            p = (*map(moved, p[:edges]), *p[edges:])
        ends = Range(moved(self.support.lower), moved(self.support.upper), self.support.exact)
        return Distribution(self.kind, ends, p)

    def _unit(self, value: Fraction) -> Fraction:
        """Return v of a value of the quantity."""
        return (value - self.support.lower) / (self.support.upper - self.support.lower)

    def bracket(self, a: float, b: float, resolution: int) -> Bracket:
        """Enclose the density over [a, b] within [0, 1], with pieces of about ``1 / resolution`` where it is curved.

        The width of [a, b] must be a multiple of 2^-32, ``resolution`` a power of 2.
        """
        if self.kind == "uniform":
            one = np.ones(1)
            pieces = Trapezoids(np.array([a]), np.array([b]), one, one)
            return Bracket.of(pieces, pieces)
        if self.kind == "triangular":
            return _triangle(self._unit(self.parameters[0]), a, b)
        if self.kind == "histogram":
            return _steps(*_classes(self), a, b)
        count = 1 << max(2, math.ceil(math.log2(max((b - a) * resolution, 1.0))))
        return _smooth(self, np.asarray(a + (b - a) / count * np.arange(count + 1.0)))

    def mass(self, a: float, b: float) -> tuple[float, float]:
        """Enclose the probability of a <= v <= b."""
        if a == 0.0 and b == 1.0:
            return 1.0, 1.0
        return _mass(self, a, b)

    def sample(self, random: np.random.Generator, count: int) -> Array:
        """Return values of v (estimated: for Monte Carlo)."""
        u = random.random(count)
        if self.kind == "triangular":
            mode = float(self._unit(self.parameters[0]))
            return np.where(u < mode, np.sqrt(u * mode), 1.0 - np.sqrt((1.0 - u) * (1.0 - mode)))
        if self.kind == "normal":
            from scipy.special import ndtr, ndtri

            mean, sigma = _standard(self)
            low, high = ndtr(float(-mean / sigma)), ndtr(float((1 - mean) / sigma))
            return np.asarray(np.clip(float(mean) + float(sigma) * ndtri(low + u * (high - low)), 0.0, 1.0))
        if self.kind == "beta":
            a, b = map(float, self.parameters)
            return random.beta(a, b, count)
        if self.kind == "histogram":
            edges, weights = _classes(self)
            shares = np.array([float(w) for w in weights])
            place = np.searchsorted(np.cumsum(shares)[:-1], random.random(count), side="right")
            ends = np.array([float(e) for e in edges])
            return ends[place] + u * np.diff(ends)[place]
        return u


def _range(support: Given) -> Range:
    found = Range.read("support", support)
    if found.is_point:
        raise GeometryError(f"support = {found} is one number; give a range such as 17.5 +- 0.005")
    return found


def _point(name: str, value: Given, default: Fraction) -> Range:
    if value is None:
        return Range(default, default)
    found = Range.read(name, value)
    if not found.is_point:
        raise GeometryError(f"{name} = {found} is a range; give one number")
    return found


def _standard(of: Distribution) -> tuple[Fraction, Fraction]:
    """Mean and standard deviation in v."""
    mean, sigma = of.parameters
    return of._unit(mean), sigma / (of.support.upper - of.support.lower)


def _classes(of: Distribution) -> tuple[list[Fraction], list[Fraction]]:
    """Edges in v, and shares of the classes."""
    count = len(of.parameters) // 2 + 1
    weights = of.parameters[count:]
    return [of._unit(e) for e in of.parameters[:count]], [w / sum(weights) for w in weights]


def _ends(ball: Any) -> tuple[float, float]:
    """Doubles around a ball of python-flint, not below zero."""
    low, high = float(ball.lower()), float(ball.upper())
    return max(math.nextafter(low, -math.inf), 0.0), math.nextafter(high, math.inf)


def _mass(of: Distribution, a: float, b: float) -> tuple[float, float]:
    x, y = Fraction(a), Fraction(b)
    if of.kind == "uniform":
        return enclose(y - x)
    if of.kind == "triangular":
        mode = of._unit(of.parameters[0])

        def below(v: Fraction) -> Fraction:
            return v * v / mode if v < mode else 1 - (1 - v) ** 2 / (1 - mode) if mode < 1 else v * v

        return enclose(below(y) - below(x))
    if of.kind == "histogram":
        edges, weights = _classes(of)
        parts = (
            w * max(Fraction(0), min(y, right) - max(x, left)) / (right - left)
            for left, right, w in zip(edges, edges[1:], weights)
        )
        return enclose(sum(parts, Fraction(0)))
    with precision(_DIGITS):
        low, high = _ends(_special_mass(of, x, y))
    return low, min(high, 1.0)


def _ball(value: Fraction) -> Any:
    import flint

    return flint.arb(flint.fmpq(value.numerator, value.denominator))


def _special_mass(of: Distribution, x: Fraction, y: Fraction) -> Any:
    """Probability as a ball: of a normal distribution by erfc on the side where it is small, of a beta by its own."""
    if of.kind == "beta":
        a, b = map(_ball, of.parameters)
        return _ball(y).beta_lower(a, b, True) - _ball(x).beta_lower(a, b, True)
    mean, sigma = _standard(of)
    return _normal_mass(mean, sigma, x, y) / _normal_mass(mean, sigma, Fraction(0), Fraction(1))


def _normal_mass(mean: Fraction, sigma: Fraction, x: Fraction, y: Fraction) -> Any:
    root = _ball(Fraction(2)).sqrt()
    low, high = (_ball((v - mean) / sigma) / root for v in (x, y))
    if x >= mean:
        return (low.erfc() - high.erfc()) / 2
    if y <= mean:
        return ((-high).erfc() - (-low).erfc()) / 2
    return (high.erf() - low.erf()) / 2


def _triangle(mode: Fraction, a: float, b: float) -> Bracket:
    kink = math.nextafter(float(mode), 0.0)
    edges = [a, *([kink] if a < kink < b else []), b]
    off = Fraction(0)  # of the chord across the true mode, just right of the kink
    if 0 < mode < 1 and a < mode:
        off = Fraction(1, 2**50) * (2 / mode + 2 / (1 - mode))

    def density(v: float) -> Fraction:
        x = Fraction(v)
        return 2 * x / mode if x < mode else 2 * (1 - x) / (1 - mode) if mode < 1 else 2 * x

    low, high = zip(*(enclose(density(v)) for v in edges))
    left, right = np.array(edges[:-1]), np.array(edges[1:])
    more = np.nextafter(np.array(high) + float(off), np.inf)
    return Bracket.of(
        Trapezoids(left, right, np.array(low[:-1]), np.array(low[1:])),
        Trapezoids(left, right, more[:-1], more[1:]),
    )


def _steps(edges: list[Fraction], shares: list[Fraction], a: float, b: float) -> Bracket:
    """Classes cut to [a, b]; below they are rounded inward, above outward."""
    below, above = [], []
    for left, right, share in zip(edges, edges[1:], shares):
        if right < a or left > b:
            continue
        (first, start), (stop, last) = enclose(left), enclose(right)
        low, high = enclose(share / (right - left))
        if min(stop, b) > max(start, a):
            below.append((max(start, a), min(stop, b), low, low))
        if min(last, b) > max(first, a):
            above.append((max(first, a), min(last, b), high, high))
    if not below:
        below = [(a, b, 0.0, 0.0)]
    return Bracket.of(*(Trapezoids(*np.array(rows).T.copy()) for rows in (below, above)))


def _smooth(of: Distribution, edges: NDArray[Any]) -> Bracket:
    """Chords between proved values, moved by the bound h^2 / 8 max |g''| of their distance from the density g.

    Where that is worse than the range of the density over the piece, as beside an end of a beta distribution, the piece
    is that range.
    """
    step = edges[1] - edges[0]
    density, bend = _DENSITY[of.kind]
    at = density(of, Interval.from_bounds(edges, edges))
    over = Interval.from_bounds(edges[:-1], edges[1:])
    spread = density(of, over)
    second = bend(of, over, spread)
    factor = step * step / 8.0 * (1.0 + 1e-15)
    sag, bulge = np.maximum(second.hi, 0.0) * factor, np.maximum(-second.lo, 0.0) * factor
    low = [np.nextafter(at.lo[k : len(edges) - 1 + k] - sag, -np.inf) for k in (0, 1)]
    high = [np.nextafter(at.hi[k : len(edges) - 1 + k] + bulge, np.inf) for k in (0, 1)]
    flat = ~(sag + bulge < spread.width) | (np.minimum(*low) < 0.0)
    least = np.maximum(spread.lo, 0.0)
    p, q = (np.where(flat, least, side) for side in low)
    r, s = (np.where(flat, spread.hi, side) for side in high)
    return Bracket.of(Trapezoids(over.lo, over.hi, p, q), Trapezoids(over.lo, over.hi, r, s))


@lru_cache(maxsize=1000)
def _factor(of: Distribution) -> Interval:
    """Enclose what the density is multiplied by, so that all probabilities add up to 1."""
    import flint

    with precision(_DIGITS):
        if of.kind == "beta":
            a, b = map(_ball, of.parameters)
            value = (a + b).gamma() / (a.gamma() * b.gamma())
        else:
            mean, sigma = _standard(of)
            whole = _normal_mass(mean, sigma, Fraction(0), Fraction(1))
            value = 1 / (_ball(sigma) * (2 * flint.arb.pi()).sqrt() * whole)
        return Interval.from_bounds(*_ends(value))


def _interval(value: Fraction) -> Interval:
    return Interval.from_bounds(*enclose(value))


def _normal_density(of: Distribution, v: Interval) -> Interval:
    mean, sigma = _standard(of)
    return _factor(of) * exp(-(((v - _interval(mean)) / _interval(sigma)).sqr() / 2))


def _normal_bend(of: Distribution, v: Interval, density: Interval) -> Interval:
    mean, sigma = _standard(of)
    z = (v - _interval(mean)) / _interval(sigma)
    return density * (z.sqr() - 1) / _interval(sigma * sigma)


def _power(v: Interval, exponent: Fraction) -> Interval:
    """Raise something between 0 and 1 to an exponent that is not negative."""
    if exponent == 0:
        return Interval.from_bounds(np.ones(v.shape), np.ones(v.shape))
    if exponent.denominator == 1:
        return v ** int(exponent)
    ends = [
        exp(_interval(exponent) * log(Interval.from_bounds(x, x)))
        for x in (np.maximum(v.lo, 1e-300), np.maximum(v.hi, 1e-300))
    ]
    return Interval.from_bounds(np.where(v.lo <= 1e-300, 0.0, ends[0].lo), ends[1].hi)


def _beta_density(of: Distribution, v: Interval) -> Interval:
    a, b = of.parameters
    w = (1 - v).intersect(Interval.from_bounds(0.0, 1.0))
    return _factor(of) * _power(v, a - 1) * _power(w, b - 1)


def _beta_bend(of: Distribution, v: Interval, density: Interval) -> Interval:
    a, b = (_interval(value - 1) for value in of.parameters)
    one, other = a / v, b / (1 - v)
    second = density * ((one - other).sqr() - one / v - other / (1 - v))
    inner = (v.lo > 0.0) & (v.hi < 1.0) & second.is_bounded
    return Interval.from_bounds(np.where(inner, second.lo, -np.inf), np.where(inner, second.hi, np.inf))


_DENSITY = {"normal": (_normal_density, _normal_bend), "beta": (_beta_density, _beta_bend)}
