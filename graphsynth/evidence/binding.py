"""Torque that binding costs: derivatives and differences of the least energy against a closed form; small tilts."""

from __future__ import annotations

import math
from functools import partial
from typing import Any

import mpmath
import numpy as np
from numpy.typing import NDArray

from graphsynth.core.errors import GeometryError
from graphsynth.evidence.rows import Effort, Problem, Row, best_of
from graphsynth.jamming.binding.report import BindingReport
from graphsynth.jamming.binding.torque import binding_torque
from graphsynth.jamming.joints.limits import RIGID, SPHERICAL, JointLimits
from graphsynth.kinematics.engine.result import Motion
from graphsynth.kinematics.simulation import simulate
from graphsynth.mechanism.model import Mechanism

Array = NDArray[np.float64]
#: Frame, crank, coupler, rocker (m), tilt and limit (rad), stiffness (N m/rad).
_LENGTHS = 0.2, 0.1, 0.25, 0.25
_TILT, _LIMIT, _STIFFNESS = 0.03, 0.006, 900.0
#: Positions among which the peak is sought for the reference.
_FINE = 1440


def exact_torque() -> float:
    """Largest torque, N m, where one joint takes all of the tilt: ``k (c sin f - t) c cos f``, with 50 digits."""
    with mpmath.workdps(50):
        c, t = mpmath.mpf(_TILT) * mpmath.mpf(_LENGTHS[1]) / mpmath.mpf(_LENGTHS[2]), mpmath.mpf(_LIMIT)
        # the derivative by f vanishes at c (1 - 2 s^2) + t s = 0, s = sin f
        s = (t + mpmath.sqrt(t * t + 8 * c * c)) / (4 * c)
        return float(_STIFFNESS * (c * s - t) * c * mpmath.sqrt(1 - s * s))


def binding_problem(effort: Effort | None = None) -> Problem:
    """Find the largest torque over the turn of a lambda linkage one joint of which takes all of the misalignment."""
    effort = effort or Effort()
    mechanism, exact = Mechanism.four_bar(*_LENGTHS), exact_torque()
    joints = {(0, 1): RIGID, (1, 2): SPHERICAL, (2, 3): JointLimits(_LIMIT), (0, 3): RIGID}
    given: Any = {"tilt": _TILT, "joints": joints, "stiffness": {(2, 3): _STIFFNESS}}

    def turn(count: int) -> Motion:
        return simulate(mechanism, np.linspace(0.0, math.tau, count + 1), events=False)

    def derivative(count: int) -> float:
        return binding_torque(turn(count), **given).peak_torque

    def differences(count: int) -> float:
        report = binding_torque(turn(count), **given)
        return float(np.abs(np.diff(report.energy) / np.diff(report.inputs)).max())

    rows = []
    reference = "closed form with 50 digits"
    for name, method in (("derivative of the energy", derivative), ("differences of the energy", differences)):
        for count in effort.some((36, 120, 360, 1440)):
            found, *timed = best_of(partial(method, count), effort, warm=count == 36)
            own: Any = {"reference": reference, "default": method is derivative and count == 360}
            rows.append(Row.of(name, f"{count} positions", abs(found / exact - 1.0), timed, **own))
    note = "Both miss the peak between the samples; the derivative itself is exact to 1e-9."
    question = "Largest torque over the turn that a tilted motor axis costs a lambda linkage"
    return Problem("binding", question, "relative", tuple(rows), note=note)


def small_tilts_problem(
    mechanism: Mechanism, given: dict[str, Any], name: str, span: float, effort: Effort | None = None
) -> Problem:
    """Find the largest elastic torque of a mechanism with small tilts and with every loop closed in space.

    ``given``: arguments of `binding_torque`, rigid links.  `GeometryError` where nothing binds.
    """
    effort = effort or Effort()

    def report(inputs: Array) -> BindingReport:
        return binding_torque(simulate(mechanism, inputs, events=False), **given)

    def small(inputs: Array) -> float:
        return float(np.nanmax(np.abs(report(inputs).elastic_torque)))

    def exact(inputs: Array) -> float:
        return float(np.nanmax(np.abs(report(inputs).exact().torque)))

    turn = report(np.linspace(0.0, span, _FINE + 1))
    if turn.answer != "binds":
        raise GeometryError(f"there is no torque to measure: {turn.statement}")
    peak = int(np.nanargmax(np.abs(turn.elastic_torque)))
    wanted = exact(np.linspace(turn.inputs[max(peak - 1, 0)], turn.inputs[min(peak + 1, _FINE)], 9))
    rows = []
    methods = ("small tilts", small, (36, 120, 360, 1440)), ("exact closure", exact, (12, 36, 120))
    for method, solve, counts in methods:
        for count in effort.some(counts):
            found, *timed = best_of(partial(solve, np.linspace(0.0, span, count + 1)), effort, warm=count == counts[0])
            own: Any = {"reference": "exact closure round the peak", "default": count == 360}
            rows.append(Row.of(method, f"{count} positions", abs(found / wanted - 1.0), timed, **own))
    note = (
        "Links are rigid and friction is left out. Both miss the peak between the samples; small tilts besides err by "
        "the square of the tilt."
    )
    return Problem("binding-in-space", f"Largest elastic torque of {name}", "relative", tuple(rows), note=note)
