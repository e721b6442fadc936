"""Gear trains that move as mechanisms turn as the equations of Willis say."""

from __future__ import annotations

import random

import numpy as np
import pytest
import sympy

from graphsynth import PlanetaryGearTrain, enumerate_planetary_gear_trains
from graphsynth.core.errors import GraphError, SpecError

SIMPLE = PlanetaryGearTrain.from_axes(4, [(0, 1, 2), (2, 3)], [(0, 3), (1, 3)])
RAVIGNEAUX = PlanetaryGearTrain.from_axes(6, [(0, 1, 2, 3), (3, 4), (3, 5)], [(0, 4), (4, 5), (1, 5), (2, 5)])
TEETH = {(0, 4): (28, 18), (4, 5): (18, 30), (1, 5): (36, 30), (2, 5): (-72, 30)}


def turned(train, way, teeth, turn):
    """Return the ratio of how far input and output have turned, by the motion of the mechanism."""
    motion = train.mechanism(way[0], way[2], teeth=teeth).simulate(np.linspace(0.0, turn, 41))
    assert motion.assembled.all(), motion.reason
    angles = motion.poses[:, :, 2]
    return (angles[-1, way[0]] - angles[0, way[0]]) / (angles[-1, way[1]] - angles[0, way[1]])


@pytest.mark.long
@pytest.mark.parametrize("way", [(0, 2, 3), (0, 2, 1), (1, 2, 3)])
def test_a_ravigneaux_train_turns_as_its_ratios(way):
    assert turned(RAVIGNEAUX, way, TEETH, 7.0) == pytest.approx(float(RAVIGNEAUX.ratio(*way, teeth=TEETH)), rel=1e-9)


@pytest.mark.long
@pytest.mark.parametrize("links", [4, 5, 6])
def test_trains_turn_as_their_ratios(links):
    compared = 0
    for k, train in enumerate(enumerate_planetary_gear_trains(links)):
        rng = random.Random(k)
        teeth = {pair[:2]: rng.choice([(20, 20), (-60, 20), (20, -61), (17, 31)]) for pair in train.gears}
        for way in train.arrangements()[:4]:
            try:
                ratio = float(train.ratio(*way, teeth=teeth))
            except GraphError:  # the output stands still, or the teeth lock the train
                continue
            assert turned(train, way, teeth, 1.0) == pytest.approx(ratio, rel=1e-9)
            compared += 1
    assert compared >= 8


@pytest.mark.long
def test_a_train_of_two_freedoms_has_two_inputs():
    compared = 0
    for train in enumerate_planetary_gear_trains(6, 2, framed=True):
        teeth = {pair[:2]: (20, 31) for pair in train.gears}
        inputs = [link for link in range(1, 6) if any({0, link} <= set(axis) for axis in train.axes)][:2]
        try:
            speeds = train.speeds({0: 0} | dict.fromkeys(inputs, 1), teeth=teeth)
        except GraphError:  # one of them drives the other
            continue
        if len(inputs) == 2:
            motion = train.mechanism(inputs, teeth=teeth).simulate(np.linspace(0.0, 1.0, 21))
            angles = (motion.poses[-1] - motion.poses[0])[:, 2]
            assert angles.tolist() == pytest.approx([float(speeds[link]) for link in range(6)], abs=1e-9)
            compared += 1
    assert compared > 5


def test_teeth_of_one_module_have_their_radii():
    """Sun 20, planet 20, ring 60: the distance is 20, the radii are half the teeth."""
    mechanism = SIMPLE.mechanism(0, 1, teeth={(0, 3): (20, 20), (1, 3): (-60, 20)})
    sizes = {joint.pair: (joint.radius_a, joint.radius_b) for joint in mechanism.joints if joint.kind == "gear"}
    assert sizes == {(0, 3): pytest.approx((10, 10)), (1, 3): pytest.approx((30, 10))}
    assert mechanism.graph.frame == 1
    assert mechanism.drivers[0].pair == (0, 1)


def test_bad_teeth_and_inputs_get_one_sentence():
    good = {(0, 3): (20, 20), (1, 3): (-60, 20)}
    z = sympy.Symbol("z")
    for call, words in [
        (lambda: SIMPLE.mechanism(3, 1, teeth=good), "link 3 does not turn about an axis of link 1"),
        (lambda: SIMPLE.mechanism([0, 2], 1, teeth=good), r"mobility 1 takes as many inputs, not \[0, 2\]"),
        (lambda: SIMPLE.mechanism(0, teeth=good), "no link is fixed"),
        (lambda: SIMPLE.mechanism(0, 1, teeth=good | {(1, 3): (-20, 60)}), "must be the larger one"),
        (lambda: SIMPLE.mechanism(0, 1, teeth=good | {(1, 3): (-20, 20)}), "must be the larger one"),
        (lambda: SIMPLE.mechanism(0, 1, teeth=good | {(1, 3): (z, 20)}), "must be numbers"),
    ]:
        with pytest.raises((GraphError, SpecError), match=words):
            call()
