"""The braider as a whole: linkage, switch with thread, train, synchronous motor; its motion and its reactions."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from graphsynth.core.checks import (
    check_fields,
    check_sizes,
    checked,
    finite,
    finite_array,
    not_negative,
    positive,
    whole,
)
from graphsynth.core.errors import SpecError
from graphsynth.dynamics.driven.reduction import ReductionStudy, inductance_study, simulate_drive
from graphsynth.dynamics.driven.run import DriveRun, RunStatus
from graphsynth.dynamics.driven.setup import DriveOptions, Plant
from graphsynth.dynamics.elements import Element, Force, MotorDrive
from graphsynth.dynamics.model import Body, DynamicModel
from graphsynth.dynamics.motors import IdealSpeed, LinearCharacteristic, Motor, SynchronousMotor, Train, check_motor
from graphsynth.mechanism.joints import Revolute
from graphsynth.mechanism.laws import Driver
from graphsynth.mechanism.model import Mechanism, TracePoint
from graphsynth.structure.graph import MechanismGraph
from graphsynth.systems.braider.linkage import ChangePoint, FourBar

if TYPE_CHECKING:
    from graphsynth.kinematics.engine.result import Motion

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Thread:
    """Thread from the switch tip over a guide point; a weight keeps its tension (theory/braider 3).

    Parameters
    ----------
    weight : float
        Mass of the weight, kg, not negative.
    guide : complex
        Guide point in the plane of the linkage, m.
    height : float
        Of the guide point above the plane of the switch, m, not negative.
    gravity : float
        m/s^2.

    Raises
    ------
    SpecError
        Negative or infinite numbers, a guide that is no point.

    Examples
    --------
    >>> round(float(abs(Thread().force(0.06 + 0.08j))), 9)
    0.034671744
    """

    weight: float = 0.005
    guide: complex = 0.060 + 0j
    height: float = 0.080
    gravity: float = 9.80665

    def __post_init__(self) -> None:
        for name in ("weight", "height", "gravity"):
            object.__setattr__(self, name, not_negative(name, getattr(self, name), SpecError))
        try:
            point = complex(self.guide)
        except (TypeError, ValueError, OverflowError):
            raise SpecError(f"guide = {self.guide!r} is no point; give x + 1j * y in metres") from None
        object.__setattr__(
            self, "guide", complex(finite("guide x", point.real, SpecError), finite("guide y", point.imag, SpecError))
        )
        check_fields(self, (), SpecError, small=("weight", "height", "gravity", "guide"))

    @checked
    def force(self, tip: ArrayLike) -> NDArray[np.complex128]:
        """Force (N, complex) on the switch tip at points ``tip`` (complex, m)."""
        reach = self.guide - np.asarray(tip, dtype=np.complex128)
        return np.asarray(self.weight * self.gravity * reach / np.sqrt(np.abs(reach) ** 2 + self.height**2))


class LinkMotion(NamedTuple):
    """Angular velocities (rad/s) and accelerations (rad/s^2) of crank, coupler, rocker (n, 3)."""

    speed: Array
    acceleration: Array


class Settling(NamedTuple):
    """First time (s) after which the speed stays in the band around the target; NaN if it never does."""

    time: float
    target: float
    band: float


class Peak(NamedTuple):
    """Time (s) and value of an extreme; ``error``, an estimate from above, is its distance from the nearest sample."""

    time: float
    value: float
    error: float


_MOTOR = SynchronousMotor(4, 2.0, 1e-3, 5e-3, 0.0, 2.1013, rotor_inertia=8.2e-6, friction=1e-6)
_TRAIN = Train.of_teeth([(10, 44), (10, 33), (20, 80)])


@dataclass(frozen=True, eq=False)
class Braider:
    """Braiding mechanism (theory/braider); the default numbers are those of theory/braider 1.

    Parameters
    ----------
    linkage : FourBar
    switch : float
        Length r of the switch O2C, rigid with the rocker, m.
    switch_angle : float
        From rocker to switch, rad.
    masses : tuple of 4 floats
        Crank, coupler, rocker, switch; uniform bars, kg, not negative.
    thread : Thread
    motor : SynchronousMotor, DCMotor, LinearCharacteristic, IdealTorque or IdealSpeed
    train : Train
    inertia : float
        Further constant inertia at the crank, kg m^2.

    Raises
    ------
    SpecError
        Negative masses or lengths, numbers that are not finite.

    Examples
    --------
    >>> run = Braider().simulate([0.0, 0.11])
    >>> round(float(run.speed[-1]), 9)
    1.769031244
    """

    linkage: FourBar = field(default_factory=FourBar)
    switch: float = 0.035
    switch_angle: float = 5.0 * math.pi / 6.0
    masses: tuple[float, float, float, float] = (0.015, 0.045, 0.030, 0.020)
    thread: Thread = field(default_factory=Thread)
    motor: Motor | IdealSpeed = _MOTOR
    train: Train = _TRAIN
    inertia: float = 0.0

    def __post_init__(self) -> None:
        object.__setattr__(self, "switch", not_negative("switch", self.switch, SpecError))
        object.__setattr__(self, "switch_angle", finite("switch_angle", self.switch_angle, SpecError))
        object.__setattr__(self, "inertia", not_negative("inertia", self.inertia, SpecError))
        names = ("crank", "coupler", "rocker", "switch")
        if not isinstance(self.linkage, FourBar) or not isinstance(self.thread, Thread):
            raise SpecError("linkage and thread must be a FourBar and a Thread; make them first")
        if not isinstance(self.train, Train):
            raise SpecError(f"train = {self.train!r} is not a Train; give Train(ratio) or Train.of_teeth(stages)")
        check_motor(self.motor)
        masses = tuple(self.masses) if isinstance(self.masses, Iterable) else (self.masses,)
        if len(masses) != 4:
            raise SpecError(f"{len(masses)} masses given; give four: {', '.join(names)}")
        checked = tuple(not_negative(f"mass of the {n}", m, SpecError) for n, m in zip(names, masses))
        object.__setattr__(self, "masses", checked)
        check_fields(self, (), SpecError, small=("switch", "inertia"))
        check_sizes("Braider", {f"mass of the {n}": m for n, m in zip(names, checked)}, SpecError)

    @property
    def moments(self) -> tuple[float, float, float]:
        """I1 (about the centre), I2 (about the centre), I3 (rocker and switch about O2), kg m^2."""
        m1, m2, m3, m4 = self.masses
        bar = self.linkage
        return m1 * bar.crank**2 / 12.0, m2 * bar.coupler**2 / 12.0, (m3 * bar.rocker**2 + m4 * self.switch**2) / 3.0

    @property
    def reflected_inertia(self) -> float:
        """Rotor and train at the crank, ``G^2 J_m`` and more, kg m^2."""
        return self.train.reflected(self.motor.rotor_inertia) + self.inertia

    def plant(self) -> Plant:
        """Mechanism as the integrator sees it."""
        return Plant(np.zeros((1, 1)), base=self.inertia, linkage=self.linkage.parameters(self._parameters()))

    def _parameters(self) -> tuple[float, ...]:
        """Parameters of the kernel `four_bar` besides the linkage: switch, masses and moments, thread."""
        angle, thread = self.switch_angle, self.thread
        place = thread.guide.real, thread.guide.imag, thread.height
        arm = self.switch, math.cos(angle), math.sin(angle)
        return *arm, *self.masses[:2], *self.moments[1:], thread.weight * thread.gravity, *place

    @property
    def bodies(self) -> dict[int, Body]:
        """Crank, coupler, and rocker with switch, as links 1 to 3 along their bars."""
        bar, (m1, m2, m3, m4) = self.linkage, self.masses
        rocker, switch = Body.bar(m3, (0.0, 0.0), (bar.rocker, 0.0)), Body.bar(m4, (0.0, 0.0), self._tip)
        return {
            1: Body.bar(m1, (0.0, 0.0), (bar.crank, 0.0)),
            2: Body.bar(m2, (0.0, 0.0), (bar.coupler, 0.0)),
            3: Body.combined(rocker, switch) if m3 + m4 > 0.0 else Body(0.0, 0.0),
        }

    @property
    def _tip(self) -> tuple[float, float]:
        return self.switch * math.cos(self.switch_angle), self.switch * math.sin(self.switch_angle)

    @property
    def mechanism(self) -> Mechanism:
        """The linkage as a planar mechanism: frame 0, crank 1 (driver), coupler 2, rocker 3 with the tip C."""
        bar = self.linkage
        return Mechanism(
            MechanismGraph(4, [(0, 1), (1, 2), (2, 3), (0, 3)], frame=0),
            (
                Revolute(0, 1),
                Revolute(1, 2, (bar.crank, 0.0)),
                Revolute(2, 3, (bar.coupler, 0.0), (bar.rocker, 0.0)),
                Revolute(0, 3, (bar.frame, 0.0)),
            ),
            drivers=(Driver(0, 1),),
            points={"C": TracePoint(3, self._tip)},
        )

    def model(self, *, motor: bool = True) -> DynamicModel:
        """Return the braider as a dynamic model, thread and motor among its elements, for every form and integrator.

        ``modes={0: linkage.branch}`` names its assembly mode.  An ideal speed is the driver's: only its inertia is
        an element.

        Examples
        --------
        >>> from graphsynth.dynamics import simulate_dynamics
        >>> motion = simulate_dynamics(Braider().model(), [0.0, 0.01], keep={(0, 1): 0.0}, modes={0: 1})
        >>> round(float(motion.velocities[-1, 1, 2]), 9)
        0.537673535
        """

        def thread(t: float, place: tuple[float, float], velocity: tuple[float, float]) -> tuple[float, float]:
            force = complex(self.thread.force(complex(*place)))
            return force.real, force.imag

        elements: list[Element] = [Force(3, thread, self._tip)] if self.thread.weight else []
        if motor:
            train = replace(self.train, inertia=self.train.inertia + self.inertia)
            source = self.motor
            if isinstance(source, IdealSpeed):
                source = LinearCharacteristic(0.0, 0.0, source.rotor_inertia, source.friction)
            elements.append(MotorDrive(0, 1, source, train))
        return DynamicModel(self.mechanism, self.bodies, elements, gravity=(0.0, 0.0))

    def motion(self, theta: ArrayLike) -> Motion:
        """Motion of the linkage at crank angles (n,), in closed form; NaN where it cannot be assembled."""
        from graphsynth.pipeline.display import shown_motion

        angle = np.atleast_1d(finite_array("theta", theta, nan=True))
        s = self.linkage.motion(angle)
        states = np.zeros((3, angle.size, 4, 3))  # poses and two derivatives by the crank angle
        states[0, :, 1, 2], states[1, :, 1, 2] = angle, 1.0
        pin = np.multiply.outer([1.0, 1j, -1.0], s.crank)
        states[:, :, 2, 0], states[:, :, 2, 1] = pin.real, pin.imag
        states[:, :, 2, 2] = np.unwrap(s.phi2), s.k2, s.f2
        states[:, :, 3, 2] = np.unwrap(s.phi3), s.k3, s.f3
        states[0, :, 3, 0] = self.linkage.frame
        closed = angle.size > 1 and abs(angle[-1] - angle[0] - math.tau) < 1e-12 and bool(np.isfinite(states).all())
        shown = shown_motion(self.mechanism, angle, states[0], closed=closed)
        return replace(shown, velocities=states[1], accelerations=states[2])

    def tip(self, theta: ArrayLike) -> NDArray[np.complex128]:
        """Position of the switch tip C, complex, m."""
        return np.asarray(self.linkage.frame + self._arm(theta))

    def _arm(self, theta: ArrayLike) -> NDArray[np.complex128]:
        rocker = self.linkage.motion(theta).rocker
        return np.asarray(self.switch / self.linkage.rocker * np.exp(1j * self.switch_angle) * rocker)

    def load_moment(self, theta: ArrayLike) -> Array:
        """Moment of the thread about O2 on the switch, N m (signed)."""
        arm = self._arm(theta)
        return np.asarray((np.conj(arm) * self.thread.force(self.linkage.frame + arm)).imag)

    def effective_inertia(self, theta: ArrayLike) -> tuple[Array, Array]:
        """J at the crank with the reflected rotor, and dJ/dtheta; kg m^2."""
        J, half = self.linkage.table(finite_array("theta", theta, nan=True), self._parameters())[:2]
        return np.asarray(self.reflected_inertia + J), np.asarray(2.0 * half)

    def acceleration(self, theta: ArrayLike, speed: ArrayLike, motor_torque: ArrayLike) -> Array:
        """Crank acceleration for a motor torque (N m) at the driving shaft, rad/s^2."""
        w, torque = finite_array("speed", speed, nan=True), finite_array("motor_torque", motor_torque, nan=True)
        J, slope = self.effective_inertia(theta)
        eta = np.where(torque * w >= 0.0, self.train.efficiency, 1.0 / self.train.efficiency)
        friction = self.train.ratio**2 * self.motor.friction * w
        load = self.load_moment(theta) * self.linkage.motion(theta).k3
        return np.asarray((self.train.ratio * eta * torque - friction + load - 0.5 * slope * w * w) / J)

    @checked
    def simulate(
        self,
        times: ArrayLike,
        *,
        angle: float = 0.0,
        speed: float = 0.0,
        currents: tuple[float, ...] | None = None,
        reduce: bool | str = "auto",
        rtol: float = 1e-10,
        estimate: bool = True,
        max_steps: int = 200_000,
    ) -> DriveRun:
        """Motion from ``times[0]``; the arguments are those of `MotorDrivenPlatform.simulate`.

        A motion that reaches a change point of the linkage ends there with the status CHANGE_POINT: no continuation
        is chosen silently.  A crank that meets the end of its reach ends with NOT_FINITE or STEP_TOO_SMALL.

        Raises
        ------
        SpecError
            Options or numbers that make no sense, L = 0 with the unreduced model, a start out of reach.
        """
        if not math.isfinite(float(self.linkage.motion(finite("angle", angle, SpecError)).k3)):
            raise SpecError(f"the linkage cannot be assembled at angle = {angle:g} rad; start within linkage.reach()")
        options = DriveOptions(angle, speed, currents, False, rtol, estimate, max_steps)
        found = simulate_drive(self.plant(), self.motor, self.train, times, reduce, options)
        for point in self.linkage.change_points():
            turns = np.floor((found.angle - point.theta) / math.tau)
            beyond = np.flatnonzero((turns != turns[0]) & np.isfinite(found.angle))
            if beyond.size:
                return _cut(found, int(beyond[0]), point)
        return found

    @checked
    def inductance_study(self, times: ArrayLike, inductances: tuple[float, ...]) -> ReductionStudy:
        """Distance to the limit L -> 0 for several inductances (theory/braider 6), from rest."""
        return inductance_study(self.plant(), self.motor, self.train, times, inductances)

    def link_motion(self, found: DriveRun) -> LinkMotion:
        """Angular velocities and accelerations of crank, coupler and rocker along a run."""
        s, w = self.linkage.motion(found.angle), found.speed
        alpha = self.acceleration(found.angle, w, found.motor_torque)
        speed = np.stack([w, s.k2 * w, s.k3 * w], axis=-1)
        return LinkMotion(speed, np.stack([alpha, s.f2 * w * w + s.k2 * alpha, s.f3 * w * w + s.k3 * alpha], axis=-1))

    @checked
    def steady_range(self, turns: int = 1, rtol: float = 1e-11, samples: int = 720) -> tuple[float, float]:
        """Least and largest crank speed over whole turns after the start-up, rad/s; estimated, NaN if a run fails.

        The extremes of ``samples`` output times per turn: their error falls with the square of the number.
        """
        first = self.simulate([0.0, 2.0], rtol=rtol, estimate=False)
        if not first.complete:
            return math.nan, math.nan
        period = math.tau / float(first.speed[-1])
        times = np.concatenate([[0.0], 2.0 + np.linspace(0.0, 1.02 * turns * period, samples * turns + 1)])
        found = self.simulate(times, rtol=rtol, estimate=False)
        speed = found.speed[1:]
        return float(speed.min()), float(speed.max())

    def largest_current(self, found: DriveRun) -> Peak:
        """Largest torque-making current of a run, between its output times.

        Estimated: a finer run beside the largest output, the vertex of the parabola through three of its outputs.

        Examples
        --------
        >>> braider = Braider()
        >>> peak = braider.largest_current(braider.simulate(np.linspace(0.0, 0.1, 51)))
        >>> round(peak.time, 5), round(peak.value, 4)
        (0.00206, 0.9915)
        """
        if not found.complete or found.currents.shape[1] == 0:
            return Peak(math.nan, math.nan, math.nan)
        k = int(np.argmax(np.abs(found.currents[:, -1])))
        if k in (0, found.time.size - 1):
            return Peak(float(found.time[k]), float(found.currents[k, -1]), math.nan)
        near = np.linspace(found.time[k - 1], found.time[k + 1], 401)
        start: dict[str, Any] = {name: getattr(found, name)[k - 1] for name in ("angle", "speed", "currents")}
        fine = self.simulate(near, **start, reduce=False, rtol=found.rtol, estimate=False)
        best = min(max(int(np.argmax(np.abs(fine.currents[:, -1]))), 1), near.size - 2)
        left, middle, right = fine.currents[best - 1 : best + 2, -1]
        bend = left - 2.0 * middle + right
        shift = 0.5 * (left - right) / bend if bend != 0.0 else 0.0
        lift = -0.125 * (right - left) ** 2 / bend if bend != 0.0 else 0.0
        time = fine.time[best] + shift * (fine.time[best + 1] - fine.time[best])
        return Peak(float(time), float(middle + lift), abs(float(lift)))

    @checked
    def settling(
        self, target: float, band: float = 0.02, end: float = 0.5, rtol: float = 1e-11, samples: int = 2001
    ) -> Settling:
        """First time after which ``|w / target - 1| <= band`` up to ``end``, from rest.

        The last crossing between samples is solved on the cubic through speeds and accelerations.

        Raises
        ------
        SpecError
            For ``target = 0``.
        """
        positive("band", band, SpecError)
        if finite("target", target, SpecError) == 0.0:
            raise SpecError("target = 0 has no relative band; give the speed that is to be reached, rad/s")
        count, last = whole("samples", samples, 1, error=SpecError), positive("end", end, SpecError)
        times = np.linspace(0.0, last, count)
        found = self.simulate(times, rtol=rtol, estimate=False)
        outside = np.nonzero(~(np.abs(found.speed / target - 1.0) <= band))[0]
        if not found.complete or outside.size == 0 or outside[-1] == times.size - 1:
            return Settling(0.0 if outside.size == 0 else math.nan, target, band)
        from scipy.interpolate import CubicHermiteSpline
        from scipy.optimize import brentq

        k = int(outside[-1])
        slopes = self.acceleration(found.angle, found.speed, found.motor_torque)[k : k + 2]
        curve = CubicHermiteSpline(times[k : k + 2], found.speed[k : k + 2], slopes)
        edge = target * (1.0 + math.copysign(band, found.speed[k] / target - 1.0))
        return Settling(float(brentq(lambda t: float(curve(t)) - edge, times[k], times[k + 1])), target, band)


def _cut(found: DriveRun, row: int, point: ChangePoint) -> DriveRun:
    """Run with NaN from ``row`` on, ended by a change point."""
    said = "; ".join(f"branch {b:+d}: k2 = {k[0]:.6g}, k3 = {k[1]:.6g}" for b, k in point.ratios.items())
    reason = (
        f"the linkage passes a change point at theta = {point.theta:.12g} rad (modulo a turn), where both modes meet "
        f"({said}); choose the branch and start again behind it"
    )
    arrays = {}
    for name in ("angle", "speed", "currents", "reduced_angle", "momentum", "motor_torque", "kinetic_energy", "work"):
        values = getattr(found, name).copy()
        values[row:] = np.nan
        arrays[name] = values
    return replace(found, status=RunStatus.CHANGE_POINT, reached=row, reason=reason, **arrays)
