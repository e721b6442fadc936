"""Writing the page: what is written, what is refused, and that it does not depend on who works."""

import json
import re
import shutil
from base64 import urlsafe_b64decode
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from zlib import decompress

import numpy as np
import pytest

from graphsynth import Mechanism, MechanismGraph
from graphsynth.atlas.catalogue import Catalogue
from graphsynth.atlas.evaluations import Evaluation
from graphsynth.atlas.site import build_site
from graphsynth.atlas.site.families import places_of
from graphsynth.atlas.site.named import named
from graphsynth.cli import main
from graphsynth.core.errors import GraphsynthError
from graphsynth.kinematics.dimensional.sketch import layout
from graphsynth.workbench.writing import templates

DIGITS = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789-_"


def handed(path):
    """What a script of the data folder hands to the page."""
    call = re.fullmatch(r"Atlas\.\w+\((.*)\);\n", path.read_text("utf-8"))
    return json.loads(f"[{call[1]}]")


def test_the_report_tells_what_is_written(report):
    folder = report.page.parent
    files = [path for path in folder.rglob("*") if path.is_file()]
    assert (report.chains, report.dimensioned) == (1 + 2 + 16, 0)
    assert (report.files, report.size) == (len(files), sum(path.stat().st_size for path in files))
    assert report.first_load < 200_000
    assert not list(folder.parent.glob("*.building"))


def test_every_chain_stands_in_the_data_under_its_label(report, catalogue):
    data = report.page.parent / "data"
    found = {}
    for links in (4, 6, 8):
        name, family = handed(data / f"family-1-{links}.js")
        place, length = 0, len(family["keys"]) // sum(count for _, count in family["assortments"])
        for assortment, count in family["assortments"]:
            for rank in range(1, count + 1):
                found[f"1.{links}.{assortment}.{rank}"] = family["keys"][place * length : (place + 1) * length]
                place += 1
        assert name == f"1-{links}" and family["ranks"] is None
    assert found == dict(catalogue.connection.execute("SELECT label, key FROM chains").fetchall())


def test_relatives_point_to_one_another(report, catalogue):
    data = report.page.parent / "data"
    keys = {}
    for links in (4, 6, 8):
        family = handed(data / f"family-1-{links}.js")[1]
        length = len(family["keys"]) // sum(count for _, count in family["assortments"])
        keys[links] = re.findall("." * length, family["keys"])
    pairs = set()
    for links in (6, 8):
        parents = handed(data / f"relatives-1-{links}.js")[1]["parents"]
        children = handed(data / f"relatives-1-{links - 2}.js")[1]["children"]
        upwards = {(keys[links][k], keys[links - 2][p]) for k, own in enumerate(parents) for p in own}
        downwards = {(keys[links][c], keys[links - 2][k]) for k, own in enumerate(children) for c in own}
        assert upwards == downwards
        pairs |= upwards
    stored = catalogue.connection.execute("SELECT key, parent_key FROM dyads JOIN chains USING (chain_id)").fetchall()
    assert pairs == set(stored)


def test_places_are_those_of_the_sketch():
    graph = MechanismGraph.from_key("1CAMBmSzA")
    digits = [DIGITS.index(letter) for letter in places_of([graph.key])[0]]
    units = np.array([64 * high + low for high, low in zip(digits[::2], digits[1::2], strict=True)]).reshape(-1, 2)
    drawn = layout(graph).positions
    moved = drawn - drawn.min(axis=0)
    assert units.max() == 4095
    assert np.abs(units / 4095 - moved / moved.max()).max() <= 0.5001 / 4095


def test_names_are_of_the_chains_of_their_mechanisms():
    """Every template of the workbench has its name under the chain that it is built of."""
    entries = named()
    made = {entry["name"]: Mechanism.from_json(entry["text"]) for entry in templates()}
    assert sorted(entry["template"] for entry in entries if "template" in entry) == sorted(made)
    for entry in entries:
        assert "template" in entry or "sliders" in entry, entry["name"]
        assert "template" not in entry or made[entry["template"]].graph.without_frame().key == entry["key"]
        assert all(entry[word].strip() for word in ("name", "uses", "source"))


def test_the_workbench_is_part_of_the_site(report):
    folder = report.page.parent / "workbench"
    assert 'Bench.atlas = "../index.html"' in (folder / "given.js").read_text("utf-8")
    assert (folder / "index.html").is_file() and (folder / "chains-data.js").is_file()


@pytest.mark.long
def test_the_page_is_the_same_whoever_works(report, catalogue, tmp_path):
    with ThreadPoolExecutor(2) as executor:
        again = build_site(catalogue, tmp_path / "again", executor=executor)
    for path in report.page.parent.rglob("*"):
        twin = again.page.parent / path.relative_to(report.page.parent)
        assert path.is_dir() or path.read_bytes() == twin.read_bytes(), path.name


def test_nothing_comes_from_elsewhere(report):
    for path in report.page.parent.rglob("*.*"):
        if path.suffix in (".html", ".js", ".css"):
            text = path.read_text("utf-8")
            addresses = set(re.findall(r"(?:https?:)?//[a-z][\w.-]+\.[a-z]{2,}[\w./-]*", text))
            assert addresses <= {"http://www.w3.org/2000/svg", "http://graphml.graphdrawing.org/xmlns"}, path.name
            assert not re.search(r"\bfetch\(|XMLHttpRequest|type=.?module|\bimport\(", text), path.name


@pytest.mark.long
def test_large_families_are_not_in_the_first_load(catalogue, tmp_path, monkeypatch):
    from graphsynth.atlas.site import building

    monkeypatch.setattr(building, "_FIRST_LOAD", 500)
    small = build_site(catalogue, tmp_path / "small")
    text = small.page.read_text("utf-8")
    assert "data/family-1-6.js" in text and "data/family-1-8.js" not in text
    assert (small.page.parent / "data" / "family-1-8.js").is_file()


@pytest.mark.long
def test_an_old_page_is_replaced_and_anything_else_is_refused(catalogue, tmp_path):
    place = tmp_path / "page"
    build_site(catalogue, place)
    (place / "leftover.js").write_text("")
    build_site(catalogue, place)
    assert not (place / "leftover.js").exists()
    other = tmp_path / "other"
    other.mkdir()
    (other / "thesis.tex").write_text("years of work")
    with pytest.raises(GraphsynthError, match="holds other files"):
        build_site(catalogue, other)
    assert (other / "thesis.tex").read_text() == "years of work"
    with pytest.raises(GraphsynthError, match="is a file"):
        build_site(catalogue, other / "thesis.tex")
    with pytest.raises(GraphsynthError, match="does not exist"):
        build_site(catalogue, tmp_path / "no" / "such" / "folder")


@pytest.mark.long
def test_a_failed_build_leaves_the_old_page(catalogue, tmp_path, monkeypatch):
    from graphsynth.atlas.site import building

    place = tmp_path / "page"
    build_site(catalogue, place)
    before = {path: path.read_bytes() for path in place.rglob("*") if path.is_file()}

    def fail(*_):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(building, "sketch_scripts", fail)
    with pytest.raises(OSError, match="No space"):
        build_site(catalogue, place)
    assert {path: path.read_bytes() for path in place.rglob("*") if path.is_file()} == before
    assert [path.name for path in tmp_path.iterdir()] == ["page"]


def test_unfinished_catalogues_are_refused(tmp_path):
    with (
        Catalogue.build(tmp_path / "part.sqlite", links=[8], shard=(1, 2)) as part,
        pytest.raises(GraphsynthError, match="no finished family"),
    ):
        build_site(part, tmp_path / "page")
    assert not (tmp_path / "page").exists()


@pytest.mark.long
def test_the_command_writes_the_page(catalogue, tmp_path, capsys):
    assert main(["catalog", "site", str(catalogue.path), "-o", str(tmp_path / "a"), "--json"]) == 0
    facts = json.loads(capsys.readouterr().out)
    assert (facts["chains"], facts["dimensioned"]) == (19, 0)
    assert (tmp_path / "a" / "index.html").is_file()
    assert main(["catalog", "site", str(tmp_path / "none.sqlite"), "-o", str(tmp_path / "b")]) == 2
    assert "there is no such catalogue" in capsys.readouterr().err
    shutil.rmtree(tmp_path / "a")


@pytest.mark.long
def test_evaluations_of_the_catalogue_are_handed_over(tmp_path):
    path = tmp_path / "own.sqlite"
    with Catalogue.build(path, links=[4]) as own:
        frame, driver = own.connection.execute("SELECT frame, driver FROM mechanisms").fetchone()
        own.record([Evaluation("1.4.4.1", frame, driver, "jamming", "free", 0.25, "rad", "certified")])
        page = build_site(own, tmp_path / "page")
    data = handed(page.page.parent / "data" / "relatives-1-4.js")[1]
    assert data["evaluations"] == {"0": [[frame, str(driver), "jamming", "free", 0.25, "rad", "certified"]]}


@pytest.mark.long
def test_stored_dimensions_are_handed_to_the_workbench(tmp_path):
    with Catalogue.build(tmp_path / "own.sqlite", links=[4, 6]) as own:
        own.evaluate(links=[4])
        mechanism = own.connection.execute("SELECT data FROM evaluations WHERE kind = 'dimensions'").fetchone()[0]
        # a second mechanism, of a better transmission by its word, that is none of this chain
        other = json.loads(mechanism)
        four, six = (
            own.connection.execute("SELECT key FROM chains WHERE links = ?", (n,)).fetchone()[0] for n in (4, 6)
        )
        frame, driver = own.connection.execute(
            "SELECT frame, driver FROM mechanisms JOIN chains USING (chain_id) WHERE key = ?", (six,)
        ).fetchone()
        own.record([Evaluation(six, frame, driver, "dimensions", "found", data=other)])
        page = build_site(own, tmp_path / "page")
    (held,) = handed(page.page.parent / "data" / "relatives-1-4.js")[1]["mechanisms"].values()
    assert handed(page.page.parent / "data" / "relatives-1-6.js")[1]["mechanisms"] == {}
    assert page.dimensioned == 1
    frame, drivers, address = held
    packed = urlsafe_b64decode(address.removeprefix("#m=") + "==")
    moved = Mechanism.from_json(json.dumps(json.loads(decompress(packed, wbits=-15))["m"]))
    stored = Mechanism.from_json(json.dumps(json.loads(mechanism)["mechanism"]))
    assert replace(moved, pose=None, points={}) == replace(stored, pose=None, points={})
    assert moved.graph.without_frame() == MechanismGraph.from_key(four)
    assert (moved.graph.frame, [own.link for own in moved.drivers]) == (frame, drivers)


@pytest.mark.long
def test_other_mobilities_and_fractionated_chains(tmp_path):
    with Catalogue.build(tmp_path / "two.sqlite", links=[5, 7], mobility=2, fractionated=True) as own:
        page = build_site(own, tmp_path / "page")
    assert page.chains == 5
    columns = handed(page.page.parent / "data" / "family-2-7.js")[1]
    assert columns["fractionated"].count("1") == 1  # two four-bars on one link


@pytest.mark.slow
def test_the_page_of_twelve_links(tmp_path):
    """All 7105 chains: within three minutes of two cores, less than 1 MB to begin with."""
    import resource

    used = [resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)]
    with Catalogue.build(tmp_path / "twelve.sqlite", links=range(4, 13)) as whole:
        page = build_site(whole, tmp_path / "page")
    now = [resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)]
    seconds = sum(b.ru_utime + b.ru_stime - a.ru_utime - a.ru_stime for a, b in zip(used, now, strict=True))
    assert page.chains == 7105
    assert page.first_load < 1_000_000
    assert seconds < 2 * 180
