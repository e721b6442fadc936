"""Coefficients against quadrature and closed forms; every motion of a curve leaves its distances alone."""

import itertools
import math

import numpy as np
import pytest
from hypothesis import given, strategies as st

from graphsynth.design.curves import fourier

HARMONICS = 12


def polygon(seed: int, corners: int, closed: bool) -> np.ndarray:
    """A random polygon, every third one nearly symmetric."""
    random = np.random.default_rng(seed)
    z = random.normal(size=corners) + 1j * random.normal(size=corners)
    if seed % 3 == 0:
        z = np.exp(2j * math.pi * np.arange(corners) / corners) + 1e-7 * z
    return np.append(z, z[0]) if closed else z


def unit_of(z: np.ndarray, closed: bool) -> np.ndarray:
    return fourier.unit(fourier.coefficients(z[None], np.array([closed]), HARMONICS))[0]


def moved(z: np.ndarray, closed: bool, seed: int) -> np.ndarray:
    """The same curve: elsewhere, larger, turned, reflected, run from another corner and the other way."""
    random = np.random.default_rng([seed, 1])
    if closed:
        z = np.roll(z[:-1], int(random.integers(len(z) - 1)))
        z = np.append(z, z[0])
    z = z[::-1] if random.random() < 0.5 else z
    z = np.conj(z) if random.random() < 0.5 else z
    return np.exp(random.uniform(-5.0, 5.0) + 1j * random.uniform(0.0, 7.0)) * z + complex(*random.normal(size=2))


@pytest.mark.parametrize("closed", [True, False])
def test_coefficients_are_those_of_the_polygon_over_its_arc_length(closed: bool) -> None:
    z = polygon(4, 7, closed)
    at = np.concatenate([[0.0], np.cumsum(np.abs(np.diff(z)))])
    # midpoint rule on every side, there and back where the curve is open
    s = np.concatenate([np.linspace(a, b, 20001)[:-1] + (b - a) / 40000 for a, b in itertools.pairwise(at)])
    weight = np.repeat(np.diff(at) / 20000, 20000)
    values = np.interp(s, at, z.real) + 1j * np.interp(s, at, z.imag)
    period = at[-1]
    if not closed:
        s, values, weight = np.append(s, 2 * period - s), np.append(values, values), np.append(weight, weight)
        period *= 2
    found = fourier.coefficients(z[None], np.array([closed]), HARMONICS)[0]
    for k, own in zip(fourier.orders(HARMONICS), found):
        wanted = (values * np.exp(-2j * math.pi * k * s / period) * weight).sum() / period
        assert abs(own - wanted) < 1e-8


def test_a_regular_polygon_has_the_coefficients_of_its_symmetry() -> None:
    n = 7
    z = np.exp(2j * math.pi * np.arange(n + 1) / n)
    found = fourier.coefficients(z[None], np.array([True]), HARMONICS)[0]
    for k, own in zip(fourier.orders(HARMONICS), found):
        # (sin(pi/n) / (pi/n))^2 for k = 1, over k^2 for k = 1 modulo n, else 0
        wanted = (math.sin(math.pi / n) * n / math.pi / k) ** 2 if k % n == 1 else 0.0
        assert abs(own - wanted) < 1e-14


def test_repeated_points_count_for_nothing_and_a_point_has_no_curve() -> None:
    z = polygon(5, 6, True)
    padded = np.append(z, [z[-1]] * 9)
    both = fourier.coefficients(np.stack([padded, np.ones_like(padded)]), np.array([True, True]), HARMONICS)
    plain = fourier.coefficients(z[None], np.array([True]), HARMONICS)[0]
    assert np.abs(both[0] - plain).max() < 1e-15 and not both[1].any()


@pytest.mark.long
@given(st.integers(0, 10**6), st.integers(3, 40), st.booleans())
def test_no_motion_changes_sizes_or_distances(seed: int, corners: int, closed: bool) -> None:
    z = polygon(seed, corners, closed)
    own, other = unit_of(z, closed), unit_of(moved(z, closed, seed), closed)
    sizes = [fourier.magnitudes(part, 8) for part in (own, own[::-1])]
    assert min(np.abs(fourier.magnitudes(other, 8) - part).max() for part in sizes) < 1e-9
    third = unit_of(polygon(seed + 1, 9, closed), closed)
    assert abs(fourier.aligned(third, own, closed).error - fourier.aligned(third, other, closed).error) < 1e-9
    assert fourier.aligned(own, other, closed).error < 1e-9


@given(st.integers(0, 10**6), st.booleans())
def test_sizes_are_never_farther_apart_than_the_curves(seed: int, closed: bool) -> None:
    one, two = (unit_of(polygon(seed + k, 5 + seed % 17 + k, closed), closed) for k in (0, 1))
    error = fourier.aligned(one, two, closed).error
    # the best size of the second curve is below 1: at size 1 it is as far as 2 sin of half the angle
    apart = 2.0 * math.sin(0.5 * math.asin(min(1.0, error)))
    bound = min(np.linalg.norm(np.abs(one) - np.abs(part)) for part in (two, two[::-1]))
    assert bound <= apart + 1e-9


@pytest.mark.long
@pytest.mark.parametrize("seed", range(12))
def test_alignment_is_the_best_of_a_dense_search(seed: int) -> None:
    one, two = (unit_of(polygon(3 * seed + k, 9, True), True) for k in (1, 2))
    k = fourier.orders(HARMONICS)
    shifts = np.exp(2j * math.pi * np.linspace(0.0, 1.0, 20001)[:, None] * k)
    rho = max(
        np.abs((np.conj(fourier.variant(two, mirror, back)) * np.conj(shifts)) @ one).max()
        for mirror in (False, True)
        for back in (False, True)
    )
    fit = fourier.aligned(one, two, True)
    assert math.sqrt(1.0 - rho**2) - 1e-5 <= fit.error <= math.sqrt(1.0 - rho**2) + 1e-12
    placed = fit.factor * fourier.variant(two, fit.reflected, fit.backwards) * np.exp(2j * math.pi * k * fit.shift)
    assert abs(np.linalg.norm(one - placed) - fit.error) < 1e-12
    # in one go, for many curves, in single precision
    rough = fourier.distances(one.astype(np.complex64), np.stack([two, one]).astype(np.complex64), True)
    assert abs(rough[0] - fit.error) < 0.01 and rough[1] < 2e-3


@pytest.mark.parametrize("closed", [True, False])
def test_samples_half_way_are_those_of_cubics(closed: bool) -> None:
    counts = np.array([9, 13])
    rows, finer = np.zeros((2, 13), dtype=complex), []
    for row, count in zip(rows, counts):
        u = np.linspace(0.0, 1.0, 2 * count - 1)
        # a cubic is met exactly; of a wave of period 1 sampled n times, to its cubic's error
        z = np.exp(2j * math.pi * u) if closed else (2.0 - 1j) * u**3 - 3j * u**2 + u
        row[:count], row[count:] = z[::2], z[-1]
        finer.append(z)
    found = fourier.halved(rows, np.array([closed] * 2), counts)
    for own, z, count in zip(found, finer, counts):
        h = 2.0 * math.pi / (count - 1)
        bound = abs((9.0 * math.cos(h / 2) - math.cos(1.5 * h)) / 8.0 - 1.0) * (1.0 + 1e-9) if closed else 1e-14
        assert np.abs(own[: 2 * count - 1] - z).max() <= bound
        assert (own[2 * count - 1 :] == z[-1]).all()


@pytest.mark.parametrize("closed", [True, False])
def test_uniform_samples_of_a_sum_of_waves_give_its_terms(closed: bool) -> None:
    random = np.random.default_rng(7)
    wanted = random.normal(size=9) + 1j * random.normal(size=9)
    if not closed:
        wanted = wanted + wanted[::-1]
    counts = np.array([21, 33])
    rows = np.zeros((2, 40), dtype=complex)
    for row, count in zip(rows, counts):
        u = np.arange(count) / (count - 1) * (1.0 if closed else 0.5)
        row[:count] = sum(own * np.exp(2j * math.pi * k * u) for k, own in zip(range(-4, 5), wanted))
        row[count:] = 99.0
    found = fourier.uniform(rows, np.array([closed] * 2), counts, 4)
    assert np.abs(found - wanted).max() < 1e-13
