"""The public functions of the enumerator."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from concurrent.futures import Executor
from html import escape
from itertools import islice
from typing import TYPE_CHECKING, Protocol, TypeVar, overload

from graphsynth.core.errors import GraphError
from graphsynth.synthesis.problem import EnumerationProblem, counted, graphs

if TYPE_CHECKING:
    from graphsynth.structure.graph import MechanismGraph
    from graphsynth.structure.system.assortment import LinkAssortment
    from graphsynth.structure.system.spec import StructuralSpec
    from graphsynth.synthesis.wishes import Wishes

T = TypeVar("T", bound="Drawn")

#: Graphs shown in a notebook.
_SHOWN = 12


class Drawn(Protocol):
    """What shows itself as a picture."""

    def _repr_svg_(self) -> str: ...


class Graphs(Iterator[T]):
    """Graphs of an enumeration, made one after the other; or chains with other joints, or gear trains.

    An iterator like any other; ``graphs[3]`` and ``graphs[2:5]`` enumerate anew up to there, whatever was taken from
    it, and a notebook shows the first twelve.

    Examples
    --------
    >>> from graphsynth import enumerate_chains
    >>> chains = enumerate_chains(6)
    >>> chains[1].graph6(), len(list(chains)), chains
    ('E]`G', 2, Graphs: chains of 6 links, mobility 1; list(...) makes them all, [k] one of them)
    """

    def __init__(self, what: str, make: Callable[[], Iterator[T]]) -> None:
        self._what, self._make, self._graphs = what, make, make()

    def __next__(self) -> T:
        return next(self._graphs)

    @overload
    def __getitem__(self, k: int) -> T: ...
    @overload
    def __getitem__(self, k: slice) -> list[T]: ...
    def __getitem__(self, k: int | slice) -> T | list[T]:
        if isinstance(k, slice):
            return list(islice(self._make(), k.start, k.stop, k.step))
        if k < 0:
            raise GraphError(f"graph {k}: the graphs are counted from the first, 0; make a list to count from the last")
        found = next(islice(self._make(), k, None), None)
        if found is None:
            raise IndexError(f"graph {k} does not exist; there are fewer {self._what}")
        return found

    def __repr__(self) -> str:
        return f"Graphs: {self._what}; list(...) makes them all, [k] one of them"

    def _repr_html_(self) -> str:
        first = list(islice(self._make(), _SHOWN + 1))
        pictures = "".join(
            f"<figure style='display:inline-block'>{graph._repr_svg_()}<figcaption>{k}</figcaption></figure>"
            for k, graph in enumerate(first[:_SHOWN])
        )
        more = "<p>and more</p>" if len(first) > _SHOWN else ""
        return f"<p>{escape(self._what)}</p>{pictures}{more}"


def _list(what: str, problem: EnumerationProblem, executor: Executor | None) -> Graphs[MechanismGraph]:
    return Graphs(what, lambda: graphs(problem.work_items(listing=True), executor))


def enumerate_chains(
    links: int,
    mobility: int = 1,
    *,
    space: int = 3,
    joints_by_mobility: Mapping[int, int] | None = None,
    fractionated: bool = False,
    symmetry: int | None = None,
    wishes: Wishes | None = None,
    executor: Executor | None = None,
) -> Graphs[MechanismGraph]:
    """Enumerate kinematic chains: every one, each once up to isomorphism, none with a rigid sub-chain (exact).

    Parameters
    ----------
    links : int
        Number of links N.
    mobility : int
        Mobility W >= 1.
    space : int
        Mobility Pi of the space, 2..6; 3 is the plane.
    joints_by_mobility : mapping, optional
        ``{i: p_i}`` for i >= 2; p_1 follows from the structural formula.  Default: mobility-1 joints only.
    fractionated : bool
        For W >= 2: include chains that one link or joint holds together.
    symmetry : int, optional
        Only chains with an automorphism of this prime order.
    wishes : Wishes, optional
        What the chains are to be like as a whole: girth, links side by side, sub-graphs, planarity, type of mobility.
    executor : concurrent.futures.Executor, optional
        Who does the work; the result is the same for any.  Default: this process.

    Yields
    ------
    MechanismGraph
        In a fixed order; links with three or more joints come first.  Memory does not grow with their number.

    Raises
    ------
    SpecError
        For a value out of its bounds.
    TooLargeError
        For more loops than the shipped contracted graphs have (8), at once.

    References
    ----------
    docs/explanation/enumeration.md; counts: OEIS A233288 (W = 1).

    Examples
    --------
    >>> [chain.graph6() for chain in enumerate_chains(6)]
    ['Er`G', 'E]`G']
    """
    problem = EnumerationProblem.chains(links, mobility, space, joints_by_mobility, fractionated, symmetry)
    return _list(f"chains of {links} links, mobility {mobility}", problem.wishing(wishes), executor)


def count_chains(
    links: int,
    mobility: int = 1,
    *,
    space: int = 3,
    joints_by_mobility: Mapping[int, int] | None = None,
    fractionated: bool = False,
    symmetry: int | None = None,
    wishes: Wishes | None = None,
    executor: Executor | None = None,
) -> int:
    """Count what ``enumerate_chains`` yields, without making the graphs (exact).

    Parameters
    ----------
    links, mobility, space, joints_by_mobility, fractionated, symmetry, wishes, executor
        As for `enumerate_chains`; chains with wishes that the search does not take over are made and counted.

    Returns
    -------
    int

    Raises
    ------
    TooLargeError
        As for `enumerate_chains`, and for more than 2**62 chains of one contracted graph.

    Examples
    --------
    >>> [count_chains(n) for n in (4, 6, 8, 10, 12, 14)]
    [1, 2, 16, 230, 6856, 318162]
    """
    asked = links, mobility, space, joints_by_mobility, fractionated, symmetry
    return counted(EnumerationProblem.chains(*asked, counted=wishes is None).wishing(wishes), executor)


def sample_chains(
    links: int,
    mobility: int = 1,
    *,
    k: int,
    seed: int,
    space: int = 3,
    joints_by_mobility: Mapping[int, int] | None = None,
    fractionated: bool = False,
    wishes: Wishes | None = None,
) -> list[MechanismGraph]:
    """Draw k of what ``enumerate_chains`` yields, independently and exactly uniformly, without a list.

    Parameters
    ----------
    links, mobility, space, joints_by_mobility, fractionated, wishes
        As for `enumerate_chains`; fractionated chains are listed, to be drawn; what is not as wished is drawn again.
    k, seed : int
        As for `sample_mechanisms`.

    Returns
    -------
    list of MechanismGraph
        Of length ``k``.

    Raises
    ------
    InfeasibleSpecError
        If there is nothing to draw from; else as for `enumerate_chains`.
    SpecError
        If ten thousand draws in a row are not as wished; else as for `enumerate_chains`.

    Examples
    --------
    >>> [chain.mobility for chain in sample_chains(12, k=2, seed=1)]
    [1, 1]
    """
    from graphsynth.synthesis.sampling import sample

    asked = links, mobility, space, joints_by_mobility, fractionated, None
    return sample(EnumerationProblem.chains(*asked).wishing(wishes), k, seed)


def enumerate_mechanisms(
    spec: StructuralSpec | LinkAssortment,
    *,
    symmetry: int | None = None,
    wishes: Wishes | None = None,
    executor: Executor | None = None,
) -> Graphs[MechanismGraph]:
    """Enumerate the mechanisms that answer a structural question: every one, each once (exact).

    Parameters
    ----------
    spec : StructuralSpec or LinkAssortment
        The question, or one of its integer solutions.
    symmetry : int, optional
        Only mechanisms with an automorphism of this prime order (the frame stays where it is).
    wishes : Wishes, optional
        What the mechanisms are to be like as a whole, as for `enumerate_chains`.
    executor : concurrent.futures.Executor, optional
        Who does the work; the result is the same for any.  Default: this process.

    Yields
    ------
    MechanismGraph
        With the frame at link 0 and the links numbered level by level.

    Raises
    ------
    InfeasibleSpecError, SpecError, TooLargeError
        When the question has no answer, is ill posed, or cannot finish.

    Examples
    --------
    >>> from graphsynth import StructuralSpec
    >>> sum(1 for _ in enumerate_mechanisms(StructuralSpec(W=1, links=8)))
    71
    """
    problem = EnumerationProblem.mechanisms(spec, symmetry).wishing(wishes)
    return _list("mechanisms that answer the question", problem, executor)


def count_mechanisms(
    spec: StructuralSpec | LinkAssortment,
    *,
    symmetry: int | None = None,
    wishes: Wishes | None = None,
    executor: Executor | None = None,
) -> int:
    """Count what ``enumerate_mechanisms`` yields, without making the graphs (exact).

    With a required symmetry, wanted sizes of levels, or wishes that the search does not take over, the mechanisms are
    made and counted.

    Parameters
    ----------
    spec, symmetry, wishes, executor
        As for `enumerate_mechanisms`.

    Returns
    -------
    int

    Examples
    --------
    >>> from graphsynth import StructuralSpec
    >>> count_mechanisms(StructuralSpec(W=1, Pi=3, v_ct=6, p=22, p2=3, n=14, t0=7, n4=4))
    9663907
    """
    return counted(EnumerationProblem.mechanisms(spec, symmetry).wishing(wishes), executor)


def sample_mechanisms(
    spec: StructuralSpec | LinkAssortment, k: int, seed: int, *, wishes: Wishes | None = None
) -> list[MechanismGraph]:
    """Draw k mechanisms independently and exactly uniformly from all that answer a structural question.

    Parameters
    ----------
    spec : StructuralSpec or LinkAssortment
        The question; wanted levels are not supported here.
    k : int
        Number of draws (with replacement).
    seed : int
        Seed of ``random.Random``; the same seed gives the same draws.
    wishes : Wishes, optional
        As for `enumerate_chains`; what is not as wished is drawn again.

    Returns
    -------
    list of MechanismGraph
        Of length ``k``.

    Raises
    ------
    SpecError
        For a number of draws or a seed that is none, or ten thousand draws in a row that are not as wished; else as for
        `enumerate_mechanisms`.

    Examples
    --------
    >>> from graphsynth import StructuralSpec
    >>> len(sample_mechanisms(StructuralSpec(W=1, links=10), 5, seed=1))
    5
    """
    from graphsynth.synthesis.sampling import sample

    return sample(EnumerationProblem.mechanisms(spec, None).wishing(wishes), k, seed)


def enumerate_assur_groups(links: int, *, space: int = 3, executor: Executor | None = None) -> Graphs[MechanismGraph]:
    """Enumerate the Assur groups with n moving links and mobility-1 joints, each once (exact).

    The group is given with the frame, contracted to one link, as link 0.

    Parameters
    ----------
    links : int
        Number of moving links.
    space, executor
        As for `enumerate_chains`.

    Returns
    -------
    iterator of MechanismGraph

    Examples
    --------
    >>> [group.to_text() for group in enumerate_assur_groups(2)]
    ['Bw f0']
    """
    return _list(f"Assur groups of {links} links", EnumerationProblem.groups(links, space), executor)


def count_assur_groups(links: int, *, space: int = 3, executor: Executor | None = None) -> int:
    """Count what ``enumerate_assur_groups`` yields (exact).

    Parameters
    ----------
    links, space, executor
        As for `enumerate_assur_groups`.

    Returns
    -------
    int

    Examples
    --------
    >>> [count_assur_groups(n) for n in (2, 4, 6, 8, 10)]
    [1, 2, 10, 173, 5438]
    """
    return counted(EnumerationProblem.groups(links, space), executor)


def enumerate_baranov_trusses(
    links: int, *, space: int = 3, executor: Executor | None = None
) -> Graphs[MechanismGraph]:
    """Enumerate the Baranov trusses with N links and mobility-1 joints, each once (exact).

    Parameters
    ----------
    links : int
        Number of links.
    space, executor
        As for `enumerate_chains`.

    Returns
    -------
    iterator of MechanismGraph

    Examples
    --------
    >>> sum(1 for _ in enumerate_baranov_trusses(9))
    28
    """
    return _list(f"Baranov trusses of {links} links", EnumerationProblem.trusses(links, space, False), executor)


def count_baranov_trusses(links: int, *, space: int = 3, executor: Executor | None = None) -> int:
    """Count what ``enumerate_baranov_trusses`` yields (exact).

    Parameters
    ----------
    links, space, executor
        As for `enumerate_baranov_trusses`.

    Returns
    -------
    int

    Examples
    --------
    >>> [count_baranov_trusses(n) for n in (3, 5, 7, 9, 11)]
    [1, 1, 3, 28, 562]
    """
    return counted(EnumerationProblem.trusses(links, space, False), executor)
