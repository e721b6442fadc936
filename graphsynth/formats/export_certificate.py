"""The export certificate: does an engine run the mechanism that graphsynth meant, and how well (theory/exports 4)."""

from __future__ import annotations

import json
import math
from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from importlib import metadata
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from graphsynth.core.checks import finite, finite_array
from graphsynth.core.errors import GeometryError
from graphsynth.dynamics.elements import Spring, TorqueSource, TorsionSpring
from graphsynth.dynamics.model import DynamicModel
from graphsynth.dynamics.result import DynamicMotion
from graphsynth.dynamics.start import StartReport, check_start
from graphsynth.formats.exudyn_model import ExudynSettings, run_exudyn
from graphsynth.formats.mjcf import MujocoSettings, to_mjcf
from graphsynth.formats.mujoco_run import run_mujoco

Array = NDArray[np.float64]
Settings = MujocoSettings | ExudynSettings
#: Part of the requested tolerance that the reference may be wrong by.
_SHARE = 0.1


@dataclass(frozen=True)
class Trial:
    """One run of the engine (estimated); NaN where it was not run or failed.

    Attributes
    ----------
    family : str
        Settings but for the step.
    step : float
        Seconds.
    status : str
        "completed", "failed" or "not run".
    gap : float
        Largest violation of any joint at the output times, m.
    error : float
        Largest difference to the reference over output times and coordinates of all links: lengths over the reference
        length, angles in rad (theory/solvers 4).
    velocity_error : float
        The same of the velocities over the largest angular speed of the reference.
    energy_error : float
        Largest difference of the mechanical energy to the reference, over the largest kinetic energy.
    order : float
        Observed, against the next longer step of the family; NaN for the longest.
    """

    family: str
    settings: str
    step: float
    status: str
    message: str
    gap: float
    error: float
    velocity_error: float
    energy_error: float
    order: float
    seconds: float

    @property
    def floor(self) -> bool:
        """Whether a shorter step hardly helped: the observed order is below 0.5."""
        return self.order < 0.5


@dataclass(frozen=True, eq=False)
class ExportCertificate:
    """What was exported, what the engine made of it, and the verdict.

    Attributes
    ----------
    key : str
        Canonical key of the mechanism graph.
    tree : tuple of (parent, link)
        Empty for an engine of absolute coordinates.
    coordinates : tuple of str
        Engine coordinate = internal coordinate.
    start_q, start_v : tuple of float
        Positions and velocities of the centres of mass and angles.
    closure, velocity_residual : float
        Of the start, m and m/s (rad and rad/s for angular rows).
    length : float
        Reference length of the error, m.
    reference : str
        Method of the internal reference.
    reference_error : float
        Its estimate, in the norm of ``Trial.error``.
    trials : tuple of Trial
        From the longest step to the shortest, settings by settings.
    verdict : str
        "yes", "no" or "not run".
    limit : float
        The number that decided: error of the cheapest trial that meets the tolerance, or the smallest one reached.
    """

    key: str
    toolkit: str
    engine: str
    engine_version: str
    tree: tuple[tuple[int, int], ...]
    cuts: tuple[tuple[int, int], ...]
    coordinates: tuple[str, ...]
    start_q: tuple[float, ...]
    start_v: tuple[float, ...]
    closure: float
    velocity_residual: float
    times: tuple[float, ...]
    length: float
    reference: str
    reference_error: float
    tolerance: float
    trials: tuple[Trial, ...]
    verdict: str
    limit: float
    statement: str

    def to_json(self) -> str:
        """Write as JSON; numbers that do not exist are null."""
        return json.dumps(_plain(asdict(self)), indent=1, allow_nan=False) + "\n"

    def table(self) -> str:
        """Return the trials as a Markdown table."""
        head = "| settings | step, s | error | energy | gap, m | order | time, s |\n|---|---|---|---|---|---|---|"
        return "\n".join([head, *(_row(trial) for trial in self.trials)])


def _plain(value: Any) -> Any:
    if isinstance(value, dict):
        return {name: _plain(part) for name, part in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(part) for part in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value


def _row(trial: Trial) -> str:
    if trial.status != "completed":
        return f"| {trial.settings} | {trial.step:g} | **{trial.status}** | | | | |"
    order = "floor" if trial.floor else f"{trial.order:.1f}" if math.isfinite(trial.order) else ""
    numbers = " | ".join(f"{v:.1e}" for v in (trial.error, trial.energy_error, trial.gap))
    return f"| {trial.settings} | {trial.step:g} | {numbers} | {order} | {trial.seconds:.2f} |"


def certify_export(
    model: DynamicModel,
    start: StartReport,
    times: ArrayLike,
    settings: Sequence[Settings],
    tolerance: float = 1e-5,
    *,
    rtol: float = 1e-12,
) -> ExportCertificate:
    """Run a model in an engine with several settings and compare with the internal reference (estimated).

    The reference is :func:`graphsynth.dynamics.simulate_dynamics` at ``rtol``; its error is estimated by its
    difference to a second formulation (the augmented form), or, where the first is that form already, by a run at
    a hundredth of the tolerance.

    Parameters
    ----------
    model : DynamicModel
    start : StartReport
    times : array_like, shape (n,)
        Output times, s, the first that of the start; every step must divide them.
    settings : sequence of MujocoSettings or of ExudynSettings
        Of one engine, with no fewer than three different steps.
    tolerance : float
        Requested error, in the norm of ``Trial.error``.
    rtol : float, optional
        Of the reference.

    Returns
    -------
    ExportCertificate
        Verdict "not run" and no numbers if the engine is not installed.

    Raises
    ------
    GeometryError
        Settings of two engines or with fewer than three steps, a model that the engine cannot run.

    References
    ----------
    See theory/exports 4 and theory/solvers 4.
    """
    trials = _checked(settings, tolerance)
    grid = np.atleast_1d(finite_array("times", times))
    check_start(model, start)
    names = _names(model, start, trials[0])
    try:
        version = metadata.version(names["engine"].lower())
    except metadata.PackageNotFoundError:
        version = ""
    common = {**names, "engine_version": version, "tolerance": float(tolerance), "times": tuple(grid.tolist())}
    length, method, estimate = math.nan, "", math.nan
    if version:
        reference, method, estimate = _reference(model, start, grid, rtol)
        length = float(reference.compiled.tables.size)
        measured = _with_orders([_measure(model, start, grid, s, reference) for s in trials])
        verdict, limit, statement = _judge(measured, float(tolerance), estimate)
    else:
        measured = [_nothing(s, "not run", "the engine is not installed", math.nan) for s in trials]
        statement = f"{names['engine']} is not installed, so nothing was measured."
        verdict, limit = "not run", math.nan
    common |= {"length": length, "reference": method, "reference_error": estimate, "trials": tuple(measured)}
    return ExportCertificate(**common, verdict=verdict, limit=limit, statement=statement)


def _nothing(settings: Settings, status: str, message: str, seconds: float) -> Trial:
    """Return a trial without numbers."""
    none = math.nan
    return Trial(settings.family, settings.text, settings.step, status, message, none, none, none, none, none, seconds)


def _checked(settings: Sequence[Settings], tolerance: float) -> list[Settings]:
    if not isinstance(settings, Sequence) or not all(isinstance(s, MujocoSettings | ExudynSettings) for s in settings):
        raise GeometryError(f"settings = {settings!r} is not a list of MujocoSettings or of ExudynSettings; give one")
    trials = sorted(settings, key=lambda s: -s.step)
    if len({type(s) for s in trials}) != 1:
        raise GeometryError("settings must all be MujocoSettings or all ExudynSettings; make one certificate for each")
    if len({s.step for s in trials}) < 3:
        raise GeometryError("settings have fewer than three different steps; give three or more to see the order")
    if not finite("tolerance", tolerance) > 0.0:
        raise GeometryError(f"tolerance = {tolerance} must be positive; give the error that is allowed")
    return trials


def _names(model: DynamicModel, start: StartReport, settings: Settings) -> dict[str, Any]:
    """Return what the certificate says before anything is run."""
    from graphsynth import __version__
    from graphsynth.mechanism.constraints import jacobian, residual

    mechanism = model.mechanism
    closure = residual(mechanism.joints, start.poses)
    speed = jacobian(mechanism.joints, start.poses) @ start.velocities.ravel()
    tree: tuple[tuple[int, int], ...] = ()
    cuts: tuple[tuple[int, int], ...] = ()
    if isinstance(settings, MujocoSettings):
        export = to_mjcf(model, start, settings)
        tree = tuple((parent, link) for parent, link, _ in export.tree.edges)
        cuts = tuple(mechanism.joints[k].pair for k in export.tree.cuts)
        coordinates = tuple(f"{name} = coordinate of {link} on {base}" for name, base, link in export.coordinates)
    else:
        coordinates = tuple(f"node of link {link} = centre of mass and angle of {link}" for link in model.bodies)
    return {
        "key": str(mechanism.graph.key),
        "toolkit": __version__,
        "engine": "MuJoCo" if isinstance(settings, MujocoSettings) else "exudyn",
        "tree": tree,
        "cuts": cuts,
        "coordinates": coordinates,
        "start_q": tuple(start.q.tolist()),
        "start_v": tuple(start.v.tolist()),
        "closure": float(np.abs(closure).max(initial=0.0)),
        "velocity_residual": float(np.abs(speed).max(initial=0.0)),
    }


def _reference(model: DynamicModel, start: StartReport, grid: Array, rtol: float) -> tuple[DynamicMotion, str, float]:
    """Return the internal motion, what it is, and the estimate of its error."""
    from graphsynth.dynamics.integrate import simulate_dynamics

    motion = simulate_dynamics(model, grid, start=start, rtol=rtol, outputs="exact")
    if motion.form != "augmented":
        other = simulate_dynamics(model, grid, start=start, rtol=rtol, outputs="exact", form="augmented")
        how = "difference to the augmented form"
    else:
        other = simulate_dynamics(model, grid, start=start, rtol=max(rtol / 100.0, 2.3e-14), outputs="exact")
        how = "difference to itself at a hundredth of the tolerance"
    if not (motion.completed and other.completed):
        raise GeometryError(f"the internal reference did not finish: {motion.message}; {other.message}")
    size = float(motion.compiled.tables.size)
    method = f"{motion.form} form, {motion.method}, rtol {rtol:g}; estimate: {how}"
    return motion, method, _distance(motion.poses, other.poses, size)


def _distance(found: Array, expected: Array, size: float) -> float:
    """Norm of theory/solvers 4: lengths over the reference length, angles in rad, the largest of all."""
    return float((np.abs(found - expected) / np.array([size, size, 1.0])).max())


def _measure(
    model: DynamicModel, start: StartReport, grid: Array, settings: Settings, reference: DynamicMotion
) -> Trial:
    from graphsynth.mechanism.constraints import residual

    if isinstance(settings, MujocoSettings):
        run = run_mujoco(model, start, grid, settings)
    else:
        run = run_exudyn(model, start, grid, settings)
    if not run.completed:
        return _nothing(settings, run.status, run.message, run.seconds)
    size = float(reference.compiled.tables.size)
    speed = float(np.abs(reference.velocities[..., 2]).max()) or 1.0
    kinetic, total = mechanical_energy(model, reference.poses, reference.velocities)
    energy = mechanical_energy(model, run.poses, run.velocities)[1]
    return Trial(
        settings.family,
        run.settings,
        run.step,
        run.status,
        run.message,
        float(np.abs(residual(model.mechanism.joints, run.poses)).max(initial=0.0)),
        _distance(run.poses, reference.poses, size),
        _distance(run.velocities, reference.velocities, size) / speed,
        float(np.abs(energy - total).max() / (kinetic.max() or 1.0)),
        math.nan,
        run.seconds,
    )


def mechanical_energy(model: DynamicModel, poses: Array, rates: Array) -> tuple[Array, Array]:
    """Kinetic energy, and kinetic with potential energy, of motions (..., links, 3), J.

    Written from the states of the links alone, so that it means the same for every engine.
    """
    kinetic, potential = np.zeros((2, *poses.shape[:-2]))
    for link, body in model.bodies.items():
        place, speed = _point(poses, rates, link, body.centre)
        kinetic += 0.5 * (body.mass * np.abs(speed) ** 2 + body.inertia * rates[..., link, 2] ** 2)
        potential -= body.mass * (np.conj(complex(*model.gravity)) * place).real
    for element in model.elements:
        if isinstance(element, Spring):
            first = _point(poses, rates, element.a, element.at_a)[0]
            length = np.abs(_point(poses, rates, element.b, element.at_b)[0] - first)
            potential += 0.5 * element.stiffness * (length - element.free_length) ** 2
        elif isinstance(element, TorsionSpring):
            turned = poses[..., element.b, 2] - poses[..., element.a, 2] - element.free_angle
            potential += 0.5 * element.stiffness * turned**2
        elif isinstance(element, TorqueSource):
            speed = element.ratio * (rates[..., element.b, 2] - rates[..., element.a, 2])
            kinetic += 0.5 * element.rotor_inertia * speed**2
    return kinetic, kinetic + potential


def _point(poses: Array, rates: Array, link: int, at: tuple[float, float]) -> tuple[Any, Any]:
    """Place and velocity of a point of a link, complex."""
    arm = np.exp(1j * poses[..., link, 2]) * complex(*at)
    place = poses[..., link, 0] + 1j * poses[..., link, 1] + arm
    return place, rates[..., link, 0] + 1j * rates[..., link, 1] + 1j * rates[..., link, 2] * arm


def _with_orders(trials: list[Trial]) -> list[Trial]:
    """Fill in the observed orders, settings by settings in the order given."""
    ordered = sorted(trials, key=lambda t: (t.family, -t.step))
    found: list[Trial] = []
    for trial in ordered:
        before = found[-1] if found and found[-1].family == trial.family else None
        order = math.nan
        if before and before.error > 0.0 and trial.error > 0.0 and before.step > trial.step:
            order = math.log(before.error / trial.error) / math.log(before.step / trial.step)
        found.append(replace(trial, order=order))
    return found


def _judge(trials: list[Trial], tolerance: float, reference_error: float) -> tuple[str, float, str]:
    done = [t for t in trials if t.status == "completed" and math.isfinite(t.error)]
    if not reference_error <= _SHARE * tolerance:
        text = f"the reference is known to {reference_error:.1e} only, too little to judge {tolerance:g}"
        return "no", reference_error, text
    if not done:
        return "no", math.nan, "every run failed; shorten the step or soften the constraints"
    good = [t for t in done if t.error <= tolerance]
    if good:
        best = min(good, key=lambda t: t.seconds)
        return "yes", best.error, f"{best.settings} with step {best.step:g} s has the error {best.error:.1e}"
    best = min(done, key=lambda t: t.error)
    text = f"the smallest error, {best.error:.1e} ({best.settings}, step {best.step:g} s), is above {tolerance:g}"
    return "no", best.error, text
