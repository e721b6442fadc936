"""Sets of crank angles: spans on the circle with rigorous ends.

A `Span` runs counter-clockwise from ``start`` to ``stop`` (radians, ``stop`` may exceed a turn).  Outer sets are only
ever enlarged by rounding, inner sets only shrunk.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import NamedTuple

__all__ = [
    "FULL_TURN", "TURN_HIGH", "TURN_LOW", "Span", "complement", "contains", "covers", "meets", "merge_outer",
    "strictly_inside", "subtract", "total_length",
]  # fmt: skip

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

    Examples
    --------
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

    Examples
    --------
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


def strictly_inside(spans: Iterable[Span], f: float) -> bool:
    """Whether a crank angle (a double in [-2 pi, 4 pi]) certainly lies in one of the spans; never true by rounding."""
    return covers(spans, f, f)


def covers(spans: Iterable[Span], start: float, stop: float) -> bool:
    """Whether one of the spans certainly holds the piece from ``start`` to ``stop`` in its inside."""
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
