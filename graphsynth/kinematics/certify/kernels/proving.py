"""One regular pose for every input of a moving box: Krawczyk's test of `graphsynth.intervals.moving`, compiled.

It is made on all joint equations (no link is eliminated) with the drivers held, in intervals.  A box is an array
(4, links, 3): centre, its velocity by the input, radius, and the smaller radius within which the solution is.
"""

import numpy as np

from graphsynth.core.compilation import kernel
from graphsynth.intervals.kernels.pairs import got, minus, plus, put, size, thin, times
from graphsynth.intervals.kernels.rounding import add_up, multiply_both
from graphsynth.kinematics.certify.kernels.enclosing import column, evaluate, middle, rate, unknown

#: Rows of a box.
CENTRE, SPEED, RADIUS, TIGHT = 0, 1, 2, 3
NEWTON, ROUNDS = 10, 3
#: Least radius of a box, in radians or characteristic lengths.
LEAST = 1e-9


@kernel
def settle(task, u, x, v, room):
    """Newton steps, in floating point, to the assembly at input u; the inverse Jacobian and the velocity there."""
    n = task.rows.shape[0]
    room.spread[:] = 0.0
    for count in range(NEWTON):
        evaluate(task, x, u, room)
        if not middle(task, room):
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
def reach(box, centre, u):
    """Where the centre of a box, of link and coordinate, is at input u: enclosed."""
    return plus(thin(box[CENTRE]), times(thin(box[SPEED]), minus(u, thin(centre))))


@kernel
def apart(task, inner, at, outer, centre, u, gap):
    """Write how far the solution in one box can be from the centre of another one at input u."""
    for i in range(task.rows.shape[0]):
        link, c = unknown(task, i), i % 3
        there, here = reach(inner[:, link, c], at, thin(u)), reach(outer[:, link, c], centre, thin(u))
        gap[i] = add_up(size(minus(there, here)), inner[TIGHT, link, c])


@kernel
def within(task, gap, radius):
    """Whether distances are less than the radii of a box."""
    inside = True
    for i in range(task.rows.shape[0]):
        inside = inside and gap[i] < radius[unknown(task, i), i % 3]
    return inside


@kernel
def predict(last, centre, u, box):
    """Begin a box where another one is at input u."""
    for link in range(last.shape[1]):
        for c in range(3):
            box[CENTRE, link, c] = last[CENTRE, link, c] + last[SPEED, link, c] * (u - centre)
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
