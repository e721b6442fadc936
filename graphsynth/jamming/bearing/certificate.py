"""`JamCertificate`: what is proved about one tilted bearing over a turn and a tolerance box, with its evidence."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from graphsynth.core.checks import checked
from graphsynth.jamming.bearing.certified_arcs import CertifiedArcs, Enclosure
from graphsynth.jamming.bearing.circle_sets import covers, meets
from graphsynth.jamming.bearing.parameters import ToleranceBox
from graphsynth.jamming.verdict import METHOD_CERTIFIED, Verdict

if TYPE_CHECKING:
    import pandas as pd

__all__ = ["JamCertificate", "Witness"]

#: What the verdict is about, and what that neglects.
MODEL = "L0 with exact tilts: the bearing at B takes the whole misalignment, the other joints none; rigid parts"


@dataclass(frozen=True)
class Witness:
    """A jam that is proved: exact parameters, a crank angle, and a positive lower bound of the gap function there.

    ``parameters`` are exact numbers as text; ranges ``[a, b]`` where every parameter vector jams.  ``f`` (radians)
    encloses the crank angle (one for each vector, after its own phase), ``gap`` (mm) holds a positive lower bound.
    """

    parameters: dict[str, str]
    f: Enclosure
    gap: Enclosure


@dataclass(frozen=True, eq=False)
class JamCertificate:
    """What is proved about the bearing at B, for every crank angle and every parameter vector of the box.

    Attributes
    ----------
    verdict : Verdict
        See the table there.
    reason : str
        Why nothing is proved, or what is special; empty for a plain verdict.
    condition : str
        Contact condition used.
    box : ToleranceBox
        The parameters.
    largest_gap : Enclosure
        Of the largest gap function over the turn and the box, mm, whether the linkage can be assembled there or not;
        a negative upper end proves that all is free.
    smallest_worst_gap : Enclosure
        Of the smallest value over the box of the largest gap over the turn, mm; a positive lower end proves that every
        parameter vector jams if ``assembles`` is "always" (else ``witness`` does).
    largest_tilt, critical_tilt : Enclosure
        Range over the box of the largest tilt of a turn and of the critical tilt, radians; infinite: none.
    arcs : CertifiedArcs
        Jam arcs with inner and outer bounds.
    assembles : {"always", "at some angles", "never", "not decided"}
        What is proved about assembly, for every parameter vector.
    witness : Witness or None
        Evidence of a jam for ``CERTIFIED_JAMMED`` and ``CERTIFIED_JAMMED_FOR_SOME``.
    exact_input : bool
        False if a plain float came in; the statement then holds for that double.
    boxes : int
        Boxes evaluated.
    seconds : float
        Run time.
    """

    verdict: Verdict
    reason: str
    condition: str
    box: ToleranceBox
    largest_gap: Enclosure
    smallest_worst_gap: Enclosure
    largest_tilt: Enclosure
    critical_tilt: Enclosure
    arcs: CertifiedArcs
    assembles: str
    witness: Witness | None
    exact_input: bool
    boxes: int
    seconds: float = field(default=0.0, compare=False)
    method: str = METHOD_CERTIFIED
    model: str = MODEL

    @property
    def clearance_left(self) -> Enclosure:
        """Range that holds the clearance left at the worst angle of the worst parameters, mm; negative is missing."""
        return Enclosure(-self.largest_gap.hi, -self.largest_gap.lo)

    @property
    def tilt_margin(self) -> Enclosure:
        """Critical tilt minus largest tilt for the worst and the best parameters, radians (outward)."""
        low = math.nextafter(self.critical_tilt.lo - self.largest_tilt.hi, -math.inf)
        return Enclosure(low, math.nextafter(self.critical_tilt.hi - self.largest_tilt.lo, math.inf))

    @property
    def statement(self) -> str:
        """The sentence that is proved, or what is missing."""
        from graphsynth.jamming.bearing.statements import statement

        return statement(self)

    @checked
    def over(self, start: float, stop: float) -> Verdict:
        """Return what is proved about a part of the turn: from ``start`` counter-clockwise to ``stop``, radians.

        ``stop`` below ``start`` runs across the full turn; a turn or more is the whole turn.

        Raises
        ------
        GeometryError
            For an angle that is not finite.

        Examples
        --------
        >>> from graphsynth.jamming.bearing.certify import certify_jamming
        >>> found = certify_jamming(ToleranceBox(alpha="1/30"))
        >>> found.over(-0.4, 0.4).name, found.over(0.4, 1.0).name, found.over(6.0, 0.4).name
        ('CERTIFIED_FREE', 'CERTIFIED_JAMMED', 'CERTIFIED_FREE')
        """
        if self.verdict is Verdict.CANNOT_ASSEMBLE or stop - start >= math.tau:
            return self.verdict
        length = (stop - start) % math.tau if stop < start else stop - start
        first = start % math.tau if abs(start) > math.tau else start
        last = first + length
        if (first, last) != (start, stop):  # the reduction was rounded: what is asked lies in a slightly longer piece
            pad = 1e-15 * (10.0 + abs(start) + abs(stop))  # more than 2.5e-16 for each turn taken off
            wide, narrow = (first - pad, last + pad), (first + pad, last - pad)
        else:
            wide = narrow = (first, last)
        if covers(self.arcs.free, *wide):
            return Verdict.CERTIFIED_FREE
        jams = self.assembles == "always" and narrow[0] <= narrow[1] and meets(self.arcs.inner, *narrow)
        return Verdict.CERTIFIED_JAMMED if jams else Verdict.UNDECIDED

    def summary(self) -> dict[str, Any]:
        """Plain values for a report or a JSON file; angles in radians, lengths in mm."""
        arcs = self.arcs
        return {
            "verdict": self.verdict.name,
            "statement": self.statement,
            "method": self.method,
            "model": self.model,
            "condition": self.condition,
            "parameters": self.box.describe(),
            "exact_input": self.exact_input,
            "largest_gap_mm": list(self.largest_gap),
            "smallest_worst_gap_mm": list(self.smallest_worst_gap),
            "largest_tilt": list(self.largest_tilt),
            "critical_tilt": list(self.critical_tilt),
            "kappa": list(arcs.kappa),
            "arcs": [{"start": list(a.start), "stop": list(a.stop)} for a in arcs.arcs],
            **{name: [list(span) for span in getattr(arcs, name)] for name in ("inner", "outer", "undecided", "free")},
            "assembles": self.assembles,
            "boxes": self.boxes,
            "seconds": self.seconds,
        }

    def to_pandas(self) -> pd.DataFrame:
        """Return the partition of the turn as a table: kind, start and stop in radians."""
        import pandas as pd

        kinds = ("free", "inner", "undecided")
        rows = [(kind, *span) for kind in kinds for span in getattr(self.arcs, kind)]
        frame = pd.DataFrame(rows, columns=["kind", "start", "stop"])
        return frame.sort_values("start", ignore_index=True)
