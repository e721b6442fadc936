"""Links that move off to infinity, and links that turn suddenly: the branch ends there although no modes meet.

Guides that become parallel, or wheels on them, push a link away without bound while the input approaches a finite
value ``u``.  Its distance grows like ``|u - input| ** -p``, so three samples tell p and where the branch ends.

A slot through the pivot of its link is turned by the pin alone.  When the pin reaches the pivot every direction of the
link is possible, and beyond it the link points the other way in the same assembly mode: the closed form would flip it
by half a turn without a word.  The margin does not show this, because it is 1 right up to the pivot.  A pin that
passes close by turns the link by nearly half a turn, and without samples in between nobody knows in which sense.
"""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from graphsynth.kinematics.engine import codes
from graphsynth.kinematics.engine.follow import Stop, Trace, Tracker
from graphsynth.kinematics.engine.program import Program, Step
from graphsynth.kinematics.engine.result import MotionEvent

#: Cosine of the largest turn of a link between neighbouring samples that is taken as it is.
_SUDDEN = 0.5
#: Halvings after which the step of the grid has no double left in it.
_ROUNDS = 64
#: Samples this close to the passage, in steps of the unrefined grid, have directions made of rounding.
_BLIND = 1e-10


def _sudden(trace: Trace, links: slice | int) -> NDArray[np.intp]:
    """Intervals of the trace in which one of the links turns by more than the limit."""
    c, s = (trace.X[: trace.done, links, k].reshape(trace.done, -1) for k in (2, 3))
    return np.flatnonzero((c[1:] * c[:-1] + s[1:] * s[:-1] < _SUDDEN).any(axis=1))


def refined(tracker: Tracker, trace: Trace) -> Trace:
    """Follow again with more samples where a link turns by more than 60 degrees between neighbours."""
    for _ in range(_ROUNDS):
        found = _sudden(trace, slice(None)) if trace.done > 1 else np.empty(0, dtype=np.intp)
        middle = 0.5 * (trace.u[found] + trace.u[found + 1])
        new = (middle != trace.u[found]) & (middle != trace.u[found + 1])
        if not new.any():
            break
        after = found[new] + 1
        grid = np.insert(trace.u, after, middle[new])
        pose = np.column_stack([trace.X[0, :, :2], trace.angles(tracker.program, 0)])
        trace = tracker.follow(grid, pose, trace.PHI[0])
    return trace


def pivot_passes(tracker: Tracker, trace: Trace) -> list[MotionEvent]:
    """Return the first passage of every slotted link on a refined grid; each ends the motion."""
    found = []
    for step in (step for step in tracker.program.steps if step.code == codes.R_LINE_SLOT):
        jumps = _sudden(trace, step.core[0])
        if not jumps.size:
            continue
        at = float(trace.u[jumps[0] + 1])
        blind = trace.u[np.abs(trace.u - at) <= _BLIND * float(np.abs(np.diff(trace.u)).max())]
        text = (
            f"{step.name}: the pin passes the pivot of link {step.core[0]} at the input {at:.12g}: "
            "the direction of the link is not determined there, so the branch after it is a choice"
        )
        width = float(abs(at - blind[0]))
        found.append(MotionEvent("change point", float(blind[0]), step.group, step.links, 2, width, True, text))
    return found


Array = NDArray[np.float64]

#: A distance is followed over this factor at least before it is called unbounded.
_GROWTH = 1e3
#: The measured power may differ from the true one by this part.
_MISFIT = 0.2
#: An escape that its speed tells to be nearer than this, in parts of the input, is at hand.
_LEFT = 1e-9
#: Of the distance between places found from earlier and later samples, times this, the true one is sought.
_SAFETY = 3.0
#: Centres of a gear pair closer than this, over the characteristic length, meet.
_NEAR = 1e-6


def escapes(tracker: Tracker, stop: Stop) -> Iterator[MotionEvent]:
    """Links that went off to infinity on the way to a stop, group by group."""
    way = stop.way
    for k, step in enumerate(tracker.program.steps[: stop.step + 1] if way is not None else ()):
        assert way is not None
        own = way.distances[:, list(step.links)].max(axis=1)
        far = step.group >= 0 and own[-1] > max(tracker.program.far, _GROWTH * own.min())
        found = blow_up(way.u, own, 10.0, (1.0, 0.5, 2.0)) if far else None
        if found is not None:
            at, uncertainty, power = found
            if step.code == codes.P_LINE:  # the guides become parallel close to there
                source, sample = way.last
                beyond = at + 0.5 * (at - stop.at)
                _, code, where = tracker.near(source, sample, beyond)
                if code == codes.UNREACHABLE and where == k:  # else another group is lost before
                    at, bad = closed_limit(tracker, source, sample, k, beyond)
                    uncertainty = abs(bad - at)
            gone = [link for link in step.links if way.distances[-1, link] > 1e-3 * own[-1]]
            why = f"the distance grows like the power {-power:.2f} of the input left"
            yield _event(step, gone, at, uncertainty, why)


def closed_limit(tracker: Tracker, source: Trace, at: int, step: int, bad: float) -> tuple[float, float]:
    """Bisect for the limit of one closed form alone."""
    good = float(source.u[at])
    while (middle := between(source, good, bad)) is not None:
        _, code, where = tracker.near(source, at, middle)
        if code == codes.UNREACHABLE and where == step:
            bad = middle
        else:
            good = middle
    return good, bad


def between(trace: Trace, good: float, bad: float) -> float | None:
    """Input between two others; None where no double lies between, or none that matters (beside the input 0)."""
    middle = 0.5 * (good + bad)
    last = abs(bad - good) <= 1e-18 * abs(float(trace.u[-1] - trace.u[0]))
    return None if last or middle in (good, bad) else middle


def escape_at(program: Program, step: Step, pair: Trace, at: float, uncertainty: float, why: str) -> MotionEvent | None:
    """Return the event if the links of a step are far away in the last sample before a limit that is located."""
    distances = np.hypot(pair.X[1, :, 0], pair.X[1, :, 1])
    gone = [link for link in step.links if distances[link] > program.far + _GROWTH * program.Lc]
    return _event(step, gone, at, uncertainty, why) if gone else None


def lost_before(program: Program, limit: int, pair: Trace, at: float, uncertainty: float) -> MotionEvent | None:
    """Return the escape of an earlier group that is at hand in the last sample before the limit of a step.

    What hangs on a link so far away has no digits left, and is lost a little before it.
    """
    distances = np.hypot(pair.X[1, :, 0], pair.X[1, :, 1])
    for step in program.steps[:limit]:
        for link in step.links if step.group >= 0 else ():
            speed = float(np.hypot(*pair.V[1, link, :2]))
            left = 2.0 * float(distances[link]) / speed if speed > 0.0 else math.inf
            if distances[link] > program.far + _GROWTH * program.Lc and left < _LEFT * max(1.0, abs(at)):
                return escape_at(program, step, pair, at, uncertainty + left, "its distance grows without bound")
    return None


def _event(step: Step, gone: list[int], at: float, uncertainty: float, why: str) -> MotionEvent:
    links = ", ".join(map(str, gone))
    text = (
        f"link{'s' * (len(gone) > 1)} {links} of group {step.group} ({step.kind}) move{'s' * (len(gone) == 1)} off to "
        f"infinity at the input {at:.12g}: {why}"
    )
    return MotionEvent("escape", at, step.group, tuple(gone), 0, uncertainty, True, text)


def centres_that_meet(program: Program, stop: Stop) -> Iterator[MotionEvent]:
    """Gear pairs that lost their line of centres at a stop: the distance of the centres goes to zero."""
    if stop.way is None:
        return
    trace, k = stop.way.last
    for s, step in enumerate(program.steps[: stop.step + 1]):
        row0, count = program.tables.steps[s, 1:3]
        for r in range(row0, row0 + count if step.group >= 0 else row0):
            kind, a, b, _, _ = program.tables.rows[r]
            p = program.tables.row_table[0, r]
            A, A1 = _moving(trace, k, a, complex(*p[codes.PAX : codes.PAY + 1]))
            B, B1 = _moving(trace, k, b, complex(*p[codes.PBX : codes.PBY + 1]))
            d, d1 = B - A, B1 - A1
            if kind != codes.GEAR or not abs(d) < _NEAR * program.Lc or not abs(d1) > 0.0:
                continue
            at = stop.at - (d * d1.conjugate()).real / abs(d1) ** 2
            text = (
                f"the centres of the gear pair {a}-{b} of {step.name} coincide at the input {at:.12g}: "
                "their line has no direction there"
            )
            yield MotionEvent("singular", at, step.group, step.links, 0, abs(at - stop.at), True, text)


def _moving(trace: Trace, k: int, link: int, local: complex) -> tuple[complex, complex]:
    """Place and velocity of a point of a link at sample k."""
    x, v = trace.X[k, link], trace.V[k, link]
    arm = complex(x[2], x[3]) * local
    return complex(x[0], x[1]) + arm, complex(v[0], v[1]) + 1j * v[2] * arm


def blow_up(u: Array, y: Array, ratio: float, powers: tuple[float, ...]) -> tuple[float, float, float] | None:
    """Input at which a positive y, followed on the way there, becomes infinite; its uncertainty; the power of 1/y.

    None unless y grew over the square of the ratio, like one of the powers.  The last samples may be full of rounding,
    so that earlier ones tell more: taken is what agrees best with itself.
    """
    with np.errstate(divide="ignore", invalid="ignore"):
        size = np.log(y / y[-1]) / math.log(ratio)
    if not np.isfinite(size).all():
        return None
    found: list[tuple[float, float, float]] = []
    for before in (0.0, 0.5, 1.0, 1.5):
        # the last samples at which y was smaller by powers of the ratio
        picks = [np.flatnonzero(size <= -before - part + 0.05) for part in (0.0, 0.7, 1.4, 1.9)]
        if any(not pick.size for pick in picks) or len({int(pick[-1]) for pick in picks}) < len(picks):
            continue
        k = np.array([pick[-1] for pick in picks])
        for power in powers:
            z = np.exp(-(size[k] - size[k[0]]) * math.log(ratio) / power)
            at = _at_zero(z, u[k])
            left = (at - u[k[3]]) / (at - u[k[1]]) if at != u[k[1]] else 0.0
            measured = (size[k[1]] - size[k[3]]) * math.log(ratio) / math.log(left) if left > 1.0 else 0.0
            if abs(measured / power - 1.0) < _MISFIT:
                apart = max(abs(at - _at_zero(z[:3], u[k[:3]])), 1e-6 * abs(at - u[k[0]]), 1e-14 * max(1.0, abs(at)))
                found.append((apart, at, measured))
    if not found:
        return None
    apart, at, measured = min(found)
    likely = [abs(at - other) for uncertainty, other, _ in found if uncertainty <= 100.0 * apart]
    return at, float(max(apart, _SAFETY * max(likely))), measured


def _at_zero(z: Array, u: Array) -> float:
    """Value at zero of the polynomial in z through some points."""
    terms = [np.prod(np.delete(z, k) / (np.delete(z, k) - z[k])) for k in range(len(z))]
    return float(np.dot(terms, u))
