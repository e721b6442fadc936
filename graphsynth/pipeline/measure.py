"""What a stage costs (time, memory, modules), and what a run did and why: the stage graph with its costs."""

from __future__ import annotations

import math
import sys
import time
from collections.abc import Iterable, Sequence
from contextlib import suppress
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
    return result, StageTime(stage.name, imported - start, seconds, memory_in_use("VmHWM"), new_modules(before))


def reset_peak() -> None:
    """Forget the largest memory so far, where the system can (Linux); elsewhere the peak is that of the process."""
    with suppress(OSError):
        Path("/proc/self/clear_refs").write_text("5")


def memory_in_use(field: str = "VmRSS") -> float:
    """Return the resident memory of this process in MB (estimated), or, as ``VmHWM``, the largest since `reset_peak`.

    Where only the peak is known, the peak; NaN if unknown.
    """
    with suppress(OSError):
        for line in Path("/proc/self/status").read_text().splitlines():
            if line.startswith(field + ":"):
                return int(line.split()[1]) * 1024 / 1e6
    try:
        import resource
    except ImportError:
        return math.nan
    scale = 1 if sys.platform == "darwin" else 1024
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * scale / 1e6


def new_modules(before: frozenset[str]) -> tuple[str, ...]:
    """Return the rooms of graphsynth and the third-party packages that were imported since, sorted."""
    had = rooms(before)
    return tuple(room for room in rooms(set(sys.modules) - before) if room not in had)


def rooms(modules: Iterable[str]) -> tuple[str, ...]:
    """Return the rooms and third-party packages of some modules; the standard library is left out.

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
    return f"nothing asked for needs {', '.join(stage.gives)}"


def costs(time: StageTime) -> dict[str, Any]:
    """Return what a stage cost, ready for JSON."""
    return {
        "runs": time.runs,
        "import_seconds": round(time.import_seconds, 6),
        "seconds": round(time.seconds, 6),
        "peak_MB": round(time.peak_mb, 1) if math.isfinite(time.peak_mb) else None,
        "imports": list(time.modules),
    }


def explain_json(report: Report) -> dict[str, Any]:
    """Return what `explain` tells, ready for JSON; costs are those in the process that ran a stage."""
    times = {time.stage: time for time in report.times}
    wanted = report.scene.outputs.products
    ran = []
    for stage in report.stages:
        about = {"stage": stage.name, "function": stage.function}
        links = {"needs": list(stage.needs), "gives": list(stage.gives)}
        ran.append(about | links | {"why": why_run(stage, report.stages, wanted)} | costs(times[stage.name]))
    left = [stage for stage in report.scene.stages() if stage not in report.stages]
    left_out = [{"stage": stage.name, "function": stage.function, "why": why_not(stage)} for stage in left]
    return {"outputs": list(wanted), "ran": ran, "left_out": left_out}


def explain(report: Report) -> str:
    """Return a text for people: the stages that ran, with their costs, and those that did not."""
    told = explain_json(report)
    lines = [f"{report.scene.name}: asked for {', '.join(told['outputs'])}", "", "What ran, in this order"]
    for place, (stage, ran) in enumerate(zip(report.stages, told["ran"], strict=True), 1):
        how = ", candidates as they come" if stage.stream else ""
        how = f" for {ran['runs']} candidates, one by one" if stage.each else how
        peak = "" if ran["peak_MB"] is None else f", peak {ran['peak_MB']:.0f} MB"
        lines += [
            f"{place:3}  {stage.name}: {', '.join(stage.needs) or 'nothing'} -> {', '.join(stage.gives)}",
            f"       why: {ran['why']}",
            f"       import {ran['import_seconds']:.3f} s, run {ran['seconds']:.3f} s{how}{peak}",
        ]
        if ran["imports"]:
            lines.append(f"       first to import: {', '.join(ran['imports'])}")
    left = [f"     {stage['stage']}: {stage['why']}" for stage in told["left_out"]]
    lines += ["", "What did not run: not imported, not computed, not stored" if left else "Nothing was left out."]
    return "\n".join([*lines, *left, *report.notes])
