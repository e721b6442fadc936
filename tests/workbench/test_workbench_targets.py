"""Mechanisms for a drawn curve and for poses: the page's index and searches, beside the library."""

from __future__ import annotations

import json
from itertools import pairwise

import numpy as np
import pytest

from graphsynth import Driver, Mechanism, MechanismGraph, Revolute
from graphsynth.design.curves.fourier import coefficients, magnitudes, unit
from graphsynth.workbench import targets

ROWS = """const held = await Curves.open(), motion = await Kernels.load("motion");
return args[0].map(k => {
  const own = Curves.row(held, k);
  return { own, curve: Curves.curve(motion, own, [...own.places, own.point]) };
});"""
FOUND = """const found = await Curves.found(await Kernels.load("motion"), args[0], () => true, args[1] ?? true);
return found.map(({ data, error }) => [JSON.stringify(data), error]);"""


@pytest.fixture(scope="module")
def with_curves(scripts):
    return lambda body, *given: scripts(targets.script() + body, *given, modules=("motion",))


def sizes(points):
    """The library's sizes of a closed polygon."""
    z = np.array(points) @ [1, 1j]
    return magnitudes(unit(coefficients(np.append(z, z[0])[None], np.array([True]), 16)), 8)[0]


def apart(curve, wanted):
    """Root mean square distance of the points of a curve from a polygon, over the polygon's size."""
    ends = np.roll(wanted, -1)
    t = np.clip(
        np.real((curve[:, None] - wanted) * np.conj(ends - wanted)) / np.maximum(np.abs(ends - wanted) ** 2, 1e-300),
        0,
        1,
    )
    far = np.abs(curve[:, None] - wanted - t * (ends - wanted)).min(axis=1)
    return np.sqrt((far**2).mean()) / np.hypot(np.ptp(wanted.real), np.ptp(wanted.imag))


def traced(mechanism, samples=361):
    return np.asarray(mechanism.simulate(np.linspace(0, 2 * np.pi, samples)).point("P").position) @ [1, 1j]


def test_sizes_are_those_of_the_library(scripts):
    random = np.random.default_rng(3)
    curves = [random.normal(size=(n, 2)).tolist() for n in (3, 12, 60)]
    for curve, found in zip(curves, scripts("return args[0].map(Curves.sizes)", curves)):
        assert np.abs(np.array(found) - sizes(curve)).max() < 1e-12


@pytest.mark.long
def test_rows_draw_the_curves_that_they_say(with_curves):
    """The engine of the page and the library move the mechanism of a row to a curve of the stored sizes."""
    for at in with_curves(ROWS, list(range(0, targets.ROWS, 250))):
        links, joints, driven = at["own"]["family"]
        assert len(at["own"]["places"]) == len(joints) and 0 < driven < links
        places = [*map(tuple, at["own"]["places"])]
        graph = MechanismGraph(links, joints, frame=0)
        pins = [Revolute(*joint, at_a=place, at_b=place) for joint, place in zip(joints, places)]
        point = {"P": (at["own"]["link"], tuple(at["own"]["point"]))}
        pose = tuple((0.0, 0.0, 0.0) for _ in range(links))
        mechanism = Mechanism(graph, pins, [Driver(0, driven)], point, pose)
        assert np.abs(traced(mechanism, 73)[:-1] - np.array(at["curve"]) @ [1, 1j]).max() < 1e-8
        points = at["curve"]
        assert points is not None
        assert np.abs(sizes(points) - at["own"]["sizes"]).max() < 0.02


@pytest.mark.slow
def test_a_hidden_curve_is_drawn_again(with_curves):
    """Crank-rockers that are in no index: their curves are drawn within half a percent, as the library sees it."""
    random = np.random.default_rng(11)
    for _ in range(3):
        hidden = Mechanism.four_bar(
            4.0, 1.0, *random.uniform(3.2, 4.2, 2), coupler_point=tuple(random.uniform(0.5, 3, 2))
        )
        wanted = traced(hidden)[:-1:3]
        found = with_curves(FOUND, np.column_stack([wanted.real, wanted.imag]).tolist())
        text, error = found[0]
        assert error < 5e-3 and [own for _, own in found] == sorted(own for _, own in found)
        curve = traced(Mechanism.from_json(text))
        assert abs(curve[0] - curve[-1]) < 1e-7
        assert apart(curve, wanted) == pytest.approx(error, abs=2e-3)


@pytest.mark.slow
def test_open_curves_are_drawn(with_curves):
    """A straight line, an arc and a wave: the library's curve of what is found passes near all points."""
    t = np.linspace(0.0, 1.0, 25)
    for wanted, most in ((100 * t, 2e-3), (50 * np.exp(2.4j * t), 2e-3), (90 * t + 20j * np.sin(6 * t), 1e-2)):
        found = with_curves(FOUND, np.column_stack([wanted.real, wanted.imag]).tolist(), False)
        text, error = found[0]
        assert error < most and len(found) > 3
        curve = traced(Mechanism.from_json(text), 1441)
        assert abs(curve[0] - curve[-1]) < 1e-7
        size = np.hypot(np.ptp(wanted.real), np.ptp(wanted.imag))
        assert np.abs(wanted[:, None] - curve).min(axis=1).max() < (3 * most + 5e-3) * size


PASSING = """const found = await Passing.found(await Kernels.load("design"), await Kernels.load("motion"), args[0]);
return found.map(({ data, quality }) => [JSON.stringify(data), quality]);"""


def misses(mechanism, poses, sense):
    """How far the coupler is from the poses when the crank turns in one sense; None if it does not get there."""
    poses = np.array(poses)
    places, turns = poses[:, 0] + 1j * poses[:, 1], np.exp(1j * (poses[:, 2] - poses[0, 2]))
    at = {joint.pair: complex(*joint.at_a) for joint in mechanism.joints}
    pivot, tip = at[0, 1], at[1, 2]
    tips = places + turns * (tip - places[0])
    steps = np.mod(sense * np.diff(np.angle((tips - pivot) / (tip - pivot))), 2 * np.pi)
    goals = sense * np.concatenate([[0.0], np.cumsum(steps)])
    if steps.sum() >= 2 * np.pi:
        return None
    motion = mechanism.simulate(np.concatenate([[0.0], *(np.linspace(a, b, 61)[1:] for a, b in pairwise(goals))]))
    if not motion.assembled.all():
        return None
    at = motion.poses[60 * np.arange(len(goals)), 2]
    here = at[:, 0] + 1j * at[:, 1] + np.exp(1j * at[:, 2]) * places[0]
    return max(np.abs(here - places).max(), np.abs(np.exp(1j * at[:, 2]) - turns).max())


@pytest.mark.long
@pytest.mark.parametrize("count", [2, 3, 4, 5])
def test_four_bars_pass_through_the_poses_in_the_library(scripts, count):
    poses = [[0, 0, 0], [40, 20, 0.5], [70, 10, 1.2], [80, -10, 1.7], [60, 18, 0.8]]
    poses = poses[:count] if count < 5 else [poses[k] for k in (0, 1, 4, 2, 3)]
    found = scripts(PASSING, poses, modules=("design", "motion"))
    assert len(found) >= (1 if count == 5 else 5)
    assert [quality for _, quality in found] == sorted((quality for _, quality in found), reverse=True)
    for text, quality in found:
        own = [misses(Mechanism.from_json(text), poses, sense) for sense in (1, -1)]
        assert 0 < quality <= 1 and min(far for far in own if far is not None) < 1e-5


@pytest.mark.long
@pytest.mark.parametrize("turns", [[0.9], [-0.8, -1.9], [0.7, 1.5]])
def test_timed_poses_are_met_at_the_angles_of_the_driver(scripts, turns):
    """Poses of the coupler of a hidden four-bar; of three, the crank can only be its crank."""
    hidden = Mechanism.four_bar(80.0, 20.0, 70.0, 60.0)
    poses = hidden.simulate(np.sort([0.0, *turns])).poses[:, 2]
    poses = poses if turns[0] > 0.0 else poses[::-1]
    asked = PASSING.replace("args[0])", "args[0], args[1])")
    found = scripts(asked, poses.tolist(), turns, modules=("design", "motion"))
    assert len(found) >= 3
    for text, quality in found:
        own = Mechanism.from_json(text)
        goals = np.concatenate([*(np.linspace(a, b, 61)[:-1] for a, b in pairwise([0.0, *turns])), turns[-1:]])
        motion = own.simulate(goals)
        assert 0 < quality <= 1 and motion.assembled.all()
        at = motion.poses[60 * np.arange(len(poses)), 2]
        turned = np.exp(1j * (poses[:, 2] - poses[0, 2]))
        there = at[:, :2] @ [1, 1j] + np.exp(1j * at[:, 2]) * complex(*poses[0, :2])
        assert np.abs(there - poses[:, :2] @ [1, 1j]).max() < 1e-5
        assert np.abs(np.exp(1j * at[:, 2]) - turned).max() < 1e-7
        pivot, tip = own.joint(0, 1).at_a, own.joint(1, 2).at_a
        assert len(turns) == 1 or np.abs(np.array([*pivot, *tip]) - [0.0, 0.0, 20.0, 0.0]).max() < 1e-9


def test_poses_at_one_place_have_no_four_bars(scripts):
    for poses in ([[1, 2, 0], [1, 2, 0]], [[0, 0, 0], [1, 0, 0], [2, 1, 0], [3, 0, 0]]):
        assert scripts(PASSING, poses, modules=("design", "motion")) == []


@pytest.mark.slow
def test_the_index_is_made_again():
    families, rows = targets.packed()
    line, _, held = targets.CURVES.read_bytes().partition(b"\n")
    assert json.loads(line) == families
    old = np.frombuffer(held, targets.ROW)
    assert len(old) == len(rows) == targets.ROWS
    assert np.array_equal(old["family"], rows["family"]) and np.array_equal(old["link"], rows["link"])
    assert np.abs(old["places"].astype(int) - rows["places"]).max() <= 1  # rounding may differ between machines
