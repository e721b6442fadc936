"""How many assembly modes a structure has: the number of complex ones, which no choice of dimensions exceeds.

The unit vectors of n links that close all loops lie in a linear space, and their conjugates, which are their inverses,
in another one.  How often two such spaces meet depends on their matroids alone, and is counted by a recursion over sets
of links.  Source: J. Capco, M. Gallet, G. Grasegger, C. Koutschan, N. Lubbes, J. Schicho, *The number of realizations
of a Laman graph*, SIAM J. Appl. Algebra Geometry 2 (2018) 94-125, for bars; with links for elements, and why that
holds, in theory/assembly-modes.
"""

from __future__ import annotations

from collections.abc import Iterable
from functools import lru_cache
from math import prod
from typing import TYPE_CHECKING

from graphsynth.core.compilation import named
from graphsynth.core.errors import GraphError
from graphsynth.structure.assur import decompose
from graphsynth.structure.graph import MechanismGraph

if TYPE_CHECKING:
    from graphsynth.structure.assur import AssurGroup
    from graphsynth.structure.graph import Joint

__all__ = ["count_assembly_modes", "coupler_curve_degree"]


def count_assembly_modes(graph: MechanismGraph, drivers: Iterable[int | tuple[int, int]] = ()) -> int:
    """Count the assembly modes of a plane structure, complex ones included (exact).

    Parameters
    ----------
    graph : MechanismGraph
        A structure of mobility 0, as a Baranov truss; or a mechanism with a frame, and ``drivers``.  Joints are
        revolute.
    drivers : iterable of int or (int, int), optional
        Joints that are held, as for `decompose`.

    Returns
    -------
    int
        Number of assemblies with complex coordinates for dimensions in general position: real ones are as many at
        most.  0 if such dimensions cannot be assembled, because some links have too many constraints.

    Raises
    ------
    GraphError
        Joints of mobility 2 or more, another space than the plane, a mobility that is not the number of drivers, a
        structural group of more than 19 bodies.

    Examples
    --------
    >>> from graphsynth import enumerate_baranov_trusses
    >>> [[count_assembly_modes(truss) for truss in enumerate_baranov_trusses(n)] for n in (3, 5)]
    [[2], [6]]
    >>> sorted(map(count_assembly_modes, enumerate_baranov_trusses(7)))
    [14, 16, 18]
    """
    _check(graph)
    drivers = tuple(drivers)
    if drivers or graph.mobility:
        return prod(map(_modes_of, decompose(graph, drivers).groups))
    return _counted(tuple(range(graph.links)), graph.joints)


def coupler_curve_degree(mechanism: MechanismGraph, link: int) -> int:
    """Return the degree of the curves that points of a link draw (exact).

    Parameters
    ----------
    mechanism : MechanismGraph
        With a frame, of mobility 1 in the plane; joints are revolute.
    link : int
        A moving link.

    Returns
    -------
    int
        Degree of the curve of a point in general position, for dimensions in general position, over all assembly
        branches; half of it is the circularity, the number of times the curve passes through either circular point.

    Raises
    ------
    GraphError
        As for `count_assembly_modes`, for no frame, and for a link that does not move.

    Examples
    --------
    >>> from graphsynth import MechanismGraph
    >>> four_bar = MechanismGraph(4, [(0, 1), (1, 2), (2, 3), (0, 3)], frame=0)
    >>> coupler_curve_degree(four_bar, 2), coupler_curve_degree(four_bar, 1)
    (6, 2)
    """
    _check(mechanism)
    if mechanism.frame is None or mechanism.mobility != 1:
        raise GraphError(f"curves need a frame and mobility 1, not {mechanism.mobility}; choose a mechanism")
    if not 0 <= link < mechanism.links or link == mechanism.frame:
        raise GraphError(f"link = {link} must be a moving link below {mechanism.links}; choose another one")
    # a bar from the frame to the point: a circle meets a curve of degree 2 d in 2 d points beside the circular ones
    n, frame = mechanism.links, mechanism.frame
    barred = MechanismGraph(n + 1, [*mechanism.joints, (frame, n), (link, n)], frame=frame)
    found, needed = 1, {n}
    for group in reversed(decompose(barred, ()).groups):  # those that place the bar
        if needed & set(group.links):
            needed.update(end for joint in group.outer for end in (joint.a, joint.b))
            found *= _modes_of(group)
    return found


def _check(graph: MechanismGraph) -> None:
    if graph.space != 3:
        raise GraphError(f"assembly modes are counted in the plane (Pi = 3), not for Pi = {graph.space}")
    if wide := next((joint for joint in graph.joints if joint.mobility > 1), None):
        raise GraphError(
            f"joint {wide.a}-{wide.b} has mobility {wide.mobility}; assembly modes are counted for revolute joints"
        )


def _modes_of(group: AssurGroup) -> int:
    """Count the modes of a group and of the groups that assemble its bodies."""
    body = {link: k for k, links in enumerate(group.bodies, start=1) for link in links}
    where = [0] * (1 + max(max(joint[:2]) for joint in (*group.inner, *group.outer)))
    for link, k in body.items():
        where[link] = k
    joints = [joint for joint in (*group.inner, *group.outer) if where[joint.a] != where[joint.b]]
    return _counted(tuple(where), joints) * prod(map(_modes_of, group.floating))


def _counted(where: tuple[int, ...], joints: Iterable[Joint]) -> int:
    """Count the modes of joints between bodies: link k is part of body ``where[k]``."""
    return _table(tuple((where[joint.a], where[joint.b]) for joint in joints), 1 + max(where))


@lru_cache(maxsize=1000)
def _table(pairs: tuple[tuple[int, int], ...], bodies: int) -> int:
    """Count the modes of bodies with a pin for each pair."""
    import numpy as np

    from graphsynth.structure.matroids import MOST

    if bodies > MOST:
        raise GraphError(f"{bodies} bodies must be assembled at once; at most {MOST} are counted: drive other joints")
    if bodies == 1:
        return 1
    fill_ranks, count_modes = named("graphsynth.structure.matroids", "fill_ranks", "count_modes")
    links = np.array(pairs, dtype=np.int64).reshape(-1)
    ranks = np.empty(1 << bodies, dtype=np.int8)
    fill_ranks(bodies, links, np.repeat(np.arange(len(pairs)), 2), ranks)
    size, found = 1 << 12, -1
    while found < 0:  # more room where it was too little
        keys, counts = np.empty(size, dtype=np.int64), np.empty(size, dtype=np.int64)
        found = int(count_modes(bodies, ranks, keys, counts, np.empty((bodies + 1, 5), dtype=np.int64)))
        size *= 16
    return found
