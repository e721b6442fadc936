"""The closed form and its folds in any number of digits (mpmath).

Lengths are read as the decimal numbers that they print as: 0.1 means one tenth.  Angles are taken as given.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

from graphsynth.core.errors import GeometryError

if TYPE_CHECKING:
    from graphsynth.systems.antenna.folds import Fold
    from graphsynth.systems.antenna.mechanism import PointingMechanism

__all__ = ["PreciseFold", "precise_angles", "precise_fold"]


class PreciseFold(NamedTuple):
    """Parameter, elevation, azimuth and square-root coefficient of a fold as mpmath numbers."""

    parameter: Any
    a: Any
    b: Any
    coefficient: Any


def _own(mp: Any, mechanism: PointingMechanism, name: str, phi: Any) -> tuple[Any, Any, Any]:
    l1, l2, l3, l4, l5 = (mp.mpf(repr(length)) for length in mechanism.lengths)
    crank, rod, side = (l3, l2, -1) if name == "Y" else (l5, l4, 1)
    p, q = l1 - crank + crank * mp.cos(phi), side * rod + crank * mp.sin(phi)
    return p, q, (l1 * l1 + p * p + q * q - rod * rod) / (2 * l1)


def _linear(mp: Any, a: Any, b: Any, k: Any, sign: int) -> Any:
    """Solve ``a cos t + b sin t = k`` on a branch; NaN without a real root."""
    rest = a * a + b * b - k * k
    if rest < 0:
        return mp.nan
    root = sign * mp.sqrt(rest)
    return mp.atan2(b * k + a * root, a * k - b * root)


def precise_angles(
    mechanism: PointingMechanism, phi_x: Any, phi_y: Any, s_y: int = 1, s_x: int = -1, digits: int = 50
) -> tuple[Any, Any]:
    """Elevation and azimuth with ``digits`` digits.

    Parameters
    ----------
    mechanism : PointingMechanism
    phi_x, phi_y : float, str or mpmath number
        Crank angles, radians.
    s_y, s_x : {+1, -1}
        Assembly mode.
    digits : int

    Returns
    -------
    tuple of mpmath numbers
        Both NaN where the mechanism cannot be assembled.

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
        phi = {"Y": mp.mpf(phi_x), "X": mp.mpf(phi_y)}
        u, v = _outputs(mp, mechanism, phi, {"Y": s_y, "X": s_x})
        return (v, u) if mechanism.order == "YX" else (u, v)


def _outputs(mp: Any, mechanism: PointingMechanism, phi: dict[str, Any], signs: dict[str, int]) -> tuple[Any, Any]:
    first, second = ("X", "Y") if mechanism.order == "YX" else ("Y", "X")
    p, q, k = _own(mp, mechanism, first, phi[first])
    u = _linear(mp, p, q, k, signs[first])
    p, q, k = _own(mp, mechanism, second, phi[second])
    v = mp.nan if mp.isnan(u) else _linear(mp, p, q * mp.cos(u), k, signs[second])
    return (mp.nan, mp.nan) if mp.isnan(v) else (u, v)


def precise_fold(mechanism: PointingMechanism, fold: Fold, digits: int = 50) -> PreciseFold:
    """Place, outputs and square-root coefficient of a simple fold with ``digits`` digits.

    The discriminant is a smooth function of the path parameter with a simple zero there, so the secant method is safe.

    Raises
    ------
    GeometryError
        A fold that is not simple.
    """
    from mpmath import mp

    if fold.order != 2:
        raise GeometryError(
            f"the fold of leg {fold.leg} has order {fold.order}; only simple folds (order 2) are refined"
        )
    with mp.workdps(digits + 20):
        first, second = ("X", "Y") if mechanism.order == "YX" else ("Y", "X")
        signs = {"Y": fold.merging[0][0], "X": fold.merging[0][1]}
        index = {"Y": 0, "X": 1}

        def phi(name: str, t: Any) -> Any:
            return mp.mpf(fold.offset[index[name]]) + t * mp.mpf(fold.direction[index[name]])

        def coefficients(t: Any) -> tuple[Any, Any, Any, Any]:
            """Return A, B, K of the folding leg and the output of the other one, if it comes first."""
            p, q, k = _own(mp, mechanism, fold.leg, phi(fold.leg, t))
            if fold.leg == first:
                return p, q, k, mp.nan
            u = _linear(mp, *_own(mp, mechanism, first, phi(first, t)), signs[first])
            return p, q * mp.cos(u), k, u

        def rest(t: Any) -> Any:
            a, b, k, _ = coefficients(t)
            return a * a + b * b - k * k

        begin = mp.mpf(fold.parameter)
        t = mp.findroot(rest, (begin, begin + mp.mpf("1e-9")), tol=mp.mpf(10) ** (-2 * digits), verify=False)
        a, b, k, u = coefficients(t)
        y = mp.atan2(b * k, a * k)
        slope = mp.diff(lambda s: _residual(mp, coefficients(s), y), t)
        coefficient = mp.sqrt(2 * abs(slope / k))
        if fold.leg == first:
            p, q, k = _own(mp, mechanism, second, phi(second, t))
            outputs = {first: y, second: _linear(mp, p, q * mp.cos(y), k, signs[second])}
        else:
            outputs = {first: u, second: y}
        return PreciseFold(t, outputs["Y"], outputs["X"], coefficient)


def _residual(mp: Any, coefficients: tuple[Any, Any, Any, Any], y: Any) -> Any:
    a, b, k, _ = coefficients
    return a * mp.cos(y) + b * mp.sin(y) - k
