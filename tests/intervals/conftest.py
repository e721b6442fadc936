"""Lets the tests of this folder import their sampler by name; compiles kernels before any test is timed."""

import sys
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parent))


@pytest.fixture(scope="session", autouse=True)
def compiled():
    """Load every kernel once, so that no single example pays for it."""
    from graphsynth import intervals

    x = intervals.Interval(0.5, 0.75)
    for name in ("sin", "cos", "tan", "atan", "asin", "acos", "exp", "log"):
        getattr(intervals, name)(x)
    intervals.atan2(x, x)
    intervals.hypot(x, x)
