"""Bearing contact under tilt: gaps, critical tilt, jam arcs over a turn, areas, verdicts with and without proof.

Names are resolved on first use.
"""

from __future__ import annotations

from typing import Any

from graphsynth.lazy import resolve

_PUBLIC: dict[str, str] = {
    "Arc": "tilt_arcs",
    "ArcEnclosure": "certified_arcs",
    "Bearing": "bearing",
    "CertifiedArcs": "certified_arcs",
    "CertifiedLimit": "certified_limits",
    "CriticalTilt": "bearing",
    "ErrorRow": "error_against_time",
    "Enclosure": "certified_arcs",
    "Fit": "fits",
    "FitVerdict": "fits",
    "InsertionDiagram": "friction",
    "JamArcs": "tilt_arcs",
    "JamCertificate": "certificate",
    "JammingReport": "assess",
    "JammingTable": "table",
    "Limit": "inverse",
    "Range": "ranges",
    "Region": "friction",
    "STANDARD_FITS": "fits",
    "Samples": "sampling",
    "Span": "circle_sets",
    "Supremum": "branch_and_bound",
    "ToleranceBox": "parameters",
    "TurnPartition": "sweep",
    "Verdict": "verdict",
    "Wedging": "friction",
    "WedgingReport": "friction",
    "Witness": "certificate",
    "arc_errors": "error_against_time",
    "area_errors": "error_against_time",
    "assess_fits": "fits",
    "assess_jamming": "assess",
    "certified_largest_height": "certified_limits",
    "certified_largest_misalignment": "certified_limits",
    "certified_smallest_clearance": "certified_limits",
    "certify_jamming": "certify",
    "crossing_errors": "error_against_time",
    "error_table": "error_against_time",
    "insertion_diagram": "friction",
    "jam_arcs": "tilt_arcs",
    "largest_gap": "branch_and_bound",
    "largest_height": "inverse",
    "largest_misalignment": "inverse",
    "maximise": "branch_and_bound",
    "sample_gaps": "sampling",
    "smallest_clearance": "inverse",
    "spread": "ranges",
    "sweep_linkage": "sweep",
    "sweep_turn": "sweep",
    "tightest_free_fit": "fits",
    "wedging": "friction",
}

__all__ = [*sorted(_PUBLIC)]


def __getattr__(name: str) -> Any:
    return resolve(__name__, _PUBLIC, name)
