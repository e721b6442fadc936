"""Loops and bodies: the small-tilt closure of any planar mechanism, in numbers and in intervals.

Body i has the tilt vector ``omega_i`` and the axial displacement ``w_i``: ``z_i(r) = w_i + cross(omega_i, r)``.  At
joint j between bodies a and b, ``tau_j = omega_b - omega_a - d_j`` (d_j the misalignment of its axis) and
``zeta_j = z_b(r_j) - z_a(r_j) - cross(d_j, r_j - p_j)``, both of b against a.  A misaligned seat leans about its own
point p_j; only that of a rail differs from r_j, where its slider is.

A set of moments and axial forces in equilibrium on every moving body is a combination of loops: the loop l carries the
wrench ``(M_l, f_l)`` about the origin, and joint j the sum ``(M, f)_j`` of the loops through it, with sign, so that its
moment is ``m_j = M_j - f_j J(r_j)``, ``J(r) = (r_y, -r_x)``.  Equilibrium then holds identically in the positions.  The
misalignment works with the moment about p_j.
See theory/joints-that-share-a-tilt 2 to 4.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray

from graphsynth.intervals import Interval
from graphsynth.jamming.assembly.places import Places
from graphsynth.jamming.joints.limits import Limits, Misalignment, bounds
from graphsynth.mechanism.joints import PinSlot, Prismatic, Revolute

if TYPE_CHECKING:
    from graphsynth.mechanism.model import Mechanism


Array = NDArray[np.float64]
Ints = NDArray[np.intp]
Directions = NDArray[np.complex128]
#: x and y of every joint, intervals or duals of shape (N,).
Columns: TypeAlias = list[tuple[Any, Any]]

#: Which tilt a limit is on: that of a round joint in all directions, or one of a straight guide.
KINDS = ("tilt", "roll", "pitch")
ROUND, ROLL, PITCH = 0, 1, 2


@dataclass(frozen=True, eq=False)
class Layout:
    """What does not change with the pose.

    ``joints``: joints with any limit, by their number in the mechanism; the others are no part of the program.
    ``pairs`` (joints, 2): bodies a and b.  ``incidence`` (loops, joints): +1 where the loop passes the joint from a to
    b, -1 from b to a.  ``block_joint``, ``block_axis`` (blocks,): of every limit on tilt its joint (position in
    ``joints``) and its place in `KINDS`.  ``limit`` (blocks,), ``end_float`` (joints,): nominal
    limits; 0 is rigid, infinite is none; their ``_range`` (2, ...) are tolerance boxes.  ``misalignments``: position in
    ``joints``, sign that makes it one of b against a, and the misalignment.  ``rails``: positions in ``joints`` of
    those that are rails, which lean about their own points on link a and not where the joint is.
    """

    joints: tuple[int, ...]
    pairs: Ints
    incidence: Array
    block_joint: Ints
    block_axis: Ints
    limit: Array
    end_float: Array
    limit_range: Array
    end_float_range: Array
    misalignments: tuple[tuple[int, float, Misalignment], ...]
    rails: tuple[int, ...]

    @property
    def loops(self) -> int:
        """Number of independent loops."""
        return len(self.incidence)


def lay_out(mechanism: Mechanism, limits: tuple[Limits, ...], tilts: tuple[Misalignment, ...]) -> Layout:
    """Loops, blocks and limits of a mechanism."""
    by_pair = {tilt.pair: tilt for tilt in tilts}
    kept: list[int] = []
    blocks, turned, rails = [], [], []
    for k, (joint, own) in enumerate(zip(mechanism.joints, limits)):
        tilt = by_pair.get(joint.pair)
        if tilt is None and min(own.axial_clearance, *(getattr(own, name) for name in own.tilts)) == math.inf:
            continue
        place = len(kept)
        kept.append(k)
        blocks += [(place, KINDS.index(name), getattr(own, name), *bounds(own, name)) for name in own.tilts]
        if tilt is not None:
            turned.append((place, 1.0 if tilt.base == joint.a else -1.0, tilt))
            if tilt.base == joint.a and isinstance(joint, Prismatic | PinSlot):
                rails.append(place)
    pairs = np.array([(mechanism.joints[k].a, mechanism.joints[k].b) for k in kept], dtype=np.intp).reshape(-1, 2)
    table = np.array(blocks, dtype=np.float64).reshape(-1, 5)
    return Layout(
        joints=tuple(kept),
        pairs=pairs,
        incidence=_loops(pairs, mechanism.graph.links, mechanism.frame),
        block_joint=table[:, 0].astype(np.intp),
        block_axis=table[:, 1].astype(np.intp),
        limit=table[:, 2],
        end_float=np.array([limits[k].axial_clearance for k in kept]),
        limit_range=table[:, 3:].T.copy(),
        end_float_range=np.array([bounds(limits[k], "axial_clearance") for k in kept]).reshape(-1, 2).T.copy(),
        misalignments=tuple(turned),
        rails=tuple(rails),
    )


def _loops(pairs: Ints, bodies: int, frame: int) -> Array:
    """Fundamental loops of a breadth-first tree from the frame (and from every part it does not reach)."""
    up: dict[int, tuple[int, int, float] | None] = {}  # body: (parent, joint, sign of the way down)
    tree: set[int] = set()
    for root in (frame, *range(bodies)):
        if root in up:
            continue
        up[root] = None
        queue = [root]
        for body in queue:
            for k, (a, b) in enumerate(pairs.tolist()):
                for here, there, sign in ((a, b, 1.0), (b, a, -1.0)):
                    if here == body and there not in up:
                        up[there] = (body, k, sign)
                        tree.add(k)
                        queue.append(there)
    rows = []
    for k, (a, b) in enumerate(pairs.tolist()):
        if k in tree:
            continue
        row = np.zeros(len(pairs))
        row[k] = 1.0
        for body, sense in ((a, 1.0), (b, -1.0)):  # down the tree to a, through the joint, and up from b
            step = up[body]
            while step is not None:
                row[step[1]] += sense * step[2]
                step = up[step[0]]
        rows.append(row)
    return np.array(rows).reshape(-1, len(pairs))


def joint_places(mechanism: Mechanism, joints: tuple[int, ...], poses: Array) -> Places:
    """Places of joints at poses (N, links, 3)."""
    return carried(mechanism, joints, poses[..., 0] + 1j * poses[..., 1], np.exp(1j * poses[..., 2]), 1.0)


def carried(
    mechanism: Mechanism, joints: tuple[int, ...], origin: Directions, turn: Directions, fixed: float
) -> Places:
    """Places of joints from origins and directions of the links, each (N, links), complex; or their rates from rates.

    ``fixed`` stands where a joint has no guide: 1 for places, 0 for rates.
    """
    r = np.zeros((len(origin), len(joints)), dtype=np.complex128)
    rail, e, base = r.copy(), np.full_like(r, fixed), np.zeros((*r.shape, 2), dtype=np.complex128)
    for column, k in enumerate(joints):
        joint = mechanism.joints[k]
        link, at = (joint.a, joint.at_a) if isinstance(joint, Revolute) else (joint.b, joint.at_b)
        r[:, column] = rail[:, column] = origin[:, link] + turn[:, link] * complex(*at)
        if isinstance(joint, Prismatic | PinSlot):
            rail[:, column] = origin[:, joint.a] + turn[:, joint.a] * complex(*joint.at_a)
            e[:, column] = turn[:, joint.a] * np.exp(1j * joint.angle_a)
        base[:, column, 0], base[:, column, 1] = turn[:, joint.a], turn[:, joint.b]
    return Places(*(np.stack([part.real, part.imag], -1) for part in (r, e, base, rail)))


class Leans(NamedTuple):
    """Misalignments d_j in the plane, and the points p_j about which they lean, each (N, joints, 2)."""

    d: Array
    about: Array


def leans(layout: Layout, at: Places, extra: float = 0.0) -> Leans:
    """Misalignments at places, in floats; ``extra`` turns every direction (radians)."""
    base = at.base
    d = np.zeros((*base.shape[:2], 2))
    for place, sign, tilt in layout.misalignments:
        side = 0 if sign > 0 else 1
        angle = tilt.direction + extra
        own = tilt.alpha * (math.cos(angle) + 1j * math.sin(angle)) * (base[:, place, side] @ np.array([1.0, 1j]))
        d[:, place, 0], d[:, place, 1] = sign * own.real, sign * own.imag
    return Leans(d, leaning_points(layout, at.r, at.rail))


def leaning_points(layout: Layout, r: Any, rail: Any) -> Any:
    """Points about which the joints' misalignments lean: of rails their own, else r; (..., joints, 2), or their rates.

    Arrays or intervals; r itself where no rail is misaligned.
    """
    if not layout.rails:
        return r
    own = np.zeros((len(layout.joints), 1), dtype=np.bool_)
    own[list(layout.rails)] = True
    if isinstance(r, Interval):
        return Interval.from_bounds(np.where(own, rail.lo, r.lo), np.where(own, rail.hi, r.hi))
    return np.where(own, rail, r)


def shifts_enclosed(layout: Layout, base: Interval) -> Interval:
    """Enclose the misalignments over their tolerance boxes; ``base`` (N, joints, 2, 2) directions of links a and b."""
    from graphsynth.intervals import cos, sin

    count, joints = base.shape[:2]
    zero = Interval.zeros((count,))
    columns = [Interval.zeros((count, 2)) for _ in range(joints)]
    for place, sign, tilt in layout.misalignments:
        alpha = Interval.from_bounds(*bounds(tilt, "alpha")) * sign
        direction = Interval.from_bounds(*bounds(tilt, "direction"))
        c, s = cos(direction) * alpha, sin(direction) * alpha
        turn = base[:, place, 0 if sign > 0 else 1]
        x, y = turn[:, 0], turn[:, 1]
        columns[place] = Interval.stack([x * c - y * s + zero, x * s + y * c + zero], axis=-1)
    return Interval.stack(columns, axis=1) if joints else Interval.zeros((count, 0, 2))


def moment_rows(layout: Layout, r: Array, e: Array) -> Array:
    """Matrix of all blocks' moments by the loop wrenches ``(M_x, M_y, f)``, shape (N, blocks, 2, 3 loops)."""
    C = layout.incidence
    loops = layout.loops
    at, axis = layout.block_joint, layout.block_axis
    rows = np.zeros((len(r), len(at), 2, loops, 3))
    through = C[:, at].T[None, :, :]
    rows[:, :, 0, :, 0] = rows[:, :, 1, :, 1] = through
    rows[:, :, 0, :, 2] = -through * r[:, at, 1, None]
    rows[:, :, 1, :, 2] = through * r[:, at, 0, None]
    flat = rows.reshape(len(r), len(at), 2, 3 * loops)
    lean = e[:, at]
    along = lean[:, :, 0, None] * flat[:, :, 0] + lean[:, :, 1, None] * flat[:, :, 1]
    across = -lean[:, :, 1, None] * flat[:, :, 0] + lean[:, :, 0, None] * flat[:, :, 1]
    for kind, value in ((ROLL, along), (PITCH, across)):
        flat[:, axis == kind, 0] = value[:, axis == kind]
        flat[:, axis == kind, 1] = 0.0
    return flat


def force_rows(layout: Layout) -> Array:
    """Axial forces of the joints by the loop wrenches, shape (joints, 3 loops)."""
    rows = np.zeros((len(layout.joints), layout.loops, 3))
    rows[:, :, 2] = layout.incidence.T
    return rows.reshape(len(layout.joints), -1)


def work_row(layout: Layout, lean: Leans) -> Array:
    """Work of the misalignments by the loop wrenches: ``W = sum (M_j - f_j J(p_j)) . d_j``, shape (N, 3 loops)."""
    d, p = lean
    rows = np.zeros((len(d), layout.loops, 3))
    C = layout.incidence
    rows[:, :, 0], rows[:, :, 1] = d[:, :, 0] @ C.T, d[:, :, 1] @ C.T
    rows[:, :, 2] = (d[:, :, 1] * p[:, :, 0] - d[:, :, 0] * p[:, :, 1]) @ C.T
    return rows.reshape(len(d), 3 * layout.loops)


def by_joint(values: Interval) -> Columns:
    """Split pairs (N, joints, 2) into x and y of every joint."""
    return [(values[:, k, 0], values[:, k, 1]) for k in range(values.shape[1])]


def closure_sums(
    layout: Layout,
    r: Columns,
    e: Columns,
    tau: Interval,
    zeta: Interval,
    length: float,
    lean: tuple[Columns, Columns] | None = None,
) -> list[Any]:
    """Sum up every loop (3 for each): tilts, tilts, slips over ``length``.

    Misalignments, and the points about which they lean, are included if given.
    """
    zero = Interval.zeros((len(tau),))
    x: list[Any] = [zero] * len(layout.joints)
    y: list[Any] = [zero] * len(layout.joints)
    for block, place in enumerate(layout.block_joint.tolist()):
        axis = layout.block_axis[block]
        if axis == ROUND:
            x[place], y[place] = x[place] + tau[:, block, 0], y[place] + tau[:, block, 1]
        else:
            own, (a, b) = tau[:, block, 0], e[place]
            if axis == PITCH:
                a, b = -b, a
            x[place], y[place] = x[place] + a * own, y[place] + b * own
    lifts: dict[int, Any] = {}
    if lean is not None:
        for place, _, _ in layout.misalignments:
            (u, v), (p, q) = lean[0][place], lean[1][place]
            if place in layout.rails:
                lifts[place] = r[place][0] * y[place] - r[place][1] * x[place] + (p * v - q * u)
            x[place], y[place] = x[place] + u, y[place] + v
    for place in np.flatnonzero(layout.incidence.any(axis=0)).tolist():
        if place not in lifts:
            lifts[place] = r[place][0] * y[place] - r[place][1] * x[place]
        lifts[place] = lifts[place] + zeta[:, place] / length
    sums: list[Any] = []
    for signs in layout.incidence.tolist():
        parts: list[Any] = [zero] * 3
        for place, sign in enumerate(signs):
            if sign == 0.0:
                continue
            parts = [p + v if sign > 0.0 else p - v for p, v in zip(parts, (x[place], y[place], lifts[place]))]
        sums += parts
    return sums
