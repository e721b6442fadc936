"""Drives of the platform: limited, change point, zero cranks, singular turn (platform page, 12.16 to 12.20)."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from graphsynth.evidence.stress.checks import Checks
    from graphsynth.systems.platform.single_motor_platform import SingleMotorPlatform

__all__ = ["change_point", "limited", "open_path", "singular_turn", "zero_cranks"]

#: Section 14.5: crank length at which the pure rotation becomes singular.
SINGULAR_CRANK = 26.31476703290850701359410874596422888417


def limited(check: Checks) -> None:
    """Crank that cannot turn: intervals of psi from the reach condition, an event, nothing beyond."""
    import mpmath as mp

    from graphsynth.systems.platform.drive import FourBarDrive
    from graphsynth.systems.platform.single_motor_platform import SingleMotorPlatform

    drive = FourBarDrive(45, 105 + 45j, 31.0, 45.0, 60.0)
    turn = drive.turn()
    check.says("kind", turn.kind, "limited")
    with mp.workdps(30):
        # |O - D + l_B e| = l_BC + l_CD = 105, |O - D| = 75: closed form of 7.4
        cosine = (mp.mpf(105) ** 2 - 75**2 - 31**2) / (2 * 75 * 31)
        half = mp.acos(cosine)
        middle = mp.arg(mp.mpc(-60, -45))
        ends = [middle + half, middle + 2 * mp.pi - half]
    if turn.admissible is None or len(turn.admissible) != 1:
        check.says("admissible intervals", turn.admissible, "one")
        return
    start, stop = turn.admissible[0]
    check.value("length of the interval", stop - start, ends[1] - ends[0], absolute=4e-15, source="closed form of 7.4")
    with mp.workdps(30):
        check.below(
            "its start", abs(float(mp.arg(mp.expj(mp.mpf(start) - ends[0])))), 4e-15, source="closed form of 7.4"
        )
    motion = SingleMotorPlatform(crank=(31,) * 3).full_turn(samples=73)
    check.says("full turn complete", motion.complete, False)
    event = motion.events[-1]
    check.says("event", (event.kind, event.ends_motion), ("drive lock", True))
    check.agrees("no pose beyond the lock", motion.psi[-1] <= event.psi, f"{motion.psi[-1]:.6f} and {event.psi:.6f}")
    check.says("never assembled", FourBarDrive(45, 105 + 45j, 200.0, 45.0, 60.0).turn().kind, "never assembled")


def change_point(check: Checks) -> None:
    """Equality in Grashof's condition, decided exactly: reported, not passed silently."""
    from graphsynth.kinematics.certify import certify_four_bar
    from graphsynth.systems.platform import certify_full_turn
    from graphsynth.systems.platform.drive import FourBarDrive
    from graphsynth.systems.platform.single_motor_platform import SingleMotorPlatform

    for crank, kind in ((29.999999999999996, "full turn"), (30.0, "change point"), (30.000000000000004, "limited")):
        check.says(f"crank {crank!r}", FourBarDrive(45, 105 + 45j, crank, 45.0, 60.0).turn().kind, kind)
    motion = SingleMotorPlatform(crank=(30,) * 3).full_turn(samples=73)
    ends = [event.kind for event in motion.events if event.ends_motion]
    check.says("event that ends the motion", ends, ["change point"])
    check.mentions("both continuations are named", motion.stop_reason(), "tau = +1", "tau = -1", "choose")
    proof = certify_full_turn(SingleMotorPlatform(crank=(30,) * 3))
    check.says("certificate", proof.verdict.name, "CHANGE_POINT")
    check.says("four-bar 75, 30, 45, 60", certify_four_bar(75, 30, 45, 60).kind, "change point")


def zero_cranks(check: Checks) -> None:
    """Cranks of length zero: that rocker stands still; with all three nothing moves."""
    from graphsynth.systems.platform.single_motor_platform import SingleMotorPlatform

    for crank in ((10, 5, 0), (10, 0, 0), (0, 0, 0)):
        machine = SingleMotorPlatform(crank=crank)
        motion = machine.full_turn(samples=25)
        check.equals(f"{crank}: complete and closed", (motion.complete, motion.closed), (True, True))
        rates = machine.drive(np.linspace(0, 6, 13)).theta1
        for leg, length in enumerate(crank):
            if length == 0:
                check.value(f"{crank}: rate of rocker {leg + 1}", np.abs(rates[:, leg]).max(), 0)
            else:
                check.agrees(f"{crank}: rocker {leg + 1} moves", np.abs(rates[:, leg]).max() > 0.01)
    still = SingleMotorPlatform(crank=(0, 0, 0)).full_turn(samples=9)
    check.value("all zero: dX/dpsi", np.abs(still.velocity).max(), 0)
    check.below("all zero: distance from home", float(np.abs(still.pose).max()), 1e-12)


def singular_turn(check: Checks) -> None:
    """Pure rotation beyond its limit: event with psi, the merging pose, and what is admissible."""
    from graphsynth.systems.platform import certify_full_turn
    from graphsynth.systems.platform.single_motor_platform import SingleMotorPlatform

    phases = SingleMotorPlatform().frame_angle
    for offset in (1e-9, 1e-3):
        below = SingleMotorPlatform(crank=(SINGULAR_CRANK - offset,) * 3, phase=phases).full_turn()
        check.equals(f"{offset:g} below the limit: complete, closed", (below.complete, below.closed), (True, True))
        machine = SingleMotorPlatform(crank=(SINGULAR_CRANK + offset,) * 3, phase=phases)
        motion = machine.full_turn()
        event = motion.events[-1]
        check.says(f"{offset:g} above: event", (event.kind, event.ends_motion), ("platform singular", True))
        alpha = event.pose[2] if event.pose else math.nan
        # alpha is a square root of the angle left, which is located to about 1e-11
        check.value(f"{offset:g} above: alpha", alpha, "0.8097835725701668466241458580188852331038", absolute=5e-6)
        start = float(machine.drives[0].motion(event.psi).phi)
        home = float(SingleMotorPlatform(crank=(0, 0, 0)).drives[0].motion(0.0).phi)
        check.value(
            f"{offset:g} above: rocker rotation",
            start - home,
            "-0.4772186450164019269814725994157600429792",
            absolute=1e-9,
        )
        check.mentions(f"{offset:g} above: sentence", motion.stop_reason(), "merge")
        check.agrees(f"{offset:g} above: nothing beyond", motion.psi[-1] < event.psi)
        check.says(f"{offset:g} above: monodromy", machine.monodromy(73).permutation, (-1, -1))
    proof = certify_full_turn(SingleMotorPlatform(crank=(26.32,) * 3, phase=phases), max_boxes=3000, seconds=5.0)
    check.says("no certificate of a full turn", proof.certified, False)


def _cusped() -> SingleMotorPlatform:
    """Platform two of whose modes change places in a turn, without a singularity."""
    from graphsynth.systems.platform.single_motor_platform import SingleMotorPlatform

    twelfth, pivot = math.pi / 6, (-0.5 + 1.5j, -0.6 + 0.4j, 1.4 - 0.2j)
    a, b, c = pivot
    return SingleMotorPlatform(
        crank=(0.8, 1, 1), phase=(11 * twelfth, 2 * twelfth, 0.0), coupler=(1.5,) * 3, rocker=(1.5,) * 3,
        axis=(a + 1.5, b + 1.5, c + 1.5), pivot=pivot, vertex=(1 - 0.8j, 0.8 - 1.7j, 0.4 + 1j), l1=(0.5, 0.7, 0.9),
        l2=(1.8, 2.3, 1.9), delta=(6 * twelfth, 11 * twelfth, twelfth), frame_angle=(0, 0, 0),
    )  # fmt: skip


def open_path(check: Checks) -> None:
    """Modes that change places: period and permutation, against all modes joined to the nearest at 8001 angles."""
    machine = _cusped()
    turned = machine.monodromy()
    batch = machine.platform.direct_batch(machine.drive(np.linspace(0, math.tau, 8001)).theta)
    sets = np.split(batch.poses, np.cumsum(batch.counts)[:-1])
    at = sets[0]
    for poses in sets[1:]:
        apart = at[:, None] - poses[None]
        apart[..., 2] = np.angle(np.exp(1j * apart[..., 2]))
        at = poses[np.linalg.norm(apart, axis=-1).argmin(axis=1)]
    joined = tuple(int(np.abs(sets[0][:, :2] - pose[:2]).sum(axis=1).argmin()) for pose in at)
    check.equals("permutation", turned.permutation, joined, source="all modes at 8001 angles")
    check.agrees("it is no identity", joined != tuple(range(len(joined))), str(joined))
    check.equals("periods", turned.periods, (1, 1, 2, 2))
    motion = machine.full_turn(start=turned.modes[2])
    check.equals("period of the motion", motion.period, 2)
    check.agrees("it is not at its start after one turn", motion.closure_error > 1.0, f"{motion.closure_error:.3g}")
    twice = machine.sweep(np.linspace(0, 2 * math.tau, 721), start=turned.modes[2])
    check.values("after two turns it is", twice.pose[720, :2], turned.modes[2, :2], absolute=1e-13, source="period 2")
