"""Full turns, branches and order against a sweep of the crank, for linkages of every kind."""

import numpy as np
import pytest

from graphsynth.design import four_bars_through

GRID = 2.0 * np.pi * np.arange(3600) / 3600


def arms(A, B, C, turns):
    """Crank vectors for turns from the frame's direction."""
    return abs(C - A) * (B - A) / abs(B - A) * np.exp(1j * turns)


def feasible(A, B, C, D):
    """Whether the linkage can be assembled, for each angle of the grid."""
    reach = np.abs(A + arms(A, B, C, GRID) - B)
    k, r = abs(D - C), abs(D - B)
    return (abs(k - r) <= reach) & (reach <= k + r)


def swept(A, B, C, D):
    """Whether the crank at A turns fully, passes all positions on one branch, and in order."""
    can = feasible(A, B, C[0], D[0])
    turns = np.angle((C - A) / (B - A)) % (2.0 * np.pi)
    sides = np.sign(((D - C).conj() * (D - B)).imag)
    start = 0 if can.all() else int(np.flatnonzero(~can)[0])
    can, along = np.roll(can, -start), (turns - GRID[start]) % (2.0 * np.pi)
    piece = np.cumsum(np.append(True, can[1:] != can[:-1]))
    pieces = piece[np.floor(along / GRID[1]).astype(int)]
    one = len(set(pieces)) == 1 and len(set(sides)) == 1
    steps = np.diff(along)
    if can.all():
        around = np.append(steps, along[0] - along[-1]) % (2.0 * np.pi)
        order = round(around.sum() / (2.0 * np.pi)) in (1, len(along) - 1)
    else:
        order = (steps > 0.0).all() or (steps < 0.0).all()
    return bool(can.all()), one, bool(one and order)


def positions(rng):
    """Five positions of a random linkage: on one branch and in order, on one branch, or anywhere."""
    while True:
        A, B, C, D, P = rng.normal(size=5) + 1j * rng.normal(size=5)
        turns, sides = rng.uniform(0.0, 2.0 * np.pi, 80), rng.choice([-1.0, 1.0], 80)
        wish = rng.integers(3)
        if wish < 2:
            sides[:] = 1.0
            turns = (turns[0] + np.sort(rng.uniform(0.0, 2.0, 80))) if wish == 0 else turns
        E = A + arms(A, B, C, turns)
        reach, k, r = np.abs(E - B), abs(D - C), abs(D - B)
        cosine = (k * k + reach * reach - r * r) / (2.0 * k * reach)
        kept = np.flatnonzero(np.abs(cosine) < 0.99)
        if len(kept) < 5:
            continue
        kept = np.sort(rng.choice(kept, 5, replace=False)) if wish == 0 else kept[:5]
        E, reach = E[kept], reach[kept]
        F = E + k * (B - E) / reach * np.exp(1j * sides[kept] * np.arccos(cosine[kept]))
        if np.abs(np.subtract.outer(turns[kept], turns[kept]) + np.eye(5)).min() > 0.01:
            return A, B, E, F, E + (F - E) * (P - C) / (D - C)


@pytest.mark.long
@pytest.mark.parametrize("seed", range(4))
def test_judged_as_a_sweep_shows(seed):
    rng = np.random.default_rng(seed)
    kinds = set()
    for _ in range(12):
        A, B, C, D, P = positions(rng)
        found = four_bars_through(P, [A, B])
        pins = [(C[0], D[0]), (D[0], C[0])]
        miss = np.array([[abs(one.crank_pin - c) + abs(one.rocker_pin - d) for c, d in pins] for one in found.linkages])
        at, way = np.unravel_index(miss.argmin(), miss.shape)
        linkage, ways = found.linkages[at], [swept(A, B, C, D), swept(B, A, D, C)]
        assert miss.min() < 1e-7
        assert (linkage.one_branch, linkage.in_order) == (any(w[1] for w in ways), any(w[2] for w in ways))
        assert linkage.turns_fully == ways[way][0]
        kinds.add((linkage.turns_fully, linkage.one_branch, linkage.in_order))
    assert len(kinds) >= 3
