"""Tolerances of parts for the certificates: limits of joints from fits and end floats, axes, box of dimensions."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import replace
from fractions import Fraction
from typing import Any, NamedTuple, TypeAlias

from graphsynth.core.checks import finite
from graphsynth.core.errors import GeometryError
from graphsynth.jamming.bearing.bearing import Bearing
from graphsynth.jamming.bearing.fits import Fit
from graphsynth.jamming.joints.limits import JointLimits, Misalignment, SlideLimits, bearing_limits, pair_tilt
from graphsynth.jamming.joints.program import Bearings
from graphsynth.mechanism.model import Mechanism
from graphsynth.tolerances.box import ParameterBox, relative_box
from graphsynth.tolerances.parts import (
    AxisAngle,
    EndFloat,
    FitClearance,
    Parallelism,
    PartTolerance,
    checked_tolerances,
    parameter_box,
)

#: One relative number for every coordinate of a joint, or tolerances of parts.
Tolerances: TypeAlias = float | Iterable[PartTolerance]


class Drawn(NamedTuple):
    """What the certificates take: bearings or limits, misalignments, and the box of the dimensions."""

    bearings: Bearings
    tilts: tuple[Misalignment, ...]
    box: ParameterBox


def drawn(
    mechanism: Mechanism,
    bearings: Bearings | None,
    tilts: Misalignment | Iterable[Misalignment],
    tolerances: Tolerances,
) -> Drawn:
    """Put tolerances into limits, misalignments and a box of parameters.

    A number is the relative half width of every coordinate of a joint.  Of parts: a fit replaces the limits of its
    joint, an end float their axial clearance; an axis that may lean in any direction is one more misalignment.
    `GeometryError` for two statements about the same thing.
    """
    axes = tuple(tilts) if isinstance(tilts, Iterable) else (tilts,)
    if not isinstance(tolerances, Iterable) or isinstance(tolerances, str):
        share = finite("tolerances", tolerances)
        if not 0.0 <= share < 0.5:
            raise GeometryError(f"tolerances = {share} must be a relative half width from 0 to 0.5, or a list of parts")
        if bearings is None:
            raise GeometryError("the joints have no limits; give bearings, or a fit for every joint")
        return Drawn(bearings, axes, relative_box(mechanism, share))
    given = checked_tolerances(tolerances)
    leaning = tuple(_axis(mechanism, own) for own in given if isinstance(own, AxisAngle | Parallelism))
    return Drawn(_limits(mechanism, bearings, given), (*axes, *leaning), parameter_box(mechanism, given))


def _axis(mechanism: Mechanism, own: AxisAngle | Parallelism) -> Misalignment:
    mechanism.joint(own.link, own.to)
    return Misalignment(
        own.link, own.to, 0.0, rigid=False, alpha_range=(0.0, own.angle), direction_range=(0.0, math.tau)
    )


def _limits(mechanism: Mechanism, bearings: Bearings | None, given: tuple[PartTolerance, ...]) -> Bearings:
    """Limits of all joints; those without a statement keep what ``bearings`` says."""
    own: dict[tuple[int, int], Any] = {}
    if isinstance(bearings, Mapping):
        own = {(min(pair), max(pair)): limits for pair, limits in bearings.items()}
    elif bearings is not None:
        own = {joint.pair: bearings for joint in mechanism.joints if joint.kind == "R" or not _round(bearings)}
    seen = set()
    for one in given:
        if not isinstance(one, FitClearance | EndFloat):
            continue
        pair = mechanism.joint(*one.joint).pair
        if (type(one), pair) in seen:
            raise GeometryError(f"joint {pair[0]}-{pair[1]} has two tolerances of one kind; give one")
        seen.add((type(one), pair))
    for fit in (one for one in given if isinstance(one, FitClearance)):
        own[mechanism.joint(*fit.joint).pair] = fit_limits(fit)
    for play in (one for one in given if isinstance(one, EndFloat)):
        pair = mechanism.joint(*play.joint).pair
        if pair not in own:
            raise GeometryError(f"joint {pair[0]}-{pair[1]} has an end float, but no limits; give a fit, or bearings")
        own[pair] = _with_play(own[pair], play)
    return own


def _round(limits: Any) -> bool:
    return isinstance(limits, Bearing)


def _with_play(limits: Bearing | JointLimits | SlideLimits, play: EndFloat) -> JointLimits | SlideLimits:
    """Limits with an end float, which is twice what the joint may slip to either side."""
    if isinstance(limits, Bearing):
        limits = bearing_limits(limits)
    ends = 0.5 * play.least, 0.5 * play.most
    return replace(limits, axial_clearance=0.5 * (ends[0] + ends[1]), axial_clearance_range=ends)


def fit_limits(given: FitClearance) -> JointLimits:
    """Limits of a joint whose clearance is an ISO 286 fit: the critical tilt, enclosed for every pair of parts.

    The critical tilt grows with the hole and falls with the shaft and the height, so that both ends of its range are
    those of pairs that exist: the largest shaft in the smallest hole, and the smallest in the largest.  Sizes are those
    at the temperature of the drawing.

    Examples
    --------
    >>> limits = fit_limits(FitClearance((1, 2), "35 H7/g6", 10.0))
    >>> [round(bound, 6) for bound in limits.tilt_range]
    [0.000901, 0.005045]
    """
    fit, height, more = Fit.read(given.fit), Fraction(given.height), Fraction(given.height_tolerance)
    if more >= height:
        raise GeometryError(
            f"height_tolerance = {given.height_tolerance} mm leaves no height of {given.height}; reduce it"
        )
    ends = [
        pair_tilt(radius, length, clearance, given.condition)
        for (radius, clearance), length in ((fit.pair(False), height + more), (fit.pair(True), height - more))
    ]
    least, most = ends[0][0], ends[1][1]
    bearing = Bearing(fit.radius.middle, given.height, fit.clearance.middle)
    middle = bearing_limits(bearing, "A" if given.condition == "A" else "B").tilt
    return JointLimits(min(max(middle, least), most), tilt_range=(least, most))
