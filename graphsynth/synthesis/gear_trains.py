"""Planetary gear trains: the public functions."""

from __future__ import annotations

from collections.abc import Iterator
from concurrent.futures import Executor

from graphsynth.structure.gear_trains import PlanetaryGearTrain
from graphsynth.synthesis.problem import EnumerationProblem, counted, graphs


def enumerate_planetary_gear_trains(
    links: int, *, rotation: bool = False, executor: Executor | None = None
) -> Iterator[PlanetaryGearTrain]:
    """Enumerate planetary gear trains of one freedom: every one, each once, none with a locked sub-chain (exact).

    A train of N links has N - 1 turning joints, which make a tree of links and axes, and N - 2 gear pairs, each with
    one carrier; any set of k links has at most k - 2 gear pairs whose carriers are among them.  Trains differ when
    their displacement graphs do: the links on each axis, the gear pairs.  No link is fixed.

    Parameters
    ----------
    links : int
        Number of links N, 3 to 10.
    rotation : bool
        Only one train of each rotation graph: of those with the same gear pairs and carriers, and so with the same
        equations of angular velocities, the one with the most axes.
    executor : concurrent.futures.Executor, optional
        Who does the work; the result is the same for any.  Default: this process.

    Yields
    ------
    PlanetaryGearTrain
        In a fixed order.

    Raises
    ------
    SpecError
        For a number of links below 3, or none.
    TooLargeError
        For more than ten links, at once.

    References
    ----------
    docs/explanation/gear-trains.md.

    Examples
    --------
    >>> [train.to_text() for train in enumerate_planetary_gear_trains(4)]
    ['C~ G:1-3,2-3', 'C} G:1-2,1-3', 'C} G:0-3,1-2']
    """
    problem = EnumerationProblem.gear_trains(links, rotation)
    return map(PlanetaryGearTrain, graphs(problem.work_items(listing=True), executor))


def count_planetary_gear_trains(links: int, *, rotation: bool = False, executor: Executor | None = None) -> int:
    """Count what ``enumerate_planetary_gear_trains`` yields (exact).

    Parameters
    ----------
    links, rotation, executor
        As for `enumerate_planetary_gear_trains`.

    Returns
    -------
    int

    Examples
    --------
    >>> [count_planetary_gear_trains(links) for links in (4, 5, 6, 7)]
    [3, 13, 81, 647]
    >>> [count_planetary_gear_trains(links, rotation=True) for links in (4, 5, 6, 7)]
    [2, 6, 27, 152]
    """
    return counted(EnumerationProblem.gear_trains(links, rotation), executor)
