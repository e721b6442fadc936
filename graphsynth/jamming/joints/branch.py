"""Which pieces belong to the motion: neighbours that hold the same assembly, and pieces that hold one of a sample.

The box of a proved piece holds exactly one assembly for every input and every choice of dimensions in it.  Two pieces
that share a point of both belong together if the one assembly proved at that point lies in the boxes of both: two
continuous branches of regular assemblies that agree somewhere agree wherever both are defined.  So one point is enough
for every pair, and a tree of pairs for all (theory/drawing-tolerances 3).
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components, minimum_spanning_tree

from graphsynth.jamming.assembly.positions import points
from graphsynth.jamming.assembly.tubes import prove_tubes

if TYPE_CHECKING:
    from graphsynth.jamming.assembly.tubes import Tubes
    from graphsynth.jamming.joints.pieces import Found, Work

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]
Rows = NDArray[np.intp]
#: So many times other points are tried for pieces that are not linked yet.
_TRIES = 12


class Branch(NamedTuple):
    """Pieces proved to be of the motion, and whether all of them are proved to be one."""

    own: Mask
    whole: bool


def of_the_motion(work: Work, pieces: Found) -> Branch:
    """Tell which pieces are proved to hold the branch of the motion (certified)."""
    if work.system.size == 0 and not work.system.dyads:
        return Branch(pieces.proved.copy(), bool(pieces.proved.all()))
    count = len(pieces.lo)
    first, second = _neighbours(pieces)
    linked = np.zeros(first.size, dtype=np.bool_)
    tried = linked.copy()
    for _ in range(_TRIES):
        parts = connected_components(_graph(first[linked], second[linked], count), directed=False)[1]
        useful = np.flatnonzero(~tried & (parts[first] != parts[second]))
        if useful.size == 0:
            break
        tree = minimum_spanning_tree(_graph(parts[first[useful]], parts[second[useful]], count))
        chosen = useful[_one_each(parts[first[useful]], parts[second[useful]], tree)]
        linked[chosen], tried[chosen] = _same(work, pieces, first[chosen], second[chosen]), True
    parts = connected_components(_graph(first[linked], second[linked], count), directed=False)[1]
    own = np.isin(parts, parts[_with_samples(work, pieces)]) & pieces.proved
    return Branch(own, bool(own.all() and (parts == parts[0]).all()))


def _graph(first: Rows, second: Rows, count: int) -> coo_array:
    low, high = np.minimum(first, second), np.maximum(first, second)
    return coo_array((np.ones(first.size), (low, high)), shape=(count, count)).tocsr()


def _one_each(first: Rows, second: Rows, tree: coo_array) -> Rows:
    """Give the number of the first pair for every edge of a tree."""
    low, high = np.minimum(first, second), np.maximum(first, second)
    edges = tree.tocoo()
    size = np.int64(tree.shape[0])
    codes, at = np.unique(low * size + high, return_index=True)
    return np.asarray(at[np.isin(codes, edges.row.astype(np.int64) * size + edges.col)])


def _neighbours(pieces: Found) -> tuple[Rows, Rows]:
    """Pairs of proved pieces that share a face."""
    rows = np.flatnonzero(pieces.proved)
    low = np.column_stack([pieces.lo, pieces.p_lo])[rows]
    high = np.column_stack([pieces.hi, pieces.p_hi])[rows]
    if low.shape[1] == 1:  # no parameters: in the order of the input
        touch = np.flatnonzero(high[:-1, 0] == low[1:, 0])
        return rows[touch], rows[touch + 1]
    found = []
    for k in range(len(rows)):
        near = slice(k + 1, int(np.searchsorted(low[:, 0], high[k, 0], side="right")))
        meet = (low[near] <= high[k]) & (high[near] >= low[k])
        found.append(k + 1 + np.flatnonzero(meet.all(axis=1)))
    first = np.repeat(np.arange(len(rows)), [own.size for own in found])
    second = np.concatenate(found) if found else first
    return rows[first], rows[second]


def _same(work: Work, pieces: Found, first: Rows, second: Rows) -> Mask:
    """Whether the assembly at a common point of two pieces is proved to be that of both."""
    low = np.maximum(pieces.lo[first], pieces.lo[second])
    high = np.minimum(pieces.hi[first], pieces.hi[second])
    p_low = np.maximum(pieces.p_lo[first], pieces.p_lo[second])
    p_high = np.minimum(pieces.p_hi[first], pieces.p_hi[second])
    if work.system.size == 0:  # of dyads alone, on their sides there is one
        return np.ones(len(first), dtype=np.bool_)
    at = work.assemblies(0.5 * (low + high), np.clip(0.5 * (p_low + p_high), p_low, p_high))
    return np.asarray(at.proved & _inside(at, pieces, first) & _inside(at, pieces, second))


def _inside(at: Tubes, pieces: Found, rows: Rows) -> Mask:
    low, high = pieces.box_lo[rows], pieces.box_hi[rows]
    return np.asarray(((at.tight.lo >= low) & (at.tight.hi <= high)).all(axis=1))


def _with_samples(work: Work, pieces: Found) -> Rows:
    """Pieces that hold the assembly proved next to a sample of the motion, of the nominal mechanism.

    One sample of every piece is looked at, the one nearest to its middle.
    """
    keep = np.flatnonzero(work.motion.assembled)
    u = work.motion.inputs[keep]
    nominal = ((pieces.p_lo <= 0.0) & (pieces.p_hi >= 0.0)).all(axis=1) & pieces.proved
    chosen, samples = [], []
    for row in np.flatnonzero(nominal):
        inside = np.flatnonzero((u >= pieces.lo[row]) & (u <= pieces.hi[row]))
        if inside.size:
            middle = 0.5 * (pieces.lo[row] + pieces.hi[row])
            chosen.append(row)
            samples.append(keep[inside[int(np.argmin(np.abs(u[inside] - middle)))]])
    rows = np.array(chosen, dtype=np.intp)
    if rows.size == 0:
        return rows
    poses = work.motion.poses[samples]
    x = work.system.coordinates(poses, np.zeros_like(poses))[0]
    at, none = work.motion.inputs[samples], np.zeros((len(samples), work.box.size))
    own = prove_tubes(work.system, (), points(at), x, work.system.count(poses), points(none))
    return rows[own.proved & work.system.follows(poses) & _inside(own, pieces, rows)]
