"""The pure scripts of the workbench in Node: drawings, files, addresses, words."""

from __future__ import annotations

import json
import math
import re
from dataclasses import replace

import numpy as np
import pytest

from graphsynth import Driver, Gear, Mechanism, MechanismGraph, PinSlot, Prismatic, Revolute, enumerate_chains
from graphsynth.mechanism import gallery
from graphsynth.mechanism.constraints import residual
from graphsynth.mechanism.files import to_dict
from graphsynth.mechanism.laws import Harmonic, Linear, Polynomial, Table
from graphsynth.workbench.posing import assembled
from graphsynth.workbench.writing import languages, page_file, templates

FOUR_BAR = """
let s = Bench.empty();
const find = (x, y) => Object.keys(s.points).find(k => s.points[k].x === x && s.points[k].y === y) || null;
const at = (x, y) => ({x, y, point: find(x, y), link: null, pair: null});
const use = (tool, ...picks) => { s = Bench.TOOLS[tool].apply(s, picks.map(p => at(...p))).sheet; };
use("link", [-40, 0], [-40, 20]); use("plate", [-40, 20], [30, 60], [-10, 80]); use("link", [30, 60], [40, 0]);
use("ground", [-40, 0]); use("ground", [40, 0]); use("driver", [-40, 0]);
"""


def geared():
    """Two wheels on the frame and a rod between their pins: five links, one gear pair."""
    graph = MechanismGraph(5, [(0, 1), (0, 2), (1, 2, 2), (1, 3), (2, 4), (3, 4)], frame=0)
    joints = [
        Revolute(0, 1), Revolute(0, 2, (5.0, 0.0)), Gear(1, 2, radius_a=2.0, radius_b=3.0, offset=0.3),
        Revolute(1, 3, (1.5, 0.0)), Revolute(2, 4, (1.0, 0.5)), Revolute(3, 4, (4.0, 0.0), (4.0, 0.0)),
    ]  # fmt: skip
    return Mechanism(graph, joints, [Driver(0, 1, Linear(2.0, 0.4))], {"P": (3, (2.0, 1.0))})


def slotted():
    graph = MechanismGraph(3, [(0, 1), (0, 2), (1, 2, 2)], frame=0)
    joints = [Revolute(0, 1), Revolute(0, 2, (0.0, -3.0)), PinSlot(2, 1, (0.2, 0.0), (1.0, 0.0), 0.1)]
    return Mechanism(graph, joints, [Driver(1, 0, Harmonic(0.1, 0.8, 1.0, 0.2))])


def sliding():
    graph = MechanismGraph(4, [(0, 1), (1, 2), (2, 3), (0, 3)], frame=1)
    joints = [
        Prismatic(1, 0, (1.0, 0.5), (0.2, 0.1), 0.3, 0.1),
        Revolute(1, 2, (0.0, 2.0)),
        Revolute(2, 3, (2.0, 0.0)),
        Revolute(0, 3, (0.5, 0.0), (2.0, 0.0)),
    ]
    return Mechanism(graph, joints, [Driver(1, 0, Polynomial((0.2, 1.0, 0.1)))], {}, None, (0.0, 0.4), {"ram": 0})


CASES = {
    **{name: getattr(gallery, name) for name in gallery.__all__},
    "four_bar": lambda: Mechanism.four_bar(4.0, 1.0, 3.5, 3.0, coupler_point=(2.0, 1.0), crank_angle=0.7),
    "slider_crank": lambda: Mechanism.slider_crank(1.0, 3.0, 0.2),
    "geared": geared, "slotted": slotted, "sliding": sliding,
    "table": lambda: replace(sliding(), drivers=(Driver(1, 0, Table((0.0, 0.2, 0.4), (0.2, 0.5, 0.7))),)),
}  # fmt: skip


@pytest.fixture(scope="module")
def rewritten(scripts):
    """Every case read by the page and written again, as drawn and as TOML."""
    given = {name: to_dict(assembled(make())) for name, make in CASES.items()}
    return scripts(
        """return Object.fromEntries(Object.entries(args[0]).map(([name, data]) => {
             const sheet = Bench.opened(Bench.checked(data)), again = Bench.written(sheet);
             const twice = Bench.written(Bench.fromText(Bench.toToml(again, "mm")));
             return [name, [again, Bench.toToml(again, "mm"), JSON.stringify(twice) === JSON.stringify(again)]];
           }))""",
        given,
    )


@pytest.mark.parametrize("name", sorted(CASES))
def test_what_the_page_reads_and_writes_moves_the_same(rewritten, name):
    """The page counts every link from the drawn position; where the points of the mechanism go is the same."""
    mine = assembled(CASES[name]())
    again, text, same_twice = rewritten[name]
    assert same_twice
    theirs = Mechanism.from_json(json.dumps(again))
    assert Mechanism.from_toml(text) == theirs
    assert theirs.graph == mine.graph
    assert np.abs(residual(theirs.joints, np.zeros((mine.graph.links, 3)))).max() < 1e-12 * max(
        1.0, np.abs(mine.dimensions).max()
    )
    inputs = None if mine.input_range is None else np.linspace(*mine.input_range, 21)
    if len(mine.drivers) == 1 and inputs is None:
        first = {"slotted": 0.0, "geared": 0.0}.get(name)
        inputs = np.linspace(first, first + 0.6, 13) if first is not None else None
    one, other = mine.simulate(inputs), theirs.simulate(inputs)
    assert np.array_equal(one.assembled, other.assembled)
    start = np.array(mine.pose)
    size = max(1.0, np.ptp(one.poses[one.assembled][..., :2]))
    for link in range(mine.graph.links):
        x, y, turn = start[link]
        for place in ((0.0, 0.0), (1.0, 2.0)):
            local = complex(*place)
            drawn = complex(x, y) + np.exp(1j * turn) * local
            a, b = one.poses[:, link], other.poses[:, link]
            here = a[:, 0] + 1j * a[:, 1] + np.exp(1j * a[:, 2]) * local
            there = b[:, 0] + 1j * b[:, 1] + np.exp(1j * b[:, 2]) * drawn
            assert np.abs(here - there)[one.assembled].max() < 1e-8 * size


def test_a_drawn_four_bar_is_what_was_drawn(scripts):
    data = scripts(FOUR_BAR + "return Bench.written(s)")
    drawn = Mechanism.from_json(json.dumps(data))
    lengths = (80.0, 20.0, math.hypot(70, 40), math.hypot(10, 60))
    wanted = Mechanism.four_bar(*lengths)
    assert drawn.graph.key == wanted.graph.key
    motion, other = drawn.simulate(), wanted.simulate()
    swing, known = (np.ptp(np.unwrap(m.poses[:, 3, 2])) for m in (motion, other))
    assert swing == pytest.approx(known, rel=1e-4)
    assert list(drawn.points) == ["D"]


def test_a_multiple_joint_keeps_the_tree_of_its_file(scripts):
    """Three links at one place, jointed in a row: the graph comes back with the joints that the file had."""
    graph = MechanismGraph(6, [(0, 1), (0, 3), (0, 5), (1, 2), (2, 3), (2, 4), (4, 5)], frame=0)
    places = [(0, 0), (8, 0), (6, -1), (1, 3), (6, 3), (1, 3), (5, 2)]
    made = Mechanism.from_graph(graph, places, driver=(0, 1))
    again = scripts("return Bench.written(Bench.opened(Bench.checked(args[0])))", to_dict(made))
    assert Mechanism.from_json(json.dumps(again)).graph == graph


def test_sheets_are_never_changed_and_undo_brings_them_back(scripts):
    found = scripts(
        FOUR_BAR.replace("let s = Bench.empty();", "let s = Bench.empty(); const seen = [];").replace(
            "=> { s =", "=> { seen.push([s, JSON.stringify(s)]); s ="
        )
        + """
        const object = o => o && typeof o === "object";
        const deep = o => { if (object(o)) { Object.freeze(o); Object.values(o).forEach(deep); } };
        deep(s);
        const all = Object.keys(s.links), one = all[1], p = Object.keys(s.points)[0];
        Bench.without(s, [one]); Bench.copied(s, all, (x, y) => [x + 1, y]); Bench.mirrored(s, all, 3);
        Bench.placed(s, {[p]: [1, 2]}); Bench.unpinned(s, p); Bench.toggleGround(s, p);
        Bench.rebased(s, all.map(() => [1, 2, 3]));
        const h = new Bench.History(seen[0][0]);
        for (const [sheet] of seen.slice(1)) h.push(sheet);
        const last = h.sheet; h.undo(); h.undo(); h.redo();
        const back = h.sheet === seen[seen.length - 2][0]; h.push(s);
        const whole = seen.every(([sheet, text]) => JSON.stringify(sheet) === text);
        return [whole, last === seen[seen.length - 1][0], back, h.canRedo, h.all.length];"""
    )
    assert found == [True, True, True, False, 6]


def test_deleting_leaves_nothing_that_hangs_in_the_air(scripts):
    found = scripts(
        FOUR_BAR
        + """
        const out = [];
        for (const id of [...Object.keys(s.points), ...Object.keys(s.links).slice(1)]) {
          const left = Bench.without(s, [id]), links = Object.values(left.links).flatMap(l => l.points);
          out.push([links.every(p => left.points[p]), Object.keys(left.points).every(p => links.includes(p)),
            left.drivers.every(d => Bench.drivable(left, d.base, d.link)), Bench.written(left).format.length > 0]);
        }
        return out;"""
    )
    assert all(all(row) for row in found)


def test_a_copy_and_a_mirror_image_have_the_same_lengths(scripts):
    found = scripts(
        FOUR_BAR
        + """
        const all = Object.keys(s.links);
        const sides = (t, own) => own.map((p, k) => Bench.distance(t, p, own[(k + 1) % own.length]));
        return [Bench.copied(s, all, (x, y) => [x + 7, y - 3])[0], Bench.mirrored(s, all, 50)[0]].map(t =>
          Object.keys(t.links).slice(1).map(id => sides(t, t.links[id].points)));"""
    )
    for lengths in found:
        assert len(lengths) == 6
        for one, other in zip(lengths[:3], lengths[3:]):
            assert one == pytest.approx(other, rel=1e-14)


def test_a_copy_is_driven_as_its_original_and_a_mirror_image_the_other_way(scripts):
    found = scripts(
        FOUR_BAR
        + """
        const all = Object.keys(s.links);
        return [Bench.copied(s, all, (x, y) => [x + 7, y - 3])[0], Bench.mirrored(s, all, 50)[0]].map(Bench.written);"""
    )
    for data, sense in zip(found, (1.0, -1.0)):
        both = Mechanism.from_json(json.dumps(data))
        assert len(both.drivers) == both.graph.mobility == 2
        one, other = both.simulate().poses[:, [1, 4], 2].T
        assert np.allclose(other, sense * one, atol=1e-12)


def test_a_copy_of_a_multiple_joint_has_its_joints_and_its_driver(scripts):
    """Three links at one place in a row, the last one driven on the second: so are their copies."""
    graph = MechanismGraph(6, [(0, 1), (0, 3), (0, 5), (1, 2), (2, 3), (2, 4), (4, 5)], frame=0)
    places = [(0, 0), (8, 0), (6, -1), (1, 3), (6, 3), (1, 3), (5, 2)]
    made = Mechanism.from_graph(graph, places, driver=(2, 4))
    data = scripts(
        """const s = Bench.opened(Bench.checked(args[0]));
           return Bench.written(Bench.copied(s, Object.keys(s.links), (x, y) => [x + 20, y])[0]);""",
        to_dict(made),
    )
    both = Mechanism.from_json(json.dumps(data))
    pairs = {(joint.a, joint.b) for joint in both.graph.joints}
    assert {(d.base, d.link) for d in both.drivers} == {(2, 4), (7, 9)}
    assert all((joint.a + 5 if joint.a else 0, joint.b + 5) in pairs for joint in graph.joints)


def test_numbers_with_units(scripts):
    asked = [
        ["12", "mm"],
        ["1.5 in", "mm"],
        ["3,2 см", "mm"],
        ["-4", "m"],
        ["−4", "m"],
        ["1 m", "in"],
        ["", "mm"],
        ["4 kg", "mm"],
        ["1e2", "mm"],
        ["x", "mm"],
    ]
    found = scripts(
        "return args[0].map(a => { const v = Bench.parseLength(...a); return Number.isNaN(v) ? null : v; })", asked
    )
    assert found[:6] == pytest.approx([12, 38.1, 32, -4, -4, 1000 / 25.4])
    assert found[6:] == [None, None, 100, None]


@pytest.mark.parametrize("name", ["geared", "sliding", "table", "excavator_arm"])
def test_in_another_unit_the_mechanism_is_as_large_as_it_was(scripts, name):
    """Only its numbers change: the motion in inches is that in millimetres, and the way back loses nothing."""
    found = scripts(
        """const s = Bench.opened(Bench.checked(args[0])), other = Bench.inUnit(s, "in");
           return [other, Bench.inUnit(other, "mm"), s].map(Bench.written);""",
        to_dict(assembled(CASES[name]())),
    )
    small, large, known = (Mechanism.from_json(json.dumps(data)) for data in found)
    assert np.allclose(large.dimensions, known.dimensions, rtol=1e-13, atol=1e-13)
    inputs = np.linspace(0.0, 0.3, 5) if known.input_range is None else np.linspace(*known.input_range, 5)
    one, other = (own.simulate(inputs, events=False).poses for own in (small, large))
    assert np.isfinite(other).all()
    assert np.abs(one * [25.4, 25.4, 1.0] - other).max() < 1e-9 * max(1.0, np.abs(other).max())


def test_the_unit_of_a_file_is_that_of_its_own_comment(scripts):
    """Not a word of any other comment that a file may begin with."""
    found = scripts(
        """const own = Bench.languages().flatMap(name => { Bench.speak(name); return Bench.UNITS.map(unit => [unit,
             Bench.unitOf(Bench.toToml(Bench.written(Bench.empty()), unit))]); });
           return [own, args[0].map(Bench.unitOf)]""",
        ["# a press with its rods in\n", "# drawn in 1906, lengths in m and angles in rad\n", "format = 1"],
    )
    assert all(unit == read for unit, read in found[0]) and len(found[0]) == 8
    assert found[1] == [None, None, None]


def test_several_drivers_stay_in_step(scripts):
    """One of two drivers was moved, its speed or its place changed: the file begins where the drawing stands."""
    graph = MechanismGraph(5, [(0, 1), (1, 2), (2, 3), (3, 4), (0, 4)], frame=0)
    made = Mechanism.from_graph(graph, [(0, 0), (-2, 5), (5, 9), (12, 5), (10, 0)], driver=(0, 1))
    made = replace(made, drivers=(Driver(0, 1), Driver(0, 4)))
    held = replace(made, drivers=(Driver(0, 1), Driver(0, 4, Polynomial((0.0,)))))
    moved = held.simulate(np.linspace(0.0, -0.7, 15)).poses[-1]
    found = scripts(
        """const s = Bench.opened(Bench.checked(args[0])), one = Bench.rebased(s, args[1]);
           const [first, second] = one.drivers, off = Bench.toggleDriver(one, second.base, second.link);
           return [one, Bench.toggleDriver(off, second.base, second.link)].map(Bench.written)""",
        to_dict(made),
        moved.tolist(),
    )
    for data in found:
        drawn = Mechanism.from_json(json.dumps(data))
        motion = drawn.simulate()
        assert motion.assembled.all()
        start = drawn.simulate([-drawn.drivers[0].law.offset]).poses[0]
        assert np.abs(start).max() < 1e-12 * 10


def test_lengths_are_read_with_the_units_that_are_shown_in_every_language(scripts):
    """80 mm, as the page writes it in English and in Russian, is 80 mm, in a drawing in mm or in inches."""
    found = scripts(
        """return Bench.languages().map(name => {
             Bench.speak(name);
             const shown = Bench.UNITS.map(Bench.unitName);
             const read = unit => shown.map(own => Bench.parseLength(`8 ${own}`, unit));
             return [shown, read("mm"), read("in"), Bench.unitName("°")];
           })"""
    )
    assert [own[0] for own in found] == [["mm", "cm", "m", "in"], ["мм", "см", "м", "дюйм"]]
    for _, metric, inches, angle in found:
        assert metric == pytest.approx([8, 80, 8000, 203.2]) and inches == pytest.approx([x / 25.4 for x in metric])
        assert angle == "°"


def test_kinds_of_joints_are_words_of_the_language(scripts):
    """All but the signs R and P: groups and joints whose axis leans are named with them."""
    kinds = ["R", "P", "pin-slot", "gear", "cam"]
    found = scripts(
        "return Bench.languages().map(name => { Bench.speak(name); return args[0].map(Bench.kindName); })", kinds
    )
    assert found == [kinds, ["R", "P", "палец в пазу", "зацепление", "кулачок"]]


def test_places_snap_to_points_then_angles_then_the_grid(scripts):
    found = scripts(
        """const p = {x: 3.02, y: 2.9}, point = {x: 3.1, y: 3};
           return [...[{point, grid: 1}, {grid: 1}, {off: true, grid: 1}].map(how => Bench.snapped(p, how)),
             Bench.snapped({x: 10.2, y: 0.4}, {from: {x: 0, y: 0}, straight: true, grid: 1}),
             ...[1, 2.8, 100].map(scale => Bench.gridStep(scale, 14))];"""
    )
    assert (found[0]["x"], found[0]["y"]) == (3.1, 3)
    assert (found[1]["x"], found[1]["y"]) == (3, 3)
    assert (found[2]["x"], found[2]["y"]) == (3.02, 2.9)
    assert (found[3]["x"], found[3]["y"]) == (10, 0)
    assert found[4:] == pytest.approx([20, 5, 0.2])


# --- words


def test_every_language_has_every_word():
    english, *others = languages().items()
    assert [name for name, _ in others] == ["ru"]
    for _, table in others:
        assert list(table) == list(english[1])
        for key, text in english[1].items():
            assert sorted(re.findall(r"\{(\w+)\}", text)) == sorted(re.findall(r"\{(\w+)\}", table[key])), key
            assert table[key].strip() and text.strip()


def test_every_word_is_asked_for_and_every_word_asked_for_is_there():
    names = page_file("order.txt").split()
    text = page_file("index.html") + "".join(page_file(f"{name}.js") for name in names)
    known = languages()["en"]
    groups = (
        "tool hint template name pair kind mode do language said fault.file event know chain chains jam target passing"
        " unit"
    )
    built = [f"{group}." for group in groups.split()]
    for key in known:
        assert f'"{key}"' in text or f"'{key}'" in text or any(key.startswith(start) for start in built), key
    for key in re.findall(
        r'"((?:fault|said|do|panel|hint|show|name|menu|set|page|help|empty|sheet|key|file)\.[\w.]+)"', text
    ):
        assert key in known, key
    for kind in re.findall(r'\bbad\([^,]+(?:\([^)]*\))?, "(\w+)"', page_file("reading.js")):
        assert f"fault.file.{kind}" in known, kind
    for entry in templates():
        assert f"template.{entry['name']}" in known


@pytest.mark.parametrize("name", page_file("order.txt").split())
def test_no_script_holds_a_sentence(name):
    """What people read stands in the files of words; a text in a script is a name, a selector or a path."""
    text = re.sub(r"/\*.*?\*/|^\s*//.*$", "", page_file(f"{name}.js"), flags=re.DOTALL | re.MULTILINE)
    assert not re.search(r"[а-яё]{3}", text.replace("дюйм", "").replace("см|м", ""), re.IGNORECASE)
    for literal in re.findall(r'"((?:[^"\\\n]|\\.)*)"', text):
        assert (
            not re.search(r"[A-Za-z]{2,} [A-Za-z]{2,}", literal)
            or literal in ALLOWED
            or re.match(r"(from|import) [a-z.]+", literal)  # a line of Python
            or "." in literal.split()[0]
        ), literal


#: Lists of names, in scripts.
ALLOWED = {
    "sheet view tool draft", "sheet view tool draft pose", "sheet view tool", "use strict", "graphsynth mechanism",
    "input:not([type=range]):not([type=checkbox]), select, textarea, dialog", "button, summary, a, [type=checkbox]",
    "input,select,button", "snap point", "change point", "dead centre", "input time",
}  # fmt: skip


@pytest.mark.parametrize("name", [*page_file("order.txt").split(), "theme"])
def test_nothing_is_parsed_as_markup_or_run_and_files_are_small(name):
    text = page_file(f"{name}.js")
    assert not re.search(
        r"innerHTML|outerHTML|insertAdjacentHTML|document\.write|\beval\b|new Function|srcdoc|DOMParser", text
    )
    assert not re.search(r"fetch\(|XMLHttpRequest|WebSocket|import\(|https?://(?!www\.w3\.org/2000/svg)", text)
    assert len(text.splitlines()) <= 400


# --- Python, DXF, GIF, other frames


@pytest.mark.long
@pytest.mark.parametrize("name", sorted(CASES))
def test_the_python_text_makes_the_mechanism(scripts, name):
    """What the page shows as Python is run, and its mechanism moves as the one on the page."""
    data = to_dict(assembled(CASES[name]()))
    again, text = scripts(
        "const s = Bench.opened(Bench.checked(args[0])); return [Bench.written(s), Bench.toPython(s)]", data
    )
    making = text.partition("motion = ")[0]
    space = {}
    exec(making, space)
    made, mine = space["mechanism"], Mechanism.from_json(json.dumps(again))
    assert made.graph == mine.graph and made.joints == mine.joints and made.drivers == mine.drivers
    assert set(mine.points) <= set(made.points)
    assert text.endswith('motion.animate("mechanism.html")\n')


def test_a_plain_drawing_is_short_python(scripts):
    text = scripts(FOUR_BAR + "return Bench.toPython(s)")
    assert "from_points" in text and text.count("\n") < 14


def test_the_dxf_holds_links_and_joints(scripts, tmp_path):
    ezdxf = pytest.importorskip("ezdxf")
    text = scripts(FOUR_BAR + "return Bench.toDxf(s, [{points: [[0, 0], [1, 2], [3, 3]], closed: true}])")
    path = tmp_path / "mechanism.dxf"
    path.write_text(text)
    found = ezdxf.readfile(path)
    assert not found.audit().has_errors
    lines = {(e.dxf.layer, len(e.vertices), e.is_closed) for e in found.modelspace().query("POLYLINE")}
    links = {("LINK_1", 2, False), ("LINK_2", 3, True), ("LINK_3", 2, False)}
    assert lines == links | {("PATHS", 3, True)}
    centres = {tuple(round(c, 9) for c in e.dxf.center)[:2] for e in found.modelspace().query("CIRCLE")}
    assert centres == {(-40, 0), (-40, 20), (30, 60), (-10, 80), (40, 0)}


def test_a_gif_is_read_by_others(scripts, tmp_path):
    """Three pictures with noise, so that the codes fill their table and it is begun anew."""
    image = pytest.importorskip("PIL.Image")
    found = scripts(
        """let seed = 1; const lot = () => (seed = (seed * 48271) % 2147483647);
           const pictures = [0, 1, 2].map(n => Uint8ClampedArray.from({length: 4 * 120 * 90},
             (_, k) => (k % 4 === 3 ? 255 : ((lot() >> 5) % 8) * 32 + n)));
           return [Array.from(Bench.toGif(120, 90, pictures, 5)), pictures.map(p => Array.from(p))];"""
    )
    path = tmp_path / "x.gif"
    path.write_bytes(bytes(found[0]))
    with image.open(path) as read:
        assert (read.n_frames, read.size, read.info["duration"], read.info["loop"]) == (3, (120, 90), 50, 0)
        for n, pixels in enumerate(found[1]):
            read.seek(n)
            ours = np.array(pixels).reshape(90, 120, 4)[..., :3]
            theirs = np.array(read.convert("RGB")).astype(int)
            assert np.median(np.abs(ours - theirs)) <= 32 and theirs.shape == ours.shape
    flat = scripts(
        """const p = Uint8ClampedArray.from({length: 4 * 50 * 40}, (_, k) => [200, 10, 40, 255][k % 4]);
           return Array.from(Bench.toGif(50, 40, [p], 5));"""
    )
    path.write_bytes(bytes(flat))
    with image.open(path) as read:
        assert np.unique(np.array(read.convert("RGB")).reshape(-1, 3), axis=0).tolist() == [[200, 10, 40]]


def test_the_picture_is_scaled_about_the_first_place(scripts):
    found = scripts(
        """return Bench.scaledPicture({x: 10, y: 50, width: 200, height: 100, href: ""},
             [{x: 20, y: 30}, {x: 60, y: 30}], 10);"""
    )
    assert (found["x"], found["y"], found["width"], found["height"]) == (17.5, 35, 50, 25)


def test_the_key_of_the_chain_is_that_of_the_library(scripts):
    """Every chain of four to eight links in shuffled numbers, and mechanisms with joints of mobility 2."""
    lots = np.random.default_rng(5)
    graphs = []
    for chain in [chain for links in (4, 6, 8) for chain in enumerate_chains(links)]:
        to = lots.permutation(chain.links).tolist()
        graphs.append(chain.relabelled(to))
    graphs += [geared().graph.without_frame(), slotted().graph.without_frame()]
    joints = [[{"kind": ("R", "gear")[m - 1], "a": b, "b": a} for a, b, m in graph.joints] for graph in graphs]
    given = [{"pose": [[0, 0, 0]] * graph.links, "joints": own} for graph, own in zip(graphs, joints)]
    found = scripts(
        "const labels = await Kernels.load('labels'); return args[0].map(data => Bench.chainKey(labels, data))", given
    )
    assert found == [graph.key for graph in graphs]
