"""Singular loci, conics, orientations and aspects against sign changes, identities and counting."""

from __future__ import annotations

import math
from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from graphsynth.core.errors import GeometryError
from graphsynth.systems.platform.field import singular_conic
from graphsynth.systems.platform.maps import aspects
from graphsynth.systems.platform.orientations import orientations, reachable_workspace, total_orientation_workspace
from graphsynth.systems.platform.parallel_platform import ParallelPlatform
from graphsynth.systems.platform.singular_loci import (
    SingularLoci,
    isolated_singular_points,
    singular_loci,
    type_one_circles,
    type_two_curves,
)
from graphsynth.systems.platform.workspace import constant_orientation_workspace

G1, MOCK = ParallelPlatform.g1(), ParallelPlatform.mock()
ALPHA_G1 = -0.491174039432700716436386522579764691645742  # theory/values-of-the-platform 4
ALPHA_MOCK = 2.0 * math.atan(3.0 / 7.0)


@pytest.fixture(scope="module", params=[(G1, 0.0), (MOCK, 0.5)], ids=["g1", "mock"])
def loci(request: pytest.FixtureRequest) -> tuple[ParallelPlatform, SingularLoci]:
    platform, alpha = request.param
    return platform, singular_loci(platform, alpha, nodes=80)


@pytest.mark.long
def test_points_are_singular_poses_of_their_mode(loci: tuple[ParallelPlatform, SingularLoci]) -> None:
    """Substituted in the inverse problem and the Jacobian of the platform, away from the ends."""
    platform, found = loci
    assert len(found.curves) >= 12 and all(curve.complete and curve.residual < 1e-13 for curve in found.curves)
    for curve in found.curves:
        p = curve.points[2:-2]
        X = np.stack([p.real, p.imag, np.full(p.shape, found.alpha)], axis=-1)
        theta = platform.inverse(X, curve.sigma).theta
        good = np.isfinite(theta).all(axis=-1)
        assert good.all()
        JX, _ = platform.jacobians(X, theta)
        sizes = np.linalg.norm(JX, axis=-1).prod(axis=-1)
        assert np.abs(np.linalg.det(JX) / sizes).max() < 1e-7  # theta has a square root near the ends
        assert np.median(np.abs(np.linalg.det(JX) / sizes)) < 1e-13


def test_every_end_joins_two_working_modes(loci: tuple[ParallelPlatform, SingularLoci]) -> None:
    """The curve goes on in the mode with the sign of the stretched leg reversed: ends come in such pairs."""
    platform, found = loci
    ends: dict[tuple[int, int, int], list[tuple[int, ...]]] = {}
    scale = max(platform.l2)
    for curve in found.curves:
        for leg, p in zip(curve.ends, (curve.points[0], curve.points[-1])):
            key = (leg, round(p.real / scale * 1e7), round(p.imag / scale * 1e7))
            ends.setdefault(key, []).append(curve.sigma)
    assert len(ends) >= 12
    for (leg, _, _), modes in ends.items():
        assert len(modes) == 2
        assert [i for i in range(3) if modes[0][i] != modes[1][i]] == [leg - 1]


@pytest.mark.parametrize("seed", [11, *[pytest.param(seed, marks=pytest.mark.slow) for seed in range(12, 30)]])
def test_ends_pair_up_on_random_platforms(seed: int) -> None:
    rng = np.random.default_rng(seed)
    D, b = rng.normal(size=3) + 1j * rng.normal(size=3), 0.4 * (rng.normal(size=3) + 1j * rng.normal(size=3))
    platform = ParallelPlatform(tuple(D), tuple(b), rng.uniform(0.6, 1.8, 3), rng.uniform(0.6, 1.8, 3))  # type: ignore[arg-type]
    found = singular_loci(platform, rng.uniform(-3, 3), nodes=50)
    ends: list[tuple[int, complex, tuple[int, ...]]] = []
    for curve in found.curves:
        assert curve.complete and curve.residual < 1e-12
        ends += [(leg, complex(p), curve.sigma) for leg, p in zip(curve.ends, curve.points[[0, -1]])]
    for leg, p, sigma in ends:
        partners = [other for k, q, other in ends if k == leg and abs(p - q) < 1e-6 and other != sigma]
        assert len(partners) == 1 and [i for i in range(3) if partners[0][i] != sigma[i]] == [leg - 1]


def test_ends_lie_on_circles_of_type_one(loci: tuple[ParallelPlatform, SingularLoci]) -> None:
    _, found = loci
    for curve in found.curves:
        for leg, p in zip(curve.ends, (curve.points[0], curve.points[-1])):
            off = [abs(abs(p - c.centre) - c.radius) for c in found.circles if c.leg == leg]
            assert min(off) < 1e-11 * max(c.radius for c in found.circles)


@pytest.mark.long
@pytest.mark.parametrize("sigma", [(1, 1, -1), (-1, -1, -1), (-1, 1, 1)])
def test_no_sign_change_away_from_the_curves(sigma: tuple[int, int, int]) -> None:
    """An independent finer grid: every cell edge with a sign change is near a traced curve."""
    curves = type_two_curves(G1, 0.0, sigma, nodes=60)
    work = constant_orientation_workspace(G1, 0.0)
    x0, x1, y0, y1 = work.box()
    n = 171
    p = np.linspace(x0, x1, n)[:, None] + 1j * np.linspace(y0, y1, n)[None, :]
    X = np.stack([p.real, p.imag, np.zeros(p.shape)], axis=-1)
    theta = G1.inverse(X, sigma).theta
    good = np.isfinite(theta).all(axis=-1)
    value = np.full(p.shape, np.nan)
    value[good] = G1.determinant(X[good], theta[good])
    cells = [p[:-1][value[:-1] * value[1:] < 0], p[:, :-1][value[:, :-1] * value[:, 1:] < 0]]
    path = np.concatenate([np.interp(np.linspace(0, 1, 8), [0, 1], [0, 1])[:, None] * np.diff(c.points)[None] +
                           c.points[:-1] for c in curves], axis=None)  # fmt: skip
    assert sum(map(len, cells)) > 50
    for q in np.concatenate(cells):
        assert np.abs(path - q).min() < 2.0 * (x1 - x0) / n


@pytest.mark.long
@pytest.mark.parametrize("below", [1e-2, 1e-4])
def test_closed_loop_around_the_singular_home_of_the_mock_up(below: float) -> None:
    """Just below the singular orientation a loop with threefold symmetry surrounds the origin."""
    closed = [c for c in type_two_curves(MOCK, ALPHA_MOCK - below, (-1, -1, -1)) if c.closed]
    assert len(closed) == 1 and abs(closed[0].points[0] - closed[0].points[-1]) < 1e-9
    turn = np.angle(closed[0].points[1:] / closed[0].points[:-1])
    assert abs(turn.sum()) == pytest.approx(math.tau, rel=1e-9)
    thirds = closed[0].points * np.exp(2j * math.pi / 3.0)
    near = [np.abs(p - closed[0].points).min() for p in thirds]
    assert max(near) < 0.1 * np.abs(closed[0].points).max()
    assert not [c for c in type_two_curves(MOCK, ALPHA_MOCK + below, (-1, -1, -1)) if c.closed]


def test_loop_shrinks_to_an_isolated_point() -> None:
    points = isolated_singular_points(MOCK, ALPHA_MOCK, (-1, -1, -1))
    assert len(points) == 1 and abs(points[0]) < 1e-3
    assert isolated_singular_points(MOCK, ALPHA_MOCK + 1e-3, (-1, -1, -1)) == ()
    assert isolated_singular_points(G1, 0.15, (1, 1, 1)) == ()


def test_known_singular_pose_lies_on_a_curve() -> None:
    distance, p = np.inf, 1.2 + 0.9j
    for curve in type_two_curves(G1, ALPHA_G1, (1, 1, 1), nodes=60):
        a, b = curve.points[:-1], curve.points[1:]
        t = np.clip(((p - a) * np.conj(b - a)).real / np.abs(b - a) ** 2, 0.0, 1.0)
        distance = min(distance, float(np.abs(a + t * (b - a) - p).min()))
    assert distance < 2e-3  # the sagitta of the polyline


def test_circles_of_type_one() -> None:
    circles = type_one_circles(MOCK, 0.0)
    assert [(c.leg, c.side, c.radius) for c in circles] == [
        (k, side, r) for k in (1, 2, 3) for side, r in (("outer", 105.0), ("inner", 15.0))
    ]


def test_bad_input() -> None:
    with pytest.raises(GeometryError, match="leg 2"):
        type_two_curves(ParallelPlatform((0, 1, 1j), (0, 0.1, 0.1j), (1, 1, 1), (1, 0, 1)), 0.0, (1, 1, 1))
    with pytest.raises(GeometryError, match="nodes"):
        type_two_curves(G1, 0.0, (1, 1, 1), nodes=2)


# --- fixed anchors: the conic


complex_number = st.complex_numbers(max_magnitude=3.0)


@settings(max_examples=60, deadline=None)
@given(
    st.lists(complex_number, min_size=3, max_size=3),
    st.lists(complex_number, min_size=3, max_size=3),
    st.floats(-3.1, 3.1),
    st.lists(complex_number, min_size=5, max_size=5),
)
def test_conic_equals_the_determinant(
    anchors: list[complex], vertices: list[complex], alpha: float, points: list[complex]
) -> None:
    conic = singular_conic(anchors, vertices, alpha)
    arms = np.exp(1j * alpha) * np.array(vertices)
    expected = [exact_determinant(anchors, arms.tolist(), point) for point in points]
    np.testing.assert_allclose(conic(np.array(points)), expected, atol=1e-11 * 9**2 * 8)


def exact_determinant(anchors: list[complex], arms: list[complex], point: complex) -> float:
    """Determinant of the rows ``2 (d_x, d_y, arm x d)`` of the legs in fractions; only the result is rounded."""
    rows = []
    for anchor, arm in zip(anchors, arms):
        x, y = Fraction(arm.real), Fraction(arm.imag)
        dx = Fraction(point.real) + x - Fraction(anchor.real)
        dy = Fraction(point.imag) + y - Fraction(anchor.imag)
        rows.append((2 * dx, 2 * dy, 2 * (x * dy - y * dx)))
    (a, b, c), (d, e, f), (g, h, i) = rows
    return float(a * (e * i - f * h) - b * (d * i - f * g) + c * (d * h - e * g))


def test_the_conic_of_numbers_whose_products_vanish() -> None:
    """Lengths of 1e-156 underflow in products: zero to all digits asked for, and no warning."""
    tiny = [1e-156 + 1e-156j, -1e-156j, 2e-156]
    points = [1e-156 + 0j, 0.5j, 3.0]
    conic = singular_conic(tiny, tiny[::-1], 0.5)
    arms = (np.exp(0.5j) * np.array(tiny[::-1])).tolist()
    expected = [exact_determinant(tiny, arms, point) for point in points]
    np.testing.assert_allclose(conic(np.array(points)), expected, atol=1e-11)


def test_third_differences_of_the_determinant_vanish() -> None:
    theta = G1.inverse([1.2, 0.9, 0.15], (1, 1, 1)).theta
    start, step = 0.3 + 0.2j, 0.37 - 0.11j
    p = start + step * np.arange(4)
    X = np.stack([p.real, p.imag, np.full(4, 0.4)], axis=-1)
    values = G1.determinant(X, theta)
    assert abs(np.diff(values, 3)[0]) < 1e-12 * np.abs(values).max()
    assert abs(np.diff(values, 2)[0]) > 1e-3  # of degree two indeed
    np.testing.assert_allclose(singular_conic(G1.elbows(theta), G1.b, 0.4)(p), values, rtol=1e-12)


def test_conics_of_every_kind() -> None:
    rng = np.random.default_rng(4)
    kinds = set()
    for _ in range(200):
        A, b = (rng.normal(size=3) + 1j * rng.normal(size=3) for _ in range(2))
        kinds.add(singular_conic(A, b, 0.3).kind)
    assert {"ellipse", "hyperbola"} <= kinds
    same = np.array([0, 1, 0.3 + 0.8j])
    assert singular_conic(same, same, 0.0).kind == "everywhere"  # congruent triangles, equal orientation


# --- over the orientation


@pytest.mark.parametrize("platform", [G1, MOCK])
def test_orientations_of_a_point(platform: ParallelPlatform) -> None:
    rng = np.random.default_rng(1)
    scale = max(platform.l2)
    alpha = np.linspace(0.0, math.tau, 2000, endpoint=False)
    for q in rng.normal(size=(15, 2)) @ [1.0, 1j] * scale + np.mean(platform.D):
        X = np.stack([np.full(2000, q.real), np.full(2000, q.imag), alpha], axis=-1)
        expected = platform.inverse(X).reachable
        found = np.zeros(2000, dtype=bool)
        for start, stop in orientations(platform, complex(q)):
            found |= np.mod(alpha - start, math.tau) <= stop - start
        assert (found != expected).sum() <= 0


def test_orientations_meet_at_a_limit() -> None:
    for start, stop in orientations(MOCK, 3.0 + 2.0j):
        for alpha in (start, stop):
            assert np.abs(MOCK.inverse([3.0, 2.0, alpha]).deficit).min() < 1e-12 * 45


@pytest.mark.parametrize("platform", [G1, MOCK])
def test_reachable_area_encloses_counted_area(platform: ParallelPlatform) -> None:
    found = reachable_workspace(platform, 4e-3)
    assert 0.0 < found.low <= found.area <= found.high < 1.1 * found.area
    rng = np.random.default_rng(2)
    half = platform.l1[0] + platform.l2[0] + abs(platform.b[0])
    p = platform.D[0] + half * (rng.uniform(-1, 1, 1500) + 1j * rng.uniform(-1, 1, 1500))
    alpha = np.linspace(0.0, math.tau, 120)
    X = np.stack(np.broadcast_arrays(p.real[:, None], p.imag[:, None], alpha), axis=-1)
    share = platform.inverse(X).reachable.any(axis=1).mean()
    error = 4.0 * math.sqrt(share * (1 - share) / 1500)
    assert abs(found.area - share * 4 * half * half) < (error + 0.01) * 4 * half * half


def test_reachable_bounds_tighten() -> None:
    coarse, fine = reachable_workspace(G1, 8e-3), reachable_workspace(G1, 2e-3)
    assert coarse.low <= fine.low <= fine.high <= coarse.high
    assert fine.high - fine.low < 0.4 * (coarse.high - coarse.low)


@pytest.mark.parametrize("platform", [G1, MOCK])
def test_total_orientation_of_one_angle_is_the_exact_workspace(platform: ParallelPlatform) -> None:
    found = total_orientation_workspace(platform, 0.15, 0.15, 1e-3)
    exact = constant_orientation_workspace(platform, 0.15).area
    assert found.low < exact < found.high
    assert found.area == pytest.approx(exact, rel=1e-3)


def test_total_orientation_against_sampled_angles() -> None:
    found = total_orientation_workspace(G1, -0.4, 0.7, 4e-3)
    p = np.concatenate([found.inside, found.undecided])
    X = np.stack(np.broadcast_arrays(p.real[:, None], p.imag[:, None], np.linspace(-0.4, 0.7, 60)), axis=-1)
    assert G1.inverse(X).reachable.all(axis=1)[: len(found.inside)].all()
    rng = np.random.default_rng(3)
    q = rng.uniform(0, 2.5, 4000) + 1j * rng.uniform(0, 2.3, 4000)
    X = np.stack(np.broadcast_arrays(q.real[:, None], q.imag[:, None], np.linspace(-0.4, 0.7, 60)), axis=-1)
    share = G1.inverse(X).reachable.all(axis=1).mean() * 2.5 * 2.3
    assert found.area == pytest.approx(share, abs=0.2)
    wider = total_orientation_workspace(G1, -0.5, 0.8, 4e-3)
    assert wider.high < found.high
    assert total_orientation_workspace(G1, 0.0, math.tau, 8e-3).area < wider.high
    with pytest.raises(GeometryError, match="reversed"):
        total_orientation_workspace(G1, 1.0, 0.0)


# --- aspects


def test_aspects_cover_the_workspace() -> None:
    found = aspects(G1, (-1, 1, 1), 0.0, nodes=300)
    total = sum(part.size for part in found.parts) + found.unresolved * found.parts[0].size / found.parts[0].cells
    assert total == pytest.approx(constant_orientation_workspace(G1, 0.0).area, rel=5e-3)
    for part in found.parts:
        theta = G1.inverse(part.pose, (-1, 1, 1)).theta
        assert np.sign(G1.determinant(part.pose, theta)) == part.sign


def test_aspects_of_the_home_mode() -> None:
    """At the home orientation the home mode has no type-II curve: one aspect."""
    assert type_two_curves(MOCK, 0.0, (-1, -1, -1)) == ()
    found = aspects(MOCK, (-1, -1, -1), 0.0)
    assert len(found) == 1 and found.parts[0].sign == -1
    every = aspects(MOCK, (-1, -1, -1), nodes=40, angles=32)
    assert {part.sign for part in every.parts} == {1, -1} and math.isnan(every.alpha)
