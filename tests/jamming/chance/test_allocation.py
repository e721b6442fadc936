"""Allocation of tolerances: each result proved, and never dearer than the best of an exhaustive search."""

from fractions import Fraction
from functools import cache
from itertools import product

import pytest

from graphsynth.core.errors import GeometryError
from graphsynth.jamming import (
    Distribution,
    Grade,
    ToleranceBox,
    allocate_tolerances,
    certify_jamming,
    pareto_curve,
    probability_of_jamming,
)
from graphsynth.jamming.chance.paving import Paver
from graphsynth.jamming.chance.probability import ChanceProblem

BOX = ToleranceBox(alpha="0.0160 +- 0.0001", Rb="17.5 +- 0.005")
GRADES = {
    "clearance": [
        Grade("wide", "0.036 +- 0.006", 1),
        Grade("middle", Distribution.normal("0.036 +- 0.005"), 2),
        Grade("fine", "0.036 +- 0.0035", 4),
    ],
    "l2": [Grade("1 %", "1 +- 0.01", 1), Grade("0.1 %", "1 +- 0.001", 5)],
    "Hb": [Grade("coarse", "10 +- 0.3", 0.5), Grade("fine", "10 +- 0.02", 1.2)],
}


@cache
def every_choice(box: ToleranceBox = BOX) -> list[tuple[float, float]]:
    """Cost and upper bound of the probability of every choice, each enclosed in full."""
    found = []
    for picked in product(*GRADES.values()):
        chosen = {
            name: g.tolerance if isinstance(g.tolerance, Distribution) else Distribution.uniform(g.tolerance)
            for name, g in zip(GRADES, picked)
        }
        bounds = probability_of_jamming(box, chosen, width=1e-3, ratio=1.05)
        found.append((sum(g.cost for g in picked), bounds.upper))
    return found


def exhaustive(allowed: float) -> float:
    """Cost of the cheapest choice that is proved good."""
    return min(cost for cost, upper in every_choice() if upper <= allowed)


@pytest.mark.parametrize("allowed", [0.05, 1e-3, 0.0])
@pytest.mark.parametrize("trials", [300, 11])
def test_no_dearer_than_an_exhaustive_search(allowed: float, trials: int) -> None:
    """With few trials there are more choices than that, and the integer program has to find them."""
    found = allocate_tolerances(BOX, GRADES, allowed, trials=trials)
    assert found.choice and found.upper <= allowed
    assert found.cost <= exhaustive(allowed) + 1e-12
    assert found.cheapest is (trials == 300)
    chosen = {name: grade.distribution for name, grade in found.choice.items()}
    again = probability_of_jamming(BOX, chosen)
    assert again.upper <= max(2.0 * allowed, found.upper) and again.lower <= found.upper
    assert len(repr(found).splitlines()) <= 10


SMALL = ToleranceBox(l1=20, l2=8, l3=25, l4=25, alpha="0.020 +- 0.0002", Rb=4, Hb=6, clearance="0.02 +- 0.002")
LARGE = ToleranceBox(
    l1=2000, l2=900, l3=2500, l4=2500, alpha="0.0041 +- 0.0001", Rb="60 +- 0.01", Hb=80, clearance="0.07 +- 0.01"
)


def grades_of(box: ToleranceBox, quantities: tuple[str, ...]) -> dict[str, list[Grade]]:
    """Three grades for each quantity, each finer one twice as dear."""
    found = {}
    for k, name in enumerate(quantities):
        nominal = (box[name].lower + box[name].upper) / 2
        wide = nominal / (10 if name == "clearance" else 50)
        steps = [(nominal - wide / 3**step, nominal + wide / 3**step) for step in range(3)]
        found[name] = [Grade(f"grade {step}", ends, (k + 2) * 2.0**step) for step, ends in enumerate(steps)]
    return found


@pytest.mark.slow
@pytest.mark.parametrize(
    ("box", "quantities"),
    [
        (SMALL, ("clearance", "l2")),
        (BOX.replace(clearance="0.034 +- 0.003"), ("clearance", "l2", "l3", "Hb")),
        (LARGE, ("clearance", "l2", "l3", "Hb", "Rb")),
    ],
)
@pytest.mark.parametrize("allowed", [0.3, 1e-2, 1e-5])
def test_three_machines_of_different_size(box: ToleranceBox, quantities: tuple[str, ...], allowed: float) -> None:
    """Against every choice, each enclosed just as far as it takes to know whether it is allowed."""
    grades = grades_of(box, quantities)
    found = allocate_tolerances(box, grades, allowed, trials=60 if len(quantities) > 4 else 300)
    good = []
    for picked in product(*grades.values()):
        chosen = {name: grade.distribution for name, grade in zip(grades, picked)}
        bounds = Paver(*ChanceProblem(box, chosen).model(), 1e-3, 1.01, allowed=allowed).run()
        if bounds.upper <= allowed:
            good.append(sum(grade.cost for grade in picked))
    assert bool(found.choice) is bool(good)
    if good:
        assert found.upper <= allowed and found.cost <= min(good) + 1e-9


def test_worst_case_agrees_with_the_certificate() -> None:
    found = allocate_tolerances(BOX, GRADES, 0.0)
    member = BOX.replace(**{name: grade.distribution.support for name, grade in found.choice.items()})
    assert certify_jamming(member).verdict.is_free


def test_impossible_wishes_are_told() -> None:
    found = allocate_tolerances(BOX.replace(alpha="0.02"), GRADES, 1e-3)
    assert not found.choice and "No choice" in repr(found) and found.upper == 1.0
    for bad in ({}, {"l2": []}, {"l2": ["1 +- 0.1"]}, {"l2": [Grade("x", "1 +- 0.1", -1.0)]}):
        with pytest.raises(GeometryError):
            allocate_tolerances(BOX, bad, 0.1)
    with pytest.raises(GeometryError, match="probability"):
        allocate_tolerances(BOX, GRADES, 1.5)


def test_pareto_curve_falls_and_draws_itself() -> None:
    curve = pareto_curve(BOX, GRADES, [0.2, 0.02, 1e-4])
    costs = [point.cost for point in curve.points]
    assert costs == sorted(costs) and all(point.upper <= point.allowed for point in curve.points)
    assert len(curve.to_pandas()) == 3 and "cost" in repr(curve)
    assert curve.chart().svg().startswith("<svg")


def test_points_of_a_curve_share_enclosures_and_are_those_found_alone(monkeypatch: pytest.MonkeyPatch) -> None:
    runs = []
    run = Paver.run
    monkeypatch.setattr(Paver, "run", lambda own: runs.append(own) or run(own))
    allowed = [0.2, 0.02]
    together = pareto_curve(BOX, GRADES, allowed).points
    shared = len(runs)
    alone = [allocate_tolerances(BOX, GRADES, p) for p in allowed]
    assert shared < len(runs) - shared
    assert [(own.choice, own.cost, own.cheapest) for own in together] == [
        (own.choice, own.cost, own.cheapest) for own in alone
    ]
    assert all(own.upper <= p for own, p in zip(together, allowed))


class _Edge:
    """Binds below a quarter: with a probability of exactly a quarter."""

    names = ("x",)
    model = "distance from a quarter"

    def sampled(self, x):  # type: ignore[no-untyped-def]
        return x[:, 0] - 0.25

    def enclosed(self, x):  # type: ignore[no-untyped-def]
        return x[0] - Fraction(1, 4)


def test_what_is_not_proved_is_not_chosen() -> None:
    found = allocate_tolerances(_Edge(), {"x": [Grade("all", "[0, 1]", 1.0)]}, 0.25)
    assert not found.choice and found.undecided == 1 and found.rejected == 0 and not found.cheapest
    assert allocate_tolerances(_Edge(), {"x": [Grade("all", "[0, 1]", 1.0)]}, 0.2500001).cheapest
