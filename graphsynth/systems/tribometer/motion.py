"""The result of a stick-slip run; the hybrid automaton with its bounds against Zeno behaviour and located events."""

from __future__ import annotations

import math
import time
from dataclasses import dataclass, field, replace
from enum import Enum
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from graphsynth.core.checks import finite, finite_array, not_negative, positive
from graphsynth.core.errors import SpecError
from graphsynth.systems.tribometer.platforms import Platforms

if TYPE_CHECKING:
    import pandas as pd

Array = NDArray[np.float64]
#: Rows of nodes of the first part of a run, and of a part at most.
_FIRST, _LARGEST = 256, 1 << 16
#: The error is estimated by a second run with a tolerance larger by this factor ...
_COARSER = 100.0
#: ... and with data changed by about this many units in the last place.
_PERTURBED = 4.0 * np.finfo(float).eps
#: Relative distance of a force from the friction limit below which rounding decides between stick and slip.
_TIE = 1e-13


class RunStatus(Enum):
    """How a run ended; only `COMPLETE` reached the time asked for and is to be trusted as it stands."""

    COMPLETE = "complete"
    UNRELIABLE = "unreliable"
    STORM = "Zeno behaviour"
    STEP_LIMIT = "step limit"
    UNRESOLVED = "unresolved contact"
    FAILED = "failed"


#: By the codes of the kernels; the second, no room for more nodes, ends no run.
_CODES = (
    RunStatus.COMPLETE,
    RunStatus.COMPLETE,
    RunStatus.STORM,
    RunStatus.STEP_LIMIT,
    RunStatus.UNRESOLVED,
    RunStatus.FAILED,
)


class StickSlipEvent(NamedTuple):
    """A change of the contact: time (s), new state (0 stick, +1 or -1 slip), position x2 (m), error of the time (s).

    The error is an estimate; it is NaN where nothing could be estimated.
    """

    time: float
    state: int
    position: float
    error: float

    @property
    def name(self) -> str:
        """Name of the new state: ``STICK``, ``SLIP(+1)`` or ``SLIP(-1)``."""
        return "STICK" if self.state == 0 else f"SLIP({self.state:+d})"


@dataclass(frozen=True)
class EventGuard:
    """Bounds beyond which the exact automaton stops with the status "Zeno behaviour".

    At most ``rate`` events per second over ``window`` events (a shorter burst passes), at most ``steps`` steps; three
    dwells in a row below ``dwell`` times the spacing of floating-point times stop the run too.

    Examples
    --------
    >>> EventGuard(rate=500).window
    64
    """

    rate: float = 2000.0
    window: int = 64
    dwell: float = 64.0
    steps: int = 1_000_000

    def __post_init__(self) -> None:
        positive("event rate bound", self.rate, SpecError)
        not_negative("shortest dwell", self.dwell, SpecError)
        for name in ("window", "steps"):
            if not isinstance(getattr(self, name), int) or getattr(self, name) < 1:
                raise SpecError(f"The {name} of an event guard is {getattr(self, name)!r}; give a whole number from 1.")


class Columns(NamedTuple):
    """Columns of the nodes of a run.

    Time, x2, v2, state from there on; work of the drive, friction loss and damper loss since the start (J); 1 at an
    event.
    """

    t: Array
    x: Array
    v: Array
    state: Array
    driven: Array
    heat: Array
    damped: Array
    event: Array


@dataclass(frozen=True, eq=False)
class EventPath:
    """The nodes of one run of the automaton, shape (n, 8), see `Columns`; how it ended, and the steps it took.

    ``data`` are those of the kernels, ``tolerance`` the relative one of integrated pieces.
    """

    nodes: Array
    status: RunStatus
    data: Array = field(repr=False)
    tolerance: float
    steps: int

    @property
    def columns(self) -> Columns:
        """The nodes column by column."""
        return Columns(*self.nodes.T)

    @property
    def events(self) -> Columns:
        """The nodes that are events."""
        return Columns(*self.nodes[self.columns.event == 1.0].T)

    @property
    def stored(self) -> Array:
        """Energy of platform and spring at every node, J."""
        mass, stiffness = self.data[:2]
        found: Array = 0.5 * mass * self.columns.v**2 + 0.5 * stiffness * self.columns.x**2
        return found

    @property
    def end(self) -> float:
        """Time up to which the motion is known, s."""
        return float(self.nodes[-1, 0])

    def at(self, times: Array) -> Array:
        """Position, velocity, state, friction force at each time, shape (n, 4); NaN outside of the run."""
        from graphsynth.systems.tribometer.kernels.automaton import locate

        out = np.empty((times.size, 4))
        locate(self.data, self.nodes, times, self.tolerance, out)
        return out


def follow(
    data: Array, start: tuple[float, float, float, float], end: float, guard: EventGuard, tolerance: float
) -> EventPath:
    """Run the automaton from ``start`` (time, x2, v2, state) to the time ``end``."""
    from graphsynth.systems.tribometer.kernels.automaton import FULL, advance

    node = np.array([*start, 0.0, 0.0, 0.0, 0.0])
    bounds = np.array([guard.rate, guard.dwell])
    parts, steps, size, code = [node[None]], 0, _FIRST, FULL
    memory = np.concatenate([[0.0, 0.0, 0.0], np.full(guard.window, -math.inf)])
    while code == FULL:
        room = np.empty((size, 8))
        count, code, taken = advance(data, node, end, bounds, tolerance, guard.steps - steps, room, memory)
        parts.append(room[:count])
        steps += taken
        if count:
            node = room[count - 1]
        size = min(4 * size, _LARGEST)
    return EventPath(np.concatenate(parts), _CODES[code], data, tolerance, steps)


@dataclass(frozen=True, eq=False)
class StickSlipMotion:
    """Motion of both platforms of a tribometer: at times ``t`` (s), place and velocity of the lower and the upper one.

    Arrays have the shape (n,), in m, m/s and N (``friction`` on the upper platform), and are NaN after an early end.
    Energies are those since the start, J, NaN if not known.
    """

    model: Platforms
    method: str  #: "event-driven", "time stepping" or "regularised (solver)"
    t: Array
    x1: Array
    v1: Array
    x2: Array
    v2: Array
    friction: Array
    state: NDArray[np.int64]  #: 0 stick, +1 and -1 slip; of the regularised form the sign of the sliding velocity
    status: RunStatus
    statement: str  #: how the run ended, and the remedy where there is one
    end: float  #: time up to which the motion is known, s
    error: float  #: estimate of the largest error of ``x2`` at the times ``t``, m
    evaluations: int  #: steps, or calls of the right-hand side of a solver
    seconds: float  #: wall time without the estimate of the error
    events: tuple[StickSlipEvent, ...] = ()
    guarantee: str = "estimated"  #: or "exact": closed-form pieces joined at roots found to rounding
    #: Largest ``|E(t) - E(0) - W(t)|`` over the larger of the range of ``E`` and the energy exchanged, at least a
    #: ten-thousandth of ``E``; W is integrated beside the motion and not derived from it.
    energy_residual: float = math.nan
    friction_loss: float = math.nan
    drive_work: float = math.nan
    damper_loss: float = math.nan
    path: EventPath | None = field(default=None, repr=False)

    @property
    def complete(self) -> bool:
        """Whether the run reached its end with nothing to object to."""
        return self.status is RunStatus.COMPLETE

    @property
    def shortest_dwell(self) -> float:
        """Shortest time between two events, s; infinite with fewer than two."""
        times = np.array([event.time for event in self.events])
        return float(np.diff(times).min()) if times.size > 1 else float("inf")

    @property
    def sliding(self) -> Array:
        """Sliding velocity ``u = v1 - v2``, m/s; exactly zero while sticking."""
        return self.v1 - self.v2

    def at(self, times: object) -> Array:
        """Return x2, v2, state, friction force of an event-driven motion at any times, shape (n, 4).

        With the accuracy of its steps, NaN outside of the run; `SpecError` for a motion by another method.
        """
        if self.path is None:
            raise SpecError(f"A motion by {self.method} is known at its own times only; use an event-driven run.")
        return self.path.at(np.atleast_1d(np.asarray(times, float)))

    def to_pandas(self) -> pd.DataFrame:
        """Return the curves as a table, one row for each time."""
        import pandas as pd

        names = ("t", "x1", "v1", "x2", "v2", "friction", "state")
        return pd.DataFrame({name: getattr(self, name) for name in names})

    def events_to_pandas(self) -> pd.DataFrame:
        """Return the events as a table."""
        import pandas as pd

        rows = [(event.time, event.name, event.position, event.error) for event in self.events]
        return pd.DataFrame(rows, columns=["time", "state", "x2", "error"])


def motion_of(
    model: Platforms, method: str, times: Array, values: Array, *, sticks: bool = False, **more: Any
) -> StickSlipMotion:
    """Return the motion from x2, v2, state and friction at the times, shape (4, n), and its other fields.

    With ``sticks`` nothing slides while the state is 0, not even by rounding.
    """
    (x2, v2, state, friction), drive = values, model.drive.motion(times)
    v1 = np.where(sticks & (state == 0.0), v2, drive.v)
    known = np.nan_to_num(state).astype(np.int64)
    return StickSlipMotion(model, method, times, drive.x, v1, x2, v2, friction, known, **more)


def output_times(duration: float, times: ArrayLike | None) -> tuple[float, Array]:
    """Check the final time and the times of the curves, s; 1001 equal steps if these are not given."""
    duration = positive("duration", duration, SpecError)
    if times is None:
        return duration, np.linspace(0.0, duration, 1001)
    wanted = np.atleast_1d(finite_array("times", times, SpecError, nan=True))
    if wanted.ndim != 1 or not wanted.size or not ((wanted >= 0.0) & (wanted <= duration)).all():
        raise SpecError(f"The times asked for must be numbers between 0 and the duration {duration:g}.")
    if (np.diff(wanted) < 0.0).any():
        raise SpecError("The times asked for have to be in ascending order; sort them.")
    return duration, wanted


def event_driven(
    self: Platforms,
    duration: float = 10.0,
    *,
    times: ArrayLike | None = None,
    rtol: float = 1e-14,
    guard: EventGuard | None = None,
    estimate: bool = True,
) -> StickSlipMotion:
    """Run the hybrid automaton: stick exactly, slip in smooth pieces, events located to rounding.

    ``rtol`` (1e-14 to 1e-3) is that of integrated slip pieces; closed-form pieces need none.  The errors are estimated
    by a second run with a larger tolerance and slightly changed data.  With a ``status`` other than
    `RunStatus.COMPLETE` the motion is that up to where the run stopped; `SpecError` if a number is out of its bounds.
    """
    duration, times = output_times(duration, times)
    if not 1e-14 <= finite("relative tolerance", rtol, SpecError) <= 1e-3:
        raise SpecError(f"The relative tolerance is {rtol:g}; give a number from 1e-14 to 1e-3.")
    guard = guard or EventGuard()
    data = self.data()
    start = (0.0, self.x2, *self.start())
    follow(data, start, 1e-9 * duration, guard, rtol).at(times[:1])  # compilation is no part of the run time
    begin = time.perf_counter()
    path = follow(data, start, duration, guard, rtol)
    values = path.at(times)
    seconds = time.perf_counter() - begin
    error, status, other = math.nan, path.status, None
    if estimate:
        # mass, stiffness, normal force and drive by a few units in the last place, in different directions
        factors = np.ones(data.size)
        factors[[0, 3, 4]] += _PERTURBED
        factors[[1, 5, 11]] -= _PERTURBED
        other = follow(data * factors, start, duration, guard, _COARSER * rtol)
        gap = np.abs(values[:, 0] - other.at(times)[:, 0])
        error = (
            float(np.nanmax(gap) + np.spacing(np.nanmax(np.abs(values[:, 0])))) if not np.isnan(gap).all() else error
        )
    if status is RunStatus.COMPLETE and ((other is not None and not _alike(path, other)) or _tied(self, path)):
        status, error = RunStatus.UNRELIABLE, math.nan
    motion = motion_of(
        self,
        "event-driven",
        times,
        values.T,
        sticks=True,
        events=_events(path, other),
        status=status,
        statement="",
        end=path.end,
        error=error,
        guarantee="exact" if self.closed_form else "estimated",
        energy_residual=_residual(self, path),
        friction_loss=float(path.columns.heat[-1]),
        drive_work=float(path.columns.driven[-1]),
        damper_loss=float(path.columns.damped[-1]),
        evaluations=path.steps,
        seconds=seconds,
        path=path,
    )
    return replace(motion, statement=_statement(motion, duration, guard))


def _alike(path: EventPath, other: EventPath) -> bool:
    """Whether two runs have the same events in the same order (a last one may fall beyond the end)."""
    a, b = path.events.state, other.events.state
    count = min(a.size, b.size)
    return abs(a.size - b.size) <= 1 and bool((a[:count] == b[:count]).all()) and other.status is path.status


def _tied(model: Platforms, path: EventPath) -> bool:
    """Whether at the end of a slip the force needed to stick equals the largest one but for rounding."""
    c = path.columns
    ends = np.flatnonzero((c.event[1:] == 1.0) & (c.state[:-1] != 0.0)) + 1
    drive = model.drive.motion(c.t[ends])
    force = model.mass * drive.a + model.stiffness * c.x[ends] + model.damping * drive.v
    bound = model.law.static * model.normal
    return bool((np.abs(np.abs(force) - bound) <= _TIE * bound).any())


def _events(path: EventPath, other: EventPath | None) -> tuple[StickSlipEvent, ...]:
    own = path.events
    errors = np.full(own.t.size, np.nan)
    if other is not None:
        second = other.events
        count = min(own.t.size, second.t.size)
        same = np.cumprod(own.state[:count] == second.state[:count]).astype(bool)
        gap = np.abs(own.t[:count] - second.t[:count]) + 2.0 * np.spacing(own.t[:count])
        errors[:count] = np.where(same, gap, np.nan)
    rows = zip(own.t.tolist(), own.state.astype(int).tolist(), own.x.tolist(), errors.tolist())
    return tuple(StickSlipEvent(*row) for row in rows)


def _residual(model: Platforms, path: EventPath) -> float:
    """Largest gap of the energy balance over what is exchanged."""
    c, energy = path.columns, path.stored
    gap = np.abs(energy - energy[0] - (c.driven - c.heat - c.damped)).max()
    # where next to nothing is exchanged, rounding is no defect
    floor = max(1e-4 * energy.max(), 1e-12 * model.reach**2 * model.stiffness)
    exchanged = max(np.abs(np.diff(c.driven)).sum(), c.heat[-1], c.damped[-1], float(np.ptp(energy)), floor)
    return float(gap / exchanged)


def _statement(motion: StickSlipMotion, duration: float, guard: EventGuard) -> str:
    found, stopped = len(motion.events), f"stopped at {motion.end:.9g} s of {duration:g} s"
    sentences = {
        RunStatus.COMPLETE: f"{found} events in {duration:g} s.",
        RunStatus.UNRELIABLE: f"{found} events in {duration:g} s, but rounding or the tolerance decides between stick "
        "and slip at one of them: the motion is too sensitive for this precision; shorten the run or change the data "
        "slightly.",
        RunStatus.STORM: f"Zeno behaviour: {stopped} after {found} events, the shortest dwell "
        f"{motion.shortest_dwell:.3g} s (bound {guard.rate:g} events per second); use time_stepping, or raise the rate "
        "of the guard.",
        RunStatus.STEP_LIMIT: f"Step limit: {stopped} after {motion.evaluations} steps (bound {guard.steps}); use "
        "time_stepping, or raise the steps of the guard.",
        RunStatus.UNRESOLVED: f"Unresolved contact: {stopped}, the sliding that begins there is below the rounding of "
        "the velocities; use time_stepping, or change the data slightly to see which side it falls on.",
        RunStatus.FAILED: f"Failed: {stopped}, the numbers left the range of floating point; scale the data.",
    }
    return sentences[motion.status]
