"""Verdicts: whether bearings bind, and by which method this is known.

Binding is geometric: rigid parts would have to overlap.  The package calls the question "jamming"; the theory of peg
insertion (Whitney, Simunovic) keeps that word for forces that cannot push the peg, and "wedging" for two contacts that
hold each other by friction, see `graphsynth.jamming.bearing.friction`.
"""

from __future__ import annotations

from enum import Enum
from typing import TYPE_CHECKING

from graphsynth.core.shown import Shown

METHOD_CLOSED_FORM = "closed form, double precision, not certified"
METHOD_CERTIFIED = "certified: interval arithmetic with outward rounding"


class Verdict(Enum):
    """Verdict over a full rotation of the crank, or the range of a motion, and all parameters of a tolerance box.

    One vocabulary for both models: one tilted bearing (L0) and joints that share the misalignment (L1).

    What is proved (theory/jam-arcs 5, theory/extreme-cases 1): ``CERTIFIED_FREE``, an interference < 0 for all angles
    and parameters (``NO_JAM_CERTIFIED`` of the theory); ``CERTIFIED_JAMMED``, every parameter vector binds at some
    angle or input (``JAM_FOR_ALL``); ``CERTIFIED_JAMMED_FOR_SOME``, some parameter vector does (``JAM_FOR_SOME``);
    ``CANNOT_ASSEMBLE``, an interference fit, or no position of the linkage; ``UNDECIDED``, nothing, and the reason says
    what stands in the way.  Members whose name ends in ESTIMATED rest on closed forms or samples in floating point: no
    rounding error is included, so none of them is a certificate.
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

    @property
    def sentence(self) -> str:
        """The verdict in one plain sentence."""
        return _SENTENCES[self]


_TOLERANCES = "parameters within their tolerances"
_SENTENCES = {
    Verdict.CERTIFIED_FREE: f"Proved: nothing binds over the whole range, for all {_TOLERANCES}.",
    Verdict.CERTIFIED_JAMMED: f"Proved: it binds over part of the range, for all {_TOLERANCES}.",
    Verdict.CERTIFIED_JAMMED_FOR_SOME: f"Proved: it binds over part of the range, for some {_TOLERANCES}.",
    Verdict.UNDECIDED: "Undecided: neither freedom nor binding is proved.",
    Verdict.FREE_ESTIMATED: "Estimated: nothing binds over the whole range.",
    Verdict.JAMMED_ESTIMATED: "Estimated: it binds over part of the range.",
    Verdict.TOUCHING_ESTIMATED: "Estimated: it touches somewhere, with no clearance left, and binds nowhere.",
    Verdict.CANNOT_ASSEMBLE: "The parts cannot be assembled.",
}


class Assessment(Shown):
    """What the reports of both models have in common: one sentence, a table, and details on request."""

    if TYPE_CHECKING:
        verdict: Verdict
        notes: tuple[str, ...]
        seconds: float

        @property
        def statement(self) -> str:
            """The verdict in full: what is proved, or what was found at the samples."""

        @property
        def method(self) -> str:
            """How the verdict is known."""

        def _figures(self) -> list[tuple[str, str]]: ...

    def _told(self) -> tuple[str, list[tuple[str, str]]]:
        why = [("reason", self.statement)] if self.verdict is Verdict.UNDECIDED else []
        more = ("more", ".details(), .summary(), .to_pandas(), .certificate")
        return self.verdict.sentence, [*why, *self._figures(), more]

    def details(self) -> str:
        """Return in words what is known: the full statement, the figures, the method, what a reader must know."""
        rows = [("statement", self.statement), *self._figures(), ("method", self.method)]
        rows += [*(("note", note) for note in self.notes), ("run time", f"{self.seconds:.2f} s")]
        wide = max(len(name) for name, _ in rows)
        return "\n".join([self.verdict.sentence, *(f"  {name:<{wide}}  {value}" for name, value in rows)])
