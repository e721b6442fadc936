"""Rows of error against run time."""

import math

import pytest
from dynamic_models import g1

from graphsynth.core.errors import GeometryError
from graphsynth.dynamics import consistent_start
from graphsynth.evidence import RowStatus, dynamics_work_precision


def test_rows_of_the_crank_rocker():
    model = g1()
    start = consistent_start(model, keep={(0, 1): 0.0}, keep_rates={(0, 1): 10.0}, modes={0: 1})
    rows = dynamics_work_precision(model, start, [0.0, 0.25, 0.5], methods=["DOP853", "BDF"], tolerances=[1e-5, 1e-8],
                                   rounds=1, max_steps=150)  # fmt: skip
    assert len(rows) == 3 * 2 * 2 and all(row.seconds > 0.0 for row in rows)
    explicit = [row for row in rows if row.method.endswith("DOP853")]
    for rough, fine in zip(explicit[::2], explicit[1::2]):
        assert fine.error < 1e-6 and fine.error < 0.1 * rough.error
    failed = [row for row in rows if math.isnan(row.error)]
    assert failed and all("more than 150 steps" in row.reason for row in failed)


def test_bad_requests():
    model = g1()
    start = consistent_start(model, keep={(0, 1): 0.0}, modes={0: 1})
    with pytest.raises(GeometryError, match=r"tolerances = .* must be 1e-12 or more"):
        dynamics_work_precision(model, start, [0.0, 0.1], tolerances=[1e-13])
    with pytest.raises(GeometryError, match="rounds = 0"):
        dynamics_work_precision(model, start, [0.0, 0.1], rounds=0)


def test_what_misses_its_tolerance_is_unreliable(monkeypatch):
    monkeypatch.setattr("graphsynth.evidence.dynamics._MISSED", 1e-6)
    model = g1()
    start = consistent_start(model, keep={(0, 1): 0.0}, keep_rates={(0, 1): 10.0}, modes={0: 1})
    (row,) = dynamics_work_precision(
        model, start, [0.0, 0.1], forms=["augmented"], methods=["DOP853"], tolerances=[1e-5], rounds=1
    )
    assert row.status is RowStatus.UNRELIABLE and row.error > 0.0 and "times the tolerance" in row.reason
