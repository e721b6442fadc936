"""All four-bars whose coupler draws a path through given points (Alt's problem), each root proved."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from graphsynth.core.checks import whole
from graphsynth.core.shown import Shown
from graphsynth.design.nine_points.following import shipped, solve
from graphsynth.design.nine_points.linkages import PathLinkage, linkages
from graphsynth.design.nine_points.proof import ProvedRoots
from graphsynth.design.nine_points.task import Complex, read_task


@dataclass(frozen=True, eq=False, repr=False)
class NinePointSolutions(Shown):
    """Four-bars through given points; cognates, which draw the same path, count once.

    Attributes
    ----------
    points, pivots : ndarray of complex
        What was given.
    unit : float
        Length of the unit in which the roots count from the first point.
    roots : ProvedRoots
        Roots, real and complex, one of each triple of cognates, and what is proved of them.
    expected : int
        How many there are for points in general position.
    linkages : tuple of PathLinkage
        A four-bar for every real root, of its cognates the best: those first that pass all points on one branch and
        in order.
    paths : int
        Number of paths followed.
    """

    points: Complex
    pivots: Complex
    unit: float
    roots: ProvedRoots
    expected: int
    linkages: tuple[PathLinkage, ...]
    paths: int

    @property
    def certified(self) -> int:
        """How many different triples of cognates are proved to exist."""
        return int(self.roots.distinct.sum())

    @property
    def complete(self) -> bool:
        """Whether as many are proved as there are in general, each of them real or not (theory/nine-points 4)."""
        decided = self.roots.distinct & (self.roots.real | self.roots.complex)
        return int(decided.sum()) == self.expected

    @property
    def without_defects(self) -> tuple[PathLinkage, ...]:
        """Linkages that pass all points on one branch and in order."""
        return tuple(linkage for linkage in self.linkages if linkage.one_branch and linkage.in_order)

    def _told(self) -> tuple[str, list[tuple[str, str]]]:
        given = f" and {len(self.pivots)} given pivots" if len(self.pivots) else ""
        title = f"four-bars through {len(self.points)} points{given}: {self.certified} of {self.expected} certified"
        one = sum(linkage.one_branch for linkage in self.linkages)
        rows = [("real", str(len(self.linkages))), ("on one branch", str(one))]
        rows += [("and in order", str(len(self.without_defects)))]
        return title, rows + [
            (f"linkages[{k}]", repr(one).partition("\n")[0]) for k, one in enumerate(self.linkages[:3])
        ]


def four_bars_through(points: Any, pivots: Any = (), *, seed: int = 0) -> NinePointSolutions:
    """Find every four-bar whose coupler has a point that passes through the given points.

    Parameters
    ----------
    points : sequence of complex or of (x, y)
        Nine points; seven with one given pivot; five with two.
    pivots : sequence of complex or of (x, y), optional
        Joints on the frame that are given.
    seed : int, optional
        Chooses the paths in the space of complex points; it changes the work, not the result.

    Returns
    -------
    NinePointSolutions
        Nine points in general position have 1442 solutions, real and complex, each of them three linkages.

    Raises
    ------
    GeometryError
        A wrong number of points or pivots, or two that are the same.

    Notes
    -----
    [Wampler, Morgan & Sommese 1992]; theory/nine-points.

    Examples
    --------
    >>> found = four_bars_through([(0, 0), (1, 0.5), (2, 0.7), (3, 0.5), (4, 0)], pivots=[(1, -2), (3, -2.5)])
    >>> found.certified, found.complete, len(found.linkages)
    (36, True, 10)
    """
    task = read_task(points, pivots)
    roots, paths = solve(task, whole("seed", seed, 0, 2**63 - 1))
    return NinePointSolutions(
        task.p, task.pivots, task.unit, roots, len(shipped(len(task.pivots)).z), linkages(roots, task), paths
    )
