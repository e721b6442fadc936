"""The result of a stick-slip run; the hybrid automaton with its bounds against Zeno behaviour and located events."""

from __future__ import annotations

import math
import time
from dataclasses import dataclass, field, replace
from enum import Enum
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from graphsynth.core.errors import SpecError
from graphsynth.systems.tribometer.platforms import Platforms, positive

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

    Parameters
    ----------
    rate : float
        Most events per second, over a window of ``window`` events.
    window : int
        Events over which the rate is taken; a shorter burst passes.
    dwell : float
        A dwell below this multiple of the spacing of floating-point times is too short; three in a row stop the run.
    steps : int
        Most steps of a run.

    Raises
    ------
    SpecError
        If a bound is not positive.

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
        positive("event rate bound", self.rate)
        positive("shortest dwell", self.dwell, or_zero=True)
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
    """Motion of both platforms of a tribometer.

    Attributes
    ----------
    model : Platforms
    method : str
        "event-driven", "time stepping" or "regularised (solver)".
    t, x1, v1, x2, v2 : ndarray, shape (n,)
        Times (s), displacement and velocity of the lower and the upper platform (m, m/s); NaN after an early end.
    friction : ndarray, shape (n,)
        Friction force on the upper platform, N.
    state : ndarray of int, shape (n,)
        0 stick, +1 and -1 slip.  The regularised form never sticks: the sign of the sliding velocity.
    events : tuple of StickSlipEvent
        Changes of the contact; none from the regularised form.
    status : RunStatus
    statement : str
        One sentence: how the run ended, and the remedy where there is one.
    end : float
        Time up to which the motion is known, s.
    error : float
        Estimate of the largest error of ``x2`` at the times ``t``, m.
    guarantee : str
        "exact" (closed-form pieces joined at roots found to rounding) or "estimated".
    energy_residual : float
        Largest ``|E(t) - E(0) - W(t)|`` over the larger of the range of ``E`` and the energy exchanged, at least a
        ten-thousandth of ``E``; NaN if not known (regularised form).  W is integrated beside the motion and not derived
        from it.
    friction_loss, drive_work, damper_loss : float
        Energies since the start, J; NaN if not known.
    evaluations : int
        Steps of the automaton or of time stepping, calls of the right-hand side of a solver.
    seconds : float
        Wall time of the solution without the estimate of its error.
    """

    model: Platforms
    method: str
    t: Array
    x1: Array
    v1: Array
    x2: Array
    v2: Array
    friction: Array
    state: NDArray[np.int64]
    status: RunStatus
    statement: str
    end: float
    error: float
    evaluations: int
    seconds: float
    events: tuple[StickSlipEvent, ...] = ()
    guarantee: str = "estimated"
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
        """Evaluate an event-driven motion anywhere, with the accuracy of its steps.

        Parameters
        ----------
        times : array_like, shape (n,)

        Returns
        -------
        ndarray, shape (n, 4)
            x2, v2, state, friction force; NaN outside of the run.

        Raises
        ------
        SpecError
            If the motion comes from another method.
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


def event_driven(
    model: Platforms, duration: float, times: Array, rtol: float, guard: EventGuard, estimate: bool
) -> StickSlipMotion:
    """Run the hybrid automaton; see `graphsynth.systems.tribometer.model.Tribometer.event_driven`."""
    data = model.data()
    start = (0.0, model.x2, *model.start())
    follow(data, start, 1e-9 * duration, guard, rtol).at(times[:1])  # compilation is no part of the run time
    begin = time.perf_counter()
    path = follow(data, start, duration, guard, rtol)
    values = path.at(times)
    seconds = time.perf_counter() - begin
    error, status, other = math.nan, path.status, None
    if estimate:
        other = follow(_perturbed(data), start, duration, guard, _COARSER * rtol)
        error = _error(values[:, 0], other.at(times)[:, 0])
    if status is RunStatus.COMPLETE and ((other is not None and not _alike(path, other)) or _tied(model, path)):
        status, error = RunStatus.UNRELIABLE, math.nan
    x2, v2, state, friction = values.T
    drive = model.drive.motion(times)
    motion = StickSlipMotion(
        model=model,
        method="event-driven",
        t=times,
        x1=drive.x,
        v1=np.where(state == 0.0, v2, drive.v),  # no sliding while sticking, not even by rounding
        x2=x2,
        v2=v2,
        friction=friction,
        state=np.nan_to_num(state).astype(np.int64),
        events=_events(path, other),
        status=status,
        statement="",
        end=path.end,
        error=error,
        guarantee="exact" if model.closed_form else "estimated",
        energy_residual=_residual(model, path),
        friction_loss=float(path.columns.heat[-1]),
        drive_work=float(path.columns.driven[-1]),
        damper_loss=float(path.columns.damped[-1]),
        evaluations=path.steps,
        seconds=seconds,
        path=path,
    )
    return replace(motion, statement=_statement(motion, duration, guard))


def _perturbed(data: Array) -> Array:
    """Change mass, stiffness, normal force and drive by a few units in the last place, in different directions."""
    factors = np.ones(data.size)
    factors[[0, 3, 4]] += _PERTURBED
    factors[[1, 5, 11]] -= _PERTURBED
    return data * factors


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


def _error(x2: Array, other: Array) -> float:
    gap = np.abs(x2 - other)
    gap = gap[~np.isnan(gap)]
    return float(gap.max() + np.spacing(np.nanmax(np.abs(x2)))) if gap.size else math.nan


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
    if motion.status is RunStatus.COMPLETE:
        return f"{found} events in {duration:g} s."
    if motion.status is RunStatus.UNRELIABLE:
        return (
            f"{found} events in {duration:g} s, but rounding or the tolerance decides between stick and slip at one of "
            "them: the motion is too sensitive for this precision; shorten the run or change the data slightly."
        )
    if motion.status is RunStatus.STORM:
        return (
            f"Zeno behaviour: {stopped} after {found} events, the shortest dwell {motion.shortest_dwell:.3g} s "
            f"(bound {guard.rate:g} events per second); use time_stepping, or raise the rate of the guard."
        )
    if motion.status is RunStatus.STEP_LIMIT:
        return (
            f"Step limit: {stopped} after {motion.evaluations} steps (bound {guard.steps}); "
            "use time_stepping, or raise the steps of the guard."
        )
    if motion.status is RunStatus.UNRESOLVED:
        return (
            f"Unresolved contact: {stopped}, the sliding that begins there is below the rounding of the velocities; "
            "use time_stepping, or change the data slightly to see which side it falls on."
        )
    return f"Failed: {stopped}, the numbers left the range of floating point; scale the data."
