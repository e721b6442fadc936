"""The margin of random members in floating point, by cutting planes: for Monte Carlo beside the proof.

For fixed lengths the margin is the least of linear functions of limits and misalignments, one for each wrench in
equilibrium at each input.  A pool of them is grown where members come close to binding: each is solved at the inputs
where it is worst.  Positions follow the lengths to first order (estimated).
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from graphsynth.intervals import Interval
from graphsynth.jamming.assembly.places import Places
from graphsynth.jamming.assembly.positions import points
from graphsynth.jamming.assembly.tubes import prove_tubes, slopes
from graphsynth.jamming.joints.closure import Leans, leaning_points
from graphsynth.jamming.margins.program import item_rows, share

if TYPE_CHECKING:
    from graphsynth.jamming.joints.pieces import Work
    from graphsynth.jamming.margins.program import Items
    from graphsynth.jamming.margins.quantities import Quantities

Array = NDArray[np.float64]
Rows = NDArray[np.intp]
#: Inputs of the grid over a full rotation, members the pool is started with, members solved in a round, rounds.
_GRID, _STARTED, _SOLVED, _ROUNDS = 256, 12, 200, 4
#: Cuts kept for the exact value of a member; members closer than this to binding are solved; a gain worth a cut.
_NEAR, _CLOSE, _GAIN = 6, 0.15, 1e-5
_CHUNK = 20_000


class Members(NamedTuple):
    """Limits of the items (N, items), misalignments (N, axes, 2) and lengths (N, lengths) of members."""

    t: Array
    v: Array
    p: Array

    def take(self, rows: Rows) -> Members:
        """Return some of the members."""
        return Members(*(part[rows] for part in self))


class Sampler:
    """Positions at a grid of inputs, and the pool of cuts: place in the grid, wrench."""

    def __init__(self, quantities: Quantities, items: Items, work: Work) -> None:
        self.quantities, self.layout, self.items = quantities, quantities.layout, items
        count = int(np.clip(_GRID * (work.high - work.low) / (2.0 * np.pi), 64, _GRID))
        u = np.linspace(work.low, work.high, count + 1)
        fine, poses, velocities = work._follow(u)
        u, poses, velocities = u[fine], poses[fine], velocities[fine]
        x, counted = work.system.coordinates(poses, velocities)[0], work.system.count(poses)
        none = points(np.zeros((len(u), work.box.size)))
        at = prove_tubes(work.system, self.layout.joints, points(u), x, counted, none)
        by, _ = slopes(work.system, self.layout.joints, points(u), at, counted, none)
        here, rates = Places(*(own.mid for own in at.places)), Places(*(own.mid[1:] for own in by))
        centre, unit = self.items.centre, self.items.length
        self.at = here._replace(r=(here.r - centre) / unit, rail=(here.rail - centre) / unit)
        self.by = rates._replace(r=rates.r / unit, rail=rates.rail / unit)
        self.place, self.y = np.zeros(0, dtype=np.intp), np.zeros((0, 3 * self.layout.loops))
        self.count = len(u)

    def members(self, x: Array) -> Members:
        """Evaluate quantities (N, quantities)."""
        quantities = self.quantities
        values = quantities.values([points(column) for column in x.T])
        none = np.zeros(len(x))

        def mid(own: Interval | None) -> Array:
            return none if own is None else none + own.mid

        t = [mid(own) for own in values.limits]
        t += [mid(own) / self.items.length for own in values.plays]
        v = [np.stack([mid(a), mid(b)], axis=-1) for a, b in values.vectors]
        return Members(np.stack(t, axis=-1), np.stack(v, axis=-2), x[:, : quantities.box.size])

    def _geometry(self, place: Rows, p: Array) -> Places:
        """Where the joints are at places of the grid, to first order in the lengths."""
        found = []
        for here, by in zip(self.at, self.by):
            own = here[place]
            for k in range(p.shape[1]):
                own = own + by[k][place] * p[:, k].reshape(-1, *(1,) * (own.ndim - 1))
            found.append(own)
        return Places(*found)

    def _leans(self, at: Places, v: Array) -> Leans:
        base = at.base
        d = np.zeros((*base.shape[:2], 2))
        for k, (place, sign, _) in enumerate(self.layout.misalignments):
            x, y = np.moveaxis(base[:, place, 0 if sign > 0 else 1], -1, 0)
            d[:, place, 0] = sign * (x * v[:, k, 0] - y * v[:, k, 1])
            d[:, place, 1] = sign * (x * v[:, k, 1] + y * v[:, k, 0])
        return Leans(d, leaning_points(self.layout, at.r, at.rail))

    def _loads(self, place: Rows, y: Array, p: Array) -> tuple[Array, Array]:
        """Return loads of the items (P, items) and rates of the work by the misalignments (P, axes, 2)."""
        at = self._geometry(place, p)
        rows = item_rows(self.layout, at.r, at.e)
        if self.items.free.any() and p.shape[1]:  # joints without limit carry nothing, whatever the lengths
            none = rows[:, self.items.free].reshape(len(y), -1, y.shape[1])
            y = y - (np.linalg.pinv(none, rcond=1e-11) @ (none @ y[:, :, None]))[..., 0]
        load = np.einsum("pick,pk->pic", rows, y)
        size = np.where(self.items.costly, np.hypot(load[..., 0], load[..., 1]), 0.0)
        wrench = np.einsum("lj,plc->pjc", self.layout.incidence, y.reshape(len(y), -1, 3))
        x, y = np.moveaxis(leaning_points(self.layout, at.r, at.rail), -1, 0)
        moment = np.stack([wrench[..., 0] - wrench[..., 2] * y, wrench[..., 1] + wrench[..., 2] * x], axis=-1)
        rates = []
        for own, sign, _ in self.layout.misalignments:
            turn = at.base[:, own, 0 if sign > 0 else 1]
            mx, my = moment[:, own, 0], moment[:, own, 1]
            rates.append(sign * np.stack([mx * turn[:, 0] + my * turn[:, 1], my * turn[:, 0] - mx * turn[:, 1]], -1))
        return size, np.stack(rates, axis=1)

    def solve(self, members: Members, place: Rows) -> Array:
        """Wrenches of members at places, with cost 1 and the sign that binds."""
        at = self._geometry(place, members.p)
        t = np.where(self.items.costly, np.maximum(members.t, 0.0), 0.0)
        found = share(self.layout, self.items, t, at.r, at.e, self._leans(at, members.v))
        size, rates = self._loads(place, found.y, members.p)
        cost, work = (t * size).sum(axis=1), (rates * members.v).sum(axis=(1, 2))
        y: Array = found.y * (np.where(work < 0.0, -1.0, 1.0) / np.where(cost > 1e-300, cost, 1.0))[:, None]
        return y

    def value(self, members: Members, place: Rows, y: Array) -> Array:
        """Margin of members by one cut each."""
        size, rates = self._loads(place, y, members.p)
        own: Array = (members.t * size).sum(axis=1) - (rates * members.v).sum(axis=(1, 2))
        return own

    def least(self, members: Members) -> tuple[Array, Rows]:
        """Least value over the pool, and which cut."""
        count, m = members.p.shape
        none = np.zeros((len(self.y), m))
        size, rates = self._loads(self.place, self.y, none)
        flat = rates.reshape(len(self.y), -1)
        values = members.t @ size.T - members.v.reshape(count, -1) @ flat.T
        if m == 0:
            best = values.argmin(axis=1)
            return values[np.arange(count), best], best
        middle = members.take(np.zeros(len(self.y), dtype=np.intp))._replace(
            t=np.broadcast_to(members.t.mean(axis=0), (len(self.y), members.t.shape[1])),
            v=np.broadcast_to(members.v.mean(axis=0), (len(self.y), *members.v.shape[1:])),
        )
        reach = np.abs(members.p).max(axis=0)
        for k in range(m):
            step = none.copy()
            step[:, k] = reach[k]
            ends = [self.value(middle._replace(p=sign * step), self.place, self.y) for sign in (1.0, -1.0)]
            values += np.multiply.outer(members.p[:, k], (ends[0] - ends[1]) / (2.0 * max(reach[k], 1e-300)))
        near = np.argpartition(values, min(_NEAR, len(self.y)) - 1, axis=1)[:, :_NEAR]
        exact = np.stack([self.value(members, self.place[c], self.y[c]) for c in near.T], axis=1)
        at = exact.argmin(axis=1)
        rows = np.arange(count)
        return exact[rows, at], near[rows, at]

    def add(self, place: Rows, y: Array) -> None:
        """Add cuts to the pool."""
        keep = np.abs(y).max(axis=1, initial=0.0) > 0.0
        self.place, self.y = np.concatenate([self.place, place[keep]]), np.concatenate([self.y, y[keep]])

    def grow(self, members: Members) -> None:
        """Solve some members everywhere, then those close to binding where they are worst, until nothing is gained."""
        if not len(self.y):
            first = np.linspace(0, len(members.t) - 1, min(_STARTED, len(members.t))).astype(np.intp)
            places = np.arange(0, self.count, 4)
            who, where = np.repeat(first, len(places)), np.tile(places, len(first))
            self.add(where, self.solve(members.take(who), where))
            if not len(self.y):
                raise ValueError("nothing is misaligned")
        for _ in range(_ROUNDS):
            value, cut = self.least(members)
            close = np.flatnonzero(np.abs(value) < _CLOSE)
            close = close[np.argsort(np.abs(value[close]), kind="stable")][:_SOLVED]
            gained = 0
            if not close.size:
                break
            for off in (0, -1, 1, -4, 4):
                where = np.clip(self.place[cut[close]] + off, 0, self.count - 1)
                own = members.take(close)
                y = self.solve(own, where)
                better = self.value(own, where, y) < value[close] - _GAIN
                self.add(where[better], y[better])
                gained += int(better.sum())
            if not gained:
                break

    def margin_of(self, x: Array) -> Array:
        """Margin of members (N, quantities)."""
        parts = []
        for k in range(0, len(x), _CHUNK):
            members = self.members(x[k : k + _CHUNK])
            self.grow(members)
            parts.append(self.least(members)[0])
        return np.concatenate(parts) if parts else np.zeros(0)
