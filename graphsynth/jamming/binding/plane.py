"""Least elastic energy in the plane: pins shift freely within their clearance and press beyond it, all else is held.

Unknowns are the poses of the links, z = (x, y, Lc theta).  Rows that are held (drivers, rigid joints, guides) are
solved exactly, and the energy of the contacts is minimised on what they leave free, by Newton's method in a trust
region: the bending of the held rows and of the contacts counts, so that links in line are found.  See
theory/what-binding-costs 10.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from graphsynth.mechanism.constraints import characteristic_length
from graphsynth.mechanism.equations import FLOATS, derivatives, seen
from graphsynth.mechanism.joints import PlanarJoint, Prismatic, Revolute
from graphsynth.mechanism.model import Mechanism

Array = NDArray[np.float64]
_ROUNDS = 200
_RANK = 1e-10
_CLOSED = 1e-12
#: Step of the differences that tell how rows bend; they steer the search and change no result.
_STEP = 1e-5


class Contacts(NamedTuple):
    """Clearance and stiffness of every joint against shifts; those of infinite stiffness are held."""

    clearance: Array
    stiffness: Array


class Rest(NamedTuple):
    """Where a mechanism rests: z, energy, forces of all rows, derivatives of the energy's parts, rate of z by inputs.

    ``rows``: shifts (lengths); ``rate`` is for the rates of the drivers' coordinates that were asked for.
    """

    z: Array
    energy: float
    rows: Array
    forces: Array
    rate: Array


class Plane:
    """Rows of the joints and of the drivers of a mechanism, all in lengths, over the moving links."""

    def __init__(self, mechanism: Mechanism, soft: NDArray[np.bool_]) -> None:
        """``soft``: joints whose pins (or guides, across) may shift."""
        self.mechanism, self.Lc = mechanism, characteristic_length(mechanism)
        self.moving = [k for k in range(mechanism.graph.links) if k != mechanism.frame]
        self.scale = np.tile([1.0, 1.0, self.Lc], len(self.moving))
        self.of_joint: list[slice] = []
        angular: list[bool] = []
        held: list[bool] = []
        for joint, own in zip(mechanism.joints, soft.tolist()):
            count = 3 - joint.mobility
            self.of_joint.append(slice(len(held), len(held) + count))
            held += [not own] * count if isinstance(joint, Revolute) else [not own, *[True] * (count - 1)]
            angular += [False] * count if not isinstance(joint, Prismatic) else [False, True]
        self.pins = _Pins(mechanism, [own.start for own in self.of_joint])
        #: Rows of the springs of every joint that may shift.
        self.springs = {
            k: slice(own.start, own.stop if isinstance(joint, Revolute) else own.start + 1)
            for k, (joint, own) in enumerate(zip(mechanism.joints, self.of_joint))
            if soft[k]
        }
        driven = [mechanism.joint(*driver.pair) for driver in mechanism.drivers]
        angular += [not isinstance(joint, Prismatic) for joint in driven]
        self.held = np.array([*held, *[True] * len(driven)])
        self.length = np.where(angular, self.Lc, 1.0)

    def state(self, pose: Array) -> Array:
        """Coordinates z of a pose (links, 3)."""
        return np.asarray(pose[self.moving].ravel() * self.scale)

    def pose(self, z: Array) -> Array:
        """Poses (..., links, 3) of coordinates, or their rates."""
        found = np.zeros((*z.shape[:-1], self.mechanism.graph.links, 3))
        found[..., self.moving, :] = (z / self.scale).reshape(*z.shape[:-1], -1, 3)
        return found

    def rows(self, z: Array, drive: Array) -> tuple[Array, Array]:
        """Return rows (N, rows) and their derivatives (N, rows, z) at z (N, z); ``drive``: drivers' coordinates."""
        poses = self.pose(z)
        values = np.zeros((len(z), len(self.length)))
        J = np.zeros((len(z), len(self.length), 3 * self.mechanism.graph.links))
        self.pins.write(poses, values, J)
        for joint, rows in zip(self.mechanism.joints, self.of_joint):
            if isinstance(joint, Revolute):
                continue
            row = rows.start
            at = seen(FLOATS, joint, *(tuple(poses[:, link].T) for link in (joint.a, joint.b)))
            own = zip(joint.values(at), joint.turns(), derivatives(at, joint.gradients(at)))
            for value, turns, entries in own:
                period = math.tau * abs(sum(turns))
                values[:, row] = value - period * np.round(value / period) if turns else value
                _fill(J, row, joint, entries)
                row += 1
        for row, (driver, wanted) in enumerate(zip(self.mechanism.drivers, drive), values.shape[1] - len(drive)):
            joint = self.mechanism.joint(*driver.pair)
            at = seen(FLOATS, joint, *(tuple(poses[:, link].T) for link in (joint.a, joint.b)))
            value, gradient = joint.coordinate(at)  # type: ignore[union-attr]
            sense = 1.0 if joint.a == driver.base else -1.0
            off = sense * value - wanted
            values[:, row] = off if isinstance(joint, Prismatic) else off - math.tau * np.round(off / math.tau)
            _fill(J, row, joint, derivatives(at, [gradient])[0])
            J[:, row] *= sense
        columns = [3 * link + axis for link in self.moving for axis in range(3)]
        return values * self.length, J[:, :, columns] * self.length[:, None] / self.scale

    def closed(self, z: Array, drive: Array) -> Array | None:
        """Move to where the held rows vanish; None where they do not."""
        for _ in range(40):
            values, J = self.rows(z[None], drive)
            rest = values[0, self.held]
            if float(np.abs(rest).max(initial=0.0)) <= _CLOSED * self.Lc:
                return z
            step = np.linalg.lstsq(J[0, self.held], -rest, rcond=_RANK)[0]
            size = float(np.abs(step).max())
            z = z + step * min(1.0, 0.5 * self.Lc / size) if size > 0.0 else z
        return z if float(np.abs(rest).max(initial=0.0)) <= 1e3 * _CLOSED * self.Lc else None

    def pressed(self, values: Array, contacts: Contacts) -> tuple[float, Array, Array]:
        """Energy, forces (rows,), and stiffness (rows, rows) of the contacts; complementarity: a force only beyond."""
        energy, forces, K = 0.0, np.zeros(len(values)), np.zeros((len(values), len(values)))
        for k, rows in self.springs.items():
            way = values[rows]
            size, c, stiff = float(np.sqrt(way @ way)), contacts.clearance[k], contacts.stiffness[k]
            if size <= c or size == 0.0:
                if c == 0.0:
                    K[rows, rows] = stiff * np.eye(len(way))
                continue
            n = way / size
            energy += 0.5 * stiff * (size - c) ** 2
            forces[rows] = stiff * (size - c) * n
            K[rows, rows] = stiff * (np.outer(n, n) + (1.0 - c / size) * (np.eye(len(n)) - np.outer(n, n)))
        return energy, forces, K


class _Pins:
    """Rows of all revolute joints at once."""

    def __init__(self, mechanism: Mechanism, first: list[int]) -> None:
        own = [(joint, row) for joint, row in zip(mechanism.joints, first) if isinstance(joint, Revolute)]
        self.row = np.array([row for _, row in own], dtype=np.intp)
        self.ends = [
            (np.array([link for link, _ in end], dtype=np.intp), np.array([complex(*at) for _, at in end]), sign)
            for end, sign in (
                ([(joint.a, joint.at_a) for joint, _ in own], -1.0),
                ([(joint.b, joint.at_b) for joint, _ in own], 1.0),
            )
        ]

    def write(self, poses: Array, values: Array, J: Array) -> None:
        """Write rows and their derivatives at poses (N, links, 3)."""
        turned = np.exp(1j * poses[..., 2])
        for links, at, sign in self.ends:
            arm = sign * turned[:, links] * at
            values[:, self.row] += sign * poses[:, links, 0] + arm.real
            values[:, self.row + 1] += sign * poses[:, links, 1] + arm.imag
            J[:, self.row, 3 * links] = J[:, self.row + 1, 3 * links + 1] = sign
            J[:, self.row, 3 * links + 2], J[:, self.row + 1, 3 * links + 2] = -arm.imag, arm.real


def _fill(J: Array, row: int, joint: PlanarJoint, entries: tuple[list[Any], list[Any]]) -> None:
    for link, own in zip((joint.a, joint.b), entries):
        for axis, entry in enumerate(own):
            if entry is not None:
                J[:, row, 3 * link + axis] = entry


def settled(plane: Plane, z: Array, drive: Array, rates: Array, contacts: Contacts) -> Rest | None:
    """Least energy near z with the drivers held; None where the held rows cannot be closed (nothing gives way)."""
    found = plane.closed(z, drive)
    if found is None:
        return None
    z, radius, last = found, 0.3 * plane.Lc, 2
    for _ in range(_ROUNDS):
        local = _Local(plane, z, drive, contacts)
        s, promised = local.step(radius)
        if -promised <= 1e-15 * local.energy + local.nothing:
            end = plane.closed(z + local.free @ s, drive)  # makes the forces as good as the energy
            z, last = z if end is None else end, last - 1
            if last == 0:
                break
            continue
        trial = plane.closed(z + local.free @ s, drive)
        gained = -math.inf
        if trial is not None:
            gained = local.energy - plane.pressed(plane.rows(trial[None], drive)[0][0], contacts)[0]
        size = float(np.sqrt(s @ s))
        if gained < 0.25 * -promised:
            radius = 0.25 * size
        elif gained > 0.75 * -promised:
            radius = max(radius, 2.0 * size)
        if trial is not None and gained > 0.0:
            z = trial
        if radius < 1e-14 * plane.Lc:
            break
    local = _Local(plane, z, drive, contacts)
    return Rest(z, local.energy, local.values, local.forces, local.rate(rates))


class _Local:
    """Energy to second order at z, on what the held rows leave free."""

    def __init__(self, plane: Plane, z: Array, drive: Array, contacts: Contacts) -> None:
        self.plane, count = plane, len(z)
        shifts = np.concatenate([np.zeros((1, count)), *(sign * _STEP * plane.Lc * np.eye(count) for sign in (1, -1))])
        values, J = plane.rows(z + shifts, drive)
        self.values, self.J = values[0], J[0]
        self.energy, self.forces, K = plane.pressed(self.values, contacts)
        slope = self.J.T @ self.forces
        held = self.J[plane.held]
        left, sizes, right = np.linalg.svd(held, full_matrices=True)
        rank = int((sizes > _RANK * sizes.max(initial=1e-300)).sum())
        self.free = right[rank:].T
        self.forces[plane.held] = -left[:, :rank] @ ((right[:rank] @ slope) / sizes[:rank])
        bent = (np.einsum("nrz,r->nz", J[1 : count + 1] - J[count + 1 :], self.forces)) / (2.0 * _STEP * plane.Lc)
        self.H = self.J.T @ K @ self.J + 0.5 * (bent + bent.T)
        self.slope = self.free.T @ slope
        stiff = max((float(contacts.stiffness[k]) for k in plane.springs), default=0.0)
        self.nothing = 0.5 * stiff * (1e-14 * plane.Lc) ** 2

    def step(self, radius: float) -> tuple[Array, float]:
        """Return the best step within a radius and the change of energy that it promises."""
        A = self.free.T @ self.H @ self.free
        if A.size == 0:
            return np.zeros(0), 0.0
        values, vectors = np.linalg.eigh(A)
        g = vectors.T @ self.slope
        floor = 1e-13 * max(float(np.abs(values).max()), 1e-300)
        low, high = max(0.0, -float(values[0])) + floor, None
        s = -g / (np.maximum(values, 0.0) + (floor if values[0] > -floor else 0.0)) if values[0] > -floor else None
        if s is None or float(np.sqrt(s @ s)) > radius:  # with the multiplier that makes it as long as the radius
            high = low + float(np.sqrt(g @ g)) / radius
            for _ in range(60):
                middle = 0.5 * (low + high)
                size = float(np.sqrt(((g / (values + middle)) ** 2).sum()))
                low, high = (middle, high) if size > radius else (low, middle)
            s = -g / (values + high)
        return vectors @ s, float(g @ s + 0.5 * s @ (values * s))

    def rate(self, rates: Array) -> Array:
        """Rate of z as the drivers' coordinates go on at given rates, the mechanism staying at rest."""
        held, count = self.J[self.plane.held], len(self.H)
        stiff = max(float(np.abs(self.H).max(initial=0.0)), 1e-300)
        whole = np.zeros((count + len(held), count + len(held)))
        whole[:count, :count] = self.H / stiff
        whole[:count, count:], whole[count:, :count] = held.T, held
        right = np.zeros(len(whole))
        drivers = len(rates)
        right[len(whole) - drivers :] = rates * self.plane.length[len(self.plane.length) - drivers :]
        return np.asarray(np.linalg.lstsq(whole, right, rcond=1e-12)[0][:count])
