"""Small-crank theory of the single-motor mechanism: predicted motion of rockers and platform; harmonics of a motion.

Sweeps of a full rotation on a known branch, warm-started from a neighbouring design, serve the design iterations: every
sweep keeps the branch label, or is `RejectedError`.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from graphsynth.core.checks import checked, finite_array, positive, whole
from graphsynth.core.errors import GeometryError
from graphsynth.systems.platform.field import determinant

if TYPE_CHECKING:
    from graphsynth.systems.platform.motion import TurnMotion
    from graphsynth.systems.platform.single_motor_platform import SingleMotorPlatform

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]


class RejectedError(GeometryError):
    """A design whose rotation does not stay on one branch."""


@dataclass(frozen=True, eq=False)
class Harmonics:
    """Harmonics ``X(psi) = mean + Re sum_m amplitudes[m - 1] exp(i m psi)`` of every coordinate.

    * `mean`: shape (d,).
    * `amplitudes` (shape (M, d), complex): ``c_m = (2/N) sum X exp(-i m psi)`` for m = 1 to M, M below N/2.
    * `tail` (shape (d,)): largest magnitude among the last quarter of the harmonics: an estimate of the truncation
      error.
    """

    mean: Array
    amplitudes: Complex
    tail: Array

    def order(self, m: int) -> Complex:
        """Amplitudes of harmonic m (from 1), shape (d,).

        Raises `GeometryError`: a harmonic that the samples do not resolve.
        """
        if not 1 <= m <= len(self.amplitudes):
            raise GeometryError(f"harmonic {m} is not resolved; choose 1 to {len(self.amplitudes)} or more samples")
        return np.asarray(self.amplitudes[m - 1])

    def distortion(self) -> Array:
        """Root of the summed squares of all harmonics above the first over the first, for every coordinate.

        Infinite where the first harmonic vanishes but others do not, NaN where all vanish.
        """
        size = np.abs(self.amplitudes)
        with np.errstate(divide="ignore", invalid="ignore"):
            return np.asarray(np.sqrt((size[1:] ** 2).sum(axis=0)) / size[0])

    def total_distortion(self, Lc: float) -> float:
        """Return the distortion of the whole pose (x, y, alpha), angles multiplied by ``Lc``.

        Raises `GeometryError`: harmonics of something that is no pose.
        """
        weight = np.array([1.0, 1.0, positive("Lc", Lc)])
        if self.mean.shape != (3,):
            raise GeometryError(f"a pose has three coordinates, not {self.mean.size}; use distortion()")
        size = np.abs(self.amplitudes * weight) ** 2
        with np.errstate(divide="ignore", invalid="ignore"):
            return float(np.sqrt(size[1:].sum() / size[0].sum()))


@checked
def harmonics(samples: ArrayLike) -> Harmonics:
    """Analyse samples at ``psi = 2 pi j / N``, j = 0 to N - 1 (the end of the turn left out).

    `samples` (shape (N,) or (N, d)): n at least 4. Exact for trigonometric polynomials of degree below N/2; for
    analytic motions the error falls faster than any power of N. Raises `GeometryError`: fewer than 4 samples, or
    samples that are not finite.

    >>> import numpy as np
    >>> psi = 2.0 * np.pi * np.arange(16) / 16
    >>> found = harmonics(1.0 + 2.0 * np.cos(psi) + 0.1 * np.sin(2 * psi))
    >>> round(float(found.mean[0]), 12), round(float(found.distortion()[0]), 12)
    (1.0, 0.05)
    """
    values = finite_array("samples", samples)
    values = values[:, None] if values.ndim == 1 else values
    if values.ndim != 2 or len(values) < 4:
        raise GeometryError(f"samples have shape {values.shape}; give (N,) or (N, d) with N of 4 or more")
    count = len(values)
    spectrum = np.fft.rfft(values, axis=0) / count
    amplitudes = 2.0 * spectrum[1 : (count - 1) // 2 + 1]
    tail = np.abs(amplitudes[-max(1, len(amplitudes) // 4) :]).max(axis=0)
    return Harmonics(spectrum[0].real.copy(), amplitudes, tail)


@dataclass(frozen=True, eq=False)
class SmallCrank:
    """The mechanism at zero crank length and its first and second order in the cranks.

    * `home` (shape (3,)): pose for zero cranks.
    * `theta`, `phi` (shape (3,)): rocker angles there, towards platform and drive, fixed frame.
    * `J` (shape (3, 3)): velocity matrix there.
    * `coupler_direction` (shape (3,)): ``beta_u``, angle of the coupler from crank to rocker, fixed frame.
    * `sine`, `cosine` (shape (3,)): ``s``, ``c`` of ``gamma = beta_u - phi``; transmission is good for s near +1 or -1.
    * `crank`, `phase`, `coupler`, `rocker` (shape (3,)): dimensions of the drives.
    """

    home: Array
    theta: Array
    phi: Array
    J: Array
    coupler_direction: Array
    sine: Array
    cosine: Array
    crank: Array
    phase: Array
    coupler: Array
    rocker: Array

    @property
    def gains(self) -> Complex:
        """Phasor of the pose per unit length of each crank, shape (3, 3): column k belongs to crank k."""
        turn = np.exp(1j * (self.phase - self.coupler_direction))
        return np.asarray(self.J * turn / (self.rocker * self.sine))

    @property
    def first_harmonic(self) -> Complex:
        """Predicted phasor of ``(x, y, alpha)``; relative error of second order in the cranks."""
        return np.asarray(self.gains @ self.crank)

    @property
    def mean_shift(self) -> Array:
        """Predicted mean of ``phi - phi_home`` of each rocker; relative error of second order."""
        bracket = 0.5 * self.cosine / self.rocker**2 - 0.5 / (self.coupler * self.rocker)
        return np.asarray(self.crank**2 / (2.0 * self.sine**3) * bracket)

    @property
    def second_over_first(self) -> Array:
        """Predicted ratio of second to first harmonic of each rocker: ``l_B / (4 l_BC)`` at a right-angle home."""
        tilt = self.cosine / self.rocker - np.exp(2j * np.arctan2(self.sine, self.cosine)) / self.coupler
        return np.asarray(self.crank * np.abs(tilt) / (4.0 * self.sine**2))

    @checked
    def rockers(self, psi: ArrayLike) -> Array:
        """Rocker motion ``phi - phi_home`` at wheel angles, shape (..., 3); error of third order in the cranks."""
        eta = finite_array("psi", psi, nan=True)[..., None] + self.phase - self.coupler_direction
        gamma = np.arctan2(self.sine, self.cosine)
        first = self.crank * np.cos(eta) / (self.rocker * self.sine)
        bracket = self.cosine * np.cos(eta) ** 2 / self.rocker**2
        bracket = bracket - np.cos(eta + gamma) ** 2 / (self.coupler * self.rocker)
        return np.asarray(first + self.crank**2 / (2.0 * self.sine**3) * bracket)

    @checked
    def poses(self, psi: ArrayLike) -> Array:
        """Platform motion of first order, shape (..., 3): an ellipse about the home pose."""
        turn = np.exp(1j * finite_array("psi", psi, nan=True))[..., None]
        return np.asarray(self.home + (turn * self.first_harmonic).real)


class CrankScale(NamedTuple):
    """Measured harmonics for cranks multiplied by ``scale``; ``predicted`` is the phasor of first order.

    ``first_error`` is the relative error of the predicted first harmonic, ``second`` the total distortion, ``mean`` the
    mean of the pose relative to home over the first harmonic; all with ``Lc``.
    """

    scale: float
    predicted: Complex
    first: Complex
    first_error: float
    second: float
    mean: float


@checked
def small_crank(mechanism: SingleMotorPlatform) -> SmallCrank:
    """Evaluate the small-crank theory at the home pose.

    Raises `GeometryError` if the mechanism has no regular home pose: a drive that locks there, or a singular platform.
    See theory/small-crank.

    >>> from graphsynth.systems.platform.single_motor_platform import SingleMotorPlatform
    >>> theory = small_crank(SingleMotorPlatform(crank=(9.0, 9.0, 9.0)))
    >>> theory.second_over_first.round(12).tolist()  # l_B / (4 l_BC)
    [0.05, 0.05, 0.05]
    """
    still = replace(mechanism, crank=(0.0, 0.0, 0.0))
    state = still.drive(0.0)
    home = still.home_pose(0.0)
    phi = state.theta - np.array(mechanism.delta)
    turn = np.exp(1j * np.array(mechanism.frame_angle))
    rocker = np.array(mechanism.rocker) * np.exp(1j * phi)
    direction = np.angle((np.array(mechanism.pivot) - np.array(mechanism.axis)) * turn + rocker)
    sine, cosine = np.sin(direction - phi), np.cos(direction - phi)
    for k in range(3):
        if abs(sine[k]) < 1e-9:
            raise GeometryError(
                f"drive {k + 1} locks at home: coupler and rocker in line; change the coupler or the distance of axes"
            )
    J = mechanism.platform.velocity_matrix(home, state.theta)
    dimensions = (np.array(getattr(mechanism, name)) for name in ("crank", "phase", "coupler", "rocker"))
    return SmallCrank(home, state.theta, phi, J, direction, sine, cosine, *dimensions)


@checked
def crank_scaling(
    mechanism: SingleMotorPlatform, scales: Sequence[float] = (1.0, 0.5, 0.25, 0.125), *, samples: int = 64
) -> tuple[CrankScale, ...]:
    """Predicted against measured harmonics for cranks multiplied by each scale: the limit to a sinusoid, measured.

    Distortion and mean fall in proportion to the scale, the error of the first harmonic with its square.

    Raises `GeometryError` if a turn is not complete at some scale.

    >>> from graphsynth.systems.platform.single_motor_platform import SingleMotorPlatform
    >>> large, small = crank_scaling(SingleMotorPlatform(crank=(4.0, 4.0, 4.0)), (1.0, 0.5))
    >>> round(large.second / small.second, 1), round(large.first_error / small.first_error, 1)
    (2.0, 4.0)
    """
    weight = np.array([1.0, 1.0, mechanism.Lc])
    psi = np.linspace(0.0, math.tau, samples + 1)
    found = []
    for scale in finite_array("scales", scales).ravel():
        lengths = (float(scale) * np.array(mechanism.crank)).tolist()
        scaled = replace(mechanism, crank=tuple(lengths))
        theory, motion = small_crank(scaled), scaled.full_turn(psi)
        if not motion.complete:
            raise GeometryError(f"cranks {lengths} make no full turn: {motion.stop_reason()}; use smaller scales")
        measured = harmonics(motion.pose[:-1])
        first, predicted = measured.order(1), theory.first_harmonic
        size = float(np.linalg.norm(weight * first))
        error = float(np.linalg.norm(weight * (first - predicted))) / size
        mean = float(np.linalg.norm(weight * (measured.mean - theory.home))) / size
        distortion = measured.total_distortion(mechanism.Lc)
        found.append(CrankScale(float(scale), predicted, first, error, distortion, mean))
    return tuple(found)


@dataclass(frozen=True, eq=False)
class Sweep:
    """Poses at ``psi = 2 pi j / N`` on one branch, and the motion that they were taken from, if any."""

    mechanism: SingleMotorPlatform
    psi: Array
    pose: Array
    theta: Array
    h_phi: Array
    sigma: tuple[int, ...]
    sign: int
    motion: TurnMotion | None = None


@checked
def cold_sweep(mechanism: SingleMotorPlatform, samples: int) -> Sweep:
    """Follow the home branch over a rotation with step control; `RejectedError` unless it closes."""
    samples = whole("samples", samples, 4, 100_000)
    _check_drives(mechanism)
    try:
        motion = mechanism.full_turn(np.linspace(0.0, math.tau, samples + 1))
    except GeometryError as error:
        raise RejectedError(str(error)) from error
    if not motion.complete:
        stopped = next((event for event in motion.events if event.ends_motion), None)
        where = "" if stopped is None else f" at psi = {stopped.psi:.6g}"
        raise RejectedError((motion.stop_reason() or "the tracked pose is not an assembly mode") + where)
    if motion.period != 1:
        raise RejectedError(f"the path does not close after one turn (period {motion.period})")
    if not motion.working_mode_constant:
        raise RejectedError("a leg passes its boundary: the working mode changes during the turn")
    psi, pose, theta, drive = (a[:-1] for a in (motion.psi, motion.pose, motion.theta, motion.drive))
    return Sweep(mechanism, psi, pose, theta, drive, motion.label.sigma, motion.label.sign, motion)


def _check_drives(mechanism: SingleMotorPlatform) -> None:
    for number, turn in enumerate(mechanism.drive_turns(), start=1):
        if turn.kind != "full turn":
            raise RejectedError(f"drive {number} makes no full rotation ({turn.kind})")


@checked
def warm_sweep(mechanism: SingleMotorPlatform, near: Sweep) -> Sweep:
    """Solve all samples by Newton from the poses of a neighbouring design; `RejectedError` unless its label is kept.

    Where Newton's method fails the rotation is followed from home.
    """
    _check_drives(mechanism)
    platform, weight = mechanism.platform, np.array([1.0, 1.0, mechanism.Lc])
    state = mechanism.drive(near.psi)
    theta = state.theta + math.tau * np.round((near.theta - state.theta) / math.tau)
    pose, size, settled = near.pose, math.inf, False
    for count in range(13):
        JX, JT = platform.jacobians(pose, theta)
        last_one = settled or count == 12
        if last_one and bool((np.sign(JT) != np.array(near.sigma)).any()):
            raise RejectedError("a leg passes its boundary: the working mode changes during the turn")
        if bool((determinant(JX) * near.sign <= 0.0).any()):
            raise RejectedError("det JX changes its sign: the platform is singular during the turn")
        if last_one:
            break
        step = np.linalg.solve(JX, -platform.closure(pose, theta)[..., None])[..., 0]
        pose = pose + step
        last, size = size, float(np.abs(step * weight).max()) / mechanism.Lc
        settled = size <= 1e-14 or (size <= 1e-11 and size >= 0.25 * last)
        if not settled and (size > 0.5 or (size >= last and size > 1e-11)):
            found = cold_sweep(mechanism, len(near.psi))
            if (found.sigma, found.sign) != (near.sigma, near.sign):
                raise RejectedError("the home branch has another label than that of the neighbouring design")
            return found
    return Sweep(mechanism, near.psi, pose, theta, state.h_phi, near.sigma, near.sign)


@checked
def pose_derivatives(sweep: Sweep) -> Array:
    """Return the derivatives of the poses by the design, shape (N, 3, 9).

    Columns: real parts of ``l_B exp(i psi0)`` of the three cranks, imaginary parts, coupler lengths.
    """
    mechanism = sweep.mechanism
    turn = np.exp(1j * np.array(mechanism.frame_angle))
    crank = np.array(mechanism.crank) * np.exp(1j * np.array(mechanism.phase))
    wheel = np.exp(1j * sweep.psi)[:, None]
    phi = sweep.theta - np.array(mechanism.delta)
    C = np.array(mechanism.pivot) * turn + np.array(mechanism.rocker) * np.exp(1j * phi)
    link = C - np.array(mechanism.axis) * turn - crank * wheel
    moment = 0.5 * sweep.h_phi
    along, across = (np.conj(link) * wheel).real / moment, (np.conj(link) * 1j * wheel).real / moment
    longer = np.array(mechanism.coupler) / moment
    J = mechanism.platform.velocity_matrix(sweep.pose, sweep.theta)
    return np.concatenate([J * rate[:, None, :] for rate in (along, across, longer)], axis=-1)
