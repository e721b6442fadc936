"""A problem: everything one call enumerates or counts, cut into pieces that can be done anywhere in any order."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from fractions import Fraction
from functools import lru_cache
from hashlib import sha256

from graphsynth.core.errors import InfeasibleSpecError, SpecError
from graphsynth.structure.graph import MechanismGraph
from graphsynth.structure.levels import components_of
from graphsynth.structure.system.spec import LinkAssortment, StructuralSpec
from graphsynth.structure.system.variables import shown, whole
from graphsynth.synthesis.contracted import has_contracted_graphs
from graphsynth.synthesis.families import (
    MOST_LINKS,
    Family,
    Levels,
    chain_families,
    chain_joints,
    chain_numbers,
    mechanism_families,
    truss_families,
)
from graphsynth.synthesis.fractionated import fractionated_chains
from graphsynth.synthesis.joined import count_fractionated
from graphsynth.synthesis.outlook import check_loops
from graphsynth.synthesis.rings import rings
from graphsynth.synthesis.units import Unit, count_unit, cut, graphs_of, text_of

__all__ = ["Piece", "Problem", "count_piece", "graphs_of_piece", "text_of_piece"]

_PRIMES = (2, 3, 5, 7, 11, 13)


@dataclass(frozen=True)
class Handful:
    """Rings, or fractionated chains: few enough to be made one by one (to count, most need not be made).

    ``assortment`` and ``levels`` restrict mechanisms, ``symmetry`` asks for an automorphism of that prime order.
    """

    kind: str  # "rings" or "fractionated"
    links: int
    mobility: int
    space: int
    higher: tuple[tuple[int, int], ...]
    framed: bool
    assortment: LinkAssortment | None = None
    levels: Levels = ()
    symmetry: int = 0
    weight: float = 1.0

    def graphs(self) -> Iterator[MechanismGraph]:
        """Yield the graphs."""
        for graph in self._all():
            if self.symmetry and graph.automorphism_order % self.symmetry:  # Cauchy: p divides the order of the group
                continue
            if self._fits(graph):
                yield graph

    @property
    def restricted(self) -> bool:
        """Whether only some of the chains are wanted."""
        return bool(self.assortment or self.levels or self.symmetry)

    def count(self) -> int:
        """Count the graphs; fractionated chains without any restriction are not made."""
        if self.kind == "fractionated" and not self.restricted:
            return count_fractionated(self.links, self.mobility, self.space, self.higher, self.framed)
        return sum(1 for _ in self.graphs())

    def _all(self) -> Iterator[MechanismGraph]:
        if self.kind == "rings":
            yield from rings(self.links, self.mobility, self.space, dict(self.higher), self.framed)
            return
        for chain in fractionated_chains(self.links, self.mobility, self.space, self.higher):
            if self.framed:
                yield from (_by_levels(graph) for graph in chain.inversions())
            else:
                yield chain

    def _fits(self, graph: MechanismGraph) -> bool:
        wanted = self.assortment
        if wanted is not None:
            if graph.degrees[0] != wanted.frame_joints or graph.assortment != {
                a: n for a, n in wanted.n_a.items() if n
            }:
                return False
            parts = len(components_of(graph.neighbours, (1 << graph.links) - 2))  # without the frame
            if wanted.frame_loops != wanted.frame_joints - parts:
                return False
        return all(
            low <= (len(graph.levels[at]) if -len(graph.levels) <= at < len(graph.levels) else 0) <= high
            for at, low, high in self.levels
        )


def _by_levels(graph: MechanismGraph) -> MechanismGraph:
    order = [link for level in graph.levels for link in sorted(level)]
    place = [0] * graph.links
    for position, link in enumerate(order):
        place[link] = position
    return graph.relabelled(place)


Piece = Unit | Handful


@dataclass(frozen=True)
class Problem:
    """What to enumerate or to count.

    Parameters
    ----------
    title : str
        One line for people; also identifies the problem when interrupted work is resumed.
    families : tuple of Family
        What the search kernels generate.
    handfuls : tuple of Handful
        What is made one by one; listed first.
    symmetry : int
        0, or the prime order of a required automorphism.
    reason : str
        Why there is nothing, where the structural formula says so already.
    """

    title: str
    families: tuple[Family, ...]
    handfuls: tuple[Handful, ...] = ()
    symmetry: int = 0
    reason: str = field(default="", repr=False, compare=False)

    @property
    def signature(self) -> str:
        """A short text that differs between problems."""
        return sha256(repr(self).encode()).hexdigest()[:16]

    def pieces(self, *, listing: bool) -> list[Piece]:
        """Cut the problem; the cut depends on the problem alone."""
        listing = listing or bool(self.symmetry) or any(family.levels for family in self.families)
        return list(_pieces(self, listing))

    @classmethod
    def chains(
        cls,
        links: int,
        mobility: int,
        space: int,
        joints_by_mobility: Mapping[int, int] | None,
        fractionated: bool,
        symmetry: int | None,
        *,
        framed: bool = False,
    ) -> Problem:
        """State the enumeration of chains (of mechanisms with every frame, if ``framed``).

        Raises
        ------
        SpecError
            A value out of its bounds, or no mobility.
        TooLargeError
            More loops than there are contracted graphs.
        """
        links, mobility, space, higher = chain_numbers(links, mobility, space, joints_by_mobility)
        fractionated, order = _truth(fractionated, "fractionated"), check_symmetry(symmetry)
        joints = chain_joints(links, mobility, space, higher)
        placed = tuple(sorted((i, count) for i, count in higher.items() if i > 1 and count))
        title = f"W={mobility} N={links} Pi={space}" + "".join(f" p{i}={count}" for i, count in placed)
        title += (" framed" if framed else "") + (" fractionated" if fractionated else "")
        loops = -1 if joints is None else joints + sum(count for _, count in placed) - links + 1
        if loops < (links > 2):
            return cls(title, (), reason=_reason(links, mobility, space, higher))
        check_loops(loops, links, mobility, space, higher, framed=framed)
        common = (links, mobility, space, placed, framed)
        handfuls = [Handful("rings", *common, symmetry=order)]
        if fractionated and mobility > 1:
            handfuls.append(Handful("fractionated", *common, symmetry=order))
        families = chain_families(links, mobility, space, higher, framed)
        return cls(title + (f" symmetry={order}" if order else ""), tuple(families), tuple(handfuls), order)

    @classmethod
    def mechanisms(cls, question: StructuralSpec | LinkAssortment, symmetry: int | None) -> Problem:
        """State the enumeration of the mechanisms that answer a structural question.

        Raises
        ------
        SpecError
            Not a structural question; `InfeasibleSpecError` for one without an answer.
        TooLargeError
            More loops than there are contracted graphs.
        """
        order = check_symmetry(symmetry)
        levels: Levels = ()
        fractionated = False
        if isinstance(question, LinkAssortment):
            question.check()
            assortments = [question]
            fractionated = question.frame_parts > 1
        elif isinstance(question, StructuralSpec):
            assortments = question.solve()
            fractionated = question.fractionated
            levels = tuple((at, low or 0, 255 if high is None else high) for at, (low, high) in question.levels.items())
        else:
            raise SpecError(
                f"{shown(question)} is not a structural question: give a StructuralSpec or a LinkAssortment"
            )
        families: list[Family] = []
        handfuls: list[Handful] = []
        for assortment in assortments:
            if assortment.mobility < 1:
                raise InfeasibleSpecError(
                    f"W = {assortment.mobility} must be at least 1 for a mechanism: fix W, or ask for Assur groups"
                )
            higher = tuple((i, count) for i, count in enumerate(assortment.p_i, 1) if i > 1 and count)
            if not has_contracted_graphs(assortment.loops, assortment.links):
                numbers = assortment.loops, assortment.links, assortment.mobility, assortment.space
                check_loops(*numbers, dict(higher), framed=True)
            families += mechanism_families(assortment, levels)
            common = (assortment.moving_links + 1, assortment.mobility, assortment.space, higher, True)
            if assortment.loops == 1:
                handfuls.append(Handful("rings", *common, assortment, levels, order))
            if fractionated and assortment.mobility > 1:
                handfuls.append(Handful("fractionated", *common, assortment, levels, order))
        title = question.describe() if isinstance(question, StructuralSpec) else str(question)
        title = " ".join(title.split()) + (f" symmetry={order}" if order else "")
        return cls(title, tuple(families), tuple(handfuls), order)

    @classmethod
    def groups(cls, moving: int, space: int) -> Problem:
        """State the enumeration of Assur groups with a number of moving links.

        Raises
        ------
        SpecError
            A number of links out of its bounds.
        TooLargeError
            More loops than there are contracted graphs.
        """
        return cls.trusses(whole(moving, "moving links", 1, MOST_LINKS - 1) + 1, space, True)

    @classmethod
    def trusses(cls, links: int, space: int, framed: bool) -> Problem:
        """State the enumeration of Baranov trusses (of Assur groups, if ``framed``).

        Raises
        ------
        SpecError
            A number of links out of its bounds.
        TooLargeError
            More loops than there are contracted graphs.
        """
        links, _, space, _ = chain_numbers(links, 0, space, None, least=0)
        joints = chain_joints(links, 0, space, {})
        title = f"{'Assur groups, n=' + str(links - 1) if framed else 'Baranov trusses, N=' + str(links)} Pi={space}"
        if joints is None:
            return cls(title, (), reason=_reason(links, 0, space, {}))
        check_loops(joints - links + 1, links, 0, space, {}, framed=framed)
        return cls(title, tuple(truss_families(links, space, framed)), (Handful("rings", links, 0, space, (), framed),))


@lru_cache(maxsize=4)
def _pieces(problem: Problem, listing: bool) -> tuple[Piece, ...]:
    return (*problem.handfuls, *cut(problem.families, listing=listing, symmetry=problem.symmetry))


def check_symmetry(symmetry: int | None) -> int:
    """Return the required order, 0 for none.

    Raises
    ------
    SpecError
        For an order that is not a small prime.
    """
    if symmetry is None:
        return 0
    try:
        if (order := whole(symmetry, "symmetry", 2)) in _PRIMES:
            return order
    except SpecError:
        pass
    raise SpecError(
        f"symmetry = {shown(symmetry)} must be a prime {_PRIMES}; for a composite order take its prime factors and "
        "look at automorphism_order"
    )


def _truth(value: object, name: str) -> bool:
    if value is True or value is False:
        return value
    if type(value).__name__ in ("bool", "bool_"):  # of numpy
        return bool(value)
    raise SpecError(f"{name} = {shown(value)} must be True or False")


def _reason(links: int, mobility: int, space: int, higher: Mapping[int, int]) -> str:
    """Say why the structural formula leaves no chain, in one sentence."""
    rest = Fraction(space * (links - 1) - mobility - sum(n * (space - i) for i, n in higher.items() if i > 1))
    lower = rest / (space - 1)
    joints = f"{float(lower):.6g} joints of mobility 1" + (" besides the others" if sum(higher.values()) else "")
    asked = f"W = {mobility} with {links} links in a space of mobility {space} takes {joints}"
    if lower < 0:
        return f"{asked}: there are too many others"
    if lower.denominator > 1:
        near = [n for n in range(max(3, links - space), links + space + 1) if chain_joints(n, mobility, space, higher)]
        below, above = max((n for n in near if n < links), default=0), min((n for n in near if n > links), default=0)
        others = " or ".join(str(n) for n in (below, above) if n)
        return f"{asked}, no whole number" + (f": ask for {others} links" if others else "")
    if higher.get(1, lower) != lower:
        return f"{asked}, not {higher[1]}: leave p1 out"
    return f"{asked}, too few for a loop: ask for more links or a smaller mobility"


def count_piece(piece: Piece) -> int:
    """Count the graphs of a piece (exact)."""
    return count_unit(piece) if isinstance(piece, Unit) else piece.count()


def graphs_of_piece(piece: Piece) -> Iterator[MechanismGraph]:
    """Stream the graphs of a piece."""
    return graphs_of(piece) if isinstance(piece, Unit) else piece.graphs()


def text_of_piece(piece: Piece) -> Iterator[tuple[bytes, int]]:
    """Stream a piece as (lines of the text form, number of lines)."""
    if isinstance(piece, Unit):
        yield from text_of(piece)
        return
    lines = [graph.to_text() + "\n" for graph in piece.graphs()]
    if lines:
        yield "".join(lines).encode("ascii"), len(lines)
