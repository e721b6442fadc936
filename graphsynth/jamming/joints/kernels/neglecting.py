"""What the small-tilt closure neglects, bounded over a moving box: as `graphsynth.jamming.joints.exact` derives it.

Largest angles of all links follow from the limits along the shortest path from the frame; what they disturb in each
joint equation moves the assembly, which Krawczyk's test bounds with the disturbances as parameters.
Derivation: ``docs/explanation/coupled-jamming.md``.
"""

from collections import namedtuple

import numpy as np

from graphsynth.core.compilation import kernel
from graphsynth.intervals.kernels.nearest import cos, hypot, sin
from graphsynth.intervals.kernels.rounding import add_up, multiply_both
from graphsynth.jamming.joints.kernels.moving import AX, AY, BX, BY
from graphsynth.kinematics.certify.kernels.enclosing import evaluate, middle, unknown
from graphsynth.kinematics.certify.kernels.proving import (
    CENTRE,
    LEAST,
    RADIUS,
    SPEED,
    TIGHT,
    krawczyk,
    newton_step,
    within,
)
from graphsynth.kinematics.engine.codes import ANGLE, DRIVE_ANGLE

#: Largest angle of a link against the normal of the plane for which the bounds hold (their constants allow for it).
LARGEST = 0.5
#: Allowance for what exact tilts add to the travel of a guide: a share of it, and of the size of the mechanism.
STRETCH, TRAVEL = 1.1, 0.1
#: Allowance for the rounding of sums of a few dozen nonnegative terms.
ROUNDING = 1.0 + 1e-12
TRIES = 4

#: Workspace: largest angles of ``link`` (links,) and ``tilt`` of joints, ``seat`` the largest misalignment; ``length``
#: (links,) between joints of a link, ``way`` of guides; ``lean`` of axes, ``offset``, ``twist`` at joints; ``shift`` of
#: misalignments; ``travel`` of guides in the plane; the disturbed ``box`` (4, links, 3); ``hangs`` (links,): the
#: joint from which the plane pose of a link is measured.
Rest = namedtuple("Rest", "link tilt seat length way lean offset twist shift travel box hangs")


@kernel
def dip(angle):
    """One less the cosine of an angle."""
    half = sin(0.5 * angle)
    return 2.0 * half * half


@kernel
def angles_of(asked, frame, blocks, rest):
    """Write the largest angles; whether all of them are small."""
    joints, links = asked.pairs.shape[0], rest.link.shape[0]
    rest.link[:] = np.inf
    rest.link[frame] = 0.0
    for k in range(joints):
        rest.tilt[k] = hypot(blocks[k, 0], blocks[k, 1]) * ROUNDING if asked.guided[k] else blocks[k, 0]
        rest.seat[k] = max(abs(asked.tilts[k, 0]), abs(asked.tilts[k, 1])) if asked.tilts[k, 4] != 0.0 else 0.0
    for _ in range(links):
        for k in range(joints):
            for side in range(2):
                here, there = asked.pairs[k, side], asked.pairs[k, 1 - side]
                rest.link[there] = min(rest.link[there], (rest.link[here] + rest.tilt[k] + rest.seat[k]) * ROUNDING)
    small = True
    for k in range(joints):
        a, b = rest.link[asked.pairs[k, 0]], rest.link[asked.pairs[k, 1]]
        rest.tilt[k] = min(rest.tilt[k], (a + b + rest.seat[k]) * ROUNDING)
        small = small and a < LARGEST and b < LARGEST and rest.tilt[k] < LARGEST
        rest.lean[k] = sin(max(a, b) + rest.seat[k]) * ROUNDING
    return small


@kernel
def lengths_of(asked, Lc, rest):
    """Write the largest distance between two joints of every link, and how far guides may travel."""
    joints = asked.pairs.shape[0]
    rest.length[:] = 0.0
    for k in range(joints):
        for i in range(2):
            link, p = asked.pairs[k, i], asked.sizes[k]
            x, y = (p[BX], p[BY]) if i else (p[AX], p[AY])
            for other in range(k + 1, joints):
                for j in range(2):
                    if asked.pairs[other, j] == link:
                        q = asked.sizes[other]
                        u, v = (q[BX], q[BY]) if j else (q[AX], q[AY])
                        rest.length[link] = max(rest.length[link], hypot(x - u, y - v) * ROUNDING)
    for k in range(joints):
        rest.way[k] = 0.0
        if asked.guided[k]:
            a = asked.pairs[k, 0]
            far = STRETCH * rest.travel[k] + TRAVEL * Lc
            rest.way[k] = far / cos(rest.link[a] + rest.seat[k]) * ROUNDING
    for k in range(joints):
        if asked.guided[k]:
            rest.length[asked.pairs[k, 0]] += rest.way[k] * ROUNDING


@kernel
def disturb(asked, rest):
    """Write how much the plane closure is disturbed at every joint, and by which twist the angles are amiss."""
    for k in range(asked.pairs.shape[0]):
        a, b = asked.pairs[k, 0], asked.pairs[k, 1]
        first, second = rest.link[a], rest.link[b]
        # the joint from which a link is measured is where it should be
        short = 0.0 if rest.hangs[a] == k else rest.length[a] * dip(first)
        short += 0.0 if rest.hangs[b] == k else rest.length[b] * dip(second)
        rest.offset[k] = (asked.high[k, 2] * rest.lean[k] + short) * ROUNDING
        alpha, side = rest.seat[k], asked.tilts[k, 4]
        base = a if side > 0.0 else b
        own = min(first, second) if side == 0.0 else rest.link[base]
        rest.twist[k] = (own * alpha + (own + alpha) * rest.tilt[k]) * ROUNDING
        own = rest.link[base]
        rest.shift[k] = 0.0
        if side != 0.0:
            bend = alpha * (own * own + own * alpha) / (1.0 + cos(own))
            rest.shift[k] = (alpha * alpha * alpha / 6.0 + bend + 0.5 * own * alpha * alpha) * ROUNDING


@kernel
def disturbed(asked, task, u, half, Lc, rest, room):
    """Prove one assembly for all disturbances in the box; to ``rest.box`` goes where it is, whether it is proved."""
    n, box = task.rows.shape[0], rest.box
    room.spread[:] = 0.0
    evaluate(task, box[CENTRE], u, room)
    if not middle(task, room):
        return False
    # the Newton step along the centre, then what the disturbances add to it
    newton_step(task, box[CENTRE], u, box[SPEED], half, room)
    for r in range(n):
        amount, known = 0.0, False
        for k in range(asked.pairs.shape[0]):
            if asked.pairs[k, 0] == task.rows[r, 1] and asked.pairs[k, 1] == task.rows[r, 2]:
                turns = task.rows[r, 0] in (ANGLE, DRIVE_ANGLE)
                amount, known = max(amount, rest.twist[k] if turns else rest.offset[k]), True
        if not known:
            return False
        # p moves Krawczyk's image by Y p
        for i in range(n):
            room.first[i] = add_up(room.first[i], multiply_both(abs(room.Y[i, r]), amount)[1])
    # a box that holds its image, and all of the plane assembly
    grown = 1.2
    for i in range(n):
        room.image[i] = room.first[i]
    for _ in range(TRIES):
        for i in range(n):
            link, c = unknown(task, i), i % 3
            least = LEAST * (1.0 if c == 2 else Lc)
            box[RADIUS, link, c] = max(grown * room.image[i] + least, box[TIGHT, link, c])
        krawczyk(task, box[CENTRE], u, box[SPEED], half, box[RADIUS], room)
        if within(task, room.image, box[RADIUS]):
            for i in range(n):
                link, c = unknown(task, i), i % 3
                box[TIGHT, link, c] = max(room.image[i], box[TIGHT, link, c])
            return True
        grown = 1.5
    return False


@kernel
def limits_of(asked, blocks, rest, more):
    """Write limits on linear tilts, from outside and from inside, and what is left of the closure of lifts."""
    for loop in range(asked.incidence.shape[0]):
        more.lift[loop] = 0.0
    for k in range(asked.pairs.shape[0]):
        a, b, side = asked.pairs[k, 0], asked.pairs[k, 1], asked.tilts[k, 4]
        first = rest.link[a] + (rest.seat[k] if side > 0.0 else 0.0)
        second = rest.link[b] + (rest.seat[k] if side < 0.0 else 0.0)
        own, tilt = first if asked.guided[k] else min(first, second), rest.tilt[k]
        off = tilt * (own * own + own * tilt) / (1.0 + cos(own)) * ROUNDING
        for part in range(2):
            more.wide[k, part] = (blocks[k, part] + off) * ROUNDING
            least = min(asked.low[k, part], blocks[k, part])
            more.narrow[k, part] = max(least * (1.0 - tilt * tilt / 5.0) - off * ROUNDING, 0.0) / ROUNDING
        more.wide[k, 2] = asked.high[k, 2]
        more.narrow[k, 2] = max(asked.low[k, 2] * (1.0 - 0.5 * rest.lean[k] ** 2) / ROUNDING, 0.0)
        left = asked.high[k, 2] * rest.lean[k] ** 2
        for link in (a, b):
            left += 0.5 * sin(rest.link[link]) * rest.length[link] * dip(rest.link[link])
        for loop in range(asked.incidence.shape[0]):
            more.lift[loop] += abs(asked.incidence[loop, k]) * left * ROUNDING


@kernel
def new_rest(links, asked, frame):
    """Make the workspace, and measure every link from a joint towards the frame."""
    joints = asked.pairs.shape[0]
    hangs, reached = np.full(links, -1, np.int64), np.zeros(links, np.bool_)
    reached[frame] = True
    for _ in range(links):
        for k in range(joints):
            a, b = asked.pairs[k, 0], asked.pairs[k, 1]
            if reached[a] != reached[b]:
                link = b if reached[a] else a
                hangs[link], reached[link] = k, True
    return Rest(
        np.zeros(links),
        np.zeros(joints),
        np.zeros(joints),
        np.zeros(links),
        np.zeros(joints),
        np.zeros(joints),
        np.zeros(joints),
        np.zeros(joints),
        np.zeros(joints),
        np.zeros(joints),
        np.zeros((4, links, 3)),
        hangs,
    )
