"""Labels of the edges of contracted graphs: types of paths of binary links, and multisets of them.

A path of l binary links between two vertices of the contracted graph is of the type given by its l + 1 joint
mobilities, in order.  It adds Pi*l - sum(Pi - f) = F - Pi = -d to the mobility of the chain, d = Pi - F being its
weight.  All paths between two vertices together form a class; its label is the multiset of their types, read from the
lower vertex to the higher one.  In a mechanism whose frame is a binary link, one link of one path is marked.
"""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache
from itertools import pairwise, product
from operator import add

import numpy as np
from numpy.typing import NDArray

from graphsynth.core.errors import TooLargeError
from graphsynth.synthesis.kernels.layout import (
    BETWEEN_LINKS,
    BETWEEN_PINS,
    COPIES_MASK,
    GIRTH,
    KIND_SHIFT,
    LONGEST,
    LOOSE,
    NO_SLIDING_LINK,
    NO_SLIDING_LOOP,
    TO_PIN,
    Tables,
)

PathType = tuple[int, ...]
_MAX_LABELS = 2_000_000
#: Stands for a prismatic joint, which has mobility 1 as a revolute one, in types of paths and in ``higher``.
SLIDER = 9
#: Besides the rules of the kernels: prismatic joints only between two binary links with a revolute joint each.
CYLINDERS = 4
_DIGIT = 8


def freedom(path: PathType) -> int:
    """Return the sum F of the mobilities of a path."""
    return sum(path) - (SLIDER - 1) * path.count(SLIDER)


def may_slide(path: PathType, rules: int) -> bool:
    """Tell whether the binary links of a path have the revolute joints that the rules want."""
    cylinders = not rules & CYLINDERS or (path[0] != SLIDER and path[-1] != SLIDER)
    return cylinders and not (rules & (NO_SLIDING_LINK | CYLINDERS) and (SLIDER, SLIDER) in pairwise(path))


@dataclass(frozen=True, slots=True)
class EdgeLabel:
    """What a class carries: the types of its parallel paths, and the marked (frame) link if any.

    The marked path comes first, the others sorted; ``mark`` is 0, or the position 1..l of the frame among the binary
    links of the first path.
    """

    paths: tuple[PathType, ...]
    mark: int

    def reversed(self) -> EdgeLabel:
        """Return the label read from the other end."""
        paths = [path[::-1] for path in self.paths]
        if self.mark:
            return EdgeLabel((paths[0], *sorted(paths[1:])), len(paths[0]) - self.mark)
        return EdgeLabel(tuple(sorted(paths)), 0)

    def cover(self, rules: int, length: Callable[[PathType], int]) -> int:
        """Return what the label gives to links and loops: see ``graphsynth.synthesis.kernels.covers``."""
        if rules >> GIRTH:
            shortest = min(map(length, self.paths))
            return (shortest == 1) + 4 * min(LONGEST, shortest)
        low, high = (any(path[end] != SLIDER for path in self.paths) for end in (0, -1))
        fewest = min(len(path) - path.count(SLIDER) for path in self.paths)
        return low + 2 * high + 4 * min(2, fewest)

    def fold(self) -> int:
        """Return the largest number of equal paths, the marked one excluded."""
        free = self.paths[1:] if self.mark else self.paths
        return max(Counter(free).values(), default=0)


@dataclass(frozen=True)
class EdgeLabels:
    """All labels that can occur in chains of one kind."""

    space: int  # mobility Pi of the space, 2..6
    mobility: int  # W of the chain; 0 stands for Baranov trusses, where every path has d >= 1
    binary_links: int  # number of binary links to place on the paths
    higher: tuple[tuple[int, int], ...]  # ``(i, p_i)`` for every joint mobility i >= 2 with p_i > 0
    multiplicities: tuple[int, ...]  # numbers of parallel paths that occur
    #: the two end vertices are the whole contracted graph (only then may a Baranov truss have weight Pi there)
    whole: bool
    pins: bool = False  # some vertices are multiple joints
    rules: int = 0  # of prismatic joints: NO_SLIDING_LINK + NO_SLIDING_LOOP + CYLINDERS; or wishes, from GIRTH on

    @property
    def _lend(self) -> int:
        """Freedom that paths of negative weight may add; one more than W - 1 where all the others are one link."""
        return self.mobility - (not self.pins) if self.mobility > 1 else 0

    @property
    def limits(self) -> tuple[int, ...]:
        """Resources to use up: binary links, joints of each higher mobility, and freedom to lend, the last."""
        return (self.binary_links, *(count for _, count in self.higher), self._lend)

    def _cost(self, path: PathType) -> tuple[int, ...]:
        return (len(path) - 1, *(path.count(i) for i, _ in self.higher), max(0, freedom(path) - self.space))

    def _fits(self, cost: tuple[int, ...]) -> bool:
        return all(c <= limit for c, limit in zip(cost, self.limits))

    @cached_property
    def path_types(self) -> tuple[PathType, ...]:
        """Every path that fits the limits, in lexicographic order."""
        lightest = 1 if self.mobility == 0 else -self._lend
        mobilities = (1, *(i for i, _ in self.higher))
        longest = min(self.space - lightest, self.binary_links + 1)
        found = [
            path
            for length in range(1, longest + 1)
            for path in product(mobilities, repeat=length)
            if self.space - freedom(path) >= lightest and self._fits(self._cost(path)) and may_slide(path, self.rules)
        ]
        return tuple(sorted(found))

    def _multisets(
        self, count: int, first: int, cost: tuple[int, ...], weight: int, direct: bool
    ) -> Iterator[tuple[PathType, ...]]:
        if count == 0:
            yield ()
            return
        heaviest = self.space if self.mobility == 0 and self.whole else self.space - 1
        for i in range(first, len(self.path_types)):
            path = self.path_types[i]
            if len(path) == 1 and direct:
                continue
            total = tuple(a + b for a, b in zip(cost, self._cost(path)))
            heavier = weight + max(0, self.space - freedom(path))
            if heavier > heaviest or not self._fits(total):
                continue
            for rest in self._multisets(count - 1, i, total, heavier, direct or len(path) == 1):
                yield (path, *rest)

    def _fits_ends(self, paths: tuple[PathType, ...], ends: int) -> bool:
        """Tell whether parallel paths may connect such ends: no set of two links or more is rigid.

        Paths of negative weight add freedom and never matter; of the others, one that is a joint on the same link, or
        the only link between two multiple joints, may take all freedom.
        """
        if ends == BETWEEN_LINKS:
            return True
        stiff = [path for path in paths if freedom(path) <= self.space]
        if ends == LOOSE:
            return not stiff
        shortest = 1 if ends == TO_PIN else 2
        one = len(stiff) == 1 and len(stiff[0]) == shortest
        weight = sum(self.space - freedom(path) for path in stiff)
        return one or (weight <= self.space - 1 - shortest and (ends == TO_PIN or bool(stiff)))

    @property
    def _girth(self) -> int:
        return self.rules >> GIRTH & LONGEST

    def _length(self, ends: int) -> Callable[[PathType], int]:
        """Return what measures paths in joints; among multiple joints in halves, of which one counts at an end."""
        return (lambda path: 2 * len(path) - min(ends, BETWEEN_PINS)) if self.pins else len

    def _turns(self, paths: tuple[PathType, ...], ends: int) -> bool:
        """Tell whether every loop of two of the paths has two revolute joints, if it has to, or is long enough."""
        if len(paths) > 1 and sum(sorted(map(self._length(ends), paths))[:2]) < self._girth:
            return False
        fewest = sorted(len(path) - path.count(SLIDER) for path in paths)[:2]
        return not self.rules & NO_SLIDING_LOOP or len(paths) == 1 or sum(fewest) >= 2

    def labels(self, connection: int, marked: bool) -> list[EdgeLabel]:
        """List the labels of a class, given as an entry of the matrix of the contracted graph.

        Raises `TooLargeError` for more labels than the kernels are laid out for.
        """
        ends, multiplicity = divmod(connection, COPIES_MASK + 1)
        zero = (0,) * len(self.limits)
        if not marked:
            found = [EdgeLabel(paths, 0) for paths in self._multisets(multiplicity, 0, zero, 0, False)]
        else:
            found = []
            for path in self.path_types:
                weight = max(0, self.space - freedom(path))
                for paths in self._multisets(multiplicity - 1, 0, self._cost(path), weight, False):
                    found.extend(EdgeLabel((path, *paths), mark) for mark in range(1, len(path)))
        found = [label for label in found if self._fits_ends(label.paths, ends) and self._turns(label.paths, ends)]
        if len(found) > _MAX_LABELS:
            raise TooLargeError(
                f"{len(found)} kinds of {multiplicity} parallel paths (bound {_MAX_LABELS}): "
                "fix fewer joint mobilities or fewer links"
            )
        return found

    def weight(self, label: EdgeLabel) -> int:
        """Return D, the weight that counts in the sparsity conditions."""
        return sum(max(0, self.space - freedom(path)) for path in label.paths)

    def cost(self, label: EdgeLabel) -> tuple[int, ...]:
        """Return the resources a label uses."""
        costs = [self._cost(path) for path in label.paths]
        return tuple(map(sum, zip(*costs)))

    def labellings(self, pattern: tuple[int, ...]) -> float:
        """Count the labellings of a contracted graph, sparsity and symmetry ignored.

        ``pattern``: ``pattern[mu - 1]`` classes consist of mu parallel paths.
        """
        return sum(count for used, count in self._ways(pattern).items() if used[:-1] == self.limits[:-1])

    def _ways(self, pattern: tuple[int, ...]) -> dict[tuple[int, ...], float]:
        """Count the choices for some classes by the resources they use."""
        if pattern not in self._known_ways:
            top = max(i for i, classes in enumerate(pattern) if classes)
            fewer = (*pattern[:top], pattern[top] - 1, *pattern[top + 1 :])
            ways: defaultdict[tuple[int, ...], float] = defaultdict(float)
            for used, count in self._ways(fewer).items():
                for cost, labels in self._costs[top + 1]:
                    total = tuple(map(add, used, cost))
                    if self._fits(total):
                        ways[total] += count * labels
            self._known_ways[pattern] = ways
        return self._known_ways[pattern]

    @cached_property
    def _known_ways(self) -> dict[tuple[int, ...], dict[tuple[int, ...], float]]:
        nothing = (0,) * max(self.multiplicities)
        return {nothing: {(0,) * len(self.limits): 1.0}}

    @cached_property
    def _costs(self) -> dict[int, tuple[tuple[tuple[int, ...], int], ...]]:
        return {
            multiplicity: tuple(Counter(map(self.cost, self.by_kind[2 * multiplicity])).items())
            for multiplicity in self.multiplicities
        }

    @cached_property
    def resources(self) -> int:
        """Number of resource states."""
        return int(np.prod([limit + 1 for limit in self.limits]))

    @cached_property
    def by_kind(self) -> list[list[EdgeLabel]]:
        """Labels by kind ``2 * multiplicity + marked``; empty for multiplicities that do not occur."""
        top = max(self.multiplicities)
        kinds: list[list[EdgeLabel]] = []
        for kind in range(2 * top + 2):
            multiplicity, marked = divmod(kind, 2)
            kinds.append(self.labels(multiplicity, bool(marked)) if multiplicity in self.multiplicities else [])
        return kinds

    @cached_property
    def flat(self) -> list[EdgeLabel]:
        """All labels, in the numbering of the kernels."""
        return [label for labels in self.by_kind for label in labels]

    @cached_property
    def tables(self) -> Tables:
        """The same for the kernels.

        Raises `TooLargeError` for more resource states than the kernels are laid out for.
        """
        if any(limit > 100 for limit in self.limits) or self.resources > 50_000:
            raise TooLargeError(f"{self.resources} resource states (bound 50000): ask for fewer links or higher pairs")
        # resources as an index (of mixed radix) and packed (eight bits a digit)
        steps = [1]
        for limit in self.limits[:-1]:
            steps.append(steps[-1] * (limit + 1))
        shifts = [_DIGIT * place for place in range(len(steps))]
        alike = []
        for label in self.flat:
            cost = self.cost(label)
            packed = sum(c << shift for c, shift in zip(cost, shifts))
            alike.append((self.weight(label), sum(c * step for c, step in zip(cost, steps)), packed))
        lengths = [self._length(kind // 2 >> KIND_SHIFT) for kind, labels in enumerate(self.by_kind) for _ in labels]
        asked = self.rules & ~CYLINDERS  # else nothing needs what labels give
        covers = [label.cover(self.rules, length) if asked else 0 for label, length in zip(self.flat, lengths)]
        reverse: list[int] = []
        kinds, group_kinds = [], []
        groups: list[tuple[int, ...]] = []
        heaviest = []
        for kind, labels in enumerate(self.by_kind):
            start = len(reverse)
            number = {label: start + i for i, label in enumerate(labels)}
            reverse += [number[label.reversed()] for label in labels]
            kinds.append((start, len(reverse)))
            if kind % 2 == 0:
                heaviest.append(max((alike[i][0] for i in number.values()), default=0))
            for own_reverse in (False, True):
                members = [i for i in number.values() if not own_reverse or reverse[i] == i]
                found = Counter((*alike[i], covers[i]) for i in members)
                group_kinds.append((len(groups), len(groups) + len(found)))
                groups += [(*own, count, cover) for (*own, cover), count in sorted(found.items())]
        states = np.arange(self.resources)
        digits = [states // step % (limit + 1) for step, limit in zip(steps, self.limits)]
        packed_of = sum(digit << shift for digit, shift in zip(digits, shifts))
        folds = [label.fold() for label in self.flat]
        labels_of = [(*own, back, *more) for own, back, *more in zip(alike, reverse, folds, covers)]
        return Tables(
            kinds=_columns(kinds, 2),
            labels=_columns(labels_of, 6),
            group_kinds=_columns(group_kinds, 2),
            groups=_columns(groups, 5),
            heaviest=np.array(heaviest, np.int64),
            resources=np.array([packed_of, ~np.any(digits[:-1], axis=0)], np.int64),
            space=np.int64(self.space),
            target=np.int64(self.resources - 1),
            guard=np.int64(sum(0x80 << shift for shift in shifts)),
            rules=np.int64(self.rules),
            sliders=np.int64(max(self._girth - 2, dict(self.higher).get(SLIDER, 0))),
        )


def _columns(rows: Sequence[tuple[int, ...]], width: int) -> NDArray[np.int64]:
    """Rows of numbers as an array of their columns."""
    return np.ascontiguousarray(np.array(rows, np.int64).reshape(len(rows), width).T)


@lru_cache(maxsize=256)
def edge_labels_for(
    space: int,
    mobility: int,
    binary_links: int,
    higher: tuple[tuple[int, int], ...],
    loops: int,
    vertices: int,
    pins: bool = False,
    rules: int = 0,
) -> EdgeLabels:
    """Return the labels for all contracted graphs with the given numbers of loops and vertices."""
    multiplicities = [loops + 1] if vertices == 2 else range(1, loops)  # of paths between two of the vertices
    kinds = (BETWEEN_LINKS, TO_PIN, BETWEEN_PINS, LOOSE) if pins else (BETWEEN_LINKS,)
    connections = tuple(mu | ends << KIND_SHIFT for ends in kinds for mu in multiplicities)
    return EdgeLabels(space, mobility, binary_links, higher, connections, vertices == 2, pins, rules)
