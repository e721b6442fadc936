"""Proofs of binding with links as bodies: a Lagrangian whose every term depends on two links.

``L = (by + K (u - at)) . V + spin . E + sum weight h`` with the vector equations V, the scalar ones E and the limits
``h <= 0`` of `bodies`.  L <= 0 wherever the mechanism closes within its limits, so a box on which L > 0 holds no such
closure.  See theory/closure-in-space 5.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import qr

from graphsynth.intervals.balls import Balls, exact
from graphsynth.jamming.space.bodies import Bodies, Moved, Pair, Turned, chart_of, moved, walked
from graphsynth.jamming.space.closure import swapped, times
from graphsynth.jamming.space.optimum import Optimum
from graphsynth.jamming.space.proof import Box, least, total

Array = NDArray[np.float64]
Ints = NDArray[np.intp]
_UP = 1.0 + 1e-12
#: Parts of the added curvature that are tried.
PARTS = (0.0, 1e-1, 1e-2, 1e-3, 1e-4, 1e-5)


class Sum:
    """Sums of balls into entries of a table, with their rounding."""

    def __init__(self, shape: tuple[int, ...]) -> None:
        self.mid, self.rad = np.zeros(shape), np.zeros(shape)

    def add(self, key: Any, part: Balls) -> None:
        """Add a ball to the entries ``key``, each named once."""
        mid = self.mid[key] + part.mid
        self.mid[key] = mid
        self.rad[key] += part.rad + 2.3e-16 * np.abs(mid)

    @property
    def ball(self) -> Balls:
        """The sum."""
        return Balls(self.mid, self.rad * _UP + 1e-300)


class At(NamedTuple):
    """Equations at N points: the vectors of all terms, V (N, 3 m), its derivatives J (N, 3 m, width)."""

    bodies: Bodies
    turned: list[Turned]
    u: Balls
    vectors: list[Moved]
    V: Balls
    J: Balls


def at(bodies: Bodies, u: Balls) -> At:
    """Evaluate the equations at coordinates u (N, width)."""
    turned = bodies.turned(u)
    terms, _, _, count = bodies.conditions
    N = len(u.mid)
    V, J = Sum((N, 3 * count)), Sum((N, 3 * count, bodies.width))
    vectors = []
    for term in terms:
        vector = moved(turned[term.body], term.vector)
        rows = np.arange(3 * term.equation, 3 * term.equation + 3)
        if term.column >= 0:
            J.add((slice(None), rows, term.column), vector.value)
            vector = _times(vector, u[:, term.column])
        vectors.append(vector)
        V.add((slice(None), rows), vector.value)
        J.add((slice(None), rows[:, None], vector.columns[None, :]), swapped(vector.first))
    return At(bodies, turned, u, vectors, V.ball, J.ball)


def _times(vector: Moved, size: Balls) -> Moved:
    """Scale a vector by a coordinate (N,); derivatives by the others."""
    value, first, second, columns = vector
    return Moved(value * size[:, None], first * size[:, None, None], second * size[:, None, None, None], columns)


def hessian(at: At, by: Balls, pairs: list[tuple[Pair, float]]) -> Balls:
    """Second derivatives of ``by . V + sum weight pair``, (N, [M,] width, width), for by (N, [M,] 3 m)."""
    several = by.mid.ndim == 3
    H = Sum((*by.mid.shape[:-1], at.bodies.width, at.bodies.width))
    for term, vector in zip(at.bodies.conditions[0], at.vectors):
        p = by[..., 3 * term.equation : 3 * term.equation + 3]
        p = p if several else p[:, None]
        k = len(vector.columns)
        if k == 0:
            continue
        second = Balls(vector.second.mid.reshape(-1, k * k, 3), vector.second.rad.reshape(-1, k * k, 3))
        own = _shaped(times(p, swapped(second)), (*by.mid.shape[:-1], k, k))
        H.add((..., vector.columns[:, None], vector.columns[None, :]), own)
        if term.column >= 0:
            first = moved(at.turned[term.body], term.vector).first
            own = _shaped(times(p, swapped(first)), (*by.mid.shape[:-1], k))
            H.add((..., vector.columns, term.column), own)
            H.add((..., term.column, vector.columns), own)
    for pair, weight in pairs:
        a, b = moved(at.turned[pair.a], pair.u), moved(at.turned[pair.b], pair.v)
        for side, other in ((a, b), (b, a)):
            if len(side.columns):
                part = times(side.second, other.value[:, None, :, None])[..., 0] * weight
                H.add((..., side.columns[:, None], side.columns[None, :]), part)
        both = times(a.first, swapped(b.first)) * weight
        if both.mid.size:
            H.add((..., a.columns[:, None], b.columns[None, :]), both)
            H.add((..., b.columns[:, None], a.columns[None, :]), swapped(both))
    return H.ball


def _shaped(a: Balls, shape: tuple[int, ...]) -> Balls:
    return Balls(a.mid.reshape(shape), a.rad.reshape(shape))


def pair_slopes(at: At, pair: Pair) -> tuple[Balls, Balls]:
    """Value (N,) and derivatives (N, width) of a pair."""
    a, b = moved(at.turned[pair.a], pair.u), moved(at.turned[pair.b], pair.v)
    slope = Sum((len(a.value.mid), at.bodies.width))
    for own, other in ((a, b), (b, a)):
        slope.add((slice(None), own.columns), times(own.first, other.value[..., None])[..., 0])
    p = a.value * b.value
    return p[..., 0] + p[..., 1] + p[..., 2], slope.ball


class Multipliers(NamedTuple):
    """Multipliers of L: of V at the coordinates ``at``, their change K, of E (scalar equations), of all limits."""

    at: Array
    by: Array
    K: Array
    spin: Array
    weight: Array


def weighed_pairs(bodies: Bodies, proof: Multipliers) -> list[tuple[Pair, float]]:
    """Pairs of scalar equations and of limits with their multipliers."""
    _, equations, limits, _ = bodies.conditions
    found = [(pair, float(proof.spin[pair.row])) for pair in equations]
    found += [(pair, float(proof.weight[pair.row])) for pair in limits]
    return [(pair, weight) for pair, weight in found if weight != 0.0]


def limits_of(bodies: Bodies, u: Balls, weight: Array) -> tuple[Balls, Balls, Balls]:
    """Parts of L without bodies: of tilts ``weight cos t``, of slides ``weight (e^2 - s^2)``; two derivatives."""
    count, width = u.mid.shape
    value, slope, bend = exact(np.zeros(count)), Sum((count, width)), np.zeros((width, width))
    for bound, mu, limit in zip(bodies.model.bounds, weight, bodies.model.limit_bounds[1]):
        if mu <= 0.0:
            continue
        X = exact(np.asarray(limit))
        if bound.angular:
            quarter = X * X * 0.25
            value = value + (1.0 - quarter) / (1.0 + quarter) * float(mu)
            continue
        for own in bound.columns:
            column = bodies.slides[own]
            e = u[:, column]
            value = value + e * e * float(mu)
            slope.add((slice(None), column), e * (2.0 * float(mu)))
            bend[column, column] = 2.0 * mu
        value = value - X * X * float(mu)
    return value, slope.ball, exact(bend[None])


def coordinates(bodies: Bodies, q: Array) -> Array:
    """Coordinates of the bodies from those of the joints, (width,); floats."""
    model = bodies.model
    u = np.zeros(bodies.width)
    rotations = walked(model, q)
    for link in bodies.charts:
        body = bodies.bodies[bodies.of_link[link]]
        M = rotations[link] @ body.after.mid.T
        k = max(0.5 * (1.0 + M[2, 2]), 1e-9)
        x, y = -M[1, 2] / k, M[0, 2] / k
        Z = chart_of(exact(np.array([x])), exact(np.array([y])))[0].mid[0].T @ M
        u[list(body.columns)] = x, y, math.atan2(Z[1, 0], Z[0, 0])
    for column, own in {**bodies.turns, **bodies.slides}.items():
        u[own] = q[column]
    u[bodies.size :] = q[model.size :]
    return u


def multipliers(bodies: Bodies, found: Optimum) -> Multipliers | None:
    """Multipliers of the bodies from an optimum of the joints; any are valid, these make L stationary (estimated)."""
    model = bodies.model
    if not math.isfinite(found.scale):
        return _apart(bodies, found)
    if not found.weight.max(initial=0.0) > 0.0:
        return None
    u = coordinates(bodies, found.q)
    here = at(bodies, exact(u[None]))
    _, equations, _, count = bodies.conditions
    weight = np.maximum(found.weight, 0.0)
    for k, bound in enumerate(model.bounds):
        if bound.angular:
            weight[k] *= 2.0 * (1.0 + 0.25 * bound.chart(found.scale) ** 2) ** 2
    rows = len({pair.row for pair in equations})
    proof = Multipliers(u, np.zeros(3 * count), np.zeros((3 * count, bodies.width)), np.zeros(rows), weight)
    E = np.zeros((rows, bodies.width))
    for pair in equations:
        E[pair.row] += pair_slopes(here, pair)[1].mid[0]
    slope = limits_of(bodies, here.u, weight)[1].mid[0].copy()
    for pair, mu in weighed_pairs(bodies, proof):
        slope += mu * pair_slopes(here, pair)[1].mid[0]
    A = np.concatenate([here.J.mid[0], E])[:, : bodies.size]
    by = -np.linalg.lstsq(A.T, slope[: bodies.size], rcond=1e-10)[0]
    return proof._replace(by=by[: 3 * count], spin=by[3 * count :])


def _apart(bodies: Bodies, found: Optimum) -> Multipliers | None:
    """Multipliers where no factor is enough: V where it is least, whose derivative vanishes (estimated)."""
    u = coordinates(bodies, found.q)
    for _ in range(20):
        here = at(bodies, exact(u[None]))
        step = np.linalg.lstsq(here.J.mid[0][:, : bodies.size], here.V.mid[0], rcond=1e-6)[0]
        u[: bodies.size] -= step * min(1.0, 0.1 / max(float(np.abs(step).max(initial=0.0)), 1e-300))
    by = at(bodies, exact(u[None])).V.mid[0]
    size = float(np.linalg.norm(by))
    if not size > 0.0:
        return None
    scalars = np.zeros(len(bodies.conditions[1]) // 2)
    return Multipliers(u, by / size, np.zeros((len(by), bodies.width)), scalars, np.zeros(len(bodies.model.bounds)))


def body_box(bodies: Bodies, reach: float, given: Array) -> Box | None:
    """Box of a branch: spins of the links within ``reach``, their leans and the slides within what the limits leave.

    ``None`` where a lean may pass the chart.
    """
    model = bodies.model
    radius = np.full(bodies.width, reach)
    for link in bodies.charts:
        if model.link_leans[link] > 3.0:
            return None
        x, y, _ = bodies.bodies[bodies.of_link[link]].columns
        radius[[x, y]] = 2.0 * math.tan(0.5 * model.link_leans[link]) * _UP
    origin = np.zeros(bodies.width)
    for column, own in bodies.turns.items():
        origin[own] = bodies.reference[column]
    for own in bodies.slides.values():
        radius[own] = 0.5
    for bound, high in zip(model.bounds, model.limit_bounds[1]):
        if not bound.angular:
            radius[[bodies.slides[c] for c in bound.columns]] = high
    radius[bodies.size :] = given
    origin[bodies.size :] = bodies.reference[model.size :]
    return Box(-radius[None], radius[None], origin, _shear(bodies, origin, given))


def _shear(bodies: Bodies, origin: Array, given: Array) -> Array:
    """Spins and free turns that follow the given coordinates."""
    shear = np.eye(bodies.width)
    if given.any():
        J = at(bodies, exact(origin[None])).J.mid[0]
        free = [bodies.bodies[bodies.of_link[k]].columns[2] for k in bodies.charts] + list(bodies.turns.values())
        shear[free, bodies.size :] = -np.linalg.pinv(J[:, free], rcond=1e-9) @ J[:, bodies.size :]
    return shear


def lower_bounds(bodies: Bodies, proof: Multipliers, box: Box, parts: tuple[float, ...]) -> tuple[Array, Array]:
    """Lower bounds of L over boxes (N,), certified, and what every coordinate takes off them (N, width).

    Parts of K are tried one after the other until the bound is above zero.
    """
    ball, shear = box.ball, exact(box.shear)
    start = np.linalg.solve(box.shear, proof.at - box.origin)
    z = np.clip(start, box.low, box.high)
    near, far = at(bodies, box.unknowns(exact(z))), at(bodies, box.unknowns(ball))
    pairs = weighed_pairs(bodies, proof)
    value, slope, bend = limits_of(bodies, near.u, proof.weight)
    for pair, weight in pairs:
        own = pair_slopes(near, pair)
        value, slope = value + own[0] * weight, slope + own[1] * weight
    K, centre = exact(proof.K[None]), exact(proof.at[None])
    by = exact(np.repeat(proof.by[None], len(z), 0))
    value, slope = value + total(by * near.V), slope + times(swapped(near.J), by[..., None])[..., 0]
    H = hessian(far, by, pairs) + bend
    off = times(K, (near.u - centre)[..., None])[..., 0]
    more = total(off * near.V), times(swapped(near.J), off[..., None])[..., 0]
    more_slope = more[1] + times(swapped(K), near.V[..., None])[..., 0]
    product = times(swapped(K), far.J)
    more_H = hessian(far, times(K, (far.u - centre)[..., None])[..., 0], []) + product + swapped(product)
    below, above = box.low - z, box.high - z
    best, blame = np.full(len(z), -math.inf), np.zeros(z.shape)
    for part in parts:
        left = np.flatnonzero(best <= 0.0)
        if left.size == 0:
            break
        own = times(swapped(shear), (slope[left] + more_slope[left] * part)[..., None])[..., 0]
        turned = times(swapped(shear), times(H[left] + more_H[left] * part, shear))
        bound, lost = least(value[left] + more[0][left] * part, own, turned, below[left], above[left])
        better = bound > best[left]
        best[left[better]], blame[left[better]] = bound[better], lost[better]
    return best, blame


def augmented(bodies: Bodies, proof: Multipliers, box: Box) -> Multipliers:
    """Choose K = S J so that L is curved upward in coordinates without a loaded limit (estimated).

    The added curvature, by the half widths of the box, is that of the loaded limits; parts of it are tried.
    """
    radius = 0.5 * (box.high - box.low)[0]
    here = at(bodies, exact(proof.at[None]))
    J = here.J.mid[0]
    none = exact(np.zeros((1, len(proof.by))))
    loaded = np.diagonal(hessian(here, none, weighed_pairs(bodies, proof)).mid[0]) * radius**2
    slides = np.diagonal(limits_of(bodies, here.u, proof.weight)[2].mid[0]) * radius**2
    top = float((loaded + slides).max(initial=0.0))
    idle = ((loaded + slides) < 1e-6 * top) & (np.arange(bodies.width) < bodies.size) & (radius > 0.0)
    by = np.abs(proof.by).reshape(-1, 3).max(1)
    active = np.repeat(by > 1e-10 * by.max(initial=0.0), 3)
    inverse = np.linalg.pinv(J[np.ix_(active, idle)] * radius[idle], rcond=3e-2)
    K = np.zeros_like(J)
    K[active] = 0.5 * (top or 1.0) * (inverse.T @ inverse) @ J[active]
    return proof._replace(K=K)


def contract(bodies: Bodies, box: Box, rounds: int = 8) -> tuple[Box, NDArray[np.bool_]]:
    """Cut away parts of boxes where some loop does not close (certified); True where nothing is left."""
    low, high = box.low.copy(), box.high.copy()
    empty = np.zeros(len(low), dtype=bool)
    ball = box.ball
    J = at(bodies, box.unknowns(exact(ball.mid[:1]))).J.mid[0]
    weight = np.maximum(ball.rad[0], 1e-300)[: bodies.size]
    _, upper, order = qr(J[:, : bodies.size] * weight, mode="economic", pivoting=True)
    diagonal = np.abs(np.diag(upper))
    basic = np.sort(order[: int((diagonal > 1e-9 * diagonal.max(initial=0.0)).sum())])
    for _ in range(rounds):
        empty |= _narrowed(bodies, low, high)
        live = np.flatnonzero(~empty)
        before = (high - low)[live]
        for part in np.array_split(live, 1 + len(live) // 64):
            down, up = _solved(bodies, box._replace(low=low[part], high=high[part]), basic)
            rows = np.ix_(part, basic)
            low[rows], high[rows] = np.maximum(low[rows], down), np.minimum(high[rows], up)
            empty[part] |= (low[part] > high[part]).any(1)
        wide = before > 1e-14
        after = np.where(empty[live, None], before, (high - low)[live])
        if empty.all() or not (after[wide] < 0.9 * before[wide]).any():
            break
    return box._replace(low=low, high=high), empty


def _narrowed(bodies: Bodies, low: Array, high: Array) -> NDArray[np.bool_]:
    """Narrow the leans of links in place, as the limits of their joints tell (certified); True where nothing is left.

    Axes within an angle t of each other are within ``2 sin(t / 2) <= t`` in every component.
    """
    empty = np.zeros(len(low), dtype=bool)
    for _ in range(3):
        for first, second, most in bodies.close:
            ends = [_axis_box(bodies, own, low, high) for own in (first, second)]
            for own, (down, up) in ((first, ends[1]), (second, ends[0])):
                if isinstance(own, tuple):
                    _lean_within(own, low, high, down - most, up + most)
        empty |= (low > high).any(1)
    return empty


def _axis_box(bodies: Bodies, own: Any, low: Array, high: Array) -> tuple[Array, Array]:
    """Bounds of the x and y of an axis (N, 2): of a chart, or constant ones."""
    if not isinstance(own, tuple):
        return own.mid - own.rad * _UP, own.mid + own.rad * _UP
    x, y = own
    size = np.maximum(np.abs(low[:, [x, y]]), np.abs(high[:, [x, y]]))
    least = (1.0 - 1e-14) / (1.0 + 0.25 * (size**2).sum(1))
    ends = [np.stack([part[:, y], -other[:, x]], 1) for part, other in ((low, high), (high, low))]
    down = np.where(ends[0] > 0.0, ends[0] * least[:, None], ends[0])
    up = np.where(ends[1] < 0.0, ends[1] * least[:, None], ends[1])
    return down, up


def _lean_within(own: tuple[int, int], low: Array, high: Array, down: Array, up: Array) -> None:
    """Bound x and y of a chart by those of its axis ``(k y, -k x)``."""
    x, y = own
    size = np.maximum(np.abs(low[:, [x, y]]), np.abs(high[:, [x, y]]))
    most = (1.0 + 1e-14) * (1.0 + 0.25 * (size**2).sum(1))[:, None]
    down, up = np.where(down < 0.0, down * most, down), np.where(up > 0.0, up * most, up)
    for column, smallest, largest in ((y, down[:, 0], up[:, 0]), (x, -up[:, 1], -down[:, 1])):
        low[:, column], high[:, column] = np.maximum(low[:, column], smallest), np.minimum(high[:, column], largest)


def _solved(bodies: Bodies, box: Box, basic: Ints) -> tuple[Array, Array]:
    """Bounds of the chosen coordinates, (N, chosen) twice."""
    ball, shear = box.ball, exact(box.shear)
    here = at(bodies, box.unknowns(exact(ball.mid)))
    J = times(here.J, shear)
    inverse = exact(np.linalg.pinv(J.mid[:, :, basic]))
    offset = times(inverse, here.V[..., None])[..., 0]
    M = times(inverse, J)
    units = np.zeros(M.mid.shape)
    units[:, np.arange(len(basic)), basic] = 1.0
    rest = (M - exact(units)).size
    H = hessian(at(bodies, box.unknowns(ball)), inverse, [])
    H = times(swapped(shear), times(H, shear))
    radius = ball.rad
    square = radius[:, None, :] * radius[:, None, :]
    # the squares of the diagonal have one sign: half the width, and a shift of the centre
    own = np.diagonal(H.mid, axis1=-2, axis2=-1)
    centred = 0.25 * (own * square).sum(-1)
    size = H.size
    second = 0.5 * ((size @ radius[:, None, :, None])[..., 0] * radius[:, None, :]).sum(-1)
    second = second - 0.25 * (np.abs(own) * square).sum(-1) * (1.0 - 1e-12)
    spread = ((rest @ radius[:, :, None])[..., 0] + second + offset.rad) * _UP
    centre = ball.mid[:, basic] - offset.mid - centred
    terms = np.abs(centre) + np.abs(ball.mid[:, basic]) + spread + np.abs(own * square).sum(-1)
    spread = spread * _UP + 1e-14 * terms
    return centre - spread, centre + spread


def binds(bodies: Bodies, proof: Multipliers, box: Box, most: int) -> bool:
    """Whether no member of a box closes within the limits (certified), cut into at most so many boxes."""
    live, empty = contract(bodies, box)
    live, used = live.take(~empty), 1
    proof = augmented(bodies, proof, live) if len(live.low) else proof
    while len(live.low):
        bound, blame = lower_bounds(bodies, proof, live, PARTS)
        left = ~(bound > 0.0)
        live, blame = live.take(left), blame[left]
        if len(live.low) == 0:
            return True
        if used + 2 * len(live.low) > most:
            return False
        live = _halved(bodies, live, blame)
        used += len(live.low)
        live, empty = contract(bodies, live, 2)
        live = live.take(~empty)
    return True


def _halved(bodies: Bodies, boxes: Box, blame: Array) -> Box:
    """Cut every box across the coordinate that takes most off the bound."""
    blame = np.where(np.isfinite(blame), blame, (boxes.high - boxes.low))[:, : bodies.size]
    rows, side = np.arange(len(blame)), blame.argmax(1)
    middle = 0.5 * (boxes.low + boxes.high)[rows, side]
    high, low = boxes.high.copy(), boxes.low.copy()
    high[rows, side] = low[rows, side] = middle
    return boxes._replace(low=np.concatenate([boxes.low, low]), high=np.concatenate([high, boxes.high]))
