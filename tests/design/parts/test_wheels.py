"""Wheels and cams: teeth mesh without cutting each other, rollers touch, layers are shared, and what cannot mesh."""

from __future__ import annotations

import math
import sys

import numpy as np
import pytest
from matplotlib.path import Path

import graphsynth as gs
from graphsynth import Driver, Mechanism, MechanismGraph
from graphsynth.core.errors import GeometryError, MissingExtraError
from graphsynth.mechanism.joints import Cam, Gear, Revolute

from .moving import carried
from .test_outline import polygon_moments

GRAPH = MechanismGraph(3, [(0, 1), (0, 2), (1, 2, 2)], frame=0)
#: A carrier that turns a planet about a wheel on the frame.
PLANET = MechanismGraph(3, [(0, 1), (1, 2), (0, 2, 2)], frame=0)


def geared(**more):
    """Two wheels on the frame, 1 : 2, their centres not on the x axis."""
    given = {"radius_a": math.hypot(3.0, 0.4) / 3.0, "radius_b": 2.0 * math.hypot(3.0, 0.4) / 3.0} | more
    joints = (Revolute(0, 1), Revolute(0, 2, (3.0, 0.4)), Gear(1, 2, **given))
    return Mechanism(GRAPH, joints, (Driver(0, 1),))


def cammed():
    """A cam on the driver, a rocker with a roller."""
    cam = Cam(1, 2, at_b=(2.6, 0.0), radius=1.2, harmonics=((0.25, 0.1), (0.05, 0.0)))
    pose = ((0.0, 0.0, 0.0), (0.0, 0.0, 0.0), (3.0, 0.0, 2.6))
    return Mechanism(GRAPH, (Revolute(0, 1), Revolute(0, 2, (3.0, 0.0)), cam), (Driver(0, 1),), pose=pose)


def planetary():
    joints = (Revolute(0, 1), Revolute(1, 2, (3.0, 0.0)), Gear(0, 2, radius_a=1.8, radius_b=1.2))
    return Mechanism(PLANET, joints, (Driver(0, 1),))


def ringed(few, many):
    """A planet in a ring on the frame, with the fewest teeth that mesh."""
    joints = (Revolute(0, 1), Revolute(1, 2, (3.0, 0.0)))
    unit = 3.0 / (many - few)
    gear = Gear(0, 2, radius_a=many * unit, radius_b=few * unit, internal=True)
    return Mechanism(PLANET, (*joints, gear), (Driver(0, 1),))


def train():
    """Sun, planet, carrier, and a ring on the frame."""
    graph = MechanismGraph(4, [(0, 1), (0, 3), (2, 3), (1, 2, 2), (0, 2, 2)], frame=0)
    turning = (Revolute(0, 1), Revolute(0, 3), Revolute(2, 3, (0.0, 0.0), (3.0, 0.0)))
    gears = (Gear(1, 2, radius_a=2, radius_b=1), Gear(0, 2, radius_a=4, radius_b=1, internal=True))
    return Mechanism(graph, (*turning, *gears), (Driver(0, 1),))


def distances(P, Q):
    """Distances of points (n,) from the sides of a closed polygon (m,)."""
    side = np.roll(Q, -1) - Q
    part = np.clip((np.conj(side) * (P[:, None] - Q)).real / np.abs(side) ** 2, 0.0, 1.0)
    return np.abs(P[:, None] - Q - part * side).min(axis=1)


def edges(made, poses):
    """Boundaries of both sheets that touch, at poses; of a ring its hole."""
    ((one, other),) = made.plan.touching
    shapes = [(made.plan.holes[k][0] if "ring" in made.plan.wheel(k) else made.plan.outlines[k]) for k in (one, other)]
    return [
        carried(np.array(own.flat(1e-3)), poses, made.plan.links[k], made.unit) for own, k in zip(shapes, (one, other))
    ]


@pytest.mark.long
@pytest.mark.parametrize(
    "mechanism",
    [geared(), planetary(), ringed(17, 34), ringed(25, 34), ringed(41, 50)],
    ids=["pair", "planet", "ring", "ring with nine teeth more", "the same with more"],
)
def test_teeth_mesh_and_nowhere_cut_each_other(mechanism):
    made = gs.parts(gs.simulate(mechanism, np.linspace(0.0, 2.0 * math.pi, 73)), unit=60.0)
    assert made.certified and "touch by design" in made.statement
    ((one, other),) = made.plan.touching
    assert made.layers[one] == made.layers[other] > 0
    module = float(made.plan.wheel(one).split()[-2])
    inputs = np.linspace(0.0, 1.0, 41)  # more than a pitch, between the samples
    for P, Q in zip(*edges(made, gs.simulate(mechanism, inputs).poses)):
        for A, B in ((P, Q), (Q, P)):
            shape = Path(np.column_stack([B.real, B.imag]))
            within = shape.contains_points(np.column_stack([A.real, A.imag]))
            assert within.all() if "ring" in made.plan.wheel(one) and A is Q else not within.any()
        near = min(distances(P, Q).min(), distances(Q, P).min())
        assert near < 0.04 * module  # the play of a pitch, of which a flank has half at most


def test_a_wheel_has_its_teeth_and_its_mass():
    made = gs.parts(gs.simulate(geared(), np.linspace(0.0, 6.0, 40)), unit=60.0, prove=False)
    ((one, other),) = made.plan.touching
    for sheet, count in ((one, 17), (other, 34)):
        outline, holes = made.plan.outlines[sheet], made.plan.holes[sheet]
        z = np.array(outline.flat(1e-3)) - outline.hull[0]
        crossings = np.diff(np.abs(np.append(z, z[0])) > outline.pitch)
        assert crossings.sum() == 2 * count and f"{count} teeth" in made.plan.wheel(sheet)
        assert math.isclose(outline.pitch, count * float(made.plan.wheel(sheet).split()[-2]) / 2.0, rel_tol=1e-3)
        area = polygon_moments(np.array(outline.flat(1e-3)))[0] - sum(math.pi * h.radius**2 for h in holes)
        assert math.isclose(made.moments(sheet).area, area, rel_tol=1e-9)
        assert len(holes) == 3  # the pivot and two dowels
    text = str(made)
    assert "1w" in text and {"wheel 1w", "wheel 2w"} <= {row.part for row in made.bill}


def test_a_train_with_a_ring_is_built():
    """The shaft of the sun and the carrier goes through the hole of the ring, which is on the board."""
    made = gs.parts(gs.simulate(train(), np.linspace(0.0, 6.0, 25)), unit=30.0, prove=False)
    told = {made.plan.label(k): made.plan.wheel(k).split(",")[:2] for k in range(4, 8)}
    assert told["0w"] == ["ring", " 68 teeth"] and told["1w"] == ["wheel", " 34 teeth"]
    assert [told[k][1] for k in ("2w", "2w2")] == [" 17 teeth"] * 2
    assert made.sizes.pin == 2.0 * 4.0 * 30.0 / 40.0  # a fortieth of the ring, the largest part
    assert "0w-2w, 1w-2w2: they touch by design" in str(made)
    ring = next(k for k in range(4, 8) if made.plan.label(k) == "0w")
    shaft = next(pin for pin in made.plan.pins if pin.kind == "shaft")
    assert made.plan.through(shaft) == [ring] and min(made.layers[k] for k in (1, 3)) > made.layers[ring]
    outline, holes = made.plan.outlines[ring], made.plan.holes[ring]
    area = math.pi * outline.radius**2 - sum(polygon_moments(np.array(h.flat(1e-4)))[0] for h in holes)
    assert math.isclose(made.moments(ring).area, area, rel_tol=1e-6)
    for dowel in holes[1:]:  # in the rim
        far = abs(dowel.hull[0] - outline.hull[0])
        assert holes[0].radius + dowel.radius < far < outline.radius - dowel.radius


def test_a_roller_touches_its_cam_all_around():
    motion = gs.simulate(cammed(), np.linspace(0.0, 2.0 * math.pi, 73))
    made = gs.parts(motion, unit=60.0)
    assert made.certified and "touch by design" in made.statement
    ((cam, roller),) = made.plan.touching
    assert made.layers[cam] == made.layers[roller] and made.plan.wheel(roller) == "roller"
    poses = gs.simulate(cammed(), np.linspace(0.1, 6.2, 101)).poses
    centre, radius = made.plan.outlines[roller].hull[0], made.plan.outlines[roller].radius
    disk = carried(np.array(made.plan.outlines[cam].flat(1e-3)), poses, 1, 60.0)
    far = [distances(at, edge)[0] for at, edge in zip(carried(np.array([centre]), poses, 2, 60.0), disk)]
    assert np.abs(np.array(far) - radius).max() < 0.003  # mm: the cam is a polygon of 720 corners
    fine = gs.parts(gs.simulate(cammed(), np.linspace(0.0, 2.0 * math.pi, 721)), unit=60.0, prove=False)
    assert fine.layers == made.layers and fine.gap - 0.1 < made.gap <= fine.gap


@pytest.mark.long
def test_files_hold_the_teeth(tmp_path):
    ezdxf = pytest.importorskip("ezdxf")
    made = gs.parts(gs.simulate(geared(), np.linspace(0.0, 6.0, 40)), unit=60.0, prove=False)
    made.write(tmp_path, forms=("dxf", "svg"))
    drawing = ezdxf.readfile(tmp_path / "cut.dxf")
    lines = [len(line) for line in drawing.modelspace().query("LWPOLYLINE[layer=='OUTLINE']")]
    assert sorted(lines)[-2:] == [17 * 18, 34 * 18]  # both reach below their base circles
    assert (tmp_path / "cut.svg").read_text("utf-8").count("<circle") == 2  # pitch circles


def test_nothing_is_written_where_a_package_is_missing(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "build123d", None)
    made = gs.parts(gs.simulate(geared(), np.linspace(0.0, 6.0, 9)), unit=60.0, prove=False)
    with pytest.raises(MissingExtraError, match="STEP needs build123d"):
        made.write(tmp_path / "out", forms=("svg", "stl", "step"))
    assert not list((tmp_path / "out").iterdir())


@pytest.mark.parametrize(
    ("mechanism", "words"),
    [
        (geared(radius_a=math.pi / 3.0, radius_b=math.hypot(3.0, 0.4) - math.pi / 3.0), "whole numbers"),
        (geared(radius_a=1.0, radius_b=3.0), "centres of gear 1-2 are 3.02655"),
        (geared(radius_a=1.0, radius_b=4.0, internal=True), "3.02655 apart, and its pitch circles touch at 3;"),
    ],
)
def test_what_cannot_mesh_is_refused(mechanism, words):
    with pytest.raises(GeometryError, match=words):
        gs.parts(gs.simulate(mechanism, np.linspace(0.0, 1.0, 9)), unit=60.0)
