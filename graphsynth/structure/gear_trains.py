"""Planetary gear trains as graphs: links on common axes, gear pairs with their carriers, what they are alike in.

Axes and links make a tree; a gear pair joins two links whose axes are both on a third link, its carrier.  So a train is
a graph of links with edges of two kinds, links that share an axis and gear pairs, and has the key of that graph.  See
docs/explanation/gear-trains.md.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import combinations, permutations
from typing import TYPE_CHECKING, Any

from graphsynth.core.errors import FormatError, GraphError
from graphsynth.core.shown import work
from graphsynth.structure.coloured_chains import OTHER, ColouredChain
from graphsynth.structure.connectivity import bits
from graphsynth.structure.gear_speeds import Arrangement, GearPair, Teeth, TrainEfficiency, efficiency, ratio, speeds
from graphsynth.structure.graph import MechanismGraph
from graphsynth.structure.text import LINKS_MAX, integer

if TYPE_CHECKING:
    from pathlib import Path

    import graphsynth as gs


@dataclass(frozen=True, repr=False)
class PlanetaryGearTrain(ColouredChain):
    """A planetary (epicyclic) gear train, or a geared kinematic chain when no link is fixed.

    Immutable and hashable; isomorphic trains have the same :attr:`key`: their displacement graphs are the same.

    Parameters
    ----------
    coloured : MechanismGraph
        The links; joints of mobility 1 between links that share an axis, of mobility 2 for gear pairs.  Make trains
        with :meth:`from_axes`.

    Raises
    ------
    FormatError
        Axes that do not join the links as a tree; a gear pair without a carrier.

    Examples
    --------
    Sun 0, ring 1 and carrier 2 on one axis, the planet 3 on the carrier:

    >>> train = PlanetaryGearTrain.from_axes(4, [(0, 1, 2), (2, 3)], [(0, 3), (1, 3)])
    >>> train.mobility, train.gears[0], train.to_text()
    (1, GearPair(a=0, b=3, carrier=2), 'C~ G:0-3,1-3')
    >>> train.ratio(0, 2, 1, teeth={(0, 3): (20, 20), (1, 3): (-60, 20)})
    4
    """

    letter = "G"
    what = "a planetary gear train"

    def __post_init__(self) -> None:
        super().__post_init__()
        near = self._near
        for axis in self.axes:
            if any(not near[a] >> b & 1 for a, b in combinations(axis, 2)):
                raise FormatError(f"links {axis} do not all share one axis", "axes")
        joined = 1
        for _ in range(self.links):
            for link in bits(joined):
                joined |= near[link]
        if joined != (1 << self.links) - 1:
            raise FormatError(f"link {(~joined & (joined + 1)).bit_length() - 1} is on no axis of the others", "axes")
        if sum(len(axis) - 1 for axis in self.axes) != self.links - 1:
            raise FormatError("the axes close a loop of turning joints: they must join the links as a tree", "axes")
        for pair in self.gears:
            if pair.carrier < 0:
                raise FormatError(f"gears {pair.a} and {pair.b} have no link that carries both axes", "gears")

    @classmethod
    def from_axes(
        cls, links: int, axes: Iterable[Sequence[int]], gears: Iterable[Sequence[int]], *, frame: int | None = None
    ) -> PlanetaryGearTrain:
        """Make a train from the links on each axis, two or more, and the pairs of links in mesh; else `FormatError`."""
        links = integer(links, "links", 2, LINKS_MAX, "number of links")
        joints: list[tuple[int, int, int]] = []
        for count, axis in enumerate(axes, 1):
            own = [integer(link, f"axis {count}", 0, links - 1, "number of a link") for link in axis]
            if len(own) < 2:
                raise FormatError(f"{tuple(own)} must be two links or more", f"axis {count}")
            joints += [(a, b, 1) for a, b in combinations(own, 2)]
        for count, pair in enumerate(gears, 1):
            ends = [integer(link, f"gear pair {count}", 0, links - 1, "number of a link") for link in pair]
            if len(ends) != 2:
                raise FormatError(f"{tuple(ends)} must be two links", f"gear pair {count}")
            joints.append((ends[0], ends[1], OTHER))
        return cls(MechanismGraph(links, joints, frame=frame))

    @cached_property
    def _near(self) -> list[int]:
        """For each link the links on its axes, as bits."""
        near = [0] * self.links
        for a, b, mobility in self.coloured.joints:
            if mobility != OTHER:
                near[a] |= 1 << b
                near[b] |= 1 << a
        return near

    @cached_property
    def axes(self) -> tuple[tuple[int, ...], ...]:
        """The links on each axis, sorted."""
        near = self._near
        pairs = ((a, b) for a, b, mobility in self.coloured.joints if mobility != OTHER)
        return tuple(sorted({tuple(bits(near[a] & near[b] | 1 << a | 1 << b)) for a, b in pairs}))

    @cached_property
    def gears(self) -> tuple[GearPair, ...]:
        """The gear pairs, sorted."""
        pairs = [(a, b) for a, b, mobility in self.coloured.joints if mobility == OTHER]
        return tuple(GearPair(a, b, (self._near[a] & self._near[b]).bit_length() - 1) for a, b in pairs)

    @property
    def mobility(self) -> int:
        """Mobility by the structural formula, W = N - 1 - gear pairs, with any link fixed (exact count)."""
        return self.links - 1 - len(self.gears)

    @property
    def is_fractionated(self) -> bool:
        """Whether gear pairs with their carriers fall apart, or would without one of the links (exact)."""
        import networkx

        near = networkx.Graph(ends for pair in self.gears for ends in combinations(pair, 2))
        return len(near) < self.links or not networkx.is_biconnected(near)

    def rotation_graph(self) -> PlanetaryGearTrain:
        """Return the train with the same gear pairs and carriers on as many axes as can be (exact).

        Trains have the same equations of angular velocities, up to the names of links, exactly when the keys of these
        are equal.  Raises `GraphError` if gear pairs and carriers do not connect all links.
        """
        import networkx

        near = networkx.Graph((pair.carrier, gear) for pair in self.gears for gear in pair[:2])
        if len(near) < self.links or not networkx.is_connected(near):
            raise GraphError("gear pairs and carriers do not connect all links: the equations fall apart")
        axes = map(sorted, networkx.biconnected_components(near))
        return self.from_axes(self.links, axes, [pair[:2] for pair in self.gears], frame=self.frame)

    def arrangements(self, *, coaxial: bool = False) -> list[Arrangement]:
        """List which links can be input, output and fixed, each once up to the symmetries of the train.

        Input and output turn about axes of the fixed link, which is the frame if there is one.

        Parameters
        ----------
        coaxial : bool
            Input and output on the same axis, as in most transmissions.
        """
        found: dict[Arrangement, Arrangement] = {}
        fixed = range(self.links) if self.frame is None else [self.frame]
        for link in fixed:
            for one, other in permutations(bits(self._near[link]), 2):
                arrangement = Arrangement(one, other, link)
                if arrangement in found or (coaxial and not self._near[one] >> other & 1):
                    continue
                found[arrangement] = arrangement
                reached = [arrangement]
                for place in reached:
                    for move in self.coloured.labelling.generators:
                        image = Arrangement(*(move[i] for i in place))
                        if image not in found:
                            found[image] = arrangement
                            reached.append(image)
        return sorted(set(found.values()), key=lambda own: (own.fixed, own))

    def speeds(self, given: Mapping[int, Any], *, teeth: Teeth | None = None) -> dict[int, Any]:
        """Return the angular velocity of every link; see `graphsynth.structure.gear_speeds.speeds`."""
        return speeds(self, given, teeth)

    def ratio(self, input: int, output: int, fixed: int | None = None, *, teeth: Teeth | None = None) -> Any:
        """Return the ratio of the angular velocities of input and output; see `graphsynth.structure.gear_speeds`."""
        return ratio(self, Arrangement(input, output, self._fixed(fixed)), teeth)

    def efficiency(
        self, input: int, output: int, fixed: int | None = None, *, teeth: Teeth, mesh: Any = "0.98"
    ) -> TrainEfficiency:
        """Return the efficiency with losses in the teeth; see `graphsynth.structure.gear_speeds.efficiency`."""
        return efficiency(self, Arrangement(input, output, self._fixed(fixed)), teeth, mesh)

    def mechanism(self, input: int | Sequence[int], fixed: int | None = None, *, teeth: Teeth) -> gs.Mechanism:
        """Return it as a planar mechanism that moves: axes placed, pitch radii by the teeth, the input driven.

        Axes are placed by the teeth, in directions of their own; every gear pair has the module that fits there.

        Parameters
        ----------
        input : int or sequence of int
            The driven link, or as many as the mobility, each on an axis of the fixed one.
        fixed : int, optional
            The fixed link.  Default: the frame.
        teeth : mapping
            As for the speeds, numbers; internal gears, with negative ones, larger than their pinions.

        Raises
        ------
        GraphError
            For an input that does not turn about an axis of the fixed link, or a wrong number of them.
        SpecError
            For teeth without a number or of an internal gear that is too small; else as for the speeds.
        """
        inputs = input if isinstance(input, Sequence) else [input]
        found: gs.Mechanism = work("mechanism of gear train")(self, inputs, self._fixed(fixed), teeth)
        return found

    def _fixed(self, fixed: int | None) -> int:
        if fixed is None and self.frame is None:
            raise GraphError("no link is fixed: name the fixed link, or choose a frame")
        return integer(self.frame if fixed is None else fixed, "fixed", 0, self.links - 1, "number of a link")

    def draw(self, path: str | Path | None = None, **options: Any) -> gs.Drawing:
        """Draw its functional schematic; see `graphsynth.drawing.gear_schematic.gear_schematic`.

        Gears with a negative number of ``teeth`` are drawn as rings, all others as external ones; the frame is hatched.
        """
        found: gs.Drawing = work("draw gear train")(self, path, **options)
        return found

    def _repr_svg_(self) -> str:
        return self.draw(None).svg
