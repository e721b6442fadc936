"""The tilt of one bearing with every loop closed in space: small tilts, the least factor, and proofs on both sides."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import partial

import mpmath

from graphsynth.core.errors import GeometryError
from graphsynth.evidence.position import four_bar
from graphsynth.evidence.rows import Effort, Problem, Row, best_of
from graphsynth.jamming.joints import RIGID, SPHERICAL, JointLimits, Misalignment
from graphsynth.jamming.joints.program import problem
from graphsynth.jamming.space.closure import Closure
from graphsynth.jamming.space.model import in_space, start
from graphsynth.jamming.space.optimum import least_scale
from graphsynth.jamming.space.pose import prove_pose
from graphsynth.kinematics.simulation import simulate
from graphsynth.mechanism.four_bar import TiltedFourBar

_CLOSED = "closed form, 50 digits"


def space_problem(linkage: TiltedFourBar, alpha: float = 0.1, effort: Effort | None = None) -> Problem:
    """Find the tilt that one bearing needs beside a tilted motor axis, with every loop closed in space.

    Spherical at A, rigid at C, the crank at 90 degrees: the bearing at B tilts by ``asin(l2 / l3 sin(alpha))``.
    """
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
