"""The motor-driven platform: one motor, one train, the effective inertia of the platform; models J, S and reduced."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from graphsynth.dynamics.motors import DCMotor, IdealSpeed, LinearCharacteristic, Motor, SynchronousMotor, number
from graphsynth.dynamics.platform_drive.inertia import EffectiveInertia
from graphsynth.dynamics.platform_drive.run import DriveRun, Plant, run
from graphsynth.dynamics.trains import Train
from graphsynth.errors import SpecError

if TYPE_CHECKING:
    from graphsynth.kinematics.single_motor_platform import SingleMotorPlatform

__all__ = ["MotorDrivenPlatform", "ReductionStudy", "linear_response"]

Array = NDArray[np.float64]
_SPIKES = "no rotor inertia: model S; the crank speed is unbounded at dead centres, an artefact of the missing inertia"


@dataclass(frozen=True, eq=False)
class ReductionStudy:
    """Distance of the full model from the limit L -> 0 for several inductances, and the order that it shows.

    ``angle`` and ``speed`` are the largest differences over the output times from ``after`` on; ``order`` (n - 1,) the
    slopes of the speed difference between neighbours, 1 where the limit is of first order.
    """

    inductance: Array
    angle: Array
    speed: Array
    order: Array
    steps: NDArray[np.int64]
    limit: DriveRun


@dataclass(frozen=True, eq=False)
class MotorDrivenPlatform:
    """A motor that drives a mechanism of one freedom with effective inertia ``J_0 + J(q)``.

    Parameters
    ----------
    inertia : EffectiveInertia
        Of the moving platform (and further links).
    motor : DCMotor, SynchronousMotor, LinearCharacteristic or IdealTorque
    train : Train
        Between motor and crank.
    base_inertia : float
        Constant part of J_0 at the crank beside the reflected rotor and the train, kg m^2 (wheels, pinion).
    friction : float
        Viscous, at the crank, N m s/rad.
    load : float
        Constant load torque at the crank, N m; positive when it brakes motion towards increasing q.
    load_series : array_like, optional
        Further load torque as ``a0, a1, b1, ...`` of ``a0 + a1 cos q + b1 sin q + ...``, braking like ``load``.

    Raises
    ------
    SpecError
        Negative inertia or friction, numbers that are not finite.

    Notes
    -----
    Specification parallel_platform, section 11; the source is ``MotorDrivenPlatform.source``.

    Examples
    --------
    >>> motor = DCMotor(1.0, 0.2, 0.1, 0.1, gain=20.0, speed=20.0)
    >>> motion = MotorDrivenPlatform.source(motor).simulate([0.0, 0.1])
    >>> motion.complete, round(float(motion.speed[-1]), 9)
    (True, 11.711831447)
    """

    inertia: EffectiveInertia
    motor: Motor
    train: Train = field(default_factory=Train)
    base_inertia: float = 0.0
    friction: float = 0.0
    load: float = 0.0
    load_series: ArrayLike | None = None

    def __post_init__(self) -> None:
        for name in ("base_inertia", "friction"):
            object.__setattr__(self, name, number(name, getattr(self, name), least=0.0))
        object.__setattr__(self, "load", number("load", self.load))
        if isinstance(self.motor, IdealSpeed):
            raise SpecError("an ideal speed source has no motion to integrate; use torque_at_speed on any platform")

    @classmethod
    def source(
        cls, motor: Motor, *, mass: float = 2.0, amplitude: float = 0.05, base_inertia: float = 0.002
    ) -> MotorDrivenPlatform:
        """Model of the source: ``J = J_0 + m L^2 cos(q)^2``, crank coupled directly to the motor."""
        return cls(EffectiveInertia.of_slider(mass, amplitude), motor, base_inertia=base_inertia)

    @classmethod
    def of_machine(
        cls, machine: SingleMotorPlatform, motor: Motor, *, mass: float, gyration: float, mass_centre: complex = 0.0,
        rocker_inertia: Sequence[float] = (0.0, 0.0, 0.0), wheel_inertia: float = 0.0, pinion_inertia: float = 0.0,
        efficiency: float = 1.0, friction: float = 0.0, load: float = 0.0, length: float = 1e-3,
    ) -> MotorDrivenPlatform:  # fmt: skip
        """Real geometry: ``J_0 = N_g^2 (J_rotor + J_pinion) + 3 J_wheel``, ``N_g = z2/z1`` of the gears."""
        series = EffectiveInertia.of_platform(
            machine, mass, gyration, mass_centre, rocker_inertia=rocker_inertia, length=length
        )
        ratio = machine.gears.z2 / machine.gears.z1
        own = ratio**2 * number("pinion_inertia", pinion_inertia, least=0.0)
        own += 3.0 * number("wheel_inertia", wheel_inertia, least=0.0)
        return cls(series, motor, Train(ratio, efficiency, own), 0.0, friction, load)

    @property
    def constant_inertia(self) -> float:
        """J_0: base inertia, train and reflected rotor, kg m^2."""
        return self.base_inertia + self.train.reflected(self.motor.rotor_inertia)

    def plant(self) -> Plant:
        """The mechanism as the integrator sees it (load torques with the sign of driving)."""
        series = None if self.load_series is None else -np.asarray(self.load_series, dtype=np.float64)
        return Plant(
            self.inertia.rows, self.base_inertia, self.friction, -self.load, series,
            dead_centres=self.inertia.dead_centres,
        )  # fmt: skip

    def simulate(
        self, times: ArrayLike, *, angle: float = 0.0, speed: float = 0.0, currents: tuple[float, ...] | None = None,
        model: str = "auto", reduce: bool | str = "auto", rtol: float = 1e-10, estimate: bool = True,
        max_steps: int = 200_000,
    ) -> DriveRun:  # fmt: skip
        """Motion from ``times[0]``.

        Parameters
        ----------
        times : array_like, shape (n,)
            Strictly increasing output times, s.
        angle, speed, currents
            State at the start: rad, rad/s, A.
        model : {"auto", "J", "S"}
            With inertia, or the regularised model of the source without; "auto" takes S only where J is singular.
        reduce : {"auto", True, False}
            Replace the motor by its limit L -> 0; "auto" does so for L = 0, and for a small L if the error of first
            order in L is below ``rtol`` (a note says so).
        rtol, estimate, max_steps
            See `graphsynth.dynamics.platform_drive.run.run`.

        Returns
        -------
        DriveRun
            Estimated.  A failure of the integrator is a status with NaN after ``reached``, never an early end.

        Raises
        ------
        SpecError
            Options or numbers that make no sense; what model S cannot have (friction, L = 0, a voltage limit).
        """
        if model not in ("auto", "J", "S"):
            raise SpecError(f"model = {model!r} is unknown; choose 'auto', 'J' or 'S'")
        regular = model == "S" or (
            model == "auto" and self.constant_inertia == 0.0 and bool(self.inertia.dead_centres)
        )
        notes = (_SPIKES,) if regular else ()
        options = {"angle": angle, "speed": speed, "rtol": rtol, "estimate": estimate, "max_steps": max_steps}
        motor = self.motor
        if self._reducible(reduce):
            reduced, bound = self._limit(np.asarray(times, dtype=np.float64), reduce, regular, options)
            if reduced is not None:
                motor, currents, notes = reduced, None, (*notes, bound)
        return run(
            self.plant(), motor, self.train, times, angle=angle, speed=speed, currents=currents, regular=regular,
            rtol=rtol, estimate=estimate, max_steps=max_steps, notes=notes,
        )  # fmt: skip

    def _reducible(self, reduce: bool | str) -> bool:
        if reduce not in (True, False, "auto"):
            raise SpecError(f"reduce = {reduce!r} is unknown; choose 'auto', True or False")
        if not isinstance(self.motor, (DCMotor, SynchronousMotor)):
            return False
        if self.motor.inductance == 0.0 and reduce is False:
            raise SpecError("inductance = 0 with the unreduced model divides by zero; set reduce = True or 'auto'")
        return bool(reduce)

    def _limit(
        self, times: Array, reduce: bool | str, regular: bool, options: dict[str, float]
    ) -> tuple[LinearCharacteristic | None, str]:
        """Motor of the limit, with its error; None when the true inductance has to be kept."""
        motor = self.motor
        if not isinstance(motor, (DCMotor, SynchronousMotor)):
            return None, ""
        if motor.inductance == 0.0:
            return motor.reduced(), "inductance 0: the reduced model, exact"
        span = float(times[-1] - times[0])
        if reduce == "auto" and (
            regular or not motor.electrical_time <= options["rtol"] * span
            or (isinstance(motor, DCMotor) and motor.voltage_limit < math.inf)
        ):  # fmt: skip
            return None, ""
        error = self.reduction_error(times, angle=options["angle"], speed=options["speed"])
        if reduce == "auto" and error > options["rtol"]:
            return None, ""
        return motor.reduced(), f"reduced to L -> 0; estimated error of the angle {error:.1e} rad, of first order in L"

    def reduction_error(self, times: ArrayLike, *, angle: float = 0.0, speed: float = 0.0) -> float:
        """Largest error of the angle (rad) of the limit L -> 0 after the electrical transient; estimated.

        From a run at an inductance large enough to be seen, scaled down linearly.
        """
        motor = self.motor
        if not isinstance(motor, (DCMotor, SynchronousMotor)) or motor.inductance == 0.0:
            return 0.0
        out = np.asarray(times, dtype=np.float64)
        factor = max(1.0, 1e-5 * float(out[-1] - out[0]) / motor.electrical_time)
        seen = replace(motor, inductance=factor * motor.inductance)
        found = replace(self, motor=seen).inductance_study(
            out, [seen.inductance], angle=angle, speed=speed, rtol=1e-11
        )
        return float(found.angle[0]) / factor

    def inductance_study(
        self, times: ArrayLike, inductances: Sequence[float], *, angle: float = 0.0, speed: float = 0.0,
        after: float | None = None, rtol: float = 1e-12,
    ) -> ReductionStudy:  # fmt: skip
        """Compare the full model at several inductances (H) with the limit L -> 0 (section 11.4).

        ``after`` excludes times within the electrical transient (default: twenty time constants of each inductance).

        Raises
        ------
        SpecError
            For a motor without inductance, or an inductance that is not positive.
        """
        if not isinstance(self.motor, (DCMotor, SynchronousMotor)):
            raise SpecError(f"{type(self.motor).__name__} has no inductance; give a DCMotor or a SynchronousMotor")
        out = np.asarray(times, dtype=np.float64)
        limit = run(self.plant(), self.motor.reduced(), self.train, out, angle=angle, speed=speed, rtol=rtol,
                    estimate=False)  # fmt: skip
        rows, steps = [], []
        for value in inductances:
            motor = replace(self.motor, inductance=number("inductance", value, least=0.0, above=True))
            full = run(self.plant(), motor, self.train, out, angle=angle, speed=speed, rtol=rtol, estimate=False)
            begin = 20.0 * motor.electrical_time if after is None else after
            late = out - out[0] >= begin
            if not late.any():
                raise SpecError(f"all output times lie within {begin:.3g} s, the electrical transient; give later times")
            rows.append([np.abs(a - b)[late].max() for a, b in ((full.angle, limit.angle), (full.speed, limit.speed))])
            steps.append(full.steps)
        gaps, sizes = np.array(rows).reshape(-1, 2), np.array(inductances, dtype=np.float64)
        with np.errstate(divide="ignore", invalid="ignore"):
            order = np.diff(np.log(gaps[:, 1])) / np.diff(np.log(sizes))
        return ReductionStudy(sizes, gaps[:, 0], gaps[:, 1], order, np.array(steps), limit)

    def torque_at_speed(self, q: ArrayLike, speed: float) -> Array:
        """Torque at the crank that keeps a constant crank speed (rad/s): ``J'(q) w^2 / 2 + b w + load``, N m.

        The answer for an ideal speed source; no differential equation is solved.

        Examples
        --------
        >>> platform = MotorDrivenPlatform.source(LinearCharacteristic(1.0))
        >>> platform.torque_at_speed([0.0, 0.7], 20.0).round(6).tolist()
        [0.0, -0.98545]
        """
        w, angle = number("speed", speed), np.asarray(q, dtype=np.float64)
        load = np.full(angle.shape, self.load)
        if self.load_series is not None:
            load += EffectiveInertia(np.atleast_2d(self.load_series)).components(angle)[0][0]
        friction = self.friction + self.train.ratio**2 * self.motor.friction
        return np.asarray(0.5 * self.inertia.derivative(angle) * w * w + friction * w + load)


def linear_response(motor: DCMotor, inertia: float, times: ArrayLike, train: Train | None = None) -> tuple[Array, Array]:
    """Speed and current of a DC motor with a constant inertia at the crank, from rest: closed form.

    Parameters
    ----------
    motor : DCMotor
        Without friction and voltage limit; its own rotor inertia is added.
    inertia : float
        J_0 at the crank, kg m^2.
    times : array_like
        Times since the start, s.
    train : Train, optional
        Direct coupling by default.

    Returns
    -------
    w, I : ndarray
        rad/s at the crank and A; exact but for rounding, also in the critical and the overdamped case.

    Raises
    ------
    SpecError
        No inertia, no inductance, friction or a voltage limit.

    Notes
    -----
    Specification parallel_platform, section 14.10.

    Examples
    --------
    >>> motor = DCMotor(1.0, 0.2, 0.1, 0.1, gain=20.0, speed=20.0)
    >>> [round(float(x[0]), 9) for x in linear_response(motor, 0.002, [0.01])]
    [4.719206188, 18.547829748]
    """
    gear = train or Train()
    total = number("inertia", inertia, least=0.0) + gear.reflected(motor.rotor_inertia)
    if total == 0.0 or motor.inductance == 0.0:
        raise SpecError(f"inertia = {total:g} and inductance = {motor.inductance:g} must both be positive here")
    if motor.friction > 0.0 or motor.voltage_limit < math.inf:
        raise SpecError("the closed form has neither friction nor a voltage limit; use simulate")
    if gear.efficiency < 1.0:
        raise SpecError(f"efficiency = {gear.efficiency:g} changes with the power flow; use simulate, or efficiency 1")
    t = np.asarray(times, dtype=np.float64)
    feedback = motor.gain + motor.emf_constant
    a = motor.resistance / (2.0 * motor.inductance)
    square = gear.ratio**2 * motor.torque_constant * feedback / (motor.inductance * total)
    final = motor.gain * motor.speed / feedback / gear.ratio
    decay, sine = _damped(a, a * a - square, t)
    current = final * total / (gear.ratio * motor.torque_constant) * square * sine
    return np.asarray(final * (1.0 - decay - a * sine)), np.asarray(current)


def _damped(a: float, excess: float, t: Array) -> tuple[Array, Array]:
    """``exp(-a t) cosh(s t)`` and ``exp(-a t) sinh(s t)/s`` with ``s^2 = excess`` of either sign."""
    s = math.sqrt(abs(excess))
    if excess < 0.0:
        return np.exp(-a * t) * np.cos(s * t), np.exp(-a * t) * t * np.sinc(s * t / math.pi)
    small = s * t < 1e-4
    slow, fast = np.exp((s - a) * t), np.exp(-(s + a) * t)
    with np.errstate(divide="ignore", invalid="ignore"):
        ratio = np.where(small, np.exp(-a * t) * t * (1.0 + (s * t) ** 2 / 6.0), -slow * np.expm1(-2.0 * s * t) / (2.0 * s))
    return 0.5 * (slow + fast), np.asarray(ratio)
