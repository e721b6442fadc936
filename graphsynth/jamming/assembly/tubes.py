"""Tubes: where the one assembly of a mechanism lies over intervals of the input and of its dimensions, proved.

The assembly at the middle of a piece is proved by Krawczyk's test of a point.  From there it is followed to every other
input u and every choice p of the dimensions: on the branch ``x' = -F_x^-1 F_(u,p)``, and if that, enclosed over a box
X around the middle, cannot lead out of X, there is exactly one assembly in X for every member.  Rates
stay apart, one column for the input and one for each parameter, so that what moves together counts together.
See theory/drawing-tolerances 3.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from graphsynth.intervals import Dual, Interval, Status, image, variables
from graphsynth.intervals.dual import jacobian_of, values_of
from graphsynth.jamming.assembly.places import Places
from graphsynth.jamming.assembly.positions import Array, Mask, Placement, Positions, enclosed_solve, guide, points
from graphsynth.mechanism.equations import Pair
from graphsynth.mechanism.joints import PinSlot, Prismatic, Revolute

_CHUNK = 256
#: Rounds of Krawczyk's test of a point, of Newton's method, and of the search for a box that holds the branch.
_ROUNDS, _STEPS = 6, 4
#: Size of a box over the movement expected; shells of the way outward where one will not do, and tries for each.
_ROOM, _SHELLS, _TRIES = 1.25, 4, 2


class Tubes(NamedTuple):
    """Pieces of the input and of the dimensions, and what is proved about them.

    ``proved`` (N,); ``domain`` and ``tight`` (N, size): the box with exactly one assembly, and where that lies;
    ``centre`` (N, size): where it lies at the middle of the input and of the parameters;
    ``r``, ``e``, ``base``, ``rail`` (N, ...): `Places` of the joints asked for.  Certified where proved.  ``reach``
    (N, 1 + m): how far the input and each parameter lead the unknowns, in units of their weights (estimated): what is
    worth cutting.  ``dyads`` (N, dyads, 7): what `graphsynth.jamming.assembly.dyads.place_dyad` finds, the room first,
    positive where proved.
    """

    proved: Mask
    domain: Interval
    tight: Interval
    centre: Interval
    r: Interval
    e: Interval
    base: Interval
    rail: Interval
    reach: Array
    dyads: Interval

    @property
    def places(self) -> Places:
        """Places of the joints."""
        return Places(self.r, self.e, self.base, self.rail)

    def take(self, rows: NDArray[np.intp]) -> Tubes:
        """Return some of the pieces."""
        return Tubes._make(part[rows] for part in self)


def prove_tubes(
    system: Positions,
    joints: tuple[int, ...],
    u: Interval,
    x: Array,
    counted: Array,
    parameters: Interval | None = None,
) -> Tubes:
    """Prove pieces u (N,) of the input around float solutions, with the positions of the joints named.

    ``x`` (N, size) are the unknowns at the midpoints, ``counted`` (N, closing) is from ``system.count`` there,
    ``parameters`` (N, m) the box of every piece, the whole one if not given.
    """
    p = whole_box(system, len(x)) if parameters is None else parameters
    parts = []
    for k in range(0, max(len(x), 1), _CHUNK):
        part = slice(k, k + _CHUNK)
        parts.append(_prove(system, joints, u[part], x[part], counted[part], p[part]))
    return Tubes._make(joined(list(own)) for own in zip(*parts))


def joined(parts: list[Any]) -> Any:
    """Concatenate arrays or intervals."""
    if not isinstance(parts[0], Interval):
        return np.concatenate(parts)
    return Interval.from_bounds(np.concatenate([b.lo for b in parts]), np.concatenate([b.hi for b in parts]))


def whole_box(system: Positions, count: int) -> Interval:
    """Return the whole box of parameters for N pieces, (N, m)."""
    shape = (count, system.box.size)
    return Interval.from_bounds(np.broadcast_to(system.box.low, shape), np.broadcast_to(system.box.high, shape))


def columns_of(values: Interval) -> list[Interval]:
    """Split (N, m) into m columns."""
    return [values[:, k] for k in range(values.shape[1])]


def settled(system: Positions, x: Array, u: Interval, p: Interval, counted: Array) -> Array:
    """Newton's method for float solutions at the middles of inputs and parameters, from those of the nominal mechanism.

    An estimate: what is not a solution is not proved.
    """
    at = system.within(columns_of(points(p.mid)))
    q, size = system.driven(points(u.mid)), x.shape[1]
    for _ in range(_STEPS):
        rows = at.equations(variables(points(x)), q, counted)
        off, table = values_of(rows, (len(x),)).mid, jacobian_of(rows, size, (len(x),)).mid
        usable = np.asarray(np.isfinite(table).all(axis=(1, 2)) & np.isfinite(off).all(axis=1))
        inverse = np.linalg.pinv(np.where(usable[:, None, None], table, 0.0), rcond=1e-14)
        step = (inverse @ np.where(usable[:, None], off, 0.0)[:, :, None])[..., 0]
        x = x - step
        if np.abs(step).max(initial=0.0) <= 1e-13:
            break
    return x


def _middle(system: Positions, u: Interval, x: Array, p: Interval, counted: Array) -> tuple[Mask, Interval]:
    """Prove the assembly at the middle of every piece: whether, and where."""
    at, q = system.within(columns_of(points(p.mid))), system.driven(points(u.mid))
    radius = np.broadcast_to(1e-10 * system.weights, x.shape)
    low, high, proved = x - radius, x + radius, np.zeros(len(x), dtype=np.bool_)
    left = np.arange(len(x))
    for _ in range(_ROUNDS):
        box, own = Interval.from_bounds(low[left], high[left]), at.of(left)
        driven, turns = [_at(value, left, len(x)) for value in q], counted[left]
        found = image(lambda unknowns, own=own, q=driven, turns=turns: own.equations(unknowns, q, turns), box)
        good = found.status == Status.UNIQUE
        proved[left[good]] = True
        low[left[good]], high[left[good]] = found.box.lo[good], found.box.hi[good]
        bad = ~good & found.image.is_bounded.all(axis=1)
        wider = found.image[bad].hull(box[bad]).inflate(0.5, 1e-12)
        low[left[bad]], high[left[bad]] = wider.lo, wider.hi
        left = left[bad][(wider.rad < 1e-3 * system.weights).all(axis=1)]
        if left.size == 0:
            break
    return proved, Interval.from_bounds(low, high)


def _prove(system: Positions, joints: tuple[int, ...], u: Interval, x: Array, counted: Array, p: Interval) -> Tubes:
    count, size = x.shape
    if system.box.size and size:
        x = settled(system, x, u, p, counted)
    steps = Interval.stack([u, *columns_of(p)], axis=-1)
    steps = steps - points(steps.mid)
    half, weights = steps.mag, system.weights
    proved = np.ones(count, dtype=np.bool_)
    tight = domain = centre = Interval.zeros((count, 0))
    dyads, reach = _dyads(system, u, p, steps)
    proved &= (dyads[:, :, 0].lo > 0.0).all(axis=1)
    if size:
        found, centre = _middle(system, u, x, p, counted)
        proved &= found
        tight = domain = centre
    if size and half.any():
        rates = _rates(system, points(u.mid), centre, counted, points(p.mid))[2].mag
        move = (rates * half[:, None]).sum(axis=2)
        reach = np.maximum(reach, np.where(np.isfinite(rates), rates, 0.0).max(axis=1, initial=0.0) * half)
        radius = _ROOM * move + (0.05 * (move / weights).max(axis=1, initial=0.0, keepdims=True) + 1e-10) * weights
        held, parts = np.zeros((count, size)), (u, p, steps)
        left = np.flatnonzero(proved)
        proved = np.zeros(count, dtype=np.bool_)
        for shells in (1, 1, _SHELLS):
            # a box of half the size of the mechanism says that the piece is too large: give up, it will be cut
            left = left[(radius[left] < 0.7 * weights).all(axis=1)]
            if left.size == 0:
                break
            piece = parts[0][left], parts[1][left], parts[2][left]
            own, guess = system.about(dyads[left]), (radius[left], move[left])
            lead, room, inside = _lead(own, piece, centre[left], counted[left], guess, shells)
            proved[left[inside]], held[left[inside]], radius[left[inside]] = True, lead[inside], room[inside]
            wider = np.where(inside[:, None] | ~(_ROOM * lead < 0.7 * weights), radius[left], _ROOM * lead)
            radius[left] = np.maximum(radius[left], wider)
            left = left[~inside]
        spread = np.where(proved[:, None], held, 0.0)
        tight = centre + Interval.from_bounds(-spread, spread)
        room = np.where(proved[:, None], radius, 0.0)
        domain = centre + Interval.from_bounds(-room, room)
    if not joints:
        none, base = Interval.zeros((count, 0, 2)), Interval.zeros((count, 0, 2, 2))
        return Tubes(proved, domain, tight, centre, none, none, base, none, reach, dyads)
    return Tubes(proved, domain, tight, centre, *_placed(system.about(dyads), joints, u, tight, p), reach, dyads)


def _dyads(system: Positions, u: Interval, p: Interval, steps: Interval) -> tuple[Interval, Array]:
    """Enclose the dyads, which depend on the input and the parameters alone, by the mean value theorem.

    And estimate how far each of these turns the links of the dyads, (N, 1 + m).
    """
    count = len(u)
    if not system.dyads:
        return Interval.zeros((count, 0, 7)), np.zeros(steps.shape)
    with np.errstate(all="ignore"):
        at, middle = _closed(system, points(u.mid), points(p.mid))
        turned = [at.angle[link] for dyad in system.dyads for link in dyad.links]
        rates = [angle.grad.mag.T for angle in turned if isinstance(angle, Dual)]
        reach = np.nan_to_num(np.max(rates, axis=0), posinf=0.0) * steps.mag if rates else np.zeros(steps.shape)
        near = system.about(middle, Interval.from_bounds(steps.lo.T, steps.hi.T))
        return _closed(near, u, p)[1], reach


def _closed(system: Positions, u: Interval, p: Interval) -> tuple[Placement, Interval]:
    """Place the dyads over pieces, with derivatives by the input and the parameters; enclosures (N, dyads, 7)."""
    first, *rest = variables(Interval.stack([u, *columns_of(p)], axis=-1))
    at = system.within(rest).place([Interval(0)] * system.size, system.driven(first))
    zero = Interval.zeros((len(u),))
    values = [[(v.value if isinstance(v, Dual) else v) + zero for v in own] for own in at.dyads]
    return at, Interval.stack([Interval.stack(own, axis=-1) for own in values], axis=1)


def shortest_reach(system: Positions, u: Array) -> tuple[Array, Array]:
    """Members (N, m) whose dyads seem to reach least far at inputs (N,), and bounds above (N,) of their least room.

    Below zero, proved: that member has no assembly there, on this side of the dyads before.
    """
    inputs, box = points(u), system.box
    members, least = np.zeros((len(u), box.size)), np.full(len(u), np.inf)
    with np.errstate(all="ignore"):
        for room in _closed(system, inputs, points(members))[0].rooms:
            falls = -np.nan_to_num(room.grad.mid[1:].T) if isinstance(room, Dual) else np.zeros_like(members)
            p = np.array([box.furthest(own) for own in falls])
            found = np.fmin.reduce(_closed(system, inputs, points(p))[1].hi[:, :, 0], axis=1)
            better = found < least
            members[better], least[better] = p[better], found[better]
    return members, least


def middles(system: Positions, joints: tuple[int, ...], u: Interval, tubes: Tubes, p: Interval) -> Tubes:
    """Return tubes of the middles of pieces u and p: where the joints are there."""
    u, p, x = points(u.mid), points(p.mid), tubes.centre
    return Tubes(tubes.proved, x, x, x, *_placed(system, joints, u, x, p), np.zeros_like(tubes.reach), tubes.dyads)


def _placed(system: Positions, joints: tuple[int, ...], u: Interval, x: Interval, p: Interval) -> Places:
    """Enclose the places of joints for unknowns x."""
    own, zero = system.within(columns_of(p)), Interval.zeros((len(u),))
    return places(own, joints, own.place(columns_of(x), own.driven(u)), lambda value: value + zero)


def _lead(
    system: Positions,
    piece: tuple[Interval, Interval, Interval],
    centre: Interval,
    counted: Array,
    guess: tuple[Array, Array],
    shells: int,
) -> tuple[Array, Array, Mask]:
    """Bound how far the assembly is led from the middle: lead, radius of the box that held it, whether it did.

    From the middle outward in shells: while the share t of all steps is gone, the rates over a box that holds the
    branch so far bound the next part of the way.  ``guess`` is a radius for the whole way, and the way to first order.
    """
    (u, p, steps), (radius, move) = piece, guess
    lead, room, inside = np.zeros_like(radius), radius, np.ones(len(radius), dtype=np.bool_)
    for k in range(shells):
        share, last = (k + 1) / shells, np.zeros_like(radius)
        part = points(steps.mid * 0.0) + steps * share
        room = radius if shells == 1 else lead + 1.6 * (move / shells if k == 0 else lead / k) + 1e-3 * radius
        for _ in range(1 if shells == 1 else _TRIES):
            box = centre + Interval.from_bounds(-room, room)
            here = points(u.mid) + part[:, 0], points(p.mid) + part[:, 1:]
            _, _, rate, fine = _rates(system, here[0], box, counted, here[1])
            with np.errstate(all="ignore"):
                way = (points(rate.mag) * points(steps.mag[:, None])).sum(-1) / shells
                last = (points(lead) + way).hi
            good = fine & (last < room).all(axis=1)
            if (good | ~inside).all():
                break
            room = np.where(good[:, None], room, np.where(np.isfinite(last), lead + 1.3 * (last - lead), room))
        inside &= good
        lead = np.where(inside[:, None], last, 0.0)
    return last, room, inside


def _at(value: Interval, rows: NDArray[np.intp], count: int) -> Interval:
    return value[rows] if value.shape == (count,) else value


def places(system: Positions, joints: tuple[int, ...], at: Placement, read: Callable[[Any], Interval]) -> Places:
    """Stack the places of joints; ``read`` takes what is wanted of each number."""

    def full(pair: Pair) -> Interval:
        return Interval.stack([read(pair.x), read(pair.y)], axis=-1)

    r: list[Interval] = []
    e, base, rails = list(r), list(r), dict[int, Interval]()
    for k in joints:
        joint = system.mechanism.joints[k]
        A, B = system.ends(k, at)
        # both ends of a revolute joint are the same point: each encloses it
        r.append(full(A).intersect(full(B)) if isinstance(joint, Revolute) else full(B))
        along = Pair(Interval(1), Interval(0))
        if isinstance(joint, Prismatic | PinSlot):
            along, rails[len(e)] = guide(joint, at), full(A)
        e.append(full(along))
        base.append(Interval.stack([full(at.turn[joint.a]), full(at.turn[joint.b])], axis=-2))
    positions = Interval.stack(r, axis=-2)
    rail = Interval.stack([rails.get(k, own) for k, own in enumerate(r)], axis=-2) if rails else positions
    return Places(positions, Interval.stack(e, axis=-2), Interval.stack(base, axis=-3), rail)


def _rates(
    system: Positions, u: Interval, x: Interval, counted: Array, p: Interval
) -> tuple[list[Any], Positions, Interval, Mask]:
    """Unknowns and system as duals of unknowns, input and parameters over boxes, and the rates (N, size, 1 + m).

    On the branch ``F(x, u, p) = 0``, so ``F_x x' = -F'``; the solution set of the linear systems with both enclosed
    holds the rates for every member.  The mask tells where every ``F_x`` of the box is proved regular.
    """
    count, n = len(u), system.size
    both = u.reshape(count, 1)
    box = Interval.from_bounds(
        np.concatenate([x.lo, both.lo, p.lo], axis=1), np.concatenate([x.hi, both.hi, p.hi], axis=1)
    )
    unknowns = variables(box)
    own = system.within(unknowns[n + 1 :])
    if n == 0:
        return unknowns, own, Interval.zeros((count, 0, 1 + p.shape[1])), np.ones(count, dtype=np.bool_)
    rows = own.equations(unknowns[:n], own.driven(unknowns[n]), counted)
    values, table = values_of(rows, (count,)), jacobian_of(rows, len(unknowns), (count,))
    with np.errstate(all="ignore"):
        rate, fine = enclosed_solve(table[:, :, :n], -table[:, :, n:])
    smooth = np.broadcast_to(values.guaranteed, values.shape).all(axis=1)
    smooth &= np.broadcast_to(table.guaranteed, table.shape).all(axis=(1, 2))
    return unknowns, own, rate, fine & smooth


def slopes(
    system: Positions,
    joints: tuple[int, ...],
    u: Interval,
    tubes: Tubes,
    counted: Array,
    parameters: Interval | None = None,
) -> tuple[Places, Mask]:
    """Enclose the derivatives of the places of `Tubes`, and tell where that is proved.

    Each has one axis more in front: by the input, and by every parameter, over the whole of each piece.
    """
    count, n = len(u), system.size
    p = whole_box(system, count) if parameters is None else parameters
    unknowns, own, rate, fine = _rates(system.about(tubes.dyads), u, tubes.tight, counted, p)
    kinds = 1 + p.shape[1]

    def along(value: Any) -> Interval:
        """Return the derivatives along the motion and along every parameter, (1 + m, N)."""
        if not isinstance(value, Dual):
            return Interval.zeros((kinds, count))
        total = value.grad[n:] + Interval.zeros((kinds, count))
        for i in range(n):
            each = rate[:, i]
            total = total + Interval.from_bounds(each.lo.T, each.hi.T) * value.grad[i]
        return total

    moved = places(own, joints, own.place(unknowns[:n], own.driven(unknowns[n])), along)
    return moved, fine
