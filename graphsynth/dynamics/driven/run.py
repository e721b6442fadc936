"""Run a motor on a mechanism of one freedom: setup of the compiled integrator, checks, result with its balances."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from enum import IntEnum
from time import perf_counter

import numpy as np
from numpy.typing import ArrayLike, NDArray

from graphsynth.core.checks import finite, whole
from graphsynth.core.errors import SpecError
from graphsynth.dynamics.driven.setup import FROM_REST, DriveOptions, Plant, Prepared, output_times, prepare
from graphsynth.dynamics.motors import Motor, Train, shaft_torque

Array = NDArray[np.float64]
_EVENTS = {2: "dead centre", 3: "stall", 4: "voltage limit", 5: "direction of power flow"}


class RunStatus(IntEnum):
    """How an integration ended; everything but DONE is a failure, with NaN from ``reached`` on."""

    DONE = 0
    STEP_TOO_SMALL = 1
    TOO_MANY_STEPS = 2
    NOT_FINITE = 3
    TOO_MANY_EVENTS = 4
    CHANGE_POINT = 5


#: status, states, turns, balances, marks of events, counts, last state
_Raw = tuple[RunStatus, Array, NDArray[np.int64], Array, Array, NDArray[np.int64], Array]
_NO_ESTIMATE = "no error estimate: the second run, at a hundred times the tolerance, did not get there"
#: relative defect of the energy above which a result carries a warning
_WARN = 1e-9
_REASONS = {
    RunStatus.DONE: "",
    RunStatus.STEP_TOO_SMALL: "the step size vanished at t = {t:.6g} s: the model is singular there, or the tolerance "
    "is below what double precision gives; relax rtol or add inertia",
    RunStatus.TOO_MANY_STEPS: "{steps} steps were used up at t = {t:.6g} s; raise max_steps or relax rtol",
    RunStatus.NOT_FINITE: "the derivatives are not finite at t = {t:.6g} s: the mechanism cannot be assembled there or "
    "its inertia vanishes",
    RunStatus.TOO_MANY_EVENTS: "more than {events} events by t = {t:.6g} s: Zeno behaviour; raise max_events if wanted",
}


@dataclass(frozen=True)
class DriveEvent:
    """Event of a run: ``kind``, ``time`` (s), ``angle`` (rad, unwrapped), ``currents`` (A)."""

    kind: str
    time: float
    angle: float
    currents: tuple[float, ...]
    #: value of ``g w`` of the regularised form (sqrt(J) w), or w of the form with inertia
    motion: float
    #: fictitious time of the regularised form, s / (sqrt(kg) m); NaN in the form with inertia
    fictitious_time: float = math.nan


@dataclass(frozen=True, eq=False)
class DriveRun:
    """Motion of a drive at the output times; estimated, with its balances.

    ``error`` (n_states,) is the largest difference of angle, speed and currents from a second run at a hundred times
    the tolerance with every other output (NaN if not asked for); ``energy_error`` and ``electric_error`` are the
    largest relative defects of ``dE = work`` and ``d(magnetic) = supplied - lost - shaft``.  Rows from ``reached`` on
    are NaN after a failure.
    """

    time: Array
    angle: Array
    speed: Array
    currents: Array
    #: angle reduced to a turn, and whole turns: ``angle = turns 2 pi + reduced`` without loss of digits
    reduced_angle: Array
    turns: NDArray[np.int64]
    #: sqrt(J) w, finite at dead centres
    momentum: Array
    motor_torque: Array
    kinetic_energy: Array
    work: Array
    energy_error: float
    electric_error: float
    error: Array
    events: tuple[DriveEvent, ...]
    status: RunStatus
    reached: int
    reason: str
    model: str
    steps: int
    rejected: int
    rtol: float
    seconds: float
    notes: tuple[str, ...] = field(default=())

    @property
    def complete(self) -> bool:
        """Whether the last output time was reached."""
        return self.status is RunStatus.DONE


def run(
    plant: Plant,
    motor: Motor,
    train: Train,
    times: ArrayLike,
    options: DriveOptions = FROM_REST,
    notes: tuple[str, ...] = (),
) -> DriveRun:
    """Integrate a motor, its train and a mechanism from ``times[0]`` through all ``times`` (s, strictly increasing).

    `SpecError` for friction, no inductance or no rotor inertia where the form chosen cannot have it.
    """
    begin, out, rtol, regular = perf_counter(), output_times(times), options.rtol, options.regular
    whole("max_steps", options.max_steps, 1, error=SpecError)
    whole("max_events", options.max_events, 1, error=SpecError)
    if not 1e-13 <= finite("rtol", rtol, SpecError) <= 1e-3:
        raise SpecError(f"rtol = {rtol:g} must be from 1e-13 to 1e-3; double precision gives no more")
    ready = prepare(plant, motor, train, out, options)
    found = _integrate(ready, out, options)
    status, Y, turns, balance, marks, counts, _ = found
    n = ready.start.size - int(regular)
    error = np.full(n, np.nan)
    if options.estimate and status is RunStatus.DONE:
        # every other output: where the outputs limit the steps, the same outputs would hide the error
        shared = np.unique(np.concatenate([[0], np.arange(out.size - 1, 0, -2)]))
        second = _integrate(ready, out[shared], replace(options, rtol=min(100.0 * rtol, 1e-2)))
        gap = np.abs(Y[shared] - second[1])
        gap[:, 0] = np.abs(Y[shared, 0] - second[1][:, 0] + math.tau * (turns[shared] - second[2]))
        gap[:, 1] /= (math.sqrt(plant.most_inertia) or 1.0) if regular else 1.0
        if second[0] is RunStatus.DONE:
            error = gap.max(axis=0)[:n]
        else:
            notes = (*notes, _NO_ESTIMATE)
    angles, speeds, momentum = _physical(Y, turns, ready, regular)
    amperes, reached = Y[:, 2:n], int(counts[3])
    work, moved, surplus, supplied, kinetic, magnetic = balance.T
    energy = largest_defect(kinetic - kinetic[0] - work, np.maximum.accumulate(kinetic) + moved, reached)
    electric = largest_defect(magnetic - magnetic[0] - surplus, np.maximum.accumulate(magnetic) + supplied, reached)
    if status is RunStatus.DONE and not (energy <= _WARN and electric <= _WARN):
        off = float(np.fmax(energy, electric))  # NaN without a second output time only
        notes = (*notes, f"the energy balance is off by {off:.1e}; tighten rtol")
    unit = f"{n - 2} current{'s' * (n > 3)}" if n > 2 else "currents negligible"
    name = "S (regularised, without inertia)" if regular else "J (with inertia)"
    return DriveRun(
        time=out,
        angle=angles,
        speed=speeds,
        currents=amperes,
        reduced_angle=Y[:, 0].copy(),
        turns=turns,
        momentum=momentum,
        motor_torque=shaft_torque(motor, speeds * train.ratio, amperes),
        kinetic_energy=kinetic,
        work=work,
        energy_error=energy,
        electric_error=electric if n > 2 else 0.0,
        error=error,
        events=_events(marks[: counts[2]], regular),
        status=status,
        reached=reached,
        reason=_reason(found, train, out, regular),
        model=f"{name}, {unit}",
        steps=int(counts[0]),
        rejected=int(counts[1]),
        rtol=rtol,
        seconds=perf_counter() - begin,
        notes=notes,
    )


def _integrate(ready: Prepared, out: Array, options: DriveOptions) -> _Raw:
    """One run of the compiled integrator on copies of everything it changes."""
    from graphsynth.dynamics.driven.kernels import radau

    n = ready.start.size
    state, values, setup = ready.start.copy(), ready.values.copy(), ready.setup.copy()
    found = np.full((out.size, n), np.nan), np.zeros(out.size, np.int64), np.full((out.size, 6), np.nan)
    marks, counts = np.full((int(options.max_events), 3 + n), np.nan), np.zeros(4, np.int64)
    control = options.rtol, ready.scale, ready.first, int(options.max_steps)
    status = radau.integrate(setup, values, ready.rows, ready.zeros, state, out, *control, *found, marks, counts)
    return RunStatus(status), *found, marks, counts, state


def _physical(Y: Array, turns: NDArray[np.int64], ready: Prepared, regular: bool) -> tuple[Array, Array, Array]:
    """Unwrapped angle, speed and sqrt(J) w of state rows."""
    from graphsynth.dynamics.driven.kernels import systems as s

    table = np.zeros((len(Y), 16))
    s.tabulate(ready.setup, np.ascontiguousarray(Y[:, 0]), ready.values, ready.rows, table)
    root = np.sqrt(table[:, 0])
    angle, rate = Y[:, 0] + turns * math.tau, Y[:, 1].copy()
    with np.errstate(divide="ignore", invalid="ignore"):
        return (angle, rate / root, rate) if regular else (angle, rate, root * rate)


def _reason(found: _Raw, train: Train, out: Array, regular: bool) -> str:
    """Why the run ended before its last output time, and the remedy; empty if it did not."""
    status, _, _, _, marks, counts, state = found
    if status is RunStatus.DONE:
        return ""
    last = marks[: counts[2]][-20:]
    known = float(out[max(int(counts[3]) - 1, 0)])
    at = float(state[-1]) if regular else max(known, float(last[-1, 1])) if len(last) else known
    reason = _REASONS[status].format(t=at, steps=int(counts[0] + counts[1]), events=len(marks))
    kinds = {_EVENTS[int(code)] for code in last[:, 0]}
    if status is RunStatus.TOO_MANY_EVENTS and {"direction of power flow", "stall"} <= kinds:
        reason += (
            f"; the train (efficiency {train.efficiency:g}) holds the mechanism at rest: neither torque overcomes it"
        )
    dead = last[last[:, 0] == 2]
    if regular and len(dead) and (last[-4:, 0] == 3).any() and abs(dead[-1, 3] - last[-1, 3]) < 1e-5:
        reason += "; it comes to rest at a dead centre, where model S ends: give J_0 > 0"
    return reason


def largest_defect(defect: Array, size: Array, reached: int) -> float:
    """Largest defect of a balance relative to the energy moved so far in the whole run."""
    if reached < 2:
        return math.nan
    largest = float(size[:reached].max())
    return float(np.abs(defect[:reached]).max()) / largest if largest > 0.0 else 0.0


def _events(marks: Array, regular: bool) -> tuple[DriveEvent, ...]:
    found = []
    for code, at, turns, *state in marks.tolist():
        time, fictitious = (state.pop(), at) if regular else (at, math.nan)
        angle, motion, *amperes = state
        kind = _EVENTS[int(code)]
        found.append(DriveEvent(kind, time, angle + turns * math.tau, tuple(amperes), motion, fictitious))
    return tuple(found)
