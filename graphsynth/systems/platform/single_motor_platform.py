"""The single-motor mechanism: one pinion, three wheels, three four-bar drives, three legs, one platform.

Default dimensions: MOCK-RECT (millimetres), all rational in the frame of a leg.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from functools import cached_property
from time import perf_counter
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from graphsynth.core.checks import finite, finite_array, not_negative, positive, sign, three, three_points, triple
from graphsynth.core.errors import GeometryError
from graphsynth.kinematics.triad.leg import length_constants
from graphsynth.systems.platform.drive import DriveTurn, Event, FourBarDrive, GearTrain, first_barrier
from graphsynth.systems.platform.motion import (
    SAME,
    SINGULAR,
    BranchEnd,
    BranchLabel,
    Monodromy,
    Sweep,
    Tracked,
    TurnBatch,
    TurnMotion,
    compare,
    dimension_sets,
    distance,
    events,
    followed,
    track,
    wheel_angles,
)
from graphsynth.systems.platform.parallel_platform import ParallelPlatform, directions

if TYPE_CHECKING:
    from graphsynth.structure.graph import MechanismGraph

Array = NDArray[np.float64]
Triple = tuple[float, float, float]

_METHOD = "continuation with step control, compared with all assembly modes; estimated, not certified"

#: Figure 3 of the source: 0 frame, 1 pinion, 2-4 wheels, 5-7 couplers, 8-10 rockers, 11-13 links, 14 platform
_TURNING = "0-1 0-2 0-3 0-4 2-5 3-6 4-7 5-8 6-9 7-10 0-8 0-9 0-10 8-11 9-12 10-13 11-14 12-14 13-14"
_GEARED = "1-2 1-3 1-4"


class DriveState(NamedTuple):
    """Rocker angles (..., 3) in the fixed frame, first and second derivatives by psi, ``h_phi`` and leg status."""

    theta: Array
    theta1: Array
    theta2: Array
    h_phi: Array
    status: NDArray[np.int8]


@dataclass(frozen=True)
class SingleMotorPlatform:
    """Platform driven by one motor through three wheels and three four-bar linkages.

    Parameters
    ----------
    crank : sequence of 3 floats
        Crank lengths l_B,k, zero or more.
    phase : sequence of 3 floats
        Keying phases psi0_k in the fixed frame, radians.
    coupler, rocker : sequence of 3 floats
        l_BC,k and l_CD,k.
    axis, pivot, vertex : sequence of 3 complex
        Wheel axis O_k, rocker pivot D_k and platform vertex b_k, in the frame of leg k.
    l1, l2 : sequence of 3 floats
        Rocker arms towards the platform and intermediate links.
    frame_angle : sequence of 3 floats
        Angle beta_k of each leg frame in the fixed frame, radians.
    delta : sequence of 3 floats
        Angle of the bell-crank, ``theta_k = phi_k + delta_k``, radians.
    tau : sequence of 3 of {+1, -1}
        Branches of the drives.
    home : sequence of 3 floats
        A pose close to the home pose, which belongs to zero crank lengths; selects the assembly mode.
    gears : GearTrain
        Teeth of pinion and wheels.

    Raises
    ------
    GeometryError
        Impossible dimensions; the message names the parameter and the leg.

    Notes
    -----
    See theory/platform-drive.

    Examples
    --------
    >>> motion = SingleMotorPlatform(crank=(10, 5, 0), phase=(0, 0.5, 1)).full_turn(samples=9)
    >>> motion.closed, motion.label.sigma, motion.pose[0].round(6).tolist()
    (True, (-1, -1, -1), [0.672631, -5.007799, 0.053385])
    """

    crank: Triple = (10.0, 10.0, 10.0)
    phase: Triple = (0.0, 0.0, 0.0)
    coupler: Triple = (45.0, 45.0, 45.0)
    rocker: Triple = (60.0, 60.0, 60.0)
    axis: tuple[complex, complex, complex] = (45.0, 45.0, 45.0)
    pivot: tuple[complex, complex, complex] = (105 + 45j, 105 + 45j, 105 + 45j)
    vertex: tuple[complex, complex, complex] = (45.0, 45.0, 45.0)
    l1: Triple = (45.0, 45.0, 45.0)
    l2: Triple = (60.0, 60.0, 60.0)
    frame_angle: Triple = (-5 * math.pi / 6, -math.pi / 6, math.pi / 2)
    delta: Triple = (-math.pi / 2, -math.pi / 2, -math.pi / 2)
    tau: tuple[int, int, int] = (1, 1, 1)
    home: Triple = (0.0, 0.0, 0.0)
    gears: GearTrain = field(default_factory=GearTrain)

    def __post_init__(self) -> None:
        rules: dict[str, Any] = {
            "crank": not_negative,
            "coupler": positive,
            "rocker": positive,
            "phase": finite,
            "frame_angle": finite,
            "delta": finite,
            "home": finite,
            "tau": sign,
        }
        for name, rule in rules.items():
            values = three(name, getattr(self, name))
            object.__setattr__(self, name, tuple(rule(f"{name} of leg {k}", v) for k, v in enumerate(values, 1)))
        for name in ("axis", "pivot", "vertex"):
            object.__setattr__(self, name, three_points(name, getattr(self, name)))
        if not isinstance(self.gears, GearTrain):
            raise GeometryError(f"gears = {self.gears!r} is not a GearTrain; give the numbers of teeth to one")
        _ = self.platform, self.drives  # their own checks

    @cached_property
    def platform(self) -> ParallelPlatform:
        """The three-leg platform in the fixed frame."""
        turn = directions(self.frame_angle)
        D, b = np.array(self.pivot) * turn, np.array(self.vertex) * turn
        return ParallelPlatform(tuple(D), tuple(b), self.l1, self.l2)

    @cached_property
    def drives(self) -> tuple[FourBarDrive, FourBarDrive, FourBarDrive]:
        """The three four-bar drives, each in the frame of its leg."""
        phase = (psi0 - beta for psi0, beta in zip(self.phase, self.frame_angle))
        rows = zip(self.axis, self.pivot, self.crank, self.coupler, self.rocker, phase, self.tau)
        first, second, third = (FourBarDrive(*row) for row in rows)
        return (first, second, third)

    @cached_property
    def Lc(self) -> float:
        """Characteristic length: the largest distance of a platform vertex from the reference point, or of a link."""
        return max(abs(b) for b in self.platform.b) or max(self.platform.l2)

    def drive(self, psi: ArrayLike) -> DriveState:
        """Rocker angles and derivatives at wheel angles ``psi`` (radians, shape (...)), each of shape (..., 3)."""
        psi = finite_array("psi", psi)
        moved = [drive.motion(psi) for drive in self.drives]
        phi, phi1, phi2, h_phi = (np.stack([getattr(m, n) for m in moved], axis=-1) for n in moved[0]._fields[:4])
        offset = np.array(self.frame_angle) + np.array(self.delta)
        return DriveState(phi + offset, phi1, phi2, h_phi, np.stack([m.status for m in moved], axis=-1))

    def drive_turns(self) -> tuple[DriveTurn, DriveTurn, DriveTurn]:
        """Exact statement on the full rotation of each drive (theory/platform-drive 5)."""
        first, second, third = (drive.turn() for drive in self.drives)
        return (first, second, third)

    def home_pose(self, psi: float = 0.0) -> Array:
        """Pose of the home branch at wheel angle ``psi``, shape (3,): followed from zero crank length.

        Raises
        ------
        GeometryError
            If there is none, or the branch ends on the way.
        """
        tracked = self.follow(np.array([finite("psi", psi)]), None, None, accelerations=False)
        return np.asarray(tracked.pose[0, 0])

    @cached_property
    def _machine(self) -> Array:
        """The row per leg that `graphsynth.systems.platform.kernels` describes."""
        constants, P = length_constants(np.array(self.rocker), np.array(self.coupler)), self.platform
        first, second, third = angles = [beta + delta for beta, delta in zip(self.frame_angle, self.delta)]
        bell, rows = directions((first, second, third)), []
        for k, drive in enumerate(self.drives):
            w, D, b = drive.axis - drive.pivot, P.D[k], P.b[k]
            crank = (w.real, w.imag, drive.crank, drive.phase, drive.rocker, drive.tau)
            platform = (D.real, D.imag, P.l1[k], b.real, b.imag, P.l2[k])
            rows.append([*crank, *constants[k, :6], bell[k].real, bell[k].imag, angles[k], *platform])
        return np.array(rows)

    def follow(self, psi: Array, start: ArrayLike | None, stop: Event | None, *, accelerations: bool) -> Tracked:
        """Track the home branch, or the one of ``start``, through wheel angles psi (n,) up to an event.

        Raises `GeometryError` if there is no such branch at the first angle.
        """
        guess = np.array(self.home) if start is None else triple("start", start)
        stops, grown = np.array([np.inf if stop is None else stop.psi]), start is None
        tracked = track(self._machine[None], psi, stops, guess[None], self.Lc, grown=grown, accelerations=accelerations)
        status = BranchEnd(int(tracked.status[0]))
        if status is BranchEnd.NO_HOME:
            reach = np.abs(np.array(self.axis) - np.array(self.pivot))
            sides = np.array(self.rocker), np.array(self.coupler)
            if bool(np.any((reach > sides[0] + sides[1]) | (reach < np.abs(sides[0] - sides[1])))):
                raise GeometryError("a drive cannot be assembled at zero crank length; check |OD|, coupler and rocker")
            raise GeometryError(f"home = {self.home} is not close to an assembled pose; give a pose near the home pose")
        if status is BranchEnd.HOME_ENDS:
            raise GeometryError(
                f"the home branch ends at {tracked.end[0, 0]:.6g} of the crank lengths {self.crank} at psi = {psi[0]}; "
                "use shorter cranks"
            )
        if status is BranchEnd.NO_START:
            raise GeometryError(
                f"start is not close to an assembled pose at psi = {psi[0]}; take one of all_poses(psi)"
            )
        return tracked

    def sweep(self, psi: ArrayLike, start: ArrayLike | None = None, *, accelerations: bool = False) -> Sweep:
        """Follow one branch through increasing wheel angles, fast: without events or comparison with other modes.

        Parameters
        ----------
        psi : array_like, shape (n,)
            Increasing wheel angles, radians; any number of turns.
        start : array_like, shape (3,), optional
            A pose close to the branch at the first angle; the home branch if omitted.
        accelerations : bool
            Also second derivatives with respect to psi.

        Returns
        -------
        Sweep
            Estimated, not certified.  Rows beyond the end of the branch are NaN; ``reason`` says why it ended.

        Raises
        ------
        GeometryError
            Angles that do not increase, a start that is no assembled pose, a home branch that ends before psi[0].

        Examples
        --------
        >>> sweep = SingleMotorPlatform(crank=(10, 5, 0), phase=(0, 0.5, 1)).sweep([0.0, 0.5, 1.0])
        >>> sweep.complete, sweep.pose[0].round(6).tolist()
        (True, [0.672631, -5.007799, 0.053385])
        """
        angles = wheel_angles(finite_array("psi", psi))
        barrier = first_barrier(self.drives, angles)
        tracked = self.follow(angles, start, barrier, accelerations=accelerations)
        status = BranchEnd(int(tracked.status[0]))
        reason = {BranchEnd.SINGULAR: SINGULAR, BranchEnd.DRIVE_ENDS: barrier.statement if barrier else ""}
        return Sweep(
            **followed(angles, tracked, 0),
            reached=int(tracked.reached[0]),
            complete=status is BranchEnd.COMPLETE,
            end=tuple(tracked.end[0].tolist()),
            reason=reason.get(status, ""),
        )

    def full_turn_batch(
        self,
        crank: ArrayLike,
        phase: ArrayLike | None = None,
        coupler: ArrayLike | None = None,
        samples: int | ArrayLike = 361,
        *,
        accelerations: bool = False,
    ) -> TurnBatch:
        """Home branches of many dimension sets over one turn; everything not given is that of this mechanism.

        Parameters
        ----------
        crank, phase, coupler : array_like, shape (N, 3)
            Crank lengths, keying phases (radians) and coupler lengths of N sets.
        samples : int or array_like
            Number of wheel angles over [0, 2 pi], or increasing angles (radians).
        accelerations : bool
            Also second derivatives with respect to psi.

        Returns
        -------
        TurnBatch
            Estimated, not certified.  A set whose turn cannot be completed has NaN from there on, status and place.

        Raises
        ------
        GeometryError
            Numbers that are not finite, lengths that are not positive, shapes that do not fit.

        Examples
        --------
        >>> batch = SingleMotorPlatform().full_turn_batch([[10, 5, 0], [31, 31, 31]], samples=9)
        >>> [BranchEnd(status).name for status in batch.status.tolist()]
        ['COMPLETE', 'DRIVE_ENDS']
        """
        psi = wheel_angles(samples)
        l_B, psi0, l_BC = dimension_sets(
            crank, self.phase if phase is None else phase, self.coupler if coupler is None else coupler
        )
        machines = np.repeat(self._machine[None], len(l_B), axis=0)
        machines[:, :, 2], machines[:, :, 3] = l_B, psi0 - np.array(self.frame_angle)
        if coupler is not None:
            machines[:, :, 6:12] = length_constants(np.broadcast_to(np.array(self.rocker), l_BC.shape), l_BC)[..., :6]
        stops = _stops(self, l_B, psi0, l_BC, psi)
        guess = np.repeat(np.array(self.home)[None], len(l_B), axis=0)
        tracked = track(machines, psi, stops, guess, self.Lc, grown=True, accelerations=accelerations)
        return TurnBatch(
            **followed(psi, tracked, slice(None)),
            status=tracked.status.astype(np.int8),
            reached=tracked.reached,
            end=tracked.end,
            closure_error=np.asarray(distance(tracked.pose[:, -1], tracked.pose[:, 0], self.Lc)),
        )

    def monodromy(self, samples: int | ArrayLike = 361) -> Monodromy:
        """Follow all assembly modes over one turn and say which mode becomes which.

        Returns
        -------
        Monodromy
            Estimated, not certified.  A mode whose branch ends has the number -1 and a reason.

        Examples
        --------
        >>> SingleMotorPlatform(crank=(10, 5, 0), phase=(0, 0.5, 1)).monodromy().permutation
        (0, 1)
        """
        psi = wheel_angles(samples)
        modes = self.all_poses(float(psi[0]))
        barrier = first_barrier(self.drives, psi)
        machines = np.repeat(self._machine[None], len(modes), axis=0)
        stops = np.full(len(modes), np.inf if barrier is None else barrier.psi)
        tracked = track(machines, psi, stops, modes, self.Lc, grown=False, accelerations=False)
        permutation, reasons = [], []
        for i in range(len(modes)):
            status, reason, target = tracked.status[i], SINGULAR, -1
            if status == BranchEnd.COMPLETE:
                apart = distance(modes, tracked.pose[i, -1], self.Lc)
                nearest = int(np.argmin(apart))
                target = nearest if apart[nearest] <= SAME else -1
                reason = "" if target >= 0 else "the pose at the end is none of the modes at the start"
            elif status == BranchEnd.DRIVE_ENDS and barrier is not None:
                reason = barrier.statement
            permutation.append(target)
            reasons.append(reason)
        ends = tuple(math.nan if target >= 0 else float(at) for target, at in zip(permutation, tracked.end[:, 0]))
        return Monodromy(modes, tuple(permutation), ends, tuple(reasons))

    def full_turn(self, samples: int | ArrayLike = 361, start: ArrayLike | None = None) -> TurnMotion:
        """Follow one branch over a rotation of the wheels, with events and a closure test.

        Parameters
        ----------
        samples : int or array_like
            Number of wheel angles over [0, 2 pi], or increasing angles (radians).
        start : array_like, shape (3,), optional
            A pose close to the branch at the first angle; the home branch if omitted.

        Returns
        -------
        Motion
            Estimated, not certified.  If the branch ends (drive lock, platform singular) the arrays end there and an
            event says so; the pose is compared with all assembly modes at every sample.
        """
        begin = perf_counter()
        psi = wheel_angles(samples)
        barrier = first_barrier(self.drives, psi)
        tracked = self.follow(psi, start, barrier, accelerations=True)
        reached = int(tracked.reached[0])
        found = followed(psi[:reached], tracked, (0, slice(reached)))
        pose, theta, determinant = found["pose"], found["theta"], found["determinant"]
        _, leg = self.platform.jacobians(pose, theta)
        gap, rank, mismatch = compare(self.platform, pose, theta, self.Lc)
        complete = int(tracked.status[0]) == BranchEnd.COMPLETE
        monodromy, error, period = None, math.nan, 0
        if complete and math.isclose(psi[-1] - psi[0], math.tau, rel_tol=1e-12):
            monodromy, error = self.monodromy(psi), float(distance(pose[-1], pose[0], self.Lc))
            nearest = int(np.argmin(distance(monodromy.modes, pose[0], self.Lc)))
            period = monodromy.periods[nearest]
        sigma = (int(np.sign(leg[0, 0])), int(np.sign(leg[0, 1])), int(np.sign(leg[0, 2])))
        scale = max(*self.platform.l1, *self.platform.l2) ** 2
        return TurnMotion(
            **found,
            leg=leg,
            drive=self.drive(psi[:reached]).h_phi,
            gap=gap,
            residual=float(np.abs(self.platform.closure(pose, theta)).max()) / scale,
            complete=complete and not mismatch.any(),
            closed=period > 0,
            closure_error=error,
            period=period,
            events=self._events(psi, tracked, barrier, leg, mismatch),
            label=BranchLabel(self.tau, sigma, int(np.sign(determinant[0])), rank, 0),
            Lc=self.Lc,
            method=_METHOD,
            seconds=perf_counter() - begin,
            monodromy=monodromy,
        )

    def _events(
        self, psi: Array, tracked: Tracked, barrier: Event | None, leg: Array, mismatch: NDArray[np.bool_]
    ) -> tuple[Event, ...]:
        """Events of one tracked branch in order, its end included; ``leg`` is ``JT_kk`` at the samples reached."""
        end, found = float(psi[-1]), []
        if BranchEnd(int(tracked.status[0])) is BranchEnd.SINGULAR:
            end, x, y, alpha = (float(value) for value in tracked.end[0])
            found.append(Event("platform singular", end, 0, True, SINGULAR, (x, y, alpha)))
        elif barrier is not None:
            end = barrier.psi
            found.append(barrier)
        changes = zip(*np.nonzero(np.sign(leg[1:]) != np.sign(leg[:-1])))
        crossings = [(self._crossing(psi[i : i + 2], tracked.pose[0, i], int(k)), int(k) + 1) for i, k in changes]
        found += events(self.drives, float(psi[0]), end, crossings, psi[: len(mismatch)][mismatch])
        return tuple(sorted(found, key=lambda event: (event.psi, event.ends_motion)))

    def _crossing(self, psi: Array, pose: Array, leg: int) -> float:
        """Wheel angle at which ``JT`` of a leg vanishes between two samples, by refinement of the sampling."""
        low, high = float(psi[0]), float(psi[1])
        for _ in range(4):
            fine = self.follow(np.linspace(low, high, 33), pose, None, accelerations=False)
            values = self.platform.jacobians(fine.pose[0], fine.theta[0])[1][:, leg]
            change = int(np.argmax(np.sign(values[1:]) != np.sign(values[:-1])))
            low, high = low + (high - low) * change / 32.0, low + (high - low) * (change + 1) / 32.0
            pose = fine.pose[0, change]
        return low + (high - low) * float(values[change] / (values[change] - values[change + 1]))

    def all_poses(self, psi: float) -> Array:
        """All assembly modes for the drive branches of this mechanism at ``psi``, shape (m, 3)."""
        return self.platform.direct(self.drive(psi).theta).poses

    def graph(self) -> MechanismGraph:
        """Structural graph of the source's Figure 3: 15 links (0 the frame), 19 revolute joints, 3 gear pairs."""
        from graphsynth.structure.graph import MechanismGraph

        pairs = [(pair.split("-"), f) for text, f in ((_TURNING, 1), (_GEARED, 2)) for pair in text.split()]
        return MechanismGraph(15, [(int(a), int(b), f) for (a, b), f in pairs], frame=0)


def _stops(mechanism: SingleMotorPlatform, l_B: Array, psi0: Array, l_BC: Array, psi: Array) -> Array:
    """First wheel angle that each set cannot pass: infinite where all its cranks turn fully."""
    distance, l_CD = np.abs(np.array(mechanism.axis) - np.array(mechanism.pivot)), np.array(mechanism.rocker)
    slack = 1e-12 * (l_CD + l_BC + l_B)
    free = (distance + l_B < l_CD + l_BC - slack) & (np.abs(distance - l_B) > np.abs(l_CD - l_BC) + slack)
    stops = np.full(len(l_B), np.inf)
    for i in np.flatnonzero(~free.all(axis=1)):  # decided exactly, one by one
        one = replace(mechanism, crank=tuple(l_B[i]), phase=tuple(psi0[i]), coupler=tuple(l_BC[i]))
        barrier = first_barrier(one.drives, psi)
        stops[i] = np.inf if barrier is None else barrier.psi
    return stops
