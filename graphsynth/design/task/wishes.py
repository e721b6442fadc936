"""Bounds as penalties: numbers that vanish where a bound is kept, with their derivatives.

What depends on the motion is looked at where it is worst; the rest depends on the unknowns alone.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from itertools import permutations

import numpy as np
from numpy.typing import NDArray

from graphsynth.design.task.model import Corner, Model, Moved, Rod, Rows, Unknowns
from graphsynth.design.task.places import Box

Array = NDArray[np.float64]
#: How much of a bound is asked beyond by a penalty, and the violation that counts like a tolerance.
_BEYOND, _SPARE, _UNIT = 1.03, 0.003, 0.01
#: What is asked beyond where bounds are kept exactly; the least sine of a transmission angle while they are not, and
#: where they are: a mechanism beyond could not be assembled, so that no step would know how to come back.
_HAIR, _LEAST, _VERGE = 1e-7, 0.005, 0.002


def sampled_wishes(model: Model, moved: Moved, u: Unknowns, strict: float, soft: bool = False) -> list[Rows]:
    """Return transmission angles of dyads, rods of sliders and cylinders, and the box.

    ``strict``: weight of the penalties; infinite for the numbers themselves, which then are negative where a bound is
    kept.  ``soft``: only of the bounds that are wishes, which are not among those numbers.
    """
    found: list[Rows] = []
    if (own := _weight(model, "transmission", strict, soft)) > 0.0:
        found += [_transmission(model, moved, u, corner, own) for corner in model.corners]
        found += [_sliding(model, moved, u, rod, own) for rod in model.rods]
    if model.task.box is not None and (own := _weight(model, "box", strict, soft)) > 0.0:
        found.append(_box(model, moved, u, model.task.box, own))
    return found


def _weight(model: Model, name: str, strict: float, soft: bool) -> float:
    """Return the weight of a bound, its own if it is a wish; 0 if it is not asked for."""
    own = model.task.soft.get(name)
    if own is None:
        return 0.0 if soft else strict
    return 0.0 if strict == math.inf else own


def _transmission(model: Model, moved: Moved, u: Unknowns, corner: Corner, strict: float) -> Rows:
    """Return by how much the cosine of the angle at the middle of three joints (joint, link) is too large, at most.

    The cosine is smooth even where a dyad cannot be assembled, so that a gap between two samples shows.
    """
    exact = strict == math.inf
    arms, at, motions = [], [], moved.frames.view(np.complex128)  # places and directions
    for joint, link in corner:
        own = motions[:, :, link]
        arms.append(own[..., 1] * (u.places[:, joint] @ [1.0, 1.0j])[:, None])
        at.append(own[..., 0] + arms[-1])
    one, two = at[1] - at[0], at[1] - at[2]
    mu = two * np.conj(one) / np.maximum(np.abs(two * one), 1e-300)
    peaks, near, share = _peaks(moved, np.abs(mu.real))
    row, least = np.arange(len(mu))[:, None], math.sin(model.task.transmission)
    floor = max(least, _VERGE) if exact else _asked(least)
    most = math.sqrt(1.0 - floor**2) - exact * _HAIR
    mu, one, two = mu[row, near], one[row, near], two[row, near]
    unit = 1.0 if exact else 1.0 - most
    over = (peaks - most) / unit
    slope = np.where(exact | (over > 0.0)[:, None], -share * np.sign(mu.real) * mu.imag / unit, 0.0)
    # directions of both arms: what their angle does when the joints move
    turns = [1j * slope * way / np.maximum(np.abs(way) ** 2, 1e-300) for way in (one, two)]
    loads, direct = np.zeros((len(mu), 1, model.links, 3, 3)), np.zeros((len(mu), 1, 3, model.size))
    for (joint, link), arm, by in zip(corner, arms, (turns[0], turns[1] - turns[0], -turns[1])):
        loads[:, 0, link, 0] += by.real
        loads[:, 0, link, 1] += by.imag
        loads[:, 0, link, 2] += (np.conj(by) * 1j * arm[row, near]).real
        if (column := model.column(joint)) >= 0:
            own = np.conj(by) * motions[row, near, link, 1]
            direct[:, 0, :, column] += own.real
            direct[:, 0, :, column + 1] -= own.imag
    values = (over if exact else np.maximum(over, 0.0))[:, None, None]
    return Rows(moved.inputs[near], values, loads, direct, 1.0 if exact else strict / _UNIT, mix=np.ones((1, 3)))


def _asked(least: float) -> float:
    """Return the sine that penalties ask for: a little more than the least, and less than 1."""
    return max(min(_BEYOND * least, 0.5 * (1.0 + least)), _LEAST)


def _sliding(model: Model, moved: Moved, u: Unknowns, rod: Rod, strict: float) -> Rows:
    """Return by how much the sine of the angle between a rod and the guide of its slider is too large, at most."""
    exact, row = strict == math.inf, np.arange(len(u.places))[:, None]
    way = (u.places[:, rod.near] - u.places[:, rod.far]) @ [1.0, 1.0j]  # on the rod, at the start
    angle = u.numbers[:, model.plan.design.numbers.index((rod.slide, "angle"))]
    motions = moved.frames.view(np.complex128)
    turned = motions[:, :, rod.link, 1] * np.conj(motions[:, :, rod.guide, 1])
    own = turned * (way / np.maximum(np.abs(way), 1e-300) * np.exp(-1j * angle))[:, None]
    peaks, near, share = _peaks(moved, np.abs(own.imag))
    least = math.sin(model.task.transmission)
    most = math.sqrt(1.0 - (least if exact else _asked(least)) ** 2) - exact * _HAIR
    unit = 1.0 if exact else 1.0 - most
    over = (peaks - most) / unit
    at = own[row, near]
    slope = np.where(exact | (over > 0.0)[:, None], share * np.sign(at.imag) * at.real / unit, 0.0)
    loads, direct = np.zeros((len(at), 1, model.links, 3, 3)), np.zeros((len(at), 1, 3, model.size))
    loads[:, 0, rod.link, 2] += slope
    loads[:, 0, rod.guide, 2] -= slope
    direct[:, 0, :, model.angle_at(rod.slide)] = -slope
    by = 1.0 / np.where(way == 0.0, 1.0, way)  # how the direction of the rod changes: the imaginary part of by dz
    for joint, sign in ((rod.near, 1.0), (rod.far, -1.0)):
        if (column := model.column(joint)) >= 0:
            direct[:, 0, :, column] += sign * slope * by.imag[:, None]
            direct[:, 0, :, column + 1] += sign * slope * by.real[:, None]
    values = (over if exact else np.maximum(over, 0.0))[:, None, None]
    return Rows(moved.inputs[near], values, loads, direct, 1.0 if exact else strict / _UNIT, mix=np.ones((1, 3)))


def _peaks(moved: Moved, values: Array) -> tuple[Array, NDArray[np.intp], Array]:
    """Return the largest value (sets,) of parabolas through a sample and its neighbours, these three, their shares."""
    n, row = values.shape[1], np.arange(len(values))[:, None]
    middle = np.arange(n)
    left, right = middle - 1, middle + 1
    left[0], right[-1] = (n - 2, 1) if moved.period else (0, n - 1)
    h = np.diff(moved.inputs)
    before, after = np.append(h[-1], h), np.append(h, h[0])
    rise, fall = (values - values[:, left]) / before, (values[:, right] - values) / after
    bend, slope = (fall - rise) / (before + after), (rise * after + fall * before) / (before + after)
    top = (rise > 0.0) & (fall < 0.0)
    away = np.where(top, -slope / (2.0 * np.where(top, bend, -1.0)), 0.0)
    worst = (values + 0.5 * slope * away).argmax(axis=1)[:, None]
    x, b, a = away[row, worst], before[worst], after[worst]
    share = [x * (x - a) / (b * (a + b)), (x + b) * (a - x) / (a * b), x * (x + b) / (a * (a + b))]
    near = np.concatenate([left[worst], worst, right[worst]], axis=1)
    return (values + 0.5 * slope * away)[row, worst][:, 0], near, np.concatenate(share, axis=1)


def _box(model: Model, moved: Moved, u: Unknowns, box: tuple[float, ...], strict: float) -> Rows:
    """How far joints and points leave the box on each of its four sides, over the size of the task."""
    exact = strict == math.inf
    links = [joint.a for joint in model.plan.design.graph.joints]
    columns = [model.column(k) for k in range(model.joints)]
    for name, of_point in model.task.names.items():
        if of_point:
            links.append(model.carrier(name))
            columns.append(model.point_at(name))
    local = np.concatenate([u.places, u.points], axis=1)
    w = np.stack([moved.link(k).frames for k in links], axis=2)  # (sets, samples, places, 4)
    x = w[..., 0] + w[..., 2] * local[:, None, :, 0] - w[..., 3] * local[:, None, :, 1]
    y = w[..., 1] + w[..., 3] * local[:, None, :, 0] + w[..., 2] * local[:, None, :, 1]
    sets, row, size = len(x), np.arange(len(x)), model.task.size
    loads, direct = np.zeros((sets, 1, model.links, 3, 4)), np.zeros((sets, 1, 4, model.size))
    values, times = np.zeros((sets, 1, 4)), np.zeros((sets, 4))
    for side, (z, sign, limit, axis) in enumerate(
        ((x, -1.0, box[0], 0), (y, -1.0, box[1], 1), (x, 1.0, box[2], 0), (y, 1.0, box[3], 1))
    ):
        over = (sign * (z - limit) / size + (_HAIR if exact else _SPARE)).reshape(sets, -1)
        worst = over.argmax(axis=1)
        sample, place = np.divmod(worst, len(links))
        out = exact | (over[row, worst] > 0.0)
        values[:, 0, side], times[:, side] = np.where(out, over[row, worst], 0.0), moved.inputs[sample]
        at, p, unit = w[row, sample, place], local[row, place], np.where(out, sign / size, 0.0)
        arm = (at[:, 2] + 1j * at[:, 3]) * (p[:, 0] + 1j * p[:, 1])
        own = np.array(links)[place]
        loads[row, 0, own, axis, side] = unit
        loads[row, 0, own, 2, side] = unit * (-arm.imag if axis == 0 else arm.real)
        column = np.array(columns)[place]
        free = column >= 0
        by = (at[:, 2], -at[:, 3]) if axis == 0 else (at[:, 3], at[:, 2])
        for k in (0, 1):
            direct[row[free], 0, side, column[free] + k] = (unit * by[k])[free]
    return Rows(times, values, loads, direct, 1.0 if exact else strict / _UNIT)


def direct_wishes(
    model: Model, u: Unknowns, strict: float, lengths: Lengths, soft: bool = False
) -> tuple[Array, Array]:
    """Lengths, pivots and the stroke: numbers (sets, m) and their derivatives (sets, m, size).

    ``strict``, ``soft`` as of `sampled_wishes`; what shall be equal then comes twice, with both signs.
    """
    task, sets, exact = model.task, len(u.places), strict == math.inf
    beyond, spare = (1.0 + _HAIR, _HAIR) if exact else (_BEYOND, _SPARE)
    values: list[Array] = [np.zeros((sets, 0))]  # (sets, some) each
    slopes: list[Array] = [np.zeros((sets, 0, model.size))]
    hard = 1.0 if exact else strict / _UNIT

    def add(value: Array, slope: Array, name: str = "") -> None:
        weight = hard if exact and name not in task.soft else _weight(model, name, strict, soft) / _UNIT
        if weight > 0.0:
            active = exact | (value > 0.0)
            values.append(weight * np.where(active, value, 0.0))
            slopes.append(weight * slope * active[..., None])

    def equal(value: Array, slope: Array) -> None:
        both = (1.0, -1.0) if exact else (1.0,)
        values.extend(sign * hard * value[:, None] for sign in both)
        slopes.extend(sign * hard * slope[:, None] for sign in both)

    sides, row = lengths.pairs[: lengths.sides], np.arange(sets)
    length, by = lengths.logarithms(u)
    own, own_by = length[:, : len(sides)], by[:, : len(sides)]
    short = own.argmin(axis=1)
    ratio = length - length[row, short][:, None] - math.log(task.length_ratio / beyond)
    add(ratio, by - by[row, short][:, None], "length_ratio")
    if task.lengths is not None:
        add(math.log(task.lengths[0]) + spare - own, -own_by, "lengths")
        add(own - math.log(task.lengths[1]) + spare, own_by, "lengths")
        arms = lengths.idling
        add(math.log(task.lengths[0]) + spare - length[:, arms], -by[:, arms])
    if soft:
        return np.concatenate(values, axis=1), np.concatenate(slopes, axis=1)
    if task.crank is not None and (k := _crank(model, sides)) >= 0:
        equal(length[:, k] - math.log(task.crank), by[:, k])
    used = np.zeros((sets, len(sides)), dtype=np.bool_)
    used[:, [p in model.fixed and q in model.fixed for p, q in sides]] = True  # sides of the frame are no bars
    for bar in task.bars:
        away = np.where(used, np.inf, np.abs(own - math.log(bar)))
        k = away.argmin(axis=1)
        used[row, k] = True
        equal(np.where(np.isfinite(away[row, k]), length[row, k] - math.log(bar), 1.0), by[row, k])
    for value, slope in plates_of(model, u):
        equal(value, slope)
    for joint, region in _regions(model):
        if (at := model.column(joint)) >= 0:
            for axis in (0, 1):
                for sign, limit in ((-1.0, region[axis]), (1.0, region[axis + 2])):
                    slope = np.zeros((sets, 1, model.size))
                    slope[..., at + axis] = sign / task.size
                    add(sign * (u.places[:, joint, axis, None] - limit) / task.size + spare, slope)
    if task.linear and task.stroke is not None:
        for sign, bound in ((-1.0, task.stroke[0]), (1.0, task.stroke[1])):
            slope = np.zeros((sets, 1, model.size))
            slope[:, 0, model.stroke_at] = sign / u.stroke
            add(sign * (np.log(np.maximum(u.stroke[:, None], 1e-300)) - math.log(bound)) + spare, slope)
    return np.concatenate(values, axis=1), np.concatenate(slopes, axis=1)


def plates_of(model: Model, u: Unknowns) -> Iterator[tuple[Array, Array]]:
    """Yield how links differ from given ones, the nearest taken: (sets,), derivatives (sets, size).

    Of each the logarithm of the first side, and the third place as the first two see it, real and imaginary part.
    """
    every = _triples(model)
    if not model.task.plates or not len(every):
        return
    z = np.concatenate([u.places, u.points], axis=1) @ [1.0, 1.0j]
    row, taken = np.arange(len(z)), np.zeros((len(z), len(every)))
    first, second, third = (z[:, every[:, 1 + k]] for k in range(3))
    side = np.where(second == first, 1e-12, second - first)
    seen = (third - first) / side
    for a, b, c in model.task.plates:
        x = (a * a + c * c - b * b) / (2.0 * a * a)
        corner = complex(x, math.sqrt(max((c / a) ** 2 - x * x, 0.0)))
        away = np.log(np.abs(side) / a)
        misses = [np.abs(seen - q) ** 2 + away**2 + taken for q in (corner, corner.conjugate())]
        k = np.minimum(*misses).argmin(axis=1)
        taken[every[None, :, 0] == every[k, 0][:, None]] = np.inf
        q = np.where(misses[0][row, k] <= misses[1][row, k], corner, corner.conjugate())
        at, unit = seen[row, k], 1.0 / side[row, k]
        off = at - q
        slopes = np.zeros((3, len(z), model.size))
        for place, by_side, by in zip(every[k, 1:].T, (-unit, unit, 0.0 * unit), ((at - 1.0) * unit, -at * unit, unit)):
            column = np.array([model.place_at(int(own)) for own in place])
            free = column >= 0
            for axis, turn in ((0, 1.0), (1, 1.0j)):
                parts = (turn * by_side).real, (turn * by).real, (turn * by).imag
                for n, part in enumerate(parts):
                    slopes[n, row[free], column[free] + axis] += part[free]
        yield from zip((away[row, k], off.real, off.imag), slopes, strict=True)


def _triples(model: Model) -> NDArray[np.intp]:
    """Return moving links with three joints that turn or named points, and these places in every order: (n, 4)."""
    design, found = model.plan.design, []
    carriers = [model.carrier(name) for name, of_point in model.task.names.items() if of_point]
    for link in range(model.links):
        own = [k for k in design.joints_of(link) if design.kinds[k] == "R"]
        own += [model.joints + k for k, carrier in enumerate(carriers) if carrier == link]
        found += [(link, *order) for order in permutations(own, 3) if link != design.graph.frame]
    return np.array(found, dtype=np.intp).reshape(-1, 4)


def _regions(model: Model) -> list[tuple[int, Box]]:
    """Return joints on the frame, each with a region in which it lies."""
    design, whole = model.plan.design, model.task.pivot_region
    assert design.graph.frame is not None
    every = [] if whole is None else [(joint, whole) for joint in design.joints_of(design.graph.frame)]
    return [*model.plan.regions, *every]


class Lengths:
    """Distances that are lengths: ``pairs`` of joints, first the ``sides`` of links, then arms of points.

    Points are numbers after the joints.  ``idling``: indices of arms without which other links would do nothing.
    """

    def __init__(self, model: Model) -> None:
        design, number = model.plan.design, model.joints
        self.pairs = [(int(p), int(q)) for p, q in design.sides]
        self.sides = len(self.pairs)
        self.idling: list[int] = []
        for name, of_point in model.task.names.items():
            if of_point:
                for k in design.joints_of(model.carrier(name)):
                    if design.kinds[k] == "R":
                        self.idling += [len(self.pairs)] if (name, k) in model.plan.idling else []
                        self.pairs.append((number, k))
                number += 1
        self.ends = np.array(self.pairs, dtype=np.intp).reshape(-1, 2)
        self.by = np.zeros((len(self.pairs), model.size, 2))  # of both coordinates of a distance, by the unknowns
        for k, pair in enumerate(self.pairs):
            for place, sign in zip(pair, (1.0, -1.0)):
                if (at := model.place_at(place)) >= 0:
                    self.by[k, at, 0] += sign
                    self.by[k, at + 1, 1] += sign

    def logarithms(self, u: Unknowns) -> tuple[Array, Array]:
        """Logarithms of lengths (sets, pairs) and their derivatives."""
        places = np.concatenate([u.places, u.points], axis=1)
        d = places[:, self.ends[:, 0]] - places[:, self.ends[:, 1]]
        square = np.maximum((d**2).sum(axis=2), 1e-24)
        part = d / square[..., None]
        return 0.5 * np.log(square), part[:, :, None, 0] * self.by[..., 0] + part[:, :, None, 1] * self.by[..., 1]


def _crank(model: Model, sides: list[tuple[int, int]]) -> int:
    """Index of the driven link's length; -1 if it has none."""
    driven = model.plan.design.drivers[0][1]
    own = {*model.plan.design.joints_of(driven)}
    return next((k for k, pair in enumerate(sides) if {*pair} <= own), -1)
