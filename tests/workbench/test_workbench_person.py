"""Tasks for someone at the workbench, on a desktop and on a phone: one list, every one with a picture of its end.

``WORKBENCH_PICTURES=FOLDER`` keeps the pictures.
"""

from __future__ import annotations

import math
import os
import re
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

from graphsynth import Mechanism
from tests.workbench.person import Person, four_bar, mechanism, text

pytestmark = pytest.mark.slow
DEVICES = {"desktop": ((1280, 800), False), "phone": ((390, 844), True)}
KEY = "1BAN4"


def choose(person, name):
    person.script(
        "const p = Bench.app.sheet.points; Bench.app.select([Object.keys(p).find(id => p[id].name === arguments[0])])",
        name,
    )


def fill(person, place, label, value):
    person.script(
        """const all = [...document.querySelectorAll(`#${arguments[0]} label`)], name = Bench.word(arguments[1]);
           const input = all.find(l => l.textContent.trim().startsWith(name)).querySelector("input, select");
           input.value = arguments[2]; input.dispatchEvent(new Event("change"))""",
        place,
        label,
        value,
    )


def put(person, place, value):
    person.script(
        "const s = document.getElementById(arguments[0]); s.value = arguments[1]; s.dispatchEvent(new Event('change'))",
        place,
        value,
    )


def press(person, words, place="known"):
    person.script(
        "const all = [...document.querySelectorAll(`#${arguments[1]} button`)];"
        "const own = all.find(b => b.textContent === arguments[0]);"
        "(own || all.find(b => b.textContent.includes(arguments[0]))).click()",
        words,
        place,
    )


def file(downloads, name):
    path, end = downloads / name, time.monotonic() + 60
    while not path.exists():
        assert time.monotonic() < end, name
        time.sleep(0.05)
    return path


def draw_a_four_bar(person, downloads):
    found = mechanism(person)
    assert found.graph.without_frame().key == KEY and len(found.drivers) == 1


def make_the_crank_turn_fully(person, downloads):
    choose(person, "B")
    fill(person, "chosen", "panel.y", "75")
    assert "full turns" not in text(person, "known")
    fill(person, "chosen", "panel.y", "20")
    assert "full turns" in text(person, "known") and mechanism(person).simulate().closure.closed


def trace_a_point_of_the_coupler(person, downloads):
    person.tool("trace")
    person.click(-10, 50)
    person.until("return document.querySelectorAll('[data-curve]').length === 1")


def play_and_pause(person, downloads):
    person.press("#play")
    person.until("return Bench.app.motion.playing && Math.abs(Bench.app.motion.input) > 0.2")
    person.press("#play")
    person.until("return !Bench.app.motion.playing")


def scrub_to_a_right_angle(person, downloads):
    person.script(
        "const t = document.getElementById('time'); t.value = Math.PI / 2; t.dispatchEvent(new Event('input'))"
    )
    assert "90" in text(person, "input")
    page = np.array(person.script("return Array.from(Bench.app.pose)")).reshape(-1, 3)
    person.script("Bench.app.pose = null; Bench.app.changed('sheet')")
    ours = mechanism(person).simulate(np.linspace(0, np.pi / 2, 91)).poses[-1]
    assert np.abs(page - ours).max() < 1e-7


def drag_the_coupler(person, downloads):
    person.press("button[data-mode=run]")
    before = person.script("return Bench.app.motion.input")
    person.drag((-10, 80), (-20, 72), steps=12)
    assert abs(person.script("return Bench.app.motion.input") - before) > 0.05


def assemble_it_otherwise(person, downloads):
    before = np.array(person.script("return Array.from(Bench.app.motion.engine.pose)"))
    person.script("document.querySelector('[data-group=\"0\"]').click()")
    after = np.array(person.script("return Array.from(Bench.app.motion.engine.pose)"))
    assert np.abs(after - before)[3:6].max() < 1e-12 < 0.1 < np.abs(after - before).max()
    assert person.script("return Bench.app.view.holds(Bench.box(Bench.app.posed()))")  # nothing has left the window


def tilt_the_axis_until_it_binds(person, downloads):
    from graphsynth.jamming.joints import JointLimits, Misalignment
    from graphsynth.jamming.joints.assess import assess_coupled

    person.script("document.querySelector('#binding input').click()")
    person.until("return document.getElementById('jammed')")
    fill(person, "binding", "jam.alpha", "0.2")
    assert "binds here" not in text(person, "jammed")
    fill(person, "binding", "jam.alpha", "3")
    assert "binds here" in text(person, "jammed")
    factors = person.script("return Array.from(Bench.app.jamming.whole().factors)")
    motion = mechanism(person).simulate(np.linspace(0.0, math.tau, len(factors)))
    limits = {own: JointLimits(math.radians(0.5), 0.0) for own in ((1, 2), (2, 3), (0, 3))}
    theirs = assess_coupled(motion, limits, Misalignment(0, 1, math.radians(3.0), 0.0, rigid=True))
    assert factors == pytest.approx(theirs.factor.tolist(), rel=1e-6)


def prove_that_it_binds(person, downloads):
    tilt = "document.querySelector('#binding input').click()"
    person.script(tilt)
    person.until("return document.querySelector('[data-prove]')")
    fill(person, "binding", "jam.alpha", "3")
    person.script("document.querySelector('[data-prove]').click()")
    person.until("return document.getElementById('jamProved')", seconds=60)
    assert text(person, "jamProved").startswith("Proved: it binds everywhere in the motion, most at 3")
    fill(person, "binding", "jam.alpha", "1.2")
    person.script("document.querySelector('[data-prove]').click()")
    person.until("return document.getElementById('jamProved')", seconds=60)
    shares = [float(part) for part in re.findall(r"([0-9.]+) %", text(person, "jamProved"))]
    assert len(shares) == 2 and min(shares) > 1.0 and sum(shares) <= 100.0
    person.script("document.querySelector('[data-program]').click()")
    program = person.script("return document.getElementById('snippet').value")
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, timeout=300, check=True)
    assert done.stdout.startswith("Proved: it binds")
    assert "python prove.py" in person.script("return document.getElementById('pythonAbout').textContent")
    (downloads / "prove.py").unlink(missing_ok=True)
    person.script("document.querySelector('[data-do=savePython]').click()")
    assert file(downloads, "prove.py").read_text("utf-8") == program


def find_its_chain_and_relatives(person, downloads):
    assert KEY in text(person, "known")
    person.script("document.querySelector('[data-kin]').click()")
    person.until("return document.querySelectorAll('#kinLarger button').length === 2", seconds=40)


def change_the_frame(person, downloads):
    press(person, "link 2")
    assert "what was link 2" in person.said() and mechanism(person).graph.without_frame().key == KEY


def change_the_driver(person, downloads):
    press(person, " on ")
    assert len(mechanism(person).drivers) == 1


def share_it_and_open_the_link(person, downloads):
    data = person.drawn()
    person.press("[data-do=share]")
    person.until("return location.hash.length > 10")
    fragment = person.script("return location.hash")
    person.open(fragment)
    person.until("return Object.keys(Bench.app.sheet.points).length > 0")
    assert person.drawn() == data


def save_it_for_the_library(person, downloads):
    (downloads / "mechanism.toml").unlink(missing_ok=True)
    person.press("[data-do=save]")
    assert Mechanism.from_toml(file(downloads, "mechanism.toml").read_text("utf-8")) == mechanism(person)


def export_a_drawing_for_cad(person, downloads):
    (downloads / "mechanism.dxf").unlink(missing_ok=True)
    person.press("[data-do=dxf]")
    assert "ENTITIES" in file(downloads, "mechanism.dxf").read_text("utf-8")


def take_the_python_for_it(person, downloads):
    person.press("[data-do=python]")
    program = person.script("return document.getElementById('snippet').value")
    assert "Mechanism" in program
    names: dict[str, object] = {}
    exec(program.split("motion =")[0], names)
    assert names["mechanism"].graph == mechanism(person).graph


def take_a_chain_from_the_list(person, downloads):
    person.press("[data-do=chains]")
    person.until("return document.querySelectorAll('#chainList button').length === 2", seconds=60)
    person.script("document.querySelectorAll('#chainList button')[0].click()")
    person.until("return !document.getElementById('chains').open", seconds=60)
    assert mechanism(person).graph.links == 6 and "turn fully" in person.said()


def count_the_chains_of_sixteen_links(person, downloads):
    person.press("[data-do=chains]")
    person.until("return document.querySelectorAll('#chainList button').length === 2", seconds=60)
    for links, count in (("14", "318,162"), ("16", "19,819,281")):
        put(person, "chainLinks", links)
        person.until(
            "return document.getElementById('chainCount').textContent.includes(arguments[0])", count, seconds=120
        )


def draw_a_wanted_curve(person, downloads):
    person.press("[data-do=fresh]")
    person.look_at(0, 0, 2.5)
    person.tool("target")
    turns = [2 * math.pi * k / 60 for k in range(61)]
    way = [
        person.pixels(50 * math.cos(t) * (1 + 0.25 * math.cos(t)), 30 * math.sin(t) + 8 * math.sin(2 * t))
        for t in turns
    ]
    if person.mobile:
        person.touch("touchStart", way[0])
        for place in way[1:]:
            person.touch("touchMove", place)
        person.touch("touchEnd")
    else:
        person.mouse("mouseMoved", *way[0], 0)
        person.mouse("mousePressed", *way[0])
        for place in way[1:]:
            person.mouse("mouseMoved", *place)
        person.mouse("mouseReleased", *way[-1])
    person.until("return document.getElementById('candidates').open", seconds=240)
    assert person.script("return Bench.app.candidates[0].error") < 0.02
    assert mechanism(person).simulate().closure.closed


def measure_a_distance(person, downloads):
    person.tool("measure")
    person.click(-40, 0)
    person.click(40, 0)
    assert person.said().startswith("80 mm")


def ask_for_a_body_in_three_poses(person, downloads):
    person.press("[data-do=fresh]")
    person.look_at(40, 0, 1.6 if person.mobile else 3)
    person.tool("poses")
    for x, y, turn in ((0, 0, 0.0), (40, 20, 0.5), (70, 10, 1.2)):
        person.drag((x, y), (x + 20 * math.cos(turn), y + 20 * math.sin(turn)))
        # the panel grows with the poses, and on a phone the drawing makes room
        person.until("return Bench.app.view.height === document.getElementById('sheet').getBoundingClientRect().height")
    person.until("return Bench.app.poses.length === 3")
    fill(person, "chosen", "panel.angle", "0")
    person.press("[data-passing]")
    person.until("return document.getElementById('candidates').open", seconds=240)
    assert person.script("return Bench.app.candidates[0].quality") > 0.3
    assert mechanism(person).graph.without_frame().key == KEY


def undo_all_and_do_it_again(person, downloads):
    data, steps = person.drawn(), person.script("return Bench.app.history.at")
    for _ in range(steps):
        person.press("#undo")
    assert person.drawn()["joints"] == []
    for _ in range(steps):
        person.press("#redo")
    assert person.drawn() == data


def see_velocities_of_a_template_in_russian_and_dark(person, downloads):
    person.press("[data-do=templates]")
    person.press("[data-template=klann]")
    person.press("[data-do=velocity]")
    person.press("button[data-mode=run]")
    for place, value in (("language", "ru"), ("theme", "dark")):
        put(person, place, value)
    person.until("return document.querySelectorAll('.arrow.velocity').length > 3")
    assert "Подвижность" in text(person, "known")


def prove_the_motion(person, downloads):
    person.press("[data-certify]")
    person.until("return document.getElementById('proved')", seconds=60)
    assert "turns fully" in text(person, "proved")
    person.press("#undo")  # another drawing, nothing proved
    assert person.script("return document.getElementById('proved')") is None
    person.press("[data-do=templates]")
    person.press("[data-template=excavator_arm]")
    person.press("[data-certify]")
    person.until("return Bench.app.work.busy")
    person.press("#undo")  # minutes of work that nobody waits for
    person.until("return !Bench.app.work.busy && Bench.app.proof === null")


def see_what_the_menus_have(person, downloads):
    """Nothing is cut off by the window, and nothing is written in the colour of its ground."""
    seen = person.script(
        """return [...document.querySelectorAll("details.menu")].map(menu => {
             menu.open = true;
             const list = menu.querySelector("div"), box = list.getBoundingClientRect();
             const paper = getComputedStyle(list).backgroundColor;
             const inks = [...menu.querySelectorAll("button")].map(own => getComputedStyle(own).color);
             menu.open = false;
             return [box.left >= 0 && box.right <= innerWidth, inks.every(ink => ink !== paper)];
           })"""
    )
    assert len(seen) == 4 and all(map(all, seen))


TASKS = [
    draw_a_four_bar, make_the_crank_turn_fully, trace_a_point_of_the_coupler, play_and_pause, scrub_to_a_right_angle,
    drag_the_coupler, assemble_it_otherwise, tilt_the_axis_until_it_binds, prove_that_it_binds,
    find_its_chain_and_relatives, change_the_frame, change_the_driver, share_it_and_open_the_link,
    save_it_for_the_library, export_a_drawing_for_cad, take_the_python_for_it, take_a_chain_from_the_list,
    count_the_chains_of_sixteen_links, draw_a_wanted_curve, ask_for_a_body_in_three_poses,
    measure_a_distance, undo_all_and_do_it_again,
    see_velocities_of_a_template_in_russian_and_dark, prove_the_motion, see_what_the_menus_have,
]  # fmt: skip


@pytest.mark.parametrize("device", DEVICES)
@pytest.mark.parametrize("task", TASKS, ids=lambda task: task.__name__)
def test_task(window, bench, downloads, task, device):
    window.get_log("browser")
    size, mobile = DEVICES[device]
    person = Person(window, bench, size, mobile).open()
    four_bar(person)
    task(person, downloads)
    if os.environ.get("WORKBENCH_PICTURES"):
        time.sleep(0.3)
        person.picture(Path(os.environ["WORKBENCH_PICTURES"]) / f"{task.__name__}-{device}.png")
    assert not person.complaints()


def test_a_hundred_loads_animate_in_step(window, bench):
    """From the address to the moving link, a hundred times: what is drawn is the pose of the driver's coordinate."""
    person = Person(window, bench).open()
    four_bar(person)
    person.press("[data-do=share]")
    person.until("return location.hash.length > 10")
    address = bench.as_uri() + person.script("return location.hash")
    for _ in range(100):
        window.get("about:blank")
        window.get(address)
        person.until("return document.body.dataset.ready !== undefined && Bench.app.motion.driven")
        person.script("Bench.app.motion.play()")
        person.until("return Math.abs(Bench.app.motion.input) > 0.05")
        off = person.script(
            """const { motion, view, sheet } = Bench.app, k = motion.engine.number(motion.engine.drawn.drivers[0]);
               motion.pause(); view.show(sheet);
               const pose = motion.engine.pose, group = view.groups[1][1].getAttribute("transform");
               const shown = -parseFloat(/rotate\\(([-\\d.]+)/.exec(group)[1]) * Math.PI / 180;
               return [Math.abs(pose[5] - motion.input), Math.abs(shown - pose[5])]"""
        )
        assert off[0] < 1e-9 and off[1] < 1e-5
    assert not person.complaints()
