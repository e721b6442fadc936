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
from graphsynth.structure.multiple_joints import MultipleJointChain

if TYPE_CHECKING:
    from graphsynth.structure.assur import AssurGroup
    from graphsynth.structure.graph import Joint

__all__ = ["count_assembly_modes", "coupler_curve_degree", "coupler_curve_genus"]


def count_assembly_modes(
    graph: MechanismGraph | MultipleJointChain, drivers: Iterable[int | tuple[int, int]] = ()
) -> int:
    """Count the assembly modes of a plane structure, complex ones included (exact).

    Parameters
    ----------
    graph : MechanismGraph or MultipleJointChain
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
        structural group (with multiple joints, the whole) of more than 19 bodies.

    Examples
    --------
    >>> from graphsynth import enumerate_baranov_trusses
    >>> [[count_assembly_modes(truss) for truss in enumerate_baranov_trusses(n)] for n in (3, 5)]
    [[2], [6]]
    >>> sorted(map(count_assembly_modes, enumerate_baranov_trusses(7)))
    [14, 16, 18]
    """
    drivers = tuple(drivers)
    if isinstance(graph, MultipleJointChain):
        return _with_pins(graph, drivers)
    _check(graph)
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
    return _drawn(mechanism, link)[0]


def coupler_curve_genus(mechanism: MechanismGraph, link: int) -> int:
    """Return the genus of the curves that points of a link draw (exact).

    It is that of the motion of all links which the curve depends on.

    Parameters
    ----------
    mechanism : MechanismGraph
        With a frame, of mobility 1 in the plane; joints are revolute.
    link : int
        A moving link.

    Returns
    -------
    int
        Genus of the complex curve of a point in general position, for dimensions in general position: 0 if it has a
        rational parametrisation; such a mechanism has at most one circuit more than its genus.

    Raises
    ------
    GraphError
        As for `coupler_curve_degree`.

    Notes
    -----
    Dimensions at which dead centres meet, as in a kite, make it smaller.

    Examples
    --------
    >>> from graphsynth import MechanismGraph
    >>> four_bar = MechanismGraph(4, [(0, 1), (1, 2), (2, 3), (0, 3)], frame=0)
    >>> coupler_curve_genus(four_bar, 2), coupler_curve_genus(four_bar, 1)
    (1, 0)
    """
    moving = _drawn(mechanism, link)[1]
    at = {own: k for k, own in enumerate(sorted(moving))}
    joints = tuple((at[joint.a], at[joint.b]) for joint in mechanism.joints if {joint.a, joint.b} <= moving)
    return _genus(joints, len(at))


@lru_cache(maxsize=100)
def _drawn(mechanism: MechanismGraph, link: int) -> tuple[int, frozenset[int]]:
    """Return the degree of the curves of a link's points, and the links with which they move, the frame among them."""
    _check(mechanism)
    if mechanism.frame is None or mechanism.mobility != 1:
        raise GraphError(f"curves need a frame and mobility 1, not {mechanism.mobility}; choose a mechanism")
    if not 0 <= link < mechanism.links or link == mechanism.frame:
        raise GraphError(f"link = {link} must be a moving link below {mechanism.links}; choose another one")
    # a bar from the frame to the point: a circle meets a curve of degree 2 d in 2 d points beside the circular ones
    n, frame = mechanism.links, mechanism.frame
    barred = MechanismGraph(n + 1, [*mechanism.joints, (frame, n), (link, n)], frame=frame)
    found, needed, moving = 1, {n}, {frame}
    for group in reversed(decompose(barred, ()).groups):  # those that place the bar
        if needed & set(group.links):
            needed.update(end for joint in group.outer for end in (joint.a, joint.b))
            moving.update(group.links)
            found *= _modes_of(group)
    return found, frozenset(moving - {n})


def _check(graph: MechanismGraph) -> None:
    if graph.space != 3:
        raise GraphError(f"assembly modes are counted in the plane (Pi = 3), not for Pi = {graph.space}")
    if wide := next((joint for joint in graph.joints if joint.mobility > 1), None):
        raise GraphError(
            f"joint {wide.a}-{wide.b} has mobility {wide.mobility}; assembly modes are counted for revolute joints"
        )


def _with_pins(chain: MultipleJointChain, drivers: tuple[int | tuple[int, int], ...]) -> int:
    """Count the modes of a chain with multiple joints at once: links that drivers hold are one body."""
    if len(drivers) != chain.mobility or (drivers and chain.frame is None):
        raise GraphError(
            f"mobility {chain.mobility} takes as many drivers and a frame for them, not {len(drivers)} drivers with "
            f"frame {chain.frame}: choose a frame, and other drivers"
        )
    where = list(range(chain.links))
    for driver in drivers:
        a, b = driver if isinstance(driver, tuple) else (chain.frame or 0, driver)
        if not (0 <= min(a, b) <= max(a, b) < chain.links and chain.neighbours[a] >> b & 1) or where[a] == where[b]:
            raise GraphError(f"driver {driver}: links {a} and {b} share no joint, or are held already; choose others")
        where = [where[a] if body == where[b] else body for body in where]
    number = {body: k for k, body in enumerate(sorted(set(where)))}
    pins = (tuple(sorted({number[where[link]] for link in joint})) for joint in chain.joints)
    return _table(tuple(pin for pin in pins if len(pin) > 1), len(number))


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
def _table(pins: tuple[tuple[int, ...], ...], bodies: int) -> int:
    """Count the modes of bodies; each pin joins those that it names."""
    return _Spaces(pins, bodies).count((1 << bodies) - 1, 0, 0) if bodies > 1 else 1


@lru_cache(maxsize=1000)
def _genus(pairs: tuple[tuple[int, int], ...], bodies: int) -> int:
    """Return the genus of the motion of bodies with a pin for each pair, mobility 1."""
    import numpy as np

    spaces = _Spaces(pairs, bodies)
    ranks, full = spaces.ranks.astype(int), (1 << bodies) - 1
    large = np.arange(1, full)  # at an end of the curve some links become large beside the others
    both = ranks[large] + ranks[full ^ large]
    fits = ranks[large] + ranks[full] - ranks[full ^ large] == np.array([int(k).bit_count() for k in large]) + 1
    ends = [(k, full ^ k, int(more) - int(ranks[full]) - 1) for k, more in zip(large[fits].tolist(), both[fits])]
    return 1 + sum(spaces.count(a, 0, b) * spaces.count(b, a, 0) * more for a, b, more in ends if more) // 2


class _Spaces:
    """The two linear spaces of bodies and the pins that join them, by their matroid."""

    def __init__(self, pins: tuple[tuple[int, ...], ...], bodies: int) -> None:
        import numpy as np

        from graphsynth.structure.matroids import MOST

        if bodies > MOST:
            raise GraphError(
                f"{bodies} bodies must be assembled at once; at most {MOST} are counted: drive other joints"
            )
        fill_ranks, self._count = named("graphsynth.structure.matroids", "fill_ranks", "count_modes")
        links = np.array([link for pin in pins for link in pin], dtype=np.int64)
        self.bodies, self.ranks = bodies, np.empty(1 << bodies, dtype=np.int8)
        fill_ranks(bodies, links, np.repeat(np.arange(len(pins)), [len(pin) for pin in pins]), self.ranks)

    def count(self, left: int, one: int, two: int) -> int:
        """Count the common points of two minors: links that are left, and those that are contracted in each."""
        import numpy as np

        size, found = 1 << 12, -1
        while found < 0:  # more room where it was too little
            keys, counts = np.empty(size, dtype=np.int64), np.empty(size, dtype=np.int64)
            stack = np.empty((self.bodies + 1, 5), dtype=np.int64)
            found = int(self._count(self.bodies, self.ranks, left, one, two, keys, counts, stack))
            size *= 16
        return found
