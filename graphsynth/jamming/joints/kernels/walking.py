"""Where a mechanism with misaligned axes is free and where it binds, proved box after box along one branch; compiled.

The boxes are those of `graphsynth.kinematics.certify.kernels.marching`; in each the factor is bounded with small tilts,
and where that decides, with exact ones.  A box that decides nothing is halved until it is as short as is asked.
For sharp dimensions, revolute joints, guides and pins in slots with limits, and misaligned revolute joints.
See theory/joints-that-share-a-tilt 4, 5 and theory/jam-arcs 5.
"""

import numpy as np

from graphsynth.core.compilation import kernel
from graphsynth.intervals.kernels.nearest import cos, sin
from graphsynth.intervals.kernels.rounding import add_up, divide_both
from graphsynth.jamming.joints.kernels.bounding import (
    LARGE,
    More,
    choose,
    length_of,
    lower_bound,
    new_sharing,
    upper_bound,
)
from graphsynth.jamming.joints.kernels.moving import AX, AY, RX, RY, difference, line, look, new_seen, over, place_of
from graphsynth.jamming.joints.kernels.neglecting import (
    ROUNDING,
    angles_of,
    disturb,
    disturbed,
    lengths_of,
    limits_of,
    new_rest,
)
from graphsynth.kinematics.certify.kernels.marching import (
    AT,
    DONE,
    GROWTH,
    LIMIT,
    NODES,
    STEP,
    STUCK,
    TESTED,
    UNKNOWN,
    begin,
    keep,
    room_for,
    shortest_step,
    taken,
)
from graphsynth.kinematics.certify.kernels.proving import CENTRE, TIGHT

#: Entry of the state of a walk after those of a march: pieces written.
PIECES = 4
#: Columns of a piece: ends, bounds of the factor with small tilts, 1 free, -1 binds, 0 undecided with exact ones.
LOW, HIGH, LOWER, UPPER, SURE = 0, 1, 2, 3, 4
#: In a proof of freedom a joint may tilt so much more than the tilt found, in its own share and that of the largest.
OWN, SHARE, LITTLE = 1.25, 0.25, 1e-4
#: Smallest and largest unit of length that is chosen, over 1.
FINEST = 2.0**60


@kernel
def known(asked, task):
    """Whether the numbers are some of which the bounds hold, and every joint is there once."""
    joints = asked.pairs.shape[0]
    for k in range(joints):
        low, high, first, last, side = asked.tilts[k]
        if not (low <= high and first <= last and abs(first) < LARGE and abs(last) < LARGE):
            return False
        if not (low > -1.0 and high < 1.0) or (asked.guided[k] and side != 0.0):
            return False
        for c in range(5):
            if not abs(asked.sizes[k, c]) < LARGE:
                return False
        for part in range(3):
            least, limit, most = asked.low[k, part], asked.limits[k, part], asked.high[k, part]
            if not 0.0 <= least <= limit <= most < LARGE or (limit == 0.0 and most > 0.0):
                return False
        for other in range(k):
            if asked.pairs[other, 0] == asked.pairs[k, 0] and asked.pairs[other, 1] == asked.pairs[k, 1]:
                return False
    for r in range(task.rows.shape[0]):
        found = False
        for k in range(joints):
            found |= asked.pairs[k, 0] == task.rows[r, 1] and asked.pairs[k, 1] == task.rows[r, 2]
        if not found:
            return False
    return asked.incidence.shape[0] > 0


@kernel
def set_unit(asked, frame, box, Lc, seen):
    """Choose a middle, that of the joints of the frame, and a unit of length, a power of two."""
    x, y, turn = box[CENTRE, frame]
    c, s, count = cos(turn), sin(turn), 0
    for k in range(asked.pairs.shape[0]):
        for side in range(2):
            if asked.pairs[k, side] == frame:
                p, q = asked.sizes[k, 3 * side], asked.sizes[k, 3 * side + 1]
                seen.unit[0] += c * p - s * q
                seen.unit[1] += s * p + c * q
                count += 1
    seen.unit[0], seen.unit[1], seen.unit[2] = x + seen.unit[0] / max(count, 1), y + seen.unit[1] / max(count, 1), 1.0
    while seen.unit[2] * Lc > 1.0 and seen.unit[2] > 1.0 / FINEST:
        seen.unit[2] *= 0.5
    while seen.unit[2] * Lc < 0.5 and seen.unit[2] < FINEST:
        seen.unit[2] *= 2.0


@kernel
def travel(asked, box, h, k, seen):
    """Bound how far a slider is from the point of its guide."""
    p, own = asked.sizes[k], np.empty((2, 4))
    place_of(box, box[TIGHT], seen.turn, asked.pairs[k, 0], p[AX], p[AY], seen.unit, 0.0, own)
    x = over(difference(line(seen.at[k, RX]), line(own[0])), h)
    y = over(difference(line(seen.at[k, RY]), line(own[1])), h)
    return divide_both(length_of(x, y), seen.unit[2])[1]


@kernel
def exactly(asked, task, u, h, Lc, blocks, work, room):
    """Look at a box with all that exact tilts may change while tilts are below ``blocks``; whether that is proved."""
    seen, _, rest, more, none = work
    if not angles_of(asked, task.frame, blocks, rest):
        return False
    keep(room.box, rest.box)
    look(asked, rest.box, rest.box[TIGHT], h, none, none, seen)
    for k in range(asked.pairs.shape[0]):
        rest.travel[k] = travel(asked, rest.box, h, k, seen) if asked.guided[k] else 0.0
    lengths_of(asked, Lc, rest)
    disturb(asked, rest)
    if not disturbed(asked, task, u, h, Lc, rest, room):
        return False
    look(asked, rest.box, rest.box[TIGHT], h, none, none, seen)
    for k in range(asked.pairs.shape[0]):
        if asked.guided[k]:
            far = add_up(travel(asked, rest.box, h, k, seen), rest.offset[k]) * ROUNDING
            if not far / cos(rest.link[asked.pairs[k, 0]] + rest.seat[k]) * ROUNDING <= rest.way[k]:
                return False
    look(asked, rest.box, rest.box[TIGHT], h, rest.offset, rest.shift, seen)
    limits_of(asked, blocks, rest, more)
    return True


@kernel
def judge(asked, task, u, h, Lc, work, room, piece):
    """Write bounds of the factor over the box of the room around u, and what is proved with exact tilts."""
    seen, sharing, _, more, none = work
    joints = asked.pairs.shape[0]
    piece[LOWER], piece[UPPER], piece[SURE] = 0.0, np.inf, 0.0
    look(asked, room.box, room.box[TIGHT], h, none, none, seen)
    found = choose(asked, seen, h, sharing)
    for k in range(joints):
        for part in range(3):
            more.wide[k, part], more.narrow[k, part] = asked.high[k, part], asked.low[k, part]
    more.lift[:] = 0.0
    piece[LOWER] = lower_bound(asked, seen, h, sharing.y, more)
    if found:
        piece[UPPER] = upper_bound(asked, seen, h, sharing, more)
    blocks = asked.high.copy()
    if piece[LOWER] > 1.0:
        if exactly(asked, task, u, h, Lc, blocks, work, room) and lower_bound(asked, seen, h, sharing.y, more) > 1.0:
            piece[SURE] = -1.0
        return
    for wide in range(2):
        if not piece[UPPER] < 1.0:
            return
        assume(asked, sharing, piece[UPPER] if wide else 0.0, blocks)
        if exactly(asked, task, u, h, Lc, blocks, work, room) and upper_bound(asked, seen, h, sharing, more) < 1.0:
            piece[SURE] = 1.0
            return


@kernel
def assume(asked, sharing, factor, blocks):
    """Write tilts that a proof of freedom will keep below, and below their limits at this factor."""
    most = 0.0
    for k in range(blocks.shape[0]):
        first, second = abs(sharing.q[k, 0, 0]), abs(sharing.q[k, 1, 0])
        blocks[k, 0], blocks[k, 1] = (first, second) if asked.guided[k] else (first + second, 0.0)
        most = max(most, blocks[k, 0], blocks[k, 1])
    for k in range(blocks.shape[0]):
        for part in range(2):
            own = OWN * blocks[k, part] + SHARE * most + LITTLE
            blocks[k, part] = min(asked.high[k, part], max(own, OWN * factor * asked.low[k, part]))


@kernel
def walk(task, asked, goal, Lc, box, state, limit, widths, pieces):
    """Prove piece after piece until the driver is at its goal, as `march` does; returns why it stops.

    ``box`` and ``state`` are those of `march`, with one entry more; ``widths`` (2,): below the first no piece is cut,
    and none is wider than the second; to ``pieces`` (rows, 5) go as many as there is room for.
    """
    room, joints, loops = room_for(task.rows.shape[0], box), asked.pairs.shape[0], asked.incidence.shape[0]
    if not known(asked, task):
        return UNKNOWN
    code = begin(task, box, state, Lc, room)
    if code != DONE:
        return code
    # room for all that is bounded in a box
    more = More(np.zeros(loops), np.zeros((joints, 3)), np.zeros((joints, 3)))
    seen = new_seen(box.shape[1], joints, loops)
    work = seen, new_sharing(joints, loops), new_rest(box.shape[1], asked, task.frame), more, np.zeros(joints)
    set_unit(asked, task.frame, box, Lc, seen)
    piece, shortest = np.zeros(5), shortest_step(task, Lc)
    # from node to node: longer steps while boxes are decided, shorter ones where not
    while state[AT] != goal:
        count = int(state[PIECES])
        if state[TESTED] >= limit or count == pieces.shape[0]:
            return LIMIT
        u, step = state[AT], max(-widths[1], min(widths[1], state[STEP]))
        end = u + step
        if (end - goal) * step >= 0.0:
            end = goal
        state[TESTED] += 1.0
        if not taken(task, box, u, end, Lc, room):
            if abs(step) < shortest:
                return STUCK
            state[STEP] = 0.5 * (end - u)
            continue
        # the branch is proved from node to node; now what its joints do there
        middle = 0.5 * (u + end)
        h = max(add_up(max(u, end), -middle), add_up(middle, -min(u, end)))
        judge(asked, task, middle, h, Lc, work, room, piece)
        if piece[SURE] == 0.0 and abs(end - u) > widths[0]:
            state[STEP] = 0.5 * (end - u)
            continue
        piece[LOW], piece[HIGH] = min(u, end), max(u, end)
        for c in range(5):
            pieces[count, c] = piece[c]
        keep(room.node, box)
        state[AT], state[STEP] = end, step if piece[SURE] == 0.0 else GROWTH * (end - u)
        state[NODES] += 1.0
        state[PIECES] += 1.0
    return DONE
