"""A catalogue from somebody else: what it holds is looked at before anything is done with it."""

from __future__ import annotations

import json
import os
import re
import shutil
import sqlite3
import subprocess
import sys

import pytest

from graphsynth.atlas.catalogue import Catalogue
from graphsynth.atlas.evaluations import Evaluation
from graphsynth.atlas.site import build_site
from graphsynth.atlas.tables import SCHEMA_VERSION
from graphsynth.cli import main
from graphsynth.core.errors import FormatError, GraphsynthError, SpecError

from ..telling import said


@pytest.fixture(scope="module")
def right(built, tmp_path_factory):
    path = built(tmp_path_factory.mktemp("right"), [4, 6])
    with Catalogue(path) as catalogue:
        catalogue.record([Evaluation("1.4.4.1", 0, 2, "mass", "found", 0.1, "kg", "estimated", {"seed": 1})])
    return path


@pytest.fixture
def path(right, tmp_path):
    (tmp_path / "in").mkdir()
    return shutil.copy(right, tmp_path / "in" / "x.sqlite")


ADDED = {
    "trigger": "CREATE TRIGGER t AFTER INSERT ON evaluations BEGIN DELETE FROM chains; END",
    "view": "CREATE VIEW v AS SELECT * FROM chains",
    "table": "CREATE TABLE more (a)",
    "virtual table": "CREATE VIRTUAL TABLE v USING fts5(a)",
    "index": "CREATE INDEX i ON chains (abs(girth))",
    "column": "ALTER TABLE chains ADD COLUMN more TEXT",
    "generated column": "ALTER TABLE chains ADD COLUMN more TEXT AS (zeroblob(1000000000))",
    "no table": "DROP TABLE evaluations",
    "view for a table": "ALTER TABLE contracted RENAME TO other; CREATE VIEW contracted AS SELECT * FROM other",
    "checks": "PRAGMA writable_schema = ON; UPDATE sqlite_master SET sql = replace(sql, ' STRICT', '')",
}


@pytest.mark.parametrize("statement", ADDED.values(), ids=ADDED)
def test_a_file_with_other_tables_is_not_opened(path, altered, statement):
    with altered(path) as raw:
        raw.executescript(statement)
    for open_it in (Catalogue, lambda path: Catalogue.build(path, [8])):
        with pytest.raises(FormatError, match=r"its tables are not those of a catalogue|malformed database schema"):
            open_it(path)


HOSTILE = {
    "label": "UPDATE chains SET label = '../../../escaped.1' WHERE chain_id = 1",
    "label with markup": "UPDATE chains SET label = '1.4.4.<b>' WHERE chain_id = 1",
    "label of another": "UPDATE chains SET label = '1.4.5.1' WHERE chain_id = 1",
    "key": "UPDATE chains SET key = '../../escaped' WHERE chain_id = 1",
    "key of another chain": "UPDATE chains SET key = '1CAMBmSzA' WHERE chain_id = 1",
    "edges": "UPDATE contracted SET edges = '<img src=x onerror=alert(1)>' WHERE contracted_id = 2",
    "group": "UPDATE groups SET key = '1\"><script>alert(1)</script>' WHERE group_id = 1",
    "parent": "UPDATE dyads SET parent_key = '</script>'",
    "assortment": "UPDATE chains SET assortment = '<b>' WHERE chain_id = 1",
    "number": "UPDATE chains SET girth = 1e300 WHERE chain_id = 1",
    "text for a number": "UPDATE chains SET automorphisms = '<script>' WHERE chain_id = 1",
    "bytes": "UPDATE chains SET label = X'2e2e2f' WHERE chain_id = 1",
    "infinite": "UPDATE evaluations SET value = 9e999",
    "formula": "UPDATE evaluations SET status = '=cmd|calc'",
    "escape": "UPDATE evaluations SET kind = char(27) || '[2J'",
    "long": "UPDATE evaluations SET data = '\"' || hex(zeroblob(600000)) || '\"'",
    "very long": "UPDATE evaluations SET data = hex(zeroblob(6000000))",
}


@pytest.mark.parametrize("statement", HOSTILE.values(), ids=HOSTILE)
def test_values_of_another_form_are_not_worked_with(path, altered, tmp_path, statement):
    """Whoever made the seal anew: one sentence, and nothing is written anywhere."""
    with altered(path, anything=True) as raw:
        assert raw.execute(statement).rowcount > 0
    found = pytest.raises(FormatError, match=r"values that no catalogue holds|too big|not of a chain as its row says")
    for work in (
        lambda own: build_site(own, tmp_path / "page"),
        lambda own: own.export(tmp_path / "tables") if "CAMB" not in statement else build_site(own, tmp_path / "page"),
    ):
        with found, Catalogue(path) as catalogue:
            work(catalogue)
    if "CAMB" not in statement:
        with found:
            Catalogue.merge(tmp_path / "merged.sqlite", [path])
    with Catalogue(path) as catalogue:
        assert not catalogue.verify().passed
    assert {own.name for own in tmp_path.rglob("*") if own.is_file()} <= {"x.sqlite"}


def test_an_entry_of_values_of_other_types_is_one_sentence(path, altered, capsys):
    with altered(path, anything=True) as raw:
        raw.execute("UPDATE evaluations SET value = 'x'")
    assert main(["catalog", "query", str(path), "--entry", "1.4.4.1"]) == 2
    assert "damaged" in capsys.readouterr().err


def test_data_that_are_too_deep_are_one_sentence(path, altered, capsys):
    for depth in (101, 900, 100_000):
        with altered(path) as raw:
            raw.execute(
                "UPDATE evaluations SET kind = 'dimensions', data = ? WHERE kind != 'jamming'",
                ("[" * depth + "]" * depth,),
            )
        assert main(["catalog", "query", str(path), "--entry", "1.4.4.1", "--json"]) == 2
        assert main(["catalog", "site", str(path), "-o", str(path.parent / "page")]) == 2
        assert capsys.readouterr().err.count(" deep") == 2
        assert main(["catalog", "verify", str(path)]) == 1
        with Catalogue(path) as catalogue:
            catalogue.record([Evaluation("1.4.4.1", 0, 2, "jamming", "undecided")])


def test_nothing_in_a_file_steers_the_terminal(path, altered, capsys):
    with altered(path) as raw:
        raw.execute("UPDATE evaluations SET status = char(27) || ']0;owned' || char(7) || char(8238)")
    assert main(["catalog", "query", str(path), "--table", "evaluations"]) == 0
    assert main(["catalog", "query", str(path), "--entry", "1.4.4.1"]) == 0
    assert main(["catalog", "query", str(path), "--table", "evaluations", "--json"]) == 0
    out = capsys.readouterr().out
    assert out.replace("\n", "").isprintable() and r"\x1b]0;owned\x07\u202e" in out


# --- the seal

#: What recomputation cannot know.
SILENT = {
    "kind": "UPDATE evaluations SET kind = 'masse'",
    "status": "UPDATE evaluations SET status = 'found out'",
    "unit": "UPDATE evaluations SET unit = 'g'",
    "value": "UPDATE evaluations SET value = 0.2",
    "data": "UPDATE evaluations SET data = replace(data, '1', '2')",
    "an evaluation gone": "DELETE FROM evaluations",
    "no seal": "DELETE FROM meta",
    "another seal": "UPDATE meta SET value = replace(value, 'a', 'b')",
    "two seals": "INSERT INTO meta VALUES ('other', '')",
    "number in the header": f"PRAGMA user_version = {SCHEMA_VERSION}; VACUUM",
}


@pytest.mark.parametrize("statement", SILENT.values(), ids=SILENT)
def test_a_change_that_nothing_recomputes_is_found(path, altered, statement):
    with altered(path, sealed=False) as raw:
        raw.executescript(statement)
    with Catalogue(path) as catalogue:
        (said,) = catalogue.verify().differences
        assert said.startswith("file: it was changed") or (statement == SILENT["no seal"] and "no seal" in said)
        quick = catalogue.verify(quick=True)
        assert quick.differences == (said,) and quick.compared == {"file": 1}
    assert main(["catalog", "verify", "--quick", str(path)]) == 1


def test_a_changed_byte_is_found_on_every_page(right, tmp_path):
    """But for the bytes that say who wrote last, and for the page that holds the seal and nothing else."""
    data = right.read_bytes()
    with Catalogue(right) as catalogue:
        place = catalogue.connection.execute("SELECT rootpage FROM sqlite_master WHERE name = 'meta'").fetchone()[0]
        assert catalogue.verify(quick=True).passed
    path = tmp_path / "y.sqlite"
    for page in range(len(data) // 4096):
        changed = bytearray(data)
        changed[page * 4096 + 3000] ^= 1
        path.write_bytes(changed)
        try:
            with Catalogue(path) as catalogue:
                found = catalogue.verify(quick=True).passed
        except FormatError:
            found = False
        assert found == (page == place - 1)


def test_a_file_that_others_changed_is_not_written_and_not_merged(path, tmp_path, altered):
    with altered(path, sealed=False) as raw:
        raw.execute("UPDATE evaluations SET value = 0.2")
    before = path.read_bytes()
    with pytest.raises(FormatError, match="changed after graphsynth wrote it"):
        Catalogue.build(path, [8])
    with pytest.raises(FormatError, match="changed after graphsynth wrote it"), Catalogue(path) as catalogue:
        catalogue.record([Evaluation("1.4.4.1", 0, 2, "mass", "found", 1.0, "kg", "estimated")])
    with pytest.raises(FormatError, match="copy the shard again"):
        Catalogue.merge(tmp_path / "merged.sqlite", [path])
    assert path.read_bytes() == before and not (tmp_path / "merged.sqlite").exists()


def test_a_log_that_others_left_is_found(path):
    script = (
        "import sqlite3, os, sys\nraw = sqlite3.connect(sys.argv[1], isolation_level=None)\n"
        "raw.execute('PRAGMA journal_mode = WAL')\nraw.execute('UPDATE evaluations SET value = 7.0')\nos._exit(0)"
    )
    subprocess.run([sys.executable, "-c", script, path], check=True)
    with Catalogue(path) as catalogue:
        assert "a log lies beside it" in catalogue.verify(quick=True).differences[0]
    with pytest.raises(FormatError, match="changed after graphsynth wrote it"):
        Catalogue.build(path, [8])


def test_a_log_of_what_was_never_done_is_dropped(path):
    """A process is killed in its first transaction, when it has written so much that a part is in the log."""
    script = (
        "import sqlite3, os, sys\nraw = sqlite3.connect(sys.argv[1], isolation_level=None)\n"
        "raw.execute('PRAGMA journal_mode = WAL')\nraw.execute('PRAGMA cache_size = 1')\nraw.execute('BEGIN')\n"
        "raw.execute('DELETE FROM meta')\nraw.execute('UPDATE chains SET girth = girth - 1')\n"
        "raw.execute('DELETE FROM driven')\nraw.execute('DELETE FROM inversions')\nos._exit(0)"
    )
    subprocess.run([sys.executable, "-c", script, path], check=True)
    assert path.with_name("x.sqlite-wal").stat().st_size > 0
    with Catalogue.build(path, [4, 6]) as catalogue:
        assert catalogue.verify().passed


# --- questions


ENDLESS = "WITH RECURSIVE x(n) AS (SELECT 1 UNION ALL SELECT n + 1 FROM x) SELECT {} FROM x"


def test_only_the_rows_that_are_shown_are_read(path, capsys):
    assert main(["catalog", "query", str(path), "--sql", ENDLESS.format("n"), "--limit", "3", "--json"]) == 0
    assert capsys.readouterr().out == '{"rows": null, "shown": [{"n": 1}, {"n": 2}, {"n": 3}]}\n'
    with Catalogue(path) as catalogue:
        assert catalogue.sql(ENDLESS.format("n"), limit=5).attrs["more"]
        assert not catalogue.query("chains", limit=3).attrs["more"]
        assert len(catalogue.query("chains", limit=0)) == 0
        with pytest.raises(SpecError, match="limit = -1 must be 0 or more"):
            catalogue.sql("SELECT 1", limit=-1)


@pytest.mark.long
def test_questions_are_bounded_in_time_and_memory(path, capsys):
    assert main(["catalog", "query", str(path), "--sql", ENDLESS.format("COUNT(*)"), "--seconds", "0.2"]) == 2
    assert "takes more than 0.2 s: ask for less, or allow more seconds" in capsys.readouterr().err
    with Catalogue(path) as catalogue:
        with pytest.raises(SpecError, match="too big"):
            catalogue.sql("SELECT zeroblob(1000000000)")
        with pytest.raises(SpecError, match="too big"):
            catalogue.sql("SELECT group_concat(zeroblob(1000000)) FROM driven")
        with pytest.raises(SpecError, match="too many columns"):
            catalogue.sql(f"SELECT {', '.join(['1'] * 101)}")
        with pytest.raises(SpecError, match=r"takes more than 400 MB after \d+ rows"):
            catalogue.sql("SELECT zeroblob(4900000) FROM driven a, driven b")
        assert len(catalogue) == 3


def test_columns_of_one_name_and_bytes_can_be_shown(path, capsys):
    assert main(["catalog", "query", str(path), "--sql", "SELECT 1 AS a, x'ff' AS a", "--json"]) == 0
    assert capsys.readouterr().out == '{"rows": 1, "shown": [{"a": 1, "a:2": "ff"}]}\n'
    assert main(["catalog", "query", str(path), "--sql", "SELECT 1 AS a, x'ff' AS a"]) == 0


def test_a_lock_that_is_not_waited_for_is_tried_again(path, monkeypatch):
    # two writers that change the journal's mode in the same moment: SQLite refuses one of them at once
    from graphsynth.atlas import schema

    refused = sqlite3.OperationalError("database is locked")
    refused.sqlite_errorcode = sqlite3.SQLITE_BUSY
    tries, check = [], schema._check_seal

    def busy_twice(*args):
        tries.append(args)
        if len(tries) < 3:
            raise refused
        return check(*args)

    monkeypatch.setattr(schema, "_check_seal", busy_twice)
    evaluation = Evaluation("1.4.4.1", 0, 2, "mass", "found", 2.0, "kg", "estimated")
    with Catalogue(path) as catalogue:
        catalogue.record([evaluation])
        assert len(tries) == 3
        monkeypatch.setattr(schema, "_PATIENCE", 0.0)
        tries.clear()
        with pytest.raises(FormatError, match="database is locked"):
            catalogue.record([evaluation])


def test_several_threads_share_one_catalogue(path):
    from concurrent.futures import ThreadPoolExecutor

    with Catalogue(path) as catalogue, ThreadPoolExecutor(8) as pool:
        work = [
            lambda: len(catalogue), lambda: catalogue.digest(), lambda: catalogue.entry("1.6.4-2.1")["key"],
            lambda: len(catalogue.query("mechanisms", "class = ?", [2])), lambda: catalogue.verify(quick=True).passed,
            lambda: catalogue.record([Evaluation("1.4.4.1", 0, 2, "mass", "found", 2.0, "kg", "estimated")]),
        ]  # fmt: skip
        for one in work:
            results = {future.result() for future in [pool.submit(one) for _ in range(6)]}
            assert results == {one()}
        mixed = [pool.submit(one) for _ in range(5) for one in work[:5]]
        assert all(future.result() for future in mixed)


def test_a_closed_catalogue_says_so(path):
    catalogue = Catalogue(path)
    catalogue.close()
    for work in (catalogue.query, catalogue.digest, lambda: len(catalogue), lambda: catalogue.entry("1.4.4.1")):
        with pytest.raises(GraphsynthError, match=r"is closed: open it again"):
            work()


# --- tables


def test_tables_are_exported_by_the_plain_install(path, tmp_path, monkeypatch, capsys):
    for name in ("pyarrow", "pyarrow.parquet"):
        monkeypatch.setitem(sys.modules, name, None)
    assert main(["catalog", "export", str(path), "-o", str(tmp_path / "out")]) == 0
    assert "chains.csv" in {own.name for own in (tmp_path / "out").iterdir()}
    capsys.readouterr()
    assert main(["catalog", "export", str(path), "-o", str(tmp_path / "out"), "--form", "parquet"]) == 2
    assert capsys.readouterr().err == (
        "graphsynth: Parquet (csv and jsonl need nothing) needs pyarrow, which is not installed; "
        "pip install 'graphsynth[parquet]'\n"
    )


FULL = """
import resource, signal, sys
from graphsynth.cli import main
signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
resource.setrlimit(resource.RLIMIT_FSIZE, (int(sys.argv[1]), int(sys.argv[1])))
sys.exit(main(["catalog", *sys.argv[2:]]))
"""


@pytest.mark.long
@pytest.mark.skipif(sys.platform != "linux", reason="limits on the size of files as Linux has them")
@pytest.mark.parametrize(
    ("words", "name"),
    [
        (["export", "FILE", "-o", "out"], "out/"),
        (["export", "FILE", "-o", "out", "--form", "parquet"], "out/"),
        (["site", "FILE", "-o", "out"], r"/new/\S+\.(css|js|html) cannot be written"),
        (["merge", "FILE", "-o", "out"], "out"),
    ],
)
def test_a_full_disk_names_the_file_and_the_remedy(path, tmp_path, words, name):
    if "parquet" in words:
        pytest.importorskip("pyarrow")
    words = [str(path) if word == "FILE" else word for word in words]
    command = [sys.executable, "-c", FULL, "300", *words]
    plain = dict(os.environ)  # without the width of a terminal that readline tells the processes of pytest
    done = subprocess.run(command, capture_output=True, text=True, check=False, cwd=tmp_path, env=plain)
    assert (done.returncode, len(said(done.stderr))) == (2, 1), done.stderr
    assert re.search(name, done.stderr) and ("make room" in done.stderr)
    left = {own.name for own in tmp_path.rglob("*") if own.is_file()} - {"x.sqlite"}
    assert not {own for own in left if own.endswith((".new", ".js", ".html"))}


def test_a_trial_of_the_helper(path, altered):
    """The helper of these tests leaves the tables as they are, and a right seal."""
    with altered(path, anything=True) as raw:
        raw.execute("UPDATE chains SET girth = 'x' WHERE chain_id = 1")
    with Catalogue(path) as catalogue:
        assert catalogue.verify(quick=True).passed
        assert catalogue.query("chains", "chain_id = 1")["girth"].tolist() == ["x"]
    with sqlite3.connect(path) as raw, pytest.raises(sqlite3.IntegrityError):
        raw.execute("UPDATE chains SET girth = 'y' WHERE chain_id = 1")
    raw.close()


@pytest.mark.parametrize(
    ("own", "words"),
    [
        ({"kind": ""}, "kind = ''"),
        ({"status": "=1+1"}, "status = '=1"),
        ({"unit": ""}, "unit = ''"),
        ({"kind": "a\x1b[2J"}, "kind = 'a"),
        ({"status": "x" * 201}, "1 to 200 characters"),
        ({"data": ["x" * 1_000_000]}, "more than 1000000 characters"),
        ({"data": json.loads("[" * 150 + "]" * 150)}, "100 lists and objects deep"),
    ],
)
def test_evaluations_that_no_catalogue_holds_are_refused_when_they_are_made(own, words):
    usual = {"chain": "1.4.4.1", "frame": 0, "driver": 2, "kind": "mass", "status": "found"}
    with pytest.raises(SpecError, match=words):
        Evaluation(**usual | own)
