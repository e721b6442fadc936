"""Mechanisms for a drawn curve: the page's index and search, beside the library."""

from __future__ import annotations

import json

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
FOUND = """const found = await Curves.found(await Kernels.load("motion"), args[0]);
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
def test_the_index_is_made_again():
    families, rows = targets.packed()
    line, _, held = targets.CURVES.read_bytes().partition(b"\n")
    assert json.loads(line) == families
    old = np.frombuffer(held, targets.ROW)
    assert len(old) == len(rows) == targets.ROWS
    assert np.array_equal(old["family"], rows["family"]) and np.array_equal(old["link"], rows["link"])
    assert np.abs(old["places"].astype(int) - rows["places"]).max() <= 1  # rounding may differ between machines
