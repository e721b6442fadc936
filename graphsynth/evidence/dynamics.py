"""Integrators on a mechanism: every form and integrator beside an independent reference; error, drift, run time."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from inspect import signature
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from graphsynth.core.checks import finite, whole
from graphsynth.core.errors import GeometryError, GraphsynthError
from graphsynth.dynamics.integrate import simulate_dynamics
from graphsynth.dynamics.model import DynamicModel
from graphsynth.dynamics.result import DynamicMotion
from graphsynth.dynamics.start import StartReport
from graphsynth.evidence.rows import Effort, Problem, Row, RowStatus, best_of

Array = NDArray[np.float64]
#: Beyond this many tolerances the error is not what was asked for.
_MISSED = 1e3
_KIND = "largest error of all coordinates"
_DEFAULT = signature(simulate_dynamics).parameters["rtol"].default


class Truth(NamedTuple):
    """A reference of its own: times (s) to centres of mass and angles of the moving links, and what it is."""

    coordinates: Callable[[Array], Array]
    name: str


def dynamics_work_precision(
    model: DynamicModel,
    start: StartReport,
    times: ArrayLike,
    *,
    forms: Sequence[str] = ("one-coordinate", "augmented", "partitioned"),
    methods: Sequence[str] = ("DOP853", "RK45", "LSODA"),
    tolerances: Sequence[float] = (1e-4, 1e-6, 1e-8, 1e-10),
    rounds: int = 3,
    max_steps: int = 200_000,
) -> tuple[Row, ...]:
    """Measure error and wall time of every form, method and tolerance; failures stay in the table.

    Parameters
    ----------
    model : DynamicModel
    start : StartReport
        A consistent start.
    times : array_like, shape (n,)
        Output times, equal for all, s.
    forms, methods : sequence of str
        Those of :func:`graphsynth.dynamics.simulate_dynamics`.
    tolerances : sequence of float
        At least 1e-12, so that the reference is tighter.
    rounds : int
        Runs of each; the best time counts.
    max_steps : int

    Returns
    -------
    tuple of Row
        ``method`` is "form, method"; the error is the largest of all coordinates at all times, lengths over the
        characteristic length (estimated).  The reference of the augmented form is the partitioned one at 2.3e-14 and
        the other way round: another formulation, so no method is compared with itself.

    Raises
    ------
    GeometryError
        Tolerances below 1e-12, no reference, times that do not increase.

    Examples
    --------
    >>> from graphsynth.dynamics.model import Body, DynamicModel
    >>> from graphsynth.dynamics.start import consistent_start
    >>> from graphsynth.mechanism.joints import Revolute
    >>> from graphsynth import Driver, Mechanism, MechanismGraph
    >>> pendulum = Mechanism(MechanismGraph(2, [(0, 1)], frame=0), [Revolute(0, 1)], [Driver(0, 1)])
    >>> model = DynamicModel(pendulum, {1: Body.bar(1.0, (0.0, 0.0), (1.0, 0.0))})
    >>> rows = dynamics_work_precision(model, consistent_start(model, keep={(0, 1): 0.0}), [0.0, 1.0],
    ...     forms=["augmented"], methods=["DOP853"], tolerances=[1e-6, 1e-10])
    >>> [row.method for row in rows], rows[0].error > rows[1].error
    (['augmented, DOP853', 'augmented, DOP853'], True)
    """
    for name, given in (("forms", forms), ("methods", methods), ("tolerances", tolerances)):
        if not isinstance(given, Sequence) or isinstance(given, str):
            raise GeometryError(f"{name} = {given!r} is not a list; give one")
    if not tolerances or min(finite("tolerance", given) for given in tolerances) < 1e-12:
        raise GeometryError(f"tolerances = {tuple(tolerances)} must be 1e-12 or more; the reference must be tighter")
    whole("rounds", rounds, 1, 1000)
    references = {form: _reference(model, start, times, form) for form in ("partitioned", "augmented")}
    rows = []
    for form in forms:
        other = "augmented" if form == "partitioned" else "partitioned"
        for method in methods:
            for rtol in tolerances:
                options: dict[str, Any] = {"form": form, "method": method, "rtol": rtol, "max_steps": max_steps}
                row = _row(model, start, times, options, references[other], Effort(rounds))
                rows.append(replace(row, reference=f"{other} form, DOP853 at 2.3e-14"))
    return tuple(rows)


def _reference(model: DynamicModel, start: StartReport, times: ArrayLike, form: str) -> DynamicMotion:
    found = simulate_dynamics(model, times, start=start, form=form, rtol=2.3e-14, outputs="exact")  # type: ignore[arg-type]
    if not found.completed:
        raise GeometryError(f"there is no reference: {found.message}; give a shorter time")
    return found


def _row(
    model: DynamicModel,
    start: StartReport,
    times: ArrayLike,
    options: dict[str, Any],
    truth: DynamicMotion,
    effort: Effort,
) -> Row:
    rtol = options["rtol"]
    row = partial(Row.of, f"{options['form']}, {options['method']}", f"rtol {rtol:.0e}", kind=_KIND, value=rtol)

    def run() -> DynamicMotion:
        return simulate_dynamics(model, times, start=start, outputs="exact", **options)

    try:
        found, *timed = best_of(run, effort, warm=False)
    except GeometryError as refusal:
        return row(math.nan, (math.nan, 1), str(refusal), more={"steps": 0.0})
    row = partial(row, timed=timed, more={"steps": float(found.steps)})
    if not found.completed:
        return row(math.nan, why=found.message)
    error = _away(found, truth.q, turns=False)
    largest = max(_away(found, 0.0 * truth.q, turns=False), 1.0)  # the tolerance is a part of each coordinate
    why = (
        f"more than {_MISSED:g} times the tolerance of the largest coordinate"
        if error > _MISSED * rtol * largest
        else ""
    )
    return row(error, why=why, status=RowStatus.UNRELIABLE)


def dynamics_problem(
    model: DynamicModel,
    start: StartReport,
    end: float,
    name: str,
    effort: Effort | None = None,
    *,
    truth: Truth | None = None,
) -> Problem:
    """Integrate a mechanism in every form with several integrators and tolerances, up to `end` seconds.

    Error: largest of all coordinates at eight times, lengths over the characteristic length; further columns: drift of
    positions and velocities, error of the energy.  Without a `truth` of its own the reference is another formulation of
    the same model, by the same integrator at 2.3e-14.
    """
    effort = effort or Effort()
    times = np.linspace(0.0, end, 8)
    tolerances = (1e-4, 1e-8, _DEFAULT) if effort.quick else (1e-4, 1e-6, 1e-8, 1e-10, _DEFAULT)
    every: tuple[str, ...] = ("one-coordinate", "augmented", "partitioned")
    right = truth.coordinates(times) if truth else None
    rows = []
    for method in ("DOP853",) if effort.quick else ("DOP853", "RK45", "LSODA"):
        # the forms are told apart by the default integrator, the integrators by the form that takes least time
        forms, asked = (every, tolerances) if method == "DOP853" else (("one-coordinate",), (1e-4, 1e-6, 1e-8))
        options: dict[str, Any] = {"forms": forms, "methods": (method,), "tolerances": asked}
        options |= {"rounds": min(2, effort.rounds), "max_steps": 5_000}
        found = dynamics_work_precision(model, start, times, **options)
        rows += [_with_drift(model, start, times, row, right, truth) for row in found]
    note = "Drift and energy are those of a further run; positions are projected onto the joints (the default)."
    if truth is None:
        note += " The reference is another formulation of the same model by the same integrator, so it shares code."
    return Problem("linkage-dynamics", f"Motion of {name}, over {end:g} s", "relative", tuple(rows), "run", note)


def _with_drift(
    model: DynamicModel, start: StartReport, times: Array, row: Row, right: Array | None, truth: Truth | None
) -> Row:
    """Row with drift and energy of a further run, and with its error against the reference if there is one."""
    form, method = row.method.split(", ")
    row = replace(row, default=row.value == _DEFAULT and method == "DOP853")
    if not math.isfinite(row.error):
        return row
    options: dict[str, Any] = {"form": form, "method": method, "rtol": row.value, "outputs": "exact"}
    try:
        found = simulate_dynamics(model, times, start=start, **options)
    except GraphsynthError:
        return row
    checks = found.checks
    drift = {"position drift": checks.position_drift, "velocity drift": checks.velocity_drift}
    more = {**row.more, **drift, "energy error": checks.energy}
    if right is None or truth is None:
        return replace(row, more=more)
    more["distance from " + row.reference] = row.error
    return replace(row, error=_away(found, right, turns=True), reference=truth.name, more=more)


def _away(found: DynamicMotion, right: Array, *, turns: bool) -> float:
    """Largest error of all coordinates; lengths over the characteristic length, angles up to full turns if asked."""
    gap = (found.q - right).reshape(len(right), -1, 3)
    if turns:
        gap[..., 2] = np.angle(np.exp(1j * gap[..., 2]))
    size = found.compiled.tables.size
    return float(np.abs(gap / np.array([size, size, 1.0])).max())
