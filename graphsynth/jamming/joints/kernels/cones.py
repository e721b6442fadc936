"""One cone program by an interior-point method, as `graphsynth.jamming.joints.cones` solves many of them together.

The largest work ``W q`` with ``sum |M_b q| <= 1``: moments M_b q of joints in units of their limits, forces F_j q that
cost 1 each.  Estimated: rounding only, with a bound from either side.
"""

from collections import namedtuple

import numpy as np

from graphsynth.core.compilation import kernel
from graphsynth.intervals.kernels.nearest import hypot
from graphsynth.kinematics.engine.kernels.newton import back, copy, factor

#: Steps at most, and the relative gap that is enough.
ROUNDS, TARGET = 60, 1e-12

#: Workspace of a program of k unknowns and c cones: H (n, n) and its factors L, pivots, d (n,); S, I (c, 3, 3) scaling
#: and inverse; lam, rz, t, e (c, 3) and rx, more, left (n,) of a step.
Bench = namedtuple("Bench", "H L pivots d S I lam rz t e rx more left")


@kernel
def new_bench(k, cones):
    """Make the workspace of a program of k unknowns in q and so many cones, the last one included."""
    n = k + cones - 1
    return Bench(
        H=np.zeros((n, n)),
        L=np.zeros((n, n)),
        pivots=np.zeros(n, np.int64),
        d=np.zeros(n),
        S=np.zeros((cones, 3, 3)),
        I=np.zeros((cones, 3, 3)),
        lam=np.zeros((cones, 3)),
        rz=np.zeros((cones, 3)),
        t=np.zeros((cones, 3)),
        e=np.zeros((cones, 3)),
        rx=np.zeros(n),
        more=np.zeros(n),
        left=np.zeros(n),
    )


@kernel
def forth(M, blocks, x, out):
    """``G x`` (cones, 3): cones ``(u_b, M_b q)``, then ``1 - sum u`` of the first ``blocks``."""
    cones, k = M.shape[0], M.shape[2]
    out[cones, 0] = out[cones, 1] = out[cones, 2] = 0.0
    for c in range(cones):
        out[c, 0] = -x[k + c]
        for i in range(2):
            total = 0.0
            for j in range(k):
                total += M[c, i, j] * x[j]
            out[c, 1 + i] = -total
        if c < blocks:
            out[cones, 0] += x[k + c]


@kernel
def back_again(M, blocks, z, out):
    """``G^T z`` (n,)."""
    cones, k = M.shape[0], M.shape[2]
    for j in range(k):
        out[j] = 0.0
    for c in range(cones):
        for j in range(k):
            out[j] -= M[c, 0, j] * z[c, 1] + M[c, 1, j] * z[c, 2]
        out[k + c] = -z[c, 0] + (z[cones, 0] if c < blocks else 0.0)


@kernel
def applied(matrices, v, out):
    """Product of a symmetric matrix with a vector for every cone; ``out`` may be ``v``."""
    for c in range(v.shape[0]):
        a, b, d, m = v[c, 0], v[c, 1], v[c, 2], matrices[c]
        for i in range(3):
            out[c, i] = m[i, 0] * a + m[i, 1] * b + m[i, 2] * d


@kernel
def determinant(v):
    """``v_0^2 - v_1^2 - v_2^2``, at least a little."""
    r = hypot(v[1], v[2])
    return max((v[0] - r) * (v[0] + r), 1e-300)


@kernel
def scaling(s, z, S, I):
    """Nesterov-Todd scaling S with ``S z = S^-1 s``, and its inverse I."""
    w = np.empty(3)
    for c in range(s.shape[0]):
        of_s, of_z = np.sqrt(determinant(s[c])), np.sqrt(determinant(z[c]))
        total = 0.0
        for i in range(3):
            total += s[c, i] / of_s * (z[c, i] / of_z)
        gamma = np.sqrt(0.5 * (1.0 + total))
        for i in range(1, 3):
            w[i] = (s[c, i] / of_s - z[c, i] / of_z) / (2.0 * gamma)
        w[0] = 1.0 + np.sqrt(1.0 + w[1] * w[1] + w[2] * w[2])
        scale, beta = 1.0 / np.sqrt(2.0 * w[0]), np.sqrt(of_s / of_z)
        for i in range(3):
            w[i] *= scale
        for i in range(3):
            for j in range(3):
                flip = 0.0 if i != j else (1.0 if i == 0 else -1.0)
                sense = -1.0 if (i == 0) != (j == 0) else 1.0
                S[c, i, j] = beta * (2.0 * w[i] * w[j] - flip)
                I[c, i, j] = (2.0 * sense * w[i] * w[j] - flip) / beta


@kernel
def gather(M, blocks, bench):
    """Make ``H = (I G)^T (I G)``, scaled to a unit diagonal, and factor it; whether it is regular."""
    cones, k, H, I, d = M.shape[0], M.shape[2], bench.H, bench.I, bench.d
    n, A = k + cones, np.empty((3, 3))
    for i in range(n):
        for j in range(n):
            H[i, j] = 0.0
    for c in range(cones + 1):
        for i in range(3):
            for j in range(3):
                A[i, j] = I[c, i, 0] * I[c, 0, j] + I[c, i, 1] * I[c, 1, j] + I[c, i, 2] * I[c, 2, j]
        if c == cones:
            for i in range(blocks):
                for j in range(blocks):
                    H[k + i, k + j] += A[0, 0]
            continue
        H[k + c, k + c] += A[0, 0]
        for i in range(k):
            a, b = M[c, 0, i], M[c, 1, i]
            H[i, k + c] += A[0, 1] * a + A[0, 2] * b
            H[k + c, i] = H[i, k + c]
            one, two = A[1, 1] * a + A[2, 1] * b, A[1, 2] * a + A[2, 2] * b
            for j in range(k):
                H[i, j] += one * M[c, 0, j] + two * M[c, 1, j]
    for i in range(n):
        d[i] = 1.0 / np.sqrt(max(H[i, i], 1e-300))
    for i in range(n):
        for j in range(n):
            H[i, j] *= d[i] * d[j]
    copy(H, bench.L)
    return abs(factor(bench.L, n, bench.pivots)) > 0.0


@kernel
def solve(bench, v):
    """Solve with the factors of `gather`, in place, with one step of refinement."""
    n, H, d, left = v.shape[0], bench.H, bench.d, bench.left
    right = v.copy()
    for i in range(n):
        right[i] *= d[i]
        v[i] = right[i]
    back(bench.L, n, bench.pivots, v)
    for i in range(n):
        total = right[i]
        for j in range(n):
            total -= H[i, j] * v[j]
        left[i] = total
    back(bench.L, n, bench.pivots, left)
    for i in range(n):
        v[i] = (v[i] + left[i]) * d[i]


@kernel
def direction(M, blocks, bench, target, dx, ds, dz):
    """Solve for a step with ``lam o (S dz + I ds) = target``."""
    lam, t, I, e, more = bench.lam, bench.t, bench.I, bench.e, bench.more
    cones = lam.shape[0]
    for c in range(cones):  # t with lam o t = target
        cross = lam[c, 1] * target[c, 1] + lam[c, 2] * target[c, 2]
        t[c, 0] = (lam[c, 0] * target[c, 0] - cross) / determinant(lam[c])
        t[c, 1] = (target[c, 1] - t[c, 0] * lam[c, 1]) / lam[c, 0]
        t[c, 2] = (target[c, 2] - t[c, 0] * lam[c, 2]) / lam[c, 0]
    applied(I, bench.rz, e)
    add(e, t, 1.0)
    applied(I, e, e)
    back_again(M, blocks, e, dx)
    for i in range(dx.shape[0]):
        dx[i] = -bench.rx[i] - dx[i]
    solve(bench, dx)
    forth(M, blocks, dx, ds)
    for c in range(cones):
        for i in range(3):
            e[c, i] = bench.rz[c, i] + ds[c, i]
    applied(I, e, e)
    add(e, t, 1.0)
    applied(I, e, dz)
    for _ in range(2):  # refine: the closure of tau must stay exact however ill-conditioned H becomes
        back_again(M, blocks, dz, more)
        for i in range(dx.shape[0]):
            more[i] = -bench.rx[i] - more[i]
        solve(bench, more)
        for i in range(dx.shape[0]):
            dx[i] += more[i]
        forth(M, blocks, more, e)
        applied(I, e, e)
        applied(I, e, e)
        add(dz, e, 1.0)
    forth(M, blocks, dx, ds)
    for c in range(cones):
        for i in range(3):
            ds[c, i] = -bench.rz[c, i] - ds[c, i]


@kernel
def add(v, w, scale):
    """Add a multiple of one array (cones, 3) to another."""
    for c in range(v.shape[0]):
        for i in range(3):
            v[c, i] += scale * w[c, i]


@kernel
def product(a, b, out, scale):
    """Add a multiple of the Jordan product of every cone."""
    for c in range(a.shape[0]):
        out[c, 0] += scale * (a[c, 0] * b[c, 0] + a[c, 1] * b[c, 1] + a[c, 2] * b[c, 2])
        out[c, 1] += scale * (a[c, 0] * b[c, 1] + b[c, 0] * a[c, 1])
        out[c, 2] += scale * (a[c, 0] * b[c, 2] + b[c, 0] * a[c, 2])


@kernel
def reach(v, d):
    """Largest step that keeps every cone, at most 1e6."""
    least = 1e6
    for k in range(v.shape[0]):
        a = d[k, 0] * d[k, 0] - (d[k, 1] * d[k, 1] + d[k, 2] * d[k, 2])
        b = v[k, 0] * d[k, 0] - (v[k, 1] * d[k, 1] + v[k, 2] * d[k, 2])
        c = determinant(v[k])
        square = b * b - a * c
        root = np.sqrt(max(square, 0.0))
        # smallest positive root of a t^2 + 2 b t + c, written without cancellation
        if square < 0.0 and a > 0.0:
            t = 1e6
        elif b <= 0.0:
            t = c / max(-b + root, 1e-300)
        else:
            t = (b + root) / max(-a, 1e-300) if a < 0.0 else 1e6
        least = min(least, t, v[k, 0] / max(-d[k, 0], 1e-300) if d[k, 0] < 0.0 else 1e6)
    return least


@kernel
def solve_cones(M, blocks, W, q, tau):
    """Solve one program (estimated): M (cones, 2, k), of which the first ``blocks`` share one limit, W (k,).

    M has full column rank when stacked, W is of the order of 1.  To ``q`` (k,) and ``tau`` (cones, 2) go the loads and
    the tilts, in units of the limits; returns the rounds.
    """
    cones, k = M.shape[0], M.shape[2]
    n = k + cones
    bench = new_bench(k, cones + 1)
    x, s, z = np.zeros(n), np.zeros((cones + 1, 3)), np.zeros((cones + 1, 3))
    # strictly feasible points: q = 0; the least tilts that close, with twice the limit that they need
    closing(M, blocks, W, tau)
    need = 0.0
    for c in range(blocks):
        need = max(need, hypot(tau[c, 0], tau[c, 1]))
    need = 2.0 * need + 1e-3
    s[cones, 0], z[cones, 0] = 1.0, need
    for c in range(cones):
        x[k + c] = s[c, 0] = 0.5 / blocks if c < blocks else 1.0
        z[c, 0] = need if c < blocks else 1.0
        if c < blocks:
            s[cones, 0] -= s[c, 0]
            z[c, 1], z[c, 2] = tau[c, 0], tau[c, 1]
    dx, ds, dz, target = np.zeros(n), np.zeros((cones + 1, 3)), np.zeros((cones + 1, 3)), np.zeros((cones + 1, 3))
    least, done = np.inf, 0
    for done in range(1, ROUNDS + 1):  # noqa: B007
        # how far the closure of the tilts has been lost counts too: at the end H is nearly singular
        back_again(M, blocks, z, bench.rx)
        off = 0.0
        for i in range(k):
            off = max(off, abs(bench.rx[i] - W[i]))
        gap = (np.sum(s * z) + off) / max(abs(z[cones, 0]), 1e-300)
        if not gap < least:
            break
        least = gap
        for i in range(k):
            q[i] = x[i]
        for c in range(cones):
            tau[c, 0], tau[c, 1] = z[c, 1], z[c, 2]
        if gap <= TARGET or not advance(M, blocks, W, bench, (x, s, z), (dx, ds, dz), target):
            break
    return done


@kernel
def advance(M, blocks, W, bench, at, by, target):
    """Take one predictor-corrector step from ``bench.rx = G^T z``; whether the equations could be solved."""
    (x, s, z), (dx, ds, dz) = at, by
    lam, rx, rz = bench.lam, bench.rx, bench.rz
    cones, k = M.shape[0], M.shape[2]
    scaling(s, z, bench.S, bench.I)
    applied(bench.S, z, lam)
    if not gather(M, blocks, bench):
        return False
    forth(M, blocks, x, rz)
    for i in range(k):
        rx[i] -= W[i]
    for c in range(blocks, cones):
        rx[k + c] += 1.0
    add(rz, s, 1.0)
    rz[cones, 0] -= 1.0
    mu = np.sum(lam * lam) / (cones + 1)
    clear(target)
    product(lam, lam, target, -1.0)
    direction(M, blocks, bench, target, dx, ds, dz)
    a = 1.0 - min(1.0, reach(s, ds), reach(z, dz))
    applied(bench.I, ds, ds)
    applied(bench.S, dz, dz)
    clear(target)
    product(lam, lam, target, -1.0)
    product(ds, dz, target, -1.0)
    for c in range(cones + 1):
        target[c, 0] += a * a * a * mu
    direction(M, blocks, bench, target, dx, ds, dz)
    a = min(1.0, 0.99 * reach(s, ds), 0.99 * reach(z, dz))
    for i in range(x.shape[0]):
        x[i] += a * dx[i]
    add(s, ds, a)
    add(z, dz, a)
    return a > 0.0  # not so for NaN


@kernel
def clear(v):
    """Fill (cones, 3) with zeros."""
    for c in range(v.shape[0]):
        v[c, 0] = v[c, 1] = v[c, 2] = 0.0


@kernel
def closing(M, blocks, off, tau):
    """Write the least tilts of the first ``blocks`` with ``sum M_b^T tau_b = -off``."""
    k = M.shape[2]
    N, pivots, y = np.zeros((k, k)), np.empty(k, np.int64), off.copy()
    for c in range(blocks):
        for r in range(2):
            for i in range(k):
                for j in range(k):
                    N[i, j] += M[c, r, i] * M[c, r, j]
    factor(N, k, pivots)
    back(N, k, pivots, y)
    for c in range(blocks):
        for r in range(2):
            tau[c, r] = 0.0
            for i in range(k):
                tau[c, r] -= M[c, r, i] * y[i]


@kernel
def bounds_of(M, W, q, tau):
    """Lower bound from the load; upper bound from the tilts, after their closure has been restored."""
    cones, k = M.shape[0], M.shape[2]
    cost, work, off, more = 0.0, 0.0, np.empty(k), np.empty((cones, 2))
    for j in range(k):
        work += W[j] * q[j]
    for c in range(cones):
        a = b = 0.0
        for j in range(k):
            a += M[c, 0, j] * q[j]
            b += M[c, 1, j] * q[j]
        cost += hypot(a, b)
    for _ in range(2):
        for j in range(k):
            off[j] = W[j]
            for c in range(cones):
                off[j] += M[c, 0, j] * tau[c, 0] + M[c, 1, j] * tau[c, 1]
        closing(M, cones, off, more)
        for c in range(cones):
            tau[c, 0] += more[c, 0]
            tau[c, 1] += more[c, 1]
    upper = 0.0
    for c in range(cones):
        upper = max(upper, hypot(tau[c, 0], tau[c, 1]))
    lower = abs(work) / cost if cost > 0.0 else 0.0
    return lower, upper
