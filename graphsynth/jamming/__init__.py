"""Bearing contact under tilt: gaps, critical tilt, jam arcs over a turn, areas, verdicts."""

from __future__ import annotations

from graphsynth.jamming.assess import JammingReport, JammingTable, assess_jamming
from graphsynth.jamming.bearing import Bearing, CriticalTilt
from graphsynth.jamming.inverse import Limit, largest_height, largest_misalignment, smallest_clearance
from graphsynth.jamming.tilt_arcs import Arc, JamArcs, jam_arcs
from graphsynth.jamming.verdict import Verdict

__all__ = [
    "Arc",
    "Bearing",
    "CriticalTilt",
    "JamArcs",
    "JammingReport",
    "JammingTable",
    "Limit",
    "Verdict",
    "assess_jamming",
    "jam_arcs",
    "largest_height",
    "largest_misalignment",
    "smallest_clearance",
]
