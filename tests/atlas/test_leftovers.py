"""A catalogue beside which a killed process left a journal, or somebody laid one."""

from __future__ import annotations

import os
import shutil
import sqlite3
import struct
from collections.abc import Callable
from contextlib import closing
from pathlib import Path

import pytest

from graphsynth.atlas import schema
from graphsynth.atlas.catalogue import Catalogue
from graphsynth.core.errors import FormatError

LONG = (
    "CREATE TABLE t AS WITH RECURSIVE x(n) AS (SELECT 1 UNION ALL SELECT n + 1 FROM x WHERE n < 9000) SELECT n FROM x"
)


@pytest.fixture(scope="module")
def whole(built, tmp_path_factory: pytest.TempPathFactory) -> Path:
    return built(tmp_path_factory.mktemp("whole"), [4, 6])


@pytest.fixture
def killed(whole: Path, tmp_path: Path) -> Path:
    """A catalogue as a process leaves it that is killed in the middle of a transaction, half of it in the file."""
    own, path = tmp_path / "own.sqlite", tmp_path / "x.sqlite"
    shutil.copy(whole, own)
    with closing(sqlite3.connect(own, isolation_level=None)) as raw:
        raw.execute("PRAGMA cache_size = 1")
        for statement in ("BEGIN IMMEDIATE", "DELETE FROM meta", "DELETE FROM chains", LONG):
            raw.execute(statement)
        for end in ("", "-journal"):
            shutil.copy(f"{own}{end}", f"{path}{end}")
    assert path.read_bytes() != whole.read_bytes()
    return path


def test_a_reader_takes_back_what_was_left_half_done(killed: Path, whole: Path) -> None:
    with Catalogue(killed) as catalogue:
        assert catalogue.verify(quick=True).passed
        assert len(catalogue.query("chains", "1")) == 3
    assert killed.read_bytes() == whole.read_bytes()
    assert not killed.with_name("x.sqlite-journal").exists()


def test_what_is_still_is_not_read_half_done(killed: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(schema, "_is_still", lambda path: True)
    with pytest.raises(FormatError, match=r"stopped half way lies beside it \(x.sqlite-journal\): copy both"):
        Catalogue(killed)
    killed.with_name("x.sqlite-journal").unlink()


def evaluate(path: Path) -> None:
    with Catalogue(path) as catalogue:
        catalogue.evaluate([4], tries=1)


@pytest.mark.parametrize("opened", [Catalogue, evaluate, lambda path: Catalogue.build(path, [5], 2)])
def test_a_journal_deletes_no_other_file(killed: Path, tmp_path: Path, opened: Callable[[Path], object]) -> None:
    """SQLite believes the name that stands at the end of a journal."""
    precious = tmp_path / "precious.txt"
    precious.write_text("of somebody")
    name = str(precious).encode()
    with killed.with_name("x.sqlite-journal").open("ab") as journal:
        journal.write(struct.pack(">I", 2**30 // 4096 + 1) + name + struct.pack(">2I", len(name), sum(name)))
        journal.write(bytes.fromhex("d9d505f920a163d7"))
    with pytest.raises(FormatError, match="which names another file or is none"):
        opened(killed)
    assert precious.exists()


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="no pipes with a name")
def test_a_pipe_beside_the_file_is_not_waited_for(whole: Path, tmp_path: Path) -> None:
    path = tmp_path / "x.sqlite"
    shutil.copy(whole, path)
    os.mkfifo(f"{path}-journal")
    with pytest.raises(FormatError, match="which names another file or is none"):
        Catalogue(path)
