"""Files and texts that a user hands in: bounds, special files, deep keys, numbers nobody can show."""

from __future__ import annotations

import os
import time
from pathlib import Path

import pytest

from graphsynth import Mechanism, StructuralSpec
from graphsynth.cli import main
from graphsynth.core.errors import FormatError, GraphsynthError
from graphsynth.core.textfiles import FILE_MAX, read_bytes, toml_tables
from graphsynth.pipeline.scene import load_scene

READERS = {
    "question": StructuralSpec.from_toml,
    "scene": load_scene,
    "mechanism": lambda path: Mechanism.from_toml(path.read_bytes()),
}
BAD = {
    "a dotted key of 40 kB": b"a" + b".a" * 20_000 + b" = 1\n",
    "a dotted table of 40 kB": b"[a" + b".a" * 20_000 + b"]\n",
    "quoted parts": b'"a b"' + b'."a b"' * 6_000 + b" = 1\n",
    "quoted dots": b"'a.b'" + b".'a.b'" * 6_000 + b" = 1\n",
    "spaces between parts": b"a" + b" . a" * 10_000 + b" = 1\n",
    "inline tables": b"W = " + b"{a = " * 5_000 + b"1" + b"}" * 5_000,
    "a million digits": b"W = " + b"7" * 300_000,
    "hexadecimal digits": b"W = 0x" + b"f" * 300_000,
    "a NUL": b"W = 1\0",
    "only NULs": bytes(4096),
    "half a character": b"W = 1 # \xc3",
}


@pytest.mark.parametrize("data", BAD.values(), ids=BAD)
@pytest.mark.parametrize("reader", READERS.values(), ids=READERS)
def test_a_sentence_and_no_wait(tmp_path, reader, data):
    path = tmp_path / "bad.toml"
    path.write_bytes(data)
    begin = time.process_time()
    with pytest.raises(GraphsynthError) as caught:
        reader(path)
    assert time.process_time() - begin < 1.0
    assert len(str(caught.value)) < 1000


@pytest.mark.parametrize("reader", [StructuralSpec.from_toml, load_scene], ids=["question", "scene"])
def test_more_than_a_megabyte(tmp_path, reader):
    path = tmp_path / "long.toml"
    path.write_bytes(b"# x\n" * (FILE_MAX // 4 + 1))
    with pytest.raises(FormatError, match=r"more than 1048576 bytes; .* is a short text"):
        reader(path)


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="no pipes with names here")
def test_what_is_no_file(tmp_path):
    os.mkfifo(tmp_path / "pipe.toml")
    (tmp_path / "loop.toml").symlink_to(tmp_path / "loop.toml")
    for path in (tmp_path, tmp_path / "pipe.toml", Path("/dev/zero")):
        with pytest.raises(FormatError, match="it is a folder, a device or a pipe"):
            StructuralSpec.from_toml(path)
    for path in (tmp_path / "loop.toml", tmp_path / "none.toml", tmp_path / ("x" * 300), "a\0b"):
        with pytest.raises(FormatError, match="cannot be read: "):
            StructuralSpec.from_toml(path)
    with pytest.raises(FormatError, match="no file can have this name"):
        read_bytes(Path("\udc80\ud800"))


def test_keys_of_a_few_parts_and_long_numbers_are_read():
    assert toml_tables(".".join("a" * 50) + " = 1")["a"]
    assert toml_tables(f"x = {'9' * 100}") == {"x": int("9" * 100)}
    assert toml_tables("# " + "1." * 50) == {}


def test_the_command_line_says_it_in_one_sentence(tmp_path, capsys):
    (tmp_path / "deep.toml").write_bytes(BAD["a dotted key of 40 kB"])
    for path, words in (("/dev/zero", "a device"), (str(tmp_path / "deep.toml"), "more than 100 parts")):
        assert main(["solve", "--spec", path]) == 2
        said = capsys.readouterr()
        assert said.out == "" and words in said.err and said.err.count("\n") == 1


def test_a_long_line_of_a_file_of_graphs(tmp_path, capsys):
    path = tmp_path / "chains.dat"
    path.write_bytes(b"Bw\n" + b"x" * 3_000_000)
    assert main(["show", str(path)]) == 0
    assert main(["show", str(path), "--line", "2"]) == 2
    assert "bytes on one line" in capsys.readouterr().err
