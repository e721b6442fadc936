"""Krawczyk's test compiled, for systems that are themselves compiled.

A system is an ``njit`` function

    system(xl, xh, pl, ph, fl, fh, jl, jh, derivatives) -> bool

that writes enclosures of the equations into ``fl, fh`` (n,) and, if ``derivatives``, of the Jacobian into ``jl, jh``
(n, n), for unknowns ``xl, xh`` (n,) and parameters ``pl, ph`` (m,); it returns whether everything was defined and
continuous.  It is written with the scalar functions of this package (``arithmetic.add`` and so on) and decorated with
``@system``, which fixes its types: the test is then compiled once for all systems and calls them by their address.
"""

import numpy as np
from numba import boolean, float64, int8, int64, njit, types, void

from graphsynth.compilation import kernel
from graphsynth.intervals.kernels import arithmetic as ia

EMPTY, UNIQUE, EXISTS, UNDECIDED = 0, 1, 2, 3

_VECTOR, _MATRIX = float64[::1], float64[:, ::1]
SYSTEM = boolean(*[_VECTOR] * 6, _MATRIX, _MATRIX, boolean)
#: Decorator for compiled systems.
system = njit(SYSTEM, error_model="numpy")
_TEST = void(types.FunctionType(SYSTEM), _MATRIX, _MATRIX, _VECTOR, _VECTOR, _MATRIX, _MATRIX, int8[::1])


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
def _image(xl, xh, z, fl, fh, jl, jh, y, kl, kh):
    """Return the status from the image; the intersection replaces ``kl, kh``."""
    n = z.size
    inside, within, norm = True, True, 0.0
    for i in range(n):
        al, ah = z[i], z[i]
        rl, rh = 0.0, 0.0
        row = 0.0
        for j in range(n):
            pl, ph = ia.scale(y[i, j], fl[j], fh[j])
            al, ah = ia.subtract(al, ah, pl, ph)
            ml, mh = ia.scale(-y[i, 0], jl[0, j], jh[0, j])
            for k in range(1, n):
                pl, ph = ia.scale(-y[i, k], jl[k, j], jh[k, j])
                ml, mh = ia.add(ml, mh, pl, ph)
            if i == j:
                ml, mh = ia.add(ml, mh, 1.0, 1.0)
            row += max(-ml, mh)
            dl, dh = ia.subtract(xl[j], xh[j], z[j], z[j])
            pl, ph = ia.multiply(ml, mh, dl, dh)
            rl, rh = ia.add(rl, rh, pl, ph)
        al, ah = ia.add(al, ah, rl, rh)
        norm = max(norm, row)
        inside = inside and xl[i] < al and ah < xh[i]
        within = within and xl[i] <= al and ah <= xh[i]
        if al > xh[i] or ah < xl[i]:
            return EMPTY
        kl[i], kh[i] = max(xl[i], al), min(xh[i], ah)
    if inside:
        return UNIQUE
    # the sum is done to nearest; the margin covers its rounding, so Y is nonsingular
    return EXISTS if within and norm < 1.0 - 1e-9 else UNDECIDED


@kernel
def _test(equations, xl, xh, pl, ph, kl, kh, fl, fh, z, jl, jh, mid, y):
    """Status of one box; ``kl, kh`` becomes the intersection with the image; the rest is workspace."""
    n = z.size
    smooth = equations(xl, xh, pl, ph, fl, fh, jl, jh, True)
    found = UNDECIDED
    for i in range(n):
        kl[i], kh[i] = xl[i], xh[i]
        z[i] = 0.5 * (xl[i] + xh[i])
        if not (fl[i] <= 0.0 <= fh[i]) or not xl[i] <= xh[i]:
            found = EMPTY
        smooth = smooth and np.isfinite(z[i])
        for j in range(n):
            mid[i, j] = 0.5 * (jl[i, j] + jh[i, j])
    if found != EMPTY and smooth and invert(mid, y):
        smooth = equations(z, z, pl, ph, fl, fh, jl, jh, False)
        if smooth:
            found = _image(xl, xh, z, fl, fh, jl, jh, y, kl, kh)
    if found == EMPTY:
        kl[:], kh[:] = np.inf, -np.inf
    return found


@kernel(signature=_TEST)
def krawczyk_boxes(equations, lo, hi, pl, ph, out_lo, out_hi, status):
    """Test boxes (N, n) once with common parameters (m,): status and intersection with the image."""
    n = lo.shape[1]
    fl, fh, z = np.empty(n), np.empty(n), np.empty(n)
    jl, jh, mid, y = np.empty((n, n)), np.empty((n, n)), np.empty((n, n)), np.empty((n, n))
    for b in range(lo.shape[0]):
        status[b] = _test(equations, lo[b], hi[b], pl, ph, out_lo[b], out_hi[b], fl, fh, z, jl, jh, mid, y)


_PAVE = int64[::1](
    types.FunctionType(SYSTEM), _VECTOR, _VECTOR, _VECTOR, _VECTOR, _VECTOR, int64, _MATRIX, _MATRIX, int8[::1]
)


@kernel(signature=_PAVE)
def krawczyk_pave(equations, lo, hi, pl, ph, tolerance, max_boxes, kept_lo, kept_hi, status):
    """Branch and prune of one box (n,), depth first; returns kept boxes, tested boxes, and 1 if nothing was left out.

    Kept are boxes with a proof, contracted, and undecided ones with all widths at most ``tolerance`` (n,).  Where the
    budget or the room in ``kept_lo`` ends the search, the waiting boxes are kept undecided while there is room; the
    third number is 0 if some solution may lie outside all kept boxes.  A solution on a cut stays undecided here;
    ``graphsynth.intervals.Search`` proves it by inflation.
    """
    n, room, depth = lo.size, kept_lo.shape[0], 4096
    stack_lo, stack_hi = np.empty((depth, n)), np.empty((depth, n))
    rows = np.empty((7, n))
    xl, xh, kl, kh, fl, fh, z = rows[0], rows[1], rows[2], rows[3], rows[4], rows[5], rows[6]
    jl, jh, mid, y = np.empty((n, n)), np.empty((n, n)), np.empty((n, n)), np.empty((n, n))
    stack_lo[0], stack_hi[0] = lo, hi
    waiting, kept, tested, complete = 1, 0, 0, 1
    while waiting > 0:
        waiting -= 1
        xl[:], xh[:] = stack_lo[waiting], stack_hi[waiting]
        found = UNDECIDED
        over = tested >= max_boxes
        for _ in range(12):
            if over:
                break
            result = _test(equations, xl, xh, pl, ph, kl, kh, fl, fh, z, jl, jh, mid, y)
            tested += 1
            if result == EMPTY:
                found = EMPTY
                break
            if result == UNIQUE or (result == EXISTS and found == UNDECIDED):
                found = result
            gains = False
            for i in range(n):
                gains = gains or kh[i] - kl[i] < 0.9 * (xh[i] - xl[i])
                xl[i], xh[i] = kl[i], kh[i]
            if not gains:
                break
        if found == EMPTY:
            continue
        widest, size = 0, -1.0
        small = True
        for i in range(n):
            ratio = (xh[i] - xl[i]) / tolerance[i]
            small = small and ratio <= 1.0
            if ratio > size:
                widest, size = i, ratio
        middle = 0.5 * (xl[widest] + xh[widest])
        inside = xl[widest] < middle < xh[widest]
        if found != UNDECIDED or small or over or not inside or waiting + 2 > depth:
            if kept == room:
                complete = 0
                break
            kept_lo[kept], kept_hi[kept], status[kept] = xl, xh, found
            kept += 1
            continue
        stack_lo[waiting], stack_hi[waiting] = xl, xh
        stack_lo[waiting + 1], stack_hi[waiting + 1] = xl, xh
        stack_lo[waiting, widest] = middle
        stack_hi[waiting + 1, widest] = middle
        waiting += 2
    return np.array([kept, tested, complete])
