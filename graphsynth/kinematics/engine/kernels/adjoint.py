"""Gradients of poses by dimensions: loads on the links are carried back through the groups, as in statics.

A group of links obeys g(q, earlier poses, dimensions) = 0.  For the gradient l of a number by q, the reactions mu with
``J^T mu = l`` give its gradient by all else: ``- mu . dg``.  So the derivative by the place of a joint on a link is the
reaction there, seen from the link, and what acts on earlier links are their loads, added to their own.
"""

from graphsynth.core.compilation import kernel
from graphsynth.kinematics.engine.codes import (
    ANGLE,
    CAM,
    DRIVE_ANGLE,
    DRIVE_SLIDE,
    GEAR,
    LINE,
    PAX,
    PAY,
    RA,
    RB,
    SIGN,
    SLOT,
)
from graphsynth.kinematics.engine.kernels.newton import back, factor
from graphsynth.kinematics.engine.kernels.rows import row

CRANK, DYAD = 0, 1
AX, AY, A_ANGLE, BX, BY, B_ANGLE, RADIUS_A, OFFSET = 0, 1, 2, 3, 4, 5, 6, 9


@kernel(inline="always")
def _push(X, L, out, k, link, column, px, py, fx, fy, i):
    """Let a force act on a point of a link: its load, and the derivative by the point's place on the link."""
    c, s = X[link, 2, i], X[link, 3, i]
    L[link, 0, i] += fx
    L[link, 1, i] += fy
    L[link, 2, i] += (c * px - s * py) * fy - (s * px + c * py) * fx
    out[k, column, i] += c * fx + s * fy
    out[k, column + 1, i] += c * fy - s * fx


@kernel(inline="always")
def _moment(L, link, c, s, px, py, i):
    """Load of a link, its moment about a point of the link, and the arm of that point."""
    ux, uy = c * px - s * py, s * px + c * py
    fx, fy = L[link, 0, i], L[link, 1, i]
    return fx, fy, L[link, 2, i] - (ux * fy - uy * fx), ux, uy


@kernel(inline="always")
def _end(ends, dims, k, link):
    """Of a revolute joint: the column of a link's point and that point; the other link, its column and point."""
    if ends[k, 0] == link:
        return AX, dims[k, AX], dims[k, AY], ends[k, 1], BX, dims[k, BX], dims[k, BY]
    return BX, dims[k, BX], dims[k, BY], ends[k, 0], AX, dims[k, AX], dims[k, AY]


@kernel
def _crank(step, ends, dims, X, L, out, drives):
    """Carry the load of a link turned by a driver to the link it turns on; the moment is the driver's."""
    link, k, drive, sense = step[1], step[2], step[3], float(step[4])
    own, px, py, base, other, qx, qy = _end(ends, dims, k, link)
    for i in range(X.shape[2]):
        c, s = X[link, 2, i], X[link, 3, i]
        fx, fy, m, _, _ = _moment(L, link, c, s, px, py, i)
        out[k, own, i] -= c * fx + s * fy
        out[k, own + 1, i] -= c * fy - s * fx
        L[base, 2, i] += m
        drives[drive, i] += sense * m
        _push(X, L, out, k, base, other, qx, qy, fx, fy, i)


@kernel
def _dyad(step, ends, dims, X, L, out):
    """Carry the loads of links p and q, joined by the joint B, to the links that hold them at A and C."""
    p, q, A, B, C = step[1], step[2], step[3], step[4], step[5]
    pa, pax, pay, a, oa, ax, ay = _end(ends, dims, A, p)
    qc, qcx, qcy, b, ob, cx, cy = _end(ends, dims, C, q)
    pb, pbx, pby, _, qb, qbx, qby = _end(ends, dims, B, p)
    for i in range(X.shape[2]):
        cp, sp, cq, sq = X[p, 2, i], X[p, 3, i], X[q, 2, i], X[q, 3, i]
        fx, fy, m, ux, uy = _moment(L, p, cp, sp, pax, pay, i)
        gx, gy, n, wx, wy = _moment(L, q, cq, sq, qcx, qcy, i)
        ex, ey = cp * pbx - sp * pby - ux, sp * pbx + cp * pby - uy  # from A to B
        dx, dy = cq * qbx - sq * qby - wx, sq * qbx + cq * qby - wy  # from C to B
        # moments about A and C vanish with the force (hx, hy) of p on q at B
        f = -1.0 / (ex * dy - ey * dx)
        hx, hy = f * (n * ex + m * dx), f * (n * ey + m * dy)
        out[B, pb, i] += cp * hx + sp * hy
        out[B, pb + 1, i] += cp * hy - sp * hx
        out[B, qb, i] -= cq * hx + sq * hy
        out[B, qb + 1, i] -= cq * hy - sq * hx
        fx, fy, gx, gy = fx + hx, fy + hy, gx - hx, gy - hy
        out[A, pa, i] -= cp * fx + sp * fy
        out[A, pa + 1, i] -= cp * fy - sp * fx
        out[C, qc, i] -= cq * gx + sq * gy
        out[C, qc + 1, i] -= cq * gy - sq * gx
        _push(X, L, out, A, a, oa, ax, ay, fx, fy, i)
        _push(X, L, out, C, b, ob, cx, cy, gx, gy, i)


@kernel
def _transposed(step, rows, rp, x, phi, q, work):
    """Factors of the transposed equations of any group; the gradients of the rows stay in ``work.G``."""
    r0, nr = step[1], step[2]
    for r in range(nr):
        k = r0 + r
        row(rows[k, 0], rp, k, rows[k, 1], rows[k, 2], x, phi, q, work.g)
        for c in range(nr):
            work.J[c, r] = 0.0
        for c in range(6):
            work.G[r, c] = work.g[c]
            place = rows[k, 3] if c < 3 else rows[k, 4]
            if place >= 0:
                work.J[3 * place + c % 3, r] = work.g[c]
    return factor(work.J, nr, work.pivots)


@kernel
def _general(step, rows, rp, links, X, L, out, drives, work):
    """Carry the loads of any group back, one sample after the other, all directions with the same factors."""
    r0, nr, l0, x, mu, G = step[1], step[2], step[3], work.x, work.f, work.G
    for i in range(X.shape[2]):
        for link in range(X.shape[0]):
            for c in range(4):
                x[link, c] = X[link, c, i]
        _transposed(step, rows, rp, x, work.phi, work.q, work)
        for d in range(L.shape[0]):
            load, own = L[d], out[d]
            # reactions mu of the group under its loads
            for r in range(nr):
                mu[r] = load[links[l0 + r // 3], r % 3, i]
            back(work.J, nr, work.pivots, mu)
            for r in range(nr):
                k, m = r0 + r, mu[r]
                kind, a, b, joint = rows[k, 0], rows[k, 1], rows[k, 2], rows[k, 5]
                # what a row asks of a link placed before is a load there
                for c in range(3):
                    if rows[k, 3] < 0:
                        load[a, c, i] -= m * G[r, c]
                    if rows[k, 4] < 0:
                        load[b, c, i] -= m * G[r, 3 + c]
                # the row changes with a point as with its link: along G[r, 3:5] for b, against it for a
                fx, fy = m * G[r, 3], m * G[r, 4]
                ca, sa, cb, sb = x[a, 2], x[a, 3], x[b, 2], x[b, 3]
                own[joint, AX, i] += ca * fx + sa * fy
                own[joint, AY, i] += ca * fy - sa * fx
                own[joint, BX, i] -= cb * fx + sb * fy
                own[joint, BY, i] -= cb * fy - sb * fx
                # directions, driven coordinates, radii
                if kind == ANGLE:
                    own[joint, A_ANGLE, i] += m
                    own[joint, B_ANGLE, i] -= m
                elif kind in (DRIVE_ANGLE, DRIVE_SLIDE):
                    drives[d, int(rp[k, SLOT]), i] += m * rp[k, SIGN]
                elif kind == GEAR:
                    own[joint, OFFSET, i] += m * rp[k, SIGN] * rp[k, RB] / (rp[k, RA] + rp[k, RB])
                elif kind == CAM:
                    own[joint, RADIUS_A, i] += m
                if kind in (LINE, DRIVE_SLIDE, CAM):
                    # turning the line, or the pitch curve, on link a is turning link a about the line's point
                    ux, uy = ca * rp[k, PAX] - sa * rp[k, PAY], sa * rp[k, PAX] + ca * rp[k, PAY]
                    own[joint, A_ANGLE, i] -= m * (G[r, 2] + ux * G[r, 4] - uy * G[r, 3])


@kernel
def pull(program, dims, frames, loads, out, drives, work):
    """Gradients by dimensions and driver coordinates of the loads on all links, every sample on its own.

    ``frames`` (sets, links, 4, n): x, y, cos, sin; ``loads`` (sets, directions, links, 3, n), used up; results ``out``
    (sets, directions, joints, 10, n) and ``drives`` (sets, directions, drivers, n).
    """
    steps, links, ends, rows = program.steps, program.links, program.ends, program.rows
    for b in range(frames.shape[0]):
        X = frames[b]
        for t in range(steps.shape[0] - 1, -1, -1):
            step = steps[t]
            if step[0] > DYAD:
                _general(step, rows, program.row_table[b], links, X, loads[b], out[b], drives[b], work)
                continue
            for d in range(loads.shape[1]):
                if step[0] == DYAD:
                    _dyad(step, ends, dims[b], X, loads[b, d], out[b, d])
                else:
                    _crank(step, ends, dims[b], X, loads[b, d], out[b, d], drives[b, d])
