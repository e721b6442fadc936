"""Standard fits: which ISO 286 fit leaves every bearing free, proved for all parts inside their tolerances.

The limits of holes and shafts are those of `graphsynth.tolerances`: all letters and grades, sizes up to 500 mm.
"""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction
from typing import Any, Literal

from graphsynth.core.checks import checked
from graphsynth.core.errors import GeometryError
from graphsynth.jamming.bearing.bearing import Condition
from graphsynth.jamming.bearing.certify import certify_jamming
from graphsynth.jamming.bearing.parameters import Given, Range, ToleranceBox
from graphsynth.jamming.verdict import Verdict
from graphsynth.tolerances.iso286 import read_fit

_COMMON = "H6/h5 H7/h6 H7/g6 H8/h7 H7/f7 H8/f7 H8/e8 H9/e9 H9/d9 H10/d10 H11/d11 H11/c11 H11/b11 H11/a11"
#: Common clearance fits of the hole-basis system, from tight to loose.
STANDARD_FITS = tuple(_COMMON.split())


@checked
@dataclass(frozen=True)
class Fit:
    """Limits of one fit such as ``"H7/g6"`` at one nominal diameter, exact, in millimetres.

    ``hole`` and ``shaft`` are the deviations of the diameters from the nominal one.

    Examples
    --------
    >>> fit = Fit.read("25 H7/g6")
    >>> fit.kind, float(fit.smallest_clearance), float(fit.largest_clearance)
    ('clearance', 0.007, 0.041)
    >>> str(Fit.read("H7/g6", 35).clearance)
    '[0.0045, 0.025]'
    """

    name: str
    nominal: Fraction
    hole: Range
    shaft: Range

    @classmethod
    def read(cls, name: str, diameter: Given | None = None) -> Fit:
        """Look up a fit of ISO 286, ``"H7/g6"`` with a diameter (mm) or ``"25 H7/g6"``.

        `GeometryError` if it is not in the tables: letters a to zc, holes A to ZC, grades 01 to 18, up to 500 mm.
        """
        exact = True
        if diameter is not None:
            size = Range.read("diameter", diameter)
            if not size.is_point or not 0 < size.lower <= 500:
                raise GeometryError(f"nominal diameter {size} mm is outside the table; give one number up to 500 mm")
            diameter, exact = size.lower, size.exact
        found, nominal, *limits = read_fit(name, diameter)
        hole, shaft = (Range(own.lower, own.upper, exact) for own in limits)
        return cls(found, nominal, hole, shaft)

    @property
    def smallest_clearance(self) -> Fraction:
        """Smallest hole less largest shaft (diameters), mm; negative for an interference."""
        return self.hole.lower - self.shaft.upper

    @property
    def largest_clearance(self) -> Fraction:
        """Largest hole less smallest shaft (diameters), mm; negative if every pair interferes."""
        return self.hole.upper - self.shaft.lower

    @property
    def kind(self) -> Literal["clearance", "transition", "interference"]:
        """Clearance: no pair interferes.  Interference: every pair does, or just touches.  Transition: some do."""
        if self.smallest_clearance >= 0:
            return "clearance"
        return "transition" if self.largest_clearance > 0 else "interference"

    @property
    def clearance(self) -> Range:
        """Radial clearance of all pairs of parts, mm."""
        return Range(
            (self.hole.lower - self.shaft.upper) / 2, (self.hole.upper - self.shaft.lower) / 2, self.hole.exact
        )

    @property
    def radius(self) -> Range:
        """Radius of all shafts, mm."""
        r = self.nominal / 2
        return Range(r + self.shaft.lower / 2, r + self.shaft.upper / 2, self.hole.exact)

    @checked
    def pair(self, loosest: bool) -> tuple[Fraction, Fraction]:
        """Return radius and clearance of the pair with the largest or the smallest clearance."""
        if loosest:
            return self.radius.lower, self.clearance.upper
        return self.radius.upper, self.clearance.lower


@dataclass(frozen=True)
class FitVerdict:
    """One fit and what is proved about it.

    ``verdict``: ``CERTIFIED_FREE``, every pair of parts is free; ``CERTIFIED_JAMMED``, every pair binds;
    ``CERTIFIED_JAMMED_FOR_SOME``, the tightest pair binds, others may not; ``CANNOT_ASSEMBLE``, an interference fit;
    else ``UNDECIDED``.  ``clearance_left`` is a
    lower bound for the worst pair (mm), negative if something is missing.
    """

    fit: Fit
    verdict: Verdict
    clearance_left: float

    @property
    def words(self) -> str:
        """The verdict in words about pairs of parts."""
        return {
            Verdict.CERTIFIED_FREE: "every pair is free",
            Verdict.CERTIFIED_JAMMED: "every pair binds",
            Verdict.CERTIFIED_JAMMED_FOR_SOME: "the tightest pair binds",
            Verdict.CANNOT_ASSEMBLE: "an interference fit: no pair turns",
        }.get(self.verdict, "undecided")

    def row(self) -> dict[str, Any]:
        """Plain values for a table."""
        c = self.fit.clearance
        return {
            "fit": self.fit.name,
            "smallest clearance [mm]": float(c.lower),
            "largest clearance [mm]": float(c.upper),
            "verdict": self.verdict.name,
            "clearance left [mm]": self.clearance_left,
        }


@checked
def assess_fits(
    box: ToleranceBox, condition: Condition = "A", fits: tuple[str, ...] = STANDARD_FITS, diameter: Given | None = None
) -> list[FitVerdict]:
    """Prove for each fit whether the turn is free, for all parts inside their tolerances and the rest of the box.

    Parameters
    ----------
    box, condition : ToleranceBox, {"A", "B", "general"}
        Its ranges of ``Rb`` and ``clearance`` are replaced by those of each fit; contact condition.
    fits : tuple of str
        Names, see `STANDARD_FITS`.
    diameter : Given, optional
        Nominal diameter, mm; by default twice the middle of ``Rb``.

    Returns
    -------
    list of FitVerdict
        In the order of ``fits``; certified.

    Examples
    --------
    >>> [v.fit.name for v in assess_fits(ToleranceBox(alpha="1/300")) if v.verdict.is_free][:2]
    ['H7/f7', 'H8/f7']
    """
    if diameter is None:
        diameter = box["Rb"].lower + box["Rb"].upper
    found = []
    for fit in (Fit.read(name, diameter) for name in fits):
        # radius and clearance taken as independent: more pairs than there are, so freedom holds a fortiori
        every = certify_jamming(box.replace(Rb=fit.radius, clearance=fit.clearance), condition)
        verdict = every.verdict
        if fit.kind == "interference":
            verdict = Verdict.CANNOT_ASSEMBLE
        elif fit.kind == "transition":
            verdict = Verdict.CERTIFIED_JAMMED_FOR_SOME  # the tightest pair interferes before it tilts
        elif verdict not in (Verdict.CERTIFIED_FREE, Verdict.CERTIFIED_JAMMED):
            radius, clearance = fit.pair(loosest=False)  # parts that exist: the largest shaft in the smallest hole
            tightest = certify_jamming(box.replace(Rb=radius, clearance=clearance), condition).verdict
            verdict = Verdict.CERTIFIED_JAMMED_FOR_SOME if tightest.is_jammed else Verdict.UNDECIDED
        found.append(FitVerdict(fit, verdict, -every.largest_interference.hi))
    return found


@checked
def tightest_free_fit(
    box: ToleranceBox, condition: Condition = "A", fits: tuple[str, ...] = STANDARD_FITS, diameter: Given | None = None
) -> FitVerdict | None:
    """Return the fit with the least largest clearance among those certified free; None if none is.

    Parameters
    ----------
    box, condition, fits, diameter
        As for `assess_fits`.

    Returns
    -------
    FitVerdict or None
        Certified.

    Examples
    --------
    >>> tightest_free_fit(ToleranceBox(alpha="1/30")).fit.name
    'H11/b11'
    """
    free = [found for found in assess_fits(box, condition, fits, diameter) if found.verdict is Verdict.CERTIFIED_FREE]
    return min(free, key=lambda found: found.fit.clearance.upper, default=None)
