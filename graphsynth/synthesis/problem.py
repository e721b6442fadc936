"""A problem: everything one call enumerates or counts, cut into pieces that can be done anywhere in any order."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from concurrent.futures import Executor
from contextlib import AbstractContextManager
from dataclasses import dataclass, field
from fractions import Fraction
from functools import lru_cache
from hashlib import sha256
from itertools import chain
from typing import TYPE_CHECKING

from graphsynth.core.errors import InfeasibleSpecError, SpecError
from graphsynth.core.ordered import in_order, processes as processes_of
from graphsynth.core.wording import shown, whole
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
from graphsynth.synthesis.one_by_one import OneByOne
from graphsynth.synthesis.units import Unit, count_unit, cut, graphs_of, text_of

if TYPE_CHECKING:
    from graphsynth.structure.graph import MechanismGraph
    from graphsynth.structure.system.assortment import LinkAssortment
    from graphsynth.structure.system.spec import StructuralSpec

_PRIMES = (2, 3, 5, 7, 11, 13)


Piece = Unit | OneByOne


@dataclass(frozen=True)
class Problem:
    """What to enumerate or to count.

    Parameters
    ----------
    title : str
        One line for people; also identifies the problem when interrupted work is resumed.
    families : tuple of Family
        What the search kernels generate.
    one_by_one : tuple of OneByOne
        What is made one by one; listed first.
    symmetry : int
        0, or the prime order of a required automorphism.
    reason : str
        Why there is nothing, where the structural formula says so already.
    """

    title: str
    families: tuple[Family, ...]
    one_by_one: tuple[OneByOne, ...] = ()
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
        _check_loops(loops, links, mobility, space, higher, framed=framed)
        common = (links, mobility, space, placed, framed)
        one_by_one = [OneByOne("rings", *common, symmetry=order)]
        if fractionated and mobility > 1:
            one_by_one.append(OneByOne("fractionated", *common, symmetry=order))
        families = chain_families(links, mobility, space, higher, framed)
        return cls(title + (f" symmetry={order}" if order else ""), tuple(families), tuple(one_by_one), order)

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
        from graphsynth.structure.system.assortment import LinkAssortment
        from graphsynth.structure.system.spec import StructuralSpec

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
        one_by_one: list[OneByOne] = []
        for assortment in assortments:
            if assortment.mobility < 1:
                raise InfeasibleSpecError(
                    f"W = {assortment.mobility} must be at least 1 for a mechanism: fix W, or ask for Assur groups"
                )
            higher = tuple((i, count) for i, count in enumerate(assortment.p_i, 1) if i > 1 and count)
            numbers = assortment.loops, assortment.links, assortment.mobility, assortment.space
            _check_loops(*numbers, dict(higher), framed=True)
            families += mechanism_families(assortment, levels)
            common = (assortment.moving_links + 1, assortment.mobility, assortment.space, higher, True)
            if assortment.loops == 1:
                one_by_one.append(OneByOne("rings", *common, assortment, levels, order))
            if fractionated and assortment.mobility > 1:
                one_by_one.append(OneByOne("fractionated", *common, assortment, levels, order))
        title = question.describe() if isinstance(question, StructuralSpec) else str(question)
        title = " ".join(title.split()) + (f" symmetry={order}" if order else "")
        return cls(title, tuple(families), tuple(one_by_one), order)

    @classmethod
    def groups(cls, moving: int, space: int) -> Problem:
        """State the enumeration of Assur groups with a number of moving links.

        Raises `SpecError` for a number of links out of its bounds, `TooLargeError` for more loops than there are
        contracted graphs.
        """
        return cls.trusses(whole(moving, "moving links", 1, MOST_LINKS - 1) + 1, space, True)

    @classmethod
    def trusses(cls, links: int, space: int, framed: bool) -> Problem:
        """State the enumeration of Baranov trusses (of Assur groups, if ``framed``).

        Raises `SpecError` for a number of links out of its bounds, `TooLargeError` for more loops than there are
        contracted graphs.
        """
        links, _, space, _ = chain_numbers(links, 0, space, None, least=0)
        joints = chain_joints(links, 0, space, {})
        title = f"{'Assur groups, n=' + str(links - 1) if framed else 'Baranov trusses, N=' + str(links)} Pi={space}"
        if joints is None:
            return cls(title, (), reason=_reason(links, 0, space, {}))
        _check_loops(joints - links + 1, links, 0, space, {}, framed=framed)
        ring = OneByOne("rings", links, 0, space, (), framed)
        return cls(title, tuple(truss_families(links, space, framed)), (ring,))


@lru_cache(maxsize=4)
def _pieces(problem: Problem, listing: bool) -> tuple[Piece, ...]:
    return (*problem.one_by_one, *cut(problem.families, listing=listing, symmetry=problem.symmetry))


def _check_loops(loops: int, links: int, mobility: int, space: int, higher: Mapping[int, int], *, framed: bool) -> None:
    """Refuse at once what has more loops than there are contracted graphs for, with an estimate."""
    if not has_contracted_graphs(loops, links):
        from graphsynth.synthesis.outlook import refuse

        refuse(loops, links, mobility, space, higher, framed=framed)


def check_symmetry(symmetry: int | None) -> int:
    """Return the required order, 0 for none.

    Raises `SpecError` for an order that is not a small prime.
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


def _text(piece: Piece) -> tuple[bytes, int]:
    blocks = list(text_of_piece(piece))
    return b"".join(block for block, _ in blocks), sum(lines for _, lines in blocks)


def _packed(piece: Piece) -> list[MechanismGraph]:
    return list(graphs_of_piece(piece))


def counts(pieces: Iterable[Piece], executor: Executor | None) -> Iterator[int]:
    """Yield the number of graphs of each piece."""
    return in_order(executor, count_piece, pieces)


def texts(pieces: Iterable[Piece], executor: Executor | None) -> Iterator[tuple[bytes, int]]:
    """Yield each piece as (lines of the text form, number of lines)."""
    return in_order(executor, _text, pieces)


def graphs(pieces: Iterable[Piece], executor: Executor | None) -> Iterator[MechanismGraph]:
    """Yield the graphs of all pieces, in order."""
    return chain.from_iterable(
        map(graphs_of_piece, pieces) if executor is None else in_order(executor, _packed, pieces)
    )


def processes(workers: int) -> AbstractContextManager[Executor | None]:
    """Give a pool of worker processes, or None for one worker (then everything is done in this process).

    The kernels are compiled here first, so that the workers find them in the cache.  When the block is left by an
    exception (Ctrl-C), the workers are stopped at once; what was already written stays.
    """
    return processes_of(workers, _compile_kernels)


def _compile_kernels() -> None:
    smallest = Problem.chains(6, 1, 3, None, False, None)
    for piece in smallest.pieces(listing=False):
        count_piece(piece)
    for piece in smallest.pieces(listing=True):
        _text(piece)
