"""graphsynth: from an integer equation to a proved verdict.

``import graphsynth`` loads nothing but this file: every public name is resolved on first use (PEP 562), so that a
script pays only for what it asks.
"""

from __future__ import annotations

from importlib import import_module
from typing import Any

__version__ = "0.1.0"

_PUBLIC: dict[str, str] = {
    "StructuralSpec": "graphsynth.structure.spec",
    "LinkAssortment": "graphsynth.structure.spec",
    "MechanismGraph": "graphsynth.structure.graph",
    "Joint": "graphsynth.structure.graph",
    "enumerate_chains": "graphsynth.synthesis",
    "count_chains": "graphsynth.synthesis",
    "enumerate_mechanisms": "graphsynth.synthesis",
    "count_mechanisms": "graphsynth.synthesis",
    "sample_mechanisms": "graphsynth.synthesis",
    "enumerate_assur_groups": "graphsynth.synthesis",
    "count_assur_groups": "graphsynth.synthesis",
    "enumerate_baranov_trusses": "graphsynth.synthesis",
    "count_baranov_trusses": "graphsynth.synthesis",
    "Mechanism": "graphsynth.mechanism.model",
    "Driver": "graphsynth.mechanism.model",
    "Revolute": "graphsynth.mechanism.joints",
    "Prismatic": "graphsynth.mechanism.joints",
    "PinSlot": "graphsynth.mechanism.joints",
    "Gear": "graphsynth.mechanism.joints",
    "Cam": "graphsynth.mechanism.joints",
    "simulate": "graphsynth.kinematics.simulation",
    "simulate_batch": "graphsynth.kinematics.simulation",
    "embody": "graphsynth.kinematics.embodiment.api",
    "Goals": "graphsynth.kinematics.embodiment.goals",
    "certify": "graphsynth.kinematics.certified.poses",
    "LambdaLinkage": "graphsynth.kinematics.lambda_linkage",
    "ParallelPlatform": "graphsynth.kinematics.parallel_platform",
    "SingleMotorPlatform": "graphsynth.kinematics.single_motor_platform",
    "PointingMechanism": "graphsynth.kinematics.pointing",
    "Interval": "graphsynth.intervals.interval",
    "krawczyk": "graphsynth.intervals.proving",
    "Status": "graphsynth.intervals.status",
    "assess_jamming": "graphsynth.jamming.assess",
    "JammingReport": "graphsynth.jamming.assess",
    "run": "graphsynth.scenes.runner",
}

__all__ = ["__version__", *sorted(_PUBLIC)]


def __getattr__(name: str) -> Any:
    module = _PUBLIC.get(name)
    if module is None:
        raise AttributeError(f"module 'graphsynth' has no attribute {name!r}")
    value = getattr(import_module(module), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted({*globals(), *_PUBLIC})
