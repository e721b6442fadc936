"""Inverse design of the single-motor mechanism: phasors, then Newton refinement on the nonlinear model."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from graphsynth.core.checks import checked, finite, plane_point, three
from graphsynth.systems.platform.small_crank import (
    RejectedError,
    SmallCrank,
    Sweep,
    cold_sweep,
    harmonics,
    pose_derivatives,
    small_crank,
    warm_sweep,
)

if TYPE_CHECKING:
    from graphsynth.systems.platform.motion import TurnMotion
    from graphsynth.systems.platform.single_motor_platform import SingleMotorPlatform

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]

_ITERATIONS = 12


@dataclass(frozen=True, eq=False)
class Design:
    """A designed mechanism and what it does over a whole turn.

    * `mechanism`: also for a rejected design, to look at.
    * `accepted`: the whole turn was followed on one branch (and the refinement converged, if there was one).
    * `reason`: why the design is rejected; empty if accepted.
    * `wanted`, `achieved` (shape (3,), complex): first harmonic of ``(x, y, alpha)``; ``achieved`` is NaN if the turn
      is not complete.
    * `mean` (shape (3,)): mean of the pose minus the home pose of the mechanism given.
    * `error`: ``|achieved - wanted| / |wanted|`` with ``Lc``.
    * `drift`: ``|mean| / |wanted|`` with ``Lc``.
    * `distortion`: all harmonics above the first over the first, with ``Lc``.
    * `off_line`: largest distance in pose space (length, with ``Lc``) from the line through home along a real
      ``wanted``; NaN if ``wanted`` is not real up to one phase.
    * `amplitude_reached`: fraction of the wanted amplitude that was reached: 1 if accepted; NaN if not searched for.
      The mechanism is then the one with that amplitude.
    * `motion`: the verification over the whole turn, compared with all assembly modes.
    """

    mechanism: SingleMotorPlatform
    accepted: bool
    reason: str
    wanted: Complex
    achieved: Complex
    mean: Array
    error: float
    drift: float
    distortion: float
    off_line: float
    iterations: int
    amplitude_reached: float
    motion: TurnMotion | None


def translation_along(amplitude: float, angle: float) -> Complex:
    """Phasor of a rectilinear translation: amplitude (length) in the direction ``angle`` (radians)."""
    amplitude, angle = finite("amplitude", amplitude), finite("angle", angle)
    return np.array([amplitude * math.cos(angle), amplitude * math.sin(angle), 0.0], dtype=np.complex128)


def rotation_about(amplitude: float, centre: complex = 0j) -> Complex:
    """Phasor of a rotation: amplitude (radians) about a point measured from the home position.

    See theory/inverse-design 1.
    """
    c, amplitude = plane_point("centre", centre), finite("amplitude", amplitude)
    return amplitude * np.array([c.imag, -c.real, 1.0], dtype=np.complex128)


def _wanted(value: ArrayLike) -> Complex:
    parts = zip(("x", "y", "alpha"), three("wanted", value))
    return np.array([plane_point(f"phasor wanted of {name}", part) for name, part in parts])


def _with(mechanism: SingleMotorPlatform, crank: Complex, coupler: ArrayLike | None = None) -> SingleMotorPlatform:
    changes: dict[str, Any] = {
        "crank": tuple(np.abs(crank).tolist()),
        "phase": tuple(np.where(crank != 0.0, np.angle(crank), 0.0).tolist()),
    }
    if coupler is not None:
        changes["coupler"] = tuple(np.asarray(coupler).tolist())
    return replace(mechanism, **changes)


def _linear(mechanism: SingleMotorPlatform, theory: SmallCrank, wanted: Complex) -> SingleMotorPlatform:
    kappa = np.linalg.solve(theory.J.astype(np.complex128), wanted)
    return _with(mechanism, theory.rocker * theory.sine * kappa * np.exp(1j * theory.coupler_direction))


@checked
def linear_design(mechanism: SingleMotorPlatform, wanted: ArrayLike, *, samples: int = 96) -> Design:
    """Crank lengths and phases for a wanted first harmonic, from the small-crank theory.

    `mechanism`: everything but cranks and phases is taken from it. `wanted` (shape (3,), complex): ``Xi``: ``X(psi) =
    X_home + Re(Xi exp(i psi))``; lengths, lengths, radians.  A real vector asks for a straight (or screw) motion; see
    `translation_along` and `rotation_about`. `samples`: samples of the verification. Verified over the whole turn.  The
    relative error is of second order in the amplitude, the drift of first. See theory/inverse-design 1: ``kappa = J^-1
    Xi``; every ellipse in pose space has one design.

    >>> from graphsynth.systems.platform.single_motor_platform import SingleMotorPlatform
    >>> found = linear_design(SingleMotorPlatform(), translation_along(4.0, 0.645771823237902))
    >>> [round(length, 6) for length in found.mechanism.crank], found.error < 2e-3
    ([2.106173, 5.296477, 3.190303], True)
    """
    target, theory = _wanted(wanted), small_crank(mechanism)
    return assess_design(_linear(mechanism, theory, target), target, theory.home, samples=samples)


@checked
def refine_design(
    mechanism: SingleMotorPlatform,
    wanted: ArrayLike,
    *,
    couplers: bool = False,
    samples: int = 96,
    tolerance: float = 1e-13,
) -> Design:
    """Design whose first harmonic is exactly the wanted one on the nonlinear model.

    `wanted`: shape (3,), complex. `couplers`: also choose the coupler lengths so that the mean of the pose is the home
    pose (nine unknowns instead of six). `samples`: samples of every sweep, 48 to 128. `tolerance`: largest residual
    over the amplitude, with ``Lc``. Every sweep of the iteration keeps the branch label, and the result is verified
    over the whole turn.  Otherwise ``accepted`` is False with the reason, ``amplitude_reached`` is the largest fraction
    of the wanted amplitude that is reached by growing the amplitude from zero (steps down to 0.5 %), and ``mechanism``
    the design there. See theory/inverse-design 2; analytic derivatives.

    >>> from graphsynth.systems.platform.single_motor_platform import SingleMotorPlatform
    >>> found = refine_design(SingleMotorPlatform(), translation_along(4.0, 0.645771823237902), couplers=True)
    >>> found.accepted, found.error < 1e-13, [round(length, 6) for length in found.mechanism.coupler]
    (True, True, [45.099772, 45.157369, 45.113339])
    """
    target, theory = _wanted(wanted), small_crank(mechanism)
    if not target.any():
        return assess_design(_with(mechanism, np.zeros(3, dtype=np.complex128)), target, theory.home, samples=samples)
    refine = partial(_refine, mechanism, theory, couplers, samples, tolerance)
    found, reason, count = refine(target)
    reached, step = (0.0, 0.5) if found is None else (1.0, 0.0)
    while step > 0.005 and reached < 1.0:  # follow the design from small amplitudes
        share, start = min(1.0, reached + step), None
        if found is not None:
            own = found.mechanism
            crank = np.array(own.crank) * np.exp(1j * np.array(own.phase))
            start = _with(own, np.asarray(crank * (share / reached))), found
        further, why, _ = refine(share * target, start)
        if further is None:
            step, reason = 0.5 * step, why
        else:
            found, reached = further, share
    if found is not None and reached == 1.0:
        return assess_design(found.mechanism, target, theory.home, samples=samples, iterations=count)
    rejected = found.mechanism if found is not None else _linear(mechanism, theory, target)
    return _rejected(rejected, reason, target, count, reached)


def _rejected(mechanism: SingleMotorPlatform, reason: str, target: Complex, count: int, reached: float) -> Design:
    nan, nothing = math.nan, np.full(3, np.nan)
    return Design(mechanism, False, reason, target, nothing + 0j, nothing, nan, nan, nan, nan, count, reached, None)


def _refine(
    mechanism: SingleMotorPlatform,
    theory: SmallCrank,
    couplers: bool,
    samples: int,
    tolerance: float,
    target: Complex,
    start: tuple[SingleMotorPlatform, Sweep] | None = None,
) -> tuple[Sweep | None, str, int]:
    """Newton iteration from ``start`` (and what is near it) or the linear design; the sweep found, or None and why."""
    weight = np.array([1.0, 1.0, mechanism.Lc])
    size, last, count = float(np.linalg.norm(weight * target)), math.inf, 0
    try:
        sweep = warm_sweep(*start) if start else cold_sweep(_linear(mechanism, theory, target), samples)
        for count in range(_ITERATIONS + 1):
            residual, matrix = _equations(sweep, theory.home, target, weight, 9 if couplers else 6)
            error = float(np.linalg.norm(residual)) / size
            if error <= tolerance or (error <= 100.0 * tolerance and error >= 0.5 * last):
                return sweep, "", count
            if (count and error > 2.0 * last) or count == _ITERATIONS:
                return None, f"no convergence: relative residual {error:.3g} after {count} iterations", count
            step = np.linalg.solve(matrix, -residual)
            own = sweep.mechanism
            crank = np.array(own.crank) * np.exp(1j * np.array(own.phase)) + step[:3] + 1j * step[3:6]
            coupler = np.array(own.coupler) + (step[6:] if couplers else 0.0)
            if coupler.min() <= 0.0:
                return None, f"a coupler length becomes {coupler.min():.3g}, not positive", count
            sweep, last = warm_sweep(_with(own, crank, coupler), sweep), error
    except RejectedError as reason:
        return None, str(reason), count
    raise AssertionError  # the loop returns


def _equations(sweep: Sweep, home: Array, target: Complex, weight: Array, unknowns: int) -> tuple[Array, Array]:
    """Residual (first harmonic, then mean) and its derivatives, in lengths."""
    kernel = 2.0 * np.exp(-1j * sweep.psi) / len(sweep.psi)
    derivative = pose_derivatives(sweep)[:, :, :unknowns] * weight[:, None]
    first = weight * (kernel @ sweep.pose - target)
    by = np.einsum("n,nij->ij", kernel, derivative)
    residual, matrix = [first.real, first.imag], [by.real, by.imag]
    if unknowns == 9:
        residual.append(weight * (sweep.pose - home).mean(axis=0))
        matrix.append(derivative.mean(axis=0))
    return np.concatenate(residual), np.concatenate(matrix)


@checked
def assess_design(
    mechanism: SingleMotorPlatform, wanted: ArrayLike, home: ArrayLike, *, samples: int = 96, iterations: int = 0
) -> Design:
    """Follow a mechanism over a whole turn and compare it with the wanted first harmonic about ``home``."""
    target, start = _wanted(wanted), np.asarray(home, dtype=np.float64)
    weight = np.array([1.0, 1.0, mechanism.Lc])
    try:
        sweep = cold_sweep(mechanism, samples)
    except RejectedError as reason:
        return _rejected(mechanism, str(reason), target, iterations, math.nan)
    measured = harmonics(sweep.pose)
    size = float(np.linalg.norm(weight * target)) or math.nan
    achieved, mean = measured.order(1), measured.mean - start
    error = float(np.linalg.norm(weight * (achieved - target))) / size
    drift, distortion = float(np.linalg.norm(weight * mean)) / size, measured.total_distortion(mechanism.Lc)
    off = _off_line(weight * (sweep.pose - start), weight * target)
    sizes = (error, drift, distortion, off)
    return Design(mechanism, True, "", target, achieved, mean, *sizes, iterations, 1.0, sweep.motion)


def _off_line(path: Array, wanted: Complex) -> float:
    """Largest distance of the path from the line along ``wanted``, if that is a line."""
    along = wanted * np.conj(wanted[int(np.argmax(np.abs(wanted)))])
    if not along.any() or np.abs(along.imag).max() > 1e-12 * np.abs(along).max():
        return math.nan
    unit = along.real / np.linalg.norm(along.real)
    return float(np.linalg.norm(path - (path @ unit)[:, None] * unit, axis=1).max())
