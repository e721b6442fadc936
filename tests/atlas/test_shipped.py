"""The catalogue in catalog/: verified, complete, and what the builder makes today."""

import importlib.util
from pathlib import Path

import pytest

from graphsynth.atlas.catalogue import Catalogue
from graphsynth.atlas.evaluations import Evaluation
from graphsynth.atlas.stored import fingerprint

CATALOG = Path(__file__).parents[2] / "catalog"


@pytest.fixture(scope="module")
def shipped():
    with Catalogue(CATALOG / "up-to-10-links.sqlite") as catalogue:
        yield catalogue


@pytest.fixture(scope="module")
def script():
    spec = importlib.util.spec_from_file_location("build_shipped", CATALOG / "build_shipped.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.mark.slow
def test_verification_passes(shipped):
    """Every field of every chain with up to ten links, against networkx and brute force."""
    found = shipped.verify()
    assert found.differences == ()
    assert found.passed
    chains = len(shipped)
    per_chain = [field for field, count in found.compared.items() if count == chains]
    assert len(per_chain) >= 18
    assert found.compared["mechanisms"] == len(shipped.query("mechanisms"))
    assert found.compared["inversions"] == len(shipped.query("inversions"))


def test_it_is_complete_and_small(shipped):
    statement = shipped.completeness()
    assert statement["complete"].all()
    assert statement["published"].notna().all()
    assert statement["listed"].sum() == len(shipped) == 411
    assert shipped.path.stat().st_size < 1_000_000


@pytest.mark.long
def test_the_builder_makes_the_same_today(shipped, script, tmp_path):
    script.build(tmp_path / "x.sqlite")
    with Catalogue(tmp_path / "x.sqlite") as fresh:
        assert fresh.digest() == shipped.digest()
        assert script.statement(fresh) == (CATALOG / "up-to-10-links.toml").read_text()


@pytest.mark.slow
def test_the_builder_evaluates_the_same_today(shipped, script, tmp_path):
    """The same mechanisms with the same status, unit and guarantee; digits of dimensions may differ, and turn."""
    script.build(tmp_path / "x.sqlite")
    script.evaluate(tmp_path / "x.sqlite")
    with Catalogue(tmp_path / "x.sqlite") as fresh:
        text = (CATALOG / "up-to-10-links.toml").read_text()
        assert script.differences(shipped, fresh, text) == []
        assert script.same_dimensions(shipped, fresh)[1] == 28
        fresh.record([Evaluation("1.4.4.1", 0, 2, "dimensions", "not found")])
        kept = {row[3:5] for row in script.evaluated(shipped) - script.evaluated(fresh)}
        assert kept == {("dimensions", "found"), ("transmission", "found"), ("jamming", "free")}


def test_every_result_names_its_dimensions(shipped):
    for name in shipped.query("chains", "mobility = 1 AND links <= 8")["key"]:
        for own in shipped.entry(name)["mechanisms"]:
            known = {kind: row for kind, row in own["evaluations"].items() if row != "not computed"}
            if known:
                named = fingerprint(known.pop("dimensions")["data"]["mechanism"])
                assert known and all(row["data"]["dimensions"] == named for row in known.values())


def test_it_is_found_by_name(shipped):
    with Catalogue.shipped() as catalogue:
        assert catalogue.digest() == shipped.digest()


def test_the_smaller_chains_have_dimensions(shipped):
    """One mechanism of each chain of mobility 1 with at most eight links turns; the rest says that nobody looked."""
    for row in shipped.query("chains", "mobility = 1").to_dict("records"):
        dimensions = [own["evaluations"]["dimensions"] for own in shipped.entry(row["key"])["mechanisms"]]
        found = [known for known in dimensions if known != "not computed"]
        assert [known["guarantee"] for known in found] == ["certified"] * (row["links"] <= 8)
        if found:
            assert shipped.mechanism(row["label"]).graph.key
    jamming = shipped.query("evaluations", "kind = 'jamming'")
    assert jamming["chain_id"].nunique() == 28
    assert jamming["guarantee"].tolist() == ["certified"] * 28
