"""Linkages that move by themselves: the frames are the positions of the model."""

import math
import re

import numpy as np
import pytest

from graphsynth import LambdaLinkage
from graphsynth.core.errors import GeometryError
from graphsynth.drawing.moving import Bar, linkage_animation
from graphsynth.drawing.palette import LIGHT
from graphsynth.drawing.sketch import Sketch
from graphsynth.systems.lambda_linkage.pictures import lambda_animation


def frames_of(svg, mark):
    return re.search(mark + r'[^>]*>\s*<animate attributeName="d"[^>]*values="([^"]*)"', svg)[1].split(";")


def test_a_bar_ends_where_its_joints_are():
    sketch = Sketch(-1 - 1j, 1 + 1j, 300)
    A = np.exp(1j * np.linspace(0.0, 3.0, 7))
    svg = linkage_animation(sketch, {"O": 0j, "A": A}, bars=[Bar("O", "A", "b", 5)])
    frames = frames_of(svg, f'stroke="{LIGHT["b"]}"')
    assert len(frames) == 7
    for frame, point in zip(frames, A):
        numbers = [float(x) for x in re.findall(r"-?\d+\.?\d*", frame)]
        expected = [*sketch.xy(0j), *sketch.xy(point)]
        assert numbers == pytest.approx(expected, abs=0.051)


def test_tracks_of_other_lengths_and_places_that_do_not_exist_are_refused():
    sketch = Sketch(-1 - 1j, 1 + 1j, 300)
    with pytest.raises(ValueError, match="track of A has 3 places; give 5"):
        linkage_animation(sketch, {"A": np.zeros(3), "B": np.zeros(5)})
    with pytest.raises(ValueError, match="track of A has a place that is not finite"):
        linkage_animation(sketch, {"A": [0.0, math.nan]})


def test_the_lambda_linkage_says_where_it_binds():
    svg = lambda_animation(LambdaLinkage(2.0, 1.0, 2.5, 2.5), lambda f: f < math.pi, frames=12)
    shown = re.search(r'B binds</text><animate attributeName="display"[^>]*values="([^"]*)"', svg)[1].split(";")
    assert shown == ["inline"] * 6 + ["none"] * 7


def test_a_linkage_that_cannot_be_assembled_does_not_move():
    with pytest.raises(GeometryError, match="cannot be assembled at any crank angle"):
        lambda_animation(LambdaLinkage(9.0, 1.0, 2.5, 2.5))
