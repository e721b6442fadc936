"""Every four-bar through given points: counts of the literature, planted linkages, motions through the points."""

import numpy as np
import pytest

import graphsynth as gs
from graphsynth.design import NinePointSolutions, four_bars_through

# problem 3 of Wampler, Morgan and Sommese (1992), with 64 real solutions (Hauenstein and Sottile 2012 certified them)
PROBLEM_3 = [
    (0.25, 0.0), (0.52, 0.1), (0.8, 0.7), (1.2, 1.0), (1.4, 1.3), (1.1, 1.48), (0.7, 1.4), (0.2, 1.0), (0.02, 0.4),
]  # fmt: skip


def farthest(linkage, points):
    """Largest distance of a point from the path of a simulated motion, over the longest link."""
    worst, angles = 0.0, linkage.crank_angles
    for side in (1.0, -1.0):
        picked = np.flatnonzero(side * angles > 0.0)
        picked = picked[np.argsort(side * angles[picked])]
        if picked.size:
            path = gs.simulate(linkage.mechanism, np.append(0.0, angles[picked])).point("P").position[1:]
            worst = max(worst, np.abs(path[:, 0] + 1j * path[:, 1] - points[picked]).max())
    return worst / max(linkage.lengths)


@pytest.fixture(scope="module")
def problem_3():
    return four_bars_through(PROBLEM_3)


@pytest.mark.long
def test_counts_of_the_literature(problem_3):
    assert (problem_3.certified, problem_3.expected, len(problem_3.linkages)) == (1442, 1442, 64)
    assert problem_3.complete
    assert len(repr(problem_3).splitlines()) <= 10


@pytest.mark.long
def test_linkages_pass_their_points(problem_3):
    points = problem_3.points
    for linkage in problem_3.linkages:
        a, b, c, d = linkage.crank_pivot, linkage.rocker_pivot, linkage.crank_pin, linkage.rocker_pin
        assert linkage.radius < 1e-9
        for (
            p
        ) in points:  # the coupler can be put with its point there: the circle of d about p meets that of the rocker
            assert closing(a, b, c, d, linkage.point, p) < 1e-9
    assert all(farthest(linkage, points) < 1e-10 for linkage in problem_3.linkages if linkage.one_branch)


def closing(a, b, c, d, p0, p):
    """How far the rocker is from closing where the crank pin lies on its circle and the coupler point at p."""
    r, s, t = abs(c - a), abs(p0 - c), abs(p - a)
    along = (r * r - s * s + t * t) / (2.0 * t)
    across = np.sqrt(max(r * r - along * along, 0.0))
    pins = [a + (along + 1j * side * across) * (p - a) / t for side in (1.0, -1.0)]
    joints = [pin + (d - c) * (p - pin) / (p0 - c) for pin in pins]
    return min(abs(abs(joint - b) - abs(d - b)) for joint in joints) / abs(d - b)


@pytest.mark.long
@pytest.mark.parametrize(("count", "pivots", "expected"), [(7, 1, 243), (5, 2, 36)])
def test_given_pivots(plant, count, pivots, expected):
    for seed in range(3):
        linkage = plant(seed, count)
        found = four_bars_through(linkage.points, linkage.pivots[:pivots])
        assert found.complete and found.certified == expected and linkage.among(found.linkages)
        for one in found.linkages:
            given = {min((one.crank_pivot, one.rocker_pivot), key=lambda at: abs(at - p)) for p in found.pivots}
            assert max(min(abs(at - p) for at in given) for p in found.pivots) < 1e-12
            assert (
                max(
                    closing(one.crank_pivot, one.rocker_pivot, one.crank_pin, one.rocker_pin, one.point, p)
                    for p in found.points
                )
                < 1e-7
            )


@pytest.fixture(scope="module")
def in_order(plant):
    linkage = plant(3, 9, in_order=True)
    return linkage, four_bars_through(linkage.points)


@pytest.mark.long
def test_a_crank_rocker_is_found_without_defects(in_order):
    linkage, found = in_order
    assert found.complete and linkage.among(found.without_defects)
    for one in found.without_defects:
        steps = np.diff(one.crank_angles)
        assert (steps > 0.0).all() or (steps < 0.0).all()
        assert farthest(one, found.points) < 1e-10
    # what the tests of branch and order refuse must not pass either
    assert all(farthest(one, found.points) < 1e-10 for one in found.linkages if one.one_branch)


@pytest.mark.long
def test_branch_and_order_are_those_of_the_sampled_motion(in_order):
    """Linkages with a full turn: every point within reach of both branches of a sampled motion."""
    found = in_order[1]
    for one in found.linkages:
        if one.turns_fully:
            motion = one.mechanism.simulate(np.linspace(0.0, 2.0 * np.pi, 1441))
            path = motion.point("P").position @ [1.0, 1j]
            away = np.abs(path[:, None] - found.points)
            step = np.abs(np.diff(path)).max()
            assert one.one_branch == bool((away.min(axis=0) < step).all())
            if one.one_branch:
                order = np.argsort(away[:-1].argmin(axis=0)).tolist()
                rises = sum(second > first for first, second in zip(order, order[1:] + order[:1]))
                assert one.in_order == (rises in (1, 8))


def test_another_seed_finds_the_same(plant):
    linkage = plant(5, 7)
    one, other = (four_bars_through(linkage.points, linkage.pivots[:1], seed=seed) for seed in (0, 1))
    found = [sorted((at.crank_pivot.real, at.crank_pivot.imag) for at in each.linkages) for each in (one, other)]
    assert np.abs(np.array(found[0]) - np.array(found[1])).max() < 1e-7 and one.complete and other.complete


def test_points_may_lie_anywhere(plant):
    linkage = plant(6, 5)
    near, far = (
        four_bars_through(linkage.points * scale + away, [p * scale + away for p in linkage.pivots])
        for scale, away in ((1.0, 0.0), (1e-7, 3.0 + 4.0j))
    )
    assert near.complete and far.complete and len(near.linkages) == len(far.linkages)


@pytest.mark.parametrize(
    ("points", "pivots", "words"),
    [
        (PROBLEM_3[:8], [], "8 points and 0 pivots"),
        (PROBLEM_3, [(0, 0)], "9 points and 1 pivots"),
        ([*PROBLEM_3[:8], PROBLEM_3[0]], [], "two of the points are the same"),
        (PROBLEM_3[:5], [(1, 1), (1, 1)], "two of the pivots are the same"),
        ([*PROBLEM_3[:8], (0.0, float("nan"))], [], "points"),
        ([*PROBLEM_3[:8], (0.0, 1.0, 2.0)], [], "has 3 coordinates"),
        (5, [], "give a list"),
        ([(1e200 * x, y) for x, y in PROBLEM_3], [], "choose a unit"),
    ],
)
def test_bad_input_is_told_in_a_sentence(points, pivots, words):
    with pytest.raises(gs.GraphsynthError, match=words):
        four_bars_through(points, pivots)


def test_points_in_special_position_are_not_called_complete():
    ellipse = [(2.0 * np.cos(t), np.sin(t)) for t in 2.0 * np.pi * np.arange(9) / 9.0 + 0.1]
    found = four_bars_through(ellipse[:5], [(0.0, 0.0), (1.0, 0.0)])
    assert isinstance(found, NinePointSolutions)
    assert found.complete == (found.certified == 36)


@pytest.mark.slow
@pytest.mark.parametrize(("points", "pivots", "expected"), [(9, 0, 1442), (7, 1, 243), (5, 2, 36)])
def test_hundred_random_tasks(plant, points, pivots, expected):
    """Every planted linkage is found, a quarter of them in order on one branch, a quarter of extreme proportions."""
    for seed in range(100, 200):
        linkage = plant(seed, points, in_order=seed % 4 == 0, extreme=seed % 4 == 1)
        found = four_bars_through(linkage.points, linkage.pivots[:pivots])
        assert found.complete and found.certified == expected and linkage.among(found.linkages)
        assert seed % 4 or linkage.among(found.without_defects)
