"""Rotation to reciprocation with two structural groups, in spaces of mobility 3 and 2: the floating piston.

Every public name is resolved on first use, so that importing the package is free.
"""

from __future__ import annotations

from typing import Any

from graphsynth.lazy import resolve

_PUBLIC: dict[str, str] = {
    "CrankSlider": "drives",
    "DeadCentre": "model",
    "FloatingGroup": "group",
    "FloatingPiston": "model",
    "LoopSpace": "spaces",
    "LoopSpaces": "spaces",
    "PistonMotion": "model",
    "ScotchYoke": "drives",
    "loop_spaces": "spaces",
    "rotary_assignments": "assignments",
}

__all__ = sorted(_PUBLIC)


def __getattr__(name: str) -> Any:
    return resolve(__name__, _PUBLIC, name)


def __dir__() -> list[str]:
    return sorted({*globals(), *_PUBLIC})
