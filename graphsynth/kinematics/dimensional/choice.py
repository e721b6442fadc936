"""Which link is fixed and which is driven, when the graph leaves it open."""

from __future__ import annotations

from collections.abc import Iterable
from itertools import combinations
from typing import Any

from graphsynth.core.errors import GraphError
from graphsynth.structure.assur import decompose, find_fault
from graphsynth.structure.graph import MechanismGraph

#: A driver is a link on the frame, or (base, link).
Drivers = int | tuple[int, int] | Iterable[int | tuple[int, int]]


def choices(graph: MechanismGraph, driver: Drivers | None) -> list[tuple[MechanismGraph, tuple[tuple[int, int], ...]]]:
    """Frames and drivers to try, best first.

    The order: smallest largest group first (dyads before larger groups), then the lowest class, then driven links with
    the fewest joints, then inversions in their canonical order and links by number.

    Raises
    ------
    GraphError
        A driver for a chain without a frame, drivers that do not fit, or a graph that no choice can drive.

    Examples
    --------
    >>> chain = MechanismGraph(4, [(0, 1), (1, 2), (2, 3), (0, 3)])
    >>> [drivers for _, drivers in choices(chain, None)]
    [((0, 1),), ((0, 3),)]
    """
    if graph.mobility < 1:
        raise GraphError(f"mobility {graph.mobility}: nothing moves; embodiment needs mobility 1 or more")
    if driver is not None:
        return [_given(graph, driver)]
    found = []
    frames = [graph] if graph.frame is not None else graph.inversions()
    for rank, inversion in enumerate(frames):
        frame = inversion.frame
        assert frame is not None
        near = [link for link in range(inversion.links) if inversion.neighbours[frame] >> link & 1]
        near = [link for link in near if _mobility(inversion, frame, link) == 1]
        for links in combinations(near, inversion.mobility):
            pairs = tuple((frame, link) for link in links)
            if find_fault(inversion, pairs) is None:
                groups = decompose(inversion, pairs).groups
                size = max((len(group.links) for group in groups), default=0)
                order = max((group.group_class for group in groups), default=1)
                found.append(((size, order, sum(inversion.degrees[k] for k in links), rank, links), inversion, pairs))
    if not found:
        raise GraphError(
            f"no choice of {graph.mobility} drivers on the frame moves this mechanism; name the driven joints as (a, b)"
        )
    return [(inversion, pairs) for _, inversion, pairs in sorted(found, key=lambda item: item[0])]


def _mobility(graph: MechanismGraph, a: int, b: int) -> int:
    return next(joint.mobility for joint in graph.joints if (joint.a, joint.b) == (min(a, b), max(a, b)))


def _is_link(value: Any) -> bool:
    return hasattr(value, "__index__") and not isinstance(value, bool)


def _given(graph: MechanismGraph, driver: Drivers) -> tuple[MechanismGraph, tuple[tuple[int, int], ...]]:
    if graph.frame is None:
        raise GraphError("a driver is given but no frame; choose one with graph.with_frame(link)")
    try:
        listed: list[Any] = [driver] if _is_link(driver) else list(driver)  # type: ignore[arg-type]
    except TypeError as error:
        raise GraphError(f"driver = {driver!r} is neither a link nor (base, link)") from error
    if len(listed) == 2 and graph.mobility == 1 and all(map(_is_link, listed)):
        listed = [tuple(listed)]  # one driver (base, link)
    pairs = []
    for item in listed:
        pair = (graph.frame, item) if _is_link(item) else item
        if not isinstance(pair, tuple | list) or len(pair) != 2 or not all(map(_is_link, pair)):
            raise GraphError(f"driver = {item!r} is neither a link nor (base, link)")
        base, link = int(pair[0]), int(pair[1])
        if base == link:
            raise GraphError(f"driver {base}-{link}: a link cannot be driven against itself; name two jointed links")
        pairs.append((base, link))
    fault = find_fault(graph, pairs)
    if fault is not None:
        raise GraphError(f"these drivers do not move the mechanism: {fault.message}")
    return graph, tuple(pairs)
