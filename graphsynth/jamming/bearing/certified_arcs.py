"""Jam arcs over a turn with proved inner and outer bounds (specification, sections 7.1 and 7.3)."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

from graphsynth.jamming.bearing.circle_sets import FULL_TURN, Span, complement, merge_outer, subtract, total_length

if TYPE_CHECKING:
    from graphsynth.intervals import Interval

__all__ = ["ArcEnclosure", "CertifiedArcs", "Enclosure"]


class Enclosure(NamedTuple):
    """A number that is proved to lie between two doubles; an infinite end says that it is not bounded there."""

    lo: float
    hi: float

    @property
    def width(self) -> float:
        """Upper bound of the width."""
        return math.nextafter(self.hi - self.lo, math.inf) if self.hi > self.lo else 0.0

    @property
    def mid(self) -> float:
        """A double inside."""
        return self.lo if self.lo == self.hi else min(max(0.5 * self.lo + 0.5 * self.hi, self.lo), self.hi)

    def __contains__(self, value: object) -> bool:
        return isinstance(value, int | float) and self.lo <= value <= self.hi


class ArcEnclosure(NamedTuple):
    """One jam arc: for every parameter vector it starts in ``start`` and stops in ``stop`` (radians)."""

    start: Enclosure
    stop: Enclosure


@dataclass(frozen=True)
class CertifiedArcs:
    """Where the bearing jams during a turn, with proof.

    Attributes
    ----------
    arcs : tuple of ArcEnclosure
        The two arcs (one per lid) with their ends enclosed over the whole box; empty unless they exist for every
        parameter vector.
    inner : tuple of Span
        Crank angles at which every parameter vector jams.
    outer : tuple of Span
        Crank angles outside of which no parameter vector jams.
    undecided : tuple of Span
        Outer without inner: some jam, some may not, or rounding does not decide.
    free : tuple of Span
        The complement of the outer arcs: free for every parameter vector.
    kappa : Enclosure
        Range over the box of the value that ``|sin(f - phase)|`` must exceed.
    phase : Enclosure
        psi1 modulo pi, radians.
    reason : str
        What is special: no arcs and why, arcs that exist for some parameters only, touching.

    Notes
    -----
    "Jams" holds wherever the linkage can be assembled; crank angles it cannot reach are not in question.
    """

    arcs: tuple[ArcEnclosure, ...]
    inner: tuple[Span, ...]
    outer: tuple[Span, ...]
    undecided: tuple[Span, ...]
    free: tuple[Span, ...]
    kappa: Enclosure
    phase: Enclosure
    reason: str = ""

    @property
    def jammed_part(self) -> Enclosure:
        """Part of the turn that jams, between its proved bounds; rounded outward."""
        low, high = total_length(self.inner) / math.tau, total_length(self.outer) / math.tau
        # at most two spans: differences, a sum and a quotient to nearest are off by less than 5e-16
        return Enclosure(max(0.0, low - 2e-15), min(1.0, high + 2e-15 if self.outer else 0.0))


def no_arcs(kappa: Enclosure, phase: Enclosure, reason: str) -> CertifiedArcs:
    """Return the result for a turn that is free for every parameter vector."""
    return CertifiedArcs((), (), (), (), (FULL_TURN,), kappa, phase, reason)


def whole_turn(kappa: Enclosure, phase: Enclosure, reason: str, proved: bool) -> CertifiedArcs:
    """Return the result for a turn that jams everywhere, or that is undecided everywhere."""
    inner, undecided = ((FULL_TURN,), ()) if proved else ((), (FULL_TURN,))
    return CertifiedArcs((), inner, (FULL_TURN,), undecided, (), kappa, phase, reason)


def arcs_from(kappa: Enclosure, phase: Interval) -> CertifiedArcs:
    """Build the arcs ``|sin(f - phase)| > kappa`` from enclosures over a box.

    The ends are ``phase + asin(kappa)`` and ``phase + pi - asin(kappa)`` and the same half a turn later; bounds of the
    outer arcs take the smallest kappa, those of the inner arcs the largest.
    """
    shown = Enclosure(float(phase.lo), float(phase.hi))
    if kappa.lo > 1.0:
        return no_arcs(kappa, shown, "the largest tilt stays below the critical tilt")
    known = float(phase.width) < 3.14
    ends = _both_arcs(kappa, phase) if known else []
    if not ends:
        return whole_turn(kappa, shown, "the direction of the tilt is not known within half a turn", False)
    outer = merge_outer(Span(arc.start.lo, arc.stop.hi) for arc in ends)
    exists = kappa.hi < 1.0
    inner = tuple(Span(a.start.hi, a.stop.lo) for a in ends if exists and a.start.hi < a.stop.lo)
    reason = _about(kappa)
    arcs = tuple(ends) if exists else ()
    return CertifiedArcs(arcs, inner, outer, subtract(outer, inner), complement(outer), kappa, shown, reason)


def _about(kappa: Enclosure) -> str:
    """Say what is special about a range of kappa."""
    if kappa.lo == 0.0:
        if kappa.hi == 0.0:
            return "no clearance: jams at every angle with a tilt, touches at the two angles without"
        return "no clearance is left at the lower end of its range: every angle with a tilt may jam"
    if kappa.hi >= 1.0:
        return "kappa contains 1: whether there is an arc at all depends on the parameters, or on rounding"
    return ""


def _both_arcs(kappa: Enclosure, phase: Interval) -> list[ArcEnclosure]:
    """Enclose both arcs over the box, the start of each brought into [0, 2 pi) as a whole."""
    from graphsynth.intervals import pi
    from graphsynth.jamming.bearing.corners import arcsine

    half, edge = pi(), arcsine(min(kappa.lo, 1.0)).hull(arcsine(min(kappa.hi, 1.0)))
    arcs = []
    for base in (phase, phase + half):
        turns = math.floor(float((base + edge).mid) / math.tau)
        whole = base - half * (2 * turns) if turns else base
        start, stop = whole + edge, whole + half - edge
        arcs.append(
            ArcEnclosure(Enclosure(float(start.lo), float(start.hi)), Enclosure(float(stop.lo), float(stop.hi)))
        )
    return arcs
