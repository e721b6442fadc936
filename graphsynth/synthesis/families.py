"""Families: sets of chains that one kind of contracted graph and one edge_labels of labels generate; and rings.

A ring of links has a single loop and no contracted graph; rings are told apart by the order of their joint mobilities.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from functools import lru_cache
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from graphsynth.core.errors import SpecError, TooLargeError
from graphsynth.core.wording import shown, whole
from graphsynth.synthesis.contracted import contracted_graphs
from graphsynth.synthesis.edge_labels import SLIDER, EdgeLabels, edge_labels_for, may_slide
from graphsynth.synthesis.kernels.counting import FRAME_NONE, FRAME_PATH, FRAME_VERTEX
from graphsynth.synthesis.kernels.layout import NO_SLIDING_LOOP

if TYPE_CHECKING:
    from graphsynth.structure.graph import MechanismGraph
    from graphsynth.structure.system.assortment import LinkAssortment

MOST_LINKS = 255

Levels = tuple[tuple[int, int, int], ...]
"""Wanted sizes of adjacency levels: (level, lowest, highest); negative levels count from the last."""


@dataclass(frozen=True)
class Family:
    """All chains (or mechanisms) with given numbers of loops, of links with three or more joints, and of joints."""

    space: int  # mobility Pi of the space
    mobility: int  # W; 0 for Baranov trusses
    loops: int  # independent loops, at least 2
    vertices: int  # vertices of the contracted graph
    binary_links: int  # binary links on its edges (a binary frame included)
    higher: tuple[tuple[int, int], ...]  # ``(i, p_i)`` for mobilities i >= 2 that occur
    frames: int = FRAME_NONE  # sum of FRAME_NONE (chains), FRAME_VERTEX, FRAME_PATH (binary frame)
    frame_degree: int = 0  # joints of a frame that is a vertex of the contracted graph; 0: any
    degrees: tuple[int, ...] | None = None  # the sorted degrees the contracted graph must have
    levels: Levels = ()  # wanted sizes of adjacency levels
    #: vertices that are multiple joints; signatures of problems do without it
    pins: int = field(default=0, repr=False)
    rules: int = field(default=0, repr=False)  # of prismatic joints, which are among ``higher``

    @property
    def links(self) -> int:
        """Number of links N, the frame included; each multiple joint is one more."""
        return self.vertices + self.binary_links

    @property
    def joints(self) -> int:
        """Number of joints p; with multiple joints, of links on joints that are not simple and of simple joints."""
        return self.loops + self.links - 1

    @property
    def framed(self) -> bool:
        """Whether a frame is chosen."""
        return self.frames != FRAME_NONE

    @property
    def edge_labels(self) -> EdgeLabels:
        """The labels of the paths."""
        numbers = self.space, self.mobility, self.binary_links, self.higher, self.loops, self.vertices
        return edge_labels_for(*numbers, self.pins > 0, self.rules)

    @property
    def graphs(self) -> NDArray[np.uint8]:
        """Multiplicity matrices ``(graphs, k, k)`` of the contracted graphs."""
        if self.pins:
            return _coloured(self.loops, self.vertices, self.pins, self.mobility if self.mobility > 1 else 0)
        return _graphs(self.loops, self.vertices, self.degrees)


@lru_cache(maxsize=64)
def _graphs(loops: int, vertices: int, degrees: tuple[int, ...] | None) -> NDArray[np.uint8]:
    mults = contracted_graphs(loops, vertices)
    if degrees is None:
        return mults
    found = np.sort(mults.sum(axis=2, dtype=np.int64), axis=1)
    chosen = np.ascontiguousarray(mults[(found == np.array(degrees)).all(axis=1)])
    chosen.setflags(write=False)  # the kernels are compiled once, for read-only lists
    return chosen


@lru_cache(maxsize=4)  # some are tens of megabytes
def _coloured(loops: int, vertices: int, pins: int, loose: int) -> NDArray[np.uint8]:
    from graphsynth.synthesis.kernels.colouring import colour_graphs

    mults = contracted_graphs(loops, vertices)
    count = colour_graphs(vertices, mults, pins, loose, np.zeros((0, vertices, vertices), np.uint8))
    if count < 0:
        raise TooLargeError("a contracted graph has too many symmetries: ask for fewer links")
    found = np.zeros((count, vertices, vertices), np.uint8)
    colour_graphs(vertices, mults, pins, loose, found)
    found.setflags(write=False)  # the kernels are compiled once, for read-only lists
    return found


def chain_numbers(
    links: Any, mobility: Any, space: Any, joints_by_mobility: Any, *, least: int = 1
) -> tuple[int, int, int, dict[int, int]]:
    """Return N, W >= ``least``, Pi and the numbers of joints by mobility as plain integers within their bounds.

    Raises `SpecError` for anything else.
    """
    links = whole(links, "links", 2, MOST_LINKS)
    mobility = whole(mobility, "mobility", 0, 50)
    if mobility < least:
        raise SpecError("mobility = 0 must be at least 1: Baranov trusses are the structures without mobility")
    space = whole(space, "space", 2, 6)
    if not isinstance(joints_by_mobility, Mapping | None):
        raise SpecError(
            f"joints_by_mobility = {shown(joints_by_mobility)} must be a mapping from the mobility of a joint to a "
            "number of joints, as in {2: 1}"
        )
    higher: dict[int, int] = {}
    for kind, count in (joints_by_mobility or {}).items():
        i = whole(kind, "joints_by_mobility: the mobility of a joint", 1, space - 1)
        higher[i] = whole(count, f"p{i}", 0, 100)
    return links, mobility, space, higher


def chain_joints(links: int, mobility: int, space: int, higher: Mapping[int, int]) -> int | None:
    """Return p_1 of a chain from W = Pi (N - 1) - sum_i p_i (Pi - i), or None when it is not a whole number >= 0."""
    rest = space * (links - 1) - mobility - sum(count * (space - i) for i, count in higher.items() if i > 1)
    joints, remainder = divmod(rest, space - 1)
    if remainder or joints < 0 or higher.get(1, joints) != joints:
        return None
    return joints


def chain_families(links: int, mobility: int, space: int, higher: Mapping[int, int], framed: bool) -> list[Family]:
    """List the families of non-fractionated chains with two or more loops (with every frame, if ``framed``).

    With mobility 0 they are Baranov trusses, or Assur groups.
    """
    lower = chain_joints(links, mobility, space, higher)
    if lower is None:
        return []
    frames = FRAME_VERTEX | FRAME_PATH if framed else FRAME_NONE
    placed = tuple(sorted((i, count) for i, count in higher.items() if i > 1 and count))
    loops = lower + sum(count for _, count in placed) - links + 1
    return [
        Family(space, mobility, loops, vertices, links - vertices, placed, frames)
        for vertices in range(2, min(2 * (loops - 1), links) + 1)
    ]


def mechanism_families(assortment: LinkAssortment, levels: Levels = ()) -> list[Family]:
    """List the families of non-fractionated mechanisms with a given assortment: none or one, for two or more loops."""
    frame = assortment.frame_joints
    kinds = {a: count for a, count in assortment.n_a.items() if a >= 3 and count}
    degrees = sorted([a for a, count in kinds.items() for _ in range(count)] + ([frame] if frame >= 3 else []))
    if assortment.loops < 2 or frame < 2 or len(degrees) < 2 or assortment.mobility < 1:
        return []
    if assortment.frame_loops != frame - 1:
        return []  # the links without the frame fall apart: fractionated
    higher = tuple((i, count) for i, count in enumerate(assortment.p_i, 1) if i > 1 and count)
    return [
        Family(
            assortment.space,
            assortment.mobility,
            assortment.loops,
            len(degrees),
            assortment.n_a.get(2, 0) + (frame == 2),
            higher,
            FRAME_PATH if frame == 2 else FRAME_VERTEX,
            0 if frame == 2 else frame,
            tuple(degrees),
            levels,
        )
    ]


def multiple_joint_families(links: int, mobility: int, pins: int, framed: bool) -> list[Family]:
    """List the families of planar chains with so many multiple joints (1 or more; with every frame, if ``framed``).

    The numbers are such that there are two loops or more.
    """
    loops = (links - 1 - mobility) // 2
    frames = FRAME_VERTEX | FRAME_PATH if framed else FRAME_NONE
    return [
        Family(3, mobility, loops, vertices, links - vertices + pins, (), frames, pins=pins)
        for vertices in range(max(2, pins), 2 * loops - 1)
    ]


def slider_families(links: int, mobility: int, sliders: int, rules: int, framed: bool) -> list[Family]:
    """List the families of planar chains with so many prismatic joints (with every frame, if ``framed``)."""
    plain = chain_families(links, mobility, 3, {}, framed)
    return [replace(family, higher=((SLIDER, sliders),), rules=rules) for family in plain]


def _sequences(content: dict[int, int]) -> Iterator[tuple[int, ...]]:
    """Yield every arrangement of a multiset, in lexicographic order."""
    if not any(content.values()):
        yield ()
        return
    for value in sorted(content):
        if content[value]:
            content[value] -= 1
            for rest in _sequences(content):
                yield (value, *rest)
            content[value] += 1


def _may_slide(sequence: tuple[int, ...], rules: int) -> bool:
    """Tell whether a ring has the revolute joints that the rules of prismatic joints want."""
    turns = len(sequence) - sequence.count(SLIDER)
    return may_slide((1, *sequence, sequence[0], 1), rules) and (turns >= 2 or not rules & NO_SLIDING_LOOP)


def rings(
    links: int, mobility: int, space: int, higher: Mapping[int, int], framed: bool, rules: int = 0
) -> Iterator[MechanismGraph]:
    """Yield the chains (mechanisms, if ``framed``) that are one ring of links, each once.

    Joint i connects links i and i + 1 modulo N, so with the frame at link 0 the only symmetry left is the reflection.
    Any two links of a ring are apart by at least one joint, so every ring of mobility W >= 1 is admissible; mobility 0
    gives the ring that is a Baranov truss.  Two links and their only joint count as the smallest chain.

    >>> [graph.to_text() for graph in rings(4, 1, 3, {}, True)]
    ['Cl f0']
    """
    sliders = higher.get(SLIDER, 0)
    higher = {i: count for i, count in higher.items() if i not in (1, SLIDER)}
    lower = chain_joints(links, mobility, space, higher)
    content = {1: (lower or 0) - sliders, SLIDER: sliders} | higher
    if lower is None or lower < sliders or sum(content.values()) != (links if links > 2 else 1):
        return
    from graphsynth.structure.graph import MechanismGraph

    if links == 2:
        yield MechanismGraph(2, [(0, 1, mobility)], frame=0 if framed else None, space=space)
        return
    shifts = range(1 if framed else links)
    for sequence in _sequences(content):
        # no symmetry of the ring (only the reflection that keeps the frame, if framed) makes it smaller
        if all(sequence <= turned[i:] + turned[:i] for turned in (sequence, sequence[::-1]) for i in shifts):
            if not _may_slide(sequence, rules):
                continue
            joints = [(i, (i + 1) % links, 2 if f == SLIDER else f) for i, f in enumerate(sequence)]
            yield MechanismGraph(links, joints, frame=0 if framed else None, space=space)
