"""The store: same content however built, killed, refused by the disk; questions, entries, evaluations."""

from __future__ import annotations

import contextlib
import json
import math
import os
import random
import shutil
import signal
import sqlite3
import subprocess
import sys
import time
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from pathlib import Path

import pytest

from graphsynth.atlas import building, making
from graphsynth.atlas.catalogue import Catalogue
from graphsynth.atlas.evaluations import Evaluation
from graphsynth.atlas.schema import connect
from graphsynth.core.errors import FormatError, GraphsynthError, SpecError, TooLargeError

from ..telling import said

TABLES = ("families", "pieces", "contracted", "groups", "structures", "chains", "dyads", "inversions", "driven")


def rows(catalogue):
    """Return all rows with all numbers: stronger than the digest."""
    return {table: catalogue.connection.execute(f"SELECT * FROM {table}").fetchall() for table in TABLES}


@pytest.fixture(scope="module")
def small(built, tmp_path_factory):
    """Four to ten links, W = 1; and W = 2 with fractionated chains."""
    path = built(tmp_path_factory.mktemp("small"), range(4, 11), with_two=range(5, 10))
    with Catalogue(path) as catalogue:
        yield catalogue


@pytest.fixture(scope="module")
def twelve(tmp_path_factory):
    with Catalogue.build(tmp_path_factory.mktemp("twelve") / "x.sqlite", range(8, 13)) as catalogue:
        yield catalogue


#: A bound on pieces that cuts ten links into many.
FINE = 10.0


@pytest.fixture
def fine(monkeypatch):
    monkeypatch.setattr(making, "PIECE", FINE)


@pytest.fixture(scope="module")
def many(tmp_path_factory):
    """Four to ten links in many pieces."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(making, "PIECE", FINE)
        with Catalogue.build(tmp_path_factory.mktemp("many") / "x.sqlite", range(4, 11)) as catalogue:
            assert catalogue.sql("SELECT SUM(pieces) AS n FROM families")["n"][0] > 20
            yield catalogue


# --- content


def test_every_family_agrees_with_counting_and_with_the_literature(small):
    statement = small.completeness()
    assert statement["complete"].all()
    assert statement["published"].tolist() == [1, 2, 16, 230, 1, 4, 40]


@pytest.mark.long
def test_counts_per_row_of_the_published_tables(small, twelve):
    import tomllib

    published = tomllib.loads((Path(__file__).parents[2] / "catalog" / "counts" / "published.toml").read_text())

    def count(catalogue, where):
        return int(catalogue.sql(f"SELECT COUNT(*) AS n FROM chains WHERE mobility = 1 AND {where}")["n"][0])

    for n2, n3, n4, n5, wanted in published["by_assortment"]["rows"]:
        name = "-".join(map(str, (n2, n3, n4, n5))).removesuffix("-0").removesuffix("-0")
        assert count(small, f"links = 10 AND assortment = '{name}'") == wanted
    by_kind = {}
    for name in twelve.query("chains", "links = 12")["assortment"]:
        other = sum(map(int, name.split("-")[1:]))
        by_kind[str(other)] = by_kind.get(str(other), 0) + 1
    assert by_kind == published["by_non_binary_links"]["counts"]
    for row in published["non_planar"]:
        assert count(twelve, f"links = {row['links']} AND NOT planar") == row["count"]
    for row in published["asymmetric"]:
        assert count(twelve, f"links = {row['links']} AND automorphisms = 1") == row["count"]
    for links, wanted in published["mechanisms"]["counts"].items():
        catalogue = small if int(links) < 8 else twelve
        select = f"SELECT SUM(inversions) AS n FROM chains WHERE mobility = 1 AND links = {links}"
        assert catalogue.sql(select)["n"][0] == wanted
    for loops, wanted in published["contracted"]["with_chain"].items():
        if 2 <= int(loops) <= 5:
            catalogue = small if int(loops) < 3 else twelve
            select = f"SELECT COUNT(DISTINCT contracted_id) AS n FROM chains WHERE mobility = 1 AND loops = {loops}"
            assert catalogue.sql(select)["n"][0] == wanted
    for size, wanted in published["assur_groups"]["counts"].items():
        if int(size) == 10:  # every group of ten links moves some chain of twelve
            assert twelve.sql("SELECT COUNT(*) AS n FROM groups WHERE links = 10")["n"][0] == wanted


def test_modes_and_curves_are_those_published(small):
    """Dyads 2, triads 6, groups of six links 14, 16, 18; degrees of six-bars 14, 16, 18; products for mechanisms."""
    modes = small.sql("SELECT links, modes FROM groups WHERE links < 7 GROUP BY links, modes ORDER BY links, modes")
    assert modes.to_numpy().tolist() == [[2, 2], [4, 6], [6, 14], [6, 16], [6, 18]]
    six = small.sql("SELECT degree, genus, degrees FROM inversions JOIN chains USING (chain_id) WHERE links = 6")
    assert {int(own) for text in six["degrees"] for own in text.split()} == {0, 2, 6, 14, 16, 18}
    assert sorted(zip(six["degree"], six["genus"])) == [(6, 1), (16, 5), (16, 7), (18, 7), (18, 7)]
    own = dict(small.sql("SELECT group_id, modes FROM groups").itertuples(index=False, name=None))
    for groups, product in small.sql("SELECT groups, modes FROM structures").itertuples(index=False, name=None):
        assert product == math.prod(own[int(group)] for group in groups.split())


def test_the_statement_repeats_the_published_table():
    import tomllib

    from graphsynth.atlas.statement import PUBLISHED

    table = tomllib.loads((Path(__file__).parents[2] / "catalog" / "counts" / "published.toml").read_text())
    for row in table["chains"]:
        if row["links"] <= 18:
            own = PUBLISHED[row["mobility"], row["links"]][:2]
            assert own == (row["count"], row.get("with_fractionated", row["count"]))


def test_labels_name_family_links_assortment_and_rank(small):
    frame = small.query("chains", "mobility = 1 AND links = 8")
    for assortment, group in frame.groupby("assortment"):
        ranked = group.sort_values("key")["label"].tolist()
        assert ranked == [f"1.8.{assortment}.{rank}" for rank in range(1, len(ranked) + 1)]
    assert small.chain("1.8.4-4.1").key == small.query("chains", "label = ?", ["1.8.4-4.1"])["key"][0]


def test_parents_and_children_mirror_each_other(small):
    entry = small.entry("1.6.4-2.1")
    assert entry["parents"] == ["1BAN4"]
    for child in entry["children"]:
        assert entry["key"] in small.entry(child)["parents"]
    relatives = small.query("relatives", "parent_key = ?", [entry["key"]])
    assert sorted(relatives["child_key"]) == sorted(entry["children"])


def test_an_entry_is_json_and_says_what_was_not_computed(small):
    entry = json.loads(json.dumps(small.entry("1.4.4.1")))
    (mechanism,) = entry["mechanisms"]
    assert mechanism["evaluations"] == dict.fromkeys(("dimensions", "transmission", "jamming"), "not computed")
    assert mechanism["groups"] == [{"key": "1Awvg", "links": 2, "order": 2, "class": 2, "modes": 2}]


# --- the same, however built


def test_executors_and_order_do_not_matter(small, tmp_path):
    with ThreadPoolExecutor(3) as executor:
        Catalogue.build(tmp_path / "x.sqlite", [10, 8], executor=executor).close()
        Catalogue.build(tmp_path / "x.sqlite", range(5, 10), 2, fractionated=True, executor=executor).close()
        with Catalogue.build(tmp_path / "x.sqlite", [4, 6, 7, 8], executor=executor) as other:
            assert other.digest() == small.digest()


@pytest.mark.long
def test_processes_give_the_same_rows(many, tmp_path, fine):
    from graphsynth.atlas.making import processes

    with processes(2) as executor, Catalogue.build(tmp_path / "x.sqlite", range(4, 11), executor=executor) as other:
        assert rows(other) == rows(many)


@pytest.mark.long
def test_merged_shards_are_the_catalogue_to_the_last_number(many, tmp_path, fine):
    parts = [tmp_path / f"{i}.sqlite" for i in (1, 2, 3)]
    for i, part in enumerate(parts, 1):
        Catalogue.build(part, range(4, 11), shard=(i, 3)).close()
    for number, order in enumerate(([0, 1, 2], [2, 0, 1])):
        with Catalogue.merge(tmp_path / f"m{number}.sqlite", [parts[i] for i in order]) as merged:
            assert rows(merged) == rows(many)
            assert merged.digest() == many.digest()
    with pytest.raises(GraphsynthError, match="are in none of the files"):
        Catalogue.merge(tmp_path / "x.sqlite", parts[:2])
    assert not (tmp_path / "x.sqlite").exists()
    with pytest.raises(GraphsynthError, match="give every shard once"):
        Catalogue.merge(tmp_path / "y.sqlite", [*parts, parts[0]])
    with pytest.raises(SpecError, match="is one of the shards"):
        Catalogue.merge(parts[0], parts)


@pytest.mark.long
def test_equal_catalogues_give_equal_bytes(small, tmp_path):
    with Catalogue.build(tmp_path / "x.sqlite", range(5, 10), 2, fractionated=True) as first:
        pass
    with Catalogue.build(tmp_path / "x.sqlite", reversed(range(4, 11))) as other:
        assert rows(other)["chains"] != rows(small)["chains"]  # numbered in another order
        for form in ("csv", "jsonl", "parquet"):
            if form == "parquet":
                pytest.importorskip("pyarrow")
            one, two = small.export(tmp_path / "one", form), other.export(tmp_path / "two", form)
            assert [path.read_bytes() for path in one] == [path.read_bytes() for path in two]
    assert first.path == other.path


def test_the_parquet_export_holds_what_the_catalogue_holds(small, tmp_path):
    pytest.importorskip("pyarrow")
    import pandas as pd

    small.export(tmp_path, "parquet")
    chains = pd.read_parquet(tmp_path / "chains.parquet")
    own = small.sql("SELECT * FROM chains ORDER BY mobility, links, key")
    for column in ("key", "label", "graph6", "loops", "automorphisms", "girth", "planar"):
        assert chains[column].tolist() == own[column].tolist()
    mechanisms = pd.read_parquet(tmp_path / "mechanisms.parquet")
    assert len(mechanisms) == small.sql("SELECT COUNT(*) AS n FROM mechanisms")["n"][0]
    groups = pd.read_parquet(tmp_path / "groups.parquet").set_index("group")
    classes = [max(groups["class"][int(g)] for g in text.split()) for text in mechanisms["groups"]]
    assert classes == mechanisms["class"].tolist()


@pytest.mark.long
@pytest.mark.parametrize(("piece", "most"), [(3.0, 100_000), (0.5, 100_000), (3.0, 10)])
def test_however_small_the_pieces_each_chain_comes_once(piece, most, monkeypatch):
    """Also when single contracted graphs are cut by their search prefixes."""
    monkeypatch.setattr(making, "PIECE", piece)
    monkeypatch.setattr(making, "MOST_PIECES", most)
    tasks = making.tasks_of(10, 1, False)
    assert most == 10 or max(getattr(task.piece, "parts", 1) for task in tasks) > 10
    keys = [chain[0] for task in tasks for chain in making.rows_of_task(task).chains]
    assert len(keys) == len(set(keys)) == 230


# --- interrupted, killed, refused


def interrupted_at(stop):
    count = 0

    def watch(step):
        nonlocal count
        count += 1
        if count == stop:
            raise KeyboardInterrupt

    return watch


@pytest.mark.long
@pytest.mark.parametrize("stop", [1, 5, 9])
def test_an_interrupted_build_goes_on(many, tmp_path, fine, stop):
    with pytest.raises(KeyboardInterrupt):
        Catalogue.build(tmp_path / "x.sqlite", range(4, 11), watch=interrupted_at(stop))
    with Catalogue.build(tmp_path / "x.sqlite", range(4, 11)) as resumed:
        assert rows(resumed) == rows(many)


# One process imports everything and waits; each build is a child that it forks.
SCRIPT = """
import os, sys
from graphsynth.atlas import making
from graphsynth.atlas.catalogue import Catalogue
for task in making.tasks_of(6, 1, False):
    making.rows_of_task(task)
making.PIECE = {fine}
for path in sys.stdin:
    child = os.fork()
    if child == 0:
        Catalogue.build(path.strip(), range(4, 11)).close()
        os._exit(0)
    print(child, flush=True)
    print(os.waitpid(child, 0)[1], flush=True)
"""


@pytest.fixture
def builder():
    command = [sys.executable, "-c", SCRIPT.format(fine=FINE)]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True) as process:
        yield process
        process.stdin.close()


def build_and_kill(builder, path, seconds):
    """Kill a build after some seconds; return whether it was still at work."""
    builder.stdin.write(f"{path}\n")
    builder.stdin.flush()
    child = int(builder.stdout.readline())
    time.sleep(seconds)
    with contextlib.suppress(ProcessLookupError):
        os.kill(child, signal.SIGKILL)
    return int(builder.stdout.readline()) == signal.SIGKILL


@pytest.mark.slow
@pytest.mark.skipif(not hasattr(os, "fork"), reason="builds are forked")
@pytest.mark.parametrize("moments", [pytest.param(50, marks=pytest.mark.slow), 5])
def test_kill_at_random_moments(many, builder, tmp_path, fine, moments):
    """Each file is killed some times, then built to its end: always the same rows."""
    choice = random.Random(20)
    seconds = 0.1  # follows the speed of the machine, so that kills fall on all parts of a build
    killed, number, progress = 0, 0, set()
    while killed < moments:
        path = tmp_path / f"{number}.sqlite"
        number += 1
        for _ in range(choice.randint(1, 3)):
            if not build_and_kill(builder, path, choice.uniform(0.0, seconds)):
                seconds *= 0.7
                break
            killed += 1
            seconds *= 1.2
            if path.exists() and path.stat().st_size:
                check = sqlite3.connect(path)
                assert check.execute("PRAGMA integrity_check").fetchone() == ("ok",)
                tables = check.execute("SELECT COUNT(*) FROM sqlite_master WHERE name = 'pieces'").fetchone()[0]
                progress.add(check.execute("SELECT COUNT(*) FROM pieces").fetchone()[0] if tables else -1)
                check.close()
        with Catalogue.build(path, range(4, 11)) as resumed:
            assert rows(resumed) == rows(many)
            assert resumed.digest() == many.digest()
        path.unlink()
    assert moments < 20 or len(progress) > 5  # the kills fell on different parts of the work


def test_a_full_disk_is_one_sentence_and_the_build_goes_on(many, tmp_path, fine, monkeypatch):
    path = tmp_path / "x.sqlite"
    size = many.path.stat().st_size

    def limited(pages, path, **options):
        connection = connect(path, **options)
        connection.execute(f"PRAGMA max_page_count = {pages}")
        return connection

    for share in (0.3, 0.6, 0.9):
        with monkeypatch.context() as patch:
            patch.setattr("graphsynth.atlas.making.connect", partial(limited, int(share * size) // 4096))
            with pytest.raises(GraphsynthError, match=r"cannot be written \(database or disk is full\)"):
                Catalogue.build(path, range(4, 11))
        connection = sqlite3.connect(path)
        assert connection.execute("PRAGMA integrity_check").fetchone() == ("ok",)
        connection.close()
    with Catalogue.build(path, range(4, 11)) as resumed:
        assert rows(resumed) == rows(many)


LIMITED = """
import resource, signal, sys
from graphsynth.atlas import making
from graphsynth.cli import main
making.PIECE = {fine}
signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
resource.setrlimit(resource.RLIMIT_FSIZE, (int(sys.argv[2]), int(sys.argv[2])))
sys.exit(main(["catalog", "build", "--links", "4..10", "--workers", "1", "-o", sys.argv[1]]))
"""


@pytest.mark.long
@pytest.mark.skipif(sys.platform != "linux", reason="limits on the size of files as Linux has them")
def test_a_file_that_may_not_grow_is_one_sentence_and_the_build_goes_on(many, tmp_path, fine):
    path = tmp_path / "x.sqlite"
    command = [sys.executable, "-c", LIMITED.format(fine=FINE), path, "200000"]
    plain = dict(os.environ)  # without the width of a terminal that readline tells the processes of pytest
    done = subprocess.run(command, capture_output=True, text=True, check=False, env=plain)
    assert (done.returncode, len(said(done.stderr))) == (2, 1), done.stderr
    assert "the catalogue cannot be written" in done.stderr
    with Catalogue.build(path, range(4, 11)) as resumed:
        assert rows(resumed) == rows(many)


def test_places_that_cannot_be_written(tmp_path, small):
    with pytest.raises(FormatError, match="folder of the catalogue does not exist"):
        Catalogue.build(tmp_path / "no" / "x.sqlite", [4])
    if Path("/proc/version").exists():
        with pytest.raises(FormatError, match="unable to open"):
            Catalogue.build("/proc/x.sqlite", [4])
        with pytest.raises(GraphsynthError, match="cannot be written"):
            small.export("/proc/x")


@pytest.mark.skipif(hasattr(os, "geteuid") and os.geteuid() == 0, reason="the superuser may write everywhere")
def test_a_read_only_file_and_folder(tmp_path, small):
    path = tmp_path / "x.sqlite"
    shutil.copy(small.path, path)
    path.chmod(0o444)
    tmp_path.chmod(0o555)
    try:
        with pytest.raises(GraphsynthError, match="read"):
            Catalogue.build(path, [12])
        with Catalogue(path) as catalogue:  # but it can be read
            assert catalogue.digest() == small.digest()
    finally:
        tmp_path.chmod(0o755)


def test_a_connection_that_may_only_read_is_told_in_one_sentence(tmp_path, monkeypatch):
    path = tmp_path / "x.sqlite"
    Catalogue.build(path, [4]).close()
    monkeypatch.setattr("graphsynth.atlas.making.connect", lambda path, create: connect(path, readonly=True))
    with pytest.raises(GraphsynthError, match=r"cannot be written .*readonly"):
        Catalogue.build(path, [6])
    monkeypatch.undo()
    with Catalogue.build(path, [6]) as catalogue, Catalogue.build(tmp_path / "y.sqlite", [4, 6]) as fresh:
        assert rows(catalogue) == rows(fresh)


def test_a_second_writer_is_refused_and_harms_nothing(many, tmp_path, fine):
    path = tmp_path / "x.sqlite"

    def build_too(step):
        if step.links == 10 and step.done < 0.5:
            Catalogue.build(path, range(4, 11)).close()

    with pytest.raises(GraphsynthError, match="another process writes this catalogue"):
        Catalogue.build(path, range(4, 11), watch=build_too)
    with Catalogue.build(path, range(4, 11)) as catalogue:
        assert rows(catalogue) == rows(many)


def test_a_finished_file_is_one_plain_file(small):
    assert sorted(path.name for path in small.path.parent.iterdir()) == [small.path.name]
    assert small.path.read_bytes()[18:20] == b"\x01\x01"  # not a write-ahead log: readable from read-only places


def test_families_are_not_mixed(tmp_path):
    path = tmp_path / "x.sqlite"
    Catalogue.build(path, [7], 2).close()
    with pytest.raises(GraphsynthError, match="without fractionated ones, not with"):
        Catalogue.build(path, [7], 2, fractionated=True)
    Catalogue.build(tmp_path / "s.sqlite", [8], shard=(1, 2)).close()
    with pytest.raises(GraphsynthError, match="holds part 1/2"):
        Catalogue.build(tmp_path / "s.sqlite", [8])


def test_a_wrong_number_of_chains_is_never_called_complete(tmp_path, monkeypatch):
    monkeypatch.setattr(building.Writer, "write", lambda self, family_id, mobility, piece, rows: None)
    with pytest.raises(GraphsynthError, match="counting gives 2"):
        Catalogue.build(tmp_path / "x.sqlite", [6])
    assert not Catalogue(tmp_path / "x.sqlite").completeness()["complete"].any()


# --- refusals of questions


@pytest.mark.parametrize(
    ("links", "mobility", "error"),
    [([], 1, SpecError), ([19], 1, TooLargeError), ([6], 0, SpecError), ([6], -1, SpecError)],
)
def test_questions_without_sense_leave_no_file(links, mobility, error, tmp_path):
    with pytest.raises(error):
        Catalogue.build(tmp_path / "x.sqlite", links, mobility)
    assert not list(tmp_path.iterdir()) or mobility < 1


def test_other_files_are_no_catalogues(tmp_path):
    (tmp_path / "text").write_text("not a database, but long enough to have a header of its own" * 9)
    (tmp_path / "empty").write_bytes(b"")
    other = sqlite3.connect(tmp_path / "other")
    other.execute("CREATE TABLE chains (key)")
    other.commit()
    other.close()
    before = (tmp_path / "other").read_bytes()
    for name in ("text", "empty", "other", "missing"):
        with pytest.raises(FormatError):
            Catalogue(tmp_path / name)
    for name in ("text", "other"):
        with pytest.raises(FormatError):
            Catalogue.build(tmp_path / name, [4])
    assert (tmp_path / "other").read_bytes() == before


def test_a_catalogue_of_another_version_is_refused(tmp_path):
    Catalogue.build(tmp_path / "x.sqlite", [4]).close()
    connection = sqlite3.connect(tmp_path / "x.sqlite")
    connection.execute("PRAGMA user_version = 99")
    connection.close()
    with pytest.raises(FormatError, match="schema version 99"):
        Catalogue(tmp_path / "x.sqlite")


@pytest.mark.parametrize("text", ["SELECT", "DELETE FROM chains", "SELECT nothing FROM chains", "SELECT 1; SELECT 2"])
def test_sql_that_is_refused(small, text):
    with pytest.raises(SpecError, match="SQLite refuses"):
        small.sql(text)


def test_unknown_names_are_refused(small):
    with pytest.raises(SpecError, match="no table 'sqlite_master'"):
        small.query("sqlite_master")
    with pytest.raises(SpecError, match="no chain"):
        small.entry("1.8.4-4.999")
    with pytest.raises(SpecError, match="no form"):
        small.export("x", "xlsx")


# --- evaluations


def test_evaluations_are_kept_shown_and_replaced(tmp_path):
    catalogue = Catalogue.build(tmp_path / "x.sqlite", [4, 6])
    first = Evaluation("1.4.4.1", 0, 2, "transmission", "found", 0.71, "rad", "estimated", {"range": [0, 6.28]})
    assert catalogue.record([first, Evaluation("1.4.4.1", 0, 2, "jamming", "undecided")]) == 2
    (mechanism,) = catalogue.entry("1.4.4.1")["mechanisms"]
    assert mechanism["evaluations"]["transmission"] == {
        "status": "found", "value": 0.71, "unit": "rad", "guarantee": "estimated", "data": {"range": [0, 6.28]},
    }  # fmt: skip
    assert mechanism["evaluations"]["jamming"]["status"] == "undecided"
    assert mechanism["evaluations"]["dimensions"] == "not computed"
    catalogue.record([Evaluation("1BAN4", 0, 2, "transmission", "found", 0.5, "rad", "certified")])
    assert catalogue.query("evaluations", "kind = 'transmission'")["value"].tolist() == [0.5]
    with pytest.raises(SpecError, match="no mechanism"):
        catalogue.record([first, Evaluation("1.4.4.1", 0, 1, "jamming", "free")])
    assert len(catalogue.query("evaluations")) == 2
    assert catalogue.verify().passed
    with Catalogue.build(tmp_path / "y.sqlite", [4, 6]) as plain:  # the digest is of structure alone
        assert plain.digest() == catalogue.digest()
    catalogue.close()


@pytest.mark.parametrize(
    "given",
    [{"value": float("nan")}, {"value": float("inf")}, {"guarantee": "sure"}, {"status": ""}, {"data": {1, 2}},
     {"data": float("nan")}],
)  # fmt: skip
def test_evaluations_without_sense_are_refused(given):
    with pytest.raises(SpecError):
        Evaluation(**{"chain": "1.4.4.1", "frame": 0, "driver": 2, "kind": "jamming", "status": "free"} | given)


def test_shards_are_not_counted_but_merged_ones_are(tmp_path, monkeypatch):
    """Counting a large family takes a good part of the time of one shard: it is done once, by the merge."""
    from graphsynth.atlas import making

    counted = []
    whole = making.expected_of
    monkeypatch.setattr(making, "expected_of", lambda *work: counted.append(work) or whole(*work))
    parts = [tmp_path / f"{i}.sqlite" for i in (1, 2)]
    for i, part in enumerate(parts, 1):
        with Catalogue.build(part, [5, 6, 8], shard=(i, 2)) as shard:
            assert shard.completeness()["counted"].isna().all() and not shard.completeness()["complete"].any()
            assert shard.verify().passed
    assert not counted
    with Catalogue.merge(tmp_path / "x.sqlite", parts) as merged:
        assert merged.completeness()["counted"].tolist() == [2, 16]
        assert merged.completeness()["complete"].all()
