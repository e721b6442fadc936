"""Joint positions over intervals of the input, proved: one solution for every input, inside a known box; their rates.

Krawczyk's test (`graphsynth.intervals.image`) on the closing equations of `Positions`, with the input and the
dimensions as interval parameters: UNIQUE says that for every input of a piece, and every choice of dimensions,
exactly one assembly lies in the box.  The branch is proved where, at the input shared by two pieces, the one assembly
of a point box lies in the boxes of both, or the hull of both holds exactly one.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from graphsynth.intervals import Dual, Interval, Status, cos, image, sin, variables
from graphsynth.intervals.dual import jacobian_of
from graphsynth.jamming.joints.positions import Placement, Positions
from graphsynth.mechanism.joints import PinSlot, Prismatic, Revolute

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]


def points(values: Array) -> Interval:
    """Floats as intervals of no width."""
    return Interval.from_bounds(values, values)


def enclosed_solve(matrix: Interval, right: Interval) -> tuple[Interval, Mask]:
    """Enclose the solutions of N systems (N, k, k) for all members; False where a matrix may be singular.

    With C near the inverse of the midpoint, ``x - x0 = C (b - A x0) + (1 - C A)(x - x0)``; a weighted norm of the last
    matrix below 1 bounds ``x - x0`` and proves every A regular [Rump 1980].
    """
    k = matrix.shape[-1]
    middle = np.where(np.isfinite(matrix.mid), matrix.mid, 0.0)
    inverse = np.linalg.pinv(middle, rcond=1e-14)
    C = points(inverse)
    start = (inverse @ right.mid[:, :, None])[..., 0]
    start = np.where(np.isfinite(start), start, 0.0)
    residual = right - (matrix * points(start[:, None])).sum(-1)
    first = (C * residual.reshape(len(residual), 1, k)).sum(-1).mag
    product = (C.reshape(-1, k, k, 1) * matrix.reshape(-1, 1, k, k)).sum(2)
    rest = points(np.eye(k)) - product
    size = np.where(np.isfinite(rest.mag), rest.mag, 1.0)
    first = np.where(np.isfinite(first), first, np.inf)
    weight = _weights(size, first)
    with np.errstate(all="ignore"):
        norm = (_nonnegative(size, weight) / points(weight)).hi.max(axis=1)
        largest = (points(first) / points(weight)).hi.max(axis=1)
        fine = np.isfinite(rest.mag).all(axis=(1, 2)) & (norm < 1.0) & np.isfinite(largest)
    norm, largest = np.where(fine, norm, 0.0), np.where(fine, largest, 0.0)
    bound = points(largest) / (1 - points(norm))
    spread = (points(weight) * bound.reshape(-1, 1)).hi
    first = np.where(fine[:, None], first, 0.0)
    for _ in range(3):  # any solution obeys |x - x0| <= first + |rest| |x - x0|
        spread = np.minimum(spread, (points(first) + _nonnegative(size, spread)).hi)
    around = Interval.from_bounds(-spread, spread)
    return around + points(start), np.asarray(fine)


def _weights(size: Array, first: Array) -> Array:
    """Positive weights near the fixed point of ``w = first + size w``; any positive numbers give valid bounds."""
    start = np.where(np.isfinite(first), first, 1.0)
    start = start + 1e-3 * start.max(axis=1, keepdims=True) + 1e-300
    weight = start
    for _ in range(6):
        weight = start + (size @ weight[:, :, None])[..., 0]
    return np.asarray(np.where(np.isfinite(weight), weight, 1.0))


def _nonnegative(matrix: Array, vector: Array) -> Interval:
    """Product of nonnegative numbers, enclosed."""
    return (points(matrix) * points(vector[:, None])).sum(-1)


_CHUNK = 256
_ROUNDS = 6


class Tubes(NamedTuple):
    """Pieces of the input and what is proved about them.

    ``proved`` (N,); ``domain`` and ``tight`` (N, size): the box with exactly one assembly, and where that lies;
    ``r``, ``e``, ``base`` (N, joints, 2), (N, joints, 2), (N, joints, 2, 2): positions, guide directions, directions of
    links a and b of the joints asked for.  Certified where proved.
    """

    proved: Mask
    domain: Interval
    tight: Interval
    r: Interval
    e: Interval
    base: Interval

    def take(self, rows: NDArray[np.intp]) -> Tubes:
        """Return some of the pieces."""
        return Tubes(
            self.proved[rows], self.domain[rows], self.tight[rows], self.r[rows], self.e[rows], self.base[rows]
        )


def prove_tubes(
    system: Positions, joints: tuple[int, ...], u: Interval, x: Array, rate: Array, counted: Array
) -> Tubes:
    """Prove pieces of the input around float solutions.

    Parameters
    ----------
    system : Positions
    joints : tuple of int
        Joints whose positions are wanted.
    u : Interval, shape (N,)
        Pieces of the input.
    x, rate : ndarray, shape (N, size)
        Unknowns at the midpoints, and their rates by the input.
    counted : ndarray, shape (N, closing)
        From ``system.count`` at the midpoints.
    """
    parts = []
    for k in range(0, max(len(x), 1), _CHUNK):
        part = slice(k, k + _CHUNK)
        parts.append(_prove(system, joints, u[part], x[part], rate[part], counted[part]))
    domain, tight, r, e, base = (_join([getattr(part, name) for part in parts]) for name in Tubes._fields[1:])
    return Tubes(np.concatenate([part.proved for part in parts]), domain, tight, r, e, base)


def _join(parts: list[Interval]) -> Interval:
    return Interval.from_bounds(np.concatenate([p.lo for p in parts]), np.concatenate([p.hi for p in parts]))


def _prove(system: Positions, joints: tuple[int, ...], u: Interval, x: Array, rate: Array, counted: Array) -> Tubes:
    count, size = x.shape
    q = system.driven(u)
    # room in every unknown, also in one that stands still for the moment
    reach = np.abs(rate) * u.rad[:, None]
    largest = (reach / system.weights).max(axis=1, initial=0.0, keepdims=True)
    radius = 1.2 * reach + (0.05 * largest + 1e-10) * system.weights
    low, high = x - radius, x + radius
    proved: Mask = np.zeros(count, dtype=bool)
    domain_lo, domain_hi, tight_lo, tight_hi = low.copy(), high.copy(), low.copy(), high.copy()
    left = np.arange(count)
    for _ in range(_ROUNDS):
        if left.size == 0 or size == 0:
            break
        box = Interval.from_bounds(low[left], high[left])
        own, turns = [_at(value, left, count) for value in q], counted[left]
        result = image(lambda unknowns, own=own, turns=turns: system.equations(unknowns, own, turns), box)
        good = result.status == Status.UNIQUE
        rows = left[good]
        proved[rows] = True
        domain_lo[rows], domain_hi[rows] = box.lo[good], box.hi[good]
        tight_lo[rows], tight_hi[rows] = result.box.lo[good], result.box.hi[good]
        bad = ~good & result.image.is_bounded.all(axis=1)
        wider = result.image[bad].hull(box[bad]).inflate(0.2, 1e-12)
        low[left[bad]], high[left[bad]] = wider.lo, wider.hi
        # a box of half the size of the mechanism says that the piece is too long: give up, it will be cut
        fits = (wider.rad < np.maximum(radius[left[bad]], 0.5 * system.weights)).all(axis=1)
        left = left[bad][fits]
    if size == 0:
        proved[:] = True
    else:  # more room around the solution, so that neighbours can be linked
        rows = np.flatnonzero(proved)
        box = Interval.from_bounds(domain_lo[rows], domain_hi[rows]).inflate(0.5)
        own, turns = [_at(value, rows, count) for value in q], counted[rows]
        good = image(lambda unknowns: system.equations(unknowns, own, turns), box).status == Status.UNIQUE
        domain_lo[rows[good]], domain_hi[rows[good]] = box.lo[good], box.hi[good]
    tight = Interval.from_bounds(tight_lo, tight_hi)
    domain = Interval.from_bounds(domain_lo, domain_hi)
    if not joints:
        return Tubes(proved, domain, tight, *(Interval.zeros((count, 0, *rest)) for rest in ((2,), (2,), (2, 2))))
    at, zero = system.place([tight[:, k] for k in range(size)], q), Interval.zeros((count,))
    return Tubes(proved, domain, tight, *places(system, joints, at, lambda value: value + zero))


def _at(value: Interval, rows: NDArray[np.intp], count: int) -> Interval:
    return value[rows] if value.shape == (count,) else value


def places(
    system: Positions, joints: tuple[int, ...], at: Placement, read: Callable[[Any], Interval]
) -> tuple[Interval, Interval, Interval]:
    """Stack positions, guide directions and link directions of joints; ``read`` takes what is wanted of each number."""

    def full(pair: tuple[Any, Any]) -> Interval:
        return Interval.stack([read(pair[0]), read(pair[1])], axis=-1)

    r, e, base = [], [], []
    for k in joints:
        joint = system.mechanism.joints[k]
        A, B = system.ends(k, at)
        if isinstance(joint, Revolute):  # both ends are the same point: each encloses it
            a, b = full(A), full(B)
            r.append(a.intersect(b))
        else:
            r.append(full(B))
        if isinstance(joint, Prismatic | PinSlot):
            turn, own = at.turn[joint.a], Interval(joint.angle_a)
            c, s = cos(own), sin(own)
            e.append(full((turn[0] * c - turn[1] * s, turn[1] * c + turn[0] * s)))
        else:
            e.append(full((Interval(1), Interval(0))))
        base.append(Interval.stack([full(at.turn[joint.a]), full(at.turn[joint.b])], axis=1))
    return Interval.stack(r, axis=1), Interval.stack(e, axis=1), Interval.stack(base, axis=1)


def linked(system: Positions, points: Tubes, u: Interval, before: Interval, after: Interval, counted: Array) -> Mask:
    """Whether neighbouring pieces have the same assembly at the input they share.

    Each box holds exactly one.  It is the same if the one of a point box (``points``, proved at u) lies in both, or if
    the common hull holds exactly one, for every choice of dimensions.
    """
    inside = points.tight.subset(before).all(axis=1) & points.tight.subset(after).all(axis=1)
    found: Mask = np.asarray(points.proved & inside)
    q, count = system.driven(u), len(before)
    left = np.flatnonzero(~found)
    for k in range(0, left.size, _CHUNK):
        rows = left[k : k + _CHUNK]
        own, turns = [_at(value, rows, count) for value in q], counted[rows]
        box = before[rows].hull(after[rows]).inflate(0.05, 1e-13)
        result = image(lambda unknowns, own=own, turns=turns: system.equations(unknowns, own, turns), box)
        found[rows] = result.status == Status.UNIQUE
    return found


def slopes(
    system: Positions, joints: tuple[int, ...], u: Interval, tubes: Tubes, counted: Array
) -> tuple[Interval, Interval, Interval, Mask]:
    """Enclose the derivatives by the input of ``r``, ``e``, ``base`` of `Tubes`, and tell where that is proved.

    On the branch ``F(x(u), u) = 0``, so ``F_x x' = -F_u``; with both enclosed over the tight boxes the solution set of
    the linear system holds ``x'`` for every input and every choice of dimensions.
    """
    count, n = len(u), system.size
    box = Interval.from_bounds(np.column_stack([tubes.tight.lo, u.lo]), np.column_stack([tubes.tight.hi, u.hi]))
    unknowns = variables(box)
    q: list[Any] = system.driven(unknowns[n])
    if n:
        table = jacobian_of(system.equations(unknowns[:n], q, counted), n + 1, (count,))
        rate, fine = enclosed_solve(table[:, :, :n], -table[:, :, n])
    else:
        rate, fine = Interval.zeros((count, 0)), np.ones(count, dtype=bool)

    def along(value: Any) -> Interval:
        """Return the derivative along the motion."""
        if not isinstance(value, Dual):
            return Interval.zeros((count,))
        total = value.grad[n]
        for i in range(n):
            total = total + value.grad[i] * rate[:, i]
        return total

    moved = places(system, joints, system.place(unknowns[:n], q), along)
    return (*moved, fine)
