"""Friction of a tilted bearing: wedging, torque amplification, Whitney's diagram (theory/friction-of-a-tilted-bearing).

The words are those of insertion theory (Simunovic, Whitney [Whitney 1982]): a peg *wedges* when two contacts hold each
other by friction alone, whatever the load; it *jams* when the load lies outside the region in which it slides in.  What
the rest of the package decides is geometric *binding*: rigid parts that would have to overlap.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum
from fractions import Fraction
from typing import TYPE_CHECKING

import numpy as np

from graphsynth.core.checks import checked
from graphsynth.core.errors import GeometryError
from graphsynth.jamming.bearing.arcs import Enclosure
from graphsynth.jamming.bearing.bearing import Condition
from graphsynth.jamming.bearing.parameters import Given, Range, ToleranceBox

if TYPE_CHECKING:
    from graphsynth.intervals import Interval


class Wedging(Enum):
    """Whether friction alone can hold two touching parts whatever the load."""

    POSSIBLE = "wedging possible for every friction coefficient and every bearing of the box (certified)"
    POSSIBLE_FOR_SOME = "wedging possible for some of the friction coefficients and bearings (certified)"
    NOT_POSSIBLE = "wedging not possible (certified)"
    UNDECIDED = "undecided: the friction coefficient equals the limit at this resolution"


@dataclass(frozen=True)
class WedgingReport:
    """Wedging of one bearing; ``reason`` says what is special.

    ``limit`` is the range over the box of the least friction coefficient that wedges (``mu_A`` or ``mu_B``), infinite
    if the parts cannot touch in this condition; ``amplification`` that of ``mu / limit``, the friction torque about the
    axis per tilting moment (theory/friction-of-a-tilted-bearing 2); ``lever`` that of half the distance w of the
    contacts along the axis, mm: the normal forces are ``M_t / (2 w)``.
    """

    verdict: Wedging
    limit: Enclosure
    amplification: Enclosure
    lever: Enclosure
    condition: str
    reason: str = ""


@checked
def wedging(box: ToleranceBox, friction: Given, condition: Condition = "A") -> WedgingReport:
    """Decide whether two-point contact can wedge for an interval of friction coefficients.

    The line through both contacts lies inside both friction cones if ``mu >= wA / Rh`` (condition A) or ``wB / R``
    (condition B).  Both limits are monotone in h, c and R, so that two exact corners enclose them
    (theory/friction-of-a-tilted-bearing 1, 2).

    Parameters
    ----------
    box, condition : ToleranceBox, {"A", "B"}
        Only the bearing counts; contact condition.
    friction : Given
        Friction coefficient, for example ``"[0.1, 0.2]"``; zero or more.

    Returns
    -------
    WedgingReport
        Both limits and the decision (certified).

    Raises
    ------
    GeometryError
        For a negative friction coefficient, an interference fit, or condition "general".

    Examples
    --------
    >>> wedging(ToleranceBox(), "[0.3, 0.6]").verdict.name, wedging(ToleranceBox(), "[0.05, 0.1]").verdict.name
    ('POSSIBLE', 'NOT_POSSIBLE')
    """
    from graphsynth.intervals import Interval

    mu = Range.read("friction", friction)
    if mu.lower < 0:
        raise GeometryError(f"friction = {mu} is negative; give a coefficient of zero or more")
    if box["clearance"].lower < 0:
        raise GeometryError(
            f"clearance = {box['clearance']} mm includes an interference fit; wedging needs clearance >= 0"
        )
    if condition not in ("A", "B"):
        raise GeometryError(f'condition = {condition!r} has no wedging limit here; use "A" or "B"')
    lever, limit, touches = _limits(box, condition)
    if touches == "none":
        none = Enclosure(np.inf, np.inf)
        text = "h^2 < c (2R + c): the parts never touch under tilt"
        return WedgingReport(Wedging.NOT_POSSIBLE, none, Enclosure(0.0, 0.0), Enclosure(0.0, 0.0), condition, text)
    least, reason = Enclosure.of(limit[0]), ""
    whole = Interval.from_bounds(limit.lo[0], limit.hi[1])
    if touches == "some":
        verdict = Wedging.UNDECIDED if mu.upper > 0 else Wedging.NOT_POSSIBLE
        reason = "h^2 >= c (2R + c) for some bearings only: others never touch under tilt"
    elif mu.lower >= Fraction(float(whole.hi)):
        verdict = Wedging.POSSIBLE
    elif mu.upper < Fraction(least.lo):
        verdict = Wedging.NOT_POSSIBLE
    else:
        verdict = Wedging.POSSIBLE_FOR_SOME if mu.upper >= Fraction(least.hi) else Wedging.UNDECIDED
    amplification = Enclosure.of(mu.outer / whole) if least.lo > 0.0 else Enclosure(0.0, np.inf)
    arm = Enclosure(float(lever.lo[0]), float(lever.hi[1]))
    return WedgingReport(verdict, Enclosure.of(whole), amplification, arm, condition, reason)


def _limits(box: ToleranceBox, condition: str) -> tuple[Interval, Interval, str]:
    """Return pairs of lever w and of the limit, and whether all, some or none of the bearings touch."""
    from graphsynth.intervals import Interval
    from graphsynth.jamming.bearing.corners import ends

    grows = condition == "B"
    c, R, h = ends(box, "clearance", falling=not grows), ends(box, "Rb", falling=True), ends(box, "Hb") / 2
    slack = c * (2 * R + c)
    if condition == "B":
        limit = (h.sqr() + slack).sqrt() / R
        top = ends(box, "Rb")  # the lever alone grows with R
        return (h.sqr() + c * (2 * top + c)).sqrt(), limit, "all"
    touches = "all"
    b = box
    if _room(b["Hb"].lower, b["clearance"].upper, b["Rb"].upper) < 0:
        touches = "some" if _room(b["Hb"].upper, b["clearance"].lower, b["Rb"].lower) >= 0 else "none"
    lever = (h.sqr() - slack).sqrt()
    if lever.is_empty.any():
        lever = Interval(0).hull(lever)
    return lever, lever / (R + c), touches


def _room(height: Fraction, clearance: Fraction, radius: Fraction) -> Fraction:
    """Exact ``h^2 - c (2R + c)``."""
    return (height / 2) ** 2 - clearance * (2 * radius + clearance)


class Region(Enum):
    """Where a load lies with respect to a region."""

    INSIDE = "free to slide (certified)"
    OUTSIDE = "jams (certified)"
    UNDECIDED = "undecided: the load touches the border at this resolution"


@checked
@dataclass(frozen=True)
class InsertionDiagram:
    """Whitney's jamming diagram of a peg in a hole: a parallelogram in the plane of ``Fx / Fz`` and ``M / (r Fz)``.

    ``friction`` is mu, ``depth_ratio`` lambda, ``l / (2 r mu)``.
    """

    friction: Range
    depth_ratio: Range

    @property
    def vertices(self) -> tuple[tuple[float, float], ...]:
        """The four corners (Fx/Fz, M/(r Fz)) for the middle of the ranges, counter-clockwise, rounded."""
        mu, lam = self.friction.middle, self.depth_ratio.middle
        return ((1.0 / mu, -1.0 - 2.0 * lam), (1.0 / mu, -1.0), (-1.0 / mu, 1.0 + 2.0 * lam), (-1.0 / mu, 1.0))

    def where(self, lateral: Given, axial: Given, moment: Given, radius: Given) -> Region:
        """Say where a load lies, for all loads and all frictions in their ranges.

        ``|Fx/Fz| < 1/mu`` and ``|M/(r Fz) + mu (1 + lambda) Fx/Fz| < lambda`` means free to slide.

        Parameters
        ----------
        lateral, axial, moment, radius : Given
            Fx, Fz (positive for insertion), the moment at the centre of the tip, and the radius of the peg.
            `GeometryError` unless axial force and radius are positive.
        """
        load = {"axial": axial, "radius": radius, "lateral": lateral, "moment": moment}
        ranges = {name: Range.read(name, value) for name, value in load.items()}
        for name in ("axial", "radius"):
            if ranges[name].lower <= 0:
                raise GeometryError(f"{name} = {ranges[name]} must be positive; the diagram is for a peg pushed in")
        Fz, r, Fx, M = (value.outer for value in ranges.values())
        mu, lam = self.friction.outer, self.depth_ratio.outer
        x, y = Fx / Fz, M / (r * Fz)
        first = 1 / mu - abs(x)
        second = lam - abs(y + mu * (1 + lam) * x)
        if float(first.lo) > 0.0 and float(second.lo) > 0.0:
            return Region.INSIDE
        return Region.OUTSIDE if float(first.hi) < 0.0 or float(second.hi) < 0.0 else Region.UNDECIDED


def insertion_diagram(friction: Given, depth: Given, radius: Given) -> InsertionDiagram:
    """Return Whitney's diagram of a peg of given radius at a given depth of insertion.

    See theory/friction-of-a-tilted-bearing 3 and [Whitney 1982].

    Parameters
    ----------
    friction, depth, radius : Given
        Friction coefficient; insertion depth and radius of the peg, in one unit.  Numbers or ranges, positive.

    Returns
    -------
    InsertionDiagram
        Its parallelogram; the ratios are ranges with exact ends.

    Raises
    ------
    GeometryError
        For a value that is not positive.

    Examples
    --------
    >>> diagram = insertion_diagram("0.2", 10, 5)
    >>> [tuple(round(v, 12) for v in vertex) for vertex in diagram.vertices][:2]
    [(5.0, -11.0), (5.0, -1.0)]
    >>> diagram.where(1, 1, 0, 5).name, diagram.where(6, 1, 0, 5).name
    ('INSIDE', 'OUTSIDE')
    """
    mu, l, r = Range.read("friction", friction), Range.read("depth", depth), Range.read("radius", radius)
    for name, value in (("friction", mu), ("depth", l), ("radius", r)):
        if value.lower <= 0:
            raise GeometryError(f"{name} = {value} must be positive; correct the value")
    exact = mu.exact and l.exact and r.exact
    return InsertionDiagram(mu, Range(l.lower / (2 * r.upper * mu.upper), l.upper / (2 * r.lower * mu.lower), exact))
