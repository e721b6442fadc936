"""Torque that binding costs: the derivative of the least energy, and differences of energies, against a closed form."""

from __future__ import annotations

import math
from functools import partial
from typing import Any

import mpmath
import numpy as np

from graphsynth.evidence.rows import Effort, Problem, Row, best_of
from graphsynth.jamming.binding.torque import binding_torque
from graphsynth.jamming.joints.limits import RIGID, SPHERICAL, JointLimits
from graphsynth.kinematics.engine.result import Motion
from graphsynth.kinematics.simulation import simulate
from graphsynth.mechanism.model import Mechanism

#: Frame, crank, coupler, rocker (m), tilt and limit (rad), stiffness (N m/rad).
_LENGTHS = 0.2, 0.1, 0.25, 0.25
_TILT, _LIMIT, _STIFFNESS = 0.03, 0.006, 900.0


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
