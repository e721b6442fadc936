"""Models for other engines, and the certificate that they mean the same: MuJoCo, exudyn.

Every public name is resolved on first use, so that ``import graphsynth.formats`` is free.
"""

from __future__ import annotations

from importlib import import_module
from typing import Any

_PUBLIC: dict[str, str] = {
    "EngineRun": "engine_run",
    "SpanningTree": "trees",
    "spanning_tree": "trees",
    "MjcfModel": "mjcf",
    "MujocoSettings": "mjcf",
    "to_mjcf": "mjcf",
    "run_mujoco": "mujoco_run",
    "ExudynSettings": "exudyn_model",
    "ExudynModel": "exudyn_model",
    "run_exudyn": "exudyn_model",
    "to_exudyn": "exudyn_model",
    "ExportCertificate": "export_certificate",
    "Trial": "export_certificate",
    "certify_export": "export_certificate",
}

__all__ = sorted(_PUBLIC)


def __getattr__(name: str) -> Any:
    module = _PUBLIC.get(name)
    if module is None:
        raise AttributeError(f"module 'graphsynth.formats' has no attribute {name!r}")
    value = getattr(import_module(f"graphsynth.formats.{module}"), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted({*globals(), *_PUBLIC})
