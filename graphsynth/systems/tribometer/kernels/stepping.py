"""Time stepping with complementarity, and the right-hand side of the regularised form."""

import math

from graphsynth.core.compilation import kernel
from graphsynth.systems.tribometer.kernels.plant import (
    DAMPING,
    EXPONENT,
    KINETIC,
    LAW,
    MASS,
    NORMAL,
    STATIC,
    STIFFNESS,
    STRIBECK,
    STRIBECK_LAW,
    VISCOUS,
    coefficient,
    drive,
)


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
