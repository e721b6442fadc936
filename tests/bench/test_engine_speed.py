"""How fast the planar engine is, beside scipy and pylinkage on the same problem.

Run by the normal suite once each, without timing; with times: ``pytest tests/bench/test_engine_speed.py
--benchmark-enable -n0``. No time is asserted: machines differ. Every benchmark checks its result; positions per second
are in the column of extra information and in ``docs/explanation/planar-engine.md``.
"""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.optimize import fsolve

from graphsynth import Driver, Mechanism, MechanismGraph, Revolute
from graphsynth.kinematics import pose_gradients
from graphsynth.kinematics.engine.batch import simulate_batch, solve_rrr
from graphsynth.kinematics.simulation import simulate

TURN = np.linspace(0.0, 2.0 * np.pi, 361)

#: A crank 1, the triad 2 (links 3, 4, 5 to it), then the dyads 6-7 and 8-9.
TEN = [
    (0, 1), (1, 3), (2, 3), (2, 4), (0, 4), (2, 5), (0, 5), (2, 6), (6, 7), (0, 7), (7, 8), (8, 9), (0, 9),
]  # fmt: skip


def four_bar() -> Mechanism:
    graph = MechanismGraph(4, [(0, 1), (1, 2), (2, 3), (0, 3)], frame=0)
    joints = [
        Revolute(0, 1), Revolute(1, 2, (1.0, 0.0)), Revolute(2, 3, (2.5, 0.0), (2.5, 0.0)), Revolute(0, 3, (2.0, 0.0)),
    ]  # fmt: skip
    return Mechanism(graph, joints, [Driver(0, 1)])


def ten_link() -> Mechanism:
    """Return a ten-link mechanism with a triad, given at a pose with all link frames along the fixed one."""
    at = dict(zip(TEN, [
        0j, 0.3 + 0j, 0.04 + 1.67j, 2.96 + 0.72j, 3.95 + 2.04j, 2.48 + 1.06j, 1.47 + 1.55j, 3.28 + 1.05j, 2.61 + 0.89j,
        1.11 + 2.24j, 2.24 + 2.35j, 1.32 + 0.07j, 0.48 + 1.12j,
    ]))  # fmt: skip
    joints = [Revolute(a, b, (z.real, z.imag), (z.real, z.imag)) for (a, b), z in at.items()]
    return Mechanism(MechanismGraph(10, TEN, frame=0), joints, [Driver(0, 1)], pose=((0.0, 0.0, 0.0),) * 10)


def varied(mechanism: Mechanism, sets: int) -> np.ndarray:
    """Dimension sets whose points differ by up to a thousandth."""
    sizes = np.repeat(mechanism.dimensions[None], sets, axis=0)
    moved = np.random.default_rng(1).uniform(-5e-4, 5e-4, (sets, sizes.shape[1], 2))
    sizes[..., 0:2] += moved
    sizes[..., 3:5] += moved
    return sizes


def timed(benchmark, run, count: int):
    """Run, and note positions per second."""
    result = benchmark.pedantic(run, rounds=5, warmup_rounds=1)
    if benchmark.stats:
        benchmark.extra_info["positions per second"] = f"{count / benchmark.stats.stats.min:.3g}"
    return result


@pytest.mark.parametrize(
    ("rates", "keep"), [(False, [2]), (True, [2]), (False, None), (True, None)],
    ids=["coupler", "coupler-rates", "all-links", "all-links-rates"],
)  # fmt: skip
def test_four_bar_batch(benchmark, rates, keep):
    mechanism = four_bar()
    sizes = varied(mechanism, 1000 if benchmark.enabled else 20)
    run = lambda: simulate_batch(mechanism, TURN, sizes, rates=rates, keep=keep)  # noqa: E731
    batch = timed(benchmark, run, len(sizes) * len(TURN))
    assert batch.completed.all()
    assert np.abs(batch.point(2, (5.0, 0.0))[0, 90] - (4.0, 4.0)).max() < 0.02


def test_four_bar_gradients(benchmark):
    """Positions of all links, and the derivatives of a point of the coupler by all dimensions and the driver."""
    mechanism = four_bar()
    sizes = varied(mechanism, 1000 if benchmark.enabled else 2)
    loads = np.zeros((len(sizes), 1, 4, 3, len(TURN)))
    loads[:, 0, 2, 0] = 1.0

    def run():
        frames = simulate_batch(mechanism, TURN, sizes, rates=False).frames
        return pose_gradients(mechanism, sizes, frames, loads)

    found = timed(benchmark, run, len(sizes) * len(TURN))
    step = 1e-6
    longer = np.stack([sizes[0], sizes[0]])
    longer[:, 1, 0] += [step, -step]  # the crank
    x = simulate_batch(mechanism, TURN, longer, rates=False).frames[:, :, 2, 0]
    assert np.abs((x[0] - x[1]) / (2.0 * step) - found.dimensions[0, 0, 1, 0]).max() < 1e-8


def test_rrr_dyads(benchmark):
    count = 1_000_000 if benchmark.enabled else 1000
    A = np.random.default_rng(2).uniform(-1.0, 1.0, (count, 2))
    B = A + np.array([3.0, 1.0])
    C, _ = timed(benchmark, lambda: solve_rrr(A, B, 2.5, 2.4), count)
    np.testing.assert_allclose(np.hypot(*(C - B).T), 2.4, rtol=1e-14)


@pytest.mark.parametrize("rates", [False, True])
def test_ten_link_batch(benchmark, rates):
    """A triad makes rates necessary: they are the predictor; without them only less is stored."""
    mechanism = ten_link()
    sizes = varied(mechanism, 300 if benchmark.enabled else 5)
    start = simulate(mechanism, [0.0]).poses[0]
    run = lambda: simulate_batch(mechanism, TURN, sizes, start=start, rates=rates)  # noqa: E731
    batch = timed(benchmark, run, len(sizes) * len(TURN))
    assert batch.completed.all()


def test_four_bar_by_fsolve(benchmark):
    """Baseline: scipy on the same four-bar, each position from the one before."""
    turn = TURN[: 361 if benchmark.enabled else 20]

    def closure(x, u):
        B = np.exp(1j * u) + 2.5 * np.exp(1j * x[0])
        gap = B - 2.0 - 2.5 * np.exp(1j * x[1])
        return gap.real, gap.imag

    def run():
        x, found = np.array([1.3, 1.8]), []
        for u in turn:
            x = fsolve(closure, x, args=(u,))
            found.append(x)
        return np.array(found)

    angles = timed(benchmark, run, len(turn))
    M = np.exp(1j * turn) + 5.0 * np.exp(1j * angles[:, 0])
    mine = simulate(four_bar(), turn).point(2, (5.0, 0.0)).position
    np.testing.assert_allclose(np.column_stack([M.real, M.imag]), mine, atol=1e-6)


def test_four_bar_by_pylinkage(benchmark):
    """Baseline: pylinkage's compiled solver on the same four-bar (one dimension set: it has no batch form)."""
    pylinkage = pytest.importorskip("pylinkage")
    from pylinkage.simulation import Linkage

    turns = 1000 if benchmark.enabled else 1
    O, C = pylinkage.Ground(0.0, 0.0), pylinkage.Ground(2.0, 0.0)
    crank = pylinkage.Crank(anchor=O, radius=1.0, angular_velocity=math.tau / 360)
    dyad = pylinkage.RRRDyad(anchor1=crank.output, anchor2=C, distance1=2.5, distance2=2.5)
    linkage = Linkage([O, C, crank, dyad])
    path = timed(benchmark, lambda: linkage.step_fast(iterations=360 * turns), 360 * turns)
    np.testing.assert_allclose(np.hypot(*(path[:, 3] - (2.0, 0.0)).T), 2.5, rtol=1e-12)
