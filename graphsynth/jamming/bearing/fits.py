"""Standard fits: which ISO 286 fit leaves every bearing free, proved for all parts inside their tolerances.

The table holds the tolerance grades IT5 to IT11 and the fundamental deviations of the shafts a to h for nominal
diameters up to 500 mm (ISO 286-1:2010, tables 1 and 4), for the hole-basis system (holes H).
"""

from __future__ import annotations

import re
from bisect import bisect_left
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

from graphsynth.core.checks import checked
from graphsynth.core.errors import GeometryError
from graphsynth.jamming.bearing.bearing import Condition
from graphsynth.jamming.bearing.certify import certify_jamming
from graphsynth.jamming.bearing.parameters import Given, Range, ToleranceBox
from graphsynth.jamming.verdict import Verdict


def _numbers(row: str) -> tuple[int, ...]:
    return tuple(map(int, row.split()))


_SIZES = _numbers("3 6 10 18 30 50 80 120 180 250 315 400 500")  # upper ends, mm
_GRADES = {  # micrometres
    5: _numbers("4 5 6 8 9 11 13 15 18 20 23 25 27"),
    6: _numbers("6 8 9 11 13 16 19 22 25 29 32 36 40"),
    7: _numbers("10 12 15 18 21 25 30 35 40 46 52 57 63"),
    8: _numbers("14 18 22 27 33 39 46 54 63 72 81 89 97"),
    9: _numbers("25 30 36 43 52 62 74 87 100 115 130 140 155"),
    10: _numbers("40 48 58 70 84 100 120 140 160 185 210 230 250"),
    11: _numbers("60 75 90 110 130 160 190 220 250 290 320 360 400"),
}
_BELOW = {  # distance of the upper limit of the shaft below the nominal size, micrometres
    "d": _numbers("20 30 40 50 65 80 100 120 145 170 190 210 230"),
    "e": _numbers("14 20 25 32 40 50 60 72 85 100 110 125 135"),
    "f": _numbers("6 10 13 16 20 25 30 36 43 50 56 62 68"),
    "g": _numbers("2 4 5 6 7 9 10 12 14 15 17 18 20"),
    "h": (0,) * 13,
}
_FINE_SIZES = _numbers("3 6 10 18 30 40 50 65 80 100 120 140 160 180 200 225 250 280 315 355 400 450 500")
_FINE_BELOW = {
    "a": _numbers("270 270 280 290 300 310 320 340 360 380 410 460 520 580 660 740 820 920 1050 1200 1350 1500 1650"),
    "b": _numbers("140 140 150 150 160 170 180 190 200 220 240 260 280 310 340 380 420 480 540 600 680 760 840"),
    "c": _numbers("60 70 80 95 110 120 130 140 150 170 180 200 210 230 240 260 280 300 330 360 400 440 480"),
}

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
    >>> str(Fit.read("H7/g6", 35).clearance)
    '[0.0045, 0.025]'
    """

    name: str
    nominal: Fraction
    hole: Range
    shaft: Range

    @classmethod
    def read(cls, name: str, diameter: Given) -> Fit:
        """Look up a fit ``H<grade>/<letter><grade>``; `GeometryError` if it is not in the table, up to 500 mm."""
        if not isinstance(name, str):
            raise GeometryError(f"fit {name!r} is no text; give a name such as H7/g6")
        parts = re.fullmatch(r"H(\d+)/([a-h])(\d+)", name.strip())
        if not parts or int(parts[1]) not in _GRADES or int(parts[3]) not in _GRADES:
            raise GeometryError(
                f"fit {name!r} is not in the table; use H5..H11 with a..h and a grade 5..11, as in H7/g6"
            )
        size = Range.read("diameter", diameter)
        if not size.is_point or not 0 < size.lower <= 500:
            raise GeometryError(f"nominal diameter {size} mm is outside the table; give one number up to 500 mm")
        at = bisect_left(_SIZES, size.lower)
        letter = parts[2]
        if letter in "ab" and size.lower <= 1:
            raise GeometryError(f"shaft {letter} is not standardised up to 1 mm; diameter {size} mm needs c to h")
        fine = bisect_left(_FINE_SIZES, size.lower)
        below = _FINE_BELOW[letter][fine] if letter in _FINE_BELOW else _BELOW[letter][at]
        micro = Fraction(1, 1000)
        wide, narrow = _GRADES[int(parts[1])][at], _GRADES[int(parts[3])][at]
        hole = Range(Fraction(0), wide * micro, size.exact)
        return cls(name.strip(), size.lower, hole, Range(-(below + narrow) * micro, -below * micro, size.exact))

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
    ``CERTIFIED_JAMMED_FOR_SOME``, the tightest pair binds, others may not; else ``UNDECIDED``.  ``clearance_left`` is a
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
        if verdict not in (Verdict.CERTIFIED_FREE, Verdict.CERTIFIED_JAMMED):
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
