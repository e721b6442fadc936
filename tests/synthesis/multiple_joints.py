"""Chains with multiple joints from nauty's bipartite graphs and a subset test: nothing here uses graphsynth.

A chain is the bipartite graph of its links and joints: two or more joints on a link, two or more links on a joint, and
two joints never share two links (these would be rigid).  DOF(S) = 3 (|S| - 1) - 2 sum over joints of (links of S on
the joint - 1) >= 1 for every set S of two or more links.
"""

from __future__ import annotations

from collections.abc import Iterable

import nauty
import networkx as nx
import numpy as np
from numba import njit


@njit(cache=True)
def _loose(masks, links, keep):
    """Mark the graphs, neighbour masks of links then joints, in which no set of two or more links is rigid."""
    size = np.zeros(1 << links, np.int64)
    for s in range(1, 1 << links):
        size[s] = size[s >> 1] + (s & 1)
    for g in range(masks.shape[0]):
        keep[g] = True
        for s in range(1, 1 << links):
            if size[s] < 2:
                continue
            lost = 0
            for joint in range(links, masks.shape[1]):
                lost += max(0, size[masks[g, joint] & s] - 1)
            if 3 * (size[s] - 1) - 2 * lost < 1:
                keep[g] = False
                break


def chains(links: int, mobility: int, multiple: int) -> list[str]:
    """Return graph6 lines (links first, then joints) of all non-fractionated chains with so many multiple joints."""
    simple = (3 * (links - 1) - mobility) // 2  # joints of two links that do the same
    found = []
    for joints in range(2 * links - simple, simple - multiple + 1):  # two joints on a link, two more on some pins
        edges = simple + joints
        options = "-czd2:2", "-Z1", f"-D{joints}:{links}", str(links), str(joints), f"{edges}:{edges}"
        lines = nauty.run("genbg", *options)
        if not lines:
            continue
        masks = nauty.adjacency(lines)
        of_joints = np.array([[mask.bit_count() for mask in row[links:]] for row in masks.tolist()])
        chosen = np.flatnonzero((of_joints > 2).sum(axis=1) == multiple)
        keep = np.zeros(len(chosen), np.bool_)
        _loose(masks[chosen], links, keep)
        found += [lines[i] for i in chosen[keep].tolist() if nx.is_biconnected(nx.from_graph6_bytes(lines[i].encode()))]
    return found


def canonical(lines: Iterable[str], links: int, *, framed: bool = False) -> list[str]:
    """Return nauty's canonical line of each graph, links before joints; link 0 is the frame, if ``framed``."""
    found = []
    by_size: dict[int, list[str]] = {}
    for line in lines:
        by_size.setdefault(ord(line[0]) - 63, []).append(line)
    for size, alike in by_size.items():
        colours = ("a" if framed else "b") + "b" * (links - 1) + "c" * (size - links)
        found += nauty.run("labelg", "-g", f"-f{colours}", data=alike)
    return found


def with_frames(lines: list[str], links: int) -> list[str]:
    """Return each graph with every link in turn as link 0."""
    found = []
    for line in lines:
        graph = nx.from_graph6_bytes(line.encode())
        for frame in range(links):
            moved = nx.empty_graph(len(graph))
            place = {frame: 0, 0: frame}
            moved.add_edges_from((place.get(a, a), place.get(b, b)) for a, b in graph.edges)
            found.append(nx.to_graph6_bytes(moved, header=False).decode().strip())
    return found
