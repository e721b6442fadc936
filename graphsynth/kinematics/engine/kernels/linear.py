"""Small dense linear systems."""

from graphsynth.core.compilation import kernel


@kernel
def factor(J, n, pivots):
    """LU in place with row pivoting; returns the determinant (0 if a pivot vanishes)."""
    det = 1.0
    for k in range(n):
        best, big = k, abs(J[k, k])
        for r in range(k + 1, n):
            if abs(J[r, k]) > big:
                best, big = r, abs(J[r, k])
        pivots[k] = best
        if not big > 0.0:
            return 0.0
        if best != k:
            det = -det
            for c in range(n):
                J[k, c], J[best, c] = J[best, c], J[k, c]
        det *= J[k, k]
        inv = 1.0 / J[k, k]
        for r in range(k + 1, n):
            m = J[r, k] * inv
            J[r, k] = m
            if m != 0.0:
                for c in range(k + 1, n):
                    J[r, c] -= m * J[k, c]
    return det


@kernel
def back(J, n, pivots, y):
    """Solve with the factors of `factor`, in place."""
    for k in range(n):
        if pivots[k] != k:
            y[k], y[pivots[k]] = y[pivots[k]], y[k]
    for k in range(n):
        for r in range(k + 1, n):
            y[r] -= J[r, k] * y[k]
    for k in range(n - 1, -1, -1):
        for c in range(k + 1, n):
            y[k] -= J[k, c] * y[c]
        y[k] /= J[k, k]


@kernel
def solve3(Q, a, b, c):
    """Cramer's rule for the first three columns of Q; returns determinant and solution."""
    m0 = Q[1, 1] * Q[2, 2] - Q[1, 2] * Q[2, 1]
    m1 = Q[2, 1] * Q[0, 2] - Q[2, 2] * Q[0, 1]
    m2 = Q[0, 1] * Q[1, 2] - Q[0, 2] * Q[1, 1]
    det = Q[0, 0] * m0 + Q[1, 0] * m1 + Q[2, 0] * m2
    n0 = Q[1, 2] * Q[2, 0] - Q[1, 0] * Q[2, 2]
    n1 = Q[2, 2] * Q[0, 0] - Q[2, 0] * Q[0, 2]
    n2 = Q[0, 2] * Q[1, 0] - Q[0, 0] * Q[1, 2]
    k0 = Q[1, 0] * Q[2, 1] - Q[1, 1] * Q[2, 0]
    k1 = Q[2, 0] * Q[0, 1] - Q[2, 1] * Q[0, 0]
    k2 = Q[0, 0] * Q[1, 1] - Q[0, 1] * Q[1, 0]
    f = 1.0 / det
    return det, f * (a * m0 + b * m1 + c * m2), f * (a * n0 + b * n1 + c * n2), f * (a * k0 + b * k1 + c * k2)
