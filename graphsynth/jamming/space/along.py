"""Least factors along a motion, with every loop closed in space, for changed misalignments and limits; estimated.

How the factor s grows with the factor phi on all misalignments follows from the multipliers of the closure,
``ds / dphi = by . dg / dphi`` at fixed unknowns, so that the phi with s = 1 takes two or three optima.  The sum of the
shadow prices ``2 weight X dX/ds`` of all limits is 1.  See theory/closure-in-space 3 and 7.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from graphsynth.intervals import Interval
from graphsynth.jamming.joints.limits import Limits, Misalignment, bounds
from graphsynth.jamming.joints.program import JointProblem
from graphsynth.jamming.space.closure import Closure
from graphsynth.jamming.space.model import SpaceModel
from graphsynth.jamming.space.optimum import Optimum, least_scale
from graphsynth.jamming.space.plane import driven_at, in_space, start

if TYPE_CHECKING:
    from graphsynth.kinematics.engine.result import Motion

Array = NDArray[np.float64]
#: Largest misalignment that is looked at (radians), and the step of the factor on them for a slope.
LARGEST, _STEP = 0.4999, 1e-6
#: Steps to the factor on the misalignments that leaves no room, and how near they come.
_STEPS, _NEAR = 6, 1e-10
#: Inputs at which the factor on the misalignments is solved for, not only followed from its slope.
_SOLVED = 2
#: A closure that is missed by more is none.
_MISSED = 1e-9


class Change(NamedTuple):
    """What of a question is changed: a factor on all misalignments, their direction, a factor on all limits.

    ``other``: limits by joint (number) instead of the given ones.
    """

    phi: float = 1.0
    turned: float = 0.0
    limits: float = 1.0
    other: tuple[tuple[int, Limits], ...] = ()


#: No change.
NOTHING = Change()


def changed(given: JointProblem, change: Change) -> JointProblem:
    """Return a problem with changed misalignments and limits; their ranges enclose the exact products."""
    tilts = []
    for tilt in given.misalignments:
        angle = tilt.direction + change.turned
        low, high = bounds(tilt, "direction")
        size = {"alpha": tilt.alpha * change.phi, "alpha_range": _times(bounds(tilt, "alpha"), change.phi)}
        turned = {"direction": angle, "direction_range": (low + change.turned, high + change.turned)}
        own: Any = {**size, **turned}
        tilts.append(replace(tilt, **own))
    other, limits = dict(change.other), []
    for k, limit in enumerate(given.limits):
        limit = other.get(k, limit)
        values: Any = {}
        for name in limit.names:
            values[name] = getattr(limit, name) * change.limits if getattr(limit, name) else 0.0
            values[f"{name}_range"] = _times(bounds(limit, name), change.limits)
        limits.append(replace(limit, **values))
    return replace(given, misalignments=tuple(tilts), limits=tuple(limits))


def _times(box: tuple[float, float], factor: float) -> tuple[float, ...]:
    """Enclose a range times a factor of zero or more; exact where it is 1."""
    if factor == 1.0:
        return box
    low, high = (end * factor if end else 0.0 for end in box)
    return tuple(
        math.nextafter(end, side) if end and math.isfinite(end) else end
        for end, side in ((low, -math.inf), (high, math.inf))
    )


def arguments(given: JointProblem) -> tuple[Mapping[tuple[int, int], Any], tuple[Misalignment, ...]]:
    """Return limits by pair and misalignments, as the public functions take them."""
    rigid = {tilt.pair for tilt in given.misalignments if tilt.rigid}
    pairs = (joint.pair for joint in given.mechanism.joints)
    return {pair: own for pair, own in zip(pairs, given.limits) if pair not in rigid}, given.misalignments


class Least(NamedTuple):
    """The optimum of one pose, with the logarithmic slope of its factor by that on all misalignments (estimated)."""

    optimum: Optimum
    slope: float

    @property
    def scale(self) -> float:
        """Least factor on all limits; NaN where no closure was found to go with it."""
        if self.optimum.missed >= _MISSED and self.optimum.scale < math.inf:
            return math.nan
        return 0.0 if self.optimum.scale < _MISSED else self.optimum.scale


class Along:
    """Least factors at inputs of a motion.

    Raises `Unsupported` for mechanisms that the model does not describe.
    """

    def __init__(self, given: JointProblem, motion: Motion) -> None:
        self.given, self.motion = given, motion
        self.keep = np.flatnonzero(motion.assembled)
        self.closures: dict[Change, Closure] = {}
        alpha = max((abs(end) for tilt in given.misalignments for end in bounds(tilt, "alpha")), default=0.0)
        #: Largest factor on the misalignments that is looked at.
        self.most = LARGEST / alpha if alpha > 0.0 else math.inf
        self.closure(Change())

    def closure(self, change: Change) -> Closure:
        """Closure in floats of the changed mechanism."""
        if change not in self.closures:
            self.closures[change] = Closure(in_space(changed(self.given, change)), False)
        return self.closures[change]

    def model(self, change: Change) -> SpaceModel:
        """Return the changed mechanism in space."""
        return self.closure(change).model

    def poses(self, inputs: Array) -> tuple[Array, NDArray[np.bool_]]:
        """Plane poses at inputs within the range of the motion, on its branch, and whether each is assembled."""
        from graphsynth.kinematics.simulation import simulate

        ends = self.motion.inputs[self.keep]
        first = int(np.argmin(ends))
        passed, back = np.unique(np.concatenate([[ends[first]], inputs]), return_inverse=True)
        found = simulate(self.motion.mechanism, passed, start=self.motion.poses[self.keep[first]], events=False)
        return found.poses[back[1:]], found.assembled[back[1:]]

    def start(self, u: float, pose: Array, change: Change) -> tuple[Array, Array]:
        """Coordinates of a plane pose, and half widths of the given ones, which enclose those of the input u."""
        model = self.model(change)
        q = start(model, self.motion.mechanism, pose)
        given = driven_at(model, self.motion.mechanism, Interval.from_bounds(np.array([u]), np.array([u])))
        q[model.size :] = given.mid[0]
        return q, np.asarray(given.rad[0])

    def least(self, u: float, pose: Array, change: Change = NOTHING, near: Least | None = None) -> Least:
        """Least factor at one input; ``near`` is one of a mechanism little different at this input, to start from."""
        closure = self.closure(change)
        q = self.start(u, pose, change)[0]
        if near is not None and near.optimum.missed < _MISSED and len(near.optimum.q) == len(q):
            q = near.optimum.q
        found = least_scale(closure, q)
        if not _MISSED < found.scale < math.inf or change.phi * (1.0 + _STEP) > self.most:
            return Least(found, 1.0)
        more = self.closure(change._replace(phi=change.phi * (1.0 + _STEP)))
        rise = (more.values(more.loops(found.q[None])) - closure.values(closure.loops(found.q[None])))[0]
        slope = float(found.by @ rise) / (_STEP * found.scale)
        return Least(found, slope if math.isfinite(slope) and slope > 0.0 else 1.0)

    def followed(self, least: Least) -> float:
        """Factor on all misalignments that leaves no room, from the slope at an optimum."""
        if not least.scale > 0.0:
            return math.inf if least.scale == 0.0 else math.nan
        return 0.0 if least.scale == math.inf else float(least.scale ** (-1.0 / least.slope))

    def allowed(self, u: float, pose: Array, change: Change, least: Least) -> float:
        """Factor on all misalignments that leaves no room at one input, solved for from an optimum.

        Infinite if there is room up to the largest misalignment looked at; NaN if the closure is lost on the way.
        """
        total = 1.0
        for _ in range(_STEPS):
            step = self.followed(least)
            if not 0.0 < step < math.inf:
                return total * step
            if total * step > self.most:
                if total == self.most:
                    return math.inf
                step = self.most / total
            total = total * step
            if abs(step - 1.0) < _NEAR:
                break
            least = self.least(u, pose, change._replace(phi=change.phi * total), least)
        return total

    def allowed_at(self, inputs: Array, poses: Array, change: Change = NOTHING) -> tuple[Array, list[Least]]:
        """Factors on all misalignments that leave no room: solved for where smallest, followed from the slope else."""
        found: list[Least] = []
        for u, pose in zip(inputs.tolist(), poses):
            found.append(self.least(u, pose, change))
        allowed = np.array([self.followed(one) for one in found])
        solved: set[int] = set()
        for _ in range(_SOLVED):
            if np.isnan(allowed).all():
                break
            k = int(np.nanargmin(allowed))
            if k not in solved:
                solved.add(k)
                allowed[k] = self.allowed(float(inputs[k]), poses[k], change, found[k])
        return allowed, found
