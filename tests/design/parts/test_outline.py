"""Area, centroid and second moment of rounded polygons against closed forms of the textbooks and fine polygons."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from graphsynth.design import Rounded

SHAPES = [
    [0j, 10 + 0j],
    [3 + 1j],
    [0j, 4 + 0j, 3 + 5j, 1 + 1j, 5 + 2j, 2j],
    [1j, 4 + 0j, -3 - 2j],
    [0j, 1 + 1j, 2 + 2j],
]


def polygon_moments(points):
    """Moments of a polygon by the usual sums over its edges."""
    z = np.array(points)
    w = np.roll(z, -1)
    cross = (z.conj() * w).imag
    second = (np.abs(z) ** 2 + (z.conj() * w).real + np.abs(w) ** 2) * cross
    return cross.sum() / 2, ((z + w) * cross).sum() / 6, second.sum() / 12


@pytest.mark.parametrize("hull", SHAPES)
@pytest.mark.parametrize("radius", [0.3, 2.0])
def test_moments_are_those_of_a_fine_polygon(hull, radius):
    shape = Rounded.around(hull, radius)
    area, first, second = polygon_moments(shape.flat(1e-7))
    found = shape.moments
    assert found.area == pytest.approx(area, rel=1e-6) and found.area > area
    assert abs(found.first - first) < 1e-6 * abs(area) * (1 + abs(first / area))
    assert found.second == pytest.approx(second, rel=1e-6)


def test_disc_stadium_and_square_have_their_closed_forms():
    disc = Rounded.around([2 + 1j], 3.0).moments
    assert disc.area == pytest.approx(9 * math.pi, rel=1e-14)
    assert disc.centroid == pytest.approx(2 + 1j, rel=1e-14)
    assert disc.central == pytest.approx(math.pi * 81 / 2, rel=1e-13)
    r, way = 2.0, 10.0
    bar = Rounded.around([0j, way + 0j], r).moments
    assert bar.area == pytest.approx(2 * r * way + math.pi * r * r, rel=1e-14)
    # rectangle, and two half discs whose centroids are 4 r / (3 pi) beyond its ends
    half, out = math.pi * r * r / 2, way / 2 + 4 * r / (3 * math.pi)
    own = math.pi * r**4 / 4 - half * (4 * r / (3 * math.pi)) ** 2
    inertia = 2 * r * way * (way**2 + 4 * r * r) / 12 + 2 * (own + half * out**2)
    assert bar.central == pytest.approx(inertia, rel=1e-13)
    a, r = 6.0, 1.0
    square = Rounded.around([0j, a + 0j, a + a * 1j, a * 1j], r).moments
    assert square.area == pytest.approx(a * a + 4 * a * r + math.pi * r * r, rel=1e-14)
    assert square.centroid == pytest.approx((1 + 1j) * a / 2, rel=1e-13)


def test_corners_that_differ_by_rounding_are_one():
    shape = Rounded.around([0j, 1e-13 + 1e-13j, 5 + 1e-14j, 10 + 0j, 10 - 1e-13j], 2.0)
    assert len(shape.hull) == 2 and shape.moments.area == pytest.approx(40 + 4 * math.pi, rel=1e-12)
    upright = Rounded.around([-1e-15 - 139j, 1e-15 - 170j, 128 - 48j, 0j], 9.0)
    assert len(upright.hull) == 3


points = st.lists(st.complex_numbers(max_magnitude=50, allow_nan=False), min_size=1, max_size=7)


@given(points, st.floats(0.1, 5.0))
@settings(max_examples=60, deadline=None)
def test_every_point_is_inside_and_the_boundary_at_the_radius(hull, radius):
    shape = Rounded.around(hull, radius)
    boundary = np.array(shape.flat(1e-3))
    corners = np.array(shape.hull)
    # no point of the boundary is nearer to a corner than the radius; every given point is as far inside
    assert np.abs(boundary[:, None] - corners).min(axis=1).min() >= radius * (1 - 1e-7)
    edges = np.roll(boundary, -1) - boundary
    keep = np.abs(edges) > 1e-9
    normal = 1j * edges[keep] / np.abs(edges[keep])
    depth = (normal.conj()[:, None] * (np.array(hull)[None, :] - boundary[keep][:, None])).real
    assert depth.min() >= radius - 2e-3 - 1e-6 * max(map(abs, hull))
