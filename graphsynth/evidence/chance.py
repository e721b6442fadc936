"""Probability of binding, and what its cure costs: proved bounds and random members, against plain formulas."""

from __future__ import annotations

import math
from functools import partial
from itertools import product
from typing import Any

import mpmath
import numpy as np

from graphsynth.evidence.rows import Effort, Problem, Row, RowStatus, best_of
from graphsynth.jamming.bearing.parameters import Range, ToleranceBox
from graphsynth.jamming.chance import probability as chance
from graphsynth.jamming.chance.allocation import Grade, allocate_tolerances
from graphsynth.jamming.chance.distributions import Distribution
from graphsynth.jamming.joints import JointLimits, Misalignment
from graphsynth.jamming.margins.margin import joints_margin
from graphsynth.kinematics.simulation import simulate
from graphsynth.mechanism.model import Mechanism

#: Middle and half width of the tilt (rad) and of the clearance (mm) of the example, both uniform.
_TILT, _CLEARANCE = ("0.0145", "0.0005"), ("0.03", "0.003")
_SEEDS, _NOTE = 6, "Random members gain one digit for a hundred times the time, and prove nothing."


def binding_probability(about_tilt: str = _TILT[1], about_clearance: str = _CLEARANCE[1]) -> float:
    """Probability for lambda proportions (crank 1, coupler 2.5), a bearing of 17.5 mm and 10 mm, by quadrature.

    >>> round(binding_probability(), 6)
    0.284089
    """
    with mpmath.workdps(30):
        tilt, about, middle, half = map(mpmath.mpf, (_TILT[0], about_tilt, _CLEARANCE[0], about_clearance))

        def share(alpha: mpmath.mpf) -> mpmath.mpf:
            S = mpmath.sin(alpha) / mpmath.mpf("2.5")
            need = 5 * S - mpmath.mpf("17.5") * S * S / (1 + mpmath.sqrt(1 - S * S))
            return min(max((need - middle + half) / (2 * half), mpmath.mpf(0)), mpmath.mpf(1))

        ends = mpmath.linspace(tilt - about, tilt + about, 33)
        return float(mpmath.quad(share, ends) / (2 * about))


def probability(context: Any, effort: Effort) -> Problem:
    """Measure both ways to the probability of one bearing; the bounds must hold the reference."""
    box = ToleranceBox(alpha=" +- ".join(_TILT), clearance=" +- ".join(_CLEARANCE))
    widths = (1e-2, 1e-4) if effort.quick else (1e-2, 1e-4, 1e-6)
    counts = (1000, 10_000) if effort.quick else (1000, 10_000, 100_000)
    rows = _rows(chance.ChanceProblem(box, {}), binding_probability(), widths, counts, effort)
    return Problem("probability", "Probability that the bearing of the linkage binds", "probability", rows, note=_NOTE)


def joints_probability(context: Any, effort: Effort) -> Problem:
    """Measure both ways to the probability of all joints: three equal bearings, whose limits have one cause."""
    # 0.375 of the tilts are more than twice the limit, which binds (theory/joints-that-share-a-tilt 6)
    pairs = (0, 3), (1, 2), (2, 3)
    joints = {pair: JointLimits(0.006, tilt_range=(0.0055, 0.0065)) for pair in pairs}
    motion = simulate(Mechanism.four_bar(2, 1, 2.5, 2.5), np.linspace(1.0, 2.0, 37), events=False)
    margin: Any = joints_margin(motion, joints, Misalignment(0, 1, 0.012, alpha_range=(0.010, 0.014)))
    given = {f"tilt {a}-{b}": Distribution("uniform", Range.read("limit", "0.006")) for a, b in pairs}
    given["alpha 0-1"] = Distribution.uniform("[0.010, 0.014]")
    cause = chance.CommonFactor("limits", Distribution.uniform("[0, 0.0005]"), {f"tilt {a}-{b}": 1 for a, b in pairs})
    widths, counts = ((1e-1, 2e-2), (300, 3000)) if effort.quick else ((1e-1, 3e-2, 1e-2, 3e-3), (300, 1000, 3000))
    rows = _rows(chance.ChanceProblem(margin, given, (cause,)), 0.375, widths, counts, effort)
    return Problem("joints-probability", "Probability that all bearings bind", "probability", rows, note=_NOTE)


def _rows(
    problem: chance.ChanceProblem, exact: float, widths: tuple[float, ...], counts: tuple[int, ...], effort: Effort
) -> tuple[Row, ...]:
    """Return rows of proved bounds, and of random members: the root of the mean square over seeds."""
    rows = []
    for width in widths:
        ask = partial(chance.probability_of_jamming, problem.subject, problem.toleranced, problem.common)
        found, *timed = best_of(partial(ask, width=width, ratio=1e6), effort)
        holds = found.lower <= exact + 1e-15 and exact - 1e-15 <= found.upper
        why = found.reason if holds else "the reference lies outside of what is proved"
        more: dict[str, Any] = {"reference": "none needed; checked to hold the plain formula", "value": width}
        more |= {"kind": "width of the proved bounds", "proved": True, "default": width == 1e-3}
        rows.append(Row.of("proved bounds", f"width {width:g}", found.upper - found.lower, timed, why, **more))
    for count in counts:
        drawn, *timed = best_of(partial(chance.sample_probability, problem, count), effort)
        every = [drawn, *(chance.sample_probability(problem, count, seed) for seed in range(1, _SEEDS))]
        error = math.sqrt(sum((own.share - exact) ** 2 for own in every) / _SEEDS)
        kind = f"root of the mean square distance, {_SEEDS} seeds"
        rows.append(Row.of("random members", f"{count} members", error, timed, reference="plain formula", kind=kind))
    return tuple(rows)


def allocation(context: Any, effort: Effort) -> Problem:
    """Buy tolerances of tilt and clearance so that at most one in a thousand binds, against the best of all choices."""
    allowed, box = 1e-3, ToleranceBox(alpha=_TILT[0], clearance=_CLEARANCE[0])
    grades = {
        name: [Grade(half, f"{middle} +- {half}", float(halves[0]) / float(half)) for half in halves]
        for name, middle, halves in (
            ("alpha", _TILT[0], ("0.0005", "0.0004", "0.0003", "0.0002", "0.0001")),
            ("clearance", _CLEARANCE[0], ("0.003", "0.0025", "0.002", "0.0015", "0.001", "0.0005")),
        )
    }
    exact = {own: binding_probability(own[0].name, own[1].name) for own in product(*grades.values())}
    cost = {own: math.fsum(grade.cost for grade in own) for own in exact}
    least = min(cost[own] for own in exact if exact[own] <= allowed)

    def searched(count: int) -> tuple[Grade, ...]:
        return tuple(allocate_tolerances(box, grades, allowed, trials=count).choice.values())

    def drawn(count: int) -> tuple[Grade, ...]:
        asked = {own: chance.ChanceProblem(box, {k: g.distribution for k, g in zip(grades, own)}) for own in exact}
        good = (own for own in exact if chance.sample_probability(asked[own], count).share <= allowed)
        return min(good, key=cost.__getitem__)

    rows = []
    for method, run, name, settings in (
        ("allocation", searched, "trials", (1, 10, 300)),
        ("every choice by random members", drawn, "each", (300, 3000, 30_000)),
    ):
        for setting in settings:
            found, *timed = best_of(partial(run, setting), effort)
            error = abs(cost[found] / least - 1.0) if found else math.nan
            why = "" if found and exact[found] <= allowed else "binds too often" if found else "none found"
            more: dict[str, Any] = {"kind": "cost above the least", "reference": "all choices, by the quadrature"}
            more |= {"status": RowStatus.UNRELIABLE if found else RowStatus.FAILED, "proved": run is searched}
            more |= {"value": setting, "default": run is searched and setting == 300}
            rows.append(Row.of(method, f"{setting} {name}", error, timed, why, **more))
    question = f"Cheapest of {len(exact)} choices of tilt and clearance with which at most {allowed:g} binds"
    return Problem("allocation", question, "relative", tuple(rows), note="An error of zero is the least cost.")
