"""Small dense linear systems."""

import math

from graphsynth.core.compilation import kernel


@kernel
def clear(M):
    """Fill with zeros (a slice assignment takes far longer to compile)."""
    for i in range(M.shape[0]):
        for j in range(M.shape[1]):
            M[i, j] = 0.0


@kernel
def factorise(M, order):
    """LU factors with row exchange in place; False for a singular matrix."""
    m = M.shape[0]
    for k in range(m):
        best = k
        for i in range(k + 1, m):
            if abs(M[i, k]) > abs(M[best, k]):
                best = i
        order[k] = best
        if not abs(M[best, k]) > 0.0:
            return False
        if best != k:
            for j in range(k, m):
                M[k, j], M[best, j] = M[best, j], M[k, j]
        for i in range(k + 1, m):
            M[i, k] /= M[k, k]
            factor = M[i, k]
            if factor != 0.0:
                for j in range(k + 1, m):
                    M[i, j] -= factor * M[k, j]
    return True


@kernel
def substitute(M, order, v):
    """Solve with the factors of `factorise`, in place."""
    m = M.shape[0]
    for k in range(m):
        p = order[k]
        if p != k:
            v[k], v[p] = v[p], v[k]
        for i in range(k + 1, m):
            v[i] -= M[i, k] * v[k]
    for k in range(m - 1, -1, -1):
        for j in range(k + 1, m):
            v[k] -= M[k, j] * v[j]
        v[k] /= M[k, k]


@kernel
def norm(e, unit):
    """Root mean square of the scaled components."""
    total = 0.0
    for a in range(e.size):
        total += (e[a] / unit[a]) ** 2
    return math.sqrt(total / e.size)
