"""Bearings that share a misalignment: samples and proof, against a closed form or against proved bounds."""

from __future__ import annotations

import math
from functools import partial
from inspect import signature
from typing import TYPE_CHECKING, Any

import numpy as np

from graphsynth.core.errors import GeometryError
from graphsynth.evidence.jamming import precise_critical_tilt
from graphsynth.evidence.rows import Effort, Problem, Row, RowStatus, best_of

if TYPE_CHECKING:
    from graphsynth.jamming.bearing.bearing import Bearing, Condition
    from graphsynth.jamming.joints.assess import CoupledReport
    from graphsynth.jamming.joints.limits import Misalignment
    from graphsynth.jamming.joints.scale import ScaleCertificate
    from graphsynth.kinematics.simulation import Motion
    from graphsynth.mechanism.four_bar import TiltedFourBar
    from graphsynth.mechanism.model import Mechanism

__all__ = ["coupled_problem", "exact_largest", "lambda_problem"]

#: Gap of the proved bounds that are the reference where no closed form is known.
_FINE_GAP = 1e-6
_DIGITS = 50


def exact_largest(linkage: TiltedFourBar, bearing: Bearing, condition: Condition = "A") -> Any:
    """Largest misalignment about the frame line of the source's linkage with three equal bearings, with 50 digits.

    Twice the critical tilt of one bearing (theory/joints-that-share-a-tilt 6: the worst pose is 90 degrees).  None for
    other proportions than (2, 1, 5/2, 5/2), for which no closed form is known.

    Examples
    --------
    >>> from graphsynth.jamming import Bearing
    >>> from graphsynth.mechanism.four_bar import TiltedFourBar
    >>> print(f"{float(exact_largest(TiltedFourBar(), Bearing())):.16f}")
    0.0121287931183128
    """
    import mpmath

    crank = linkage.l2
    if (linkage.l1, linkage.l3, linkage.l4) != (2.0 * crank, 2.5 * crank, 2.5 * crank):
        return None
    critical = precise_critical_tilt(bearing, condition)
    with mpmath.workdps(_DIGITS):
        return None if critical is None else 2 * critical


def lambda_problem(
    linkage: TiltedFourBar, bearing: Bearing, direction: float = 0.0, condition: Condition = "A",
    effort: Effort | None = None,
) -> Problem:  # fmt: skip
    """Find the largest misalignment of the driven axis of a four-bar linkage with equal bearings in its moving joints.

    Parameters
    ----------
    linkage : TiltedFourBar
        Planar, and its crank turns fully.
    bearing : Bearing
    direction : float
        Of the axis about which the motor axis is tilted, radians from the frame line.
    condition : {"A", "B"}
    effort : Effort, optional
    """
    from graphsynth.evidence.position import four_bar
    from graphsynth.jamming.joints.limits import Misalignment

    mechanism, _ = four_bar(linkage)
    exact = exact_largest(linkage, bearing, condition) if direction == 0.0 else None
    size = ", ".join(f"{value:g}" for value in (linkage.l1, linkage.l2, linkage.l3, linkage.l4))
    tilt = Misalignment(0, 1, 0.01, direction)
    return coupled_problem(
        mechanism, bearing, tilt, f"the linkage ({size})", condition=condition, exact=exact, effort=effort
    )


def coupled_problem(
    mechanism: Mechanism, bearings: Any, tilt: Misalignment, name: str, *, condition: Condition = "A",
    exact: Any = None, inputs: tuple[float, float] = (0.0, math.tau), effort: Effort | None = None,
) -> Problem:  # fmt: skip
    """Find the largest misalignment of a mechanism whose bearings share it, by samples and by proof.

    Parameters
    ----------
    mechanism : Mechanism
    bearings
        As for `graphsynth.jamming.joints.assess_coupled`.
    tilt : Misalignment
    name : str
        Of the mechanism, for the picture.
    condition : {"A", "B"}
    exact : mpmath number, optional
        The largest misalignment, radians, if it is known; else the reference are proved bounds, 1e-6 apart.
    inputs : (float, float), optional
        Range of the input, radians.
    effort : Effort, optional

    Raises
    ------
    GeometryError
        If the mechanism does not move through the range, or no bounds can be proved.
    """
    from graphsynth.jamming.joints.assess import assess_coupled
    from graphsynth.jamming.joints.scale import largest_scale
    from graphsynth.kinematics.simulation import simulate

    effort = effort or Effort()
    rounds = Effort(1 if effort.quick else min(2, effort.rounds), effort.patience, effort.quick)

    def turn(count: int) -> Motion:
        return simulate(mechanism, np.linspace(*inputs, count), events=False)

    def judged(count: int) -> CoupledReport:
        return assess_coupled(turn(count), bearings, tilt, condition=condition)

    motion = turn(37)
    if not motion.completed:
        raise GeometryError(f"the motion ends: {motion.reason}")
    prove = partial(largest_scale, motion, bearings, tilt, condition=condition)
    low, high, reference = _reference(prove, tilt, exact)
    middle = (low + high) / 2
    rows = []
    for count in (8, 14, 26) if effort.quick else (8, 26, 74, 362):
        report, seconds, done = best_of(partial(judged, count), rounds)
        error = float(abs(report.smallest_scale / middle - 1))
        kind = "distance from the reference"
        rows.append(Row("samples", f"{count} positions", error, seconds, done, kind, reference))
    default = signature(largest_scale).parameters["relative_gap"].default
    gaps = sorted({1e-1, 1e-2, default} if effort.quick else {1e-1, 1e-2, 1e-3, default}, reverse=True)
    for gap in gaps:
        found, seconds, done = best_of(partial(prove, relative_gap=gap), rounds, warm=gap == gaps[0])
        rows.append(_gap_row(found, gap, (low, high, reference), (seconds, done), default=gap == default))
    question = f"Largest misalignment of {name} whose bearings share it"
    note = "Samples err on the wrong side: they never find the worst input itself."
    return Problem("coupled-joints", question, "relative", tuple(rows), note=note)


def _gap_row(
    found: ScaleCertificate, gap: float, truth: tuple[Any, Any, str], timed: tuple[float, int], *, default: bool
) -> Row:
    """Row of a certificate: its gap, and whether it holds the reference and is as narrow as was asked."""
    low, high, reference = truth
    why = "" if found.low <= high and low <= found.high else "the reference lies outside of what is proved"
    why = why or (found.reason if found.relative_gap > gap else "")
    return Row(
        "certified gap", f"gap {gap:g}, {found.evaluated} pieces", found.relative_gap, *timed,
        "gap between the proved bounds", f"none needed; checked to hold the {reference}",
        RowStatus.FAILED if why else RowStatus.OK, why, default, True,
    )  # fmt: skip


def _reference(prove: Any, tilt: Misalignment, exact: Any) -> tuple[Any, Any, str]:
    """Bounds of the largest factor on the misalignment, and where they are from."""
    import mpmath

    if exact is not None:
        with mpmath.workdps(_DIGITS):
            scale = exact / mpmath.mpf(tilt.alpha)
        return scale, scale, "closed form with 50 digits: twice the critical tilt of one bearing"
    found = prove(relative_gap=_FINE_GAP, max_pieces=200_000)
    if not 0.0 < found.low <= found.high < math.inf:
        raise GeometryError(f"no bounds of the misalignment can be proved: {found.reason}")
    return found.low, found.high, f"proved bounds of the certificate itself, {found.relative_gap:.0e} apart"
