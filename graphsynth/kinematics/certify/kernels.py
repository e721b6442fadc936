"""One branch of a mechanism over a range of its driver, proved by moving boxes; compiled, for the page too.

The test is that of `graphsynth.intervals.moving`, on all joint equations (no link is eliminated) with the drivers held,
in intervals.  Boxes follow one another from a given pose on, with a node, a small box at one input, at both ends of
each.  A box is taken if it holds, at the input of a node, the whole enclosure of the solution in that node: by
uniqueness it is the solution in the box, so all boxes together hold one continuous branch of regular poses.

Known are revolute and prismatic joints and pins in slots.  The points of joints are exact numbers; directions of
slides are enclosed, with the rounding of their sines and cosines.  A box is an array (4, links, 3): centre, its
velocity by the input, radius, and the smaller radius within which the solution is.
"""

import math
from collections import namedtuple

import numpy as np

from graphsynth.core.compilation import kernel
from graphsynth.intervals.kernels import arithmetic as ia, trigonometry
from graphsynth.intervals.kernels.krawczyk import invert
from graphsynth.intervals.kernels.rounding import add_down, add_up, down, multiply_both, up
from graphsynth.kinematics.engine.codes import (
    ANGLE,
    DRIVE_ANGLE,
    DRIVE_SLIDE,
    LINE,
    PAX,
    PAY,
    PBX,
    PBY,
    RX,
    RY,
    SIGN,
    SLOT,
    TX,
    TY,
    H,
)

#: Rows of a box.
CENTRE, SPEED, RADIUS, TIGHT = 0, 1, 2, 3
#: Entries of the state of a march: input that is reached, next step, nodes proved, boxes tested.
AT, STEP, NODES, TESTED = 0, 1, 2, 3
#: Why `march` returns: the goal is reached; the limit of tests; no box, however short, is proved; no such equations.
DONE, LIMIT, STUCK, UNKNOWN = 0, 1, 2, 3
#: Shortest step, in radians or characteristic lengths.
SHORTEST = 1e-6
NEWTON, ROUNDS, GROWTH = 10, 3, 1.3
#: Least radius of a box, in radians or characteristic lengths.
LEAST = 1e-9
TAU = (math.tau, math.nextafter(math.tau, 7.0))
#: Rounding of a sine or cosine that is the nearest number.
NEAREST = 2.0**-53

#: What is asked: equations, their numbers, frame, its pose, whole turns in the equations of angles, drivers.
Task = namedtuple("Task", "rows p frame turns inputs driver")
#: Workspace: spread (links, 3), links over it (links, 5, 2): x, y, angle, cosine, sine; equations (n, 2) and their
#: gradients (n, 6, 2); Jacobian and its inverse, 1 - Y J (n, n, 2), sizes of Newton step and image, what a box must
#: hold (n,); a box and a node on trial.
Room = namedtuple("Room", "spread seen f g J Y rest first image gap box node")


@kernel
def plus(a, b):
    """Sum of two intervals."""
    return ia.add(a[0], a[1], b[0], b[1])


@kernel
def minus(a, b):
    """Difference of two intervals."""
    return ia.subtract(a[0], a[1], b[0], b[1])


@kernel
def times(a, b):
    """Product of two intervals."""
    return ia.multiply(a[0], a[1], b[0], b[1])


@kernel
def thin(x):
    """One number as an interval."""
    return x, x


@kernel
def around(x, radius):
    """Interval around a number."""
    return add_down(x, -radius), add_up(x, radius)


@kernel
def size(a):
    """Largest absolute value in an interval; infinite if it is empty or no interval."""
    return max(-a[0], a[1]) if a[0] <= a[1] else np.inf


@kernel
def put(a, place):
    """Write an interval."""
    place[0], place[1] = a


@kernel
def got(place):
    """Read an interval."""
    return place[0], place[1]


@kernel
def turned(link, x, y):
    """Vector of a link, in the world."""
    c, s = got(link[3]), got(link[4])
    return minus(times(c, x), times(s, y)), plus(times(s, x), times(c, y))


@kernel
def cross(ax, ay, bx, by):
    """Return ax by - ay bx."""
    return minus(times(ax, by), times(ay, bx))


@kernel
def look(x, spread, seen):
    """Enclose all links of poses ``x`` with a spread around them."""
    for link in range(x.shape[0]):
        for c in range(3):
            seen[link, c, 0], seen[link, c, 1] = (
                add_down(x[link, c], -spread[link, c]),
                add_up(x[link, c], spread[link, c]),
            )
        put(trigonometry.cos(seen[link, 2, 0], seen[link, 2, 1]), seen[link, 3])
        put(trigonometry.sin(seen[link, 2, 0], seen[link, 2, 1]), seen[link, 4])


@kernel
def angle_row(kind, p, a, b, q, turns, g):
    """Value of an equation of angles; its gradient goes to g."""
    put(thin(-1.0), g[2])
    put(thin(1.0), g[5])
    h = (down(p[H], False), up(p[H], False)) if kind == ANGLE else thin(p[SIGN] * q)
    return minus(minus(minus(got(b[2]), got(a[2])), h), times(thin(turns), TAU))


@kernel
def line_row(kind, p, a, b, u, w, d, q, g):
    """Value of an equation along or across a line of link a; its gradient goes to g."""
    t = turned(
        a, (add_down(p[TX], -NEAREST), add_up(p[TX], NEAREST)), (add_down(p[TY], -NEAREST), add_up(p[TY], NEAREST))
    )
    nx, ny = (-t[1][1], -t[1][0]), t[0]
    along, across = plus(times(t[0], d[0]), times(t[1], d[1])), plus(times(nx, d[0]), times(ny, d[1]))
    mx, my = (nx, ny) if kind == LINE else t
    turning = (-along[1], -along[0]) if kind == LINE else across
    put((-mx[1], -mx[0]), g[0])
    put((-my[1], -my[0]), g[1])
    put(minus(turning, cross(u[0], u[1], mx, my)), g[2])
    put(mx, g[3])
    put(my, g[4])
    put(cross(w[0], w[1], mx, my), g[5])
    return minus(across, thin(p[H])) if kind == LINE else minus(along, thin(p[SIGN] * q))


@kernel
def row(kind, p, a, b, q, turns, g):
    """Enclose one equation, and its gradient by (x, y, angle) of both links, as `engine.kernels.rows.row` has them."""
    g[:] = 0.0
    if kind in (ANGLE, DRIVE_ANGLE):
        return angle_row(kind, p, a, b, q, turns, g)
    u, w = turned(a, thin(p[PAX]), thin(p[PAY])), turned(b, thin(p[PBX]), thin(p[PBY]))
    d = minus(plus(got(b[0]), w[0]), plus(got(a[0]), u[0])), minus(plus(got(b[1]), w[1]), plus(got(a[1]), u[1]))
    if kind in (LINE, DRIVE_SLIDE):
        return line_row(kind, p, a, b, u, w, d, q, g)
    c = 0 if kind == RX else 1
    put(thin(-1.0), g[c])
    put(thin(1.0), g[3 + c])
    put(u[1] if kind == RX else (-u[0][1], -u[0][0]), g[2])
    put((-w[1][1], -w[1][0]) if kind == RX else w[0], g[5])
    return d[c]


@kernel
def evaluate(task, x, u, room):
    """Enclose all equations and gradients at input u over the poses x with the spread of the room."""
    look(x, room.spread, room.seen)
    for r in range(task.rows.shape[0]):
        kind, a, b = task.rows[r, 0], task.rows[r, 1], task.rows[r, 2]
        slot = int(task.p[r, SLOT])
        q = 0.0
        if kind in (DRIVE_ANGLE, DRIVE_SLIDE):
            q = u if slot == task.driver else task.inputs[slot]
        put(row(kind, task.p[r], room.seen[a], room.seen[b], q, task.turns[r], room.g[r]), room.f[r])


@kernel
def rate(task, r):
    """Return the derivative of an equation by the input."""
    drives = task.rows[r, 0] in (DRIVE_ANGLE, DRIVE_SLIDE) and int(task.p[r, SLOT]) == task.driver
    return -task.p[r, SIGN] if drives else 0.0


@kernel
def column(task, r, c):
    """Link and unknown of entry c of the gradient of an equation; a negative unknown is of the frame."""
    link = task.rows[r, 1 + c // 3]
    return link, -1 if link == task.frame else 3 * (link - (link > task.frame)) + c % 3


@kernel
def unknown(task, j):
    """Return the link of an unknown."""
    return j // 3 + (j // 3 >= task.frame)


@kernel
def settle(task, u, x, v, room):
    """Newton steps, in floating point, to the assembly at input u; the inverse Jacobian and the velocity there."""
    n = task.rows.shape[0]
    room.spread[:] = 0.0
    for count in range(NEWTON):
        evaluate(task, x, u, room)
        room.J[:] = 0.0
        for r in range(n):
            for c in range(6):
                _, j = column(task, r, c)
                if j >= 0:
                    room.J[r, j] += 0.5 * (room.g[r, c, 0] + room.g[r, c, 1])
        if not invert(room.J, room.Y):
            return False
        far = 0.0
        for i in range(n):
            step, speed = 0.0, 0.0
            for r in range(n):
                step += room.Y[i, r] * 0.5 * (room.f[r, 0] + room.f[r, 1])
                speed -= room.Y[i, r] * rate(task, r)
            link = unknown(task, i)
            far = max(far, abs(step) - 1e-14 * abs(x[link, i % 3]))
            x[link, i % 3] -= step
            v[link, i % 3] = speed
        if not far < np.inf:
            return False
        if far <= 1e-15 and count > 0:
            break
    evaluate(task, x, u, room)
    return True


@kernel
def newton_step(task, x, u, v, half, room):
    """Bound Y f along the moving centre, over all inputs within ``half`` of u."""
    n = task.rows.shape[0]
    values = room.f.copy()
    for link in range(x.shape[0]):
        for c in range(3):
            room.spread[link, c] = multiply_both(abs(v[link, c]), half)[1]
    evaluate(task, x, u, room)
    for r in range(n):
        along = thin(rate(task, r))
        for c in range(6):
            link, j = column(task, r, c)
            if j >= 0:
                along = plus(along, times(got(room.g[r, c]), thin(v[link, c % 3])))
        put(plus(got(values[r]), times(along, (-half, half))), values[r])
    for i in range(n):
        total = thin(0.0)
        for r in range(n):
            total = plus(total, times(thin(room.Y[i, r]), got(values[r])))
        room.first[i] = size(total)


@kernel
def krawczyk(task, x, u, v, half, radius, room):
    """Bound the image of a moving box around its centre, for every input; writes ``room.image``."""
    n = task.rows.shape[0]
    for link in range(x.shape[0]):
        for c in range(3):
            room.spread[link, c] = add_up(multiply_both(abs(v[link, c]), half)[1], radius[link, c])
    evaluate(task, x, u, room)
    room.rest[:] = 0.0
    for i in range(n):
        put(thin(1.0), room.rest[i, i])
    for r in range(n):
        for c in range(6):
            _, j = column(task, r, c)
            if j < 0:
                continue
            entry = got(room.g[r, c])
            if entry[0] == 0.0 and entry[1] == 0.0:
                continue
            for i in range(n):
                put(minus(got(room.rest[i, j]), times(thin(room.Y[i, r]), entry)), room.rest[i, j])
    for i in range(n):
        total = room.first[i]
        for j in range(n):
            total = add_up(total, multiply_both(size(got(room.rest[i, j])), radius[unknown(task, j), j % 3])[1])
        room.image[i] = total


@kernel
def reach(box, middle, u):
    """Where the centre of a box, of link and coordinate, is at input u: enclosed."""
    return plus(thin(box[CENTRE]), times(thin(box[SPEED]), minus(u, thin(middle))))


@kernel
def apart(task, inner, at, outer, middle, u, gap):
    """Write how far the solution in one box can be from the centre of another one at input u."""
    for i in range(task.rows.shape[0]):
        link, c = unknown(task, i), i % 3
        there, here = reach(inner[:, link, c], at, thin(u)), reach(outer[:, link, c], middle, thin(u))
        gap[i] = add_up(size(minus(there, here)), inner[TIGHT, link, c])


@kernel
def within(task, gap, radius):
    """Whether distances are less than the radii of a box."""
    inside = True
    for i in range(task.rows.shape[0]):
        inside = inside and gap[i] < radius[unknown(task, i), i % 3]
    return inside


@kernel
def predict(last, middle, u, box):
    """Begin a box where another one is at input u."""
    for link in range(last.shape[1]):
        for c in range(3):
            box[CENTRE, link, c] = last[CENTRE, link, c] + last[SPEED, link, c] * (u - middle)
    box[SPEED:] = 0.0


@kernel
def prove(task, box, u, half, Lc, room):
    """Prove one solution in a settled box for all inputs within ``half`` of u; it must hold ``room.gap`` as well."""
    newton_step(task, box[CENTRE], u, box[SPEED], half, room)
    n, grown = task.rows.shape[0], 2.0
    for i in range(n):
        room.image[i] = room.first[i]
    for _ in range(ROUNDS):
        widest = LEAST
        for i in range(n):
            widest = max(widest, 0.01 * room.image[i] / (1.0 if i % 3 == 2 else Lc))
        for i in range(n):
            around = grown * room.image[i] + widest * (1.0 if i % 3 == 2 else Lc)
            box[RADIUS, unknown(task, i), i % 3] = max(around, 1.2 * room.gap[i])
        krawczyk(task, box[CENTRE], u, box[SPEED], half, box[RADIUS], room)
        if within(task, room.image, box[RADIUS]):
            for i in range(n):
                box[TIGHT, unknown(task, i), i % 3] = room.image[i]
            return True
        grown = 1.6
    return False


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
