"""Drive, friction law and closed-form pieces of the stick-slip model.

Data of a model are one flat array; the constants name its entries.
"""

import math

import numpy as np

from graphsynth.core.compilation import kernel

MASS, STIFFNESS, DAMPING, NORMAL = 0, 1, 2, 3
STATIC, KINETIC, STRIBECK, EXPONENT, VISCOUS, LAW = 4, 5, 6, 7, 8, 9
DRIVE, RADIUS, ROD, SPEED = 10, 11, 12, 13
SIZE = 14
TWO_COEFFICIENTS, STRIBECK_LAW = 0.0, 1.0
BELT, HARMONIC, CRANK = 0.0, 1.0, 2.0


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
