"""Functions of the time since a node whose roots are events, and one bracketing root finder for all of them."""

import math

from graphsynth.core.compilation import kernel
from graphsynth.systems.tribometer.kernels.plant import NORMAL, STATIC, acceleration, drive, glide, holding, spacing
from graphsynth.systems.tribometer.kernels.runge_kutta import step

RELEASE, HOLDING_RATE, GLIDE, GLIDE_RATE, STEP, STEP_RATE = 0, 1, 2, 3, 4, 5


@kernel
def value(kind, p, s, t, x, v, span, work):
    """Guard ``kind`` at ``span`` after the node ``(t, x, v)``, for the direction ``s``."""
    if kind == RELEASE:
        return s * holding(p, t, span, x)[0] - p[STATIC] * p[NORMAL]
    if kind == HOLDING_RATE:
        return holding(p, t, span, x)[1]
    _, v1, a1, _ = drive(p, t + span)
    if kind == GLIDE:
        return s * (v1 - glide(p, s, x, v, span)[1])
    if kind == GLIDE_RATE:
        return s * (a1 - glide(p, s, x, v, span)[2])
    new = step(p, s, t, x, v, span, 1.0, work)
    if kind == STEP:
        return s * (v1 - new[1])
    return s * (a1 - acceleration(p, s, new[0], new[1], v1)[0])


@kernel
def root(kind, p, s, t, x, v, low, high, work):
    """Root between ``low`` and ``high``, where the guard has different signs, down to rounding.

    The method of [Chandrupatla 1997]; returns the end of the last bracket where the guard is smaller.
    """
    a, b = low, high
    fa, fb = value(kind, p, s, t, x, v, a, work), value(kind, p, s, t, x, v, b, work)
    c, fc, part = a, fa, 0.5
    for _ in range(200):
        limit = 0.25 * spacing(t + b) + 2e-16 * abs(b)
        if fb == 0.0 or abs(b - a) <= 2.0 * limit:
            break
        part = min(max(part, limit / abs(b - a)), 1.0 - limit / abs(b - a))
        new = a + part * (b - a)
        f = value(kind, p, s, t, x, v, new, work)
        if (f > 0.0) == (fa > 0.0):
            c, fc = a, fa
        else:
            c, fc, b, fb = b, fb, a, fa
        a, fa = new, f
        xi, phi = (a - b) / (c - b), (fa - fb) / (fc - fb)
        if phi * phi < xi and (1.0 - phi) ** 2 < 1.0 - xi:
            part = fa / (fb - fa) * fc / (fb - fc) + (c - a) / (b - a) * fa / (fc - fa) * fb / (fc - fb)
        else:
            part = 0.5
        if fa == 0.0:
            return a
    return a if abs(fa) < abs(fb) else b


@kernel
def crossing(kind, rate, p, s, t, x, v, low, high, before, after, slope_before, slope_after, work):
    """First downward crossing of a guard in ``[low, high]``; NaN if there is none.

    ``before`` and ``after`` are the values, ``slope_before`` and ``slope_after`` the rates at the ends; the guard is
    taken to have at most one extremum between them.  A guard that starts at zero has to rise first.
    """
    if before > 0.0 and after <= 0.0:
        return root(kind, p, s, t, x, v, low, high, work)
    if before > 0.0:
        if slope_before < 0.0 and slope_after > 0.0:
            turn = root(rate, p, s, t, x, v, low, high, work)
            if value(kind, p, s, t, x, v, turn, work) <= 0.0:
                return root(kind, p, s, t, x, v, low, turn, work)
        return math.nan
    return math.nan
