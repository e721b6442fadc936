"""Exact derivatives of poses by dimensions, through every structural group, in reverse: one pass for all dimensions.

Theory, with the picture of statics behind it: docs/explanation/planar-engine.md, "Gradients".
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from graphsynth.core.checks import finite_array
from graphsynth.core.compilation import named
from graphsynth.core.errors import GeometryError
from graphsynth.kinematics.engine.program import decomposed, equations
from graphsynth.mechanism.joints import Revolute
from graphsynth.mechanism.model import Mechanism

Array = NDArray[np.float64]
_CRANK, _DYAD, _GENERAL = 0, 1, 2
#: Places and weights of a difference of order six, and its step in radians of the fastest link.
_STENCIL = ((-3, -1 / 60), (-2, 3 / 20), (-1, -3 / 4), (1, 3 / 4), (2, -3 / 20), (3, 1 / 60))
_STEP = 5e-3


class PoseGradients(NamedTuple):
    """Derivatives of the numbers whose loads were given.

    ``dimensions`` (sets, directions, joints, 10, n) by the columns of `graphsynth.mechanism.joints.COLUMNS`;
    ``drivers`` (sets, directions, drivers, n) by the driver coordinates.
    """

    dimensions: Array
    drivers: Array


class _Work(NamedTuple):
    J: Array
    f: Array
    g: Array
    G: Array
    pivots: NDArray[np.int64]
    x: Array
    phi: Array
    q: Array


class _Adjoint(NamedTuple):
    """Steps in the order of assembly, links and joints of general groups, and the numbers of their rows."""

    steps: NDArray[np.int64]
    links: NDArray[np.int64]
    ends: NDArray[np.int64]
    rows: NDArray[np.int64]
    row_table: Array


def pose_gradients(mechanism: Mechanism, dimensions: ArrayLike, frames: ArrayLike, loads: ArrayLike) -> PoseGradients:
    """Differentiate functions of the poses by every dimension of the joints and by the driver coordinates.

    Parameters
    ----------
    mechanism : Mechanism
        Gives graph, joint kinds and drivers.
    dimensions : array_like, shape (sets, joints, 10)
        In the form of ``mechanism.dimensions``.
    frames : array_like, shape (sets, n, links, 4)
        Assembled poses of all links, x, y, cos theta, sin theta, as of `BatchMotion.frames`.
    loads : array_like, shape (sets, directions, links, 3, n)
        For every sample one or more functions: their derivatives by (x, y, theta) of every link.

    Returns
    -------
    PoseGradients
        To rounding (estimated: float64); NaN where a pose is missing, large where a group is nearly singular.  By the
        radii of gears, which are ratios of whole numbers, there are none: zero.

    Raises
    ------
    GeometryError
        Shapes that do not fit, drivers that do not move the mechanism.

    Notes
    -----
    See docs/explanation/planar-engine.md, "Gradients".

    Examples
    --------
    How a point of the coupler moves if the frame were longer, in the direction of the frame:

    >>> from graphsynth.kinematics.engine.batch import simulate_batch
    >>> four_bar = Mechanism.four_bar(2.0, 1.0, 2.5, 2.5)
    >>> sets = four_bar.dimensions[None]
    >>> loads = np.zeros((1, 1, 4, 3, 2))
    >>> loads[0, 0, 2, 0] = 1.0
    >>> found = pose_gradients(four_bar, sets, simulate_batch(four_bar, [0.5, 0.6], sets).frames, loads)
    >>> found.dimensions.shape, found.drivers.shape
    ((1, 1, 4, 10, 2), (1, 1, 1, 2))
    """
    sizes = np.array(finite_array("dimensions", dimensions), order="C")  # its own: the library takes no locked arrays
    at, given = np.asarray(frames, dtype=np.float64), np.array(loads, dtype=np.float64, order="C")
    links, joints = mechanism.graph.links, len(mechanism.joints)
    if sizes.shape[1:] != (joints, 10) or at.shape != (len(sizes), *at.shape[1:2], links, 4):
        raise GeometryError(
            f"dimensions have shape {sizes.shape} and frames {at.shape}; give (sets, {joints}, 10) and "
            f"(sets, n, {links}, 4)"
        )
    sets, n = at.shape[:2]
    if given.ndim != 5 or (given.shape[0], *given.shape[2:]) != (sets, links, 3, n):
        raise GeometryError(f"loads have shape {given.shape}; give ({sets}, directions, {links}, 3, {n})")
    program, drivers = _adjoint(mechanism, sizes), len(mechanism.drivers)
    out, moments = np.zeros((sets, given.shape[1], joints, 10, n)), np.zeros((sets, given.shape[1], drivers, n))
    (pull,) = named("graphsynth.kinematics.engine.kernels.adjoint", "pull")
    state = np.ascontiguousarray(at.transpose(0, 2, 3, 1))
    pull(program, sizes, state, given, out, moments, _room(program, links, drivers))
    return PoseGradients(out, moments)


def rate_gradients(
    mechanism: Mechanism, dimensions: ArrayLike, frames: ArrayLike, velocities: ArrayLike, loads: ArrayLike
) -> PoseGradients:
    """Differentiate functions of the velocities, as `pose_gradients` does those of the poses.

    Parameters
    ----------
    mechanism, dimensions, frames
        As of `pose_gradients`.
    velocities : array_like, shape (sets, n, links, 3)
        Of all links, by (x, y, theta), as of `BatchMotion.velocities`.
    loads : array_like, shape (sets, directions, links, 3, n)
        Derivatives of the functions by these velocities.

    Returns
    -------
    PoseGradients
        The rates of the motion laws stay as they are. About 1e-10 of the largest (estimated).

    Raises
    ------
    GeometryError
        As of `pose_gradients`.

    Notes
    -----
    The derivative of a velocity by a dimension is the rate of that of the pose: gradients with the same loads at poses
    moved along the velocities, by a difference of order six; docs/explanation/planar-engine.md, "Gradients".
    """
    at, moved = np.asarray(frames, dtype=np.float64), np.asarray(velocities, dtype=np.float64)
    if moved.shape != (*at.shape[:-1], 3):
        raise GeometryError(f"velocities have shape {moved.shape}; give {(*at.shape[:-1], 3)}, as frames say")
    size = np.abs(at[..., :2]).max(initial=1e-300)
    fastest = np.maximum(np.abs(moved[..., 2]), np.abs(moved[..., :2]).max(axis=-1) / size).max(axis=2)
    step = _STEP / np.where(fastest > 0.0, fastest, 1.0)
    by_dimensions, by_drivers = np.zeros(()), np.zeros(())
    for k, weight in _STENCIL:
        there = at.copy()
        there[..., :2] += k * step[..., None, None] * moved[..., :2]
        turn = k * step[..., None] * moved[..., 2]
        c, s = np.cos(turn), np.sin(turn)
        there[..., 2], there[..., 3] = c * at[..., 2] - s * at[..., 3], s * at[..., 2] + c * at[..., 3]
        found = pose_gradients(mechanism, dimensions, there, loads)
        share = weight / step[:, None, None]
        by_dimensions = by_dimensions + share[..., None, :] * found.dimensions
        by_drivers = by_drivers + share * found.drivers
    return PoseGradients(by_dimensions, by_drivers)


def revolute_dyads(mechanism: Mechanism) -> list[tuple[int, int, int, int, int]]:
    """Return the dyads of revolute joints: links p and q, joints A of p, B of both, C of q; in order of assembly."""
    steps = _adjoint(mechanism, mechanism.dimensions[None]).steps
    return [(p, q, A, B, C) for code, p, q, A, B, C in steps.tolist() if code == _DYAD]


def _room(program: _Adjoint, links: int, drivers: int) -> _Work:
    size = int(program.steps[:, 2].max(initial=1)) if len(program.steps) else 1
    square, q = np.zeros((size, size)), np.zeros((max(1, drivers), 5))
    pivots, gears = np.zeros(size, dtype=np.int64), np.zeros(max(1, len(program.rows)))
    return _Work(square, np.zeros(size), np.zeros(6), np.zeros((size, 6)), pivots, np.zeros((links, 11)), gears, q)


def _adjoint(mechanism: Mechanism, sizes: Array) -> _Adjoint:
    """Write down the groups for the kernel: cranks and dyads of revolute joints by name, all others by their rows."""
    found = decomposed(mechanism.graph, tuple(driver.pair for driver in mechanism.drivers))
    pairs = {joint.pair: k for k, joint in enumerate(mechanism.joints)}
    driven = {driver.pair: (k, driver) for k, driver in enumerate(mechanism.drivers)}
    placed, steps = {mechanism.frame}, []
    known, numbers = equations(mechanism.joints, sizes, mechanism.drivers)
    every: list[int] = []
    rows: list[list[int]] = []
    picked: list[int] = []

    def general(group: tuple[int, ...], own: list[int]) -> None:
        place = {link: k for k, link in enumerate(group)}
        first = len(rows)
        for r in (int(r) for k in own for r in np.flatnonzero(known[:, 5] == k)):
            kind, a, b, _, _, k = known[r].tolist()
            rows.append([kind, a, b, place.get(a, -1), place.get(b, -1), k])
            picked.append(r)
        steps.append([_GENERAL, first, len(rows) - first, len(every), 0, 0])
        every.extend(group)

    left = [pair for pair in driven if set(pair) <= set(found.driven)]
    while left:
        pair = next(p for p in left if len(placed & set(p)) == 1)
        left.remove(pair)
        link = pair[0] if pair[1] in placed else pair[1]
        joint, (index, driver) = mechanism.joints[pairs[pair]], driven[pair]
        if isinstance(joint, Revolute):
            sense = (1 if driver.base == joint.a else -1) * (1 if link == joint.b else -1)
            steps.append([_CRANK, link, pairs[pair], index, sense, 0])
        else:
            general((link,), [pairs[pair]])
        placed.add(link)
    for group in found.groups:
        inside = set(group.links)
        own = [k for pair, k in pairs.items() if inside & set(pair) and set(pair) <= inside | placed]
        plain = all(isinstance(mechanism.joints[k], Revolute) and mechanism.joints[k].pair not in driven for k in own)
        if len(inside) == 2 and len(own) == 3 and plain:
            inner = next(k for k in own if set(mechanism.joints[k].pair) == inside)
            i, j = mechanism.joints[inner].a, mechanism.joints[inner].b
            A, C = (next(k for k in own if k != inner and link in mechanism.joints[k].pair) for link in (i, j))
            steps.append([_DYAD, i, j, A, inner, C])
        else:
            general(group.links, own)
        placed |= inside
    ends = np.array([[joint.a, joint.b] for joint in mechanism.joints], dtype=np.int64)
    whole = (np.array(part, dtype=np.int64).reshape(-1, 6) for part in (steps, rows))
    first, second = whole
    return _Adjoint(
        first, np.array(every or [0], dtype=np.int64), ends, second, np.ascontiguousarray(numbers[:, picked])
    )
