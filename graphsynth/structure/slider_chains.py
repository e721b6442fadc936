"""Chains with prismatic joints beside revolute ones: which joints slide, keys, text, dimensions.

A prismatic joint has mobility 1 as a revolute one has, so the mechanism graph does not tell them apart; here it comes
with the joints that slide.  Canonical form and key are those of the graph with these as joints of another colour.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

from graphsynth.core.errors import FormatError
from graphsynth.core.shown import work
from graphsynth.structure.coloured_chains import OTHER, ColouredChain
from graphsynth.structure.graph import MechanismGraph
from graphsynth.structure.text import integer

if TYPE_CHECKING:
    from pathlib import Path

    import graphsynth as gs


@dataclass(frozen=True, repr=False)
class SliderChain(ColouredChain):
    """A planar kinematic chain, or a mechanism, with revolute and prismatic joints.

    Immutable and hashable; isomorphic chains have the same :attr:`key`.

    Parameters
    ----------
    coloured : MechanismGraph
        The graph in the plane; prismatic joints are those written with mobility 2.  Make chains with
        :meth:`from_graph`.

    Raises
    ------
    FormatError
        Another space.

    Examples
    --------
    >>> crank_slider = SliderChain.from_graph(MechanismGraph(4, [(0, 1), (1, 2), (2, 3), (0, 3)]), [(0, 3)])
    >>> crank_slider.mobility, crank_slider.sliders, crank_slider.to_text()
    (1, ((0, 3),), 'Cl P:0-3')
    """

    letter = "P"
    what = "a chain with prismatic joints"

    @classmethod
    def from_graph(cls, graph: MechanismGraph, sliders: Iterable[tuple[int, int]]) -> SliderChain:
        """Make a chain from a graph of joints of mobility 1, some of which slide; `FormatError` for others."""
        last = graph.links - 1
        sliding = {tuple(sorted(integer(link, "sliders", 0, last, "number of a link") for link in s)) for s in sliders}
        if unknown := sliding - {(a, b) for a, b, mobility in graph.joints if mobility == 1}:
            raise FormatError(f"{min(unknown)} is no joint of mobility 1 of the graph", "sliders")
        joints = [(a, b, OTHER if (a, b) in sliding else f) for a, b, f in graph.joints]
        if any(f > 1 for _, _, f in graph.joints):
            raise FormatError("all joints have mobility 1 beside prismatic ones", "graph")
        return cls(MechanismGraph(graph.links, joints, frame=graph.frame, space=graph.space))

    @cached_property
    def sliders(self) -> tuple[tuple[int, int], ...]:
        """The joints that slide, sorted."""
        return tuple((a, b) for a, b, mobility in self.coloured.joints if mobility == OTHER)

    @cached_property
    def graph(self) -> MechanismGraph:
        """The mechanism graph, all joints of mobility 1."""
        packed = bytearray(self.coloured.packed)
        packed[2::3] = b"\x01" * (len(packed) // 3)
        return MechanismGraph._unchecked(self.links, bytes(packed), self.frame)

    @property
    def joints(self) -> tuple[tuple[int, int], ...]:
        """All joints as pairs of links, sorted."""
        return tuple((a, b) for a, b, _ in self.coloured.joints)

    @property
    def mobility(self) -> int:
        """Mobility by the structural formula (exact count)."""
        return self.graph.mobility

    def embody(self, goals: Any = None, seed: int = 0, **options: Any) -> Any:
        """Find dimensions with which it moves as wanted, an `Embodiment`: `embody` with its prismatic joints given."""
        kinds = dict.fromkeys(self.sliders, "P")
        return work("embody")(self.graph, goals, seed, joints=kinds, **options)

    def draw(self, path: str | Path | None = None, **options: Any) -> gs.Drawing:
        """Draw its kinematic diagram, prismatic joints as blocks on guides; as `MechanismGraph.draw`."""
        found: gs.Drawing = work("draw sliders")(self, path, **options)
        return found

    def _repr_svg_(self) -> str:
        return self.draw(None, width=300.0, height=260.0).svg
