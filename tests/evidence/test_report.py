"""Tables, pictures, page and command line."""

import json
import math
import re
import subprocess
import sys
from html.parser import HTMLParser
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest

from graphsynth.cli import main
from graphsynth.core.errors import GeometryError, SceneError, SpecError
from graphsynth.evidence import Effort, Problem, Row, RowStatus, measure, work_precision_picture, write_report
from graphsynth.evidence.rows import Plan, best_of, frame_of
from graphsynth.pipeline.scene import available_scenes, load_scene
from graphsynth.pipeline.stages import Context
from graphsynth.pipeline.system import plans_of, system_names

PROBLEM = Problem(
    "sums", "How to add <numbers> & more", "mm",
    (
        Row("a", "coarse", 1e-2, 1e-3, 3, "distance", "50 digits", default=True),
        Row("a", "fine", 1e-6, 2e-3, 3, "distance", "50 digits", more={"calls": 7.0}),
        Row("a", "exact", 0.0, 4e-3, 3, "distance", "50 digits"),
        Row("b", "any", math.nan, 2.0, 1, "distance", "50 digits", RowStatus.FAILED, "it loops"),
        Row("b", "never run", math.nan, math.nan, 0, "distance", "50 digits", RowStatus.FAILED, "refused"),
        Row("c", "one", 0.5, 1e-4, 3, "distance", "50 digits", RowStatus.UNRELIABLE, "a lie", proved=True),
    ),
)  # fmt: skip


def problem_of_test(context, effort):
    return PROBLEM


def problem_that_is_not(context, effort):
    raise GeometryError("the curves do\nnot cross")


def problem_that_is_stopped(context, effort):
    raise KeyboardInterrupt


def problem_whose_compiler_is_stopped(context, effort):
    try:
        raise KeyboardInterrupt
    except KeyboardInterrupt as error:
        raise RuntimeError("compiling failed") from error


def problem_with_a_defect(context, effort):
    return 1 / 0


def scene_that_is_wrong(context, effort):
    raise SceneError("lengths make no sense")


def plan(function):
    return Plan("sums", f"{__name__}:{function.__name__}")


def _measured():
    context = SimpleNamespace(scene=SimpleNamespace(name="test"))
    plans = [plan(problem_of_test), Plan("gap", f"{__name__}:problem_that_is_not")]
    return measure(context, plans, Effort(rounds=1))


@pytest.fixture(scope="module")
def report():
    return _measured()


@pytest.fixture(scope="module")
def folder(report, tmp_path_factory):
    path = tmp_path_factory.mktemp("report")
    write_report(report, path)
    return path


def test_what_a_scene_does_not_pose_is_left_out_with_its_reason(report):
    assert report.left_out == (("gap", "the curves do not cross"),)
    assert [problem.name for problem in report.problems] == ["sums"]
    assert set(report.times) == {"sums", "gap"}


def test_ctrl_c_keeps_what_is_measured(tmp_path):
    context = SimpleNamespace(scene=SimpleNamespace(name="test"))
    plans = [plan(problem_of_test), plan(problem_that_is_stopped), Plan("last", f"{__name__}:problem_of_test")]
    report = measure(context, plans)
    assert report.interrupted and [problem.name for problem in report.problems] == ["sums"]
    assert [why for _, why in report.left_out] == ["interrupted", "not begun: interrupted"]
    assert report.document()["interrupted"] is True
    with pytest.raises(KeyboardInterrupt):  # nothing to keep
        measure(context, plans[1:])


def test_ctrl_c_inside_the_compiler_is_ctrl_c():
    context = SimpleNamespace(scene=SimpleNamespace(name="test"))
    report = measure(context, [plan(problem_of_test), plan(problem_whose_compiler_is_stopped)])
    assert report.interrupted


def test_a_defect_of_one_problem_does_not_lose_the_others():
    context = SimpleNamespace(scene=SimpleNamespace(name="test"))
    report = measure(context, [plan(problem_with_a_defect), Plan("last", f"{__name__}:problem_of_test")])
    assert report.left_out == (("sums", "failed: ZeroDivisionError: division by zero"),)
    assert [problem.name for problem in report.problems] == ["last"] and not report.interrupted


def test_an_error_of_the_scene_stops_the_measurement():
    with pytest.raises(SceneError, match="no sense"):
        measure(SimpleNamespace(scene=SimpleNamespace(name="x")), [plan(scene_that_is_wrong)])


@pytest.mark.slow
def test_table_holds_every_row_and_column(folder):
    read = pd.read_csv(folder / "accuracy.csv")
    assert len(read) == len(PROBLEM.rows)
    wanted = {
        "problem",
        "method",
        "setting",
        "error",
        "unit",
        "kind",
        "reference",
        "seconds",
        "rounds",
        "status",
        "reason",
    }
    assert wanted <= set(read.columns)
    assert read.status.tolist() == ["ok", "ok", "ok", "failed", "failed", "unreliable"]
    assert np.isnan(read.calls[0]) and read.calls[1] == 7.0
    assert list(frame_of([]).columns)[:2] == ["problem", "method"]


@pytest.mark.long
def test_document_is_json_without_nan(folder):
    text = (folder / "accuracy.json").read_text(encoding="utf-8")
    document = json.loads(text, parse_constant=lambda name: pytest.fail(f"{name} in the document"))
    assert document["problems"][0]["rows"][3]["error"] is None
    assert document["problems"][0]["advice"].keys() == {"a", "b", "c"}


class Page(HTMLParser):
    def __init__(self):
        super().__init__()
        self.ids, self.links, self.open, self.text = [], [], [], ""

    def handle_starttag(self, tag, attributes):
        given = dict(attributes)
        self.ids += [given["id"]] if "id" in given else []
        self.links += [v for k, v in given.items() if k in ("src", "href", "xlink:href") and v]
        if tag not in ("meta", "br", "link", "img"):
            self.open.append(tag)

    def handle_endtag(self, tag):
        assert self.open.pop() == tag

    def handle_startendtag(self, tag, attributes):
        self.handle_starttag(tag, attributes)
        self.open.pop()

    def handle_data(self, data):
        self.text += data


@pytest.mark.long
def test_page_stands_alone(folder):
    text = (folder / "accuracy.html").read_text(encoding="utf-8")
    page = Page()
    page.feed(text)
    assert not page.open and len(page.ids) == len(set(page.ids))
    assert all(link.startswith("#") for link in page.links)
    assert {link[1:] for link in page.links} <= set(page.ids)
    assert set(re.findall(r"url\(#([^)]+)\)", text)) <= set(page.ids)
    assert "How to add <numbers> & more" in page.text and "it loops" in page.text
    assert "<numbers>" not in text


@pytest.mark.long
def test_failures_are_drawn_above_everything_that_has_an_error():
    axes = work_precision_picture(PROBLEM).axes[0]
    crosses = [line for line in axes.lines if line.get_marker() == "x" and len(line.get_xdata())]
    heights = sorted(float(np.asarray(line.get_ydata())[0]) for line in crosses)
    assert heights == [0.5, 5.0, 5.0]  # the lie at its error, the failures a decade above the largest
    assert axes.get_xscale() == axes.get_yscale() == "log"
    lines = [line for line in axes.lines if line.get_label().startswith("a")]
    assert np.asarray(lines[0].get_ydata()).min() > 0.0  # an error of zero is drawn at rounding size


@pytest.mark.long
def test_names_of_settings_keep_off_markers():
    """The end of one line lies among the markers of another, an eighth of an inch apart."""
    ends = [("a", 6.6e-4, 2.9e-4), ("a", 0.0109, 2.9e-5), ("a", 0.149, 2.9e-6)]
    ends += [("b", 0.131, 7.2e-3), ("b", 0.216, 1.3e-4), ("b", 0.175, 1.6e-5), ("b", 0.16, 2e-6)]
    rows = [Row(name, f"step {error:.0e} s", error, time, 3, "distance", "") for name, time, error in ends]
    rows.append(Row("b", "", 1.4e-5, 0.158, 3, "distance", "", RowStatus.UNRELIABLE, "a lie"))
    figure = work_precision_picture(Problem("near", "Names beside markers", "mm", tuple(rows)))
    (axes,) = figure.axes
    figure.draw_without_rendering()
    names = [text.get_window_extent() for text in axes.texts if text.get_visible()]
    assert len(names) == 4
    for line in axes.lines:
        for at in axes.transData.transform(line.get_xydata()).reshape(-1, 2):
            gaps = [np.hypot(*np.maximum(np.maximum(box.min - at, at - box.max), 0.0)) for box in names]
            assert min(gaps) > 0.5 * line.get_markersize() * figure.dpi / 72.0


def test_nothing_to_draw():
    with pytest.raises(SpecError, match="no rows"):
        work_precision_picture(Problem("p", "q", "mm", ()))


def test_effort():
    calls = []
    _, seconds, rounds = best_of(lambda: calls.append(1), Effort(rounds=4))
    assert (len(calls), rounds) == (5, 4) and seconds >= 0.0
    with pytest.raises(SpecError, match="whole number"):
        Effort(rounds=0)
    with pytest.raises(SpecError, match="patience"):
        Effort(patience=0.0)


def test_patience_ends_the_rounds_but_never_before_one():
    import time

    _, _, rounds = best_of(lambda: time.sleep(0.02), Effort(rounds=50, patience=0.03))
    assert 1 <= rounds <= 3


def test_every_system_has_problems_and_every_plan_a_function():
    for name in system_names():
        plans = plans_of(name, structure=True)
        assert len({plan.name for plan in plans}) == len(plans) >= 2
        for each in plans:
            assert callable(each.load())


def test_a_plan_that_names_nothing():
    with pytest.raises(SceneError, match="cannot be imported"):
        Plan("x", "graphsynth.evidence:nothing_of_that_name").load()


def test_only_the_methods_of_the_scene_are_loaded():
    code = (
        "import sys\n"
        "from graphsynth.pipeline.system import plans_of\n"
        "[plan.load() for plan in plans_of('tribometer')]\n"
        "import graphsynth.evidence.report\n"
        "heavy = ('graphsynth.', 'numba', 'matplotlib', 'scipy')\n"
        "print(*sorted(name for name in sys.modules if name.startswith(heavy)))\n"
    )
    found = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout.split()
    systems = {name.split(".")[2] for name in found if name.startswith("graphsynth.systems.")}
    assert systems == {"tribometer"}
    assert not {"graphsynth.dynamics", "graphsynth.jamming", "graphsynth.kinematics", "numba", "scipy"} & set(found)


@pytest.fixture
def small(monkeypatch):
    only = tuple(p for p in plans_of("lambda_linkage") if p.name == "arc-ends")
    monkeypatch.setattr("graphsynth.pipeline.system.plans_of", lambda name, structure: only)


@pytest.mark.slow
def test_command_line(small, tmp_path, capsys):
    given = ["accuracy", "lambda", "--quick", "--rounds", "1", "--out"]
    assert main([*given, str(tmp_path / "text")]) == 0
    out = capsys.readouterr().out
    assert "arc-ends: At which crank angles" in out and "interval sweep: " in out and "default: interval sweep" in out
    names = {path.name for path in (tmp_path / "text").iterdir()}
    assert {"accuracy.csv", "accuracy.json", "accuracy.html", "arc-ends.svg", "arc-ends.png"} <= names
    assert main([*given, str(tmp_path / "json"), "--json"]) == 0
    document = json.loads(capsys.readouterr().out)
    assert document["scene"] == "lambda" and "accuracy.html" in document["files"]


@pytest.mark.parametrize("given", [["no-such-scene"], ["lambda", "--rounds", "0"]])
def test_bad_input_is_one_sentence(given, capsys):
    assert main(["accuracy", *given]) == 2
    assert capsys.readouterr().err.count("\n") == 1


def test_a_folder_that_cannot_be_written_is_refused_before_measuring(tmp_path, capsys, monkeypatch):
    monkeypatch.setattr("graphsynth.evidence.report.measure", lambda *given: pytest.fail("measured"))
    (tmp_path / "file").write_text("in the way")
    for folder in (tmp_path / "file", tmp_path / "file" / "below", "/proc/nowhere"):
        assert main(["accuracy", "lambda", "--out", str(folder)]) == 2
        error = capsys.readouterr().err
        assert error.count("\n") == 1 and str(folder).split("/below")[0] in error


@pytest.mark.long
def test_ctrl_c_at_the_terminal(small, monkeypatch, tmp_path, capsys):
    stopped = (plan(problem_of_test), plan(problem_that_is_stopped))
    monkeypatch.setattr("graphsynth.pipeline.system.plans_of", lambda name, structure: stopped)
    assert main(["accuracy", "lambda", "--out", str(tmp_path)]) == 130
    out, error = capsys.readouterr()
    assert "a: fastest for errors" in out and "kept in" in error and error.endswith("interrupted\n")
    assert len(pd.read_csv(tmp_path / "accuracy.csv")) == len(PROBLEM.rows)


def test_a_system_without_methods_is_refused(monkeypatch, capsys):
    monkeypatch.setattr("graphsynth.pipeline.system.plans_of", lambda name, structure: ())
    assert main(["accuracy", "lambda"]) == 2
    assert "no numerical method is known for module = 'lambda_linkage'" in capsys.readouterr().err


@pytest.mark.slow
@pytest.mark.parametrize("name", available_scenes())
def test_every_shipped_scene(name, tmp_path):
    scene = load_scene(name)
    plans = plans_of(scene.mechanism.module, structure=scene.structure is not None)
    report = measure(Context(scene), plans, Effort(rounds=1, quick=True))
    write_report(report, tmp_path)
    assert len(report.problems) + len(report.left_out) == len(plans)
    allowed = {
        ("four_bar_survey", "arc-ends"),  # its bearing does not jam
        ("eight_link_search", "coupled-joints"), ("eight_link_search", "linkage-dynamics"),  # no such tables
        ("motor_driven_press", "coupled-joints"),  # no jamming table
        ("press_tolerances", "linkage-dynamics"), ("misaligned_press", "linkage-dynamics"),  # no loads
        ("press_tolerances", "binding-in-space"), ("motor_driven_press", "binding-in-space"),
        ("eight_link_search", "binding-in-space"), ("worked_example", "binding-in-space"),  # nothing that gives way
        ("worked_example", "linkage-dynamics"),  # no loads
    }  # fmt: skip
    assert {(name, left) for left, _ in report.left_out} <= allowed
    for problem in report.problems:
        assert any(row.good for row in problem.rows), problem.name
        for method, text in report.advice[problem.name].items():
            assert len(problem.of(method)) >= 3 or "no setting" in text or "only" in text
        assert all(row.reference for row in problem.rows if row.good), problem.name
        wrong = [row for row in problem.rows if "outside of what is proved" in row.reason or "beyond" in row.reason]
        assert not wrong
