"""Parts of the certificates against closed forms: sines of tilt, the proof of a free turn, cuts of a turn."""

import math
from fractions import Fraction

import mpmath as mp
import numpy as np
import pytest

from graphsynth.intervals import Interval
from graphsynth.jamming import ToleranceBox
from graphsynth.jamming.bearing.corners import sine_of, turns_freely
from graphsynth.jamming.bearing.sweep import _split


@pytest.mark.parametrize("amplitude", [1e-9, 0.01, 0.3, 0.99, 1.5, 40.0])
def test_sine_of_the_tilt_of_a_coupler(amplitude):
    """The height over the plan length is a tangent, over the spatial length a sine."""
    found = sine_of(Interval(amplitude), "deck")
    with mp.workdps(40):
        exact = mp.sin(mp.atan(mp.mpf(amplitude)))
        assert mp.mpf(float(found.lo)) <= exact <= mp.mpf(float(found.hi))
    assert float(found.hi) - float(found.lo) <= 8 * math.ulp(float(found.hi))
    assert sine_of(Interval(amplitude), "rigid").equal(Interval(min(amplitude, 1.0)))


def gap_of_a_turn(l1, l2, l3, l4, z, rod):
    """What is left of ``|l4 - s3| <= D <= l4 + s3`` over all heights up to z and all places of the pin."""
    if z >= l3:
        return -1.0
    height = np.linspace(0.0, z, 41)
    radius = np.sqrt(np.maximum(l2**2 - height**2, 0.0))
    plan = np.sqrt(l3**2 - height**2) if rod == "rigid" else np.full_like(height, l3)
    distances = np.stack([abs(l1 - radius), l1 + radius, np.full_like(plan, abs(l1 - l2)), np.full_like(plan, l1 + l2)])
    # the pin may be anywhere between its least and its largest distance
    least = np.where((radius <= l1) & (l1 <= l2), 0.0, distances.min(axis=0))
    return min((least - abs(l4 - plan)).min(), (l4 + plan - distances.max(axis=0)).min())


@pytest.mark.parametrize("rod", ["rigid", pytest.param("deck", marks=pytest.mark.long)])
def test_a_free_turn_is_proved_only_where_it_is_free_in_any_unit(rod):
    """Any proportions with pins far out of the plane, many next to the border of one of the conditions."""
    rng, proved, refused = np.random.default_rng(2), 0, 0
    for _ in range(1200):
        l1, l2, l3, amplitude = *rng.uniform(0.3, 4.0, 3), rng.uniform(0.0, 1.2)
        border = [l3 + abs(l1 - l2), l3 - abs(l1 - l2), l1 + l2 - l3, rng.uniform(0.3, 4.0)]
        l4 = abs(float(rng.choice(border)) * (1.0 + rng.choice([-1.0, 1.0]) * 10.0 ** rng.uniform(-4.0, -0.5)))
        lengths = [Fraction(float(length)) for length in (l1, l2, l3, l4)]
        low, high = 1 - Fraction(1, 10**5), 1 + Fraction(1, 10**5)
        found = {
            turns_freely(ToleranceBox(*((v * u * low, v * u * high) for v in lengths), rod=rod), amplitude)
            for u in (Fraction(1, 1024), Fraction(1), Fraction(64))
        }
        assert len(found) == 1
        for member in (
            np.array(np.meshgrid(*[(1 - 1e-5, 1 + 1e-5)] * 4)).reshape(4, -1).T[:: 1 if True in found else 15]
        ):
            left = gap_of_a_turn(*(member * [l1, l2, l3, l4]), amplitude * l3, rod)
            assert True not in found or left > -1e-9
        proved, refused = proved + (True in found), refused + (left < 0.0)
    assert proved > 25 and refused > 25
    assert not turns_freely(ToleranceBox(1, 1, 2, 2, rod=rod), 0.0)  # the pin meets C: the rocker may have any angle


@pytest.mark.parametrize(("count", "parts"), [(1, 64), (5, 13), (31, 3), (32, 2), (100, 2)])
def test_pieces_are_cut_in_two_or_into_enough(count, parts):
    edges = np.linspace(0.0, 1.0, count + 1)
    lo, hi = _split(edges[:-1], edges[1:])
    assert len(lo) == count * parts
    np.testing.assert_allclose(np.sort(hi - lo), 1.0 / (count * parts), rtol=1e-12)
    order = np.argsort(lo)
    np.testing.assert_array_equal(lo[order][1:], hi[order][:-1])  # nothing lies between
    assert lo.min() == 0.0 and hi.max() == 1.0
