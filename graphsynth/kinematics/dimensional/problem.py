"""The search problem: a vector of unknowns per candidate, and what it costs."""

from __future__ import annotations

import cmath
import math
from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from graphsynth.kinematics.dimensional.design import Design, World
from graphsynth.kinematics.dimensional.goals import (
    FunctionFit,
    FunctionGoal,
    Goals,
    LineFit,
    LineGoal,
    PathFit,
    Placed,
    Sampled,
    TargetFit,
    target_link,
)
from graphsynth.kinematics.dimensional.matching import MovingLink, at_times, matched
from graphsynth.kinematics.dimensional.mirror import axis_joints, kept
from graphsynth.kinematics.dimensional.sketch import layout
from graphsynth.kinematics.dimensional.transmission import group_forms, transmission_sines
from graphsynth.kinematics.engine.batch import simulate_batch
from graphsynth.kinematics.engine.gradients import revolute_dyads
from graphsynth.kinematics.simulation import simulate
from graphsynth.mechanism.laws import Driver, Linear
from graphsynth.mechanism.model import Mechanism, TracePoint

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]

#: Cost of a candidate that does not complete its range; below it every candidate is complete.
INCOMPLETE = 100.0
#: Cost from which a bound is violated.
OUTSIDE = 10.0
_CLOSED = 1e-6
#: Logarithms of a cam's radius, in mean lengths of the sketch, and of a mechanism's size beside its cams' profiles.
_SIZES, _BESIDE = (math.log(0.2), math.log(5.0)), (math.log(0.5), math.log(3.0))
#: The sine of the transmission angle is asked for with this factor: its least value lies between samples.
_SPARE = 1.002


class Evaluated(NamedTuple):
    """Candidates evaluated: cost, merit of the bounds (1 or more: kept), errors of the target, and what was moved.

    ``frames0`` holds (x, y, cos, sin) of every link at the first input; ``placed`` the placement by the target.
    """

    cost: Array
    merit: Array
    errors: Complex
    dimensions: Array
    frames0: Array
    placed: Placed | None


class DimensionProblem:
    """Candidates for one design under given goals, from one sketch.

    ``random`` shifts the sketch, so that repeated problems start from different ones.  Variant 0 has the assembly modes
    of the sketch, and drivers turn left.  With a target other curves matter too: bit 0 turns the drivers the other way,
    bit k the mode of dyad k - 1 (only of mechanisms of dyads, which need no start pose).  ``begin``, places and further
    numbers, takes the place of the sketch.
    """

    def __init__(
        self,
        design: Design,
        goals: Goals,
        random: np.random.Generator,
        variant: int = 0,
        begin: tuple[Array, Array] | None = None,
    ) -> None:
        self.design, self.goals, self.sense = design, goals, -1 if variant & 1 else 1
        self.rates = [self.sense * rate for rate in goals.rates or [1.0] * len(design.drivers)]
        self.fit: TargetFit | None = None
        if isinstance(goals.target, LineGoal):
            self.fit = LineFit(goals.target)
        elif isinstance(goals.target, FunctionGoal):
            self.fit = FunctionFit(goals.target)
        elif goals.target is not None:
            self.fit = PathFit(goals.target)
        self.link = target_link(design, goals.target) if goals.target is not None else -1
        self.ends = [(joint.a, joint.b) for joint in design.graph.joints]
        images = [k for orbit in design.orbits for k in (orbit[1:] or orbit[design.mirrored :])]
        if design.mirrored:  # the image of the crank's pin tells the axis
            images.remove(axis_joints(design, design.symmetry)[2])
        self.free = np.setdiff1d(np.arange(len(self.ends)), [*design.held, *design.centres, *images])
        self.extras = 0 if self.fit is None else len(self.fit.ranges)
        self.size = 2 * len(self.free) + len(design.numbers) + self.extras
        if begin is None:
            self.sketch = self._sketch(random)
            angles = random.uniform(0.0, math.pi, len(design.numbers))
            numbers = np.where([name != "size" for _, name in design.numbers], angles, 0.0)
            self.numbers = kept(design, self.sketch[None], numbers[None])[1][0]
        else:
            self.sketch, self.numbers = begin
        base = design.mechanism(self.sketch, self.numbers)
        self.base = Mechanism(
            base.graph,
            base.joints,
            tuple(Driver(*pair, Linear(rate)) for pair, rate in zip(design.drivers, self.rates, strict=True)),
            pose=base.pose,
        )
        at_rest = simulate(self.base, [0.0], events=False)
        self.forms = group_forms(self.base, at_rest.steps)
        self.regular = bool(at_rest.assembled[0])
        self.modes = {
            step.group: int(at_rest.modes[0, step.group])
            for step in at_rest.steps
            if step.group >= 0 and step.has_two_modes and at_rest.modes[0, step.group] != 0
        }
        self.iterative = any(step.iterative for step in at_rest.steps)
        if not self.iterative:
            flips = variant >> 1
            self.modes = {
                group: -mode if flips >> k & 1 else mode for k, (group, mode) in enumerate(self.modes.items())
            }
        self.dyads = revolute_dyads(self.base)
        self.evaluations = 0
        # uniform samples over the range, and the inputs of the target among them
        own = np.zeros(0) if self.fit is None else self.fit.inputs
        order = np.sort(np.concatenate([np.linspace(0.0, goals.span, (96 if self.iterative else 48) + 1), own]))
        self.inputs = order[np.concatenate([[True], np.diff(order) > 1e-9])]
        self.at_target = np.abs(self.inputs[None] - own[:, None]).argmin(axis=1)

    def _sketch(self, random: np.random.Generator) -> Array:
        """Places of the automatic sketch, shifted a little, with the driven links shrunk to cranks."""
        places = layout(self.design.graph).positions.copy()
        places += random.normal(0.0, 0.12, places.shape)
        places = self.design.with_cranks(places[None], np.full((len(self.design.cranks), 1), 0.3))
        found, _ = kept(self.design, places, np.zeros((1, len(self.design.numbers))))
        return np.asarray(found[0])

    # --- from vectors to motions

    def decode(self, X: Array) -> tuple[Array, Array, Array]:
        """Places (sets, joints, 2), further numbers and extras of vectors (sets, size)."""
        count, numbers = 2 * len(self.free), len(self.design.numbers)
        places = np.repeat(self.sketch[None], len(X), axis=0)
        places[:, self.free] = X[:, :count].reshape(len(X), -1, 2)
        return *kept(self.design, places, X[:, count : count + numbers]), X[:, count + numbers :]

    def bounds(self) -> Array:
        """Box of the search, shape (size, 2)."""
        middle = self.sketch.mean(axis=0)
        reach = 1.5 * float(np.abs(self.sketch - middle).max())
        if self.fit is not None:
            reach = max(reach, self.goals.max_length_ratio)
        if len(self.design.held) < len(self.design.fixed):
            reach *= math.exp(_BESIDE[1])
        box = [(middle[k % 2] - reach, middle[k % 2] + reach) for k in range(2 * len(self.free))]
        box += [_SIZES if name == "size" else (-math.pi, 2.0 * math.pi) for _, name in self.design.numbers]
        return np.array([*box, *([] if self.fit is None else self.fit.ranges.tolist())]).reshape(-1, 2)

    def population(self, count: int, random: np.random.Generator) -> Array:
        """Vectors near the sketch: everything shaken, cranks of many sizes; targets also far from it."""
        wide = np.zeros((count, 1, 1)) if self.fit is None else random.choice([0.0, 0.0, 1.0], (count, 1, 1))
        places = np.repeat(self.sketch[None], count, axis=0)
        places += random.normal(0.0, 1.0, places.shape) * (random.uniform(0.0, 0.35, (count, 1, 1)) + wide)
        if len(self.design.held) < len(self.design.fixed):  # smaller and larger beside its cams
            places *= np.exp(random.uniform(*_BESIDE, (count, 1, 1)))
        places[:, self.design.held] = self.sketch[list(self.design.held)]
        sizes = random.uniform(math.log(0.15), math.log(2.0), (len(self.design.cranks), count))
        places = self.design.with_cranks(places, np.exp(sizes))
        numbers = self.numbers + random.normal(0.0, 0.5, (count, len(self.numbers)))
        box = self.bounds()
        ranges = box[len(box) - self.extras :]
        extras = random.uniform(ranges[:, 0], ranges[:, 1], (count, self.extras))
        X = np.concatenate([places[:, self.free].reshape(count, -1), numbers, extras], axis=1)
        return np.asarray(np.clip(X, box[:, 0], box[:, 1]))

    def evaluate(self, X: Array) -> Evaluated:
        """Move candidates (sets, size) and judge them."""
        places, numbers, extras = self.decode(X)
        dimensions = self.design.dimensions(places, numbers)
        self.evaluations += len(X)
        rates = self.fit is not None and self.fit.warped
        motion = simulate_batch(self.base, self.inputs, dimensions, modes=self.modes, rates=rates)
        sines = transmission_sines(self.forms, dimensions, self.ends, motion.frames, motion.margins)
        complete = motion.completed
        with np.errstate(invalid="ignore"):
            if self.goals.full_turn:
                complete &= np.abs(motion.frames[:, -1] - motion.frames[:, 0]).max(axis=(1, 2)) < _CLOSED
            least = np.where(complete, _least(sines, self.goals.full_turn), 0.0)
        sides = self.design.sides
        d = places[:, sides[:, 0]] - places[:, sides[:, 1]]
        lengths = np.hypot(d[..., 0], d[..., 1])
        shortest = np.maximum(lengths.min(axis=1, initial=np.inf), 1e-12)
        ratio = lengths.max(axis=1) / shortest if lengths.shape[1] else np.ones(len(places))
        errors, placed = np.zeros((len(X), 1), dtype=np.complex128), None
        if self.fit is not None:
            errors, placed, arms = self._error(motion.frames, motion.velocities, extras, places, complete)
            ratio = np.maximum(ratio, arms / shortest)
        error = np.abs(errors).max(axis=1)
        goal = max(_SPARE * math.sin(self.goals.min_transmission_angle), 1e-3)
        merit = np.minimum(least / goal, self.goals.max_length_ratio / ratio)
        cost = -merit if self.fit is None else np.where(merit >= 1.0, error, OUTSIDE - merit)
        reached = motion.reached / len(self.inputs)
        cost = np.where(complete, cost, INCOMPLETE - 10.0 * reached)
        return Evaluated(cost, np.where(complete, merit, 0.0), errors, dimensions, motion.frames[:, 0], placed)

    def samples(self, frames: Array, rates: Array, complete: NDArray[np.bool_]) -> MovingLink:
        """Motion of the target's link in every set; of sets that do not complete the range something harmless."""
        own = np.where(complete[:, None, None], frames[:, :, self.link], [0.0, 0.0, 1.0, 0.0])
        moved = np.where(complete[:, None, None], rates[:, :, self.link], [1.0, 0.0, 0.1])
        return MovingLink(self.inputs, own, moved, self.goals.span if self.goals.full_turn else 0.0)

    def crank(self, places: Array) -> Array:
        """Length of the first driven link: from its driven joint to its first other joint."""
        joint = self.design.driver_joints[0]
        others = [k for k in self.design.joints_of(self.design.drivers[0][1]) if k != joint]
        if not others:  # a wheel: all it carries are teeth
            return np.ones(len(places))
        other = others[0]
        d = places[:, joint] - places[:, other]
        return np.asarray(np.hypot(d[:, 0], d[:, 1]))

    def _error(
        self, frames: Array, velocities: Array, extras: Array, places: Array, complete: NDArray[np.bool_]
    ) -> tuple[Complex, Placed, Array]:
        """Errors of the target, its placement, and the longest arm of the tracing point."""
        assert self.fit is not None
        own = frames[:, :, self.link]
        # origin and direction of the link at the sketch pose: its first joint, towards its second
        joints = self.design.joints_of(self.link)
        first, second = (joints * 2)[:2]
        bar = (places[:, second] - places[:, first]) @ [1.0, 1.0j]
        size = np.abs(bar)
        along = np.where(size > 0.0, bar / np.maximum(size, 1e-300), 1.0)
        origin = places[:, first, 0] + 1j * places[:, first, 1]
        w = own[..., 2] + 1j * own[..., 3]
        z, w = own[..., 0] + 1j * own[..., 1] + w * origin[:, None], w * along[:, None]
        angle = np.unwrap(np.nan_to_num(np.angle(w)), axis=1) if self.fit.angular else np.zeros(w.shape)
        if isinstance(self.fit, PathFit) and self.fit.warped:
            seen = self.samples(frames, velocities, complete)
            at, _ = at_times(seen, matched(seen, self.fit.wanted))
            w = at[..., 2] + 1j * at[..., 3]
            sampled = Sampled(at[..., 0] + 1j * at[..., 1] + w * origin[:, None], w * along[:, None], np.angle(w))
        else:
            sampled = Sampled(z[:, self.at_target], w[:, self.at_target], angle[:, self.at_target])
        filler = np.exp(0.1j * np.arange(sampled.z.shape[1]))
        keep = complete[:, None]
        sampled = Sampled(
            np.where(keep, sampled.z, filler**2), np.where(keep, sampled.w, filler), np.where(keep, sampled.angle, 0.0)
        )
        errors, found = self.fit.errors(sampled, extras, self.crank(places))
        placed = Placed(found.s, found.s * origin + found.q * along, found.t)
        with np.errstate(divide="ignore", invalid="ignore"):
            point = placed.q / placed.s
        arms = np.abs(places[:, joints, 0] + 1j * places[:, joints, 1] - point[:, None]).max(axis=1)
        return errors, placed, np.nan_to_num(arms, nan=1e12, posinf=1e12)


def _least(sines: Array, periodic: bool) -> Array:
    """Smallest value by set, shape (sets,), with the parabola through the smallest sample and its neighbours."""
    n, groups = sines.shape[1:]
    if not groups or n < 3:
        return np.asarray(sines.min(axis=(1, 2), initial=1.0))
    k = np.nan_to_num(sines, nan=2.0).argmin(axis=1)
    last = n - 1  # the same pose as sample 0 after a full turn
    low = np.where(k == 0, last - 1 if periodic else 0, k - 1)
    high = np.where(k == last, 1 if periodic else last, k + 1)
    y0, y1, y2 = (np.take_along_axis(sines, at[:, None], axis=1)[:, 0] for at in (low, k, high))
    bend = y0 - 2.0 * y1 + y2
    drop = np.where(bend > 0.0, (y0 - y2) ** 2 / (8.0 * np.where(bend > 0.0, bend, 1.0)), 0.0)
    return np.asarray((y1 - drop).min(axis=1))


# --- from a vector to a mechanism a designer can read: own frame of every link, pose at the first input


def dimensioned(problem: DimensionProblem, x: Array) -> Mechanism | None:
    """Return the mechanism of a vector, or None if it has no pose at the first input.

    Every moving link's frame has its origin in the link's first joint and its x axis towards the second.  The fixed
    frame is that of the target's coordinates; without such, its origin is the driven joint and another joint of the
    frame lies on its x axis.  The law of a turning driver begins at the angle of the crank, so that inputs begin at 0.
    """
    outcome = problem.evaluate(x[None])
    frames = outcome.frames0[0]
    if not np.isfinite(frames).all():
        return None
    s, q, t = 1.0 + 0j, 0j, 0j
    if outcome.placed is not None:
        s, q, t = (complex(part[0]) for part in outcome.placed)
    design, table = problem.design, outcome.dimensions[0]
    point_at = frames[problem.link, 0] + 1j * frames[problem.link, 1]
    point_at += q / s * (frames[problem.link, 2] + 1j * frames[problem.link, 3])
    if problem.fit is None or not problem.fit.placed:
        s, t = _placement(problem, frames, table)
    world = [
        carried(World.read(row), frames[joint.a], frames[joint.b], (s, t))
        for joint, row in zip(design.graph.joints, table)
    ]
    points = {} if problem.fit is None else {"P": (problem.link, s * point_at + t)}
    return lying(design, world, points, *problem.rates)


def lying(design: Design, world: list[World], points: Mapping[str, tuple[int, complex]], *rates: float) -> Mechanism:
    """Return the mechanism whose joints and named points (link, place) lie at some places at the first input.

    ``rates``: of every driver over the input.  The law of a driver that turns begins at the angle of its links' frames,
    so that inputs begin at 0.
    """
    own = [own_frame(design, link, world) for link in range(design.graph.links)]
    named: dict[str, TracePoint] = {}
    for name, (link, place) in points.items():
        origin, angle = own[link]
        local = (place - origin) * cmath.exp(-1j * angle)
        named[name] = TracePoint(link, (local.real, local.imag))
    drivers = tuple(
        Driver(b, k, Linear(rate, own[k][1] - own[b][1] if design.kinds[j] == "R" else 0.0))
        for (b, k), j, rate in zip(design.drivers, design.driver_joints, rates, strict=True)
    )
    pose = tuple((z.real, z.imag, angle) for z, angle in own)
    return Mechanism(design.graph, design.joints(world, own), drivers, named, pose)


def carried(at: World, frame_a: Array, frame_b: Array, by: tuple[complex, complex]) -> World:
    """Return where a joint lies at the first input, multiplied and moved: frames are x, y, cos, sin of its links."""
    (s, t), turn = by, cmath.phase(complex(frame_a[2], frame_a[3]) * by[0])
    A, B = (s * (complex(x, y) + complex(c, z) * p) + t for (x, y, c, z), p in ((frame_a, at.A), (frame_b, at.B)))
    return World(A, B, at.direction + turn, (abs(s) * at.radii[0], abs(s) * at.radii[1]))


def _world(frames: Array, link: int, local: Array) -> complex:
    x, y, c, s = frames[link]
    return complex(x, y) + complex(c, s) * complex(local[0], local[1])


def _placement(problem: DimensionProblem, frames: Array, table: Array) -> tuple[complex, complex]:
    """Origin in the driven joint, the other fixed joint on the x axis, upright; a line goal has a crank of length 1."""
    graph = problem.design.graph
    z = [_world(frames, graph.joints[k].a, table[k, 0:2]) for k in problem.design.fixed]
    if len(z) < 2 or z[1] == z[0]:
        return 1.0 + 0j, 0j
    s = abs(z[1] - z[0]) / (z[1] - z[0])
    upright = problem.sketch[list(problem.design.fixed)]
    if problem.fit is None and upright[1, 0] < upright[0, 0]:
        s = -s  # as in the sketch, with the frame below
    if problem.fit is not None and isinstance(problem.goals.target, LineGoal):
        s = s / float(problem.crank(table[None, :, 0:2])[0])
    return s, -s * z[0]


def own_frame(design: Design, link: int, world: list[World]) -> tuple[complex, float]:
    """Origin and angle of a link's own frame at the first input."""
    if link == design.graph.frame:
        return 0j, 0.0
    joints = design.joints_of(link)
    driven = [k for k in joints if k in design.driver_joints]
    joints = sorted(joints, key=lambda k: (k not in driven, design.kinds[k] != "R", k))
    z = [world[k].A for k in joints]
    far = [p for p in z[1:] if abs(p - z[0]) > 0.0]
    return z[0], cmath.phase(far[0] - z[0]) if far else 0.0
