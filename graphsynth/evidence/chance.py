"""Probability that a tilted bearing binds: proved bounds and random members, against a quadrature with 30 digits."""

from __future__ import annotations

from functools import partial

import mpmath

from graphsynth.evidence.rows import Effort, Problem, Row, best_of
from graphsynth.jamming.bearing.parameters import ToleranceBox
from graphsynth.jamming.chance.probability import ChanceProblem, probability_of_jamming, sample_probability

#: Middle and half width of the tilt (rad) and of the clearance (mm) of the example, both uniform.
_TILT, _CLEARANCE = ("0.0145", "0.0005"), ("0.03", "0.003")


def binding_probability() -> float:
    """Probability for lambda proportions (crank 1, coupler 2.5), a bearing of 17.5 mm and 10 mm, from plain formulas.

    The clearance is uniform, so that the probability for one tilt is a piece of a line; over the tilts it is a
    quadrature.

    Examples
    --------
    >>> round(binding_probability(), 6)
    0.284089
    """
    with mpmath.workdps(30):
        (tilt, about), (middle, half) = ([mpmath.mpf(value) for value in pair] for pair in (_TILT, _CLEARANCE))

        def share(alpha: mpmath.mpf) -> mpmath.mpf:
            S = mpmath.sin(alpha) / mpmath.mpf("2.5")
            need = 5 * S - mpmath.mpf("17.5") * S * S / (1 + mpmath.sqrt(1 - S * S))
            return min(max((need - middle + half) / (2 * half), mpmath.mpf(0)), mpmath.mpf(1))

        ends = mpmath.linspace(tilt - about, tilt + about, 33)
        return float(mpmath.quad(share, ends) / (2 * about))


def chance_problem(effort: Effort) -> Problem:
    """Measure both ways to a probability; the bounds must hold the reference."""
    box = ToleranceBox(alpha=" +- ".join(_TILT), clearance=" +- ".join(_CLEARANCE))
    exact = binding_probability()
    rows = []
    for width in (1e-2, 1e-4) if effort.quick else (1e-2, 1e-4, 1e-6):
        found, *timed = best_of(partial(probability_of_jamming, box, width=width, ratio=1e6), effort)
        holds = found.lower <= exact + 1e-15 and exact - 1e-15 <= found.upper
        why = "" if holds else "the reference lies outside of what is proved"
        more = {"kind": "width of the proved bounds", "reference": "none needed; checked to hold the quadrature"}
        rows.append(
            Row.of(
                "proved bounds",
                f"width {width:g}",
                found.upper - found.lower,
                timed,
                why,
                proved=True,
                value=width,
                **more,
            )
        )
    for count in (1000, 10_000) if effort.quick else (1000, 10_000, 100_000):
        drawn, *timed = best_of(partial(sample_probability, ChanceProblem(box, {}), count), effort)
        rows.append(
            Row.of("random members", f"{count} members", abs(drawn.share - exact), timed, reference="quadrature")
        )
    note = "Random members gain one digit for a hundred times the time, and prove nothing."
    return Problem(
        "probability", "Probability that the bearing of the linkage binds", "probability", tuple(rows), note=note
    )
