"""Links as bodies that turn by themselves: equations and limits that hold wherever a mechanism closes in space.

The rotation of a link is ``T(x) Rz(spin)`` from a reference, so every joint sees its own two links only: round a loop
the places add up and no rotations are multiplied.  Links behind a joint that cannot tilt share its axis and turn about
it.  All conditions are necessary ones, which is what a proof of binding needs:

* round every loop ``sum R_i d_i + sum e R_i s = 0`` with shifts, slides and parameters e along directions s of link i,
* of a joint with a limit t the axes, ``cos t - axis_a . axis_b <= 0``,
* of a driven joint that tilts, no turn but the given one.

See theory/closure-in-space 5.
"""

from __future__ import annotations

import math
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from graphsynth.intervals.balls import Balls, exact, unit
from graphsynth.jamming.joints.limits import bounds
from graphsynth.jamming.space.closure import ball, cross, joined_rows, swapped, tilt_rates, times
from graphsynth.jamming.space.model import SHIFT_X, SLIDE, TILT_X, TILT_Y, TURN, SpaceModel

Array = NDArray[np.float64]
Ints = NDArray[np.intp]
_AXES = np.eye(3)
_X, _Y, _Z = _AXES


class TurningBody(NamedTuple):
    """A rotation: that of the parent, a constant one, ``T(x) Rz(sign spin)`` or ``Rz(sign spin)``, another constant.

    ``columns``: numbers of x (two) and of the spin among the coordinates, -1 where there is none.
    """

    parent: int
    columns: tuple[int, int, int]
    sign: float
    before: Balls
    after: Balls


class Term(NamedTuple):
    """A part of a vector equation: the vector (3,) of a body, times a coordinate if ``column`` is not -1."""

    equation: int
    body: int
    vector: Balls
    column: int


class Pair(NamedTuple):
    """Product of a vector of one body with one of another; ``row`` numbers the equation or limit that it is part of."""

    row: int
    a: int
    u: Balls
    b: int
    v: Balls


class Turned(NamedTuple):
    """A body at N points: ``T(x)`` of its chart with derivatives, if it has one, times an inner rotation by turns.

    ``chart`` (6, N, 3, 3): T, derivatives by x and y, second ones xx, xy, yy.  ``inner`` (N, 3, 3); ``omega``
    (N, k, 3): angular velocities of the turns; for k before l second derivatives are products of both.
    ``columns``: coordinates x and y, then turns.
    """

    chart: list[Balls]
    inner: Balls
    omega: Balls
    columns: Ints


class Moved(NamedTuple):
    """A vector of a body at N points: value (N, 3), derivatives (N, k, 3) and (N, k, k, 3), their coordinates (k,)."""

    value: Balls
    first: Balls
    second: Balls
    columns: Ints


class Bodies:
    """The bodies of a model near a reference.

    Parameters
    ----------
    model : SpaceModel
        Without guides; their joints turn.
    q : ndarray, shape (width,)
        Reference: unknowns and given coordinates of the model.

    Attributes
    ----------
    width, size : int
        Number of coordinates, and of those that are not given; given ones are last.
    slides : dict
        Column of the model to column here, for shifts and slides.
    closing : list of int
        Joints that cannot tilt and close a loop of such.
    """

    def __init__(self, model: SpaceModel, q: Array) -> None:
        self.model, self.reference = model, q
        self.seats = [[(ball(R), ball(p)) for R, p in both] for both in model.seats]
        self.slides: dict[int, int] = {}
        self.bodies: list[TurningBody] = []
        self.of_link = np.full(model.links, -1)
        self.charts: list[int] = []
        self.turns: dict[int, int] = {}
        self.size = 0
        self.closing: list[int] = []
        self._walked = walked(model, q, level=True)
        self._given = {column: n for n, column in enumerate(range(model.size, model.width))}
        self._grow()
        for k in range(len(model.joints)):
            for own in model.column[k, SHIFT_X : SLIDE + 1]:
                if own >= 0:
                    self.slides[int(own)] = self._new()
        self.width = self.size + len(self._given)
        self.bodies = [self._numbered(body) for body in self.bodies]
        self.conditions = self._conditions()

    def _new(self) -> int:
        self.size += 1
        return self.size - 1

    def _numbered(self, body: TurningBody) -> TurningBody:
        """Put the given coordinates, counted from -2 downwards, behind the unknowns."""
        columns = [self.size - 2 - c if c < -1 else c for c in body.columns]
        return body._replace(columns=(columns[0], columns[1], columns[2]))

    def _grow(self) -> None:
        """Make the bodies: the frame and what hangs stiffly on it, then a chart for a link that is left, and so on."""
        eye = exact(_AXES)
        order = [self.model.frame, *(k for k in range(self.model.links) if k != self.model.frame)]
        used: set[int] = set()
        for root in order:
            if self.of_link[root] >= 0:
                continue
            columns = (-1, -1, -1) if root == self.model.frame else (self._new(), self._new(), self._new())
            after = eye if root == self.model.frame else _nearest_rotation(self._walked[root])
            self.of_link[root] = len(self.bodies)
            if root != self.model.frame:
                self.charts.append(root)
            self.bodies.append(TurningBody(-1, columns, 1.0, eye, after))
            self._hang(root, used)

    def _hang(self, root: int, used: set[int]) -> None:
        queue = [root]
        for link in queue:
            for k, joint in enumerate(self.model.joints):
                if k in used or not self._stiff(k) or link not in (joint.a, joint.b):
                    continue
                used.add(k)
                other, forward = (joint.b, True) if link == joint.a else (joint.a, False)
                if self.of_link[other] >= 0:
                    self.closing.append(k)
                    continue
                (A, _), (B, _) = self.seats[k]
                before, after = (A, swapped(B)) if forward else (B, swapped(A))
                self.of_link[other] = len(self.bodies)
                self.bodies.append(
                    TurningBody(
                        int(self.of_link[link]), (-1, -1, self._turn(k)), 1.0 if forward else -1.0, before, after
                    )
                )
                queue.append(other)

    def _stiff(self, k: int) -> bool:
        limits = self.model.joints[k].limits
        return all(bounds(limits, name)[1] == 0.0 for name in limits.tilts)

    def _turn(self, k: int) -> int:
        """Column of the turn of a joint; given ones are counted from -2 downwards."""
        own = int(self.model.column[k, TURN])
        if own in self._given:
            return -2 - self._given[own]
        self.turns[own] = self._new()
        return self.turns[own]

    def away(self, u: Array) -> float:
        """Largest spin, turn or travel of some coordinates from the reference."""
        spins = [abs(float(u[self.bodies[self.of_link[k]].columns[2]])) for k in self.charts]
        turns = [abs(float(u[own] - self.reference[column])) for column, own in self.turns.items()]
        return max([*spins, *turns], default=0.0)

    def _conditions(self) -> tuple[list[Term], list[Pair], list[Pair], int]:
        """Parts of the vector equations, of the scalar equations and of the limits of tilts; vector equations."""
        terms: list[Term] = []
        equations: list[Pair] = []
        count = 0
        for path in self.model.paths:
            terms += self._round(count, path)
            count += 1
        for k in self.closing:
            terms += self._same(count, k, _Z)
            count += 1
            if self.model.joints[k].driven:
                terms += self._same(count, k, _X)
                count += 1
        for k, joint in enumerate(self.model.joints):
            if joint.driven and not self._stiff(k):
                (a, A), (b, B) = self._sides(k)
                back = self._back(k)
                row = len(equations) // 2
                equations += [Pair(row, a, A[:, 1], back, B[:, 0]), Pair(row, a, -A[:, 0], back, B[:, 1])]
        limits = []
        for row, bound in enumerate(self.model.bounds):
            if bound.angular:
                (a, A), (b, B) = self._sides(bound.joint)
                limits.append(Pair(row, a, -A[:, 2], b, B[:, 2]))
        return terms, equations, limits, count

    @cached_property
    def close(self) -> list[tuple[Any, Any, float]]:
        """Axes of joints with a limit, and the largest distance between them.

        An axis is the columns x and y of its chart, or x and y of a fixed one as balls; others are left out.
        """
        found = []
        here = self.turned(exact(np.zeros((1, self.width))))
        for bound, high in zip(self.model.bounds, self.model.limit_bounds[1]):
            if not bound.angular:
                continue
            axes: list[Any] = []
            for own, A in self._sides(bound.joint):
                axis = moved(here[own], A[:, 2])
                # a turn by any angle moves the axis by at most twice its velocity
                off = 2.0 * float(np.sqrt((axis.first.size**2).sum(-1)).sum(-1).max(initial=0.0))
                if not here[own].chart and off < 1e-12:
                    axes.append(Balls(axis.value.mid[:, :2], axis.value.rad[:, :2] + off * (1.0 + 1e-12)))
                elif here[own].chart and not axis.first.size[:, 2:].max(initial=0.0) > 1e-290:
                    axes.append((int(axis.columns[0]), int(axis.columns[1])))
            if len(axes) == 2:
                found.append((axes[0], axes[1], float(high) * (1.0 + 1e-12) + 1e-15))
        return found

    def _sides(self, k: int) -> tuple[tuple[int, Balls], tuple[int, Balls]]:
        """Bodies of a joint with the axes of its seats in them (3, 3)."""
        joint = self.model.joints[k]
        (A, _), (B, _) = self.seats[k]
        return (int(self.of_link[joint.a]), A), (int(self.of_link[joint.b]), B)

    def _back(self, k: int) -> int:
        """Add the body of link b, turned back by the given turn of a joint: ``R_b B Rz(-turn) B'``."""
        _, B = self._sides(k)[1]
        own = self._given[int(self.model.column[k, TURN])]
        self.bodies.append(
            TurningBody(int(self.of_link[self.model.joints[k].b]), (-1, -1, self.size + own), -1.0, B, swapped(B))
        )
        return len(self.bodies) - 1

    def _same(self, equation: int, k: int, axis: Array) -> list[Term]:
        """Axes of both seats of a stiff joint are one."""
        (a, A), (b, B) = self._sides(k)
        if axis is _X:
            b = self._back(k)
        place = int(axis.argmax())
        return [Term(equation, a, -A[:, place], -1), Term(equation, b, B[:, place], -1)]

    def _round(self, equation: int, path: list[tuple[int, bool]]) -> list[Term]:
        """Places once round a loop."""
        terms = []
        for (k, forward), (after, onward) in zip(path, path[1:] + path[:1]):
            joint = self.model.joints[k]
            link = joint.b if forward else joint.a
            p, q = self.model.seats[k][1 if forward else 0][1], self.model.seats[after][0 if onward else 1][1]
            own = int(self.of_link[link])
            terms.append(Term(equation, own, ball(q - p), -1))
            for number, moved_by in self.model.moves((k, forward), (after, onward)):
                terms.append(Term(equation, own, ball(moved_by), self.width - self.model.parameters + number))
            a, A = self._sides(k)[0]
            for axis, own in enumerate(self.model.column[k, SHIFT_X : SLIDE + 1]):
                if own >= 0:
                    vector = A[:, axis] if forward else -A[:, axis]
                    terms.append(Term(equation, a, vector, self.slides[int(own)]))
        return terms

    def turned(self, u: Balls) -> list[Turned]:
        """All bodies at coordinates u (N, width)."""
        found: list[Turned] = []
        for body in self.bodies:
            found.append(self._one(body, found, u))
        return found

    def _one(self, body: TurningBody, found: list[Turned], u: Balls) -> Turned:
        count = len(u.mid)
        if body.parent >= 0:
            chart, inner, omega, columns = found[body.parent]
        else:
            chart, inner = [], exact(np.broadcast_to(_AXES, (count, 3, 3)))
            omega, columns = exact(np.zeros((count, 0, 3))), np.zeros(0, dtype=np.intp)
        inner = times(inner, body.before)
        x, y, spin = body.columns
        if x >= 0:
            chart, columns = chart_of(u[:, x], u[:, y]), np.array([x, y])
        if spin >= 0:
            own = inner[..., 2] * body.sign
            omega = Balls(*(np.concatenate([a, b[:, None]], 1) for a, b in zip(_both(omega), _both(own))))
            turn = unit(u[:, spin])
            C, S, zero = turn.real, body.sign * turn.imag, exact(np.zeros(count))
            inner = times(inner, joined_rows([[C, -S, zero], [S, C, zero], [zero, zero, zero + 1.0]]))
            columns = np.append(columns, spin)
        return Turned(chart, times(inner, body.after), omega, columns)


def _both(a: Balls) -> tuple[Array, Array]:
    return a.mid, a.rad


def moved(body: Turned, vector: Balls) -> Moved:
    """Move a vector (3,) with a body."""
    w = times(body.inner, vector[None, :, None])[..., 0]
    first = cross(body.omega, w[:, None])
    second = cross(body.omega[:, :, None], first[:, None])
    k = first.mid.shape[1]
    before = np.tri(k, dtype=bool).T[..., None]
    second = Balls(*(np.where(before, part, np.swapaxes(part, 1, 2)) for part in _both(second)))
    if not body.chart:
        return Moved(w, first, second, body.columns)
    T, *rates = body.chart
    by_tilt = [_applied(rate, w) for rate in rates]
    mixed = [times(first, swapped(rate)) for rate in rates[:2]]
    N = len(w.mid)
    total, more = np.zeros((2, N, k + 2, 3)), np.zeros((2, N, k + 2, k + 2, 3))
    for part, inner in zip(range(2), zip(_both(times(first, swapped(T))), _both(_each_applied(T, second)))):
        total[part, :, 0], total[part, :, 1] = (_both(by_tilt[j])[part] for j in range(2))
        total[part, :, 2:], more[part, :, 2:, 2:] = inner
        for place, (i, j) in zip((2, 3, 4), ((0, 0), (0, 1), (1, 1))):
            more[part, :, i, j] = more[part, :, j, i] = _both(by_tilt[place])[part]
        for j in range(2):
            more[part, :, j, 2:] = more[part, :, 2:, j] = _both(mixed[j])[part]
    return Moved(_applied(T, w), Balls(total[0], total[1]), Balls(more[0], more[1]), body.columns)


def _applied(R: Balls, vector: Balls) -> Balls:
    """Matrices (N, 3, 3) times vectors (N, 3)."""
    found: Balls = times(R, vector[..., None])[..., 0]
    return found


def _each_applied(R: Balls, vectors: Balls) -> Balls:
    """Matrices (N, 3, 3) times vectors (N, k, k, 3)."""
    k = vectors.mid.shape[1]
    flat = Balls(*(part.reshape(-1, k * k, 3) for part in _both(vectors)))
    return Balls(*(part.reshape(-1, k, k, 3) for part in _both(times(flat, swapped(R)))))


def chart_of(x: Balls, y: Balls) -> list[Balls]:
    """T of the chart, its derivatives by x and y, and the second ones xx, xy, yy, each (N, 3, 3)."""
    xx, yy, xy = square(x), square(y), x * y
    k = 1.0 / (1.0 + 0.25 * (xx + yy))
    k2 = square(k)
    k3 = k2 * k
    kx, ky, kxy = -0.5 * (k2 * x), -0.5 * (k2 * y), 0.5 * (k3 * xy)
    kxx, kyy = 0.5 * (k3 * xx - k2), 0.5 * (k3 * yy - k2)
    one, two = 0.0 * k + 1.0, -0.5 * k2  # kx y, kx x, ky y are two times xy, xx, yy
    entries = [
        (one - 0.5 * (k * yy), one - 0.5 * (k * xx), 0.5 * (k * xy), k * y, -(k * x), 2.0 * k - 1.0),
        (
            -0.5 * (kx * yy),
            -0.5 * (two * (x * xx)) - k * x,
            0.5 * (two * (xx * y) + k * y),
            two * xy,
            -(two * xx + k),
            2.0 * kx,
        ),
        (
            -0.5 * (two * (y * yy)) - k * y,
            -0.5 * (ky * xx),
            0.5 * (two * (yy * x) + k * x),
            two * yy + k,
            -(two * xy),
            2.0 * ky,
        ),
        (
            -0.5 * (kxx * yy),
            -0.5 * (kxx * xx) - 2.0 * (two * xx) - k,
            0.5 * (kxx * xy) + two * xy,
            kxx * y,
            -(kxx * x + 2.0 * kx),
            2.0 * kxx,
        ),
        (
            -0.5 * (kxy * yy) - two * xy,
            -0.5 * (kxy * xx) - two * xy,
            0.5 * (kxy * xy + two * (xx + yy) + k),
            kxy * y + kx,
            -(kxy * x + ky),
            2.0 * kxy,
        ),
        (
            -0.5 * (kyy * yy) - 2.0 * (two * yy) - k,
            -0.5 * (kyy * xx),
            0.5 * (kyy * xy) + two * xy,
            kyy * y + 2.0 * ky,
            -(kyy * x),
            2.0 * kyy,
        ),
    ]
    return [joined_rows([[a, c, v], [c, b, w], [-v, -w, z]]) for a, b, c, v, w, z in entries]


def stands_apart(model: SpaceModel) -> bool:
    """Whether `Bodies` describes a model: no guides, all axes along z but for misalignments below 1.5 rad."""
    own = [joint for joint in model.joints if joint.parameter < 0]
    turns = [seat.turn for joint in own for seat in (joint.seat_a, joint.seat_b)]
    level = all(turn[0] == turn[1] == 0.0 or (turn[2] == 0.0 and math.hypot(*turn) < 1.5) for turn in turns)
    return level and not any(joint.guide for joint in model.joints)


def square(x: Balls) -> Balls:
    """Squares: of a ball across zero only half as wide as the product."""
    size = np.abs(x.mid)
    low, high = np.maximum(size - x.rad, 0.0) ** 2, (size + x.rad) ** 2
    return Balls(0.5 * (low + high), 0.5 * (high - low) + 2e-15 * high + 1e-300)


def _nearest_rotation(R: Array) -> Balls:
    """Enclose the rotation of the quaternion, in floats, that is nearest to a rotation known to rounding, (3, 3)."""
    from scipy.spatial.transform import Rotation

    q = exact(Rotation.from_matrix(R).as_quat())
    x, y, z, w = (q[k] for k in range(4))
    size = x * x + y * y + z * z + w * w
    rows = [
        [w * w + x * x - y * y - z * z, 2.0 * (x * y - w * z), 2.0 * (x * z + w * y)],
        [2.0 * (x * y + w * z), w * w - x * x + y * y - z * z, 2.0 * (y * z - w * x)],
        [2.0 * (x * z - w * y), 2.0 * (y * z + w * x), w * w - x * x - y * y + z * z],
    ]
    found: Balls = joined_rows([[entry / size for entry in row] for row in rows])
    return found


def walked(model: SpaceModel, q: Array, *, level: bool = False) -> Array:
    """Rotations of all links (links, 3, 3) from the coordinates of joints along a tree; floats.

    With ``level`` misalignments and tilts are left out.
    """
    found = {model.frame: _AXES}
    queue = [model.frame]
    for link in queue:
        for k, joint in enumerate(model.joints):
            if link not in (joint.a, joint.b) or (joint.a in found and joint.b in found):
                continue
            own = [q[c] if c >= 0 else 0.0 for c in model.column[k]]
            turn = 0.0 if level and joint.parameter >= 0 else own[TURN]
            c, s = math.cos(turn), math.sin(turn)
            x, y = (0.0, 0.0) if level else (own[TILT_X], own[TILT_Y])
            T = np.array(tilt_rates(x, y, x * x, y * y)[0]).reshape(3, 3)
            inner = T @ np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
            seats = [R.mid for R, _ in model.seats[k]]
            if level:
                turns = (joint.seat_a.turn, joint.seat_b.turn)
                seats = [_AXES if any(turn[:2]) else R for R, turn in zip(seats, turns)]
            forward = seats[0] @ inner @ seats[1].T
            other = joint.b if link == joint.a else joint.a
            found[other] = found[link] @ (forward if link == joint.a else forward.T)
            queue.append(other)
    return np.array([found[k] for k in range(model.links)])
