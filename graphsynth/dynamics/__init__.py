"""Dynamics: masses, loads, motion and reactions of any planar mechanism; friction, motors and the named systems.

Every public name is resolved on first use, so that ``import graphsynth.dynamics`` is free.
"""

from __future__ import annotations

from typing import Any

from graphsynth.lazy import resolve

_PUBLIC: dict[str, str] = {
    "Body": "model",
    "DynamicModel": "model",
    "Rack": "model",
    "Rigid": "model",
    "Spring": "elements",
    "TorsionSpring": "elements",
    "Force": "elements",
    "Torque": "elements",
    "TorqueSource": "elements",
    "JointFriction": "elements",
    "Pulse": "elements",
    "consistent_start": "start",
    "StartReport": "start",
    "simulate_dynamics": "integrate",
    "DynamicMotion": "result",
    "inverse_dynamics": "inverse",
    "InverseDynamics": "inverse",
    "Reactions": "reactions",
    "effective_inertia": "minimal",
    "dynamics_work_precision": "mechanism_accuracy",
    "DCMotor": "motors",
    "SynchronousMotor": "motors",
    "LinearCharacteristic": "motors",
    "IdealTorque": "motors",
    "IdealSpeed": "motors",
    "Train": "trains",
    "MotorDrivenPlatform": "platform_drive.model",
    "EffectiveInertia": "platform_drive.inertia",
    "resistance_effect": "platform_drive.resistance",
    "DriveRun": "platform_drive.run",
    "Braider": "braider.model",
    "Thread": "braider.model",
    "FourBar": "braider.linkage",
    "PistonMachine": "piston",
    "PistonMasses": "piston",
    "PistonFriction": "piston",
    "CompressorCycle": "piston_gas",
    "ConstantForce": "piston_gas",
    "GivenForce": "piston_gas",
    "compare_pistons": "piston_turn",
    "piston_turn": "piston_turn",
}

__all__ = sorted(_PUBLIC)


def __getattr__(name: str) -> Any:
    return resolve(__name__, _PUBLIC, name)


def __dir__() -> list[str]:
    return sorted({*globals(), *_PUBLIC})
