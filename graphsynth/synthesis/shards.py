"""Sharing the items of a problem out: runs of contracted graphs that cost about the same work.

The work of a contracted graph is estimated from the number of its labellings and its symmetries (to list), from the
states of its dynamic program (to count), or is the number of its chains (to make a catalogue); of a family of many
graphs only some are looked at, and the others take the work of those alike.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from graphsynth.core.errors import SpecError
from graphsynth.core.wording import shown, whole
from graphsynth.synthesis.chunks import Chunk, estimates, workspace
from graphsynth.synthesis.families import Family
from graphsynth.synthesis.kernels.counting import COUNTING, LISTING, MAKING, weigh_block
from graphsynth.synthesis.made import Made
from graphsynth.synthesis.problem import WorkItem
from graphsynth.synthesis.totals import Total

Shard = tuple[int, int]
Costs = NDArray[np.float64]
_WEIGHED = 20_000  # contracted graphs of a problem whose work is estimated one by one


def shard_of(items: Sequence[WorkItem], shard: Shard | None, *, listing: bool = True) -> list[WorkItem]:
    """Return shard i of m (1 <= i <= m): a run of the work; the shards one after the other are the whole.

    ``items``: all items of a problem; one of several contracted graphs may be cut between them; ``shard`` (int,
    int) or None: which share; None is everything; ``listing``: whether the items are to be listed, not counted.
    Raises `SpecError` for i out of 1..m.
    """
    if shard is None:
        return list(items)
    i, m = checked(shard)
    atoms = _atoms(tuple(items), LISTING if listing else COUNTING)
    ends = np.cumsum([0, *map(len, atoms)])
    first, last = _run(np.concatenate([*atoms, np.zeros(0)]), i, m)
    found: list[WorkItem] = []
    for item, start, stop, costs in zip(items, ends[:-1].tolist(), ends[1:].tolist(), atoms):
        low, high = max(first - start, 0), min(last, stop) - start
        if isinstance(item, Chunk) and low < high < low + len(costs):
            share = item.weight * float(costs[low:high].sum() / costs.sum())
            found.append(replace(item, start=item.start + low, stop=item.start + high, weight=share))
        elif low < high:
            found.append(item)
    return found


def run_of(parts: Sequence[WorkItem | Total], shard: Shard) -> list[WorkItem | Total]:
    """Return the parts of a count that are shard i of m: a run of whole ones, by their weights.

    Raises `SpecError` for i out of 1..m.
    """
    first, last = _run(np.array([part.weight for part in parts]), *checked(shard))
    return list(parts[first:last])


def share_of(items: Sequence[WorkItem], shard: Shard | None) -> range:
    """Return which items are shard i of m of a catalogue: a run of whole ones.

    Raises `SpecError` for i out of 1..m.
    """
    if shard is None or not items:
        return range(len(items))
    costs = np.array([costs.sum() for costs in _atoms(tuple(items), MAKING)])
    return range(*_run(costs, *checked(shard)))


def checked(shard: Shard) -> Shard:
    """Return i and m of shard i of m; SpecError for i out of 1..m."""
    try:
        i, m = (whole(number, "shard", 1, 10**6) for number in shard)
    except (TypeError, ValueError):
        i, m = 1, 0
    if not 1 <= i <= m:
        text = f"{shard[0]}/{shard[1]}" if isinstance(shard, tuple) and len(shard) == 2 else shown(shard)
        raise SpecError(f"shard {text} must be i/m with 1 <= i <= m <= 1000000")
    return i, m


def _run(costs: Costs, i: int, m: int) -> tuple[int, int]:
    """Return the i-th of m runs such that the largest is as small as can be; none is empty if there are m costs."""
    sums = np.concatenate([[0.0], np.cumsum(costs)])
    if m >= len(costs):
        return min(i - 1, len(costs)), min(i, len(costs))
    low, high = max(float(costs.max()), sums[-1] / m), float(sums[-1])
    for _ in range(50):
        middle = (low + high) / 2
        low, high = (low, middle) if len(_ends(sums, middle, m)) <= m else (middle, high)
    ends = [0, *_ends(sums, high, m)]
    ends += [len(costs)] * (m + 1 - len(ends))
    return ends[i - 1], ends[i]


def _ends(sums: Costs, most: float, m: int) -> list[int]:
    """Fill runs up to ``most`` from the front, leaving one cost for each of m; more than m runs do not fit."""
    ends: list[int] = []
    at, count = 0, len(sums) - 1
    while at < count and len(ends) <= m:
        stop = int(np.searchsorted(sums, sums[at] + most * (1 + 1e-12), side="right")) - 1
        at = max(at + 1, min(stop, count - (m - len(ends) - 1)))
        ends.append(at)
    return ends


@lru_cache(maxsize=4)
def _atoms(items: tuple[WorkItem, ...], purpose: int) -> list[Costs]:
    """Estimate the work of each item, contracted graph by contracted graph where it may be cut."""
    graphs = sum(item.stop - item.start for item in items if isinstance(item, Chunk))
    share = min(1.0, _WEIGHED / max(graphs, 1))
    known: dict[Family, Costs] = {}
    atoms = []
    for item in items:
        if isinstance(item, Made):
            atoms.append(np.array([item.work(purpose)]))
            continue
        if item.symmetry:  # few labellings are searched; nobody knows how many
            atoms.append(np.ceil([item.weight]))
            continue
        family = item.family
        if family not in known:
            known[family] = works(family, share, LISTING if family.levels and purpose == COUNTING else purpose)
        costs = known[family][item.start : item.stop]
        atoms.append(costs if item.parts == 1 else np.ceil(costs / item.parts))
    return atoms


def works(family: Family, share: float, purpose: int) -> Costs:
    """Estimate the work of each contracted graph for LISTING, COUNTING or MAKING; look at a share of them."""
    bounds = estimates(family)
    graphs = family.graphs
    if not len(graphs):
        return bounds
    # what graphs alike have in common: the bound, triangles, triangles with a double side, squares
    joined, double = ((graphs > least).astype(np.float32) for least in (0, 1))
    paths = joined @ joined
    pairs = paths * (1 - np.eye(graphs.shape[1], dtype=np.float32))
    figures = ((paths * joined).sum((1, 2)), (paths * double).sum((1, 2)), (pairs * (pairs - 1)).sum((1, 2)))
    kinds = np.unique(np.stack([bounds, *figures], axis=1), axis=0, return_inverse=True)[1].ravel()
    sizes = np.bincount(kinds)
    order = np.argsort(kinds, kind="stable")
    rank = np.arange(len(kinds)) - np.repeat(np.cumsum(sizes) - sizes, sizes)
    every = max(1, round(1 / share))
    chosen = order[rank % every == 0]  # of each kind the first, and every so many
    found = np.empty(len(chosen))
    edge_labels = family.edge_labels
    weigh_block(family.vertices, graphs, chosen, purpose, edge_labels.tables, workspace(edge_labels), found)
    found = np.where(found < 0, np.ceil(bounds[chosen]), found)
    per_kind = np.bincount(kinds[chosen], found, len(sizes)) / np.bincount(kinds[chosen], minlength=len(sizes))
    costs: Costs = np.rint(per_kind[kinds])  # whole numbers: sums are exact, and the same on every machine
    costs[chosen] = found
    return costs * family.links if family.framed else costs
