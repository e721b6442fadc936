"""Embodiment: dimensions for a mechanism graph, from an automatic sketch and a search.

`embody` and its result are in :mod:`.api`, goals in :mod:`.goals`, the automatic sketch in :mod:`.sketch`.
"""

from __future__ import annotations

from typing import Any

from graphsynth.lazy import resolve

_PUBLIC = {
    "Embodiment": "api",
    "Figures": "verify",
    "FunctionGoal": "goals",
    "Goals": "goals",
    "JointLayout": "sketch",
    "LineGoal": "goals",
    "PathGoal": "goals",
    "PosesGoal": "goals",
    "embody": "api",
    "layout": "sketch",
}

__all__ = [
    "Embodiment",
    "Figures",
    "FunctionGoal",
    "Goals",
    "JointLayout",
    "LineGoal",
    "PathGoal",
    "PosesGoal",
    "embody",
    "layout",
]


def __getattr__(name: str) -> Any:
    return resolve(__name__, _PUBLIC, name)
