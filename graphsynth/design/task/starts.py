"""First candidates: many random ones, placed where they suit the targets best; the best of these go on.

A start from elsewhere (an index of curves, a closed form) is a mechanism with a pose: see `from_mechanism`.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from itertools import islice, permutations
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from graphsynth.core.errors import GeometryError
from graphsynth.design.curves.index import CurveIndex
from graphsynth.design.curves.matches import CurveMatch
from graphsynth.design.task.aims import FunctionAim, PointAim, TimedAim
from graphsynth.design.task.classical import solutions
from graphsynth.design.task.model import Model, Moved, Unknowns
from graphsynth.design.task.plans import Plan, fitting
from graphsynth.design.task.problem import TaskProblem
from graphsynth.design.task.targets import PathTarget
from graphsynth.design.task.task import DesignTask
from graphsynth.design.task.ties import axis_joint
from graphsynth.kinematics.dimensional.design import Design
from graphsynth.kinematics.dimensional.matching import MovingLink, Wanted
from graphsynth.kinematics.engine.batch import simulate_batch
from graphsynth.mechanism.joints import Prismatic
from graphsynth.mechanism.model import Mechanism

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]
#: Parts of a curve in which an open path is looked for, from so many of its points; points compared.
_PARTS, _PHASES, _COMPARED = (0.12, 0.2, 0.3, 0.45, 0.65, 0.9), 32, 14
#: Weight of given pivots when a start is placed; points tried on each link; sets looked at together.
_HELD, _TRIED, _TOGETHER = 30.0, 2, 128
#: One of so many random candidates has one joint far away, up to so many times: long links are nearly guides.
_STRETCHED, _FAR = 3, 30.0
#: One of so many has the driven link in a four-bar that nearly folds, with a coupler so much longer than the crank.
_FOLDING, _LONGER = 6, (1e-3, 0.1)
#: Matches of an index for every one that is wanted within a range; by how much the range may be too short; samples.
_RANGES, _SLACK, _STEPS = 6, 0.03, 60
#: Fewest points with even times over a turn that tell a curve of an index.
_EVENLY = 8


class Starts(Protocol):
    """Where a search may begin besides chance: mechanisms with a pose that carry the named points of the task."""

    def __call__(self, task: DesignTask) -> Iterable[Mechanism]:
        """Yield mechanisms in any place and size, the most promising first."""
        ...


def index_starts(index: CurveIndex, count: int = 32) -> Starts:
    """Begin a search with the mechanisms of an index whose curves are nearest to a path.

    It is the first one without times, or with even times over a turn.

    Parameters
    ----------
    index : CurveIndex
    count : int
        Mechanisms at most.

    Returns
    -------
    Starts
        For the argument ``starts`` of `graphsynth.design.design`.

    Examples
    --------
    >>> from graphsynth.design.task.targets import SwingTarget
    >>> index_starts(None)(DesignTask(targets=[SwingTarget(least=1.0)]))
    []
    """

    def starts(task: DesignTask) -> list[Mechanism]:
        path = next((t for t in task.targets if isinstance(t, PathTarget) and (t.inputs is None or _round(t))), None)
        if path is None:
            return []

        def fits(design: Design) -> bool:
            turns, sliders = design.kinds[design.driver_joints[0]] == "R", design.kinds.count("P")
            few = sliders <= task.sliders + (not turns) and design.graph.links in task.links
            good = few and turns == (task.drive in ("rotation", "rocking"))
            return good and (design.dyadic or not task.dyads_only)

        rocking = task.drive == "rocking"
        most = (1.0 + _SLACK) * task.span if rocking else math.inf
        wanted = _RANGES * count if rocking else count
        timed = path.inputs is not None
        closed = timed or path.closed or (not rocking and path.points[0] == path.points[-1])
        every = index.find(_pairs(path.goal), wanted, closed=closed, timed=timed, only=fits, within=most)
        begun = (within(match, task.span) if rocking else match.mechanism for match in every)
        return [
            Mechanism(m.graph, m.joints, m.drivers, {path.point: m.points["P"]}, m.pose)
            for m in islice((m for m in begun if m is not None), count)
        ]

    return starts


def _round(path: PathTarget) -> bool:
    """Whether the times of a path are even, over a turn."""
    steps = np.diff(path.inputs or (0.0,))
    return len(steps) + 1 >= _EVENLY and bool(np.abs(steps - math.tau / (len(steps) + 1)).max() < 1e-9)


def within(match: CurveMatch, span: float) -> Mechanism | None:
    """Return the mechanism of a match so that a range holds its curve; None if it does not go so far, or too far.

    The range begins with the curve if it can, else as much earlier as it has to.
    """
    own, spare = match.mechanism, span - match.start.span
    if spare < -_SLACK * span:
        return None
    for early in (0.0, 0.5 * spare, spare) if spare > 0.0 else (0.0,):
        ahead, back = (_driven(own, end) for end in (span - early, -early))
        if ahead is not None and back is not None:
            return Mechanism(own.graph, own.joints, own.drivers, own.points, tuple(map(tuple, back.tolist())))
    return None


def _driven(mechanism: Mechanism, end: float) -> Array | None:
    """Return the poses (links, 3) at an input, where the motion from its pose at 0 goes so far."""
    if end == 0.0:
        assert mechanism.pose is not None
        return np.array(mechanism.pose)
    inputs = np.linspace(0.0, end, _STEPS)
    motion = simulate_batch(mechanism, inputs, mechanism.dimensions[None], rates=False)
    return np.asarray(motion.poses[0, -1]) if motion.completed[0] else None


def planned(task: DesignTask, starts: Starts | None, seconds: float) -> Iterator[tuple[Plan, Mechanism]]:
    """Yield mechanisms to begin with, solutions of classical problems first, each with every plan it fits."""
    if task.mirrored:
        return  # others are not
    for mechanism in (*solutions(task, seconds), *(starts(task) if starts is not None else ())):
        if task.sense and task.sense * float(mechanism.drivers[0].law(np.zeros(1))[1][0]) < 0.0:
            continue
        kinds = tuple(joint.kind for joint in mechanism.joints)
        driver = mechanism.drivers[0].pair
        design = Design(mechanism.graph, (driver,), kinds)
        named = [mechanism.points[name].link if name in mechanism.points else None for name in task.names]
        for plan in fitting(task, design):
            if all(link in (None, carrier) for link, carrier in zip(named, plan.carriers)):
                yield plan, mechanism


def random_starts(model: Model, count: int, random: np.random.Generator) -> Unknowns:
    """Return candidates near the sketch and far from it, driven links of many sizes, some with a joint far away.

    Some nearly fold: their couplers turn against the crank, almost as in Cardan's motion, which chance does not meet.
    """
    design = model.plan.design
    wide = random.choice([0.0, 0.0, 1.0], (count, 1, 1))
    places = model.sketch + random.normal(0.0, 1.0, (count, *model.sketch.shape)) * (
        random.uniform(0.0, 0.4, (count, 1, 1)) + wide
    )
    if model.task.drive == "rotation":
        sizes = random.uniform(math.log(0.12), math.log(2.0), (len(design.cranks), count))
        places = design.with_cranks(places, np.exp(sizes))
    some, away = np.arange(count // _STRETCHED), random.integers(model.joints, size=count // _STRETCHED)
    middle = places[some].mean(axis=1)
    factor = np.exp(random.uniform(0.0, math.log(_FAR), (len(some), 1)))
    places[some, away] = middle + factor * (places[some, away] - middle)
    numbers = random.uniform(0.0, math.pi, (count, len(design.numbers)))
    stroke = np.exp(random.uniform(math.log(0.3), math.log(2.0), count)) if model.task.linear else np.ones(count)
    points = np.zeros((count, sum(model.task.names.values()), 2))
    for k, name in enumerate(name for name, of_point in model.task.names.items() if of_point):
        own = design.joints_of(model.carrier(name))
        points[:, k] = places[:, own].mean(axis=1) + random.normal(0.0, 1.0, (count, 2))
    free = np.zeros((count, model.stroke_at - model.own_at))
    u = model.kept(Unknowns(*model.tied(places, numbers), points, free, stroke))
    loop = _four_bar(design)
    if loop is not None:
        last = slice(count - count // _FOLDING, count)
        longer = np.exp(random.uniform(math.log(_LONGER[0]), math.log(_LONGER[1]), count // _FOLDING))
        u.places[last, loop[2]] = _mirrored(u.places[last][:, loop], 1.0 + longer)
        u = model.kept(u)
    return u


def _four_bar(design: Design) -> tuple[int, ...] | None:
    """Return the four joints that turn of a four-bar with the driven link, in their order; None if there is none."""
    joints = {frozenset(pair[:2]): k for k, pair in enumerate(design.graph.joints) if design.kinds[k] == "R"}
    frame, driven = design.drivers[0]
    for a, b in permutations({*range(design.graph.links)} - {frame, driven}, 2):
        loop = [joints.get(frozenset(pair), -1) for pair in ((frame, driven), (driven, a), (a, b), (b, frame))]
        if min(loop) >= 0:
            return tuple(loop)
    return None


def _mirrored(loop: Array, longer: Array) -> Array:
    """Return the joint of coupler and follower (sets, 2) where the four joints (sets, 4, 2) are nearly a kite.

    It is the mirror image of the crank's pivot in the line of the two other joints, its coupler longer than the crank.
    """
    pivot, pin, _, far = np.moveaxis(loop @ [1.0, 1.0j], 1, 0)
    along = (far - pin) / np.abs(far - pin)
    return _pairs(pin + longer * along**2 * np.conj(pivot - pin))


def placed_starts(
    problem: TaskProblem, u: Unknowns, keep: int, random: np.random.Generator
) -> tuple[Array, list[Array]]:
    """Place candidates where they suit the first path or poses best; return the best as vectors, and times."""
    model = problem.model
    moved = model.move(u)
    whole = np.flatnonzero(moved.complete)
    u, moved = _some(u, whole), _moved(moved, whole)
    first = next((aim for aim in problem.aims if isinstance(aim, PointAim)), None)
    held, goals = u.places[:, model.held, 0] + 1j * u.places[:, model.held, 1], model.goals
    if not len(whole):
        return np.zeros((0, model.size)), []
    late = np.zeros(len(whole), dtype=np.intp)
    if first is None:
        s, t = _similar(held, goals, model.task.size, len(whole), random)
        error, times, q = np.zeros(len(whole)), None, u.points[:, :1, 0] * 0j
        function = next((aim for aim in problem.aims if isinstance(aim, FunctionAim)), None)
        if function is not None:
            every = function.missed(moved, u)
            late, error = (every.argmin(axis=1) if _begins_late(model, function) else late), every.min(axis=1)
    else:
        error, times, c = _screened(model, first, moved, u, held, goals, random)
        s, q, t = c[:, :1], c[:, 1:2], c[:, 2:]
        if first.inputs is not None and _begins_late(model, first):
            late = np.abs(moved.inputs - (times[:, :1] - first.inputs[0])).argmin(axis=1)
            z0, w0 = moved.frames[np.arange(len(late)), late, first.link].view(np.complex128).T[..., None]
            q = s * z0 + q * w0
    u = _posed(model, u, moved, late)
    order = np.argsort(error, kind="stable")[:keep]
    order = order[np.isfinite(error[order])]
    if not len(order):
        return np.zeros((0, model.size)), []
    u, s, t, q = _some(u, order), s[order], t[order], q[order]
    z = u.places[..., 0] + 1j * u.places[..., 1]
    p = u.points[..., 0] + 1j * u.points[..., 1]
    p = s * p + t
    if first is not None:
        k = (first.point - model.points_at) // 2
        p[:, k : k + 1] = q + t
    place = s * z + t
    if len(goals):
        place[:, model.given] = goals[: len(model.given)]
    for joint, (x0, y0, x1, y1) in model.plan.regions:
        place[:, joint] = np.clip(place[:, joint].real, x0, x1) + 1j * np.clip(place[:, joint].imag, y0, y1)
    numbers = u.numbers + np.angle(s)
    u = Unknowns(
        _pairs(place), numbers, _pairs(p), u.own, u.stroke * np.abs(s[:, 0]) if model.task.linear else u.stroke
    )
    known = {} if times is None else {id(first): times[order] - moved.inputs[late[order], None]}
    return _begun(problem, u, known, random)


def _begins_late(model: Model, aim: TimedAim) -> bool:
    """Whether a candidate may begin anywhere on its turn: then it is moved to where its inputs suit the target."""
    free = model.task.crank_start is None or model.task.crank_from == "x"  # a placement turns the crank, too
    free = free and not model.plan.mirror  # which begins where it is its own mirror image
    return aim.inputs is not None and not aim.own_start and model.task.drive == "rotation" and free


def _posed(model: Model, u: Unknowns, moved: Moved, at: NDArray[np.intp]) -> Unknowns:
    """Return candidates that begin at samples (sets,) of their motions."""
    frames = moved.frames[np.arange(len(at)), at].view(np.complex128)  # place and direction (sets, links, 2)
    design = model.plan.design
    joints = [joint.a for joint in design.graph.joints]
    points = [model.carrier(name) for name, of_point in model.task.names.items() if of_point]
    guides = [joints[k] for k, _ in design.numbers]

    def carried(place: Array, links: list[int]) -> Array:
        own = frames[:, links]
        return _pairs(own[..., 0] + own[..., 1] * (place @ [1.0, 1.0j]))

    numbers = u.numbers + np.angle(frames[:, guides, 1])
    return u._replace(places=carried(u.places, joints), numbers=numbers, points=carried(u.points, points))


def _begun(
    problem: TaskProblem, u: Unknowns, known: dict[int, Array], random: np.random.Generator
) -> tuple[Array, list[Array]]:
    """Give the unknowns of single targets their first values; return vectors and times."""
    model = problem.model
    u = model.read(model.write(u))  # what is given or tied is so
    moved = model.move(u)
    own, times, at = u.own.copy(), [], 0
    for aim in problem.aims:
        if aim.unknowns:
            start = aim.times(moved, u, None) if id(aim) not in known else known[id(aim)]
            own[:, at : at + aim.unknowns] = aim.begin(start, moved, u, random)
            u = u._replace(own=own)
            if id(aim) in known and isinstance(aim, PointAim) and aim.start >= 0:
                assert aim.inputs is not None
                own[:, at + aim.unknowns - 1] = known[id(aim)][:, 0] - aim.inputs[0]
        found = known.get(id(aim)) if getattr(aim, "inputs", 0) is None else None
        times.append(aim.times(moved, u, found))
        if isinstance(aim, FunctionAim):
            own[:, at] = aim.zero(times[-1], moved, u)
        at += aim.unknowns
    return model.write(u._replace(own=own)), times


def from_mechanism(task: DesignTask, plan: Plan, mechanism: Mechanism) -> tuple[Unknowns, int]:
    """Return a candidate with the places of joints and named points in the pose of a mechanism, and its sense."""
    if mechanism.pose is None:
        raise GeometryError("a mechanism to begin with has no pose; give it one, or simulate it and take a pose")
    frames = [(complex(x, y), complex(math.cos(a), math.sin(a)), a) for x, y, a in mechanism.pose]

    def world(link: int, local: tuple[float, float]) -> complex:
        return frames[link][0] + frames[link][1] * complex(*local)

    place = np.array([[world(joint.a, joint.at_a) for joint in mechanism.joints]])
    guides = [mechanism.joints[k] for k, _ in plan.design.numbers]
    numbers = np.array([[joint.angle_a + frames[joint.a][2] for joint in guides if isinstance(joint, Prismatic)]])
    points = []
    for name, carrier in zip(task.names, plan.carriers):
        if task.names[name]:
            own = plan.design.joints_of(carrier)
            at = mechanism.points.get(name)
            points.append(world(*at) if at is not None else place[0, own].mean())
    law = mechanism.drivers[0].law
    rate = float(law(np.zeros(1))[1][0])
    stroke = abs(rate) if task.linear else 1.0
    more = sum(target.unknowns for target in task.targets)
    u = Unknowns(_pairs(place), numbers, _pairs(np.array([points])), np.zeros((1, more)), np.full(1, stroke))
    return u, 1 if rate > 0.0 else -1


def shaken(u: Unknowns, count: int, random: np.random.Generator) -> Unknowns:
    """Return copies of one candidate, the first as it is, the others more and more shaken."""
    size = np.ptp(u.places, axis=1).max()
    amount = (0.15 * np.arange(count) / count)[:, None]
    parts = []
    for part, scale in ((u.places, size), (u.numbers, 1.0), (u.points, size), (u.own, 0.0), (u.stroke, 0.0)):
        wide = np.repeat(part, count, axis=0)
        noise = scale * random.normal(0.0, 1.0, wide.shape)
        parts.append(wide + noise * amount.reshape(count, *(1,) * (wide.ndim - 1)))
    return Unknowns(*parts)


def _some(u: Unknowns, at: NDArray[np.intp]) -> Unknowns:
    return Unknowns(*(part[at] for part in u))


def _moved(moved: Moved, at: NDArray[np.intp]) -> Moved:
    return moved._replace(frames=moved.frames[at], rates=moved.rates[at], complete=moved.complete[at])


def _pairs(z: Complex) -> Array:
    return np.stack([z.real, z.imag], axis=-1)


def _similar(
    held: Complex, goals: Complex, size: float, count: int, random: np.random.Generator
) -> tuple[Complex, Complex]:
    """Factors and shifts (sets, 1) that put pivots where they are given, any others at random."""
    turn = np.exp(1j * random.uniform(0.0, math.tau, (count, 1))) * size * np.exp(random.normal(0.0, 0.5, (count, 1)))
    if len(goals) == 0:
        return turn, np.zeros((count, 1), dtype=np.complex128)
    if len(goals) > 1:
        turn = ((goals[1] - goals[0]) / (held[:, 1] - held[:, 0]))[:, None]
    return turn, goals[0] - turn * held[:, :1]


def _screened(
    model: Model, aim: PointAim, moved: Moved, u: Unknowns, held: Complex, goals: Complex, random: np.random.Generator
) -> tuple[Array, Array, Complex]:
    """Errors over the size (sets,), times of all points (sets, n), and the placement (sets, 3) of the best."""
    own, wanted = moved.link(aim.link), aim.wanted
    own = own._replace(frames=np.array(own.frames))
    if model.plan.mirror:  # the point is the joint on the axis
        placed = own.frames.view(np.complex128)
        placed[..., 0] += placed[..., 1] * (u.places[:, axis_joint(model.plan, aim.link)] @ [1.0, 1.0j])[:, None]
        placed[..., 1] = 0.0
    assert wanted is not None
    n, sets = len(wanted.points), len(moved.frames)
    few = np.unique(np.linspace(0, n - 1, min(n, _COMPARED)).round().astype(int))
    best, times, c = np.full(sets, np.inf), np.zeros((sets, n)), np.zeros((sets, 3), dtype=np.complex128)
    joints, sides = model.plan.design.joints_of(aim.link), model.plan.design.sides
    assert model.task.lengths is not None
    spread = np.hypot(*np.moveaxis(u.places[:, sides[:, 0]] - u.places[:, sides[:, 1]], 2, 0))
    long = spread.max(axis=1, initial=1e-300) / model.task.lengths[1]
    for again in range(1 if aim.inputs is not None else _TRIED):
        point = u.places[:, joints].mean(axis=1) + random.normal(0.0, 0.8, (sets, 2))
        guess = point[:, :1] + 1j * point[:, 1:] if again or not wanted.closed else aim.place(u)
        for at in (slice(k, k + _TOGETHER) for k in range(0, sets, _TOGETHER)):
            some = own._replace(frames=own.frames[at], rates=own.rates[at])
            tried = _guesses(model, aim, some, guess[at], wanted)  # (sets, guesses, n)
            error, placement = _fitted(some, tried[:, :, few], wanted, few, held[at], goals)
            if aim.inputs is None:  # a small part of a curve is near to any line, but of a mechanism that is too large
                error += np.log(np.maximum(np.abs(placement[..., 0]) * long[at, None], 1.0))
            row, k = np.arange(len(error)), error.argmin(axis=1)
            better = error[row, k] < best[at]
            best[at] = np.where(better, error[row, k], best[at])
            times[at] = np.where(better[:, None], tried[row, k], times[at])
            c[at] = np.where(better[:, None], placement[row, k], c[at])
    return best, times, c


def _guesses(model: Model, aim: PointAim, own: MovingLink, guess: Complex, wanted: Wanted) -> Array:
    """Return times (sets, guesses, n) at which the points may be passed: as given, or spread by the arc of a curve."""
    sets, span = len(own.frames), model.task.span
    if aim.inputs is not None:
        late = aim.own_start or _begins_late(model, aim)
        shifts = own.u[:: max(1, len(own.u) // _PHASES)] if late else np.zeros(1)
        return np.tile((np.array(aim.inputs) + shifts[:, None])[None], (sets, 1, 1))
    w = own.frames[..., 2] + 1j * own.frames[..., 3]
    z = own.frames[..., 0] + 1j * own.frames[..., 1] + w * guess
    arc = np.concatenate([np.zeros((sets, 1)), np.cumsum(np.abs(np.diff(z, axis=1)) + 1e-9, axis=1)], axis=1)
    arc /= arc[:, -1:]
    goal = wanted.points
    steps = np.abs(np.diff(goal)) + 1e-3 * wanted.size
    share = np.concatenate([[0.0], np.cumsum(steps)])
    share /= share[-1] + (abs(goal[0] - goal[-1]) + 1e-3 * wanted.size if wanted.closed else 0.0)
    phases = np.arange(_PHASES) / _PHASES
    parts = (1.0,) if wanted.closed else _PARTS
    if own.period:
        every = [phase + part * share for part in parts for phase in phases]
    else:
        every = [phase + part * share for part in (*parts, 1.0) for phase in phases[::4] if phase + part <= 1.0 + 1e-9]
    at = np.array(every)
    turns, rest = np.divmod(at, 1.0) if own.period else (0.0 * at, at)
    u = own.u - own.u[0]
    return np.stack([np.interp(rest, row, u) + turns * span for row in arc])


def _fitted(
    own: MovingLink, times: Array, wanted: Wanted, few: NDArray[np.intp], held: Complex, goals: Complex
) -> tuple[Array, Complex]:
    """Root mean square errors over the size (sets, guesses) and the placement s, q, t by least squares."""
    sets, count, n = times.shape
    u = np.mod(times, own.period) if own.period else times
    row, k = np.arange(sets)[:, None, None], np.clip(np.searchsorted(own.u, u, side="right") - 1, 0, len(own.u) - 2)
    x = (u - own.u[k]) / (own.u[k + 1] - own.u[k])  # chords are near enough to compare starts
    z, w = ((1.0 - x) * f[row, k] + x * f[row, k + 1] for f in own.frames.view(np.complex128).transpose(2, 0, 1))
    goal = np.broadcast_to(wanted.points[few], z.shape)
    B = np.stack([z, w, np.ones_like(z)], axis=3)
    if len(goals):
        more = np.stack([held, 0.0 * held, np.ones_like(held)], axis=2)[:, None] * _HELD
        B = np.concatenate([B, np.broadcast_to(more, (sets, count, *more.shape[2:]))], axis=2)
        goal = np.concatenate([goal, np.broadcast_to(goals * _HELD, (sets, count, len(goals)))], axis=2)
    H = np.conj(np.swapaxes(B, 2, 3))
    N = H @ B
    N += 1e-12 * np.trace(N, axis1=2, axis2=3).real[..., None, None] * np.eye(3)
    c = np.linalg.solve(N, H @ goal[..., None])
    e = ((B @ c)[..., 0] - goal) / wanted.size
    square = (np.abs(e) ** 2).sum(axis=2)
    if wanted.angles is not None:
        rest = np.exp(-1j * wanted.angles[few]) * w
        square += (np.angle(rest * np.conj(rest.sum(axis=2, keepdims=True))) ** 2).sum(axis=2)
    size = np.abs(c[..., 0, 0])  # a curve drawn by a huge or tiny mechanism is no start
    square = np.where((size > 0.02 * wanted.size) & (size < 50.0 * wanted.size), square / n, np.inf)
    return np.sqrt(square), c[..., 0]
