"""The augmented form: rates at the stages of a step, projection.

Sums are written out: numba takes longer to compile one matrix product or array expression than a kernel of loops.
"""

import math

import numpy as np

from graphsynth.core.compilation import kernel
from graphsynth.dynamics.kernels.solving import accelerate, solve_rows
from graphsynth.dynamics.kernels.systems import combined, constraint_system, finish, load_vector, state_rows

#: Smallest pivot (rows of length 1) below which a state is projected before its accelerations are computed.
NEAR = 0.03


@kernel
def project_state(T, q, v, phi, qd):
    """Nearest state on the constraints in the metric of the mass matrix; kinetic energy lost, smallest pivot."""
    last, settled, loss, pivot = math.inf, False, 0.0, 1.0
    q, v = q.copy(), v.copy()
    for attempt in range(5):
        x = state_rows(T, q, v)
        C, J, _, vel = constraint_system(T, x, phi, qd)
        size = 0.0
        for k in range(C.shape[0]):
            size = max(size, abs(C[k]))
        final = settled or attempt == 4 or not size < last
        for k in range(C.shape[0]):
            if final:
                C[k] = vel[k]
                for j in range(v.shape[0]):
                    C[k] -= J[k, j] * v[j]
            else:
                C[k] = -C[k]
        step, pivot = solve_rows(T.lower, T.diagonal, J, C)
        if final:
            for i in range(v.shape[0]):
                # T(v) - T(fixed) = -step . M (v + fixed) / 2, without cancellation
                for j in range(v.shape[0]):
                    loss -= 0.5 * step[i] * T.mass[i, j] * (2.0 * v[j] + step[j])
            for i in range(v.shape[0]):
                v[i] += step[i]
            break
        for i in range(q.shape[0]):
            q[i] += step[i]
        last, settled = size, size < 1e-9 * T.size  # the next violation would be rounding: Newton squares it
    return q, v, loss, pivot


@kernel
def augmented_stages(T, y, h, A, K, low, high, phi, driven, applied, out):
    """Rates of (q, v, currents, work) at ``y + h A[s] K`` into K[s], for stages low..high-1; last state, multipliers.

    ``driven`` holds the prescribed coordinates of every stage, or one set for all.
    ``out`` as in `accelerate`, then potential energy and a flag.  The flag is set, and the rates are NaN, for a spring
    of length 0 (1) and where no friction loads were found (2).
    """
    n = T.mass.shape[0]
    state, lam = y, np.zeros(T.rows.shape[0])
    for s in range(low, high):
        state = combined(y, h, K, A[s], s)
        qd = driven[min(s, driven.shape[0] - 1)]
        q, v = state[:n], state[n : 2 * n]
        for attempt in range(2):
            x = state_rows(T, q, v)
            Q, _, V, P, good = load_vector(T, x, applied, state[2 * n :])
            _, J, gam, vel = constraint_system(T, x, phi, qd)
            a, lam = accelerate(T, x, J, gam, Q, out)
            if attempt == 1 or not out[1] < NEAR:
                break
            # next to a singular pose the accelerations are smooth on the constraints only
            q, v, _, _ = project_state(T, q, v, phi, qd)
        P += out[2]
        for k in range(lam.shape[0]):
            P -= lam[k] * vel[k]  # what drivers do; the other joints do nothing
        out[5] = V
        if not good or out[4] < 0.0:
            out[6] = 1.0 if not good else 2.0
            P = math.nan
        for j in range(n):
            K[s, j], K[s, n + j] = (v[j], a[j]) if P == P else (P, P)
        finish(T, x, state, K, s, 2 * n, P)
    return state, lam
