"""Broken scene files: one clear sentence each, exit status 2, whatever the bytes."""

from __future__ import annotations

import os
import re
import time
from pathlib import Path

import pytest

from graphsynth.cli.main import main
from graphsynth.pipeline.scene import find_scene, load_scene

from ..telling import said

LAMBDA = find_scene("lambda").read_text(encoding="utf-8")
SURVEY = find_scene("four_bar_survey").read_text(encoding="utf-8")
SEARCH = find_scene("eight_link_search").read_text(encoding="utf-8")


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
    "unknown unit": (changed("height_mm = 10", 'height_mm = "10 furlong"'), r"unknown unit 'furlong'"),
    "not a number": (changed("height_mm = 10", "height_mm = nan"), r"LINE: .*must be a finite number"),
    "infinite": (changed("height_mm = 10", "height_mm = -inf"), r"LINE: .*must be a finite number"),
    "huge number": (changed("height_mm = 10", "height_mm = 1e999"), r"LINE: .*must be a finite number"),
    "huge integer": (changed("height_mm = 10", "height_mm = 1" + "0" * 400), r"LINE: .*must be a finite number"),
    "integer of 5000 digits": (changed("height_mm = 10", "height_mm = " + "9" * 5000), r"not TOML"),
    "too high": (
        changed("height_mm = 10", "height_mm = 1e308"),
        r"LINE: .*is 1e\+308, .* 0 or a size from 1e-30 to 1e\+18 mm",
    ),
    "too high in metres": (changed("height_mm = 10", 'height = "1e16 m"'), r"LINE: .*is '1e16 m', .* to 1e\+18 mm"),
    "hardly any height": (changed("height_mm = 10", "height_mm = 5e-324"), r"LINE: .*is 5e-324, .* 0 or a size from"),
    "tolerance beyond the length": (
        changed('crank = "0.01 %"', 'crank = "1e300 %"'),
        r"LINE: \[mechanism.tolerances\] has crank = '1e300 %', so that l2 = .* must be positive; correct",
    ),
    "tolerance beyond the hole": (
        changed("clearance_mm = 0.003", "clearance_mm = 20"),
        r"LINE: \[mechanism.tolerances\] has clearance_mm = 20, so that clearance = .* leaves no hole",
    ),
    "text for a number of links": (
        changed("links = 4", 'links = "4"'),
        r'LINE: \[structure.question\] .*links = "4" is text; write the number without quotes: 4',
    ),
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
    "not a family": (changed('"lambda_linkage"', '"not_a_family"'), r"is no System but Stage"),
    "too little time": (
        LAMBDA.encode() + b"[budget]\ntime = '1 us'\n",
        r"\[budget\] stops the run before stage 'solve'",
    ),
    # numbers that are none, and numbers nobody can mean
    "1e400 with a unit": (changed("height_mm = 10", 'height_mm = "1e400 mm"'), r"LINE: .*must be a finite number"),
    "exponent of nine digits": (changed("height_mm = 10", 'height_mm = "1e999999999 mm"'), r"LINE: .*must be a finite"),
    "nan as text": (changed("height_mm = 10", 'height_mm = "nan"'), r"LINE: .*must be a finite number"),
    "nan in a list": (changed("axis = [1, 0, 0]", "axis = [nan, 0, 0]"), r"axis.0\] must be a finite number"),
    "fraction of nothing": (changed('"1/30"', '"1/0"'), r"LINE: .*must be a finite number in rad"),
    "full-width digits": (changed("height_mm = 10", 'height_mm = "１０ mm"'), r"LINE: .*must be a finite number in mm"),
    "bare full-width digits": (changed("height_mm = 10", "height_mm = １０"), r"not TOML: .*line 35"),
    "Arabic digits": (changed("height_mm = 10", 'height_mm = "١٠ mm"'), r"LINE: .*must be a finite number in mm"),
    "a date for a count": (
        changed("positions = 360", "positions = 1979-05-27"),
        r"an integer, not the date 1979-05-27",
    ),
    "a time for a count": (changed("positions = 360", "positions = 07:32:00"), r"an integer, not the time 07:32:00"),
    "negative count": (changed("positions = 360", "positions = -5"), r"LINE: .*positions = -5; use 8 to 1000000"),
    "true for a count": (changed("positions = 360", "positions = true"), r"LINE: .*must be an integer, not True"),
    "a count with a point": (changed("positions = 360", "positions = 360.0"), r"LINE: .*must be an integer, not 360.0"),
    "a thousand million links": (changed("links = 4", "links = 1000000000"), r"LINE: .*between 2 and 10000"),
    "links of thirty digits": (changed("links = 4", "links = 1" + "0" * 30), r"LINE: .*between 2 and 10000"),
    "negative seed": (changed('name = "lambda"', 'name = "lambda"\nseed = -1'), r"line 5: .*seed = -1; use 0 to"),
    "time in bytes": (LAMBDA.encode() + b"[budget]\ntime = '1 GB'\n", r"a time with its unit.*is a size of memory"),
    "negative memory": (LAMBDA.encode() + b"[budget]\nmemory_MB = -1\n", r"NEXT: .*memory_MB = -1.0; it must be"),
    "half a box": (LAMBDA.encode() + b"[budget]\nboxes = 10.5\n", r"NEXT: .*must be an integer, not 10.5"),
    # texts that are none
    "UTF-16 without a mark": (LAMBDA.encode("utf-16-le"), r"not TOML: .*line 1"),
    "NUL inside": (changed('name = "lambda"', 'name = "lam\0bda"'), r"not TOML: .*line 4"),
    "NUL written": (changed('name = "lambda"', r'name = "lam\u0000bda"'), r"LINE: .*it names a folder"),
    "escape sequence": (changed('title = "', r'title = "\u001b[31m'), r"LINE: .*which cannot be printed; remove it"),
    "name of a paragraph": (
        changed('name = "lambda"', f'name = "{"n" * 300}"'),
        r"LINE: .*300 letters; use at most 100",
    ),
    "blanks only": (b" \n\t\n", r"lacks the table \[scene\]"),
    # shapes
    "key of 200000 parts": (
        LAMBDA.encode() + b"\n" + b".".join([b"a"] * 200_000) + b" = 1\n",
        r"line \d+: a key of more",
    ),
    "table of 20000 parts": (
        LAMBDA.encode() + b"\n[" + b" . ".join([b"a"] * 20_000) + b"]\n",
        r"a key of more than 100",
    ),
    "quoted key of 5000 parts": (
        LAMBDA.encode() + b"\n" + b'."a"' * 5_000 + b" = 1\n",
        r"a key of more than 100 parts",
    ),
    "key of half a megabyte": (LAMBDA.encode() + b"\n" + b"k" * 500_000 + b" = 1\n", r"unknown key 'k{70,80}\.\.\."),
    "deep inline tables": (b"x = " + b"{a=" * 3000 + b"1" + b"}" * 3000, r"not TOML"),
    "tables as a list": (changed("[scene]", "[[scene]]"), r"line 3: \[scene\] must be a table"),
    "a table for a text": (changed('name = "lambda"', "name = { a = 1 }"), r"LINE: .*must be a string"),
    "family by number": (changed('"lambda_linkage"', "3"), r"lacks the key 'module'"),
    "product by number": (changed('"solutions", ', "1, "), r"products.0\] must be a string, not 1"),
    "empty product": (changed('"solutions", ', '"", '), r"asks for '', which no stage gives"),
    "product of a paragraph": (
        changed('"solutions", ', f'"{"p" * 5000}", '),
        r"asks for 'p{70,80}\.\.\.,? which no stage",
    ),
    "both spellings": (changed("height_mm = 10", 'height_mm = 10\nheight = "1 cm"'), r"gives both 'height_mm' and"),
    # surveys and searches
    "steps of a thousandth of a thousandth": (
        changed("step = 0.05 }", "step = 0.000005 }", SURVEY),
        r"9.7e\+17 dimension sets",
    ),
    "steps of 1e-29": (SURVEY.replace("step = 0.05", "step = 1e-29").encode(), r"at most 1e\+08 are taken at once"),
    "no step": (changed("step = 0.05 }", "step = 0 }", SURVEY), r"step = 0.0; it must be positive"),
    "negative length": (changed("first = 0.05", "first = -0.05", SURVEY), r"first = -0.05; a length must be positive"),
    "text in a range": (changed("first = 0.05", "first = 'small'", SURVEY), r"frame.first\] must be a finite number"),
    "nan in a range": (changed("first = 0.05", "first = nan", SURVEY), r"frame.first\] must be a finite number"),
    "a list for a range": (changed("{ first = 0.05, last = 5, step = 0.05 }", "[1, 2]", SURVEY), r"must be a table"),
    "unknown column": (changed('rows = "passing"', 'columns = ["weight"]', SURVEY), r"columns.0\] must be one of"),
    "slice at nan": (changed("[1, 2.5, 4]", "[nan]", SURVEY), r"slices.0\] must be a finite number"),
    "effort of 1e17": (
        changed("effort = 0.05", "effort = 1e17", SEARCH),
        r"LINE: .*effort = 1e\+17; use more than 0",
    ),
    "tries without end": (changed("tries = 1\n", "tries = 1000000000000\n", SEARCH), r"LINE: .*use 1 to 10000"),
    "range without end": (
        changed("[mechanism.motion]", "[mechanism.motion]\nspan_deg = 1e17", SEARCH),
        r"at most 36000",
    ),
    "line of negative length": (
        changed("length = 3", "length = -3", SEARCH),
        r"embody\] asks for what cannot be: length",
    ),
    "ratio below one": (changed("max_length_ratio = 8", "max_length_ratio = 0.5", SEARCH), r"asks for what cannot be"),
    "files and a question": (
        changed("[mechanism]\n", '[mechanism]\nfiles = ["a.toml"]\n', SEARCH),
        r"needs candidates",
    ),
    "files by number": (changed("[mechanism]\n", "[mechanism]\nfiles = [1]\n", SEARCH), r"files.0\] must be a string"),
    "a million draws of few": (
        changed("[mechanism]\n", "[structure.generate]\nsample = 1000000000\n\n[mechanism]\n", SEARCH),
        r"sample 1000000000; draw 1 to 10000",
    ),
    "weight nan": (changed('goal = "min"', 'goal = "min"\nweight = nan', SEARCH), r"weight\] must be a finite number"),
    "unknown goal": (changed('goal = "min"', 'goal = "best"', SEARCH), r"goal\] must be one of 'min', 'max'"),
}


@pytest.mark.parametrize("name", sorted(BROKEN))
def test_a_broken_scene_is_answered_with_one_sentence(
    name: str, tmp_path: Path, fake: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    data, message = BROKEN[name]
    path = tmp_path / "broken.toml"
    path.write_bytes(data)
    own = SURVEY if b"four_bar_survey" in data else SEARCH if b"eight_link_search" in data else LAMBDA
    before, after = own.splitlines(), data.decode(errors="replace").splitlines()
    first = next((i for i, (a, b) in enumerate(zip(before, after), 1) if a != b), len(before) + 1)
    message = message.replace("LINE", f"line {first}").replace("NEXT", f"line {first + 1}")
    assert main(["run", str(path), "--out", str(tmp_path / "out")]) == 2
    out, error = capsys.readouterr()
    assert out == ""
    lines = said(error.strip())
    assert len(lines) == 1 and lines[0].startswith("graphsynth: ") and "Traceback" not in error
    assert re.search(message, lines[0]), lines[0]
    assert len(lines[0]) < 500
    assert not (tmp_path / "out" / "report.html").exists()


def test_more_than_thirty() -> None:
    assert len(BROKEN) >= 90


def test_a_file_of_fifty_megabytes_is_refused_unread(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "large.toml"
    with path.open("wb") as stream:
        stream.truncate(50_000_000)
    start = time.perf_counter()
    assert main(["run", str(path)]) == 2
    assert "more than 1048576 bytes" in capsys.readouterr().err and time.perf_counter() - start < 2.0


def test_a_mark_before_the_first_letter_is_no_mistake(tmp_path: Path) -> None:
    path = tmp_path / "marked.toml"
    path.write_bytes(b"\xef\xbb\xbf" + LAMBDA.encode())
    assert load_scene(path).mechanism == load_scene("lambda").mechanism


def test_links_that_lead_in_a_circle_and_pipes(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    loop = tmp_path / "loop.toml"
    loop.symlink_to(loop)
    pipe = tmp_path / "pipe.toml"
    os.mkfifo(pipe)  # nobody writes: reading it would wait without end
    for path in (loop, pipe):
        assert main(["run", str(path)]) == 2
        said = capsys.readouterr().err.strip().splitlines()
        assert len(said) == 1 and "neither the path of a .toml file nor one of the shipped scenes" in said[0]


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
    assert "choose another folder with -o" in capsys.readouterr().err
