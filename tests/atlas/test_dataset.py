"""Data sets: beside a catalogue, beside counts of another method, in parts, damaged, and asked in SQL."""

import json
import math

import pytest

from graphsynth import Catalogue, Dataset, MechanismGraph, count_assembly_modes
from graphsynth.__main__ import main
from graphsynth.atlas import dataset_parts
from graphsynth.core.errors import FormatError, GraphsynthError, SpecError

from ..synthesis.rigid_clusters import labelled_chains

pq = pytest.importorskip("pyarrow.parquet")


@pytest.fixture(scope="module")
def data(tmp_path_factory):
    return Dataset.build(tmp_path_factory.mktemp("data") / "set", [4, 6, 8])


def files_of(folder):
    return {str(path.relative_to(folder)): path.read_bytes() for path in sorted(folder.rglob("*.parquet"))}


def rows_of(folder, table, links, mobility=1):
    found = []
    for path in sorted((folder / table / f"mobility={mobility}" / f"links={links}").glob("*.parquet")):
        rows = pq.ParquetFile(path).read().to_pandas()
        rows["part"] = int(path.stem.removeprefix("part-"))
        found.append(rows.reset_index(names="row"))
    import pandas as pd

    return pd.concat(found, ignore_index=True)


@pytest.mark.parametrize(("links", "mobility"), [(8, 1), (7, 2)])
def test_rows_are_those_of_a_catalogue(tmp_path, links, mobility):
    """The catalogue's rows, each checked by another route, and the same chains and mechanisms in number."""
    folder = Dataset.build(tmp_path / "set", [links], mobility, fractionated=True).folder
    with Catalogue.build(tmp_path / "some.sqlite", [links], mobility, fractionated=True) as catalogue:
        columns = "graph6, assortment, automorphisms, inversions, girth, planar, fractionated, mobility_type"
        wanted = catalogue.sql(f"SELECT {columns} FROM chains ORDER BY graph6")
        driven = catalogue.sql(
            'SELECT graph6, frame, CAST(driver AS TEXT) AS drivers, class, m."order", groups FROM mechanisms m '
            "JOIN chains USING (chain_id)"
        )
        modes = {
            str(own.group_id): count_assembly_modes(MechanismGraph.from_key(own.key))
            for own in catalogue.query("groups").itertuples()
        }
    chains = rows_of(folder, "chains", links, mobility)
    found = chains.sort_values("graph6", ignore_index=True)
    assert found["graph6"].tolist() == wanted["graph6"].tolist()
    for name in columns.split(", ")[1:]:
        assert found[name].astype(wanted[name].dtype).tolist() == wanted[name].tolist(), name
    mechanisms = rows_of(folder, "mechanisms", links, mobility)
    graphs = dict(zip(chains["row"], chains["graph6"]))
    facts = ["frame", "drivers", "class", "order", "groups", "modes"]
    own = set(zip(mechanisms["chain"].map(graphs), *(mechanisms[name] for name in facts)))
    assert len(own) == len(mechanisms) == len(driven) == chains["mechanisms"].sum()
    groups = driven["groups"].str.split()
    products = groups.map(lambda names: math.prod(modes[name] for name in names))
    assert own == set(zip(*(driven[name] for name in ("graph6", *facts[:4])), groups.map(len), products))


@pytest.mark.parametrize("links", [4, 6, 8, pytest.param(10, marks=pytest.mark.long)])
def test_chains_with_named_links_are_as_many_as_another_method_counts(tmp_path, data, links):
    """Links! over automorphisms, summed up, beside graphs counted by their rigid clusters."""
    whole = data if links <= 8 else Dataset.build(tmp_path, [links], mechanisms=False)
    (told,) = whole.families.query(f"links == {links}")["labelled"]
    assert int(told) == labelled_chains(links)


def test_parts_are_the_same_bytes_whoever_makes_them(tmp_path, monkeypatch):
    monkeypatch.setattr(dataset_parts, "PART", 10.0)
    whole = Dataset.build(tmp_path / "whole", [8])
    assert len(files_of(whole.folder)) > 4
    for shard in ((2, 3), (1, 3)):  # the third is left to the last call
        Dataset.build(tmp_path / "shards", [8], shard=shard)
    assert len(Dataset(tmp_path / "shards")) == 0
    steps = []
    pieces = Dataset.build(tmp_path / "shards", [8], watch=steps.append)
    assert files_of(pieces.folder) == files_of(whole.folder) and pieces.manifest == whole.manifest
    assert steps[-1].done == 1.0 and steps[-1].chains == 16
    lost = next(pieces.folder.rglob("part-00001.parquet"))
    lost.unlink()
    with (pieces.folder / "parts-1-8.jsonl").open("a") as journal:
        journal.write('{"cut": "unfin')  # a process was killed
    again = Dataset.build(pieces.folder, [8])
    assert lost.exists() and again.manifest == whole.manifest and again.verify().passed
    assert [whole.chain(8, k).key for k in range(16)] == [again.chain(8, k).key for k in range(16)]


def test_what_is_made_otherwise_is_not_mixed(tmp_path):
    Dataset.build(tmp_path, [6])
    with pytest.raises(GraphsynthError, match="with or without mechanisms"):
        Dataset.build(tmp_path, [6], mechanisms=False)


def test_what_is_not_there_is_made_first(tmp_path):
    import graphsynth as gs

    data = gs.dataset(6, tmp_path / "data", mechanisms=False)
    assert len(data) == 2
    before = {path: path.stat().st_mtime_ns for path in (tmp_path / "data").rglob("*.parquet")}
    data = gs.dataset([6, 8], tmp_path / "data", mechanisms=False)
    assert len(data) == 18 and {path: path.stat().st_mtime_ns for path in before} == before


def test_all_chains_by_number(data):
    assert len({data.chain(8, k).key for k in range(16)}) == 16 and len(data) == 19
    for links, number, words in ((8, 16, "one of the 16"), (8, -1, "one of the 16"), (10, 0, "no chains")):
        with pytest.raises(SpecError, match=words):
            data.chain(links, number)


def test_damage_is_found(tmp_path):
    folder = Dataset.build(tmp_path, [6, 8]).folder
    assert Dataset(folder).verify().passed
    path = next(folder.glob("chains/mobility=1/links=8/*.parquet"))
    whole = path.read_bytes()
    path.write_bytes(whole[:100] + bytes([whole[100] ^ 1]) + whole[101:])
    found = Dataset(folder).verify()
    assert not found.passed and "is not as it was made" in found.differences[0]
    path.unlink()
    assert "is missing" in Dataset(folder).verify().differences[0]


@pytest.mark.parametrize(
    ("text", "words"),
    [(None, "holds no data set"), ("{", "damaged"), ("[]", "damaged"), ('{"version": 9, "families": []}', "version 9")],
)
def test_a_folder_that_is_no_data_set_is_refused(tmp_path, text, words):
    if text is not None:
        (tmp_path / "manifest.json").write_text(text)
    with pytest.raises(FormatError, match=words):
        Dataset(tmp_path)


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("links", "../.."),
        ("links", -8),
        ("rows", {}),
        ("labelled", "x"),
        ("parts", [{}]),
        ("parts", 3),
        ("counted", None),
    ],
)
def test_a_damaged_manifest_is_refused(tmp_path, data, name, value):
    document = json.loads((data.folder / "manifest.json").read_text())
    document["families"][0][name] = value
    (tmp_path / "manifest.json").write_text(json.dumps(document))
    with pytest.raises(FormatError, match="damaged"):
        Dataset(tmp_path)


def test_questions_in_sql(data):
    pytest.importorskip("duckdb")
    found = data.query("SELECT links, count(*) AS n FROM chains GROUP BY links ORDER BY links")
    assert found["n"].tolist() == [1, 2, 16]
    joined = data.query(
        "SELECT graph6, max(modes) AS most FROM chains JOIN mechanisms USING (mobility, links, part, chain) "
        "WHERE links = ? GROUP BY graph6 ORDER BY graph6",
        [8],
    )
    assert len(joined) == 16 and joined["most"].max() == 18
    few = data.query("SELECT * FROM mechanisms", limit=5)
    assert len(few) == 5 and few.attrs["more"]
    assert not data.query("SELECT * FROM chains", limit=19).attrs["more"]


@pytest.mark.parametrize(
    "sql", ["SELECT nothing FROM chains", "COPY chains TO 'x.csv'", "SELECT * FROM read_csv('/etc/hostname')", ";;("]
)
def test_questions_that_are_refused_write_and_read_nothing_else(data, tmp_path, monkeypatch, sql):
    pytest.importorskip("duckdb")
    monkeypatch.chdir(tmp_path)
    with pytest.raises(SpecError, match="DuckDB refuses"):
        data.query(sql)
    assert list(tmp_path.iterdir()) == []


def test_on_the_command_line(tmp_path, capsys):
    pytest.importorskip("duckdb")
    folder = tmp_path / "set"
    assert main(["catalog", "dataset", "--links", "4..8", "-o", str(folder), "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert [own["chains"] for own in told["families"]] == [1, 2, 16]
    assert main(["catalog", "query", str(folder), "--where", "girth = 4 and links = 6", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["rows"] == 2
    assert main(["catalog", "verify", str(folder)]) == 0
    assert "as they were made" in capsys.readouterr().out
    next(folder.rglob("part-00000.parquet")).unlink()
    assert main(["catalog", "verify", str(folder)]) == 1
    assert main(["catalog", "query", str(folder), "--entry", "x"]) == 2
    assert main(["catalog", "query", str(folder), "--table", "groups"]) == 2
