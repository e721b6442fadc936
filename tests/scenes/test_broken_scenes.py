"""Broken scene files: one clear sentence each, exit status 2, whatever the bytes."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from graphsynth.cli.main import main
from graphsynth.scenes.scene import find_scene

LAMBDA = find_scene("lambda").read_text(encoding="utf-8")


def changed(old: str, new: str, text: str = LAMBDA) -> bytes:
    assert old in text
    return text.replace(old, new).encode()


BEARING = 1 + LAMBDA.splitlines().index("[mechanism.bearing]")
DEEP = "x = " + "[" * 100_000
BROKEN: dict[str, tuple[bytes, str]] = {
    "empty": (b"", r"lacks the table \[scene\]"),
    "binary junk": (bytes(range(256)) * 8, r"byte 128: not UTF-8 text; save the scene as UTF-8"),
    "zero bytes": (b"\0" * 1000, r"not TOML: .*line 1"),
    "an executable": (b"\x7fELF\x02\x01\x01" + b"\x90" * 500, r"not UTF-8|not TOML"),
    "UTF-16": ("﻿[scene]\nname = 'x'".encode("utf-16"), r"not UTF-8"),
    "two megabytes": (b"# x\n" * 500_000, r"more than 1048576 bytes; a scene is a short text"),
    "JSON": (b'{"scene": {"name": "x"}}', r"not TOML.*line 1"),
    "deeply nested": (DEEP.encode(), r"not TOML"),
    "key given twice": (changed('name = "lambda"', 'name = "lambda"\nname = "lambda"'), r"not TOML.*line 5"),
    "table given twice": (LAMBDA.encode() + b"\n[scene]\n", r"not TOML.*line \d+"),
    "unknown table": (
        LAMBDA.encode() + b"\n[colours]\nx = 1\n",
        r"NEXT has an unknown table \[colours\]; known are",
    ),
    "misspelt key": (
        changed("radius_mm = 17.5", "radiu_mm = 17.5"),
        r"LINE: .*unknown key 'radiu_mm'; did you mean",
    ),
    "missing key": (
        changed("height_mm = 10\n", ""),
        rf"line {BEARING}: \[mechanism.bearing\] lacks the key 'height_mm'",
    ),
    "wrong type": (changed("positions = 360", 'positions = "many"'), r"LINE: .* must be an integer, not 'many'"),
    "a list for a number": (changed("height_mm = 10", "height_mm = [10]"), r"must be a finite number in mm"),
    "a date for a number": (changed("height_mm = 10", "height_mm = 1979-05-27"), r"must be a finite number in mm"),
    "wrong unit": (
        changed("height_mm = 10", 'height_mm = "10 deg"'),
        r"LINE: .*a length such as.*which is an angle",
    ),
    "unknown unit": (changed("height_mm = 10", 'height_mm = "10 furlong"'), r"nobody knows the unit 'furlong'"),
    "not a number": (changed("height_mm = 10", "height_mm = nan"), r"LINE: .*must be a finite number"),
    "infinite": (changed("height_mm = 10", "height_mm = -inf"), r"LINE: .*must be a finite number"),
    "huge number": (changed("height_mm = 10", "height_mm = 1e999"), r"LINE: .*must be a finite number"),
    "huge integer": (changed("height_mm = 10", "height_mm = 1" + "0" * 400), r"LINE: .*must be a finite number"),
    "integer of 5000 digits": (changed("height_mm = 10", "height_mm = " + "9" * 5000), r"not TOML"),
    "huge count": (changed("positions = 360", "positions = 99999999999999"), r"LINE: .* use 8 to 1000000"),
    "negative": (changed("radius_mm = 17.5", "radius_mm = -1"), r"LINE: .*radius_mm = -1.0; it must be positive"),
    "unknown product": (
        changed('"plots"', '"plot"'),
        r"LINE: \[outputs.products\] asks for 'plot'.*did you mean 'plots'",
    ),
    "no product": (changed("products = [", "products = [] # ["), r"LINE: .*products = \[\]; name at least one"),
    "unknown family": (changed('"lambda_linkage"', '"lambda-linkage"'), r"LINE: .*did you mean 'lambda_linkage'"),
    "unknown variable": (changed("links = 4", "lniks = 4"), r"LINE: \[structure.question\] cannot be read: .*lniks"),
    "infeasible question": (changed("links = 4", "links = 5"), r"no integer solution: .* clash .*; free or change"),
    "too many candidates": (
        changed("[mechanism]\n", "[structure.generate]\nlimit = 3\n[mechanism]\n").replace(b"links = 4", b"links = 8"),
        r"limit = 3 mechanisms; raise the limit",
    ),
    "question and graphs": (
        changed("[structure.question]", "[structure]\ngraphs=['x']\n[structure.question]"),
        "either",
    ),
    "junk graph": (
        re.sub(r"\[structure.question\][^\[]*", "[structure]\ngraphs = ['junk!']\n\n", LAMBDA)
        .replace('"solutions", ', "")
        .encode(),
        r"\[structure.graphs.0\] is neither a canonical key nor the text form of a graph",
    ),
    "name leads elsewhere": (changed('name = "lambda"', 'name = "../../x"'), r"LINE: .*names a folder"),
    "tolerance of nothing": (changed('crank = "0.01 %"', 'crnk = "0.01 %"'), r"LINE: .*unknown key 'crnk'"),
    "tolerance below zero": (changed("height_mm = 0.05", "height_mm = -0.05"), r"LINE: .*zero or more"),
    "budget of nothing": (
        LAMBDA.encode() + b"[budget]\ntime_s = 0\n",
        r"NEXT: \[budget\] has time_s = 0.0; it must be",
    ),
    "cycle of stages": (changed('"plots"', '"loop_a"'), r"stages need each other: loop a -> loop b -> loop a"),
    "broken family": (changed('"lambda_linkage"', '"broken_family"'), r"this installation does not have it"),
    "not a family": (changed('"lambda_linkage"', '"not_a_family"'), r"is no Family but Stage"),
    "too little time": (
        LAMBDA.encode() + b"[budget]\ntime = '1 us'\n",
        r"\[budget\] stops the run before stage 'solve'",
    ),
}


@pytest.mark.parametrize("name", sorted(BROKEN))
def test_a_broken_scene_is_answered_with_one_sentence(
    name: str, tmp_path: Path, fake: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    data, message = BROKEN[name]
    path = tmp_path / "broken.toml"
    path.write_bytes(data)
    before, after = LAMBDA.splitlines(), data.decode(errors="replace").splitlines()
    first = next((i for i, (a, b) in enumerate(zip(before, after), 1) if a != b), len(before) + 1)
    message = message.replace("LINE", f"line {first}").replace("NEXT", f"line {first + 1}")
    assert main(["run", str(path), "--out", str(tmp_path / "out")]) == 2
    said = capsys.readouterr()
    assert said.out == ""
    lines = said.err.strip().splitlines()
    assert len(lines) == 1 and lines[0].startswith("graphsynth: ") and "Traceback" not in said.err
    assert re.search(message, lines[0]), lines[0]
    assert len(lines[0]) < 500
    assert not (tmp_path / "out" / "report.html").exists()


def test_more_than_thirty() -> None:
    assert len(BROKEN) >= 30


@pytest.mark.parametrize("what", ["folder", "missing", "not toml by name"])
def test_what_is_no_file(what: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / {"folder": "x.toml", "missing": "y.toml", "not toml by name": "z.txt"}[what]
    if what == "folder":
        path.mkdir()
    if what == "not toml by name":
        path.write_text(LAMBDA, encoding="utf-8")
    assert main(["run", str(path)]) == 2
    assert "neither the path of a .toml file nor one of the shipped scenes" in capsys.readouterr().err


def test_an_unreadable_folder_for_the_report(tmp_path: Path, capsys: pytest.CaptureFixture[str], springs: Path) -> None:
    (tmp_path / "taken").write_text("x", encoding="utf-8")
    assert main(["run", str(springs), "--out", str(tmp_path / "taken")]) == 2
    assert "choose another folder with --out" in capsys.readouterr().err
