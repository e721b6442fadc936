"""The floating piston: loads in closed form and by multipliers, and the motion of its mechanism."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from graphsynth.accuracy.rows import Effort, Problem, Row, best_of
from graphsynth.errors import GeometryError

if TYPE_CHECKING:
    from graphsynth.dynamics.piston import PistonMachine

__all__ = ["load_problem", "work_problem"]


def load_problem(machine: PistonMachine, name: str, effort: Effort | None = None) -> Problem:
    """Compare the loads of a piston machine by closed form with those by multipliers, and the energy balance.

    Parameters
    ----------
    machine : PistonMachine
    name : str
    effort : Effort, optional
    """
    from graphsynth.dynamics.piston_model import check_by_multipliers

    effort = effort or Effort()
    rows = []
    counts = (6, 12, 24) if effort.quick else (12, 24, 96)
    for count in counts:
        angles = (np.arange(count) + 0.5) * math.tau / count
        loads, seconds, rounds = best_of(lambda a=angles: machine.loads(a), effort)  # type: ignore[misc]
        check, slow, slow_rounds = best_of(lambda a=angles: check_by_multipliers(machine, a), effort)  # type: ignore[misc]
        kind, unit = "largest difference of a force over the largest force", f"{count} positions"
        more = {"power error": float(loads.power_error)}
        rows.append(Row("closed form", unit, float(check.difference), seconds / count, rounds, kind,
                        "multipliers of all bodies at once", more=more))  # fmt: skip
        rows.append(Row("multipliers", unit, float(check.difference), slow / count, slow_rounds, kind, "closed form"))
    rows.sort(key=lambda row: row.method)
    note = "Each of the two ways is the other's reference."
    return Problem("loads", f"Side loads of {name} over a turn", "relative", tuple(rows), "position", note)


def work_problem(machine: PistonMachine, name: str, effort: Effort | None = None) -> Problem:
    """Integrate the gas work over a turn: even steps, and the pieces between the kinks of the load.

    Raises
    ------
    GeometryError
        A gas law without work.
    """
    from graphsynth.dynamics.piston_turn import piston_turn

    effort = effort or Effort()
    exact = machine.gas.work(machine.mechanism.stroke)
    if not math.isfinite(exact) or exact == 0.0:
        raise GeometryError("the gas does no work over a turn, so there is nothing to compare")
    rows = []
    for count in (90, 360, 1440) if effort.quick else (90, 360, 1440, 5760, 23_040):
        value, seconds, rounds = best_of(_trapezium(machine, count), effort)
        rows.append(_work("even steps", f"{count} positions", value, exact, seconds, rounds))
    found, seconds, rounds = best_of(lambda: piston_turn(machine), effort)
    rows.append(_work("pieces between kinks, all works", "", float(found.gas), exact, seconds, rounds))
    return Problem("work", f"Work of the gas of {name} over a turn", "relative", tuple(rows), "turn")


def _trapezium(machine: PistonMachine, count: int) -> Any:
    angles = np.arange(count) * math.tau / count

    def run() -> float:
        force = machine.gas_force(angles)
        speed = machine.mechanism.motion(angles).piston.first
        return float(np.sum(force * speed) * math.tau / count)

    return run


def _work(method: str, setting: str, value: float, exact: float, seconds: float, rounds: int) -> Row:
    error = min(abs(value - exact), abs(value + exact)) / abs(exact)
    return Row(
        method, setting, error, seconds, rounds, "distance from the reference", "area of the p-V diagram, closed form"
    )
