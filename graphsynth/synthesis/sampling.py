"""Exactly uniform random mechanisms.

Of all pairs (g, x) with x a labelling fixed by the automorphism g, each orbit of labellings has as many as the group
has elements.  So: draw a contracted graph by its number of orbits, a pair of frame and g by the number of labellings
it fixes, and x uniformly among these.  Labellings are numbered without regard to sparsity; inadmissible ones are drawn
again, and so is what is not as wished.
"""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import partial
from itertools import accumulate
from random import Random
from typing import Any

import numpy as np

from graphsynth.core.errors import InfeasibleSpecError, SpecError, TooLargeError
from graphsynth.core.wording import whole
from graphsynth.structure.graph import MechanismGraph
from graphsynth.synthesis.chunks import Chunk, count_each, expansion_of, workspace
from graphsynth.synthesis.families import Family
from graphsynth.synthesis.kernels.counting import count_block, decode_fixed, open_fixed
from graphsynth.synthesis.kernels.expanding import expand_packed
from graphsynth.synthesis.kernels.layout import HEADER
from graphsynth.synthesis.made import EACH, Made
from graphsynth.synthesis.problem import EnumerationProblem

_PAIRS = 1 << 16
_MISSES = 10_000  # draws in a row that are not as wished, from which on a list is the better way


@dataclass(frozen=True)
class Sample(Made):
    """A sample as a work item: listed, and written, as what is enumerated."""

    problem: EnumerationProblem
    k: int
    seed: int
    weight: float = 1.0

    def graphs(self) -> Iterator[Any]:
        """Yield what is drawn."""
        return iter(sample(self.problem, self.k, self.seed))

    def work(self, purpose: int) -> float:
        """Estimate the work."""
        return EACH * self.k


def sampled(problem: EnumerationProblem, k: int, seed: int) -> EnumerationProblem:
    """State the listing of k random ones of what a problem lists; raises as `sample` does, for numbers at once."""
    drawn = Sample(problem, *_numbers(k, seed))
    title = f"{problem.title} sample={k} seed={seed}"
    return replace(problem, title=title, families=(), one_by_one=(drawn,), symmetry=0, wishes=None)


def _numbers(k: int, seed: int) -> tuple[int, int]:
    return whole(k, "k", 0, 10**9), whole(seed, "seed", -(10**100), 10**100)  # None would draw others every time


def sample(problem: EnumerationProblem, k: int, seed: int) -> list[Any]:
    """Draw k graphs of a problem, or what they stand for, independently and exactly uniformly.

    Raises `SpecError` if k is negative, the seed no whole number, the problem asks for a symmetry or for levels, or
    hardly any are as wished; `InfeasibleSpecError` if there is nothing to draw from.
    """
    k, seed = _numbers(k, seed)
    if problem.symmetry or any(family.levels for family in problem.families):
        raise SpecError("sampling with a required symmetry or wanted levels is not supported: list and choose")
    urns = [(*urn, made.chain) for made in problem.one_by_one for urn in made.urns()]
    for family in problem.families:
        graphs = len(family.graphs)
        counts = count_each(family, 0, graphs).tolist() if graphs else ()
        urns += [
            (count, partial(_draw, family, h), Chunk(family, h, h).chain) for h, count in enumerate(counts) if count
        ]
    sums = list(accumulate(weight for weight, _, _ in urns))
    if k and (not sums or sums[-1] == 0):
        raise InfeasibleSpecError(f"no mechanism answers the question ({problem.title}): nothing to draw from")
    random = Random(seed)
    drawn: list[Any] = []
    misses = 0
    while len(drawn) < k:
        _, draw, chain_of = urns[bisect_right(sums, random.randrange(sums[-1]))]
        if (graph := draw(random)) is None:
            continue
        chain = chain_of(graph)
        if problem.wishes is None or problem.wishes.fit(chain):
            drawn.append(chain)
            misses = 0
        elif (misses := misses + 1) == _MISSES:
            raise SpecError(f"none of {_MISSES} random ones is as wished ({problem.title}): list and choose")
    return drawn


def _draw(family: Family, h: int, random: Random) -> MechanismGraph:
    tables = family.edge_labels.tables
    work = workspace(family.edge_labels, 1 << 20)
    mult = family.graphs[h]
    table = np.empty((_PAIRS, 5), np.int64)
    block = family.vertices, family.graphs, h, h + 1, family.frames, family.frame_degree
    count = count_block(*block, tables, work, np.empty(1, np.int64), table)
    if count < 0:
        raise TooLargeError("a contracted graph has too many symmetries to draw from: fix more of the question")
    rows = table[:count].tolist()
    # orbits of a frame = sum of fixed / kept: put the frames over a common denominator
    common = int(np.lcm.reduce([row[3] for row in rows]))
    sums = list(accumulate(fixed * (common // kept) for *_, kept, fixed in rows))
    mode, frame, member, _, _ = rows[bisect_right(sums, random.randrange(sums[-1]))]
    variables, classes, sets, ways = open_fixed(family.vertices, mult, mode, frame, member, tables, work)
    row = np.zeros((1, HEADER + family.loops + family.vertices), np.int32)
    while not decode_fixed(variables, classes, sets, random.randrange(ways), tables, work, row[0]):
        pass
    row[0, :HEADER] = h, mode, frame
    out = np.empty((1, 3 * family.joints), np.uint8)
    expansion = expansion_of(family.edge_labels, family.levels)
    expand_packed(family.vertices, family.links, family.graphs, row, 1, expansion, out)
    return MechanismGraph._unchecked(family.links, out.tobytes(), 0 if family.framed else None, family.space)
