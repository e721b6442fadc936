"""Pictures of mechanisms in space show their joints, tilts and what was made wrong."""

import math
import re

import numpy as np
import pytest

from graphsynth.core.errors import GeometryError
from graphsynth.drawing.space_pictures import mechanism_in_space
from graphsynth.jamming.joints import JointLimits
from graphsynth.jamming.space import Axis, from_axes

from ..plain_svg import faults

CORNERS = ((0.0, 0.0, 0.0), (0.0, 1.0, 0.0), (2.0, 2.5, 0.0), (2.0, 0.0, 0.0))


def four_bar():
    made = (CORNERS[0], (0.0, -math.sin(0.02), math.cos(0.02)))
    return from_axes([Axis(k, (k + 1) % 4, p, (0, 0, 1), JointLimits(0.1), k == 0, made if k == 0 else None)
                      for k, p in enumerate(CORNERS)])  # fmt: skip


def texts(svg):
    return set(re.findall(r">([^<>]+)</text>", svg))


def test_names_shares_and_errors_are_written():
    model = four_bar()
    q = np.zeros(model.width)
    q[model.column[2, 1]] = 2.0 * math.tan(0.025)  # a tilt of 0.05 of 0.1
    svg = mechanism_in_space(model, q, names={0: "O", 2: "B"}, title="A & B")
    assert faults(svg) == [] and "<title>A &amp; B</title>" in svg
    assert texts(svg) == {"O · 0 % · 1.1° off", "B · 50 %", "0 %"}
    assert svg.count("<circle") == 4 and svg.count("stroke-dasharray") == 5  # four axes and the frame


def test_tilts_are_magnified_and_places_are_not():
    model = four_bar()
    q = np.zeros(model.width)
    q[model.column[2, 1]] = 0.05
    one, more = (mechanism_in_space(model, q, magnified=m) for m in (1.0, 10.0))
    assert re.findall(r"<circle[^>]*>", one) == re.findall(r"<circle[^>]*>", more) and one != more


def test_the_frame_of_links_follows_the_turns():
    """A quarter turn of the crank moves its pin, seen from above, from the y axis to the negative x axis."""
    model = from_axes([Axis(k, (k + 1) % 4, p, (0, 0, 1), driven=k == 0) for k, p in enumerate(CORNERS)])
    q = np.zeros(model.width)
    q[-1] = 0.5 * math.pi
    svg = mechanism_in_space(model, q, view=(-90.0, 90.0), names=dict(enumerate("OABC")))
    at = [tuple(map(float, xy)) for xy in re.findall(r'<circle cx="([^"]*)" cy="([^"]*)" r="(?:2|3.5)"', svg)]
    ((x, y),) = [tuple(map(float, xy)) for xy in re.findall(r'<circle cx="([^"]*)" cy="([^"]*)" r="3.5"', svg)]
    assert len(at) == 4 and [u < x for u, v in at if abs(v - y) < 0.1 and (u, v) != (x, y)].count(True) == 1


def test_a_centre_is_joined_with_every_joint():
    assert mechanism_in_space(four_bar(), centre=(1, 1, 1)).count('stroke-width="1"') == 4


def test_bad_input_is_refused():
    model = four_bar()
    for q in (np.zeros(2), np.full(model.width, np.nan)):
        with pytest.raises(GeometryError, match="coordinates"):
            mechanism_in_space(model, q)
    with pytest.raises(GeometryError, match="positive"):
        mechanism_in_space(model, magnified=0.0)
