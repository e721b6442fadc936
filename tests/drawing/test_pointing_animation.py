"""The moving antenna: geometry of the projection, closed and valid SVG, refusals."""

from __future__ import annotations

import math
import re
from xml.etree import ElementTree

import numpy as np
import pytest

from graphsynth.core.errors import GeometryError
from graphsynth.drawing.moving import Moving
from graphsynth.systems.antenna import PointingMechanism
from graphsynth.systems.antenna.animation import pointing_animation, project
from graphsynth.systems.antenna.pictures import difference_map_picture

ART = PointingMechanism()


def test_projection_keeps_lengths_across_the_view():
    """Two perpendicular directions of the page are unit vectors in space, the direction of view vanishes."""
    azimuth, elevation = 0.7, 0.4
    view = [math.cos(elevation) * math.cos(azimuth), math.cos(elevation) * math.sin(azimuth), math.sin(elevation)]
    columns = project(np.eye(3), azimuth, elevation)
    np.testing.assert_allclose(columns.T @ columns, np.eye(2), atol=1e-15)
    np.testing.assert_allclose(project(np.array(view), azimuth, elevation), 0.0, atol=1e-15)


def test_animation_is_one_valid_svg_whose_rods_keep_their_length():
    turn = np.linspace(0.0, math.tau, 25)
    svg = pointing_animation(ART, 0.6 * np.sin(turn), 0.6 * np.sin(2 * turn))
    root = ElementTree.fromstring(svg)
    moves = [part for part in root.iter() if part.tag.endswith("animate")]
    assert len(moves) >= 10
    assert all(len(part.attrib["values"].split(";")) == 25 for part in moves)
    assert all(part.attrib["values"].split(";")[0] == part.attrib["values"].split(";")[-1] for part in moves)
    assert "prefers-reduced-motion" in svg and 'class="rest"' in svg
    assert not re.search(r"nan|inf[^o]", svg)


def test_what_rests_does_not_move():
    drawing = Moving(10.0, 10.0, 1.0)
    drawing.path([np.array([[0.0, 0.0], [1.0, 1.0]])] * 3, "")
    drawing.box([0.0, 0.0, 0.0], 1.0, 2.0, 3.0, "")
    drawing.shown([True, False, True], "<path/>")
    assert drawing.svg("").count("<animate ") == 1


def test_refusals():
    with pytest.raises(GeometryError, match="at least two poses"):
        pointing_animation(PointingMechanism(l3=0.1, l5=0.1), [0.0, 1.3], [0.0, 1.3])
    with pytest.raises(GeometryError, match="nodes = 1"):
        difference_map_picture(ART, nodes=1)


def test_difference_map_holds_the_published_corner():
    axes = difference_map_picture(ART, nodes=3).axes[0]
    values = axes.collections[0].get_array().reshape(3, 3)
    assert values[2, 2] == pytest.approx(30.9895760535, abs=1e-9)
    assert values[1, 1] == pytest.approx(0.0, abs=1e-12)
