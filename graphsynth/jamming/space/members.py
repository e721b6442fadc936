"""Mechanisms in space whose dimensions lie within tolerances: where all members of a box are, and one that binds.

The parameters of the box are given coordinates of the model, beside the input.  So a proof over a box of the given
coordinates is one for all inputs and all members in it.  See theory/closure-in-space 8.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import islice
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from graphsynth.intervals import Interval
from graphsynth.jamming.assembly import positions
from graphsynth.jamming.assembly.positions import Positions, points
from graphsynth.jamming.joints.limits import Misalignment, bounds, chosen
from graphsynth.jamming.joints.program import JointProblem
from graphsynth.jamming.joints.search import MemberWitness, limits_chosen, lowest, sharp_problem, unclosed_at
from graphsynth.jamming.space.closure import Closure, closures
from graphsynth.jamming.space.model import SpaceModel
from graphsynth.jamming.space.optimum import Optimum, least_scale
from graphsynth.jamming.space.plane import driven_at, in_space, largest_spin, largest_turn, leaning, start
from graphsynth.jamming.space.pose import PoseProof, prove_pose
from graphsynth.mechanism.joints import Revolute
from graphsynth.tolerances.box import relative_box

if TYPE_CHECKING:
    from graphsynth.kinematics.engine.result import Motion
    from graphsynth.mechanism.model import Mechanism
    from graphsynth.tolerances.box import ParameterBox

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]
#: Boxes into which the unknowns of one member are cut; rounds of the search for a member; inputs tried in a piece.
_BOXES, _ROUNDS, _INPUTS = 300, 2, 7
#: Pieces in which a binding member is sought; a closure that is missed by more is none.
_PIECES, _MISSED = 4, 1e-9
#: Part of their largest turns that leaning axes have where it is asked in which direction they count.
_ASIDE = 0.3


class MemberPoses(NamedTuple):
    """References at the middles of N pieces, half widths of the given coordinates, whether the plane poses were found.

    ``q`` (N, width), ``given`` (N, given coordinates); where not ``found`` (N,) the others say nothing.
    """

    q: Array
    given: Array
    found: Mask


class Members:
    """All members of a box of dimensions along a motion; raises `Unsupported` for what the model does not describe.

    ``box`` holds the ``sizes`` and two turns of every axis that may lean.
    """

    def __init__(self, given: JointProblem, motion: Motion, sizes: ParameterBox) -> None:
        self.given, self.motion, self.sizes = given, motion, sizes
        self.box = _with_axes(motion.mechanism, sizes, given.misalignments)
        self.model = in_space(given, self.box)
        keep = np.flatnonzero(motion.assembled)
        ends = motion.inputs[keep]
        self.low, self.high = float(ends.min()), float(ends.max())
        self.start = motion.poses[keep[int(np.argmin(ends))]]

    def unclosed(self, inputs: Array) -> str:
        """Name a member whose plane mechanism cannot be assembled at one of some inputs, or return an empty text."""
        try:
            return (
                unclosed_at(Positions(self.motion.mechanism, self.sizes, self.start), inputs) if self.sizes.size else ""
            )
        except positions.Unsupported:
            return ""

    @property
    def floats(self) -> Closure:
        """Closure in floats."""
        return closures(self.model)[0]

    def prove(self, u: float, p: Interval) -> PoseProof:
        """Prove what can be proved of the members p (m,) at one input."""
        poses = self.poses(points(np.array([u])), p.reshape(1, -1))
        if not poses.found[0]:
            return PoseProof.unknown("the plane mechanism is not assembled")
        return prove_pose(self.model, poses.q[0], given=poses.given[0], boxes=_BOXES)

    def mechanism(self, p: Array) -> Mechanism:
        """Return the plane mechanism of a member, rounded to doubles."""
        nominal = self.motion.mechanism
        return self.box.member(nominal, p) if p[: self.sizes.size].any() else nominal

    def axes(self, p: Array) -> tuple[Misalignment, ...]:
        """Return the misalignments of a member; of axes that may lean those of its turns, never more than the largest.

        Turns a and b about x and y lead the axis to ``(sin b, -sin a cos b, cos a cos b)``, x in the direction given.
        """
        turns, found = iter(_pairs(p, self).tolist()), []
        for tilt in self.given.misalignments:
            own = tilt
            if leaning(tilt):
                a, b = next(turns)
                lean = math.asin(math.hypot(math.sin(b), math.sin(a) * math.cos(b)))
                most = max(map(abs, bounds(tilt, "alpha")))
                way = math.atan2(math.sin(b), math.sin(a) * math.cos(b))
                own = tilt.sharp(min(lean, most), tilt.direction + way)
            found.append(own)
        return tuple(found)

    @cached_property
    def _spun(self) -> Array:
        """How far the turns of a leaning axis may spin the seat of a driven joint that turns, (drivers,)."""
        most = {tilt.pair: largest_spin(tilt) for tilt in self.given.misalignments if leaning(tilt)}
        driven = {driver.pair for driver in self.motion.mechanism.drivers}
        joints = [joint for joint in self.motion.mechanism.joints if joint.pair in driven]
        return np.array([most.get(one.pair, 0.0) if isinstance(one, Revolute) else 0.0 for one in joints])

    def coordinates(self, u: Interval, p: Interval) -> Interval:
        """Enclose the given coordinates (N, ...) for pieces u (N,) of the input and p (N, m) of the dimensions."""
        driven = driven_at(self.model, self.motion.mechanism, u) + Interval.from_bounds(-self._spun, self._spun)
        return Interval.from_bounds(np.hstack([driven.lo, p.lo]), np.hstack([driven.hi, p.hi]))

    def poses(self, u: Interval, p: Interval) -> MemberPoses:
        """Return references for pieces u (N,) of the input and p (N, m) of the dimensions."""
        from graphsynth.kinematics.simulation import simulate

        model, given = self.model, self.coordinates(u, p)
        middles, u_mid = np.clip(p.mid, p.lo, p.hi)[:, : self.sizes.size], u.mid
        q, found = np.zeros((len(u_mid), model.width)), np.zeros(len(u_mid), dtype=np.bool_)
        for middle in np.unique(middles, axis=0):
            rows = np.flatnonzero((middles == middle).all(axis=1))
            passed, back = np.unique(np.concatenate([[self.low], u_mid[rows]]), return_inverse=True)
            mechanism = self.mechanism(middle)
            motion = simulate(mechanism, passed, start=self.start, events=False)
            for row, at in zip(rows.tolist(), back[1:].tolist()):
                found[row] = motion.assembled[at]
                if found[row]:
                    q[row] = start(model, mechanism, motion.poses[at])
        q[:, model.size :] = given.mid
        return MemberPoses(q, np.asarray(given.rad), found)


def _with_axes(mechanism: Mechanism, sizes: ParameterBox, tilts: Iterable[Misalignment]) -> ParameterBox:
    """Return a box of dimensions with two turns, within a disc, of every axis that may lean.

    Then a third one for each of a guide, whose direction would spin with the two (`largest_spin`).
    """
    tilts = list(filter(leaning, tilts))
    guides = [tilt for tilt in tilts if not isinstance(mechanism.joint(*tilt.pair), Revolute)]
    turns = [(tilt, axis, largest_turn(tilt)) for tilt in tilts for axis in "xy"]
    turns += [(tilt, "z", largest_spin(tilt)) for tilt in guides]
    names = tuple(f"turn about {axis} of the axis {own.base}-{own.link} on link {own.base}" for own, axis, _ in turns)
    ends, first = np.array([most for *_, most in turns]), sizes.size
    discs = tuple((k, k + 1) for k in range(first, first + 2 * len(tilts), 2))
    low, high = np.append(sizes.low, -ends), np.append(sizes.high, ends)
    return replace(sizes, names=(*sizes.names, *names), low=low, high=high, discs=(*sizes.discs, *discs))


def _pairs(values: Array, members: Members) -> Array:
    """Two values for every axis that may lean, of those of all parameters (m,)."""
    first, count = members.sizes.size, sum(map(leaning, members.given.misalignments))
    return values[first : first + 2 * count].reshape(-1, 2)


def aligned(given: JointProblem, motion: Motion, sizes: ParameterBox) -> JointProblem:
    """Return a problem whose leaning axes are turned first in the direction that counts most at the middle input.

    There the boxes into which the disc of turns is cut fit its rim (estimated; any direction is as valid).
    """
    if not any(map(leaning, given.misalignments)):
        return given
    own, tilts = Members(given, motion, sizes), []
    u, p = points(np.array([0.5 * (own.low + own.high)])), _ASIDE * own.box.high
    poses = own.poses(u, points(p[None]))
    rises = slopes(own.model, least_scale(own.floats, poses.q[0]))
    pairs = iter(_pairs(rises[len(rises) - own.box.size :], own).tolist())
    for tilt in given.misalignments:
        if leaning(tilt):
            a, b = next(pairs)
            low, way = bounds(tilt, "direction")[0], tilt.direction + math.atan2(b, a)
            way = low + (way - low) % math.tau
            tilt = replace(tilt, direction=min(way, bounds(tilt, "direction")[1])) if math.isfinite(way) else tilt
        tilts.append(tilt)
    return replace(given, misalignments=tuple(tilts))


def at_end(given: JointProblem, end: int) -> JointProblem:
    """Return a problem with all limits at the low (0) or high (1) ends of their ranges."""
    limits = tuple(chosen(own, lambda one, name: bounds(one, name)[end]) for own in given.limits)
    return replace(given, limits=limits)


def slopes(model: SpaceModel, found: Optimum) -> Array:
    """Return the derivatives of the least factor by the given coordinates, from the multipliers (estimated)."""
    floats = closures(model)[0]
    J = floats.jacobian(floats.loops(found.q[None]))[0]
    return np.asarray(found.by @ J[:, model.size :])


def extreme_member(members: Members, u: float, side: float) -> Array:
    """Return the member with the largest (``side`` = 1) or smallest (-1) least factor at an input, to first order."""
    m = members.box.size
    poses = members.poses(points(np.array([u])), points(np.zeros((1, m))))
    found = least_scale(members.floats, poses.q[0])
    return members.box.furthest(side * slopes(members.model, found)[len(poses.given[0]) - m :])


@dataclass(frozen=True, eq=False)
class SpaceWitness(MemberWitness):
    """A member of the tolerance boxes that is proved to bind with every loop closed in space (certified).

    ``factor`` is 1, which the least factor on the limits is proved to exceed; ``scale`` what it is (estimated).
    """

    scale: float = math.nan

    @property
    def sentence(self) -> str:
        """What is proved."""
        return (
            f"{self.named} binds at the input {self.input!r}, proved with exact closure in space; its limits would "
            f"have to be {self.scale:.6g} times as large (estimated)"
        )

    def summary(self) -> dict[str, Any]:
        """Plain values."""
        return super().summary() | {"scale": self.scale}


class Place(NamedTuple):
    """Where a binding member may be: ends of the input, and a member of the box."""

    low: float
    high: float
    p: Array


def binding_member(
    given: JointProblem, motion: Motion, box: ParameterBox, places: Iterable[Place]
) -> SpaceWitness | None:
    """Look for a member that binds, and prove it; the places are tried in their order.

    Limits are taken at their low ends, dimensions at the corner that the multipliers point to.  It is proved as a point
    of the box, and as the mechanism whose dimensions are rounded to doubles.
    """
    tilts = tuple(tilt if leaning(tilt) else tilt.sharp() for tilt in given.misalignments)
    limits = lowest(given.limits)
    own = Members(sharp_problem(motion.mechanism, limits, tilts), motion, box)
    for place in islice(places, _PIECES):
        u, p, scale = _worst(own, place)
        if not scale > 1.0 or own.prove(u, points(p)).state >= 0:
            continue
        mechanism, axes = own.mechanism(p), own.axes(p)
        alone = sharp_problem(mechanism, limits, axes), replace(motion, mechanism=mechanism)
        if Members(*alone, relative_box(mechanism, 0.0)).prove(u, points(np.zeros(0))).state < 0:
            named = tuple(zip(box.names, p[: box.size].tolist())), limits_chosen(given, limits)
            return SpaceWitness(u, 1.0, axes, limits, mechanism, True, *named, scale)
    return None


def _worst(members: Members, place: Place) -> tuple[float, Array, float]:
    """Input, member and its least factor, the largest found in a piece (estimated)."""
    inputs, best = np.linspace(place.low, place.high, _INPUTS), (place.low, place.p, -math.inf)
    p = place.p
    for _ in range(_ROUNDS):
        poses = members.poses(points(inputs), points(np.tile(p, (len(inputs), 1))))
        tried = [(u, least_scale(members.floats, q)) for u, q in zip(inputs[poses.found], poses.q[poses.found])]
        tried = [(u, found) for u, found in tried if found.missed < _MISSED]
        if not tried:
            break
        u, found = max(tried, key=lambda pair: pair[1].scale)
        if found.scale > best[2]:
            best = float(u), p, found.scale
        rises = slopes(members.model, found)[-members.box.size or None :]
        p, inputs = members.box.furthest(rises), np.unique([u, *inputs[np.abs(inputs - u).argsort()[1:3]]])
    return best
