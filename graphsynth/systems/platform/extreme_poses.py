"""Closed-form synthesis of the drives from two poses in which the mechanism reverses."""

from __future__ import annotations

import cmath
import math
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from graphsynth.core.checks import checked, finite_array
from graphsynth.core.errors import GeometryError

if TYPE_CHECKING:
    from graphsynth.systems.platform.motion import Motion
    from graphsynth.systems.platform.single_motor_platform import SingleMotorPlatform

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class TwoPoseDesign:
    """Drives that put every rocker at a dead point in the first pose.

    * `mechanism`: none if the closed form has no solution.
    * `accepted`: branches, full turn and first pose were verified.
    * `reason`: why not.
    * `notes`: legs that need not move, identical poses.
    * `other_dead_point` (shape (3,)): wheel angle of the second dead point of each leg, radians; pi if crank axis and
      both rocker ends are in line.
    * `first_error`, `second_error`: distance of the pose at psi = 0 from X+ and at psi = pi from X- (length, with
      ``Lc``).
    * `off_line`: largest distance of the path from the segment's line between the two poses (length, with ``Lc``).
    * `motion`: the whole turn.
    """

    mechanism: SingleMotorPlatform | None
    accepted: bool
    reason: str
    notes: tuple[str, ...]
    other_dead_point: Array
    first_error: float
    second_error: float
    off_line: float
    motion: Motion | None


@checked
def two_pose_design(
    mechanism: SingleMotorPlatform, first: ArrayLike, second: ArrayLike, *, samples: int = 96
) -> TwoPoseDesign:
    """Crank lengths, phases and coupler lengths such that all rockers reverse at psi = 0 exactly in the pose ``first``.

    `mechanism`: gives everything else; its home pose selects the working mode. `first`, `second` (shape (3,)): the
    poses X+ and X-. `samples`: samples of the verification. The error of the second pose is of second order in
    ``other_dead_point - pi``. Raises `GeometryError`: poses that are not three finite numbers. See
    theory/inverse-design 3: with the distances d+ and d- of the rocker ends from the wheel axis, ``l_B = |d+ - d-| /
    2`` and ``l_BC = (d+ + d-) / 2``.

    >>> from graphsynth.systems.platform.single_motor_platform import SingleMotorPlatform
    >>> found = two_pose_design(SingleMotorPlatform(), [2.4, 1.8, 0.05], [-2.4, -1.8, -0.05])
    >>> found.accepted, [round(length, 6) for length in found.mechanism.coupler], found.first_error < 1e-12
    (True, [45.148548, 45.024889, 45.055871], True)
    """
    poses = [finite_array(name, value).reshape(-1) for name, value in (("first", first), ("second", second))]
    if any(pose.shape != (3,) for pose in poses):
        raise GeometryError("first and second must hold three numbers each: x, y, alpha")
    still = replace(mechanism, crank=(0.0, 0.0, 0.0))
    sigma = tuple(int(s) for s in mechanism.platform.working_mode(still.home_pose(0.0), still.drive(0.0).theta))
    ends = []
    for name, pose in zip(("first", "second"), poses):
        solution = mechanism.platform.inverse(pose, sigma)
        if not np.isfinite(solution.theta).all():
            leg = int(np.flatnonzero(~np.isfinite(solution.theta))[0])
            reason = f"leg {leg + 1} does not reach the {name} pose; {solution.deficit[leg]:.6g} missing"
            return _rejected(None, reason)
        ends.append(_rocker_ends(mechanism, solution.theta))
    designed, notes, other = _drives(mechanism, ends[0], ends[1])
    if designed is None:
        return _rejected(None, notes[0])
    return _verified(designed, sigma, poses, notes, other, samples)


def _rejected(mechanism: SingleMotorPlatform | None, reason: str, notes: tuple[str, ...] = ()) -> TwoPoseDesign:
    return TwoPoseDesign(mechanism, False, reason, notes, np.full(3, np.nan), math.nan, math.nan, math.nan, None)


def _rocker_ends(mechanism: SingleMotorPlatform, theta: Array) -> list[complex]:
    """Vectors from the wheel axes to the joints C, fixed frame."""
    turn = np.exp(1j * np.array(mechanism.frame_angle))
    phi = theta - np.array(mechanism.delta)
    C = (np.array(mechanism.pivot) - np.array(mechanism.axis)) * turn + np.array(mechanism.rocker) * np.exp(1j * phi)
    return [complex(c) for c in C]


def _drives(
    mechanism: SingleMotorPlatform, plus: list[complex], minus: list[complex]
) -> tuple[SingleMotorPlatform | None, tuple[str, ...], Array]:
    crank, coupler, phase, notes, other = [], [], [], [], []
    for k, (a, b) in enumerate(zip(plus, minus)):
        far, near = abs(a), abs(b)
        if far + near == 0.0:
            return None, (f"drive {k + 1}: both rocker ends lie on the wheel axis",), np.full(3, np.nan)
        length = 0.5 * abs(far - near)
        still = length <= 1e-15 * (far + near)
        crank.append(0.0 if still else length)
        coupler.append(0.5 * (far + near))
        phase.append(0.0 if still else cmath.phase(a) + (0.0 if far > near else math.pi))
        other.append(math.nan if still else math.pi + cmath.phase(b / a))
        if still:
            notes.append(f"leg {k + 1} must not move: its crank length is 0")
    if not any(crank):
        notes.append("both poses need the same rocker distances: all cranks are zero (trivial)")
    built = replace(
        mechanism,
        crank=(crank[0], crank[1], crank[2]),
        coupler=(coupler[0], coupler[1], coupler[2]),
        phase=(phase[0], phase[1], phase[2]),
    )
    return built, tuple(notes), np.array(other)


def _verified(
    designed: SingleMotorPlatform,
    sigma: tuple[int, ...],
    poses: list[Array],
    notes: tuple[str, ...],
    other: Array,
    samples: int,
) -> TwoPoseDesign:
    weight = np.array([1.0, 1.0, designed.Lc])
    for number, turn in enumerate(designed.drive_turns(), start=1):
        if turn.kind != "full turn":
            return _rejected(designed, f"drive {number} makes no full turn ({turn.kind})", notes)
    start = designed.platform.inverse(poses[0], sigma).theta
    gap = np.exp(1j * (designed.drive(0.0).theta - start)) - 1.0
    for k in range(3):
        if abs(gap[k]) > 1e-6:
            text = f"drive {k + 1} reaches the first pose on the other branch, tau = {-designed.tau[k]}"
            return _rejected(designed, text, notes)
    psi = np.linspace(0.0, math.tau, 2 * (samples // 2) + 1)
    motion = designed.full_turn(psi, start=poses[0])
    if not motion.complete:
        return _rejected(designed, motion.stop_reason() or "the tracked pose is not an assembly mode", notes)
    reason = "" if motion.working_mode_constant else "a leg passes its boundary: the working mode changes"
    path = (motion.pose - poses[0]) * weight
    line = (poses[1] - poses[0]) * weight
    size = float(np.linalg.norm(line))
    unit = line / size if size > 0.0 else line
    off = float(np.linalg.norm(path - (path @ unit)[:, None] * unit, axis=1).max())
    return TwoPoseDesign(
        designed,
        not reason,
        reason,
        notes,
        other,
        float(np.linalg.norm(path[0])),
        float(np.linalg.norm((motion.pose[samples // 2] - poses[1]) * weight)),
        off,
        motion,
    )
