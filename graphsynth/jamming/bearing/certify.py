"""`certify_jamming`: a proved verdict on one tilted bearing over a full rotation and a tolerance box (model L0)."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from fractions import Fraction
from time import perf_counter
from typing import TYPE_CHECKING, Any

from graphsynth.core.checks import checked
from graphsynth.intervals.reading import shortened
from graphsynth.jamming.bearing.arcs import CertifiedArcs, Enclosure, arcs_from, covers, meets, no_arcs, whole_turn
from graphsynth.jamming.bearing.bearing import Condition
from graphsynth.jamming.bearing.parameters import Range, ToleranceBox, exact_text
from graphsynth.jamming.verdict import METHOD_CERTIFIED, Verdict

if TYPE_CHECKING:
    import pandas as pd

    from graphsynth.intervals import Interval


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
    largest_interference : Enclosure
        Of the largest interference over the turn and the box, mm, whether the linkage can be assembled there or not;
        a negative upper end proves that all is free.
    smallest_worst_interference : Enclosure
        Of the smallest value over the box of the largest interference over the turn, mm; a positive lower end proves
        that every parameter vector binds if ``assembles`` is "always" (else ``witness`` does).
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
        """The sentence that is proved, or what is missing."""
        return statement(self)

    @checked
    def over(self, start: float, stop: float) -> Verdict:
        """Return what is proved about a part of the turn: from ``start`` counter-clockwise to ``stop``, radians.

        ``stop`` below ``start`` runs across the full rotation; a turn or more is the full rotation.

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


def statement(found: JamCertificate) -> str:
    """Say what is proved, or why nothing is; lengths rounded so that the sentence stays true."""
    who = "the bearing" if found.box.is_point else "every bearing of the tolerance box"
    given = "" if found.exact_input else " (for the doubles given: floats came in, decimals are not guaranteed)"
    interference = found.largest_interference
    left = shortened(-interference.hi, -1)
    # of a position that can be assembled: the largest interference of all may lie beyond a dead centre
    missing = shortened(found.witness.interference.lo, -1) if found.witness else "0"
    match found.verdict:
        case Verdict.CERTIFIED_FREE:
            text = f"proved: {who} stays free at every crank angle, with at least {left} mm of clearance left"
        case Verdict.CERTIFIED_JAMMED:
            text = f"proved: {who} binds during the rotation, with at least {missing} mm of interference"
        case Verdict.CERTIFIED_JAMMED_FOR_SOME:
            text = f"proved: one bearing of the tolerance box binds, with at least {missing} mm of interference"
        case Verdict.CANNOT_ASSEMBLE:
            text = f"the parts cannot be assembled: {found.reason}"
        case _:
            text = f"undecided: {found.reason}"
    return f"{text} (contact condition {found.condition}, exact tilt, taken by this bearing alone){given}"


_ANGLES = 64  # angles of the turn tried as positions of a jam
_PIECES = 256  # pieces of the turn on which assembly is proved


@checked
def certify_jamming(box: ToleranceBox, condition: Condition = "A") -> JamCertificate:
    """Prove whether the bearing at B binds while the crank makes a turn, for all parameters of a box.

    Parameters
    ----------
    box : ToleranceBox
        The linkage and the bearing; give text or fractions, not floats, if the numbers are decimals.
    condition : {"A", "B", "general"}
        Contact condition, see `Bearing.interference`.

    Returns
    -------
    JamCertificate
        Certified: every rounding error is included.  Where neither side is proved, ``UNDECIDED`` with the reason.

    Raises
    ------
    GeometryError
        An unknown condition, or "general" without a hole length.
    GraphsynthError
        If another library has changed the rounding mode of the processor.

    Notes
    -----
    The interference is monotone in every parameter, so that its extremes over the box are values at two exact corners
    (theory/jam-arcs 6); a jam also needs a position that can be assembled, which interval kinematics proves.

    Examples
    --------
    >>> found = certify_jamming(ToleranceBox(alpha="0.0130 +- 0.00013", clearance="0.03 +- 0.003"))
    >>> found.verdict.name, found.largest_interference.hi < 0
    ('CERTIFIED_FREE', True)
    """
    from graphsynth.intervals import check_rounding
    from graphsynth.jamming.bearing.corners import check_condition

    begin = perf_counter()
    check_rounding()
    check_condition(box, condition)
    clearance = box["clearance"]
    if clearance.upper < 0:
        return _interference(box, condition, begin)
    if clearance.lower < 0:
        return _partly_interference(box, condition, begin)
    return _Proof(box, condition, begin).result()


class _Proof:
    """One run: the corner values, then the weakest work that settles the verdict."""

    def __init__(self, box: ToleranceBox, condition: Condition, begin: float) -> None:
        from graphsynth.jamming.bearing import corners

        self.box, self.condition, self.begin = box, condition, begin
        self.tilt = corners.sines(box)
        self.depths = corners.interference_corners(box, self.tilt.sine, condition)
        self.critical = corners.critical_sines(box, condition)
        self.phase = corners.phase(box)
        self.kappa = Enclosure(*corners.onset(box, self.critical, self.tilt))
        self.boxes = 2
        self.assembles = self._assembly(box)

    def result(self) -> JamCertificate:

        low, high = _pair(self.depths, 0), _pair(self.depths, 1)
        verdict, reason, witness = Verdict.UNDECIDED, "", None
        if self.assembles == "never":
            verdict, reason = Verdict.CANNOT_ASSEMBLE, "no crank angle can be assembled, for any parameters"
        elif high.hi < 0.0:
            verdict = Verdict.CERTIFIED_FREE
        else:
            witness = self._jam_of_all(low) if low.lo > 0.0 else None
            if witness:
                verdict = Verdict.CERTIFIED_JAMMED
            elif high.lo > 0.0:
                witness = self._jam_of_worst()
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
        if self.condition == "A" and _touches_only(self.box):
            return "touching: h^2 = c (2R + c) exactly, the parts can touch but never overlap"
        from graphsynth.intervals.reading import shortened

        width = f"[{shortened(high.lo, -1, 3)}, {shortened(high.hi, 1, 3)}] mm"
        touching = "which contains 0: touching at this resolution; change a tolerance"
        return f"the largest interference lies in {width}, {touching}"

    def _assembly(self, box: ToleranceBox) -> str:
        """Say at how much of the turn the linkage is proved to be assembled, for every parameter vector."""
        from graphsynth.jamming.bearing.corners import pose, turn_pieces, turns_freely

        if turns_freely(box, float(self.tilt.amplitude.hi[1])):
            return "always"
        found = pose(box, turn_pieces(_PIECES))
        self.boxes += _PIECES
        if found.assembled.all():
            return "always"
        if found.missing.all():
            return "never"
        return "at some angles" if found.assembled.any() else "not decided"

    def _jam_of_all(self, interference: Enclosure) -> Witness | None:
        """Find a position in which every parameter vector binds; ``interference`` is the least at the worst angle."""
        if self.assembles == "always":
            return _at_worst_angle(self.box, interference)
        return self._jam_on_grid(self.box)

    def _jam_of_worst(self) -> Witness | None:
        """Find a position in which the worst parameter vector binds."""
        from graphsynth.jamming.bearing import corners

        worst = corners.worst_corner(self.box, self.condition)
        if self.assembles != "always":
            return self._jam_on_grid(worst)
        self.boxes += 1
        interference = _pair(corners.interference_corners(worst, corners.sines(worst).sine, self.condition), 0)
        return _at_worst_angle(worst, interference) if interference.lo > 0.0 else None

    def _jam_on_grid(self, box: ToleranceBox) -> Witness | None:
        """Look for an angle at which every parameter vector of ``box`` is proved assembled and jammed."""
        import numpy as np

        from graphsynth.intervals import Interval, sin
        from graphsynth.jamming.bearing import corners

        turn = corners.grid(_ANGLES)  # angles after the phase
        tilt = corners.sines(box) if box is not self.box else self.tilt
        amplitude = Interval.from_bounds(tilt.amplitude.lo[0], tilt.amplitude.hi[0])
        sine = corners.sine_of(amplitude * abs(sin(turn)), box.rod)
        interference = corners.corner_interference(box, sine, self.condition, 0)
        f = corners.phase(box) + turn
        found = corners.pose(box, f)
        self.boxes += _ANGLES
        proved = np.flatnonzero((interference.lo > 0.0) & found.assembled)
        if proved.size == 0:
            return None
        best = int(proved[np.argmax(interference.lo[proved])])
        angle = Enclosure(float(f.lo[best]), float(f.hi[best]))
        return _witness(box, angle, Enclosure(float(interference.lo[best]), float(interference.hi[best])))

    def _finish(self, verdict: Verdict, reason: str, witness: Witness | None) -> JamCertificate:
        shown = Enclosure(float(self.phase.lo), float(self.phase.hi))
        if verdict is Verdict.CERTIFIED_FREE:
            why = "the parts stay clear of each other"
            if self.kappa.lo == math.inf:
                still = float(self.tilt.amplitude.hi[1]) == 0.0
                why = "the crank pin stays in the plane: no tilt" if still else "there is no critical tilt"
            arcs = no_arcs(self.kappa, shown, why)
        elif self.kappa.lo == 0.0 and float(self.tilt.amplitude.hi[1]) == 0.0:
            arcs = whole_turn(self.kappa, shown, reason, False)
        else:
            arcs = arcs_from(self.kappa, self.phase)
        return JamCertificate(
            verdict=verdict,
            reason=reason,
            condition=self.condition,
            box=self.box,
            largest_interference=_pair(self.depths, 1),
            smallest_worst_interference=_pair(self.depths, 0),
            largest_tilt=_angles(self.tilt.sine),
            critical_tilt=_angles(self.critical),
            arcs=arcs,
            assembles=self.assembles,
            witness=witness,
            exact_input=self.box.exact_input,
            boxes=self.boxes,
            seconds=perf_counter() - self.begin,
        )


def _at_worst_angle(box: ToleranceBox, interference: Enclosure) -> Witness:
    """Return the position a quarter turn after the phase, where the tilt of every parameter vector is largest."""
    from graphsynth.intervals import pi
    from graphsynth.jamming.bearing.corners import phase

    f = phase(box) + pi() / 2
    return _witness(box, Enclosure(float(f.lo), float(f.hi)), interference)


def _witness(box: ToleranceBox, angle: Enclosure, interference: Enclosure) -> Witness:
    return Witness({name: _text(value) for name, value in box.ranges.items()}, angle, interference)


def _text(value: Range) -> str:
    """Write a parameter exactly; a range, where every value of it binds, by both ends."""
    if value.is_point:
        return exact_text(value.lower)
    return f"[{exact_text(value.lower)}, {exact_text(value.upper)}]"


def _pair(values: Interval, corner: int) -> Enclosure:
    return Enclosure(float(values.lo[corner]), float(values.hi[corner]))


def _angles(sine: Interval) -> Enclosure:
    """Range of the angles of a pair of sines; an infinite sine stands for "none"."""
    from graphsynth.jamming.bearing.corners import arcsine

    low, high = float(sine.lo[0]), float(sine.hi[1])
    first = float(arcsine(low).lo) if low <= 1.0 else math.inf
    return Enclosure(first, float(arcsine(high).hi) if high <= 1.0 else math.inf)


def _touches_only(box: ToleranceBox) -> bool:
    h, c, R = box["Hb"].upper / 2, box["clearance"].lower, box["Rb"].lower
    return h * h == c * (2 * R + c)


def _interference(box: ToleranceBox, condition: Condition, begin: float) -> JamCertificate:
    """Answer for a clearance that is negative throughout."""
    from graphsynth.jamming.bearing import corners

    tilt = corners.sines(box)
    depths = corners.interference_corners(box, tilt.sine, condition)
    nothing = Enclosure(0.0, 0.0)
    reason = "interference fit: the clearance is negative, the parts overlap at every tilt"
    arcs = whole_turn(nothing, Enclosure(-math.pi, math.pi), reason, True)
    return JamCertificate(
        Verdict.CANNOT_ASSEMBLE,
        reason,
        condition,
        box,
        _pair(depths, 1),
        _pair(depths, 0),
        _angles(tilt.sine),
        nothing,
        arcs,
        "never",
        None,
        box.exact_input,
        2,
        perf_counter() - begin,
    )


def _partly_interference(box: ToleranceBox, condition: Condition, begin: float) -> JamCertificate:
    """Answer for a range of clearances from negative to positive: jams of the sound part count, freedom does not."""
    from dataclasses import replace

    from graphsynth.jamming.bearing import corners

    c = box["clearance"]
    sound = box.replace(clearance=Range(Fraction(0), c.upper, c.exact))
    found = _Proof(sound, condition, begin).result()
    verdict, reason = found.verdict, found.reason
    text = "part of the range of the clearance is an interference fit, which cannot be assembled"
    if found.verdict is Verdict.CERTIFIED_JAMMED:
        verdict, reason = Verdict.CERTIFIED_JAMMED_FOR_SOME, text
    elif found.verdict is not Verdict.CERTIFIED_JAMMED_FOR_SOME:
        verdict, reason = Verdict.UNDECIDED, text
    # of all clearances, the negative ones included
    depths = corners.interference_corners(box, corners.sines(box).sine, condition)
    return replace(
        found,
        verdict=verdict,
        reason=reason,
        box=box,
        largest_interference=_pair(depths, 1),
        smallest_worst_interference=_pair(depths, 0),
        seconds=perf_counter() - begin,
    )
