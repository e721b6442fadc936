"""What a scene leaves out: exact lists of what each shipped scene loads, and the explanation of a run."""

from __future__ import annotations

import json
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

from graphsynth.cli.main import main
from graphsynth.core.native import library
from graphsynth.pipeline.measure import rooms, why_not, why_run
from graphsynth.pipeline.scene import available_scenes
from graphsynth.pipeline.system import Stage

LOADS = tomllib.loads(Path(__file__).with_name("loads.toml").read_text(encoding="utf-8"))

PROBE = """
import sys
before = set(sys.modules)  # what the interpreter itself loads, .pth files included
from graphsynth.pipeline.runner import run
run(sys.argv[1], out=sys.argv[2])
print("\\n".join(set(sys.modules) - before))
"""


def loaded(scene: str, out: Path) -> set[str]:
    """Every module that a run of a scene imports in a fresh process."""
    command = [sys.executable, "-c", PROBE, scene, str(out)]
    done = subprocess.run(command, capture_output=True, text=True, check=True, timeout=1800)
    return set(done.stdout.split())


def test_every_shipped_scene_has_its_list() -> None:
    assert set(LOADS["scenes"]) == set(available_scenes())


QUICK = {"lambda"}  # the others take seconds each
LISTED = [
    pytest.param(name, marks=() if name in QUICK else pytest.mark.slow)
    for name in sorted(set(LOADS["scenes"]) & set(available_scenes()))
]

#: Loaded when the report is written, behind the last stage.
OF_THE_PAGE = {"jinja2", "markupsafe"}


@pytest.mark.long
@pytest.mark.parametrize("name", LISTED)
def test_a_shipped_scene_loads_exactly_what_is_on_its_list(name: str, tmp_path: Path) -> None:
    modules = loaded(name, tmp_path)
    expected = LOADS["scenes"][name]
    found = rooms(modules)
    ours = {room.partition(".")[2] for room in found if room.startswith("graphsynth.")}
    assert ours == set(expected["rooms"]) | set(LOADS["always"]["rooms"])
    theirs = {package for package in found if not package.startswith("graphsynth")} - {"lazy_loader"} - OF_THE_PAGE
    packages = {*expected["packages"], *(() if library.contents() else ("numba",))}
    brought = {part for package in packages for part in LOADS["brings"].get(package, ())}
    assert theirs - brought | (theirs & packages) == packages
    if not {"dynamics", "systems.tribometer"} & set(expected["rooms"]):  # nothing is integrated
        assert "scipy.integrate" not in modules
    if "matplotlib" not in expected["packages"]:
        assert "matplotlib" not in modules
    assert not {"pandas", "sympy"} & (modules - set(expected["packages"]))


def test_why() -> None:
    a = Stage("a", "m:a", (), ("x", "w"))
    b = Stage("b", "m:b", ("x",), ("y",))
    c = Stage("c", "m:c", ("x", "w"), ("z",))
    assert why_run(a, (a, b, c), ("w", "y")) == "w asked for; x needed by b, c; w needed by c"
    assert why_not(c) == "nothing asked for needs z"


def test_explain_on_the_terminal(springs: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    text = springs.read_text(encoding="utf-8").replace('"ranking"', '"how_many"')
    springs.write_text(text, encoding="utf-8")
    assert main(["run", str(springs), "--out", str(tmp_path / "out"), "--explain"]) == 0
    said = capsys.readouterr().out
    order = ["scale", "springs", "check", "bend", "judge", "collect", "count"]
    places = [said.index(f"  {name}: ") for name in order]
    assert places == sorted(places) or places[:2] == sorted(places[:2], reverse=True)
    assert "records asked for; records needed by count" in said
    assert "20 candidates, one by one" in said and "14 candidates, one by one" in said
    assert "rank: nothing asked for needs ranking" in said
    assert "peak" in said and "import" in said


def test_explain_for_scripts(springs: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["run", str(springs), "--out", str(tmp_path / "out"), "--explain", "--json"]) == 0
    found = json.loads(capsys.readouterr().out)["explain"]
    ran = {stage["stage"]: stage for stage in found["ran"]}
    assert ran["bend"]["runs"] == 14 and ran["bend"]["needs"] == ["springs", "checked", "factor"]
    assert found["left_out"] == [] and found["outputs"] == ["records", "ranking"]
    assert all(stage["peak_MB"] is None or stage["peak_MB"] > 5 for stage in found["ran"])


HELP_LIMIT, IMPORT_LIMIT = 5.0, 1.5


def least_seconds(arguments: list[str], times: int = 7) -> float:
    """Least processor time of a process: what it takes on a machine that does nothing else."""
    resource = pytest.importorskip("resource")
    least = float("inf")
    for _ in range(times):
        before = resource.getrusage(resource.RUSAGE_CHILDREN)
        subprocess.run([sys.executable, *arguments], capture_output=True, check=True)
        after = resource.getrusage(resource.RUSAGE_CHILDREN)
        least = min(least, after.ru_utime - before.ru_utime + after.ru_stime - before.ru_stime)
    return least


@pytest.mark.long
def test_start_up_is_quick() -> None:
    """Beside four modules of the standard library: processor time beyond that of an empty program."""
    empty = least_seconds(["-c", "pass"])
    unit = least_seconds(["-c", "import argparse, dataclasses, re, typing"]) - empty
    assert least_seconds(["-m", "graphsynth", "--help"]) - empty <= HELP_LIMIT * unit
    assert least_seconds(["-c", "import graphsynth"]) - empty <= IMPORT_LIMIT * unit


@pytest.mark.parametrize("arguments", [["--help"], ["run", "--help"]])
def test_help_loads_no_third_party_package(arguments: list[str]) -> None:
    code = (
        "import sys; before = set(sys.modules)\n"
        "from graphsynth.cli.main import main\n"
        f"try: main({arguments})\n"
        "except SystemExit: pass\n"
        "print('LOADED', *sorted(set(sys.modules) - before))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    modules = done.stdout.rpartition("LOADED")[2].split()
    assert {room for room in rooms(modules) if not room.startswith("graphsynth")} == {"lazy_loader"}
    assert "graphsynth.pipeline" not in modules


def test_a_stream_without_graphs_loads_only_what_writes_the_page(springs: Path, tmp_path: Path) -> None:
    found = rooms(loaded(str(springs), tmp_path / "out"))
    assert {room for room in found if not room.startswith("graphsynth")} - OF_THE_PAGE == {
        "fake_springs",
        "lazy_loader",
    }


def test_what_a_stage_for_each_candidate_imports_is_told(springs: Path, tmp_path: Path, fake_site: Path) -> None:
    (fake_site / "fake_late.py").write_text("", encoding="utf-8")
    code = (
        "import sys, fake_springs; from graphsynth.pipeline.runner import run\n"
        "def check(context, spring):\n"
        "    if spring.number == 5: import fake_late\n"
        "    return spring.number\n"
        "fake_springs.check = check\n"
        "print(*[(t.stage, t.modules) for t in run(sys.argv[1], out=sys.argv[2]).times if 'fake_late' in t.modules])"
    )
    command = [sys.executable, "-c", code, str(springs), str(tmp_path / "out")]
    done = subprocess.run(command, capture_output=True, text=True, check=True, timeout=60)
    assert done.stdout.startswith("('check', ('fake_late',))")
