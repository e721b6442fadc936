"""A mechanism with two links more that draws what it drew: the traced point becomes the joint of another dyad.

The point, at no distance from that joint on one of the two links, draws what it drew, whatever the dyad is; a distance
adds to the curve what the direction of the new link does.  So errors only fall from there.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from graphsynth.design.task.descend import Descended
from graphsynth.design.task.model import Model, Unknowns
from graphsynth.design.task.plans import Plan, fitting
from graphsynth.design.task.problem import TaskProblem
from graphsynth.design.task.targets import PathTarget
from graphsynth.kinematics.dimensional.design import Design
from graphsynth.mechanism.laws import Driver, Linear
from graphsynth.mechanism.model import Mechanism, TracePoint
from graphsynth.structure.graph import MechanismGraph

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]
#: Distance of a new pivot from the middle of the curve, over the size, and of the new inner joint from the old point,
#: over the longest way between both: from, to, evenly in their logarithms.
_FAR, _ARM = (0.3, 4.0), (0.25, 2.5)
#: Largest cosine of the angle between the links of a new dyad, and at its first joint; the first distance of the point.
_FLAT, _STEEP, _BEGIN = 0.98, 0.998, 3e-3
#: Damping with which errors after one step are told.
_DAMPING = 1e-3


class Grown(NamedTuple):
    """A plan with a dyad more, one of its mechanisms, and many of them, all in the same assembly mode."""

    plan: Plan
    mechanism: Mechanism
    every: Unknowns


def grown(model: Model, x: Array, count: int, random: np.random.Generator) -> Grown | None:
    """Return mechanisms that draw, but for a hair, what a candidate (size,) draws; None where there are none.

    On which link the new dyad turns, and in which mode, is drawn at random.
    """
    task, design = model.task, model.plan.design
    names = [own.point for own in task.targets if isinstance(own, PathTarget)]
    name = names[int(random.integers(len(names)))]
    carrier, graph = model.carrier(name), design.graph
    base = int(random.choice([link for link in range(graph.links) if link != carrier]))
    u = model.read(x[None])
    moved = model.move(u)
    if not moved.complete.all():
        return None
    at = (model.point_at(name) - model.points_at) // 2
    point = complex(*u.points[0, at])
    frames = moved.frames[0].view(np.complex128)
    z, y = _dyads(frames[:, carrier] @ [1.0, point], frames[:, base], task.size, count, random)
    if not len(z):
        return None
    # the larger graph, its joints in their order
    first, second = graph.links, graph.links + 1
    pairs = [(joint.a, joint.b) for joint in graph.joints]
    added = {(carrier, first): np.full(len(z), point), (first, second): y, (base, second): z}
    larger = MechanismGraph(graph.links + 2, [*pairs, *added], frame=graph.frame)
    order = [(joint.a, joint.b) for joint in larger.joints]
    kinds = tuple("R" if pair in added else design.kinds[pairs.index(pair)] for pair in order)
    old = {pair: u.places[0, k] @ [1.0, 1.0j] for k, pair in enumerate(pairs)}
    place = np.stack([added[pair] if pair in added else np.full(len(z), old[pair]) for pair in order], axis=1)
    places = np.stack([place.real, place.imag], axis=2)
    plan = _plan(model, Design(larger, design.drivers, kinds), name, first, places[0])
    if plan is None:
        return None
    numbers = [u.numbers[0, design.numbers.index((pairs.index(order[k]), "angle"))] for k, _ in plan.design.numbers]
    points = np.repeat(u.points, len(z), axis=0)
    way = np.exp(1j * random.uniform(0.0, math.tau, len(z))) * _BEGIN * task.size
    points[:, at] += np.stack([way.real, way.imag], axis=1)
    own, stroke = (np.repeat(part, len(z), axis=0) for part in (u.own, u.stroke))
    every = Unknowns(places, np.tile(numbers, (len(z), 1)), points, own, stroke)
    return Grown(plan, _mechanism(model, plan, every), every)


def _dyads(
    joint: Complex, base: Complex, size: float, count: int, random: np.random.Generator
) -> tuple[Complex, Complex]:
    """Return pivots (n,) and inner joints (n,) of new dyads at the start.

    They move with a joint (samples,) and a base, its place and direction (samples, 2).
    """
    z = joint.mean() + size * _between(_FAR, count, random) * np.exp(1j * random.uniform(0.0, math.tau, count))
    z = (z - base[0, 0]) * np.conj(base[0, 1])
    way = base[:, :1] + base[:, 1:] * z - joint[:, None]
    far = np.abs(way)
    near, most = far.min(axis=0), far.max(axis=0)
    one = most * _between(_ARM, count, random)
    low, high = np.maximum(most - one, one - near) + 0.05 * most, one + 0.95 * near
    two = low + (high - low) * random.random(count)
    inner = (one**2 + two**2 - far**2) / (2.0 * one * two)
    outer = (one**2 + far**2 - two**2) / (2.0 * one * far)
    good = (high > low) & (np.abs(inner).max(axis=0) < _FLAT) & (np.abs(outer).max(axis=0) < _STEEP)
    turn = np.exp(1j * random.choice([-1.0, 1.0]) * np.arccos(np.clip(outer[0], -1.0, 1.0)))
    y = joint[0] + one * turn * way[0] / far[0]
    return (base[0, 0] + base[0, 1] * z)[good], y[good]


def _between(bounds: tuple[float, float], count: int, random: np.random.Generator) -> Array:
    return np.exp(random.uniform(math.log(bounds[0]), math.log(bounds[1]), count))


def _plan(model: Model, design: Design, name: str, link: int, places: Array) -> Plan | None:
    """Return the plan of a larger design that carries what is named as before, but for one point; None for none."""
    carriers = tuple(link if own == name else model.carrier(own) for own in model.names)

    def suits(plan: Plan) -> bool:
        kept = all(math.dist(places[k], at) < 1e-9 * model.task.size for k, at in plan.given)
        return plan.carriers == carriers and kept and len(plan.regions) == len(model.plan.regions)

    return next((plan for plan in fitting(model.task, design) if suits(plan)), None)


def _mechanism(model: Model, plan: Plan, every: Unknowns) -> Mechanism:
    """Return the first of many as a mechanism to begin with."""
    base = plan.design.mechanism(every.places[0], every.numbers[0])
    rate = model.sense * float(every.stroke[0])
    drivers = tuple(Driver(*pair, Linear(rate)) for pair in plan.design.drivers)
    points = [name for name, of_point in model.task.names.items() if of_point]
    traced = {
        name: TracePoint(plan.carriers[model.names.index(name)], (float(at[0]), float(at[1])))
        for name, at in zip(points, every.points[0])
    }
    return Mechanism(base.graph, base.joints, drivers, traced, base.pose)


def promised(problem: TaskProblem, X: Array) -> Descended:
    """Return candidates (sets, size) with what their errors would be after a damped step of Gauss and Newton."""
    (error, r, J), times = problem.linearise(X, None, 0.2)
    turned = J.transpose(0, 2, 1)
    H, g = turned @ J, turned @ r[:, :, None]
    scale = np.einsum("sii->si", H)
    H += (_DAMPING * scale + 1e-12 * scale.max(axis=1, keepdims=True) + 1e-300)[:, :, None] * np.eye(X.shape[1])
    left = error**2 - (g * np.linalg.solve(H, g))[:, :, 0].sum(axis=1)
    return Descended(X, np.where(np.isfinite(error), np.sqrt(np.maximum(left, 0.0)), np.inf), times)
