"""`simulate_dynamics`: the motion of a dynamic model over time, checked."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import partial
from time import perf_counter
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from graphsynth.core.checks import finite, finite_array
from graphsynth.core.errors import GeometryError
from graphsynth.core.extras import need
from graphsynth.dynamics.checks import (
    Balance,
    balance_at,
    checks_of,
    electric_error,
    motor_histories,
    newton_euler_difference,
    second_accelerations,
    warnings_of,
)
from graphsynth.dynamics.forms.one_coordinate import OneCoordinateForm, one_coordinate_obstacle
from graphsynth.dynamics.model import DynamicModel
from graphsynth.dynamics.motors import current_scale
from graphsynth.dynamics.result import DynamicEvent, DynamicMotion
from graphsynth.dynamics.start import StartReport, check_start, start_compiled
from graphsynth.dynamics.stepping import METHODS, Form, SolverStatistics, StepOptions
from graphsynth.dynamics.switching import integrate, with_starting_modes
from graphsynth.dynamics.tables import Compiled, compile_model
from graphsynth.dynamics.values import initial_slots

if TYPE_CHECKING:
    from graphsynth.dynamics.friction.loads import FrictionRows
    from graphsynth.dynamics.friction.problem import FrictionSolution, Senses

Array = NDArray[np.float64]
FormName = Literal["auto", "one-coordinate", "partitioned", "augmented"]
FORMS = ("auto", "one-coordinate", "partitioned", "augmented")


def simulate_dynamics(
    model: DynamicModel,
    times: ArrayLike,
    *,
    start: StartReport | None = None,
    pose: ArrayLike | None = None,
    rates: ArrayLike | None = None,
    keep: Mapping[Any, float] | None = None,
    keep_rates: Mapping[Any, float] | None = None,
    modes: Mapping[int, int] | None = None,
    form: FormName = "auto",
    method: str = "DOP853",
    rtol: float = 1e-11,
    atol: float | None = None,
    outputs: Literal["interpolated", "exact"] = "interpolated",
    project: bool = True,
    estimate_error: bool = False,
    max_steps: int = 1_000_000,
) -> DynamicMotion:
    """Integrate the equations of motion, with all checks of theory/planar-dynamics 8.

    Parameters
    ----------
    model : DynamicModel
    times : array_like, shape (n,)
        Output times, increasing, s; the first is the start.
    start : StartReport, optional
        A consistent start; found from the next five if not given.
    pose, rates, keep, keep_rates, modes : optional
        As for :func:`consistent_start`.
    form : {"auto", "one-coordinate", "partitioned", "augmented"}
        One-coordinate: one coordinate through the planar engine.  Partitioned: independent coordinates chosen by
        pivoted QR, changed where they fail.  Augmented: all coordinates, multipliers, projection.  Auto takes the
        one-coordinate form where it exists, and the augmented one elsewhere and beyond a fold.
    method : str
        "DOP853", "RK45", "RK23", "Radau", "BDF", "LSODA" of scipy; "CVODE" (extra ``stiff``).
    rtol, atol : float, optional
        Of the integrator.  ``atol`` by default a hundredth of ``rtol`` in units of the mechanism's own length,
        time and energy, component by component.
    outputs : {"interpolated", "exact"}
        Exact: steps end at every output time; slower, and as accurate as the steps themselves.
    project : bool, optional
        Project onto the constraints after every accepted step (augmented form).
    estimate_error : bool, optional
        Run a second time at a hundredth of the tolerance.
    max_steps : int, optional

    Returns
    -------
    DynamicMotion
        Estimated.  A solver that gives up is a result with status "failed": arrays are NaN from there on.

    Raises
    ------
    GeometryError
        Times that do not increase, an inconsistent start or one for another time, an unknown method, a form that the
        model does not have.

    Examples
    --------
    >>> from graphsynth.dynamics.model import Body
    >>> from graphsynth.mechanism.joints import Revolute
    >>> from graphsynth import Driver, Mechanism, MechanismGraph
    >>> pendulum = Mechanism(MechanismGraph(2, [(0, 1)], frame=0), [Revolute(0, 1)], [Driver(0, 1)])
    >>> model = DynamicModel(pendulum, {1: Body.bar(1.0, (0.0, 0.0), (1.0, 0.0))})
    >>> motion = simulate_dynamics(model, np.linspace(0.0, 1.0, 11), keep={(0, 1): 0.0})
    >>> motion.completed, motion.checks.energy < 1e-10, motion.form
    (True, True, 'one-coordinate')
    """
    grid, compiled = _times(times), compile_model(model)
    first = float(grid[0])
    report = start_compiled(compiled, pose, rates, keep, keep_rates, modes, first) if start is None else start
    check_start(model, report, first, "additional", "prescribed")
    options = _options(form, method, rtol, atol, outputs, project, max_steps)
    run = _once(compiled, report, grid, form, options)
    estimate = _error(compiled, report, grid, run, options) if estimate_error else None
    return _result(compiled, report, grid, run, options, estimate)


def _times(times: ArrayLike) -> Array:
    try:
        grid = finite_array("times", times, nan=True)
    except GeometryError as error:
        raise GeometryError(f"times = {times!r} are not numbers; give a list of seconds that increase") from error
    if grid.ndim != 1 or grid.size < 1 or not np.isfinite(grid).all() or (np.diff(grid) <= 0.0).any():
        raise GeometryError("times must be one list of finite numbers that increase; sort them and remove duplicates")
    return grid


def _options(
    form: str, method: str, rtol: float, atol: float | None, outputs: str, project: bool, max_steps: int
) -> StepOptions:
    if isinstance(max_steps, bool) or not isinstance(max_steps, int) or max_steps < 1:
        raise GeometryError(f"max_steps = {max_steps!r} is not a number of steps; give an integer of at least 1")
    absolute, relative = None if atol is None else finite("atol", atol), finite("rtol", rtol)
    if not isinstance(form, str) or form not in FORMS:
        raise GeometryError(f"form = {form!r} is not known; give one of {', '.join(FORMS)}")
    if not isinstance(outputs, str) or outputs not in ("interpolated", "exact"):
        raise GeometryError(f"outputs = {outputs!r} is not known; give 'interpolated' or 'exact'")
    if not isinstance(method, str) or method not in METHODS:
        raise GeometryError(f"method = {method!r} is not known; give one of {', '.join(METHODS)}")
    if method == "CVODE":
        need("sksundae.cvode", "stiff", "method 'CVODE'")
    if not 2.3e-14 <= relative < 1.0:
        raise GeometryError(f"rtol = {relative} must be at least 2.3e-14 (rounding) and below 1; correct it")
    if absolute is not None and not absolute > 0.0:
        raise GeometryError(f"atol = {absolute} must be positive; leave it out for the natural scales")
    return StepOptions(method, relative, absolute, outputs == "exact", project, max_steps)


class _Run:
    """States at the output times; a workspace."""

    def __init__(self, compiled: Compiled, report: StartReport, name: str, count: int, project: bool) -> None:
        self.name, self.form = name, make_form(compiled, report, name, project)
        self.compiled, self.report, self.done, self.seconds = compiled, report, 0, 0.0
        self.stats = SolverStatistics()
        self.q, self.v = (np.full((count, compiled.n), np.nan) for _ in range(2))
        self.slots = np.zeros((count, len(report.slots)))
        self.tail = np.full((count, len(compiled.tail)), np.nan)
        self.modes = np.zeros((count, *compiled.tables.modes.shape), dtype=np.int64)
        self.own: list[Array | None] = [None] * count
        self.senses: list[Senses | None] = [None] * count
        self.events: list[DynamicEvent] = []
        self.rows: FrictionRows | None = None

    def show(self, form: Form, k: int, t: float, y: Array, senses: Senses | None = None) -> None:
        """Keep the state at an output time."""
        self.q[k], self.v[k] = form.state(t, y)
        self.slots[k] = self.report.slots if form.slots is None else form.slots
        self.tail[k], self.modes[k] = y[len(y) - len(self.compiled.tail) :], form.compiled.tables.modes
        self.own[k], self.senses[k] = form.accelerations(t, y), senses
        self.done = k + 1


def make_form(compiled: Compiled, report: StartReport, name: str, project: bool) -> Form:
    """Return the formulation by name."""
    if name == "one-coordinate":
        return OneCoordinateForm(compiled, report)
    if name == "partitioned":
        from graphsynth.dynamics.forms.partitioned import PartitionedForm

        return PartitionedForm(compiled, report)
    from graphsynth.dynamics.forms.augmented import AugmentedForm

    return AugmentedForm(compiled, report, project)


def _once(compiled: Compiled, report: StartReport, grid: Array, name: str, options: StepOptions) -> _Run:
    """Integrate once; in the form "auto" beyond a fold again in the augmented form."""
    chosen = name
    if name == "auto":
        none = one_coordinate_obstacle(compiled.model) or report.pose_class == "singular"
        chosen = "augmented" if none else "one-coordinate"
    try:
        run = _run(compiled, report, grid, chosen, options)
    except GeometryError as error:
        if name != "auto" or chosen != "one-coordinate" or compiled.model.massless:
            raise
        other = _run(compiled, report, grid, "augmented", options)
        text = f"the one-coordinate form does not start here ({error}); augmented form used"
        other.events.insert(0, DynamicEvent("fold", float(grid[0]), 0.0, text))
        return other
    if name == "auto" and chosen == "one-coordinate" and run.done < len(grid) and not compiled.model.massless:
        other = _run(compiled, report, grid, "augmented", options)
        why = run.form.why or run.stats.message
        text = f"the one-coordinate form ends at t = {run.stats.time:.9g} s ({why}); augmented form used"
        other.events.insert(0, DynamicEvent("fold", run.stats.time, abs(run.stats.last_step), text))
        return other
    return run


def _error(compiled: Compiled, report: StartReport, grid: Array, run: _Run, options: StepOptions) -> Array:
    """Difference to a second run at a hundredth of the tolerance, at the output times."""
    atol = None if options.atol is None else options.atol / 100.0
    tighter = replace(options, rtol=max(options.rtol / 100.0, 2.3e-14), atol=atol)
    again = _once(compiled, report, grid, run.name, tighter)
    return np.asarray(np.abs((run.q - again.q) / compiled.unit).max(axis=1))


def _run(compiled: Compiled, report: StartReport, grid: Array, name: str, options: StepOptions) -> _Run:
    begin = perf_counter()
    if compiled.drives:
        compiled = with_starting_modes(compiled, report.v)
    run = _Run(compiled, report, name, len(grid), options.project)
    with np.errstate(all="ignore"):
        if compiled.tables.friction.size:
            from graphsynth.dynamics.friction.loads import FrictionRows
            from graphsynth.dynamics.friction.motion import DryMotion

            run.rows = FrictionRows(compiled)
            make = partial(make_form, name=name, project=options.project)
            dry = DryMotion(run.rows, report, make, partial(scales, compiled, report), run.show)
            run.stats, run.form = dry.go(grid, compiled.model.breaks, options), dry.form
            run.form.loss, run.form.contraction, run.form.changes = dry.loss, dry.contraction, dry.changes
        else:
            scaled = options.scaled(scales(compiled, report, run.form))
            run.stats = integrate(run.form, grid, compiled.model.breaks, scaled, partial(run.show, run.form))
    run.seconds = perf_counter() - begin
    lost = np.flatnonzero(~np.isfinite(run.q[: run.done]).all(axis=1) | ~np.isfinite(run.v[: run.done]).all(axis=1))
    if lost.size:  # an interpolated state that the formulation cannot place is a failure, not a gap
        run.done = int(lost[0])
        run.stats.time = min(run.stats.time, float(grid[run.done]))
        run.stats.message = f"the state at the output time {float(grid[run.done]):.9g} s has no pose"
        run.q[run.done :], run.v[run.done :], run.tail[run.done :] = np.nan, np.nan, np.nan
    run.events += run.stats.events
    run.events += [DynamicEvent("change of coordinates", t, 0.0, text) for t, text in run.form.changes]
    return run


def scales(compiled: Compiled, report: StartReport, form: Form) -> Array:
    """Natural size of every component of the state: lengths, angles, rates, work."""
    T, unit = compiled.tables, compiled.unit
    speed = float(np.abs(report.v / unit).max(initial=0.0))
    turn = np.sqrt(float(np.abs(np.nan_to_num(report.a) / unit).max(initial=0.0)))
    gravity = np.sqrt(float(np.abs(T.gravity).max()) / T.size)
    rate = max(speed, turn, gravity) or 1.0
    energy = max(0.5 * rate**2 * float((np.diag(T.mass) * unit**2).max()), 1e-300)
    currents = [size for drive in compiled.drives for size in [current_scale(drive.equation)] * len(drive.currents)]
    return np.concatenate([form.unit, rate * form.unit, currents, [energy] * (len(compiled.tail) - len(currents))])


def _result(
    compiled: Compiled, report: StartReport, grid: Array, run: _Run, options: StepOptions, estimate: Array | None
) -> DynamicMotion:
    begin, count, done = perf_counter(), len(grid), run.done
    work, currents = run.tail[:, -1], run.tail[:, : len(compiled.currents)]
    a, lam = np.full((count, compiled.n), np.nan), np.full((count, len(compiled.info)), np.nan)
    kinetic, potential = np.full((2, count), np.nan)
    balances: list[Balance] = []
    fits: list[FrictionSolution | None] = []
    for k, t in enumerate(grid[:done].tolist()):
        q, v = run.q[k], run.v[k]
        slots = run.slots[k] if run.name == "augmented" else initial_slots(compiled, q)
        fit, senses = None, run.senses[k]
        if run.rows is not None and senses is not None:
            from graphsynth.dynamics.friction.problem import FrictionProblem

            fit = FrictionProblem(run.rows, t, q, v, slots).at(senses)
        found = balance_at(compiled.with_modes(run.modes[k]), t, q, v, currents[k], slots, run.own[k], fit)
        a[k], lam[k], kinetic[k], potential[k] = found.a, found.multipliers, found.kinetic, found.potential
        balances.append(found)
        fits.append(fit)
    second = run.own[:done]
    if run.name == "augmented":

        def other(own: Compiled, at: NDArray[np.intp]) -> list[Array | None]:
            return second_accelerations(own, report, grid[at], run.q[at], run.v[at], currents[at])

        second = _by_mode(compiled, run.modes[:done], other)
    motors = motor_histories(compiled, run.v, currents, run.modes)
    checks = checks_of(compiled, grid, balances, work, second)
    if balances:
        checks = checks._replace(
            newton_euler=_newton(compiled, run, grid, a, lam),
            projection_loss=run.form.loss,
            contraction=run.form.contraction,
            electric=electric_error(compiled, grid, run.tail, motors),
        )
    links = compiled.to_links(run.q, run.v, a)
    for array in links:
        array[done:] = np.nan
    friction = None
    if run.rows is not None:
        from graphsynth.dynamics.friction.motion import friction_history

        friction = friction_history(run.rows, count, fits)
    message = "completed"
    if done < count:
        why = run.stats.message if run.rows is not None and run.stats.message else run.form.why or run.stats.message
        message = f"the integration stopped at t = {run.stats.time:.9g} of {grid[-1]:.9g} s: {why}"
    states = (*links, run.q, run.v, a, lam, run.slots, kinetic, potential, work)
    return DynamicMotion(
        compiled,
        grid,
        *states,
        status="completed" if done == count else "failed",
        message=message,
        reached=run.stats.time,
        events=tuple(sorted(run.events, key=lambda event: event.time)),
        start=report,
        checks=checks,
        warnings=warnings_of(checks, options.rtol, friction),
        error_estimate=estimate,
        form=run.name,
        method=options.method,
        backend=_backend(options.method),
        rtol=options.rtol,
        evaluations=run.stats.evaluations,
        steps=run.stats.steps,
        seconds=run.seconds,
        seconds_checks=perf_counter() - begin,
        friction=friction,
        motors=motors,
    )


def _backend(method: str) -> str:
    if method == "CVODE":
        from importlib.metadata import version

        return f"scikit-sundae {version('scikit-sundae')}"
    import scipy

    return f"scipy {scipy.__version__}"


def _newton(compiled: Compiled, run: _Run, grid: Array, a: Array, lam: Array) -> float:
    """Largest difference of the reactions to body-by-body equilibrium, at up to 20 instants."""
    chosen = np.unique(np.linspace(0, run.done - 1, min(run.done, 20)).astype(int)) if run.done else np.empty(0, int)
    currents = run.tail[:, : len(compiled.currents)]

    def difference(own: Compiled, among: NDArray[np.intp]) -> list[float]:
        at = chosen[among]
        found = newton_euler_difference(own, grid[at], run.q[at], run.v[at], a[at], lam[at], currents[at])
        return [found] * len(at)

    return max(_by_mode(compiled, run.modes[chosen], difference), default=float("nan"))


def _by_mode(
    compiled: Compiled, modes: NDArray[np.int64], values: Callable[[Compiled, NDArray[np.intp]], list[Any]]
) -> list[Any]:
    """Values at instants, asked for together where the modes of the motors are the same."""
    count = len(modes)
    if not count or not modes.size:
        return values(compiled, np.arange(count))
    found: list[Any] = [None] * count
    flat = modes.reshape(count, -1)
    for own in np.unique(flat, axis=0):
        at = np.flatnonzero((flat == own).all(axis=1))
        for k, value in zip(at, values(compiled.with_modes(modes[at[0]]), at)):
            found[k] = value
    return found
