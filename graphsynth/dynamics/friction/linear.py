"""Accelerations and multipliers as linear functions of the friction, from the equations of motion at one state."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from graphsynth.dynamics.friction.rows import FrictionRows

Array = NDArray[np.float64]

#: Singular values of the joints' rows below this part of the largest count as zero.
_RANK = 1e-10


@dataclass(frozen=True, eq=False)
class LinearResponse:
    """``a = a0 + G phi, lam = lam0 + B phi``, and the null vectors of the multipliers."""

    a0: Array
    G: Array
    lam0: Array
    B: Array
    null: Array
    sizes: Array


def respond(rows: FrictionRows, J: Array, gam: Array, Q: Array, W: Array) -> LinearResponse:
    """Solve ``M a + J^T lam = Q + W^T phi, J a = gam`` for loads alone and for every unit friction."""
    T, count = rows.compiled.tables, len(W)
    loads = np.column_stack([Q, W.T])
    sides = np.column_stack([gam, np.zeros((len(gam), count))])
    if not T.lower.size:
        return _respond_massless(rows, J, sides, loads)
    inverse = rows.lower_inverse
    Y = inverse @ J.T
    sizes = np.linalg.norm(Y, axis=0)
    sizes[sizes == 0.0] = 1.0
    U, S, Vt = np.linalg.svd(Y / sizes)
    rank = int(np.sum(_RANK * S[0] < S)) if S.size else 0
    free = inverse.T @ (inverse @ loads)
    z = (Vt[:rank] @ ((sides - J @ free) / sizes[:, None])) / S[:rank, None]
    a = free + inverse.T @ (U[:, :rank] @ z)
    lam = -(Vt[:rank].T @ (z / S[:rank, None])) / sizes[:, None]
    return LinearResponse(a[:, 0], a[:, 1:], lam[:, 0], lam[:, 1:], Vt[rank:].T / sizes[:, None], sizes)


def _respond_massless(rows: FrictionRows, J: Array, sides: Array, loads: Array) -> LinearResponse:
    """Return the same with links without mass, from the whole system; accelerations must be determined."""
    compiled = rows.compiled
    T, m = compiled.tables, len(J)
    unit = np.tile([T.size, T.size, 1.0], compiled.n // 3)
    row = np.array([1.0 if info.angular else T.size for info in compiled.info])
    mass = (T.mass * unit) * unit[:, None]
    weight = float(np.abs(mass).max())
    Js = J * unit / row[:, None]
    n = compiled.n
    matrix = np.block([[mass / weight, Js.T], [Js, np.zeros((m, m))]])
    right = np.vstack([loads * unit[:, None] / weight, sides / row[:, None]])
    found = np.linalg.lstsq(matrix, right, rcond=1e-13)[0]
    U, S, _ = np.linalg.svd(Js)
    rank = int(np.sum(_RANK * S[0] < S)) if S.size else 0
    return LinearResponse(
        found[:n, 0] * unit, found[:n, 1:] * unit[:, None], found[n:, 0] * weight / row,
        found[n:, 1:] * (weight / row)[:, None], U[:, rank:] / row[:, None], row,
    )  # fmt: skip
