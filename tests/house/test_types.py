"""What a user's type checker sees of the public names."""

from __future__ import annotations

import ast
import os
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

pytest.importorskip("mypy")

ROOT = Path(__file__).parents[2]
DEBTS = tomllib.loads(Path(__file__).with_name("debts.toml").read_text(encoding="utf-8"))


def public_names() -> list[str]:
    """Every name of every stub, in full."""
    found = []
    for stub in sorted((ROOT / "graphsynth").rglob("__init__.pyi")):
        package = ".".join(stub.parent.relative_to(ROOT).parts)
        tree = ast.parse(stub.read_text(encoding="utf-8"))
        found += [f"{package}.{a.name}" for n in tree.body if isinstance(n, ast.ImportFrom) for a in n.names]
    return found


def checked(text: str, folder: Path) -> list[str]:
    """Return what mypy says of a script of a user, line by line, strictly."""
    path = folder / "script.py"
    path.write_text(text, encoding="utf-8")
    command = [sys.executable, "-m", "mypy", "--strict", "--config-file", str(ROOT / "pyproject.toml"), str(path)]
    cache = {"MYPY_CACHE_DIR": str(ROOT / ".mypy_cache")}
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, env={**os.environ, **cache}, timeout=600)
    assert "INTERNAL ERROR" not in done.stderr, done.stderr
    return done.stdout.splitlines()


@pytest.mark.long
def test_every_public_name_has_a_type(tmp_path: Path) -> None:
    names = public_names()
    packages = sorted({name.rpartition(".")[0] for name in names})
    lines = [f"import {package}" for package in packages] + [f"reveal_type({name})" for name in names]
    said = [line for line in checked("\n".join(lines) + "\n", tmp_path) if "script.py" in line]
    revealed = [line.partition("Revealed type is ")[2].strip('"') for line in said if "Revealed type" in line]
    assert len(revealed) == len(names) > 250
    untyped = [name for name, text in zip(names, revealed) if text == "Any" or text.endswith("-> Any")]
    assert len(untyped) <= DEBTS.get("untyped_public_names", 0), "\n".join(untyped)
    assert [line for line in said if ": error:" in line] == []


@pytest.mark.long
def test_a_wrong_call_is_seen(tmp_path: Path) -> None:
    said = checked('import graphsynth as gs\n\nx: str = gs.count_chains("twelve", nonsense=3)\n', tmp_path)
    assert sum(": error:" in line and "script.py" in line for line in said) >= 2, said
    assert any("str" in line for line in said) and any("nonsense" in line for line in said)


@pytest.mark.long
def test_angles_are_given_as_texts_and_read_as_numbers(tmp_path: Path) -> None:
    said = checked(
        """from graphsynth.design import DesignTask, DwellTarget, PathTarget, PosesTarget, SwingTarget

path = PathTarget(points=[(0, 0), (1, 1)], inputs=["0 deg", 1.0])
poses = PosesTarget(poses=[(0, 0, "3 deg"), (1, 1, 0.1)])
task = DesignTask(targets=[path, poses, SwingTarget(most="40 deg")], transmission="30 deg", misalignment="1 deg")
reveal_type(task.transmission)
reveal_type(task.misalignment)
reveal_type(path.inputs)
reveal_type(poses.poses[0][2])
reveal_type(DwellTarget(span="40 deg").span)
DesignTask(targets=[], transmission=[30])
""",
        tmp_path,
    )
    said = [line for line in said if "script.py" in line]
    kept = [line.partition("Revealed type is ")[2].strip('"').replace("builtins.", "") for line in said[:5]]
    assert kept == ["float", "float | None", "tuple[float, ...] | None", "float", "float"]
    assert len(said) == 6 and "transmission" in said[5] and ": error:" in said[5]
