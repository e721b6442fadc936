"""Plane mechanisms put into space: their seats, misaligned or free to lean, and the coordinates of a plane pose.

A misaligned seat is turned about its own point; one that may lean in any direction stands on links of its own, whose
turns are parameters.  See theory/closure-in-space 1 and 8.
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from graphsynth.intervals import Interval, cos, pi, sin
from graphsynth.jamming.joints.limits import RIGID, Misalignment, bounds
from graphsynth.jamming.space.model import SHIFT_X, TURN, Seat, SpaceJoint, SpaceModel, Unsupported
from graphsynth.mechanism.joints import PinSlot, Prismatic, Revolute

if TYPE_CHECKING:
    from graphsynth.jamming.joints.program import JointProblem
    from graphsynth.mechanism.model import Mechanism
    from graphsynth.tolerances.box import LinkPoint, ParameterBox

Array = NDArray[np.float64]
#: So much of a full turn is all directions: a range of them may be rounded.
_ROUND = 1.0 - 1e-12


def leaning(tilt: Misalignment) -> bool:
    """Whether an axis may lean in any direction by any angle up to the largest: the tolerance of an axis."""
    (low, high), (first, last) = bounds(tilt, "alpha"), bounds(tilt, "direction")
    return low <= 0.0 <= high and low < high and last - first >= math.tau * _ROUND


def largest_turn(tilt: Misalignment) -> float:
    """Radius of a disc of turns about x, then y, that holds all leans of an axis: rounded up.

    The axis leans by ``acos(cos x cos y)``.  Of one lean ``x^2 + y^2`` is largest where both are equal, because
    ``log cos sqrt`` is concave; there ``sin x`` is the square root of 2 times the sine of half the lean.
    """
    half = 0.5 * max(map(abs, bounds(tilt, "alpha")))
    return math.sqrt(2.0) * math.asin(math.sqrt(2.0) * math.sin(half)) * (1.0 + 1e-12)


def largest_spin(tilt: Misalignment) -> float:
    """How far the turns of a leaning axis may spin its seat, against the least rotation of the axis: rounded up.

    Turns a and b are the least rotation of the axis and a spin ``2 atan(tan(a / 2) tan(b / 2))`` about it.
    """
    return 2.0 * math.tan(0.5 * largest_turn(tilt)) ** 2 * (1.0 + 1e-12)


def in_space(given: JointProblem, box: ParameterBox | None = None) -> SpaceModel:
    """Put a plane mechanism with limits and misaligned axes into space, and the parameters of a box of dimensions.

    The last parameters are two turns of every axis that is `leaning`; without a box all are nominal.  Raises
    `Unsupported` for gears, cams and driven slots.
    """
    mechanism = given.mechanism
    box = box if box is not None and box.size else None
    by_pair = {tilt.pair: tilt for tilt in given.misalignments}
    lean = [] if box is None else [tilt.pair for tilt in given.misalignments if leaning(tilt)]
    spun = [pair for pair in lean if not isinstance(mechanism.joint(*pair), Revolute)]
    driven = {driver.pair for driver in mechanism.drivers}
    joints: list[SpaceJoint] = []
    mounts: list[SpaceJoint] = []
    for k, (joint, limits) in enumerate(zip(mechanism.joints, given.limits)):
        if not isinstance(joint, Revolute | Prismatic | PinSlot) or (
            isinstance(joint, PinSlot) and joint.pair in driven
        ):
            raise Unsupported(f"joint {joint.a}-{joint.b} ({joint.kind}) is not described in space; use small tilts")
        tilt = by_pair.get(joint.pair)
        guide = not isinstance(joint, Revolute)
        seats: list[Seat] = []
        links = [joint.a, joint.b]
        for link, at, angle in ((joint.a, joint.at_a, "angle_a"), (joint.b, joint.at_b, "angle_b")):
            own = tilt if tilt is not None and tilt.base == link else None
            loose = own is not None and joint.pair in lean
            seat = _plane_seat(at, getattr(joint, angle, 0.0), own)
            seat = replace(seat, turn=(0.0, 0.0, 0.0), turn_box=None) if loose else seat
            seat = seat if box is None else _toleranced(seat, box.points[k][len(seats)], box)
            if own is not None and box is not None and loose:
                first = box.size - len(spun) - 2 * (len(lean) - lean.index(joint.pair))
                numbers = [first, first + 1]
                if guide:
                    numbers.append(box.size - len(spun) + spun.index(joint.pair))
                mounts += _leaning_seat(seat, (link, mechanism.graph.links + len(mounts)), numbers, own)
                seat, links[len(seats)] = Seat(spin=seat.spin), mechanism.graph.links + len(mounts) - 1
            seats.append(seat)
        own_driven = joint.pair in driven
        turns = not isinstance(joint, Prismatic)
        joints.append(SpaceJoint(links[0], links[1], seats[0], seats[1], limits, own_driven, guide, turns))
    count = mechanism.graph.links + len(mounts)
    return SpaceModel((*joints, *mounts), count, mechanism.frame, 0 if box is None else box.size)


def _leaning_seat(seat: Seat, links: tuple[int, int], numbers: list[int], tilt: Misalignment) -> list[SpaceJoint]:
    """Joints from a seat to links that turn about x, then y, then z where asked for, by parameters of these numbers.

    ``links``: that of the seat, and the first new one.  The x axis points in the direction of the misalignment.
    """
    way, half, joints = Interval(tilt.direction), pi() / 2, []
    c, s, none = half * cos(way), half * sin(way), Interval(0)
    ways = [[-s, c, none], [-c, -s, none], [none, none, none]]  # z to x, z to y, z
    most, before = (largest_turn(tilt), largest_turn(tilt), largest_spin(tilt)), links[0]
    for k, (number, turn) in enumerate(zip(numbers, ways)):
        box = Interval.stack(turn)
        own = Seat(turn=tuple(box.mid.tolist()), turn_box=box)
        base = own if k else replace(seat, turn=own.turn, turn_box=box, spin=0.0)
        joints.append(SpaceJoint(before, links[1] + k, base, own, RIGID, parameter=number, lean=most[k]))
        before = links[1] + k
    return joints


def _toleranced(seat: Seat, point: LinkPoint, box: ParameterBox) -> Seat:
    """Seat whose point moves with the parameters of a box; counted from where the point of the box is.

    With a temperature, lengths times growth are of second order: they are enclosed over the whole box.
    """
    still, none = point.place([Interval(0)] * box.size), Interval(0)
    moves = {k: Interval.stack([none + x, none + y, none]) for k, x, y in point.terms}
    place = Interval.stack([still.x, still.y, none])
    if point.growth:
        from_datum = point._replace(fixed=False, growth=0.0).place([none] * box.size)
        moves[point.heat] = Interval.stack([from_datum.x, from_datum.y, none]) * point.growth
        whole = box.whole
        for k, x, y in point.terms:
            both = whole[k] * whole[point.heat] * point.growth
            place = place + Interval.stack([both * x, both * y, none])
    return replace(seat, point=tuple(place.mid.tolist()), point_box=place, moves=tuple(moves.items()))


def _plane_seat(at: tuple[float, float], angle: float, tilt: Misalignment | None) -> Seat:
    """Seat of a joint of a plane mechanism, turned in the plane (a guide) or out of it (a misaligned axis)."""
    if tilt is None:
        return Seat((*at, 0.0), (0.0, 0.0, angle))
    tilt = tilt.sharp() if leaning(tilt) else tilt
    alpha, direction = (Interval.from_bounds(*bounds(tilt, name)) for name in ("alpha", "direction"))
    if alpha.contains(0.0) and tilt.alpha_range != (0.0, 0.0):
        raise Unsupported("a range of misalignments around zero has no single direction; use small tilts")
    box = Interval.stack([alpha * cos(direction), alpha * sin(direction), Interval(0)])
    return Seat((*at, 0.0), tuple(box.mid.tolist()), box, spin=angle)


def start(model: SpaceModel, mechanism: Mechanism, pose: Array) -> Array:
    """Unknowns and given coordinates (width,) of a plane pose (links, 3): those of the plane mechanism, all else 0."""
    q = np.zeros(model.width)
    for joint, own, column in zip(mechanism.joints, model.joints, model.column):
        (xa, ya, ta), (xb, yb, tb) = pose[joint.a], pose[joint.b]
        angles = getattr(joint, "angle_a", 0.0), getattr(joint, "angle_b", 0.0)
        if column[TURN] >= 0:
            q[column[TURN]] = tb + angles[1] - ta - angles[0]
        if own.guide and column[SHIFT_X] >= 0:
            a = complex(xa, ya) + complex(*joint.at_a) * np.exp(1j * ta)
            b = complex(xb, yb) + complex(*joint.at_b) * np.exp(1j * tb)
            q[column[SHIFT_X]] = ((b - a) * np.exp(-1j * (ta + angles[0]))).real / model.unit
    return q


def driven_at(model: SpaceModel, mechanism: Mechanism, u: Interval) -> Interval:
    """Enclose the given coordinates (N, drivers) at inputs (N,), in the order of their columns, lengths in units."""
    given = []
    for joint, own in zip(mechanism.joints, model.joints):
        for driver in mechanism.drivers:
            if driver.pair != joint.pair:
                continue
            law: Any = driver.law
            if not hasattr(law, "at"):
                raise Unsupported(f"the law {type(law).__name__} of a driver is not enclosed; use Linear or Harmonic")
            value = law.at(u, sin, cos)[0]
            value = value if driver.base == joint.a else -value
            given.append(value / model.unit if own.guide else value)
    return Interval.stack(given, axis=-1) if given else Interval.zeros((*u.shape, 0))
