"""Curves of the index are found whatever is done to them; what is found draws what it says."""

import math

import numpy as np
import pytest

from graphsynth import Catalogue, simulate
from graphsynth.core.errors import FormatError, GeometryError, SpecError
from graphsynth.design import CurveIndex
from graphsynth.design.curves.families import families
from graphsynth.design.curves.matches import Entry
from graphsynth.kinematics.dimensional.goals import Goals, PathGoal
from graphsynth.kinematics.dimensional.problem import DimensionProblem
from graphsynth.kinematics.dimensional.refine import refine
from graphsynth.structure.assur import decompose


def disturbed(entry: Entry, random: np.random.Generator) -> np.ndarray:
    """The curve of an entry elsewhere, turned, reflected, larger or smaller, begun and run in another way."""
    z = entry.traced().curve
    if entry.closed:
        z = np.roll(z[:-1], int(random.integers(len(z) - 1)))
    z = z[::-1] if random.random() < 0.5 else z
    z = np.conj(z) if random.random() < 0.5 else z
    z = np.exp(random.normal() + 1j * random.uniform(0.0, 7.0)) * z + complex(*random.normal(size=2))
    return np.column_stack([z.real, z.imag])


def rows(index: CurveIndex, count: int, seed: int) -> list[int]:
    return np.random.default_rng(seed).choice(len(index), count, replace=False).tolist()


@pytest.mark.long
def test_curves_of_the_index_are_found(index: CurveIndex) -> None:
    random = np.random.default_rng(1)
    for number in rows(index, 40, 1):
        entry = index.entry(number)
        best = index.find(disturbed(entry, random), 1, closed=entry.closed)[0]
        # it is the first unless another one is as near
        assert best.number == number or best.error < 2e-3
        assert best.error < 2e-3


@pytest.mark.long
def test_what_is_found_draws_the_wanted_curve(index: CurveIndex) -> None:
    random = np.random.default_rng(2)
    seen = set()
    for number in rows(index, 40, 2):
        entry = index.entry(number)
        wanted = disturbed(entry, random)
        match = index.find(wanted, 1, closed=entry.closed)[0]
        if match.number != number:
            continue
        seen.add((entry.closed, entry.family.turns, bool(entry.family.sliders)))
        assert match.error < 1e-6
        motion = simulate(match.mechanism, match.inputs, events=False)
        assert motion.completed
        drawn = motion.point("P").position @ [1.0, 1.0j]
        z = wanted @ [1.0, 1.0j]
        size = float(np.abs(z - z.mean()).max())
        # begins where the wanted curve begins, runs as it runs, and never leaves it
        assert abs(drawn[0] - z[0]) < 1e-5 * size
        near = np.abs(drawn[:, None] - z).argmin(axis=1)
        assert np.abs(drawn - z[near]).max() < 0.05 * size
        quarter = len(drawn) // 8
        along = np.abs(np.diff(drawn[: quarter + 1])).sum() / np.abs(np.diff(drawn)).sum()
        own = np.concatenate([[0.0], np.cumsum(np.abs(np.diff(z)))])
        there = np.interp(along * (own[-1] + abs(z[-1] - z[0]) * entry.closed), own, z)
        assert abs(there - drawn[quarter]) < 0.02 * size
    assert len(seen) >= 4


def test_what_does_not_come_to_the_beginning_of_a_curve_is_left_out(
    index: CurveIndex, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Near a dead centre a motion may end in other steps than those of the index: letter B had one among 400."""
    entry, frames = index.entry(rows(index, 1, 3)[0]), Entry.frames
    wanted = disturbed(entry, np.random.default_rng(3))
    found = index.find(wanted, 3, closed=entry.closed)
    ended = found[0].number

    def ending(own: Entry, inputs: np.ndarray) -> np.ndarray:
        poses = frames(own, inputs)
        if own.row == index.entry(ended).row and len(inputs) not in (257, 513):
            poses[-1] = math.nan
        return poses

    monkeypatch.setattr(Entry, "frames", ending)
    again = index.find(wanted, 2, closed=entry.closed)
    assert [match.number for match in again] == [match.number for match in found[1:]]
    assert all(np.isfinite(match.start.places).all() for match in again)


@pytest.mark.long
def test_motions_are_found_by_any_point_of_the_link(index: CurveIndex) -> None:
    random = np.random.default_rng(8)
    right = 0
    for number in rows(index, 24, 8):
        entry = index.entry(number)
        traced = entry.traced()
        z, angle = traced.curve + traced.turn * complex(*random.normal(size=2)), np.unwrap(np.angle(traced.turn))
        if entry.closed:
            z, angle = (np.roll(part[:-1], 77) for part in (z, angle))
        if random.random() < 0.5:
            z, angle = np.conj(z), -angle
        if random.random() < 0.5:
            z, angle = z[::-1], angle[::-1]
        z, angle = (0.3 + 2j) * z + 5.0, angle + np.angle(0.3 + 2j) + 1.0
        match = index.find_motion(np.column_stack([z.real, z.imag, angle]), 1, closed=entry.closed)[0]
        assert match.error < 0.02
        if match.number != number:
            continue
        right += 1
        assert match.error < 1e-4
        inputs = np.linspace(0.0, match.start.span, len(z) + entry.closed)
        motion = simulate(match.mechanism, inputs, events=False)
        drawn = (motion.point("P").position @ [1.0, 1.0j])[: len(z)]
        assert np.abs(drawn - z).max() < 0.01 * np.abs(z - z.mean()).max()
        apart = np.exp(1j * (motion.poses[: len(z), match.start.link, 2] - angle))
        assert np.abs(apart - apart[0]).max() < 0.02
    assert right >= 18


def test_curves_at_uniform_inputs_are_found_with_few_points(index: CurveIndex) -> None:
    for number in [k for k in rows(index, 30, 9) if index.entry(k).closed][:10]:
        curve = index.entry(number).traced().curve
        few = curve[:-1:32]  # sixteen points of a rotation
        match = index.find(np.column_stack([few.imag, few.real]), 1, closed=True, timed=True)[0]
        motion = simulate(match.mechanism, np.linspace(0.0, math.tau, 17), events=False)
        drawn = motion.point("P").position[:16] @ [1.0, 1.0j]
        size = np.abs(few - few.mean()).max()
        assert np.abs(drawn - 1j * np.conj(few)).max() < 0.05 * size


def test_only_some_mechanisms_are_asked_for(index: CurveIndex) -> None:
    angles = np.linspace(0.0, math.tau, 100)
    curve = np.column_stack([2.0 * np.cos(angles), np.sin(angles)])
    every = index.find(curve, 40, candidates=len(index))
    wanted = [match.number for match in every if match.links == 6][:5]
    some = index.find(curve, 5, only=lambda design: design.graph.links == 6, candidates=len(index))
    assert [match.number for match in some] == wanted
    assert index.find(curve, 5, only=lambda design: False) == []


@pytest.mark.long
def test_open_curves_within_a_range_of_the_driver(index: CurveIndex) -> None:
    angles = np.linspace(0.0, math.tau, 100)
    curve = np.column_stack([angles, 0.4 * np.sin(angles) ** 2])
    every = index.find(curve, len(index), closed=False, candidates=len(index))
    wanted = [match.number for match in every if abs(np.ptp(match.entry.row["inputs"])) <= 2.0][:5]
    some = index.find(curve, 5, closed=False, within=2.0, candidates=len(index))
    assert [match.number for match in some] == wanted and len(wanted) == 5 and wanted != [m.number for m in every[:5]]


def test_the_nearest_are_those_of_brute_force(index: CurveIndex) -> None:
    angles = np.linspace(0.0, math.tau, 200)
    for curve in (
        np.column_stack([2.0 * np.cos(angles), np.sin(angles) + 0.4 * np.cos(2.0 * angles)]),
        np.column_stack([angles, 0.4 * np.sin(angles) ** 2]),
    ):
        some, every = (index.find(curve, 5, candidates=count) for count in (400, len(index)))
        assert [match.number for match in some] == [match.number for match in every]
        assert [match.error for match in every] == sorted(match.error for match in every)
        assert len({match.number for match in every}) == 5


@pytest.mark.long
def test_starts_begin_a_search(index: CurveIndex) -> None:
    random = np.random.default_rng(5)
    found = 0
    for number in rows(index, 60, 5):
        entry = index.entry(number)
        if not entry.closed or entry.family.sliders:
            continue
        wanted = disturbed(entry, random)
        start = index.starts(wanted, 1, closed=True)[0]
        goals = Goals(math.tau, 0.0, 1e6, PathGoal(tuple(map(tuple, wanted[::16])), closed=True, link=start.link))
        problem, x = start.problem(goals)
        assert isinstance(problem, DimensionProblem)
        refined = refine(problem, x[None], 3)
        assert refined.error[0] < 1e-4
        found += 1
        if found == 5:
            break
    assert found == 5


def test_every_family_is_there_once_and_larger_groups_too() -> None:
    own = families([4, 6, 8], 2)
    assert len(own) == len(set(own))
    # the catalogue counts driven inversions of its own, and those with a group of a class above II
    eight = [family for family in own if family.design.graph.links == 8]
    question = (
        "FROM driven JOIN chains USING (chain_id) JOIN structures USING (structure_id) WHERE (links, mobility) = (8, 1)"
    )
    with Catalogue.shipped() as catalogue:
        counts = catalogue.sql(f"SELECT COUNT(*) AS every, SUM(class > 2) AS larger {question}").to_dict("records")
    assert counts == [{"every": len(eight), "larger": sum(not family.dyadic for family in eight)}]
    for family in eight:
        sizes = [len(group.links) for group in decompose(family.design.graph, family.design.drivers).groups]
        assert family.dyadic == (max(sizes) == 2)
    assert {family.turns for family in own if family.sliders} == {True, False}


def test_bad_questions_are_answered_in_a_sentence(index: CurveIndex) -> None:
    with pytest.raises(GeometryError, match="3 or more rows"):
        index.find([(0.0, 0.0), (1.0, 0.0)])
    with pytest.raises(GeometryError, match="5 or more rows"):
        index.find([(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)], timed=True)
    with pytest.raises(GeometryError, match=r"rows \(x, y, theta\)"):
        index.find_motion([(0.0, 0.0)] * 9)
    with pytest.raises(GeometryError, match="the same"):
        index.find([(1.0, 2.0)] * 4)
    with pytest.raises(GeometryError, match="finite"):
        index.find([(0.0, 0.0), (1.0, math.nan), (2.0, 0.0)])
    with pytest.raises(GeometryError, match="count = 0"):
        index.find([(0.0, 0.0), (1.0, 1.0), (2.0, 0.0)], 0)
    with pytest.raises(GeometryError, match="number = 3000"):
        index.entry(3000)
    with pytest.raises(SpecError, match="curves = 10"):
        CurveIndex.build(index.folder, 10)
    with pytest.raises(SpecError, match="links"):
        CurveIndex.build(index.folder, 1000, links=[5])
    with pytest.raises(SpecError, match="sliders 1"):
        CurveIndex.build(index.folder, 3000, links=[4, 6], sliders=2)
    with pytest.raises(FormatError, match="no finished index"):
        CurveIndex(index.folder.parent)
