"""One step of the method of Dormand and Prince of order 8 (coefficients from scipy) for a slip piece."""

import math

import numpy as np
from scipy.integrate import DOP853

from graphsynth.core.compilation import kernel
from graphsynth.systems.tribometer.kernels.plant import DAMPING, MASS, NORMAL, STATIC, STIFFNESS, acceleration, drive

STAGES = 12
A, B, C = np.ascontiguousarray(DOP853.A[:STAGES, :STAGES]), DOP853.B.copy(), DOP853.C[:STAGES].copy()
E3, E5 = DOP853.E3[:STAGES].copy(), DOP853.E5[:STAGES].copy()


@kernel
def step(p, s, t, x, v, h, tolerance, work):
    """One step ``h``: position, velocity, work of the drive, friction loss, damper loss, error (<= 1 passes).

    ``work`` has shape (2, 12).  The three energies are quadratures with the weights of the step.
    """
    driven = heat = damped = 0.0
    for i in range(STAGES):
        dx = dv = 0.0
        for j in range(i):
            dx += A[i, j] * work[0, j]
            dv += A[i, j] * work[1, j]
        vi = v + h * dv
        v1 = drive(p, t + C[i] * h)[1]
        a, force = acceleration(p, s, x + h * dx, vi, v1)
        work[0, i], work[1, i] = vi, a
        driven += B[i] * force * v1
        heat += B[i] * force * (v1 - vi)
        damped += B[i] * p[DAMPING] * vi * vi
    dx = dv = three = five = 0.0
    for i in range(STAGES):
        dx += B[i] * work[0, i]
        dv += B[i] * work[1, i]
    span = p[STATIC] * p[NORMAL] / p[STIFFNESS]
    scales = (
        max(abs(x), abs(span)),
        max(abs(v), abs(v + h * dv), abs(span) * math.sqrt(p[STIFFNESS] / p[MASS])),
    )
    for row in range(2):
        e3 = e5 = 0.0
        for i in range(STAGES):
            e3 += E3[i] * work[row, i]
            e5 += E5[i] * work[row, i]
        three += (e3 / scales[row]) ** 2
        five += (e5 / scales[row]) ** 2
    error = 0.0
    if not five + three < math.inf:
        error = math.inf
    elif five > 0.0 or three > 0.0:
        error = abs(h) * five / math.sqrt((five + 0.01 * three) * 2.0) / tolerance
    return x + h * dx, v + h * dv, h * driven, h * heat, h * damped, error
