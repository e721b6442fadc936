"""The motor-driven platform: one motor, one train, the effective inertia of the platform; models J, S and reduced."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from graphsynth.core.checks import check_fields, finite, finite_array, not_negative
from graphsynth.core.errors import GeometryError, SpecError
from graphsynth.dynamics.driven.inertia import EffectiveInertia
from graphsynth.dynamics.driven.reduction import ReductionStudy, inductance_study, reduction_error, simulate_drive
from graphsynth.dynamics.driven.run import DriveRun
from graphsynth.dynamics.driven.setup import DriveOptions, Plant, load_coefficients
from graphsynth.dynamics.motors import IdealSpeed, Motor, Train, check_motor

if TYPE_CHECKING:
    from graphsynth.systems.platform.motion import Sweep
    from graphsynth.systems.platform.single_motor_platform import SingleMotorPlatform

Array = NDArray[np.float64]
_SAMPLES = (128, 256, 512, 1024, 2048, 4096)  # of a rotation
_SPIKES = "no rotor inertia: model S; the crank speed is unbounded at dead centres, an artefact of the missing inertia"


@dataclass(frozen=True, eq=False)
class MotorDrivenPlatform:
    """A motor that drives a mechanism of one freedom with effective inertia ``J_0 + J(q)``.

    Parameters
    ----------
    inertia : EffectiveInertia
        Of the moving platform (and further links).
    motor : DCMotor, SynchronousMotor, LinearCharacteristic, IdealTorque or IdealSpeed
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
    See theory/motor-drive; the source is ``MotorDrivenPlatform.source``.

    Examples
    --------
    >>> from graphsynth.dynamics.motors import DCMotor
    >>> motor = DCMotor(1.0, 0.2, 0.1, 0.1, gain=20.0, speed=20.0)
    >>> motion = MotorDrivenPlatform.source(motor).simulate([0.0, 0.1])
    >>> motion.complete, round(float(motion.speed[-1]), 9)
    (True, 11.711831447)
    """

    inertia: EffectiveInertia
    motor: Motor | IdealSpeed
    train: Train = field(default_factory=Train)
    base_inertia: float = 0.0
    friction: float = 0.0
    load: float = 0.0
    load_series: ArrayLike | None = None

    def __post_init__(self) -> None:
        for name in ("base_inertia", "friction"):
            object.__setattr__(self, name, not_negative(name, getattr(self, name), SpecError))
        object.__setattr__(self, "load", finite("load", self.load, SpecError))
        check_fields(self, (), SpecError, small=("base_inertia", "friction", "load"))
        if not isinstance(self.inertia, EffectiveInertia):
            raise SpecError(f"inertia = {self.inertia!r} is no EffectiveInertia; use EffectiveInertia.of_slider(...)")
        if self.load_series is not None:
            object.__setattr__(self, "load_series", load_coefficients(self.load_series))
        check_motor(self.motor)

    @classmethod
    def source(
        cls, motor: Motor | IdealSpeed, *, mass: float = 2.0, amplitude: float = 0.05, base_inertia: float = 0.002
    ) -> MotorDrivenPlatform:
        """Model of the source: ``J = J_0 + m L^2 cos(q)^2``, crank coupled directly to the motor."""
        return cls(EffectiveInertia.of_slider(mass, amplitude), motor, base_inertia=base_inertia)

    @classmethod
    def of_machine(
        cls,
        machine: SingleMotorPlatform,
        motor: Motor | IdealSpeed,
        *,
        mass: float,
        gyration: float,
        mass_centre: complex = 0.0,
        wheel_inertia: float = 0.0,
        pinion_inertia: float = 0.0,
        length: float = 1e-3,
    ) -> MotorDrivenPlatform:
        """Real geometry: ``J_0 = N_g^2 (J_rotor + J_pinion) + 3 J_wheel``, ``N_g = z2/z1`` of the gears.

        ``length`` is that of the machine's unit in metres, by default the millimetres of the mock-up.  Inertia of the
        rockers: `platform_inertia`; friction, load and losses of the gears: `dataclasses.replace`.
        """
        series = platform_inertia(machine, mass, gyration, mass_centre, length=length)
        ratio = machine.gears.z2 / machine.gears.z1
        own = ratio**2 * not_negative("pinion_inertia", pinion_inertia, SpecError)
        own += 3.0 * not_negative("wheel_inertia", wheel_inertia, SpecError)
        return cls(series, motor, Train(ratio, inertia=own))

    @property
    def constant_inertia(self) -> float:
        """J_0: base inertia, train and reflected rotor, kg m^2."""
        return self.base_inertia + self.train.reflected(self.motor.rotor_inertia)

    def plant(self) -> Plant:
        """Mechanism as the integrator sees it (load torques with the sign of driving)."""
        series = None if self.load_series is None else -np.asarray(self.load_series, dtype=np.float64)
        dead = self.inertia.dead_centres
        return Plant(self.inertia.rows, self.base_inertia, self.friction, -self.load, series, dead_centres=dead)

    def simulate(
        self,
        times: ArrayLike,
        *,
        angle: float = 0.0,
        speed: float = 0.0,
        currents: tuple[float, ...] | None = None,
        model: str = "auto",
        reduce: bool | str = "auto",
        rtol: float = 1e-10,
        estimate: bool = True,
        max_steps: int = 200_000,
    ) -> DriveRun:
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
            See `graphsynth.dynamics.driven.setup.DriveOptions`.

        Returns
        -------
        DriveRun
            Estimated; for an ideal speed the motion is given and the torque a closed form (`prescribed_run`).  A
            failure of the integrator is a status with NaN after ``reached``, never an early end.

        Raises
        ------
        SpecError
            Options or numbers that make no sense; what model S cannot have (friction, L = 0, a voltage limit).
        """
        if not isinstance(model, str) or model not in ("auto", "J", "S"):
            raise SpecError(f"model = {model!r} is unknown; choose 'auto', 'J' or 'S'")
        regular = model == "S" or (model == "auto" and self.constant_inertia == 0.0 and bool(self.inertia.dead_centres))
        options = DriveOptions(angle, speed, currents, regular, rtol, estimate, max_steps)
        notes = (_SPIKES,) if regular else ()
        return simulate_drive(self.plant(), self.motor, self.train, times, reduce, options, notes)

    def reduction_error(self, times: ArrayLike, *, angle: float = 0.0, speed: float = 0.0) -> float:
        """Largest error of the angle (rad) of the limit L -> 0 after the electrical transient; see `reduction`."""
        return reduction_error(self.plant(), self.motor, self.train, times, DriveOptions(angle, speed))

    def inductance_study(
        self,
        times: ArrayLike,
        inductances: Sequence[float],
        *,
        angle: float = 0.0,
        speed: float = 0.0,
        after: float | None = None,
    ) -> ReductionStudy:
        """Compare the full model at several inductances (H) with the limit L -> 0; see `reduction`."""
        start = DriveOptions(angle, speed)
        return inductance_study(self.plant(), self.motor, self.train, times, inductances, start, after)

    def torque_at_speed(self, q: ArrayLike, speed: float) -> Array:
        """Torque at the crank that keeps a constant crank speed (rad/s): ``J'(q) w^2 / 2 + b w + load``, N m.

        The answer for an ideal speed source; no differential equation is solved.

        Examples
        --------
        >>> from graphsynth.dynamics.motors import IdealTorque
        >>> platform = MotorDrivenPlatform.source(IdealTorque(1.0))
        >>> platform.torque_at_speed([0.0, 0.7], 20.0).round(6).tolist()
        [0.0, -0.98545]
        """
        w, angle = finite("speed", speed, SpecError), finite_array("q", q, nan=True)
        load = np.full(angle.shape, self.load)
        if self.load_series is not None:
            load += EffectiveInertia(np.atleast_2d(self.load_series)).components(angle)[0][0]
        friction = self.friction + self.train.ratio**2 * self.motor.friction
        return np.asarray(0.5 * self.inertia.derivative(angle) * w * w + friction * w + load)


def platform_inertia(
    machine: SingleMotorPlatform,
    mass: float,
    gyration: float,
    mass_centre: complex = 0.0,
    *,
    rocker_inertia: Sequence[float] = (0.0, 0.0, 0.0),
    length: float = 1e-3,
    tolerance: float = 1e-12,
) -> EffectiveInertia:
    """Effective inertia of the platform, and of the rockers, of a single-motor mechanism over a closed rotation.

    `mass`: of the platform, kg. `gyration`: radius of gyration about the mass centre, m. `mass_centre`: in the frame of
    the platform, m. `rocker_inertia`: about the pivots D_k, kg m^2. `length`: metres per length unit of the machine
    (1e-3 for the millimetres of the mock-up). `tolerance`: largest relative truncation of the series. Raises
    `SpecError`: negative masses, or a motion that 4096 samples do not resolve. Raises `GeometryError` if the home
    branch does not make a whole turn.
    """
    m, radius = not_negative("mass", mass, SpecError), not_negative("gyration", gyration, SpecError)
    wheels = [not_negative(f"rocker_inertia {k}", v, SpecError) for k, v in enumerate(rocker_inertia, 1)]
    for count in _SAMPLES:
        sweep = _closed_sweep(machine, count)
        dx, dy, turning = sweep.velocity[:-1].T
        arm = np.exp(1j * sweep.pose[:-1, 2]) * complex(mass_centre)
        point = length * (dx + 1j * dy) + 1j * arm * turning
        rows = [math.sqrt(m) * v for v in (point.real, point.imag, radius * turning)]
        rows += [math.sqrt(value) * sweep.theta_velocity[:-1, k] for k, value in enumerate(wheels) if value > 0.0]
        try:
            return EffectiveInertia.of_samples(np.asarray(rows), tolerance=tolerance)
        except SpecError:
            if count == _SAMPLES[-1]:
                raise
    raise AssertionError


def _closed_sweep(machine: SingleMotorPlatform, count: int) -> Sweep:
    psi = np.linspace(0.0, math.tau, count + 1)
    sweep = machine.sweep(psi)
    if not sweep.complete:
        raise GeometryError(f"the branch ends at psi = {sweep.end[0]:.6g} rad: {sweep.reason}; use shorter cranks")
    if np.abs(sweep.pose[-1] - sweep.pose[0]).max() > 1e-9 * machine.Lc:
        raise GeometryError(
            "the branch does not close after one turn, so J has no period of 2 pi; choose another start"
        )
    return sweep
