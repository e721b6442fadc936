"""A journal counts what was done once, whoever wrote, doubled, cut or changed its lines."""

from __future__ import annotations

import errno
import json
import random
from pathlib import Path
from types import SimpleNamespace

import pytest

from graphsynth.cli import main
from graphsynth.core import journal as journals
from graphsynth.core.errors import FormatError, GraphsynthError
from graphsynth.core.journal import Journal, Work, digest_of
from graphsynth.synthesis.problem import EnumerationProblem
from graphsynth.synthesis.writing import count_with_checkpoint, write_listing

WORK = Work("count", "the question", digest_of("question", 1))
TWELVE = EnumerationProblem.chains(12, 1, 3, None, False, None)
COUNT = 6856


def written(path: Path, count: int = 5) -> Path:
    with Journal(path, WORK) as journal:
        for number in range(count):
            journal.append(str(number * number))
    return path


def read(path: Path) -> tuple[str, ...]:
    with Journal(path, WORK) as journal:
        return journal.entries


VALUES = ("0", "1", "4", "9", "16")


def test_what_was_written_is_read(tmp_path: Path) -> None:
    path = written(tmp_path / "j")
    assert read(path) == VALUES
    with Journal(path, WORK) as journal:
        journal.append('{"a": "\\u00e9"}')
    assert read(path) == (*VALUES, '{"a": "\\u00e9"}')
    lines = [json.loads(line) for line in path.read_text().splitlines()]
    assert lines[0]["title"] == "the question" and [line["piece"] for line in lines[1:]] == [1, 2, 3, 4, 5, 6]


@pytest.mark.parametrize("seed", range(60))
def test_a_file_cut_anywhere_keeps_its_whole_lines(tmp_path: Path, seed: int) -> None:
    path = written(tmp_path / "j")
    whole = path.read_bytes()
    at = random.Random(seed).randrange(len(whole))
    path.write_bytes(whole[:at])
    kept = max(0, whole[:at].count(b"\n") - 1)
    with Journal(path, WORK) as journal:
        assert journal.entries == VALUES[:kept]
        for value in VALUES[kept:]:
            journal.append(value)
    assert path.read_bytes() == whole


@pytest.mark.parametrize(
    "change",
    [
        lambda head, lines: [head, *(line for line in lines for _ in range(2))],
        lambda head, lines: [head, *lines, head, *lines],
        lambda head, lines: [head, *lines, *lines],
        lambda head, lines: [head, lines[0], *lines],
    ],
)
def test_a_line_that_stands_there_twice_counts_once(tmp_path: Path, change) -> None:
    path = written(tmp_path / "j")
    head, *lines = path.read_text().splitlines(keepends=True)
    path.write_text("".join(change(head, lines)))
    assert read(path) == VALUES
    assert path.read_text() == "".join([head, *lines])
    with Journal(path, WORK) as journal:
        journal.append("25")
    assert read(path) == (*VALUES, "25")


OTHER = '{"piece": 3, "check": "0123456789abcdef", "value": 4}\n'


@pytest.mark.parametrize(
    "change",
    [
        lambda lines: [*lines, "-5000\n"],
        lambda lines: [*lines, "7\n"],
        lambda lines: [*lines, lines[-1].replace('"piece": 5', '"piece": 6')],
        lambda lines: [*lines[:3], *lines[4:]],
        lambda lines: [*lines[:2], lines[3], lines[2], *lines[4:]],
        lambda lines: [*lines[:3], lines[3].replace(": 4}", ": 5}"), *lines[4:]],
        lambda lines: [*lines[:3], OTHER, *lines[4:]],
        lambda lines: [*lines[:3], lines[3][:20], *lines[4:]],
        lambda lines: [*lines[:3], "\n", *lines[3:]],
    ],
)
def test_a_line_that_does_not_belong_there_is_refused(tmp_path: Path, change) -> None:
    path = written(tmp_path / "j")
    changed = "".join(change(path.read_text().splitlines(keepends=True)))
    path.write_text(changed)
    with pytest.raises(
        FormatError, match=r"line \d: not the result of piece \d; .* or delete this line and all behind"
    ):
        read(path)
    assert path.read_text() == changed


def test_other_files_are_refused_as_they_are(tmp_path: Path) -> None:
    path = tmp_path / "j"
    for junk in (b"notes of mine", b"notes\n", b"{}\n", b"\xff\n", b'{"journal": 9, "question": "a", "title": ""}\n'):
        path.write_bytes(junk)
        with pytest.raises(FormatError, match="not a journal of graphsynth; give the same options, or name another"):
            read(path)
        assert path.read_bytes() == junk
    written(path.with_name("k"))
    with pytest.raises(GraphsynthError, match=r"\(of the question\) belongs to another question or version"):
        Journal(path.with_name("k"), Work("count", "another", digest_of("question", 2)))


def test_another_version_does_not_go_on(monkeypatch: pytest.MonkeyPatch) -> None:
    before = digest_of("question")
    monkeypatch.setattr(journals.graphsynth, "__version__", "0.0.1")
    assert digest_of("question") != before


def test_a_second_writer_is_refused(tmp_path: Path) -> None:
    path = written(tmp_path / "j")
    with Journal(path, WORK), pytest.raises(GraphsynthError, match="is being written by another process: wait"):
        Journal(path, WORK, fresh=True)
    assert read(path) == VALUES


def test_a_file_that_was_removed_while_it_was_opened_is_made_anew(tmp_path: Path, monkeypatch) -> None:
    path, lock = written(tmp_path / "j"), journals._lock
    with Journal(path, WORK) as first, monkeypatch.context() as patch:

        def late(stream) -> bool:
            patch.setattr(journals, "_lock", lock)
            first.remove()
            return lock(stream)

        patch.setattr(journals, "_lock", late)
        with Journal(path, WORK) as journal:
            assert journal.entries == ()
            assert path.exists()


# -- count -----------------------------------------------------------------------------------------------------------


def test_a_count_is_right_with_doubled_lines_and_refuses_added_ones(tmp_path: Path, capsys) -> None:
    path = tmp_path / "ck.txt"
    words = ["count", "--links", "12", "--checkpoint", str(path)]
    assert main(words) == 0
    head, *lines = path.read_text().splitlines(keepends=True)
    assert len(lines) > 3
    path.write_text(head + "".join(line * 2 for line in lines))
    assert main(words) == 0
    assert [line for line in capsys.readouterr().out.splitlines() if line.isdigit()] == [str(COUNT)] * 2
    path.write_text("".join([head, *lines, "-5000\n"]))
    assert main(words) == 2
    said = capsys.readouterr().err
    assert said.count("\n") == 1 and f"line {len(lines) + 2}: not the result of piece" in said


def test_a_count_started_twice_at_once_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "ck.txt"

    def again(step) -> None:
        with pytest.raises(GraphsynthError, match="is being written by another process"):
            count_with_checkpoint(TWELVE, checkpoint=path)

    assert count_with_checkpoint(TWELVE, checkpoint=path, watch=again) == COUNT
    assert count_with_checkpoint(TWELVE, checkpoint=path) == COUNT


# -- enumerate -------------------------------------------------------------------------------------------------------


def test_a_finished_listing_has_nothing_left_to_do(tmp_path: Path, capsys) -> None:
    path = tmp_path / "ten.g6"
    words = ["enumerate", "--links", "10", "-o", str(path)]
    assert main([*words, "--resume"]) == 0
    whole = path.read_bytes()
    assert main([*words, "--resume"]) == 0
    assert "230 graphs" in capsys.readouterr().err and path.read_bytes() == whole
    assert main([*words[:2], "8", *words[3:], "--resume"]) == 2
    assert "was not written by this question, or is not complete" in capsys.readouterr().err
    for changed in (whole[:-1], whole[: len(whole) // 2], whole[40:], b"", whole + b"\n"):
        path.write_bytes(changed)
        assert main([*words, "--resume"]) == 2
        assert path.read_bytes() == changed


@pytest.mark.parametrize(
    "spoil", [lambda data: data[:-30], lambda data: data[:20] + b"?" + data[21:], lambda data: b""]
)
def test_a_listing_whose_data_was_lost_or_changed_is_made_anew_from_there(tmp_path: Path, spoil) -> None:
    path, whole = tmp_path / "a.g6", tmp_path / "b.g6"

    class Killed(Exception):
        pass

    def stop(step) -> None:
        if step.done > 0.5:
            raise Killed

    assert write_listing(TWELVE, whole) == COUNT
    with pytest.raises(Killed):
        write_listing(TWELVE, path, watch=stop)
    path.write_bytes(spoil(path.read_bytes()))
    assert write_listing(TWELVE, path, resume=True) == COUNT
    assert path.read_bytes() == whole.read_bytes()


def test_a_full_disk_names_the_file_and_the_remedy(tmp_path: Path, monkeypatch, capsys) -> None:
    path = tmp_path / "a.g6"

    def full(self: Journal, value: str) -> None:
        with self.writing(self.path):
            raise OSError(errno.ENOSPC, "No space left on device")

    with monkeypatch.context() as patch:
        patch.setattr(Journal, "append", full)
        assert main(["enumerate", "--links", "10", "-o", str(path)]) == 2
    said = capsys.readouterr().err
    assert (
        said.count("\n") == 1
        and str(path) in said
        and "free some space and give the same command with --resume again, or name another file" in said
    )
    assert main(["enumerate", "--links", "10", "-o", str(path), "--resume"]) == 0


@pytest.mark.parametrize(("free", "status"), [(200_000, 0), (50_000, 2)])
def test_a_listing_is_refused_only_if_it_cannot_fit(
    tmp_path: Path, monkeypatch, capsys, free: int, status: int
) -> None:
    """The listing has 89 kB; its bound has more than a megabyte."""
    path = tmp_path / "a.g6"
    monkeypatch.setattr("shutil.disk_usage", lambda place: SimpleNamespace(free=free))
    assert main(["enumerate", "--links", "12", "-o", str(path)]) == status
    said = capsys.readouterr().err
    assert ("need about 0.0891 MB, and 0.05 MB are free for " + str(path) in said) == (status == 2)
