"""Spherical at A, rigid at C: the bearing at B tilts by ``asin(l2 / l3 sin(alpha) sin(input))``, with any l1, l4."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import partial
from inspect import signature
from typing import Any

import mpmath
import numpy as np

from graphsynth.core.errors import GeometryError
from graphsynth.evidence.jamming import _gap_row
from graphsynth.evidence.position import four_bar
from graphsynth.evidence.rows import Effort, Problem, Row, best_of
from graphsynth.jamming.joints import RIGID, SPHERICAL, JointLimits, Misalignment
from graphsynth.jamming.joints.certify import certify_coupled
from graphsynth.jamming.joints.program import problem
from graphsynth.jamming.space.closure import Closure
from graphsynth.jamming.space.optimum import least_scale
from graphsynth.jamming.space.plane import in_space, start
from graphsynth.jamming.space.pose import prove_pose
from graphsynth.jamming.space.scale import largest_scale
from graphsynth.jamming.space.turn import certify_in_space
from graphsynth.kinematics.simulation import simulate
from graphsynth.mechanism.four_bar import TiltedFourBar
from graphsynth.mechanism.model import Mechanism
from graphsynth.tolerances.parts import LengthTolerance

_CLOSED = "closed form, 50 digits"


def space_problem(linkage: TiltedFourBar, alpha: float = 0.1, effort: Effort | None = None) -> Problem:
    """Find the tilt that one bearing needs beside a tilted motor axis, with every loop closed in space."""
    effort = effort or Effort()
    mechanism, _ = four_bar(replace(linkage, alpha=0.0))
    motion = simulate(mechanism, [0.5 * math.pi, 0.5 * math.pi + 1e-3], events=False)
    if not motion.assembled.all():
        raise GeometryError("the linkage is not assembled with its crank at 90 degrees; give one that turns fully")
    with mpmath.workdps(50):
        # the crank is at the double nearest to 90 degrees
        sine = mpmath.sin(mpmath.mpf(alpha)) * mpmath.sin(mpmath.mpf(0.5 * math.pi))
        exact = mpmath.asin(mpmath.mpf(linkage.l2) / mpmath.mpf(linkage.l3) * sine)
    tilt = Misalignment(0, 1, alpha)

    def given(limit: float) -> tuple[dict[tuple[int, int], JointLimits], Misalignment]:
        return {(0, 1): RIGID, (1, 2): SPHERICAL, (2, 3): JointLimits(limit), (0, 3): RIGID}, tilt

    def small() -> float:
        return float(problem(mechanism, *given(1.0)).solve(motion.poses[:1], "scale").lower[0])

    def least() -> float:
        model = in_space(problem(mechanism, *given(float(exact))))
        return least_scale(Closure(model, False), start(model, mechanism, motion.poses[0])).scale * float(exact)

    def proved(gap: float) -> tuple[int, int]:
        states = []
        for side in (0.5, -0.5):
            model = in_space(problem(mechanism, *given(float(exact * (1.0 + side * gap)))))
            states.append(prove_pose(model, start(model, mechanism, motion.poses[0])).state)
        return states[0], states[1]

    rows = []
    for name, run in (("small tilts", small), ("least factor in space", least)):
        found, *timed = best_of(run, effort)
        rows.append(Row.of(name, "", float(abs(found / exact - 1)), timed, reference=_CLOSED))
    more = {"kind": "gap between the proved bounds", "reference": f"none needed; around the {_CLOSED}", "proved": True}
    for gap in (1e-2, 1e-6) if effort.quick else (1e-2, 1e-4, 1e-6, 1e-8, 1e-10):
        states, *timed = best_of(partial(proved, gap), effort)
        why = "" if states == (1, -1) else f"states {states} on both sides"
        rows.append(Row.of("proofs in space", f"gap {gap:g}", gap, timed, why, value=gap, **more))
    question = f"Tilt of one bearing beside a motor axis tilted by {alpha:g} rad, every loop closed in space"
    note = "Small tilts neglect the third power of the tilt; a proof is one of freedom above and one of binding below."
    return Problem("exact-closure", question, "relative", tuple(rows), note=note)


def _given(alpha: float, low: float, high: float) -> tuple[Any, float]:
    """Motion (degrees), limits and misalignment; and ``l3 sin(limit) / l2``, the height of the crank pin at the end."""
    limit = math.asin(0.4 * math.sin(alpha) * math.sin(math.radians(50.0)))
    joints = {(0, 1): RIGID, (1, 2): SPHERICAL, (2, 3): JointLimits(limit), (0, 3): RIGID}
    mechanism = Mechanism.four_bar(2.0, 1.0, 2.5, 2.5)
    motion = simulate(mechanism, np.radians(np.linspace(low, high, 21)), events=False)
    with mpmath.workdps(50):
        return (motion, joints, Misalignment(0, 1, alpha)), 2.5 * mpmath.sin(mpmath.mpf(limit))


def _row(method: str, run: Any, setting: tuple[str, float], truth: tuple[Any, float, float], effort: Effort) -> Row:
    """Return the row of a certificate for ``truth``: height of the pin, misalignment, part by which lengths differ."""
    (name, value), (height, alpha, part) = setting, truth
    found, *timed = best_of(partial(run, **{name: value}), effort, warm=False)
    with mpmath.workdps(50):
        sine, spread = height / mpmath.sin(mpmath.mpf(alpha)), (1 + mpmath.mpf(part)) / (1 - mpmath.mpf(part))
        ends = float(mpmath.asin(sine / spread)), float(mpmath.asin(sine * spread))
    wrong = (found.high > ends[0] + 1e-15) & (found.state == 1) | (found.low < ends[1] - 1e-15) & (found.state == -1)
    left = float((found.high - found.low)[found.state == 0].sum()) - (ends[1] - ends[0])
    why = "the end in closed form lies within what is proved" if wrong.any() else ""
    more: dict[str, Any] = {"kind": "undecided without need", "more": {"pieces": float(found.evaluated)}}
    more |= {"reference": "none needed; checked to leave out the closed form", "value": value, "proved": True}
    return Row.of(method, f"{name} {value:g}".replace("_", " "), left, timed, why, **more)


def exact_turn(context: Any, effort: Effort) -> Problem:
    """Find where one bearing begins to bind beside a motor axis tilted by 0.1 rad, with finite tilts."""
    given, height = _given(0.1, 40.0, 60.0)
    rows = [
        _row(method, partial(prove, *given), ("resolution", value), (height, 0.1, 0.0), effort)
        for method, prove in (("small tilts and their remainder", certify_coupled), ("exact closure", certify_in_space))
        for value in ((1e-1, 1e-2) if effort.quick else (1e-1, 1e-2, 1e-3))
    ]
    question = "Where one bearing begins to bind beside a motor axis tilted by 0.1 rad (40 to 60 degrees)"
    return Problem("exact-turn", question, "rad", tuple(rows))


def exact_scale(context: Any, effort: Effort) -> Problem:
    """Find the largest tilt of the motor axis that one bearing allows over a range of inputs, exact closure."""
    given, height = _given(0.1, 85.0, 95.0)
    with mpmath.workdps(50):
        exact, rows = mpmath.asin(height) / mpmath.mpf(0.1), []
    default = signature(largest_scale).parameters["relative_gap"].default
    for gap in (1e-2, 1e-3) if effort.quick else (1e-2, 1e-3, 1e-4, 1e-6):
        found, *timed = best_of(partial(largest_scale, *given, relative_gap=gap), effort, warm=False)
        rows.append(_gap_row(found, gap, (exact, exact, _CLOSED), timed, default=gap == default))
    question = "Largest tilt of the motor axis that one bearing allows (85 to 95 degrees), every loop closed in space"
    return Problem("exact-scale", question, "relative", tuple(rows))


def length_tolerances(context: Any, effort: Effort) -> Problem:
    """Find where one bearing binds with lengths of crank and coupler within 1 %: for all members, or for none."""
    given, height = _given(0.01, 40.0, 60.0)
    lengths = [LengthTolerance(1, (0, 2), 0.01), LengthTolerance(2, (1, 3), 0.025)]
    run, counts = partial(certify_coupled, *given, tolerances=lengths), (100, 300) if effort.quick else (100, 300, 1000)
    rows = [_row("proof over all lengths", run, ("max_pieces", n), (height, 0.01, 0.01), effort) for n in counts]
    run = partial(certify_in_space, *given, tolerances=lengths)
    parts = (3e-2,) if effort.quick else (3e-2, 1e-2)
    rows += [_row("exact closure", run, ("resolution", part), (height, 0.01, 0.01), effort) for part in parts]
    question = "Where one bearing binds, crank and coupler within 1 %: inputs left undecided though all members agree"
    return Problem("length-tolerances", question, "rad", tuple(rows))
