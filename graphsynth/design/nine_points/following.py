"""From the roots of a generic start to those of a task, by compiled paths; lost paths are found again."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from graphsynth.core.compilation import named
from graphsynth.design.nine_points.digits import follow_with_digits
from graphsynth.design.nine_points.equations import cognates
from graphsynth.design.nine_points.proof import MIRROR, Mask, ProvedRoots, marks, overlaps, prove
from graphsynth.design.nine_points.task import POINTS, Complex, Task, free_unknowns
from graphsynth.intervals.balls import Balls

#: Where the shipped starts are; made by ``python -m graphsynth.design.nine_points.monodromy``.
FILE = Path(__file__).with_name("starts.npz")
#: Largest first correction, tolerance of the corrector, first and least step; looser to stricter.
SETTINGS = ((1e-4, 1e-7, 1e-2, 1e-10), (1e-6, 1e-7, 1e-3, 1e-13))
#: Relative distance of marks below which two roots count as one.
SAME = 1e-8
#: How often other paths are tried for roots that are missing, at most: no more if one try adds nothing.
_ROUNDS = 3
#: Random detours for roots that are lost, relative; how many may be lost for another try, or one in fifty.
_DETOURS, _FEW = (3e-3, 1e-2, 3e-2) * 3, 8
#: The most lost paths that are followed with many digits, a second or two each.
_MOST_DIGITS = 8


@dataclass(frozen=True, eq=False)
class Start:
    """Generic points and given pivots with their conjugates, unrelated, and one root of each triple."""

    end: Complex  # points and given unknowns, as `Task.end`
    z: Complex

    @property
    def pivots(self) -> int:
        """How many pivots are given."""
        return POINTS.index(len(self.end) - 4)

    def turned(self, factors: Complex) -> Start:
        """Coordinates and their conjugates times factors of their own: roots stay roots."""
        return Start(self.end * factors, self.z * np.tile(factors, 4))


@cache
def shipped(pivots: int) -> Start:
    """Return the start system of the package."""
    with np.load(FILE) as data:
        return Start(data[f"end_{pivots}"], data[f"z_{pivots}"])


def follow(start: Start, end: Complex, settings: tuple[float, ...] = SETTINGS[0]) -> Complex:
    """Follow every root from one end of a straight path to the other; NaN where that failed."""
    (follow_all,) = named("graphsynth.design.nine_points.kernels.paths", "follow_all")
    z = start.z.copy()
    free = np.array(free_unknowns(start.pivots), dtype=np.int64)
    given = np.setdiff1d(np.arange(8), free)
    ends = np.zeros((len(z), 3), dtype=np.int64)
    follow_all(z, start.end, end - start.end, free, given, np.array(settings), ends)
    z[ends[:, 0] != 0] = np.nan
    return z


def repeated(z: Complex, pivots: int) -> NDArray[np.int64]:
    """Pairs of roots, in floating point, that belong to the same triple."""
    found = np.flatnonzero(np.isfinite(z).all(axis=1))
    sums = marks(Balls(z[found], np.zeros((len(found), 8))), pivots)
    return found[overlaps([Balls(mark.mid, SAME * (1e-3 + np.abs(mark.mid))) for mark in sums])]


def candidates(task: Task, begin: Start, rng: np.random.Generator) -> tuple[Complex, NDArray[np.int64], int]:
    """Follow one path to a task; return approximate roots, real ones once, those lost, and how many were followed.

    Where a path is lost, or two have become one, those of the cognates are tried, which pass elsewhere through large
    numbers, then detours: round a point where a root is infinite they lead to the same end.  Of points in special
    position many are lost for good.  The points are real, so the mirror image of a root is one, too.
    """
    z = follow(begin, task.end)
    paths, pivots = len(z), begin.pivots
    for k, detour in [*((k, 0.0) for k in range(1, 3 - pivots)), *((0, detour) for detour in _DETOURS)]:
        lost: Mask = np.asarray(~np.isfinite(z).all(axis=1))
        lost[repeated(z, pivots)] = True
        left = np.flatnonzero(lost)
        if left.size == 0 or left.size > max(_FEW, len(z) // 50) or (detour and len(_whole(z, pivots)) >= len(z)):
            break
        at = Start(begin.end, np.stack(cognates(begin.z[left].T)[k], axis=1))
        if detour:
            turn = rng.normal(size=(2, *at.end.shape))
            middle = 0.5 * (at.end + task.end) * (1.0 + detour * (turn[0] + 1j * turn[1]))
            at = Start(middle, follow(at, middle, SETTINGS[1]))
        z[left] = follow(at, task.end, SETTINGS[1 if detour else 0])
        paths += left.size
    lost = np.asarray(~np.isfinite(z).all(axis=1))
    lost[repeated(z, pivots)] = True
    return _whole(z, pivots), np.flatnonzero(lost), paths


def _whole(z: Complex, pivots: int) -> Complex:
    """Different roots among those given and their mirror images."""
    z = z[np.isfinite(z).all(axis=1)]
    z = np.concatenate([z, z[:, MIRROR].conj()])
    return np.delete(z, repeated(z, pivots)[:, 1], axis=0)


def _with_digits(task: Task, begin: Start, lost: NDArray[np.int64]) -> Complex:
    """Return ends of lost paths, followed with many digits, and mirror images: far pivots leave too few in doubles."""
    ends = [end for k in lost if (end := follow_with_digits(begin.z[k], begin.end, task)) is not None]
    z = np.array(ends, dtype=np.complex128).reshape(-1, 8)
    return np.concatenate([z, z[:, MIRROR].conj()])


def solve(task: Task, seed: int = 0) -> tuple[ProvedRoots, int]:
    """Return one root of each triple, proved, and how many paths were followed."""
    rng = np.random.default_rng(seed)
    start = shipped(len(task.pivots))
    scale = np.abs(start.end[: len(task.p) - 1]).mean()
    z, paths, before = np.empty((0, 8), dtype=np.complex128), 0, 0
    for _ in range(_ROUNDS):
        begin = start.turned(np.exp(2j * np.pi * rng.uniform(size=2)) / scale)
        found, lost, followed = candidates(task, begin, rng)
        z, paths = np.concatenate([z, found]), paths + followed
        z = np.delete(z, repeated(z, start.pivots)[:, 1], axis=0)
        roots = prove(z, task)
        z = z[roots.distinct]
        if len(z) < len(start.z) and 0 < lost.size <= _MOST_DIGITS:
            z, paths = np.concatenate([z, _with_digits(task, begin, lost)]), paths + lost.size
            roots = prove(z, task)
            z = z[roots.distinct]
        if len(z) in (before, len(start.z)):
            break
        before = len(z)
    return roots, paths
