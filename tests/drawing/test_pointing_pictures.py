"""Pictures of the pointing mechanism: what they show, units on the axes, hatched where nothing is proved."""

from __future__ import annotations

import io
import math

import numpy as np
import pytest

from graphsynth.core.errors import GeometryError
from graphsynth.systems.antenna import Convention, PointingMechanism
from graphsynth.systems.antenna.pictures import (
    comparison_picture,
    fold_map_picture,
    pointing_picture,
    tolerance_map_picture,
)

ART = PointingMechanism()
PARALLELOGRAM = PointingMechanism(l3=0.1, l5=0.1)


def points(line):
    return np.stack([np.asarray(part, dtype=float) for part in line.get_data_3d()], -1)


@pytest.mark.parametrize("order", ["YX", "XY"])
def test_links_keep_their_lengths_in_space(order):
    axes = pointing_picture(PointingMechanism(0.1, 0.15, 0.06, 0.14, 0.05, order), 0.6, -0.4).axes[0]
    bars = [points(line) for line in axes.lines if len(points(line)) == 2]
    drawn = sorted(round(float(np.linalg.norm(bar[1] - bar[0])), 12) for bar in bars)
    # normal, two arms, two axes of the gimbal, two axes of the cranks; cranks and rods
    assert drawn == [0.04, 0.048, 0.05, 0.06, 0.1, 0.1, 0.1, 0.14, 0.15, 0.25, 0.25]
    assert "elevation" in axes.get_title() and order in axes.get_title()


def test_impossible_pose_has_no_picture():
    with pytest.raises(GeometryError, match="leg Y"):
        pointing_picture(PARALLELOGRAM, 1.3, 1.3)


def test_comparison_shows_the_published_curves():
    figure = comparison_picture(ART, samples=41)
    a, b, c = figure.axes[:3]
    np.testing.assert_allclose(a.lines[0].get_ydata()[-1], 22.28238176921033, rtol=1e-14)
    np.testing.assert_allclose(a.lines[1].get_ydata()[-1], 24.9105413695616, rtol=1e-14)
    np.testing.assert_allclose(b.lines[0].get_ydata()[-1], 23.71208001648499, rtol=1e-14)
    np.testing.assert_allclose(b.lines[1].get_ydata()[-1], 22.44785725383752, rtol=1e-14)
    means = [line.get_ydata()[-1] for line in c.lines[:2]]
    assert (means[0] - means[1]) * 60.0 == pytest.approx(30.9895760535, abs=1e-9)
    twin = figure.axes[3]
    assert twin.lines[0].get_ydata()[-1] == pytest.approx(30.9895760535, abs=1e-9)
    assert "[′]" in twin.get_ylabel() and twin.texts[0].get_text() == "30.99′"
    assert a.get_xlabel() == "crank angle [°]"


def test_comparison_of_other_conventions():
    figure = comparison_picture(ART, ART, other_reading=Convention(side_y=-1), samples=21)
    assert figure.axes[3].lines[0].get_ydata()[-1] == pytest.approx(37.19, abs=0.006)


def test_fold_map_marks_the_folds():
    figure = fold_map_picture(PARALLELOGRAM, nodes=37)
    axes = figure.axes[0]
    lines = {line.get_label(): line for line in axes.lines}
    x, y = lines["folds of leg Y"].get_data()
    # every marked point is a fold: the margin of leg Y vanishes there
    for px, py in list(zip(np.radians(x), np.radians(y)))[::7]:
        near = [PARALLELOGRAM.poses(px + e, py).assembled for e in (-1e-6, 1e-6)]
        inside = [PARALLELOGRAM.poses(px + e, py).margin_y for e in (-1e-6, 1e-6)]
        assert any(near)
        assert np.nanmin(inside) < 0.02
    assert set(np.round(lines["folds of leg X"].get_ydata(), 9)) == {-90.0, 90.0}
    assert "can be assembled" in axes.get_title()
    values = axes.collections[0].get_array()
    assert np.ma.masked_invalid(values).min() >= 0.0


def test_tolerance_map_hatches_what_is_undecided():
    figure = tolerance_map_picture(PARALLELOGRAM, span=1.3, nodes=3)
    axes = figure.axes[0]
    values = np.ma.masked_invalid(axes.collections[0].get_array()).reshape(3, 3)
    assert values.mask.any() and not values.mask.all()
    want = PARALLELOGRAM.tolerance(0.0, 0.0, method="mean_value").a.deviation
    assert values[1, 1] == pytest.approx(max(map(abs, want)))
    assert axes.patch.get_hatch()
    assert "[″]" in figure.axes[-1].get_ylabel()


@pytest.mark.long
def test_pictures_can_be_written():
    for figure in (pointing_picture(ART, 0.3, 0.2), tolerance_map_picture(ART, (1e-5,) * 5, span=0.3, nodes=2)):
        for kind in ("png", "svg"):
            buffer = io.BytesIO()
            figure.savefig(buffer, format=kind)
            assert buffer.tell() > 5000


def test_bad_requests():
    with pytest.raises(GeometryError, match="span = 4"):
        fold_map_picture(ART, span=4.0)
    with pytest.raises(GeometryError, match="nodes = 3"):
        fold_map_picture(ART, nodes=3)
    with pytest.raises(GeometryError, match="nodes = 1"):
        tolerance_map_picture(ART, nodes=1, span=math.pi)
