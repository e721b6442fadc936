"""The integration loop over breaks and over motors that switch: voltage limits, the direction of the power flow."""

from __future__ import annotations

import math
from collections.abc import Collection, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from graphsynth.dynamics.motors import shaft_torque, starting_modes
from graphsynth.dynamics.result import DynamicEvent
from graphsynth.dynamics.stepping import Finding, Form, Output, SolverStatistics, StepOptions, Stepper
from graphsynth.dynamics.tables import Compiled

Array = NDArray[np.float64]

LIMIT, FLOW = 0, 1
#: Events of one motion.
_EVENTS = 2_000
KINDS = ("voltage limit", "direction of power flow")
#: Places inside a step where the switches are looked at, as parts of it; the last is its end.
_INSIDE = (0.25, 0.5, 0.75, 1.0)
#: A step that is shorter than this many spacings of its time resolves nothing.
_SHORTEST = 64.0
#: Rounding of a voltage, relative to its limit.
_ROUNDING = 1e-13


def shaft_speeds(compiled: Compiled, v: Array) -> Array:
    """Speeds of the motor shafts at velocities (..., n), shape (..., motors)."""
    column = compiled.tables.column
    found = np.zeros((*np.shape(v)[:-1], len(compiled.drives)))
    for k, drive in enumerate(compiled.drives):
        for link, sign in ((drive.a, -1.0), (drive.b, 1.0)):
            if column[link] >= 0:
                found[..., k] += sign * drive.train.ratio * v[..., column[link] + 2]
    return found


def motor_torques(compiled: Compiled, shafts: Array, currents: Array) -> Array:
    """Torques of the motors on their own shafts (..., motors) at shaft speeds (..., motors) and currents (..., all)."""
    found, first = np.empty(np.shape(shafts)), 0
    for k, drive in enumerate(compiled.drives):
        last = first + len(drive.currents)
        found[..., k] = shaft_torque(drive.equation, shafts[..., k], currents[..., first:last])
        first = last
    return found


def with_starting_modes(compiled: Compiled, v: Array) -> Compiled:
    """Return the same with the modes that its motors start in, at velocities v."""
    shafts = shaft_speeds(compiled, v)
    torques = motor_torques(compiled, shafts, compiled.currents)
    starts = [starting_modes(d.equation, w, torque) for d, w, torque in zip(compiled.drives, shafts, torques)]
    return compiled.with_modes(np.array(starts, dtype=np.int64))


class Switches:
    """Watches one piece of a motion, between switches of its motors.

    ``hit`` is the switch at which the piece ends, as (motor, what switches); ``flipped`` were at its start.
    """

    def __init__(self, form: Form, t: float, y: Array, flipped: Collection[tuple[int, int]] = ()) -> None:
        self.flipped = flipped
        self.form, self.compiled = form, form.compiled
        self.watched = [
            (k, what)
            for k, drive in enumerate(self.compiled.drives)
            for what in (LIMIT, FLOW)
            if (drive.train.efficiency < 1.0 if what == FLOW else drive.voltage_limit < math.inf)
        ]
        self.hit: tuple[int, int] | None = None
        self.value = self._values(t, y)

    def longest(self) -> float:
        """Return the longest step allowed."""
        return math.inf

    def _values(self, t: float, y: Array) -> Array:
        """Return values that are positive in the present mode, for every watched switch."""
        _, v = self.form.state(t, y)
        shafts, modes = shaft_speeds(self.compiled, v), self.compiled.tables.modes
        torques = motor_torques(self.compiled, shafts, self.compiled.currents_of(y))
        found = []
        for k, what in self.watched:
            if what == FLOW:
                found.append(modes[k, FLOW] * torques[k] * shafts[k])
                continue
            held, limit = modes[k, LIMIT], self.compiled.drives[k].voltage_limit
            asked = self._asked(k, shafts)
            found.append((held * asked - limit if held else limit - abs(asked)) + _ROUNDING * limit)
        return np.array(found)

    def _asked(self, k: int, shafts: Array) -> float:
        """Voltage that the speed controller of motor k asks for."""
        motor: Any = self.compiled.drives[k].motor
        return float(motor.gain * (motor.speed - shafts[k]))

    def look(self, stepper: Stepper, t0: float, y0: Array, solver: Any) -> Finding:
        """Look at a step from ``(t0, y0)`` that the solver has made."""
        if self.hit is not None:  # the last step before a switch
            return Finding()
        t1 = float(solver.t)
        dense = solver.dense_output() if hasattr(solver, "dense_output") else None
        for part in _INSIDE if dense is not None else (1.0,):
            at = t0 + part * (t1 - t0)
            value = self._values(at, np.asarray(solver.y if part == 1.0 or dense is None else dense(at)))
            if not np.isfinite(value).all():
                return Finding(0.5 * (t1 - t0))
            passed = np.flatnonzero(value < 0.0)
            if not passed.size:
                continue
            begun = [k for k in passed if self.value[k] > 0.0]
            if not begun:  # it turns back at once
                if at - t0 >= _SHORTEST * np.spacing(t1):
                    return Finding(0.1 * (at - t0))
                self.hit = self.watched[int(passed[0])]
                return Finding(message=self._holds(*self.hit)) if self.hit in self.flipped else Finding(at - t0, t0)
            events = [(self._located(stepper, t0, y0, at, int(k)), self.watched[k]) for k in begun]
            event, self.hit = min(events)
            return Finding(max(event - t0, np.spacing(t0)), event)
        self.value = self._values(t1, np.asarray(solver.y))
        return Finding()

    def _located(self, stepper: Stepper, t0: float, y0: Array, t1: float, k: int) -> float:
        """Time of a switch by steps of its own from the last node, to rounding."""
        from scipy.optimize import brentq

        def value(t: float) -> float:
            y = y0 if t == t0 else stepper.reached(t0, y0, t)
            return float(self._values(t, y)[k]) if y is not None else math.nan

        while not value(t1) < 0.0:  # the interpolant saw what the step does not: the first place it does
            t1 = min(t1 + 0.25 * (t1 - t0), stepper.end)
            if t1 >= stepper.end:
                return t1
        return float(brentq(value, t0, t1, xtol=4.0 * np.spacing(t1), rtol=8.9e-16))

    def _holds(self, motor: int, what: int) -> str:
        drive = self.compiled.drives[motor]
        if what == FLOW:
            return (
                f"the train of motor {drive.a}-{drive.b} (efficiency {drive.train.efficiency:g}) holds the mechanism "
                "at rest: neither the motor nor the load overcomes its losses"
            )
        return f"the voltage of motor {drive.a}-{drive.b} stays at the edge of its limit; change the limit slightly"

    def flip(self, t: float, y: Array) -> str:
        """Change the mode of the switch that was hit at a state; what to say about it."""
        assert self.hit is not None
        k, what = self.hit
        modes, drive = self.compiled.tables.modes, self.compiled.drives[k]
        name = f"motor {drive.a}-{drive.b}"
        if what == FLOW:
            modes[k, FLOW] *= -1
            return f"{name} {'drives' if modes[k, FLOW] > 0 else 'is driven by the mechanism'} from here on"
        asked = self._asked(k, shaft_speeds(self.compiled, self.form.state(t, y)[1]))
        modes[k, LIMIT] = 0 if modes[k, LIMIT] else int(math.copysign(1, asked))
        return f"the voltage of {name} {'is at its limit' if modes[k, LIMIT] else 'is below its limit'} from here on"


def integrate(
    form: Form, grid: Array, breaks: Sequence[float], options: StepOptions, output: Output
) -> SolverStatistics:
    """Integrate a formulation over the output times; how far it came is in the result.

    No step crosses a break; loads are taken from their own side of it.  ``output`` is called with index, time and state
    at every output time reached.
    """
    stats = SolverStatistics(time=float(grid[0]))
    y = form.begin()
    output(0, stats.time, y)
    inner = [t for t in breaks if grid[0] < t < grid[-1]]
    for t in inner:
        stats.events.append(DynamicEvent("break", t, 0.0, f"loads are not smooth at t = {t:.9g} s"))
    ends = [*inner, float(grid[-1])]
    watching = any(drive.switches for drive in form.compiled.drives)
    flipped: list[tuple[int, int]] = []
    while ends:
        began = stats.time
        guard = Switches(form, stats.time, y, flipped) if watching else None
        stepper = Stepper(form, stats, options, ends[0], ends[0] in inner, guard)
        last = stepper.run(y, grid, output)
        if last is None:
            break
        y = last
        if stats.time > began:
            flipped = []
        if guard is not None and guard.hit is not None:
            flipped.append(guard.hit)
            if len(stats.events) >= _EVENTS:
                stats.message = f"Zeno behaviour: more than {_EVENTS} events by t = {stats.time:.9g} s"
                break
            kind = KINDS[guard.hit[1]]
            stats.events.append(DynamicEvent(kind, stats.time, 4.0 * np.spacing(stats.time), guard.flip(stats.time, y)))
        if stats.time >= ends[0]:
            ends.pop(0)
    return stats
