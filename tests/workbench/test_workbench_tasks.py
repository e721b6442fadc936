"""A person at the workbench does what people come for; what comes out is compared with the library."""

from __future__ import annotations

import time

import numpy as np
import pytest

from graphsynth import Mechanism
from graphsynth.workbench.writing import page_file
from tests.workbench.person import Person, four_bar, mechanism

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif("engine" not in page_file("order.txt").split(), reason="the page has no planar engine"),
]


@pytest.fixture
def at_four_bar(person):
    four_bar(person)
    return person


def fill(person, label, text):
    """Type into the field of the panel with this label."""
    person.script(
        """const labels = [...document.querySelectorAll('#chosen label')];
           const field = labels.find(l => l.firstChild.textContent === arguments[0]);
           const input = field.querySelector('input'); input.value = arguments[1];
           input.dispatchEvent(new Event('change'));""",
        label,
        text,
    )


def known(person):
    return person.script("return document.getElementById('known').innerText")


def template(person, name):
    person.press("[data-do=templates]")
    person.press(f"[data-template={name}]")


def select(person, name):
    person.script(
        """const { points } = Bench.app.sheet;
           Bench.app.select([Object.keys(points).find(id => points[id].name === arguments[0])])""",
        name,
    )


def downloaded(downloads, name, seconds=60):
    path = downloads / name
    end = time.monotonic() + seconds
    while not path.exists():
        assert time.monotonic() < end
        time.sleep(0.05)
    return path


def test_make_the_crank_turn_fully(at_four_bar):
    """Too long a crank only swings; shortened in the panel it turns, and the page says so."""
    person = at_four_bar
    select(person, "B")
    fill(person, "y", "75")
    assert "full turns" not in known(person)
    assert not mechanism(person).simulate().closure.closed
    fill(person, "y", "20")
    assert "full turns" in known(person)
    assert mechanism(person).simulate().closure.closed


def test_play_pause_and_scrub(at_four_bar):
    person = at_four_bar
    person.key(" ")
    person.until("return Bench.app.motion.playing && Math.abs(Bench.app.motion.input) > 0.2")
    person.key(" ")
    person.until("return !Bench.app.motion.playing")
    person.script(
        "const t = document.getElementById('time'); t.value = Math.PI / 2; t.dispatchEvent(new Event('input'))"
    )
    assert person.script("return Bench.app.motion.input") == pytest.approx(np.pi / 2, abs=1e-9)
    assert "90°" in person.script("return document.getElementById('input').textContent")
    page = np.array(person.script("return Array.from(Bench.app.pose)")).reshape(-1, 3)
    person.script("Bench.app.pose = null; Bench.app.changed('sheet')")
    ours = mechanism(person).simulate(np.linspace(0, np.pi / 2, 91)).poses[-1]
    assert np.abs(page - ours).max() < 1e-9 * 80


def test_drag_the_coupler_and_it_follows(at_four_bar):
    person = at_four_bar
    person.key("h")
    where = "return Bench.app.view.now(Bench.app.sheet, Object.keys(Bench.app.sheet.points)[3])"
    before = person.script(where)
    person.drag((-10, 80), (-20, 70), steps=20)
    after = person.script(where)
    assert np.hypot(*np.subtract(after, before)) > 5
    pose = np.array(person.script("return Array.from(Bench.app.motion.engine.pose)")).reshape(-1, 3)
    person.script("Bench.app.pose = null")
    from graphsynth.mechanism.constraints import residual

    assert np.abs(residual(mechanism(person).joints, pose)).max() < 1e-8


def test_trace_a_point_of_the_coupler(at_four_bar):
    person = at_four_bar
    person.tool("trace")
    person.click(-10, 40)
    person.until("return document.querySelectorAll('[data-curve]').length === 1")
    found = mechanism(person)
    (name,) = [n for n in found.points if n != "D"]
    path = found.simulate().point(name).position
    places = person.script(
        """const [id, k, at] = Bench.tracedPoints(Bench.app.sheet)[0];
           return Bench.pathOver(Bench.app.motion, k, at)"""
    )
    assert np.abs(np.array(places) - path).max() < 1e-7 * 80


def test_see_the_limits_of_a_rocker(person):
    """A linkage whose crank only swings: the limits of the page are those of the closed form."""
    given = Mechanism.four_bar(4.0, 3.5, 2.0, 2.2, coupler_point=(1.0, 0.5))
    person.script("Bench.openText(Bench.app, arguments[0])", given.to_json())
    person.until("return Bench.app.motion.driven")
    events = person.script("return Bench.app.motion.sweep().events.map(e => [e.kind, e.input])")
    limits = [value for kind, value in events if kind == "limit"]
    assert len(limits) == 2
    # the pin is as far from the rocker's pivot as coupler and rocker reach
    reach = np.arccos((4.0**2 + 3.5**2 - 4.2**2) / (2 * 4.0 * 3.5))
    (law,) = [driver.law for driver in mechanism(person).drivers]
    assert sorted(limits) == pytest.approx([-reach + law.offset, reach + law.offset], abs=1e-9)
    person.until("return document.querySelectorAll('.mark.limit').length === 2")


def test_change_the_frame_and_the_driver(at_four_bar):
    person = at_four_bar
    key = mechanism(person).graph.key
    buttons = "[...document.querySelectorAll('#known button')]"
    person.script(f"{buttons}.find(b => b.textContent === 'link 2').click()")
    assert person.said() == "The frame is now what was link 2."
    assert mechanism(person).graph.key == key  # a four-bar is a four-bar in every inversion
    person.script(f"{buttons}.find(b => / on /.test(b.textContent)).click()")
    assert mechanism(person).drivers
    assert person.script("return Bench.app.motion.driven")


def test_draw_a_slider_crank(person):
    person.look_at(20, 10, 5)
    person.tool("link")
    person.drag((0, 0), (0, 20))
    person.drag((0, 20), (50, 0))
    person.tool("ground")
    person.click(0, 0)
    person.tool("slider")
    person.drag((50, 0), (70, 0))
    person.tool("driver")
    person.click(0, 0)
    found = mechanism(person)
    motion = found.simulate()
    assert motion.closure.closed and found.graph.links == 4
    stroke = np.ptp(motion.poses[:, 3, 0])
    rod = np.hypot(50, 20)
    assert stroke == pytest.approx((rod + 20) - (rod - 20), rel=1e-3)
    assert "full turns" in known(person)


def test_draw_a_pin_in_a_slot(person):
    """A slotted link led by a crank, the quick return."""
    person.look_at(0, 10, 4)
    person.tool("link")
    person.drag((0, 20), (0, 40))
    person.drag((0, -40), (0, 75))
    person.tool("ground")
    person.click(0, 20)
    person.click(0, -40)
    person.tool("slot")
    person.click(0, 40)
    person.click(0, 60)
    person.tool("driver")
    person.click(0, 20)
    found = mechanism(person)
    assert [j.kind for j in found.joints].count("pin-slot") == 1
    swing = np.ptp(found.simulate().poses[:, 2, 2])
    assert swing == pytest.approx(2 * np.arcsin(20 / 60), rel=1e-3)


def test_draw_gears_of_two_to_one(person):
    person.look_at(0, 0, 4)
    person.tool("gears")
    person.click(-30, 0)
    person.click(30, 0)
    fill(person, "Ratio", "2")
    assert mechanism(person).joints[2].radius_b == pytest.approx(40)
    fill(person, "First radius", "2 cm")
    person.tool("driver")
    person.click(-30, 0)
    motion = mechanism(person).simulate(np.linspace(0, 1, 5))
    assert motion.poses[-1, 2, 2] == pytest.approx(-0.5, abs=1e-9)


def test_numbers_with_units_and_the_panel(at_four_bar):
    person = at_four_bar
    select(person, "E")
    fill(person, "x", "2 in")
    assert mechanism(person).joint(0, 3).at_a == pytest.approx((50.8, 0))
    fill(person, "x", "hello")
    assert "hello" in person.said() and mechanism(person).joint(0, 3).at_a == pytest.approx((50.8, 0))


def test_mirror_and_duplicate(at_four_bar):
    person = at_four_bar
    person.key("v")
    person.key("a", control=True)
    person.key("m", control=True)
    assert mechanism(person).graph.links == 7
    person.key("z", control=True)
    person.key("a", control=True)
    person.key("d", control=True)
    assert mechanism(person).graph.links == 7


def test_export_everything(at_four_bar, downloads):
    person = at_four_bar
    for old in downloads.glob("mechanism.*"):
        old.unlink()
    for name in ("svg", "png", "dxf"):
        person.press(f"[data-do={name}]")
        assert downloaded(downloads, f"mechanism.{name}").stat().st_size > 500
    person.press("[data-do=gif]")
    image = pytest.importorskip("PIL.Image")
    with image.open(downloaded(downloads, "mechanism.gif")) as gif:
        assert gif.n_frames == 60


def test_every_template_opens_and_moves(person):
    for name in person.script("return Bench.templates.map(t => t.name)"):
        template(person, name)
        assert person.script("return Bench.app.motion.driven"), name
        count = person.script("return Bench.app.motion.sweep().inputs.length")
        assert count == 361, name


def test_language_and_colours(at_four_bar):
    person = at_four_bar
    person.script("const s = document.getElementById('language'); s.value = 'ru'; s.dispatchEvent(new Event('change'))")
    assert "Подвижность" in known(person) and person.script("return document.documentElement.lang") == "ru"
    person.script("const s = document.getElementById('theme'); s.value = 'dark'; s.dispatchEvent(new Event('change'))")
    assert person.script("return getComputedStyle(document.body).backgroundColor") == "rgb(18, 24, 31)"


def test_what_is_over_constrained_is_named(person):
    """A truss of three bars on the frame: nothing moves, and the page says where."""
    person.look_at(0, 20, 4)
    person.tool("link")
    person.drag((-40, 0), (0, 40))
    person.drag((0, 40), (40, 0))
    person.tool("ground")
    person.click(-40, 0)
    person.click(40, 0)
    person.tool("driver")
    person.click(-40, 0)
    assert person.script("return document.querySelector('#known .warn').textContent")
    assert mechanism(person).graph.mobility == 0


def test_chains_are_listed_after_other_work_was_done(person):
    """What the worker is handed later is not taken for what it has."""
    person.script("location.hash = '#k=1BgMw8g'")
    person.until("return Object.keys(Bench.app.sheet.links).length === 6", seconds=60)
    person.press("[data-do=chains]")
    person.until("return document.querySelectorAll('#chainList button').length === 2", seconds=60)


def test_click_a_chart_and_the_mechanism_moves(at_four_bar):
    person = at_four_bar
    person.script("document.querySelector('.chart').scrollIntoView()")
    box = person.script(
        "const b = document.querySelector('.chart').getBoundingClientRect(); return [b.left, b.top, b.width, b.height]"
    )
    person.mouse("mousePressed", box[0] + 0.6 * box[2], box[1] + 0.4 * box[3])
    person.mouse("mouseReleased", box[0] + 0.6 * box[2], box[1] + 0.4 * box[3])
    assert person.script("return Bench.app.motion.input") > 1


def test_the_first_motion_takes_less_than_a_second(window, bench):
    """From the address to a moving link, as the page measures it."""
    person = Person(window, bench).open()
    four_bar(person)
    person.press("[data-do=share]")
    person.until("return location.hash.length > 10")
    fragment = person.script("return location.hash")
    person.open(fragment)
    person.until("return Bench.app.motion.driven")
    took = person.script("Bench.app.motion.play(); Bench.app.motion.pass(0.05); return performance.now()")
    print("first motion after", took, "ms")
    assert person.script("return Math.abs(Bench.app.motion.input)") > 0
