"""Verification finds every single wrong value."""

import shutil
import sqlite3

import pytest

from graphsynth.atlas.catalogue import Catalogue
from graphsynth.atlas.evaluations import Evaluation


@pytest.fixture(scope="module")
def right(built, tmp_path_factory):
    path = built(tmp_path_factory.mktemp("right"), [4, 6, 8], with_two=[7])
    with Catalogue(path) as catalogue:
        catalogue.record([Evaluation("1.4.4.1", 0, 2, "jamming", "free", 0.1, "rad", "certified", {"a": 1})])
    return path


def spoiled(right, folder, altered, statement, *, sealed=True):
    """What verification says of one change; with a new seal, so that recomputation has to find it."""
    path = folder / "x.sqlite"
    shutil.copy(right, path)
    with altered(path, sealed=sealed) as connection:
        assert connection.execute(statement).rowcount >= 1
    with Catalogue(path) as catalogue:
        return catalogue.verify()


def test_nothing_wrong_is_found_where_nothing_is(right):
    with Catalogue(right) as catalogue:
        found = catalogue.verify()
    assert found.differences == () and found.passed and "all agree" in found.statement


NUMBERS = ["mobility", "links", "joints", "loops", "automorphisms", "inversions", "planar", "girth", "fractionated"]
WRONG = {
    **{f"chains.{name}": f"UPDATE chains SET {name} = {name} + 1 WHERE chain_id = 9" for name in NUMBERS},
    "chains.key": "UPDATE chains SET key = '1CAMwAH5h' WHERE chain_id = 9",
    "chains.label": "UPDATE chains SET label = label || '0' WHERE chain_id = 9",
    "chains.graph6": "UPDATE chains SET graph6 = (SELECT graph6 FROM chains WHERE chain_id = 8) WHERE chain_id = 9",
    "chains.assortment": "UPDATE chains SET assortment = '4-4-0' WHERE chain_id = 9",
    "chains.link_orbits": "UPDATE chains SET link_orbits = '0,1,2,3,4,5,6,7' WHERE chain_id = 9",
    "chains.mobility_type": "UPDATE chains SET mobility_type = 'partial' WHERE chain_id = 9",
    "chains.contracted_id": "UPDATE chains SET contracted_id = 1 + contracted_id % 3 WHERE chain_id = 9",
    "no label": "UPDATE chains SET label = NULL WHERE label = '1.8.4-4.1'",
    "a chain missing": "DELETE FROM chains WHERE chain_id = 9",
    "planar of a contracted graph": "UPDATE contracted SET planar = 1 - planar WHERE contracted_id = 3",
    "vertices of a contracted graph": "UPDATE contracted SET vertices = vertices + 1 WHERE contracted_id = 3",
    "edges of a contracted graph": "UPDATE contracted SET edges = '0-1x5' WHERE contracted_id = 3",
    "key of a group": "UPDATE groups SET key = '1BAN4' WHERE group_id = 2",
    "links of a group": "UPDATE groups SET links = links + 2 WHERE group_id = 2",
    "order of a group": 'UPDATE groups SET "order" = "order" + 1 WHERE group_id = 2',
    "class of a group": "UPDATE groups SET class = class + 1 WHERE group_id = 2",
    "modes of a group": "UPDATE groups SET modes = modes + 1 WHERE group_id = 2",
    "modes of a structure": "UPDATE structures SET modes = NULL WHERE structure_id = 2",
    "class of a structure": "UPDATE structures SET class = class + 1 WHERE structure_id = 2",
    "order of a structure": 'UPDATE structures SET "order" = "order" + 1 WHERE structure_id = 2',
    "groups of a structure": "UPDATE structures SET groups = '1 2 1' WHERE structure_id = 2",
    "a parent": "UPDATE dyads SET parent_key = '1BAN4' WHERE chain_id = 7",
    "a parent missing": "DELETE FROM dyads WHERE chain_id = 8",
    "frame of an inversion": "UPDATE inversions SET frame = frame + 1 WHERE chain_id = 1",
    "joints of a frame": "UPDATE inversions SET frame_joints = 5 WHERE chain_id = 9 AND frame = 0",
    "levels": "UPDATE inversions SET levels = '1-7' WHERE chain_id = 9 AND frame = 0",
    "largest degree": "UPDATE inversions SET degree = degree + 2 WHERE chain_id = 9 AND frame = 0",
    "largest genus": "UPDATE inversions SET genus = genus + 1 WHERE chain_id = 9 AND frame = 0",
    "degrees": "UPDATE inversions SET degrees = '0 2' WHERE chain_id = 9 AND frame = 0",
    "genera": "UPDATE inversions SET genera = NULL WHERE chain_id = 9 AND frame = 0",
    "an inversion missing": "DELETE FROM inversions WHERE chain_id = 9 AND frame = 0",
    "a mechanism missing": "DELETE FROM driven WHERE chain_id = 9 AND frame = 0",
    "a driver": "UPDATE driven SET driver = '1,2' WHERE chain_id = 22 AND driver = (SELECT MIN(driver) FROM driven "
    "WHERE chain_id = 22)",
    "a structure of a mechanism": "UPDATE driven SET structure_id = 1 WHERE chain_id = 8 AND structure_id = 6",
    "a mechanism without a chain": "INSERT INTO driven VALUES (999, 0, 1, 1)",
    "expected": "UPDATE families SET expected = expected + 1 WHERE links = 8",
    "complete": "UPDATE families SET complete = 0 WHERE links = 8",
    "pieces": "UPDATE families SET pieces = pieces + 1 WHERE links = 8",
    "chains of a piece": "UPDATE pieces SET chains = chains + 1 WHERE piece = 0 AND family_id = 3",
    "fractionated of a family": "UPDATE families SET fractionated = 0 WHERE mobility = 2",
    "data of an evaluation": "UPDATE evaluations SET data = '{'",
    "guarantee of an evaluation": "UPDATE evaluations SET guarantee = 'sure'",
    "status of an evaluation": "UPDATE evaluations SET status = ''",
    "mechanism of an evaluation": "UPDATE evaluations SET driver = 3",
}


@pytest.mark.long
@pytest.mark.parametrize("statement", WRONG.values(), ids=WRONG)
def test_a_single_wrong_value_is_found(right, tmp_path, altered, statement):
    found = spoiled(right, tmp_path, altered, statement)
    assert not found.passed
    assert len(found.differences) >= 1


def test_every_column_is_spoiled_once():
    """The list above covers the schema, but for numbers internal to the file and the names of the cut."""
    connection = sqlite3.connect(":memory:")
    from graphsynth.atlas.schema import SCHEMA

    connection.executescript(SCHEMA)
    text = " ".join(WRONG.values())
    internal = {"chain_id", "family_id", "group_id", "piece", "first_chain", "cut", "shard", "value", "unit", "kind"}
    for (table,) in connection.execute("SELECT name FROM sqlite_master WHERE type = 'table' AND name != 'meta'"):
        if table.startswith("sqlite_"):
            continue
        for _, column, *_ in connection.execute(f"PRAGMA table_info({table})"):
            assert column in internal or column in text, f"{table}.{column}"
    connection.close()


def test_damage_to_the_bytes_is_told(right, tmp_path):
    path = tmp_path / "x.sqlite"
    data = bytearray(right.read_bytes())
    data[len(data) // 2 : len(data) // 2 + 3000] = bytes(range(250)) * 12
    path.write_bytes(data)
    with Catalogue(path) as catalogue:
        assert not catalogue.verify().passed


def test_a_sample_checks_some_chains_of_each_family(right):
    with Catalogue(right) as catalogue:
        found = catalogue.verify(chains=3, seed=1)
    assert found.passed
    assert found.compared["chains.girth"] == 1 + 2 + 3 + 3


@pytest.mark.slow
def test_twelve_links_pass(tmp_path):
    """All 6856 chains and 195816 mechanisms, recomputed by networkx and brute force."""
    with Catalogue.build(tmp_path / "x.sqlite", [12]) as catalogue:
        found = catalogue.verify()
    assert found.differences == ()
    assert found.compared["mechanisms"] == 195816
