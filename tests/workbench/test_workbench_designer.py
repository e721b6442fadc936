"""A designer of mechanisms at the workbench: machines of several kinds, each number beside the library's."""

from __future__ import annotations

import itertools
import json
import math
import time

import numpy as np
import pytest

from graphsynth import Mechanism
from tests.workbench.person import four_bar, mechanism, text

pytestmark = pytest.mark.slow


def places(person):
    found = person.script("return Object.values(Bench.app.posed().points)")
    return {own["name"]: (own["x"], own["y"]) for own in found}


def press(person, words):
    person.script(
        "const all = [...document.querySelectorAll('#known button')];"
        "all.find(own => own.textContent.includes(arguments[0])).click()",
        words,
    )


def trammel(person):
    """A bar of 50 mm between two sliders at right angles, driven along x from 40: both ends are where it lies flat."""
    person.look_at(20, 10, 6)
    person.tool("link")
    person.drag((0, 30), (40, 0))
    person.tool("slider")
    person.drag((0, 30), (0, 50))
    person.drag((40, 0), (70, 0))
    person.tool("driver")
    person.click(40, 0)


def geared_five_bar(person, ratio):
    """Two cranks that gears join, and two bars; the path of the joint between the bars."""
    person.look_at(0, 40, 4)
    person.tool("link")
    for ends in (((-40, 0), (-50, 20)), ((-50, 20), (0, 70)), ((0, 70), (55, 25)), ((55, 25), (40, 0))):
        person.drag(*ends)
    person.tool("ground")
    person.click(-40, 0)
    person.click(40, 0)
    person.tool("gears")
    person.click(-40, 0)
    person.click(40, 0)
    person.tool("driver")
    person.click(-40, 0)
    person.tool("trace")
    person.click(0, 70)
    person.script(
        """const [id] = Object.keys(Bench.app.sheet.pairs);
           Bench.app.attempt(s => ({ sheet: Bench.withTeeth(s, id, 1, arguments[0], false) }))""",
        ratio,
    )


def test_what_an_event_shows_is_what_is_dragged_measured_and_kept(person):
    """An event is gone to in Move, and what is seen there is the drawing in Draw."""
    four_bar(person)
    drawn = places(person)
    person.key("Escape")
    press(person, "Dead centre")
    assert person.script("return Bench.app.mode") == "run"
    there = places(person)
    assert math.dist(there["B"], drawn["B"]) > 5
    person.press("button[data-mode=draw]")
    assert person.script("return Bench.app.pose") is None
    person.click(*there["B"])
    person.key("ArrowRight")
    moved = places(person)
    step = person.script("return Bench.gridStep(Bench.app.view.camera.scale)")
    assert moved["B"] == pytest.approx((there["B"][0] + step, there["B"][1]))
    assert all(moved[name] == pytest.approx(there[name]) for name in "ACDE")
    person.tool("measure")
    person.click(*moved["A"])
    person.click(*moved["C"])
    assert float(person.said().split()[0]) == pytest.approx(math.dist(moved["A"], moved["C"]), rel=1e-5)


def test_another_assembly_is_drawn_on(person):
    four_bar(person)
    person.script("document.querySelector('[data-group=\"0\"]').click()")
    there = places(person)
    person.press("button[data-mode=draw]")
    assert places(person) == there and mechanism(person).simulate().closure.closed


def test_a_film_leaves_the_drawing_as_it_was(person, downloads):
    four_bar(person)
    before = person.script("return [Bench.app.history.at, JSON.stringify(Bench.app.sheet)]")
    (downloads / "mechanism.gif").unlink(missing_ok=True)
    person.press("[data-do=gif]")
    person.until("return document.getElementById('said').textContent.includes('mechanism.gif')", seconds=60)
    assert person.script("return [Bench.app.history.at, JSON.stringify(Bench.app.sheet)]") == before
    assert person.script("return [Bench.app.mode, Bench.app.pose]") == ["draw", None]


def test_keys_in_other_alphabets_and_with_caps_lock(person):
    """Where Cyrillic letters are typed the keys are where they always were; Caps Lock changes none."""
    four_bar(person)
    steps = person.script("return Bench.app.history.at")
    person.key("я", control=True, code="KeyZ")
    assert person.script("return Bench.app.history.at") == steps - 1
    person.key("Я", control=True, shift=True, code="KeyZ")
    assert person.script("return Bench.app.history.at") == steps
    person.key("Z", control=True, code="KeyZ")
    assert person.script("return Bench.app.history.at") == steps - 1
    person.key("д", code="KeyL")
    assert person.script("return Bench.app.tool") == "link"
    person.key("H", code="KeyH")
    assert person.script("return Bench.app.mode") == "run"


@pytest.mark.parametrize(
    "control",
    ["[data-tool=ground]", "#known [data-group]", "#charts select", "#binding input", "#chosen input[type=checkbox]"],
)
def test_the_keyboard_keeps_its_place(person, control):
    """What a key has worked on has the focus still, though it was built anew."""
    four_bar(person)
    person.script("window.before = document.querySelector(arguments[0]); before.focus()", control)
    person.key("ArrowDown" if control.endswith("select") else " ")
    person.until("return !before.isConnected")
    assert person.script("return document.activeElement.matches(arguments[0])", control)


def test_a_dialog_that_a_key_opened_goes_back_to_its_menu(person):
    person.script("document.querySelector('details.menu').open = true")
    person.script("document.querySelector('details.menu [data-do=templates]').focus()")
    person.key("Enter")
    assert person.script("return document.getElementById('gallery').open")
    person.key("Escape")
    person.until("return !document.getElementById('gallery').open")
    assert person.script("return document.activeElement.matches('details.menu > summary')")


def test_a_trammel_ends_where_it_lies_flat_at_both_ends(person):
    trammel(person)
    assert "−90 mm to 10 mm" in text(person, "known")
    assert "Limit at −90 mm" in text(person, "known") and "Limit at 10 mm" in text(person, "known")
    for end in (10.0, -90.0):
        event = mechanism(person).simulate(np.linspace(0.0, 1.05 * end, 40)).events[-1]
        assert event.kind == "fold" and event.input == pytest.approx(end)
    person.script("Bench.app.motion.to(11)")
    assert person.said() == "Limit at 10 mm"


def test_a_slot_is_seen_in_its_bar(person):
    person.look_at(0, 0, 5)
    person.tool("link")
    person.drag((0, 0), (20, 0))
    person.drag((0, -40), (40, 40))
    person.tool("slot")
    person.drag((20, 0), (10, -20))
    person.look()
    names = person.script(
        "return [...document.querySelector('[data-layer=links] .slot').parentElement.children].map(e => e.classList[0])"
    )
    assert names.index("slot") > names.index("body")


@pytest.mark.parametrize(("ratio", "says"), [(2, "closes after 2"), (1.7, "does not close within 6")])
def test_a_path_that_does_not_close_is_open_in_cad(person, downloads, ratio, says):
    ezdxf = pytest.importorskip("ezdxf")
    geared_five_bar(person, ratio)
    assert f"full turns; {says}" in text(person, "known")
    assert mechanism(person).simulate().closure.period == (2 if ratio == 2 else 0)
    path = downloads / "mechanism.dxf"
    path.unlink(missing_ok=True)
    person.press("[data-do=dxf]")
    person.until("return document.getElementById('said').textContent.includes('mechanism.dxf')")
    time.sleep(0.3)
    (line,) = (own for own in ezdxf.readfile(path).modelspace().query("POLYLINE") if own.dxf.layer == "PATHS")
    assert line.is_closed is (ratio == 2)
    seen = np.array([tuple(vertex.dxf.location)[:2] for vertex in line.vertices])
    turns = np.linspace(0.0, math.tau * (2 if ratio == 2 else 1), len(seen))
    assert np.abs(seen - mechanism(person).simulate(turns).point("C").position).max() < 1e-9


def test_what_gears_do_not_bind_and_what_the_library_proves_is_said(person):
    geared_five_bar(person, 2)
    press(person, "Prove the motion")
    person.until("return document.getElementById('python').open", seconds=60)
    assert "python prove.py" in person.said()
    person.press("#python [data-close]")
    person.press("[data-do=fresh]")
    person.tool("gears")
    person.click(-20, 0)
    person.click(20, 0)
    person.tool("driver")
    person.click(-20, 0)
    person.script("document.querySelector('#binding input').click()")
    person.until("return document.getElementById('jammed')")
    assert text(person, "jammed") == "Free here, however far it tilts (estimated)."


def test_a_stopped_proof_says_so(person):
    person.press("[data-do=templates]")
    person.press("[data-template=jansen]")
    person.script("document.querySelector('#binding input').click()")
    person.until("return document.querySelector('[data-prove]')")
    person.script("document.querySelector('[data-prove]').click()")
    person.until("return Bench.app.work.busy")
    person.script("document.querySelector('[data-prove]').click()")
    assert person.said() == "Stopped."


def test_the_least_transmission_angle_names_the_groups_that_have_one(person):
    """Cylinders are groups of three links, which have none: the angle is that of the dyads, as in the library."""
    for name, of in (("excavator_arm", " of dyads"), ("whitworth_quick_return", "")):
        person.press("[data-do=templates]")
        person.press(f"[data-template={name}]")
        assert f"Least transmission angle{of}\n" in text(person, "known")


def test_each_driver_has_a_range_of_its_own(person):
    """A five-bar with two cranks: the range that is shown is that of the driver that is chosen, the other one held."""
    person.look_at(0, 40, 4)
    person.tool("link")
    for ends in (((-30, 0), (-60, 40)), ((-60, 40), (0, 80)), ((0, 80), (60, 60)), ((60, 60), (30, 0))):
        person.drag(*ends)
    for tool in ("ground", "driver"):
        person.tool(tool)
        person.click(-30, 0)
        person.click(30, 0)
    person.script("const w = document.getElementById('which'); w.value = 1; w.dispatchEvent(new Event('change'))")
    low, high = person.script("const s = Bench.app.motion.sweep().inputs; return [s[0], s[s.length - 1]]")
    shown = [f"{math.degrees(end):.4g}".replace("-", "−") for end in (low, high)]
    assert f"{shown[0]}° to {shown[1]}°" in text(person, "known")
    data = person.drawn()
    data["drivers"][0]["law"] = {"kind": "polynomial", "coefficients": [0.0]}
    for end in (low, high):
        event = Mechanism.from_json(json.dumps(data)).simulate(np.linspace(0.0, 1.05 * end, 400)).events[-1]
        assert event.ends_motion and event.input == pytest.approx(end)


def test_another_language_is_spoken_at_once(person):
    four_bar(person)
    person.press("[data-certify]")
    person.until("return document.getElementById('proved')", seconds=60)
    person.press("[data-do=chains]")
    person.until("return document.querySelectorAll('#chainList button').length === 2", seconds=60)
    person.script("document.getElementById('chains').close()")
    person.script("const s = document.getElementById('language'); s.value = 'ru'; s.dispatchEvent(new Event('change'))")
    assert text(person, "proved").startswith("Доказано") and person.said().startswith("Привод")
    person.press("[data-do=chains]")
    person.until("return document.querySelectorAll('#chainList button').length === 2", seconds=60)
    assert "цепь Уатта" in person.script("return document.getElementById('chainList').textContent")


def test_mechanisms_that_were_found_are_as_large_in_another_unit(person):
    """What was found for poses in millimetres goes through the same poses after the drawing is in inches."""
    person.look_at(40, 0, 3)
    person.tool("poses")
    for x, y, turn in ((0, 0, 0.0), (40, 20, 0.5), (70, 10, 1.2)):
        person.drag((x, y), (x + 20 * math.cos(turn), y + 20 * math.sin(turn)))
    person.press("[data-passing]")
    person.until("return document.getElementById('candidates').open", seconds=120)
    before = mechanism(person)
    person.script("document.getElementById('candidates').close()")
    person.script("const u = document.getElementById('unit'); u.value = 'in'; u.dispatchEvent(new Event('change'))")
    person.press("[data-do=candidates]")
    person.script("document.querySelector('#candidateList button').click()")
    sizes = [[math.dist(*own) for own in joints] for joints in (pivots(before), pivots(mechanism(person)))]
    assert sizes[1] == pytest.approx([size / 25.4 for size in sizes[0]])


def pivots(found):
    """Pairs of places of successive joints."""
    places = [joint.at_a for joint in found.joints]
    return list(itertools.pairwise(places))


@pytest.mark.parametrize("change", ["move", "drive", "undo"])
def test_a_measure_is_gone_when_what_it_measured_moves(person, change):
    four_bar(person)
    person.tool("measure")
    person.click(-40, 0)
    person.click(30, 60)
    person.look()
    assert person.script("return document.querySelectorAll('.measure').length") == 1
    if change == "move":
        person.script("Bench.app.attempt(s => ({ sheet: Bench.placed(s, { [Object.keys(s.points)[2]]: [30, 65] }) }))")
    elif change == "drive":
        person.script("Bench.app.motion.to(0.5)")
    else:
        person.press("#undo")
    person.look()
    assert person.script("return document.querySelectorAll('.measure').length") == 0
