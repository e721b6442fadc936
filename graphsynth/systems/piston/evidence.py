"""``module = "floating_piston"``: what is measured of the floating piston."""

from __future__ import annotations

from typing import Any

from graphsynth.evidence.rows import Effort, Problem

__all__ = ["loads", "positions", "work"]


def _first(context: Any) -> Any:
    from graphsynth.systems.piston.stages import machines_of

    kind, machine = machines_of(context)[0]
    return kind.replace("_", "-"), machine


def positions(context: Any, effort: Effort) -> Problem:
    """Measure the motion of the first machine of the scene."""
    from graphsynth.evidence.position import position_problem

    name, machine = _first(context)
    return position_problem(machine.mechanism.mechanism("crowned"), f"the floating piston on a {name}", effort=effort)


def loads(context: Any, effort: Effort) -> Problem:
    """Measure the loads of the first machine of the scene."""
    from graphsynth.systems.piston.evidence_loads import load_problem

    name, machine = _first(context)
    return load_problem(machine, f"the floating piston on a {name}", effort)


def work(context: Any, effort: Effort) -> Problem:
    """Measure the work of the gas in the first machine of the scene."""
    from graphsynth.systems.piston.evidence_loads import work_problem

    name, machine = _first(context)
    return work_problem(machine, f"the floating piston on a {name}", effort)
