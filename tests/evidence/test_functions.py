"""Error against run time of interval functions: every enclosure holds 50 digits, a wrong one is found."""

import math

import numpy as np

from graphsynth.evidence import Effort, functions
from graphsynth.intervals import sin

QUICK = Effort(rounds=1, quick=True)


def test_enclosures_hold_50_digits_and_arrays_are_as_narrow_as_doubles_allow():
    rows = functions.interval_functions(None, QUICK).rows
    assert all(row.good and row.proved for row in rows)
    assert all(row.error <= 2.0**-52 for row in rows if row.method != "python-flint, 53 bits")
    assert set(rows[0].more) == {f"{name}, ns" for name in ("sin", "cos", "exp", "log", "atan")}


def test_a_function_that_misses_is_a_failure(monkeypatch):
    monkeypatch.setitem(functions.FUNCTIONS, "sin", lambda x: sin(x) + 1e-9)
    rows = functions.interval_functions(None, QUICK).rows
    assert math.isnan(rows[-1].error) and rows[-1].reason == "a value in 50 digits lies outside"
    assert np.isfinite(next(row.error for row in rows if "flint" in row.method))
