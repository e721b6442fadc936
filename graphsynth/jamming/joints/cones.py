"""The convex program of one pose, solved for many poses at once.

In scaled form (limits taken into the rows) the dual program reads

    maximise    W q - sum_j |F_j q|      subject to    sum_b |M_b q| <= 1,

with two-dimensional blocks ``M_b q`` (moments) and numbers ``F_j q`` (axial forces).  Its dual is the problem of least
tilt: the smallest T with ``sum M_b' tau_b + sum F_j' zeta_j + W = 0``, ``|tau_b| <= T`` and ``|zeta_j| <= 1``.
A primal-dual interior-point method with Nesterov-Todd scaling and Mehrotra's corrector is run on all poses together;
each pose starts strictly feasible on both sides.  Nothing rests on its convergence: the caller computes a lower and an
upper bound of T from ``q`` and ``tau`` alone.

Source: Nesterov and Todd (1997); Vandenberghe, "The CVXOPT linear and quadratic cone program solvers" (2010).
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

__all__ = ["ConeSolution", "solve_cones"]

Array = NDArray[np.float64]

_ROUNDS = 60
_TARGET = 1e-12


class ConeSolution(NamedTuple):
    """``q`` (N, k), ``tau`` (N, blocks, 2), ``zeta`` (N, forces), ``rounds``; scaled as in the module's text."""

    q: Array
    tau: Array
    zeta: Array
    rounds: int


def solve_cones(M: Array, F: Array, W: Array) -> ConeSolution:
    """Solve N programs of one shape.

    Parameters
    ----------
    M : ndarray, shape (N, blocks, 2, k)
        Full column rank when stacked; a second row of zeros makes a block one-dimensional.
    F : ndarray, shape (N, forces, k)
    W : ndarray, shape (N, k)
        Of the order of 1.

    Returns
    -------
    ConeSolution
        Estimated (floating point).
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
        Gs = (inverse @ G).reshape(count, 3 * cones, n)
        H = Gs.transpose(0, 2, 1) @ Gs
        solve = _inverse(H)
        flat = G.reshape(count, 3 * cones, n)
        rx = self.c[rows] + (flat.transpose(0, 2, 1) @ z.reshape(count, -1, 1))[..., 0]
        rz = s + (G @ x[:, None, :, None])[..., 0] - self.h[rows]
        mu = np.einsum("nci,nci->n", lam, lam) / cones

        def direction(target: Array) -> tuple[Array, Array, Array]:
            """Solve for ``lam o (W dz + W^-1 ds) = target``."""
            t = _divide(lam, target)
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


def _norm(v: Array) -> Array:
    return np.hypot(v[..., 1], v[..., 2])


def _determinant(v: Array) -> Array:
    r = _norm(v)
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


def _divide(lam: Array, t: Array) -> Array:
    """Solve ``lam o x = t``."""
    det = _determinant(lam)
    x0 = (lam[..., 0] * t[..., 0] - (lam[..., 1:] * t[..., 1:]).sum(axis=-1)) / det
    rest = (t[..., 1:] - x0[..., None] * lam[..., 1:]) / lam[..., :1]
    return np.concatenate([x0[..., None], rest], axis=-1)


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
