"""Run a motor on a mechanism of one freedom: setup of the compiled integrator, checks, result with its balances."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from enum import IntEnum
from time import perf_counter

import numpy as np
from numpy.typing import ArrayLike, NDArray

from graphsynth.core.errors import SpecError
from graphsynth.dynamics.driven.setup import Plant, Prepared, output_times, prepare
from graphsynth.dynamics.motors import DCMotor, IdealTorque, Motor, SynchronousMotor, Train, number, whole

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
    *,
    angle: float = 0.0,
    speed: float = 0.0,
    currents: tuple[float, ...] | None = None,
    regular: bool = False,
    rtol: float = 1e-10,
    max_steps: int = 200_000,
    max_events: int = 2_000,
    estimate: bool = True,
    notes: tuple[str, ...] = (),
) -> DriveRun:
    """Integrate a motor, its train and a mechanism from ``times[0]`` through all ``times`` (s, strictly increasing).

    ``angle`` (rad), ``speed`` (rad/s) and ``currents`` (A; zero by default) are those of the start.  ``regular`` uses
    the regularised form ``dt = sqrt(J) ds`` (theory/motor-drive 3), which passes dead centres without inertia.
    ``rtol`` is the tolerance per step, 1e-13 to 1e-3; ``max_steps`` and ``max_events`` are guards: exceeding one is a
    reported failure.  ``estimate`` also runs at ``100 rtol`` with every other output, and reports the difference as
    ``error``.

    Raises
    ------
    SpecError
        Bad numbers; friction, no inductance or no rotor inertia where the form chosen cannot have it.
    """
    begin = perf_counter()
    out = output_times(times)
    _check_guards(rtol, max_steps, max_events)
    ready = prepare(plant, motor, train, out, angle, speed, currents, regular)
    found = _integrate(ready, out, rtol, max_steps, max_events)
    error = np.full(ready.start.size - regular, np.nan)
    if estimate and found[0] is RunStatus.DONE:
        # every other output: where the outputs limit the steps, the same outputs would hide the error
        shared = np.unique(np.concatenate([[0], np.arange(out.size - 1, 0, -2)]))
        second = _integrate(ready, out[shared], min(100.0 * rtol, 1e-2), max_steps, max_events)
        error = _difference(found, second, shared, ready, plant, regular)
        notes = notes if second[0] is RunStatus.DONE else (*notes, _NO_ESTIMATE)
    return _result(ready, plant, motor, train, out, found, error, regular, rtol, perf_counter() - begin, notes)


def _check_guards(rtol: float, max_steps: int, max_events: int) -> None:
    whole("max_steps", max_steps, "raise it for long runs")
    whole("max_events", max_events, "raise it for many events")
    if not 1e-13 <= number("rtol", rtol) <= 1e-3:
        raise SpecError(f"rtol = {rtol:g} must be from 1e-13 to 1e-3; double precision gives no more")


def _integrate(ready: Prepared, out: Array, rtol: float, max_steps: int, max_events: int) -> _Raw:
    """One run of the compiled integrator on copies of everything it changes."""
    from graphsynth.dynamics.driven.kernels import radau

    n = ready.start.size
    state, values, setup = ready.start.copy(), ready.values.copy(), ready.setup.copy()
    Y, turns = np.full((out.size, n), np.nan), np.zeros(out.size, np.int64)
    balance, marks = np.full((out.size, 6), np.nan), np.full((int(max_events), 3 + n), np.nan)
    counts = np.zeros(4, np.int64)
    status = radau.integrate(
        setup,
        values,
        ready.rows,
        ready.zeros,
        state,
        out,
        rtol,
        ready.scale,
        ready.first,
        int(max_steps),
        Y,
        turns,
        balance,
        marks,
        counts,
    )
    return RunStatus(status), Y, turns, balance, marks, counts, state


def _physical(Y: Array, turns: NDArray[np.int64], ready: Prepared, regular: bool) -> tuple[Array, Array, Array]:
    """Unwrapped angle, speed and sqrt(J) w of state rows."""
    from graphsynth.dynamics.driven.kernels import systems as s

    table = np.zeros((len(Y), 16))
    s.tabulate(ready.setup, np.ascontiguousarray(Y[:, 0]), ready.values, ready.rows, table)
    root = np.sqrt(table[:, 0])
    angle = Y[:, 0] + turns * math.tau
    if regular:
        with np.errstate(divide="ignore", invalid="ignore"):
            return angle, np.asarray(Y[:, 1] / root), Y[:, 1].copy()
    return angle, Y[:, 1].copy(), np.asarray(root * Y[:, 1])


def _difference(
    found: _Raw, second: _Raw, shared: NDArray[np.intp], ready: Prepared, plant: Plant, regular: bool
) -> Array:
    """Largest differences of angle, sqrt(J) w over the largest sqrt(J), and currents at the shared outputs."""
    n = ready.start.size - int(regular)
    if second[0] is not RunStatus.DONE:
        return np.full(n, np.nan)
    states, turns = found[1][shared], found[2][shared]
    gap = np.abs(states[:, :n] - second[1][:, :n])
    gap[:, 0] = np.abs(states[:, 0] - second[1][:, 0] + math.tau * (turns - second[2]))
    if regular:
        gap[:, 1] /= _largest_root(plant)
    return np.asarray(gap.max(axis=0))


def _largest_root(plant: Plant) -> float:
    return math.sqrt(float((np.abs(plant.rows).sum(axis=1) ** 2).sum())) or 1.0


def _result(
    ready: Prepared,
    plant: Plant,
    motor: Motor,
    train: Train,
    out: Array,
    found: _Raw,
    error: Array,
    regular: bool,
    rtol: float,
    seconds: float,
    notes: tuple[str, ...],
) -> DriveRun:
    status, Y, turns, balance, marks, counts, _ = found
    angle, speed, momentum = _physical(Y, turns, ready, regular)
    currents = Y[:, 2 : Y.shape[1] - int(regular)]
    reached = int(counts[3])
    torque = _torque(motor, speed * train.ratio, currents)
    work, moved, surplus, supplied = balance[:, 0], balance[:, 1], balance[:, 2], balance[:, 3]
    kinetic, magnetic = balance[:, 4], balance[:, 5]
    energy = _defect(kinetic - kinetic[0] - work, np.maximum.accumulate(kinetic) + moved, reached)
    electric = _defect(magnetic - magnetic[0] - surplus, np.maximum.accumulate(magnetic) + supplied, reached)
    off = float(np.fmax(energy, electric))  # NaN without a second output time only
    if status is RunStatus.DONE and not (energy <= _WARN and electric <= _WARN):
        notes = (*notes, f"the energy balance is off by {off:.1e}; tighten rtol")
    unit = "currents negligible" if currents.shape[1] == 0 else f"{currents.shape[1]} current(s)"
    name = "S (regularised, without inertia)" if regular else "J (with inertia)"
    return DriveRun(
        time=out,
        angle=angle,
        speed=speed,
        currents=currents,
        reduced_angle=Y[:, 0].copy(),
        turns=turns,
        momentum=momentum,
        motor_torque=torque,
        kinetic_energy=kinetic,
        work=work,
        energy_error=energy,
        electric_error=electric if currents.shape[1] else 0.0,
        error=error,
        events=_events(marks[: counts[2]], regular),
        status=status,
        reached=reached,
        reason=_reason(found, train, out, regular),
        model=f"{name}, {unit}",
        steps=int(counts[0]),
        rejected=int(counts[1]),
        rtol=rtol,
        seconds=seconds,
        notes=notes,
    )


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


def _defect(defect: Array, size: Array, reached: int) -> float:
    """Largest defect of a balance relative to the energy moved so far in the whole run."""
    if reached < 2:
        return math.nan
    largest = float(size[:reached].max())
    return float(np.abs(defect[:reached]).max()) / largest if largest > 0.0 else 0.0


def _torque(motor: Motor, shaft: Array, currents: Array) -> Array:
    if isinstance(motor, DCMotor):
        return np.asarray(motor.torque_constant * currents[:, 0])
    if isinstance(motor, SynchronousMotor):
        return np.asarray(1.5 * motor.pole_pairs * motor.flux * currents[:, 1])
    line = motor.reduced() if isinstance(motor, IdealTorque) else motor
    return np.asarray(line.stall - (line.slope * shaft if line.slope else 0.0 * np.abs(currents.sum(axis=1))))


def _events(marks: Array, regular: bool) -> tuple[DriveEvent, ...]:
    found = []
    for row in marks:
        state = row[3:]
        found.append(
            DriveEvent(
                kind=_EVENTS[int(row[0])],
                time=float(state[-1] if regular else row[1]),
                angle=float(state[0] + row[2] * math.tau),
                currents=tuple(map(float, state[2 : state.size - int(regular)])),
                motion=float(state[1]),
                fictitious_time=float(row[1]) if regular else math.nan,
            )
        )
    return tuple(found)
