"""All assembly modes of a 3-RPR platform: sampled real roots of the sextic with a guarantee, poses, polish, checks.

See theory/platform-direct 1 to 4.  ``G(alpha) = g0 + 2 Re(g1 z + g2 z^2 + g3 z^3)`` is sampled at ends and middles of
32 intervals; on each, ``|G''| <= |G''(middle)| + (half width) max|G'''|`` decides: no root, one, or bisection.
"""

import math

import numpy as np

from graphsynth.core.compilation import kernel
from graphsynth.core.intrinsics import fma

NEAR_DOUBLE, INCONSISTENT, DEGENERATE = 1, 2, 4  # bits of a flag
NODES = 32
HALF = math.pi / NODES
LARGEST_WORK = 4000  # bisections of one problem
NARROW, NARROWEST = 1e-6, 1e-10
UNCERTAIN = 3e-12  # a pose known worse than this (in units of the largest length) is flagged
TAU = 2.0 * math.pi

_ENDS = -math.pi + TAU * np.arange(NODES) / NODES
_MIDDLES = _ENDS + HALF
TABLE = np.array([f(k * angles) for angles in (_ENDS, _MIDDLES) for k in (1, 2, 3) for f in (np.cos, np.sin)])


@kernel
def elbows(theta, D, l1, out):
    """Anchors ``D_k + l1_k exp(i theta_k)``, complex (n, 3)."""
    for i in range(theta.shape[0]):
        for k in range(3):
            out[i, k] = complex(D[k].real + l1[k] * math.cos(theta[i, k]), D[k].imag + l1[k] * math.sin(theta[i, k]))


@kernel
def norm2(z):
    """Squared absolute value."""
    return z.real * z.real + z.imag * z.imag


@kernel
def coefficients(a2, a3, b2, b3, l1, l2, l3, g, q):
    """Real and imaginary parts of g0, g1, g2, g3 into g[0:7] and n2, n1, n0, nm, d0, de (complex) into q[0:6]."""
    L = l1 * l1
    w20 = (l2 - l1) * (l2 + l1) - norm2(a2) - norm2(b2)
    w30 = (l3 - l1) * (l3 + l1) - norm2(a3) - norm2(b3)
    w21, w31 = b2 * a2.conjugate(), b3 * a3.conjugate()
    n2 = w21 * b3 - w31 * b2
    n1 = w20 * b3 - w21 * a3 - w30 * b2 + w31 * a2
    n0 = -w20 * a3 + w21.conjugate() * b3 + w30 * a2 - w31.conjugate() * b2
    nm = -w21.conjugate() * a3 + w31.conjugate() * a2
    d0 = 2.0 * ((b2.conjugate() * b3).imag + (a2.conjugate() * a3).imag)  # times i
    de = b2 * a3.conjugate() - a2.conjugate() * b3
    g3 = n2 * nm.conjugate()
    g2 = n2 * n0.conjugate() + n1 * nm.conjugate() + L * (de * de)
    g1 = n2 * n1.conjugate() + n1 * n0.conjugate() + n0 * nm.conjugate() + complex(0.0, 2.0 * L * d0) * de
    g[0] = norm2(n2) + norm2(n1) + norm2(n0) + norm2(nm) - L * (d0 * d0 + 2.0 * norm2(de))
    g[1], g[2], g[3], g[4], g[5], g[6] = g1.real, g1.imag, g2.real, g2.imag, g3.real, g3.imag
    q[0], q[1], q[2], q[3], q[4], q[5] = n2, n1, n0, nm, complex(0.0, d0), de


@kernel
def jet(g, c, s):
    """G, G' and G'' at the angle with cosine c and sine s."""
    c2, s2 = c * c - s * s, 2.0 * c * s
    c3, s3 = c * c2 - s * s2, s * c2 + c * s2
    r1, r2, r3 = g[1] * c - g[2] * s, g[3] * c2 - g[4] * s2, g[5] * c3 - g[6] * s3
    i1, i2, i3 = g[1] * s + g[2] * c, g[3] * s2 + g[4] * c2, g[5] * s3 + g[6] * c3
    return g[0] + 2.0 * (r1 + r2 + r3), -2.0 * (i1 + 2.0 * i2 + 3.0 * i3), -2.0 * (r1 + 4.0 * r2 + 9.0 * r3)


@kernel
def sample(g, eta, third, value, kind):
    """Values of G at the nodes; kind of each interval: 0 no root, 1 exactly one, 2 undecided."""
    T = TABLE
    g0, p1, m1, p2, m2, p3, m3 = g[0], 2.0 * g[1], -2.0 * g[2], 2.0 * g[3], -2.0 * g[4], 2.0 * g[5], -2.0 * g[6]
    for j in range(NODES):
        value[j] = g0 + (p1 * T[0, j] + m1 * T[1, j] + (p2 * T[2, j] + m2 * T[3, j]) + (p3 * T[4, j] + m3 * T[5, j]))
    value[NODES] = value[0]
    for j in range(NODES):
        r1 = p1 * T[6, j] + m1 * T[7, j]
        r2 = p2 * T[8, j] + m2 * T[9, j]
        r3 = p3 * T[10, j] + m3 * T[11, j]
        i1 = p1 * T[7, j] - m1 * T[6, j]
        i2 = p2 * T[9, j] - m2 * T[8, j]
        i3 = p3 * T[11, j] - m3 * T[10, j]
        slope = i1 + 2.0 * i2 + 3.0 * i3
        bend = abs(r1 + 4.0 * r2 + 9.0 * r3) + HALF * third
        low, high = value[j], value[j + 1]
        same = (low >= 0.0) == (high >= 0.0)
        least = abs(low) if abs(low) < abs(high) else abs(high)
        empty = same & (least > 0.5 * HALF * HALF * bend + 2.0 * eta)
        steep = abs(slope) > bend * HALF + 4.0 * eta
        kind[j] = 0 if (empty | (steep & same)) else (1 if steep else 2)


@kernel
def bracketed(g, low, high, at_low, at_high):
    """Root between low and high: Newton from the chord, kept inside the bracket; |error| about 1e-12."""
    alpha = low + (high - low) * (at_low / (at_low - at_high))
    positive = at_low >= 0.0
    for _ in range(60):
        if not low < alpha < high:
            alpha = 0.5 * (low + high)
        value, slope, _bend = jet(g, math.cos(alpha), math.sin(alpha))
        if (value >= 0.0) == positive:
            low = alpha
        else:
            high = alpha
        step = value / slope if slope != 0.0 else 1.0
        new = alpha - step
        if abs(step) < 1e-7:
            return new
        if not low < new < high:
            new = 0.5 * (low + high)
            if high - low < 1e-15:
                return new
        alpha = new
    return alpha


@kernel
def search(g, low, high, at_low, at_high, eta, third, stack, roots, count, work):
    """Bisect an undecided interval, left parts first: number of roots, work, and whether it got stuck."""
    stuck = False
    stack[0, 0], stack[0, 1], stack[0, 2], stack[0, 3] = low, high, at_low, at_high
    depth = 1
    while depth > 0:
        depth -= 1
        low, high, at_low, at_high = stack[depth, 0], stack[depth, 1], stack[depth, 2], stack[depth, 3]
        half, middle = 0.5 * (high - low), 0.5 * (high + low)
        value, slope, bend = jet(g, math.cos(middle), math.sin(middle))
        bend = abs(bend) + half * third
        same = (at_low >= 0.0) == (at_high >= 0.0)
        least = min(abs(at_low), abs(at_high))
        if same and least > 0.5 * half * half * bend + 2.0 * eta:
            continue
        if abs(slope) > bend * half + 4.0 * eta:
            if not same:
                if count == 6:
                    stuck = True
                    break
                roots[count] = bracketed(g, low, high, at_low, at_high)
                count += 1
            continue
        work += 1
        if (2.0 * half < NARROW and least <= 2.0 * eta) or 2.0 * half < NARROWEST or work > LARGEST_WORK:
            stuck = True
            if work > LARGEST_WORK:
                break
            continue
        stack[depth, 0], stack[depth, 1], stack[depth, 2], stack[depth, 3] = middle, high, value, at_high
        depth += 1
        stack[depth, 0], stack[depth, 1], stack[depth, 2], stack[depth, 3] = low, middle, at_low, value
        depth += 1
    return count, work, stuck


@kernel
def polish(a, b, l, x, y, alpha, out):
    """Newton on the three closures from a pose near a solution; pose, det JX into out[0:4]; whether it is accurate."""
    ax2, ay2, ax3, ay3 = a[0].real, a[0].imag, a[1].real, a[1].imag
    step = 1.0
    for _ in range(6):
        c, s = math.cos(alpha), math.sin(alpha)
        rx1, ry1 = c * b[0].real - s * b[0].imag, c * b[0].imag + s * b[0].real
        rx2, ry2 = c * b[1].real - s * b[1].imag, c * b[1].imag + s * b[1].real
        rx3, ry3 = c * b[2].real - s * b[2].imag, c * b[2].imag + s * b[2].real
        dx1, dy1 = x + rx1, y + ry1
        dx2, dy2 = x + rx2 - ax2, y + ry2 - ay2
        dx3, dy3 = x + rx3 - ax3, y + ry3 - ay3
        f1 = 0.5 * (fma(dx1, dx1, -(l[0] * l[0])) + dy1 * dy1)
        f2 = 0.5 * (fma(dx2, dx2, -(l[1] * l[1])) + dy2 * dy2)
        f3 = 0.5 * (fma(dx3, dx3, -(l[2] * l[2])) + dy3 * dy3)
        m1, m2, m3 = rx1 * dy1 - ry1 * dx1, rx2 * dy2 - ry2 * dx2, rx3 * dy3 - ry3 * dx3
        k1, k2, k3 = dx2 * dy3 - dx3 * dy2, dx3 * dy1 - dx1 * dy3, dx1 * dy2 - dx2 * dy1
        det = m1 * k1 + m2 * k2 + m3 * k3
        out[0], out[1], out[2], out[3] = x, y, alpha, 8.0 * det
        inv = 1.0 / det
        # rounding of f, a few 2^-53, seen through the rows of the inverse
        reach = abs(k1) + abs(k2) + abs(k3)
        reach = max(reach, abs(dy2 * m3 - dy3 * m2) + abs(dy3 * m1 - dy1 * m3) + abs(dy1 * m2 - dy2 * m1))
        reach = max(reach, abs(dx3 * m2 - dx2 * m3) + abs(dx1 * m3 - dx3 * m1) + abs(dx2 * m1 - dx1 * m2))
        if step < 1e-8 and max(abs(f1), abs(f2), abs(f3)) < 1e-14:
            return 2e-16 * max(l[0], l[1], l[2]) * reach * abs(inv) < UNCERTAIN
        if not math.isfinite(inv):
            return False
        px = (f1 * (dy2 * m3 - dy3 * m2) + f2 * (dy3 * m1 - dy1 * m3) + f3 * (dy1 * m2 - dy2 * m1)) * inv
        py = (f1 * (dx3 * m2 - dx2 * m3) + f2 * (dx1 * m3 - dx3 * m1) + f3 * (dx2 * m1 - dx1 * m2)) * inv
        pa = (f1 * k1 + f2 * k2 + f3 * k3) * inv
        x, y, alpha = x - px, y - py, alpha - pa
        step = max(abs(px), abs(py), abs(pa))
    return False


@kernel
def isolate(g, eta, third, value, kind, stack, roots):
    """Write the real roots of G; returns how many, and a flag if double precision does not decide."""
    sample(g, eta, third, value, kind)
    count, work, flag = np.int64(0), np.int64(0), np.int64(0)
    for j in range(NODES):
        if kind[j] == 0:
            continue
        low = -math.pi + 2.0 * HALF * j
        count, work, stuck = search(
            g, low, low + 2.0 * HALF, value[j], value[j + 1], eta, third, stack, roots, count, work
        )
        if stuck:
            flag |= NEAR_DOUBLE
        if work > LARGEST_WORK:
            break
    return count, flag


@kernel
def insert(pose, determinant, first, total, x, y, alpha, det):
    """Put a mode among those from ``first`` on, so that they stay sorted by alpha."""
    at = total
    while at > first and pose[at - 1, 2] > alpha:
        pose[at, 0], pose[at, 1], pose[at, 2] = pose[at - 1, 0], pose[at - 1, 1], pose[at - 1, 2]
        determinant[at] = determinant[at - 1]
        at -= 1
    pose[at, 0], pose[at, 1], pose[at, 2], determinant[at] = x, y, alpha, det


@kernel
def modes(anchors, vertices, legs, problem, pose, determinant, counts, flags):
    """All assembly modes of n problems: anchors (n, 3), vertices and legs (1, 3) or (n, 3); returns how many modes.

    Modes go to the first rows of ``problem``, ``pose`` (x, y, alpha) and ``determinant``, which hold 6 n; those of a
    problem are sorted by alpha.
    """
    n = anchors.shape[0]
    bstep, lstep = (1 if vertices.shape[0] > 1 else 0), (1 if legs.shape[0] > 1 else 0)
    g, q = np.empty(7), np.empty(6, np.complex128)
    value, kind = np.empty(NODES + 1), np.empty(NODES, np.int64)
    stack, roots = np.empty((80, 4)), np.empty(6)
    a, b, l, out = np.empty(2, np.complex128), np.empty(3, np.complex128), np.empty(3), np.empty(4)
    total = 0
    for i in range(n):
        # the problem, scaled by a power of two to about one
        origin = anchors[i, 0]
        a2, a3 = anchors[i, 1] - origin, anchors[i, 2] - origin
        bi, li = i * bstep, i * lstep
        b1, b2, b3 = vertices[bi, 0], vertices[bi, 1], vertices[bi, 2]
        l1, l2, l3 = legs[li, 0], legs[li, 1], legs[li, 2]
        size = max(abs(a2.real), abs(a2.imag), abs(a3.real), abs(a3.imag), l1, l2, l3)
        size = max(size, abs((b2 - b1).real), abs((b2 - b1).imag), abs((b3 - b1).real), abs((b3 - b1).imag))
        flags[i], counts[i] = 0, 0
        if not 1e-300 < size < 1e300:
            flags[i] = DEGENERATE
            continue
        unit = math.ldexp(1.0, math.frexp(size)[1])
        inverse = 1.0 / unit
        a[0], a[1], l[0], l[1], l[2] = a2 * inverse, a3 * inverse, l1 * inverse, l2 * inverse, l3 * inverse
        # the platform is turned about its first vertex: its frame may lie anywhere
        b[0], b[1], b[2] = 0.0, (b2 - b1) * inverse, (b3 - b1) * inverse
        coefficients(a[0], a[1], b[1], b[2], l[0], l[1], l[2], g, q)
        # sizes of the terms of G; eta bounds its rounding
        h1 = math.sqrt(g[1] ** 2 + g[2] ** 2)
        h2 = math.sqrt(g[3] ** 2 + g[4] ** 2)
        h3 = math.sqrt(g[5] ** 2 + g[6] ** 2)
        sum0 = 2.0 * (h1 + h2 + h3)
        eta = 4e-15 * (abs(g[0]) + sum0)
        if abs(g[0]) > sum0 + 2.0 * eta:
            continue
        if abs(g[0]) + sum0 < 1e-13:
            flags[i] = NEAR_DOUBLE
            continue
        count, flag = isolate(g, eta, 2.0 * (h1 + 8.0 * h2 + 27.0 * h3), value, kind, stack, roots)
        # a pose for every root: p from the linear system, then Newton's method on the closures
        first, balance = total, np.int64(0)
        for j in range(count):
            alpha = roots[j]
            z = complex(math.cos(alpha), math.sin(alpha))
            delta = q[4] + (q[5] * z - (q[5] * z).conjugate())
            power = norm2(delta)
            if power < 1e-20:
                flag |= DEGENERATE
                continue
            Q = ((q[0] * z + q[1]) * z + q[2] + q[3] * z.conjugate()) * delta.conjugate() / power
            settled = polish(a, b, l, Q.real, Q.imag, alpha, out)
            if not settled or abs(out[2] - alpha) > 1e-6:
                flag |= NEAR_DOUBLE
            balance += 1 if out[3] > 0.0 else (-1 if out[3] < 0.0 else 0)
            alpha = out[2]
            turn = complex(math.cos(alpha), math.sin(alpha)) * b1
            if alpha > math.pi:
                alpha -= TAU
            elif alpha <= -math.pi:
                alpha += TAU
            x, y = origin.real + (out[0] * unit - turn.real), origin.imag + (out[1] * unit - turn.imag)
            insert(pose, determinant, first, total, x, y, alpha, out[3] * (unit * unit) * (unit * unit))
            problem[total] = i
            total += 1
        # modes come in pairs of opposite sign of the determinant
        counts[i] = total - first
        flags[i] = flag | (INCONSISTENT if counts[i] % 2 == 1 or balance != 0 else 0)
    return total
