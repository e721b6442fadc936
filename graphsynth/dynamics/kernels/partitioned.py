"""The partitioned form: dependent coordinates by Newton's method, accelerations in the velocity map, rates."""

import math

import numpy as np

from graphsynth.core.compilation import kernel
from graphsynth.dynamics.kernels.rubbing import friction_loads
from graphsynth.dynamics.kernels.solving import accelerate, back_lower, factor_rows, forth_lower, least_step
from graphsynth.dynamics.kernels.systems import combined, constraint_system, finish, load_vector, state_rows
from graphsynth.kinematics.engine.codes import DRIVE_ANGLE, DRIVE_SLIDE

ROUNDS = 12


@kernel
def extended(J, chosen):
    """Constraint rows and, below them, one row for every chosen coordinate."""
    m, n = J.shape
    found = np.zeros((m + chosen.shape[0], n))
    for k in range(m):
        for i in range(n):
            found[k, i] = J[k, i]
    for k in range(chosen.shape[0]):
        found[m + k, chosen[k]] = 1.0
    return found


@kernel
def place_partitioned(T, y, chosen, near, metric, phi, qd):
    """Coordinates and velocities of a state (z, dz/dt, work), by Newton's method from ``near``; smallest pivot.

    The pivot is -1, and the coordinates are NaN, where that does not converge.  ``metric`` is diagonal: one over the
    unit of every coordinate.
    """
    n, c, flat = near.shape[0], chosen.shape[0], metric.shape[0] > 0  # a literal flag would make copies of kernels
    q, v, last, settled = near.copy(), np.zeros(near.shape[0]), math.inf, False
    for _ in range(ROUNDS + 1):
        C, J, _, vel = constraint_system(T, state_rows(T, q, v), phi, qd)
        m = C.shape[0]
        B, R, order, length, rank = factor_rows(metric, flat, extended(J, chosen))
        d = np.empty(m + c)
        for k in range(m):
            d[k] = vel[k] if settled else -C[k]
        for k in range(c):
            d[m + k] = y[c + k] if settled else y[k] - q[chosen[k]]
        step, _ = least_step(metric, flat, B, R, order, length, rank, d)
        if settled:
            pivot = math.inf if rank == n else 0.0
            for k in range(rank):
                pivot = min(pivot, abs(R[k]))
            return q, step, pivot
        size = 0.0
        for i in range(n):
            size = max(size, abs(step[i] * metric[i, i]))
            q[i] += step[i]
        if not size <= 2.0:
            break
        for k in range(c):
            q[chosen[k]] = y[k]
        settled = size < 1e-12 or (size < 1e-9 and not size < 0.1 * last)
        last = size
    for i in range(n):
        q[i] = v[i] = math.nan
    return q, v, -1.0


@kernel
def accelerate_partitioned(T, q, v, chosen, metric, phi, qd, applied, currents, out):
    """Accelerations by ``(N^T M N) z'' = N^T (Q - M a0)`` and the power of non-conservative loads and drivers.

    Multipliers serve friction alone.  ``out`` as in `augmented_stages`.
    """
    n, c, flat = q.shape[0], chosen.shape[0], metric.shape[0] > 0
    x = state_rows(T, q, v)
    Q, _, _, P, good = load_vector(T, x, applied, currents)
    _, J, gam, _ = constraint_system(T, x, phi, qd)
    m = gam.shape[0]
    if T.friction.shape[0] > 0:
        _, lam = accelerate(T, x, J, gam, Q, out)
        P += friction_loads(T, x, J, lam, Q)
    B, R, order, length, rank = factor_rows(metric, flat, extended(J, chosen))
    N, MN, d = np.empty((c + 1, n)), np.zeros((c + 1, n)), np.zeros(m + c)
    for k in range(c + 1):  # the last row is a0, the accelerations at z'' = 0
        for r in range(m + c):
            d[r] = gam[r] if k == c and r < m else (1.0 if r == m + k else 0.0)
        step, _ = least_step(metric, flat, B, R, order, length, rank, d)
        for i in range(n):
            N[k, i] = step[i]
            for j in range(n):
                MN[k, j] += T.mass[i, j] * step[i]
    # z'' from the reduced masses N^T M N by Cholesky factors
    G, second = np.zeros((c, c)), np.zeros(c)
    for i in range(c):
        for k in range(n):
            second[i] += N[i, k] * (Q[k] - MN[c, k])
        for j in range(i + 1):
            value = 0.0
            for k in range(n):
                value += N[i, k] * MN[j, k]
            for k in range(j):
                value -= G[i, k] * G[j, k]
            G[i, j] = math.sqrt(value) if i == j else value / G[j, j]
    forth_lower(G, not flat, second)
    back_lower(G, not flat, second)
    a = N[c].copy()
    for k in range(c):
        for i in range(n):
            a[i] += second[k] * N[k, i]
    for r in range(m):
        if T.rows[r, 0] == DRIVE_ANGLE or T.rows[r, 0] == DRIVE_SLIDE:
            # what drivers do is what the loads leave: the constraint forces along the velocity
            for i in range(n):
                P -= Q[i] * v[i]
                for j in range(n):
                    P += T.mass[i, j] * a[j] * v[i]
            break
    if not good or out[4] < 0.0:
        out[6] = 1.0 if not good else 2.0
        for i in range(n):
            a[i] = P = math.nan
    return a, P


@kernel
def partitioned_stages(T, y, h, A, K, low, high, chosen, near, metric, phi, driven, applied, out):
    """Rates of (z, dz/dt, currents, work) at ``y + h A[s] K`` into K[s], for the stages low..high-1; the last state.

    ``driven`` holds the prescribed coordinates of every stage, or one set for all.
    """
    c = chosen.shape[0]
    state = y
    for s in range(low, high):
        state = combined(y, h, K, A[s], s)
        qd = driven[min(s, driven.shape[0] - 1)]
        q, v, pivot = place_partitioned(T, state, chosen, near, metric, phi, qd)
        if pivot < 0.0:
            out[6] = 3.0
        a, P = accelerate_partitioned(T, q, v, chosen, metric, phi, qd, applied, state[2 * c :], out)
        for k in range(c):
            K[s, k], K[s, c + k] = state[c + k], a[chosen[k]]
        finish(T, state_rows(T, q, v), state, K, s, 2 * c, P)
    return state
