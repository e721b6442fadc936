"""Right-hand sides and projections: the constrained form, the minimal form through the planar engine."""

import math

import numpy as np

from graphsynth.compilation import kernel
from graphsynth.dynamics.kernels.solving import accelerate, solve_rows
from graphsynth.dynamics.kernels.systems import constraint_system, load_vector, state_rows
from graphsynth.kinematics.engine.kernels.running import run


@kernel
def constrained_rates(T, y, phi, qd, applied, out):
    """Rates of (q, v, work); ``out`` as in `accelerate`, then potential energy and a flag.

    The flag is set, and the rates are NaN, for a spring of length 0 (1) and where the friction iteration does not
    contract (2).
    """
    n = T.mass.shape[0]
    q, v = y[:n], y[n : 2 * n]
    x = state_rows(T, q, v)
    Qc, Qn, V, P, good = load_vector(T, x)
    _, J, gam, _ = constraint_system(T, x, phi, qd)
    a, lam = accelerate(T, x, J, gam, Qc + Qn + applied, out)
    rates = np.empty(2 * n + 1)
    rates[:n], rates[n : 2 * n] = v, a
    # what drivers do: the power of the constraint forces, zero for the others
    rates[2 * n] = P + out[2] + applied @ v - lam @ (J @ v)
    out[5] = V
    if not good or out[3] >= 1.0:
        out[6] = 1.0 if not good else 2.0
        rates[:] = math.nan
    return rates, lam


@kernel
def project_state(T, q, v, phi, qd):
    """Nearest state on the constraints in the metric of the mass matrix; kinetic energy lost, smallest pivot."""
    last = math.inf
    for _ in range(4):
        x = state_rows(T, q, v)
        C, J, _, _ = constraint_system(T, x, phi, qd)
        size = 0.0
        for k in range(C.shape[0]):
            size = max(size, abs(C[k]))
        if not size < last:
            break
        step, _, _ = solve_rows(T.lower, T.diagonal, J, -C)
        q, last = q + step, size
        if size < 1e-9 * T.size:  # the next violation would be rounding: Newton squares it
            break
    x = state_rows(T, q, v)
    _, J, _, vel = constraint_system(T, x, phi, qd)
    change, _, pivot = solve_rows(T.lower, T.diagonal, J, vel - J @ v)
    fixed = v + change
    # T(v) - T(fixed) = -change . M (v + fixed) / 2, without cancellation
    return q, fixed, -0.5 * (change @ (T.mass @ (v + fixed))), pivot


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
def combined(y, h, K, weights, count):
    """Return ``y + h sum weights K``."""
    found = y.copy()
    for s in range(count):
        if weights[s] != 0.0:
            for i in range(y.shape[0]):
                found[i] += h * weights[s] * K[s, i]
    return found


@kernel
def minimal_stages(T, E, S, centres, y, h, A, B, K):
    """Stages of an explicit Runge-Kutta step, K[0] given; K[-1] are the rates at the new state, returned."""
    count = B.shape[0]
    for s in range(1, count):
        K[s] = minimal_rates(T, E, S, centres, combined(y, h, K, A[s], s))[0]
    fresh = combined(y, h, K, B, count)
    K[count] = minimal_rates(T, E, S, centres, fresh)[0]
    return fresh


@kernel
def constrained_stages(T, y, h, A, B, K, phi, qd, applied, out):
    """The same for the constrained form."""
    count = B.shape[0]
    for s in range(1, count):
        K[s] = constrained_rates(T, combined(y, h, K, A[s], s), phi, qd, applied, out)[0]
    fresh = combined(y, h, K, B, count)
    K[count] = constrained_rates(T, fresh, phi, qd, applied, out)[0]
    return fresh
