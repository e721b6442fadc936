"""The numbers of theory/joints-that-share-a-tilt 6 and theory/values-of-bearings 6, 7."""

import math

import numpy as np
import pytest

from graphsynth import simulate
from graphsynth.jamming import Bearing, Verdict
from graphsynth.jamming.joints import RIGID, SPHERICAL, JointLimits, Misalignment, assess_coupled
from graphsynth.jamming.joints.program import problem

T_A = 0.006064396559156420060266102798724801172486
T_B = 0.005938219994357610895366507614303110074863

# 14.6: T* for limits of 1 and a = (1/30, 0), and the point p of the dual
FACTORS = {
    0: (0.01632993161855452065464856, (1.5, 2.449489742783178098197)),
    30: (0.01644082653842902107990020, (2.410161567554762833481, 2.466123980764353161985)),
    60: (0.01642790418141929328093259, (2.394255732886254510040, 2.476169108463767616759)),
    90: (0.01666666666666666666666667, (2.0, 2.5)),
    180: (0.01333333333333333333333333, (0.5, 2.0)),
    270: (0.01128363000613664767070848, (0.6119027253953977771347, 5.525045592973513807919)),
}


def assess(mechanism, degrees, bearings, **options):
    motion = simulate(mechanism, np.radians(np.asarray(degrees, dtype=float)))
    return assess_coupled(motion, bearings, Misalignment(0, 1, options.pop("alpha", 1 / 30), **options))


def test_table_of_least_tilts(lambda_mechanism):
    report = assess(lambda_mechanism, list(FACTORS), JointLimits(1.0))
    expected = np.array([value for value, _ in FACTORS.values()])
    assert np.abs(report.factor / expected - 1.0).max() < 1e-14
    assert report.duality_gap.max() < 1e-13


def test_points_of_the_dual_certificates(lambda_mechanism):
    """The wrench of the loop is a force through p: p = (-M_y, M_x) / f (14.6)."""
    motion = simulate(lambda_mechanism, np.radians(np.array(list(FACTORS), dtype=float)))
    found = problem(lambda_mechanism, JointLimits(1.0), Misalignment(0, 1, 1 / 30)).solve(motion.poses)
    p = found.units.centre + found.units.length * np.column_stack([-found.y[:, 1], found.y[:, 0]]) / found.y[:, 2:]
    expected = np.array([point for _, point in FACTORS.values()])
    assert np.abs(p - expected).max() < 2e-7  # flat around a smooth maximum: half of the digits


def test_bearings_give_the_ratio_to_the_critical_tilt(lambda_mechanism):
    report = assess(lambda_mechanism, list(FACTORS), Bearing())
    expected = np.array([value for value, _ in FACTORS.values()]) / T_A
    assert np.abs(report.factor / expected - 1.0).max() < 1e-13


@pytest.mark.parametrize("f", [0, 90, 180])
def test_optimum_at_the_bearing_b(lambda_mechanism, f):
    report = assess(lambda_mechanism, [f], JointLimits(1.0))
    height = {0: math.sqrt(6.0), 90: 2.5, 180: 2.0}[f]
    assert report.factor[0] == pytest.approx(height / 5.0 / 30.0, rel=1e-14)
    price = dict(zip(report.names, report.shadow_price[0]))
    assert price[((2, 3), "tilt")] < 1e-12  # p = B: no moment there


@pytest.mark.parametrize(
    ("change", "verdict"),
    [
        (1e-9, Verdict.FREE_ESTIMATED),
        (3e-13, Verdict.TOUCHING_ESTIMATED),
        (0.0, Verdict.TOUCHING_ESTIMATED),
        (-3e-13, Verdict.TOUCHING_ESTIMATED),
        (-1e-9, Verdict.JAMMED_ESTIMATED),
    ],
)
def test_a_limit_that_is_just_reached_is_touched(lambda_mechanism, change, verdict):
    """At 90 degrees the least tilt is 2.5 / 5 / 30: a limit of that size leaves no clearance."""
    report = assess(lambda_mechanism, [90], JointLimits((1.0 + change) / 60.0))
    assert report.verdict is verdict


def test_whole_turn_is_free_up_to_twice_the_critical_tilt(lambda_mechanism):
    degrees = np.arange(0.0, 360.0, 1.0)
    report = assess(lambda_mechanism, degrees, Bearing())
    assert report.worst_input == pytest.approx(math.pi / 2)
    assert report.smallest_scale / 30.0 == pytest.approx(0.012128793118312840120532205597449602345, rel=1e-14)
    assert report.factor.min() >= 1.0 / 90.0 / T_A * (1.0 - 1e-14)  # alpha / 3 at every pose: jams everywhere
    assert report.verdict.name == "JAMMED_ESTIMATED"
    assert assess(lambda_mechanism, degrees, Bearing(), alpha=2.0 * T_A * (1.0 - 1e-9)).verdict.name == "FREE_ESTIMATED"
    assert assess(lambda_mechanism, degrees, Bearing(), alpha=2.0 * T_A).verdict.name == "TOUCHING_ESTIMATED"


def test_axial_play_does_not_help_below_a_third(lambda_mechanism):
    report = assess(lambda_mechanism, range(0, 360, 10), JointLimits(1.0, axial_clearance=1e3))
    assert np.abs(report.factor - 1.0 / 90.0).max() < 1e-13
    assert report.duality_gap.max() < 1e-12


@pytest.mark.parametrize(("direction", "f", "factor"), [(135.0, 40.0, 0.699), (90.0, None, 0.586)])
def test_direction_of_the_tilt(lambda_mechanism, direction, f, factor):
    report = assess(
        lambda_mechanism, range(0, 360, 10), JointLimits(1.0), alpha=0.03, direction=math.radians(direction)
    )
    assert report.worst_factor / 0.03 == pytest.approx(factor, abs=5e-4)
    if f is not None:
        assert math.degrees(report.worst_input) == pytest.approx(f)


@pytest.mark.parametrize(("condition", "critical"), [("A", T_A), ("B", T_B)])
def test_one_bearing_alone_is_the_model_of_the_source(lambda_mechanism, condition, critical):
    """A spherical joint at A and a rigid rocker leave all of the tilt to B: A_z / l3 to first order in alpha."""
    f = np.arange(0.0, 360.0, 7.0)
    bearings = {(1, 2): SPHERICAL, (2, 3): Bearing(), (0, 3): RIGID}
    motion = simulate(lambda_mechanism, np.radians(f))
    report = assess_coupled(motion, bearings, Misalignment(0, 1, 1 / 30), condition=condition)
    expected = np.abs(np.sin(np.radians(f))) / 30.0 * 0.4 / critical
    assert np.abs(report.factor - expected).max() < 1e-12
