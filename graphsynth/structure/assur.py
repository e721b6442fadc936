"""Assur groups: decomposition of a mechanism, and the tests for Assur groups and Baranov trusses.

A driver takes one freedom from its joint; a driven joint of mobility 1 makes one body of its two links.  With the
bodies so formed, a *group* is a smallest set S of bodies not yet placed with Pi |S| constraints in the joints
between S and what is placed or inside S: placing what it hangs on places it, and no part of it alone.

Assign every constraint to one of its two bodies so that each moving body gets exactly Pi of them.  Let a body depend on
the other ends of its constraints.  A set that depends on nothing outside itself and what is placed is a zero-mobility
set, and the reverse; so the groups are the strongly connected components of this relation and the
decomposition is unique, whatever the assignment (Dulmage-Mendelsohn).  The assignment is a flow, found with the pebble
game.

A driver away from the frame can lock a loop of moving links (a hydraulic cylinder in a boom): such links are one body
of their group, assembled first, from *floating* groups that hang on one of its links.

Sources: [Assur 1914]; I. I. Artobolevsky, *Theory of Mechanisms and Machines*, on class and order;
C. Galletti, *A note on modular approaches to planar linkage kinematic analysis*, Mech. Mach. Theory 21 (1986);
O. Shai, A. Sljoka and W. Whiteley, *Directed graphs, decompositions, and spatial linkages*, Discrete Appl. Math. 161
(2013) 3028-3047.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import TYPE_CHECKING

from graphsynth.core.compilation import named
from graphsynth.core.errors import GraphError
from graphsynth.structure.connectivity import bits
from graphsynth.structure.rigidity import is_sparse, rigid_bodies

if TYPE_CHECKING:
    from graphsynth.structure.graph import Joint, MechanismGraph

__all__ = ["AssurGroup", "Decomposition", "Fault", "decompose", "find_fault", "is_assur_group", "is_baranov_truss"]

_ROMAN = ("", "I", "II", "III", "IV", "V", "VI", "VII", "VIII", "IX", "X")


@dataclass(frozen=True, slots=True)
class AssurGroup:
    """One structural group of a mechanism.

    Parameters
    ----------
    links : tuple of int
        Links of the group, ascending.
    inner, outer : tuple of Joint
        Joints inside the group, and joints to links placed before it.
    stage : int
        1 for a group that hangs on the frame and the driven links only, else one more than the latest it hangs on.
    bodies : tuple of tuple of int
        The links by body; a body has several links only where drivers inside the group lock them.
    floating : tuple of AssurGroup
        Groups that assemble the bodies of several links, each body on its smallest link; they come before the group.
    """

    links: tuple[int, ...]
    inner: tuple[Joint, ...]
    outer: tuple[Joint, ...]
    stage: int
    bodies: tuple[tuple[int, ...], ...]
    floating: tuple[AssurGroup, ...] = ()

    @property
    def order(self) -> int:
        """The number of outer joints."""
        return len(self.outer)

    @property
    def group_class(self) -> int:
        """The largest number of joints on a contour, of the floating groups too (see `contour_class`); 2 for a dyad."""
        body = {link: own for own, links in enumerate(self.bodies) for link in links}
        inner = ((body[joint.a], body[joint.b], joint.mobility) for joint in self.inner)
        outer = ((body[joint.a if joint.a in body else joint.b], -1, joint.mobility) for joint in self.outer)
        own = contour_class(joint for joint in (*inner, *outer) if joint[0] != joint[1])
        return max([own, *(group.group_class for group in self.floating)])

    def __str__(self) -> str:
        links = ", ".join(map(str, self.links))
        text = f"class {_roman(self.group_class)} order {self.order}: links {links}"
        return f"{text} ({', '.join(map(str, self.floating))})" if self.floating else text


@dataclass(frozen=True, slots=True)
class Decomposition:
    """A mechanism as drivers and structural groups in the order of assembly.

    Parameters
    ----------
    drivers : tuple of Joint
        Joints whose motion is given.
    driven : tuple of int
        Links that the drivers place together with the frame, the frame included.
    groups : tuple of AssurGroup
        Each hangs on the frame, driven links and groups before it; among those that could come next, the one with the
        smallest link comes first.
    """

    drivers: tuple[Joint, ...]
    driven: tuple[int, ...]
    groups: tuple[AssurGroup, ...]

    @property
    def mechanism_class(self) -> int:
        """The highest class of a group; 1 when there is none."""
        return max((group.group_class for group in self.groups), default=1)

    @property
    def dyadic(self) -> bool:
        """Whether it is assembled dyad by dyad: no group, floating ones included, has more than two bodies."""
        return all(len(own.bodies) <= 2 for group in self.groups for own in (group, *group.floating))

    def __str__(self) -> str:
        steps = "; ".join(map(str, self.groups)) or "no groups"
        return f"mechanism of class {_roman(self.mechanism_class)}: {steps}"


@dataclass(frozen=True, slots=True)
class Fault:
    """Why a mechanism with these drivers has no decomposition.

    Parameters
    ----------
    kind : {"drivers", "over-constrained"}
        The number of drivers is not the mobility; or a set of links has too many constraints and others too few.
    links : tuple of int
        The set concerned (for "drivers", the links that remain free, if any).
    message : str
        The sentence shown to the user.
    """

    kind: str
    links: tuple[int, ...]
    message: str


class _System:
    """Bodies, constraints between them, and what :func:`.pebbles.divide` makes of them.

    ``base`` is placed from the start: the frame, or a link of a floating body; ``within`` masks the links that count.
    """

    def __init__(self, graph: MechanismGraph, drivers: tuple[Joint, ...], base: int, within: int = -1) -> None:
        import numpy as np

        self.graph = graph
        self.drivers = drivers
        counts = np.array([within >> link & 1 for link in range(graph.links)], dtype=np.bool_)
        joints = np.array([(*joint, joint in drivers) for joint in graph.joints], dtype=np.int64).reshape(-1, 4)
        body, group, marks = (np.empty(graph.links, dtype=np.int64) for _ in range(3))
        (divide,) = named("graphsynth.structure.pebbles", "divide")
        #: what stands in the way of groups: a code of :mod:`.pebbles`
        self.fault = int(divide(joints, counts, base, graph.space, body, group, marks))
        #: for each link the smallest link of its body, the number of its group, and marks of a fault
        self.body_of, self.group_of, self.marks = body.tolist(), group.tolist(), marks.tolist()
        self.placed = self.body_of[base]
        #: (body, body, mobility left, joint); a driven joint keeps one freedom less.
        self.constraints = [
            (self.body_of[j.a], self.body_of[j.b], j.mobility - (j in drivers), j)
            for j in graph.joints
            if within >> j.a & within >> j.b & 1 and not (j.mobility == 1 and j in drivers)
        ]

    def links_of(self, bodies: Iterable[int]) -> tuple[int, ...]:
        wanted = set(bodies)
        return tuple(link for link, body in enumerate(self.body_of) if body in wanted)

    def marked(self, bit: int) -> tuple[int, ...]:
        return tuple(link for link, marks in enumerate(self.marks) if marks & bit)

    def inner(self, group: int) -> list[tuple[int, int, int]]:
        """Return the constraints ``(body, body, mobility)`` inside a set of bodies."""
        return [(a, b, mobility) for a, b, mobility, _ in self.constraints if group >> a & group >> b & 1]

    def groups(self) -> list[int]:
        """Return the groups as bit masks of bodies, in the order of assembly."""
        masks = [0] * (1 + max(self.group_of))
        for body, number in zip(self.body_of, self.group_of):
            masks[max(number, 0)] |= 1 << body
        return masks[1:]


def find_fault(mechanism: MechanismGraph, drivers: Iterable[int | tuple[int, int]]) -> Fault | None:
    """Return why a mechanism with these drivers cannot be decomposed, or None if it can (exact).

    Parameters
    ----------
    mechanism, drivers
        As for :func:`decompose`, also what is raised for them.

    Returns
    -------
    Fault or None
        The links that have too many constraints and those that stay free, and a sentence.

    Examples
    --------
    >>> from graphsynth.structure.graph import MechanismGraph
    >>> find_fault(MechanismGraph(4, [(0, 1), (1, 2), (2, 3), (0, 3)], frame=0), [1, 3]).message
    'mobility 1 needs 1 driver, not 2; links 2 have too many constraints'
    """
    return _fault(_system_of(mechanism, drivers))


def _system_of(graph: MechanismGraph, drivers: Iterable[int | tuple[int, int]]) -> _System:
    """Return bodies and constraints of a mechanism, its drivers in the order given."""
    if graph.frame is None:
        raise GraphError("structural groups hang on the frame, and this chain has none; use with_frame()")
    by_pair = {(joint.a, joint.b): joint for joint in graph.joints}
    found: list[Joint] = []
    for driver in drivers:
        pair = (graph.frame, driver) if isinstance(driver, int) else (driver[0], driver[1])
        joint = by_pair.get((min(pair), max(pair)))
        if joint is None:
            raise GraphError(f"links {pair[0]} and {pair[1]} have no joint to drive; name a joint of the graph")
        if joint in found:
            raise GraphError(f"joint {joint.a}-{joint.b} is driven twice")
        found.append(joint)
    return _System(graph, tuple(found), graph.frame)


def _fault(system: _System) -> Fault | None:
    """Return what stands in the way of groups."""
    from graphsynth.structure import pebbles

    graph, given = system.graph, len(system.drivers)
    marked, free = system.marked(pebbles.TOO_MANY), system.marked(pebbles.FREE)
    too_many = tuple(link for link in marked if system.body_of[link] != system.placed) or marked
    refused = system.fault == pebbles.CROWDED
    if graph.mobility != given:
        text = f"mobility {graph.mobility} needs {graph.mobility} driver{'s' * (graph.mobility != 1)}, not {given}"
        if graph.mobility < 0:
            text = f"mobility {graph.mobility}: the structure is over-constrained and no choice of drivers helps"
        text += f"; links {_list(too_many)} have too many constraints" if refused else ""
        text += f"; links {_list(free)} remain free" if free else ""
        return Fault("drivers", free, text)
    if refused:
        text = f"links {_list(too_many)} have too many constraints with these drivers, and links {_list(free)}"
        return Fault("over-constrained", too_many, text + " remain free; drive another joint")
    if system.fault == pebbles.CROWDED_INSIDE:
        text = f"moving links {_list(marked)} have too many constraints among themselves; remove a joint"
        return Fault("over-constrained", marked, text)
    return None


def decompose(mechanism: MechanismGraph, drivers: Iterable[int | tuple[int, int]]) -> Decomposition:
    """Decompose a mechanism into its drivers and structural groups (exact; unique).

    Parameters
    ----------
    mechanism : MechanismGraph
        A graph with a frame; joints of mobility 2 and more (gears, cams) and any space Pi are allowed.
    drivers : iterable of int or (int, int)
        Driven joints: a link stands for its joint with the frame, a pair for the joint between the two links.

    Returns
    -------
    Decomposition
        Groups in the order of assembly.

    Raises
    ------
    GraphError
        If there is no frame, a driver is not a joint or is given twice, or :func:`find_fault` finds a fault; the
        message names the links.

    Examples
    --------
    >>> from graphsynth.structure.graph import MechanismGraph
    >>> print(decompose(MechanismGraph(4, [(0, 1), (1, 2), (2, 3), (0, 3)], frame=0), [1]))
    mechanism of class II: class II order 2: links 2, 3
    """
    system = _system_of(mechanism, drivers)
    if fault := _fault(system):
        raise GraphError(fault.message)
    return Decomposition(system.drivers, system.links_of([system.placed]), _groups(system))


def _groups(system: _System) -> tuple[AssurGroup, ...]:
    """Describe the groups of a system whose constraints are assigned, in the order of assembly."""
    stage_of = {system.placed: 0}
    groups = []
    for mask in system.groups():
        locked = rigid_bodies(system.graph.links, system.inner(mask), system.graph.space, mask)
        floating: list[AssurGroup] = []
        for rigid in locked:  # bodies rigid among themselves are assembled on the smallest of them
            links = system.links_of(bits(rigid))
            floating += _groups(_System(system.graph, system.drivers, links[0], sum(1 << link for link in links)))
        inner, outer, stage = [], [], 0
        for a, b, _, joint in system.constraints:
            near, far = (a, b) if mask >> a & 1 else (b, a)
            if mask >> a & mask >> b & 1:
                inner.append(joint)
            elif mask >> near & 1 and far in stage_of:
                outer.append(joint)
                stage = max(stage, stage_of[far])
        merged = {body for rigid in locked for body in bits(rigid)}
        bodies = [bits(rigid) for rigid in locked] + [[body] for body in bits(mask) if body not in merged]
        group = AssurGroup(
            links=system.links_of(bits(mask)),
            inner=tuple(inner),
            outer=tuple(outer),
            stage=stage + 1,
            bodies=tuple(sorted(system.links_of(body) for body in bodies)),
            floating=tuple(floating),
        )
        stage_of.update(dict.fromkeys(bits(mask), group.stage))
        groups.append(group)
    return tuple(groups)


def is_assur_group(graph: MechanismGraph) -> bool:
    """Return whether a graph is a structural group with its frame as one link (exact).

    Mobility 0, and DOF(S) >= 1 for every proper subset S of two links or more, with or without the frame.

    Parameters
    ----------
    graph : MechanismGraph
        With a frame: the links that the group hangs on, contracted to one.

    Returns
    -------
    bool

    Raises
    ------
    GraphError
        If no frame is chosen.

    Examples
    --------
    >>> from graphsynth.structure.graph import MechanismGraph
    >>> is_assur_group(MechanismGraph(3, [(0, 1), (1, 2), (0, 2)], frame=0))
    True
    """
    if graph.frame is None:
        raise GraphError("a structural group hangs on a frame, and this chain has none; use with_frame()")
    return is_baranov_truss(graph)


def is_baranov_truss(graph: MechanismGraph) -> bool:
    """Return whether a graph is a Baranov truss: a group whichever link is made the frame (exact).

    The condition does not mention the frame (mobility 0, and every proper subset of two links or more can move), so
    one link that makes a group implies that each does.

    Parameters
    ----------
    graph : MechanismGraph

    Returns
    -------
    bool

    Examples
    --------
    >>> from graphsynth.structure.graph import MechanismGraph
    >>> is_baranov_truss(MechanismGraph(3, [(0, 1), (1, 2), (0, 2)]))
    True
    >>> is_baranov_truss(MechanismGraph(4, [(0, 1), (1, 2), (2, 3), (0, 3)]))
    False
    """
    if graph.mobility != 0 or graph.links < 2:
        return False
    everything = (1 << graph.links) - 1
    return all(is_sparse(graph, everything & ~(1 << link)) for link in range(graph.links))


def _list(links: Iterable[int]) -> str:
    return ", ".join(map(str, links)) or "none"


def _roman(number: int) -> str:
    return _ROMAN[number] if number < len(_ROMAN) else str(number)


def contour_class(joints: Iterable[tuple[int, int, int]]) -> int:
    """Return the class of a group: the largest number of joints on one of its contours, 2 at least.

    A contour is rigid, a link with three or more joints of the group; or movable, a closed loop of links of the
    group.  Of the loops those of a minimum cycle basis count; their lengths do not depend on the basis.  A joint of
    mobility 2 or more counts as a link with two joints in its place.

    ``joints`` (a, b, mobility): inner joints, and outer joints with -1 for ``b``.

    A dyad, a triad on its ternary link, and four links in a loop:

    >>> contour_class([(1, 2, 1), (1, -1, 1), (2, -1, 1)])
    2
    >>> contour_class([(0, 1, 1), (0, 2, 1), (0, 3, 1), (1, -1, 1), (2, -1, 1), (3, -1, 1)])
    3
    >>> contour_class([(0, 1, 1), (1, 2, 1), (2, 3, 1), (0, 3, 1), (0, -1, 1), (2, -1, 1)])
    4
    """
    degree: dict[int, int] = {}
    edges: list[tuple[object, object]] = []
    for a, b, mobility in joints:
        degree[a] = degree.get(a, 0) + 1
        if b < 0:
            continue
        degree[b] = degree.get(b, 0) + 1
        middle = ("joint", len(edges))
        edges += [(a, b)] if mobility == 1 else [(a, middle), (middle, b)]
    largest = max([2, *degree.values()])
    nodes = {node for edge in edges for node in edge}
    if len(edges) < max(len(nodes), 1):
        return largest  # inner joints without a loop
    import networkx

    return max(largest, *map(len, networkx.minimum_cycle_basis(networkx.Graph(edges))))
