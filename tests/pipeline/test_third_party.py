"""The package of docs/how-to/write-a-scene.md, installed as it stands there, run by command line and Python."""

from __future__ import annotations

import csv
import io
import math
import os
import re
import shutil
import subprocess
import sys
import tomllib
from pathlib import Path

import mpmath
import pytest

from graphsynth.pipeline.runner import execute
from graphsynth.pipeline.system import system_names

PAGE = Path(__file__).parents[2] / "docs" / "how-to" / "write-a-scene.md"
BLOCK = re.compile(r"^```(python|toml)\n(.*?)^```$", re.MULTILINE | re.DOTALL)


def block(kind: str, holding: str) -> str:
    """The one example of the page that holds a text."""
    (found,) = [
        text
        for language, text in BLOCK.findall(PAGE.read_text(encoding="utf-8"))
        if (language, holding in text) == (kind, True)
    ]
    return str(found)


@pytest.fixture
def site(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """What an installer makes of the package: modules, and metadata with the entry points of the page."""
    package = tmp_path / "site" / "my_package"
    package.mkdir(parents=True)
    (package / "__init__.py").write_text("", encoding="utf-8")
    for name, holding in (("pendulum_system", "SYSTEM"), ("pendulum", "def swing"), ("counting", "STAGE = Stage")):
        (package / f"{name}.py").write_text(block("python", holding), encoding="utf-8")
    lines = []
    for group in ("graphsynth.systems", "graphsynth.stages"):
        points = tomllib.loads(block("toml", group))["project"]["entry-points"][group]
        lines += [f"[{group}]", *(f"{name} = {value}" for name, value in points.items())]
    info = tmp_path / "site" / "my_package-1.0.dist-info"
    info.mkdir()
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: my-package\nVersion: 1.0\n", encoding="utf-8")
    (info / "entry_points.txt").write_text("\n".join(lines) + "\n", encoding="utf-8")
    monkeypatch.syspath_prepend(str(package.parent))
    monkeypatch.delitem(sys.modules, "my_package", raising=False)
    return package.parent


@pytest.fixture
def scene(tmp_path: Path) -> Path:
    path = tmp_path / "long_pendulum.toml"
    path.write_text(block("toml", "[scene]"), encoding="utf-8")
    return path


def test_packages_that_come_and_go_while_python_runs_are_noticed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.syspath_prepend(str(tmp_path))
    before = system_names()
    assert "planar" in before and "late" not in before
    info = tmp_path / "late-1.0.dist-info"
    info.mkdir()
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: late\nVersion: 1.0\n", encoding="utf-8")
    (info / "entry_points.txt").write_text("[graphsynth.systems]\nlate = late:SYSTEM\n", encoding="utf-8")
    assert set(system_names()) == {*before, "late"}
    shutil.rmtree(info)
    assert system_names() == before


def test_the_family_of_another_package_runs_from_the_command_line(site: Path, scene: Path, tmp_path: Path) -> None:
    command = [sys.executable, "-m", "graphsynth", "run", str(scene), "--out", str(tmp_path / "out"), "--explain"]
    done = subprocess.run(
        command, capture_output=True, text=True, timeout=60, env={**os.environ, "PYTHONPATH": str(site)}, check=False
    )
    assert done.returncode == 0, done.stderr
    assert "swing: nothing -> motion" in done.stdout and "numpy" not in done.stdout
    (row,) = csv.DictReader(io.StringIO((tmp_path / "out" / "results.csv").read_text(encoding="utf-8"), newline=""))
    # T = 4 sqrt(l / g) K(k), k the sine of half the swing: Legendre's form of the complete elliptic integral
    period = 4 * mpmath.sqrt(1 / mpmath.mpf("9.81")) * mpmath.ellipk(mpmath.sin(mpmath.radians(30)) ** 2)
    assert float(row["period [s]"]) == pytest.approx(float(period), rel=1e-14)
    page = (tmp_path / "out" / "report.html").read_text(encoding="utf-8")
    assert "The period is 7.32 % longer than that of small swings." in page
    assert '<td class="num">60</td><td class="num">2152.' in page  # SI values in the units of the columns


def test_it_is_small(site: Path) -> None:
    lines = [line for path in (site / "my_package").glob("*.py") for line in path.read_text("utf-8").splitlines()]
    assert len(lines) <= 300


def test_its_chart_its_evidence_and_its_stress_case(site: Path, scene: Path, tmp_path: Path) -> None:
    from graphsynth.evidence.rows import Effort
    from graphsynth.pipeline.scene import load_scene
    from graphsynth.pipeline.stages import Context, build
    from graphsynth.pipeline.system import plans_of

    scene.write_text(scene.read_text(encoding="utf-8").replace('"tables"', '"plots"'), encoding="utf-8")
    (picture,) = execute(scene)["plots"]
    assert "swing [°]" in picture.svg or "<svg" in picture.svg
    assert build(load_scene(scene)) == pytest.approx((1.0, math.radians(60.0)))
    (plan,) = plans_of("pendulum")
    (row,) = plan.load()(Context(load_scene(scene)), Effort(1, quick=True)).rows
    assert row.good and row.error < 1e-14
    cases = tmp_path / "pendulum.toml"
    cases.write_text(block("toml", "[[case]]"), encoding="utf-8")
    command = [sys.executable, "-m", "graphsynth", "stress", "--cases", str(cases)]
    done = subprocess.run(
        command, capture_output=True, text=True, timeout=60, env={**os.environ, "PYTHONPATH": str(site)}, check=False
    )
    assert done.returncode == 0, done.stdout + done.stderr


def test_its_mistakes_are_answered_like_ours(site: Path, scene: Path) -> None:
    text = scene.read_text(encoding="utf-8")
    for old, new, said in (
        ("swing_deg = 60", "swing_deg = 180", r"line 8: \[mechanism\] has swing_deg = 180.0; use more than 0"),
        ('length = "1 m"', 'length = "1 s"', r"line 7: .*which is a time"),
        ('length = "1 m"', 'lenght = "1 m"', r"line 7: .*unknown key 'lenght'; did you mean 'length"),
    ):
        scene.write_text(text.replace(old, new), encoding="utf-8")
        with pytest.raises(ValueError, match=said):
            execute(scene)


def test_a_stage_of_another_package_gives_one_more_product(site: Path, scene: Path) -> None:
    scene.write_text(scene.read_text(encoding="utf-8").replace('"tables"', '"swings_per_hour"'), encoding="utf-8")
    report = execute(scene)
    period = report["records"][0].margins[0].value
    assert report["swings_per_hour"] == pytest.approx(3600.0 / period)
    assert [stage.name for stage in report.stages] == ["swing", "assess", "count"]
