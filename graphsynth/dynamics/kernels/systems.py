"""Constraint rows and loads at one state; T is `graphsynth.dynamics.tables.Tables`."""

import math

import numpy as np

from graphsynth.core.compilation import kernel
from graphsynth.kinematics.engine.codes import DRIVE_ANGLE, DRIVE_SLIDE, PBX, PBY, RA, SIGN, SLOT, TX, TY
from graphsynth.kinematics.engine.kernels.rows import gamma, row

RACK_KIND = 20
#: Kinds of motors; columns of their table, the electrical ones by kind.
DIRECT, SYNCHRONOUS = 1, 2
RATIO, EFFICIENCY, INDUCTANCE, RESISTANCE = 0, 1, 2, 3
STALL, SLOPE = 2, 3
EMF, TORQUE, GAIN, DEMAND, LIMIT = 4, 5, 6, 7, 8
POLES, FLUX, UD, UQ = 4, 5, 6, 7


@kernel
def combined(y, h, K, weights, count):
    """Return the state ``y + h sum weights K`` of a stage."""
    found = y.copy()
    for s in range(count):
        if weights[s] != 0.0:
            for i in range(y.shape[0]):
                found[i] += h * weights[s] * K[s, i]
    return found


@kernel
def finish(T, x, state, K, s, at, P):
    """Rates of what stands behind the motion in row ``s`` of K: currents, their energy, work."""
    last = state.shape[0] - 1
    if last > at:
        K[s, last - 1] = current_rates(T, x, state[at:], K[s], at)
    K[s, last] = P


@kernel
def state_rows(T, q, v):
    """Rows of the engine's state for every link: x, y, cos, sin, theta, velocities, (accelerations 0)."""
    x = np.zeros((T.column.shape[0], 11))
    for link in range(x.shape[0]):
        k = T.column[link]
        x[link, 2] = 1.0
        if k >= 0:
            x[link, 0], x[link, 1], x[link, 4] = q[k], q[k + 1], q[k + 2]
            x[link, 2], x[link, 3] = math.cos(q[k + 2]), math.sin(q[k + 2])
            x[link, 5], x[link, 6], x[link, 7] = v[k], v[k + 1], v[k + 2]
    return x


@kernel
def constraint_system(T, x, phi, qd):
    """Constraint values C, Jacobian J, acceleration side gam (J a = gam) and -C_t (J v = vel)."""
    m, n = T.rows.shape[0], T.mass.shape[0]
    C, J, gam, vel = np.empty(m), np.zeros((m, n)), np.empty(m), np.zeros(m)
    g = np.empty(6)
    for k in range(m):
        kind, a, b = T.rows[k, 0], T.rows[k, 1], T.rows[k, 2]
        ka, kb = T.column[a], T.column[b]
        if kind == RACK_KIND:
            # tooth force along e at the pitch point; the centre of the pinion is w from its centre of mass
            ex, ey = T.table[k, TX], T.table[k, TY]
            px, py, radius = T.table[k, PBX], T.table[k, PBY], T.table[k, RA]
            wx, wy = x[b, 2] * px - x[b, 3] * py, x[b, 3] * px + x[b, 2] * py
            cx, cy = x[b, 0] + wx, x[b, 1] + wy
            C[k] = ex * (x[a, 0] - cx) + ey * (x[a, 1] - cy) - radius * x[b, 4] - phi[T.slots[k]]
            gam[k] = -(x[b, 7] ** 2) * (ex * wx + ey * wy)
            if ka >= 0:
                ux, uy = cx + radius * ey - x[a, 0], cy - radius * ex - x[a, 1]
                J[k, ka], J[k, ka + 1], J[k, ka + 2] = ex, ey, ux * ey - uy * ex
            if kb >= 0:
                J[k, kb], J[k, kb + 1], J[k, kb + 2] = -ex, -ey, -(wx * ey - wy * ex) - radius
            continue
        C[k] = row(kind, T.table, k, a, b, x, phi, qd, g)
        gam[k] = -gamma(kind, T.table, k, a, b, x, qd)
        if kind in (DRIVE_ANGLE, DRIVE_SLIDE):
            vel[k] = T.table[k, SIGN] * qd[int(T.table[k, SLOT]), 1]
        for c in range(3):
            if ka >= 0:
                J[k, ka + c] = g[c]
            if kb >= 0:
                J[k, kb + c] = g[3 + c]
    return C, J, gam, vel


@kernel
def pull(T, Q, x, link, ux, uy, fx, fy):
    """Add a force at the arm u of a link; returns its power."""
    k = T.column[link]
    if k < 0:
        return 0.0
    moment = ux * fy - uy * fx
    Q[k] += fx
    Q[k + 1] += fy
    Q[k + 2] += moment
    return fx * x[link, 5] + fy * x[link, 6] + moment * x[link, 7]


@kernel
def twist(T, Q, x, a, b, torque):
    """Add a torque to b and its opposite to a; returns the power."""
    ka, kb = T.column[a], T.column[b]
    if ka >= 0:
        Q[ka + 2] -= torque
    if kb >= 0:
        Q[kb + 2] += torque
    return torque * (x[b, 7] - x[a, 7])


@kernel
def motor_torque(T, s, currents, shaft):
    """Torque of motor ``s`` on its own shaft."""
    p, first = T.motor_table[s], T.motors[s, 3]
    if T.motors[s, 2] == DIRECT:
        return p[TORQUE] * currents[first]
    if T.motors[s, 2] == SYNCHRONOUS:
        return 1.5 * p[POLES] * p[FLUX] * currents[first + 1]
    return p[STALL] - p[SLOPE] * shaft


@kernel
def current_rates(T, x, currents, rates, at):
    """Rates of the currents into ``rates[at:]``; the rate of their energy: power supplied less lost less shaft's."""
    surplus = 0.0
    for s in range(T.motors.shape[0]):
        p, first, kind = T.motor_table[s], T.motors[s, 3], T.motors[s, 2]
        shaft = p[RATIO] * (x[T.motors[s, 1], 7] - x[T.motors[s, 0], 7])
        if kind == DIRECT:
            i = currents[first]
            volt = p[GAIN] * (p[DEMAND] - shaft) if T.modes[s, 0] == 0 else T.modes[s, 0] * p[LIMIT]
            rates[at + first] = (volt - p[RESISTANCE] * i - p[EMF] * shaft) / p[INDUCTANCE]
            surplus += i * (volt - p[RESISTANCE] * i - p[EMF] * shaft)
        if kind == SYNCHRONOUS:
            d, i, turn = currents[first], currents[first + 1], p[POLES] * shaft
            rates[at + first] = (p[UD] - p[RESISTANCE] * d) / p[INDUCTANCE] + turn * i
            rates[at + first + 1] = (p[UQ] - p[RESISTANCE] * i - turn * p[FLUX]) / p[INDUCTANCE] - turn * d
            surplus += 1.5 * (p[UD] * d + (p[UQ] - turn * p[FLUX]) * i - p[RESISTANCE] * (d * d + i * i))
    return surplus


@kernel
def load_vector(T, x, applied, currents):
    """Generalised forces with potential V and power P of the others; False if a spring pushes without a direction.

    That is at length 0 with a free length; without one the force is smooth there, and the damper is taken along the
    velocity.  All forces, those given as functions (``applied``, not conservative) among them, and the conservative
    ones.
    """
    n = T.mass.shape[0]
    Qc, Qn = np.zeros(n), applied.copy()
    V, P, good = 0.0, 0.0, True
    # loads given as functions do work; weights have a potential
    for link in range(T.column.shape[0]):
        k = T.column[link]
        if k >= 0:
            for c in range(3):
                P += applied[k + c] * x[link, 5 + c]
    for link in range(T.column.shape[0]):
        k = T.column[link]
        if k >= 0:
            for c in range(2):
                weight = T.mass[k, k] * T.gravity[c]
                Qc[k + c] += weight
                V -= weight * x[link, c]
    # springs along the line between two points, with dampers
    for s in range(T.springs.shape[0]):
        a, b = T.springs[s, 0], T.springs[s, 1]
        p = T.spring_table[s]
        ux, uy = x[a, 2] * p[0] - x[a, 3] * p[1], x[a, 3] * p[0] + x[a, 2] * p[1]
        wx, wy = x[b, 2] * p[2] - x[b, 3] * p[3], x[b, 3] * p[2] + x[b, 2] * p[3]
        dx, dy = x[b, 0] + wx - x[a, 0] - ux, x[b, 1] + wy - x[a, 1] - uy
        length = math.sqrt(dx * dx + dy * dy)
        rx = x[b, 5] - x[b, 7] * wy - x[a, 5] + x[a, 7] * uy
        ry = x[b, 6] + x[b, 7] * wx - x[a, 6] - x[a, 7] * ux
        if length == 0.0:
            good = good and p[4] * p[5] == 0.0
            speed = math.sqrt(rx * rx + ry * ry)
            ex, ey = (rx / speed, ry / speed) if speed > 0.0 else (0.0, 0.0)
        else:
            ex, ey = dx / length, dy / length
        f, d = p[4] * (length - p[5]), p[6] * (ex * rx + ey * ry)
        V += 0.5 * p[4] * (length - p[5]) ** 2
        pull(T, Qc, x, a, ux, uy, f * ex, f * ey)
        pull(T, Qc, x, b, wx, wy, -f * ex, -f * ey)
        P += pull(T, Qn, x, a, ux, uy, d * ex, d * ey) + pull(T, Qn, x, b, wx, wy, -d * ex, -d * ey)
    for s in range(T.torsions.shape[0]):
        a, b = T.torsions[s, 0], T.torsions[s, 1]
        p = T.torsion_table[s]
        turn = x[b, 4] - x[a, 4] - p[1]
        V += 0.5 * p[0] * turn * turn
        twist(T, Qc, x, a, b, -p[0] * turn)
        P += twist(T, Qn, x, a, b, -p[2] * (x[b, 7] - x[a, 7]))
    # constant forces, of which some turn with their link; torques behind trains, whose losses are on the driven side
    for s in range(T.forces.shape[0]):
        link, p = T.forces[s, 0], T.force_table[s]
        c, sn = x[link, 2], x[link, 3]
        fx, fy = p[2], p[3]
        if T.forces[s, 1] == 1:
            fx, fy = c * p[2] - sn * p[3], sn * p[2] + c * p[3]
        P += pull(T, Qn, x, link, c * p[0] - sn * p[1], sn * p[0] + c * p[1], fx, fy)
    for s in range(T.sources.shape[0]):
        a, b = T.sources[s, 0], T.sources[s, 1]
        torque, eta = T.source_table[s, 0], T.source_table[s, 1]
        torque = torque * eta if torque * (x[b, 7] - x[a, 7]) >= 0.0 else torque / eta
        P += twist(T, Qn, x, a, b, torque)
    # motors, driving or driven by the mode of the piece
    for s in range(T.motors.shape[0]):
        a, b = T.motors[s, 0], T.motors[s, 1]
        ratio, eta = T.motor_table[s, RATIO], T.motor_table[s, EFFICIENCY]
        torque = ratio * motor_torque(T, s, currents, ratio * (x[b, 7] - x[a, 7]))
        P += twist(T, Qn, x, a, b, torque * eta if T.modes[s, 1] > 0 else torque / eta)
    for i in range(n):
        Qn[i] += Qc[i]
    return Qn, Qc, V, P, good
