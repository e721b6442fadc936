"""Verdicts on jamming: what is claimed, and how it was had."""

from __future__ import annotations

from enum import Enum

__all__ = ["METHOD_CLOSED_FORM", "Verdict"]

METHOD_CLOSED_FORM = "closed form, double precision, not certified"


class Verdict(Enum):
    """Verdict over a whole turn of the crank.

    Every member whose name ends in ESTIMATED rests on closed forms in floating point: no rounding error is included, so
    none of them is a certificate.
    """

    FREE_ESTIMATED = "free over the whole turn (estimated)"
    JAMMED_ESTIMATED = "jams on part of the turn (estimated)"
    TOUCHING_ESTIMATED = "touches without clearance left, within the rounding level (estimated)"
    CANNOT_ASSEMBLE = "the parts cannot be assembled"

    @property
    def is_free(self) -> bool:
        """True only for a verdict that says free."""
        return self is Verdict.FREE_ESTIMATED
