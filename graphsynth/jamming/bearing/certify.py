"""`certify_jamming`: a proved verdict on one tilted bearing over a full rotation and a tolerance box (model L0)."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from fractions import Fraction
from time import perf_counter
from typing import TYPE_CHECKING, Any

import numpy as np

from graphsynth.core.checks import checked
from graphsynth.core.shown import Shown
from graphsynth.intervals import Interval, check_rounding, pi, sin
from graphsynth.intervals.reading import shortened
from graphsynth.jamming.bearing import corners
from graphsynth.jamming.bearing.arcs import FULL_TURN, CertifiedArcs, Enclosure, arcs_from, covers, meets
from graphsynth.jamming.bearing.bearing import Condition
from graphsynth.jamming.bearing.parameters import Range, ToleranceBox, exact_text
from graphsynth.jamming.verdict import METHOD_CERTIFIED, Verdict

if TYPE_CHECKING:
    import pandas as pd

#: What the verdict is about, and what that neglects.
MODEL = "L0 with exact tilts: the bearing at B takes the whole misalignment, the other joints none; rigid parts"


@dataclass(frozen=True)
class Witness:
    """A jam that is proved: exact parameters, a crank angle, and a positive lower bound of the interference there.

    ``parameters`` are exact numbers as text; ranges ``[a, b]`` where every parameter vector binds.  ``f`` (radians)
    encloses the crank angle (one for each vector, after its own phase), ``interference`` (mm) holds a positive lower
    bound.
    """

    parameters: dict[str, str]
    f: Enclosure
    interference: Enclosure


@dataclass(frozen=True, eq=False, repr=False)
class JamCertificate(Shown):
    """What is proved about the bearing at B, for every crank angle and every parameter vector of the box.

    Attributes
    ----------
    verdict, reason : Verdict, str
        What is proved; why nothing is, or what is special, empty for a plain verdict.
    largest_interference : Enclosure
        Of the largest interference over the turn and the box, mm, whether the linkage can be assembled there or not;
        a negative upper end proves that all is free.
    smallest_worst_interference : Enclosure
        Of the smallest value over the box of the largest interference over the turn, mm; a positive lower end proves
        that every parameter vector binds if ``assembles`` is "always" (else ``witness`` does).
    largest_tilt, critical_tilt : Enclosure
        Range over the box of the largest tilt of a turn and of the critical tilt, radians; infinite: none.
    assembles : {"always", "at some angles", "never", "not decided"}
        What is proved about assembly, for every parameter vector.
    witness : Witness or None
        Evidence of a jam for ``CERTIFIED_JAMMED`` and ``CERTIFIED_JAMMED_FOR_SOME``.
    exact_input : bool
        False if a plain float came in; the statement then holds for that double.
    """

    verdict: Verdict
    reason: str
    condition: str
    box: ToleranceBox
    largest_interference: Enclosure
    smallest_worst_interference: Enclosure
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
        return Enclosure(-self.largest_interference.hi, -self.largest_interference.lo)

    @property
    def tilt_margin(self) -> Enclosure:
        """Critical tilt minus largest tilt for the worst and the best parameters, radians (outward)."""
        low = math.nextafter(self.critical_tilt.lo - self.largest_tilt.hi, -math.inf)
        return Enclosure(low, math.nextafter(self.critical_tilt.hi - self.largest_tilt.lo, math.inf))

    @property
    def statement(self) -> str:
        """The sentence that is proved, or what is missing; lengths rounded so that it stays true."""
        who = "the bearing" if self.box.is_point else "every bearing of the tolerance box"
        given = "" if self.exact_input else " (of floating-point numbers: floats came in, decimals are not guaranteed)"
        # of a position that can be assembled: the largest interference of all may lie beyond a dead centre
        missing = shortened(self.witness.interference.lo, -1) if self.witness else "0"
        match self.verdict:
            case Verdict.CERTIFIED_FREE:
                left = shortened(-self.largest_interference.hi, -1)
                text = f"proved: {who} stays free at every crank angle, with at least {left} mm of clearance left"
            case Verdict.CERTIFIED_JAMMED:
                text = f"proved: {who} binds during the rotation, with at least {missing} mm of interference"
            case Verdict.CERTIFIED_JAMMED_FOR_SOME:
                text = f"proved: one bearing of the tolerance box binds, with at least {missing} mm of interference"
            case Verdict.CANNOT_ASSEMBLE:
                text = f"the parts cannot be assembled: {self.reason}"
            case _:
                text = f"undecided: {self.reason}"
        return f"{text} (contact condition {self.condition}, exact tilt, taken by this bearing alone){given}"

    def _told(self) -> tuple[str, list[tuple[str, str]]]:
        told = {"interference": (self.largest_interference, "mm"), "critical tilt": (self.critical_tilt, "rad")}
        return self.statement, [(name, f"{x.lo:.9g} to {x.hi:.9g} {unit}") for name, (x, unit) in told.items()]

    @checked
    def over(self, start: float, stop: float) -> Verdict:
        """Return what is proved about a part of the turn: from ``start`` counter-clockwise to ``stop``, radians.

        ``stop`` below ``start`` runs across the full rotation; a turn or more is the full rotation.

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
            **{name: getattr(self, name) for name in ("statement", "method", "model", "condition")},
            "parameters": self.box.describe(),
            "exact_input": self.exact_input,
            "largest_interference_mm": list(self.largest_interference),
            "smallest_worst_interference_mm": list(self.smallest_worst_interference),
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


_ANGLES = 64  # angles of the turn tried as positions of a jam: a multiple of four, so the quarter turns are among them
_PIECES = 256  # pieces of the turn on which assembly is proved


@checked
def certify_jamming(box: ToleranceBox, condition: Condition = "A") -> JamCertificate:
    """Prove whether the bearing at B binds while the crank makes a turn, for all parameters of a box.

    The interference is monotone in every parameter, so that its extremes over the box are values at two exact corners
    (theory/jam-arcs 6); a jam also needs a position that can be assembled, which interval kinematics proves.

    Parameters
    ----------
    box, condition : ToleranceBox, {"A", "B", "general"}
        The linkage and the bearing; give text or fractions, not floats, if the numbers are decimals.  And the contact
        condition, see `Bearing.interference`.

    Returns
    -------
    JamCertificate
        Certified: every rounding error is included.  Where neither side is proved, ``UNDECIDED`` with the reason.

    Raises
    ------
    GeometryError
        An unknown condition, or "general" without a hole length.

    Examples
    --------
    >>> found = certify_jamming(ToleranceBox(alpha="0.0130 +- 0.00013", clearance="0.03 +- 0.003"))
    >>> found.verdict.name, found.largest_interference.hi < 0
    ('CERTIFIED_FREE', True)
    """
    begin = perf_counter()
    check_rounding()
    corners.check_condition(box, condition)
    c = box["clearance"]
    if c.lower >= 0:
        return _Proof(box, condition, begin).result()
    # of all clearances, the negative ones included
    tilt = corners.sines(box)
    depths = corners.interference_corners(box, tilt.sine, condition)
    low, high = Enclosure.of(depths[0]), Enclosure.of(depths[1])
    bounds: Any = {"largest_interference": high, "smallest_worst_interference": low}
    if c.upper < 0:
        nothing = Enclosure(0.0, 0.0)
        reason = "interference fit: the clearance is negative, the parts overlap at every tilt"
        return JamCertificate(
            verdict=Verdict.CANNOT_ASSEMBLE,
            reason=reason,
            condition=condition,
            box=box,
            **bounds,
            largest_tilt=_angles(tilt.sine),
            critical_tilt=nothing,
            arcs=CertifiedArcs((), (FULL_TURN,), (FULL_TURN,), nothing, Enclosure(-math.pi, math.pi), reason),
            assembles="never",
            witness=None,
            exact_input=box.exact_input,
            boxes=2,
            seconds=perf_counter() - begin,
        )
    # jams of the sound part of the clearances count, freedom does not
    found = _Proof(box.replace(clearance=Range(Fraction(0), c.upper, c.exact)), condition, begin).result()
    verdict, reason = found.verdict, found.reason
    text = "part of the range of the clearance is an interference fit, which cannot be assembled"
    if verdict is Verdict.CERTIFIED_JAMMED:
        verdict, reason = Verdict.CERTIFIED_JAMMED_FOR_SOME, text
    elif verdict is not Verdict.CERTIFIED_JAMMED_FOR_SOME:
        verdict, reason = Verdict.UNDECIDED, text
    return replace(found, verdict=verdict, reason=reason, box=box, **bounds, seconds=perf_counter() - begin)


class _Proof:
    """One run: the corner values, then the weakest work that settles the verdict."""

    def __init__(self, box: ToleranceBox, condition: Condition, begin: float) -> None:
        self.box, self.condition, self.begin = box, condition, begin
        self.tilt = corners.sines(box)
        self.depths = corners.interference_corners(box, self.tilt.sine, condition)
        self.critical = corners.critical_sines(box, condition)
        self.phase = corners.phase(box)
        self.kappa = Enclosure(*corners.onset(box, self.critical, self.tilt))
        self.boxes = 2
        self.assembles = self._assembly(box)

    def result(self) -> JamCertificate:
        low, high = Enclosure.of(self.depths[0]), Enclosure.of(self.depths[1])
        verdict, reason, witness = Verdict.UNDECIDED, "", None
        if self.assembles == "never":
            verdict, reason = Verdict.CANNOT_ASSEMBLE, "no crank angle can be assembled, for any parameters"
        elif high.hi < 0.0:
            verdict = Verdict.CERTIFIED_FREE
        else:
            witness = self._jam(self.box, low) if low.lo > 0.0 else None
            if witness:
                verdict = Verdict.CERTIFIED_JAMMED
            elif high.lo > 0.0:
                witness = self._jam(corners.worst_corner(self.box, self.condition))
                verdict = Verdict.CERTIFIED_JAMMED_FOR_SOME if witness else Verdict.UNDECIDED
        if verdict is Verdict.UNDECIDED:
            reason = self._why(high)
        return self._finish(verdict, reason, witness)

    def _why(self, high: Enclosure) -> str:
        if high.lo > 0.0:
            return "the clearance is used up, but no position that binds is proved to be assembled"
        c = self.box["clearance"]
        if c.lower == 0:
            if self.kappa.lo > 0.0 or float(self.tilt.sine.hi[1]) == 0.0:
                return "touching: no clearance and no tilt, the parts touch at every angle"
            return "touching: no clearance is left at the lower end of its range"
        h, least, R = self.box["Hb"].upper / 2, c.lower, self.box["Rb"].lower
        if self.condition == "A" and h * h == least * (2 * R + least):
            return "touching: h^2 = c (2R + c) exactly, the parts can touch but never overlap"
        width = f"[{shortened(high.lo, -1, 3)}, {shortened(high.hi, 1, 3)}] mm"
        touching = "which contains 0: touching at this resolution; change a tolerance"
        return f"the largest interference lies in {width}, {touching}"

    def _assembly(self, box: ToleranceBox) -> str:
        """Say at how much of the turn the linkage is proved to be assembled, for every parameter vector."""
        if corners.turns_freely(box, float(self.tilt.amplitude.hi[1])):
            return "always"
        # pieces that overlap by rounding only and cover the turn
        edges = np.linspace(0.0, float(np.nextafter(2.0 * np.pi, 7.0)), _PIECES + 1)
        found = corners.pose(box, Interval.from_bounds(edges[:-1], edges[1:]))
        self.boxes += _PIECES
        if found.assembled.all():
            return "always"
        if found.missing.all():
            return "never"
        return "at some angles" if found.assembled.any() else "not decided"

    def _jam(self, box: ToleranceBox, interference: Enclosure | None = None) -> Witness | None:
        """Find an angle at which every parameter vector of ``box`` is proved assembled and jammed.

        ``interference`` is the least of the box at the worst angle, if it is known.
        """
        # exact numbers; where every value of a range binds, both ends
        parameters = {}
        for name, value in box.ranges.items():
            low, high = exact_text(value.lower), exact_text(value.upper)
            parameters[name] = low if value.is_point else f"[{low}, {high}]"
        if self.assembles == "always":  # a quarter turn after its phase the tilt of every parameter vector is largest
            if interference is None:
                self.boxes += 1
                depths = corners.interference_corners(box, corners.sines(box).sine, self.condition)
                interference = Enclosure.of(depths[0])
            angle = Enclosure.of(corners.phase(box) + pi() / 2)
            return Witness(parameters, angle, interference) if interference.lo > 0.0 else None
        halves = 2.0 * np.arange(_ANGLES) / _ANGLES
        turn = pi() * Interval.from_bounds(halves, halves)  # angles after the phase
        tilt = corners.sines(box) if box is not self.box else self.tilt
        amplitude = Interval.from_bounds(tilt.amplitude.lo[0], tilt.amplitude.hi[0])
        sine = corners.sine_of(amplitude * abs(sin(turn)), box.rod)
        depths = corners.corner_interference(box, sine, self.condition, 0)
        f = corners.phase(box) + turn
        found = corners.pose(box, f)
        self.boxes += _ANGLES
        proved = np.flatnonzero((depths.lo > 0.0) & found.assembled)
        if proved.size == 0:
            return None
        best = int(proved[np.argmax(depths.lo[proved])])
        return Witness(parameters, Enclosure.of(f[best]), Enclosure.of(depths[best]))

    def _finish(self, verdict: Verdict, reason: str, witness: Witness | None) -> JamCertificate:
        shown, still = Enclosure.of(self.phase), float(self.tilt.amplitude.hi[1]) == 0.0
        if verdict is Verdict.CERTIFIED_FREE:
            why = "the parts stay clear of each other"
            if self.kappa.lo == math.inf:
                why = "the crank pin stays in the plane: no tilt" if still else "there is no critical tilt"
            arcs = CertifiedArcs((), (), (), self.kappa, shown, why)
        elif self.kappa.lo == 0.0 and still:
            arcs = CertifiedArcs((), (), (FULL_TURN,), self.kappa, shown, reason)
        else:
            arcs = arcs_from(self.kappa, self.phase)
        return JamCertificate(
            verdict=verdict,
            reason=reason,
            condition=self.condition,
            box=self.box,
            largest_interference=Enclosure.of(self.depths[1]),
            smallest_worst_interference=Enclosure.of(self.depths[0]),
            largest_tilt=_angles(self.tilt.sine),
            critical_tilt=_angles(self.critical),
            arcs=arcs,
            assembles=self.assembles,
            witness=witness,
            exact_input=self.box.exact_input,
            boxes=self.boxes,
            seconds=perf_counter() - self.begin,
        )


def _angles(sine: Interval) -> Enclosure:
    """Range of the angles of a pair of sines; an infinite sine stands for "none"."""
    low, high = float(sine.lo[0]), float(sine.hi[1])
    first = float(corners.arcsine(low).lo) if low <= 1.0 else math.inf
    return Enclosure(first, float(corners.arcsine(high).hi) if high <= 1.0 else math.inf)
