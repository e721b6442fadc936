"""Dead centres and dwells: where the coordinate of a joint on the frame reverses, or stands still and goes on."""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import cache

import numpy as np
from numpy.typing import NDArray

from graphsynth.kinematics.engine.events import flattest
from graphsynth.kinematics.engine.follow import Trace, Tracker
from graphsynth.kinematics.engine.result import MotionEvent
from graphsynth.mechanism.joints import JointGeometry, Prismatic, Revolute

Array = NDArray[np.float64]
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
    turns = np.flatnonzero(speed[low] * speed[high] < 0.0)
    dips = _dips(trace.u[high] - trace.u[low], speed[low], speed[high], slope[low], slope[high])
    found: list[MotionEvent | None] = []
    for k in turns:
        at = _speed_from(tracker, trace, int(low[k]), rate)
        found.append(_reversal(at, float(trace.u[low[k]]), float(trace.u[high[k]]), group, link))
    for k in dips:
        at = _speed_from(tracker, trace, int(low[k]), rate)
        found += _dip(at, float(trace.u[low[k]]), float(trace.u[high[k]]), group, link)
    return [event for event in found if event is not None]


def _dips(step: Array, v0: Array, v1: Array, w0: Array, w1: Array) -> NDArray[np.intp]:
    """Intervals in which a speed of one sign comes close to zero or beyond, by its cubic interpolant."""
    sense = np.sign(v0)
    v0, v1, m0, m1 = sense * v0, sense * v1, sense * w0 * step, sense * w1 * step
    found = np.flatnonzero((v1 > 0.0) & (m0 <= 0.0) & (m1 >= 0.0))
    t = np.linspace(0.0, 1.0, 17)[:, None]
    v0, v1, m0, m1 = v0[found], v1[found], m0[found], m1[found]
    cubic = v0 * (1 + 2 * t) * (1 - t) ** 2 + v1 * (3 - 2 * t) * t**2 + m0 * t * (1 - t) ** 2 - m1 * t**2 * (1 - t)
    return np.asarray(found[cubic.min(axis=0, initial=math.inf) < _SLOW * np.maximum(v0, v1)])


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
