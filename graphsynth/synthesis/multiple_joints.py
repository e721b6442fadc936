"""Chains with multiple joints: the public functions."""

from __future__ import annotations

from concurrent.futures import Executor

from graphsynth.structure.multiple_joints import MultipleJointChain
from graphsynth.synthesis.api import Graphs
from graphsynth.synthesis.problem import EnumerationProblem, counted, listed
from graphsynth.synthesis.wishes import Wishes


def enumerate_multiple_joint_chains(
    links: int,
    mobility: int = 1,
    *,
    multiple: int | None = None,
    framed: bool = False,
    wishes: Wishes | None = None,
    executor: Executor | None = None,
) -> Graphs[MultipleJointChain]:
    """Enumerate planar chains with multiple joints: every one, each once, none with a rigid sub-chain (exact).

    Revolute joints; three links or more on a multiple joint, two on every other.  No chain is fractionated: neither a
    link nor a joint holds it together.

    Parameters
    ----------
    links : int
        Number of links N.
    mobility : int
        Mobility W >= 1.
    multiple : int, optional
        Number of multiple joints.  Default: all chains with one or more.
    framed : bool
        Choose a frame in all ways that differ: mechanisms instead of chains.
    wishes : Wishes, optional
        What the chains are to be like as a whole, as for `enumerate_chains`.
    executor : concurrent.futures.Executor, optional
        Who does the work; the result is the same for any.  Default: this process.

    Yields
    ------
    MultipleJointChain
        In a fixed order; a frame is link 0.

    Raises
    ------
    SpecError
        For a value out of its bounds.
    TooLargeError
        For more than seven loops, at once.

    References
    ----------
    docs/explanation/multiple-joints.md.

    Examples
    --------
    >>> [chain.joints[-1] for chain in enumerate_multiple_joint_chains(6, multiple=1)]
    [(1, 3, 5)]
    """
    problem = EnumerationProblem.multiple_joints(links, mobility, multiple, framed=framed).wishing(wishes)
    return Graphs(f"chains with multiple joints, {problem.title}", lambda: listed(problem, executor))


def count_multiple_joint_chains(
    links: int,
    mobility: int = 1,
    *,
    multiple: int | None = None,
    framed: bool = False,
    wishes: Wishes | None = None,
    executor: Executor | None = None,
) -> int:
    """Count what ``enumerate_multiple_joint_chains`` yields, without making the chains (exact).

    Parameters
    ----------
    links, mobility, multiple, framed, wishes, executor
        As for `enumerate_multiple_joint_chains`; with wishes, chains are made and counted.

    Returns
    -------
    int

    Examples
    --------
    >>> [count_multiple_joint_chains(8, multiple=number) for number in (1, 2, 3, 4)]
    [22, 18, 3, 1]
    """
    return counted(
        EnumerationProblem.multiple_joints(links, mobility, multiple, framed=framed).wishing(wishes), executor
    )


def sample_multiple_joint_chains(
    links: int,
    mobility: int = 1,
    *,
    k: int,
    seed: int,
    multiple: int | None = None,
    framed: bool = False,
    wishes: Wishes | None = None,
) -> list[MultipleJointChain]:
    """Draw k of what ``enumerate_multiple_joint_chains`` yields, independently and exactly uniformly, without a list.

    Parameters
    ----------
    links, mobility, multiple, framed, wishes
        As for `enumerate_multiple_joint_chains`.
    k, seed : int
        As for `sample_mechanisms`.

    Returns
    -------
    list of MultipleJointChain
        Of length ``k``.

    Raises
    ------
    InfeasibleSpecError
        If there is nothing to draw from; else as for `enumerate_multiple_joint_chains`.

    Examples
    --------
    >>> [chain.mobility for chain in sample_multiple_joint_chains(10, k=2, seed=1)]
    [1, 1]
    """
    from graphsynth.synthesis.sampling import sample

    return sample(EnumerationProblem.multiple_joints(links, mobility, multiple, framed=framed).wishing(wishes), k, seed)
