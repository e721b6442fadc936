"""Function generators and timed paths: known linkages come back, and the answers keep what was asked."""

from __future__ import annotations

import mpmath
import numpy as np
import pytest

import graphsynth as gs
from graphsynth.core.errors import GeometryError
from graphsynth.design import dyads, function_generators, timed_paths

KNOWN = gs.Mechanism.four_bar(1, 0.4, 1.1, 0.9, coupler_point=(0.5, 0.6))
ANGLES = np.array([0.4, 1.0, 1.9, 2.4, 3.0])
OUTPUTS = KNOWN.simulate(ANGLES).poses[:, 3, 2]


def freudenstein(one, inputs, outputs):
    """Largest change of the coupler's length over the positions, in fifty digits, from the doubles as they are."""
    with mpmath.workdps(50):
        driver, output = one.dyads
        lengths = []
        for u, v in zip(inputs, outputs):
            A = driver.length * mpmath.expj(mpmath.mpf(driver.angle) + u)
            B = 1 + output.length * mpmath.expj(mpmath.mpf(output.angle) + v)
            lengths.append(abs(B - A))
        return max(lengths) - min(lengths)


@pytest.mark.parametrize(
    ("count", "given", "bound"),
    [
        (3, {"input_start": ANGLES[0], "output_start": OUTPUTS[0]}, 1),
        (4, {"input_start": ANGLES[0]}, 2),
        (4, {"output_start": OUTPUTS[0]}, 2),
        (5, {}, 3),
    ],
)
def test_a_known_linkage_comes_back(count, given, bound):
    inputs, outputs = (ANGLES - ANGLES[0])[:count], (OUTPUTS - OUTPUTS[0])[:count]
    found = function_generators(inputs, outputs, **given)
    assert found.complete and 1 <= len(found) <= bound
    own = [one for one in found if one.dyads[0].length == pytest.approx(0.4, abs=1e-9)]
    assert len(own) == 1 and own[0].defects == () and own[0].rotates
    assert own[0].dyads[1].length == pytest.approx(0.9) and own[0].dyads[0].angle == pytest.approx(0.4)
    assert own[0].dyads[1].angle == pytest.approx((OUTPUTS[0] + np.pi) % (2 * np.pi) - np.pi)
    for one in found:
        size = 1 + one.dyads[0].length + one.dyads[1].length
        assert freudenstein(one, inputs, outputs) < 1e-14 * size
        if one.defects == ():
            turned = one.motion.poses[::24]
            assert np.allclose(turned[:, 3, 2] - turned[0, 3, 2], outputs, atol=1e-9)
            assert np.allclose(np.exp(1j * (turned[:, 1, 2] - turned[0, 1, 2])), np.exp(1j * inputs), atol=1e-9)


def test_random_functions_of_five_positions():
    rng = np.random.default_rng(31)
    counts = []
    for _ in range(20):
        inputs = np.cumsum(rng.uniform(0.1, 0.5, 5))
        outputs = np.cumsum(rng.uniform(0.1, 0.5, 5))
        found = function_generators(inputs, outputs)
        assert found.complete
        for one in found:
            size = 1 + one.dyads[0].length + one.dyads[1].length
            assert freudenstein(one, inputs - inputs[0], outputs - outputs[0]) < 1e-13 * size
        counts.append(len(found))
    assert set(counts) <= {1, 3} and len(set(counts)) == 2  # the frame is the fourth root, so the number is odd


def test_input_and_output_can_change_places():
    inputs, outputs = ANGLES - ANGLES[0], OUTPUTS - OUTPUTS[0]
    one, other = function_generators(inputs, outputs), function_generators(outputs, inputs)
    ours = sorted(tuple(round(d.length, 9) for d in found.dyads) for found in one)
    theirs = sorted(tuple(round(d.length, 9) for d in found.dyads[::-1]) for found in other)
    assert ours == theirs


def test_a_parallelogram_is_a_family():
    """Equal angles: every parallelogram does it, which is told and not sampled."""
    turns = ["0 deg", "20 deg", "50 deg", "70 deg", "90 deg"]
    found = function_generators(turns, turns)
    assert not found.complete and found.notes
    three = function_generators(turns[:3], turns[:3], input_start="30 deg", output_start="30 deg")
    assert not three.complete and "depend" in three.notes[0]


@pytest.mark.parametrize(
    ("arguments", "given", "said"),
    [
        (([0, 1], [0, 1]), {}, "three to five"),
        (([0, 1, 2], [0, 1]), {}, "three to five"),
        (([0, 1, 2], [0, 1, 2]), {}, "need 2 of"),
        (([0, 1, 2, 3], [0, 1, 2, 3]), {}, "need 1 of"),
        (([0, 1, 2, 3, 4], [0, 1, 3, 4, 6]), {"input_start": 0}, "need 0 of"),
        (([0, 1, 1], [0, 1, 1]), {"input_start": 0, "output_start": 1}, "given twice"),
        (([0, 1, "x"], [0, 1, 2]), {"input_start": 0, "output_start": 1}, "inputs"),
    ],
)
def test_bad_input_is_told(arguments, given, said):
    with pytest.raises(GeometryError, match=said):
        function_generators(*arguments, **given)


def test_a_known_timed_path_comes_back():
    points = KNOWN.simulate(ANGLES).point("P").position
    found = timed_paths(points, ANGLES)
    assert found.complete and len(found) == 12
    own = [one for one in found if np.allclose([*one.dyads[0].pivot, *one.dyads[1].pivot], [0, 0, 1, 0], atol=1e-9)]
    assert len(own) == 1 and own[0].defects == ()
    assert np.allclose([d.length for d in own[0].dyads], [0.4, 0.9])
    for one in found:
        off = np.exp(1j * (one.inputs - one.inputs[0])) - np.exp(1j * (ANGLES - ANGLES[0]))
        assert np.abs(off).max() < 1e-9  # the crank keeps the given angles, whatever the defects
        if one.defects == ():
            motion = one.motion.point("P").position[::24]
            assert np.abs(motion - points).max() < 1e-9


def one_turn(one, points):
    """Angles of the coupler that put the crank's pin at its distance from the pivot."""
    pin, pivot = complex(*one.dyads[0].point), complex(*one.dyads[0].pivot)
    ends = pivot + one.dyads[0].length * np.exp(1j * one.inputs)
    return np.angle((ends - points @ [1, 1j]) / pin)


def test_random_timed_paths_are_ordered_pairs_of_dyads():
    rng = np.random.default_rng(32)
    for _ in range(5):
        points, angles = rng.normal(size=(5, 2)), np.cumsum(rng.uniform(0.2, 0.6, 5))
        found, pairs = timed_paths(points, angles), dyads(np.column_stack([points, angles]).tolist())
        assert len(found) == len(pairs) * (len(pairs) - 1) and found.complete == pairs.complete
        for one in found:
            turn = one_turn(one, points)
            ends = one.dyads[1].at(np.column_stack([points, turn])) @ [1, 1j] - complex(*one.dyads[1].pivot)
            assert np.abs(np.abs(ends) - one.dyads[1].length).max() < 1e-8 * (1 + one.dyads[1].length)


def test_fewer_points_need_links():
    points = KNOWN.simulate(ANGLES).point("P").position[:3]
    with pytest.raises(GeometryError, match="give links"):
        timed_paths(points, ANGLES[:3])
    with pytest.raises(GeometryError, match="as many"):
        timed_paths(points, ANGLES)
    poses = np.column_stack([points, ANGLES[:3]]).tolist()
    links = [dyads(poses, pivot=place)[0] for place in ((0, 0), (1, 1))]
    found = timed_paths(points, ANGLES[:3], links=links)
    assert len(found) == 2 and {one.dyads[0].pivot for one in found} == {(0.0, 0.0), (1.0, 1.0)}
