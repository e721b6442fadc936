"""Files and addresses that somebody else wrote: one sentence or a drawing, never a script, never a wait."""

from __future__ import annotations

import json
import re
import time
from base64 import b64encode, urlsafe_b64encode
from hashlib import sha256
from pathlib import Path
from zlib import compressobj

import pytest

from graphsynth import Mechanism
from graphsynth.core.errors import GraphsynthError
from graphsynth.mechanism import gallery
from graphsynth.mechanism.files import to_dict
from graphsynth.workbench.posing import assembled
from graphsynth.workbench.writing import single_page, write_workbench
from tests.workbench.person import Person
from tests.workbench.test_workbench_scripts import CASES

MARKUP = "<img src=x onerror=window.ran=1><script>window.ran=1</script>\"'`&"

#: Damage of a text at random: letters changed, taken out, put in, parts said twice, words that mean something.
DAMAGE = """
let seed = args[1];
const lot = n => { seed = (seed * 48271) % 2147483647; return seed % n; };
const WORDS = ["1e999", "-1e308", "NaN", "__proto__", "constructor", "null", "[[[[[[", "{", "}", "\\"", "\\u0000",
  "\\ud800", "9".repeat(400), "toString", "-0", "<script>", "javascript:", "0x10", "[", "]", ",", "=", "\\n", "'", "{}",
  "1e-320", "true"];
const damaged = text => {
  for (let k = 1 + lot(4); k > 0; k--) {
    const at = lot(text.length + 1), to = Math.min(text.length, at + lot(12)), what = lot(5);
    if (what === 0) text = text.slice(0, at) + String.fromCharCode(32 + lot(96)) + text.slice(at + 1);
    if (what === 1) text = text.slice(0, at) + text.slice(to);
    if (what === 2) text = text.slice(0, at) + WORDS[lot(WORDS.length)] + text.slice(to);
    if (what === 3) text = text.slice(0, at) + text.slice(at, to).repeat(2 + lot(3)) + text.slice(to);
    const n = what === 4 ? text.slice(at).search(/[0-9]/) : -1;
    if (n >= 0) text = text.slice(0, at + n) + lot(1e6) + text.slice(at + n + 1);
  }
  return text;
};
const used = sheet => {
  const data = Bench.written(sheet);
  Bench.toToml(data, sheet.unit); Bench.toJson(data); Bench.toPython(sheet); Bench.toDxf(sheet);
  for (const id of Object.keys(sheet.links)) Bench.hull(Bench.shapeOf(sheet, id));
  Bench.rebased(sheet, Object.keys(sheet.links).map(() => [1, 2, 0.5]));
};
const count = { read: 0, refused: 0, longest: 0, odd: [] };
const tried = async (text, read) => {
  const begin = performance.now();
  try {
    const sheet = await read(text);
    if (sheet) { used(sheet); count.read++; } else count.refused++;
  } catch (fault) {
    const known = fault instanceof Bench.Fault;
    const said = known ? fault.sentence.replace(/“[^”]*”/g, "") : String(fault.stack);
    if (!known || /[{}]|\\n/.test(said) || said === fault.key) count.odd.push([said.slice(0, 300), text.slice(0, 200)]);
    count.refused++;
  }
  count.longest = Math.max(count.longest, performance.now() - begin);
};
"""


def told(count, least):
    assert count["odd"] == []
    assert count["longest"] < 2000
    assert count["read"] + count["refused"] == least and min(count["read"], count["refused"]) > least / 50


@pytest.mark.long
@pytest.mark.parametrize("form", ["json", "toml"])
def test_damaged_files_are_one_sentence(scripts, form):
    """2500 of each form, from every kind of joint and law."""
    texts = [json.dumps(to_dict(assembled(make()))) for make in CASES.values()]
    if form == "toml":
        texts = [Mechanism.from_json(text).to_toml() for text in texts]
    each = "for (let k = 0; k < 2500; k++) await tried(damaged(args[0][k % args[0].length]), Bench.fromText);"
    told(scripts(f"{DAMAGE}{each} return count;", texts, 7), 2500)


@pytest.mark.long
def test_damaged_addresses_are_one_sentence(scripts):
    """2500 damaged as they stand, 2500 packed anew after their inside was damaged."""
    given = [to_dict(assembled(make())) for make in CASES.values()]
    body = (
        DAMAGE
        + """
        const sheets = args[0].map(data => Bench.opened(Bench.checked(data)));
        const whole = await Promise.all(sheets.map(Bench.toFragment));
        for (let k = 0; k < 2500; k++) await tried(damaged(whole[k % whole.length]), Bench.fromFragment);
        const base64 = text => Buffer.from(text).toString("base64url");
        const inside = sheets.map(sheet => JSON.stringify({ u: "mm", m: Bench.written(sheet) }));
        const packed = text => "#j=" + base64(damaged(text));
        for (let k = 0; k < 2500; k++) await tried(packed(inside[k % inside.length]), Bench.fromFragment);
        return count;"""
    )
    told(scripts(body, given, 11), 5000)


@pytest.mark.long
def test_what_is_too_much_is_refused_at_once(scripts):
    bomb = compressobj(9, wbits=-15)
    packed = urlsafe_b64encode(bomb.compress(b" " * 30_000_000) + bomb.flush()).decode().rstrip("=")
    assert len(packed) < 60_000
    chain = [[k, k + 1] for k in range(70)]
    long = to_dict(Mechanism.four_bar(4, 1, 3, 3))
    long["joints"] = [{"kind": "R", "a": a, "b": b} for a, b in chain]
    deep = ["[" * 100_000, "{" + '"a":{' * 50_000, "x = " + "[" * 5_000]
    texts = [json.dumps(long), *deep, "#" * 390_000, '"' * 390_000, "a" * 500_000]
    found = scripts(
        """const out = [];
        const tell = async (read, text) => { const begin = performance.now(); let said = "";
          try { await read(text); } catch (fault) { said = fault.sentence; }
          out.push([said.length, performance.now() - begin < 2000]); };
        for (const text of args[0]) await tell(Bench.fromText, text);
        await tell(Bench.fromFragment, "#m=" + args[1]); await tell(Bench.fromFragment, "#m=" + "A".repeat(70000));
        return out;""",
        texts,
        packed,
    )
    assert all(5 < length < 200 and quick for length, quick in found)


def hostile():
    """A mechanism with markup wherever a file has text that somebody chose."""
    data = to_dict(gallery.jansen())
    data["points"] = {MARKUP[:40]: data["points"]["P"], "__proto__": {"link": 2, "at": [1.0, 2.0]}}
    data["link_names"] = {MARKUP[20:59]: 2, "constructor": 3}
    return data


@pytest.mark.long
def test_markup_in_names_is_text(window, bench, tmp_path):
    person = Person(window, bench).open()
    code = urlsafe_b64encode(json.dumps({"u": MARKUP, "m": hostile()}).encode()).decode().rstrip("=")
    person.open(f"#j={code}")
    person.until("return Object.keys(Bench.app.sheet.points).length > 5")
    person.script("Bench.do.all(Bench.app); for (const id of Bench.app.selection) Bench.app.select([id]);")
    for name in ("svg", "dxf", "python"):
        person.press(f"[data-do={name}]")
    person.script("document.getElementById('python').close()")
    page = write_workbench(tmp_path / "one.html", Mechanism.from_json(json.dumps(hostile())), single=True)
    for opened in (person, Person(window, page).open(page=page)):
        assert opened.script("return window.ran === undefined && !document.querySelector('img, iframe')")
        assert MARKUP[:40] in opened.script("return document.getElementById('sheet').textContent")
    assert not person.complaints()


@pytest.mark.long
def test_a_hostile_address_is_one_sentence_and_the_drawing_stays(window, bench):
    person = Person(window, bench).open()
    person.script("Bench.openText(Bench.app, Bench.templates[0].text)")
    before = person.drawn()
    script = "<script>window.ran=1</script>"
    for fragment in ("#m=AAAA", "#j=e30", "#m=" + "A" * 70_000, "#j=%3Cscript%3E", f"#m={script}", "#j=bnVsbA"):
        person.script("document.getElementById('said').textContent = ''; location.hash = arguments[0]", fragment)
        person.until("return document.getElementById('said').className === 'fault'")
        assert 10 < len(person.said()) < 120
        assert person.drawn() == before
    assert person.script("return window.ran === undefined")


# --- the files of the page


def test_the_policy_lets_own_scripts_run_and_nothing_else(bench, tmp_path):
    folder = bench.read_text("utf-8")
    assert "script-src 'self' file: 'wasm-unsafe-eval'" in folder and not re.search(r"<script(?! src=)", folder)
    single = single_page(json.dumps(hostile()))
    (policy,) = re.findall(r'http-equiv="Content-Security-Policy" content="([^"]*)"', single)
    assert {"default-src 'none'", "base-uri 'none'", "form-action 'none'"} <= set(policy.split("; "))
    scripts = re.findall(r"<script>(.*?)</script>", single, re.DOTALL)
    marks = {f"'sha256-{b64encode(sha256(text.encode()).digest()).decode()}'" for text in scripts}
    (allowed,) = re.findall(r"script-src ([^;]*)", policy)
    assert set(allowed.split()) == marks | {"'wasm-unsafe-eval'"}
    assert not re.search(r"https?://(?!www\.w3\.org/2000/svg)", single)
    for one in (folder, single):
        assert "connect-src" not in one and not re.search(r'\son[a-z]+="', one)


def test_the_page_is_small(bench):
    """The issue of the workbench: 300 kB at first load, compressed, and 3 MB with everything."""
    from zlib import compress

    sizes = {own.name: len(compress(own.read_bytes(), 9)) for own in bench.parent.iterdir()}
    first = {bench.name, *re.findall(r'(?:src|href)="([\w.-]+)"', bench.read_text("utf-8"))}
    assert len(first) > 6
    assert sum(sizes[name] for name in first) < 300_000
    assert sum(sizes.values()) < 3_000_000


def test_a_page_is_replaced_and_nothing_else_is(tmp_path):
    folder = tmp_path / "bench"
    first = write_workbench(folder)
    names = {own.name for own in folder.iterdir()}
    assert write_workbench(folder, gallery.klann()) == first
    assert {own.name for own in folder.iterdir()} == names
    assert [own.name for own in tmp_path.iterdir()] == ["bench"]
    (folder / "notes.txt").write_text("mine")
    with pytest.raises(GraphsynthError, match=r"holds other files \(notes.txt\)"):
        write_workbench(folder)
    with pytest.raises(GraphsynthError, match="is a folder"):
        write_workbench(tmp_path, single=True)
    with pytest.raises(GraphsynthError, match="does not exist"):
        write_workbench(tmp_path / "no" / "bench")


def test_a_mechanism_opens_as_a_page_and_in_a_notebook(tmp_path):
    path = tmp_path / "page.html"
    bench = Mechanism.four_bar(4, 1, 3.5, 3).open(path, browser=False)
    assert bench.page == path and "wasm-unsafe-eval" in path.read_text("utf-8")
    shown = bench._repr_html_()
    assert shown.startswith("<iframe") and 'sandbox="allow-scripts allow-downloads"' in shown and "<script" not in shown


def test_in_a_notebook_it_moves_and_says_that_there_is_no_address(window, tmp_path):
    cell = tmp_path / "cell.html"
    bench = Mechanism.four_bar(4, 1, 3.5, 3).open(tmp_path / "page.html", browser=False)
    cell.write_text(f"<!doctype html>{bench._repr_html_()}")
    window.get_log("browser")
    window.get(cell.as_uri())
    window.switch_to.frame(0)
    try:
        ready = "return typeof Bench !== 'undefined' && Boolean(Bench.app?.motion?.driven)"
        end = time.monotonic() + 30
        while not window.execute_script(ready) and time.monotonic() < end:
            time.sleep(0.1)
        assert window.execute_script("return Bench.app.motion.sweep().full")
        window.execute_async_script("Bench.do.share(Bench.app).then(arguments[0])")
        assert "no address" in window.find_element("id", "said").text
    finally:
        window.switch_to.default_content()
    assert not [entry for entry in window.get_log("browser") if entry["level"] == "SEVERE"]


def test_a_mechanism_without_a_pose_is_assembled(tmp_path):
    from dataclasses import replace

    linkage = replace(Mechanism.four_bar(4, 1, 3.5, 3), pose=None)
    assert write_workbench(tmp_path / "a", linkage).is_file()
    rough = replace(linkage, pose=((0.0, 0.0, 0.0), (0.0, 0.1, 0.1), (1.0, 0.0, 1.0), (4.0, 0.0, 1.5)))
    assert write_workbench(Path(tmp_path / "b"), rough).is_file()


def test_the_command_writes_pages(tmp_path, capsys, monkeypatch):
    from graphsynth.cli import main

    monkeypatch.chdir(tmp_path)
    assert main(["workbench"]) == 0
    assert "index.html" in capsys.readouterr().out
    assert main(["workbench", "klann", "--single", "-o", "k.html", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["bytes"] == (tmp_path / "k.html").stat().st_size
    (tmp_path / "m.toml").write_text(gallery.jansen().to_toml())
    assert main(["workbench", "m.toml", "-o", "other"]) == 0
    assert main(["workbench", "nothing.toml"]) == 2
    error = capsys.readouterr().err
    assert error.count("\n") == 1 and "nothing.toml" in error
