"""Random chains, those with multiple or prismatic joints and gear trains too, are uniform over classes."""

from __future__ import annotations

import json
from collections import Counter
from itertools import permutations

import pytest
from scipy.stats import chisquare

from graphsynth import (
    StructuralSpec,
    Wishes,
    enumerate_assur_groups,
    enumerate_chains,
    enumerate_mechanisms,
    enumerate_multiple_joint_chains,
    enumerate_planetary_gear_trains,
    enumerate_slider_chains,
    sample_chains,
    sample_multiple_joint_chains,
    sample_planetary_gear_trains,
    sample_slider_chains,
)
from graphsynth.cli.main import main
from graphsynth.core.errors import InfeasibleSpecError, SpecError

DRAWS = 25


def assert_uniform(drawn, population):
    """Chi-square over classes, and over classes with groups of one order taken together: a bias shows there first."""
    orders = {item.key: item.automorphism_order for item in population}
    assert len(orders) > 1
    times = Counter(item.key for item in drawn)
    assert set(times) <= set(orders)
    assert chisquare([times[key] for key in orders]).pvalue > 1e-3
    sizes, by_order = Counter(orders.values()), Counter()
    for key, number in times.items():
        by_order[orders[key]] += number
    if len(sizes) > 1:
        assert chisquare([by_order[o] for o in sizes], [DRAWS * sizes[o] for o in sizes]).pvalue > 1e-3


@pytest.mark.parametrize(
    ("links", "mobility", "rest"),
    [
        pytest.param(8, 1, {}, marks=pytest.mark.long),
        (6, 1, {"joints_by_mobility": {2: 2}}),
        (9, 2, {"fractionated": True}),
    ],
)
def test_chains(links, mobility, rest):
    population = list(enumerate_chains(links, mobility, **rest))
    assert_uniform(sample_chains(links, mobility, k=DRAWS * len(population), seed=2, **rest), population)


@pytest.mark.long
@pytest.mark.parametrize(
    ("links", "mobility", "rest"),
    [(6, 1, {"framed": True}), (7, 2, {}), (8, 1, {}), (8, 1, {"multiple": 2, "framed": True})],
)
def test_chains_with_multiple_joints(links, mobility, rest):
    population = list(enumerate_multiple_joint_chains(links, mobility, **rest))
    assert_uniform(sample_multiple_joint_chains(links, mobility, k=DRAWS * len(population), seed=3, **rest), population)


@pytest.mark.long
@pytest.mark.parametrize(
    ("links", "sliders", "mobility", "rest"),
    [
        (4, 2, 1, {"sliding_links": True, "framed": True}),
        (6, 2, 1, {}),
        (6, 2, 1, {"framed": True}),
        (6, 4, 1, {"sliding_links": True}),
        (7, 2, 2, {"sliding_links": True, "sliding_loops": True}),
        (8, 2, 1, {"cylinders": True}),
    ],
)
def test_chains_with_prismatic_joints(links, sliders, mobility, rest):
    population = list(enumerate_slider_chains(links, sliders, mobility, **rest))
    drawn = sample_slider_chains(links, sliders, mobility, k=DRAWS * len(population), seed=5, **rest)
    assert_uniform(drawn, population)


@pytest.mark.parametrize(
    ("links", "mobility", "rest"),
    [
        (5, 1, {}),
        (5, 1, {"rotation": True}),
        pytest.param(6, 1, {"rotation": True}, marks=pytest.mark.long),
        pytest.param(5, 1, {"framed": True}, marks=pytest.mark.long),
        pytest.param(6, 1, {"framed": True}, marks=pytest.mark.long),
        pytest.param(6, 2, {"framed": True}, marks=pytest.mark.long),
        pytest.param(6, 2, {"framed": True, "rotation": True}, marks=pytest.mark.long),
    ],
)
def test_gear_trains(links, mobility, rest):
    population = list(enumerate_planetary_gear_trains(links, mobility, **rest))
    assert_uniform(sample_planetary_gear_trains(links, mobility, k=DRAWS * len(population), seed=8, **rest), population)


@pytest.mark.parametrize(
    "wish",
    [
        pytest.param(Wishes(girth=5), marks=pytest.mark.long),
        Wishes(jointed=[(3, 3)]),
        pytest.param(Wishes(planar=True), marks=pytest.mark.long),
    ],
)
def test_wishes(wish):
    """Taken over by the search or drawn again; of cylinders, of which one wish cuts the search."""
    more = {"cylinders": True, "wishes": wish}
    population = list(enumerate_slider_chains(9, 2, 2, **more))
    assert_uniform(sample_slider_chains(9, 2, 2, k=DRAWS * len(population), seed=6, **more), population)
    population = list(enumerate_multiple_joint_chains(7, 2, wishes=Wishes(jointed=[(2, 3)])))
    drawn = sample_multiple_joint_chains(7, 2, k=20, seed=2, wishes=Wishes(jointed=[(2, 3)]))
    assert {chain.key for chain in drawn} <= {chain.key for chain in population}


@pytest.mark.parametrize(
    ("question", "listed"),
    [
        ("--links 8 --frame", lambda: enumerate_mechanisms(StructuralSpec(W=1, links=8))),
        ("--links 6 --sliders 2 --frame", lambda: enumerate_slider_chains(6, 2, framed=True)),
        ("--links 7 --mobility 2 --multiple-joints any", lambda: enumerate_multiple_joint_chains(7, 2)),
        ("--links 6 --gear-trains", lambda: enumerate_planetary_gear_trains(6)),
        ("--assur 6", lambda: enumerate_assur_groups(6)),
    ],
)
def test_the_command_line_draws_from_every_list(question, listed, tmp_path, capsys):
    asked = ["enumerate", *question.split(), "--sample", "12", "--seed", "3"]
    assert main(asked) == 0
    population = list(listed())
    kind = type(population[0])
    texts = capsys.readouterr().out.splitlines()
    assert main([*asked, "-o", str(tmp_path / "drawn.jsonl")]) == 0
    keys = [json.loads(line)["key"] for line in (tmp_path / "drawn.jsonl").read_text().splitlines()]
    assert keys == [kind.from_text(text).key for text in texts] and len(keys) == 12
    assert set(keys) <= {item.key for item in population}


@pytest.mark.parametrize("drive", [pytest.param("any", marks=pytest.mark.long), "coaxial"])
def test_gear_trains_with_input_and_output(drive):
    """Links 0, 1 and 2 keep their names: the least of the trains with the others exchanged stands for a class."""
    names = [[0, 1, 2, *rest] for rest in permutations((3, 4))]

    def form(train):
        return min(train.coloured.relabelled(place).packed for place in names)

    population = list(map(form, enumerate_planetary_gear_trains(5, drive=drive)))
    drawn = Counter(map(form, sample_planetary_gear_trains(5, k=DRAWS * len(population), seed=4, drive=drive)))
    assert len(set(population)) == len(population)
    assert set(drawn) <= set(population)
    assert chisquare([drawn[one] for one in population]).pvalue > 1e-3


def test_a_seed_fixes_the_draws_and_nothing_is_drawn_from_nothing(monkeypatch):
    assert sample_slider_chains(6, 1, k=4, seed=1) == sample_slider_chains(6, 1, k=4, seed=1)
    assert sample_slider_chains(6, 1, k=9, seed=1) != sample_slider_chains(6, 1, k=9, seed=2)
    assert sample_multiple_joint_chains(6, k=0, seed=1) == []
    with pytest.raises(InfeasibleSpecError, match="nothing to draw from"):
        sample_slider_chains(4, 3, k=1, seed=1)
    with pytest.raises(InfeasibleSpecError, match="nothing to draw from"):
        sample_planetary_gear_trains(5, 2, k=1, seed=1)
    with pytest.raises(SpecError, match="sliding is no rule of prismatic joints"):
        sample_slider_chains(6, 1, k=1, seed=1, sliding=True)
    monkeypatch.setattr("graphsynth.synthesis.sampling._MISSES", 50)
    with pytest.raises(SpecError, match="none of 50 random ones is as wished"):
        sample_multiple_joint_chains(6, k=1, seed=1, wishes=Wishes(planar=False))
    with pytest.raises(SpecError, match="seed"):
        sample_multiple_joint_chains(6, k=1, seed=None)
