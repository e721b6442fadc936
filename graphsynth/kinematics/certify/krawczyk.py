"""Krawczyk's test for many boxes at once, each box moving with its input.

For a system ``f(x, u) = 0`` with as many equations as unknowns, an interval U of inputs, a centre that moves as
``c(u) = x + V (u - mid U)`` and radii B, the operator

    K(u) = c(u) - Y f(c(u), u) + (1 - Y J(c(U) + B, U)) ([-B, B])

with any matrix Y satisfies: if K(u) lies in the interior of ``c(u) + B`` for every u in U, then for every u in U there
is exactly one solution in ``c(u) + B``, it lies in K(u), and the Jacobian is regular everywhere in the box ([Krawczyk
1969]; [Neumaier 1990], theory/circle-and-ellipse 1).  ``f`` along the moving centre is bounded by its value at mid U
and its derivative by u over U, so the bound is of second order in the width of U.
"""

from __future__ import annotations

from contextlib import suppress
from functools import reduce
from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from graphsynth.kinematics.certify.balls import TINY, UP, Balls, U, exact

__all__ = ["Boxes", "Proof", "System", "correct", "prove"]

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

_CHUNK = 1_000_000  # entries of the Jacobians handled at once


class System(Protocol):
    """Equations in balls; N boxes at once, n unknowns."""

    @property
    def weights(self) -> Array:
        """Size of one unit of every unknown, shape (n,): a length for lengths, 1 for angles."""
        ...

    def units(self, x: Array, u: Array, checked: bool = True) -> Balls:
        """``exp(i angle)`` of every angle of the equations at midpoints, shape (N, angles)."""
        ...

    def residual(self, x: Balls, u: Balls, units: Balls) -> Balls:
        """``f``, shape (N, n); ``units`` belong to the midpoints of x and u."""
        ...

    def derivatives(self, x: Balls, u: Balls, units: Balls) -> tuple[Balls, Balls]:
        """``df/dx`` (N, n, n) and ``df/du`` (N, n)."""
        ...

    def branch(self, x: Balls, u: Array) -> tuple[NDArray[np.int64], Balls]:
        """Whole turns counted in the equations (N, any) and continuous directions (N, any) over the boxes ``x``."""
        ...


class Boxes(NamedTuple):
    """Moving boxes: inputs U as balls (N,), centres at the midpoints and their velocities (N, n)."""

    u: Balls
    x: Array
    V: Array

    def take(self, key: Mask | NDArray[np.intp] | slice) -> Boxes:
        """Return some of the boxes."""
        return Boxes(self.u[key], self.x[key], self.V[key])

    def hull(self, radius: Array) -> Balls:
        """Balls that hold every box over all its inputs."""
        return Balls(self.x, (np.abs(self.V) * self.u.rad[:, None] + radius) * UP + TINY)

    def at(self, u: Balls) -> Balls:
        """Centres at inputs ``u`` (N,)."""
        step = u - exact(self.u.mid)
        return exact(self.x) + exact(self.V) * Balls(step.mid[:, None], step.rad[:, None])


class Proof(NamedTuple):
    """``proved`` (N,); the box ``radius`` in which the solution is unique; its bound ``tight`` around the centre."""

    proved: Mask
    radius: Array
    tight: Array

    def take(self, key: NDArray[np.intp]) -> Proof:
        """Return some of the proofs."""
        return Proof(self.proved[key], self.radius[key], self.tight[key])

    def join(self, other: Proof) -> Proof:
        """Return both."""
        return Proof(
            np.concatenate([self.proved, other.proved]),
            np.concatenate([self.radius, other.radius]),
            np.concatenate([self.tight, other.tight]),
        )


def _apply(Y: Array, v: Array) -> Array:
    return np.asarray(np.matmul(Y, v[..., None])[..., 0])


def _inverse(J: Array) -> Array:
    """Inverse of every matrix; zero where there is none, which proves nothing."""
    J = np.where(np.isfinite(J).all(axis=(1, 2), keepdims=True), J, 0.0)
    try:
        Y = np.linalg.inv(J)
    except np.linalg.LinAlgError:
        Y = np.zeros_like(J)
        for k, matrix in enumerate(J):
            with suppress(np.linalg.LinAlgError):
                Y[k] = np.linalg.inv(matrix)
    return np.asarray(np.where(np.isfinite(Y).all(axis=(1, 2), keepdims=True), Y, 0.0))


def correct(system: System, x: Array, u: Array, steps: int = 40) -> tuple[Array, Array]:
    """Newton steps in floating point until all converge; points and velocities ``dx/du`` (NaN where it fails)."""
    with np.errstate(all="ignore"):
        for _ in range(steps):
            units = system.units(x, u, checked=False)
            f = system.residual(exact(x), exact(u), units)
            J, _ = system.derivatives(exact(x), exact(u), units)
            step = _apply(_inverse(J.mid), f.mid)
            x = x - step
            size = np.abs(step / system.weights).max(axis=1, initial=0.0)
            if not (size > 1e-14 * (1.0 + np.abs(x / system.weights).max(axis=1, initial=0.0))).any():
                break
        J, fu = system.derivatives(exact(x), exact(u), system.units(x, u, checked=False))
        return x, -_apply(_inverse(J.mid), fu.mid)


def prove(system: System, boxes: Boxes, radii: tuple[float, ...] = ()) -> Proof:
    """Test every box, with radii found by inflation; then the larger ``radii`` (times the weights), largest first."""
    n = boxes.x.shape[1]
    size = max(1, _CHUNK // max(n * n, 1))
    parts = [_prove(system, boxes.take(slice(k, k + size)), radii) for k in range(0, len(boxes.x), size)]
    if not parts:
        return Proof(np.zeros(0, dtype=bool), np.zeros((0, n)), np.zeros((0, n)))
    return reduce(Proof.join, parts)


def _prove(system: System, boxes: Boxes, radii: tuple[float, ...]) -> Proof:
    with np.errstate(all="ignore"):
        units = system.units(boxes.x, boxes.u.mid)
        centre = exact(boxes.u.mid)
        f = system.residual(exact(boxes.x), centre, units)
        J, fu = system.derivatives(boxes.hull(np.zeros_like(boxes.x)), boxes.u, units)
        Y = _inverse(J.mid)
        gamma = 4.0 * (boxes.x.shape[1] + 2) * U
        # change of f along the moving centre: (J V + f_u) times the half width of U
        along = np.abs(_apply(J.mid, boxes.V) + fu.mid) + gamma * (_apply(np.abs(J.mid), np.abs(boxes.V)))
        along = (along + _apply(J.rad, np.abs(boxes.V)) + fu.rad + gamma * np.abs(fu.mid)) * (1.0 + gamma) * UP + TINY
        spread = (f.rad + along * boxes.u.rad[:, None]) * UP + TINY
        absolute = np.abs(Y)
        first = np.abs(_apply(Y, f.mid)) + gamma * _apply(absolute, np.abs(f.mid)) + _apply(absolute, spread)
        first = first * (1.0 + gamma) * UP + TINY
        proved = np.zeros(len(boxes.x), dtype=bool)
        radius, tight = np.full_like(first, np.inf), np.full_like(first, np.inf)
        trial = _inflated(2.0 * first, system.weights)
        for _ in range(4):
            left = np.flatnonzero(~proved & np.isfinite(first).all(axis=1))
            if left.size == 0:
                break
            image = _image(system, boxes.take(left), units[left], Y[left], first[left], trial[left], gamma)
            inside = (image < trial[left]).all(axis=1)
            proved[left[inside]] = True
            radius[left[inside]], tight[left[inside]] = trial[left[inside]], image[inside]
            trial[left] = _inflated(1.6 * np.where(np.isfinite(image), image, 0.0), system.weights)
        for wide in radii:
            _widen(system, boxes, units, Y, first, gamma, wide * system.weights, proved, radius, tight)
    return Proof(proved, radius, tight)


def _inflated(radius: Array, weights: Array) -> Array:
    """Radius with room in every unknown, also in those that the motion follows exactly: neighbours must link there."""
    largest = (radius / weights).max(axis=1, keepdims=True)
    return np.asarray(radius + (0.01 * largest + 1e-13) * weights)


def _image(system: System, boxes: Boxes, units: Balls, Y: Array, first: Array, radius: Array, gamma: float) -> Array:
    """Radius of the Krawczyk image around the moving centre."""
    J, _ = system.derivatives(boxes.hull(radius), boxes.u, units)
    absolute = np.abs(Y)
    product = np.matmul(Y, J.mid)
    rest = (
        np.abs(np.eye(Y.shape[1]) - product) + gamma * np.matmul(absolute, np.abs(J.mid)) + np.matmul(absolute, J.rad)
    )
    rest = (rest + 2.0 * U) * (1.0 + gamma) * UP
    image = (first + _apply(rest, radius) * (1.0 + gamma)) * UP + TINY
    # an infinite or undefined entry anywhere must not pass
    return np.where(np.isfinite(image), image, np.inf)


def _widen(
    system: System, boxes: Boxes, units: Balls, Y: Array, first: Array, gamma: float, wide: Array,
    proved: Mask, radius: Array, tight: Array,
) -> None:  # fmt: skip
    """Try one larger radius where no larger one has passed: uniqueness in more room, the same solution."""
    trial = np.broadcast_to(wide, first.shape)
    left = np.flatnonzero(proved & (radius < trial).all(axis=1))
    if left.size == 0:
        return
    image = _image(system, boxes.take(left), units[left], Y[left], first[left], trial[left], gamma)
    inside = left[(image < trial[left]).all(axis=1)]
    radius[inside] = trial[inside]
