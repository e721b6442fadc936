"""Files of graphs and mechanisms: graph6, JSON, GraphML, DOT, CSV, edge lists, matrices; models for other engines.

Every public name is resolved on first use, so that ``import graphsynth.formats`` is free.
"""

from __future__ import annotations

from typing import Any

from graphsynth.lazy import resolve

_PUBLIC: dict[str, str] = {
    "FORMATS": "registry",
    "Format": "registry",
    "GRAPHS_MAX": "registry",
    "JOINTS_MAX": "registry",
    "format_of": "registry",
    "read": "registry",
    "read_all": "registry",
    "read_stream": "registry",
    "read_text": "registry",
    "write": "registry",
    "write_text": "registry",
    "adjacency_matrix": "matrices",
    "graph_from_adjacency": "matrices",
    "graph_from_incidence": "matrices",
    "incidence_matrix": "matrices",
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
    return resolve(__name__, _PUBLIC, name)


def __dir__() -> list[str]:
    return sorted({*globals(), *_PUBLIC})
