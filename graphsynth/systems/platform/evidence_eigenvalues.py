"""Direct kinematics the textbook way, for comparison: eigenvalues of companion matrices, then Newton's method."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

__all__ = ["eigenvalue_modes"]

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]


def eigenvalue_modes(
    anchors: Complex, vertices: Complex, lengths: Array, *, polish: int = 0, band: float = 1e-6
) -> list[Array]:
    """Modes by eigenvalues of companion matrices, the textbook way; for comparison.

    Parameters
    ----------
    anchors : ndarray of complex, shape (n, 3)
    vertices, lengths : ndarray, shape (3,)
    polish : int
        Steps of Newton's method on the closure equations afterwards.
    band : float
        Roots whose modulus differs from one by less count as real modes.

    Returns
    -------
    list of ndarray, shape (m, 3)
        ``(x, y, alpha)`` by alpha, for each problem; estimated, and a mode may be missing or too many.
    """
    from graphsynth.kinematics.triad.sextic import sextic

    scale = float(np.abs(lengths).max())
    s = sextic(anchors / scale, vertices / scale, lengths / scale)
    g0, g1, g2, g3 = s.g
    matrix = np.zeros((len(anchors), 6, 6), dtype=complex)
    matrix[:, 0] = -np.stack([g2, g1, g0 + 0j, np.conj(g1), np.conj(g2), np.conj(g3)], axis=-1) / g3[:, None]
    matrix[:, range(1, 6), range(5)] = 1.0
    every = np.linalg.eigvals(matrix)
    found = []
    for k, roots in enumerate(every):
        z = roots[np.abs(np.abs(roots) - 1.0) < band]
        z = z / np.abs(z)
        p = _place(z, anchors[k], vertices, lengths)
        X = np.stack([p.real, p.imag, np.angle(z)], axis=-1)
        for _ in range(polish):
            X = _newton(X, anchors[k], vertices, lengths)
        found.append(X[np.argsort(X[:, 2])])
    return found


def _place(z: Complex, A: Complex, b: Complex, l2: Array) -> Complex:
    """Position for a rotation from two differences of the closure equations."""
    w = z[:, None] * b - A
    r = l2**2 - np.abs(w) ** 2
    u, v = w[:, 1] - w[:, 0], w[:, 2] - w[:, 0]
    det = (np.conj(u) * v).imag
    return np.asarray((v * (r[:, 1] - r[:, 0]) - u * (r[:, 2] - r[:, 0])) / (2j * det))


def _newton(X: Array, A: Complex, b: Complex, l2: Array) -> Array:
    arm = np.exp(1j * X[:, 2:3]) * b
    d = X[:, 0:1] + 1j * X[:, 1:2] + arm - A
    J = 2.0 * np.stack([d.real, d.imag, (np.conj(arm) * d).imag], axis=-1)
    size = np.abs(d)
    with np.errstate(all="ignore"):
        try:
            return np.asarray(X - np.linalg.solve(J, ((size - l2) * (size + l2))[..., None])[..., 0])
        except np.linalg.LinAlgError:
            return X
