"""Embodiment: dimensions for a mechanism graph, from an automatic sketch and a search.

`embody` and its result are in :mod:`.api`, goals in :mod:`.goals`, the automatic sketch in :mod:`.sketch`.
"""

from __future__ import annotations

from importlib import import_module
from typing import Any

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
    """Load a name on first use."""
    if name not in _PUBLIC:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    value = getattr(import_module(f"{__name__}.{_PUBLIC[name]}"), name)
    globals()[name] = value
    return value
