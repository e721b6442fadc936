"""Strategies for structural questions."""

from __future__ import annotations

from collections import Counter

from graphsynth.structure.graph import MechanismGraph
from graphsynth.structure.system.spec import StructuralSpec
from graphsynth.testing.strategies.extra import check_range, ready, st
from graphsynth.testing.strategies.graphs import mechanism_graphs

_FREE = ("p", "v", "v_ct", "v_P", "t0", "G", "n2", "n3", "n4", "p1")


def _values(graph: MechanismGraph) -> dict[str, int]:
    """Values of the variables of the structural system, counted on a graph with a frame."""
    frame = graph.frame
    degrees = Counter(d for link, d in enumerate(graph.degrees) if link != frame)
    touching = sum(frame in (a, b) for a, b, _ in graph.joints)
    kept = [(a, b) for a, b, _ in graph.joints if frame not in (a, b)]
    parts = _parts(graph.links, kept) - 1  # the frame counts as a part of its own
    mobilities = Counter(joint.mobility for joint in graph.joints)
    loops = len(graph.joints) - graph.links + 1
    values = {"W": graph.mobility, "Pi": graph.space, "n": graph.links - 1, "p": len(graph.joints), "v": loops}
    values |= {"t0": touching, "v_ct": touching - parts, "v_P": loops - touching + parts, "G": graph.sub_edges}
    values |= {f"n{a}": degrees[a] for a in (2, 3, 4)} | {f"p{i}": mobilities[i] for i in (1, 2)}
    return values


def _parts(links: int, joints: list[tuple[int, int]]) -> int:
    leader = list(range(links))

    def root(link: int) -> int:
        while leader[link] != link:
            link = leader[link]
        return link

    for a, b in joints:
        leader[root(a)] = root(b)
    return sum(leader[link] == link for link in range(links))


@st.composite
def _specs(draw: st.DrawFn, of: st.SearchStrategy[MechanismGraph], feasible: bool) -> StructuralSpec:
    values = _values(draw(of))
    question: dict[str, int | tuple[int | None, int | None]] = {"W": values["W"], "n": values["n"], "p2": values["p2"]}
    for symbol in draw(st.sets(st.sampled_from(_FREE), max_size=5)):
        value = values[symbol]
        below, above = draw(st.tuples(st.integers(0, 3), st.integers(0, 3)))
        least = 1 if symbol in ("p", "t0") else 0
        low, high = max(least, value - below), value + above
        kind = draw(st.sampled_from(("fixed", "between", "most", "least")))
        bounds: dict[str, tuple[int | None, int | None]] = {
            "between": (low, high),
            "most": (None, high),
            "least": (low, None),
        }
        question[symbol] = bounds.get(kind, value)
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

    Raises
    ------
    SpecError
        Sizes out of range.

    Examples
    --------
    >>> from hypothesis import given, settings
    >>> @settings(max_examples=5)
    ... @given(specs())
    ... def a_mechanism_answers_it(spec):
    ...     assert spec.solve()
    >>> a_mechanism_answers_it()
    """
    check_range("links", min_links, max_links, 4, 10)
    of = mechanism_graphs(min_links, max_links)
    return st.deferred(lambda: _specs(ready(of), feasible))
