"""The page in a real Chromium: drawn on with mouse, fingers and keys, saved, shared, opened again."""

from __future__ import annotations

import json
import time

import pytest

from graphsynth import Mechanism
from tests.workbench.person import Person, four_bar

pytestmark = pytest.mark.long


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


@pytest.mark.parametrize("size", [(568, 320), (740, 360), (932, 430)])
@pytest.mark.parametrize("language", ["en", "ru"])
def test_a_phone_held_across_leaves_room_for_the_drawing(window, bench, size, language):
    """Tools and panel stand beside the drawing, which is seen whole; nothing of the bars is cut off."""
    person = Person(window, bench, size, mobile=True).open("#t=jansen", language)
    person.look()
    boxes = person.script(
        """return [...["sheet", "player", "undo", "tools", "chosen", "said"].map(id => document.getElementById(id)),
             ...document.querySelectorAll(".top>*, #player>*")].filter(own => own.id === "sheet" || own.offsetWidth)
             .map(own => { const b = own.getBoundingClientRect(); return [b.left, b.top, b.right, b.bottom]; })"""
    )
    (left, top, right, bottom), player = boxes[:2]
    assert bottom - top > 0.7 * size[1] and right - left > 0.45 * size[0]
    assert all(box[0] >= 0 and box[2] <= size[0] and box[1] < size[1] for box in boxes)
    assert player[3] - player[1] < 60
    assert person.script(
        "return Bench.app.view.holds(Bench.boxWithPaths(Bench.app), document.getElementById('player').offsetHeight)"
    )


def test_another_unit_and_places_on_a_picture(person):
    """What is seen stays where it is in another unit, also after undo; places on a picture do not snap to the grid."""
    four_bar(person)
    before = person.pixels(40, 0)
    choose = "const u = document.getElementById('unit'); u.value = arguments[0]; u.dispatchEvent(new Event('change'))"
    person.script(choose, "in")
    assert person.said() == "Changed."
    assert Mechanism.from_json(json.dumps(person.drawn())).joint(0, 3).at_a == pytest.approx((40 / 25.4, 0))
    assert person.pixels(40 / 25.4, 0) == pytest.approx(before)
    person.key("z", control=True)
    assert person.pixels(40, 0) == pytest.approx(before)
    pick = "const app = Bench.app; app.tool = arguments[0]; return Bench.stage.pickAt(app.view.px([13.1, -7.3]))"
    picked = [person.script(pick, tool)[c] for tool in ("picture", "link") for c in "xy"]
    assert picked == pytest.approx([13.1, -7.3, 15, -5])


def test_each_link_at_a_multiple_joint_can_be_driven(person):
    """The panel lists them; the speed changes also while the mechanism is moved, and a fault is not left standing."""
    four_bar(person)
    person.tool("link")
    person.drag((-40, 0), (-80, 30))
    person.script(
        "const { points } = Bench.app.sheet;Bench.app.select([Object.keys(points).find(id => points[id].name === 'A')])"
    )
    boxes = "[...document.querySelectorAll('#chosen label.check')].filter(own => /^driven/.test(own.textContent))"
    assert person.script(f"return {boxes}.map(own => own.textContent)") == [
        "driven: link 1 on frame",
        "driven: link 4 on frame",
    ]
    person.script(f"{boxes}[1].querySelector('input').click()")
    assert [driver["link"] for driver in person.drawn()["drivers"]] == [1, 4]
    person.script("Bench.app.motion.to(0.3); Bench.app.changed('rest')")
    speed = """const all = [...document.querySelectorAll('#chosen label.field')];
               const input = all.find(own => own.textContent === 'Speed').querySelector('input');
               input.value = arguments[0]; input.dispatchEvent(new Event('change'))"""
    person.script(speed, "fast")
    assert "fast" in person.said()
    person.script(speed, "2")
    assert person.said() == "Changed."
    mechanism = Mechanism.from_json(json.dumps(person.drawn()))
    assert [driver.law.rate for driver in mechanism.drivers] == [2, 1]
    assert mechanism.simulate().assembled.all()
    # a new drawing: nothing of the old one is left, what was wanted neither
    person.script("Bench.app.poses = [[0, 0, 0]]; Bench.app.target = { curve: [[0, 0], [1, 1]], closed: false }")
    person.press("[data-do=fresh]")
    person.look()
    assert person.script("return document.querySelectorAll('[data-layer=target] *').length") == 0


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
