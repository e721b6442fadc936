"""The twelve loop equations with their analytic Jacobian (specification instruments_and_dynamics, section 2.3).

Each leg is a product of one-step matrices: rotations by an unknown or given angle, shifts, one mounting rotation.
Position rows are divided by ``l1``, so that lengths and angles weigh alike.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from graphsynth.core.errors import GeometryError

if TYPE_CHECKING:
    from graphsynth.systems.antenna.mechanism import PointingMechanism

__all__ = ["CHARTS", "LoopEquations", "loop_equations"]

Array = NDArray[np.float64]

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


class LoopEquations(NamedTuple):
    """Residuals (n, 12), Jacobian by unknowns (n, 12, 12), by crank angles (n, 12, 2), traces of D_Y, D_X (n, 2)."""

    residual: Array
    jacobian: Array
    inputs: Array
    traces: Array


def _chains(mechanism: PointingMechanism, chart: str) -> tuple[list[_Turn | _Shift], list[_Turn | _Shift]]:
    l1, l2, l3, l4, l5 = mechanism.lengths
    axes = (2, 0) if chart == "corrected" else (0, 1)
    leg_y: list[_Turn | _Shift] = [
        _Turn(0, _INPUT_X), _Turn(1, 4), _Shift(1, l3), _Turn(axes[0], 3), _Turn(axes[1], 2), _Shift(2, l2),
        _Turn(1, 1), _Turn(0, 0), _Turn(2, _FIXED, 0.5 * math.pi), _Shift(0, -l1),
    ]  # fmt: skip
    leg_x: list[_Turn | _Shift] = [
        _Turn(1, _INPUT_Y), _Turn(0, 10), _Shift(0, l5), _Turn(2, 9), _Turn(1, 8), _Shift(2, l4),
        _Turn(0, 7), _Turn(1, 6), _Turn(2, _FIXED, 0.0), _Shift(0, -l1),
    ]  # fmt: skip
    return leg_y, leg_x


def _matrix(step: _Turn | _Shift, angles: Array) -> Array:
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


def _generator(axis: int) -> Array:
    made = np.zeros((4, 4))
    made[(axis + 2) % 3, (axis + 1) % 3], made[(axis + 1) % 3, (axis + 2) % 3] = 1.0, -1.0
    return made


def _product(steps: list[_Turn | _Shift], angles: Array) -> tuple[Array, dict[int, Array]]:
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
            derivatives[step.source] = step.factor * (before @ _generator(step.axis) @ rest)
    return before, derivatives


def loop_equations(
    mechanism: PointingMechanism, x: Array, phi: Array, chart: str = "corrected", *, scaled: bool = True
) -> LoopEquations:
    """Evaluate the twelve equations and their derivatives.

    Parameters
    ----------
    mechanism : PointingMechanism
    x : ndarray, shape (n, 12)
        Unknowns ``x1 ... x12``, radians.
    phi : ndarray, shape (n, 2)
        Crank angles ``phi_x, phi_y``, radians.
    chart : {"corrected", "printed"}
        Angles of the ball joint of leg Y.
    scaled : bool
        Divide the position rows by ``l1``.

    Returns
    -------
    LoopEquations
        Rows: three positions of leg Y, three of leg X, direction z of both legs (two each), direction x of both.

    Raises
    ------
    GeometryError
        A chart that does not exist.
    """
    if chart not in CHARTS:
        raise GeometryError(f"chart = {chart!r} is unknown; use one of {', '.join(map(repr, CHARTS))}")
    angles = np.concatenate([x, phi], axis=1)
    n = len(x)
    l1, l2, l3, l4, l5 = mechanism.lengths
    goals = ((0.0, l3 - l1, l2), (l5 - l1, 0.0, l4))
    unit = l1 if scaled else 1.0
    residual, full, traces = np.zeros((n, 12)), np.zeros((n, 12, 14)), np.empty((n, 2))
    gimbal: list[_Turn | _Shift] = [_Turn(0, 5, -1.0), _Turn(1, 11, -1.0)]
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
