"""`probability_of_jamming` against closed forms with 50 digits, quadrature, and random members."""

from time import process_time

import mpmath
import numpy as np
import pytest

import graphsynth as gs
from graphsynth.core.errors import GeometryError
from graphsynth.intervals import Dual, Interval, minimum
from graphsynth.jamming import CommonFactor, Distribution, ToleranceBox, certify_jamming, probability_of_jamming
from graphsynth.jamming.chance.distributions import Distribution as D
from graphsynth.jamming.chance.margin import BearingMargin
from graphsynth.jamming.chance.paving import _contracted, affine
from graphsynth.jamming.chance.probability import ChanceProblem

TEN = ToleranceBox(
    l1="2 +- 0.02",
    l2="1 +- 0.01",
    l3="2.5 +- 0.025",
    l4="2.5 +- 0.025",
    alpha="0.0145 +- 0.0002",
    axis=(1, "0 +- 0.02", "0 +- 0.02"),
    Rb="17.5 +- 0.005",
    Hb="10 +- 0.05",
    clearance="0.03 +- 0.003",
)
ONE = ToleranceBox(alpha="0.0145", clearance="0.03 +- 0.003")


def need(alpha="0.0145", Hb="10", l2="1", l3="2.5", Rb="17.5"):  # type: ignore[no-untyped-def]
    """Least clearance for the full rotation under condition A, tilt axis in the plane; 50 digits."""
    alpha, Hb, l2, l3, Rb = (mpmath.mpf(value) for value in (alpha, Hb, l2, l3, Rb))
    S = l2 / l3 * mpmath.sin(alpha)
    return Hb / 2 * S - Rb * S * S / (1 + mpmath.sqrt(1 - S * S))


def test_one_quantity_has_a_closed_form_for_every_distribution() -> None:
    with mpmath.workdps(50):
        v = (need() - mpmath.mpf("0.027")) / mpmath.mpf("0.006")
        normal = (mpmath.ncdf(6 * v - 3) - mpmath.ncdf(-3)) / (1 - 2 * mpmath.ncdf(-3))
        cases = [
            (D.uniform("0.03 +- 0.003"), v),
            (D.normal("0.03 +- 0.003"), normal),
            (D.triangular("0.03 +- 0.003"), 2 * v * v),
            (D.beta("0.03 +- 0.003", 2, "3.5"), mpmath.betainc(2, mpmath.mpf("3.5"), 0, v, regularized=True)),
            (D.histogram(["0.027", "0.0285", "0.033"], [1, 3]), mpmath.mpf(1) / 4 + (v - 0.25)),
        ]
        for distribution, exact in cases:
            found = probability_of_jamming(ONE, {"clearance": distribution})
            assert found.lower <= exact <= found.upper
            assert found.upper - found.lower < 3e-13


def test_two_quantities_linear() -> None:
    """Clearance and height: the margin is linear in both, and the set that binds a trapezoid."""
    with mpmath.workdps(50):
        ends = [(need(Hb=h) - mpmath.mpf("0.027")) / mpmath.mpf("0.006") for h in ("9.95", "10.05")]
        assert all(0 < v < 1 for v in ends)
        found = probability_of_jamming(ONE.replace(Hb="10 +- 0.05"), width=1e-6, ratio=1.00001)
        assert found.lower <= sum(ends) / 2 <= found.upper
        assert found.upper - found.lower <= 1e-6


@pytest.mark.long
@pytest.mark.parametrize("normal", [False, True])
def test_two_quantities_curved(normal: bool) -> None:
    """Clearance and tilt of the motor axis, against quadrature with 30 digits."""
    with mpmath.workdps(30):

        def given(alpha):  # type: ignore[no-untyped-def]
            v = (need(alpha) - mpmath.mpf("0.027")) / mpmath.mpf("0.006")
            v = min(max(v, mpmath.mpf(0)), mpmath.mpf(1))
            return (mpmath.ncdf(6 * v - 3) - mpmath.ncdf(-3)) / (1 - 2 * mpmath.ncdf(-3)) if normal else v

        low, high = mpmath.mpf("0.0140"), mpmath.mpf("0.0150")
        exact = mpmath.quad(given, mpmath.linspace(low, high, 5)) / (high - low)
        chosen = {"clearance": D.normal("0.03 +- 0.003")} if normal else {}
        found = probability_of_jamming(ONE.replace(alpha="0.0145 +- 0.0005"), chosen, width=2e-5)
        assert found.lower <= exact <= found.upper
        assert found.upper - found.lower <= 2e-5


def test_ten_quantities_and_random_members_agree() -> None:
    found = probability_of_jamming(TEN, width=1e-2, samples=100_000)
    assert found.upper - found.lower <= 1e-2 and not found.reason
    drawn = found.samples
    assert drawn is not None and drawn.lower <= found.upper and found.lower <= drawn.upper
    assert len(repr(found).splitlines()) <= 10 and "Proved" in repr(found) and "certified" in repr(found)
    assert len(found.to_pandas()) == 10 and found.summary()["lower"] == found.lower


def test_rare_binding_needs_few_boxes() -> None:
    found = probability_of_jamming(TEN.replace(alpha="0.01315 +- 0.0002"))
    assert found.lower > 1e-8 and found.upper < 3e-6 and found.upper <= 1.5 * found.lower
    assert found.boxes < 1000


def test_rare_binding_of_few_quantities_is_exact() -> None:
    """Near the corner the set that binds is a simplex but for the curvature: its volume against quadrature."""
    with mpmath.workdps(30):
        box = ONE.replace(Hb="10 +- 0.05", alpha="0.013465 +- 0.0001")

        def given(alpha):  # type: ignore[no-untyped-def]
            """Share of (clearance, height) that binds: a triangle at the corner."""
            excess = need(alpha, "10.05") - mpmath.mpf("0.027")
            if excess <= 0:
                return mpmath.mpf(0)
            S = mpmath.sin(alpha) / mpmath.mpf("2.5")
            return excess * excess / S / (mpmath.mpf("0.006") * mpmath.mpf("0.1"))

        edge = mpmath.findroot(lambda a: need(a, "10.05") - mpmath.mpf("0.027"), 0.0135)
        high = mpmath.mpf("0.013565")
        exact = mpmath.quad(given, [edge, high]) / mpmath.mpf("0.0002")
        found = probability_of_jamming(box, ratio=1.0001)
        assert exact < 1e-4 and found.lower <= exact <= found.upper <= 1.0001 * found.lower


def test_certain_cases_are_certain() -> None:
    free, bound = (ONE.replace(alpha=f"{alpha} +- 0.0001", l2="1 +- 0.001") for alpha in ("0.012", "0.02"))
    assert certify_jamming(free).verdict.is_free and certify_jamming(bound).verdict.name == "CERTIFIED_JAMMED"
    found = probability_of_jamming(free)
    assert (found.lower, found.upper) == (0.0, 0.0) and "no mechanism" in repr(found)
    assert probability_of_jamming(bound).lower > 1.0 - 1e-12
    point = probability_of_jamming(ToleranceBox(alpha="0.02"))
    assert (point.lower, point.upper) == (1.0, 1.0)


def test_common_factor_is_one_quantity_for_all() -> None:
    """Clearance and half the height grow together so that the margin keeps one quantity: a closed form."""
    warm = CommonFactor("temperature", D.uniform("[-20, 40]"), {"clearance": "-5e-5", "Rb": "2e-4"})
    found = probability_of_jamming(ToleranceBox(alpha="0.0145"), common=[warm])
    with mpmath.workdps(50):
        # clearance 0.03 - 5e-5 T, Rb 17.5 + 2e-4 T: binds where need(T) > clearance(T), one root in T
        edge = mpmath.findroot(
            lambda t: (
                need(Rb=mpmath.mpf("17.5") + mpmath.mpf("2e-4") * t) - (mpmath.mpf("0.03") - mpmath.mpf("5e-5") * t)
            ),
            (-19, 39),
            solver="anderson",
        )
        exact = (40 - edge) / 60
    assert 0 < exact < 1 and found.lower <= exact <= found.upper and found.upper - found.lower <= 1e-3
    mixed = probability_of_jamming(TEN.replace(axis=(1, 0, 0)), common=[warm], width=5e-3, samples=50_000)
    assert mixed.samples is not None and mixed.samples.lower <= mixed.upper and mixed.lower <= mixed.samples.upper


@pytest.mark.parametrize("condition", ["A", "B", "general"])
@pytest.mark.parametrize("rod", ["rigid", "deck"])
def test_margin_is_one_formula_in_floats_intervals_and_duals(condition, rod) -> None:  # type: ignore[no-untyped-def]
    box = TEN.replace(axis=("1 +- 0.1", "0.2 +- 0.05", "0.1 +- 0.05"), hole_length="9 +- 0.1", rod=rod)
    margin = BearingMargin(box, condition)
    random = np.random.default_rng(5)
    ends = [box[name] for name in margin.names]
    low, high = (np.array([float(getattr(r, side)) for r in ends]) for side in ("lower", "upper"))
    x = low + (high - low) * random.random((40, len(ends)))
    floats = margin.sampled(x)
    points = margin.enclosed([Interval.from_bounds(c, c) for c in x.T])
    assert (points.lo - 1e-14 <= floats).all() and (floats <= points.hi + 1e-14).all()
    whole = margin.enclosed([r.outer for r in ends])
    assert (float(whole.lo) <= floats).all() and (floats <= float(whole.hi)).all()
    unit = np.eye(len(ends))
    duals = margin.enclosed(
        [Dual(Interval.from_bounds(a, b), Interval.from_bounds(u, u)) for a, b, u in zip(low, high, unit)]
    )
    assert isinstance(duals, Dual)
    step = 1e-6 * (high - low)
    for j in range(len(ends)):
        slope = (margin.sampled(x + step * unit[j]) - margin.sampled(x - step * unit[j])) / (2 * step[j])
        size = 1e-5 + 1e-4 * np.abs(slope)
        assert (float(duals.grad.lo[j]) - size <= slope).all() and (slope <= float(duals.grad.hi[j]) + size).all()


@pytest.mark.parametrize("condition", ["A", "B"])
def test_linear_functions_and_their_remainders_hold_the_margin(condition) -> None:  # type: ignore[no-untyped-def]
    """At the corners of boxes, where the remainder is largest, and at the points that a smaller box must keep."""
    warm = CommonFactor("temperature", D.uniform("[-20, 40]"), {"clearance": "-5e-5", "l3": "2e-4"})
    problem = ChanceProblem(TEN.replace(alpha="0.0145 +- 0.004"), {}, (warm,), condition)
    margin, sources = problem.model()
    random, n = np.random.default_rng(11), len(sources.every)
    lo = np.floor(random.uniform(0.0, 0.5, (20, n)) * 2.0**32) / 2.0**32
    hi = np.floor(random.uniform(0.5, 1.0, (20, n)) * 2.0**32) / 2.0**32
    line = affine(margin, sources, lo, hi)
    low, high = _contracted(lo, hi, line)
    assert (high - low < hi - lo).any() and (line.low < line.high).all()
    remainders = []
    for _ in range(60):
        ends = random.integers(0, 2, (20, n))
        for v in (np.where(ends == 1, hi, lo), random.uniform(lo, hi)):
            m = margin.sampled(sources.sampled(list(v.T)))
            linear = (line.weights * (v - 0.5 * (lo + hi))).sum(axis=1)
            assert (linear - line.high <= m + 1e-14).all() and (m - 1e-14 <= linear - line.low).all()
            remainders.append(np.abs(m - linear + 0.5 * (line.low + line.high)) / (line.high - line.low))
            inside = ((low <= v) & (v <= high)).all(axis=1)
            assert (inside | (m >= -1e-14)).all()
    assert np.max(remainders) > 0.1  # the bound is not far from what occurs


@pytest.mark.parametrize("condition", ["B", "general"])
def test_other_conditions_agree_with_random_members(condition) -> None:  # type: ignore[no-untyped-def]
    box = ONE.replace(hole_length="9.8 +- 0.1", Hb="10 +- 0.05", l2="1 +- 0.01")
    found = probability_of_jamming(box, condition=condition, width=3e-3, samples=50_000)
    assert found.samples is not None and found.upper - found.lower <= 3e-3
    assert found.samples.lower <= found.upper and found.lower <= found.samples.upper


def test_sensitivities_are_differences_between_proved_bounds() -> None:
    found = probability_of_jamming(ONE.replace(Hb="10 +- 0.05"))
    table = found.sensitivities("1/2")
    assert [row.name for row in table.rows] in (["clearance", "Hb"], ["Hb", "clearance"])
    other = probability_of_jamming(
        ToleranceBox(alpha="0.0145", Hb="10 +- 0.05", clearance="0.03 +- 0.0015"), width=1e-5
    )
    row = next(row for row in table.rows if row.name == "clearance")
    assert row.lower <= other.upper and other.lower <= row.upper
    with mpmath.workdps(30):
        now = sum((need(Hb=h) - mpmath.mpf("0.027")) / mpmath.mpf("0.006") for h in ("9.95", "10.05")) / 2
        then = sum((need(Hb=h) - mpmath.mpf("0.0285")) / mpmath.mpf("0.003") for h in ("9.95", "10.05")) / 2
    assert row.least_change <= then - now <= row.most_change
    assert len(table.to_pandas()) == 2 and len(repr(table).splitlines()) <= 10
    with pytest.raises(GeometryError, match="positive"):
        found.sensitivities(0)


def test_public_name_and_bad_questions() -> None:
    assert gs.probability_of_jamming is probability_of_jamming and gs.Distribution is Distribution
    with pytest.raises(GeometryError, match="no quantity"):
        probability_of_jamming(ONE, {"length": D.uniform("[1, 2]")})
    with pytest.raises(GeometryError, match="assembled"):
        probability_of_jamming(ToleranceBox(l1="2", l2="1", l3="1", l4="1 +- 0.1"))
    for bad in ("box", None, 3):
        with pytest.raises(GeometryError, match="no ToleranceBox"):
            probability_of_jamming(bad)
    with pytest.raises(GeometryError, match="no CommonFactor"):
        probability_of_jamming(ONE, common=["warm"])  # type: ignore[list-item]
    assert "floating-point" in probability_of_jamming(ONE.replace(alpha=0.0145)).statement
    assert "floating-point" not in probability_of_jamming(ONE).statement
    with pytest.raises(GeometryError, match="width"):
        probability_of_jamming(ONE, width=0.0)
    with pytest.raises(GeometryError, match="no Distribution"):
        probability_of_jamming(ONE, {"clearance": "0.03"})  # type: ignore[dict-item]


class _Disc:
    """Any other margin: distance from a circle; curved everywhere, and not known by its name to the package."""

    names = ("x", "y")
    model = "distance from a circle"

    def sampled(self, x):  # type: ignore[no-untyped-def]
        return x[:, 0] ** 2 + x[:, 1] ** 2 - 1.0

    def enclosed(self, x):  # type: ignore[no-untyped-def]
        return x[0].sqr() + x[1].sqr() - 1


def test_any_margin_can_be_asked() -> None:
    """A quarter of the unit disc in the unit square; and without derivatives, by boxes alone."""
    square = {"x": D.uniform("[0, 1]"), "y": D.uniform("[0, 1]")}
    found = probability_of_jamming(_Disc(), square, width=1e-4)
    assert found.lower <= np.pi / 4 <= found.upper and found.upper - found.lower <= 1e-4

    class Values(_Disc):
        def enclosed(self, x):  # type: ignore[no-untyped-def]
            return super().enclosed([part.value if isinstance(part, Dual) else part for part in x])

    found = probability_of_jamming(Values(), square, width=0.02)
    assert found.lower <= np.pi / 4 <= found.upper and found.upper - found.lower <= 0.02


class _Band(_Disc):
    """A band of 2e-4 around a plane, known by its values alone: boxes must be smaller than that to lie inside."""

    names = ("x", "y", "z")

    def enclosed(self, x):  # type: ignore[no-untyped-def]
        x, y, z = (part.value if isinstance(part, Dual) else part for part in x)
        return abs(x + y + z - Interval("1.5")) - Interval("0.0001")


class _Edge(_Disc):
    """Distance from the lower edge of the square, to seven digits: it touches along all of the edge."""

    def enclosed(self, x):  # type: ignore[no-untyped-def]
        return x[1] + Interval.from_bounds(-1e-7, 1e-7)


def test_a_search_that_is_too_short_does_not_say_that_tolerances_touch() -> None:
    """The density of a sum of three uniform quantities is 3/4 in its middle: the band has a probability of 1.5e-4."""
    cube = {name: D.uniform("[0, 1]") for name in _Band.names}
    short = probability_of_jamming(_Band(), cube, width=1.0)
    assert short.lower == 0.0 and 1.5e-4 < short.upper < 0.1
    assert "limit of work" in short.reason and "no member is proved to bind" in short.reason
    edge = probability_of_jamming(_Edge(), {"x": D.uniform("[0, 1]"), "y": D.uniform("[0, 1]")})
    assert (edge.lower, edge.boxes < 200) == (0.0, True) and "touch the limit" in edge.reason


class _Cap(_Disc):
    """Binds in a corner of the square around the unit disc."""

    def enclosed(self, x):  # type: ignore[no-untyped-def]
        return Interval("1.2") - x[0] - x[1]


def test_a_hole_in_its_disc_lies_within_what_its_square_bounds() -> None:
    """The cap of a disc against the corner of its square (theory/probability-of-coupled-joints 1)."""
    found = probability_of_jamming(_Cap(), {name: D.uniform("[-1, 1]") for name in "xy"}, width=1e-6)
    distance = 0.6 * np.sqrt(2.0)
    cap = (np.arccos(distance) - distance * np.sqrt(1.0 - distance**2)) / np.pi
    more = 4.0 / np.pi
    assert cap < found.lower <= 0.08 <= found.upper
    assert 1.0 - more * (1.0 - found.lower) <= cap <= more * found.upper


class _Several(_Disc):
    """The least of three margins: a union of events, whose edges cross."""

    def sampled(self, x):  # type: ignore[no-untyped-def]
        return np.minimum(np.minimum(x[:, 0] - 0.3, x[:, 1] - 0.2), 1.5 - x[:, 0] - x[:, 1])

    def enclosed(self, x):  # type: ignore[no-untyped-def]
        a, b = x
        return minimum(minimum(a - Interval("0.3"), b - Interval("0.2")), Interval("1.5") - a - b)


def test_union_of_events_is_cut_apart() -> None:
    """One minus a rectangle of 0.7 by 0.8 without a corner triangle."""
    square = {"x": D.uniform("[0, 1]"), "y": D.uniform("[0, 1]")}
    found = probability_of_jamming(_Several(), square, width=1e-4)
    exact = 1 - (0.7 * 0.8 - 0.125)
    assert found.lower <= exact <= found.upper and found.upper - found.lower <= 1e-4
    drawn = found.sampled(50_000)
    assert drawn.lower <= exact <= drawn.upper


@pytest.mark.slow
@pytest.mark.parametrize("normal", [False, True])
@pytest.mark.parametrize("alpha", ["0.0145 +- 0.0002", "0.0135 +- 0.0002"])
def test_a_hundred_million_members_never_contradict(alpha: str, normal: bool) -> None:
    box = TEN.replace(alpha=alpha)
    chosen = {name: D.normal(r) for name, r in box.ranges.items() if not r.is_point} if normal else {}
    begin = process_time()
    found = probability_of_jamming(box, chosen)
    assert process_time() - begin < 30.0  # some 1 to 6 on a core of 2024
    drawn = found.sampled(100_000_000, seed=7, confidence=1.0 - 1e-6)
    assert drawn.lower <= found.upper and found.lower <= drawn.upper
    assert found.upper - found.lower <= 1e-3 and found.upper <= 1.5 * found.lower
