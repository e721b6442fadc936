"""What the small-tilt closure neglects, bounded: the step from a proof of first order to one with exact tilts.

The exact model.  Link i has the orientation ``T(n_i) Rz(phi_i)``: n_i its normal, T the least rotation from the z axis
to it, ``phi_i`` its twist.  At a joint the angle between the axes of both sides (the seat turned by its misalignment)
is at most the limit (a guide: components of the relative rotation), and the centres lie at most the axial clearance
apart along an axis of the joint.  Drivers, guides and gears prescribe twists.  With ``h`` the horizontal part of a
normal and v the plane vector between two joints of a link, exactly

    horizontal step = v - h (h . v) / (1 + cos),      vertical step = - h . v

so the vertical closure is that of the small-tilt model at slightly moved positions, and the plane closure is disturbed
by terms of second order.  A rail that leans about its own point by the angle alpha about n lifts its slider off the
plane of its link by ``s sin(alpha) cross(n, e)``, s the travel and e its direction, and takes at most ``s (1 -
cos(alpha))`` off the way in that plane.  All this is bounded here from the largest angles that the limits allow; how
far it moves the joints follows from the loop equations, over the box in which the plane assembly is the only one.
Derivation: ``docs/explanation/coupled-jamming.md``.
"""

from __future__ import annotations

from itertools import combinations
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from graphsynth.intervals import Dual, Interval, variables
from graphsynth.intervals.dual import jacobian_of
from graphsynth.jamming.assembly.positions import PLANE, Moved, Positions, enclosed_solve
from graphsynth.jamming.joints.closure import ROUND, Layout
from graphsynth.jamming.joints.limits import bounds
from graphsynth.mechanism.constraints import characteristic_length
from graphsynth.mechanism.equations import Pair
from graphsynth.mechanism.joints import Gear, PinSlot, Prismatic, Revolute

if TYPE_CHECKING:
    from graphsynth.jamming.assembly.tubes import Tubes


Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

#: Largest angle of a link against the normal of the plane for which the bounds hold (their constants allow for it).
LARGEST = 0.5
#: Size of the box in which the disturbed assembly is proved the only one, over the movement expected.
_ROOM = 2.0
#: Allowance for what exact tilts add to the travel of a guide: a share of it, and of the size of the mechanism.
_STRETCH, _TRAVEL = 1.1, 0.1
#: Allowance for the rounding of the sums below, all of them of a few dozen nonnegative terms.
_ROUNDING = 1.0 + 1e-12


class Neglected(NamedTuple):
    """Bounds of what exact tilts change, per piece; lengths and radians.

    ``r``, ``e``, ``d``, ``about`` (N, joints): movement of a joint, turn of a guide, change of a misalignment, movement
    of the point it leans about.  ``lift`` (N, loops): rest of the vertical closure.  ``wide`` and ``narrow`` (N,
    blocks): limits on linear tilts that every exact tilt within its limit obeys, and that leave every exact tilt within
    its limit; ``end_float`` (N, joints) the latter for slips.  ``sound`` (N,): whether all of it is proved.
    """

    r: Array
    e: Array
    d: Array
    about: Array
    lift: Array
    wide: Array
    narrow: Array
    end_float: Array
    sound: Mask


class _Angles(NamedTuple):
    """Largest angles of every link (N, links) and joint (N, joints of the mechanism).

    ``seat`` (joints,) is the largest misalignment, ``base`` (joints,) the link that carries it, -1 without one.
    """

    link: Array
    joint: Array
    seat: Array
    base: NDArray[np.intp]


class _Sizes(NamedTuple):
    """Largest distance between two joints of every link (N, links), the way of a guide added on the link of its rail.

    ``way`` (N, joints of the mechanism): largest travel of every guide from its point on that link.  ``sine`` (joints,)
    of the largest misalignment of every rail, 0 elsewhere.
    """

    link: Array
    way: Array
    sine: Array

    @property
    def raised(self) -> Array:
        """Largest lift of every slider by its rail."""
        return np.asarray(self.way * self.sine)


def neglected(
    system: Positions, layout: Layout, tubes: Tubes, u: Interval, counted: Array, assumed: Array
) -> Neglected:
    """Bound what the small-tilt closure neglects over N pieces u of the input with proved tubes.

    ``assumed`` (N, blocks) are tilts below which a proof of freedom will keep all blocks, so that their limits need not
    be looked at; infinity for a proof of binding.
    """
    count, system = len(tubes.r), system.about(tubes.dyads)
    blocks = np.minimum(layout.limit_range[1], assumed)
    angles = _angles(system, layout, blocks)
    small: Mask = np.asarray((angles.link < LARGEST).all(axis=1) & (angles.joint < LARGEST).all(axis=1))
    angles = angles._replace(**{k: np.where(small[:, None], getattr(angles, k), 0.0) for k in ("link", "joint")})
    a, b = zip(*((joint.a, joint.b) for joint in system.mechanism.joints))
    # of the largest angle of either axis of every joint against the normal
    lean = np.sin(np.maximum(angles.link[:, a], angles.link[:, b]) + angles.seat)
    sizes = _sizes(system, layout, tubes, u, angles)
    slips, reached = _slips(system, layout, angles, sizes)
    small &= reached
    slips = np.where(small[:, None], slips, 0.0)
    offset, twist = _disturbances(system, angles, sizes, slips * lean)
    moved, way, turned, sound = _movements(system, layout, tubes, u, counted, offset, twist)
    way = np.where(sizes.way > 0.0, (way + offset) / np.cos(angles.link[:, a] + angles.seat), 0.0)
    sound &= (way <= sizes.way).all(axis=1)
    kept, pairs = list(layout.joints), layout.pairs
    moved_r, moved_about = (part + offset[:, kept] for part in moved)
    along = turned[:, pairs[:, 0]]
    shift = np.zeros((count, len(kept)))
    for place, _, _ in layout.misalignments:
        k = kept[place]
        shift[:, place] = _shift(angles, k) + float(angles.seat[k]) * turned[:, angles.base[k]]
    wide, narrow = _limits(system, layout, angles, blocks)
    lean = lean[:, kept]
    play = layout.end_float_range[0] * (1.0 - 0.5 * lean**2) / _ROUNDING
    # what is left of the vertical closure of every loop: h^2 (h . v) / (1 + cos) of its links, and slips
    body = np.sin(angles.link) * sizes.link * _dip(angles.link)
    rest = 0.5 * (body[:, pairs[:, 0]] + body[:, pairs[:, 1]]) + slips[:, kept] * lean**2
    for place in layout.rails:
        rest[:, place] += sizes.way[:, kept[place]] * _rise(angles, kept[place])
    lift = rest @ np.abs(layout.incidence).T
    changes = (value * _ROUNDING for value in (moved_r, along, shift, moved_about, lift, wide))
    return Neglected._make([*changes, narrow, play, np.asarray(sound & small)])


def _dip(angle: Any) -> Any:
    """One less the cosine, with a small relative error at small angles too."""
    return 2.0 * np.sin(0.5 * angle) ** 2


def _shift(angles: _Angles, k: int) -> Array:
    """Change of a misalignment but for the turn of its base: a sine for the angle, and the tilt of its base."""
    alpha, own = float(angles.seat[k]), angles.link[:, angles.base[k]]
    return np.asarray(alpha**3 / 6.0 + alpha * (own**2 + own * alpha) / (1.0 + np.cos(own)) + 0.5 * own * alpha**2)


def _rise(angles: _Angles, k: int) -> Array:
    """Bound how the lift of a slider differs from the misalignment times its travel, in parts of the travel.

    The lift is ``k = sin(alpha) c``, c the sine between axis and rail, and works as ``k (sin^2 + cos)`` of the angle of
    the link; the changed misalignment times the horizontal travel ``w - h (h . w) / (1 + cos) + k h`` is compared with
    it, where w is the travel in the plane of the link and h the horizontal part of its normal.
    """
    alpha, own, change = float(angles.seat[k]), angles.link[:, angles.base[k]], _shift(angles, k)
    less = _dip(own)
    aslant = (alpha + change) * (less + np.sin(alpha) * np.sin(own)) + np.sin(alpha) * less
    return np.asarray(change + alpha**3 * (1.0 / 2.0 + 1.0 / 6.0) + aslant)


def _angles(system: Positions, layout: Layout, blocks: Array) -> _Angles:
    """Largest angles: shortest paths from the frame through the joints whose tilt is bounded."""
    mechanism = system.mechanism
    joints, links = mechanism.joints, mechanism.graph.links
    count = len(blocks)
    tilt = np.full((count, len(joints)), np.inf)
    for place, k in enumerate(layout.joints):
        tilt[:, k] = np.sqrt((blocks[:, layout.block_joint == place] ** 2).sum(axis=1))
    seat, base = np.zeros(len(joints)), np.full(len(joints), -1)
    for place, sign, own in layout.misalignments:
        k = layout.joints[place]
        seat[k] = max(abs(bound) for bound in bounds(own, "alpha"))
        base[k] = joints[k].a if sign > 0 else joints[k].b
    link = np.full((count, links), np.inf)
    link[:, mechanism.frame] = 0.0
    for _ in range(links):
        for k, joint in enumerate(joints):
            for here, there in ((joint.a, joint.b), (joint.b, joint.a)):
                link[:, there] = np.minimum(link[:, there], (link[:, here] + tilt[:, k] + seat[k]) * _ROUNDING)
    a, b = zip(*((joint.a, joint.b) for joint in joints))
    return _Angles(link, np.minimum(tilt, link[:, a] + link[:, b] + seat), seat, base)


def _sizes(system: Positions, layout: Layout, tubes: Tubes, u: Interval, angles: _Angles) -> _Sizes:
    """Sizes of links and ways of guides; that the ways suffice is proved with the movements."""
    mechanism, count = system.mechanism, len(tubes.r)
    found = np.zeros((count, mechanism.graph.links))
    for link in range(mechanism.graph.links):
        ends = [both[j.a != link] for j, both in zip(mechanism.joints, system.local) if link in j.pair]
        for p, q in combinations(ends, 2):
            found[:, link] = np.maximum(found[:, link], PLANE.length(p - q).hi)
    way, sine = np.zeros((count, len(mechanism.joints))), np.zeros(len(mechanism.joints))
    sine[[layout.joints[place] for place in layout.rails]] = 1.0
    sine = np.sin(sine * angles.seat)
    room = _TRAVEL * characteristic_length(mechanism)
    at = system.place([tubes.tight[:, k] for k in range(system.size)], system.driven(u))
    for k, joint in enumerate(mechanism.joints):
        if isinstance(joint, Prismatic | PinSlot):
            far = _STRETCH * PLANE.length(system.seen(k, at).d).hi + room
            way[:, k] = far / np.cos(angles.link[:, joint.a] + angles.seat[k])
            found[:, joint.a] += way[:, k]
    return _Sizes(found * _ROUNDING, way * _ROUNDING, sine)


def _slips(system: Positions, layout: Layout, angles: _Angles, sizes: _Sizes) -> tuple[Array, Mask]:
    """Largest slip of every joint: its axial clearance, or what the heights of both links leave where there is none."""
    mechanism = system.mechanism
    play = np.full(len(mechanism.joints), np.inf)
    play[list(layout.joints)] = layout.end_float_range[1]
    rise, raised = sizes.link * np.sin(angles.link), sizes.raised
    height = np.full_like(angles.link, np.inf)
    height[:, mechanism.frame] = 0.0
    for _ in range(mechanism.graph.links):
        for k, joint in enumerate(mechanism.joints):
            for here, there in ((joint.a, joint.b), (joint.b, joint.a)):
                own = height[:, here] + rise[:, here] + raised[:, k] + play[k]
                height[:, there] = np.minimum(height[:, there], own)
    top = height + rise
    a, b = zip(*((joint.a, joint.b) for joint in mechanism.joints))
    found = np.minimum(play, (top[:, a] + top[:, b] + raised) / np.cos(LARGEST + angles.seat)) * _ROUNDING
    return found, np.asarray(np.isfinite(found).all(axis=1))


def _disturbances(system: Positions, angles: _Angles, sizes: _Sizes, offset: Array) -> tuple[Array, Array]:
    """Bounds of the offset of the plane closure at every joint, and of the twist that a joint prescribes amiss.

    ``offset`` is that of the slips along leaning axes.  Two rotations of tilts x and y make one of a tilt and a twist,
    at most half of ``x y (1 + small)``: the area of a spherical triangle.
    """
    mechanism = system.mechanism
    short = sizes.link * _dip(angles.link)
    driven = {driver.pair for driver in mechanism.drivers}
    parents = {edge.joint: edge.parent for edge in system.edges}
    twist = np.zeros_like(offset)
    for k, joint in enumerate(mechanism.joints):
        first, second = angles.link[:, joint.a], angles.link[:, joint.b]
        before = parents.get(k)
        if sizes.sine[k] > 0.0:  # the rail is shorter in the plane of its link, and what it lifts leans with that
            offset[:, k] += sizes.way[:, k] * (_dip(angles.seat[k]) + sizes.sine[k] * np.sin(first))
        offset[:, k] += short[:, joint.a] + short[:, joint.b] if before is None else short[:, before]
        if isinstance(joint, Gear):
            twist[:, k] = (first + second) ** 2
        elif isinstance(joint, Prismatic) or joint.pair in driven:
            alpha, base = float(angles.seat[k]), int(angles.base[k])
            own = np.minimum(first, second) if base < 0 else angles.link[:, base]
            twist[:, k] = own * alpha + (own + alpha) * angles.joint[:, k]
    return offset * _ROUNDING, twist * _ROUNDING


def _movements(
    system: Positions, layout: Layout, tubes: Tubes, u: Interval, counted: Array, offset: Array, twist: Array
) -> tuple[tuple[Array, Array], Array, Array, Mask]:
    """Bound how far joints, and the points they lean about, move (N, joints), and links turn (N, links), in the plane.

    And how far guides then travel (N, joints of the mechanism), and whether one assembly is proved.
    For every disturbance p the box has exactly one assembly: as the disturbance grows from 0, ``F_x x' = - F_p p``,
    and ``x'`` over the box is too small to lead out of it.
    """
    count, n = len(tubes.r), system.size
    amounts = np.concatenate([offset, offset, twist], axis=1)
    width, q = n + amounts.shape[1], system.driven(u)
    around = Interval.from_bounds(-amounts, amounts)
    steps = np.concatenate([np.zeros((count, n)), amounts], axis=1).T  # dyads do not depend on the unknowns
    system = system.about(tubes.dyads, Interval.from_bounds(-steps, steps))

    def rates(x: Interval) -> tuple[list[Any], Interval, Mask]:
        """Unknowns with derivatives over a box, and how far its assembly moves."""
        unknowns = variables(_beside(x, around))
        rows = system.equations(unknowns[:n], q, counted, _moved(unknowns[n:]))
        table = jacobian_of(rows, width, (count,))
        return unknowns, *enclosed_solve(table[:, :, :n], -(table[:, :, n:] * around.reshape(count, 1, -1)).sum(-1))

    sound = np.ones(count, dtype=np.bool_)
    unknowns, rate = variables(_beside(tubes.tight, around)), Interval.zeros((count, 0))
    with np.errstate(all="ignore"):
        if n:
            # a disturbance that grows from nothing leads the assembly no further than its rate over the box
            reach = _ROOM * rates(tubes.tight)[1].mag + 1e-12 * system.weights
            unknowns, rate, fine = rates(tubes.tight + Interval.from_bounds(-reach, reach))
            sound = np.asarray(fine & (rate.mag < reach).all(axis=1))
        change = _beside(rate, around)
        at = system.place(unknowns[:n], q, _moved(unknowns[n:]))
        for room in at.rooms:
            sound &= room.value.lo > 0.0

        def size(value: Any) -> Array:
            if not isinstance(value, Dual):
                return np.zeros(count)
            total = Interval.zeros((count,))
            for k in range(width):
                total = total + value.grad[k] * change[:, k]
            return np.asarray(total.mag)

        turned = np.stack([size(angle) for angle in at.angle], axis=1)
        moves, own, way = [], [], np.zeros((count, len(system.mechanism.joints)))
        for place, k in enumerate(layout.joints):
            A, B = (np.hypot(size(p.x), size(p.y)) for p in system.ends(k, at))
            moves.append(np.maximum(A, B) if isinstance(system.mechanism.joints[k], Revolute) else B)
            own.append(A if place in layout.rails else moves[-1])
        for k, joint in enumerate(system.mechanism.joints):
            if isinstance(joint, Prismatic | PinSlot):
                d = system.seen(k, at).d
                way[:, k] = np.hypot(_value(d.x).mag, _value(d.y).mag)
    moved = np.array([moves, own]).reshape(2, len(moves), count).swapaxes(1, 2)
    sound &= np.isfinite(moved).all(axis=(0, 2)) & np.isfinite(turned).all(axis=1) & np.isfinite(way).all(axis=1)
    r, about, way, turned = (np.where(np.isfinite(v), v * _ROUNDING, 0.0) for v in (*moved, way, turned))
    return (r, about), way, turned, sound


def _value(number: Any) -> Interval:
    return number.value if isinstance(number, Dual) else number


def _beside(first: Interval, second: Interval) -> Interval:
    return Interval.from_bounds(
        np.concatenate([first.lo, second.lo], axis=1), np.concatenate([first.hi, second.hi], axis=1)
    )


def _moved(values: list[Any]) -> Moved:
    third = len(values) // 3
    offsets = map(Pair, values[:third], values[third : 2 * third])
    return list(zip(offsets, values[2 * third :]))


def _limits(system: Positions, layout: Layout, angles: _Angles, blocks: Array) -> tuple[Array, Array]:
    """Limits on linear tilts, from outside and from inside.

    With ``n_b`` at the tilt k from ``n_a``, ``|h_b - h_a - k| <= |k| (H^2 + H |k|) / (1 + cos H)``, H the angle of a;
    of a round joint either side may be a.  The sine of an angle t is at least ``t (1 - t^2 / 6)``.
    """
    joints = system.mechanism.joints
    wide, narrow = blocks.copy(), np.empty_like(blocks)
    for block, place in enumerate(layout.block_joint.tolist()):
        k = layout.joints[place]
        a, b = angles.link[:, joints[k].a], angles.link[:, joints[k].b]
        seat, base = float(angles.seat[k]), int(angles.base[k])
        a, b = (a + (seat if base == joints[k].a else 0.0)), (b + (seat if base == joints[k].b else 0.0))
        own = np.minimum(a, b) if layout.block_axis[block] == ROUND else a
        tilt = angles.joint[:, k]
        off = tilt * (own**2 + own * tilt) / (1.0 + np.cos(own))
        wide[:, block] += off
        least = np.minimum(layout.limit_range[0, block], blocks[:, block])
        narrow[:, block] = np.maximum(least * (1.0 - tilt**2 / 5.0) - off * _ROUNDING, 0.0) / _ROUNDING
    return wide, narrow
