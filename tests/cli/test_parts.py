"""The verb ``parts``: from a file or a name to a folder."""

import json

import pytest

from graphsynth.cli.main import main
from graphsynth.mechanism import gallery


def run(capsys, *arguments):
    status = main(["parts", *map(str, arguments)])
    return status, *capsys.readouterr()


def test_a_classic_mechanism_becomes_files(tmp_path, capsys):
    status, out, _ = run(capsys, "chebyshev_lambda", "--unit", 40, "--pin", 4, "--out", tmp_path / "new")
    assert status == 0 and "certified: nothing collides" in out and "pin 4, " in out
    assert sorted(file.name for file in (tmp_path / "new").iterdir()) == ["bill.csv", "cut.svg", "parts.svg"]


def test_a_file_over_a_range_as_json(tmp_path, capsys):
    (tmp_path / "drag.toml").write_text(gallery.Mechanism.four_bar(1.0, 2.5, 2.0, 2.5).to_toml(), "utf-8")
    asked = (tmp_path / "drag.toml", "--unit", 40, "--out", tmp_path, "--json")
    status, out, _ = run(capsys, *asked, "--range", 1.0, 1.5, "--form", "csv")
    found = json.loads(out)
    assert status == 0 and found["certified"] and found["layers"][0] == 0
    assert found["sizes"]["pin"] == 2.5 and found["bill"][0]["part"] == "frame 0"
    assert (tmp_path / "bill.csv").read_text().startswith("part,number,layer,")
    status, _, told = run(capsys, *asked)
    assert status == 2 and "no layers without a collision: " in told


def test_parts_too_small_to_be_meant_are_told(tmp_path, capsys):
    status, _, told = run(capsys, "chebyshev_lambda", "--out", tmp_path)
    assert status == 0 and "the longest part is 5.32 mm: --unit" in told
    assert "--unit" not in run(capsys, "chebyshev_lambda", "--unit", 40, "--out", tmp_path)[2]


@pytest.mark.parametrize("name", ["nobody", "nothing.toml"])
def test_what_is_no_mechanism_is_told(capsys, name):
    status, _, told = run(capsys, name)
    assert status == 2 and name in told
