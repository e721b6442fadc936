"""Planetary gear trains: the public functions."""

from __future__ import annotations

from concurrent.futures import Executor

from graphsynth.structure.gear_trains import PlanetaryGearTrain
from graphsynth.synthesis.api import Graphs
from graphsynth.synthesis.problem import EnumerationProblem, counted, listed


def enumerate_planetary_gear_trains(
    links: int,
    mobility: int = 1,
    *,
    rotation: bool = False,
    framed: bool = False,
    drive: str | None = None,
    executor: Executor | None = None,
) -> Graphs[PlanetaryGearTrain]:
    """Enumerate planetary gear trains: every one, each once, none with a locked sub-chain, none fractionated (exact).

    A train of N links and mobility W has N - 1 turning joints, which make a tree of links and axes, and N - 1 - W gear
    pairs, each with one carrier; any set of k links has at most k - 2 gear pairs whose carriers are among them.  Trains
    differ when their displacement graphs do: the links on each axis, the gear pairs.

    Parameters
    ----------
    links : int
        Number of links N, 3 to 11.
    mobility : int
        Mobility W >= 1.
    rotation : bool
        Only one train of each rotation graph: of those with the same gear pairs and carriers, and so with the same
        equations of angular velocities, the one with the most axes.
    framed : bool
        Choose a fixed link in all ways that differ; it is link 0.
    drive : str, optional
        Choose input and output, too, which turn about axes of the fixed link: in all ways that differ ("any"), or on
        one axis with it ("coaxial"); they are links 1 and 2.  For mobility 1, without ``rotation``.
    executor : concurrent.futures.Executor, optional
        Who does the work; the result is the same for any.  Default: this process.

    Yields
    ------
    PlanetaryGearTrain
        In a fixed order.

    Raises
    ------
    SpecError
        For a value out of its bounds, or a drive that cannot be chosen.
    TooLargeError
        For more than eleven links, at once.

    References
    ----------
    docs/explanation/gear-trains.md.

    Examples
    --------
    >>> [train.to_text() for train in enumerate_planetary_gear_trains(4)]
    ['C~ G:1-3,2-3', 'C} G:1-2,1-3', 'C} G:0-3,1-2']
    """
    problem = EnumerationProblem.gear_trains(links, mobility, rotation=rotation, framed=framed, drive=drive)
    return Graphs(problem.title, lambda: listed(problem, executor))


def count_planetary_gear_trains(
    links: int,
    mobility: int = 1,
    *,
    rotation: bool = False,
    framed: bool = False,
    drive: str | None = None,
    executor: Executor | None = None,
) -> int:
    """Count what ``enumerate_planetary_gear_trains`` yields (exact).

    Parameters
    ----------
    links, mobility, rotation, framed, drive, executor
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
    >>> [count_planetary_gear_trains(links, 2, rotation=True) for links in (6, 7)]
    [2, 20]
    """
    problem = EnumerationProblem.gear_trains(links, mobility, rotation=rotation, framed=framed, drive=drive)
    return counted(problem, executor)


def sample_planetary_gear_trains(
    links: int,
    mobility: int = 1,
    *,
    k: int,
    seed: int,
    rotation: bool = False,
    framed: bool = False,
    drive: str | None = None,
) -> list[PlanetaryGearTrain]:
    """Draw k of what ``enumerate_planetary_gear_trains`` yields, independently and exactly uniformly, without a list.

    Parameters
    ----------
    links, mobility, rotation, framed, drive
        As for `enumerate_planetary_gear_trains`.
    k, seed : int
        As for `sample_mechanisms`.

    Returns
    -------
    list of PlanetaryGearTrain
        Of length ``k``.

    Raises
    ------
    InfeasibleSpecError
        If there is nothing to draw from; else as for `enumerate_planetary_gear_trains`.

    Examples
    --------
    >>> [train.mobility for train in sample_planetary_gear_trains(8, k=2, seed=1)]
    [1, 1]
    """
    from graphsynth.synthesis.sampling import sample

    problem = EnumerationProblem.gear_trains(links, mobility, rotation=rotation, framed=framed, drive=drive)
    return sample(problem, k, seed)
