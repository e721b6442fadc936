"""The closed form and its folds in any number of digits (mpmath), and the output at small distances from a fold.

Lengths are read as the decimal numbers that they print as: 0.1 means one tenth.  Angles are taken as given.

A fold turns an error ``d`` of the input into ``C sqrt(d)`` of the output: half of the digits are lost.  Given the
distance itself, and not only the rounded input, the closed form loses nothing: it is evaluated on exact differences
from the fold (theory/extreme-cases 3, case 5).
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from graphsynth.core.checks import finite_array
from graphsynth.core.errors import GeometryError
from graphsynth.systems.antenna.closed_form import poses
from graphsynth.systems.antenna.folds import Fold, Path
from graphsynth.systems.antenna.model import Leg, PointingDimensions


@dataclass(frozen=True)
class Difference:
    """``base`` and ``change``: the value elsewhere is their sum, but the change keeps its own relative accuracy.

    Examples
    --------
    >>> angle = Difference(1.0, 1e-20)
    >>> angle.cos().change
    -8.414709848078965e-21
    """

    base: float
    change: float = 0.0

    @property
    def value(self) -> float:
        """The sum, rounded."""
        return self.base + self.change

    def __add__(self, other: Difference) -> Difference:
        return Difference(self.base + other.base, self.change + other.change)

    def __sub__(self, other: Difference) -> Difference:
        return Difference(self.base - other.base, self.change - other.change)

    def __mul__(self, other: Difference) -> Difference:
        change = self.base * other.change + other.base * self.change + self.change * other.change
        return Difference(self.base * other.base, change)

    def scaled(self, factor: float) -> Difference:
        """Multiply by a constant."""
        return Difference(factor * self.base, factor * self.change)

    def sin(self) -> Difference:
        """Sine: the change is ``2 cos(base + change/2) sin(change/2)``."""
        half = 0.5 * self.change
        return Difference(math.sin(self.base), 2.0 * math.cos(self.base + half) * math.sin(half))

    def cos(self) -> Difference:
        """Cosine: the change is ``-2 sin(base + change/2) sin(change/2)``."""
        half = 0.5 * self.change
        return Difference(math.cos(self.base), -2.0 * math.sin(self.base + half) * math.sin(half))

    def sqrt(self) -> Difference:
        """Square root: the change is ``change / (sqrt(base + change) + sqrt(base))``; NaN if the value is negative."""
        if self.base < 0.0 or self.value < 0.0:
            return Difference(math.nan, math.nan)
        root = math.sqrt(self.base)
        total = math.sqrt(self.value) + root
        return Difference(root, self.change / total if total > 0.0 else 0.0)

    def angle(self, x: Difference) -> Difference:
        """``atan2(self, x)``: the change is the angle between the two directions."""
        cross = self.change * x.base - x.change * self.base
        dot = x.base * x.value + self.base * self.value
        return Difference(math.atan2(self.base, x.base), math.atan2(cross, dot))


class PreciseFold(NamedTuple):
    """Parameter, elevation, azimuth and square-root coefficient of a fold as mpmath numbers."""

    parameter: Any
    a: Any
    b: Any
    coefficient: Any


def precise_angles(
    mechanism: PointingDimensions, phi_x: Any, phi_y: Any, s_y: int = 1, s_x: int = -1, digits: int = 50
) -> tuple[Any, Any]:
    """Elevation and azimuth with so many digits; both NaN where the mechanism cannot be assembled.

    Crank angles in radians: floats, text or mpmath numbers; `s_y`, `s_x` choose the assembly mode.

    Examples
    --------
    >>> import mpmath
    >>> from graphsynth.systems.antenna import PointingMechanism
    >>> with mpmath.workdps(50):
    ...     phi = mpmath.radians(40)
    ...     mpmath.nstr(mpmath.degrees(precise_angles(PointingMechanism(), phi, phi)[0]), 22)
    '23.7120800164849915647'
    """
    from mpmath import mp

    with mp.workdps(digits + 15):
        return Path(mechanism, (mp.mpf(phi_x), mp.mpf(phi_y)), (0.0, 0.0), s_y, s_x, mp).outputs(0.0)


def precise_fold(mechanism: PointingDimensions, fold: Fold, digits: int = 50) -> PreciseFold:
    """Place, outputs and square-root coefficient of a simple fold with ``digits`` digits; others are refused.

    The discriminant is a smooth function of the path parameter with a simple zero there, so the secant method is safe.
    """
    from mpmath import mp

    if fold.order != 2:
        raise GeometryError(
            f"the fold of leg {fold.leg} has order {fold.order}; only simple folds (order 2) are refined"
        )
    with mp.workdps(digits + 20):
        path = Path(mechanism, fold.offset, fold.direction, *fold.merging[0], mp)
        leg = next(leg for leg in path.legs()[:2] if leg.name == fold.leg)
        begin, tolerance = mp.mpf(fold.parameter), mp.mpf(10) ** (-2 * digits)
        ends = (begin, begin + mp.mpf("1e-9"))
        t = mp.findroot(lambda at: path.discriminant(at, leg), ends, tol=tolerance, verify=False)
        return PreciseFold(t, *path.at_fold(fold.leg, t)[:3])


Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class ApproachToFold:
    """Output of the folding leg at small distances from its fold, on one of the two branches.

    Attributes
    ----------
    fold : Fold
    distance : ndarray, shape (n,)
        Distances on the assembled side, radians of the path parameter.
    exact : ndarray, shape (n,)
        Deviation of the output from its value at the fold, radians: recomputed with 60 digits, then rounded.
    compensated : ndarray, shape (n,)
        The same in double precision from the distance itself.
    series : ndarray, shape (n,)
        ``-+ C sqrt(distance)``.
    plain_error : ndarray, shape (n,)
        Absolute error of the output computed from the rounded crank angle; NaN where rounding took it out of reach.
    predicted_error : ndarray, shape (n,)
        Bound on it that the square root explains.
    """

    fold: Fold
    distance: Array
    exact: Array
    compensated: Array
    series: Array
    plain_error: Array
    predicted_error: Array

    @property
    def compensated_error(self) -> Array:
        """Relative error of `compensated`."""
        return np.asarray(np.abs(self.compensated / self.exact - 1.0))


def _own(leg: Leg, l1: float, phi: Difference) -> tuple[Difference, Difference, Difference]:
    s, c = phi.sin().scaled(leg.crank), phi.cos().scaled(leg.crank)
    p = Difference(l1 - leg.crank) + c
    q = Difference(leg.side * leg.rod) + s
    lift = s * (Difference(2.0 * leg.side * leg.rod) + s)
    return p, q, (Difference(l1 * l1) + p * p + lift).scaled(0.5 / l1)


def deviations(path: Path, leg: str, place: float, step: float) -> tuple[float, float]:
    """Return changes of u and v from a fold of ``leg`` at ``place`` to ``place + step``, in exact differences."""
    first, second, l1 = path.legs()

    def output(which: Leg, factor: Difference, folding: bool) -> Difference:
        index = 0 if which.name == "Y" else 1
        rate = path.direction[index]
        phi = Difference(path.offset[index] + place * rate, step * rate)
        p, q, k = _own(which, l1, phi)
        q = q * factor
        rest = p * p + q * q - k * k
        if folding:
            rest = Difference(0.0, rest.change)
        root = rest.sqrt().scaled(path.sign(which))
        return (q * k + p * root).angle(p * k - q * root)

    u = output(first, Difference(1.0), first.name == leg)
    v = output(second, u.cos(), second.name == leg)
    return u.change, v.change


def approach(self: PointingDimensions, fold: Fold, distances: ArrayLike, *, branch: int = 1) -> ApproachToFold:
    """Output at small distances from a fold: exact, compensated, by the square root, and plain with its error.

    `distances` (n,) are positive, radians of the path parameter, and may be far below the spacing of floating-point
    numbers; `branch` is the sign of the folding leg.  A `GeometryError` refuses other distances, and a fold that is not
    simple.
    """
    from mpmath import mp

    distance = np.atleast_1d(finite_array("distances", distances))
    if distance.min(initial=1.0) <= 0.0:
        raise GeometryError(f"distances holds {distance.min()}; give positive distances from the fold")
    if fold.side == 0:
        raise GeometryError(f"the fold of leg {fold.leg} is not simple; its output is no square root of the distance")
    s_y, s_x = fold.merging[0 if branch == 1 else 1]
    path = Path(self, fold.offset, fold.direction, s_y, s_x)
    which, own = 0 if path.legs()[0].name == fold.leg else 1, 0 if fold.leg == "Y" else 1
    sharp, exactly = precise_fold(self, fold, 60), replace(path, context=mp)
    rows = []
    for e in distance.tolist():
        step = fold.side * e
        with mp.workdps(75):
            y = exactly.outputs(sharp.parameter + step)[own]
            exact = mp.arg(mp.expj(y - (sharp.a, sharp.b)[own]))
            near_x, near_y = (o + (fold.parameter + step) * d for o, d in zip(fold.offset, fold.direction))
            got = poses(self, near_x, near_y, s_y, s_x)
            plain = mp.mpf(float((got.a, got.b)[own]))
            error = float("nan") if mp.isnan(plain) else float(abs(mp.arg(mp.expj(plain - y))))
        rows.append((float(exact), deviations(path, fold.leg, fold.parameter, step)[which], error))
    exact_, compensated, plain_error = np.array(rows).reshape(-1, 3).T
    # the input is rounded once, the discriminant a few times: together like a shift of the input by `blur`
    first, second, l1 = path.legs()
    h = 1e-7 * fold.side
    slope = abs(path.discriminant(fold.parameter + h, (first, second)[which]) / h)
    largest = (l1 + max(leg.rod + 2.0 * leg.crank for leg in (first, second))) ** 2
    blur = np.spacing(max(abs(fold.parameter), 1.0)) * 4.0
    blur += 8.0 * math.ulp(1.0) * largest / slope if slope > 0.0 else 1.0
    c = fold.coefficient
    predicted = c * (np.sqrt(distance + blur) - np.sqrt(np.maximum(distance - blur, 0.0))) + 1e-15
    series = np.copysign(c * np.sqrt(distance), exact_)
    return ApproachToFold(fold, distance, exact_, compensated, series, plain_error, predicted)
