"""The hybrid automaton of stick and slip: exact stick, closed-form or integrated slip, located events.

A node is a row ``(time, x2, v2, state, work of the drive, friction loss, damper loss, event)``.
"""

import math

import numpy as np

from graphsynth.core.compilation import kernel
from graphsynth.systems.tribometer.kernels.plant import (
    BELT,
    CRANK,
    DAMPING,
    DRIVE,
    GLIDE,
    GLIDE_RATE,
    HOLDING_RATE,
    KINETIC,
    LAW,
    MASS,
    NORMAL,
    RADIUS,
    RELEASE,
    ROD,
    SPEED,
    STATIC,
    STEP,
    STIFFNESS,
    STRIBECK,
    STRIBECK_LAW,
    acceleration,
    crossing,
    drive,
    glide,
    holding,
    parameters_are_closed,
    root,
    shift,
    spacing,
    step,
    value,
)

TIME, POSITION, VELOCITY, STATE, DRIVEN, HEAT, DAMPED, EVENT = 0, 1, 2, 3, 4, 5, 6, 7
WIDTH = 8
COMPLETE, FULL, STORM, STEP_LIMIT, UNRESOLVED, BROKEN = 0, 1, 2, 3, 4, 5
#: guards: most events per second, shortest dwell in units of rounding
RATE, DWELL = 0, 1
#: steps without a closed form, as parts of the scales of time
STICK_STEP, GLIDE_STEP, SLIP_STEP, FIRST_STEP = 0.01, 0.05, 0.2, 0.01
#: Gauss quadrature with three nodes on [-1, 1]
GAUSS = ((-math.sqrt(0.6), 5.0 / 9.0), (0.0, 8.0 / 9.0), (math.sqrt(0.6), 5.0 / 9.0))


@kernel
def pace(p, t):
    """Step that resolves the drive from the time ``t`` on, in seconds.

    The distance to the nearest time, in the complex plane, where the crank stands across the rod and the rod is no
    longer than the crank: there the motion has no series.
    """
    if p[DRIVE] == BELT:
        return math.inf
    fine = 1.0
    if p[DRIVE] == CRANK:
        along = math.cos(p[SPEED] * t)
        fine = min(1.0, math.sqrt((p[ROD] / p[RADIUS] - 1.0) * (p[ROD] / p[RADIUS] + 1.0) + along * along))
    return fine / abs(p[SPEED])


@kernel
def slip_scale(p, t):
    """Time that resolves the oscillation of the spring and the drive, in seconds."""
    return min(math.sqrt(p[MASS] / p[STIFFNESS]), pace(p, t))


@kernel
def release(p, t, x, end, limit, work):
    """Time since ``t`` at which a stuck platform is released (infinite if not before ``end``), and the direction.

    The third value is the number of steps; the search is given up beyond ``limit``.
    """
    bound = p[STATIC] * p[NORMAL]
    if p[DRIVE] == BELT:
        force, rate = holding(p, t, 0.0, x)
        if rate == 0.0:
            return math.inf, 0.0, 1
        side = 1.0 if rate > 0.0 else -1.0
        span = max(side * bound - force, 0.0) / rate if rate > 0.0 else min(side * bound - force, 0.0) / rate
        return (span, side, 1) if t + span < end else (math.inf, side, 1)
    low, count = 0.0, 0
    force, rate = holding(p, t, 0.0, x)
    while t + low < end and count <= limit:
        high = min(low + STICK_STEP * pace(p, t + low), end - t)
        count += 1
        after, slope = holding(p, t, high, x)
        middle = high
        if rate * slope < 0.0:
            middle = root(HOLDING_RATE, p, 1.0, t, x, 0.0, low, high, work)
            peak = holding(p, t, middle, x)[0]
            if abs(peak) > bound:
                side = math.copysign(1.0, peak)
                if side * force > bound:
                    return low, side, count
                return root(RELEASE, p, side, t, x, 0.0, low, middle, work), side, count
        if abs(after) > bound:
            side = math.copysign(1.0, after)
            start = low if middle == high else middle
            if value(RELEASE, p, side, t, x, 0.0, start, work) > 0.0:
                return start, side, count
            return root(RELEASE, p, side, t, x, 0.0, start, high, work), side, count
        low, force, rate = high, after, slope
    return math.inf, 0.0, count


@kernel
def stick_loss(p, t, x, span):
    """Work of the drive and damper loss over a stick piece, by quadrature (it does not use the energy)."""
    driven = damped = 0.0
    if p[DRIVE] == BELT:
        force = holding(p, t, 0.5 * span, x)[0]
        return force * p[SPEED] * span, p[DAMPING] * p[SPEED] ** 2 * span
    low = 0.0
    while low < span:
        h = min(STICK_STEP * pace(p, t + low), span - low)
        for place, weight in GAUSS:
            at = low + 0.5 * (1.0 + place) * h
            v1 = drive(p, t + at)[1]
            driven += 0.5 * weight * h * holding(p, t, at, x)[0] * v1
            damped += 0.5 * weight * h * p[DAMPING] * v1 * v1
        low = low + h if h < span - low else span
    return driven, damped


@kernel
def glide_until(p, s, t, x, v, end, limit, work):
    """Time since ``t`` at which a closed-form slip piece ends (infinite if not before ``end``), damper loss, steps.

    The search is given up beyond ``limit`` steps.
    """
    full = GLIDE_STEP * math.sqrt(p[MASS] / p[STIFFNESS])
    h = min(full, GLIDE_STEP * p[MASS] / p[DAMPING]) if p[DAMPING] > 0.0 else full
    low, loss, count = 0.0, 0.0, 0
    _, v1, a1, _ = drive(p, t)
    u, rate = s * (v1 - v), s * (a1 - glide(p, s, x, v, 0.0)[2])
    while t + low < end and count <= limit:
        high = min(low + min(h, GLIDE_STEP * pace(p, t + low)), end - t)
        after = value(GLIDE, p, s, t, x, v, high, work)
        slope = value(GLIDE_RATE, p, s, t, x, v, high, work)
        if u <= 0.0 and after <= 0.0:
            # the guard is zero at the start: it has to rise before it can fall
            if not (rate > 0.0 and slope < 0.0):
                return math.nan, loss, count
            low = root(GLIDE_RATE, p, s, t, x, v, low, high, work)
            u, rate = value(GLIDE, p, s, t, x, v, low, work), 0.0
            if u <= 0.0:
                return math.nan, loss, count
        found = crossing(GLIDE, p, s, t, x, v, low, high, (u, after, rate, slope), work)
        stop = high if math.isnan(found) else found
        start = low
        if count == 0:
            start = 0.0
        middle, half = 0.5 * (start + stop), 0.5 * (stop - start)
        for place, weight in GAUSS:
            speed = glide(p, s, x, v, middle + place * half)[1]
            loss += half * weight * p[DAMPING] * speed * speed
        count += 1
        if not math.isnan(found):
            return found, loss, count
        low, u, rate, h = high, after, slope, min(full, 1.1 * h)
    return math.inf, loss, count


@kernel
def slip_step(p, s, t, x, v, h, end, tolerance, work):
    """One accepted step of an integrated slip piece: its length, the next proposal, +1 if it ends the piece.

    The third value is -1 if no sliding can be resolved from a start at rest, -2 if the step breaks down.
    """
    _, v1, a1, _ = drive(p, t)
    u = s * (v1 - v)
    rate = s * (a1 - acceleration(p, s, x, v, v1)[0])
    while True:
        h = min(h, end - t)
        if h <= 4.0 * spacing(t) and t + h < end:
            return h, h, -1.0 if u <= 0.0 else -2.0
        new = step(p, s, t, x, v, h, tolerance, work)
        error = new[5]
        if not error <= 1.0:
            h *= max(0.2, 0.9 * error**-0.125) if error < 1e30 else 0.1
            continue
        _, w1, b1, _ = drive(p, t + h)
        after = s * (w1 - new[1])
        if u <= 0.0 and after <= 4.0 * spacing(w1):
            h *= 0.25
            continue
        if p[LAW] == STRIBECK_LAW and abs(after - u) > p[STRIBECK] + 0.5 * max(min(after, u), 0.0):
            # the rise of friction at rest is narrow: a step must not jump over it, nor the estimate of its error
            h *= 0.5
            continue
        slope = s * (b1 - acceleration(p, s, new[0], new[1], w1)[0])
        proposal = h * min(5.0, 0.9 * max(error, 1e-10) ** -0.125)
        found = crossing(STEP, p, s, t, x, v, 0.0, h, (u, after, rate, slope), work)
        if math.isnan(found):
            return h, proposal, 0.0
        return found, proposal, 1.0


@kernel
def advance(p, start, end, guard, tolerance, limit, nodes, memory):
    """Run from the node ``start`` to ``end``; returns the number of nodes written, the status, the steps taken.

    Status COMPLETE (end reached), FULL (no room; go on from the last node), STORM, STEP_LIMIT, UNRESOLVED or BROKEN;
    ``memory``: number of events, short dwells in a row, proposed step, times of the last events.
    """
    work = np.zeros((2, 12))
    recent = memory[3:]
    t, x, v, state = start[TIME], start[POSITION], start[VELOCITY], start[STATE]
    driven, heat, damped = start[DRIVEN], start[HEAT], start[DAMPED]
    closed, bound = parameters_are_closed(p), p[STATIC] * p[NORMAL]
    count = steps = 0
    events, short, h = int(memory[0]), memory[1], memory[2] if memory[2] > 0.0 else FIRST_STEP * slip_scale(p, t)
    while t < end:
        if count + 2 > nodes.shape[0]:
            memory[0], memory[1], memory[2] = events, short, h
            return count, FULL, steps
        if steps > limit:
            return count, STEP_LIMIT, steps
        event = 0.0
        if state == 0.0:
            span, side, taken = release(p, t, x, end, limit - steps, work)  # carried along, up to the release
            if taken > limit - steps:
                return count, STEP_LIMIT, steps + taken
            steps += 1
            arrive = min(t + span, end)
            span = min(span, end - t)
            work_done, loss = stick_loss(p, t, x, span)
            driven, damped = driven + work_done, damped + loss
            x, v = x + shift(p, t, span), drive(p, arrive)[1]
            if arrive < end:
                event, state, h = 1.0, side, FIRST_STEP * slip_scale(p, arrive)
            t = arrive
        else:
            if closed:
                # slip in closed form: one piece up to the capture
                span, loss, taken = glide_until(p, state, t, x, v, end, limit - steps, work)
                steps += taken
                if steps > limit:
                    return count, STEP_LIMIT, steps
                if math.isnan(span):
                    return count, UNRESOLVED, steps
                met = t + span < end
                span = min(span, end - t)
                force, way = state * p[NORMAL] * p[KINETIC], shift(p, t, span)
                new_x, new_v, _ = glide(p, state, x, v, span)
                driven, heat, damped = driven + force * way, heat + force * (way - (new_x - x)), damped + loss
            else:
                # slip integrated: one step, cut at the capture
                span, h, code = slip_step(p, state, t, x, v, min(h, SLIP_STEP * slip_scale(p, t)), end, tolerance, work)
                steps += 1
                if code < 0.0:
                    return count, UNRESOLVED if code == -1.0 else BROKEN, steps
                met = code > 0.0
                new_x, new_v, more, loss, lost, _ = step(p, state, t, x, v, span, tolerance, work)
                driven, heat, damped = driven + more, heat + loss, damped + lost
            x, v = new_x, new_v
            t = end if span >= end - t else t + span
            if met:
                # the platforms move alike: stick if friction can hold them together, else slip on
                v = drive(p, t)[1]
                force = holding(p, t, 0.0, x)[0]
                after = 0.0 if abs(force) <= bound else math.copysign(1.0, force)
                event = 0.0 if after == state else 1.0
                state, h = after, FIRST_STEP * slip_scale(p, t)
        nodes[count, 0], nodes[count, 1], nodes[count, 2], nodes[count, 3] = t, x, v, state
        nodes[count, 4], nodes[count, 5], nodes[count, 6], nodes[count, 7] = driven, heat, damped, event
        count += 1
        if not abs(x) + abs(v) < math.inf:
            return count, BROKEN, steps
        if event == 1.0:
            # Zeno behaviour: dwells of rounding size, or too many events within the window
            slot = events % recent.size
            short = short + 1.0 if t - recent[(events - 1) % recent.size] < guard[DWELL] * spacing(t) else 0.0
            if short >= 3.0 or t - recent[slot] < recent.size / guard[RATE]:
                return count, STORM, steps
            recent[slot] = t
            events += 1
    return count, COMPLETE, steps


@kernel
def locate(p, nodes, times, tolerance, out):
    """Position, velocity, state and friction force at each time, from the last node before it."""
    work = np.zeros((2, 12))
    closed = parameters_are_closed(p)
    for i in range(times.size):
        t = times[i]
        if not (t >= nodes[0, TIME] and t <= nodes[-1, TIME]):
            out[i, :] = math.nan
            continue
        j = np.searchsorted(nodes[:, TIME], t, side="right") - 1
        begin, x, v, s = nodes[j, TIME], nodes[j, POSITION], nodes[j, VELOCITY], nodes[j, STATE]
        span = t - begin
        v1 = drive(p, t)[1]
        if s == 0.0:
            out[i, 0], out[i, 1], out[i, 3] = x + shift(p, begin, span), v1, holding(p, begin, span, x)[0]
        else:
            if span == 0.0:
                out[i, 0], out[i, 1] = x, v
            elif closed:
                out[i, 0], out[i, 1], _ = glide(p, s, x, v, span)
            else:
                out[i, 0], out[i, 1] = step(p, s, begin, x, v, span, tolerance, work)[:2]
            out[i, 3] = acceleration(p, s, out[i, 0], out[i, 1], v1)[1]
        out[i, 2] = s
