"""Many candidates of one plan at once: their unknowns, their motions, and their errors with exact derivatives.

Unknowns are places in the coordinates of the task, so that all targets, given pivots and bounds speak of the same
frame.  Theory: docs/explanation/embodiment.md, "Many targets at once".
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from graphsynth.design.task.plans import Plan
from graphsynth.design.task.task import DesignTask
from graphsynth.design.task.ties import ties
from graphsynth.kinematics.dimensional.matching import MovingLink, at_times
from graphsynth.kinematics.dimensional.sketch import layout
from graphsynth.kinematics.dimensional.transmission import group_forms, transmission_sines
from graphsynth.kinematics.engine.batch import simulate_batch
from graphsynth.kinematics.engine.gradients import revolute_dyads
from graphsynth.kinematics.simulation import simulate
from graphsynth.mechanism.laws import Driver, Linear
from graphsynth.mechanism.model import Mechanism
from graphsynth.structure.assur import decompose

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]
#: Samples of the range, and the gap after a turn that counts as closed.
_SAMPLES, _CLOSED = 60, 1e-6
#: Distance of a candidate from the origin, over its size, from which it is moved about its own middle.
_FAR = 3.0
#: More samples at the ends of a range that is no turn, over the step: dead centres are near, where motions are fast.
_ENDS = np.array([0.02, 0.1, 0.4])
#: Frames of links at rest, and rates that do no harm, for sets without a motion.
_REST, _SLOW = np.array([0.0, 0.0, 1.0, 0.0]), np.array([1.0, 0.0, 0.1])


#: Three joints, each on a link, with the angle in the middle.
Corner = tuple[tuple[int, int], tuple[int, int], tuple[int, int]]


class Rod(NamedTuple):
    """A link between two revolute joints, the second that of a block which slides along a guide on another link."""

    link: int
    far: int
    near: int
    guide: int
    slide: int


class Unknowns(NamedTuple):
    """Unknowns of candidates (sets, ...), read from their vectors.

    Places of all joints, directions of guides, places of named points: on every link in the frame that coincides with
    the fixed one at the start of the motion.  ``own``: what single targets add; ``stroke``: of a linear drive, else 1.
    """

    places: Array
    numbers: Array
    points: Array
    own: Array
    stroke: Array


class Moved(NamedTuple):
    """Motions: inputs (M,), frames (sets, M, links, 4), rates (sets, M, links, 3); something harmless if incomplete."""

    inputs: Array
    frames: Array
    rates: Array
    complete: Mask
    period: float

    def link(self, k: int) -> MovingLink:
        """Return the motion of one link, harmless where it is not complete."""
        return MovingLink(self.inputs, self.frames[:, :, k], self.rates[:, :, k], self.period)

    def at(self, times: Array) -> tuple[Array, Array]:
        """Return frames (sets, n, links, 4) and rates (sets, n, links, 3) at times (sets, n)."""
        return at_times(MovingLink(self.inputs, self.frames, self.rates, self.period), times)


class Picks(NamedTuple):
    """Numbers along a motion: at the sample ``low`` (sets, m) and a ``part`` of the way to the next one.

    ``way`` (sets, d, m): the direction in which each is measured.
    """

    low: NDArray[np.intp]
    part: Array
    way: Array

    def of(self, J: Array) -> Array:
        """Take derivatives (sets, d, n, size) at the samples to (sets, 1, m, size)."""
        row = np.arange(len(J))[:, None]
        found = np.zeros((*self.low.shape, J.shape[-1]))
        for d in range(J.shape[1]):
            for k, share in ((self.low, 1.0 - self.part), (self.low + 1, self.part)):
                found += (self.way[:, d] * share)[..., None] * J[row, d, k]
        return found[:, None]


class Rows(NamedTuple):
    """Numbers that shall vanish, sampled: values (sets, d, n), how they change with the poses and the unknowns.

    ``loads`` (sets, d, links, 3, n) by x, y, theta of every link, ``direct`` (sets, d, n, size) by the unknowns at
    unchanged poses.  ``free``: the times are found, so that along the motion nothing changes.  ``mix`` (m, n) makes
    m numbers of n samples; the values then are (sets, 1, m).  ``start``: the unknown that shifts the times.
    ``picks``: numbers along the motion, found from the samples; the values then are (sets, 1, m), too.
    """

    times: Array
    values: Array
    loads: Array
    direct: Array
    weight: float
    free: bool = False
    mix: Array | None = None
    start: int = -1
    picks: Picks | None = None


class Model:
    """Candidates of a plan for one sense of the drive and one choice of assembly modes.

    Both are drawn, the sense unless it is not 0, the modes unless a candidate is ``given``, whose modes are taken.
    """

    def __init__(
        self, task: DesignTask, plan: Plan, random: np.random.Generator, given: Unknowns | None = None, sense: int = 0
    ) -> None:
        self.task, self.plan = task, plan
        self.sense = sense or task.sense or int(random.choice([-1, 1]))
        self.ties = ties(task, plan)
        design = plan.design
        self.joints, self.links = len(design.kinds), design.graph.links
        self.names = list(task.names)
        self.fixed = {*design.joints_of(design.graph.frame or 0)}
        self.given = np.array([k for k, _ in plan.given], dtype=np.intp)
        # where a placement takes pivots: those given, those with regions to their middles
        self.held = np.array([k for k, _ in (*plan.given, *plan.regions)], dtype=np.intp)
        middles = [complex(x0 + x1, y0 + y1) / 2.0 for _, (x0, y0, x1, y1) in plan.regions]
        self.goals = np.array([*(complex(*p) for _, p in plan.given), *middles])
        tied = [] if plan.pins is None else [plan.pins[0]]
        self.free = np.setdiff1d(np.arange(self.joints), [*self.given, *tied])
        self.angles = [c for c, (k, _) in enumerate(design.numbers) if k not in tied]
        self.sketch = layout(design.graph).positions + random.normal(0.0, 0.12, (self.joints, 2))
        angles = random.uniform(0.0, math.pi, (1, len(design.numbers)))
        places, numbers = self.tied(self.sketch[None], angles) if given is None else (given.places, given.numbers)
        if plan.mirror:
            points = np.zeros((1, sum(task.names.values()), 2))
            places = self.kept(Unknowns(places, numbers, points, points[:, :0, 0], np.ones(1))).places
        base = design.mechanism(places[0], numbers[0])
        driver = Driver(*design.drivers[0], Linear(float(self.sense)))
        self.base = Mechanism(base.graph, base.joints, (driver,), pose=base.pose)
        rest = simulate(self.base, [0.0], events=False)
        self.regular = bool(rest.assembled[0])
        own = [s.group for s in rest.steps if s.group >= 0 and s.has_two_modes and rest.modes[0, s.group] != 0]
        signs = random.choice([-1, 1], len(own)) if given is None else rest.modes[0, own]
        if plan.mirror:
            links = {s.group: frozenset(s.links) for s in rest.steps if s.group in own}
            signs = rest.modes[0, own] * _alike(plan.mirror, [links[group] for group in own], signs)
        self.modes = {group: int(sign) for group, sign in zip(own, signs)}
        self.forms = [form for form in group_forms(self.base, rest.steps) if form.lines]
        self.rods = _rods(plan)
        self.corners = _corners(self.base, plan, [set(step.links) for step in rest.steps])
        # the vector of unknowns: places, directions, points, what targets add, stroke
        self.points_at = 2 * len(self.free) + len(self.angles)
        self.own_at = self.points_at + 2 * sum(task.names.values())
        self.stroke_at = self.own_at + sum(target.unknowns for target in task.targets)
        self.size = self.stroke_at + task.linear
        shared = [u for target in task.targets for u in target.shared_inputs]
        shared = np.mod(shared, task.span).tolist() if task.drive == "rotation" else shared
        ends = np.zeros(0) if task.drive == "rotation" else _ENDS * task.span / _SAMPLES
        order = np.sort(np.concatenate([np.linspace(0.0, task.span, _SAMPLES + 1), ends, task.span - ends, shared]))
        self.inputs = order[np.concatenate([[True], np.diff(order) > 1e-9])]

    # --- the vector

    def carrier(self, name: str) -> int:
        """Return the link of a named point or link."""
        return self.plan.carriers[self.names.index(name)]

    def point_at(self, name: str) -> int:
        """Return where the place of a named point begins in the vector."""
        before = self.names[: self.names.index(name)]
        return self.points_at + 2 * sum(self.task.names[n] for n in before)

    def column(self, joint: int) -> int:
        """Return where the place of a joint begins in the vector; -1 if it is given."""
        found = np.flatnonzero(self.free == joint)
        return 2 * int(found[0]) if len(found) else -1

    def angle_at(self, joint: int) -> int:
        """Return where the direction of a guide stands in the vector."""
        number = self.plan.design.numbers.index((joint, "angle"))
        return 2 * len(self.free) + self.angles.index(number)

    def free_places(self, X: Array) -> Array:
        """Return the places (sets, joints, 2) in vectors, and those that are given."""
        places = np.zeros((len(X), self.joints, 2))
        places[:, self.free] = X[:, : 2 * len(self.free)].reshape(len(X), -1, 2)
        places[:, self.given] = [p for _, p in self.plan.given] or np.zeros((0, 2))
        return places

    def read(self, X: Array) -> Unknowns:
        """Read vectors (sets, size)."""
        sets, count, places = len(X), 2 * len(self.free), self.free_places(X)
        numbers = np.zeros((sets, len(self.plan.design.numbers)))
        numbers[:, self.angles] = X[:, count : self.points_at]
        places, numbers = self.tied(places, numbers)
        points = X[:, self.points_at : self.own_at].reshape(sets, -1, 2)
        stroke = X[:, self.stroke_at] if self.task.linear else np.ones(sets)
        return self.kept(Unknowns(places, numbers, points, X[:, self.own_at : self.stroke_at], stroke))

    def kept(self, u: Unknowns) -> Unknowns:
        """Put the places that depend on others where they have to be."""
        every = np.concatenate([u.places, u.points], axis=1)
        for tie in self.ties:
            every = tie.kept(every)
        return u._replace(places=every[:, : self.joints], points=every[:, self.joints :]) if self.ties else u

    def through_ties(self, X: Array, slopes: Array) -> Array:
        """Return derivatives (sets, m, size) by the vector from those by the places that it gives."""
        if not self.ties:
            return slopes
        every = np.concatenate([self.free_places(X), X[:, self.points_at : self.own_at].reshape(len(X), -1, 2)], axis=1)
        steps = []
        for tie in self.ties:
            steps.append((tie, tie.slopes(every)))
            every = tie.kept(every)
        for tie, by in reversed(steps):
            at = self.place_at(tie.places[0])
            own = slopes[..., at : at + 2].copy()
            slopes[..., at : at + 2] = 0.0
            for k, place in enumerate(tie.places):
                if (to := self.place_at(place)) >= 0:
                    slopes[..., to : to + 2] += own @ by[:, :, k]
        return slopes

    def place_at(self, place: int) -> int:
        """Return where a joint, or a named point counted after the joints, begins in the vector; -1 if it is given."""
        return self.column(place) if place < self.joints else self.points_at + 2 * (place - self.joints)

    def write(self, u: Unknowns) -> Array:
        """Write vectors: the reverse of `read`."""
        sets = len(u.places)
        parts = [
            u.places[:, self.free],
            u.numbers[:, self.angles],
            u.points,
            u.own,
            u.stroke[:, None][:, : self.task.linear],
        ]
        return np.concatenate([part.reshape(sets, -1) for part in parts], axis=1)

    def tied(self, places: Array, numbers: Array) -> tuple[Array, Array]:
        """Put the guide of a cylinder on the line of its two ends."""
        if self.plan.pins is not None:
            own, first, second = self.plan.pins
            way = places[:, second] - places[:, first]
            places, numbers = places.copy(), numbers.copy()
            places[:, own] = places[:, first]
            column = self.plan.design.numbers.index((own, "angle"))
            numbers[:, column] = np.arctan2(way[:, 1], way[:, 0])
        return places, numbers

    # --- motions

    def move(self, u: Unknowns, more: Array | None = None) -> Moved:
        """Move candidates over the range, through further inputs, too, if they are given."""
        inputs = self.inputs
        if more is not None:
            around = self.task.drive == "rotation"
            more = np.mod(more, self.task.span) if around else np.clip(more, 0.0, self.task.span)
            inputs = np.sort(np.concatenate([inputs, more]))
            inputs = inputs[np.concatenate([[True], np.diff(inputs) > 1e-12])]
        scale = u.stroke[:, None, None]
        centre = self.centre(u)
        table = self.plan.design.dimensions((u.places - centre[:, None]) / scale, u.numbers)
        motion = simulate_batch(self.base, inputs, table, modes=self.modes, rates=True)
        complete = motion.completed.copy()
        period = self.task.span if self.task.drive == "rotation" else 0.0
        if period:
            with np.errstate(invalid="ignore"):
                complete &= np.abs(motion.frames[:, -1] - motion.frames[:, 0]).max(axis=(1, 2)) < _CLOSED
        frames, rates = np.ascontiguousarray(motion.frames), motion.velocities
        frames[..., :2] *= scale[..., None]
        rates[..., :2] *= scale[..., None]
        if centre.any():
            turned = turned_with(frames, centre)
            frames[..., :2] += centre[:, None, None] - turned
            rates[..., :2] -= rates[..., 2:] * turned[..., ::-1] * [-1.0, 1.0]
        complete &= np.isfinite(rates).all(axis=(1, 2, 3))
        frames[~complete], rates[~complete] = _REST, _SLOW
        return Moved(inputs, frames, rates, complete, period)

    def centre(self, u: Unknowns) -> Array:
        """Return where links have their frames while they move (sets, 2): no step is long only because one turns."""
        middle, wide = u.places.mean(axis=1), np.ptp(u.places, axis=1).max(axis=1)
        return np.where((np.hypot(*middle.T) > _FAR * wide)[:, None], middle, 0.0)

    def untransmitted(self, X: Array) -> Array:
        """Return what groups larger than dyads lack of the transmission angle (sets,), in hundredths of its sine."""
        least = math.sin(self.task.transmission)
        if not self.forms or not len(X) or least == 0.0:
            return np.zeros(len(X))
        u = self.read(X)
        table = self.plan.design.dimensions(u.places / u.stroke[:, None, None], u.numbers)
        frames = self.move(u).frames
        frames[..., :2] /= u.stroke[:, None, None, None]
        forms = [form._replace(group=k) for k, form in enumerate(self.forms)]
        ends = [(joint.a, joint.b) for joint in self.plan.design.graph.joints]
        margins = np.zeros((*frames.shape[:2], len(forms)))
        sines = transmission_sines(forms, table, ends, frames, margins).min(axis=(1, 2))
        weight = 100.0 * self.task.soft.get("transmission", 1.0)
        return np.asarray(weight * np.maximum(least - np.nan_to_num(sines), 0.0))


def turned_with(frames: Array, centre: Array) -> Array:
    """Return the places of centres (sets, 2) on links, turned with their frames (sets, n, links, 4)."""
    (x, y), c, s = centre.T[:, :, None, None], frames[..., 2], frames[..., 3]
    return np.stack([c * x - s * y, s * x + c * y], axis=-1)


def _alike(mirror: tuple[int, ...], groups: list[frozenset[int]], signs: NDArray[Any]) -> NDArray[Any]:
    """Return signs of groups of links in which a group and its image have the same one."""
    seen = [groups.index(frozenset(mirror[link] for link in group)) for group in groups]
    return np.array([signs[min(k, image)] for k, image in enumerate(seen)])


def _rods(plan: Plan) -> list[Rod]:
    """Return the rods of dyads with a slide that is guided by a link before them."""
    design, found = plan.design, []
    placed = {design.graph.frame or 0}.union(*design.drivers)
    for group in decompose(design.graph, design.drivers).groups:
        own = {*group.links}
        joints = [
            (k, {a, b}) for k, (a, b, _) in enumerate(design.graph.joints) if {a, b} & own and {a, b} <= own | placed
        ]
        placed |= own
        inner = [k for k, pair in joints if pair == own]
        turning = [(k, pair) for k, pair in joints if pair != own and design.kinds[k] == "R"]
        sliding = [(k, pair) for k, pair in joints if pair != own and design.kinds[k] == "P"]
        if len(own) == 2 and len(joints) == 3 and len(sliding) == 1 and design.kinds[inner[0]] == "R":
            ((far, ends),), ((slide, pair),) = turning, sliding
            (link,), (guide,) = ends & own, pair - own
            found.append(Rod(link, far, inner[0], guide, slide))
    return found


def _corners(base: Mechanism, plan: Plan, groups: list[set[int]]) -> list[Corner]:
    """Return three joints, each with a link, between which motion is transmitted: of dyads, of a cylinder's lever."""
    found = [((A, p), (B, p), (C, q)) for p, q, A, B, C in revolute_dyads(base)]
    if plan.pins is None:
        return found
    joints, pushed = base.joints, {*plan.design.drivers[0]}
    group = next(own for own in groups if pushed <= own)
    for far, near in (plan.pins[1:], plan.pins[:0:-1]):
        (lever,) = {*joints[near].pair} - pushed
        other = next(iter({*joints[far].pair} - pushed))
        if group == pushed | {lever}:  # else a larger group, whose transmission is judged at the end
            pivots = [k for k in plan.design.joints_of(lever) if k != near and not {*joints[k].pair} <= group]
            found.append(((far, other), (near, lever), (pivots[0], lever)))
    return found
