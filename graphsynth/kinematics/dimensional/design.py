"""What embodiment varies: the places of the joints at the first input, and the directions of slides and slots.

Every link's own frame coincides with the fixed one at the first input, so the places are the coordinates of each joint
on both of its links and the mechanism is assembled there by construction.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from graphsynth.mechanism.joints import COLUMNS, JointGeometry, PinSlot, Prismatic, Revolute
from graphsynth.mechanism.laws import Driver
from graphsynth.mechanism.model import Mechanism
from graphsynth.structure.graph import MechanismGraph

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Design:
    """A mechanism graph with a frame, drivers and kinds of joints: all but the numbers.

    Parameters
    ----------
    graph : MechanismGraph
    drivers : tuple of (base, link)
    kinds : tuple of str
        "R", "P" or "pin-slot" for every joint, in the order of ``graph.joints``.
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
        joints: list[JointGeometry] = []
        direction = dict(zip(self.directed, angles.tolist()))
        for k, (joint, kind) in enumerate(zip(self.graph.joints, self.kinds)):
            at = (float(places[k, 0]), float(places[k, 1]))
            if kind == "R":
                joints.append(Revolute(joint.a, joint.b, at, at))
            elif kind == "P":
                joints.append(Prismatic(joint.a, joint.b, at, at, direction[k], direction[k]))
            else:
                joints.append(PinSlot(joint.a, joint.b, at, at, direction[k]))
        return Mechanism(
            self.graph,
            tuple(joints),
            tuple(Driver(*pair) for pair in self.drivers),
            pose=((0.0, 0.0, 0.0),) * self.graph.links,
        )
