"""The minimal form through the planar engine: rates and stages of a step."""

import math

import numpy as np

from graphsynth.compilation import kernel
from graphsynth.dynamics.kernels.combining import combined
from graphsynth.dynamics.kernels.systems import load_vector, state_rows
from graphsynth.kinematics.engine.kernels.running import run


@kernel
def engine_state(T, E, S, centres, theta):
    """Coordinates and their derivatives by the input, from the planar engine started at its sample 0."""
    n = T.mass.shape[0]
    q, q1, q2 = np.empty(n), np.empty(n), np.empty(n)
    S.u[1] = theta
    S.q[0, 0, 1], S.q[0, 1, 1], S.q[0, 2, 1] = theta, 1.0, 0.0
    S.q[0, 3, 1], S.q[0, 4, 1] = math.cos(theta), math.sin(theta)
    S.done[0] = 0
    run(E.steps, E.touched, E.rows, E.RP, E.core, E.elim, E.EP, E.drv, E.DP, E.need, E.wanted, S.q, S.u, E.modes,
        E.poses, S.X, S.TH, S.V, S.W, S.PHI, S.M, E.kept, E.groups, E.OX, E.OV, E.OW, E.OM, S.done, S.why,
        1, E.Lc, True)  # fmt: skip
    for link in range(T.column.shape[0]):
        k = T.column[link]
        if k < 0:
            continue
        c, s = S.X[link, 2, 1], S.X[link, 3, 1]
        ux, uy = c * centres[link, 0] - s * centres[link, 1], s * centres[link, 0] + c * centres[link, 1]
        near = S.TH[link, 0] + (theta - S.u[0]) * S.V[link, 2, 0]
        raw = math.atan2(s, c)
        w, e = S.V[link, 2, 1], S.W[link, 2, 1]
        q[k], q[k + 1] = S.X[link, 0, 1] + ux, S.X[link, 1, 1] + uy
        q[k + 2] = raw + 2.0 * math.pi * math.floor((near - raw) / (2.0 * math.pi) + 0.5)
        if E.need[link]:
            q[k + 2] = S.TH[link, 1]
        else:
            S.TH[link, 1] = q[k + 2]
        q1[k], q1[k + 1], q1[k + 2] = S.V[link, 0, 1] - w * uy, S.V[link, 1, 1] + w * ux, w
        q2[k] = S.W[link, 0, 1] - e * uy - w * w * ux
        q2[k + 1] = S.W[link, 1, 1] + e * ux - w * w * uy
        q2[k + 2] = e
    return q, q1, q2


@kernel
def minimal_rates(T, E, S, centres, y):
    """Rates of (theta, omega, work) without loads given as functions; NaN where the engine does not reach.

    Also effective inertia, half its derivative, potential energy and whether all springs have a length.
    """
    q, q1, q2 = engine_state(T, E, S, centres, y[0])
    rates, out = np.empty(3), np.zeros(4)
    if S.done[0] < 2:
        rates[:] = math.nan
        return rates, out
    w = y[1]
    x = state_rows(T, q, q1 * w)
    Qc, Qn, V, P, good = load_vector(T, x)
    Mq = T.mass @ q1
    inertia, half = Mq @ q1, Mq @ q2
    rates[0], rates[1], rates[2] = w, ((Qc + Qn) @ q1 - half * w * w) / inertia, P
    out[0], out[1], out[2], out[3] = inertia, half, V, 1.0 if good else 0.0
    return rates, out


@kernel
def minimal_stages(T, E, S, centres, y, h, A, B, K):
    """Stages of an explicit Runge-Kutta step, K[0] given; K[-1] are the rates at the new state, returned."""
    count = B.shape[0]
    for s in range(1, count):
        K[s] = minimal_rates(T, E, S, centres, combined(y, h, K, A[s], s))[0]
    fresh = combined(y, h, K, B, count)
    K[count] = minimal_rates(T, E, S, centres, fresh)[0]
    return fresh
