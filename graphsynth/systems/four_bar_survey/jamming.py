"""The tilted bearing of many four-bars at once: the closed forms of `graphsynth.jamming` by set (model L0)."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from graphsynth.systems.four_bar_survey.system import SurveyTable

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class Jamming:
    """What the bearing between coupler and rocker does, by set (estimated: closed forms in floating point).

    Attributes
    ----------
    tilt : ndarray
        Largest tilt of the coupler over the turn, radians.
    part : ndarray
        Part of the turn in which the bearing jams, 0 to 1.
    axis_tilt : ndarray
        Largest tilt of the motor axis for which the whole turn is free, radians; pi/2 if every tilt is.
    clearance : ndarray
        Smallest radial clearance for which the whole turn is free, mm.
    """

    tilt: Array
    part: Array
    axis_tilt: Array
    clearance: Array


def close_form(table: SurveyTable, lengths: NDArray[np.int64]) -> Jamming:
    """Judge the bearing for sets of lengths (frame, crank, coupler, rocker); only crank over coupler matters.

    As `jam_arcs`, `largest_misalignment` and `smallest_clearance` of :mod:`graphsynth.jamming`, set by set
    (theory/bearing-contact 7 and theory/jam-arcs 1, 4).
    """
    from graphsynth.jamming.bearing.bearing import Bearing
    from graphsynth.mechanism.four_bar import TiltedFourBar

    own = table.bearing
    bearing = Bearing(own.radius_mm, own.height_mm, own.clearance_mm)
    unit = TiltedFourBar(1.0, 1.0, 1.0, 1.0, alpha=table.tilt.alpha, axis=table.tilt.axis)
    ratios, which = np.unique(lengths[:, 1] / lengths[:, 2], return_inverse=True)
    sine = np.minimum(unit.pin_height * ratios, 1.0)
    critical = bearing.critical_tilt(own.condition)
    touches_only = bool(critical.reason)
    if critical.sine is None or touches_only:  # a clearance is never negative here: free at any tilt
        part, axis = np.zeros(len(ratios)), np.full(len(ratios), 0.5 * math.pi)
    else:
        part = _jammed_part(critical.sine, unit.pin_height * ratios)
        axis = _largest_axis_tilt(critical.sine / ratios, unit.axis)
    clearance = _smallest_clearance(sine, bearing.Rb, bearing.h, own.condition)
    return Jamming(np.arcsin(sine)[which], part[which], axis[which], clearance[which])


def _jammed_part(critical: float, height: Array) -> Array:
    """Two arcs of ``2 arccos kappa`` each, kappa the critical sine over the largest (16 units are touching)."""
    with np.errstate(divide="ignore", invalid="ignore"):
        kappa = np.where(height > 0.0, critical / height, np.inf)
    return np.where(kappa < 1.0 - 16 * 2.0**-52, 2.0 / math.pi * np.arccos(np.minimum(kappa, 1.0)), 0.0)


def _largest_axis_tilt(q: Array, axis: tuple[float, float, float]) -> Array:
    """Tilt of the axis at which the pin is as high as the critical tilt needs: q times the crank."""
    inclination = axis[0] ** 2 + axis[1] ** 2
    inside = np.minimum(q, 1.0)
    deficit = inside * inside / (1.0 + np.sqrt((1.0 - inside) * (1.0 + inside)))
    with np.errstate(divide="ignore", invalid="ignore"):
        share = np.where(deficit <= 2.0 * inclination, 0.5 * deficit / inclination, np.nan)
    reached = np.isfinite(share) & (q < 1.0)
    return np.where(reached, 2.0 * np.arcsin(np.sqrt(np.where(reached, share, 0.0))), 0.5 * math.pi)


def _smallest_clearance(sine: Array, radius: float, half: float, condition: str) -> Array:
    cosine = np.sqrt((1.0 - sine) * (1.0 + sine))
    bulge = radius * sine * sine / (1.0 + cosine)
    if condition == "B":
        with np.errstate(divide="ignore"):
            return np.where(cosine > 0.0, (half * sine + bulge) / cosine, np.inf)
    rim = half * half / (math.hypot(radius, half) + radius)
    return np.where(half * cosine < radius * sine, rim, half * sine - bulge)
