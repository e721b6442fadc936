"""Motors: direct current with speed control, synchronous in the rotor frame, ideal sources; their limit L -> 0.

Every motor acts on the driving shaft of a `Train` of gears or belts.  SI units.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import NDArray

from graphsynth.core.checks import check_fields, finite, not_negative, positive, whole
from graphsynth.core.errors import SpecError


def _check(motor: object, zero_or_more: tuple[str, ...], above_zero: tuple[str, ...] = ()) -> None:
    for item in fields(motor):  # type: ignore[arg-type]
        name, value = item.name, getattr(motor, item.name)
        if name == "pole_pairs":
            object.__setattr__(motor, name, whole(name, value, 1, error=SpecError))
            continue
        check = not_negative if name in zero_or_more else positive if name in above_zero else finite
        endless = name == "voltage_limit" and value == math.inf
        checked = math.inf if endless else check(name, value, SpecError)
        object.__setattr__(motor, name, checked)
        if math.isfinite(checked):
            check_fields(motor, (), SpecError, small=(name,))


@dataclass(frozen=True)
class LinearCharacteristic:
    """Motor without electrical states: torque ``stall - slope * (shaft speed)``.

    Parameters
    ----------
    stall : float
        Torque at rest, N m.
    slope : float, optional
        Loss of torque per speed, N m s/rad, not negative.
    rotor_inertia, friction : float, optional
        Of the rotor, kg m^2 and N m s/rad, not negative.

    Raises
    ------
    SpecError
        A number that is not finite, or negative where it must not be.

    Examples
    --------
    >>> LinearCharacteristic(0.4, 0.02).torque(10.0)
    0.2
    """

    stall: float
    slope: float = 0.0
    rotor_inertia: float = 0.0
    friction: float = 0.0

    def __post_init__(self) -> None:
        _check(self, ("slope", "rotor_inertia", "friction"))

    def torque(self, speed: float) -> float:
        """Torque at a shaft speed, N m."""
        return self.stall - self.slope * finite("speed", speed, SpecError)


@dataclass(frozen=True)
class IdealTorque:
    """Source of a constant torque (N m) at the motor shaft, whatever the speed.

    Examples
    --------
    >>> IdealTorque(0.5).reduced().torque(100.0)
    0.5
    """

    value: float
    rotor_inertia: float = 0.0
    friction: float = 0.0

    def __post_init__(self) -> None:
        _check(self, ("rotor_inertia", "friction"))

    def reduced(self) -> LinearCharacteristic:
        """Return the same as a linear characteristic."""
        return LinearCharacteristic(self.value, 0.0, self.rotor_inertia, self.friction)


@dataclass(frozen=True)
class IdealSpeed:
    """Source of a constant shaft speed (rad/s), whatever the torque: its torque follows by inverse dynamics.

    Examples
    --------
    >>> IdealSpeed(20.0).value
    20.0
    """

    value: float
    rotor_inertia: float = 0.0
    friction: float = 0.0

    def __post_init__(self) -> None:
        _check(self, ("rotor_inertia", "friction"))


@dataclass(frozen=True)
class DCMotor:
    """Direct-current motor with independent excitation and proportional speed control (theory/motor-drive 1).

    ``L dI/dt = U - r I - c_e w_m`` with ``U = K (w_d - w_m)``, at most ``voltage_limit`` in size; torque ``K_m I``.

    Parameters
    ----------
    resistance, inductance : float
        Of the armature, ohm and H; not negative, not both zero.
    torque_constant, emf_constant : float
        K_m, N m/A, and c_e, V s/rad; not negative.
    gain : float
        K of the speed controller, V s/rad, not negative.
    speed : float
        Demanded motor speed w_d, rad/s.
    voltage_limit : float, optional
        Largest armature voltage, V; none by default, as in the source.
    rotor_inertia, friction : float, optional
        kg m^2 and N m s/rad at the motor shaft.

    Raises
    ------
    SpecError
        A number that is not finite, negative where it must not be, or both armature constants zero.

    Examples
    --------
    >>> motor = DCMotor(1.0, 0.2, 0.1, 0.1, gain=20.0, speed=20.0)
    >>> motor.electrical_time, motor.reduced().stall
    (0.2, 40.0)
    """

    resistance: float
    inductance: float
    torque_constant: float
    emf_constant: float
    gain: float
    speed: float
    voltage_limit: float = math.inf
    rotor_inertia: float = 0.0
    friction: float = 0.0

    def __post_init__(self) -> None:
        _check(
            self,
            ("resistance", "inductance", "torque_constant", "emf_constant", "gain", "rotor_inertia", "friction"),
            ("voltage_limit",),
        )
        if self.resistance == 0.0 and self.inductance == 0.0:
            raise SpecError("resistance and inductance are both zero: the current is unbounded; give one of them")

    @property
    def electrical_time(self) -> float:
        """Time constant L/r, s; infinite without resistance."""
        return self.inductance / self.resistance if self.resistance else math.inf

    def reduced(self) -> LinearCharacteristic:
        """Return the limit L -> 0: ``I = (K (w_d - w_m) - c_e w_m) / r``; its error is of first order in L.

        Raises
        ------
        SpecError
            Without resistance there is no limit; with a voltage limit the characteristic is not linear.
        """
        if self.resistance == 0.0:
            raise SpecError("resistance = 0 leaves no limit for L -> 0; give a positive resistance")
        if self.voltage_limit < math.inf:
            raise SpecError(
                f"voltage_limit = {self.voltage_limit:g} makes the reduced motor nonlinear; "
                "keep a positive inductance (any size) or remove the limit"
            )
        factor = self.torque_constant / self.resistance
        return LinearCharacteristic(
            factor * self.gain * self.speed, factor * (self.gain + self.emf_constant), self.rotor_inertia, self.friction
        )


@dataclass(frozen=True)
class SynchronousMotor:
    """Permanent-magnet synchronous motor with non-salient rotor in the rotor frame, voltages prescribed.

    ``T_e = 1.5 p psi i_q`` (theory/braider 4).

    Parameters
    ----------
    pole_pairs : int
    resistance, inductance : float
        Of the stator, ohm (positive) and H (not negative).
    flux : float
        Flux linkage of the magnet, V s.
    ud, uq : float
        Stator voltages, V (amplitudes).
    rotor_inertia, friction : float, optional
        kg m^2 and N m s/rad at the motor shaft.

    Raises
    ------
    SpecError
        A number that is not finite, or out of its bound.

    Examples
    --------
    >>> motor = SynchronousMotor(4, 2.0, 1e-3, 5e-3, 0.0, 2.1013)
    >>> round(motor.reduced().stall, 9)
    0.0315195
    """

    pole_pairs: int
    resistance: float
    inductance: float
    flux: float
    ud: float
    uq: float
    rotor_inertia: float = 0.0
    friction: float = 0.0

    def __post_init__(self) -> None:
        _check(self, ("inductance", "flux", "rotor_inertia", "friction"), ("resistance",))

    @property
    def electrical_time(self) -> float:
        """Time constant L/R, s."""
        return self.inductance / self.resistance

    def reduced(self) -> LinearCharacteristic:
        """Return the limit L -> 0: ``i_q = (u_q - p w_m psi) / R``; its error is of first order in L."""
        factor = 1.5 * self.pole_pairs * self.flux / self.resistance
        return LinearCharacteristic(
            factor * self.uq, factor * self.pole_pairs * self.flux, self.rotor_inertia, self.friction
        )


#: Motors with a torque, which drive a motion.
Motor = DCMotor | SynchronousMotor | LinearCharacteristic | IdealTorque


_ELECTRIC = {
    LinearCharacteristic: "stall slope",
    DCMotor: "inductance resistance emf_constant torque_constant gain speed voltage_limit",
    SynchronousMotor: "inductance resistance pole_pairs flux ud uq",
}


def electric(motor: Motor | IdealSpeed) -> tuple[int, list[float]]:
    """Return the number of currents, by which kernels tell the kinds of motors, and the electrical numbers in order."""
    kind = type(motor)
    if kind not in _ELECTRIC:
        raise SpecError(f"{kind.__name__} has no equation of motion to integrate; give a motor with a torque")
    return list(_ELECTRIC).index(kind), [float(getattr(motor, name)) for name in _ELECTRIC[kind].split()]


def torque_constant(motor: Motor) -> float:
    """Torque per ampere of the current that makes it, N m/A; 0 without currents."""
    if isinstance(motor, SynchronousMotor):
        return 1.5 * motor.pole_pairs * motor.flux
    return motor.torque_constant if isinstance(motor, DCMotor) else 0.0


def shaft_torque(motor: Motor, shaft: NDArray[np.float64], currents: NDArray[np.float64]) -> NDArray[np.float64]:
    """Torques on the motor's own shaft at speeds (...) and currents (..., 0, 1 or 2)."""
    if isinstance(motor, IdealTorque):
        motor = motor.reduced()
    if isinstance(motor, LinearCharacteristic):
        return motor.stall - (motor.slope * shaft if motor.slope else np.zeros_like(shaft))
    return np.asarray(torque_constant(motor) * currents[..., -1])


def starting_modes(motor: Motor, shaft: float, torque: float) -> tuple[int, int]:
    """Voltage at its limit (-1, 0, 1) and power flow (1 drives, -1) of a motor that starts.

    One without torque yet drives where its torque will.
    """
    held = 0
    if isinstance(motor, DCMotor):
        asked = motor.gain * (motor.speed - shaft)
        held = 0 if abs(asked) <= motor.voltage_limit else int(math.copysign(1, asked))
        torque = torque or asked - motor.emf_constant * shaft
    elif isinstance(motor, SynchronousMotor):
        torque = torque or motor.uq - motor.pole_pairs * shaft * motor.flux
    return held, -1 if torque * shaft < 0.0 else 1


def current_scale(motor: Motor) -> float:
    """Size of the currents to expect, A."""
    if isinstance(motor, DCMotor):
        volts = min(motor.gain * abs(motor.speed), motor.voltage_limit)
        return volts / (motor.resistance + 10.0 * motor.inductance) or 1.0
    if isinstance(motor, SynchronousMotor):
        return math.hypot(motor.ud, motor.uq) / motor.resistance or 1.0
    return 1.0


def check_motor(motor: object) -> None:
    """Raise `SpecError` for anything that is neither a motor with a torque nor an ideal speed."""
    if not isinstance(motor, (DCMotor, SynchronousMotor, LinearCharacteristic, IdealTorque, IdealSpeed)):
        raise SpecError(
            f"motor = {motor!r} is no motor; give a DCMotor, SynchronousMotor, LinearCharacteristic, IdealTorque or "
            "IdealSpeed"
        )


@dataclass(frozen=True)
class Train:
    """Train with constant ratio.

    Parameters
    ----------
    ratio : float
        Motor turns per turn of the output shaft, positive (the sense of rotation is absorbed).
    efficiency : float
        In (0, 1].  When the motor drives, the output torque is ``ratio * efficiency * torque``; when the mechanism
        drives the motor, ``ratio * torque / efficiency``.
    inertia : float
        Of the train itself, reduced to the output shaft, kg m^2.

    Raises
    ------
    SpecError
        Ratio not positive, efficiency outside (0, 1], negative inertia.

    Examples
    --------
    >>> train = Train.of_teeth([(10, 44), (10, 33), (20, 80)])
    >>> round(train.ratio, 12), round(train.reflected(8.2e-6), 8)
    (58.08, 0.02766095)
    """

    ratio: float = 1.0
    efficiency: float = 1.0
    inertia: float = 0.0

    def __post_init__(self) -> None:
        object.__setattr__(self, "ratio", positive("ratio", self.ratio, SpecError))
        object.__setattr__(self, "efficiency", positive("efficiency", self.efficiency, SpecError))
        object.__setattr__(self, "inertia", not_negative("inertia of the train", self.inertia, SpecError))
        check_fields(self, ("ratio", "efficiency"), SpecError, small=("inertia",))
        if self.efficiency > 1.0:
            raise SpecError(f"efficiency = {self.efficiency:g} must be at most 1; give a fraction, not a percentage")

    @classmethod
    def of_teeth(
        cls, stages: Sequence[tuple[int, int]], efficiency: Sequence[float] = (), inertia: float = 0.0
    ) -> Train:
        """Train of stages (driving teeth, driven teeth), with the efficiency of each stage (1 by default).

        Raises
        ------
        SpecError
            For a stage that is not a pair of numbers of teeth, or another number of efficiencies.
        """
        if not isinstance(stages, Sequence) or not isinstance(efficiency, Sequence):
            raise SpecError(f"stages = {stages!r}, efficiency = {efficiency!r}: give lists, one entry for each stage")
        for stage in stages:
            if not isinstance(stage, Sequence) or len(stage) != 2:
                raise SpecError(f"stage {stage!r} of the train must be a pair; give (driving teeth, driven teeth)")
            for teeth in stage:
                whole("teeth", teeth, 1, error=SpecError)
        if efficiency and len(efficiency) != len(stages):
            raise SpecError(f"{len(efficiency)} efficiencies for {len(stages)} stages; give one for each stage")
        parts = [positive("efficiency of a stage", part, SpecError) for part in efficiency]
        driven_teeth, driving_teeth = math.prod(s[1] for s in stages), math.prod(s[0] for s in stages)
        return cls(driven_teeth / driving_teeth, math.prod(parts), inertia)

    def output_torque(self, torque: float, speed: float) -> float:
        """Torque at the output for a motor torque (N m) at a motor speed (rad/s): the sign of the power decides."""
        torque, speed = finite("torque", torque, SpecError), finite("speed", speed, SpecError)
        eta = self.efficiency if torque * speed >= 0.0 else 1.0 / self.efficiency
        return self.ratio * eta * torque

    def reflected(self, inertia: float) -> float:
        """Inertia at the output of a rotor inertia at the motor, plus the train's own, kg m^2."""
        return self.ratio**2 * finite("inertia", inertia, SpecError) + self.inertia
