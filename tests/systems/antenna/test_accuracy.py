"""Rows of error against run time."""

from __future__ import annotations

import pytest

from graphsynth.core.errors import GeometryError
from graphsynth.systems.antenna import PointingMechanism
from graphsynth.systems.antenna.evidence import pointing_errors


def test_rows_are_ordered_by_what_they_promise():
    rows = pointing_errors(PointingMechanism(order="XY"), 0.4, poses=3, rounds=1)
    errors = {(row.method, row.setting): row.error for row in rows}
    assert all(row.seconds > 0.0 for row in rows)
    assert max(row.error for row in rows if row.method == "closed form") < 1e-15
    assert errors["twelve equations, own Newton", "3 poses at once"] < 3e-15
    scipy = [row.error for row in rows if "scipy" in row.method]
    assert scipy[-1] < 1e-12 and scipy[0] < 1e-2


def test_refusals():
    with pytest.raises(GeometryError, match="at least two poses"):
        pointing_errors(PointingMechanism(), poses=1)
    with pytest.raises(GeometryError, match="cannot be assembled"):
        pointing_errors(PointingMechanism(l3=0.1, l5=0.1), 1.3, poses=3, rounds=1)
