"""Elementary functions of kernels: within their bounds of 50-digit values, and as C for special arguments."""

from __future__ import annotations

import math
from typing import Any

import mpmath
import numpy as np
import pytest
from hypothesis import given, strategies

from graphsynth.intervals.kernels import nearest

#: In units in the last place; of the hypotenuse in parts of the result.
BOUND = {"sin": 0.501, "cos": 0.501, "atan2": 0.501, "hypot": 2.0**-52 * (1.0 + 2.0**-50)}
SPECIAL = [0.0, -0.0, 1.0, -1.0, math.inf, -math.inf, math.nan, 5e-324, -5e-324, 1.8e308 / 2, 2.0**-1022, 1e-300, 1e300]


def errors(name: str, *columns: Any) -> np.ndarray:
    """Errors of results, in the units of their bound."""
    function, exact = getattr(nearest, name), getattr(mpmath, name)
    found = []
    with mpmath.workprec(1300):
        for args in zip(*(column.tolist() for column in columns), strict=True):
            value = exact(*map(mpmath.mpf, args))
            with mpmath.workprec(200):
                unit = value if name == "hypot" else math.ulp(float(value))
                found.append(float(abs((function(*args) - value) / unit)))
    return np.array(found)


def sines(rng: np.random.Generator, count: int) -> np.ndarray:
    """Numbers of all sizes, and numbers next to multiples of pi/2."""
    usual = rng.uniform(-20.0, 20.0, count)
    wide = rng.choice([-1.0, 1.0], count) * 2.0 ** rng.uniform(-60.0, 60.0, count)
    roots = rng.integers(1, 2000, count) * math.pi / 2.0
    return np.concatenate([usual, wide, roots, np.nextafter(roots, 0.0), [1e300, -1e22, 2.0**-26, 11999.9, 12000.1]])


def vectors(rng: np.random.Generator, count: int) -> tuple[np.ndarray, np.ndarray]:
    """Coordinates of like and of very different sizes."""
    x, y = rng.standard_normal((2, count)) * 2.0 ** rng.uniform(-8.0, 8.0, (2, count))
    u, v = rng.choice([-1.0, 1.0], (2, count)) * 2.0 ** rng.uniform(-60.0, 60.0, (2, count))
    scale = 2.0 ** rng.integers(-900, 900, count)
    return np.concatenate([x, u, x * scale]), np.concatenate([y, v, y * scale])


@pytest.mark.parametrize("name", ["sin", "cos"])
def test_sine_and_cosine_are_within_their_bound(name: str) -> None:
    assert errors(name, sines(np.random.default_rng(3), 150)).max() < BOUND[name]


@pytest.mark.parametrize("name", ["atan2", "hypot"])
def test_angle_and_length_are_within_their_bound(name: str) -> None:
    assert errors(name, *vectors(np.random.default_rng(4), 150)).max() < BOUND[name]


@pytest.mark.slow
@pytest.mark.parametrize("name", list(BOUND))
def test_many_arguments_are_within_the_bound(name: str) -> None:
    rng = np.random.default_rng(5)
    columns = (sines(rng, 20_000),) if name in ("sin", "cos") else vectors(rng, 25_000)
    assert errors(name, *columns).max() < BOUND[name]


def same(found: float, wanted: float) -> bool:
    return (
        math.isnan(found)
        if math.isnan(wanted)
        else (found, math.copysign(1, found)) == (wanted, math.copysign(1, wanted))
    )


@pytest.mark.parametrize("y", SPECIAL)
def test_special_vectors_give_what_c_gives(y: float) -> None:
    for x in SPECIAL:
        for ours, theirs in ((nearest.atan2, math.atan2), (nearest.hypot, math.hypot)):
            found, wanted = ours(y, x), theirs(y, x)
            ordinary = all(map(math.isfinite, (x, y))) and wanted not in (0.0, math.inf)
            assert (abs(found - wanted) <= math.ulp(wanted)) if ordinary else same(found, wanted)


def test_special_numbers_give_what_c_gives() -> None:
    for x in (0.0, -0.0, 5e-324, -1e-310):
        assert same(nearest.sin(x), x) and nearest.cos(x) == 1.0
    for x in (math.inf, -math.inf, math.nan):
        assert math.isnan(nearest.sin(x)) and math.isnan(nearest.cos(x))


@given(strategies.floats(allow_nan=False, allow_infinity=False), strategies.floats(-1e6, 1e6))
def test_symmetries_hold_to_the_bit(x: float, y: float) -> None:
    assert nearest.sin(-x) == -nearest.sin(x) and nearest.cos(-x) == nearest.cos(x)
    assert same(nearest.atan2(-y, x), -nearest.atan2(y, x))
    assert nearest.hypot(x, y) == nearest.hypot(-y, x)
