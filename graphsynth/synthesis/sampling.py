"""Exactly uniform random mechanisms.

Of all pairs (g, x) with x a labelling fixed by the automorphism g, each orbit of labellings has as many as the group
has elements.  So: draw a contracted graph by its number of orbits, a pair of frame and g by the number of labellings
it fixes, and x uniformly among these.  Labellings are numbered without regard to sparsity; inadmissible ones are drawn
again.
"""

from __future__ import annotations

from bisect import bisect_right
from functools import partial
from itertools import accumulate
from random import Random

import numpy as np

from graphsynth.core.errors import InfeasibleSpecError, SpecError, TooLargeError
from graphsynth.core.wording import whole
from graphsynth.structure.graph import MechanismGraph
from graphsynth.synthesis.chunks import count_each, expansion_of, workspace
from graphsynth.synthesis.families import Family
from graphsynth.synthesis.kernels.counting import count_block, decode_fixed, open_fixed
from graphsynth.synthesis.kernels.expanding import expand_packed
from graphsynth.synthesis.kernels.layout import HEADER
from graphsynth.synthesis.problem import EnumerationProblem

_PAIRS = 1 << 16


def sample(problem: EnumerationProblem, k: int, seed: int) -> list[MechanismGraph]:
    """Draw k graphs of a problem, independently and exactly uniformly.

    Raises `SpecError` if k is negative, the seed no whole number, or the problem asks for a symmetry or for levels.
    Raises `InfeasibleSpecError` if there is nothing to draw from.
    """
    k, seed = whole(k, "k", 0, 10**9), whole(seed, "seed", -(10**100), 10**100)  # None would draw others every time
    if problem.symmetry or problem.wishes or any(family.levels for family in problem.families):
        raise SpecError("sampling with a required symmetry, wanted levels or wishes is not supported: list and choose")
    urns = [urn for made in problem.one_by_one for urn in made.urns()]
    for family in problem.families:
        graphs = len(family.graphs)
        counts = count_each(family, 0, graphs).tolist() if graphs else ()
        urns += [(count, partial(_draw, family, h)) for h, count in enumerate(counts) if count]
    sums = list(accumulate(weight for weight, _ in urns))
    if k and (not sums or sums[-1] == 0):
        raise InfeasibleSpecError(f"no mechanism answers the question ({problem.title}): nothing to draw from")
    random = Random(seed)
    drawn: list[MechanismGraph] = []
    while len(drawn) < k:
        graph = urns[bisect_right(sums, random.randrange(sums[-1]))][1](random)
        if graph is not None:
            drawn.append(graph)
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
