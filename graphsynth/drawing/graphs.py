"""Drawings of graphs without dimensions: a diagram with joints where the automatic sketch puts them, or by levels.

By its adjacency levels the frame is on top, then come the links jointed to it, and so on down.
"""

from __future__ import annotations

import cmath
import math
from collections.abc import Mapping
from itertools import combinations
from typing import TYPE_CHECKING, Any

from graphsynth.core.errors import GraphError
from graphsynth.drawing.diagram import mechanism_sketch
from graphsynth.drawing.sketch import Sketch
from graphsynth.mechanism.joints import JointGeometry, PinSlot, Prismatic, Revolute
from graphsynth.mechanism.laws import Driver
from graphsynth.mechanism.model import Mechanism

if TYPE_CHECKING:
    from graphsynth.kinematics.dimensional.sketch import JointLayout
    from graphsynth.structure.graph import MechanismGraph
    from graphsynth.structure.multiple_joints import MultipleJointChain
    from graphsynth.structure.slider_chains import SliderChain


def graph_sketch(
    graph: MechanismGraph,
    *,
    driver: int | None = None,
    width: float = 480.0,
    height: float = 420.0,
    numbers: bool = True,
    title: str = "",
) -> tuple[Sketch, list[tuple[float, float, float]]]:
    """Build the kinematic diagram of a chain or a mechanism from its automatic sketch.

    `graph`: planar (space 3), joints of mobility 1 (drawn as revolute joints) and 2 (drawn as a pin in a slot).  With a
    frame its joints stand on the ground; without one all links are alike. `driver`: link on the frame whose joint gets
    the driver's arrow. `width`, `height`: largest size in pixels. `numbers`: write the numbers of the links. `title`:
    read out by screen readers. The diagram and the pose it is drawn in: ``sketch.svg(pose)``.  The mean distance of
    neighbouring joints is 1; dimensions are those of a readable picture, nothing is said about motion. Raises
    `GraphError`: another space, a joint of higher mobility, a graph that is not connected.
    """
    from graphsynth.kinematics.dimensional.sketch import layout

    if graph.space != 3 or any(joint.mobility > 2 for joint in graph.joints):
        raise GraphError("only planar graphs (space 3) with joints of mobility 1 and 2 have a kinematic diagram")
    places = layout(graph)
    pairs = {(a, b): k for k, (a, b, _) in enumerate(graph.joints)}
    return _sketched(
        graph, places, pairs, driver, {"width": width, "height": height, "numbers": numbers, "title": title}
    )


def multiple_joint_sketch(
    chain: MultipleJointChain, *, driver: int | None = None, **options: Any
) -> tuple[Sketch, list[tuple[float, float, float]]]:
    """Build the kinematic diagram of a chain with multiple joints, these as two circles; as `graph_sketch`."""
    from graphsynth.kinematics.dimensional.sketch import layout

    graph = chain.graph()
    places = layout(chain.incidence, chain.multiple)
    number = {pair: k for k, joint in enumerate(chain.joints) for pair in combinations(joint, 2)}
    sketch, pose = _sketched(graph, places, number, driver, options)
    for k, joint in enumerate(chain.joints):
        if len(joint) > 2:
            link = chain.frame if chain.frame in joint else joint[0]
            sketch.on(link, "joint", f"multiple joint {'-'.join(map(str, joint))}")
            sketch.multiple_joint(complex(*places.positions[k]))
    sketch.on()
    return sketch, pose


def slider_sketch(
    chain: SliderChain, *, driver: int | None = None, **options: Any
) -> tuple[Sketch, list[tuple[float, float, float]]]:
    """Build the kinematic diagram of a chain with prismatic joints, these as blocks on guides; as `graph_sketch`.

    A guide points to the middle of a link, unless another one of its two links does so: no two on a link are parallel.
    """
    from graphsynth.kinematics.dimensional.sketch import layout

    graph = chain.graph
    places = layout(graph)
    number = {(a, b): k for k, (a, b, _) in enumerate(graph.joints)}
    ways: dict[tuple[int, int], float] = {}
    for a, b in chain.sliders:
        at = complex(*places.positions[number[a, b]])
        middles = [complex(*places.outline(link).mean(axis=0)) - at for link in (a, b)]
        wanted = [cmath.phase(way) for way in middles if abs(way) > 1e-9]
        wanted += [k * math.pi / 6 for k in range(6)]
        others = [way for pair, way in ways.items() if {a, b} & set(pair)]
        apart = [min((abs(math.sin(way - other)) for other in others), default=1.0) > 0.4 for way in wanted]
        ways[a, b] = wanted[apart.index(True) if any(apart) else 0]
    return _sketched(graph, places, number, driver, options, ways)


def _sketched(
    graph: MechanismGraph,
    places: JointLayout,
    number: dict[tuple[int, int], int],
    driver: int | None,
    options: Any,
    ways: Mapping[tuple[int, int], float] | None = None,
) -> tuple[Sketch, list[tuple[float, float, float]]]:
    """Draw a graph whose joints have the places of these numbers; of prismatic joints the directions are given."""
    framed = graph if graph.frame is not None else graph.with_frame(0)
    if driver is not None and not any({driver, graph.frame} == {a, b} for a, b, _ in graph.joints):
        raise GraphError(f"driver {driver} is not jointed to the frame; choose a link that is")
    drivers = () if driver is None or graph.frame is None else (Driver(graph.frame, driver),)
    pose = [(0.0, 0.0, 0.0)] * graph.links
    joints: list[JointGeometry] = []
    for a, b, mobility in graph.joints:
        x, y = map(float, places.positions[number[a, b]])
        if ways and (a, b) in ways:
            joints.append(Prismatic(a, b, (x, y), (x, y), ways[a, b], ways[a, b]))
            continue
        if mobility == 1:
            joints.append(Revolute(a, b, (x, y), (x, y)))
            continue
        # the slot runs towards the middle of its link
        cx, cy = map(float, places.outline(a).mean(axis=0))
        way = complex(cx - x, cy - y)
        joints.append(PinSlot(a, b, (x, y), (x, y), cmath.phase(way) if abs(way) > 1e-9 else 0.0))
    mechanism = Mechanism(framed, tuple(joints), drivers, pose=tuple(pose))
    return mechanism_sketch(mechanism, pose, grounded=graph.frame is not None, **options), pose


def graph_svg(graph: MechanismGraph, *, driver: int | None = None, width: float = 480.0, title: str = "") -> str:
    """Kinematic diagram of a graph as one ``<svg>``; see :func:`graph_sketch`.

    >>> from graphsynth.structure.graph import MechanismGraph
    >>> svg = graph_svg(MechanismGraph(4, [(0, 1), (1, 2), (2, 3), (0, 3)], frame=0))
    >>> svg.count('data-part="joint'), svg.count('data-part="link')
    (4, 3)
    """
    sketch, pose = graph_sketch(graph, driver=driver, width=width, title=title)
    return sketch.svg(pose)


def level_order(graph: MechanismGraph, sweeps: int = 12) -> tuple[tuple[int, ...], ...]:
    """Order the links inside each adjacency level so that edges cross little.

    The barycentre heuristic [Sugiyama et al. 1981]: each level in turn is sorted by the mean position of its
    neighbours, down and up, and the order with the fewest crossings of all passes is kept. Ties go to link numbers, so
    the result depends on the graph alone.

    `graph`: with a frame. `sweeps`: passes down and up.
    """
    levels = [list(level) for level in graph.levels]
    edges = [(joint.a, joint.b) for joint in graph.joints]
    neighbours: dict[int, list[int]] = {link: [] for link in range(graph.links)}
    for a, b in edges:
        neighbours[a].append(b)
        neighbours[b].append(a)
    place: dict[int, float] = {}
    for level in levels:
        _spread(level, place)
    best, fewest = tuple(map(tuple, levels)), _tangle(edges, graph, place)
    for sweep in range(sweeps):
        for level in levels[1:] if sweep % 2 == 0 else reversed(levels[1:]):
            # by the mean position of each link's neighbours, its own level included
            mean = {link: round(sum(place[n] for n in neighbours[link]) / len(neighbours[link]), 9) for link in level}
            level.sort()
            level.sort(key=mean.__getitem__)
            _spread(level, place)
        tangle = _tangle(edges, graph, place)
        if tangle < fewest:
            best, fewest = tuple(map(tuple, levels)), tangle
    return best


def _spread(level: list[int], place: dict[int, float]) -> None:
    """Give the links of a level evenly spaced positions around 0."""
    for i, link in enumerate(level):
        place[link] = i - (len(level) - 1) / 2


def _tangle(edges: list[tuple[int, int]], graph: MechanismGraph, place: dict[int, float]) -> float:
    """Count crossings of edges between levels; an edge inside a level costs half of each link it passes over."""
    depth = {link: k for k, level in enumerate(graph.levels) for link in level}
    between: dict[int, list[tuple[float, float]]] = {}
    cost = 0.0
    for a, b in edges:
        if depth[a] == depth[b]:
            cost += 0.5 * (abs(place[a] - place[b]) - 1)
        else:
            upper, lower = sorted((a, b), key=depth.__getitem__)
            between.setdefault(depth[upper], []).append((place[upper], place[lower]))
    for pairs in between.values():
        pairs.sort()
        cost += sum(
            low > later for i, (up, low) in enumerate(pairs) for next_up, later in pairs[i + 1 :] if next_up > up
        )
    return cost


def draw_levels(graph: MechanismGraph, width: float = 420.0, title: str = "") -> str:
    """Draw a graph by adjacency levels, as one ``<svg>`` element; see :func:`levels_sketch`."""
    return levels_sketch(graph, width, title).svg()


def levels_sketch(graph: MechanismGraph, width: float = 420.0, title: str = "") -> Sketch:
    """Build the drawing of a graph by adjacency levels.

    The frame is the filled vertex on hatched ground; a joint of mobility 1 is a line, of mobility 2 a dashed line, of
    higher mobility a dotted one; joints inside a level are arcs.

    `graph`: with a frame. `width`: width in pixels; below 260 the vertices and their numbers are drawn smaller.
    `title`: read out by screen readers.
    """
    order = level_order(graph)
    widest = max(map(len, order))
    row = 1.5 if widest > 4 else 1.2
    where = {
        link: complex((i - (len(level) - 1) / 2) * (widest / len(level)) ** 0.5, -row * depth)
        for depth, level in enumerate(order)
        for i, link in enumerate(level)
    }
    half = max(1.2, *(abs(p.real) for p in where.values())) + 0.1
    radius = 10.0 if width >= 260 else 6.5
    width = min(width, 2 * half * 7 * radius + 4.4 * radius)  # a small graph does not need the whole width
    arcs_below = any(joint.a in order[-1] and joint.b in order[-1] for joint in graph.joints)
    bottom = -row * (len(order) - 1) - (0.6 if arcs_below else 0.1)
    sketch = Sketch(complex(-half, bottom), complex(half, 0.1), width, margin=2.2 * radius, title=title)
    for joint in graph.joints:
        p, q = where[joint.a], where[joint.b]
        dash = {1: (), 2: (5.0, 4.0)}.get(joint.mobility, (1.5, 4.0))
        span = q.real - p.real
        bend = 0.0
        if p.imag == q.imag and abs(span) > 1.01:  # down, to pass the vertices between its ends
            bend = math.copysign(min(0.55, 0.18 * abs(span)), span)
        sketch.curve(p, q, bend, colour="b" if joint.mobility > 1 else "ink", dash=dash)
    for level in order:
        for link in level:
            sketch.node(where[link], str(link), radius, filled=link == graph.frame)
    if graph.frame is not None:
        middle = where[graph.frame] + 1j * sketch.pixel * (radius + 3)
        half = radius * 1.3 * sketch.pixel
        sketch.hatch(middle + half, middle - half, 1j * sketch.pixel * sketch.symbol)
    return sketch
