"""Files that are damaged, foreign, empty, linked, read-only or left by a killed process: one sentence or the rows."""

from __future__ import annotations

import os
import random
import shutil
import sqlite3
import subprocess
import sys

import pytest

from graphsynth.atlas.catalogue import Catalogue
from graphsynth.atlas.evaluations import Evaluation
from graphsynth.cli import main
from graphsynth.core.errors import FormatError, GraphsynthError


@pytest.fixture(scope="module")
def right(built, tmp_path_factory):
    path = built(tmp_path_factory.mktemp("right"), [4, 6, 8])
    with Catalogue(path) as catalogue:
        catalogue.record([Evaluation("1.4.4.1", 0, 2, "jamming", "free", 0.1, "rad", "certified", {"a": 1})])
    return path


def use_everything(path, folder):
    """All that a reader can do; returns what verification says and the content."""
    with Catalogue(path) as catalogue:
        for table in ("chains", "inversions", "mechanisms", "groups", "evaluations", "families"):
            catalogue.query(table)
        for name in ("1.4.4.1", "1.8.4-4.3"):
            catalogue.entry(name)
            catalogue.chain(name)
        catalogue.completeness()
        catalogue.export(folder, "csv")
        return catalogue.digest()


@pytest.mark.parametrize("count", [25, pytest.param(400, marks=pytest.mark.slow)])
def test_random_bytes_changed(right, tmp_path, count):
    """A reader raises one kind of error or reads; verification never raises, and passes only what is whole."""
    choice = random.Random(7)
    data = right.read_bytes()
    path = tmp_path / "x.sqlite"
    with Catalogue(right) as catalogue:
        digest = catalogue.digest()
    unharmed = 0
    for _ in range(count):
        changed = bytearray(data)
        for _ in range(choice.choice([1, 1, 3, 50])):
            changed[choice.randrange(len(data))] = choice.randrange(256)
        if choice.random() < 0.1:
            changed = changed[: choice.randrange(len(data))]
        path.write_bytes(changed)
        try:
            own = use_everything(path, tmp_path / "out")
        except GraphsynthError as error:
            own = ""
            assert "\n" not in str(error)
        try:
            with Catalogue(path) as catalogue:
                passed = catalogue.verify(chains=None if count > 100 else 4).passed
        except FormatError:
            passed = False
        if passed and count > 100:
            assert own == digest
        unharmed += own == digest
    assert unharmed < count


@pytest.mark.parametrize("count", [8, pytest.param(100, marks=pytest.mark.slow)])
def test_a_build_that_goes_on_with_a_damaged_file(right, tmp_path, count):
    choice = random.Random(3)
    path = tmp_path / "x.sqlite"
    for _ in range(count):
        changed = bytearray(right.read_bytes())
        at = choice.randrange(len(changed) - 4096)
        changed[at : at + 4096] = choice.randbytes(4096)
        path.write_bytes(changed)
        for work in (
            lambda: Catalogue.build(path, [4, 6, 7, 8, 10]).close(),
            lambda: Catalogue(path).record([Evaluation("1.4.4.1", 0, 2, "jamming", "free")]),
            lambda: Catalogue.merge(tmp_path / "m.sqlite", [path]).close(),
        ):
            try:
                work()
            except GraphsynthError as error:
                assert "\n" not in str(error)
        for name in ("m.sqlite", "m.sqlite-wal", "m.sqlite-shm", "x.sqlite-wal", "x.sqlite-shm"):
            (tmp_path / name).unlink(missing_ok=True)


def test_the_command_says_one_sentence_of_a_damaged_file(right, tmp_path, capsys):
    path = tmp_path / "x.sqlite"
    pages = [right.read_bytes()[at : at + 4096] for at in range(0, right.stat().st_size, 4096)]
    # all but the tables' names, so that it can be opened
    path.write_bytes(pages[0] + b"".join(page if b"CREATE " in page else bytes(4096) for page in pages[1:]))
    file = str(path)
    for words in (
        ["query", file], ["export", file, "-o", str(tmp_path / "o")], ["evaluate", file],
        ["query", file, "--entry", "1.4.4.1"], ["build", "--links", "4..6", "-o", file],
    ):  # fmt: skip
        assert main(["catalog", *words]) == 2
        error = capsys.readouterr().err
        assert error.count("\n") == 1 and ("damaged" in error or "malformed" in error)
    assert main(["catalog", "verify", file]) == 1


@pytest.mark.parametrize("words", [["query"], ["verify"], ["evaluate"], ["export", "-o", "out"]])
@pytest.mark.parametrize("kind", ["empty", "text", "database", "old", "folder", "dangling"])
def test_files_that_are_no_catalogues(right, tmp_path, monkeypatch, capsys, words, kind):
    monkeypatch.chdir(tmp_path)
    path = tmp_path / "x"
    if kind == "empty":
        path.touch()
    elif kind == "text":
        path.write_text("links,joints\n" * 1000)
    elif kind == "database":
        with sqlite3.connect(path) as other:
            other.execute("CREATE TABLE chains (chain_id, key)")
        other.close()
    elif kind == "old":
        shutil.copy(right, path)
        with sqlite3.connect(path) as other:
            other.execute("PRAGMA user_version = 2")
        other.close()
    elif kind == "folder":
        path.mkdir()
    else:
        path.symlink_to(tmp_path / "nowhere")
    assert main(["catalog", words[0], str(path), *words[1:]]) == 2
    error = capsys.readouterr().err
    assert error.count("\n") == 1 and str(path) in error
    assert {entry.name for entry in tmp_path.iterdir()} == {"x"}


def test_a_symbolic_link_is_followed(right, tmp_path):
    real, link = tmp_path / "a" / "x.sqlite", tmp_path / "b" / "y.sqlite"
    for path in (real, link):
        path.parent.mkdir()
    shutil.copy(right, real)
    link.symlink_to(real)
    with Catalogue.build(link, [5, 7], 2) as catalogue:
        catalogue.record([Evaluation("2.5.5.1", 0, "3,4", "jamming", "free")])
    with Catalogue(real) as catalogue:
        assert len(catalogue) == 19 + 4
    assert link.is_symlink()
    assert [path.name for path in real.parent.iterdir()] == ["x.sqlite"]


LEFT = """
import os, signal, sys
from graphsynth.atlas.catalogue import Catalogue
Catalogue.build(sys.argv[1], [4, 6], watch=lambda step: step.links == 6 and os.kill(os.getpid(), signal.SIGKILL))
"""


@pytest.fixture(scope="module")
def left(tmp_path_factory):
    """What a killed build leaves: the file and its write-ahead log."""
    path = tmp_path_factory.mktemp("left") / "x.sqlite"
    subprocess.run([sys.executable, "-c", LEFT, path], check=False)
    assert path.with_name("x.sqlite-wal").stat().st_size
    return path


def test_what_a_killed_build_leaves_can_be_read_and_gone_on_with(left, tmp_path):
    for name in ("x.sqlite", "x.sqlite-wal"):
        shutil.copy(left.with_name(name), tmp_path / name)
    path = tmp_path / "x.sqlite"
    with Catalogue(path) as catalogue:
        assert len(catalogue) >= 1
    with Catalogue.build(path, [4, 6]) as catalogue, Catalogue.build(tmp_path / "y.sqlite", [4, 6]) as whole:
        assert catalogue.digest() == whole.digest()
    assert sorted(entry.name for entry in tmp_path.iterdir()) == ["x.sqlite", "y.sqlite"]


def test_without_its_log_it_is_refused_or_gone_on_with(left, tmp_path):
    """Somebody copies the file alone: what is in the log is not there, and is made anew."""
    path = tmp_path / "x.sqlite"
    shutil.copy(left, path)
    try:
        with Catalogue.build(path, [4, 6]) as catalogue:
            assert catalogue.verify().passed
    except FormatError as error:
        assert "\n" not in str(error)


@pytest.mark.parametrize("mode", ["DELETE", "WAL"])
def test_a_file_nobody_may_write_can_be_read(right, tmp_path, mode, monkeypatch):
    """As on a read-only medium, also when the file asks for a log; the superuser is told that he may not write."""
    path = tmp_path / "x.sqlite"
    shutil.copy(right, path)
    with sqlite3.connect(path) as other:
        other.execute(f"PRAGMA journal_mode = {mode}")
    other.close()
    path.chmod(0o444)
    tmp_path.chmod(0o555)
    access = os.access
    monkeypatch.setattr(os, "access", lambda place, mode: mode != os.W_OK and access(place, mode))
    try:
        with Catalogue(path) as catalogue:
            assert len(catalogue) == 19
            assert catalogue.entry("1.4.4.1")["links"] == 4
        assert [entry.name for entry in tmp_path.iterdir()] == ["x.sqlite"]
    finally:
        tmp_path.chmod(0o755)


def test_nothing_is_ever_unpickled():
    """No module of the store names a reader that runs what it reads."""
    from pathlib import Path

    import graphsynth.atlas

    for path in Path(graphsynth.atlas.__file__).parent.rglob("*.py"):
        text = path.read_text()
        for word in ("import pickle", "pickle.load", "read_pickle", "allow_pickle=True", "marshal", "joblib", "eval("):
            assert word not in text, path
