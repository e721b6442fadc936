"""Singular poses: classified at a start, with the branches that meet; crossed by a collocation step; or not passed.

The motion is smooth along its branch although the equations lose their digits there.  Off the constraints the
accelerations are singular at a change point, so an explicit step cannot come near.  One step of Gauss' collocation
method leads across the pose, which lies between its stages: every stage is a state on the constraints at a regular
pose, and the pose itself, where the accelerations are not determined, is never asked.  A polynomial through past
states (Hermite) gives the first guess, which also chooses the branch.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from typing import Any, Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from graphsynth.dynamics.tables import Compiled
from graphsynth.dynamics.values import Values, initial_slots
from graphsynth.kinematics.engine import codes

Array = NDArray[np.float64]
PoseClass = Literal["regular", "redundant", "singular", "not tested"]

#: Length of the steps to nearby poses, in characteristic lengths and radians.
_NEARBY = 1e-3


class BranchTangents(NamedTuple):
    """Motions possible at a singular pose with one lost rank and two instantaneous freedoms.

    ``kind`` is "change point" (two branches cross: ``motions`` (2, links, 3) are their velocities, largest entry 1),
    "isolated" (the second-order equation has no real solution) or "higher order" (it does not decide).
    """

    kind: str
    motions: Array
    discriminant: float


def classify_pose(
    values: Values, q: Array, rank: int, left: Array, null: Array, tolerance: float
) -> tuple[PoseClass, int, BranchTangents | None]:
    """Compare the rank at ``q`` with that at nearby poses on the constraints (theory/planar-dynamics 6, step 3).

    ``left`` and ``null`` are the left and right null vectors of the scaled Jacobian, in columns.
    """
    directions = [*null.T, *(null @ np.array([np.cos(t), np.sin(t)]) for t in (0.7, 2.1) if null.shape[1] == 2)]
    nearby = rank
    for direction in directions:
        for sense in (1.0, -1.0):
            found = _returned(values, q + sense * _NEARBY * values.compiled.unit * direction)
            if found is not None:
                S = np.linalg.svd(values.scaled_jacobian(found), compute_uv=False)
                nearby = max(nearby, int(np.sum(tolerance * S[0] < S)))
    if nearby == rank:
        return "redundant", nearby, None
    return "singular", nearby, branch_tangents(values, q, left, null) if nearby == rank + 1 else None


def _returned(values: Values, q: Array) -> Array | None:
    """Return to the constraints from a point close to them; None if that does not converge."""
    for _ in range(30):
        C = values.system(q, np.zeros_like(q))[0] / values.compiled.row_unit
        if np.abs(C).max() < 1e-14:
            return q
        step = np.linalg.lstsq(values.scaled_jacobian(q), -C, rcond=1e-13)[0]
        size = float(np.abs(step).max())
        q = q + values.compiled.unit * step * min(1.0, 0.1 / max(size, 1e-300))
    return q if np.abs(C).max() < 1e-12 else None


def branch_tangents(values: Values, q: Array, left: Array, null: Array) -> BranchTangents | None:
    """Solve the second-order equation ``l . C_qq(n, n) = 0`` for the directions of the branches."""
    if null.shape[1] != 2 or left.shape[1] != 1:
        return None
    compiled, scale = values.compiled, values.compiled.unit
    # the drivers' own accelerations do not count
    still, kinds = values.system(np.zeros(compiled.n), np.zeros(compiled.n))[2], compiled.tables.rows[:, 0]
    own = np.where((kinds == codes.DRIVE_ANGLE) | (kinds == codes.DRIVE_SLIDE), still, 0.0)

    def form(direction: Array) -> float:
        gam = values.system(q, scale * direction)[2] - own
        return float(left[:, 0] @ (-gam / compiled.row_unit))

    n1, n2 = null[:, 0], null[:, 1]
    a, c = form(n1), form(n2)
    b = 0.5 * (form(n1 + n2) - a - c)
    discriminant = b * b - a * c
    size = max(abs(a), abs(b), abs(c))
    none = np.empty((0, compiled.links, 3))
    if not size > 1e-9 or abs(discriminant) <= 1e-9 * size**2:
        return BranchTangents("higher order", none, discriminant)
    if discriminant < 0.0:
        return BranchTangents("isolated", none, discriminant)
    # a s^2 + 2 b s t + c t^2 = 0 with (s, t) homogeneous, without cancellation
    w = -(b + np.copysign(np.sqrt(discriminant), b))
    motions = []
    for s, t in ((w, a), (c, w)):
        v = scale * (s * n1 + t * n2)
        rate = compiled.to_links(q, v, np.zeros_like(v))[1]
        motions.append(rate / rate.flat[int(np.argmax(np.abs(rate)))])
    return BranchTangents("change point", np.array(motions), discriminant)


#: Masses farther apart than this (see `Compiled.spread`) may defeat double precision.
_SPREAD = 1e16
#: Smallest singular value of the constraints over the largest, above which a pose counts as regular.
_REGULAR = 1e-2


def stalled(form: Any, t: float, y: Array) -> str:
    """Say why steps become ever shorter at a state of a formulation."""
    compiled: Compiled = form.compiled
    found = lock(form, t, y)
    if found:
        return found
    values, q = _values(form, t, y)
    if _SPREAD < compiled.spread < np.inf and _least(values.scaled_jacobian(q)) > _REGULAR:
        return compiled.spread_words
    return str(form.stall)


def lock(form: Any, t: float, y: Array) -> str:
    """Say which prescribed motion locks the mechanism next to a state; nothing if none does.

    There the joints alone are regular, and with the prescribed coordinate they are not: it is at its extreme.
    """
    compiled: Compiled = form.compiled
    drivers = compiled.model.prescribed
    if not drivers or not np.isfinite(y).all():
        return ""
    values, q = _values(form, t, y)
    J = values.scaled_jacobian(q)
    of = np.array([info.joint for info in compiled.info])
    whole = _least(J)
    for number, driver in enumerate(drivers, len(compiled.joints) - len(drivers)):
        if whole < 0.1 and _least(J[of != number]) > 3.0 * whole:
            value, speed = values.driven[number - len(compiled.joints) + len(drivers), :2]
            unit = "m" if compiled.model.mechanism.joint(*driver.pair).kind == "P" else "rad"
            return (
                f"the prescribed motion of joint {driver.base}-{driver.link} locks the mechanism: near {value:.6g} "
                f"{unit}, at {speed:.3g} {unit}/s, its coordinate is at an extreme of what the joints allow; prescribe "
                "less, or another joint"
            )
    return ""


def _values(form: Any, t: float, y: Array) -> tuple[Values, Array]:
    q = np.ascontiguousarray(form.state(t, y)[0])
    return Values(form.compiled, t, initial_slots(form.compiled, q, form.slots)), q


def _least(J: Array) -> float:
    """Smallest singular value over the largest; 1 without rows."""
    S = np.linalg.svd(J, compute_uv=False) if J.size else np.ones(1)
    return float(S[min(J.shape) - 1] / S[0]) if J.size and S[0] > 0.0 else 1.0


#: Stages of the step over a pose: an even number keeps the middle free.  The order is twice as high.
STAGES = 8
_ROUNDS = 40


@cache
def _tables() -> tuple[Array, Array, Array]:
    """Nodes in (0, 1), Lagrange polynomials of the nodes (coefficients, ascending), integrals to every node."""
    nodes = np.asarray(0.5 * (np.polynomial.legendre.leggauss(STAGES)[0] + 1.0), dtype=np.float64)
    basis = np.linalg.inv(np.vander(nodes, increasing=True)).T
    powers = nodes[:, None] ** np.arange(1, STAGES + 1) / np.arange(1, STAGES + 1)
    return nodes, np.asarray(basis), np.asarray(powers @ basis.T)


class GaussStep:
    """The collocation polynomial: accelerations (stages, n) and rates of the tail over ``[t, t + h]`` from ``y``."""

    def __init__(self, t: float, h: float, y: Array, a: Array, tail: Array) -> None:
        self._t, self._h, self._y = t, h, y
        _, basis, _ = _tables()
        self._a, self._tail = basis.T @ a, basis.T @ tail

    def __call__(self, t: float) -> Array:
        """State (q, v, work) at time t."""
        n, x, h = self._a.shape[1], (t - self._t) / self._h, self._h
        k = np.arange(1, STAGES + 1)
        once, twice = x**k / k, x ** (k + 1) / (k * (k + 1))
        q, v = self._y[:n], self._y[n : 2 * n]
        return np.concatenate(
            [
                q + x * h * v + h * h * (twice @ self._a),
                v + h * (once @ self._a),
                self._y[2 * n :] + h * (once @ self._tail),
            ]
        )


def gauss_step(
    evaluate: Callable[[float, Array, Array, Array], tuple[Array, Array]],
    t: float,
    y: Array,
    h: float,
    guess: Callable[[float], Array],
    unit: Array,
) -> GaussStep | None:
    """Solve the collocation equations by fixed-point iteration; None if it does not settle.

    ``evaluate`` leads from ``(t, q, v, tail)`` near the constraints to accelerations and rates of the tail at the
    nearest state on them; ``guess`` gives the state at a time, on the branch wanted; ``unit`` are the units of the
    coordinates.
    """
    nodes, _, A = _tables()
    n = len(unit)
    q0, v0 = y[:n], y[n : 2 * n]
    first = [guess(t + h * c) for c in nodes]
    Q, V, tails = (np.array([s[part] for s in first]) for part in (slice(n), slice(n, 2 * n), slice(2 * n, None)))
    last = np.inf
    for _ in range(_ROUNDS):
        found = [evaluate(t + h * c, *state) for c, *state in zip(nodes, Q, V, tails)]
        a, rates = np.array([part[0] for part in found]), np.array([part[1] for part in found])
        if not np.isfinite(a).all():
            return None
        fresh = q0 + h * nodes[:, None] * v0 + h * h * (A @ (A @ a))
        V, moved = v0 + h * (A @ a), y[2 * n :] + h * (A @ rates)
        change = float(np.abs((fresh - Q) / unit).max())
        if tails.shape[1] > 1:  # currents act back on the motion
            change = max(change, float(np.abs((moved - tails) / (np.abs(moved).max(axis=0) + 1e-300)).max()))
        Q, tails = fresh, moved
        if change < 1e-14 or (change < 1e-10 and change > 0.5 * last):
            return GaussStep(t, h, y, a, rates)
        last = change
    return None


class HermiteGuess:
    """Polynomials through states ``(q, v, work)`` and their rates at several times."""

    def __init__(self, n: int, times: list[float], states: list[Array], rates: list[Array]) -> None:
        self._n = n
        self._centre, self._unit = times[-1], times[-1] - times[0]
        nodes = (np.array(times) - self._centre) / self._unit
        u = self._unit
        places = [[y[:n], u * y[n : 2 * n], 0.5 * u * u * f[n : 2 * n]] for y, f in zip(states, rates)]
        works = [[y[2 * n :], u * f[2 * n :]] for y, f in zip(states, rates)]
        self._place, self._place_nodes = _divided(nodes, places)
        self._work, self._work_nodes = _divided(nodes, works)

    def __call__(self, t: float) -> Array:
        """State at time t."""
        x = (t - self._centre) / self._unit
        place, slope = _value(self._place, self._place_nodes, x)
        work, _ = _value(self._work, self._work_nodes, x)
        return np.concatenate([place, slope / self._unit, work])


def _divided(nodes: Array, data: list[list[Array]]) -> tuple[Array, Array]:
    """Newton's divided differences with repeated nodes; ``data`` holds Taylor coefficients at every node."""
    order = len(data[0])
    x = np.repeat(nodes, order)
    table = np.array([data[k // order][0] for k in range(len(x))])
    found = [table[0]]
    for column in range(1, len(x)):
        fresh = []
        for k in range(len(x) - column):
            gap = x[k + column] - x[k]
            fresh.append(data[k // order][column] if gap == 0.0 else (table[k + 1] - table[k]) / gap)
        table = np.array(fresh)
        found.append(table[0])
    return np.array(found), x


def _value(coefficients: Array, nodes: Array, x: float) -> tuple[Array, Array]:
    """Newton's form and its derivative by Horner's rule."""
    value, slope = coefficients[-1].copy(), np.zeros_like(coefficients[-1])
    for k in range(len(coefficients) - 2, -1, -1):
        slope = value + (x - nodes[k]) * slope
        value = coefficients[k] + (x - nodes[k]) * value
    return value, slope


#: Smallest pivot over the largest seen: below the first a pose counts as singular, below the second as nearly so.
_SINGULAR, _NEARLY = 1e-5, 1e-2
#: Rounds of sampling; each is ten times finer.
_ZOOMS = 7


def passed_singular_pose(
    form: Any, start: float, middle: float, end: float, first: Any, second: Any, largest: float
) -> list[tuple[str, float, float, str]]:
    """Locate the minimum of the smallest pivot over two steps with interpolants ``first`` and ``second``.

    Kind, time, its uncertainty and a statement of the pose passed, if there is one.
    """

    def pivot(t: float) -> tuple[float, Array, Array]:
        y = np.asarray((first if t <= middle else second)(t))
        return *form.pivot_at(t, y), y

    # a sharp bend there, kinks elsewhere: ever finer samples
    width, t, least = end - start, start, np.inf
    low, high, step = start, end, width / 40.0
    for _ in range(_ZOOMS):
        for at in np.arange(low, high + 0.5 * step, step):
            value = pivot(float(at))[0]
            if value < least:
                t, least = float(at), value
        low, high, step = max(t - step, low), min(t + step, high), 0.1 * step
    least /= largest
    if least > _NEARLY:
        return []
    _, q, y = pivot(t)
    n = form.compiled.n
    if least > _SINGULAR:
        text = f"nearly singular pose at t = {t:.9g} s: smallest pivot {least:.2g} of the largest; large reactions"
        return [("nearly singular pose", t, 1e-9 * width, text)]
    text = f"singular pose passed at t = {t:.9g} s"
    return [("singular pose", t, 1e-7 * width, text + _branches(form, t, q, y[n : 2 * n]))]


def _branches(form: Any, t: float, q: Array, v: Array) -> str:
    """Say which branches meet, and which one the motion follows."""
    values = Values(form.compiled, t, form.slots)
    U, S, Vt = np.linalg.svd(values.scaled_jacobian(q))
    count = int(np.sum(1e-4 * S[0] > S)) + max(0, U.shape[0] - len(S))
    kept = U.shape[0] - count
    tangents = branch_tangents(values, q, U[:, kept:], Vt[kept:].T)
    if tangents is None or tangents.kind != "change point":
        return "; what meets there is not resolved"
    rate = form.compiled.to_links(q, v, np.zeros_like(v))[1]
    unit = np.array([form.compiled.tables.size, form.compiled.tables.size, 1.0])
    along = [
        abs(float(((motion / unit) * (rate / unit)).sum())) / float(np.linalg.norm(motion / unit))
        for motion in tangents.motions
    ]
    size = float(np.linalg.norm(rate / unit)) or 1.0
    own = int(np.argmax(along))
    return (
        f"; two branches meet; the motion goes on along its own velocity, branch {own} "
        f"(cosines {along[0] / size:.6f}, {along[1] / size:.6f}): the other one would need an impulse; a change of the "
        "start by rounding does not change this choice, but close to rest it may"
    )
