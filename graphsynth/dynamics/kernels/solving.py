"""Rank-revealing solution of the constraint equations in the metric of the mass matrix."""

import math

import numpy as np

from graphsynth.core.compilation import kernel
from graphsynth.dynamics.kernels.rubbing import friction_unit, slide_loads

#: Diagonal entries of R below this part of the first count as zero (columns have length 1).
RANK = 1e-10


@kernel
def factor_rows(L, diagonal, J):
    """Householder QR with column pivoting of ``L^-1 J^T``, columns of length 1.

    Returns B (reflectors below, R above), diag of R, order, column lengths, rank.
    """
    m, n = J.shape
    B, size, order = np.empty((n, m)), np.empty(m), np.arange(m)
    # L^-1 J^T row by row, then columns of length 1
    for k in range(m):
        total = 0.0
        for i in range(n):
            value = J[k, i]
            if not diagonal:
                for j in range(i):
                    value -= L[i, j] * B[j, k]
            B[i, k] = value / L[i, i]
            total += B[i, k] * B[i, k]
        size[k] = math.sqrt(total) if total > 0.0 else 1.0
        for i in range(n):
            B[i, k] /= size[k]
    rank, R = 0, np.zeros(min(m, n))
    norms = np.empty(m)
    for s in range(min(m, n)):
        best, big = s, -1.0
        for k in range(s, m):
            total = 0.0
            for i in range(s, n):
                total += B[i, k] * B[i, k]
            norms[k] = total
            if total > big:
                best, big = k, total
        if not math.sqrt(big) > RANK:
            break  # what is left depends on the columns before
        if best != s:
            order[s], order[best] = order[best], order[s]
            for i in range(n):
                B[i, s], B[i, best] = B[i, best], B[i, s]
        alpha = math.sqrt(big) if B[s, s] <= 0.0 else -math.sqrt(big)
        R[s] = alpha
        B[s, s] -= alpha  # the reflector is I - 2 u u^T / (u^T u)
        scale = -1.0 / (alpha * B[s, s])
        for k in range(s + 1, m):
            dot = 0.0
            for i in range(s, n):
                dot += B[i, s] * B[i, k]
            dot *= scale
            for i in range(s, n):
                B[i, k] -= dot * B[i, s]
        rank += 1
    return B, R, order, size, rank


@kernel
def reflect(B, R, rank, y, transposed):
    """Apply Q (or its transpose) to y in place."""
    n = B.shape[0]
    for step in range(rank):
        s = step if transposed else rank - 1 - step
        dot = 0.0
        for i in range(s, n):
            dot += B[i, s] * y[i]
        dot *= -1.0 / (R[s] * B[s, s])
        for i in range(s, n):
            y[i] -= dot * B[i, s]


@kernel
def least_step(L, diagonal, B, R, order, size, rank, d):
    """Smallest step x in the metric of the mass matrix with ``J x = d``; also z = R^-T d for the multipliers."""
    n = B.shape[0]
    z, y = np.zeros(rank), np.zeros(n)
    for s in range(rank):
        value = d[order[s]] / size[order[s]]
        for i in range(s):
            value -= B[i, s] * z[i]
        z[s] = value / R[s]
        y[s] = z[s]
    reflect(B, R, rank, y, False)
    back_lower(L, diagonal, y)
    return y, z


@kernel
def back_lower(L, diagonal, y):
    """Solve ``L^T x = y`` in place."""
    for step in range(y.shape[0]):
        i = y.shape[0] - 1 - step
        if not diagonal:
            for j in range(i + 1, y.shape[0]):
                y[i] -= L[j, i] * y[j]
        y[i] /= L[i, i]


@kernel
def forth_lower(L, diagonal, y):
    """Solve ``L x = y`` in place."""
    for i in range(y.shape[0]):
        if not diagonal:
            for j in range(i):
                y[i] -= L[i, j] * y[j]
        y[i] /= L[i, i]


@kernel
def least_multipliers(B, R, order, size, rank, z):
    """Multipliers with ``B lam = -z`` of least norm (in rows of length 1)."""
    m = B.shape[1]
    extra = m - rank
    S, w = np.zeros((rank, extra)), np.zeros(rank)
    for c in range(extra + 1):
        for step in range(rank):
            s = rank - 1 - step
            value = -z[s] if c == extra else B[s, rank + c]
            for i in range(s + 1, rank):
                value -= B[s, i] * (w[i] if c == extra else S[i, c])
            if c == extra:
                w[s] = value / R[s]
            else:
                S[s, c] = value / R[s]
    found = np.zeros(m)
    # (I + S^T S) tail = S^T w by Cholesky factors: the matrix is never less than the identity
    G, tail = np.zeros((extra, extra)), np.zeros(extra)
    for i in range(extra):
        for j in range(i + 1):
            value = 1.0 if i == j else 0.0
            for s in range(rank):
                value += S[s, i] * S[s, j]
            for k in range(j):
                value -= G[i, k] * G[j, k]
            G[i, j] = math.sqrt(value) if i == j else value / G[j, j]
        for s in range(rank):
            tail[i] += S[s, i] * w[s]
    forth_lower(G, extra == 0, tail)
    back_lower(G, extra == 0, tail)
    for s in range(rank):
        for c in range(extra):
            w[s] -= S[s, c] * tail[c]
    for s in range(rank):
        found[order[s]] = w[s] / size[order[s]]
    for c in range(extra):
        found[order[rank + c]] = tail[c] / size[order[rank + c]]
    return found


@kernel
def solve_rows(L, diagonal, J, d):
    """Smallest step in the metric of the mass matrix with ``J x = d``; smallest pivot."""
    B, R, order, size, rank = factor_rows(L, diagonal, J)
    y, _ = least_step(L, diagonal, B, R, order, size, rank, d)
    return y, abs(R[rank - 1]) if rank > 0 else 1.0


@kernel
def multipliers_of(T, J, gam, B, R, order, size, rank, load, held):
    """Accelerations and multipliers under generalised forces; ``held`` leaves the side ``gam`` of the rows in place."""
    n, m = T.mass.shape[0], J.shape[0]
    d = np.zeros(m)
    forth_lower(T.lower, T.diagonal, load)
    back_lower(T.lower, T.diagonal, load)
    for k in range(m):
        if held:
            d[k] = gam[k]
        for i in range(n):
            d[k] -= J[k, i] * load[i]
    y, z = least_step(T.lower, T.diagonal, B, R, order, size, rank, d)
    for i in range(n):
        y[i] += load[i]
    return y, least_multipliers(B, R, order, size, rank, z)


@kernel
def accelerate(T, x, J, gam, Q, out):
    """Accelerations and multipliers of ``M a + J^T lam = Q, J a = gam``, with friction.

    ``out``: rank, smallest pivot, power of friction, factor of the friction's return through the reactions (0 without
    friction, see `slide_loads`), rounds; rounds are -1 if no loads were found.
    """
    B, R, order, size, rank = factor_rows(T.lower, T.diagonal, J)
    out[0], out[1] = rank, abs(R[rank - 1]) if rank > 0 else 1.0
    out[2], out[3], out[4] = 0.0, 0.0, 0.0
    count, n, m = T.friction.shape[0], T.mass.shape[0], J.shape[0]
    a, lam = multipliers_of(T, J, gam, B, R, order, size, rank, Q.copy(), True)
    if count == 0:
        return a, lam
    shares, powers = np.empty((count, n)), np.empty(count)
    parts = np.empty((count, m))
    for f in range(count):
        unit = np.zeros(n)
        powers[f] = friction_unit(T, x, J, f, unit)
        shares[f], parts[f] = multipliers_of(T, J, gam, B, R, order, size, rank, unit, False)
    loads, out[3], out[4] = slide_loads(T, lam, parts)
    for f in range(count):
        out[2] += loads[f] * powers[f]
        for i in range(n):
            a[i] += loads[f] * shares[f, i]
        for k in range(m):
            lam[k] += loads[f] * parts[f, k]
    return a, lam
