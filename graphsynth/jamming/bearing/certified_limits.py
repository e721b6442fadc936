"""Inverse questions with proof on both sides: how much tilt, how little clearance, how much height is still free.

Each answer is a bracket: the value ``works`` is certified to leave the whole turn free for the whole tolerance box, the
value ``fails`` is certified to jam for at least one parameter vector.  A closed form proposes the edge; only the
certificates on both sides count, so that an error in the closed form could widen the bracket but not falsify it.
Specification: section 7.4.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from fractions import Fraction
from time import perf_counter

from graphsynth.core.checks import checked
from graphsynth.core.errors import GeometryError
from graphsynth.jamming.bearing.bearing import Condition
from graphsynth.jamming.bearing.certificate import JamCertificate
from graphsynth.jamming.bearing.certify import certify_jamming
from graphsynth.jamming.bearing.corners import check_condition, worst_corner
from graphsynth.jamming.bearing.inverse import largest_height, largest_misalignment, smallest_clearance
from graphsynth.jamming.bearing.parameters import ToleranceBox
from graphsynth.jamming.bearing.ranges import Range
from graphsynth.jamming.verdict import Verdict

__all__ = [
    "CertifiedLimit", "certified_largest_height", "certified_largest_misalignment", "certified_smallest_clearance",
]  # fmt: skip

_FIRST = 2.0**-50  # first relative distance from the proposed edge; doubled until both sides are proved
_STEPS = 46


@dataclass(frozen=True)
class CertifiedLimit:
    """A limit between two proved values.

    Attributes
    ----------
    works : float or None
        Certified free over the whole turn and the whole box (and for every milder value, see ``covers``).
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
    box : ToleranceBox
        Ranges of all parameters; the statement holds for each of their combinations.
    condition : {"A", "B", "general"}
        Contact condition.

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

    return _bracket(box.replace(alpha="1/100"), condition, propose, at, milder, (0.0, 1.5), "rad", 1, "-works to works")


@checked
def certified_smallest_clearance(box: ToleranceBox, condition: Condition = "A") -> CertifiedLimit:
    """Smallest radial clearance (mm) that leaves the turn free, whatever the other parameters.

    The range of ``clearance`` in the box is not used; ``works`` is proved for itself, and by monotonicity for every
    larger clearance.

    Parameters
    ----------
    box : ToleranceBox
        Ranges of all parameters; the statement holds for each of their combinations.
    condition : {"A", "B", "general"}
        Contact condition.

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
    return _bracket(box.replace(clearance=0), condition, propose, at, at, (0.0, top), "mm", -1, "works and more")


@checked
def certified_largest_height(box: ToleranceBox, condition: Condition = "A") -> CertifiedLimit:
    """Largest height Hb (mm) that leaves the turn free, whatever the other parameters.

    The range of ``Hb`` in the box is not used; ``works`` covers every height from 0 to it.

    Parameters
    ----------
    box : ToleranceBox
        Ranges of all parameters; the statement holds for each of their combinations.
    condition : {"A", "B", "general"}
        Contact condition.

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
    return _bracket(box, condition, propose, at, milder, (0.0, top), "mm", 1, "0 to works")


def _reading(condition: Condition) -> Condition:
    if condition == "general":
        raise GeometryError("no closed form")  # caught: the edge is then searched by halving
    return condition


def _bracket(
    box: ToleranceBox,
    condition: Condition,
    propose: Callable[[ToleranceBox], float | None],
    at: Callable[[float], ToleranceBox],
    milder: Callable[[float], ToleranceBox],
    span: tuple[float, float],
    unit: str,
    direction: int,
    covers: str,
) -> CertifiedLimit:
    """Prove both sides of an edge; ``direction`` +1 if larger values are worse, -1 if smaller ones are."""
    begin = perf_counter()
    check_condition(box, condition)
    search = _Search(condition, at, milder, direction)
    try:
        edge = propose(worst_corner(box, condition))
    except GeometryError:
        edge = None
    mild, harsh = span if direction > 0 else span[::-1]
    if edge is None or not math.isfinite(edge) or edge <= 0.0:
        edge = search.halve(mild, harsh)
    if edge is None:
        return search.one_sided(mild, harsh, unit, covers, begin)
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
    return CertifiedLimit(works, fails, unit, reason, covers, search.trials, perf_counter() - begin)


class _Search:
    """Certificates of one question, counted."""

    def __init__(
        self,
        condition: Condition,
        at: Callable[[float], ToleranceBox],
        milder: Callable[[float], ToleranceBox],
        direction: int,
    ) -> None:
        self.condition, self.at, self.milder, self.direction = condition, at, milder, direction
        self.trials, self.why = 0, ""

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

    def one_sided(self, mild: float, harsh: float, unit: str, covers: str, begin: float) -> CertifiedLimit:
        """Answer when no edge was found in the span searched."""
        if self.free(harsh):
            reason = f"no limit: free up to the end of the search, {harsh!r} {unit}"
            return CertifiedLimit(harsh, None, unit, reason, covers, self.trials, perf_counter() - begin)
        speck = harsh + 2.0**-60 * abs(mild - harsh)
        if self.direction < 0 and self.free(speck):
            reason = f"no limit above {harsh!r} {unit}: {self.why or 'every larger value is free'}"
            return CertifiedLimit(speck, None, unit, reason, covers, self.trials, perf_counter() - begin)
        works = mild if self.free(mild) else None
        fails = mild if works is None and self.jams(mild) else None
        if fails is not None:
            reason = f"no value works: even {mild!r} {unit} is certified to jam"
        else:
            reason = self.why or "neither side is proved"
        return CertifiedLimit(works, fails, unit, reason, covers, self.trials, perf_counter() - begin)
