"""Pavings: nothing is lost, hulls of the specification, budgets, stopping and resuming."""

from fractions import Fraction
from itertools import pairwise

import numpy as np
import pytest

from graphsynth.core.errors import FormatError, IntervalError
from graphsynth.intervals import Interval, Search, Status, cos, krawczyk, pave, sin, sqrt

B_90 = "17.4617879639289313590283215334"


def circle_and_ellipse(x, p):
    """The deck's system with parameters R1^2, right-hand side of the ellipse, a, b."""
    return [x[0] ** 2 + x[1] ** 2 - p[0], (x[0] / p[2]) ** 2 + (x[1] / p[3]) ** 2 - p[1]]


def deck(e1, e2):
    return Interval([f"306.25 +- {e1}", f"1 +- {e2}", "17.53", B_90])


# eps, x_lo, x_hi, y_lo, y_hi of theory/values-of-bearings 5
HULLS = [
    ("0", "13.11490802879096276551727", "13.11490802879096276551727",
     "11.58659515976778845911871", "11.58659515976778845911871"),
    ("1e-12", "13.11490802728940913618112", "13.11490803029251639468150",
     "11.58659515806821775022441", "11.58659516146735916776371"),
    ("1e-9", "13.11490652723724755728604", "13.11490953034450605768957",
     "11.58659346019695503934472", "11.58659685933837257868377"),
    ("1e-6", "13.11340638919384018378296", "13.11640949647202360219709",
     "11.58489546439062678637722", "11.58829460584473449768323"),
    ("1e-3", "11.51587326726977120518672", "14.53912955095568154052795",
     "9.739851739145069863547885", "13.17701266950068029306394"),
]  # fmt: skip


def exact_hull(r, e1, a, b, e2):
    """Closed form in intervals (theory/circle-and-ellipse 7), unclipped; the corners are monotone in every argument."""
    down, up = (Interval(a).sqr() - Interval(b).sqr()), Interval(1)
    u = [a.sqr() * (r.sqr() + s * e1 - b.sqr() * (up - s * e2)) / down for s in (-1, 1)]
    v = [b.sqr() * (a.sqr() * (up - s * e2) - r.sqr() - s * e1) / down for s in (-1, 1)]
    return sqrt(u[0]).hull(sqrt(u[1])), sqrt(v[0]).hull(sqrt(v[1]))


@pytest.mark.parametrize("row", HULLS, ids=lambda row: row[0])
def test_closed_form_gives_the_hulls_of_the_specification(row):
    eps, *ends = row
    x, y = exact_hull(Interval("17.5"), Interval(eps), Interval("17.53"), Interval(B_90), Interval(eps))
    for got, lo, hi in ((x, *ends[:2]), (y, *ends[2:])):
        assert abs(float(got.lo) - float(lo)) < 3e-10
        assert abs(float(got.hi) - float(hi)) < 3e-10
        assert float(got.lo) <= float(lo) * (1 + 1e-15)
        assert float(got.hi) >= float(hi) * (1 - 1e-15)


@pytest.mark.parametrize("row", HULLS[:4], ids=lambda row: row[0])
def test_subdivided_krawczyk_encloses_the_hulls_of_the_specification(row):
    """Up to eps = 1e-6 the test succeeds in (x, y), where rho on the hull is below 1/4 (theory/interval-tests 3)."""
    eps, *ends = row
    found = pave(circle_and_ellipse, ["[0, 18]", "[0, 18]"], deck(eps, eps))
    assert found.finished
    assert found.verdict is Status.UNIQUE
    box = found.boxes[0]
    for i in (0, 1):
        lo, hi = Fraction(ends[2 * i]), Fraction(ends[2 * i + 1])
        unit = Fraction(1, 10**22)  # the reference is printed with 25 digits
        assert Fraction(float(box.lo[i])) <= lo + unit
        assert Fraction(float(box.hi[i])) >= hi - unit
        assert float(box.width[i]) <= float(hi - lo) * 1.2 + 1e-9


def test_different_tolerances_of_the_specification():
    x, y = exact_hull(Interval("17.5"), Interval("1e-3"), Interval("17.53"), Interval(B_90), Interval("1e-6"))
    for got, lo, hi in (
        (x, "13.10850140189148743244032", "13.12131152758367451247872"),
        (y, "11.57938615800076761795533", "11.59379967899259973598900"),
    ):
        assert got.contains(Fraction(lo))
        assert got.contains(Fraction(hi))
        assert float(got.width) - float(Fraction(hi) - Fraction(lo)) < 1e-9


def test_tangent_curves_are_undecided_and_enclosed():
    """R1 = a: a double point on the axis y = 0; R1 above a: nothing (theory/extreme-cases 1)."""
    p = Interval([Fraction("17.53") ** 2, 1, "17.53", B_90])
    found = pave(circle_and_ellipse, ["[0, 18]", "[0, 18]"], p, tolerance=1e-4)
    assert found.finished
    assert found.verdict is Status.UNDECIDED
    assert found.outer.contains(np.array([17.53, 0.0])).all()
    assert float(found.outer.lo[0]) > 17.4
    apart = Interval(["307.6", 1, "17.53", B_90])
    assert pave(circle_and_ellipse, ["[0, 18]", "[0, 18]"], apart).verdict is Status.EMPTY


def test_where_the_textbook_method_cannot_certify():
    """theory/interval-tests 3: rho is 0.67 at eps = 1e-5, above 1/4; an honest 'undecided'."""
    result = krawczyk(circle_and_ellipse, ["[13.08, 13.15]", "[11.55, 11.62]"], deck("1e-5", "1e-5"))
    assert result.status is Status.UNDECIDED
    assert result.spectral_radius > 0.25


def test_whole_quadrant_of_the_deck():
    found = pave(circle_and_ellipse, ["[0, 18]", "[0, 18]"], deck("0", "0"))
    assert found.finished
    assert found.verdict is Status.UNIQUE
    assert found.boxes[0, 0].contains(Fraction(HULLS[0][1])) or float(found.boxes.width.max()) < 1e-9
    assert abs(float(found.boxes.mid[0, 0]) - 13.114908028790963) < 1e-9
    # all four mirror images from the full square, one box each
    square = pave(circle_and_ellipse, ["[-18, 18]", "[-18, 18.5]"], deck("0", "0"))
    assert square.finished
    assert square.status.tolist() == [Status.UNIQUE] * 4
    assert sorted(np.sign(square.boxes.mid).tolist()) == [[-1, -1], [-1, 1], [1, -1], [1, 1]]


THICK = Interval(["256 +- 4", "1 +- 0.02", 20, 12])


def test_inner_and_outer_paving_of_a_thick_solution_set():
    """Set-valued solutions: the exact hull lies between the inner and the outer paving."""
    e1, e2, a, r, b = "4", "0.02", 20, 16, 12
    found = pave(circle_and_ellipse, ["[0, 20]", "[0, 20]"], THICK, inner=[0, 1], tolerance=5e-4, max_boxes=60_000)
    assert found.finished
    assert found.verdict is Status.UNDECIDED
    x, y = exact_hull(Interval(r), Interval(e1), Interval(a), Interval(b), Interval(e2))
    for i, hull in enumerate((x, y)):
        outer, inside = found.outer[i], found.inside[i]
        assert inside.subset(hull.inflate(1e-12))
        assert hull.subset(outer.inflate(1e-12))
        assert float(outer.width) < float(hull.width) + 0.2
        assert float(inside.width) > float(hull.width) - 0.4
    # every corner of an inner box is a solution for some right-hand side, exactly
    inner = found.boxes[found.inner]
    assert len(inner) > 100
    for k in range(0, len(inner), 7):
        for u in (Fraction(float(inner.lo[k, 0])) ** 2, Fraction(float(inner.hi[k, 0])) ** 2):
            for v in (Fraction(float(inner.lo[k, 1])) ** 2, Fraction(float(inner.hi[k, 1])) ** 2):
                assert abs(u + v - r * r) <= Fraction(e1)
                assert abs(u / a**2 + v / b**2 - 1) <= Fraction(e2)


ENDS = [("0.57238052947636083", "0.66189500386222506"), ("0.75655834505764381", "0.81356929854610255")]


def test_second_problem_with_tolerance():
    f = lambda x, p: [x[0] ** 2 + x[1] ** 2 - 1 - p[0], x[0] - x[1] ** 2]  # noqa: E731
    result = krawczyk(f, ["[0.5, 0.75]", "[0.7, 0.9]"], ["[-0.1, 0.1]"], rounds=40)
    assert result.status is Status.UNIQUE
    for i, (lo, hi) in enumerate(
        [("0.5723805294763608", "0.6618950038622251"), ("0.7565583450576439", "0.8135692985461025")]
    ):
        assert float(result.box.lo[i]) <= float(lo)
        assert float(result.box.hi[i]) >= float(hi)
        assert float(result.box.width[i]) < 2.0 * (float(hi) - float(lo))


def test_every_root_of_a_polynomial_and_of_a_wave():
    roots = [Fraction(k, 4) for k in (-9, -4, 0, 1, 8, 12)]

    def f(x):
        product = x[0] - roots[0]
        for r in roots[1:]:
            product = product * (x[0] - r)
        return [product]

    found = pave(f, ["[-4, 4]"])
    assert found.finished
    assert found.status.tolist() == [Status.UNIQUE] * 6
    order = np.argsort(found.boxes.lo[:, 0])
    assert all(found.boxes[k][0].contains(r) for k, r in zip(order, roots))
    waves = pave(lambda x: [sin(x[0] * 3) - cos(x[1]), x[0] + x[1] - 1], ["[-3, 3]", "[-3, 3]"], tolerance=1e-8)
    assert waves.finished
    assert (waves.status == Status.UNIQUE).all()
    # sin 3x = cos(1 - x) = sin(pi/2 - 1 + x): 2x = c + 2k pi or 4x = pi - c + 2k pi, c = pi/2 - 1
    c = np.pi / 2 - 1
    candidates = [*(c / 2 + k * np.pi for k in range(-3, 4)), *((np.pi - c) / 4 + k * np.pi / 2 for k in range(-5, 6))]
    expected = sorted(t for t in candidates if -2.0 < t < 3.0)
    assert np.allclose(sorted(waves.boxes.mid[:, 0]), expected, atol=1e-9)


def test_solutions_on_cuts_and_faces_are_found_once():
    """Roots at the centre of the box, where every cut passes, and on its border."""
    found = pave(lambda x: [x[0] + x[1], x[0] - 2 * x[1]], ["[-1, 1]", "[-1, 1]"])
    assert found.status.tolist() == [Status.UNIQUE]
    three = pave(lambda x: [x[0] * (x[0] - 1) * (x[0] + 1), x[1] - x[0]], ["[-2, 2]", "[-2, 2]"])
    assert three.status.tolist() == [Status.UNIQUE] * 3
    border = pave(lambda x: [x[0] ** 2 - 1], ["[1, 3]"])
    assert len(border.status) >= 1
    assert border.boxes[0, 0].contains(1)


def test_boxes_that_only_hold_a_solution_are_sharpened():
    """The first halves of [-2, 2] have images equal to themselves: existence; their halves meet at the roots."""
    roots = pave(lambda x: [x[0] ** 2 - 1], ["[-2, 2]"])
    assert roots.status.tolist() == [Status.UNIQUE] * 2
    assert roots.solutions == 2
    many = pave(lambda x: [abs(x[0]) - x[0]], ["[-1, 2]"])  # every point from 0 on: existence is all there is
    assert many.verdict is Status.EXISTS
    assert many.solutions is None
    triple = pave(lambda x: [x[0] ** 3], ["[-1, 1]"])
    assert triple.verdict is Status.EXISTS


def test_no_solution_and_multiple_solutions():
    assert pave(lambda x: [x[0] ** 2 + x[1] ** 2 + 1, x[0]], ["[-9, 9]", "[-9, 9]"]).verdict is Status.EMPTY
    double = pave(lambda x: [(x[0] - 1) ** 2], ["[0, 3]"], tolerance=1e-6)
    assert double.finished
    assert double.verdict is Status.UNDECIDED
    assert double.outer.contains(np.array([1.0])).all()
    assert float(double.outer.width[0]) < 1e-4
    line = pave(lambda x: [x[0] - x[1], (x[0] - x[1]) * 2], ["[0, 1]", "[0, 1]"], tolerance=0.05, max_boxes=5000)
    assert not line.verdict.proves_existence


def test_exhausted_budget_keeps_every_solution():
    f = lambda x: [sin(x[0] * 40) * x[1], x[1] - x[0] ** 2 - "0.1"]  # noqa: E731
    box = ["[-2.05, 2]", "[-1, 5]"]
    full = pave(f, box, max_seconds=100)
    assert full.finished
    assert full.status.tolist() == [Status.UNIQUE] * 52  # sin 40 x = 0: x = k pi / 40, k from -26 to 25
    short = pave(f, box, max_boxes=60)
    assert not short.finished
    assert (short.status == Status.UNDECIDED).any()
    for k in range(len(full.status)):
        middle = full.boxes.mid[k]
        assert short.boxes.contains(np.broadcast_to(middle, short.boxes.shape)).all(axis=1).any()
    assert pave(f, box, max_seconds=1e-9).tested > 0


def same(a, b):
    return (
        (a.boxes.lo == b.boxes.lo).all() and (a.boxes.hi == b.boxes.hi).all() and (a.status == b.status).all()
        and (a.inner == b.inner).all() and (a.domains.lo == b.domains.lo).all() and a.tested == b.tested
    )  # fmt: skip


def test_stopping_saving_and_resuming_changes_nothing(tmp_path):
    options = {"tolerance": 2e-2, "inner": [0, 1], "batch": 64, "max_boxes": 6000}
    make = lambda: Search(circle_and_ellipse, ["[0, 20]", "[0, 20]"], THICK, **options)  # noqa: E731
    whole = make()
    steps = list(whole)
    assert steps[-1].tested == whole.tested
    first = make()
    for count, _ in enumerate(first):
        if count == 7:
            break
    first.save(tmp_path / "state.npz")
    second = make().load(tmp_path / "state.npz")
    assert second.tested == first.tested
    for _ in second:
        pass
    assert same(whole.paving(), second.paving())
    again = make()
    assert sum(1 for _ in again) == len(steps)
    assert same(again.paving(), whole.paving())


def test_bad_states_and_arguments(tmp_path):
    f = lambda x: [x[0] - "0.3"]  # noqa: E731
    search = Search(f, ["[0, 1]"])
    search.save(tmp_path / "a.npz")
    with pytest.raises(FormatError, match="another box"):
        Search(f, ["[0, 2]"]).load(tmp_path / "a.npz")
    (tmp_path / "b.npz").write_bytes(b"no archive")
    with pytest.raises(FormatError, match="not a saved search"):
        search.load(tmp_path / "b.npz")
    np.savez(tmp_path / "c.npz", meta=np.array([1, 2], dtype=object))
    with pytest.raises(FormatError, match="not a saved search"):
        search.load(tmp_path / "c.npz")
    for options in (
        {"tolerance": 0.0},
        {"max_boxes": 0},
        {"max_seconds": -1.0},
        {"tolerance": [-1.0]},
        {"tolerance": [1.0, 1.0]},
        {"inner": [0]},
    ):
        with pytest.raises(IntervalError):
            Search(f, ["[0, 1]"], **options)
    with pytest.raises(IntervalError, match="bounded"):
        Search(f, Interval.entire(1))


def test_progress_is_reported():
    seen = list(Search(lambda x: [sin(x[0] * 20)], ["[0.1, 9]"]))
    assert seen[-1].waiting == 0
    assert seen[-1].kept == 57  # multiples of pi/20 in [0.1, 9]
    assert all(a.tested < b.tested for a, b in pairwise(seen))
