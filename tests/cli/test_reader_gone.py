"""A reader that has seen enough, as in ``graphsynth VERB | head -1``: no word on standard error, exit status 0."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from graphsynth.scenes.scene import find_scene

QUESTION = ("--mobility", "1", "--links", "6")


@pytest.fixture
def scene(tmp_path: Path) -> Path:
    """The lambda scene, of which only the integer solutions are wanted."""
    text = find_scene("lambda").read_text(encoding="utf-8")
    path = tmp_path / "solved.toml"
    path.write_text(text.split("[outputs]")[0] + '[outputs]\nproducts = ["solutions"]\n', encoding="utf-8")
    return path


@pytest.mark.parametrize(
    "command",
    [
        ("run", "SCENE"),
        ("run", "SCENE", "--json"),
        ("run", "SCENE", "--explain"),
        ("solve", *QUESTION),
        ("enumerate", *QUESTION),
        ("stress", "lambda-12.6"),
        ("schema",),
        ("--help",),
    ],
    ids=" ".join,
)
def test_a_reader_that_is_gone_is_no_error(command: tuple[str, ...], scene: Path, tmp_path: Path) -> None:
    reader, writer = os.pipe()
    os.close(reader)
    words = [str(scene) if word == "SCENE" else word for word in command]
    try:
        done = subprocess.run(
            [sys.executable, "-m", "graphsynth", *words],
            stdout=writer, stderr=subprocess.PIPE, text=True, cwd=tmp_path, timeout=120, check=False,
        )  # fmt: skip
    finally:
        os.close(writer)
    said = [line for line in done.stderr.splitlines() if not line.startswith("compiling kernels (first use only")]
    assert (done.returncode, said) == (0, [])
