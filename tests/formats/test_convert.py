"""``graphsynth convert``: files, pipes, and one sentence for whatever cannot be done."""

from __future__ import annotations

import io
import json
import sys
from itertools import pairwise
from pathlib import Path

import pytest

from graphsynth.cli import main
from graphsynth.formats import read, read_all, write
from graphsynth.mechanism.joints import Revolute
from graphsynth.mechanism.model import Mechanism
from graphsynth.structure.graph import MechanismGraph
from graphsynth.synthesis import enumerate_chains


def test_files_and_back(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    chains = list(enumerate_chains(6))
    names = ["a.g6", "a.csv", "a.graphml", "a.dot", "a.json", "a.jsonl"]
    write(chains, tmp_path / names[0])
    for one, other in pairwise(names):
        assert main(["convert", str(tmp_path / one), "-o", str(tmp_path / other)]) == 0
        assert "2 written to" in capsys.readouterr().err
    assert list(read_all(tmp_path / names[-1])) == chains
    assert main(["convert", str(tmp_path / "a.g6"), "-o", str(tmp_path / "b.x"), "--to", "graph6", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["count"] == 2


def test_pipes(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    monkeypatch.setattr(sys, "stdin", io.TextIOWrapper(io.BytesIO(b"Bw\nCl f0\n")))
    assert main(["convert", "-", "--from", "text", "-o", "-", "--to", "jsonl"]) == 0
    assert [json.loads(line)["links"] for line in capsys.readouterr().out.splitlines()] == [3, 4]


def test_a_mechanism_and_its_graph(tmp_path: Path) -> None:
    bar = Mechanism(MechanismGraph(2, [(0, 1)], frame=0), [Revolute(0, 1, (0.1, 0.2))])
    write(bar, tmp_path / "a.toml")
    assert main(["convert", str(tmp_path / "a.toml"), "-o", str(tmp_path / "a.dot")]) == 0
    assert read(tmp_path / "a.dot") == bar
    assert main(["convert", str(tmp_path / "a.toml"), "-o", str(tmp_path / "a.g6"), "--graphs"]) == 0
    assert read(tmp_path / "a.g6") == bar.graph


@pytest.mark.parametrize(
    ("source", "arguments", "said"),
    [
        ("a.g6", ["-o", "b.dat"], "the suffix '.dat' names no format"),
        ("a.g6", ["-o", "a.g6"], "exists; choose another name, or replace it with --force"),
        ("a.g6", ["-o", "none/b.csv"], "does not exist; make it first"),
        ("a.g6", ["-o", "."], "is a folder; name a file"),
        ("a.g6", ["-o", "b.adj"], "adjacency holds one graph in a file"),
        ("a.g6", ["-o", "b.toml"], "TOML holds dimensioned mechanisms"),
        ("a.g6", ["-o", "b.csv", "--from", "json"], "a.g6: line 1, column 1: not JSON"),
        ("a.g6", ["-o", "b.csv", "--from", "xyz"], "format 'xyz' is unknown"),
        ("a.g6", ["-o", "-"], "a pipe has no suffix: give its format with --to"),
        ("wrong.graphml", ["-o", "b.g6"], "wrong.graphml: line 1, column 1: not XML"),
        ("empty.g6", ["-o", "b.g6"], "holds no graph; nothing is written"),
        ("none.g6", ["-o", "b.csv"], "No such file"),
        ("folder.g6", ["-o", "b.csv"], "Is a directory"),
    ],
)
def test_what_cannot_be_done_is_one_sentence(
    source: str, arguments: list[str], said: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:  # fmt: skip
    monkeypatch.chdir(tmp_path)
    Path("a.g6").write_text("Bw\nCl\n")
    Path("wrong.graphml").write_text("Bw\n")
    Path("empty.g6").write_text("\n")
    Path("folder.g6").mkdir()
    before = sorted(path.name for path in tmp_path.iterdir())
    assert main(["convert", source, *arguments]) == 2
    captured = capsys.readouterr()
    assert said in captured.err and captured.err.count("\n") == 1 and not captured.out
    assert sorted(path.name for path in tmp_path.iterdir()) == before
