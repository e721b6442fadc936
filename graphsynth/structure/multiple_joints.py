"""Chains with multiple joints: pins on which three links or more turn; a pin of k links counts as k - 1 joints.

A chain is kept as its *incidence graph*: links, then multiple joints, as vertices; an edge is a simple joint between
two links, or a link on a multiple joint.  Canonical form and key are those of this graph with its vertices of two
kinds.  See docs/explanation/multiple-joints.md.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property, reduce
from itertools import combinations
from operator import or_
from typing import TYPE_CHECKING, Any

from graphsynth.core.errors import FormatError
from graphsynth.core.shown import work
from graphsynth.structure.canonical import KEY_VERSION, Labelling, decode_key, key_of, label_coloured
from graphsynth.structure.graph import MechanismGraph
from graphsynth.structure.text import LINKS_MAX, integer

if TYPE_CHECKING:
    from pathlib import Path

    import graphsynth as gs


@dataclass(frozen=True)
class MultipleJointChain:
    """A planar kinematic chain, or a mechanism, with revolute joints that join two links or more.

    Immutable and hashable; isomorphic chains have the same :attr:`key`.

    Parameters
    ----------
    incidence : MechanismGraph
        The links, then the multiple joints, as vertices; joints of mobility 1, in the plane.  Make chains from their
        joints with :meth:`from_joints`.
    multiple : int
        Number of multiple joints.

    Raises
    ------
    FormatError
        A multiple joint of fewer than three links or jointed to another one; two joints between the same two links; a
        multiple joint as frame; another space or joint mobility.

    Examples
    --------
    >>> chain = MultipleJointChain.from_joints(6, [(0, 1, 2), (0, 3), (1, 4), (2, 5), (3, 4), (3, 5)])
    >>> chain.mobility, chain.joints[-1], chain.to_text()
    (1, (0, 1, 2), 'FCSv? m1')
    """

    incidence: MechanismGraph
    multiple: int

    def __post_init__(self) -> None:
        graph = self.incidence
        integer(self.multiple, "multiple", 0, graph.links - 1, "number of multiple joints")
        if graph.space != 3 or any(mobility != 1 for mobility in graph.packed[2::3]):
            raise FormatError("multiple joints are joints of mobility 1 in the plane, as all others of the chain")
        if graph.frame is not None and graph.frame >= self.links:
            raise FormatError(f"vertex {graph.frame} is a multiple joint, not a link: choose a link", "frame")
        links = (1 << self.links) - 1
        for pin in range(self.links, graph.links):
            if graph.degrees[pin] < 3 or graph.neighbours[pin] & ~links:
                raise FormatError(f"a multiple joint joins three links or more, vertex {pin} does not", f"vertex {pin}")
        seen: set[tuple[int, int]] = set()
        for joint in self.joints:
            for a, b in combinations(joint, 2):
                if (a, b) in seen:
                    raise FormatError(f"links {a} and {b} are jointed twice: they are one link", f"joint {joint}")
                seen.add((a, b))

    @classmethod
    def from_joints(
        cls, links: int, joints: Iterable[Sequence[int]], *, frame: int | None = None
    ) -> MultipleJointChain:
        """Make a chain from its joints, each the links that it joins; `FormatError` for what is none."""
        links = integer(links, "links", 1, LINKS_MAX, "number of links")
        if frame is not None:
            frame = integer(frame, "frame", 0, links - 1, "frame")
        pairs: list[tuple[int, int]] = []
        pins = 0
        for count, joint in enumerate(joints, 1):
            own = [integer(link, f"joint {count}", 0, links - 1, "number of a link") for link in joint]
            if len(set(own)) != len(own) or len(own) < 2:
                raise FormatError(f"{tuple(own)} must be two different links or more", f"joint {count}")
            pairs += [(own[0], own[1])] if len(own) == 2 else [(link, links + pins) for link in own]
            pins += len(own) > 2
        return cls(MechanismGraph(links + pins, pairs, frame=frame), pins)

    @property
    def links(self) -> int:
        """Number of links N, the frame included."""
        return self.incidence.links - self.multiple

    @property
    def frame(self) -> int | None:
        """The fixed link; a chain has none."""
        return self.incidence.frame

    @cached_property
    def joints(self) -> tuple[tuple[int, ...], ...]:
        """The joints, each as its links ascending: the simple ones, sorted, then the multiple ones."""
        graph, links = self.incidence, self.links
        simple = [(a, b) for a, b, _ in graph.joints if b < links]
        return (*simple, *(tuple(a for a in range(links) if graph.neighbours[a] >> pin & 1) for pin in self._pins))

    @property
    def _pins(self) -> range:
        return range(self.links, self.incidence.links)

    @property
    def mobility(self) -> int:
        """Mobility by the structural formula, W = 3 (N - 1) - 2 sum over joints of (links on it - 1) (exact count)."""
        return 3 * (self.links - 1) - 2 * sum(len(joint) - 1 for joint in self.joints)

    @property
    def loops(self) -> int:
        """Number of independent loops."""
        return self.incidence.loops

    @property
    def degrees(self) -> tuple[int, ...]:
        """Number of joints on each link."""
        return self.incidence.degrees[: self.links]

    @property
    def neighbours(self) -> tuple[int, ...]:
        """For each link the bit mask of the links that share a joint with it."""
        on = [sum(1 << link for link in joint) for joint in self.joints]
        return tuple(reduce(or_, (mask for mask in on if mask >> a & 1), 0) & ~(1 << a) for a in range(self.links))

    @property
    def girth(self) -> int | None:
        """Number of joints of the shortest loop, or None for a chain without loops."""
        pairs = [(link, joint) for joint, ends in enumerate(self.joints, self.links) for link in ends]
        around = MechanismGraph(self.links + len(self.joints), pairs).girth  # links and joints, one after the other
        return around and around // 2

    @property
    def is_planar(self) -> bool:
        """Whether the graph of links and multiple joints can be drawn without crossings."""
        return self.incidence.is_planar

    @property
    def mobility_type(self) -> str:
        """How the mobility is shared out, ``"total"``, ``"partial"`` or ``"fractionated"``, as `MechanismGraph` tells.

        All sets of links are tried, each of which has two joints with others of the set.
        """
        import numpy as np

        if self.incidence.is_fractionated:
            return "fractionated"
        sets = np.arange(1, 1 << self.links)
        has = sets[:, None] >> np.arange(self.links) & 1
        holds = np.array([[link in joint for joint in self.joints] for link in range(self.links)], np.int64)
        on = has @ holds  # links of a set on a joint
        closed = (((on > 1) @ holds.T > 1) | (has == 0)).all(axis=1)
        free = 3 * (has.sum(axis=1) - 1) - 2 * np.maximum(on - 1, 0).sum(axis=1)
        return "partial" if (free[closed] < self.mobility).any() else "total"

    @cached_property
    def labelling(self) -> Labelling:
        """Canonical labelling of the incidence graph; multiple joints come behind all links."""
        framed = self.frame is not None  # colours: the frame, other links, multiple joints
        links = [int(framed and link != self.frame) for link in range(self.links)]
        return label_coloured(self.incidence, links + [1 + framed] * self.multiple)

    @property
    def automorphism_order(self) -> int:
        """Order of the automorphism group (exact)."""
        return self.labelling.order

    def canonical(self) -> MultipleJointChain:
        """Return the canonical representative of the isomorphism class; the frame, if any, becomes link 0."""
        return MultipleJointChain(self.incidence.relabelled(self.labelling.permutation), self.multiple)

    @cached_property
    def key(self) -> str:
        """Canonical key: the version, ``m``, the number of multiple joints, a dot, and the incidence graph.

        Equal for two chains exactly when they are isomorphic, the frame included.
        """
        return f"{KEY_VERSION}m{self.multiple}.{key_of(self.canonical().incidence)[1:]}"

    @classmethod
    def from_key(cls, key: str) -> MultipleJointChain:
        """Read a canonical key; anything else is a :class:`FormatError`."""
        head, _, rest = key.partition(".")
        if head[:2] != f"{KEY_VERSION}m" or not head[2:].isdecimal() or len(head) > 5:
            raise FormatError(f"a key of a chain with multiple joints begins with {KEY_VERSION}m<number>.", "key")
        links, joints, frame, space = decode_key(KEY_VERSION + rest)
        chain = cls(MechanismGraph(links, joints, frame=frame, space=space), int(head[2:]))
        if chain.key != key:
            raise FormatError("not the key of the chain it describes; keys are not written by hand", "key")
        return chain

    def to_text(self) -> str:
        """Return the one-line form: that of the incidence graph, and ``m`` with the number of multiple joints."""
        return f"{self.incidence.to_text()} m{self.multiple}"

    @classmethod
    def from_text(cls, text: str) -> MultipleJointChain:
        """Read the one-line form; anything else is a :class:`FormatError`."""
        rest, _, last = text.strip().rpartition(" ")
        if last[:1] != "m" or not last[1:].isdecimal() or len(last) > 4:
            raise FormatError("the text form of a chain with multiple joints ends in m<number>", "last field")
        return cls(MechanismGraph.from_text(rest), int(last[1:]))

    def graph(self) -> MechanismGraph:
        """Return the chain with simple joints alone, of the same mobility: all links of a pin on its first one.

        The frame comes first on its pins.  In dimensions, the joints of a pin are given the same place.
        """
        pairs = []
        for joint in self.joints:
            first = self.frame if self.frame in joint else joint[0]
            pairs += [(first, other) for other in joint if other != first]
        return MechanismGraph(self.links, pairs, frame=self.frame)

    def draw(self, path: str | Path | None = None, **options: Any) -> gs.Drawing:
        """Draw its kinematic diagram, multiple joints as two circles; as `MechanismGraph.draw`."""
        found: gs.Drawing = work("draw multiple joints")(self, path, **options)
        return found

    def _repr_svg_(self) -> str:
        return self.draw(None, width=300.0, height=260.0).svg

    def __repr__(self) -> str:
        return f"MultipleJointChain.from_text({self.to_text()!r})"
