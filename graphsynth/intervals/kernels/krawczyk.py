"""Krawczyk's test compiled, for systems that are themselves compiled.

A system is an ``njit`` function

    system(xl, xh, pl, ph, fl, fh, jl, jh, derivatives) -> bool

that writes enclosures of the equations into ``fl, fh`` (n,) and, if ``derivatives``, of the Jacobian into ``jl, jh``
(n, n), for unknowns ``xl, xh`` (n,) and parameters ``pl, ph`` (m,); it returns whether everything was defined and
continuous.  It is written with the scalar functions of this package (``arithmetic.add`` and so on) and decorated with
``@system``, which fixes its types: the test is then compiled once for all systems and calls them by their address.
"""

import numpy as np

from graphsynth.core.compilation import kernel, prepare_numba
from graphsynth.intervals.kernels import arithmetic as ia

EMPTY, UNIQUE, EXISTS, UNDECIDED = 0, 1, 2, 3


def types_of_system():
    """Types of a system for numba: of itself, of a vector and of a matrix."""
    from numba import boolean, float64

    vector, matrix = float64[::1], float64[:, ::1]
    return boolean(*[vector] * 6, matrix, matrix, boolean), vector, matrix


def system(function):
    """Compile a system; a decorator."""
    from numba import njit

    prepare_numba()
    return njit(types_of_system()[0], error_model="numpy")(function)


def _types_of_test():
    from numba import int8, types, void

    of_system, vector, matrix = types_of_system()
    return void(types.FunctionType(of_system), matrix, matrix, vector, vector, matrix, matrix, int8[::1])


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
    """Write K into ``kl, kh``; return the status and the largest row sum of ``|I - Y L|`` (an estimate)."""
    n = z.size
    empty = False
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
        empty = empty or al > xh[i] or ah < xl[i]
        kl[i], kh[i] = al, ah
    if empty:
        return EMPTY, norm
    if inside:
        return UNIQUE, norm
    # the sum is done to nearest; the margin covers its rounding, so Y is nonsingular
    return EXISTS if within and norm < 1.0 - 1e-9 else UNDECIDED, norm


@kernel
def test(equations, xl, xh, pl, ph, kl, kh, fl, fh, z, jl, jh, mid, y):
    """Status of one box and the norm; ``kl, kh`` becomes K, the box itself without one; the rest is workspace."""
    n = z.size
    smooth = equations(xl, xh, pl, ph, fl, fh, jl, jh, True)
    found, norm = UNDECIDED, np.inf
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
            found, norm = _image(xl, xh, z, fl, fh, jl, jh, y, kl, kh)
    return found, norm


@kernel(signature=_types_of_test)
def krawczyk_boxes(equations, lo, hi, pl, ph, out_lo, out_hi, status):
    """Test boxes (N, n) once with common parameters (m,): status and intersection with the image."""
    n = lo.shape[1]
    fl, fh, z = np.empty(n), np.empty(n), np.empty(n)
    jl, jh, mid, y = np.empty((n, n)), np.empty((n, n)), np.empty((n, n)), np.empty((n, n))
    for b in range(lo.shape[0]):
        found, _ = test(equations, lo[b], hi[b], pl, ph, out_lo[b], out_hi[b], fl, fh, z, jl, jh, mid, y)
        status[b] = found
        for i in range(n):
            out_lo[b, i] = np.inf if found == EMPTY else max(lo[b, i], out_lo[b, i])
            out_hi[b, i] = -np.inf if found == EMPTY else min(hi[b, i], out_hi[b, i])
