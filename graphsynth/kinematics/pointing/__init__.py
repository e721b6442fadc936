"""The antenna pointing mechanism: a reflector on a gimbal, tilted about two axes by two cranks.

`PointingMechanism` is the entry; the modules behind its methods are loaded when a method needs them.
"""

from __future__ import annotations

from typing import Any

from graphsynth.lazy import resolve

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
    return resolve(__name__, _PUBLIC, name)
