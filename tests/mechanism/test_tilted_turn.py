"""Full turns of linkages whose crank axis is tilted, against 40-digit margins."""

import math

import mpmath as mp
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from graphsynth.mechanism.four_bar import TiltedFourBar

CHANGE, STRETCHED = (2.0, 1.0, 2.0, 3.0), (4.0, 1.0, 1.0, 2.0)


def margins(linkage, f):
    """The three quantities that must stay positive, over the square of the largest length, from the definition."""
    n, turn = [mp.mpf(c) for c in linkage.axis], mp.mpf(linkage.alpha)
    cross = mp.matrix([[0, -n[2], n[1]], [n[2], 0, -n[0]], [-n[1], n[0], 0]])
    R = mp.eye(3) + mp.sin(turn) * cross + (1 - mp.cos(turn)) * cross * cross
    l1, l2, l3, l4 = (mp.mpf(length) for length in (linkage.l1, linkage.l2, linkage.l3, linkage.l4))
    x, y, z = l2 * (R * mp.matrix([mp.cos(f), mp.sin(f), 0]))
    s3 = mp.sqrt(l3 * l3 - z * z) if linkage.rod == "rigid" else l3
    square = (x - l1) ** 2 + y * y
    found = [square - (l4 - s3) ** 2, (l4 + s3) ** 2 - square, l3 * l3 - z * z if linkage.rod == "rigid" else mp.inf]
    return [value / max(l1, l2, l3, l4) ** 2 for value in found]


@pytest.fixture(autouse=True)
def digits():
    with mp.workdps(40):
        yield


@pytest.mark.parametrize("rod", ["rigid", "deck"])
def test_margins_to_a_few_roundings(rod):
    """Relative to the square of the largest length, so that 64 roundings are a safe border of what is not decided."""
    rng, worst = np.random.default_rng(5), 0.0
    for _ in range(60):
        l1, l2, l3, l4 = rng.uniform(0.5, 3.0, 4)
        tilt = {"alpha": rng.uniform(-3.0, 3.0), "axis": tuple(rng.normal(size=3)), "rod": rod}
        linkage = TiltedFourBar(l1, l2, l3 + l2, l4, **tilt)
        f = rng.uniform(0.0, math.tau, 4)
        for angle, found in zip(f, linkage._margins(f)):
            worst = max(worst, abs(float(min(margins(linkage, mp.mpf(angle))) - mp.mpf(found))))
    assert worst < 8 * 2.0**-52


@pytest.mark.parametrize("alpha", [1 / 30, -0.4])
@pytest.mark.parametrize("rod", ["rigid", "deck"])
@pytest.mark.parametrize("steps", [0, 1, -1, 4, -4, 2**12, -(2**12), 2**24, -(2**24)])
def test_near_a_change_point_only_what_lies_beyond_rounding_is_decided(steps, rod, alpha):
    """At f = 0 the pin lies in the plane, where the margin is exactly ((l1 - l2)^2 - (l4 - l3)^2) / l4^2."""
    l1, l2, l3, l4 = CHANGE
    turn = TiltedFourBar(l1 + steps * 2.0**-51, l2, l3, l4, alpha=alpha, rod=rod).full_turn()
    assert turn.method == "estimated"
    if abs(steps) >= 2**12:
        assert turn.kind == ("full turn" if steps > 0 else "limited") and turn.possible == (steps > 0)
        return
    assert not turn.possible
    assert turn.kind == ("limited" if steps < 0 else "change point")
    angles = np.array(turn.change_angles if steps >= 0 else turn.limit_angles)
    assert len(angles) and np.abs(np.sin(angles)).max() < 1e-6 and (np.cos(angles) > 0).all()
    assert steps < 0 or "rounding level" in turn.statement


@pytest.mark.parametrize("alpha", [1 / 30, -0.4])
@pytest.mark.parametrize("steps", [0, 1, -1, 4, -4, 2**12, -(2**12), 2**24, -(2**24)])
def test_near_an_immovable_linkage_only_what_lies_beyond_rounding_is_decided(steps, alpha):
    """Stretched at f = 0, where the margin is exactly ((l3 + l4)^2 - (l1 - l2)^2) / l1^2, and largest."""
    l1, l2, l3, l4 = STRETCHED
    linkage = TiltedFourBar(l1 - steps * 2.0**-51, l2, l3, l4, alpha=alpha)
    turn = linkage.full_turn()
    assert not turn.possible
    if abs(steps) < 2**12:
        assert turn.kind == "immovable" and "rounding level" in turn.statement and len(turn.limit_angles) == 1
        assert abs(math.sin(turn.limit_angles[0])) < 1e-6
    else:
        assert turn.kind == ("limited" if steps > 0 else "never assembled")
        for angle in turn.limit_angles:
            assert abs(min(margins(linkage, mp.mpf(angle)))) < 1e-15
        assert len(turn.limit_angles) == (2 if steps > 0 else 0)


@pytest.mark.long
@pytest.mark.parametrize("rod", ["rigid", "deck"])
@pytest.mark.parametrize("depth", [1e-8, -1e-8, 1e-6, -1e-6])
def test_a_dip_between_two_samples_is_seen(depth, rod):
    """The smallest margin lies between samples; below zero for less than their distance there are two dead points."""

    def lowest(l1):
        linkage = TiltedFourBar(l1, 1.0, 2.0, 3.0, alpha=0.5, axis=(1.0, 2.0, 0.5), rod=rod)
        grid = np.linspace(0.0, math.tau, 2881)
        f = mp.mpf(float(grid[np.argmin(linkage._margins(grid))]))
        f = mp.findroot(lambda x: mp.diff(lambda y: margins(linkage, y)[0], x), (f, f + 1e-3), tol=1e-20)
        return linkage, f, float(margins(linkage, f)[0])

    sizes = [1.9, 2.2]
    for _ in range(7):  # secant
        first, second = (lowest(size)[2] - depth for size in sizes[-2:])
        sizes.append(sizes[-1] - second * (sizes[-1] - sizes[-2]) / (second - first) if second != first else sizes[-1])
    linkage, f, least = lowest(sizes[-1])
    turn = linkage.full_turn()
    assert least == pytest.approx(depth, rel=1e-3)
    if depth > 0:
        assert turn.possible and turn.kind == "full turn" and f"{depth:.3g}" in turn.statement
    else:
        assert turn.kind == "limited" and len(turn.limit_angles) == 2
        for angle in turn.limit_angles:
            assert abs(margins(linkage, mp.mpf(angle))[0]) < 1e-14
            assert abs(mp.mpf(angle) - f) < math.tau / 1440


@pytest.mark.parametrize(("node", "tilt"), [(100, 0.5), (1000, -1.1)])
def test_the_one_angle_of_an_immovable_linkage_is_told(node, tilt):
    """The motor turned back by the angle of a sample, then tilted: stretched there, with a margin of rounding size."""
    angle = node * math.tau / 1440
    turned = (Rotation.from_rotvec([tilt, 0.0, 0.0]) * Rotation.from_rotvec([0.0, 0.0, -angle])).as_rotvec()
    turn = TiltedFourBar(*STRETCHED, alpha=float(np.linalg.norm(turned)), axis=tuple(turned)).full_turn()
    assert turn.kind == "immovable" and turn.limit_angles == pytest.approx([angle], abs=1e-9)


def test_a_tilt_below_rounding_is_flat():
    """Nothing changes over the turn: one margin, no dips to look for."""
    turn = TiltedFourBar(2.0, 1e-30, 2.0, 3.0, alpha=0.1).full_turn()
    assert turn.kind == "full turn" and "0.333" in turn.statement
