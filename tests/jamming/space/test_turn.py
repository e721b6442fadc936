"""Ranges of inputs with exact closure in space: the closed form of one bearing, the lambda linkage, refusals."""

import math

import numpy as np
import pytest
from coupled_oracles import four_bar

from graphsynth import Driver, Gear, Mechanism, MechanismGraph, Revolute, simulate
from graphsynth.core.errors import GeometryError
from graphsynth.jamming import Bearing, Verdict, assess_jamming
from graphsynth.jamming.joints import RIGID, SPHERICAL, JointLimits, Misalignment
from graphsynth.jamming.space import certify_in_space

FREE, JAMMED, SOME = Verdict.CERTIFIED_FREE, Verdict.CERTIFIED_JAMMED, Verdict.CERTIFIED_JAMMED_FOR_SOME


def one_bearing(limit):
    return {(0, 1): RIGID, (1, 2): SPHERICAL, (2, 3): limit, (0, 3): RIGID}


@pytest.mark.long
def test_between_small_and_exact_tilts_the_exact_ones_decide():
    """(1, 3, 2, 3.5): small tilts need 1.5 alpha = 0.12, exact ones asin(1.5 sin alpha) = 0.12016, which is more."""
    alpha, motion = 0.08, simulate(four_bar(1, 3, 2, 3.5), [1.57, 1.571])
    tilt = Misalignment(0, 1, alpha)
    assert assess_jamming(motion, tilt=tilt, joints=one_bearing(JointLimits(0.1201)), seconds=0.1).verdict not in (
        FREE, JAMMED)  # fmt: skip
    report = assess_jamming(motion, tilt=tilt, joints=one_bearing(JointLimits(0.1201)), model="exact", seconds=3.0)
    assert report.certificate.arcs(-1)
    assert report.verdict is JAMMED and "exact closure" in report.model


@pytest.mark.slow
def test_the_ends_of_a_range_of_limits_count():
    motion = simulate(four_bar(1, 3, 2, 3.5), [1.57, 1.571])
    tilt, wanted = Misalignment(0, 1, 0.02), math.asin(1.5 * math.sin(0.02))
    for ends, verdict in (((0.9, 0.99), JAMMED), ((0.99, 1.01), SOME), ((1.01, 1.1), FREE)):
        low, high = (wanted * end for end in ends)
        limit = JointLimits(0.5 * (low + high), tilt_range=(low, high))
        assert certify_in_space(motion, one_bearing(limit), tilt, seconds=20.0).verdict is verdict


@pytest.mark.slow
@pytest.mark.parametrize(("alpha", "verdict"), [(0.0121, FREE), (0.0122, JAMMED)])
def test_the_lambda_linkage_over_a_full_rotation(alpha, verdict):
    """Free exactly up to 2 t_A = 0.0121288 with small tilts; the exact limit differs by alpha squared of it."""
    motion = simulate(four_bar(), np.linspace(0.0, 2.0 * math.pi, 37))
    assert certify_in_space(motion, Bearing(), Misalignment(0, 1, alpha), seconds=120.0).verdict is verdict


@pytest.mark.slow
def test_no_contradiction_with_the_certificate_of_one_bearing():
    """Random linkages with |alpha| up to 0.3, limits beside the closed form of the bearing at B."""
    rng = np.random.default_rng(8)
    count = undecided = 0
    while count < 60:
        lengths = rng.uniform(1.5, 3.0), 1.0, rng.uniform(2.0, 3.5), rng.uniform(2.0, 3.5)
        u = rng.uniform(0.0, 6.28)
        motion = simulate(four_bar(*lengths), [u, u + 1e-6])
        alpha = 0.3 * 10.0 ** rng.uniform(-2, 0)
        sine = math.sin(alpha) * np.abs(np.sin(motion.inputs)) / lengths[2]
        if not motion.assembled.all() or sine.min() < 0.02 * math.sin(alpha):
            continue
        count += 1
        away = rng.choice([-1.0, 1.0]) * 10.0 ** rng.uniform(-5, -1)
        edge = np.arcsin(sine.max() if away > 0.0 else sine.min())
        limits = one_bearing(JointLimits(edge * (1.0 + away)))
        found = certify_in_space(motion, limits, Misalignment(0, 1, alpha), resolution=0.2)
        undecided += found.verdict is Verdict.UNDECIDED
        assert found.verdict in (FREE if away > 0.0 else JAMMED, Verdict.UNDECIDED)
    assert undecided <= 0.2 * count


def test_what_cannot_be_told_is_undecided_or_refused():
    motion = simulate(four_bar(), [0.2, 0.4])
    with pytest.raises(GeometryError, match="model"):
        assess_jamming(motion, tilt=0.01, joints=0.1, model="best")
    stopped = certify_in_space(motion, JointLimits(0.1), Misalignment(0, 1, 0.1), max_pieces=0)
    assert stopped.verdict is Verdict.UNDECIDED and "limit of work" in stopped.reason and stopped.share(0) == 1.0
    graph = MechanismGraph(3, [(0, 1), (1, 2, 2), (0, 2)], frame=0)
    geared = Mechanism(graph, [Revolute(0, 1), Gear(1, 2, radius_b=2.0), Revolute(0, 2, (3.0, 0.0))], [Driver(0, 1)])
    found = certify_in_space(simulate(geared, [0.0, 0.1]), JointLimits(0.1), Misalignment(0, 1, 0.01))
    assert found.verdict is Verdict.UNDECIDED and "gear" in found.reason
