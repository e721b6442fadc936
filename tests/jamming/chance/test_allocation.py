"""Allocation of tolerances: each result proved, and never dearer than the best of an exhaustive search."""

from collections.abc import Callable
from fractions import Fraction
from functools import cache
from itertools import product

import machines
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
from graphsynth.jamming.chance import allocation
from graphsynth.jamming.chance.allocation import curve as curve_of
from graphsynth.jamming.chance.paving import Paver
from graphsynth.jamming.chance.probability import sample_probability

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


@pytest.mark.long
@pytest.mark.parametrize("allowed", [0.05, 1e-3, 0.0])
@pytest.mark.parametrize("listed", [200_000, 1])
def test_no_dearer_than_an_exhaustive_search(allowed: float, listed: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """Where there are too many choices to list them, the integer program has to find them."""
    monkeypatch.setattr(allocation, "_LISTED", listed)
    found = allocate_tolerances(BOX, GRADES, allowed)
    assert found.choice and found.upper <= allowed
    assert found.cost <= exhaustive(allowed) + 1e-12
    assert found.cheapest is (listed > 1)
    chosen = {name: grade.distribution for name, grade in found.choice.items()}
    again = probability_of_jamming(BOX, chosen)
    assert again.upper <= max(2.0 * allowed, found.upper) and again.lower <= found.upper
    assert len(repr(found).splitlines()) <= 10


@pytest.mark.long
@pytest.mark.parametrize(
    ("machine", "allowed", "members"),
    [
        (machines.small, 0.1, 20_000),
        (machines.small, 0.001, 20_000),
        pytest.param(machines.middle, 0.1, 4000, marks=pytest.mark.slow),
        pytest.param(machines.middle, 0.02, 4000, marks=pytest.mark.slow),
        pytest.param(machines.large, 0.01, 2000, marks=pytest.mark.slow),
        pytest.param(machines.large, 0.001, 10_000, marks=pytest.mark.slow),
    ],
)
def test_three_machines_of_different_size(
    machine: Callable[[], machines.Machine], allowed: float, members: int
) -> None:
    """Every cheaper choice binds too often: by random members (one error in a million), near by, by full enclosure."""
    own = machine()
    found = allocate_tolerances(own.subject, own.grades, allowed, own.distributions, seconds=600.0)
    assert found.cheapest and found.upper <= allowed and found.undecided == 0
    chosen = own.distributions | {name: grade.distribution for name, grade in found.choice.items()}
    assert sample_probability(own.question(chosen), members, 0, 1.0 - 1e-6).lower <= found.upper
    cheaper = [given for cost, given in own.choices() if cost < found.cost - 1e-9]
    assert len(cheaper) == found.rejected
    drawn = [sample_probability(own.question(given), members, k, 1.0 - 1e-6) for k, given in enumerate(cheaper)]
    assert all(one.upper > allowed for one in drawn)
    unclear = [given for given, one in zip(cheaper, drawn) if one.lower <= allowed]
    assert len(unclear) < max(2, len(cheaper))
    for given in unclear:
        bounds = probability_of_jamming(own.subject, given, width=allowed / 5, ratio=1.2, seconds=10.0)
        assert bounds.upper > allowed


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


def test_picture_is_a_staircase_of_what_is_worth_its_cost() -> None:
    found = curve_of([(0.02, 5.0), (0.3, 1.0), (0.0, 9.0), (0.05, 6.0), (0.02, 5.0)])
    steps, marks = found.lines
    assert list(zip(marks.x, marks.y)) == [(0.02, 5.0), (0.3, 1.0)]  # (0.05, 6) binds more often and costs more
    assert list(zip(steps.x, steps.y)) == [(0.01, 9), (0.02, 9), (0.02, 5), (0.3, 5), (0.3, 1), (1, 1)]
    assert found.decades and [level.label for level in found.levels] == ["none binds: 9"]
    assert curve_of([(0.0, 9.0)]) is None


def test_a_choice_proved_good_for_less_risk_is_kept_for_more_and_the_other_way_round() -> None:
    """Points of a curve in any order: none dearer than alone."""
    allowed = [0.3, 0.02, 1e-3, 1e-4, 1e-7, 0.1]
    together = pareto_curve(BOX, GRADES, allowed).points
    assert [own.cost for own in together] == [allocate_tolerances(BOX, GRADES, p).cost for p in allowed]
    assert all(own.cheapest for own in together)


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
