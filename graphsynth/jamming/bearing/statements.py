"""Sentences that say what a certificate proves."""

from __future__ import annotations

from typing import TYPE_CHECKING

from graphsynth.intervals.reading import shortened
from graphsynth.jamming.verdict import Verdict

if TYPE_CHECKING:
    from graphsynth.jamming.bearing.certificate import JamCertificate

__all__ = ["statement"]


def statement(found: JamCertificate) -> str:
    """Say what is proved, or why nothing is; lengths rounded so that the sentence stays true."""
    who = "the bearing" if found.box.is_point else "every bearing of the tolerance box"
    given = "" if found.exact_input else " (for the doubles given: floats came in, decimals are not guaranteed)"
    gap = found.largest_gap
    left = shortened(-gap.hi, -1)
    # of a position that can be assembled: the largest gap of all may lie beyond a dead centre
    missing = shortened(found.witness.gap.lo, -1) if found.witness else "0"
    match found.verdict:
        case Verdict.CERTIFIED_FREE:
            text = f"proved: {who} is free at every crank angle; at least {left} mm of clearance are left"
        case Verdict.CERTIFIED_JAMMED:
            text = f"proved: {who} jams during the turn; at least {missing} mm are missing"
        case Verdict.CERTIFIED_JAMMED_FOR_SOME:
            text = f"proved: a bearing of the tolerance box jams; at least {missing} mm are missing there"
        case Verdict.CANNOT_ASSEMBLE:
            text = f"the parts cannot be assembled: {found.reason}"
        case _:
            text = f"undecided: {found.reason}"
    return f"{text} (condition {found.condition}; exact tilt, all of it taken by this bearing){given}"
