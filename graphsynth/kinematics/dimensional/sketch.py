"""The automatic sketch: where to draw the joints of a mechanism graph that has no dimensions yet.

The barycentric drawing of Tutte (1963) of the plane graph of joints, with a hub in every loop but the outer one, evened
out by forces; no step may turn a face over.  How and why: docs/explanation/sketching.md.  A graph that is not planar is
drawn as in :mod:`graphsynth.kinematics.dimensional.crossings`; one with a cut link by forces.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from graphsynth.core.errors import GraphError
from graphsynth.kinematics.dimensional.crossings import crossing_pairs, fewest_crossings, merged
from graphsynth.structure.graph import MechanismGraph

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]
Polygons = tuple[tuple[int, ...], ...]
IntArray = NDArray[np.intp]

#: Steps of forces: for the comparison of outer faces, and for the picture.
_ROUGH, _STEPS = 15, 60
#: Further rounds of steps while two joints are closer than this, in mean sides.
_ROUNDS, _CLOSE = 30, 0.3
#: Outer faces compared, the longest first.
_OUTER = 4
#: Springs of polygons over those of bars: plates are to be nearly regular.
_STIFF = 3.0
#: What the kernel takes, lengths in mean sides: distance of two joints below which a further force acts; distance of
#: joints from sides they are not on below which a force acts, and its strength; strength of the force that keeps
#: triangles from becoming flat; height of a plate's corner over the line of its neighbours below which it is pushed
#: out; share of the area of a triangle that a step must leave; trials of a step, with offending vertices moved less.
_STRENGTHS = (0.6, 0.5, 5.0, 0.05, 0.6, 0.4, 4.0)


@dataclass(frozen=True, eq=False)
class JointLayout:
    """Places of the joints in a sketch.

    Parameters
    ----------
    graph : MechanismGraph
    positions : ndarray, shape (joints, 2)
        In the order of ``graph.joints`` (joints on multiple joints left out), then the multiple joints; the mean
        distance between neighbours on a link is 1.
    polygons : tuple of tuple of int
        For each link its joints (indices into ``positions``) in the order of its outline.
    planar : bool
        Whether the drawing was made without crossings.
    crossings : int
        Crossings of sides of links, 0 if planar.
    """

    graph: MechanismGraph
    positions: Array
    polygons: tuple[tuple[int, ...], ...]
    planar: bool
    crossings: int = 0

    def outline(self, link: int) -> Array:
        """Corners of a link, shape (its joints, 2)."""
        return np.asarray(self.positions[list(self.polygons[link])])


def layout(graph: MechanismGraph, multiple: int = 0) -> JointLayout:
    """Sketch a chain or a mechanism: places of its joints.

    Parameters
    ----------
    graph : MechanismGraph
        Connected; joint mobilities do not matter.  A frame is drawn at the bottom.
    multiple : int
        So many of its last vertices are not links but multiple joints, single points.

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
    at = _places(graph, multiple)
    found = _embedding(graph, at, multiple)
    if found is None:
        return _with_crossings(graph, at, multiple)
    loops, polygons = found
    if len(loops) > 2:
        return JointLayout(graph, _best_outer(_at_frame(graph, at), loops, polygons), polygons, True)
    count, z = len(loops[0]), np.zeros(max(at) + 1, dtype=np.complex128)  # a regular polygon of sides 1
    z[loops[0]] = np.exp(1j * math.tau * np.arange(count) / count) / (2.0 * math.sin(math.pi / count))
    return JointLayout(graph, _upright(_at_frame(graph, at), z, loops[0]), polygons, True)


def _places(graph: MechanismGraph, multiple: int) -> list[int]:
    """Return which place each joint takes: one of its own, or that of its multiple joint."""
    links = graph.links - multiple
    simple = sum(joint.b < links for joint in graph.joints)
    own = iter(range(simple))
    return [next(own) if joint.b < links else simple + joint.b - links for joint in graph.joints]


def _at_frame(graph: MechanismGraph, at: list[int]) -> set[int]:
    """Return the places of the joints of the frame; empty without one."""
    return {at[k] for k, joint in enumerate(graph.joints) if graph.frame in (joint.a, joint.b)}


# --- planar embedding


def _embedding(graph: MechanismGraph, at: list[int], multiple: int) -> tuple[list[list[int]], Polygons] | None:
    """Loops as cycles of joints and outlines of the links; None if the graph has no such embedding."""
    import networkx as nx

    if min(graph.degrees) < 2 or graph.cut_links or graph.cut_joints:
        return None
    plain = nx.Graph([(a, b) for a, b, _ in graph.joints])
    planar, embedding = nx.check_planarity(plain)
    if not planar:
        return None
    index = {pair: k for k, joint in zip(at, graph.joints) for pair in ((joint.a, joint.b), (joint.b, joint.a))}
    links = range(graph.links - multiple)
    outlines = tuple(tuple(index[link, other] for other in embedding.neighbors_cw_order(link)) for link in links)
    seen: set[tuple[int, int]] = set()
    found = []  # the faces in a fixed order
    for edge in sorted(index):
        if edge not in seen:
            around = embedding.traverse_face(*edge, mark_half_edges=seen)
            joints = [index[pair] for pair in zip(around, [*around[1:], around[0]])]
            found.append([k for k, before in zip(joints, [joints[-1], *joints]) if k != before])
    return found, outlines


def _best_outer(own: set[int], loops: list[list[int]], polygons: Polygons) -> Array:
    """Draw with the outer face that gives the roomiest picture; with the frame outside if there is one."""
    allowed = [k for k, loop in enumerate(loops) if not own or len(own & set(loop)) >= 2]
    longest = max(len(loops[k]) for k in allowed)
    near = sorted((k for k in allowed if len(loops[k]) >= longest - 1), key=lambda k: -len(loops[k]))
    drawings = [_Drawing(loops, k, polygons) for k in near[:_OUTER]]
    for drawing in drawings:
        drawing.even_out(_ROUGH)
    rooms = [drawing.room() for drawing in drawings]
    # the first of equals: rounding must not choose among faces that symmetry makes alike
    best = next(drawing for drawing, room in zip(drawings, rooms) if room >= (1.0 - 1e-6) * max(rooms))
    best.even_out(_STEPS)
    for _ in range(_ROUNDS):  # large graphs begin crowded
        z = best.z[: best.joints]
        closest = np.abs(z[:, None] - z)[np.triu_indices(len(z), 1)].min()
        if closest / best.mean_side() >= _CLOSE:
            break
        best.even_out(_STEPS, crowded=True)
    return _upright(own, best.z[: best.joints], best.outer)


class _Drawing:
    """A drawing under way: joints, then the hubs of the inner loops, as complex numbers."""

    def __init__(self, loops: list[list[int]], outer: int, polygons: Polygons) -> None:
        count, self.outer = 1 + max(map(max, polygons)), loops[outer]
        inner = loops[:outer] + loops[outer + 1 :]
        sides = _sides(polygons)
        spokes = [(count + hub, joint) for hub, loop in enumerate(inner) for joint in loop]
        triangles = [(count + h, a, b) for h, loop in enumerate(inner) for a, b in zip(loop, [*loop[1:], loop[0]])]
        plates = [corner for p in polygons if len(p) > 2 for corner in _corners(p)]
        self.triangles = np.array(triangles + plates + _corners(self.outer), dtype=np.intp)
        stiff = {pair for p in polygons if len(p) > 2 for pair in _sides((p,))}
        self.sides = np.array(sides, dtype=np.intp)
        self.stiffness = np.array([_STIFF if side in stiff else 1.0 for side in sides])
        # barycentric: outer face on a regular polygon, every other vertex at the mean of its neighbours
        size, edges, rim = count + len(inner), np.array(sides + spokes), np.arange(len(self.outer)) / len(self.outer)
        A = np.zeros((size, size))
        np.add.at(A, (edges[:, 0], edges[:, 1]), 1.0)
        A = np.minimum(A + A.T, 1.0)
        z: Complex = np.zeros(size, dtype=np.complex128)
        z[self.outer] = np.exp(1j * math.tau * rim)
        free = np.setdiff1d(np.arange(size), self.outer)
        if free.size:
            L = np.diag(A.sum(axis=1)) - A
            z[free] = np.linalg.solve(L[free][:, free], -L[free][:, self.outer] @ z[self.outer])
        self.z = z
        self.z = self.z / self.mean_side()
        self.sense = np.sign(_areas(self.z, self.triangles))
        self.joints = count
        self.corners = np.array(plates, dtype=np.intp).reshape(-1, 3)
        self.turned = np.sign(_areas(self.z, self.corners))

    def mean_side(self) -> float:
        """Mean length of the sides of links."""
        return float(np.abs(self.z[self.sides[:, 1]] - self.z[self.sides[:, 0]]).mean())

    def even_out(self, steps: int, crowded: bool = False) -> None:
        """Let springs, repulsion and the room of the faces act; no face turns over.

        A step keeps a share of the area of every triangle, so it never gets stuck at a face that is small already.
        """
        from graphsynth.core.compilation import named

        x, y = self.z.real.copy(), self.z.imag.copy()
        (even_out,) = named("graphsynth.kinematics.dimensional.kernels", "even_out")
        given = self.joints, self.sides, self.stiffness, self.triangles, self.sense, self.corners, self.turned
        even_out(x, y, *given, steps, crowded, _STRENGTHS)
        self.z = x + 1j * y

    def room(self) -> float:
        """Smallest distance of two joints, or height of a plate, over the size of the picture."""
        z = self.z[: self.joints]
        apart = np.abs(z[:, None] - z)
        least = apart[np.triu_indices(len(z), 1)].min()
        longest = apart[self.corners, np.roll(self.corners, 1, axis=1)].max(axis=1, initial=1e-300)
        heights = np.abs(_areas(z, self.corners)) / longest
        # joints keep away from the sides they are not on
        of_side, k = np.divmod(np.arange(self.joints * len(self.sides)), self.joints)
        foreign = (k != self.sides[of_side, 0]) & (k != self.sides[of_side, 1])
        start, end = z[self.sides[of_side[foreign]]].T
        side, way = end - start, z[k[foreign]] - start
        share = (way.real * side.real + way.imag * side.imag) / np.maximum(side.real**2 + side.imag**2, 1e-12)
        bars = np.abs(way - np.minimum(np.maximum(share, 0.0), 1.0) * side).min(initial=np.inf)
        return float(min(least, heights.min(initial=np.inf), 2.0 * bars) / apart.max())


def _sides(polygons: Polygons) -> list[tuple[int, int]]:
    """Neighbouring joints on the outline of every link, each pair once."""
    pairs = [pair for p in polygons if len(p) > 1 for pair in zip(p, (*p[1:], p[0]))]
    return sorted({(min(pair), max(pair)) for pair in pairs})


def _corners(around: Any) -> list[tuple[int, int, int]]:
    return [(around[k - 2], around[k - 1], around[k]) for k in range(len(around))]


def _areas(z: Complex, triangles: IntArray) -> Array:
    """Twice the signed areas of triangles."""
    p, q, r = z[triangles[:, 0]], z[triangles[:, 1]], z[triangles[:, 2]]
    return np.asarray((np.conj(q - p) * (r - p)).imag)


def _upright(own: set[int], z: Complex, outer: list[int]) -> Array:
    """Turn the frame, with its own joints, to the bottom, a side of it on the outer face horizontal; centre at 0."""
    z = z - z.mean()
    pairs = [(p, q) for p, q in zip(outer, [*outer[1:], *outer[:1]]) if p in own and q in own]
    if pairs:
        direction = z[pairs[0][1]] - z[pairs[0][0]]
        z = z * np.conj(direction) / abs(direction)
        if (z[pairs[0][0]].imag + z[pairs[0][1]].imag) > 0.0:
            z = -z
    elif own:
        middle = z[sorted(own)].mean()
        if abs(middle) > 1e-9:
            z = z * (-1j * np.conj(middle) / abs(middle))
    return np.column_stack([z.real, z.imag])


# --- without a plane embedding


def _with_crossings(graph: MechanismGraph, at: list[int], multiple: int) -> JointLayout:
    """Let binary links cross as diagonals of a quadrilateral; where that is not enough, by forces.

    These are springs between all joints of a link and repulsion, the best of many starts.
    """
    links = range(graph.links - multiple)
    own = [[k for k, joint in zip(at, graph.joints) if link in (joint.a, joint.b)] for link in links]
    if not multiple and not graph.is_planar and (pairs := crossing_pairs(graph)):
        number = merged(graph, pairs)
        pairs_of = [(number[a], number[b]) for a, b, _ in graph.joints]
        frame = None if graph.frame is None else number[graph.frame]
        simple = MechanismGraph(max(number) + 1, pairs_of, frame=frame)
        if _embedding(simple, _places(simple, 0), 0) is not None:
            drawn = layout(simple)
            index = {(a, b): k for k, (a, b, _) in enumerate(simple.joints)}
            places = drawn.positions[[index[min(pair), max(pair)] for pair in pairs_of]]
            polygons = tuple(_around(places, joints) for joints in own)
            return JointLayout(graph, places, polygons, False, len(pairs))
    if max(map(len, own)) < 2:
        return JointLayout(graph, np.zeros((max(at) + 1, 2)), tuple(map(tuple, own)), True)
    z, crossings = fewest_crossings(own, max(at) + 1)
    places = _upright(_at_frame(graph, at), z, [])
    return JointLayout(graph, places, tuple(_around(places, joints) for joints in own), False, crossings)


def _around(places: Array, joints: list[int]) -> tuple[int, ...]:
    """Joints of a link in the order of their direction from the middle."""
    d = places[joints] - places[joints].mean(axis=0)
    return tuple(joints[k] for k in np.argsort(np.arctan2(d[:, 1], d[:, 0]), kind="stable"))
