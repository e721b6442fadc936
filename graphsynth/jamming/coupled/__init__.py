"""Jamming of any mechanism: all joints share the misalignment (model L1).  Names are resolved on first use."""

from __future__ import annotations

from importlib import import_module
from typing import Any

_PUBLIC: dict[str, str] = {
    "FREE": "limits",
    "RIGID": "limits",
    "SPHERICAL": "limits",
    "CoupledReport": "report",
    "JointLimits": "limits",
    "Misalignment": "limits",
    "SlideLimits": "limits",
    "DirectionMap": "directions",
    "ScaleCertificate": "scale",
    "TurnCertificate": "turn",
    "assess_coupled": "assess",
    "bearing_limits": "limits",
    "certify_coupled": "turn",
    "direction_map": "directions",
    "largest_scale": "scale",
}

__all__ = sorted(_PUBLIC)


def __getattr__(name: str) -> Any:
    module = _PUBLIC.get(name)
    if module is None:
        raise AttributeError(f"module 'graphsynth.jamming.coupled' has no attribute {name!r}")
    return getattr(import_module(f"graphsynth.jamming.coupled.{module}"), name)
