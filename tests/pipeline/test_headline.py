"""The first screen answers: which is best and by what, how many were looked at, rejected and why, how sure."""

from __future__ import annotations

import json
import time
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from io import StringIO
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given, strategies as st

from graphsynth.pipeline.page import report_html
from graphsynth.pipeline.products import Finding, Objective, Quantity, Record, Table
from graphsynth.pipeline.report import print_summary
from graphsynth.pipeline.runner import execute, run
from graphsynth.pipeline.scene import Scene
from graphsynth.pipeline.stages import Report, StageTime
from graphsynth.pipeline.steps import ranking_of
from graphsynth.pipeline.summary import facts, sentences, summary_tables


def record(number: int, mass: float, stroke: float, good: bool | None = True, **more: Any) -> Record:
    margins = (Quantity("mass", mass, "kg"), Quantity("stroke", stroke, "mm", "certified", 0.0))
    verdict = {True: "holds (certified)", False: "breaks (certified)", None: "undecided"}[good]
    return Record(number, f"k{number}", f"n2={number}", verdict=verdict, good=good, margins=margins, **more)


def rejected(number: int, cause: str) -> Record:
    return Record(number, f"k{number}", status="rejected", reason=f"{cause}: {number}", cause=cause)


OBJECTIVES = (Objective("mass", "min", 2.0), Objective("stroke", "max"))


def report_of(tables: dict[str, Any], records: tuple[Record, ...], ranked: bool = True, *more: Table) -> Report:
    products: dict[str, Any] = {"records": records, "tables": more}
    if ranked:
        products["ranking"] = ranking_of(OBJECTIVES, records)
    return Report(Scene.from_mapping(tables), products, ())


def said(report: Report) -> list[str]:
    return [finding.text for finding in sentences(report)]


def test_the_best_is_named_with_its_measures_places_score_and_verdict(lambda_tables: dict[str, Any]) -> None:
    records = (record(1, 3.0, 9.0), record(2, 1.0, 5.0), record(3, 2.0, 4.0))
    best, *rest = said(report_of(lambda_tables, records))
    # scores by hand: 1 is worst by mass, best by stroke: 1/3; 2: (2 * 1 + 1 * 0.2) / 3; 3: (2 * 0.5 + 0) / 3
    assert best == (
        "Best of 3 ranked: no. 2, n2=2: mass 1 kg (smallest), stroke 5 mm (2nd largest); score 0.73 of 1 with weights "
        "2:1; holds (certified)."
    )
    assert "All 3 candidates have the verdict: holds (certified)." in rest
    sure = "mass: estimated in floating point, not proved; stroke: certified (proved bounds)."
    assert rest[-1] == f"Guarantee of the objectives: {sure}"


def test_a_best_that_jams_is_said_to_and_the_best_good_one_is_named(lambda_tables: dict[str, Any]) -> None:
    records = (record(1, 1.0, 9.0, False), record(2, 2.0, 5.0, None), record(3, 3.0, 4.0))
    report = report_of(lambda_tables, records)
    first, second = sentences(report)[:2]
    assert first.good is False and "no. 1" in first.text and "breaks" in first.text
    assert second.good is True and second.text.startswith("Best with a good verdict: no. 3")
    bad = report_of(lambda_tables, records[:2])
    assert sentences(bad)[1] == Finding("None of the ranked candidates has a good verdict.", False)


def test_reasons_are_counted_the_most_frequent_first(lambda_tables: dict[str, Any]) -> None:
    records = (
        record(1, 1.0, 1.0),
        *(rejected(n, "too long") for n in range(2, 5)),
        *(rejected(n, "too weak") for n in range(5, 11)),
        rejected(11, "ugly"),
        replace(rejected(12, "ZeroDivisionError"), status="failed"),
    )
    report = report_of(lambda_tables, records)
    told = next(text for text in said(report) if text.startswith("Rejected"))
    assert told == "Rejected: 11 of 12: 6 (too weak); 3 (too long); 1 (ZeroDivisionError); 1 (ugly)."
    numbers = {fact.text: (fact.value, fact.good) for fact in facts(report)}
    assert numbers["candidate mechanisms"] == ("12", None) and numbers["failed"] == ("1", False)
    assert (numbers["assessed"][0], numbers["rejected"][0], numbers["on the Pareto front"][0]) == ("1", "10", "1")


def test_nothing_left_is_said(lambda_tables: dict[str, Any]) -> None:
    report = report_of(lambda_tables, (rejected(1, "too long"),))
    assert sentences(report)[0] == Finding("Nothing is left to rank: no candidate has all objectives.", False)
    assert said(report_of(lambda_tables, (), False)) == []


def test_a_single_record_shows_its_margins(lambda_tables: dict[str, Any]) -> None:
    report = report_of(lambda_tables, (record(1, 0.123456, 9.0),), False)
    assert said(report) == ["Holds (certified)."]
    shown = {fact.text: fact.value for fact in facts(report)}
    assert shown["mass (estimated)"] == "0.1235 kg" and shown["stroke (certified)"] == "9 mm"


def test_what_a_stage_says_itself_comes_behind_the_best(lambda_tables: dict[str, Any]) -> None:
    table = Table("T", ("a",), (), findings=(Finding("sets looked at", value="7"), Finding("All <agree>.")))
    report = report_of(lambda_tables, (record(1, 1.0, 1.0), record(2, 2.0, 3.0)), True, table)
    assert (
        said(report)[1:3] == ["All 2 candidates have the verdict: holds (certified).", "All <agree>."]
        and facts(report)[0].value == "7"
    )
    many = tuple(record(number, 1.0, 1.0) for number in range(1, 6))
    assert said(report_of(lambda_tables, many, False, table)) == ["All <agree>."]
    page = report_html(report)
    assert page.index("Best of 2 ranked") < page.index("sets looked at") < page.index("All &lt;agree&gt;.")
    assert "All <agree>." not in page


def test_the_terminal_says_it_first_and_again_at_the_end_of_what_does_not_fit(springs: Path) -> None:
    from rich.console import Console

    report = execute(springs)

    def shown(**options: Any) -> str:
        stream = StringIO()
        print_summary(report, Console(file=stream, width=200, **options))
        return stream.getvalue()

    best = "Best of 13 ranked"
    assert shown().splitlines()[1].startswith(best) and shown().count(best) == 1
    assert shown(force_terminal=True, height=10).count(best) == 2
    assert shown(force_terminal=True, height=400).count(best) == 1


@given(st.lists(st.tuples(st.integers(0, 5), st.integers(0, 5), st.sampled_from([True, False, None])), max_size=8))
def test_the_best_is_the_first_of_the_ranking(rows: list[tuple[int, int, bool | None]]) -> None:
    records = tuple(record(i, float(mass), float(stroke), good) for i, (mass, stroke, good) in enumerate(rows, 1))
    ranking = ranking_of(OBJECTIVES, records)
    report = Report(None, {"records": records, "ranking": ranking}, ())  # type: ignore[arg-type]
    told = sentences(report)
    if not records:
        assert told == ()
        return
    best = records[ranking.numbers[0] - 1]
    assert f"no. {best.number}, " in told[0].text and told[0].good is best.good
    assert ("(smallest)" in told[0].text) is (best.margins[0].value == min(mass for mass, _, _ in rows))
    if any(r.good for r in records):
        first_good = next(n for n in ranking.numbers if records[n - 1].good)
        assert any(finding.good and f"no. {first_good}, " in finding.text for finding in told[:2])


@pytest.mark.parametrize("good", [True, False, None])
def test_tones_of_the_page(lambda_tables: dict[str, Any], good: bool | None) -> None:
    page = report_html(report_of(lambda_tables, (record(1, 1.0, 1.0, good),), False))
    assert f'<p class="verdict {({True: "good", False: "bad", None: ""})[good]}">' in page


def test_a_run_of_which_nothing_came_through_says_so_first(lambda_tables: dict[str, Any]) -> None:
    failed = Record(1, "k1", status="failed", reason="OverflowError: (34, 'Numerical result out of range')")
    (told,) = sentences(report_of(lambda_tables, (failed,), False))
    assert told == Finding("The only candidate failed: OverflowError: (34, 'Numerical result out of range').", False)
    unfit = replace(failed, status="rejected", reason="too slow: 3 s", cause="too slow")
    (told,) = sentences(report_of(lambda_tables, (unfit,), False))
    assert told == Finding("The only candidate was rejected: too slow: 3 s.", False)
    first, *rest = sentences(
        report_of(lambda_tables, (failed, rejected(2, "too slow"), rejected(3, "too slow")), False)
    )
    assert first == Finding("None of the 3 candidates came through all stages.", False)
    assert rest[0].text.startswith("Rejected: 3 of 3: 2 (too slow); 1 (OverflowError: ")


def test_a_candidate_that_came_through_or_none_known_is_no_failure(lambda_tables: dict[str, Any]) -> None:
    unknown = Record(2, "k2", status="not recognised", reason="unknown")
    assert not any("came through" in text for text in said(report_of(lambda_tables, (record(1, 1.0, 2.0), unknown))))
    assert said(report_of(lambda_tables, (unknown,), False)) == []


def test_the_margins_of_the_only_one_that_is_known_are_shown(lambda_tables: dict[str, Any]) -> None:
    unknown = tuple(Record(n, f"k{n}", status="not recognised", reason="unknown") for n in (1, 3))
    told = {
        fact.text: fact.value for fact in facts(report_of(lambda_tables, (unknown[0], record(2, 1.5, 2.0), unknown[1])))
    }
    assert told["mass (estimated)"] == "1.5 kg" and told["candidate mechanisms"] == "3"
    alone = {fact.text for fact in facts(report_of(lambda_tables, (record(1, 1.5, 2.0),), False))}
    assert "mass (estimated)" in alone and not any("candidate" in text or text == "assessed" for text in alone)
    stopped = {fact.text for fact in facts(report_of(lambda_tables, (record(1, 1.5, 2.0), rejected(2, "slow")), False))}
    assert "mass (estimated)" not in stopped and "candidate mechanisms" in stopped


def test_the_time_of_a_run_is_that_of_the_clock(lambda_tables: dict[str, Any]) -> None:
    """Stages of candidates that two processes shared took longer together than the run."""
    report = replace(
        report_of(lambda_tables, (record(1, 1.0, 1.0),)), times=(StageTime("move", 0.0, 545.0),), seconds=282.0
    )
    assert [fact.value for fact in facts(report) if fact.text == "run time"] == ["282.0 s"]
    assert "The run took 282.0 s." in summary_tables(report)[-1].note


def test_a_run_measures_its_time(springs: Path, tmp_path: Path) -> None:
    springs.write_text(springs.read_text("utf-8").replace("count = 20\n", "count = 20\npause_s = 0.02\n"), "utf-8")
    start = time.perf_counter()
    with ThreadPoolExecutor(4) as executor:
        report = run(springs, out=tmp_path, executor=executor)
    slept = sum(stage.seconds for stage in report.times if stage.stage == "bend")
    assert slept > 0.25 and report.seconds <= time.perf_counter() - start
    assert json.loads((tmp_path / "scene.json").read_text("utf-8"))["seconds"] == round(report.seconds, 6)
