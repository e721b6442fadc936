"""Least elastic energy of N poses: the distance of the misalignment from what the clearances take up.

With the moments ``M_b y`` and the compliance K of the loop wrenches y the dual program is

    maximise    W y - sum_b t_b |M_b y| - 1/2 y K y,

a strictly concave function with kinks.  In coordinates in which K is the unit matrix its optimum z is ``w`` less the
nearest point of the convex set ``{sum M_b' g_b : |g_b| <= t_b}``, so that ``|z| <= |w|`` and the energy is ``|z|^2/2``.
All poses are solved together: ``|M_b z|`` is replaced by ``sqrt(|M_b z|^2 + mu^2)`` with mu falling to 1e-13 of w, and
Newton's method works on z and the tilts g together.  The duality gap ``sum t |M z| - g M z`` bounds the error of z.

Source: [Chan et al. 1999].  See theory/what-binding-costs 3.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]
_RANK = 1e-11
#: Compliance of a direction that counts as none, relative to the largest.
_STIFF = 1e-14
_ROUNDS = 120
_SMALLEST = 1e-13
#: Loads below this, relative to those without clearance, are a matter of rounding.
NOTHING = 1e-8


class Least(NamedTuple):
    """Loop wrenches y (N, k), energies (N,), relative tilts g within the limits (N, blocks, 2).

    Joints without a limit have in g all of their tilt.  ``error`` is that of y, relative to y without clearances.
    ``stiff``: poses at which a misalignment meets no compliance and no clearance; the energy is infinite there, y
    worthless.
    """

    y: Array
    energy: Array
    g: Array
    error: Array
    stiff: Mask


def least_energy(M: Array, t: Array, W: Array, K: Array) -> Least:
    """Solve N programs (estimated): M (N, blocks, 2, k), limits t (blocks,), W (N, k), K (N, k, k).

    An infinite limit lets no moment pass; a limit of zero costs nothing but its compliance, which is in K.
    """
    count, k = W.shape
    out = Least(
        np.zeros((count, k)), np.zeros(count), np.zeros(M.shape[:3]), np.zeros(count), np.zeros(count, dtype=bool)
    )
    if count == 0 or k == 0:
        return out
    costly = np.isfinite(t) & (t > 0.0)
    open_joints = M[:, np.isinf(t)]
    for basis, poses in _allowed(open_joints.reshape(count, -1, k)):
        if basis.shape[2] == 0:
            continue
        w = (W[poses, None] @ basis)[:, 0]
        root, stiff = _root(basis.transpose(0, 2, 1) @ K[poses] @ basis)
        w = (w[:, None] @ root)[:, 0]
        rows = M[poses][:, costly] @ (basis @ root)[:, None]
        size = np.sqrt((w**2).sum(axis=1))
        unit = np.where(size > 0.0, size, 1.0)
        z, g, error = _nearest(rows, t[costly] / unit[:, None], w / unit[:, None])
        small = np.sqrt((z**2).sum(axis=1)) < NOTHING
        z[small] = 0.0
        held = (np.sqrt(((z * stiff) ** 2).sum(axis=1)) > 1e-6) & ~small
        z *= unit[:, None]
        out.y[poses] = (basis @ root @ z[:, :, None])[..., 0]
        out.energy[poses] = np.where(held, math.inf, 0.5 * (z**2).sum(axis=1))
        out.g[np.ix_(poses, np.flatnonzero(costly))] = g * unit[:, None, None]
        out.error[poses], out.stiff[poses] = error, held
    if open_joints.size:  # what closes the loops after all that is limited or gives way
        rest = W - np.einsum("nuv,nv->nu", K, out.y) - np.einsum("nbiu,nbi->nu", M, out.g)
        rows = open_joints.reshape(count, -1, k).transpose(0, 2, 1)
        out.g[:, np.isinf(t)] = (np.linalg.pinv(rows, rcond=_RANK) @ rest[:, :, None]).reshape(count, -1, 2)
    return out


def _allowed(forbidden: Array) -> list[tuple[Array, NDArray[np.intp]]]:
    """Bases of what joints without limit let pass, grouped by their dimension."""
    count, _, k = forbidden.shape
    if forbidden.shape[1] == 0:
        return [(np.broadcast_to(np.eye(k), (count, k, k)), np.arange(count))]
    _, values, right = np.linalg.svd(forbidden, full_matrices=True)
    rank = (values > _RANK * np.maximum(values[:, :1], 1e-300)).sum(axis=1)
    return [(right[rank == n, n:].transpose(0, 2, 1), np.flatnonzero(rank == n)) for n in np.unique(rank)]


def _root(K: Array) -> tuple[Array, Array]:
    """Matrix R with ``R' K R = 1`` and which of its columns are directions without compliance, (N, k)."""
    scale = np.sqrt(np.maximum(np.einsum("nii->ni", K), 1e-300))
    scale = np.where(scale > 1e-140, scale, scale.max(axis=1, keepdims=True))
    values, vectors = np.linalg.eigh(K / (scale[:, :, None] * scale[:, None, :]))
    most = np.maximum(values[:, -1:], 1e-300)
    stiff = values <= _STIFF * most
    values = np.where(stiff, _STIFF**2 * most, values)
    return vectors / scale[:, :, None] / np.sqrt(values)[:, None, :], stiff.astype(np.float64)


def _nearest(M: Array, t: Array, w: Array) -> tuple[Array, Array, Array]:
    """Return z (N, k), for w of length 1 or 0 and limits (N, blocks), tilts, and a bound of the error of z."""
    N, k = w.shape
    z, g = w.copy(), np.zeros(M.shape[:3])
    if M.shape[1] == 0:
        return z, g, np.zeros(N)
    size = np.sqrt((M**2).sum(axis=(2, 3)))  # moments are compared with the largest that |z| = 1 makes
    size = np.where(size > 0.0, size, 1.0)
    M, t = M / size[:, :, None, None], t * size  # tilts grow by the same factor
    mu, eye = 1.0, np.eye(k)
    with np.errstate(all="ignore"):
        for _ in range(_ROUNDS):
            m = (M @ z[:, None, :, None])[..., 0]
            length = np.sqrt((m**2).sum(-1) + mu**2)
            ratio = t / length
            # symmetric part of 1 - g m' / (t length)
            cross = g[..., :, None] * m[..., None, :] / np.where(t > 0.0, t * length, 1.0)[..., None, None]
            middle = ratio[..., None, None] * (np.eye(2) - 0.5 * (cross + cross.swapaxes(-1, -2)))
            H = eye + np.einsum("nbiu,nbij,nbjv->nuv", M, middle, M)
            right = w - z - np.einsum("nbiu,nbi->nu", M, ratio[..., None] * m)
            step = np.linalg.solve(H, right[:, :, None])[..., 0]
            turned = (M @ step[:, None, :, None])[..., 0]
            wanted = ratio[..., None] * (m + turned - g * ((m * turned).sum(-1) / (length * t))[..., None])
            g = _within(g, np.where(np.isfinite(wanted), wanted, 0.0), t)
            z = z + step
            moved = float(np.sqrt((step**2).sum(axis=1)).max())
            if moved < 0.1 * mu or moved < 1e-15:
                if mu <= _SMALLEST:
                    break
                mu = max(0.1 * mu, _SMALLEST)
    m = (M @ z[:, None, :, None])[..., 0]
    gap = (t * np.sqrt((m**2).sum(-1)) - (g * m).sum(-1)).sum(-1)
    rest = w - z - np.einsum("nbiu,nbi->nu", M, g)
    return z, g / size[..., None], np.sqrt(np.maximum(gap, 0.0) * 2.0) + np.sqrt((rest**2).sum(axis=1))


def _within(old: Array, new: Array, t: Array) -> Array:
    """Go from old tilts towards new ones, as far as their limits allow."""
    size = np.sqrt((new**2).sum(-1))
    return np.asarray(np.where((size > t)[..., None], new * (t / np.where(size > 0.0, size, 1.0))[..., None], new))
