"""Mechanisms that know their range and the names of links, and numbers without noise."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

import graphsynth as gs
from graphsynth.core.errors import FormatError, GeometryError
from graphsynth.drawing.frames import motion_over_reach
from graphsynth.mechanism.scaling import rounded


def bar() -> gs.Mechanism:
    own = gs.Mechanism.four_bar(4.0, 1.5, 3.5, 3.0, coupler_point=(1.6, 1.9))
    return replace(own, input_range=(0.1, 1.2), link_names={"blade": 3, 'rod "B"': 2})


def test_range_and_names_come_back_from_files() -> None:
    own = bar()
    for text in (own.to_toml(), own.to_json()):
        again = gs.Mechanism.from_toml(text) if text == own.to_toml() else gs.Mechanism.from_json(text)
        assert again == own and again.input_range == (0.1, 1.2) and again.link_names["blade"] == 3
    plain = gs.Mechanism.four_bar(4.0, 1.5, 3.5, 3.0)
    assert "input_range" not in plain.to_toml() and "link_names" not in plain.to_json()
    assert own.scaled(2.0).input_range == own.input_range and own.scaled(2.0).link_names == own.link_names


def test_without_inputs_it_moves_over_its_range() -> None:
    for motion in (gs.simulate(bar()), motion_over_reach(bar())):
        assert motion.inputs[0] == 0.1 and motion.inputs[-1] == 1.2 and len(motion.inputs) == 361
    assert gs.simulate(bar(), [0.0, 2.0]).inputs.tolist() == [0.0, 2.0]


@pytest.mark.parametrize(
    ("more", "words"),
    [
        ({"input_range": (1.0, 1.0)}, "two different ends"),
        ({"input_range": (1.0,)}, "first, last"),
        ({"input_range": (0.0, math.nan)}, "input_range"),
        ({"link_names": {"blade": 9}}, "links are 0..3"),
        ({"link_names": {"": 1}}, "not empty"),
        ({"link_names": [1]}, "not a mapping"),
    ],
)
def test_what_cannot_be_is_refused(more: dict[str, object], words: str) -> None:
    with pytest.raises(GeometryError, match=words):
        replace(bar(), **more)


def test_files_with_a_wrong_range_name_it() -> None:
    for wrong in ("input_range = 3", 'input_range = ["a", 1]', "link_names = 2"):
        text = gs.Mechanism.four_bar(4.0, 1.5, 3.5, 3.0).to_toml().replace("version = 1", f"version = 1\n{wrong}")
        with pytest.raises(FormatError, match=wrong.split()[0]):
            gs.Mechanism.from_toml(text)


def test_rounding_takes_noise_away_and_nothing_else() -> None:
    random = np.random.default_rng(1)
    own = bar()
    joints = tuple(
        replace(
            j, **{n: tuple(v * (1 + 4e-16) + random.normal() * 1e-17 for v in getattr(j, n)) for n in ("at_a", "at_b")}
        )
        for j in own.joints
    )
    assert rounded(replace(own, joints=joints)).joints == rounded(own).joints
    assert all(v == 0.0 or abs(v) > 1e-3 for j in rounded(own).joints for v in (*j.at_a, *j.at_b))
    far = gs.simulate(rounded(own)).poses - gs.simulate(own).poses
    assert np.abs(far).max() < 1e-12
