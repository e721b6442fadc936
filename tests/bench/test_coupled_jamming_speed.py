"""How fast the coupled jamming model is, beside HiGHS on a polygonal form and clarabel on the same cone program.

Run by the normal suite once each, without timing; with times: ``pytest tests/bench/test_coupled_jamming_speed.py
--benchmark-enable -n0``. No time is asserted: machines differ.  Every benchmark checks its result.
"""

from __future__ import annotations

import math
from itertools import islice

import numpy as np
import pytest
from scipy.optimize import linprog
from scipy.sparse import csc_matrix

from graphsynth import Driver, Mechanism, MechanismGraph, Revolute, enumerate_chains, simulate
from graphsynth.jamming import Bearing
from graphsynth.jamming.joints import JointLimits, Misalignment, certify_coupled, compare_sensitivities, largest_scale
from graphsynth.jamming.joints.closure import force_rows, joint_places, leans, moment_rows, work_row
from graphsynth.jamming.joints.program import problem
from graphsynth.kinematics.dimensional import embody

TURN = np.linspace(0.0, 2.0 * np.pi, 37)


def four_bar() -> Mechanism:
    graph = MechanismGraph(4, [(0, 1), (1, 2), (2, 3), (0, 3)], frame=0)
    joints = [
        Revolute(0, 1), Revolute(1, 2, (1.0, 0.0)), Revolute(2, 3, (2.5, 0.0), (2.5, 0.0)), Revolute(0, 3, (2.0, 0.0)),
    ]  # fmt: skip
    return Mechanism(graph, joints, [Driver(0, 1)])


def timed(benchmark, run, count: int):
    """Run, and note the rate."""
    result = benchmark.pedantic(run, rounds=3, warmup_rounds=1)
    if benchmark.stats:
        benchmark.extra_info["per second"] = f"{count / benchmark.stats.stats.min:.3g}"
    return result


@pytest.fixture(scope="module")
def eight():
    """Return an eight-link mechanism, its motion and its misalignment."""
    mechanism = embody(next(islice(enumerate_chains(8), 3, None)), seed=0).mechanism
    driver = mechanism.drivers[0]
    return mechanism, Misalignment(driver.base, driver.link, 0.01, 0.3)


@pytest.mark.parametrize("play", [0.0, 0.01], ids=["no-play", "play"])
def test_eight_links(benchmark, eight, play):
    """360 poses, primal and dual."""
    mechanism, tilt = eight
    poses = simulate(mechanism, np.linspace(0.0, 6.28, 360 if benchmark.enabled else 12)).poses
    given = problem(mechanism, JointLimits(0.006, play), tilt)
    found = timed(benchmark, lambda: given.solve(poses), len(poses))
    assert ((found.upper - found.lower) <= 1e-9 * found.upper).all()


def test_eight_links_by_linear_programs(benchmark, eight):
    """The dual with 64-sided polygons for circles, one HiGHS call for each pose: three digits."""
    mechanism, tilt = eight
    poses = simulate(mechanism, np.linspace(0.0, 6.28, 36 if benchmark.enabled else 2)).poses
    given = problem(mechanism, JointLimits(0.006), tilt)
    layout = given.layout
    at = joint_places(mechanism, layout.joints, poses)
    M, W = moment_rows(layout, at.r, at.e), work_row(layout, leans(layout, at))
    assert force_rows(layout).shape[0] == len(layout.joints)
    costly = np.flatnonzero(layout.limit > 0.0)
    angle = 2.0 * math.pi * np.arange(64) / 64
    normals = np.stack([np.cos(angle), np.sin(angle)], axis=1)

    def run():
        values = []
        for m, w in zip(M, W):
            k = len(w)
            rows = np.zeros((64 * len(costly) + 1, k + len(costly)))
            for i, block in enumerate(costly):
                rows[64 * i : 64 * i + 64, :k], rows[64 * i : 64 * i + 64, k + i] = normals @ m[block], -1.0
            rows[-1, k:] = layout.limit[costly]
            right = np.zeros(len(rows))
            right[-1] = 1.0
            bounds = [(None, None)] * k + [(0.0, None)] * len(costly)
            values.append(-linprog(np.append(-w, np.zeros(len(costly))), rows, right, bounds=bounds).fun)
        return np.array(values)

    values = timed(benchmark, run, len(poses))
    exact = given.solve(poses).lower
    assert (values >= exact * (1 - 1e-7)).all() and (values <= exact / math.cos(math.pi / 64) * (1 + 1e-7)).all()


def test_certified_turn_of_the_lambda_linkage(benchmark):
    motion = simulate(four_bar(), TURN)
    proof = timed(benchmark, lambda: certify_coupled(motion, Bearing(), Misalignment(0, 1, 0.0115)), 1)
    assert proof.verdict.name == "CERTIFIED_FREE"


def test_certified_motion_of_eight_links(benchmark, eight):
    """The whole turn; part of it without timing."""
    mechanism, tilt = eight
    motion = simulate(mechanism, TURN if benchmark.enabled else np.linspace(0.0, 0.6, 5))
    proof = timed(benchmark, lambda: certify_coupled(motion, JointLimits(0.006, 0.002), tilt), 1)
    assert proof.verdict.name == "CERTIFIED_FREE"


def test_loosening_every_limit_of_eight_links(benchmark, eight):
    """Every limit by itself, over 360 poses."""
    mechanism, tilt = eight
    motion = simulate(mechanism, np.linspace(0.0, 6.28, 360 if benchmark.enabled else 6))
    table = timed(benchmark, lambda: compare_sensitivities(motion, JointLimits(0.006, 0.002), tilt), 1)
    assert len(table.rows) == 2 * (len(mechanism.joints) - 1) and table.rows[0].gain > 0.05


def test_largest_misalignment_of_the_lambda_linkage(benchmark):
    motion = simulate(four_bar(), TURN)
    gap = 1e-3 if benchmark.enabled else 1e-2
    run = lambda: largest_scale(motion, Bearing(), Misalignment(0, 1, 1 / 30), relative_gap=gap)  # noqa: E731
    found = timed(benchmark, run, 1)
    assert found.low / 30 < 2 * 0.006064396559156420 < found.high / 30 * (1 + 1e-15)


@pytest.mark.parametrize("method", ["batched", "clarabel"])
def test_the_cone_program_of_many_poses(benchmark, eight, method):
    """The same second-order cone programs: all poses at once here, one call for each pose in clarabel."""
    mechanism, tilt = eight
    poses = simulate(mechanism, np.linspace(0.0, 6.28, 360 if benchmark.enabled else 6)).poses
    given = problem(mechanism, JointLimits(0.006), tilt)
    layout = given.layout
    exact = given.solve(poses)
    if method == "batched":
        found = timed(benchmark, lambda: given.solve(poses), len(poses))
        assert ((found.upper - found.lower) <= 1e-9 * found.upper).all()
        return
    clarabel = pytest.importorskip("clarabel")
    at = joint_places(mechanism, layout.joints, poses)
    rows, work = moment_rows(layout, at.r, at.e), work_row(layout, leans(layout, at))
    costly = np.flatnonzero(layout.limit > 0.0)
    settings = clarabel.DefaultSettings()
    settings.verbose = False

    def one(moments, own):
        """Maximise the work of the wrenches q subject to sum of t |M q| <= 1, with u_b >= |M_b q|."""
        k, blocks = len(own), len(costly)
        matrix = np.zeros((1 + 3 * blocks, k + blocks))
        matrix[0, k:] = layout.limit[costly]
        for i, block in enumerate(costly):
            matrix[1 + 3 * i, k + i] = -1.0
            matrix[2 + 3 * i : 4 + 3 * i, :k] = -moments[block]
        right = np.zeros(len(matrix))
        right[0] = 1.0
        cones = [clarabel.NonnegativeConeT(1), *[clarabel.SecondOrderConeT(3)] * blocks]
        cost = np.append(-own, np.zeros(blocks))
        nothing = csc_matrix((len(cost), len(cost)))
        return -clarabel.DefaultSolver(nothing, cost, csc_matrix(matrix), right, cones, settings).solve().obj_val

    values = timed(benchmark, lambda: np.array([one(*pair) for pair in zip(rows, work)]), len(poses))
    np.testing.assert_allclose(values, exact.lower, rtol=1e-6)
