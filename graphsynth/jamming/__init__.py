"""Bearing contact under tilt: gaps, critical tilt, jam arcs over a turn, areas, verdicts with and without proof.

Names are resolved on first use.
"""

from __future__ import annotations

from importlib import import_module
from typing import Any

_PUBLIC: dict[str, str] = {
    "Arc": "tilt_arcs",
    "ArcEnclosure": "certified_arcs",
    "Bearing": "bearing",
    "CertifiedArcs": "certified_arcs",
    "CriticalTilt": "bearing",
    "Enclosure": "certified_arcs",
    "JamArcs": "tilt_arcs",
    "JamCertificate": "certify",
    "JammingReport": "assess",
    "JammingTable": "assess",
    "Limit": "inverse",
    "Range": "ranges",
    "Span": "circle_sets",
    "ToleranceBox": "parameters",
    "Verdict": "verdict",
    "Witness": "certify",
    "assess_jamming": "assess",
    "certify_jamming": "certify",
    "jam_arcs": "tilt_arcs",
    "largest_height": "inverse",
    "largest_misalignment": "inverse",
    "smallest_clearance": "inverse",
    "spread": "ranges",
}

__all__ = [*sorted(_PUBLIC)]


def __getattr__(name: str) -> Any:
    module = _PUBLIC.get(name)
    if module is None:
        raise AttributeError(f"module 'graphsynth.jamming' has no attribute {name!r}")
    return getattr(import_module(f"graphsynth.jamming.{module}"), name)
