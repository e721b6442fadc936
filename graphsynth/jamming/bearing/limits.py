"""Inverse questions: how much misalignment, how little clearance, how much height is still free (theory/jam-arcs 4).

Closed forms in double precision are estimates.  The certified answers are brackets: the value ``works`` is certified to
leave the full rotation free for the whole tolerance box, the value ``fails`` to bind for at least one parameter vector.
The closed form proposes the edge; only the certificates on both sides count, so that an error in it could widen the
bracket but not falsify it.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from fractions import Fraction
from time import perf_counter

from graphsynth.core.checks import checked
from graphsynth.core.errors import GeometryError
from graphsynth.jamming.bearing.bearing import Bearing, Condition
from graphsynth.jamming.bearing.certify import JamCertificate, certify_jamming
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
    linkage, bearing : TiltedFourBar, Bearing
        Dimensions of the bearing in millimetres.
    condition : {"A", "B"}
        Contact condition: short bearing in a long hole, or long shaft in a short hole.

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
    linkage, bearing : TiltedFourBar, Bearing
        Dimensions of the bearing in millimetres.
    condition : {"A", "B"}
        Contact condition: short bearing in a long hole, or long shaft in a short hole.

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
    linkage, bearing : TiltedFourBar, Bearing
        Dimensions of the bearing in millimetres.
    condition : {"A", "B"}
        Contact condition: short bearing in a long hole, or long shaft in a short hole.

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


_FIRST = 2.0**-50  # first relative distance from the proposed edge; doubled until both sides are proved
_STEPS = 46


@dataclass(frozen=True)
class CertifiedLimit:
    """A limit between two proved values.

    Attributes
    ----------
    works : float or None
        Certified free over the full rotation and the whole box (and for every milder value, see ``covers``).
    fails : float or None
        Certified to jam for at least one parameter vector of the box.
    unit : str
        Radians or millimetres.
    reason : str
        Why an end is missing; empty otherwise.
    covers : str
        The range of values for which freedom is proved in one go.
    trials : int
        Certificates computed.
    seconds : float
        Run time.
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

    Raises
    ------
    GeometryError
        For an interference fit, or a condition that lacks its dimensions.

    Examples
    --------
    >>> limit = certified_largest_misalignment(ToleranceBox())
    >>> limit.works < 0.0151614793250201376610981403839 < limit.fails, limit.relative_gap < 1e-13
    (True, True)
    """

    def milder(value: float) -> ToleranceBox:
        return box.replace(alpha=Range(-Fraction(value), Fraction(value)))

    def at(value: float) -> ToleranceBox:
        return box.replace(alpha=Fraction(value))

    def propose(worst: ToleranceBox) -> float | None:
        return largest_misalignment(*worst.nominal(), _reading(condition)).value

    search = _LimitSearch(condition, at, milder, 1, "rad", "-works to works")
    return _bracket(search, box.replace(alpha="1/100"), propose, (0.0, 1.5))


@checked
def certified_smallest_clearance(box: ToleranceBox, condition: Condition = "A") -> CertifiedLimit:
    """Smallest radial clearance (mm) that leaves the turn free, whatever the other parameters.

    The range of ``clearance`` in the box is not used; ``works`` is proved for itself, and by monotonicity for every
    larger clearance.

    Parameters
    ----------
    box, condition : ToleranceBox, {"A", "B", "general"}
        Ranges of all parameters, for each combination of which the statement holds; contact condition.

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

    def at(value: float) -> ToleranceBox:
        return box.replace(clearance=Fraction(value))

    def propose(worst: ToleranceBox) -> float | None:
        return smallest_clearance(*worst.nominal(), _reading(condition)).value

    top = float(box["Rb"].upper + box["Hb"].upper)
    search = _LimitSearch(condition, at, at, -1, "mm", "works and more")
    return _bracket(search, box.replace(clearance=0), propose, (0.0, top))


@checked
def certified_largest_height(box: ToleranceBox, condition: Condition = "A") -> CertifiedLimit:
    """Largest height Hb (mm) that leaves the turn free, whatever the other parameters.

    The range of ``Hb`` in the box is not used; ``works`` covers every height from 0 to it.

    Parameters
    ----------
    box, condition : ToleranceBox, {"A", "B", "general"}
        Ranges of all parameters, for each combination of which the statement holds; contact condition.

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

    def at(value: float) -> ToleranceBox:
        return box.replace(Hb=Fraction(value))

    def milder(value: float) -> ToleranceBox:
        return box.replace(Hb=Range(Fraction(0), Fraction(value)))

    def propose(worst: ToleranceBox) -> float | None:
        return largest_height(*worst.nominal(), _reading(condition)).value

    top = 1000.0 * float(box["Rb"].upper)
    return _bracket(_LimitSearch(condition, at, milder, 1, "mm", "0 to works"), box, propose, (0.0, top))


def _reading(condition: Condition) -> Condition:
    if condition == "general":
        raise GeometryError("no closed form")  # caught: the edge is then searched by halving
    return condition


def _bracket(
    search: _LimitSearch, box: ToleranceBox, propose: Callable[[ToleranceBox], float | None], span: tuple[float, float]
) -> CertifiedLimit:
    """Prove both sides of the edge that is proposed, or else found by halving ``span``."""
    check_condition(box, search.condition)
    direction = search.direction
    try:
        edge = propose(worst_corner(box, search.condition))
    except GeometryError:
        edge = None
    mild, harsh = span if direction > 0 else span[::-1]
    if edge is None or not math.isfinite(edge) or edge <= 0.0:
        edge = search.halve(mild, harsh)
    if edge is None:
        return search.one_sided(mild, harsh)
    works = fails = None
    distance = _FIRST
    for _ in range(_STEPS):
        if works is None and search.free(edge * (1.0 - direction * distance)):
            works = edge * (1.0 - direction * distance)
        if fails is None and search.jams(edge * (1.0 + direction * distance)):
            fails = edge * (1.0 + direction * distance)
        if works is not None and fails is not None:
            break
        distance *= 2.0
        if distance >= 0.5:
            break
    reason = "" if works is not None and fails is not None else search.why or "no proof within half of the edge"
    return search.answer(works, fails, reason)


@dataclass
class _LimitSearch:
    """Certificates of one question, counted; ``direction`` +1 if larger values are worse, -1 if smaller ones are."""

    condition: Condition
    at: Callable[[float], ToleranceBox]
    milder: Callable[[float], ToleranceBox]
    direction: int
    unit: str
    covers: str
    trials: int = 0
    why: str = ""
    begin: float = field(default_factory=perf_counter)

    def answer(self, works: float | None, fails: float | None, reason: str) -> CertifiedLimit:
        seconds = perf_counter() - self.begin
        return CertifiedLimit(works, fails, self.unit, reason, self.covers, self.trials, seconds)

    def _certificate(self, box: ToleranceBox) -> JamCertificate:
        self.trials += 1
        found = certify_jamming(box, self.condition)
        self.why = found.reason or self.why
        return found

    def free(self, value: float) -> bool:
        return self._certificate(self.milder(value)).verdict is Verdict.CERTIFIED_FREE

    def jams(self, value: float) -> bool:
        found = self._certificate(self.at(value))
        return found.verdict in (Verdict.CERTIFIED_JAMMED, Verdict.CERTIFIED_JAMMED_FOR_SOME)

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

    def one_sided(self, mild: float, harsh: float) -> CertifiedLimit:
        """Answer when no edge was found in the span searched."""
        if self.free(harsh):
            reason = f"no limit: free up to the end of the search, {harsh!r} {self.unit}"
            return self.answer(harsh, None, reason)
        speck = harsh + 2.0**-60 * abs(mild - harsh)
        if self.direction < 0 and self.free(speck):
            reason = f"no limit above {harsh!r} {self.unit}: {self.why or 'every larger value is free'}"
            return self.answer(speck, None, reason)
        works = mild if self.free(mild) else None
        fails = mild if works is None and self.jams(mild) else None
        if fails is not None:
            reason = f"no value works: even {mild!r} {self.unit} is certified to bind"
        else:
            reason = self.why or "neither side is proved"
        return self.answer(works, fails, reason)
