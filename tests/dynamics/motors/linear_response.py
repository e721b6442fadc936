"""Closed form of a direct-current motor that turns a constant inertia."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike, NDArray

from graphsynth.core.checks import finite_array, not_negative
from graphsynth.core.errors import SpecError
from graphsynth.dynamics.motors import DCMotor, Train

Array = NDArray[np.float64]


def linear_response(
    motor: DCMotor, inertia: float, times: ArrayLike, train: Train | None = None
) -> tuple[Array, Array]:
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
    See theory/motor-drive 6.

    Examples
    --------
    >>> motor = DCMotor(1.0, 0.2, 0.1, 0.1, gain=20.0, speed=20.0)
    >>> [round(float(x[0]), 9) for x in linear_response(motor, 0.002, [0.01])]
    [4.715860858, 17.915043449]
    """
    gear = train or Train()
    total = not_negative("inertia", inertia, SpecError) + gear.reflected(motor.rotor_inertia)
    if total == 0.0 or motor.inductance == 0.0:
        raise SpecError(f"inertia = {total:g} and inductance = {motor.inductance:g} must both be positive here")
    if motor.torque_constant == 0.0 or motor.gain + motor.emf_constant == 0.0:
        raise SpecError("torque_constant and gain + emf_constant must be positive: give a motor that turns and brakes")
    if motor.friction > 0.0 or motor.voltage_limit < math.inf:
        raise SpecError("the closed form has neither friction nor a voltage limit; use simulate")
    if gear.efficiency < 1.0:
        raise SpecError(f"efficiency = {gear.efficiency:g} changes with the power flow; use simulate, or efficiency 1")
    t = finite_array("times", times, SpecError)
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
        ratio = np.where(
            small, np.exp(-a * t) * t * (1.0 + (s * t) ** 2 / 6.0), -slow * np.expm1(-2.0 * s * t) / (2.0 * s)
        )
    return 0.5 * (slow + fast), np.asarray(ratio)
