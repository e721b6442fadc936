"""The four-bar survey: classes proved and found, closed forms, shards, certificates, resumed runs."""

from __future__ import annotations

import copy
import itertools
import json
import math
import tomllib
from concurrent.futures import ProcessPoolExecutor, ThreadPoolExecutor
from dataclasses import replace
from fractions import Fraction
from multiprocessing import get_context
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, strategies as st

from graphsynth.core.errors import SceneError
from graphsynth.jamming.bearing.arcs import jam_arcs
from graphsynth.jamming.bearing.bearing import Bearing
from graphsynth.jamming.bearing.limits import largest_misalignment, smallest_clearance
from graphsynth.mechanism.four_bar import TiltedFourBar
from graphsynth.mechanism.rotatability import KINDS, TYPES
from graphsynth.pipeline.runner import execute, run
from graphsynth.pipeline.scene import BudgetTable, Scene, find_scene, load_scene
from graphsynth.pipeline.stages import Context
from graphsynth.systems.four_bar_survey import motion as survey_motion, stages as stages
from graphsynth.systems.four_bar_survey.motion import close_form, move
from graphsynth.systems.four_bar_survey.results import certify
from graphsynth.systems.four_bar_survey.stages import (
    QUANTITIES,
    classify,
    evaluate_sets,
    front_of,
    lattice_of,
    losses_of,
    objectives_of,
)

ROWS = ["records", "ranking", "tables", "rows"]


def tables(**mechanism: Any) -> dict[str, Any]:
    """The shipped scene with a lattice of 10 x 10 x 10 sets in six shards."""
    found = tomllib.loads(find_scene("four_bar_survey").read_text(encoding="utf-8"))
    span = {"first": 0.5, "last": 5, "step": 0.5}
    found["mechanism"]["lengths"] = {"crank": 1, "frame": span, "coupler": span, "rocker": span}
    found["mechanism"] |= {"shard": 190, "certify": 40, **mechanism}
    found["outputs"] = {"products": ROWS}
    return copy.deepcopy(found)


def small(**mechanism: Any) -> Scene:
    return Scene.from_mapping(tables(**mechanism))


@given(st.lists(st.tuples(*[st.integers(1, 9)] * 4), min_size=1, max_size=40))
def test_classes_against_exact_arithmetic_of_single_linkages(lengths: list[tuple[int, ...]]) -> None:
    kinds, types = classify(np.array(lengths))
    for (g, a, b, c), kind, type_ in zip(lengths, kinds, types, strict=True):
        assert KINDS[kind] == TiltedFourBar(g, a, b, c).full_turn().kind
        assert TYPES[type_] == grashof(g, a, b, c)


def grashof(g: int, a: int, b: int, c: int) -> str:
    """The textbook rule: the sum of the shortest and longest link against the other two."""
    ordered = sorted((g, a, b, c))
    excess = ordered[0] + ordered[3] - ordered[1] - ordered[2]
    if ordered[3] >= sum(ordered[:3]):
        return "immovable" if ordered[3] == sum(ordered[:3]) else "never assembled"
    if excess >= 0:
        return "triple rocker" if excess else "change point"
    return {g: "double crank", a: "crank-rocker", c: "rocker-crank", b: "double rocker"}[ordered[0]]


def test_motion_finds_the_exact_class_of_every_set() -> None:
    lengths = np.array([(g, 6, b, c) for g, b, c in itertools.product(range(1, 15), repeat=3)])
    kind, _ = classify(lengths)
    found = move(lengths, 36)
    assert np.bincount(kind, minlength=4).min() > 90  # every kind occurs, change points and kites among them
    np.testing.assert_array_equal(found.kind, kind)


def test_transmission_and_swing_against_closed_forms() -> None:
    lengths = np.array([(g, 4, b, c) for g, b, c in itertools.product(range(5, 16), repeat=3)])
    lengths = lengths[[TYPES[t] == "crank-rocker" for t in classify(lengths)[1]]]
    found = move(lengths, 72)
    g, a, b, c = lengths.T.astype(float)
    cosines = [(b * b + c * c - d * d) / (2 * b * c) for d in (np.abs(g - a), g + a)]
    angle = np.min([np.minimum(np.arccos(x), math.pi - np.arccos(x)) for x in cosines], axis=0)
    np.testing.assert_allclose(found.transmission, angle, rtol=1e-12)
    ends = [np.arccos((g * g + c * c - reach**2) / (2 * g * c)) for reach in (b + a, b - a)]
    np.testing.assert_allclose(found.swing, np.abs(ends[0] - ends[1]), rtol=0, atol=2e-3)
    fine = move(lengths, 720)
    assert np.abs(fine.swing - np.abs(ends[0] - ends[1])).max() < 2e-6
    np.testing.assert_allclose(fine.transmission, angle, rtol=1e-12)


@pytest.mark.parametrize("condition", ["A", "B"])
@pytest.mark.parametrize(("alpha", "axis"), [(0.015, [1, 0, 0]), (0.2, [1, -2, 3]), (0.0, [0, 1, 0])])
def test_closed_forms_by_set_against_single_linkages(condition: Any, alpha: float, axis: list[int]) -> None:
    scene = tables(tilt={"alpha_rad": alpha, "axis": axis})
    scene["mechanism"]["bearing"]["condition"] = condition
    table = Scene.from_mapping(scene).mechanism
    lengths = np.random.default_rng(0).integers(1, 60, (200, 4))
    lengths = lengths[lengths[:, 2] > 0.3 * lengths[:, 1]]  # shorter couplers cannot be assembled at the larger tilt
    found = close_form(table, lengths)
    bearing = Bearing(17.5, 10, 0.03)
    for i, (g, a, b, c) in enumerate(lengths.tolist()):
        one = TiltedFourBar(g, a, b, c, alpha=alpha, axis=tuple(axis))
        assert found.tilt[i] == pytest.approx(one.largest_tilt[0], rel=1e-13)
        part = sum(arc.length for arc in jam_arcs(one, bearing, condition).arcs) / math.tau
        assert found.part[i] == pytest.approx(part, rel=1e-12)
        limit = largest_misalignment(one, bearing, condition).value
        assert found.axis_tilt[i] == pytest.approx(math.pi / 2 if limit is None else limit, rel=1e-12)
        assert found.clearance[i] == pytest.approx(smallest_clearance(one, bearing, condition).value, rel=1e-12)


@given(st.lists(st.tuples(*[st.integers(0, 4).map(float)] * 3), max_size=25))
def test_the_front_against_all_pairs(rows: list[tuple[float, ...]]) -> None:
    losses = np.array(rows).reshape(-1, 3)
    beaten = {
        i
        for i, j in itertools.permutations(range(len(rows)), 2)
        if (losses[j] <= losses[i]).all() and (losses[j] < losses[i]).any()
    }
    assert set(front_of(losses).tolist()) == set(range(len(rows))) - beaten


def test_shards_give_what_the_whole_lattice_gives() -> None:
    scene = small()
    lattice, context = lattice_of(Context(scene)), Context(scene)
    whole = evaluate_sets(context, lattice, np.arange(len(lattice)))
    passing = np.flatnonzero(whole.passes)
    losses = losses_of(objectives_of(context), whole, passing)
    report = execute(replace(scene, outputs=replace(scene.outputs, products=("survey", "tables"))))
    survey = report["survey"]
    assert (survey.sets, survey.passing, survey.disagreements) == (1000, len(passing), 0)
    assert set(survey.front) == set(passing[front_of(losses)].tolist()) and len(survey.front) > 3
    assert sum(survey.classes.values()) == 1000 and sum(survey.rejected.values()) + survey.passing == 1000
    assert sum(survey.maps["turning"]) == int(np.sum(whole.kind == KINDS.index("full turn")))
    again = execute(replace(small(shard=1000), outputs=replace(scene.outputs, products=("survey",))))["survey"]
    assert (again.front, again.chosen, again.maps) == (survey.front, survey.chosen, survey.maps)


def random_scene(random: np.random.Generator) -> dict[str, Any]:
    """A little lattice with random limits and objectives."""
    found = tables(certify=int(random.integers(1, 30)), positions=8, shard=100, rows="passing")
    spans = {}
    for name in ("frame", "coupler", "rocker"):
        first, step, count = random.integers(1, 12), random.integers(1, 5), random.integers(0, 7)
        spans[name] = {"first": first / 4, "last": (first + step * count) / 4, "step": step / 4}
    found["mechanism"]["lengths"] = {"crank": 1, **spans}
    found["mechanism"]["limits"] |= {
        "transmission_deg": float(random.integers(0, 40)), "free": bool(random.integers(0, 2)),
    }  # fmt: skip
    names = random.permutation([name for name in QUANTITIES if name != "smallest clearance"])[: random.integers(1, 4)]
    found["ranking"]["objectives"] = [
        {"quantity": str(name), "goal": str(random.choice(["min", "max"])), "weight": float(random.integers(1, 4))}
        for name in names
    ]
    if random.integers(0, 2):
        found["ranking"]["objectives"][0]["target"] = float(random.integers(0, 60))
    found["mechanism"]["columns"] = names.tolist()
    found["outputs"] = {"products": ["survey", "ranking"]}
    return found


def brute_force(scene: Scene) -> tuple[list[int], list[float]]:
    """Rank the rows of all sets that pass: the Pareto front first, then by the weighted mean of scaled objectives."""
    context = Context(scene)
    lattice = lattice_of(context)
    rows = stages.store(context, evaluate_sets(context, lattice, np.arange(len(lattice)))).columns
    sets = rows["set"].tolist()
    columns, weights = [], []
    for wanted in scene.ranking.objectives:
        unit = QUANTITIES[wanted.quantity]
        values = rows[f"{wanted.quantity} [{unit}]" if unit else wanted.quantity].tolist()
        if wanted.target is not None:
            values = [-abs(value - wanted.target) for value in values]
        elif wanted.goal == "min":
            values = [-value for value in values]
        columns.append(values)  # more is better
        weights.append(wanted.weight)
    score, front = {}, set()
    for i, number in enumerate(sets):
        parts = [(c[i] - min(c)) / (max(c) - min(c)) if max(c) > min(c) else 1.0 for c in columns]
        score[number] = round(sum(w * part for w, part in zip(weights, parts, strict=True)) / sum(weights), 11)
        if not any(all(c[j] >= c[i] for c in columns) and any(c[j] > c[i] for c in columns) for j in range(len(sets))):
            front.add(number)
    order = sorted(sets, key=lambda number: (number not in front, -score[number], number))
    return order, [score[number] for number in order]


@pytest.mark.slow
def test_the_best_are_the_best_of_all_rows_whatever_is_certified() -> None:
    """Against a ranking of all rows, one by one, on random scenes."""
    random = np.random.default_rng(13)
    ranked = 0
    for _ in range(100):
        scene = Scene.from_mapping(random_scene(random))
        report = execute(replace(scene, outputs=replace(scene.outputs, products=("survey",))))
        order, scores = brute_force(scene)
        survey = report["survey"]
        most = scene.mechanism.certify
        assert survey.ranked == len(order)
        assert survey.scores == pytest.approx(scores[:most], abs=1e-10)
        assert list(survey.chosen[:1]) == order[:1]
        assert list(survey.chosen) == order[:most]
        ranked += len(order) > most
    assert ranked > 20


@pytest.mark.long
def test_the_best_does_not_depend_on_how_many_are_certified() -> None:
    reports = [execute(small(certify=most)) for most in (1, 7, 40)]
    texts = [report["records"][report["ranking"].numbers[0] - 1].solution for report in reports]
    assert len(set(texts)) == 1 and len({report["ranking"].scores[0] for report in reports}) == 1
    assert {report["ranking"].ranked for report in reports} == {reports[0]["ranking"].ranked} != {40}
    assert [report["ranking"].places[0] for report in reports] == 3 * [reports[0]["ranking"].places[0]]
    said = [[told.text for told in reports[k]["tables"][0].findings] for k in (0, 2)]
    assert all(any("The best set is on the edge of the lattice (frame" in text for text in own) for own in said)


def test_a_best_set_inside_the_lattice_gives_no_warning() -> None:
    found = tables(certify=1)
    found["mechanism"]["lengths"]["rocker"] = {"first": 3, "last": 3, "step": 1}  # no range: no edge
    found["ranking"]["objectives"] = [{"quantity": "size", "goal": "min", "target": 3.5}]
    report = execute(Scene.from_mapping(found))
    assert "frame 3.5" in report["records"][0].solution or "coupler 3.5" in report["records"][0].solution
    assert not any("edge of the lattice" in told.text for told in report["tables"][0].findings)


def test_a_margin_at_its_limit_is_kept() -> None:
    """The transmission angle of 4, 1, 3, 3 is 60 degrees: (9 + 9 - 9) / 18 is one half."""
    found = tables(limits={"transmission_deg": 60, "free": False}, certify=1)
    for scale in (1, 3, 7, 10):
        one = {name: {"first": k * scale / 10, "last": k * scale / 10, "step": 1} for name, k in
               (("frame", 4), ("coupler", 3), ("rocker", 3))}  # fmt: skip
        found["mechanism"]["lengths"] = {"crank": scale / 10, **one}
        assert execute(Scene.from_mapping(found))["ranking"].ranked == 1


@pytest.mark.long
def test_certificates_agree_with_the_closed_form_and_hold_the_tolerances() -> None:
    scene = small(limits={"transmission_deg": 20, "free": False}, tolerances={})
    report = execute(replace(scene, outputs=replace(scene.outputs, products=("records", "survey"))))
    records = report["records"]
    assert len(records) == 40 and {record.good for record in records} == {True, False}
    for record in records:
        margins = {margin.name: margin for margin in record.margins}
        assert record.good is (margins["jammed part"].value == 0.0)
        left, needed = margins["clearance left"], margins["smallest clearance"].value
        assert left.guarantee == "certified"
        assert abs((0.03 - needed) - left.value) <= left.error + 1e-15
    held = execute(small(limits={"transmission_deg": 20, "free": False}))[
        "records"
    ]  # the tolerances of the shipped scene
    for nominal, worst in zip(records, held, strict=True):
        assert worst.margins[-1].value < nominal.margins[-1].value - 0.0005
    proofs = certify(Context(small(limits={"free": False}, tolerances={"alpha_rad": 0.02})), report["survey"])
    assert {proof.free for proof in proofs} >= {False}  # a large tolerance lets some members jam


def outputs(folder: Path) -> dict[str, bytes]:
    names = ["candidates.jsonl", "results.csv", *sorted(str(p.relative_to(folder)) for p in folder.glob("rows/*"))]
    return {name: (folder / name).read_bytes() for name in names}


def test_rows_are_stored_by_shards_and_are_those_of_the_sets_that_pass(tmp_path: Path) -> None:
    report = run(small(), out=tmp_path)
    rows = [line.split(",") for p in sorted(tmp_path.glob("rows/*.csv")) for line in p.read_text().splitlines()[1:]]
    scene = small()
    whole = evaluate_sets(Context(scene), lattice_of(Context(scene)), np.arange(1000))
    assert [int(row[0]) for row in rows] == np.flatnonzero(whole.passes).tolist()
    assert {row[4] for row in rows} <= {"crank-rocker", "double crank"}
    assert "rows" in report.products and len(list(tmp_path.glob("rows/*.csv"))) == 6
    first = json.loads((tmp_path / "candidates.jsonl").read_text().splitlines()[-3])["value"]
    assert first["products"]["rows"]["~"] == "Part"


def test_parquet_and_all_rows(tmp_path: Path) -> None:
    parquet = pytest.importorskip("pyarrow.parquet")
    scene = small(rows="all", columns=["frame", "type", "kind", "transmission angle", "passes"])
    run(replace(scene, outputs=replace(scene.outputs, products=("rows",), files=("parquet",))), out=tmp_path)
    table = parquet.read_table(tmp_path / "rows")
    assert table.num_rows == 1000 and table.column_names[-2:] == ["transmission angle [deg]", "passes"]
    assert sorted(set(table["frame"].to_pylist())) == [0.5 * k for k in range(1, 11)]


@pytest.mark.long
def test_the_same_bytes_for_threads_and_none(tmp_path: Path) -> None:
    run(small(), out=tmp_path / "one")
    with ThreadPoolExecutor(3) as threads:
        run(small(), out=tmp_path / "threads", executor=threads)
    assert outputs(tmp_path / "one") == outputs(tmp_path / "threads")


@pytest.mark.slow
def test_the_same_bytes_for_two_processes_and_dask(tmp_path: Path) -> None:
    from distributed import Client, LocalCluster

    run(small(), out=tmp_path / "one")
    with ProcessPoolExecutor(2, mp_context=get_context("spawn")) as pool:
        run(small(), out=tmp_path / "two", executor=pool)
    with LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=None) as cluster, Client(cluster) as client:
        run(small(), out=tmp_path / "dask", executor=client.get_executor())
    assert outputs(tmp_path / "one") == outputs(tmp_path / "two") == outputs(tmp_path / "dask")


def cut(folder: Path, shards: int) -> None:
    """Leave what a run that was killed behind this many shards leaves: a torn line, one part file too many."""
    lines = (folder / "candidates.jsonl").read_bytes().splitlines(keepends=True)
    (folder / "candidates.jsonl").write_bytes(b"".join(lines[: 1 + shards]) + lines[1 + shards][:50])


@pytest.mark.long
def test_a_killed_run_goes_on_to_the_same_bytes(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    run(small(), out=tmp_path)
    whole = outputs(tmp_path)
    cut(tmp_path, 4)
    done = []
    usual = stages.evaluate
    monkeypatch.setattr(stages, "evaluate", lambda c, s: (done.append(s.number), usual(c, s))[1])
    report = run(small(), out=tmp_path)
    assert done == [5, 6] and "4 candidates were taken over" in report.notes[0]
    assert outputs(tmp_path) == whole


@pytest.mark.long
def test_a_part_that_was_changed_is_refused(tmp_path: Path) -> None:
    run(small(), out=tmp_path)
    cut(tmp_path, 4)
    scene = small()
    (tmp_path / "rows" / "part-00003.csv").write_text("set\n")
    with pytest.raises(SceneError, match=r"part-00003.csv of the interrupted run is missing or changed; add --fresh"):
        run(scene, out=tmp_path)
    run(scene, out=tmp_path, fresh=True)
    assert len(list(tmp_path.glob("rows/*.csv"))) == 6


@pytest.mark.long
def test_parts_of_an_older_larger_run_are_removed(tmp_path: Path) -> None:
    run(small(), out=tmp_path)
    run(small(shard=1000), out=tmp_path)
    assert [path.name for path in tmp_path.glob("rows/*")] == ["part-00001.csv"]


def test_one_failing_shard_is_recorded_and_the_others_go_on(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    usual = survey_motion.move

    def fails(lengths: Any, positions: int) -> Any:
        if lengths[0].tolist() == [2, 2, 10, 1]:
            raise ZeroDivisionError("frame 1")
        return usual(lengths, positions)

    monkeypatch.setattr(stages, "move", fails)
    report = run(small(), out=tmp_path)
    table = next(t for t in report["tables"] if t.title == "Shards that failed: 1")
    assert table.rows == (("sets 190 to 379: ZeroDivisionError: frame 1",),)
    assert dict(next(t for t in report["tables"] if t.title == "The survey").rows)["dimension sets"] == "810"
    assert "Shards that failed" in (tmp_path / "report.html").read_text(encoding="utf-8")
    assert len(list(tmp_path.glob("rows/*.csv"))) == 5


@pytest.mark.long
def test_a_time_budget_stops_and_more_goes_on(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    import time

    usual = stages.evaluate
    monkeypatch.setattr(stages, "evaluate", lambda c, s: (time.sleep(0.05), usual(c, s))[1])
    report = run(replace(small(), budget=BudgetTable(time=0.15)), out=tmp_path)
    assert "time of 0.15 s is used up" in report.notes[0]
    monkeypatch.undo()
    run(small(), out=tmp_path)
    run(small(), out=tmp_path / "whole")
    assert outputs(tmp_path) == outputs(tmp_path / "whole")


def test_nothing_passes_is_an_answer() -> None:
    report = execute(small(limits={"transmission_deg": 89.9}))
    assert report["records"] == () and report["ranking"].numbers == ()


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (
            {"frame": {"first": 1, "last": 2, "step": 0.3}},
            r"lengths.frame\] runs from 1 to 2 in steps of 0.3 and misses",
        ),
        ({"frame": {"first": 0.00001, "last": 5.00001, "step": 1}}, "common unit is 1e-05.*at most 20000 are exact"),
        ({"frame": {"first": 2, "last": 1, "step": 0.5}}, "last = 1.0, less than first"),
        ({"crank": 0}, "crank = 0.0; a length must be positive"),
    ],
)
def test_lattices_that_make_no_sense(change: dict[str, Any], message: str) -> None:
    found = tables()
    found["mechanism"]["lengths"] |= change
    with pytest.raises(SceneError, match=message):
        lattice_of(Context(Scene.from_mapping(found)))


def test_numbers_of_the_file_are_taken_exactly() -> None:
    third = {"first": "1/3", "last": "10/3", "step": "1/3"}
    found = tables()
    found["mechanism"]["lengths"] = {"crank": 1, "frame": third, "coupler": third, "rocker": third}
    lattice = lattice_of(Context(Scene.from_mapping(found)))
    assert lattice.unit == Fraction(1, 3) and lattice.crank == 3 and lattice.frame == range(1, 11)


def test_an_unknown_objective_is_named() -> None:
    found = tables()
    found["ranking"]["objectives"][0]["quantity"] = "transmision angle"
    with pytest.raises(SceneError, match=r"has quantity = 'transmision angle'.*did you mean 'transmission angle'"):
        execute(Scene.from_mapping(found))


@pytest.mark.long
def test_pictures_show_the_maps_and_the_best() -> None:
    scene = small()
    products = ("plots", "mechanism_pictures", "animations")
    report = execute(replace(scene, outputs=replace(scene.outputs, products=products)))
    assert [p.title for p in report["plots"]] == ["Classes", "Transmission", "Critical tilt", "What can be had at once"]
    assert len(report["mechanism_pictures"]) == 6 and len(report["animations"]) == 3
    assert "crank 1" in report["mechanism_pictures"][0].caption


def test_the_shipped_lattice_has_9651_immovable_sets() -> None:
    lattice = lattice_of(Context(load_scene("four_bar_survey")))
    kinds, types = classify(lattice.lengths(np.arange(len(lattice))))
    immovable = types == TYPES.index("immovable")
    assert int(immovable.sum()) == 9651 and (immovable == (kinds == KINDS.index("immovable"))).all()
    assert int((types == TYPES.index("triple rocker")).sum()) == 386_470 - 9651


def test_immovable_sets_are_found_in_motion() -> None:
    """The longest as long as the others together, whichever it is; one unit less moves, one more is never assembled."""
    short = np.random.default_rng(5).integers(1, 6000, (60, 3))
    for more, kind in ((0, "immovable"), (-1, "limited"), (1, "never assembled")):
        rows = np.column_stack([short, short.sum(axis=1) + more])
        lengths = np.concatenate([np.roll(rows, k, axis=1) for k in range(4)])
        assert {KINDS[k] for k in move(lengths, 8).kind} <= {kind, *(["change point"] if more < 0 else [])}


@pytest.mark.slow
def test_a_million_sets(tmp_path: Path) -> None:
    report = run(load_scene("four_bar_survey"), out=tmp_path)
    found = dict(next(t for t in report["tables"] if t.title == "The survey").rows)
    assert found["dimension sets"] == "1000000" and found["certified"] == "1000" == str(len(report["records"]))
    assert found["motion against the exact class"] == "0 sets of 1000000 disagree"
    kinds = {row[:2]: int(row[3]) for row in next(t for t in report["tables"] if "Grashof" in t.title).rows}
    assert kinds == independent_counts()


def independent_counts() -> dict[tuple[str, str], int]:
    """Count by the textbook rule, by another way: the sums of the four lengths, in units of a twentieth."""
    g, b, c = (axis.ravel() for axis in np.meshgrid(*[np.arange(1, 101)] * 3, indexing="ij"))
    four = np.sort(np.stack([g, np.full_like(g, 20), b, c]), axis=0)
    excess = four[0] + four[3] - four[1] - four[2]
    shortest = four[0]
    counts = {
        ("crank-rocker", "full turn"): (excess < 0) & (shortest == 20),
        ("double crank", "full turn"): (excess < 0) & (shortest == g),
        ("rocker-crank", "limited"): (excess < 0) & (shortest == c),
        ("double rocker", "limited"): (excess < 0) & (shortest == b),
        ("triple rocker", "limited"): (excess > 0) & (four[3] < four[:3].sum(axis=0)),
        ("immovable", "immovable"): four[3] == four[:3].sum(axis=0),
        ("never assembled", "never assembled"): four[3] > four[:3].sum(axis=0),
        # without room to spare, a crank passes if frame and crank are not the two that are too far apart
        ("change point", "change point"): (excess == 0) & (g + 20 <= b + c) & (abs(g - 20) >= abs(b - c)),
        ("change point", "limited"): (excess == 0) & ((g + 20 > b + c) | (abs(g - 20) < abs(b - c))),
    }
    return {name: int(np.sum(mask)) for name, mask in counts.items()}


@pytest.mark.slow
def test_kill_9_leaves_no_workers_and_the_rerun_gives_the_same_bytes(tmp_path: Path) -> None:
    import os
    import signal
    import subprocess
    import sys
    import time

    out = tmp_path / "killed"
    command = [sys.executable, "-m", "graphsynth", "run", "four_bar_survey", "--out", str(out), "--workers", "2"]
    process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    start, journal = time.monotonic(), out / "candidates.jsonl"
    while not (journal.exists() and journal.read_bytes().count(b"\n") > 3):
        assert process.poll() is None and time.monotonic() - start < 120
        time.sleep(0.1)
    listed = subprocess.run(
        ["ps", "-o", "pid=", "--ppid", str(process.pid)], capture_output=True, text=True, check=True
    )
    workers = [int(line) for line in listed.stdout.split()]
    os.kill(process.pid, signal.SIGKILL)
    process.wait()
    deadline = time.monotonic() + 30
    while any(Path(f"/proc/{pid}").exists() for pid in workers) and time.monotonic() < deadline:
        time.sleep(0.2)
    assert workers and not any(Path(f"/proc/{pid}").exists() for pid in workers)
    report = run("four_bar_survey", out=out)
    assert "were taken over from an interrupted run" in report.notes[0]
    run("four_bar_survey", out=tmp_path / "whole")
    assert outputs(out) == outputs(tmp_path / "whole")


def test_other_kinds_of_files_than_the_interrupted_run_wrote_are_refused(tmp_path: Path) -> None:
    pytest.importorskip("pyarrow")
    run(small(), out=tmp_path)
    cut(tmp_path, 4)
    scene = small()
    with pytest.raises(SceneError, match=r"wrote rows as csv, and now files = \['parquet'\].*--fresh"):
        run(replace(scene, outputs=replace(scene.outputs, files=("parquet",))), out=tmp_path)
