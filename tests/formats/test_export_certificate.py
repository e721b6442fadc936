"""The certificate: its numbers, its verdicts, what it says without an engine."""

import json
import math

import numpy as np
import pytest
from dynamic_models import g1, g2, g3, seven_body, seven_pose

from graphsynth.core.errors import GeometryError
from graphsynth.dynamics import consistent_start, simulate_dynamics
from graphsynth.formats import ExudynSettings, MujocoSettings, certify_export, export_certificate
from graphsynth.formats.export_certificate import mechanical_energy

STEPS = (1e-2, 1e-3, 4e-4, 1e-4)


@pytest.fixture(scope="module")
def start():
    return consistent_start(g1(), modes={0: 1}, keep={(0, 1): 0.0}, keep_rates={(0, 1): 10.0})


@pytest.fixture(scope="module")
def certificate(start):
    pytest.importorskip("mujoco")
    return certify_export(g1(), start, np.linspace(0.0, 2.0, 5), [MujocoSettings(h) for h in STEPS], 1e-4)


@pytest.mark.long
def test_record_is_complete(certificate):
    record = json.loads(certificate.to_json())
    assert record["verdict"] == "yes" and record["engine"] == "MuJoCo" and record["cuts"] == [[2, 3]]
    assert record["closure"] < 1e-15 and record["velocity_residual"] < 1e-13 and record["engine_version"]
    assert record["reference_error"] < 1e-9 and record["key"] == str(g1().mechanism.graph.key)
    assert [trial["step"] for trial in record["trials"]] == list(STEPS)
    assert record["trials"][0]["order"] is None
    assert record["limit"] <= 1e-4 and certificate.table().count("\n") == 5


def test_numbers_are_those_of_the_spec(certificate):
    """G1, solref -1e6 -2e3, step 1e-3: crank 8.9e-5 at the end; the norm also holds the other links and times."""
    trial = certificate.trials[1]
    assert 8.9e-5 < trial.error < 2e-4 and trial.gap == pytest.approx(1e-6, rel=0.5)
    assert certificate.trials[3].order == pytest.approx(2.0, abs=0.1)


def test_floor_and_failure(start):
    pytest.importorskip("mujoco")
    settings = [MujocoSettings(h, solref=(0.002, 1.0)) for h in (1e-3, 2.5e-4, 1.25e-4)]
    result = certify_export(g1(), start, [0.0, 1.0], settings, 1e-9)
    assert result.trials[-1].floor and "floor" in result.table() and result.verdict == "no"
    stiff = [MujocoSettings(h, solref=(-1e10, -2e5)) for h in (2e-3, 1e-3, 5e-4)]
    result = certify_export(g1(), start, [0.0, 1.0], stiff)
    assert result.verdict == "no" and math.isnan(result.limit) and "**failed**" in result.table()
    assert json.loads(result.to_json())["limit"] is None


def test_a_reference_too_weak_to_judge_says_no(start):
    pytest.importorskip("mujoco")
    result = certify_export(g1(), start, [0.0, 1.0], [MujocoSettings(h) for h in STEPS], 1e-15)
    assert result.verdict == "no" and "reference" in result.statement


@pytest.mark.parametrize("make", [MujocoSettings, ExudynSettings])
def test_without_the_engine_nothing_is_filled_in(start, make, monkeypatch):
    def missing(engine):
        raise export_certificate.metadata.PackageNotFoundError(engine)

    monkeypatch.setattr(export_certificate.metadata, "version", missing)
    result = certify_export(g1(), start, [0.0, 1.0], [make(h) for h in STEPS])
    assert result.verdict == "not run" and all(t.status == "not run" for t in result.trials)
    assert all(math.isnan(t.error) and math.isnan(t.gap) for t in result.trials)


def test_energy_is_the_internal_one():
    """Written independently of the dynamics; springs, gravity, rotor-free."""
    model = g2()
    motion = simulate_dynamics(model, np.linspace(0.0, 1.0, 5), modes={0: 1}, keep={(0, 1): 0.0})
    kinetic, total = mechanical_energy(model, motion.poses, motion.velocities)
    assert kinetic == pytest.approx(motion.kinetic, rel=1e-9, abs=1e-12)
    assert total == pytest.approx(motion.energy, rel=1e-10)
    assert total[0] == pytest.approx(1.96409966368430366891, rel=1e-13)  # theory/planar-dynamics 9


def test_bad_settings(start):
    with pytest.raises(GeometryError, match="three different steps"):
        certify_export(g1(), start, [0.0, 1.0], [MujocoSettings(1e-3), MujocoSettings(1e-4)])
    with pytest.raises(GeometryError, match="one certificate for each"):
        certify_export(g1(), start, [0.0, 1.0], [MujocoSettings(1e-3), ExudynSettings(1e-4)])
    with pytest.raises(GeometryError, match="tolerance"):
        certify_export(g1(), start, [0.0, 1.0], [MujocoSettings(h) for h in STEPS], 0.0)


@pytest.mark.slow
@pytest.mark.parametrize("make", [MujocoSettings, ExudynSettings])
@pytest.mark.parametrize("name", ["G1", "G3", "seven"])
def test_reference_mechanisms_reach_their_tolerance(name, make, start):
    pytest.importorskip("mujoco" if make is MujocoSettings else "exudyn")
    if name == "G1":
        model, begin, end, steps = g1(), start, 2.0, (1e-3, 1e-4, 1e-5)
    elif name == "G3":
        model, end, steps = g3(), 1.0, (1e-3, 1e-4, 1e-5)
        begin = consistent_start(model, modes={0: 1}, keep={(0, 1): 0.5}, keep_rates={(0, 1): 15.0})
    else:
        model, end, steps = seven_body(), 0.03, (1e-4, 1e-5, 1e-6)
        begin = consistent_start(model, pose=seven_pose())
    result = certify_export(model, begin, np.linspace(0.0, end, 11), [make(h) for h in steps], 1e-6)
    assert result.verdict == "yes", result.table()
    assert result.trials[-1].order == pytest.approx(2.0, abs=0.15)
    assert result.trials[-1].gap < 1e-9
