"""The page in a real Chromium: drawn on with mouse, fingers and keys, saved, shared, opened again."""

from __future__ import annotations

import json
import time

import pytest

from graphsynth import Mechanism
from tests.workbench.person import Person, four_bar

pytestmark = pytest.mark.long


@pytest.fixture
def person(window, bench):
    window.get_log("browser")
    someone = Person(window, bench).open()
    yield someone
    assert not someone.complaints()


def drawn_four_bar(data):
    mechanism = Mechanism.from_json(json.dumps(data))
    assert mechanism.graph.links == 4 and mechanism.graph.mobility == 1
    assert mechanism.simulate().closure.closed
    return mechanism


def test_a_four_bar_is_drawn_with_the_mouse_and_undone(person):
    four_bar(person)
    data = person.drawn()
    drawn_four_bar(data)
    assert person.script("return Bench.app.history.all.length") == 7
    for _ in range(6):
        person.key("z", control=True)
    assert person.drawn()["joints"] == []
    for _ in range(6):
        person.key("y", control=True)
    assert person.drawn() == data


def test_a_four_bar_is_drawn_with_fingers_on_a_phone(window, bench):
    person = Person(window, bench, (390, 844), mobile=True).open()
    person.look_at(0, 40, 3)
    person.tool("link")
    person.drag((-40, 0), (-40, 20))
    person.drag((-40, 20), (30, 60))
    person.drag((30, 60), (40, 0))
    person.tool("ground")
    person.click(-40, 0)
    person.click(40, 0)
    person.tool("driver")
    person.click(-40, 0)
    drawn_four_bar(person.drawn())
    before = person.script("return Bench.app.view.camera.scale")
    (x, y) = person.pixels(0, 40)
    person.touch("touchStart", (x - 30, y), (x + 30, y))
    for k in range(1, 6):
        person.touch("touchMove", (x - 30 - 6 * k, y), (x + 30 + 6 * k, y))
    person.touch("touchEnd")
    assert person.script("return Bench.app.view.camera.scale") == pytest.approx(2 * before, rel=0.02)


def test_a_four_bar_is_drawn_with_keys_alone(person):
    def at(x, y):
        person.script("Bench.stage.cursor = {x: arguments[0], y: arguments[1]}", x, y)
        for way in ("ArrowRight", "ArrowLeft"):
            person.key(way)
        person.key("Enter")

    person.look_at(0, 40, 4)
    person.script("document.getElementById('sheet').focus()")
    person.key("l")
    for place in ((-40, 0), (-40, 20), (-40, 20), (30, 60), (30, 60), (40, 0)):
        at(*place)
    person.key("g")
    at(-40, 0)
    at(40, 0)
    person.key("d")
    at(-40, 0)
    drawn_four_bar(person.drawn())


def test_the_address_brings_the_drawing_to_another_window(person):
    four_bar(person)
    data = person.drawn()
    person.press("[data-do=share]")
    person.until("return location.hash.length > 10")
    fragment = person.script("return location.hash")
    person.open(fragment)
    person.until("return Object.keys(Bench.app.sheet.points).length > 0")
    again = person.drawn()
    assert again == data


@pytest.mark.parametrize(("what", "name"), [("save", "mechanism.toml"), ("saveJson", "mechanism.json")])
def test_a_saved_file_is_the_mechanism(person, downloads, what, name):
    four_bar(person)
    path = downloads / name
    path.unlink(missing_ok=True)
    person.press(f"[data-do={what}]")
    end = time.monotonic() + 10
    while not path.exists():
        assert time.monotonic() < end
        time.sleep(0.05)
    text = path.read_text("utf-8")
    read = Mechanism.from_toml(text) if name.endswith("toml") else Mechanism.from_json(text)
    assert read == Mechanism.from_json(json.dumps(person.drawn()))


def test_a_drawing_comes_back_after_the_page_was_closed(person):
    four_bar(person)
    data = person.drawn()
    time.sleep(0.8)
    person.window.get("about:blank")
    person.window.get(person.page.as_uri())
    person.until("return Object.keys(Bench.app.sheet.points).length > 0")
    assert person.drawn() == data
