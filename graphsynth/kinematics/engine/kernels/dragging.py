"""Pulling a point of a link to a target along the motions that the joints allow, whatever is driven.

All joint equations together, without any elimination; unknown are the places of the moving links, angles times the
characteristic length.  A Householder factorisation of the transposed constraint matrix gives a basis of the tangent
space, the length of every constraint seen from those before, and the shortest correction.  Steps go along the tangent
and back to the joints.  Refused, and halved, is a step whose correction is large beside it, whose tangent space turns
too much, or that loses more than half of the determinant of the constraints or its sign, with tangent spaces carried
along: behind a change of sign lies another branch, even where its poses are met by chance.
"""

import math

import numpy as np

from graphsynth.core.compilation import kernel
from graphsynth.intervals.kernels.nearest import atan2, cos, sin
from graphsynth.kinematics.engine import codes, outlines
from graphsynth.kinematics.engine.kernels.advancing import lines_of_centres
from graphsynth.kinematics.engine.kernels.newton import copy, factor
from graphsynth.kinematics.engine.kernels.rows import nearest_turn, row, world

#: Longest step over the characteristic length, and the shortest.
LONGEST, SHORTEST = 0.05, 1e-10
#: Steps that are tried at most in one pull.
TRIALS = 300
#: Lengths over the characteristic length below which a target is reached, and gains of a probe that are none.
REACHED, GAIN = 1e-10, 1e-12
#: Step of a probe where the point cannot get nearer to first order.
PROBE = 2e-3
#: Movement of a point for a unit step below which it stands still: rounding of the tangent space, not a way to go.
STILL = 1e-10
#: Damping of the shorter axis of a point's velocities, over the square of the longer one.
LEAST = 1e-9
#: Least part of the determinant of the tangent spaces before and after a step.
TURNED = 0.95


@kernel
def new_bench(links, rows):
    """Make room for factorisations of ``rows`` equations."""
    n = 3 * (links - 1)
    w = n - rows
    A, N, S = np.empty((n, rows)), np.empty((n, w)), np.empty((w, w))
    d, f, g, y, none = np.empty(rows), np.empty(rows), np.empty(6), np.empty(n), np.zeros((1, 3))
    return outlines.Bench(A, d, f, g, y, N, S, np.empty(w, np.int64), none)


@kernel
def place_of(link, frame):
    """Return the first column of a link; of the frame, a negative number."""
    return -3 if link == frame else 3 * (link - (link > frame))


@kernel
def assemble(rows, p, frame, x, phi, Lc, bench):
    """Write the transposed constraint matrix and the residuals, all in lengths."""
    A, g = bench.A, bench.g
    for r in range(rows.shape[0]):
        kind, a, b = rows[r, 0], rows[r, 1], rows[r, 2]
        size = Lc if kind in (codes.ANGLE, codes.GEAR) else 1.0
        bench.f[r] = size * row(kind, p, r, a, b, x, phi, bench.none, g)
        for k in range(A.shape[0]):
            A[k, r] = 0.0
        i, j = place_of(a, frame), place_of(b, frame)
        for c in range(3):
            unit = size / Lc if c == 2 else size
            if i >= 0:
                A[i + c, r] = unit * g[c]
            if j >= 0:
                A[j + c, r] = unit * g[3 + c]


@kernel
def reflect(bench):
    """Factor the transposed matrix by Householder reflections, kept below its diagonal; returns the sign of R."""
    A, d = bench.A, bench.d
    n, m = A.shape
    sign = 1.0
    for k in range(m):
        size = 0.0
        for i in range(k, n):
            size += A[i, k] * A[i, k]
        size = math.sqrt(size)
        d[k] = -size if A[k, k] > 0.0 else size  # of R
        sign = -sign if d[k] < 0.0 else sign
        if size == 0.0:
            continue
        # v = column - d e_k, normed so that H = 1 - v v^T
        unit = math.sqrt(size * (size + abs(A[k, k])))
        A[k, k] = (A[k, k] - d[k]) / unit
        for i in range(k + 1, n):
            A[i, k] /= unit
        for c in range(k + 1, m):
            total = 0.0
            for i in range(k, n):
                total += A[i, k] * A[i, c]
            for i in range(k, n):
                A[i, c] -= total * A[i, k]
    return sign


@kernel
def turn_back(bench, y):
    """Multiply a vector by Q, reflection by reflection."""
    A = bench.A
    n, m = A.shape
    for k in range(m - 1, -1, -1):
        total = 0.0
        for i in range(k, n):
            total += A[i, k] * y[i]
        for i in range(k, n):
            y[i] -= total * A[i, k]


@kernel
def basis(bench, N):
    """Write an orthonormal basis of the tangent space to the columns of N (n, freedoms)."""
    n, m = bench.A.shape
    for c in range(n - m):
        bench.y[:] = 0.0
        bench.y[m + c] = 1.0
        turn_back(bench, bench.y)
        for k in range(n):
            N[k, c] = bench.y[k]


@kernel
def shortest(bench):
    """Write the shortest correction of the residuals to ``bench.y``; returns its length."""
    A, d, y, f = bench.A, bench.d, bench.y, bench.f
    y[:] = 0.0
    total = 0.0
    for r in range(A.shape[1]):
        y[r] = -f[r]
        for k in range(r):
            y[r] -= A[k, r] * y[k]
        y[r] = y[r] / d[r]
        total += y[r] * y[r]
    turn_back(bench, y)
    return math.sqrt(total)


@kernel
def move(x, frame, step, scale, Lc):
    """Move all links by a step of the unknowns times a scale."""
    for link in range(x.shape[0]):
        k = place_of(link, frame)
        if k >= 0:
            x[link, 0] += scale * step[k]
            x[link, 1] += scale * step[k + 1]
            angle = scale * step[k + 2] / Lc
            c, s = cos(angle), sin(angle)
            xc, xs = x[link, 2] * c - x[link, 3] * s, x[link, 3] * c + x[link, 2] * s
            inv = 1.5 - 0.5 * (xc * xc + xs * xs)
            x[link, 2], x[link, 3] = xc * inv, xs * inv
            x[link, 4] = nearest_turn(atan2(x[link, 3], x[link, 2]), x[link, 4] + angle)


@kernel
def onto_joints(rows, p, frame, x, phi, Lc, bench, most):
    """Correct a pose so that the joints close; the factors there stay in ``bench``.

    Returns the length of the first correction over the characteristic length (infinite if it does not converge, or one
    is longer than ``most``) and the sign of R.
    """
    first, last = 0.0, math.inf
    for trial in range(20):
        assemble(rows, p, frame, x, phi, Lc, bench)
        sign = reflect(bench)
        size = shortest(bench) / Lc
        if trial == 0:
            first = size
        if not size <= most or (trial > 1 and size > 0.5 * last and size > 1e-12):
            return math.inf, sign
        if size <= 1e-15 or (trial > 1 and size > 0.5 * last):
            return first, sign
        move(x, frame, bench.y, 1.0, Lc)
        last = size
    return math.inf, 1.0


@kernel
def follow_centres(rows, p, x, phi):
    """Follow the lines of centres of gear pairs; False where one turns by more than a quarter turn."""
    slot, fine = 0, True
    for r in range(rows.shape[0]):
        if rows[r, 0] == codes.GEAR:
            ax, ay = world(x, rows[r, 1], p[r, codes.PAX], p[r, codes.PAY])
            bx, by = world(x, rows[r, 2], p[r, codes.PBX], p[r, codes.PBY])
            here = nearest_turn(atan2(by - ay, bx - ax), phi[slot])
            fine = fine and abs(here - phi[slot]) < 0.5
            phi[slot] = here
            slot += 1
    return fine


@kernel
def determinant(bench):
    """Return the size of the determinant of the constraints."""
    total = 1.0
    for k in range(bench.d.shape[0]):
        total *= abs(bench.d[k])
    return total


@kernel
def attempt(rows, p, frame, stand, Lc, bench, y):
    """Take a step ``y`` of the unknowns and go back to the joints; whether it stays on the branch (else undone).

    ``stand`` is where it begins and ends: x, phi, basis N of the tangent space, and ``here``: the orientation of N, the
    size of the determinant of the constraints, and the sign of both together, which a branch keeps.
    """
    x, phi, N, here = stand.x, stand.phi, stand.N, stand.here
    before, angle = x.copy(), phi.copy()
    most = 0.2 * math.sqrt(np.sum(y * y)) / Lc + 1e-9
    move(x, frame, y, 1.0, Lc)
    fine = follow_centres(rows, p, x, phi)
    first, sign = onto_joints(rows, p, frame, x, phi, Lc, bench, most)
    if fine and first <= most and follow_centres(rows, p, x, phi):
        basis(bench, bench.N)
        w = N.shape[1]
        for i in range(w):
            for j in range(w):
                bench.S[i, j] = np.sum(N[:, i] * bench.N[:, j])
        carried, big = factor(bench.S, w, bench.pivots), determinant(bench)
        sense = here[0] if carried > 0.0 else -here[0]
        if abs(carried) >= TURNED and big >= 0.5 * here[1] and sense * sign == here[2]:
            here[0], here[1] = sense, big
            copy(bench.N, N)
            return True
    copy(before, x)
    for k in range(phi.shape[0]):
        phi[k] = angle[k]
    return False


@kernel
def copy_stand(source, target):
    """Copy a place on the branch."""
    copy(source.x, target.x)
    copy(source.N, target.N)
    for k in range(source.phi.shape[0]):
        target.phi[k] = source.phi[k]
    for k in range(3):
        target.here[k] = source.here[k]


@kernel
def gradient(stand, frame, link, px, py, D, Lc):
    """Write derivatives (2, freedoms) of the place of a point, given in the fixed frame, along the tangent space."""
    k, x, N = place_of(link, frame), stand.x, stand.N
    for c in range(N.shape[1] if k >= 0 else 0):
        D[0, c] = N[k, c] - (py - x[link, 1]) / Lc * N[k + 2, c]
        D[1, c] = N[k + 1, c] + (px - x[link, 0]) / Lc * N[k + 2, c]


@kernel
def nearing(D, rx, ry, damping, a):
    """Write the shortest combination ``a`` of tangents that brings a point by (rx, ry), as far as they can.

    Along the shorter axis of the ellipse of velocities steps are damped; returns the square of the longer one.
    """
    xx, xy, yy = np.sum(D[0] * D[0]), np.sum(D[0] * D[1]), np.sum(D[1] * D[1])
    half, middle = 0.5 * (xx - yy), 0.5 * (xx + yy)
    radius = math.sqrt(half * half + xy * xy)
    big = middle + radius
    a[:] = 0.0
    if big <= STILL * STILL:
        return 0.0
    ex, ey = (half + radius, xy) if half >= 0.0 else (xy, radius - half)
    size = math.sqrt(ex * ex + ey * ey)
    ex, ey = (ex / size, ey / size) if size > 0.0 else (1.0, 0.0)
    long, across = (ex * rx + ey * ry) / big, ex * ry - ey * rx
    small = 0.0
    for c in range(a.shape[0]):
        part = ex * D[1, c] - ey * D[0, c]
        small += part * part
    for c in range(a.shape[0]):
        a[c] = long * (ex * D[0, c] + ey * D[1, c])
        if small > 1e-24 * big and a.shape[0] > 1:
            a[c] += across * (ex * D[1, c] - ey * D[0, c]) / (small + damping * big)
    return big


@kernel
def new_stand(rows, p, poses):
    """Return a place on the branch at a pose (links, 3), its tangent space left open."""
    links, gears = poses.shape[0], 0
    for r in range(rows.shape[0]):
        gears += rows[r, 0] == codes.GEAR
    n = 3 * (links - 1)
    x, phi = np.zeros((links, 5)), np.zeros(max(1, gears))
    for k in range(links):
        x[k, 0], x[k, 1], x[k, 4] = poses[k, 0], poses[k, 1], poses[k, 2]
        x[k, 2], x[k, 3] = cos(poses[k, 2]), sin(poses[k, 2])
    lines_of_centres(rows, p, poses, phi)
    return outlines.Stand(x, phi, np.empty((n, n - rows.shape[0])), np.empty(3))


@kernel
def write_poses(x, poses):
    """Write x, y and angle of every link."""
    for k in range(poses.shape[0]):
        poses[k, 0], poses[k, 1], poses[k, 2] = x[k, 0], x[k, 1], x[k, 4]


@kernel
def combine(N, a, scale, y):
    """Write a combination of tangents."""
    for k in range(N.shape[0]):
        y[k] = 0.0
        for c in range(N.shape[1]):
            y[k] += scale * N[k, c] * a[c]


@kernel
def unit_step(N, y, way):
    """Write the direction of a step; returns its length along the first tangent."""
    moved, size = 0.0, math.sqrt(np.sum(y * y))
    for k in range(y.shape[0]):
        moved += y[k] * N[k, 0]
        way[k] = y[k] / size
    return moved


@kernel
def drag(rows, p, frame, poses, link, at, target, way, Lc, found):
    """Pull a point ``at`` (2,) of a link to a target (2,), as near as the branch lets it come.

    ``rows``, ``p`` are all equations of the joints, as `planning.joint_rows` writes them; ``poses`` (links, 3) is the
    pose, and becomes the one reached; ``way`` (3 (links - 1),) is the unit step with which the links moved last (zeros
    if they did not), and becomes the new one: where nothing brings the point nearer to first order, as in its own dead
    centre, the motion goes on in its sense.  To ``found`` (3,) go the distance left, the code of :mod:`.codes` why it
    ended, and the steps taken.
    """
    links, w = poses.shape[0], 3 * (poses.shape[0] - 1) - rows.shape[0]
    bench, n = new_bench(links, rows.shape[0]), 3 * (links - 1)
    stand, back = new_stand(rows, p, poses), new_stand(rows, p, poses)
    x = stand.x
    first, sign = onto_joints(rows, p, frame, x, stand.phi, Lc, bench, 1e-3)
    found[0], found[1], found[2] = math.nan, outlines.NOT_CLOSED, 0.0
    if not first <= 1e-3:
        return
    basis(bench, stand.N)
    stand.here[0], stand.here[1], stand.here[2] = 1.0, determinant(bench), sign
    D, a, y = np.zeros((2, w)), np.zeros(w), np.zeros(n)
    slope_before, moved, damping, why, count = 0.0, 0.0, LEAST, outlines.NEAREST, 0
    while count < TRIALS:
        px, py = world(x, link, at[0], at[1])
        rx, ry = target[0] - px, target[1] - py
        left = math.sqrt(rx * rx + ry * ry)
        if left <= REACHED * Lc:
            why = outlines.REACHED
            break
        gradient(stand, frame, link, px, py, D, Lc)
        big = nearing(D, rx, ry, damping, a)
        # of one freedom the curvature too: the slope of the last step tells it
        if w == 1 and big > 0.0:
            slope = D[0, 0] * rx + D[1, 0] * ry
            bend = (slope_before - slope) / moved if moved != 0.0 else 0.0
            a[0] = slope / bend if bend > 0.1 * big else a[0]
            slope_before = slope
        length = math.sqrt(np.sum(a * a))
        probing = not length > SHORTEST * Lc
        if probing:
            astray(stand, D, way, a, big)
            length = PROBE * Lc
        scale = min(1.0, LONGEST * Lc / length) if not probing else length
        # try; what does not bring it nearer is undone
        copy_stand(stand, back)
        nearer, refused = False, False
        while not nearer:
            combine(stand.N, a, scale, y)
            count += 1
            refused = not attempt(rows, p, frame, stand, Lc, bench, y)
            if not refused:
                nearer = gap(x, link, at, target) < left - (GAIN * Lc if probing else 0.0)
                if not nearer:
                    copy_stand(back, stand)
            if not nearer:
                if probing and scale > 0.0:
                    scale = -scale
                elif probing or abs(scale) * length < SHORTEST * Lc:
                    break
                else:
                    scale *= 0.5
                    if w > 1 and not refused:  # the shorter axis bends away: less along it
                        damping = min(1.0, 30.0 * damping)
                        nearing(D, rx, ry, damping, a)
                        length = max(math.sqrt(np.sum(a * a)), 1e-3 * length)
                        scale = min(1.5 * scale, LONGEST * Lc / length)
        damping = max(LEAST, 0.2 * damping)
        if not nearer:
            why = codes.SINGULAR if refused and not probing else outlines.NEAREST
            break
        slope_before *= stand.here[0] * back.here[0]  # the new basis may point the other way
        moved = unit_step(stand.N, y, way)
    write_poses(x, poses)
    found[0], found[1], found[2] = gap(x, link, at, target), why, count


@kernel
def gap(x, link, at, target):
    """Return the distance of a point of a link from its target."""
    px, py = world(x, link, at[0], at[1])
    dx, dy = target[0] - px, target[1] - py
    return math.sqrt(dx * dx + dy * dy)


@kernel
def astray(stand, D, way, a, big):
    """Write a unit tangent that does not move the point to first order, nearest to the last step."""
    N, w = stand.N, a.shape[0]
    for c in range(w):
        a[c] = np.sum(N[:, c] * way)
    if w == 1:
        a[0] = -1.0 if a[0] < 0.0 else 1.0
        return
    # without what moves it, along the longer axis of its velocities
    first = D[0].copy() if np.sum(D[0] * D[0]) >= np.sum(D[1] * D[1]) else D[1].copy()
    size = math.sqrt(np.sum(first * first))
    first = first / size if size > 0.0 else first
    for trial in range(w + 1):
        a -= np.sum(a * first) * first
        size = math.sqrt(np.sum(a * a))
        if size > 1e-6:
            break
        a[:] = 0.0
        a[trial % w] = 1.0
    a /= math.sqrt(np.sum(a * a))


@kernel
def closed_pose(rows, p, frame, poses, Lc):
    """Move a drawn pose (links, 3) onto its joints, by the shortest way.

    Returns how far, in parts of the characteristic length; infinite if it does not close.
    """
    bench, stand = new_bench(poses.shape[0], rows.shape[0]), new_stand(rows, p, poses)
    first, _ = onto_joints(rows, p, frame, stand.x, stand.phi, Lc, bench, 1.0)
    if first < math.inf:
        write_poses(stand.x, poses)
    return first
