"""Friction elements of a compiled model: their sliding rates, and locks that hold those that stick."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from graphsynth.dynamics.elements import JointFriction
from graphsynth.dynamics.tables import Compiled, RowInfo, driver_row
from graphsynth.kinematics.engine import codes
from graphsynth.mechanism.laws import Driver

Array = NDArray[np.float64]


@dataclass(frozen=True)
class FrictionElement:
    """One friction element: its joint's rows, the lever of its force (m; 1 in a guide), coefficients."""

    name: str
    row: int
    pin: bool
    lever: float
    length: float
    kinetic: float
    static: float
    stribeck: float
    regular: float

    @property
    def smooth(self) -> bool:
        """Whether the law is regularised: it never sticks."""
        return self.regular > 0.0

    @property
    def onset(self) -> float:
        """Coefficient at the first instant of sliding."""
        return self.static if self.stribeck > 0.0 else self.kinetic

    def coefficient(self, speed: float) -> float:
        """Coefficient at a sliding speed other than 0 (m/s)."""
        fall = float(np.exp(-((speed / self.stribeck) ** 2))) if self.stribeck > 0.0 else 0.0
        return self.kinetic + (self.static - self.kinetic) * fall

    @property
    def rows(self) -> slice:
        """Rows whose multipliers make the load."""
        return slice(self.row, self.row + (2 if self.pin or self.length > 0.0 else 1))

    def load(self, lam: Array) -> float:
        """Load, N, from the multipliers."""
        if self.pin:
            return float(np.hypot(lam[self.row], lam[self.row + 1]))
        normal = abs(float(lam[self.row]))
        return max(normal, 2.0 * abs(float(lam[self.row + 1])) / self.length) if self.length > 0.0 else normal


class FrictionRows:
    """The friction elements of a model; a workspace that a run makes once."""

    def __init__(self, compiled: Compiled) -> None:
        self.compiled = compiled
        T = compiled.tables
        elements = [e for e in compiled.model.elements if isinstance(e, JointFriction)]
        self.joints = [compiled.model.mechanism.joint(e.a, e.b) for e in elements]
        self.elements = tuple(
            FrictionElement(
                f"{joint.kind} {joint.a}-{joint.b}", int(T.friction[f, 0]), pin,
                float(T.friction_table[f, 4]) if pin else 1.0, *map(float, T.friction_table[f, [5, 0, 1, 2, 3]]),
            )
            for f, (joint, pin) in enumerate(zip(self.joints, T.friction[:, 1] == 2))
        )  # fmt: skip
        self.all = locked(compiled, self, range(len(self.elements)), np.zeros(len(self.elements)))

    @cached_property
    def lower_inverse(self) -> Array:
        """Inverse of the Cholesky factor of the mass matrix; (0, 0) with massless links."""
        return np.asarray(np.linalg.inv(self.compiled.tables.lower))

    def directions(self, t: float, q: Array, v: Array, slots: Array) -> tuple[Array, Array, Array, Array, Array]:
        """Jacobian and right side of the joints; of the elements: directions W, coordinates, ``udot - W a``.

        The sliding rates are ``u = W v`` (of b relative to a), and W^T phi is the generalised force of friction phi.
        """
        from graphsynth.dynamics import kernels

        T, m = self.all.tables, len(self.compiled.info)
        C, J, gam, _ = kernels.constraint_system(T, kernels.state_rows(T, q, v), slots, self.all.driven(t))
        return J[:m], gam[:m], J[m:], C[m:], -gam[m:]


def locked(compiled: Compiled, rows: FrictionRows, which: Sequence[int], held: Array) -> Compiled:
    """Return the model with the coordinates of some friction elements' joints held at given values."""
    T, count = compiled.tables, len(compiled.laws)
    ints, floats, info = [], np.zeros((len(which), T.table.shape[1])), []
    for k, f in enumerate(which):
        joint = rows.joints[f]
        kind, a, b, own = driver_row(compiled.model, Driver(joint.a, joint.b), compiled.centres, count + k)
        ints.append((kind, a, b))
        floats[k, : len(own)] = own
        info.append(
            RowInfo(
                f"sticking {joint.kind} {joint.a}-{joint.b}",
                kind == codes.DRIVE_ANGLE,
                compiled.info[int(T.friction[f, 0])].joint,
            )
        )
    tables = T._replace(
        rows=np.vstack([T.rows, np.array(ints, dtype=np.int64).reshape(-1, 3)]), table=np.vstack([T.table, floats]),
        slots=np.concatenate([T.slots, np.full(len(ints), -1, dtype=np.int64)]),
    )  # fmt: skip
    return replace(compiled, tables=tables, info=(*compiled.info, *info), held=tuple(float(x) for x in held))
