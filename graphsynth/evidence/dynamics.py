"""Integrators on a mechanism: error, drift of the joints and of the energy against run time."""

from __future__ import annotations

import math
from collections.abc import Callable
from inspect import signature
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from graphsynth.core.errors import GraphsynthError
from graphsynth.evidence.rows import Effort, Problem, Row, RowStatus

if TYPE_CHECKING:
    from graphsynth.dynamics.model import DynamicModel
    from graphsynth.dynamics.result import DynamicMotion
    from graphsynth.dynamics.start import StartReport
    from graphsynth.systems.braider.model import Braider

__all__ = ["Truth", "braider_model", "dynamics_problem", "precise_swing"]

Array = NDArray[np.float64]


class Truth(NamedTuple):
    """A reference of its own: times (s) to centres of mass and angles of the moving links, and what it is."""

    coordinates: Callable[[Array], Array]
    name: str


def braider_model(braider: Braider, speed: float) -> tuple[DynamicModel, StartReport]:
    """Return the linkage of a braider without motor and thread, and a start at crank angle zero (speed in rad/s)."""
    from graphsynth.dynamics.model import DynamicModel
    from graphsynth.dynamics.start import consistent_start
    from graphsynth.evidence.position import four_bar
    from graphsynth.mechanism.four_bar import TiltedFourBar
    from graphsynth.systems.braider.evidence_four_bar import bodies_of

    bar = braider.linkage
    mechanism, _ = four_bar(TiltedFourBar(bar.frame, bar.crank, bar.coupler, bar.rocker, sgn=bar.branch))
    model = DynamicModel(mechanism, bodies_of(braider))
    return model, consistent_start(model, pose=mechanism.pose, keep={(0, 1): 0.0}, keep_rates={(0, 1): speed})


def precise_swing(braider: Braider, speed: float, times: Array, gravity: tuple[float, float]) -> Array:
    """Free motion of the linkage of `braider_model`, in long doubles: centres of mass and angles, shape (n, 9).

    One equation for the crank, from the closed loop and the bodies, integrated by extrapolation; see
    `graphsynth.evidence.precise_drive`.
    """
    from graphsynth.evidence.precise_drive import precise_drive
    from graphsynth.systems.braider.evidence_four_bar import bodies_of, places, shape_of_four_bar

    bodies = bodies_of(braider)
    shape = shape_of_four_bar(braider.linkage, bodies, gravity)
    found = precise_drive(shape, None, 1.0, 0.0, 0.0, times.tolist(), speed=speed)
    return np.array([places(braider.linkage, bodies, angle) for angle in found[:, 0]], dtype=np.float64)


def dynamics_problem(
    model: DynamicModel, start: StartReport, end: float, name: str, effort: Effort | None = None, *,
    truth: Truth | None = None,
) -> Problem:  # fmt: skip
    """Integrate a mechanism in every form with several integrators and tolerances.

    Parameters
    ----------
    model : DynamicModel
    start : StartReport
    end : float
        Final time, s.
    name : str
    effort : Effort, optional
    truth : Truth, optional
        By default the reference is another formulation of the same model, by the same integrator at 2.3e-14.

    Returns
    -------
    Problem
        Error: largest of all coordinates at eight times, lengths over the characteristic length; further columns:
        drift of positions and velocities, error of the energy.
    """
    from graphsynth.dynamics.integrate import simulate_dynamics
    from graphsynth.evidence.mechanism_accuracy import dynamics_work_precision

    effort = effort or Effort()
    default = signature(simulate_dynamics).parameters["rtol"].default
    times = np.linspace(0.0, end, 8)
    tolerances = (1e-4, 1e-8, default) if effort.quick else (1e-4, 1e-6, 1e-8, 1e-10, default)
    every: tuple[str, ...] = ("one-coordinate", "augmented", "partitioned")
    right = truth.coordinates(times) if truth else None
    rows = []
    for method in ("DOP853",) if effort.quick else ("DOP853", "RK45", "LSODA"):
        # the forms are told apart by the default integrator, the integrators by the form that is cheapest
        forms, asked = (every, tolerances) if method == "DOP853" else (("one-coordinate",), (1e-4, 1e-6, 1e-8))
        found = dynamics_work_precision(
            model, start, times, forms=forms, methods=(method,), tolerances=asked,
            rounds=min(2, effort.rounds), max_steps=5_000,
        )  # fmt: skip
        rows += [_row(model, start, times, r, default, min(2, effort.rounds), right, truth) for r in found]
    note = "Drift and energy are those of a further run; positions are projected onto the joints (the default)."
    if truth is None:
        note += " The reference is another formulation of the same model, by the same integrator: no code of its own."
    return Problem("linkage-dynamics", f"Motion of {name}, over {end:g} s", "relative", tuple(rows), "run", note)


def _row(
    model: DynamicModel, start: StartReport, times: Array, r: Any, default: float, rounds: int, right: Array | None,
    truth: Truth | None,
) -> Row:  # fmt: skip
    from graphsynth.dynamics.integrate import simulate_dynamics

    form, method = r.method.split(", ")
    done = r.status == "done" and math.isfinite(r.error)
    status = RowStatus.OK if done else RowStatus.UNRELIABLE if math.isfinite(r.error) else RowStatus.FAILED
    more, error = {"steps": float(r.steps)}, float(r.error)
    other = "augmented" if form == "partitioned" else "partitioned"
    reference = f"{other} form, DOP853 at 2.3e-14"
    if math.isfinite(r.error):
        try:
            options: dict[str, Any] = {"form": form, "method": method, "rtol": r.setting, "outputs": "exact"}
            found = simulate_dynamics(model, times, start=start, **options)
            more |= {
                "position drift": found.checks.position_drift, "velocity drift": found.checks.velocity_drift,
                "energy error": found.checks.energy,
            }  # fmt: skip
            if right is not None and truth is not None:
                more["distance from " + reference] = error
                error, reference = _away(found, right), truth.name
        except GraphsynthError:
            pass
    return Row(
        r.method, f"rtol {r.setting:.0e}", error, r.seconds, rounds, "largest error of all coordinates",
        reference, status, "" if done else r.status,
        r.setting == default and method == "DOP853", more=more,
    )  # fmt: skip


def _away(found: DynamicMotion, right: Array) -> float:
    """Largest error of all coordinates; lengths over the characteristic length, angles up to full turns."""
    gap = (found.q - right).reshape(len(right), -1, 3)
    gap[..., 2] = np.angle(np.exp(1j * gap[..., 2]))
    size = found.compiled.tables.size
    return float(np.abs(gap / np.array([size, size, 1.0])).max())
