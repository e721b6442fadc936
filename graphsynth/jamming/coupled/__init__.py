"""Jamming of any mechanism: all joints share the misalignment (model L1).  Names are resolved on first use."""

from __future__ import annotations

from typing import Any

from graphsynth.lazy import resolve

_PUBLIC: dict[str, str] = {
    "FREE": "limits",
    "RIGID": "limits",
    "SPHERICAL": "limits",
    "CoupledReport": "report",
    "JointLimits": "limits",
    "Loosened": "loosening",
    "LooseningTable": "loosening",
    "Witness": "witness",
    "compare_loosening": "loosening",
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
    return resolve(__name__, _PUBLIC, name)
