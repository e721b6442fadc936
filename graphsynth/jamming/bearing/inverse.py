"""Inverse questions: how much misalignment, how little clearance, how much height is still free (section 7.4).

Closed forms in double precision: estimates, not certificates.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from graphsynth.core.checks import checked
from graphsynth.core.errors import GeometryError
from graphsynth.jamming.bearing.bearing import Bearing, Condition
from graphsynth.jamming.verdict import METHOD_CLOSED_FORM
from graphsynth.mechanism.four_bar import TiltedFourBar

__all__ = ["Limit", "largest_height", "largest_misalignment", "smallest_clearance"]


@dataclass(frozen=True)
class Limit:
    """A limiting value, or None with the reason; ``method`` says that it is not certified."""

    value: float | None
    reason: str = ""
    method: str = METHOD_CLOSED_FORM


@checked
def largest_misalignment(linkage: TiltedFourBar, bearing: Bearing, condition: Condition = "A") -> Limit:
    """Largest alpha (radians) for which the whole turn is free; None if every alpha is free, or none.

    Parameters
    ----------
    linkage : TiltedFourBar
    bearing : Bearing
        Dimensions in millimetres.
    condition : {"A", "B"}
        Contact condition: short bearing in a long hole, or long shaft in a short hole.

    Returns
    -------
    Limit
        Closed form in double precision.

    Raises
    ------
    GeometryError
        For the rod of the source (``rod="deck"``).

    Examples
    --------
    >>> round(largest_misalignment(TiltedFourBar(), Bearing()).value, 15)
    0.01516147932502
    """
    critical = bearing.critical_tilt(condition)
    if critical.sine is None:
        if bearing.clearance < 0.0:
            return Limit(None, f"no misalignment is free: {critical.reason}")
        return Limit(None, f"no limit: {critical.reason}")
    if linkage.rod == "deck":
        raise GeometryError('largest_misalignment holds for rod="rigid" only; the deck rod is not a rigid body')
    q = linkage.l3 * critical.sine / linkage.l2
    if critical.reason or q >= 1.0:
        return Limit(None, f"no limit: {critical.reason or 'the tilt never reaches the critical tilt'}")
    inclination = linkage.axis[0] ** 2 + linkage.axis[1] ** 2  # 1 - n3^2
    deficit = q * q / (1.0 + math.sqrt((1.0 - q) * (1.0 + q)))  # 1 - R33 at the limit
    if deficit > 2.0 * inclination:
        return Limit(None, "no limit: the axis is too close to the normal of the plane to reach the critical tilt")
    return Limit(2.0 * math.asin(math.sqrt(0.5 * deficit / inclination)))


def _tilt(linkage: TiltedFourBar) -> tuple[float, float]:
    angle, sine = linkage.largest_tilt
    if linkage.rod == "rigid" and linkage.pin_height > linkage.l3:
        raise GeometryError(
            f"the crank pin rises to {linkage.pin_height}, above l3 = {linkage.l3}: the turn cannot be assembled; "
            "reduce alpha"
        )
    return sine, math.cos(angle)


@checked
def smallest_clearance(linkage: TiltedFourBar, bearing: Bearing, condition: Condition = "A") -> Limit:
    """Smallest radial clearance (mm) for which the whole turn is free, for the radius and height of ``bearing``.

    Parameters
    ----------
    linkage : TiltedFourBar
    bearing : Bearing
        Dimensions in millimetres.
    condition : {"A", "B"}
        Contact condition: short bearing in a long hole, or long shaft in a short hole.

    Returns
    -------
    Limit
        Closed form in double precision.

    Raises
    ------
    GeometryError
        For another condition than "A" and "B".

    Examples
    --------
    >>> round(smallest_clearance(TiltedFourBar(alpha=1 / 30), Bearing()).value, 15)
    0.065099273073546
    """
    S, C = _tilt(linkage)
    R, h = bearing.Rb, bearing.h
    if condition == "B":
        if C == 0.0:
            return Limit(None, "no clearance is enough at a tilt of 90 degrees")
        return Limit((h * S + R * S * S / (1.0 + C)) / C)
    if condition != "A":
        raise GeometryError(f'condition = {condition!r} has no closed form here; use "A" or "B"')
    if h * C < R * S:  # the rim beside the tilt plane decides: D = sqrt(R^2 + h^2)
        return Limit(h * h / (math.hypot(R, h) + R), "R S > h C: the bearing needs room for any tilt")
    return Limit(h * S - R * S * S / (1.0 + C))


@checked
def largest_height(linkage: TiltedFourBar, bearing: Bearing, condition: Condition = "A") -> Limit:
    """Largest height Hb (mm) for which the whole turn is free, for the radius and clearance of ``bearing``.

    Parameters
    ----------
    linkage : TiltedFourBar
    bearing : Bearing
        Dimensions in millimetres.
    condition : {"A", "B"}
        Contact condition: short bearing in a long hole, or long shaft in a short hole.

    Returns
    -------
    Limit
        Closed form in double precision.

    Raises
    ------
    GeometryError
        For another condition than "A" and "B".
    """
    S, C = _tilt(linkage)
    R, c = bearing.Rb, bearing.clearance
    if c < 0.0:
        return Limit(None, "interference fit: no height works")
    if S == 0.0:
        return Limit(None, "no limit: the coupler does not tilt")
    if condition == "B":
        half = (c - bearing.Rh * S * S / (1.0 + C)) / S
        if half < 0.0:
            return Limit(None, "no height works: even a thin plate jams at this tilt")
        return Limit(2.0 * half)
    if condition != "A":
        raise GeometryError(f'condition = {condition!r} has no closed form here; use "A" or "B"')
    half = (c + R * S * S / (1.0 + C)) / S
    if half * C < R * S:
        return Limit(2.0 * math.sqrt(c * (2.0 * R + c)), "R S > h C: the rim beside the tilt plane decides")
    return Limit(2.0 * half)
