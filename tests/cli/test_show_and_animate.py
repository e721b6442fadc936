"""``graphsynth show`` and ``graphsynth animate``: pictures of any candidate from the command line."""

from __future__ import annotations

import json
import math
import re
import xml.etree.ElementTree as ET
from functools import cache
from pathlib import Path

import pytest

from graphsynth.cli import main
from graphsynth.mechanism.joints import Revolute
from graphsynth.mechanism.laws import Driver
from graphsynth.mechanism.model import Mechanism
from graphsynth.structure.graph import MechanismGraph
from graphsynth.structure.multiple_joints import MultipleJointChain
from graphsynth.synthesis import enumerate_chains, enumerate_multiple_joint_chains

CYCLE = MechanismGraph(4, [(0, 1), (1, 2), (2, 3), (0, 3)], frame=0)
PLATFORM = "N}o__QC_cA?C?C?A??w f0 2:1-2,1-3,1-4"


@cache
def eight(index: int) -> MechanismGraph:
    return list(enumerate_chains(8))[index]


def four_bar(frame: float, crank: float, coupler: float, rocker: float) -> Mechanism:
    joints = [
        Revolute(0, 1), Revolute(1, 2, (crank, 0.0)), Revolute(2, 3, (coupler, 0.0), (rocker, 0.0)),
        Revolute(0, 3, (frame, 0.0)),
    ]  # fmt: skip
    return Mechanism(CYCLE, joints, [Driver(0, 1)])


def parts(path: Path) -> list[str]:
    return [e.get("data-part", "") for e in ET.parse(path).getroot().iter() if e.get("data-part")]


# --- show


@pytest.mark.parametrize("index", [0, 7, 15])
@pytest.mark.parametrize("view", ["diagram", "levels", "both"])
def test_show_draws_every_view(index: int, view: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "x.svg"
    assert main(["show", eight(index).key, "-o", str(path), "--view", view]) == 0
    joints = sum(part.startswith("joint") for part in parts(path))
    edges = len(re.findall(r'd="M\S+ \S+ Q', path.read_text()))
    assert joints == (0 if view == "levels" else 10)
    assert edges == (0 if view == "diagram" else 10)


def test_show_draws_the_diagram_by_default_and_the_driver(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "x.svg"
    assert main(["show", PLATFORM, "--driver", "1", "-o", str(path)]) == 0
    found = parts(path)
    assert sum(part.startswith("slot") for part in found) == 3
    assert any(part == "driver 0-1" for part in found)


@pytest.mark.long
@pytest.mark.parametrize(("name", "magic"), [("x.png", b"\x89PNG"), ("x.pdf", b"%PDF")])
def test_show_writes_through_matplotlib(
    name: str, magic: bytes, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["show", eight(0).key, "-o", str(tmp_path / name), "--view", "both"]) == 0
    assert (tmp_path / name).read_bytes().startswith(magic)


@pytest.mark.parametrize("asked", ["--sliders 1 --frame", "--multiple-joints any", "--gear-trains"])
@pytest.mark.parametrize("name", ["a.txt", "a.jsonl"])
def test_show_reads_lists_of_chains_with_other_joints(
    asked: str, name: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path, picture = tmp_path / name, tmp_path / "x.svg"
    assert main(["enumerate", "--links", "6", *asked.split(), "-o", str(path)]) == 0
    assert main(["enumerate", "--links", "6", *asked.split()]) == 0
    second = capsys.readouterr().out.splitlines()[1]
    assert main(["show", str(path), "--line", "2", "-o", str(picture), "--json"]) == 0
    by_line = capsys.readouterr().out
    assert main(["show", second, "--json"]) == 0
    assert json.loads(by_line)["key"] == json.loads(capsys.readouterr().out)["key"]
    assert "<svg" in picture.read_text()
    assert main(["show", str(path), "--line", "999"]) == 2


def test_show_tells_modes_and_mobility_of_multiple_joints(capsys: pytest.CaptureFixture[str]) -> None:
    chain = MultipleJointChain.from_joints(6, [(0, 1), (1, 2), (2, 3), (2, 5), (4, 5), (0, 3, 4)], frame=0)
    assert main(["show", chain.to_text()]) == 0
    told = " ".join(capsys.readouterr().out.split())  # lines are broken at the width of the terminal
    assert "4 at most with driver 1, 4 at most with driver 3, 6 at most with driver 4" in told
    assert main(["show", next(enumerate_multiple_joint_chains(9, 2)).key]) == 0
    assert "type of mobility" in capsys.readouterr().out


def test_animate_moves_sliders_and_refuses_multiple_joints(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path, kept = tmp_path / "x.svg", tmp_path / "x.toml"
    assert main(["animate", "Cl f0 P:0-3", "-o", str(path), "--save", str(kept), "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["text"] == "Cl f0 P:0-3"
    assert [joint.kind for joint in Mechanism.from_toml(kept.read_text()).joints].count("P") == 1
    assert main(["animate", "FCSv? m1", "-o", str(path)]) == 2
    assert "dimensions are found for chains of simple joints" in capsys.readouterr().err


def test_show_falls_back_to_levels_and_says_so(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    spatial = MechanismGraph(4, [(0, 1), (1, 2, 3), (2, 3), (0, 3)], frame=0, space=6).key
    path = tmp_path / "x.svg"
    assert main(["show", spatial, "-o", str(path)]) == 0
    assert "drawn by levels instead" in capsys.readouterr().err and path.exists()
    assert main(["show", spatial, "-o", str(path), "--view", "diagram"]) == 2
    assert "only planar graphs" in capsys.readouterr().err


def test_lines_break_between_words_where_the_terminal_ends(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    mechanism = eight(0).with_frame(0).to_text()
    monkeypatch.delenv("COLUMNS", raising=False)
    assert main(["show", mechanism]) == 0
    whole = capsys.readouterr().out
    monkeypatch.setenv("COLUMNS", "50")
    assert main(["show", mechanism]) == 0
    broken = capsys.readouterr().out
    assert max(map(len, whole.splitlines())) > 80 and max(map(len, broken.splitlines())) <= 50
    assert whole.split() == broken.split()
    assert main(["show", "no/such.g6"]) == 2
    said = capsys.readouterr().err  # one line, which programs read
    assert "nor is this a key or the text form" in said and said.count("\n") == 1


def test_show_refuses_another_suffix(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["show", eight(0).key, "-o", str(tmp_path / "x.bmp")]) == 2
    assert "must end in .svg, .png, .pdf, .tikz, .tex, .dxf, .g6" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["missing.g6"], "missing.g6: there is no such file"),
        (["./nothing"], "there is no such file"),
        (["."], "there is no such file"),
        (["Cl f0", "--driver", "9"], "driver 9 is not jointed to the frame"),
        (["Cl f0", "--driver", "2"], "driver 2 is not jointed to the frame"),
        (["Cl f0", "--driver", "-1"], "not jointed to the frame"),
        (["Cl f0", "-o", "no/x.svg"], "the folder no does not exist"),
        (["Cl f0", "-o", "x.bmp"], "must end in"),
        (["Cl f0", "-o", "folder.svg"], "is a folder"),
        (["a.jsonl"], "needs the key 'joints'"),
    ],
)
def test_show_tells_bad_input_in_one_sentence(
    words: list[str], message: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Status 2, one sentence, and nothing on standard output that looks like a result."""
    monkeypatch.chdir(tmp_path)
    Path("a.jsonl").write_text('{"links": 4}')
    Path("folder.svg").mkdir()
    assert main(["show", *words]) == 2
    said = capsys.readouterr()
    assert message in said.err and said.err.count("\n") == 1 and said.out == ""


# --- animate


@pytest.mark.long
def test_animate_a_chain_by_its_key(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path, kept = tmp_path / "x.html", tmp_path / "m.toml"
    words = ["animate", eight(5).key, "-o", str(path), "--save", str(kept), "--frames", "60"]
    assert main([*words, "--json"]) == 0
    said = json.loads(capsys.readouterr().out)
    assert said["accepted"] and said["completed"] and said["closed"]
    assert said["transmission_angle"] >= math.radians(25) - 1e-6 and said["residual"] < 1e-9
    data = json.loads(re.search(r'id="data" type="application/json">(.*?)</script>', path.read_text())[1])  # type: ignore[index]
    assert data["count"] == 61 and data["loop"] and len(data["poses"]) == 8
    # what was kept is the mechanism that was shown
    assert main(["animate", str(kept), "-o", str(tmp_path / "again.html"), "--json"]) == 0
    again = json.loads(capsys.readouterr().out)
    assert again["closed"] and again["links"] == 8 and Mechanism.from_toml(kept.read_text()).graph.links == 8
    # and the same seed finds the same
    assert main([*words[:2], "-o", str(tmp_path / "second.html"), "--frames", "60"]) == 0
    assert (tmp_path / "second.html").read_bytes() == path.read_bytes()
    assert "smallest transmission angle" in capsys.readouterr().out


@pytest.mark.slow
@pytest.mark.parametrize("index", range(16))
def test_animate_every_eight_link_chain_and_inversion(
    index: int, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    for k, graph in enumerate([eight(index), *eight(index).inversions()]):
        path = tmp_path / f"{k}.html"
        assert main(["animate", graph.key, "-o", str(path), "--json"]) == 0
        said = json.loads(capsys.readouterr().out)
        assert said["accepted"] and said["closed"], (graph.key, said["statement"])


@pytest.mark.long
def test_animate_a_part_of_a_turn_says_why(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = tmp_path / "rocker.toml"
    file.write_text(four_bar(2, 1, 1, 1).to_toml())
    for suffix in ("html", "svg", "gif"):
        path = tmp_path / f"x.{suffix}"
        assert main(["animate", str(file), "-o", str(path), "--frames", "10"]) == 0
        out = capsys.readouterr().out
        assert "not a full rotation" in out and "stretched or folded" in out and path.stat().st_size > 1000
    assert "at the other end" in (tmp_path / "x.html").read_text()
    assert main(["animate", str(file), "--range", "0", "1", "-o", str(path), "--frames", "10", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["completed"] is True


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["Cl f0", "-o", "x.mp4"], "must end in .html, .gif or .svg"),
        (["Cl f0", "-o", "x.html", "--save", "m.txt"], "must end in .toml or .json"),
        (["Cl f0", "-o", "x.html", "--frames", "1"], "frames = 1 must be from 2 to 2000"),
        (
            ["Cl f0", "-o", "x.html", "--driver", "2"],
            "--driver 2: the link is not jointed to the frame",
        ),
        (["Cl f0", "-o", "x.html", "--driver", "9"], "choose from 1, 3"),
        (["Cl f0", "-o", "x.html", "--driver", "0"], "choose from 1, 3"),
        (["Cl f0", "-o", "x.html", "--driver", "1", "--driver", "1"], "given twice"),
        (["Cl f0", "-o", "x.html", "--driver", "1", "--driver", "3"], "2"),
        (["Cl", "-o", "x.html", "--driver", "1"], "choose a frame first"),
        (["Cl f0", "-o", "no/x.html"], "the folder no does not exist"),
        (["Cl f0", "-o", "x.html", "--save", "no/m.toml"], "the folder no does not exist"),
        (["missing.toml", "-o", "x.html"], "missing.toml: there is no such file"),
        (["no/such/file", "-o", "x.html"], "no/such/file: there is no such file"),
        (["bad.toml", "-o", "x.html"], "bad.toml"),
        (["Cl f0", "-o", "x.html", "--seed", "-1"], "seed = -1"),
        (["Cl f0", "-o", "x.html", "--range", "0", "1"], "--range belongs to a dimensioned mechanism"),
        (["bad.toml", "-o", "x.html"], "not TOML"),
        (["apart.toml", "-o", "x.html"], "cannot be assembled at any of 24 inputs"),
        (["apart.toml", "-o", "x.html", "--range", "0", "1"], "nothing of the motion is assembled"),
        (["apart.toml", "-o", "x.html", "--range", "1", "1"], "strictly"),
        (["apart.toml", "-o", "x.html", "--range", "0", "nan"], "inputs"),
        (["apart.toml", "-o", "x.html", "--driver", "1"], "names its drivers in its file"),
    ],
)
def test_animate_tells_bad_input_in_one_sentence(
    words: list[str], message: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("bad.toml").write_text("this is = not [toml")
    Path("apart.toml").write_text(four_bar(9, 1, 1, 1).to_toml())
    assert main(["animate", *words]) == 2
    said = capsys.readouterr()
    assert message in said.err and said.err.count("\n") == 1 and "Traceback" not in said.err
    assert not Path("x.html").exists()
