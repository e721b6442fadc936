"""The four-bar drive of one leg: closed-form motion, exact full-turn statement, lock angles, dead points.

The wheels: one pinion and three equal wheels at 120 degrees: ratio, tooth orientation, keying, collision.
"""

from __future__ import annotations

import cmath
import math
from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from graphsynth.core.checks import check_fields, check_sizes, finite, not_negative, plane_point, positive, sign
from graphsynth.core.errors import GeometryError
from graphsynth.kinematics.triad.leg import solve_leg
from graphsynth.mechanism.rotatability import FourBarRotation, four_bar_rotation

Array = NDArray[np.float64]


@dataclass(frozen=True)
class GearTrain:
    """Pinion with ``z1`` teeth on the motor shaft, three wheels with ``z2`` teeth around it.

    Source: theory/platform-drive 2.

    Raises `GeometryError`: numbers of teeth that are not positive integers.

    >>> train = GearTrain(30, 60)
    >>> train.ratio, train.same_in_fixed_frame, train.same_in_leg_frame
    (-0.5, True, True)
    """

    z1: int = 30
    z2: int = 60

    def __post_init__(self) -> None:
        for name in ("z1", "z2"):
            teeth = getattr(self, name)
            if not isinstance(teeth, int) or teeth < 1:
                raise GeometryError(f"{name} = {teeth!r} is not a number of teeth; give a positive integer")

    @property
    def ratio(self) -> float:
        """Wheel speed over motor speed, negative for an external mesh."""
        return -self.z1 / self.z2

    @property
    def same_in_fixed_frame(self) -> bool:
        """The three wheels can carry the same tooth orientation in the fixed frame (exact)."""
        return (self.z1 + self.z2) % 3 == 0

    @property
    def same_in_leg_frame(self) -> bool:
        """The three wheels can carry the same tooth orientation relative to their own leg (exact)."""
        return self.z1 % 3 == 0

    def wheel_angle(self, direction: float, pinion: float = 0.0) -> float:
        """Return a tooth angle chi_k that meshes, in [0, 2 pi / z2); the others follow in steps of 2 pi / z2.

        ``direction`` is the angle of the wheel axis seen from the pinion, ``pinion`` the angle of a pinion tooth
        centre, both in radians.
        """
        turns = self.z1 * (direction - pinion) / math.tau + self.z2 * (direction + math.pi) / math.tau - 0.5
        return (turns % 1.0) * (math.tau / self.z2)

    def wheels_clear(self, module: float = 1.0, addendum: float = 0.0) -> bool:
        """Tell whether neighbouring wheels stay apart, with ``addendum`` added to their pitch radii for ``module``."""
        module, addendum = positive("module", module), not_negative("addendum", addendum)
        return 0.5 * math.sqrt(3.0) * module * (self.z1 + self.z2) > module * self.z2 + 2.0 * addendum


class Event(NamedTuple):
    """Something that happens at one input angle.

    ``kind`` is "drive lock", "change point", "rocker dead centre", "platform singular", "leg boundary" or
    "mode mismatch"; ``psi`` in radians; ``leg`` is 1 to 3, or 0 for the platform; ``ends_motion`` tells whether the
    motion stops there; ``pose`` is the last pose reached before a platform singularity.
    """

    kind: str
    psi: float
    leg: int
    ends_motion: bool
    statement: str
    pose: tuple[float, float, float] | None = None


class DriveMotion(NamedTuple):
    """Rocker of the drive: ``phi`` in its leg frame (radians), d/dpsi, d2/dpsi2, ``h_phi = tau S_B``, leg status."""

    phi: Array
    phi1: Array
    phi2: Array
    h_phi: Array
    status: NDArray[np.int8]


class DriveTurn(NamedTuple):
    """Exact statement on a full rotation.

    ``kind`` is "full turn", "change point", "limited", "immovable" or "never assembled"; ``admissible`` lists the
    intervals of the wheel angle psi (radians) inside the reach; None means every psi.
    """

    kind: str
    admissible: tuple[tuple[float, float], ...] | None


@dataclass(frozen=True)
class FourBarDrive:
    """Crank on a wheel axis, coupler, rocker arm; all in the frame of the leg.

    `axis`, `pivot`: wheel axis O and rocker pivot D in the frame of the leg. `crank`, `coupler`, `rocker`: l_B (zero or
    more), l_BC, l_CD. `phase`: crank angle minus psi, measured in the frame of the leg, radians. `tau` (one of {+1,
    -1}): assembly branch of the four-bar. Raises `GeometryError`: lengths that are not positive, or both fixed points
    at one place; sizes beyond 1e60 or between 0 and 1e-60. See theory/platform-drive 3 to 5.

    >>> drive = FourBarDrive(45, 105 + 45j, 12.0, 45.0, 60.0)
    >>> round(float(drive.motion(0.7).phi), 12), drive.turn().kind
    (-1.761428034867, 'full turn')
    """

    axis: complex
    pivot: complex
    crank: float
    coupler: float
    rocker: float
    phase: float = 0.0
    tau: int = 1

    def __post_init__(self) -> None:
        for name in ("axis", "pivot"):
            object.__setattr__(self, name, plane_point(name, getattr(self, name)))
        object.__setattr__(self, "crank", not_negative("crank", self.crank))
        for name in ("coupler", "rocker"):
            object.__setattr__(self, name, positive(name, getattr(self, name)))
        object.__setattr__(self, "phase", finite("phase", self.phase))
        object.__setattr__(self, "tau", sign("tau", self.tau))
        if self.axis == self.pivot:
            raise GeometryError(f"axis and pivot coincide at {self.axis}; the drive needs two different fixed points")
        check_fields(self, ("crank", "coupler", "rocker", "axis", "pivot"))
        check_sizes("FourBarDrive", {"distance of axis and pivot": self.axis - self.pivot})

    def motion(self, psi: ArrayLike) -> DriveMotion:
        """Rocker angle and its first two derivatives with respect to psi (radians, any shape).

        NaN with a status where the drive cannot be assembled; the derivatives are also NaN where it locks
        (``h_phi = 0``).
        """
        arm = np.asarray(self.crank * np.exp(1j * (np.asarray(psi, dtype=np.float64) + self.phase)))
        w = (self.axis - self.pivot) + arm
        leg = solve_leg(w.real, w.imag, self.rocker, self.coupler)
        phi = leg.angle(self.tau)
        rocker = self.rocker * np.exp(1j * phi)
        link = rocker - w  # C - B
        moment = np.where(leg.S > 0.0, self.tau * leg.S / 2.0, np.nan)  # cross(C - D, C - B)
        phi1 = (np.conj(link) * (1j * arm)).real / moment
        speed = 1j * rocker * phi1 - 1j * arm
        phi2 = ((np.conj(link) * (rocker * phi1 * phi1 - arm)).real - np.abs(speed) ** 2) / moment
        return DriveMotion(phi, phi1, phi2, self.tau * leg.S, leg.status)

    def turn(self) -> DriveTurn:
        """Whether the crank turns fully, decided in exact arithmetic on the given numbers (theory/platform-drive 5)."""
        state, square = self._rotation()
        if state.kind not in ("limited", "immovable"):
            return DriveTurn(state.kind, () if state.kind == "never assembled" else None)
        return DriveTurn(state.kind, self._limited(square))

    def _rotation(self) -> tuple[FourBarRotation, float]:
        """Exact statement on the rotation, and the square of the distance of the fixed points."""
        x, y = (Fraction(getattr(self.axis, s)) - Fraction(getattr(self.pivot, s)) for s in ("real", "imag"))
        square = x * x + y * y
        crank, rocker, coupler = (Fraction(length) for length in (self.crank, self.rocker, self.coupler))
        if crank == 0:
            inside = (rocker - coupler) ** 2 <= square <= (rocker + coupler) ** 2
            return FourBarRotation("full turn" if inside else "never assembled", (False, False), ()), float(square)
        return four_bar_rotation(square, crank, coupler, rocker), float(square)

    def _limited(self, square: float) -> tuple[tuple[float, float], ...]:
        """Return the admissible angles of a crank that can be somewhere."""
        span = 2.0 * math.sqrt(square) * self.crank
        bounds = abs(self.rocker - self.coupler), self.rocker + self.coupler
        low, high = ((bound * bound - square - self.crank**2) / span for bound in bounds)
        inner = math.acos(max(-1.0, min(high, 1.0)))
        outer = math.acos(min(1.0, max(low, -1.0)))
        shift = cmath.phase(self.axis - self.pivot) - self.phase
        if high >= 1.0:
            intervals = [(-outer, outer)]
        elif low <= -1.0:
            intervals = [(inner, math.tau - inner)]
        else:
            intervals = [(inner, outer), (-outer, -inner)]
        return tuple((start + shift, stop + shift) for start, stop in intervals)

    def barriers(self) -> tuple[str, str, list[float]]:
        """Tell what the crank cannot pass on a definite branch: kind and meaning of the event, wheel angles psi.

        The angles are closed forms in double precision; whether there are any is decided exactly (see `turn`).
        """
        state, square = self._rotation()
        if state.kind in ("limited", "immovable"):
            locks = [bound for interval in self._limited(square) for bound in interval]
            return "drive lock", "locks: coupler and rocker in line; the crank cannot pass", locks
        text = "reaches a change point: the branches tau = +1 and tau = -1 meet and both continue; choose one"
        shift = cmath.phase(self.axis - self.pivot) - self.phase  # the pin is farthest from the pivot here
        touches = state.touches if state.kind == "change point" else ()
        return "change point", text, [angle for angle, met in zip((shift + math.pi, shift), touches) if met]

    def dead_points(self) -> tuple[float, ...]:
        """Wheel angles psi in [0, 2 pi) at which crank and coupler are in line, so that the rocker reverses."""
        if self.crank == 0.0:
            return ()
        offset = self.axis - self.pivot
        found = []
        for reach in (self.crank + self.coupler, self.crank - self.coupler):
            if reach == 0.0:
                continue
            cosine = (self.rocker**2 - abs(offset) ** 2 - reach**2) / (2.0 * abs(offset) * reach)
            if abs(cosine) > 1.0:
                continue
            for side in (1.0, -1.0):
                direction = cmath.exp(1j * (cmath.phase(offset) + side * math.acos(cosine)))
                rocker, link = offset + reach * direction, (reach - self.crank) * direction
                if math.copysign(1.0, (rocker.conjugate() * link).imag) == self.tau:
                    found.append((cmath.phase(direction) - self.phase) % math.tau)
        return tuple(sorted(found))


def first_barrier(drives: Sequence[FourBarDrive], psi: Array) -> Event | None:
    """First drive lock or change point after psi[0] up to psi[-1]: no continuation may step over it."""
    start, found = float(psi[0]), []
    for number, drive in enumerate(drives, start=1):
        kind, text, angles = drive.barriers()
        for angle in angles:
            at = start + (angle - start) % math.tau
            if start < at <= float(psi[-1]):
                found.append(Event(kind, at, number, True, f"drive {number} {text}"))
    return min(found, key=lambda event: event.psi, default=None)
