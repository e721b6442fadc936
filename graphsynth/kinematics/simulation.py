"""`simulate`: any planar mechanism over its input, on one branch."""

from __future__ import annotations

import math
from collections.abc import Mapping
from time import perf_counter
from typing import Any, Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from graphsynth.core.angles import angles
from graphsynth.core.checks import finite_array
from graphsynth.core.errors import GeometryError
from graphsynth.kinematics.engine import codes
from graphsynth.kinematics.engine.escapes import pivot_passes, refined
from graphsynth.kinematics.engine.events import dead_centres, ending, touches
from graphsynth.kinematics.engine.follow import Stop, Trace, Tracker
from graphsynth.kinematics.engine.inputs import (
    coordinates,
    fine_grid,
    full_turn,
    monotonic,
    warn_of_degrees,
    whole_range,
)
from graphsynth.kinematics.engine.program import compile_program
from graphsynth.kinematics.engine.result import Closure, Motion, MotionEvent
from graphsynth.kinematics.engine.start import initial, started
from graphsynth.mechanism.joints import Prismatic
from graphsynth.mechanism.model import Mechanism

Array = NDArray[np.float64]

_TURNS = 12
#: Samples of a motion without inputs, and the part of a range that is left out before each of its limits.
_SAMPLES, _EDGE = 361, 1e-3
_CLOSED = 1e-9


class Found(Protocol):
    """What a search for dimensions returns, as `embody` does: its best mechanism, and what was found or why nothing."""

    @property
    def mechanism(self) -> Mechanism | None: ...  # noqa: D102
    @property
    def statement(self) -> str: ...  # noqa: D102


def simulate(
    mechanism: Mechanism | Found,
    inputs: ArrayLike | str | None = None,
    *,
    modes: Mapping[int, int] | None = None,
    start: ArrayLike | None = None,
    events: bool = True,
) -> Motion:
    """Positions, velocities and accelerations of a planar mechanism over its input, on one branch.

    Parameters
    ----------
    mechanism : Mechanism or Embodiment
        With as many drivers as its mobility; of what `embody` returns, its mechanism.
    inputs : array_like, shape (n,), or str, optional
        Inputs u in the order of the motion, strictly increasing or decreasing; each driver's law turns u into its
        coordinate (the input itself by default: radians or lengths; a `UnitWarning` is shown where turning inputs look
        like degrees, as 0 to 360 do).  Degrees are ``gs.degrees(...)``, "0..360 deg" (361 samples) or a list of texts
        with units.  Without inputs: ``mechanism.input_range``, if it has one;
        else a full rotation from the mechanism's pose on; where there is none, all that is
        reached from there in both directions, up to a thousandth of the range before each limit.
    modes : mapping of int to int, optional
        Assembly mode by group index: +1 or -1 for a dyad, the rank among all its modes at the first input for a
        larger group (0 by default).  The sign is that of the third point left of the way from the lower link's
        outer joint for RRR; see ``docs/explanation/planar-engine.md`` for the others.
    start : array_like, shape (links, 3), optional
        A pose close to the wanted branch at the first input; ``mechanism.pose`` by default.  Gives the modes that
        ``modes`` leaves open.
    events : bool, optional
        Look for dead centres and for change points between samples.

    Returns
    -------
    Motion
        Estimated (floating point).  Where the branch ends the arrays are NaN from there on, and ``reason`` and
        ``stopped_at`` say why and where.

    Raises
    ------
    GeometryError
        Inputs that are not finite or not monotonic, a mode that does not exist, or drivers that do not fit the
        mobility; an embodiment that found no mechanism.

    Examples
    --------
    >>> motion = simulate(Mechanism.four_bar(2, 1, 2.5, 2.5), np.linspace(0.0, 2.0 * np.pi, 73))
    >>> motion.completed, motion.closure.closed, motion.residual < 1e-14
    (True, True, True)
    """
    given: Any = mechanism
    found = given if isinstance(given, Mechanism) else getattr(given, "mechanism", given)
    if found is None:
        raise GeometryError(f"there is no mechanism to move: {given.statement}")
    if not isinstance(found, Mechanism):
        raise GeometryError(f"{type(given).__name__} is not a Mechanism; give one, or what embody returns")
    if inputs is None and found.input_range is not None:
        inputs = np.linspace(*found.input_range, _SAMPLES)
    if inputs is None:
        return _simulate_whole(found, modes, start, events)
    return _simulate(found, monotonic(angles("inputs", inputs)), modes, start, events)


def _simulate_whole(
    mechanism: Mechanism, modes: Mapping[int, int] | None, start: ArrayLike | None, events: bool
) -> Motion:
    """Simulate a full rotation, or all that is reached from the start in both directions."""
    first, last = whole_range(mechanism)
    forward = _simulate(mechanism, np.linspace(first, last, _SAMPLES), modes, start, events)
    sliding = isinstance(mechanism.joint(*mechanism.drivers[0].pair), Prismatic)
    if (forward.completed and not sliding) or not forward.assembled[0]:
        return forward
    backward = _simulate(mechanism, np.linspace(first, 2.0 * first - last, _SAMPLES), modes, start, events)
    low = backward.inputs[-1] if backward.completed else backward.stopped_at
    high = forward.inputs[-1] if forward.completed else forward.stopped_at
    # the limits are dead-centre positions, where velocities are infinite
    edge = _EDGE * (high - low)
    u = np.linspace(low + edge, high - edge, _SAMPLES)
    there = _simulate(mechanism, np.linspace(first, u[0], _SAMPLES), modes, start, False)
    signs = {step.group: int(there.modes[0, step.group]) for step in there.steps if step.has_two_modes}
    return _simulate(mechanism, u, signs, there.poses[-1], events)


def _simulate(
    mechanism: Mechanism, u: Array, modes: Mapping[int, int] | None, start: ArrayLike | None, events: bool
) -> Motion:
    begin = perf_counter()
    program = compile_program(mechanism)
    warn_of_degrees(mechanism, u)
    given = start if start is not None else mechanism.pose
    guess = None if given is None else finite_array("start", given)
    if guess is not None and guess.shape != (mechanism.graph.links, 3):
        raise GeometryError(f"start has shape {guess.shape}; give (x, y, theta) for {mechanism.graph.links} links")
    tracker = started(program, float(u[0]), modes or {}, guess)
    grid = fine_grid(mechanism, u)
    seed, code, step = initial(tracker, float(u[0]), modes or {}, guess)
    if code == codes.DONE:
        trace = refined(tracker, tracker.follow(grid, seed))
    else:
        trace = tracker.blank(grid)
        trace.stop = Stop(code, step, float(u[0]), 0.0)
    trace, found = _events(tracker, trace, events)
    return _motion(tracker, trace, u, found, begin)


def _events(tracker: Tracker, trace: Trace, wanted: bool) -> tuple[Trace, list[MotionEvent]]:
    """Events in order, and the trace up to the end of the branch."""
    found: list[MotionEvent] = []
    sense = 1.0 if trace.u[-1] >= trace.u[0] else -1.0
    if trace.stop is not None:
        found.append(ending(tracker, trace))
    touched = touches(tracker, trace) + pivot_passes(tracker, trace) if trace.done else []
    ends = [event for event in touched if event.ends_motion]
    if ends:  # up to the first that ends the motion
        first = min(ends, key=lambda event: sense * event.input)
        before = [event for event in touched if not event.ends_motion and sense * event.input < sense * first.input]
        touched = [*before, first]
    for touch in touched:
        if touch.ends_motion:
            found = [event for event in found if not event.ends_motion] + [touch]
            trace.done = int(np.sum(sense * trace.u < sense * touch.input))
        elif not any(event.kind == "fold" and event.input == touch.input for event in found):
            found.append(touch)
    if wanted and trace.done:
        for end in [event.input for event in found if event.ends_motion]:
            trace = tracker.approach(trace, end)
        found += dead_centres(tracker, trace)
    return trace, sorted(found, key=lambda event: sense * event.input)


def _motion(tracker: Tracker, trace: Trace, u: Array, events: list[MotionEvent], begin: float) -> Motion:
    program = tracker.program
    where = np.searchsorted(trace.u, u) if u[-1] >= u[0] else np.searchsorted(-trace.u, -u)
    # poses with continuous angles, derivatives, margins and modes by group; NaN beyond the samples reached
    n = trace.done
    kept = np.where(program.tables.need_angle, trace.TH, np.arctan2(trace.X[:, :, 3], trace.X[:, :, 2]))
    kept[:n] = np.where(program.tables.need_angle, kept[:n], np.unwrap(kept[:n], axis=0) if n else kept[:n])
    if n and tracker.turned is not None:
        kept[:n] += math.tau * np.round((tracker.turned - kept[0]) / math.tau)
    poses = np.concatenate([trace.X[:, :, :2], kept[:, :, None]], axis=2)
    groups = [k for k, step in enumerate(program.steps) if step.group >= 0]
    margins, velocities, accelerations = trace.M[:, groups], trace.V, trace.W
    modes, merged = np.zeros(margins.shape, dtype=np.int8), np.zeros(len(trace.u), dtype=bool)
    for column, k in enumerate(groups):
        if program.steps[k].has_two_modes:
            modes[:n, column] = int(tracker.modes[k])
            merged |= trace.M[:, k] <= 1e-14
        elif program.steps[k].iterative:
            modes[:n, column] = np.sign(trace.M[:n, k])
    for array in (velocities, accelerations):
        array[merged] = np.nan  # both modes meet: the velocity does not exist
        array[:, program.mechanism.frame] = 0.0
    for array in (poses, velocities, accelerations, margins):
        array[n:] = np.nan
    reached = where < n
    last = next((event for event in reversed(events) if event.ends_motion), None)
    completed = bool(reached.all()) and last is None
    closure = _closure(tracker, trace, completed, events)
    return Motion(
        mechanism=program.mechanism,
        inputs=u,
        poses=poses[where],
        velocities=velocities[where],
        accelerations=accelerations[where],
        modes=modes[where],
        margins=margins[where],
        assembled=reached,
        steps=program.steps,
        events=tuple(events),
        completed=completed,
        reason="" if last is None else last.statement,
        stopped_at=math.nan if last is None else last.input,
        closure=closure,
        Lc=program.Lc,
        seconds=perf_counter() - begin,
    )


def _closure(tracker: Tracker, trace: Trace, completed: bool, events: list[MotionEvent]) -> Closure:
    mechanism = tracker.program.mechanism
    if not completed or not full_turn(mechanism, trace.u):
        text = "not tested: the motion is incomplete" if not completed else "not tested: the inputs are no full turn"
        return Closure(False, False, math.nan, 0, (), text)
    first, last = trace.X[0], trace.X[-1]
    error, changed = _apart(tracker, first, last)
    meeting = [event for event in events if event.kind == "change point"]
    if meeting:
        text = f"not closed for certain: {meeting[0].statement}"
        return Closure(True, False, error, 0, (meeting[0].group,), text)
    if error <= _CLOSED:
        return Closure(True, True, error, 1, (), "closed after one pass over the inputs")
    period = _period(tracker, trace)
    names = ", ".join(map(str, changed)) or "none"
    text = f"after one pass over the inputs groups {names} are in another place; " + (
        f"closed after {period} passes" if period else f"not closed after {_TURNS} passes"
    )
    return Closure(True, False, error, period, changed, text)


def _apart(tracker: Tracker, first: Array, last: Array) -> tuple[float, tuple[int, ...]]:
    distance = np.abs((last - first) / [tracker.program.Lc, tracker.program.Lc, 1.0, 1.0]).max(axis=1)
    changed = tuple(
        step.group
        for step in tracker.program.steps
        if step.group >= 0 and max(distance[link] for link in step.links) > _CLOSED
    )
    return float(distance.max()), changed


def _period(tracker: Tracker, trace: Trace) -> int:
    """Return the turns until the mechanism is where it began; 0 if it is not within the limit.

    The state is carried on, angles and all, while the inputs begin again: the laws must be periodic, or driven
    angles would be out of step with those that gears count.
    """
    mechanism = tracker.program.mechanism
    span = float(trace.u[-1] - trace.u[0])
    q = [coordinates(driver, np.array([trace.u[0], trace.u[-1], trace.u[-1] + span])) for driver in mechanism.drivers]
    if not all(np.isfinite(part[0]).all() and abs(part[0][2] - 2 * part[0][1] + part[0][0]) < 1e-9 for part in q):
        return 0
    u, current = trace.u, trace
    for turn in range(2, _TURNS + 1):
        u = u + span
        pose = np.column_stack([current.X[-1, :, :2], current.angles(tracker.program, -1)])
        current = tracker.follow(u, pose, current.PHI[-1])
        if current.stop is not None:
            return 0
        if _apart(tracker, trace.X[0], current.X[-1])[0] <= _CLOSED:
            return turn
    return 0
