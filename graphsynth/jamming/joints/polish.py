"""Newton's method on the optimality conditions, from the interior-point solution to the last digits.

Near the optimum every block is either loaded (``M_b q != 0``; then ``tau_b = -T M_b q / |M_b q|``) or idle
(``M_b q = 0``; then tau_b is free inside its limit).  With this division the conditions are smooth equations in
``(q, T, tau, zeta)``; Newton's method doubles the digits in each step.  Where the division is not clear the
result is no better than before and the caller keeps what it had.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from graphsynth.jamming.joints.cones import ConeSolution

__all__ = ["polish"]

Array = NDArray[np.float64]

_DELTA = 1e-9


def polish(M: Array, F: Array, W: Array, found: ConeSolution, *, robust: bool = False, steps: int = 3) -> ConeSolution:
    """Improve solutions of `solve_cones`; same shapes and units.

    ``robust`` takes regularised steps: slower, and right where idle joints share out their tilts in more than one way.
    """
    q, tau, zeta = found.q.copy(), found.tau.copy(), found.zeta.copy()
    count, blocks, _, k = M.shape
    forces = F.shape[1]
    m, f = _moments(M, q), (F @ q[:, :, None])[..., 0]
    size, lean = _length(m), _length(tau)
    T = lean.max(axis=1)
    with np.errstate(all="ignore"):
        loaded = size > 1.0 - lean / T[:, None]
        pushed = np.abs(f) > 1.0 - np.abs(zeta)
        for _ in range(steps):
            m, f = _moments(M, q), (F @ q[:, :, None])[..., 0]
            size = np.where(loaded, _length(m), 1.0)
            unit = np.where(loaded[..., None], m / size[..., None], 0.0)
            tau = np.where(loaded[..., None], -T[:, None, None] * unit, tau)
            zeta = np.where(pushed, -np.sign(f), zeta)
            matrix, right = _system(M, F, W, (m, f, size, unit, tau, zeta, T), loaded, pushed)
            step = _least(matrix, right, k) if robust else _solve(matrix, right, k)
            q = q + step[:, :k]
            T = T + step[:, k]
            end = k + 1 + 2 * blocks
            tau = tau + np.where(loaded[..., None], 0.0, step[:, k + 1 : end].reshape(count, blocks, 2))
            zeta = zeta + np.where(pushed, 0.0, step[:, end : end + forces])
    return ConeSolution(q, *_shared(M, F, W, q, tau, zeta, loaded, pushed), found.rounds)


def _shared(
    M: Array, F: Array, W: Array, q: Array, tau: Array, zeta: Array,
    loaded: NDArray[np.bool_], pushed: NDArray[np.bool_],
) -> tuple[Array, Array]:  # fmt: skip
    """Put loaded joints at their limit for the T of q; let the idle ones close the loops with the least change."""
    count, blocks, _, k = M.shape
    m, f = _moments(M, q), (F @ q[:, :, None])[..., 0]
    with np.errstate(all="ignore"):
        size = _length(m)
        T = ((W * q).sum(axis=1) - np.abs(f).sum(axis=1)) / size.sum(axis=1)
        tau = np.where(loaded[..., None], -T[:, None, None] * m / size[..., None], tau)
        zeta = np.where(pushed, -np.sign(f), np.clip(zeta, -1.0, 1.0))
    rows = np.concatenate([M.reshape(count, 2 * blocks, k), F], axis=1)
    values = np.concatenate([tau.reshape(count, -1), zeta], axis=1)
    idle = np.concatenate([np.repeat(~loaded, 2, axis=1), ~pushed], axis=1)
    off = W + (rows.transpose(0, 2, 1) @ values[:, :, None])[..., 0]
    sound = np.isfinite(off).all(axis=1)
    inverse = np.linalg.pinv((rows * idle[:, :, None]).transpose(0, 2, 1), rcond=1e-12)
    values = values - (inverse @ np.where(sound[:, None], off, 0.0)[:, :, None])[..., 0]
    return values[:, : 2 * blocks].reshape(count, blocks, 2), values[:, 2 * blocks :]


def _moments(M: Array, q: Array) -> Array:
    return np.asarray((M @ q[:, None, :, None])[..., 0])


def _length(v: Array) -> Array:
    return np.asarray(np.hypot(v[..., 0], v[..., 1]))


def _system(
    M: Array, F: Array, W: Array, at: tuple[Array, ...], loaded: NDArray[np.bool_], pushed: NDArray[np.bool_]
) -> tuple[Array, Array]:
    """Newton matrix and right side: closure, normalisation, idle blocks, idle forces (identity rows for the others)."""
    m, f, size, unit, tau, zeta, T = at
    count, blocks, _, k = M.shape
    forces = F.shape[1]
    n = k + 1 + 2 * blocks + forces
    matrix, right = np.zeros((count, n, n)), np.zeros((count, n))
    flat = M.reshape(count, 2 * blocks, k)
    bend = (np.eye(2) - unit[..., :, None] * unit[..., None, :]) * (loaded * T[:, None] / size)[..., None, None]
    matrix[:, :k, :k] = -np.einsum("nbik,nbij,nbjl->nkl", M, bend, M, optimize=True)
    slope = np.einsum("nbik,nbi->nk", M, unit)
    matrix[:, :k, k], matrix[:, k, :k] = -slope, slope
    idle = np.repeat(~loaded, 2, axis=1) & (flat != 0.0).any(axis=2)
    rest = np.zeros((count, 2 * blocks + forces), dtype=bool)
    rest[:, : 2 * blocks], rest[:, 2 * blocks :] = idle, ~pushed & (F != 0.0).any(axis=2)
    rows = np.concatenate([flat, F], axis=1) * rest[:, :, None]
    matrix[:, :k, k + 1 :], matrix[:, k + 1 :, :k] = rows.transpose(0, 2, 1), rows
    each = np.arange(k + 1, n)
    matrix[:, each, each] = np.where(rest, 0.0, 1.0)
    closure = (flat.transpose(0, 2, 1) @ tau.reshape(count, -1, 1))[..., 0]
    right[:, :k] = -(closure + (F.transpose(0, 2, 1) @ zeta[:, :, None])[..., 0] + W)
    right[:, k] = 1.0 - np.where(loaded, size, 0.0).sum(axis=1)
    values = np.concatenate([m.reshape(count, -1), f], axis=1)
    right[:, k + 1 :] = np.where(rest, -values, 0.0)
    return matrix, right


def _solve(matrix: Array, right: Array, k: int) -> Array:
    try:
        return np.asarray(np.linalg.solve(matrix, right[:, :, None])[..., 0])
    except np.linalg.LinAlgError:
        return _least(matrix, right, k)


def _least(matrix: Array, right: Array, k: int) -> Array:
    """Solve symmetric systems that may be singular, by the proximal point method.

    The block of q is negative semidefinite, so with ``-delta`` there and ``+delta`` in the rest the matrix is
    quasi-definite: always regular (Vanderbei 1995).  Repeating the solve on the residual takes the error of delta away.
    """
    sound = np.asarray(np.isfinite(matrix).all(axis=(1, 2)) & np.isfinite(right).all(axis=1))
    n = matrix.shape[1]
    matrix = np.where(sound[:, None, None], matrix, np.eye(n))
    right = np.where(sound[:, None], right, 0.0)
    shift = np.diag(np.where(np.arange(n) < k, -_DELTA, _DELTA))
    try:
        inverse = np.linalg.inv(matrix + shift)
    except np.linalg.LinAlgError:
        return np.full_like(right, np.nan)
    x = np.zeros_like(right)
    for _ in range(4):
        x = x + (inverse @ (right - (matrix @ x[:, :, None])[..., 0])[:, :, None])[..., 0]
    return np.asarray(np.where(sound[:, None], x, np.nan))
