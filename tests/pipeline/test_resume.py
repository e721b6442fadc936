"""An interrupted run: what is stored stays, the rerun goes on, and the bytes are those of an uninterrupted one."""

from __future__ import annotations

import errno
import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from graphsynth.core.errors import FormatError, SceneError
from graphsynth.core.journal import Journal, Work
from graphsynth.pipeline.runner import run

FULL = OSError(errno.ENOSPC, "No space left on device")
PAUSE = "pause_s = 0.05\n"


def slowly(springs: Path) -> Path:
    springs.write_text(springs.read_text(encoding="utf-8").replace("count = 20\n", "count = 20\n" + PAUSE), "utf-8")
    return springs


def interrupt(springs: Path, out: Path, *options: str, number: int = signal.SIGINT) -> subprocess.CompletedProcess[str]:
    """Run the command line until three candidates are stored, then press Ctrl-C, or tell it to end."""
    command = [sys.executable, "-m", "graphsynth", "run", str(springs), "--out", str(out), *options]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    journal, start = out / "candidates.jsonl", time.monotonic()
    while not (journal.exists() and journal.read_bytes().count(b"\n") > 3):
        assert process.poll() is None and time.monotonic() - start < 30
        time.sleep(0.01)
    os.kill(process.pid, number)
    out_text, error = process.communicate(timeout=30)
    return subprocess.CompletedProcess(command, process.returncode, out_text, error)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("options", "number"),
    [
        (("--workers", "1"), signal.SIGINT),
        (("--workers", "2"), signal.SIGINT),
        ((), signal.SIGINT),
        (("--workers", "2"), signal.SIGTERM),
    ],
)
def test_ctrl_c_and_again(springs: Path, tmp_path: Path, options: tuple[str, ...], number: int) -> None:
    slowly(springs)
    done = interrupt(springs, tmp_path / "out", *options, number=number)
    assert done.returncode == 128 + number, done.stderr
    journal = tmp_path / "out" / "candidates.jsonl"
    kept = f"what is done is kept in {journal}; the same command goes on from there"
    assert [line for line in done.stderr.splitlines() if line] == [kept, "graphsynth: interrupted"]
    stored = (tmp_path / "out" / "candidates.jsonl").read_bytes()
    assert stored.endswith(b"\n") and 4 <= stored.count(b"\n") < 21
    report = run(springs, out=tmp_path / "out")
    assert f"{stored.count(bytes([10])) - 1} candidates were taken over" in report.notes[0]
    whole = (tmp_path / "out" / "candidates.jsonl").read_bytes()
    assert whole.startswith(stored)
    run(springs, out=tmp_path / "straight")
    assert whole == (tmp_path / "straight" / "candidates.jsonl").read_bytes()
    assert (tmp_path / "out" / "results.csv").read_bytes() == (tmp_path / "straight" / "results.csv").read_bytes()


@pytest.mark.long
@pytest.mark.parametrize("cut", [1, 2, 40, 150, 300, 700, 1500])
def test_a_file_cut_anywhere_is_continued_to_the_same_bytes(springs: Path, tmp_path: Path, cut: int) -> None:
    run(springs, out=tmp_path)
    path = tmp_path / "candidates.jsonl"
    whole = path.read_bytes()
    path.write_bytes(whole[: len(whole) - cut])
    run(springs, out=tmp_path)
    assert path.read_bytes() == whole


def test_what_is_stored_is_not_computed_again(springs: Path, tmp_path: Path) -> None:
    from dataclasses import replace

    from graphsynth.pipeline.scene import load_scene

    log = tmp_path / "log"
    scene = load_scene(springs)
    scene = replace(scene, mechanism=replace(scene.mechanism, log=str(log)))
    run(scene, out=tmp_path / "out")
    path = tmp_path / "out" / "candidates.jsonl"
    path.write_bytes(b"".join(path.read_bytes().splitlines(keepends=True)[:13]))  # a head and twelve candidates
    log.unlink()
    run(scene, out=tmp_path / "out")
    assert {int(line.split()[1]) for line in log.read_text().splitlines()} == set(range(13, 21))


def stop_after(path: Path, lines: int) -> None:
    path.write_bytes(b"".join(path.read_bytes().splitlines(keepends=True)[:lines]))


@pytest.mark.long
def test_another_question_or_a_strange_file_is_refused_and_fresh_replaces_it(springs: Path, tmp_path: Path) -> None:
    run(springs, out=tmp_path)
    path = tmp_path / "candidates.jsonl"
    whole = path.read_bytes()
    stop_after(path, 5)
    springs.write_text(springs.read_text(encoding="utf-8").replace("count = 20", "count = 21"), "utf-8")
    with pytest.raises(SceneError, match="holds an interrupted run of another question or version; add --fresh"):
        run(springs, out=tmp_path)
    for junk in (b"\xff\xfe\n", b"{}\n", b"[1]\n", b"5\n"):
        path.write_bytes(junk)
        with pytest.raises(FormatError, match="not a journal of graphsynth; add --fresh"):
            run(springs, out=tmp_path)
    springs.write_text(springs.read_text(encoding="utf-8").replace("count = 21", "count = 20"), "utf-8")
    lines = whole.splitlines(keepends=True)
    for spoilt in (lines[2], b'{"~": "Outcome"}\n', b'{"~": "Path"}\n', b"\xff\n", b'{"~": "Outcome", "number": 1}'):
        path.write_bytes(lines[0] + spoilt + lines[4])
        with pytest.raises(FormatError, match="line 2: not the result of candidate 1; add --fresh"):
            run(springs, out=tmp_path)
    run(springs, out=tmp_path, fresh=True)
    assert path.read_bytes() == whole


def test_a_scene_changed_in_python_is_another_question(springs: Path, tmp_path: Path) -> None:
    from dataclasses import replace

    from graphsynth.pipeline.scene import load_scene

    scene = load_scene(springs)
    run(scene, out=tmp_path)
    stop_after(tmp_path / "candidates.jsonl", 5)
    with pytest.raises(SceneError, match="another question"):
        run(replace(scene, mechanism=replace(scene.mechanism, rest_mm=2.0)), out=tmp_path)


def test_other_candidates_behind_the_same_question_are_noticed(springs: Path, tmp_path: Path) -> None:
    run(springs, out=tmp_path)
    path = tmp_path / "candidates.jsonl"
    head, *lines = path.read_text(encoding="utf-8").splitlines()
    path.unlink()
    digest, values = json.loads(head)["question"], [json.dumps(json.loads(line)["value"]) for line in lines[:2]]
    with Journal(path, Work("run", "springs", digest)) as journal:
        for value in values:
            journal.append(value.replace("spring-2", "spring-9"))
    with pytest.raises(SceneError, match=r"candidate 2 of the interrupted run \(spring-9\) is not candidate 2"):
        run(springs, out=tmp_path)


def test_a_complete_run_starts_anew_and_budgets_do_not_change_the_question(springs: Path, tmp_path: Path) -> None:
    assert run(springs, out=tmp_path).notes == ()
    assert run(springs, out=tmp_path).notes == ()
    head = json.loads((tmp_path / "candidates.jsonl").read_text(encoding="utf-8").splitlines()[0])
    springs.write_text(springs.read_text(encoding="utf-8") + '\n[budget]\ntime = "1 h"\nmemory = "8 GB"\n', "utf-8")
    run(springs, out=tmp_path)
    assert json.loads((tmp_path / "candidates.jsonl").read_text(encoding="utf-8").splitlines()[0]) == head


def test_a_run_stopped_between_its_last_candidate_and_its_report_computes_no_candidate_again(
    springs: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    from graphsynth.pipeline import report as reports

    usual = reports.write_whole

    def full(path: Path, data: bytes) -> None:
        raise FULL

    monkeypatch.setattr(reports, "write_whole", full)
    with pytest.raises(SceneError, match=r"No space left on device; free some space and give the same command again"):
        run(springs, out=tmp_path)
    monkeypatch.setattr(reports, "write_whole", usual)
    assert "20 candidates were taken over" in run(springs, out=tmp_path).notes[0]
    run(springs, out=tmp_path / "straight")
    for name in ("candidates.jsonl", "results.csv"):
        assert (tmp_path / name).read_bytes() == (tmp_path / "straight" / name).read_bytes()
    assert run(springs, out=tmp_path).notes == ()  # reported: anew


def test_a_full_disk_while_candidates_come_leaves_what_is_stored(
    springs: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    from graphsynth.pipeline.store import Journal

    usual = Journal.append
    count = 0

    class Full:
        def write(self, data: bytes) -> None:
            raise FULL

        def close(self) -> None:
            raise FULL

    def append(self: Journal, line: str) -> None:
        nonlocal count
        count += 1
        if count == 8:
            self._stream.close()
            self._stream = Full()
        usual(self, line)

    said = r"cannot write .*candidates.jsonl: No space left on device; free some space"
    with monkeypatch.context() as patch, pytest.raises(SceneError, match=said):
        patch.setattr(Journal, "append", append)
        run(springs, out=tmp_path)
    assert "7 candidates were taken over" in run(springs, out=tmp_path).notes[0]


def test_an_unreported_file_of_another_question_is_refused(springs: Path, tmp_path: Path) -> None:
    run(springs, out=tmp_path)
    path = tmp_path / "candidates.jsonl"
    path.write_bytes(b"".join(path.read_bytes().splitlines(keepends=True)[:-1]))
    springs.write_text(springs.read_text(encoding="utf-8").replace("count = 20", "count = 21"), "utf-8")
    with pytest.raises(SceneError, match="holds an interrupted run of another question"):
        run(springs, out=tmp_path)
