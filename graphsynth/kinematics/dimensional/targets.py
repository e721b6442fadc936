"""Errors of the optional targets over many candidate motions at once.

Moving, turning and scaling the whole mechanism, and moving the tracing point on its link, change a curve linearly:
with z the origin and theta the angle of the link, every curve it can draw is ``s z + q exp(i theta) + t`` with complex
s, q, t.  So these are not searched but solved for (variable projection: [Golub & Pereyra 1973]): six numbers less.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from graphsynth.core.errors import GeometryError
from graphsynth.kinematics.dimensional.design import Design
from graphsynth.kinematics.dimensional.goals import FunctionGoal, LineGoal, PathGoal, PosesGoal, Target

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]

_KNOTS = 10


class Sampled(NamedTuple):
    """A link over the inputs of the target, by set: origin, angle factor and continuous angle, each (sets, samples)."""

    z: Complex
    w: Complex
    angle: Array


class Placed(NamedTuple):
    """What the fit adds to a candidate: the whole is multiplied by s and moved by t; q/s is the point on the link."""

    s: Complex
    q: Complex
    t: Complex


def target_link(design: Design, target: Target) -> int:
    """Return the link that a target speaks of; `GeometryError` if it cannot be that one."""
    graph = design.graph
    frame = graph.frame
    assert frame is not None
    link = target.link
    driven = {pair[1] for pair in design.drivers}
    if link is None:
        if isinstance(target, FunctionGoal):
            near = [k for k in range(graph.links) if graph.neighbours[frame] >> k & 1 and k not in driven]
            link = near[0] if near else graph.levels[1][-1]
        else:
            link = graph.levels[-1][-1]
    if link >= graph.links or link == frame:
        raise GeometryError(
            f"target link {link} is the frame or does not exist; name a moving link, 0 to {graph.links - 1}"
        )
    return link


class TargetFit(ABC):
    """Base: where to sample, how many more unknowns, and the errors."""

    #: Inputs at which the target is sampled, relative to the first.
    inputs: Array
    #: Ranges of further unknowns, shape (extras, 2).
    ranges: Array = np.zeros((0, 2))
    #: Whether the target speaks of absolute coordinates.
    placed = False
    #: Whether continuous angles are needed.
    angular = True
    #: Whether the errors vanish smoothly at a perfect candidate, so that least squares help.
    smooth = True
    #: Whether the target reads the motion at other inputs by set.
    warped = False

    @abstractmethod
    def errors(self, sampled: Sampled, extras: Array, crank: Array) -> tuple[Complex, Placed]:
        """Errors (sets, m) whose largest size is in the unit of the tolerance, and the placement."""


class PathFit(TargetFit):
    """Points, timed or not, and poses."""

    placed = True

    def __init__(self, target: PathGoal | PosesGoal) -> None:
        rows = np.array(target.points if isinstance(target, PathGoal) else target.poses)
        self.goal = rows[:, 0] + 1j * rows[:, 1]
        self.turn = rows[:, 2] - rows[0, 2] if isinstance(target, PosesGoal) else None
        self.size = float(np.abs(self.goal - self.goal.mean()).max()) or 1.0
        self.warped = target.inputs is None
        self.angular = self.warped or self.turn is not None
        if target.inputs is not None:
            self.inputs = np.array(target.inputs)
            return
        self.inputs = np.zeros(0)
        knots = min(len(rows), _KNOTS)
        arc = np.concatenate([[0.0], np.cumsum(np.abs(np.diff(self.goal)) + 1e-3 * self.size)])
        self.share = arc / arc[-1] * (knots - 1)
        self.ranges = np.array([[0.05, 1.0]] * knots)  # the last is the rest of the turn

    def times(self, extras: Array, span: float) -> Array:
        """Return the inputs at the points, shape (sets, points): increasing, within the range."""
        steps = np.cumsum(np.abs(extras) + 1e-6, axis=1)
        knots = np.concatenate([np.zeros((len(extras), 1)), steps[:, :-1] / steps[:, -1:]], axis=1) * span
        low = np.minimum(self.share.astype(np.intp), knots.shape[1] - 2)
        part = self.share - low
        return np.asarray(knots[:, low] * (1.0 - part) + knots[:, low + 1] * part)

    def errors(self, sampled: Sampled, extras: Array, crank: Array) -> tuple[Complex, Placed]:
        """Distance of every point over the size of the set, and angles."""
        z, w = sampled.z, sampled.w
        B = np.stack([z, w, np.ones_like(z)], axis=2)
        BH = np.conj(B.transpose(0, 2, 1))
        N = BH @ B
        N = N + 1e-13 * np.trace(N, axis1=1, axis2=2).real[:, None, None] * np.eye(3)
        c: Complex = np.linalg.solve(N, BH @ np.broadcast_to(self.goal, z.shape)[:, :, None]).astype(np.complex128)
        found = ((B @ c)[:, :, 0] - self.goal) / self.size
        if self.turn is not None:
            turned = sampled.angle - sampled.angle[:, :1] - self.turn
            found = np.concatenate([found, turned - turned.mean(axis=1, keepdims=True)], axis=1)
        return found, Placed(c[:, 0, 0], c[:, 1, 0], c[:, 2, 0])


class FunctionFit(TargetFit):
    """Angle of a link as a function of the input."""

    def __init__(self, target: FunctionGoal) -> None:
        self.inputs, self.outputs = np.array(target.inputs), np.array(target.outputs)

    def errors(self, sampled: Sampled, extras: Array, crank: Array) -> tuple[Complex, Placed]:
        """Differences of angles with the best zero of the scale."""
        e = sampled.angle - self.outputs
        e = e - 0.5 * (e.max(axis=1, keepdims=True) + e.min(axis=1, keepdims=True))
        one = np.ones(len(e), dtype=np.complex128)
        return e.astype(np.complex128), Placed(one, 0.0 * one, 0.0 * one)


class LineFit(TargetFit):
    """A straight stroke: its two ends are set exactly the wanted length apart, the strip is measured."""

    smooth = angular = False

    def __init__(self, target: LineGoal) -> None:
        self.target = target
        self.inputs = np.linspace(0.0, target.span, 73)
        tilt = [-3.0 * target.tolerance, 3.0 * target.tolerance]
        self.ranges = np.array([tilt] if target.on_bar else [tilt, [-np.pi, np.pi]])

    def errors(self, sampled: Sampled, extras: Array, crank: Array) -> tuple[Complex, Placed]:
        """Width of the strip over its length, shape (sets, 1)."""
        z, w = sampled.z, sampled.w
        dz, dw = z[:, -1] - z[:, 0], w[:, -1] - w[:, 0]
        length = self.target.length * crank
        if self.target.on_bar:
            q, far = _on_bar(dz, dw, length)
        else:
            q, far = (length * np.exp(1j * extras[:, 1]) - dz) / dw, np.zeros(len(z))
        M = z + q[:, None] * w
        along = (M[:, -1] - M[:, 0]) / length * np.exp(1j * extras[:, 0])
        y = (np.conj(along)[:, None] * M).imag
        width = (_peak(y) + _peak(-y)) / length
        one = np.ones(len(z), dtype=np.complex128)
        return (width + far)[:, None].astype(np.complex128), Placed(one, q, 0.0 * one)


def _peak(y: Array) -> Array:
    """Largest value by row of equidistant samples, with the parabola through every local maximum and its neighbours."""
    y0, y1, y2 = y[:, :-2], y[:, 1:-1], y[:, 2:]
    bend = np.minimum(y0 - 2.0 * y1 + y2, -1e-300)
    rise = np.where((y1 >= y0) & (y1 >= y2), -((y0 - y2) ** 2) / (8.0 * bend), 0.0)
    return np.asarray(np.maximum(y.max(axis=1), (y1 + rise).max(axis=1)))


def _on_bar(dz: Complex, dw: Complex, length: Array) -> tuple[Complex, Array]:
    """Real k with |dz + k dw| = length (the larger), and how far it is from existing."""
    a, b, c = np.abs(dw) ** 2, (dz * np.conj(dw)).real, np.abs(dz) ** 2 - length**2
    inside = b * b - a * c
    k = (-b + np.sqrt(np.maximum(inside, 0.0))) / a
    return k.astype(np.complex128), np.sqrt(np.maximum(-inside, 0.0)) / (a * length)


def make_fit(target: Target | None) -> TargetFit | None:
    """Return the fit of a target."""
    if target is None:
        return None
    if isinstance(target, LineGoal):
        return LineFit(target)
    return FunctionFit(target) if isinstance(target, FunctionGoal) else PathFit(target)
