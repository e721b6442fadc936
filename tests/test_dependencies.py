"""What pyproject.toml asks for, and the lowest versions that are tested, say the same."""

import re
import tomllib
from pathlib import Path

ROOT = Path(__file__).parents[1]


def test_the_lowest_versions_are_those_declared():
    project = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]
    declared = dict(line.split(">=") for line in (*project["dependencies"], *project["optional-dependencies"]["test"]))
    lines = (ROOT / "tests" / "lowest-versions.txt").read_text("utf-8").splitlines()
    tested = dict(line.split("==") for line in lines if not line.startswith("#"))
    assert {name: re.sub(r"(\.0)+$", "", version) for name, version in tested.items()} == {
        name: re.sub(r"(\.0)+$", "", version) for name, version in declared.items()
    }
