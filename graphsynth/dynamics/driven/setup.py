"""From a motor, a train and a mechanism of one freedom to the flat arrays of the compiled integrator; the checks."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from graphsynth.core.errors import SpecError
from graphsynth.dynamics.motors import (
    DCMotor,
    IdealTorque,
    LinearCharacteristic,
    Motor,
    SynchronousMotor,
    Train,
    number,
    numbers,
)

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Plant:
    """Mechanism of one freedom as the integrator sees it.

    ``rows`` are trigonometric velocities (k, 2H + 1); ``load_series`` the load torque in the same basis; ``linkage``
    the parameters of a four-bar instead.  ``base`` is constant inertia (without the rotor), ``friction`` viscous, and
    ``load`` a constant torque at the crank, positive when it drives.
    """

    rows: Array
    base: float = 0.0
    friction: float = 0.0
    load: float = 0.0
    load_series: Array | None = None
    linkage: Array | None = None
    dead_centres: tuple[float, ...] = ()


@dataclass(frozen=True)
class Prepared:
    """Arrays of the integrator: setup, parameters, series, dead centres, start, natural scales, first step."""

    setup: NDArray[np.int64]
    values: Array
    rows: Array
    zeros: Array
    start: Array
    scale: Array
    first: float


def output_times(times: ArrayLike) -> Array:
    """Return strictly increasing finite times as an array, or raise `SpecError`."""
    out = numbers("times", times, "seconds")
    if out.ndim != 1 or out.size < 2 or not (np.diff(out) > 0).all():
        raise SpecError(f"times of shape {out.shape} must be at least two strictly increasing numbers; give them in s")
    return out


def prepare(
    plant: Plant,
    motor: Motor,
    train: Train,
    out: Array,
    angle: float,
    speed: float,
    currents: tuple[float, ...] | None,
    regular: bool,
    *,
    singular: bool = False,
) -> Prepared:
    """Check everything and lay it out for the integrator; the arguments are those of `run`.

    ``singular`` allows an inertia that vanishes, for motions that are given.

    Raises
    ------
    SpecError
        Currents that do not fit the motor, or an inertia that vanishes on the way.
    """
    from graphsynth.dynamics.driven.kernels import systems as s

    if isinstance(motor, IdealTorque):
        motor = motor.reduced()
    values = np.zeros(s.SIZE)
    values[s.BASE] = plant.base + train.reflected(motor.rotor_inertia)
    values[s.FRICTION] = plant.friction + train.ratio**2 * motor.friction
    values[s.RATIO], values[s.EFFICIENCY], values[s.CONSTANT] = train.ratio, train.efficiency, plant.load
    code, electric, amperes = _motor(motor)
    values[s.ELECTRIC : s.ELECTRIC + electric.size] = electric
    if plant.linkage is not None:
        values[s.LINKAGE :] = plant.linkage
    rows = _rows(plant)
    given = (0.0,) * amperes if currents is None else tuple(numbers("currents", currents, "A").ravel().tolist())
    if len(given) != amperes:
        raise SpecError(f"{len(given)} currents given for a motor with {amperes}; leave them out or give {amperes}")
    setup = np.array([s.SERIES if plant.linkage is None else s.FOUR_BAR, code, int(regular), 0, 1])
    q, w = number("angle", angle), number("speed", speed)
    here = np.zeros(16)
    s.mechanism(setup, q, values, rows, here)
    if regular:
        _allow_regular(values, motor, plant.dead_centres, q)
    elif not singular and (not here[0] > 0.0 or not _least_inertia(plant, values[s.BASE]) > 0.0):
        raise SpecError("the inertia vanishes on the way: give J_0 > 0 (rotor or wheels), or use the regularised model")
    zeros = _bounds(plant, values, q, regular)
    _modes(setup, values, motor, w, given, train.ratio)
    reference = _reference_speed(motor, train, w, here[0], out)
    unit = np.array([1.0, reference, *_currents(motor, train, reference, given, out)])
    start = np.array([q, w, *given])
    span = float(out[-1] - out[0])
    first = 1e-3 * min(span, 1.0 / reference)
    if isinstance(motor, (DCMotor, SynchronousMotor)):
        first = min(first, 0.25 * motor.electrical_time)
    if regular:
        root = math.sqrt(here[0])
        start = np.array([q, root * w, *given, out[0]])
        largest = math.sqrt(float((np.abs(plant.rows).sum(axis=1) ** 2).sum()) + values[s.BASE])
        unit = np.array([1.0, reference * largest, *unit[2:], span])
        first /= largest
    return Prepared(setup, values, rows, zeros, start, unit, first)


def _motor(motor: Motor) -> tuple[int, Array, int]:
    """Code, electrical parameters and number of currents of a motor."""
    if isinstance(motor, (DCMotor, SynchronousMotor)) and motor.inductance == 0.0:
        raise SpecError("inductance = 0 has no current equation; use the reduced motor, motor.reduced()")
    if isinstance(motor, DCMotor):
        return (
            1,
            np.array(
                [
                    motor.inductance,
                    motor.resistance,
                    motor.emf_constant,
                    motor.torque_constant,
                    motor.gain,
                    motor.speed,
                    motor.voltage_limit,
                ]
            ),
            1,
        )
    if isinstance(motor, SynchronousMotor):
        return (
            2,
            np.array(
                [
                    motor.inductance,
                    motor.resistance,
                    motor.pole_pairs,
                    motor.flux,
                    motor.ud,
                    motor.uq,
                ]
            ),
            2,
        )
    if isinstance(motor, LinearCharacteristic):
        return 0, np.array([motor.stall, motor.slope]), 0
    raise SpecError(f"{type(motor).__name__} has no equation of motion to integrate; give a motor with a torque")


def load_coefficients(series: ArrayLike) -> Array:
    """Return the coefficients ``a0, a1, b1, ...`` of a load torque, checked.

    Raises
    ------
    SpecError
        An even number of coefficients.
    """
    load = numbers("load_series", series, "N m")
    if load.ndim != 1 or load.size % 2 == 0:
        raise SpecError(f"load_series of shape {load.shape} must be coefficients a0, a1, b1, ...; give an odd number")
    return load


def _rows(plant: Plant) -> Array:
    """Velocity rows with the series of the load as the last row."""
    load = np.zeros(1) if plant.load_series is None else load_coefficients(plant.load_series)
    rows = np.zeros((plant.rows.shape[0] + 1, max(plant.rows.shape[1], load.size)))
    rows[:-1, : plant.rows.shape[1]] = plant.rows
    rows[-1, : load.size] = load
    return rows


def _allow_regular(values: Array, motor: Motor, dead_centres: tuple[float, ...], q: float) -> None:
    from graphsynth.dynamics.driven.kernels import systems as s

    if values[s.FRICTION] > 0.0:
        raise SpecError(
            f"viscous friction b = {values[s.FRICTION]:g} is unbounded at a dead centre without inertia; "
            "give J_0 > 0 (rotor or wheels) or b = 0"
        )
    if values[s.BASE] > 0.0:
        raise SpecError(f"J_0 = {values[s.BASE]:g} leaves no singularity to regularise; use the model with inertia")
    if isinstance(motor, LinearCharacteristic) and motor.slope > 0.0:
        raise SpecError(
            "without inertia the torque of a motor without inductance is unbounded at a dead centre; "
            "give L > 0, or J_0 > 0"
        )
    if isinstance(motor, DCMotor) and motor.voltage_limit < math.inf:
        raise SpecError(
            f"voltage_limit = {motor.voltage_limit:g} is met at every dead centre without inertia; give J_0 > 0"
        )
    if values[s.EFFICIENCY] < 1.0:
        raise SpecError(
            f"efficiency = {values[s.EFFICIENCY]:g} by direction needs the model with inertia; give J_0 > 0"
        )
    if any(abs(math.remainder(q - dead, math.tau)) < 1e-12 for dead in dead_centres):
        raise SpecError("the start is a dead centre, where the speed says nothing; start at another angle")


def _least_inertia(plant: Plant, base: float) -> float:
    if base > 0.0 or plant.linkage is not None:
        return 1.0
    q = np.linspace(0.0, math.tau, 720, endpoint=False)
    from graphsynth.dynamics.driven.inertia import EffectiveInertia

    values = EffectiveInertia(plant.rows).value(q)
    return -1.0 if plant.dead_centres or not values.max() > 0.0 else float(values.min())


def _bounds(plant: Plant, values: Array, q: float, regular: bool) -> Array:
    """Dead centres in increasing order from the piece that holds q; sets the bounds of that piece."""
    from graphsynth.dynamics.driven.kernels import systems as s

    if not regular or not plant.dead_centres:
        values[s.LOW], values[s.HIGH] = -math.inf, math.inf
        return np.zeros(1)
    once = np.sort(np.array(plant.dead_centres))
    turn = math.floor((q - once[0]) / math.tau)
    around = np.concatenate([once + math.tau * (turn + k) for k in (-1, 0, 1, 2)])
    first = int(np.searchsorted(around, q, side="right")) - 1
    zeros = around[first : first + once.size].copy()
    values[s.LOW], values[s.HIGH] = around[first], around[first + 1]
    return zeros


def _modes(
    setup: NDArray[np.int64], values: Array, motor: Motor, w: float, given: tuple[float, ...], ratio: float
) -> None:
    """Voltage limit and direction of the power flow at the start."""
    from graphsynth.dynamics.driven.kernels import systems as s

    if isinstance(motor, DCMotor):
        asked = motor.gain * (motor.speed - ratio * w)
        setup[s.SATURATED] = 0 if abs(asked) <= motor.voltage_limit else int(math.copysign(1, asked))
        tendency = given[0] or asked - motor.emf_constant * ratio * w
    elif isinstance(motor, SynchronousMotor):
        tendency = given[1] or motor.uq - motor.pole_pairs * ratio * w * motor.flux
    elif isinstance(motor, LinearCharacteristic):
        tendency = motor.torque(ratio * w)
    else:
        tendency = motor.value
    setup[s.DRIVING] = -1 if tendency * w < 0.0 else 1


def _reference_speed(motor: Motor, train: Train, w: float, inertia: float, out: Array) -> float:
    """Size of the crank speed to expect: the scale of its absolute tolerance."""
    if isinstance(motor, DCMotor):
        total = motor.gain + motor.emf_constant
        free = motor.gain * motor.speed / total / train.ratio if total else motor.speed / train.ratio
    elif isinstance(motor, SynchronousMotor):
        free = motor.uq / (motor.pole_pairs * motor.flux) / train.ratio if motor.flux else 0.0
    else:
        line = motor.reduced() if isinstance(motor, IdealTorque) else motor
        span = float(out[-1] - out[0])
        pushed = abs(line.stall) * train.ratio * span / inertia if inertia > 0.0 else 1.0
        free = min(line.stall / line.slope / train.ratio if line.slope else math.inf, pushed)
    return max(abs(free), abs(w)) or 1.0


def _currents(motor: Motor, train: Train, reference: float, given: tuple[float, ...], out: Array) -> list[float]:
    """Sizes of the currents to expect."""
    if isinstance(motor, DCMotor):
        volts = motor.gain * abs(motor.speed) + motor.emf_constant * train.ratio * reference
        ohms = motor.resistance + motor.inductance / min(0.1, float(out[-1] - out[0]))
        return [max(volts / ohms, abs(given[0])) or 1.0]
    if isinstance(motor, SynchronousMotor):
        size = max(math.hypot(motor.ud, motor.uq) / motor.resistance, *map(abs, given)) or 1.0
        return [size, size]
    return []
