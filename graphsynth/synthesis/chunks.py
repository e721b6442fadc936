"""Chunks of work: parts of a family that depend on the problem alone, never on who computes them."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from functools import lru_cache
from math import ceil
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from graphsynth.core.errors import TooLargeError
from graphsynth.synthesis.edge_labels import SLIDER, EdgeLabels
from graphsynth.synthesis.families import Family, Levels
from graphsynth.synthesis.kernels.counting import NO_ROOM, count_block
from graphsynth.synthesis.kernels.layout import HEADER, Work, make_work

if TYPE_CHECKING:
    from graphsynth.structure.graph import MechanismGraph
    from graphsynth.structure.multiple_joints import MultipleJointChain
    from graphsynth.structure.slider_chains import SliderChain
    from graphsynth.synthesis.kernels.expanding import Expansion
    from graphsynth.synthesis.wishes import Wishes

LISTING_SIZE = 200_000.0  # bound on the labellings of a chunk to list, before sparsity and symmetry
COUNTING_SIZE = 512  # contracted graphs in a chunk to count
_ROWS = 4096
_MOST_STATES = 1 << 24
_SLIDES = 2  # where a joint of mobility 2 would be written; chains with prismatic joints have none
_ONE_BYTE = 62  # most links whose number the text form writes in one byte, as the kernel does


@dataclass(frozen=True)
class Chunk:
    """Contracted graphs ``start..stop - 1`` of a family; of a single one, possibly one part of its search prefixes."""

    family: Family
    start: int
    stop: int
    part: int = 0
    parts: int = 1
    symmetry: int = 0
    weight: float = 1.0
    wishes: Wishes | None = field(default=None, repr=False)

    def count(self) -> int:
        """Count the chains (exact)."""
        if self.wishes:
            return sum(1 for _ in self.graphs())
        if self.symmetry or self.family.levels:
            return sum(len(block) for block in self.packed())
        return sum(map(int, count_each(self.family, self.start, self.stop)))

    def packed(self) -> Iterator[NDArray[np.uint8]]:
        """Stream the chains as blocks of packed joints ``(chains, 3 * joints)``."""
        from graphsynth.synthesis.kernels.expanding import expand_packed

        family = self.family
        expansion = expansion_of(family.edge_labels, family.levels)
        for rows, count in self._blocks():
            out = np.empty((count, 3 * family.joints), np.uint8)
            kept = expand_packed(family.vertices, family.links, family.graphs, rows, count, expansion, out)
            yield out[:kept]

    def graphs(self) -> Iterator[MechanismGraph]:
        """Stream the chains; of chains with multiple joints, the incidence graphs."""
        from graphsynth.structure.graph import MechanismGraph

        links, space = self.family.links, self.family.space
        frame = 0 if self.family.framed else None
        size = 3 * self.family.joints
        make = MechanismGraph._unchecked
        for block in self.packed():
            data = block.tobytes()
            for at in range(0, len(data), size):
                graph = make(links, data[at : at + size], frame, space)
                if self.wishes is None or self.wishes.fit(self.chain(graph)):
                    yield graph

    def chain(self, graph: MechanismGraph) -> MechanismGraph | MultipleJointChain | SliderChain:
        """Return what a graph stands for."""
        from graphsynth.structure.multiple_joints import MultipleJointChain
        from graphsynth.structure.slider_chains import SliderChain

        if self.family.pins:
            return MultipleJointChain(graph, self.family.pins)
        return SliderChain(graph) if SLIDER in dict(self.family.higher) else graph

    def texts(self) -> Iterator[tuple[bytes, int]]:
        """Stream the chains as (lines of the text form, number of lines)."""
        from graphsynth.synthesis.kernels.expanding import expand_text

        family = self.family
        if family.pins:
            yield from ((f"{graph.to_text()} m{family.pins}\n".encode(), 1) for graph in self.graphs())
            return
        slides = SLIDER in dict(family.higher)
        if family.links > _ONE_BYTE or self.wishes:
            lines = (f"{graph.to_text()}\n".encode() for graph in self.graphs())
            yield from ((line.replace(b" 2:", b" P:") if slides else line, 1) for line in lines)
            return
        form = family.space, max((i for i, _ in family.higher), default=1)
        line = 16 + family.links * family.links // 12 + 8 * sum(count for _, count in family.higher) + 4 * form[1]
        expansion = expansion_of(family.edge_labels, family.levels)
        out = np.empty(_ROWS * line, np.uint8)
        for rows, count in self._blocks():
            size, kept = expand_text(family.vertices, family.links, family.graphs, rows, count, expansion, *form, out)
            text = out[:size].tobytes()
            yield text.replace(b" 2:", b" P:") if slides else text, kept

    def _blocks(self) -> Iterator[tuple[NDArray[np.int32], int]]:
        """Stream the labellings as (rows, count); the rows are overwritten by the next step."""
        from graphsynth.synthesis.kernels.listing import list_rows, rewind

        family, labels = self.family, self.family.edge_labels
        work = make_work(labels.resources, key_words=1 << 14)
        rows = np.zeros((_ROWS, HEADER + family.loops + family.vertices), np.int32)
        rewind(self.start, self.part, self.parts, work)
        search = family.vertices, family.graphs, self.stop, family.frames, family.frame_degree, self.symmetry
        count = _ROWS
        while count == _ROWS:
            count = list_rows(*search, labels.tables, work, rows)
            if count < 0:
                raise TooLargeError(
                    "a contracted graph has too many symmetries or critical sets to list: ask for fewer links"
                )
            if count:
                yield rows, count


@lru_cache(maxsize=1)  # twenty megabytes
def _work(resources: int, key_words: int) -> Work:
    return make_work(resources, key_words=key_words)


def workspace(edge_labels: EdgeLabels, key_words: int = 1 << 18) -> Work:
    """Return the workspace of this process, large enough for an edge_labels."""
    return _work(max(1024, 1 << (edge_labels.resources - 1).bit_length()), key_words)


def estimates(family: Family) -> NDArray[np.float64]:
    """Bound the number of chains of each contracted graph from above: sparsity and symmetry ignored.

    The bound depends only on how many classes have how many parallel paths, and there are few such patterns.
    """
    pairs = family.graphs[:, *np.triu_indices(family.vertices, 1)]
    top = max(family.edge_labels.multiplicities)
    patterns = np.stack([(pairs == mu).sum(axis=1) for mu in range(1, top + 1)], axis=1)
    if not len(patterns):
        return np.zeros(0)
    kinds, which = np.unique(patterns, axis=0, return_inverse=True)
    bounds = np.array([family.edge_labels.labellings(tuple(kind)) for kind in kinds.tolist()], float)[which.ravel()]
    return bounds * family.links if family.framed else bounds


def cut(families: Sequence[Family], *, listing: bool, symmetry: int = 0) -> list[Chunk]:
    """Cut families into chunks, in the order in which their results are listed."""
    chunks = []
    for family in families:
        if not listing:
            count = len(family.graphs)
            chunks += [
                Chunk(family, at, min(at + COUNTING_SIZE, count), weight=float(min(COUNTING_SIZE, count - at)))
                for at in range(0, count, COUNTING_SIZE)
            ]
            continue
        bounds = estimates(family)
        if symmetry:  # only labellings fixed by an automorphism are searched: far fewer
            bounds = np.sqrt(bounds) * 100.0
        at = 0
        while at < len(bounds):
            if bounds[at] > 8 * LISTING_SIZE:
                parts = min(4096, ceil(bounds[at] / (4 * LISTING_SIZE)))
                chunks += [Chunk(family, at, at + 1, i, parts, symmetry, bounds[at] / parts) for i in range(parts)]
                at += 1
                continue
            sums = np.cumsum(bounds[at : at + 100_000])
            big = np.flatnonzero(bounds[at : at + len(sums)] > 8 * LISTING_SIZE)
            stop = int(np.searchsorted(sums, LISTING_SIZE)) + 1
            stop = min(stop, len(sums), int(big[0]) if len(big) else stop)
            chunks.append(Chunk(family, at, at + stop, 0, 1, symmetry, float(sums[stop - 1])))
            at += stop
    return chunks


def count_each(family: Family, start: int, stop: int) -> NDArray[np.int64]:
    """Count the chains of each contracted graph (exact).

    Raises `TooLargeError` if one contracted graph carries more than 2**62 chains.
    """
    edge_labels = family.edge_labels
    out = np.zeros(stop - start, np.int64)
    key_words = 1 << 18
    while True:
        work = workspace(edge_labels, key_words)
        block = family.vertices, family.graphs, start, stop, family.frames, family.frame_degree
        outcome = count_block(*block, edge_labels.tables, work, out, np.zeros((0, 5), np.int64))
        if outcome >= 0:
            return out
        key_words *= 4
        if outcome != NO_ROOM or key_words > _MOST_STATES:
            raise TooLargeError(
                f"a contracted graph with {family.vertices} vertices carries more than 2**62 chains, or too many "
                "partial ones: fix more of the question"
            )


@lru_cache(maxsize=64)
def expansion_of(edge_labels: EdgeLabels, levels: Levels) -> Expansion:
    """Return what the labels of a family stand for, and its wanted levels."""
    from graphsynth.synthesis.kernels.expanding import Expansion

    labels = edge_labels.flat
    number = {path: i for i, path in enumerate(edge_labels.path_types)}
    widest = max((len(label.paths) for label in labels), default=1)
    longest = max(map(len, edge_labels.path_types), default=1)
    paths = np.zeros((max(1, len(labels)), widest), np.int32)
    joints = np.zeros((max(1, len(number)), longest), np.uint8)
    for i, label in enumerate(labels):
        paths[i, : len(label.paths)] = [number[path] for path in label.paths]
    for path, i in number.items():
        joints[i, : len(path)] = [_SLIDES if mobility == SLIDER else mobility for mobility in path]
    return Expansion(
        label_paths=paths,
        label_mark=np.array([label.mark for label in labels] or [0], np.int32),
        path_length=np.array([len(path) for path in edge_labels.path_types] or [0], np.int32),
        path_joints=joints,
        level_index=np.array([level for level, _, _ in levels], np.int64),
        level_low=np.array([low for _, low, _ in levels], np.int64),
        level_high=np.array([high for _, _, high in levels], np.int64),
    )
