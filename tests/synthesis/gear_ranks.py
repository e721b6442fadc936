"""Gear pairs on a tree without a locked sub-chain, counted by ranks of the equations: ``python gear_ranks.py LINKS``.

No rule for subsets, no symmetry, no order of generation: every choice of independent rows of random coefficients modulo
a prime is met, and kept if the null space has different entries for all links.  Printed beside the sum of the orbits of
the trains that graphsynth lists, tree by tree.
"""

from __future__ import annotations

import random
import sys
import time
from itertools import combinations

import networkx as nx
import numba
import numpy as np

PRIME = 2_147_483_629


@numba.njit(cache=True)
def inverse(a):
    found, power = 1, PRIME - 2
    while power:
        if power & 1:
            found = found * a % PRIME
        a = a * a % PRIME
        power >>= 1
    return found


@numba.njit(cache=True)
def independent_choices(rows, number, weights):
    """Count choices of so many independent rows whose null space, mixed by the weights, has no two entries alike."""
    m, n = rows.shape
    reduced, lead = np.zeros((number, n), np.int64), np.zeros(number, np.int64)
    at = np.full(number + 1, -1, np.int64)
    depth = total = 0
    while depth >= 0:
        at[depth] += 1
        if at[depth] > m - number + depth:
            depth -= 1
            continue
        row = rows[at[depth]].copy()
        for d in range(depth):
            row = (row - row[lead[d]] * reduced[d]) % PRIME
        if not row.any():
            continue
        lead[depth] = np.flatnonzero(row)[0]
        reduced[depth] = row * inverse(row[lead[depth]]) % PRIME
        if depth + 1 < number:
            at[depth + 1] = at[depth]
            depth += 1
            continue
        null = weights.copy()  # at the columns that no row leads
        null[lead[:number]] = 0
        for d in range(number - 1, -1, -1):
            value = 0
            for c in range(n):
                value = (value - reduced[d, c] * null[c]) % PRIME
            null[lead[d]] = value
        total += len(np.unique(null)) == n
    return total


def choices(tree, links, number, rng):
    """Count the choices on a tree, given as the joints of links that share an axis."""
    far = dict(nx.all_pairs_shortest_path(nx.Graph([(a, b) for a, b, *_ in tree]), cutoff=2))
    pairs = [(a, b, far[a][b][1]) for a, b in combinations(range(links), 2) if len(far[a].get(b, ())) == 3]
    rows = np.zeros((len(pairs), links), np.int64)
    for row, (a, b, carrier) in zip(rows, pairs):
        row[a], row[b] = rng.randrange(1, PRIME), rng.randrange(1, PRIME)
        row[carrier] = (-row[a] - row[b]) % PRIME
    weights = np.array([rng.randrange(1, PRIME) for _ in range(links)])
    return int(independent_choices(rows, number, weights)) if len(pairs) >= number else 0


def sums_by_tree(links):
    """Yield, for every tree of axes, its choices and the sum of the orbits of its trains, and the number of these."""
    from graphsynth.synthesis.geared_trees import GearedTrees, trees_of_axes

    rng = random.Random(links)
    for h, tree in enumerate(trees_of_axes(links)):
        order, trains, orbits = tree.automorphism_order, 0, 0
        for train in GearedTrees(links, h, h + 1, False).graphs():
            trains += 1
            orbits += order // train.automorphism_order
        yield choices(tree.joints, links, links - 2, rng), orbits, trains


if __name__ == "__main__":
    started = time.process_time()
    found = list(sums_by_tree(int(sys.argv[1])))
    differ = sum(by_rank != orbits for by_rank, orbits, _ in found)
    by_rank, orbits, trains = map(sum, zip(*found))
    print(f"{len(found)} trees, {by_rank} choices by rank, orbits of {trains} trains: {orbits}; {differ} trees differ")
    print(f"{time.process_time() - started:.0f} s")
