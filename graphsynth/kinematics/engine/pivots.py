"""Links that turn suddenly: samples are added until the turn is seen, and what stays sudden is a passage of a pivot.

A slot through the pivot of its link is turned by the pin alone.  When the pin reaches the pivot every direction of the
link is possible, and beyond it the link points the other way in the same assembly mode: the closed form would flip it
by half a turn without a word.  The margin does not show this, because it is 1 right up to the pivot.  A pin that
passes close by turns the link by nearly half a turn, and without samples in between nobody knows in which sense.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from graphsynth.kinematics.engine import codes
from graphsynth.kinematics.engine.follow import Trace, Tracker
from graphsynth.kinematics.engine.result import MotionEvent

__all__ = ["pivot_passes", "refined"]

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
    for step in tracker.program.steps:
        if step.code != codes.R_LINE_SLOT:
            continue
        jumps = _sudden(trace, step.core[0])
        if not jumps.size:
            continue
        at = float(trace.u[jumps[0] + 1])
        blind = trace.u[np.abs(trace.u - at) <= _BLIND * float(np.abs(np.diff(trace.u)).max())]
        text = (
            f"group {step.group} ({step.kind}, links {', '.join(map(str, step.links))}): the pin passes the pivot of "
            f"link {step.core[0]} at the input {at:.12g}: the direction of the link is not determined there, so the "
            "branch after it is a choice"
        )
        width = float(abs(at - blind[0]))
        found.append(MotionEvent("change point", float(blind[0]), step.group, step.links, 2, width, True, text))
    return found
