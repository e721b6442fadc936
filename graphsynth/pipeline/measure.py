"""What a stage costs (time, memory, modules), and what a run did and why: the stage graph with its costs."""

from __future__ import annotations

import math
import sys
import time
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

from graphsynth.pipeline.stages import Context, Report, StageTime
from graphsynth.pipeline.system import Stage


def measured(stage: Stage, context: Context, needs: Sequence[Any]) -> tuple[Any, StageTime]:
    """Import and call a stage, here or in another process; return what it gave and what it cost."""
    before = frozenset(sys.modules)
    reset_peak()
    start = time.perf_counter()
    function = stage.load()
    imported = time.perf_counter()
    result = function(context, *needs)
    seconds = time.perf_counter() - imported
    return result, StageTime(stage.name, imported - start, seconds, peak_memory(), new_modules(before))


_STATUS = Path("/proc/self/status")
_MB = 1e6


def reset_peak() -> None:
    """Forget the largest memory so far, where the system can (Linux); elsewhere the peak is that of the process."""
    try:
        Path("/proc/self/clear_refs").write_text("5")
    except OSError:
        return


def peak_memory() -> float:
    """Return the largest resident memory since :func:`reset_peak`, in MB (estimated); NaN where it is unknown."""
    return _status("VmHWM") or _usage()


def memory_in_use() -> float:
    """Return the resident memory of this process in MB; where only the peak is known, the peak; NaN if unknown."""
    return _status("VmRSS") or _usage()


def _status(field: str) -> float:
    try:
        text = _STATUS.read_text()
    except OSError:
        return 0.0
    for line in text.splitlines():
        if line.startswith(field + ":"):
            return int(line.split()[1]) * 1024 / _MB
    return 0.0


def _usage() -> float:
    try:
        import resource
    except ImportError:
        return float("nan")
    scale = 1 if sys.platform == "darwin" else 1024
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * scale / _MB


def new_modules(before: frozenset[str]) -> tuple[str, ...]:
    """Return the rooms of graphsynth and the third-party packages that were imported since, sorted."""
    had = rooms(before)
    return tuple(room for room in rooms(set(sys.modules) - before) if room not in had)


def rooms(modules: Iterable[str]) -> tuple[str, ...]:
    """Return the rooms and third-party packages of some modules; the standard library is left out.

    Examples
    --------
    >>> rooms(["json", "numpy.linalg", "numpy", "graphsynth.jamming.assess", "graphsynth.systems.x.y", "_abc"])
    ('graphsynth.jamming', 'graphsynth.systems.x', 'numpy')
    """
    found = set()
    for module in modules:
        first, *rest = module.split(".")
        if first == "graphsynth":
            depth = 2 if rest[:1] == ["systems"] else 1
            if depth == 1 or len(rest) > 1:
                found.add(".".join([first, *rest[:depth]]))
        elif first not in sys.stdlib_module_names and not first.startswith("_"):
            found.add(first)
    return tuple(sorted(found))


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

    Times, memory and imports are those of the process that ran them.
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
