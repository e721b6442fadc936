"""What a page may do, where it may be written, and what it shows of data that hold markup."""

from __future__ import annotations

import json
import re
import shutil
from importlib.resources import files
from pathlib import Path

import pytest

from graphsynth.atlas.site import build_site
from graphsynth.core.errors import GraphsynthError

PAGES = files("graphsynth.atlas.site").joinpath("pages")
SCRIPTS = sorted(path.name for path in PAGES.iterdir() if path.name.endswith(".js"))
#: These draw SVG, of numbers and escaped titles; ``markup.js`` is the one place that escapes.
DRAWING = {"blocks.js", "drawing.js", "editor.js", "writing.js"}


@pytest.mark.parametrize("name", SCRIPTS)
def test_markup_is_made_by_one_helper(name):
    """What is put into the page is escaped by ``Atlas.html``, or was drawn."""
    text = PAGES.joinpath(name).read_text("utf-8")
    for _, value in re.findall(r"\.(innerHTML|outerHTML) = ([\w.]+)", text):
        assert value in ("html", "Atlas.html", "Atlas.drawn", "picture", "groupList"), value
    assert not re.search(r"insertAdjacentHTML|document\.write|\beval\(|new Function|\.on\w+ = [\"'`]", text)
    if name not in DRAWING:
        assert not re.search(r"(?<!html)`\s*<[a-z]|[\"']<[a-z]", text)
    assert "charCodeAt(0)};" not in text or name == "markup.js"


def test_every_page_has_a_policy(report):
    """Own scripts and kernels and nothing else: none in a page, none from elsewhere."""
    folder = report.page.parent
    pages = list(folder.rglob("*.html"))
    assert len(pages) == 2
    for page in pages:
        text = page.read_text("utf-8")
        (policy,) = re.findall(r'<meta http-equiv="Content-Security-Policy" content="([^"]*)">', text)
        assert {"default-src 'none'", "base-uri 'none'", "form-action 'none'"} <= set(policy.split("; "))
        (scripts,) = re.findall(r"script-src ([^;]*)", policy)
        assert scripts == "'self' file: 'wasm-unsafe-eval'"
        assert re.findall(r"<script>(.*?)</script>", text, re.DOTALL) == []
        assert text.index("Content-Security-Policy") < text.index("<title>")


MARKUP = "<img src=x onerror=window.ran=1><script>window.ran=1</script>\"'`&"


def handed(path):
    """What a script of the data folder hands to the page."""
    return json.loads(f"[{re.fullmatch(r'Atlas.[a-zA-Z]+[(](.*)[)];', path.read_text('utf-8').strip())[1]}]")


@pytest.fixture
def hostile(report, tmp_path, request):
    """The page with markup wherever its data have text, past everything that looks at a catalogue."""
    folder = tmp_path / "hostile"
    shutil.copytree(report.page.parent, folder)
    contents = folder / "data" / "contents.js"
    known = handed(contents)[0]
    known["contracted"] = dict.fromkeys(known["contracted"], MARKUP)
    contents.write_text(f"Atlas.open({json.dumps(known)});\n", "utf-8")
    path = folder / "data" / "family-1-6.js"
    name, family = handed(path)
    family["assortments"] = [[f"4-2{MARKUP}", count] for _, count in family["assortments"]]
    family["symmetry"] = family["inversions"] = [MARKUP] * 2
    path.write_text(f"Atlas.take({json.dumps(name)},{json.dumps(family)});\n", "utf-8")
    relatives = folder / "data" / "relatives-1-6.js"
    rows = [[MARKUP, MARKUP, MARKUP, MARKUP, None, MARKUP, MARKUP]]
    data = {"parents": [[MARKUP]] * 2, "children": [[MARKUP]] * 2, "evaluations": {"0": rows, "1": rows}}
    data["mechanisms"] = {"0": [MARKUP, [MARKUP], MARKUP], "1": [0, [1], MARKUP]}
    names = [{"key": "1BgMw8g", "name": MARKUP, "uses": MARKUP, "source": MARKUP, "template": MARKUP}]
    (folder / "data" / "names.js").write_text(f"Atlas.takeNames({json.dumps(names)});\n", "utf-8")
    relatives.write_text(f'Atlas.takeRelatives("1-6",{json.dumps(data)});\n', "utf-8")
    groups = f"Atlas.takeGroups(new Proxy({{}}, {{get: () => {json.dumps(MARKUP)}}}));"
    (folder / "data" / "groups.js").write_text(groups, "utf-8")
    return folder / "index.html"


def test_markup_in_the_data_is_shown_and_does_nothing(window, hostile, report):
    """In Chromium, with its policy and without: no script runs, and no element is made of the text."""
    without = hostile.with_name("without.html")
    text = hostile.read_text("utf-8")
    without.write_text(re.sub(r"<meta http-equiv[^>]*>\n", "", text), "utf-8")
    assert without.read_text("utf-8") != text
    addresses = ("#/?links=6", "#/?contracted=1", "#/1BgMw8g", "#/1BAN4", "#/about", f"#/{MARKUP}", f"#/?text={MARKUP}")
    for page, own in ((hostile, addresses[:3]), (without, addresses)):
        for address in own:
            window.get("about:blank")
            window.get(page.as_uri() + address)
            window.execute_async_script("setTimeout(arguments[0], 150)")
            assert window.execute_script("return window.ran") is None, address
            assert window.execute_script("return document.querySelectorAll('main img, main script').length") == 0
    window.get("about:blank")
    window.get(hostile.as_uri() + "#/1BgMw8g")
    window.execute_async_script("setTimeout(arguments[0], 500)")
    shown = window.execute_script("return document.getElementById('entry').textContent")
    assert shown.count("onerror=window.ran=1") >= 8
    window.get_log("browser")


def test_the_policy_stops_what_a_page_would_run(window, report, tmp_path):
    """The policy by itself: inline handlers and scripts of a page do not run."""
    place = tmp_path / "page"
    shutil.copytree(report.page.parent, place)
    for page in (place / "index.html", place / "workbench" / "index.html"):
        text = page.read_text("utf-8")
        page.write_text(text.replace("</body>", f"<p>{MARKUP}</p></body>"), "utf-8")
        window.get("about:blank")
        window.get(page.as_uri())
        window.execute_async_script("setTimeout(arguments[0], 150)")
        assert window.execute_script("return [window.ran || null, document.images.length]") == [None, 1]
    window.get_log("browser")


# --- the folder


def test_nothing_beside_the_folder_is_touched(catalogue, tmp_path):
    """Above all no folder that has the name of something in between."""
    for name in ("s3.building", "s3.old", "s3.new", ".s3"):
        (tmp_path / name).mkdir()
        (tmp_path / name / "thesis.tex").write_text("years of work")
    for _ in range(2):
        build_site(catalogue, tmp_path / "s3")
    assert sorted(own.name for own in tmp_path.iterdir()) == [".s3", "s3", "s3.building", "s3.new", "s3.old"]
    assert len(list(tmp_path.glob("*/thesis.tex"))) == 4


def test_a_linked_folder_is_followed(catalogue, tmp_path):
    (tmp_path / "real").mkdir()
    (tmp_path / "disk").mkdir()
    (tmp_path / "real" / "link").symlink_to(tmp_path / "disk")
    (tmp_path / "real" / "other").symlink_to(tmp_path / "disk" / "new")
    for name in ("link", "link", "other"):
        build_site(catalogue, tmp_path / "real" / name)
    assert (tmp_path / "real" / "link").is_symlink() and (tmp_path / "disk" / "index.html").is_file()
    assert (tmp_path / "disk" / "new" / "index.html").is_file()
    assert {own.name for own in tmp_path.iterdir()} == {"real", "disk"}


@pytest.mark.parametrize("name", ["CNAME", ".git/config", "data/rows.csv", "workbench/mine/x.html", "notes.txt"])
def test_files_that_somebody_put_into_a_page_stay(catalogue, tmp_path, name):
    place = tmp_path / "page"
    build_site(catalogue, place)
    mine = place / name
    mine.parent.mkdir(exist_ok=True)
    mine.write_text("mine")
    with pytest.raises(GraphsynthError, match="holds other files"):
        build_site(catalogue, place)
    assert mine.read_text() == "mine" and (place / "index.html").is_file()


def test_what_cannot_be_replaced_is_refused_before_anything_is_computed(catalogue, tmp_path, monkeypatch):
    monkeypatch.setattr("graphsynth.atlas.site.building._write", None)
    with pytest.raises(GraphsynthError, match="root of a file system"):
        build_site(catalogue, "/proc")
    with pytest.raises(GraphsynthError, match=r"cannot be written|does not exist"):
        build_site(catalogue, "/proc/page")


def test_a_page_that_fails_at_the_end_leaves_the_older_one(catalogue, tmp_path, monkeypatch):
    place = tmp_path / "page"
    build_site(catalogue, place)
    before = (place / "index.html").read_bytes()
    (place / "style.css").write_text("older")
    rename = Path.rename

    def full(own, to):
        if own.name == "new":
            raise OSError(28, "No space left on device")
        return rename(own, to)

    monkeypatch.setattr(Path, "rename", full)
    with pytest.raises(GraphsynthError, match="make room or name another folder"):
        build_site(catalogue, place)
    assert (place / "index.html").read_bytes() == before and (place / "style.css").read_text() == "older"
    assert [own.name for own in tmp_path.iterdir()] == ["page"]
