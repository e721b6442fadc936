"""The limit L -> 0 of a drive: when it may be taken, and its error of first order in the inductance, measured."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from graphsynth.core.checks import positive
from graphsynth.core.errors import SpecError
from graphsynth.dynamics.driven.prescribed import prescribed_run
from graphsynth.dynamics.driven.run import DriveRun, run
from graphsynth.dynamics.driven.setup import FROM_REST, DriveOptions, Plant, output_times
from graphsynth.dynamics.motors import DCMotor, IdealSpeed, Motor, SynchronousMotor, Train

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


def simulate_drive(
    plant: Plant,
    motor: Motor | IdealSpeed,
    train: Train,
    times: ArrayLike,
    reduce: bool | str,
    options: DriveOptions,
    notes: tuple[str, ...] = (),
) -> DriveRun:
    """Motion of any motor, integrated or given, with the limit L -> 0 where it may be taken, and a note of that.

    ``reduce`` is True, False or "auto"; the last takes the limit for L = 0, and for a small L if the error of first
    order is below ``rtol`` (rad).  `SpecError` for L = 0 with ``reduce=False``, and
    for a motor that has no linear limit.
    """
    if isinstance(motor, IdealSpeed):
        return prescribed_run(plant, motor, train, times, options)
    if not isinstance(reduce, bool | str) or reduce not in (True, False, "auto"):
        raise SpecError(f"reduce = {reduce!r} is unknown; choose 'auto', True or False")
    note, inductance = "", getattr(motor, "inductance", None)
    if inductance == 0.0:
        if reduce is False:
            raise SpecError("inductance = 0 with the unreduced model divides by zero; set reduce = True or 'auto'")
        note = "inductance 0: the reduced model, exact"
    elif inductance is not None and reduce is not False:
        real, out, rtol = _with_inductance(motor), output_times(times), options.rtol
        limited = options.regular or getattr(motor, "voltage_limit", math.inf) < math.inf
        if reduce is True or (not limited and real.electrical_time <= rtol * float(out[-1] - out[0])):
            error = reduction_error(plant, motor, train, out, options)
            if reduce is True or error <= rtol:
                note = f"reduced to L -> 0; estimated error of the angle {error:.1e} rad, of first order in L"
    if note:
        motor, notes, options = motor.reduced(), (*notes, note), replace(options, currents=None)  # type: ignore[union-attr]
    return run(plant, motor, train, times, options, notes)


def reduction_error(
    plant: Plant, motor: Motor | IdealSpeed, train: Train, times: ArrayLike, options: DriveOptions
) -> float:
    """Largest error of the angle (rad) of the limit L -> 0 after the electrical transient; estimated.

    From a run, at the angle and speed of the options, with an inductance large enough to be seen, scaled down linearly;
    0 for a motor without inductance.
    """
    if getattr(motor, "inductance", 0.0) == 0.0 and not isinstance(motor, IdealSpeed):
        return 0.0
    real, out = _with_inductance(motor), output_times(times)
    factor = max(1.0, 1e-5 * float(out[-1] - out[0]) / real.electrical_time)
    study = inductance_study(plant, real, train, out, [factor * real.inductance], options)
    return float(study.angle[0]) / factor


def _with_inductance(motor: Motor | IdealSpeed) -> DCMotor | SynchronousMotor:
    """Return a motor that has an inductance, or refuse it."""
    if isinstance(motor, DCMotor | SynchronousMotor):
        return motor
    if isinstance(motor, IdealSpeed):
        raise SpecError("an ideal speed has no inductance to take to zero; give a DCMotor or a SynchronousMotor")
    raise SpecError(f"{type(motor).__name__} has no inductance; give a DCMotor or a SynchronousMotor")


def inductance_study(
    plant: Plant,
    motor: Motor | IdealSpeed,
    train: Train,
    times: ArrayLike,
    inductances: Sequence[float],
    options: DriveOptions = FROM_REST,
    after: float | None = None,
) -> ReductionStudy:
    """Compare the full model at several inductances (H) with the limit L -> 0 (theory/motor-drive 4, theory/braider 6).

    The runs start without currents, at the angle and speed of the options; their tolerance is 1e-12.  Times before
    ``after`` (s) are left out, twenty electrical time constants by default.  `SpecError` for a motor without
    inductance, an inductance that is not positive, or times all within the transient.
    """
    motor, out = _with_inductance(motor), output_times(times)
    if not isinstance(inductances, Sequence | np.ndarray) or len(inductances) == 0:
        raise SpecError("there is no inductance to try; give at least one, in H")
    precise = DriveOptions(options.angle, options.speed, rtol=1e-12, estimate=False)
    limit = run(plant, motor.reduced(), train, out, precise)
    gaps, runs = [], []
    for value in inductances:
        real = replace(motor, inductance=positive("inductance", value, SpecError))
        full = run(plant, real, train, out, precise)
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
