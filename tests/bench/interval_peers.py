"""Other interval libraries on the work of ``test_interval_speed.py``; run in a process of its own, prints JSON.

``python interval_peers.py NAME COUNT SECONDS`` with NAME one of flint, intvalpy, codac.  The least time, of runs during
SECONDS, for one interval of an array of COUNT (add, multiply, sin), for one Krawczyk test of a box, and for the
crossing of the circle and the ellipse of the specification (14.5, eps = 0) by bisection with Krawczyk's test, or
by the library's own paving.  A library may change the rounding mode of its process (codac does).
"""

import json
import random
import sys
import time

B, A, R = 17.4617879639289313590283215334, 17.53, 17.5
Q, ALPHA, BETA = R * R, 1.0 / A**2, 1.0 / B**2
SIDE, TOLERANCE = 17.6, 17.6e-6
ROOT = (13.11490802879096276551727, 11.58659515976778845911871)


class Flint:
    """Balls of python-flint at 53 bits."""

    def __init__(self):
        import flint

        flint.ctx.prec = 53
        self.arb = flint.arb

    def make(self, lo, hi):
        return self.arb((lo + hi) / 2.0, (hi - lo) / 2.0 * (1.0 + 2e-16) + 1e-300)

    def ends(self, x):
        return float(x.lower()), float(x.upper())

    def column(self, pairs):
        return [self.make(*p) for p in pairs]

    def operations(self, a, b):
        return {
            "add": lambda: [x + y for x, y in zip(a, b)],
            "multiply": lambda: [x * y for x, y in zip(a, b)],
            "sin": lambda: [x.sin() for x in a],
        }


class Codac(Flint):
    """Intervals of codac."""

    def __init__(self):
        import codac

        self.codac = codac

    def make(self, lo, hi):
        return self.codac.Interval(lo, hi)

    def ends(self, x):
        return x.lb(), x.ub()

    def operations(self, a, b):
        return super().operations(a, b) | {"sin": lambda: [self.codac.sin(x) for x in a]}

    def paving(self):
        """The library's own: contractor of the inverse image, bisection; encloses, but proves no existence."""
        c = self.codac
        x = c.VectorVar(2)
        f = c.AnalyticFunction([x], [c.sqr(x[0]) + c.sqr(x[1]) - Q, ALPHA * c.sqr(x[0]) + BETA * c.sqr(x[1]) - 1.0])
        contractor = c.CtcInverse(f, c.IntervalVector([[0.0, 0.0], [0.0, 0.0]]))
        start = c.IntervalVector([[0.0, SIDE], [0.0, SIDE]])
        return lambda: c.pave(start, contractor, TOLERANCE)


class IntvalPy(Flint):
    """Intervals of IntvalPy; arrays are numpy arrays of objects."""

    def __init__(self):
        import intvalpy

        self.ip = intvalpy

    def make(self, lo, hi):
        return self.ip.Interval(lo, hi)

    def ends(self, x):
        return float(x.a), float(x.b)

    def column(self, pairs):
        return self.ip.Interval([p[0] for p in pairs], [p[1] for p in pairs])

    def operations(self, a, b):
        return {"add": lambda: a + b, "multiply": lambda: a * b, "sin": lambda: self.ip.sin(a)}


def krawczyk(library, X):
    """K(X) for the circle and the ellipse, and whether it lies inside; None without an inverse."""
    ends = [library.ends(x) for x in X]
    middle = [0.5 * (lo + hi) for lo, hi in ends]
    z = [library.make(m, m) for m in middle]
    det = 4.0 * middle[0] * middle[1] * (BETA - ALPHA)
    if det == 0.0:
        return None
    Y = [
        [2.0 * BETA * middle[1] / det, -2.0 * middle[1] / det],
        [-2.0 * ALPHA * middle[0] / det, 2.0 * middle[0] / det],
    ]
    F = [z[0] * z[0] + z[1] * z[1] - Q, z[0] * z[0] * ALPHA + z[1] * z[1] * BETA - 1.0]
    L = [[X[0] * 2.0, X[1] * 2.0], [X[0] * (2.0 * ALPHA), X[1] * (2.0 * BETA)]]
    K = []
    for i in range(2):
        k = z[i] - (F[0] * Y[i][0] + F[1] * Y[i][1])
        for j in range(2):
            k = k + ((1.0 if i == j else 0.0) - (L[0][j] * Y[i][0] + L[1][j] * Y[i][1])) * (X[j] - z[j])
        K.append(library.ends(k))
    return K, all(lo < k[0] and k[1] < hi for k, (lo, hi) in zip(K, ends))


def bisection(library):
    """All boxes that may hold a crossing, with the number that are proved; the same algorithm as the kernels."""
    waiting, kept, proved = [[(0.0, SIDE), (0.0, SIDE)]], [], 0
    while waiting:
        box = waiting.pop()
        X = [library.make(*ends) for ends in box]
        F = X[0] * X[0] + X[1] * X[1] - Q, X[0] * X[0] * ALPHA + X[1] * X[1] * BETA - 1.0
        if any(lo > 0.0 or hi < 0.0 for lo, hi in map(library.ends, F)):
            continue
        step = krawczyk(library, X)
        if step is not None:
            K, inside = step
            box = [(max(a, k), min(b, m)) for (a, b), (k, m) in zip(box, K)]
            if any(lo > hi for lo, hi in box):
                continue
            if inside:
                kept.append(box)
                proved += 1
                continue
        side = max((0, 1), key=lambda i: box[i][1] - box[i][0])
        lo, hi = box[side]
        if hi - lo <= TOLERANCE:
            kept.append(box)
            continue
        halves = (lo, 0.5 * (lo + hi)), (0.5 * (lo + hi), hi)
        waiting += [[half if i == side else box[i] for i in range(2)] for half in halves]
    return kept, proved


def shortest(run, seconds):
    """Least time of some runs, at least two."""
    times, end = [], time.perf_counter() + seconds
    while len(times) < 2 or (time.perf_counter() < end and len(times) < 50):
        begin = time.perf_counter()
        run()
        times.append(time.perf_counter() - begin)
    return min(times)


def main(name, count, seconds):
    library = {"flint": Flint, "codac": Codac, "intvalpy": IntvalPy}[name]()
    rng = random.Random(1)
    pairs = [[(x, x + rng.uniform(0.0, 1e-3)) for x in (rng.uniform(0.5, 2.0) for _ in range(count))] for _ in range(2)]
    a, b = (library.column(p) for p in pairs)
    found = {key: shortest(run, seconds) / count for key, run in library.operations(a, b).items()}
    near = [library.make(r - 1e-3, r + 1e-3) for r in ROOT]
    assert krawczyk(library, near)[1]
    found["krawczyk"] = shortest(lambda: krawczyk(library, near), seconds)
    kept, proved = bisection(library)
    assert any(all(lo <= r <= hi for (lo, hi), r in zip(box, ROOT)) for box in kept)
    found["crossing"] = shortest(lambda: bisection(library), seconds)
    found["crossing, proved"] = proved
    if hasattr(library, "paving"):
        found["own paving"] = shortest(library.paving(), seconds)
    print(json.dumps(found))


if __name__ == "__main__":
    main(sys.argv[1], int(sys.argv[2]), float(sys.argv[3]))
