"""``module = "floating_piston"``: what is measured of the floating piston."""

from __future__ import annotations

from typing import Any

from graphsynth.accuracy.registry import build
from graphsynth.accuracy.rows import Effort, Problem

__all__ = ["loads", "positions", "work"]


def _first(context: Any) -> Any:
    kind, machine = build("graphsynth.scenes.steps.piston:machines_of", context)[0]
    return kind.replace("_", "-"), machine


def positions(context: Any, effort: Effort) -> Problem:
    """Measure the motion of the first machine of the scene."""
    from graphsynth.accuracy.position import position_problem

    name, machine = _first(context)
    return position_problem(machine.mechanism.mechanism("crowned"), f"the floating piston on a {name}", effort=effort)


def loads(context: Any, effort: Effort) -> Problem:
    """Measure the loads of the first machine of the scene."""
    from graphsynth.accuracy.piston import load_problem

    name, machine = _first(context)
    return load_problem(machine, f"the floating piston on a {name}", effort)


def work(context: Any, effort: Effort) -> Problem:
    """Measure the work of the gas in the first machine of the scene."""
    from graphsynth.accuracy.piston import work_problem

    name, machine = _first(context)
    return work_problem(machine, f"the floating piston on a {name}", effort)
