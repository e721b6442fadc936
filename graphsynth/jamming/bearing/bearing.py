"""A bearing in a hole: contact conditions, interference in stable form, critical tilt.

The interference is negative when the parts are free, zero when they touch and positive when rigid parts would have to
overlap.  All dimensions are in millimetres, as on a drawing; only their ratios decide a verdict.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from fractions import Fraction
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from graphsynth.core.checks import check_fields, choice, finite, finite_array, not_negative, positive
from graphsynth.core.errors import GeometryError

Array = NDArray[np.float64]
Condition = Literal["A", "B", "general"]
CONDITIONS = ("A", "B", "general")


@dataclass(frozen=True)
class CriticalTilt:
    """Tilt at which the clearance is used up: its angle (radians) and sine, None if there is none.

    ``reason`` says why there is none, or holds a remark ("touches but never overlaps"); empty otherwise.
    """

    angle: float | None
    sine: float | None
    reason: str
    condition: str


@dataclass(frozen=True)
class Bearing:
    """A cylinder of radius Rb and height Hb in a hole of radius ``Rb + clearance`` (theory/bearing-contact).

    Both parts are axially centred; their axes cross at the centre.

    Parameters
    ----------
    Rb, Hb : float
        Radius of the inner cylinder, millimetres; height of the bearing (condition A), or length of the hole (condition
        B), millimetres; zero is a thin plate.
    clearance : float
        Radial clearance, millimetres, above ``-Rb``; negative means an interference fit.
    hole_length : float, optional
        Length of the hole for condition "general" (pin of height Hb in a hole of that length), millimetres.

    Raises
    ------
    GeometryError
        A radius that is not positive, a negative height, a clearance of ``-Rb`` or less, a NaN, a size beyond 1e60 or
        between 0 and 1e-60.

    Examples
    --------
    >>> Bearing().critical_tilt("A").angle
    0.00606439655915642
    """

    Rb: float = 17.5
    Hb: float = 10.0
    clearance: float = 0.03
    hole_length: float | None = None

    def __post_init__(self) -> None:
        object.__setattr__(self, "Rb", positive("Rb", self.Rb))
        object.__setattr__(self, "Hb", not_negative("Hb", self.Hb))
        object.__setattr__(self, "clearance", finite("clearance", self.clearance))
        if self.clearance <= -self.Rb:
            raise GeometryError(f"clearance = {self.clearance} mm leaves no hole; it must exceed -Rb = {-self.Rb} mm")
        if self.hole_length is not None:
            object.__setattr__(self, "hole_length", positive("hole_length", self.hole_length))
        check_fields(self, ("Rb", "Hb", "hole_length"), small=("clearance",))

    @property
    def Rh(self) -> float:
        """Radius of the hole, millimetres."""
        return self.Rb + self.clearance

    @property
    def h(self) -> float:
        """Half height ``Hb / 2``, millimetres."""
        return 0.5 * self.Hb

    @property
    def _slack(self) -> Fraction:
        """``c (2 R + c) = Rh^2 - R^2`` exactly."""
        c = Fraction(self.clearance)
        return c * (2 * Fraction(self.Rb) + c)

    def _hole_half(self, condition: str) -> float:
        choice("condition", condition, CONDITIONS)
        if condition != "general":
            return math.inf
        if self.hole_length is None:
            raise GeometryError(
                'condition "general" needs Bearing(hole_length=...); give it, or use condition "A" or "B"'
            )
        return 0.5 * self.hole_length

    def interference(self, sine: ArrayLike, cosine: ArrayLike, condition: Condition = "A") -> Array:
        """Interference g (millimetres) for sine and cosine of the tilt: free < 0, touching = 0, binding > 0.

        Stable forms of theory/bearing-contact 6; relative error of a few units in the last place of the largest term,
        so that interferences of a micrometre keep ten digits.  Only ``|sine|`` and a non-negative cosine matter.
        """
        half = self._hole_half(condition)
        S, C = np.abs(finite_array("sine", sine, nan=True)), finite_array("cosine", cosine, nan=True)
        if condition == "B":
            return self._interference_b(S, C, self.h)
        # sqrt(R^2 + h^2) - Rh without cancellation: the second branch of theory/bearing-contact 2
        saturated = float(Fraction(self.h) ** 2 - self._slack) / (math.hypot(self.Rb, self.h) + self.Rh)
        upright = self.h * S - self.clearance - self.Rb * S * S / (1.0 + C)
        interference = np.where(self.Rb * S <= self.h * C, upright, saturated)
        if condition == "general":
            slanted = np.logical_and(self.h * C - self.Rb * S > half, C > 0.0)
            with np.errstate(divide="ignore", invalid="ignore"):
                interference = np.where(slanted, self._interference_b(S, C, min(half, self.h)) / C, interference)
        return interference

    def _interference_b(self, S: Array, C: Array, half: float) -> Array:
        return np.asarray(half * S - self.clearance + self.Rh * S * S / (1.0 + C))

    def critical_tilt(self, condition: Condition = "A") -> CriticalTilt:
        """Smallest tilt at which the parts touch, or None with the reason (theory/bearing-contact 7).

        The existence test is exact for the given double-precision dimensions; the angle is a closed form in double
        precision.
        """
        half = self._hole_half(condition)
        if self.clearance < 0.0:
            return CriticalTilt(None, None, "interference fit: the parts overlap at every tilt", condition)
        if condition == "B":
            return self._critical_b(self.h, condition)
        if condition == "general" and half < self.h:
            slanted = self._critical_b(half, condition)
            S, C = math.sin(slanted.angle or 0.0), math.cos(slanted.angle or 0.0)
            if self.h * C - self.Rb * S > half:
                return slanted
        room = Fraction(self.h) ** 2 - self._slack
        if room < 0 or self.h == 0.0:  # a disc (h = 0) never leaves the hole, whatever the clearance
            text = "h^2 < c (2R + c): the bearing turns freely in the hole at any tilt"
            if self.h == 0.0:
                text = "h = 0: a disc never leaves the hole at any tilt"
            return CriticalTilt(None, None, text, condition)
        q = self.clearance / (self.h + math.sqrt(float(room)))
        text = "h^2 = c (2R + c): the parts touch but never overlap" if room == 0 else ""
        return CriticalTilt(2.0 * math.atan(q), 2.0 * q / (1.0 + q * q), text, condition)

    def _critical_b(self, half: float, condition: str) -> CriticalTilt:
        root = math.sqrt(float(Fraction(half) ** 2 + self._slack))
        q = self.clearance / (half + root) if self.clearance > 0.0 else 0.0
        return CriticalTilt(2.0 * math.atan(q), 2.0 * q / (1.0 + q * q), "", condition)
