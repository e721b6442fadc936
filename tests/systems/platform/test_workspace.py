"""Workspace at a fixed orientation: published values, scan lines, growth of the area, limits, degenerate cases."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import assume, given, settings, strategies as st

from graphsynth.core.errors import GeometryError
from graphsynth.systems.platform.parallel_platform import ParallelPlatform
from graphsynth.systems.platform.workspace import Workspace, _between, constant_orientation_workspace

G1, MOCK = ParallelPlatform.g1(), ParallelPlatform.mock()

# theory/values-of-the-platform 7: platform, alpha, area, perimeter
REFERENCE = [
    (G1, 0.0, 3.2672113311537243673640656155137, 9.6623065049276481828824613970019),
    (G1, 0.15, 3.2991533339741900256747885888938, 9.7197375118854875760409107545392),
    (MOCK, 0.0, 3808.3014480513347260855427302746, 239.55826021654811475368075874568),
    (MOCK, 0.5, 5166.1798572071059869388949342348, 274.7060607681214576103636147961),
]

number = st.floats(-2.0, 2.0)
length = st.floats(0.3, 2.0)


@st.composite
def platforms(draw: st.DrawFn) -> ParallelPlatform:
    def points(scale: float) -> tuple[complex, ...]:
        return tuple(scale * complex(draw(number), draw(number)) for _ in range(3))

    return ParallelPlatform(  # type: ignore[arg-type]
        points(0.6), points(0.2), tuple(draw(length) for _ in range(3)), tuple(draw(length) for _ in range(3))
    )


def line_lengths(platform: ParallelPlatform, alpha: float, x: np.ndarray) -> np.ndarray:
    """Length of the workspace on the lines x = const, from intervals only (no arcs, no angles)."""
    z = np.exp(1j * alpha)
    found = np.zeros(len(x))
    centres = [D - z * b for D, b in zip(platform.D, platform.b)]
    for i, here in enumerate(x):
        cuts: list[float] = []
        for c, l1, l2 in zip(centres, platform.l1, platform.l2):
            for R in (l1 + l2, abs(l1 - l2)):
                if abs(here - c.real) < R:
                    h = math.sqrt(R * R - (here - c.real) ** 2)
                    cuts += [c.imag - h, c.imag + h]
        cuts.sort()
        for a, b in pairwise(cuts):
            m = complex(here, 0.5 * (a + b))
            if all(abs(l1 - l2) <= abs(m - c) <= l1 + l2 for c, l1, l2 in zip(centres, platform.l1, platform.l2)):
                found[i] += b - a
    return found


@pytest.mark.parametrize(("platform", "alpha", "area", "perimeter"), REFERENCE)
def test_published_values(platform: ParallelPlatform, alpha: float, area: float, perimeter: float) -> None:
    work = constant_orientation_workspace(platform, alpha)
    assert work.area == pytest.approx(area, rel=1e-12)
    assert work.perimeter == pytest.approx(perimeter, rel=1e-12)
    assert not work.contacts and not work.isolated and work.dimension == 2


def test_arcs_of_the_mock_up() -> None:
    """By symmetry: three outer arcs of equal length, one loop."""
    work = constant_orientation_workspace(MOCK, 0.0)
    assert [(arc.circle.leg, arc.circle.side) for arc in work.arcs] == [(k, "outer") for k in (1, 2, 3)]
    assert np.ptp([arc.length for arc in work.arcs]) < 1e-12 * work.perimeter
    assert (len(work.loops), work.components, work.holes) == (1, 1, 0)


@settings(max_examples=30, deadline=None)
@given(platforms(), st.floats(-3.0, 3.0))
def test_area_by_scan_lines(platform: ParallelPlatform, alpha: float) -> None:
    work = constant_orientation_workspace(platform, alpha)
    assume(not work.contacts)
    z = np.exp(1j * alpha)
    centres = [D - z * b for D, b in zip(platform.D, platform.b)]
    low = max(c.real - l1 - l2 for c, l1, l2 in zip(centres, platform.l1, platform.l2))
    high = min(c.real + l1 + l2 for c, l1, l2 in zip(centres, platform.l1, platform.l2))
    if high <= low:
        assert work.empty and work.area == 0.0
        return
    step = (high - low) / 400
    expected = line_lengths(platform, alpha, low + step * (np.arange(400) + 0.5)).sum() * step
    assert abs(work.area - expected) < 6e-3 * (1.0 + expected)


@settings(max_examples=60, deadline=None)
@given(platforms(), st.floats(-3.0, 3.0))
def test_area_grows_by_the_perimeter(platform: ParallelPlatform, alpha: float) -> None:
    """Widening every annulus by e moves each boundary arc outwards by e: dA/de is the perimeter."""

    def widened(e: float) -> Workspace:
        first = [l1 + (e if l1 < l2 else 0.0) for l1, l2 in zip(platform.l1, platform.l2)]
        second = [l2 + (0.0 if l1 < l2 else e) for l1, l2 in zip(platform.l1, platform.l2)]
        return constant_orientation_workspace(ParallelPlatform(platform.D, platform.b, first, second), alpha)

    e = 1e-5
    assume(all(abs(l1 - l2) > 1e-3 for l1, l2 in zip(platform.l1, platform.l2)))
    before, work, after = (widened(d) for d in (-e, 0.0, e))
    assume(len(before.arcs) == len(work.arcs) == len(after.arcs) and work.area > 0.05)
    assume(min(arc.length for arc in work.arcs) > 0.05)
    assert (after.area - before.area) / (2.0 * e) == pytest.approx(work.perimeter, rel=1e-5)


@settings(max_examples=40, deadline=None)
@given(platforms(), st.floats(-3.0, 3.0))
def test_boundary_is_closed_and_separates(platform: ParallelPlatform, alpha: float) -> None:
    work = constant_orientation_workspace(platform, alpha)
    assume(not work.contacts)
    for loop in work.loops:
        ends = [work.arcs[i].ends for i in loop]
        gaps = [abs(a[1] - b[0]) for a, b in zip(ends, [*ends[1:], ends[0]])]
        assert max(gaps) < 1e-7
    for arc in work.arcs:
        if arc.length > 1e-3:
            middle = complex(arc.point(0.5 * (arc.start + arc.stop)))
            normal = (middle - arc.circle.centre) / arc.circle.radius * arc.circle.sense
            assert not work.contains([middle + 1e-9 * normal])[0]
            # a leg's wall may be thinner than the step only if the neighbouring circle is that near
            assert work.contains([middle - 1e-9 * normal])[0]


@pytest.mark.long
@settings(max_examples=25, deadline=None)
@given(
    platforms(),
    st.tuples(*[st.sampled_from([1, -1])] * 3),
    st.lists(st.floats(-3.0, 3.0), min_size=3, max_size=3),
    st.lists(st.floats(0.2, 6.0), min_size=3, max_size=3),
)
def test_joint_limits_by_counting(
    platform: ParallelPlatform, sigma: tuple[int, int, int], low: list[float], span: list[float]
) -> None:
    limits = [(a, a + s) for a, s in zip(low, span)]
    work = constant_orientation_workspace(platform, 0.3, sigma=sigma, limits=limits)
    whole = constant_orientation_workspace(platform, 0.3)
    assume(not whole.contacts and not work.contacts and whole.area > 0.1)
    x0, x1, y0, y1 = whole.box()
    n = 300
    x, y = x0 + (x1 - x0) * (np.arange(n) + 0.5) / n, y0 + (y1 - y0) * (np.arange(n) + 0.5) / n
    counted = work.contains(x[:, None] + 1j * y[None, :]).mean() * (x1 - x0) * (y1 - y0)
    assert abs(work.area - counted) < 0.5 * (work.perimeter + 1e-6) * max(x1 - x0, y1 - y0) / n + 1e-4


@settings(max_examples=40, deadline=None)
@given(st.floats(-3.0, 3.0), st.floats(0.3, 3.0), st.floats(0.3, 3.0), st.tuples(*[st.sampled_from([1, -1])] * 3))
def test_adjacent_ranges_of_a_rocker_add_up(a: float, first: float, second: float, sigma: tuple[int, ...]) -> None:
    def area(low: float, high: float) -> float:
        return constant_orientation_workspace(G1, 0.15, sigma=sigma, limits=[None, (low, high), None]).area

    total = area(a, a + first + second)
    assert area(a, a + first) + area(a + first, a + first + second) == pytest.approx(total, abs=1e-12)


@pytest.mark.parametrize("sigma", [(1, 1, 1), (-1, -1, 1)])
def test_limits_that_almost_close_change_almost_nothing(sigma: tuple[int, ...]) -> None:
    whole = constant_orientation_workspace(G1, 0.15)
    nearly = constant_orientation_workspace(
        G1, 0.15, sigma=sigma, limits=[(2.0, 2.0 + math.tau - 1e-7), None, (1.0, 1.0 + math.tau - 1e-7)]
    )
    assert nearly.area == pytest.approx(whole.area, abs=2e-6)


def test_no_inner_circle_for_equal_links() -> None:
    platform = ParallelPlatform((0, 1, 1j), (0, 0, 0), (1.0,) * 3, (1.0,) * 3)
    work = constant_orientation_workspace(platform, 0.0)
    assert {arc.circle.side for arc in work.arcs} == {"outer"}


def test_empty() -> None:
    platform = ParallelPlatform((0, 10, 5j), (0, 0, 0), (1.0,) * 3, (1.0,) * 3)
    work = constant_orientation_workspace(platform, 0.0)
    assert work.empty and work.area == 0.0 and work.perimeter == 0.0 and not work.arcs
    assert all(math.isnan(v) for v in work.box())
    assert not work.contains([0, 5])[0]


def test_tangent_circles_leave_one_point() -> None:
    platform = ParallelPlatform((0, 4, 2 + 1j), (0, 0, 0), (1.0,) * 3, (1.0, 1.0, 0.9))
    work = constant_orientation_workspace(platform, 0.0)
    assert work.dimension == 0 and not work.empty
    assert [contact.kind for contact in work.contacts] == ["tangent"] and work.contacts[0].on_workspace
    assert work.isolated == (pytest.approx(2.0, abs=1e-12),)


def test_inner_tangency_is_reported() -> None:
    """A disc of radius 2 without two unit discs; the disc of leg 1 and one unit disc touch it from either side."""
    platform = ParallelPlatform((0, 1, 0), (0, 0, 0), (1.5, 0.5, 1.5), (1.5, 1.5, 2.5))
    work = constant_orientation_workspace(platform, 0.0)
    touching = {(c.first.leg, c.first.side, c.second.leg, c.second.side) for c in work.contacts}
    assert touching == {(1, "outer", 2, "outer"), (2, "outer", 3, "inner")}
    lens = math.tau / 3.0 - math.sqrt(3.0) / 2.0  # common part of two unit discs at distance 1
    assert work.area == pytest.approx(4.0 * math.pi - (math.tau - lens), rel=1e-13)


def test_coincident_circles_count_once() -> None:
    """Two equal legs on one pivot and vertex: the workspace of the two others."""
    twin = ParallelPlatform((0, 0, 1.5), (0.1, 0.1, 0), (1.0, 1.0, 1.0), (0.6, 0.6, 0.7))
    single = ParallelPlatform((0, 0, 1.5), (0.1, 0.1, 0), (1.0, 5.0, 1.0), (0.6, 5.0, 0.7))
    work, expected = (constant_orientation_workspace(p, 0.4) for p in (twin, single))
    assert work.area == pytest.approx(expected.area, rel=1e-13) and work.area > 0.1
    assert work.perimeter == pytest.approx(expected.perimeter, rel=1e-13)
    assert [c.kind for c in work.contacts].count("coincident") == 2


def test_opposite_coincident_circles_leave_a_curve() -> None:
    """The outer circle of leg 1 is the inner circle of leg 2: only the circle itself is left."""
    platform = ParallelPlatform((0, 0, 1.0), (0, 0, 0), (0.6, 2.0, 1.0), (0.4, 1.0, 1.0))
    work = constant_orientation_workspace(platform, 0.0)
    assert work.dimension == 1 and work.area == 0.0
    assert work.perimeter == pytest.approx(math.tau)


def test_leg_without_intermediate_link_leaves_a_curve() -> None:
    """On the unit circle leg 1 leaves, legs 2 and 3 allow 0.16 <= 2.44 - 2.4 cos t <= 1."""
    platform = ParallelPlatform((0, 1.2, 1.2), (0, 0, 0), (1.0, 0.7, 0.7), (0.0, 0.3, 0.3))
    work = constant_orientation_workspace(platform, 0.0)
    assert work.dimension == 1 and work.area == 0.0 and not work.isolated
    assert work.perimeter == pytest.approx(2.0 * (math.acos(0.6) - math.acos(0.95)), rel=1e-12)


@pytest.mark.parametrize(
    ("keywords", "message"),
    [
        ({"limits": [(0.0, 1.0), None, None]}, "working mode"),
        ({"limits": [(0.0, 1.0)], "sigma": (1, 1, 1)}, "three"),
        ({"limits": [(1.0, 0.0), None, None], "sigma": (1, 1, 1)}, "leg 1"),
        ({"limits": [None, (0.0, 7.0), None], "sigma": (1, 1, 1)}, "leg 2"),
        ({"sigma": (1, 2, 1)}, "sigma"),
    ],
)
def test_bad_input(keywords: dict[str, object], message: str) -> None:
    with pytest.raises(GeometryError, match=message):
        constant_orientation_workspace(G1, 0.0, **keywords)  # type: ignore[arg-type]
    with pytest.raises(GeometryError, match="alpha"):
        constant_orientation_workspace(G1, math.nan)


@pytest.mark.parametrize("turns", [-2, 0, 3])
@pytest.mark.parametrize("bounds", [(0.5, 1.5), (-0.4, 0.3), (6.0, 7.0)])
@pytest.mark.parametrize("slack", [0.0, 0.1])
def test_angles_between_bounds_with_equal_slack_on_both_sides(bounds, slack, turns):
    low, high = bounds[0] - slack, bounds[1] + slack
    for angle, inside in ((low - 1e-3, False), (low + 1e-3, True), (high - 1e-3, True), (high + 1e-3, False)):
        assert _between(angle + turns * math.tau, bounds, slack) is inside
