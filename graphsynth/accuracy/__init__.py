"""Error against run time of every numerical method, and the stress cases.

A problem is one question and all methods that answer it; its rows hold error, time, reference and status.  Which
problems a scene has is told by strings (`graphsynth.accuracy.registry`), imported when they are measured.
"""

from __future__ import annotations

from typing import Any

from graphsynth.lazy import resolve

_PUBLIC: dict[str, str] = {
    "AccuracyReport": "report",
    "Effort": "rows",
    "Knee": "choice",
    "Problem": "rows",
    "Row": "rows",
    "RowStatus": "rows",
    "advice": "choice",
    "front": "choice",
    "knee": "choice",
    "knees": "choice",
    "measure": "report",
    "table": "rows",
    "work_precision_picture": "pictures",
    "write_report": "report",
}

__all__ = sorted(_PUBLIC)


def __getattr__(name: str) -> Any:
    return resolve(__name__, _PUBLIC, name)


def __dir__() -> list[str]:
    return sorted({*globals(), *_PUBLIC})
