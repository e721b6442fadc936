"""Motions with dry friction, piece by piece: sliding and sticking by the forms, rest by how long friction holds."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from graphsynth.core.errors import GeometryError
from graphsynth.dynamics.friction.guard import Guard
from graphsynth.dynamics.friction.loads import FrictionRows, locked
from graphsynth.dynamics.friction.problem import FrictionProblem, FrictionSolution, Senses
from graphsynth.dynamics.friction.state import Piece, decide, state_values
from graphsynth.dynamics.result import DynamicEvent, FrictionHistory
from graphsynth.dynamics.start import StartReport
from graphsynth.dynamics.stepping import NO_LOADS, Form, SolverStatistics, StepOptions, Stepper
from graphsynth.dynamics.tables import BY_SPEED, Compiled

Array = NDArray[np.float64]

#: Steps of the search over the whole time: the longest, and the first.
_LONGEST, _FIRST = 1.0 / 400.0, 1e-5
#: How far a value may lie from the line through its neighbours, as a part of what is left.
_BENT = 0.02


class RestForm(Form):
    """State ``(work,)`` of a mechanism whose every joint is held."""

    name = "rest"

    def __init__(self, compiled: Compiled, q: Array, slots: Array) -> None:
        super().__init__(compiled, np.zeros(1))
        self.slots, self._q = slots, q

    def state(self, t: float, y: Array) -> tuple[Array, Array]:
        """Coordinates and velocities."""
        return self._q, np.zeros_like(self._q)


def rest_until(guard: Guard, t: float, end: float, first: float, last: float) -> float:
    """Time to which nothing moves: ``end``, or that of the release of ``guard.hit``.

    Loads that do not depend on time hold for ever; others are followed in steps over which they are nearly straight.
    """
    piece = guard.piece
    if not piece.rows.compiled.applied or not piece.stuck:
        return end
    q, v = guard.form.state(t, guard.form.begin())
    latest = float(np.nextafter(end, -np.inf)) if end < last else end
    stuck = list(piece.stuck)

    def left(at: float) -> Array:
        return np.asarray(state_values(piece, min(at, latest), q, v, guard._slots)[0][stuck])

    span = last - first
    step, low, before = _FIRST * span, t, left(t)
    while low < end:
        high = min(low + step, end)
        middle, after = left(0.5 * (low + high)), left(high)
        if (middle < 0.0).any() or (after < 0.0).any():
            if high - low <= 4.0 * np.spacing(high):
                guard.hit, guard.uncertainty = stuck[int(np.argmin(np.minimum(middle, after)))], high - low
                return low
            step = 0.5 * (high - low)
            if (before < 0.0).any():
                guard.hit, guard.uncertainty = stuck[int(np.argmin(before))], 0.0
                return low
            continue
        bent = np.abs(middle - 0.5 * (before + after)).max() > _BENT * np.minimum(before, after).min()
        if bent and step > 1e-12 * span:
            step = 0.5 * (high - low)
            continue
        low, before, step = high, after, min(2.0 * step, _LONGEST * span)
    return end


#: Events per window of time beyond which a run stops: as of the tribometer.
_WINDOW, _RATE, _DWELL = 64, 2000.0, 64.0
#: Factor of the return of the loads from which a failure is one of friction.
_NEARLY = 0.9
#: Rate of a joint held by others (m/s, rad/s) from which its friction counts.
_QUIET = 1e-12


@dataclass
class DryMotion:
    """The motion of a model with dry friction; a workspace.

    ``make`` gives the formulation of a compiled model and a start, ``scales`` the natural sizes of its state; ``show``
    is called with form, index, time, state and senses at every output time.
    """

    rows: FrictionRows
    report: StartReport
    make: Callable[[Compiled, StartReport], Form]
    scales: Callable[[Form], Array]
    show: Callable[[Form, int, float, Array, Senses | None], None]
    loss: float = 0.0
    contraction: float = 0.0
    changes: list[tuple[float, str]] = field(default_factory=list)
    form: Form = field(init=False)
    stats: SolverStatistics = field(default_factory=SolverStatistics)

    def go(self, grid: Array, breaks: Sequence[float], options: StepOptions) -> SolverStatistics:
        """Integrate over the output times; how far it came is in the self.stats."""
        self.stats.time = float(grid[0])
        self._q, self._v, self._work = self.report.q, self.report.v, 0.0
        self._slots = self.report.slots
        self._speed = 0.0
        inner = [t for t in breaks if grid[0] < t < grid[-1]]
        self.stats.events += [DynamicEvent("break", t, 0.0, f"loads are not smooth at t = {t:.9g} s") for t in inner]
        ends = [*inner, float(grid[-1])]
        self._recent = [-np.inf] * _WINDOW
        self._short = 0
        resting, sliding = self._problem(self.stats.time).resting, self._problem(self.stats.time).moving()
        self._stop(self.stats.time, resting)
        piece = self._decided(self._problem(self.stats.time), sliding, resting)
        self.form = self.make(self.rows.compiled, self.report) if piece is None else self._made(piece)
        self.show(self.form, 0, self.stats.time, self.form.begin(), None if piece is None else piece.senses)
        while piece is not None and ends:
            if self.stats.time >= ends[0]:
                del ends[0]
                if ends:  # loads may have changed
                    problem = self._problem(self.stats.time)
                    piece = self._next(problem, piece, [*piece.stuck], {}, None)
                continue
            hit = self._piece(piece, grid, ends, options)
            if self.stats.message:
                break
            if hit is not None:
                piece = self._turn(piece, *hit)
        return self.stats

    def _problem(self, t: float) -> FrictionProblem:
        return FrictionProblem(self.rows, t, self._q, self._v, self._slots, self._speed)

    def _piece(self, piece: Piece, grid: Array, ends: list[float], options: StepOptions) -> tuple[int, float] | None:
        """Integrate one piece; the element whose state ends with it and the error of that time, or None."""
        try:
            form = self.form = self._made(piece)
        except GeometryError as error:
            self.stats.message = str(error)
            return None
        y = form.begin()
        y[-1] = self._work
        guard = Guard(piece, form, self.stats.time, self._q, self._v, self._slots)

        def output(k: int, t: float, state: Array) -> None:
            self.show(form, k, t, state, piece.senses)

        for k in np.flatnonzero(grid[1:] == self.stats.time):  # the state from here on, where it changes
            output(int(k) + 1, self.stats.time, y)
        if piece.still:
            found = rest_until(guard, self.stats.time, ends[0], grid[0], grid[-1])
            for k in np.flatnonzero((grid > self.stats.time) & (grid <= found)):
                output(int(k), float(grid[k]), y)
            self.stats.time = found
            return None if guard.hit is None else (guard.hit, guard.uncertainty)
        scaled = options.scaled(self.scales(form))
        last = Stepper(form, self.stats, scaled, ends[0], len(ends) > 1, guard).run(y, grid, output)
        self.loss += form.loss
        self.contraction = max(self.contraction, form.contraction, guard.factor)
        self.changes += form.changes
        if last is None:
            if guard.message:
                self.stats.message = guard.message
            elif form.why or max(form.contraction, guard.factor) > _NEARLY:
                self.stats.message = NO_LOADS if max(form.contraction, guard.factor) > _NEARLY else form.why
            return None
        q, v = form.state(self.stats.time, last)
        self._q, self._v, self._work = q.copy(), v.copy(), float(last[-1])
        self._slots = form.slots_at(q)
        self._speed = max(self._speed, self._problem(self.stats.time).speed)
        return None if guard.hit is None else (guard.hit, guard.uncertainty)

    def _made(self, piece: Piece) -> Form:
        """Return the formulation of a piece, from the present state on."""
        if piece.still:
            self._v = np.zeros_like(self._v)
            return RestForm(piece.compiled, self._q, self._slots)
        poses, rates, _ = self.rows.compiled.to_links(self._q, self._v, np.zeros_like(self._q))
        start = replace(
            self.report,
            time=self.stats.time,
            q=self._q,
            v=self._v,
            slots=self._slots,
            pose_class=self.report.pose_class if self.stats.steps == 0 else "regular",
            poses=poses,
            velocities=rates,
        )
        return self.make(piece.compiled, start)

    def _decided(
        self,
        problem: FrictionProblem,
        sliding: dict[int, int],
        resting: Sequence[int],
        begun: Sequence[int] = (),
    ) -> Piece | None:
        """Return the piece from here on; None, with a message in the self.stats, if there is none or no single one."""
        found = decide(problem, sliding, resting, begun)
        if found.solution is None:
            self.stats.message = found.message or "the equations of motion have no value here"
            return None
        # lock what sticks and fix the senses of what slides
        rows, base, fit = self.rows, self.rows.compiled, found.solution
        coordinates = rows.directions(self.stats.time, self._q, self._v, self._slots)[3]
        stuck = [f for f, e in enumerate(rows.elements) if fit.senses[f] == 0 and e.sticks and not problem.idle(f)]
        kept = problem._independent(stuck)
        held = locked(base, rows, kept, coordinates[kept])
        table = held.tables.friction_table.copy()
        table[:, 6] = [BY_SPEED if e.smooth else float(s) for e, s in zip(rows.elements, fit.senses)]
        compiled = replace(held, tables=held.tables._replace(friction_table=table))
        rank = len(base.info) - problem._part.null.shape[1]
        still, quiet = rank + len(kept) == base.n and not base.laws, 1e3 * problem.noise + _QUIET
        return Piece(rows, compiled, fit.senses, tuple(kept), tuple(stuck), fit.shared, still, quiet)

    def _turn(self, piece: Piece, hit: int, uncertainty: float) -> Piece | None:
        """Decide what follows the end of an element's sliding or sticking."""
        released: dict[int, int] = {}
        resting = list(piece.stuck)
        if piece.senses[hit] == 0 and hit not in piece.stuck:  # held so far by what is no friction
            problem = self._problem(self.stats.time)
        elif hit in piece.stuck:
            problem = self._problem(self.stats.time)
            fit = problem.at(piece.senses, within=False)
            if fit is None:
                self.stats.message = "the friction of the joints that stick is not determined at the release"
                return None
            # of those that share, those that can move with it only
            A = problem.A
            tied = [f for f in piece.shared if A[f, hit] ** 2 >= (1.0 - 1e-9) * A[f, f] * A[hit, hit]]
            along = [f for f in piece.stuck if f == hit or f in tied]
            released = {f: -int(np.sign(fit.forces[f])) or 1 for f in along}
            resting = [f for f in piece.stuck if f not in released]
        else:
            self._stop(self.stats.time, [hit, *piece.kept])
            problem = self._problem(self.stats.time)
            resting.append(hit)
        return self._next(problem, piece, resting, released, (hit, uncertainty))

    def _stop(self, t: float, which: Sequence[int]) -> None:
        """Take out of the velocities what rounding left of rates that have come to 0."""
        problem = self._problem(t)
        kept = problem._independent(list(which))
        if not kept:
            return
        if not self.rows.compiled.tables.lower.size:
            self._v = np.zeros_like(self._v)  # one coordinate only, and it stands still
            return
        W, v = problem.W[kept], self._v
        self._v = v - problem._part.G[:, kept] @ np.linalg.solve(problem.A[np.ix_(kept, kept)], W @ v)

    def _next(
        self,
        problem: FrictionProblem,
        piece: Piece,
        resting: list[int],
        released: dict[int, int],
        event: tuple[int, float] | None,
    ) -> Piece | None:
        """Return the next piece, and note what changed."""
        slow = np.abs(problem.rates) <= problem.noise
        sliding = {
            f: s
            for f, s in enumerate(piece.senses)
            if f not in resting and f not in released and (s or self.rows.elements[f].smooth)
        }
        for f, e in enumerate(self.rows.elements):
            if piece.senses[f] == 0 and f not in piece.stuck and e.sticks:
                if slow[f]:
                    resting.append(f)
                else:
                    sliding[f] = int(np.sign(problem.rates[f]))
        hit = -1 if event is None else event[0]
        for f in [f for f in sliding if slow[f] and f != hit and not self.rows.elements[f].smooth]:
            if event is not None and not released:
                resting.append(f)
                del sliding[f]
        begun = [*released, *(f for f in sliding if slow[f])]
        fresh = self._decided(problem, {**sliding, **released}, resting, begun)
        if fresh is not None and event is not None:
            self._note(piece.senses, fresh, event[1])
        elif fresh is not None and fresh.senses != piece.senses:
            self._note(piece.senses, fresh, 0.0)
        return fresh

    def _note(self, before: Senses, piece: Piece, uncertainty: float) -> None:
        """Record an event, and stop where they come too fast."""
        t = self.stats.time
        changed = [f for f, s in enumerate(piece.senses) if s != before[f]]
        if not changed:
            return
        names = ", ".join(dict.fromkeys(self.rows.elements[f].name for f in changed))
        kinds = {("stick" if piece.senses[f] == 0 else "slip" if before[f] == 0 else "reversal") for f in changed}
        kind = "stick" if "stick" in kinds else "slip" if "slip" in kinds else "reversal"
        text = {"stick": "stick", "slip": "slide", "reversal": "slide the other way"}[kind]
        self.stats.events.append(DynamicEvent(kind, t, uncertainty, f"{names}: {text} from t = {t:.9g} s on"))
        count = self._recent
        self._short = self._short + 1 if t - count[-1] < _DWELL * np.spacing(t) else 0
        self._recent = [*count[1:], t]
        if self._short >= 3 or t - self._recent[0] < _WINDOW / _RATE:
            self.stats.message = (
                f"Zeno behaviour: more than {_RATE:g} changes between sticking and sliding a second at t = {t:.9g} s; "
                "give the friction a smoothing_velocity"
            )


def friction_history(rows: FrictionRows, count: int, fits: list[FrictionSolution | None]) -> FrictionHistory:
    """Collect the friction of all output times."""
    shape = (count, len(rows.elements))
    state = np.zeros(shape, dtype=np.int64)
    rates, forces, loads = (np.full(shape, np.nan) for _ in range(3))
    shared: dict[tuple[str, ...], None] = {}
    for k, fit in enumerate(fits):
        if fit is not None:
            state[k], rates[k], forces[k], loads[k] = fit.senses, fit.rates, fit.forces, fit.loads
            if fit.shared:
                shared[tuple(dict.fromkeys(rows.elements[f].name for f in fit.shared))] = None
    return FrictionHistory(tuple(e.name for e in rows.elements), state, rates, forces, loads, tuple(shared))
