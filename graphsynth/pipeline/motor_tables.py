"""What the scenes of the drives share: method and errors of a run, motions in closed form for animations."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from graphsynth.pipeline.display import table
from graphsynth.pipeline.products import Table

if TYPE_CHECKING:
    from graphsynth.dynamics.driven.reduction import ReductionStudy
    from graphsynth.dynamics.driven.run import DriveRun
    from graphsynth.kinematics.engine.result import Motion


def balance_rows(run: DriveRun) -> tuple[tuple[str, str], ...]:
    """Return model, method, errors, balances and cost of a run."""
    names = ("angle", "speed", *(f"current {k}" for k in range(1, run.currents.shape[1] + 1)))
    units = ("rad", "rad/s", *("A",) * run.currents.shape[1])
    errors = ", ".join(f"{name} {value:.1e} {unit}" for name, value, unit in zip(names, run.error, units))
    warned = run.complete and not (run.energy_error <= 1e-9 and run.electric_error <= 1e-9)
    return (
        ("status", run.reason or "reached the last output time"),
        ("model", run.model),
        ("estimated error", f"{errors} (second run at a hundred times the tolerance)"),
        ("energy balance, mechanical", f"{run.energy_error:.1e} of the energy moved{' (WARNING)' if warned else ''}"),
        ("energy balance, electrical", f"{run.electric_error:.1e} of the energy moved{' (WARNING)' if warned else ''}"),
        ("steps, rejected", f"{run.steps}, {run.rejected} at tolerance {run.rtol:g}"),
        ("time of the run", f"{run.seconds * 1e3:.1f} ms, measured once"),
        *(("note", note) for note in run.notes),
    )


def limit_table(study: ReductionStudy) -> Table:
    """Distance from the limit L -> 0 for each inductance."""
    rows = zip(study.inductance, study.angle, study.speed, (None, *study.order), map(str, study.steps))
    columns = ("inductance [H] | .0e", "angle [rad] | .3e", "speed [rad/s] | .3e", "order | .3f", "steps")
    note = "Largest differences from the motor with L = 0 after the electrical transient; the order is 1 in the limit."
    return table("The limit L -> 0", columns, rows, note)


def shown_motion(mechanism: Any, inputs: Any, poses: Any, *, closed: bool) -> Motion:
    """Poses from a closed form as a motion to be animated; what a picture does not show is NaN.

    Parameters
    ----------
    mechanism : Mechanism
    inputs : ndarray, shape (n,)
        Driver coordinates.
    poses : ndarray, shape (n, links, 3)
    closed : bool
        The last pose is the first again.
    """
    import math

    import numpy as np

    from graphsynth.kinematics.engine.result import Closure, Motion

    missing = np.full_like(poses, np.nan)
    count = len(inputs)
    closure = Closure(closed, closed, 0.0 if closed else math.nan, 1 if closed else 0, (), "closed form")
    return Motion(
        mechanism, inputs, poses, missing, missing, np.zeros((count, 0), np.int8), np.zeros((count, 0)),
        np.isfinite(poses).all(axis=(1, 2)), (), (), True, "", math.nan, closure, math.nan, 0.0,
    )  # fmt: skip
