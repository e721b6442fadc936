"""The result of a stick-slip run, and the event-driven run itself."""

from __future__ import annotations

import time
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from graphsynth.core.errors import SpecError
from graphsynth.systems.tribometer.events import EventGuard, EventPath, RunStatus, StickSlipEvent, follow

if TYPE_CHECKING:
    import pandas as pd

    from graphsynth.systems.tribometer.model import Tribometer

Array = NDArray[np.float64]
#: The error is estimated by a second run with a tolerance larger by this factor ...
_COARSER = 100.0
#: ... and with data changed by about this many units in the last place.
_PERTURBED = 4.0 * np.finfo(float).eps
#: Relative distance of a force from the friction limit below which rounding decides between stick and slip.
_TIE = 1e-13


@dataclass(frozen=True, eq=False)
class StickSlipMotion:
    """Motion of both platforms of a tribometer.

    Attributes
    ----------
    model : Tribometer
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

    model: Tribometer
    method: str
    t: Array
    x1: Array
    v1: Array
    x2: Array
    v2: Array
    friction: Array
    state: NDArray[np.int64]
    events: tuple[StickSlipEvent, ...]
    status: RunStatus
    statement: str
    end: float
    error: float
    guarantee: str
    energy_residual: float
    friction_loss: float
    drive_work: float
    damper_loss: float
    evaluations: int
    seconds: float
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
    model: Tribometer, duration: float, times: Array, rtol: float, guard: EventGuard, estimate: bool
) -> StickSlipMotion:
    """Run the hybrid automaton; see `graphsynth.systems.tribometer.model.Tribometer.event_driven`."""
    data = model.data()
    start = (0.0, model.x2, *model._start())
    follow(data, start, 1e-9 * duration, guard, rtol).at(times[:1])  # compilation is no part of the run time
    begin = time.perf_counter()
    path = follow(data, start, duration, guard, rtol)
    values = path.at(times)
    seconds = time.perf_counter() - begin
    error, events = float("nan"), _events(path, None)
    status = path.status
    if estimate:
        other = follow(_perturbed(data), start, duration, guard, _COARSER * rtol)
        events = _events(path, other)
        error = _error(values, other, times)
        if status is RunStatus.COMPLETE and not _alike(path, other):
            status, error = RunStatus.UNRELIABLE, float("nan")
    if status is RunStatus.COMPLETE and _tied(model, path):
        status, error = RunStatus.UNRELIABLE, float("nan")
    closed = model.closed_form
    drive = model.drive.motion(times)
    known = ~np.isnan(values[:, 0])
    v1 = np.where(values[:, 2] == 0.0, values[:, 1], drive.v)  # no sliding while sticking, not even by rounding
    residual, drive_work, heat, damped = _balance(model, path)
    motion = StickSlipMotion(
        model, "event-driven", times, drive.x, v1, values[:, 0],
        values[:, 1], values[:, 3],
        np.where(known, values[:, 2], 0.0).astype(np.int64), events, status, "", path.end, error,
        "exact" if closed else "estimated", residual, heat, drive_work, damped, path.steps, seconds, path,
    )  # fmt: skip
    return replace(motion, statement=_statement(motion, duration, guard))


def _perturbed(data: Array) -> Array:
    """Change mass, stiffness, normal force and drive by a few units in the last place, in different directions."""
    factors = np.ones(data.size)
    factors[[0, 3, 4]] += _PERTURBED
    factors[[1, 5, 11]] -= _PERTURBED
    return data * factors


def _alike(path: EventPath, other: EventPath) -> bool:
    """Whether two runs have the same events in the same order (a last one may fall beyond the end)."""
    a, b = path.events[:, 3], other.events[:, 3]
    count = min(a.size, b.size)
    return abs(a.size - b.size) <= 1 and bool((a[:count] == b[:count]).all()) and other.status is path.status


def _tied(model: Tribometer, path: EventPath) -> bool:
    """Whether at the end of a slip the force needed to stick equals the largest one but for rounding."""
    ends = path.nodes[1:][(path.nodes[1:, 7] == 1.0) & (path.nodes[:-1, 3] != 0.0)]
    drive = model.drive.motion(ends[:, 0])
    force = model.mass * drive.a + model.stiffness * ends[:, 1] + model.damping * drive.v
    bound = model.law.static * model.normal
    return bool((np.abs(np.abs(force) - bound) <= _TIE * bound).any())


def _events(path: EventPath, other: EventPath | None) -> tuple[StickSlipEvent, ...]:
    rows = path.events
    errors = np.full(len(rows), np.nan)
    if other is not None:
        count = min(len(rows), len(other.events))
        same = np.cumprod(rows[:count, 3] == other.events[:count, 3]).astype(bool)
        gap = np.abs(rows[:count, 0] - other.events[:count, 0]) + 2.0 * np.spacing(rows[:count, 0])
        errors[:count] = np.where(same, gap, np.nan)
    return tuple(
        StickSlipEvent(time, int(state), position, error)
        for time, state, position, error in zip(*rows[:, [0, 3, 1]].T.tolist(), errors.tolist())
    )


def _error(values: Array, other: EventPath, times: Array) -> float:
    gap = np.abs(values[:, 0] - other.at(times)[:, 0])
    gap = gap[~np.isnan(gap)]
    return float(gap.max() + np.spacing(np.nanmax(np.abs(values[:, 0])))) if gap.size else float("nan")


def _balance(model: Tribometer, path: EventPath) -> tuple[float, float, float, float]:
    """Return the scaled energy residual, the work of the drive, friction loss and damper loss."""
    nodes = path.nodes
    energy = 0.5 * model.mass * nodes[:, 2] ** 2 + 0.5 * model.stiffness * nodes[:, 1] ** 2
    drive, heat, damped = nodes[:, 4], nodes[:, 5], nodes[:, 6]
    gap = np.abs(energy - energy[0] - (drive - heat - damped)).max()
    # where next to nothing is exchanged, rounding is no defect
    floor = max(1e-4 * energy.max(), 1e-12 * model.reach**2 * model.stiffness)
    exchanged = max(np.abs(np.diff(drive)).sum(), heat[-1], damped[-1], float(np.ptp(energy)), floor)
    return float(gap / exchanged), float(drive[-1]), float(heat[-1]), float(damped[-1])


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
