"""A four-bar linkage with a tilted motor axis: closed-form motion (model L0).

Crank OA = l2 on a motor axis turned by ``alpha`` about ``axis``, coupler AB = l3 prolonged to the tracing point M,
rocker CB = l4 that stays in the plane z = 0, frame OC = l1.  Joint A is spherical and the bearing at B takes the whole
misalignment.  Every equation is a closed form and free of cancellation near dead points and change points.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import IntEnum
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from graphsynth.core.checks import check_fields, check_sizes, choice, finite, finite_array, positive, sign, unit_vector
from graphsynth.mechanism.rotatability import FullTurn, full_turn

if TYPE_CHECKING:
    from graphsynth.structure.graph import MechanismGraph

Array = NDArray[np.float64]
_BESIDE = 1e-140


class AssemblyStatus(IntEnum):
    """Whether the linkage can be assembled at one crank angle, and if not, which inequality fails."""

    OK = 0
    LIMIT = 1  #: yB = 0: assembled, both branches meet, the velocity of B does not exist
    TILT_EXCEEDS_ROD = 2  #: |A_z| > l3: the rod is shorter than the height of the crank pin
    TOO_FAR = 3  #: D > l4 + s3
    COUPLER_TOO_LONG = 4  #: D < s3 - l4
    ROCKER_TOO_LONG = 5  #: D < l4 - s3
    INDETERMINATE = 6  #: D = 0 and s3 = l4: B is any point of a circle

    @property
    def message(self) -> str:
        """One sentence that says what the status means."""
        return _MESSAGES[self]


_MESSAGES = {
    AssemblyStatus.OK: "assembled",
    AssemblyStatus.LIMIT: "assembled in a limit position: both branches meet and the velocity of B is undefined",
    AssemblyStatus.TILT_EXCEEDS_ROD: "not assembled: |A_z| > l3",
    AssemblyStatus.TOO_FAR: "not assembled: D > l4 + s3",
    AssemblyStatus.COUPLER_TOO_LONG: "not assembled: D < s3 - l4",
    AssemblyStatus.ROCKER_TOO_LONG: "not assembled: D < l4 - s3",
    AssemblyStatus.INDETERMINATE: "not determined: A coincides with C and the coupler equals the rocker",
}


@dataclass(frozen=True, eq=False)
class FourBarPositions:
    """Positions, tilt and derivatives with respect to the crank angle; NaN wherever `assembled` is False.

    Attributes
    ----------
    f : ndarray, shape (...)
        Crank angles, radians.
    A, B, M : ndarray, shape (..., 3)
        Crank pin, bearing centre, tracing point; unit of the link lengths.
    status : ndarray of int8, shape (...)
        `AssemblyStatus` of every angle.
    theta, sin_theta, cos_theta : ndarray, shape (...)
        Signed tilt of the coupler at B (radians) and its sine and cosine, computed without an inverse function.
    dA, dB, dM : ndarray, shape (..., 3)
        Analytical derivatives d/df; NaN also in a limit position (`AssemblyStatus.LIMIT`).
    dtheta : ndarray, shape (...)
        Derivative of the tilt.
    """

    f: Array
    A: Array
    B: Array
    M: Array
    status: NDArray[np.int8]
    theta: Array
    sin_theta: Array
    cos_theta: Array
    dA: Array
    dB: Array
    dM: Array
    dtheta: Array

    @property
    def assembled(self) -> NDArray[np.bool_]:
        """True where the linkage can be assembled."""
        return np.asarray(self.status <= AssemblyStatus.LIMIT)

    def reasons(self) -> list[str]:
        """Sentence of every status that occurs, in the order of `AssemblyStatus`."""
        return [AssemblyStatus(int(code)).message for code in np.unique(self.status)]


@dataclass(frozen=True)
class Straightness:
    """How straight the path of M is over a stroke (estimated: sampled, then refined by local search).

    ``chord`` is the distance between the two ends in the plane, ``lowest`` and ``highest`` the extreme signed distances
    of M from the chord in the plane, at the crank angles ``f_lowest`` and ``f_highest``; ``out_of_plane`` is the
    largest ``|M_z|``.
    """

    chord: float
    lowest: float
    highest: float
    f_lowest: float
    f_highest: float
    out_of_plane: float

    @property
    def deviation(self) -> float:
        """Width of the narrowest strip parallel to the chord that contains the path."""
        return self.highest - self.lowest


@dataclass(frozen=True)
class TiltedFourBar:
    """A planar four-bar linkage driven about a tilted axis; the defaults are Chebyshev's proportions.

    Parameters
    ----------
    l1, l2, l3, l4 : float
        Frame OC, crank OA, coupler AB, rocker CB; any common unit.
    sgn : {+1, -1}
        Assembly branch; +1 puts B above the x axis at f = 0 for the lambda proportions.
    k : float
        BM/AB, position of the tracing point ``M = (1 + k) B - k A``.
    alpha : float
        Angle by which the motor axis is turned, radians.
    axis : sequence of 3 floats
        Direction about which it is turned; normalised here.
    rod : {"rigid", "deck"}
        "rigid" keeps the spatial length AB = l3; "deck" keeps l3 as the plan length, for comparison only.
    convention : {"spec", "deck"}
        "deck" means rotation by ``-alpha``, the matrix of the source with its misprint corrected.

    Raises
    ------
    GeometryError
        A length that is not positive or not between 1e-60 and 1e60, a NaN, an axis without direction, an unknown
        option.

    Notes
    -----
    Model L0 of [Mitrofanova & Bazhenov 2020], corrected; theory/four-bar-and-tilt.

    Examples
    --------
    >>> import numpy as np
    >>> positions = TiltedFourBar().positions([np.pi / 2])
    >>> positions.B[0].round(12).tolist(), positions.M[0].round(12).tolist()
    ([2.0, 2.5, 0.0], [4.0, 4.0, 0.0])
    """

    l1: float = 2.0
    l2: float = 1.0
    l3: float = 2.5
    l4: float = 2.5
    sgn: int = 1
    k: float = 1.0
    alpha: float = 0.0
    axis: tuple[float, float, float] = (1.0, 0.0, 0.0)
    rod: str = "rigid"
    convention: str = "spec"

    def __post_init__(self) -> None:
        for name in ("l1", "l2", "l3", "l4"):
            object.__setattr__(self, name, positive(name, getattr(self, name)))
        for name in ("k", "alpha"):
            object.__setattr__(self, name, finite(name, getattr(self, name)))
        check_fields(self, ("l1", "l2", "l3", "l4"))
        check_sizes("the tracing point", {"1 + |k|": 1.0 + abs(self.k)})
        object.__setattr__(self, "sgn", sign("sgn", self.sgn))
        object.__setattr__(self, "axis", unit_vector("axis", self.axis))
        choice("rod", self.rod, ("rigid", "deck"))
        choice("convention", self.convention, ("spec", "deck"))

    @property
    def _angle(self) -> float:
        return self.alpha if self.convention == "spec" else -self.alpha

    @cached_property
    def rotation(self) -> Array:
        """R(alpha, axis), shape (3, 3): active right-handed rotation of the motor axis."""
        n1, n2, n3 = self.axis
        s, c = math.sin(self._angle), math.cos(self._angle)
        v = 2.0 * math.sin(0.5 * self._angle) ** 2
        return np.array(
            [
                [c + n1 * n1 * v, n1 * n2 * v - n3 * s, n1 * n3 * v + n2 * s],
                [n1 * n2 * v + n3 * s, c + n2 * n2 * v, n2 * n3 * v - n1 * s],
                [n1 * n3 * v - n2 * s, n2 * n3 * v + n1 * s, c + n3 * n3 * v],
            ]
        )

    @property
    def tilted(self) -> bool:
        """Whether the crank pin leaves the plane, also by a height that underflows to zero."""
        return self.axis[:2] != (0.0, 0.0) and math.sin(self._angle) != 0.0

    @cached_property
    def pin_height(self) -> float:
        """Largest |A_z| over a turn, ``l2 hypot(R31, R32)`` without cancellation or squares that underflow."""
        n1, n2, n3 = self.axis
        lift = math.hypot(math.sin(self._angle), 2.0 * math.sin(0.5 * self._angle) ** 2 * n3)
        return self.l2 * math.hypot(n1, n2) * lift

    @cached_property
    def pin_phase(self) -> float:
        """psi1 with ``A_z = pin_height * sin(f - psi1)``, radians; 0 if the pin stays in the plane."""
        return math.atan2(-float(self.rotation[2, 0]), float(self.rotation[2, 1])) if self.tilted else 0.0

    @cached_property
    def largest_tilt(self) -> tuple[float, float]:
        """Largest |theta| over a turn (radians) and its sine; NaN is impossible: the sine is capped at 1."""
        if self.rod == "deck":
            return math.atan2(self.pin_height, self.l3), self.pin_height / math.hypot(self.pin_height, self.l3)
        sine = min(1.0, self.pin_height / self.l3)
        return math.asin(sine), sine

    def _closure(self, f: Array) -> tuple[Array, Array, Array, Array, Array, Array]:
        """Return A, A', s3, ``D^2 - (l4 - s3)^2``, ``(l4 + s3)^2 - D^2`` and the x component of A - C."""
        r, (_, n2, n3) = self.rotation, self.axis
        cf, sf = np.cos(f), np.sin(f)
        A = self.l2 * (r[:, 0] * cf[..., None] + r[:, 1] * sf[..., None])
        dA = self.l2 * (r[:, 1] * cf[..., None] - r[:, 0] * sf[..., None])
        az = A[..., 2]
        v = 2.0 * math.sin(0.5 * self._angle) ** 2 * (n2 * n2 + n3 * n3)
        low = 2.0 * np.sin(0.5 * f) ** 2 + v * cf - r[0, 1] * sf  # (l2 - A_x) / l2
        high = 2.0 * np.cos(0.5 * f) ** 2 - v * cf + r[0, 1] * sf  # (l2 + A_x) / l2
        dx = math.fsum((self.l2, -self.l1)) - self.l2 * low
        l3 = self.l3
        if self.rod == "rigid":
            s3 = np.sqrt(np.maximum((l3 - az) * (l3 + az), 0.0))
            shift = 2.0 * self.l4 * az * az / (l3 + s3)
            shift_far = shift
        else:
            s3 = np.full_like(az, l3)
            shift, shift_far = az * az, -az * az
        near = self._offset("near", 1) + 2.0 * self.l1 * self.l2 * low - shift
        near_high = self._offset("near", -1) - 2.0 * self.l1 * self.l2 * high - shift
        far = self._offset("far", 1) - 2.0 * self.l1 * self.l2 * low - shift_far
        far_high = self._offset("far", -1) + 2.0 * self.l1 * self.l2 * high - shift_far
        small = cf >= 0.0  # expand about the nearer of the two positions in which A lies on OC
        return A, dA, s3, np.where(small, near, near_high), np.where(small, far, far_high), dx

    def _offset(self, which: str, side: int) -> float:
        """``near`` or ``far`` discriminant of the untilted linkage at f = 0 (side +1) or f = pi (side -1)."""
        l1, l2, l3, l4 = self.l1, side * self.l2, self.l3, self.l4
        if which == "near":  # (l1 - l2)^2 - (l4 - l3)^2, each factor rounded once
            return math.fsum((l1, -l2, -l4, l3)) * math.fsum((l1, -l2, l4, -l3))
        return math.fsum((l3, l4, -l1, l2)) * math.fsum((l3, l4, l1, -l2))

    def positions(self, f: ArrayLike) -> FourBarPositions:
        """Positions, tilt and their derivatives at crank angles ``f`` (radians, any shape).

        Accurate to a few units in the last place of the largest length, also beside dead points and change points
        (theory/four-bar-and-tilt 2, 3, 6 to 8).  An angle at which the linkage cannot be assembled gets NaN and a
        status.

        Raises
        ------
        GeometryError
            If ``f`` holds a NaN or an infinity.
        """
        f = finite_array("f", f)
        A, dA, s3, near, far, dx = self._closure(f)
        az, dy = A[..., 2], A[..., 1]
        D = np.hypot(dx, dy)
        # A beside C with coupler and rocker equal: near = D^2, which underflows
        close = (D > 0.0) & (D / self.l4 < _BESIDE)
        beside = close & (s3 == self.l4) & (az * az <= 1e-17 * D * self.l4)
        near = np.where(beside, D, near)  # from here on only its sign counts
        status = self._status(D, az, s3, near, far)
        assembled = status <= AssemblyStatus.LIMIT
        safe = np.where(assembled, D, 1.0)
        ex, ey = dx / safe, dy / safe
        root = np.sqrt(np.where(assembled, np.maximum(near, 0.0) * np.maximum(far, 0.0), np.nan))  # 2 D |yB|
        root = np.where(beside & assembled, D * np.sqrt(np.maximum(far, 0.0)), root)
        xB = 0.5 * (D + (self.l4 - s3) * (self.l4 + s3) / safe)
        yB = self.sgn * 0.5 * root / safe
        B = np.stack([self.l1 + xB * ex + yB * ey, xB * ey - yB * ex, np.where(assembled, 0.0, np.nan)], axis=-1)
        B = np.where(assembled[..., None], B, np.nan)
        dB = self._rocker_velocity(A, dA, B, s3, root)
        theta, sine, cosine, dtheta = self._tilt(az, dA[..., 2], s3)
        M, dM = (1.0 + self.k) * B - self.k * A, (1.0 + self.k) * dB - self.k * dA
        hide = np.where(assembled, 0.0, np.nan)
        return FourBarPositions(f, A, B, M, status, theta + hide, sine + hide, cosine + hide, dA, dB, dM, dtheta + hide)

    def _status(self, D: Array, az: Array, s3: Array, near: Array, far: Array) -> NDArray[np.int8]:
        status = np.zeros(D.shape, dtype=np.int8)
        status[np.logical_or(near == 0.0, far == 0.0)] = AssemblyStatus.LIMIT
        status[np.logical_and(near < 0.0, s3 > self.l4)] = AssemblyStatus.COUPLER_TOO_LONG
        status[np.logical_and(near < 0.0, s3 <= self.l4)] = AssemblyStatus.ROCKER_TOO_LONG
        status[far < 0.0] = AssemblyStatus.TOO_FAR
        status[np.logical_and(D == 0.0, s3 == self.l4)] = AssemblyStatus.INDETERMINATE
        if self.rod == "rigid":
            status[np.abs(az) > self.l3] = AssemblyStatus.TILT_EXCEEDS_ROD
        return status

    def _rocker_velocity(self, A: Array, dA: Array, B: Array, s3: Array, root: Array) -> Array:
        """B' = w x (B - C) from the derivative of |B - A|^2 = s3^2; NaN in a limit position, where root = 0."""
        ba = B[..., :2] - A[..., :2]
        stretch = -A[..., 2] * dA[..., 2] if self.rod == "rigid" else 0.0  # s3 s3'
        moment = stretch + ba[..., 0] * dA[..., 0] + ba[..., 1] * dA[..., 1]
        divisor = np.where(root > 0.0, -0.5 * self.sgn * root, np.nan)  # cross(B - C, B - A)
        w = moment / divisor
        return np.stack([-w * B[..., 1], w * (B[..., 0] - self.l1), np.where(np.isnan(w), np.nan, 0.0)], axis=-1)

    def _tilt(self, az: Array, daz: Array, s3: Array) -> tuple[Array, Array, Array, Array]:
        if self.rod == "rigid":
            sine, cosine = az / self.l3, s3 / self.l3
            with np.errstate(divide="ignore", invalid="ignore"):
                rate = np.where(s3 > 0.0, daz / s3, np.nan)
        else:
            length = np.hypot(self.l3, az)
            sine, cosine, rate = az / length, self.l3 / length, daz * self.l3 / (length * length)
        return np.arctan2(az, s3), sine, cosine, rate

    def full_turn(self) -> FullTurn:
        """Say whether the crank can make a full turn, with limit angles or change points if it cannot.

        See theory/four-bar-and-tilt 3.

        Exact (rational arithmetic on the given lengths) when the crank pin stays in the plane; estimated from the sign
        changes of the discriminants otherwise, and labelled so.
        """
        return full_turn(self)

    def straightness(
        self, start: float = 0.5 * math.pi, stop: float = 1.5 * math.pi, samples: int = 721
    ) -> Straightness:
        """Straightness of the path of M between two crank angles (radians); by default the working stroke 90..270 deg.

        Raises
        ------
        GeometryError
            If the linkage cannot be assembled somewhere on the stroke.
        """
        from graphsynth.mechanism.rotatability import straightness

        return straightness(self, start, stop, samples)

    def graph(self) -> MechanismGraph:
        """Structural graph: a four-bar chain with joints 0-1, 1-2, 2-3, 0-3 and link 0 as the frame."""
        from graphsynth.structure.graph import MechanismGraph

        return MechanismGraph(4, [(0, 1), (1, 2), (2, 3), (0, 3)], frame=0)
