"""Joint equations and their gradients, enclosed over all poses of a box.

Known are revolute and prismatic joints and pins in slots.  The points of joints are exact numbers; directions of
slides are enclosed, with the rounding of their sines and cosines.
"""

import math
from collections import namedtuple

from graphsynth.core.compilation import kernel
from graphsynth.intervals.kernels import trigonometry
from graphsynth.intervals.kernels.krawczyk import invert
from graphsynth.intervals.kernels.pairs import got, minus, plus, put, thin, times
from graphsynth.intervals.kernels.rounding import add_down, add_up, down, up
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
    SIGN,
    SLOT,
    TX,
    TY,
    H,
)

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
def middle(task, room):
    """Write the Jacobian at the middle of the enclosed gradients, and its inverse; whether there is one."""
    room.J[:] = 0.0
    for r in range(task.rows.shape[0]):
        for c in range(6):
            _, j = column(task, r, c)
            if j >= 0:
                room.J[r, j] += 0.5 * (room.g[r, c, 0] + room.g[r, c, 1])
    return invert(room.J, room.Y)
