"""Chains with prismatic joints: the public functions."""

from __future__ import annotations

from concurrent.futures import Executor
from typing import TypedDict, Unpack

from graphsynth.core.errors import SpecError
from graphsynth.structure.slider_chains import SliderChain
from graphsynth.synthesis.api import Graphs
from graphsynth.synthesis.problem import EnumerationProblem, counted, listed
from graphsynth.synthesis.wishes import Wishes


class _Rules(TypedDict, total=False):
    sliding_links: bool
    sliding_loops: bool
    cylinders: bool


def enumerate_slider_chains(
    links: int,
    sliders: int,
    mobility: int = 1,
    *,
    framed: bool = False,
    wishes: Wishes | None = None,
    executor: Executor | None = None,
    **rules: Unpack[_Rules],
) -> Graphs[SliderChain]:
    """Enumerate planar chains with revolute and prismatic joints: every one, each once (exact).

    None has a rigid sub-chain by the structural formula, none is fractionated.

    Parameters
    ----------
    links : int
        Number of links N.
    sliders : int
        Number of prismatic joints, 1 or more.
    mobility : int
        Mobility W >= 1.
    framed : bool
        Choose a frame in all ways that differ: mechanisms instead of chains.
    wishes : Wishes, optional
        What the chains are to be like as a whole, as for `enumerate_chains`; all joints count alike.
    executor : concurrent.futures.Executor, optional
        Who does the work; the result is the same for any.  Default: this process.
    rules : bool
        ``sliding_links``: allow links all of whose joints are prismatic (the two blocks of an elliptic trammel have one
        of each, the cross of an Oldham coupling has prismatic ones only).  ``sliding_loops``: allow loops with fewer
        than two revolute joints, in which nothing turns.  ``cylinders``: every prismatic joint is that of a cylinder:
        it joins two binary links, each with a revolute joint besides.  All are False by default.

    Yields
    ------
    SliderChain
        In a fixed order; a frame is link 0.

    Raises
    ------
    SpecError
        For a value out of its bounds.
    TooLargeError
        For more loops than there are contracted graphs for, at once.

    References
    ----------
    docs/explanation/sliders.md.

    Examples
    --------
    >>> [chain.to_text() for chain in enumerate_slider_chains(4, 1, framed=True)]
    ['Cl f0 P:0-3', 'Cl f0 P:2-3']
    """
    problem = _problem((links, sliders, mobility), rules, framed, wishes)
    return Graphs(f"chains with prismatic joints, {problem.title}", lambda: listed(problem, executor))


def count_slider_chains(
    links: int,
    sliders: int,
    mobility: int = 1,
    *,
    framed: bool = False,
    wishes: Wishes | None = None,
    executor: Executor | None = None,
    **rules: Unpack[_Rules],
) -> int:
    """Count what ``enumerate_slider_chains`` yields, without making the chains (exact).

    Parameters
    ----------
    links, sliders, mobility, framed, wishes, executor, rules
        As for `enumerate_slider_chains`; with wishes that the search does not take over, chains are made and counted.

    Returns
    -------
    int

    Examples
    --------
    >>> [count_slider_chains(8, number, sliding_loops=True) for number in (1, 2, 3)]
    [84, 307, 574]
    """
    return counted(_problem((links, sliders, mobility), rules, framed, wishes), executor)


def sample_slider_chains(
    links: int,
    sliders: int,
    mobility: int = 1,
    *,
    k: int,
    seed: int,
    framed: bool = False,
    wishes: Wishes | None = None,
    **rules: Unpack[_Rules],
) -> list[SliderChain]:
    """Draw k of what ``enumerate_slider_chains`` yields, independently and exactly uniformly, without a list.

    Parameters
    ----------
    links, sliders, mobility, framed, wishes
        As for `enumerate_slider_chains`.
    k, seed : int
        As for `sample_mechanisms`.
    rules : bool
        As for `enumerate_slider_chains`.

    Returns
    -------
    list of SliderChain
        Of length ``k``.

    Raises
    ------
    InfeasibleSpecError
        If there is nothing to draw from; else as for `enumerate_slider_chains`.

    Examples
    --------
    >>> len(sample_slider_chains(12, 3, k=2, seed=1))
    2
    """
    from graphsynth.synthesis.sampling import sample

    return sample(_problem((links, sliders, mobility), rules, framed, wishes), k, seed)


def _problem(numbers: tuple[int, int, int], rules: _Rules, framed: bool, wishes: Wishes | None) -> EnumerationProblem:
    names = ("sliding_links", "sliding_loops", "cylinders")
    if unknown := set(rules) - set(names):
        raise SpecError(f"{min(unknown)} is no rule of prismatic joints: the rules are {', '.join(names)}")
    given = rules.get("sliding_links", False), rules.get("sliding_loops", False), rules.get("cylinders", False)
    return EnumerationProblem.sliders(*numbers, *given, framed).wishing(wishes)
