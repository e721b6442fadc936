"""Events along a branch: where it ends and why, change points that samples step over, dead centres and dwells."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import cache

import numpy as np
from numpy.typing import NDArray

from graphsynth.kinematics.engine import codes
from graphsynth.kinematics.engine.escapes import (
    between,
    blow_up,
    centres_that_meet,
    closed_limit,
    escape_at,
    escapes,
    lost_before,
)
from graphsynth.kinematics.engine.follow import Stop, Trace, Tracker
from graphsynth.kinematics.engine.result import MotionEvent
from graphsynth.mechanism.joints import JointGeometry, Prismatic, Revolute

Array = NDArray[np.float64]

#: A margin that dips below this between samples is examined.
_NEAR = 0.2
#: ... and always below this; otherwise only if its parabola falls to half of it.
_FLAT = 1e-7
#: Part of an interval after which the slope of a margin at its end is taken.
_TINY = 1e-6
#: A smallest margin below this is reported: half the digits of the pose are lost there.
_CLOSE = 1e-8
#: A smallest margin below this is a change point: the modes meet to rounding.
_TOUCH = 1e-13
#: Margin of a dyad whose two outer points, or whose pin and pivot, coincide exactly.
_COINCIDE = -5e-324


def ending(tracker: Tracker, trace: Trace) -> MotionEvent:
    """Return the event that ended a trace, its input located."""
    assert trace.stop is not None
    stop = trace.stop
    step = tracker.program.steps[stop.step]
    if stop.code == codes.BAD_INPUT:
        bad = float(trace.u[trace.done])
        good = float(trace.u[trace.done - 1]) if trace.done else bad
        while (middle := 0.5 * (good + bad)) not in (good, bad):
            if np.isfinite(tracker.values(np.array([middle]))[:, :3]).all():
                good = middle
            else:
                bad = middle
        text = f"the driver of link {step.links[0]} has no value from the input {bad:.12g} on"
        return MotionEvent("input", bad, -1, step.links, 0, abs(bad - good), True, text)
    if trace.done == 0:
        name, text = step.name, f"{step.name} cannot be assembled at the first input"
        if step.code == codes.NEWTON:  # its modes are searched for, and some may be missed
            text = f"no pose of {name} was found at the first input; if there is one, give a start pose close to it"
        if stop.code == codes.SINGULAR:
            text = f"{name} is not held at the first input: its special dimensions let it move by itself"
        if step.code == codes.P_LINE:
            text = f"{name} has no place at the first input: its sliding directions are parallel"
        if trace.M[0, stop.step] == _COINCIDE:
            text = f"two points of {name} coincide at the first input, so that its place is not determined there"
        return MotionEvent("not assembled", stop.at, step.group, step.links, 0, 0.0, True, text)
    if stop.code == codes.UNREACHABLE:
        return _limit(tracker, trace, float(trace.u[trace.done]))
    # where a dyad folds, speeds grow without bound, and a larger group that hangs on it is lost a little before
    pair, lost = tracker.reach(trace, trace.done - 1, stop.at)
    source, at = (pair, 1) if lost is None else (trace, trace.done - 1)
    beyond = stop.at + 1e-9 * float(trace.u[-1] - trace.u[0])
    _, code, where = tracker.near(source, at, beyond)
    before = code == codes.UNREACHABLE and where < stop.step
    return _limit(tracker, trace, beyond) if before else _singular(tracker, stop)


def _limit(tracker: Tracker, trace: Trace, bad: float) -> MotionEvent:
    """Bisect for the last input at which the closed forms can be assembled."""
    assert trace.stop is not None
    source, at, good = trace, trace.done - 1, float(trace.u[trace.done - 1])
    unreachable, step_index, other = bad, trace.stop.step, None
    while (middle := between(trace, good, bad)) is not None:
        pair, stop = tracker.reach(source, at, middle)
        if stop is None:
            good = middle
            if abs(bad - good) > 1e-9:  # near the limit velocities are useless as predictors
                source, at = pair, 1
            continue
        bad = middle
        if stop.code == codes.UNREACHABLE:
            unreachable, step_index = middle, stop.step
        else:
            other = stop
    if other is not None and abs(unreachable - good) > 1e-9:
        return _singular(tracker, other.after(trace.stop))  # a larger group ends before the closed form does
    if other is not None:  # groups that hang on the limit cannot be followed to its last bits
        good, bad = closed_limit(tracker, source, at, step_index, unreachable)
    step = tracker.program.steps[step_index]
    gone = lost_before(tracker.program, step_index, tracker.reach(source, at, good)[0], good, abs(bad - good))
    if gone is not None:
        return gone
    if step.has_two_modes and tracker.near(source, at, bad)[0].M[1, step_index] == _COINCIDE:
        text = (
            f"two points of {step.name} coincide at the input {bad:.12g}: "
            "its place is not determined there, so the branch after it is a choice"
        )
        return MotionEvent("change point", bad, step.group, step.links, 2, abs(bad - good), True, text)
    if step.has_two_modes:
        text = (
            f"{step.name} is stretched or folded at the input {good:.12g}: "
            "its two modes merge and it cannot be assembled beyond"
        )
        return MotionEvent("fold", good, step.group, step.links, 2, abs(bad - good), True, text)
    why = "its sliding directions become parallel" if step.code == codes.P_LINE else "two of its points coincide"
    if step.code == codes.P_LINE:
        pair = tracker.reach(source, at, good)[0]
        sines = np.abs(pair.M[:, step_index])
        cut = codes.PARALLEL * abs(good - float(pair.u[0])) / max(float(sines[0] - sines[1]), codes.PARALLEL)
        gone = escape_at(tracker.program, step, pair, good, abs(bad - good) + cut, why)
        if gone is not None:
            return gone
    text = f"{step.name} has no place at the input {good:.12g}: {why}"
    return MotionEvent("singular", good, step.group, step.links, 0, abs(bad - good), True, text)


def _singular(tracker: Tracker, stop: Stop) -> MotionEvent:
    """Judge where a Newton group stopped: of all that happens ahead, what is nearest.

    It may happen to a group before: speeds grow without bound there, and what hangs on it is lost first.
    """
    program = tracker.program
    ahead = [*escapes(tracker, stop), *centres_that_meet(program, stop), *_folds(tracker, stop)]
    if ahead:
        nearest = min(abs(event.input - stop.at) for event in ahead)
        return next(event for event in ahead if abs(event.input - stop.at) <= 1.5 * nearest)
    step = program.steps[stop.step]
    text = (
        f"{step.name} becomes singular near the input {stop.at:.12g}: modes meet and the branch after it is ambiguous"
    )
    return MotionEvent("singular", stop.at, step.group, step.links, 0, stop.uncertainty, True, text)


def _folds(tracker: Tracker, stop: Stop) -> Iterator[MotionEvent]:
    """Folds of groups: the square of the determinant goes to zero linearly on the way to a stop."""
    way = stop.way
    for k, step in enumerate(tracker.program.steps[: stop.step + 1] if way is not None else ()):
        assert way is not None
        found = blow_up(way.u, 1.0 / np.abs(way.margins[:, k]), 3.0, (0.5,)) if step.iterative else None
        if found is not None:
            at, uncertainty, power = found
            text = (
                f"{step.name} is singular at the input {at:.12g}: two assembly modes merge and the branch ends "
                f"(the determinant goes to zero like the power {power:.2f} of the distance)"
            )
            yield MotionEvent("fold", at, step.group, step.links, 2, uncertainty, True, text)


def touches(tracker: Tracker, trace: Trace) -> list[MotionEvent]:
    """Where a dyad's margin touches zero, or dips below it between samples; at most one event ends the motion."""
    found: list[MotionEvent] = []
    for s, step in enumerate(tracker.program.steps):
        M = trace.M[: trace.done, s]
        if step.code == codes.P_LINE:
            found += _examined(tracker, trace, np.abs(M), s, _parallel_between)
        elif step.has_two_modes:
            found += _examined(tracker, trace, M, s, _touch)
            ends = {0, len(M) - 1} if trace.stop is None else {0}  # the stop has an event of its own
            for at in (float(trace.u[k]) for k in sorted(ends) if len(M) and M[k] <= _TOUCH):
                text = f"group {step.group} ({step.kind}) is stretched or folded at the input {at:.12g}: "
                text += "its two modes meet there"
                found.append(MotionEvent("change point", at, step.group, step.links, 2, 0.0, False, text))
    return found


def _examined(
    tracker: Tracker, trace: Trace, M: Array, s: int, examine: Callable[..., MotionEvent | None]
) -> list[MotionEvent]:
    """Events at the places where a margin may vanish between samples."""
    middle, u = M[1:-1], trace.u[: trace.done]
    least = (middle < _NEAR) & (middle <= M[:-2]) & (middle <= M[2:])
    # the least value of the parabola through a sample and its two neighbours, of which it is the least
    left, right = u[1:-1] - u[:-2], u[2:] - u[1:-1]
    a, b = (M[:-2] - middle) / left, (M[2:] - middle) / right
    with np.errstate(divide="ignore", invalid="ignore"):
        slope, bend = (b * left - a * right) / (left + right), (a + b) / (left + right)
        vertex = middle - 0.25 * np.nan_to_num(
            slope**2 / bend, posinf=math.inf
        )  # 0 / 0: three values that are the same
    low = np.flatnonzero(least & (vertex < np.where(middle < _FLAT, math.inf, 0.5 * middle))) + 1
    around = [(int(k) - 1, int(k), int(k) + 1) for k in low] + _outer_dips(tracker, trace, M, s)
    return [event for where in around if (event := examine(tracker, trace, where, s)) is not None]


def _outer_dips(tracker: Tracker, trace: Trace, M: Array, s: int) -> list[tuple[int, int, int]]:
    """First and last interval, if the margin falls into it from both ends and may vanish there."""
    last = trace.done - 1
    found = []
    for k, other in ((0, 1), (last, last - 1)) if last > 0 else ():
        if not M[k] < min(_NEAR, M[other]):
            continue
        step = float(trace.u[other] - trace.u[k])
        pair, why, _ = tracker.near(trace, k, float(trace.u[k]) + _TINY * step)
        rise = (abs(float(pair.M[1, s])) - M[k]) / _TINY
        fall = 0.25 * rise**2 / (M[other] - M[k] - rise) if rise < 0.0 else 0.0  # to the vertex of a parabola
        if why != codes.DONE or (rise < 0.0 and (M[k] < _FLAT or fall > 0.5 * M[k])):
            found.append((min(k, other), k, max(k, other)))
    return found


def _parallel_between(tracker: Tracker, trace: Trace, where: tuple[int, int, int], s: int) -> MotionEvent | None:
    """Escape of a link whose guides are parallel twice between samples."""
    from scipy.optimize import minimize_scalar

    first, _, last = where
    sign = math.copysign(1.0, float(trace.M[first, s]))

    def margin(u: float) -> float:
        pair, code, step = tracker.near(trace, first, u)
        return sign * float(pair.M[1, s]) if code == codes.DONE or step >= s else math.inf

    low, high = sorted((float(trace.u[first]), float(trace.u[last])))
    best = minimize_scalar(margin, bounds=(low, high), method="bounded", options={"xatol": 1e-9 * (high - low)})
    if best.fun > codes.PARALLEL:
        return None
    cut = replace(trace, done=first + 1, stop=Stop(codes.UNREACHABLE, s, float(best.x), 0.0))
    return _limit(tracker, cut, float(best.x))


def _touch(tracker: Tracker, trace: Trace, where: tuple[int, int, int], s: int) -> MotionEvent | None:
    from scipy.optimize import brentq, minimize_scalar

    first, k, last = where

    def margin(u: float) -> float:
        pair, stop = tracker.reach(trace, first, u)
        return float(pair.M[1, s]) if stop is None or stop.step >= s else math.nan

    low, high = sorted((float(trace.u[first]), float(trace.u[last])))
    best = minimize_scalar(margin, bounds=(low, high), method="bounded", options={"xatol": 1e-9 * (high - low)})
    least, at = min((float(best.fun), float(best.x)), (float(trace.M[k, s]), float(trace.u[k])))
    step = tracker.program.steps[s]
    name = step.name
    if least < -_TOUCH:
        start, uncertainty = float(trace.u[first]), 1e-14 * max(1.0, abs(at))
        try:
            at = float(brentq(margin, start, at, xtol=1e-15 * min(1.0, high - low), rtol=1e-15))
        except ValueError:  # a group before this one is lost on the way: known is only that the branch ends here
            at, uncertainty = start, abs(at - start)
        text = f"{name} is stretched or folded at the input {at:.12g}: it cannot be assembled on a stretch beyond"
        return MotionEvent("fold", at, step.group, step.links, 2, uncertainty, True, text)
    if not least <= _CLOSE:
        return None
    at = flattest(margin, at, 0.25 * (high - low))
    if least > _TOUCH:
        text = f"{name} comes close to a fold at the input {at:.12g}: its two modes nearly meet (margin {least:.2g})"
        return MotionEvent("near fold", at, step.group, step.links, 2, 1e-9, False, text)
    text = (
        f"{name} passes a change point at the input {at:.12g}: its two modes meet and both continue, so the branch "
        "after it is a choice"
    )
    return MotionEvent("change point", at, step.group, step.links, 2, 1e-12, True, text)


def flattest(value: Callable[[float], float], at: float, width: float) -> float:
    """Where the derivative vanishes: far better than a search for the smallest value, which is flat."""
    h = min(width, 1e-3)

    def slope(u: float) -> float:
        return 8.0 * (value(u + h) - value(u - h)) - (value(u + 2.0 * h) - value(u - 2.0 * h))

    x0, x1 = at - h, at + h
    f0, f1 = slope(x0), slope(x1)
    for _ in range(20):
        if f1 == f0 or not math.isfinite(f1):
            break
        x0, x1, f0 = x1, x1 - f1 * (x1 - x0) / (f1 - f0), f1
        f1 = slope(x1)
        if abs(x1 - x0) < 1e-15:
            break
    return x1 if math.isfinite(x1) and abs(x1 - at) < h else at


# --- dead centres and dwells: where the coordinate of a joint on the frame reverses, or stands still and goes on


#: Speed and acceleration of a joint coordinate at all samples of a trace.
Rate = Callable[[Trace], tuple[Array, Array]]
#: Speed at an input.
Speed = Callable[[float], float]

#: Speeds below this part of the fastest link's are rounding, or so close to a reversal that its sign is none.
_STILL = 1e-11
#: A speed that dips below this part of its neighbours between two samples is examined.
_SLOW = 0.2


def dead_centres(tracker: Tracker, trace: Trace) -> list[MotionEvent]:
    """Where the coordinate of an undriven joint on the frame reverses, and where it stands still without reversing."""
    mechanism = tracker.program.mechanism
    driven = {driver.pair for driver in mechanism.drivers}
    found: list[MotionEvent] = []
    for joint in mechanism.joints:
        if mechanism.frame not in joint.pair or joint.pair in driven or not isinstance(joint, Revolute | Prismatic):
            continue
        link = joint.b if joint.a == mechanism.frame else joint.a
        group = next((step.group for step in tracker.program.steps if link in step.links), -1)
        found += _stops(tracker, trace, _rate(joint, link), group, link)
    return found


def _rate(joint: JointGeometry, link: int) -> Rate:
    if isinstance(joint, Revolute):
        return lambda trace: (trace.V[: trace.done, link, 2], trace.W[: trace.done, link, 2])
    assert isinstance(joint, Prismatic)
    at, angle = (joint.at_b, joint.angle_a) if link == joint.b else (joint.at_a, joint.angle_b)
    back, local = np.exp(-1j * angle), complex(*at)

    def along(trace: Trace) -> tuple[Array, Array]:
        x, v, w = (part[: trace.done, link] for part in (trace.X, trace.V, trace.W))
        arm = (x[:, 2] + 1j * x[:, 3]) * local
        speed = back * (v[:, 0] + 1j * v[:, 1] + 1j * v[:, 2] * arm)
        return speed.real, (back * (w[:, 0] + 1j * w[:, 1] + (1j * w[:, 2] - v[:, 2] ** 2) * arm)).real

    return along


def _stops(tracker: Tracker, trace: Trace, rate: Rate, group: int, link: int) -> list[MotionEvent]:
    """Reversals and dwells of one coordinate, from intervals between neighbouring samples with a speed."""
    speed, slope = rate(trace)
    V = np.abs(trace.V[: trace.done])
    fastest = np.maximum(V[:, :, :2].max(axis=(1, 2)) / tracker.program.Lc, V[:, :, 2].max(axis=1))
    with np.errstate(invalid="ignore"):
        kept = np.flatnonzero(np.isfinite(speed) & (np.abs(speed) > _STILL * fastest))
    low, high = kept[:-1], kept[1:]
    turns = speed[low] * speed[high] < 0.0
    # intervals in which a speed of one sign comes close to zero or beyond, by its cubic interpolant
    sense, step = np.sign(speed[low]), trace.u[high] - trace.u[low]
    v0, v1, m0, m1 = sense * speed[low], sense * speed[high], sense * slope[low] * step, sense * slope[high] * step
    dips = np.flatnonzero((v1 > 0.0) & (m0 <= 0.0) & (m1 >= 0.0))
    t, v0, v1, m0, m1 = np.linspace(0.0, 1.0, 17)[:, None], v0[dips], v1[dips], m0[dips], m1[dips]
    cubic = v0 * (1 + 2 * t) * (1 - t) ** 2 + v1 * (3 - 2 * t) * t**2 + m0 * t * (1 - t) ** 2 - m1 * t**2 * (1 - t)
    dips = dips[cubic.min(axis=0, initial=math.inf) < _SLOW * np.maximum(v0, v1)]
    found: list[MotionEvent | None] = []
    for k in [*np.flatnonzero(turns), *dips]:
        at = _speed_from(tracker, trace, int(low[k]), rate)
        first, last = float(trace.u[low[k]]), float(trace.u[high[k]])
        found += [_reversal(at, first, last, group, link)] if turns[k] else _dip(at, first, last, group, link)
    return [event for event in found if event is not None]


def _speed_from(tracker: Tracker, trace: Trace, k: int, rate: Rate) -> Speed:
    @cache  # the ends and the zero are asked for by several
    def at(u: float) -> float:
        pair, stop = tracker.reach(trace, k, u)
        pair.done = 2
        return float(rate(pair)[0][1]) if stop is None else math.nan

    return at


def _reversal(at: Speed, low: float, high: float, group: int, link: int) -> MotionEvent | None:
    from scipy.optimize import brentq

    ends = at(low), at(high)
    if not ends[0] * ends[1] < 0.0:
        return None
    try:
        where = float(brentq(at, low, high, xtol=1e-14 * min(1.0, abs(high - low)), rtol=1e-15))
    except ValueError:  # NaN inside: the branch cannot be followed there, and that has an event of its own
        return None
    if not math.isfinite(at(where)) or abs(at(where)) > max(abs(ends[0]), abs(ends[1])):
        return None  # a pole, not a zero
    order = _order(at, where, (high - low) / 8.0)
    text = f"link {link} reverses on the frame at the input {where:.12g}"
    uncertainty = (1e-13 if order == 2 else 1e-15 ** (1.0 / (order - 1))) * max(1.0, abs(where))
    return MotionEvent("dead centre", where, group, (link,), order, uncertainty, False, text)


def _order(at: Speed, where: float, h: float) -> int:
    """First derivative of the coordinate that does not vanish at a reversal: even; 2 unless the rate is flat there."""
    near, far = abs(at(where + h)), abs(at(where + 2.0 * h))
    if not (near > 0.0 and 0.0 < far < math.inf):
        return 2
    return 2 + 2 * max(0, round((math.log2(far / near) - 1.0) / 2.0))


def _dip(at: Speed, low: float, high: float, group: int, link: int) -> list[MotionEvent | None]:
    """Two reversals if the speed changes its sign for a short while, a dwell if it vanishes, else nothing."""
    from scipy.optimize import minimize_scalar

    ends = at(low), at(high)
    sense = math.copysign(1.0, ends[0])
    best = minimize_scalar(
        lambda u: sense * at(u), bounds=(min(low, high), max(low, high)), method="bounded", options={"xatol": 1e-10}
    )
    where = float(best.x)
    size = max(abs(ends[0]), abs(ends[1]))
    if best.fun < -1e-9 * size:
        return [_reversal(at, low, where, group, link), _reversal(at, where, high, group, link)]
    if not best.fun <= 1e-6 * size:
        return []
    where = flattest(lambda u: abs(at(u)), where, 0.25 * abs(high - low))
    if not abs(at(where)) <= 1e-9 * size:
        return []
    text = f"link {link} stands still on the frame at the input {where:.12g} and goes on in the same sense"
    return [MotionEvent("dwell", where, group, (link,), 3, 1e-9, False, text)]
