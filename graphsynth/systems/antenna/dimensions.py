"""The antenna pointing mechanism: dimensions and structural graph."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from graphsynth.core.checks import choice, positive

if TYPE_CHECKING:
    from graphsynth.structure.graph import MechanismGraph

__all__ = ["PointingDimensions"]


@dataclass(frozen=True)
class PointingDimensions:
    """Lengths, gimbal order and structural graph of a `PointingMechanism`, which describes the parameters."""

    l1: float = 0.1
    l2: float = 0.15
    l3: float = 0.0592
    l4: float = 0.15
    l5: float = 0.0592
    order: str = "YX"

    def __post_init__(self) -> None:
        for name in ("l1", "l2", "l3", "l4", "l5"):
            object.__setattr__(self, name, positive(name, getattr(self, name)))
        choice("order", self.order, ("YX", "XY"))

    @property
    def lengths(self) -> tuple[float, float, float, float, float]:
        """The five lengths l1 to l5."""
        return self.l1, self.l2, self.l3, self.l4, self.l5

    def graph(self) -> MechanismGraph:
        """Structural graph in space: universal, spherical and revolute joints have 2, 3 and 1 sub-edges.

        Links 0 to 5: ground, reflector, rod Y, rod X, crank Y, crank X.

        Examples
        --------
        >>> graph = PointingDimensions().graph()
        >>> graph.mobility, graph.loops, 6 * graph.loops
        (2, 2, 12)
        """
        from graphsynth.structure.graph import MechanismGraph

        joints = [(0, 1, 2), (1, 2, 2), (1, 3, 2), (2, 4, 3), (3, 5, 3), (0, 4, 1), (0, 5, 1)]
        return MechanismGraph(6, joints, frame=0, space=6)
