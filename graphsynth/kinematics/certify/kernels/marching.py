"""One branch of a mechanism over a range of its driver, proved by moving boxes; compiled, for the page too.

Boxes follow one another from a given pose on, with a node, a small box at one input, at both ends of each.  A box is
taken if it holds, at the input of a node, the whole enclosure of the solution in that node: by uniqueness it is the
solution in the box, so all boxes together hold one continuous branch of regular poses.
"""

import math

import numpy as np

from graphsynth.core.compilation import kernel
from graphsynth.intervals.kernels.pairs import around, minus, plus, size, thin, times
from graphsynth.intervals.kernels.rounding import add_up
from graphsynth.kinematics.certify.kernels.enclosing import NEAREST, TAU, Room, Task
from graphsynth.kinematics.certify.kernels.proving import (
    CENTRE,
    RADIUS,
    SPEED,
    TIGHT,
    apart,
    predict,
    prove,
    reach,
    settle,
    within,
)
from graphsynth.kinematics.engine.codes import ANGLE, DRIVE_ANGLE, DRIVE_SLIDE, LINE, RX, RY, SIGN, SLOT, H

#: Entries of the state of a march: input that is reached, next step, nodes proved, boxes tested.
AT, STEP, NODES, TESTED = 0, 1, 2, 3
#: Why `march` returns: the goal is reached; the limit of tests; no box, however short, is proved; no such equations.
DONE, LIMIT, STUCK, UNKNOWN = 0, 1, 2, 3
#: Shortest step, in radians or characteristic lengths.
SHORTEST, GROWTH = 1e-6, 1.3


@kernel
def rounding(u):
    """Half width of the inputs at a node: what rounds to it, after a few operations."""
    return NEAREST * max(4.0, 4.0 * abs(u))


@kernel
def node(task, u, Lc, room):
    """Prove the box ``room.node`` at one input, and at what rounds to it."""
    if not settle(task, u, room.node[CENTRE], room.node[SPEED], room):
        return False
    return prove(task, room.node, u, rounding(u), Lc, room)


@kernel
def taken(task, last, u, end, Lc, room):
    """Prove a box from the node at input u to ``end``, and the node there, which is written to ``room.node``."""
    box, middle = room.box, 0.5 * (u + end)
    half = max(add_up(max(u, end), -middle), add_up(middle, -min(u, end)))
    predict(last, u, middle, box)
    if not settle(task, middle, box[CENTRE], box[SPEED], room):
        return False
    apart(task, last, u, box, middle, u, room.gap)
    if not prove(task, box, middle, half, Lc, room) or not within(task, room.gap, box[RADIUS]):
        return False
    predict(box, middle, end, room.node)
    room.gap[:] = 0.0
    if not node(task, end, Lc, room):
        return False
    apart(task, room.node, end, box, middle, end, room.gap)
    return within(task, room.gap, box[RADIUS])


@kernel
def count_turns(task, x):
    """Write the whole turns that poses have in the equations of angles; whether all equations are known."""
    for r in range(task.rows.shape[0]):
        kind, p = task.rows[r, 0], task.p[r]
        if kind not in (RX, RY, LINE, ANGLE, DRIVE_ANGLE, DRIVE_SLIDE):
            return False
        if kind in (ANGLE, DRIVE_ANGLE):
            h = p[H] if kind == ANGLE else p[SIGN] * task.inputs[int(p[SLOT])]
            task.turns[r] = np.floor((x[task.rows[r, 2], 2] - x[task.rows[r, 1], 2] - h) / math.tau + 0.5)
    return task.rows.shape[0] == 3 * (x.shape[0] - 1)


@kernel
def keep(node, box):
    """Copy a node."""
    for k in range(4):
        for link in range(node.shape[1]):
            for c in range(3):
                box[k, link, c] = node[k, link, c]


@kernel
def room_for(n, box):
    """Make room for n equations."""
    links = box.shape[1]
    J, Y, rest = np.zeros((n, n)), np.zeros((n, n)), np.zeros((n, n, 2))
    spread, seen, f, g = np.zeros((links, 3)), np.zeros((links, 5, 2)), np.zeros((n, 2)), np.zeros((n, 6, 2))
    return Room(spread, seen, f, g, J, Y, rest, np.zeros(n), np.zeros(n), np.zeros(n), box.copy(), box.copy())


@kernel
def begin(task, box, state, Lc, room):
    """Prove the first node, beside the given poses, unless there is one; `DONE`, or why not."""
    if state[NODES] > 0.0:
        return DONE
    if not count_turns(task, box[CENTRE]):
        return UNKNOWN
    if not node(task, state[AT], Lc, room):
        return STUCK
    apart(task, box, state[AT], room.node, state[AT], state[AT], room.gap)
    if not within(task, room.gap, room.node[RADIUS]):
        return STUCK
    keep(room.node, box)
    state[NODES] = 1.0
    return DONE


@kernel
def shortest_step(task, Lc):
    """Return the shortest step of the driver; those of a slide are lengths."""
    for r in range(task.rows.shape[0]):
        if task.rows[r, 0] == DRIVE_SLIDE and int(task.p[r, SLOT]) == task.driver:
            return SHORTEST * Lc
    return SHORTEST


@kernel
def march(rows, p, frame, inputs, driver, goal, Lc, turns, box, state, limit):
    """Prove box after box until the driver is at its goal.

    ``rows``, ``p``: all equations of joints and drivers (`engine.program.equations`); ``inputs``: coordinates of the
    drivers, of which one moves.  At first, nothing proved, ``box`` holds the given poses as its centres, and zeros;
    ``turns`` (rows,) is written then.  Afterwards ``box`` is the node that is reached: the march can go on, or from a
    node that was kept the other way.  ``limit``: tests in all; with 0 only the first node is proved.
    """
    task = Task(rows, p, frame, turns, inputs, driver)
    room = room_for(rows.shape[0], box)
    code = begin(task, box, state, Lc, room)
    if code != DONE:
        return code
    shortest = shortest_step(task, Lc)
    # from node to node: longer steps while boxes are proved, shorter ones where not
    while state[AT] != goal:
        if state[TESTED] >= limit:
            return LIMIT
        step = state[STEP]
        end = state[AT] + step
        if (end - goal) * step >= 0.0:
            end = goal
        state[TESTED] += 1.0
        if taken(task, box, state[AT], end, Lc, room):
            keep(room.node, box)
            state[AT], state[STEP] = end, GROWTH * step
            state[NODES] += 1.0
        elif abs(step) < shortest:
            return STUCK
        else:
            state[STEP] = 0.5 * (end - state[AT])
    return DONE


@kernel
def closes(rows, p, frame, driver, first, start, last, end, rounds):
    """Whether a branch is, after whole turns of the driver, where it began: from its nodes at these inputs."""
    star = plus(thin(start), times(thin(float(rounds)), TAU))
    held = around(end, rounding(end))
    if not (held[0] <= star[0] and star[1] <= held[1]):
        return False
    made = np.zeros(first.shape[1])
    for link in range(first.shape[1]):
        made[link] = np.floor((last[CENTRE, link, 2] - first[CENTRE, link, 2]) / math.tau + 0.5)
        for c in range(3 if link != frame else 0):
            back = minus(reach(last[:, link, c], end, star), thin(first[CENTRE, link, c]))
            if c == 2:
                back = minus(back, times(thin(made[link]), TAU))
            if not add_up(size(back), last[TIGHT, link, c]) < first[RADIUS, link, c]:
                return False
    # with its turns taken off, the last pose solves the equations of the first input
    for r in range(rows.shape[0]):
        turn = made[rows[r, 2]] - made[rows[r, 1]]
        own = rows[r, 0] == DRIVE_ANGLE and int(p[r, SLOT]) == driver
        if rows[r, 0] in (ANGLE, DRIVE_ANGLE) and turn != (p[r, SIGN] * rounds if own else 0.0):
            return False
    return True
