"""A mechanism graph drawn by its adjacency levels: the frame on top, then the links jointed to it, and so on down."""

from __future__ import annotations

from typing import TYPE_CHECKING

from graphsynth.drawing.sketch import Sketch

if TYPE_CHECKING:
    from graphsynth.structure.graph import MechanismGraph

__all__ = ["draw_levels", "level_order"]


def level_order(graph: MechanismGraph, sweeps: int = 8) -> tuple[tuple[int, ...], ...]:
    """Order the links inside each adjacency level so that edges cross little.

    The barycentre heuristic (Sugiyama, Tagawa and Toda 1981): each level in turn is sorted by the mean position of its
    neighbours, down and up. Ties keep the order of link numbers, so the result depends on the graph alone.

    Parameters
    ----------
    graph : MechanismGraph
        With a frame.
    sweeps : int
        Passes down and up.
    """
    levels = [list(level) for level in graph.levels]
    neighbours: dict[int, list[int]] = {link: [] for link in range(graph.links)}
    for joint in graph.joints:
        neighbours[joint.a].append(joint.b)
        neighbours[joint.b].append(joint.a)
    place: dict[int, float] = {}
    for level in levels:
        _spread(level, place)
    for sweep in range(sweeps):
        for level in levels[1:] if sweep % 2 == 0 else reversed(levels[1:]):
            level.sort(
                key=lambda link: (round(sum(place[n] for n in neighbours[link]) / len(neighbours[link]), 9), link)
            )
            _spread(level, place)
    return tuple(map(tuple, levels))


def _spread(level: list[int], place: dict[int, float]) -> None:
    """Give the links of a level evenly spaced positions around 0."""
    for i, link in enumerate(level):
        place[link] = i - (len(level) - 1) / 2


def draw_levels(graph: MechanismGraph, width: float = 420.0, title: str = "") -> str:
    """Draw a graph by adjacency levels.

    The frame is the filled vertex on hatched ground; a joint of mobility 1 is a line, of mobility 2 a dashed line, of
    higher mobility a dotted one; joints inside a level are arcs.

    Parameters
    ----------
    graph : MechanismGraph
        With a frame.
    width : float
        Width in pixels; below 260 the vertices and their numbers are drawn smaller.
    title : str
        Read out by screen readers.

    Returns
    -------
    str
        One ``<svg>`` element.
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
    bottom = -row * (len(order) - 1) - (0.55 if len(order) > 1 else 0.1)
    sketch = Sketch(complex(-half, bottom), complex(half, 0.1), width, margin=2.2 * radius, title=title)
    for joint in graph.joints:
        p, q = where[joint.a], where[joint.b]
        dash = {1: "", 2: "5 4"}.get(joint.mobility, "1.5 4")
        sketch.curve(p, q, _bend(p, q), colour="b" if joint.mobility > 1 else "ink", dash=dash)
    for level in order:
        for link in level:
            sketch.node(where[link], str(link), radius, filled=link == graph.frame)
    if graph.frame is not None:
        sketch.hatch_over(where[graph.frame], radius)
    return sketch.svg()


def _bend(p: complex, q: complex) -> float:
    """How far an edge inside a level bends down to pass the vertices between its ends."""
    if p.imag != q.imag:
        return 0.0
    span = abs(q.real - p.real)
    depth = min(0.55, 0.18 * span) if span > 1.01 else 0.0
    return depth if q.real > p.real else -depth
