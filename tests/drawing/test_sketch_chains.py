"""Sketches of every chain up to ten links, judged by exact arithmetic that shares nothing with the layout."""

from __future__ import annotations

import itertools
import math
import random
import time

import numpy as np
import pytest

from graphsynth.drawing.graphs import graph_svg
from graphsynth.kinematics.dimensional import JointLayout, layout
from graphsynth.kinematics.dimensional.crossings import crossing_pairs, fewest_crossings
from graphsynth.structure.graph import MechanismGraph
from graphsynth.synthesis import enumerate_chains

Point = tuple[int, int]


def exact(sketch: JointLayout) -> list[Point]:
    """Places as whole numbers of 2**-50: what follows is exact."""
    return [(round(x * 2**50), round(y * 2**50)) for x, y in sketch.positions.tolist()]


def turn(p: Point, q: Point, r: Point) -> int:
    area = (q[0] - p[0]) * (r[1] - p[1]) - (q[1] - p[1]) * (r[0] - p[0])
    return (area > 0) - (area < 0)


def sides(sketch: JointLayout) -> list[tuple[int, int]]:
    found = []
    for polygon in sketch.polygons:
        found += list(zip(polygon, polygon[1:] + polygon[:1])) if len(polygon) > 2 else [polygon]
    return found


def between(p: Point, q: Point, r: Point) -> bool:
    """Whether r, which is in line with p and q, lies on the side p-q."""
    return min(p[0], q[0]) <= r[0] <= max(p[0], q[0]) and min(p[1], q[1]) <= r[1] <= max(p[1], q[1])


def meet(a: Point, b: Point, c: Point, d: Point) -> bool:
    """Whether two closed sides have a point in common."""
    turns = [turn(a, b, c), turn(a, b, d), turn(c, d, a), turn(c, d, b)]
    if turns[0] * turns[1] < 0 and turns[2] * turns[3] < 0:
        return True
    ends = [(a, b, c), (a, b, d), (c, d, a), (c, d, b)]
    return any(sign == 0 and between(*three) for sign, three in zip(turns, ends))


def crossings(sketch: JointLayout) -> int:
    """Pairs of sides that have a point in common which is not their joint."""
    z, count = exact(sketch), 0
    for (a, b), (c, d) in itertools.combinations(sides(sketch), 2):
        shared = {a, b} & {c, d}
        if not shared:
            count += meet(z[a], z[b], z[c], z[d])
        elif {a, b} != {c, d}:  # from a common joint: one along the other
            (joint,) = shared
            p, q = ({a, b} - shared).pop(), ({c, d} - shared).pop()
            along = (z[p][0] - z[joint][0]) * (z[q][0] - z[joint][0])
            along += (z[p][1] - z[joint][1]) * (z[q][1] - z[joint][1])
            count += turn(z[joint], z[p], z[q]) == 0 and along > 0
    return count


def inside(corners: list[Point], point: Point) -> bool:
    turns = {turn(p, q, point) for p, q in zip(corners, corners[1:] + corners[:1])}
    return turns in ({1}, {-1})


def check(sketch: JointLayout) -> None:
    z = exact(sketch)
    for link, polygon in enumerate(sketch.polygons):
        own = {k for k, joint in enumerate(sketch.graph.joints) if link in (joint.a, joint.b)}
        assert set(polygon) == own and len(polygon) == len(own)
        if len(polygon) > 2:
            corners = [z[k] for k in polygon]
            assert len({turn(corners[k - 2], corners[k - 1], corners[k]) for k in range(len(corners))} | {0}) == 2
            assert not any(inside(corners, z[k]) for k in range(len(z)) if k not in own)  # no link within a plate
    places = sketch.positions.tolist()
    lengths = [math.dist(places[a], places[b]) for a, b in sides(sketch)]
    closest = min(math.dist(p, q) for p, q in itertools.combinations(places, 2))
    assert closest >= 0.3 * sum(lengths) / len(lengths)


@pytest.mark.long
@pytest.mark.parametrize(("links", "chains", "planar"), [(4, 1, 1), (6, 2, 2), (8, 16, 16), (10, 230, 219)])
def test_every_planar_chain_has_no_crossing_and_room(links: int, chains: int, planar: int) -> None:
    sketches = [layout(chain) for chain in enumerate_chains(links)]
    assert len(sketches) == chains
    plane = [sketch for sketch in sketches if sketch.graph.is_planar]
    assert len(plane) == planar
    for sketch in plane:
        assert sketch.planar and sketch.crossings == 0
        assert crossings(sketch) == 0
        check(sketch)
    for sketch in sketches:
        if not sketch.graph.is_planar:  # one crossing is the least that such a graph can have
            assert not sketch.planar and sketch.crossings == 1
            assert crossings(sketch) == 1
            check(sketch)


@pytest.mark.slow
def test_every_inversion_of_ten_links() -> None:
    for chain in enumerate_chains(10):
        for mechanism in chain.inversions():
            sketch = layout(mechanism)
            assert crossings(sketch) == sketch.crossings == (0 if chain.is_planar else 1)


def grown(links: int, lots: random.Random) -> MechanismGraph:
    """A planar chain grown from a four-bar by dyads."""
    joints, count = [(0, 1), (1, 2), (2, 3), (0, 3)], 4
    while count < links:
        a, b = sorted(lots.sample(range(count), 2))
        tried = MechanismGraph(count + 2, [*joints, (a, count), (count, count + 1), (b, count + 1)])
        if tried.is_planar and max(tried.degrees) < 6:
            joints, count = [(a, b) for a, b, _ in tried.joints], count + 2
    return MechanismGraph(links, joints)


@pytest.mark.parametrize("links", [14, 20, 30])
def test_large_planar_chains_are_not_crowded(links: int) -> None:
    lots, room = random.Random(links), []
    for _ in range(5):
        sketch = layout(grown(links, lots))
        assert sketch.planar and crossings(sketch) == 0
        places = sketch.positions.tolist()
        lengths = [math.dist(places[a], places[b]) for a, b in sides(sketch)]
        closest = min(math.dist(p, q) for p, q in itertools.combinations(places, 2))
        room.append(closest * len(lengths) / sum(lengths))
    assert sorted(room)[2] >= 0.3  # a few stay crowded somewhere


def test_a_large_graph_that_is_not_planar_is_drawn_in_time() -> None:
    lots, joints = random.Random(7), [(0, 1), (1, 2), (2, 3), (0, 3)]
    for count in range(4, 30, 2):
        a, b = lots.sample(range(count), 2)
        joints += [(a, count), (count, count + 1), (b, count + 1)]
    begin = time.process_time()
    sketch = layout(MechanismGraph(30, joints))
    assert sketch.crossings > 0
    assert time.process_time() - begin < 5.0


def test_the_judge_sees_crossings() -> None:
    square = layout(MechanismGraph(4, [(0, 1), (1, 2), (2, 3), (0, 3)]))
    assert crossings(square) == 0
    places = square.positions.copy()
    places[[0, 1]] = places[[1, 0]]
    assert crossings(JointLayout(square.graph, places, square.polygons, True)) == 1
    places[0] = places[1]
    assert crossings(JointLayout(square.graph, places, square.polygons, True)) > 0


def test_one_crossing_pair_leaves_a_planar_graph() -> None:
    chain = next(chain for chain in enumerate_chains(10) if not chain.is_planar)
    ((a, b),) = crossing_pairs(chain)
    assert chain.degrees[a] == chain.degrees[b] == 2
    complete = MechanismGraph(6, [(a, b) for b in range(6) for a in range(b)])  # no binary link at all
    assert crossing_pairs(complete) == []
    sketch = layout(complete)
    assert not sketch.planar and sketch.crossings > 0


@pytest.mark.long
def test_forces_count_their_own_crossings() -> None:
    """The count behind the choice agrees with the exact one on every non-planar chain."""
    for chain in enumerate_chains(10):
        if chain.is_planar:
            continue
        own = [[k for k, joint in enumerate(chain.joints) if link in (joint.a, joint.b)] for link in range(10)]
        z, counted = fewest_crossings(own, len(chain.joints))
        positions = [[p.real, p.imag] for p in z.tolist()]
        drawn = layout(chain)
        polygons = tuple(
            tuple(sorted(p, key=lambda k: math.atan2(*_from_middle(positions, p, k)))) for p in drawn.polygons
        )
        assert crossings(JointLayout(chain, np.array(positions), polygons, False)) == counted


def _from_middle(positions: list[list[float]], polygon: tuple[int, ...], k: int) -> tuple[float, float]:
    x = positions[k][0] - sum(positions[j][0] for j in polygon) / len(polygon)
    y = positions[k][1] - sum(positions[j][1] for j in polygon) / len(polygon)
    return y, x


def test_a_sketch_is_quick() -> None:
    """Well under the 20 ms of a calm computer, also on a busy one."""
    chains = [chain for k, chain in enumerate(enumerate_chains(10)) if k % 10 == 0]
    graph_svg(chains[0])
    spent = []
    for chain in chains:
        begin = time.thread_time()
        graph_svg(chain)
        spent.append(time.thread_time() - begin)
    assert sorted(spent)[len(spent) // 2] < 0.02
