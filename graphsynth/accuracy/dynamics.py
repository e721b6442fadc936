"""Integrators on a mechanism: error, drift of the joints and of the energy against run time."""

from __future__ import annotations

import math
from inspect import signature
from typing import TYPE_CHECKING, Any

import numpy as np

from graphsynth.accuracy.rows import Effort, Problem, Row, RowStatus
from graphsynth.errors import GraphsynthError

if TYPE_CHECKING:
    from graphsynth.dynamics.braider.model import Braider
    from graphsynth.dynamics.model import DynamicModel
    from graphsynth.dynamics.start import StartReport

__all__ = ["braider_model", "dynamics_problem"]


def braider_model(braider: Braider, speed: float) -> tuple[DynamicModel, StartReport]:
    """Return the linkage of a braider without motor and thread, and a start at crank angle zero (speed in rad/s)."""
    from graphsynth.accuracy.position import four_bar
    from graphsynth.dynamics.model import Body, DynamicModel
    from graphsynth.dynamics.start import consistent_start
    from graphsynth.kinematics.lambda_linkage import LambdaLinkage

    bar, (m1, m2, m3, m4) = braider.linkage, braider.masses
    mechanism, _ = four_bar(LambdaLinkage(bar.frame, bar.crank, bar.coupler, bar.rocker, sgn=bar.branch))
    tip = braider.switch * complex(math.cos(braider.switch_angle), math.sin(braider.switch_angle))
    bodies = {
        1: Body.bar(m1, (0.0, 0.0), (bar.crank, 0.0)),
        2: Body.bar(m2, (0.0, 0.0), (bar.coupler, 0.0)),
        3: Body.combined(
            Body.bar(m3, (0.0, 0.0), (bar.rocker, 0.0)), Body.bar(m4, (0.0, 0.0), (tip.real, tip.imag))
        ),
    }  # fmt: skip
    model = DynamicModel(mechanism, bodies)
    return model, consistent_start(model, pose=mechanism.pose, keep={(0, 1): 0.0}, keep_rates={(0, 1): speed})


def dynamics_problem(
    model: DynamicModel, start: StartReport, end: float, name: str, effort: Effort | None = None
) -> Problem:
    """Integrate a mechanism in every form with several integrators and tolerances.

    Parameters
    ----------
    model : DynamicModel
    start : StartReport
    end : float
        Final time, s.
    name : str
    effort : Effort, optional

    Returns
    -------
    Problem
        Error: largest of all coordinates at eight times, lengths over the characteristic length; further columns:
        drift of positions and velocities, error of the energy.  The reference is another formulation at 2.3e-14.
    """
    from graphsynth.dynamics.integrate import simulate_dynamics
    from graphsynth.dynamics.mechanism_accuracy import dynamics_work_precision

    effort = effort or Effort()
    default = signature(simulate_dynamics).parameters["rtol"].default
    times = np.linspace(0.0, end, 8)
    tolerances = (1e-4, 1e-8, default) if effort.quick else (1e-4, 1e-6, 1e-8, 1e-10, default)
    every: tuple[str, ...] = ("minimal", "constrained", "reduced")
    rows = []
    for method in ("DOP853",) if effort.quick else ("DOP853", "RK45", "LSODA"):
        # the forms are told apart by the default integrator, the integrators by the form that is cheapest
        forms, asked = (every, tolerances) if method == "DOP853" else (("minimal",), (1e-4, 1e-6, 1e-8))
        found = dynamics_work_precision(
            model, start, times, forms=forms, methods=(method,), tolerances=asked,
            rounds=min(2, effort.rounds), max_steps=5_000,
        )  # fmt: skip
        rows += [_row(model, start, times, r, default, min(2, effort.rounds)) for r in found]
    note = "Drift and energy are those of a further run; positions are projected onto the joints (the default)."
    return Problem("linkage-dynamics", f"Motion of {name}, over {end:g} s", "relative", tuple(rows), "run", note)


def _row(model: DynamicModel, start: StartReport, times: Any, r: Any, default: float, rounds: int) -> Row:
    from graphsynth.dynamics.integrate import simulate_dynamics

    form, method = r.method.split(", ")
    done = r.status == "done" and math.isfinite(r.error)
    status = RowStatus.OK if done else RowStatus.UNRELIABLE if math.isfinite(r.error) else RowStatus.FAILED
    more = {"steps": float(r.steps)}
    if math.isfinite(r.error):
        try:
            options: dict[str, Any] = {"form": form, "method": method, "rtol": r.setting, "outputs": "exact"}
            found = simulate_dynamics(model, times, start=start, **options)
            more |= {
                "position drift": found.checks.position_drift, "velocity drift": found.checks.velocity_drift,
                "energy error": found.checks.energy,
            }  # fmt: skip
        except GraphsynthError:
            pass
    other = "constrained" if form == "reduced" else "reduced"
    return Row(
        r.method, f"rtol {r.setting:.0e}", r.error, r.seconds, rounds, "largest error of all coordinates",
        f"{other} form, DOP853 at 2.3e-14", status, "" if done else r.status,
        r.setting == default and method == "DOP853", more=more,
    )  # fmt: skip
