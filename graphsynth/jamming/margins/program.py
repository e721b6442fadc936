"""Items and their program: every limit on tilt and every axial clearance alike, with limits of its own at each pose.

An item is a plane vector that a limit bounds: the tilt of a block, or the slip of a joint over the unit of length.
What is found here in floating point proves nothing; `lines` makes bounds of it.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from graphsynth.intervals import Interval
from graphsynth.jamming.joints.closure import PITCH, ROUND, Columns, Layout, Leans, moment_rows, work_row
from graphsynth.jamming.joints.cones import solve_cones

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]
#: Cost of a wrench that nothing else bounds.
_LEAST = 1e-7
#: What joints without limit take of a correction beside others.
_FREE = 1e4


class Items(NamedTuple):
    """Blocks, then joints: which cost something, which have no limit, which are plane vectors; the unit of length."""

    costly: Mask
    free: Mask
    plane: Mask
    centre: Array
    length: float

    @classmethod
    def of(cls, layout: Layout, r: Array) -> Items:
        """Read the layout; the unit from joint positions (N, joints, 2)."""
        limits = np.concatenate([layout.limit, layout.end_float])
        flat = r.reshape(-1, 2)
        centre = 0.5 * (flat.min(axis=0) + flat.max(axis=0))
        plane = np.concatenate([layout.block_axis == ROUND, np.zeros(len(layout.end_float), dtype=np.bool_)])
        unit = float(np.abs(flat - centre).max()) or 1.0
        return cls((limits > 0.0) & np.isfinite(limits), np.isinf(limits), plane, centre, unit)


class Sharing(NamedTuple):
    """Solutions of P poses: wrenches ``y`` (P, 3 loops), vectors (P, items, 2), rows (P, items, 2, 3 loops)."""

    y: Array
    tau: Array
    rows: Array


def item_rows(layout: Layout, r: Array, e: Array) -> Array:
    """Return what every item adds to the closure, (P, items, 2, 3 loops); positions in units."""
    moments = moment_rows(layout, r, e)
    forces = np.zeros((len(r), len(layout.end_float), 2, moments.shape[3]))
    forces[:, :, 0, 2::3] = layout.incidence.T
    return np.concatenate([moments, forces], axis=1)


def share(layout: Layout, items: Items, t: Array, r: Array, e: Array, lean: Leans) -> Sharing:
    """Share the misalignments (P, joints, 2) among items with limits t (P, items), in floating point."""
    rows, W = item_rows(layout, r, e), work_row(layout, lean)
    count, k = W.shape
    size = np.sqrt((W**2).sum(axis=1))
    unit = np.where(size > 0.0, size, 1.0)
    top = np.where(items.costly, t, 0.0).max(axis=1, initial=0.0)
    top = np.where(top > 0.0, top, 1.0)
    scaled = np.where(items.costly, t, 0.0) / top[:, None]
    own = np.flatnonzero(items.costly)
    y, tau = np.zeros((count, k)), np.zeros((count, len(items.costly), 2))
    slack = np.zeros((count, k, 2, k))
    slack[:, np.arange(k), 0, np.arange(k)] = _LEAST
    for basis, poses in _carried(rows[:, items.free]):
        M = np.concatenate([rows[poses][:, own] * scaled[poses][:, own, None, None], slack[poses]], axis=1)
        M, b = M @ basis[:, None], ((W / unit[:, None])[poses, None] @ basis)[:, 0]
        found = solve_cones(M, np.zeros((len(poses), 0, M.shape[3])), b)
        y[poses] = (basis @ found.q[:, :, None])[..., 0]
        stretch = scaled[poses][:, own] * unit[poses, None]
        tau[np.ix_(poses, own)] = found.tau[:, : len(own)] * stretch[..., None]
    y[size == 0.0], tau[size == 0.0] = 0.0, 0.0
    tau[:, ~items.plane, 1] = 0.0
    return Sharing(y, tau, rows)


def _carried(forbidden: Array) -> list[tuple[Array, NDArray[np.intp]]]:
    """Bases of the wrenches that joints without limit carry, grouped by their number."""
    count, k = len(forbidden), forbidden.shape[3]
    flat = forbidden.reshape(count, -1, k)
    if flat.shape[1] == 0:
        return [(np.broadcast_to(np.eye(k), (count, k, k)), np.arange(count))]
    _, values, right = np.linalg.svd(flat, full_matrices=True)
    rank = (values > 1e-11 * np.maximum(values[:, :1], 1.0)).sum(axis=1)
    kinds = [n for n in np.unique(rank) if n < k]
    return [(right[rank == n, n:].transpose(0, 2, 1), np.flatnonzero(rank == n)) for n in kinds]


def ways(items: Items, t: Array, found: Sharing, loose: Array) -> Array:
    """Return changes of the items (P, items, 2, 3 loops) that correct the closure, a column for each of its sums.

    In proportion to the squares of the limits; an item that uses its limit as far as any other turns and grows only
    ``loose`` times as far.
    """
    top = np.where(items.costly, t, 0.0).max(axis=1, initial=0.0, keepdims=True)
    top = np.where(top > 0.0, top, 1.0)
    weight = np.where(items.free, _FREE, np.where(items.costly, (t / top) ** 2, 0.0))
    moves = found.rows * weight[:, :, None, None]
    size = np.hypot(found.tau[..., 0], found.tau[..., 1])
    use = np.where(items.costly, size / np.where(t > 0.0, t, np.inf), 0.0)
    left = 1.0 - use / np.maximum(use.max(axis=1, keepdims=True, initial=0.0), 1e-300)
    unit = found.tau / np.where(size > 0.0, size, 1.0)[..., None]
    unit = unit * np.sqrt(1.0 - np.clip(4.0 * left, loose[:, None], 1.0))[..., None]
    moves = moves - unit[..., None] * (unit[..., None] * moves).sum(axis=2, keepdims=True)
    flat = found.rows.reshape(len(t), -1, found.rows.shape[3])
    effect = flat.transpose(0, 2, 1) @ moves.reshape(flat.shape)
    return np.asarray(moves @ np.linalg.pinv(effect, rcond=1e-14)[:, None])


def closure(
    layout: Layout,
    r: Columns,
    e: Columns,
    tau: list[tuple[Any, Any]],
    lean: dict[int, tuple[tuple[Any, Any], tuple[Any, Any]]],
) -> list[Any]:
    """Sum up every loop (3 for each) for items tau; intervals or duals, positions in units.

    ``lean``: misalignments by joint, each with the point about which it leans.
    """
    zero = Interval(0)
    joints, blocks = len(layout.joints), len(layout.limit)
    x: list[Any] = [zero] * joints
    y: list[Any] = [zero] * joints
    for block, place in enumerate(layout.block_joint.tolist()):
        axis, (first, second) = layout.block_axis[block], tau[block]
        if axis != ROUND:
            a, b = e[place]
            if axis == PITCH:
                a, b = -b, a
            first, second = a * first, b * first
        x[place], y[place] = x[place] + first, y[place] + second
    more: dict[int, Any] = {}
    for place, ((first, second), (p, q)) in lean.items():
        if place in layout.rails:
            more[place] = r[place][0] * y[place] - r[place][1] * x[place] + (p * second - q * first)
        x[place], y[place] = x[place] + first, y[place] + second
    lifts = [r[k][0] * y[k] - r[k][1] * x[k] if k not in more else more[k] for k in range(joints)]
    lifts = [own + tau[blocks + k][0] for k, own in enumerate(lifts)]
    sums: list[Any] = []
    for signs in layout.incidence.tolist():
        parts: list[Any] = [zero] * 3
        for place, sign in enumerate(signs):
            if sign:
                own = (x[place], y[place], lifts[place])
                parts = [p + v if sign > 0.0 else p - v for p, v in zip(parts, own)]
        sums += parts
    return sums
