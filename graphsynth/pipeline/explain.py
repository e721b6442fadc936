"""What a run did and why, and what it left out: the stage graph with its costs."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from graphsynth.pipeline.measure import StageTime
from graphsynth.pipeline.stages import Stage

if TYPE_CHECKING:
    from graphsynth.pipeline.runner import Report

__all__ = ["explain", "explain_json", "why_not", "why_run"]


def why_run(stage: Stage, stages: Sequence[Stage], wanted: Sequence[str]) -> str:
    """Say which outputs and which other stages of a run need a stage.

    Examples
    --------
    >>> a, b = Stage("a", "m:a", (), ("x", "w")), Stage("b", "m:b", ("x",), ("y",))
    >>> why_run(a, (a, b), ("w", "y"))
    'w asked for; x needed by b'
    """
    asked = [product for product in stage.gives if product in wanted]
    reasons = [f"{', '.join(asked)} asked for"] if asked else []
    for product in stage.gives:
        users = [other.name for other in stages if product in other.needs]
        if users:
            reasons.append(f"{product} needed by {', '.join(users)}")
    return "; ".join(reasons)


def why_not(stage: Stage) -> str:
    """Say why a stage did not run."""
    gives = ", ".join(stage.gives)
    return f"nothing asked for needs {gives}"


def explain(report: Report) -> str:
    """Return a text for people: the stages that ran, with their costs, and those that did not.

    Parameters
    ----------
    report : Report
        Of a run; its times, memory and imports are those of the process that ran it.
    """
    times = {time.stage: time for time in report.times}
    wanted = report.scene.outputs.products
    lines = [f"{report.scene.name}: asked for {', '.join(wanted)}", "", "What ran, in this order"]
    for place, stage in enumerate(report.stages, 1):
        lines += [
            f"{place:3}  {stage.name}: {', '.join(stage.needs) or 'nothing'} -> {', '.join(stage.gives)}",
            f"       why: {why_run(stage, report.stages, wanted)}",
            f"       {_cost(stage, times[stage.name])}",
        ]
        if times[stage.name].modules:
            lines.append(f"       first to import: {', '.join(times[stage.name].modules)}")
    left = _left_out(report)
    lines += ["", "What did not run: not imported, not computed, not stored" if left else "Nothing was left out."]
    lines += [f"     {stage.name}: {why_not(stage)}" for stage in left]
    return "\n".join([*lines, *report.notes])


def _left_out(report: Report) -> list[Stage]:
    return [stage for stage in report.scene.stages() if stage not in report.stages]


def _cost(stage: Stage, time: StageTime) -> str:
    peak = f", peak {time.peak_mb:.0f} MB" if math.isfinite(time.peak_mb) else ""
    how = (
        f" for {time.runs} candidates, one by one"
        if stage.each
        else ", candidates as they come"
        if stage.stream
        else ""
    )
    return f"import {time.import_seconds:.3f} s, run {time.seconds:.3f} s{how}{peak}"


def explain_json(report: Report) -> dict[str, Any]:
    """Return the same for scripts."""
    times = {time.stage: time for time in report.times}
    wanted = report.scene.outputs.products
    return {
        "outputs": list(wanted),
        "ran": [
            {
                "stage": stage.name,
                "function": stage.function,
                "needs": list(stage.needs),
                "gives": list(stage.gives),
                "why": why_run(stage, report.stages, wanted),
                "runs": times[stage.name].runs,
                "import_seconds": times[stage.name].import_seconds,
                "seconds": times[stage.name].seconds,
                "peak_MB": times[stage.name].peak_mb if math.isfinite(times[stage.name].peak_mb) else None,
                "imports": list(times[stage.name].modules),
            }
            for stage in report.stages
        ],
        "left_out": [{"stage": s.name, "function": s.function, "why": why_not(s)} for s in _left_out(report)],
    }
