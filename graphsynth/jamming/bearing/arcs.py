"""Arcs of the turn where a bearing that takes the whole tilt binds (model L0): in closed form, and with proved bounds.

A `Span` runs counter-clockwise from ``start`` to ``stop`` (radians, ``stop`` may exceed a turn).  Outer sets of spans
are only ever enlarged by rounding, inner sets only shrunk.  See theory/jam-arcs 1, 3.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

from graphsynth.core.checks import checked
from graphsynth.jamming.bearing.bearing import Bearing, Condition
from graphsynth.jamming.verdict import METHOD_CLOSED_FORM
from graphsynth.mechanism.four_bar import TiltedFourBar

if TYPE_CHECKING:
    from graphsynth.intervals import Interval

#: Doubles around 2 pi.
TURN_LOW, TURN_HIGH = 6.283185307179586, 6.283185307179587
_TURNS = (0.0, 1.0, -1.0, 2.0, -2.0)


class Span(NamedTuple):
    """A span of crank angles in radians; ``stop - start`` of a turn or more is the whole circle."""

    start: float
    stop: float

    @property
    def length(self) -> float:
        """Length in radians, rounded; at most a turn."""
        return min(self.stop - self.start, math.tau)

    def degrees(self) -> tuple[float, float]:
        """Return the ends in degrees (rounded, for display)."""
        return math.degrees(self.start), math.degrees(self.stop)


FULL_TURN = Span(0.0, TURN_HIGH)


def _is_full(span: Span) -> bool:
    return span.stop - span.start >= TURN_LOW


def _certainly_full(span: Span) -> bool:
    """Whether no angle is left out, for sets that must not be enlarged."""
    return span == FULL_TURN or span.stop - span.start > TURN_HIGH  # a rounded difference above a double is above it


def merge_outer(spans: Iterable[Span]) -> tuple[Span, ...]:
    """Join spans that overlap or touch, also across the turn; the union is never smaller.

    >>> merge_outer([Span(5.0, 7.0), Span(0.5, 1.0), Span(1.0, 2.0)])
    (Span(start=5.0, stop=8.283185307179588),)
    """
    found: list[Span] = []
    for span in sorted(spans):
        if _is_full(span):
            return (FULL_TURN,)
        if found and span.start <= found[-1].stop:
            found[-1] = Span(found[-1].start, max(found[-1].stop, span.stop))
        else:
            found.append(span)
    while len(found) > 1 and math.nextafter(found[0].start + TURN_LOW, -math.inf) <= found[-1].stop:
        head = math.nextafter(found[0].stop + TURN_HIGH, math.inf)
        found = [*found[1:-1], Span(found[-1].start, max(found[-1].stop, head))]
    if any(_is_full(span) for span in found):
        return (FULL_TURN,)
    return tuple(found)


def complement(spans: tuple[Span, ...]) -> tuple[Span, ...]:
    """Return what merged spans leave free, never larger than the true complement.

    >>> complement((Span(1.0, 2.0),))
    (Span(start=2.0, stop=7.283185307179585),)
    """
    if not spans:
        return (FULL_TURN,)
    if any(_is_full(span) for span in spans):
        return ()
    following = [*spans[1:], Span(math.nextafter(spans[0].start + TURN_LOW, -math.inf), math.inf)]
    gaps = (Span(span.stop, after.start) for span, after in zip(spans, following))
    return tuple(gap for gap in gaps if gap.stop > gap.start)


def subtract(outer: tuple[Span, ...], inner: tuple[Span, ...]) -> tuple[Span, ...]:
    """Return what is left of outer spans without inner ones that lie inside them, enlarged by rounding only."""
    left: list[Span] = []
    for whole in outer:
        pieces = [whole]
        for cut in inner:
            pieces = [part for piece in pieces for part in _without(piece, cut)]
        left += pieces
    return tuple(left)


def _without(piece: Span, cut: Span) -> list[Span]:
    for shift in (0.0, TURN_HIGH, -TURN_HIGH):  # the same span a turn earlier or later
        start, stop = cut.start + shift, cut.stop + shift
        if shift:
            start, stop = math.nextafter(start, math.inf), math.nextafter(stop, -math.inf)
        if start < piece.stop and stop > piece.start:
            parts = [Span(piece.start, start), Span(stop, piece.stop)]
            return [part for part in parts if part.stop > part.start]
    return [piece]


def contains(spans: Iterable[Span], f: float) -> bool:
    """Whether a crank angle lies in one of the spans (decided in floating point: for displays and samples)."""
    return any((f - span.start) % math.tau <= span.stop - span.start for span in spans)


def covers(spans: Iterable[Span], start: float, stop: float) -> bool:
    """Whether one of the spans certainly holds the piece from ``start`` to ``stop`` (in [-2 pi, 4 pi]) in its inside.

    Never true by rounding; a piece may be a single angle.
    """
    for span in spans:
        if _certainly_full(span):
            return True
        for turn in _TURNS:
            if span.start < _shifted(start, turn)[0] and _shifted(stop, turn)[1] < span.stop:
                return True
    return False


def meets(spans: Iterable[Span], start: float, stop: float) -> bool:
    """Whether the piece from ``start`` to ``stop`` certainly has points inside one of the spans."""
    for span in spans:
        if _certainly_full(span):
            return True
        for turn in _TURNS:
            first, last = max(span.start, _shifted(start, turn)[1]), min(span.stop, _shifted(stop, turn)[0])
            if first < last or (start == stop and covers([span], start, stop)):
                return True
    return False


def _shifted(f: float, turn: float) -> tuple[float, float]:
    """Bounds of ``f`` plus a number of turns."""
    if turn == 0.0:
        return f, f
    low, high = sorted((turn * TURN_LOW, turn * TURN_HIGH))
    return math.nextafter(f + low, -math.inf), math.nextafter(f + high, math.inf)


def total_length(spans: Iterable[Span]) -> float:
    """Total length, radians."""
    return sum(span.length for span in spans)


class Enclosure(NamedTuple):
    """A number that is proved to lie between two doubles; an infinite end says that it is not bounded there."""

    lo: float
    hi: float

    @classmethod
    def of(cls, value: Interval) -> Enclosure:
        """Return the bounds of one interval."""
        return cls(float(value.lo), float(value.hi))

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
    """Where the bearing binds during a turn, with proof.

    ``arcs`` are the two arcs (one per lid) with their ends enclosed over the whole box; empty unless they exist for
    every parameter vector.  ``inner`` are crank angles at which every parameter vector binds, wherever the linkage can
    be assembled; outside of ``outer`` none does.  ``kappa`` is the range over the box of the value that
    ``|sin(f - phase)|`` must exceed, ``phase`` psi1 modulo pi, radians.  ``reason`` tells what is special: no arcs and
    why, arcs that exist for some parameters only, touching.
    """

    arcs: tuple[ArcEnclosure, ...]
    inner: tuple[Span, ...]
    outer: tuple[Span, ...]
    kappa: Enclosure
    phase: Enclosure
    reason: str = ""

    @property
    def undecided(self) -> tuple[Span, ...]:
        """Outer without inner: some jam, some may not, or rounding does not decide."""
        return subtract(self.outer, self.inner)

    @property
    def free(self) -> tuple[Span, ...]:
        """The complement of the outer arcs: free for every parameter vector."""
        return complement(self.outer)

    @property
    def jammed_part(self) -> Enclosure:
        """Part of the turn that binds, between its proved bounds; rounded outward."""
        low, high = total_length(self.inner) / math.tau, total_length(self.outer) / math.tau
        # at most two spans: differences, a sum and a quotient to nearest are off by less than 5e-16
        return Enclosure(max(0.0, low - 2e-15), min(1.0, high + 2e-15 if self.outer else 0.0))


def arcs_from(kappa: Enclosure, phase: Interval) -> CertifiedArcs:
    """Build the arcs ``|sin(f - phase)| > kappa`` from enclosures over a box.

    The ends are ``phase + asin(kappa)`` and ``phase + pi - asin(kappa)`` and the same half a turn later; bounds of the
    outer arcs take the smallest kappa, those of the inner arcs the largest.
    """
    from graphsynth.intervals import pi
    from graphsynth.jamming.bearing.corners import arcsine

    shown = Enclosure.of(phase)
    if kappa.lo > 1.0:
        return CertifiedArcs((), (), (), kappa, shown, "the largest tilt stays below the critical tilt")
    if not float(phase.width) < 3.14:
        reason = "the direction of the tilt is not known within half a turn"
        return CertifiedArcs((), (), (FULL_TURN,), kappa, shown, reason)
    half, edge = pi(), arcsine(min(kappa.lo, 1.0)).hull(arcsine(min(kappa.hi, 1.0)))
    arcs = []
    for base in (phase, phase + half):  # the start of each brought into [0, 2 pi) as a whole
        turns = math.floor(float((base + edge).mid) / math.tau)
        whole = base - half * (2 * turns) if turns else base
        arcs.append(ArcEnclosure(Enclosure.of(whole + edge), Enclosure.of(whole + half - edge)))
    outer = merge_outer(Span(arc.start.lo, arc.stop.hi) for arc in arcs)
    exists, reason = kappa.hi < 1.0, ""
    inner = tuple(Span(a.start.hi, a.stop.lo) for a in arcs if exists and a.start.hi < a.stop.lo)
    if kappa.hi == 0.0:
        reason = "no clearance: binds at every angle with a tilt, touches at the two angles without"
    elif kappa.lo == 0.0:
        reason = "no clearance is left at the lower end of its range: every angle with a tilt may bind"
    elif not exists:
        reason = "kappa contains 1: whether there is an arc at all depends on the parameters, or on rounding"
    return CertifiedArcs(tuple(arcs) if exists else (), inner, outer, kappa, shown, reason)


_ROUNDING = 16 * 2.0**-52


@checked
@dataclass(frozen=True)
class JamArc:
    """An open arc of crank angles (radians): from ``start`` in [0, 2 pi) counter-clockwise over ``length``."""

    start: float
    length: float

    @property
    def stop(self) -> float:
        """End of the arc, at least ``start``; may exceed 2 pi when the arc wraps around."""
        return self.start + self.length

    @checked
    def contains(self, f: float) -> bool:
        """Return True if the crank angle ``f`` (radians, any turn) lies inside the arc."""
        return 0.0 < math.fmod(math.fmod(f - self.start, math.tau) + math.tau, math.tau) < self.length


@dataclass(frozen=True)
class JamArcs:
    """Where the bearing binds during a turn.

    The two ``arcs``, half a turn apart, one per lid, or none; ``touching``, crank angles (radians) of contact without
    overlap: the two of ``kappa = 1``, or of zero clearance.  ``kappa`` is the sine of the critical tilt over the
    largest sine of tilt, infinite if there is no critical tilt or no tilt; ``phase`` psi1 with tilt proportional to
    ``sin(f - psi1)``, radians.  ``reason`` says why there are no arcs, or what is special.
    """

    arcs: tuple[JamArc, ...]
    touching: tuple[float, ...]
    kappa: float
    phase: float
    condition: str
    method: str = METHOD_CLOSED_FORM
    reason: str = ""


@checked
def jam_arcs(linkage: TiltedFourBar, bearing: Bearing, condition: Condition = "A") -> JamArcs:
    """Jam arcs of the bearing at B over one turn of the crank (theory/jam-arcs 1).

    Exact closed form evaluated in double precision.  ``|kappa - 1|`` below sixteen units in the last place is reported
    as touching, because the sign of the difference is then a matter of rounding.

    Parameters
    ----------
    linkage, bearing, condition : TiltedFourBar, Bearing, {"A", "B"}
        Dimensions of the bearing in millimetres; short bearing in a long hole, or long shaft in a short hole.

    Returns
    -------
    JamArcs
        Crank angles in radians.

    Examples
    --------
    >>> arcs = jam_arcs(TiltedFourBar(alpha=1 / 30), Bearing())
    >>> [round(math.degrees(arc.start), 6) for arc in arcs.arcs]
    [27.05922, 207.05922]
    """
    critical = bearing.critical_tilt(condition)
    sine, reason, phase = critical.sine, critical.reason, linkage.pin_phase
    arcs: list[JamArc] = []
    touching: list[float] = []
    if sine is None:
        kappa = math.inf
        if bearing.clearance < 0.0:
            kappa, arcs = 0.0, [JamArc(0.0, math.tau)]
    elif not linkage.tilted:
        kappa, reason = math.inf, "the crank pin stays in the plane: no tilt"
        if bearing.clearance == 0.0:
            kappa, touching, reason = math.nan, [0.0], "no tilt and no clearance: touching at every angle"
    else:  # kappa is the value of |sin(f - psi1)| at which the tilt becomes critical
        if sine == 0.0 or linkage.pin_height == 0.0:  # tilts that underflow
            kappa = math.inf if sine > 0.0 else 0.0
        else:
            steep = 1.0 if linkage.rod == "rigid" else math.sqrt((1.0 - sine) * (1.0 + sine))  # tan theta = A_z / l3
            kappa = linkage.l3 * sine / steep / linkage.pin_height
        if abs(kappa - 1.0) <= _ROUNDING:
            touching = [phase + 0.5 * math.pi, phase - 0.5 * math.pi]
            reason = "the largest tilt equals the critical tilt"
        elif kappa > 1.0:
            reason = "the largest tilt is below the critical tilt"
        elif reason:  # h^2 = c (2R + c): contact, never overlap
            edge = math.asin(kappa)
            touching = sorted((phase + angle) % math.tau for angle in (edge, math.pi - edge, math.pi + edge, -edge))
        else:
            edge, length = phase + math.asin(kappa), 2.0 * math.acos(kappa)
            arcs = [JamArc(start, length) for start in sorted([edge % math.tau, (edge + math.pi) % math.tau])]
            if kappa == 0.0:
                touching, reason = [phase, phase + math.pi], "no clearance: binds at every angle with a tilt"
    touching = [angle % math.tau for angle in touching]
    return JamArcs(tuple(arcs), tuple(touching), kappa, phase, condition, reason=reason)
