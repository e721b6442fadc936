"""``module = "floating_piston"``: what is measured of the floating piston."""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import partial
from typing import Any

import mpmath
import numpy as np

from graphsynth.core.errors import GeometryError
from graphsynth.evidence.position import position_problem
from graphsynth.evidence.rows import Effort, Problem, Row, best_of
from graphsynth.systems.piston.loads import CompressorCycle
from graphsynth.systems.piston.machine import PistonMachine
from graphsynth.systems.piston.stages import machines_of
from graphsynth.systems.piston.turn import piston_turn


def _first(context: Any) -> Any:
    kind, machine = machines_of(context)[0]
    return kind.replace("_", "-"), machine


def positions(context: Any, effort: Effort) -> Problem:
    """Measure the motion of the first machine of the scene."""
    name, machine = _first(context)
    return position_problem(machine.mechanism.mechanism("crowned"), f"the floating piston on a {name}", effort=effort)


def loads(context: Any, effort: Effort) -> Problem:
    """Measure the loads of the first machine of the scene."""
    name, machine = _first(context)
    return load_problem(machine, f"the floating piston on a {name}", effort)


def work(context: Any, effort: Effort) -> Problem:
    """Measure the work of the gas in the first machine of the scene."""
    name, machine = _first(context)
    return work_problem(machine, f"the floating piston on a {name}", effort)


def load_problem(machine: PistonMachine, name: str, effort: Effort | None = None) -> Problem:
    """Compare the forces of a piston machine with a crowned slot, and with a sliding one that is redundant."""
    effort = effort or Effort()
    rows = []
    kind, methods = "largest difference of a force over the largest force", ("crowned slot", "sliding slot")
    for count in (6, 12, 24) if effort.quick else (12, 24, 96):
        angles = (np.arange(count) + 0.5) * math.tau / count
        ways = [best_of(partial(machine.inverse_dynamics, angles, slot), effort) for slot in ("crowned", "sliding")]
        forces = [np.array([joint.force for joint in way[0].reactions.joints]) for way in ways]
        error = float(np.abs(forces[0] - forces[1]).max() / np.abs(forces).max())
        more = {"power error": float(machine.loads(angles).power_error)}
        for own, other, way in zip(methods, methods[::-1], ways):
            rows.append(Row(own, f"{count} positions", error, way[1] / count, way[2], kind, other, more=more))
    rows.sort(key=lambda row: row.method)
    note = "Each of the two is the other's reference: an error of the forces that both share is not seen."
    return Problem("loads", f"Side loads of {name} over a turn", "relative", tuple(rows), "position", note)


def work_problem(machine: PistonMachine, name: str, effort: Effort | None = None) -> Problem:
    """Integrate the gas work over a turn: even steps, and the pieces between the kinks of the load.

    A `GeometryError` refuses a gas law without work.
    """
    effort = effort or Effort()
    exact = machine.gas.work(machine.mechanism.stroke)
    reference = "area of the p-V diagram, closed form of the gas law"
    if isinstance(machine.gas, CompressorCycle):
        exact = float(precise_work(machine.gas, machine.mechanism.stroke))
        reference = "area of the p-V diagram, quadrature with 50 digits"
    if not math.isfinite(exact) or exact == 0.0:
        raise GeometryError("the gas does no work over a turn, so there is nothing to compare")

    def even_steps(count: int) -> float:
        angles = np.arange(count) * math.tau / count
        speed = machine.mechanism.motion(angles).piston.first
        return float(np.sum(machine.gas_force(angles) * speed) * math.tau / count)

    runs: list[tuple[str, str, Callable[[], float]]] = [
        ("even steps", f"{n} positions", partial(even_steps, n))
        for n in ((90, 360, 1440) if effort.quick else (90, 360, 1440, 5760, 23_040))
    ]
    runs.append(("pieces between kinks, all works", "", lambda: float(piston_turn(machine).gas)))
    rows = []
    for method, setting, run in runs:
        value, *timed = best_of(run, effort)
        error = min(abs(value - exact), abs(value + exact)) / abs(exact)
        rows.append(Row.of(method, setting, error, timed, reference=reference))
    return Problem("work", f"Work of the gas of {name} over a turn", "relative", tuple(rows), "turn")


def precise_work(gas: CompressorCycle, stroke: float) -> Any:
    """Return the indicated work of a compressor over a turn, J: area of its diagram by quadrature with 50 digits.

    Compression and re-expansion are polytropic, the valves open at the pressures outside; no formula for the work is
    used.

    Examples
    --------
    >>> from graphsynth.systems.piston.loads import CompressorCycle
    >>> gas = CompressorCycle(0.1, suction=1e5, discharge=6e5)
    >>> abs(float(precise_work(gas, 0.1)) / gas.work(0.1) - 1.0) < 1e-15
    True
    """
    with mpmath.workdps(50):
        low, high, c, n = (mpmath.mpf(float(v)) for v in (gas.suction, gas.discharge, gas.clearance, gas.exponent))
        area = mpmath.pi * mpmath.mpf(gas.bore) ** 2 / 4
        top = min(high, low * ((1 + c) / c) ** n)  # the valve may never open
        opens = min(mpmath.mpf(1), (1 + c) * (low / top) ** (1 / n) - c), c * ((top / low) ** (1 / n) - 1)
        closing = mpmath.quad(lambda x: low * ((1 + c) / (x + c)) ** n, [opens[0], 1]) + opens[0] * top
        opening = mpmath.quad(lambda x: top * (c / (x + c)) ** n, [0, opens[1]]) + (1 - opens[1]) * low
        return area * mpmath.mpf(stroke) * (closing - opening)
