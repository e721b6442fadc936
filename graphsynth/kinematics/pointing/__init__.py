"""The antenna pointing mechanism: a reflector on a gimbal, tilted about two axes by two cranks.

`PointingMechanism` is the entry; the modules behind its methods are loaded when a method needs them.
"""

from __future__ import annotations

from importlib import import_module
from typing import Any

_PUBLIC: dict[str, str] = {
    "ApproachToFold": "approach",
    "AssemblyModes": "modes",
    "ChartReport": "charts",
    "CrankAngles": "cranks",
    "DeadPoint": "folds",
    "Fold": "folds",
    "LoopSolution": "newton",
    "ModelComparison": "comparison",
    "PassiveAngles": "passive",
    "PointingMechanism": "mechanism",
    "PointingSweep": "sweep",
    "PoseStatus": "results",
    "Poses": "results",
    "Rates": "rates",
    "Reading": "comparison",
    "RootSurvey": "newton",
    "Tolerance": "tolerance",
}

__all__ = sorted(_PUBLIC)


def __getattr__(name: str) -> Any:
    module = _PUBLIC.get(name)
    if module is None:
        raise AttributeError(f"module 'graphsynth.kinematics.pointing' has no attribute {name!r}")
    return getattr(import_module(f"graphsynth.kinematics.pointing.{module}"), name)
