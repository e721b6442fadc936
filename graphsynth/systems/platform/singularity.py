"""Singular poses by type, with the motion that is not held, instead of large numbers."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from graphsynth.core.checks import checked, finite_array, positive
from graphsynth.core.errors import GeometryError
from graphsynth.systems.platform.field import characteristic_length, scaled_rows
from graphsynth.systems.platform.parallel_platform import ParallelPlatform

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
    * `Lc`, `tolerance`: characteristic length; bound of ``ratio`` and of ``|sines|``.
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
    X, t = finite_array("pose", pose).reshape(-1), finite_array("theta", theta).reshape(-1)
    if X.shape != (3,) or t.shape != (3,):
        raise GeometryError(f"pose and theta have {X.size} and {t.size} numbers; give three each")
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

    `pose`, `theta` (shape (3,)): a closed pose. `Lc`: characteristic length; the largest distance of a vertex from the
    reference point by default. Raises `GeometryError` if the legs are not closed. [Gosselin & Angeles 1990];
    theory/platform-jacobians 3.

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
    weight = np.array([length, length, 1.0])
    uncontrolled = np.array([_oriented(row) * weight for row in right[free]]).reshape(-1, 3)
    links = 2.0 * np.array(platform.l2)
    stress = (left[:, free] * links[:, None]).T
    stress = np.array([_oriented(row / np.linalg.norm(row)) for row in stress]).reshape(-1, 3)
    arms = 2.0 * np.array(platform.l1) * np.array(platform.l2)
    sines = np.where(arms > 0.0, JT / np.where(arms > 0.0, arms, 1.0), 0.0)
    legs = tuple(k + 1 for k in range(3) if abs(sines[k]) <= tolerance)
    lost = np.array([0.5 * JX[k - 1] for k in legs]).reshape(-1, 3)
    kind = ("regular", "I", "II", "III")[bool(legs) + 2 * bool(free.any())]
    return Singularity(
        kind,
        legs,
        uncontrolled,
        _centre(X, uncontrolled),
        stress,
        lost,
        float(np.linalg.det(JX)),
        float(values[-1]),
        float(values[-1]) / largest,
        (float(sines[0]), float(sines[1]), float(sines[2])),
        length,
        tolerance,
    )


def _oriented(row: Array) -> Array:
    """Sign chosen so that the largest entry is positive."""
    return np.asarray(row * np.sign(row[int(np.argmax(np.abs(row)))]) + 0.0)


def _centre(X: Array, motions: Array) -> complex:
    if len(motions) != 1 or abs(motions[0, 2]) < 1e-12:
        return complex(math.nan, math.nan)
    dx, dy, turn = (float(value) for value in motions[0])
    return complex(float(X[0]), float(X[1])) + 1j * complex(dx, dy) / turn
