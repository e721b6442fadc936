"""Interval arithmetic against exact fractions."""

from __future__ import annotations

import math
from fractions import Fraction


def lies_below(low: float, value: Fraction) -> bool:
    return low == -math.inf or (math.isfinite(low) and Fraction(low) <= value)


def lies_above(high: float, value: Fraction) -> bool:
    return high == math.inf or (math.isfinite(high) and Fraction(high) >= value)


def arithmetic_survey() -> tuple[int, int]:
    """Count the results of + - * / that lose the exact value, and the bounds that are reversed, NaN or infinite."""
    from graphsynth.intervals import Interval

    tiny, huge = 5e-324, 1.7976931348623157e308
    points = (0.0, tiny, -tiny, 2.0**-1022, 1e-200, 0.1, 1.0, 3.0, 1e200, huge, -huge)
    lost = loose = 0
    for x in points:
        for y in points:
            a, b = Interval(x, x), Interval(y, y)
            exact = {"+": Fraction(x) + Fraction(y), "-": Fraction(x) - Fraction(y), "*": Fraction(x) * Fraction(y)}
            found = {"+": a + b, "-": a - b, "*": a * b}
            if y:
                exact["/"], found["/"] = Fraction(x) / Fraction(y), a / b
            for sign, value in exact.items():
                low, high = float(found[sign].lo), float(found[sign].hi)
                lost += not (lies_below(low, value) and lies_above(high, value))
                loose += low > high or math.isnan(low + high) or low == math.inf or high == -math.inf
    return lost, loose
