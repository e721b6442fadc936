"""Candidates one by one: cheap rejections first, each outcome on record, ranked, the same for any executor."""

from __future__ import annotations

import itertools
import json
import math
from concurrent.futures import ProcessPoolExecutor, ThreadPoolExecutor
from dataclasses import replace
from multiprocessing import get_context
from pathlib import Path

import pytest
from hypothesis import given, strategies as st

from graphsynth.core.errors import SceneError
from graphsynth.pipeline.products import Objective, Outcome, Quantity, Record
from graphsynth.pipeline.runner import execute, run
from graphsynth.pipeline.scene import BudgetTable, OutputsTable, Scene, load_scene
from graphsynth.pipeline.stages import resolve
from graphsynth.pipeline.steps import ranking_of
from graphsynth.pipeline.store import decode, encode
from graphsynth.pipeline.streaming import plan_stream
from graphsynth.pipeline.system import Stage


def with_mechanism(scene: Scene, **changes: object) -> Scene:
    return replace(scene, mechanism=replace(scene.mechanism, **changes))


def test_every_candidate_ends_as_one_record_with_its_reason(springs: Path) -> None:
    report = execute(springs)
    records = report["records"]
    assert [r.number for r in records] == list(range(1, 21)) and records[0].key == "spring-1"
    status = {r.number: r.status for r in records}
    assert [n for n, s in status.items() if s == "rejected"] == [3, 6, 9, 12, 15, 18]
    assert [n for n, s in status.items() if s == "failed"] == [7]
    assert records[2].reason == "a multiple of three: 3" and records[2].cause == "check: a multiple of three"
    assert records[6].reason == "ZeroDivisionError: seven"
    assert {r.margins[0].value for r in records if r.status == "assessed"} == {
        2.0 * n for n, s in status.items() if s == "assessed"
    }


def test_cheap_rejections_come_first_and_later_stages_see_the_rest_only(springs: Path, tmp_path: Path) -> None:
    log = tmp_path / "log"
    report = execute(with_mechanism(load_scene(springs), log=str(log)))
    lines = log.read_text().split("\n")[:-1]
    assert sum(line.startswith("check") for line in lines) == 20
    assert [int(line.split()[1]) for line in lines if line.startswith("bend")] == [n for n in range(1, 21) if n % 3]
    runs = {t.stage: t.runs for t in report.times}
    assert (runs["check"], runs["bend"], runs["judge"]) == (20, 14, 13)
    # one candidate goes all the way before the next one starts
    assert lines[:3] == ["check 1", "bend 1", "check 2"]


def test_ranking_in_the_report_counts_reasons(springs: Path, tmp_path: Path) -> None:
    report = run(springs, out=tmp_path / "out")
    page = (tmp_path / "out" / "report.html").read_text(encoding="utf-8")
    assert (
        "Rejected and failed candidates, by reason" in page
        and "check: a multiple of three" in page
        and "Pareto front" in page
    )
    assert (tmp_path / "out" / "results.csv").read_text(encoding="utf-8").count("\n") == 21
    ranking = report["ranking"]
    assert set(ranking.numbers) == {n for n in range(1, 21) if n % 3 and n != 7}


@pytest.mark.long
def test_the_same_bytes_for_one_worker_two_workers_and_threads(springs: Path, tmp_path: Path) -> None:
    run(springs, out=tmp_path / "one")
    with ProcessPoolExecutor(2, mp_context=get_context("spawn")) as pool:
        run(springs, out=tmp_path / "two", executor=pool)
    with ThreadPoolExecutor(3) as threads:
        run(springs, out=tmp_path / "three", executor=threads)
    for name in ("candidates.jsonl", "results.csv"):
        first = (tmp_path / "one" / name).read_bytes()
        assert first == (tmp_path / "two" / name).read_bytes() == (tmp_path / "three" / name).read_bytes()


@pytest.mark.slow
def test_the_same_bytes_under_dask(springs: Path, tmp_path: Path) -> None:
    from distributed import Client, LocalCluster

    run(springs, out=tmp_path / "one")
    with LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=None) as cluster, Client(cluster) as client:
        run(springs, out=tmp_path / "dask", executor=client.get_executor())
    for name in ("candidates.jsonl", "results.csv"):
        assert (tmp_path / "one" / name).read_bytes() == (tmp_path / "dask" / name).read_bytes()


@pytest.mark.slow
def test_time_budget_stops_with_what_there_is_and_more_goes_on(springs: Path, tmp_path: Path) -> None:
    scene = with_mechanism(load_scene(springs), pause_s=0.05)
    report = run(replace(scene, budget=BudgetTable(time=0.2)), out=tmp_path / "out")
    assert 0 < len(report["records"]) < 20
    assert "time of 0.2 s is used up" in report.notes[0] and "run again" in report.notes[0]
    assert report.notes[0] in (tmp_path / "out" / "report.html").read_text(encoding="utf-8")
    whole = run(scene, out=tmp_path / "out")
    assert "taken over from an interrupted run" in whole.notes[0] and len(whole["records"]) == 20
    run(scene, out=tmp_path / "fresh")
    assert (tmp_path / "out" / "candidates.jsonl").read_bytes() == (
        tmp_path / "fresh" / "candidates.jsonl"
    ).read_bytes()


def test_memory_budget_and_a_budget_before_any_candidate(springs: Path) -> None:
    scene = load_scene(springs)
    with pytest.raises(
        SceneError, match=r"\[budget\] stops the run before stage .*MB of memory are in use.*1 MB; raise"
    ):
        execute(replace(scene, budget=BudgetTable(memory=1e6)))
    with pytest.raises(SceneError, match=r"time of 1e-09 s is used up"):
        execute(replace(scene, budget=BudgetTable(time=1e-9)))


def test_a_product_of_another_package_is_found_by_its_name(springs: Path) -> None:
    report = execute(replace(load_scene(springs), outputs=OutputsTable(("how_many",))))
    assert report["how_many"] == 20 and [s.name for s in report.stages][-1] == "count"


@pytest.mark.parametrize(
    ("product", "message"),
    [
        ("loop_a", r"stages need each other: loop a -> loop b -> loop a"),
        ("wrong", r"'wrong' is announced by 'fake_springs:WRONG', which is no Stage"),
        ("gone", r"'gone' is announced by 'fake_springs:NOTHING', which cannot be imported"),
        ("how_mani", r"asks for 'how_mani', which no stage gives; did you mean 'how_many'"),
    ],
)
def test_stages_of_other_packages_that_make_no_sense(springs: Path, product: str, message: str) -> None:
    with pytest.raises(SceneError, match=message):
        execute(replace(load_scene(springs), outputs=OutputsTable((product,))))


def test_streams_that_make_no_sense() -> None:
    source = Stage("s", "m:f", (), ("x",), stream=True)
    other = Stage("t", "m:f", (), ("y",), stream=True)
    one = Stage("one", "m:f", ("x",), ("a",), each=True)
    gathered = Stage("all", "m:f", ("a",), ("b",))
    late = Stage("late", "m:f", ("x", "b"), ("c",), each=True)
    with pytest.raises(SceneError, match="must start from one stream, not 2"):
        plan_stream((source, other, Stage("both", "m:f", ("x", "y"), ("z",), each=True)), ("z",))
    with pytest.raises(SceneError, match="must start from one stream, not 0"):
        plan_stream((Stage("both", "m:f", (), ("z",), each=True),), ("z",))
    with pytest.raises(SceneError, match="stage 'all' needs all candidates"):
        plan_stream(resolve((source, one, gathered, late), ("c",)), ("c",))
    assert plan_stream((source,), ("x",)) is None


values = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats(allow_nan=False) | st.text(),
    lambda inner: st.lists(inner).map(tuple) | st.dictionaries(st.text().filter(lambda k: k != "~"), inner),
    max_leaves=8,
)


@pytest.mark.long
@given(values, st.floats(allow_nan=False))
def test_values_survive_the_journal(value: object, number: float) -> None:
    record = Record(1, "k", margins=(Quantity("q", number, "mm", "certified", 0.5),))
    outcome = Outcome(3, "key", products={"value": value, "record": record})
    line = encode(outcome)
    assert decode(line) == outcome and encode(decode(line)) == line and "\n" not in line
    assert json.loads(line)["number"] == 3


def test_nan_survives_and_other_types_are_named() -> None:
    assert math.isnan(decode(encode(math.nan)))
    with pytest.raises(SceneError, match="gave a set, which cannot be kept as text"):
        encode({1, 2})


rows = st.lists(st.tuples(*[st.integers(0, 4).map(float)] * 3), max_size=12)


@given(rows)
def test_the_pareto_front_against_all_pairs(losses: list[tuple[float, ...]]) -> None:
    objectives = (Objective("a", "min"), Objective("b", "max", 2.0), Objective("c", 2.0))
    records = [Record(i, margins=tuple(map(Quantity, "abc", row))) for i, row in enumerate(losses)]
    found = ranking_of(objectives, records)
    cost = {i: (a, -b, abs(c - 2.0)) for i, (a, b, c) in enumerate(losses)}
    beaten = {
        i
        for i, j in itertools.permutations(cost, 2)
        if all(q <= p for p, q in zip(cost[i], cost[j], strict=True)) and cost[i] != cost[j]
    }
    assert set(found.front) == set(cost) - beaten
    assert sorted(found.numbers) == sorted(cost) and all(0.0 <= s <= 1.0 for s in found.scores)
    places = {n: i for i, n in enumerate(found.numbers)}
    assert all(places[i] < places[j] for i in found.front for j in beaten)


def test_a_record_without_an_objective_is_not_ranked_and_an_unknown_one_is_refused(springs: Path) -> None:
    records = (Record(1, margins=(Quantity("a", math.nan),)), Record(2, margins=(Quantity("a", 1.0),)), Record(3))
    found = ranking_of((Objective("a", "min"),), records)
    assert found.numbers == (2,) and found.unranked == ((1, "no a"), (3, "no a"))
    text = springs.read_text(encoding="utf-8").replace('"mass"', '"mas"')
    springs.write_text(text, encoding="utf-8")
    with pytest.raises(
        SceneError, match=r"line 16: \[ranking.objectives.0\] has quantity = 'mas'.*did you mean 'mass'"
    ):
        execute(springs)
