"""The twelve loop equations: passive joint angles, analytic Jacobian, rank of the coordinates, Newton's method.

Each leg is a product of one-step matrices: rotations by an unknown or given angle, shifts, one mounting rotation.
Position rows are divided by ``l1``, so that lengths and angles weigh alike (theory/antenna 3 to 5).

Newton's method is independent of the closed form.  A root counts only if the orientation reached through each leg
agrees with the gimbal: the scalar equations are also satisfied when it is off by half a turn about a coordinate axis.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from graphsynth.core.checks import choice
from graphsynth.core.errors import GeometryError
from graphsynth.systems.antenna.closed_form import crank_arrays, poses
from graphsynth.systems.antenna.model import PointingDimensions, Poses, joints

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class PassiveAngles:
    """The twelve unknowns of the loop equations.

    Attributes
    ----------
    x : ndarray, shape (..., 12)
        ``x1 ... x12`` of theory/antenna 3, radians: cardan and ball joint of leg Y, elevation, cardan and ball joint of
        leg X, azimuth.  NaN where the mechanism cannot be assembled.
    margin : ndarray, shape (...)
        Smallest cosine of ``x2, x4, x8, x10``: 0 means that a cardan or the angles of a ball joint are locked.
    """

    x: Array
    margin: Array


def _turn(axis: int, angle: Array) -> Array:
    """Rotation about a coordinate axis, shape (..., 3, 3)."""
    c, s = np.cos(angle), np.sin(angle)
    matrix = np.zeros((*np.shape(angle), 3, 3))
    i, j = (axis + 1) % 3, (axis + 2) % 3
    matrix[..., axis, axis] = 1.0
    matrix[..., i, i] = matrix[..., j, j] = c
    matrix[..., j, i], matrix[..., i, j] = s, -s
    return matrix


def _rotations(mechanism: PointingDimensions, poses: Poses) -> tuple[Array, Array, Array, Array]:
    """Return cardan angles (..., 2) of legs Y and X and the rotations E_Y, E_X of their ball joints."""
    R = poses.rotation
    dy, dx = (np.einsum("...ji,...j->...i", R, ball - cardan) for _, ball, cardan in joints(mechanism, poses))
    x2, x1 = np.arctan2(dy[..., 0], np.hypot(dy[..., 1], dy[..., 2])), np.arctan2(-dy[..., 1], -dy[..., 2])
    x8, x7 = np.arctan2(-dx[..., 1], np.hypot(dx[..., 0], dx[..., 2])), np.arctan2(dx[..., 0], -dx[..., 2])
    E_y = _turn(0, -poses.phi_x) @ R @ _turn(0, -x1) @ _turn(1, -x2)
    E_x = _turn(1, -poses.phi_y) @ R @ _turn(1, -x7) @ _turn(0, -x8)
    return np.stack([x1, x2], -1), np.stack([x7, x8], -1), E_y, E_x


def passive_angles(self: PointingDimensions, poses: Poses) -> PassiveAngles:
    """Angles of all passive joints at known poses: the twelve unknowns of the loop equations (theory/antenna 5)."""
    cardan_y, cardan_x, E, F = _rotations(self, poses)
    x = np.empty((*np.shape(poses.a), 12))
    x[..., 0:2], x[..., 6:8] = cardan_y, cardan_x
    x[..., 2] = np.arctan2(-E[..., 1, 2], E[..., 1, 1])
    x[..., 3] = np.arctan2(E[..., 1, 0], np.hypot(E[..., 1, 1], E[..., 1, 2]))
    x[..., 4] = np.arctan2(-E[..., 2, 0], E[..., 0, 0])
    x[..., 5] = poses.a
    x[..., 8] = np.arctan2(F[..., 0, 2], F[..., 0, 0])
    x[..., 9] = np.arctan2(-F[..., 0, 1], np.hypot(F[..., 0, 0], F[..., 0, 2]))
    x[..., 10] = np.arctan2(F[..., 2, 1], F[..., 1, 1])
    x[..., 11] = poses.b
    return PassiveAngles(x, np.cos(x[..., [1, 3, 7, 9]]).min(axis=-1))


def printed_ball_joint(mechanism: PointingDimensions, poses: Poses) -> Array:
    """Angles ``x3, x4, x5`` of the ball joint of leg Y in the printed order y-x-y, shape (..., 3); 0 + x5 if locked."""
    _, _, E, _ = _rotations(mechanism, poses)
    x4 = np.arctan2(np.hypot(E[..., 0, 1], E[..., 2, 1]), E[..., 1, 1])
    locked = np.hypot(E[..., 0, 1], E[..., 2, 1]) < 1e-15
    x3 = np.where(locked, 0.0, np.arctan2(E[..., 1, 0], -E[..., 1, 2]))
    x5 = np.where(locked, np.arctan2(E[..., 0, 2], E[..., 0, 0]), np.arctan2(E[..., 0, 1], E[..., 2, 1]))
    return np.stack([x3, np.where(locked, 0.0, x4), x5], -1)


#: "corrected": ball joint of leg Y turned about y, z, x.  "printed": about y, x, y, singular at rest.
CHARTS = ("corrected", "printed")
_INPUT_X, _INPUT_Y, _FIXED = 12, 13, 14  # sources of an angle beside the unknowns 0..11


class _Turn(NamedTuple):
    axis: int
    source: int
    factor: float = 1.0  # -1 for the inverse; the angle itself for a mounting rotation


class _Shift(NamedTuple):
    axis: int
    length: float


_Step = _Turn | _Shift


class LoopEquations(NamedTuple):
    """Residuals (n, 12), Jacobian by unknowns (n, 12, 12), by crank angles (n, 12, 2), traces of D_Y, D_X (n, 2)."""

    residual: Array
    jacobian: Array
    inputs: Array
    traces: Array


def _chains(mechanism: PointingDimensions, chart: str) -> tuple[list[_Step], list[_Step]]:
    l1, l2, l3, l4, l5 = mechanism.lengths
    axes = (2, 0) if chart == "corrected" else (0, 1)
    # from the crank over the ball joint and along the rod, then cardan and mounting
    leg_y: list[_Step] = [_Turn(0, _INPUT_X), _Turn(1, 4), _Shift(1, l3), _Turn(axes[0], 3), _Turn(axes[1], 2)]
    leg_y += [_Shift(2, l2), _Turn(1, 1), _Turn(0, 0), _Turn(2, _FIXED, 0.5 * math.pi), _Shift(0, -l1)]
    leg_x: list[_Step] = [_Turn(1, _INPUT_Y), _Turn(0, 10), _Shift(0, l5), _Turn(2, 9), _Turn(1, 8)]
    leg_x += [_Shift(2, l4), _Turn(0, 7), _Turn(1, 6), _Turn(2, _FIXED, 0.0), _Shift(0, -l1)]
    return leg_y, leg_x


def _matrix(step: _Step, angles: Array) -> Array:
    """One-step matrix, shape (n, 4, 4)."""
    made = np.zeros((len(angles), 4, 4))
    made[:, range(4), range(4)] = 1.0
    if isinstance(step, _Shift):
        made[:, step.axis, 3] = step.length
        return made
    fixed = step.source == _FIXED
    angle = np.full(len(angles), step.factor) if fixed else step.factor * angles[:, step.source]
    i, j = (step.axis + 1) % 3, (step.axis + 2) % 3
    made[:, i, i] = made[:, j, j] = np.cos(angle)
    made[:, j, i] = np.sin(angle)
    made[:, i, j] = -made[:, j, i]
    return made


def _product(steps: list[_Step], angles: Array) -> tuple[Array, dict[int, Array]]:
    """Return the product of the steps and its derivative by every source that occurs in it."""
    matrices = [_matrix(step, angles) for step in steps]
    behind = [np.broadcast_to(np.eye(4), matrices[0].shape)]
    for matrix in reversed(matrices[1:]):
        behind.append(matrix @ behind[-1])
    before = np.broadcast_to(np.eye(4), matrices[0].shape)
    derivatives = {}
    for step, matrix, rest in zip(steps, matrices, reversed(behind)):
        before = before @ matrix
        if isinstance(step, _Turn) and step.source != _FIXED:
            i, j = (step.axis + 1) % 3, (step.axis + 2) % 3
            generator = np.zeros((4, 4))
            generator[j, i], generator[i, j] = 1.0, -1.0
            derivatives[step.source] = step.factor * (before @ generator @ rest)
    return before, derivatives


def loop_equations(
    mechanism: PointingDimensions, x: Array, phi: Array, chart: str = "corrected", *, scaled: bool = True
) -> LoopEquations:
    """Evaluate the twelve equations and their derivatives.

    Unknowns ``x1 ... x12`` of shape (n, 12) and crank angles ``phi_x, phi_y`` of shape (n, 2), radians; `chart` is one
    of `CHARTS`, `scaled` divides the position rows by ``l1``. Rows: three positions of leg Y, three of leg X, direction
    z of both legs (two each), direction x of both.
    """
    choice("chart", chart, CHARTS)
    angles = np.concatenate([x, phi], axis=1)
    n = len(x)
    l1, l2, l3, l4, l5 = mechanism.lengths
    goals = ((0.0, l3 - l1, l2), (l5 - l1, 0.0, l4))
    unit = l1 if scaled else 1.0
    residual, full, traces = np.zeros((n, 12)), np.zeros((n, 12, 14)), np.empty((n, 2))
    gimbal: list[_Step] = [_Turn(0, 5, -1.0), _Turn(1, 11, -1.0)]
    if mechanism.order == "XY":
        gimbal.reverse()
    for leg, (steps, goal) in enumerate(zip(_chains(mechanism, chart), goals)):
        H, dH = _product(steps, angles)
        mounting = next(step for step in steps if isinstance(step, _Turn) and step.source == _FIXED)
        inverse, dinverse = _product(gimbal, angles)
        unmount = _matrix(_Turn(2, _FIXED, -mounting.factor), angles)
        behind = H @ unmount
        D = inverse @ behind
        dD = {source: inverse @ part @ unmount for source, part in dH.items()}
        dD |= {source: part @ behind for source, part in dinverse.items()}
        position = slice(3 * leg, 3 * leg + 3)
        residual[:, position] = (H[:, :3, 3] - goal) / unit
        rows = ((6 + 2 * leg, 0, 2), (7 + 2 * leg, 1, 2), (10 + leg, 1, 0))
        for row, i, j in rows:
            residual[:, row] = D[:, i, j]
        for source, part in dH.items():
            full[:, position, source] = part[:, :3, 3] / unit
        for source, part in dD.items():
            for row, i, j in rows:
                full[:, row, source] = part[:, i, j]
        traces[:, leg] = np.trace(D[:, :3, :3], axis1=1, axis2=2)
    return LoopEquations(residual, full[:, :, :12], full[:, :, 12:], traces)


#: A singular value below this part of the largest counts as zero, and so does a smaller sine of the angle to a fold:
#: beside a fold both fall with the square root of the distance, 1e-8 at one unit of rounding.
RANK_TOLERANCE = 1e-7


@dataclass(frozen=True, eq=False)
class ChartReport:
    """Rank of the 12 x 12 Jacobian in one set of coordinates (estimated: floating-point singular values).

    Attributes
    ----------
    chart : str
        Coordinates asked for.
    rank : int
        Number of singular values above 1e-7 of the largest.
    singular_values : ndarray, shape (12,)
        Position rows divided by ``l1`` (unless asked otherwise), falling.
    other_rank : int
        Rank at the same pose in the other coordinates.
    fold_margin : float
        Sine of the angle to the nearest fold of the mechanism, from the closed form: independent of coordinates.
    verdict : str
        "regular", "coordinates singular, mechanism regular" or "mechanism singular".
    use : str
        Coordinates to use at this pose; empty if none is regular.
    """

    chart: str
    rank: int
    singular_values: NDArray[np.float64]
    other_rank: int
    fold_margin: float
    verdict: str
    use: str

    @property
    def condition(self) -> float:
        """Ratio of the largest to the smallest singular value."""
        smallest = float(self.singular_values[-1])
        return float(self.singular_values[0]) / smallest if smallest > 0.0 else float("inf")


def check_chart(
    self: PointingDimensions,
    phi_x: float,
    phi_y: float,
    chart: str = "corrected",
    *,
    s_y: int = 1,
    s_x: int = -1,
    scaled: bool = True,
) -> ChartReport:
    """Assess the coordinates of the loop equations at a pose: rank, condition, verdict (theory/antenna 4).

    A `GeometryError` refuses another chart, and a pose that cannot be assembled.

    Examples
    --------
    >>> from graphsynth.systems.antenna import PointingMechanism
    >>> report = PointingMechanism().check_chart(0.0, 0.0, "printed")
    >>> report.rank, report.verdict, report.use
    (11, 'coordinates singular, mechanism regular', 'corrected')
    """
    choice("chart", chart, CHARTS)
    pose = poses(self, phi_x, phi_y, s_y, s_x)
    if not pose.assembled:
        raise GeometryError(f"no rank at phi_x = {phi_x}, phi_y = {phi_y}: {pose.reasons()[0]}; choose another pose")
    corrected = passive_angles(self, pose).x
    printed = corrected.copy()
    printed[2:5] = printed_ball_joint(self, pose)
    phi = np.array([float(phi_x), float(phi_y)])
    values, ranks = {}, {}
    for name, x in (("corrected", corrected), ("printed", printed)):
        jacobian = loop_equations(self, x[None], phi[None], name, scaled=scaled).jacobian[0]
        values[name] = np.linalg.svd(jacobian, compute_uv=False)
        ranks[name] = int((values[name] > RANK_TOLERANCE * values[name][0]).sum())
    margin = float(min(pose.margin_x, pose.margin_y))
    verdict = "regular" if ranks[chart] == 12 else "coordinates singular, mechanism regular"
    if margin < RANK_TOLERANCE:
        verdict = "mechanism singular"
    other = ranks["printed" if chart == "corrected" else "corrected"]
    use = next((name for name in CHARTS if ranks[name] == 12), "")
    return ChartReport(chart, ranks[chart], values[chart], other, margin, verdict, use)


#: A residual (lengths divided by l1) below this is a root.
RESIDUAL = 1e-12
#: Turn of the cranks between two continuation steps, radians.
STEP = 0.05


@dataclass(frozen=True, eq=False)
class LoopSolution:
    """Newton's solution of the twelve equations.

    Attributes
    ----------
    x : ndarray, shape (..., 12)
        Unknowns; NaN where Newton's method found no root or a false one.
    residual : ndarray, shape (...)
        Largest absolute residual of the returned root, position rows divided by ``l1``.
    error : ndarray, shape (...)
        Largest component of the last Newton step (estimate of the error).
    converged, genuine : ndarray of bool, shape (...)
        A root was found; its orientations agree (both traces are 3).
    iterations : ndarray of int64, shape (...)
        Iterations in all continuation steps together.
    chart : str
        Coordinates that were used: the regular ones if those asked for are singular at the start.
    start_rank : ndarray of int64, shape (...)
        Rank of the 12 x 12 Jacobian at the start, in the coordinates asked for.
    message : str
        One sentence on the coordinates.
    """

    x: Array
    residual: Array
    error: Array
    converged: NDArray[np.bool_]
    genuine: NDArray[np.bool_]
    iterations: NDArray[np.int64]
    chart: str
    start_rank: NDArray[np.int64]
    message: str


@dataclass(frozen=True, eq=False)
class RootSurvey:
    """Roots of the twelve scalar equations found from random starts.

    Attributes
    ----------
    starts, failed, false, genuine : int
        Random starts; those without a root; false orientation roots (rejected); genuine roots.
    modes : ndarray, shape (m, 2)
        Different pairs ``(a, b)`` of the genuine roots, radians, sorted.
    """

    starts: int
    failed: int
    false: int
    genuine: int
    modes: Array


def newton(
    mechanism: PointingDimensions, x: Array, phi: Array, chart: str, limit: int = 40
) -> tuple[Array, Array, Array, NDArray[np.int64]]:
    """Newton's method with halved steps on many poses; returns x, residual, last step and iterations.

    A pose whose Jacobian is singular takes the step of least norm.
    """
    x = x.copy()
    found = loop_equations(mechanism, x, phi, chart)
    size = np.abs(found.residual).max(axis=1)
    last, iterations = np.full(len(x), np.inf), np.zeros(len(x), dtype=np.int64)
    active = np.arange(len(x))
    for _ in range(limit):
        try:
            step = np.linalg.solve(found.jacobian, found.residual[..., None])[..., 0]
        except np.linalg.LinAlgError:
            step = (np.linalg.pinv(found.jacobian, rcond=1e-13) @ found.residual[..., None])[..., 0]
        length = np.abs(step).max(axis=1)
        factor = np.minimum(1.0, 1.0 / np.maximum(length, 1e-300))  # no step turns a joint by more than 1 rad
        for _ in range(12):
            trial = loop_equations(mechanism, x[active] - factor[:, None] * step, phi[active], chart)
            worse = np.linalg.norm(trial.residual, axis=1) > np.maximum(np.linalg.norm(found.residual, axis=1), 1e-15)
            if not worse.any():
                break
            factor[worse] *= 0.5
        x[active] -= factor[:, None] * step
        size[active], last[active] = np.abs(trial.residual).max(axis=1), length
        iterations[active] += 1
        going = (length > 1e-14) & ~((size[active] < 4e-16) & (length < 1e-7))
        active = active[going]
        if active.size == 0:
            break
        found = type(found)(*(part[going] for part in trial))
    return x, size, last, iterations


def solve_loops(
    self: PointingDimensions,
    phi_x: ArrayLike,
    phi_y: ArrayLike,
    *,
    start: ArrayLike | None = None,
    chart: str = "corrected",
) -> LoopSolution:
    """Solve the twelve loop equations by Newton's method, without the closed form (theory/antenna 3).

    Parameters
    ----------
    phi_x, phi_y : array_like
        Crank angles, radians.
    start : array_like, shape (..., 12), optional
        Unknowns to start from; by default the rest pose, followed to the given angles in small steps.
    chart : {"corrected", "printed"}
        "printed" turns the ball joint of leg Y about y, x, y as the source does, which is singular at rest; without
        ``start`` this is noticed and the regular coordinates are used.

    Returns
    -------
    LoopSolution
        Roots whose orientations do not agree are rejected.
    """
    given_x, given_y = crank_arrays(phi_x, phi_y)
    phi = np.stack([given_x.ravel(), given_y.ravel()], axis=1)
    n = len(phi)
    total = np.zeros(n, dtype=np.int64)
    message = f"coordinates {chart!r}"
    if start is None:
        # every angle is zero at rest, in any coordinates and for any lengths
        report = check_chart(self, 0.0, 0.0, chart)
        ranks = np.full(n, report.rank, dtype=np.int64)
        if report.rank < 12 and report.use:
            message = (
                f"at the start rank {report.rank} of 12: {report.verdict}; {report.use!r} used instead of {chart!r}"
            )
            chart = report.use
        x = np.zeros((n, 12))
        stages = max(1, int(np.ceil(np.abs(phi).max(initial=0.0) / STEP)))
        for stage in range(1, stages):
            x, _, _, used = newton(self, x, phi * (stage / stages), chart)
            total += used
    else:
        x = np.broadcast_to(np.asarray(start, dtype=np.float64), (*given_x.shape, 12)).reshape(n, 12)
        values = np.linalg.svd(loop_equations(self, x, phi, chart).jacobian, compute_uv=False)
        ranks = (values > RANK_TOLERANCE * values[:, :1]).sum(axis=1)
    x, size, last, used = newton(self, x, phi, chart)
    traces = loop_equations(self, x, phi, chart).traces
    converged = size < RESIDUAL
    genuine = converged & (np.abs(traces - 3.0) < 1e-6).all(axis=1)
    x = np.where(genuine[:, None], x - 2.0 * np.pi * np.round(x / (2.0 * np.pi)), np.nan)
    found: tuple[Any, ...] = (size, last, converged, genuine, total + used, ranks)
    size, last, converged, genuine, total, ranks = (part.reshape(given_x.shape) for part in found)
    x = x.reshape(*given_x.shape, 12)
    return LoopSolution(x, size, last, converged, genuine, total, chart, ranks, message)


def survey_roots(
    self: PointingDimensions, phi_x: float, phi_y: float, *, starts: int = 200, seed: int = 0, chart: str = "corrected"
) -> RootSurvey:
    """Newton's method from random starts: genuine roots by assembly mode, false orientation roots counted.

    A `GeometryError` refuses fewer than one start.
    """
    if starts < 1:
        raise GeometryError(f"starts = {starts} must be at least 1; give a number of random starts")
    random = np.random.default_rng(seed).uniform(-np.pi, np.pi, (starts, 12))
    found = solve_loops(self, np.full(starts, phi_x), np.full(starts, phi_y), start=random, chart=chart)
    pairs = found.x[found.genuine][:, [5, 11]]
    modes: list[Array] = []
    for pair in pairs[np.lexsort(pairs.T[::-1])] if len(pairs) else pairs:
        if all(np.abs(np.exp(1j * pair) - np.exp(1j * other)).max() > 1e-7 for other in modes):
            modes.append(pair)
    converged, genuine = int(found.converged.sum()), int(found.genuine.sum())
    return RootSurvey(starts, starts - converged, converged - genuine, genuine, np.array(modes).reshape(-1, 2))
