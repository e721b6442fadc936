"""Random bounds that hit every branch: ordinary, integer, extreme and special numbers."""

import numpy as np

SPECIAL = np.array([
    0.0, -0.0, 1.0, -1.0, np.inf, -np.inf, 5e-324, -5e-324, 2.0**-1022, -(2.0**-1022), 1.7976931348623157e308,
    -1.7976931348623157e308, 1e300, 1e-300, 2.0**500, 2.0**-500, 3.0, 1 / 3, 2.0**-480, 1e160, -1e-160, 2.0**-960,
])  # fmt: skip


def numbers(rng, count):
    ordinary = rng.normal(size=count) * 2.0 ** rng.integers(-3, 4, count)
    extreme = np.ldexp(rng.uniform(-1.0, 1.0, count), rng.integers(-1074, 1025, count))
    special = rng.choice(SPECIAL, count)
    whole = rng.integers(-5, 6, count).astype(float)
    return np.choose(rng.integers(0, 4, count), [ordinary, extreme, special, whole])


def bounds(rng, count, empty=0.02):
    """Valid bounds, some of them points, half lines, lines, and empty."""
    a, b = numbers(rng, count), numbers(rng, count)
    b = np.where(rng.random(count) < 0.2, a, b)
    lo, hi = np.minimum(a, b), np.maximum(a, b)
    lo = np.where(lo == np.inf, 1.0, lo)
    hi = np.maximum(lo, np.where(hi == -np.inf, -1e9, hi))
    none = rng.random(count) < empty
    return np.where(none, np.inf, lo), np.where(none, -np.inf, hi)
