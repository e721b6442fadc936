"""Singular poses by type, with the motion that is not held; distances from them and from other modes; statics.

Statics of the platform and of the single-motor mechanism: rocker torques, axial forces, crank and motor torque.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from graphsynth.core.checks import checked, finite, positive, triple, whole
from graphsynth.core.errors import GeometryError
from graphsynth.systems.platform.field import characteristic_length, determinant, scaled_rows, working_mode
from graphsynth.systems.platform.parallel_platform import ParallelPlatform
from graphsynth.systems.platform.singular_loci import CurveEquations

if TYPE_CHECKING:
    from graphsynth.systems.platform.single_motor_platform import SingleMotorPlatform

Array = NDArray[np.float64]

#: A pose whose relative margin is below this counts as singular.
TOLERANCE = 1e-9


@dataclass(frozen=True, eq=False)
class Singularity:
    """Type of a pose and its margins (estimated: floating point; the decision depends on ``tolerance``).

    * `kind`: "regular", "I", "II" or "III".
    * `legs`: legs (1 to 3) that are stretched or folded (type I).
    * `uncontrolled` (shape (m, 3)): motions ``(dx, dy, dalpha)`` possible with all rockers held (type II), each of
      scaled norm ``sqrt((dx^2 + dy^2) / Lc^2 + dalpha^2) = 1``; m = 0 if the platform is held.
    * `centre`: centre of the uncontrolled rotation; NaN for a translation, or if there is none or more than one motion.
    * `self_stress` (shape (m, 3)): axial forces of the links that are in balance without any load (type II), each of
      norm 1.
    * `lost` (shape (n, 3)): for every leg of type I the wrench direction ``(d_x, d_y, cross(F - p, d))`` in which its
      rocker cannot move the platform: admissible velocities do no work on it.
    * `determinant`: ``det JX``, length^4.
    * `smallest`: smallest singular value of ``JX diag(1, 1, 1/Lc)``, length.
    * `ratio`: the smallest over the largest singular value.
    * `sines`: ``sigma_k S_k / (2 l1 l2)``: sine of the angle between rocker and link, signed by the working mode.
    * `tolerance`: bound of ``ratio`` and of ``|sines|``.
    """

    kind: str
    legs: tuple[int, ...]
    uncontrolled: Array
    centre: complex
    self_stress: Array
    lost: Array
    determinant: float
    smallest: float
    ratio: float
    sines: tuple[float, float, float]
    Lc: float
    tolerance: float


@checked
def closed_pose(platform: ParallelPlatform, pose: ArrayLike, theta: ArrayLike) -> tuple[Array, Array]:
    """Check one pose with its rocker angles: finite, and closed to 1e-6 of the longest link.

    Raises `GeometryError`: not three numbers each, or legs that do not close.
    """
    X, t = triple("pose", pose), triple("theta", theta)
    size = max(*platform.l1, *platform.l2)
    opened = float(np.abs(platform.closure(X, t)).max())
    if opened > 1e-6 * size * size:
        raise GeometryError(
            f"the legs are open by {opened:.3g} (squared length) at this pose, more than 1e-6 of {size:.6g}^2; "
            "give rocker angles that belong to the pose"
        )
    return X, t


@checked
def singularity(
    platform: ParallelPlatform,
    pose: ArrayLike,
    theta: ArrayLike,
    *,
    Lc: float | None = None,
    tolerance: float = TOLERANCE,
) -> Singularity:
    """Classify a pose and give the motions and forces that are not determined there.

    `pose`, `theta` (shape (3,)): a closed pose, or `GeometryError`. `Lc`: characteristic length, by default
    `characteristic_length`. [Gosselin & Angeles 1990]; theory/platform-jacobians 3.

    >>> import numpy as np
    >>> mock = ParallelPlatform.mock()
    >>> pose = [0.0, 0.0, 2.0 * np.arctan(3.0 / 7.0)]
    >>> found = singularity(mock, pose, mock.inverse(pose, (-1, -1, -1)).theta)
    >>> found.kind, found.uncontrolled.round(9).tolist(), abs(found.centre) < 1e-9
    ('II', [[0.0, 0.0, 1.0]], True)
    """
    X, t = closed_pose(platform, pose, theta)
    length = characteristic_length(platform) if Lc is None else positive("Lc", Lc)
    JX, JT = platform.jacobians(X, t)
    left, values, right = np.linalg.svd(scaled_rows(JX, length))
    largest = float(values[0]) if values[0] > 0.0 else 1.0
    free = values <= tolerance * largest

    def oriented(rows: Array) -> Array:
        """Signs chosen so that the largest entry of each row is positive."""
        largest = np.take_along_axis(rows, np.abs(rows).argmax(axis=1)[:, None], axis=1)
        return np.asarray(rows * np.sign(largest) + 0.0)

    uncontrolled = oriented(right[free]) * np.array([length, length, 1.0])
    stress = (left[:, free] * (2.0 * np.array(platform.l2))[:, None]).T
    stress = oriented(stress / np.linalg.norm(stress, axis=1, keepdims=True))
    arms = 2.0 * np.array(platform.l1) * np.array(platform.l2)
    sines = np.where(arms > 0.0, JT / np.where(arms > 0.0, arms, 1.0), 0.0)
    legs = tuple(k + 1 for k in range(3) if abs(sines[k]) <= tolerance)
    lost = np.array([0.5 * JX[k - 1] for k in legs]).reshape(-1, 3)
    kind = ("regular", "I", "II", "III")[bool(legs) + 2 * bool(free.any())]
    centre = complex(math.nan, math.nan)
    if len(uncontrolled) == 1 and abs(uncontrolled[0, 2]) >= 1e-12:
        dx, dy, turn = uncontrolled[0].tolist()
        centre = complex(*X[:2]) + 1j * complex(dx, dy) / turn
    sizes = (float(np.linalg.det(JX)), float(values[-1]), float(values[-1]) / largest)
    moved = (kind, legs, uncontrolled, centre, stress, lost)
    return Singularity(*moved, *sizes, tuple(sines.tolist()), length, tolerance)


class NearestSingularity(NamedTuple):
    """Nearest singular pose found: ``kind`` "I" or "II", leg (0 for type II), pose, distance (length)."""

    kind: str
    leg: int
    pose: tuple[float, float, float]
    distance: float


@dataclass(frozen=True, eq=False)
class SingularityDistance:
    """Distances in the norm ``sqrt(dx^2 + dy^2 + Lc^2 dalpha^2)`` (theory/platform-workspace 3).

    * `determinant`, `smallest`, `sines`: as in `Singularity`, the sines without sign.
    * `other_mode`: distance to the nearest other assembly mode for the same rocker angles; infinite if there is none.
    * `type_one`: nearest pose at which a leg is stretched or folded: a minimum over one angle per circle, found on a
      grid and refined (estimated, error about 1e-9 Lc).
    * `type_two`: nearest pose with ``det JX = 0`` in the same working mode inside the ball of radius
      ``type_one.distance``, by constrained minimisation from the sign changes on rays (estimated); None if none was
      found there.
    """

    determinant: float
    smallest: float
    sines: tuple[float, float, float]
    other_mode: float
    other_pose: tuple[float, float, float] | None
    type_one: NearestSingularity
    type_two: NearestSingularity | None
    Lc: float

    @property
    def nearest(self) -> NearestSingularity:
        """The nearer of the two."""
        if self.type_two is not None and self.type_two.distance < self.type_one.distance:
            return self.type_two
        return self.type_one


@checked
def singularity_distance(
    platform: ParallelPlatform, pose: ArrayLike, sigma: Sequence[int], *, Lc: float | None = None, rays: int = 400
) -> SingularityDistance:
    """Measure the distance of a pose from the singularities of its working mode.

    `pose`: shape (3,). `sigma` (of {+1, -1}): working mode. `Lc`: characteristic length; the largest distance of a
    vertex from the reference point by default. `rays`: directions searched for type II. Raises `GeometryError`: a pose
    out of reach, or a leg with a link of length zero. The nearest pose beyond the reach of *some* leg is also the
    nearest end of the workspace, so type I needs one leg at a time.  Compare [Kapilavai & Nawratil 2023] for 3-RPR
    platforms.

    >>> found = singularity_distance(ParallelPlatform.mock(), [0.0, 0.0, 0.0], (-1, -1, -1))
    >>> found.nearest.kind, found.nearest.distance > 15.0
    ('I', True)
    """
    mode, rays = working_mode(sigma), whole("rays", rays, 1)
    length = characteristic_length(platform) if Lc is None else positive("Lc", Lc)
    X = triple("pose", pose)
    theta = platform.inverse(X, mode).theta
    for leg in range(3):
        if min(platform.l1[leg], platform.l2[leg]) == 0.0:
            raise GeometryError(f"leg {leg + 1} has a link of length zero, so every pose is singular; give l1, l2 > 0")
        if not math.isfinite(theta[leg]):
            raise GeometryError(f"leg {leg + 1} does not reach the pose {X.tolist()}; choose a pose in the workspace")
    JX, JT = platform.jacobians(X, theta)
    sines = np.abs(JT) / (2.0 * np.array(platform.l1) * np.array(platform.l2))
    modes = platform.direct(theta).poses
    gaps = modes - X
    gaps[:, 2] = length * (np.mod(gaps[:, 2] + math.pi, math.tau) - math.pi)
    distances = np.linalg.norm(gaps, axis=1)
    order = np.argsort(distances)[1:2]  # the nearest is the pose itself
    first = _type_one(platform, X, length)
    return SingularityDistance(
        float(determinant(JX)),
        float(np.linalg.svd(scaled_rows(JX, length), compute_uv=False)[-1]),
        tuple(sines.tolist()),
        float(distances[order[0]]) if len(order) else math.inf,
        tuple(modes[order[0]].tolist()) if len(order) else None,
        first,
        _type_two(platform, X, mode, length, first.distance, rays),
        length,
    )


def _type_one(platform: ParallelPlatform, X: Array, Lc: float) -> NearestSingularity:
    """At each orientation the nearest point of a circle is known; minimise over the orientation."""
    from scipy.optimize import minimize_scalar

    p = complex(X[0], X[1])
    found = []
    turn = np.linspace(-math.pi, math.pi, 721)
    for k in range(3):
        l1, l2 = platform.l1[k], platform.l2[k]
        for radius in {l1 + l2, abs(l1 - l2)}:

            def away(a: Any, k: int = k) -> Any:
                return p - (platform.D[k] - np.exp(1j * (X[2] + a)) * platform.b[k])

            def square(a: Any, radius: float = radius, away: Any = away) -> Any:
                return (np.abs(away(a)) - radius) ** 2 + (Lc * a) ** 2

            i = int(np.argmin(square(turn)))
            low, high = turn[max(i - 1, 0)], turn[min(i + 1, 720)]
            a = float(minimize_scalar(square, bounds=(low, high), method="bounded", options={"xatol": 1e-13}).x)
            gap = complex(away(a))
            q = p - gap + radius * (gap / abs(gap) if gap else 1.0)
            pose = (q.real, q.imag, float(X[2] + a))
            found.append(NearestSingularity("I", k + 1, pose, math.sqrt(float(square(a)))))
    return min(found, key=lambda place: place.distance)


def _type_two(
    platform: ParallelPlatform, X: Array, mode: tuple[int, int, int], Lc: float, radius: float, rays: int
) -> NearestSingularity | None:
    """Sign changes of ``det JX`` along rays inside the ball give starts for a constrained minimisation."""
    if radius <= 0.0:
        return None
    shares = (np.arange(1, 33) - 0.5) / 32.0
    k = np.arange(rays) + 0.5  # directions spread over the sphere by a golden spiral
    height, turn = 1.0 - 2.0 * k / rays, math.pi * (1.0 + math.sqrt(5.0)) * k
    ring = np.sqrt(1.0 - height**2)
    unit = np.column_stack([ring * np.cos(turn), ring * np.sin(turn), height / Lc])
    poses = X + radius * shares[None, :, None] * unit[:, None, :]
    here = float(determinant(platform.jacobians(X, platform.inverse(X, mode).theta)[0]))
    values = determinant(platform.jacobians(poses, platform.inverse(poses, mode).theta)[0])
    changed = values * here <= 0.0
    rows = np.flatnonzero(changed.any(axis=1))
    first = np.argmax(changed[rows], axis=1)
    starts = poses[rows, first][np.argsort(first, kind="stable")][:24:3]
    found = (_minimise(platform, X, mode, Lc, start) for start in starts)
    near = [place for place in found if place is not None and place.distance <= radius]
    return min(near, key=lambda place: place.distance, default=None)


def _minimise(
    platform: ParallelPlatform, X: Array, mode: tuple[int, int, int], Lc: float, start: Array
) -> NearestSingularity | None:
    """Smallest distance from X subject to closure and ``det JX = 0``, in (x, y, alpha, theta): smooth at type I too."""
    from scipy.optimize import minimize

    scale = np.array([Lc, Lc, 1.0])

    def constrained(v: Array) -> tuple[Array, Array]:
        """Residuals of closure and determinant; signed reach of the legs."""
        curve = CurveEquations(platform, float(v[2] + X[2]), Lc)
        state = np.concatenate([v[:2] + X[:2] / Lc, v[3:]])
        return curve.evaluate(state)[0], np.array(mode) * curve.reach(state)

    found = minimize(
        lambda v: 0.5 * float(v[:3] @ v[:3]),
        np.concatenate([(start - X) / scale, platform.inverse(start, mode).theta]),
        jac=lambda v: np.concatenate([v[:3], np.zeros(3)]),
        method="SLSQP",
        constraints=[
            {"type": "eq", "fun": lambda v: constrained(v)[0]},
            {"type": "ineq", "fun": lambda v: constrained(v)[1]},
        ],
        options={"ftol": 1e-14, "maxiter": 200},
    )
    v = np.asarray(found.x, dtype=np.float64)
    residuals, margins = constrained(v)
    if np.abs(residuals).max() > 1e-7 or margins.min() < -1e-7:
        return None
    return NearestSingularity("II", 0, tuple((X + v[:3] * scale).tolist()), Lc * float(np.linalg.norm(v[:3])))


@dataclass(frozen=True, eq=False)
class Statics:
    """Forces that hold the platform against a wrench (massless, frictionless links; estimated: floating point).

    * `status`: "balanced"; "cannot be balanced" (type II, the wrench does work on the uncontrolled motion: all forces
      NaN); "indeterminate" (type II, it does none: the forces of least norm, any multiple of
      ``singularity.self_stress`` may be added).
    * `rocker_torque` (shape (3,)): torques at the rockers, force x length.
    * `link_force` (shape (3,)): axial forces of the intermediate links, positive when the link pushes.
    * `unbalanced_power` (shape (m,)): work of the wrench on each uncontrolled motion of ``singularity.uncontrolled``.
    * `singularity`: type of the pose, with the uncontrolled motion.
    """

    status: str
    rocker_torque: Array
    link_force: Array
    unbalanced_power: Array
    singularity: Singularity


@dataclass(frozen=True, eq=False)
class CrankStatics:
    """Forces through the single-motor mechanism.

    * `status`: as in `Statics`; also "drive k locked", where no crank torque gives a rocker torque, with NaN.
    * `crank_torque`: torque at the common wheel axis (sum over the three wheels), ``(dX/dpsi)^T W``.
    * `motor_torque`: torque at the pinion for lossless gears, with the sign of its own rotation.
    * `coupler_force` (shape (3,)): axial forces of the couplers, positive when the coupler pushes.
    * `shares` (shape (3,)): crank torque of each drive.
    """

    status: str
    crank_torque: float
    motor_torque: float
    coupler_force: Array
    shares: Array
    platform: Statics


@checked
def statics(
    platform: ParallelPlatform,
    pose: ArrayLike,
    theta: ArrayLike,
    wrench: ArrayLike,
    *,
    Lc: float | None = None,
    tolerance: float = TOLERANCE,
) -> Statics:
    """Rocker torques and link forces for the wrench that the platform exerts on its surroundings.

    `pose`, `theta` (shape (3,)): a closed pose. `wrench` (shape (3,)): ``(W_x, W_y, W_alpha)``: force and moment about
    the reference point. `Lc`, `tolerance`: see `graphsynth.systems.platform.singularity.singularity`. Raises
    `GeometryError`: a wrench without three components, or legs that do not close. See theory/platform-jacobians 4:
    ``JX^T lambda = W``, ``tau_k = -JT_kk lambda_k``, axial force ``2 l2_k lambda_k``.

    >>> mock = ParallelPlatform.mock()
    >>> theta = mock.inverse([0.0, 0.0, 0.0], (-1, -1, -1)).theta
    >>> statics(mock, [0.0, 0.0, 0.0], theta, [0.0, 0.0, 72.0]).rocker_torque.round(9).tolist()
    [-25.0, -25.0, -25.0]
    """
    X, t = closed_pose(platform, pose, theta)
    W = triple("wrench", wrench)
    found = singularity(platform, X, t, Lc=Lc, tolerance=tolerance)
    JX, JT = platform.jacobians(X, t)
    scale = np.array([1.0, 1.0, 1.0 / found.Lc])
    power = found.uncontrolled @ W
    if not len(found.uncontrolled):
        factor = np.linalg.solve((JX * scale).T, W * scale)
        return Statics("balanced", -JT * factor, 2.0 * np.array(platform.l2) * factor, power, found)
    if bool((np.abs(power) > 1e-7 * found.Lc * float(np.linalg.norm(W * scale))).any()):
        return Statics("cannot be balanced", np.full(3, np.nan), np.full(3, np.nan), power, found)
    factor = np.linalg.lstsq((JX * scale).T, W * scale, rcond=tolerance)[0]
    return Statics("indeterminate", -JT * factor, 2.0 * np.array(platform.l2) * factor, power, found)


@checked
def crank_statics(
    mechanism: SingleMotorPlatform, psi: float, pose: ArrayLike, wrench: ArrayLike, *, tolerance: float = TOLERANCE
) -> CrankStatics:
    """Crank torque, motor torque and coupler forces of the single-motor mechanism at one configuration.

    `psi`: wheel angle, radians. `pose` (shape (3,)): platform pose that belongs to it (a row of ``full_turn().pose``).
    `wrench` (shape (3,)): wrench that the platform exerts on its surroundings. Raises `GeometryError`: an angle at
    which a drive cannot be assembled, or a wrench without three components. See theory/platform-jacobians 4 and
    theory/platform-drive 3.  At a dead point of a rocker its share of the crank torque is zero whatever the load.

    >>> from graphsynth.systems.platform.single_motor_platform import SingleMotorPlatform
    >>> mechanism = SingleMotorPlatform()
    >>> held = crank_statics(mechanism, 0.0, mechanism.home_pose(0.0), [1.0, 0.0, 0.0])
    >>> held.status, abs(held.motor_torque / held.crank_torque)
    ('balanced', 0.5)
    """
    state = mechanism.drive(finite("psi", psi))
    for k in np.flatnonzero(~np.isfinite(state.theta))[:1]:
        raise GeometryError(f"drive {k + 1} cannot be assembled at psi = {psi}; choose an angle inside its reach")
    held = statics(mechanism.platform, pose, state.theta, wrench, Lc=mechanism.Lc, tolerance=tolerance)
    moment = 0.5 * state.h_phi  # cross(C - D, C - B)
    sine = moment / (np.array(mechanism.rocker) * np.array(mechanism.coupler))
    locked = [k + 1 for k in range(3) if abs(sine[k]) <= tolerance]
    with np.errstate(divide="ignore", invalid="ignore"):
        coupler = np.where(np.abs(sine) > tolerance, held.rocker_torque * np.array(mechanism.coupler) / moment, np.nan)
    shares = held.rocker_torque * np.where(np.abs(sine) > tolerance, state.theta1, np.nan)
    total = float(shares.sum())
    status = held.status
    if locked and status != "cannot be balanced":
        status = f"drive {', '.join(map(str, locked))} locked"
    return CrankStatics(status, total, mechanism.gears.ratio * total, coupler, shares, held)
