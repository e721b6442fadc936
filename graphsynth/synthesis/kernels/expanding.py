"""From labels back to links and joints: packed joints, and the one-line text form."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from graphsynth.core.compilation import kernel
from graphsynth.synthesis.kernels.counting import FRAME_NONE, FRAME_PATH, FRAME_VERTEX
from graphsynth.synthesis.kernels.layout import COPIES_MASK, HEADER, inner


class Expansion(NamedTuple):
    """What the labels of a family stand for."""

    label_paths: NDArray[np.int32]  # (labels, multiplicity) numbers of path types, the marked one first
    label_mark: NDArray[np.int32]  # (labels,) position of the frame in the first path, 0: none
    path_length: NDArray[np.int32]  # (path types,) number of joints
    path_joints: NDArray[np.uint8]  # (path types, longest) joint mobilities
    level_index: NDArray[np.int64]  # wanted sizes of adjacency levels: which (negative: from the end)
    level_low: NDArray[np.int64]
    level_high: NDArray[np.int64]


@inner
def _expand(k, mult, row, expansion, ends):
    """Write the joints of one row as columns (link, link, mobility) of ``ends``; return (links, frame, joints)."""
    links = k
    frame = row[2] if row[1] == FRAME_VERTEX else -1
    joints = 0
    e = 0
    for u in range(k):
        for v in range(u + 1, k):
            copies = mult[u, v] & COPIES_MASK
            if copies == 0:
                continue
            label = row[HEADER + e]
            mark = expansion.label_mark[label]
            for i in range(copies):
                path = expansion.label_paths[label, i]
                length = expansion.path_length[path]
                at = u
                for j in range(length):
                    if j + 1 < length:
                        to = links
                        links += 1
                        if i == 0 and mark == j + 1 and row[1] == FRAME_PATH:
                            frame = to
                    else:
                        to = v
                    ends[0, joints] = at
                    ends[1, joints] = to
                    ends[2, joints] = expansion.path_joints[path, j]
                    joints += 1
                    at = to
            e += 1
    return links, frame, joints


@inner
def _put_plain(links, joints, ends, out, at):
    """Write graph6 of a chain without frame or higher pairs; return where it ends."""
    out[at] = 63 + links
    at += 1
    size = (links * (links - 1) // 2 + 5) // 6
    for i in range(size):
        out[at + i] = 63
    for j in range(joints):
        a = ends[0, j]
        b = ends[1, j]
        if a > b:
            a, b = b, a
        bit = b * (b - 1) // 2 + a
        out[at + bit // 6] += 32 >> (bit % 6)
    return at + size


@inner
def _level_order(links, frame, joints, order, level):
    """Order the links by adjacency level from the frame; return the number of levels."""
    level[:links] = -1
    level[frame] = 0
    order[0] = frame
    done = 1
    depth = 0
    while done < links:
        depth += 1
        for v in range(links):
            if level[v] >= 0:
                continue
            for w in range(links):
                if joints[v, w] and level[w] == depth - 1:
                    level[v] = depth
                    order[done] = v
                    done += 1
                    break
    return depth + 1


@inner
def _levels_fit(links, levels, level, expansion):
    """Check the wanted sizes of the adjacency levels."""
    for i in range(expansion.level_index.shape[0]):
        which = expansion.level_index[i]
        if which < 0:
            which += levels
        size = 0
        for v in range(links):
            if level[v] == which:
                size += 1
        if size < expansion.level_low[i] or size > expansion.level_high[i]:
            return False
    return True


@inner
def _arrange(k, mult, row, expansion, ends, matrix, order, level):
    """Expand one row and order its links; return (links, frame), links = 0 when the levels do not fit."""
    links, frame, joints = _expand(k, mult, row, expansion, ends)
    for a in range(links):
        order[a] = a
        for b in range(links):
            matrix[a, b] = 0
    for j in range(joints):
        matrix[ends[0, j], ends[1, j]] = ends[2, j]
        matrix[ends[1, j], ends[0, j]] = ends[2, j]
    if frame >= 0:
        levels = _level_order(links, frame, matrix, order, level)
        if not _levels_fit(links, levels, level, expansion):
            return 0, frame
    _put_pins_last(k, mult, links, order, level)
    return links, frame


@inner
def _put_pins_last(k, mult, links, order, other):
    """Move multiple joints behind all links; the order remains the same otherwise."""
    count = 0
    pins = 0
    for i in range(links):
        v = order[i]
        if v < k and mult[v, v]:
            other[pins] = v
            pins += 1
        else:
            order[count] = v
            count += 1
    for i in range(pins):
        order[count + i] = other[i]


@kernel
def expand_packed(k, total, mults, rows, count, expansion, out):
    """Write the joints of rows (of ``total`` links) as byte triples (a, b, mobility), a < b, sorted.

    Link 0 is the frame if there is one.

    ``out`` is (capacity, 3 * joints) uint8.  Returns the number of rows kept (those whose levels fit).
    """
    matrix = np.empty((total, total), np.uint8)
    ends = np.empty((3, total * total), np.int64)
    order = np.empty(total, np.int64)
    level = np.empty(total, np.int64)
    kept = 0
    for r in range(count):
        links, _ = _arrange(k, mults[rows[r, 0]], rows[r], expansion, ends, matrix, order, level)
        if links == 0:
            continue
        at = 0
        for a in range(links):
            for b in range(a + 1, links):
                mobility = matrix[order[a], order[b]]
                if mobility:
                    out[kept, at] = a
                    out[kept, at + 1] = b
                    out[kept, at + 2] = mobility
                    at += 3
        kept += 1
    return kept


@inner
def _put_number(out, at, n):
    if n >= 100:
        out[at] = 48 + n // 100
        at += 1
    if n >= 10:
        out[at] = 48 + n // 10 % 10
        at += 1
    out[at] = 48 + n % 10
    return at + 1


@kernel
def expand_text(k, total, mults, rows, count, expansion, space, highest, out):
    """Write rows (of ``total`` links) as lines of the text form; return (bytes, lines).

    A line is graph6, then the frame, the joints of higher mobility, and the space unless it is the plane.
    """
    matrix = np.empty((total, total), np.uint8)
    ends = np.empty((3, total * total), np.int64)
    order = np.empty(total, np.int64)
    level = np.empty(total, np.int64)
    at = np.int64(0)
    kept = 0
    for r in range(count):
        if highest == 1 and space == 3 and rows[r, 1] == FRAME_NONE:
            links, frame, joints = _expand(k, mults[rows[r, 0]], rows[r], expansion, ends)
            at = _put_plain(links, joints, ends, out, at)
            out[at] = 10
            at += 1
            kept += 1
            continue
        links, frame = _arrange(k, mults[rows[r, 0]], rows[r], expansion, ends, matrix, order, level)
        if links == 0:
            continue
        out[at] = 63 + links
        at += 1
        bits = 0
        filled = 0
        for b in range(1, links):
            for a in range(b):
                bits = bits * 2 + (1 if matrix[order[a], order[b]] else 0)
                filled += 1
                if filled == 6:
                    out[at] = 63 + bits
                    at += 1
                    bits = 0
                    filled = 0
        if filled:
            out[at] = 63 + (bits << (6 - filled))
            at += 1
        if frame >= 0:
            out[at] = 32
            out[at + 1] = 102  # f
            out[at + 2] = 48
            at += 3
        for mobility in range(2, highest + 1):
            first = True
            for a in range(links):
                for b in range(a + 1, links):
                    if matrix[order[a], order[b]] != mobility:
                        continue
                    if first:
                        out[at] = 32
                        out[at + 1] = 48 + mobility
                        out[at + 2] = 58  # :
                        at += 3
                    else:
                        out[at] = 44  # ,
                        at += 1
                    first = False
                    at = _put_number(out, at, a)
                    out[at] = 45  # -
                    at = _put_number(out, at + 1, b)
        if space != 3:
            out[at] = 32
            out[at + 1] = 112  # pi
            out[at + 2] = 105
            out[at + 3] = 48 + space
            at += 4
        out[at] = 10
        at += 1
        kept += 1
    return at, kept
