"""A motor with a mechanism in more digits than a double has: the yardstick of the integrators of drives.

An implementation of its own: the equations of theory/motor-drive and theory/braider 4 in numpy's long doubles,
integrated by extrapolation of the modified midpoint rule ([Gragg 1965], [Bulirsch & Stoer 1966]).  It shares no code
with the compiled right-hand sides or with any solver that is measured.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from graphsynth.core.errors import SpecError
from graphsynth.dynamics.motors import DCMotor, SynchronousMotor

Long = np.longdouble
Vector = NDArray[np.longdouble]
#: Crank angle -> inertia without rotor and train, half its derivative, load torque (SI).
Shape = Callable[[Any], tuple[Any, Any, Any]]
#: Digits of the arithmetic: 18 on most machines, 15 where a long double is a double.
DIGITS = int(np.finfo(Long).precision)
NAME = f"extrapolated midpoint rule in long doubles ({DIGITS} digits)"
_COLUMNS = 9  # steps 2, 4, ..., 18 of the midpoint rule: order 18
_BOUND = 300.0 * float(np.finfo(Long).eps)  # error of a step, over one plus the value
_MOST_STEPS = 20_000


def shape_of_series(rows: NDArray[np.float64], base: float = 0.0, load: float = 0.0) -> Shape:
    """Shape of ``J(q) = base + sum of squares of a0 + a1 cos q + b1 sin q + ...`` (m kg^0.5), with a constant load.

    Examples
    --------
    >>> shape = shape_of_series(np.array([[0.0, 0.1, 0.0]]))  # a slider: m L^2 cos(q)^2
    >>> [round(float(value), 12) for value in shape(0.5)]
    [0.007701511529, -0.004207354924, 0.0]
    """
    cosines, sines = rows[:, 1::2].astype(Long), rows[:, 2::2].astype(Long)
    means, n = rows[:, 0].astype(Long), np.arange(1, cosines.shape[1] + 1).astype(Long)

    def shape(q: Any) -> tuple[Any, Any, Any]:
        c, s = np.cos(n * q), np.sin(n * q)
        values = means + cosines @ c + sines @ s
        slopes = sines @ (n * c) - cosines @ (n * s)
        return Long(base) + values @ values, values @ slopes, Long(load)

    return shape


def precise_drive(
    shape: Shape,
    motor: DCMotor | SynchronousMotor | None,
    ratio: float,
    inertia: float,
    friction: float,
    times: Sequence[float],
    *,
    angle: float = 0.0,
    speed: float = 0.0,
) -> Vector:
    """Angle, speed and currents at increasing times, s: a row for each, shape (n, 2 + currents).

    Estimated: the two finest extrapolations of each step agree to 300 roundings.  A `SpecError` refuses another
    motor, and more than 20 000 steps: too stiff for an explicit method.

    The motor has an inductance and no voltage limit; None for a mechanism that moves freely.  It makes ``ratio`` turns
    per turn of the crank, without losses; ``inertia`` of the train and viscous ``friction`` count at the crank (the
    motor's own are added), kg m^2 and N m s/rad.  ``angle`` and ``speed`` are those of the crank at the first of the
    times; currents begin at zero.

    Examples
    --------
    >>> motor = DCMotor(1.0, 0.2, 0.1, 0.1, gain=20.0, speed=20.0)
    >>> slider = shape_of_series(np.array([[0.0, 2**0.5 * 0.05, 0.0]]), base=0.002)
    >>> found = precise_drive(slider, motor, 1.0, 0.0, 0.0, [0.0, 0.1])
    >>> round(float(found[-1][1]), 9)  # as in the example of MotorDrivenPlatform
    11.711831447
    """
    rates = _equations(shape, motor, ratio, inertia, friction)
    currents = 0 if motor is None else 1 if isinstance(motor, DCMotor) else 2
    y = np.array([angle, speed, *[0.0] * currents], dtype=Long)
    found, t, steps = [y], Long(times[0]), 0
    step = Long(motor.inductance) / Long(motor.resistance) if motor else (Long(times[1]) - t) / 10
    for end in map(Long, times[1:]):
        while t < end:
            h = min(step, end - t)
            new, error = _extrapolated(rates, y, h)
            steps += 1
            if steps > _MOST_STEPS:
                raise SpecError(f"more than {_MOST_STEPS} steps: the motor is too stiff for the precise reference")
            growth = min(4.0, 0.8 * max(error, 1e-30) ** (-1.0 / (2 * _COLUMNS - 1)))
            if error <= 1.0:
                t, y = (end if h == end - t else t + h), new
                step = max(step, h * growth) if h < step else h * growth
            else:
                step = h * max(0.1, growth)
        found.append(y)
    return np.array(found)


def _extrapolated(rates: Callable[[Vector], Vector], y: Vector, h: Any) -> tuple[Vector, float]:
    """One step by midpoint rules of 2, 4, ... parts, extrapolated in the square of the part; error over its bound."""
    slope = rates(y)
    table: list[list[Vector]] = []
    for j in range(_COLUMNS):
        n = 2 * (j + 1)
        part = h / n
        before, now = y, y + part * slope
        for _ in range(n - 1):
            before, now = now, before + 2 * part * rates(now)
        row = [now]
        for k in range(j):
            # column k + 1 from two neighbours of column k, whose parts are n and n - 2 (k + 1)
            weight = 1 / ((Long(n) / Long(n - 2 * (k + 1))) ** 2 - 1)
            row.append(row[k] + (row[k] - table[j - 1][k]) * weight)
        table.append(row)
    last, other = table[-1][-1], table[-1][-2]
    return last, float(np.max(np.abs(last - other) / (_BOUND * (1 + np.abs(last)))))


def _equations(
    shape: Shape, motor: DCMotor | SynchronousMotor | None, ratio: float, inertia: float, friction: float
) -> Callable[[Vector], Vector]:
    """Return the derivatives of angle, speed and currents as a function of them."""
    N = Long(ratio)
    added = Long(inertia) + (N * N * Long(motor.rotor_inertia) if motor else 0)
    damping = Long(friction) + (N * N * Long(motor.friction) if motor else 0)
    electric = _electric(motor) if motor is not None else None

    def rates(y: Vector) -> Vector:
        w = y[1]
        torque, currents = electric(N * w, y) if electric else (Long(0), [])
        J, half, load = shape(y[0])
        return np.array([w, (N * torque + load - damping * w - half * w * w) / (J + added), *currents], dtype=Long)

    return rates


def _electric(motor: DCMotor | SynchronousMotor) -> Callable[[Any, Vector], tuple[Any, list[Any]]]:
    """Torque of a motor and derivatives of its currents, for the speed of the rotor and the state."""
    if not isinstance(motor, DCMotor | SynchronousMotor) or motor.inductance == 0.0:
        raise SpecError("the precise reference is for motors with a current equation: DCMotor, SynchronousMotor, L > 0")
    R, L = Long(motor.resistance), Long(motor.inductance)
    if isinstance(motor, DCMotor):
        if math.isfinite(motor.voltage_limit):
            raise SpecError(f"voltage_limit = {motor.voltage_limit:g} V: the precise reference knows no events")
        gain, wanted, constant, back = map(Long, (motor.gain, motor.speed, motor.torque_constant, motor.emf_constant))

        def direct(w: Any, y: Vector) -> tuple[Any, list[Any]]:
            return constant * y[2], [(gain * (wanted - w) - R * y[2] - back * w) / L]

        return direct
    flux, ud, uq, poles = map(Long, (motor.flux, motor.ud, motor.uq, motor.pole_pairs))

    def synchronous(w: Any, y: Vector) -> tuple[Any, list[Any]]:
        d, q = y[2:]
        turn = poles * w
        return 3 * poles * flux * q / 2, [(ud - R * d + turn * L * q) / L, (uq - R * q - turn * (L * d + flux)) / L]

    return synchronous
