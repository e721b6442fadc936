"""Radau IIA of order 9 for drives: error control, exact landing on output times and on events, balances.

The angle is kept within a few turns beside a count of turns in the form with inertia, and every update is compensated,
so that roundings do not add up over a long run.

Why not scipy's integrators: docs/explanation/decisions.md, "One integrator of our own, for drives".
"""

import math

import numpy as np

from graphsynth.core.compilation import kernel
from graphsynth.dynamics.driven.kernels.systems import (
    DIRECT,
    DRIVING,
    EFFICIENCY,
    ELECTRIC,
    FORM,
    HIGH,
    LINEAR,
    LOW,
    MOTOR,
    RATIO,
    REGULAR,
    SATURATED,
    field,
    jacobian,
    kinetic_energy,
)
from graphsynth.dynamics.kernels.linear import clear, factorise, norm, substitute
from graphsynth.kinematics.engine.kernels.newton import copy

DONE, STEP_TOO_SMALL, TOO_MANY_STEPS, NOT_FINITE, TOO_MANY_EVENTS = 0, 1, 2, 3, 4
NONE, OUTPUT, DEAD_CENTRE, STALL, LIMIT, FLOW = 0, 1, 2, 3, 4, 5
TURN, TURN_LOW = 6.283185307179586, 2.4492935982947064e-16
LEAST_ANGLE = 4.0 * math.pi

# Five stages, coefficients made with 40 digits from their defining equations: nodes C are the zeros of P_5 - P_4 on
# [0, 1]; A integrates the Lagrange polynomials of the nodes ([Hairer & Wanner 1996], section IV.5); SHIFT is the real
# eigenvalue of A and ERROR the embedded formula of section IV.8.
STAGES = 5
C = np.array([0.05710419611451768, 0.2768430136381238, 0.5835904323689168, 0.8602401356562195, 1.0])
A = np.array(
    [
        [0.07299886431790333, -0.02673533110794557, 0.018676929763984353, -0.01287910609330644, 0.005042839233882015],
        [0.15377523147918246, 0.14621486784749352, -0.03644456890512809, 0.02123306311930472, -0.007935579902728777],
        [0.14006304568480987, 0.29896712949128346, 0.16758507013524895, -0.03396910168661774, 0.010944288744192253],
        [0.14489430810953477, 0.2765000687601592, 0.32579792291042103, 0.12875675325490976, -0.015708917378805327],
        [0.14371356079122594, 0.28135601514946207, 0.31182652297574126, 0.22310390108357075, 0.04],
    ]
)
SHIFT = 0.15906584442746913
ERROR = np.array([-4.418997716796381, 0.57923485225667, -0.199237560953468, 0.09416748369194548, -0.03181316888549383])


@kernel
def attempt(setup, P, V, y, h, f0, jac, unit, kappa, Z, F, tmp):
    """Solve the stage equations for a step h from the guess Z; the scaled size of the error, or -1 for no success."""
    n = y.size
    m = STAGES * n
    M = np.empty((m, m))  # I - h A x jac, of all stages together, is factorised once
    order = np.empty(m, np.int64)
    for i in range(STAGES):
        for j in range(STAGES):
            for a in range(n):
                for b in range(n):
                    M[i * n + a, j * n + b] = -h * A[i, j] * jac[a, b]
    for a in range(m):
        M[a, a] += 1.0
    if not factorise(M, order):
        return -1.0
    v, stage, f = np.empty(m), np.empty(n), np.empty(n)
    before, ratio, solved = 0.0, 1.0, False
    for step in range(15):  # simplified Newton iteration: the residual -Z + h A f(y + Z) of all stages, then M dZ = v
        for i in range(STAGES):
            for a in range(n):
                stage[a] = y[a] + Z[i, a]
            field(setup, P, V, stage, f, tmp)
            for a in range(n):
                F[i, a] = f[a]
        for i in range(STAGES):
            for a in range(n):
                value = -Z[i, a]
                for j in range(STAGES):
                    value += h * A[i, j] * F[j, a]
                v[i * n + a] = value
        substitute(M, order, v)
        size = 0.0
        for i in range(STAGES):
            for a in range(n):
                Z[i, a] += v[i * n + a]
                size += (v[i * n + a] / unit[a]) ** 2
        size = math.sqrt(size / m)
        if not size < 1e200:
            return -1.0
        if step > 0:  # what is left is estimated from the rate of convergence ([Hairer & Wanner 1996], IV.8)
            ratio = size / before if before > 0.0 else 0.0
        if size <= 1e-3 * kappa or (step > 0 and ratio < 1.0 and ratio / (1.0 - ratio) * size <= kappa):
            solved = True
            break
        if step > 1 and ratio >= 1.0:
            solved = size <= 10.0 * kappa  # the rounding level
            break
        before = size
    if not solved:
        return -1.0
    return estimate(setup, P, V, y, h, f0, jac, unit, Z, tmp)


@kernel
def estimate(setup, P, V, y, h, f0, jac, unit, Z, tmp):
    """Scaled error of the embedded formula ([Hairer & Wanner 1996], IV.8, equations 8.19 and 8.20)."""
    n = y.size
    M, order = np.empty((n, n)), np.empty(n, np.int64)
    for a in range(n):
        for b in range(n):
            M[a, b] = -h * SHIFT * jac[a, b]
        M[a, a] += 1.0
    if not factorise(M, order):
        return -1.0
    base, e, moved, f = np.empty(n), np.empty(n), np.empty(n), np.empty(n)
    for a in range(n):
        base[a] = 0.0
        for i in range(STAGES):
            base[a] += ERROR[i] * Z[i, a]
        e[a] = base[a] + h * SHIFT * f0[a]
    substitute(M, order, e)
    size = norm(e, unit)
    if size >= 1.0:
        for a in range(n):
            moved[a] = y[a] + e[a]
        field(setup, P, V, moved, f, tmp)
        for a in range(n):
            e[a] = base[a] + h * SHIFT * f[a]
        substitute(M, order, e)
        size = norm(e, unit)
    return size if size < 1e200 else -1.0


@kernel
def passed(code, setup, P, y, start, target):
    """Positive when the event has been passed; ``start`` is the state at the start of the step."""
    n = y.size
    if code == OUTPUT:
        return y[n - 1] - target
    if code == DEAD_CENTRE:
        return max(y[0] - P[HIGH], P[LOW] - y[0])
    if code == STALL:
        return -y[1] if start[1] > 0.0 else (y[1] if start[1] < 0.0 else -1.0)
    if code == LIMIT:
        E = P[ELECTRIC:]
        if setup[MOTOR] != DIRECT or not E[6] < math.inf:
            return -1.0
        asked = E[4] * (E[5] - P[RATIO] * y[1])
        over = abs(asked) - E[6] if setup[SATURATED] == 0 else E[6] - setup[SATURATED] * asked
        return over - 1e-13 * E[6]
    if P[EFFICIENCY] == 1.0:
        return -1.0
    return -setup[DRIVING] * motor_torque(setup, P, y) * y[1] - 1e-300


@kernel
def motor_torque(setup, P, y):
    """Torque of the motor from the state (form with inertia for a linear characteristic)."""
    E = P[ELECTRIC:]
    if setup[MOTOR] == LINEAR:
        return E[0] - E[1] * P[RATIO] * y[1]
    if setup[MOTOR] == DIRECT:
        return E[3] * y[2]
    return 1.5 * E[2] * E[3] * y[3]


@kernel
def locate(code, target, setup, P, V, y, h, last, f0, jac, unit, kappa, Z, F, tmp):
    """Step that just passes the event (Illinois method on exact steps); Z of that step; -1 if steps fail."""
    n = y.size
    end = np.empty(n)
    low, high = 0.0, h  # the event lies between them; ``best`` is the shortest step known to pass it
    at_low, at_high = min(passed(code, setup, P, y, y, target), 0.0), last
    kept = np.empty((STAGES, n))
    copy(Z, kept)
    side, best = 0, h
    for step in range(60):
        if step < 40 and at_low < 0.0:
            middle = high - at_high * (high - low) / (at_high - at_low)
        else:
            middle = 0.5 * (low + high)
        middle = min(max(middle, low + 1e-16 * h), high)
        if middle <= low or middle >= high:
            break
        clear(Z)  # a whole step of its own, no interpolation: the event is met to the last digit
        if attempt(setup, P, V, y, middle, f0, jac, unit, kappa, Z, F, tmp) < 0.0:
            return -1.0
        for a in range(n):
            end[a] = y[a] + Z[STAGES - 1, a]
        value = passed(code, setup, P, end, y, target)
        if value > 0.0:
            narrow = best - middle
            high, at_high, best = middle, value, middle
            copy(Z, kept)
            if side == 1:  # the same end moved twice: the value at the other one is halved
                at_low *= 0.5
            side = 1
        else:
            narrow = middle - low
            low, at_low = middle, value
            if side == -1:
                at_high *= 0.5
            side = -1
        if high - low <= 4e-16 * h or (value == 0.0 and code != STALL) or narrow <= 1e-17 * h:
            if value == 0.0:
                copy(Z, kept)
                best = middle
            break
    copy(kept, Z)
    return best


@kernel
def extrapolate(Z, ratio, out):
    """Stages of the next step guessed from the polynomial of the last one (step ratio new/old)."""
    n = Z.shape[1]
    for i in range(STAGES):
        x = 1.0 + C[i] * ratio
        for a in range(n):
            out[i, a] = -Z[STAGES - 1, a]
        for j in range(STAGES):
            weight = x / C[j]
            for k in range(STAGES):
                if k != j:
                    weight *= (x - C[k]) / (C[j] - C[k])
            for a in range(n):
                out[i, a] += weight * Z[j, a]


@kernel
def advance(y, low, amount):
    """Compensated ``y += amount``."""
    for a in range(y.size):
        part = amount[a] - low[a]
        total = y[a] + part
        low[a] = (total - y[a]) - part
        y[a] = total


@kernel
def react(code, setup, P, y, zeros, piece):
    """Change the mode after an event; returns the number of the piece between dead centres."""
    if code == DEAD_CENTRE:
        forward = y[0] - P[HIGH] >= P[LOW] - y[0]
        y[0] = P[HIGH] if forward else P[LOW]
        piece += 1 if forward else -1
        count = zeros.size
        P[LOW] = zeros[piece % count] + TURN * (piece // count)
        P[HIGH] = zeros[(piece + 1) % count] + TURN * ((piece + 1) // count)
    elif code == LIMIT:
        asked = P[ELECTRIC + 4] * (P[ELECTRIC + 5] - P[RATIO] * y[1])
        setup[SATURATED] = 0 if setup[SATURATED] != 0 else (1 if asked > 0.0 else -1)
    elif code == FLOW:
        setup[DRIVING] = -setup[DRIVING]
    return piece


@kernel
def integrate(setup, P, V, zeros, y, outs, rtol, scale, first, most, Y, turns, balance, marks, counts):
    """Integrate from ``y`` at outs[0] through all ``outs``.

    ``outs`` are values of the independent variable in the form with inertia, of the time (last state) in the
    regularised form.  ``Y`` (n_out, n), ``turns`` (n_out,), ``balance`` (n_out, 6): the four balances of
    `field` and both energies; ``marks`` (m, 3 + n): code, x, turns and state of events.  counts: steps, rejected,
    events, outputs reached.  Returns the status.
    """
    n = y.size
    regular = setup[FORM] == REGULAR
    tmp = np.zeros(16)
    f0, work, unit, low, amount = np.empty(n), np.empty(n), np.empty(n), np.zeros(n), np.empty(n)
    jac, Z, guess, F = np.empty((n, n)), np.zeros((STAGES, n)), np.zeros((STAGES, n)), np.empty((STAGES, n))
    sums, stage = np.zeros(4), np.empty(n)
    codes = np.empty(3, np.int64)
    codes[0], codes[1], codes[2] = (OUTPUT, DEAD_CENTRE, STALL) if regular else (LIMIT, FLOW, STALL)
    kappa = max(10.0 * 2.3e-16 / rtol, min(0.01, math.sqrt(rtol)))
    x, wound, piece, target_index = outs[0], 0, 0, 0
    wanted, h, old = first, first, 0.0
    span = outs[-1] - outs[0]
    fresh = True
    while True:
        # outputs that are reached: state, turns, balances and energies
        while target_index < outs.size and (y[n - 1] if regular else x) >= outs[target_index]:
            for a in range(n):
                Y[target_index, a] = y[a]
            turns[target_index] = wound
            for k in range(4):
                balance[target_index, k] = sums[k]
            balance[target_index, 4], balance[target_index, 5] = kinetic_energy(setup, P, V, y, tmp)
            target_index += 1
            counts[3] = target_index
        if target_index == outs.size:
            return DONE
        if counts[0] + counts[1] >= most:
            return TOO_MANY_STEPS
        goal = outs[target_index]  # rates, Jacobian and tolerances at the start of the step
        field(setup, P, V, y, f0, tmp)
        jacobian(setup, P, V, y, f0, scale, jac, work, tmp)
        for a in range(n):
            if not abs(f0[a]) < 1e300:
                return NOT_FINITE
            unit[a] = rtol * (abs(y[a]) + scale[a])
        h = wanted
        while True:  # shorter until the error of the step is small enough; in the form with inertia it ends at outputs
            last_one = False
            if not regular and x + 1.0001 * h >= goal:
                h = goal - x
                last_one = True
            if not h > 1e-30 * span or h <= 1e-17 * abs(x):
                return STEP_TOO_SMALL
            if fresh or h > 20.0 * old:
                clear(guess)
            else:
                extrapolate(Z, h / old, guess)
            error = attempt(setup, P, V, y, h, f0, jac, unit, kappa, guess, F, tmp)
            if error >= 0.0 and error < 1.0:
                break
            counts[1] += 1
            if counts[0] + counts[1] >= most:
                return TOO_MANY_STEPS
            h *= 0.3 if error < 0.0 else max(0.2, 0.9 * error ** (-1.0 / (STAGES + 1)))
            wanted = h
        grown = min(8.0, 0.9 * max(error, 1e-12) ** (-1.0 / (STAGES + 1)))
        happened = NONE  # the first event on the way shortens the step, one after the other
        trial = h
        for a in range(n):
            stage[a] = y[a] + guess[STAGES - 1, a]
        for code in codes:
            value = passed(code, setup, P, stage, y, goal)
            if value > 0.0:
                found = locate(code, goal, setup, P, V, y, h, value, f0, jac, unit, kappa, guess, F, tmp)
                if found < 0.0:
                    return STEP_TOO_SMALL
                h, happened, last_one = found, code, False
                for a in range(n):
                    stage[a] = y[a] + guess[STAGES - 1, a]
        # where an inner stage lies beyond a dead centre although the end does not, the step is too long
        astray = False
        for i in range(STAGES - 1):
            q = y[0] + guess[i, 0]
            astray = astray or (regular and (q > P[HIGH] or q < P[LOW]))
        if happened == NONE and astray:
            counts[1] += 1
            wanted = 0.5 * h
            fresh = True
            continue
        for i in range(STAGES):  # balances by the quadrature of the stages
            for a in range(n):
                stage[a] = y[a] + guess[i, a]
            field(setup, P, V, stage, work, tmp)
            for k in range(4):
                sums[k] += h * A[STAGES - 1, i] * tmp[11 + k]
        copy(guess, Z)
        old, fresh = h, False
        for a in range(n):  # the step is taken
            amount[a] = Z[STAGES - 1, a]
        advance(y, low, amount)
        x = goal if last_one else x + h
        counts[0] += 1
        wanted = max(grown * trial, wanted if h < trial or last_one else 0.0)
        if happened == OUTPUT:
            y[n - 1] = goal
            low[n - 1] = 0.0
        elif happened != NONE:  # the mode changes, the event is noted, and the next step starts without a guess
            if counts[2] == marks.shape[0]:
                return TOO_MANY_EVENTS
            piece = react(happened, setup, P, y, zeros, piece)
            if happened == DEAD_CENTRE:
                low[0] = 0.0
            row = counts[2]
            marks[row, 0], marks[row, 1], marks[row, 2] = happened, x, wound
            for a in range(n):
                marks[row, 3 + a] = y[a]
            counts[2] += 1
            fresh = True
        if not regular and abs(y[0]) > LEAST_ANGLE:  # whole turns go into the count, 2 pi in two parts
            whole = math.floor(y[0] / TURN + 0.5)
            wound += int(whole)
            for a in range(n):
                amount[a] = 0.0
            amount[0] = -whole * TURN
            advance(y, low, amount)
            amount[0] = -whole * TURN_LOW
            advance(y, low, amount)
