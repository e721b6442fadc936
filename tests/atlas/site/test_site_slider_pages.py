"""Chains with sliders on the pages of the atlas: choices, addresses, sketches, the workbench; searched and pasted."""

from __future__ import annotations

from urllib.parse import quote

import pytest

from graphsynth import Mechanism, MechanismGraph, enumerate_slider_chains
from graphsynth.atlas.site.named import named
from graphsynth.structure.slider_chains import SliderChain
from graphsynth.workbench.writing import templates

pytest.importorskip("selenium")  # the next line needs it

from .test_site_browser import by, css, found, labels, moving, put, until

SHOWN = """const done = arguments[arguments.length - 1];
Atlas.loadSliders().then(() => done(Atlas.rows.map(row => {
  const graph = Atlas.decodeKey(row.key);
  return [row.key, Atlas.slidersOf(row).map(own => [own.length, Atlas.pairs(graph, own), Atlas.sliderKey(graph, own)])];
})))"""


def test_the_page_has_every_choice_under_its_chain(page, catalogue):
    window = page()
    shown = window.execute_async_script(SHOWN)
    assert [key for key, _ in shown] == window.execute_script("return Atlas.rows.map(row => row.key)")
    assert sum(len(own) for _, own in shown) == 2 + 29 + 946
    for key, own in shown:
        graph = MechanismGraph.from_key(key)
        assert [count for count, _, _ in own] == sorted(count for count, _, _ in own)
        for _, pairs, slider_key in own:
            chain = SliderChain.from_graph(graph, [tuple(map(int, pair.split("-"))) for pair in pairs.split(",")])
            assert chain.key == slider_key


@pytest.mark.long
def test_frames_that_the_page_proposes_turn(page, scripts):
    """For every choice of six links the page names a frame and drivers with revolute joints only, if there are such."""
    asked = page().execute_async_script(
        """const done = arguments[arguments.length - 1];
           const sets = (graph, frame) => Atlas.neighbours(graph)[frame].map(link => [link]);
           Atlas.loadSliders().then(() => done(Atlas.rows.filter(row => row.links < 7).flatMap(row => {
             const graph = Atlas.decodeKey(row.key), joints = graph.joints.map(joint => joint.slice(0, 2));
             return Atlas.slidersOf(row).map(own => [graph.links, joints, {sliders: own.map(k => joints[k]),
               ...Atlas.turning(graph, {frame: null, drivers: []}, own, sets)}]);
           })))"""
    )
    assert len(asked) == 31
    free = [one for one in asked if one[2]["frame"] is not None]
    for links, _, more in free:
        assert not {link for pair in more["sliders"] for link in pair} & set(more["drivers"]), (links, more)
    turned = scripts(
        """const sketch = await Kernels.load("sketch"), motion = await Kernels.load("motion");
           return args[0].map(([links, joints, more]) => {
             const { places } = Layout.places(sketch, links, joints);
             const engine = Engine.open(motion, Turning.found(motion, links, joints, places, more));
             const { full } = engine.sweep(73, 0);
             engine.close();
             return full;
           });""",
        free,
        modules=("sketch", "motion"),
    )
    assert len(free) > 20 and all(turned)


def chosen(window):
    return window.execute_script("return [...document.querySelectorAll('[data-slider]')].map(g => g.dataset.joint)")


def test_a_choice_is_pressed_drawn_and_kept_in_the_address(page):
    window = page("#/1BgMw8g")
    until(window, "document.querySelectorAll('#sliders .pick').length === 15")
    window.execute_script("document.querySelector('#sliders [data-sliders=\"0-3,1-2\"]').click()")
    assert chosen(window) == ["0-3", "1-2"]
    assert "sliders=0-3,1-2" in window.current_url
    assert "&p=0-3,1-2&f=" in css(window, "#bench").get_attribute("src")
    (pressed,) = window.find_elements(by.CSS_SELECTOR, "#sliders [aria-pressed=true]")
    assert pressed.text == "0-3,1-2"
    address = window.current_url[window.current_url.index("#") :]
    page(address)
    until(window, "document.querySelectorAll('[data-slider]').length === 2")
    # another frame keeps the sliders; revolute joints only takes them back
    window.execute_script("document.querySelector('.pick[data-frame]:not([disabled])').click()")
    assert "sliders=0-3,1-2" in window.current_url and len(chosen(window)) == 2
    window.execute_script("document.querySelector('#sliders [data-sliders=\"\"]').click()")
    assert chosen(window) == [] and "sliders" not in window.current_url


@pytest.mark.parametrize("address", ["#/1BgMw8g?sliders=1-5", "#/1BAN4?frame=0&sliders=0-2,1-2"])
def test_the_workbench_moves_what_is_chosen(page, address):
    """A listed choice, and the Scotch yoke, which is not listed: its yoke has prismatic joints only."""
    window = page(address)
    try:
        moving(window)
        text, full = window.execute_script(
            "return [Bench.toJson(Bench.written(Bench.app.sheet)), Bench.app.motion.sweep().full]"
        )
    finally:
        window.switch_to.default_content()
    mechanism = Mechanism.from_json(text)
    graph, sliders = MechanismGraph.from_key(address[2:].split("?")[0]), address.rsplit("=", 1)[1]
    wanted = SliderChain.from_graph(graph, [tuple(map(int, pair.split("-"))) for pair in sliders.split(",")])
    own = [(joint.a, joint.b) for joint in mechanism.joints if joint.kind == "P"]
    assert SliderChain.from_graph(mechanism.graph.without_frame(), own).key == wanted.key
    assert full and mechanism.simulate().closure.closed
    assert ("Not listed: link 2" in css(window, "#sliders").text) == (wanted.links == 4)


def test_what_enumerate_writes_leads_to_the_chain_with_its_sliders(page):
    """By text form and by key: as an address, in the search, and pasted."""
    chain = list(enumerate_slider_chains(6, 2))[4]
    framed = next(iter(enumerate_slider_chains(4, 1, framed=True)))
    window = page()
    for own in (chain, framed):
        for text in (own.to_text(), own.key):
            page(f"#/{quote(text)}")
            key = own.graph.without_frame().key
            until(window, "document.querySelector('.keyline code')?.textContent === arguments[0]", key)
            graph = MechanismGraph.from_key(key)
            sliding = [tuple(map(int, pair.split("-"))) for pair in chosen(window)]
            frame = None if own.frame is None else int(window.current_url.split("frame=")[1].split("&")[0])
            drawn = MechanismGraph(graph.links, graph.joints, frame=frame)
            assert SliderChain.from_graph(drawn, sliding).key == own.key
    page()
    until(window, "document.querySelectorAll('#list li').length")
    for text in (chain.to_text(), chain.key):
        put(window, "input[name=text]", text)
        until(window, "document.querySelectorAll('#list li').length === 1")
        assert "sliders=" in css(window, "#list a").get_attribute("href")
    page("#/find")
    field = until(window, "document.querySelector('#pasted')")
    for text in (chain.to_text(), chain.key, "7-8, 8-9, 9-10, 10-7 P:7-10"):
        field.clear()
        field.send_keys(text)
        until(window, "document.querySelector('#answer .found')?.getAttribute('href').includes('sliders=')")
        until(window, "document.querySelector('#answer [data-slider]')")
        assert found(window).startswith("#/1BAN4" if text.startswith("7") else f"#/{chain.graph.key}")


WRONG = ["0-1", "x", "0-0", "0-3,0-99", "<b>", "1-2,", "__proto__-0", "0-3;1-2"]


def test_what_is_no_joint_is_told_in_one_sentence(page):
    window = page()
    told = window.execute_script(
        """return arguments[0].map(text => {
             try { Atlas.read(`0-2, 0-3, 1-2, 1-3 P:${text}`); return "was read"; }
             catch (fault) { return fault instanceof Atlas.Fault ? fault.message : "crash: " + fault.stack; }
           })""",
        WRONG,
    )
    for text, sentence in zip(WRONG, told, strict=True):
        assert "is to slide, but is no joint" in sentence and "\n" not in sentence, (text, sentence)
    for text in WRONG:
        page(f"#/1BAN4?sliders={quote(text)}")
        until(window, "document.querySelector('#sliders')?.textContent.includes('is no joint')")
        assert chosen(window) == [] and not window.find_elements(by.CSS_SELECTOR, "#sliders b")
    page(f"#/{quote('1p.')}AAAA")
    until(window, "document.querySelector('#entry h1')?.textContent === 'Not in this atlas'")


def test_named_sliders_are_those_of_their_mechanisms_and_found_by_name(page):
    made = {entry["name"]: Mechanism.from_json(entry["text"]) for entry in templates()}
    for entry in named():
        sliders = [tuple(map(int, pair.split("-"))) for pair in entry.get("sliders", "").split(",") if pair]
        if "template" in entry:
            mechanism = made[entry["template"]]
            own = SliderChain.from_graph(mechanism.graph, [(j.a, j.b) for j in mechanism.joints if j.kind == "P"])
            frame = entry.get("frame", own.frame)
            graph = MechanismGraph.from_key(entry["key"])
            if own.sliders:
                held = MechanismGraph(graph.links, graph.joints, frame=frame)
                assert SliderChain.from_graph(held, sliders).key == own.key, entry["name"]
            assert bool(own.sliders) == bool(sliders), entry["name"]
        else:
            assert sliders and entry["frame"] < MechanismGraph.from_key(entry["key"]).links
    window = page()
    for words, sliders in (
        ("slider-crank", "frame=0&sliders=0-3"),
        ("quick return", "frame=4&sliders=1-5,3-4"),
        ("scotch", "sliders=0-2,1-2"),
    ):
        put(window, "input[name=text]", words)
        until(window, "document.querySelectorAll('#list li').length === 1")
        assert len(labels(window)) == 1
        href = css(window, "#list a").get_attribute("href")
        assert href.endswith(sliders)
