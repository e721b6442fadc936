"""Verdicts on jamming: what is claimed, and how it was had."""

from __future__ import annotations

from enum import Enum

METHOD_CLOSED_FORM = "closed form, double precision, not certified"
METHOD_CERTIFIED = "certified: interval arithmetic with outward rounding"


class Verdict(Enum):
    """Verdict over a whole turn of the crank, or the range of a motion, and all parameters of a tolerance box.

    One vocabulary for both models: one tilted bearing (L0) and joints that share the misalignment (L1).

    ============================= ============================== ==================================================
    member                        what is proved (theory/jam-arcs 5)
    ============================= ============================== ==================================================
    ``CERTIFIED_FREE``            ``NO_JAM_CERTIFIED``           g < 0 for every angle and every parameter vector
    ``CERTIFIED_JAMMED``          ``JAM_FOR_ALL``                every parameter vector jams at some angle or input
    ``CERTIFIED_JAMMED_FOR_SOME`` ``JAM_FOR_SOME``               some parameter vector jams at some angle or input
    ``UNDECIDED``                 ``TOUCHING``, ``UNDECIDED``    nothing; the reason says what stands in the way
    ``CANNOT_ASSEMBLE``           (theory/extreme-cases 1)                   interference fit, or no position of the
    linkage ============================= ==============================
    ==================================================

    Members whose name ends in ESTIMATED rest on closed forms or samples in floating point: no rounding error is
    included, so none of them is a certificate.
    """

    CERTIFIED_FREE = "free over the whole turn or range (certified)"
    CERTIFIED_JAMMED = "jams on part of the turn or range, for all parameters given (certified)"
    CERTIFIED_JAMMED_FOR_SOME = "jams on part of the turn or range, for some of the parameters given (certified)"
    UNDECIDED = "undecided"
    FREE_ESTIMATED = "free over the whole turn or range (estimated)"
    JAMMED_ESTIMATED = "jams on part of the turn or range (estimated)"
    TOUCHING_ESTIMATED = "touches without clearance left, within the rounding level (estimated)"
    CANNOT_ASSEMBLE = "the parts cannot be assembled"

    @property
    def is_free(self) -> bool:
        """True only for a verdict that says free."""
        return self in (Verdict.FREE_ESTIMATED, Verdict.CERTIFIED_FREE)

    @property
    def is_jammed(self) -> bool:
        """True for a verdict that says that something jams."""
        return self in (Verdict.JAMMED_ESTIMATED, Verdict.CERTIFIED_JAMMED, Verdict.CERTIFIED_JAMMED_FOR_SOME)

    @property
    def is_certified(self) -> bool:
        """True for a verdict that is a proof."""
        return self in (Verdict.CERTIFIED_FREE, Verdict.CERTIFIED_JAMMED, Verdict.CERTIFIED_JAMMED_FOR_SOME)
