"""The antenna of a scene: poses over a sweep, a second model, the twelve equations, singular poses, tolerances."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

from graphsynth.core.errors import GeometryError
from graphsynth.pipeline.products import Table
from graphsynth.pipeline.stages import Context
from graphsynth.systems.antenna.system import AntennaTable

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from graphsynth.systems.antenna import (
        ChartReport,
        DeadPoint,
        Fold,
        ModelComparison,
        PassiveAngles,
        PointingMechanism,
        PointingSweep,
        Rates,
        Reading,
        RootSurvey,
        Tolerance,
    )

__all__ = [
    "LENGTH_NAMES",
    "AntennaMotion",
    "SecondWay",
    "SingularPoses",
    "antenna_of",
    "compare",
    "other_model",
    "second_way",
    "singular_poses",
    "solvers",
    "sweep",
    "table_of",
    "tolerances",
    "widths_of",
]

#: Keys of the lengths in the order l1 to l5.
LENGTH_NAMES = ("cardan_mm", "rod_y_mm", "crank_y_mm", "rod_x_mm", "crank_x_mm")
_SECOND_WAY_POSES = 9
_STARTS = 60


@dataclass(frozen=True, eq=False)
class AntennaMotion:
    """Equal crank angles, radians, from 0 on: where the sweep stopped, passive angles, velocities."""

    phi: NDArray[np.float64]
    path: PointingSweep
    passive: PassiveAngles
    rates: Rates


@dataclass(frozen=True, eq=False)
class SecondWay:
    """The twelve equations solved by Newton's method: largest differences from the closed form, radians."""

    phi: NDArray[np.float64]
    angles: NDArray[np.float64]
    residual: float
    difference: float
    rates_difference: float
    charts: tuple[ChartReport, ChartReport]
    survey: RootSurvey
    modes: int


@dataclass(frozen=True, eq=False)
class SingularPoses:
    """Folds and dead points of both legs with the other crank at rest, and the first fold of equal cranks."""

    folds: tuple[Fold, ...]
    dead_points: tuple[DeadPoint, ...]
    sweep_fold: Fold | None
    sweep_message: str


def table_of(context: Context) -> AntennaTable:
    """Return ``[mechanism]`` of the scene."""
    table = context.scene.mechanism
    assert isinstance(table, AntennaTable)
    return table


def antenna_of(context: Context) -> PointingMechanism:
    """Build the mechanism of the scene, lengths in metres."""
    from graphsynth.systems.antenna import PointingMechanism

    table = table_of(context)
    try:
        l1, l2, l3, l4, l5 = (getattr(table.lengths, name) / 1e3 for name in LENGTH_NAMES)
        return PointingMechanism(l1, l2, l3, l4, l5, order=table.order)
    except GeometryError as error:
        raise (context.scene.place / "mechanism" / "lengths").error(f"cannot be built: {error}") from error


def widths_of(context: Context) -> list[float]:
    """Tolerances of the five lengths, metres."""
    table = table_of(context).tolerances
    return [getattr(table, name) / 1e3 for name in LENGTH_NAMES]


def other_model(context: Context) -> tuple[PointingMechanism, Reading]:
    """Return the second model and its conventions."""
    from dataclasses import replace

    from graphsynth.systems.antenna import Reading

    c = table_of(context).comparison
    return (
        replace(antenna_of(context), order=c.order),
        Reading(c.sense_y, c.sense_x, c.side_y, c.side_x, c.output),
    )


def _equal_cranks(context: Context) -> NDArray[np.float64]:
    import numpy as np

    table = table_of(context).sweep
    return np.linspace(0.0, math.radians(table.largest_deg), table.samples)


def sweep(context: Context) -> AntennaMotion:
    """Turn both cranks together on the assembly mode of the rest pose; beyond a fold everything is NaN."""
    from dataclasses import replace

    import numpy as np

    antenna, phi = antenna_of(context), _equal_cranks(context)
    path = antenna.sweep(phi)
    found = antenna.rates(phi, phi, 1.0, 1.0)
    away = ~path.reached
    found = replace(found, jacobian=np.where(away[:, None, None], np.nan, found.jacobian))
    return AntennaMotion(phi, path, antenna.passive_angles(path.poses), found)


def compare(context: Context) -> ModelComparison:
    """Compare the outputs of the two models over the sweep."""
    other, reading = other_model(context)
    return antenna_of(context).compare(other, _equal_cranks(context), other_reading=reading)


def second_way(context: Context, motion: AntennaMotion) -> SecondWay | None:
    """Solve the twelve equations at some poses of the sweep; None if it cannot start."""
    import numpy as np

    antenna, reached = antenna_of(context), np.flatnonzero(motion.path.reached)
    if reached.size == 0:
        return None
    chosen = np.unique(reached[np.linspace(0, reached.size - 1, _SECOND_WAY_POSES).round().astype(int)])
    phi = motion.phi[chosen]
    found = antenna.solve_loops(phi, phi)
    turned = np.remainder(found.x - motion.passive.x[chosen] + math.pi, math.tau) - math.pi
    poses = antenna.poses(phi, phi)
    rates = antenna.passive_rates(poses, 1.0, 1.0)
    slow = antenna.rates(phi, phi, 1.0, 1.0)
    rates_gap = max(np.abs(rates[:, 5] - slow.da).max(), np.abs(rates[:, 11] - slow.db).max())
    last = float(phi[-1])
    charts = antenna.check_chart(0.0, 0.0, "printed"), antenna.check_chart(0.0, 0.0, "corrected")
    survey = antenna.survey_roots(last, last, starts=_STARTS, seed=context.scene.scene.seed)
    return SecondWay(
        phi, found.x, float(found.residual.max()), float(np.abs(turned).max()), float(rates_gap), charts, survey,
        int(antenna.solve(last, last).count),
    )  # fmt: skip


def singular_poses(context: Context) -> SingularPoses:
    """Find folds and dead points over a turn of each crank, and the first fold of equal cranks up to half a turn."""
    import numpy as np

    antenna = antenna_of(context)
    folds = [fold for leg in ("Y", "X") for fold in antenna.folds(leg)]
    dead = [point for leg in ("Y", "X") for point in antenna.dead_points(leg)]
    path = antenna.sweep(np.linspace(0.0, math.pi, 181))
    return SingularPoses(tuple(folds), tuple(dead), path.fold, path.message)


def tolerances(context: Context) -> tuple[tuple[float, Tolerance], ...]:
    """Prove bounds of both outputs at the equal crank angles asked for, degrees."""
    antenna, widths = antenna_of(context), widths_of(context)
    found = []
    for degrees in table_of(context).tolerances.at_deg:
        phi = math.radians(degrees)
        try:
            found.append((degrees, antenna.tolerance(phi, phi, widths, converted=True)))
        except GeometryError as error:
            raise (context.scene.place / "mechanism" / "tolerances").error(f"cannot be used: {error}") from error
    return tuple(found)


def solvers(context: Context) -> tuple[Table, ...]:
    """Error against run time of the closed form and of the twelve equations; not part of the shipped outputs."""
    from graphsynth.systems.antenna.accuracy import pointing_errors

    found = pointing_errors(antenna_of(context), math.radians(table_of(context).sweep.largest_deg))
    rows = tuple((row.method, row.setting, f"{row.error:.1e}", f"{1e6 * row.seconds:.3g}") for row in found)
    columns = ("method", "setting", "error [rad]", "time per pose [µs]")
    return (Table("Error against run time", columns, rows, "Largest error of both angles, against 50 digits."),)
