"""The automatic sketch: where to draw the joints of a mechanism graph that has no dimensions yet.

The joints become the vertices of a plane graph: a link with two joints is an edge, a link with more is a polygon.  When
the mechanism graph is planar, its loops and its link polygons are the faces.  One loop is the outer face, a regular
polygon; a hub is put into every other loop and joined to its joints.  The graph so made is 3-connected, so the
barycentric drawing of Tutte (1963, "How to draw a graph", Proc. London Math. Soc. 13, 743-767) has no crossings and
every link polygon is strictly convex.  Forces then even out the distances; no step may turn a face over.

A graph that is not planar (11 of the 230 ten-link chains) or has a cut link is drawn by forces alone.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from graphsynth.errors import GraphError

if TYPE_CHECKING:
    from graphsynth.structure.graph import MechanismGraph

__all__ = ["JointLayout", "layout"]

Array = NDArray[np.float64]
IntArray = NDArray[np.intp]

_STEPS = 60
#: Springs of polygons over those of bars: plates are to be nearly regular.
_STIFF = 3.0
#: Trials of a step, each with the offending vertices moved less.
_RETRIES = 4
#: Least area of a triangle of the drawing, as a share of the square of the mean side.
_FLAT = 0.04


@dataclass(frozen=True, eq=False)
class JointLayout:
    """Places of the joints in a sketch.

    Parameters
    ----------
    graph : MechanismGraph
    positions : ndarray, shape (joints, 2)
        In the order of ``graph.joints``; the mean distance between neighbours on a link is 1.
    polygons : tuple of tuple of int
        For each link its joints (indices into ``graph.joints``) in the order of its outline.
    planar : bool
        Whether the drawing is without crossings.
    """

    graph: MechanismGraph
    positions: Array
    polygons: tuple[tuple[int, ...], ...]
    planar: bool

    def outline(self, link: int) -> Array:
        """Corners of a link, shape (its joints, 2)."""
        return np.asarray(self.positions[list(self.polygons[link])])


def layout(graph: MechanismGraph) -> JointLayout:
    """Sketch a chain or a mechanism: places of its joints.

    Parameters
    ----------
    graph : MechanismGraph
        Connected; joint mobilities do not matter.  A frame is drawn at the bottom.

    Returns
    -------
    JointLayout
        Deterministic; where the graph is planar without cut links, free of crossings with convex links (exact
        embedding, estimated places).

    Raises
    ------
    GraphError
        If the graph is not connected or has no joint.

    Examples
    --------
    >>> from graphsynth.structure.graph import MechanismGraph
    >>> square = layout(MechanismGraph(4, [(0, 1), (1, 2), (2, 3), (0, 3)], frame=0))
    >>> square.planar, square.polygons[0]
    (True, (0, 1))
    """
    if not graph.joints or not graph.is_connected:
        raise GraphError("a sketch needs a connected graph with at least one joint")
    best: tuple[tuple[float, float], JointLayout] | None = None
    for faces, polygons in _embeddings(graph):
        if len(faces) > 2:
            best = _best_outer(graph, faces, polygons)
        else:
            places = _circle(graph, faces[0])
            best = ((1.0, 1.0), JointLayout(graph, places, polygons, True))
    return _by_forces(graph) if best is None else best[1]


# --- planar embedding


def _embeddings(graph: MechanismGraph) -> list[tuple[list[list[int]], tuple[tuple[int, ...], ...]]]:
    """Loops as cycles of joints and outlines of the links; nothing if the graph has no such embedding."""
    import networkx as nx

    if min(graph.degrees) < 2 or graph.cut_links or graph.cut_joints:
        return []
    plain = nx.Graph([(a, b) for a, b, _ in graph.joints])
    planar, embedding = nx.check_planarity(plain)
    if not planar:
        return []
    index = {pair: k for k, joint in enumerate(graph.joints) for pair in ((joint.a, joint.b), (joint.b, joint.a))}
    outlines = tuple(
        tuple(index[link, other] for other in embedding.neighbors_cw_order(link)) for link in range(graph.links)
    )
    return [(_loops(embedding, index), outlines)]


def _loops(embedding: Any, index: dict[tuple[int, int], int]) -> list[list[int]]:
    """Faces of the embedding as cycles of joints, in a fixed order."""
    seen: set[tuple[int, int]] = set()
    found = []
    for edge in sorted(index):
        if edge not in seen:
            around = embedding.traverse_face(*edge, mark_half_edges=seen)
            found.append([index[pair] for pair in zip(around, [*around[1:], around[0]])])
    return found


def _best_outer(
    graph: MechanismGraph, loops: list[list[int]], polygons: tuple[tuple[int, ...], ...]
) -> tuple[tuple[float, float], JointLayout]:
    """Draw with the outer face that gives the roomiest picture; with the frame outside if there is one."""
    frame_joints = {k for k, joint in enumerate(graph.joints) if graph.frame in (joint.a, joint.b)}
    best: tuple[tuple[float, float], JointLayout] | None = None
    longest = max(len(loop) for loop in loops)
    for k, outer in enumerate(loops):
        shared = len(frame_joints & set(outer))
        if (graph.frame is not None and shared < 2) or len(outer) < longest - 1:
            continue
        places = _draw(graph, outer, loops[:k] + loops[k + 1 :], polygons)
        room = (_room(places, polygons), -float(k))
        if best is None or room > best[0]:
            best = room, JointLayout(graph, places, polygons, True)
    if best is None:  # the frame is on short loops only
        outer = max((loop for loop in loops if len(frame_joints & set(loop)) >= 2), key=len)
        others = [loop for loop in loops if loop is not outer]
        best = (0.0, 0.0), JointLayout(graph, _draw(graph, outer, others, polygons), polygons, True)
    return best


def _room(places: Array, polygons: tuple[tuple[int, ...], ...]) -> float:
    """Smallest distance of two joints, or height of a plate, over the size of the picture."""
    apart = np.hypot(*(places[:, None] - places[None]).transpose(2, 0, 1))
    least = apart[np.triu_indices(len(places), 1)].min()
    corners = np.array([c for p in polygons if len(p) > 2 for c in _corners(p)], dtype=np.intp).reshape(-1, 3)
    longest = apart[corners, np.roll(corners, 1, axis=1)].max(axis=1)
    heights = np.abs(_areas(places, corners)) / longest
    return float(min(least, heights.min(initial=np.inf)) / apart.max())


def _draw(
    graph: MechanismGraph, outer: list[int], inner: list[list[int]], polygons: tuple[tuple[int, ...], ...]
) -> Array:
    count = len(graph.joints)
    sides = _sides(polygons)
    spokes = [(count + hub, joint) for hub, loop in enumerate(inner) for joint in loop]
    places = _tutte(count + len(inner), np.array(sides + spokes), outer)
    triangles = [(count + h, a, b) for h, loop in enumerate(inner) for a, b in zip(loop, [*loop[1:], loop[0]])]
    corners = [c for around in (outer, *(p for p in polygons if len(p) > 2)) for c in _corners(around)]
    stiff = {pair for p in polygons if len(p) > 2 for pair in _sides((p,))}
    stiffness = np.array([_STIFF if side in stiff else 1.0 for side in sides])
    places = _even_out(places, (np.array(sides), stiffness), count, np.array(triangles + corners))
    return _upright(graph, places[:count], outer)


def _sides(polygons: tuple[tuple[int, ...], ...]) -> list[tuple[int, int]]:
    """Neighbouring joints on the outline of every link, each pair once."""
    pairs = [pair for p in polygons if len(p) > 1 for pair in zip(p, (*p[1:], p[0]))]
    return sorted({(min(pair), max(pair)) for pair in pairs})


def _corners(around: Any) -> list[tuple[int, int, int]]:
    return [(around[k - 2], around[k - 1], around[k]) for k in range(len(around))]


def _tutte(count: int, edges: IntArray, outer: list[int]) -> Array:
    """Barycentric drawing: outer face on a regular polygon, every other vertex at the mean of its neighbours."""
    A = np.zeros((count, count))
    np.add.at(A, (edges[:, 0], edges[:, 1]), 1.0)
    A = np.minimum(A + A.T, 1.0)
    places = np.zeros((count, 2))
    angle = math.tau * np.arange(len(outer)) / len(outer)
    places[outer] = np.column_stack([np.cos(angle), np.sin(angle)])
    free = np.setdiff1d(np.arange(count), outer)
    if free.size:
        L = np.diag(A.sum(axis=1)) - A
        places[free] = np.linalg.solve(L[free][:, free], -L[free][:, outer] @ places[outer])
    return places


def _areas(places: Array, triangles: IntArray) -> Array:
    p, q, r = (places[triangles[:, k]] for k in range(3))
    return np.asarray((q[:, 0] - p[:, 0]) * (r[:, 1] - p[:, 1]) - (q[:, 1] - p[:, 1]) * (r[:, 0] - p[:, 0]))


def _even_out(places: Array, springs: tuple[IntArray, Array], joints: int, triangles: IntArray) -> Array:
    """Springs along the sides, repulsion between all joints; faces keep their orientation."""
    sides, _ = springs
    mean = float(np.hypot(*(places[sides[:, 0]] - places[sides[:, 1]]).T).mean())
    places = places / mean
    sense = np.sign(_areas(places, triangles))
    floor = np.minimum(np.abs(_areas(places, triangles)), _FLAT)
    step = 0.15
    for _ in range(_STEPS):
        move = _force(places, springs, joints)
        size = float(np.hypot(*move.T).max())
        move *= min(step, 0.2 / max(size, 1e-9))
        for _ in range(_RETRIES):
            bad = _areas(places + move, triangles) * sense < floor
            if not bad.any():
                places, step = places + move, min(0.3, step * 1.2)
                break
            move[np.unique(triangles[bad])] *= 0.3
        else:
            step *= 0.5
        if step < 1e-3:
            break
    return places


def _force(places: Array, springs: tuple[IntArray, Array], joints: int) -> Array:
    sides, stiffness = springs
    gap = places[:, None] - places[None]
    square = (gap**2).sum(axis=2) + np.eye(len(places))
    weight = 0.35 / square**2
    weight[joints:] *= 0.2
    weight[:, joints:] *= 0.2
    move = (gap * weight[:, :, None]).sum(axis=1)
    d = places[sides[:, 1]] - places[sides[:, 0]]
    length = np.hypot(*d.T)
    pull = d * (stiffness * (1.0 - 1.0 / np.maximum(length, 1e-9)))[:, None]
    np.add.at(move, sides[:, 0], pull)
    np.add.at(move, sides[:, 1], -pull)
    return np.asarray(move)


def _upright(graph: MechanismGraph, places: Array, outer: list[int]) -> Array:
    """Turn the frame to the bottom, a side of it on the outer face horizontal; mean side 1, centre at the origin."""
    places = places - places.mean(axis=0)
    own = [k for k, joint in enumerate(graph.joints) if graph.frame in (joint.a, joint.b)]
    z = places[:, 0] + 1j * places[:, 1]
    pairs = [(p, q) for p, q in zip(outer, [*outer[1:], *outer[:1]]) if p in own and q in own]
    if pairs:
        direction = z[pairs[0][1]] - z[pairs[0][0]]
        z = z * np.conj(direction) / abs(direction)
        if (z[pairs[0][0]].imag + z[pairs[0][1]].imag) > 0.0:
            z = -z
    elif own:
        middle = z[own].mean()
        if abs(middle) > 1e-9:
            z = z * (-1j * np.conj(middle) / abs(middle))
    return np.column_stack([z.real, z.imag])


# --- without a plane embedding


def _circle(graph: MechanismGraph, loop: list[int]) -> Array:
    """Draw a single loop: a regular polygon of sides 1."""
    count = len(graph.joints)
    angle = math.tau * np.arange(len(loop)) / len(loop)
    places = np.zeros((count, 2))
    places[loop] = np.column_stack([np.cos(angle), np.sin(angle)]) / (2.0 * math.sin(math.pi / len(loop)))
    return _upright(graph, places, loop)


def _by_forces(graph: MechanismGraph) -> JointLayout:
    """Spectral start, then springs between all joints of a link and repulsion."""
    count = len(graph.joints)
    own = [[k for k, joint in enumerate(graph.joints) if link in (joint.a, joint.b)] for link in range(graph.links)]
    sides = sorted({(p, q) for joints in own for p in joints for q in joints if p < q})
    if not sides:
        return JointLayout(graph, np.zeros((count, 2)), tuple(map(tuple, own)), True)
    pairs = np.array(sides)
    A = np.zeros((count, count))
    A[pairs[:, 0], pairs[:, 1]] = A[pairs[:, 1], pairs[:, 0]] = 1.0
    _, vectors = np.linalg.eigh(np.diag(A.sum(axis=1)) - A)
    places = np.zeros((count, 2))
    width = min(2, count - 1)
    places[:, :width] = vectors[:, 1 : 1 + width] * math.sqrt(count)
    # symmetric graphs leave joints in one place: part them by a fixed small shift
    places += 0.1 * np.column_stack([np.cos(2.4 * np.arange(count)), np.sin(2.4 * np.arange(count))])
    for k in range(4 * _STEPS):
        move = _force(places, (pairs, np.ones(len(pairs))), count)
        size = float(np.hypot(*move.T).max())
        places = places + move * min(0.15, 0.2 * (1.0 - k / (4 * _STEPS)) / max(size, 1e-9))
    places = _upright(graph, places, [])
    polygons = tuple(_around(places, joints) for joints in own)
    return JointLayout(graph, places, polygons, False)


def _around(places: Array, joints: list[int]) -> tuple[int, ...]:
    """Joints of a link in the order of their direction from the middle."""
    d = places[joints] - places[joints].mean(axis=0)
    return tuple(joints[k] for k in np.argsort(np.arctan2(d[:, 1], d[:, 0]), kind="stable"))
