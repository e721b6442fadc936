"""Inverse questions: how much misalignment, how little clearance, how much height is still free (theory/jam-arcs 4).

Closed forms in double precision are estimates.  The certified answers are brackets: the value ``works`` is certified to
leave the full rotation free for the whole tolerance box, the value ``fails`` to bind for at least one parameter vector.
The closed form proposes the edge; only the certificates on both sides count, so that an error in it could widen the
bracket but not falsify it.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, field
from fractions import Fraction
from time import perf_counter

from graphsynth.core.checks import checked
from graphsynth.core.errors import GeometryError
from graphsynth.jamming.bearing.bearing import Bearing, Condition
from graphsynth.jamming.bearing.certify import certify_jamming
from graphsynth.jamming.bearing.corners import check_condition, worst_corner
from graphsynth.jamming.bearing.parameters import Range, ToleranceBox
from graphsynth.jamming.verdict import METHOD_CLOSED_FORM, Verdict
from graphsynth.mechanism.four_bar import TiltedFourBar


@dataclass(frozen=True)
class Limit:
    """A limiting value, or None with the reason; ``method`` says that it is not certified."""

    value: float | None
    reason: str = ""
    method: str = METHOD_CLOSED_FORM


@checked
def largest_misalignment(linkage: TiltedFourBar, bearing: Bearing, condition: Condition = "A") -> Limit:
    """Largest alpha (radians) for which the full rotation is free; None if every alpha is free, or none.

    Parameters
    ----------
    linkage, bearing, condition : TiltedFourBar, Bearing, {"A", "B"}
        Dimensions of the bearing in millimetres; short bearing in a long hole, or long shaft in a short hole.

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
    """Smallest radial clearance (mm) for which the full rotation is free, for the radius and height of ``bearing``.

    Parameters
    ----------
    linkage, bearing, condition
        As for `largest_misalignment`.

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
    """Largest height Hb (mm) for which the full rotation is free, for the radius and clearance of ``bearing``.

    Parameters
    ----------
    linkage, bearing, condition
        As for `largest_misalignment`.

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
            return Limit(None, "no height works: even a thin plate binds at this tilt")
        return Limit(2.0 * half)
    if condition != "A":
        raise GeometryError(f'condition = {condition!r} has no closed form here; use "A" or "B"')
    half = (c + R * S * S / (1.0 + C)) / S
    if half * C < R * S:
        return Limit(2.0 * math.sqrt(c * (2.0 * R + c)), "R S > h C: the rim beside the tilt plane decides")
    return Limit(2.0 * half)


_FIRST, _LAST = 2.0**-50, 2.0**-5  # relative distances from the proposed edge; doubled until both sides are proved


@dataclass(frozen=True)
class CertifiedLimit:
    """A limit between two proved values.

    ``works`` is certified free over the full rotation and the whole box, ``fails`` to jam for at least one parameter
    vector; ``reason`` says why one of them is missing.  ``covers`` tells the range of values for which freedom is
    proved in one go, ``unit`` is "rad" or "mm", ``trials`` the number of certificates computed.
    """

    works: float | None
    fails: float | None
    unit: str
    reason: str = ""
    covers: str = ""
    trials: int = 0
    seconds: float = field(default=0.0, compare=False)

    @property
    def relative_gap(self) -> float:
        """Distance of the two ends over their size; infinite if one is missing."""
        if self.works is None or self.fails is None:
            return math.inf
        return abs(self.fails - self.works) / max(abs(self.fails), abs(self.works), 5e-324)


@checked
def certified_largest_misalignment(box: ToleranceBox, condition: Condition = "A") -> CertifiedLimit:
    """Largest tilt alpha of the motor axis (radians) that leaves the turn free, whatever the other parameters.

    The range of ``alpha`` in the box is not used.  ``works`` covers every alpha from ``-works`` to ``works``.

    Parameters
    ----------
    box, condition : ToleranceBox, {"A", "B", "general"}
        Ranges of all parameters, for each combination of which the statement holds; contact condition.

    Returns
    -------
    CertifiedLimit
        An angle that works and one that fails, both proved.

    Examples
    --------
    >>> limit = certified_largest_misalignment(ToleranceBox())
    >>> limit.works < 0.0151614793250201376610981403839 < limit.fails, limit.relative_gap < 1e-13
    (True, True)
    """
    search = _LimitSearch(box.replace(alpha="1/100"), condition, "alpha", "rad", "-works to works")
    return search.bracket(largest_misalignment, 0.0, 1.5)


@checked
def certified_smallest_clearance(box: ToleranceBox, condition: Condition = "A") -> CertifiedLimit:
    """Smallest radial clearance (mm) that leaves the turn free, whatever the other parameters.

    The range of ``clearance`` in the box is not used; ``works`` is proved for itself, and by monotonicity for every
    larger clearance.

    Parameters
    ----------
    box, condition
        As for `certified_largest_misalignment`.

    Returns
    -------
    CertifiedLimit
        A clearance that works and one that fails, both proved.

    Examples
    --------
    >>> limit = certified_smallest_clearance(ToleranceBox(alpha="1/30"))
    >>> limit.fails < 0.0650992730735457585284715885170 < limit.works, limit.relative_gap < 1e-13
    (True, True)
    """
    search = _LimitSearch(box.replace(clearance=0), condition, "clearance", "mm", "works and more")
    return search.bracket(smallest_clearance, float(box["Rb"].upper + box["Hb"].upper), 0.0)


@checked
def certified_largest_height(box: ToleranceBox, condition: Condition = "A") -> CertifiedLimit:
    """Largest height Hb (mm) that leaves the turn free, whatever the other parameters.

    The range of ``Hb`` in the box is not used; ``works`` covers every height from 0 to it.

    Parameters
    ----------
    box, condition
        As for `certified_largest_misalignment`.

    Returns
    -------
    CertifiedLimit
        A height that works and one that fails, both proved.

    Examples
    --------
    >>> limit = certified_largest_height(ToleranceBox(alpha="0.013"))
    >>> limit.works < limit.fails, limit.relative_gap < 1e-13
    (True, True)
    """
    search = _LimitSearch(box, condition, "Hb", "mm", "0 to works")
    return search.bracket(largest_height, 0.0, 1000.0 * float(box["Rb"].upper))


#: Other end of the range that is free with a value, in units of the value.
_MILDER = {"-works to works": -1, "works and more": 1, "0 to works": 0}


@dataclass
class _LimitSearch:
    """Certificates of one question about one parameter of a box, counted."""

    box: ToleranceBox
    condition: Condition
    name: str
    unit: str
    covers: str
    trials: int = 0
    why: str = ""
    begin: float = field(default_factory=perf_counter)

    def verdict(self, low: Fraction, high: Fraction) -> Verdict:
        self.trials += 1
        found = certify_jamming(self.box.replace(**{self.name: Range(low, high)}), self.condition)
        self.why = found.reason or self.why
        return found.verdict

    def free(self, value: float) -> bool:
        exact = Fraction(value)
        return self.verdict(_MILDER[self.covers] * exact, exact) is Verdict.CERTIFIED_FREE

    def jams(self, value: float) -> bool:
        return self.verdict(Fraction(value), Fraction(value)).is_jammed

    def bracket(
        self, closed: Callable[[TiltedFourBar, Bearing, Condition], Limit], mild: float, harsh: float
    ) -> CertifiedLimit:
        """Prove both sides of the edge that the closed form proposes, or else found by halving."""
        check_condition(self.box, self.condition)
        edge = None
        with suppress(GeometryError):
            if self.condition != "general":
                edge = closed(*worst_corner(self.box, self.condition).nominal(), self.condition).value
        if edge is None or not math.isfinite(edge) or edge <= 0.0:
            edge = self.halve(mild, harsh)
        works = fails = None
        if edge is None:
            works, fails, reason = self.one_sided(mild, harsh)
        else:
            distance, worse = _FIRST, math.copysign(1.0, harsh - mild)
            while distance <= _LAST and (works is None or fails is None):
                milder, harsher = edge * (1.0 - worse * distance), edge * (1.0 + worse * distance)
                works = milder if works is None and self.free(milder) else works
                fails = harsher if fails is None and self.jams(harsher) else fails
                distance *= 2.0
            reason = self.why or "no proof within half of the edge" if works is None or fails is None else ""
        seconds = perf_counter() - self.begin
        return CertifiedLimit(works, fails, self.unit, reason, self.covers, self.trials, seconds)

    def halve(self, mild: float, harsh: float) -> float | None:
        """Search the edge between a free and a jamming value by halving; None if one of them is not there."""
        if not self.free(mild) or not self.jams(harsh):
            return None
        for _ in range(60):
            middle = 0.5 * (mild + harsh)
            if middle in (mild, harsh):
                break
            if self.free(middle):
                mild = middle
            elif self.jams(middle):
                harsh = middle
            else:
                return middle
        return 0.5 * (mild + harsh)

    def one_sided(self, mild: float, harsh: float) -> tuple[float | None, float | None, str]:
        """Return what works, what fails and why an end is missing, when no edge was found in the span searched."""
        if self.free(harsh):
            return harsh, None, f"no limit: free up to the end of the search, {harsh!r} {self.unit}"
        speck = harsh + 2.0**-60 * abs(mild - harsh)
        if harsh < mild and self.free(speck):
            return speck, None, f"no limit above {harsh!r} {self.unit}: {self.why or 'every larger value is free'}"
        works = mild if self.free(mild) else None
        if works is None and self.jams(mild):
            return None, mild, f"no value works: even {mild!r} {self.unit} is certified to bind"
        return works, None, self.why or "neither side is proved"
