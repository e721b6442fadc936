"""How well the output is known at small distances from a fold (specification, section 9, case 5).

A fold turns an error ``d`` of the input into ``C sqrt(d)`` of the output: half of the digits are lost.  Given the
distance itself, and not only the rounded input, the closed form loses nothing: it is evaluated on exact differences
from the fold.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from graphsynth.core.checks import finite_array
from graphsynth.core.errors import GeometryError
from graphsynth.systems.antenna.difference import Difference
from graphsynth.systems.antenna.folds import Fold
from graphsynth.systems.antenna.legs import Leg
from graphsynth.systems.antenna.path import Path
from graphsynth.systems.antenna.precise import precise_angles, precise_fold

if TYPE_CHECKING:
    from graphsynth.systems.antenna.mechanism import PointingMechanism

__all__ = ["ApproachToFold", "approach", "deviations"]

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


def approach(mechanism: PointingMechanism, fold: Fold, distances: ArrayLike, branch: int) -> ApproachToFold:
    """Compare three ways to compute the output near a fold; see `PointingMechanism.approach`.

    Raises
    ------
    GeometryError
        Distances that are not positive, or a fold that is not simple.
    """
    from mpmath import mp

    distance = np.atleast_1d(finite_array("distances", distances))
    if distance.min(initial=1.0) <= 0.0:
        raise GeometryError(f"distances holds {distance.min()}; give positive distances from the fold")
    if fold.side == 0:
        raise GeometryError(f"the fold of leg {fold.leg} is not simple; its output is no square root of the distance")
    s_y, s_x = fold.merging[0 if branch == 1 else 1]
    path = Path(mechanism, fold.offset, fold.direction, s_y, s_x)
    which = 0 if path.legs()[0].name == fold.leg else 1
    sharp = precise_fold(mechanism, fold, 60)
    at = sharp.a if fold.leg == "Y" else sharp.b
    rows = []
    for e in distance.tolist():
        step = fold.side * e
        with mp.workdps(75):
            phi_x, phi_y = (
                mp.mpf(o) + (sharp.parameter + step) * mp.mpf(d) for o, d in zip(fold.offset, fold.direction)
            )
            y = precise_angles(mechanism, phi_x, phi_y, s_y, s_x, 60)[0 if fold.leg == "Y" else 1]
            exact = mp.arg(mp.expj(y - at))
            t = fold.parameter + step
            near_x, near_y = (o + t * d for o, d in zip(fold.offset, fold.direction))
            got = mechanism.poses(near_x, near_y, s_y, s_x)
            plain = mp.mpf(float(got.a if fold.leg == "Y" else got.b))
            error = float("nan") if mp.isnan(plain) else float(abs(mp.arg(mp.expj(plain - y))))
        rows.append((float(exact), deviations(path, fold.leg, fold.parameter, step)[which], error))
    exact_, compensated, plain_error = np.array(rows).reshape(-1, 3).T
    # the input is rounded once, the discriminant a few times: together like a shift of the input by `blur`
    blur = np.spacing(max(abs(fold.parameter), 1.0)) * 4.0 + _discriminant_blur(path, fold)
    c = fold.coefficient
    predicted = c * (np.sqrt(distance + blur) - np.sqrt(np.maximum(distance - blur, 0.0))) + 1e-15
    series = np.copysign(c * np.sqrt(distance), exact_)
    return ApproachToFold(fold, distance, exact_, compensated, series, plain_error, predicted)


def _discriminant_blur(path: Path, fold: Fold) -> float:
    """Shift of the input that changes the discriminant as much as its rounding errors do."""
    first, second, l1 = path.legs()
    which = 0 if first.name == fold.leg else 1
    h = 1e-7 * fold.side
    inside = path.discriminant(fold.parameter + h, which)
    slope = abs(inside / h)
    largest = (l1 + max(leg.rod + 2.0 * leg.crank for leg in (first, second))) ** 2
    return 8.0 * math.ulp(1.0) * largest / slope if slope > 0.0 else 1.0
