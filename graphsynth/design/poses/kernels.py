"""RR dyads of two to five poses in floating point, for the page: candidates, where `dyads` proves all of them.

Equations as in theory/poses 1, in units of the largest shift of the body, with the first pose as the origin: every pose
has a row of seven numbers before xp + yq, yp - xq, x, y, p, q, 1, with (x, y) the joint at the body in the first pose
and (p, q) the one at the frame.  Four poses leave a cubic of pivots, met by lines through a pole; the fifth pose is the
change of sign of its row along that curve.  Two and three poses leave the joint at the body free: a grid is taken.
"""

import math

import numpy as np

from graphsynth.core.compilation import kernel
from graphsynth.intervals.kernels.nearest import cos, sin

#: Halvings between two samples of the curve, and the largest row of the fifth pose that is taken for zero.
HALVINGS, SMALL = 60, 1e-9
#: The grid of joints at the body, in units of the largest shift, and places on a perpendicular bisector.
GRID, WIDE, OFF = 9, 1.6, 4


@kernel
def rows_of(poses, size, rows):
    """Write the rows of all poses after the first (n - 1, 7)."""
    for k in range(1, poses.shape[0]):
        turn = poses[k, 2] - poses[0, 2]
        m, s = cos(turn) - 1.0, sin(turn)
        dx, dy = (poses[k, 0] - poses[0, 0]) / size, (poses[k, 1] - poses[0, 1]) / size
        row = rows[k - 1]
        row[0], row[1] = -m, s
        row[2], row[3] = (m + 1.0) * dx + s * dy, (m + 1.0) * dy - s * dx  # Re u conj(d), -Im u conj(d)
        row[4], row[5], row[6] = -dx, -dy, 0.5 * (dx * dx + dy * dy)


@kernel
def value(row, x, y, p, q):
    """Return what a row says of two joints; 0 if their distance is that of the first pose."""
    return (
        row[0] * (x * p + y * q) + row[1] * (y * p - x * q) + row[2] * x + row[3] * y + row[4] * p + row[5] * q + row[6]
    )


@kernel
def table(rows, p, q, T):
    """Write the three rows before x, y, 1 for a pivot."""
    for k in range(3):
        row = rows[k]
        T[k, 0] = row[0] * p - row[1] * q + row[2]
        T[k, 1] = row[0] * q + row[1] * p + row[3]
        T[k, 2] = row[4] * p + row[5] * q + row[6]


@kernel
def determinant(T):
    """Return the determinant of a table."""
    return (
        T[0, 0] * (T[1, 1] * T[2, 2] - T[1, 2] * T[2, 1])
        - T[0, 1] * (T[1, 0] * T[2, 2] - T[1, 2] * T[2, 0])
        + T[0, 2] * (T[1, 0] * T[2, 1] - T[1, 1] * T[2, 0])
    )


@kernel
def partner(T, joint):
    """Write the joint at the body that a table leaves: the longest of three cross products; False if at infinity."""
    best = 0.0
    for k in range(3):
        a, b = T[k], T[(k + 1) % 3]
        x, y, w = a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]
        size = x * x + y * y + w * w
        if size > best and abs(w) > 1e-9 * math.sqrt(size):
            best = size
            joint[2], joint[3] = x / w, y / w
    return best > 0.0


@kernel
def pole(rows, T, centre):
    """Write the pole of the two poses that turn most against each other; False if none turns."""
    best = 1e-9
    for i in range(3):  # the first pose and pose i
        row = rows[i]
        size = row[0] * row[0] + row[1] * row[1]
        if size > best:
            best = size
            # p + i q = d / (1 - u) = d conj(1 - u) / |1 - u|^2
            dx, dy = -row[4], -row[5]
            centre[0], centre[1] = (dx * row[0] - dy * row[1]) / size, (dy * row[0] + dx * row[1]) / size
    return best > 1e-9


@kernel
def meeting(rows, centre, turn, sign, T, joint):
    """Write the dyad with the pivot on a line through the pole, of one root; False if there is none."""
    c, s = cos(turn), sin(turn)
    f = np.empty(3)
    for k in range(3):
        t = (1.0, -1.0, 2.0)[k]
        table(rows, centre[0] + t * c, centre[1] + t * s, T)
        f[k] = determinant(T) / t
    # f = a t^2 + b t + e
    b = 0.5 * (f[0] - f[1])
    a = (f[2] - 0.5 * (f[0] + f[1]) - 2.0 * b) / 3.0
    e = 0.5 * (f[0] + f[1]) - a
    under = b * b - 4.0 * a * e
    if not under >= 0.0:
        return False
    far = -b - math.copysign(math.sqrt(under), b)
    # the sign tells the roots apart all along: (-b + sign sqrt) / 2a
    if (sign > 0.0) == (b < 0.0):
        if a == 0.0:
            return False
        t = 0.5 * far / a
    else:
        if far == 0.0:
            return False
        t = 2.0 * e / far
    if not abs(t) < 1e6:
        return False
    joint[0], joint[1] = centre[0] + t * c, centre[1] + t * s
    table(rows, joint[0], joint[1], T)
    return partner(T, joint)


@kernel
def put(joint, poses, size, out, count):
    """Write a dyad in the units of the poses; returns how many there are."""
    if count < out.shape[0]:
        for c in range(4):
            out[count, c] = poses[0, c % 2] + size * joint[c]
        return count + 1
    return count


@kernel
def fifth(rows, centre, turn, sign, T, joint):
    """Return whether a line through the pole meets the curve in a root, and what the fifth pose's row says there."""
    if not meeting(rows, centre, turn, sign, T, joint):
        return False, 0.0
    return True, value(rows[3], joint[2], joint[3], joint[0], joint[1])


@kernel
def edge(rows, centre, inside, outside, sign, T, joint):
    """Return the last line that meets the curve, between one that does and one that does not."""
    for _ in range(HALVINGS):
        middle = 0.5 * (inside + outside)
        if meeting(rows, centre, middle, sign, T, joint):
            inside = middle
        else:
            outside = middle
    return inside


@kernel
def zero(rows, centre, low, below, high, sign, T, joint):
    """Write the dyad between two lines where the fifth row changes its sign; False if it jumps there."""
    ahead = math.inf
    for _ in range(HALVINGS):
        middle = 0.5 * (low + high)
        fine, found = fifth(rows, centre, middle, sign, T, joint)
        if not fine:
            return False
        ahead = found
        if (ahead < 0.0) == (below < 0.0):
            low = middle
        else:
            high = middle
    far = 1.0 + joint[0] ** 2 + joint[1] ** 2 + joint[2] ** 2 + joint[3] ** 2
    return abs(ahead) < SMALL * far


@kernel
def from_five(rows, centre, samples, poses, size, out):
    """Find changes of sign of the fifth pose's row along the curve of the other four."""
    T, joint, count = np.empty((3, 3)), np.empty(4), 0
    for k in range(2):
        sign, last = 1.0 - 2.0 * k, 0.0
        known, _ = fifth(rows, centre, last, sign, T, joint)
        for i in range(1, samples + 1):
            turn = math.pi * i / samples
            fine, _ = fifth(rows, centre, turn, sign, T, joint)
            if fine or known:  # where the curve begins or ends in between, only that far
                low = last if known else edge(rows, centre, turn, last, sign, T, joint)
                high = turn if fine else edge(rows, centre, last, turn, sign, T, joint)
                _, first = fifth(rows, centre, low, sign, T, joint)
                _, end = fifth(rows, centre, high, sign, T, joint)
                if (first < 0.0) != (end < 0.0) and zero(rows, centre, low, first, high, sign, T, joint):
                    count = put(joint, poses, size, out, count)
            last, known = turn, fine
    return count


@kernel
def from_grid(rows, poses, size, out):
    """Take joints at the body from a grid; their pivots are on a perpendicular bisector, or on two."""
    joint, count = np.empty(4), 0
    for i in range(GRID):
        for j in range(GRID):
            x, y = WIDE * (2.0 * i / (GRID - 1) - 1.0), WIDE * (2.0 * j / (GRID - 1) - 1.0)
            joint[2], joint[3] = x, y
            a = rows[0]
            ap, aq, ac = a[0] * x + a[1] * y + a[4], a[0] * y - a[1] * x + a[5], a[2] * x + a[3] * y + a[6]
            if rows.shape[0] == 1:
                square = ap * ap + aq * aq
                for k in range(-OFF if square > 1e-12 else OFF + 1, OFF + 1):
                    step = WIDE * k / (OFF * math.sqrt(square))
                    joint[0], joint[1] = -ac * ap / square - step * aq, -ac * aq / square + step * ap
                    count = put(joint, poses, size, out, count)
                continue
            b = rows[1]
            bp, bq, bc = b[0] * x + b[1] * y + b[4], b[0] * y - b[1] * x + b[5], b[2] * x + b[3] * y + b[6]
            under = ap * bq - aq * bp
            if abs(under) > 1e-9:
                joint[0], joint[1] = (aq * bc - bq * ac) / under, (bp * ac - ap * bc) / under
                count = put(joint, poses, size, out, count)
    return count


@kernel
def candidates(poses, samples, out):
    """Write RR dyads (most, 4) that let a body pass through two to five poses (n, 3); returns how many.

    A row of ``out`` is the joint at the frame, then the joint at the body where it is in the first pose.  Of four poses
    they lie on ``samples`` lines through a pole; of five two that lie nearer than two such lines may be missed.
    """
    n, size = poses.shape[0], 0.0
    for k in range(1, n):
        size = max(size, abs(poses[k, 0] - poses[0, 0]), abs(poses[k, 1] - poses[0, 1]))
    if n < 2 or n > 5 or not size > 0.0:
        return 0
    rows = np.empty((n - 1, 7))
    rows_of(poses, size, rows)
    if n < 4:
        return from_grid(rows, poses, size, out)
    T, joint, centre, count = np.empty((3, 3)), np.empty(4), np.empty(2), 0
    if not pole(rows, T, centre):
        return 0
    if n == 5:
        return from_five(rows, centre, samples, poses, size, out)
    for i in range(samples):
        for k in range(2):
            if meeting(rows, centre, math.pi * (i + 0.5) / samples, 1.0 - 2.0 * k, T, joint):
                count = put(joint, poses, size, out, count)
    return count


@kernel
def cranks(poses, turns, out):
    """Write RR dyads (most, 4), as `candidates` does, whose link turns by given angles from the first pose on.

    ``turns`` (n - 1,).  Three poses leave one dyad (theory/poses 1), two a joint at the body, which a grid takes.
    """
    n, size, count, joint = poses.shape[0], 0.0, 0, np.empty(4)
    for k in range(1, n):
        size = max(size, abs(poses[k, 0] - poses[0, 0]), abs(poses[k, 1] - poses[0, 1]))
    if n < 2 or n > 3 or turns.size != n - 1 or not size > 0.0:
        return 0
    # a w - b g + d = 0 for both joints, w at the body and g at the frame
    a, b, d = np.empty(n - 1, np.complex128), np.empty(n - 1, np.complex128), np.empty(n - 1, np.complex128)
    for k in range(n - 1):
        body, own = poses[k + 1, 2] - poses[0, 2], turns[k]
        a[k] = complex(cos(body) - cos(own), sin(body) - sin(own))
        b[k] = complex(1.0 - cos(own), -sin(own))
        d[k] = complex((poses[k + 1, 0] - poses[0, 0]) / size, (poses[k + 1, 1] - poses[0, 1]) / size)
    under = a[1] * b[0] - a[0] * b[1] if n == 3 else b[0]
    if under.real * under.real + under.imag * under.imag < 1e-18:
        return 0
    for i in range(1 if n == 3 else GRID * GRID):
        w = complex(WIDE * (2.0 * (i // GRID) / (GRID - 1) - 1.0), WIDE * (2.0 * (i % GRID) / (GRID - 1) - 1.0))
        g = (a[0] * w + d[0]) / under
        if n == 3:
            w, g = (d[0] * b[1] - d[1] * b[0]) / under, (a[1] * d[0] - a[0] * d[1]) / under
        joint[0], joint[1], joint[2], joint[3] = g.real, g.imag, w.real, w.imag
        count = put(joint, poses, size, out, count)
    return count
