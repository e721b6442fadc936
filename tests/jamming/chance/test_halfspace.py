"""Distributions between proved functions, and half spaces by the series, against exact sums and 50 digits."""

import math
from fractions import Fraction
from itertools import product

import mpmath
import numpy as np
import pytest

from graphsynth.core.errors import GeometryError
from graphsynth.jamming import Distribution
from graphsynth.jamming.chance.distributions import Bracket, Trapezoids
from graphsynth.jamming.chance.halfspace import TURNED, WAVES, Sums, measures_below, turned, waves

ONE = Distribution.uniform("[0, 1]").bracket(0.0, 1.0, 64)
KINDS = [
    Distribution.uniform("[2, 4]"),
    Distribution.normal("[2, 4]"),
    Distribution.normal("[2, 4]", mean="2.3", sigma="0.4"),
    Distribution.triangular("[2, 4]", "2.7"),
    Distribution.triangular("[2, 4]", 2),
    Distribution.triangular("[2, 4]", 4),
    Distribution.beta("[2, 4]", 2, "3.5"),
    Distribution.beta("[2, 4]", "1.25", 1),
    Distribution.beta("[2, 4]", 7, 3),
    Distribution.histogram([2, "2.3", 3, 4], [3, 0, 5]),
]


def density(of: Distribution, v: float) -> mpmath.mpf:
    """Density at v, to the working precision; written anew."""
    x, p = mpmath.mpf(v), [mpmath.mpf(q.numerator) / q.denominator for q in of.parameters]
    if of.kind == "normal":
        mean, sigma = (p[0] - 2) / 2, p[1] / 2
        whole = mpmath.ncdf((1 - mean) / sigma) - mpmath.ncdf(-mean / sigma)
        return mpmath.npdf((x - mean) / sigma) / sigma / whole
    if of.kind == "triangular":
        mode = (p[0] - 2) / 2
        return 2 * x / mode if x < mode or mode == 1 else 2 * (1 - x) / (1 - mode)
    if of.kind == "beta":
        return x ** (p[0] - 1) * (1 - x) ** (p[1] - 1) / mpmath.beta(*p)
    if of.kind == "histogram":
        edges = [(e - 2) / 2 for e in p[:4]]
        at = max(k for k in range(3) if edges[k] <= x)
        return p[4 + at] / 8 / (edges[at + 1] - edges[at])
    return mpmath.mpf(1)


def height(side: Trapezoids, v: float) -> mpmath.mpf:
    at = np.flatnonzero((side.left <= v) & (v <= side.right))
    if at.size == 0:
        return mpmath.mpf(0)
    rows = [[mpmath.mpf(float(x)) for x in (side.left[k], side.right[k], side.p[k], side.q[k])] for k in at]
    return max(p + (q - p) * (v - left) / (right - left) for left, right, p, q in rows)


@pytest.mark.parametrize("of", KINDS, ids=repr)
def test_density_lies_between_its_two_functions(of: Distribution) -> None:
    random = np.random.default_rng(1)
    with mpmath.workdps(50):
        for a, b in ((0.0, 1.0), (0.125, 0.375), (0.75, 1.0)):
            found = of.bracket(a, b, 256)
            for v in random.uniform(a, b, 12).tolist():
                exact = density(of, v)
                assert height(found.below, v) <= exact * (1 + 1e-15) + 1e-18
                assert height(found.above, v) >= exact * (1 - 1e-15)
            low, high = of.mass(a, b)
            with mpmath.workdps(15):
                exact = mpmath.quad(lambda v: density(of, v), [a, *(x for x in (0.15, 0.35, 0.5) if a < x < b), b])
            assert low - 1e-9 <= exact <= high + 1e-9  # of the quadrature
            assert found.masses[0] <= high + 1e-15 and found.masses[1] >= low - 1e-15
            assert found.masses[1] - found.masses[0] < 2e-4 or of.kind == "beta"


def test_masses_of_special_functions_have_fifty_digits_inside() -> None:
    with mpmath.workdps(50):
        low, high = KINDS[1].mass(0.0, 0.25)
        exact = (mpmath.ncdf(-1.5) - mpmath.ncdf(-3)) / (1 - 2 * mpmath.ncdf(-3))
        assert low <= exact <= high and high - low < 1e-16
        low, high = KINDS[6].mass(0.125, 0.5)
        exact = mpmath.betainc(2, 3.5, 0.125, 0.5, regularized=True)
        assert low <= exact <= high and high - low < 1e-15


@pytest.mark.parametrize("of", KINDS, ids=repr)
def test_samples_follow_the_distribution(of: Distribution) -> None:
    drawn = of.sample(np.random.default_rng(2), 40_000)
    for v in (0.125, 0.375, 0.625):
        assert abs((drawn < v).mean() - of.mass(0.0, v)[0]) < 0.011  # more than four standard deviations


def test_directions_and_waves_keep_their_error_bounds() -> None:
    random = np.random.default_rng(3)
    angles = np.concatenate([random.uniform(-20, 20, 150), random.uniform(-2e5, 2e5, 100), [0.0, 0.5, -0.5, 1e-9]])
    with mpmath.workdps(40):
        for x, z, j0, j1 in zip(angles, turned(angles), *waves(angles)):
            assert abs(mpmath.expj(mpmath.mpf(x)) - complex(z)) < TURNED
            s = mpmath.mpf(x) if x else mpmath.mpf("1e-30")
            assert abs(mpmath.sin(s) / s - j0) < WAVES
            assert abs((mpmath.sin(s) / s - mpmath.cos(s)) / s - j1) < WAVES


def uniform_sum(weights: list[float], t: float) -> Fraction:
    """P(sum of weights (v - 1/2) < t) for v uniform in [0, 1], exactly (inclusion and exclusion of corners)."""
    sizes = [Fraction(abs(w)) for w in weights]
    n, t = len(sizes), Fraction(t) + sum(sizes) / 2
    total = Fraction(0)
    for corner in product((0, 1), repeat=n):
        rest = t - sum(s for s, c in zip(sizes, corner) if c)
        if rest > 0:
            total += (-1) ** sum(corner) * rest**n
    return total / math.factorial(n) / math.prod(sizes)


def half_space(weights: list[float], t: list[float], tolerance: float, brackets: list[Bracket] | None = None):
    n = len(weights)
    sums = Sums(np.array([weights]), np.full((1, n), 0.5), [brackets or [ONE] * n], np.array([t]))
    found = measures_below(sums, np.array([tolerance]))
    return found.lower[0, 0], found.upper[1, 0]


@pytest.mark.long
@pytest.mark.parametrize("n", [2, 3, 5, 9])
def test_sums_of_uniform_quantities_are_enclosed(n: int) -> None:
    random = np.random.default_rng(n)
    for _ in range(6):
        weights = (random.choice([-1.0, 1.0], n) * 10.0 ** random.uniform(-3, 2, n)).tolist()
        reach = 0.5 * sum(map(abs, weights))
        t = [*(reach * random.uniform(-1.1, 1.1, 3)).tolist(), -0.999 * reach]
        for tolerance, width in ((1e-7, 1e-3), (0.1, 0.3)):  # of few terms the rest of the series is what matters
            lower, upper = half_space(weights, t, tolerance)
            for k, threshold in enumerate(t):
                exact = uniform_sum(weights, threshold)
                assert Fraction(float(lower[k])) <= exact <= Fraction(float(upper[k]))
            assert (upper - lower).max() < width


def test_comparable_quantities_are_enclosed_to_eleven_digits() -> None:
    weights, t = [1.0, -0.7, 0.9, 0.4, 1.3], [-1.5, 0.0, 0.31]
    lower, upper = half_space(weights, t, 1e-12)
    assert (upper - lower).max() < 1e-11
    for k, threshold in enumerate(t):
        assert lower[k] <= float(uniform_sum(weights, threshold)) + 1e-15 and float(lower[k]) > 0.0


def test_sum_of_normal_quantities_is_enclosed() -> None:
    """Cut off at eight sigma: the sum is normal but for 1e-15."""
    wide = Distribution.normal("[-8, 8]", 0, 1).bracket(0.0, 1.0, 2048)
    weights = [16.0, -8.0, 4.0]
    sigma = math.sqrt(sum(w * w for w in weights)) / 16.0
    t = [-4.75 * sigma, -sigma, 0.5 * sigma]
    lower, upper = half_space(weights, t, 1e-13, [wide] * 3)
    for k, z in enumerate((-4.75, -1.0, 0.5)):
        exact = float(mpmath.ncdf(z))
        assert lower[k] - 2e-15 <= exact <= upper[k] + 2e-15
        assert upper[k] - lower[k] < 5e-4 * exact + 1e-11


@pytest.mark.parametrize(
    ("make", "word"),
    [
        (lambda: Distribution.uniform("3"), "3"),
        (lambda: Distribution.normal("[2, 4]", mean=5), "outside"),
        (lambda: Distribution.normal("[2, 4]", sigma=0), "sigma"),
        (lambda: Distribution.beta("[2, 4]", "0.5", 2), "exponents"),
        (lambda: Distribution.histogram([1, 2], [1, 2]), "edges"),
        (lambda: Distribution.histogram([1, 2, 3], [0, 0]), "weights"),
    ],
)
def test_impossible_distributions_are_refused(make, word: str) -> None:  # type: ignore[no-untyped-def]
    with pytest.raises(GeometryError, match=word):
        make()
