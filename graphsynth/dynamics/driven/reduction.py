"""The limit L -> 0 of a drive: when it may be taken, and its error of first order in the inductance, measured."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from graphsynth.core.errors import SpecError
from graphsynth.dynamics.driven.run import DriveRun, run
from graphsynth.dynamics.driven.setup import Plant, output_times
from graphsynth.dynamics.motors import DCMotor, Motor, SynchronousMotor, Train, number

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class ReductionStudy:
    """Distance of the full model from the limit L -> 0 for several inductances, and the order that it shows.

    ``angle`` (rad) and ``speed`` (rad/s) are the largest differences over the output times behind the electrical
    transient; ``order`` (n - 1,) the slopes of the speed difference between neighbours, 1 in the limit; ``steps`` the
    cost.  ``runs`` holds the full runs and ``limit`` the reduced one.
    """

    inductance: Array
    angle: Array
    speed: Array
    order: Array
    steps: NDArray[np.int64]
    runs: tuple[DriveRun, ...]
    limit: DriveRun


def choose_motor(
    plant: Plant,
    motor: Motor,
    train: Train,
    times: ArrayLike,
    reduce: bool | str,
    *,
    angle: float,
    speed: float,
    rtol: float,
    regular: bool = False,
) -> tuple[Motor, str]:
    """Motor to integrate with, and a note when it is the limit L -> 0 of the given one.

    ``reduce`` is True, False or "auto"; the last takes the limit for L = 0, and for a small L if the error of first
    order is below ``rtol`` (rad).

    Raises
    ------
    SpecError
        An unknown option, L = 0 with ``reduce=False``, a motor that has no linear limit.
    """
    if not isinstance(reduce, bool | str) or reduce not in (True, False, "auto"):
        raise SpecError(f"reduce = {reduce!r} is unknown; choose 'auto', True or False")
    if not isinstance(motor, (DCMotor, SynchronousMotor)) or (reduce is False and motor.inductance > 0.0):
        return motor, ""
    if motor.inductance == 0.0:
        if reduce is False:
            raise SpecError("inductance = 0 with the unreduced model divides by zero; set reduce = True or 'auto'")
        return motor.reduced(), "inductance 0: the reduced model, exact"
    out = output_times(times)
    if reduce == "auto":
        limited = isinstance(motor, DCMotor) and motor.voltage_limit < math.inf
        if regular or limited or not motor.electrical_time <= rtol * float(out[-1] - out[0]):
            return motor, ""
    error = reduction_error(plant, motor, train, out, angle=angle, speed=speed)
    if reduce == "auto" and not error <= rtol:
        return motor, ""
    return motor.reduced(), f"reduced to L -> 0; estimated error of the angle {error:.1e} rad, of first order in L"


def reduction_error(
    plant: Plant, motor: Motor, train: Train, times: ArrayLike, *, angle: float = 0.0, speed: float = 0.0
) -> float:
    """Largest error of the angle (rad) of the limit L -> 0 after the electrical transient; estimated.

    From a run at an inductance large enough to be seen, scaled down linearly; 0 for a motor without inductance.
    """
    if not isinstance(motor, (DCMotor, SynchronousMotor)) or motor.inductance == 0.0:
        return 0.0
    out = output_times(times)
    factor = max(1.0, 1e-5 * float(out[-1] - out[0]) / motor.electrical_time)
    seen = [factor * motor.inductance]
    study = inductance_study(plant, motor, train, out, seen, angle=angle, speed=speed)
    return float(study.angle[0]) / factor


def inductance_study(
    plant: Plant,
    motor: Motor,
    train: Train,
    times: ArrayLike,
    inductances: Sequence[float],
    *,
    angle: float = 0.0,
    speed: float = 0.0,
    after: float | None = None,
    rtol: float = 1e-12,
) -> ReductionStudy:
    """Compare the full model at several inductances (H) with the limit L -> 0 (theory/motor-drive 4, theory/braider 6).

    Times before ``after`` (s) are left out, twenty electrical time constants by default.

    Raises
    ------
    SpecError
        For a motor without inductance, an inductance that is not positive, or times all within the transient.
    """
    if not isinstance(motor, (DCMotor, SynchronousMotor)):
        raise SpecError(f"{type(motor).__name__} has no inductance; give a DCMotor or a SynchronousMotor")
    out = output_times(times)
    if not isinstance(inductances, Sequence | np.ndarray) or len(inductances) == 0:
        raise SpecError("there is no inductance to try; give at least one, in H")
    limit = run(plant, motor.reduced(), train, out, angle=angle, speed=speed, rtol=rtol, estimate=False)
    gaps, runs = [], []
    for value in inductances:
        real = replace(motor, inductance=number("inductance", value, least=0.0, above=True))
        full = run(plant, real, train, out, angle=angle, speed=speed, rtol=rtol, estimate=False)
        begin = 20.0 * real.electrical_time if after is None else after
        late = (out - out[0] >= begin) & (out > out[0])
        if not late.any():
            raise SpecError(f"all output times lie within {begin:.3g} s, the electrical transient; give later times")
        gaps.append([np.abs(a - b)[late].max() for a, b in ((full.angle, limit.angle), (full.speed, limit.speed))])
        runs.append(full)
    sizes, gap = np.array(inductances, dtype=np.float64), np.array(gaps).reshape(-1, 2)
    with np.errstate(divide="ignore", invalid="ignore"):
        order = np.diff(np.log(gap[:, 1])) / np.diff(np.log(sizes))
    steps = np.array([full.steps for full in runs])
    return ReductionStudy(sizes, gap[:, 0], gap[:, 1], order, steps, tuple(runs), limit)
