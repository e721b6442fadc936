"""Two models under different conventions: published differences, mirrored legs by their rigid rods."""

from __future__ import annotations

import math

import numpy as np
import pytest

from graphsynth.core.errors import GeometryError
from graphsynth.systems.antenna import Convention, PointingMechanism
from graphsynth.systems.antenna.closed_form import read_angles
from graphsynth.systems.antenna.model import orientation

ART = PointingMechanism()
DEGREES = np.array([5.0, 10.0, 15.0, 20.0, 30.0, 40.0])
PHI = np.radians(DEGREES)
XY = PointingMechanism(order="XY")
REVERSED_BOTH = Convention(sense_y=-1, sense_x=-1)

# theory/antenna 8: minutes of arc against order YX.  Reversed cranks turn the reflector the other way: the means are
# compared after reversing the outputs too, which for both legs is the same as mounting them on the negative side.
TABLE = [
    ("order XY", XY, Convention(), [0.008, 0.130, 0.656, 2.060, 10.201, 30.990], 5.1e-4),
    ("both reversed", ART, Convention(side_y=-1, side_x=-1), [0.008, 0.130, 0.656, 2.060, 10.201, 30.990], 5.1e-4),
    ("Y reversed", ART, Convention(side_y=-1), [0.01, 0.15, 0.74, 2.34, 11.81, 37.19], 5.1e-3),
    ("X reversed", ART, Convention(side_x=-1), [0.00, -0.02, -0.08, -0.27, -1.54, -5.62], 5.1e-3),
    ("l2 + 1 mm", PointingMechanism(l2=0.151), Convention(), [0.00, 0.00, 0.00, 0.01, 0.04, 0.12], 5.1e-3),
    ("l1 + 0.5 mm", PointingMechanism(l1=0.1005), Convention(), [-0.89, -1.78, -2.69, -3.64, -5.62, -7.75], 5.1e-3),
    ("l3 + 0.5 mm", PointingMechanism(l3=0.0597), Convention(), [0.75, 1.51, 2.27, 3.05, 4.65, 6.29], 5.1e-3),
    ("normal", ART, Convention(output="normal"), [0.12, 0.94, 3.14, 7.33, 23.50, 51.19], 5.1e-3),
]


@pytest.mark.parametrize(
    ("other", "reading", "want", "tolerance"), [row[1:] for row in TABLE], ids=[r[0] for r in TABLE]
)
def test_published_table(other, reading, want, tolerance):
    found = ART.compare(other, PHI, other_reading=reading)
    np.testing.assert_allclose(found.arcminutes, want, rtol=0, atol=tolerance)
    assert found.assembled.all()


def test_growth_to_31_minutes():
    want = [0.00815589957422, 0.130165128451, 0.656058727127, 2.059786433, 10.2009845704, 30.9895760535]
    found = ART.compare(XY, PHI)
    np.testing.assert_allclose(found.arcminutes, want, rtol=5e-12, atol=1e-12)  # twelve printed digits
    apart = [0.226787926221, 1.73075995001, 5.55290270232, 12.4627030642, 37.1624955197, 75.8533657588]
    np.testing.assert_allclose(np.degrees(found.separation[0]) * 60.0, apart, rtol=5e-12, atol=1e-12)
    fine = ART.compare(XY, np.radians(np.linspace(0.0, 40.0, 401))).arcminutes
    assert (np.diff(fine[1:]) > 0.0).all()
    assert np.degrees(found.means[0, -1]) == pytest.approx(23.08, abs=0.005)


def test_other_cranks_that_fit():
    def end(l2, crank, **reading):
        one = PointingMechanism(l2=l2, l4=l2, l3=crank, l5=crank)
        two = one if reading else PointingMechanism(l2=l2, l4=l2, l3=crank, l5=crank, order="XY")
        return float(one.compare(two, math.radians(40), other_reading=Convention(**reading)).arcminutes)

    assert end(0.10, 0.05432) == pytest.approx(31.0, abs=0.03)
    assert end(0.20, 0.06280) == pytest.approx(31.0, abs=0.03)
    assert end(0.15, 0.05656, side_y=-1) == pytest.approx(31.0, abs=0.03)


def test_reversed_cranks_without_reading_the_outputs_back():
    """The raw reversal: both outputs change sign up to the identity between the gimbal orders."""
    found = ART.compare(XY, PHI, other_reading=REVERSED_BOTH)
    np.testing.assert_allclose(found.a[1], -found.b[0], rtol=0, atol=1e-15)
    np.testing.assert_allclose(found.b[1], -found.a[0], rtol=0, atol=1e-15)


@pytest.mark.parametrize("order", ["YX", "XY"])
@pytest.mark.parametrize(("side_y", "side_x"), [(1, 1), (-1, 1), (1, -1), (-1, -1)])
def test_mirrored_legs_have_rigid_rods(order, side_y, side_x):
    """Build the mirrored mechanism from its points: senses of rotation kept, legs on the negative side."""
    mechanism = PointingMechanism(0.1, 0.13, 0.05, 0.17, 0.07, order)
    l1, l2, l3, l4, l5 = mechanism.lengths
    random = np.random.default_rng(4)
    x, y = random.uniform(-0.7, 0.7, (2, 50))
    a, b, _ = read_angles(mechanism, Convention(side_y=side_y, side_x=side_x), x, y)
    R, zero = orientation(a, b, order), np.zeros(50)
    # crank vector (0, side l3, 0) turned by R_x(phi), (side l5, 0, 0) turned by R_y(phi)
    S_y = np.stack([zero, side_y * (l1 - l3 + l3 * np.cos(x)), -l2 + side_y * l3 * np.sin(x)], -1)
    S_x = np.stack([side_x * (l1 - l5 + l5 * np.cos(y)), zero, -l4 - side_x * l5 * np.sin(y)], -1)
    np.testing.assert_allclose(np.linalg.norm(side_y * l1 * R[..., :, 1] - S_y, axis=-1), l2, rtol=0, atol=1e-16 * 4)
    np.testing.assert_allclose(np.linalg.norm(side_x * l1 * R[..., :, 0] - S_x, axis=-1), l4, rtol=0, atol=1e-16 * 4)


def test_unreachable_poses_stay_nan():
    short = PointingMechanism(l3=0.1, l5=0.1)
    found = ART.compare(short, np.radians([10.0, 70.0]))
    assert found.assembled.tolist() == [True, False]
    assert np.isnan(found.arcminutes).tolist() == [False, True]


def test_bad_readings():
    with pytest.raises(GeometryError, match="side_y = 0"):
        Convention(side_y=0)
    with pytest.raises(GeometryError, match="output = 'beam'"):
        Convention(output="beam")
