"""Verdicts: whether bearings bind, and by which method this is known.

Binding is geometric: rigid parts would have to overlap.  The package calls the question "jamming"; the theory of peg
insertion (Whitney, Simunovic) keeps that word for forces that cannot push the peg, and "wedging" for two contacts that
hold each other by friction, see `graphsynth.jamming.bearing.friction`.
"""

from __future__ import annotations

from enum import Enum

METHOD_CLOSED_FORM = "closed form, double precision, not certified"
METHOD_CERTIFIED = "certified: interval arithmetic with outward rounding"


class Verdict(Enum):
    """Verdict over a whole turn of the crank, or the range of a motion, and all parameters of a tolerance box.

    One vocabulary for both models: one tilted bearing (L0) and joints that share the misalignment (L1).

    What is proved (theory/jam-arcs 5, theory/extreme-cases 1), and the names of the theory:

    ``CERTIFIED_FREE``
        Interference < 0 for all angles and parameters: ``NO_JAM_CERTIFIED``.
    ``CERTIFIED_JAMMED``
        Every parameter vector binds at some angle or input: ``JAM_FOR_ALL``.
    ``CERTIFIED_JAMMED_FOR_SOME``
        Some parameter vector binds at some angle or input: ``JAM_FOR_SOME``.
    ``UNDECIDED``
        Nothing; the reason says what stands in the way: ``TOUCHING``, ``UNDECIDED``.
    ``CANNOT_ASSEMBLE``
        An interference fit, or no position of the linkage.

    Members whose name ends in ESTIMATED rest on closed forms or samples in floating point: no rounding error is
    included, so none of them is a certificate.
    """

    CERTIFIED_FREE = "free over the whole range, for all parameters given (certified)"
    CERTIFIED_JAMMED = "binds over part of the range, for all parameters given (certified)"
    CERTIFIED_JAMMED_FOR_SOME = "binds over part of the range, for some of the parameters given (certified)"
    UNDECIDED = "undecided"
    FREE_ESTIMATED = "free over the whole range (estimated)"
    JAMMED_ESTIMATED = "binds over part of the range (estimated)"
    TOUCHING_ESTIMATED = "touches with no clearance left, within rounding (estimated)"
    CANNOT_ASSEMBLE = "the parts cannot be assembled"

    @property
    def is_free(self) -> bool:
        """True only for a verdict that says free."""
        return self in (Verdict.FREE_ESTIMATED, Verdict.CERTIFIED_FREE)

    @property
    def is_jammed(self) -> bool:
        """True for a verdict that says that something binds."""
        return self in (Verdict.JAMMED_ESTIMATED, Verdict.CERTIFIED_JAMMED, Verdict.CERTIFIED_JAMMED_FOR_SOME)

    @property
    def is_certified(self) -> bool:
        """True for a verdict that is a proof."""
        return self in (Verdict.CERTIFIED_FREE, Verdict.CERTIFIED_JAMMED, Verdict.CERTIFIED_JAMMED_FOR_SOME)
