"""The constrained form: rates, stages of a step, projection."""

import math

import numpy as np

from graphsynth.compilation import kernel
from graphsynth.dynamics.kernels.combining import combined
from graphsynth.dynamics.kernels.solving import accelerate, solve_rows
from graphsynth.dynamics.kernels.systems import constraint_system, load_vector, state_rows

#: Smallest pivot (rows of length 1) below which a state is projected before its accelerations are computed.
NEAR = 0.03


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
def constrained_rates(T, y, phi, qd, applied, out):
    """Rates of (q, v, work); ``out`` as in `accelerate`, then potential energy and a flag.

    The flag is set, and the rates are NaN, for a spring of length 0 (1) and where the friction iteration does not
    contract (2).
    """
    n = T.mass.shape[0]
    q, v = y[:n].copy(), y[n : 2 * n].copy()
    x = state_rows(T, q, v)
    Qc, Qn, V, P, good = load_vector(T, x)
    _, J, gam, _ = constraint_system(T, x, phi, qd)
    a, lam = accelerate(T, x, J, gam, Qc + Qn + applied, out)
    if out[1] < NEAR:  # next to a singular pose the accelerations are smooth on the constraints only
        q, v, _, _ = project_state(T, q, v, phi, qd)
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
def constrained_stages(T, y, h, A, B, K, phi, qd, applied, out):
    """Stages of an explicit Runge-Kutta step, K[0] given; K[-1] are the rates at the new state, returned."""
    count = B.shape[0]
    for s in range(1, count):
        K[s] = constrained_rates(T, combined(y, h, K, A[s], s), phi, qd, applied, out)[0]
    fresh = combined(y, h, K, B, count)
    K[count] = constrained_rates(T, fresh, phi, qd, applied, out)[0]
    return fresh
