"""Rotatability of cranks decided exactly: four-bar, slider-crank, inverted slider-crank; limit angles enclosed.

A crank of length a turns the pin B of a dyad.  The dyad can be assembled while a reach stays within bounds that depend
on the lengths alone, so the extremes of the reach over a turn decide, in rational arithmetic (Grashof 1883; for the
sliders, theory/four-bar-and-tilt 3, with one length infinite).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from fractions import Fraction
from typing import Any, NamedTuple

import flint

from graphsynth.core.errors import GeometryError
from graphsynth.intervals.reading import ball, precision, rational
from graphsynth.mechanism.rotatability import KINDS, four_bar_rotation, rotation_kind, type_of

_BITS = 80
#: Kinds with limits.
_BOUNDED = ("limited", "immovable")


class LimitAngle(NamedTuple):
    """Crank angle in [low, high] (radians) at which the dyad is "stretched" or "folded" and the crank cannot go on."""

    place: str
    low: float
    high: float


@dataclass(frozen=True)
class CrankCertificate:
    """Exact statement on the rotation of a crank.

    Attributes
    ----------
    kind : {"full turn", "change point", "limited", "immovable", "never assembled"}
        "full turn": the crank passes every angle and the two assembly modes never meet.  "change point": it passes
        every angle, but modes meet.  "limited": some angles cannot be assembled.  "immovable": only one can.
    type : str
        Of a four-bar: "crank-rocker", "rocker-crank", "double crank", "double rocker" (Grashof), "triple rocker"
        (non-Grashof), "change point", "immovable" (the longest link is as long as the others together: they can only
        lie stretched along it) or "never assembled"; seen from the input link.  Of the sliders: their name.
    limits : tuple of LimitAngle
        Enclosed angles that bound the motion, or the only one there is; empty unless "limited" or "immovable".
    change_angles : tuple of str
        Exact angles at which modes meet: "0", "pi", "pi/2" or "-pi/2".
    statement : str
        The result in one sentence.
    """

    kind: str
    type: str
    limits: tuple[LimitAngle, ...]
    change_angles: tuple[str, ...]
    statement: str

    @property
    def full_turn(self) -> bool:
        """Whether the crank makes a full rotation on one assembly mode."""
        return self.kind == "full turn"


def certify_four_bar(ground: Any, crank: Any, coupler: Any, rocker: Any) -> CrankCertificate:
    """Decide exactly whether the crank of a four-bar turns fully.

    Parameters
    ----------
    ground, crank, coupler, rocker : int, float, Fraction, Decimal or str
        Positive lengths in the order of the loop; floats are exact dyadic numbers, "0.1" is one tenth.

    Returns
    -------
    CrankCertificate
        Exact; limit angles certified.  The crank angle is measured from the direction of the crank's pivot to the
        rocker's pivot; limits hold for both signs.

    Raises
    ------
    GeometryError
        A length that is not positive.

    Examples
    --------
    >>> certify_four_bar(2, 1, "2.5", "2.5").type, certify_four_bar("0.3", "0.1", "0.2", "0.2").kind
    ('crank-rocker', 'change point')
    >>> certify_four_bar("0.3", "0.1", "0.1", "0.1").type  # it can only lie stretched
    'immovable'
    >>> limited = certify_four_bar(2, 1.5, 1, 1)
    >>> [round(limit.low, 9) for limit in limited.limits], limited.limits[0].place
    ([1.186399552], 'stretched')
    """
    g, a, b, c = (
        _length(n, v) for n, v in zip(("ground", "crank", "coupler", "rocker"), (ground, crank, coupler, rocker))
    )
    kind, touches, bounds = four_bar_rotation(g * g, a, b, c)
    bounds = bounds if kind in _BOUNDED else ()
    limits = [_limit(place, "acos", (g * g + a * a - reach * reach) / (2 * g * a)) for place, reach in bounds]
    changes = tuple(angle for angle, met in zip(("0", "pi"), touches) if met and kind != "never assembled")
    return _certificate(kind, type_of(g, a, b, c), limits, changes)


def certify_slider_crank(crank: Any, coupler: Any, offset: Any = 0) -> CrankCertificate:
    """Decide exactly whether the crank of a slider-crank turns fully.

    Parameters
    ----------
    crank, coupler : exact numbers
        Positive lengths.
    offset : exact number
        Ordinate of the crank's pivot above the line of the slider pin.

    Returns
    -------
    CrankCertificate
        The crank angle t is measured from the direction of the line; the pin of the crank is at the ordinate
        ``offset + crank sin t``, which the coupler must span.  Limits hold for t and pi - t.

    Examples
    --------
    >>> certify_slider_crank(1, 3, 1).kind, certify_slider_crank(1, 2, 1).change_angles
    ('full turn', ('pi/2',))
    """
    a, b, e = _length("crank", crank), _length("coupler", coupler), rational("offset", offset)
    nearest = max(abs(e) - a, Fraction(0))
    kind = _kind(nearest, abs(e) + a, Fraction(-1), b)
    changes = tuple(t for t, y in (("pi/2", e + a), ("-pi/2", e - a)) if abs(y) == b)
    limits = []
    if kind in _BOUNDED:
        for sign in (1, -1):
            sine = (sign * b - e) / a
            if abs(sine) <= 1 and abs(e + sign * a) > b:
                limits.append(_limit("stretched", "asin", sine))
        limits = sorted(set(limits), key=lambda limit: limit.low)
    return _certificate(kind, "slider-crank", limits, changes)


def certify_inverted_slider_crank(crank: Any, ground: Any, offset: Any = 0) -> CrankCertificate:
    """Decide exactly whether the crank of an inverted slider-crank (swinging or turning slide) turns fully.

    Parameters
    ----------
    crank, ground : exact numbers
        Positive lengths: crank, and distance of the two fixed pivots.
    offset : exact number
        Distance of the line of the slide, along which the crank pin runs, from the pivot of the slide.

    Returns
    -------
    CrankCertificate
        The crank angle is measured as for `certify_four_bar`; the pin must stay outside the circle of radius
        ``|offset|`` around the pivot of the slide.

    Examples
    --------
    >>> certify_inverted_slider_crank(1, 2, "0.5").kind, certify_inverted_slider_crank(1, 1, 0).kind
    ('full turn', 'change point')
    """
    a, g, e = _length("crank", crank), _length("ground", ground), abs(rational("offset", offset))
    kind = _kind(abs(g - a), g + a, e, g + a + 1)
    limits = []
    if kind in _BOUNDED:
        limits.append(_limit("folded", "acos", (g * g + a * a - e * e) / (2 * g * a)))
    return _certificate(kind, "inverted slider-crank", limits, ("0",) if kind == "change point" else ())


def _length(name: str, value: Any) -> Fraction:
    length = rational(name, value)
    if length <= 0:
        raise GeometryError(f"{name} = {value!r} must be positive; correct the value")
    return length


def _kind(nearest: Fraction, farthest: Fraction, least: Fraction, most: Fraction) -> str:
    """Compare the extremes of the reach over a turn with its bounds."""
    return KINDS[int(rotation_kind(nearest - least, farthest - most, nearest - most, farthest - least))]


def _limit(place: str, inverse: str, value: Fraction) -> LimitAngle:
    """Enclose the angle of a cosine ("acos") or sine ("asin"), which is exact at 1 and -1."""
    with precision(_BITS):
        if abs(value) < 1:
            return LimitAngle(place, *outward(getattr(ball(value), inverse)()))
        quarters = int(value) if inverse == "asin" else 1 - int(value)
        return LimitAngle(place, *outward(quarters * flint.arb.pi() / 2))


def outward(value: Any) -> tuple[float, float]:
    """Bounds of an ``arb`` in double precision, rounded outwards."""
    middle = float(value.mid())
    error = float(abs(value - middle).upper()) * (1.0 + 1e-15)
    if error == 0.0:
        return middle, middle
    return math.nextafter(middle - error, -math.inf), math.nextafter(middle + error, math.inf)


def _certificate(kind: str, type_: str, limits: list[LimitAngle], changes: tuple[str, ...]) -> CrankCertificate:
    where = ", ".join(f"{limit.low:.12g} rad ({limit.place})" for limit in limits)
    text = {
        "full turn": "the crank makes a full rotation on one assembly mode",
        "change point": f"the crank passes every angle, but assembly modes meet at {', '.join(changes)}",
        "limited": f"the crank stops at {where}",
        "immovable": f"nothing moves, the crank has one place: {where}",
        "never assembled": "the linkage cannot be assembled at any crank angle",
    }[kind]
    return CrankCertificate(kind, type_, tuple(limits), changes, f"proved ({type_}): {text}")
