"""The single-motor mechanism: one pinion, three wheels, three four-bar drives, three legs, one platform.

Default dimensions: MOCK-RECT (millimetres), all rational in the frame of a leg.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from functools import cached_property
from time import perf_counter
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from graphsynth.errors import GeometryError
from graphsynth.kinematics._checks import finite, finite_array, positive, sign
from graphsynth.kinematics.drive import DriveTurn, FourBarDrive
from graphsynth.kinematics.gears import GearTrain
from graphsynth.kinematics.motion import BranchLabel, Event, Motion
from graphsynth.kinematics.parallel_platform import ParallelPlatform
from graphsynth.kinematics.tracking import Tracked, correct, track

if TYPE_CHECKING:
    from graphsynth.structure.graph import MechanismGraph

__all__ = ["DriveState", "SingleMotorPlatform"]

Array = NDArray[np.float64]
Triple = tuple[float, float, float]

_METHOD = "continuation with step control, compared with all assembly modes; estimated, not certified"
_CLOSED = 1e-9
_TURNS = 6

_BARRIERS = {
    "lock": ("drive lock", "drive {0} locks: coupler and rocker in line; the crank cannot pass"),
    "change point": (
        "change point",
        "drive {0} reaches a change point: the branches tau = +1 and tau = -1 meet and both continue; choose one",
    ),
}
_SINGULAR = "det JX = 0: two assembly modes merge at this pose; the branch ends here"

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
    Specification parallel_platform, sections 7 and 8.

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
        rules = {
            "crank": lambda n, v: positive(n, v, zero=True),
            "coupler": positive,
            "rocker": positive,
            "phase": finite,
            "frame_angle": finite,
            "delta": finite,
            "home": finite,
            "tau": sign,
        }
        for name, rule in rules.items():
            values = tuple(getattr(self, name))
            if len(values) != 3:
                raise GeometryError(f"{name} has {len(values)} entries; give three, one per leg")
            object.__setattr__(self, name, tuple(rule(f"{name} of leg {k}", v) for k, v in enumerate(values, 1)))
        _ = self.platform, self.drives  # their own checks

    @cached_property
    def platform(self) -> ParallelPlatform:
        """The three-leg platform in the fixed frame."""
        turn = _directions(self.frame_angle)
        D, b = np.array(self.pivot) * turn, np.array(self.vertex) * turn
        return ParallelPlatform((D[0], D[1], D[2]), (b[0], b[1], b[2]), self.l1, self.l2)

    @cached_property
    def drives(self) -> tuple[FourBarDrive, FourBarDrive, FourBarDrive]:
        """The three four-bar drives, each in the frame of its leg."""
        first, second, third = (
            FourBarDrive(
                self.axis[k], self.pivot[k], self.crank[k], self.coupler[k], self.rocker[k],
                self.phase[k] - self.frame_angle[k], self.tau[k],
            )
            for k in range(3)
        )  # fmt: skip
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
        """Exact full-turn statement of each drive (section 7.4)."""
        first, second, third = (drive.turn() for drive in self.drives)
        return (first, second, third)

    def home_pose(self, psi: float = 0.0) -> Array:
        """Pose of the home branch at wheel angle ``psi``: followed from zero crank length, shape (3,).

        Raises
        ------
        GeometryError
            If the drives cannot be assembled there, the home pose does not close, or the branch ends on the way.
        """
        offset = np.array(self.frame_angle) + np.array(self.delta)

        def grown(scale: float) -> tuple[Array, Array]:
            pairs = [drive.growth(psi, scale) for drive in self.drives]
            return np.array([p for p, _ in pairs]) + offset, np.array([rate for _, rate in pairs])

        theta, _ = grown(0.0)
        if not np.isfinite(theta).all():
            raise GeometryError("a drive cannot be assembled at zero crank length; check |OD|, coupler and rocker")
        found = correct(self.platform, np.array(self.home), theta, self.Lc)
        if found is None or found.first > 0.1:
            raise GeometryError(f"home = {self.home} is not close to an assembled pose; give a pose near the home pose")
        tracked = track(self.platform, grown, found.pose, np.linspace(0.0, 1.0, 5), self.Lc)
        if tracked.failed_at is not None:
            raise GeometryError(
                f"the home branch ends at {tracked.failed_at:.6g} of the crank lengths {self.crank} at psi = {psi}; "
                "use shorter cranks"
            )
        return np.asarray(tracked.pose[-1])

    def _input(self, psi: float) -> tuple[Array, Array]:
        state = self.drive(psi)
        return state.theta, state.theta1

    def full_turn(self, samples: int | ArrayLike = 361, start: ArrayLike | None = None) -> Motion:
        """Follow one branch over a turn of the wheels, with events and a closure test.

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
        psi = _increasing(samples)
        first = self.home_pose(float(psi[0])) if start is None else self._given(start, float(psi[0]))
        barrier = self._barrier(float(psi[0]), float(psi[-1]))
        passable = psi if barrier is None else psi[psi < barrier.psi]
        tracked = track(self.platform, self._input, first, passable, self.Lc)
        state = self.drive(tracked.parameter)
        theta = np.unwrap(state.theta, axis=0)
        pose = tracked.pose
        velocity, acceleration = self.platform.accelerations(pose, theta, state.theta1, state.theta2)
        JX, leg = self.platform.jacobians(pose, theta)
        gap, rank, mismatch = self._compare(pose, theta)
        complete = tracked.failed_at is None and barrier is None
        error, period = self._closure(psi, pose, complete)
        events = self._events(tracked, barrier, leg) + mismatch_events(tracked.parameter, mismatch)
        determinant = np.linalg.det(JX)
        sigma = (int(np.sign(leg[0, 0])), int(np.sign(leg[0, 1])), int(np.sign(leg[0, 2])))
        scale = max(*self.platform.l1, *self.platform.l2) ** 2
        return Motion(
            psi=tracked.parameter, pose=pose, velocity=velocity, acceleration=acceleration, theta=theta,
            determinant=determinant, leg=leg, drive=state.h_phi, gap=gap,
            residual=float(np.abs(self.platform.closure(pose, theta)).max()) / scale,
            complete=complete and not mismatch.any(), closed=period > 0, closure_error=error, period=period,
            events=tuple(sorted(events, key=lambda event: (event.psi, event.ends_motion))),
            label=BranchLabel(self.tau, sigma, int(np.sign(determinant[0])), rank, 0),
            Lc=self.Lc, method=_METHOD, seconds=perf_counter() - begin,
        )  # fmt: skip

    def _given(self, start: ArrayLike, psi: float) -> Array:
        found = correct(self.platform, finite_array("start", start).reshape(3), self.drive(psi).theta, self.Lc)
        if found is None or found.first > 0.1:
            raise GeometryError(f"start is not close to an assembled pose at psi = {psi}; take one of all_poses(psi)")
        return found.pose

    def all_poses(self, psi: float) -> Array:
        """All assembly modes for the drive branches of this mechanism at ``psi``, shape (m, 3)."""
        return self.platform.direct(self.drive(psi).theta).poses

    def _compare(self, pose: Array, theta: Array) -> tuple[Array, int, NDArray[np.bool_]]:
        """Distance to the nearest other mode, rank of alpha at the start, and samples where no mode matches."""
        batch = self.platform.direct_batch(theta)
        gap, mismatch, rank = np.full(len(pose), np.inf), np.zeros(len(pose), dtype=bool), 0
        for index in range(len(pose)):
            modes = batch.poses[batch.problem == index]
            if batch.near_double_root[index]:
                modes = self.platform.direct(theta[index]).poses
            distance = np.sort(self._distance(modes, pose[index]))
            mismatch[index] = distance.size == 0 or distance[0] > 1e-6
            gap[index] = distance[1] if distance.size > 1 else np.inf
            if index == 0 and distance.size:
                rank = int(np.argmin(self._distance(modes, pose[0])))
        return gap, rank, mismatch

    def _distance(self, poses: Array, pose: Array) -> Array:
        """``sqrt(dx^2 + dy^2 + Lc^2 dalpha^2) / Lc`` with the angle taken on the circle."""
        d = poses - pose
        turn = np.angle(np.exp(1j * d[..., 2]))
        return np.asarray(np.sqrt((d[..., 0] ** 2 + d[..., 1] ** 2) / self.Lc**2 + turn**2))

    def _closure(self, psi: Array, pose: Array, complete: bool) -> tuple[float, int]:
        """Distance after one turn and the number of turns until closure (0 if it does not close)."""
        if not complete or not math.isclose(psi[-1] - psi[0], math.tau, rel_tol=1e-12):
            return math.nan, 0
        error = float(self._distance(pose[-1], pose[0]))
        last, turns = pose[-1], 1
        while self._distance(last, pose[0]) > _CLOSED and turns < _TURNS:
            again = track(self.platform, self._input, last, psi, self.Lc)
            if again.failed_at is not None:
                return error, 0
            last, turns = again.pose[-1], turns + 1
        return error, turns if self._distance(last, pose[0]) <= _CLOSED else 0

    def _events(self, tracked: Tracked, barrier: Event | None, leg: Array) -> list[Event]:
        events: list[Event] = []
        psi, end = tracked.parameter, float(tracked.parameter[-1])
        if tracked.failed_at is not None:
            end = tracked.failed_at
            x, y, alpha = (float(value) for value in tracked.last)
            events.append(Event("platform singular", end, 0, True, _SINGULAR, (x, y, alpha)))
        elif barrier is not None:
            end = barrier.psi
            events.append(barrier)
        for number, drive in enumerate(self.drives, start=1):
            for angle in drive.dead_points():
                at = float(psi[0]) + (angle - float(psi[0])) % math.tau
                if at <= end:
                    text = f"crank and coupler {number} in line: the rocker reverses"
                    events.append(Event("rocker dead point", at, number, False, text))
        for index, k in zip(*np.nonzero(np.sign(leg[1:]) != np.sign(leg[:-1]))):
            text = f"leg {k + 1} passes its boundary: the working mode changes"
            at = _crossing(psi[index : index + 2], leg[index : index + 2, k])
            events.append(Event("leg boundary", at, int(k) + 1, False, text))
        return events

    def _barrier(self, start: float, stop: float) -> Event | None:
        """First drive lock or change point in (start, stop]: no continuation may step over it."""
        found: list[Event] = []
        for number, drive in enumerate(self.drives, start=1):
            for angle, kind in drive.barriers():
                at = start + (angle - start) % math.tau
                if start < at <= stop:
                    name, text = _BARRIERS[kind]
                    found.append(Event(name, at, number, True, text.format(number)))
        return min(found, key=lambda event: event.psi, default=None)

    def graph(self) -> MechanismGraph:
        """Structural graph of the source's Figure 3: 15 links, 19 turning pairs, 3 gear pairs, link 0 the frame."""
        from graphsynth.structure.graph import MechanismGraph

        joints = [
            (*map(int, pair.split("-")), mobility)
            for text, mobility in ((_TURNING, 1), (_GEARED, 2))
            for pair in text.split()
        ]
        return MechanismGraph(15, [(a, b, f) for a, b, f in joints], frame=0)


def mismatch_events(psi: Array, mismatch: NDArray[np.bool_]) -> list[Event]:
    """One event for every sample at which the tracked pose is not among the computed assembly modes."""
    text = "the tracked pose is not one of the computed assembly modes"
    return [Event("mode mismatch", float(psi[k]), 0, False, text) for k in np.flatnonzero(mismatch)]


def _crossing(psi: Array, value: Array) -> float:
    """Zero of the chord between two samples (estimated)."""
    return float(psi[0] - value[0] * (psi[1] - psi[0]) / (value[1] - value[0]))


def _increasing(samples: int | ArrayLike) -> Array:
    if isinstance(samples, int | np.integer):
        if samples < 2:
            raise GeometryError(f"samples = {samples} is too few for a turn; give 2 or more, or an array of angles")
        return np.linspace(0.0, math.tau, int(samples))
    psi = finite_array("samples", samples).ravel()
    if psi.size < 2 or bool(np.any(np.diff(psi) <= 0.0)):
        raise GeometryError("samples must hold two or more increasing wheel angles")
    return psi


def _directions(angles: Triple) -> NDArray[np.complex128]:
    """``exp(i beta)`` with multiples of 30 degrees rounded correctly."""
    twelfths = [round(angle * 6.0 / math.pi) for angle in angles]
    table = [0.0, 0.5, 0.5 * math.sqrt(3.0), 1.0, 0.5 * math.sqrt(3.0), 0.5]

    def sine(k: int) -> float:
        k %= 12
        return table[k] if k < 6 else -table[k - 6]

    return np.array(
        [
            complex(sine(k + 3), sine(k)) if abs(angle - k * math.pi / 6.0) < 1e-15 else np.exp(1j * angle)
            for k, angle in zip(twelfths, angles)
        ]
    )
