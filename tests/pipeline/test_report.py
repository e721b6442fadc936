"""The report folder: whole files, escaped text, a table that says how each number was had."""

from __future__ import annotations

import csv
import io
import json
from dataclasses import replace
from html.parser import HTMLParser
from io import StringIO
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given, strategies as st
from rich.console import Console

from graphsynth.core.errors import SceneError
from graphsynth.pipeline.page import report_html
from graphsynth.pipeline.products import Attempt, Candidate, Columns, Picture, Quantity, Record, Table, each
from graphsynth.pipeline.report import column_widths, print_summary, scene_json, write_report
from graphsynth.pipeline.runner import Running, run
from graphsynth.pipeline.scene import OutputsTable, Scene
from graphsynth.pipeline.stages import Context, Report, StageTime
from graphsynth.pipeline.store import check_folder, column_files, results_table
from graphsynth.pipeline.system import Stage

RECORDS = (
    Record(
        1, "k1", "n2=3", "assessed", "lambda_linkage", "free", True, (Quantity("gap", -0.25, "mm", "estimated", 1e-16),)
    ),
    Record(2, "k2", "n2=3", "not recognised", reason="no kinematic module yet recognises this graph"),
    Record(3, "k3", 'a,"b"\n', "failed", "lambda_linkage", reason="ZeroDivisionError: <b>&"),
)


@pytest.fixture
def report(lambda_tables: dict[str, Any]) -> Report:
    lambda_tables["scene"]["title"] = "<script>alert(1)</script>"
    scene = Scene.from_mapping(lambda_tables, "x.toml", "ab" * 32)
    products = {
        "records": RECORDS,
        "tables": (Table("T & T", ("a", "b"), (("<i>", "1"),), "note <"),),
        "mechanism_pictures": (Picture("P", '<svg xmlns="http://www.w3.org/2000/svg" class="gs"></svg>', "<c>"),),
    }
    return Report(scene, products, (StageTime("solve", 0.5, 0.25),), {"python": "3"})


class Balance(HTMLParser):
    """Fails on unbalanced tags, foreign resources and unescaped titles."""

    VOID = frozenset({"meta", "br", "hr", "img", "link", "input", "path", "circle"})

    def __init__(self) -> None:
        super().__init__()
        self.open: list[str] = []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        assert tag not in ("script", "link", "img", "iframe")
        assert not any(name in ("src", "onload") for name, _ in attrs)
        if tag not in self.VOID:
            self.open.append(tag)

    def handle_startendtag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        pass

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag


def test_page_is_balanced_escaped_and_self_contained(report: Report) -> None:
    page = report_html(report)
    parser = Balance()
    parser.feed(page)
    assert parser.open == []
    assert "&lt;script&gt;" in page and "<i>" not in page and "<c>" not in page
    assert "url(" not in page and "@import" not in page
    assert 'name="viewport"' in page and "prefers-color-scheme:dark" in page


def test_csv_has_one_row_per_candidate_and_says_how_each_number_was_had() -> None:
    content = column_files("results", results_table(RECORDS), ["csv"])["results.csv"].decode()
    rows = list(csv.DictReader(io.StringIO(content, newline="")))
    assert [row["number"] for row in rows] == ["1", "2", "3"]
    assert float(rows[0]["gap [mm]"]) == -0.25
    assert (rows[0]["gap guarantee"], rows[0]["gap error [mm]"]) == ("estimated", "1e-16")
    assert rows[1]["gap [mm]"] == "" and rows[1]["reason"].startswith("no kinematic module")
    assert rows[2]["solution"] == 'a,"b"\n' and rows[2]["status"] == "failed"


def test_scene_json_holds_scene_versions_seed_and_times(report: Report) -> None:
    content = json.loads(scene_json(report))
    assert content["scene"]["mechanism"]["tilt"]["alpha_rad"] == "1/30"
    assert content["sha256"] == "ab" * 32 and content["seed"] == 0
    (stage,) = content["stages"]
    assert (stage["stage"], stage["import_seconds"], stage["seconds"], stage["peak_MB"]) == ("solve", 0.5, 0.25, None)


def test_files_appear_whole_or_not_at_all(report: Report, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    write_report(report, tmp_path / "out")
    before = (tmp_path / "out" / "results.csv").read_bytes()

    def full_disk(self: Path, target: object) -> Path:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(Path, "replace", full_disk)
    with pytest.raises(SceneError, match=r"cannot write the report into .*No space left.*another folder"):
        write_report(report, tmp_path / "out")
    assert (tmp_path / "out" / "results.csv").read_bytes() == before
    assert sorted(p.name for p in (tmp_path / "out").iterdir()) == ["report.html", "results.csv", "scene.json"]


def test_out_that_is_a_file_is_refused(report: Report, tmp_path: Path) -> None:
    (tmp_path / "taken").write_text("x")
    with pytest.raises(SceneError, match="choose another folder"):
        write_report(report, tmp_path / "taken")


def test_one_bad_candidate_does_not_stop_the_others() -> None:
    attempts = [Attempt(Candidate(i, None, ""), value) for i, value in enumerate((4.0, 0.0, 2.0))]
    first = each(attempts, lambda x: 1 / x)
    second = each(first, lambda x: x + 1)
    assert [a.value for a in second] == [1.25, None, 1.5]
    assert [a.failed for a in second] == [False, True, False]
    assert second[1].reason == "ZeroDivisionError: float division by zero"


def test_stages_run_once_in_order_and_unneeded_products_are_dropped(lambda_tables: dict[str, Any]) -> None:
    told: list[tuple[str, int, int]] = []
    stages = (
        Stage("one", f"{__name__}:one", (), ("x",)),
        Stage("two", f"{__name__}:two", ("x",), ("y", "z")),
    )
    context = Context(Scene.from_mapping(lambda_tables))
    running = Running(stages, ("z",), context, lambda s, d, n: told.append((s, d, n)))
    products, times = running.run(), running.times
    assert products == {"z": "z1"}
    assert [t.stage for t in times] == ["one", "two"] and all(t.seconds >= 0 for t in times)
    assert told == [("one", 0, 2), ("two", 1, 2), ("done", 2, 2)]


def one(context: Context) -> int:
    return 1


def two(context: Context, x: int) -> tuple[str, str]:
    return f"y{x}", f"z{x}"


def test_parquet_holds_the_same_as_csv(report: Report, tmp_path: Path) -> None:
    import numpy as np

    parquet = pytest.importorskip("pyarrow.parquet")

    outputs = OutputsTable(("records",), ("csv", "parquet"))
    columns = Columns("curve", {"crank [deg]": np.arange(3.0), "mode": ["a", "b", "c"]})
    products = {**report.products, "curves": (columns,)}
    folder = write_report(replace(report, scene=replace(report.scene, outputs=outputs), products=products), tmp_path)
    assert (folder / "curve.csv").read_text(encoding="utf-8").split() == [
        "crank",
        "[deg],mode",
        "0.0,a",
        "1.0,b",
        "2.0,c",
    ]
    assert parquet.read_table(folder / "curve.parquet").to_pydict() == {
        "crank [deg]": [0.0, 1.0, 2.0],
        "mode": list("abc"),
    }
    found = parquet.read_table(folder / "results.parquet").to_pylist()
    rows = list(csv.DictReader(io.StringIO((folder / "results.csv").read_text(encoding="utf-8"), newline="")))
    assert len(found) == len(rows) == 3 and found[0]["gap [mm]"] == float(rows[0]["gap [mm]"]) == -0.25
    assert found[1]["gap [mm]"] is None and list(found[0]) == list(rows[0])


def test_a_folder_that_cannot_be_written_is_refused_before_anything_is_computed(
    lambda_tables: dict[str, Any], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "file").write_text("in the way", encoding="utf-8")
    monkeypatch.setattr(Running, "run", lambda self: pytest.fail("computed before the folder was tried"))
    scene = Scene.from_mapping(lambda_tables)
    for out, why in (("file", "Not a directory"), ("file/out", "Not a directory"), (300 * "x", "too long")):
        with pytest.raises(SceneError, match=rf"cannot write the report into .*({why}); choose another folder"):
            run(scene, tmp_path / out)
    assert [path.name for path in tmp_path.iterdir()] == ["file"]


def test_trying_a_folder_leaves_nothing_behind(tmp_path: Path) -> None:
    check_folder(tmp_path / "a" / "b")
    assert not list(tmp_path.iterdir())
    (tmp_path / "kept").mkdir()
    check_folder(tmp_path / "kept")
    assert [path.name for path in tmp_path.rglob("*")] == ["kept"]


@given(
    st.lists(st.lists(st.text("ab 1-", max_size=30), min_size=3, max_size=3), min_size=1, max_size=5),
    st.integers(4, 90),
)
def test_tables_on_the_terminal_break_no_word(rows: list[list[str]], room: int) -> None:
    head, *cells = rows
    table = Table("", tuple(head), tuple(map(tuple, cells)))
    longest = [max((len(word) for row in rows for word in row[k].split()), default=1) for k in range(3)]
    widths = column_widths(table, room)
    if max(longest) <= 24:
        assert (widths is None) == (sum(longest) > room)
    if widths is not None:
        assert sum(widths) <= room
        assert all(width >= min(24, word) for width, word in zip(widths, longest, strict=True))


def test_a_table_too_wide_for_the_terminal_is_named(report: Report) -> None:
    wide = Table("Forces", tuple(f"column{k}" for k in range(20)), (tuple(20 * ["-12.345678"]),))
    narrow = Table("Words", ("what",), (("some [bold] words",),), "a note that is longer than the table below it is")
    shown = replace(report, products={**report.products, "tables": (wide, narrow)})
    out = StringIO()
    print_summary(shown, Console(file=out, width=80))
    lines = out.getvalue().splitlines()
    at = lines.index("Forces")
    assert lines[at + 1] == "1 x 20 cells are too wide for this terminal; see report.html."
    assert "a note that is longer than the table below it is" in lines and max(map(len, lines)) <= 80
    assert "some [bold] words" in out.getvalue()
