"""Right-hand sides: a motor (linear characteristic, direct current, synchronous) on a mechanism of one freedom.

State ``(q, w, currents)`` in the form with inertia; ``(q, p, currents, t)`` with ``p = g(q) w``, ``dt = g ds`` and
``J = g**2`` in the regularised form.  All derivatives are by the independent variable, t or s.
"""

import math

import numpy as np

from graphsynth.core.compilation import kernel

# places in the integer setup
MECHANISM, MOTOR, FORM, SATURATED, DRIVING = 0, 1, 2, 3, 4
SERIES, FOUR_BAR = 0, 1
LINEAR, DIRECT, SYNCHRONOUS = 0, 1, 2
INERTIA, REGULAR = 0, 1
# places in the parameters
BASE, FRICTION, RATIO, EFFICIENCY, LOW, HIGH, CONSTANT = 0, 1, 2, 3, 4, 5, 6
ELECTRIC = 8
LINKAGE = 16
# places of a four-bar linkage behind LINKAGE
(LA, LB, LC, LG, BRANCH, RS, COS_D, SIN_D, M1, M2, I2, I3, WEIGHT, GX, GY, GH, FAR, NEAR) = range(18)
SIZE = LINKAGE + 18


@kernel
def series(q, V, P, out):
    """Sum of squares of trigonometric polynomials: J, J'/2 and the load (last row) into out[0:3]."""
    rows, width = V.shape
    last = rows - 1
    c1, s1 = math.cos(q), math.sin(q)
    out[0] = P[BASE]
    out[1] = 0.0
    for r in range(rows):
        value, slope = V[r, 0], 0.0
        c, s = 1.0, 0.0
        for n in range(1, (width + 1) // 2):
            c, s = c * c1 - s * s1, s * c1 + c * s1
            a, b = V[r, 2 * n - 1], V[r, 2 * n]
            value += a * c + b * s
            slope += n * (b * c - a * s)
        if r == last:
            out[2] = P[CONSTANT] + value
        else:
            out[0] += value * value
            out[1] += value * slope


@kernel
def four_bar(theta, P, out):
    """Effective inertia, half its derivative and the generalised thread load of the braider into out[0:3].

    Well-conditioned products of theory/braider 2, with the excesses ``b + c - a - g`` and
    ``(g - a)^2 - (b - c)^2`` given; out[3:11] get k2, k3, phi2'', phi3'', AB and O2B.
    """
    L = P[LINKAGE:]
    a, b, c, g = L[LA], L[LB], L[LC], L[LG]
    ct, st = math.cos(theta), math.sin(theta)
    half_s, half_c = math.sin(0.5 * theta), math.cos(0.5 * theta)
    # the triangle over the diagonal d from the crank pin to the rocker's pivot, of height h, gives coupler and rocker
    d = math.sqrt((g - a) * (g - a) + 4.0 * a * g * half_s * half_s)
    far = L[FAR] * (b + c + a + g) + 4.0 * a * g * half_c * half_c
    near = L[NEAR] + 4.0 * a * g * half_s * half_s
    h = L[BRANCH] * math.sqrt(far * near) / (2.0 * d)
    ex, ey = (g - a * ct) / d, -a * st / d
    u = (b * b - c * c + d * d) / (2.0 * d)
    abx, aby = u * ex - h * ey, u * ey + h * ex
    obx, oby = -(d - u) * ex - h * ey, -(d - u) * ey + h * ex
    # sines and cosines of differences of angles (2 coupler, 3 rocker, t crank) as products of vectors
    sin32 = h * d / (b * c)
    sin3t = (ct * oby - st * obx) / c
    sint2 = (st * abx - ct * aby) / b
    cos32 = (abx * obx + aby * oby) / (b * c)
    cos3t = (ct * obx + st * oby) / c
    cost2 = (ct * abx + st * aby) / b
    # first and second transmission ratios, inertia and half its derivative from them
    k2 = -a * sin3t / (b * sin32)
    k3 = a * sint2 / (c * sin32)
    f2 = (a * cos3t + b * k2 * k2 * cos32 - c * k3 * k3) / (b * sin32)
    f3 = (a * cost2 + b * k2 * k2 - c * k3 * k3 * cos32) / (c * sin32)
    m2, i2, i3 = L[M2], L[I2], L[I3]
    out[0] = (
        P[BASE]
        + L[M1] * a * a / 3.0
        + m2 * (a * a + 0.25 * b * b * k2 * k2 + a * b * k2 * cost2)
        + i2 * k2 * k2
        + i3 * k3 * k3
    )
    out[1] = (
        0.5 * m2 * (0.5 * b * b * k2 * f2 + a * b * f2 * cost2 - a * b * k2 * sint2 * (1.0 - k2))
        + i2 * k2 * f2
        + i3 * k3 * f3
    )
    # the thread pulls the point r of the rocker towards G
    rx = L[RS] / c * (obx * L[COS_D] - oby * L[SIN_D])
    ry = L[RS] / c * (obx * L[SIN_D] + oby * L[COS_D])
    dx, dy = L[GX] - g - rx, L[GY] - ry
    pull = L[WEIGHT] / math.sqrt(dx * dx + dy * dy + L[GH] * L[GH])
    out[2] = P[CONSTANT] + pull * (rx * dy - ry * dx) * k3
    out[3], out[4], out[5], out[6] = k2, k3, f2, f3
    out[7], out[8], out[9], out[10] = abx, aby, obx, oby


@kernel
def mechanism(setup, q, P, V, out):
    """J, J'/2 and the load at the crank into out[0:3]."""
    if setup[MECHANISM] == SERIES:
        series(q, V, P, out)
    else:
        four_bar(q, P, out)


@kernel
def transmitted(setup, P, torque):
    """Torque of the motor at the crank, with the efficiency of the direction in which the power flows."""
    eta = P[EFFICIENCY] if setup[DRIVING] >= 0 else 1.0 / P[EFFICIENCY]
    return P[RATIO] * eta * torque


@kernel
def field(setup, P, V, y, dy, tmp):
    """Put the derivatives of the state into dy; tmp[11:15] get the rates of the four balances.

    Net work on the mechanism, its absolute value, source minus losses minus shaft power, source (absolute).
    """
    q, p = y[0], y[1]
    mechanism(setup, q, P, V, tmp)
    g = 1.0  # dt/ds; beyond the bounds of the piece it goes on smoothly with the other sign
    if setup[FORM] == REGULAR:
        g = math.sqrt(tmp[0])
        if q < P[LOW] or q > P[HIGH]:
            g = -g
    N = P[RATIO]
    E = P[ELECTRIC:]
    torque, surplus, source = 0.0, 0.0, 0.0  # of the motor; rates of its currents go into dy
    if setup[MOTOR] == LINEAR:
        torque = E[0] - E[1] * N * p
    elif setup[MOTOR] == DIRECT:
        i = y[2]
        volt = E[4] * (E[5] * g - N * p)
        if setup[SATURATED] != 0:
            volt = setup[SATURATED] * E[6] * g
        dy[2] = (volt - E[1] * i * g - E[2] * N * p) / E[0]
        torque = E[3] * i
        source = volt * i
        surplus = source - E[1] * i * i * g - E[2] * N * p * i
    else:
        d, i = y[2], y[3]
        flux = E[2] * N * p
        dy[2] = (E[4] * g - E[1] * d * g + flux * E[0] * i) / E[0]
        dy[3] = (E[5] * g - E[1] * i * g - flux * (E[0] * d + E[3])) / E[0]
        torque = 1.5 * E[2] * E[3] * i
        source = 1.5 * g * (E[4] * d + E[5] * i)
        surplus = source - 1.5 * g * E[1] * (d * d + i * i) - torque * N * p
    # equation of motion J w' = drive - J'/2 w^2, which has p' = drive in the regularised form
    drive = transmitted(setup, P, torque) + tmp[2]
    dy[0] = p
    if setup[FORM] == REGULAR:
        dy[1] = drive
        dy[y.size - 1] = g
    else:
        drive -= P[FRICTION] * p
        dy[1] = (drive - tmp[1] * p * p) / tmp[0]
    tmp[11], tmp[12] = drive * p, abs(drive * p)
    tmp[13], tmp[14] = surplus, abs(source)


@kernel
def jacobian(setup, P, V, y, f, scale, jac, work, tmp):
    """Difference quotients with steps of the natural scale of each variable (trap 4, cannot occur).

    See theory/solvers 3.
    """
    n = y.size
    for j in range(n):
        kept = y[j]
        moved = kept + 1.5e-8 * (abs(kept) + scale[j])
        step = moved - kept
        y[j] = moved
        field(setup, P, V, y, work, tmp)
        y[j] = kept
        for i in range(n):
            jac[i, j] = (work[i] - f[i]) / step


@kernel
def kinetic_energy(setup, P, V, y, tmp):
    """Kinetic energy of the mechanism; magnetic energy of the motor."""
    mechanism(setup, y[0], P, V, tmp)
    E = P[ELECTRIC:]
    motion = 0.5 * y[1] * y[1] * (1.0 if setup[FORM] == REGULAR else tmp[0])
    field_energy = 0.0
    if setup[MOTOR] == DIRECT:
        field_energy = 0.5 * E[0] * y[2] * y[2]
    elif setup[MOTOR] == SYNCHRONOUS:
        field_energy = 0.75 * E[0] * (y[2] * y[2] + y[3] * y[3])
    return motion, field_energy


@kernel
def tabulate(setup, q, P, V, out):
    """Mechanism quantities (n, 11) at the angles q."""
    for k in range(q.size):
        mechanism(setup, q[k], P, V, out[k])


NOTHING = np.zeros((1, 1))
