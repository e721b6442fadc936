"""Every stress case: none is WRONG.  Slow ones run with -m slow."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from graphsynth.evidence.stress import CaseStatus, run_case, stress_cases

PAGE = Path(__file__).parents[3] / "docs" / "explanation" / "stress.md"
ROW = re.compile(r"^\| `([a-z]+-[\d.]+)` .* \| (\w+)(?:, slow)? \|$", re.MULTILINE)
SAID = dict(ROW.findall(PAGE.read_text(encoding="utf-8")))
LONG = {"lambda-12.28", "lambda-12.29"}  # seconds


def marks_of(case):
    """How long a case takes."""
    return pytest.mark.slow if case.slow else pytest.mark.long if case.name in LONG else ()


CASES = [pytest.param(c, id=c.name, marks=marks_of(c)) for c in stress_cases()]


@pytest.mark.parametrize("case", CASES)
def test_case(case):
    outcome = run_case(case)
    if outcome.status is CaseStatus.NOT_RUN:
        pytest.skip(outcome.reason)
    wrong = [c for c in outcome.checks if c.status is CaseStatus.WRONG]
    assert not outcome.reason
    assert not wrong
    assert outcome.status in (CaseStatus.OK, CaseStatus.FLAGGED) and outcome.checks
    assert SAID[case.name] == outcome.status.value  # the page tells what runs gave
