"""Linkages with points of their paths, from their geometry alone."""

from __future__ import annotations

import cmath
import math

import numpy as np
import pytest


class Planted:
    """A four-bar with pivots a, b, joints c, d at the first of the points of its path."""

    def __init__(self, pivots, joints, points):
        self.pivots, self.joints, self.points = pivots, joints, np.array(points)

    def among(self, linkages):
        """Whether one of the linkages draws the same path: it is this one or one of its cognates."""
        return any(self.same(linkage) for linkage in linkages)

    def same(self, linkage):
        a, b = linkage.crank_pivot, linkage.rocker_pivot
        c, d, p = linkage.crank_pin, linkage.rocker_pin, linkage.point
        # the triangle of the pivots is similar to that of the coupler, and all cognates share it
        found = {(a, b), (a, third(a, b, c, d, p)), (b, third(a, b, c, d, p))}
        (a, b), (c, d), p = self.pivots, self.joints, self.points[0]
        mine = (a, b, third(a, b, c, d, p))
        size = max(map(abs, mine)) + abs(p)
        return all(min(abs(f - m) for m in mine) < 1e-6 * size for pair in found for f in pair)


def third(a, b, c, d, p):
    """Return the third pivot of the path (Roberts)."""
    return a + (b - a) * (p - c) / (d - c)


def assembled(a, b, c, d, turn, side):
    """Position of joints when the crank has turned: intersection of two circles; None if they do not meet."""
    c2 = a + (c - a) * cmath.exp(1j * turn)
    reach, k, r = abs(b - c2), abs(d - c), abs(d - b)
    cosine = (k * k + reach * reach - r * r) / (2.0 * k * reach)
    if abs(cosine) >= 0.999:
        return None
    return c2, c2 + k * (b - c2) / reach * cmath.exp(1j * side * math.acos(cosine))


def linkage(rng, count, *, in_order=False, extreme=False):
    """Random linkage with so many points; in order on one branch of a full turn, or anywhere on the path.

    Of extreme ones the links have ratios of up to about 100.
    """
    while True:
        a, b, c, d, p = rng.normal(size=5) + 1j * rng.normal(size=5)
        if extreme:
            c, d, p = (
                a + (c - a) * 10 ** rng.uniform(-1, 1),
                b + (d - b) * 10 ** rng.uniform(-1, 1),
                p * 10 ** rng.uniform(0, 1),
            )
        if in_order:
            lengths = sorted((abs(b - a), abs(d - c), abs(d - b)))
            if abs(c - a) > lengths[0] or abs(c - a) + lengths[2] > 0.98 * (lengths[0] + lengths[1]):
                continue
        turns = np.sort(rng.uniform(0.0, 2.0 * np.pi, count)) if in_order else rng.uniform(0.0, 2.0 * np.pi, 60)
        if in_order and np.diff(np.append(turns, turns[0] + 2 * np.pi)).min() < 0.15:
            continue
        sides = np.ones(len(turns)) if in_order else rng.choice([-1.0, 1.0], len(turns))
        places = [assembled(a, b, c, d, turn, side) for turn, side in zip(turns, sides)]
        places = [place for place in places if place is not None][:count]
        if len(places) == count:
            shape = (p - c) / (d - c)
            return Planted((a, b), places[0], [e + (f - e) * shape for e, f in places])


@pytest.fixture(scope="session")
def plant():
    """Make a linkage from a seed and a number of points."""
    return lambda seed, count, **kinds: linkage(np.random.default_rng(seed), count, **kinds)
