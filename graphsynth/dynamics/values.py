"""Constraint values, Jacobians and accelerations at single states; loads given as functions of time and state."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from graphsynth.core.checks import called
from graphsynth.core.errors import GeometryError
from graphsynth.dynamics import kernels
from graphsynth.dynamics.elements import Force, TorqueSource
from graphsynth.dynamics.tables import RACK, Compiled
from graphsynth.kinematics.engine import codes
from graphsynth.mechanism.equations import FLOATS, derivatives, seen
from graphsynth.mechanism.joints import Prismatic, Revolute
from graphsynth.mechanism.model import Mechanism

Array = NDArray[np.float64]


def applied_loads(compiled: Compiled, t: float, q: Array, v: Array) -> Array:
    """Generalised force (n,) of all loads given as functions; `GeometryError` unless they give finite numbers."""
    Q = np.zeros(compiled.n)
    column = compiled.tables.column
    for element in compiled.applied:
        if isinstance(element, Force):
            _force(compiled, element, int(column[element.link]), t, q, v, Q)
            continue
        a, b = (int(column[link]) for link in (element.a, element.b))
        angle = (q[b + 2] if b >= 0 else 0.0) - (q[a + 2] if a >= 0 else 0.0)
        speed = (v[b + 2] if b >= 0 else 0.0) - (v[a + 2] if a >= 0 else 0.0)
        law: Any = element.torque
        name = f"the torque {element.a}-{element.b}"
        if isinstance(element, TorqueSource):
            G = element.ratio
            torque = G * _number(called(name, law, t, G * angle, G * speed), element)
            torque *= element.efficiency if torque * speed >= 0.0 else 1.0 / element.efficiency
        else:
            torque = _number(called(name, law, t, angle, speed), element)
        for k, sign in ((a, -1.0), (b, 1.0)):
            if k >= 0:
                Q[k + 2] += sign * torque
    return Q


def _force(compiled: Compiled, element: Force, k: int, t: float, q: Array, v: Array, Q: Array) -> None:
    if k < 0:
        return
    centre = compiled.centres[element.link]
    px, py = element.at[0] - float(centre[0]), element.at[1] - float(centre[1])
    c, s = math.cos(q[k + 2]), math.sin(q[k + 2])
    ux, uy = c * px - s * py, s * px + c * py
    place = (float(q[k] + ux), float(q[k + 1] + uy))
    speed = (float(v[k] - v[k + 2] * uy), float(v[k + 1] + v[k + 2] * ux))
    law: Any = element.force
    found = called(f"the force on link {element.link}", law, t, place, speed)
    try:
        fx, fy = (_number(part, element) for part in found)
    except (TypeError, ValueError) as error:
        raise GeometryError(
            f"the force on link {element.link} gave {found!r}; return two finite numbers (fx, fy)"
        ) from error
    Q[k] += fx
    Q[k + 1] += fy
    Q[k + 2] += ux * fy - uy * fx


def _number(value: Any, element: Any) -> float:
    try:
        number = float(value)
    except (TypeError, ValueError) as error:
        raise GeometryError(
            f"a {type(element).__name__} gave {value!r}; return a finite number at every state"
        ) from error
    if not math.isfinite(number):
        raise GeometryError(f"a {type(element).__name__} gave {number}; return a finite number at every state")
    return number


def jacobians(compiled: Compiled, q: Array, v: Array) -> Array:
    """Jacobians of all rows at n states, shape (n, rows, coordinates)."""
    T, still = compiled.tables, np.zeros((max(1, len(compiled.laws) + len(compiled.held)), 3))
    found = np.zeros((len(q), len(compiled.info), compiled.n))
    rolling, slots = bool((T.slots >= 0).any()), np.zeros(1)
    for k in range(len(q)):
        slots = initial_slots(compiled, q[k]) if rolling else slots
        found[k] = kernels.constraint_system(T, kernels.state_rows(T, q[k], v[k]), slots, still)[1]
    return found


def initial_slots(compiled: Compiled, q: Array, near: Array | None = None) -> Array:
    """Line-of-centres angles of gears, on the turn that closes best, and constants of racks.

    With ``near`` racks keep their constants and angles are those nearest to it.
    """
    T = compiled.tables
    slots = np.zeros(max(1, int(T.slots.max(initial=-1)) + 1))
    where = np.flatnonzero(T.slots >= 0)
    if not where.size:
        return slots
    coordinates = np.zeros((compiled.links, 3))
    coordinates[compiled.moving] = np.asarray(q).reshape(-1, 3)
    for r in where:
        kind, a, b = (int(v) for v in T.rows[r])
        slot, p = int(T.slots[r]), T.table[r]
        P = complex(*coordinates[a, :2]) + np.exp(1j * coordinates[a, 2]) * complex(p[codes.PAX], p[codes.PAY])
        R = complex(*coordinates[b, :2]) + np.exp(1j * coordinates[b, 2]) * complex(p[codes.PBX], p[codes.PBY])
        if kind == RACK:
            along = (np.conj(complex(p[codes.TX], p[codes.TY])) * (P - R)).real
            slots[slot] = along - p[codes.RA] * coordinates[b, 2] if near is None else near[slot]
            continue
        raw = float(np.angle(R - P))
        if near is not None:
            slots[slot] = raw + 2.0 * np.pi * np.round((near[slot] - raw) / (2.0 * np.pi))
            continue
        total = p[codes.RA] + p[codes.SIGN] * p[codes.RB]
        open_ = p[codes.RA] * (coordinates[a, 2] - raw)
        open_ += p[codes.SIGN] * p[codes.RB] * (coordinates[b, 2] - raw - p[codes.H])
        turns = 0.0 if abs(total) < 1e-9 * (p[codes.RA] + p[codes.RB]) else np.round(open_ / (2.0 * np.pi * total))
        slots[slot] = raw + 2.0 * np.pi * turns
    return slots


@dataclass(frozen=True, eq=False)
class Values:
    """A compiled model at one time, with the slots of its gears and racks."""

    compiled: Compiled
    time: float
    slots: Array

    @cached_property
    def driven(self) -> Array:
        """Prescribed coordinates and derivatives."""
        return self.compiled.driven(self.time)

    def system(self, q: Array, v: Array) -> tuple[Array, Array, Array, Array]:
        """Constraint values, Jacobian, right sides of accelerations and velocities."""
        T = self.compiled.tables
        C, J, gam, vel = kernels.constraint_system(T, kernels.state_rows(T, q, v), self.slots, self.driven)
        return C, J, gam, vel

    def scaled_jacobian(self, q: Array) -> Array:
        """Jacobian without units."""
        J = self.system(q, np.zeros_like(q))[1]
        return np.asarray(J * self.compiled.unit / self.compiled.row_unit[:, None])

    def blind(self, q: Array, rank: int) -> bool:
        """Whether constraints look dependent to the masses (``rank`` in their metric) that geometry tells apart."""
        S = np.linalg.svd(self.scaled_jacobian(q), compute_uv=False)
        return bool(S.size) and rank < int(np.sum(1e-10 * S[0] < S))


def joint_coordinate(mechanism: Mechanism, base: int, link: int, poses: Array, rates: Array) -> tuple[Array, Array]:
    """Coordinate and rate of an R or P joint at link poses and velocities (..., links, 3)."""
    joint = mechanism.joint(base, link)
    if not isinstance(joint, Revolute | Prismatic):
        raise GeometryError(f"joint {base}-{link} is {joint.kind}; only R and P joints have one coordinate")
    a, b = (tuple(np.moveaxis(poses[..., end, :], -1, 0)) for end in (joint.a, joint.b))
    at = seen(FLOATS, joint, a, b)
    value, gradient = joint.coordinate(at)
    rate = np.zeros(np.shape(value))
    for end, by in zip((joint.a, joint.b), derivatives(at, [gradient])[0]):
        rate = rate + sum(rates[..., end, k] * part for k, part in enumerate(by) if part is not None)
    sign = 1.0 if base == joint.a else -1.0
    return sign * value, sign * rate
