"""Independent judge of one position: linear programs with cuts find tilts and wrenches, rational numbers prove them.

Nothing of graphsynth is used.  The unknowns are the tilts and lifts of the bodies (theory/joints-that-share-a-tilt 2);
circles are cut by tangents until they are respected (Kelley).  From the floats of the linear program follow, in
fractions,

* tilts that close exactly: joints without play are closed by an exact solve, the largest tilt over its limit is U;
* wrenches in exact equilibrium: chords of a spanning tree keep theirs, the tree carries the sum; L
  (theory/joints-that-share-a-tilt 4).

``L <= T <= U`` then holds without any rounding, for the floats of the position as they are.
"""

from dataclasses import dataclass
from fractions import Fraction
from math import cos, isqrt, pi, sin

import numpy as np
from scipy.linalg import qr
from scipy.optimize import linprog


@dataclass(frozen=True)
class Position:
    """``pairs`` (a, b), places ``r`` and misalignments ``d`` of the joints, limits ``tilt`` and ``play``.

    ``tilt`` is a number, or a pair for limits along x and along y.  0 is rigid.
    """

    bodies: int
    pairs: tuple
    r: np.ndarray
    d: np.ndarray
    tilt: tuple
    play: tuple

    def scaled(self, k):
        return Position(self.bodies, self.pairs, self.r, self.d * k, self.tilt, self.play)


def tilt_row(here, k, n):
    """Row of ``n . (omega_b - omega_a)``, x and y of every body."""
    row = np.zeros(3 * here.bodies + 1)
    a, b = here.pairs[k]
    row[3 * b : 3 * b + 2] = n
    row[3 * a : 3 * a + 2] = -np.asarray(n)
    return row


def slip_row(here, k):
    row = np.zeros(3 * here.bodies + 1)
    (a, b), (x, y) = here.pairs[k], here.r[k]
    row[3 * b : 3 * b + 3] = y, -x, 1.0
    row[3 * a : 3 * a + 3] = -y, x, -1.0
    return row


#: The linear programs are solved in small units, so that their absolute tolerance of 1e-10 is a small one.
FINE = 1e4


def solve(here, rounds=60):
    """Return floats (x, moments, forces) near the optimum; frame is body 0."""
    here = here.scaled(FINE)
    eq, eq_right, eq_of = [], [], []
    rows, right, of = [], [], []
    axes = [(cos(2 * pi * i / 8), sin(2 * pi * i / 8)) for i in range(8)]

    def cut(k, n, limit):
        row = tilt_row(here, k, n)
        row[-1] = -limit
        rows.append(row)
        right.append(float(np.dot(n, here.d[k])))
        of.append(("m", k, n))

    for k, (limit, play) in enumerate(zip(here.tilt, here.play)):
        if limit == 0.0:
            for n in ((1.0, 0.0), (0.0, 1.0)):
                eq.append(tilt_row(here, k, n))
                eq_right.append(float(np.dot(n, here.d[k])))
                eq_of.append(("m", k, n))
        elif isinstance(limit, tuple):
            for n, own in (((1.0, 0.0), limit[0]), ((0.0, 1.0), limit[1])):
                cut(k, n, own)
                cut(k, (-n[0], -n[1]), own)
        else:
            for n in axes:
                cut(k, n, limit)
        if play == 0.0:
            eq.append(slip_row(here, k))
            eq_right.append(0.0)
            eq_of.append(("f", k, 1.0))
        else:
            for sign in (1.0, -1.0):
                row = sign * slip_row(here, k)
                row[-1] = -play
                rows.append(row)
                right.append(0.0)
                of.append(("f", k, sign))
    size = 3 * here.bodies + 1
    cost = FINE * np.eye(size)[-1]
    bounds = [(0.0, 0.0)] * 3 + [(None, None)] * (size - 4) + [(0.0, None)]
    best = None
    for _ in range(rounds):
        found = linear_program(cost, rows, right, np.array(eq).reshape(-1, size), eq_right, bounds)
        if found is None:  # cuts too much alike: what the last program found is nearly optimal
            break
        best = found
        x, worst = found.x, 0.0
        for k, limit in enumerate(here.tilt):
            if limit == 0.0 or isinstance(limit, tuple):
                continue
            a, b = here.pairs[k]
            tau = x[3 * b : 3 * b + 2] - x[3 * a : 3 * a + 2] - here.d[k]
            lean = float(np.hypot(*tau))
            over = lean / limit / max(x[-1], 1e-300) - 1.0
            if over > 1e-12:
                cut(k, tuple(tau / lean), limit)
                worst = max(worst, over)
        if worst < 1e-11:
            break
    moments, forces = np.zeros((len(here.pairs), 2)), np.zeros(len(here.pairs))
    assert best is not None, "no linear program was solved"
    x = best.x
    for names, values in ((of, best.ineqlin.marginals), (eq_of, best.eqlin.marginals)):
        for (kind, k, n), value in zip(names, values):  # later cuts have no values: they were not part of it
            if kind == "m":
                moments[k] -= value * np.asarray(n)
            else:
                forces[k] -= value * n
    return x / FINE, moments, forces


def linear_program(cost, rows, right, equal, equal_right, bounds):
    """Solve with HiGHS, more exactly or less; None if it gives up."""
    for tolerance in (1e-10, 1e-9, 1e-7):
        options = {"primal_feasibility_tolerance": tolerance, "dual_feasibility_tolerance": tolerance}
        found = linprog(
            cost, np.array(rows), right, equal, equal_right, bounds, method="highs-ds", options=options
        )  # fmt: skip
        if found.status == 0:
            return found
    return None


def tree_of(here):
    """Joints of a spanning tree in the order from the frame: (joint, parent, child)."""
    reached, tree = [0], []
    for body in reached:
        for k, (a, b) in enumerate(here.pairs):
            other = b if a == body else a if b == body else -1
            if other >= 0 and other not in reached:
                reached.append(other)
                tree.append((k, body, other))
    assert len(reached) == here.bodies
    return tree


def exact_upper(here, x):
    """Square of an upper bound of T: tilts near x, closed exactly."""
    n = here.bodies
    r = [(Fraction(float(a)), Fraction(float(b))) for a, b in here.r]
    d = [(Fraction(float(a)), Fraction(float(b))) for a, b in here.d]
    omega = np.array(x[:-1]).reshape(n, 3)[:, :2]
    start = [Fraction(float(v)) for v in omega.ravel()]
    start[0] = start[1] = Fraction(0)
    tree = tree_of(here)

    # lift of every body: coefficients of the tilts, and a constant
    lift = {0: ([Fraction(0)] * (2 * n), Fraction(0))}
    slips = {}
    for k, parent, child in tree:
        a, b = here.pairs[k]
        w = x[3 * b + 2] - x[3 * a + 2]
        tau = omega[b] - omega[a]
        value = Fraction(float(w + tau[0] * here.r[k][1] - tau[1] * here.r[k][0])) if here.play[k] else Fraction(0)
        slips[k] = value
        row, constant = list(lift[parent][0]), lift[parent][1]
        for body, sign in ((parent, 1), (child, -1)):
            row[2 * body] += sign * r[k][1]
            row[2 * body + 1] -= sign * r[k][0]
        lift[child] = row, constant + (value if child == b else -value)
    rows, right = [], []
    for k, (a, b) in enumerate(here.pairs):
        if k in slips:
            continue
        row = [p - q for p, q in zip(lift[b][0], lift[a][0])]
        for body, sign in ((b, 1), (a, -1)):
            row[2 * body] += sign * r[k][1]
            row[2 * body + 1] -= sign * r[k][0]
        slips[k] = row, lift[b][1] - lift[a][1]
        if here.play[k] == 0.0:
            rows.append(row)
            right.append(lift[a][1] - lift[b][1])
    for k, (a, b) in enumerate(here.pairs):
        if here.tilt[k] == 0.0:
            for i in (0, 1):
                row = [Fraction(0)] * (2 * n)
                row[2 * b + i], row[2 * a + i] = Fraction(1), Fraction(-1)
                rows.append(row)
                right.append(d[k][i])
    tilts = closed(rows, right, start)
    if tilts is None:
        return None
    worst = Fraction(0)
    for k, (a, b) in enumerate(here.pairs):
        tau = [tilts[2 * b + i] - tilts[2 * a + i] - d[k][i] for i in (0, 1)]
        limit = here.tilt[k]
        if isinstance(limit, tuple):
            worst = max(worst, *((t / Fraction(own)) ** 2 for t, own in zip(tau, limit)))
        elif limit == 0.0:
            assert tau == [0, 0]
        else:
            worst = max(worst, (tau[0] ** 2 + tau[1] ** 2) / Fraction(limit) ** 2)
        own = slips[k]
        slip = own if isinstance(own, Fraction) else sum((c * t for c, t in zip(own[0], tilts)), own[1])
        if here.play[k] == 0.0:
            assert slip == 0
        else:
            worst = max(worst, (slip / Fraction(here.play[k])) ** 2)
    return worst


def closed(rows, right, start):
    """Solution of exact equations near ``start``; the first two unknowns stay (the frame). None if they contradict."""
    if not rows:
        return start
    matrix = np.array([[float(v) for v in row] for row in rows])[:, 2:]
    _, upper, order = qr(matrix, pivoting=True, mode="economic")
    rank = int((np.abs(np.diag(upper)) > 1e-9 * abs(upper[0, 0])).sum())
    if rank < len(rows):
        return None
    basis = [int(c) + 2 for c in order[: len(rows)]]
    values = list(start)
    table = [
        [row[c] for c in basis] + [b - sum(v * s for c, (v, s) in enumerate(zip(row, start)) if c not in basis and v)]
        for row, b in zip(rows, right)
    ]
    m = len(rows)
    for c in range(m):
        p = max(range(c, m), key=lambda i, c=c: abs(table[i][c]))
        table[c], table[p] = table[p], table[c]
        for i in range(m):
            if i != c and table[i][c]:
                q = table[i][c] / table[c][c]
                table[i] = [u - q * v for u, v in zip(table[i], table[c])]
    for c in range(m):
        values[basis[c]] = table[c][m] / table[c][c]
    return values


def root_above(q):
    """Return a fraction not below the square root."""
    shift = max(0, 220 - (q.numerator.bit_length() - q.denominator.bit_length()))
    shift += shift % 2
    return Fraction(isqrt((q.numerator << shift) // q.denominator) + 1, 1 << (shift // 2))


def exact_lower(here, moments, forces):
    """Lower bound of T: wrenches near the given ones, in exact equilibrium."""
    r = [(Fraction(float(a)), Fraction(float(b))) for a, b in here.r]
    tree = tree_of(here)
    in_tree = {k for k, _, _ in tree}
    load = {body: [Fraction(0)] * 3 for body in range(here.bodies)}
    wrench = {}
    for k, (a, b) in enumerate(here.pairs):
        if k not in in_tree:
            f = Fraction(float(forces[k]))
            m = [Fraction(float(v)) for v in moments[k]]
            wrench[k] = [m[0] + f * r[k][1], m[1] - f * r[k][0], f]
            for i in range(3):
                load[b][i] += wrench[k][i]
                load[a][i] -= wrench[k][i]
    for k, parent, child in reversed(tree):
        a, b = here.pairs[k]
        sign = 1 if child == b else -1
        wrench[k] = [-sign * v for v in load[child]]
        for i in range(3):
            load[parent][i] += load[child][i]
    work, cost = Fraction(0), Fraction(0)
    for k, (gx, gy, f) in wrench.items():
        m = gx - f * r[k][1], gy + f * r[k][0]
        work += sum(v * Fraction(float(s)) for v, s in zip(m, here.d[k]))
        limit = here.tilt[k]
        if isinstance(limit, tuple):
            cost += abs(m[0]) * Fraction(limit[0]) + abs(m[1]) * Fraction(limit[1])
        elif limit and any(m):
            cost += root_above(m[0] ** 2 + m[1] ** 2) * Fraction(limit)
        cost += abs(f) * Fraction(here.play[k])
    return abs(work) / cost if cost else Fraction(0)


def judge(here):
    """Floats near the optimum, exact lower bound, square of an exact upper bound (None if it cannot be closed)."""
    found = solve(here)
    return found, exact_lower(here, *found[1:]), exact_upper(here, found[0])
