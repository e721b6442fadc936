"""The convex program of one pose, solved for many poses at once.

In scaled form (limits taken into the rows) the dual program reads

    maximise    W q - sum_j |F_j q|      subject to    sum_b |M_b q| <= 1,

with two-dimensional blocks ``M_b q`` (moments) and numbers ``F_j q`` (axial forces).  Its dual is the problem of least
tilt: the smallest T with ``sum M_b' tau_b + sum F_j' zeta_j + W = 0``, ``|tau_b| <= T`` and ``|zeta_j| <= 1``.
A primal-dual interior-point method with Nesterov-Todd scaling and Mehrotra's corrector is run on all poses together;
each pose starts strictly feasible on both sides.  Nothing rests on its convergence: the caller computes a lower and an
upper bound of T from ``q`` and ``tau`` alone.

`polish` is Newton's method on the optimality conditions.  Near the optimum every block is either loaded
(``M_b q != 0``; then ``tau_b = -T M_b q / |M_b q|``) or idle (``M_b q = 0``; then tau_b is free inside its limit).
With this division the conditions are smooth equations in ``(q, T, tau, zeta)``, and each step doubles the digits.
Where the division is not clear the result is no better than before and the caller keeps what it had.

Source: [Nesterov & Todd 1997]; Vandenberghe, "The CVXOPT linear and quadratic cone program solvers" (2010).
"""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]
_ROUNDS = 60
_TARGET = 1e-12


class ConeSolution(NamedTuple):
    """``q`` (N, k), ``tau`` (N, blocks, 2), ``zeta`` (N, forces), ``rounds``; scaled as in the module's text."""

    q: Array
    tau: Array
    zeta: Array
    rounds: int


def solve_cones(M: Array, F: Array, W: Array) -> ConeSolution:
    """Solve N programs of one shape (estimated): M (N, blocks, 2, k), F (N, forces, k), W (N, k) of the order of 1.

    M has full column rank when stacked; a second row of zeros makes a block one-dimensional.
    """
    program = _Program(M, F, W)
    x, s, z = program.start()
    best = x.copy(), z.copy()
    least = np.full(len(W), np.inf)
    live = np.arange(len(W))
    done = 0
    with np.errstate(all="ignore"):
        for done in range(1, _ROUNDS + 1):  # noqa: B007
            gap = np.einsum("nci,nci->n", s[live], z[live]) / np.maximum(np.abs(z[live, -1, 0]), 1e-300)
            better = gap < least[live]
            rows = live[better]
            best[0][rows], best[1][rows], least[rows] = x[rows], z[rows], gap[better]
            live = live[better & (gap > _TARGET)]
            if live.size == 0:
                break
            x[live], s[live], z[live] = program.step(live, x[live], s[live], z[live])
            sound = np.isfinite(x[live]).all(axis=1) & np.isfinite(z[live]).all(axis=(1, 2))
            live = live[sound & np.isfinite(s[live]).all(axis=(1, 2))]
    x, z = best
    k, blocks = W.shape[1], M.shape[1]
    return ConeSolution(x[:, :k], z[:, :blocks, 1:], z[:, blocks:-1, 1], done)


class _Program:
    """``min c x`` subject to ``s = h - G x`` in a product of cones ``s_0 >= |(s_1, s_2)|``; x = (q, u, g).

    Cones: ``(u_b, M_b q)``, ``(g_j, F_j q, 0)``, ``(1 - sum u, 0, 0)``.
    """

    def __init__(self, M: Array, F: Array, W: Array) -> None:
        count, blocks, _, k = M.shape
        forces = F.shape[1]
        n, cones = k + blocks + forces, blocks + forces + 1
        self.G = np.zeros((count, cones, 3, n))
        self.G[:, :blocks, 1:, :k] = -M
        self.G[:, blocks:-1, 1, :k] = -F
        each = np.arange(blocks + forces)
        self.G[:, each, 0, k + each] = -1.0
        self.G[:, -1, 0, k : k + blocks] = 1.0
        self.h = np.zeros((count, cones, 3))
        self.h[:, -1, 0] = 1.0
        self.c = np.zeros((count, n))
        self.c[:, :k] = -W
        self.c[:, k + blocks :] = 1.0
        self.M, self.W, self.blocks = M, W, blocks

    def start(self) -> tuple[Array, Array, Array]:
        """Strictly feasible points: q = 0; any solution of the closure with T twice what it needs."""
        count, k = self.W.shape
        x = np.zeros(self.c.shape)
        x[:, k : k + self.blocks] = 0.5 / self.blocks
        x[:, k + self.blocks :] = 1.0
        s = self.h - (self.G @ x[:, None, :, None])[..., 0]
        stacked = self.M.reshape(count, -1, k)
        tau = -(np.linalg.pinv(stacked).transpose(0, 2, 1) @ self.W[:, :, None])[..., 0].reshape(count, self.blocks, 2)
        z = np.zeros(self.h.shape)
        need = 2.0 * np.sqrt((tau**2).sum(axis=-1)).max(axis=1) + 1e-3
        z[:, : self.blocks, 0] = need[:, None]
        z[:, : self.blocks, 1:] = tau
        z[:, self.blocks : -1, 0] = 1.0
        z[:, -1, 0] = need
        return x, s, z

    def step(self, rows: NDArray[np.intp], x: Array, s: Array, z: Array) -> tuple[Array, Array, Array]:
        """One predictor-corrector step."""
        G = self.G[rows]
        count, cones, _, n = G.shape
        scale, inverse = _scaling(s, z)
        lam = _apply(scale, z)
        det = _determinant(lam)
        Gs = (inverse @ G).reshape(count, 3 * cones, n)
        H = Gs.transpose(0, 2, 1) @ Gs
        solve = _inverse(H)
        flat = G.reshape(count, 3 * cones, n)
        rx = self.c[rows] + (flat.transpose(0, 2, 1) @ z.reshape(count, -1, 1))[..., 0]
        rz = s + (G @ x[:, None, :, None])[..., 0] - self.h[rows]
        mu = np.einsum("nci,nci->n", lam, lam) / cones

        def direction(target: Array) -> tuple[Array, Array, Array]:
            """Solve for ``lam o (W dz + W^-1 ds) = target``."""
            # t with lam o t = target
            t0 = (lam[..., 0] * target[..., 0] - (lam[..., 1:] * target[..., 1:]).sum(axis=-1)) / det
            rest = (target[..., 1:] - t0[..., None] * lam[..., 1:]) / lam[..., :1]
            t = np.concatenate([t0[..., None], rest], axis=-1)
            right = -rx[:, :, None] - Gs.transpose(0, 2, 1) @ (_apply(inverse, rz) + t).reshape(count, -1, 1)
            dx = solve(right)
            dz = _apply(inverse, _apply(inverse, rz + (G @ dx[:, None])[..., 0]) + t)
            for _ in range(2):  # refine: the closure of tau must stay exact however ill-conditioned H becomes
                off = -rx - (flat.transpose(0, 2, 1) @ dz.reshape(count, -1, 1))[..., 0]
                more = solve(off[:, :, None])
                dx = dx + more
                dz = dz + _apply(inverse, _apply(inverse, (G @ more[:, None])[..., 0]))
            ds = -rz - (G @ dx[:, None])[..., 0]
            return dx[..., 0], ds, dz

        square = _product(lam, lam)
        dx, ds, dz = direction(-square)
        a = np.minimum(1.0, np.minimum(_reach(s, ds), _reach(z, dz)))
        sigma = (1.0 - a) ** 3
        target = -square - _product(_apply(inverse, ds), _apply(scale, dz))
        target[..., 0] += (sigma * mu)[:, None]
        dx, ds, dz = direction(target)
        a = np.minimum(1.0, 0.99 * np.minimum(_reach(s, ds), _reach(z, dz)))
        return x + a[:, None] * dx, s + a[:, None, None] * ds, z + a[:, None, None] * dz


def _inverse(H: Array) -> Callable[[Array], Array]:
    """Return the solver of symmetric positive systems, scaled to unit diagonal, with one step of refinement."""
    d = 1.0 / np.sqrt(np.maximum(np.einsum("nii->ni", H), 1e-300))[:, :, None]
    scaled = H * d * d.transpose(0, 2, 1)
    scaled[~np.isfinite(scaled).all(axis=(1, 2))] = np.eye(H.shape[1])
    try:
        inverse = np.linalg.inv(scaled)
    except np.linalg.LinAlgError:
        inverse = np.linalg.inv(scaled + 1e-13 * np.eye(H.shape[1]))

    def solve(right: Array) -> Array:
        right = right * d
        x = inverse @ right
        return np.asarray((x + inverse @ (right - scaled @ x)) * d)

    return solve


def _apply(matrices: Array, vectors: Array) -> Array:
    return np.asarray((matrices @ vectors[..., None])[..., 0])


def _determinant(v: Array) -> Array:
    r = np.hypot(v[..., 1], v[..., 2])
    return np.asarray(np.maximum((v[..., 0] - r) * (v[..., 0] + r), 1e-300))


def _scaling(s: Array, z: Array) -> tuple[Array, Array]:
    """Nesterov-Todd scaling W with ``W z = W^-1 s``, and its inverse; both symmetric, shape (N, cones, 3, 3)."""
    det_s, det_z = np.sqrt(_determinant(s)), np.sqrt(_determinant(z))
    s, z = s / det_s[..., None], z / det_z[..., None]
    flip = np.array([1.0, -1.0, -1.0])
    gamma = np.sqrt(0.5 * (1.0 + np.einsum("nci,nci->nc", s, z)))
    w = (s + flip * z) / (2.0 * gamma[..., None])
    w[..., 0] = np.sqrt(1.0 + w[..., 1] ** 2 + w[..., 2] ** 2)
    v = w.copy()
    v[..., 0] += 1.0
    v /= np.sqrt(2.0 * v[..., :1])
    beta = np.sqrt(det_s / det_z)[..., None, None]
    J = np.diag(flip)
    scale = beta * (2.0 * v[..., :, None] * v[..., None, :] - J)
    v = flip * v
    return scale, (2.0 * v[..., :, None] * v[..., None, :] - J) / beta


def _product(a: Array, b: Array) -> Array:
    """Jordan product."""
    first = np.einsum("nci,nci->nc", a, b)[..., None]
    return np.concatenate([first, a[..., :1] * b[..., 1:] + b[..., :1] * a[..., 1:]], axis=-1)


def _reach(v: Array, d: Array) -> Array:
    """Largest step that keeps every cone of a row, at most 1e6."""
    a = d[..., 0] ** 2 - (d[..., 1:] ** 2).sum(axis=-1)
    b = v[..., 0] * d[..., 0] - (v[..., 1:] * d[..., 1:]).sum(axis=-1)
    c = _determinant(v)
    root = np.sqrt(np.maximum(b * b - a * c, 0.0))
    # smallest positive root of a t^2 + 2 b t + c, written without cancellation
    outward = np.where(a < 0.0, (b + root) / np.maximum(-a, 1e-300), 1e6)
    t = np.where(b <= 0.0, c / np.maximum(-b + root, 1e-300), outward)
    t = np.where((b * b - a * c < 0.0) & (a > 0.0), 1e6, t)
    back = np.where(d[..., 0] < 0.0, v[..., 0] / np.maximum(-d[..., 0], 1e-300), 1e6)
    return np.asarray(np.minimum(np.minimum(t, back), 1e6).min(axis=1))


_DELTA = 1e-9


def polish(M: Array, F: Array, W: Array, found: ConeSolution, *, robust: bool = False, steps: int = 3) -> ConeSolution:
    """Improve solutions of `solve_cones`; same shapes and units.

    ``robust`` takes regularised steps: slower, and right where idle joints share out their tilts in more than one way.
    """
    q, tau, zeta = found.q.copy(), found.tau.copy(), found.zeta.copy()
    count, blocks, _, k = M.shape
    forces = F.shape[1]
    m, f = loads(M, F, q)
    size, lean = _length(m), _length(tau)
    T = lean.max(axis=1)
    with np.errstate(all="ignore"):
        loaded = size > 1.0 - lean / T[:, None]
        pushed = np.abs(f) > 1.0 - np.abs(zeta)
        for _ in range(steps):
            m, f = loads(M, F, q)
            size = np.where(loaded, _length(m), 1.0)
            unit = np.where(loaded[..., None], m / size[..., None], 0.0)
            tau = np.where(loaded[..., None], -T[:, None, None] * unit, tau)
            zeta = np.where(pushed, -np.sign(f), zeta)
            matrix, right = _system(M, F, W, (m, f, size, unit, tau, zeta, T), loaded, pushed)
            step = None
            if not robust:
                with suppress(np.linalg.LinAlgError):
                    step = np.asarray(np.linalg.solve(matrix, right[:, :, None])[..., 0])
            step = _least(matrix, right, k) if step is None else step
            q = q + step[:, :k]
            T = T + step[:, k]
            end = k + 1 + 2 * blocks
            tau = tau + np.where(loaded[..., None], 0.0, step[:, k + 1 : end].reshape(count, blocks, 2))
            zeta = zeta + np.where(pushed, 0.0, step[:, end : end + forces])
    return ConeSolution(q, *_shared((M, F, W), q, tau, zeta, loaded, pushed), found.rounds)


def _shared(
    program: tuple[Array, Array, Array], q: Array, tau: Array, zeta: Array, loaded: Mask, pushed: Mask
) -> tuple[Array, Array]:
    """Put loaded joints at their limit for the T of q; let the idle ones close the loops with the least change."""
    M, F, W = program
    count, blocks, _, k = M.shape
    m, f = loads(M, F, q)
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


def loads(M: Array, F: Array, q: Array) -> tuple[Array, Array]:
    """Moments of the blocks and axial forces."""
    return (M @ q[:, None, :, None])[..., 0], (F @ q[:, :, None])[..., 0]


def _length(v: Array) -> Array:
    return np.asarray(np.hypot(v[..., 0], v[..., 1]))


def _system(M: Array, F: Array, W: Array, at: tuple[Array, ...], loaded: Mask, pushed: Mask) -> tuple[Array, Array]:
    """Newton matrix and right side: closure, normalisation, idle blocks, idle forces (identity rows for the others)."""
    m, f, size, unit, tau, zeta, T = at
    count, blocks, _, k = M.shape
    forces = F.shape[1]
    n = k + 1 + 2 * blocks + forces
    matrix, right = np.zeros((count, n, n)), np.zeros((count, n))
    flat = M.reshape(count, 2 * blocks, k)
    bend = (np.eye(2) - unit[..., :, None] * unit[..., None, :]) * (loaded * T[:, None] / size)[..., None, None]
    across = flat.transpose(0, 2, 1)
    matrix[:, :k, :k] = -across @ (bend @ M).reshape(flat.shape)
    slope = (across @ unit.reshape(count, -1, 1))[..., 0]
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


def _least(matrix: Array, right: Array, k: int) -> Array:
    """Solve symmetric systems that may be singular, by the proximal point method.

    The block of q is negative semidefinite, so with ``-delta`` there and ``+delta`` in the rest the matrix is
    quasi-definite: always regular [Vanderbei 1995].  Repeating the solve on the residual takes the error of delta away.
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
