"""Closure of the loops in space with first and second derivatives, in floats or in balls.

Of every loop X is the product of the motions once round; it closes if X is the identity.  The equations are the
antisymmetric part of the rotation of X (its axial vector) and the place of X.  Every unknown moves the rest of the loop
by a twist ``(omega, v)``, so ``dX = twist X`` and ``d2X = twist_k twist_l X`` for k before l: all derivatives are
products of 3-vectors.  See theory/closure-in-space 2.
"""

from __future__ import annotations

from functools import cached_property, lru_cache
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from graphsynth.intervals import Interval
from graphsynth.intervals.balls import Balls, exact, stack, unit
from graphsynth.jamming.space.model import SHIFT_X, SLIDE, TILT_X, TILT_Y, TURN, SpaceModel, Step

Array = NDArray[np.float64]
Ints = NDArray[np.intp]
_EYE = np.eye(3)
#: More than what rounding loses in sums and roots of a few dozen nonnegative numbers.
_UP = 1.0 + 1e-13
#: The cross product with a vector: its entries and signs in the matrix of the product.
_HAT = np.zeros((3, 3, 3))
_HAT[[0, 1, 2], [1, 2, 0], [2, 0, 1]] = -1.0
_HAT[[0, 1, 2], [2, 0, 1], [1, 2, 0]] = 1.0


def ball(values: Interval) -> Balls:
    """Balls around intervals."""
    return Balls(np.asarray(values.mid), np.asarray(values.rad))


def _joined(parts: list[Any]) -> Any:
    """Join floats or balls along a new last axis."""
    if any(isinstance(part, Balls) for part in parts):
        whole = [part if isinstance(part, Balls) else exact(part) for part in parts]
        if all(part.mid.shape == whole[0].mid.shape for part in whole):
            return stack(whole)
        shape = np.broadcast_shapes(*(part.mid.shape for part in whole))
        return stack([Balls(np.broadcast_to(part.mid, shape), np.broadcast_to(part.rad, shape)) for part in whole])
    return np.stack(np.broadcast_arrays(*parts), -1)


def times(A: Any, B: Any) -> Any:
    """Product of matrices over the last two axes."""
    if not isinstance(A, Balls) and not isinstance(B, Balls):
        return A @ B
    A, B = (part if isinstance(part, Balls) else exact(part) for part in (A, B))
    while B.mid.ndim < A.mid.ndim:  # it would be taken for vectors
        B = B[None]
    return A.times(B)


def swapped(A: Any) -> Any:
    """Transpose over the last two axes."""
    return _each(A, lambda part: np.swapaxes(part, -1, -2))


def _each(A: Any, change: Any) -> Any:
    """Apply what only moves entries."""
    return Balls(change(A.mid), change(A.rad)) if isinstance(A, Balls) else change(A)


def joined_rows(rows: list[list[Any]]) -> Any:
    """Join entries to matrices over two new last axes."""
    flat = _joined([entry for row in rows for entry in row])
    return _each(flat, lambda part: part.reshape(*part.shape[:-1], len(rows), len(rows[0])))


def cross(a: Any, b: Any) -> Any:
    """Vector product over the last axis."""
    return _joined([a[..., i] * b[..., j] - a[..., j] * b[..., i] for i, j in ((1, 2), (2, 0), (0, 1))])


class _Local(NamedTuple):
    """Joints met on a loop, m of them at N points.

    ``rotation`` (N, m, 3, 3) and ``place`` (N, m, 3) of seat b seen from seat a; twists (N, m, 6, 3) of the six
    coordinates in the frame of seat a; ``bend`` (N, m, 4, 3): derivatives of the angular velocities of the tilts x, y
    by x and y, in the order xx, xy, yx, yy (of which the last is the tilt whose velocity it is).
    """

    rotation: Any
    place: Any
    omega: Any
    v: Any
    bend: Any
    push: Any


def tilt_rates(x: Any, y: Any, xx: Any, yy: Any) -> tuple[Any, list[Any], list[Any]]:
    """T of the chart, its angular velocities ``k (dx + x cross dx / 2)``, and their derivatives xx, xy, yx, yy.

    ``xx`` and ``yy`` are the squares, which balls may know better than as products.
    """
    k = 1.0 / (1.0 + 0.25 * (xx + yy))
    zero = 0.0 * k
    a, b, c, u, v = 0.5 * k * yy, 0.5 * k * xx, 0.5 * k * (x * y), k * x, k * y
    T = joined_rows([[1.0 - a, c, v], [c, 1.0 - b, -u], [-v, u, 1.0 - (a + b)]])
    first, second = [k, zero, -0.5 * v], [zero, k, 0.5 * u]
    # dk/dx = - k k x / 2
    sx, sy = -0.5 * k * u, -0.5 * k * v
    bends = [
        [sx, zero, -0.5 * sx * y],
        [zero, sx, 0.5 * sx * x + 0.5 * k],
        [sy, zero, -0.5 * sy * y - 0.5 * k],
        [zero, sy, 0.5 * sy * x],
    ]
    return T, [first, second], bends


class Loop(NamedTuple):
    """A loop at N points: rotation (N, 3, 3) and place (N, 3) of X, and twists (N, k, 3) of its k unknowns.

    ``columns`` are the numbers of the unknowns, ``order`` (k,) their places along the loop, alike for tilts of one
    joint; ``bends`` are pairs of places and the twists (N, pairs, 3) by which tilts of one joint change.  ``gather``
    (k, columns) adds up what belongs to one column, where a parameter is met more than once.
    """

    R: Any
    t: Any
    omega: Any
    v: Any
    columns: Ints
    order: Ints
    bends: tuple[Ints, Any, Any]
    gather: Array | None = None

    @property
    def values(self) -> Any:
        """Left sides of the six equations, (N, 6)."""
        R, t = self.R, self.t
        turn = [0.5 * (R[..., j, i] - R[..., i, j]) for i, j in ((1, 2), (2, 0), (0, 1))]
        return _joined([*turn, t[..., 0], t[..., 1], t[..., 2]])

    def slopes(self, omega: Any, v: Any) -> Any:
        """Change of the left sides by twists (N, k, 3), shape (N, k, 6): ``(tr(R) - R) omega / 2``, place."""
        R = self.R
        trace = R[..., 0, 0] + R[..., 1, 1] + R[..., 2, 2]
        turn = 0.5 * (trace[..., None, None] * omega - times(omega, swapped(R)))
        move = v - cross(self.t[..., None, :], omega)
        return _joined([*(turn[..., i] for i in range(3)), *(move[..., i] for i in range(3))])

    @property
    def rates(self) -> Any:
        """Derivatives of the six left sides by the columns, (N, 6, columns)."""
        found = swapped(self.slopes(self.omega, self.v))
        return found if self.gather is None else times(found, self.gather)

    def repeated(self) -> Loop:
        """Return the loop with an axis for several rows of multipliers."""
        R, t, omega, v = (part[:, None] for part in (self.R, self.t, self.omega, self.v))
        pairs, turned, pushed = self.bends
        return self._replace(R=R, t=t, omega=omega, v=v, bends=(pairs, turned[:, None], pushed[:, None]))

    def bend(self, by: Any) -> Any:
        """Second derivative of the left sides weighed by multipliers (N, 6), shape (N, columns, columns)."""
        r, p = by[..., :3], by[..., 3:]
        hat = joined_rows([[sum_of(_HAT[:, i, j], r) for j in range(3)] for i in range(3)])
        G = 0.5 * times(self.R, swapped(hat))
        pt = p * self.t
        c = G[..., 0, 0] + G[..., 1, 1] + G[..., 2, 2] + (pt[..., 0] + pt[..., 1] + pt[..., 2])
        # omega_k (G + t p') omega_l - c omega_k omega_l + omega_k (v_l cross p), k before l
        G = G + self.t[..., :, None] * p[..., None, :]
        G = G - c[..., None, None] * _EYE
        U = times(self.omega, swapped(G)) + cross(self.v, p[..., None, :])
        B = times(self.omega, swapped(U))
        before, same = (test(self.order[:, None], self.order[None, :]) for test in (np.less, np.equal))
        B = _mixed(before | (same & ~np.tri(len(self.order), k=-1, dtype=bool)), B, swapped(B))
        pairs, omega, v = self.bends
        if len(pairs):
            change = self.slopes(omega, v) * by[..., None, :]
            value = change[..., 0]
            for k in range(1, 6):
                value = value + change[..., k]
            more = np.zeros((2, *B.mid.shape)) if isinstance(B, Balls) else np.zeros((1, *B.shape))
            for part, own in zip(more, (value.mid, value.rad) if isinstance(value, Balls) else (value,)):
                part[..., pairs[:, 0], pairs[:, 1]] = own
            B = B + (Balls(*more) if isinstance(B, Balls) else more[0])
        return B if self.gather is None else times(swapped(times(B, self.gather)), self.gather)


def sum_of(weights: Array, parts: Any) -> Any:
    """Sum of the entries (..., 3) with weights, each 0, 1 or -1."""
    place = np.flatnonzero(weights)
    return 0.0 * parts[..., 0] if place.size == 0 else float(weights[place[0]]) * parts[..., place[0]]


def _mixed(mask: NDArray[np.bool_], a: Any, b: Any) -> Any:
    if isinstance(a, Balls):
        return Balls(np.where(mask, a.mid, b.mid), np.where(mask, a.rad, b.rad))
    return np.where(mask, a, b)


class _Moves(NamedTuple):
    """Parameters that move the place of the joint after some steps of a loop: steps, columns, vectors (moves, 3)."""

    steps: Ints
    columns: Ints
    vectors: Any


class _Plan(NamedTuple):
    """What of a loop does not change: joints (m,), signs, which unknowns, motions between joints."""

    joints: Ints
    sign: Array
    chosen: tuple[Ints, ...]
    columns: Ints
    order: Ints
    bends: tuple[Ints, Ints, Ints]
    rotation: Any
    place: Any
    moves: _Moves | None
    gather: Array | None


class Closure:
    """Closure of a model, in floats or, with ``exact``, in balls around the enclosed constants."""

    def __init__(self, model: SpaceModel, exact: bool) -> None:
        self.model, self.exact = model, exact
        self.rows = [(k, row) for k, rows in enumerate(model.rows) for row in rows]

    @cached_property
    def _plans(self) -> list[_Plan]:
        return [self._plan(k) for k in range(len(self.model.loops))]

    def _plan(self, number: int) -> _Plan:
        steps = self.model.loops[number]
        joints = np.array([step.joint for step in steps])
        sign = np.array([1.0 if step.forward else -1.0 for step in steps])
        table = self.model.column[joints]
        # along the loop: shift, tilt, turn of a joint, or back
        stage = np.array([2, 1, 1, 0, 0, 0])
        along = 4 * np.arange(len(steps))[:, None] + np.where(sign[:, None] > 0, stage, 2 - stage)
        chosen = np.nonzero(table >= 0)
        order = along[chosen]
        place = np.full(table.shape, -1)
        place[chosen] = np.arange(len(order))
        pairs, at, kind = [], [], []
        for m in range(len(steps)):
            for k, (i, j) in enumerate(((0, 0), (0, 1), (1, 0), (1, 1))):
                ends = place[m, TILT_X + i], place[m, TILT_X + j]
                # by symmetry of second derivatives the product of twists stands for i <= j in the order of `bend`
                if min(ends) >= 0 and i >= j:
                    pairs += [ends] if i == j else [ends, ends[::-1]]
                    at += [m] * (1 + (i != j))
                    kind += [k] * (1 + (i != j))
        constants: list[Any] = [Interval.stack([getattr(s, name) for s in steps]) for name in ("rotation", "place")]
        turn, way = (ball(part) if self.exact else part.mid for part in constants)
        bends = (
            np.array(pairs, dtype=np.intp).reshape(-1, 2),
            np.array(at, dtype=np.intp),
            np.array(kind, dtype=np.intp),
        )
        columns, moves, gather = table[chosen], self._moves(steps), None
        if moves is not None:
            columns = np.concatenate([columns, moves.columns])
            order = np.concatenate([order, 4 * moves.steps + 3])  # after the joint, all alike: they commute
            unique, own = np.unique(columns, return_inverse=True)
            if len(unique) < len(columns):
                gather, columns = np.eye(len(unique))[own], unique
        return _Plan(joints, sign, chosen, columns, order, bends, turn, way, moves, gather)

    def _moves(self, steps: tuple[Step, ...]) -> _Moves | None:
        """Collect what parameters move along a loop."""
        found = [(place, k, vector) for place, step in enumerate(steps) for k, vector in step.moves]
        if not found:
            return None
        vectors: Any = Interval.stack([vector for _, _, vector in found])
        first = self.model.width - self.model.parameters
        columns = np.array([first + k for _, k, _ in found])
        return _Moves(np.array([place for place, _, _ in found]), columns, ball(vectors) if self.exact else vectors.mid)

    def _ways(self, plan: _Plan, q: Any) -> list[Any]:
        """Place of every joint of a loop seen from the one before, (1, 3) or (N, 3)."""
        ways = [plan.place[k][None] for k in range(len(plan.sign))]
        if plan.moves is not None:
            for place, k in enumerate(plan.moves.steps.tolist()):
                size = q[:, plan.moves.columns[place]][:, None]
                ways[k] = ways[k] + size * plan.moves.vectors[place][None]
        return ways

    def loops(self, q: Any) -> list[Loop]:
        """Evaluate every loop at unknowns and given coordinates (N, width), floats or balls."""
        return [self._loop(plan, q) for plan in self._plans]

    def _coordinates(self, joints: Ints, q: Any) -> Any:
        """All six coordinates of joints, (N, m, 6)."""
        table = self.model.column[joints]
        return _each(q, lambda part: np.where(table >= 0, part[:, np.maximum(table, 0)], 0.0))

    def _local(self, plan: _Plan, q: Any) -> _Local:
        c = self._coordinates(plan.joints, q)
        e = c[..., SHIFT_X : SLIDE + 1]
        x, y = c[..., TILT_X], c[..., TILT_Y]
        T, rates, bends = tilt_rates(x, y, x * x, y * y)
        turned = unit(c[..., TURN]) if self.exact else np.exp(1j * c[..., TURN])
        C, S = turned.real, turned.imag
        zero = 0.0 * x
        R = times(T, joined_rows([[C, -S, zero], [S, C, zero], [zero, zero, zero + 1.0]]))
        axis = T[..., :, 2]
        still = [zero, zero, zero]
        rows = [[axis[..., k] for k in range(3)], *rates, still, still, still]
        omega = joined_rows(rows)
        v = cross(e[..., None, :], omega)
        shift = np.zeros((6, 3))
        shift[SHIFT_X:] = _EYE
        bend = joined_rows(bends)
        if (plan.sign < 0).any():  # back: of T(-x), seen from seat a
            own = times(joined_rows(tilt_rates(-x, -y, x * x, y * y)[2]), swapped(T))
            bend = _mixed((plan.sign > 0)[:, None, None], bend, own)
        return _Local(R, e, omega, v + shift, bend, cross(e[..., None, :], bend))

    def _loop(self, plan: _Plan, q: Any) -> Loop:
        local = self._local(plan, q)
        if self.exact and q.rad.any():
            at = self._local(plan, exact(q.mid))
            both = zip(self._frames(plan, local, self._ways(plan, q)), self._around(plan, at, q))
            # entry by entry, or by angles: both have the same midpoints
            R, t, frames, places, *after = (
                Balls(b.mid, np.where(a.mid == b.mid, np.minimum(a.rad, b.rad), b.rad)) for a, b in both
            )
        else:
            R, t, frames, places, *after = self._frames(plan, local, self._ways(plan, q))
        signs = plan.sign[:, None, None]
        turned = swapped(frames)
        omega = signs * times(local.omega, turned)
        v = signs * times(local.v, turned) + cross(places[:, :, None], omega)
        bent = times(local.bend, turned)
        pushed = times(local.push, turned) + cross(places[:, :, None], bent)
        pairs, which, kind = plan.bends
        joint, coordinate = plan.chosen
        omega, v = omega[:, joint, coordinate], v[:, joint, coordinate]
        if plan.moves is not None:  # a parameter moves all that comes after, and turns nothing
            own = times(after[0], plan.moves.vectors[None, ..., None])[..., 0]
            omega, v = _along([omega, 0.0 * own]), _along([v, own])
        bends = pairs, bent[:, which, kind], pushed[:, which, kind]
        return Loop(R, t, omega, v, plan.columns, plan.order, bends, plan.gather)

    def _frames(self, plan: _Plan, local: _Local, ways: list[Any]) -> tuple[Any, ...]:
        """X, and the frames of all seats a (N, m, 3, 3), with places, on the way round; frames where parameters move.

        The last are (N, moves, 3, 3), and left out where there are none.
        """
        count, m = local.place.mid.shape[:2] if self.exact else local.place.shape[:2]
        R: Any = np.broadcast_to(_EYE, (count, 3, 3))
        t: Any = np.zeros((count, 3, 1))
        if self.exact:
            R, t = exact(R), exact(t)
        starts, after = [], []
        for k in range(m):
            turn, move = local.rotation[:, k], local.place[:, k][..., None]
            if plan.sign[k] > 0:
                starts.append((R, t))
                R, t = times(R, turn), t + times(R, move)
            else:
                R = times(R, swapped(turn))
                t = t - times(R, move)
                starts.append((R, t))
            after.append(R)
            R, t = times(R, plan.rotation[k][None]), t + times(R, ways[k][..., None])
        moved = [] if plan.moves is None else [_across([after[k] for k in plan.moves.steps])]
        return R, t[..., 0], _across([R for R, _ in starts]), _across([t[..., 0] for _, t in starts]), *moved

    def _around(self, plan: _Plan, at: _Local, q: Balls) -> tuple[Any, ...]:
        """Frames over boxes: those of the middle, and how far they turn and move at most.

        A rotation by an angle a moves a vector by at most a times its length, whatever was turned before; so angles
        add up along the loop, and do not multiply as products of intervals do.
        """
        ways = self._ways(plan, exact(q.mid))
        R, t, frames, places, *after = self._frames(plan, at, ways)
        c = self._coordinates(plan.joints, q).rad
        turn = (c[..., TURN] + np.hypot(c[..., TILT_X], c[..., TILT_Y])) * _UP
        move = np.sqrt((c[..., SHIFT_X:] ** 2).sum(-1)) * _UP
        offset, *step = (np.sqrt((part.size**2).sum(-1)) * _UP for part in (at.place, *ways))
        more = self._pushed(plan, q)
        angle = far = np.zeros(len(q.mid))
        turned, moved, angles = [], [], []
        for k in range(turn.shape[1]):
            ends = []
            if plan.sign[k] > 0:
                ends = [angle, far]
                far = far + angle * offset[:, k] + move[:, k]
                angle = angle + turn[:, k]
            else:
                angle = angle + turn[:, k]
                far = far + angle * offset[:, k] + move[:, k]
                ends = [angle, far]
            turned.append(ends[0])
            moved.append(ends[1])
            angles.append(angle)
            far = far + angle * step[k] + more[k]
        wider, off = (np.stack(part, 1) * _UP for part in (turned, moved))
        whole = R.wider(angle[:, None, None] * _UP), t.wider(far[:, None] * _UP)
        found = *whole, frames.wider(wider[..., None, None]), places.wider(off[..., None])
        if plan.moves is None:
            return found
        own = np.stack([angles[k] for k in plan.moves.steps], 1) * _UP
        return *found, after[0].wider(own[..., None, None])

    def _pushed(self, plan: _Plan, q: Balls) -> Any:
        """How far parameters move the place after every step at most over boxes, (m, N); zeros without parameters."""
        if plan.moves is None:
            return np.zeros(len(plan.sign))
        far = np.zeros((len(plan.sign), len(q.mid)))
        size = np.sqrt((plan.moves.vectors.size**2).sum(-1)) * _UP
        for k, column, length in zip(plan.moves.steps, plan.moves.columns, size):
            far[k] += q.rad[:, column] * length * _UP
        return far

    def values(self, loops: list[Loop]) -> Any:
        """Left sides of all equations, (N, equations)."""
        values = [loop.values for loop in loops]
        return _joined([values[k][..., row] for k, row in self.rows])

    def jacobian(self, loops: list[Loop]) -> Any:
        """Return the derivatives, (N, equations, width)."""
        parts = [loop.rates for loop in loops]

        def spread(read: Any) -> Array:
            table = np.zeros(
                (loops[0].t[..., 0].mid.size if self.exact else len(loops[0].t), len(self.rows), self.model.width)
            )
            for place, (k, row) in enumerate(self.rows):
                table[:, place, loops[k].columns] = read(parts[k])[:, row]
            return table

        if self.exact:
            return Balls(spread(lambda part: part.mid), spread(lambda part: part.rad))
        return spread(lambda part: part)

    def hessian(self, loops: list[Loop], by: Any) -> Any:
        """Second derivative of the equations weighed by multipliers (N, equations), shape (N, width, width).

        Several rows of multipliers for each point, (N, M, equations), give (N, M, width, width).
        """
        n = self.model.width
        total: Any = 0.0
        for k, loop in enumerate(loops):
            if (by.mid if isinstance(by, Balls) else by).ndim == 3:
                loop = loop.repeated()
            chosen = {row: place for place, (at, row) in enumerate(self.rows) if at == k}
            none = 0.0 * by[..., 0]
            part = loop.bend(_joined([by[..., chosen[row]] if row in chosen else none for row in range(6)]))

            def spread(values: Array, columns: Ints = loop.columns) -> Array:
                table = np.zeros((*values.shape[:-2], n, n))
                table[..., columns[:, None], columns[None, :]] = values
                return table

            total = total + _each(part, spread) if k else _each(part, spread)
        return total


def _along(parts: list[Any]) -> Any:
    """Join along the second axis."""
    if isinstance(parts[0], Balls):
        return Balls(np.concatenate([p.mid for p in parts], 1), np.concatenate([p.rad for p in parts], 1))
    return np.concatenate(parts, 1)


def _across(parts: list[Any]) -> Any:
    """Stack along the second axis."""
    if isinstance(parts[0], Balls):
        return Balls(np.stack([p.mid for p in parts], 1), np.stack([p.rad for p in parts], 1))
    return np.stack(parts, 1)


@lru_cache(maxsize=8)
def closures(model: SpaceModel) -> tuple[Closure, Closure]:
    """Closure of a model in floats and in balls."""
    return Closure(model, False), Closure(model, True)
