"""The automatic sketch: no crossings, convex plates, for every small chain and inversion."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

from graphsynth.core.errors import GraphError
from graphsynth.kinematics.dimensional import JointLayout, layout
from graphsynth.structure.graph import MechanismGraph
from graphsynth.synthesis import enumerate_chains


def cross(p: np.ndarray, q: np.ndarray, r: np.ndarray) -> float:
    return float((q[0] - p[0]) * (r[1] - p[1]) - (q[1] - p[1]) * (r[0] - p[0]))


def crossings(sketch: JointLayout) -> int:
    """Pairs of sides of different links that cross or touch away from a common joint (brute force)."""
    z, sides = sketch.positions, []
    for polygon in sketch.polygons:
        around = list(zip(polygon, polygon[1:] + polygon[:1])) if len(polygon) > 2 else [polygon]
        sides += around
    found = 0
    for (a, b), (c, d) in itertools.combinations(sides, 2):
        if {a, b} & {c, d}:
            continue
        if cross(z[a], z[b], z[c]) * cross(z[a], z[b], z[d]) <= 0 >= cross(z[c], z[d], z[a]) * cross(z[c], z[d], z[b]):
            found += 1
    return found


def check(sketch: JointLayout) -> None:
    assert sketch.planar
    assert crossings(sketch) == 0
    for polygon in sketch.polygons:
        corners = sketch.positions[list(polygon)]
        turns = [cross(corners[k - 2], corners[k - 1], corners[k]) for k in range(len(polygon))]
        if len(polygon) > 2:  # strictly convex, walked round once
            assert min(turns) > 0.0 or max(turns) < 0.0
    apart = np.hypot(*(sketch.positions[:, None] - sketch.positions[None]).transpose(2, 0, 1))
    assert apart[np.triu_indices(len(apart), 1)].min() > 0.1


@pytest.mark.parametrize("links", [4, 6, 8])
def test_chains_and_inversions_are_drawn_without_crossings(links: int) -> None:
    for chain in enumerate_chains(links):
        assert chain.is_planar
        check(layout(chain))
        for mechanism in chain.inversions():
            sketch = layout(mechanism)
            check(sketch)
            frame = sketch.outline(0)
            assert frame[:, 1].mean() < sketch.positions[:, 1].mean()  # the frame lies below


def test_polygons_hold_the_joints_of_their_links() -> None:
    for chain in enumerate_chains(8):
        sketch = layout(chain)
        for link, polygon in enumerate(sketch.polygons):
            own = {k for k, joint in enumerate(chain.joints) if link in (joint.a, joint.b)}
            assert set(polygon) == own and len(polygon) == len(own)


def test_mean_side_is_about_one() -> None:
    sketch = layout(next(iter(enumerate_chains(8))))
    sides = [
        np.hypot(*(sketch.positions[a] - sketch.positions[b]))
        for polygon in sketch.polygons
        for a, b in zip(polygon, polygon[1:] + polygon[:1])
    ]
    assert 0.5 < np.mean(sides) < 2.0


def test_a_graph_that_is_not_planar_is_drawn_too() -> None:
    found = [chain for chain in enumerate_chains(10) if not chain.is_planar]
    assert len(found) == 11
    for chain in found:
        sketch = layout(chain)
        assert not sketch.planar
        apart = np.hypot(*(sketch.positions[:, None] - sketch.positions[None]).transpose(2, 0, 1))
        assert apart[np.triu_indices(len(apart), 1)].min() > 0.05


def test_open_chain_and_single_joint() -> None:
    two = layout(MechanismGraph(2, [(0, 1)], frame=0))
    assert two.positions.shape == (1, 2)
    arm = layout(MechanismGraph(3, [(0, 1), (1, 2)], frame=0))
    assert np.hypot(*(arm.positions[0] - arm.positions[1])) > 0.1


def test_bad_graphs() -> None:
    with pytest.raises(GraphError, match="connected"):
        layout(MechanismGraph(4, [(0, 1), (2, 3)]))
    with pytest.raises(GraphError, match="joint"):
        layout(MechanismGraph(1, []))
