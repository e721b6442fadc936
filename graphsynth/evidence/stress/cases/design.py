"""Inverse design at its ends: too large, equal distances, identical poses (platform page, 12.21 to 12.23)."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from graphsynth.evidence.stress.checks import Checks

__all__ = ["equal_distances", "identical_poses", "too_large"]


def too_large(check: Checks) -> None:
    """Amplitude beyond the singular orientation: refused with the reason and the largest amplitude reached."""
    from graphsynth.systems.platform.inverse_design import refine_design, rotation_about
    from graphsynth.systems.platform.single_motor_platform import SingleMotorPlatform

    wanted = rotation_about(0.9)  # beyond 2 atan(3/7) = 0.81
    found = refine_design(SingleMotorPlatform(), wanted, samples=48)
    check.says("accepted", found.accepted, False)
    check.mentions("reason", found.reason, "singular during the turn")
    check.agrees("no motion is shown", found.motion is None)
    reached = found.amplitude_reached
    check.agrees("largest amplitude reached", 0.2 < reached < 0.95, f"{reached:.6f}")
    inside = refine_design(SingleMotorPlatform(), wanted * (reached * 0.98), samples=48)
    check.agrees("2 per cent less is a design", inside.accepted, inside.reason or "accepted")
    gap = np.abs(inside.achieved - wanted * (reached * 0.98)).max()
    check.below("its first harmonic", float(gap), 1e-10)


def equal_distances(check: Checks) -> None:
    """Poses between which the rocker of one leg need not move: its crank is zero, noted; the others move."""
    from graphsynth.systems.platform.extreme_poses import two_pose_design
    from graphsynth.systems.platform.single_motor_platform import SingleMotorPlatform

    machine = SingleMotorPlatform()
    platform, first = machine.platform, np.array([1.0, 0.5, 0.01])
    theta = platform.inverse(first, (-1, -1, -1)).theta
    modes = platform.direct(theta + np.array([0.0, 0.03, -0.02])).poses
    second = modes[np.linalg.norm(modes * [1, 1, 45] - first * [1, 1, 45], axis=1).argmin()]
    found = two_pose_design(machine, first, second)
    check.agrees("a mechanism is designed", found.mechanism is not None, found.reason or "yes")
    if found.mechanism is None:
        return
    # two inverse problems leave some units in the last place of the 45 mm coupler
    check.below("crank of leg 1, mm", found.mechanism.crank[0], 3e-14)
    check.agrees(
        "cranks of legs 2 and 3 are not zero", min(found.mechanism.crank[1:]) > 0.1, str(found.mechanism.crank)
    )
    check.says(
        "leg 1 is noted where its crank is 0", any("leg 1" in n for n in found.notes), found.mechanism.crank[0] == 0
    )
    check.below("first pose", found.first_error, 1e-12)
    exact = two_pose_design(machine, first, first)
    check.mentions("distances exactly equal", "; ".join(exact.notes), "leg 1", "leg 2", "leg 3", "crank length is 0")


def identical_poses(check: Checks) -> None:
    """Both extreme poses equal: all cranks zero, called trivial."""
    from graphsynth.systems.platform.extreme_poses import two_pose_design
    from graphsynth.systems.platform.single_motor_platform import SingleMotorPlatform

    for pose in ([1.0, 1.0, 0.0], [0.0, 0.0, 0.0]):
        found = two_pose_design(SingleMotorPlatform(), pose, pose)
        crank = found.mechanism.crank if found.mechanism else None
        check.says(f"{pose}: cranks", crank, (0.0, 0.0, 0.0))
        check.mentions(f"{pose}: note", "; ".join(found.notes), "trivial")
    far = two_pose_design(SingleMotorPlatform(), [500.0, 0.0, 0.0], [0.0, 0.0, 0.0])
    check.mentions("out of reach", far.reason, "does not reach the first pose")
