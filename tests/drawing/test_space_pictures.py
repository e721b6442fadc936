"""Pictures of mechanisms in space show their joints, tilts and what was made wrong."""

import math
import re
from itertools import pairwise

import numpy as np
import pytest

from graphsynth.core.errors import GeometryError
from graphsynth.drawing.palette import LIGHT
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


def covered(svg):
    """Lines that run through letters, and letters that stand on others; a letter is seven pixels wide here."""
    found = re.findall(r'<g [^>]*><text x="([^"]*)" y="([^"]*)" [^>]*>([^<]*)<', svg)
    boxes = [np.array([[float(x) - 3.5 * len(t), float(y) - 11.0], [float(x) + 3.5 * len(t), float(y)]])
             for x, y, t in found]  # fmt: skip
    lines = [[complex(*map(float, p.split())) for p in path.strip("Z").split(" L")]
             for path in re.findall(r'<path d="M([^"]*)"', svg)]  # fmt: skip
    points = np.concatenate([np.linspace(p, q, 400) for line in lines for p, q in pairwise([*line, line[0]])])
    points = np.column_stack([points.real, points.imag])
    crossed = [t for (*_, t), (low, high) in zip(found, boxes) if ((low < points) & (points < high)).all(1).any()]
    return crossed + [(s[2], t[2]) for k, (s, a) in enumerate(zip(found, boxes)) for t, b in zip(found[:k], boxes)
                      if (a[0] < b[1]).all() and (b[0] < a[1]).all()]  # fmt: skip


@pytest.mark.long
@pytest.mark.parametrize("view", [(-70.0, 25.0), (-60.0, 25.0), (10.0, 40.0), (120.0, 60.0), (-90.0, 90.0)])
def test_labels_stand_on_no_line_and_on_no_other_label(view):
    """Four axes, each off in its own direction, and long labels; from above the axes are points."""
    off = ((0.01, 0.0), (0.004, -0.012), (-0.011, -0.013), (0.009, 0.016))
    model = from_axes([Axis((k - 1) % 4, k, p, (0, 0, 1), JointLimits(0.01, 0.01), k == 1, (p, (x, y, 1.0)))
                       for k, (p, (x, y)) in enumerate(zip(CORNERS[3:] + CORNERS[:3], off))])  # fmt: skip
    q = np.zeros(model.width)
    q[model.column[:, 1]] = 0.004
    svg = mechanism_in_space(model, q, view=view, magnified=10.0, names=dict(enumerate("COAB")))
    assert len(texts(svg)) == 4 and covered(svg) == []


def test_an_axis_has_the_colour_of_the_second_link():
    """Of joints between links 0-1, 1-2, 2-3 and 3-0, of which link 0 is the frame."""
    svg = mechanism_in_space(four_bar())
    axes = re.findall(r'stroke="([^"]*)" stroke-width="2.6"', svg)
    assert sorted(axes) == sorted(LIGHT[name] for name in ("a", "c", "d", "soft"))


def test_bad_input_is_refused():
    model = four_bar()
    for q in (np.zeros(2), np.full(model.width, np.nan)):
        with pytest.raises(GeometryError, match="coordinates"):
            mechanism_in_space(model, q)
    with pytest.raises(GeometryError, match="positive"):
        mechanism_in_space(model, magnified=0.0)
