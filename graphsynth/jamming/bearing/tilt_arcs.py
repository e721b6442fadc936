"""Jam arcs over a turn in closed form, for one bearing that takes the whole tilt (model L0)."""

from __future__ import annotations

import math
from dataclasses import dataclass

from graphsynth.core.checks import checked
from graphsynth.jamming.bearing.bearing import Bearing, Condition
from graphsynth.jamming.verdict import METHOD_CLOSED_FORM
from graphsynth.mechanism.four_bar import TiltedFourBar

__all__ = ["Arc", "JamArcs", "jam_arcs"]

_ROUNDING = 16 * 2.0**-52


@checked
@dataclass(frozen=True)
class Arc:
    """An open arc of crank angles (radians): from ``start`` in [0, 2 pi) counter-clockwise over ``length``."""

    start: float
    length: float

    @property
    def stop(self) -> float:
        """End of the arc, at least ``start``; may exceed 2 pi when the arc wraps around."""
        return self.start + self.length

    @checked
    def contains(self, f: float) -> bool:
        """Return True if the crank angle ``f`` (radians, any turn) lies inside the arc."""
        return 0.0 < math.fmod(math.fmod(f - self.start, math.tau) + math.tau, math.tau) < self.length


@dataclass(frozen=True)
class JamArcs:
    """Where the bearing jams during a turn.

    Attributes
    ----------
    arcs : tuple of Arc
        The two arcs, half a turn apart, one per lid; empty if there is none.
    touching : tuple of float
        Crank angles (radians) of contact without overlap: the two of ``kappa = 1``, or of zero clearance.
    kappa : float
        Sine of the critical tilt over the largest sine of tilt; infinite if there is no critical tilt or no tilt.
    phase : float
        psi1 with tilt proportional to ``sin(f - psi1)``, radians.
    condition, method, reason : str
        Contact condition used, how the arcs were had, and why there are none or what is special.
    """

    arcs: tuple[Arc, ...]
    touching: tuple[float, ...]
    kappa: float
    phase: float
    condition: str
    method: str = METHOD_CLOSED_FORM
    reason: str = ""


@checked
def jam_arcs(linkage: TiltedFourBar, bearing: Bearing, condition: Condition = "A") -> JamArcs:
    """Jam arcs of the bearing at B over one turn of the crank (section 7.1).

    Exact closed form evaluated in double precision.  ``|kappa - 1|`` below sixteen units in the last place is reported
    as touching, because the sign of the difference is then a matter of rounding.

    Parameters
    ----------
    linkage : TiltedFourBar
    bearing : Bearing
        Dimensions in millimetres.
    condition : {"A", "B"}
        Contact condition: short bearing in a long hole, or long shaft in a short hole.

    Returns
    -------
    JamArcs
        Crank angles in radians.

    Examples
    --------
    >>> arcs = jam_arcs(TiltedFourBar(alpha=1 / 30), Bearing())
    >>> [round(math.degrees(arc.start), 6) for arc in arcs.arcs]
    [27.05922, 207.05922]
    """
    critical = bearing.critical_tilt(condition)
    phase = linkage.pin_phase
    if critical.sine is None:
        if bearing.clearance < 0.0:
            return JamArcs((Arc(0.0, math.tau),), (), 0.0, phase, condition, reason=critical.reason)
        return JamArcs((), (), math.inf, phase, condition, reason=critical.reason)
    if not linkage.tilted:
        if bearing.clearance == 0.0:
            text = "no tilt and no clearance: touching at every angle"
            return JamArcs((), (0.0,), math.nan, phase, condition, reason=text)
        return JamArcs((), (), math.inf, phase, condition, reason="the crank pin stays in the plane: no tilt")
    kappa = _kappa(linkage, critical.sine)
    quarter = 0.5 * math.pi
    if abs(kappa - 1.0) <= _ROUNDING:
        touch = ((phase + quarter) % math.tau, (phase - quarter) % math.tau)
        return JamArcs((), touch, kappa, phase, condition, reason="the largest tilt equals the critical tilt")
    if kappa > 1.0:
        return JamArcs((), (), kappa, phase, condition, reason="the largest tilt is below the critical tilt")
    if critical.reason:  # h^2 = c (2R + c): contact, never overlap
        return JamArcs((), _ends(phase, kappa), kappa, phase, condition, reason=critical.reason)
    arcs = tuple(Arc((phase + math.asin(kappa) + turn) % math.tau, 2.0 * math.acos(kappa)) for turn in (0.0, math.pi))
    touching = (phase % math.tau, (phase + math.pi) % math.tau) if kappa == 0.0 else ()
    reason = "no clearance: jams at every angle with a tilt" if kappa == 0.0 else ""
    return JamArcs(tuple(sorted(arcs, key=lambda arc: arc.start)), touching, kappa, phase, condition, reason=reason)


def _ends(phase: float, kappa: float) -> tuple[float, ...]:
    edge = math.asin(kappa)
    return tuple(sorted((phase + angle) % math.tau for angle in (edge, math.pi - edge, math.pi + edge, -edge)))


def _kappa(linkage: TiltedFourBar, sine: float) -> float:
    """Value of ``|sin(f - psi1)|`` at which the tilt becomes critical."""
    if sine == 0.0 or linkage.pin_height == 0.0:  # tilts that underflow
        return math.inf if sine > 0.0 else 0.0
    if linkage.rod == "rigid":
        return linkage.l3 * sine / linkage.pin_height
    return linkage.l3 * sine / math.sqrt((1.0 - sine) * (1.0 + sine)) / linkage.pin_height  # tan theta = A_z / l3
