"""Dyads placed over boxes: every member inside, and its derivatives, against 50 digits; near dead centres too."""

import math

import mpmath
import numpy as np
import pytest

from graphsynth.intervals import Interval, variables
from graphsynth.jamming.assembly.dyads import Near, place_dyad
from graphsynth.jamming.assembly.positions import PLANE
from graphsynth.mechanism.equations import Pair

#: Angle of the triangle at the inner joint: from nearly folded to nearly stretched.
OPENINGS = [0.25, 0.6, 1.5, 2.6, 2.95]


def random_dyad(rng, opening):
    """Outer joints and arms (8 numbers) of a dyad with a given angle between its arms, and its side."""
    arms = rng.uniform(0.5, 1.5, 2) * np.exp(1j * rng.uniform(-math.pi, math.pi, 2))
    start, turn, side = complex(*rng.uniform(-2.0, 2.0, 2)), rng.uniform(-math.pi, math.pi), rng.choice([-1.0, 1.0])
    inner = start + abs(arms[0]) * np.exp(1j * turn)
    end = inner - abs(arms[1]) * np.exp(1j * (turn + side * opening))
    return np.array([start, end, *arms]).view(float), side


def angles(values, side):
    """Angles of both links by the law of cosines (50 digits)."""
    ax, ay, bx, by, px, py, qx, qy = values
    d, direction = mpmath.hypot(bx - ax, by - ay), mpmath.atan2(by - ay, bx - ax)
    p, q = mpmath.hypot(px, py), mpmath.hypot(qx, qy)
    first = mpmath.acos((p**2 + d**2 - q**2) / (2 * p * d))
    second = mpmath.acos((q**2 + d**2 - p**2) / (2 * q * d))
    side = int(side)
    return direction + side * first - mpmath.atan2(py, px), direction + mpmath.pi - side * second - mpmath.atan2(qy, qx)


def placed(box, side, near, wide=True):
    a_x, a_y, b_x, b_y, p_x, p_y, q_x, q_y = variables(box)
    return place_dyad(PLANE, (Pair(a_x, a_y), Pair(b_x, b_y)), (Pair(p_x, p_y), Pair(q_x, q_y)), side, near, wide)


def enclosed(box, side, wide=True):
    """Dyads over boxes by the mean value theorem, as proofs use them."""
    middle, _ = placed(Interval(box.mid), side, None)
    known = Interval.stack([own.value for own in middle], axis=-1)
    steps = Interval.from_bounds((box - Interval(box.mid)).lo.T, (box - Interval(box.mid)).hi.T)
    near = Near(known.reshape(len(box.mid), 1, 7), steps)
    return placed(box, side, lambda value, place: near.narrowed(0, value, place), wide)


def holds(member, side, link, duals):
    """Check cosine, sine and angle of a link, and their derivatives, against 50 digits."""
    with mpmath.workdps(50):
        values = [mpmath.mpf(float(v)) for v in member]
        true = angles(values, side)[link]
        c, s, angle = duals
        for own, exact in ((c, mpmath.cos(true)), (s, mpmath.sin(true))):
            assert own.value.lo[0] <= exact <= own.value.hi[0]
        off = (angle.value.mid[0] - true) / (2 * mpmath.pi)
        assert abs(2 * mpmath.pi * (off - mpmath.nint(off))) <= angle.value.rad[0] * (1 + 1e-12)
        for k in range(8):
            rate = mpmath.diff(lambda x: angles([*values[:k], x, *values[k + 1 :]], side)[link], values[k])  # noqa: B023
            for own, factor in ((angle, 1), (c, -mpmath.sin(true)), (s, mpmath.cos(true))):
                assert own.grad.lo[k, 0] - 1e-20 <= factor * rate <= own.grad.hi[k, 0] + 1e-20


@pytest.mark.parametrize("opening", OPENINGS)
@pytest.mark.parametrize("width, wide", [(1e-6, False), (1e-2, False), (1e-2, True)])
def test_members_and_their_rates_lie_inside(opening, width, wide):
    rng = np.random.default_rng([int(100 * opening), int(-10 * math.log10(width))])
    centre, side = random_dyad(rng, opening)
    half = width * math.sin(opening) ** 2 * rng.uniform(0.1, 1.0, 8)
    box = Interval.from_bounds((centre - half)[None], (centre + half)[None])
    for found, turned in (placed(box, side, None, wide), enclosed(box, side, wide)):
        assert found[0].value.lo > 0.0
        for member in (np.where(rng.random(8) < 0.5, box.lo[0], box.hi[0]), rng.uniform(box.lo[0], box.hi[0])):
            for link in (0, 1):
                holds(member, side, link, (found[3 + 2 * link], found[4 + 2 * link], turned[link]))


@pytest.mark.parametrize("opening", OPENINGS)
def test_enclosures_are_no_idle_ones(opening):
    """Over small boxes cosines, sines and rates are as wide as their members make them, up to a factor."""
    rng = np.random.default_rng(5)
    centre, side = random_dyad(rng, opening)
    half = 1e-4 * math.sin(opening) ** 2 * rng.uniform(0.5, 1.0, 8)
    members = centre + half * rng.choice([-1.0, 1.0], (2000, 8))
    box = Interval.from_bounds((centre - half)[None], (centre + half)[None])
    exact, exact_turned = placed(Interval(members), side, None)
    found, turned = enclosed(box, side)
    for own, sample in zip(found, exact):
        assert own.value.hi[0] - own.value.lo[0] <= 1.3 * np.ptp(sample.value.mid)
    for own, sample in zip(turned, exact_turned):
        wide, true = own.grad.hi[:, 0] - own.grad.lo[:, 0], np.ptp(sample.grad.mid, axis=1)
        assert wide.max() <= 6.0 * true.max()
