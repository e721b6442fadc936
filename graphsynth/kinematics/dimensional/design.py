"""What a search for dimensions varies: places of the joints at the first input, directions of slides and slots.

Every link's own frame coincides with the fixed one at the first input, so the places are the coordinates of each joint
on both of its links and the mechanism is assembled there by construction.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property
from itertools import combinations
from typing import Any

import numpy as np
from numpy.typing import NDArray

from graphsynth.core.errors import GraphError
from graphsynth.mechanism.joints import COLUMNS, JointGeometry, PinSlot, Prismatic, Revolute
from graphsynth.mechanism.laws import Driver
from graphsynth.mechanism.model import Mechanism
from graphsynth.structure.assur import decompose, find_fault
from graphsynth.structure.graph import MechanismGraph

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Design:
    """A mechanism graph with a frame, drivers (base, link) and kinds of joints: all but the numbers.

    A kind is "R", "P" or "pin-slot", in the order of ``graph.joints``.
    """

    graph: MechanismGraph
    drivers: tuple[tuple[int, int], ...]
    kinds: tuple[str, ...]

    @cached_property
    def directed(self) -> tuple[int, ...]:
        """Joints that have a direction."""
        return tuple(k for k, kind in enumerate(self.kinds) if kind != "R")

    @cached_property
    def driver_joints(self) -> tuple[int, ...]:
        """Indices of the driven joints."""
        pairs = {(min(d), max(d)) for d in self.drivers}
        return tuple(k for k, joint in enumerate(self.graph.joints) if (joint.a, joint.b) in pairs)

    @cached_property
    def sides(self) -> NDArray[np.intp]:
        """Pairs of joints whose distance is a length of a link, shape (sides, 2): slides have no place on a link."""
        found = []
        for link in range(self.graph.links):
            own = [k for k in self.joints_of(link) if self.kinds[k] == "R"]
            found += [(p, q) for i, p in enumerate(own) for q in own[i + 1 :]]
        return np.array(found, dtype=np.intp).reshape(-1, 2)

    @cached_property
    def fixed(self) -> tuple[int, ...]:
        """Two joints that stay where they are, so that the whole is not moved, turned or scaled: on the frame."""
        assert self.graph.frame is not None
        own = self.joints_of(self.graph.frame)
        first = [k for k in own if k in self.driver_joints]
        return tuple((first + [k for k in own if k not in first])[:2])

    @cached_property
    def cranks(self) -> tuple[tuple[int, list[int]], ...]:
        """Revolute driven joints on the frame, each with the joints of the link that is driven there."""
        driven = zip(self.drivers, self.driver_joints)
        found = [(k, link) for (base, link), k in driven if base == self.graph.frame and self.kinds[k] == "R"]
        return tuple((k, self.joints_of(link)) for k, link in found)

    def joints_of(self, link: int) -> list[int]:
        """Return the indices of the joints of a link."""
        return [k for k, joint in enumerate(self.graph.joints) if link in (joint.a, joint.b)]

    def dimensions(self, places: Array, angles: Array) -> Array:
        """Dimension sets, shape (sets, joints, 10), of places (sets, joints, 2) and angles (sets, directed)."""
        table = np.zeros((*places.shape[:2], len(COLUMNS)))
        table[:, :, 0:2] = table[:, :, 3:5] = places
        for column, k in enumerate(self.directed):
            table[:, k, 2] = table[:, k, 5] = angles[:, column]
        return table

    def mechanism(self, places: Array, angles: Array) -> Mechanism:
        """Return the mechanism of one set, places (joints, 2) and angles (directed,), posed at the first input."""
        direction = dict(zip(self.directed, angles.tolist()))
        joints = [
            made_joint(kind, a, b, at, at, direction.get(k, 0.0), direction.get(k, 0.0))
            for k, ((a, b, _), kind, at) in enumerate(zip(self.graph.joints, self.kinds, map(tuple, places.tolist())))
        ]
        drivers = tuple(Driver(*pair) for pair in self.drivers)
        return Mechanism(self.graph, tuple(joints), drivers, pose=((0.0, 0.0, 0.0),) * self.graph.links)


def made_joint(
    kind: str, a: int, b: int, at_a: tuple[float, float], at_b: tuple[float, float], angle_a: float, angle_b: float
) -> JointGeometry:
    """Return a joint of a kind of `Design`."""
    if kind == "R":
        return Revolute(a, b, at_a, at_b)
    return Prismatic(a, b, at_a, at_b, angle_a, angle_b) if kind == "P" else PinSlot(a, b, at_a, at_b, angle_a)


# --- which link is fixed and which is driven, when the graph leaves it open


#: A driver is a link on the frame, or (base, link).
Drivers = int | tuple[int, int] | Iterable[int | tuple[int, int]]


def choices(graph: MechanismGraph, driver: Drivers | None) -> list[tuple[MechanismGraph, tuple[tuple[int, int], ...]]]:
    """Frames and drivers to try, best first.

    The order: smallest largest group first (dyads before larger groups), then the lowest class, then driven links with
    the fewest joints, then inversions in their canonical order and links by number.

    `GraphError` for a driver of a chain without a frame, drivers that do not fit, a graph that no choice can drive.

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
        pins = {pair for a, b, mobility in inversion.joints for pair in ((a, b), (b, a)) if mobility == 1}
        near = [link for link in near if (frame, link) in pins]
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
