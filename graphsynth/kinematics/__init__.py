"""Kinematics: the general planar engine, the lambda linkage, the planar parallel platform, the single-motor platform.

This file loads none of them: the public functions are resolved on first use, so that each scene pays for its own only.
"""

from __future__ import annotations

from typing import Any

__all__ = ["Motion", "simulate", "simulate_batch"]


def __getattr__(name: str) -> Any:
    if name not in __all__:
        raise AttributeError(f"module 'graphsynth.kinematics' has no attribute {name!r}")
    from graphsynth.kinematics import simulation

    return getattr(simulation, name)
