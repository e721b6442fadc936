"""Dry friction at one state: force of a unit load, loads from multipliers, loads that fit their friction."""

import math

import numpy as np

from graphsynth.core.compilation import kernel
from graphsynth.dynamics.kernels.linear import factorise, substitute
from graphsynth.dynamics.kernels.systems import pull, twist

#: Columns of the table of friction; the sense is +1 or -1 (sliding), 0 (sticking, no force here), `BY_SPEED`.
KINETIC, STATIC, STRIBECK, REGULAR, RADIUS, LENGTH, SENSE = 0, 1, 2, 3, 4, 5, 6
BY_SPEED = 2.0
#: Rounds of Newton's method for the loads, and the residual that counts as none.
ROUNDS, SOLVED = 60, 1e-14


@kernel
def friction_factor(p, speed):
    """Friction coefficient with the sign of the sliding speed (of the given sense, if there is one)."""
    fall = math.exp(-((speed / p[STRIBECK]) ** 2)) if p[STRIBECK] > 0.0 else 0.0
    mu = p[KINETIC] + (p[STATIC] - p[KINETIC]) * fall
    if p[REGULAR] > 0.0:
        return mu * math.tanh(speed / p[REGULAR])
    if p[SENSE] != BY_SPEED:
        return mu * p[SENSE]
    return mu if speed > 0.0 else (-mu if speed < 0.0 else 0.0)


@kernel
def friction_unit(T, x, J, f, Q):
    """Add the friction of element ``f`` under a load of 1 N to Q; returns its power."""
    r, kind, a, b = T.friction[f, 0], T.friction[f, 1], T.friction[f, 2], T.friction[f, 3]
    p = T.friction_table[f]
    if kind == 2:
        return twist(T, Q, x, a, b, -friction_factor(p, p[RADIUS] * (x[b, 7] - x[a, 7])) * p[RADIUS])
    # the direction of the guide from the normal in the row's gradient
    kb, ka = T.column[b], T.column[a]
    nx, ny = (J[r, kb], J[r, kb + 1]) if kb >= 0 else (-J[r, ka], -J[r, ka + 1])
    tx, ty = ny, -nx
    px, py = T.table[r, 2], T.table[r, 3]
    wx, wy = x[b, 2] * px - x[b, 3] * py, x[b, 3] * px + x[b, 2] * py
    ax, ay = x[b, 0] + wx - x[a, 0], x[b, 1] + wy - x[a, 1]
    vx = x[b, 5] - x[b, 7] * wy - x[a, 5] + x[a, 7] * ay
    vy = x[b, 6] + x[b, 7] * wx - x[a, 6] - x[a, 7] * ax
    speed = tx * vx + ty * vy
    mu = friction_factor(p, speed)
    return pull(T, Q, x, b, wx, wy, -mu * tx, -mu * ty) + pull(T, Q, x, a, ax, ay, mu * tx, mu * ty)


@kernel
def friction_load(T, f, lam):
    """Load on the sliding surfaces of element ``f``, N: the pin force; the normal forces at both ends of a shoe."""
    r, length = T.friction[f, 0], T.friction_table[f, LENGTH]
    if T.friction[f, 1] == 2:
        return math.hypot(lam[r], lam[r + 1])
    return max(abs(lam[r]), 2.0 * abs(lam[r + 1]) / length) if length > 0.0 else abs(lam[r])


@kernel
def friction_loads(T, x, J, lam, Q):
    """Add friction forces for multipliers ``lam``; returns their power."""
    P, unit = 0.0, np.empty(Q.shape[0])
    for f in range(T.friction.shape[0]):
        unit[:] = 0.0
        power, load = friction_unit(T, x, J, f, unit), friction_load(T, f, lam)
        P += load * power
        for i in range(Q.shape[0]):
            Q[i] += load * unit[i]
    return P


@kernel
def load_slope(T, f, lam, part):
    """Return the derivative of the load of element ``f`` when the multipliers change along ``part``."""
    r, length = T.friction[f, 0], T.friction_table[f, LENGTH]
    if T.friction[f, 1] == 2:
        size = math.hypot(lam[r], lam[r + 1])
        return (lam[r] * part[r] + lam[r + 1] * part[r + 1]) / size if size > 0.0 else 0.0
    if length > 0.0 and 2.0 * abs(lam[r + 1]) > length * abs(lam[r]):
        return math.copysign(2.0 / length, lam[r + 1]) * part[r + 1]
    return math.copysign(1.0, lam[r]) * part[r]


@kernel
def return_factor(T, parts):
    """Bound of the spectral radius of how much the loads change with the loads; below 1 they are unique."""
    count = T.friction.shape[0]
    K, total = np.empty((count, count)), 0.0
    for f in range(count):
        for g in range(count):
            K[f, g] = friction_load(T, f, parts[g])
    scale = 1.0
    for power in range(5):  # the largest row sum of K^16, and its 16th root
        total = 0.0
        for f in range(count):
            row = 0.0
            for g in range(count):
                row += K[f, g]
            total = max(total, row)
        if power == 4 or not total > 0.0:
            break
        scale = scale * total ** (0.5**power)
        square = np.zeros((count, count))
        for f in range(count):
            for g in range(count):
                for h in range(count):
                    square[f, g] += K[f, h] * K[h, g] / total**2
        K = square
    return scale * total ** (1.0 / 16.0)


@kernel
def slide_loads(T, lam, parts):
    """Find loads x with ``x = load(lam + x parts)`` by Newton's method; factor of their return, rounds (-1: not found).

    The loads are piecewise linear in guides and smooth in pins, so few rounds are enough; should Newton's method go in
    circles, plain substitution takes every second round.
    """
    count = T.friction.shape[0]
    now, x, short = np.empty(lam.shape[0]), np.empty(count), np.empty(count)
    G, order = np.empty((count, count)), np.empty(count, np.int64)
    for f in range(count):
        x[f] = friction_load(T, f, lam)
    factor = return_factor(T, parts)
    for step in range(ROUNDS):
        for k in range(lam.shape[0]):
            now[k] = lam[k]
            for f in range(count):
                now[k] += x[f] * parts[f, k]
        worst, size = 0.0, 0.0
        for f in range(count):
            load = friction_load(T, f, now)
            short[f] = load - x[f]
            worst, size = max(worst, abs(load - x[f])), max(size, load, friction_load(T, f, lam))
            for g in range(count):
                G[f, g] = (1.0 if f == g else 0.0) - load_slope(T, f, now, parts[g])
        if worst <= (SOLVED if step < 6 else 1e2 * SOLVED) * size:
            good = True
            for f in range(count):
                good = good and x[f] >= -SOLVED * size
            return x, factor, float(step) if good else -1.0
        if not worst < math.inf:
            break
        if step < 8 or step % 2 == 0:
            if not factorise(G, order):
                break
            substitute(G, order, short)
        for f in range(count):
            x[f] += short[f]
    return x, factor, -1.0
