"""The curves of four poses: the places that theory puts on them, their branches, their asymptotes."""

from __future__ import annotations

from itertools import combinations

import numpy as np
import pytest

from graphsynth.core.errors import GeometryError
from graphsynth.design import BurmesterCurve, burmester_curves, dyads

from .planted import planted


def random_poses(seed):
    rng = np.random.default_rng(seed)
    return rng.normal(size=(4, 3)).tolist()


def pole(a, b):
    """Fixed point of the displacement from one pose to another."""
    turn = np.exp(1j * (b[2] - a[2]))
    return (complex(b[0], b[1]) - turn * complex(a[0], a[1])) / (1 - turn)


def meet(a, b, c, d):
    """Where the line through a and b meets that through c and d."""
    (u, v), w = (b - a, d - c), c - a
    return a + u * (w.conjugate() * v).imag / (u.conjugate() * v).imag


def plain(z):
    return np.column_stack([np.real(z), np.imag(z)])


@pytest.mark.parametrize("seed", range(12))
def test_poles_and_meeting_sides_lie_on_the_centre_point_curve(seed):
    """[Bottema & Roth 1979]: six poles, and where opposite sides of a quadrilateral of poles meet."""
    poses = random_poses(seed)
    curves = burmester_curves(poses)
    P = {pair: pole(poses[pair[0]], poses[pair[1]]) for pair in combinations(range(4), 2)}
    spots = [*P.values(), meet(P[0, 1], P[1, 2], P[2, 3], P[0, 3]), meet(P[0, 1], P[0, 3], P[1, 2], P[2, 3])]
    size = 1.0 + np.abs(spots)
    assert (curves.centre.distances(plain(spots)) / size < 1e-9).all()
    assert (curves.centre.distances(plain(np.array(spots) + 0.1)) > 1e-4).sum() >= 6
    first = [P[0, k] for k in (1, 2, 3)]  # poles of the first pose are circle points too
    inside = (np.array(first) - complex(*poses[0][:2])) * np.exp(-1j * poses[0][2])
    assert (curves.circle.distances(plain(inside)) < 1e-9 * (1 + np.abs(inside))).all()


@pytest.mark.parametrize("seed", range(12))
def test_samples_are_dyads(seed):
    """Every sampled pair keeps its distance in all four poses."""
    poses = random_poses(seed)
    curves = burmester_curves(poses)
    pivots, points = curves.pairs(100)
    x, y, angle = np.array(poses).T
    ends = x + 1j * y + np.exp(1j * angle) * (points @ [1, 1j])[:, None]
    lengths = np.abs(ends - (pivots @ [1, 1j])[:, None])
    assert len(pivots) > 50
    assert (np.ptp(lengths, axis=1) <= 1e-9 * (1 + lengths.max(axis=1) ** 2)).all()
    back = curves.circle.partners(points)
    near = np.abs(pivots).max(axis=1) < 20
    assert np.abs(back - pivots)[near].max() < 1e-6


@pytest.mark.parametrize("seed", range(12))
def test_branches_are_whole_and_all_there(seed):
    """Lines across the curve meet the sampled branches as often as they meet the cubic, which is proved."""
    poses = random_poses(seed)
    curve = burmester_curves(poses).centre
    branches = curve.points(2000)
    assert len(branches) == curve.branches
    rng = np.random.default_rng(seed)
    for _ in range(5):
        at, angle = complex(*curve.base) + rng.normal(size=2) @ [1, 1j], rng.uniform(-np.pi, np.pi)
        truth = dyads(poses, line=((at.real, at.imag), angle))
        assert truth.complete
        crossings = []
        for branch in branches:
            z = (branch @ [1, 1j] - at) * np.exp(-1j * angle)
            for k in np.flatnonzero(z.imag[:-1] * z.imag[1:] < 0):
                share = z.imag[k] / (z.imag[k] - z.imag[k + 1])
                crossings.append(at + (z[k] + share * (z[k + 1] - z[k])).real * np.exp(1j * angle))
        spots = [complex(*dyad.pivot) for dyad in truth]
        if max(abs(spot) for spot in spots) < 100:
            assert len(crossings) == len(spots)
            assert max(min(abs(spot - z) for z in crossings) for spot in spots) < 0.02 * (1 + max(map(abs, spots)))


@pytest.mark.parametrize("seed", range(12))
def test_the_curve_comes_to_its_asymptote(seed):
    curves = burmester_curves(random_poses(seed))
    for curve in (curves.centre, curves.circle):
        assert isinstance(curve, BurmesterCurve)
        (x, y), angle = curve.asymptote
        ends = [branch for branch in curve.points(4000) if not np.allclose(branch[0], branch[-1])]
        assert len(ends) == 1
        z = (ends[0] @ [1, 1j] - complex(x, y)) * np.exp(-1j * angle)
        assert np.sign(z.real[0]) != np.sign(z.real[-1])
        for end in (z[0], z[-1]):
            assert abs(end.real) > 1e3 and abs(end.imag) < 1e-2
        assert -np.pi / 2 <= angle <= np.pi / 2


def test_curves_move_with_the_poses():
    poses = random_poses(3)
    turn, shift = 0.4, 2 - 1j
    places = [5 * np.exp(1j * turn) * complex(x, y) + shift for x, y, _ in poses]
    moved = [(z.real, z.imag, t + turn) for z, (_, _, t) in zip(places, poses)]
    one, other = burmester_curves(poses), burmester_curves(moved)
    z = 5 * np.exp(1j * turn) * (np.concatenate(one.centre.points(50)) @ [1, 1j]) + shift
    near = z[np.abs(z) < 100]
    assert other.centre.distances(plain(near)).max() < 1e-10
    w = 5 * np.concatenate(one.circle.points(50))
    assert other.circle.distances(w[np.abs(w).max(axis=1) < 100]).max() < 1e-10


def test_what_has_no_curve_is_told():
    with pytest.raises(GeometryError, match="angles of the four poses are the same"):
        burmester_curves([(0, 0, 1), (1, 0, 1), (0, 2, 1), (3, 3, 1)])
    with pytest.raises(GeometryError, match="give 4 to 4"):
        burmester_curves(random_poses(0)[:3])
    with pytest.raises(GeometryError, match="falls apart"):  # two angles, twice each
        burmester_curves([(0, 0, 0), (1, 0, 0), (0, 2, "90 deg"), (3, 3, "90 deg")])


def test_a_planted_dyad_lies_on_both_curves():
    rng = np.random.default_rng(21)
    pivot, point, _, poses = planted(rng, "RR", 4)
    curves = burmester_curves(poses)
    assert curves.centre.distances(plain([pivot]))[0] < 1e-12 and curves.circle.distances(plain([point]))[0] < 1e-12
    assert np.allclose(curves.centre.partners(plain([pivot])), plain([point]))


def test_the_picture_shows_both_curves():
    curves = burmester_curves(random_poses(2))
    chart = curves.plot()
    assert [line.label for line in chart.lines if line.label] == ["centre points", "asymptote", "circle points"]
    drawn = np.column_stack([chart.lines[0].x, chart.lines[0].y])
    drawn = drawn[np.isfinite(drawn).all(axis=1)]
    assert len(drawn) > 20 and curves.centre.distances(drawn).max() < 1e-9
    assert "<svg" in chart.svg() and "asymptote" in repr(curves)
