"""Commands that are killed, ended, started twice, and whose journals are torn, give the right answer in the end.

``GRAPHSYNTH_KILLS=1000 pytest -m slow tests/kills`` does so many disturbances (200 without it), with another seed each
time ``GRAPHSYNTH_KILLS_SEED`` is another number.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="looks for processes in /proc")


def campaign(*options: str) -> dict[str, object]:
    command = [sys.executable, str(Path(__file__).with_name("campaign.py")), *options]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.stdout, done.stderr
    report: dict[str, object] = json.loads(done.stdout)
    assert report["faults"] == [] and done.returncode == 0, report["faults"]
    return report


@pytest.mark.long
@pytest.mark.parametrize("quick", ["count", "run"])
def test_a_few_kills(quick: str) -> None:
    report = campaign("--kills", "2", "--seed", "8", "--only", quick)
    assert report["disturbances"] >= 2 and set(report["rounds"]) == {quick}


@pytest.mark.slow
def test_many_kills() -> None:
    kills, seed = os.environ.get("GRAPHSYNTH_KILLS", "200"), os.environ.get("GRAPHSYNTH_KILLS_SEED", "0")
    report = campaign("--kills", kills, "--seed", seed)
    assert set(report["rounds"]) == {"count", "enumerate", "run", "build", "evaluate"}
