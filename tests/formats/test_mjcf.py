"""MuJoCo runs the exported model: spec 5.9 and 7.3, exact tests of every element."""

import numpy as np
import pytest
from dynamic_models import g1

from graphsynth.dynamics import consistent_start
from graphsynth.formats import MujocoSettings, run_mujoco, to_mjcf

pytest.importorskip("mujoco")

G1_THETA, G1_OMEGA = 19.151183313715786848, 13.058518322326194277


@pytest.fixture(scope="module")
def start():
    return consistent_start(g1(), modes={0: 1}, keep={(0, 1): 0.0}, keep_rates={(0, 1): 10.0})


@pytest.mark.parametrize(
    ("settings", "error"),
    [
        (MujocoSettings(1e-3, solref=(0.002, 1.0)), -2.3e-5),
        (MujocoSettings(1e-3, solref=(-1e6, -2e3)), -8.9e-5),
        (MujocoSettings(1e-4, solref=(-1e8, -2e4)), -1.1e-6),
        (MujocoSettings(1e-4, "Euler", (-1e6, -2e3)), -3.0e-2),
    ],
)
def test_errors_of_the_spec(start, settings, error):
    run = run_mujoco(g1(), start, [0.0, 2.0], settings)
    assert run.completed
    assert run.poses[-1, 1, 2] - G1_THETA == pytest.approx(error, rel=0.05)


def test_too_stiff_for_the_step_is_a_failure(start, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    run = run_mujoco(g1(), start, [0.0, 1.0, 2.0], MujocoSettings(1e-3, solref=(-1e8, -2e4)))
    assert run.status == "failed" and np.isnan(run.poses[-1]).all()
    assert not list(tmp_path.iterdir())  # no log file


def test_text_is_deterministic(start):
    assert to_mjcf(g1(), start).xml == to_mjcf(g1(), start).xml
