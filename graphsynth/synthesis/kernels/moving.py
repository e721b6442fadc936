"""What all automorphisms but the identity contribute to a count."""

from __future__ import annotations

import numpy as np

from graphsynth.core.compilation import kernel
from graphsynth.synthesis.kernels.contracted import automorphisms
from graphsynth.synthesis.kernels.counting import TOO_LARGE, fixed_by
from graphsynth.synthesis.kernels.variables import load_graph


@kernel
def sum_moved(k, mults, start, stop, tables, work, out):
    """Sum the labellings fixed by each automorphism but the identity, for the contracted graphs ``mults[start:stop]``.

    ``out`` (2, stop - start): the order of the group, and the sum.  A graph without symmetry costs next to nothing.
    Returns 0, TOO_LARGE (a sum passes 2**62, or a group is too large), or NO_ROOM.
    """
    for h in range(start, stop):
        order = automorphisms(k, mults[h], work.perms)
        out[0, h - start] = order
        out[1, h - start] = 0
        if order == 1:
            continue
        m, sets = load_graph(k, mults[h], tables, work)
        if order < 0 or sets < 0:
            return TOO_LARGE
        for g in range(1, order):
            n = fixed_by(g, m, sets, tables, work)
            if n < 0:
                return n
            if out[1, h - start] > (np.int64(1) << 62) - n:
                return TOO_LARGE
            out[1, h - start] += n
    return 0
