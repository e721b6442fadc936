"""How fast the parallel platform is; ``docs/explanation/parallel-platform.md`` holds what was measured.

Run by the normal suite once each, without timing; with times: ``pytest tests/bench --benchmark-enable -n 0``.
``pytest tests/bench/test_platform_speed.py -k ratio -s`` prints rates beside numpy and scipy on the same problems.
No time is asserted: machines differ.  Every benchmark checks its result.
"""

from __future__ import annotations

import math
import time

import numpy as np
import pytest

from graphsynth.kinematics.triad.assembly_modes import sextic
from graphsynth.systems.platform.parallel_platform import ParallelPlatform
from graphsynth.systems.platform.single_motor_platform import SingleMotorPlatform

G1, MOCK = ParallelPlatform.g1(), ParallelPlatform.mock()
LARGE = ParallelPlatform((0, 1, 0.3 + 0.9j), (0, 0.95, 0.32 + 0.85j), (0.5,) * 3, (1, 1.1, 0.9))
PLATFORMS = {"G1": G1, "MOCK": MOCK, "nearly as large as its base": LARGE}
MACHINE = SingleMotorPlatform(crank=(10, 5, 0), phase=(0, 0.5, 1))
MODES = {"G1": (147683, 45069, 4973, 2275), "MOCK": (174206, 25561, 233, 0)}
POSES = np.random.default_rng(0).uniform([0.4, 0.2, -3], [2, 1.6, 3], (200000, 3))
ANGLES = np.random.default_rng(9).uniform(-math.pi, math.pi, (200000, 3))


@pytest.fixture(scope="module", autouse=True)
def compiled():
    """Compile, or load from the cache, everything that is timed."""
    G1.inverse(POSES[:1])
    G1.direct_batch(ANGLES[:1])
    MACHINE.sweep([0.0, 1.0])


def repeat(benchmark, function):
    return benchmark.pedantic(function, rounds=5, warmup_rounds=1)


@pytest.mark.parametrize("sigma", [(1, 1, 1), None], ids=["one mode", "eight modes"])
def test_inverse(benchmark, sigma):
    got = repeat(benchmark, lambda: G1.inverse(POSES, sigma))
    assert np.isfinite(got.theta).any()
    assert (got.status <= 3).all()


@pytest.mark.long
@pytest.mark.parametrize("name", PLATFORMS)
def test_all_modes(benchmark, name):
    got = repeat(benchmark, lambda: PLATFORMS[name].direct_batch(ANGLES))
    assert got.consistent.all()
    if name in MODES:
        assert tuple(np.bincount(got.counts, minlength=7)[::2]) == MODES[name]


@pytest.mark.parametrize("accelerations", [False, True], ids=["velocities", "accelerations"])
def test_sweep(benchmark, accelerations):
    psi = np.linspace(0.0, 200 * math.tau, 72001)
    got = repeat(benchmark, lambda: MACHINE.sweep(psi, accelerations=accelerations))
    assert got.complete


@pytest.mark.parametrize("accelerations", [False, True], ids=["velocities", "accelerations"])
def test_many_dimension_sets(benchmark, accelerations):
    cranks = np.random.default_rng(1).uniform(1, 12, (300, 3))
    got = repeat(benchmark, lambda: MACHINE.full_turn_batch(cranks, accelerations=accelerations))
    assert got.complete.all()


def test_full_turn(benchmark):
    assert repeat(benchmark, MACHINE.full_turn).closed


# --- beside numpy and scipy -------------------------------------------------------------------------------------------


def rate(function, count, times=3):
    """Problems per second of processor time: the best of a few runs after one that is not counted."""
    function()
    seconds = []
    for _ in range(times):
        start = time.process_time()
        function()
        seconds.append(time.process_time() - start)
    return count / min(seconds)


def eigenvalue_counts(platform, theta):
    """Number of modes by eigenvalues of companion matrices, all problems in one call."""
    g0, g1, g2, g3 = sextic(platform.elbows(theta), np.array(platform.b), np.array(platform.l2)).g
    matrix = np.zeros((len(g0), 6, 6), dtype=complex)
    matrix[:, 0] = -np.stack([g2, g1, g0, np.conj(g1), np.conj(g2), np.conj(g3)], axis=-1) / g3[:, None]
    matrix[:, range(1, 6), range(5)] = 1.0
    return (np.abs(np.abs(np.linalg.eigvals(matrix)) - 1.0) < 1e-6).sum(axis=1)


def newton_of_scipy(platform, theta, guess):
    from scipy.optimize import fsolve

    return fsolve(lambda X: platform.closure(X, theta), guess, fprime=lambda X: platform.jacobians(X, theta)[0])


def report(capsys, what, ours, theirs):
    with capsys.disabled():
        line = ", ".join(f"{name} {value:.3g}/s (ratio {ours / value:.0f})" for name, value in theirs.items())
        print(f"\n{what}: graphsynth {ours:.3g}/s, {line}")


@pytest.mark.parametrize("name", PLATFORMS)
@pytest.mark.slow
def test_ratio_of_all_modes(capsys, name):
    platform, few = PLATFORMS[name], ANGLES[:4000]
    ours = rate(lambda: platform.direct_batch(ANGLES), len(ANGLES))
    eigen = rate(lambda: eigenvalue_counts(platform, few), len(few), 1)
    agree = eigenvalue_counts(platform, few) == platform.direct_batch(few).counts
    assert agree.mean() > 0.999  # the eigenvalues need a tolerance on |z| = 1
    solvable = platform.direct_batch(few)
    index = np.flatnonzero(solvable.counts)[:40]
    first = {k: solvable.poses[np.searchsorted(solvable.problem, k)] for k in index}
    weight = np.array([*[max(platform.l2)] * 2, 1.0])
    one_mode = rate(lambda: [newton_of_scipy(platform, few[k], first[k] + 0.01 * weight) for k in index], len(index), 1)
    report(capsys, f"all modes, {name}", ours, {"numpy eigvals": eigen, "scipy fsolve, one mode": one_mode})


def test_ratio_of_the_turn(capsys):
    psi = np.linspace(0.0, 200 * math.tau, 72001)
    ours = rate(lambda: MACHINE.sweep(psi), len(psi))
    short = psi[:61]
    theta = MACHINE.drive(short).theta
    reference = MACHINE.sweep(short).pose

    def chained():
        pose, worst = reference[0], 0.0
        for k in range(len(short)):
            pose = newton_of_scipy(MACHINE.platform, theta[k], pose)
            worst = max(worst, float(np.abs(pose - reference[k]).max()))
        return worst

    assert chained() < 1e-6
    report(capsys, "single motor, positions and velocities", ours, {"scipy fsolve, positions": rate(chained, 61, 1)})


def test_ratio_of_the_inverse(capsys):
    few = POSES[:20000]

    def numpy_formula():
        w = G1.vertices(few) - np.array(G1.D)
        r2, l1, l2 = np.abs(w) ** 2, np.array(G1.l1), np.array(G1.l2)
        with np.errstate(invalid="ignore"):
            S = np.sqrt(((l1 + l2) ** 2 - r2) * (r2 - (l1 - l2) ** 2))
        return np.angle(w) + np.arctan2(S, r2 + l1**2 - l2**2)

    difference = np.exp(1j * numpy_formula()) - np.exp(1j * G1.inverse(few, (1, 1, 1)).theta)
    assert np.nanmedian(np.abs(difference)) < 1e-15
    ours = rate(lambda: G1.inverse(POSES, (1, 1, 1)), len(POSES))
    eight = rate(lambda: G1.inverse(POSES), len(POSES))
    plain = rate(numpy_formula, len(few))
    report(capsys, "inverse, one working mode", ours, {"all eight": eight, "numpy, plain formula": plain})
