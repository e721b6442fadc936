"""The same bytes for any number of workers and after any interruption; damaged files are refused in a sentence."""

import json
import shutil
import signal
import subprocess
import sys
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from graphsynth.cli.main import main
from graphsynth.core.errors import FormatError, SpecError
from graphsynth.core.ordered import processes
from graphsynth.design import CurveIndex
from graphsynth.design.curves.building import Piece, build, make_piece

KILLED = """
import os, sys
from graphsynth.design.curves.building import build
def watch(done, total):
    if done == 3:
        os.kill(os.getpid(), {signal})
build(sys.argv[1], 3000, links=[4, 6], sliders=1, watch=watch)
"""


def bytes_of(folder: Path) -> dict[str, bytes]:
    return {str(path.relative_to(folder)): path.read_bytes() for path in sorted(folder.rglob("*")) if path.is_file()}


@pytest.mark.long
@pytest.mark.skipif(sys.platform == "win32", reason="has no SIGKILL")
def test_a_killed_build_goes_on_to_the_same_bytes(index: CurveIndex, tmp_path: Path) -> None:
    done = subprocess.run([sys.executable, "-c", KILLED.format(signal=int(signal.SIGKILL)), str(tmp_path)], check=False)
    assert done.returncode == -signal.SIGKILL
    (place,) = tmp_path.iterdir()
    assert not (place / "manifest.json").exists()
    with pytest.raises(FormatError, match="no finished index"):
        CurveIndex(tmp_path)
    with (place / "arc.npy").open("ab") as stream:  # written before the journal told of it
        stream.write(b"half a row" * 100_000)
    with pytest.raises(SpecError, match="other curves"):
        build(tmp_path, 3000, links=[4, 6], sliders=1, seed=1)
    seen: list[int] = []
    CurveIndex.build(tmp_path, 3000, links=[4, 6], sliders=1, watch=lambda done, total: seen.append(done))
    assert seen[0] == 4
    assert bytes_of(tmp_path) == bytes_of(index.folder)


@pytest.mark.long
def test_two_workers_write_the_same_bytes(index: CurveIndex, tmp_path: Path) -> None:
    with processes(2) as executor:
        build(tmp_path, 3000, links=[4, 6], sliders=1, executor=executor)
    assert bytes_of(tmp_path) == bytes_of(index.folder)


@pytest.mark.long
def test_no_curve_is_drawn_twice(index: CurveIndex) -> None:
    (shard,) = index.shards
    assert len(np.unique(shard.columns["mechanism"]["point"], axis=0)) == 3000
    piece = Piece(index.families[0], 0, 0, 30, 0, 4, 1)
    parts = [make_piece(own)["arc"].tobytes() for own in (piece, replace(piece, part=1), replace(piece, seed=1))]
    assert len(set(parts)) == 3 and make_piece(piece)["arc"].tobytes() == parts[0]


@pytest.mark.long
def test_shards_hold_the_rows_of_the_whole(index: CurveIndex, tmp_path: Path) -> None:
    build(tmp_path, 3000, links=[4, 6], sliders=1, shard=(2, 2))
    with pytest.raises(FormatError, match="1 of 2 shards"):
        CurveIndex(tmp_path)
    build(tmp_path, 3000, links=[4, 6], sliders=1, shard=(1, 2))
    both = CurveIndex(tmp_path)
    assert len(both) == len(index) == 3000
    for name in ("arc", "timed", "turn", "mechanism"):
        whole, parts = (np.concatenate([shard.columns[name] for shard in own.shards]) for own in (index, both))
        assert sorted(row.tobytes() for row in whole) == sorted(row.tobytes() for row in parts)
    curve = np.column_stack([np.linspace(0.0, 3.0, 50), np.sin(np.linspace(0.0, 3.0, 50))])
    found = [[match.error for match in own.find(curve, 5)] for own in (index, both)]
    assert found[0] == found[1]


@pytest.mark.long
def test_rows_may_be_read_with_numpy_alone(index: CurveIndex) -> None:
    (shard,) = index.shards
    for name in shard.manifest["columns"]:
        assert len(np.load(shard.folder / f"{name}.npy", allow_pickle=False)) == 3000


def damaged(index: CurveIndex, tmp_path: Path, name: str, change) -> Path:
    shutil.copytree(index.folder, tmp_path / "index")
    (file,) = (tmp_path / "index").glob(f"*/{name}")
    file.write_bytes(change(file.read_bytes()))
    return tmp_path / "index"


def edited(**new: object):
    return lambda data: json.dumps(json.loads(data) | new).encode()


@pytest.mark.long
@pytest.mark.parametrize(
    ("name", "change"),
    [
        ("arc.npy", lambda data: data[:-7]),
        ("arc.npy", lambda data: b"\0" * len(data)),
        ("mechanism.npy", lambda data: data.replace(b"family", b"famine", 1)),
        ("turn.npy", lambda data: data.replace(b"<i2", b"<u2", 1)),
        ("manifest.json", lambda data: b""),
        ("manifest.json", lambda data: data[: len(data) // 2]),
        ("manifest.json", lambda data: b"[" * 100_000),
        ("manifest.json", edited(format="graphsynth-curves-9")),
        ("manifest.json", edited(rows=2999)),
        ("manifest.json", edited(rows="many")),
        ("manifest.json", edited(asked={})),
        ("manifest.json", edited(asked={"joints": -1, "numbers": 1})),
        ("manifest.json", edited(families=[["x", "y", 3]])),
        ("manifest.json", edited(families=[["nokey", 1, []]])),
        ("manifest.json", edited(shard=[1, 0])),
        ("manifest.json", edited(columns={})),
    ],
)
def test_damaged_files_are_refused(index: CurveIndex, tmp_path: Path, name: str, change) -> None:
    with pytest.raises(FormatError):
        CurveIndex(damaged(index, tmp_path, name, change)).entry(0).traced()


def test_a_flipped_bit_is_found_by_its_checksum(index: CurveIndex, tmp_path: Path) -> None:
    folder = damaged(index, tmp_path, "timed.npy", lambda data: data[:-1] + bytes([data[-1] ^ 1]))
    index.verify()
    with pytest.raises(FormatError, match=r"timed.npy.*checksum|checksum.*timed.npy"):
        CurveIndex(folder).verify()


def test_the_command_line(index: CurveIndex, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    points = tmp_path / "curve.csv"
    points.write_text("# x, y\n0, 0\n1; 1\n2 0\n", encoding="utf-8")
    found = ["curves", "find", str(index.folder), str(points), "--closed", "--count", "3", "--json"]
    assert main([*found, "-o", str(tmp_path / "best.toml")]) == 0
    told = json.loads(capsys.readouterr().out)
    assert told["curves"] == 3000 and len(told["found"]) == 3
    assert (tmp_path / "best.toml").read_text(encoding="utf-8").count("[[joints]]") >= 4
    assert main(["curves", "verify", str(index.folder)]) == 0
    points.write_text("".join(f"{k} {k * k} {0.1 * k}\n" for k in range(6)), encoding="utf-8")
    assert main(["curves", "find", str(index.folder), str(points), "--count", "2"]) == 0
    assert "2 of 3000 curves" in capsys.readouterr().out
    points.write_text("0 0\n1 2 3\n", encoding="utf-8")
    assert main(["curves", "find", str(index.folder), str(points)]) == 2
    assert "line 2" in capsys.readouterr().err
    points.write_text("0 0\n1 one\n", encoding="utf-8")
    assert main(["curves", "find", str(index.folder), str(points)]) == 2
    assert "line 2" in capsys.readouterr().err
    begin = time.perf_counter()
    build_again = ["curves", "build", str(index.folder), "--curves", "3000", "--links", "4", "6", "--sliders", "1"]
    assert main(build_again) == 0 and time.perf_counter() - begin < 20.0
