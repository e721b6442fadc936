"""Stress cases of sizes, run as the listed ones are; none is WRONG."""

from __future__ import annotations

import pytest

from graphsynth.accuracy.stress import Case, Status, run_case

NAMES = ("refused", "linkages", "tiny_tilts", "huge_angles", "many_turns")


@pytest.mark.parametrize("name", NAMES)
def test_case(name: str) -> None:
    outcome = run_case(Case(f"beyond-{name}", name, f"sizes:{name}"))
    assert not outcome.reason
    assert not [check for check in outcome.checks if check.status is Status.WRONG]
    assert outcome.status in (Status.OK, Status.FLAGGED) and outcome.checks
