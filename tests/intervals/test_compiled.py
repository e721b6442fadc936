"""Compiled systems: the test beside the general one, and the search with inflation, budgets and parameters."""

import math
from functools import cache

import numpy as np
import pytest

from graphsynth.core.errors import IntervalError
from graphsynth.intervals import Interval, Status, compiled_system, image, pave, pave_cells, pave_compiled
from graphsynth.intervals.kernels import arithmetic as ia

pytestmark = pytest.mark.long  # numba compiles each system for seconds
ROOT = np.array([0.6180339887498949, 0.7861513777574233])
MIRROR = ROOT * [1.0, -1.0]


def on_first_use(function):
    """Compile a system when it is asked for: a worker that only collects this file compiles nothing."""
    return cache(lambda: compiled_system(function))


def general(x, p):
    return [x[0] ** 2 + x[1] ** 2 - p[0], x[0] - x[1] ** 2]


@on_first_use
def circle_and_parabola(xl, xh, pl, ph, fl, fh, jl, jh, derivatives):
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


@on_first_use
def roots_of_a_parameter(xl, xh, pl, ph, fl, fh, jl, jh, derivatives):
    """``x^2 = p``."""
    low, high = ia.square(xl[0], xh[0])
    fl[0], fh[0] = ia.subtract(low, high, pl[0], ph[0])
    if derivatives:
        jl[0, 0], jh[0, 0] = ia.scale(2.0, xl[0], xh[0])
    return True


def test_the_compiled_test_agrees_with_the_general_one():
    from graphsynth.intervals.kernels.krawczyk import krawczyk_boxes

    rng = np.random.default_rng(3)
    lo = np.concatenate([rng.uniform(-1.5, 1.0, (1500, 2)), ROOT - rng.uniform(0.0, 0.02, (1500, 2))])
    hi = lo + rng.uniform(0.0, 0.06, (3000, 2))
    out_lo, out_hi, status = np.empty_like(lo), np.empty_like(lo), np.empty(3000, dtype=np.int8)
    one = np.array([1.0])
    krawczyk_boxes(circle_and_parabola(), lo, hi, one, one, out_lo, out_hi, status)
    reference = image(general, Interval.from_bounds(lo, hi), Interval([1]))
    assert (status == reference.status).mean() > 0.999
    has_root = ((lo <= ROOT - 1e-15) & (hi >= ROOT + 1e-15)).all(axis=1)
    has_mirror = ((lo <= MIRROR - 1e-15) & (hi >= MIRROR + 1e-15)).all(axis=1)
    close = [((lo <= r + 1e-15) & (hi >= r - 1e-15)).all(axis=1) for r in (ROOT, MIRROR)]
    assert (close[0] | close[1])[status == Status.UNIQUE].all()
    assert not (has_root & has_mirror & (status == Status.UNIQUE)).any()
    assert not (has_root & (status == Status.EMPTY)).any()
    assert (out_lo[has_root] <= ROOT).all()
    assert (out_hi[has_root] >= ROOT).all()
    empty = status == Status.EMPTY
    assert (out_lo[empty] == math.inf).all()
    assert (out_hi[empty] == -math.inf).all()


def found_roots(paving, roots):
    """Every root in a box; every proof about one root."""
    for root in roots:
        near = ((paving.boxes.lo <= root + 1e-15) & (paving.boxes.hi >= root - 1e-15)).all(axis=1)
        assert near.sum() == 1
    assert len(paving.status) == len(roots)


def test_all_solutions_are_found_and_proved():
    found = pave_compiled(circle_and_parabola(), ["[-2, 2]", "[-2.1, 2]"], [1])
    assert found.finished
    assert (found.status == Status.UNIQUE).all()
    assert found.solutions == 2
    assert found.boxes.width.max() < 1e-14
    found_roots(found, (ROOT, MIRROR))
    assert found.boxes.subset(found.domains).all()


@pytest.mark.parametrize("shift", [0.0, 1e-16, -1e-9])
def test_solutions_on_cuts_need_inflation(shift):
    """The first cut goes through a root: without inflation it stays undecided in both halves."""
    half = np.array([1.0, 0.5])
    box = Interval(ROOT - half + shift, ROOT + half)
    found = pave_compiled(circle_and_parabola(), box, [1])
    assert [Status(s) for s in found.status] == [Status.UNIQUE]
    found_roots(found, [ROOT])
    corner = pave_compiled(roots_of_a_parameter(), ["[2, 5]"], [4])  # a root on the face proves nothing about the box
    assert corner.verdict in (Status.UNDECIDED, Status.UNIQUE)
    assert (corner.boxes.lo <= 2.0).any()
    outside = pave_compiled(roots_of_a_parameter(), Interval([2.0 + 1e-12], [5.0]), [4])
    assert outside.verdict is Status.EMPTY


def test_statuses_against_known_roots():
    """Random boxes and radicands: never a wrong count, seldom undecided."""
    rng = np.random.default_rng(12)
    undecided = 0
    for _ in range(200):
        p = float(np.ldexp(rng.random(), int(rng.integers(-20, 20))))
        lo, hi = np.sort(rng.normal(size=2) * 2.0 * math.sqrt(p))
        found = pave_compiled(roots_of_a_parameter(), Interval([lo], [hi]), Interval([p], [p]))
        true = sum(lo < r < hi for r in (math.sqrt(p), -math.sqrt(p)))
        if found.solutions is None:
            undecided += 1
        else:
            assert found.solutions == true
        assert (found.verdict is Status.EMPTY) == (true == 0)
    assert undecided <= 2


def test_double_and_missing_solutions():
    double = pave_compiled(roots_of_a_parameter(), ["[-1, 1]"], [0])
    assert double.verdict is Status.UNDECIDED
    assert double.outer.contains(0.0).all()
    assert pave_compiled(roots_of_a_parameter(), ["[-1, 1]"], ["[-2, -1e-9]"]).verdict is Status.EMPTY
    thick = pave_compiled(roots_of_a_parameter(), ["[-1, 3]"], ["[-0.5, 4]"], tolerance=1e-3)
    assert thick.verdict is Status.UNDECIDED
    for p in np.linspace(0.0, 4.0, 33):
        x = math.sqrt(p)
        assert ((thick.boxes.lo <= x + 1e-15) & (thick.boxes.hi >= x - 1e-15)).any()


def test_exhausted_budgets_keep_every_solution():
    for budget in (1, 4, 9, 20):
        found = pave_compiled(circle_and_parabola(), ["[-2, 2]", "[-2.1, 2]"], [1], max_boxes=budget)
        assert not found.finished
        assert found.verdict in (Status.UNDECIDED, Status.EXISTS)
        for root in (ROOT, MIRROR):
            inside = ((found.boxes.lo <= root) & (found.boxes.hi >= root)).all(axis=1)
            assert inside.any() or (found.boxes.width[found.status == Status.UNIQUE] < 1e-14).any()
        assert found.solutions is None
    thick = pave_compiled(roots_of_a_parameter(), ["[0, 3]"], ["[0, 4]"], tolerance=1e-8, max_seconds=1e-6)
    assert not thick.finished
    assert thick.tested >= 100_000  # many more boxes than the arrays had room for at first
    assert thick.outer.lo[0] <= 0.0
    assert thick.outer.hi[0] >= 2.0


@pytest.mark.parametrize(
    ("box", "options", "word"),
    [
        (["[1, 2]", "[empty]"], {}, "finite bounds"),
        ("[1, 2]", {}, "shape"),
        (["[1, 2]", "[1, 2]"], {"tolerance": 0.0}, "tolerance"),
        (["[1, 2]", "[1, 2]"], {"max_boxes": 0}, "max_boxes"),
        (["[1, 2]", "[1, 2]"], {"max_seconds": float("nan")}, "max_seconds"),
        (["[1, 2]", "[1, 2]"], {"tolerance": [1.0]}, "tolerance"),
    ],
)
def test_bad_questions(box, options, word):
    with pytest.raises(IntervalError, match=word):
        pave_compiled(circle_and_parabola(), box, [1], **options)


# -- parameters cut into cells ---------------------------------------------------------------------------------


@pytest.mark.parametrize("system", [lambda: general, circle_and_parabola], ids=["general", "compiled"])
def test_wide_parameters_are_cut(system):
    f = system()
    box, wide = ["[0.1, 3]", "[0.1, 3]"], ["[0.5, 4]"]
    whole = pave(f, box, wide, tolerance=0.01) if f is general else pave_compiled(f, box, wide, tolerance=0.01)
    assert whole.verdict is Status.UNDECIDED
    found = pave_cells(f, box, wide)
    assert found.verdict is Status.UNIQUE
    assert found.solutions == 1
    assert found.finished
    assert len(found.undecided) == 0
    assert len(found.cells) > 1
    for p in np.linspace(0.5, 4.0, 29):  # x^2 + x = p
        x = 0.5 * (math.sqrt(1.0 + 4.0 * p) - 1.0)
        cells = np.flatnonzero((found.cells.lo[:, 0] <= p) & (p <= found.cells.hi[:, 0]))
        assert len(cells)
        point = np.array([x, math.sqrt(x)])
        for k in cells:
            boxes = found.pavings[k].boxes
            assert ((boxes.lo <= point + 1e-15) & (boxes.hi >= point - 1e-15)).all(axis=1).any()
    assert found.outer.contains(np.array([1.0, 1.0])).all()  # at p = 2


def test_cells_leave_an_undecided_one_where_solutions_meet():
    found = pave_cells(roots_of_a_parameter(), ["[-3, 3]"], ["[-1, 4]"], smallest=0.01)
    assert found.verdict is Status.UNDECIDED
    assert found.solutions is None
    assert not found.finished
    assert found.undecided.contains(np.zeros(found.undecided.shape)).any()
    assert found.undecided.width.sum() < 0.2
    counts = {(p.solutions, bool(c.hi[0] < 0)) for c, p in zip(found.cells, found.pavings) if p.solutions is not None}
    assert counts == {(0, True), (2, False)}


def test_an_exhausted_budget_of_cells_still_covers():
    found = pave_cells(general, ["[0.1, 3]", "[0.1, 3]"], ["[0.5, 4]"], max_boxes=30)
    assert not found.finished
    assert found.cells.lo.min() == 0.5
    assert found.cells.hi.max() == 4.0
    assert found.outer.contains(np.array([1.0, 1.0])).all()
    with pytest.raises(IntervalError, match="finite bounds"):
        pave_cells(general, ["[0, 1]", "[0, 1]"], "[0, 1]")
    with pytest.raises(IntervalError, match="smallest"):
        pave_cells(general, ["[0, 1]", "[0, 1]"], ["[0, 1]"], smallest=0)
