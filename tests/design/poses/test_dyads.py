"""Dyads through poses: none missed, each enclosed, and what is special is said."""

from __future__ import annotations

import math
from fractions import Fraction

import numpy as np
import pytest

from graphsynth.core.errors import GeometryError
from graphsynth.design import burmester_curves, dyads

from .planted import exact, planted, residual

POSES = [(0, 0, 0), (0.6, 0.3, "15 deg"), (1, 0.9, "40 deg"), (1.2, 1.5, "70 deg"), (1.1, 2, "95 deg")]


def near(dyad, pivot, point, by=1e-7):
    return abs(complex(*dyad.pivot) - pivot) < by and abs(complex(*dyad.point) - point) < by


def none_missed(count, seed):
    rng = np.random.default_rng(seed)
    counts = {0: 0, 2: 0, 4: 0}
    for _ in range(count):
        pivot, point, length, poses = planted(rng)
        found = dyads(poses)
        assert found.complete and (found.solutions, found.bound) == (4, 4), found
        assert [d for d in found if near(d, pivot, point) and abs(d.length - length) < 1e-7], (found, pivot, point)
        for dyad in found:
            scale = 1.0 + abs(dyad.length) + max(map(abs, dyad.point))
            assert residual(dyad, poses) <= 4 * dyad.error + 1e-15 * scale
            assert dyad.error < 1e-14 * scale
        counts[len(found)] += 1
    assert counts[0] == 0 and counts[2] > 0 and counts[4] > 0
    return counts


def test_planted_dyads_of_five_poses_are_found():
    none_missed(50, 1)


@pytest.mark.slow
def test_a_thousand_planted_dyads_of_five_poses_are_found():
    none_missed(1000, 2)


def test_errors_are_bounds():
    rng = np.random.default_rng(3)
    for _ in range(5):
        *_, poses = planted(rng)
        for dyad in dyads(poses):
            true = exact(dyad, poses)
            off = max(abs(a - b) for a, b in zip(true, (*dyad.pivot, *dyad.point)))
            assert 0 < off <= dyad.error


def test_five_poses_are_where_the_curves_of_four_meet():
    """An independent way: centre points of five poses lie on the cubics of every four of them, circle points too."""
    rng = np.random.default_rng(4)
    *_, poses = planted(rng)
    found = dyads(poses)
    for leave in range(1, 5):
        curves = burmester_curves([pose for k, pose in enumerate(poses) if k != leave])
        assert curves.centre.distances([d.pivot for d in found]).max() < 1e-9
        assert curves.circle.distances([d.point for d in found]).max() < 1e-9
    other = burmester_curves([poses[0], *poses[2:]])
    assert other.centre.distances([(d.pivot[0] + 0.1, d.pivot[1]) for d in found]).max() > 1e-3


@pytest.mark.parametrize("kind", ["PR", "RP"])
def test_four_poses_have_one_sliding_dyad(kind):
    rng = np.random.default_rng(5)
    for _ in range(20):
        pivot, point, angle, poses = planted(rng, kind, 4)
        found = dyads(poses, kind)
        assert (len(found), found.bound, found.complete) == (1, 1, True)
        [dyad] = found
        assert dyad.angle == pytest.approx(angle, abs=1e-8)
        assert residual(dyad, poses) < 1e-12
        if kind == "PR":
            assert complex(*dyad.point) == pytest.approx(point, abs=1e-8)
        else:
            assert complex(*dyad.pivot) == pytest.approx(pivot, abs=1e-8)


@pytest.mark.parametrize("kind", ["PR", "RP"])
def test_five_poses_have_no_sliding_dyad_or_it_is_not_decided(kind):
    rng = np.random.default_rng(6)
    *_, poses = planted(rng, "RR", 5)
    found = dyads(poses, kind)
    assert (len(found), found.complete) == (0, True) and "codimension 1" in found.notes[0]
    # at quarter turns the numbers are exact, and so is the vanishing determinant
    square = [(0, 0, 0), (3, 5, "90 deg"), (4, 2, "180 deg"), (-6, 1, "270 deg")]
    last = [(x, y) for x in range(-9, 10) for y in range(-9, 10)]
    undecided = [dyads([*square, (x, y, "90 deg")], kind).complete for x, y in last if (x, y) != (3, 5)]
    assert 0 < undecided.count(False) < len(last) / 4


def test_three_poses():
    rng = np.random.default_rng(7)
    pivot, point, length, poses = planted(rng, "RR", 3)
    for given in ({"pivot": (pivot.real, pivot.imag)}, {"point": (point.real, point.imag)}):
        [dyad] = dyads(poses, **given)
        assert near(dyad, pivot, point) and dyad.length == pytest.approx(length)
    for kind in ("PR", "RP"):
        pivot, point, angle, poses = planted(rng, kind, 3)
        [dyad] = dyads(poses, kind, angle=angle)
        assert residual(dyad, poses) < 1e-13 and dyad.angle == pytest.approx(angle)
        where = complex(*(dyad.point if kind == "PR" else dyad.pivot))
        assert where == pytest.approx(point if kind == "PR" else pivot)


def test_two_poses():
    rng = np.random.default_rng(8)
    pivot, point, length, poses = planted(rng, "RR", 2)
    for given in ({"pivot": (pivot.real, pivot.imag)}, {"point": (point.real, point.imag)}):
        found = dyads(poses, length=length, **given)
        assert (len(found), found.complete) == (2, True)
        assert sum(near(dyad, pivot, point) for dyad in found) == 1
        assert max(residual(dyad, poses) for dyad in found) < 1e-14
        none = dyads(poses, length=1e-6, **given)
        assert (len(none), none.complete) == (0, True)
    [slider] = dyads(poses, "PR", point=(point.real, point.imag))
    [guide] = dyads(poses, "RP", pivot=(pivot.real, pivot.imag))
    assert max(residual(slider, poses), residual(guide, poses)) < 1e-14
    assert complex(*slider.point) == pytest.approx(point) and complex(*guide.pivot) == pytest.approx(pivot)


def test_four_poses_on_a_line():
    rng = np.random.default_rng(9)
    counts = []
    for _ in range(20):
        pivot, point, _, poses = planted(rng, "RR", 4)
        angle = rng.uniform(-np.pi, np.pi)
        found = dyads(poses, line=((pivot.real, pivot.imag), angle))
        assert (found.complete, found.solutions, found.bound) == (True, 3, 3)
        assert [d for d in found if near(d, pivot, point)]
        for dyad in found:
            off = (complex(*dyad.pivot) - pivot) * np.exp(-1j * angle)
            assert abs(off.imag) < 1e-12 * (1 + abs(off)) and residual(dyad, poses) < 1e-12 * (1 + dyad.length)
        counts.append(len(found))
    assert set(counts) == {1, 3}


def test_rational_problem_is_solved_exactly():
    """Quarter turns and whole numbers: the dyad about (7, -2) with the body's point (2, 1) and length 5, exactly."""
    turns, arms = [0, 1, 2, 3, 1], [3 + 4j, 5, -4 + 3j, -5j, 4 - 3j]
    poses = []
    for turn, arm in zip(turns, arms):
        z = 7 - 2j + arm - 1j**turn * (2 + 1j)
        poses.append((int(z.real), int(z.imag), f"{90 * turn} deg"))
    found = dyads(poses)
    assert found.complete
    [dyad] = [d for d in found if near(d, 7 - 2j, 2 + 1j)]
    values = np.array([*dyad.pivot, *dyad.point, dyad.length])
    assert np.abs(values - [7, -2, 2, 1, 5]).max() <= dyad.error < 1e-13


def test_text_is_exact_and_floats_are_what_they_are():
    third = [(0, 0, 0), (Fraction(1, 3), "0.1", "60 deg"), (1, 2, "120 deg"), (0.3, 3, 2.0)]
    found = dyads(third, "PR")
    assert found.poses[1].tolist() == pytest.approx([1 / 3, 0.1, math.pi / 3], abs=1e-16)
    assert found.poses[3, 2] == 2.0


@pytest.mark.parametrize("size", [1e-9, 1e7])
def test_answers_move_turn_and_grow_with_the_poses(size):
    rng = np.random.default_rng(10)
    *_, poses = planted(rng)
    turn, shift = 0.7, 3.0 - 2.0j
    z = [size * np.exp(1j * turn) * complex(x, y) + size * shift for x, y, _ in poses]
    moved = dyads([(w.real, w.imag, t + turn) for w, (_, _, t) in zip(z, poses)])
    first = dyads(poses)
    assert moved.complete and len(moved) == len(first)
    for dyad in first:
        pivot = size * np.exp(1j * turn) * complex(*dyad.pivot) + size * shift
        assert [d for d in moved if near(d, pivot, size * complex(*dyad.point), by=1e-9 * size)]


def test_order_of_poses_does_not_matter():
    first, second = dyads(POSES), dyads([POSES[k] for k in (3, 1, 4, 0, 2)])
    assert np.allclose([d.pivot for d in first], [d.pivot for d in second], atol=1e-13)
    assert len(first) == 2


def test_same_angles_are_told():
    shifts = [(0, 0), (1, 0), (1, 2), (3, 1), (0, 4)]
    found = dyads([(x, y, 0.5) for x, y in shifts])
    assert not found.complete and len(found) == 0 and "three of the angles" in found.notes[0]
    two = dyads([(x, y, 0.5 * (k % 2)) for k, (x, y) in enumerate(shifts)])
    assert not two.complete and "three of the angles" in two.notes[0]
    three = dyads([(x, y, 0.5) for x, y in shifts[:3]], pivot=(0, 0))
    # the circle through three places is seen from its centre: the middle of (0, 0) and (1, 2)
    assert complex(*three[0].point) == pytest.approx((-0.5 - 1.0j) * np.exp(-0.5j), abs=1e-12)
    assert "all differ" in dyads([(x, y, 0.5) for x, y in shifts[:3]], "PR", angle=0).notes[0]


def test_a_dyad_at_infinity_is_told():
    """A point of the body on a line in exact numbers: of the four dyads one has its pivot at infinity."""
    turns = [0, 1, 2, 3, 1]
    spots = [0, 2, 5, -3, 7]
    poses = []
    for turn, x in zip(turns, spots):
        z = x - 1j**turn * (2 + 1j)
        poses.append((int(z.real), int(z.imag), f"{90 * turn} deg"))
    found = dyads(poses)
    assert not found.complete and found.solutions == 3 and "infinity" in found.notes[0]
    assert max(residual(d, found.poses.tolist()) for d in found) < 1e-12
    assert not dyads(poses, "PR").complete


def test_a_pivot_of_the_body_is_told():
    """A body that turns about one of its points: no link of length 0 is given out."""
    turns = [0, 0.3, 0.9, 1.4]
    poses = [(0, 0, turn) for turn in turns]
    found = dyads(poses[:3], pivot=(0, 0))
    assert len(found) == 0 and found.notes
    assert "pole" in dyads(poses[:2], pivot=(0, 0), length=1).notes[0]


def test_two_dyads_that_coincide_are_told():
    """Mirror-symmetric exact poses with a double solution are never called complete."""
    found = dyads([(0, 0, 0), (1, 1, "90 deg"), (-1, 1, "-90 deg"), (2, 2, "180 deg"), (-2, 2, "180 deg")])
    if not found.complete:
        assert found.notes
    else:
        assert found.solutions == 4
    for dyad in found:
        assert residual(dyad, found.poses.tolist()) < 1e-12 * (1 + dyad.length)


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (([(0, 0, 0)],), "give 2 to 5"),
        (([(0, 0, 0), (0, 0, 0), (1, 1, 1)],), "poses 1 and 2 are the same"),
        (([(0, 0, "0 deg"), (1, 0, 1), (0, 0, "360 deg")],), "poses 1 and 3 are the same"),
        (([(0, 0, 0), (1, 1)],), "pose 2"),
        (([(0, 0, 0), (1, 1, "much")],), "angle of pose 2"),
        (([(0, 0, 0), (1, math.nan, 1)],), "y of pose 2"),
        ((POSES, "RRR"), "kind"),
        ((POSES[:4],), "burmester_curves"),
        ((POSES[:3],), "pivot or point"),
        ((POSES[:2],), "pivot or point"),
        (([(0, 0, 0), (1e70, 1, 1)],), "change the unit"),
    ],
)
def test_bad_input_is_told(arguments, said):
    with pytest.raises(GeometryError, match=said):
        dyads(*arguments)


def test_what_is_given_must_fit():
    for poses, given in (
        (POSES, {"pivot": (0, 0)}),
        (POSES[:3], {"pivot": (0, 0), "point": (1, 1)}),
        (POSES[:3], {"pivot": (0, 0), "length": 1}),
        (POSES[:2], {"pivot": (0, 0)}),
        (POSES[:2], {"pivot": (0, 0), "length": -1}),
        (POSES[:4], {"line": 3}),
        (POSES[:4], {"line": ((0, 0), "up")}),
    ):
        with pytest.raises(GeometryError):
            dyads(poses, **given)


def test_a_dyads_shows_itself():
    found = dyads(POSES)
    assert "2 RR dyads of 5 poses, certified: no other" in repr(found)
    assert found[0].at(POSES).shape == (5, 2) and list(found) == [found[0], found[1]]
