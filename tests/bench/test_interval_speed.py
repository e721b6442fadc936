"""How fast interval arithmetic and Krawczyk's test are, beside numpy, mpmath.iv, python-flint, IntvalPy and codac.

Run by the normal suite once each, without timing; with times: ``pytest tests/bench/test_interval_speed.py
--benchmark-enable -n0``. No time is asserted: machines differ. Ratios to the plain operation and peers on the same
operands are in the columns of extra information and in ``docs/explanation/intervals.md``; `test_other_libraries` prints
a table of ratios, each library in a process of its own (extra ``bench``).
"""

from __future__ import annotations

import importlib.util
import json
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

from graphsynth.intervals import Interval, Status, image, pave, sin

COUNT = 100_000
SMALL = 200
OPERATIONS = ["add", "subtract", "multiply", "divide", "square", "root"]
PLAIN = {
    "add": np.add, "subtract": np.subtract, "multiply": np.multiply, "divide": np.divide, "square": np.square,
    "root": np.sqrt,
}  # fmt: skip


def operands(count):
    rng = np.random.default_rng(1)
    lo, other = rng.uniform(0.5, 2.0, (2, count))
    return (lo, lo + rng.uniform(0.0, 1e-3, count)), (other, other + rng.uniform(0.0, 1e-3, count))


def shortest(run, rounds=7):
    times = []
    for _ in range(rounds):
        begin = time.perf_counter()
        run()
        times.append(time.perf_counter() - begin)
    return min(times)


def timed(benchmark, run, count, **others):
    """Run; note nanoseconds per interval and the ratio of each other way to this one."""
    result = benchmark.pedantic(run, rounds=15, warmup_rounds=2)
    if benchmark.stats:
        own = benchmark.stats.stats.min / count
        benchmark.extra_info["ns each"] = f"{own * 1e9:.3g}"
        for name, (other, size) in others.items():
            benchmark.extra_info[f"{name} / this"] = f"{shortest(other, 3 if size < count else 15) / size / own:.3g}"
    return result


def peers(name, a, b):
    """The same operation in mpmath.iv and python-flint, on part of the operands."""
    import mpmath

    found = {}
    unary = name in ("square", "root")
    methods = {"add": "__add__", "subtract": "__sub__", "multiply": "__mul__", "divide": "__truediv__"}
    left = [mpmath.iv.mpf([x, y]) for x, y in zip(a[0][:SMALL].tolist(), a[1][:SMALL].tolist())]
    right = [mpmath.iv.mpf([x, y]) for x, y in zip(b[0][:SMALL].tolist(), b[1][:SMALL].tolist())]

    def loop(xs, ys, root):
        if name == "root":
            return [root(x) for x in xs]
        if unary:
            return [x * x for x in xs]
        return [getattr(x, methods[name])(y) for x, y in zip(xs, ys)]

    found["mpmath.iv"] = (lambda: loop(left, right, mpmath.iv.sqrt), SMALL)
    try:
        import flint
    except ImportError:
        return found
    balls = [flint.arb((x + y) / 2, (y - x) / 2) for x, y in zip(a[0][:SMALL].tolist(), a[1][:SMALL].tolist())]
    more = [flint.arb((x + y) / 2, (y - x) / 2) for x, y in zip(b[0][:SMALL].tolist(), b[1][:SMALL].tolist())]
    found["flint"] = (lambda: loop(balls, more, lambda x: x.sqrt()), SMALL)
    return found


@pytest.mark.parametrize("name", OPERATIONS)
def test_operation(benchmark, name):
    from graphsynth.intervals.kernels import loops

    count = COUNT if benchmark.enabled else 500
    a, b = operands(count)
    arguments = a if name in ("square", "root") else (*a, *b)
    lo, hi = np.empty(count), np.empty(count)
    plain = [x[0] for x in ((a,) if len(arguments) == 2 else (a, b))]
    others = {"plain numpy": (lambda: PLAIN[name](*plain, out=np.empty(count)), count)}
    if benchmark.enabled:
        others |= peers(name, a, b)
    timed(benchmark, lambda: getattr(loops, name)(*arguments, lo, hi), count, **others)
    exact = PLAIN[name](*plain)
    assert (lo <= exact).all()
    assert (hi >= exact).all()


SINGLE = {
    "add": lambda x, y: x + y, "subtract": lambda x, y: x - y, "multiply": lambda x, y: x * y,
    "divide": lambda x, y: x / y, "square": lambda x, y: x.sqr(), "root": lambda x, y: x.sqrt(),
    "sin": lambda x, y: sin(x), "integer factor": lambda x, y: x * 3,
}  # fmt: skip


@pytest.mark.parametrize("name", SINGLE)
def test_one_interval(benchmark, name):
    """One operation on `Interval` objects of one interval each, a thousand times."""
    x, y, operation = Interval("0.1"), Interval("0.3", "0.4"), SINGLE[name]
    count = 1000 if benchmark.enabled else 1

    def run():
        for _ in range(count):
            found = operation(x, y)
        return found

    found = timed(benchmark, run, count)
    many = operation(Interval(["0.1"]), Interval(["0.3"], ["0.4"]))
    assert found.lo == many.lo[0] and found.hi == many.hi[0]


@pytest.mark.parametrize("width", [0.0, 1e-3])
@pytest.mark.parametrize("name", ["sin", "cos", "tan", "atan", "asin", "acos", "exp", "log"])
def test_function(benchmark, name, width):
    from graphsynth.intervals.kernels import loops

    count = 20_000 if benchmark.enabled else 500
    (lo, _), _ = operands(count)
    x = lo / 2.5
    low, high = np.empty(count), np.empty(count)
    others = {}
    if benchmark.enabled:
        import flint

        balls = [flint.arb(v) for v in x[:SMALL].tolist()]
        others["flint"] = (lambda: [getattr(v, name)() for v in balls], SMALL)
        numpy_name = {"atan": "arctan", "asin": "arcsin", "acos": "arccos"}.get(name, name)
        others["plain numpy"] = (lambda: getattr(np, numpy_name)(x), count)
    upper = x + width
    timed(benchmark, lambda: getattr(loops, name)(x, upper, low, high), count, **others)
    assert (low <= high).all()


def boxes(count):
    """Boxes around a root, so that no box is settled before the whole test is done."""
    rng = np.random.default_rng(2)
    root = np.array([0.6180339887498949, 0.7861513777574233])
    return root - rng.uniform(0.0, 0.02, (count, 2)), root + rng.uniform(0.0, 0.02, (count, 2))


def system(x):
    return [x[0] ** 2 + x[1] ** 2 - 1, x[0] - x[1] ** 2]


@pytest.mark.slow  # compiled for five seconds; statuses are checked in tests/intervals/test_compiled.py
def test_krawczyk_compiled(benchmark):
    """Two-dimensional boxes per second, one core, a compiled system."""
    from graphsynth.intervals.kernels import arithmetic as ia, krawczyk as compiled

    @compiled.system
    def equations(xl, xh, pl, ph, fl, fh, jl, jh, derivatives):
        ul, uh = ia.square(xl[0], xh[0])
        vl, vh = ia.square(xl[1], xh[1])
        sl, sh = ia.add(ul, uh, vl, vh)
        fl[0], fh[0] = ia.subtract(sl, sh, pl[0], ph[0])
        fl[1], fh[1] = ia.subtract(xl[0], xh[0], vl, vh)
        if derivatives:
            jl[0, 0], jh[0, 0] = ia.scale(2.0, xl[0], xh[0])
            jl[0, 1], jh[0, 1] = ia.scale(2.0, xl[1], xh[1])
            jl[1, 0], jh[1, 0] = 1.0, 1.0
            jl[1, 1], jh[1, 1] = ia.scale(-2.0, xl[1], xh[1])
        return True

    count = 200_000 if benchmark.enabled else 500
    lo, hi = boxes(count)
    out_lo, out_hi, status = np.empty_like(lo), np.empty_like(lo), np.empty(count, dtype=np.int8)
    one = np.array([1.0])
    timed(benchmark, lambda: compiled.krawczyk_boxes(equations, lo, hi, one, one, out_lo, out_hi, status), count)
    if benchmark.stats:
        benchmark.extra_info["boxes per second"] = f"{count / benchmark.stats.stats.min:.3g}"
    assert (status != Status.EMPTY).all()
    assert (status == Status.UNIQUE).mean() > 0.9


def flint_krawczyk(lo, hi):
    """The same test of one box in python-flint's balls."""
    import flint

    x = [flint.arb((a + b) / 2, (b - a) / 2 * (1 + 1e-15)) for a, b in zip(lo, hi)]
    z = [flint.arb(float(v.mid())) for v in x]
    F = [z[0] * z[0] + z[1] * z[1] - 1, z[0] - z[1] * z[1]]
    L = [[2 * x[0], 2 * x[1]], [flint.arb(1), -2 * x[1]]]
    Y = np.linalg.inv([[float(v.mid()) for v in row] for row in L])
    K = []
    for i in range(2):
        k = z[i] - (Y[i, 0] * F[0] + Y[i, 1] * F[1])
        for j in range(2):
            k += ((1.0 if i == j else 0.0) - (Y[i, 0] * L[0][j] + Y[i, 1] * L[1][j])) * (x[j] - z[j])
        K.append(k)
    return all(a.contains_interior(k) for a, k in zip(x, K))


def test_krawczyk_of_arrays(benchmark):
    """The general form: a system written with operators, automatic derivatives."""
    count = 100_000 if benchmark.enabled else 300
    X = Interval.from_bounds(*boxes(count))
    others = {}
    if benchmark.enabled:
        pairs = list(zip(X.lo[:SMALL].tolist(), X.hi[:SMALL].tolist()))
        others["flint"] = (lambda: [flint_krawczyk(lo, hi) for lo, hi in pairs], SMALL)
    result = timed(benchmark, lambda: image(system, X), count, **others)
    if benchmark.stats:
        benchmark.extra_info["boxes per second"] = f"{count / benchmark.stats.stats.min:.3g}"
    assert (result.status == Status.UNIQUE).mean() > 0.9


def test_paving(benchmark):
    f = lambda x: [sin(x[0] * 3) - x[1], x[0] ** 2 + x[1] ** 2 - 4]  # noqa: E731
    found = timed(benchmark, lambda: pave(f, ["[-3, 3]", "[-3, 3]"]), 1)
    assert found.finished
    assert (found.status == Status.UNIQUE).all()


# -- other libraries, each in its own process --------------------------------------------------------------------

PEERS = Path(__file__).with_name("interval_peers.py")
B = "17.4617879639289313590283215334"


def own_times(count, seconds):
    """The work of ``interval_peers.py`` done here; names of the peers' times to our ways and seconds."""
    import interval_peers as same

    from graphsynth.intervals import krawczyk, pave_compiled
    from graphsynth.intervals.kernels import arithmetic as ia, krawczyk as compiled, loops
    from graphsynth.jamming.intersection.boxes import krawczyk_boxes
    from graphsynth.jamming.intersection.hull import circle_ellipse

    @compiled.system
    def crossing(xl, xh, pl, ph, fl, fh, jl, jh, derivatives):
        ul, uh = ia.square(xl[0], xh[0])
        vl, vh = ia.square(xl[1], xh[1])
        sl, sh = ia.add(ul, uh, vl, vh)
        fl[0], fh[0] = ia.subtract(sl, sh, pl[0], ph[0])
        al, ah = ia.multiply(ul, uh, pl[2], ph[2])
        bl, bh = ia.multiply(vl, vh, pl[3], ph[3])
        sl, sh = ia.add(al, ah, bl, bh)
        fl[1], fh[1] = ia.subtract(sl, sh, pl[1], ph[1])
        if derivatives:
            jl[0, 0], jh[0, 0] = 2.0 * xl[0], 2.0 * xh[0]
            jl[0, 1], jh[0, 1] = 2.0 * xl[1], 2.0 * xh[1]
            jl[1, 0], jh[1, 0] = ia.multiply(2.0 * xl[0], 2.0 * xh[0], pl[2], ph[2])
            jl[1, 1], jh[1, 1] = ia.multiply(2.0 * xl[1], 2.0 * xh[1], pl[3], ph[3])
        return True

    p = Interval.stack([Interval("306.25"), Interval(1), 1 / Interval("17.53").sqr(), 1 / Interval(B).sqr()])
    general = lambda x, p: [x[0] ** 2 + x[1] ** 2 - p[0], x[0] ** 2 * p[2] + x[1] ** 2 * p[3] - p[1]]  # noqa: E731
    a, b = operands(count)
    lo, hi = np.empty(count), np.empty(count)
    near = Interval(np.array(same.ROOT) - 1e-3, np.array(same.ROOT) + 1e-3)
    many = max(count // 10, 2)
    low, high = np.tile(near.lo, (many, 1)), np.tile(near.hi, (many, 1))
    out_lo, out_hi, status = np.empty_like(low), np.empty_like(low), np.empty(many, dtype=np.int8)
    boxes = Interval.from_bounds(low, high)
    pl, ph = p.lo.copy(), p.hi.copy()
    quadrant = Interval([0.0, 0.0], [same.SIDE, same.SIDE])
    problem = circle_ellipse("17.5", "17.53", B, eps="0")
    rows = [
        ("add", "kernel", lambda: loops.add(*a, *b, lo, hi), count),
        ("multiply", "kernel", lambda: loops.multiply(*a, *b, lo, hi), count),
        ("sin", "kernel", lambda: loops.sin(*a, lo, hi), count),
        ("krawczyk", "kernel", lambda: compiled.krawczyk_boxes(
            crossing, low, high, pl, ph, out_lo, out_hi, status), many),
        ("krawczyk", "image of many boxes", lambda: image(general, boxes, p), many),
        ("krawczyk", "krawczyk, one box", lambda: krawczyk(general, near, p), 1),
        ("crossing", "krawczyk_boxes", lambda: krawczyk_boxes(problem), 1),
        ("crossing", "pave_compiled", lambda: pave_compiled(crossing, quadrant, p), 1),
        ("crossing", "pave", lambda: pave(general, quadrant, p), 1),
    ]  # fmt: skip
    times = [(work, way, same.shortest(run, seconds) / size) for work, way, run, size in rows]
    assert (status == Status.UNIQUE).all()
    assert pave_compiled(crossing, quadrant, p).solutions == 1
    return times


@pytest.mark.slow
def test_other_libraries(benchmark, capsys, monkeypatch):
    """Equal work in each library; ``--benchmark-enable -n 0`` prints times and ratios.  Without, python-flint only."""
    monkeypatch.syspath_prepend(str(PEERS.parent))
    count, seconds = (COUNT, 1.0) if benchmark.enabled else (200, 0.0)
    names = ("flint", "intvalpy", "codac") if benchmark.enabled else ("flint",)
    peers = {}
    for name in names:
        if importlib.util.find_spec(name) is not None:
            command = [sys.executable, "-W", "ignore", str(PEERS), name, str(count), str(seconds)]
            done = subprocess.run(command, capture_output=True, text=True, timeout=600)
            assert done.returncode == 0, done.stderr
            peers[name] = json.loads(done.stdout)
            assert peers[name]["crossing, proved"] == 1
    if not peers:
        pytest.skip("none of python-flint, IntvalPy and codac is installed (extra bench)")
    own = benchmark.pedantic(lambda: own_times(count, seconds), rounds=1)
    if benchmark.enabled:
        with capsys.disabled():
            print(f"\n{'work':<10}{'way':<22}{'here, us':>10}" + "".join(f"{name + ' / here':>18}" for name in peers))
            for work, way, time_here in own:
                ratios = "".join(f"{found[work] / time_here:>18.3g}" for found in peers.values())
                print(f"{work:<10}{way:<22}{time_here * 1e6:>10.3g}{ratios}")
            if "codac" in peers:
                print(f"codac's own paving, without proof of existence: {peers['codac']['own paving'] * 1e6:.0f} us")
