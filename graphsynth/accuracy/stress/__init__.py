"""Stiff and extreme cases: what is right, what the library gives, how far apart they are.

Importing loads nothing; a case is imported when it runs.
"""

from __future__ import annotations

from typing import Any

from graphsynth.lazy import resolve

_PUBLIC = {
    "Case": "catalogue",
    "Check": "checks",
    "Checks": "checks",
    "Outcome": "running",
    "Status": "checks",
    "StressReport": "running",
    "run_case": "running",
    "run_stress": "running",
    "stress_cases": "catalogue",
}

__all__ = sorted(_PUBLIC)


def __getattr__(name: str) -> Any:
    return resolve(__name__, _PUBLIC, name)


def __dir__() -> list[str]:
    return sorted({*globals(), *_PUBLIC})
