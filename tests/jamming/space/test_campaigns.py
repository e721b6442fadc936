"""A part of every campaign; `GRAPHSYNTH_CAMPAIGN` tells how many questions, `GRAPHSYNTH_CAMPAIGN_RESULTS` in which
folder their answers stand, so that a long campaign goes on where it stopped."""

import os
from pathlib import Path

import pytest
from campaign import campaign, told

COUNT = int(os.environ.get("GRAPHSYNTH_CAMPAIGN", "20"))


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["mechanisms", "bearings", "rails"])
def test_no_certificate_is_wrong(kind, tmp_path):
    folder = Path(os.environ.get("GRAPHSYNTH_CAMPAIGN_RESULTS", tmp_path))
    rows = campaign(kind, COUNT, folder / f"{kind}.jsonl")
    assert len(rows) >= COUNT and not any(row["wrong"] for row in rows), told(kind, rows)
    if kind == "mechanisms":
        assert sum(row["state"] == 0 for row in rows) <= max(1, 0.02 * len(rows)), told(kind, rows)
    elif kind == "rails":
        verdicts = {name for row in rows for name in row["verdicts"]}
        assert {"CERTIFIED_FREE", "CERTIFIED_JAMMED"} <= verdicts, told(kind, rows)
    else:
        states = [state for row in rows for state in row["states"]]
        assert states.count(1) > 0.1 * len(states) and states.count(-1) > 0.1 * len(states), told(kind, rows)
