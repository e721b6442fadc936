"""The frame of the stress cases: what counts as wrong, what a report shows, the command."""

from __future__ import annotations

import csv
import json
import math
import os
import re
import signal
import subprocess
import sys
import time
from concurrent.futures import ThreadPoolExecutor
from fractions import Fraction
from html.parser import HTMLParser
from pathlib import Path

import mpmath
import numpy as np
import pytest

from graphsynth.cli import main
from graphsynth.core.errors import GraphsynthError, MissingExtraError, SpecError
from graphsynth.evidence.stress import (
    Case,
    CaseStatus,
    Checks,
    cases as cases_module,
    run_case,
    run_stress,
    running as running_module,
    stress_cases,
)
from graphsynth.evidence.stress.cases import PAGES
from graphsynth.evidence.stress.checks import exact
from graphsynth.evidence.stress.page import stress_html, write_report
from graphsynth.evidence.stress.running import CaseOutcome, StressReport

CASES = stress_cases()
DOCS = Path(__file__).parents[3] / "docs"


def status_of(*calls) -> list[CaseStatus]:
    checks = Checks("somewhere")
    for name, args, options in calls:
        getattr(checks, name)("it", *args, **options)
    return [row.status for row in checks.rows]


@pytest.mark.parametrize(
    ("given", "right", "options", "status"),
    [
        (0.1, "0.1", {}, CaseStatus.WRONG),  # the double is not the decimal
        (0.1, "0.1", {"absolute": 1e-17}, CaseStatus.OK),
        (0.1, 0.1, {}, CaseStatus.OK),
        (1.0 + 2.0**-52, 1, {"relative": 2.2e-16}, CaseStatus.WRONG),
        (1.0 + 2.0**-52, 1, {"relative": 2.3e-16}, CaseStatus.OK),
        (math.nan, 1, {"relative": 1.0}, CaseStatus.WRONG),
        (math.inf, 1, {"absolute": 1e300}, CaseStatus.WRONG),
        (-2.0, 2, {"relative": 1.0}, CaseStatus.WRONG),
        (1e308, "-1e308", {"absolute": 1e308}, CaseStatus.WRONG),
        (mpmath.mpf(1) / 4, Fraction(1, 4), {}, CaseStatus.OK),
        (mpmath.mpf("nan"), 0, {"absolute": 1}, CaseStatus.WRONG),
        (np.int64(2**53 + 1), 2**53 + 1, {}, CaseStatus.OK),  # a double does not hold it
        (np.int64(2**53 + 1), 2**53, {}, CaseStatus.WRONG),
        (np.array(0.5), "0.5", {}, CaseStatus.OK),
        (np.float32(0.1), 0.1, {"relative": 1e-9}, CaseStatus.WRONG),
    ],
)
def test_numbers(given, right, options, status):
    assert status_of(("value", (given, right), options)) == [status]


def test_what_is_right_must_be_a_number():
    with pytest.raises(ValueError, match="not finite"):
        Checks("").value("it", 1.0, math.nan)


def test_exact_numbers_of_mpmath():
    with mpmath.workdps(60):
        for text in ("-0.375", "1e30", "0", "-3e-20"):
            value = mpmath.mpf(text)
            assert abs(exact(value) - Fraction(text)) <= abs(Fraction(text)) * Fraction(1, 10**55)
    assert exact(mpmath.inf) is None and exact(-mpmath.inf) is None and exact(mpmath.nan) is None


def test_lists_of_different_length_are_wrong():
    assert status_of(("values", ([1, 2], [1, 2, 3]), {})) == [CaseStatus.OK, CaseStatus.OK, CaseStatus.WRONG]
    assert status_of(("values", ([1, 2], [1]), {})) == [CaseStatus.OK, CaseStatus.WRONG]


def test_reports_and_statements():
    assert status_of(("reports", (1, 1), {}), ("reports", (1, 2), {})) == [CaseStatus.FLAGGED, CaseStatus.WRONG]
    assert status_of(("equals", (5, 5), {}), ("equals", (5, 6), {})) == [CaseStatus.OK, CaseStatus.WRONG]
    assert status_of(("holds", (True,), {}), ("holds", (0,), {})) == [CaseStatus.OK, CaseStatus.WRONG]
    assert status_of(("mentions", ("leg 2 is short", "leg 2"), {})) == [CaseStatus.FLAGGED]
    assert status_of(("mentions", ("leg 2 is short", "leg 3"), {})) == [CaseStatus.WRONG]
    assert status_of(("mentions", ("", ""), {})) == [CaseStatus.WRONG]
    assert status_of(("below", (1e-3, 1e-2), {}), ("below", (math.nan, 1.0), {})) == [CaseStatus.OK, CaseStatus.WRONG]


def raises(error):
    def call():
        raise error

    return call


def test_refusals():
    assert status_of(("refused", (raises(SpecError("n = 3 is odd")), "n = 3"), {})) == [CaseStatus.FLAGGED]
    assert status_of(("refused", (raises(SpecError("n = 3 is odd")), "m"), {})) == [CaseStatus.WRONG]
    assert status_of(("refused", (raises(SpecError("n\nm")), "n"), {})) == [CaseStatus.WRONG]
    assert status_of(("refused", (lambda: 5, "n"), {})) == [CaseStatus.WRONG]
    with pytest.raises(ZeroDivisionError):
        status_of(("refused", (lambda: 1 / 0, "n"), {}))


def outcome_of(monkeypatch, function) -> CaseOutcome:
    monkeypatch.setattr(Case, "load", lambda self: function)
    return run_case(CASES[0])


def test_a_case_that_breaks_is_wrong(monkeypatch):
    def breaks(check):
        check.value("one", 1, 1)
        raise ZeroDivisionError("by zero")

    found = outcome_of(monkeypatch, breaks)
    assert found.status is CaseStatus.WRONG and found.reason == "ZeroDivisionError: by zero" and len(found.checks) == 1
    assert (
        outcome_of(monkeypatch, lambda check: None).status is CaseStatus.WRONG
    )  # a case without checks proves nothing
    refused = outcome_of(monkeypatch, lambda check: raises(GraphsynthError("no"))())
    assert refused.status is CaseStatus.WRONG


def test_a_missing_extra_is_no_result(monkeypatch):
    found = outcome_of(monkeypatch, lambda check: raises(MissingExtraError("pip install 'graphsynth[stiff]'"))())
    assert found.status is CaseStatus.NOT_RUN


def test_a_missing_extra_after_a_check(monkeypatch):
    for right, status in ((1, CaseStatus.NOT_RUN), (2, CaseStatus.WRONG)):

        def late(check, right=right):
            check.value("one", 1, right)
            raise MissingExtraError("pip install 'graphsynth[stiff]'")

        assert outcome_of(monkeypatch, late).status is status


def wrong_report() -> StressReport:
    checks = Checks("section 1")
    checks.value("x <of> A", 1.0, 2, relative=0.1)
    checks.reports("verdict", "FREE", "FREE")
    good = Checks("section 1")
    good.value("y", 1.0, 1)
    outcomes = (CaseOutcome(CASES[0], tuple(checks.rows), 0.5), CaseOutcome(CASES[1], tuple(good.rows), 0.25))
    return StressReport(outcomes, (CASES[-1],), 0.75)


def test_report():
    report = wrong_report()
    assert [o.status for o in report.outcomes] == [CaseStatus.WRONG, CaseStatus.OK]
    assert report.statement == "2 stress cases with 3 checks: 1 ok, 0 flagged, 1 WRONG, 1 slow ones left out."
    assert report.outcomes[0].worst.what == "x <of> A" and report.wrong == (report.outcomes[0],)
    table = report.to_pandas()
    assert len(table) == 3 and list(table["status"]) == ["WRONG", "flagged", "ok"]
    assert json.loads(json.dumps(report.summary(), allow_nan=False))["counts"]["WRONG"] == 1


class Tags(HTMLParser):
    """Collect text and check that tags are closed."""

    def __init__(self):
        super().__init__()
        self.open, self.text = [], []

    def handle_starttag(self, tag, attrs):
        if tag not in ("meta", "br"):
            self.open.append(tag)
        assert not any(name in ("src", "href") and not value.startswith("#") for name, value in attrs)

    def handle_endtag(self, tag):
        assert self.open.pop() == tag

    def handle_data(self, data):
        self.text.append(data)


def test_page_and_table(tmp_path):
    html, table = write_report(wrong_report(), tmp_path / "new" / "folder")
    parser = Tags()
    parser.feed(html.read_text(encoding="utf-8"))
    text = " ".join(parser.text)
    assert not parser.open and "x <of> A" in text and "WRONG" in text and CASES[-1].name in text
    assert "<details open" in html.read_text(encoding="utf-8")  # the wrong case is shown at once
    with table.open(encoding="utf-8", newline="") as lines:
        rows = list(csv.DictReader(lines))
    assert [row["case_status"] for row in rows] == ["WRONG", "WRONG", "ok"]
    assert float(rows[0]["error"]) == 1.0 and float(rows[0]["bound"]) == pytest.approx(0.2)


def test_a_broken_case_is_on_the_page_and_in_the_table():
    broken = StressReport((CaseOutcome(CASES[0], (), 0.1, "KeyError: 'x'"),), (), 0.1)
    assert "KeyError" in stress_html(broken)
    assert broken.to_pandas()["given"].tolist() == ["KeyError: 'x'"]


def test_selection():
    assert [c.name for c in stress_cases(["lambda-12.1"])] == ["lambda-12.1"]  # not 12.10 to 12.19
    assert len(stress_cases(["platform-12"])) == 31 and len(stress_cases(["instruments-9"])) == 24
    assert len(stress_cases(["lambda-12"])) == 30
    assert not any(c.slow for c in stress_cases(slow=False))
    slow = next(c for c in CASES if c.slow)
    assert stress_cases([slow.name], slow=False) == (slow,)
    with pytest.raises(SpecError, match="did you mean platform"):
        stress_cases(["platfrom"])
    with pytest.raises(SpecError, match="no stress case is called ''"):
        stress_cases([""])


def test_names_are_unique_and_every_case_is_documented():
    names = [case.name for case in CASES]
    assert len(set(names)) == len(names)
    assert {case.page for case in CASES} == set(PAGES)
    page = (DOCS / "explanation" / "stress.md").read_text(encoding="utf-8")
    rows = re.findall(r"^\| `([a-z]+-[\d.]+)` \| (.*) \| (.*) \| \w+(, slow)? \|$", page, re.MULTILINE)
    assert [row[:3] for row in rows] == [(case.name, case.title, case.about) for case in CASES]
    assert [bool(row[3]) for row in rows] == [case.slow for case in CASES]


def test_every_row_of_the_specification_has_a_case():
    """Rows of the sections of extreme cases: 30 of the linkage, 31 of the platform, 24 of the instruments."""
    names = {case.name for case in CASES}
    for page, section, rows in (("lambda", 12, 30), ("platform", 12, 31), ("instruments", 9, 24)):
        assert {f"{page}-{section}.{k}" for k in range(1, rows + 1)} <= names


def test_listing_imports_nothing():
    code = (
        "import sys, graphsynth.evidence.stress as s; s.stress_cases(); "
        "print([m for m in ('numpy','pandas','scipy','numba','mpmath') if m in sys.modules])"
    )
    found = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert found.stdout.strip() == "[]"


def test_command(capsys, tmp_path):
    assert main(["stress", "structure-2", "--out", str(tmp_path)]) == 0
    out = capsys.readouterr().out
    assert "0 WRONG" in out and str(tmp_path / "stress.html") in out
    assert (tmp_path / "stress.csv").exists()
    assert main(["stress", "structure-2.1", "--json"]) == 0
    document = json.loads(capsys.readouterr().out)
    assert document["cases"][0]["name"] == "structure-2.1" and document["counts"]["WRONG"] == 0
    assert main(["stress", "--list", "structure-5", "--fast"]) == 0
    assert capsys.readouterr().out.startswith("structure-5.1 ")
    assert main(["stress", "no-such-case"]) == 2
    captured = capsys.readouterr()
    assert captured.err.count("\n") == 1 and not captured.out


def test_a_folder_that_cannot_be_written_is_refused_before_the_run(capsys, tmp_path, monkeypatch):
    (tmp_path / "file").touch()
    monkeypatch.setattr(Case, "load", lambda self: pytest.fail("a case was run"))
    assert main(["stress", "structure-2.1", "--out", str(tmp_path / "file" / "under")]) == 2
    assert capsys.readouterr().err.count("\n") == 1


def interrupting(case):
    """Case function: the first one is right; in the second Ctrl-C comes, and a compiler makes something else of it."""

    def second(check):
        check.value("half", 1, 1)
        try:
            os.kill(os.getpid(), signal.SIGINT)
            time.sleep(5)
        except KeyboardInterrupt as error:
            raise RuntimeError("compilation failed") from error

    return (lambda check: check.value("whole", 1, 1)) if case.name == "structure-2.1" else second


def test_interrupted_runs_keep_what_was_run(capsys, tmp_path, monkeypatch):
    monkeypatch.setattr(Case, "load", interrupting)
    assert main(["stress", "structure-2", "--out", str(tmp_path)]) == 130
    captured = capsys.readouterr()
    assert "1 stress case with 1 checks: 1 ok, 0 flagged, 0 WRONG, interrupted before 2 more." in captured.out
    assert captured.err == "graphsynth: interrupted\n"
    with (tmp_path / "stress.csv").open(encoding="utf-8", newline="") as lines:
        assert [row["case"] for row in csv.DictReader(lines)] == ["structure-2.1"]
    assert "not reached: structure-2.2, structure-2.3" in (tmp_path / "stress.html").read_text(encoding="utf-8")


def test_interrupts_are_handed_back(monkeypatch):
    monkeypatch.setattr(running_module, "run_case", lambda case: CaseOutcome(case, (), 0.0))
    before = signal.getsignal(signal.SIGINT)
    assert not run_stress(["structure-2"]).not_reached
    assert signal.getsignal(signal.SIGINT) is before
    with ThreadPoolExecutor(1) as pool:  # another thread cannot have handlers
        assert len(pool.submit(run_stress, ["structure-2"]).result().outcomes) == 3


def test_table_fits_a_narrow_terminal(monkeypatch, capsys):
    monkeypatch.setattr(Case, "load", lambda self: lambda check: check.value("x", 1.0, 1))
    monkeypatch.setattr(sys.stdout, "isatty", lambda: True, raising=False)
    monkeypatch.setenv("COLUMNS", "80")
    assert main(["stress"]) == 0
    lines = re.sub(r"\x1b\[[\d;]*m", "", capsys.readouterr().out).splitlines()
    assert len(lines) == len(CASES) + 3  # one line for each, the heading, the rule, the statement
    assert max(map(len, lines[:-1])) <= 80
    assert all(line.startswith(case.name) for line, case in zip(lines[2:], CASES))


def test_command_tells_what_is_wrong(capsys, monkeypatch):
    monkeypatch.setattr(Case, "load", lambda self: lambda check: check.value("x", 1.0, 2))
    assert main(["stress", "structure-2.1"]) == 1
    assert "structure-2.1: x: right is 2, given is 1" in capsys.readouterr().out


def test_progress_is_told_before_each_case(monkeypatch):
    seen = []
    monkeypatch.setattr(running_module, "run_case", lambda case: CaseOutcome(case, (), 0.0))
    run_stress(["structure-2"], progress=lambda case, number, total: seen.append((case.name, number, total)))
    assert seen == [(f"structure-2.{k + 1}", k, 3) for k in range(3)]


OWN = """
about = "Own cases"
use = ["graphsynth.jamming: Bearing"]
let.bearings = "[Bearing(clearance=c) for c in (0.0, 0.03)]"

[[case]]
id = "mine-1.10"
title = "twice"
[[case.step]]
for = ["k in (0, 1)", "(a, b), c in (((1, 2), 3),)"]
when = "k == 1"
let."low, high" = "(a, c)"
equals = "{k}: {low:+d} to {high}"
given = "(low, high, b)"
is = [1, 3, 2]

[[case]]
id = "mine-1.2"
title = "no clearance"
[[case.step]]
let.seen = "[]"
[[case.step]]
for = "bearing in bearings"
collect.seen = "bearing.critical_tilt('A').angle"
[[case.step]]
value = "critical tilt"
given = "seen[0]"
is = "0"
[[case.step]]
digits = 50
let.third = "mp.mpf(1) / 3"
value = "a third"
given = "third"
is = "0.33333333333333333333333333333333333333333333333333"
absolute = 1e-49
[[case.step]]
refused = "a negative radius"
call = "Bearing(-1.0)"
words = ["Rb"]
"""


def test_own_cases(capsys, tmp_path):
    mine = tmp_path / "mine.toml"
    mine.write_text(OWN, encoding="utf-8")
    assert main(["stress", "--cases", str(mine), "--json"]) == 0
    first, second = json.loads(capsys.readouterr().out)["cases"]
    assert (first["name"], second["name"]) == ("mine-1.2", "mine-1.10")
    assert [check["status"] for check in first["checks"]] == ["ok", "ok", "flagged"]
    assert [check["what"] for check in second["checks"]] == ["1: +1 to 3"]
    assert main(["stress", "--cases", str(mine), "mine-1.2", "--list"]) == 0
    assert capsys.readouterr().out.startswith("mine-1.2 ")
    mine.write_text(OWN.replace("is = [1, 3, 2]", "is = [1, 3, 4]"), encoding="utf-8")
    assert main(["stress", "--cases", str(mine)]) == 1
    assert "mine-1.10: 1: +1 to 3: right is (1, 3, 4), given is (1, 3, 2)" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ('title = "twice"', "", "mine-1.10: title missing"),
        ('id = "mine-1.2"', 'id = "mine"', "such as mine-1.2"),
        ('id = "mine-1.2"', 'id = "mine-1.10"', "two stress cases are called mine-1.10"),
        ("absolute = 1e-49", "absolut = 1e-49", "case mine-1.2: unknown key 'absolut'; did you mean absolute"),
        ('value = "critical tilt"', 'value = "x"\nbelow = "y"', "one comparison, not value and below"),
        ('words = ["Rb"]', "words = [", "cannot read stress cases from"),
    ],
)
def test_files_that_are_written_wrongly(tmp_path, old, new, words):
    assert old in OWN
    (tmp_path / "mine.toml").write_text(OWN.replace(old, new), encoding="utf-8")
    with pytest.raises(SpecError, match=re.escape(words)):
        stress_cases(files=[tmp_path / "mine.toml"])


def test_a_name_that_does_not_exist_makes_a_case_wrong(tmp_path):
    (tmp_path / "mine.toml").write_text(OWN.replace("Bearing(-1.0)", "bering(-1.0)"), encoding="utf-8")
    (case, _) = stress_cases(files=[tmp_path / "mine.toml"])
    outcome = run_case(case)
    assert outcome.status is CaseStatus.WRONG and "NameError" in outcome.reason and len(outcome.checks) == 2


def test_the_cases_of_a_wheel_are_found(tmp_path, monkeypatch):
    """A wheel has the files inside of the package, where they come first."""
    module = tmp_path / "evidence" / "stress" / "cases.py"
    (tmp_path / "evidence" / "shipped_stress").mkdir(parents=True)
    (tmp_path / "evidence" / "shipped_stress" / "mine.toml").write_text(OWN, encoding="utf-8")
    monkeypatch.setattr(cases_module, "__file__", str(module))
    assert [case.name for case in cases_module._shipped.__wrapped__()] == ["mine-1.2", "mine-1.10"]


@pytest.mark.parametrize("case", CASES, ids=lambda case: case.name)
def test_what_a_case_uses_exists(case):
    case.load()
