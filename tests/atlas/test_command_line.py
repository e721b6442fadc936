"""``graphsynth catalog`` from the command line."""

from __future__ import annotations

import json
import sqlite3

import pytest

from graphsynth.cli import main


@pytest.fixture(scope="module")
def file(tmp_path_factory):
    path = tmp_path_factory.mktemp("cli") / "c.sqlite"
    assert main(["catalog", "build", "--links", "4..8", "--workers", "1", "-o", str(path)]) == 0
    assert main(["catalog", "build", "--links", "7", "--mobility", "2", "--workers", "1", "-o", str(path)]) == 0
    return path


def told(capsys):
    return capsys.readouterr().out.splitlines()


def test_build_says_what_is_there(file, capsys):
    assert main(["catalog", "build", "--links", "8", "--workers", "1", "-o", str(file), "--json"]) == 0
    said = json.loads(capsys.readouterr().out)
    assert said["chains"] == 22
    assert [(row["mobility"], row["links"], row["listed"]) for row in said["families"]] == [
        (1, 4, 1), (1, 6, 2), (1, 8, 16), (2, 7, 3),
    ]  # fmt: skip
    assert all(row["complete"] for row in said["families"])


def test_query(file, capsys):
    assert main(["catalog", "query", str(file), "--where", "links = 8 AND girth = 4", "--limit", "2"]) == 0
    assert "2 shown: --limit 0 shows all" in told(capsys)[-1]
    assert main(["catalog", "query", str(file), "--where", "links = 6", "--json"]) == 0
    assert [row["key"] for row in json.loads(capsys.readouterr().out)["shown"]] == ["1BgMw8g", "1BgOB7A"]
    assert main(["catalog", "query", str(file), "--sql", "SELECT COUNT(*) AS n FROM chains", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["shown"] == [{"n": 22}]
    assert main(["catalog", "query", str(file), "--where", "class > 99", "--table", "mechanisms"]) == 0
    assert told(capsys) == ["0 rows"]


def test_entry(file, capsys):
    assert main(["catalog", "query", str(file), "--entry", "1.6.4-2.2"]) == 0
    text = capsys.readouterr().out
    assert "parents           1BAN4" in text
    assert "driver 1: class 4, order 2: 4 links class 4 order 2; dimensions not computed" in text
    assert main(["catalog", "query", str(file), "--entry", "1BgOB7A", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["label"] == "1.6.4-2.2"


def test_verify_status(file, tmp_path, capsys):
    assert main(["catalog", "verify", str(file)]) == 0
    assert "all agree" in told(capsys)[-1]
    wrong = tmp_path / "wrong.sqlite"
    wrong.write_bytes(file.read_bytes())
    connection = sqlite3.connect(wrong)
    connection.execute("UPDATE chains SET girth = 5 WHERE label = '1.6.4-2.2'")
    connection.commit()
    connection.close()
    assert main(["catalog", "verify", str(wrong), "--json"]) == 1
    said = json.loads(capsys.readouterr().out)
    assert said["differences"] == ["chain 1.6.4-2.2: chains.girth is 5, recomputed 4"]


def test_shards_and_merge(file, tmp_path, capsys):
    parts = [str(tmp_path / f"{i}.sqlite") for i in (1, 2)]
    for i, part in enumerate(parts, 1):
        assert main(["catalog", "build", "--links", "4..8", "--shard", f"{i}/2", "--workers", "1", "-o", part]) == 0
    assert main(["catalog", "merge", *parts, "-o", str(tmp_path / "all.sqlite")]) == 0
    capsys.readouterr()
    whole = str(tmp_path / "whole.sqlite")
    assert main(["catalog", "build", "--links", "4..8", "--workers", "1", "-o", whole]) == 0
    capsys.readouterr()
    said = []
    for name in (whole, str(tmp_path / "all.sqlite")):
        assert main(["catalog", "export", name, "-o", str(tmp_path / "out"), "--form", "csv", "--json"]) == 0
        said.append(json.loads(capsys.readouterr().out))
    assert said[0] == said[1]


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        (["build", "--links", "20"], "at most 18 links"),
        (["build", "--links", "6", "--executor", "dask"], "go together"),
        (["build", "--links", "6", "--scheduler", "tcp://x:1"], "go together"),
        (["query", "FILE", "--where", "nonsense = 1"], "SQLite refuses"),
        (["query", "FILE", "--table", "nothing"], "there is no table"),
        (["query", "FILE", "--entry", "nothing"], "no chain 'nothing'"),
        (["query", "FILE", "--where", "links = 6", "--sql", "SELECT 1"], "give one of"),
        (["query", "missing.sqlite"], "there is no such catalogue"),
        (["merge", "missing.sqlite", "-o", "x.sqlite"], "there is no such catalogue"),
    ],
)
def test_bad_input_is_one_sentence(file, words, sentence, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert main(["catalog", *(str(file) if word == "FILE" else word for word in words)]) == 2
    error = capsys.readouterr().err
    assert error.count("\n") == 1 and sentence in error
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("links", ["12..4", "0", "a", "4..", "4..999"])
def test_numbers_that_make_no_sense(links, capsys):
    with pytest.raises(SystemExit) as stopped:
        main(["catalog", "build", "--links", links])
    assert stopped.value.code == 2
    assert links in capsys.readouterr().err
