"""Numbers that change with the input: places of joints and sums round loops over a moving box, in intervals.

A line is ``value + slope t`` for t within ``h`` of zero, with intervals for both: for every t there are numbers in
them that give the quantity exactly.  What is of second order, and how far the assembly can be from the moving centre
of its box (`graphsynth.kinematics.certify.kernels.proving`), is in the value.  See theory/joints-that-share-a-tilt 7.
"""

from collections import namedtuple

import numpy as np

from graphsynth.core.compilation import kernel
from graphsynth.intervals.kernels import trigonometry
from graphsynth.intervals.kernels.pairs import around, minus, plus, size, thin, times
from graphsynth.intervals.kernels.rounding import multiply_both
from graphsynth.kinematics.certify.kernels.proving import CENTRE, SPEED

#: What is asked: as `sharing.Seats`, with loops (loops, joints) and bounds ``low`` and ``high`` of the limits.
#: ``tilts`` (joints, 5): bounds of the misalignment and of its direction in the frame of a link; that link: 1 for a,
#: -1 for b, 0 for none.
Asked = namedtuple("Asked", "pairs guided sizes limits low high tilts incidence")

#: Quantities of a joint: where it is, from a unit of length and a middle; direction of its guide; misalignment.
RX, RY, EX, EY, DX, DY = 0, 1, 2, 3, 4, 5
#: Columns of the numbers of a joint, as in the planning kernels.
AX, AY, A_ANGLE, BX, BY = 0, 1, 2, 3, 4

#: Workspace: ``turn`` (links, 2, 4) directions of links; ``at`` (joints, 6, 4) the quantities above; ``unit`` (3,):
#: middle, and the inverse of the unit of length, a power of two; ``sums`` (3 loops, 4) what a closure comes to.
Seen = namedtuple("Seen", "turn at unit sums")


@kernel
def line(place):
    """Read a line."""
    return (place[0], place[1]), (place[2], place[3])


@kernel
def write(a, place):
    """Write a line."""
    place[0], place[1] = a[0]
    place[2], place[3] = a[1]


@kernel
def sum_of(a, b):
    """Sum of two lines."""
    return plus(a[0], b[0]), plus(a[1], b[1])


@kernel
def difference(a, b):
    """Difference of two lines."""
    return minus(a[0], b[0]), minus(a[1], b[1])


@kernel
def product(a, b, h):
    """Product of two lines; the square of t lies between 0 and that of h."""
    square = times(times(a[1], b[1]), (0.0, multiply_both(h, h)[1]))
    return plus(times(a[0], b[0]), square), plus(times(a[0], b[1]), times(a[1], b[0]))


@kernel
def scaled(a, factor):
    """Line times an interval."""
    return times(a[0], factor), times(a[1], factor)


@kernel
def fixed(a):
    """Interval as a line."""
    return a, thin(0.0)


@kernel
def widened(a, by):
    """Line with a margin to either side."""
    return plus(a[0], (-by, by)), a[1]


@kernel
def over(a, h):
    """All values of a line."""
    return plus(a[0], times(a[1], (-h, h)))


@kernel
def at_end(a, h):
    """Value of a line at one end, of t = h or -h."""
    return plus(a[0], times(a[1], thin(h)))


@kernel
def turning(angle, speed, tight, h, out):
    """Write cosine and sine of an angle that turns, by their series up to the second order."""
    c, s = trigonometry.cos(angle, angle), trigonometry.sin(angle, angle)
    far = size(plus((-tight, tight), times(thin(speed), (-h, h))))
    rest = times((-0.5, 0.5), (0.0, multiply_both(far, far)[1]))
    wobble = (-tight, tight)
    write((plus(minus(c, times(s, wobble)), rest), times((-s[1], -s[0]), thin(speed))), out[0])
    write((plus(plus(s, times(c, wobble)), rest), times(c, thin(speed))), out[1])


@kernel
def rotated(turn, x, y):
    """Vector of a link, of intervals, in the world."""
    c, s = line(turn[0]), line(turn[1])
    return difference(scaled(c, x), scaled(s, y)), sum_of(scaled(s, x), scaled(c, y))


@kernel
def place_of(box, tight, turn, link, x, y, unit, offset, out):
    """Write where a point of a link is, in units, up to an offset."""
    way = rotated(turn[link], thin(x), thin(y))
    for c in range(2):
        begin = around(box[CENTRE, link, c], tight[link, c]), thin(box[SPEED, link, c])
        here = widened(sum_of(begin, way[c]), offset)
        write(scaled((minus(here[0], thin(unit[c])), here[1]), thin(unit[2])), out[c])


@kernel
def narrower(a, b, out):
    """Write the one of two lines of the same quantity that is known better."""
    write(line(a) if a[1] - a[0] <= b[1] - b[0] else line(b), out)


@kernel
def look(asked, box, tight, h, offset, shift, seen):
    """Enclose all joints of a moving box within ``tight`` (links, 3) of its centre.

    Places are up to ``offset`` (joints,) beside, misalignments up to ``shift`` (joints,).
    """
    for link in range(box.shape[1]):
        turning(box[CENTRE, link, 2], box[SPEED, link, 2], tight[link, 2], h, seen.turn[link])
    own, other = np.empty((2, 4)), np.empty((2, 4))
    for k in range(asked.pairs.shape[0]):
        a, b, p, at = asked.pairs[k, 0], asked.pairs[k, 1], asked.sizes[k], seen.at[k]
        place_of(box, tight, seen.turn, b, p[BX], p[BY], seen.unit, offset[k], other)
        if asked.guided[k]:
            along = trigonometry.cos(p[A_ANGLE], p[A_ANGLE]), trigonometry.sin(p[A_ANGLE], p[A_ANGLE])
            e = rotated(seen.turn[a], along[0], along[1])
            write(e[0], at[EX])
            write(e[1], at[EY])
            write(line(other[0]), at[RX])
            write(line(other[1]), at[RY])
        else:
            place_of(box, tight, seen.turn, a, p[AX], p[AY], seen.unit, offset[k], own)
            narrower(own[0], other[0], at[RX])
            narrower(own[1], other[1], at[RY])
            write(fixed(thin(1.0)), at[EX])
            write(fixed(thin(0.0)), at[EY])
        low, high, first, last, side = asked.tilts[k]
        at[DX:] = 0.0
        if side != 0.0:
            alpha = times((low, high), thin(side))
            lean = times(alpha, trigonometry.cos(first, last)), times(alpha, trigonometry.sin(first, last))
            d = rotated(seen.turn[a if side > 0.0 else b], lean[0], lean[1])
            write(widened(d[0], shift[k]), at[DX])
            write(widened(d[1], shift[k]), at[DY])


@kernel
def close(asked, q, leaning, h, seen):
    """Sum up every loop: tilts, tilts, slips over the unit of length, of a sharing ``q`` (joints, 3, 2), as lines.

    ``q``: tilts in the plane (of a guide roll and pitch) and slip over the unit, each with its slope; misalignments
    are added if ``leaning``.
    """
    seen.sums[:] = 0.0
    for k in range(asked.pairs.shape[0]):
        at = seen.at[k]
        first, second = (thin(q[k, 0, 0]), thin(q[k, 0, 1])), (thin(q[k, 1, 0]), thin(q[k, 1, 1]))
        x, y, lift = first, second, (thin(q[k, 2, 0]), thin(q[k, 2, 1]))
        if asked.guided[k]:
            ex, ey = line(at[EX]), line(at[EY])
            x = difference(product(ex, first, h), product(ey, second, h))
            y = sum_of(product(ey, first, h), product(ex, second, h))
        if leaning and asked.tilts[k, 4] != 0.0:
            x, y = sum_of(x, line(at[DX])), sum_of(y, line(at[DY]))
        lift = sum_of(difference(product(line(at[RX]), y, h), product(line(at[RY]), x, h)), lift)
        for loop in range(asked.incidence.shape[0]):
            sign, sums = asked.incidence[loop, k], seen.sums[3 * loop :]
            if sign > 0.0:
                write(sum_of(line(sums[0]), x), sums[0])
                write(sum_of(line(sums[1]), y), sums[1])
                write(sum_of(line(sums[2]), lift), sums[2])
            elif sign < 0.0:
                write(difference(line(sums[0]), x), sums[0])
                write(difference(line(sums[1]), y), sums[1])
                write(difference(line(sums[2]), lift), sums[2])


@kernel
def new_seen(links, joints, loops):
    """Make the workspace."""
    return Seen(np.zeros((links, 2, 4)), np.zeros((joints, 6, 4)), np.zeros(3), np.zeros((3 * loops, 4)))
