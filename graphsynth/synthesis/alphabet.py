"""Paths of binary links as words, parallel paths as labels: the alphabets of the enumerator.

A path of l binary links between two vertices of the contracted graph is written as the word of its l + 1 joint
mobilities.  It adds Pi*l - sum(Pi - f) = F - Pi = -d to the mobility of the chain, d = Pi - F being its weight.  All
paths between two vertices together form a class; its label is the multiset of their words, read from the lower
vertex to the higher one.  In a mechanism whose frame is a binary link, one link of one word is marked.
"""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property, lru_cache
from itertools import product
from operator import add

import numpy as np
from numpy.typing import NDArray

from graphsynth.core.errors import TooLargeError
from graphsynth.synthesis.kernels.layout import Tables

Word = tuple[int, ...]
_MAX_LABELS = 2_000_000
_DIGIT = 8


@dataclass(frozen=True, slots=True)
class Label:
    """What a class carries: its words, and the marked (frame) link if any.

    Attributes
    ----------
    words : tuple of Word
        One per parallel path; the marked word first, the others sorted.
    mark : int
        0, or the position 1..l of the frame among the binary links of the first word.
    """

    words: tuple[Word, ...]
    mark: int

    def reversed(self) -> Label:
        """Return the label read from the other end."""
        words = [word[::-1] for word in self.words]
        if self.mark:
            return Label((words[0], *sorted(words[1:])), len(words[0]) - self.mark)
        return Label(tuple(sorted(words)), 0)

    def fold(self) -> int:
        """Return the largest number of equal paths, the marked one excluded."""
        free = self.words[1:] if self.mark else self.words
        return max(Counter(free).values(), default=0)


@dataclass(frozen=True)
class Alphabet:
    """All labels that can occur in chains of one kind.

    Parameters
    ----------
    space : int
        Mobility Pi of the space, 2..6.
    mobility : int
        W of the chain; 0 stands for Baranov trusses, where every path has d >= 1.
    binary_links : int
        Number of binary links to place on the paths.
    higher : tuple of (int, int)
        ``(i, p_i)`` for every joint mobility i >= 2 with p_i > 0.
    multiplicities : tuple of int
        Numbers of parallel paths that occur.
    whole : bool
        The two end vertices are the whole contracted graph (only then may a Baranov truss have weight Pi there).
    """

    space: int
    mobility: int
    binary_links: int
    higher: tuple[tuple[int, int], ...]
    multiplicities: tuple[int, ...]
    whole: bool

    @property
    def limits(self) -> tuple[int, ...]:
        """Resources to use up: binary links, joints of each higher mobility, and freedom to lend (for W >= 2)."""
        lend = (self.mobility - 1,) if self.mobility > 1 else ()
        return (self.binary_links, *(count for _, count in self.higher), *lend)

    def _cost(self, word: Word) -> tuple[int, ...]:
        lend = (max(0, sum(word) - self.space),) if self.mobility > 1 else ()
        return (len(word) - 1, *(word.count(i) for i, _ in self.higher), *lend)

    def _fits(self, cost: tuple[int, ...]) -> bool:
        return all(c <= limit for c, limit in zip(cost, self.limits))

    @cached_property
    def words(self) -> tuple[Word, ...]:
        """Every word that fits the limits, in lexicographic order."""
        lightest = 1 if self.mobility == 0 else 1 - self.mobility
        mobilities = (1, *(i for i, _ in self.higher))
        longest = min(self.space - lightest, self.binary_links + 1)
        found = [
            word
            for length in range(1, longest + 1)
            for word in product(mobilities, repeat=length)
            if self.space - sum(word) >= lightest and self._fits(self._cost(word))
        ]
        return tuple(sorted(found))

    def _multisets(
        self, count: int, first: int, cost: tuple[int, ...], weight: int, direct: bool
    ) -> Iterator[tuple[Word, ...]]:
        if count == 0:
            yield ()
            return
        for i in range(first, len(self.words)):
            word = self.words[i]
            if len(word) == 1 and direct:
                continue
            total = tuple(a + b for a, b in zip(cost, self._cost(word)))
            heavier = weight + max(0, self.space - sum(word))
            if heavier > self._heaviest or not self._fits(total):
                continue
            for rest in self._multisets(count - 1, i, total, heavier, direct or len(word) == 1):
                yield (word, *rest)

    @property
    def _heaviest(self) -> int:
        return self.space if self.mobility == 0 and self.whole else self.space - 1

    def labels(self, multiplicity: int, marked: bool) -> list[Label]:
        """List the labels of a class of the given multiplicity.

        Raises `TooLargeError` for more labels than the kernels are laid out for.
        """
        zero = (0,) * len(self.limits)
        if not marked:
            found = [Label(words, 0) for words in self._multisets(multiplicity, 0, zero, 0, False)]
        else:
            found = []
            for word in self.words:
                weight = max(0, self.space - sum(word))
                for words in self._multisets(multiplicity - 1, 0, self._cost(word), weight, False):
                    found.extend(Label((word, *words), mark) for mark in range(1, len(word)))
        if len(found) > _MAX_LABELS:
            raise TooLargeError(
                f"{len(found)} kinds of {multiplicity} parallel paths (bound {_MAX_LABELS}): "
                "fix fewer joint mobilities or fewer links"
            )
        return found

    def weight(self, label: Label) -> int:
        """Return D, the weight that counts in the sparsity conditions."""
        return sum(max(0, self.space - sum(word)) for word in label.words)

    def cost(self, label: Label) -> tuple[int, ...]:
        """Return the resources a label uses."""
        costs = [self._cost(word) for word in label.words]
        return tuple(map(sum, zip(*costs)))

    def labellings(self, pattern: tuple[int, ...]) -> float:
        """Count the labellings of a contracted graph, sparsity and symmetry ignored.

        ``pattern``: ``pattern[mu - 1]`` classes consist of mu parallel paths.
        """
        exact = len(self.limits) - (self.mobility > 1)  # freedom to lend may be left over
        return sum(count for used, count in self._ways(pattern).items() if used[:exact] == self.limits[:exact])

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
        nothing = (0,) * max(self.multiplicities, default=0)
        return {nothing: {(0,) * len(self.limits): 1.0}}

    @cached_property
    def _costs(self) -> dict[int, tuple[tuple[tuple[int, ...], int], ...]]:
        return {
            multiplicity: tuple(Counter(map(self.cost, self.by_kind[2 * multiplicity])).items())
            for multiplicity in self.multiplicities
        }

    @cached_property
    def radix(self) -> tuple[int, ...]:
        """Step of each resource in the mixed-radix index."""
        steps = [1]
        for limit in self.limits[:-1]:
            steps.append(steps[-1] * (limit + 1))
        return tuple(steps)

    @cached_property
    def resources(self) -> int:
        """Number of resource states."""
        return int(np.prod([limit + 1 for limit in self.limits]))

    def _index(self, cost: tuple[int, ...]) -> int:
        return sum(c * step for c, step in zip(cost, self.radix))

    def _pack(self, cost: tuple[int, ...]) -> int:
        return sum(c << (_DIGIT * i) for i, c in enumerate(cost))

    @cached_property
    def by_kind(self) -> list[list[Label]]:
        """Labels by kind ``2 * multiplicity + marked``; empty for multiplicities that do not occur."""
        top = max(self.multiplicities, default=0)
        kinds: list[list[Label]] = []
        for kind in range(2 * top + 2):
            multiplicity, marked = divmod(kind, 2)
            kinds.append(self.labels(multiplicity, bool(marked)) if multiplicity in self.multiplicities else [])
        return kinds

    @cached_property
    def flat(self) -> list[Label]:
        """All labels, in the numbering of the kernels."""
        return [label for labels in self.by_kind for label in labels]

    @cached_property
    def tables(self) -> Tables:
        """The same for the kernels.

        Raises `TooLargeError` for more resource states than the kernels are laid out for.
        """
        if any(limit > 100 for limit in self.limits) or self.resources > 50_000:
            raise TooLargeError(f"{self.resources} resource states (bound 50000): ask for fewer links or higher pairs")
        return _tables(self)


def _tables(alphabet: Alphabet) -> Tables:
    lo, hi, weight, index, packed, reverse, fold = [], [], [], [], [], [], []
    g_lo, g_hi, g_weight, g_index, g_packed = [], [], [], [], []
    g_count: list[int] = []
    start = 0
    for labels in alphabet.by_kind:
        number = {label: start + i for i, label in enumerate(labels)}
        lo.append(start)
        for label in labels:
            cost = alphabet.cost(label)
            weight.append(alphabet.weight(label))
            index.append(alphabet._index(cost))
            packed.append(alphabet._pack(cost))
            reverse.append(number[label.reversed()])
            fold.append(label.fold())
        start += len(labels)
        hi.append(start)
        for own_reverse in (False, True):
            groups = Counter(
                (weight[i], index[i], packed[i]) for i in range(lo[-1], hi[-1]) if not own_reverse or reverse[i] == i
            )
            g_lo.append(len(g_count))
            for (w, i, p), count in sorted(groups.items()):
                g_weight.append(w)
                g_index.append(i)
                g_packed.append(p)
                g_count.append(count)
            g_hi.append(len(g_count))
    heaviest = [
        max(weight[lo[2 * mu] : hi[2 * mu]], default=0) for mu in range(max(alphabet.multiplicities, default=0) + 1)
    ]
    packed_of, final = _resource_states(alphabet)

    def ints(values: list[int] | list[list[int]]) -> NDArray[np.int64]:
        return np.array(values, dtype=np.int64)

    return Tables(
        kinds=ints([lo, hi]),
        labels=ints([weight, index, packed, reverse, fold]),
        group_kinds=ints([g_lo, g_hi]),
        groups=ints([g_weight, g_index, g_packed, g_count]),
        heaviest=ints(heaviest),
        resources=ints([packed_of, final]),
        space=np.int64(alphabet.space),
        target=np.int64(alphabet._index(alphabet.limits)),
        guard=np.int64(alphabet._pack((0x80,) * len(alphabet.limits))),
    )


def _resource_states(alphabet: Alphabet) -> tuple[list[int], list[int]]:
    exact = len(alphabet.limits) - (alphabet.mobility > 1)  # freedom to lend may be left over
    packed_of, final = [], []
    for state in range(alphabet.resources):
        digits = [state // step % (limit + 1) for step, limit in zip(alphabet.radix, alphabet.limits)]
        packed_of.append(alphabet._pack(tuple(digits)))
        final.append(int(not any(digits[:exact])))
    return packed_of, final


@lru_cache(maxsize=256)
def alphabet_for(
    space: int, mobility: int, binary_links: int, higher: tuple[tuple[int, int], ...], loops: int, vertices: int
) -> Alphabet:
    """Return the alphabet for all contracted graphs with the given numbers of loops and vertices."""
    most = loops + 1 if vertices == 2 else loops  # parallel paths between two of the vertices
    multiplicities = (loops + 1,) if vertices == 2 else tuple(range(1, most))
    return Alphabet(space, mobility, binary_links, higher, multiplicities, vertices == 2)
