"""The one-coordinate form through the planar engine: rates at the stages of a step."""

import math

from graphsynth.core.compilation import kernel
from graphsynth.dynamics.kernels.systems import combined, finish, load_vector, state_rows
from graphsynth.kinematics.engine.codes import Delivery, State, Tables
from graphsynth.kinematics.engine.kernels.rows import nearest_turn
from graphsynth.kinematics.engine.kernels.running import run


@kernel
def centre_motion(T, E, S, centres, theta):
    """Coordinates and their derivatives by the input into S.centres, from the engine's frames at its sample 1."""
    q, q1, q2 = S.centres[0], S.centres[1], S.centres[2]
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
        q[k + 2] = nearest_turn(raw, near)
        if E.need[link]:
            q[k + 2] = S.TH[link, 1]
        else:
            S.TH[link, 1] = q[k + 2]
        q1[k], q1[k + 1], q1[k + 2] = S.V[link, 0, 1] - w * uy, S.V[link, 1, 1] + w * ux, w
        q2[k] = S.W[link, 0, 1] - e * uy - w * w * ux
        q2[k + 1] = S.W[link, 1, 1] + e * ux - w * w * uy
        q2[k + 2] = e


@kernel
def one_coordinate_stages(T, E, S, centres, applied, y, h, A, K, low, high, out):
    """Rates of (theta, omega, currents, work) at ``y + h A[s] K`` into K[s], for the stages low..high-1; last state.

    Without loads given as functions; NaN where the engine, started at its sample 0, does not reach.  ``out``: effective
    inertia, half its derivative, potential energy, whether all springs have a length.  What the engine finds stays in
    S.
    """
    n = T.mass.shape[0]
    q, q1, q2 = S.centres[0], S.centres[1], S.centres[2]
    state, v = y, y
    for s in range(low, high):
        state = combined(y, h, K, A[s], s)
        theta, w = state[0], state[1]
        S.u[1] = theta
        S.q[0, 0, 1], S.q[0, 1, 1], S.q[0, 2, 1] = theta, 1.0, 0.0
        S.q[0, 3, 1], S.q[0, 4, 1] = math.cos(theta), math.sin(theta)
        S.done[0] = 0
        # E.first and E.derivs are data: literal numbers would make a second copy of the whole engine
        tables = Tables(E.steps, E.touched, E.rows, E.RP, E.core, E.elim, E.EP, E.drv, E.DP, E.need)
        found = State(S.X, S.TH, S.V, S.W, S.PHI, S.M)
        kept = Delivery(E.poses, E.centres, E.kept, E.groups, E.OX, E.OV, E.OW, E.OM)
        run(tables, E.wanted, S.q, S.u, E.modes, found, kept, S.done, S.why, E.first, (E.Lc, E.far), E.derivs)
        # no rates where the engine does not reach
        for i in range(K.shape[1]):
            K[s, i] = math.nan
        if S.done[0] < 2:
            out[0] = 0.0
            continue
        centre_motion(T, E, S, centres, theta)
        v = q1.copy()
        for i in range(n):
            v[i] *= w
        x = state_rows(T, q, v)
        Q, _, V, P, good = load_vector(T, x, applied, state[2:])
        # effective inertia, half its derivative and the loads along the motion
        inertia, half, load = 0.0, 0.0, 0.0
        for i in range(n):
            load += Q[i] * q1[i]
            for j in range(n):
                inertia += T.mass[i, j] * q1[i] * q1[j]
                half += T.mass[i, j] * q1[i] * q2[j]
        K[s, 0], K[s, 1] = w, (load - half * w * w) / inertia
        finish(T, x, state, K, s, 2, P)
        out[0], out[1], out[2], out[3] = inertia, half, V, 1.0 if good else 0.0
    return state
