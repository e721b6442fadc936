"""A reader that has seen enough, as in ``graphsynth VERB | head -1``: no word on standard error, exit status 0.

Python keeps what is written to a pipe until the end, unless PYTHONUNBUFFERED is set: both are tried.
"""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Iterator, Sequence
from pathlib import Path

import pytest

from graphsynth.pipeline.scene import find_scene

from ..telling import said

QUESTION = ("--mobility", "1", "--links", "6")


@pytest.fixture
def scene(tmp_path: Path) -> Path:
    """The lambda scene, of which only the integer solutions are wanted."""
    text = find_scene("lambda").read_text(encoding="utf-8")
    path = tmp_path / "solved.toml"
    path.write_text(text.split("[outputs]")[0] + '[outputs]\nproducts = ["solutions"]\n', encoding="utf-8")
    return path


def started(
    words: Sequence[str], folder: Path, *, buffered: bool, stdout: int = subprocess.PIPE, stderr: int = subprocess.PIPE
) -> subprocess.CompletedProcess[str]:
    own = {name: value for name, value in os.environ.items() if name != "PYTHONUNBUFFERED"}
    return subprocess.run(
        [sys.executable, "-m", "graphsynth", *words],
        stdout=stdout,
        stderr=stderr,
        text=True,
        cwd=folder,
        timeout=120,
        check=False,
        env=own if buffered else own | {"PYTHONUNBUFFERED": "1"},
    )


@pytest.fixture
def gone() -> Iterator[int]:
    """A pipe that nobody reads."""
    reader, writer = os.pipe()
    os.close(reader)
    yield writer
    os.close(writer)


both = pytest.mark.parametrize("buffered", [True, False], ids=["buffered", "unbuffered"])


@both
@pytest.mark.parametrize(
    "command",
    [
        ("run", "SCENE"),
        ("run", "SCENE", "--json"),
        ("run", "SCENE", "--explain"),
        ("solve", *QUESTION),
        ("enumerate", *QUESTION),
        pytest.param(("stress", "lambda-12.6"), marks=pytest.mark.slow),
        ("schema",),
        ("--help",),
        ("--version",),
        ("catalog", "build", "--help"),
    ],
    ids=" ".join,
)
def test_a_reader_that_is_gone_is_no_error(
    command: tuple[str, ...], buffered: bool, scene: Path, tmp_path: Path, gone: int
) -> None:
    words = [str(scene) if word == "SCENE" else word for word in command]
    done = started(words, tmp_path, buffered=buffered, stdout=gone)
    assert (done.returncode, said(done.stderr)) == (0, [])


@pytest.mark.long
@both
@pytest.mark.parametrize("words", [("nonsense",), ("show", "nonsense")], ids=" ".join)
def test_an_error_that_nobody_reads_keeps_its_status(
    words: tuple[str, ...], buffered: bool, tmp_path: Path, gone: int
) -> None:
    assert started(words, tmp_path, buffered=buffered, stderr=gone).returncode == 2
    assert started(words, tmp_path, buffered=buffered, stdout=gone, stderr=gone).returncode == 2


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="no device that is always full")
@pytest.mark.parametrize("words", [("--version",), ("solve", "--help"), ("solve", *QUESTION)], ids=" ".join)
def test_a_full_device_is_one_sentence(words: tuple[str, ...], tmp_path: Path) -> None:
    with Path("/dev/full").open("wb") as full:
        done = started(words, tmp_path, buffered=True, stdout=full.fileno())
    assert (done.returncode, len(said(done.stderr))) == (2, 1)
    assert "standard output: No space left on device: free some space" in done.stderr


@pytest.mark.skipif(os.name != "posix", reason="closes streams as a shell of Unix does")
def test_streams_that_are_closed(tmp_path: Path) -> None:
    """No file of the program gets the number of a stream: what is printed would go into it."""
    (tmp_path / "a.g6").write_text("C]\n")
    command = f'"{sys.executable}" -m graphsynth convert a.g6 -o b.g6 >&- 2>&- <&-'
    assert subprocess.run(command, shell=True, cwd=tmp_path, timeout=120, check=False).returncode == 0
    assert (tmp_path / "b.g6").read_text() == "C]\n"
