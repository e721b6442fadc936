"""Rows of error against run time: errors follow the tolerance, failures stay, the reference says what it is."""

from __future__ import annotations

import math

import pytest

from graphsynth.core.errors import SpecError
from graphsynth.dynamics.motors import DCMotor, IdealSpeed
from graphsynth.evidence.drives import drive_work_precision
from graphsynth.evidence.rows import RowStatus
from graphsynth.pipeline.display import work_table
from graphsynth.systems.platform.motor_model import MotorDrivenPlatform
from tests.dynamics.motors.linear_response import linear_response

SOURCE = MotorDrivenPlatform.source


def motor(inductance=0.2):
    return DCMotor(1.0, inductance, 0.1, 0.1, 20.0, 20.0)


def test_errors_fall_with_the_tolerance():
    study = drive_work_precision(
        SOURCE(motor()), [0.0, 0.1, 0.2], tolerances=[1e-4, 1e-8, 1e-11], solvers=["DOP853"], rounds=1
    )
    ours, theirs = study.rows[:3], study.rows[3:]
    for rows in (ours, theirs):
        assert [row.status for row in rows] == [RowStatus.OK] * 3
        assert rows[0].error > 10 * rows[1].error and all(
            row.seconds > 0.0 and row.more["steps or calls"] > 0 for row in rows
        )
    assert ours[2].error < 1e-11 and "DOP853 with tolerance 3e-14" in ours[0].reference
    assert theirs[0].reference.endswith("(the same method)") and "the same method" not in ours[0].reference


def test_error_is_that_of_the_closed_form():
    """Without a platform the answer is known: the row's error is the true one."""
    times = [0.0, 0.01, 0.05]
    drive = SOURCE(motor(), mass=0.0)
    (row,) = drive_work_precision(drive, times, tolerances=[1e-4], solvers=[], rounds=1).rows
    found = drive.simulate(times, rtol=1e-4, estimate=False)
    w, current = linear_response(motor(), 0.002, times)
    gaps = (abs(found.speed - w).max() / abs(w).max(), abs(found.currents[:, 0] - current).max() / abs(current).max())
    assert row.error == pytest.approx(max(gaps), rel=1e-4)


def test_stiff_motor_and_a_solver_that_gives_up():
    study = drive_work_precision(
        SOURCE(motor(1e-9)), [0.0, 0.05], tolerances=[1e-6], solvers=["LSODA", "DOP853"], rounds=1, most_calls=2000
    )
    assert all("too stiff" in row.reference for row in study.rows)
    assert [row.reason for row in study.rows] == ["", "", "more than 2000 calls"]
    assert [row.status.value for row in study.rows] == ["ok", "ok", "failed"]
    assert math.isnan(study.rows[2].error) and work_table(study).rows[2][2] == ""


def test_what_has_events_is_refused():
    limited = SOURCE(DCMotor(1.0, 0.2, 0.1, 0.1, 20.0, 20.0, voltage_limit=24.0))
    for drive in (limited, SOURCE(IdealSpeed(20.0))):
        with pytest.raises(SpecError, match="without events"):
            drive_work_precision(drive, [0.0, 0.1])
