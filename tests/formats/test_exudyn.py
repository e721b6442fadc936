"""The exported model in exudyn: every kind of joint and load against the internal motion.

See theory/planar-dynamics 9 and theory/exports 3.
"""

import engine_models as models
import numpy as np
import pytest
from dynamic_models import g1

from graphsynth.core.errors import GeometryError
from graphsynth.dynamics import consistent_start, simulate_dynamics
from graphsynth.formats import ExudynSettings, run_exudyn
from graphsynth.mechanism.laws import Driver, Harmonic

pytest.importorskip("exudyn")

G1_THETA = 19.151183313715786848


@pytest.fixture(scope="module")
def start():
    return consistent_start(g1(), modes={0: 1}, keep={(0, 1): 0.0}, keep_rates={(0, 1): 10.0})


@pytest.mark.long
@pytest.mark.parametrize(
    ("settings", "error"),
    [
        (ExudynSettings(1e-3), -8.6e-5),
        (ExudynSettings(1e-4), -8.5e-7),
        (ExudynSettings(1e-2, "trapezoidal"), 1.2e-2),
        (ExudynSettings(1e-3, "trapezoidal"), 1.3e-4),
    ],
)
def test_errors_of_the_spec(start, settings, error):
    run = run_exudyn(g1(), start, [0.0, 2.0], settings)
    assert run.completed
    assert run.poses[-1, 1, 2] - G1_THETA == pytest.approx(error, rel=0.02)


def test_a_solver_that_stops_is_a_failure(start, capfd):
    run = run_exudyn(g1(), start, [0.0, 1.0, 2.0], ExudynSettings(1e-3, spectral_radius=1.0))
    assert run.status == "failed" and "stopped" in run.message and np.isnan(run.poses[-1, 1]).all()
    assert "FAILED" not in capfd.readouterr().out


@pytest.mark.parametrize(
    "name",
    [
        "reversed_slider_crank",
        "yoke",
        "slot_on_crank",
        "trammel",
        "two_guides",
        "welded",
        "tip_in_a_slot",
        "doubled_pin",
    ],
)
def test_every_joint_and_load(name):
    model, start = models.yoke(True) if name == "slot_on_crank" else getattr(models, name)()
    times = np.linspace(0.0, 0.4, 5)
    expected = simulate_dynamics(model, times, start=start, form="augmented", outputs="exact")
    errors = []
    for step in (1e-3, 5e-4):
        run = run_exudyn(model, start, times, ExudynSettings(step))
        assert run.completed
        errors.append(np.abs(run.poses - expected.poses).max())
    assert errors[0] < 5e-4
    assert np.log2(errors[0] / errors[1]) == pytest.approx(2.0, abs=0.1)


@pytest.mark.parametrize("name", ["gear_pair", "wedges"])
def test_uniform_acceleration_is_exact(name):
    model, start = getattr(models, name)()
    times = np.linspace(0.0, 0.4, 3)
    run = run_exudyn(model, start, times, ExudynSettings(1e-3))
    if name == "gear_pair":  # theory/planar-dynamics 9
        expected = 0.5 * 0.7 / (0.02 + 0.3 * 0.4**2) * times**2
        assert run.poses[:, 1, 2] == pytest.approx(expected, abs=1e-12)
    else:  # the wedge falls by tan(0.4) of what the other one moves: one coordinate, constant acceleration
        slope = np.tan(0.4)
        expected = -0.5 * 9.81 * 2.0 * slope**2 / (1.0 + 2.0 * slope**2) * times**2
        assert run.poses[:, 2, 1] == pytest.approx(expected, abs=1e-12)


def test_prescribed_crank():
    """A crank that swings by a law; the other links where the position analysis puts them."""
    law = Harmonic(0.4, 0.9, 8.0)
    model = g1(prescribed=[Driver(0, 1, law)])
    start = consistent_start(model, modes={0: 1}, keep={(0, 1): 0.4})
    times = np.linspace(0.0, 0.6, 4)
    angles = law(times)[0]
    expected = np.array([consistent_start(g1(), modes={0: 1}, keep={(0, 1): q}).poses[:, 2] for q in angles])
    errors = []
    for step in (2e-3, 1e-3):
        run = run_exudyn(model, start, times, ExudynSettings(step))
        errors.append(np.abs(run.poses[..., 2] - expected).max())
    assert errors[0] < 1e-4 and np.log2(errors[0] / errors[1]) == pytest.approx(2.0, abs=0.1)


def test_refusals_are_sentences():
    with pytest.raises(GeometryError, match="moving carrier"):
        run_exudyn(*models.planet(), [0.0, 1.0])
    with pytest.raises(GeometryError, match="spectral_radius"):
        ExudynSettings(spectral_radius=1.5)
