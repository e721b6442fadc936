"""What a stage costs: time, memory, modules."""

from __future__ import annotations

import math
import sys
import time
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from graphsynth.pipeline.stages import Context, Stage, load

__all__ = ["StageTime", "measured", "memory_in_use", "new_modules", "peak_memory", "reset_peak", "rooms"]


@dataclass(frozen=True, slots=True)
class StageTime:
    """What a stage took (estimated, one measurement).

    Attributes
    ----------
    import_seconds, seconds : float
        Wall clock; for a stage for each candidate the sum over candidates, wherever they were computed.
    peak_mb : float
        Largest resident memory of the process where it ran, while it ran, in MB; of all stages for each candidate
        together.
    modules : tuple of str
        Rooms of graphsynth and third-party packages it was the first to import, in the process where it ran.
    runs : int
        How many candidates it looked at; 1 for a stage over all.
    """

    stage: str
    import_seconds: float
    seconds: float
    peak_mb: float = math.nan
    modules: tuple[str, ...] = ()
    runs: int = 1


def measured(stage: Stage, context: Context, needs: Sequence[Any]) -> tuple[Any, StageTime]:
    """Import and call a stage, here or in another process; return what it gave and what it cost."""
    before = frozenset(sys.modules)
    reset_peak()
    start = time.perf_counter()
    function = load(stage)
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
            found.add(".".join([first, *rest[: 2 if rest[:1] == ["systems"] else 1]]))
        elif first not in sys.stdlib_module_names and not first.startswith("_"):
            found.add(first)
    return tuple(sorted(found - {"graphsynth.systems"}))
