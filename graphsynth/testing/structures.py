"""Strategies for structure: any labelled graph, admissible kinematic chains, mechanisms, structural questions."""

from __future__ import annotations

from collections import Counter
from functools import cache
from typing import Any

from graphsynth.core.errors import SpecError
from graphsynth.structure.connectivity import components_of
from graphsynth.structure.graph import MechanismGraph
from graphsynth.structure.system.spec import StructuralSpec
from graphsynth.testing.extra import check_range, ready, st

#: Largest chains that are listed in a moment: 230 of one degree of freedom.
MOST_LINKS = 10
_SPACES = st.sampled_from((3, 2, 4, 5, 6))


#: Whole numbers between bounds, kept: making and checking a strategy takes longer than drawing from it.
_between = cache(st.integers)


@cache
def _pairs(links: int) -> st.SearchStrategy[list[tuple[int, int]]]:
    return st.lists(st.sampled_from([(a, b) for b in range(links) for a in range(b)]), unique=True)


@cache
def _frames(links: int) -> st.SearchStrategy[int | None]:
    return st.none() | _between(0, links - 1)


@st.composite
def _graphs(
    draw: st.DrawFn, sizes: st.SearchStrategy[int], spaces: st.SearchStrategy[int], connected: bool
) -> MechanismGraph:
    links, space = draw(sizes), draw(spaces)
    chosen = set(draw(_pairs(links))) if links > 1 else set()
    if connected:
        chosen |= {(draw(_between(0, b - 1)), b) for b in range(1, links)}
    joints = [(a, b, draw(_between(1, space - 1))) for a, b in sorted(chosen)]
    return MechanismGraph(links, joints, frame=draw(_frames(links)), space=space)


def graphs(
    min_links: int = 1, max_links: int = 12, *, space: int | None = None, connected: bool = False
) -> st.SearchStrategy[MechanismGraph]:
    """Any labelled graph: of one part or several, with or without joints, frame or none, joints of any mobility.

    For code that must take every graph.  For chains that move, see `chains`.

    Parameters
    ----------
    min_links, max_links : int
        Sizes, 1 to 60; others are a `SpecError`.
    space : int, optional
        Mobility of a free link, 2 to 6; any of them by default.
    connected : bool
        Only graphs of one part.

    Returns
    -------
    SearchStrategy
        Shrinks to a single link.

    Examples
    --------
    >>> from hypothesis import find
    >>> found = find(graphs(), lambda g: g.frame is not None and len(g.joints) > 0)
    >>> found.links, len(found.joints)
    (2, 1)
    """
    check_range("links", min_links, max_links, 1, 60)
    if space is not None and space not in range(2, 7):
        raise SpecError(f"space = {space!r}; the mobility of a free link is 2 to 6")
    spaces = _SPACES if space is None else st.just(space)
    return _graphs(st.integers(min_links, max_links), spaces, connected)


@cache
def _listed(links: int, mobility: int, fractionated: bool) -> tuple[MechanismGraph, ...]:
    from graphsynth.synthesis.api import enumerate_chains

    return tuple(enumerate_chains(links, mobility, fractionated=fractionated))


@st.composite
def _chains(
    draw: st.DrawFn, sizes: tuple[int, ...], mobility: int, fractionated: bool, relabel: bool
) -> MechanismGraph:
    chain = draw(st.sampled_from(_listed(draw(st.sampled_from(sizes)), mobility, fractionated)))
    return chain.relabelled(draw(st.permutations(range(chain.links)))) if relabel else chain


def chains(
    min_links: int = 4, max_links: int = 8, *, mobility: int = 1, fractionated: bool = False, relabel: bool = True
) -> st.SearchStrategy[MechanismGraph]:
    """Planar kinematic chains of simple revolute joints without rigid sub-chain: every one of them, with any labels.

    Parameters
    ----------
    min_links, max_links : int
        Sizes, 4 to 10; those of the wrong parity are left out, and nothing between them is a `SpecError`.
    mobility : int
        Degrees of freedom W, 1 to 4.
    fractionated : bool
        Also chains that a link or joint cuts into parts.
    relabel : bool
        Number the links at random; otherwise as the enumeration lists them.

    Returns
    -------
    SearchStrategy
        Shrinks to the first chain of the smallest size.  Exact: drawn from the complete list.

    Examples
    --------
    >>> from hypothesis import find
    >>> find(chains(), lambda c: c.links > 4).links
    6
    """
    check_range("links", min_links, max_links, 4, MOST_LINKS)
    if mobility not in range(1, 5):
        raise SpecError(f"mobility = {mobility!r}; chains of 1 to 4 degrees of freedom are drawn")
    sizes = tuple(n for n in range(min_links, max_links + 1) if (3 * (n - 1) - mobility) % 2 == 0 and n >= mobility + 3)
    if not sizes:
        raise SpecError(
            f"no chain of mobility {mobility} has {min_links} to {max_links} links; "
            f"give sizes from {mobility + 3}, every other one"
        )

    def prepared() -> st.SearchStrategy[MechanismGraph]:
        for links in sizes:  # listed before the first draw, which hypothesis times
            _listed(links, mobility, fractionated)
        return _chains(sizes, mobility, fractionated, relabel)

    return st.deferred(prepared)


@st.composite
def _mechanism_graphs(draw: st.DrawFn, of: st.SearchStrategy[MechanismGraph]) -> MechanismGraph:
    chain = draw(of)
    return MechanismGraph(chain.links, chain.joints, frame=draw(st.integers(0, chain.links - 1)), space=chain.space)


def mechanism_graphs(min_links: int = 4, max_links: int = 8, *, mobility: int = 1) -> st.SearchStrategy[MechanismGraph]:
    """Chains of `chains` with one link chosen as frame, any of them.

    Parameters
    ----------
    min_links, max_links, mobility
        As for `chains`.

    Returns
    -------
    hypothesis strategy
        Of `MechanismGraph`.

    Examples
    --------
    >>> from hypothesis import find
    >>> find(mechanism_graphs(), lambda g: g.degrees[g.frame] == 3).links
    6
    """
    of = chains(min_links, max_links, mobility=mobility)
    return st.deferred(lambda: _mechanism_graphs(ready(of)))


_FREE = ("p", "v", "v_ct", "v_P", "t0", "G", "n2", "n3", "n4", "p1")


def _values(graph: MechanismGraph) -> dict[str, int]:
    """Values of the variables of the structural system, counted on a graph with a frame."""
    frame = graph.frame
    degrees = Counter(d for link, d in enumerate(graph.degrees) if link != frame)
    touching = sum(frame in (a, b) for a, b, _ in graph.joints)
    parts = len(components_of(graph.neighbours, (1 << graph.links) - 1 - (1 << (frame or 0))))  # without the frame
    mobilities = Counter(joint.mobility for joint in graph.joints)
    loops = len(graph.joints) - graph.links + 1
    values = {"W": graph.mobility, "Pi": graph.space, "n": graph.links - 1, "p": len(graph.joints), "v": loops}
    values |= {"t0": touching, "v_ct": touching - parts, "v_P": loops - touching + parts, "G": graph.sub_edges}
    values |= {f"n{a}": degrees[a] for a in (2, 3, 4)} | {f"p{i}": mobilities[i] for i in (1, 2)}
    return values


@st.composite
def _specs(draw: st.DrawFn, of: st.SearchStrategy[MechanismGraph], feasible: bool) -> StructuralSpec:
    values = _values(draw(of))
    question: dict[str, Any] = {"W": values["W"], "n": values["n"], "p2": values["p2"]}
    for symbol in draw(st.sets(st.sampled_from(_FREE), max_size=5)):
        value = values[symbol]
        below, above = draw(st.tuples(st.integers(0, 3), st.integers(0, 3)))
        least = 1 if symbol in ("p", "t0") else 0
        low, high = max(least, value - below), value + above
        question[symbol] = draw(st.sampled_from((value, (low, high), (None, high), (low, None))))
    if not feasible:
        symbol = draw(st.sampled_from(_FREE))
        question[symbol] = values[symbol] + draw(st.integers(-1, 3)) if values[symbol] > 1 else values[symbol] + 1
    return StructuralSpec(**question)


def specs(min_links: int = 4, max_links: int = 8, *, feasible: bool = True) -> st.SearchStrategy[StructuralSpec]:
    """Structural questions: variables fixed, bounded on one or both sides, or free, around a mechanism that exists.

    Parameters
    ----------
    min_links, max_links : int
        Sizes of that mechanism, 4 to 10.
    feasible : bool
        True: the mechanism answers the question, so ``solve()`` is not empty.  False: one variable is then moved at
        random, so that questions without an answer occur too.

    Returns
    -------
    SearchStrategy
        Mobility, moving links and joints of mobility 2 are always given, so that the answers are finite.
    """
    check_range("links", min_links, max_links, 4, 10)
    of = mechanism_graphs(min_links, max_links)
    return st.deferred(lambda: _specs(ready(of), feasible))
