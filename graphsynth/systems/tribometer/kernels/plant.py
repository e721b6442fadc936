"""Drive, friction law and pieces of the stick-slip model; guards and their roots; time stepping, regularised form.

Data of a model are one flat array; the constants name its entries.
"""

import math

import numpy as np
from scipy.integrate import DOP853

from graphsynth.core.compilation import kernel

MASS, STIFFNESS, DAMPING, NORMAL = 0, 1, 2, 3
STATIC, KINETIC, STRIBECK, EXPONENT, VISCOUS, LAW = 4, 5, 6, 7, 8, 9
DRIVE, RADIUS, ROD, SPEED = 10, 11, 12, 13
TWO_COEFFICIENTS, STRIBECK_LAW = 0.0, 1.0
BELT, HARMONIC, CRANK = 0.0, 1.0, 2.0
#: Guards: functions of the time since a node whose roots are events, each followed by its rate.
RELEASE, HOLDING_RATE, GLIDE, GLIDE_RATE, STEP, STEP_RATE = 0, 1, 2, 3, 4, 5
#: The method of Dormand and Prince of order 8.
STAGES = 12
NODES, WEIGHTS = DOP853.C[:STAGES].copy(), DOP853.B.copy()
MATRIX = np.ascontiguousarray(DOP853.A[:STAGES, :STAGES])
E3, E5 = DOP853.E3[:STAGES].copy(), DOP853.E5[:STAGES].copy()


@kernel
def drive(p, t):
    """Displacement, velocity, acceleration and jerk of the lower platform."""
    w = p[SPEED]
    if p[DRIVE] == BELT:
        return w * t, w, 0.0, 0.0
    r, C, S = p[RADIUS], math.cos(w * t), math.sin(w * t)
    if p[DRIVE] == HARMONIC:
        return r * C, -r * w * S, -r * w * w * C, r * w * w * w * S
    rod = p[ROD]
    gap = (rod - r) * (rod + r)
    square = gap + (r * C) ** 2  # nothing cancels where the crank stands across a rod hardly longer than itself
    q = math.sqrt(square)
    a = r * r * S * C / q
    x = r * C - (r * S) ** 2 / (q + rod)
    first = -r * S - a
    second = -r * C + r * r * (gap * S * S / square - C * C) / q
    third = r * S + a * (1.0 + 3.0 * gap * rod * rod / (square * square))
    return x, w * first, w * w * second, w * w * w * third


@kernel
def shift(p, start, span):
    """Displacement of the lower platform from ``start`` to ``start + span``, without cancellation."""
    w = p[SPEED]
    if p[DRIVE] == BELT:
        return w * span
    half = 0.5 * w * span
    middle = w * start + half
    r, s = p[RADIUS], math.sin(half)
    cosine = -2.0 * r * math.sin(middle) * s
    if p[DRIVE] == HARMONIC:
        return cosine
    gap, before, after = (p[ROD] - r) * (p[ROD] + r), r * math.cos(w * start), r * math.cos(w * (start + span))
    q0, q1 = math.sqrt(gap + before * before), math.sqrt(gap + after * after)
    return cosine - r * r * math.sin(2.0 * middle) * math.sin(2.0 * half) / (q0 + q1)


@kernel
def coefficient(p, v):
    """Friction coefficient while slipping at the speed ``v``; continued smoothly past ``v = 0`` where it can be."""
    mu = p[KINETIC] + p[VISCOUS] * v
    if p[LAW] == STRIBECK_LAW:
        z, d = v / p[STRIBECK], p[EXPONENT]
        power = z * z if d == 2.0 else z if d == 1.0 else abs(z) ** d
        mu += (p[STATIC] - p[KINETIC]) * math.exp(-power)
    return mu


@kernel
def acceleration(p, s, x, v, v1):
    """Acceleration of the upper platform that slips in direction ``s``, and the friction force."""
    force = s * p[NORMAL] * coefficient(p, s * (v1 - v))
    return (force - p[STIFFNESS] * x - p[DAMPING] * v) / p[MASS], force


@kernel
def holding(p, t, span, x):
    """Force that keeps the platform stuck at ``t + span`` (stuck at ``x`` since ``t``), and its rate."""
    _, v1, a1, j1 = drive(p, t + span)
    force = p[MASS] * a1 + p[STIFFNESS] * (x + shift(p, t, span)) + p[DAMPING] * v1
    return force, p[MASS] * j1 + p[STIFFNESS] * v1 + p[DAMPING] * a1


@kernel
def glide(p, s, x, v, span):
    """Position, velocity, acceleration after ``span`` of slip under the constant force ``s N muk``: closed form."""
    m, k, half = p[MASS], p[STIFFNESS], 0.5 * p[DAMPING] / p[MASS]
    rest = s * p[KINETIC] * p[NORMAL] / k
    y, square = x - rest, k / m
    gap = (math.sqrt(square) - half) * (math.sqrt(square) + half)
    if gap >= 0.0:
        w = math.sqrt(gap)
        fade = math.exp(-half * span)
        C = fade * math.cos(w * span)
        S = fade * (math.sin(w * span) / w if w * span > 1e-150 else span)
    else:
        w = math.sqrt(-gap)
        slow, fast = square / (half + w), half + w
        decay = math.exp(-slow * span)
        S = -decay * math.expm1(-2.0 * w * span) / (2.0 * w)
        C = 0.5 * (decay + math.exp(-fast * span))
    new = y * C + (v + half * y) * S
    speed = v * C - (half * v + square * y) * S
    return rest + new, speed, -(square * new + 2.0 * half * speed)


@kernel
def parameters_are_closed(p):
    """Whether slip pieces have a closed form: constant friction force."""
    return p[LAW] == TWO_COEFFICIENTS and p[VISCOUS] == 0.0


@kernel
def spacing(t):
    """Distance of ``t`` to the next number."""
    return np.spacing(abs(t))


@kernel
def step(p, s, t, x, v, h, tolerance, work):
    """One step ``h``: position, velocity, work of the drive, friction loss, damper loss, error (<= 1 passes).

    ``work`` has shape (2, 12).  The three energies are quadratures with the weights of the step.
    """
    driven = heat = damped = 0.0
    for i in range(STAGES):
        dx = dv = 0.0
        for j in range(i):
            dx += MATRIX[i, j] * work[0, j]
            dv += MATRIX[i, j] * work[1, j]
        vi = v + h * dv
        v1 = drive(p, t + NODES[i] * h)[1]
        a, force = acceleration(p, s, x + h * dx, vi, v1)
        work[0, i], work[1, i] = vi, a
        driven += WEIGHTS[i] * force * v1
        heat += WEIGHTS[i] * force * (v1 - vi)
        damped += WEIGHTS[i] * p[DAMPING] * vi * vi
    dx = dv = three = five = 0.0
    for i in range(STAGES):
        dx += WEIGHTS[i] * work[0, i]
        dv += WEIGHTS[i] * work[1, i]
    span = p[STATIC] * p[NORMAL] / p[STIFFNESS]
    scales = (max(abs(x), abs(span)), max(abs(v), abs(v + h * dv), abs(span) * math.sqrt(p[STIFFNESS] / p[MASS])))
    for row in range(2):
        e3 = e5 = 0.0
        for i in range(STAGES):
            e3 += E3[i] * work[row, i]
            e5 += E5[i] * work[row, i]
        three += (e3 / scales[row]) ** 2
        five += (e5 / scales[row]) ** 2
    error = 0.0
    if not five + three < math.inf:
        error = math.inf
    elif five > 0.0 or three > 0.0:
        error = abs(h) * five / math.sqrt((five + 0.01 * three) * 2.0) / tolerance
    return x + h * dx, v + h * dv, h * driven, h * heat, h * damped, error


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
def crossing(kind, p, s, t, x, v, low, high, ends, work):
    """First downward crossing of a guard in ``[low, high]``; NaN if there is none.

    ``ends`` are the values at both ends, then the rates there; the guard is taken to have at most one extremum between
    them.  A guard that starts at zero has to rise first.
    """
    before, after, slope_before, slope_after = ends
    if before > 0.0 and after <= 0.0:
        return root(kind, p, s, t, x, v, low, high, work)
    if before > 0.0 and slope_before < 0.0 and slope_after > 0.0:
        turn = root(kind + 1, p, s, t, x, v, low, high, work)
        if value(kind, p, s, t, x, v, turn, work) <= 0.0:
            return root(kind, p, s, t, x, v, low, turn, work)
    return math.nan


@kernel
def march(p, x, v, h, weight, path, energies):
    """Fill ``path`` (position, velocity, state, friction force) from the start ``(x, v)`` with steps ``h``.

    Returns the number of steps whose numbers stayed finite.  ``energies`` are the sums of the work of the drive, the
    friction loss and the damper loss.
    """
    m, k, c, N = p[MASS], p[STIFFNESS], p[DAMPING], p[NORMAL]
    A = m + h * weight * c + (h * weight) ** 2 * k
    for i in range(path.shape[0] - 1):
        v1 = drive(p, (i + 1) * h)[1]
        beta = m * v - h * k * (x + h * weight * (1.0 - weight) * v) - h * (1.0 - weight) * c * v
        impulse = A * v1 - beta
        state = 0.0
        new = v1
        if abs(impulse) > h * p[STATIC] * N:
            s = 1.0 if impulse > 0.0 else -1.0
            slip = s * h * N * coefficient(p, abs(v1 - v))
            trial = (beta + slip) / A
            if s * (v1 - trial) >= 0.0:
                new, impulse, state = trial, slip, s
        mean = weight * new + (1.0 - weight) * v
        x, v = x + h * mean, new
        if not abs(x) + abs(v) < math.inf:
            return i
        path[i + 1, 0], path[i + 1, 1], path[i + 1, 2], path[i + 1, 3] = x, v, state, impulse / h
        energies[0] += impulse * v1
        energies[1] += impulse * (v1 - v)
        energies[2] += h * c * mean * mean
    return path.shape[0] - 1


@kernel
def regularised(t, y, p, speed, out):
    """Right-hand side of the form regularised with ``speed``: rates of position and velocity into ``out``."""
    u = drive(p, t)[1] - y[1]
    force = p[NORMAL] * coefficient(p, abs(u)) * math.tanh(u / speed)
    out[0] = y[1]
    out[1] = (force - p[STIFFNESS] * y[0] - p[DAMPING] * y[1]) / p[MASS]
    return force


@kernel
def regularised_slope(t, y, p, speed):
    """Return the derivative of the regularised friction force by the sliding velocity."""
    u = drive(p, t)[1] - y[1]
    v, step = abs(u), math.tanh(u / speed)
    fall = 0.0
    if p[LAW] == STRIBECK_LAW:
        z, d = v / p[STRIBECK], p[EXPONENT]
        fall = -(p[STATIC] - p[KINETIC]) * math.exp(-(z**d)) * d * z ** (d - 1.0) / p[STRIBECK]
    slope = fall + p[VISCOUS]
    return p[NORMAL] * (slope * abs(step) + coefficient(p, v) * (1.0 - step * step) / speed)
