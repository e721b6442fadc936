"""graphsynth: from an integer equation to a proved verdict.

``import graphsynth`` loads nothing but this file: every public name is resolved on first use (PEP 562), so that a
script pays only for what it asks.
"""

from __future__ import annotations

from typing import Any

from graphsynth.lazy import resolve

__version__ = "0.1.0"

_PUBLIC: dict[str, str] = {
    "StructuralSpec": "structure.spec",
    "LinkAssortment": "structure.spec",
    "MechanismGraph": "structure.graph",
    "Joint": "structure.graph",
    "enumerate_chains": "synthesis",
    "count_chains": "synthesis",
    "enumerate_mechanisms": "synthesis",
    "count_mechanisms": "synthesis",
    "sample_mechanisms": "synthesis",
    "enumerate_assur_groups": "synthesis",
    "count_assur_groups": "synthesis",
    "enumerate_baranov_trusses": "synthesis",
    "count_baranov_trusses": "synthesis",
    "Mechanism": "mechanism.model",
    "Driver": "mechanism.model",
    "Revolute": "mechanism.joints",
    "Prismatic": "mechanism.joints",
    "PinSlot": "mechanism.joints",
    "Gear": "mechanism.joints",
    "Cam": "mechanism.joints",
    "simulate": "kinematics.simulation",
    "simulate_batch": "kinematics.simulation",
    "embody": "kinematics.embodiment.api",
    "Goals": "kinematics.embodiment.goals",
    "certify": "kinematics.certified.poses",
    "LambdaLinkage": "kinematics.lambda_linkage",
    "ParallelPlatform": "kinematics.parallel_platform",
    "SingleMotorPlatform": "kinematics.single_motor_platform",
    "PointingMechanism": "kinematics.pointing",
    "FloatingPiston": "kinematics.piston.model",
    "PistonMachine": "dynamics.piston",
    "Interval": "intervals.interval",
    "krawczyk": "intervals.proving",
    "pave": "intervals.paving",
    "Status": "intervals.status",
    "assess_jamming": "jamming.assess",
    "JammingReport": "jamming.assess",
    "Catalogue": "atlas.catalogue",
    "run": "scenes.runner",
}

__all__ = ["__version__", *sorted(_PUBLIC)]


def __getattr__(name: str) -> Any:
    return resolve(__name__, _PUBLIC, name)


def __dir__() -> list[str]:
    return sorted({*globals(), *_PUBLIC})
