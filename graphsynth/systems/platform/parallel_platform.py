"""The planar three-leg parallel platform (3-RRR): inverse problem, Jacobians, statics, all assembly modes.

Points of the plane are complex numbers; a pose is ``(x, y, alpha)``.  Angles in radians, lengths in one common unit.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from graphsynth.core.checks import (
    check_largest,
    finite_array,
    not_negative,
    positive,
    three,
    three_points,
    together,
    triple,
    triples,
)
from graphsynth.core.errors import GeometryError
from graphsynth.kinematics.triad.assembly_modes import (
    AssemblyModeBatch,
    AssemblyModes,
    assembly_modes,
    assembly_modes_batch,
)
from graphsynth.kinematics.triad.leg import LegStatus, PlatformLegs, sensitivity

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]

#: The eight working modes (sigma_1, sigma_2, sigma_3), in the order of the second last axis of `InverseSolution.theta`.
WORKING_MODES: NDArray[np.int64] = np.array([[a, b, c] for a in (1, -1) for b in (1, -1) for c in (1, -1)])


@dataclass(frozen=True, eq=False)
class InverseSolution:
    """Rocker angles of every leg and their reach.

    * `theta` (shape (..., 8, 3) or (..., 3)): rocker angles in (-pi, pi]: all eight working modes in the order of
      ``WORKING_MODES``, or the one asked for. NaN for a leg out of reach or free; see ``status``.
    * `status` (shape (..., 3)): `LegStatus` of every leg.
    * `pose` (shape (..., 3)): the poses asked for.
    * `platform`: the platform asked.
    """

    theta: Array
    status: NDArray[np.int8]
    pose: Array
    platform: ParallelPlatform

    @cached_property
    def _reach(self) -> tuple[Array, Array]:
        S, deficit = self.platform._legs.reach(self.pose.reshape(-1, 3))
        return S.reshape(self.status.shape), deficit.reshape(self.status.shape)

    @property
    def S(self) -> Array:
        """Magnitude of the Jacobian entry ``JT_kk``, (..., 3); 0 on the boundary of the reach, NaN beyond it."""
        return self._reach[0]

    @property
    def deficit(self) -> Array:
        """Signed distance missing (positive) or margin left (negative), (..., 3)."""
        return self._reach[1]

    @property
    def sensitivity(self) -> Array:
        """Bound of ``|d theta| / |dF|``, (..., 3): ``2 l2 / S``; infinite on the boundary."""
        return sensitivity(self.S, np.array(self.platform.l2))

    @property
    def reachable(self) -> NDArray[np.bool_]:
        """True where all three legs reach the pose with a definite angle, shape (...)."""
        return np.asarray((self.status <= LegStatus.BOUNDARY).all(axis=-1))


def _lengths(name: str, values: Any) -> tuple[float, ...]:
    try:
        alone = np.ndim(values) == 0
    except ValueError:  # parts of different lengths: the rule of a number finds the one that is none
        alone = False
    given = (values,) * 3 if alone else three(name, values)
    return tuple(not_negative(f"{name} of leg {leg}", value) for leg, value in enumerate(given, 1))


@dataclass(frozen=True)
class ParallelPlatform:
    """Three legs, each a rocker on the base and an intermediate link to a vertex of the moving platform.

    Parameters
    ----------
    D : sequence of 3 complex
        Rocker pivots in the fixed frame.
    b : sequence of 3 complex
        Platform vertices in the platform frame.
    l1, l2 : float or sequence of 3 floats
        Rocker arms and intermediate links, zero or more.

    Raises
    ------
    GeometryError
        A negative or NaN length, a point that is not finite (the message names the leg), a largest dimension that is
        not between 1e-60 and 1e60.

    Notes
    -----
    See theory/platform-inverse, theory/platform-jacobians and theory/platform-direct.  All batch methods take poses of
    shape (..., 3) and angles of shape (..., 3) and broadcast.

    Examples
    --------
    >>> platform = ParallelPlatform.g1()
    >>> platform.inverse([1.2, 0.9, 0.15], sigma=(1, 1, 1)).theta.round(6).tolist()
    [1.820204, -2.644475, -0.161983]
    """

    D: tuple[complex, complex, complex]
    b: tuple[complex, complex, complex]
    l1: tuple[float, float, float]
    l2: tuple[float, float, float]

    def __post_init__(self) -> None:
        object.__setattr__(self, "D", three_points("D", self.D))
        object.__setattr__(self, "b", three_points("b", self.b))
        object.__setattr__(self, "l1", _lengths("l1", self.l1))
        object.__setattr__(self, "l2", _lengths("l2", self.l2))
        check_largest(float(np.abs((*self.D, *self.b, *self.l1, *self.l2)).max()))

    @cached_property
    def _legs(self) -> PlatformLegs:
        return PlatformLegs(self.D, self.b, self.l1, self.l2)

    @classmethod
    def g1(cls) -> ParallelPlatform:
        """Return the generic asymmetric reference platform G1 (theory/platform-inverse 3; no unit)."""
        return cls(
            (0, 2.5 + 0.2j, 1.1 + 2.3j), (-0.4 - 0.25j, 0.45 - 0.3j, 0.05 + 0.5j), (0.9, 1.0, 0.8), (1.1, 0.95, 1.05)
        )

    @classmethod
    def mock(cls) -> ParallelPlatform:
        """Return the symmetric mock-up MOCK-RECT (millimetres).

        See theory/platform-inverse 3 and theory/platform-drive 8.
        """
        turn = directions((-5 * math.pi / 6, -math.pi / 6, math.pi / 2))
        return cls(tuple((105 + 45j) * turn), tuple(45 * turn), (45.0,) * 3, (60.0,) * 3)

    def vertices(self, pose: ArrayLike) -> Complex:
        """Platform vertices F_k in the fixed frame, shape (..., 3), for poses (..., 3)."""
        X = triples("pose", pose)
        return np.asarray(X[..., 0:1] + 1j * X[..., 1:2] + np.exp(1j * X[..., 2:3]) * np.array(self.b))

    def elbows(self, theta: ArrayLike) -> Complex:
        """Joints A_k between rocker and intermediate link, (..., 3), for rocker angles (..., 3); NaN stays NaN."""
        theta = triples("theta", theta, nan=True)
        return np.asarray(np.array(self.D) + np.array(self.l1) * np.exp(1j * theta))

    def inverse(self, pose: ArrayLike, sigma: ArrayLike | None = None) -> InverseSolution:
        """Rocker angles for poses (..., 3): all eight working modes, or the mode ``sigma`` (theory/platform-inverse 4).

        Accurate to a few 1e-16 rad for the vertices as computed, also for extreme length ratios and beside the boundary
        of the reach.  A leg out of reach gives NaN and a status, never a clipped angle.

        Raises
        ------
        GeometryError
            A pose that is not finite, or a sigma that is not made of +1 and -1.
        """
        X = triples("pose", pose)
        rows = np.ascontiguousarray(X.reshape(-1, 3))
        if sigma is None:
            theta, status = self._legs.solve(rows, WORKING_MODES.astype(np.float64), 8)
            return InverseSolution(theta.reshape(*X.shape[:-1], 8, 3), status.reshape(X.shape), X, self)
        mode = finite_array("sigma", sigma)
        if not bool(np.all(np.abs(mode) == 1)) or mode.shape[-1:] != (3,):
            raise GeometryError(f"sigma = {sigma!r} must hold three entries +1 or -1, the working mode")
        if mode.ndim > 1:
            X, mode = np.broadcast_arrays(*together(pose=X, sigma=mode))
            rows = np.ascontiguousarray(X.reshape(-1, 3))
        theta, status = self._legs.solve(rows, np.ascontiguousarray(mode.reshape(-1, 3)), 1)
        return InverseSolution(theta.reshape(X.shape), status.reshape(X.shape), X, self)

    def closure(self, pose: ArrayLike, theta: ArrayLike) -> Array:
        """Residuals ``f_k = |F_k - A_k|^2 - l2_k^2``, shape (..., 3), unit length^2."""
        X, theta = together(pose=pose, theta=theta)
        gap = np.abs(self.vertices(X) - self.elbows(theta))
        l2 = np.array(self.l2)
        return np.asarray((gap - l2) * (gap + l2))

    def jacobians(self, pose: ArrayLike, theta: ArrayLike) -> tuple[Array, Array]:
        """Exact partial derivatives of the closure (theory/platform-jacobians 1).

        Returns
        -------
        JX : ndarray, shape (..., 3, 3)
            ``df/dX``; columns in length, length, length^2.
        JT : ndarray, shape (..., 3)
            Diagonal of ``df/dtheta``; on the closure ``JT_k = sigma_k S_k``.
        """
        X, theta = together(pose=triples("pose", pose), theta=theta)
        d = self.vertices(X) - self.elbows(theta)
        arm = np.exp(1j * X[..., 2:3]) * np.array(self.b)
        rocker = np.array(self.l1) * np.exp(1j * theta)
        JX = 2.0 * np.stack([d.real, d.imag, cross(arm, d)], axis=-1)
        return JX, np.asarray(-2.0 * cross(rocker, d))

    def determinant(self, pose: ArrayLike, theta: ArrayLike) -> Array:
        """``det JX``, shape (...), unit length^4; zero at a type-II singularity."""
        with np.errstate(invalid="ignore"):  # NaN stays NaN
            return np.asarray(np.linalg.det(self.jacobians(pose, theta)[0]))

    def working_mode(self, pose: ArrayLike, theta: ArrayLike) -> NDArray[np.int64]:
        """Working mode (..., 3) of closed poses from the sign of JT; 0 on the boundary of the reach, and for NaN."""
        return np.asarray(np.nan_to_num(np.sign(self.jacobians(pose, theta)[1])), dtype=np.int64)

    def velocity_matrix(self, pose: ArrayLike, theta: ArrayLike) -> Array:
        """``J = -JX^-1 JT``: platform velocity per unit rocker speed, shape (..., 3, 3).

        Raises
        ------
        GeometryError
            At an exactly singular pose (type II), where J does not exist.
        """
        JX, JT = self.jacobians(pose, theta)
        return _solve(JX, -JT[..., None, :] * np.eye(3), "velocity matrix")

    def scaled_velocity_matrix(self, pose: ArrayLike, theta: ArrayLike, Lc: float) -> Array:
        """``diag(1/Lc, 1/Lc, 1) J`` with the characteristic length ``Lc``, dimensionless.

        See theory/platform-jacobians 3.
        """
        Lc = positive("Lc", Lc)
        return np.asarray(self.velocity_matrix(pose, theta) / np.array([Lc, Lc, 1.0])[:, None])

    def accelerations(
        self, pose: ArrayLike, theta: ArrayLike, rate: ArrayLike, rate2: ArrayLike
    ) -> tuple[Array, Array]:
        """X' and X'' for given theta' and theta'' with respect to any parameter, shapes (..., 3).

        See theory/platform-jacobians 2.

        Raises
        ------
        GeometryError
            At an exactly singular pose (type II), where there are none; shapes that do not fit each other.
        """
        X, angle, t1, t2 = together(pose=pose, theta=theta, rate=rate, rate2=rate2)
        JX, JT = self.jacobians(X, angle)
        first = _solve(JX, -(JT * t1)[..., None], "velocities")[..., 0]
        rocker, arm = np.array(self.l1) * np.exp(1j * angle), np.exp(1j * X[..., 2:3]) * np.array(self.b)
        d, turn = self.vertices(X) - self.elbows(theta), first[..., 2:3]
        speed = (first[..., 0] + 1j * first[..., 1])[..., None] + 1j * arm * turn - 1j * rocker * t1  # F' - A'
        push = rocker * (1j * t2 - t1 * t1) + arm * turn * turn
        right = 2.0 * ((np.conj(d) * push).real - np.abs(speed) ** 2)
        return first, _solve(JX, right[..., None], "accelerations")[..., 0]

    def rocker_torques(self, pose: ArrayLike, theta: ArrayLike, wrench: ArrayLike) -> Array:
        """Torques ``J^T W`` at the rockers that balance the wrench W exerted by the platform.

        See theory/platform-jacobians 4.

        Raises
        ------
        GeometryError
            As `velocity_matrix`; a wrench that is not made of three numbers.
        """
        X, angle, W = together(pose=pose, theta=theta, wrench=wrench)
        return np.asarray(np.einsum("...ij,...i->...j", self.velocity_matrix(X, angle), W))

    def direct(self, theta: ArrayLike) -> AssemblyModes:
        """All assembly modes for rocker angles ``theta``, shape (3,) (theory/platform-direct).

        An empty list is a valid answer.  Near a type-II singularity the computation continues at 50 digits and says so.
        """
        theta = triple("theta", theta)
        return assembly_modes(
            self.elbows(theta), np.array(self.b), np.array(self.l2), arms=(self.D, self.l1, tuple(theta))
        )

    def direct_batch(self, theta: ArrayLike, *, escalate: bool = True) -> AssemblyModeBatch:
        """All assembly modes for many rocker angles (radians), shape (N, 3); see `assembly_modes_batch`.

        Flagged problems are solved again at 50 digits from the given angles unless ``escalate`` is False.

        Raises
        ------
        GeometryError
            Angles of another shape, or that are not finite.
        """
        from graphsynth.kinematics.triad.kernels.modes import elbows

        angles = np.require(np.atleast_2d(triples("theta", theta)), requirements=["C", "W"])
        if angles.ndim != 2:
            raise GeometryError(f"theta has shape {angles.shape}; give (N, 3)")
        anchors = np.empty(angles.shape, dtype=np.complex128)
        elbows(angles, np.array(self.D), np.array(self.l1), anchors)
        arms = (np.array(self.D), np.array(self.l1), angles)
        return assembly_modes_batch(anchors, np.array(self.b), np.array(self.l2), escalate=escalate, arms=arms)

    def condition_number(self, pose: ArrayLike, theta: ArrayLike, Lc: float) -> Array:
        """Condition number of JX with its third column divided by the characteristic length ``Lc``, shape (...).

        Infinite at a type-II singularity (theory/platform-jacobians 3).
        """
        JX, _ = self.jacobians(pose, theta)
        scaled = JX / np.array([1.0, 1.0, positive("Lc", Lc)])
        known = np.isfinite(scaled).all(axis=(-2, -1))
        found = np.linalg.cond(np.where(known[..., None, None], scaled, np.eye(3)))
        return np.asarray(np.where(known, found, np.nan))


def _solve(JX: Array, right: Array, what: str) -> Array:
    """Solve for what an exactly singular platform does not have."""
    try:
        return np.asarray(np.linalg.solve(JX, right), dtype=np.float64)
    except np.linalg.LinAlgError as error:
        raise GeometryError(f"det JX = 0: the platform is singular (type II) and has no {what}") from error


def cross(a: Any, b: Any) -> Any:
    """Cross product ``x_a y_b - y_a x_b`` of complex numbers or arrays of them.

    >>> cross(1 + 2j, 3 - 1j)
    -7.0
    """
    return a.real * b.imag - a.imag * b.real


def directions(angles: Sequence[float]) -> NDArray[np.complex128]:
    """``exp(i beta)`` for angles in radians, with multiples of 30 degrees rounded correctly.

    >>> directions([math.pi / 6, -math.pi / 2]).tolist()
    [(0.8660254037844386+0.5j), -1j]
    """
    twelfths = [round(angle * 6.0 / math.pi) for angle in angles]
    table = [0.0, 0.5, 0.5 * math.sqrt(3.0), 1.0, 0.5 * math.sqrt(3.0), 0.5]

    def sine(k: int) -> float:
        return table[k % 6] if k % 12 < 6 else 0.0 - table[k % 6]  # 0.0, not -0.0

    return np.array(
        [
            complex(sine(k + 3), sine(k)) if abs(angle - k * math.pi / 6.0) < 1e-15 else np.exp(1j * angle)
            for k, angle in zip(twelfths, angles)
        ]
    )
