"""A four-bar linkage with a tilted motor axis: closed-form motion (model L0).

Crank OA = l2 on a motor axis turned by ``alpha`` about ``axis``, coupler AB = l3 prolonged to the tracing point M,
rocker CB = l4 that stays in the plane z = 0, frame OC = l1.  Joint A is spherical and the bearing at B takes the whole
misalignment.  Every equation is a closed form and free of cancellation near dead points and change points.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import IntEnum
from fractions import Fraction
from functools import cached_property
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from graphsynth.core import checks
from graphsynth.core.errors import GeometryError
from graphsynth.mechanism.rotatability import FullTurn, four_bar_rotation

if TYPE_CHECKING:
    from graphsynth.structure.graph import MechanismGraph

Array = NDArray[np.float64]
_BESIDE = 1e-140
#: Crank angles at which the margin of a tilted linkage is looked at.
_SAMPLES = 1440


class AssemblyStatus(IntEnum):
    """Whether the linkage can be assembled at one crank angle, and if not, which inequality fails."""

    OK = 0, "assembled"
    LIMIT = 1, "assembled in a limit position: both branches meet and the velocity of B is undefined"
    TILT_EXCEEDS_ROD = 2, "not assembled: |A_z| > l3"
    TOO_FAR = 3, "not assembled: D > l4 + s3"
    COUPLER_TOO_LONG = 4, "not assembled: D < s3 - l4"
    ROCKER_TOO_LONG = 5, "not assembled: D < l4 - s3"
    INDETERMINATE = 6, "not determined: A coincides with C and the coupler equals the rocker"

    message: str

    def __new__(cls, value: int, message: str = "") -> AssemblyStatus:
        """Make a member; ``message`` is one sentence that says what it means."""
        member = int.__new__(cls, value)
        member._value_, member.message = value, message
        return member


@dataclass(frozen=True, eq=False)
class FourBarPositions:
    """Positions, tilt and derivatives with respect to the crank angle, shape (...), vectors (..., 3).

    NaN wherever `assembled` is False; derivatives also in a limit position (`AssemblyStatus.LIMIT`).
    """

    f: Array  # crank angles, radians
    A: Array  # crank pin, in the unit of the link lengths
    B: Array  # bearing centre
    M: Array  # tracing point
    status: NDArray[np.int8]  # `AssemblyStatus` of every angle
    theta: Array  # signed tilt of the coupler at B, radians; its sine and cosine are found without an inverse function
    sin_theta: Array
    cos_theta: Array
    dA: Array  # analytical derivatives d/df
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
        own: dict[str, Any] = dict.fromkeys(("l1", "l2", "l3", "l4"), checks.positive)
        own |= {"k": checks.finite, "alpha": checks.finite, "sgn": checks.sign, "axis": checks.unit_vector}
        for name, check in own.items():
            object.__setattr__(self, name, check(name, getattr(self, name)))
        checks.check_fields(self, ("l1", "l2", "l3", "l4"))
        checks.check_sizes("the tracing point", {"1 + |k|": 1.0 + abs(self.k)})
        checks.choice("rod", self.rod, ("rigid", "deck"))
        checks.choice("convention", self.convention, ("spec", "deck"))

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
        f = checks.finite_array("f", f)
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
        # B' = w x (B - C) from the derivative of |B - A|^2 = s3^2; NaN in a limit position, where root = 0
        ba = B[..., :2] - A[..., :2]
        stretch = -az * dA[..., 2] if self.rod == "rigid" else 0.0  # s3 s3'
        moment = stretch + ba[..., 0] * dA[..., 0] + ba[..., 1] * dA[..., 1]
        w = moment / np.where(root > 0.0, -0.5 * self.sgn * root, np.nan)  # cross(B - C, B - A)
        dB = np.stack([-w * B[..., 1], w * (B[..., 0] - self.l1), np.where(np.isnan(w), np.nan, 0.0)], axis=-1)
        if self.rod == "rigid":
            sine, cosine = az / self.l3, s3 / self.l3
            with np.errstate(divide="ignore", invalid="ignore"):
                dtheta = np.where(s3 > 0.0, dA[..., 2] / s3, np.nan)
        else:
            length = np.hypot(self.l3, az)
            sine, cosine, dtheta = az / length, self.l3 / length, dA[..., 2] * self.l3 / (length * length)
        M, dM = (1.0 + self.k) * B - self.k * A, (1.0 + self.k) * dB - self.k * dA
        hide = np.where(assembled, 0.0, np.nan)
        tilt = np.arctan2(az, s3) + hide, sine + hide, cosine + hide
        return FourBarPositions(f, A, B, M, status, *tilt, dA, dB, dM, dtheta + hide)

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

    def full_turn(self) -> FullTurn:
        """Say whether the crank can make a full turn, with limit angles or change points if it cannot.

        See theory/four-bar-and-tilt 3.  Exact (rational arithmetic on the given lengths) when the crank pin stays in
        the plane; estimated from the sign changes of the discriminants otherwise, and labelled so.
        """
        return self._planar_turn() if self.pin_height == 0.0 else self._tilted_turn()

    def _planar_turn(self) -> FullTurn:
        """Compare the extremes of D with |l4 - l3| and l3 + l4 in exact arithmetic."""
        l1, l2, l3, l4 = (Fraction(length) for length in (self.l1, self.l2, self.l3, self.l4))
        kind, touches, bounds = four_bar_rotation(l1 * l1, l2, l3, l4)
        if kind == "never assembled":
            return FullTurn(kind, (), (), "exact", "the linkage cannot be assembled at any crank angle")
        r = self.rotation  # about e_z, or a half turn about an axis in the plane: f is shifted or reversed
        phase, sense = math.atan2(r[1, 0], r[0, 0]), math.copysign(1.0, r[2, 2])
        changes = [angle for angle, met in zip((0.0, math.pi), touches) if met]
        limits: list[float] = []
        for _, reach in bounds:
            half = (reach * reach - (l1 - l2) ** 2) / (4 * l1 * l2)  # sin^2(f/2)
            angle = 2.0 * math.atan2(math.sqrt(half), math.sqrt(1 - half))
            limits += [angle, -angle] if 0 < half < 1 else [angle]
        at, met = (tuple(sorted(sense * (angle - phase) % math.tau for angle in part)) for part in (limits, changes))
        texts = {
            "immovable": f"nothing moves: the linkage can only lie stretched, at {_degrees(at[:1])} degrees",
            "limited": f"the crank cannot make a full rotation: dead centres at {_degrees(at)} degrees",
            "change point": "the crank passes every angle, but the branches meet at the change points "
            f"{_degrees(met)} degrees",
            "full turn": "the crank makes a full rotation without dead centres or change points",
        }
        return FullTurn(kind, at, () if kind == "immovable" else met, "exact", texts[kind])

    def _margins(self, f: Array) -> Array:
        """Smallest of the three quantities that must stay positive, relative to the square of the largest length."""
        A, _, _, near, far, _ = self._closure(f)
        rod = self.l3**2 - A[:, 2] ** 2 if self.rod == "rigid" else math.inf
        return np.asarray(np.minimum(np.minimum(near, far), rod) / max(self.l1, self.l2, self.l3, self.l4) ** 2)

    def _margin(self, f: float) -> float:
        return float(self._margins(np.array([f]))[0])

    def _tilted_turn(self) -> FullTurn:
        from scipy.optimize import brentq, minimize_scalar

        grid, step = np.linspace(0.0, math.tau, _SAMPLES + 1), math.tau / _SAMPLES
        values = self._margins(grid)
        nodes = list(zip(grid, values))
        for index in range(_SAMPLES):  # a minimum between samples may dip below zero unseen
            before, here, after = values[index - 1], values[index], values[index + 1]
            if here <= before and here <= after and not before == here == after:  # flat: the tilt is below rounding
                ends = (grid[index] - step, grid[index] + step)
                found = minimize_scalar(self._margin, bounds=ends, method="bounded", options={"xatol": 1e-12})
                nodes.append((float(found.x) % math.tau, float(found.fun)))
        nodes.sort()
        worst, best = min(value for _, value in nodes), max(nodes, key=lambda node: node[1])
        rounding = 64 * np.finfo(float).eps
        if abs(best[1]) <= rounding:
            text = "the largest margin is at the rounding level: immovable or never assembled, not decided"
            return FullTurn("immovable", (best[0],), (), "estimated", text)
        if best[1] < 0.0:
            text = "the linkage cannot be assembled at any sampled crank angle"
            return FullTurn("never assembled", (), (), "estimated", text)
        limits = tuple(
            float(brentq(self._margin, f0, f1, xtol=1e-14)) % math.tau
            for (f0, v0), (f1, v1) in pairwise(nodes)
            if v0 * v1 < 0.0
        )
        if limits:
            text = f"the crank cannot make a full rotation: dead centres near {_degrees(limits)} degrees"
            return FullTurn("limited", limits, (), "estimated", text)
        if worst <= rounding:
            touch = tuple(f for f, value in nodes if value == worst)
            text = "the smallest margin is at the rounding level: change point or dead centre, not decided"
            return FullTurn("change point", (), touch, "estimated", text)
        text = f"the crank makes a full rotation; smallest relative margin {worst:.3g}"
        return FullTurn("full turn", (), (), "estimated", text)

    def straightness(
        self, start: float = 0.5 * math.pi, stop: float = 1.5 * math.pi, samples: int = 721
    ) -> Straightness:
        """Straightness of the path of M between two crank angles (radians); by default the working stroke 90..270 deg.

        Raises
        ------
        GeometryError
            If the linkage cannot be assembled somewhere on the stroke.
        """
        from scipy.optimize import minimize_scalar

        start, stop = checks.finite("start", start), checks.finite("stop", stop)
        f = np.linspace(start, stop, checks.whole("samples", samples, 2))
        path = self.positions(f)
        if not path.assembled.all():
            raise GeometryError(
                f"the stroke from {start} to {stop} rad is not assembled everywhere ({'; '.join(path.reasons())}); "
                "choose a stroke inside the range of motion"
            )
        first, last = path.M[0, :2], path.M[-1, :2]
        chord = float(np.hypot(*(last - first)))
        if chord == 0.0:
            raise GeometryError("both ends of the stroke have the same tracing point; choose another stroke")
        normal = np.array([first[1] - last[1], last[0] - first[0]]) / chord
        normal = -normal if normal[1] < 0.0 else normal  # positive means upwards, whichever way M runs

        def extreme(direction: int) -> tuple[float, float]:
            def below(M: Array) -> Array:
                return np.asarray(-direction * ((M[:, :2] - first) @ normal))

            values = below(path.M)
            k = int(np.argmin(values))
            ends = tuple(sorted((f[max(k - 1, 0)], f[min(k + 1, samples - 1)])))
            found = minimize_scalar(
                lambda x: below(self.positions([x]).M)[0], bounds=ends, method="bounded", options={"xatol": 1e-12}
            )
            at, value = (found.x, found.fun) if found.fun < values[k] else (f[k], values[k])
            return float(at), -direction * float(value)

        (f_low, low), (f_high, high) = extreme(-1), extreme(1)
        return Straightness(chord, low, high, f_low, f_high, float(np.abs(path.M[:, 2]).max()))

    def graph(self) -> MechanismGraph:
        """Structural graph: a four-bar chain with joints 0-1, 1-2, 2-3, 0-3 and link 0 as the frame."""
        from graphsynth.structure.graph import MechanismGraph

        return MechanismGraph(4, [(0, 1), (1, 2), (2, 3), (0, 3)], frame=0)


def _degrees(angles: tuple[float, ...]) -> str:
    return ", ".join(f"{math.degrees(angle):.6g}" for angle in angles)
