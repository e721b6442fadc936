"""Cams with a given profile: what holds them, and gaps beside them over the whole motion, against the curve itself."""

from __future__ import annotations

import math

import numpy as np
import pytest
from matplotlib.path import Path

import graphsynth as gs
from graphsynth import Driver, Mechanism, MechanismGraph
from graphsynth.design.parts import wheels
from graphsynth.design.parts.api import _tube
from graphsynth.design.parts.gaps import Solid, proved_gap
from graphsynth.design.parts.outline import Rounded
from graphsynth.mechanism.joints import Cam, Revolute

from .moving import carried
from .test_wheels import distances

UNIT, ROLLER = 60.0, 6.0
CAMS = {
    "round": Cam(1, 2, at_a=(0.3, 0.1), at_b=(2.6, 0.0), radius=1.2),
    "oval": Cam(1, 2, at_b=(2.6, 0.0), angle_a=0.7, radius=1.2, harmonics=((0.25, 0.1), (0.05, 0.0))),
    "hollow": Cam(1, 2, at_b=(2.6, 0.0), radius=1.2, harmonics=((0.0, 0.0), (0.05, 0.0), (0.12, 0.05))),
}


def follower(cam):
    """The cam on the driver, a rocker with its roller."""
    graph = MechanismGraph(3, [(0, 1), (0, 2), (1, 2, 2)], frame=0)
    pose = ((0.0, 0.0, 0.0), (0.0, 0.0, 0.0), (3.0, 0.0, 2.6))
    return Mechanism(graph, (Revolute(0, 1), Revolute(0, 2, (3.0, 0.0)), cam), (Driver(0, 1),), pose=pose)


def profile(cam, count=3001):
    """The curve itself, densely: the pitch curve moved inwards by the roller's radius, with differences for slopes."""
    psi = np.linspace(0.0, math.tau, count)
    radius = cam.radius + sum(
        c * np.cos(k * psi) + s * np.sin(k * psi) for k, (c, s) in enumerate(cam.harmonics, 1)
    ) * np.ones(count)
    pitch = UNIT * radius * np.exp(1j * (psi + cam.angle_a))
    along = np.gradient(np.append(pitch[-2], np.append(pitch, pitch[1])))[1:-1]
    return (pitch + 1j * ROLLER * along / np.abs(along))[:-1] + UNIT * complex(*cam.at_a)


def beyond(points, polygon):
    """How far points lie outside of a polygon; 0 inside."""
    inside = Path(np.column_stack([polygon.real, polygon.imag])).contains_points(
        np.column_stack([points.real, points.imag])
    )
    return np.where(inside, 0.0, distances(points, polygon))


@pytest.mark.parametrize("name", CAMS)
def test_what_holds_a_cam_holds_its_curve_and_little_more(name):
    disk, edge = wheels.cam(CAMS[name], UNIT, ROLLER), profile(CAMS[name])
    parts = disk.sectors or (disk,)
    assert bool(disk.sectors) == (name == "hollow")
    for points in (edge, np.array(disk.edge)):  # the curve, and the polygon that is cut
        out = np.min([beyond(points, np.array(part.hull)) - part.radius for part in parts], axis=0)
        assert out.max() <= 0.0
    around = max(beyond(np.array(part.hull), edge).max() + part.radius for part in parts)
    assert around < 0.003 * np.abs(edge).max()


@pytest.mark.long
@pytest.mark.parametrize("name", CAMS)
def test_gaps_beside_a_cam_hold_between_the_samples_and_are_close(name):
    """Discs on the frame and beside the roller: free is free at 2001 poses, and a thousandth of a mm less is not."""
    cam = CAMS[name]
    mechanism, disk = follower(cam), wheels.cam(cam, UNIT, ROLLER)
    tube, reason = _tube(gs.simulate(mechanism, np.linspace(0.0, math.tau, 73)), UNIT, 100_000, 60.0)
    assert not reason
    poses = gs.simulate(mechanism, np.linspace(0.0, math.tau, 2001)).poses
    curve, random, tried = profile(cam), np.random.default_rng(7), 0
    for link, centre, far in [(0, 0j, 105.0)] * 2 + [(2, 156.0 + 0j, 18.0)] * 4:
        place = complex(centre + far * np.exp(1j * random.uniform(0.0, math.tau)))
        seen = np.exp(-1j * poses[:, cam.a, 2]) * carried(np.array([place]), poses, link, UNIT)[:, 0]  # from the cam
        true = float(beyond(seen, curve).min()) - 1.0

        disc = Solid(link, Rounded((place,), 1.0))

        def proved(need, body=disc):
            return [proved_gap(Solid(cam.a, part), body, tube, need) for part in disk.sectors or (disk,)]

        if true > 1.0:
            tried += 1
            less = true - 0.003 * np.abs(curve).max()
            found = proved(less)
            assert {one.status for one in found} == {"free"} and less <= min(one.gap for one in found) <= true
            assert any(one.status != "free" for one in proved(true + 1e-3))
    assert tried > 2


@pytest.mark.parametrize("name", CAMS)
def test_parts_of_a_cam_are_certified(name):
    motion = gs.simulate(follower(CAMS[name]), np.linspace(0.0, math.tau, 73))
    made = gs.parts(motion, unit=UNIT)
    assert made.certified and "touch by design" in made.statement
    fine = gs.parts(gs.simulate(motion.mechanism, np.linspace(0.0, math.tau, 721)), unit=UNIT, prove=False)
    assert fine.layers == made.layers and fine.gap - 0.1 < made.gap <= fine.gap
