"""The enumerator: contracted graphs, placement of links and joints, orbits, counting, shards."""

from graphsynth.synthesis.api import (
    count_assur_groups,
    count_baranov_trusses,
    count_chains,
    count_mechanisms,
    enumerate_assur_groups,
    enumerate_baranov_trusses,
    enumerate_chains,
    enumerate_mechanisms,
    sample_mechanisms,
)

__all__ = [
    "count_assur_groups",
    "count_baranov_trusses",
    "count_chains",
    "count_mechanisms",
    "enumerate_assur_groups",
    "enumerate_baranov_trusses",
    "enumerate_chains",
    "enumerate_mechanisms",
    "sample_mechanisms",
]
