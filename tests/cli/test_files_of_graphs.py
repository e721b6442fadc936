"""Files of graphs from and to the command line."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from graphsynth.cli import main
from graphsynth.formats import read, read_all
from graphsynth.structure.graph import MechanismGraph
from graphsynth.synthesis import enumerate_chains


@pytest.mark.parametrize("suffix", ["graphml", "csv", "dot", "json"])
def test_enumerate_writes_what_show_reads(suffix: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / f"eight.{suffix}"
    assert main(["enumerate", "--links", "8", "-o", str(path)]) == 0
    assert "16 graphs written" in capsys.readouterr().err
    assert list(read_all(path)) == list(enumerate_chains(8))
    assert main(["show", str(path), "--line", "5", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["key"] == list(enumerate_chains(8))[4].key
    assert main(["show", str(path), "--line", "17"]) == 2
    assert "graph 17 does not exist, the file has 16" in capsys.readouterr().err
    assert main(["enumerate", "--links", "8", "-o", str(path)]) == 2
    assert "exists; choose another name, or replace it with --force" in capsys.readouterr().err
    assert main(["enumerate", "--links", "6", "-o", str(path), "--force"]) == 0
    assert len(list(read_all(path))) == 2


def test_what_enumerate_cannot_write(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["enumerate", "--links", "8", "-o", str(tmp_path / "x.adj")]) == 2
    assert ".adj holds one graph" in capsys.readouterr().err
    assert main(["enumerate", "--links", "8", "-o", str(tmp_path / "x.dot"), "--resume"]) == 2
    assert "written in one piece" in capsys.readouterr().err
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("suffix", ["graphml", "adj", "inc", "edges", "csv", "json", "jsonl", "g6", "tikz", "dxf"])
def test_show_converts(suffix: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    if suffix == "dxf":
        pytest.importorskip("ezdxf")
    path = tmp_path / f"x.{suffix}"
    assert main(["show", "Cl f0 2:0-3", "-o", str(path)]) == 0
    assert path.stat().st_size > 0
    if suffix not in ("tikz", "dxf"):
        assert read(path) == MechanismGraph.from_text("Cl f0 2:0-3")
        capsys.readouterr()
        assert main(["show", str(path), "--json"]) == 0
        assert json.loads(capsys.readouterr().out)["text"] == "Cl f0 2:0-3"


def test_an_unreadable_file_is_one_sentence(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "x.graphml"
    path.write_text("<!DOCTYPE x><graphml/>")
    assert main(["show", str(path)]) == 2
    said = capsys.readouterr().err
    assert "x.graphml" in said and "document type declaration" in said and said.count("\n") == 1
