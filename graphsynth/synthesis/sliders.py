"""Chains with prismatic joints: the public functions."""

from __future__ import annotations

from concurrent.futures import Executor

from graphsynth.core.errors import SpecError
from graphsynth.structure.slider_chains import SliderChain
from graphsynth.synthesis.api import Graphs
from graphsynth.synthesis.problem import EnumerationProblem, counted, graphs


def enumerate_slider_chains(
    links: int,
    sliders: int,
    mobility: int = 1,
    *,
    sliding_links: bool = False,
    sliding_loops: bool = False,
    cylinders: bool = False,
    framed: bool = False,
    executor: Executor | None = None,
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
    sliding_links : bool
        Allow links all of whose joints are prismatic (the two blocks of an elliptic trammel have one of each, the
        cross of an Oldham coupling has prismatic ones only).
    sliding_loops : bool
        Allow loops with fewer than two revolute joints, in which nothing turns.
    cylinders : bool
        Every prismatic joint is that of a cylinder: it joins two binary links, each with a revolute joint besides.
    framed : bool
        Choose a frame in all ways that differ: mechanisms instead of chains.
    executor : concurrent.futures.Executor, optional
        Who does the work; the result is the same for any.  Default: this process.

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
    given = links, sliders, mobility, sliding_links, sliding_loops, cylinders, framed
    problem = EnumerationProblem.sliders(*given)
    items = problem.work_items(listing=True)
    return Graphs(f"chains with prismatic joints, {problem.title}", lambda: map(SliderChain, graphs(items, executor)))


def count_slider_chains(
    links: int,
    sliders: int,
    mobility: int = 1,
    *,
    sliding_links: bool = False,
    sliding_loops: bool = False,
    cylinders: bool = False,
    framed: bool = False,
    executor: Executor | None = None,
) -> int:
    """Count what ``enumerate_slider_chains`` yields, without making the chains (exact).

    Parameters
    ----------
    links, sliders, mobility, sliding_links, sliding_loops, cylinders, framed, executor
        As for `enumerate_slider_chains`.

    Returns
    -------
    int

    Examples
    --------
    >>> [count_slider_chains(8, number, sliding_loops=True) for number in (1, 2, 3)]
    [84, 307, 574]
    """
    given = links, sliders, mobility, sliding_links, sliding_loops, cylinders, framed
    return counted(EnumerationProblem.sliders(*given), executor)


def sample_slider_chains(
    links: int, sliders: int, mobility: int = 1, *, k: int, seed: int, framed: bool = False, **rules: bool
) -> list[SliderChain]:
    """Draw k of what ``enumerate_slider_chains`` yields, independently and exactly uniformly, without a list.

    Parameters
    ----------
    links, sliders, mobility, framed
        As for `enumerate_slider_chains`.
    k, seed : int
        As for `sample_mechanisms`.
    rules : bool
        ``sliding_links``, ``sliding_loops`` and ``cylinders``, as for `enumerate_slider_chains`.

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

    names = ("sliding_links", "sliding_loops", "cylinders")
    if unknown := set(rules) - set(names):
        raise SpecError(f"{min(unknown)} is no rule of prismatic joints: the rules are {', '.join(names)}")
    links_slide, loops_slide, cylinders = (rules.get(name, False) for name in names)
    given = links, sliders, mobility, links_slide, loops_slide, cylinders, framed
    return list(map(SliderChain, sample(EnumerationProblem.sliders(*given), k, seed)))
