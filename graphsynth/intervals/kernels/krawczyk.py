"""Krawczyk's test compiled, and branch and prune with it, for systems that are themselves compiled.

A system is an ``njit`` function

    system(xl, xh, pl, ph, fl, fh, jl, jh, derivatives) -> bool

that writes enclosures of the equations into ``fl, fh`` (n,) and, if ``derivatives``, of the Jacobian into ``jl, jh``
(n, n), for unknowns ``xl, xh`` (n,) and parameters ``pl, ph`` (m,); it returns whether everything was defined and
continuous.  It is written with the scalar functions of this package (``arithmetic.add`` and so on) and decorated with
``@system``, which fixes its types: the test is then compiled once for all systems and calls them by their address.

A box here is an array (2, n): lower and upper bounds.
"""

from typing import NamedTuple

import numpy as np

from graphsynth.core.compilation import kernel, prepare_numba
from graphsynth.intervals.kernels import arithmetic as ia
from graphsynth.intervals.kernels.rounding import add_down, add_up

EMPTY, UNIQUE, EXISTS, UNDECIDED = 0, 1, 2, 3
#: Entries of the state of a search; why `pave` returns.
WAITING, KEPT, TESTED, PROVED = 0, 1, 2, 3
DONE, LIMIT, ROOM = 0, 1, 2
GAIN, ROUNDS, INFLATIONS = 0.9, 12, 5


class Workspace(NamedTuple):
    """Room for one test: equations, midpoint, Jacobian, its midpoint and the inverse of that."""

    fl: np.ndarray
    fh: np.ndarray
    z: np.ndarray
    jl: np.ndarray
    jh: np.ndarray
    mid: np.ndarray
    y: np.ndarray


def _types():
    """Types of a system for numba: of itself, of a vector, a matrix and an array of three dimensions."""
    from numba import boolean, float64

    vector, matrix, cube = float64[::1], float64[:, ::1], float64[:, :, ::1]
    return boolean(*[vector] * 6, matrix, matrix, boolean), vector, matrix, cube


def system(function):
    """Compile a system; a decorator."""
    from numba import njit

    prepare_numba()
    return njit(_types()[0], error_model="numpy")(function)


@kernel
def workspace(n):
    """Make room for n unknowns."""
    return Workspace(
        np.empty(n), np.empty(n), np.empty(n), np.empty((n, n)), np.empty((n, n)), np.empty((n, n)), np.empty((n, n))
    )


@kernel
def invert(a, y):
    """Inverse of ``a`` (destroyed) into ``y``; False if there is none."""
    n = a.shape[0]
    if n == 1:
        y[0, 0] = 1.0 / a[0, 0]
        return np.isfinite(y[0, 0])
    if n == 2:
        d = a[0, 0] * a[1, 1] - a[0, 1] * a[1, 0]
        y[0, 0], y[0, 1], y[1, 0], y[1, 1] = a[1, 1] / d, -a[0, 1] / d, -a[1, 0] / d, a[0, 0] / d
        return np.isfinite(y[0, 0]) and np.isfinite(y[0, 1]) and np.isfinite(y[1, 0]) and np.isfinite(y[1, 1])
    for i in range(n):
        for j in range(n):
            y[i, j] = 1.0 if i == j else 0.0
    # Gauss and Jordan with row pivoting
    for k in range(n):
        pivot = k
        for i in range(k + 1, n):
            if abs(a[i, k]) > abs(a[pivot, k]):
                pivot = i
        if not abs(a[pivot, k]) > 0.0:
            return False
        for j in range(n):
            a[k, j], a[pivot, j] = a[pivot, j], a[k, j]
            y[k, j], y[pivot, j] = y[pivot, j], y[k, j]
        inverse = 1.0 / a[k, k]
        for j in range(n):
            a[k, j] *= inverse
            y[k, j] *= inverse
        for i in range(n):
            if i != k:
                factor = a[i, k]
                for j in range(n):
                    a[i, j] -= factor * a[k, j]
                    y[i, j] -= factor * y[k, j]
    return np.isfinite(y.sum())


@kernel
def _image(x, k, room):
    """Write K into ``k``; return the status and the largest row sum of ``|I - Y L|`` (an estimate)."""
    z, fl, fh, jl, jh, y = room.z, room.fl, room.fh, room.jl, room.jh, room.y
    n = z.size
    empty = False
    inside, within, norm = True, True, 0.0
    for i in range(n):
        al, ah = z[i], z[i]
        rl, rh = 0.0, 0.0
        row = 0.0
        for j in range(n):
            # z - Y F(z)
            pl, ph = ia.scale(y[i, j], fl[j], fh[j])
            al, ah = ia.subtract(al, ah, pl, ph)
            # entry of I - Y L
            ml, mh = ia.scale(-y[i, 0], jl[0, j], jh[0, j])
            for m in range(1, n):
                pl, ph = ia.scale(-y[i, m], jl[m, j], jh[m, j])
                ml, mh = ia.add(ml, mh, pl, ph)
            if i == j:
                ml, mh = ia.add(ml, mh, 1.0, 1.0)
            row += max(-ml, mh)
            dl, dh = ia.subtract(x[0, j], x[1, j], z[j], z[j])
            pl, ph = ia.multiply(ml, mh, dl, dh)
            rl, rh = ia.add(rl, rh, pl, ph)
        al, ah = ia.add(al, ah, rl, rh)
        norm = max(norm, row)
        inside = inside and x[0, i] < al and ah < x[1, i]
        within = within and x[0, i] <= al and ah <= x[1, i]
        empty = empty or al > x[1, i] or ah < x[0, i]
        k[0, i], k[1, i] = al, ah
    if empty:
        return EMPTY, norm
    if inside:
        return UNIQUE, norm
    # the sum is done to nearest; the margin covers its rounding, so Y is nonsingular
    return EXISTS if within and norm < 1.0 - 1e-9 else UNDECIDED, norm


@kernel
def test(equations, x, p, k, room):
    """Status of a box for parameters ``p`` (2, m), and the norm; ``k`` becomes K, the box itself without one."""
    z, fl, fh, jl, jh = room.z, room.fl, room.fh, room.jl, room.jh
    smooth = equations(x[0], x[1], p[0], p[1], fl, fh, jl, jh, True)
    found, norm = UNDECIDED, np.inf
    for i in range(z.size):
        k[0, i], k[1, i] = x[0, i], x[1, i]
        z[i] = 0.5 * (x[0, i] + x[1, i])
        if not (fl[i] <= 0.0 <= fh[i]) or not x[0, i] <= x[1, i]:
            found = EMPTY
        smooth = smooth and np.isfinite(z[i])
        for j in range(z.size):
            room.mid[i, j] = 0.5 * (jl[i, j] + jh[i, j])
    if found != EMPTY and smooth and invert(room.mid, room.y):
        smooth = equations(z, z, p[0], p[1], fl, fh, jl, jh, False)
        if smooth:
            found, norm = _image(x, k, room)
    return found, norm


def _types_of_test():
    from numba import int8, types, void

    of_system, vector, matrix, _ = _types()
    return void(types.FunctionType(of_system), matrix, matrix, vector, vector, matrix, matrix, int8[::1])


@kernel(signature=_types_of_test)
def krawczyk_boxes(equations, lo, hi, pl, ph, out_lo, out_hi, status):
    """Test boxes (N, n) once with common parameters (m,): status and intersection with the image."""
    n = lo.shape[1]
    x, k, p, room = np.empty((2, n)), np.empty((2, n)), np.empty((2, pl.size)), workspace(n)
    p[0], p[1] = pl, ph
    for b in range(lo.shape[0]):
        x[0], x[1] = lo[b], hi[b]
        found, _ = test(equations, x, p, k, room)
        status[b] = found
        for i in range(n):
            out_lo[b, i] = np.inf if found == EMPTY else max(x[0, i], k[0, i])
            out_hi[b, i] = -np.inf if found == EMPTY else min(x[1, i], k[1, i])


# --- all solutions in a box, depth first, with epsilon-inflation; see theory/interval-tests 2


@kernel
def _shrink(x, k):
    """Replace a box by its part in K; returns whether a side became much shorter."""
    gains = False
    for i in range(x.shape[1]):
        low, high = max(x[0, i], k[0, i]), min(x[1, i], k[1, i])
        gains = gains or high - low < GAIN * (x[1, i] - x[0, i])
        x[0, i], x[1, i] = low, high
    return gains


@kernel
def _inside(a, b):
    """Whether a box lies in another."""
    inside = True
    for i in range(a.shape[1]):
        inside = inside and b[0, i] <= a[0, i] and a[1, i] <= b[1, i]
    return inside


@kernel
def _known(x, domains, count):
    """Whether a box lies in the domain of a solution that has been found."""
    known = False
    for k in range(count):
        known = known or _inside(x, domains[k])
    return known


@kernel
def _contract(equations, p, x, domain, k, room):
    """Test and shrink a box while it gains; the first proof counts, with its box in ``domain``.

    Returns the status, the last norm and the number of tests.
    """
    found, norm, tests = UNDECIDED, np.inf, 0
    for _ in range(ROUNDS):
        result, norm = test(equations, x, p, k, room)
        tests += 1
        if result == EMPTY:
            return EMPTY, norm, tests
        if (result == UNIQUE and found != UNIQUE) or (result == EXISTS and found == UNDECIDED):
            found = result
            domain[:] = x
        if not _shrink(x, k):
            break
    return found, norm, tests


@kernel
def _beyond(equations, p, start, x, domain, k, room):
    """Epsilon-inflation of a box of the start box: UNIQUE (domain and K are set), EMPTY, or UNDECIDED.

    All solutions in the box lie in the larger one; if that has exactly one, outside the start box, the box has none.
    """
    domain[:] = x
    for count in range(INFLATIONS):
        widest = 0.0
        for i in range(x.shape[1]):
            widest = max(widest, domain[1, i] - domain[0, i])
        for i in range(x.shape[1]):
            low, high = domain[0, i], domain[1, i]
            grow = 0.125 * (high - low) + 0.05 * widest + 4e-16 * max(-low, high) + 1e-300
            domain[0, i], domain[1, i] = add_down(low, -grow), add_up(high, grow)
        result, norm = test(equations, domain, p, k, room)
        if result == UNIQUE:
            if _inside(k, start):
                return UNIQUE, count + 1
            apart = False
            for i in range(x.shape[1]):
                apart = apart or k[1, i] < start[0, i] or start[1, i] < k[0, i]
            return EMPTY if apart else UNDECIDED, count + 1
        if result == EMPTY:
            return EMPTY, count + 1
        if not norm < 1.0:
            return UNDECIDED, count + 1
        for i in range(x.shape[1]):
            domain[0, i], domain[1, i] = min(x[0, i], k[0, i]), max(x[1, i], k[1, i])
    return UNDECIDED, INFLATIONS


def _types_of_pave():
    from numba import int8, int64, types

    of_system, vector, matrix, cube = _types()
    return int64(types.FunctionType(of_system), matrix, matrix, vector, cube, cube, cube, int8[::1], int64[::1], int64)


@kernel(signature=_types_of_pave)
def pave(equations, start, p, widths, stack, kept, domains, status, state, limit):
    """Treat waiting boxes until none waits, ``limit`` boxes have been tested, or an array is full.

    ``widths`` (n,) are those at which boxes are kept undecided; ``stack``, ``kept`` and ``domains`` hold boxes
    (rows, 2, n).  ``state`` counts waiting, kept, tested and UNIQUE boxes, and the search goes on where it was.
    Invariant: every solution of the start box lies in a waiting box, in a kept one, or in the domain of a kept one that
    is UNIQUE, which then holds that solution.  So the search can be stopped between any two boxes.
    """
    n = start.shape[1]
    x, domain, k, room = np.empty((2, n)), np.empty((2, n)), np.empty((2, n)), workspace(n)
    while state[WAITING] > 0:
        if state[TESTED] >= limit:
            return LIMIT
        waiting, count = state[WAITING] - 1, state[KEPT]
        if waiting + 2 > stack.shape[0] or count == kept.shape[0]:
            return ROOM
        state[WAITING] = waiting
        x[:] = stack[waiting]
        # nothing new in the domain of a solution; else contract, and prove beyond the faces where that may succeed
        if _known(x, domains, state[PROVED]):
            continue
        found, norm, tests = _contract(equations, p, x, domain, k, room)
        state[TESTED] += tests
        if found == EMPTY:
            continue
        if found == UNDECIDED and norm < 0.5:
            found, tests = _beyond(equations, p, start, x, domain, k, room)
            state[TESTED] += tests
            if found == EMPTY:
                continue
            if found == UNIQUE:  # sharpen the enclosure
                x[:] = k
                for _ in range(ROUNDS):
                    test(equations, x, p, k, room)
                    state[TESTED] += 1
                    if not _shrink(x, k):
                        break
        if found == UNIQUE:
            twice = _known(x, domains, state[PROVED])
            for row in range(state[PROVED]):
                twice = twice or _inside(kept[row], domain)
            if twice:
                continue
        # the side that is longest for its tolerance
        widest, size, small = 0, -1.0, True
        for i in range(n):
            ratio = (x[1, i] - x[0, i]) / widths[i]
            small = small and ratio <= 1.0
            if ratio > size:
                widest, size = i, ratio
        middle = 0.5 * (x[0, widest] + x[1, widest])
        if found != UNDECIDED or small or not x[0, widest] < middle < x[1, widest]:
            # keep it; UNIQUE ones come first, so that `_known` looks at no others
            row = count
            if found == UNIQUE:
                row = state[PROVED]
                kept[count], domains[count], status[count] = kept[row], domains[row], status[row]
                state[PROVED] += 1
            kept[row], status[row] = x, found
            domains[row] = x if found == UNDECIDED else domain
            state[KEPT] += 1
            continue
        # cut it
        stack[waiting], stack[waiting + 1] = x, x
        stack[waiting, 0, widest] = middle
        stack[waiting + 1, 1, widest] = middle
        state[WAITING] += 2
    return DONE
