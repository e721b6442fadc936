"""Branch and prune compiled: all solutions of a compiled system in a box, depth first, with epsilon-inflation.

See theory/interval-tests 2.  A box in work is a row of bounds; the waiting ones are a stack.  Invariant: every solution
of the start box lies in a waiting box, in a kept one, or in the domain of a kept one that is UNIQUE, which then holds
that solution.  So the search can be stopped between any two boxes.
"""

import numpy as np

from graphsynth.core.compilation import kernel
from graphsynth.intervals.kernels.krawczyk import EMPTY, EXISTS, UNDECIDED, UNIQUE, test, types_of_system
from graphsynth.intervals.kernels.rounding import add_down, add_up

WAITING, KEPT, TESTED, PROVED = 0, 1, 2, 3
DONE, LIMIT, ROOM = 0, 1, 2
GAIN, ROUNDS, INFLATIONS = 0.9, 12, 5


@kernel
def _shrink(xl, xh, kl, kh):
    """Replace a box by its part in K; returns whether a side became much shorter."""
    gains = False
    for i in range(xl.size):
        low, high = max(xl[i], kl[i]), min(xh[i], kh[i])
        gains = gains or high - low < GAIN * (xh[i] - xl[i])
        xl[i], xh[i] = low, high
    return gains


@kernel
def _inside(al, ah, bl, bh):
    """Whether a box lies in another."""
    inside = True
    for i in range(al.size):
        inside = inside and bl[i] <= al[i] and ah[i] <= bh[i]
    return inside


@kernel
def _apart(al, ah, bl, bh):
    """Whether two boxes have no point in common."""
    apart = False
    for i in range(al.size):
        apart = apart or ah[i] < bl[i] or bh[i] < al[i]
    return apart


@kernel
def _known(xl, xh, domain_lo, domain_hi, count):
    """Whether a box lies in the domain of a solution that has been found."""
    known = False
    for k in range(count):
        known = known or _inside(xl, xh, domain_lo[k], domain_hi[k])
    return known


@kernel
def _contract(equations, pl, ph, xl, xh, dl, dh, kl, kh, fl, fh, z, jl, jh, mid, y):
    """Test and shrink a box while it gains; the first proof counts, with its box in ``dl, dh``.

    Returns the status, the last norm and the number of tests.
    """
    found, norm, tests = UNDECIDED, np.inf, 0
    for _ in range(ROUNDS):
        result, norm = test(equations, xl, xh, pl, ph, kl, kh, fl, fh, z, jl, jh, mid, y)
        tests += 1
        if result == EMPTY:
            return EMPTY, norm, tests
        if (result == UNIQUE and found != UNIQUE) or (result == EXISTS and found == UNDECIDED):
            found = result
            dl[:], dh[:] = xl, xh
        if not _shrink(xl, xh, kl, kh):
            break
    return found, norm, tests


@kernel
def _beyond(equations, pl, ph, sl, sh, xl, xh, dl, dh, kl, kh, fl, fh, z, jl, jh, mid, y):
    """Epsilon-inflation of a box of the start box ``sl, sh``: UNIQUE (domain and K are set), EMPTY, or UNDECIDED.

    All solutions in the box lie in the larger one; if that has exactly one, outside the start box, the box has none.
    """
    n = xl.size
    dl[:], dh[:] = xl, xh
    for count in range(INFLATIONS):
        widest = 0.0
        for i in range(n):
            widest = max(widest, dh[i] - dl[i])
        for i in range(n):
            grow = 0.125 * (dh[i] - dl[i]) + 0.05 * widest + 4e-16 * max(-dl[i], dh[i]) + 1e-300
            dl[i], dh[i] = add_down(dl[i], -grow), add_up(dh[i], grow)
        result, norm = test(equations, dl, dh, pl, ph, kl, kh, fl, fh, z, jl, jh, mid, y)
        if result == UNIQUE:
            if _inside(kl, kh, sl, sh):
                return UNIQUE, count + 1
            return EMPTY if _apart(kl, kh, sl, sh) else UNDECIDED, count + 1
        if result == EMPTY:
            return EMPTY, count + 1
        if not norm < 1.0:
            return UNDECIDED, count + 1
        for i in range(n):
            dl[i], dh[i] = min(xl[i], kl[i]), max(xh[i], kh[i])
    return UNDECIDED, INFLATIONS


def _types_of_pave():
    from numba import int8, int64, types

    of_system, vector, matrix = types_of_system()
    return int64(types.FunctionType(of_system), *[vector] * 5, *[matrix] * 6, int8[::1], int64[::1], int64)


@kernel(signature=_types_of_pave)
def pave(
    equations, sl, sh, pl, ph, tolerance, stack_lo, stack_hi, kept_lo, kept_hi, domain_lo, domain_hi, status, state,
    limit,
):  # fmt: skip
    """Treat waiting boxes until none waits, ``limit`` boxes have been tested, or an array is full.

    ``sl, sh`` is the start box, ``tolerance`` (n,) the widths at which boxes are kept undecided; ``state`` counts
    waiting, kept, tested and UNIQUE boxes, and the search goes on where it was.  Kept UNIQUE boxes come first.
    """
    n = sl.size
    rows = np.empty((9, n))
    xl, xh, dl, dh, kl, kh, fl, fh, z = rows[0], rows[1], rows[2], rows[3], rows[4], rows[5], rows[6], rows[7], rows[8]
    jl, jh, mid, y = np.empty((n, n)), np.empty((n, n)), np.empty((n, n)), np.empty((n, n))
    while state[WAITING] > 0:
        if state[TESTED] >= limit:
            return LIMIT
        waiting, kept = state[WAITING] - 1, state[KEPT]
        if waiting + 2 > stack_lo.shape[0] or kept == kept_lo.shape[0]:
            return ROOM
        state[WAITING] = waiting
        xl[:], xh[:] = stack_lo[waiting], stack_hi[waiting]
        if _known(xl, xh, domain_lo, domain_hi, state[PROVED]):
            continue
        found, norm, tests = _contract(equations, pl, ph, xl, xh, dl, dh, kl, kh, fl, fh, z, jl, jh, mid, y)
        state[TESTED] += tests
        if found == EMPTY:
            continue
        if found == UNDECIDED and norm < 0.5:
            found, tests = _beyond(equations, pl, ph, sl, sh, xl, xh, dl, dh, kl, kh, fl, fh, z, jl, jh, mid, y)
            state[TESTED] += tests
            if found == EMPTY:
                continue
            if found == UNIQUE:
                xl[:], xh[:] = kl, kh
                for _ in range(ROUNDS):
                    test(equations, xl, xh, pl, ph, kl, kh, fl, fh, z, jl, jh, mid, y)
                    state[TESTED] += 1
                    if not _shrink(xl, xh, kl, kh):
                        break
        if found == UNIQUE:
            twice = _known(xl, xh, domain_lo, domain_hi, state[PROVED])
            for k in range(state[PROVED]):
                twice = twice or _inside(kept_lo[k], kept_hi[k], dl, dh)
            if twice:
                continue
        widest, size, small = 0, -1.0, True
        for i in range(n):
            ratio = (xh[i] - xl[i]) / tolerance[i]
            small = small and ratio <= 1.0
            if ratio > size:
                widest, size = i, ratio
        middle = 0.5 * (xl[widest] + xh[widest])
        if found != UNDECIDED or small or not xl[widest] < middle < xh[widest]:
            if found == UNDECIDED:
                dl[:], dh[:] = xl, xh
            row = kept
            if found == UNIQUE:  # these come first, so that `_known` looks at no others
                row = state[PROVED]
                kept_lo[kept], kept_hi[kept], status[kept] = kept_lo[row], kept_hi[row], status[row]
                domain_lo[kept], domain_hi[kept] = domain_lo[row], domain_hi[row]
                state[PROVED] += 1
            kept_lo[row], kept_hi[row], status[row] = xl, xh, found
            domain_lo[row], domain_hi[row] = dl, dh
            state[KEPT] += 1
            continue
        stack_lo[waiting], stack_hi[waiting] = xl, xh
        stack_lo[waiting + 1], stack_hi[waiting + 1] = xl, xh
        stack_lo[waiting, widest] = middle
        stack_hi[waiting + 1, widest] = middle
        state[WAITING] += 2
    return DONE
