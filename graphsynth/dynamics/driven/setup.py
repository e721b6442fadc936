"""From a motor, a train and a mechanism of one freedom to the flat arrays of the compiled integrator; the checks."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from graphsynth.core.checks import finite, finite_array
from graphsynth.core.errors import SpecError
from graphsynth.dynamics.driven.inertia import EffectiveInertia
from graphsynth.dynamics.motors import (
    DCMotor,
    IdealTorque,
    LinearCharacteristic,
    Motor,
    SynchronousMotor,
    Train,
    electric,
    shaft_torque,
    starting_modes,
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

    @property
    def most_inertia(self) -> float:
        """Bound of the inertia of the rows, kg m^2."""
        return float((np.abs(self.rows).sum(axis=1) ** 2).sum())


@dataclass(frozen=True)
class DriveOptions:
    """State at the start of a run and how it is integrated.

    ``angle`` (rad), ``speed`` (rad/s) and ``currents`` (A; zero by default) are those of the start.  ``regular`` uses
    the regularised form ``dt = sqrt(J) ds`` (theory/motor-drive 3), which passes dead centres without inertia.
    ``rtol`` is the tolerance per step, 1e-13 to 1e-3; ``max_steps`` and ``max_events`` are guards: exceeding one is a
    reported failure.  ``estimate`` also runs at ``100 rtol`` with every other output: the difference is the ``error``.
    """

    angle: float = 0.0
    speed: float = 0.0
    currents: tuple[float, ...] | None = None
    regular: bool = False
    rtol: float = 1e-10
    estimate: bool = True
    max_steps: int = 200_000
    max_events: int = 2_000


FROM_REST = DriveOptions()


class Prepared(NamedTuple):
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
    out = np.array(finite_array("times", times, SpecError))
    if out.ndim != 1 or out.size < 2 or not (np.diff(out) > 0).all():
        raise SpecError(f"times of shape {out.shape} must be at least two strictly increasing numbers; give them in s")
    return out


def prepare(
    plant: Plant, motor: Motor, train: Train, out: Array, options: DriveOptions, *, singular: bool = False
) -> Prepared:
    """Check everything and lay it out for the integrator; the arguments are those of `run`.

    ``singular`` allows an inertia that vanishes, for motions that are given.  `SpecError` for currents that do not fit
    the motor, or an inertia that vanishes on the way.
    """
    from graphsynth.dynamics.driven.kernels import systems as s

    if isinstance(motor, IdealTorque):
        motor = motor.reduced()
    if isinstance(motor, (DCMotor, SynchronousMotor)) and motor.inductance == 0.0:
        raise SpecError("inductance = 0 has no current equation; use the reduced motor, motor.reduced()")
    kind, numbers_of = electric(motor)
    values = np.zeros(s.SIZE)
    values[s.BASE] = plant.base + train.reflected(motor.rotor_inertia)
    values[s.FRICTION] = plant.friction + train.ratio**2 * motor.friction
    values[s.RATIO], values[s.EFFICIENCY], values[s.CONSTANT] = train.ratio, train.efficiency, plant.load
    values[s.ELECTRIC : s.ELECTRIC + len(numbers_of)] = numbers_of
    if plant.linkage is not None:
        values[s.LINKAGE :] = plant.linkage
    load = np.zeros(1) if plant.load_series is None else load_coefficients(plant.load_series)
    count, width = plant.rows.shape
    rows = np.zeros((count + 1, max(width, load.size)))  # the series of the load is the last row
    rows[:-1, :width], rows[-1, : load.size] = plant.rows, load
    given = (0.0,) * kind
    if options.currents is not None:
        given = tuple(finite_array("currents", options.currents, SpecError).ravel().tolist())
    if len(given) != kind:
        raise SpecError(f"{len(given)} currents given for a motor with {kind}; leave them out or give {kind}")
    q, w, regular = (
        finite("angle", options.angle, SpecError),
        finite("speed", options.speed, SpecError),
        options.regular,
    )
    torque = float(shaft_torque(motor, np.array(train.ratio * w), np.array(given)))
    held, driving = starting_modes(motor, train.ratio * w, torque)
    setup = np.array([s.SERIES if plant.linkage is None else s.FOUR_BAR, kind, int(regular), held, driving])
    here = np.zeros(16)
    s.mechanism(setup, q, values, rows, here)
    if regular:
        _allow_regular(values, motor, plant.dead_centres, q)
    elif not singular:
        least = here[0]
        if not values[s.BASE] > 0.0 and plant.linkage is None:
            turn = EffectiveInertia(plant.rows).value(np.linspace(0.0, math.tau, 720, endpoint=False))
            least = -1.0 if plant.dead_centres else min(least, turn.min())
        if not least > 0.0:
            raise SpecError(
                "the inertia vanishes on the way: give J_0 > 0 (rotor or wheels), or use the regularised model"
            )
    span = float(out[-1] - out[0])
    reference, sizes = _sizes(motor, train.ratio, w, here[0], given, span)
    unit, start = np.array([1.0, reference, *sizes]), np.array([q, w, *given])
    first = 1e-3 * min(span, 1.0 / reference)
    if isinstance(motor, (DCMotor, SynchronousMotor)):
        first = min(first, 0.25 * motor.electrical_time)
    if regular:
        root = math.sqrt(here[0])
        start = np.array([q, root * w, *given, out[0]])
        largest = math.sqrt(plant.most_inertia + values[s.BASE])
        unit = np.array([1.0, reference * largest, *sizes, span])
        first /= largest
    return Prepared(setup, values, rows, _bounds(plant, values, q, regular), start, unit, first)


def load_coefficients(series: ArrayLike) -> Array:
    """Return the coefficients ``a0, a1, b1, ...`` of a load torque; `SpecError` for an even number of them."""
    load = np.array(finite_array("load_series", series, SpecError))
    if load.ndim != 1 or load.size % 2 == 0:
        raise SpecError(f"load_series of shape {load.shape} must be coefficients a0, a1, b1, ...; give an odd number")
    return load


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


def _sizes(
    motor: Motor, ratio: float, w: float, inertia: float, given: tuple[float, ...], span: float
) -> tuple[float, list[float]]:
    """Sizes of the crank speed and of the currents to expect: the scales of their absolute tolerances."""
    if isinstance(motor, DCMotor):
        total = motor.gain + motor.emf_constant
        free = motor.gain * motor.speed / total / ratio if total else motor.speed / ratio
    elif isinstance(motor, SynchronousMotor):
        free = motor.uq / (motor.pole_pairs * motor.flux) / ratio if motor.flux else 0.0
    else:
        assert isinstance(motor, LinearCharacteristic)
        pushed = abs(motor.stall) * ratio * span / inertia if inertia > 0.0 else 1.0
        free = min(motor.stall / motor.slope / ratio if motor.slope else math.inf, pushed)
    reference = max(abs(free), abs(w)) or 1.0
    if isinstance(motor, DCMotor):
        volts = motor.gain * abs(motor.speed) + motor.emf_constant * ratio * reference
        ohms = motor.resistance + motor.inductance / min(0.1, span)
        return reference, [max(volts / ohms, abs(given[0])) or 1.0]
    if isinstance(motor, SynchronousMotor):
        size = max(math.hypot(motor.ud, motor.uq) / motor.resistance, *map(abs, given)) or 1.0
        return reference, [size, size]
    return reference, []
