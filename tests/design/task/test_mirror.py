"""Mechanisms that are their own mirror image: which chains can be, and that they move as their image backwards."""

from __future__ import annotations

import math
from itertools import permutations

import numpy as np
import pytest

import graphsynth as gs
from graphsynth.core.errors import GeometryError
from graphsynth.design import DesignTask, PathTarget, SwingTarget, design
from graphsynth.design.task.model import Model
from graphsynth.design.task.plans import plans
from graphsynth.design.task.starts import random_starts
from graphsynth.kinematics.dimensional.design import Design, choices
from graphsynth.kinematics.dimensional.mirror import mirrors
from graphsynth.synthesis import enumerate_chains

ARCH = PathTarget(points=[(x, 0.5 * (4.0 - x * x)) for x in np.linspace(-2.0, 2.0, 9).tolist()], tolerance=0.01)


@pytest.mark.parametrize("links", [4, 6])
def test_mirrors_are_the_automorphisms_that_exchange_all_links_but_frame_and_driver(links: int) -> None:
    """Every permutation is tried."""
    found = 0
    for chain in enumerate_chains(links):
        for graph, drivers in choices(chain, None):
            own = Design(graph, drivers, ("R",) * len(graph.joints))
            pairs = {frozenset(joint[:2]) for joint in graph.joints}
            every = {
                image
                for image in permutations(range(links))
                if {frozenset((image[a], image[b])) for a, b, _ in graph.joints} == pairs
                and all(image[image[k]] == k and (image[k] == k) == (k in drivers[0]) for k in range(links))
            }
            assert {*mirrors(own)} == every
            found += len(every)
    assert found == (0 if links == 4 else 1)  # Watt's chain: two four-bars on one crank


def test_a_mirrored_mechanism_moves_backwards_as_its_mirror_image() -> None:
    """Random ones of every plan with eight links, the axis and the images found here from the places alone."""
    task, random = DesignTask(targets=[ARCH], links=[8], symmetric=True), np.random.default_rng(3)
    every = list(plans(task, 8))
    assert len(every) == 3  # couplers, followers, or a group of all links but the crank meet on the axis
    for plan in every:
        model = Model(task, plan, random)
        u = random_starts(model, 60, random)
        z = u.places @ [1.0, 1.0j]
        pivot = plan.design.driver_joints[0]
        moved = model.move(u)
        assert moved.complete.sum() > 3
        joints = [joint.a for joint in plan.design.graph.joints]
        frames = moved.frames.view(np.complex128)
        checked = 0
        for k in np.flatnonzero(moved.complete):
            at = z[k] - z[k, pivot]
            turns = {  # squares of the direction of an axis through the pivot that carries all joints to joints
                complex(at[p] * at[q] / abs(at[p] * at[q]))
                for p in range(len(at))
                for q in range(p)
                if pivot not in (p, q)
            }
            images = {turn: np.abs(at[:, None] - turn * np.conj(at)).argmin(axis=1) for turn in turns}
            gaps = {turn: np.abs(at - turn * np.conj(at[own])).max() for turn, own in images.items()}
            turn = min(gaps, key=lambda own: gaps[own])
            assert gaps[turn] < 1e-9 * np.abs(at).max()
            path = frames[k][:, joints, 0] + frames[k][:, joints, 1] * z[k] - z[k, pivot]
            assert np.abs(path[::-1] - turn * np.conj(path[:, images[turn]])).max() < 1e-6 * np.abs(at).max()
            point = u.points[k, 0] @ [1.0, 1.0j] - z[k, pivot]
            assert abs(point - turn * np.conj(point)) < 1e-9 * np.abs(at).max()
            checked += 1
        assert checked > 3


@pytest.mark.slow
def test_a_mirrored_mechanism_draws_an_arch_from_a_pivot_that_is_given() -> None:
    """The curve and its reflection about the line through the motor that its places at the input 0 tell."""
    task = DesignTask(targets=[ARCH], links=[8], symmetric=True, drive_pivot=(0, -4))
    found = design(task, count=1, seconds=300, processor_seconds=60)
    assert found.accepted and found[0].certified, found
    motion = gs.simulate(found[0].mechanism, np.linspace(0.0, math.tau, 721))
    z = motion.point("P").position @ [1.0, 1.0j] + 4.0j
    assert np.abs(z[::-1] - (z[0] / abs(z[0])) ** 2 * np.conj(z)).max() < 1e-9
    pivots = [joint.at_a for joint in found[0].mechanism.joints if joint.a == found[0].mechanism.frame]
    assert (0.0, -4.0) in pivots and len(pivots) == 3
    apart = [math.dist(p, (0, -4)) for p in pivots if p != (0.0, -4.0)]
    assert apart[0] == pytest.approx(apart[1], rel=1e-9)


@pytest.mark.parametrize(
    "more", [{"links": [6]}, {"links": [4, 8]}, {"links": [8], "sliders": 1}, {"links": [8], "drive": "slide"}]
)
def test_a_mirror_that_does_not_fit_is_refused(more: dict[str, object]) -> None:
    with pytest.raises(GeometryError, match=r"symmetric, links = .*; from six"):
        DesignTask(targets=[ARCH], symmetric=True, **more)  # type: ignore[arg-type]
    assert DesignTask(targets=[SwingTarget(least=1.0)], links=[6], symmetric=True).mirrored
