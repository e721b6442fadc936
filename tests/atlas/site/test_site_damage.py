"""The page of a damaged catalogue: one sentence, and the older page stays."""

from __future__ import annotations

import pytest

from graphsynth.atlas.catalogue import Catalogue
from graphsynth.atlas.evaluations import Evaluation
from graphsynth.atlas.site import build_site
from graphsynth.cli import main
from graphsynth.core.errors import FormatError

WRONG = {
    "assortment": "UPDATE chains SET assortment = 'x-y'",
    "label": "UPDATE chains SET label = 'nonsense'",
    "key": "UPDATE chains SET key = X'00ff'",
    "class": "DROP TABLE structures",
    "relatives": "DROP TABLE dyads",
    "groups": "DROP TABLE groups",
    "contracted": "DROP TABLE contracted",
    "evaluations": "DROP TABLE evaluations",
    "dimensions": "UPDATE evaluations SET data = '{' WHERE kind = 'dimensions'",
    "families": "DROP TABLE families",
    "girth": "UPDATE chains SET girth = 'x'",
}


@pytest.fixture(scope="module")
def right(built, tmp_path_factory):
    path = built(tmp_path_factory.mktemp("right"), [4])
    with Catalogue(path) as catalogue:
        frame, driver = catalogue.connection.execute("SELECT frame, driver FROM mechanisms").fetchone()
        place = "1.4.4.1", frame, driver
        catalogue.record([Evaluation(*place, "dimensions", "found", data={"mechanism": {}})])
    return path


@pytest.mark.long
@pytest.mark.parametrize("kind", sorted(WRONG))
def test_damage_is_one_sentence(right, tmp_path, altered, capsys, kind):
    path, page = tmp_path / "x.sqlite", tmp_path / "page"
    path.write_bytes(right.read_bytes())
    with altered(path, anything=True) as raw:
        raw.execute(WRONG[kind])
    page.mkdir()
    (page / "atlas-page.txt").write_text("older")
    words = "tables are not those" if "DROP" in WRONG[kind] else "damaged|values that no catalogue holds"
    with pytest.raises(FormatError, match=words), Catalogue(path) as catalogue:
        build_site(catalogue, page)
    assert main(["catalog", "site", str(path), "-o", str(page)]) == 2
    error = capsys.readouterr().err
    assert error.count("\n") == 1 and "x.sqlite" in error
    assert [own.name for own in page.iterdir()] == ["atlas-page.txt"]
    assert sorted(own.name for own in tmp_path.iterdir()) == ["page", "x.sqlite"]


def test_damaged_pages_of_the_file_are_one_sentence(right, tmp_path, capsys):
    data = bytearray(right.read_bytes())
    for start in range(4096, len(data), 4096):
        path = tmp_path / "y.sqlite"
        path.write_bytes(data[:start] + bytes(4096) + data[start + 4096 :])
        status = main(["catalog", "site", str(path), "-o", str(tmp_path / "page")])
        error = capsys.readouterr().err
        assert status in (0, 2) and (status == 0 or error.count("\n") == 1)
