"""Makes the start systems: ``python -m graphsynth.design.nine_points.monodromy [--pivots 0] [--seed 1] [--trace]``.

A generic linkage gives generic points; followed around random triangles in the space of points, its root becomes other
roots of the same points, until nothing new is found any more.  ``--trace`` then tests in another way that none is
missing (theory/nine-points 6).  The work so far is kept in a file, so an interrupted run goes on.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable
from itertools import pairwise
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from graphsynth.design.nine_points.following import FILE, SAME, SETTINGS, Start, follow, repeated, shipped
from graphsynth.design.nine_points.proof import overlaps
from graphsynth.design.nine_points.task import POINTS, Complex, free_unknowns, parameters
from graphsynth.intervals.balls import Balls

#: Loops without anything new after which the search ends.
_QUIET = 12
Pairs = Callable[[Complex, Start], NDArray[np.int64]]


def generic(rng: np.random.Generator, *shape: int) -> Complex:
    """Random complex numbers."""
    return np.asarray(rng.normal(size=shape) + 1j * rng.normal(size=shape))


def planted(pivots: int, rng: np.random.Generator) -> Start:
    """Make a generic linkage and points on its path."""
    a, aa, x, xx, b, bb, y, yy = z = generic(rng, 8)
    points = []
    for turn in np.exp(generic(rng, POINTS[pivots] - 1)):
        # turn of the first link from the closure of the loop: (x - a) l + e = (y - b) m, likewise with 1/l and 1/m
        e, ee = a - b - (x - y) * turn, aa - bb - (xx - yy) / turn
        u, uu = x - a, xx - aa
        l = rng.choice(np.roots([u * ee, u * uu + e * ee - (y - b) * (yy - bb), uu * e]))
        points.append((a + u * l - x * turn, aa + uu / l - xx / turn))
    return Start(parameters(np.array(points), z.reshape(4, 2)[: 2 * pivots : 2]), z[None])


def elsewhere(start: Start, rng: np.random.Generator) -> Complex:
    """Random points, given unknowns, bend and pole of the size of the start's, where it has any."""
    scale = np.abs(start.end).mean(axis=1, keepdims=True)
    return np.asarray(generic(rng, *start.end.shape) * scale)


def around(start: Start, rng: np.random.Generator) -> Complex:
    """Roots at the end of a random triangle, some lost."""
    corners = [start.end, elsewhere(start, rng), elsewhere(start, rng), start.end]
    z = start.z
    for begin, end in pairwise(corners):
        z = follow(Start(begin, z), end)
        z = z[np.isfinite(z).all(axis=1)]
    return z


def grown(start: Start, same: Pairs, seed: tuple[int, ...], keep: Path | None = None) -> Start:
    """All roots that loops lead to, from those that are known."""
    loops = quiet = 0
    if keep is not None and keep.exists():
        with np.load(keep) as data:
            start, loops, quiet = Start(data["end"], data["z"]), int(data["loops"]), int(data["quiet"])
    while quiet < _QUIET:
        rng = np.random.default_rng([*seed, loops])
        z = np.concatenate([start.z, around(start, rng)])
        z = np.delete(z, same(z, start)[:, 1], axis=0)
        quiet = quiet + 1 if len(z) == len(start.z) else 0
        start, loops = Start(start.end, z), loops + 1
        sys.stdout.write(f"loop {loops}: {len(z)}\n")
        sys.stdout.flush()
        if keep is not None:
            np.savez(keep, end=start.end, z=start.z, loops=loops, quiet=quiet)
    return start


def triples(z: Complex, start: Start) -> NDArray[np.int64]:
    """Pairs of roots of one triple of cognates."""
    return repeated(z, start.pivots)


def bent(start: Start, rng: np.random.Generator) -> Start:
    """One root of a start whose last point depends on an unknown."""
    end, z = start.end.copy(), start.z[:1]
    end[-1] = bend, pole = generic(rng, 2)
    end[-6, 0] -= bend / (z[0, free_unknowns(start.pivots)[-4]] - pole)
    return Start(end, z)


def bent_pairs(z: Complex, start: Start) -> NDArray[np.int64]:
    """Pairs of roots with the same value of the unknown that bends; cognates that share it are one."""
    mark = z[:, free_unknowns(start.pivots)[-4]]
    return overlaps([Balls(mark, SAME * (1e-3 + np.abs(mark)))])


class Trace(NamedTuple):
    """Outcome of a trace test."""

    bent: int  #: roots whose last point depends on an unknown
    straight: int  #: how many of them become roots of the points as the dependence vanishes
    defect: float  #: how much the sum of the unknown over all bent roots differs from a linear function, relative
    without: float  #: the same, typically, without one of the roots


def trace(start: Start, seed: tuple[int, ...], keep: Path | None = None) -> Trace:
    """Test that no root is missing: a sum over all roots on parallel sections of a curve is a linear function."""
    rng = np.random.default_rng([*seed, 1])
    all_bent = grown(bent(start, rng), bent_pairs, (*seed, 2), keep)
    column, bend, step = free_unknowns(start.pivots)[-4], all_bent.end[-1, 0], 0.1 * generic(rng, 1)[0]
    values = [_moved(all_bent, bend + k * step)[:, column] for k in (-1.0, 0.0, 1.0)]
    second = values[0] - 2.0 * values[1] + values[2]
    scale = np.abs(second).sum()
    shift = 1e-8 * bend / (_moved(all_bent, 1e-8 * bend)[:, column] - all_bent.end[-1, 1])
    defects = abs(second.sum()) / scale, np.median(np.abs(second.sum() - second)) / scale
    return Trace(len(second), int((np.abs(shift) < 1e-5).sum()), float(defects[0]), float(defects[1]))


def _moved(start: Start, bend: complex) -> Complex:
    """Roots for another bend, followed in small steps."""
    end = start.end.copy()
    end[-1, 0] = bend
    return follow(start, end, SETTINGS[1])


def main(arguments: list[str] | None = None) -> None:
    """Make a start system and add it to the file of the package, or to another one."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--pivots", type=int, choices=(0, 1, 2), default=0, help="number of given pivots")
    parser.add_argument("--seed", type=int, default=1, help="seed of the generic linkage and of the loops")
    parser.add_argument("--trace", action="store_true", help="test the start of the package; change nothing")
    parser.add_argument("--out", type=Path, default=FILE, help="file of start systems")
    parser.add_argument("--work", type=Path, default=None, help="file that keeps the work so far")
    given = parser.parse_args(arguments)
    seed = (given.seed, given.pivots)
    if given.trace:
        found = trace(shipped(given.pivots), seed, given.work)
        known = len(shipped(given.pivots).z) * (3 - given.pivots)
        sys.stdout.write(
            f"{found.bent} roots of bent points, {found.straight} of them of straight ones ({known} are known); "
            f"their sum is linear to {found.defect:.1g} ({found.without:.1g} without one of them)\n"
        )
        return
    start = grown(planted(given.pivots, np.random.default_rng(seed)), triples, seed, given.work)
    kept = dict(np.load(given.out)) if given.out.exists() else {}
    np.savez_compressed(given.out, **{**kept, f"end_{given.pivots}": start.end, f"z_{given.pivots}": start.z})


if __name__ == "__main__":
    main()
