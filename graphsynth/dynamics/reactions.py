"""Reactions in the joints, from the multipliers and a second time from the equilibrium of every body."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from graphsynth.core.checks import link_number
from graphsynth.core.errors import GeometryError
from graphsynth.mechanism.joints import Gear
from graphsynth.mechanism.laws import Driver

if TYPE_CHECKING:
    from graphsynth.dynamics.tables import Compiled
    from graphsynth.dynamics.values import Values

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]


@dataclass(frozen=True, eq=False)
class JointReaction:
    """Reaction in one joint over n instants: what acts on link b; the opposite acts on a."""

    a: int
    b: int
    kind: str  #: "R", "P", "pin-slot", "gear", "cam", "rack", "rigid", "driver"
    force: Array  #: (n, 2), N, world coordinates
    couple: Array  #: (n,), at ``point``, N m
    point: Array  #: (n, 2), of application: the joint's point of b; of a gear its pitch point
    #: (n, 3), whether the two components and the couple are determined; with redundant constraints they need not be
    determined: NDArray[np.bool_]
    angle_a: Array = field(repr=False)
    angle_b: Array = field(repr=False)
    apart: Complex = field(repr=False)

    def on(self, link: int, frame: str = "world") -> tuple[Array, Array]:
        """Force (n, 2) and couple (n,) on one of the two links, in the "world" or in that "body"'s frame.

        Raises
        ------
        GeometryError
            A link that is not in the joint, or an unknown frame.
        """
        if link_number("link", link) not in (self.a, self.b):
            raise GeometryError(f"link {link} is not in joint {self.a}-{self.b}; name one of the two")
        if not isinstance(frame, str) or frame not in ("world", "body"):
            raise GeometryError(f"frame = {frame!r} is not known; give 'world' or 'body'")
        sign = 1.0 if link == self.b else -1.0
        force = sign * (self.force[:, 0] + 1j * self.force[:, 1])
        if frame == "body":
            force = force * np.exp(-1j * (self.angle_b if link == self.b else self.angle_a))
        return np.column_stack([force.real, force.imag]), sign * self.couple

    @property
    def size(self) -> Array:
        """Magnitude of the force, shape (n,), N."""
        return np.hypot(self.force[:, 0], self.force[:, 1])


@dataclass(frozen=True, eq=False)
class Reactions:
    """Reactions of all joints over n instants; ``joints`` in the order graph joints, additional, prescribed."""

    times: Array
    joints: tuple[JointReaction, ...]

    def between(self, a: int, b: int, index: int = 0) -> JointReaction:
        """Return the reaction between two links; ``index`` chooses among several.

        Raises
        ------
        GeometryError
            If there is no such joint.
        """
        pair = {link_number("link a", a), link_number("link b", b)}
        found = [joint for joint in self.joints if {joint.a, joint.b} == pair]
        if link_number("index", index) >= len(found):
            raise GeometryError(f"links {a} and {b} have {len(found)} joints; number {index} does not exist")
        return found[index]

    def separating(self, a: int, b: int, pressure_angle: float) -> Array:
        """Separating force that the teeth of gear pair a-b exert on its link b, shape (n, 2), N.

        ``|tangential force| tan(pressure_angle)`` along the line of centres: it pushes a wheel with outer teeth from
        the pitch point towards its own centre.  The bearings must carry it besides what they carry already
        (theory/planar-dynamics 7).

        Raises
        ------
        GeometryError
            If the joint is not a gear pair.
        """
        joint = self.between(a, b)
        if joint.kind != "gear":
            raise GeometryError(f"joint {a}-{b} is {joint.kind}; only gears have a separating force")
        sense = 1.0 if joint.b == b else -1.0
        size = sense * joint.size * np.tan(pressure_angle)
        return np.asarray(np.column_stack([joint.apart.real, joint.apart.imag]) * size[:, None])


def reactions_from_multipliers(
    compiled: Compiled, q: Array, v: Array, multipliers: Array, times: Array, more: Mapping[int, Array] | None = None
) -> Reactions:
    """Wrenches ``-C_q^T lam`` of every joint, moved to its point, at n instants.

    ``more`` are, at some instants, changes of the multipliers that joints which stick together leave open, shape
    (rows, changes).
    """
    from graphsynth.dynamics.values import Values, jacobians

    count, joints = len(q), compiled.joints
    wrench = np.full((len(joints), count, 3), np.nan)  # on b (on a if b is the frame: negated), about its origin
    determined = np.zeros((len(joints), count, 3), dtype=np.bool_)
    angles, points = np.zeros((compiled.links, count)), np.full((len(joints), count), np.nan, dtype=np.complex128)
    apart = np.zeros((len(joints), count), dtype=np.complex128)
    ends = [*compiled.first, len(compiled.info)]
    there = np.flatnonzero(np.isfinite(q).all(axis=1))
    J = jacobians(compiled, q[there], v[there])
    stuck = {k: more[int(i)] for k, i in enumerate(there) if i in more} if more else {}
    left = _open_changes(Values(compiled, 0.0, np.zeros(0)), J, stuck)
    place = np.zeros((len(there), compiled.links, 3))
    place[:, compiled.moving] = q[there].reshape(len(there), -1, 3)
    angles[:, there] = place[:, :, 2].T
    for index in range(len(joints)):
        rows = slice(ends[index], ends[index + 1])
        link, sign, at = _application(compiled, index, place)
        points[index, there] = at
        joint = joints[index]
        if isinstance(joint, Gear):  # a wheel with outer teeth is pushed towards its own centre, a ring the other way
            u = world(place, compiled, joint.b, joint.at_b) - world(place, compiled, joint.a, joint.at_a)
            apart[index, there] = (-u if joint.internal else u) / np.where(u == 0.0, 1.0, np.abs(u))
        column = int(compiled.tables.column[link])
        own = -sign * J[:, rows, column : column + 3].swapaxes(1, 2)
        arm = at - (place[:, link, 0] + 1j * place[:, link, 1])
        own[:, 2] += arm.imag[:, None] * own[:, 0] - arm.real[:, None] * own[:, 1]
        wrench[index, there] = np.einsum("nck,nk->nc", own, multipliers[there, rows])
        free = np.abs(own @ left[:, rows]).max(axis=2, initial=0.0)
        determined[index, there] = free <= 1e-8 * np.maximum(1.0, np.abs(own).max(axis=(1, 2), initial=0.0))[:, None]
    found = []
    for index, joint in enumerate(joints):
        a, b = _ends(compiled, joint)
        kind = "driver" if isinstance(joint, Driver) else str(getattr(joint, "kind", type(joint).__name__.lower()))
        force, couple = wrench[index, :, :2], wrench[index, :, 2]
        at = np.column_stack([points[index].real, points[index].imag])
        where = angles[a], angles[b], apart[index]
        found.append(JointReaction(a, b, kind, force, couple, at, determined[index], *where))
    return Reactions(times, tuple(found))


def _ends(compiled: Compiled, joint: Any) -> tuple[int, int]:
    if isinstance(joint, Driver):
        own = compiled.model.mechanism.joint(*joint.pair)
        return own.a, own.b
    return (joint.rack, joint.pinion) if hasattr(joint, "rack") else (joint.a, joint.b)


def _open_changes(values: Values, J: Array, found: dict[int, Array]) -> Array:
    """Columns: changes of the multipliers that the balance leaves open, filled up with zeros, (n, rows, changes)."""
    n, m, _ = J.shape
    scaled = J * values.compiled.unit / values.compiled.row_unit[:, None]
    S = np.linalg.svd(scaled, compute_uv=False) if scaled.size else np.zeros((n, 1))
    ranks = (1e-10 * S[:, :1] < S).sum(axis=1)
    for k in np.flatnonzero(ranks < m).tolist():
        U = np.linalg.svd(scaled[k])[0]
        parts = [U[:, ranks[k] :] / values.compiled.row_unit[:, None], *([found[k]] if k in found else [])]
        found[k] = np.hstack(parts)
    left = np.zeros((n, m, max((part.shape[1] for part in found.values()), default=0)))
    for k, part in found.items():
        left[k, :, : part.shape[1]] = part
    return left


def world(place: Array, compiled: Compiled, link: int, at: tuple[float, float]) -> Any:
    """World points, complex, of a point given in the link frame, at places of all links (..., links, 3)."""
    local = complex(*at) - complex(*compiled.centres[link])
    return place[..., link, 0] + 1j * place[..., link, 1] + np.exp(1j * place[..., link, 2]) * local


def _application(compiled: Compiled, index: int, place: Array) -> tuple[int, float, Any]:
    """Find the moving link whose wrench is read, its sign for link b, and the points of application."""
    joint = compiled.joints[index]
    a, b = _ends(compiled, joint)
    if isinstance(joint, Driver):
        joint = compiled.model.mechanism.joint(*joint.pair)
    if hasattr(joint, "rack"):
        at = world(place, compiled, joint.pinion, joint.centre) - 1j * np.exp(1j * joint.angle) * joint.radius
        return (b, 1.0, at) if compiled.tables.column[b] >= 0 else (a, -1.0, at)
    at = world(place, compiled, b, joint.at_b)
    if isinstance(joint, Gear):
        other = world(place, compiled, a, joint.at_a)
        total = joint.radius_a + (-1.0 if joint.internal else 1.0) * joint.radius_b
        if abs(total) > 1e-9 * (joint.radius_a + joint.radius_b):
            at = other + (at - other) * (joint.radius_a / total)
    return (b, 1.0, at) if compiled.tables.column[b] >= 0 else (a, -1.0, at)
